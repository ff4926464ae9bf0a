//! Reports: figures, tables and sentences out of rows. Nothing here renders.
//!
//! [`write()`] is the whole of it: rows → [`summarise()`] → figures, tables, `report.md`, and the same as the page `report.html`.
pub mod bias_variance;
pub mod coupling;
pub mod dots;
pub mod evidence;
pub mod figure;
pub mod frame;
pub mod gallery;
pub mod markdown;
pub mod numbers;
pub mod page;
pub mod pairing;
pub mod pareto;
pub mod pictures;
pub mod plots;
pub mod provenance;
pub mod reach;
pub mod shares;
pub mod shots;
pub mod spectra;
pub mod stability;
pub mod style;
pub mod summarise;
pub mod tables;
pub mod verdicts;

mod ablation;
mod axis;
mod charts;
mod details;
mod labels;
mod legend;
mod pictured;
mod sections;
mod tiles;
mod write;

pub use sections::{Measurements, report as text, report_with as text_with};
pub use summarise::{Summary, summarise};
pub use write::{FigureState, Figures, Written, write};

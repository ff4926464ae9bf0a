//! Reports: figures, tables and sentences out of rows.
pub mod bias_variance;
pub mod figure;
pub mod frame;
pub mod pareto;
pub mod pictures;
pub mod plots;
pub mod style;

mod axis;
mod labels;
mod legend;

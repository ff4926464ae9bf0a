//! How fast the lab is: scenes of stated size made in memory, and what is measured on them.
//!
//! A [`Case`] is one thing that is measured; the cases of a group are repeated in turn, so that what slows the machine for a
//! while slows all of them. What is found here depends on a clock, so none of it is ever recorded in an experiment's rows.

mod cases;
mod growth;
mod lab;
mod memory;
mod rays;
mod renders;
mod samplers;
pub mod scenes;
mod summary;
mod timing;
mod work;

pub use cases::{GROUPS, names, select};
pub use lab::{Lab, write_cornell};
pub use rays::{Batches, KINDS, Kind, Query, all_kinds};
pub use summary::{Found, median_interval, table};
pub use timing::{Case, Part, run};

/// The machine that the numbers come from: operating system, architecture, processor, threads.
pub fn host() -> String {
    crate::experiment::machine::describe()
}

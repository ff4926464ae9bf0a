//! How fast the lab is: scenes of stated size made in memory, and what is measured on them.
//!
//! What is found here depends on a clock, so none of it is ever recorded in an experiment's rows.
pub mod scenes;

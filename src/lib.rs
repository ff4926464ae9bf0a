//! What does the choice of sample points do to a rendered image? Answered with numbers.
pub mod accel;
pub mod analytic;
pub mod bench;
pub mod check;
pub mod compare;
pub mod error;
pub mod experiment;
pub mod film;
pub mod mutants;
pub mod points;
pub mod render;
pub mod report;
pub mod sampling;
pub mod scene;
pub mod stats;
pub mod view;

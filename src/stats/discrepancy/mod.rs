//! How even is a point set? Exact star discrepancy, L2 discrepancies, nets, distances.
//!
//! Points lie in the closed unit cube [0, 1]^d: a coordinate of exactly 1 is no sample, but it has a measure.

mod l2;
mod nets;
mod points;
mod star;

pub use l2::{L2Kind, l2_root, l2_squared};
pub use nets::{min_toroidal_distance, t_value};
pub use points::{Points, PointsError};
pub use star::{CostTooHigh, Side, Star, star, star_1d, star_2d, star_cost};

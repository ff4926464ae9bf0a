//! How even is a point set? Exact star discrepancy, L2 discrepancies, nets, distances.
//!
//! Points lie in the closed unit cube [0, 1]^d: a coordinate of exactly 1 is no sample, but it has a measure.

mod boxes;
pub(super) mod double;
mod l2;
mod nets;
mod ordered;
mod plane;
mod points;
mod star;
mod tournament;

pub use l2::{L2Kind, L2Value, l2, l2_all, l2_root, l2_squared};
pub use nets::{MAX_PAIRED_DIMENSION, Projection, filled_strata, min_toroidal_distance, t_of_projections, t_value};
pub use points::{Points, PointsError};
pub use star::{CostTooHigh, STAR_COST_LIMIT, Side, Star, star, star_1d, star_2d, star_cost};

#[cfg(test)]
mod testing {
    use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

    /// Property tests that draw the same cases every time and leave no files behind.
    pub fn runner(cases: u32) -> TestRunner {
        let config = Config { cases, failure_persistence: None, ..Config::default() };
        TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &[1; 32]))
    }
}

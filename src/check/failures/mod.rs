//! Where methods fail, each failure stated as a fact that holds.
//!
//! A check carries out the method that fails, as people write it, beside what this lab does on the same input, and
//! asserts both: the failure with its measured number, and its absence. The method that fails stands in the check itself
//! and nowhere else.

mod common;
mod correlation;
mod counts;
mod domains;
mod metrics;
mod net_counts;
mod numbers;
mod rendering;
mod room;
mod scrambles;
mod sharing;
mod statistics;

use super::Check;

/// The checks of all groups of failures.
pub fn checks() -> Vec<Check> {
    [
        numbers::checks(),
        correlation::checks(),
        sharing::checks(),
        counts::checks(),
        net_counts::checks(),
        domains::checks(),
        scrambles::checks(),
        statistics::checks(),
        rendering::checks(),
        metrics::checks(),
    ]
    .concat()
}

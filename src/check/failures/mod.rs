//! Where methods fail, each failure stated as a fact that holds.

pub mod rendering;

use super::Check;

/// The checks of all groups of failures.
pub fn checks() -> Vec<Check> {
    [rendering::checks()].concat()
}

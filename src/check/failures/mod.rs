//! Where methods fail, each failure stated as a fact that holds.

mod statistics;

use super::Check;

/// The checks of all groups of failures.
pub fn checks() -> Vec<Check> {
    [statistics::checks()].concat()
}

//! The harness tests itself: false-alarm rates and power.

use super::Check;

/// The checks of this group.
pub fn checks() -> Vec<Check> {
    Vec::new()
}

//! Point-set metrics against exact values and slow twins.

use super::Check;

/// The checks of this group.
pub fn checks() -> Vec<Check> {
    Vec::new()
}

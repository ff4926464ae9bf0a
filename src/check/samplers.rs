//! Samplers against exact variances, nets and marginals.

use super::Check;

/// The checks of this group.
pub fn checks() -> Vec<Check> {
    Vec::new()
}

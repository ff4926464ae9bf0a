//! The quickest test of each kernel: what planted bugs are caught by first.
//!
//! Small on purpose: a few milliseconds each, so that every mistake of [`crate::mutants`] can be tried on every change. The
//! other groups ask the same questions at length.

mod rendering;
mod sampling;
mod statistics;

use super::Check;

/// The checks of this group.
pub fn checks() -> Vec<Check> {
    [sampling::checks(), rendering::checks(), statistics::checks()].concat()
}

//! Failures of statistics: digits that cancel, tests that cry wolf, errors that hide.
//!
//! Each check shows the wrong way beside ours. `numbers` has what arithmetic and edge cases do, `judging` what happens when
//! estimates are compared.

mod judging;
mod numbers;

use super::super::{Check, Context, Finding, Kind};

/// The checks of this group.
pub fn checks() -> Vec<Check> {
    [numbers::checks(), judging::checks()].concat()
}

/// A check of this group.
const fn fact(
    name: &'static str,
    failures: &'static [u8],
    kind: Kind,
    claim: &'static str,
    run: fn(&Context) -> Finding,
) -> Check {
    Check { name, group: "failures: statistics", claim, failures, kind, run }
}

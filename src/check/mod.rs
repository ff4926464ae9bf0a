//! The self-test: facts about samplers, metrics, statistics and estimators, as checks that run.
//!
//! A [`Check`] states a fact, says how often it may lie (its share of the run's false-alarm rate) and what it would catch.
//! It is a pure function of a [`Context`]: the same seed and effort give the same finding, and nothing is tried twice. The
//! command `check`, the integration tests and the table of planted bugs all run the same checks.
//!
//! Adding one: a function `fn(&Context) -> Finding` in the module of its group, usually by way of a [`Tally`], and a
//! line in that module's `checks()`.

pub mod catalogue;
mod select;
mod tally;

pub mod estimators;
pub mod failures;
pub mod harness;
pub mod metrics;
#[cfg(feature = "mutants")]
pub mod planted;
pub mod quick;
pub mod room;
pub mod samplers;
pub mod scene;
pub mod statistics;

use std::panic::{AssertUnwindSafe, catch_unwind};

use serde::Serialize;

use crate::sampling::hash::{derive, derive_named};
use crate::stats::hypothesis::{Family, sidak};

pub use select::{FAILURES, select};
pub use tally::{Finding, Tally};

/// The false-alarm rate of a whole run of all checks, unless told otherwise.
pub const FALSE_ALARM: f64 = 1e-6;

/// The seed of a run, unless told otherwise.
pub const SEED: u64 = 1;

/// Seconds on two cores within which the whole run is meant to end at effort 1.
pub const BUDGET_SECONDS: f64 = 60.0;

/// Does a check throw dice?
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// It tests hypotheses on random numbers, and may lie at its stated rate.
    Statistical,
    /// It holds or it does not: no seed, no false alarm. Tolerances are derived bounds.
    Exact,
}

/// A fact and how to find out whether it holds.
#[derive(Clone, Copy)]
pub struct Check {
    /// Name in kebab case, unique among all checks.
    pub name: &'static str,
    /// Group, by which several are asked for at once.
    pub group: &'static str,
    /// The fact, as a sentence that is true where the check passes.
    pub claim: &'static str,
    /// Rows of the failure catalogue (docs/failures.md) that it shows; empty for none.
    pub failures: &'static [u8],
    /// Does it throw dice?
    pub kind: Kind,
    /// Finds out.
    pub run: fn(&Context) -> Finding,
}

/// What a check is given: where its randomness comes from, how often it may lie, how hard it should try.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Context {
    /// Seed of this check's own random numbers: different for every check, fixed for a run's seed.
    pub seed: u64,
    /// Probability in (0, 1) that this check fails although all it claims is true.
    pub false_alarm: f64,
    /// Replicates in multiples of the usual number; 1 for a whole run in [`BUDGET_SECONDS`].
    pub effort: f64,
}

impl Context {
    /// A family of this check's tests, which together keep its false-alarm rate.
    pub fn family(&self, tests: u32) -> Family {
        Family { tests: u64::from(tests), false_alarm: self.false_alarm }
    }

    /// `usual` replicates in proportion to the effort, at least `least`.
    pub fn replicates(&self, usual: u32, least: u32) -> u32 {
        let replicates = ((f64::from(usual) * self.effort).round() as u32).max(least);
        #[cfg(feature = "mutants")]
        planted::note_replicates(replicates);
        replicates
    }

    /// The seed of replicate `index` of the part `part`.
    pub fn seed_of(&self, part: u64, index: u64) -> u64 {
        derive(self.seed, &[part, index])
    }
}

/// How a run of checks is set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Seed of the run.
    pub seed: u64,
    /// False-alarm rate of a run of all checks.
    pub alpha: f64,
    /// Effort: 1 for the usual number of replicates.
    pub effort: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { seed: SEED, alpha: FALSE_ALARM, effort: 1.0 }
    }
}

impl Settings {
    /// The context of one check. Its false-alarm rate is that of a run of *all* checks, so a check decides the same
    /// whether it runs alone or among the others.
    pub fn context(&self, check: &Check) -> Context {
        let statistical = all().iter().filter(|c| c.kind == Kind::Statistical).count().max(1);
        let false_alarm = sidak(self.alpha, statistical as u64);
        Context { seed: derive_named(self.seed, check.name), false_alarm, effort: self.effort }
    }
}

/// A check with what it found, as the command writes it.
#[derive(Debug, Clone, Serialize)]
pub struct Result {
    /// Name of the check.
    pub name: &'static str,
    /// Its group.
    pub group: &'static str,
    /// The fact.
    pub claim: &'static str,
    /// Rows of the failure catalogue.
    pub failures: &'static [u8],
    /// What was found.
    #[serde(flatten)]
    pub finding: Finding,
}

impl Result {
    /// One line: verdict, group, name, p-value against its level, rate and power.
    pub fn line(&self) -> String {
        let Finding { passed, p_value, threshold, false_alarm, detects, tests, .. } = &self.finding;
        let verdict = if *passed { "pass" } else { "FAIL" };
        let mut parts = Vec::new();
        match (p_value, threshold) {
            (Some(p), Some(threshold)) => parts.push(format!("p = {} of {threshold:.0e}", short(*p))),
            (None, _) if *false_alarm == 0.0 => parts.push("exact".to_owned()),
            _ => {}
        }
        if *false_alarm > 0.0 {
            parts.push(format!("false alarms {false_alarm:.0e}"));
        }
        match detects {
            Some(detects) if *false_alarm > 0.0 => parts.push(format!("catches {}", percent(*detects))),
            Some(tolerance) if *tolerance > 0.0 => parts.push(format!("to {tolerance:.0e}")),
            _ => {}
        }
        parts.push(if *tests == 1 { "1 test".to_owned() } else { format!("{tests} tests") });
        format!("{verdict}  {:<20} {:<32} {}", self.group, self.name, parts.join(", "))
    }
}

/// A probability in two digits.
fn short(p: f64) -> String {
    if p >= 0.01 { format!("{p:.2}") } else { format!("{p:.0e}") }
}

/// A share in two digits.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent >= 10.0 {
        format!("{percent:.0} %")
    } else if percent >= 0.01 {
        format!("{percent:.2} %")
    } else {
        format!("{percent:.0e} %")
    }
}

/// The false-alarm rate of independent results together, 1 − Π(1 − α).
pub fn false_alarm(results: &[Result]) -> f64 {
    let log: f64 = results.iter().map(|r| libm::log1p(-r.finding.false_alarm)).sum();
    // Of nothing it is 0, not −0.
    -libm::expm1(log) + 0.0
}

/// Every check, group by group.
pub fn all() -> Vec<Check> {
    [
        samplers::checks(),
        metrics::checks(),
        statistics::checks(),
        estimators::checks(),
        harness::checks(),
        quick::checks(),
        failures::checks(),
    ]
    .concat()
}

/// Runs one check. A panic inside it is a finding that fails, with the panic's message: the program was wrong.
pub fn run(check: &Check, settings: &Settings) -> Result {
    let context = settings.context(check);
    let finding = catch_unwind(AssertUnwindSafe(|| (check.run)(&context))).unwrap_or_else(|panic| {
        let message = panic.downcast_ref::<String>().map(String::as_str);
        let message = message.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
        Finding::broken(format!("the program stopped: {message}"))
    });
    let finding = match check.kind {
        Kind::Statistical => Finding { false_alarm: context.false_alarm, ..finding },
        // A fact without a tolerance: any departure is caught.
        Kind::Exact => Finding { false_alarm: 0.0, detects: finding.detects.or(Some(0.0)), ..finding },
    };
    Result { name: check.name, group: check.group, claim: check.claim, failures: check.failures, finding }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_check_has_a_name_of_its_own() {
        let names: Vec<&str> = all().iter().map(|c| c.name).collect();
        assert_eq!(names.iter().collect::<BTreeSet<_>>().len(), names.len(), "{names:?}");
        assert!(names.iter().all(|n| n.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-')));
    }

    #[test]
    fn a_panic_is_a_finding_that_fails() {
        let check = Check {
            name: "falls",
            group: "test",
            claim: "",
            failures: &[],
            kind: Kind::Exact,
            run: |_| panic!("over a stone"),
        };
        let found = run(&check, &Settings::default()).finding;
        assert!(!found.passed && found.says.contains("over a stone"), "{found:?}");
    }
}

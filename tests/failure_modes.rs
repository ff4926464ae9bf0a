//! Where methods fail (docs/failures.md): every failure of the catalogue as a check that runs, a group a test.
//!
//! All statistical checks of the registry, here and in the other tests that run some of them, have one false-alarm rate together; seeds
//! are fixed. False alarms: 1e-7. With
//! `-- --nocapture` each check says what it saw.

use std::collections::BTreeSet;

use sampler_lab::check::{self, Check, Settings};

const SETTINGS: Settings = Settings { seed: check::SEED, alpha: 1e-7, effort: 1.0 };

/// Rows of the catalogue.
const ROWS: std::ops::RangeInclusive<u8> = 1..=65;

/// Runs every check of a group and shows what it found.
fn run_group(group: &str) {
    let checks: Vec<Check> = check::all().into_iter().filter(|c| c.group == group).collect();
    assert!(!checks.is_empty(), "a group of checks called {group}");
    let mut failed = Vec::new();
    for check in &checks {
        let result = check::run(check, &SETTINGS);
        let verdict = if result.finding.passed { "holds" } else { "FAILS" };
        println!(
            "{verdict} {} {:?}: {}\n      {} (detects {:?}, {} tests)",
            check.name, check.failures, check.claim, result.finding.says, result.finding.detects, result.finding.tests
        );
        if !result.finding.passed {
            failed.push(format!("{}: {}\n    {}", check.name, check.claim, result.finding.says));
        }
    }
    assert!(failed.is_empty(), "{} of {} checks fail:\n{}", failed.len(), checks.len(), failed.join("\n"));
}

#[test]
fn numbers() {
    run_group("failures: numbers");
}

#[test]
fn correlation() {
    run_group("failures: correlation");
}

#[test]
fn counts() {
    run_group("failures: counts");
}

#[test]
fn scrambles() {
    run_group("failures: scrambles");
}

#[test]
fn statistics() {
    run_group("failures: statistics");
}

#[test]
fn lights() {
    run_group("failures: lights");
}

#[test]
fn camera() {
    run_group("failures: camera");
}

#[test]
fn metrics() {
    run_group("failures: metrics");
}

/// A row without a check is a failure that nobody would notice.
#[test]
fn every_row_of_the_catalogue_has_a_check() {
    let shown: BTreeSet<u8> = check::all().iter().flat_map(|c| c.failures).copied().collect();
    let missing: Vec<u8> = ROWS.filter(|row| !shown.contains(row)).collect();
    assert!(missing.is_empty(), "rows without a check: {missing:?}");
    let unknown: Vec<&u8> = shown.iter().filter(|row| !ROWS.contains(row)).collect();
    assert!(unknown.is_empty(), "checks of rows that do not exist: {unknown:?}");
}

/// The groups of failures that this file runs are all there are.
#[test]
fn every_group_of_failures_is_run_here() {
    let text = include_str!("failure_modes.rs");
    for group in check::all().iter().map(|c| c.group).filter(|g| g.starts_with("failures: ")).collect::<BTreeSet<_>>() {
        assert!(text.contains(&format!("run_group(\"{group}\")")), "the group {group} has no test");
    }
}

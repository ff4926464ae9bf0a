//! Planted bugs tried on the checks: is each of them caught, by which checks, at how little effort?
//!
//! A mistake is planted in the whole process, so all of this runs one thing after another.

use std::fmt::Write;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::mutants::{Mutant, plant};

use super::{Check, Result, Settings, all, run};

/// The largest number of replicates that checks asked for since it was taken last: one check runs at a time here.
static REPLICATES: AtomicU32 = AtomicU32::new(0);

/// Remembers how many replicates a check asked for.
pub(super) fn note_replicates(replicates: u32) {
    REPLICATES.fetch_max(replicates, Ordering::Relaxed);
}

/// The most replicates asked for since the last call; 0 for a check that asks for none.
fn take_replicates() -> u32 {
    REPLICATES.swap(0, Ordering::Relaxed)
}

/// What a check finds with a mistake planted.
pub fn run_with(mutant: Mutant, check: &Check, settings: &Settings) -> Result {
    plant(Some(mutant));
    let result = run(check, settings);
    plant(None);
    result
}

/// The check that a mutant's declaration names as its cheapest.
///
/// # Panics
/// Where there is no such check: a test holds that there is.
pub fn cheapest(mutant: Mutant) -> Check {
    let named = all().into_iter().find(|c| c.name == mutant.caught_by());
    named.unwrap_or_else(|| panic!("{}: no check is named {}", mutant.name(), mutant.caught_by()))
}

/// Efforts at which the cheapest check is tried, least first.
pub const EFFORTS: [f64; 4] = [0.01, 0.1, 0.3, 1.0];

/// A line of the table.
#[derive(Debug, Clone)]
pub struct Row {
    /// The mistake.
    pub mutant: Mutant,
    /// Every check that fails with it, in the registry's order, and its most replicates in a test.
    pub caught_by: Vec<(&'static str, u32)>,
    /// The most replicates of a test of its cheapest check, at the least of [`EFFORTS`] at which that fails; `None` where the
    /// mistake survives even at the largest.
    pub least: Option<u32>,
    /// What the cheapest check said at that effort.
    pub says: String,
}

/// Tries one mistake on every check of `checks`, and on its cheapest at rising effort.
pub fn row(mutant: Mutant, checks: &[Check], settings: &Settings) -> Row {
    let fails = |check: &Check, effort: f64| {
        take_replicates();
        let finding = run_with(mutant, check, &Settings { effort, ..*settings }).finding;
        (!finding.passed).then(|| (take_replicates(), finding.says))
    };
    let caught_by =
        checks.iter().filter_map(|check| fails(check, settings.effort).map(|(n, _)| (check.name, n))).collect();
    let check = cheapest(mutant);
    let (least, says) = EFFORTS.into_iter().find_map(|effort| fails(&check, effort)).unzip();
    Row { mutant, caught_by, least, says: says.unwrap_or_default() }
}

/// The table as Markdown, docs/mutants.md; with how many checks it was tried on.
pub fn markdown(rows: &[Row], checks: usize, settings: &Settings) -> String {
    let survivors: Vec<&str> = rows.iter().filter(|r| r.least.is_none()).map(|r| r.mutant.name()).collect();
    let mut text = format!(
        "# Planted bugs, and which checks catch them\n\n\
         Written by `cargo run --release --features mutants -- check --mutant-table > docs/mutants.md`; not edited by hand.\n\n\
         {} mistakes that people make are built into the program behind the cargo feature `mutants` (src/mutants.rs), one of \
         which is on at a time. Each is tried on all {checks} checks at their usual numbers (effort 1, seed {}, false alarms \
         {:e} for a run of all), and on its cheapest check at less effort: a number of replicates in proportion, never \
         below the least that a check asks for. n is the most replicates (seeds, pixels, sets, samples) in one of its tests when it was caught; \
         a check without a number is exact, or its numbers are fixed. {}\n\n\
         `check --mutants` tries each on its cheapest check (CI does), `check --mutant NAME` on all of them.\n\n\
         | planted bug | where | what is done wrong | cheapest check | n | what it said | caught by (n) |\n\
         |---|---|---|---|---|---|---|\n",
        rows.len(),
        settings.seed,
        settings.alpha,
        if survivors.is_empty() {
            "None survives.".to_owned()
        } else {
            format!("Survivors: {}.", survivors.join(", "))
        },
    );
    let number = |n: u32| if n == 0 { "exact".to_owned() } else { n.to_string() };
    for Row { mutant, caught_by, least, says } in rows {
        let least = least.map_or("survives".to_owned(), number);
        let with_n = |&(name, n): &(&str, u32)| if n == 0 { format!("`{name}`") } else { format!("`{name}` ({n})") };
        let others = caught_by.iter().map(with_n).collect::<Vec<_>>().join(", ");
        let _ = writeln!(
            text,
            "| `{}` | {} | {} | `{}` | {least} | {} | {} of {checks}: {others} |",
            mutant.name(),
            mutant.room(),
            cell(mutant.mistake()),
            mutant.caught_by(),
            cell(says),
            caught_by.len(),
        );
    }
    text
}

/// Text that does not end its cell.
pub fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('\n', " ")
}

//! Planted bugs tried on the checks: is each of them caught, by which checks, at how little effort?
//!
//! A mistake is planted in the whole process, so all of this runs one thing after another.

use std::fmt::Write;

use crate::mutants::{Mutant, plant};

use super::{Check, Result, Settings, all, run};

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
    /// Every check that fails with it, in the registry's order.
    pub caught_by: Vec<&'static str>,
    /// The least of [`EFFORTS`] at which its cheapest check fails; `None` where it survives even at the largest.
    pub least_effort: Option<f64>,
    /// What the cheapest check said at that effort.
    pub says: String,
}

/// Tries one mistake on every check of `checks`, and on its cheapest at rising effort.
pub fn row(mutant: Mutant, checks: &[Check], settings: &Settings) -> Row {
    let fails = |check: &&Check| !run_with(mutant, check, settings).finding.passed;
    let caught_by = checks.iter().filter(fails).map(|c| c.name).collect();
    let check = cheapest(mutant);
    let caught = EFFORTS.into_iter().find_map(|effort| {
        let finding = run_with(mutant, &check, &Settings { effort, ..*settings }).finding;
        (!finding.passed).then_some((effort, finding.says))
    });
    let (least_effort, says) = caught.unzip();
    Row { mutant, caught_by, least_effort, says: says.unwrap_or_default() }
}

/// The table as Markdown, docs/mutants.md; with how many checks it was tried on.
pub fn markdown(rows: &[Row], checks: usize, settings: &Settings) -> String {
    let survivors: Vec<&str> = rows.iter().filter(|r| r.least_effort.is_none()).map(|r| r.mutant.name()).collect();
    let mut text = format!(
        "# Planted bugs, and which checks catch them\n\n\
         Written by `cargo run --release --features mutants -- check --mutant-table > docs/mutants.md`; not edited by hand.\n\n\
         {} mistakes that people make are built into the program behind the cargo feature `mutants` (src/mutants.rs), one of \
         which is on at a time. Each is tried on all {checks} checks at their usual numbers (effort 1, seed {}, false alarms \
         {:e} for a run of all), and on its cheapest check at less effort: a number of replicates in proportion, never \
         below the least that a check asks for. {}\n\n\
         `check --mutants` tries each on its cheapest check (CI does), `check --mutant NAME` on all of them.\n\n\
         | planted bug | where | what is done wrong | cheapest check | effort | what it said | caught by |\n\
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
    for Row { mutant, caught_by, least_effort, says } in rows {
        let effort = least_effort.map_or("survives".to_owned(), |effort| effort.to_string());
        let others = caught_by.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(" ");
        let _ = writeln!(
            text,
            "| `{}` | {} | {} | `{}` | {effort} | {} | {} of {checks}: {others} |",
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

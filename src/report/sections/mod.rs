//! The report's text, section by section, in the order of the page.
//!
//! A sentence that asserts something is made by a function of numbers, with other words for the other outcome and for
//! "cannot tell": the same functions write true sentences about another experiment.
//!
//! **A new section** is a file of its own with a function `section(summary, figures, page)`, called from [`report`] at its
//! place in the order. It opens with `page.heading(2, titles::…)`, which puts it into the table of contents. Figures and
//! tables number themselves in the order of the page:
//!
//! - [`show`]`(page, figures, "name", is_chart, caption)` shows the file `figures/name.*`; its key is its name.
//! - [`tabulate`]`(page, "key", caption, &head, &rows)` is a table that belongs to the reader's path;
//!   [`tabulate_folded`] one of evidence, behind a line that opens it (more than about 12 lines, or one of many alike).
//! - A caption is whole sentences that state metric and unit, n or spp, scene, replicates and level.
//! - [`figure_ref`](super::markdown::figure_ref)`("name")` and [`table_ref`](super::markdown::table_ref)`("key")` in any text, before or
//!   after, become `Figure 3` and `Table 5` with a link; [`link_to`](super::markdown::link_to)`(titles::…)` names a section.

mod answers;
mod budgets;
mod convergence;
mod coupling;
mod decisions;
mod failures;
mod flaws;
mod gallery;
mod identical;
mod in_step;
mod neighbours;
mod opening;
mod pictures;
mod pixels;
mod points;
mod predicates;
mod prediction;
mod reach;
mod reference;
mod sampling;
mod scenes;
mod shortcut;
mod spectra;
mod speed;
mod stability;
mod words;

use super::gallery::Failure;
use super::markdown::Page;
use super::pairing::{self, Paired};
use super::spectra::{SetPower, spectra as spectra_of};
use super::summarise::Summary;
use super::write::{FigureState, Figures};
pub use neighbours::pattern_spp;
pub use sampling::peers_of;

/// Names of sections that others link to.
mod titles {
    pub const READING: &str = "How to read it";
    pub const WITHIN: &str = "Within a set";
    pub const SPECTRA: &str = "Power spectra";
    pub const DECISIONS: &str = "Between decisions";
    pub const PIXELS: &str = "Between pixels";
    pub const WHICH: &str = "Which decision matters";
    pub const IDENTICAL: &str = "Identical";
    pub const CONVERGENCE: &str = "Convergence";
    pub const BIAS: &str = "Bias and variance";
    pub const PREDICTION: &str = "Predicted pixel variance";
    pub const PICTURES: &str = "Pictures at equal samples and at equal time";
    pub const SPEED: &str = "Speed against accuracy";
    pub const FAILURES: &str = "Where methods fail";
    pub const GALLERY: &str = "A gallery of failures";
    pub const STABILITY: &str = "Stability";
    pub const SHORTCUT: &str = "The sheet's shortcut";
    pub const TABLE: &str = "Advantages and disadvantages";
    pub const LIMITS: &str = "Limits";
}

/// What a report asks of the samplers themselves, beyond the rows: a function of the experiment's samplers and seed alone.
pub struct Measurements {
    /// Within sets and between decisions.
    tests: coupling::Tests,
    /// Two decisions and an integrand that needs both, by sampler.
    paired: Vec<(usize, Vec<Paired>)>,
    /// Failures of methods.
    gallery: Vec<Failure>,
    /// Power spectra of point sets.
    power: Vec<SetPower>,
}

impl Measurements {
    /// Measures everything: less than a second.
    pub fn of(summary: &Summary) -> Self {
        let seed = summary.about.experiment.seed;
        let paired = |i: usize| Some((i, pairing::measure(&summary.samplers[i].spec()?, seed)?));
        Self {
            tests: coupling::Tests::of(summary),
            paired: (0..summary.samplers.len()).filter_map(paired).collect(),
            gallery: super::gallery::measure(seed),
            power: spectra_of(summary),
        }
    }
}

impl Measurements {
    /// The power spectra, which are drawn too.
    pub(super) fn power(&self) -> &[SetPower] {
        &self.power
    }
}

/// `report.md`.
pub fn report(summary: &Summary, figures: &Figures) -> String {
    report_with(summary, figures, &Measurements::of(summary))
}

/// [`report`] with measurements that were made before, for several reports of the same samplers and seed.
pub fn report_with(summary: &Summary, figures: &Figures, measured: &Measurements) -> String {
    let mut page = Page::new();
    opening::title(summary, &mut page);
    let tests = &measured.tests;
    let neighbours = neighbours::NeighbourTests::of_all(summary);
    let identity = identical::Identity::of(summary);
    let asked = answers::Asked { samplers: tests, neighbours: &neighbours, identity: &identity };
    answers::section(summary, &asked, &mut page);
    page.contents();
    opening::what_was_run(summary, &mut page);
    opening::how_to_read(summary, &mut page);
    opening::scenes_and_samplers(summary, &mut page);
    pictures::stages(summary, figures, &mut page);
    points::figure_2(summary, figures, &mut page);
    points::discrepancy(summary, figures, &mut page);
    spectra::section(summary, &measured.power, figures, &mut page);
    page.heading(2, "Independent or correlated");
    points::within(summary, tests, &mut page);
    in_step::between_decisions(summary, measured, &mut page);
    neighbours::between_pixels(summary, &neighbours, &mut page);
    pixels::spectra(summary, figures, &mut page);
    decisions::section(summary, figures, &mut page);
    identical::section(summary, &identity, &mut page);
    convergence::section(summary, figures, &mut page);
    convergence::bias_and_variance(summary, figures, &mut page);
    prediction::section(summary, figures, &mut page);
    pictures::strips(summary, figures, &mut page);
    speed::section(summary, figures, &mut page);
    shortcut::section(summary, &mut page);
    page.heading(2, titles::FAILURES);
    gallery::section(&measured.gallery, figures, &mut page);
    failures::section(summary, &mut page);
    stability::section(summary, figures, &mut page);
    predicates::section(summary, tests, &neighbours, &mut page);
    failures::limits(summary, &mut page);
    page.finish()
}

/// Shows a numbered figure with its caption, or says why it is not there.
fn show(page: &mut Page, figures: &Figures, name: &str, is_chart: bool, caption: &str) {
    let ending = if is_chart { "svg" } else { "png" };
    let also = if is_chart { format!(" ([PNG](figures/{name}.png))") } else { String::new() };
    match figures.state(name) {
        // A kept figure is that of the run that made the rows: the same text, with or without the images at hand.
        FigureState::Drawn | FigureState::Kept => {
            page.figure(name, &format!("figures/{name}.{ending}"), caption, &also);
        }
        FigureState::Absent(why) => page.paragraph(&format!("*Not shown: {name}. {}*", sentence(&why))),
    }
}

/// A numbered table under its caption; other text names it as `table_ref(key)`.
fn tabulate<S: AsRef<str>>(page: &mut Page, key: &str, caption: &str, head: &[S], rows: &[Vec<String>]) {
    page.captioned_table(key, caption, head, rows);
}

/// [`tabulate`] behind a line that opens it.
fn tabulate_folded<S: AsRef<str>>(
    page: &mut Page,
    key: &str,
    title: &str,
    caption: &str,
    head: &[S],
    rows: &[Vec<String>],
) {
    let lines = super::numbers::counted(rows.len(), "line", "lines");
    page.folded(&format!("{title} ({lines})"), |page| page.captioned_table(key, caption, head, rows));
}

/// `why` as a sentence.
fn sentence(why: &str) -> String {
    let mut letters = why.chars();
    // A path keeps its letters.
    let is_path = why.split_whitespace().next().is_some_and(|word| word.contains('/'));
    let raise = |c: char| if is_path { c.to_string() } else { c.to_uppercase().to_string() };
    let first: String = letters.next().into_iter().map(raise).collect();
    let text = format!("{first}{}", letters.as_str());
    if text.ends_with('.') { text } else { format!("{text}.") }
}

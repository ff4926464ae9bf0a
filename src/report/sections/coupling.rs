//! Independent or correlated? The tests that ask the samplers themselves: within a set, and between decisions.

use crate::sampling::Decision;

use super::super::coupling::between::{self, Coupling};
use super::super::coupling::within::{self, INTEGRANDS, Within};
use super::super::markdown::{Page, table_ref};
use super::super::numbers::{
    counted, estimate, listed, p_value, p_words, short, signed, signed_estimate, with_interval,
};
use super::super::summarise::Summary;
use super::super::verdicts::{LEVEL, holm_of};
use super::words::{estimate_cell, name};
use super::{tabulate, tabulate_folded};

/// How the points of a set depend on each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Dependence {
    /// Not told apart from independent points by any test.
    NotSeen,
    /// They keep out of each other's way.
    Negative,
    /// They come in clumps.
    Positive,
    /// One test says this, another that.
    Mixed,
}

impl Dependence {
    fn words(self) -> &'static str {
        match self {
            Self::NotSeen => "not told apart from independent",
            Self::Negative => "negatively dependent",
            Self::Positive => "positively dependent",
            Self::Mixed => "dependent, not in one way",
        }
    }
}

/// One sampler's sets, its p-values Holm-adjusted over all samplers.
pub struct SetTests {
    /// Index of the sampler.
    pub sampler: usize,
    /// What was measured.
    pub within: Within,
    /// Of the variances of [`INTEGRANDS`].
    pub variance_p: [Option<f64>; 2],
    /// Of the near pairs.
    pub near_p: Option<f64>,
}

impl SetTests {
    /// The verdict of its tests together.
    pub fn dependence(&self) -> Dependence {
        let variances = self.within.variances.iter().zip(self.variance_p);
        let sides = variances.filter_map(|(v, p)| Some((p? < LEVEL).then_some((*v)?.ratio.value < 1.0)));
        let near = self.near_p.and_then(|p| (p < LEVEL).then_some(self.within.near.value < 1.0));
        let sides: Vec<bool> = sides.flatten().chain(near).collect();
        match (sides.iter().any(|&negative| negative), sides.iter().any(|&negative| !negative)) {
            (false, false) => Dependence::NotSeen,
            (true, false) => Dependence::Negative,
            (false, true) => Dependence::Positive,
            (true, true) => Dependence::Mixed,
        }
    }
}

/// One sampler's pairs of decisions, their p-values Holm-adjusted over all samplers.
pub struct PairTests {
    /// Index of the sampler.
    pub sampler: usize,
    /// Each coupling with its adjusted p-values of mean and spread.
    pub pairs: Vec<(Coupling, Option<f64>, Option<f64>)>,
}

impl PairTests {
    /// The coupling with the largest mean correlation.
    pub fn largest_mean(&self) -> Option<&(Coupling, Option<f64>, Option<f64>)> {
        self.pairs.iter().max_by(|a, b| a.0.rho.value.abs().total_cmp(&b.0.rho.value.abs()))
    }

    /// The coupling with the largest spread.
    pub fn largest_spread(&self) -> Option<&(Coupling, Option<f64>, Option<f64>)> {
        let ratio = |c: &Coupling| c.spread.map_or(f64::NEG_INFINITY, |spread| spread.ratio.value);
        self.pairs.iter().filter(|(c, ..)| c.spread.is_some()).max_by(|a, b| ratio(&a.0).total_cmp(&ratio(&b.0)))
    }

    /// Whether a mean correlation is seen.
    pub fn is_biased(&self) -> bool {
        self.pairs.iter().any(|(_, p, _)| p.is_some_and(|p| p < LEVEL))
    }

    /// Whether a spread is too large for freely paired numbers.
    pub fn is_stuck(&self) -> bool {
        self.pairs.iter().any(|(.., p)| p.is_some_and(|p| p < LEVEL))
    }

    fn words(&self) -> &'static str {
        match (self.is_biased(), self.is_stuck()) {
            (true, true) => "coupled, by mean and spread",
            (true, false) => "coupled, by their mean",
            (false, true) => "coupled, each time in another way",
            (false, false) => "no coupling seen",
        }
    }
}

/// Everything that is asked of the samplers themselves, once for the whole report.
pub struct Tests {
    /// By sampler, those with sets.
    pub sets: Vec<SetTests>,
    /// By sampler, where a scene makes two decisions.
    pub pairs: Vec<PairTests>,
}

impl Tests {
    /// Asks all samplers of an experiment that are the same for every decision.
    pub fn of(summary: &Summary) -> Self {
        let seed = summary.about.experiment.seed;
        let specs = || (0..summary.samplers.len()).filter_map(|i| Some((i, summary.samplers[i].spec()?)));
        let sets = specs().filter_map(|(i, spec)| Some((i, within::measure(spec, seed)?)));
        let made = |decision: &Decision| summary.scenes.iter().any(|scene| scene.decisions.contains(decision));
        let decisions: Vec<Decision> = Decision::ALL.into_iter().filter(made).collect();
        let pairs = specs().filter_map(|(i, spec)| Some((i, between::measure(spec, &decisions, seed)?)));
        let pairs = pairs.filter(|(_, pairs)| !pairs.is_empty());
        Self { sets: adjusted_sets(sets.collect()), pairs: adjusted_pairs(pairs.collect()) }
    }

    /// The tests of one sampler's sets.
    pub fn set(&self, sampler: usize) -> Option<&SetTests> {
        self.sets.iter().find(|tests| tests.sampler == sampler)
    }

    /// The tests of one sampler's pairs.
    pub fn pair(&self, sampler: usize) -> Option<&PairTests> {
        self.pairs.iter().find(|tests| tests.sampler == sampler)
    }
}

fn adjusted_sets(found: Vec<(usize, Within)>) -> Vec<SetTests> {
    let raw =
        found.iter().flat_map(|(_, w)| [w.variances[0].map(|v| v.p()), w.variances[1].map(|v| v.p()), Some(w.near_p)]);
    let mut p = holm_of(&raw.collect::<Vec<_>>()).into_iter();
    let mut next = || p.next().flatten();
    let tests = |(sampler, within)| SetTests { sampler, within, variance_p: [next(), next()], near_p: next() };
    found.into_iter().map(tests).collect()
}

fn adjusted_pairs(found: Vec<(usize, Vec<Coupling>)>) -> Vec<PairTests> {
    let couplings = found.iter().flat_map(|(_, pairs)| pairs);
    let raw: Vec<Option<f64>> =
        couplings.flat_map(|c| [Some(c.p_mean), c.spread.map(|spread| spread.p_above)]).collect();
    let mut p = holm_of(&raw).into_iter();
    let mut next = || p.next().flatten();
    let mut tests = Vec::new();
    for (sampler, pairs) in found {
        tests.push(PairTests { sampler, pairs: pairs.into_iter().map(|c| (c, next(), next())).collect() });
    }
    tests
}

// --- within a set ---

/// Do the points of one set depend on each other? Table and sentences; the heading is the caller's.
pub fn within(summary: &Summary, tests: &Tests, page: &mut Page) {
    if tests.sets.is_empty() {
        return;
    }
    let n = within::POINTS;
    page.paragraph(&format!(
        "*By what they integrate*: the mean of n independent points has the variance σ²/n. It is smaller where points keep out of each other's way: then two of them are *negatively* correlated, by ρ̄ = (variance ratio − 1)/(n − 1), \
         at the least −1/(n − 1) = {}. *By their places*: how many pairs are nearer than half the spacing of a square grid, over the number under independence, which is known exactly. Straight from the samplers, n = {n}.",
        signed_small(-1.0 / f64::from(n - 1))
    ));
    page.bullets(&set_sentences(summary, tests));
    let lines: Vec<Vec<String>> = tests.sets.iter().map(|t| set_row(summary, t)).collect();
    let head = [
        "sampler".to_owned(),
        format!("variance ratio, {}", INTEGRANDS[0].name),
        "p".to_owned(),
        format!("variance ratio, {}", INTEGRANDS[1].name),
        "p".to_owned(),
        format!("ρ̄ of {}", INTEGRANDS[0].name),
        "near pairs / expected".to_owned(),
        "p".to_owned(),
        "the points are".to_owned(),
    ];
    let caption = format!(
        "Points of one decision, n = {n}: variance of the mean over {} randomisations over that of independent points, for {} ({}) and {} ({}); ρ̄; pairs nearer than {} on the torus over their expected number, {} \
         (1 where nothing is random). Effect sizes without units, 95 % intervals in brackets. p: of independent points (χ² for variances, normal for pairs, two-sided), Holm-adjusted over the table; findings below {LEVEL}.",
        within::SETS,
        INTEGRANDS[0].name,
        INTEGRANDS[0].meaning,
        INTEGRANDS[1].name,
        INTEGRANDS[1].meaning,
        short(within::NEAR),
        counted(within::PAIRED_SETS as usize, "set", "sets"),
    );
    tabulate(page, "dependence", &caption, &head, &lines);
}

/// A small correlation to three digits, with its sign.
fn signed_small(x: f64) -> String {
    if x > 0.0 { format!("+{}", short(x)) } else { short(x) }
}

fn set_row(summary: &Summary, t: &SetTests) -> Vec<String> {
    let ratio = |i: usize| estimate_cell(t.within.variances[i].map(|v: super::super::coupling::VarianceRatio| v.ratio));
    vec![
        name(summary, t.sampler),
        ratio(0),
        p_value(t.variance_p[0]),
        ratio(1),
        p_value(t.variance_p[1]),
        t.within.correlation().map_or("–".to_owned(), |rho| with_interval(&rho, signed_small)),
        estimate(&t.within.near),
        p_value(t.near_p),
        t.dependence().words().to_owned(),
    ]
}

/// Which sets are independent, which are not, and by how much: the ends of each group.
fn set_sentences(summary: &Summary, tests: &Tests) -> Vec<String> {
    let of = |wanted: Dependence| tests.sets.iter().filter(move |t| t.dependence() == wanted);
    let independent: Vec<String> = of(Dependence::NotSeen)
        .map(|t| {
            let ratio = t.within.variances[0].map_or("–".to_owned(), |v| estimate(&v.ratio));
            format!("{} (variance ratio {ratio}, {})", name(summary, t.sampler), p_words(t.variance_p[0]))
        })
        .collect();
    let mut sentences = Vec::new();
    if !independent.is_empty() {
        sentences.push(format!("**Not told apart from independent points**: {}.", listed(&independent)));
    }
    for (kind, words) in [
        (Dependence::Negative, "Negatively dependent"),
        (Dependence::Positive, "Positively dependent"),
        (Dependence::Mixed, "Dependent, not in one way"),
    ] {
        let members: Vec<&SetTests> = of(kind).collect();
        if let Some(sentence) = ends_sentence(summary, words, &members) {
            sentences.push(sentence);
        }
    }
    sentences
}

/// Who they are, and the least and the most dependent of them.
fn ends_sentence(summary: &Summary, words: &str, members: &[&SetTests]) -> Option<String> {
    let names: Vec<String> = members.iter().map(|t| name(summary, t.sampler)).collect();
    let ratios = members.iter().filter_map(|t| Some((*t, t.within.variances[0]?.ratio, t.variance_p[0])));
    let mut ratios: Vec<_> = ratios.collect();
    ratios.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
    let told = |(t, ratio, p): &(&SetTests, crate::stats::Estimate, Option<f64>)| {
        format!("{} {} ({})", name(summary, t.sampler), estimate(ratio), p_words(*p))
    };
    let ends = match ratios.as_slice() {
        [] => String::new(),
        [one] => format!("; variance ratio of {}: {}", INTEGRANDS[0].name, told(one)),
        [first, .., last] => {
            format!("; variance ratio of {} from {} to {}", INTEGRANDS[0].name, told(first), told(last))
        }
    };
    let fixed: Vec<String> = members
        .iter()
        .filter(|t| t.within.variances[0].is_none())
        .map(|t| {
            let near = estimate(&t.within.near);
            format!(
                "{} has one set only, so no variance: near pairs {near} of the expected, {}",
                name(summary, t.sampler),
                p_words(t.near_p)
            )
        })
        .collect();
    let fixed = if fixed.is_empty() { String::new() } else { format!(". {}", fixed.join("; ")) };
    (!names.is_empty()).then(|| format!("**{words}**: {}{ends}{fixed}.", listed(&names)))
}

// --- between decisions ---

/// Do two decisions of one pixel depend on each other? Table and sentences; the heading is the caller's.
pub fn between(summary: &Summary, tests: &Tests, page: &mut Page) {
    if tests.pairs.is_empty() {
        return;
    }
    let n = between::SAMPLES;
    page.paragraph(&format!(
        "Asked of the samplers themselves, by *product integrands*: freely paired numbers u, v of two decisions have E f(u) g(v) = E f · E g, so the correlation ρ of one axis of two decisions is 0 on average, and varies between \
         randomisations like that of n independent pairs, by 1/n. A mean that is not 0 is a bias; a spread that is larger is an error that no count of samples reduces. n = {n}."
    ));
    page.bullets(&pair_sentences(summary, tests));
    let lines: Vec<Vec<String>> = tests.pairs.iter().map(|t| pair_row(summary, t)).collect();
    let head =
        ["sampler", "largest ρ", "between", "p", "largest spread / independent", "between", "p", "decisions are"];
    let of: usize = tests.pairs.iter().map(|t| t.pairs.len()).sum();
    let caption = format!(
        "Correlation ρ of the numbers of two decisions of one pixel along one axis (no unit), n = {n}, mean of {} randomisations (1 where nothing is random), and its variance between them over that of independent pairs; of each sampler the largest of all pairs and axes, \
         95 % intervals in brackets (of the one picked, not widened for the picking, which Holm's p-values allow for). By the variance 1/12 of uniform numbers, so that of one set may come out a little above 1. p: Student's of ρ = 0 (of one set the normal distribution of {n} independent pairs), and χ²'s upper tail of the spread, Holm-adjusted over all {of} pairs and both tests; findings below {LEVEL}. All pairs: {}.",
        between::REPLICATES,
        table_ref("all-pairs")
    );
    tabulate(page, "pairs", &caption, &head, &lines);
    let all: Vec<Vec<String>> = tests
        .pairs
        .iter()
        .flat_map(|t| {
            t.pairs.iter().map(move |(c, mean, spread)| {
                vec![
                    name(summary, t.sampler),
                    pair_name(c),
                    signed_estimate(&c.rho),
                    p_value(*mean),
                    estimate_cell(c.spread.map(|s| s.ratio)),
                    p_value(*spread),
                ]
            })
        })
        .collect();
    let caption = format!("All pairs of decisions, axis by axis; numbers as in {}.", table_ref("pairs"));
    let head = ["sampler", "between", "ρ", "p", "spread / independent", "p"];
    tabulate_folded(page, "all-pairs", "All pairs of decisions", &caption, &head, &all);
}

/// `pixel and lens, x`.
fn pair_name(c: &Coupling) -> String {
    let [a, b] = c.decisions.map(Decision::name);
    format!("{a} and {b}, {}", ["x", "y"][c.axis])
}

fn pair_row(summary: &Summary, t: &PairTests) -> Vec<String> {
    let mean = t.largest_mean();
    let spread = t.largest_spread();
    let dash = || "–".to_owned();
    vec![
        name(summary, t.sampler),
        mean.map_or_else(dash, |(c, ..)| signed_estimate(&c.rho)),
        mean.map_or_else(dash, |(c, ..)| pair_name(c)),
        mean.map_or_else(dash, |(_, p, _)| p_value(*p)),
        spread.map_or_else(|| "nothing random".to_owned(), |(c, ..)| estimate_cell(c.spread.map(|s| s.ratio))),
        spread.map_or_else(dash, |(c, ..)| pair_name(c)),
        spread.map_or_else(dash, |(.., p)| p_value(*p)),
        t.words().to_owned(),
    ]
}

fn pair_sentences(summary: &Summary, tests: &Tests) -> Vec<String> {
    let told = |t: &PairTests| {
        let (c, p, _) = t.largest_mean()?;
        Some(format!("{} (ρ = {}, {})", name(summary, t.sampler), rho_words(c), p_words(*p)))
    };
    let told_spread = |t: &PairTests| {
        let (c, _, p) = t.largest_spread()?;
        Some(format!("{} ({} times, {})", name(summary, t.sampler), estimate(&c.spread?.ratio), p_words(*p)))
    };
    let biased: Vec<String> = tests.pairs.iter().filter(|t| t.is_biased()).filter_map(told).collect();
    let stuck: Vec<String> = tests.pairs.iter().filter(|t| t.is_stuck()).filter_map(told_spread).collect();
    let free: Vec<&PairTests> = tests.pairs.iter().filter(|t| !t.is_biased() && !t.is_stuck()).collect();
    let mut sentences = Vec::new();
    if !biased.is_empty() {
        sentences.push(format!("**Coupled by their mean**, the same in every randomisation: {}.", listed(&biased)));
    }
    if !stuck.is_empty() {
        sentences.push(format!(
            "**Coupled in another way each time**, so that ρ varies more than that of independent pairs: {}.",
            listed(&stuck)
        ));
    }
    if !free.is_empty() {
        let names: Vec<String> = free.iter().map(|t| name(summary, t.sampler)).collect();
        let largest = free
            .iter()
            .filter_map(|t| t.largest_mean())
            .max_by(|a, b| a.0.rho.value.abs().total_cmp(&b.0.rho.value.abs()));
        let largest = largest.map_or(String::new(), |(c, p, _)| {
            format!("; the largest mean of them is ρ = {} ({})", signed_estimate(&c.rho), p_words(*p))
        });
        sentences.push(format!("**No coupling is seen** under {}{largest}.", listed(&names)));
    }
    sentences
}

/// One number of a sampler's pairs, for other sections: `ρ = +0.97 [+0.96, +0.98], p < 0.001`, or the spread where that is what tells.
pub fn pair_words(t: &PairTests) -> Option<String> {
    if t.is_stuck() && !t.is_biased() {
        let (c, _, p) = t.largest_spread()?;
        return Some(format!("spread {} of independent pairs', {}", estimate(&c.spread?.ratio), p_words(*p)));
    }
    let (c, p, _) = t.largest_mean()?;
    Some(format!("ρ = {}, {}", rho_words(c), p_words(*p)))
}

/// `+0.97 [+0.96, +0.98]`; where no randomisation changes it without an interval, and with its unit: by the variance of uniform
/// numbers, not by that of the set's own, it may come out a little above 1.
fn rho_words(c: &Coupling) -> String {
    match c.spread {
        Some(_) => signed_estimate(&c.rho),
        None => format!("{} in units of 1/12", signed(c.rho.value)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::coupling::VarianceRatio;
    use super::*;
    use crate::stats::Estimate;

    fn set(ratio: f64, p: f64, near: f64, near_p: f64) -> SetTests {
        let e = |value| Estimate { value, ci95: Some([0.9 * value, 1.1 * value]) };
        let variance = VarianceRatio { ratio: e(ratio), p_below: p, p_above: 1.0 - p };
        let within = Within { variances: [Some(variance), None], near: e(near), near_p };
        SetTests { sampler: 0, within, variance_p: [Some(p), None], near_p: Some(near_p) }
    }

    #[test]
    fn dependence_is_named_only_where_a_test_says_so() {
        assert_eq!(set(0.9, 0.3, 1.0, 0.9).dependence(), Dependence::NotSeen, "a small ratio, but not told apart");
        assert_eq!(set(0.1, 1e-6, 1.0, 0.9).dependence(), Dependence::Negative);
        assert_eq!(set(2.0, 1e-6, 1.5, 1e-6).dependence(), Dependence::Positive);
        assert_eq!(set(0.1, 1e-6, 1.5, 1e-6).dependence(), Dependence::Mixed);
        assert!(set_cell_has_number(&set(0.1, 1e-6, 1.0, 0.9)));
    }

    #[test]
    fn a_correlation_above_one_says_what_it_is_measured_by() {
        let spec =
            crate::sampling::SamplerSpec::parse("halton:sheet", crate::sampling::Preset::Sheet).expect("a sampler");
        let pairs = between::measure(spec, &[Decision::Pixel, Decision::Lens], 4).expect("numbers");
        let tests = PairTests { sampler: 0, pairs: pairs.into_iter().map(|c| (c, Some(0.0), None)).collect() };
        let words = pair_words(&tests).expect("a pair");
        assert!(tests.largest_mean().is_some_and(|(c, ..)| c.rho.value > 1.0), "else there is nothing to say");
        assert!(words.contains(" in units of 1/12"), "{words}");
    }

    fn set_cell_has_number(t: &SetTests) -> bool {
        t.within.correlation().is_some_and(|rho| (rho.value + 0.9 / 255.0).abs() < 1e-12)
    }

    #[test]
    fn a_family_of_tests_is_adjusted_together() {
        let raw = set(0.1, 0.01, 1.0, 0.02).within;
        let tests = adjusted_sets(vec![(0, raw), (1, raw)]);
        // Twice the smaller tail, 0.02, and 0.02: four equal p-values.
        assert_eq!(tests[0].variance_p, [Some(0.08), None]);
        assert_eq!((tests[1].near_p, tests[1].dependence()), (Some(0.08), Dependence::NotSeen));
    }
}

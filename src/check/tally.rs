//! What a check found, put together from its tests.

use serde::Serialize;

use crate::stats::hypothesis::{Family, Outcome, Verdict, binomial_test, clopper_pearson};

/// What a check found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Does the claim hold?
    pub passed: bool,
    /// The statistic (t, z, χ², D, a difference) of the test that came closest to failing; `None` where none was formed.
    pub statistic: Option<f64>,
    /// Its p-value; `None` for an exact check.
    pub p_value: Option<f64>,
    /// The level below which a p-value fails, or the bound above which a difference does.
    pub threshold: Option<f64>,
    /// Probability that the check fails although its claim is true; 0 for an exact one.
    pub false_alarm: f64,
    /// The smallest departure that is caught with probability 0.99 or more, relative to the true value where that is not 0;
    /// for an exact check the tolerance. The largest of those of its tests.
    pub detects: Option<f64>,
    /// How many single tests there were.
    pub tests: u32,
    /// One sentence with numbers: what was seen, or what failed first.
    pub says: String,
}

impl Finding {
    /// A check that could not be carried out has not passed.
    pub fn broken(says: String) -> Self {
        Self {
            passed: false,
            statistic: None,
            p_value: None,
            threshold: None,
            false_alarm: 0.0,
            detects: None,
            tests: 0,
            says,
        }
    }
}

/// Collects the single tests of a check: the worst of them stands for all.
#[derive(Debug, Default)]
pub struct Tally {
    tests: u32,
    failed: Vec<String>,
    /// The test nearest to failing: how near (below 1 fails), its words, statistic, p-value and threshold.
    worst: Option<Worst>,
    detects: Option<f64>,
    /// The largest tolerance of the exact tests.
    tolerance: Option<f64>,
}

#[derive(Debug)]
struct Worst {
    margin: f64,
    what: String,
    statistic: Option<f64>,
    p_value: Option<f64>,
    threshold: Option<f64>,
}

impl Tally {
    /// Nothing tested yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a statistical test of `what`. `scale` is what its `detects` is stated relative to: the true value, or 1.
    pub fn verdict(&mut self, what: impl Into<String>, verdict: &Verdict, scale: f64) -> bool {
        let what = what.into();
        if let Some(detects) = verdict.detects {
            let relative = if scale == 0.0 { detects } else { detects / scale.abs() };
            self.detects = Some(self.detects.map_or(relative, |d| d.max(relative)));
        }
        let p = match verdict.outcome {
            Outcome::DefinitelyDifferent | Outcome::Undefined(_) => 0.0,
            _ => verdict.p_value.unwrap_or(0.0),
        };
        let said = || format!("{what}: {verdict}");
        let worst = Worst {
            // How near the test came to failing, in either direction of proof.
            margin: verdict.slack(),
            what: what.clone(),
            statistic: verdict.statistic,
            p_value: Some(p),
            threshold: Some(verdict.threshold),
        };
        self.add(verdict.holds(), worst, said)
    }

    /// Adds an exact test: is `found` within `tolerance` of `expected`? NaN is not.
    pub fn near(&mut self, what: impl Into<String>, found: f64, expected: f64, tolerance: f64) -> bool {
        let what = what.into();
        let difference = (found - expected).abs();
        let holds = difference <= tolerance;
        self.tolerance = Some(self.tolerance.map_or(tolerance, |t| t.max(tolerance)));
        let margin = if holds { 1.0 + (1.0 - difference / tolerance.max(f64::MIN_POSITIVE)) } else { 0.0 };
        let said = || format!("{what}: expected {expected} ± {tolerance:e}, found {found}");
        let worst = Worst {
            margin,
            what: what.clone(),
            statistic: Some(difference),
            p_value: None,
            threshold: Some(tolerance),
        };
        self.add(holds, worst, said)
    }

    /// Adds a fact that holds or does not; `what` says it with its numbers.
    pub fn fact(&mut self, what: impl Into<String>, holds: bool) -> bool {
        let what = what.into();
        let margin = if holds { f64::MAX } else { 0.0 };
        let worst = Worst { margin, what: what.clone(), statistic: None, p_value: None, threshold: None };
        self.add(holds, worst, || format!("not so: {what}"))
    }

    /// Adds a fact about random numbers, with the smallest departure, relative to what is claimed, that fails it with probability
    /// 0.99 or more.
    pub fn fact_that_detects(&mut self, what: impl Into<String>, holds: bool, detects: f64) -> bool {
        self.detects = Some(self.detects.map_or(detects, |d| d.max(detects)));
        self.fact(what, holds)
    }

    /// Adds a test of a probability: `count` events in `runs`, which is to lie in [`low`, `high`]. Fails where Clopper and
    /// Pearson's interval at the confidence of one of the family's tests misses them; exact, so the family's rate holds.
    ///
    /// What it detects is relative: how far above `high`, or below `low`, the probability has to be.
    pub fn rate(
        &mut self,
        what: impl Into<String>,
        count: u64,
        runs: u64,
        [low, high]: [f64; 2],
        family: Family,
    ) -> bool {
        let confidence = 1.0 - family.per_test();
        let [least, most] = clopper_pearson(count, runs, confidence);
        let p = binomial_test(count, runs, high, family).p_value.filter(|_| count as f64 > high * runs as f64);
        let p = p
            .or_else(|| binomial_test(count, runs, low, family).p_value.filter(|_| (count as f64) < low * runs as f64));
        if let Some(detects) = rate_detected(runs, [low, high], confidence) {
            self.detects = Some(self.detects.map_or(detects, |d| d.max(detects)));
        }
        let holds = least <= high && most >= low;
        let what = what.into();
        let p = p.unwrap_or(1.0);
        let worst = Worst {
            margin: if holds { p / family.per_test() } else { 0.0 },
            what: what.clone(),
            statistic: Some(count as f64 / runs as f64),
            p_value: Some(p),
            threshold: Some(family.per_test()),
        };
        self.add(holds, worst, || format!("not so: {what}"))
    }

    fn add(&mut self, holds: bool, candidate: Worst, said: impl FnOnce() -> String) -> bool {
        self.tests += 1;
        if !holds {
            self.failed.push(said());
        }
        if self.worst.as_ref().is_none_or(|w| candidate.margin < w.margin) {
            self.worst = Some(candidate);
        }
        holds
    }

    /// The finding; without a single test the check has not passed.
    pub fn finish(self) -> Finding {
        self.finish_with(None)
    }

    /// The finding, in words of its own where it passed.
    pub fn saying(self, says: impl Into<String>) -> Finding {
        self.finish_with(Some(says.into()))
    }

    fn finish_with(self, says: Option<String>) -> Finding {
        let Some(worst) = self.worst else { return Finding::broken("nothing was tested".to_owned()) };
        let passed = self.failed.is_empty();
        let says = match self.failed.first() {
            Some(first) if self.failed.len() == 1 => first.clone(),
            Some(first) => format!("{} of {} tests fail; the first: {first}", self.failed.len(), self.tests),
            None => says.unwrap_or(worst.what),
        };
        Finding {
            passed,
            statistic: worst.statistic.filter(|s| s.is_finite()),
            p_value: worst.p_value,
            threshold: worst.threshold,
            false_alarm: 0.0,
            // A tolerance has the unit of its numbers and is no power: it speaks where nothing was tested at a level.
            detects: self.detects.or(self.tolerance).filter(|d| d.is_finite()),
            tests: self.tests,
            says,
        }
    }
}

/// How far, relatively, a probability has to lie outside [`low`, `high`] for its test by `runs` to fail with probability 0.99; on
/// the side where that is farther. `None` where no share fails.
fn rate_detected(runs: u64, [low, high]: [f64; 2], confidence: f64) -> Option<f64> {
    // The counts that fail are the upper and the lower ones: the first of each by bisection.
    let first = |fails: &dyn Fn(u64) -> bool| {
        let (mut holds, mut wrong) = (0, runs);
        if !fails(wrong) {
            return None;
        }
        while wrong - holds > 1 {
            let middle = holds + (wrong - holds) / 2;
            if fails(middle) { wrong = middle } else { holds = middle }
        }
        Some(wrong)
    };
    let above = (high < 1.0).then(|| {
        let count = first(&|count| clopper_pearson(count, runs, confidence)[0] > high)?;
        // Fewer than `count` with probability 0.01.
        Some(clopper_pearson(count - 1, runs, 0.98)[1] / high - 1.0)
    });
    let below = (low > 0.0).then(|| {
        let misses = first(&|misses| clopper_pearson(runs - misses, runs, confidence)[1] < low)?;
        Some(1.0 - clopper_pearson(runs - misses + 1, runs, 0.98)[0] / low)
    });
    match (above, below) {
        // A side on which nothing can fail with so few runs is not spoken of, unless neither can.
        (Some(a), Some(b)) => match (a, b) {
            (Some(a), Some(b)) => Some(a.max(b)),
            (one, other) => one.or(other),
        },
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::hypothesis::{Family, t_test};

    #[test]
    fn nothing_tested_has_not_passed() {
        assert!(!Tally::new().finish().passed);
    }

    #[test]
    fn one_failure_of_many_fails_and_is_named() {
        let mut tally = Tally::new();
        tally.fact("water is wet", true);
        tally.near("two", 2.1, 2.0, 1e-3);
        tally.near("not a number", f64::NAN, 2.0, 1e-3);
        let found = tally.finish();
        assert!(!found.passed && found.says.contains("2 of 3") && found.says.contains("found 2.1"), "{found:?}");
    }

    /// 1000 runs at a claimed 1 %: what is caught is checked by the binomial distribution itself.
    #[test]
    fn a_rate_says_what_it_detects() {
        let family = Family { tests: 1, false_alarm: 1e-6 };
        let failing = |count| !Tally::new().rate("share", count, 1000, [0.0, 0.01], family);
        let first = (0..1000).find(|&count| failing(count)).unwrap();
        let mut tally = Tally::new();
        tally.rate("share", 12, 1000, [0.0, 0.01], family);
        let detects = tally.finish().detects.unwrap();
        let p = 0.01 * (1.0 + detects);
        let caught = 1.0 - binomial_cdf(first - 1, 1000, p);
        assert!((caught - 0.99).abs() < 1e-6, "{first} of 1000 at {p}: {caught}");
        // Below: found 99 % of the time, by claim.
        let mut tally = Tally::new();
        assert!(tally.rate("share", 985, 1000, [0.985, 0.995], family));
        assert!(tally.finish().detects.unwrap() < 0.05);
        assert!(!Tally::new().rate("share", 900, 1000, [0.985, 0.995], family));
        assert!(!Tally::new().rate("share", 1000, 1000, [0.5, 0.6], family));
    }

    /// P(X ≤ k) by summing.
    fn binomial_cdf(k: u64, n: u64, p: f64) -> f64 {
        let mut term = libm::exp(n as f64 * libm::log1p(-p));
        let mut sum = term;
        for i in 0..k {
            term *= (n - i) as f64 / (i + 1) as f64 * p / (1.0 - p);
            sum += term;
        }
        sum
    }

    #[test]
    fn the_test_nearest_to_failing_stands_for_all() {
        let family = Family { tests: 2, false_alarm: 1e-6 };
        let mut tally = Tally::new();
        tally.verdict("far", &t_test(&[1.0, 2.0, 3.0], 2.0, family), 2.0);
        tally.verdict("near", &t_test(&[1.0, 2.0, 3.0], 4.0, family), 4.0);
        let found = tally.finish();
        assert!(found.passed && found.says == "near" && found.p_value.unwrap() < 1.0, "{found:?}");
    }
}

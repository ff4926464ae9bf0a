//! Tests that say how often they may lie and what they would catch.
//!
//! The values fed to a test must be independent: whole replicates of a randomised estimator, never the correlated
//! samples within one.

use std::fmt;

use super::moments::{Moments, student_t_quantile, sum, two_sided_factor};
use super::special::{
    incomplete_beta, incomplete_gamma_upper, normal_upper_tail, solve_falling, student_two_sided,
    student_two_sided_inverse,
};
use crate::error::{Error, Result};
use crate::mutants::{Mutant, planted};

/// The chance of detection at which [`Verdict::detects`] is stated.
pub const POWER: f64 = 0.99;

/// Cells of a χ² test with fewer expected counts are pooled.
pub const MIN_EXPECTED: f64 = 5.0;

/// Two numbers this close, relative to the larger, differ by rounding alone; no test can speak about less.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// A set of tests that together raise a false alarm with at most a stated probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Family {
    /// How many tests there are, at least 1.
    pub tests: u32,
    /// Probability in (0, 1) that any of them fails although all hypotheses are true.
    pub false_alarm: f64,
}

impl Family {
    /// The level of each test by Šidák, 1 − (1 − α)^(1/tests).
    ///
    /// # Panics
    /// Without tests, or with a false-alarm rate outside (0, 1): a mistake of the program, not of its input.
    pub fn per_test(self) -> f64 {
        assert!(self.tests > 0 && self.false_alarm > 0.0 && self.false_alarm < 1.0, "not a family of tests: {self:?}");
        sidak(self.false_alarm, self.tests)
    }
}

/// Šidák's level of one of `tests` tests, 1 − (1 − α)^(1/tests), by way of expm1 and log1p so that it never rounds to
/// 0.
pub fn sidak(alpha: f64, tests: u32) -> f64 {
    if planted(Mutant::SidakInSingle) {
        return 1.0 - f64::from(libm::powf(1.0 - alpha as f32, 1.0 / tests as f32));
    }
    -libm::expm1(libm::log1p(-alpha) / f64::from(tests))
}

/// What kind of answer a test gave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// A statistic with a p-value.
    Tested,
    /// Nothing varies (or only by rounding) and the numbers agree: no evidence against the hypothesis can exist.
    DefinitelyEqual,
    /// Nothing varies and the numbers differ: the hypothesis is false.
    DefinitelyDifferent,
    /// The data cannot be tested, and why. It does not hold: a test that did not run has not passed.
    Undefined(&'static str),
}

/// The answer of a test; [`holds`](Self::holds) is the short form, `Display` the long one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// What kind of answer this is.
    pub outcome: Outcome,
    /// The statistic (t, z, χ² or D) where one could be formed; never NaN.
    pub statistic: Option<f64>,
    /// Probability of a statistic at least this far out if the hypothesis is true; `None` where undefined.
    pub p_value: Option<f64>,
    /// The test's own level: it fails where the p-value is below.
    pub threshold: f64,
    /// The family whose false-alarm rate the threshold keeps.
    pub family: Family,
    /// Smallest bias, in the unit of the values, that this test would catch with probability [`POWER`].
    pub detects: Option<f64>,
}

impl Verdict {
    /// Is the hypothesis compatible with the data at the family's level?
    pub fn holds(&self) -> bool {
        match self.outcome {
            Outcome::Tested => self.p_value.is_some_and(|p| p >= self.threshold),
            Outcome::DefinitelyEqual => true,
            Outcome::DefinitelyDifferent | Outcome::Undefined(_) => false,
        }
    }

    fn new(family: Family, outcome: Outcome) -> Self {
        let p_value = match outcome {
            Outcome::DefinitelyEqual => Some(1.0),
            Outcome::DefinitelyDifferent => Some(0.0),
            Outcome::Tested | Outcome::Undefined(_) => None,
        };
        Self { outcome, statistic: None, p_value, threshold: family.per_test(), family, detects: None }
    }

    fn tested(family: Family, statistic: f64, p_value: f64) -> Self {
        Self { statistic: Some(statistic), p_value: Some(p_value), ..Self::new(family, Outcome::Tested) }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.outcome {
            Outcome::Undefined(why) => return write!(f, "undefined: {why}"),
            Outcome::DefinitelyEqual => return write!(f, "holds: equal, and nothing varies"),
            Outcome::DefinitelyDifferent => return write!(f, "fails: different, and nothing varies"),
            Outcome::Tested => {}
        }
        write!(f, "{}", if self.holds() { "holds" } else { "fails" })?;
        if let (Some(statistic), Some(p)) = (self.statistic, self.p_value) {
            write!(f, ": statistic {statistic:.6}, p = {p:.3e}, threshold {:.3e}", self.threshold)?;
        }
        write!(f, " (1 of {} tests, false alarms {:e} for all)", self.family.tests, self.family.false_alarm)?;
        self.detects.map_or(Ok(()), |bias| write!(f, "; a bias of {bias:.3e} would be caught"))
    }
}

/// Do `a` and `b` differ by no more than rounding?
fn same_but_for_rounding(a: f64, b: f64) -> bool {
    (a - b).abs() <= ROUNDING * a.abs().max(b.abs())
}

/// The definite answer where there is no spread, or where the difference is within rounding.
fn definite(a: f64, b: f64, standard_error: f64) -> Option<Outcome> {
    if same_but_for_rounding(a, b) {
        Some(Outcome::DefinitelyEqual)
    } else if standard_error == 0.0 {
        Some(Outcome::DefinitelyDifferent)
    } else {
        None
    }
}

/// Is the expectation of independent `replicates` equal to `exact`? Two-sided Student t test, n − 1 degrees of freedom.
///
/// Without spread the answer is definite; a mean that agrees with `exact` to a few roundings holds whatever the
/// spread, since no more can be asked of f64. Below two replicates, or with a value that is not finite: undefined.
pub fn t_test(replicates: &[f64], exact: f64, family: Family) -> Verdict {
    let moments: Moments = replicates.iter().copied().collect();
    let (Some(mean), Some(error)) = (moments.mean(), moments.standard_error()) else {
        return Verdict::new(family, Outcome::Undefined("a t test needs at least two replicates"));
    };
    if !(error.is_finite() && exact.is_finite()) {
        return Verdict::new(family, Outcome::Undefined("a value is not finite"));
    }
    against_exact(mean, exact, error, (moments.n() - 1) as f64, family)
}

/// Is a `value` of known `standard_error` equal to `exact`? Two-sided test on the normal distribution.
///
/// Zero standard error gives a definite answer; a negative or non-finite one is undefined.
pub fn z_test(value: f64, exact: f64, standard_error: f64, family: Family) -> Verdict {
    if !(value.is_finite() && exact.is_finite() && standard_error.is_finite() && standard_error >= 0.0) {
        return Verdict::new(
            family,
            Outcome::Undefined("a value or its standard error is not finite, or it is negative"),
        );
    }
    against_exact(value, exact, standard_error, f64::INFINITY, family)
}

/// The common end of both: a t statistic at `df` degrees of freedom (∞ for the normal), and its power.
fn against_exact(value: f64, exact: f64, error: f64, df: f64, family: Family) -> Verdict {
    // Shifted by the bias, T is outside ± the critical value with probability POWER once the bias exceeds both
    // quantiles; for Student this treats the estimated error as fixed, which is good to its relative spread.
    let df = if planted(Mutant::NormalForStudent) { f64::INFINITY } else { df };
    let critical = student_two_sided_inverse(family.per_test(), df);
    let detects = Some((critical + student_t_quantile(POWER, df)) * error);
    let answer = match definite(value, exact, error) {
        Some(outcome) => Verdict::new(family, outcome),
        None => {
            let statistic = (value - exact) / error;
            Verdict::tested(family, statistic, student_two_sided(statistic, df))
        }
    };
    Verdict { detects, ..answer }
}

/// Welch's comparison of two means.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WelchResult {
    /// (mean a − mean b)/√(s_a²/n_a + s_b²/n_b); `None` where neither side varies.
    pub t: Option<f64>,
    /// Degrees of freedom by Welch and Satterthwaite; `None` where neither side varies.
    pub df: Option<f64>,
    /// Two-sided p-value; where neither side varies 1 for equal means and 0 for different ones, never NaN.
    pub p_two_sided: f64,
}

/// Have two sets of independent replicates the same expectation? Welch's t test, for unequal variances.
///
/// Badly calibrated on rare binary values (Bernoulli(0.05) pixels: a hundred times the stated false alarms): pool
/// such pixels into tiles first. `None` with fewer than two values on a side or a value that is not finite.
pub fn welch(a: &[f64], b: &[f64]) -> Option<WelchResult> {
    let [a, b] = [a, b].map(|values| values.iter().copied().collect::<Moments>());
    let (error_a, error_b) = (a.standard_error()?, b.standard_error()?);
    let error = libm::hypot(error_a, error_b);
    let (mean_a, mean_b) = (a.mean()?, b.mean()?);
    if !error.is_finite() {
        return None;
    }
    if error == 0.0 {
        let p_two_sided = if same_but_for_rounding(mean_a, mean_b) { 1.0 } else { 0.0 };
        return Some(WelchResult { t: None, df: None, p_two_sided });
    }
    let t = (mean_a - mean_b) / error;
    // As shares of the total: their fourth powers cannot all underflow.
    let share = |e: f64, n: u64| (e / error) * (e / error) * (e / error) * (e / error) / (n - 1) as f64;
    let df = if planted(Mutant::PooledFreedom) {
        (a.n() + b.n() - 2) as f64
    } else {
        1.0 / (share(error_a, a.n()) + share(error_b, b.n()))
    };
    Some(WelchResult { t: Some(t), df: Some(df), p_two_sided: student_two_sided(t, df) })
}

/// P(X > statistic) of the χ² distribution with `df` > 0 degrees of freedom.
pub fn chi2_upper_tail(statistic: f64, df: f64) -> f64 {
    incomplete_gamma_upper(0.5 * df, 0.5 * statistic)
}

/// P(|T| > |t|) of Student's t with `df` > 0 degrees of freedom.
pub fn two_sided(t: f64, df: f64) -> f64 {
    student_two_sided(t, df)
}

/// P(Z > z) of the standard normal distribution.
pub fn normal_tail(z: f64) -> f64 {
    normal_upper_tail(z)
}

/// Do counts follow expected counts? Pearson's χ² on independent draws, upper tail.
///
/// Cells below [`MIN_EXPECTED`] expected counts are pooled, smallest first, and what remains below joins the next
/// smallest cell. Degrees of freedom: cells − 1, so the expected counts must add up to the observed ones.
/// A perfectly even set has χ² near 0 and holds: evenness is not tested here. Undefined where the lists
/// differ in length, the totals disagree, an expectation is negative or fewer than two cells remain.
pub fn chi2_test(observed: &[u64], expected: &[f64], family: Family) -> Verdict {
    let undefined = |why| Verdict::new(family, Outcome::Undefined(why));
    if observed.len() != expected.len() {
        return undefined("as many observed as expected counts are needed");
    }
    if !expected.iter().all(|e| e.is_finite() && *e >= 0.0) {
        return undefined("an expected count is negative or not finite");
    }
    let total_observed = observed.iter().sum::<u64>() as f64;
    // Expected counts are often n times rounded probabilities; a real mistake is far above 1e-6.
    if (sum(expected.iter().copied()) - total_observed).abs() > 1e-6 * total_observed {
        return undefined("expected and observed counts have different totals");
    }
    let cells = pooled_cells(observed, expected);
    if cells.len() < 2 {
        return undefined("fewer than two cells are left after pooling");
    }
    let statistic = sum(cells.iter().map(|&(o, e)| (o as f64 - e) * (o as f64 - e) / e));
    let constraints = if planted(Mutant::CellsAsFreedom) { 0.0 } else { 1.0 };
    Verdict::tested(family, statistic, chi2_upper_tail(statistic, cells.len() as f64 - constraints))
}

/// Cells by rising expectation, small ones joined until each expects at least [`MIN_EXPECTED`].
fn pooled_cells(observed: &[u64], expected: &[f64]) -> Vec<(u64, f64)> {
    let mut order: Vec<usize> = (0..expected.len()).collect();
    order.sort_by(|&a, &b| expected[a].total_cmp(&expected[b]));
    let mut cells = Vec::new();
    let (mut count, mut mass) = (0, 0.0);
    for i in order {
        count += observed[i];
        mass += expected[i];
        if mass >= MIN_EXPECTED {
            cells.push((count, mass));
            (count, mass) = (0, 0.0);
        }
    }
    if let Some(last) = cells.last_mut() {
        // What is left expects too little for a cell of its own.
        last.0 += count;
        last.1 += mass;
    }
    cells
}

/// Are independent `values` uniform on [0, 1]? Kolmogorov–Smirnov, two-sided.
///
/// The p-value is twice the exact one-sided one (Birnbaum & Tingey 1951): an upper bound on the two-sided p-value, and
/// above it by a share of about (p/2)³, so the test never lies more often than stated. Below p = 0.3 the two
/// agree to 1 %; a true p near 1 reads 1. Undefined without values or with one outside [0, 1].
pub fn ks_uniform_test(values: &[f64], family: Family) -> Verdict {
    if values.is_empty() || !values.iter().all(|v| (0.0..=1.0).contains(v)) {
        return Verdict::new(family, Outcome::Undefined("Kolmogorov–Smirnov needs values in [0, 1]"));
    }
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let below = |i: usize, v: f64| if planted(Mutant::SmirnovOneSided) { 0.0 } else { v - i as f64 / n };
    let gap = |(i, &v): (usize, &f64)| ((i + 1) as f64 / n - v).max(below(i, v));
    let distance = sorted.iter().enumerate().map(gap).fold(0.0, f64::max);
    Verdict::tested(family, distance, (2.0 * one_sided_smirnov(sorted.len(), distance)).min(1.0))
}

/// P(D⁺ ≥ d) of n uniform values: d Σ_{j ≤ n(1−d)} C(n, j) (d + j/n)^(j−1) (1 − d − j/n)^(n−j), for 0 < d ≤ 1.
fn one_sided_smirnov(n: usize, d: f64) -> f64 {
    let count = n as f64;
    let log_choose = |j: f64| libm::lgamma(count + 1.0) - libm::lgamma(j + 1.0) - libm::lgamma(count - j + 1.0);
    let term = |j: usize| {
        let j = j as f64;
        let (inside, outside) = (d + j / count, 1.0 - d - j / count);
        if outside <= 0.0 {
            return 0.0;
        }
        libm::exp(log_choose(j) + (j - 1.0) * libm::log(inside) + (count - j) * libm::log(outside))
    };
    d * sum((0..n).map(term))
}

/// p-values are probabilities: anything else is an error that names its place in the list.
fn ranked(p_values: &[f64]) -> Result<Vec<usize>> {
    if let Some(i) = p_values.iter().position(|p| !(0.0..=1.0).contains(p)) {
        return Err(Error::input(
            format!("p-value {i}"),
            format!("expected a number in [0, 1], found {}", p_values[i]),
        ));
    }
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|&a, &b| p_values[a].total_cmp(&p_values[b]));
    Ok(order)
}

/// Holm's adjusted p-values, in input order: max over j ≤ i of min(1, (N − j + 1) p_(j)). Controls the family-wise
/// rate.
///
/// # Errors
/// A value that is NaN or outside [0, 1].
pub fn holm(p_values: &[f64]) -> Result<Vec<f64>> {
    let mut adjusted = vec![0.0; p_values.len()];
    let mut largest: f64 = 0.0;
    for (rank, i) in ranked(p_values)?.into_iter().enumerate() {
        let left = if planted(Mutant::HolmFromTheWrongEnd) { rank + 1 } else { p_values.len() - rank };
        largest = largest.max((left as f64 * p_values[i]).min(1.0));
        adjusted[i] = largest;
    }
    Ok(adjusted)
}

/// Benjamini and Hochberg's adjusted p-values, in input order: min over j ≥ i of min(1, N p_(j)/j). Controls the
/// share of false finds.
///
/// # Errors
/// A value that is NaN or outside [0, 1].
pub fn benjamini_hochberg(p_values: &[f64]) -> Result<Vec<f64>> {
    let mut adjusted = vec![0.0; p_values.len()];
    let mut smallest: f64 = 1.0;
    for (rank, i) in ranked(p_values)?.into_iter().enumerate().rev() {
        smallest = smallest.min(p_values.len() as f64 * p_values[i] / (rank + 1) as f64);
        adjusted[i] = smallest;
    }
    Ok(adjusted)
}

/// Clopper and Pearson's exact interval of a probability, from `successes` in `trials` at two-sided `confidence`.
///
/// Never too narrow: it covers at least at its level for every true probability. No trials: [0, 1].
///
/// # Panics
/// With more successes than trials.
pub fn clopper_pearson(successes: u64, trials: u64, confidence: f64) -> [f64; 2] {
    assert!(successes <= trials, "{successes} successes in {trials} trials");
    let tail = 0.5 * (1.0 - confidence);
    let (k, n) = (successes as f64, trials as f64);
    if planted(Mutant::WaldInterval) {
        let half = normal_factor(confidence) * (k / n * (1.0 - k / n) / n).sqrt();
        return [k / n - half, k / n + half];
    }
    let at_least_k = |p: f64| incomplete_beta(k, n - k + 1.0, p, 1.0 - p);
    let at_most_k = |p: f64| incomplete_beta(n - k, k + 1.0, 1.0 - p, p);
    let low = if successes == 0 { 0.0 } else { solve_falling(|p| -at_least_k(p), -tail, 0.0, 1.0) };
    let high = if successes == trials { 1.0 } else { solve_falling(at_most_k, tail, 0.0, 1.0) };
    [low, high]
}

/// The half-width factor of a two-sided normal interval, 1.96 at 0.95.
pub fn normal_factor(confidence: f64) -> f64 {
    two_sided_factor(confidence, f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::Rng;

    const ONE: Family = Family { tests: 1, false_alarm: 0.01 };

    fn uniform(rng: &mut Pcg64) -> f64 {
        (rng.next_u64() >> 11) as f64 * 0.5f64.powi(53)
    }

    #[test]
    fn no_spread_gives_a_definite_answer_and_never_a_nan() {
        let equal = t_test(&[0.25; 5], 0.25, ONE);
        assert!(equal.holds() && equal.outcome == Outcome::DefinitelyEqual && equal.p_value == Some(1.0));
        let different = t_test(&[0.25; 5], 0.26, ONE);
        assert!(!different.holds() && different.p_value == Some(0.0) && different.statistic.is_none());
        assert!(z_test(1.0, 1.0, 0.0, ONE).holds() && !z_test(1.0, 1.5, 0.0, ONE).holds());
        assert_eq!(welch(&[1.0, 1.0], &[1.0, 1.0]).map(|w| w.p_two_sided), Some(1.0));
        assert_eq!(welch(&[1.0, 1.0], &[2.0, 2.0, 2.0]).map(|w| w.p_two_sided), Some(0.0));
    }

    #[test]
    fn what_cannot_be_tested_is_undefined_and_does_not_hold() {
        for verdict in [
            t_test(&[], 0.0, ONE),
            t_test(&[1.0], 1.0, ONE),
            t_test(&[1.0, f64::NAN], 1.0, ONE),
            t_test(&[1.0, 2.0], f64::INFINITY, ONE),
            z_test(1.0, 1.0, f64::NAN, ONE),
            z_test(1.0, 1.0, -1.0, ONE),
            chi2_test(&[1, 2], &[3.0], ONE),
            chi2_test(&[3, 3], &[3.0, 3.0], ONE),
            chi2_test(&[30, 30], &[30.0, 31.0], ONE),
            chi2_test(&[30, 30], &[90.0, -30.0], ONE),
            ks_uniform_test(&[], ONE),
            ks_uniform_test(&[0.5, 1.5], ONE),
        ] {
            assert!(matches!(verdict.outcome, Outcome::Undefined(_)) && !verdict.holds(), "{verdict}");
            assert!(verdict.statistic.is_none() && verdict.p_value.is_none());
        }
        assert_eq!(welch(&[1.0], &[1.0, 2.0]), None);
        assert_eq!(welch(&[1.0, f64::INFINITY], &[1.0, 2.0]), None);
    }

    #[test]
    fn rounding_is_no_evidence() {
        let third = 1.0 / 3.0;
        let nearby = third + f64::EPSILON / 4.0;
        assert!(nearby != third && t_test(&[nearby; 8], third, ONE).holds());
        assert!(t_test(&[nearby, third, nearby, nearby, nearby, nearby], third, ONE).holds());
    }

    #[test]
    fn sidak_does_not_vanish_for_a_million_tests() {
        assert!((sidak(0.01, 1_048_576) / (0.010_050_335_853_501_44 / 1_048_576.0) - 1.0).abs() < 1e-8);
        assert_eq!(Family { tests: 1, false_alarm: 0.01 }.per_test(), 0.01);
    }

    #[test]
    fn a_verdict_says_what_it_found_and_what_it_would_catch() {
        let text = t_test(&[1.0, 2.0, 3.0, 2.0], 2.5, Family { tests: 24, false_alarm: 1e-6 }).to_string();
        for part in ["holds", "statistic -1.2247", "p = 3.", "1 of 24 tests", "1e-6", "would be caught"] {
            assert!(text.contains(part), "{part:?} in {text:?}");
        }
    }

    /// A null calibration: the t test on uniform numbers may fail in 1 % of 20 000 runs; six standard errors (7e-4
    /// each) allowed, a false alarm of 2e-9.
    #[test]
    fn the_t_test_lies_as_often_as_it_says() {
        let mut rng = Pcg64::new(7, 1);
        let mut run = |bias: f64| {
            let values: Vec<f64> = (0..16).map(|_| uniform(&mut rng) + bias).collect();
            t_test(&values, 0.5, ONE)
        };
        let alarms = (0..20_000).filter(|_| !run(0.0).holds()).count();
        assert!((0.0058..0.0142).contains(&(alarms as f64 / 20_000.0)), "{alarms}");
        // A bias of the size that the verdict names on average is found nearly always: POWER at 16 replicates.
        let detects = run(0.0).detects.expect("a spread");
        let found = (0..2_000).filter(|_| !run(1.15 * detects).holds()).count();
        assert!(found > 1_900, "{found} of 2000 at {detects}");
    }

    /// The statistic is (25 · 3 + 225)/15; its upper tail at 3 degrees of freedom is erfc(√10) + √(40/π) e^−10.
    #[test]
    fn small_cells_are_pooled_smallest_first() {
        assert_eq!(pooled_cells(&[1, 20, 2, 3], &[2.0, 18.0, 4.0, 2.0]), vec![(6, 8.0), (20, 18.0)]);
        assert_eq!(pooled_cells(&[1, 2, 3], &[1.0, 2.0, 1.0]), vec![]);
        assert_eq!(pooled_cells(&[4, 6], &[5.0, 5.0]), vec![(4, 5.0), (6, 5.0)]);
        let verdict = chi2_test(&[10, 10, 10, 30], &[15.0; 4], ONE);
        assert_eq!(verdict.statistic, Some(20.0));
        assert!(!verdict.holds() && (verdict.p_value.expect("tested") - 1.697_424e-4).abs() < 1e-10, "{verdict}");
    }

    /// Critical values of D (Miller 1956, table 1) and one probability of Marsaglia, Tsang & Wang 2003.
    #[test]
    fn kolmogorov_smirnov_meets_published_values() {
        for (n, critical, alpha) in [(10, 0.48893, 0.01), (20, 0.35241, 0.01), (10, 0.40925, 0.05), (1, 0.975, 0.05)] {
            let p = 2.0 * one_sided_smirnov(n, critical);
            assert!((p - alpha).abs() < 2e-3 * alpha, "{n}: {p}");
        }
        let (bound, exact) = (2.0 * one_sided_smirnov(10, 0.274), 1.0 - 0.628_479_615_456_5);
        assert!(bound >= exact && bound < 1.01 * exact, "{bound} {exact}");
    }

    #[test]
    fn kolmogorov_smirnov_sees_a_bent_distribution_and_passes_a_straight_one() {
        let mut rng = Pcg64::new(8, 1);
        let straight: Vec<f64> = (0..2000).map(|_| uniform(&mut rng)).collect();
        let bent: Vec<f64> = straight.iter().map(|u| u.sqrt()).collect();
        let family = Family { tests: 1, false_alarm: 1e-6 };
        assert!(ks_uniform_test(&straight, family).holds() && !ks_uniform_test(&bent, family).holds());
        assert_eq!(ks_uniform_test(&[0.0; 3], family).statistic, Some(1.0));
        assert_eq!(ks_uniform_test(&[0.5], family).p_value, Some(1.0));
    }

    #[test]
    fn adjusted_p_values_stay_monotone_and_below_one_at_the_extremes() {
        let p = [1e-300, 0.0, 1.0, 0.6, f64::MIN_POSITIVE];
        for adjusted in [holm(&p), benjamini_hochberg(&p)].map(|a| a.expect("probabilities")) {
            assert!(adjusted.iter().zip(&p).all(|(a, p)| a >= p && *a <= 1.0), "{adjusted:?}");
            assert!(adjusted[1] <= adjusted[4] && adjusted[4] <= adjusted[0] && adjusted[0] <= adjusted[3]);
        }
        assert_eq!(holm(&[]), Ok(vec![]));
        for bad in [f64::NAN, -0.1, 1.1] {
            let error = holm(&[0.5, bad]).expect_err("no probability");
            assert!(error.to_string().starts_with("p-value 1: expected a number in [0, 1]"), "{error}");
            assert!(benjamini_hochberg(&[bad]).is_err());
        }
    }

    /// Closed forms at the ends: 1 − (α/2)^(1/n) and its mirror; 5 of 10 from Clopper & Pearson 1934.
    #[test]
    fn clopper_pearson_meets_its_closed_forms() {
        let end = 1.0 - libm::pow(0.025, 1.0 / 12.0);
        let [low, high] = clopper_pearson(0, 12, 0.95);
        assert!(low == 0.0 && (high - end).abs() < 1e-14);
        let [low, high] = clopper_pearson(12, 12, 0.95);
        assert!(high == 1.0 && (low - (1.0 - end)).abs() < 1e-14);
        let [low, high] = clopper_pearson(5, 10, 0.95);
        assert!((low - 0.187_086).abs() < 1e-6 && (high - 0.812_914).abs() < 1e-6, "{low} {high}");
        assert_eq!(clopper_pearson(0, 0, 0.95), [0.0, 1.0]);
    }

    /// A weakness shown: on rare binary pixels Welch's p-values fall below 1e-4 in 1.2 % of null runs
    /// (0.0116 in `failures_measured.json`), a hundred times too often; means over tiles of 64 pixels, 16 replicates a side, behave.
    /// 20 000 runs: standard error 7.6e-4 at 0.0116 and 7e-5 at 1e-4; the bounds are six of them.
    #[test]
    fn welch_cries_wolf_on_rare_binary_pixels_and_not_on_pooled_tiles() {
        let mut rng = Pcg64::new(9, 1);
        let alarms = |rng: &mut Pcg64, pooled: u32, sizes: [usize; 2]| {
            let run = |rng: &mut Pcg64| {
                let mut pixel = || {
                    let hits = (0..pooled).filter(|_| uniform(rng) < 0.05).count();
                    hits as f64 / f64::from(pooled)
                };
                let [a, b] = sizes.map(|n| (0..n).map(|_| pixel()).collect::<Vec<f64>>());
                welch(&a, &b).is_some_and(|w| w.p_two_sided < 1e-4)
            };
            (0..20_000).filter(|_| run(rng)).count() as f64 / 20_000.0
        };
        let single = alarms(&mut rng, 1, [64, 256]);
        assert!((0.007..0.0162).contains(&single), "{single}");
        let tiles = alarms(&mut rng, 64, [16, 16]);
        assert!(tiles < 5.2e-4, "{tiles}");
    }

    /// 512 × 512 null tests: uncorrected, 1 % of them are "found" (2621 ± 51; six of those allowed). Corrected to one
    /// false alarm in a million pictures, none is.
    #[test]
    fn a_quarter_of_a_million_true_hypotheses_give_no_discovery_after_correction() {
        let mut rng = Pcg64::new(10, 1);
        let p: Vec<f64> = (0..262_144).map(|_| uniform(&mut rng)).collect();
        let found = |p: &[f64], level: f64| p.iter().filter(|p| **p < level).count();
        assert!((2_315..2_928).contains(&found(&p, 0.01)), "{}", found(&p, 0.01));
        for adjusted in [holm(&p), benjamini_hochberg(&p)] {
            assert_eq!(found(&adjusted.expect("probabilities"), 1e-6), 0);
        }
    }
}

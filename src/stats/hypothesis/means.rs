//! Means of replicates: against an exact value, and against each other.

use super::{Family, Outcome, POWER, Verdict};
use crate::mutants::{Mutant, planted};
use crate::stats::moments::{Moments, student_t_quantile, two_sided_factor};
use crate::stats::special::{incomplete_gamma_upper, normal_upper_tail, student_two_sided, student_two_sided_inverse};
use crate::stats::tails::Tails;

/// Two numbers this close, relative to the larger, differ by rounding alone; no test can speak about less.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Why values that are NaN or infinite have no verdict.
pub(super) const NOT_FINITE: &str = "a value is not finite";

/// Do `a` and `b` differ by no more than rounding?
pub(in crate::stats) fn same_but_for_rounding(a: f64, b: f64) -> bool {
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
        return Verdict::undefined(family, "a t test needs at least two replicates");
    };
    if !(error.is_finite() && exact.is_finite()) {
        return Verdict::undefined(family, NOT_FINITE);
    }
    against_exact(mean, exact, error, (moments.n() - 1) as f64, family)
}

/// As [`t_test`] for values that are squares of errors, or other values no less skewed to the right than these: variances
/// against exact ones.
///
/// Its level is that of [`Family::for_skewed`] at the skewness of the values, or of squares of normal numbers, √8, if that is more: of
/// values too low as a whole the skewness is seen too low as well. Holds its rate to leading order from some thousand values on.
pub fn t_test_of_squares(squares: &[f64], exact: f64, family: Family) -> Verdict {
    let seen = Tails::of(squares).map_or(0.0, |tails| tails.skewness);
    t_test(squares, exact, family.for_skewed(seen.max(8f64.sqrt()), squares.len()))
}

/// Is a `value` of known `standard_error` equal to `exact`? Two-sided test on the normal distribution.
///
/// Zero standard error gives a definite answer; a negative or non-finite one is undefined.
pub fn z_test(value: f64, exact: f64, standard_error: f64, family: Family) -> Verdict {
    if !(value.is_finite() && exact.is_finite() && standard_error.is_finite() && standard_error >= 0.0) {
        return Verdict::undefined(family, "a value or its standard error is not finite, or it is negative");
    }
    against_exact(value, exact, standard_error, f64::INFINITY, family)
}

/// The common end of both: a t statistic at `df` degrees of freedom (∞ for the normal), and its power.
fn against_exact(value: f64, exact: f64, error: f64, df: f64, family: Family) -> Verdict {
    let df = if planted(Mutant::NormalForStudent) { f64::INFINITY } else { df };
    let detects = Some(detected_shift(student_two_sided_inverse(family.per_test(), df), df) * error);
    let answer = match definite(value, exact, error) {
        Some(outcome) => Verdict::new(family, outcome),
        None => {
            let statistic = (value - exact) / error;
            Verdict::tested(family, statistic, student_two_sided(statistic, df))
        }
    };
    Verdict { detects, ..answer }
}

/// The shift, in true standard errors, at which Student's T exceeds `critical` with probability [`POWER`].
///
/// The noncentral t distribution by its normal approximation, δ = c (1 − 1/(4ν)) + z √(1 + c²/(2ν)) (Abramowitz & Stegun 26.7.10): an
/// estimated error spreads T by 1/√(2ν) of itself, which the quantiles of the central one leave out. Its last term is raised by 1/(3ν), so
/// that the true power, by quadrature, is 0.989 to 0.993 from 3 values on, at levels from 10⁻² to 10⁻⁹.
fn detected_shift(critical: f64, df: f64) -> f64 {
    let spread = (1.0 + critical * critical / (2.0 * df)).sqrt() * (1.0 + 1.0 / (3.0 * df));
    critical * (1.0 - 1.0 / (4.0 * df)) + student_t_quantile(POWER, f64::INFINITY) * spread
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

/// As [`welch`], with its p-value, level and power as a verdict: have `a` and `b` the same expectation?
///
/// `detects` is the smallest difference of the two expectations. Undefined with fewer than two values on a side or a value that is not finite.
pub fn welch_test(a: &[f64], b: &[f64], family: Family) -> Verdict {
    if a.len() < 2 || b.len() < 2 {
        return Verdict::undefined(family, "Welch's test needs at least two replicates on either side");
    }
    let [ma, mb] = [a, b].map(|values| values.iter().copied().collect::<Moments>());
    let Some(result) = welch(a, b) else { return Verdict::undefined(family, NOT_FINITE) };
    let (mean_a, mean_b) = (ma.mean().unwrap_or(f64::NAN), mb.mean().unwrap_or(f64::NAN));
    let error = libm::hypot(ma.standard_error().unwrap_or(f64::NAN), mb.standard_error().unwrap_or(f64::NAN));
    let freedom = result.df.unwrap_or(f64::INFINITY);
    let critical = student_two_sided_inverse(family.per_test(), freedom);
    let detects = Some(detected_shift(critical, freedom) * error);
    let answer = match (definite(mean_a, mean_b, error), result.t) {
        (Some(outcome), _) => Verdict::new(family, outcome),
        (None, Some(t)) => Verdict::tested(family, t, result.p_two_sided),
        (None, None) => Verdict::undefined(family, NOT_FINITE),
    };
    Verdict { detects, ..answer }
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

/// The half-width factor of a two-sided normal interval, 1.96 at 0.95.
pub fn normal_factor(confidence: f64) -> f64 {
    two_sided_factor(confidence, f64::INFINITY)
}

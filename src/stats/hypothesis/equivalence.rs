//! "The same, but for a margin" as something that is shown: two one-sided tests (Schuirmann 1987, doi:10.1007/BF01068419).
//!
//! That a test of difference found nothing may only mean that it saw too little. Here the hypothesis is that the truth lies at
//! the margin or beyond it, on either side; where both sides are rejected, equivalence is shown, and the chance to claim
//! it falsely is at most the level. The p-value is the larger of the two. It is the same as asking whether the
//! two-sided interval at confidence 1 − 2·level lies inside the margin; the narrowest margin that holds it is
//! [`Verdict::margin`].
//!
//! Showing needs data: [`Verdict::misses`] says how often this spread fails to show sameness of what *is* the same. A test that
//! must not fail by chance needs that number to be small; more replicates make it so.

use super::means::NOT_FINITE;
use super::{Claim, Family, Outcome, Verdict};
use crate::stats::moments::{Moments, sum};
use crate::stats::special::{student_two_sided, student_two_sided_inverse};

const TOO_FEW: &str = "an equivalence test needs at least two replicates";
const NO_BAND: &str = "an equivalence test needs a margin above 0, or a band around 1 whose lower end is above 0";

/// Is the expectation of independent `replicates` shown to lie within `margin` > 0 of `exact`? Student's t, n − 1 degrees
/// of freedom. For replicates paired by seed, give their differences and 0.
///
/// Without spread the answer is definite. Undefined below two replicates, with a value that is not finite, or without a
/// margin.
pub fn equivalence_test(replicates: &[f64], exact: f64, margin: f64, family: Family) -> Verdict {
    let moments: Moments = replicates.iter().copied().collect();
    let (Some(mean), Some(error)) = (moments.mean(), moments.standard_error()) else {
        return Verdict::undefined(family, TOO_FEW);
    };
    let seen = Seen { value: mean - exact, error, freedom: (moments.n() - 1) as f64 };
    within(seen, [-margin, margin], 0.0, family)
}

/// The same for an estimate of which only its `value`, standard `error` and the degrees of freedom of that are known (∞ for the
/// normal distribution): is its expectation shown to lie within `margin` > 0 of 0?
pub fn equivalence_of_estimate(value: f64, error: f64, freedom: f64, margin: f64, family: Family) -> Verdict {
    within(Seen { value, error, freedom }, [-margin, margin], 0.0, family)
}

/// Are the expectations of independent replicates `a` and `b` shown to differ by less than `margin` > 0? Welch's standard
/// error and degrees of freedom; otherwise as [`equivalence_test`].
pub fn equivalence_of_means(a: &[f64], b: &[f64], margin: f64, family: Family) -> Verdict {
    let Some([a, b]) = both(a, b) else { return Verdict::undefined(family, TOO_FEW) };
    let (error, freedom) = welch_error([a.error, b.error], [a.freedom, b.freedom]);
    within(Seen { value: a.value - b.value, error, freedom }, [-margin, margin], 0.0, family)
}

/// Is E a/E b of independent replicates shown to lie in `band` = [lo, hi] around 1? E b has to be above 0.
///
/// No ratio is formed: E a > lo · E b and E a < hi · E b are tested as differences (Sasabuchi 1988, after Fieller 1954), so the test
/// is exact for normal replicates also where b varies much. Undefined where the mean of b is not above 0.
pub fn mean_ratio_equivalence(a: &[f64], b: &[f64], band: [f64; 2], family: Family) -> Verdict {
    let Some([a, b]) = both(a, b) else { return Verdict::undefined(family, TOO_FEW) };
    let seen = |ratio: f64| {
        let (error, freedom) = welch_error([a.error, ratio * b.error], [a.freedom, b.freedom]);
        Seen { value: a.value - ratio * b.value, error, freedom }
    };
    ratio_within([a.value, b.value], seen, band, family)
}

/// As [`mean_ratio_equivalence`] for replicates that share their seeds, `a[i]` with `b[i]`: what both have of one seed's luck
/// cancels. Undefined where the lists differ in length.
pub fn paired_ratio_equivalence(a: &[f64], b: &[f64], band: [f64; 2], family: Family) -> Verdict {
    if a.len() != b.len() || a.len() < 2 {
        return Verdict::undefined(family, "paired replicates need as many on either side, and at least two");
    }
    let seen = |ratio: f64| Seen::of(&a.iter().zip(b).map(|(a, b)| a - ratio * b).collect::<Vec<_>>());
    let mean = |values: &[f64]| sum(values.iter().copied()) / values.len() as f64;
    ratio_within([mean(a), mean(b)], |ratio| seen(ratio).unwrap_or(Seen::NONE), band, family)
}

/// Is the variance of independent `replicates` over the `exact` one shown to lie in `band` = [lo, hi] around 1?
///
/// `mean` is their exact expectation where it is known; the squared deviations (x − mean)²/exact then have the ratio as
/// expectation, whatever the distribution, and are tested as by [`equivalence_test`]. Without it n/(n − 1) · (x − x̄)²/exact
/// takes their place. No normality is assumed of the replicates as the χ² interval of a variance does (which for kurtosis 1.8 or 6
/// is too wide or too short by √(κ − 1)/√2); but squared deviations are skewed, so Student's t needs some thousand of them before
/// levels like 1e-6 are kept: count on n ≥ 10⁴ there.
pub fn variance_equivalence(
    replicates: &[f64],
    mean: Option<f64>,
    exact: f64,
    band: [f64; 2],
    family: Family,
) -> Verdict {
    if exact <= 0.0 || !exact.is_finite() {
        return Verdict::undefined(family, "the exact variance has to be above 0");
    }
    let Some(seen) = Seen::of(&squared_deviations(replicates, mean)) else {
        return Verdict::undefined(family, TOO_FEW);
    };
    if !is_band(band) {
        return Verdict::undefined(family, NO_BAND);
    }
    let relative = Seen { value: seen.value / exact, error: seen.error / exact, ..seen };
    within(relative, band, 1.0, family)
}

/// Is Var a/Var b of independent replicates shown to lie in `band` = [lo, hi] around 1?
///
/// On the logarithm: ln (s_a²/s_b²) has by the delta method the variance Σ Var(squared deviations)/(n s⁴), which needs no
/// normality; Welch's degrees of freedom. Undefined where a side does not vary.
pub fn variance_ratio_equivalence(a: &[f64], b: &[f64], band: [f64; 2], family: Family) -> Verdict {
    let squares = [a, b].map(|values| Seen::of(&squared_deviations(values, None)));
    let [Some(a), Some(b)] = squares else { return Verdict::undefined(family, TOO_FEW) };
    let vary = a.value > 0.0 && b.value > 0.0;
    if !vary || !is_band(band) {
        return Verdict::undefined(
            family,
            if vary { NO_BAND } else { "values that do not vary have no ratio of variances" },
        );
    }
    let (error, freedom) = welch_error([a.error / a.value, b.error / b.value], [a.freedom, b.freedom]);
    let seen = Seen { value: libm::log(a.value / b.value), error, freedom };
    let verdict = within(seen, band.map(libm::log), 0.0, family);
    let to_ratio = |end: f64| (libm::expm1(end)).abs();
    let reach = verdict.margin.map(|_| half_width(seen, family));
    Verdict {
        statistic: verdict.statistic.map(|_| a.value / b.value),
        margin: reach.map(|w| to_ratio(seen.value + w).max(to_ratio(seen.value - w))),
        ..verdict
    }
}

/// What was seen of a number: its estimate, standard error and the degrees of freedom of that.
#[derive(Debug, Clone, Copy)]
struct Seen {
    value: f64,
    error: f64,
    freedom: f64,
}

impl Seen {
    const NONE: Self = Self { value: f64::NAN, error: f64::NAN, freedom: 1.0 };

    fn of(values: &[f64]) -> Option<Self> {
        let moments: Moments = values.iter().copied().collect();
        Some(Self { value: moments.mean()?, error: moments.standard_error()?, freedom: values.len() as f64 - 1.0 })
    }

    /// P(T > `distance` in standard errors) of this estimate.
    fn upper_tail(&self, distance: f64) -> f64 {
        let t = distance / self.error;
        let half = 0.5 * student_two_sided(t, self.freedom);
        if t >= 0.0 { half } else { 1.0 - half }
    }
}

fn both(a: &[f64], b: &[f64]) -> Option<[Seen; 2]> {
    Some([Seen::of(a)?, Seen::of(b)?])
}

/// Two independent standard errors joined, with Welch and Satterthwaite's degrees of freedom.
fn welch_error([a, b]: [f64; 2], [freedom_a, freedom_b]: [f64; 2]) -> (f64, f64) {
    let error = libm::hypot(a, b);
    if error == 0.0 {
        return (0.0, freedom_a + freedom_b);
    }
    let share = |e: f64, freedom: f64| (e / error) * (e / error) * (e / error) * (e / error) / freedom;
    (error, 1.0 / (share(a, freedom_a) + share(b, freedom_b)))
}

fn squared_deviations(values: &[f64], mean: Option<f64>) -> Vec<f64> {
    let n = values.len() as f64;
    let (centre, scale) = match mean {
        Some(mean) => (mean, 1.0),
        None => (sum(values.iter().copied()) / n, n / (n - 1.0)),
    };
    values.iter().map(|v| scale * (v - centre) * (v - centre)).collect()
}

fn is_band([low, high]: [f64; 2]) -> bool {
    0.0 < low && low < 1.0 && 1.0 < high && high.is_finite()
}

/// One-sided critical value times the standard error.
fn half_width(seen: Seen, family: Family) -> f64 {
    student_two_sided_inverse((2.0 * family.per_test()).min(1.0), seen.freedom) * seen.error
}

/// Is the truth shown to lie in [low, high], which holds `centre`?
fn within(seen: Seen, [low, high]: [f64; 2], centre: f64, family: Family) -> Verdict {
    if !(low < centre && centre < high) {
        return Verdict::undefined(family, NO_BAND);
    }
    if !(seen.value.is_finite() && seen.error.is_finite()) {
        return Verdict::undefined(family, NOT_FINITE);
    }
    if seen.error == 0.0 {
        let inside = low < seen.value && seen.value < high;
        return definite(inside, (seen.value - centre).abs(), family);
    }
    let reach = half_width(seen, family);
    let p = seen.upper_tail(seen.value - low).max(seen.upper_tail(high - seen.value));
    let misses = seen.upper_tail(high - centre - reach) + seen.upper_tail(centre - low - reach);
    Verdict {
        claim: Claim::Equivalent,
        margin: Some((seen.value - centre).abs() + reach),
        misses: Some(misses.min(1.0)),
        ..Verdict::tested(family, seen.value, p)
    }
}

fn definite(inside: bool, distance: f64, family: Family) -> Verdict {
    let outcome = if inside { Outcome::DefinitelyEqual } else { Outcome::DefinitelyDifferent };
    // What is certain is shown with p = 0, and refuted with p = 1.
    let p_value = Some(if inside { 0.0 } else { 1.0 });
    Verdict { claim: Claim::Equivalent, p_value, margin: Some(distance), ..Verdict::new(family, outcome) }
}

/// Is the ratio of two means shown to lie in `band`? `seen(r)` is a − r b.
fn ratio_within([a, b]: [f64; 2], seen: impl Fn(f64) -> Seen, band: [f64; 2], family: Family) -> Verdict {
    if !is_band(band) {
        return Verdict::undefined(family, NO_BAND);
    }
    let (below, above) = (seen(band[0]), seen(band[1]));
    if !(a.is_finite() && b.is_finite() && below.error.is_finite() && above.error.is_finite()) {
        return Verdict::undefined(family, NOT_FINITE);
    }
    if b <= 0.0 {
        return Verdict::undefined(family, "a ratio of means needs a denominator above 0");
    }
    if below.error == 0.0 && above.error == 0.0 {
        return definite(band[0] < a / b && a / b < band[1], (a / b - 1.0).abs(), family);
    }
    let p = below.upper_tail(below.value).max(above.upper_tail(-above.value));
    // At a true ratio of 1 the differences are centred at (1 − lo) b and (1 − hi) b.
    let miss = |edge: &Seen, ratio: f64| edge.upper_tail((1.0 - ratio).abs() * b - half_width(*edge, family));
    Verdict {
        claim: Claim::Equivalent,
        margin: shown_margin(a / b, &seen, family),
        misses: Some((miss(&below, band[0]) + miss(&above, band[1])).min(1.0)),
        ..Verdict::tested(family, a / b, p)
    }
}

/// The farther end of Fieller's interval from 1: the ratios r whose difference a − r b is within its half-width, by
/// bisection outwards from the estimate; `None` where the interval is unbounded.
fn shown_margin(ratio: f64, seen: &impl Fn(f64) -> Seen, family: Family) -> Option<f64> {
    // Degrees of freedom hardly change along the interval: those at the estimate serve for all of it.
    let here = seen(ratio);
    let critical = student_two_sided_inverse((2.0 * family.per_test()).min(1.0), here.freedom);
    let is_compatible = |r: f64| {
        let seen = seen(r);
        seen.value.abs() <= critical * seen.error
    };
    let end = |sign: f64| {
        let mut step = 1e-3;
        while is_compatible(ratio + sign * step) {
            step *= 2.0;
            if step > 1e3 {
                return None;
            }
        }
        let (mut inside, mut outside) = (0.0, step);
        for _ in 0..24 {
            let middle = 0.5 * (inside + outside);
            if is_compatible(ratio + sign * middle) { inside = middle } else { outside = middle }
        }
        Some(ratio + sign * outside)
    };
    Some((end(1.0)? - 1.0).abs().max((end(-1.0)? - 1.0).abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::Rng;

    fn uniform(rng: &mut Pcg64) -> f64 {
        (rng.next_u64() >> 11) as f64 * 0.5f64.powi(53)
    }

    fn draws(rng: &mut Pcg64, n: usize, mean: f64) -> Vec<f64> {
        (0..n).map(|_| uniform(rng) - 0.5 + mean).collect()
    }

    /// x = 1, 2, 3, 4 against 2.5 ± 2: mean 2.5, error √(5/12), t = 2/0.6455 = 3.0984, and at 3 degrees of freedom
    /// P(T > t) = ½ − (atan(t/√3) + √3 t/(3 + t²))/π.
    #[test]
    fn a_small_case_by_hand() {
        let verdict = equivalence_test(&[1.0, 2.0, 3.0, 4.0], 2.5, 2.0, Family::one(0.05));
        let t = 2.0 / (5.0f64 / 12.0).sqrt();
        let root = 3f64.sqrt();
        let p = 0.5 - ((t / root).atan() + root * t / (3.0 + t * t)) / std::f64::consts::PI;
        assert!((verdict.p_value.unwrap() - p).abs() < 1e-14 && verdict.holds(), "{verdict}");
        // t_{0.95, 3} = 2.353363.
        assert!((verdict.margin.unwrap() - 2.353_363_434_8 * (5.0f64 / 12.0).sqrt()).abs() < 1e-9, "{verdict}");
    }

    /// The margin that is said to be shown is shown, and one a thousandth smaller is not: for every kind.
    #[test]
    fn the_smallest_margin_is_the_edge() {
        let mut rng = Pcg64::new(31, 1);
        let (a, b) = (draws(&mut rng, 40, 5.0), draws(&mut rng, 30, 5.1));
        let family = Family::one(1e-3);
        let edge = |margin: f64, run: &dyn Fn(f64) -> Verdict| {
            assert!(run(margin * 1.001).holds() && !run(margin * 0.999).holds(), "{}", run(margin));
        };
        edge(equivalence_test(&a, 4.9, 1.0, family).margin.unwrap(), &|m| equivalence_test(&a, 4.9, m, family));
        edge(equivalence_of_means(&a, &b, 1.0, family).margin.unwrap(), &|m| equivalence_of_means(&a, &b, m, family));
        let band = |m: f64| [1.0 - m, 1.0 + m];
        let m = mean_ratio_equivalence(&a, &b, band(0.5), family).margin.unwrap();
        edge(m, &|m| mean_ratio_equivalence(&a, &b, band(m), family));
        let m = paired_ratio_equivalence(&a[..30], &b, band(0.5), family).margin.unwrap();
        edge(m, &|m| paired_ratio_equivalence(&a[..30], &b, band(m), family));
        let many = draws(&mut rng, 400, 0.0);
        let m = variance_equivalence(&many, None, 1.0 / 12.0, band(0.5), family).margin.unwrap();
        edge(m, &|m| variance_equivalence(&many, None, 1.0 / 12.0, band(m), family));
        let other = draws(&mut rng, 500, 3.0);
        let wide = |m: f64| [1.0 / (1.0 + m), 1.0 + m];
        let m = variance_ratio_equivalence(&many, &other, wide(0.9), family).margin.unwrap();
        assert!(variance_ratio_equivalence(&many, &other, [1.0 - 1.001 * m, 1.0 + 1.001 * m], family).holds());
        assert!(!variance_ratio_equivalence(&many, &other, [1.0 - 0.9 * m, 1.0 + 0.9 * m], family).holds());
    }

    /// At the margin itself equivalence is claimed at the level, 5 %: 2000 runs a kind, of which 45 to 164 with all but probability 7e-10.
    /// False alarms: 5e-9. For the variance of uniform numbers (kurtosis 1.8) too, where a χ² interval would be off by a third.
    #[test]
    fn equivalence_is_claimed_falsely_as_often_as_stated() {
        let mut rng = Pcg64::new(32, 1);
        let family = Family::one(0.05);
        let mut share = |name: &str, run: &mut dyn FnMut(&mut Pcg64) -> Verdict| {
            let claimed = (0..2_000).filter(|_| run(&mut rng).holds()).count();
            assert!((45..=164).contains(&claimed), "{name}: {claimed} of 2000");
        };
        share("mean", &mut |rng| equivalence_test(&draws(rng, 30, 0.3), 0.0, 0.3, family));
        share("two means", &mut |rng| equivalence_of_means(&draws(rng, 30, 0.3), &draws(rng, 60, 0.0), 0.3, family));
        share("ratio", &mut |rng| {
            mean_ratio_equivalence(&draws(rng, 60, 1.2), &draws(rng, 40, 1.0), [0.8, 1.2], family)
        });
        share("variance", &mut |rng| {
            variance_equivalence(&draws(rng, 500, 0.0), None, 1.0 / 12.0 / 1.2, [0.8, 1.2], family)
        });
    }

    /// What is the same is shown but for the stated share of misses.
    #[test]
    fn misses_are_foretold() {
        let mut rng = Pcg64::new(33, 1);
        let family = Family::one(0.01);
        let (mut missed, mut foretold) = (0.0, 0.0);
        for _ in 0..2_000 {
            let verdict = equivalence_test(&draws(&mut rng, 100, 0.0), 0.0, 0.1, family);
            missed += f64::from(u8::from(!verdict.holds()));
            foretold += verdict.misses.unwrap();
        }
        // About 260 of 2000 ± 15.
        assert!(foretold > 100.0 && (missed - foretold).abs() < 90.0, "{missed} {foretold}");
    }

    #[test]
    fn what_does_not_vary_is_definite_and_what_cannot_be_tested_is_undefined() {
        let family = Family::one(0.01);
        assert!(equivalence_test(&[2.0; 4], 2.05, 0.1, family).holds());
        let beyond = equivalence_test(&[2.0; 4], 2.2, 0.1, family);
        assert!(!beyond.holds() && beyond.to_string().contains("beyond the margin"), "{beyond}");
        assert!(mean_ratio_equivalence(&[1.0; 3], &[1.02; 3], [0.95, 1.05], family).holds());
        for verdict in [
            equivalence_test(&[1.0], 1.0, 0.1, family),
            equivalence_test(&[1.0, 2.0], 1.0, 0.0, family),
            equivalence_test(&[1.0, f64::NAN], 1.0, 0.1, family),
            mean_ratio_equivalence(&[1.0, 2.0], &[-1.0, -2.0], [0.9, 1.1], family),
            mean_ratio_equivalence(&[1.0, 2.0], &[1.0, 2.0], [1.1, 1.2], family),
            paired_ratio_equivalence(&[1.0, 2.0], &[1.0], [0.9, 1.1], family),
            variance_equivalence(&[1.0, 2.0], None, 0.0, [0.9, 1.1], family),
            variance_ratio_equivalence(&[1.0, 1.0], &[1.0, 2.0], [0.9, 1.1], family),
        ] {
            assert!(matches!(verdict.outcome, Outcome::Undefined(_)) && !verdict.holds(), "{verdict}");
        }
    }
}

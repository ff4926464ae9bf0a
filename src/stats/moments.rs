//! Mean, variance and intervals that keep their digits.

use serde::{Deserialize, Serialize};

use crate::mutants::{Mutant, planted};

use super::special::{incomplete_gamma_upper, solve_falling, student_two_sided_inverse};

/// A number with its 95 % confidence interval.
///
/// `ci95` is `None` where no interval can be had (a single replicate, for example): never a made-up width.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The estimate itself, in the unit of what is estimated; not clipped, so it may be negative by noise.
    pub value: f64,
    /// Lower and upper end of the two-sided 95 % interval, in the same unit.
    pub ci95: Option<[f64; 2]>,
}

impl Estimate {
    /// A number without an interval.
    pub fn without_interval(value: f64) -> Self {
        Self { value, ci95: None }
    }

    /// The same with the interval's ends rounded to 6 significant digits, as intervals are written: quantiles and
    /// resampling deserve no more, and every machine writes the same digits. The value keeps all of its own.
    pub fn with_rounded_interval(self) -> Self {
        Self { ci95: self.ci95.map(|ends| ends.map(round_6)), ..self }
    }

    /// `value` ± `half_width`; no interval where the half-width is absent or not finite.
    pub(super) fn symmetric(value: f64, half_width: Option<f64>) -> Self {
        let ci95 = half_width.filter(|h| h.is_finite()).map(|h| [value - h, value + h]);
        Self { value, ci95 }
    }
}

/// The number nearest to `x` among those of 6 significant decimal digits.
pub(super) fn round_6(x: f64) -> f64 {
    // Decimal text is exact in both directions, so no platform differs; a number's own text always reads.
    format!("{x:.5e}").parse().unwrap_or(x)
}

/// Running mean and variance (Welford 1962), merged by Chan, Golub & LeVeque (1979).
///
/// Differences to the running mean are summed, never squares of the values, so 10⁹ + {4, 7, 13, 16} has variance 30.
/// Merging gives the same bits for the same tree of merges; keep the tree fixed where results are recorded.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moments {
    n: u64,
    mean: f64,
    squares: f64,
}

impl Moments {
    /// Takes one more value.
    pub fn push(&mut self, value: f64) {
        self.n += 1;
        let to_old_mean = value - self.mean;
        self.mean += to_old_mean / self.n as f64;
        self.squares += to_old_mean * (value - self.mean);
    }

    /// Takes all values of another set.
    pub fn merge(&mut self, other: &Self) {
        if other.n == 0 {
            return;
        }
        let total = self.n + other.n;
        let gap = other.mean - self.mean;
        let share = other.n as f64 / total as f64;
        self.mean += gap * share;
        self.squares += other.squares + gap * gap * share * self.n as f64;
        self.n = total;
    }

    /// How many values were taken.
    pub fn n(&self) -> u64 {
        self.n
    }

    /// Arithmetic mean; `None` of no values.
    pub fn mean(&self) -> Option<f64> {
        (self.n > 0).then_some(self.mean)
    }

    /// Unbiased variance Σ(x − mean)²/(n − 1); `None` below two values.
    pub fn variance(&self) -> Option<f64> {
        let freedom = if planted(Mutant::VarianceByN) { self.n } else { self.n.saturating_sub(1) };
        (self.n > 1).then(|| self.squares / freedom as f64)
    }

    /// Standard deviation, the root of [`variance`](Self::variance); `None` below two values.
    pub fn std(&self) -> Option<f64> {
        self.variance().map(f64::sqrt)
    }

    /// Standard error of the mean, √(variance/n), for independent values; `None` below two values.
    pub fn standard_error(&self) -> Option<f64> {
        self.variance().map(|v| (v / self.n as f64).sqrt())
    }
}

impl FromIterator<f64> for Moments {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        let mut moments = Self::default();
        values.into_iter().for_each(|v| moments.push(v));
        moments
    }
}

/// Sum with Neumaier's compensation (1974): the error does not grow with the number of terms.
///
/// |error| ≤ ε |Σx| + O(n ε²) Σ|x|. The order of the terms is the caller's, so the bits are reproducible.
pub fn sum(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut total = 0.0_f64;
    let mut lost = 0.0;
    for value in values {
        let next = total + value;
        lost += if total.abs() >= value.abs() { (total - next) + value } else { (value - next) + total };
        total = next;
    }
    total + lost
}

/// Quantile of Student's t: the q with P(T ≤ q) = `p`, for 0 < p < 1 and `df` > 0 (∞ is the normal).
///
/// Bisection on the incomplete beta integral down to neighbouring floats; good to about 14 digits.
/// Outside those ranges the answer is NaN for a `df` that is no positive number, ∓∞ for p ≤ 0 and p ≥ 1.
pub fn student_t_quantile(p: f64, df: f64) -> f64 {
    if df.is_nan() || p.is_nan() || df <= 0.0 {
        f64::NAN
    } else if p <= 0.0 {
        f64::NEG_INFINITY
    } else if p >= 1.0 {
        f64::INFINITY
    } else if p == 0.5 {
        0.0
    } else if p < 0.5 {
        -student_two_sided_inverse(2.0 * p, df)
    } else {
        student_two_sided_inverse(2.0 * (1.0 - p), df)
    }
}

/// The factor of a two-sided interval: P(|T| ≤ factor) = `confidence` at `df` degrees of freedom.
pub(super) fn two_sided_factor(confidence: f64, df: f64) -> f64 {
    student_two_sided_inverse(1.0 - confidence, df)
}

/// Interval of a variance σ² of normal numbers that was estimated as `variance` with `freedom` > 0 degrees of freedom (not
/// necessarily whole): [variance ν/χ²_hi, variance ν/χ²_lo], with equal tails outside.
///
/// Quantiles of χ² by bisection on the incomplete gamma integral. `confidence` is the two-sided level in (0, 1).
pub fn variance_interval(variance: f64, freedom: f64, confidence: f64) -> [f64; 2] {
    let tail = 0.5 * (1.0 - confidence);
    [tail, 1.0 - tail].map(|upper| variance * (freedom / chi2_quantile(upper, freedom)))
}

/// The x with P(χ² > x) = `upper`.
fn chi2_quantile(upper: f64, freedom: f64) -> f64 {
    let tail = |x: f64| incomplete_gamma_upper(0.5 * freedom, 0.5 * x);
    let mut high = freedom;
    while tail(high) > upper {
        high *= 2.0;
    }
    solve_falling(tail, upper, 0.0, high)
}

/// Mean of independent values with its Student-t interval: mean ± t_{n−1} s/√n.
///
/// `confidence` is the two-sided level in (0, 1); whatever is recorded uses 0.95, hence the field's name. One value
/// has no interval, and no values have no mean (NaN).
pub fn t_interval(values: &[f64], confidence: f64) -> Estimate {
    let moments: Moments = values.iter().copied().collect();
    let half_width = moments.standard_error().map(|e| e * two_sided_factor(confidence, (moments.n() - 1) as f64));
    Estimate::symmetric(moments.mean().unwrap_or(f64::NAN), half_width)
}

/// Delete-1 jackknife of a statistic of `n` independent replicates.
///
/// `theta(None)` is the statistic of all replicates, `theta(Some(i))` that of all but replicate i. The interval is
/// θ ± t_{n−1} √((n−1)/n Σ(θ_i − θ̄)²) at 95 % (Efron & Stein 1981); none below two replicates.
pub fn jackknife(n: usize, theta: impl Fn(Option<usize>) -> f64) -> Estimate {
    let value = theta(None);
    if n < 2 {
        return Estimate::without_interval(value);
    }
    let half_width = jackknife_variance(n, theta).sqrt() * two_sided_factor(0.95, n as f64 - 1.0);
    Estimate::symmetric(value, Some(half_width))
}

/// The delete-1 jackknife's estimate of a statistic's variance, (n−1)/n Σ(θ_i − θ̄)², for n ≥ 2 replicates.
pub(super) fn jackknife_variance(n: usize, theta: impl Fn(Option<usize>) -> f64) -> f64 {
    let left_out: Moments = (0..n).map(|i| theta(Some(i))).collect();
    let n = n as f64;
    left_out.variance().unwrap_or(0.0) * (n - 1.0) * (n - 1.0) / n
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_keep_six_digits() {
        assert_eq!(round_6(0.123_456_789), 0.123_457);
        assert_eq!(round_6(-1_234_567.0), -1_234_570.0);
        assert_eq!(round_6(9.999_999e-12), 1e-11);
        assert_eq!(round_6(0.0), 0.0);
    }

    #[test]
    fn a_large_offset_does_not_touch_the_variance() {
        let moments: Moments = [4.0, 7.0, 13.0, 16.0].map(|x| 1e9 + x).into_iter().collect();
        assert_eq!((moments.mean(), moments.variance()), (Some(1e9 + 10.0), Some(30.0)));
    }

    #[test]
    fn no_value_has_no_mean_and_one_value_no_variance() {
        assert_eq!(Moments::default().mean(), None);
        let one: Moments = [3.5].into_iter().collect();
        assert_eq!((one.mean(), one.variance(), one.std(), one.standard_error()), (Some(3.5), None, None, None));
        assert_eq!(t_interval(&[3.5], 0.95), Estimate { value: 3.5, ci95: None });
        assert!(t_interval(&[], 0.95).value.is_nan());
    }

    #[test]
    fn merging_parts_equals_taking_the_whole() {
        let values: Vec<f64> = (0..1000).map(|i| 1e6 + f64::from(i * i % 97)).collect();
        let whole: Moments = values.iter().copied().collect();
        for cut in [0, 1, 333, 999, 1000] {
            let mut merged: Moments = values[..cut].iter().copied().collect();
            merged.merge(&values[cut..].iter().copied().collect());
            assert_eq!(merged.n(), whole.n());
            let (a, b) = (merged.variance().unwrap_or(0.0), whole.variance().unwrap_or(0.0));
            assert!((a - b).abs() <= 1e-12 * b, "{cut}: {a} {b}");
            assert!((merged.mean - whole.mean).abs() <= 1e-15 * whole.mean);
        }
    }

    #[test]
    fn the_sum_keeps_what_plain_addition_loses() {
        assert_eq!(sum([1.0, 1e100, 1.0, -1e100]), 2.0);
        // Twin in integers: 2^25 additions of 2^-20 to 2^33 lose everything in plain f64 only far later; scale up.
        assert_eq!(sum(std::iter::once(9e15).chain(std::iter::repeat_n(0.25, 4_000))), 9e15 + 1000.0);
        assert_eq!(sum([]), 0.0);
    }

    /// Quantiles with closed forms: df 1: tan(π(p − ½)); df 2: (2p − 1)/√(2p(1 − p)).
    #[test]
    fn t_quantiles_meet_their_closed_forms() {
        for p in [0.005, 0.2, 0.5, 0.6, 0.975, 0.9995] {
            let one = libm::tan(std::f64::consts::PI * (p - 0.5));
            assert!((student_t_quantile(p, 1.0) - one).abs() <= 2e-12 * one.abs(), "{p}");
            let two = (2.0 * p - 1.0) / (2.0 * p * (1.0 - p)).sqrt();
            assert!((student_t_quantile(p, 2.0) - two).abs() <= 2e-12 * two.abs(), "{p}");
        }
        assert_eq!(student_t_quantile(0.0, 3.0), f64::NEG_INFINITY);
        assert_eq!(student_t_quantile(1.0, 3.0), f64::INFINITY);
        assert!(student_t_quantile(0.3, 0.0).is_nan() && student_t_quantile(0.3, f64::NAN).is_nan());
    }

    /// For the mean, the jackknife is the t interval exactly (Efron & Stein 1981, §2).
    #[test]
    fn the_jackknife_of_the_mean_is_the_t_interval() {
        let x = [1.0, 4.0, 2.0, 8.0, 5.0];
        let mean_without = |out: Option<usize>| {
            let kept = x.iter().enumerate().filter(|&(i, _)| Some(i) != out).map(|(_, v)| *v);
            kept.clone().sum::<f64>() / kept.count() as f64
        };
        let (ours, t) = (jackknife(x.len(), mean_without), t_interval(&x, 0.95));
        let (ours_ends, t_ends) = (ours.ci95.expect("five replicates"), t.ci95.expect("five replicates"));
        assert_eq!(ours.value, t.value);
        assert!((ours_ends[0] - t_ends[0]).abs() < 1e-13 && (ours_ends[1] - t_ends[1]).abs() < 1e-13);
        assert_eq!(jackknife(1, |_| 2.0), Estimate { value: 2.0, ci95: None });
    }

    #[test]
    fn equal_values_have_an_interval_of_no_width() {
        assert_eq!(t_interval(&[0.1; 10], 0.95), Estimate { value: 0.1, ci95: Some([0.1, 0.1]) });
    }

    /// In f32 the running sum of a constant image stalls at 2^24 samples; here 2^25 of them keep their mean.
    #[test]
    fn the_mean_of_many_equal_samples_does_not_stall() {
        let many = 1 << 25;
        let stalled: f32 = std::iter::repeat_n(1.0_f32, many).sum();
        assert_eq!(stalled, 16_777_216.0);
        assert_eq!(sum(std::iter::repeat_n(f64::from(0.1_f32), many)) / many as f64, f64::from(0.1_f32));
        let moments: Moments = std::iter::repeat_n(f64::from(0.1_f32), many).collect();
        assert_eq!((moments.mean(), moments.variance()), (Some(f64::from(0.1_f32)), Some(0.0)));
    }

    /// The order of merges changes roundings only, and one fixed tree gives one set of bits.
    #[test]
    fn merges_in_any_order_agree_to_rounding() {
        let parts: Vec<Moments> =
            (0..7).map(|p| (0..10 + p).map(|i| 1e3 + f64::from(i * 37 % 11 + p)).collect()).collect();
        let merged = |order: &[usize]| {
            let mut total = Moments::default();
            order.iter().for_each(|&i| total.merge(&parts[i]));
            total
        };
        let first = merged(&[0, 1, 2, 3, 4, 5, 6]);
        assert_eq!(first, merged(&[0, 1, 2, 3, 4, 5, 6]));
        for order in [[6, 5, 4, 3, 2, 1, 0], [3, 0, 6, 1, 5, 2, 4]] {
            let other = merged(&order);
            let (a, b) = (first.variance().unwrap_or(0.0), other.variance().unwrap_or(1.0));
            assert!(first.n == other.n && (first.mean - other.mean).abs() < 1e-12 && (a / b - 1.0).abs() < 1e-13);
        }
    }

    /// Put back into the χ² distribution of statrs, the ends leave 2.5 % outside on either side; statrs is good to 1e-11.
    #[test]
    fn the_interval_of_a_variance_leaves_equal_tails_outside() {
        use statrs::distribution::{ChiSquared, ContinuousCDF};
        for freedom in [0.5, 1.0, 3.0, 31.0, 346.2, 1e5] {
            let [low, high] = variance_interval(2.0, freedom, 0.95);
            assert!(low < 2.0 && 2.0 < high);
            let cdf = |end: f64| ChiSquared::new(freedom).unwrap().cdf(2.0 * freedom / end);
            assert!((cdf(low) - 0.975).abs() < 1e-9 && (cdf(high) - 0.025).abs() < 1e-9, "{freedom}: {low} {high}");
        }
    }
}

//! How far the values of a set stray: skewness and kurtosis, and whether a t test may be believed.

use super::moments::{Moments, sum};
use super::special::normal_upper_tail;

/// Replicates of a normal distribution are called heavy-tailed with this probability, about.
pub const HEAVY_TAIL_LEVEL: f64 = 1e-4;

/// The shape of a set of independent replicates beyond its variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tails {
    /// m₃/m₂^(3/2), with m_k the k-th central moment; 0 for a symmetric distribution.
    pub skewness: f64,
    /// m₄/m₂², 3 for a normal distribution, at most n for n values.
    pub kurtosis: f64,
    /// Probability of at least this kurtosis from normal replicates (Anscombe & Glynn 1983, doi:10.1093/biomet/70.1.227);
    /// `None` below 20 values, for which that approximation was not made.
    pub p_value: Option<f64>,
}

impl Tails {
    /// Shape of `values`; `None` below four values, where they do not vary, or where one is not finite.
    pub fn of(values: &[f64]) -> Option<Self> {
        let n = values.len() as f64;
        let moments: Moments = values.iter().copied().collect();
        let (mean, std) = (moments.mean()?, moments.std()?);
        if values.len() < 4 || !std.is_finite() || std == 0.0 {
            return None;
        }
        // In units of the standard deviation, so that no power overflows.
        let power = |k: i32| sum(values.iter().map(|v| ((v - mean) / std).powi(k))) / n;
        let variance = power(2);
        let (skewness, kurtosis) = (power(3) / (variance * variance.sqrt()), power(4) / (variance * variance));
        let p_value = (values.len() >= 20).then(|| normal_upper_tail(anscombe_glynn(kurtosis, n)));
        Some(Self { skewness, kurtosis, p_value })
    }

    /// Do single replicates dominate, so that the t test's level and the interval's coverage are not to be trusted? A rare large
    /// value that has not been seen yet is then missing in the mean *and* in the spread.
    pub fn are_heavy(&self) -> bool {
        self.p_value.is_some_and(|p| p < HEAVY_TAIL_LEVEL)
    }
}

/// The kurtosis of n normal values as a standard normal number.
fn anscombe_glynn(kurtosis: f64, n: f64) -> f64 {
    let expected = 3.0 * (n - 1.0) / (n + 1.0);
    let variance = 24.0 * n * (n - 2.0) * (n - 3.0) / ((n + 1.0) * (n + 1.0) * (n + 3.0) * (n + 5.0));
    let x = (kurtosis - expected) / variance.sqrt();
    let beta = 6.0 * (n * n - 5.0 * n + 2.0) / ((n + 7.0) * (n + 9.0))
        * (6.0 * (n + 3.0) * (n + 5.0) / (n * (n - 2.0) * (n - 3.0))).sqrt();
    let a = 6.0 + 8.0 / beta * (2.0 / beta + (1.0 + 4.0 / (beta * beta)).sqrt());
    let base = (1.0 - 2.0 / a) / (1.0 + x * (2.0 / (a - 4.0)).sqrt());
    let spread = 2.0 / (9.0 * a);
    (1.0 - spread - libm::cbrt(base)) / spread.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::Rng;

    /// scipy.stats.kurtosistest of 0, 1, …, 19: statistic −1.7058104152122062 (its documentation).
    #[test]
    fn the_kurtosis_test_meets_a_published_value() {
        let values: Vec<f64> = (0..20).map(f64::from).collect();
        let tails = Tails::of(&values).unwrap();
        assert!((anscombe_glynn(tails.kurtosis, 20.0) + 1.705_810_415_212_206_2).abs() < 1e-12);
        assert!(tails.skewness.abs() < 1e-15 && !tails.are_heavy());
    }

    #[test]
    fn a_firefly_is_heavy_and_a_normal_set_is_not() {
        let mut rng = Pcg64::new(41, 1);
        let mut normal = || (0..12).map(|_| (rng.next_u64() >> 11) as f64 * 0.5f64.powi(53)).sum::<f64>() - 6.0;
        let mut values: Vec<f64> = (0..64).map(|_| normal()).collect();
        assert!(!Tails::of(&values).unwrap().are_heavy());
        values[7] = 40.0;
        let tails = Tails::of(&values).unwrap();
        assert!(tails.are_heavy() && tails.kurtosis > 30.0 && tails.skewness > 5.0, "{tails:?}");
    }

    #[test]
    fn too_little_has_no_shape() {
        assert_eq!(Tails::of(&[1.0, 2.0, 3.0]), None);
        assert_eq!(Tails::of(&[1.0; 50]), None);
        assert_eq!(Tails::of(&[1.0, 2.0, f64::NAN, 4.0]), None);
        assert_eq!(Tails::of(&[1.0, 2.0, 3.0, 5.0]).unwrap().p_value, None);
        let huge = Tails::of(&[1e300, 2e300, 3e300, 5e300]);
        assert!(huge.is_none_or(|t| t.kurtosis.is_finite()), "{huge:?}");
    }
}

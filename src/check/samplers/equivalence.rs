//! "The same": ratios of variances to exact ones that lie in a band, shown by the library's two one-sided tests.

use crate::stats::{Family, equivalence_test, student_t_quantile};

/// The band in which a variance counts as the exact one: 1 ± [`MARGIN`].
pub const BAND: [f64; 2] = [1.0 - MARGIN, 1.0 + MARGIN];

/// Half of [`BAND`].
pub const MARGIN: f64 = 0.05;

/// The level of each one-sided test: the chance that a ratio on the edge of the band is taken for one inside.
pub const LEVEL: f64 = 1e-3;

/// What two one-sided tests found about a ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RatioFound {
    /// Mean of the replicates' ratios.
    pub ratio: f64,
    /// p-value of the hypothesis that the ratio lies outside [`BAND`]; 1 where it cannot be told.
    pub p_outside: f64,
}

impl RatioFound {
    /// Is it shown that the ratio lies within [`BAND`]?
    pub fn within(&self) -> bool {
        self.p_outside < LEVEL
    }

    /// Is it shown that the ratio lies outside?
    pub fn outside(&self) -> bool {
        self.ratio.is_finite() && self.p_outside > 1.0 - LEVEL
    }
}

/// Two one-sided t tests ([`equivalence_test`]) of the expectation of `ratios`, independent replicates of estimate over exact
/// value; at least two.
pub fn ratio_within(ratios: impl IntoIterator<Item = f64>) -> RatioFound {
    let ratios: Vec<f64> = ratios.into_iter().collect();
    let verdict = equivalence_test(&ratios, 1.0, MARGIN, Family::one(LEVEL));
    // The statistic is the difference; too few replicates have none.
    let ratio = verdict.statistic.map_or(f64::NAN, |_| ratios.iter().sum::<f64>() / ratios.len() as f64);
    RatioFound { ratio, p_outside: verdict.p_value.unwrap_or(1.0) }
}

/// Replicates with which a ratio of exactly 1 is shown to lie in [`BAND`] but for a chance of `miss`, if single ratios have
/// the variance `variance` (2 for squares of normal errors): both quantiles, of [`LEVEL`] and of `miss`/2, must fit
/// into the band's half.
pub fn replicates_for(miss: f64, variance: f64) -> u32 {
    // No smaller p has a quantile in f64: a chance of 10⁻¹⁵ is as good as none.
    let quantile = |p: f64| student_t_quantile(1.0 - p.max(1e-15), f64::INFINITY);
    let half = (quantile(LEVEL) + quantile(0.5 * miss)) / MARGIN;
    (half * half * variance).ceil() as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_is_entered_only_by_an_interval_that_fits() {
        let near =
            |centre: f64, spread: f64| ratio_within((0..100).map(|i| centre + spread * (f64::from(i % 2) - 0.5)));
        assert!(near(1.0, 0.1).within() && !near(1.0, 0.1).outside());
        assert!(!near(1.0, 0.5).within() && !near(1.0, 0.5).outside());
        assert!(near(1.2, 0.1).outside() && !near(1.04, 0.1).within());
        assert!(!ratio_within([1.0]).within() && !ratio_within([]).outside());
    }

    #[test]
    fn replicates_grow_with_what_is_asked_of_them() {
        // (3.09 + 6.0)²·2/0.05².
        let usual = replicates_for(2e-9, 2.0);
        assert!((66_000..67_000).contains(&usual), "{usual}");
        assert!(replicates_for(1e-3, 2.0) < usual && replicates_for(2e-9, 3.0) > usual);
    }
}

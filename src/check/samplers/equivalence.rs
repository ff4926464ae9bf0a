//! "The same": ratios of variances to exact ones that lie in a band, shown by two one-sided tests.
//!
//! To be replaced by the library's own equivalence test where that has landed: see [`ratio_within`].

use crate::stats::{Moments, student_t_quantile};

/// The band in which a variance counts as the exact one.
pub const BAND: [f64; 2] = [0.95, 1.05];

/// The level of each one-sided test: the chance that a ratio on the edge of the band is taken for one inside.
pub const LEVEL: f64 = 1e-3;

/// What two one-sided tests found about a ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RatioFound {
    /// Mean of the replicates' ratios.
    pub ratio: f64,
    /// Interval at confidence 1 − 2·[`LEVEL`]: the ratio is within a band where this is (Schuirmann 1987).
    pub interval: [f64; 2],
}

impl RatioFound {
    /// Is it shown that the ratio lies within `band`?
    pub fn within(&self, band: [f64; 2]) -> bool {
        band[0] < self.interval[0] && self.interval[1] < band[1]
    }

    /// Is it shown that the ratio lies outside?
    pub fn outside(&self, band: [f64; 2]) -> bool {
        self.interval[1] < band[0] || self.interval[0] > band[1]
    }
}

/// Two one-sided t tests of the expectation of `ratios`, independent replicates of estimate over exact value; at least two.
pub fn ratio_within(ratios: impl IntoIterator<Item = f64>) -> RatioFound {
    let moments: Moments = ratios.into_iter().collect();
    let (ratio, error) = (moments.mean().unwrap_or(f64::NAN), moments.standard_error().unwrap_or(f64::NAN));
    let reach = student_t_quantile(1.0 - LEVEL, moments.n() as f64 - 1.0) * error;
    RatioFound { ratio, interval: [ratio - reach, ratio + reach] }
}

/// Replicates with which a ratio of exactly 1 is shown to lie in [`BAND`] but for a chance of `miss`, if single ratios have
/// the variance `variance` (2 for squares of normal errors): both quantiles, of [`LEVEL`] and of `miss`/2, must fit
/// into the band's half.
pub fn replicates_for(miss: f64, variance: f64) -> u32 {
    let quantile = |p: f64| student_t_quantile(1.0 - p, f64::INFINITY);
    let half = (quantile(LEVEL) + quantile(0.5 * miss)) / (0.5 * (BAND[1] - BAND[0]));
    (half * half * variance).ceil() as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_is_entered_only_by_an_interval_that_fits() {
        let near =
            |centre: f64, spread: f64| ratio_within((0..100).map(|i| centre + spread * (f64::from(i % 2) - 0.5)));
        assert!(near(1.0, 0.1).within(BAND) && !near(1.0, 0.1).outside(BAND));
        assert!(!near(1.0, 0.5).within(BAND) && !near(1.0, 0.5).outside(BAND));
        assert!(near(1.2, 0.1).outside(BAND) && !near(1.04, 0.1).within(BAND));
        assert!(!ratio_within([1.0]).within(BAND) && !ratio_within([]).outside(BAND));
    }

    #[test]
    fn replicates_grow_with_what_is_asked_of_them() {
        // (3.09 + 6.0)²·2/0.05².
        let usual = replicates_for(2e-9, 2.0);
        assert!((66_000..67_000).contains(&usual), "{usual}");
        assert!(replicates_for(1e-3, 2.0) < usual && replicates_for(2e-9, 3.0) > usual);
    }
}

//! Independent or correlated? Measured straight from the samplers, without a renderer, at report time.
//!
//! [`within`] asks it of the points of one decision, [`between`] of two decisions of one pixel. Each number comes with an effect
//! size that does not depend on the number of replicates, an interval, and a p-value against exact values of independent
//! numbers. Deterministic: seeds are derived from the experiment's.

pub mod between;
pub mod within;

use crate::stats::hypothesis::chi2_upper_tail;
use crate::stats::{Estimate, Moments, variance_interval};

/// A variance between replicates over that of independent numbers, which is known exactly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VarianceRatio {
    /// The ratio with χ²'s 95 % interval (exact for normal means; the means are of many points).
    pub ratio: Estimate,
    /// P(ratio at most this small | independent).
    pub p_below: f64,
    /// P(ratio at least this large | independent).
    pub p_above: f64,
}

impl VarianceRatio {
    /// Of independent replicates' `means`, whose variance would be `independent` > 0; `None` below two of them.
    pub fn of(means: &[f64], independent: f64) -> Option<Self> {
        let moments: Moments = means.iter().copied().collect();
        let ratio = moments.variance()? / independent;
        let freedom = (means.len() - 1) as f64;
        let p_above = chi2_upper_tail(freedom * ratio, freedom);
        let ratio = Estimate { value: ratio, ci95: Some(variance_interval(ratio, freedom, 0.95)) };
        Some(Self { ratio, p_below: 1.0 - p_above, p_above })
    }

    /// Two-sided p-value: twice the smaller tail.
    pub fn p(&self) -> f64 {
        (2.0 * self.p_below.min(self.p_above)).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Variance 2 of {−√2, …}: the 95 % points of χ² at 4 degrees of freedom are 0.484419 and 11.143287 (tables).
    #[test]
    fn a_ratio_of_variances_has_its_interval_and_both_tails() {
        let means = [-2.0, -1.0, 0.0, 1.0, 2.0];
        let found = VarianceRatio::of(&means, 2.5).unwrap();
        let [low, high] = found.ratio.ci95.unwrap();
        assert!((found.ratio.value - 1.0).abs() < 1e-15);
        assert!((low - 4.0 / 11.143_287).abs() < 1e-6 && (high - 4.0 / 0.484_419).abs() < 1e-5, "{low} {high}");
        // P(χ²₄ > 4) = e⁻² (1 + 2).
        assert!((found.p_above - 3.0 * libm::exp(-2.0)).abs() < 1e-12);
        assert!((found.p_above + found.p_below - 1.0).abs() < 1e-15 && VarianceRatio::of(&means[..1], 1.0).is_none());
    }
}

//! Statistics: how even a point set is, how wrong an image is, and how sure one may be of either.
//!
//! Pure functions of numbers: no files, no clock, no global state, and the same bits on every machine (sums are
//! compensated and in a fixed order, transcendental functions come from crate `libm`).
//!
//! | question | module |
//! |---|---|
//! | mean, variance, intervals | [`moments`] |
//! | intervals of anything else, from replicates | [`bootstrap`] |
//! | speed and accuracy, ratios of both | [`mod@efficiency`] |
//! | how far is an image from its reference | [`image_error`], [`trimmed`] |
//! | how different do two pictures look | [`flip`] |
//! | do neighbouring pixels err together | [`error_spectrum`], by a transform of any length in [`fourier`] |
//! | how much does a pixel vary, from spectra | [`pixel_variance`] |
//! | how fast does the error fall | [`fit`] |
//! | does an estimator agree with the truth | [`trial`], and the tests it is made of: [`hypothesis`] |
//! | may a t test be believed | [`tails`] |
//! | how even is a point set | [`discrepancy`], [`spectrum`] |
//!
//! # Test your own estimator
//!
//! An estimator is a function of a seed. One line runs it over independent seeds and asks whether its expectation is the
//! value you know; the verdict says how often it may lie and what it would have caught.
//!
//! ```
//! use sampler_lab::stats::{Decision, Family, Trial};
//!
//! /// ∫ x² dx over [0, 1] by 64 points of a lattice, moved by a random offset: your estimator.
//! fn mean_of_squares(seed: u64) -> f64 {
//!     let offset = (seed >> 11) as f64 * 0.5f64.powi(53);
//!     (0..64).map(|i| (f64::from(i) / 64.0 + offset).fract().powi(2)).sum::<f64>() / 64.0
//! }
//!
//! // One test, which fails a right estimator once in a million times.
//! let trial = Trial::new(64, Family::one(1e-6));
//! trial.of(mean_of_squares).assert_mean(1.0 / 3.0);
//!
//! // Not a panic, but a verdict: an error of two per cent is found, and said.
//! let wrong = trial.of(|seed| 1.02 * mean_of_squares(seed)).against(1.0 / 3.0);
//! assert_eq!(wrong.decision(), Decision::Fails);
//! println!("{wrong}");
//! ```
//!
//! Two estimators: `a.assert_agrees_with(&b)` on different seeds. Rare yes-or-no outcomes: [`hypothesis::binomial_test`] and
//! [`hypothesis::fisher_test`], since Student's t is wrong there. "The same" as something shown rather than not refuted:
//! [`hypothesis::equivalence_test`]. Over random scenes with shrinking: `examples/test_your_estimator.rs`.

pub mod bootstrap;
pub mod discrepancy;
pub mod efficiency;
pub mod error_spectrum;
pub mod fit;
pub mod flip;
pub mod fourier;
pub mod hypothesis;
pub mod image_error;
pub mod median;
pub mod moments;
pub mod pixel_variance;
mod special;
pub mod spectrum;
pub mod tails;
pub mod trial;
pub mod trimmed;

pub use bootstrap::{Bootstrap, Ends, Resampled};
pub use discrepancy::{L2Kind, Points, PointsError, Side, Star};
pub use efficiency::{Pairing, Runs, efficiency, efficiency_ratio, mean_ratio, rmse_ratio};
pub use error_spectrum::ErrorSpectrum;
pub use fit::{IntervalKind, LACK_OF_FIT_LEVEL, LEAST_RESIDUAL, LineFit, SlopeFit, loglog_slope, slope_with_interval};
pub use hypothesis::{
    Claim, Family, Outcome, Verdict, binomial_test, chi2_test, equivalence_test, fisher_test, ks_test, t_test,
    t_test_of_squares, welch_test, z_test,
};
pub use image_error::Ensemble;
pub use median::median_interval;
pub use moments::{Estimate, Moments, jackknife, student_t_quantile, sum, t_interval, variance_interval};
pub use tails::Tails;
pub use trial::{Agreement, Decision, Replicates, Trial, assert_agree, assert_unbiased};

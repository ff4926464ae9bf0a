//! Statistics: how even a point set is, how wrong an image is, and how sure one may be of either.
//!
//! Pure functions of numbers: no files, no clock, no global state, and the same bits on every machine (sums are
//! compensated and in a fixed order, transcendental functions come from crate `libm`).
//!
//! | question | module |
//! |---|---|
//! | mean, variance, intervals | [`moments`] |
//! | how far is an image from its reference | [`image_error`], [`trimmed`] |
//! | how different do two pictures look | [`flip`] |
//! | do neighbouring pixels err together | [`error_spectrum`], by a transform of any length in [`fourier`] |
//! | how much does a pixel vary, from spectra | [`pixel_variance`] |
//! | how fast does the error fall | [`fit`] |
//! | does an estimator agree with the truth | [`hypothesis`] |
//! | how even is a point set | [`discrepancy`], [`spectrum`] |

pub mod discrepancy;
pub mod error_spectrum;
pub mod fit;
pub mod flip;
pub mod fourier;
pub mod hypothesis;
pub mod image_error;
pub mod moments;
pub mod pixel_variance;
mod special;
pub mod spectrum;
pub mod trimmed;

pub use discrepancy::{L2Kind, Points, PointsError, Side, Star};
pub use error_spectrum::ErrorSpectrum;
pub use fit::{IntervalKind, LACK_OF_FIT_LEVEL, LEAST_RESIDUAL, LineFit, SlopeFit, loglog_slope, slope_with_interval};
pub use hypothesis::{Family, Outcome, Verdict, chi2_test, t_test, z_test};
pub use image_error::Ensemble;
pub use moments::{Estimate, Moments, jackknife, student_t_quantile, sum, t_interval, variance_interval};

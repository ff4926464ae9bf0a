//! How far an image is from its reference, where the reference is an estimate too.
//!
//! Simple metrics take flat slices of pixel-channels (`image.pixels.as_flattened()`); what needs to know which
//! channels belong to one pixel takes `&[[f32; 3]]`. T is the test image, R the reference, R1 and R2 two
//! independent estimates of it, d = T − R, N the number of pixel-channels. All sums are compensated f64, of pixels
//! that are f32 (as images are) or f64.
//!
//! Nothing here skips or mends a pixel: a NaN in gives a NaN out. Count first with [`nonfinite`]. An image of no
//! pixels has no error (NaN), and slices of unequal length are a mistake of the program: they panic.

use serde::{Deserialize, Serialize};

use crate::mutants::{Mutant, planted};

use super::moments::{Estimate, Moments, jackknife, jackknife_variance, sum, two_sided_factor};

/// ε of the relative mean square error: keeps black pixels finite, in squared radiance.
pub const REL_MSE_EPSILON: f64 = 0.01;

/// Mean over pixel-channels of a function of test and reference.
fn mean2<P: Copy + Into<f64>>(t: &[P], r: &[P], f: impl Fn(f64, f64) -> f64) -> f64 {
    assert_eq!(t.len(), r.len(), "image and reference differ in size");
    sum(t.iter().zip(r).map(|(&t, &r)| f(t.into(), r.into()))) / t.len() as f64
}

/// How many pixel-channels are NaN or infinite.
pub fn nonfinite(image: &[f32]) -> usize {
    image.iter().filter(|v| !v.is_finite()).count()
}

/// Mean square error, mean d². With a noisy reference it is too large by the reference's own variance.
pub fn mse<P: Copy + Into<f64>>(t: &[P], r: &[P]) -> f64 {
    mean2(t, r, |t, r| (t - r) * (t - r))
}

/// Mean square error freed of reference noise: mean (T − R1)(T − R2), unbiased for independent R1 and R2.
///
/// It may be negative where the error is below the noise; it is not clipped. R1 = R2 gives [`mse`].
pub fn mse_unbiased<P: Copy + Into<f64>>(t: &[P], r1: &[P], r2: &[P]) -> f64 {
    assert!(t.len() == r1.len() && t.len() == r2.len(), "image and references differ in size");
    let products = t.iter().zip(r1).zip(r2).map(|((&t, &r1), &r2)| {
        let (t, r1, r2): (f64, f64, f64) = (t.into(), r1.into(), r2.into());
        (t - r1) * (t - if planted(Mutant::ReferenceNoiseKept) { r1 } else { r2 })
    });
    sum(products) / t.len() as f64
}

/// Relative mean square error, mean d²/(R² + ε) with ε = [`REL_MSE_EPSILON`].
///
/// Noise in R biases it through numerator and denominator; only an exact R makes it exact.
pub fn rel_mse<P: Copy + Into<f64>>(t: &[P], r: &[P]) -> f64 {
    mean2(t, r, |t, r| (t - r) * (t - r) / (r * r + REL_MSE_EPSILON))
}

/// Mean absolute error, mean |d|.
pub fn mae<P: Copy + Into<f64>>(t: &[P], r: &[P]) -> f64 {
    mean2(t, r, |t, r| (t - r).abs())
}

/// Symmetric mean absolute percentage error, mean |d|/(|T| + |R|): no factor 2, in [0, 1], and 0/0 is 0.
pub fn smape<P: Copy + Into<f64>>(t: &[P], r: &[P]) -> f64 {
    mean2(t, r, |t, r| if t == r { 0.0 } else { (t - r).abs() / (t.abs() + r.abs()) })
}

/// Mean signed error, mean d: the bias of the image's energy.
pub fn bias<P: Copy + Into<f64>>(t: &[P], r: &[P]) -> f64 {
    mean2(t, r, |t, r| t - r)
}

/// Largest absolute error, max |d|; NaN where any pixel-channel is.
pub fn max_abs<P: Copy + Into<f64>>(t: &[P], r: &[P]) -> f64 {
    assert_eq!(t.len(), r.len(), "image and reference differ in size");
    let larger = |a: f64, b: f64| if a.is_nan() || a > b { a } else { b };
    t.iter().zip(r).map(|(&t, &r)| (t.into() - r.into()).abs()).fold(0.0, larger)
}

/// Mean square error of the average of two independent reference halves, mean (R1 − R2)²/4: the reference's floor.
pub fn reference_noise<P: Copy + Into<f64>>(r1: &[P], r2: &[P]) -> f64 {
    mse(r1, r2) / 4.0
}

/// Correlation of the error between horizontally and vertically neighbouring pixels; 0 for independent pixels.
///
/// With e1 = T − R1 and e2 = T − R2 and the sums over all neighbour pairs (p, q) and channels,
/// ρ = Σ (e1(p) e2(q) + e2(p) e1(q)) / Σ (e1(p) e2(p) + e1(q) e2(q)). Each product takes its two factors from
/// independent references, so reference noise adds nothing on average, above or below; with R1 = R2 it is in [−1, 1].
///
/// The mean error is *not* subtracted. The question is whether neighbours err together; an error shared by all
/// pixels is the extreme case of that and has ρ = 1. Subtracting it would hide one pattern in every pixel, and would
/// leave −1/(pixels − 1) behind where there is nothing. `None` without neighbours or where the denominator
/// is not above zero (no error, or all of it below the reference's noise).
pub fn error_autocorrelation(
    t: &[[f32; 3]],
    r1: &[[f32; 3]],
    r2: &[[f32; 3]],
    width: usize,
    height: usize,
) -> Option<f64> {
    assert!(t.len() == width * height && r1.len() == t.len() && r2.len() == t.len(), "images differ in size");
    let right = (0..t.len()).filter(|p| p % width + 1 < width).map(|p| (p, p + 1));
    let below = (0..t.len()).filter(|p| p + width < t.len()).map(|p| (p, p + width));
    let pairs = || right.clone().chain(below.clone()).flat_map(|(p, q)| (0..3).map(move |c| (p, q, c)));
    let error = |r: &[[f32; 3]], p: usize, c: usize| f64::from(t[p][c]) - f64::from(r[p][c]);
    let across = sum(pairs().map(|(p, q, c)| error(r1, p, c) * error(r2, q, c) + error(r2, p, c) * error(r1, q, c)));
    let own = sum(pairs().map(|(p, q, c)| error(r1, p, c) * error(r2, p, c) + error(r1, q, c) * error(r2, q, c)));
    (own > 0.0).then(|| across / own)
}

/// Error of an estimator from independent replicate images and two references, each number with its interval.
///
/// See [`ensemble`] for the formulas.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ensemble {
    /// Mean square error, unbiased, so possibly negative; squared radiance.
    pub mse: Estimate,
    /// Its root, in radiance; `None` where the mean square error came out negative. A lower end below 0 reads 0.
    pub rmse: Option<Estimate>,
    /// Relative mean square error, dimensionless, with the mean of both references in the denominator.
    pub rel_mse: Estimate,
    /// Squared bias, mean over pixel-channels, unbiased, so possibly negative.
    pub bias2: Estimate,
    /// Variance between replicates, mean over pixel-channels; `None` for one replicate.
    pub variance: Option<Estimate>,
    /// Mean signed error: the bias of the image's energy.
    pub bias: Estimate,
}

/// Measures R ≥ 1 independent replicates T_r of one estimator against two independent references of equal noise.
///
/// An exact reference is passed twice (`r1` equal to `r2` in every bit): it adds no noise. With T̄ the mean image,
/// R̄ = (R1 + R2)/2, g = R1 − R2:
/// - MSE_r = mean (T_r − R1)(T_r − R2); `mse` is their mean. `rel_mse` divides each product by R̄² + ε, `bias` is the
///   mean of T_r − R̄. Replicates spread each by s²/R.
/// - `variance` = mean over pixel-channels of the replicates' unbiased variance.
/// - `bias2` = mean (T̄ − R1)(T̄ − R2) − `variance`/R. These two take a delete-1 jackknife (from R = 3 on).
///
/// *Reference noise.* R1 = μ + a and R2 = μ + b with a, b independent, alike and of mean zero err through
/// x_p = Σ_c [−d(a + b) + ab] in pixel p, d = T̄ − μ; its two parts are uncorrelated. Var x_p = 2 dᵀΣd + tr Σ²
/// with Σ the pixel's channel covariance. Now (Σ_c (T̄ − R̄) g)² has exactly that expectation if the noise is normal:
/// T̄ − R̄ = d − (a + b)/2 is independent of g, Var g = 2Σ, and so E = 2 dᵀΣd + ½ tr(2Σ·Σ). The second-order
/// term is in there already and must not be added again; heavier tails only enlarge it. Hence
/// se² = Σ_p (Σ_c (T̄ − R̄) g)²/N², pixels taken as independent. Note (T̄ − R̄) g = ((T̄ − R2)² − (T̄ − R1)²)/2: it is
/// what swapping the references would change. Noise in T̄
/// makes se² a little too wide, by tr(2Σ V)/R with V the replicates' covariance.
///
/// Both variances add; the interval is Student's with Welch–Satterthwaite degrees of freedom, where each pixel
/// brings one: ν = 3 (Σw)²/Σw² for squares w of normal numbers (E w² = 3 (E w)²).
///
/// One replicate: the interval holds reference noise alone, which is the whole truth only for an estimator
/// without randomness; with an exact reference there is no interval.
pub fn ensemble<P: Copy + Into<f64>>(replicates: &[&[[P; 3]]], r1: &[[P; 3]], r2: &[[P; 3]]) -> Ensemble {
    assert!(!replicates.is_empty(), "an ensemble needs a replicate");
    assert!(replicates.iter().all(|t| t.len() == r1.len()) && r1.len() == r2.len(), "images differ in size");
    let mean_image = mean_image(replicates);
    let noise = ReferenceNoise::of(&mean_image, r1, r2);
    let (r1, r2) = (r1.as_flattened(), r2.as_flattened());

    let over_replicates = |f: &dyn Fn(&[P]) -> f64, reference: Uncertainty| {
        let values: Moments = replicates.iter().map(|t| f(t.as_flattened())).collect();
        let spread = values.standard_error().map(|e| Uncertainty { variance: e * e, freedom: values.n() as f64 - 1.0 });
        estimate(values.mean().unwrap_or(f64::NAN), spread, reference)
    };
    let mse = over_replicates(&|t| mse_unbiased(t, r1, r2), noise.mse);
    let (bias2, variance) = bias2_and_variance(replicates, &mean_image, r1, r2, noise.mse);
    Ensemble {
        mse,
        rmse: root(mse),
        rel_mse: over_replicates(&|t| rel_mse_unbiased(t, r1, r2), noise.rel_mse),
        bias2,
        variance,
        bias: over_replicates(&|t| (bias(t, r1) + bias(t, r2)) / 2.0, noise.bias),
    }
}

/// mean (T − R1)(T − R2)/(R̄² + ε): the numerator is unbiased, the denominator keeps the noise of R̄.
fn rel_mse_unbiased<P: Copy + Into<f64>>(t: &[P], r1: &[P], r2: &[P]) -> f64 {
    let terms = t.iter().zip(r1).zip(r2).map(|((&t, &r1), &r2)| {
        let (t, r1, r2): (f64, f64, f64) = (t.into(), r1.into(), r2.into());
        (t - r1) * (t - r2) * relative_weight(r1, r2)
    });
    sum(terms) / t.len() as f64
}

/// 1/(R̄² + ε).
fn relative_weight(r1: f64, r2: f64) -> f64 {
    let mean = (r1 + r2) / 2.0;
    1.0 / (mean * mean + REL_MSE_EPSILON)
}

/// Pixel-channel means over the replicates.
fn mean_image<P: Copy + Into<f64>>(replicates: &[&[[P; 3]]]) -> Vec<[f64; 3]> {
    let mean = |p: usize, c: usize| sum(replicates.iter().map(|t| t[p][c].into())) / replicates.len() as f64;
    (0..replicates[0].len()).map(|p| std::array::from_fn(|c| mean(p, c))).collect()
}

/// Root of a mean square and of its interval's ends.
fn root(mse: Estimate) -> Option<Estimate> {
    let ends = mse.ci95.map(|ends| ends.map(|end| end.max(0.0).sqrt()));
    (mse.value >= 0.0).then(|| Estimate { value: mse.value.sqrt(), ci95: ends })
}

/// A variance of an estimate, and how many degrees of freedom it was itself estimated with.
#[derive(Debug, Clone, Copy)]
struct Uncertainty {
    variance: f64,
    freedom: f64,
}

impl Uncertainty {
    /// From one number a pixel, of mean zero, whose sum divided by `n` is the error.
    fn of_independent(pixel_terms: impl Iterator<Item = f64> + Clone, n: f64) -> Self {
        let squares = sum(pixel_terms.clone().map(|x| x * x));
        let fourths = sum(pixel_terms.map(|x| x * x * x * x));
        // Squares so small that their squares vanish say nothing about freedom: one degree is the cautious reading.
        let freedom = if fourths > 0.0 { (3.0 * squares * squares / fourths).max(1.0) } else { 1.0 };
        Self { variance: squares / n / n, freedom }
    }
}

/// Joins the spread of the replicates and the noise of the reference: variances add, freedom by Welch–Satterthwaite.
fn estimate(value: f64, spread: Option<Uncertainty>, reference: Uncertainty) -> Estimate {
    let parts: Vec<Uncertainty> = spread.into_iter().chain((reference.variance > 0.0).then_some(reference)).collect();
    let total: f64 = parts.iter().map(|u| u.variance).sum();
    if parts.is_empty() || total == 0.0 {
        return Estimate::symmetric(value, spread.map(|_| 0.0));
    }
    // In shares of the total, so that tiny variances do not underflow when squared.
    let freedom = 1.0 / parts.iter().map(|u| (u.variance / total) * (u.variance / total) / u.freedom).sum::<f64>();
    Estimate::symmetric(value, Some(total.sqrt() * two_sided_factor(0.95, freedom)))
}

/// What the noise of the references adds to the variance of each estimate.
struct ReferenceNoise {
    mse: Uncertainty,
    rel_mse: Uncertainty,
    bias: Uncertainty,
}

impl ReferenceNoise {
    fn of<P: Copy + Into<f64>>(mean: &[[f64; 3]], r1: &[[P; 3]], r2: &[[P; 3]]) -> Self {
        let n = 3.0 * mean.len() as f64;
        let over_channels = |f: fn(f64, f64, f64) -> f64| {
            let pixel =
                move |p: usize| -> f64 { (0..3).map(|c| f(mean[p][c], r1[p][c].into(), r2[p][c].into())).sum() };
            Uncertainty::of_independent((0..mean.len()).map(pixel), n)
        };
        Self {
            mse: over_channels(|t, r1, r2| (t - (r1 + r2) / 2.0) * (r1 - r2)),
            rel_mse: over_channels(|t, r1, r2| (t - (r1 + r2) / 2.0) * (r1 - r2) * relative_weight(r1, r2)),
            // R̄ − μ = (a + b)/2 has the variance of g/2 = (a − b)/2.
            bias: over_channels(|_, r1, r2| (r1 - r2) / 2.0),
        }
    }
}

/// Squared bias and variance, each with its jackknife interval.
///
/// Leaving replicate i out moves the mean image by −d_i/(R − 1), d_i = T_i − T̄, so two means a replicate suffice:
/// q_i = mean d_i² and p_i = mean d_i (e1 + e2) with e1 = T̄ − R1, e2 = T̄ − R2.
fn bias2_and_variance<P: Copy + Into<f64>>(
    replicates: &[&[[P; 3]]],
    mean: &[[f64; 3]],
    r1: &[P],
    r2: &[P],
    reference: Uncertainty,
) -> (Estimate, Option<Estimate>) {
    let mean = mean.as_flattened();
    let (n, count) = (mean.len() as f64, replicates.len() as f64);
    let error1 = |i: usize| mean[i] - r1[i].into();
    let error2 = |i: usize| mean[i] - r2[i].into();
    let products = sum((0..mean.len()).map(|i| error1(i) * error2(i))) / n;
    let means_of = |t: &&[[P; 3]]| {
        let deviation = |i: usize| t.as_flattened()[i].into() - mean[i];
        let q = sum((0..mean.len()).map(|i| deviation(i) * deviation(i))) / n;
        (q, sum((0..mean.len()).map(|i| deviation(i) * (error1(i) + error2(i)))) / n)
    };
    let means: Vec<(f64, f64)> = replicates.iter().map(means_of).collect();
    let squares = sum(means.iter().map(|&(q, _)| q));
    let variance_without = |out: Option<usize>| match out {
        None => squares / (count - 1.0),
        Some(i) => (squares - means[i].0 * count / (count - 1.0)) / (count - 2.0),
    };
    let bias2_without = |out: Option<usize>| match out {
        None => products - variance_without(None) / count,
        Some(i) => products + (means[i].0 / (count - 1.0) - means[i].1 - variance_without(out)) / (count - 1.0),
    };
    match replicates.len() {
        1 => (estimate(products, None, reference), None),
        // Leaving one of two out leaves no variance to compute.
        2 => {
            (Estimate::without_interval(bias2_without(None)), Some(Estimate::without_interval(variance_without(None))))
        }
        replicates => {
            let spread = |variance: f64| Some(Uncertainty { variance, freedom: count - 1.0 });
            let of_bias2 = spread(jackknife_variance(replicates, bias2_without));
            (estimate(bias2_without(None), of_bias2, reference), Some(jackknife(replicates, variance_without)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::Rng;

    /// Standard normal numbers by Box and Muller.
    struct Normal(Pcg64);

    impl Normal {
        fn new(seed: u128) -> Self {
            Self(Pcg64::new(seed, 1))
        }

        fn next(&mut self) -> f64 {
            let mut unit = || ((self.0.next_u64() >> 11) as f64 + 0.5) * (0.5f64).powi(53);
            let (u, v) = (unit(), unit());
            (-2.0 * libm::log(u)).sqrt() * libm::cos(std::f64::consts::TAU * v)
        }

        /// `base` plus noise of standard deviation `sigma`, half of its power shared by the channels of a pixel.
        fn noisy(&mut self, base: &[[f32; 3]], sigma: f64) -> Vec<[f32; 3]> {
            let mut pixel = |p: &[f32; 3]| {
                let shared = self.next();
                p.map(|v| v + (sigma * (shared + self.next()) / 2f64.sqrt()) as f32)
            };
            base.iter().map(&mut pixel).collect()
        }
    }

    fn waves(pixels: usize, phase: f32) -> Vec<[f32; 3]> {
        (0..pixels).map(|p| [0.0, 1.0, 2.0].map(|c| 0.5 + 0.3 * (p as f32 * 0.37 + c + phase).sin())).collect()
    }

    #[test]
    fn black_against_black_has_no_error_of_any_kind() {
        let black = [0.0; 6];
        for metric in [mse, rel_mse, mae, smape, bias, max_abs, reference_noise] {
            assert_eq!(metric(&black, &black), 0.0);
        }
        assert_eq!(smape(&[1.0], &[0.0]), 1.0);
        assert_eq!(rel_mse(&[1.0], &[0.0]), 100.0);
    }

    #[test]
    fn a_pixel_that_is_not_finite_is_counted_and_never_skipped() {
        let image = [1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0];
        assert_eq!(nonfinite(&image), 3);
        for metric in [mse, rel_mse, mae, smape, bias, max_abs] {
            assert!(metric(&[0.0, f32::NAN, 0.0], &[0.0; 3]).is_nan());
        }
    }

    #[test]
    fn noise_of_one_reference_adds_to_the_square_error_and_cancels_between_two() {
        let mut normal = Normal::new(1);
        let truth = waves(20_000, 0.0);
        let test = waves(20_000, 0.05);
        let (r1, r2) = (normal.noisy(&truth, 0.1), normal.noisy(&truth, 0.1));
        let flat = |x: &[[f32; 3]]| x.as_flattened().to_vec();
        let exact = mse(&flat(&test), &flat(&truth));
        let (naive, unbiased) = (mse(&flat(&test), &flat(&r1)), mse_unbiased(&flat(&test), &flat(&r1), &flat(&r2)));
        // Standard error of the mean of 20 000 products of size σ² = 0.01, channels sharing half: about 1e-4.
        assert!((naive - exact - 0.01).abs() < 6e-4 && (unbiased - exact).abs() < 6e-4, "{naive} {unbiased} {exact}");
        assert!((reference_noise(&flat(&r1), &flat(&r2)) - 0.005).abs() < 3e-4);
    }

    #[test]
    fn an_error_shared_by_all_pixels_correlates_fully_and_a_checkerboard_against_itself() {
        let truth = vec![[0.5; 3]; 12];
        let offset = vec![[0.75; 3]; 12];
        assert_eq!(error_autocorrelation(&offset, &truth, &truth, 4, 3), Some(1.0));
        let checks: Vec<_> = (0..12).map(|p| [if (p % 4 + p / 4) % 2 == 0 { 0.75 } else { 0.25 }; 3]).collect();
        assert_eq!(error_autocorrelation(&checks, &truth, &truth, 4, 3), Some(-1.0));
        assert_eq!(error_autocorrelation(&truth, &truth, &truth, 4, 3), None, "no error");
        assert_eq!(error_autocorrelation(&offset[..1], &truth[..1], &truth[..1], 1, 1), None, "no neighbours");
    }

    /// 9900 pairs of pixels, three channels sharing half their noise: the standard error is below 0.01; the bound is
    /// six of them on this one seed. False alarms: 2e-9.
    #[test]
    fn independent_errors_do_not_correlate_even_when_the_references_are_noisy() {
        let mut normal = Normal::new(2);
        let truth = vec![[0.5; 3]; 4900];
        let test = normal.noisy(&truth, 0.2);
        let (r1, r2) = (normal.noisy(&truth, 0.1), normal.noisy(&truth, 0.1));
        let rho = error_autocorrelation(&test, &r1, &r2, 70, 70).expect("errors above the noise");
        assert!(rho.abs() < 0.06, "{rho}");
    }

    /// The ensemble against its definitions, computed the slow way with every replicate really left out.
    #[test]
    fn the_ensemble_equals_its_definitions() {
        let mut normal = Normal::new(3);
        let truth = waves(40, 0.0);
        let images: Vec<_> = (0..5).map(|_| normal.noisy(&waves(40, 0.2), 0.3)).collect();
        let views: Vec<&[[f32; 3]]> = images.iter().map(Vec::as_slice).collect();
        let ours = ensemble(&views, &truth, &truth);

        let n = 120.0;
        let pixel = |r: usize, i: usize| f64::from(images[r].as_flattened()[i]);
        let moments = |i: usize, out: Option<usize>| -> Moments {
            (0..5).filter(|&r| Some(r) != out).map(|r| pixel(r, i)).collect()
        };
        let variance = |out| (0..120).filter_map(|i| moments(i, out).variance()).sum::<f64>() / n;
        let bias2 = |out: Option<usize>| {
            let kept = if out.is_some() { 4.0 } else { 5.0 };
            let square =
                |i: usize| (moments(i, out).mean().unwrap_or(0.0) - f64::from(truth.as_flattened()[i])).powi(2);
            (0..120).map(square).sum::<f64>() / n - variance(out) / kept
        };
        let close = |a: Estimate, b: Estimate| {
            let (ea, eb) = (a.ci95.expect("replicates"), b.ci95.expect("replicates"));
            assert!(
                (a.value - b.value).abs() < 1e-14 && (ea[0] - eb[0]).abs() < 1e-13 && (ea[1] - eb[1]).abs() < 1e-13
            );
        };
        close(ours.variance.expect("replicates"), jackknife(5, variance));
        close(ours.bias2, jackknife(5, bias2));
        let per_image: Vec<f64> = images.iter().map(|t| mse(t.as_flattened(), truth.as_flattened())).collect();
        close(ours.mse, super::super::moments::t_interval(&per_image, 0.95));
        // MSE = bias² + variance, exactly so for these unbiased estimates.
        assert!((ours.mse.value - ours.bias2.value - ours.variance.expect("replicates").value).abs() < 1e-14);
    }

    #[test]
    fn one_replicate_has_no_variance_and_no_interval_but_that_of_the_reference() {
        let (truth, test) = (waves(30, 0.0), waves(30, 0.1));
        let exact = ensemble(&[&test], &truth, &truth);
        assert_eq!((exact.variance, exact.mse.ci95, exact.bias2.ci95, exact.bias.ci95), (None, None, None, None));
        assert_eq!(exact.bias2.value, exact.mse.value);
        let mut normal = Normal::new(4);
        let noisy = ensemble(&[&test], &normal.noisy(&truth, 0.1), &normal.noisy(&truth, 0.1));
        assert!(noisy.variance.is_none() && noisy.mse.ci95.is_some() && noisy.bias.ci95.is_some());
        let two = ensemble(&[&test, &test], &truth, &truth);
        let [low, high] = two.mse.ci95.expect("two replicates");
        assert!(low == high && two.variance.is_some_and(|v| v.ci95.is_none() && v.value < 1e-30), "{two:?}");
    }

    #[test]
    fn a_negative_square_error_keeps_its_value_and_has_no_root() {
        let (r1, r2) = (vec![[0.0; 3]; 9], vec![[1.0; 3]; 9]);
        let between = ensemble(&[&[[0.5; 3]; 9]], &r1, &r2);
        assert!(between.mse.value < 0.0 && between.rmse.is_none());
        let above = root(Estimate { value: 4.0, ci95: Some([-1.0, 9.0]) });
        assert_eq!(above, Some(Estimate { value: 2.0, ci95: Some([0.0, 3.0]) }));
    }

    /// How often the 95 % intervals of MSE, bias² and energy bias hold the truth over `trials` fresh references.
    fn coverage(seed: u128, trials: usize, replicates: usize, offset: f32) -> [f64; 3] {
        let mut normal = Normal::new(seed);
        let truth = waves(300, 0.0);
        let mean = waves(300, offset);
        let bias2 = mse(mean.as_flattened(), truth.as_flattened());
        let sigma = if replicates > 1 { 0.1 } else { 0.0 };
        let energy = bias(mean.as_flattened(), truth.as_flattened());
        let targets = [bias2 + sigma * sigma, bias2, energy];
        let mut hits = [0; 3];
        for _ in 0..trials {
            let images: Vec<_> = (0..replicates).map(|_| normal.noisy(&mean, sigma)).collect();
            let views: Vec<&[[f32; 3]]> = images.iter().map(Vec::as_slice).collect();
            let (r1, r2) = (normal.noisy(&truth, 0.1), normal.noisy(&truth, 0.1));
            let found = ensemble(&views, &r1, &r2);
            for (k, estimate) in [found.mse, found.bias2, found.bias].iter().enumerate() {
                let [low, high] = estimate.ci95.expect("noise on both references");
                hits[k] += usize::from(low <= targets[k] && targets[k] <= high);
            }
        }
        hits.map(|h| h as f64 / trials as f64)
    }

    /// Of 4000 trials at a true 95 %, the share has a standard error of 0.0034; 0.93 and 0.97 are 5.8 of them away,
    /// each of two numbers is beyond with probability 1e-8. False alarms: 2e-8. The first pair of references sees a large error (first order of the noise
    /// rules), the second a tiny one (second order rules).
    #[test]
    fn the_interval_of_a_deterministic_image_covers_the_truth_at_its_stated_rate() {
        for offset in [0.5, 0.02] {
            for share in coverage(5, 4000, 1, offset) {
                assert!((0.93..=0.97).contains(&share), "offset {offset}: {share}");
            }
        }
    }

    /// As above with eight replicates; MSE and bias² may cover more, since the spread of the mean image enters the
    /// reference's part as well (documented), but never less.
    #[test]
    fn the_interval_over_replicates_covers_the_truth_at_its_stated_rate() {
        for offset in [0.5, 0.02] {
            let [mse, bias2, bias] = coverage(6, 2000, 8, offset);
            // 2000 trials: standard error 0.0049; 0.03 is six of them.
            assert!((0.92..=0.985).contains(&mse) && (0.92..=0.985).contains(&bias2), "{offset}: {mse} {bias2}");
            assert!((0.92..=0.98).contains(&bias), "{offset}: {bias}");
        }
    }
}

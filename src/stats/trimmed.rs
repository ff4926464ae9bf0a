//! Image errors without their few worst pixels: whether a number is the image's or a handful of fireflies'.

use super::image_error::REL_MSE_EPSILON;
use super::moments::sum;

/// How many pixels of an image are left out: 0.01 % of them, rounded up, so at least one.
pub fn trimmed_pixels(pixels: usize) -> usize {
    pixels.div_ceil(10_000)
}

/// Mean square error without the 0.01 % of pixels (at least one) whose squared error, summed over their channels, is
/// largest: Σ d² of the others / their number of pixel-channels. Squared radiance; `None` where no pixel is left.
///
/// It is biased low by design and no estimate of anything: its distance from the mean square error is what it tells.
pub fn mse_trimmed<P: Copy + Into<f64>>(t: &[[P; 3]], r: &[[P; 3]]) -> Option<f64> {
    trimmed_mean(t, r, |t, r| (t - r) * (t - r))
}

/// As [`mse_trimmed`] for the relative mean square error, d²/(R² + ε) with ε = [`REL_MSE_EPSILON`]; the pixels left out
/// are those where that is largest. Dimensionless.
pub fn rel_mse_trimmed<P: Copy + Into<f64>>(t: &[[P; 3]], r: &[[P; 3]]) -> Option<f64> {
    trimmed_mean(t, r, |t, r| (t - r) * (t - r) / (r * r + REL_MSE_EPSILON))
}

/// Mean over pixel-channels of all pixels but those of the largest sums of `f`; NaN where any sum is.
fn trimmed_mean<P: Copy + Into<f64>>(t: &[[P; 3]], r: &[[P; 3]], f: impl Fn(f64, f64) -> f64) -> Option<f64> {
    assert_eq!(t.len(), r.len(), "image and reference differ in size");
    let pixel = |(t, r): (&[P; 3], &[P; 3])| (0..3).map(|c| f(t[c].into(), r[c].into())).sum::<f64>();
    let terms: Vec<f64> = t.iter().zip(r).map(pixel).collect();
    let kept = terms.len().checked_sub(trimmed_pixels(terms.len())).filter(|&kept| kept > 0)?;
    if terms.iter().any(|term| term.is_nan()) {
        return Some(f64::NAN);
    }
    // The least of those left out; ties with it are kept by number, so that the sum runs in the pixels' own order.
    let (_, &mut threshold, _) = terms.clone().select_nth_unstable_by(kept, f64::total_cmp);
    let below = terms.iter().filter(|&&term| term < threshold);
    let ties = (kept - below.clone().count()) as f64;
    Some((sum(below.copied()) + ties * threshold) / (3 * kept) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::image_error::{mse, rel_mse};

    /// An image, its reference, and the squared errors' order known: pixel i errs by i/8.
    fn ramp(pixels: usize) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let reference: Vec<[f32; 3]> = (0..pixels).map(|i| [i as f32 % 7.0, 0.5, 2.0]).collect();
        let error = |(i, r): (usize, &[f32; 3])| [r[0] + i as f32 / 8.0, r[1], r[2] - i as f32 / 8.0];
        (reference.iter().enumerate().map(error).collect(), reference)
    }

    #[test]
    fn the_worst_pixels_are_left_out_and_no_others() {
        for (pixels, left_out) in [(2, 1), (500, 1), (10_000, 1), (10_001, 2), (25_000, 3)] {
            assert_eq!(trimmed_pixels(pixels), left_out);
            let (t, r) = ramp(pixels);
            let kept = pixels - left_out;
            let plain = mse(t[..kept].as_flattened(), r[..kept].as_flattened());
            let trimmed = mse_trimmed(&t, &r).unwrap();
            assert!((trimmed - plain).abs() <= 1e-13 * plain, "{pixels}: {trimmed} {plain}");
        }
    }

    #[test]
    fn the_relative_error_leaves_its_own_worst_pixel_out() {
        // The larger error stands where the reference is bright, and matters less there.
        let (t, r) = ([[1.0_f64; 3], [101.0; 3], [0.0; 3]], [[0.9; 3], [100.0; 3], [0.5; 3]]);
        let without = |out: usize| (0..3).filter(|&i| i != out).map(|i| (t[i], r[i])).unzip::<_, _, Vec<_>, Vec<_>>();
        let ((t2, r2), (t1, r1)) = (without(2), without(1));
        assert!((rel_mse_trimmed(&t, &r).unwrap() - rel_mse(t2.as_flattened(), r2.as_flattened())).abs() < 1e-15);
        assert!((mse_trimmed(&t, &r).unwrap() - mse(t1.as_flattened(), r1.as_flattened())).abs() < 1e-15);
    }

    #[test]
    fn ties_count_once_each_and_a_single_pixel_leaves_nothing() {
        let (t, r) = ([[0.5_f64; 3]; 5], [[0.0; 3]; 5]);
        assert_eq!(mse_trimmed(&t, &r), Some(0.25));
        assert_eq!(mse_trimmed(&t[..1], &r[..1]), None);
        assert_eq!(mse_trimmed::<f64>(&[], &[]), None);
        assert!(mse_trimmed(&[[f64::NAN; 3], [0.0; 3]], &r[..2]).unwrap().is_nan());
    }
}

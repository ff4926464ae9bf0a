//! From images to the numbers of a row.

use std::sync::{Arc, OnceLock};

use crate::error::{Error, Result};
use crate::film::Image;
use crate::stats::flip::{Flip, Seen};
use crate::stats::{Ensemble, Estimate, image_error, sum, t_interval};

use super::identity::pixel_hash;
use super::pixels::see;
use super::results::{ImageErrors, JUMP, TwinDifference};

/// What images are compared with: two independent halves, or a closed form given twice.
pub struct ReferenceImages {
    halves: [Arc<Image>; 2],
    /// Mean of the halves, rounded once to `f32`.
    mean: Vec<[f32; 3]>,
    /// What an eye makes of the mean, and at which exposure: a scene has one.
    seen: OnceLock<(f32, Seen)>,
}

impl ReferenceImages {
    /// Two halves of one size.
    pub fn new(halves: [Arc<Image>; 2]) -> Self {
        let half_sum = |(a, b): (&f32, &f32)| ((f64::from(*a) + f64::from(*b)) / 2.0) as f32;
        let [a, b] = &halves;
        let mean = std::iter::zip(&a.pixels, &b.pixels)
            .map(|(a, b)| [half_sum((&a[0], &b[0])), half_sum((&a[1], &b[1])), half_sum((&a[2], &b[2]))])
            .collect();
        Self { halves, mean, seen: OnceLock::new() }
    }

    /// Mean square error of the halves' mean: 0 for a closed form.
    pub fn noise_mse(&self) -> f64 {
        let [a, b] = self.flat();
        image_error::reference_noise(a, b)
    }

    /// Mean square error of an image, free of the reference's noise on average.
    pub fn mse_of(&self, image: &Image) -> f64 {
        let [a, b] = self.flat();
        image_error::mse_unbiased(image.pixels.as_flattened(), a, b)
    }

    /// Mean over all pixel-channels.
    pub fn mean_value(&self) -> f64 {
        mean_value(&self.mean)
    }

    /// Digest of the mean of the halves.
    pub fn pixels(&self) -> String {
        pixel_hash(&self.mean)
    }

    /// How different an image looks, both shown at this exposure.
    pub fn flip(&self, image: &Image, exposure: f32) -> Flip {
        let width = self.halves[0].width;
        let (seen_at, seen) = self.seen.get_or_init(|| (exposure, see(&self.mean, width, exposure)));
        assert_eq!(*seen_at, exposure, "a reference at two exposures");
        seen.flip(&see(&image.pixels, image.width, exposure))
    }

    /// The two.
    pub fn halves(&self) -> &[Arc<Image>; 2] {
        &self.halves
    }

    fn flat(&self) -> [&[f32]; 2] {
        self.halves.each_ref().map(|half| half.pixels.as_flattened())
    }
}

/// Mean over all pixel-channels.
pub fn mean_value(pixels: &[[f32; 3]]) -> f64 {
    let channels = pixels.as_flattened();
    sum(channels.iter().map(|&c| f64::from(c))) / channels.len() as f64
}

/// Errors of one image; `exposure` is that of its scene.
pub fn errors(
    image: &Image,
    reference: &ReferenceImages,
    reference_id: &str,
    metrics_algorithm: u32,
    exposure: f32,
) -> ImageErrors {
    let (flip, errors) =
        rayon::join(|| reference.flip(image, exposure), || sums(image, reference, reference_id, metrics_algorithm));
    ImageErrors { flip: Some(flip.mean), flip_weighted_median: Some(flip.weighted_median), ..errors }
}

/// All but FLIP.
fn sums(image: &Image, reference: &ReferenceImages, reference_id: &str, metrics_algorithm: u32) -> ImageErrors {
    let t = image.pixels.as_flattened();
    let r = reference.mean.as_flattened();
    let [r1, r2] = reference.flat();
    ImageErrors {
        reference_id: reference_id.to_owned(),
        metrics_algorithm,
        mse: image_error::mse(t, r),
        mse_unbiased: image_error::mse_unbiased(t, r1, r2),
        rel_mse: image_error::rel_mse(t, r),
        mae: image_error::mae(t, r),
        bias: image_error::bias(t, r),
        error_autocorrelation: autocorrelation(image, reference),
        flip: None,
        flip_weighted_median: None,
    }
}

/// What differs between an image and its twin.
pub fn difference(image: &Image, twin: &Image, twin_id: &str) -> TwinDifference {
    let bits = |pixel: &[f32; 3]| pixel.map(f32::to_bits);
    let differing = std::iter::zip(&image.pixels, &twin.pixels).filter(|(a, b)| bits(a) != bits(b)).count();
    let (a, b) = (image.pixels.as_flattened(), twin.pixels.as_flattened());
    let jump = JUMP * mean_value(&twin.pixels).abs();
    let jumps = |a: &[f32; 3], b: &[f32; 3]| (0..3).any(|c| (f64::from(a[c]) - f64::from(b[c])).abs() > jump);
    let jumping = std::iter::zip(&image.pixels, &twin.pixels).filter(|(a, b)| jumps(a, b)).count();
    TwinDifference {
        id: twin_id.to_owned(),
        differing: differing as f64 / image.pixels.len() as f64,
        jumping: jumping as f64 / image.pixels.len() as f64,
        largest: image_error::max_abs(a, b),
        rms: image_error::mse(a, b).sqrt(),
    }
}

/// Errors of all replicates together, intervals rounded as they are written.
pub fn ensemble(replicates: &[Arc<Image>], reference: &ReferenceImages) -> (Ensemble, Option<Estimate>) {
    let images: Vec<&[[f32; 3]]> = replicates.iter().map(|image| image.pixels.as_slice()).collect();
    let [r1, r2] = &reference.halves;
    // A mean over some replicates only would be another quantity: one that is not defined leaves none.
    let correlations = || replicates.iter().map(|image| autocorrelation(image, reference)).collect();
    let (e, correlations): (_, Option<Vec<f64>>) =
        rayon::join(|| image_error::ensemble(&images, &r1.pixels, &r2.pixels), correlations);
    let rounded = Ensemble {
        mse: e.mse.with_rounded_interval(),
        rmse: e.rmse.map(Estimate::with_rounded_interval),
        rel_mse: e.rel_mse.with_rounded_interval(),
        bias2: e.bias2.with_rounded_interval(),
        variance: e.variance.map(Estimate::with_rounded_interval),
        bias: e.bias.with_rounded_interval(),
    };
    (rounded, correlations.map(|values| t_interval(&values, 0.95).with_rounded_interval()))
}

/// Correlation of the error between neighbouring pixels.
fn autocorrelation(image: &Image, reference: &ReferenceImages) -> Option<f64> {
    let [r1, r2] = &reference.halves;
    let (width, height) = (image.width as usize, image.height as usize);
    image_error::error_autocorrelation(&image.pixels, &r1.pixels, &r2.pixels, width, height)
}

/// Every pixel of an image is a number.
///
/// # Errors
/// Kind `Incomplete` that names the first pixel that is not, and its channels.
pub fn check_finite(image: &Image, place: &str) -> Result<()> {
    let Some(at) = image.pixels.iter().position(|pixel| pixel.iter().any(|c| !c.is_finite())) else { return Ok(()) };
    let (x, y) = (at % image.width as usize, at / image.width as usize);
    let found = image.pixels[at];
    Err(Error::incomplete(place, format!("expected finite radiance, found {found:?} in pixel ({x}, {y})")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_closed_form_has_no_noise_and_both_mean_squares_agree() {
        let truth = Arc::new(Image { width: 2, height: 1, pixels: vec![[1.0, 2.0, 3.0], [0.0; 3]] });
        let reference = ReferenceImages::new([truth.clone(), truth]);
        assert_eq!(reference.noise_mse(), 0.0);
        assert_eq!(reference.mean_value(), 1.0);
        let image = Image { width: 2, height: 1, pixels: vec![[1.5, 2.0, 3.0], [0.0, -0.5, 0.0]] };
        let e = errors(&image, &reference, "r", 1, 3.0);
        // Two differences of ±1/2 among six channels.
        assert!((e.mse - 0.5 / 6.0).abs() < 1e-16 && e.mse == e.mse_unbiased && e.bias == 0.0, "{e:?}");
    }

    #[test]
    fn twins_differ_by_share_largest_and_root_mean_square() {
        let a = Image { width: 2, height: 1, pixels: vec![[1.0, 2.0, 3.0], [0.0; 3]] };
        let b = Image { width: 2, height: 1, pixels: vec![[1.0, 2.0, 3.0], [0.0, -1.5, 0.0]] };
        assert_eq!((difference(&a, &a, "a").differing, difference(&a, &a, "a").rms), (0.0, 0.0));
        let d = difference(&b, &a, "a");
        assert_eq!((d.id.as_str(), d.differing, d.largest, d.rms), ("a", 0.5, 1.5, (1.5f64 * 1.5 / 6.0).sqrt()));
        assert_eq!(d.jumping, 0.5);
        // The mean is 1, so a jump is more than 1e−4.
        let near = |off: f32| Image { width: 2, height: 1, pixels: vec![[1.0 + off, 2.0, 3.0], [0.0; 3]] };
        let jumping = |off: f32| difference(&near(off), &a, "a").jumping;
        assert_eq!((jumping(0.9e-4), jumping(1.1e-4)), (0.0, 0.5));
        let zeros = |zero: f32| Image { width: 1, height: 1, pixels: vec![[zero; 3]] };
        assert_eq!(difference(&zeros(0.0), &zeros(-0.0), "a").differing, 1.0, "bits, not values");
    }

    #[test]
    fn a_pixel_that_is_no_number_is_named() {
        let mut image = Image::black(3, 2);
        assert_eq!(check_finite(&image, "x"), Ok(()));
        image.pixels[5][1] = f32::INFINITY;
        let error = check_finite(&image, "x").unwrap_err();
        assert!(error.exit_code() == 4 && error.what.contains("pixel (2, 1)"), "{error}");
    }
}

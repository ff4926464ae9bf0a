//! What rows say of how pixels look and how their errors go together: FLIP and error spectra.

use std::sync::Arc;

use rayon::prelude::*;

use super::measure::ReferenceImages;
use crate::film::{Image, screen_light};
use crate::stats::error_spectrum::{ErrorSpectrum, Power, error_spectrum};
use crate::stats::flip::{DEFAULT_PPD, Seen};

/// What an eye makes of an image on the usual screen, shown as its PNG at this exposure.
pub fn see(pixels: &[[f32; 3]], width: u32, exposure: f32) -> Seen {
    let width = width as usize;
    Seen::new(width, pixels.len() / width, DEFAULT_PPD, |p| screen_light(pixels[p], exposure))
}

/// Error spectra of all replicates together.
pub fn spectrum(replicates: &[Arc<Image>], reference: &ReferenceImages) -> ErrorSpectrum {
    let [r1, r2] = reference.halves();
    let power = |image: &Arc<Image>| Power::of(&image.pixels, &r1.pixels, &r2.pixels, image.width as usize);
    error_spectrum(&replicates.par_iter().map(power).collect::<Vec<_>>())
}

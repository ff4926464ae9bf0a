//! How pictures are looked at, for FLIP.

use std::fmt;

use serde::Serialize;

use crate::error::{Error, Result};
use crate::film::{DEFAULT_EXPOSURE, Picture, screen_light};
use crate::stats::flip::{DEFAULT_PPD, PPD_RANGE, Seen};

/// A screen and how far it is: what FLIP needs to know besides the pictures.
///
/// Radiance is shown as `render` writes it into a PNG: exposed, by the framework's curve, sRGB, 8 bits; so the FLIP of two EXR files is
/// the FLIP of their PNG files. What is display values already (a PNG) is shown as it is, whatever the exposure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Viewing {
    /// Pixels of the screen in a degree of the field of view.
    pub pixels_per_degree: f64,
    /// Factor of radiance before the curve.
    pub exposure: f32,
}

impl Default for Viewing {
    fn default() -> Self {
        Self { pixels_per_degree: DEFAULT_PPD, exposure: DEFAULT_EXPOSURE }
    }
}

impl Viewing {
    /// Another screen, or exposure.
    ///
    /// # Errors
    /// Kind `Input` where there are fewer pixels a degree than 1 or more than 1000, or the exposure is not above 0 and finite.
    pub fn new(pixels_per_degree: f64, exposure: f32) -> Result<Self> {
        if !PPD_RANGE.contains(&pixels_per_degree) {
            let (low, high) = (PPD_RANGE.start(), PPD_RANGE.end());
            let what = format!("expected {low} to {high} pixels a degree, found {pixels_per_degree}");
            return Err(Error::input("--ppd", what));
        }
        if !(exposure > 0.0 && exposure.is_finite()) {
            return Err(Error::input("--exposure", format!("expected a finite number above 0, found {exposure}")));
        }
        Ok(Self { pixels_per_degree, exposure })
    }

    /// What an eye makes of a picture.
    pub fn see(self, picture: &Picture) -> Seen {
        let light = |p: usize| match picture.is_display {
            true => picture.pixels[p].map(|c| c.clamp(0.0, 1.0)),
            false => screen_light(picture.pixels[p].map(|c| c as f32), self.exposure),
        };
        Seen::new(picture.width as usize, picture.height as usize, self.pixels_per_degree, light)
    }
}

impl fmt::Display for Viewing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "flip: how different they look, 0 to 1, on a screen of {:.4} pixels a degree; radiance shown at exposure {}, as in a PNG.\n\
             It saturates, and is no estimate of a variance or a mean square error",
            self.pixels_per_degree, self.exposure
        )
    }
}

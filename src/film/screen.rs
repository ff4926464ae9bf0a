//! From radiance to what a screen shows: exposure, the framework's curve, sRGB, 8 bits.

use std::sync::LazyLock;

use super::Image;

/// Exposure of a scene file that states none.
pub const DEFAULT_EXPOSURE: f32 = 3.0;

/// Radiance times exposure that is white, and all above it.
const WHITE: f32 = 11.2;

/// The framework's filmic curve, before normalisation: H(x) = (x(Ax+CB)+DE)/(x(Ax+B)+DF) − E/F.
fn hable(x: f32) -> f32 {
    const A: f32 = 0.15;
    const B: f32 = 0.50;
    const C: f32 = 0.10;
    const D: f32 = 0.20;
    const E: f32 = 0.02;
    const F: f32 = 0.30;
    (x * (A * x + C * B) + D * E) / (x * (A * x + B) + D * F) - E / F
}

/// Linear in [0, 1] → sRGB in [0, 1] (IEC 61966-2-1).
pub fn srgb_encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::powf(linear, 1.0 / 2.4) - 0.055 }
}

/// sRGB in [0, 1] → linear in [0, 1] (IEC 61966-2-1).
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { libm::powf((encoded + 0.055) / 1.055, 2.4) }
}

/// One channel on its way to the screen: sRGB(clamp(H(exposure·c)/H(11.2), 0, 1)).
///
/// The curve rises from 0 to `WHITE` and has poles below 0, so it is asked within these ends alone: radiance below 0 is black,
/// and the largest that an `f32` holds is white.
pub fn tone_map(radiance: f32, exposure: f32) -> f32 {
    let exposed = (exposure * radiance).clamp(0.0, WHITE);
    srgb_encode((hable(exposed) / hable(WHITE)).clamp(0.0, 1.0))
}

/// Its code value of 8 bits, as in a PNG.
fn code_value(radiance: f32, exposure: f32) -> u8 {
    (tone_map(radiance, exposure) * 255.0 + 0.5) as u8
}

/// 8-bit RGB as shown on a screen, top row first.
pub fn to_screen(image: &Image, exposure: f32) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(image.pixels.len() * 3);
    for pixel in &image.pixels {
        bytes.extend(pixel.map(|c| code_value(c, exposure)));
    }
    bytes
}

/// The code values of one exposure, looked up: what a live picture can afford, with the codes of [`to_screen`].
///
/// The curve rises with radiance, so a code begins at a least radiance, found once by bisection over the floats above 0; a table
/// over the upper bits of a float says near which code to start.
pub struct ScreenTable {
    /// The bits of the least radiance of each code from 1 on; beyond every float where a code is never reached.
    starts: [u32; 256],
    /// For the upper 16 bits of a float of 0 or above: the code of its least value with those bits.
    codes: Vec<u8>,
}

impl ScreenTable {
    /// The table of an exposure of 0 or above.
    pub fn new(exposure: f32) -> Self {
        const INFINITE: u32 = f32::INFINITY.to_bits();
        let code = |bits: u32| code_value(f32::from_bits(bits), exposure);
        let mut starts = [u32::MAX; 256];
        let mut low = 0;
        for wanted in 0..=255u8 {
            let mut high = INFINITE;
            if code(high) < wanted || code(f32::MAX.to_bits()) < wanted {
                continue;
            }
            while low < high {
                let middle = low + (high - low) / 2;
                if code(middle) >= wanted { high = middle } else { low = middle + 1 }
            }
            starts[usize::from(wanted)] = low;
        }
        let mut at = 0u8;
        let codes = (0..=INFINITE >> 16).map(|upper| {
            while at < 255 && starts[usize::from(at) + 1] <= upper << 16 {
                at += 1;
            }
            at
        });
        Self { codes: codes.collect(), starts }
    }

    /// The code value of 8 bits of a radiance; below 0 it is black.
    #[inline]
    pub fn code(&self, radiance: f32) -> u8 {
        // Written so that what is no number is black.
        if radiance.is_nan() || radiance <= 0.0 {
            return self.codes[0];
        }
        let bits = radiance.to_bits();
        let mut code = self.codes[(bits >> 16) as usize];
        while code < 255 && self.starts[usize::from(code) + 1] <= bits {
            code += 1;
        }
        code
    }
}

/// The light that a screen emits for a pixel of the PNG at this exposure: linear sRGB in [0, 1], decoded from its 8 bits.
pub fn screen_light(radiance: [f32; 3], exposure: f32) -> [f64; 3] {
    static LIGHT: LazyLock<[f64; 256]> = LazyLock::new(|| {
        std::array::from_fn(|code| {
            let v = code as f64 / 255.0;
            if v <= 0.040_45 { v / 12.92 } else { libm::pow((v + 0.055) / 1.055, 2.4) }
        })
    });
    radiance.map(|c| LIGHT[usize::from(code_value(c, exposure))])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tone_curve_ends_are_black_and_white() {
        // H(0) is 0 but for rounding; half a code value is 1/510.
        assert!(tone_map(0.0, 3.0).abs() < 1e-6);
        assert_eq!(tone_map(11.2, 1.0), srgb_encode(1.0));
        assert!((srgb_encode(1.0) - 1.0).abs() < 1e-6);
        assert!((srgb_decode(srgb_encode(0.2)) - 0.2).abs() < 1e-6);
    }

    #[test]
    fn beyond_the_ends_of_the_curve_it_is_black_and_white_still() {
        // The poles are at −0.125 and −3.21; f32::MAX squared is no f32.
        for dark in [-0.125, -1.0, -3.21, -3.3, -1e30, f32::MIN] {
            assert_eq!(tone_map(dark, 1.0), tone_map(0.0, 1.0), "{dark}");
        }
        for bright in [11.3, 1e10, 1e20, f32::MAX, f32::INFINITY] {
            assert_eq!(code_value(bright, 3.0), 255, "{bright}");
        }
    }

    #[test]
    fn the_table_has_the_codes_of_the_curve() {
        for exposure in [0.0, 1e-6, 0.3, 1.0, 3.0, 17.5, 1e6, 1e30] {
            let table = ScreenTable::new(exposure);
            let mut bits = 0u32;
            // Every 9973rd float up to infinity, which visits each of the table's 32641 cells six times.
            while bits <= f32::INFINITY.to_bits() {
                let radiance = f32::from_bits(bits);
                if !(exposure * radiance).is_nan() {
                    assert_eq!(table.code(radiance), code_value(radiance, exposure), "{radiance} at {exposure}");
                }
                bits += 9973;
            }
            for odd in [-1.0, -0.0, f32::NAN, f32::MIN] {
                assert_eq!(table.code(odd), code_value(0.0, exposure), "{odd}");
            }
        }
    }

    #[test]
    fn a_screen_emits_what_its_code_values_mean() {
        let image = Image { width: 1, height: 1, pixels: vec![[0.0, 0.1, 100.0]] };
        let (codes, light) = (to_screen(&image, 2.0), screen_light(image.pixels[0], 2.0));
        assert_eq!((codes[0], codes[2], light[0], light[2]), (0, 255, 0.0, 1.0));
        let decoded = f64::from(srgb_decode(f32::from(codes[1]) / 255.0));
        assert!((light[1] - decoded).abs() < 1e-6, "{light:?}");
    }
}

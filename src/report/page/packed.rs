//! Pictures as text: half floats, predicted from their neighbours, deflated, in base64. The page's `packed.js` reads it back.

use miniz_oxide::deflate::compress_to_vec;

use crate::film::Image;

/// Largest finite half float.
const LARGEST: f32 = 65_504.0;

/// Level of the encoder, 0 to 10: level 9 takes several times as long for a thousandth.
const LEVEL: u8 = 6;

/// A picture whose channels are half floats: 11 bits of precision, a relative error of at most 2⁻¹¹ = 0.05 %.
#[derive(Debug, Clone, PartialEq)]
pub struct Halves {
    /// Columns.
    pub width: usize,
    /// Bits of the pixels, row by row from the top.
    pub pixels: Vec<[u16; 3]>,
    /// What a half has to be multiplied with: 1, or the power of two that makes the largest value fit.
    pub scale: f32,
}

/// The half float nearest to `x`, ties to even (IEEE 754 binary16); beyond the largest, 65 504, that, for a number that is not one 0.
pub fn to_half(x: f32) -> u16 {
    let sign = (x.to_bits() >> 16 & 0x8000) as u16;
    let size = x.abs();
    if size.is_nan() || size == 0.0 {
        return sign;
    }
    let size = size.min(LARGEST);
    // Below the smallest normal half, 2⁻¹⁴, steps are 2⁻²⁴; above, 2⁻¹⁰ of the power of two below. All products are exact.
    let exponent = (size.to_bits() >> 23) as i32 - 127;
    let steps = size * two_to(if exponent < -14 { 24 } else { 10 - exponent });
    let steps = steps.round_ties_even() as u32;
    // A mantissa that rounds up to 2 carries into the exponent by itself.
    sign | if exponent < -14 { steps } else { ((exponent + 14) as u32) * 1024 + steps } as u16
}

/// The number that a half float's bits stand for; exact.
pub fn from_half(bits: u16) -> f32 {
    let (exponent, mantissa) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    let size = match exponent {
        0 => mantissa * two_to(-24),
        _ => (1024.0 + mantissa) * two_to(exponent - 25),
    };
    if bits & 0x8000 != 0 { -size } else { size }
}

/// 2 to a power from −126 to 127.
fn two_to(power: i32) -> f32 {
    f32::from_bits(((power + 127) as u32) << 23)
}

impl Halves {
    /// The halves nearest to the pixels of `image`.
    pub fn of(image: &Image) -> Self {
        let largest = image.pixels.iter().flatten().fold(0.0_f32, |most, c| most.max(c.abs()));
        let mut scale = 1.0_f32;
        while largest / scale > LARGEST && scale < 1e30 {
            scale *= 2.0;
        }
        let pixels = image.pixels.iter().map(|p| p.map(|c| to_half(c / scale))).collect();
        Self { width: image.width as usize, pixels, scale }
    }

    /// Base64 of the deflated bytes: for each of the planes G, R − G, B − G of the bits (modulo 2¹⁶; a constant where a surface's
    /// colour is) what a value is beyond its neighbours' mean, all high bytes, then all low ones.
    pub fn packed(&self) -> String {
        let plane =
            |f: &dyn Fn(&[u16; 3]) -> u16| residuals(&self.pixels.iter().map(f).collect::<Vec<_>>(), self.width);
        let planes = [plane(&|p| p[1]), plane(&|p| p[0].wrapping_sub(p[1])), plane(&|p| p[2].wrapping_sub(p[1]))];
        let mut bytes = Vec::with_capacity(6 * self.pixels.len());
        for plane in planes {
            bytes.extend(plane.iter().map(|v| (v >> 8) as u8));
            bytes.extend(plane.iter().map(|v| *v as u8));
        }
        base64(&compress_to_vec(&bytes, LEVEL))
    }
}

/// What a plane's values are beyond the mean of the neighbours at the left and above (the one there is in the first row and column,
/// 0 for the first value), modulo 2¹⁶, small magnitudes of either sign as small numbers: 0, −1, 1, −2 … as 0, 1, 2, 3 …
fn residuals(plane: &[u16], width: usize) -> Vec<u16> {
    let residual = |at: usize| {
        let left = (!at.is_multiple_of(width)).then(|| plane[at - 1]);
        let above = (at >= width).then(|| plane[at - width]);
        let expected = match (left, above) {
            // The mean along the shorter way round, as differences are modulo 2¹⁶.
            (Some(left), Some(above)) => left.wrapping_add(((above.wrapping_sub(left) as i16) >> 1) as u16),
            (one, other) => one.or(other).unwrap_or(0),
        };
        let beyond = plane[at].wrapping_sub(expected) as i16;
        (beyond << 1 ^ beyond >> 15) as u16
    };
    (0..plane.len()).map(residual).collect()
}

/// Shares from 0 to 1 in 255 steps, predicted, deflated and in base64, two bytes each like a plane of [`Halves`].
pub fn packed_shares(shares: &[f64], width: usize) -> String {
    let plane: Vec<u16> = shares.iter().map(|share| (share.clamp(0.0, 1.0) * 255.0).round() as u16).collect();
    let plane = residuals(&plane, width);
    let bytes: Vec<u8> = plane.iter().map(|v| (v >> 8) as u8).chain(plane.iter().map(|v| *v as u8)).collect();
    base64(&compress_to_vec(&bytes, LEVEL))
}

/// Base64 with padding (RFC 4648, section 4).
pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let bits = (0..3).fold(0, |bits, i| bits << 8 | u32::from(three.get(i).copied().unwrap_or(0)));
        for i in 0..4 {
            let digit = char::from(DIGITS[(bits >> (18 - 6 * i) & 63) as usize]);
            text.push(if i > three.len() { '=' } else { digit });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use miniz_oxide::inflate::decompress_to_vec;

    fn bytes_of(text: &str) -> Vec<u8> {
        let digit = |c: u8| match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' => 62,
            _ => 63,
        };
        let digits: Vec<u32> = text.bytes().filter(|&c| c != b'=').map(|c| u32::from(digit(c))).collect();
        let mut bytes = Vec::new();
        for four in digits.chunks(4) {
            let bits = (0..4).fold(0, |bits, i| bits << 6 | four.get(i).copied().unwrap_or(0));
            bytes.extend_from_slice(&bits.to_be_bytes()[1..four.len()]);
        }
        bytes
    }

    /// As `packed.js` reads a plane.
    fn plane_of(residuals: &[u16], width: usize) -> Vec<u16> {
        let mut plane: Vec<u16> = Vec::new();
        for (at, &code) in residuals.iter().enumerate() {
            let beyond = code >> 1 ^ (code & 1).wrapping_neg();
            let expected = match (at % width > 0, at >= width) {
                (true, true) => {
                    let (left, above) = (plane[at - 1], plane[at - width]);
                    left.wrapping_add(((above.wrapping_sub(left) as i16) >> 1) as u16)
                }
                (true, false) => plane[at - 1],
                (false, true) => plane[at - width],
                (false, false) => 0,
            };
            plane.push(expected.wrapping_add(beyond));
        }
        plane
    }

    #[test]
    fn every_half_reads_back_to_itself_and_each_float_becomes_the_nearest_one() {
        for bits in (0..=0xffff_u16).filter(|bits| bits >> 10 & 31 != 31) {
            assert_eq!(to_half(from_half(bits)), bits, "{bits:#x}");
        }
        for bits in 0..0x7bff_u16 {
            let (low, high) = (from_half(bits), from_half(bits + 1));
            let middle = low + (high - low) / 2.0;
            assert_eq!(to_half(middle), if bits % 2 == 0 { bits } else { bits + 1 }, "a tie goes to the even one");
            assert_eq!(to_half(f32::from_bits(middle.to_bits() - 1)), bits);
            assert_eq!(to_half(f32::from_bits(middle.to_bits() + 1)), bits + 1);
        }
        assert_eq!([0.0, -0.0, f32::NAN, 1.0, 1e9, f32::INFINITY].map(to_half), [0, 0x8000, 0, 0x3c00, 0x7bff, 0x7bff]);
    }

    #[test]
    fn a_packed_picture_reads_back_bit_for_bit() {
        let value = |i: u32| f32::from_bits(i.wrapping_mul(2_654_435_761) >> 4 & 0x3fff_ffff);
        let pixels: Vec<[f32; 3]> = (0..35).map(|i| [value(3 * i), value(3 * i + 1), value(3 * i + 2)]).collect();
        let halves = Halves::of(&Image { width: 7, height: 5, pixels });
        let bytes = decompress_to_vec(&bytes_of(&halves.packed())).unwrap();
        assert_eq!(bytes.len(), 6 * 35);
        let plane = |i: usize| {
            let (high, low) = bytes[70 * i..70 * (i + 1)].split_at(35);
            plane_of(&std::iter::zip(high, low).map(|(&h, &l)| u16::from(h) << 8 | u16::from(l)).collect::<Vec<_>>(), 7)
        };
        let [green, red, blue] = [plane(0), plane(1), plane(2)];
        let pixel = |i: usize| [red[i].wrapping_add(green[i]), green[i], blue[i].wrapping_add(green[i])];
        assert_eq!((0..35).map(pixel).collect::<Vec<_>>(), halves.pixels);
        let shares = [0.0, 0.5, 1.0, 7.0, 0.001, 0.999];
        let bytes = decompress_to_vec(&bytes_of(&packed_shares(&shares, 3))).unwrap();
        let codes: Vec<u16> = (0..6).map(|i| u16::from(bytes[i]) << 8 | u16::from(bytes[6 + i])).collect();
        assert_eq!(plane_of(&codes, 3), [0, 128, 255, 255, 0, 255]);
    }

    #[test]
    fn a_picture_too_bright_for_halves_is_scaled_by_a_power_of_two() {
        let halves = Halves::of(&Image { width: 1, height: 2, pixels: vec![[1e6, 1.0, 0.0], [0.5; 3]] });
        assert_eq!(halves.scale, 16.0);
        assert_eq!(from_half(halves.pixels[0][1]) * halves.scale, 1.0);
        assert!((from_half(halves.pixels[0][0]) * halves.scale / 1e6 - 1.0).abs() < 1.0 / 2048.0);
    }

    #[test]
    fn base64_has_its_published_test_vectors() {
        for (bytes, text) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }
}

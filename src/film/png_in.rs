//! PNG files as linear values: what a screen would show, for want of radiance.

use std::io::{BufRead, Seek, SeekFrom};
use std::ops::RangeInclusive;

use image::codecs::png::PngDecoder;
use image::{ColorType, ImageDecoder, Limits};

use super::picture::{About, MAX_PIXELS, Picture};
use crate::error::Result;

/// The `gAMA` that stands for the sRGB curve: 1/2.2 in the format's unit of 1/100000.
const SRGB_GAMMA: u32 = 45_455;

/// Values of `gAMA` that stand for a curve, exponents of 1/100 to 100: the format has no meaning for 0, and beyond these nearly
/// every code value would be black or white.
const GAMMAS: RangeInclusive<u32> = 1_000..=10_000_000;

/// Longest chunk before the pixels, 16 MiB: profiles and texts are far shorter.
const LONGEST_CHUNK: u32 = 1 << 24;

/// Reads the image; see [`read_picture`](super::read_picture).
pub(super) fn read(mut reader: impl BufRead + Seek, about: &About) -> Result<Picture> {
    let space = ColourSpace::read(&mut reader, about)?;
    let bad = |e: image::ImageError| about.bad(format!("expected a whole PNG image, found: {e}"));
    let mut limits = Limits::no_limits();
    // Four channels of 16 bits, and as much again for the decoder's own rows and the file's texts.
    limits.max_alloc = Some(MAX_PIXELS * 16);
    let decoder = PngDecoder::with_limits(reader, limits).map_err(bad)?;
    let (width, height) = decoder.dimensions();
    about.checked_size(width.into(), height.into())?;
    let kind = decoder.color_type();
    let mut bytes = vec![0; decoder.total_bytes() as usize];
    decoder.read_image(&mut bytes).map_err(bad)?;

    let bits = 8 * usize::from(kind.bytes_per_pixel() / kind.channel_count());
    let curve = space.curve(about)?;
    let linear: Vec<f64> = (0..1_u32 << bits).map(|code| curve.decode(code, bits)).collect();
    let (pixels, is_opaque) = if bits == 8 {
        colours(&bytes, kind, &linear)
    } else {
        let wide: Vec<u16> = bytes.as_chunks().0.iter().map(|&b| u16::from_ne_bytes(b)).collect();
        colours(&wide, kind, &linear)
    };
    let mut notes = vec![format!("PNG: display values, not radiance; decoded to linear {curve}")];
    if space.has_profile {
        notes.push("PNG: its colour profile is not applied".to_owned());
    }
    if !is_opaque {
        notes.push("PNG: its alpha is not applied, though some pixels are transparent".to_owned());
    }
    Ok(Picture { width, height, pixels, corner: None, is_display: true, provenance: Vec::new(), notes })
}

/// What the chunks before the pixels say of the values' meaning; the decoder at hand does not tell.
struct ColourSpace {
    /// In units of 1/100000.
    gamma: Option<u32>,
    /// An sRGB chunk, which goes before `gAMA`.
    is_srgb: bool,
    /// An ICC profile or a cICP code, which go before all others.
    has_profile: bool,
}

impl ColourSpace {
    /// Reads the chunks up to the first of pixels, with their checksums, and goes back to the file's start.
    fn read(reader: &mut (impl BufRead + Seek), about: &About) -> Result<Self> {
        let torn = |e: std::io::Error| about.bad(format!("expected a whole PNG image, found: {e}"));
        let mut space = Self { gamma: None, is_srgb: false, has_profile: false };
        reader.seek(SeekFrom::Start(8)).map_err(torn)?;
        loop {
            let mut head = [0; 8];
            reader.read_exact(&mut head).map_err(torn)?;
            let [length, kind] = [0, 4].map(|at| [head[at], head[at + 1], head[at + 2], head[at + 3]]);
            let length = u32::from_be_bytes(length);
            if kind == *b"IDAT" {
                reader.rewind().map_err(torn)?;
                return Ok(space);
            }
            let name = kind.escape_ascii();
            if length > LONGEST_CHUNK {
                let what = format!("expected chunks of at most {LONGEST_CHUNK} bytes, found {name} of {length}");
                return Err(about.bad(what));
            }
            let mut chunk = kind.to_vec();
            let (mut body, mut sum) = (vec![0; length as usize], [0; 4]);
            reader.read_exact(&mut body).and_then(|()| reader.read_exact(&mut sum)).map_err(torn)?;
            chunk.extend(&body);
            if crc32(&chunk) != u32::from_be_bytes(sum) {
                return Err(
                    about.bad(format!("expected a whole PNG image, found a chunk {name} with a wrong checksum"))
                );
            }
            match (&kind, body.as_slice()) {
                (b"gAMA", &[a, b, c, d]) => space.gamma = Some(u32::from_be_bytes([a, b, c, d])),
                (b"sRGB", _) => space.is_srgb = true,
                (b"iCCP" | b"cICP", _) => space.has_profile = true,
                _ => {}
            }
        }
    }

    /// How values are decoded.
    fn curve(&self, about: &About) -> Result<Curve> {
        match self.gamma.filter(|_| !self.is_srgb && !self.has_profile) {
            Some(gamma) if !GAMMAS.contains(&gamma) => {
                let [least, most] = [GAMMAS.start(), GAMMAS.end()];
                Err(about.bad(format!("expected a gAMA of {least} to {most} (in 1/100000), found {gamma}")))
            }
            Some(gamma) if gamma.abs_diff(SRGB_GAMMA) > 10 => Ok(Curve::Power(100_000.0 / f64::from(gamma))),
            _ => Ok(Curve::Srgb),
        }
    }
}

/// The format's checksum, CRC-32 with the polynomial 0xEDB88320 (PNG 1.2, annex D).
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| if crc & 1 == 1 { 0xedb8_8320 ^ (crc >> 1) } else { crc >> 1 };
    !bytes.iter().fold(!0, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), step))
}

/// From code values to linear ones.
enum Curve {
    Srgb,
    Power(f64),
}

impl Curve {
    /// `code` of 0 to 2^`bits` − 1 → [0, 1].
    fn decode(&self, code: u32, bits: usize) -> f64 {
        let encoded = f64::from(code) / f64::from((1_u32 << bits) - 1);
        match *self {
            Self::Srgb if encoded <= 0.040_45 => encoded / 12.92,
            Self::Srgb => libm::pow((encoded + 0.055) / 1.055, 2.4),
            Self::Power(exponent) => libm::pow(encoded, exponent),
        }
    }
}

impl std::fmt::Display for Curve {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Srgb => write!(f, "from sRGB"),
            Self::Power(exponent) => write!(f, "by the exponent {exponent:.4} of its gAMA"),
        }
    }
}

/// Linear colours of code values, and whether no pixel is transparent; grey goes to all three channels.
fn colours<C: Copy + Into<u32>>(codes: &[C], kind: ColorType, linear: &[f64]) -> (Vec<[f64; 3]>, bool) {
    let channels = usize::from(kind.channel_count());
    let value = |code: C| linear[code.into() as usize];
    let colour = |codes: &[C]| match channels {
        1 | 2 => [value(codes[0]); 3],
        _ => [value(codes[0]), value(codes[1]), value(codes[2])],
    };
    let is_opaque = |codes: &[C]| channels % 2 == 1 || codes[channels - 1].into() as usize == linear.len() - 1;
    let pixels = codes.chunks_exact(channels);
    (pixels.clone().map(colour).collect(), pixels.clone().all(is_opaque))
}

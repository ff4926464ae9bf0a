//! Portable float maps: `PF` or `Pf`, width, height, scale, then 32-bit floats, rows from the bottom up.
//!
//! The scale's sign is the byte order (negative: little endian), its magnitude a factor of all values, as pbrt reads it.

use std::io::BufRead;
use std::path::Path;

use super::picture::{About, Picture, black_pixels};
use super::{Image, write_whole};
use crate::error::Result;

/// Longest word of a header, in bytes.
const LONGEST_WORD: usize = 64;

/// Reads the image; see [`read_picture`](super::read_picture).
pub(super) fn read(mut reader: impl BufRead, about: &About) -> Result<Picture> {
    let header = Header::read(&mut reader, about)?;
    let (width, height) = about.checked_size(header.width, header.height)?;
    let (w, h) = (width as usize, height as usize);
    let row_bytes = w * header.channels * 4;
    let (expected, found) = ((row_bytes * h) as u64, about.length.saturating_sub(header.bytes));
    if expected != found {
        let what = format!("expected {expected} bytes for {width}×{height} pixels after the header, found {found}");
        return Err(about.bad(what));
    }
    let mut pixels = black_pixels(about, w * h)?;
    let mut bytes = vec![0; row_bytes];
    for row in pixels.chunks_exact_mut(w).rev() {
        reader
            .read_exact(&mut bytes)
            .map_err(|e| about.bad(format!("expected {expected} bytes of pixels, found: {e}")))?;
        let mut samples = bytes.as_chunks().0.iter().map(|&sample| {
            let sample = if header.is_little_endian { f32::from_le_bytes(sample) } else { f32::from_be_bytes(sample) };
            f64::from(sample) * header.factor
        });
        for pixel in row {
            let mut next = || samples.next().expect("a row has as many samples as its pixels");
            *pixel = if header.channels == 3 { [next(), next(), next()] } else { [next(); 3] };
        }
    }
    check_range(&pixels, header.factor, about)?;
    let notes = match header.factor {
        1.0 => Vec::new(),
        factor => vec![format!("PFM: all values are multiplied by the scale {factor} of its header")],
    };
    Ok(Picture { width, height, pixels, corner: None, is_display: false, provenance: Vec::new(), notes })
}

/// Refuses a scale that makes finite samples too large for 32 bits: their squares, and what is computed of those, would leave `f64`.
fn check_range(pixels: &[[f64; 3]], factor: f64, about: &About) -> Result<()> {
    let largest = f64::from(f32::MAX);
    match pixels.as_flattened().iter().find(|c| c.is_finite() && c.abs() > largest) {
        Some(value) => {
            let what = format!("expected values of at most {largest:e}, found {value:e} after its scale {factor:e}");
            Err(about.bad(what))
        }
        None => Ok(()),
    }
}

/// The text before the pixels.
struct Header {
    channels: usize,
    width: u64,
    height: u64,
    is_little_endian: bool,
    /// Above 0, a normal number of 32 bits when rounded.
    factor: f64,
    /// Length of the header.
    bytes: u64,
}

impl Header {
    fn read(reader: &mut impl BufRead, about: &About) -> Result<Self> {
        let mut bytes = 0;
        let mut word = |what: &str| -> Result<String> {
            let mut word = Vec::new();
            loop {
                let mut byte = [0];
                reader
                    .read_exact(&mut byte)
                    .map_err(|e| about.bad(format!("expected a PFM header with {what}, found: {e}")))?;
                bytes += 1;
                match byte[0] {
                    space if space.is_ascii_whitespace() && word.is_empty() => {}
                    space if space.is_ascii_whitespace() => break,
                    letter => word.push(letter),
                }
                if word.len() > LONGEST_WORD {
                    return Err(about.bad(format!("expected a PFM header with {what}, found a word without an end")));
                }
            }
            Ok(String::from_utf8_lossy(&word).into_owned())
        };
        let channels = if word("PF or Pf")? == "PF" { 3 } else { 1 };
        let mut side = |what: &str| {
            let text = word(what)?;
            text.parse::<u64>().map_err(|_| about.bad(format!("expected {what} in its header, found \"{text}\"")))
        };
        let (width, height) = (side("a width")?, side("a height")?);
        let text = word("a scale")?;
        let scale = text.parse::<f64>().ok().filter(|scale| (*scale as f32).is_normal());
        let scale = scale.ok_or_else(|| {
            let what = "expected a scale other than 0 that a 32-bit number holds in its header";
            about.bad(format!("{what}, found \"{text}\""))
        })?;
        Ok(Self { channels, width, height, is_little_endian: scale < 0.0, factor: scale.abs(), bytes })
    }
}

/// Writes `PF` in little endian with scale 1.
///
/// # Errors
/// Kind `Write` where the file cannot be written.
pub fn write_pfm(path: &Path, image: &Image) -> Result<()> {
    let mut bytes = format!("PF\n{} {}\n-1.0\n", image.width, image.height).into_bytes();
    for row in image.pixels.chunks(image.width.max(1) as usize).rev() {
        bytes.extend(row.as_flattened().iter().flat_map(|c| c.to_le_bytes()));
    }
    write_whole(path, &bytes)
}

//! Images of any renderer, in f64: OpenEXR, PFM or PNG by what the bytes say, refused where they cannot be trusted.

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use super::{Image, exr_in, pfm, png_in};
use crate::error::{Error, Result};

/// Most pixels an image may claim, 2²⁶ (8192 × 8192): more is refused before memory is asked for.
pub const MAX_PIXELS: u64 = 1 << 26;

/// Bytes of memory of one pixel of a [`Picture`].
pub const PICTURE_PIXEL_BYTES: u64 = 24;

/// A linear image as it was read, every pixel finite.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Linear R, G, B: `pixels[y * width + x]`, top row first.
    pub pixels: Vec<[f64; 3]>,
    /// Where the pixels' corner lies in the whole image, where the file says so: OpenEXR's data in its display window.
    pub corner: Option<(i64, i64)>,
    /// Whether the file held display values, as a PNG does: the pixels are the light of a screen, 0 to 1, and no radiance.
    pub is_display: bool,
    /// The `sampler_lab.*` attributes of an OpenEXR file of ours, sorted; empty otherwise.
    pub provenance: Vec<(String, String)>,
    /// What its user should know: what was decoded, dropped or applied.
    pub notes: Vec<String>,
}

impl Picture {
    /// What the file says of its making under `name`.
    pub fn says(&self, name: &str) -> Option<&str> {
        self.provenance.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str())
    }

    /// The picture in `f32`, each channel rounded once.
    pub fn to_image(&self) -> Image {
        let pixels = self.pixels.iter().map(|pixel| pixel.map(|c| c as f32)).collect();
        Image { width: self.width, height: self.height, pixels }
    }
}

/// Reads an image: OpenEXR, PFM or PNG by its first bytes, whatever its name ends in.
///
/// - *OpenEXR*: half, float and unsigned channels `R G B`, of a layer `layer.R layer.G layer.B` too, or luminance `Y` alone
///   (taken for all three); scan lines or tiles, of several resolutions the largest; every compression but HTJ2K and
///   ZSTD; data windows anywhere. Not deep data, not subsampled channels. `layer` names the one to read, where the only one has a name too; without it
///   the unnamed `R G B` are read, and a file where that is not one is refused with their names.
/// - *PFM*: `PF` and `Pf` (grey), either byte order; values are multiplied by the scale's magnitude and have to stay within what `f32` holds.
/// - *PNG*: 8 and 16 bits a channel (fewer are widened), grey, colour or palette, decoded from sRGB (IEC 61966-2-1) to linear, or by the
///   file's `gAMA` where that is another curve; alpha and colour profiles are not applied. Notes say so.
///
/// Primaries are not converted.
///
/// # Errors
/// Kind `Input` where the file is missing, torn, of another format, larger than [`MAX_PIXELS`], or has a pixel that is not
/// finite (the count and the first one's place are named).
pub fn read_picture(path: &Path, layer: Option<&str>) -> Result<Picture> {
    let place = path.display();
    let open = || -> std::io::Result<(File, u64, [u8; 8])> {
        let mut file = File::open(path)?;
        let about = file.metadata()?;
        if !about.is_file() {
            return Err(std::io::Error::other("no regular file"));
        }
        let mut start = Vec::new();
        file.by_ref().take(8).read_to_end(&mut start)?;
        file.rewind()?;
        start.resize(8, 0);
        Ok((file, about.len(), start.try_into().expect("eight bytes were kept")))
    };
    let (file, length, start) =
        open().map_err(|e| Error::input(&place, format!("expected an OpenEXR, PFM or PNG image, found: {e}")))?;
    let about = About { name: place.to_string(), length };
    let reader = BufReader::new(file);
    let decode = || match Format::of(&start) {
        Format::Exr => exr_in::read(reader, &about, layer),
        Format::Pfm => pfm::read(reader, &about),
        Format::Png => png_in::read(reader, &about),
        Format::Other(what) => Err(about.bad(format!("expected an OpenEXR, PFM or PNG image, found {what}"))),
    };
    // The decoders are other people's and assert what a broken file can break; nothing of theirs outlives the closure.
    let picture = catch_unwind(AssertUnwindSafe(decode))
        .unwrap_or_else(|_| Err(about.bad("expected a whole image, found one that its decoder gave up on")))?;
    check_finite(&picture, &about)?;
    Ok(picture)
}

/// What messages say of a file.
pub(super) struct About {
    /// Its name in messages.
    pub name: String,
    /// Its length in bytes.
    pub length: u64,
}

impl About {
    /// An error about this file.
    pub fn bad(&self, what: impl std::fmt::Display) -> Error {
        Error::input(&self.name, what)
    }

    /// The size in pixels, if it is one that may be read.
    pub fn checked_size(&self, width: u64, height: u64) -> Result<(u32, u32)> {
        match width.checked_mul(height) {
            Some(0) => Err(self.bad(format!("expected at least one pixel, found {width}×{height}"))),
            // A side may still be longer than a number of 32 bits only where the other is 0.
            Some(1..=MAX_PIXELS) => Ok((width as u32, height as u32)),
            _ => Err(self.bad(format!("expected at most {MAX_PIXELS} pixels, found {width}×{height}"))),
        }
    }
}

/// `pixels` black ones, or an error where there is no memory for them.
///
/// Zeroed memory is committed as it is written to, so a claim without data costs nothing; but asking for it in vain ends the
/// program, so it is asked for first in the way that may fail.
pub(super) fn black_pixels(about: &About, pixels: usize) -> Result<Vec<[f64; 3]>> {
    let asked = Vec::<[f64; 3]>::new().try_reserve_exact(pixels);
    asked.map_err(|_| about.bad(format!("expected memory for {pixels} pixels of 24 bytes, found none")))?;
    Ok(vec![[0.0; 3]; pixels])
}

/// What the first bytes of a file say it is.
enum Format {
    Exr,
    Pfm,
    Png,
    Other(&'static str),
}

impl Format {
    fn of(start: &[u8; 8]) -> Self {
        let is_space = |byte: u8| byte.is_ascii_whitespace();
        match start {
            [0x76, 0x2f, 0x31, 0x01, ..] => Self::Exr,
            [0x89, b'P', b'N', b'G', ..] => Self::Png,
            [b'P', b'F' | b'f', next, ..] if is_space(*next) => Self::Pfm,
            [b'P', b'F', b'4', ..] => Self::Other("a PFM of four channels"),
            [b'P', b'1'..=b'7', next, ..] if is_space(*next) => Self::Other("a PNM or PAM file"),
            [b'#', b'?', ..] => Self::Other("a Radiance HDR file"),
            [0xff, 0xd8, 0xff, ..] => Self::Other("a JPEG file"),
            [b'I', b'I', 42, 0, ..] | [b'M', b'M', 0, 42, ..] => Self::Other("a TIFF file"),
            [0, 0, 0, 0, 0, 0, 0, 0] => Self::Other("an empty file, or zeros"),
            _ => Self::Other("another kind of file"),
        }
    }
}

/// Every pixel is a number, or the error says how many channels are not and where the first is.
fn check_finite(picture: &Picture, about: &About) -> Result<()> {
    let channels = picture.pixels.as_flattened();
    let bad = channels.iter().filter(|c| !c.is_finite()).count();
    let Some(first) = channels.iter().position(|c| !c.is_finite()) else { return Ok(()) };
    let (pixel, channel) = (first / 3, ["R", "G", "B"][first % 3]);
    let (x, y) = (pixel % picture.width as usize, pixel / picture.width as usize);
    let what = format!(
        "expected finite pixels, found {bad} of {} pixel-channels that are not: the first is {} in channel {channel} of \
         pixel ({x}, {y}), counted from the top left",
        channels.len(),
        channels[first]
    );
    Err(about.bad(what))
}

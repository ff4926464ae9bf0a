//! Linear radiance images: EXR with provenance, PNG with exposure, outputs that are whole or absent; and images of other
//! programs ([`read_picture`]).

mod exr_in;
mod pfm;
mod picture;
mod png_in;
mod screen;

use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

use exr::block::writer::ChunksWriter;
use exr::block::{BlockIndex, UncompressedBlock, enumerate_ordered_header_block_indices};
use exr::image::write::layers::{LayersWriter, WritableLayers};
use exr::prelude::*;
use image::codecs::png::CompressionType;
use rayon::prelude::*;

use crate::error::{Error, Result};

pub use pfm::write_pfm;
pub use picture::{MAX_PIXELS, PICTURE_PIXEL_BYTES, Picture, read_picture};
pub use screen::{DEFAULT_EXPOSURE, ScreenTable, screen_light, srgb_decode, srgb_encode, to_screen, tone_map};

/// Linear radiance, `f32` RGB, top row first: `pixels[y * width + x]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` pixels, row by row from the top.
    pub pixels: Vec<[f32; 3]>,
}

impl Image {
    /// A black image.
    pub fn black(width: u32, height: u32) -> Self {
        Self { width, height, pixels: vec![[0.0; 3]; width as usize * height as usize] }
    }
}

/// Writes `bytes` under a temporary name beside `path`, then renames it: a reader sees the old file or the whole new one,
/// also after a loss of power.
///
/// # Errors
/// Kind [`ErrorKind::Write`](crate::error::ErrorKind::Write) with the system's reason.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    write_renamed(path, bytes, true)
}

/// Whether a file can be written at `path`, found out by making its folder and an empty temporary file beside it: what
/// takes long is refused before it starts, not after.
///
/// # Errors
/// Kind [`ErrorKind::Write`](crate::error::ErrorKind::Write) with the system's reason.
pub fn check_writable(path: &Path) -> Result<()> {
    let fail = |e: std::io::Error| Error::write(path, format!("cannot write: {e}"));
    let partial = partial_beside(path).map_err(fail)?;
    std::fs::File::create(&partial).and_then(|_| std::fs::remove_file(&partial)).map_err(fail)?;
    if path.is_dir() { Err(Error::write(path, "cannot write: it is a folder")) } else { Ok(()) }
}

/// The temporary name beside `path`, whose folder is made.
fn partial_beside(path: &Path) -> std::io::Result<PathBuf> {
    if let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder)?;
    }
    let mut partial = path.as_os_str().to_owned();
    partial.push(format!(".{}.partial", std::process::id()));
    Ok(PathBuf::from(partial))
}

/// As [`write_whole`], forcing the bytes to disk before the renaming where `durable`.
fn write_renamed(path: &Path, bytes: &[u8], durable: bool) -> Result<()> {
    let fail = |e: std::io::Error| Error::write(path, format!("cannot write: {e}"));
    let partial = &partial_beside(path).map_err(fail)?;
    let written = (|| {
        let mut file = std::fs::File::create(partial)?;
        file.write_all(bytes)?;
        if durable {
            file.sync_data()?;
        }
        std::fs::rename(partial, path)
    })();
    if written.is_err() {
        // Best effort: the message below is about the write, not about the tidying.
        let _ = std::fs::remove_file(partial);
    }
    written.map_err(fail)
}

/// Prefix of the provenance attributes in EXR files.
const ATTRIBUTE_PREFIX: &str = "sampler_lab.";

/// Writes a lossless OpenEXR image, `f32` channels R G B, with `provenance` as text attributes `sampler_lab.*`.
///
/// The same image and provenance give the same bytes. Not forced to disk: after a loss of power the file may be torn, which
/// its reader notices.
///
/// # Errors
/// Kind `Write` where the file cannot be written.
pub fn write_exr(path: &Path, image: &Image, provenance: &[(String, String)]) -> Result<()> {
    write_exr_as(path, image, provenance, Compression::ZIP16)
}

/// As [`write_exr`], without compression: for images that are read once by the program itself, since noise in `f32` hardly
/// shrinks and compressing it takes longer than to measure it.
///
/// # Errors
/// As [`write_exr`].
pub fn write_exr_plain(path: &Path, image: &Image, provenance: &[(String, String)]) -> Result<()> {
    write_exr_as(path, image, provenance, Compression::Uncompressed)
}

fn write_exr_as(path: &Path, image: &Image, provenance: &[(String, String)], compression: Compression) -> Result<()> {
    let bytes = exr_bytes_as(image, provenance, compression)
        .map_err(|e| Error::write(path, format!("cannot encode EXR: {e}")))?;
    write_renamed(path, &bytes, false)
}

/// The bytes of the file that [`write_exr`] writes.
///
/// # Errors
/// What the encoder says.
pub fn exr_bytes(image: &Image, provenance: &[(String, String)]) -> std::result::Result<Vec<u8>, String> {
    exr_bytes_as(image, provenance, Compression::ZIP16)
}

fn exr_bytes_as(
    image: &Image,
    provenance: &[(String, String)],
    compression: Compression,
) -> std::result::Result<Vec<u8>, String> {
    let size = Vec2(image.width as usize, image.height as usize);
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
        let [r, g, b] = image.pixels[at.y() * image.width as usize + at.x()];
        (r, g, b)
    });
    let mut layer = LayerAttributes::named("");
    layer.layer_name = None;
    for (name, value) in provenance {
        let name = Text::from(format!("{ATTRIBUTE_PREFIX}{name}").as_str());
        layer.other.insert(name, AttributeValue::Text(Text::from(value.as_str())));
    }
    let encoding = Encoding { compression, ..Encoding::default() };
    let file = exr::prelude::Image::from_layer(Layer::new(size, layer, encoding, channels));
    let bytes = encode_exr(&file).map_err(|e| e.to_string())?;
    with_sorted_attributes(bytes).ok_or_else(|| "its header does not read back".to_owned())
}

/// The file's bytes. As the package's own writer makes them, with the blocks compressed side by side and written in their order.
fn encode_exr<'a, L: WritableLayers<'a>>(file: &'a exr::prelude::Image<L>) -> exr::error::Result<Vec<u8>> {
    let headers = file.write().infer_meta_data();
    let layers = file.layer_data.create_writer(&headers);
    let mut bytes = Cursor::new(Vec::new());
    exr::block::write(&mut bytes, headers, true, |meta, chunks| {
        let blocks: Vec<_> = enumerate_ordered_header_block_indices(&meta.headers).collect();
        let compress = |&(number, index): &(usize, BlockIndex)| {
            let data = layers.extract_uncompressed_block(&meta.headers, index);
            Ok((number, UncompressedBlock { index, data }.compress_to_chunk(&meta.headers)?))
        };
        let compressed: Vec<exr::error::Result<_>> = blocks.par_iter().map(compress).collect();
        for chunk in compressed {
            let (number, chunk) = chunk?;
            chunks.write_chunk(number, chunk)?;
        }
        Ok(())
    })?;
    Ok(bytes.into_inner())
}

/// Puts the attributes of a single-part OpenEXR file into the order of their names.
///
/// The encoder keeps custom attributes in a randomly seeded map; the format gives their order no meaning, and the header's
/// length, which offsets count from, stays. Layout: magic and version (8 bytes), then name\0 type\0 size:i32 value, until an
/// empty name. `None` where the bytes are not of that form.
fn with_sorted_attributes(mut bytes: Vec<u8>) -> Option<Vec<u8>> {
    const START: usize = 8;
    let mut attributes: Vec<Vec<u8>> = Vec::new();
    let mut at = START;
    while *bytes.get(at)? != 0 {
        let name_end = at + bytes[at..].iter().position(|&b| b == 0)?;
        let type_end = name_end + 1 + bytes[name_end + 1..].iter().position(|&b| b == 0)?;
        let size = i32::from_le_bytes(bytes.get(type_end + 1..type_end + 5)?.try_into().ok()?);
        let end = type_end + 5 + usize::try_from(size).ok()?;
        attributes.push(bytes.get(at..end)?.to_vec());
        at = end;
    }
    attributes.sort();
    let sorted = attributes.concat();
    bytes[START..START + sorted.len()].copy_from_slice(&sorted);
    Some(bytes)
}

/// Reads the R, G and B channels of an OpenEXR image and its `sampler_lab.*` attributes.
///
/// # Errors
/// Kind `Input` where the file is missing, torn or has no R G B channels.
pub fn read_exr(path: &Path) -> Result<(Image, Vec<(String, String)>)> {
    let bad = |e: &dyn std::fmt::Display| {
        Error::input(path.display(), format!("expected an OpenEXR image with channels R G B, found: {e}"))
    };
    let bytes = std::fs::read(path).map_err(|e| bad(&e))?;
    let file = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| Image::black(size.width() as u32, size.height() as u32),
            |image: &mut Image, at, (r, g, b): (f32, f32, f32)| {
                image.pixels[at.y() * image.width as usize + at.x()] = [r, g, b];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| bad(&e))?;
    let mut provenance: Vec<(String, String)> = file
        .layer_data
        .attributes
        .other
        .iter()
        .filter_map(|(name, value)| match value {
            AttributeValue::Text(text) => {
                Some((name.to_string().strip_prefix(ATTRIBUTE_PREFIX)?.to_owned(), text.to_string()))
            }
            _ => None,
        })
        .collect();
    provenance.sort();
    Ok((file.layer_data.channel_data.pixels, provenance))
}

/// Of the figures of a report level 9 makes 7 % less in five times the time.
const DEFLATE: CompressionType = CompressionType::Level(6);

/// Writes 8-bit RGB `bytes` (top row first) as PNG.
///
/// # Errors
/// Kind `Write` where the file cannot be written.
pub fn write_png_rgb8(path: &Path, width: u32, height: u32, bytes: &[u8]) -> Result<()> {
    write_png_at(path, width, height, bytes, DEFLATE)
}

/// As [`write_png_rgb8`], as small as it gets: for files that are kept, such as textures.
///
/// # Errors
/// Kind `Write` where the file cannot be written.
pub fn write_small_png_rgb8(path: &Path, width: u32, height: u32, bytes: &[u8]) -> Result<()> {
    write_png_at(path, width, height, bytes, CompressionType::Best)
}

fn write_png_at(path: &Path, width: u32, height: u32, bytes: &[u8], level: CompressionType) -> Result<()> {
    let png = png_at(width, height, bytes, level).map_err(|e| Error::write(path, format!("cannot encode PNG: {e}")))?;
    write_whole(path, &png)
}

/// The bytes of the file that [`write_png_rgb8`] writes.
///
/// # Errors
/// What the encoder says.
pub fn png_rgb8_bytes(width: u32, height: u32, bytes: &[u8]) -> std::result::Result<Vec<u8>, String> {
    png_at(width, height, bytes, DEFLATE)
}

fn png_at(width: u32, height: u32, bytes: &[u8], level: CompressionType) -> std::result::Result<Vec<u8>, String> {
    use image::ImageEncoder;
    use image::codecs::png::{FilterType, PngEncoder};
    // Pictures compress better with row filters, charts without: the smaller is kept.
    let encoded = |filter| {
        let mut png = Vec::new();
        PngEncoder::new_with_quality(&mut png, level, filter)
            .write_image(bytes, width, height, image::ExtendedColorType::Rgb8)
            .map_err(|e| e.to_string())?;
        Ok::<_, String>(png)
    };
    let (filtered, plain) = rayon::join(|| encoded(FilterType::Adaptive), || encoded(FilterType::NoFilter));
    let (filtered, plain) = (filtered?, plain?);
    Ok(if plain.len() < filtered.len() { plain } else { filtered })
}

/// Writes a tone-mapped PNG.
///
/// # Errors
/// Kind `Write` where the file cannot be written.
pub fn write_png(path: &Path, image: &Image, exposure: f32) -> Result<()> {
    write_png_rgb8(path, image.width, image.height, &to_screen(image, exposure))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exr_round_trip_keeps_every_bit_and_the_provenance() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let mut image = Image::black(5, 3);
        for (i, p) in image.pixels.iter_mut().enumerate() {
            *p = [i as f32 * 0.1, 1e-30, 3e9 + i as f32];
        }
        let provenance: Vec<_> =
            ["sampler", "scene", "seed", "spp", "version"].map(|n| (n.to_owned(), format!("{n} 7"))).to_vec();
        write_exr(&path, &image, &provenance).unwrap();
        let first = std::fs::read(&path).unwrap();
        for _ in 0..4 {
            write_exr(&path, &image, &provenance).unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), first, "the same image and provenance give the same bytes");
        }
        assert_eq!(read_exr(&path).unwrap(), (image, provenance));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no partial file is left");
    }

    /// The package's own writer, one block after another, is the model.
    #[test]
    fn blocks_compressed_side_by_side_make_the_same_file() {
        let mut image = Image::black(37, 83);
        for (i, p) in image.pixels.iter_mut().enumerate() {
            *p = [(i % 19) as f32, i as f32 * 0.37, 1.0 / (1 + i) as f32];
        }
        let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
            let [r, g, b] = image.pixels[at.y() * 37 + at.x()];
            (r, g, b)
        });
        let encoding = Encoding { compression: Compression::ZIP16, ..Encoding::default() };
        let layer = Layer::new(Vec2(37, 83), LayerAttributes::default(), encoding, channels);
        let file = exr::prelude::Image::from_layer(layer);
        let mut one_by_one = Cursor::new(Vec::new());
        file.write().non_parallel().to_buffered(&mut one_by_one).unwrap();
        assert_eq!(encode_exr(&file).unwrap(), one_by_one.into_inner());
    }

    #[test]
    fn a_torn_exr_is_an_input_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("torn.exr");
        write_exr(&path, &Image::black(8, 8), &[]).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        assert_eq!(read_exr(&path).unwrap_err().exit_code(), 2);
    }
}

//! OpenEXR files of any writer: which channels are meant, and their samples in f64.
//!
//! Blocks are read one by one through the crate's low level: its ready-made readers know neither luminance nor layers by
//! name, leave a missing block black, and ask for the memory that the header claims.

use std::io::{BufRead, Seek};

use exr::block::UncompressedBlock;
use exr::block::chunk::CompressedBlock;
use exr::block::reader::Reader;
use exr::meta::attribute::{AttributeValue, ChannelDescription, SampleType};
use exr::meta::header::Header;
use exr::meta::{MetaData, compute_chunk_count};
use exr::prelude::{Compression, Vec2, f16};

use super::ATTRIBUTE_PREFIX;
use super::picture::{About, Picture, black_pixels};
use crate::error::{Error, Result, did_you_mean};

/// Most bytes one block may unpack to, 512 MiB: a block is decoded in memory as a whole, with all its channels.
const MAX_BLOCK_BYTES: u64 = 1 << 29;

/// Reads the image meant by `layer`; see [`read_picture`](super::read_picture).
pub(super) fn read(reader: impl BufRead + Seek, about: &About, layer: Option<&str>) -> Result<Picture> {
    let reader = Reader::read_from_buffered(reader, false).map_err(|e| torn(about, e))?;
    let meta = reader.meta_data().clone();
    for header in &meta.headers {
        // A block has an offset of 8 bytes in a table of the file. Without this, tables are walked that no file holds.
        let blocks = compute_chunk_count(header.compression, header.layer_size, header.blocks) as u64;
        if blocks.max(header.chunk_count as u64) > about.length / 8 {
            let found = format!("{} bytes, too few for the {blocks} blocks that its header claims", about.length);
            return Err(about.bad(format!("expected a whole OpenEXR image, found {found}")));
        }
    }
    let choice = choose(about, &meta.headers, layer)?;
    let header = &meta.headers[choice.part];
    let (width, height) = about.checked_size(header.layer_size.width() as u64, header.layer_size.height() as u64)?;
    check_decodable(about, header)?;
    let pixels = decode(reader, about, &meta, &choice)?;
    let (data, display) = (header.own_attributes.layer_position, header.shared_attributes.display_window.position);
    let along = |data: i32, display: i32| i64::from(data) - i64::from(display);
    Ok(Picture {
        width,
        height,
        pixels,
        is_display: false,
        corner: Some((along(data.x(), display.x()), along(data.y(), display.y()))),
        provenance: provenance(header),
        notes: Vec::new(),
    })
}

/// A file that the crate could not read.
fn torn(about: &About, e: exr::error::Error) -> Error {
    let reason = match e {
        exr::error::Error::NotSupported(what) => {
            return about.bad(format!("expected an OpenEXR image of a kind that is read, found: {what}"));
        }
        exr::error::Error::Invalid(what) => what.into_owned(),
        e => e.to_string(),
    };
    about.bad(format!("expected a whole OpenEXR image, found: {reason}"))
}

/// Refuses what would be decoded wrongly or with more memory than is reasonable.
fn check_decodable(about: &About, header: &Header) -> Result<()> {
    if let Compression::HTJ2K32 | Compression::HTJ2K256 = header.compression {
        return Err(
            about.bad("expected no compression or RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA or DWAB, found HTJ2K")
        );
    }
    if let Some(channel) = header.channels.list.iter().find(|c| c.sampling != Vec2(1, 1)) {
        let Vec2(x, y) = channel.sampling;
        let what = format!("expected a sample in every pixel, found channel {} in every {x}×{y} alone", channel.name);
        return Err(about.bad(what));
    }
    let block = header.max_block_pixel_size();
    let side = |block: usize, whole: usize| block.min(whole) as u64;
    let pixels = side(block.x(), header.layer_size.x()) * side(block.y(), header.layer_size.y());
    let bytes = pixels.saturating_mul(header.channels.bytes_per_pixel as u64);
    if bytes > MAX_BLOCK_BYTES {
        let what = format!("expected blocks of at most {MAX_BLOCK_BYTES} bytes, found one of {bytes}");
        return Err(about.bad(what));
    }
    Ok(())
}

/// Which channels of which part are the image.
struct Choice {
    part: usize,
    /// Places in the part's list of the channels for R, G and B.
    channels: [usize; 3],
}

/// A layer that can be read as an image.
struct Layer {
    /// Part and layer as `--layer` names it; empty for the unnamed one of a file of one part.
    name: String,
    /// Named R G B alone, without a layer before it.
    is_plain: bool,
    choice: Choice,
}

/// Picks the image: the one named, or the unnamed R G B, or without a name the only one there is.
fn choose(about: &About, headers: &[Header], wanted: Option<&str>) -> Result<Choice> {
    let mut layers: Vec<Layer> = headers.iter().enumerate().flat_map(|(i, h)| layers_of(i, h, headers.len())).collect();
    let names: Vec<String> = layers.iter().map(|layer| layer.name.clone()).collect();
    let quoted = || names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    let found = match (layers.len(), wanted) {
        (0, _) => {
            let all = headers.iter().flat_map(|h| h.channels.list.iter().map(|c| c.name.to_string()));
            let all = all.collect::<Vec<_>>().join(", ");
            return Err(about.bad(format!("expected channels R, G, B or Y, found {all}")));
        }
        (1, None) => Some(0),
        // One --layer is for images and references, of which some may have nothing but R G B.
        (1, Some(wanted)) if names[0].is_empty() && !has_layer(headers, wanted) => Some(0),
        (_, Some(wanted)) => match names.iter().position(|name| name == wanted) {
            None => {
                let near = did_you_mean(wanted, names.iter().map(String::as_str));
                let hint = near.map_or(String::new(), |near| format!("; did you mean \"{near}\"?"));
                return Err(about.bad(format!("expected one of the layers {}, found \"{wanted}\"{hint}", quoted())));
            }
            found => found,
        },
        (_, None) => {
            let mut plain = (0..layers.len()).filter(|&i| layers[i].is_plain);
            plain.next().filter(|_| plain.next().is_none())
        }
    };
    match found {
        Some(at) => Ok(layers.swap_remove(at).choice),
        None => {
            Err(about.bad(format!("expected --layer to name one of its layers, found none named and {}", quoted())))
        }
    }
}

/// Whether any channel, of colour or not, is of this layer.
fn has_layer(headers: &[Header], wanted: &str) -> bool {
    let layer_of = |c: &ChannelDescription| c.name.to_string().rsplit_once('.').map(|(layer, _)| layer.to_owned());
    headers.iter().flat_map(|h| &h.channels.list).any(|c| layer_of(c).as_deref() == Some(wanted))
}

/// The layers of a part that have R, G and B, or else luminance alone.
fn layers_of(part: usize, header: &Header, parts: usize) -> Vec<Layer> {
    let split = |channel: &ChannelDescription| {
        let name = channel.name.to_string();
        let (layer, channel) = name.rsplit_once('.').unwrap_or(("", &name));
        (layer.to_owned(), channel.to_owned())
    };
    let channels: Vec<(String, String)> = header.channels.list.iter().map(split).collect();
    let mut names: Vec<&str> = channels.iter().map(|(layer, _)| layer.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let part_name = header.own_attributes.layer_name.as_ref().map(|name| name.to_string()).filter(|_| parts > 1);
    let layer = |name: &str| -> Option<Layer> {
        let at = |wanted: &str| channels.iter().position(|(l, c)| l == name && c.eq_ignore_ascii_case(wanted));
        let colour = || Some([at("R")?, at("G")?, at("B")?]);
        // X Y Z are a position or a normal, Y RY BY a colour that this does not decode.
        let grey = || Some([at("Y").filter(|_| ["X", "RY", "BY"].iter().all(|other| at(other).is_none()))?; 3]);
        let is_colour = colour().is_some();
        let channels = colour().or_else(grey)?;
        let full = [part_name.as_deref().unwrap_or(""), name].into_iter().filter(|part| !part.is_empty());
        let full = full.collect::<Vec<_>>().join(".");
        Some(Layer { name: full, is_plain: is_colour && name.is_empty(), choice: Choice { part, channels } })
    };
    names.into_iter().filter_map(layer).collect()
}

/// Refuses a block of DWAA or DWAB that claims to unpack to far more than its pixels: the decoder asks for that memory at
/// once, and a failure there ends the program.
///
/// Such a block starts with eleven 64-bit numbers, of which the second to the tenth are sizes of its sections in bytes or 16-bit words,
/// packed and unpacked. Transformed channels are padded to 8 × 8 pixels, and run lengths add half at worst: 4 times
/// is ample.
fn check_dwa(about: &About, header: &Header, block: &CompressedBlock) -> Result<()> {
    let (Compression::DWAA(_) | Compression::DWAB(_)) = header.compression else { return Ok(()) };
    let bytes = match block {
        CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
        CompressedBlock::Tile(block) => &block.compressed_pixels_le,
        _ => return Ok(()),
    };
    let tile = header.get_block_data_indices(block).map_err(|e| torn(about, e))?;
    let size = header.get_absolute_block_pixel_coordinates(tile).map_err(|e| torn(about, e))?.size;
    // A block that would not get smaller is stored as it is, and its first bytes are pixels.
    if bytes.len() == size.area() * header.channels.bytes_per_pixel {
        return Ok(());
    }
    let padded = (size.x() as u64 + 8) * (size.y() as u64 + 8);
    let limit = 4 * padded * header.channels.bytes_per_pixel as u64 + 65_536;
    let sizes = bytes.as_chunks().0.iter().map(|&size| u64::from_le_bytes(size)).take(10).skip(1);
    match sizes.into_iter().find(|&size| size > limit) {
        Some(size) => {
            let found = format!("a block with a section of {size}, more than {limit}");
            Err(about.bad(format!("expected a whole OpenEXR image, found {found}")))
        }
        None => Ok(()),
    }
}

/// All pixels of the largest resolution; every block has to be there once.
fn decode<R: BufRead + Seek>(
    reader: Reader<R>,
    about: &About,
    meta: &MetaData,
    choice: &Choice,
) -> Result<Vec<[f64; 3]>> {
    let header = &meta.headers[choice.part];
    let Vec2(width, height) = header.layer_size;
    let broken = |what: &str| about.bad(format!("expected a whole OpenEXR image, found {what}"));
    let largest = Vec2(0, 0);
    let chunks = reader
        .filter_chunks(false, |_, tile, block| block.layer == choice.part && tile.level_index == largest)
        .map_err(|e| torn(about, e))?;
    let mut pixels = black_pixels(about, width * height)?;
    let mut is_filled = vec![false; width * height];
    for chunk in chunks {
        let chunk = chunk.map_err(|e| torn(about, e))?;
        if chunk.layer_index != choice.part {
            return Err(broken("a block that belongs elsewhere"));
        }
        check_dwa(about, header, &chunk.compressed_block)?;
        let block = UncompressedBlock::decompress_chunk(chunk, meta, false).map_err(|e| torn(about, e))?;
        let (at, size) = (block.index.pixel_position, block.index.pixel_size);
        let is_inside = at.x() + size.x() <= width && at.y() + size.y() <= height;
        if block.index.level != largest || !is_inside {
            return Err(broken("a block that belongs elsewhere"));
        }
        if block.data.len() != size.area() * header.channels.bytes_per_pixel {
            return Err(broken("a block of another size than its channels have"));
        }
        for y in at.y()..at.y() + size.y() {
            let row = &mut is_filled[y * width + at.x()..][..size.x()];
            if row.contains(&true) {
                return Err(broken("a block that is there twice"));
            }
            row.fill(true);
        }
        for line in block.lines(&header.channels) {
            let start = line.location.position.y() * width + line.location.position.x();
            let kind = header.channels.list[line.location.channel].sample_type;
            for colour in (0..3).filter(|&c| choice.channels[c] == line.location.channel) {
                let row = pixels[start..start + size.x()].iter_mut();
                row.zip(samples(kind, line.value)).for_each(|(pixel, sample)| pixel[colour] = sample);
            }
        }
    }
    if is_filled.contains(&false) { Err(broken("none of the blocks for some of its pixels")) } else { Ok(pixels) }
}

/// The samples of a line, exactly: half and float are f64 too, and so is every u32.
fn samples(kind: SampleType, line: &[u8]) -> Vec<f64> {
    match kind {
        SampleType::F16 => line.as_chunks().0.iter().map(|&b| f16::from_ne_bytes(b).to_f64()).collect(),
        SampleType::F32 => line.as_chunks().0.iter().map(|&b| f64::from(f32::from_ne_bytes(b))).collect(),
        SampleType::U32 => line.as_chunks().0.iter().map(|&b| f64::from(u32::from_ne_bytes(b))).collect(),
    }
}

/// The text attributes `sampler_lab.*`, sorted by name.
fn provenance(header: &Header) -> Vec<(String, String)> {
    let all = header.own_attributes.other.iter().chain(&header.shared_attributes.other);
    let ours = all.filter_map(|(name, value)| match value {
        AttributeValue::Text(text) => {
            Some((name.to_string().strip_prefix(ATTRIBUTE_PREFIX)?.to_owned(), text.to_string()))
        }
        _ => None,
    });
    let mut ours: Vec<(String, String)> = ours.collect();
    ours.sort();
    ours
}

//! What a report shows of images: the four stages, strips with zoomed crops, error maps.

use std::path::Path;

use crate::error::{Error, Result};
use crate::experiment::results::image_path;
use crate::film::{Image, read_exr, to_screen};

use super::figure::Rgb8;
use super::numbers::{short, signed};
use super::pictures::{Crop, ScaleBar, StripCell, StripLayout, error_map, error_scale, strip};
use super::summarise::Summary;

/// Exposure of pictures shown: the scene files' own is not in the rows, and every picture has to have the same.
pub const EXPOSURE: f32 = 3.0;
/// Edge of a crop, in pixels of the image, where the image is large enough.
const CROP: u32 = 28;
const ZOOM: u32 = 4;

/// Reads an image; one that is not there is an error like any other.
fn image(dir: &Path, id: &str) -> Result<Image> {
    Ok(read_exr(&image_path(dir, id))?.0)
}

/// As shown on a screen.
fn shown(image: &Image) -> Rgb8 {
    Rgb8 { width: image.width, height: image.height, bytes: to_screen(image, EXPOSURE) }
}

/// The mean of the pictures' two reference halves, or the closed form.
fn reference(dir: &Path, summary: &Summary) -> Result<Image> {
    let row = summary.picture_reference.as_ref();
    let row =
        row.ok_or_else(|| Error::incomplete(dir.display(), "expected a reference of the pictures, found none"))?;
    let Some([a, b]) = &row.halves else { return image(dir, &row.id) };
    let (a, b) = (image(dir, a)?, image(dir, b)?);
    let mean = |(a, b): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|c| ((f64::from(a[c]) + f64::from(b[c])) / 2.0) as f32);
    Ok(Image { pixels: std::iter::zip(&a.pixels, &b.pixels).map(mean).collect(), ..a })
}

/// The sheet's Figure 1.
///
/// # Errors
/// Kind `Input` where an image cannot be read.
pub fn stages(dir: &Path, summary: &Summary) -> Result<Rgb8> {
    let images: Vec<Rgb8> =
        summary.stages.iter().map(|row| image(dir, &row.id).map(|i| shown(&i))).collect::<Result<_>>()?;
    let words = ["pixel centres, albedo", "+ sampled pixel", "+ sampled lens", "+ sampled area light"];
    let cells: Vec<StripCell> = summary
        .stages
        .iter()
        .zip(&images)
        .map(|(row, image)| StripCell {
            image,
            title: row.stage.name().to_owned(),
            captions: vec![format!("{}, {} spp", words[row.stage as usize], row.spp.taken)],
        })
        .collect();
    strip(&cells, &StripLayout { columns: 2, whole: Some(2), crops: Vec::new(), scale_bar: None })
}

/// A part of the picture worth a closer look, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct Detail {
    /// What is to be seen there, and how it was found.
    pub name: &'static str,
    /// Where.
    pub crop: Crop,
}

/// The three windows to enlarge: where sampling the pixel changes most, where the lens does, and where the light falls
/// most unevenly on an even surface. Without the stages' images, or where windows do not fit: none.
fn details(dir: &Path, summary: &Summary) -> Vec<Detail> {
    let images: Option<Vec<Image>> = summary.stages.iter().map(|row| image(dir, &row.id).ok()).collect();
    let Some(images) = images.filter(|images| images.len() == 4) else { return Vec::new() };
    let [start, aa, dof, last] = [0, 1, 2, 3].map(|i| &images[i]);
    let (width, height) = (last.width, last.height);
    if width < 3 * CROP || height < CROP || images.iter().any(|i| (i.width, i.height) != (width, height)) {
        return Vec::new();
    }
    let grey = |image: &Image, i: usize| image.pixels[i].iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0;
    let change = |a: &Image, b: &Image| (0..a.pixels.len()).map(|i| libm::pow(grey(a, i) - grey(b, i), 2.0)).collect();
    let (edges, blur): (Vec<f64>, Vec<f64>) = (change(start, aa), change(aa, dof));
    // Light falling on the surface; steps between neighbours count where the surface itself has none.
    let lit: Vec<f64> = (0..last.pixels.len()).map(|i| grey(last, i) / grey(dof, i).max(0.02)).collect();
    let step = |v: &dyn Fn(usize) -> f64, i: usize| {
        let (x, y) = (i as u32 % width, i as u32 / width);
        let across = if x + 1 < width { (v(i + 1) - v(i)).abs() } else { 0.0 };
        let down = if y + 1 < height { (v(i + width as usize) - v(i)).abs() } else { 0.0 };
        across + down
    };
    let shadow: Vec<f64> =
        (0..lit.len()).map(|i| step(&|i| lit[i].min(1.0), i) / (1.0 + 50.0 * step(&|i| grey(dof, i), i))).collect();
    let wanted = [
        ("edges: the pixel's samples change most here", edges, [230, 159, 0]),
        ("defocus: the lens changes most here", blur, [86, 180, 233]),
        ("penumbra: the light is most uneven here, on an even surface", shadow, [0, 158, 115]),
    ];
    let mut found: Vec<Detail> = Vec::new();
    for (name, score, colour) in wanted {
        if let Some((x, y)) = best_window(&score, (width, height), &found) {
            found.push(Detail { name, crop: Crop { x, y, width: CROP, height: CROP, zoom: ZOOM, colour } });
        }
    }
    found
}

/// The corner of the window of the largest sum that does not touch those found before.
fn best_window(score: &[f64], (width, height): (u32, u32), taken: &[Detail]) -> Option<(u32, u32)> {
    let free = |x: u32, y: u32| taken.iter().all(|d| x.abs_diff(d.crop.x) >= CROP || y.abs_diff(d.crop.y) >= CROP);
    let sum = |x: u32, y: u32| -> f64 {
        (y..y + CROP)
            .flat_map(|row| (x..x + CROP).map(move |column| (row * width + column) as usize))
            .map(|i| score[i])
            .sum()
    };
    let corners = (0..=height - CROP).step_by(4).flat_map(|y| (0..=width - CROP).step_by(4).map(move |x| (x, y)));
    corners
        .filter(|&(x, y)| free(x, y))
        .map(|at| (sum(at.0, at.1), at))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, at)| at)
}

/// Strips of the pictures and what they show.
pub struct Strips {
    /// The reference, whole, its details outlined.
    pub whole: Rgb8,
    /// Details of every picture, enlarged; `None` where there are none.
    pub details: Option<Rgb8>,
    /// Signed errors of every picture.
    pub errors: Rgb8,
    /// The details, left to right.
    pub names: Vec<&'static str>,
}

/// Draws the strips.
///
/// # Errors
/// Kind `Input` where an image cannot be read.
pub fn strips(dir: &Path, summary: &Summary) -> Result<Strips> {
    let reference = reference(dir, summary)?;
    let images: Vec<Image> = summary.pictures.iter().map(|row| image(dir, &row.id)).collect::<Result<_>>()?;
    let details = details(dir, summary);
    let crops: Vec<Crop> = details.iter().map(|detail| detail.crop).collect();
    let title = format!("reference, {}", summary.picture_reference.as_ref().map_or("", |row| row.sampler.as_str()));
    let whole_shown = shown(&reference);
    let whole = vec![StripCell { image: &whole_shown, title: title.clone(), captions: Vec::new() }];
    let layout = StripLayout { columns: 1, whole: Some(3), crops: crops.clone(), scale_bar: None };
    // The outlines alone: enlargements stand in the other strip.
    let outlined = StripLayout { crops: crops.iter().map(|crop| Crop { zoom: 3, ..*crop }).collect(), ..layout };
    Ok(Strips {
        whole: strip(&whole, &outlined)?,
        details: (!crops.is_empty()).then(|| detail_strip(summary, &title, &reference, &images, &crops)).transpose()?,
        errors: error_strip(summary, &reference, &images)?,
        names: details.iter().map(|detail| detail.name).collect(),
    })
}

/// Under each picture: its error.
fn captions(summary: &Summary, i: usize) -> Vec<String> {
    let row = &summary.pictures[i];
    let mut lines = Vec::new();
    if let Some(errors) = &row.errors {
        let rmse = match errors.mse_unbiased > 0.0 {
            true => short(errors.mse_unbiased.sqrt()),
            false => "below the reference's noise".to_owned(),
        };
        let neighbours = errors.error_autocorrelation.map(|rho| format!(", neighbours {}", signed(rho)));
        lines.push(format!("RMSE {rmse}{}", neighbours.unwrap_or_default()));
    }
    lines
}

fn sampler_title(summary: &Summary, i: usize) -> String {
    let row = &summary.pictures[i];
    let label = summary.samplers.iter().find(|s| s.canonical == row.sampler).map_or(row.sampler.as_str(), |s| &s.label);
    format!("{label}, {} spp", row.spp.taken)
}

fn detail_strip(summary: &Summary, title: &str, reference: &Image, images: &[Image], crops: &[Crop]) -> Result<Rgb8> {
    let shown: Vec<Rgb8> = std::iter::once(reference).chain(images).map(shown).collect();
    let cells: Vec<StripCell> = shown
        .iter()
        .enumerate()
        .map(|(i, image)| match i.checked_sub(1) {
            None => StripCell { image, title: title.to_owned(), captions: Vec::new() },
            Some(i) => StripCell { image, title: sampler_title(summary, i), captions: captions(summary, i) },
        })
        .collect();
    strip(&cells, &StripLayout { columns: 4, whole: None, crops: crops.to_vec(), scale_bar: None })
}

fn error_strip(summary: &Summary, reference: &Image, images: &[Image]) -> Result<Rgb8> {
    let scale = error_scale(images, reference)?;
    let maps: Vec<Rgb8> = images.iter().map(|image| error_map(image, reference, scale)).collect::<Result<_>>()?;
    let cells: Vec<StripCell> = maps
        .iter()
        .enumerate()
        .map(|(i, image)| StripCell { image, title: sampler_title(summary, i), captions: captions(summary, i) })
        .collect();
    let scale_bar = Some(ScaleBar { scale, label: "luminance − reference (radiance)".to_owned() });
    strip(&cells, &StripLayout { columns: 5, whole: Some(1), crops: Vec::new(), scale_bar })
}

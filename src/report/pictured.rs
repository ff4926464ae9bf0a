//! What a report shows of images: the four stages, strips with zoomed crops, error maps.

use std::path::Path;

use crate::error::{Error, Result};
use crate::experiment::results::read_image;
use crate::film::{Image, to_screen};

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
    read_image(dir, id, None)
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
    strip(&cells, &StripLayout { columns: 2, whole: Some(1), crops: Vec::new(), scale_bar: None })
}

/// A part of the picture worth a closer look, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct Detail {
    /// What is to be seen there, and how it was found.
    pub name: &'static str,
    /// Where.
    pub crop: Crop,
}

/// The three windows to enlarge, each scored where the light falls: where sampling the pixel changes most and the lens
/// does not, where the lens does, and where the relative errors of all pictures are largest though neither does. Without the stages' images, or
/// where windows do not fit: none.
fn details(dir: &Path, summary: &Summary, reference: &Image, pictures: &[Image]) -> Vec<Detail> {
    let images: Option<Vec<Image>> = summary.stages.iter().map(|row| image(dir, &row.id).ok()).collect();
    let Some(images) = images.filter(|images| images.len() == 4) else { return Vec::new() };
    let (width, height) = (reference.width, reference.height);
    let fits = |i: &Image| (i.width, i.height) == (width, height);
    if width < 3 * CROP || height < CROP || !images.iter().chain(pictures).all(fits) {
        return Vec::new();
    }
    let grey = |image: &Image, i: usize| image.pixels[i].iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0;
    let square = |a: &Image, b: &Image, i: usize| (grey(a, i) - grey(b, i)) * (grey(a, i) - grey(b, i));
    let [edge, blur] = [0, 1].map(|k| move |images: &[Image], i: usize| square(&images[k], &images[k + 1], i));
    // A change of albedo below 0.02 is none.
    let even = |change: f64| 1.0 / (1.0 + change / 4e-4);
    let light = |i: usize| (grey(&images[3], i) / grey(&images[2], i).max(0.02)).min(1.0);
    let bright = |i: usize| grey(reference, i) * grey(reference, i) + 0.01;
    let error = |i: usize| pictures.iter().map(|p| square(p, reference, i)).sum::<f64>() / bright(i);
    let score = |f: &dyn Fn(usize) -> f64| (0..reference.pixels.len()).map(f).collect::<Vec<f64>>();
    let wanted = [
        (
            "edges (the pixel matters most, the lens does not)",
            score(&|i| edge(&images, i) * light(i) * even(blur(&images, i))),
        ),
        ("defocus (the lens matters most)", score(&|i| blur(&images, i) * light(i))),
        ("shadow (the light matters most)", score(&|i| error(i) * even(edge(&images, i)) * even(blur(&images, i)))),
    ];
    let mut found: Vec<Detail> = Vec::new();
    for ((name, score), colour) in wanted.into_iter().zip([[230, 159, 0], [86, 180, 233], [0, 158, 115]]) {
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
    /// The pictures themselves, by file name without ending.
    pub whole_pictures: Vec<(String, Rgb8)>,
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
    let details = details(dir, summary, &reference, &images);
    let crops: Vec<Crop> = details.iter().map(|detail| detail.crop).collect();
    let title = "reference".to_owned();
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
        whole_pictures: whole_pictures(summary, whole_shown, &images),
    })
}

/// The reference and each picture as shown, named in the order of the table, for an image viewer to flip through.
fn whole_pictures(summary: &Summary, reference: Rgb8, images: &[Image]) -> Vec<(String, Rgb8)> {
    let label = |i: usize| {
        let canonical = &summary.pictures[i].sampler;
        let label = summary.samplers.iter().find(|s| s.canonical == *canonical).map_or(canonical, |s| &s.label);
        format!("{:02}-{}", i + 1, label.replace([':', '@'], "-"))
    };
    let pictures = images.iter().enumerate().map(|(i, image)| (label(i), shown(image)));
    std::iter::once(("00-reference".to_owned(), reference)).chain(pictures).collect()
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
        lines.push(format!("{} spp, RMSE {rmse}", row.spp.taken));
        lines.extend(errors.error_autocorrelation.map(|rho| format!("ρ of neighbours {}", signed(rho))));
    }
    lines
}

fn sampler_title(summary: &Summary, i: usize) -> String {
    let row = &summary.pictures[i];
    summary.samplers.iter().find(|s| s.canonical == row.sampler).map_or(&row.sampler, |s| &s.label).clone()
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
    let black = Image::black(reference.width, reference.height);
    let map = |image: &Image| error_map(&in_steps(image, reference, scale), &black, scale);
    let maps: Vec<Rgb8> = images.iter().map(map).collect::<Result<_>>()?;
    let cells: Vec<StripCell> = maps
        .iter()
        .enumerate()
        .map(|(i, image)| StripCell { image, title: sampler_title(summary, i), captions: captions(summary, i) })
        .collect();
    let scale_bar = Some(ScaleBar { scale, label: "luminance − reference (radiance)".to_owned() });
    strip(&cells, &StripLayout { columns: 5, whole: Some(1), crops: Vec::new(), scale_bar })
}

/// The errors in luminance as a grey image, in steps of a fifth of `scale`: enough to tell structure from noise, and the file is
/// a third as large.
fn in_steps(test: &Image, reference: &Image, scale: f64) -> Image {
    let luminance = |p: &[f32; 3]| 0.2126 * f64::from(p[0]) + 0.7152 * f64::from(p[1]) + 0.0722 * f64::from(p[2]);
    let step = |(t, r): (&[f32; 3], &[f32; 3])| {
        let steps = (5.0 * (luminance(t) - luminance(r)) / scale).round().clamp(-5.0, 5.0);
        [(steps / 5.0 * scale) as f32; 3]
    };
    Image {
        width: test.width,
        height: test.height,
        pixels: std::iter::zip(&test.pixels, &reference.pixels).map(step).collect(),
    }
}

//! What a report shows of images: the four stages, strips with zoomed crops, error maps.

use std::path::Path;

use crate::error::{Error, Result};
use crate::experiment::results::{ImageRow, read_image};
use crate::film::{Image, to_screen};

use super::details::{Detail, Stages, Truth, details};
use super::figure::Rgb8;
use super::numbers::{short, signed};
use super::pictures::{Crop, ScaleBar, StripCell, StripLayout, error_map, error_scale, strip};
use super::shots::{PictureSet, Shot, equal_time};
use super::summarise::Summary;

/// Reads an image; one that is not there is an error like any other.
pub(super) fn load(dir: &Path, id: &str) -> Result<Image> {
    read_image(dir, id, None)
}

/// As shown on a screen.
fn shown(image: &Image, exposure: f32) -> Rgb8 {
    Rgb8 { width: image.width, height: image.height, bytes: to_screen(image, exposure) }
}

/// The pictures' two reference halves and their mean, or the closed form.
pub(super) fn truth(dir: &Path, set: &PictureSet) -> Result<Truth> {
    let row = set.reference.as_ref();
    let row =
        row.ok_or_else(|| Error::incomplete(dir.display(), "expected a reference of the pictures, found none"))?;
    let (a, b) = match &row.halves {
        None => (load(dir, &row.id)?, load(dir, &row.id)?),
        Some([a, b]) => (load(dir, a)?, load(dir, b)?),
    };
    let mean = |(a, b): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|c| ((f64::from(a[c]) + f64::from(b[c])) / 2.0) as f32);
    let pixels = std::iter::zip(&a.pixels, &b.pixels).map(mean).collect();
    Ok(Truth { mean: Image { width: a.width, height: a.height, pixels }, halves: [a, b] })
}

/// The sheet's Figure 1: the stages that the scene has.
///
/// # Errors
/// Kind `Input` where an image cannot be read.
pub fn stages(dir: &Path, set: &PictureSet) -> Result<Rgb8> {
    let rows = set.stages_shown();
    let images: Vec<Rgb8> =
        rows.iter().map(|row| load(dir, &row.id).map(|i| shown(&i, set.exposure))).collect::<Result<_>>()?;
    let words = ["pixel centres, albedo", "+ sampled pixel", "+ sampled lens", "+ sampled lights"];
    let cells: Vec<StripCell> = rows
        .iter()
        .zip(&images)
        .map(|(row, image)| StripCell {
            captions: vec![format!("{}, {} spp", words[row.stage as usize], row.spp.taken)],
            ..StripCell::new(image, row.stage.name())
        })
        .collect();
    strip(&cells, &StripLayout { columns: 2, whole: Some(1), crops: Vec::new(), scale_bar: None })
}

/// Strips of the pictures of one scene and what they show.
pub struct Strips {
    /// The reference, whole, its details outlined.
    pub whole: Rgb8,
    /// Details of every picture at equal samples, enlarged; `None` where there are none.
    pub details: Option<Rgb8>,
    /// The same at equal time; `None` where that cannot be shown.
    pub equal_time: Option<Rgb8>,
    /// Signed errors of every picture at equal samples.
    pub errors: Rgb8,
    /// The pictures themselves, by file name without ending.
    pub whole_pictures: Vec<(String, Rgb8)>,
    /// The details, left to right.
    pub names: Vec<&'static str>,
}

/// A picture, its image, and the line of text under it.
struct Shown<'a> {
    shot: &'a Shot,
    image: Image,
    captions: Vec<String>,
}

/// Draws the strips of a scene.
///
/// # Errors
/// Kind `Input` where an image cannot be read.
pub fn strips(dir: &Path, summary: &Summary, set: &PictureSet) -> Result<Strips> {
    let truth = truth(dir, set)?;
    let of = |shot: &Shot| load(dir, &shot.row.id);
    let equal_spp: Vec<Shown> = set
        .at_equal_spp()
        .into_iter()
        .map(|shot| Ok(Shown { shot, image: of(shot)?, captions: captions(&shot.row) }))
        .collect::<Result<_>>()?;
    let images: Vec<&Image> = equal_spp.iter().map(|shown| &shown.image).collect();
    let found = found_details(dir, set, &truth, &images);
    let crops: Vec<Crop> = found.iter().map(|detail| detail.crop).collect();
    let on_screen = shown(&truth.mean, set.exposure);
    let equal_time = match equal_time(summary, set) {
        Some(chosen) if !crops.is_empty() => {
            let timed: Vec<Shown> = chosen
                .choices
                .iter()
                .map(|choice| {
                    let captions = timed_captions(choice.seconds, &choice.shot.row);
                    Ok(Shown { shot: choice.shot, image: of(choice.shot)?, captions })
                })
                .collect::<Result<_>>()?;
            Some(detail_strip(summary, set, &truth, &timed, &crops)?)
        }
        _ => None,
    };
    Ok(Strips {
        whole: outlined(&on_screen, &crops)?,
        details: (!crops.is_empty()).then(|| detail_strip(summary, set, &truth, &equal_spp, &crops)).transpose()?,
        equal_time,
        errors: error_strip(summary, &truth.mean, &equal_spp)?,
        names: found.iter().map(|detail| detail.name).collect(),
        whole_pictures: whole_pictures(summary, set, on_screen, &equal_spp),
    })
}

/// The details of a scene; none where an image of its stages is not there.
pub(super) fn found_details(dir: &Path, set: &PictureSet, truth: &Truth, images: &[&Image]) -> Vec<Detail> {
    let rows = set.stages_shown().into_iter();
    let stages: Option<Vec<_>> = rows.map(|row| Some((row.stage, load(dir, &row.id).ok()?))).collect();
    let is_complete = set.stages.len() == set.stages_planned();
    let stages = stages.filter(|_| is_complete).and_then(Stages::new);
    stages.map_or(Vec::new(), |stages| details(&stages, &truth.mean, images))
}

/// The whole reference with the details outlined, about a page wide.
fn outlined(reference: &Rgb8, crops: &[Crop]) -> Result<Rgb8> {
    let zoom = (960 / reference.width.max(1)).clamp(1, 4);
    let cells = [StripCell::new(reference, "reference")];
    let crops = crops.iter().map(|crop| Crop { zoom, ..*crop }).collect();
    strip(&cells, &StripLayout { columns: 1, whole: Some(zoom), crops, scale_bar: None })
}

/// The reference and each picture as shown, named in the order of the table, for an image viewer to flip through.
fn whole_pictures(summary: &Summary, set: &PictureSet, reference: Rgb8, pictures: &[Shown]) -> Vec<(String, Rgb8)> {
    let name = |i: usize, sampler: usize| {
        format!("{:02}-{}", i + 1, summary.samplers[sampler].label.replace(|c: char| !c.is_ascii_alphanumeric(), "-"))
    };
    let pictures = pictures.iter().enumerate().map(|(i, p)| (name(i, p.shot.sampler), shown(&p.image, set.exposure)));
    std::iter::once(("00-reference".to_owned(), reference)).chain(pictures).collect()
}

/// RMSE in words.
pub fn rmse_words(row: &ImageRow) -> Option<String> {
    let errors = row.errors.as_ref()?;
    Some(match errors.mse_unbiased > 0.0 {
        true => short(errors.mse_unbiased.sqrt()),
        false => "below noise".to_owned(),
    })
}

/// Under each picture at equal samples: its error.
fn captions(row: &ImageRow) -> Vec<String> {
    let rmse = rmse_words(row).map(|rmse| format!("{} spp, RMSE {rmse}", row.spp.taken));
    let rho = row.errors.as_ref().and_then(|errors| errors.error_autocorrelation);
    rmse.into_iter().chain(rho.map(|rho| format!("ρ of neighbours {}", signed(rho)))).collect()
}

/// Under each picture at equal time: what it took.
fn timed_captions(seconds: f64, row: &ImageRow) -> Vec<String> {
    let rmse = rmse_words(row).map(|rmse| format!("RMSE {rmse}"));
    std::iter::once(format!("{} spp in {} s", row.spp.taken, short(seconds))).chain(rmse).collect()
}

/// Crops of the reference and of every picture, under each its error and under all that of the whole picture.
fn detail_strip(
    summary: &Summary,
    set: &PictureSet,
    truth: &Truth,
    pictures: &[Shown],
    crops: &[Crop],
) -> Result<Rgb8> {
    let images: Vec<Rgb8> = std::iter::once(&truth.mean)
        .chain(pictures.iter().map(|p| &p.image))
        .map(|image| shown(image, set.exposure))
        .collect();
    let cells: Vec<StripCell> = images
        .iter()
        .enumerate()
        .map(|(i, on_screen)| match i.checked_sub(1).map(|i| &pictures[i]) {
            None => StripCell::new(on_screen, "reference"),
            Some(p) => StripCell {
                captions: p.captions.clone(),
                crop_captions: crops
                    .iter()
                    .map(|crop| truth.rmse_in(&p.image, crop).map_or("< noise".to_owned(), short))
                    .collect(),
                ..StripCell::new(on_screen, &summary.samplers[p.shot.sampler].label)
            },
        })
        .collect();
    strip(&cells, &StripLayout { columns: 4, whole: None, crops: crops.to_vec(), scale_bar: None })
}

fn error_strip(summary: &Summary, reference: &Image, pictures: &[Shown]) -> Result<Rgb8> {
    let scale = error_scale(pictures.iter().map(|p| &p.image), reference)?;
    let black = Image::black(reference.width, reference.height);
    let map = |p: &Shown| error_map(&in_steps(&p.image, reference, scale), &black, scale);
    let maps: Vec<Rgb8> = pictures.iter().map(map).collect::<Result<_>>()?;
    let cells: Vec<StripCell> = pictures
        .iter()
        .zip(&maps)
        .map(|(p, map)| StripCell {
            captions: p.captions.clone(),
            ..StripCell::new(map, &summary.samplers[p.shot.sampler].label)
        })
        .collect();
    let scale_bar = Some(ScaleBar { scale, label: "luminance − reference (W/(m² sr))".to_owned() });
    strip(&cells, &StripLayout { columns: 4, whole: Some(1), crops: Vec::new(), scale_bar })
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

//! Rows: one line of `results.jsonl` for each finished item, typed, and the timings beside them.
//!
//! A line is whole or ignored: a last line that was torn by a kill is dropped and its item done again; any other
//! line that does not read is an error. Seeds are decimal texts, since 64 bits do not fit a JSON number; numbers are
//! written in their shortest form that reads back to the same bits, intervals rounded to 6 significant digits.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Deserializer, Serialize, Serializer};

pub use super::about::{About, LeftOut, Source, about_path, read_about};
pub use super::backend::{Estimator, PointMetrics, SceneFacts, Size, Stage, Variant};
use super::backend::{estimator_word, stage_word};

pub use super::growth::{Growth, is_enough};
use super::identity::{ID_LENGTH, pixel_hash};
use super::lines::{line, lines, sound_lines};
pub use super::peers::{PeerPoint, Peers};
pub(super) use super::timing::parse_timing;
pub use super::timing::{Rounds, Timing};
use crate::error::{Error, Result};
use crate::film::{Image, read_exr};
pub use crate::stats::ErrorSpectrum;
use crate::stats::Estimate;

/// Version of the row format, field `schema`.
pub const SCHEMA: u32 = 1;

/// Where the rows of an output folder are.
pub fn results_path(out: &Path) -> PathBuf {
    out.join("results.jsonl")
}

/// Where the timings of an output folder are.
pub fn timings_path(out: &Path) -> PathBuf {
    out.join("timings.jsonl")
}

/// Where the image of an item is.
pub fn image_path(out: &Path, id: &str) -> PathBuf {
    out.join("images").join(format!("{id}.exr"))
}

/// Where a reference is to be had as images, for `compare` and other programs: its two halves, `A` and `B`, or the one
/// `exact` image of a closed form. Written at the end of a run, where what they are made of is on disk.
pub fn reference_path(out: &Path, scene: &str, is_picture: bool, part: &str) -> PathBuf {
    let picture = if is_picture { "-picture" } else { "" };
    out.join("images").join(format!("reference-{scene}{picture}-{part}.exr"))
}

/// The image of an item, which proves to be the one that was written: right id, and the digest of its pixels is the one
/// written with it and, where `pixels` is known from a row, that one.
///
/// # Errors
/// Kind `Input` where the file is missing, torn, or not what was written.
pub fn read_image(out: &Path, id: &str, pixels: Option<&str>) -> Result<Image> {
    read_image_at(&image_path(out, id), id, pixels)
}

/// As [`read_image`], of an image that has a name of its own.
pub(super) fn read_image_at(path: &Path, id: &str, pixels: Option<&str>) -> Result<Image> {
    let (image, provenance) = read_exr(path)?;
    let says = |name: &str| provenance.iter().find(|(n, _)| n == name).map_or("", |(_, value)| value.as_str());
    let found = pixel_hash(&image.pixels);
    for (what, expected, found) in [
        ("the id", id, says("id")),
        ("pixels with the digest", says("pixels"), &found),
        ("pixels with the digest", pixels.unwrap_or(&found), &found),
    ] {
        if expected != found {
            return Err(Error::input(path.display(), format!("expected {what} {expected}, found {found}")));
        }
    }
    Ok(image)
}

/// What a row was made with, besides what it says of itself: together with that it is what the item's id hashes. A row
/// that no longer fits says with it what has changed.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MadeWith {
    /// Start of the digest of the scene's content; none for a point set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<String>,
    /// Algorithm number of the renderer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub renderer: Option<u32>,
    /// Algorithm number of the sampler.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sampler: Option<u32>,
    /// Algorithm number of the light estimator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimator: Option<u32>,
    /// Algorithm number of the closed forms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exact: Option<u32>,
}

/// As many digits of a content hash as rows and messages show.
pub fn short_hash(content_hash: &str) -> String {
    content_hash.chars().take(ID_LENGTH).collect()
}

/// The sort of an item.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Metrics of one point set.
    Points,
    /// One of the two independent images whose mean is a reference.
    ReferenceHalf,
    /// A reference: its halves together, or a closed form.
    Reference,
    /// One replicate of one sampler at one spp, compared with the reference.
    Render,
    /// All replicates of one sampler at one spp: bias², variance, intervals.
    Ensemble,
    /// A larger image to look at, compared with a reference of its own.
    Picture,
    /// One of the four pictures of the sheet's Figure 1.
    Stage,
    /// The variance of single pixels, predicted and measured.
    Prediction,
}

/// The kind as written in rows.
pub fn kind_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Points => "points",
        Kind::ReferenceHalf => "reference-half",
        Kind::Reference => "reference",
        Kind::Render => "render",
        Kind::Ensemble => "ensemble",
        Kind::Picture => "picture",
        Kind::Stage => "stage",
        Kind::Prediction => "prediction",
    }
}

/// Samples (or points): as asked for, and as the sampler took.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Count {
    /// Asked for.
    pub asked: u32,
    /// Taken; differs where a sampler has no set of the size asked for.
    pub taken: u32,
}

/// Errors of one image against its reference over pixel-channels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImageErrors {
    /// Id of the reference.
    pub reference_id: String,
    /// Algorithm number of the metrics.
    pub metrics_algorithm: u32,
    /// Mean square difference from the mean of the two halves: holds the reference's noise too.
    pub mse: f64,
    /// mean((T − R1)(T − R2)): free of the reference's noise on average, so it may be below 0.
    pub mse_unbiased: f64,
    /// mean(d² / (R² + 0.01)).
    pub rel_mse: f64,
    /// Mean absolute difference.
    pub mae: f64,
    /// Mean signed difference, image minus reference.
    pub bias: f64,
    /// Correlation of the error between neighbouring pixels; null where the error is not above the reference's noise.
    pub error_autocorrelation: Option<f64>,
    /// FLIP, how different it looks from the reference at the scene's exposure, 0 to 1, mean over the pixels: perceptual, saturates,
    /// and no estimate of any of the above. Rows of earlier versions do not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flip: Option<f64>,
    /// The value below which pixels make up half of the sum.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flip_weighted_median: Option<f64>,
}

/// A difference of more than this share of the mean is called a jump; f32 images that differ by roundings differ by 1e−6.
pub const JUMP: f64 = 1e-4;

/// What differs between an image and its twin, another making of the same picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TwinDifference {
    /// Id of the twin.
    pub id: String,
    /// Share of the pixels that differ in any bit, 0 to 1; 0 where the images are the same bit for bit.
    pub differing: f64,
    /// Share of the pixels in which a channel differs by more than [`JUMP`] of the twin's mean: more than roundings add up
    /// to, as where one moves a ray across an edge.
    pub jumping: f64,
    /// Largest absolute difference of a pixel-channel, radiance.
    pub largest: f64,
    /// Root mean square difference over pixel-channels, radiance.
    pub rms: f64,
}

/// One image: kinds `reference-half`, `render`, `picture` and `stage`; the errors are there for `render` and `picture`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImageRow {
    /// Row format, [`SCHEMA`].
    pub schema: u32,
    /// The item.
    pub id: String,
    /// Sort of item.
    pub kind: Kind,
    /// Scene name.
    pub scene: String,
    /// Sampler in canonical form.
    pub sampler: String,
    /// What the experiment calls the sampler.
    pub names: Vec<String>,
    /// Samples per pixel.
    pub spp: Count,
    /// Replicate, from 0; for a reference half its number, 0 or 1.
    pub replicate: u32,
    /// For a reference that grew: number of the batch, from 0; not written where it is 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub batch: u32,
    /// Seed of the randomisation.
    #[serde(serialize_with = "decimal", deserialize_with = "from_decimal")]
    pub seed: u64,
    /// Light estimator.
    #[serde(with = "estimator_word")]
    pub estimator: Estimator,
    /// How much of the picture is sampled.
    #[serde(with = "stage_word")]
    pub stage: Stage,
    /// How the image was made; absent where plainly.
    #[serde(default, skip_serializing_if = "Variant::is_plain")]
    pub variant: Variant,
    /// Image size.
    pub size: Size,
    /// Mean over all pixel-channels.
    pub mean: f64,
    /// Digest of the pixels ([`pixel_hash`]): equal where two images are equal bit for bit.
    pub pixels: String,
    /// What differs from the image that this one is another making of; absent where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub twin: Option<TwinDifference>,
    /// What it was made with; rows of earlier versions do not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made_with: Option<MadeWith>,
    /// Errors against the reference.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub errors: Option<ImageErrors>,
}

/// Kind `reference`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReferenceRow {
    /// Row format, [`SCHEMA`].
    pub schema: u32,
    /// The item; other rows name it as `reference_id`.
    pub id: String,
    /// `reference`.
    pub kind: Kind,
    /// Scene name.
    pub scene: String,
    /// Sampler in canonical form, or `exact` for a closed form.
    pub sampler: String,
    /// Samples per pixel of each half, or of each batch where it grew; null for a closed form.
    pub spp: Option<Count>,
    /// Image size.
    pub size: Size,
    /// Distance of the plane of focus in images of this scene and size, scene units; null for a pinhole.
    pub focal_depth: Option<f64>,
    /// Ids of the two halves, or of their first batches where they grew; null for a closed form.
    pub halves: Option<[String; 2]>,
    /// How far it grew; not written where it was not to grow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub growth: Option<Growth>,
    /// Algorithm number of the metrics.
    pub metrics_algorithm: u32,
    /// Mean square error of the mean of the halves, mean((R1 − R2)²)/4, of one that grows from the spread among all its
    /// batches ([`growth`](super::growth)); 0 for a closed form.
    pub noise_mse: f64,
    /// Mean over all pixel-channels.
    pub mean: f64,
    /// Digest of the pixels of the mean of the halves; for a closed form those of its image.
    pub pixels: String,
    /// What it was made with; rows of earlier versions do not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made_with: Option<MadeWith>,
}

/// Kind `ensemble`: what the replicates of one sampler at one spp say together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EnsembleRow {
    /// Row format, [`SCHEMA`].
    pub schema: u32,
    /// The item.
    pub id: String,
    /// `ensemble`.
    pub kind: Kind,
    /// Scene name.
    pub scene: String,
    /// Sampler in canonical form.
    pub sampler: String,
    /// What the experiment calls the sampler.
    pub names: Vec<String>,
    /// Samples per pixel.
    pub spp: Count,
    /// Light estimator.
    #[serde(with = "estimator_word")]
    pub estimator: Estimator,
    /// How the images were made; absent where plainly.
    #[serde(default, skip_serializing_if = "Variant::is_plain")]
    pub variant: Variant,
    /// Image size.
    pub size: Size,
    /// Id of the reference.
    pub reference_id: String,
    /// Algorithm number of the metrics.
    pub metrics_algorithm: u32,
    /// Number of replicates; 1 where the sampler has nothing random in it.
    pub replicates: u32,
    /// Unbiased mean square error, with its 95 % interval over replicates and reference noise.
    pub mse: Estimate,
    /// Its root; null where the estimate of the square is below 0.
    pub rmse: Option<Estimate>,
    /// Relative mean square error, ε = 0.01.
    pub rel_mse: Estimate,
    /// Mean square of the expected image's error; may be below 0.
    pub bias2: Estimate,
    /// Mean variance of a pixel-channel between replicates; null where there is one replicate.
    pub variance: Option<Estimate>,
    /// Mean signed error.
    pub bias: Estimate,
    /// Correlation of the error between neighbouring pixels; null where a replicate's is not defined.
    pub error_autocorrelation: Option<Estimate>,
    /// Mean FLIP of the replicates at the scene's exposure; rows of earlier versions do not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flip: Option<Estimate>,
    /// Power of the error images by frequency, where they were made plainly.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_spectrum: Option<Box<ErrorSpectrum>>,
    /// Ids of the replicates.
    pub members: Vec<String>,
    /// What it was made with; rows of earlier versions do not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made_with: Option<MadeWith>,
}

/// Kind `points`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PointsRow {
    /// Row format, [`SCHEMA`].
    pub schema: u32,
    /// The item.
    pub id: String,
    /// `points`.
    pub kind: Kind,
    /// Sampler in canonical form.
    pub sampler: String,
    /// What the experiment calls the sampler.
    pub names: Vec<String>,
    /// Number of points.
    pub n: Count,
    /// Replicate, from 0.
    pub replicate: u32,
    /// Seed of the randomisation.
    #[serde(serialize_with = "decimal", deserialize_with = "from_decimal")]
    pub seed: u64,
    /// Algorithm number of the metrics.
    pub metrics_algorithm: u32,
    /// Values by name; null where a metric is not defined for the set.
    pub metrics: PointMetrics,
    /// What it was made with; rows of earlier versions do not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made_with: Option<MadeWith>,
}

/// The variance of one pixel between randomisations; of the mean of the channels, squared radiance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PixelVariance {
    /// Column and row from the upper left.
    pub pixel: [u32; 2],
    /// What it shows, radiance.
    pub mean: f64,
    /// Variance of one uniform sample.
    pub one_sample: f64,
    /// Variance of the mean of all samples, predicted from spectra ([`pixel_variance`](crate::stats::pixel_variance)).
    pub predicted: f64,
    /// The part of it that stands for frequencies that were not summed.
    pub rest: f64,
    /// The same measured; the interval is that of χ², which holds for normal values.
    pub measured: Estimate,
}

/// Kind `prediction`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PredictionRow {
    /// Row format, [`SCHEMA`].
    pub schema: u32,
    /// The item.
    pub id: String,
    /// `prediction`.
    pub kind: Kind,
    /// Scene name.
    pub scene: String,
    /// Sampler in canonical form.
    pub sampler: String,
    /// Samples per pixel.
    pub spp: Count,
    /// What all its randomisations are derived from.
    #[serde(serialize_with = "decimal", deserialize_with = "from_decimal")]
    pub seed: u64,
    /// Image size.
    pub size: Size,
    /// Randomisations that were measured.
    pub seeds: u32,
    /// Whether the prediction is exact for the sampler: uniform points, or a set that is shifted as a whole.
    pub is_stationary: bool,
    /// Measured by predicted variance, each summed over the pixels; 95 % jackknife interval over the randomisations.
    pub ratio: Estimate,
    /// Share of the prediction that stands for frequencies that were not summed.
    pub rest: f64,
    /// Pixel by pixel.
    pub pixels: Vec<PixelVariance>,
    /// What it was made with.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made_with: Option<MadeWith>,
}

/// One line of `results.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Row {
    /// Kinds `reference-half`, `render`, `picture`, `stage`.
    Image(ImageRow),
    /// Kind `reference`.
    Reference(ReferenceRow),
    /// Kind `ensemble`.
    Ensemble(EnsembleRow),
    /// Kind `points`.
    Points(PointsRow),
    /// Kind `prediction`.
    Prediction(PredictionRow),
}

/// What every row starts with.
#[derive(Deserialize)]
struct Head {
    schema: u32,
    kind: Kind,
}

impl Row {
    /// Reads one line.
    ///
    /// # Errors
    /// What was expected and found, without a place.
    pub fn parse(line: &str) -> std::result::Result<Self, String> {
        let bad = |e: serde_json::Error| format!("expected a row of results, found: {e}");
        let head: Head = serde_json::from_str(line).map_err(bad)?;
        if head.schema != SCHEMA {
            return Err(format!("expected rows of schema {SCHEMA}, found schema {}", head.schema));
        }
        match head.kind {
            Kind::Points => serde_json::from_str(line).map(Self::Points).map_err(bad),
            Kind::Prediction => serde_json::from_str(line).map(Self::Prediction).map_err(bad),
            Kind::Reference => serde_json::from_str(line).map(Self::Reference).map_err(bad),
            Kind::Ensemble => serde_json::from_str(line).map(Self::Ensemble).map_err(bad),
            Kind::ReferenceHalf | Kind::Stage => serde_json::from_str(line).map(Self::Image).map_err(bad),
            Kind::Render | Kind::Picture => match serde_json::from_str(line).map_err(bad)? {
                // A flattened part that does not read is `None`: here it has to be there.
                ImageRow { errors: None, .. } => Err("expected a row with image errors, found none".to_owned()),
                row => Ok(Self::Image(row)),
            },
        }
    }

    /// One line, without its end.
    pub fn to_line(&self) -> String {
        line(self)
    }

    /// The item's id.
    pub fn id(&self) -> &str {
        match self {
            Self::Image(row) => &row.id,
            Self::Reference(row) => &row.id,
            Self::Ensemble(row) => &row.id,
            Self::Points(row) => &row.id,
            Self::Prediction(row) => &row.id,
        }
    }

    /// The sort of item.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Image(row) => row.kind,
            Self::Reference(row) => row.kind,
            Self::Ensemble(row) => row.kind,
            Self::Points(row) => row.kind,
            Self::Prediction(row) => row.kind,
        }
    }

    /// The digest of the pixels of the image kept under the row's id, where there is one.
    pub fn kept_pixels(&self) -> Option<&str> {
        match self {
            Self::Image(row) => Some(&row.pixels),
            Self::Reference(row) if row.halves.is_none() => Some(&row.pixels),
            _ => None,
        }
    }

    /// What the row was made with, where it says so.
    pub fn made_with(&self) -> Option<&MadeWith> {
        match self {
            Self::Image(row) => row.made_with.as_ref(),
            Self::Reference(row) => row.made_with.as_ref(),
            Self::Ensemble(row) => row.made_with.as_ref(),
            Self::Points(row) => row.made_with.as_ref(),
            Self::Prediction(row) => row.made_with.as_ref(),
        }
    }

    /// The scene's name; none for a point set.
    pub fn scene(&self) -> Option<&str> {
        match self {
            Self::Image(row) => Some(&row.scene),
            Self::Reference(row) => Some(&row.scene),
            Self::Ensemble(row) => Some(&row.scene),
            Self::Prediction(row) => Some(&row.scene),
            Self::Points(_) => None,
        }
    }

    /// Writes down what the row was made with: its id vouches for it, and a row of an earlier version did not say.
    pub(super) fn set_made_with(&mut self, made_with: &MadeWith) {
        let field = match self {
            Self::Image(row) => &mut row.made_with,
            Self::Reference(row) => &mut row.made_with,
            Self::Ensemble(row) => &mut row.made_with,
            Self::Points(row) => &mut row.made_with,
            Self::Prediction(row) => &mut row.made_with,
        };
        *field = Some(made_with.clone());
    }

    /// Writes down what the experiment calls the sampler now: an alias may have come or gone since the row was made.
    pub(super) fn set_names(&mut self, now: &[String]) {
        match self {
            Self::Image(ImageRow { names, .. })
            | Self::Ensemble(EnsembleRow { names, .. })
            | Self::Points(PointsRow { names, .. }) => *names = now.to_vec(),
            Self::Reference(_) | Self::Prediction(_) => {}
        }
    }
}

/// Reads `results.jsonl`: all whole rows, in the order of the file.
///
/// # Errors
/// Kind `Input` with the line number where a line other than a torn last one does not read, or where there is no file.
pub fn read(path: &Path) -> Result<Vec<Row>> {
    Ok(lines(path, Row::parse)?.0)
}

/// Reads `timings.jsonl`, torn last line ignored; where an item was timed twice both lines are there.
///
/// # Errors
/// As [`read`].
pub fn read_timings(path: &Path) -> Result<Vec<Timing>> {
    Ok(sound_lines(path, parse_timing)?.values)
}

fn is_zero(n: &u32) -> bool {
    *n == 0
}

/// Seeds as decimal texts.
fn decimal<S: Serializer>(seed: &u64, serializer: S) -> std::result::Result<S::Ok, S::Error> {
    serializer.collect_str(seed)
}

/// Seeds from decimal texts.
fn from_decimal<'de, D: Deserializer<'de>>(deserializer: D) -> std::result::Result<u64, D::Error> {
    let text = String::deserialize(deserializer)?;
    text.parse().map_err(|_| serde::de::Error::custom(format!("expected a seed as a decimal text, found {text:?}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(seed: u64, mse: f64) -> Row {
        Row::Image(ImageRow {
            schema: SCHEMA,
            id: "0123456789abcdef".to_owned(),
            kind: Kind::Render,
            scene: "a01".to_owned(),
            sampler: "ld:shuffle:owen@each".to_owned(),
            names: vec!["ld:best".to_owned()],
            spp: Count { asked: 26, taken: 28 },
            replicate: 3,
            batch: 0,
            seed,
            estimator: Estimator::Unbiased,
            stage: Stage::Final,
            variant: Variant::Plain,
            size: Size { width: 80, height: 45 },
            mean: 0.25,
            pixels: "ffff".to_owned(),
            twin: None,
            made_with: None,
            errors: Some(ImageErrors {
                reference_id: "fedcba9876543210".to_owned(),
                metrics_algorithm: 1,
                mse,
                mse_unbiased: -1e-9,
                rel_mse: 0.0,
                mae: 5e-324,
                bias: -0.0,
                error_autocorrelation: None,
                flip: None,
                flip_weighted_median: None,
            }),
        })
    }

    #[test]
    fn a_row_reads_back_bit_for_bit() {
        for (seed, mse) in [(0, 0.1 + 0.2), (u64::MAX, f64::MAX), (1 << 53 | 1, f64::MIN_POSITIVE)] {
            let row = row(seed, mse);
            let line = row.to_line();
            let again = Row::parse(&line).unwrap();
            assert_eq!(again, row);
            assert_eq!(again.to_line(), line);
        }
    }

    #[test]
    fn a_row_starts_with_schema_id_and_kind_and_holds_its_errors_flat() {
        let line = row(u64::MAX, 0.5).to_line();
        assert!(line.starts_with(r#"{"schema":1,"id":"0123456789abcdef","kind":"render","scene":"a01","#), "{line}");
        assert!(
            line.contains(r#""spp":{"asked":26,"taken":28},"replicate":3,"seed":"18446744073709551615""#),
            "{line}"
        );
        assert!(line.contains(r#""mse":0.5,"#) && line.ends_with(r#""error_autocorrelation":null}"#), "{line}");
    }

    #[test]
    fn a_row_speaks_of_variant_and_twin_only_where_there_are() {
        let mut row = row(1, 0.5);
        assert!(!row.to_line().contains("variant") && !row.to_line().contains("twin"));
        let Row::Image(image) = &mut row else { unreachable!() };
        image.variant = Variant::Scaled(-6);
        image.twin =
            Some(TwinDifference { id: "a".to_owned(), differing: 0.5, jumping: 0.25, largest: 1e-7, rms: 0.1 + 0.2 });
        let line = row.to_line();
        assert!(line.contains(r#""variant":"scaled(1e-6)","#) && line.contains(r#""twin":{"id":"a","differing":0.5,"#));
        assert_eq!(Row::parse(&line), Ok(row));
        assert!(Row::parse(&line.replace("scaled(1e-6)", "scalded(1e-6)")).unwrap_err().contains("a variant"));
    }

    #[test]
    fn a_render_row_without_errors_is_refused() {
        let line = row(1, 0.5).to_line().replace("\"mse_unbiased\"", "\"mse_unbaised\"");
        assert!(Row::parse(&line).unwrap_err().contains("image errors"));
    }

    #[test]
    fn another_schema_is_refused_with_its_number() {
        let line = row(1, 0.5).to_line().replace("\"schema\":1", "\"schema\":2");
        assert!(Row::parse(&line).unwrap_err().contains("found schema 2"));
    }

    #[test]
    fn only_a_torn_last_line_is_forgiven() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.jsonl");
        let (a, b) = (row(1, 0.5), row(2, 0.25));
        let whole = format!("{}\n{}\n", a.to_line(), b.to_line());
        let first = a.to_line().len() + 1;
        for end in 0..=whole.len() {
            std::fs::write(&path, &whole[..end]).unwrap();
            let expected = usize::from(end >= first - 1) + usize::from(end >= whole.len() - 1);
            assert_eq!(read(&path).unwrap().len(), expected, "cut at {end}");
        }
        std::fs::write(&path, format!("{}\n{{\"schema\":1,\n{}\n", a.to_line(), b.to_line())).unwrap();
        let error = read(&path).unwrap_err();
        assert!(error.exit_code() == 2 && error.place.ends_with("results.jsonl:2"), "{error}");
    }

    #[test]
    fn a_torn_letter_of_several_bytes_is_only_a_torn_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.jsonl");
        std::fs::write(&path, b"{\"schema\":1,\"id\":\"\xc3").unwrap();
        assert_eq!(read(&path).unwrap(), []);
    }
}

//! Images of any renderer against a reference: errors with intervals, a signed difference, gates.
//!
//! T is an image, R the reference, d = T − R; with two references R is their mean (R1 + R2)/2, except where a metric is made
//! of both. Means run over pixel-channels, in f64. The formulas are those of [`stats`](crate::stats::image_error).
//!
//! | metric | formula | unit |
//! |---|---|---|
//! | `mse`, `rmse` | mean d², its root | radiance², radiance |
//! | `mse_unbiased`, `rmse_unbiased` | mean (T − R1)(T − R2), its root; need two references | radiance², radiance |
//! | `rel_mse` | mean d²/(R² + 0.01) | 1 |
//! | `mae`, `max_abs` | mean and largest \|d\| | radiance |
//! | `smape` | mean \|d\|/(\|T\| + \|R\|), 0/0 = 0, no factor 2 | 1 |
//! | `bias` | mean d | radiance |
//! | `mse_trimmed`, `rel_mse_trimmed` | without the worst 0.01 % of pixels | as above |
//! | `flip`, `flip_weighted_median` | how different they look on a screen ([`Viewing`]), 0 to 1: no estimate of any of the others | 1 |
//! | `bias2`, `variance` | of replicates: squared bias, variance between them | radiance² |

mod gate;
mod kinship;
mod table;
mod viewing;

use std::sync::{Arc, OnceLock};

use serde::{Serialize, Serializer};

use crate::error::{Error, Result};
use crate::film::{PICTURE_PIXEL_BYTES, Picture};
use crate::stats::flip::{Flip, Seen};
use crate::stats::image_error::{self, bias, mae, max_abs, mse, mse_unbiased, rel_mse, smape};
use crate::stats::trimmed::{mse_trimmed, rel_mse_trimmed, trimmed_pixels};
use crate::stats::{Estimate, t_interval};

pub use gate::{Gate, GateResult};
pub use kinship::kinship;
pub use viewing::Viewing;

/// Most memory that the images compared at one time may take, 4 GiB.
pub const MAX_BYTES: u64 = 4 << 30;

/// A kind of error; the module's head has the formulas.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the module's head documents them in one table")]
pub enum Metric {
    Mse,
    Rmse,
    MseUnbiased,
    RmseUnbiased,
    RelMse,
    Mae,
    Smape,
    Bias,
    MaxAbs,
    MseTrimmed,
    RelMseTrimmed,
    Flip,
    FlipWeightedMedian,
    Bias2,
    Variance,
}

impl Metric {
    /// All, in the order they are printed.
    pub const ALL: [Self; 15] = [
        Self::Mse,
        Self::Rmse,
        Self::MseUnbiased,
        Self::RmseUnbiased,
        Self::RelMse,
        Self::Mae,
        Self::Smape,
        Self::Bias,
        Self::MaxAbs,
        Self::MseTrimmed,
        Self::RelMseTrimmed,
        Self::Flip,
        Self::FlipWeightedMedian,
        Self::Bias2,
        Self::Variance,
    ];

    /// Its name in JSON, tables and gates.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mse => "mse",
            Self::Rmse => "rmse",
            Self::MseUnbiased => "mse_unbiased",
            Self::RmseUnbiased => "rmse_unbiased",
            Self::RelMse => "rel_mse",
            Self::Mae => "mae",
            Self::Smape => "smape",
            Self::Bias => "bias",
            Self::MaxAbs => "max_abs",
            Self::MseTrimmed => "mse_trimmed",
            Self::RelMseTrimmed => "rel_mse_trimmed",
            Self::Flip => "flip",
            Self::FlipWeightedMedian => "flip_weighted_median",
            Self::Bias2 => "bias2",
            Self::Variance => "variance",
        }
    }

    /// Whether it is made of two references.
    pub fn needs_two_references(self) -> bool {
        matches!(self, Self::MseUnbiased | Self::RmseUnbiased)
    }

    /// Whether one image has none.
    pub fn needs_replicates(self) -> bool {
        matches!(self, Self::Bias2 | Self::Variance)
    }
}

/// Errors by metric, in the order of [`Metric::ALL`]; `None` where there is no such number.
#[derive(Debug, Clone, PartialEq)]
pub struct Errors(Vec<(Metric, Option<Estimate>)>);

impl Errors {
    /// The error of this kind, if there is one.
    pub fn get(&self, metric: Metric) -> Option<Estimate> {
        self.0.iter().find(|(m, _)| *m == metric).and_then(|(_, estimate)| *estimate)
    }

    /// Kinds and errors in their order.
    pub fn iter(&self) -> impl Iterator<Item = (Metric, Option<Estimate>)> {
        self.0.iter().copied()
    }
}

impl Serialize for Errors {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(metric, estimate)| (metric.name(), estimate)))
    }
}

/// What images are compared with: one reference, or two that are independent and of equal noise.
pub struct Reference {
    first: Arc<Picture>,
    second: Option<Arc<Picture>>,
    /// The mean of both, or the only one.
    mean: Arc<Picture>,
    viewing: Viewing,
    /// What an eye makes of the mean, once somebody asks.
    seen: OnceLock<Seen>,
}

impl Reference {
    /// One reference, or two; `names` are for messages.
    ///
    /// # Errors
    /// Kind `Input` where two references differ in size, are the same image, or share their random numbers.
    pub fn new(first: (&str, Picture), second: Option<(&str, Picture)>) -> Result<Self> {
        let (name, first) = (first.0, Arc::new(first.1));
        let Some((name2, second)) = second else {
            return Ok(Self::of(first.clone(), first, None));
        };
        check_size(&second, name2, &first)?;
        if second.pixels == first.pixels || kinship(&second, &first).is_some() {
            let what =
                format!("expected a reference independent of {name}, found one made with the same random numbers");
            return Err(Error::input(name2, format!("{what}; an exact reference needs no second")));
        }
        let middle = |(a, b): (&[f64; 3], &[f64; 3])| std::array::from_fn(|c| (a[c] + b[c]) / 2.0);
        let pixels = first.pixels.iter().zip(&second.pixels).map(middle).collect();
        let is_display = first.is_display && second.is_display;
        let mean = Picture { pixels, provenance: Vec::new(), notes: Vec::new(), is_display, ..*first };
        Ok(Self::of(Arc::new(mean), first, Some(Arc::new(second))))
    }

    fn of(mean: Arc<Picture>, first: Arc<Picture>, second: Option<Arc<Picture>>) -> Self {
        Self { first, second, mean, viewing: Viewing::default(), seen: OnceLock::new() }
    }

    /// Looked at in other than the usual way.
    #[must_use]
    pub fn viewed(self, viewing: Viewing) -> Self {
        Self { viewing, seen: OnceLock::new(), ..self }
    }

    /// How different an image looks.
    fn flip(&self, image: &Picture) -> Flip {
        self.seen.get_or_init(|| self.viewing.see(&self.mean)).flip(&self.viewing.see(image))
    }

    /// The reference, or the mean of both.
    pub fn mean(&self) -> &Picture {
        &self.mean
    }

    /// Mean square error of the mean of both references, mean (R1 − R2)²/4; `None` for one, whose noise is not known.
    pub fn noise_mse(&self) -> Option<f64> {
        let (r1, r2) = (&self.first.pixels, &self.second.as_ref()?.pixels);
        Some(image_error::reference_noise(r1.as_flattened(), r2.as_flattened()))
    }

    /// Each reference that was given.
    fn given(&self) -> impl Iterator<Item = &Picture> {
        [&self.first].into_iter().chain(&self.second).map(Arc::as_ref)
    }

    /// Refuses an image that cannot be compared, and says what should be known of one that can.
    ///
    /// # Errors
    /// Kind `Input` where `image` differs in size, or shares its random numbers with a reference but is not the same render.
    pub fn check(&self, name: &str, image: &Picture) -> Result<Vec<String>> {
        check_size(image, name, &self.first)?;
        let mut notes = Vec::new();
        for reference in self.given() {
            match kinship(image, reference) {
                None => {}
                Some(kinship::Kinship::SameRender) => notes.push(
                    "it and the reference say they are the same render (scene, sampler, seed, samples): the difference \
                     tells what changed between two versions, not the error"
                        .to_owned(),
                ),
                Some(kinship::Kinship::SharedNumbers(shared)) => {
                    let what = format!(
                        "expected an image independent of the reference, found one of the same {shared}: they share random \
                         numbers, whatever the samplers, which hides error; render one of them with another --seed"
                    );
                    return Err(Error::input(name, what));
                }
            }
            if let (Some(here), Some(there)) = (image.corner, reference.corner)
                && here != there
            {
                notes.push(format!(
                    "its data window starts at {here:?} of its display window, the reference's at {there:?}: pixels are matched \
                     by the corners of the data"
                ));
            }
        }
        Ok(notes)
    }

    /// Refuses a replicate that is not independent of the reference or of one of the `others` named: their spread, and the
    /// intervals made of it, would be too small.
    ///
    /// # Errors
    /// Kind `Input` where `image` equals one of them in every pixel, or says that it is of the same scene and seed.
    pub fn check_replicate<'a>(
        &'a self,
        name: &str,
        image: &Picture,
        others: impl IntoIterator<Item = (&'a str, &'a Picture)>,
    ) -> Result<()> {
        let references = self.given().map(|reference| ("the reference", reference));
        for (other_name, other) in references.chain(others) {
            let found = match kinship(image, other) {
                Some(kinship::Kinship::SharedNumbers(shared)) => {
                    format!("one that shares random numbers with {other_name}, being of the same {shared}")
                }
                Some(kinship::Kinship::SameRender) => format!("the same render as {other_name}"),
                None if image.pixels == other.pixels => format!("one equal to {other_name} in every pixel"),
                None => continue,
            };
            let what = format!("expected a replicate independent of the others and of the reference, found {found}");
            return Err(Error::input(name, format!("{what}; render each with a --seed of its own")));
        }
        Ok(())
    }

    /// Errors of one image, without intervals: what one image would say of another is not in it.
    pub fn errors(&self, image: &Picture) -> Errors {
        let (t, r) = (image.pixels.as_flattened(), self.mean.pixels.as_flattened());
        let unbiased = self
            .second
            .as_ref()
            .map(|second| mse_unbiased(t, self.first.pixels.as_flattened(), second.pixels.as_flattened()));
        let (plain, flip) = (mse(t, r), self.flip(image));
        let value = |metric| match metric {
            Metric::Mse => Some(plain),
            Metric::Rmse => Some(plain.sqrt()),
            Metric::MseUnbiased => unbiased,
            Metric::RmseUnbiased => unbiased.filter(|&mse| mse >= 0.0).map(f64::sqrt),
            Metric::RelMse => Some(rel_mse(t, r)),
            Metric::Mae => Some(mae(t, r)),
            Metric::Smape => Some(smape(t, r)),
            Metric::Bias => Some(bias(t, r)),
            Metric::MaxAbs => Some(max_abs(t, r)),
            Metric::MseTrimmed => mse_trimmed(&image.pixels, &self.mean.pixels),
            Metric::RelMseTrimmed => rel_mse_trimmed(&image.pixels, &self.mean.pixels),
            Metric::Flip => Some(flip.mean),
            Metric::FlipWeightedMedian => Some(flip.weighted_median),
            Metric::Bias2 | Metric::Variance => None,
        };
        let metrics = Metric::ALL.into_iter().filter(|metric| !metric.needs_replicates());
        Errors(metrics.map(|metric| (metric, value(metric).map(Estimate::without_interval))).collect())
    }

    /// Errors of the estimator whose independent replicates these images are, from the images and their own `errors`.
    ///
    /// A metric of images is the mean over them with Student's interval, and `rmse` the root of the mean `mse`. `mse_unbiased`,
    /// `bias`, `bias2` and `variance` come from [`image_error::ensemble`]: with two references their intervals hold the
    /// references' noise too, with one they take it as exact.
    pub fn ensemble(&self, images: &[Picture], errors: &[Errors]) -> Errors {
        let pixels: Vec<&[[f64; 3]]> = images.iter().map(|image| image.pixels.as_slice()).collect();
        let second = self.second.as_ref().unwrap_or(&self.first);
        let both = image_error::ensemble(&pixels, &self.first.pixels, &second.pixels);
        let is_doubled = self.second.is_some();
        let mean = |metric| -> Option<Estimate> {
            let values: Option<Vec<f64>> = errors.iter().map(|e| e.get(metric).map(|e| e.value)).collect();
            values.map(|values| t_interval(&values, 0.95))
        };
        let estimate = |metric| match metric {
            Metric::Rmse => mean(Metric::Mse).and_then(root),
            Metric::MseUnbiased => is_doubled.then_some(both.mse),
            Metric::RmseUnbiased => both.rmse.filter(|_| is_doubled),
            Metric::Bias => Some(both.bias),
            Metric::Bias2 => Some(both.bias2),
            Metric::Variance => both.variance,
            other => mean(other),
        };
        Errors(
            Metric::ALL
                .into_iter()
                .map(|metric| (metric, estimate(metric).map(Estimate::with_rounded_interval)))
                .collect(),
        )
    }
}

/// Root of a mean square and of its interval's ends, of which a lower one below 0 reads 0; `None` below 0.
fn root(mse: Estimate) -> Option<Estimate> {
    let ends = mse.ci95.map(|ends| ends.map(|end| end.max(0.0).sqrt()));
    (mse.value >= 0.0).then(|| Estimate { value: mse.value.sqrt(), ci95: ends })
}

/// The image has as many columns and rows as the reference.
fn check_size(image: &Picture, name: &str, reference: &Picture) -> Result<()> {
    if (image.width, image.height) == (reference.width, reference.height) {
        return Ok(());
    }
    let (w, h) = (reference.width, reference.height);
    let what = format!("expected the reference's {w}×{h} pixels, found {}×{}", image.width, image.height);
    Err(Error::input(name, what))
}

/// Memory that looking at image and reference takes, in images: 40 bytes a pixel each, and 8 of their difference.
pub const LOOKING: usize = 4;

/// Refuses more images at one time than memory should hold.
///
/// # Errors
/// Kind `Input` where `images` of the reference's size need more than [`MAX_BYTES`].
pub fn check_memory(images: usize, reference: &Picture) -> Result<()> {
    let pixels = u64::from(reference.width) * u64::from(reference.height);
    let bytes = (images as u64).saturating_mul(pixels * PICTURE_PIXEL_BYTES);
    if bytes <= MAX_BYTES {
        return Ok(());
    }
    let what = format!("expected images of at most {MAX_BYTES} bytes in memory, found {images} of {bytes} together");
    Err(Error::input("compare", what))
}

/// The mean of images of one size.
pub fn mean_picture(images: &[Picture]) -> Picture {
    let first = &images[0];
    let mean = |p: usize, c: usize| images.iter().map(|image| image.pixels[p][c]).sum::<f64>() / images.len() as f64;
    let pixels = (0..first.pixels.len()).map(|p| std::array::from_fn(|c| mean(p, c))).collect();
    Picture { pixels, provenance: Vec::new(), notes: Vec::new(), ..*first }
}

/// The signed difference `image` − `reference`, pixel by pixel; both of one size.
pub fn difference(image: &Picture, reference: &Picture) -> Picture {
    let minus = |(t, r): (&[f64; 3], &[f64; 3])| std::array::from_fn(|c| t[c] - r[c]);
    let pixels = image.pixels.iter().zip(&reference.pixels).map(minus).collect();
    Picture { pixels, provenance: Vec::new(), notes: Vec::new(), ..*image }
}

/// Errors of one image.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImageErrors {
    /// The file as it was named.
    pub file: String,
    /// Pixel-channels that are not finite: 0, since an image with any is refused.
    pub nonfinite: usize,
    /// Its errors.
    #[serde(flatten)]
    pub errors: Errors,
}

/// Errors of an estimator.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReplicatesErrors {
    /// How many images there are of it.
    pub count: usize,
    /// Its errors.
    #[serde(flatten)]
    pub errors: Errors,
}

/// All that `compare` found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// The reference's file.
    pub reference: String,
    /// The second reference's file.
    pub reference2: Option<String>,
    /// Columns and rows.
    pub size: String,
    /// Mean square error of the mean of both references; `None` for one.
    pub reference_noise_mse: Option<f64>,
    /// How images and reference are looked at, for `flip`.
    pub viewing: Viewing,
    /// Pixels that the trimmed metrics leave out.
    pub trimmed_pixels: usize,
    /// Each image, in the order named.
    pub images: Vec<ImageErrors>,
    /// All together, where they are replicates of one estimator.
    pub replicates: Option<ReplicatesErrors>,
    /// What was demanded, and whether it holds.
    pub gate: Option<GateResult>,
}

impl Comparison {
    /// With no image yet.
    pub fn new(reference: &Reference, name: &str, name2: Option<&str>) -> Self {
        let mean = reference.mean();
        Self {
            reference: name.to_owned(),
            reference2: name2.map(str::to_owned),
            size: format!("{}x{}", mean.width, mean.height),
            reference_noise_mse: reference.noise_mse(),
            viewing: reference.viewing,
            trimmed_pixels: trimmed_pixels(mean.pixels.len()),
            images: Vec::new(),
            replicates: None,
            gate: None,
        }
    }
}

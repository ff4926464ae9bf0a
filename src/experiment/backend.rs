//! What a runner needs of the rest of the lab: scenes, samplers, pictures and point sets, behind one trait.
//!
//! Planning and executing are written against [`Backend`] alone, so they are tested with a small made-up one; the
//! lab's own is [`Lab`](super::lab::Lab).

use std::collections::BTreeMap;
use std::fmt;
use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};

use super::plan::PredictionWork;
use super::prediction::Predicted;
pub use super::variant::Variant;
use crate::error::{Error, Result};
use crate::film::Image;
use crate::sampling::Decision;
pub use crate::scene::compile::Stage;
pub use crate::scene::config::Estimator;

/// Width and height of an image in pixels, written `WxH`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Size {
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
}

impl Size {
    /// The largest number of pixels that an image of an experiment may have.
    pub const MOST_PIXELS: u64 = 1 << 26;

    /// Reads `WxH`.
    ///
    /// # Errors
    /// What was expected, as a text without a place: both numbers at least 1, no more than
    /// [`MOST_PIXELS`](Self::MOST_PIXELS) together.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        let expected = || {
            format!(
                "expected a size such as \"320x180\", both at least 1 and {} pixels at most together, found {text:?}",
                Self::MOST_PIXELS
            )
        };
        // `parse::<u32>` alone would also take "+3".
        let number = |digits: &str| -> Option<u32> {
            digits.bytes().all(|b| b.is_ascii_digit()).then(|| digits.parse().ok()).flatten()
        };
        let (width, height) = text.split_once('x').ok_or_else(expected)?;
        let size = Self { width: number(width).ok_or_else(expected)?, height: number(height).ok_or_else(expected)? };
        if size.pixels() == 0 || size.pixels() > Self::MOST_PIXELS { Err(expected()) } else { Ok(size) }
    }

    /// Number of pixels.
    pub fn pixels(self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

impl TryFrom<String> for Size {
    type Error = String;
    fn try_from(text: String) -> std::result::Result<Self, String> {
        Self::parse(&text)
    }
}

impl From<Size> for String {
    fn from(size: Size) -> Self {
        size.to_string()
    }
}

/// [`Estimator`] as the word of its files: `#[serde(with = "estimator_word")]`.
pub(super) mod estimator_word {
    use serde::{Deserialize, Deserializer, Serializer};

    use super::Estimator;

    pub fn serialize<S: Serializer>(estimator: &Estimator, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(estimator.name())
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Estimator, D::Error> {
        let word = String::deserialize(deserializer)?;
        Estimator::from_name(&word)
            .ok_or_else(|| serde::de::Error::custom(format!("expected an estimator, found {word:?}")))
    }
}

/// [`Stage`] as its word: `#[serde(with = "stage_word")]`.
pub(super) mod stage_word {
    use serde::{Deserialize, Deserializer, Serializer};

    use super::Stage;

    pub fn serialize<S: Serializer>(stage: &Stage, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(stage.name())
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Stage, D::Error> {
        let word = String::deserialize(deserializer)?;
        Stage::ALL
            .into_iter()
            .find(|stage| stage.name() == word)
            .ok_or_else(|| serde::de::Error::custom(format!("expected a stage, found {word:?}")))
    }
}

/// What a plan needs to know of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneFacts {
    /// Short name: the config file's, without folder and ending.
    pub name: String,
    /// Hex digest of everything the scene was read from.
    pub content_hash: String,
    /// Image size that the scene file asks for.
    pub size: Size,
    /// Samples per pixel that the scene file asks for.
    pub spp: u32,
    /// The decisions of the scene and their dimensions, in words.
    pub layout: String,
    /// Whether every pixel's value is known in closed form, so that the reference is exact.
    pub exact_reference: bool,
    /// Whether there is a lens to sample.
    pub lens: bool,
    /// Exposure that the scene file asks for, in pictures to look at alone.
    #[serde(default = "default_exposure")]
    pub exposure: f32,
    /// Lights of positive power, where lights are asked at all; `None` also in records from before they were counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lights: Option<u32>,
    /// Bytes held while the scene is open.
    pub memory_bytes: u64,
}

impl SceneFacts {
    /// Whether a light is picked among several: only then does it matter whether the pick's probability is divided by.
    pub fn picks_lights(&self) -> bool {
        self.decisions().contains(&Decision::LightPick)
    }

    /// The decisions that the scene makes, in order.
    pub fn decisions(&self) -> Vec<Decision> {
        Decision::named_in(&self.layout)
    }
}

/// The scene format's own, for records made before it was written down.
fn default_exposure() -> f32 {
    3.0
}

/// Numbers that stand for the code behind an item: each is raised when, and only when, that code's bits change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Algorithms {
    /// Rays, shading, film.
    pub renderer: u32,
    /// The sampler asked about.
    pub sampler: u32,
    /// The light estimator.
    pub estimator: u32,
    /// The closed forms that serve as exact references.
    pub exact: u32,
    /// Image errors and point-set metrics.
    pub metrics: u32,
}

/// One image to render.
#[derive(Debug, Clone, Copy)]
pub struct RenderRequest<'a> {
    /// Scene, by the name of its [`SceneFacts`].
    pub scene: &'a str,
    /// Sampler, or set of samplers, in canonical form.
    pub sampler: &'a str,
    /// Samples per pixel asked for; the sampler takes [`Backend::taken`].
    pub spp: u32,
    /// The randomisation.
    pub seed: u64,
    /// Image size.
    pub size: Size,
    /// Light estimator.
    pub estimator: Estimator,
    /// How much of the picture is sampled.
    pub stage: Stage,
    /// How the image is made.
    pub variant: Variant,
    /// Threads to use; no bit depends on it.
    pub threads: usize,
    /// Once set from elsewhere, the image is not wanted any more.
    pub stop: Option<&'a AtomicBool>,
}

/// Values of point-set metrics by name; `None` where a metric is not defined for the set.
pub type PointMetrics = BTreeMap<String, Option<f64>>;

/// Scenes, samplers, pictures and point sets.
///
/// Each answer is a pure function of the arguments and of the files opened: same call, same bits.
pub trait Backend {
    /// Reads the scene called `scene` (a bare name or the path of a config file) and keeps it open under the name in
    /// the answer.
    ///
    /// # Errors
    /// Kind `Input` where the scene cannot be read.
    fn open_scene(&self, scene: &str) -> Result<SceneFacts>;

    /// The canonical form of a sampler's text: texts that mean the same sampler have the same one, and it is a text
    /// for the same sampler itself. A bare name means its `:best` preset.
    ///
    /// # Errors
    /// Kind `Input` with the legal combinations.
    fn parse_sampler(&self, text: &str) -> Result<String>;

    /// Whether the sampler is a set of different ones for different decisions, so that it has no one point set.
    fn is_mixed(&self, canonical: &str) -> bool {
        let _ = canonical;
        false
    }

    /// What the sampler means for the decisions that the scene makes: equal exactly where the numbers are equal there.
    fn meaning(&self, canonical: &str, scene: &str) -> String {
        let _ = scene;
        canonical.to_owned()
    }

    /// Whether another seed gives another image of the scene, or another point set where no scene is given. Without
    /// that there is nothing to replicate. It is a question about both: a sampler may draw for some decisions only.
    fn is_random(&self, canonical: &str, scene: Option<&str>) -> bool;

    /// The number of samples that the sampler takes for the scene (or of points, where none is given) where `asked`
    /// are asked for; at least `asked`.
    fn taken(&self, canonical: &str, scene: Option<&str>, asked: u32) -> u32;

    /// Whether the sampler has numbers for every decision that the scene makes.
    ///
    /// # Errors
    /// Kind `Input` that names the decision.
    fn check_sampler(&self, canonical: &str, scene: &str) -> Result<()> {
        let _ = (canonical, scene);
        Ok(())
    }

    /// Whether the scene can be made in this variant.
    ///
    /// # Errors
    /// Kind `Input` that says why not.
    fn check_variant(&self, scene: &str, variant: Variant) -> Result<()> {
        let _ = (scene, variant);
        Ok(())
    }

    /// The algorithm numbers behind items of this sampler.
    fn algorithms(&self, canonical: &str) -> Algorithms;

    /// Does what rendering needs once and should not be timed with it: compiles the scene, starts the threads.
    ///
    /// # Errors
    /// Kind `Input` where the scene cannot be compiled.
    fn prepare(&self, request: &RenderRequest) -> Result<()>;

    /// Renders one image. Every pixel is finite.
    ///
    /// # Errors
    /// Kind `Incomplete` where a sample is not finite, naming its pixel and sample index; kind `Interrupted` where it was
    /// stopped.
    fn render(&self, request: &RenderRequest) -> Result<Image>;

    /// Draws the random numbers that [`render`](Self::render) would read for this image, and nothing else; whether it can.
    /// Its seconds against those of the image are the share of sampling.
    ///
    /// # Errors
    /// As [`prepare`](Self::prepare).
    fn draw_numbers(&self, request: &RenderRequest) -> Result<bool> {
        let _ = request;
        Ok(false)
    }

    /// Distance of the plane of focus in an image of this size, scene units; `None` for a pinhole. With auto focus it
    /// depends on the image's shape.
    fn focal_depth(&self, scene: &str, size: Size) -> Option<f64>;

    /// The exact image of a scene whose facts say that there is one.
    ///
    /// # Errors
    /// Kind `Incomplete` where the quadrature does not reach its tolerance.
    fn exact_reference(&self, scene: &str, size: Size) -> Result<Image>;

    /// The names that [`point_metrics`](Self::point_metrics) knows.
    fn point_metric_names(&self) -> &'static [&'static str];

    /// Metrics of the set of `taken(n)` points that the sampler gives one decision in one pixel.
    ///
    /// # Errors
    /// Kind `Input` where the sampler has no points.
    fn point_metrics(&self, canonical: &str, n: u32, seed: u64, metrics: &[String]) -> Result<PointMetrics>;

    /// Predicts and measures variances of single pixels; no bit depends on the number of threads.
    ///
    /// # Errors
    /// Kind `Incomplete` where no pixel has a variance, or where the backend knows no spectra.
    fn predict(&self, work: &PredictionWork, threads: usize) -> Result<Predicted> {
        let _ = threads;
        Err(Error::incomplete(&work.scene, "expected a backend that predicts variances, found one that does not"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_reads_back_as_written_and_strange_ones_are_refused() {
        assert_eq!(Size::parse("80x45"), Ok(Size { width: 80, height: 45 }));
        assert_eq!(Size::parse("80x45").unwrap().to_string(), "80x45");
        for bad in
            ["", "80", "80x", "x45", "0x45", "80x0", "-8x45", "+8x45", "8 x45", "80X45", "80x45x3", "99999x99999"]
        {
            assert!(Size::parse(bad).unwrap_err().contains("expected a size"), "{bad}");
        }
    }
}

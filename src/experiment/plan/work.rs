//! The items of a plan: what each of them is to do.

use crate::experiment::backend::{Estimator, Size, Stage, Variant};
use crate::experiment::results::{Count, Kind, MadeWith};

/// Which of a growing half's batches an image is, beyond the first; done only where the reference turns out to want it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Batch {
    /// Number of the batch, from 1.
    pub number: u32,
    /// Id of the reference that decides.
    pub reference_id: String,
}

/// One image to render.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageWork {
    /// `ReferenceHalf`, `Render`, `Picture` or `Stage`.
    pub kind: Kind,
    /// Scene name.
    pub scene: String,
    /// Sampler in canonical form.
    pub sampler: String,
    /// Samples per pixel.
    pub spp: Count,
    /// Replicate, or half of a reference.
    pub replicate: u32,
    /// For what a reference may grow by.
    pub batch: Option<Batch>,
    /// Seed of the randomisation.
    pub seed: u64,
    /// Image size.
    pub size: Size,
    /// Light estimator.
    pub estimator: Estimator,
    /// How much of the picture is sampled.
    pub stage: Stage,
    /// How it is made.
    pub variant: Variant,
    /// Id of the reference that the image is compared with.
    pub reference_id: Option<String>,
    /// Id of the image that this one is another making of, where it is: what differs between them is measured.
    pub twin: Option<String>,
}

impl ImageWork {
    /// Samples to render: spp taken × pixels.
    pub fn samples(&self) -> u64 {
        u64::from(self.spp.taken) * self.size.pixels()
    }
}

/// What a reference is made of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ReferenceSource {
    /// A closed form; the image is kept under the reference's own id.
    Exact,
    /// Two independent images, or means of independent batches of them.
    Halves {
        /// Their ids, or those of their first batches.
        ids: [String; 2],
        /// Their sampler in canonical form.
        sampler: String,
        /// Samples per pixel of each half, or of each batch.
        spp: Count,
        /// What they may grow by.
        growth: Option<GrowthWork>,
    },
}

impl ReferenceSource {
    /// Names of the images that a reference is to be had as.
    pub fn parts(&self) -> &'static [&'static str] {
        match self {
            Self::Exact => &["exact"],
            Self::Halves { .. } => &["A", "B"],
        }
    }
}

/// What a reference may grow by, and what decides how far.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GrowthWork {
    /// Ids of all batches of each half, the first among them, a power of two of them.
    pub batches: [Vec<String>; 2],
    /// Ids of the images whose errors the reference has to judge.
    pub pilots: Vec<String>,
}

/// One reference.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReferenceWork {
    /// Scene name.
    pub scene: String,
    /// Image size.
    pub size: Size,
    /// What it is made of.
    pub source: ReferenceSource,
}

/// All replicates of one sampler at one spp.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EnsembleWork {
    /// Scene name.
    pub scene: String,
    /// Sampler in canonical form.
    pub sampler: String,
    /// Samples per pixel.
    pub spp: Count,
    /// Image size.
    pub size: Size,
    /// Light estimator.
    pub estimator: Estimator,
    /// How the images are made.
    pub variant: Variant,
    /// Id of the reference.
    pub reference_id: String,
    /// Ids of the replicates.
    pub members: Vec<String>,
}

/// Metrics of one point set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PointsWork {
    /// Sampler in canonical form.
    pub sampler: String,
    /// Number of points.
    pub n: Count,
    /// Replicate.
    pub replicate: u32,
    /// Seed of the randomisation.
    pub seed: u64,
    /// Names of the metrics.
    pub metrics: Vec<String>,
}

/// Variances of single pixels under one sampler at one count.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PredictionWork {
    /// Scene name.
    pub scene: String,
    /// Sampler in canonical form.
    pub sampler: String,
    /// Samples per pixel.
    pub spp: Count,
    /// What all randomisations are derived from.
    pub seed: u64,
    /// Image size.
    pub size: Size,
    /// Columns and rows.
    pub pixels: Vec<[u32; 2]>,
    /// Randomisations to measure.
    pub seeds: u32,
}

/// What an item does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Work {
    /// Renders one image, and compares it where it has a reference.
    Image(ImageWork),
    /// Makes one reference of its halves, or by a closed form.
    Reference(ReferenceWork),
    /// Measures replicates together.
    Ensemble(EnsembleWork),
    /// Measures one point set.
    Points(PointsWork),
    /// Predicts and measures variances of pixels.
    Prediction(PredictionWork),
}

/// One item of a plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WorkItem {
    /// Hash of everything that the result depends on.
    pub id: String,
    /// Algorithm number of the metrics at planning time.
    pub metrics_algorithm: u32,
    /// Whether a report shows the item's image itself, not only numbers about it.
    pub is_shown: bool,
    /// What else its result depends on: the scene's content and the algorithm numbers.
    pub made_with: MadeWith,
    /// What to do.
    pub work: Work,
}

impl WorkItem {
    /// The sort of item.
    pub fn kind(&self) -> Kind {
        match &self.work {
            Work::Image(work) => work.kind,
            Work::Reference(_) => Kind::Reference,
            Work::Ensemble(_) => Kind::Ensemble,
            Work::Points(_) => Kind::Points,
            Work::Prediction(_) => Kind::Prediction,
        }
    }

    /// The sampler compared or used; none for a closed form.
    pub fn sampler(&self) -> Option<&str> {
        match &self.work {
            Work::Image(work) => Some(&work.sampler),
            Work::Ensemble(work) => Some(&work.sampler),
            Work::Points(work) => Some(&work.sampler),
            Work::Prediction(work) => Some(&work.sampler),
            Work::Reference(ReferenceWork { source: ReferenceSource::Halves { sampler, .. }, .. }) => Some(sampler),
            Work::Reference(_) => None,
        }
    }

    /// The seed, where the item draws anything.
    pub fn seed(&self) -> Option<u64> {
        match &self.work {
            Work::Image(work) => Some(work.seed),
            Work::Points(work) => Some(work.seed),
            Work::Prediction(work) => Some(work.seed),
            Work::Reference(_) | Work::Ensemble(_) => None,
        }
    }

    /// Samples to render.
    pub fn samples(&self) -> u64 {
        match &self.work {
            Work::Image(work) => work.samples(),
            _ => 0,
        }
    }

    /// For an item that is done only where a growing reference wants it: which batch of which reference it is.
    pub fn batch(&self) -> Option<&Batch> {
        match &self.work {
            Work::Image(work) => work.batch.as_ref(),
            _ => None,
        }
    }

    /// Pairs of points to look at: the metrics take a time that grows with n².
    pub fn pairs(&self) -> u64 {
        match &self.work {
            Work::Points(work) => u64::from(work.n.taken).pow(2) * work.metrics.len() as u64,
            _ => 0,
        }
    }

    /// Size of the image that the item keeps on disk.
    pub fn kept_image(&self) -> Option<Size> {
        match &self.work {
            Work::Image(work) => Some(work.size),
            Work::Reference(ReferenceWork { source: ReferenceSource::Exact, size, .. }) => Some(*size),
            _ => None,
        }
    }

    /// The item in a few words, for progress and messages.
    pub fn label(&self) -> String {
        match &self.work {
            Work::Image(work) => {
                let what = match work.kind {
                    Kind::ReferenceHalf => match &work.batch {
                        None => format!("reference half {}", work.replicate),
                        Some(batch) => format!("reference half {} batch {}", work.replicate, batch.number),
                    },
                    Kind::Picture => "picture".to_owned(),
                    Kind::Stage => format!("stage {}", work.stage.name()),
                    _ => format!("replicate {}", work.replicate),
                };
                let way = way(work.estimator, work.variant);
                format!("{} {} {} spp {} {what}{way}", work.scene, work.sampler, work.spp.asked, work.size)
            }
            Work::Reference(work) => format!("{} {} reference", work.scene, work.size),
            Work::Ensemble(work) => {
                let way = way(work.estimator, work.variant);
                format!("{} {} {} spp ensemble{way}", work.scene, work.sampler, work.spp.asked)
            }
            Work::Prediction(work) => format!("{} {} {} spp prediction", work.scene, work.sampler, work.spp.asked),
            Work::Points(work) => format!("{} {} points replicate {}", work.sampler, work.n.asked, work.replicate),
        }
    }
}

/// What is not plain about the making of an image, in words.
fn way(estimator: Estimator, variant: Variant) -> String {
    let shortcut = if estimator == Estimator::Sheet { ", sheet's estimator" } else { "" };
    let variant = if variant.is_plain() { String::new() } else { format!(", {variant}") };
    format!("{shortcut}{variant}")
}

//! From rows to what a report says of them: one cell for each scene, sampler and count, slopes, point sets, timings.
//!
//! Pure: the same rows give the same summary. What the experiment asks for and the rows do not hold is counted in
//! [`Summary::missing`], never guessed.

mod others;
mod samplers;
mod variants;

use std::collections::HashMap;

use crate::experiment::results::{
    About, Count, EnsembleRow, ErrorSpectrum, Estimator, ImageRow, Kind, PointsRow, PredictionRow, ReferenceRow, Row,
    Timing, TwinDifference, Variant, is_enough,
};
use crate::experiment::spec::Experiment;
use crate::sampling::{Decision, Points, Preset};
use crate::stats::{Estimate, SlopeFit};

use super::evidence::{Course, clearly_above_one, ratio, ratio_of_roots};
use super::shots::PictureSet;
pub use samplers::SamplerSummary;
pub use variants::Subject;

/// Counts that a slope of RMSE is fitted over: powers of two from 4 to 256 that the sampler takes as asked.
pub const SLOPE_COUNTS: std::ops::RangeInclusive<u32> = 4..=256;

/// Smallest set that a slope of the star discrepancy is fitted over.
pub const SLOPE_POINTS: u32 = 16;

/// The share of an RMSE that the reference's own may be, where the experiment states none: beyond it the error is
/// reference-limited. At half, a plain comparison with the reference would show a mean square error 25 % too large.
pub const REFERENCE_SHARE: f64 = 0.5;

/// Everything that a report says, as numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// What was run.
    pub about: About,
    /// Its scenes, in its order.
    pub scenes: Vec<SceneSummary>,
    /// Its samplers, each once, in the order in which they first occur.
    pub samplers: Vec<SamplerSummary>,
    /// By scene, sampler and count, in the experiment's order.
    pub cells: Vec<Cell>,
    /// By scene and sampler.
    pub slopes: Vec<Slope>,
    /// By scene and sampler, where stability is asked about.
    pub stability: Vec<Subject>,
    /// The sheet's shortcut, by scene, sampler and count, where it is asked for beside the unbiased estimator.
    pub shortcut: Vec<Cell>,
    /// By sampler and number of points.
    pub point_sets: Vec<PointSet>,
    /// Pictures to look at, by scene.
    pub pictured: Vec<PictureSet>,
    /// Times, where any were taken.
    pub speeds: Vec<Speed>,
    /// Sets that are not compared in a scene: scene, sampler, and the sampler that means the same there.
    pub left_out: Vec<(usize, usize, usize)>,
    /// Variances of pixels, predicted and measured.
    pub predictions: Vec<PredictionRow>,
    /// What is not there, in words.
    pub missing: Vec<String>,
}

/// A scene and what its images are compared with.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneSummary {
    /// Its name.
    pub name: String,
    /// Its decisions and the dimensions they read, in words.
    pub layout: String,
    /// Its decisions, in order.
    pub decisions: Vec<Decision>,
    /// Whether there is a lens to sample.
    pub lens: bool,
    /// Number of its lights, where it was recorded.
    pub lights: Option<u32>,
    /// Whether its reference is a closed form.
    pub has_closed_form: bool,
    /// Size of the compared images, `WxH`.
    pub size: String,
    /// Their number of pixels.
    pub pixels: u64,
    /// Its reference; `None` where that row is missing.
    pub reference: Option<ReferenceRow>,
}

impl SceneSummary {
    /// RMSE of the reference itself, in radiance; 0 for a closed form.
    pub fn reference_rmse(&self) -> Option<f64> {
        self.reference.as_ref().map(|reference| reference.noise_mse.max(0.0).sqrt())
    }
}

/// One scene, sampler and count: what the replicates say together.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Index of the scene.
    pub scene: usize,
    /// Index of the sampler.
    pub sampler: usize,
    /// Id of the ensemble's row.
    pub id: String,
    /// Samples per pixel.
    pub spp: Count,
    /// Number of replicates.
    pub replicates: u32,
    /// Whether one replicate is all there is, so that the error has no variance.
    pub is_fixed: bool,
    /// Whether the reference's own RMSE is more than [`Summary::reference_share`] of this one.
    pub is_reference_limited: bool,
    /// Unbiased mean square error.
    pub mse: Estimate,
    /// Its root; `None` where the estimate of the square is below 0.
    pub rmse: Option<Estimate>,
    /// Relative mean square error.
    pub rel_mse: Estimate,
    /// Squared bias.
    pub bias2: Estimate,
    /// Variance between replicates.
    pub variance: Option<Estimate>,
    /// Mean signed error.
    pub bias: Estimate,
    /// Correlation of the error between neighbouring pixels.
    pub error_autocorrelation: Option<Estimate>,
    /// Mean FLIP of the replicates: how different they look, no estimate of the errors above.
    pub flip: Option<Estimate>,
    /// Power of the error images by frequency.
    pub error_spectrum: Option<ErrorSpectrum>,
    /// Unbiased mean square error of each replicate whose row is there.
    pub replicate_mse: Vec<f64>,
    /// Mean radiance of each replicate whose row is there.
    pub replicate_mean: Vec<f64>,
    /// Digest of each replicate's pixels.
    pub pixels: Vec<String>,
    /// What differs between each replicate and its twin, where it is another making of an image.
    pub twins: Vec<TwinDifference>,
}

impl Cell {
    /// Share of bias² in the MSE; `None` where the MSE is not above 0.
    pub fn bias_share(&self) -> Option<f64> {
        (self.mse.value > 0.0).then(|| self.bias2.value / self.mse.value)
    }
}

/// How fast the RMSE of one sampler falls in one scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Slope {
    /// Index of the scene.
    pub scene: usize,
    /// Index of the sampler.
    pub sampler: usize,
    /// Counts that were fitted over: none that is reference-limited.
    pub counts: Vec<u32>,
    /// The fit; `None` where fewer than two counts have an error above 0.
    pub fit: Option<SlopeFit>,
}

/// One metric of a sampler's point sets of one size.
#[derive(Debug, Clone, PartialEq)]
pub struct PointSet {
    /// Index of the sampler.
    pub sampler: usize,
    /// Number of points.
    pub n: Count,
    /// Name of the metric.
    pub metric: String,
    /// Mean over replicates; `None` where the metric is not defined for all of them.
    pub mean: Option<Estimate>,
    /// Value of each replicate.
    pub values: Vec<Option<f64>>,
    /// Id of the first replicate's row.
    pub id: String,
}

/// Seconds that the images of a cell take.
#[derive(Debug, Clone, PartialEq)]
pub struct Speed {
    /// Index of the scene.
    pub scene: usize,
    /// Index of the sampler.
    pub sampler: usize,
    /// Samples per pixel.
    pub spp: Count,
    /// Median with its interval ([`median_interval`](crate::stats::median_interval)): of the rounds where there are any, else of
    /// the replicates, each of which was timed as it was made.
    pub seconds: Estimate,
    /// How many timings it is the median of.
    pub timings: usize,
    /// Whether these are rounds.
    pub is_in_rounds: bool,
    /// Threads that worked, most of all timings.
    pub threads: usize,
    /// Share of the seconds that drawing the random numbers alone takes, 0 to 1, median over rounds with its interval.
    pub sampling: Option<Estimate>,
}

impl Summary {
    /// The cell of a scene, a sampler and a count asked for.
    pub fn cell(&self, scene: usize, sampler: usize, asked: u32) -> Option<&Cell> {
        self.cells.iter().find(|c| c.scene == scene && c.sampler == sampler && c.spp.asked == asked)
    }

    /// The share of an RMSE that the reference's own may be: the experiment's, else [`REFERENCE_SHARE`].
    pub fn reference_share(&self) -> f64 {
        reference_share(&self.about.experiment)
    }

    /// The cells of a scene and a sampler by ascending count.
    pub fn cells_of(&self, scene: usize, sampler: usize) -> Vec<&Cell> {
        let mut cells: Vec<&Cell> = self.cells.iter().filter(|c| c.scene == scene && c.sampler == sampler).collect();
        cells.sort_by_key(|cell| cell.spp.taken);
        cells
    }

    /// The sampler that means the same in a scene as `sampler`, which was left out there for that reason.
    pub fn same_as(&self, scene: usize, sampler: usize) -> Option<usize> {
        self.left_out.iter().find(|(s, out, _)| (*s, *out) == (scene, sampler)).map(|(.., same_as)| *same_as)
    }

    /// The samplers that are compared in a scene.
    pub fn compared(&self, scene: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.samplers.len()).filter(move |&sampler| self.same_as(scene, sampler).is_none())
    }

    /// The slope of a scene and a sampler.
    pub fn slope(&self, scene: usize, sampler: usize) -> Option<&Slope> {
        self.slopes.iter().find(|s| s.scene == scene && s.sampler == sampler)
    }

    /// The pictures whose stages are the sheet's Figure 1: the first with all four, else the first.
    pub fn figure_1(&self) -> Option<&PictureSet> {
        let complete = |set: &&PictureSet| set.has_lens && set.has_lights;
        self.pictured.iter().find(complete).or(self.pictured.first())
    }

    /// The times of a cell.
    pub fn speed(&self, cell: &Cell) -> Option<&Speed> {
        let same = |s: &&Speed| s.scene == cell.scene && s.sampler == cell.sampler && s.spp == cell.spp;
        self.speeds.iter().find(same)
    }

    /// The index of the sampler that `preset` of `points` stands for.
    pub fn preset(&self, points: Points, preset: Preset) -> Option<usize> {
        let canonical = preset.of(points)?.to_string();
        self.samplers.iter().position(|sampler| sampler.canonical == canonical)
    }

    /// The index of uniform sampling, what all others are measured against.
    pub fn uniform(&self) -> Option<usize> {
        self.preset(Points::Uniform, Preset::Best)
    }

    /// The families of which both the literal reading (`:sheet`) and its cure (`:best`) were run, where they differ.
    pub fn literal_pairs(&self) -> Vec<(usize, usize)> {
        let pair = |&points: &Points| Some((self.preset(points, Preset::Sheet)?, self.preset(points, Preset::Best)?));
        Points::ALL.iter().filter_map(pair).filter(|(sheet, best)| sheet != best).collect()
    }

    /// The most samples per pixel that were asked for.
    pub fn most_spp(&self) -> Option<u32> {
        self.about.experiment.spp.iter().copied().max()
    }

    /// The count near the middle of a comparison: the largest one of at most 64, else the smallest.
    pub fn middle_spp(&self) -> Option<u32> {
        let spp = &self.about.experiment.spp;
        spp.iter().copied().filter(|&n| n <= 64).max().or(spp.iter().copied().min())
    }

    /// The counts between which the course of an error is judged: the most, and the smallest power of two above 1 that
    /// is at least a sixteenth of it.
    pub fn course_counts(&self) -> Option<(u32, u32)> {
        let most = self.most_spp()?;
        let from = self.about.experiment.spp.iter().copied();
        let from = from.filter(|&n| n > 1 && n < most && n.is_power_of_two() && n >= most / 16).min()?;
        Some((from, most))
    }

    /// Where the error of a sampler goes between the [`course_counts`](Self::course_counts).
    pub fn course(&self, scene: usize, sampler: usize) -> Option<Course> {
        let (from, to) = self.course_counts()?;
        course(self.cell(scene, sampler, from)?, self.cell(scene, sampler, to)?)
    }

    /// The last step of a sampler's error: between its two largest powers of two.
    pub fn last_step(&self, scene: usize, sampler: usize) -> Option<Step> {
        let mut cells = self.cells_of(scene, sampler);
        cells.retain(|cell| cell.spp.taken.is_power_of_two());
        let [.., from, to] = cells[..] else { return None };
        let rmse_ratio = ratio_of_roots(&to.mse, &from.mse)?;
        (from.spp.taken < to.spp.taken).then_some(Step { from: from.spp.taken, to: to.spp.taken, rmse_ratio })
    }

    /// The sheet's shortcut in a scene, by a sampler, with a count asked for.
    pub fn shortcut_cell(&self, scene: usize, sampler: usize, asked: u32) -> Option<&Cell> {
        self.shortcut.iter().find(|c| c.scene == scene && c.sampler == sampler && c.spp.asked == asked)
    }

    /// Where the error of the sheet's shortcut goes between the [`course_counts`](Self::course_counts).
    pub fn shortcut_course(&self, scene: usize, sampler: usize) -> Option<Course> {
        let (from, to) = self.course_counts()?;
        course(self.shortcut_cell(scene, sampler, from)?, self.shortcut_cell(scene, sampler, to)?)
    }
}

/// One step of an error from a count to a higher one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// The lower count of samples per pixel.
    pub from: u32,
    /// The higher one.
    pub to: u32,
    /// RMSE at the higher count over RMSE at the lower one.
    pub rmse_ratio: Estimate,
}

impl Step {
    /// Local slope: ln of the ratio over ln(to/from), with its interval.
    pub fn slope(&self) -> Estimate {
        let log = libm::log(f64::from(self.to) / f64::from(self.from));
        let slope = |ratio: f64| libm::log(ratio) / log;
        Estimate { value: slope(self.rmse_ratio.value), ci95: self.rmse_ratio.ci95.map(|ends| ends.map(slope)) }
    }

    /// Whether the error falls less than that of independent samples would: the ratio over √(from/to) is
    /// [`clearly_above_one`].
    pub fn is_flatter_than_independent(&self) -> bool {
        let independent = (f64::from(self.from) / f64::from(self.to)).sqrt();
        let Estimate { value, ci95 } = self.rmse_ratio;
        let over = |x: f64| x / independent;
        clearly_above_one(&Estimate { value: over(value), ci95: ci95.map(|ends| ends.map(over)) })
    }
}

/// Where an error goes from one count to a higher one.
fn course(from: &Cell, to: &Cell) -> Option<Course> {
    Some(Course {
        rmse_ratio: ratio_of_roots(&to.mse, &from.mse)?,
        independent: (f64::from(from.spp.taken) / f64::from(to.spp.taken)).sqrt(),
        bias2: to.bias2,
        bias2_ratio: ratio(&to.bias2, &from.bias2),
        variance_ratio: from.variance.zip(to.variance).and_then(|(from, to)| ratio(&to, &from)),
    })
}

/// Gathers what the rows say of the experiment in `about`.
///
/// Of rows that stand for the same thing the last one counts. Timings are kept apart: nothing but
/// [`Summary::speeds`] comes from them.
pub fn summarise(rows: &[Row], timings: &[Timing], about: &About) -> Summary {
    let index = Index::new(rows, &about.experiment);
    let samplers = samplers::of(&about.experiment);
    let mut summary = Summary {
        about: about.clone(),
        scenes: (0..about.scenes.len()).map(|i| index.scene(about, i)).collect(),
        samplers,
        cells: Vec::new(),
        slopes: Vec::new(),
        stability: Vec::new(),
        shortcut: Vec::new(),
        point_sets: Vec::new(),
        pictured: Vec::new(),
        speeds: Vec::new(),
        left_out: Vec::new(),
        predictions: Vec::new(),
        missing: Vec::new(),
    };
    summary.left_out = left_out(&summary, about);
    index.add_cells(&mut summary);
    others::add_slopes(&mut summary);
    index.add_stability(&mut summary);
    index.add_shortcut(&mut summary);
    index.add_points(&mut summary);
    index.add_pictures(&mut summary, timings);
    index.add_speeds(&mut summary, timings);
    index.add_predictions(&mut summary);
    summary
}

fn reference_share(experiment: &Experiment) -> f64 {
    experiment.reference.noise.unwrap_or(REFERENCE_SHARE)
}

/// What the plan left out, by index.
fn left_out(summary: &Summary, about: &About) -> Vec<(usize, usize, usize)> {
    let scene = |name: &str| summary.scenes.iter().position(|scene| scene.name == name);
    let sampler = |canonical: &str| summary.samplers.iter().position(|sampler| sampler.canonical == canonical);
    let indices = about.left_out.iter().map(|l| Some((scene(&l.scene)?, sampler(&l.sampler)?, sampler(&l.same_as)?)));
    indices.flatten().collect()
}

/// Scene, sampler, count asked for, estimator and variant.
type EnsembleKey<'a> = (&'a str, &'a str, u32, &'static str, Variant);

/// Rows by what they stand for.
struct Index<'a> {
    images: HashMap<&'a str, &'a ImageRow>,
    references: HashMap<&'a str, &'a ReferenceRow>,
    ensembles: HashMap<EnsembleKey<'a>, &'a EnsembleRow>,
    /// The estimator that samplers are compared with.
    primary: Estimator,
    /// [`Summary::reference_share`].
    share: f64,
    points: HashMap<(&'a str, u32), Vec<&'a PointsRow>>,
    predictions: Vec<&'a PredictionRow>,
    pictures: Vec<&'a ImageRow>,
    stages: Vec<&'a ImageRow>,
}

impl<'a> Index<'a> {
    fn new(rows: &'a [Row], experiment: &Experiment) -> Self {
        let mut index = Self {
            images: HashMap::new(),
            references: HashMap::new(),
            ensembles: HashMap::new(),
            primary: experiment.estimator.primary(),
            share: reference_share(experiment),
            points: HashMap::new(),
            predictions: Vec::new(),
            pictures: Vec::new(),
            stages: Vec::new(),
        };
        for row in rows {
            match row {
                Row::Reference(row) => drop(index.references.insert(&row.id, row)),
                Row::Ensemble(row) => {
                    let key =
                        (row.scene.as_str(), row.sampler.as_str(), row.spp.asked, row.estimator.name(), row.variant);
                    index.ensembles.insert(key, row);
                }
                Row::Points(row) => {
                    let sets = index.points.entry((&row.sampler, row.n.asked)).or_default();
                    sets.retain(|other| other.replicate != row.replicate);
                    sets.push(row);
                }
                Row::Prediction(row) => index.predictions.push(row),
                Row::Image(row) => {
                    index.images.insert(&row.id, row);
                    match row.kind {
                        Kind::Picture => index.pictures.push(row),
                        Kind::Stage => index.stages.push(row),
                        _ => {}
                    }
                }
            }
        }
        index.points.values_mut().for_each(|sets| sets.sort_by_key(|row| row.replicate));
        index
    }

    /// The ensemble that samplers are compared by.
    fn plain(&self, s: &SceneSummary, p: &SamplerSummary, asked: u32) -> Option<&'a EnsembleRow> {
        self.ensemble(s, p, asked, self.primary, Variant::Plain)
    }

    fn ensemble(
        &self,
        s: &SceneSummary,
        p: &SamplerSummary,
        asked: u32,
        estimator: Estimator,
        variant: Variant,
    ) -> Option<&'a EnsembleRow> {
        self.ensembles.get(&(s.name.as_str(), p.canonical.as_str(), asked, estimator.name(), variant)).copied()
    }

    /// Scene `i` with the reference that its ensembles were compared with.
    fn scene(&self, about: &About, i: usize) -> SceneSummary {
        let facts = &about.scenes[i];
        let size = about.experiment.scenes.get(i).map_or(facts.size, |name| about.experiment.size.of(name, facts.size));
        let used = self.ensembles.values().find(|row| row.scene == facts.name && row.size == size);
        let by_id = used.and_then(|row| self.references.get(row.reference_id.as_str()).copied());
        let mut by_size: Vec<_> =
            self.references.values().filter(|row| row.scene == facts.name && row.size == size).copied().collect();
        by_size.sort_by(|a, b| a.id.cmp(&b.id));
        SceneSummary {
            name: facts.name.clone(),
            layout: facts.layout.clone(),
            decisions: facts.decisions(),
            lens: facts.lens,
            lights: facts.lights,
            has_closed_form: facts.exact_reference,
            size: size.to_string(),
            pixels: size.pixels(),
            reference: by_id.or(by_size.first().copied()).cloned(),
        }
    }

    /// Predictions, those that are exact first; the others are missing.
    fn add_predictions(&self, summary: &mut Summary) {
        let Some(asked_for) = &summary.about.experiment.prediction else { return };
        let planned = asked_for.samplers.len() * asked_for.spp.len();
        let mut found: Vec<PredictionRow> = self.predictions.iter().map(|&row| row.clone()).collect();
        found.sort_by_key(|row| (!row.is_stationary, row.sampler.clone(), row.spp.asked));
        found.dedup_by(|a, b| a.id == b.id);
        if found.len() < planned {
            summary.missing.push(format!("{} of {planned} predicted variances", planned - found.len()));
        }
        summary.predictions = found;
    }

    /// One cell for each ensemble that is there; the others are missing.
    fn add_cells(&self, summary: &mut Summary) {
        let (mut missing, mut first) = (0, None);
        for scene in 0..summary.scenes.len() {
            for sampler in summary.compared(scene).collect::<Vec<_>>() {
                for &asked in &summary.about.experiment.spp {
                    let (s, p) = (&summary.scenes[scene], &summary.samplers[sampler]);
                    match self.plain(s, p, asked) {
                        Some(row) => summary.cells.push(self.cell(row, scene, sampler, s, p)),
                        None => {
                            missing += 1;
                            first.get_or_insert_with(|| format!("{}, {}, {asked} spp", s.name, p.label));
                        }
                    }
                }
            }
        }
        let of = summary.cells.len() + missing;
        let references = summary.scenes.iter().filter(|scene| scene.reference.is_none());
        summary.missing.extend(references.map(|scene| format!("the reference of {}", scene.name)));
        if let Some(first) = first {
            let what = format!("{missing} of {of} comparisons of a sampler with its reference (the first: {first})");
            summary.missing.push(what);
        }
        let members = self.ensembles.values().flat_map(|row| &row.members);
        let lost = members.filter(|id| !self.images.contains_key(id.as_str())).count();
        if lost > 0 {
            summary.missing.push(format!("{lost} rows of single replicates"));
        }
    }

    fn cell(&self, row: &EnsembleRow, scene: usize, sampler: usize, s: &SceneSummary, p: &SamplerSummary) -> Cell {
        let members: Vec<&ImageRow> =
            row.members.iter().filter_map(|id| self.images.get(id.as_str()).copied()).collect();
        let is_fixed = row.replicates == 1 && is_fixed(p, s);
        let is_exact = is_fixed && s.has_closed_form;
        let noise = s.reference.as_ref().map(|reference| reference.noise_mse);
        // A single image of a random sampler: the row's interval holds the reference's noise alone, not its own.
        let known = |e: Estimate| match (row.replicates, is_exact) {
            (1, true) => Estimate { ci95: e.ci95.or(Some([e.value; 2])), ..e },
            (1, false) if !is_fixed => Estimate::without_interval(e.value),
            _ => e,
        };
        Cell {
            scene,
            sampler,
            id: row.id.clone(),
            spp: row.spp,
            replicates: row.replicates,
            is_fixed,
            is_reference_limited: noise.is_some_and(|noise| !is_enough(noise, row.mse.value, self.share)),
            mse: known(row.mse),
            rmse: row.rmse.map(known),
            rel_mse: known(row.rel_mse),
            bias2: known(row.bias2),
            variance: row.variance,
            bias: known(row.bias),
            // One image's correlation has no spread over replicates; of a fixed sampler it is all there is.
            error_autocorrelation: row.error_autocorrelation,
            flip: row.flip,
            error_spectrum: row.error_spectrum.as_deref().cloned(),
            replicate_mse: members.iter().filter_map(|m| m.errors.as_ref()).map(|e| e.mse_unbiased).collect(),
            replicate_mean: members.iter().map(|m| m.mean).collect(),
            pixels: members.iter().map(|m| m.pixels.clone()).collect(),
            twins: members.iter().filter_map(|m| m.twin.clone()).collect(),
        }
    }
}

/// Whether another seed gives the same image of the scene.
fn is_fixed(sampler: &SamplerSummary, scene: &SceneSummary) -> bool {
    sampler.set.is_some_and(|set| !set.is_random_for(&scene.decisions))
}

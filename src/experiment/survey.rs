//! What is done, what is left, and what that will cost: read from an output folder without changing it.

use std::collections::{HashMap, HashSet};
use std::fmt;
use std::ops::Range;
use std::path::Path;

use super::backend::Size;
use super::images;
use super::lines::{Sound, lines_if_any, sound_lines};
use super::plan::{Batch, Plan, ReferenceSource, Work, WorkItem};
use super::results::{self, Kind, Row, Timing};
use crate::error::{Error, Result};

/// Samples per second and thread that are expected where nothing was timed yet.
pub const STATED_RATE: f64 = 2e6;

/// Pairs of points that are looked at in the time of one sample.
pub(super) const PAIRS_A_SAMPLE: u32 = 100;

/// Pairs of points per second for point-set metrics.
const PAIR_RATE: f64 = STATED_RATE * PAIRS_A_SAMPLE as f64;

/// Bytes that the program takes before it opens anything: code, threads, rows.
const PROGRAM_BYTES: u64 = 32 << 20;

/// Bytes of an image: three `f32` a pixel.
const BYTES_A_PIXEL: u64 = 12;

/// Bytes of work beside the images held: f64 sums of a film and of an ensemble.
const WORK_BYTES_A_PIXEL: u64 = 64;

/// The same while a reference grows: f64 sums of two halves, mean and spread of all batches, and the halves as images.
const GROWTH_BYTES_A_PIXEL: u64 = 4 * 24 + 3 * 12;

/// Bytes on disk beside the pixels: header of an EXR, lines of rows and timings.
const BYTES_AN_ITEM: u64 = 3 << 10;

/// How far an item is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Row and, where it is shown, image are there.
    Done,
    /// The row is there; the image, which a report shows, is not.
    ImageMissing,
    /// No row, or one that was measured another way.
    Missing,
    /// A further batch of a reference that grows, which that reference does not want, or is not yet known to.
    Optional,
}

/// What an output folder holds of a plan.
#[derive(Debug)]
pub struct Standing {
    /// Rows by id, those of other plans among them.
    pub rows: HashMap<String, Row>,
    /// All rows in the order of the file.
    pub(super) in_file: Vec<Row>,
    /// Timings by id; the last of an item counts.
    pub timings: HashMap<String, Timing>,
    /// State of each of the plan's items.
    pub states: Vec<State>,
    /// Places of lines of timings that do not read, and why: seconds are lost with them, no result.
    pub(super) unsound_timings: Vec<String>,
    /// Whether both files are exactly their whole lines.
    pub(super) is_clean: bool,
}

impl Standing {
    /// Nothing done, whatever a folder holds.
    pub fn nothing(plan: &Plan) -> Self {
        let state = |item: &WorkItem| if item.batch().is_some() { State::Optional } else { State::Missing };
        let states = plan.items.iter().map(state).collect();
        Self {
            rows: HashMap::new(),
            in_file: Vec::new(),
            timings: HashMap::new(),
            states,
            unsound_timings: Vec::new(),
            is_clean: true,
        }
    }

    /// Reads an output folder; one that is not there has nothing done.
    ///
    /// # Errors
    /// Kind `Input` where a line other than a torn last one does not read.
    pub fn read(plan: &Plan, out: &Path) -> Result<Self> {
        let (in_file, rows_clean) = lines_if_any(&results::results_path(out), Row::parse)?;
        let Sound { values: timings, unsound: unsound_timings, is_clean: timings_clean } =
            sound_lines(&results::timings_path(out), results::parse_timing)?;
        let rows: HashMap<String, Row> = in_file.iter().map(|row| (row.id().to_owned(), row.clone())).collect();
        let wanted = |batch: &Batch| batches(plan, &rows, &batch.reference_id).is_some_and(|n| batch.number < n);
        let state = |item: &WorkItem| match item.batch() {
            Some(batch) if !wanted(batch) => State::Optional,
            _ => state(item, rows.get(&item.id), out),
        };
        let states = plan.items.iter().map(state).collect();
        let timings = timings.into_iter().map(|timing| (timing.id.clone(), timing)).collect();
        Ok(Self { rows, in_file, timings, states, unsound_timings, is_clean: rows_clean && timings_clean })
    }
}

/// How many batches each half of a growing reference has, where a row that holds says so.
pub(super) fn batches(plan: &Plan, rows: &HashMap<String, Row>, reference_id: &str) -> Option<u32> {
    let item = &plan.items[plan.position(reference_id)?];
    match rows.get(reference_id).filter(|row| is_result_of(row, item))? {
        Row::Reference(row) => row.growth.as_ref().map(|growth| growth.batches),
        _ => None,
    }
}

/// Whether an item is a batch that its reference, whose row is there, does without.
pub(super) fn is_unwanted(plan: &Plan, rows: &HashMap<String, Row>, item: &WorkItem) -> bool {
    let known = |batch: &Batch| batches(plan, rows, &batch.reference_id).is_some_and(|known| batch.number >= known);
    item.batch().is_some_and(known)
}

/// The state of one item that is wanted.
pub(super) fn state(item: &WorkItem, row: Option<&Row>, out: &Path) -> State {
    let Some(row) = row.filter(|row| is_result_of(row, item)) else { return State::Missing };
    match item.kept_image() {
        Some(size) if item.is_shown && images::stored(out, &item.id, size, row.kept_pixels()).is_none() => {
            State::ImageMissing
        }
        _ => State::Done,
    }
}

/// Whether a row holds what the item would find: the id vouches for the pixels, the rest is compared here.
pub(super) fn is_result_of(row: &Row, item: &WorkItem) -> bool {
    let metrics = item.metrics_algorithm;
    let is_measured_so = match (row, &item.work) {
        (Row::Image(row), Work::Image(work)) => {
            let errors = row.errors.as_ref();
            errors.map(|errors| &errors.reference_id) == work.reference_id.as_ref()
                && row.twin.as_ref().map(|twin| &twin.id) == work.twin.as_ref()
                && errors.is_none_or(|errors| errors.metrics_algorithm == metrics)
        }
        (Row::Reference(row), Work::Reference(_)) => row.metrics_algorithm == metrics,
        (Row::Ensemble(row), Work::Ensemble(_)) => row.metrics_algorithm == metrics,
        (Row::Points(row), Work::Points(_)) => row.metrics_algorithm == metrics,
        (Row::Prediction(_), Work::Prediction(_)) => true,
        _ => false,
    };
    is_measured_so && altered(row, item).is_none()
}

/// The first field in which a row says something else of itself than the item, whose id it has, is: nobody wrote it so.
pub(super) fn altered(row: &Row, item: &WorkItem) -> Option<&'static str> {
    let fields: Vec<(&'static str, bool)> = match (row, &item.work) {
        (Row::Image(row), Work::Image(work)) => vec![
            ("kind", row.kind == work.kind),
            ("scene", row.scene == work.scene),
            ("sampler", row.sampler == work.sampler),
            ("spp", row.spp == work.spp),
            ("replicate", row.replicate == work.replicate),
            ("batch", row.batch == work.batch.as_ref().map_or(0, |batch| batch.number)),
            ("seed", row.seed == work.seed),
            ("estimator", row.estimator == work.estimator),
            ("stage", row.stage == work.stage),
            ("variant", row.variant == work.variant),
            ("size", row.size == work.size),
        ],
        (Row::Reference(row), Work::Reference(work)) => {
            let (sampler, spp, halves) = match &work.source {
                ReferenceSource::Exact => ("exact", None, None),
                ReferenceSource::Halves { ids, sampler, spp, .. } => (sampler.as_str(), Some(*spp), Some(ids)),
            };
            vec![
                ("scene", row.scene == work.scene),
                ("size", row.size == work.size),
                ("sampler", row.sampler == sampler),
                ("spp", row.spp == spp),
                ("halves", row.halves.as_ref() == halves),
            ]
        }
        (Row::Ensemble(row), Work::Ensemble(work)) => vec![
            ("scene", row.scene == work.scene),
            ("sampler", row.sampler == work.sampler),
            ("spp", row.spp == work.spp),
            ("estimator", row.estimator == work.estimator),
            ("variant", row.variant == work.variant),
            ("size", row.size == work.size),
            ("reference_id", row.reference_id == work.reference_id),
            ("replicates", row.replicates as usize == work.members.len()),
            ("members", row.members == work.members),
        ],
        (Row::Points(row), Work::Points(work)) => vec![
            ("sampler", row.sampler == work.sampler),
            ("n", row.n == work.n),
            ("replicate", row.replicate == work.replicate),
            ("seed", row.seed == work.seed),
        ],
        (Row::Prediction(row), Work::Prediction(work)) => vec![
            ("scene", row.scene == work.scene),
            ("sampler", row.sampler == work.sampler),
            ("spp", row.spp == work.spp),
            ("seed", row.seed == work.seed),
            ("size", row.size == work.size),
            ("seeds", row.seeds == work.seeds),
            ("pixels", row.pixels.iter().map(|found| found.pixel).eq(work.pixels.iter().copied())),
        ],
        _ => vec![("kind", false)],
    };
    fields.into_iter().find(|(_, agrees)| !agrees).map(|(name, _)| name)
}

/// What a plan costs from where it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// Items by kind: all, and those left.
    pub items: Vec<(Kind, usize, usize)>,
    /// Samples of all these items, without what references may yet grow by.
    pub samples: u64,
    /// Samples left to render, without what references may yet grow by.
    pub samples_left: u64,
    /// The most samples that references may grow by beyond that.
    pub samples_growth: u64,
    /// Samples of the rounds in which images are timed again, of those left; part of `samples_left`.
    pub samples_timing: u64,
    /// Samples per second expected with the threads given.
    pub rate: f64,
    /// Whether the rate comes from the folder's own timings.
    pub is_rate_measured: bool,
    /// Seconds expected for what is left.
    pub seconds_left: f64,
    /// The most seconds that references may grow by beyond that.
    pub seconds_growth: f64,
    /// Bytes held at the most, scenes among them.
    pub memory_bytes: u64,
    /// Bytes on disk at the end, before compression.
    pub disk_bytes: u64,
}

impl Survey {
    /// Surveys a plan; `threads` will work on it.
    pub fn new(plan: &Plan, standing: &Standing, out: &Path, threads: usize) -> Self {
        Self::of_part(plan, standing, out, threads, 0..plan.items.len())
    }

    /// Surveys the items at `part` of a plan. Memory and disk are those of the whole, which no part exceeds.
    pub fn of_part(plan: &Plan, standing: &Standing, out: &Path, threads: usize, part: Range<usize>) -> Self {
        let is_left = |&position: &usize| !matches!(standing.states[position], State::Done | State::Optional);
        let left: Vec<usize> = part.clone().filter(is_left).collect();
        let samples_growth = samples_growth(plan, standing, out, part.clone());
        let samples_timing = samples_timing(plan, standing, part.clone());
        let samples_left = samples_left(plan, standing, out, &left) + samples_timing;
        let (rate, is_rate_measured) = rate(standing, threads);
        let pairs: u64 = left.iter().map(|&position| plan.items[position].pairs()).sum();
        let kept: Vec<Size> = plan.items.iter().filter_map(WorkItem::kept_image).collect();
        Self {
            items: count_kinds(plan, standing, part.clone(), &left),
            samples: wanted(standing, part).map(|position| plan.items[position].samples()).sum(),
            samples_left,
            samples_growth,
            samples_timing,
            rate,
            is_rate_measured,
            seconds_left: samples_left as f64 / rate + pairs as f64 / PAIR_RATE,
            seconds_growth: samples_growth as f64 / rate,
            memory_bytes: memory_bytes(plan),
            disk_bytes: kept.iter().map(|size| size.pixels() * BYTES_A_PIXEL).sum::<u64>()
                + plan.items.len() as u64 * BYTES_AN_ITEM
                + halves_bytes(plan),
        }
    }

    /// Refuses a plan that needs more than it may have.
    ///
    /// # Errors
    /// Kind `Input` with what is needed and what is allowed.
    pub fn refuse_above(&self, limits: &Limits, place: &str) -> Result<()> {
        let needs = [("memory", self.memory_bytes, limits.memory_bytes), ("disk", self.disk_bytes, limits.disk_bytes)];
        for (what, needed, allowed) in needs {
            if needed > allowed {
                let (needed, allowed) = (bytes(needed), bytes(allowed));
                let what = format!(
                    "expected to need at most {allowed} of {what}, found a need of {needed}; lower size or replicates"
                );
                return Err(Error::input(place, what));
            }
        }
        Ok(())
    }
}

/// What a run may use; more is refused before it starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of memory.
    pub memory_bytes: u64,
    /// Bytes of disk.
    pub disk_bytes: u64,
}

impl Default for Limits {
    /// 4 GiB of memory, 16 GiB of disk.
    fn default() -> Self {
        Self { memory_bytes: 4 << 30, disk_bytes: 16 << 30 }
    }
}

/// Items by kind, in the order in which kinds first occur.
fn count_kinds(plan: &Plan, standing: &Standing, part: Range<usize>, left: &[usize]) -> Vec<(Kind, usize, usize)> {
    let left: HashSet<usize> = left.iter().copied().collect();
    let mut counts: Vec<(Kind, usize, usize)> = Vec::new();
    for position in wanted(standing, part) {
        let item = &plan.items[position];
        let missing = usize::from(left.contains(&position));
        match counts.iter_mut().find(|(kind, ..)| *kind == item.kind()) {
            Some((_, all, of_them)) => {
                *all += 1;
                *of_them += missing;
            }
            None => counts.push((item.kind(), 1, missing)),
        }
    }
    counts
}

/// Positions without the batches that nothing is known to want.
fn wanted(standing: &Standing, part: Range<usize>) -> impl Iterator<Item = usize> {
    part.filter(|&position| standing.states[position] != State::Optional)
}

/// Whether an image is there to be used.
fn is_there(standing: &Standing, out: &Path, id: &str) -> bool {
    standing.timings.contains_key(id) && results::image_path(out, id).exists()
}

/// Samples of the further batches of references of which it is not known how far they grow.
fn samples_growth(plan: &Plan, standing: &Standing, out: &Path, part: Range<usize>) -> u64 {
    let is_open = |batch: &Batch| batches(plan, &standing.rows, &batch.reference_id).is_none();
    let open = plan.items[part].iter().filter(|item| item.batch().is_some_and(is_open));
    open.filter(|item| !is_there(standing, out, &item.id)).map(WorkItem::samples).sum()
}

/// Samples of the rounds that are still to do.
fn samples_timing(plan: &Plan, standing: &Standing, part: Range<usize>) -> u64 {
    let Some(timing) = &plan.experiment.timing else { return 0 };
    let done = |item: &WorkItem| {
        standing.timings.get(&item.id).and_then(|t| t.again.as_ref()).map_or(0, |again| again.seconds.len() as u64)
    };
    let items = plan.items[part].iter().filter(|item| plan.is_timed_again(item));
    items.map(|item| u64::from(timing.rounds).saturating_sub(done(item)) * item.samples()).sum()
}

/// Bytes of the references as images of their own ([`results::reference_path`]).
fn halves_bytes(plan: &Plan) -> u64 {
    let bytes = |item: &WorkItem| match &item.work {
        Work::Reference(work) => {
            work.source.parts().len() as u64 * (work.size.pixels() * BYTES_A_PIXEL + BYTES_AN_ITEM)
        }
        _ => 0,
    };
    plan.items.iter().map(bytes).sum()
}

/// Samples of the images that items left need and that are not on disk; a file that turns out torn costs more.
fn samples_left(plan: &Plan, standing: &Standing, out: &Path, left: &[usize]) -> u64 {
    let needed: HashSet<&str> = left
        .iter()
        .flat_map(|&position| match standing.states[position] {
            State::ImageMissing => vec![plan.items[position].id.as_str()],
            _ => needed_as_grown(plan, standing, position),
        })
        .collect();
    let to_render = needed.into_iter().filter(|id| !is_there(standing, out, id)).filter_map(|id| plan.position(id));
    to_render.map(|position| plan.items[position].samples()).sum()
}

/// Images that an item needs, with the further batches of its reference where it is known how far that grew.
fn needed_as_grown<'a>(plan: &'a Plan, standing: &Standing, position: usize) -> Vec<&'a str> {
    let mut needed = plan.images_needed(position);
    let reference_id = match &plan.items[position].work {
        Work::Image(work) => work.reference_id.as_deref(),
        Work::Ensemble(work) => Some(work.reference_id.as_str()),
        Work::Reference(_) | Work::Points(_) | Work::Prediction(_) => None,
    };
    if let Some(id) = reference_id
        && let Some((growth, known)) = plan.growth(id).zip(batches(plan, &standing.rows, id))
    {
        let halves = growth.batches.iter();
        needed.extend(halves.flat_map(|half| half.iter().take(known as usize).map(String::as_str)));
    }
    needed
}

/// Samples per second with so many threads, from the timings where there are any.
fn rate(standing: &Standing, threads: usize) -> (f64, bool) {
    let samples: u64 = standing.timings.values().map(|timing| timing.samples).sum();
    let thread_seconds: f64 = standing.timings.values().map(|timing| timing.seconds * timing.threads as f64).sum();
    let measured = samples as f64 / thread_seconds;
    let is_measured = samples > 0 && measured.is_finite() && measured > 0.0;
    (if is_measured { measured } else { STATED_RATE } * threads.max(1) as f64, is_measured)
}

/// Bytes at the busiest moment: the program, the images held then, work beside the largest, and all scenes.
fn memory_bytes(plan: &Plan) -> u64 {
    let pixels = |id: &str| plan.position(id).and_then(|at| plan.items[at].kept_image()).map_or(0, Size::pixels);
    let released = plan.released_after();
    let mut held: HashSet<String> = HashSet::new();
    let (mut held_pixels, mut most_pixels) = (0, 0);
    for (position, gone) in released.iter().enumerate() {
        for id in plan.images_needed(position) {
            if held.insert(id.to_owned()) {
                held_pixels += pixels(id);
            }
        }
        most_pixels = most_pixels.max(held_pixels);
        for id in gone {
            held.remove(id);
            held_pixels -= pixels(id);
        }
    }
    let largest = plan.items.iter().filter_map(WorkItem::kept_image).map(Size::pixels).max().unwrap_or(0);
    let scenes: u64 = plan.scenes.iter().map(|scene| scene.memory_bytes).sum();
    let grows = plan.items.iter().any(|item| item.batch().is_some());
    let work = WORK_BYTES_A_PIXEL + if grows { GROWTH_BYTES_A_PIXEL } else { 0 };
    PROGRAM_BYTES + most_pixels * BYTES_A_PIXEL + largest * work + scenes
}

/// Bytes for a reader.
fn bytes(n: u64) -> String {
    match n {
        0..1_000_000 => format!("{:.1} kB", n as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", n as f64 / 1e6),
        _ => format!("{:.1} GB", n as f64 / 1e9),
    }
}

impl fmt::Display for Survey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (kind, all, left) in &self.items {
            writeln!(f, "{:<15}{all:>7} items, {left} to do", results::kind_name(*kind))?;
        }
        writeln!(
            f,
            "samples        {:>10.1} M, {:.1} M to render",
            self.samples as f64 / 1e6,
            self.samples_left as f64 / 1e6
        )?;
        let source = if self.is_rate_measured { "measured here" } else { "stated, nothing timed yet" };
        if self.samples_timing > 0 {
            let samples = self.samples_timing as f64 / 1e6;
            writeln!(f, "timing         {samples:>10.1} M of these in rounds: images made again for their seconds")?;
        }
        if self.samples_growth > 0 {
            let (samples, seconds) = (self.samples_growth as f64 / 1e6, self.seconds_growth);
            writeln!(f, "growth         {samples:>10.1} M, {seconds:.1} s more at most: references that grow")?;
        }
        writeln!(f, "time           {:>10.1} s at {:.2} M samples/s ({source})", self.seconds_left, self.rate / 1e6)?;
        writeln!(f, "memory         {:>12} at most", bytes(self.memory_bytes))?;
        write!(f, "disk           {:>12} at most", bytes(self.disk_bytes))
    }
}

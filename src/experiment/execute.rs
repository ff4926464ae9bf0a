//! Does what a plan still lacks. The only slow stage, and one that may be stopped at any moment.
//!
//! Items run one at a time in plan order, threads work inside an image. A finished item is one line appended to
//! `results.jsonl`; a finished image is on disk before its row is. When the last item is done the rows are written
//! once more, in plan order and in one piece, so the bytes do not depend on how often the run was interrupted.

mod grow;
mod halves;
mod options;
mod rounds;
mod rows;

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use super::backend::{Backend, RenderRequest, Size};
use super::folder::{self, FolderLock, ShardNote};
use super::identity::pixel_hash;
use super::images::Images;
use super::lines::{line, write_lines};
use super::machine;
use super::measure::{self, ReferenceImages};
use super::plan::{Plan, Work, WorkItem};
use super::prediction;
use super::progress::{Meter, Progress};
use super::results::{self, Row, Timing, read_image};
use super::status::stale_rows;
use super::superseded::{self, Settled};
use super::survey::{self, Standing, State, Survey};
use crate::error::{Error, ErrorKind, Result};
use crate::film::{Image, write_exr};
use grow::Growing;
pub use options::{Failure, Options, Outcome};

/// Does every item of `plan` that `out` lacks.
///
/// # Errors
/// Kind `Input` where the folder's rows do not read, another run writes there, or the plan needs more than the limits;
/// kind `Write` where something cannot be written. An item that fails is no error but a [`Failure`] in the outcome.
pub fn execute(
    plan: &Plan,
    backend: &dyn Backend,
    out: &Path,
    progress: &dyn Progress,
    options: &Options,
) -> Result<Outcome> {
    execute_locked(plan, backend, out, progress, options).map(|(outcome, _)| outcome)
}

/// As [`execute`]; the folder stays locked until the lock is dropped, so that a report can be written of just these rows.
///
/// # Errors
/// As [`execute`].
pub fn execute_locked(
    plan: &Plan,
    backend: &dyn Backend,
    out: &Path,
    progress: &dyn Progress,
    options: &Options,
) -> Result<(Outcome, FolderLock)> {
    let part = options.shard.map_or(0..plan.items.len(), |shard| shard.positions(plan));
    // What needs more than it may is refused before anything is made.
    let first_look = if options.fresh { Standing::nothing(plan) } else { Standing::read(plan, out)? };
    let survey = Survey::of_part(plan, &first_look, out, options.threads, part.clone());
    survey.refuse_above(&options.limits, &plan.experiment.place)?;
    if options.fresh {
        folder::refuse_to_forget(out)?;
    }
    if !options.fresh || options.shard.is_some() {
        folder::refuse_another_experiment(plan, out)?;
    }
    let lock = FolderLock::take(out)?;
    match options.shard {
        _ if !options.fresh => {}
        None => folder::forget(out)?,
        Some(_) => folder::forget_part(plan, out, part.clone())?,
    }
    let standing = settled(plan, out, progress)?;
    let survey = Survey::of_part(plan, &standing, out, options.threads, part.clone());
    folder::write_about(plan, out, &options.command, options.source.as_ref())?;
    if let Some(origin) = &options.origin {
        origin.write(out)?;
    }
    if let Some(shard) = options.shard {
        folder::write_note(out, Some(ShardNote { count: shard.count }))?;
    }
    let found = standing.states[part.clone()].iter().filter(|&&state| state == State::Done).count();
    if standing.states[part.clone()].iter().any(|state| !matches!(state, State::Done | State::Optional)) {
        folder::remove_report(out)?;
    }
    let is_else_done = |run: &Run| {
        let mut others = (0..plan.items.len()).filter(|position| !part.contains(position));
        others.all(|position| matches!(run.states[position], State::Done | State::Optional))
    };
    let wanted = standing.states[part.clone()].iter().filter(|&&state| state != State::Optional).count();
    let meter = Meter::new(found, wanted, survey.samples_left);
    let mut run = Run::new(plan, backend, out, progress, options, standing, meter)?;
    let (done, mut interrupted) = run.all_items(&part)?;
    interrupted |= !interrupted && run.right_wrong_rows()?;
    interrupted |= !interrupted && run.time_again(&part)?;
    if !interrupted {
        run.keep_references()?;
        run.write_in_plan_order()?;
        let tick = run.meter.tick();
        if tick.items_done == tick.items && is_else_done(&run) {
            folder::write_note(out, None)?;
        }
    }
    let tick = run.meter.tick();
    let (items, found, samples) = (tick.items, tick.items_done - done, tick.samples_done);
    Ok((Outcome { items, found, done, failures: run.failures, interrupted, samples, fresh: options.fresh }, lock))
}

/// What the folder holds of the plan, after what no longer belongs to it was put aside, and what does again is back.
fn settled(plan: &Plan, out: &Path, progress: &dyn Progress) -> Result<Standing> {
    let standing = Standing::read(plan, out)?;
    for what in &standing.unsound_timings {
        progress.warn(&format!("{what}; the line is left out, its seconds are lost"));
    }
    let settled = superseded::settle(plan, out, &standing)?;
    for (why, count) in stale_rows(plan, &settled.aside) {
        progress.warn(&format!("{count} rows put aside in superseded.jsonl: {why}"));
    }
    if settled.back > 0 {
        progress
            .warn(&format!("{} rows taken back from superseded.jsonl: what they were made with is back", settled.back));
    }
    if settled == Settled::default() { Ok(standing) } else { Standing::read(plan, out) }
}

/// A file to which whole lines are appended.
struct Log {
    path: PathBuf,
    file: File,
}

impl Log {
    fn open(path: PathBuf) -> Result<Self> {
        match OpenOptions::new().append(true).create(true).open(&path) {
            Ok(file) => Ok(Self { path, file }),
            Err(e) => Err(Error::write(&path, format!("cannot open: {e}"))),
        }
    }

    /// One call to the system for the whole line: a kill leaves all of it or a part without an end.
    fn append(&mut self, mut line: String) -> Result<()> {
        line.push('\n');
        let written = self.file.write_all(line.as_bytes()).and_then(|()| self.file.flush());
        written.map_err(|e| Error::write(&self.path, format!("cannot append: {e}")))
    }
}

/// A run at work.
struct Run<'a> {
    plan: &'a Plan,
    backend: &'a dyn Backend,
    out: &'a Path,
    progress: &'a dyn Progress,
    options: &'a Options<'a>,
    host: String,
    images: Images,
    /// The reference at hand: items of one reference stand together.
    reference: Option<(String, Arc<ReferenceImages>)>,
    /// The reference that grows at the moment.
    growing: Option<Growing>,
    rows: HashMap<String, Row>,
    timings: HashMap<String, Timing>,
    states: Vec<State>,
    /// Images that could not be made, by id: whatever needs one fails for the same reason.
    failed_images: HashMap<String, Error>,
    failures: Vec<Failure>,
    /// Ids of items whose rows turned out to be wrong: done again at the end.
    wrong_rows: Vec<String>,
    results_log: Log,
    timings_log: Log,
    meter: Meter,
}

impl<'a> Run<'a> {
    /// Opens the logs.
    fn new(
        plan: &'a Plan,
        backend: &'a dyn Backend,
        out: &'a Path,
        progress: &'a dyn Progress,
        options: &'a Options<'a>,
        standing: Standing,
        meter: Meter,
    ) -> Result<Self> {
        let Standing { rows, timings, states, .. } = standing;
        let (results_path, timings_path) = (results::results_path(out), results::timings_path(out));
        Ok(Self {
            plan,
            backend,
            out,
            progress,
            options,
            host: machine::describe(),
            images: Images::new(out),
            reference: None,
            growing: None,
            rows,
            timings,
            states,
            failed_images: HashMap::new(),
            failures: Vec::new(),
            wrong_rows: Vec::new(),
            results_log: Log::open(results_path)?,
            timings_log: Log::open(timings_path)?,
            meter,
        })
    }

    /// Goes through the plan's items at `part`; how many were done, and whether it ended early.
    fn all_items(&mut self, part: &Range<usize>) -> Result<(usize, bool)> {
        let released = self.plan.released_after();
        let mut done = 0;
        for (position, released) in released.iter().enumerate() {
            if part.contains(&position) && self.may_be_wanted(position) {
                let told = self.options.stop.is_some_and(|stop| stop.load(Ordering::Relaxed));
                if told || self.options.at_most == Some(done) {
                    return Ok((done, true));
                }
                let step = match self.is_wanted(position) {
                    Ok(true) => self.one_item(position),
                    other => other,
                };
                match step {
                    Ok(is_done) => done += usize::from(is_done),
                    Err(error) if error.kind == ErrorKind::Interrupted => return Ok((done, true)),
                    Err(error) => return Err(error),
                }
            }
            self.images.release(released);
        }
        Ok((done, false))
    }

    /// Does the items again whose rows turned out to be wrong; whether it was told to end. They count as done already.
    fn right_wrong_rows(&mut self) -> Result<bool> {
        while let Some(id) = self.wrong_rows.pop() {
            let plan = self.plan;
            let item = &plan.items[plan.position(&id).expect("images are the plan's")];
            if self.rows.contains_key(&id) {
                continue;
            }
            match self.row_of(item).and_then(|row| self.record(item, row)) {
                Ok(()) => {}
                Err(error) if error.kind == ErrorKind::Interrupted => return Ok(true),
                Err(error) if error.kind == ErrorKind::Write => return Err(error),
                Err(error) => self.failures.push(Failure { id, label: item.label(), error }),
            }
        }
        Ok(false)
    }

    /// File and line of an item's row.
    fn place_of_row(&self, id: &str) -> String {
        let path = results::results_path(self.out);
        let text = std::fs::read(&path).unwrap_or_default();
        let named = format!("\"id\":\"{id}\"");
        let is_row = |line: &[u8]| line.windows(named.len()).any(|part| part == named.as_bytes());
        let mut lines = text.split(|&byte| byte == b'\n').map(is_row).collect::<Vec<_>>().into_iter();
        lines
            .rposition(|is_row| is_row)
            .map_or(format!("{}", path.display()), |at| format!("{}:{}", path.display(), at + 1))
    }

    /// Does one item; whether it could be done.
    fn one_item(&mut self, position: usize) -> Result<bool> {
        let plan = self.plan;
        let item = &plan.items[position];
        self.progress.item_started(&item.label(), &self.meter.tick());
        let result = match self.states[position] {
            // The row is right already: only its image is wanted.
            State::ImageMissing => self.image(&item.id).map(|_| ()),
            _ => self.row_of(item).and_then(|row| self.record(item, row)),
        };
        let is_done = match result {
            Ok(()) => {
                self.meter.add_item();
                true
            }
            Err(error) if matches!(error.kind, ErrorKind::Write | ErrorKind::Interrupted) => return Err(error),
            Err(error) => {
                self.progress.warn(&format!("{}: {error}", item.label()));
                self.failures.push(Failure { id: item.id.clone(), label: item.label(), error });
                false
            }
        };
        self.progress.item_ended(&self.meter.tick());
        Ok(is_done)
    }

    /// Appends a row, which says what it was made with.
    fn record(&mut self, item: &WorkItem, mut row: Row) -> Result<()> {
        row.set_made_with(&item.made_with);
        self.results_log.append(row.to_line())?;
        self.rows.insert(row.id().to_owned(), row);
        Ok(())
    }

    /// What an item finds.
    fn row_of(&mut self, item: &WorkItem) -> Result<Row> {
        match &item.work {
            Work::Image(work) => self.image_row(item, work).map(Row::Image),
            Work::Reference(work) => self.reference_row(item, work).map(Row::Reference),
            Work::Ensemble(work) => self.ensemble_row(item, work).map(Row::Ensemble),
            Work::Points(work) => self.points_row(item, work).map(Row::Points),
            Work::Prediction(work) => {
                let found = self.backend.predict(work, self.options.threads)?;
                Ok(Row::Prediction(prediction::row(item, work, found)))
            }
        }
    }

    fn names(&self, sampler: &str) -> Vec<String> {
        self.plan.names(sampler).to_vec()
    }

    /// The images of a reference.
    fn reference(&mut self, id: &str) -> Result<Arc<ReferenceImages>> {
        if let Some((held, images)) = &self.reference
            && held == id
        {
            return Ok(images.clone());
        }
        let images = match self.plan.growth(id) {
            Some(_) => self.grown_images(id)?,
            None => {
                let [a, b] = self.plan.reference_images(id);
                Arc::new(ReferenceImages::new([self.image(a)?, self.image(b)?]))
            }
        };
        self.reference = Some((id.to_owned(), images.clone()));
        Ok(images)
    }

    /// An image of the plan: held, else from disk, else made.
    fn image(&mut self, id: &str) -> Result<Arc<Image>> {
        if let Some(error) = self.failed_images.get(id) {
            return Err(error.clone());
        }
        if let Some(image) = self.images.held(id) {
            return Ok(image);
        }
        let plan = self.plan;
        let item = &plan.items[plan.position(id).expect("plans are closed: what an item needs is an item")];
        let size = item.kept_image().expect("only items with images are needed by others");
        let pixels = self.rows.get(id).and_then(Row::kept_pixels).map(str::to_owned);
        // An image without its timing was saved by a run that was killed in between, or carried here: it is right, but
        // the report wants its seconds too.
        let is_timed = self.timings.contains_key(id);
        if is_timed && let Some(image) = self.images.load(id, size, pixels.as_deref()) {
            return Ok(image);
        }
        let path = results::image_path(self.out, id);
        if is_timed && path.exists() {
            self.progress.warn(&format!("{}: not the image that was written, so it is made again", path.display()));
        }
        let made = self.make(item, size, pixels.as_deref());
        if let Err(error) = &made {
            self.failed_images.insert(id.to_owned(), error.clone());
        }
        made
    }

    /// Makes an image, times it, and saves it; `pixels` is what a row says of it.
    fn make(&mut self, item: &WorkItem, size: Size, pixels: Option<&str>) -> Result<Arc<Image>> {
        let request = self.request(item);
        if let Some(request) = &request {
            self.backend.prepare(request)?;
        }
        let load = machine::load();
        let started = Instant::now();
        let image = self.pixels_of(item, request.as_ref(), size)?;
        let seconds = started.elapsed().as_secs_f64();
        measure::check_finite(&image, &item.label())?;
        let found = pixel_hash(&image.pixels);
        if let Some(expected) = pixels
            && expected != found
            && read_image(self.out, &item.id, Some(&found)).is_ok()
        {
            // Two makings of one picture agree: it is the row that is wrong.
            let place = self.place_of_row(&item.id);
            self.progress.warn(&format!(
                "{place}: expected the pixels of the image on disk and of one made again, {found}, found {expected}; the row is put aside and its item done again"
            ));
            if let Some(row) = self.rows.remove(&item.id) {
                superseded::put_aside(self.out, std::iter::once(&row))?;
            }
            self.wrong_rows.push(item.id.clone());
        } else if let Some(expected) = pixels
            && expected != found
        {
            let what = format!(
                "expected the pixels of its row, {expected}, found {found}: code changed its bits and kept its algorithm number; `--fresh` does everything again"
            );
            return Err(Error::incomplete(item.label(), what));
        }
        let (samples, threads) = (item.samples(), self.options.threads);
        if !self.timings.contains_key(&item.id) {
            let (id, host) = (item.id.clone(), self.host.clone());
            let timing = Timing { id, seconds, samples, host, threads, load, again: None };
            self.timings_log.append(line(&timing))?;
            self.timings.insert(item.id.clone(), timing);
        }
        self.meter.add_samples(samples);
        let provenance = self.provenance(item);
        self.images.save(&item.id, image, &provenance, item.is_shown)
    }

    /// What to ask the backend for, where the image is rendered.
    fn request<'w>(&self, item: &'w WorkItem) -> Option<RenderRequest<'w>>
    where
        'a: 'w,
    {
        let Work::Image(work) = &item.work else { return None };
        Some(RenderRequest {
            scene: &work.scene,
            sampler: &work.sampler,
            spp: work.spp.asked,
            seed: work.seed,
            size: work.size,
            estimator: work.estimator,
            stage: work.stage,
            variant: work.variant,
            threads: self.options.threads,
            stop: self.options.stop,
        })
    }

    /// The bare pixels.
    fn pixels_of(&self, item: &WorkItem, request: Option<&RenderRequest>, size: Size) -> Result<Image> {
        let image = match (request, &item.work) {
            (Some(request), _) => self.backend.render(request),
            (None, Work::Reference(work)) => self.backend.exact_reference(&work.scene, size),
            (None, _) => unreachable!("these keep no image"),
        }?;
        assert_eq!((image.width, image.height), (size.width, size.height), "an image of another size than asked for");
        Ok(image)
    }

    /// What an image says of its making.
    fn provenance(&self, item: &WorkItem) -> Vec<(String, String)> {
        let experiment = &self.plan.experiment;
        let mut fields = vec![
            ("experiment", experiment.name.clone()),
            ("experiment_seed", experiment.seed.to_string()),
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("command", self.options.command.clone()),
            ("kind", results::kind_name(item.kind()).to_owned()),
        ];
        if let Work::Image(work) = &item.work {
            fields.extend([
                ("scene", work.scene.clone()),
                ("sampler", work.sampler.clone()),
                ("spp", work.spp.taken.to_string()),
                ("seed", work.seed.to_string()),
                ("estimator", work.estimator.name().to_owned()),
                ("stage", work.stage.name().to_owned()),
            ]);
            if !work.variant.is_plain() {
                fields.push(("variant", work.variant.to_string()));
            }
        }
        fields.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
    }

    /// The last step: rows and timings of this plan, in its order, each file in one piece.
    fn write_in_plan_order(&mut self) -> Result<()> {
        write_in_plan_order(self.plan, self.out, &self.rows, &self.timings)
    }
}

/// Writes rows and timings in the order of the plan, each file in one piece; what the plan knows better than a row – what
/// the experiment calls the sampler, what the row was made with – is as the plan says.
pub(super) fn write_in_plan_order(
    plan: &Plan,
    out: &Path,
    rows: &HashMap<String, Row>,
    timings: &HashMap<String, Timing>,
) -> Result<()> {
    let (unwanted, items): (Vec<&WorkItem>, Vec<&WorkItem>) =
        plan.items.iter().partition(|item| survey::is_unwanted(plan, rows, item));
    superseded::put_aside(out, unwanted.into_iter().filter_map(|item| rows.get(&item.id)))?;
    let row = |item: &WorkItem| Some(plan.as_written(item, rows.get(&item.id)?.clone()));
    let rows: Vec<Row> = items.into_iter().filter_map(row).collect();
    write_lines(&results::results_path(out), rows.iter())?;
    write_lines(&results::timings_path(out), plan.items.iter().filter_map(|item| timings.get(&item.id)))
}

//! The work of a tab: takes what is asked for, keeps the last good document, renders, and shows.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::House;
use super::analyst::{self, Analyst, SharedFigures};
use super::channel::{Inbox, Outbox, Shown, Taken};
use super::document::Document;
use super::message::View;
use super::picture;
use super::reference::Reference;
use super::side::{Budget, Side, Step, Traced};
use super::speed::Speed;
use super::state;
use crate::error::{Error, Result};
use crate::film::ScreenTable;
use crate::sampling::{PointSource, Preset, Sampler, SamplerSet};
use crate::scene::compile::{Scene, Stage, Tree};
use crate::scene::load::LoadedScene;

mod answers;

/// After so long without a change the camera rests: the reference grows, and the tree becomes the one of `render`.
const REST: Duration = Duration::from_millis(300);

/// Shortest time between two pictures of one that only grows.
const BETWEEN_FRAMES: Duration = Duration::from_millis(120);

/// Shortest time between two messages on how far it is.
const BETWEEN_STATUS: Duration = Duration::from_millis(200);

/// Shortest time between two looks at the errors.
const BETWEEN_FIGURES: Duration = Duration::from_millis(1000);

/// A document with everything that is made of it.
struct Open {
    document: Document,
    loaded: LoadedScene,
    scene: Scene,
}

/// Two samplers side by side.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Comparison {
    other: Option<SamplerSet>,
    seconds: Option<f64>,
}

/// A tab's worker.
pub struct Studio {
    house: Arc<House>,
    inbox: Arc<Inbox>,
    outbox: Arc<Outbox>,
    /// Absent where not even the first document could be opened again.
    open: Option<Open>,
    comparison: Comparison,
    sides: Vec<Side>,
    reference: Option<Reference>,
    refines: bool,
    /// Whether something was asked for that only a reference can tell: its first samples come first then.
    wants_truth: bool,
    stopped: bool,
    /// A sample that is no number, which ends the picture.
    broken: Option<String>,
    view: View,
    table: ScreenTable,
    exposure: f32,
    speed: Speed,
    /// Counts pieces of work, whose turn it is.
    passes: u64,
    /// How many changes are taken into account.
    seen: u64,
    /// How many of them were changes of keys.
    sets: u64,
    /// Counts pictures that began: what was measured of another is of no use.
    epoch: u64,
    /// Counts documents that were told, so that a frame can say which it is of.
    version: u64,
    changed: Instant,
    show: Showing,
    figures: SharedFigures,
    figured: Instant,
    measurer: Analyst,
    errands: Analyst,
    told: Instant,
    /// What was last told of how far it is.
    last_status: Value,
}

/// Where the page is.
struct Showing {
    /// Number of the last frame sent, and when, and how large it was.
    sent: u64,
    at: Instant,
    bytes: usize,
    acknowledged: u64,
    /// Whether what is there differs from what was sent.
    is_stale: bool,
    /// Whether it is the first of its picture, which does not wait.
    is_urgent: bool,
}

impl Studio {
    /// A worker that has done nothing yet.
    pub fn new(house: Arc<House>, inbox: Arc<Inbox>, outbox: Arc<Outbox>) -> Self {
        let now = Instant::now();
        let show = Showing { sent: 0, at: now, bytes: 0, acknowledged: 0, is_stale: true, is_urgent: true };
        Self {
            house,
            inbox,
            outbox,
            open: None,
            comparison: Comparison::default(),
            sides: Vec::new(),
            reference: None,
            refines: true,
            wants_truth: false,
            stopped: false,
            broken: None,
            view: View::Image,
            table: ScreenTable::new(crate::film::DEFAULT_EXPOSURE),
            exposure: crate::film::DEFAULT_EXPOSURE,
            speed: Speed::default(),
            passes: 0,
            seen: 0,
            sets: 0,
            epoch: 0,
            version: 0,
            changed: now,
            show,
            figures: SharedFigures::default(),
            figured: now,
            measurer: Analyst::default(),
            errands: Analyst::default(),
            told: now,
            last_status: Value::Null,
        }
    }

    /// Works until the session ends.
    pub fn run(&mut self) {
        self.outbox.say(&state::vocabulary(self.house.save_to.is_some()));
        let first = self.house.first.clone();
        if let Err(e) = self.take_document(first, false) {
            self.complain(&e);
        }
        loop {
            let patience = if self.has_work() { Duration::ZERO } else { self.patience() };
            let Taken { asks, shown, changes, sets } = self.inbox.take(patience);
            (self.seen, self.sets) = (changes, sets);
            if self.inbox.is_closed() {
                return;
            }
            self.note_shown(shown);
            for ask in asks {
                if let Err(e) = self.answer(ask) {
                    self.complain(&e);
                }
            }
            self.work();
            self.show();
            self.figure();
            self.tell(false);
        }
    }

    fn complain(&self, error: &Error) {
        self.outbox.say(&json!({"is": "error", "text": error.to_string()}));
    }

    /// How long there is nothing to do but wait: until the camera rests, or a picture may be sent again.
    fn patience(&self) -> Duration {
        let waits = self.show.is_stale || self.changed.elapsed() < REST || self.measurer.is_busy();
        if waits { Duration::from_millis(20) } else { Duration::from_secs(1) }
    }

    fn has_work(&self) -> bool {
        if self.stopped || self.broken.is_some() || self.open.is_none() {
            return false;
        }
        !self.sides.iter().all(Side::is_finished) || (self.rests() && (!self.is_exact() || self.wants_reference()))
    }

    /// Whether the pictures are those of the tree that `render` has; what the others show may differ in the last bits.
    fn is_exact(&self) -> bool {
        self.open.as_ref().is_some_and(|open| open.scene.has_exact_tree())
    }

    /// Whether the pictures are what they are going to be: every sample is there, of the exact tree.
    fn is_finished(&self) -> bool {
        self.is_exact() && self.sides.iter().all(Side::is_finished)
    }

    fn rests(&self) -> bool {
        self.changed.elapsed() >= REST
    }

    fn wants_reference(&self) -> bool {
        self.refines && self.reference.as_ref().is_none_or(|reference| !reference.is_finished())
    }

    /// Does one piece of work, of tens of milliseconds.
    fn work(&mut self) {
        if !self.has_work() {
            return;
        }
        if let Err(e) = self.make_exact() {
            self.complain(&e);
        }
        let outcome = self.step();
        self.passes += 1;
        match outcome {
            Ok(Step::Grown(samples, rays, took)) => {
                self.speed.traced(samples, rays, took);
                self.show.is_stale = true;
            }
            // The change that came in between waits in the inbox; where it is refused, the picture that was stopped begins anew.
            Ok(Step::Stale) => {}
            Err(bad) => {
                self.broken = Some(bad.to_string());
                self.outbox.say(&json!({"is": "error", "text": format!("rendering stopped: {bad}")}));
            }
        }
    }

    /// Once the camera rests, the tree is that of [`Scene::new`], and with it the bits of the picture.
    fn make_exact(&mut self) -> Result<()> {
        let Some(open) = self.open.as_mut().filter(|open| !open.scene.has_exact_tree()) else { return Ok(()) };
        if self.changed.elapsed() < REST {
            return Ok(());
        }
        let Open { document, loaded, scene } = open;
        scene.revise(&document.config, &loaded.mesh.materials, document.size(), Stage::Final, Tree::Exact)?;
        self.begin(false)
    }

    /// The most urgent piece: a first picture, then all pixels, then more samples of whoever is behind, then the reference.
    fn step(&mut self) -> Traced {
        let (inbox, seen) = (self.inbox.clone(), self.seen);
        let fresh = move || inbox.changes() == seen;
        if let Some(step) = self.first_pictures(&fresh) {
            return step;
        }
        self.show.is_urgent = false;
        if self.is_turn_of_reference() { self.grow_reference(&fresh) } else { self.grow_sides(&fresh) }
    }

    /// The first sample: of one pixel in each block, of blocks half as large, at last of every pixel; `None` where that is done.
    fn first_pictures(&mut self, fresh: &(dyn Fn() -> bool + Sync)) -> Option<Traced> {
        let scene = &self.open.as_ref()?.scene;
        let (w, h) = scene.camera.size();
        let panels = self.sides.len();
        if let Some(side) = self.sides.iter_mut().find(|side| side.growing.block().is_none()) {
            let block = self.speed.first_block(u64::from(w) * u64::from(h), panels);
            return Some(side.first(scene, block, &|| true));
        }
        let unfinished = self.sides.iter_mut().filter(|side| side.growing.block() > Some(1));
        let side = unfinished.max_by_key(|side| side.growing.block())?;
        let block = side.growing.block()? / 2;
        Some(side.first(scene, block, fresh))
    }

    /// While pictures are made, the reference takes a quarter of the passes of a camera that rests, half where it is looked at.
    fn is_turn_of_reference(&self) -> bool {
        if !self.rests() || !self.wants_reference() {
            return false;
        }
        let known = self.reference.as_ref().map_or(0, Reference::samples);
        let is_due = match self.wants_truth {
            true => known == 0 || self.passes % 2 == 1,
            false => self.passes % 4 == 3,
        };
        self.sides.iter().all(Side::is_finished) || (is_due && !self.sides.iter().any(Side::is_timing))
    }

    fn grow_reference(&mut self, fresh: &(dyn Fn() -> bool + Sync)) -> Traced {
        let Some(open) = self.open.as_mut() else { return Ok(Step::Stale) };
        let reference = match &mut self.reference {
            Some(reference) => reference,
            none => match Reference::new(&open.scene, None) {
                Ok(reference) => none.insert(reference),
                Err(_) => return Ok(Step::Stale),
            },
        };
        reference.grow(&mut open.scene, &self.speed, fresh)
    }

    /// Adds samples to the picture that has taken less time so far.
    fn grow_sides(&mut self, fresh: &(dyn Fn() -> bool + Sync)) -> Traced {
        let Some(open) = self.open.as_ref() else { return Ok(Step::Stale) };
        let unfinished = self.sides.iter_mut().filter(|side| !side.is_finished());
        let Some(side) = unfinished.min_by(|a, b| a.seconds.total_cmp(&b.seconds)) else { return Ok(Step::Stale) };
        let step = match side.growing.samples() < side.sampler.samples() {
            true => side.grow(&open.scene, &self.speed, fresh)?,
            // Of one sample alone, whose time is known already.
            false => Step::Stale,
        };
        if side.is_timing() && side.choose_count(&open.scene).is_err() {
            return Ok(Step::Stale);
        }
        Ok(step)
    }

    /// Opens another document in place of the one that is open, which stays on an error.
    fn take_document(&mut self, document: Document, moving: bool) -> Result<()> {
        let same_meshes = self.open.as_ref().is_some_and(|open| {
            let old = &open.document;
            old.config.mesh_files == document.config.mesh_files && old.places == document.places
        });
        let keeps_truth = self.open.as_ref().is_some_and(|open| open.document.has_the_truth_of(&document));
        if let Some(open) = self.open.as_mut().filter(|open| same_meshes && open.document.has_the_samples_of(&document))
        {
            open.document = document;
            self.expose();
            // Also where nothing of it is seen: the page then knows that what it shows is up to date.
            self.show.is_stale = true;
            self.tell_state(moving);
            return Ok(());
        }
        if same_meshes {
            self.revise(document, moving)?;
        } else {
            let mut loaded = document.open()?;
            let scene = document.compile(&mut loaded)?;
            let open = Open { document, loaded, scene };
            check_samplers(&open, &self.comparison)?;
            self.open = Some(open);
            self.stopped = false;
        }
        self.changed = Instant::now();
        self.begin(keeps_truth)?;
        self.tell_state(moving);
        Ok(())
    }

    /// The same meshes under another config.
    fn revise(&mut self, document: Document, moving: bool) -> Result<()> {
        let Some(open) = self.open.as_mut() else { return Ok(()) };
        let tree = if moving { Tree::Roomy } else { Tree::Exact };
        let old = std::mem::replace(&mut open.document, document);
        let tried = open.take(tree).and_then(|()| check_samplers(open, &self.comparison));
        if let Err(e) = tried {
            open.document = old;
            open.take(Tree::Exact)?;
            return Err(e);
        }
        Ok(())
    }

    /// Begins the pictures anew; the reference too, unless it still is the truth.
    fn begin(&mut self, keeps_reference: bool) -> Result<()> {
        let Some(open) = self.open.as_ref() else { return Ok(()) };
        self.sides = sides(open, &self.comparison, &mut self.sides)?;
        let whole = self.reference.as_ref().is_none_or(|r| r.size() == open.scene.camera.size());
        if !keeps_reference || !whole {
            self.reference = match self.reference.take() {
                Some(old) => Some(Reference::new(&open.scene, Some(old))?),
                None => None,
            };
        }
        self.expose();
        self.broken = None;
        self.epoch += 1;
        (self.show.is_stale, self.show.is_urgent) = (true, true);
        Ok(())
    }

    /// Shows what is there as the document exposes it.
    fn expose(&mut self) {
        let Some(open) = &self.open else { return };
        let exposure = open.document.config.framebuffer.exposure;
        if exposure != self.exposure {
            (self.exposure, self.table) = (exposure, ScreenTable::new(exposure));
            self.show.is_stale = true;
        }
    }

    fn note_shown(&mut self, shown: Shown) {
        if shown.frame > self.show.acknowledged {
            self.show.acknowledged = shown.frame;
            if let (true, Some(at)) = (shown.frame == self.show.sent, shown.at) {
                self.speed.sent(self.show.bytes, at.saturating_duration_since(self.show.at));
            }
        }
    }

    /// Sends what is there, if the page has shown what it was sent before, and it is time.
    fn show(&mut self) {
        let waits = self.show.acknowledged < self.show.sent || !self.show.is_stale;
        let begun = !self.sides.is_empty() && self.sides.iter().all(|side| side.growing.block().is_some());
        if waits || !begun || (!self.show.is_urgent && self.show.at.elapsed() < BETWEEN_FRAMES) {
            return;
        }
        let scale = self.current_figures().and_then(|figures| figures.error_scale);
        // One reference for all panels.
        let wants_reference = matches!(self.view, View::Reference | View::Error);
        let reference = self.reference.as_ref().filter(|_| wants_reference).and_then(Reference::image);
        let shown: Vec<picture::Shown> = self
            .sides
            .iter()
            .map(|side| match (self.view, &reference, scale) {
                (View::Reference, Some(reference), _) => picture::on_screen(reference, &self.table, View::Reference),
                (View::Error, Some(reference), Some(scale)) if side.growing.samples() > 0 => {
                    picture::error(&side.growing, reference, scale, &self.table)
                }
                (View::Variance, ..) => picture::variance(&side.growing)
                    .unwrap_or_else(|| picture::on_screen(&side.growing.preview(), &self.table, View::Image)),
                _ => picture::on_screen(&side.growing.preview(), &self.table, View::Image),
            })
            .collect();
        self.show.sent += 1;
        self.show.at = Instant::now();
        let panels: Vec<Value> = self.sides.iter().zip(&shown).map(|(side, s)| self.frame_header(side, s)).collect();
        let header = json!({"is": "frame", "frame": self.show.sent, "epoch": self.epoch, "version": self.version, "panels": panels});
        let bytes = shown.into_iter().map(|s| s.bytes).collect::<Vec<_>>().concat();
        self.outbox.send_bytes(&header, &bytes);
        (self.show.bytes, self.show.is_stale) = (bytes.len(), false);
    }

    fn frame_header(&self, side: &Side, shown: &picture::Shown) -> Value {
        let (w, h) = side.growing.size();
        json!({
            "width": shown.width, "height": shown.height, "full": [w, h], "view": shown.view, "scale": shown.scale,
            "samples": side.growing.samples(), "of": side.sampler.samples(), "block": side.growing.block(),
            "sampler": side.set.to_string(), "seconds": side.seconds, "timing": side.is_timing(),
            "reference": self.reference.as_ref().map_or(0, Reference::samples),
        })
    }

    fn current_figures(&self) -> Option<analyst::Figures> {
        let figures = self.figures.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        (figures.epoch == self.epoch && !figures.panels.is_empty()).then(|| figures.clone())
    }

    /// Has the errors worked out again, now and then.
    fn figure(&mut self) {
        let due = self.rests() && self.figured.elapsed() >= BETWEEN_FIGURES && !self.measurer.is_busy();
        let grown = self.sides.iter().all(|side| side.growing.samples() > 0 && !side.is_timing());
        let Some(reference) = self.reference.as_ref().filter(|r| due && grown && r.samples() > 0) else { return };
        let now: Vec<u32> = self.sides.iter().map(|side| side.growing.samples()).collect();
        if self.current_figures().is_some_and(|f| f.is_of(&now, reference.samples())) {
            return;
        }
        let Some(halves) = reference.images() else { return };
        let panels: Vec<_> = self.sides.iter().map(|side| (side.growing.image(), side.growing.samples())).collect();
        let (epoch, samples, shared) = (self.epoch, reference.samples(), self.figures.clone());
        self.figured = Instant::now();
        self.measurer.start(move || analyst::figures(epoch, &panels, &halves, samples, &shared));
        // A map of errors has its scale from these.
        self.show.is_stale |= self.view == View::Error;
    }

    fn tell_state(&mut self, moving: bool) {
        self.version += 1;
        if let Some(Open { document, loaded, scene }) = &self.open {
            let mut told = state::whole(document, loaded, scene, moving);
            told["version"] = json!(self.version);
            self.outbox.say(&told);
        }
    }

    /// Tells how far it is.
    fn tell(&mut self, now: bool) {
        if !now && self.told.elapsed() < BETWEEN_STATUS {
            return;
        }
        let figures = self.current_figures();
        let panel = |(i, side): (usize, &Side)| {
            json!({
                "samples": side.growing.samples(), "of": side.sampler.samples(), "seconds": round_3(side.seconds),
                "timing": side.is_timing(), "sampler": side.set.to_string(),
                "errors": figures.as_ref().and_then(|f| f.panels.get(i)),
            })
        };
        let panels: Vec<Value> = self.sides.iter().enumerate().map(panel).collect();
        let left: f64 = self.sides.iter().map(|s| s.seconds_left(self.speed.samples_per_second())).sum();
        let state = match () {
            () if self.broken.is_some() => "broken",
            () if self.open.is_none() => "empty",
            () if self.stopped => "stopped",
            () if !self.is_finished() => "rendering",
            () if self.has_work() => "refining the reference",
            () => "finished",
        };
        let status = json!({
            "is": "status", "sets": self.sets, "epoch": self.epoch, "state": state, "panels": panels, "left": round_3(left),
            "samples_per_second": self.speed.samples_per_second().round(),
            "rays_per_second": self.speed.rays_per_second().round(),
            "reference": self.reference.as_ref().map_or(0, Reference::samples),
        });
        if status != self.last_status {
            self.outbox.say(&status);
            self.last_status = status;
        }
        self.told = Instant::now();
    }

    /// Takes another sampler beside the document's, or another budget.
    fn compare(&mut self, other: Option<&str>, seconds: Option<f64>) -> Result<()> {
        let other = other.map(|text| SamplerSet::parse(text, Preset::Best)).transpose()?;
        let comparison = Comparison { other, seconds };
        if let Some(open) = &self.open {
            check_samplers(open, &comparison)?;
        }
        self.comparison = comparison;
        self.begin(true)
    }
}

impl Open {
    /// Makes loaded scene and scene what the document says.
    fn take(&mut self, tree: Tree) -> Result<()> {
        self.loaded.repaint(self.document.config.clone())?;
        let materials = &self.loaded.mesh.materials;
        self.scene.revise(&self.document.config, materials, self.document.size(), Stage::Final, tree)?;
        Ok(())
    }
}

/// Whether the samplers serve the scene.
fn check_samplers(open: &Open, comparison: &Comparison) -> Result<()> {
    let asked = open.document.config.framebuffer.sppx;
    let mut sets = std::iter::once(open.document.set).chain(comparison.other);
    sets.try_for_each(|set| Sampler::new(set, &open.scene.layout, asked, open.document.seed).map(|_| ()))
}

/// Pictures that have not begun, in the memory of old ones.
fn sides(open: &Open, comparison: &Comparison, old: &mut Vec<Side>) -> Result<Vec<Side>> {
    let asked = open.document.config.framebuffer.sppx;
    let budget = comparison.seconds.map_or(Budget::Samples(asked), Budget::Seconds);
    let sets = std::iter::once(open.document.set).chain(comparison.other);
    let mut memory = std::mem::take(old).into_iter();
    sets.map(|set| Side::new(set, open.document.seed, budget, asked, &open.scene, memory.next())).collect()
}

fn round_3(x: f64) -> f64 {
    (x * 1e3).round() / 1e3
}

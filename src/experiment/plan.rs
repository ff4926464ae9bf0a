//! From an experiment to the ordered list of its items, each with an id and a seed that depend on content alone.
//!
//! A plan is a pure function of the experiment and of what the backend says of scenes and samplers. An item's id
//! hashes what its result depends on; its seed comes from the experiment's seed, the purpose, the scene's name, the
//! sampler, the spp and the replicate. No list position goes into either, so adding a sampler, a scene, an spp or a
//! replicate leaves every existing image as it is.

mod predictions;
mod references;
mod variants;
mod work;

use std::collections::{HashMap, HashSet};

use super::backend::{Algorithms, Backend, Estimator, SceneFacts, Size, Stage, Variant};
use super::compared::{read_reference_sampler, read_samplers, same_in_a_scene};
use super::identity::{Fingerprint, SeedOf};
use super::results::{Count, Kind, LeftOut, MadeWith, Row, short_hash};
use super::spec::{Experiment, Pictures};
use crate::error::{Error, Result, did_you_mean};
use variants::{is_seeded_as_its_twin, probed_samplers};
pub use work::{
    Batch, EnsembleWork, GrowthWork, ImageWork, PointsWork, PredictionWork, ReferenceSource, ReferenceWork, Work,
    WorkItem,
};

/// A sampler of the experiment; texts that mean the same one are together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlannedSampler {
    /// Full form.
    pub canonical: String,
    /// The texts of the experiment that mean it.
    pub names: Vec<String>,
}

/// All items of an experiment in the order in which they are done and recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// What was asked for.
    pub experiment: Experiment,
    /// Its scenes, in its order.
    pub scenes: Vec<SceneFacts>,
    /// The algorithm numbers behind it.
    pub algorithms: Algorithms,
    /// The compared samplers, each once, in the order in which they first occur.
    pub samplers: Vec<PlannedSampler>,
    /// The reference's sampler.
    pub reference_sampler: PlannedSampler,
    /// The items.
    pub items: Vec<WorkItem>,
    /// What the plan made of the experiment, in sentences for a reader.
    pub notes: Vec<String>,
    /// Sets of samplers that are not done in a scene, because another one means the same there.
    pub left_out: Vec<LeftOut>,
    positions: HashMap<String, usize>,
}

impl Plan {
    /// The item with this id.
    pub fn position(&self, id: &str) -> Option<usize> {
        self.positions.get(id).copied()
    }

    /// Exposure at which a scene is looked at.
    ///
    /// # Panics
    /// Where the plan has no such scene.
    pub fn exposure(&self, scene: &str) -> f32 {
        self.scenes.iter().find(|facts| facts.name == scene).expect("items are of the plan's scenes").exposure
    }

    /// What the experiment calls a sampler.
    pub fn names(&self, canonical: &str) -> &[String] {
        let known = self.samplers.iter().chain([&self.reference_sampler]);
        known
            .filter(|sampler| sampler.canonical == canonical)
            .map(|sampler| sampler.names.as_slice())
            .next()
            .unwrap_or(&[])
    }

    /// A row of an item with what the plan knows better than a row: what the experiment calls the sampler now, and what the
    /// id vouches for.
    pub(super) fn as_written(&self, item: &WorkItem, mut row: Row) -> Row {
        if let Some(sampler) = item.sampler() {
            row.set_names(self.names(sampler));
        }
        row.set_made_with(&item.made_with);
        row
    }

    /// Whether an image is one of those that are made again for their seconds: of each scene, sampler and count asked for the
    /// first of the images that samplers are compared by.
    pub fn is_timed_again(&self, item: &WorkItem) -> bool {
        let (Some(timing), Work::Image(work)) = (&self.experiment.timing, &item.work) else { return false };
        work.kind == Kind::Render
            && work.replicate == 0
            && work.variant.is_plain()
            && work.estimator == self.experiment.estimator.primary()
            && timing.spp.contains(&work.spp.asked)
    }

    /// What a reference may grow by; `None` where it does not grow.
    pub fn growth(&self, reference_id: &str) -> Option<&GrowthWork> {
        match &self.items[self.position(reference_id)?].work {
            Work::Reference(ReferenceWork { source: ReferenceSource::Halves { growth, .. }, .. }) => growth.as_ref(),
            _ => None,
        }
    }

    /// Ids of the images that a reference is made of at the least: two halves (of one that grows, their first batches), or
    /// the closed form twice.
    ///
    /// # Panics
    /// Where the plan has no such reference.
    pub fn reference_images(&self, reference_id: &str) -> [&str; 2] {
        let position = self.positions[reference_id];
        match &self.items[position].work {
            Work::Reference(ReferenceWork { source: ReferenceSource::Halves { ids: [a, b], .. }, .. }) => [a, b],
            Work::Reference(_) => [&self.items[position].id; 2],
            _ => panic!("{reference_id} is no reference"),
        }
    }

    /// Ids of the images that an item needs, its own among them. Of a reference that grows these are its first batches;
    /// the further ones are items of their own ([`WorkItem::batch`]), and how many are needed turns out on the way.
    pub fn images_needed(&self, position: usize) -> Vec<&str> {
        let item = &self.items[position];
        let pilots = |id: &str| self.growth(id).into_iter().flat_map(|growth| growth.pilots.iter().map(String::as_str));
        match &item.work {
            Work::Points(_) | Work::Prediction(_) => Vec::new(),
            Work::Reference(_) => self.reference_images(&item.id).into_iter().chain(pilots(&item.id)).collect(),
            Work::Image(work) => {
                let decides = work.batch.as_ref().map(|batch| &batch.reference_id);
                let reference = work.reference_id.iter().chain(decides).flat_map(|id| self.reference_images(id));
                let pilots = decides.into_iter().flat_map(|id| pilots(id));
                reference.chain(pilots).chain(work.twin.as_deref()).chain([item.id.as_str()]).collect()
            }
            Work::Ensemble(work) => {
                let reference = self.reference_images(&work.reference_id);
                reference.into_iter().chain(work.members.iter().map(String::as_str)).collect()
            }
        }
    }

    /// For each position the images that no later item needs.
    pub fn released_after(&self) -> Vec<Vec<String>> {
        let mut last: HashMap<&str, usize> = HashMap::new();
        for position in 0..self.items.len() {
            for id in self.images_needed(position) {
                last.insert(id, position);
            }
        }
        let mut released = vec![Vec::new(); self.items.len()];
        for (id, position) in last {
            released[position].push(id.to_owned());
        }
        released
    }
}

/// Plans an experiment.
///
/// # Errors
/// Kind `Input`: a scene or sampler that cannot be read, two scenes of one name, a reference sampler that is compared
/// or has nothing random in it, an unknown metric, equal seeds.
pub fn plan(experiment: &Experiment, backend: &dyn Backend) -> Result<Plan> {
    let scenes = open_scenes(experiment, backend)?;
    let samplers = read_samplers(experiment, backend)?;
    let reference_sampler = read_reference_sampler(experiment, backend, &samplers, &scenes)?;
    let left_out = same_in_a_scene(&scenes, &samplers, backend);
    for (scene, sampler) in scenes.iter().flat_map(|scene| samplers.iter().map(move |sampler| (scene, sampler))) {
        let place = |e: Error| Error::input(format!("{}: samplers: scene {}", experiment.place, scene.name), e);
        backend.check_sampler(&sampler.canonical, &scene.name).map_err(place)?;
    }
    check_metrics(experiment, backend)?;
    let probed = probed_samplers(experiment, backend, &samplers, &scenes)?;
    let mut planner = Planner {
        experiment,
        backend,
        reference: &reference_sampler,
        left_out: &left_out,
        scenes: &scenes,
        is_shown: false,
        items: Vec::new(),
        ids: HashSet::new(),
        notes: Vec::new(),
    };
    planner.note_samplers(&samplers);
    planner.add_points(&samplers);
    for (name, scene) in experiment.scenes.iter().zip(&scenes) {
        let is_probed = experiment.stability.as_ref().is_some_and(|stability| stability.scenes.contains(name));
        let probed = if is_probed { probed.as_slice() } else { &[] };
        planner.add_statistics(scene, experiment.size.of(name, scene.size), &samplers, probed);
    }
    planner.add_predictions()?;
    for pictures in &experiment.pictures {
        for (_, scene) in experiment.scenes.iter().zip(&scenes).filter(|(name, _)| **name == pictures.scene) {
            planner.add_pictures(scene, pictures, &samplers);
        }
    }
    let Planner { items, notes, .. } = planner;
    refuse_equal_seeds(&items, &experiment.place)?;
    let positions: HashMap<String, usize> = items.iter().enumerate().map(|(i, item)| (item.id.clone(), i)).collect();
    assert_eq!(positions.len(), items.len(), "two items of one id");
    let algorithms = backend.algorithms(&reference_sampler.canonical);
    Ok(Plan {
        experiment: experiment.clone(),
        scenes,
        algorithms,
        samplers,
        reference_sampler,
        items,
        notes,
        left_out,
        positions,
    })
}

/// Items that draw numbers have seeds of their own: an image must share no randomness with what it is compared with. An
/// image's twin is another making of the same randomisation, so those two may.
///
/// # Errors
/// Kind `Input` that names both items.
pub fn refuse_equal_seeds(items: &[WorkItem], place: &str) -> Result<()> {
    let mut seen: HashMap<u64, &WorkItem> = HashMap::new();
    for item in items {
        let Some(seed) = item.seed() else { continue };
        if is_seeded_as_its_twin(item, seen.get(&seed).copied()) {
            continue;
        }
        if let Some(other) = seen.insert(seed, item) {
            let what = format!(
                "expected every item to have a seed of its own, found {seed} for both \"{}\" and \"{}\"; choose another experiment seed",
                other.label(),
                item.label()
            );
            return Err(Error::input(format!("{place}: seed"), what));
        }
    }
    Ok(())
}

/// Opens the scenes; their short names are in rows and seeds, so no two may share one.
fn open_scenes(experiment: &Experiment, backend: &dyn Backend) -> Result<Vec<SceneFacts>> {
    let mut names = HashSet::new();
    let mut scenes = Vec::new();
    for (i, scene) in experiment.scenes.iter().enumerate() {
        let facts = backend.open_scene(scene)?;
        if !names.insert(facts.name.clone()) {
            let what = format!("expected scenes of different names, found {:?} again", facts.name);
            return Err(Error::input(format!("{}: scenes[{i}]", experiment.place), what));
        }
        scenes.push(facts);
    }
    Ok(scenes)
}

/// Every metric asked for has to be known.
fn check_metrics(experiment: &Experiment, backend: &dyn Backend) -> Result<()> {
    let known = backend.point_metric_names();
    let asked = experiment.points.iter().flat_map(|points| points.metrics.iter().enumerate());
    for (i, metric) in asked {
        if !known.contains(&metric.as_str()) {
            let near = did_you_mean(metric, known.iter().copied());
            let near = near.map(|near| format!("; did you mean {near:?}?")).unwrap_or_default();
            let what = format!("expected one of the metrics {}, found {metric:?}{near}", known.join(" "));
            return Err(Error::input(format!("{}: points.metrics[{i}]", experiment.place), what));
        }
    }
    Ok(())
}

/// How the replicates of a sampler are made.
#[derive(Debug, Clone, Copy)]
struct Making {
    /// Samples per pixel asked for.
    asked: u32,
    estimator: Estimator,
    variant: Variant,
}

/// Collects items.
struct Planner<'a> {
    experiment: &'a Experiment,
    backend: &'a dyn Backend,
    reference: &'a PlannedSampler,
    left_out: &'a [LeftOut],
    scenes: &'a [SceneFacts],
    /// Whether the items added now are looked at.
    is_shown: bool,
    items: Vec<WorkItem>,
    ids: HashSet<String>,
    notes: Vec<String>,
}

impl Planner<'_> {
    /// Says what became of the list of samplers.
    fn note_samplers(&mut self, samplers: &[PlannedSampler]) {
        for sampler in samplers {
            if let [first @ .., last] = sampler.names.as_slice()
                && !first.is_empty()
            {
                let what = format!("{} and {last} are one sampler, {}: done once", first.join(", "), sampler.canonical);
                self.notes.push(what);
            }
        }
        let is_set = |sampler: &&PlannedSampler| self.backend.is_mixed(&sampler.canonical);
        let sets: Vec<&str> = samplers.iter().filter(is_set).map(|sampler| sampler.names[0].as_str()).collect();
        if self.experiment.points.is_some() && !sets.is_empty() {
            self.notes.push(format!("no point sets of {}: each has a sampler a decision", sets.join(", ")));
        }
    }

    /// The samplers that are done in a scene.
    fn done_in<'s>(&self, scene: &SceneFacts, samplers: &'s [PlannedSampler]) -> Vec<&'s PlannedSampler> {
        let is_out = |canonical: &str| self.left_out.iter().any(|l| l.scene == scene.name && l.sampler == canonical);
        samplers.iter().filter(|sampler| !is_out(&sampler.canonical)).collect()
    }

    /// Says which sets are not done in a scene.
    fn note_left_out(&mut self, scene: &SceneFacts, samplers: &[PlannedSampler]) {
        let names = |canonical: &str| {
            let found = samplers.iter().find(|sampler| sampler.canonical == canonical);
            found.map_or_else(|| canonical.to_owned(), |sampler| sampler.names.join(" = "))
        };
        let of_scene = self.left_out.iter().filter(|left_out| left_out.scene == scene.name);
        let pairs: Vec<String> = of_scene.map(|l| format!("{} = {}", names(&l.sampler), names(&l.same_as))).collect();
        if !pairs.is_empty() {
            self.notes.push(format!(
                "{}: not done, since they are the same for the decisions of this scene ({}): {}",
                scene.name,
                scene.layout,
                pairs.join(", ")
            ));
        }
    }

    /// Says what becomes of replicates and spp in one scene.
    fn note_scene(&mut self, scene: &SceneFacts, samplers: &[PlannedSampler]) {
        if scene.exact_reference {
            self.notes.push(format!("{}: the reference is a closed form", scene.name));
        }
        self.note_left_out(scene, samplers);
        for sampler in self.done_in(scene, samplers) {
            let what = format!("{}, {}", scene.name, sampler.names.join(", "));
            if self.experiment.replicates > 1 && !self.backend.is_random(&sampler.canonical, Some(&scene.name)) {
                self.notes.push(format!("{what}: nothing random, so 1 replicate and no variance"));
            }
            for &asked in &self.experiment.spp {
                let Count { taken, .. } = self.count(&sampler.canonical, Some(scene), asked);
                if taken != asked {
                    self.notes.push(format!("{what}: {asked} spp asked, {taken} taken"));
                }
            }
        }
    }

    /// Counts of a sampler for a scene, or of a point set where there is none.
    fn count(&self, sampler: &str, scene: Option<&SceneFacts>, asked: u32) -> Count {
        Count { asked, taken: self.backend.taken(sampler, scene.map(|scene| scene.name.as_str()), asked) }
    }

    /// Replicates worth making.
    fn replicates(&self, sampler: &str, scene: Option<&SceneFacts>, asked: u32) -> u32 {
        if self.backend.is_random(sampler, scene.map(|scene| scene.name.as_str())) { asked } else { 1 }
    }

    /// Adds an item unless the same one is there already, and gives its id.
    fn push(&mut self, id: String, metrics_algorithm: u32, work: Work) -> String {
        // What is asked for twice is done once: a closed form of a scene's and its pictures' one size, the plain images of a
        // count that stability is asked about.
        if self.ids.insert(id.clone()) {
            let (is_shown, made_with) = (self.is_shown, self.made_with(&work));
            self.items.push(WorkItem { id: id.clone(), metrics_algorithm, is_shown, made_with, work });
        }
        id
    }

    /// What goes into an item's id besides its own fields, in words for its row.
    fn made_with(&self, work: &Work) -> MadeWith {
        let content = |name: &str| {
            self.scenes.iter().find(|scene| scene.name == name).map(|scene| short_hash(&scene.content_hash))
        };
        let rendered = |scene: &str, sampler: &str| {
            let numbers = self.backend.algorithms(sampler);
            let (renderer, estimator) = (Some(numbers.renderer), Some(numbers.estimator));
            MadeWith { scene: content(scene), renderer, sampler: Some(numbers.sampler), estimator, exact: None }
        };
        match work {
            Work::Points(work) => {
                MadeWith { sampler: Some(self.backend.algorithms(&work.sampler).sampler), ..MadeWith::default() }
            }
            Work::Image(work) => rendered(&work.scene, &work.sampler),
            Work::Prediction(work) => rendered(&work.scene, &work.sampler),
            Work::Ensemble(work) => rendered(&work.scene, &work.sampler),
            Work::Reference(ReferenceWork { scene, source: ReferenceSource::Halves { sampler, .. }, .. }) => {
                rendered(scene, sampler)
            }
            Work::Reference(work) => {
                let exact = Some(self.backend.algorithms(&self.reference.canonical).exact);
                MadeWith { scene: content(&work.scene), exact, ..MadeWith::default() }
            }
        }
    }

    /// Point-set metrics of every sampler.
    fn add_points(&mut self, samplers: &[PlannedSampler]) {
        let Some(points) = &self.experiment.points else { return };
        for sampler in samplers.iter().filter(|sampler| !self.backend.is_mixed(&sampler.canonical)) {
            for &asked in &points.n {
                for replicate in 0..self.replicates(&sampler.canonical, None, points.replicates) {
                    self.add_point_set(&sampler.canonical, asked, replicate, &points.metrics);
                }
            }
        }
    }

    /// Point-set metrics of one set.
    fn add_point_set(&mut self, sampler: &str, asked: u32, replicate: u32, metrics: &[String]) {
        let n = self.count(sampler, None, asked);
        let seed = self.seed("points", "", sampler, asked, replicate);
        let numbers = self.backend.algorithms(sampler);
        let id = Fingerprint::new("points")
            .with("sampler", sampler)
            .with("asked", n.asked)
            .with("taken", n.taken)
            .with("replicate", replicate)
            .with("seed", seed)
            .with("metrics", metrics.join(","))
            .with("sampler algorithm", numbers.sampler)
            .with("metrics algorithm", numbers.metrics)
            .id();
        let work = PointsWork { sampler: sampler.to_owned(), n, replicate, seed, metrics: metrics.to_vec() };
        self.push(id, numbers.metrics, Work::Points(work));
    }

    /// One scene: its reference, then sampler by sampler and spp by spp the replicates and what they say together, each
    /// followed by what is held against it.
    fn add_statistics(&mut self, scene: &SceneFacts, size: Size, samplers: &[PlannedSampler], probed: &[String]) {
        self.note_scene(scene, samplers);
        let reference_id = self.add_grown_reference(scene, size, samplers, probed);
        for sampler in self.done_in(scene, samplers) {
            self.add_shortcut_of(scene, size, sampler, &reference_id);
            if probed.contains(&sampler.canonical) {
                self.add_stability_of(scene, size, sampler, &reference_id);
            }
        }
    }

    /// One replicate made one way, compared with nothing yet.
    fn render_work(&self, scene: &SceneFacts, size: Size, sampler: &str, making: Making, replicate: u32) -> ImageWork {
        let Making { asked, estimator, variant } = making;
        ImageWork {
            kind: Kind::Render,
            scene: scene.name.clone(),
            sampler: sampler.to_owned(),
            spp: self.count_of(sampler, scene, asked, variant),
            replicate,
            batch: None,
            seed: self.seed("render", &scene.name, sampler, asked, replicate),
            size,
            estimator,
            stage: Stage::Final,
            variant,
            reference_id: None,
            twin: None,
        }
    }

    /// The replicates of one sampler made one way, and their ensemble; the replicates' ids. Each has its twin's seed, where
    /// it has one.
    fn add_replicates(
        &mut self,
        scene: &SceneFacts,
        size: Size,
        sampler: &PlannedSampler,
        making: Making,
        reference_id: &str,
        twins: &[String],
    ) -> Vec<String> {
        let Making { asked, estimator, variant } = making;
        let sampler = &sampler.canonical;
        let spp = self.count_of(sampler, scene, asked, variant);
        let members: Vec<String> = (0..self.replicates(sampler, Some(scene), self.experiment.replicates))
            .map(|replicate| {
                let work = ImageWork {
                    reference_id: Some(reference_id.to_owned()),
                    twin: twins.get(replicate as usize).cloned(),
                    ..self.render_work(scene, size, sampler, making, replicate)
                };
                self.add_image(scene, work)
            })
            .collect();
        let numbers = self.backend.algorithms(sampler);
        let id = Fingerprint::new("ensemble")
            .with("members", members.join(","))
            .with("reference", reference_id)
            .with("metrics algorithm", numbers.metrics)
            .id();
        let work = EnsembleWork {
            scene: scene.name.clone(),
            sampler: sampler.clone(),
            spp,
            size,
            estimator,
            variant,
            reference_id: reference_id.to_owned(),
            members: members.clone(),
        };
        self.push(id, numbers.metrics, Work::Ensemble(work));
        members
    }

    /// Counts where the samples are taken in passes.
    fn count_of(&self, sampler: &str, scene: &SceneFacts, asked: u32, variant: Variant) -> Count {
        let passes = variant.passes(asked).into_iter();
        Count { asked, taken: passes.map(|pass| self.count(sampler, Some(scene), pass).taken).sum() }
    }

    /// The pictures: a reference of their own, one image of each sampler and count, and the stages of the sheet's Figure 1.
    fn add_pictures(&mut self, scene: &SceneFacts, pictures: &Pictures, samplers: &[PlannedSampler]) {
        self.is_shown = true;
        let reference_id = self.add_reference(scene, pictures.size, pictures.reference_spp, "picture reference");
        let compared = self.done_in(scene, samplers);
        for (sampler, &asked) in compared.iter().flat_map(|s| pictures.spp.iter().map(move |spp| (s, spp))) {
            let work = ImageWork {
                kind: Kind::Picture,
                scene: scene.name.clone(),
                sampler: sampler.canonical.clone(),
                spp: self.count(&sampler.canonical, Some(scene), asked),
                replicate: 0,
                batch: None,
                seed: self.seed("picture", &scene.name, &sampler.canonical, asked, 0),
                size: pictures.size,
                estimator: self.experiment.estimator.primary(),
                stage: Stage::Final,
                variant: Variant::Plain,
                reference_id: Some(reference_id.clone()),
                twin: None,
            };
            self.add_image(scene, work);
        }
        // Without a lens there is nothing that its stage would add.
        for stage in Stage::ALL.into_iter().filter(|&stage| scene.lens || stage != Stage::Dof) {
            self.add_stage(scene, pictures.size, stage);
        }
    }

    /// One stage of the sheet's Figure 1, at the spp of the scene's own file.
    fn add_stage(&mut self, scene: &SceneFacts, size: Size, stage: Stage) {
        let sampler = self.reference.canonical.clone();
        // Every sample of the first stage is the pixel's centre: one says all.
        let asked = if stage == Stage::Start { 1 } else { scene.spp };
        let purpose = format!("stage {}", stage.name());
        let work = ImageWork {
            kind: Kind::Stage,
            scene: scene.name.clone(),
            spp: self.count(&sampler, Some(scene), asked),
            replicate: 0,
            batch: None,
            seed: self.seed(&purpose, &scene.name, &sampler, asked, 0),
            sampler,
            size,
            estimator: Estimator::Unbiased,
            stage,
            variant: Variant::Plain,
            reference_id: None,
            twin: None,
        };
        self.add_image(scene, work);
    }

    /// Adds one image; its id.
    fn add_image(&mut self, scene: &SceneFacts, work: ImageWork) -> String {
        let metrics = self.backend.algorithms(&work.sampler).metrics;
        self.push(self.image_id(scene, &work), metrics, Work::Image(work))
    }

    /// An image's id hashes what the pixels depend on, so a row may be measured anew against another reference without
    /// rendering again.
    fn image_id(&self, scene: &SceneFacts, work: &ImageWork) -> String {
        let Algorithms { renderer, sampler, estimator, .. } = self.backend.algorithms(&work.sampler);
        let fingerprint = Fingerprint::new("image")
            .with("scene", &scene.content_hash)
            .with("sampler", &work.sampler)
            .with("asked", work.spp.asked)
            .with("taken", work.spp.taken)
            .with("replicate", work.replicate)
            .with("seed", work.seed)
            .with("size", work.size)
            .with("estimator", work.estimator.name())
            .with("stage", work.stage.name())
            .with("renderer algorithm", renderer)
            .with("sampler algorithm", sampler)
            .with("estimator algorithm", estimator);
        // What everybody makes is not told apart from what was made before there were variants.
        match work.variant {
            Variant::Plain => fingerprint.id(),
            variant => fingerprint.with("variant", variant).id(),
        }
    }

    /// The seed of an item.
    fn seed(&self, purpose: &str, scene: &str, sampler: &str, asked: u32, replicate: u32) -> u64 {
        SeedOf { experiment: self.experiment.seed, purpose, scene, sampler, asked, replicate }.derive()
    }
}

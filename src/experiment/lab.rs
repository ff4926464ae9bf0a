//! The lab's own backend: scene files, the renderer, the samplers, the closed forms and the point-set metrics.

use std::cell::RefCell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::backend::{Algorithms, Backend, Estimator, PointMetrics, RenderRequest, SceneFacts, Size, Variant};
use super::exact;
use super::plan::PredictionWork;
use super::prediction::{self, Predicted};
use super::results::About;
use crate::error::{Error, Result};
use crate::film::Image;
use crate::render;
use crate::sampling::hash::derive;
use crate::sampling::{self, Decision, PointSource, Preset, SampleLayout, Sampler, SamplerSet, SamplerSpec, point_set};
use crate::scene::compile::{Scene, Stage, check_reach};
use crate::scene::load::{self, LoadedScene, OpenOptions};
use crate::scene::scale::scaled;
use crate::stats::discrepancy::{L2Kind, Points, l2_root, min_toroidal_distance, star_2d, t_value};
use crate::stats::pixel_variance::Integrand;

/// Raised whenever the bits of image errors or point-set metrics may change.
pub const METRICS_ALGORITHM: u32 = 3;

/// Raised whenever the weighting of lights changes.
pub const ESTIMATOR_ALGORITHM: u32 = 1;

/// The names of point-set metrics.
pub const POINT_METRICS: [&str; 12] = [
    "star",
    "l2_star",
    "centred_l2",
    "wrap_around_l2",
    "mixture_l2",
    "modified_l2",
    "extreme_l2",
    "symmetric_l2",
    "periodic_l2",
    "diaphony",
    "t_value",
    "min_toroidal_distance",
];

/// A scene in memory at the busiest moment, in sizes of itself: the mesh as loaded, the full scene, that of one stage or
/// of another scale, and what building a tree needs meanwhile.
const SCENE_COPIES: u64 = 5;

/// A scene that was opened.
struct Opened {
    loaded: LoadedScene,
    /// The full scene in its own scale always, one other at the most.
    compiled: HashMap<Compiled, Scene>,
}

/// What one compiled scene is good for: a stage, and the factor of all lengths in bits, as floats are no keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Compiled {
    stage: &'static str,
    scale: u32,
}

impl Compiled {
    fn new(stage: Stage, variant: Variant) -> Self {
        Self { stage: stage.name(), scale: variant.scale().to_bits() }
    }

    /// The whole picture in the scene's own scale.
    fn full() -> Self {
        Self::new(Stage::Final, Variant::Plain)
    }
}

/// Scene, size of the image, and column and row.
type PixelOf = (String, Size, [u32; 2]);

/// Renders with the lab.
#[derive(Default)]
pub struct Lab {
    /// Folders in which a bare scene name is looked for.
    folders: Vec<PathBuf>,
    options: OpenOptions,
    scenes: RefCell<HashMap<String, Opened>>,
    /// Decisions of each scene's full picture.
    layouts: RefCell<HashMap<String, SampleLayout>>,
    /// What a folder recorded of scenes, by the experiment's name for them.
    recorded: HashMap<String, SceneFacts>,
    /// Scenes whose files are not there, so that what was recorded of them stood in.
    stood_in: RefCell<Vec<String>>,
    pools: RefCell<HashMap<usize, Arc<rayon::ThreadPool>>>,
    /// What single pixels see, by scene, size and pixel.
    integrands: RefCell<HashMap<PixelOf, Arc<Integrand>>>,
}

impl Lab {
    /// A lab for the experiment file at `experiment`: scene names are looked for beside it, in the folder above (so
    /// `configs/experiments/a.json` finds `configs/`), and in `configs/`.
    pub fn new(experiment: &Path, options: OpenOptions) -> Self {
        let beside = experiment.parent().unwrap_or(Path::new(""));
        let folders = vec![beside.to_owned(), beside.join(".."), PathBuf::from("configs")];
        Self { folders, options, ..Self::default() }
    }

    /// The same lab, for looking at results: where a scene's files are gone, what was recorded of it stands in, so that it
    /// can be planned but not rendered.
    #[must_use]
    pub fn with_record(mut self, about: &About) -> Self {
        self.recorded = about.experiment.scenes.iter().cloned().zip(about.scenes.iter().cloned()).collect();
        self
    }

    /// A lab that opens no file: it plans what was recorded.
    pub fn of_record(about: &About) -> Self {
        Self::default().with_record(about)
    }

    /// What a person should know of the scenes opened so far, one line each.
    pub fn warnings(&self) -> Vec<String> {
        let scenes = self.scenes.borrow();
        let mut lines: Vec<String> = scenes
            .iter()
            .flat_map(|(name, opened)| opened.loaded.warnings.iter().map(move |line| format!("{name}: {line}")))
            .collect();
        lines.sort();
        lines
    }

    /// The scenes for which what was recorded had to stand in, with the reason, one line each.
    pub fn stand_ins(&self) -> Vec<String> {
        self.stood_in.borrow().clone()
    }

    /// What was recorded of a scene that cannot be read.
    fn recorded_scene(&self, scene: &str, why: &Error) -> Option<SceneFacts> {
        let facts = self.recorded.get(scene)?.clone();
        let layout = SampleLayout::parse(&facts.layout)?;
        self.layouts.borrow_mut().insert(facts.name.clone(), layout);
        if !self.folders.is_empty() {
            self.stood_in.borrow_mut().push(format!("{scene} cannot be read, so it counts as unchanged: {why}"));
        }
        Some(facts)
    }

    /// Reads a scene's files and keeps it open.
    fn read_scene(&self, scene: &str) -> Result<SceneFacts> {
        let path = self.find(scene)?;
        let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let loaded = load::open(&path, &self.options)?;
        let framebuffer = loaded.config.framebuffer;
        let size = Size { width: framebuffer.res_w, height: framebuffer.res_h };
        let full = Scene::new(&loaded.config, loaded.mesh.clone(), (size.width, size.height), Stage::Final)?;
        let facts = SceneFacts {
            name: name.clone(),
            content_hash: loaded.content_sha256(),
            size,
            spp: framebuffer.sppx,
            layout: full.layout.to_string(),
            exact_reference: exact::closed_form(&loaded, size).is_some(),
            lens: full.focal_depth().is_some(),
            lights: full.lights.as_ref().map(|lights| lights.lights().len() as u32),
            exposure: framebuffer.exposure,
            memory_bytes: SCENE_COPIES * Scene::most_bytes(&full.mesh, 0),
        };
        self.layouts.borrow_mut().insert(name.clone(), full.layout.clone());
        let compiled = HashMap::from([(Compiled::full(), full)]);
        self.scenes.borrow_mut().insert(name, Opened { loaded, compiled });
        Ok(facts)
    }

    /// Where the file of a scene is.
    fn find(&self, scene: &str) -> Result<PathBuf> {
        let (name, mut places) = match scene.ends_with(".json") {
            true => (scene.to_owned(), vec![PathBuf::from(scene)]),
            false => (format!("{scene}.json"), Vec::new()),
        };
        places.extend(self.folders.iter().map(|folder| folder.join(&name)));
        match places.iter().find(|place| place.is_file()) {
            Some(place) => Ok(place.clone()),
            None => {
                let places: Vec<String> = places.iter().map(|place| place.display().to_string()).collect();
                let what = format!("expected a scene file, found none at {}", places.join(", "));
                Err(Error::input(format!("scene {scene:?}"), what))
            }
        }
    }

    /// Threads to render with, kept from image to image.
    fn pool(&self, threads: usize) -> Result<Arc<rayon::ThreadPool>> {
        let mut pools = self.pools.borrow_mut();
        if let Some(pool) = pools.get(&threads) {
            return Ok(pool.clone());
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool =
            pool.map_err(|e| Error::input("--threads", format!("expected {threads} threads to start, found: {e}")))?;
        let pool = Arc::new(pool);
        pools.insert(threads, pool.clone());
        Ok(pool)
    }

    /// The decisions of a scene.
    fn layout(&self, scene: &str) -> SampleLayout {
        self.layouts.borrow().get(scene).expect("a plan asks for scenes that it opened").clone()
    }

    /// Looks at an open scene.
    fn with<T>(&self, scene: &str, look: impl FnOnce(&Opened) -> T) -> T {
        let scenes = self.scenes.borrow();
        look(scenes.get(scene).expect("a plan asks for scenes that it opened"))
    }
}

/// The samplers of a canonical text.
fn set(canonical: &str) -> Result<SamplerSet> {
    SamplerSet::parse(canonical, Preset::Best)
}

/// The one sampler of a canonical text.
fn single(canonical: &str) -> Result<SamplerSpec> {
    let mixed = || Error::input(format!("sampler {canonical:?}"), "expected one sampler, found one for each decision");
    set(canonical)?.single().ok_or_else(mixed)
}

impl Backend for Lab {
    fn open_scene(&self, scene: &str) -> Result<SceneFacts> {
        self.read_scene(scene).or_else(|why| self.recorded_scene(scene, &why).ok_or(why))
    }

    fn parse_sampler(&self, text: &str) -> Result<String> {
        Ok(set(text)?.to_string())
    }

    fn is_mixed(&self, canonical: &str) -> bool {
        set(canonical).is_ok_and(|set| set.single().is_none())
    }

    fn meaning(&self, canonical: &str, scene: &str) -> String {
        let made: Vec<Decision> = self.layout(scene).claims().iter().map(|claim| claim.decision).collect();
        set(canonical).map_or_else(|_| canonical.to_owned(), |set| set.meaning(&made))
    }

    fn is_random(&self, canonical: &str, scene: Option<&str>) -> bool {
        match scene {
            Some(scene) => set(canonical).is_ok_and(|set| set.is_random(&self.layout(scene))),
            None => single(canonical).is_ok_and(|spec| spec.is_random()),
        }
    }

    fn taken(&self, canonical: &str, scene: Option<&str>, asked: u32) -> u32 {
        match scene {
            Some(scene) => set(canonical).map_or(asked, |set| set.taken(asked, &self.layout(scene))),
            None => single(canonical).map_or(asked, |spec| spec.taken(asked)),
        }
    }

    fn check_sampler(&self, canonical: &str, scene: &str) -> Result<()> {
        let set = set(canonical)?;
        Sampler::new(set, &self.layout(scene), 1, 0).map(|_| ())
    }

    fn check_variant(&self, scene: &str, variant: Variant) -> Result<()> {
        let scenes = self.scenes.borrow();
        // What was recorded was checked when it was made.
        let Some(opened) = scenes.get(scene) else { return Ok(()) };
        let at = |e: Error| Error { place: format!("{}: {variant}", e.place), ..e };
        check_reach(opened.compiled[&Compiled::full()].reach() * variant.scale()).map_err(at)
    }

    fn algorithms(&self, _: &str) -> Algorithms {
        Algorithms {
            renderer: render::ALGORITHM,
            sampler: sampling::ALGORITHM,
            estimator: ESTIMATOR_ALGORITHM,
            exact: exact::ALGORITHM,
            metrics: METRICS_ALGORITHM,
        }
    }

    fn prepare(&self, request: &RenderRequest) -> Result<()> {
        self.pool(request.threads)?;
        let mut scenes = self.scenes.borrow_mut();
        let opened = scenes.get_mut(request.scene).expect("a plan asks for scenes that it opened");
        let size = (request.size.width, request.size.height);
        let wanted = Compiled::new(request.stage, request.variant);
        opened.compiled.retain(|&compiled, _| compiled == Compiled::full() || compiled == wanted);
        let scene = match opened.compiled.entry(wanted) {
            std::collections::hash_map::Entry::Occupied(entry) => entry.into_mut(),
            std::collections::hash_map::Entry::Vacant(entry) => {
                let (config, mesh) = scaled(&opened.loaded.config, &opened.loaded.mesh, request.variant.scale());
                entry.insert(Scene::new(&config, mesh, size, request.stage)?)
            }
        };
        scene.resize(size);
        scene.estimator = request.estimator;
        Ok(())
    }

    fn render(&self, request: &RenderRequest) -> Result<Image> {
        self.prepare(request)?;
        let pool = self.pool(request.threads)?;
        let set = set(request.sampler)?;
        self.with(request.scene, |opened| {
            let scene = &opened.compiled[&Compiled::new(request.stage, request.variant)];
            let go_on = |_| !request.stop.is_some_and(|stop| stop.load(Ordering::Relaxed));
            let pass = |number: u64, asked: u32| {
                // The first pass draws what a single one would; a later one begins anew with numbers of its own.
                let seed = if number == 0 { request.seed } else { derive(request.seed, &[number]) };
                let sampler = Sampler::new(set, &scene.layout, asked, seed)?;
                match pool.install(|| render::render_while(scene, &sampler, &go_on)) {
                    Ok(Some(rendered)) => Ok((rendered.image, sampler.samples())),
                    Ok(None) => Err(Error::interrupted(request.scene, "told to end while rendering")),
                    Err(bad) => Err(Error::incomplete(request.scene, bad)),
                }
            };
            let mut passes = (0..).zip(request.variant.passes(request.spp));
            let (number, asked) = passes.next().expect("an image takes a pass at least");
            let first = pass(number, asked)?;
            passes
                .try_fold(first, |done, (number, asked)| Ok(joined(done, pass(number, asked)?)))
                .map(|(image, _)| image)
        })
    }

    fn draw_numbers(&self, request: &RenderRequest) -> Result<bool> {
        self.prepare(request)?;
        let pool = self.pool(request.threads)?;
        let set = set(request.sampler)?;
        self.with(request.scene, |opened| {
            let scene = &opened.compiled[&Compiled::new(request.stage, request.variant)];
            for (number, asked) in (0..).zip(request.variant.passes(request.spp)) {
                let seed = if number == 0 { request.seed } else { derive(request.seed, &[number]) };
                let sampler = Sampler::new(set, &scene.layout, asked, seed)?;
                pool.install(|| render::draw_numbers(scene, &sampler));
            }
            Ok(true)
        })
    }

    fn focal_depth(&self, scene: &str, size: Size) -> Option<f64> {
        let mut scenes = self.scenes.borrow_mut();
        let full = scenes.get_mut(scene)?.compiled.get_mut(&Compiled::full())?;
        full.resize((size.width, size.height));
        full.focal_depth().map(f64::from)
    }

    fn exact_reference(&self, scene: &str, size: Size) -> Result<Image> {
        match self.with(scene, |opened| exact::closed_form(&opened.loaded, size)) {
            Some(exact) => exact::image(&exact, size),
            None => Err(Error::incomplete(scene, format!("expected a closed form at {size}, found none"))),
        }
    }

    fn point_metric_names(&self) -> &'static [&'static str] {
        &POINT_METRICS
    }

    fn point_metrics(&self, canonical: &str, n: u32, seed: u64, metrics: &[String]) -> Result<PointMetrics> {
        let set = point_set(single(canonical)?, n, seed)?;
        let points = Points::new_2d(&set).map_err(|e| Error::incomplete(canonical, e))?;
        metrics.iter().map(|name| Ok((name.clone(), point_metric(name, &points)?))).collect()
    }

    fn predict(&self, work: &PredictionWork, threads: usize) -> Result<Predicted> {
        let request = RenderRequest {
            scene: &work.scene,
            sampler: &work.sampler,
            spp: work.spp.asked,
            seed: work.seed,
            size: work.size,
            estimator: Estimator::Unbiased,
            stage: Stage::Final,
            variant: Variant::Plain,
            threads,
            stop: None,
        };
        self.prepare(&request)?;
        let (pool, set) = (self.pool(threads)?, set(&work.sampler)?);
        self.with(&work.scene, |opened| {
            let scene = &opened.compiled[&Compiled::full()];
            let mut known = self.integrands.borrow_mut();
            let mut integrand = |pixel: [u32; 2]| {
                let key = (work.scene.clone(), work.size, pixel);
                known
                    .entry(key)
                    .or_insert_with(|| Arc::new(pool.install(|| prediction::integrand(scene, pixel))))
                    .clone()
            };
            let integrands: Vec<_> = work.pixels.iter().map(|&pixel| integrand(pixel)).collect();
            pool.install(|| prediction::predict(scene, set, work, &integrands))
        })
    }
}

/// Two images as one of all their samples: means weighted by the samples taken, in f64, rounded once.
fn joined((mut a, na): (Image, u32), (b, nb): (Image, u32)) -> (Image, u32) {
    let (wa, wb) = (f64::from(na), f64::from(nb));
    for (a, b) in a.pixels.as_flattened_mut().iter_mut().zip(b.pixels.as_flattened()) {
        *a = ((wa * f64::from(*a) + wb * f64::from(*b)) / (wa + wb)) as f32;
    }
    (a, na + nb)
}

/// One metric of a set in the plane; roots of the L2 kinds.
fn point_metric(name: &str, points: &Points) -> Result<Option<f64>> {
    let l2 = |kind| Ok(l2_root(points, kind));
    match name {
        "star" => Ok(Some(star_2d(points).value)),
        "t_value" => Ok(t_value(points).map(f64::from)),
        "min_toroidal_distance" => Ok(min_toroidal_distance(points)),
        "l2_star" => l2(L2Kind::Star),
        "centred_l2" => l2(L2Kind::Centred),
        "wrap_around_l2" => l2(L2Kind::WrapAround),
        "mixture_l2" => l2(L2Kind::Mixture),
        "modified_l2" => l2(L2Kind::Modified),
        "extreme_l2" => l2(L2Kind::Extreme),
        "symmetric_l2" => l2(L2Kind::Symmetric),
        "periodic_l2" => l2(L2Kind::Periodic),
        "diaphony" => l2(L2Kind::Diaphony),
        _ => Err(Error::input(name, format!("expected one of the metrics {}", POINT_METRICS.join(" ")))),
    }
}

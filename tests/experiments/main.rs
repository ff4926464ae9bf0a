//! Experiments from end to end, on a backend small enough to look through: plans stay put, kills leave no trace, the
//! thread count is nowhere in the results, and whatever is wrong with a file or a folder is said.

use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use sampler_lab::error::{Error, Result};
use sampler_lab::experiment::backend::{Algorithms, Backend, PointMetrics, RenderRequest, SceneFacts, Size, Stage};
use sampler_lab::experiment::execute::{Options, Outcome, execute};
use sampler_lab::experiment::lab::Lab;
use sampler_lab::experiment::merge::Sources;
use sampler_lab::experiment::plan::{Plan, Work, plan, refuse_equal_seeds};
use sampler_lab::experiment::progress::{Progress, Silent, Tick};
use sampler_lab::experiment::results::{self, Kind, Row};
use sampler_lab::experiment::shards::{Shard, blocks};
use sampler_lab::experiment::spec::Experiment;
use sampler_lab::experiment::status::Status;
use sampler_lab::experiment::survey::{Limits, Standing, State, Survey};
use sampler_lab::experiment::why::Reason;
use sampler_lab::film::{Image, read_exr};
use sampler_lab::render::render;
use sampler_lab::sampling::{Preset, Sampler, SamplerSpec};
use sampler_lab::scene::compile::Scene;
use sampler_lab::scene::json;
use sampler_lab::scene::load::{self, OpenOptions};
use sampler_lab::stats::{Family, t_test};

mod backend;
mod images;
mod plans;
mod runs;
mod shards;
mod timings;

/// A backend whose image is a ramp plus noise of variance 1/spp, so errors behave like errors.
struct Toy {
    content: &'static str,
    numbers: Algorithms,
    /// Every render asked for: scene, sampler, spp, seed.
    rendered: RefCell<Vec<(String, String, u32, u64)>>,
    /// Renders of this sampler and spp fail.
    broken: Option<(&'static str, u32)>,
    /// Added to every pixel: code whose bits changed.
    drift: Cell<f32>,
}

impl Toy {
    fn new() -> Self {
        Self {
            content: "",
            numbers: Algorithms { renderer: 1, sampler: 1, estimator: 1, exact: 1, metrics: 1 },
            rendered: RefCell::default(),
            broken: None,
            drift: Cell::new(0.0),
        }
    }

    fn renders(&self) -> usize {
        self.rendered.borrow().len()
    }
}

/// SplitMix64 (Steele, Lea & Flood 2014), one step.
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// What the toy's image would be with endless samples.
fn truth(size: Size) -> Image {
    let at = |i: u64| (i % u64::from(size.width)) as f32 / size.width as f32;
    let pixels = (0..size.pixels()).map(|i| [at(i), 0.5, 1.0 - at(i)]).collect();
    Image { width: size.width, height: size.height, pixels }
}

impl Backend for Toy {
    fn open_scene(&self, scene: &str) -> Result<SceneFacts> {
        if scene == "nowhere" {
            return Err(Error::input(scene, "expected a scene file, found none"));
        }
        let name = Path::new(scene).file_stem().unwrap().to_str().unwrap();
        Ok(SceneFacts {
            name: name.to_owned(),
            content_hash: format!("{name}{}", self.content),
            size: Size { width: 5, height: 4 },
            spp: 3,
            layout: "pixel 0-1".to_owned(),
            exact_reference: name == "exact",
            lens: name == "ramp",
            exposure: 3.0,
            lights: None,
            memory_bytes: 1000,
        })
    }

    fn parse_sampler(&self, text: &str) -> Result<String> {
        let canonical = match text {
            "fresh" | "fresh:sheet" | "fresh:best" => "fresh:step",
            "grid" => "grid:none",
            "strata" => "strata:jitter",
            "net" => "net:owen",
            "truth" => "truth:owen",
            _ => return Err(Error::input(text, "expected one of the samplers fresh grid strata net truth")),
        };
        Ok(canonical.to_owned())
    }

    fn is_random(&self, canonical: &str, _: Option<&str>) -> bool {
        canonical != "grid:none"
    }

    fn taken(&self, canonical: &str, _: Option<&str>, asked: u32) -> u32 {
        if canonical.starts_with("strata") { asked.next_multiple_of(2) } else { asked }
    }

    fn algorithms(&self, _: &str) -> Algorithms {
        self.numbers
    }

    fn prepare(&self, _: &RenderRequest) -> Result<()> {
        Ok(())
    }

    fn render(&self, request: &RenderRequest) -> Result<Image> {
        let &RenderRequest { scene, sampler, spp, seed, size, .. } = request;
        assert!(request.threads > 0);
        self.rendered.borrow_mut().push((scene.to_owned(), sampler.to_owned(), spp, seed));
        if self.broken == Some((sampler, spp)) {
            return Err(Error::incomplete(scene, "expected finite radiance, found NaN in pixel (1, 2), sample 3"));
        }
        let mut image = truth(size);
        let seed = if sampler == "grid:none" { 7 } else { seed };
        for (i, pixel) in image.pixels.iter_mut().enumerate() {
            for (c, value) in pixel.iter_mut().enumerate() {
                let random = mix(seed ^ mix(3 * i as u64 + c as u64)) as f64 / 2f64.powi(64) - 0.5;
                *value += (random / f64::from(self.taken(sampler, None, spp)).sqrt()) as f32 + self.drift.get();
            }
        }
        Ok(image)
    }

    fn focal_depth(&self, scene: &str, _: Size) -> Option<f64> {
        (scene == "ramp").then_some(4.5)
    }

    fn exact_reference(&self, scene: &str, size: Size) -> Result<Image> {
        self.rendered.borrow_mut().push((scene.to_owned(), "closed form".to_owned(), 0, 0));
        Ok(truth(size))
    }

    fn point_metric_names(&self) -> &'static [&'static str] {
        &["star", "t_value"]
    }

    fn point_metrics(&self, canonical: &str, n: u32, seed: u64, metrics: &[String]) -> Result<PointMetrics> {
        let n = self.taken(canonical, None, n);
        let value = |name: &String| (name == "star").then(|| (mix(seed) % 1000) as f64 / (1000.0 * f64::from(n)));
        Ok(metrics.iter().map(|name| (name.clone(), value(name))).collect())
    }
}

const SMALL: &str = r#"{
    "name": "small", "seed": 11, "scenes": ["ramp", "exact"], "size": {"exact": "4x4"},
    "samplers": ["fresh:sheet", "grid", "strata", "fresh:best"], "spp": [1, 4], "replicates": 3,
    "reference": {"sampler": "truth", "spp": 64},
    "points": {"n": [1, 2, 4], "metrics": ["star", "t_value"], "replicates": 2},
    "pictures": {"scene": "ramp", "size": "8x4", "spp": 2, "reference_spp": 16}
}"#;

fn experiment(text: &str) -> Experiment {
    Experiment::from_value(&json::parse(text.as_bytes(), "small.json").unwrap(), "small.json").unwrap()
}

fn edited(from: &str, to: &str) -> Experiment {
    let text = SMALL.replacen(from, to, 1);
    assert_ne!(text, SMALL, "{from}");
    experiment(&text)
}

fn small(toy: &Toy) -> Plan {
    plan(&experiment(SMALL), toy).unwrap()
}

fn options() -> Options<'static> {
    Options::new(2, "sampler-lab run small.json")
}

fn run(plan: &Plan, toy: &Toy, out: &Path) -> Outcome {
    execute(plan, toy, out, &Silent, &options()).unwrap()
}

fn rows(out: &Path) -> Vec<Row> {
    results::read(&results::results_path(out)).unwrap()
}

/// Everything that may not depend on how a run went: every file but the timings, by name. Of images the pixels, bit for
/// bit, and the provenance in order: the order of an EXR's attributes is its library's.
fn bytes(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for folder in [out.to_owned(), out.join("images")] {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            if name.ends_with(".exr") {
                let (image, provenance) = read_exr(&path).unwrap();
                let pixels: Vec<[u32; 3]> = image.pixels.iter().map(|pixel| pixel.map(f32::to_bits)).collect();
                files.insert(name, format!("{provenance:?} {} {pixels:?}", image.width).into_bytes());
            } else if path.is_file() && name != "timings.jsonl" && name != ".lock" {
                files.insert(name, std::fs::read(&path).unwrap());
            }
        }
    }
    files
}

/// Equal files, or the names of those that differ.
#[track_caller]
fn assert_same(found: &BTreeMap<String, Vec<u8>>, expected: &BTreeMap<String, Vec<u8>>, what: impl std::fmt::Display) {
    let names: HashSet<&String> = found.keys().chain(expected.keys()).collect();
    let differ: Vec<_> = names.into_iter().filter(|name| found.get(*name) != expected.get(*name)).collect();
    assert!(differ.is_empty(), "{what}: {differ:?}");
}

/// The folder of an undisturbed run.
fn undisturbed() -> (tempfile::TempDir, BTreeMap<String, Vec<u8>>) {
    let folder = tempfile::tempdir().unwrap();
    let toy = Toy::new();
    run(&small(&toy), &toy, folder.path()).check().unwrap();
    let bytes = bytes(folder.path());
    (folder, bytes)
}

/// (id, seed) of every item by its words.
fn identities(plan: &Plan) -> HashMap<String, (String, Option<u64>)> {
    plan.items.iter().map(|item| (item.label(), (item.id.clone(), item.seed()))).collect()
}

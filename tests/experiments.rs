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

// --- files ---

#[test]
fn the_experiments_that_come_with_the_lab_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/experiments");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let experiment = Experiment::read(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(path.file_stem().unwrap().to_str(), Some(experiment.name.as_str()));
    }
}

/// Whatever one slip of the hand makes of a file, the answer is an experiment or a message, never a panic.
#[test]
fn no_byte_left_out_or_put_in_upsets_the_reader() {
    let mut refused = 0;
    for at in 0..SMALL.len() {
        for slip in [&b""[..], b"\"", b"-", b"9", b"{", b"\xff"] {
            let mut text = SMALL.as_bytes().to_vec();
            text.splice(at..=at, slip.iter().copied());
            let read = json::parse(&text, "small.json").and_then(|value| Experiment::from_value(&value, "small.json"));
            if let Err(error) = read {
                assert!(error.exit_code() == 2 && error.place.starts_with("small.json"), "{error}");
                refused += 1;
            }
        }
    }
    assert!(refused > SMALL.len(), "{refused}");
}

// --- plans ---

#[test]
fn a_plan_lists_every_item_once_and_deterministic_samplers_have_one_replicate() {
    let plan = small(&Toy::new());
    let count = |kind: Kind| plan.items.iter().filter(|item| item.kind() == kind).count();
    // Samplers: fresh (two names), grid (nothing random), strata. Replicates of a scene and spp: 3 + 1 + 3.
    assert_eq!(plan.samplers.len(), 3);
    assert_eq!(count(Kind::Points), 3 * (2 + 1 + 2));
    assert_eq!(count(Kind::Render), 2 * 2 * (3 + 1 + 3));
    assert_eq!(count(Kind::Ensemble), 2 * 2 * 3);
    assert_eq!(count(Kind::ReferenceHalf), 2 + 2, "ramp and the pictures; exact has a closed form");
    assert_eq!(count(Kind::Reference), 3);
    assert_eq!(count(Kind::Picture), 3);
    assert_eq!(count(Kind::Stage), 4);
    let ids: HashSet<&str> = plan.items.iter().map(|item| item.id.as_str()).collect();
    assert_eq!(ids.len(), plan.items.len());
    let seeds: HashSet<u64> = plan.items.iter().filter_map(|item| item.seed()).collect();
    assert_eq!(seeds.len(), plan.items.iter().filter(|item| item.seed().is_some()).count());
}

#[test]
fn two_names_of_one_sampler_are_done_once_and_said() {
    let plan = small(&Toy::new());
    assert_eq!(plan.names("fresh:step"), ["fresh:sheet", "fresh:best"]);
    assert!(
        plan.notes.iter().any(|note| note.contains("fresh:sheet and fresh:best are one sampler")),
        "{:?}",
        plan.notes
    );
    assert!(plan.notes.iter().any(|note| note.contains("ramp, grid: nothing random")), "{:?}", plan.notes);
    assert!(plan.notes.iter().any(|note| note == "ramp, strata: 1 spp asked, 2 taken"), "{:?}", plan.notes);
}

#[test]
fn adding_a_sampler_a_scene_an_spp_or_replicates_changes_no_id_and_no_seed() {
    let toy = Toy::new();
    let before = identities(&small(&toy));
    let edits = [
        ("\"samplers\": [", "\"samplers\": [\"net\", "),
        ("\"scenes\": [", "\"scenes\": [\"other\", "),
        ("\"spp\": [1", "\"spp\": [16, 1"),
        ("\"n\": [1", "\"n\": [8, 1"),
        ("\"name\": \"small\"", "\"name\": \"renamed\""),
    ];
    for (from, to) in edits {
        let after = identities(&plan(&edited(from, to), &toy).unwrap());
        for (label, identity) in &before {
            assert_eq!(after.get(label), Some(identity), "{to}: {label}");
        }
    }
    // More replicates are more members: the ensembles are others, the images are not.
    let after = identities(&plan(&edited("\"replicates\": 3", "\"replicates\": 5"), &toy).unwrap());
    for (label, identity) in before.iter().filter(|(label, _)| !label.ends_with("ensemble") || label.contains("grid")) {
        assert_eq!(after.get(label), Some(identity), "{label}");
    }
}

#[test]
fn another_reference_keeps_the_images_but_not_what_was_found_against_it() {
    let toy = Toy::new();
    let before = identities(&small(&toy));
    let after = identities(&plan(&edited("\"spp\": 64", "\"spp\": 128"), &toy).unwrap());
    for (label, identity) in &before {
        let depends = label.starts_with("ramp") && (label.ends_with("ensemble") || label == "ramp 5x4 reference");
        if let Some(other) = after.get(label) {
            assert_eq!(other == identity, !depends, "{label}");
        }
    }
}

#[test]
fn an_id_changes_with_content_and_algorithm_numbers_and_with_nothing_else() {
    let base = Toy::new();
    let before = small(&base);
    let changed = |toy: &Toy| -> HashSet<Kind> {
        let after = small(toy);
        let pairs = before.items.iter().zip(&after.items);
        pairs.filter(|(a, b)| a.id != b.id).map(|(a, _)| a.kind()).collect()
    };
    let numbers = base.numbers;
    let with = |numbers| Toy { numbers, ..Toy::new() };
    use Kind::*;
    let images = HashSet::from([ReferenceHalf, Render, Picture, Stage, Reference, Ensemble]);
    assert_eq!(changed(&base), HashSet::new());
    assert_eq!(changed(&Toy { content: "edited", ..Toy::new() }), images);
    assert_eq!(changed(&with(Algorithms { renderer: 2, ..numbers })), images);
    assert_eq!(changed(&with(Algorithms { estimator: 2, ..numbers })), images);
    let all: HashSet<Kind> = images.iter().copied().chain([Points]).collect();
    assert_eq!(changed(&with(Algorithms { sampler: 2, ..numbers })), all);
    assert_eq!(changed(&with(Algorithms { metrics: 2, ..numbers })), HashSet::from([Points, Ensemble]));
    assert_eq!(changed(&with(Algorithms { exact: 2, ..numbers })), HashSet::from([Reference, Ensemble]));
}

/// Ids and seeds are what makes last year's rows this year's: should this test fail, all stored results are void.
/// Both values were computed apart from this code, with Python's hashlib over the fields and their lengths.
#[test]
fn ids_and_seeds_are_the_ones_of_the_first_release() {
    let plan = small(&Toy::new());
    let render = plan.items.iter().find(|item| item.kind() == Kind::Render).unwrap();
    assert_eq!(render.label(), "ramp fresh:step 1 spp 5x4 replicate 0");
    assert_eq!((render.id.as_str(), render.seed()), ("755f99b895f282c6", Some(10_628_564_637_087_314_005)));
}

#[test]
fn equal_seeds_are_refused_with_both_items_named() {
    let mut plan = small(&Toy::new());
    assert_eq!(refuse_equal_seeds(&plan.items, "small.json"), Ok(()));
    let half = plan.items.iter().find(|item| item.kind() == Kind::ReferenceHalf).unwrap().seed().unwrap();
    let render = plan.items.iter_mut().find(|item| item.kind() == Kind::Render).unwrap();
    let Work::Image(work) = &mut render.work else { panic!("a render is an image") };
    work.seed = half;
    let error = refuse_equal_seeds(&plan.items, "small.json").unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert!(error.what.contains("reference half 0") && error.what.contains("replicate 0"), "{error}");
}

#[test]
fn what_cannot_be_planned_is_refused_with_its_place() {
    let cases = [
        (
            "\"sampler\": \"truth\"",
            "\"sampler\": \"fresh\"",
            "small.json: reference.sampler: expected a sampler that is not compared",
        ),
        ("\"grid\", ", "", "ok"),
        ("\"grid\"", "\"gird\"", "small.json: samplers[1]: gird: expected one of the samplers"),
        ("\"sampler\": \"truth\"", "\"sampler\": \"none\"", "small.json: reference.sampler: none: expected"),
        (
            "\"star\"",
            "\"sta\"",
            "small.json: points.metrics[0]: expected one of the metrics star t_value, found \"sta\"; did you mean \"star\"?",
        ),
        ("\"ramp\", \"exact\"", "\"ramp\", \"exact\", \"nowhere\"", "nowhere: expected a scene file"),
        (
            "\"ramp\", \"exact\"",
            "\"ramp\", \"exact\", \"sub/ramp.json\"",
            "small.json: scenes[2]: expected scenes of different names",
        ),
    ];
    for (from, to, expected) in cases {
        match plan(&edited(from, to), &Toy::new()) {
            Ok(_) => assert_eq!(expected, "ok", "{to}"),
            Err(error) => assert!(error.exit_code() == 2 && error.to_string().contains(expected), "{error}"),
        }
    }
    let text = SMALL.replace("\"grid\", ", "").replace("\"sampler\": \"truth\"", "\"sampler\": \"grid\"");
    let error = plan(&experiment(&text), &Toy::new()).unwrap_err();
    assert!(error.what.contains("both halves of ramp would be one image"), "{error}");
}

// --- runs ---

#[test]
fn rows_are_in_plan_order_and_complete() {
    let (folder, _) = undisturbed();
    let plan = small(&Toy::new());
    let rows = rows(folder.path());
    assert!(rows.iter().map(Row::id).eq(plan.items.iter().map(|item| item.id.as_str())));
    assert!(rows.iter().map(Row::kind).eq(plan.items.iter().map(|item| item.kind())));
    for row in &rows {
        match row {
            Row::Ensemble(row) => {
                let is_random = row.sampler != "grid:none";
                assert_eq!(row.replicates, if is_random { 3 } else { 1 });
                assert_eq!(row.variance.is_some(), is_random, "nothing random has no variance");
            }
            Row::Reference(row) => {
                assert_eq!(row.noise_mse == 0.0, row.scene == "exact");
                assert_eq!(row.focal_depth, (row.scene == "ramp").then_some(4.5), "what auto focus found is recorded");
            }
            Row::Image(row) if row.sampler == "fresh:step" => assert_eq!(row.names, ["fresh:sheet", "fresh:best"]),
            Row::Image(_) | Row::Points(_) | Row::Prediction(_) => {}
        }
    }
    let about = results::read_about(&results::about_path(folder.path())).unwrap();
    assert_eq!((about.experiment.name.as_str(), about.scenes.len()), ("small", 2));
    assert_eq!(about.command, "sampler-lab run small.json");
}

/// The toy's noise is uniform on an interval of width 1/√n: its variance is 1/(12n) for n samples taken.
///
/// 60 or 48 channels × 3 replicates give a relative standard error of the variance near √(0.8/120) = 8 %, that of 300 degrees
/// of freedom: above a bar of 60 % with probability e^(−150 (0.6 − ln 1.6)) = 3e-9 (Chernoff), 3e-8 for 8 ensembles.
/// A channel left out or counted twice is beyond it. False alarms: 3e-8.
#[test]
fn errors_are_those_of_the_images() {
    let (folder, _) = undisturbed();
    for row in rows(folder.path()) {
        let Row::Ensemble(row) = row else { continue };
        let Some(variance) = row.variance else { continue };
        let exact = 1.0 / (12.0 * f64::from(row.spp.taken));
        assert!((variance.value / exact - 1.0).abs() < 0.6, "{} {}: {variance:?}", row.sampler, row.spp.asked);
        assert!((row.mse.value - row.bias2.value - variance.value * 2.0 / 3.0).abs() < 0.5 * exact, "{row:?}");
    }
}

#[test]
fn a_second_run_does_nothing_and_changes_nothing() {
    let (folder, before) = undisturbed();
    let toy = Toy::new();
    let timings = std::fs::read(results::timings_path(folder.path())).unwrap();
    let outcome = run(&small(&toy), &toy, folder.path());
    assert_eq!((outcome.done, outcome.found, toy.renders()), (0, outcome.items, 0));
    assert_same(&bytes(folder.path()), &before, "");
    assert_eq!(std::fs::read(results::timings_path(folder.path())).unwrap(), timings);
}

#[test]
fn a_run_killed_after_any_number_of_items_goes_on_to_the_same_bytes() {
    let (_keep, expected) = undisturbed();
    let items = small(&Toy::new()).items.len();
    for step in [1, 7, items - 1] {
        let folder = tempfile::tempdir().unwrap();
        let toy = Toy::new();
        let plan = small(&toy);
        let mut runs = 0;
        loop {
            runs += 1;
            let options = Options { at_most: Some(step), ..options() };
            let outcome = execute(&plan, &toy, folder.path(), &Silent, &options).unwrap();
            assert_eq!(outcome.check().is_err(), outcome.interrupted);
            if !outcome.interrupted {
                break;
            }
        }
        assert_eq!(runs, items.div_ceil(step), "{step}");
        assert_same(&bytes(folder.path()), &expected, format!("{step} items at a time"));
        let distinct: HashSet<_> = toy.rendered.borrow().iter().cloned().collect();
        assert_eq!(distinct.len(), toy.renders(), "an image was rendered twice");
    }
}

#[test]
fn rows_cut_at_any_byte_are_done_again_to_the_same_bytes() {
    let (folder, expected) = undisturbed();
    let path = results::results_path(folder.path());
    let whole = std::fs::read(&path).unwrap();
    let toy = Toy::new();
    let plan = small(&toy);
    // 60 places spread over the file, the ends among them, and each side of one line's end.
    let line_end = whole.iter().position(|&byte| byte == b'\n').unwrap();
    let places = (0..60u64).map(|i| (mix(i) % whole.len() as u64) as usize);
    for end in places.chain([0, 1, line_end, line_end + 1, line_end + 2, whole.len() - 1]) {
        std::fs::write(&path, &whole[..end]).unwrap();
        run(&plan, &toy, folder.path()).check().unwrap();
        assert_same(&bytes(folder.path()), &expected, format!("cut at {end}"));
    }
    assert_eq!(toy.renders(), 0, "the images were there");
}

#[test]
fn timings_cut_at_any_byte_are_taken_again() {
    let (folder, expected) = undisturbed();
    let path = results::timings_path(folder.path());
    let whole = std::fs::read(&path).unwrap();
    let plan = small(&Toy::new());
    for end in [0, 10, whole.len() / 2, whole.len() - 1] {
        std::fs::write(&path, &whole[..end]).unwrap();
        std::fs::write(results::results_path(folder.path()), "").unwrap();
        run(&plan, &Toy::new(), folder.path()).check().unwrap();
        assert_same(&bytes(folder.path()), &expected, format!("cut at {end}"));
        let images = plan.items.iter().filter(|item| item.kept_image().is_some()).count();
        assert_eq!(results::read_timings(&path).unwrap().len(), images, "every image has its seconds");
    }
}

/// Rounds of an image of [`SMALL`] with `timing`, by its words.
fn rounds_of(plan: &Plan, out: &Path) -> BTreeMap<String, usize> {
    let timings = results::read_timings(&results::timings_path(out)).unwrap();
    let again = timings.iter().filter_map(|timing| Some((&timing.id, timing.again.as_ref()?.seconds.len())));
    again.map(|(id, rounds)| (plan.items[plan.position(id).unwrap()].label(), rounds)).collect()
}

#[test]
fn images_are_timed_again_in_rounds_that_leave_no_trace_in_the_results() {
    let (_keep, mut expected) = undisturbed();
    let folder = tempfile::tempdir().unwrap();
    let timed = edited("\"seed\": 11,", "\"seed\": 11, \"timing\": {\"rounds\": 3, \"spp\": [4]},");
    let toy = Toy::new();
    let plan = plan(&timed, &toy).unwrap();
    let survey = Survey::new(&plan, &Standing::nothing(&plan), folder.path(), 2);
    run(&plan, &toy, folder.path()).check().unwrap();
    // Two scenes, three samplers, one count: the first replicate of each, 4 spp of 20 and of 16 pixels.
    let rounds = rounds_of(&plan, folder.path());
    assert_eq!((rounds.len(), rounds.values().copied().collect::<HashSet<_>>()), (6, HashSet::from([3])));
    assert!(rounds.keys().all(|label| label.ends_with("replicate 0") && label.contains(" 4 spp ")), "{rounds:?}");
    assert_eq!(survey.samples_timing, 3 * 3 * 4 * (20 + 16));
    let others = plan.items.iter().filter(|item| item.kept_image().is_some()).count();
    assert_eq!(toy.renders(), others + 3 * 6);
    // The toy draws no numbers apart from its images, so there is no share of them.
    let timings = results::read_timings(&results::timings_path(folder.path())).unwrap();
    assert!(
        timings.iter().filter_map(|t| t.again.as_ref()).all(|again| again.numbers.is_empty() && again.threads == 2)
    );
    let mut found = bytes(folder.path());
    found.remove("experiment.json");
    expected.remove("experiment.json");
    assert_same(&found, &expected, "rounds");
    let toy = Toy::new();
    run(&plan, &toy, folder.path()).check().unwrap();
    assert_eq!(toy.renders(), 0, "all rounds are done");
}

#[test]
fn rounds_are_gone_on_with_begun_anew_on_other_threads_and_catch_code_that_drifts() {
    let folder = tempfile::tempdir().unwrap();
    let timed = edited("\"seed\": 11,", "\"seed\": 11, \"timing\": {\"rounds\": 3},");
    let plan = plan(&timed, &Toy::new()).unwrap();
    run(&plan, &Toy::new(), folder.path()).check().unwrap();
    let path = results::timings_path(folder.path());
    // As a kill in the second round leaves it: the first three images have two rounds, the others one.
    let mut left = 3;
    let lines: Vec<String> = results::read_timings(&path)
        .unwrap()
        .into_iter()
        .map(|mut timing| {
            if let Some(again) = &mut timing.again {
                again.seconds.truncate(if left > 0 { 2 } else { 1 });
                left -= i32::from(left > 0);
            }
            serde_json::to_string(&timing).unwrap() + "\n"
        })
        .collect();
    std::fs::write(&path, lines.concat()).unwrap();
    let toy = Toy::new();
    run(&plan, &toy, folder.path()).check().unwrap();
    assert_eq!(toy.renders(), 3 + 9 * 2);
    assert!(rounds_of(&plan, folder.path()).values().all(|&rounds| rounds == 3));
    let toy = Toy::new();
    let options = Options { threads: 1, ..options() };
    execute(&plan, &toy, folder.path(), &Silent, &options).unwrap().check().unwrap();
    assert_eq!(toy.renders(), 12 * 3, "another number of threads is another time");
    let timings = results::read_timings(&path).unwrap();
    assert!(
        timings.iter().filter_map(|t| t.again.as_ref()).all(|again| again.threads == 1 && again.seconds.len() == 3)
    );
    // Another making of an image with other pixels is a failure that says so, and no time.
    let drifting = Toy::new();
    drifting.drift.set(0.25);
    let outcome = run(&plan, &drifting, folder.path());
    let failure = &outcome.failures[0];
    assert!(failure.error.to_string().contains("one image, two makings"), "{failure:?}");
    assert_eq!((outcome.failures.len(), outcome.check().unwrap_err().exit_code()), (12, 4));
}

#[test]
fn a_file_of_other_programs_points_is_read_from_beside_the_experiment_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("small.json");
    std::fs::write(&path, SMALL.replacen('{', "{\"peers\": \"peers.json\",", 1)).unwrap();
    let error = Experiment::read(&path).unwrap_err();
    assert!(error.exit_code() == 2 && error.place.ends_with("peers.json"), "{error}");
    let point = r#"{"name": "M", "scene": "ramp", "size": "5x4", "spp": 4, "seconds": 1, "rmse": 0.5, "machine": "m", "date": "2026-11-25"}"#;
    std::fs::write(folder.path().join("peers.json"), format!("{{\"points\": [{point}]}}")).unwrap();
    let experiment = Experiment::read(&path).unwrap();
    let recorded = serde_json::to_string(&experiment).unwrap();
    assert_eq!(experiment.peers.as_ref().map(|peers| peers.points.len()), Some(1));
    assert!(recorded.contains("\"rmse\":0.5"), "{recorded}");
    assert_eq!(identities(&plan(&experiment, &Toy::new()).unwrap()), identities(&small(&Toy::new())));
}

#[test]
fn a_broken_line_inside_the_rows_is_an_error_with_its_number() {
    let (folder, _) = undisturbed();
    let path = results::results_path(folder.path());
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replacen("\"schema\":1", "\"schema\":", 2)).unwrap();
    let toy = Toy::new();
    let error = execute(&small(&toy), &toy, folder.path(), &Silent, &options()).unwrap_err();
    assert!(error.exit_code() == 2 && error.place.ends_with("results.jsonl:1"), "{error}");
}

#[test]
fn the_thread_count_is_nowhere_in_the_results() {
    let (_keep, expected) = undisturbed();
    for threads in [1, 7] {
        let folder = tempfile::tempdir().unwrap();
        let toy = Toy::new();
        let options = Options { threads, ..options() };
        execute(&small(&toy), &toy, folder.path(), &Silent, &options).unwrap().check().unwrap();
        assert_same(&bytes(folder.path()), &expected, format!("{threads} threads"));
        let timings = results::read_timings(&results::timings_path(folder.path())).unwrap();
        assert!(timings.iter().all(|timing| timing.threads == threads));
    }
}

#[test]
fn an_experiment_that_grows_keeps_what_it_has_and_shrinks_back_to_the_same_bytes() {
    let (folder, expected) = undisturbed();
    let toy = Toy::new();
    let more = edited("\"samplers\": [", "\"samplers\": [\"net\", ");
    run(&plan(&more, &toy).unwrap(), &toy, folder.path()).check().unwrap();
    assert!(toy.rendered.borrow().iter().all(|(_, sampler, ..)| sampler == "net:owen"), "only the new sampler ran");
    let toy = Toy::new();
    run(&small(&toy), &toy, folder.path()).check().unwrap();
    assert_eq!(toy.renders(), 0);
    let after = bytes(folder.path());
    assert!(expected.iter().all(|(name, bytes)| after.get(name) == Some(bytes)));
}

#[test]
fn an_alias_that_goes_leaves_the_names_of_the_rows() {
    let (folder, _) = undisturbed();
    let toy = Toy::new();
    let fewer = edited(", \"fresh:best\"]", "]");
    run(&plan(&fewer, &toy).unwrap(), &toy, folder.path()).check().unwrap();
    assert_eq!(toy.renders(), 0);
    let named =
        |row: &Row| matches!(row, Row::Points(row) if row.sampler == "fresh:step" && row.names == ["fresh:sheet"]);
    assert!(rows(folder.path()).iter().any(named));
}

#[test]
fn a_new_reference_is_compared_with_the_images_that_are_there() {
    let (folder, _) = undisturbed();
    let toy = Toy::new();
    let better = edited("\"spp\": 64", "\"spp\": 256");
    run(&plan(&better, &toy).unwrap(), &toy, folder.path()).check().unwrap();
    assert_eq!(toy.renders(), 2, "the two halves of the one reference that is rendered");
    let fresh = tempfile::tempdir().unwrap();
    run(&plan(&better, &toy).unwrap(), &toy, fresh.path()).check().unwrap();
    assert_eq!(
        std::fs::read(results::results_path(folder.path())).unwrap(),
        std::fs::read(results::results_path(fresh.path())).unwrap()
    );
}

#[test]
fn raised_metrics_measure_again_without_rendering() {
    let (folder, _) = undisturbed();
    let base = Toy::new();
    let toy = Toy { numbers: Algorithms { metrics: 2, ..base.numbers }, ..Toy::new() };
    run(&small(&toy), &toy, folder.path()).check().unwrap();
    assert_eq!(toy.renders(), 0);
    let number = |row: &Row| match row {
        Row::Image(row) => row.errors.as_ref().map(|errors| errors.metrics_algorithm),
        Row::Reference(row) => Some(row.metrics_algorithm),
        Row::Ensemble(row) => Some(row.metrics_algorithm),
        Row::Points(row) => Some(row.metrics_algorithm),
        Row::Prediction(_) => None,
    };
    assert!(rows(folder.path()).iter().filter_map(number).all(|number| number == 2));
}

/// Takes the images of some kinds away, or spoils them.
fn spoil(out: &Path, plan: &Plan, kinds: &[Kind], spoil: impl Fn(&Path)) {
    for item in plan.items.iter().filter(|item| kinds.contains(&item.kind()) && item.kept_image().is_some()) {
        spoil(&results::image_path(out, &item.id));
    }
}

#[test]
fn a_torn_or_missing_image_is_made_again_when_a_row_needs_it() {
    let (folder, expected) = undisturbed();
    let plan = small(&Toy::new());
    let all = [Kind::Render, Kind::ReferenceHalf, Kind::Reference, Kind::Picture, Kind::Stage];
    let remove: fn(&Path) = |path| std::fs::remove_file(path).unwrap();
    let tear: fn(&Path) = |path| {
        let bytes = std::fs::read(path).unwrap();
        std::fs::write(path, &bytes[..bytes.len() - 9]).unwrap();
    };
    for damage in [remove, tear] {
        spoil(folder.path(), &plan, &all, damage);
        // Without rows everything is needed; with all but the last rows little is.
        std::fs::write(results::results_path(folder.path()), "").unwrap();
        run(&plan, &Toy::new(), folder.path()).check().unwrap();
        assert_same(&bytes(folder.path()), &expected, "");
    }
}

#[test]
fn what_a_report_shows_is_made_again_where_only_rows_were_kept() {
    let (folder, expected) = undisturbed();
    let toy = Toy::new();
    let plan = small(&toy);
    std::fs::remove_dir_all(folder.path().join("images")).unwrap();
    run(&plan, &toy, folder.path()).check().unwrap();
    // Three pictures, four stages and the two halves of the pictures' reference; no replicate.
    assert_eq!(toy.renders(), 3 + 4 + 2);
    let after = bytes(folder.path());
    assert_eq!(after["results.jsonl"], expected["results.jsonl"]);
    assert!(after.iter().all(|(name, bytes)| expected.get(name) == Some(bytes)));
}

#[test]
fn code_that_changed_its_bits_under_an_old_number_is_caught() {
    let (folder, _) = undisturbed();
    let toy = Toy::new();
    toy.drift.set(1e-3);
    std::fs::remove_dir_all(folder.path().join("images")).unwrap();
    let outcome = run(&small(&toy), &toy, folder.path());
    let error = outcome.check().unwrap_err();
    assert!(error.exit_code() == 4 && error.what.contains("kept its algorithm number"), "{error}");
    let fresh = Options { fresh: true, ..options() };
    execute(&small(&toy), &toy, folder.path(), &Silent, &fresh).unwrap().check().unwrap();
}

#[test]
fn a_fresh_run_does_everything_again_and_leaves_other_files_alone() {
    let (folder, mut expected) = undisturbed();
    std::fs::write(folder.path().join("notes.txt"), "mine").unwrap();
    expected.insert("notes.txt".to_owned(), b"mine".to_vec());
    let toy = Toy::new();
    let plan = small(&toy);
    let options = Options { fresh: true, ..options() };
    let outcome = execute(&plan, &toy, folder.path(), &Silent, &options).unwrap();
    assert_eq!((outcome.found, outcome.done), (0, plan.items.len()));
    assert_same(&bytes(folder.path()), &expected, "");
}

#[test]
fn an_item_that_fails_fails_alone_and_is_tried_again() {
    let folder = tempfile::tempdir().unwrap();
    let toy = Toy { broken: Some(("strata:jitter", 4)), ..Toy::new() };
    let plan = small(&toy);
    let outcome = run(&plan, &toy, folder.path());
    // Two scenes × (3 replicates + their ensemble).
    assert_eq!((outcome.failures.len(), outcome.done), (8, plan.items.len() - 8));
    let error = outcome.check().unwrap_err();
    assert!(error.exit_code() == 4 && error.what.contains("pixel (1, 2), sample 3"), "{error}");
    assert_eq!(rows(folder.path()).len(), plan.items.len() - 8);
    let broken =
        toy.rendered.borrow().iter().filter(|(_, sampler, spp, _)| sampler == "strata:jitter" && *spp == 4).count();
    assert_eq!(broken, 6, "what failed is not tried again for its ensemble");
    let mended = Toy::new();
    run(&plan, &mended, folder.path()).check().unwrap();
    assert_eq!(mended.renders(), 6);
    assert_same(&bytes(folder.path()), &undisturbed().1, "");
}

#[test]
fn a_reference_that_fails_takes_down_what_is_compared_with_it_and_no_more() {
    let folder = tempfile::tempdir().unwrap();
    let toy = Toy { broken: Some(("truth:owen", 64)), ..Toy::new() };
    let outcome = run(&small(&toy), &toy, folder.path());
    let (mut scenes, mut kinds) = (HashSet::new(), HashSet::new());
    for row in rows(folder.path()) {
        kinds.insert(row.kind());
        if let Row::Ensemble(row) = row {
            scenes.insert(row.scene);
        }
    }
    assert_eq!(scenes, HashSet::from(["exact".to_owned()]));
    assert!(kinds.contains(&Kind::Picture) && kinds.contains(&Kind::Points));
    assert_eq!(outcome.check().unwrap_err().exit_code(), 4);
}

#[test]
fn a_stop_from_elsewhere_ends_after_the_item_at_hand() {
    let folder = tempfile::tempdir().unwrap();
    let toy = Toy::new();
    let stop = AtomicBool::new(false);

    /// Stops at the third item.
    struct StopAt<'a>(&'a AtomicBool, Cell<usize>);
    impl Progress for StopAt<'_> {
        fn item_started(&self, _: &str, _: &Tick) {
            self.1.set(self.1.get() + 1);
            self.0.store(self.1.get() == 3, Ordering::Relaxed);
        }
        fn item_ended(&self, _: &Tick) {}
        fn warn(&self, message: &str) {
            panic!("{message}");
        }
    }

    let options = Options { stop: Some(&stop), ..options() };
    let progress = StopAt(&stop, Cell::new(0));
    let outcome = execute(&small(&toy), &toy, folder.path(), &progress, &options).unwrap();
    assert!(outcome.interrupted);
    assert_eq!((outcome.done, rows(folder.path()).len()), (3, 3));
}

#[test]
fn a_folder_that_cannot_be_written_is_a_writing_error_and_nothing_is_rendered() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a-file");
    std::fs::write(&file, "mine").unwrap();
    let toy = Toy::new();
    for out in [file.clone(), file.join("below")] {
        let error = execute(&small(&toy), &toy, &out, &Silent, &options()).unwrap_err();
        assert_eq!(error.exit_code(), 3, "{error}");
    }
    assert_eq!((toy.renders(), std::fs::read(&file).unwrap()), (0, b"mine".to_vec()));
}

#[test]
fn two_runs_in_one_folder_are_refused() {
    let folder = tempfile::tempdir().unwrap();

    /// Starts another run from within a run.
    struct Again<'a>(&'a Path, Cell<usize>);
    impl Progress for Again<'_> {
        fn item_started(&self, _: &str, _: &Tick) {
            let toy = Toy::new();
            let error = execute(&small(&toy), &toy, self.0, &Silent, &options()).unwrap_err();
            assert!(error.what.contains("found one at work"), "{error}");
            self.1.set(self.1.get() + 1);
        }
        fn item_ended(&self, _: &Tick) {}
        fn warn(&self, _: &str) {}
    }

    let toy = Toy::new();
    let progress = Again(folder.path(), Cell::new(0));
    let options = Options { at_most: Some(2), ..options() };
    execute(&small(&toy), &toy, folder.path(), &progress, &options).unwrap();
    assert_eq!(progress.1.get(), 2);
}

// --- costs ---

#[test]
fn a_survey_counts_what_is_left_and_changes_nothing() {
    let toy = Toy::new();
    let plan = small(&toy);
    let folder = tempfile::tempdir().unwrap();
    let survey = |out: &Path| Survey::new(&plan, &Standing::read(&plan, out).unwrap(), out, 2);
    let before = survey(folder.path());
    // Statistics: 3 + 1 replicates take what is asked, strata 2 for 1; ramp 5×4, exact 4×4. Reference 2 × 64 on ramp.
    let statistics = (20 + 16) * (4 * (1 + 4) + 3 * (2 + 4)) + 20 * 2 * 64;
    let pictures = 32 * (2 * 16 + 3 * 2 + 1 + 3 * 3);
    assert_eq!(before.samples, statistics + pictures);
    assert_eq!(before.samples_left, before.samples);
    assert!(!before.is_rate_measured && before.seconds_left > 0.0);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    let options = Options { at_most: Some(30), ..options() };
    execute(&plan, &toy, folder.path(), &Silent, &options).unwrap();
    let during = survey(folder.path());
    assert!(during.is_rate_measured && during.samples_left < before.samples_left);
    let half = plan.items.iter().find(|item| item.kind() == Kind::ReferenceHalf).unwrap();
    std::fs::remove_file(results::image_path(folder.path(), &half.id)).unwrap();
    assert_eq!(survey(folder.path()).samples_left, during.samples_left + half.samples(), "needed by items left");
    run(&plan, &toy, folder.path()).check().unwrap();
    let after = survey(folder.path());
    assert_eq!((after.samples_left, after.seconds_left), (0, 0.0));
    assert!(after.to_string().contains("stage                4 items, 0 to do"), "{after}");
}

#[test]
fn more_memory_or_disk_than_allowed_is_refused_before_work_starts() {
    let toy = Toy::new();
    let plan = small(&toy);
    let folder = tempfile::tempdir().unwrap();
    let survey = Survey::new(&plan, &Standing::read(&plan, folder.path()).unwrap(), folder.path(), 1);
    let enough = Limits { memory_bytes: survey.memory_bytes, disk_bytes: survey.disk_bytes };
    for (limits, what) in [
        (Limits { memory_bytes: enough.memory_bytes - 1, ..enough }, "of memory"),
        (Limits { disk_bytes: enough.disk_bytes - 1, ..enough }, "of disk"),
    ] {
        let error = execute(&plan, &toy, folder.path(), &Silent, &Options { limits, ..options() }).unwrap_err();
        assert!(error.exit_code() == 2 && error.what.contains(what), "{error}");
    }
    assert_eq!(toy.renders(), 0);
    execute(&plan, &toy, folder.path(), &Silent, &Options { limits: enough, ..options() }).unwrap();
    let on_disk: usize = bytes(folder.path()).values().map(Vec::len).sum();
    assert!((on_disk as u64) < survey.disk_bytes, "{on_disk} bytes, {} foreseen", survey.disk_bytes);
}

#[test]
fn a_picture_stands_with_what_is_shown() {
    let plan = small(&Toy::new());
    let (folder, _) = undisturbed();
    let standing = Standing::read(&plan, folder.path()).unwrap();
    assert!(standing.states.iter().all(|&state| state == State::Done));
    let shown: Vec<Kind> = plan.items.iter().filter(|item| item.is_shown).map(|item| item.kind()).collect();
    assert_eq!(shown.len(), 2 + 1 + 3 + 4);
    let stages = plan.items.iter().filter_map(|item| match &item.work {
        Work::Image(work) if work.kind == Kind::Stage => Some((work.stage, work.spp.asked)),
        _ => None,
    });
    let expected = [(Stage::Start, 1), (Stage::Aa, 3), (Stage::Dof, 3), (Stage::Final, 3)];
    assert!(stages.eq(expected));
}

// --- shards ---

#[test]
fn shards_are_contiguous_cover_the_plan_and_keep_together_what_belongs_together() {
    let plan = small(&Toy::new());
    for count in 1..=plan.items.len() as u32 + 3 {
        let blocks = blocks(&plan, count);
        assert_eq!(blocks.len(), count as usize);
        let mut next = 0;
        for (block, index) in blocks.iter().zip(1..) {
            assert_eq!(*block, Shard { index, count }.positions(&plan));
            assert_eq!(block.start, next, "{count}");
            next = block.end;
            for position in block.clone() {
                let own_images: Vec<&str> = match &plan.items[position].work {
                    Work::Ensemble(work) => work.members.iter().map(String::as_str).collect(),
                    Work::Reference(_) => plan.reference_images(&plan.items[position].id).to_vec(),
                    _ => Vec::new(),
                };
                assert!(own_images.iter().all(|id| block.contains(&plan.position(id).unwrap())), "{count}");
            }
        }
        assert_eq!(next, plan.items.len());
    }
    // 64 spp of reference halves are nearly all of the work: no cut can be even, but none goes through them.
    let samples =
        |block: &std::ops::Range<usize>| plan.items[block.clone()].iter().map(|item| item.samples()).sum::<u64>();
    let total = samples(&(0..plan.items.len()));
    assert!(blocks(&plan, 2).iter().all(|block| samples(block) < total));
}

/// Rows of shards by chance in 1 to 7 parts, joined in a random order, some twice; a part that is not there is named.
#[test]
fn any_shards_in_any_order_merge_to_the_same_bytes_and_a_lacking_one_is_named() {
    let (_keep, expected) = undisturbed();
    let toy = Toy::new();
    let plan = small(&toy);
    for count in [1, 2, 5, 7] {
        let folder = tempfile::tempdir().unwrap();
        let mut parts: Vec<std::path::PathBuf> = Vec::new();
        for index in 1..=count {
            let out = folder.path().join(format!("{index}"));
            let options = Options { shard: Some(Shard { index, count }), ..options() };
            execute(&plan, &toy, &out, &Silent, &options).unwrap().check().unwrap();
            parts.push(out);
        }
        let key = |part: &Path| mix(part.file_name().unwrap().to_str().unwrap().parse::<u64>().unwrap());
        parts.sort_by_key(|part| key(part));
        parts.push(parts[0].clone());
        let out = folder.path().join("all");
        if count > 1 {
            let lacking: u32 = parts[1].file_name().unwrap().to_str().unwrap().parse().unwrap();
            let some: Vec<_> = parts.iter().filter(|part| **part != parts[1]).cloned().collect();
            let merged = Sources::open(&some, &out).unwrap().merge(&plan).unwrap();
            let missing = Shard { index: lacking, count };
            let owns = !missing.positions(&plan).is_empty();
            assert_eq!(merged.status.missing_shards, if owns { vec![missing] } else { Vec::new() });
            assert_eq!(merged.status.check("x").is_err(), owns);
            assert!(merged.status.missing.iter().all(|missing| missing.reason == Reason::Never));
        }
        let merged = Sources::open(&parts, &out).unwrap().merge(&plan).unwrap();
        assert_eq!((merged.status.check("x"), merged.status.missing.len()), (Ok(()), 0));
        drop(merged);
        let found = bytes(&out);
        // Images of replicates stay where they were made: nothing shows them.
        assert!(found.iter().all(|(name, bytes)| expected.get(name) == Some(bytes)), "{count}");
        let shown = plan.items.iter().filter(|item| item.is_shown && item.kept_image().is_some()).count();
        assert_eq!(
            found.keys().filter(|name| name.ends_with(".exr") && !name.starts_with("reference-")).count(),
            shown
        );
        assert_eq!(run(&plan, &toy, &out).done, 0);
    }
}

#[test]
fn status_tells_a_changed_scene_from_a_raised_number_and_rows_come_back_with_it() {
    let (folder, before) = undisturbed();
    let base = Toy::new();
    let reasons = |toy: &Toy| -> Vec<String> {
        let status = Status::read(&small(toy), folder.path()).unwrap();
        status.missing.iter().map(|missing| format!("{}: {}", missing.reason.name(), missing.reason)).collect()
    };
    assert_eq!(reasons(&base), Vec::<String>::new());
    let with = |numbers| Toy { numbers, ..Toy::new() };
    let numbers = base.numbers;
    for (toy, expected) in [
        (Toy { content: "edited", ..Toy::new() }, "scene changed: the scene ramp changed, ramp → rampedited"),
        (
            with(Algorithms { renderer: 2, ..numbers }),
            "algorithm changed: the algorithm number of the renderer changed, 1 → 2",
        ),
        (
            with(Algorithms { sampler: 3, ..numbers }),
            "algorithm changed: the algorithm number of the sampler changed, 1 → 3",
        ),
        (
            with(Algorithms { exact: 2, ..numbers }),
            "algorithm changed: the algorithm number of the closed form changed, 1 → 2",
        ),
        (
            with(Algorithms { metrics: 2, ..numbers }),
            "algorithm changed: the algorithm number of the metrics changed, 1 → 2",
        ),
    ] {
        assert!(reasons(&toy).contains(&expected.to_owned()), "{expected}: {:?}", reasons(&toy));
        run(&small(&toy), &toy, folder.path()).check().unwrap();
        assert_eq!(reasons(&toy), Vec::<String>::new());
        assert!(reasons(&base).iter().any(|reason| reason.starts_with("put aside: ")), "{expected}");
        let again = Toy::new();
        run(&small(&again), &again, folder.path()).check().unwrap();
        assert_eq!(again.renders(), 0, "{expected}");
        let after = bytes(folder.path());
        assert!(before.iter().all(|(name, bytes)| after.get(name) == Some(bytes)), "{expected}");
    }
    // Rows of a version that did not say what they were made with.
    let text = std::fs::read_to_string(results::results_path(folder.path())).unwrap();
    let silent: String =
        text.lines().map(|line| format!("{}\n", without_made_with(line).replace("\"id\":\"", "\"id\":\"0"))).collect();
    std::fs::write(results::results_path(folder.path()), silent).unwrap();
    std::fs::remove_file(folder.path().join("superseded.jsonl")).unwrap();
    assert_eq!(reasons(&base), ["stale: made by an earlier version, which did not say with what"]);
    // Those that fit are as good as ever, and say it from the next run on.
    let silent: String = text.lines().map(|line| without_made_with(line) + "\n").collect();
    std::fs::write(results::results_path(folder.path()), silent).unwrap();
    let toy = Toy::new();
    run(&small(&toy), &toy, folder.path()).check().unwrap();
    assert_eq!((toy.renders(), std::fs::read_to_string(results::results_path(folder.path())).unwrap()), (0, text));

    fn without_made_with(line: &str) -> String {
        let start = line.find(",\"made_with\":{").unwrap();
        let end = start + line[start..].find('}').unwrap() + 1;
        format!("{}{}", &line[..start], &line[end..])
    }
}

// --- the lab's own backend ---

/// A lab whose scenes are the repository's.
fn lab(sets: &[&str]) -> Lab {
    let experiment = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/experiments/tiny.json");
    let sets = sets.iter().map(|&set| set.to_owned()).collect();
    Lab::new(&experiment, OpenOptions { sets, ..OpenOptions::default() })
}

const TINY: &str = r#"{
    "name": "tiny", "seed": 3, "scenes": ["cornell", "penumbra"], "size": "9x9",
    "samplers": ["uniform", "stratified:sheet", "halton:sheet", "ld:best"], "spp": [1, 5], "replicates": 3,
    "reference": {"sampler": "sobol", "spp": 32},
    "points": {"n": [1, 8], "metrics": ["star", "l2_star", "t_value", "min_toroidal_distance"], "replicates": 2},
    "pictures": {"scene": "penumbra", "size": "12x12", "spp": 2}
}"#;

#[test]
fn the_lab_gives_the_same_bytes_on_1_2_and_7_threads_and_after_a_kill() {
    let mut expected = None;
    for (threads, at_most) in [(2, usize::MAX), (1, usize::MAX), (7, 23)] {
        let folder = tempfile::tempdir().unwrap();
        let lab = lab(&[]);
        let plan = plan(&experiment(TINY), &lab).unwrap();
        loop {
            let options = Options { threads, at_most: Some(at_most), ..options() };
            let outcome = execute(&plan, &lab, folder.path(), &Silent, &options).unwrap();
            assert_eq!(outcome.failures, []);
            if !outcome.interrupted {
                break;
            }
        }
        let found = bytes(folder.path());
        assert_same(&found, expected.get_or_insert(found.clone()), threads);
    }
}

#[test]
fn the_lab_says_what_is_exact_and_what_is_random() {
    let lab = lab(&[]);
    let plan = plan(&experiment(TINY), &lab).unwrap();
    assert!(plan.notes.contains(&"penumbra: the reference is a closed form".to_owned()), "{:?}", plan.notes);
    assert!(plan.notes.contains(&"cornell, halton:sheet: nothing random, so 1 replicate and no variance".to_owned()));
    let canonical: Vec<&str> = plan.samplers.iter().map(|sampler| sampler.canonical.as_str()).collect();
    assert_eq!(canonical, ["uniform:step:fresh@each", "stratified:sheet", "halton:sheet", "ld:shuffle:owen@each"]);
    for text in canonical {
        assert_eq!(lab.parse_sampler(text).as_deref(), Ok(text), "a canonical form reads as itself");
    }
    let error = lab.open_scene("nowhere").unwrap_err();
    assert!(error.exit_code() == 2 && error.what.contains("nowhere.json"), "{error}");
}

/// 16 points of the (0,2)-sequence: D* = 11/64, proved in rationals; it is a net with t = 0; no two
/// of its points share a row of 1/16, and the sheet's shuffled set is the same set.
#[test]
fn every_metric_has_a_value_and_the_known_one_is_right() {
    let lab = lab(&[]);
    let names: Vec<String> = lab.point_metric_names().iter().map(|&name| name.to_owned()).collect();
    let plain = lab.point_metrics("ld:plain", 16, 1, &names).unwrap();
    assert_eq!(plain.len(), names.len());
    assert!(plain.values().all(Option::is_some), "{plain:?}");
    assert_eq!((plain["star"], plain["t_value"]), (Some(11.0 / 64.0), Some(0.0)));
    assert!(plain["min_toroidal_distance"] >= Some(1.0 / 16.0));
    assert_eq!(lab.point_metrics("ld:shuffle:none@each", 16, 2, &names).unwrap()["star"], plain["star"]);
    let center = lab.point_metrics("center", 16, 1, &names).unwrap_err();
    assert_eq!(center.exit_code(), 2, "{center}");
}

/// The closed form stands for the scene it was written for and for no other, whatever the file is called.
#[test]
fn an_edited_penumbra_has_no_closed_form() {
    assert!(lab(&[]).open_scene("penumbra").unwrap().exact_reference);
    assert!(lab(&["framebuffer.sppx=3", "camera.dir=[0, -8, 6]"]).open_scene("penumbra").unwrap().exact_reference);
    assert!(!lab(&[]).open_scene("cornell").unwrap().exact_reference);
    for set in [
        "camera.fov=63",
        "camera.pos=[0, 0.9375, -1.2]",
        "camera.up=[0.1, 1, 0]",
        "camera.lens_radius=0.1",
        "shading=albedo",
        "scene.materials=[{\"name\": \"light\", \"emissive_strength\": 11}]",
        "scene.materials=[{\"name\": \"plane\", \"albedo_col\": [0.75, 0.75, 0.7]}]",
        "scene.mesh_files=[\"penumbra/penumbra.obj\", \"cornell/cornell.obj\"]",
    ] {
        assert!(!lab(&[set]).open_scene("penumbra").unwrap().exact_reference, "{set}");
    }
}

/// As the penumbra's; colours are free, since the closed form is one of shapes.
#[test]
fn an_edited_horizon_has_a_closed_form_only_where_its_shapes_are_the_same() {
    for set in [
        "framebuffer.sppx=3",
        "camera.dir=[0, -2, 8]",
        "scene.materials=[{\"name\": \"sky\", \"albedo_col\": [0, 0, 1]}]",
    ] {
        assert!(lab(&[set]).open_scene("horizon").unwrap().exact_reference, "{set}");
    }
    for set in [
        "camera.fov=47",
        "camera.pos=[0, 4.5, 0]",
        "camera.up=[0.1, 1, 0]",
        "camera.lens_radius=0.1",
        "shading=direct",
        "framebuffer.res_w=4000",
        "scene.mesh_files=[\"horizon/horizon.obj\", \"penumbra/penumbra.obj\"]",
        "scene.mesh_files=[\"penumbra/penumbra.obj\"]",
    ] {
        assert!(!lab(&[set]).open_scene("horizon").unwrap().exact_reference, "{set}");
    }
}

/// The exact image is the scene's, colour by colour: a whole image of 256 spp errs by less than 1 % of full light in the mean
/// of each channel (its own error there is some 1e-4), and the sky is the same to the last bit.
#[test]
fn the_exact_horizon_has_the_scene_s_colours() {
    let (lab, size) = (lab(&[]), Size { width: 48, height: 27 });
    lab.open_scene("horizon").unwrap();
    let exact = lab.exact_reference("horizon", size).unwrap();
    let path = format!("{}/configs/horizon.json", env!("CARGO_MANIFEST_DIR"));
    let loaded = load::open(path.as_ref(), &OpenOptions::default()).unwrap();
    let scene = Scene::new(&loaded.config, loaded.mesh, (size.width, size.height), Stage::Final).unwrap();
    let sampler = SamplerSpec::parse("sobol", Preset::Best).unwrap();
    let sampler = Sampler::new(sampler, &scene.layout, 256, 1).unwrap();
    let rendered = render(&scene, &sampler).unwrap().image;
    assert_eq!(exact.pixels[0], rendered.pixels[0]);
    for c in 0..3 {
        let mean = |image: &Image| image.pixels.iter().map(|p| f64::from(p[c])).sum::<f64>() / f64::from(48 * 27);
        assert!((mean(&exact) - mean(&rendered)).abs() < 0.01, "channel {c}");
    }
}

/// Renderer against closed form, through the runner: the mean signed error of 24 independent uniform images of
/// `penumbra` is 0. Student's t, one test. False alarms: 1e-8.
#[test]
fn uniform_images_scatter_about_the_exact_one() {
    let text = TINY
        .replace("\"cornell\", ", "")
        .replace("[\"uniform\", \"stratified:sheet\", \"halton:sheet\", \"ld:best\"]", "[\"uniform\"]")
        .replace("[1, 5]", "[16]")
        .replace("\"spp\": [16], \"replicates\": 3", "\"spp\": [16], \"replicates\": 24");
    let lab = lab(&[]);
    let folder = tempfile::tempdir().unwrap();
    execute(&plan(&experiment(&text), &lab).unwrap(), &lab, folder.path(), &Silent, &options())
        .unwrap()
        .check()
        .unwrap();
    let biases: Vec<f64> = rows(folder.path())
        .into_iter()
        .filter_map(|row| match row {
            Row::Image(row) if row.kind == Kind::Render => row.errors.map(|errors| errors.bias),
            _ => None,
        })
        .collect();
    assert_eq!(biases.len(), 24);
    let verdict = t_test(&biases, 0.0, Family { tests: 1, false_alarm: 1e-8 });
    assert!(verdict.holds(), "{verdict}");
}

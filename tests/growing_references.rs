//! References that grow: as many batches as the formula says, the same bytes however a run went, nothing rendered twice.

use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, HashSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use sampler_lab::error::{Error, Result};
use sampler_lab::experiment::backend::{Algorithms, Backend, PointMetrics, RenderRequest, SceneFacts, Size};
use sampler_lab::experiment::execute::{Options, Outcome, execute};
use sampler_lab::experiment::merge::Sources;
use sampler_lab::experiment::plan::{Plan, Work, plan};
use sampler_lab::experiment::progress::Silent;
use sampler_lab::experiment::results::{self, Growth, Kind, ReferenceRow, Row};
use sampler_lab::experiment::shards::Shard;
use sampler_lab::experiment::spec::Experiment;
use sampler_lab::experiment::status::Status;
use sampler_lab::experiment::survey::{Limits, Standing, State, Survey};
use sampler_lab::film::{Image, read_exr};
use sampler_lab::scene::json;
use sampler_lab::stats::image_error::reference_noise;

/// A grey image plus noise, uniform on an interval of width 1/√spp: its variance is 1/(12 spp) in every pixel-channel.
#[derive(Default)]
struct Toy {
    /// Every render: sampler, spp, seed.
    rendered: RefCell<Vec<(String, u32, u64)>>,
    /// The process dies when it begins this render.
    dies_at: Cell<Option<usize>>,
    /// Renders of this sampler fail.
    broken: Option<&'static str>,
    metrics: u32,
}

impl Toy {
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

impl Backend for Toy {
    fn open_scene(&self, scene: &str) -> Result<SceneFacts> {
        Ok(SceneFacts {
            name: scene.to_owned(),
            content_hash: scene.to_owned(),
            size: Size { width: 24, height: 24 },
            spp: 1,
            exposure: 1.0,
            lights: None,
            layout: "pixel 0-1".to_owned(),
            exact_reference: scene == "exact",
            lens: false,
            memory_bytes: 1000,
        })
    }

    fn parse_sampler(&self, text: &str) -> Result<String> {
        Ok(text.to_owned())
    }

    fn is_random(&self, _: &str, _: Option<&str>) -> bool {
        true
    }

    fn taken(&self, _: &str, _: Option<&str>, asked: u32) -> u32 {
        asked
    }

    fn algorithms(&self, _: &str) -> Algorithms {
        Algorithms { renderer: 1, sampler: 1, estimator: 1, exact: 1, metrics: self.metrics }
    }

    fn prepare(&self, _: &RenderRequest) -> Result<()> {
        Ok(())
    }

    fn render(&self, request: &RenderRequest) -> Result<Image> {
        let &RenderRequest { sampler, spp, seed, size, .. } = request;
        assert!(self.dies_at.get() != Some(self.renders()), "killed");
        self.rendered.borrow_mut().push((sampler.to_owned(), spp, seed));
        if self.broken == Some(sampler) {
            return Err(Error::incomplete(sampler, "expected finite radiance, found NaN in pixel (1, 2), sample 3"));
        }
        let value = |channel: u64| {
            let unit = mix(seed ^ mix(channel)) as f64 / 2f64.powi(64);
            (1.0 + (unit - 0.5) / f64::from(spp).sqrt()) as f32
        };
        let pixels = (0..size.pixels()).map(|i| [value(3 * i), value(3 * i + 1), value(3 * i + 2)]).collect();
        Ok(Image { width: size.width, height: size.height, pixels })
    }

    fn focal_depth(&self, _: &str, _: Size) -> Option<f64> {
        None
    }

    fn exact_reference(&self, _: &str, size: Size) -> Result<Image> {
        Ok(Image { width: size.width, height: size.height, pixels: vec![[1.0; 3]; size.pixels() as usize] })
    }

    fn point_metric_names(&self) -> &'static [&'static str] {
        &[]
    }

    fn point_metrics(&self, _: &str, _: u32, _: u64, _: &[String]) -> Result<PointMetrics> {
        Ok(PointMetrics::new())
    }
}

/// An experiment on `grey`, whose smallest error is that of `most` spp, with this `reference`.
fn text(seed: u64, most: u32, reference: &str) -> String {
    format!(
        r#"{{"name": "growing", "seed": {seed}, "scenes": ["grey", "exact"], "samplers": ["a", "b", "c"],
            "spp": [1, {most}], "replicates": 2, "reference": {{"sampler": "truth", {reference}}}}}"#
    )
}

fn planned(toy: &Toy, text: &str) -> Plan {
    let value = json::parse(text.as_bytes(), "growing.json").unwrap();
    plan(&Experiment::from_value(&value, "growing.json").unwrap(), toy).unwrap()
}

fn options() -> Options<'static> {
    Options::new(1, "sampler-lab run growing.json")
}

fn run(plan: &Plan, toy: &Toy, out: &Path) -> Outcome {
    execute(plan, toy, out, &Silent, &options()).unwrap()
}

fn rows(out: &Path) -> Vec<Row> {
    results::read(&results::results_path(out)).unwrap()
}

/// The reference of `grey` and how far it grew.
fn grown(out: &Path) -> (ReferenceRow, Growth) {
    let of_grey = |row| match row {
        Row::Reference(row) if row.scene == "grey" => row.growth.clone().map(|growth| (row, growth)),
        _ => None,
    };
    rows(out).into_iter().find_map(of_grey).unwrap()
}

/// A run in a folder of its own.
fn ran(text: &str) -> (tempfile::TempDir, ReferenceRow, Growth) {
    let (folder, toy) = (tempfile::tempdir().unwrap(), Toy::default());
    run(&planned(&toy, text), &toy, folder.path()).check().unwrap();
    let (row, growth) = grown(folder.path());
    (folder, row, growth)
}

/// Everything that may not depend on how a run went.
fn bytes(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for folder in [out.to_owned(), out.join("images")] {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            if path.is_file() && name != "timings.jsonl" && name != ".lock" {
                files.insert(name, std::fs::read(&path).unwrap());
            }
        }
    }
    files
}

#[track_caller]
fn assert_same(out: &Path, expected: &BTreeMap<String, Vec<u8>>, what: impl std::fmt::Display) {
    let found = bytes(out);
    let names: HashSet<&String> = found.keys().chain(expected.keys()).collect();
    let differ: Vec<_> = names.into_iter().filter(|name| found.get(*name) != expected.get(*name)).collect();
    assert!(differ.is_empty(), "{what}: {differ:?}");
}

fn results_of(out: &Path) -> String {
    std::fs::read_to_string(results::results_path(out)).unwrap()
}

/// Grows to 4 batches a half and is not limited.
const FOUR: (u32, &str) = (48, r#""spp": 32, "noise": 0.5"#);

// --- how far ---

/// A pilot of n spp has the mean square error 1/(12 n), two halves of K batches of s spp the noise 1/(24 s K): the rule
/// stops at the first power of two K ≥ n/(2 s f²).
///
/// Over 1728 pixel-channels a pilot's error is measured to 2.2 %, the least of three is about 2 % too low; the noise of K
/// batches is measured to √(2/1728/(2K − 1)), 3.4 % and less, and its upper end lies √3 · 1.96 of these above, as a pixel counts
/// as one number: 12, 7, 4, 3, 2 % for K = 1, 2, 4, 8, 16. With that the nearest border (12.5 of 16) is 20 % away, seven
/// standard deviations: four of 12 seeds each. False alarms: 1e-9. A half that used a batch twice, or a rule on squares
/// instead of roots, is a factor of two off.
#[test]
fn a_reference_has_as_many_batches_as_the_formula_says() {
    let cases = [
        (64, r#""spp": 64, "noise": 0.2"#, 16, false), // 12.5
        (48, r#""spp": 32, "noise": 0.5"#, 4, false),  // 3
        (64, r#""spp": 64, "noise": 1"#, 1, false),    // 1/2
        (64, r#""spp": 64, "noise": 0.2, "most_spp": 1000"#, 8, true),
    ];
    for seed in 0..12 {
        for (most, reference, batches, is_limited) in cases {
            let (_folder, row, growth) = ran(&text(seed, most, reference));
            assert_eq!((growth.batches, growth.is_limited), (batches, is_limited), "{seed} {reference} {growth:?}");
            let [low, high] = growth.noise_mse_ci95;
            assert!(low < row.noise_mse && row.noise_mse < high, "{growth:?}");
            let is_enough = high <= growth.noise * growth.noise * growth.pilot_mse;
            assert_eq!(is_enough, !is_limited, "the row says what the rule saw");
        }
    }
}

/// Noise of K batches is 1/K of one's, here 1/(24 s K), measured to 3.4 % at most (the noise has light tails): the bar is at
/// six of these. False alarms: 1e-8. An interval of 95 % that counts three channels as one number is √3 too wide: it
/// misses the truth once in 1500, six of them once in 250, at a fixed seed.
#[test]
fn the_noise_of_a_reference_falls_as_one_over_its_batches() {
    for batches in [1, 2, 4, 8, 16, 32] {
        let (_folder, row, growth) =
            ran(&text(5, 64, &format!(r#""spp": 8, "noise": 0.001, "most_spp": {}"#, 8 * batches)));
        assert_eq!((growth.batches, growth.is_limited), (batches, true));
        let exact = 1.0 / (24.0 * 8.0 * f64::from(batches));
        assert!((row.noise_mse / exact - 1.0).abs() < 6.0 * 0.034, "{batches}: {} for {exact}", row.noise_mse);
        let [low, high] = growth.noise_mse_ci95;
        assert!(low < exact && exact < high && high - low < 0.35 * exact, "{exact} {growth:?}");
    }
}

#[test]
fn an_error_below_the_noise_makes_a_reference_grow_to_its_most() {
    // The pilots have 4096 times a batch's samples: their errors are far below what 8 batches see.
    let (_folder, _, growth) = ran(&text(3, 4096, r#""spp": 1, "noise": 1, "most_spp": 8"#));
    assert!(growth.batches == 8 && growth.is_limited, "{growth:?}");
}

// --- plans ---

#[test]
fn a_closed_form_has_no_batches_and_keeps_its_id() {
    let toy = Toy::default();
    let (plain, growing) = (planned(&toy, &text(1, 48, r#""spp": 32"#)), planned(&toy, &text(1, FOUR.0, FOUR.1)));
    let of_exact = |plan: &Plan| -> Vec<String> {
        let is_exact = |work: &Work| match work {
            Work::Reference(work) => work.scene == "exact",
            Work::Ensemble(work) => work.scene == "exact",
            Work::Image(work) => work.scene == "exact",
            Work::Points(_) | Work::Prediction(_) => false,
        };
        plan.items.iter().filter(|item| is_exact(&item.work)).map(|item| item.id.clone()).collect()
    };
    assert_eq!(of_exact(&plain), of_exact(&growing));
    assert!(of_exact(&plain).iter().all(|id| growing.growth(id).is_none()));
    assert!(growing.notes.iter().any(|note| note.starts_with("grey: the reference grows from 2 × 32 spp")));
}

#[test]
fn a_growing_reference_starts_from_the_halves_of_one_that_does_not() {
    let toy = Toy::default();
    let (plain, growing) = (planned(&toy, &text(1, 48, r#""spp": 32"#)), planned(&toy, &text(1, FOUR.0, FOUR.1)));
    let images = |plan: &Plan| -> HashSet<(String, Option<u64>)> {
        let items = plan.items.iter().filter(|item| item.kept_image().is_some() && item.batch().is_none());
        items.map(|item| (item.id.clone(), item.seed())).collect()
    };
    assert_eq!(images(&plain), images(&growing));
    assert!(plain.items.iter().all(|item| item.batch().is_none()));
    let batches: Vec<&str> =
        growing.items.iter().filter(|item| item.batch().is_some()).map(|item| item.id.as_str()).collect();
    assert_eq!(batches.len(), 2 * 15, "16 batches a half at most, the first among the halves");
    let reference = growing.items.iter().find(|item| growing.growth(&item.id).is_some()).unwrap();
    assert_eq!(growing.growth(&reference.id).unwrap().pilots.len(), 3);
    assert!(growing.position(&reference.id) > growing.position(batches[29]), "after all it may be made of");
}

/// The id of the reference of an experiment without `noise` is what stored rows name. Computed apart from this code,
/// with Python's hashlib over the fields and their lengths.
#[test]
fn a_reference_that_does_not_grow_has_the_id_of_the_first_release() {
    let plain = planned(&Toy::default(), &text(1, 48, r#""spp": 32"#));
    let ids: Vec<&str> = plain.items.iter().map(|item| item.id.as_str()).take(3).collect();
    assert_eq!(ids, PLAIN_IDS);
}

const PLAIN_IDS: [&str; 3] = ["d8df6344de8c2fc3", "73a9d766a8f11c42", "a9f1358e2b283a55"];

#[test]
fn the_order_of_samplers_and_spp_is_in_no_id_of_a_growing_reference() {
    let toy = Toy::default();
    let base = text(1, FOUR.0, FOUR.1);
    let turned = base.replace(r#"["a", "b", "c"]"#, r#"["c", "a", "b"]"#).replace("[1, 48]", "[48, 1]");
    assert_ne!(base, turned);
    let ids = |text: &str| -> HashSet<String> { planned(&toy, text).items.into_iter().map(|item| item.id).collect() };
    assert_eq!(ids(&base), ids(&turned));
}

#[test]
fn another_share_another_most_or_another_error_to_judge_is_another_reference() {
    let toy = Toy::default();
    let base = text(1, 48, r#""spp": 32, "noise": 0.5"#);
    let reference = |text: &str| {
        let plan = planned(&toy, text);
        plan.items.iter().find(|item| plan.growth(&item.id).is_some()).map(|item| item.id.clone()).unwrap()
    };
    let others = [
        base.replace("0.5", "0.25"),
        base.replace("0.5", "0.5, \"most_spp\": 64"),
        base.replace("\"c\"]", "\"c\", \"d\"]"),
        base.replace("[1, 48]", "[1, 48, 64]"),
    ];
    let ids: HashSet<String> = others.iter().chain([&base]).map(|text| reference(text)).collect();
    assert_eq!(ids.len(), 5);
    assert_eq!(
        reference(&base.replace("[1, 48]", "[1, 16, 48]")),
        reference(&base),
        "smaller counts have larger errors"
    );
    assert_eq!(reference(&base.replace("\"replicates\": 2", "\"replicates\": 5")), reference(&base));
}

// --- runs ---

#[test]
fn rows_are_those_of_the_batches_that_were_needed_in_plan_order() {
    let (folder, row, growth) = ran(&text(1, FOUR.0, FOUR.1));
    let rows = rows(folder.path());
    let halves: Vec<(u32, u32)> = rows
        .iter()
        .filter_map(|row| match row {
            Row::Image(row) if row.kind == Kind::ReferenceHalf => Some((row.replicate, row.batch)),
            _ => None,
        })
        .collect();
    assert_eq!(halves, [(0, 0), (1, 0), (0, 1), (1, 1), (0, 2), (1, 2), (0, 3), (1, 3)]);
    assert_eq!((growth.batches, growth.most_batches, row.spp.unwrap().taken), (4, 16, 32));
    let pilot = rows.iter().find(|row| row.id() == growth.pilot).unwrap();
    let Row::Image(pilot) = pilot else { panic!("a pilot is an image") };
    assert_eq!(pilot.errors.as_ref().unwrap().mse_unbiased, growth.pilot_mse, "the pilot's own row says the same");
    let text = results_of(folder.path());
    assert!(!text.contains("\"batch\":0") && text.contains("\"replicate\":1,\"batch\":3,\"seed\""), "{text}");
    let timed = results::read_timings(&results::timings_path(folder.path())).unwrap();
    let images = rows.iter().filter(|row| row.kept_pixels().is_some()).count();
    assert_eq!(timed.len(), images, "every image of a row has its seconds, and no other was made");
}

#[test]
fn the_halves_lie_beside_the_images_and_are_what_images_were_compared_with() {
    let (folder, row, growth) = ran(&text(1, FOUR.0, FOUR.1));
    let read = |part: &str| read_exr(&results::reference_path(folder.path(), "grey", false, part)).unwrap();
    let [(a, provenance), (b, _)] = ["A", "B"].map(read);
    // Both estimate one noise over 1728 pixel-channels, with one and with seven degrees of freedom each: 3.7 % apart.
    let of_halves = reference_noise(a.pixels.as_flattened(), b.pixels.as_flattened());
    assert!((of_halves / row.noise_mse - 1.0).abs() < 0.2, "{of_halves} {}", row.noise_mse);
    let says = |name: &str| provenance.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str());
    assert_eq!(says("id"), Some(row.id.as_str()));
    assert_eq!((says("batches"), says("spp"), says("half")), (Some("4"), Some("32"), Some("A")));
    // A half is the mean of its batches.
    let batches: Vec<Image> = rows(folder.path())
        .iter()
        .filter_map(|row| match row {
            Row::Image(row) if row.kind == Kind::ReferenceHalf && row.replicate == 0 => {
                Some(read_exr(&results::image_path(folder.path(), &row.id)).unwrap().0)
            }
            _ => None,
        })
        .collect();
    assert_eq!(batches.len(), growth.batches as usize);
    let mean = batches.iter().map(|batch| f64::from(batch.pixels[7][1])).sum::<f64>() / 4.0;
    assert_eq!(a.pixels[7][1], mean as f32);
    let (exact, _) = read_exr(&results::reference_path(folder.path(), "exact", false, "exact")).unwrap();
    assert_eq!(exact.pixels[0], [1.0; 3]);
}

#[test]
fn a_run_that_dies_at_any_image_goes_on_to_the_same_bytes_and_renders_nothing_twice() {
    let base = text(1, FOUR.0, FOUR.1);
    let (folder, ..) = ran(&base);
    let expected = bytes(folder.path());
    let count = {
        let toy = Toy::default();
        run(&planned(&toy, &base), &toy, tempfile::tempdir().unwrap().path());
        toy.renders()
    };
    assert_eq!(
        count,
        2 * 4 + 2 * 3 * 2 * 2,
        "two halves of four batches; two scenes, three samplers, two counts, twice"
    );
    for dies_at in 0..count {
        let (folder, toy) = (tempfile::tempdir().unwrap(), Toy::default());
        let plan = planned(&toy, &base);
        toy.dies_at.set(Some(dies_at));
        assert!(catch_unwind(AssertUnwindSafe(|| run(&plan, &toy, folder.path()))).is_err());
        toy.dies_at.set(None);
        run(&plan, &toy, folder.path()).check().unwrap();
        assert_same(folder.path(), &expected, format!("died at image {dies_at}"));
        assert_eq!(toy.renders(), count, "died at image {dies_at}");
    }
}

#[test]
fn a_run_of_few_items_at_a_time_ends_at_the_same_bytes() {
    let base = text(1, FOUR.0, FOUR.1);
    let (folder, ..) = ran(&base);
    let expected = bytes(folder.path());
    for step in [1, 3] {
        let (folder, toy) = (tempfile::tempdir().unwrap(), Toy::default());
        let plan = planned(&toy, &base);
        let outcome = loop {
            let outcome = execute(&plan, &toy, folder.path(), &Silent, &Options { at_most: Some(step), ..options() });
            let outcome = outcome.unwrap();
            if !outcome.interrupted {
                break outcome;
            }
            assert_eq!(outcome.done, step);
        };
        outcome.check().unwrap();
        assert_eq!(outcome.items, rows(folder.path()).len());
        assert_same(folder.path(), &expected, format!("{step} at a time"));
        let again = run(&plan, &toy, folder.path());
        assert_eq!((again.done, again.found, again.items), (0, outcome.items, outcome.items));
    }
}

#[test]
fn rows_cut_at_any_byte_and_images_taken_away_come_back_the_same() {
    let base = text(1, FOUR.0, FOUR.1);
    let (folder, ..) = ran(&base);
    let expected = bytes(folder.path());
    let whole = results_of(folder.path());
    let toy = Toy::default();
    let plan = planned(&toy, &base);
    for i in 0..25u64 {
        let end = (mix(i) % whole.len() as u64) as usize;
        std::fs::write(results::results_path(folder.path()), &whole.as_bytes()[..end]).unwrap();
        run(&plan, &toy, folder.path()).check().unwrap();
        assert_same(folder.path(), &expected, format!("cut at {end}"));
    }
    assert_eq!(toy.renders(), 0);
    // Any one line lost: a batch's, the reference's, a pilot's.
    for lost in 0..whole.lines().count() {
        let lines: Vec<&str> = whole.lines().enumerate().filter(|(i, _)| *i != lost).map(|(_, line)| line).collect();
        std::fs::write(results::results_path(folder.path()), lines.join("\n") + "\n").unwrap();
        let outcome = run(&plan, &toy, folder.path());
        outcome.check().unwrap();
        assert_eq!(outcome.found + outcome.done, outcome.items);
        assert_same(folder.path(), &expected, format!("line {lost} lost"));
    }
    assert_eq!(toy.renders(), 0);
    std::fs::remove_dir_all(folder.path().join("images")).unwrap();
    std::fs::write(results::results_path(folder.path()), &whole[..whole.rfind("\"ensemble\"").unwrap()]).unwrap();
    run(&plan, &toy, folder.path()).check().unwrap();
    assert_eq!(results_of(folder.path()), whole, "a row that holds says how far; its batches are made again");
}

#[test]
fn a_stricter_share_keeps_the_batches_that_are_there_and_a_looser_one_needs_none() {
    let loose = text(1, 48, r#""spp": 32, "noise": 0.5"#);
    let strict = text(1, 48, r#""spp": 32, "noise": 0.25"#);
    let (folder, ..) = ran(&loose);
    let before = results_of(folder.path());
    let toy = Toy::default();
    run(&planned(&toy, &strict), &toy, folder.path()).check().unwrap();
    let (fresh, _, growth) = ran(&strict);
    assert_eq!(growth.batches, 16);
    assert_eq!(toy.renders(), 2 * (16 - 4), "only batches, and only those that were not there");
    assert_eq!(results_of(folder.path()), results_of(fresh.path()));
    let toy = Toy::default();
    run(&planned(&toy, &loose), &toy, folder.path()).check().unwrap();
    assert_eq!((toy.renders(), results_of(folder.path())), (0, before));
    let aside = std::fs::read_to_string(folder.path().join("superseded.jsonl")).unwrap();
    assert_eq!(
        aside.matches("\"batch\":").count(),
        2 * 12,
        "rows that a looser share does without are not thrown away"
    );
    let toy = Toy::default();
    run(&planned(&toy, &strict), &toy, folder.path()).check().unwrap();
    assert_eq!(toy.renders(), 0, "batches that a looser share does without stay");
    let half = |out: &Path| std::fs::read(results::reference_path(out, "grey", false, "A")).unwrap();
    assert!(half(folder.path()) == half(fresh.path()), "the half that lies there is that of the rows");
    assert_eq!(results_of(folder.path()), results_of(fresh.path()));
}

#[test]
fn raised_metrics_judge_the_same_images_again() {
    let base = text(1, FOUR.0, FOUR.1);
    let (folder, ..) = ran(&base);
    let toy = Toy { metrics: 1, ..Toy::default() };
    run(&planned(&toy, &base), &toy, folder.path()).check().unwrap();
    assert_eq!((toy.renders(), grown(folder.path()).1.batches), (0, 4));
}

#[test]
fn a_pilot_that_fails_leaves_its_scene_without_a_reference_and_says_why() {
    let base = text(1, FOUR.0, FOUR.1);
    let (folder, toy) = (tempfile::tempdir().unwrap(), Toy { broken: Some("b"), ..Toy::default() });
    let outcome = run(&planned(&toy, &base), &toy, folder.path());
    let error = outcome.check().unwrap_err();
    assert!(error.exit_code() == 4 && error.what.contains("grey 24x24 reference: b: expected finite"), "{error}");
    assert!(rows(folder.path()).iter().all(|row| !matches!(row, Row::Reference(row) if row.scene == "grey")));
    let mended = Toy::default();
    run(&planned(&mended, &base), &mended, folder.path()).check().unwrap();
    let (fresh, ..) = ran(&base);
    assert_same(folder.path(), &bytes(fresh.path()), "mended");
}

// --- costs ---

#[test]
fn a_survey_states_what_it_costs_at_the_least_and_what_growth_may_add() {
    let toy = Toy::default();
    let base = text(1, FOUR.0, FOUR.1);
    let plan = planned(&toy, &base);
    let folder = tempfile::tempdir().unwrap();
    let survey = || Survey::new(&plan, &Standing::read(&plan, folder.path()).unwrap(), folder.path(), 1);
    let before = survey();
    let pixels = 24 * 24;
    assert_eq!(before.samples, pixels * (2 * 32 + 2 * 3 * 2 * (1 + 48)));
    assert_eq!((before.samples_left, before.samples_growth), (before.samples, pixels * 2 * 15 * 32));
    assert!(before.seconds_growth > 0.0 && before.to_string().contains("references that grow"), "{before}");
    let limits = Limits { memory_bytes: before.memory_bytes, disk_bytes: before.disk_bytes };
    let refused = Limits { disk_bytes: limits.disk_bytes - 1, ..limits };
    let refused = execute(&plan, &toy, folder.path(), &Silent, &Options { limits: refused, ..options() });
    assert_eq!(refused.unwrap_err().exit_code(), 2);
    execute(&plan, &toy, folder.path(), &Silent, &Options { limits, ..options() }).unwrap().check().unwrap();
    let on_disk: usize = bytes(folder.path()).values().map(Vec::len).sum();
    assert!((on_disk as u64) < before.disk_bytes, "{on_disk} bytes, {} foreseen", before.disk_bytes);
    let after = survey();
    assert_eq!((after.samples_left, after.samples_growth), (0, 0), "how far it grew is known");
    assert_eq!(after.samples, before.samples + pixels * 2 * 3 * 32);
    let standing = Standing::read(&plan, folder.path()).unwrap();
    assert_eq!(standing.states.iter().filter(|&&state| state == State::Optional).count(), 2 * 12);
    // A lost ensemble needs its members and all four batches of both halves, where no image is there.
    let text = results_of(folder.path());
    let lost = text.lines().position(|line| line.contains("\"kind\":\"ensemble\"")).unwrap();
    let lines: Vec<&str> = text.lines().enumerate().filter(|(i, _)| *i != lost).map(|(_, line)| line).collect();
    std::fs::write(results::results_path(folder.path()), lines.join("\n") + "\n").unwrap();
    std::fs::remove_dir_all(folder.path().join("images")).unwrap();
    assert_eq!(survey().samples_left, pixels * (2 * 4 * 32 + 2));
    let toy = Toy::default();
    run(&plan, &toy, folder.path()).check().unwrap();
    assert_eq!(toy.renders(), 2 * 4 + 2);
}

// --- shards ---

#[test]
fn shards_joined_in_any_order_are_the_run_that_was_not_cut() {
    let base = text(1, FOUR.0, FOUR.1);
    let (folder, ..) = ran(&base);
    for count in [2, 3, 7] {
        let toy = Toy::default();
        let plan = planned(&toy, &base);
        let folders: Vec<tempfile::TempDir> = (0..count).map(|_| tempfile::tempdir().unwrap()).collect();
        for (index, out) in (1..).zip(&folders) {
            let shard = Some(Shard { index, count });
            let outcome = execute(&plan, &toy, out.path(), &Silent, &Options { shard, ..options() }).unwrap();
            outcome.check().unwrap();
            assert_eq!(outcome.items, rows(out.path()).len());
        }
        let joined = tempfile::tempdir().unwrap();
        let mut paths: Vec<_> = folders.iter().map(|folder| folder.path().to_owned()).collect();
        paths.reverse();
        let merged = Sources::open(&paths, joined.path()).unwrap().merge(&plan).unwrap();
        merged.status.check("merge").unwrap();
        assert_eq!((merged.status.items, merged.status.done), (rows(folder.path()).len(), rows(folder.path()).len()));
        assert_eq!(results_of(joined.path()), results_of(folder.path()), "{count} shards");
        for (scene, part) in [("grey", "A"), ("grey", "B"), ("exact", "exact")] {
            let bytes = |out: &Path| std::fs::read(results::reference_path(out, scene, false, part)).unwrap();
            assert!(bytes(joined.path()) == bytes(folder.path()), "{scene} {part}");
        }
    }
}

#[test]
fn a_folder_whose_reference_is_missing_says_so_and_does_not_ask_for_batches() {
    let base = text(1, FOUR.0, FOUR.1);
    let (folder, ..) = ran(&base);
    let plan = planned(&Toy::default(), &base);
    let whole = Status::read(&plan, folder.path()).unwrap();
    assert_eq!((whole.done, whole.missing.len()), (whole.items, 0));
    let kept: Vec<String> = results_of(folder.path())
        .lines()
        .filter(|line| !line.contains("\"kind\":\"reference\"") && !line.contains("\"batch\""))
        .map(|line| format!("{line}\n"))
        .collect();
    std::fs::write(results::results_path(folder.path()), kept.concat()).unwrap();
    let status = Status::read(&plan, folder.path()).unwrap();
    let missing: Vec<&str> = status.missing.iter().map(|missing| missing.first.as_str()).collect();
    assert_eq!((missing, status.missing[0].items), (vec!["grey 24x24 reference"], 2), "{status}");
}

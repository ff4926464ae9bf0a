//! Images made in other ways: other scales, two passes, the sheet's shortcut. What is planned, what the lab makes of it, and
//! what the report says, with other words where other numbers stand.

use std::path::Path;

use sampler_lab::error::Result;
use sampler_lab::experiment::backend::{Backend, Estimator, RenderRequest, Size, Stage, Variant};
use sampler_lab::experiment::execute::{Options, execute};
use sampler_lab::experiment::lab::Lab;
use sampler_lab::experiment::plan::{Plan, Work, plan};
use sampler_lab::experiment::progress::Silent;
use sampler_lab::experiment::results::{self, EnsembleRow, ImageRow, Kind, Row};
use sampler_lab::experiment::spec::Experiment;
use sampler_lab::film::Image;
use sampler_lab::render::{render, render_sample};
use sampler_lab::report::{Figures, Summary, summarise, text, write};
use sampler_lab::sampling::{Preset, Sampler, SamplerSpec};
use sampler_lab::scene::compile::Scene;
use sampler_lab::scene::json;
use sampler_lab::scene::load::{self, OpenOptions};
use sampler_lab::scene::scale::scaled;
use sampler_lab::stats::Estimate;

const SIZE: Size = Size { width: 10, height: 8 };

/// A floor under three square lights of powers 1 : 4 : 16, none of them in the picture.
const LIGHTS: [(&str, &str); 3] = [
    (
        "lights.json",
        r#"{"camera": {"pos": [0, 1.5, 0], "dir": [0, -1, 0], "up": [0, 0, 1], "fov": 60, "lens_radius": 0},
            "auto_focus": false, "framebuffer": {"res_w": 10, "res_h": 8, "sppx": 4},
            "scene": {"mesh_files": ["lights.obj"]}}"#,
    ),
    (
        "lights.obj",
        "mtllib lights.mtl
v -9 0 -9\nv -9 0 9\nv 9 0 9\nv 9 0 -9
v -2 2 -1\nv -1 2 -1\nv -1 2 0\nv -2 2 0
v 1 2 -1\nv 2 2 -1\nv 2 2 0\nv 1 2 0
v -0.5 2 1\nv 0.5 2 1\nv 0.5 2 2\nv -0.5 2 2
usemtl floor\nf 1 2 3 4\nusemtl one\nf 5 6 7 8\nusemtl two\nf 9 10 11 12\nusemtl three\nf 13 14 15 16\n",
    ),
    (
        "lights.mtl",
        "newmtl floor\nKd 0.7 0.7 0.7\nnewmtl one\nKd 1 1 1\nKe 1 1 1\nnewmtl two\nKd 1 1 1\nKe 4 4 4\nnewmtl three\nKd 1 1 1\nKe 16 16 16\n",
    ),
];

const SMALL: &str = r#"{
    "name": "small", "seed": 5, "scenes": ["lights", "penumbra"], "size": "10x8",
    "samplers": ["uniform", "stratified", "halton:plain", "ld"], "spp": [4, 64], "replicates": 5,
    "reference": {"sampler": "sobol", "spp": 4096}
}"#;

/// The keys that this is about.
const MORE: &str =
    r#""estimator": "both", "stability": {"spp": 16, "samplers": ["ld:best", "halton:plain", "stratified"]}, "#;

fn with_more(more: &str) -> Experiment {
    let text = SMALL.replacen("\"reference\"", &format!("{more}\"reference\""), 1);
    Experiment::from_value(&json::parse(text.as_bytes(), "small.json").unwrap(), "small.json").unwrap()
}

/// A folder with the scene of three lights, and a lab that finds it and the repository's scenes.
struct Place {
    folder: tempfile::TempDir,
    lab: Lab,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in LIGHTS {
            std::fs::write(folder.path().join(name), content).unwrap();
        }
        let repository = Path::new(env!("CARGO_MANIFEST_DIR"));
        std::fs::copy(repository.join("configs/penumbra.json"), folder.path().join("penumbra.json")).unwrap();
        let options = OpenOptions { data: vec![repository.join("data")], ..OpenOptions::default() };
        let lab = Lab::new(&folder.path().join("small.json"), options);
        Self { folder, lab }
    }

    fn plan(&self, more: &str) -> Result<Plan> {
        plan(&with_more(more), &self.lab)
    }

    /// Runs to its end, `at_most` items at a time.
    fn run(&self, name: &str, threads: usize, at_most: usize) -> std::path::PathBuf {
        let out = self.folder.path().join(name);
        let plan = self.plan(MORE).unwrap();
        let options = Options { at_most: Some(at_most), ..Options::new(threads, "sampler-lab run small.json") };
        loop {
            let outcome = execute(&plan, &self.lab, &out, &Silent, &options).unwrap();
            assert_eq!(outcome.failures, []);
            if !outcome.interrupted {
                return out;
            }
        }
    }
}

fn rows(out: &Path) -> Vec<Row> {
    results::read(&results::results_path(out)).unwrap()
}

fn summary(out: &Path, rows: &[Row]) -> Summary {
    summarise(rows, &[], &results::read_about(&results::about_path(out)).unwrap())
}

fn said(out: &Path, rows: &[Row]) -> String {
    text(&summary(out, rows), &Figures::default())
}

// --- plans ---

#[test]
fn what_is_asked_for_besides_moves_no_id_and_no_seed_of_the_plain_items() {
    let place = Place::new();
    let (before, after) = (place.plan("").unwrap(), place.plan(MORE).unwrap());
    for item in &before.items {
        let at = after.position(&item.id).unwrap_or_else(|| panic!("{} is not there", item.label()));
        assert_eq!(&after.items[at], item);
    }
    let only_asked_about: Vec<&str> = after
        .items
        .iter()
        .filter(|item| before.position(&item.id).is_none())
        .filter(|item| !item.label().contains(", "))
        .map(|item| item.sampler().unwrap())
        .collect();
    assert!(!only_asked_about.contains(&"uniform:step:fresh@each"), "a sampler that stability does not name");
}

#[test]
fn every_other_making_stands_after_its_twin_and_has_its_seed() {
    let plan = Place::new().plan(MORE).unwrap();
    let mut found = std::collections::HashMap::new();
    for (position, item) in plan.items.iter().enumerate() {
        let Work::Image(work) = &item.work else { continue };
        assert_eq!(work.twin.is_some(), !work.variant.is_plain() || work.estimator == Estimator::Sheet);
        let Some(twin) = &work.twin else { continue };
        let at = plan.position(twin).unwrap();
        let Work::Image(plain) = &plan.items[at].work else { panic!("a twin is an image") };
        assert!(at < position && plain.twin.is_none());
        assert_eq!((plain.seed, plain.replicate, plain.spp.asked), (work.seed, work.replicate, work.spp.asked));
        assert!(plan.images_needed(position).contains(&twin.as_str()));
        *found.entry((work.scene.as_str(), work.variant, work.estimator.name())).or_insert(0) += 1;
    }
    // ld and stratified with 5 replicates, halton:plain with 1; the shortcut of all four samplers at two counts.
    for scene in ["lights", "penumbra"] {
        for variant in Variant::COMPARED {
            assert_eq!(found.remove(&(scene, variant, "unbiased")), Some(11), "{scene} {variant}");
        }
    }
    assert_eq!(found.remove(&("lights", Variant::Plain, "sheet")), Some(2 * 16));
    assert!(found.is_empty(), "penumbra has one light, so nothing to leave out: {found:?}");
}

#[test]
fn a_plan_says_which_counts_were_taken_in_passes() {
    let plan = Place::new().plan(r#""stability": {"spp": 26},"#).unwrap();
    let taken = |words: &str| {
        let item = plan.items.iter().find(|item| item.label().contains(words)).unwrap();
        let Work::Image(work) = &item.work else { panic!("{words} is an image") };
        (work.spp.asked, work.spp.taken)
    };
    // 26 has no factor pair near a square, 25 and 1 have.
    assert_eq!(taken("lights stratified:shuffle:jitter@each 26 spp 10x8 replicate 0, two-passes"), (26, 26));
    assert_eq!(taken("lights stratified:shuffle:jitter@each 26 spp 10x8 replicate 0, scaled(1e6)"), (26, 28));
}

#[test]
fn a_stability_that_cannot_be_asked_about_is_refused_with_its_place() {
    let refused = |place: &Place, more: &str, expected: &str| {
        let error = place.plan(more).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains(expected), "{error}");
    };
    let place = Place::new();
    refused(
        &place,
        r#""stability": {"spp": 16, "samplers": ["ld", "hammersley"]},"#,
        "small.json: stability.samplers[1]: expected one of the experiment's samplers uniform stratified halton:plain ld, found \"hammersley\"",
    );
    refused(&place, r#""stability": {"spp": 16, "samplers": ["lt"]},"#, "small.json: stability.samplers[0]: ");
    // A scene a million times as large as single precision can hold.
    let (name, content) = LIGHTS[1];
    std::fs::write(place.folder.path().join(name), content.replace("v 9 0 9", "v 900000000 0 9")).unwrap();
    refused(
        &place,
        r#""stability": {"spp": 16},"#,
        "small.json: stability: scene lights: scene: scaled(1e6): expected coordinates up to 1e12",
    );
    assert!(place.plan("").is_ok());
}

// --- the lab ---

fn opened(scene: &str, sets: &[&str]) -> load::LoadedScene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("configs/{scene}.json"));
    let sets = sets.iter().map(|&set| set.to_owned()).collect();
    load::open(&path, &OpenOptions { sets, ..OpenOptions::default() }).unwrap()
}

/// The picture of a scene whose lengths are multiplied.
fn picture(loaded: &load::LoadedScene, factor: f32, sampler: &str) -> Image {
    let (config, mesh) = scaled(&loaded.config, &loaded.mesh, factor);
    let scene = Scene::new(&config, mesh, (SIZE.width, SIZE.height), Stage::Final).unwrap();
    let spec = SamplerSpec::parse(sampler, Preset::Best).unwrap();
    render(&scene, &Sampler::new(spec, &scene.layout, 16, 9).unwrap()).unwrap().image
}

#[test]
fn a_power_of_two_as_the_unit_of_length_changes_no_bit() {
    for (scene, sets) in [
        ("cornell", &[][..]),
        ("cornell", &["camera.lens_radius=0.2", "camera.focal_depth=7.5"]),
        ("penumbra", &[]),
        ("a01", &["auto_focus=false", "camera.focal_depth=4"]),
    ] {
        let loaded = opened(scene, sets);
        let plain = picture(&loaded, 1.0, "ld");
        assert!(plain.pixels.iter().any(|pixel| pixel[0] > 0.0));
        for power in [-20, -3, 1, 20] {
            let factor = libm::exp2(f64::from(power)) as f32;
            assert!(picture(&loaded, factor, "ld") == plain, "{scene} {sets:?} 2^{power}");
        }
    }
}

fn request<'a>(sampler: &'a str, spp: u32, variant: Variant) -> RenderRequest<'a> {
    let (estimator, stage) = (Estimator::Unbiased, Stage::Final);
    RenderRequest {
        scene: "lights",
        sampler,
        spp,
        seed: 17,
        size: SIZE,
        estimator,
        stage,
        variant,
        threads: 2,
        stop: None,
    }
}

/// The mean of sample 0, again sample 0, and samples 1, 2 and 3: five samples of which one is there twice. Each mean is rounded
/// to f32 once or twice, 2⁻²³ of it at the most.
#[test]
fn two_passes_of_a_sequence_repeat_its_first_point() {
    let place = Place::new();
    place.lab.open_scene("lights").unwrap();
    let loaded = load::open(&place.folder.path().join("lights.json"), &OpenOptions::default()).unwrap();
    let scene = Scene::new(&loaded.config, loaded.mesh, (SIZE.width, SIZE.height), Stage::Final).unwrap();
    let sampler = "halton:step:none";
    let spec = SamplerSpec::parse(sampler, Preset::Best).unwrap();
    let four = Sampler::new(spec, &scene.layout, 4, 17).unwrap();
    let image = place.lab.render(&request(sampler, 5, Variant::TwoPasses)).unwrap();
    let one_pass = place.lab.render(&request(sampler, 5, Variant::Plain)).unwrap();
    assert_ne!(image, one_pass);
    for y in 0..SIZE.height {
        for x in 0..SIZE.width {
            let samples = [0, 0, 1, 2, 3].map(|index| render_sample(&scene, &four, x, y, index).as_dvec3());
            let expected = (samples.iter().sum::<glam::DVec3>() / 5.0).to_array();
            let found = image.pixels[(y * SIZE.width + x) as usize];
            for c in 0..3 {
                assert!((f64::from(found[c]) - expected[c]).abs() <= expected[c] * 2f64.powi(-22), "({x}, {y})");
            }
        }
    }
}

#[test]
fn the_second_pass_of_a_randomised_sampler_draws_numbers_of_its_own() {
    let place = Place::new();
    place.lab.open_scene("lights").unwrap();
    let sampler = "uniform:step:fresh@each";
    let render = |spp: u32, variant: Variant| place.lab.render(&request(sampler, spp, variant)).unwrap();
    let [one, two_plain, two_passes] =
        [render(1, Variant::Plain), render(2, Variant::Plain), render(2, Variant::TwoPasses)];
    let second = |two: &Image| -> Vec<f64> {
        let channels = two.pixels.as_flattened().iter().zip(one.pixels.as_flattened());
        channels.map(|(two, one)| 2.0 * f64::from(*two) - f64::from(*one)).collect()
    };
    assert!(
        one != two_passes && two_plain != two_passes,
        "neither the first pass again nor the second sample of one pass"
    );
    // What is left of the second pass is radiance, not the first pass over again.
    let (left, first) = (second(&two_passes), second(&one));
    assert!(left.iter().all(|&radiance| radiance > -1e-5));
    let same = left.iter().zip(&first).filter(|(a, b)| (**a - **b).abs() < 1e-6).count();
    assert!(same < left.len() / 2, "{same} of {}", left.len());
    assert_eq!(render(1, Variant::TwoPasses), one, "one sample cannot be split");
}

// --- runs and reports ---

#[test]
fn a_run_with_all_of_it_is_the_same_whatever_the_threads_and_the_kills_and_its_report_is_whole() {
    let place = Place::new();
    let out = place.run("once", 2, usize::MAX);
    let other = place.run("in pieces", 7, 29);
    let read = |out: &Path| std::fs::read(results::results_path(out)).unwrap();
    assert!(read(&out) == read(&other));
    let written = write(&out).unwrap();
    written.check().unwrap();
    let report = std::fs::read_to_string(&written.report).unwrap();
    sentences_of_stability(&report);
    sentences_of_the_shortcut(&report, &out);
    let csv = std::fs::read_to_string(out.join("stability.csv")).unwrap();
    let fields: Vec<usize> = csv.lines().skip(1).map(|line| line.split(',').count()).collect();
    // Two scenes, three samplers, three counts, three other makings; the first line names the columns.
    assert!(fields.len() == 1 + 2 * 3 * 6 && fields.iter().all(|&n| n == fields[0]), "{fields:?}");
    // Nothing of it is in an experiment that does not ask.
    let plain: Vec<Row> = rows(&out).into_iter().filter(is_plain).collect();
    let mut about = results::read_about(&results::about_path(&out)).unwrap();
    about.experiment = Experiment { place: String::new(), ..with_more("") };
    let silent = text(&summarise(&plain, &[], &about), &Figures::default());
    assert!(!silent.contains("## Stability") && !silent.contains("shortcut beside") && !silent.contains("Incomplete"));
}

fn is_plain(row: &Row) -> bool {
    match row {
        Row::Image(row) => row.twin.is_none(),
        Row::Ensemble(row) => row.variant.is_plain() && row.estimator == Estimator::Unbiased,
        _ => true,
    }
}

#[track_caller]
fn assert_said(report: &str, words: &str) {
    let section = report.split("## Stability").nth(1).map_or(report, |rest| rest.split("\n## ").next().unwrap());
    assert!(report.contains(words), "{words:?} is not in {section}");
}

/// Facts: 17 of a stratified set are 18 = 3·6 taken; halton:plain has one image; scaled images move by roundings.
fn sentences_of_stability(report: &str) {
    for scene in ["lights", "penumbra"] {
        assert_said(report, &format!("| in `{scene}` | 15 / 16 spp | 17 / 16 spp | 26 / 16 spp | verdict |"));
        assert_said(report, &format!("| `{scene}` | `halton:plain` | – | – | – | – | nothing random |"));
    }
    assert_said(report, ", 28 taken |");
    assert_said(report, "24 ratios of errors");
    assert!(!report.contains("NaN") && !report.contains("not a number"));
    let section = report.split("### In another unit of length").nth(1).unwrap().split("###").next().unwrap();
    assert_eq!(
        section.matches("unchanged beyond rounding |").count() + section.matches("bit for bit the same |").count(),
        12
    );
}

/// Powers 1 : 4 : 16 mean that a light is picked with p = 1/21, 4/21, 16/21 and its light, not divided, counts p times itself: on a
/// floor that all light alike the image is darker by a factor of 21²/(1 + 4² + 16²) = 1.62, here a little off that. So wrong an
/// image is told from an unbiased one at twice its interval by any seed.
fn sentences_of_the_shortcut(report: &str, out: &Path) {
    for sampler in ["uniform:best", "stratified:best", "ld:best"] {
        assert_said(report, &format!("- `{sampler}` in `lights`: the shortcut converges to a wrong image (bias² is "));
    }
    assert_said(report, "In `penumbra` no light is picked among several");
    assert_said(report, "darker by a factor of 1.");
    let rows = rows(out);
    let is_counted = |row: &ImageRow, estimator: Estimator| {
        let is_of_scene = row.kind == Kind::Render && row.scene == "lights" && row.spp.asked == 64;
        is_of_scene && row.variant.is_plain() && row.estimator == estimator
    };
    let mean = |estimator: Estimator| -> f64 {
        let images = rows.iter().filter_map(|row| if let Row::Image(row) = row { Some(row) } else { None });
        let means: Vec<f64> = images.filter(|row| is_counted(row, estimator)).map(|row| row.mean).collect();
        means.iter().sum::<f64>() / means.len() as f64
    };
    let factor = mean(Estimator::Unbiased) / mean(Estimator::Sheet);
    assert!((1.3..2.0).contains(&factor), "{factor}");
}

/// A report after `edit` of some rows.
fn edited(out: &Path, ensembles: impl Fn(&mut EnsembleRow), images: impl Fn(&mut ImageRow)) -> String {
    let mut rows = rows(out);
    for row in &mut rows {
        match row {
            Row::Ensemble(row) => ensembles(row),
            Row::Image(row) => images(row),
            _ => {}
        }
    }
    said(out, &rows)
}

fn estimate(value: f64, half: f64) -> Estimate {
    Estimate { value, ci95: Some([value - half, value + half]) }
}

/// Sets the MSE within `relative` of itself.
fn set(row: &mut EnsembleRow, mse: f64, relative: f64) {
    row.mse = estimate(mse, relative * mse);
    row.rmse = Some(estimate(mse.sqrt(), relative * mse.sqrt() / 2.0));
}

#[test]
fn other_numbers_have_other_words() {
    let place = Place::new();
    let out = place.run("out", 2, usize::MAX);
    let is_ld = |sampler: &str, scene: &str| sampler.starts_with("ld:") && scene == "lights";
    let same = |_: &mut ImageRow| ();
    // All errors of ld in `lights` are made up: its neighbours 4 and 64 as 1/√n promises from 16, so does 26 but for being far less.
    let level = |relative: f64, at_17: f64| {
        let plain = move |row: &mut EnsembleRow| {
            if is_ld(&row.sampler, &row.scene) && row.variant.is_plain() && row.estimator == Estimator::Unbiased {
                match row.spp.asked {
                    4 => set(row, 4e-4, relative),
                    64 => set(row, 0.25e-4, relative),
                    15 | 16 => set(row, 1e-4, relative),
                    17 => set(row, 1e-4 * at_17 * at_17, relative),
                    26 => set(row, 1e-6, relative),
                    _ => {}
                }
            }
        };
        edited(&out, plain, same)
    };
    let line = |report: &str, start: &str| {
        let section = report.split("## Stability").nth(1).unwrap();
        section.lines().find(|line| line.starts_with(start)).unwrap_or_else(|| panic!("{section}")).to_owned()
    };
    assert!(line(&level(1e-3, 1.3), "| `ld:best` |").ends_with("| worse with a sample more |"));
    // √(16/17) is promised of 17, so 1.3 is 1.34 times that; 24 comparisons stretch the interval.
    assert_said(
        &level(1e-3, 1.3),
        "worse with a sample more (RMSE over the promised, stretched intervals): `ld:best` 1.34 [1.33, 1.35] (rows `",
    );
    assert_said(&level(1e-3, 1.3), ", promised 0.970: 1.34 [1.33, 1.35] worse |");
    assert!(line(&level(1e-3, 1.0), "| `ld:best` |").ends_with("| stable |"));
    assert!(line(&level(0.5, 1.3), "| `ld:best` |").ends_with("| cannot tell |"));

    let moved = |jumping: f64, rms: f64| {
        let twin = move |row: &mut ImageRow| {
            if let (true, Some(twin)) =
                (is_ld(&row.sampler, &row.scene) && row.variant == Variant::Scaled(6), &mut row.twin)
            {
                (twin.differing, twin.jumping, twin.rms) = (jumping, jumping, rms);
            }
        };
        line(&edited(&out, |_| (), twin), "| `lights` | `ld:best` | 1e6 |")
    };
    assert!(moved(0.0, 0.0).ends_with("| bit for bit the same |"));
    assert!(moved(0.009, 1e-9).ends_with("| unchanged beyond rounding |"));
    assert!(moved(0.011, 1e-9).ends_with("| changed |"), "too many pixels jump");
    assert!(moved(0.009, 10.0).ends_with("| changed |"), "they jump too far");

    let passes = |factor: f64| {
        let worse = move |row: &mut ImageRow| {
            if let (true, Some(errors)) =
                (is_ld(&row.sampler, &row.scene) && row.variant == Variant::TwoPasses, &mut row.errors)
            {
                // Pairs a factor apart, nearly.
                errors.mse_unbiased = factor * (1.0 + 1e-4 * f64::from(row.replicate));
            }
        };
        let plain = move |row: &mut ImageRow| {
            if let (true, Some(errors)) = (
                is_ld(&row.sampler, &row.scene)
                    && row.variant.is_plain()
                    && row.spp.asked == 16
                    && row.estimator == Estimator::Unbiased,
                &mut row.errors,
            ) {
                errors.mse_unbiased = 1.0;
            }
        };
        let report = edited(
            &out,
            |_| (),
            |row| {
                worse(row);
                plain(row);
            },
        );
        let section = report.split("### Two passes").nth(1).unwrap().to_owned();
        section.lines().find(|line| line.starts_with("| `lights` | `ld:best` |")).unwrap().to_owned()
    };
    assert!(passes(4.0).ends_with("| worse in two passes |"), "{}", passes(4.0));
    assert!(passes(1.0).ends_with("| stable |"), "{}", passes(1.0));

    let spread = |worst: f64| {
        let apart = move |row: &mut ImageRow| {
            if let (true, Some(errors)) = (is_ld(&row.sampler, &row.scene) && row.spp.asked == 16, &mut row.errors) {
                errors.mse_unbiased = if row.replicate == 3 { worst * worst } else { 1.0 };
            }
        };
        line(&edited(&out, |_| (), apart), "| `lights` | `ld:best` | 1.00 |")
    };
    // Five replicates, χ² with 4 degrees of freedom: 11.14 and 0.4844, so s is known to factors of 0.599 and 2.87. One that is
    // 1 + x of four ones has a variation of x/√5/(1 + x/5).
    assert!(spread(1.05).ends_with("| 1.05 | 1.00 | 2.2 % [1.3 %, 6.4 %] | narrow |"), "{}", spread(1.05));
    assert!(spread(1.2).ends_with("| 1.20 | 1.00 | 8.6 % [5.2 %, 25 %] | cannot tell |"), "{}", spread(1.2));
    assert!(spread(3.0).ends_with("| 3.00 | 1.00 | 64 % [38 %, 184 %] | wide |"), "{}", spread(3.0));
    the_shortcut_in_other_words(&out);
    missing_rows_are_counted(&out);
}

fn the_shortcut_in_other_words(out: &Path) {
    let right = |row: &mut EnsembleRow| {
        if row.estimator == Estimator::Sheet {
            set(row, 1.0 / f64::from(row.spp.asked), 1e-3);
            row.bias2 = estimate(0.0, 1e-6);
        }
    };
    let bright = |row: &mut ImageRow| {
        if row.estimator == Estimator::Sheet {
            row.mean = 1e9 * (1.0 + 0.001 * f64::from(row.replicate));
        }
    };
    assert_said(
        &edited(out, right, |_| ()),
        "- `ld:best` in `lights`: the shortcut: error falls, no bias seen, darker by",
    );
    assert_said(&edited(out, |_| (), bright), "brighter by a factor of ");
}

fn missing_rows_are_counted(out: &Path) {
    let all = rows(out);
    let without = |drop: &dyn Fn(&EnsembleRow) -> bool| {
        let rows: Vec<Row> =
            all.iter().filter(|row| !matches!(row, Row::Ensemble(row) if drop(row))).cloned().collect();
        let summary = summary(out, &rows);
        (text(&summary, &Figures::default()), summary.missing)
    };
    let (report, missing) = without(&|row| row.variant == Variant::TwoPasses && row.sampler.starts_with("ld:"));
    assert_eq!(missing, ["the stability of 2 of 6 samplers in scenes"]);
    assert!(report.contains("16 ratios of errors"));
    let (report, missing) = without(&|row| row.estimator == Estimator::Sheet);
    assert_eq!(missing, ["8 of 8 comparisons of the sheet's shortcut"]);
    assert!(report.contains("Of `lights` there are no rows of both estimators at 64 spp yet."));
    let (report, _) = without(&|_| true);
    assert!(report.contains("There are no rows yet to tell of stability."));
}

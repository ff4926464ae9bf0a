//! A sampler for each decision, from the experiment's file to the report: on scenes in which one decision carries the error
//! by construction, the report has to name it.

use std::collections::HashSet;
use std::fmt::Write;
use std::path::Path;

use sampler_lab::error::Result;
use sampler_lab::experiment::execute::{Options, execute};
use sampler_lab::experiment::lab::Lab;
use sampler_lab::experiment::plan::{Plan, plan};
use sampler_lab::experiment::progress::Silent;
use sampler_lab::experiment::results::{self, Kind, Row};
use sampler_lab::experiment::spec::Experiment;
use sampler_lab::report;
use sampler_lab::scene::load::OpenOptions;

const MTL: &str = "newmtl white\nKd 0.9 0.9 0.9\nnewmtl dark\nKd 0.1 0.1 0.1\n\
                   newmtl light\nKd 1 1 1\nKe 10 10 10\nnewmtl light2\nKd 1 1 1\nKe 10 10 10\n";

/// A checkered wall z = 0 that faces −z: `2·half / cell` squares a side.
fn checkered(half: f64, cell: f64) -> String {
    let mut text = "mtllib scene.mtl\n".to_owned();
    let count = (2.0 * half / cell).round() as i32;
    for (i, j) in (0..count).flat_map(|i| (0..count).map(move |j| (i, j))) {
        let (x, y) = (f64::from(i) * cell - half, f64::from(j) * cell - half);
        let corners = [(x, y), (x, y + cell), (x + cell, y + cell), (x + cell, y)];
        corners.iter().for_each(|(x, y)| writeln!(text, "v {x} {y} 0").unwrap());
        writeln!(text, "usemtl {}\nf -4 -3 -2 -1", if (i + j) % 2 == 0 { "white" } else { "dark" }).unwrap();
    }
    text
}

/// A plain wall z = 0 that faces −z, and squares of half-size `half` that shine downwards.
fn lit(lights: &[(&str, [f64; 3])], half: f64) -> String {
    let mut text = "mtllib scene.mtl\nv -4 -4 0\nv -4 4 0\nv 4 4 0\nv 4 -4 0\nusemtl white\nf 1 2 3 4\n".to_owned();
    for (material, [x, y, z]) in lights {
        for (dx, dz) in [(-half, -half), (half, -half), (half, half), (-half, half)] {
            writeln!(text, "v {} {y} {}", x + dx, z + dz).unwrap();
        }
        writeln!(text, "usemtl {material}\nf -4 -3 -2 -1").unwrap();
    }
    text
}

/// Scenes seen from z = −3 under a narrow angle, a pixel 0.09 wide on the wall.
fn write_scenes(folder: &Path) {
    let scene = |name: &str, camera: &str, shading: &str, obj: &str| {
        let json = format!(
            r#"{{"camera": {{"pos": [0, 0, -3], "dir": [0, 0, 1], "fov": 10, {camera}}}, "auto_focus": false, "shading": "{shading}",
                "framebuffer": {{"res_w": 8, "res_h": 6, "sppx": 4}}, "scene": {{"mesh_files": ["{name}.obj"]}}}}"#
        );
        std::fs::write(folder.join(format!("{name}.json")), json).unwrap();
        std::fs::write(folder.join(format!("{name}.obj")), obj).unwrap();
    };
    std::fs::write(folder.join("scene.mtl"), MTL).unwrap();
    // Focus at 1: a point is blurred over a disk of radius 1, four squares meet in the middle of it.
    scene("blur", r#""lens_radius": 0.5, "focal_depth": 1"#, "albedo", &checkered(2.0, 2.0));
    // In focus the lens changes nothing; squares are smaller than a pixel.
    scene("fine", r#""lens_radius": 0.5, "focal_depth": 3"#, "albedo", &checkered(0.6, 0.05));
    scene("edge", r#""lens_radius": 0"#, "albedo", &checkered(0.6, 0.05));
    // One large light near the wall; two tiny ones of equal power, one near and one far.
    scene("lamp", r#""lens_radius": 0"#, "direct", &lit(&[("light", [0.0, 1.0, -1.0])], 0.9));
    let pair = [("light", [0.0, 0.6, -0.3]), ("light2", [0.0, 3.0, -0.3])];
    scene("pair", r#""lens_radius": 0"#, "direct", &lit(&pair, 0.01));
}

const EXPERIMENT: &str = r#"{
    "name": "which", "seed": 3, "scenes": ["blur", "fine", "edge", "lamp", "pair"],
    "samplers": [
        "uniform",
        {"name": "pixel alone", "sampler": "uniform", "pixel": "ld"},
        {"name": "lens alone", "sampler": "uniform", "lens": "ld"},
        {"name": "pick alone", "sampler": "uniform", "light_pick": "ld"},
        {"name": "light alone", "sampler": "uniform", "light": {"points": "ld", "order": "shuffle"}},
        "ld:best"
    ],
    "spp": [16, 64], "replicates": 8, "reference": {"sampler": "sobol", "spp": 2048},
    "points": {"n": [4, 16], "metrics": ["star"], "replicates": 2},
    "pictures": {"scene": "lamp", "size": "16x12", "spp": 4, "reference_spp": 16}
}"#;

/// A folder with the scenes and an experiment, and its lab.
fn set_up(experiment: &str) -> (tempfile::TempDir, Experiment, Lab) {
    let folder = tempfile::tempdir().unwrap();
    write_scenes(folder.path());
    let path = folder.path().join("which.json");
    std::fs::write(&path, experiment).unwrap();
    let experiment = Experiment::read(&path).unwrap();
    let lab = Lab::new(&path, OpenOptions::default());
    (folder, experiment, lab)
}

fn planned(from: &str, to: &str) -> Result<Plan> {
    let text = EXPERIMENT.replacen(from, to, 1);
    assert!(from.is_empty() || text != EXPERIMENT, "{from}");
    let (_folder, experiment, lab) = set_up(&text);
    plan(&experiment, &lab)
}

/// By construction: out of focus the lens; fine squares in focus the pixel; a large near light its point; two lights of one power
/// and different distances the choice. Each carries more than half of the MSE at 64 spp (the rest: edges that 64 points find only
/// in part); a sentence that named another would have to mistake it at a joint level of 95 %.
#[test]
fn the_report_names_the_decision_that_carries_the_error() {
    let (folder, experiment, lab) = set_up(EXPERIMENT);
    let plan = plan(&experiment, &lab).unwrap();
    let out = folder.path().join("out");
    let options = Options::new(2, "sampler-lab run which.json");
    execute(&plan, &lab, &out, &Silent, &options).unwrap().check().unwrap();
    let written = report::write(&out).unwrap();
    written.check().unwrap();
    let text = std::fs::read_to_string(&written.report).unwrap();
    for (scene, decision) in [("blur", "lens"), ("fine", "pixel"), ("lamp", "light point"), ("pair", "light pick")] {
        let start =
            format!("**in `{scene}` the error comes from the {decision}**: well-spread points for it alone take ");
        let at = text.find(&start).unwrap_or_else(|| panic!("{scene}: {text}"));
        let share: f64 = text[at + start.len()..].split(' ').next().unwrap().parse().unwrap();
        assert!(share > 50.0, "{scene}: {share} %");
    }
    assert!(text.contains("`edge` makes one decision, the pixel: all of a sampler's error is its"), "{text}");
    assert!(text.contains("**Which decision does the error come from?**"), "{text}");
    assert!(text.contains("](figures/which-decision.svg)") && out.join("figures/which-decision.png").is_file());
    assert!(!text.contains("missing") && !text.contains("unknown") && !text.contains("NaN"), "{text}");
    // The table: what a scene does not decide is said, and every share stands under its decision.
    let line = text.lines().find(|line| line.starts_with("| `lamp` | `uniform:best` → `ld:best` | 64 |")).unwrap();
    let cells: Vec<&str> = line.split(" | ").collect();
    assert_eq!((cells[4], cells[5]), ("not decided", "not decided"), "{line}");
    assert!(cells[3].contains(" %") && cells[6].contains(" %"), "{line}");

    let again = execute(&plan, &lab, &out, &Silent, &options).unwrap();
    assert_eq!((again.done, again.found), (0, plan.items.len()));
    let rows = results::read(&results::results_path(&out)).unwrap();
    let about = results::read_about(&results::about_path(&out)).unwrap();
    assert_eq!(about.left_out, plan.left_out);
    assert_eq!(about.experiment.samplers, experiment.samplers, "names and sets read back");
    let named = |row: &Row| match row {
        Row::Image(row) if row.kind == Kind::Render => Some((row.scene.clone(), row.names[0].clone())),
        _ => None,
    };
    let named: HashSet<(String, String)> = rows.iter().filter_map(named).collect();
    let is_there = |scene: &str, name: &str| named.contains(&(scene.to_owned(), name.to_owned()));
    assert!(is_there("blur", "lens alone") && is_there("pair", "pick alone") && is_there("lamp", "light alone"));
    assert!(!is_there("lamp", "lens alone") && !is_there("lamp", "pick alone") && !is_there("blur", "light alone"));
    // Of the one decision of `edge` the set is what `ld:best` is.
    assert!(!is_there("edge", "pixel alone") && is_there("edge", "ld:best"));
    let render = |scene: &str| named.iter().filter(|(s, _)| s == scene).count();
    assert_eq!([render("blur"), render("edge"), render("lamp"), render("pair")], [4, 2, 4, 5]);
}

#[test]
fn what_means_the_same_in_a_scene_is_done_once_there_and_said() {
    let plan = planned("", "").unwrap();
    let note = |text: &str| assert!(plan.notes.iter().any(|note| note == text), "{text}: {:#?}", plan.notes);
    let same = "not done, since they are the same for the decisions of this scene";
    let layout = "pixel 0–1, light point 2–3, 4 dimensions in all";
    note(&format!("lamp: {same} ({layout}): lens alone = uniform, pick alone = uniform"));
    note(&format!(
        "edge: {same} (pixel 0–1, 2 dimensions in all): pixel alone = ld:best, lens alone = uniform, \
         pick alone = uniform, light alone = uniform"
    ));
    note("no point sets of pixel alone, lens alone, pick alone, light alone: each has a sampler a decision");
    let points = plan.items.iter().filter(|item| item.kind() == Kind::Points).filter_map(|item| item.sampler());
    assert!(points.collect::<HashSet<_>>().iter().all(|sampler| !sampler.contains('=')));
    let pictures = plan.items.iter().filter(|item| item.kind() == Kind::Picture).count();
    assert_eq!(pictures, 4, "uniform, pixel alone, light alone, ld:best");
}

/// Sets beside them change neither id nor seed of what single samplers do; an alias of a single sampler is that sampler.
#[test]
fn sets_leave_ids_and_seeds_of_single_samplers_alone() {
    let alone = planned(
        &EXPERIMENT[EXPERIMENT.find("\"uniform\",").unwrap()..EXPERIMENT.find("],\n    \"spp\"").unwrap()],
        "\"uniform\", \"ld:best\"",
    );
    let (alone, with_sets) = (alone.unwrap(), planned("", "").unwrap());
    for item in &alone.items {
        let at = with_sets.position(&item.id).unwrap_or_else(|| panic!("{}", item.label()));
        assert_eq!(with_sets.items[at].seed(), item.seed());
    }
    let alias = planned("\"ld:best\"\n", "{\"name\": \"good\", \"sampler\": \"ld:best\"}\n").unwrap();
    assert!(alias.items.iter().map(|item| &item.id).eq(with_sets.items.iter().map(|item| &item.id)));
    assert_eq!(alias.names("ld:shuffle:owen@each"), ["good"]);
}

#[test]
fn a_set_that_cannot_be_planned_is_refused_with_its_place() {
    for (from, to, expected) in [
        (
            "\"lens\": \"ld\"",
            "\"lens\": \"ldd\"",
            "which.json: samplers[2].lens: sampler \"ldd\": expected a point set",
        ),
        (
            "\"lens\": \"ld\"",
            "\"light\": \"center\"",
            "samplers: scene lamp: sampler \"center\": expected a sampler with numbers",
        ),
        (
            "\"lens alone\"",
            "\"ld:sheet\"",
            "samplers[2].name: expected a name that is not another sampler's, found \"ld:sheet\"",
        ),
        // In `edge` only the pixel is decided: this set is the reference there.
        ("\"pixel\": \"ld\"", "\"pixel\": \"sobol\"", "which is the same as pixel alone in edge"),
        (
            "{\"sampler\": \"sobol\"",
            "{\"sampler\": \"pixel=uniform lens=ld light-pick=uniform light=uniform\"",
            "reference.sampler: expected a sampler that is not compared",
        ),
    ] {
        let error = planned(from, to).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains(expected), "{error} ({expected})");
    }
    let set = "{\"sampler\": \"pixel=sobol lens=sobol light-pick=ld:step:owen light=sobol\"";
    assert!(planned("{\"sampler\": \"sobol\"", set).is_ok(), "a set may be the reference's");
}

/// `stratified` in one decision asks for 28 of 26: all decisions take them, and the rows say so.
#[test]
fn the_count_that_one_decision_takes_is_recorded_for_the_set() {
    let plan = planned("\"lens\": \"ld\"", "\"lens\": \"stratified\"").unwrap();
    assert!(!plan.notes.iter().any(|note| note.contains("taken")), "16 and 64 are taken as asked");
    let text = EXPERIMENT.replacen("\"lens\": \"ld\"", "\"lens\": \"stratified\"", 1).replacen("[16, 64]", "[26]", 1);
    let (_folder, experiment, lab) = set_up(&text);
    let notes = sampler_lab::experiment::plan::plan(&experiment, &lab).unwrap().notes;
    let found: Vec<&String> = notes.iter().filter(|note| note.contains("26 spp asked")).collect();
    assert_eq!(found, ["blur, lens alone: 26 spp asked, 28 taken", "fine, lens alone: 26 spp asked, 28 taken"]);
}

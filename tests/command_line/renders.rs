//! `render`, `config`, `explain`, help.

use super::*;

#[test]
fn a_render_says_what_it_did_in_json_alone_on_stdout() {
    let folder = Folder::sound();
    let args = ["render", "a.json", "--sampler", "stratified", "--spp", "26", "--size", "6x4", "--json", "--quiet"];
    let ran = folder.run(&args);
    assert_eq!(ran.stderr, "");
    let document = ran.json();
    assert_eq!(document["file"], "a.png");
    assert_eq!(document["scene"], "a.json");
    assert_eq!(document["sampler"], "stratified:shuffle:jitter@each");
    assert_eq!(document["estimator"], "unbiased");
    assert_eq!(document["spp"], serde_json::json!({"asked": 26, "taken": 28}));
    assert_eq!(document["size"], "6x4");
    assert_eq!(document["seed"], 1);
    // The wall stands 3 in front of the camera.
    assert!((document["focal_depth"].as_f64().unwrap() - 3.0).abs() < 1e-6);
    for key in ["render_seconds", "load_seconds", "build_seconds", "samples_per_second", "rays_per_second"] {
        assert!(document[key].as_f64().is_some_and(|x| x >= 0.0), "{key}");
    }
    assert!(document["peak_bytes"].is_null() || document["peak_bytes"].as_u64().is_some_and(|b| b > 100_000));
    let drawn = image::open(folder.path("a.png")).unwrap();
    assert_eq!((drawn.width(), drawn.height(), drawn.color()), (6, 4, image::ColorType::Rgb8));
    let pinhole = folder.run(&["render", "a.json", "--set", "camera.lens_radius=0", "--json"]).json();
    assert!(pinhole["focal_depth"].is_null());
}

#[test]
fn a_decision_s_own_sampler_is_recorded_whole_and_changes_the_picture() {
    let folder = Folder::sound();
    let common = ["render", "a.json", "--sampler", "ld:sheet", "--spp", "26", "--quiet", "--json"];
    let run = |more: &[&str]| folder.run(&[&common[..], more].concat()).json();
    let plain = run(&["--out", "plain.exr"]);
    let lens = run(&["--out", "lens.exr", "--lens", "stratified"]);
    let text = "pixel=ld:sheet lens=stratified:shuffle:jitter@each light-pick=ld:sheet light=ld:sheet";
    assert_eq!(lens["sampler"], text);
    assert_eq!(lens["samplers"]["lens"], "stratified:shuffle:jitter@each");
    assert_eq!(lens["samplers"]["light_pick"], "ld:sheet");
    assert_eq!((&plain["spp"]["taken"], &lens["spp"]["taken"]), (&26.into(), &28.into()));
    let (_, provenance) = read_exr(&folder.path("lens.exr")).unwrap();
    assert!(provenance.contains(&("sampler".to_owned(), text.to_owned())), "{provenance:?}");
    // The same set as one text, or by overriding what is overridden, is the same image.
    let one_by_one = ["--pixel", "ld:sheet", "--lens", "stratified", "--light-pick", "ld:sheet", "--light", "ld:sheet"];
    let base = ["render", "a.json", "--sampler", "uniform", "--spp", "26", "--quiet", "--out", "text.exr"];
    folder.run(&[&base[..], &one_by_one].concat()).fine();
    let pixels = |name: &str| read_exr(&folder.path(name)).unwrap().0.pixels;
    assert!(pixels("text.exr") == pixels("lens.exr") && pixels("plain.exr") != pixels("lens.exr"));
    let text_form = ["render", "a.json", "--sampler", text, "--spp", "26", "--quiet", "--out", "form.exr"];
    folder.run(&text_form).fine();
    assert!(folder.bytes("form.exr") == folder.bytes("lens.exr"));
    // Equal everywhere is the plain sampler, by name and by bytes.
    let same = run(&["--out", "same.exr", "--pixel", "ld:sheet", "--light-pick", "ld:sheet"]);
    assert_eq!(same["sampler"], "ld:sheet");
    assert!(folder.bytes("same.exr") == folder.bytes("plain.exr"));
}

#[test]
fn a_sampler_for_a_decision_that_the_scene_does_not_make_is_said_and_changes_nothing() {
    let folder = Folder::sound();
    let plain = ["render", "a.json", "--sampler", "ld", "--set", "camera.lens_radius=0", "--out"];
    folder.run(&[&plain[..], &["plain.png"]].concat()).fine();
    let ran = folder.run(&[&plain[..], &["lens.png", "--lens", "uniform", "--light", "ld"]].concat());
    let note = "note: --lens: a.json makes no such decision (pixel 0–1, light point 2–3, 4 dimensions in all): nothing reads it";
    assert!(ran.stderr.contains(note) && !ran.stderr.contains("note: --light"), "{}", ran.stderr);
    ran.fine();
    assert!(folder.bytes("plain.png") == folder.bytes("lens.png"));
}

/// The scene with lens, textures and 61 768 triangles, on 1, 2 and 7 threads.
#[test]
fn a_render_has_the_same_bytes_on_every_thread_count() {
    let scene = repository("configs/a01.json");
    let folder = Folder::empty();
    for sampler in ["sobol", "ld:sheet", "uniform"] {
        for threads in ["1", "2", "7"] {
            for ending in ["png", "exr"] {
                let out = format!("{threads}/a.{ending}");
                let size = ["--size", "48x27", "--spp", "4", "--threads", threads, "--out", &out, "--quiet"];
                folder.run(&[&["render", &scene, "--sampler", sampler], &size[..]].concat()).fine();
            }
        }
        let of = |threads: &str| files(&folder.path(threads));
        assert_eq!(of("1").len(), 2);
        assert!(of("1") == of("2") && of("1") == of("7"), "{sampler}");
    }
}

#[test]
fn an_exr_says_what_made_it() {
    let folder = Folder::sound();
    folder.run(&["render", "a.json", "--out", "a.exr", "--seed", "7", "--stage", "dof"]).fine();
    let (image, provenance) = read_exr(&folder.path("a.exr")).unwrap();
    assert_eq!((image.width, image.height), (8, 6));
    let provenance: BTreeMap<_, _> = provenance.into_iter().collect();
    for (key, value) in [("scene", "a.json"), ("sampler", "sobol:joint:owen@each"), ("seed", "7"), ("stage", "dof")] {
        assert_eq!(provenance.get(key).map(String::as_str), Some(value), "{key}");
    }
}

#[test]
fn the_four_stages_are_four_pictures_of_one_size() {
    let folder = Folder::sound();
    let mut pictures = Vec::new();
    for stage in ["start", "aa", "dof", "final"] {
        folder.run(&["render", "a.json", "--stage", stage, "--set", "auto_focus=false"]).fine();
        pictures.push(folder.bytes("a.png"));
    }
    // The wall is out of focus, and its border crosses pixels.
    let distinct: std::collections::BTreeSet<_> = pictures.iter().collect();
    assert_eq!(distinct.len(), 4);
}

// config and explain

#[test]
fn what_config_show_prints_loads_to_the_same_picture() {
    for (name, sets) in [("a01", &["camera.fov=60"][..]), ("cornell", &[])] {
        let file = repository(&format!("configs/{name}.json"));
        let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let shown = run_in(Path::new("."), &[&["config", "show", &file], &sets[..]].concat()).fine();
        let folder = Folder::new(&[("shown.json", &shown)]);
        assert_eq!(folder.run(&["config", "show", "shown.json"]).fine(), shown);
        let common = ["--size", "32x18", "--spp", "2", "--data", &repository("data")];
        folder.run(&[&["render", &file, "--out", "file.exr"], &common[..], &sets[..]].concat()).fine();
        folder.run(&[&["render", "shown.json", "--out", "shown.exr"], &common[..]].concat()).fine();
        let pixels = |name: &str| read_exr(&folder.path(name)).unwrap().0;
        assert_eq!(pixels("file.exr"), pixels("shown.exr"), "{name}");
    }
}

#[test]
fn explain_tells_what_each_decision_reads() {
    let text = run_in(Path::new("."), &["explain", "sobol", "--scene", &repository("configs/a01.json")]).fine();
    for part in [
        "sobol = sobol:joint:owen@each",
        "Domain: 1 to 16777216 samples, indices from 0 to one below the count; a net at powers of two",
        "pixel 0–1, lens 2–3, light point 4–5",
        "light pick   not decided",
    ] {
        assert!(text.contains(part), "{part:?} is missing in: {text}");
    }
    let text = run_in(Path::new("."), &["explain", "stratified:sheet"]).fine();
    assert!(text.contains("stratified:step:jitter@each") && text.contains("26 → 28 = 4×7"), "{text}");
    let scene = repository("configs/cornell.json");
    let ran =
        run_in(Path::new("."), &["explain", "ld:sheet", "--lens", "halton", "--light", "halton", "--scene", &scene]);
    assert!(ran.stderr.contains("note: --lens: ") && !ran.stderr.contains("note: --light: "), "{}", ran.stderr);
    let text = ran.fine();
    for part in [
        "pixel=ld:sheet lens=halton:joint:digits@each light-pick=ld:sheet light=halton:joint:digits@each\n",
        "  light point  halton:joint:digits@each\n",
        "  light point  Halton's bases 5 and 7\n",
        "  lens         not decided in this scene: no numbers\n",
    ] {
        assert!(text.contains(part), "{part:?} is missing in: {text}");
    }
}

#[test]
fn help_and_version_go_to_stdout() {
    let help = run_in(Path::new("."), &["--help"]).fine();
    for command in
        ["run", "report", "status", "merge", "render", "points", "measure", "config", "explain", "Exit codes"]
    {
        assert!(help.contains(command), "{command}");
    }
    assert_eq!(run_in(Path::new("."), &["--version"]).fine(), format!("sampler-lab {}\n", env!("CARGO_PKG_VERSION")));
}

// run

//! The lab's own backend.

use super::*;

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

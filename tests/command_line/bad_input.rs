//! Bad input: exit codes 2, 3 and 4, the place in the message, and nothing left behind.

use super::*;

/// The usual scene file with `from` written as `to`.
fn scene(from: &str, to: &str) -> Folder {
    assert!(SCENE.contains(from), "{from}");
    Folder::with("a.json", &SCENE.replacen(from, to, 1))
}

/// The usual mesh with line `number` (from 1) written as `line`.
fn mesh(number: usize, line: &str) -> Folder {
    let lines: Vec<&str> = OBJ.lines().enumerate().map(|(i, old)| if i + 1 == number { line } else { old }).collect();
    Folder::with("a.obj", &lines.join("\n"))
}

// Bad scene files: each of the list in the README, by every command that reads a scene.

#[test]
fn the_sound_scene_is_sound() {
    let folder = Folder::sound();
    assert!(folder.run(&["config", "check", "a.json"]).fine().contains("a.json: sound; 4 triangles"));
    folder.run(&["render", "a.json", "--out", "out/a.png"]).fine();
    folder.run(&["run", "e.json", "--out", "out"]).fine();
}

#[test]
fn an_unknown_key_is_refused_with_the_nearest_one() {
    scene("lens_radius", "lens_radus").refuses_config(&[
        "a.json: camera.lens_radus: expected one of the keys",
        "found an unknown key; did you mean \"lens_radius\"?",
    ]);
}

#[test]
fn a_wrong_type_is_refused() {
    scene("0.1", "\"0.1\"").refuses_config(&["a.json: camera.lens_radius: expected a length", "found \"0.1\""]);
    scene("[\"a.obj\"]", "\"a.obj\"")
        .refuses_config(&["a.json: scene.mesh_files: expected an array", "found \"a.obj\""]);
}

#[test]
fn a_number_that_is_not_finite_is_refused() {
    scene("0.1", "NaN").refuses_config(&["a.json: line 1, column", "expected one JSON document", "found"]);
    scene("0.1", "1e999").refuses_config(&["a.json: line 1, column", "expected", "found: number out of range"]);
    scene("0.1", "1e39").refuses_config(&["a.json: camera.lens_radius: expected", "below 3.4e38", "found 1e+39"]);
}

#[test]
fn a_negative_radius_is_refused() {
    scene("0.1", "-0.1").refuses_config(&["a.json: camera.lens_radius: expected a length, 0", "found -0.1"]);
}

#[test]
fn a_direction_of_length_zero_is_refused() {
    scene("[0, 0, 1]", "[0, 0, 0]").refuses_config(&["a.json: camera.dir: expected a direction", "found [0, 0, 0]"]);
}

#[test]
fn a_field_of_view_outside_0_to_180_is_refused() {
    for fov in ["0", "180", "-10", "1e9"] {
        let place = "a.json: camera.fov: expected an angle between 0 and 180 degrees, found";
        scene("\"lens_radius\": 0.1", &format!("\"fov\": {fov}")).refuses_config(&[place]);
    }
    scene("\"lens_radius\": 0.1", "\"fov\": NaN").refuses_config(&["a.json: line 1, column", "expected", "found"]);
}

#[test]
fn no_samples_are_refused() {
    scene("\"sppx\": 4", "\"sppx\": 0")
        .refuses_config(&["a.json: framebuffer.sppx: expected a whole number from 1 to 16777216", "found 0"]);
}

#[test]
fn an_image_of_no_pixels_is_refused() {
    for side in ["res_w", "res_h"] {
        let size = if side == "res_w" { "8" } else { "6" };
        scene(&format!("\"{side}\": {size}"), &format!("\"{side}\": 0"))
            .refuses_config(&[&format!("a.json: framebuffer.{side}: expected a whole number from 1"), "found 0"]);
    }
}

#[test]
fn a_key_that_stands_twice_is_refused() {
    scene("\"pos\"", "\"dir\": [1, 0, 0], \"pos\"").refuses_config(&[
        "a.json: line 1, column",
        "expected one JSON document, each key once",
        "found: the key \"dir\" twice",
    ]);
}

#[test]
fn what_is_not_modelled_is_refused_with_a_remedy_that_works() {
    let sky = scene("{\"mesh_files\"", "{\"sky\": {\"file\": \"noon.hdr\"}, \"mesh_files\"");
    sky.refuses_config(&["a.json: scene.sky: expected null", "--set scene.sky=null", "found {\"file\": \"noon.hdr\"}"]);
    sky.run(&["config", "check", "a.json", "--set", "scene.sky=null"]).fine();
    let volume = scene("{\"mesh_files\"", "{\"volume\": 1, \"mesh_files\"");
    volume.refuses_config(&["a.json: scene.volume: expected null", "--set scene.volume=null", "found 1"]);
    volume.run(&["render", "a.json", "--set", "scene.volume=null"]).fine();
    let paths = scene("\"camera\"", "\"algorithm\": \"PathTracer\", \"camera\"");
    paths.refuses_config(&["a.json: algorithm: expected", "--set algorithm=SimpleRenderer", "found \"PathTracer\""]);
    paths.run(&["run", "e.json", "--out", "out", "--set", "algorithm=SimpleRenderer"]).fine();
}

#[test]
fn a_missing_scene_file_is_refused() {
    let folder = Folder::sound();
    std::fs::remove_file(folder.path("a.json")).unwrap();
    for args in [&["config", "show", "a.json"][..], &["config", "check", "a.json"], &["render", "a.json"]] {
        folder.refuses(args, 2, &["a.json: expected a readable scene file", "found", "No such file"]);
    }
    folder.refuses(&["run", "e.json"], 2, &["scene \"a\": expected a scene file, found none at", "a.json"]);
}

#[test]
fn a_missing_mesh_is_refused() {
    scene("a.obj", "b.obj").refuses_scene(&[
        "a.json: scene.mesh_files[0]: expected the mesh file \"b.obj\", found it in none of",
        "--data DIR",
    ]);
}

#[test]
fn a_missing_material_library_is_refused() {
    mesh(1, "mtllib b.mtl").refuses_scene(&["a.obj:1: expected the material library \"b.mtl\", found"]);
}

#[test]
fn a_missing_texture_is_refused() {
    let textured = Folder::with("a.mtl", &format!("{MTL}map_Kd tiles.png\n"));
    textured.refuses_scene(&["a.mtl:6: expected the texture \"tiles.png\" (PNG or JPEG), found"]);
}

#[test]
fn usemtl_of_an_unknown_material_is_refused_with_the_nearest_one() {
    mesh(6, "usemtl wal").refuses_scene(&["a.obj:6: expected usemtl of", "found \"wal\"; did you mean \"wall\"?"]);
}

#[test]
fn a_face_of_fewer_than_three_vertices_is_refused() {
    mesh(7, "f 1 2").refuses_scene(&["a.obj:7: expected a face of at least 3 corners, found 2"]);
}

#[test]
fn a_mesh_without_faces_is_refused() {
    Folder::with("a.obj", "v 0 0 0\n").refuses_scene(&["a.obj: expected at least one face (f), found none"]);
    Folder::with("a.obj", "").refuses_scene(&["a.obj: expected at least one face (f), found none"]);
}

#[test]
fn an_index_out_of_range_is_refused() {
    for face in ["f 1 2 5", "f 1 2 0", "f 1 2 -9"] {
        let found = format!("found {}", &face[6..]);
        mesh(7, face).refuses_scene(&["a.obj:7: expected an index of a position (v) from 1 to 4", &found]);
    }
}

#[test]
fn a_vertex_that_is_no_number_is_refused() {
    mesh(3, "v 2 NaN 0").refuses_scene(&["a.obj:3: expected v with 3 finite coordinates", "found \"NaN\""]);
}

#[test]
fn a_black_material_that_emits_is_refused_by_name() {
    let black = MTL.replace("Kd 1 1 1", "Kd 0 0 0\nKs 0 0 0");
    Folder::with("a.mtl", &black).refuses_scene(&["a.mtl:3: expected a colour for what emits", "material \"light\""]);
}

/// Bytes that are no text, half a file, an empty one, a folder: all read as bad input.
#[test]
fn what_is_no_scene_at_all_is_refused() {
    let folder = Folder::sound();
    std::fs::write(folder.path("a.json"), [0xff, 0xfe, 0, 1]).unwrap();
    folder.refuses_config(&["a.json: line 1", "expected one JSON document", "found"]);
    Folder::with("a.json", "").refuses_config(&["a.json: line 1", "expected", "found"]);
    Folder::with("a.json", &SCENE[..50]).refuses_config(&["a.json: line 1", "expected", "found"]);
    folder.refuses(&["render", ".", "--out", "a.png"], 2, &[".: expected a readable scene file", "found"]);
}

// Bad values on the command line.

/// Arguments, and what the message has to say: the place, what was expected, what was found.
const BAD_ARGUMENTS: &[(&[&str], &[&str])] = &[
    (&["render", "a.json", "--sampler", "halten"], &["sampler \"halten\"", "expected a point set", "mean \"halton\"?"]),
    (&["render", "a.json", "--kernel", "sse"], &["--kernel: expected one of scalar, avx2, avx512, found \"sse\""]),
    (&["render", "a.json", "--sampler", "ld:stepp"], &["expected an order or preset", "did you mean \"step\"?"]),
    (&["render", "a.json", "--sampler", "halton:joint:owen"], &["expected halton:(", "found halton:joint:owen"]),
    (
        &["render", "a.json", "--sampler", "uniform:plain"],
        &["expected a preset that uniform has (sheet, best)", "plain"],
    ),
    (
        &["render", "a.json", "--sampler", "ld:step:none@pixel"],
        &["a scope only where something is keyed", "none@pixel"],
    ),
    (&["render", "a.json", "--sampler", "ld:step:xor@pixle"], &["expected a scope", "did you mean \"pixel\"?"]),
    (&["render", "a.json", "--sampler", ""], &["sampler \"\": expected a point set", "found \"\""]),
    (&["render", "a.json", "--size", "0x5"], &["--size: expected a size", "found \"0x5\""]),
    (&["render", "a.json", "--size", "5"], &["--size: expected a size", "found \"5\""]),
    (&["render", "a.json", "--size", "99999x99999"], &["67108864 pixels at most", "found \"99999x99999\""]),
    (&["render", "a.json", "--spp", "0"], &["'0' for '--spp <N>'", "1..=16777216"]),
    (&["render", "a.json", "--spp", "16777217"], &["'16777217' for '--spp <N>'", "1..=16777216"]),
    (&["render", "a.json", "--spp", "many"], &["'many' for '--spp <N>'"]),
    (&["render", "a.json", "--out", "a.jpg"], &["--out: expected a name that ends in .png or .exr", "found \"a.jpg\""]),
    (&["render", "a.json", "--out", "a"], &["--out: expected a name that ends in .png or .exr", "found \"a\""]),
    (&["render", "a.json", "--stage", "finale"], &["--stage: expected start, aa, dof or final", "found \"finale\""]),
    (&["render", "a.json", "--estimator", "x"], &["--estimator: expected unbiased or sheet", "found \"x\""]),
    (&["render", "a.json", "--threads", "0"], &["'0' for '--threads <N>'", "1..=1024"]),
    (&["render", "a.json", "--seed", "1.5"], &["'1.5' for '--seed <SEED>'"]),
    (&["render", "a.json", "--set", "camera.fov"], &["--set camera.fov: expected KEY=VALUE", "found no ="]),
    (&["render", "a.json", "--set", "camera.fov=0"], &["--set camera.fov=0: camera.fov: expected an angle", "found 0"]),
    (&["render", "a.json", "--set", "camera.fovv=9"], &["--set camera.fovv=9", "did you mean \"fov\"?"]),
    (&["render", "a.json", "--sampel"], &["'--sampel'"]),
    (&["render"], &["<SCENE>"]),
    (&["rendre", "a.json"], &["'rendre'", "'render'"]),
    (&["points", "halten"], &["sampler \"halten\"", "did you mean \"halton\"?"]),
    (&["points", "uniform", "center"], &["sampler \"center\"", "expected a sampler with numbers"]),
    (&["points", "-n", "0"], &["'0' for '-n <N>'", "1..=16777216"]),
    (&["points", "-n", "16777217"], &["'16777217' for '-n <N>'", "1..=16777216"]),
    (&["points", "--format", "xml"], &["'xml' for '--format <FORMAT>'", "csv, json"]),
    (&["measure", "halten"], &["sampler \"halten\"", "nor is there a file \"halten\""]),
    (&["measure", "none.csv"], &["none.csv: expected a readable CSV file", "found"]),
    (&["measure", "halton", "-n", "0"], &["'0' for '-n <N>'", "1..=16777216"]),
    (
        &["render", "a.json", "--lens", "halten"],
        &["--lens: sampler \"halten\"", "expected a point set", "did you mean \"halton\"?"],
    ),
    (&["render", "a.json", "--light", "center"], &["expected a sampler with numbers", "\"light point\""]),
    (&["render", "a.json", "--light_pick", "ld"], &["'--light_pick'", "'--light-pick'"]),
    (
        &["render", "a.json", "--sampler", "pixel=ld lens=ld light=ld"],
        &["samplers \"pixel=ld", "expected a sampler for each of the decisions", "found none for light-pick"],
    ),
    (
        &["render", "a.json", "--sampler", "pixel=ld lense=ld light-pick=ld light=ld"],
        &["expected a decision (pixel, lens, light-pick, light)", "did you mean \"lens\"?"],
    ),
    (&["explain", "ld", "--pixel", "ldd"], &["--pixel: sampler \"ldd\"", "expected a point set"]),
    (&["explain", "halten"], &["sampler \"halten\"", "did you mean \"halton\"?"]),
    (&["run", "none.json"], &["none.json: expected a readable JSON file", "found"]),
    (&["run", "a.json"], &["a.json: expected the key \"name\", found none"]),
    (&["report", "none"], &["none", "expected", "found"]),
    (&["status", "none"], &["none/experiment.json: expected what was run", "found"]),
    (&["merge", "none", "--out", "m"], &["none/experiment.json: expected what was run", "found"]),
    (&["merge", "--out", "m"], &["<DIR>..."]),
    (&["run", "e.json", "--shard", "3/2"], &["--shard: expected I/N with 1 ≤ I ≤ N", "found \"3/2\""]),
];

#[test]
fn a_bad_value_on_the_command_line_is_refused_and_leaves_nothing() {
    let folder = Folder::sound();
    for (args, parts) in BAD_ARGUMENTS {
        folder.refuses(args, 2, parts);
    }
}

#[test]
fn a_bad_experiment_is_refused() {
    for (from, to, parts) in [
        ("\"seed\"", "\"sede\"", ["e.json: expected the key \"seed\"", "did you mean \"sede\"?"]),
        ("\"replicates\": 2", "\"replicates\": 0", ["e.json: replicates: expected a whole number from 1", "found 0"]),
        ("\"uniform\"", "\"unifrom\"", ["\"unifrom\"", "did you mean \"uniform\"?"]),
        ("\"4x3\"", "\"0x5\"", ["e.json: size: expected a size", "found \"0x5\""]),
        ("\"sobol\"", "\"uniform\"", ["reference", "expected"]),
        ("\"sobol\"", "\"halton:plain\"", ["reference", "expected"]),
        ("[\"a\"]", "[]", ["e.json: scenes: expected a list of scene names", "found []"]),
    ] {
        let folder = Folder::with("e.json", &EXPERIMENT.replacen(from, to, 1));
        folder.refuses(&["run", "e.json", "--out", "out"], 2, &parts);
        folder.refuses(&["run", "e.json", "--out", "out", "--dry-run"], 2, &parts);
    }
}

// Writing that fails.

/// A path below a regular file cannot be written by anyone. It is refused before the work, not after.
#[test]
fn an_output_that_cannot_be_written_is_exit_code_3() {
    let folder = Folder::sound();
    for args in [
        &["render", "a.json", "--out", "e.json/a.png"][..],
        &["render", "a.json", "--out", "e.json/deep/a.exr"],
        &["points", "--out", "e.json"],
        &["points", "halton", "--out", "e.json/deep"],
        &["run", "e.json", "--out", "e.json"],
        &["run", "e.json", "--out", "e.json/deep"],
    ] {
        folder.refuses(args, 3, &["e.json", "cannot write"]);
    }
    // So many samples would take days.
    let endless = ["render", "a.json", "--spp", "16777216", "--size", "999x999", "--out", "e.json/a.png"];
    folder.refuses(&endless, 3, &["e.json/a.png: cannot write"]);
}

/// An emitter near the end of `f32`, 40 wide at a distance of 9: some of its samples overflow.
#[test]
fn a_radiance_that_is_not_finite_is_exit_code_4_with_pixel_and_sample() {
    let folder = Folder::with("a.mtl", &MTL.replace("Ke 15 15 15", "Ke 3e38 3e38 3e38"));
    let wide = OBJ.replace("1 -9", "20 -9").replace("v -1 ", "v -20 ").replace("v 1 ", "v 20 ");
    std::fs::write(folder.path("a.obj"), wide).unwrap();
    folder.refuses(&["render", "a.json", "--stage", "final"], 4, &["a.json: ", "pixel", "sample"]);
    let ran = folder.run(&["run", "e.json", "--out", "out"]);
    assert_eq!(ran.code, Some(4), "{}", ran.stderr);
    assert!(ran.stderr.contains("failed") && ran.stderr.contains("pixel"), "{}", ran.stderr);
    assert!(folder.path("out/report.md").is_file(), "what exists is reported");
}

// measure

#[test]
fn a_bad_point_file_is_refused_with_its_line() {
    for (text, parts) in [
        ("", ["points.csv: expected at least one point", "found none"]),
        ("# nothing\nx,y\n\n", ["points.csv: expected at least one point", "found none"]),
        ("x,y\n0.5,0.5\n0.5\n", ["points.csv: line 3: expected 2 coordinates", "found 1"]),
        ("0.5,0.5\n\n0.5,1.5\n", ["points.csv: line 3: expected a number in [0, 1]", "found \"1.5\""]),
        ("0.5,-0.1\n", ["points.csv: line 1: expected a number in [0, 1]", "found \"-0.1\""]),
        ("0.5,nan\n", ["points.csv: line 1: expected a number in [0, 1]", "found \"nan\""]),
        ("0.1,0.2\ninf,0.5\n", ["points.csv: line 2: expected a number in [0, 1]", "found \"inf\""]),
        ("0.1,0.2\n0.5,\n", ["points.csv: line 2: expected a number in [0, 1]", "found \"\""]),
        ("0.1,0.2\nabc,0.5\n", ["points.csv: line 2: expected a number in [0, 1]", "found \"abc\""]),
        // Not taken for a header: a first point that is lost would be found by nobody.
        ("0.1 0.2\n0.3 0.4\n", ["points.csv: line 1: expected a number in [0, 1]", "found \"0.1 0.2\""]),
        ("0.5;0.5\n", ["points.csv: line 1: expected a number in [0, 1]", "found \"0.5;0.5\""]),
    ] {
        let folder = Folder::new(&[("points.csv", text)]);
        folder.refuses(&["measure", "points.csv"], 2, &parts);
        folder.refuses(&["measure", "points.csv", "--json"], 2, &parts);
    }
    let folder = Folder::new(&[("points.csv", "0.5,0.5\n")]);
    folder.refuses(&["measure", "points.csv", "-n", "3"], 2, &["-n: expected no count with a file", "found 3"]);
    std::fs::write(folder.path("points.csv"), [0xff, 0xfe, b'0']).unwrap();
    folder.refuses(&["measure", "points.csv"], 2, &["points.csv: line 1: expected UTF-8 text", "found other bytes"]);
}

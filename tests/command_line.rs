//! The program from outside: exit codes, what goes to stdout, stderr and files, and that the same input gives the same bytes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use sampler_lab::film::read_exr;
use serde_json::Value;
use tempfile::TempDir;

/// The program, started in `folder`.
fn lab(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sampler-lab"));
    command.current_dir(folder).args(args).stdin(Stdio::null());
    command
}

/// What a run said and how it ended.
struct Ran {
    args: String,
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

fn ran(args: &[&str], output: Output) -> Ran {
    Ran {
        args: args.join(" "),
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

fn run_in(folder: &Path, args: &[&str]) -> Ran {
    ran(args, lab(folder, args).output().unwrap())
}

impl Ran {
    /// Ended well; what it wrote to stdout.
    #[track_caller]
    fn fine(self) -> String {
        assert_eq!(self.code, Some(0), "{}: {}", self.args, self.stderr);
        self.stdout
    }

    /// Ended well with one JSON document on stdout.
    #[track_caller]
    fn json(self) -> Value {
        serde_json::from_str(&self.fine()).unwrap()
    }

    /// Ended with `code`, nothing on stdout, and one error on stderr that has all `parts` and is no panic.
    #[track_caller]
    fn refused(self, code: i32, parts: &[&str]) {
        let Self { args, stdout, stderr, .. } = self;
        assert_eq!(self.code, Some(code), "{args}: {stderr}");
        assert_eq!(stdout, "", "{args}");
        assert_eq!(stderr.matches("error: ").count(), 1, "{args}: {stderr}");
        assert!(!stderr.contains("panicked") && !stderr.contains("RUST_BACKTRACE"), "{args}: {stderr}");
        let message = &stderr[stderr.find("error: ").unwrap()..];
        for part in parts {
            assert!(message.contains(part), "{args}: {part:?} is missing in: {message}");
        }
    }
}

/// A folder of files, gone after the test.
struct Folder(TempDir);

impl Folder {
    fn new(files: &[(&str, &str)]) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        for (name, text) in files {
            std::fs::write(folder.0.path().join(name), text).unwrap();
        }
        folder
    }

    fn empty() -> Self {
        Self::new(&[])
    }

    /// A sound scene, and an experiment on it.
    fn sound() -> Self {
        Self::new(&[("a.json", SCENE), ("a.obj", OBJ), ("a.mtl", MTL), ("e.json", EXPERIMENT)])
    }

    /// The sound scene with one file exchanged.
    fn with(name: &str, text: &str) -> Self {
        let folder = Self::sound();
        std::fs::write(folder.0.path().join(name), text).unwrap();
        folder
    }

    fn run(&self, args: &[&str]) -> Ran {
        run_in(self.0.path(), args)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// Runs, and demands a refusal as [`Ran::refused`] that leaves every file as it was and adds none.
    #[track_caller]
    fn refuses(&self, args: &[&str], code: i32, parts: &[&str]) {
        let before = files(self.0.path());
        self.run(args).refused(code, parts);
        assert_eq!(files(self.0.path()), before, "{args:?} left something");
    }

    /// The scene is refused wherever it is read, with the same words.
    #[track_caller]
    fn refuses_scene(&self, parts: &[&str]) {
        self.refuses(&["config", "check", "a.json"], 2, parts);
        self.refuses(&["render", "a.json", "--out", "out/a.png"], 2, parts);
        self.refuses(&["run", "e.json", "--out", "out"], 2, parts);
        self.refuses(&["explain", "ld", "--scene", "a.json"], 2, parts);
    }

    /// As [`refuses_scene`](Self::refuses_scene), for what the scene file alone shows: `config show` refuses it too.
    #[track_caller]
    fn refuses_config(&self, parts: &[&str]) {
        self.refuses(&["config", "show", "a.json"], 2, parts);
        self.refuses_scene(parts);
    }
}

/// Every file and folder below `root`, by its path there; the contents of files.
fn files(root: &Path) -> BTreeMap<PathBuf, Option<Vec<u8>>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let contents = if path.is_dir() {
                folders.push(path.clone());
                None
            } else {
                Some(std::fs::read(&path).unwrap())
            };
            found.insert(path.strip_prefix(root).unwrap().to_owned(), contents);
        }
    }
    found
}

/// A path inside the repository.
fn repository(path: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path).display().to_string()
}

const MTL: &str = "newmtl wall\nKd 0.5 0.25 0.125\nnewmtl light\nKd 1 1 1\nKe 15 15 15\n";
const OBJ: &str = "mtllib a.mtl\nv -2 -1 0\nv 2 -1 0\nv 2 3 0\nv -2 3 0\nusemtl wall\nf 4 3 2 1\n\
                   v -1 -1 -9\nv -1 1 -9\nv 1 1 -9\nv 1 -1 -9\nusemtl light\nf -1 -2 -3 -4\n";
const SCENE: &str = r#"{"camera": {"pos": [0, 0, -3], "dir": [0, 0, 1], "lens_radius": 0.1},
    "framebuffer": {"res_w": 8, "res_h": 6, "sppx": 4}, "scene": {"mesh_files": ["a.obj"]}}"#;
const EXPERIMENT: &str = r#"{"name": "e", "seed": 1, "scenes": ["a"], "size": "4x3", "samplers": ["uniform"], "spp": [1],
    "replicates": 2, "reference": {"sampler": "sobol", "spp": 4}}"#;

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

/// The keys of a `measure` document that hold a root and its square.
const ROOTS: [&str; 9] = [
    "l2_star",
    "centred_l2",
    "wrap_around_l2",
    "mixture_l2",
    "modified_l2",
    "extreme_l2",
    "symmetric_l2",
    "periodic_l2",
    "diaphony",
];

#[track_caller]
fn assert_is_measurement(document: &Value, source: &str, n: u64, dimension: u64) {
    assert_eq!(document["source"], source);
    assert_eq!((document["n"].as_u64(), document["dimension"].as_u64()), (Some(n), Some(dimension)));
    let star = &document["star"];
    assert!(star["value"].as_f64().is_some_and(|d| d > 0.0 && d <= 1.0), "{star}");
    assert_eq!(star["exact"], true);
    assert_eq!(star["corner"].as_array().map(Vec::len), Some(dimension as usize));
    assert!(star["side"] == "open" || star["side"] == "closed");
    for name in ROOTS {
        let (value, squared) = (document[name]["value"].as_f64(), document[name]["squared"].as_f64());
        let (value, squared) = (value.unwrap(), squared.unwrap());
        assert!((value * value - squared).abs() <= 1e-15 * squared.max(1.0), "{name}: {value}² is not {squared}");
    }
    for name in ["t_value", "min_toroidal_distance"] {
        assert!(document[name].is_null() || document[name].is_number(), "{name}");
    }
}

/// One point at the centre: D* = 3/4 at the closed box [0, 1/2]², its L2-star squared is 23/288 (Warnock's formula by hand).
#[test]
fn one_point_is_measured_from_stdin() {
    let args = ["measure", "-", "--json"];
    let mut child = lab(Folder::empty().0.path(), &args)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::io::Write::write_all(&mut child.stdin.take().unwrap(), b"u,v\r\n0.5,0.5\r\n").unwrap();
    let document = ran(&args, child.wait_with_output().unwrap()).json();
    assert_is_measurement(&document, "-", 1, 2);
    assert_eq!(document["star"]["value"], 0.75);
    assert_eq!(document["star"]["corner"], serde_json::json!([0.5, 0.5]));
    assert_eq!(document["star"]["side"], "closed");
    assert!((document["l2_star"]["squared"].as_f64().unwrap() - 23.0 / 288.0).abs() < 1e-15);
    assert_eq!(document["t_value"], 0);
    assert!(document["min_toroidal_distance"].is_null());
}

#[test]
fn duplicates_and_five_dimensions_are_measured() {
    let folder = Folder::new(&[("points.csv", "0.5,0.5,0.1,0.2,0.3\n0.5,0.5,0.1,0.2,0.3 # again\n1,1,1,1,1\n")]);
    let document = folder.run(&["measure", "points.csv", "--json"]).json();
    assert_is_measurement(&document, "points.csv", 3, 5);
    assert!(document["t_value"].is_null(), "3 is no power of two");
    assert_eq!(document["min_toroidal_distance"], 0.0);
    let text = folder.run(&["measure", "points.csv"]).fine();
    assert!(text.starts_with("points.csv: 3 points in 5 dimensions\n"), "{text}");
}

/// `star_prefixes.json`: 64 Halton points have D* = 5/96.
#[test]
fn a_sampler_and_the_file_that_points_wrote_of_it_measure_alike() {
    let folder = Folder::empty();
    folder.run(&["points", "halton", "-n", "64"]).fine();
    let mut of_file = folder.run(&["measure", "halton.csv", "--json"]).json();
    let mut of_sampler = folder.run(&["measure", "halton", "-n", "64", "--json", "--threads", "1"]).json();
    assert_is_measurement(&of_sampler, "halton", 64, 2);
    assert!((of_sampler["star"]["value"].as_f64().unwrap() - 5.0 / 96.0).abs() < 1e-14);
    let sampler = of_sampler.as_object_mut().unwrap().remove("sampler").unwrap();
    assert_eq!((&sampler["asked"], &sampler["seed"]), (&64.into(), &1.into()));
    of_file["source"] = of_sampler["source"].clone();
    assert_eq!(of_file, of_sampler);
}

// points

/// The sheet's Figure 2 painted again from the CSV: black, 5×5 dots, the point's own pixel in the middle, origin at the
/// bottom left, colour (t, 1 − t, 1 − t).
fn painted(csv: &str) -> image::RgbImage {
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("x,y"));
    let points: Vec<(f64, f64)> = lines
        .map(|line| line.split_once(',').unwrap())
        .map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()))
        .collect();
    let mut panel = image::RgbImage::new(512, 512);
    for (i, (x, y)) in points.iter().enumerate() {
        let t = if points.len() == 1 { 0.0 } else { i as f64 / (points.len() - 1) as f64 };
        let colour = [t, 1.0 - t, 1.0 - t].map(|c| (c * 255.0).round() as u8);
        let (column, row) = ((x * 512.0) as i64, 511 - (y * 512.0) as i64);
        for (u, v) in (-2..=2).flat_map(|u| (-2..=2).map(move |v| (column + u, row + v))) {
            if (0..512).contains(&u) && (0..512).contains(&v) {
                panel.put_pixel(u as u32, v as u32, image::Rgb(colour));
            }
        }
    }
    panel
}

#[test]
fn points_draws_and_writes_the_sheet_s_five_sets() {
    let folder = Folder::empty();
    assert_eq!(folder.run(&["points", "--out", "deep/figure2"]).fine(), "");
    let names = ["halton", "hammersley", "ld", "stratified", "uniform"];
    let mut expected: Vec<String> = names.iter().flat_map(|n| [format!("{n}.csv"), format!("{n}.png")]).collect();
    expected.sort();
    let found = files(&folder.path("deep/figure2"));
    assert_eq!(found.keys().map(|p| p.display().to_string()).collect::<Vec<_>>(), expected);
    for name in names {
        let csv = String::from_utf8(folder.bytes(&format!("deep/figure2/{name}.csv"))).unwrap();
        assert_eq!(csv.lines().count(), 1025);
        let drawn = image::open(folder.path(&format!("deep/figure2/{name}.png"))).unwrap();
        assert_eq!((drawn.width(), drawn.height(), drawn.color()), (512, 512, image::ColorType::Rgb8));
        assert!(drawn.into_rgb8() == painted(&csv), "{name}");
    }
}

#[test]
fn a_set_s_files_are_named_after_it_and_one_point_is_cyan() {
    let folder = Folder::empty();
    folder.run(&["points", "ld:shuffle:owen@decision", "hammersley:plain", "-n", "1", "--quiet"]).fine();
    assert_eq!(folder.bytes("hammersley-plain.csv"), b"x,y\n0,0\n");
    // The dot at the origin is cut by the border: 3×3 pixels at the bottom left are left of it.
    let drawn = image::open(folder.path("hammersley-plain.png")).unwrap().into_rgb8();
    let lit: Vec<_> = drawn.enumerate_pixels().filter(|(_, _, p)| p.0 != [0; 3]).map(|(x, y, p)| (x, y, p.0)).collect();
    assert_eq!(lit, (509..512).flat_map(|y| (0..3).map(move |x| (x, y, [0, 255, 255]))).collect::<Vec<_>>());
    assert!(
        folder.path("ld-shuffle-owen-decision.png").is_file() && folder.path("ld-shuffle-owen-decision.csv").is_file()
    );
    // 26 strata are no grid: 28 are taken, and the file has them all.
    folder.run(&["points", "stratified", "-n", "26"]).fine();
    assert_eq!(folder.bytes("stratified.csv").split(|&b| b == b'\n').count(), 1 + 28 + 1);
}

#[test]
fn the_same_points_give_the_same_bytes_and_json_holds_the_csv_s_numbers() {
    let (one, two) = (Folder::empty(), Folder::empty());
    for folder in [&one, &two] {
        folder.run(&["points", "--seed", "9"]).fine();
    }
    assert_eq!(files(one.0.path()), files(two.0.path()));
    one.run(&["points", "ld", "--seed", "9", "--format", "json"]).fine();
    let document: Value = serde_json::from_slice(&one.bytes("ld.json")).unwrap();
    assert_eq!((&document["sampler"], &document["seed"]), (&"ld".into(), &9.into()));
    let csv = String::from_utf8(one.bytes("ld.csv")).unwrap();
    let points = document["points"].as_array().unwrap();
    assert_eq!(points.len(), 1024);
    for (line, point) in csv.lines().skip(1).zip(points) {
        assert_eq!(line, format!("{},{}", point[0].as_f64().unwrap(), point[1].as_f64().unwrap()));
    }
    two.run(&["points", "--seed", "10"]).fine();
    assert_ne!(one.bytes("uniform.csv"), two.bytes("uniform.csv"), "the seed counts");
}

// render

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

/// Lines of a file, an empty list where there is none; a last line without its end does not count.
fn lines(path: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    text.split_inclusive('\n').filter(|line| line.ends_with('\n')).map(str::to_owned).collect()
}

#[test]
fn the_smoke_experiment_runs_and_a_second_run_does_nothing() {
    let smoke = repository("configs/experiments/smoke.json");
    let folder = Folder::empty();
    let dry = folder.run(&["run", &smoke, "--out", "out", "--dry-run", "--json"]).json();
    assert!(files(folder.0.path()).is_empty(), "a dry run writes nothing");
    let planned: u64 = dry["items"].as_array().unwrap().iter().map(|kind| kind["items"].as_u64().unwrap()).sum();
    assert!(folder.run(&["run", &smoke, "--out", "out", "--dry-run"]).fine().contains("items"));

    let first = folder.run(&["run", &smoke, "--out", "out", "--json"]).json();
    assert_eq!((first["items"].as_u64(), first["done"].as_u64()), (Some(planned), Some(planned)));
    assert_eq!((&first["found"], &first["failed"]), (&0.into(), &0.into()));
    let rows = lines(&folder.path("out/results.jsonl"));
    assert_eq!(rows.len() as u64, planned);
    for row in &rows {
        let row: Value = serde_json::from_str(row).unwrap();
        assert_eq!(row["schema"], 1);
        assert!(row["id"].is_string() && row["kind"].is_string(), "{row}");
    }
    assert!(folder.path("out/report.md").is_file());

    let before = files(&folder.path("out"));
    let second = folder.run(&["run", &smoke, "--out", "out", "--json", "--threads", "1"]).json();
    assert_eq!((&second["found"], &second["done"]), (&first["items"], &0.into()));
    assert_same(&files(&folder.path("out")), &before);
    folder.run(&["report", "out"]).fine();
    assert_same(&files(&folder.path("out")), &before);

    // Pictures are not in a clone: the report is the same without them.
    std::fs::rename(folder.path("out/images"), folder.path("images")).unwrap();
    folder.run(&["report", "out"]).fine();
    std::fs::rename(folder.path("images"), folder.path("out/images")).unwrap();
    assert_same(&files(&folder.path("out")), &before);

    // Another experiment's results are not put aside, nor is anything made for one that cannot be.
    let text = std::fs::read_to_string(&smoke).unwrap();
    std::fs::write(
        folder.path("other.json"),
        text.replace("\"smoke\"", "\"other\"")
            .replace("\"cornell\"", &format!("{:?}", repository("configs/cornell.json"))),
    )
    .unwrap();
    folder
        .run(&["run", "other.json", "--out", "out"])
        .refused(2, &["experiment.json", "\"other\"", "\"smoke\"", "--fresh"]);
    assert_same(&files(&folder.path("out")), &before);
    let center = text
        .replace("\"halton:plain\"", "\"center\"")
        .replace("\"cornell\"", &format!("{:?}", repository("configs/cornell.json")));
    std::fs::write(folder.path("center.json"), center).unwrap();
    folder.run(&["run", "center.json", "--out", "new"]).refused(2, &["center", "light point"]);
    assert!(!folder.path("new").exists());

    // A picture's row is lost: what exists is reported, and the next run makes up for it.
    let is_picture = |row: &String| row.contains(r#""kind":"picture""#);
    let lost = rows.iter().rposition(is_picture).unwrap();
    let left: String = rows.iter().enumerate().filter(|(i, _)| *i != lost).map(|(_, row)| row.as_str()).collect();
    std::fs::write(folder.path("out/results.jsonl"), left).unwrap();
    folder.run(&["report", "out"]).refused(4, &["out/report.md: missing: 1 of 4 pictures"]);
    assert_eq!(folder.run(&["run", &smoke, "--out", "out", "--json", "--quiet"]).json()["done"], 1);
    let after = files(&folder.path("out"));
    for name in ["results.jsonl", "summary.csv"] {
        assert!(after[Path::new(name)] == before[Path::new(name)], "{name}");
    }
}

/// The same files with the same bytes.
#[track_caller]
fn assert_same(found: &BTreeMap<PathBuf, Option<Vec<u8>>>, expected: &BTreeMap<PathBuf, Option<Vec<u8>>>) {
    let names = |files: &BTreeMap<PathBuf, Option<Vec<u8>>>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(found), names(expected));
    for (name, bytes) in found {
        assert!(expected[name] == *bytes, "{} differs", name.display());
    }
}

/// Its references, then its images with many samples, take a second or so each: a kill after a row finds it at work.
const SLOW: &str = r#"{"name": "slow", "seed": 3, "scenes": ["cornell"], "size": "32x32", "samplers": ["uniform", "ld"],
    "spp": [1, 1024], "replicates": 2, "reference": {"sampler": "sobol", "spp": 1024},
    "points": {"n": [4, 16], "metrics": ["star"], "replicates": 3}}"#;

#[test]
fn a_run_that_is_killed_goes_on_to_the_bytes_of_one_that_was_not() {
    let folder = Folder::new(&[("slow.json", SLOW), ("cornell.json", "")]);
    std::fs::copy(repository("configs/cornell.json"), folder.path("cornell.json")).unwrap();
    let data = repository("data");
    let args = |out: &'static str, threads: &'static str| {
        ["run", "slow.json", "--out", out, "--data", &data, "--threads", threads, "--quiet"]
    };
    folder.run(&args("whole", "2")).fine();
    let whole = lines(&folder.path("whole/results.jsonl"));
    // The first rows are those of the point sets, the others those of images.
    for after in [2, 13, 17] {
        let mut child = lab(folder.0.path(), &args("killed", "1")).stderr(Stdio::null()).spawn().unwrap();
        let started = Instant::now();
        while lines(&folder.path("killed/results.jsonl")).len() < after {
            assert!(started.elapsed() < Duration::from_secs(60), "no {after} rows");
            assert!(child.try_wait().unwrap().is_none(), "ended before {after} rows");
            std::thread::sleep(Duration::from_millis(1));
        }
        child.kill().unwrap();
        assert!(!child.wait().unwrap().success(), "the kill came too late");
        assert!(lines(&folder.path("killed/results.jsonl")).len() < whole.len());
    }
    folder.run(&args("killed", "2")).fine();
    assert_eq!(lines(&folder.path("killed/results.jsonl")), whole);
    let images = |out: &str| files(&folder.path(out).join("images"));
    assert_same(&images("killed"), &images("whole"));
}

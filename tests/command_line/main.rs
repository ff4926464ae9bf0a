//! The program from outside: exit codes, what goes to stdout, stderr and files, and that the same input gives the same bytes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use sampler_lab::film::read_exr;
use serde_json::Value;
use tempfile::TempDir;

mod bad_input;
mod points;
mod renders;
mod runs;

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

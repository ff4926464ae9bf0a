//! Sweeps that survive anything: killed, cut into shards, edited under way, out of disk – and the same bytes in the end.
//!
//! The program from outside, on real processes. What a folder holds besides is its own: seconds and what they lead to.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

/// Milliseconds to run, points, references, replicates and pictures among its items.
const SMALL: &str = r#"{"name": "small", "seed": 5, "scenes": ["cornell"], "size": "16x16", "samplers": ["uniform", "ld"],
    "spp": [1, 16], "replicates": 3, "reference": {"sampler": "sobol", "spp": 64},
    "points": {"n": [4, 16], "metrics": ["star"], "replicates": 2},
    "pictures": {"scene": "cornell", "size": "24x24", "spp": 4, "reference_spp": 16}}"#;

/// One image takes longer than any test waits.
const ENDLESS: &str = r#"{"name": "endless", "seed": 5, "scenes": ["cornell"], "size": "512x512", "samplers": ["uniform"],
    "spp": [1], "replicates": 1, "reference": {"sampler": "sobol", "spp": 65536},
    "points": {"n": [4], "metrics": ["star"], "replicates": 1}}"#;

/// Longest wait for a process to come somewhere.
const PATIENCE: Duration = Duration::from_secs(120);

/// A folder with the scene and the experiments, gone after the test.
struct Desk(TempDir);

/// How a process ended.
struct Ended {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

impl Ended {
    #[track_caller]
    fn with(&self, code: i32, parts: &[&str]) -> &Self {
        assert_eq!(self.code, Some(code), "{}", self.stderr);
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
        for part in parts {
            assert!(self.stderr.contains(part), "{part:?} is missing in: {}", self.stderr);
        }
        self
    }

    #[track_caller]
    fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("{e}: {}{}", self.stdout, self.stderr))
    }
}

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

impl Desk {
    fn new() -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        for (name, text) in [("small.json", SMALL), ("endless.json", ENDLESS)] {
            std::fs::write(desk.path(name), text).unwrap();
        }
        desk.restore_scene();
        desk
    }

    fn restore_scene(&self) {
        std::fs::copy(repository("configs/cornell.json"), self.path("cornell.json")).unwrap();
    }

    /// Another field of view.
    fn edit_scene(&self) {
        let path = self.path("cornell.json");
        let mut scene: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        scene["camera"]["fov"] = 41.into();
        std::fs::write(path, scene.to_string()).unwrap();
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sampler-lab"));
        command.current_dir(self.0.path()).args(args).stdin(Stdio::null());
        if ["run", "status"].contains(&args[0]) {
            command.arg("--data").arg(repository("data"));
        }
        command
    }

    fn lab(&self, args: &[&str]) -> Ended {
        ended(self.command(args))
    }

    fn run(&self, out: &str, more: &[&str]) -> Ended {
        self.lab(&[&["run", "small.json", "--out", out, "--quiet"], more].concat())
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// The files that have to be the same bytes however a run went.
    fn results(&self, out: &str) -> [Vec<u8>; 3] {
        ["results.jsonl", "summary.csv", "experiment.json"].map(|name| self.bytes(&format!("{out}/{name}")))
    }

    #[track_caller]
    fn assert_same(&self, out: &str, expected: &[Vec<u8>; 3]) {
        for (name, (found, expected)) in
            ["results.jsonl", "summary.csv", "experiment.json"].iter().zip(self.results(out).iter().zip(expected))
        {
            assert!(found == expected, "{out}/{name} differs");
        }
        let left: Vec<PathBuf> =
            files(&self.path(out)).into_keys().filter(|path| path.to_string_lossy().ends_with(".partial")).collect();
        assert!(left.is_empty(), "half-written files are left: {left:?}");
        assert_eq!(self.status(out), (0, Vec::new()), "{out}");
        assert!(!self.path(out).join("shards.json").exists());
    }

    /// Exit code, and the reasons for what is missing.
    fn status(&self, out: &str) -> (i32, Vec<String>) {
        let ended = self.lab(&["status", out, "--json"]);
        let document = ended.json();
        let missing = document["missing"].as_array().unwrap();
        let reasons = missing.iter().map(|entry| entry["reason"].as_str().unwrap().to_owned());
        (ended.code.unwrap(), reasons.collect())
    }
}

fn ended(mut command: Command) -> Ended {
    let output = command.output().unwrap();
    Ended {
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

/// Sizes of all files below a folder.
fn files(root: &Path) -> BTreeMap<PathBuf, u64> {
    let mut found = BTreeMap::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        // A file may go between being listed and being looked at.
        for path in std::fs::read_dir(folder).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path())) {
            match path.metadata() {
                Ok(facts) if facts.is_dir() => folders.push(path),
                Ok(facts) => drop(found.insert(path, facts.len())),
                Err(_) => {}
            }
        }
    }
    found
}

fn size(root: &Path) -> u64 {
    files(root).values().sum()
}

/// Waits until `arrived` says so; whether the process ended before.
fn wait(child: &mut Child, mut arrived: impl FnMut() -> bool) -> bool {
    let started = Instant::now();
    while !arrived() {
        if child.try_wait().unwrap().is_some() {
            return true;
        }
        assert!(started.elapsed() < PATIENCE, "nothing happened");
        std::thread::sleep(Duration::from_micros(300));
    }
    false
}

fn signal(child: &Child, name: &str) {
    assert!(Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status().unwrap().success());
}

/// SplitMix64 (Steele, Lea & Flood 2014), one step.
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

// --- kills ---

/// Twenty moments spread over the whole work, report and figures too: four runs, each killed five times on its way. A
/// moment is a share of the bytes that an undisturbed folder ends with, so a slow machine is killed in the same places.
#[test]
fn a_run_killed_at_twenty_random_moments_goes_on_to_the_bytes_of_one_that_was_not() {
    let desk = Desk::new();
    desk.run("whole", &[]).with(0, &[]);
    // The page is written last and at once, and is half of all bytes: moments inside it would find no run at work.
    let page = std::fs::metadata(desk.path("whole/report.html")).unwrap().len();
    let (expected, total) = (desk.results("whole"), size(&desk.path("whole")) - page);
    let mut killed = 0;
    for chain in 0..4u64 {
        let out = format!("killed-{chain}");
        let mut moments: Vec<u64> = (0..5).map(|i| mix(100 * chain + i) % total).collect();
        moments.sort_unstable();
        for moment in moments {
            let mut command = desk.command(&["run", "small.json", "--out", &out, "--quiet", "--threads", "2"]);
            let mut child = command.stderr(Stdio::null()).spawn().unwrap();
            let ended_before = wait(&mut child, || size(&desk.path(&out)) >= moment);
            child.kill().unwrap();
            killed += usize::from(!child.wait().unwrap().success() && !ended_before);
        }
        desk.run(&out, &["--threads", ["1", "2", "7", "3"][chain as usize]]).with(0, &[]);
        desk.assert_same(&out, &expected);
    }
    // What a killed run wrote counts, so a later moment may already be past when its run starts: it is killed at once.
    assert!(killed >= 10, "only {killed} of 20 kills found a run at work");
}

#[test]
fn a_request_to_end_is_followed_inside_an_image_and_a_folder_has_one_writer_at_a_time() {
    let desk = Desk::new();
    for (name, out) in [("INT", "a"), ("TERM", "b")] {
        let run = ["run", "endless.json", "--out", out, "--threads", "1", "--json"];
        let mut child = desk.command(&run).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let rows =
            || std::fs::read_to_string(desk.path(out).join("results.jsonl")).map_or(0, |text| text.lines().count());
        // The point set is done; the endless image begins.
        assert!(!wait(&mut child, || rows() == 1));
        std::thread::sleep(Duration::from_millis(50));
        for args in [&run[..], &["report", out], &["merge", out, "--out", out], &["merge", out, "--out", "new"]] {
            desk.lab(args).with(2, &["found one at work"]);
        }
        assert!(!desk.path("new").exists());
        assert_eq!(desk.status(out), (4, vec!["missing".to_owned()]), "looking is free");
        let started = Instant::now();
        signal(&child, name);
        assert!(wait(&mut child, || false));
        assert!(started.elapsed() < Duration::from_secs(60), "it waited for the image");
        let output = child.wait_with_output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        let document: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(document["interrupted"] == true && document["done"] == 1, "{document}");
        assert_eq!(output.status.code(), Some(130), "{stderr}");
        assert!(stderr.contains("told to end with 1 of") && stderr.contains("the same command goes on"), "{stderr}");
        assert_eq!(rows(), 1);
    }
}

// --- shards ---

#[test]
fn shards_merged_in_any_order_are_the_run_that_was_not_cut() {
    let desk = Desk::new();
    desk.run("whole", &["--threads", "2"]).with(0, &[]);
    let expected = desk.results("whole");
    for (shard, threads) in [("1", "1"), ("2", "2"), ("3", "7")] {
        let document =
            desk.run(shard, &["--shard", &format!("{shard}/3"), "--threads", threads, "--json"]).with(0, &[]).json();
        assert!(document["report"].is_null() && document["done"].as_u64() > Some(0), "{document}");
        assert!(!desk.path(shard).join("report.md").exists(), "a part has no report of its own");
        assert_eq!(desk.status(shard).0, 4);
    }
    let shown = |out: &str| {
        let lines = String::from_utf8(desk.bytes("whole/results.jsonl")).unwrap();
        let ids = lines.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
        let ids = ids.filter(|row| ["picture", "stage"].contains(&row["kind"].as_str().unwrap()));
        ids.map(|row| desk.bytes(&format!("{out}/images/{}.exr", row["id"].as_str().unwrap()))).collect::<Vec<_>>()
    };
    for order in [["1", "2", "3"], ["1", "3", "2"], ["2", "1", "3"], ["2", "3", "1"], ["3", "1", "2"], ["3", "2", "1"]]
    {
        let out = format!("merged-{}", order.concat());
        desk.lab(&[&["merge"], &order[..], &["--out", &out, "--quiet"]].concat()).with(0, &[]);
        desk.assert_same(&out, &expected);
        assert!(shown(&out) == shown("whole"), "pictures differ");
    }
    // Bit by bit, into a folder that is one of them: the second shard's.
    desk.lab(&["merge", "1", "2", "--out", "2"]).with(4, &["missing shards: --shard 3/3"]);
    assert!(String::from_utf8(desk.bytes("2/report.md")).unwrap().contains("**Incomplete.**"));
    let status = desk.lab(&["status", "2", "--json"]).json();
    let next = format!("sampler-lab run small.json --data {} --out 2 --shard 3/3", repository("data").display());
    assert_eq!(status["missing_shards"], serde_json::json!(["3/3"]));
    assert_eq!(status["next"], serde_json::json!([next]));
    desk.lab(&["merge", "3", "--out", "2"]).with(0, &[]);
    desk.assert_same("2", &expected);
    // More shards than there are groups, one after the other in one folder: the last one completes it.
    for index in 1..=24 {
        desk.run("one-by-one", &["--shard", &format!("{index}/24")]).with(0, &[]);
    }
    desk.assert_same("one-by-one", &expected);
}

/// The path of the experiment file is no part of the results, however and wherever it is typed.
#[test]
fn shards_of_one_experiment_under_several_spellings_merge_to_the_same_bytes_in_any_order() {
    let desk = Desk::new();
    desk.run("whole", &[]).with(0, &[]);
    let elsewhere = desk.path("else where");
    std::fs::create_dir(&elsewhere).unwrap();
    for file in ["small.json", "cornell.json"] {
        std::fs::copy(desk.path(file), elsewhere.join(file)).unwrap();
    }
    desk.lab(&["run", "./small.json", "--shard", "1/2", "--out", "1", "--quiet"]).with(0, &[]);
    desk.lab(&["run", "else where/../else where/small.json", "--shard", "2/2", "--out", "2", "--quiet"]).with(0, &[]);
    for order in [["1", "2"], ["2", "1"]] {
        let out = order.concat();
        desk.lab(&[&["merge"], &order[..], &["--out", &out, "--quiet"]].concat()).with(0, &[]);
        desk.assert_same(&out, &desk.results("whole"));
    }
    // What `status` says to do next is what a shell does.
    let next = desk.lab(&["status", "2", "--json"]).json()["next"][0].as_str().unwrap().to_owned();
    assert!(next.contains("run 'else where/small.json' --data ") && next.ends_with(" --shard 1/2"), "{next}");
    let mut command = Command::new("sh");
    let script = next.replacen("sampler-lab", env!("CARGO_BIN_EXE_sampler-lab"), 1);
    command.current_dir(desk.0.path()).args(["-c", &script]).stdin(Stdio::null());
    ended(command).with(0, &[]);
    desk.assert_same("2", &desk.results("whole"));
}

#[test]
fn status_sees_that_the_experiment_file_was_edited() {
    let desk = Desk::new();
    desk.run("a", &[]).with(0, &[]);
    std::fs::write(desk.path("small.json"), SMALL.replace("[1, 16]", "[1, 4, 16]")).unwrap();
    let status = desk.lab(&["status", "a"]);
    status.with(4, &[]);
    assert!(status.stdout.contains("small.json changed since it was run: spp, [1,16] → [1,4,16]"), "{}", status.stdout);
    std::fs::write(desk.path("small.json"), "{").unwrap();
    let status = desk.lab(&["status", "a"]);
    status.with(0, &[]);
    assert!(status.stdout.contains("note: small.json is not followed, what was run counts"), "{}", status.stdout);
}

#[test]
fn folders_that_do_not_belong_together_are_not_merged() {
    let desk = Desk::new();
    desk.run("a", &["--shard", "1/2"]).with(0, &[]);
    let edited = |name: &str, file: &str, from: &str, to: &str| {
        std::fs::create_dir_all(desk.path(name)).unwrap();
        for entry in ["experiment.json", "results.jsonl", "timings.jsonl"] {
            let text = String::from_utf8(desk.bytes(&format!("a/{entry}"))).unwrap();
            let new = if entry == file { text.replacen(from, to, 1) } else { text.clone() };
            assert!(entry != file || new != text, "{from}");
            std::fs::write(desk.path(name).join(entry), new).unwrap();
        }
    };
    for (file, from, to, parts) in [
        ("results.jsonl", "\"star\":0.", "\"star\":0.1", &["a/results.jsonl", "b/results.jsonl", "metrics = "][..]),
        ("experiment.json", "\"seed\": 5", "\"seed\": 6", &["another seed: 5 there, 6 here"]),
        ("experiment.json", "\"content_hash\": \"", "\"content_hash\": \"0", &["another scene: cornell with content"]),
        (
            "experiment.json",
            "\"metrics\": 3",
            "\"metrics\": 4",
            &["another algorithm number of the metrics: 3 there, 4 here"],
        ),
    ] {
        edited("b", file, from, to);
        desk.lab(&["merge", "a", "b", "--out", "m"]).with(2, parts);
        desk.lab(&["merge", "b", "a", "--out", "m"]).with(2, &[]);
        assert!(!desk.path("m").exists(), "a folder for nothing is left");
    }
    edited("b", "experiment.json", "\"metrics\": 3", "\"metrics\": 9");
    desk.lab(&["merge", "b", "--out", "m"]).with(2, &["found 9 for the metrics, which is 3 here"]);
    desk.lab(&["merge", "nowhere", "--out", "m"]).with(2, &["nowhere"]);
    for (shard, parts) in [("0/2", "expected I/N with 1 ≤ I ≤ N"), ("3/2", "found \"3/2\""), ("2", "such as 2/3")] {
        desk.run("c", &["--shard", shard]).with(2, &["--shard", parts]);
    }
    assert!(!desk.path("c").exists());
}

// --- edits ---

#[test]
fn an_edited_scene_is_said_and_done_again_and_the_edit_undone_brings_the_rows_back() {
    let desk = Desk::new();
    desk.run("a", &[]).with(0, &[]);
    let (expected, rows) = (desk.results("a"), files(&desk.path("a/images")));
    desk.edit_scene();
    assert_eq!(desk.status("a"), (4, vec!["scene changed".to_owned()]));
    let why = desk.lab(&["status", "a"]).stdout;
    assert!(why.contains("the scene cornell changed, ") && why.contains(" → "), "{why}");
    desk.run("a", &[]).with(0, &["27 rows put aside in superseded.jsonl: the scene cornell changed"]);
    desk.run("edited", &[]).with(0, &[]);
    desk.assert_same("a", &desk.results("edited"));
    desk.restore_scene();
    assert_eq!(desk.status("a"), (4, vec!["put aside".to_owned()]));
    let again = desk.run("a", &["--json"]);
    again.with(0, &["27 rows taken back"]);
    assert_eq!(again.json()["done"], 0, "nothing is rendered again");
    desk.assert_same("a", &expected);
    // The file is gone: what was recorded stands in for it.
    std::fs::remove_file(desk.path("cornell.json")).unwrap();
    let gone = desk.lab(&["status", "a"]);
    gone.with(0, &[]);
    assert!(gone.stdout.contains("note: cornell cannot be read, so it counts as unchanged"), "{}", gone.stdout);
    assert!(rows.len() < files(&desk.path("a/images")).len(), "the edited scene's images are kept");
}

/// The scene is read once, at the start: what is written to its file afterwards is the next run's business.
#[test]
fn a_scene_edited_while_a_run_is_going_is_not_mixed_in() {
    let desk = Desk::new();
    desk.run("whole", &[]).with(0, &[]);
    let mut child = desk.command(&["run", "small.json", "--out", "a", "--quiet"]).spawn().unwrap();
    wait(&mut child, || desk.path("a/results.jsonl").exists());
    desk.edit_scene();
    assert!(child.wait().unwrap().success());
    assert!(desk.results("a") == desk.results("whole"));
    assert_eq!(desk.status("a"), (4, vec!["scene changed".to_owned()]));
}

/// Rows as the code of before would have left them: other ids, another number.
#[test]
fn a_raised_algorithm_number_is_said_with_its_numbers_and_rows_of_before_are_kept() {
    let desk = Desk::new();
    desk.run("a", &[]).with(0, &[]);
    let expected = desk.results("a");
    let rows = String::from_utf8(expected[0].clone()).unwrap();
    let old: Vec<String> = rows
        .lines()
        .map(|line| match line.contains("\"renderer\":1,") {
            true => line.replace("\"id\":\"", "\"id\":\"0").replace("\"renderer\":1,", "\"renderer\":0,") + "\n",
            false => line.to_owned() + "\n",
        })
        .collect();
    std::fs::write(desk.path("a/results.jsonl"), old.concat()).unwrap();
    let status = desk.lab(&["status", "a", "--json"]).json();
    let entry = &status["missing"][0];
    assert_eq!(entry["reason"], "algorithm changed", "{status}");
    assert_eq!(entry["changes"][0], serde_json::json!({"what": "renderer", "scene": null, "from": "0", "to": "1"}));
    desk.run("a", &[]).with(0, &["the algorithm number of the renderer changed, 0 → 1"]);
    desk.assert_same("a", &expected);
    // A sampler goes and comes back: its rows do, too.
    std::fs::write(desk.path("small.json"), SMALL.replace("\"uniform\", \"ld\"", "\"uniform\"")).unwrap();
    desk.run("a", &[]).with(0, &["not in the experiment any more"]);
    std::fs::write(desk.path("small.json"), SMALL).unwrap();
    let back = desk.run("a", &["--json"]);
    assert_eq!(back.with(0, &["taken back"]).json()["done"], 0);
    desk.assert_same("a", &expected);
}

// --- faults ---

#[test]
fn a_limit_on_the_size_of_files_is_exit_code_3_and_a_later_run_completes_to_the_same_bytes() {
    let desk = Desk::new();
    desk.run("whole", &[]).with(0, &[]);
    let expected = desk.results("whole");
    let lab = env!("CARGO_BIN_EXE_sampler-lab");
    // 512 bytes each: in the first rows, in the first images, and, after all rows, in the figures.
    for blocks in [2, 8, 64] {
        let data = repository("data");
        let script = format!("ulimit -f {blocks}; exec {lab} run small.json --out a --quiet --data {}", data.display());
        let mut command = Command::new("sh");
        command.current_dir(desk.0.path()).args(["-c", &script]).stdin(Stdio::null());
        ended(command).with(3, &["error: a/", ": cannot "]);
        assert_eq!(desk.lab(&["status", "a"]).code.map(|code| code == 0), Some(blocks == 64), "{blocks}");
    }
    desk.run("a", &[]).with(0, &[]);
    desk.assert_same("a", &expected);
}

#[test]
fn torn_and_damaged_files_are_noticed_and_made_good() {
    let desk = Desk::new();
    desk.run("a", &[]).with(0, &[]);
    let expected = desk.results("a");
    let rows = desk.path("a/results.jsonl");
    // A torn last line, and a temporary file of a process that is no more.
    std::fs::write(&rows, &expected[0][..expected[0].len() - 40]).unwrap();
    std::fs::write(desk.path("a/images/x.exr.999999999.partial"), "half").unwrap();
    assert_eq!(desk.status("a"), (4, vec!["missing".to_owned()]));
    desk.lab(&["report", "a"]).with(4, &["missing: "]);
    assert!(String::from_utf8(desk.bytes("a/report.md")).unwrap().contains("**Incomplete.**"));
    desk.run("a", &[]).with(0, &[]);
    desk.assert_same("a", &expected);
    // A picture cut short, and one with a flipped bit.
    let text = String::from_utf8(expected[0].clone()).unwrap();
    let pictures = text.lines().filter(|line| line.contains("\"kind\":\"picture\""));
    for (i, line) in pictures.enumerate() {
        let row: Value = serde_json::from_str(line).unwrap();
        let path = desk.path(&format!("a/images/{}.exr", row["id"].as_str().unwrap()));
        let mut bytes = std::fs::read(&path).unwrap();
        match i {
            0 => bytes.truncate(bytes.len() / 2),
            _ => *bytes.last_mut().unwrap() ^= 1,
        }
        std::fs::write(path, bytes).unwrap();
    }
    assert_eq!(desk.status("a"), (4, vec!["image lost".to_owned()]));
    desk.run("a", &[]).with(0, &["not the image that was written, so it is made again"]);
    desk.assert_same("a", &expected);
    // A row taken out from the middle.
    let without: String = text.split_inclusive('\n').filter(|line| !line.contains("\"replicate\":2,\"seed")).collect();
    std::fs::write(&rows, without).unwrap();
    desk.lab(&["report", "a"]).with(4, &["rows of single replicates"]);
    desk.run("a", &[]).with(0, &[]);
    desk.assert_same("a", &expected);
    // A broken line elsewhere is no accident of ours: it is named, and nothing is touched.
    std::fs::write(&rows, text.replacen("\"schema\":1", "\"schema\":", 2)).unwrap();
    let before = files(&desk.path("a"));
    for args in
        [&["run", "small.json", "--out", "a"][..], &["status", "a"], &["report", "a"], &["merge", "a", "--out", "a"]]
    {
        desk.lab(args).with(2, &["a/results.jsonl:1: expected a row", "take this line out"]);
    }
    assert_eq!(files(&desk.path("a")), before);
}

/// Edits that leave a row readable: of what the plan knows, of the digest of the pixels, and of a timing.
#[test]
fn altered_rows_and_unreadable_timings_are_named_and_done_again() {
    let desk = Desk::new();
    desk.run("a", &[]).with(0, &[]);
    let expected = desk.results("a");
    let text = String::from_utf8(expected[0].clone()).unwrap();
    let altered = |kind: &str, from: &str, to: &str| {
        let is_it = |line: &str| line.contains(&format!("\"kind\":\"{kind}\"")) && line.contains(from);
        let at = text.lines().position(is_it).unwrap_or_else(|| panic!("{kind} {from}"));
        let line = text.lines().nth(at).unwrap();
        std::fs::write(desk.path("a/results.jsonl"), text.replacen(line, &line.replacen(from, to, 1), 1)).unwrap();
        at + 1
    };
    for (kind, from, to) in [
        ("render", "\"size\":\"16x16\"", "\"size\":\"16x17\""),
        ("ensemble", "\"replicates\":3", "\"replicates\":4"),
        ("points", "\"taken\":16", "\"taken\":17"),
        ("reference", "\"scene\":\"cornell\"", "\"scene\":\"horizon\""),
    ] {
        altered(kind, from, to);
        assert_eq!(desk.status("a"), (4, vec!["row altered".to_owned()]), "{kind}");
        desk.run("a", &[]).with(0, &["1 rows put aside in superseded.jsonl: the row says another "]);
        desk.assert_same("a", &expected);
    }
    // A digest says nothing that the plan knows. It comes to light where the image is needed: here for an ensemble.
    let digest = |line: &str| line.split("\"pixels\":\"").nth(1).unwrap()[..4].to_owned();
    let render = text.lines().find(|line| line.contains("\"kind\":\"render\"")).unwrap();
    let at = altered("render", &format!("\"pixels\":\"{}", digest(render)), "\"pixels\":\"zzzz");
    let rows = String::from_utf8(desk.bytes("a/results.jsonl")).unwrap();
    let without: String = rows.split_inclusive('\n').filter(|line| !line.contains("\"kind\":\"ensemble\"")).collect();
    std::fs::write(desk.path("a/results.jsonl"), without).unwrap();
    desk.run("a", &[]).with(0, &[&format!("a/results.jsonl:{at}: expected the pixels of the image on disk")]);
    desk.assert_same("a", &expected);
    // Seconds are no result: nothing is held up for them. Nor for a byte that is no text among what was put aside.
    let timings = String::from_utf8(desk.bytes("a/timings.jsonl")).unwrap();
    std::fs::write(desk.path("a/timings.jsonl"), timings.replacen("\"seconds\":", "\"seconds\"", 2)).unwrap();
    let mut aside = desk.bytes("a/superseded.jsonl");
    aside.extend(b"\xff\n");
    std::fs::write(desk.path("a/superseded.jsonl"), aside).unwrap();
    assert_eq!(desk.status("a"), (0, vec![]));
    desk.run("a", &[]).with(0, &["a/timings.jsonl:1: ", "the line is left out"]);
    desk.assert_same("a", &expected);
    // Without the file that says what was run, the rows are still there.
    std::fs::write(desk.path("a/experiment.json"), "").unwrap();
    desk.run("a", &[]).with(2, &["a/experiment.json: ", "take the file out"]);
    std::fs::remove_file(desk.path("a/experiment.json")).unwrap();
    desk.run("a", &["--fresh"]).with(2, &["a: expected results to forget"]);
    assert_eq!(desk.run("a", &["--json"]).json()["done"], 0);
    desk.assert_same("a", &expected);
}

#[test]
fn fresh_forgets_what_it_is_to_do_again_and_nothing_else() {
    let desk = Desk::new();
    desk.run("a", &[]).with(0, &[]);
    let expected = desk.results("a");
    let document = desk.run("a", &["--fresh", "--shard", "3/3", "--json"]).with(0, &[]).json();
    assert!(document["done"].as_u64() > Some(0) && document["done"] == document["items"], "{document}");
    desk.assert_same("a", &expected);
    std::fs::write(desk.path("a/images/mine.exr"), "mine").unwrap();
    desk.run("a", &["--fresh"]).with(0, &[]);
    desk.assert_same("a", &expected);
    assert_eq!(desk.bytes("a/images/mine.exr"), b"mine");
    std::fs::create_dir(desk.path("b")).unwrap();
    std::fs::write(desk.path("b/results.jsonl"), "mine").unwrap();
    desk.run("b", &["--fresh"]).with(2, &["b: expected results to forget", "found results.jsonl"]);
    assert_eq!(files(&desk.path("b")).len(), 1);
}

/// A report says what the rows beside it say, or is not there.
#[test]
fn no_old_report_stands_beside_new_rows() {
    let desk = Desk::new();
    desk.run("a", &[]).with(0, &[]);
    std::fs::write(desk.path("small.json"), SMALL.replace("[1, 16]", "[1, 4, 16]")).unwrap();
    desk.run("a", &["--shard", "3/3"]).with(0, &[]);
    for name in ["report.md", "report.html", "summary.csv", "slopes.csv"] {
        assert!(!desk.path("a").join(name).exists(), "{name}");
    }
    desk.lab(&["report", "a"]).with(4, &["missing"]);
    desk.run("a", &[]).with(0, &[]);
    desk.run("whole", &[]).with(0, &[]);
    desk.assert_same("a", &desk.results("whole"));
}

/// `/dev/full` refuses every byte.
#[cfg(target_os = "linux")]
#[test]
fn a_stderr_that_cannot_be_written_to_is_no_failure() {
    let desk = Desk::new();
    let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let status = desk.command(&["run", "small.json", "--out", "a"]).stderr(full()).status().unwrap();
    assert_eq!(status.code(), Some(0));
    let status = desk.command(&["run", "nowhere.json", "--out", "b"]).stderr(full()).status().unwrap();
    assert_eq!(status.code(), Some(2));
}

#[test]
fn where_nothing_can_be_written_nothing_is_done() {
    let desk = Desk::new();
    std::fs::write(desk.path("file"), "mine").unwrap();
    desk.run("whole", &[]).with(0, &[]);
    for out in ["file", "file/below", "/proc/sampler-lab"] {
        desk.run(out, &[]).with(3, &["cannot write"]);
        desk.lab(&["merge", "whole", "--out", out]).with(3, &["cannot write"]);
    }
    assert_eq!(desk.bytes("file"), b"mine");
}

/// A disk of its own, 64 kB, then full, then mounted read-only. Needs the right to mount, which not every machine gives: the
/// test above and the limit on files hold the same promises everywhere.
#[test]
fn a_full_and_a_read_only_disk_are_exit_code_3_and_a_later_run_completes() {
    let desk = Desk::new();
    let disk = desk.path("disk");
    std::fs::create_dir(&disk).unwrap();
    let mount = |options: &str| {
        let mut command = Command::new("mount");
        command.args(["-t", "tmpfs", "-o", options, "tmpfs"]).arg(&disk);
        command.output().map_err(|e| e.to_string()).and_then(|output| match output.status.success() {
            true => Ok(()),
            false => Err(String::from_utf8_lossy(&output.stderr).trim().to_owned()),
        })
    };
    if let Err(why) = mount("size=64k") {
        eprintln!("skipped, as no disk can be mounted here: {why}");
        return;
    }
    // Taken off even where the test fails; the folder could not be removed otherwise.
    struct Mounted<'a>(&'a Path);
    impl Drop for Mounted<'_> {
        fn drop(&mut self) {
            let _ = Command::new("umount").arg(self.0).status();
        }
    }
    let _mounted = Mounted(&disk);
    desk.run("whole", &[]).with(0, &[]);
    desk.run("disk/a", &[]).with(3, &["No space left on device"]);
    desk.run("disk/a", &[]).with(3, &["No space left on device"]);
    mount("remount,size=16m,ro").unwrap();
    desk.run("disk/a", &[]).with(3, &["Read-only file system"]);
    assert_eq!(desk.lab(&["status", "disk/a"]).code, Some(4), "looking needs no right to write");
    mount("remount,size=16m,rw").unwrap();
    desk.run("disk/a", &[]).with(0, &[]);
    // The command in experiment.json is the same: --out is no part of it.
    desk.assert_same("disk/a", &desk.results("whole"));
}

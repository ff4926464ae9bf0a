//! `run`, twice and killed.

use super::*;

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

//! `check` from outside: lists, verdicts, JSON, exit codes, a user's scene; and that the documents about checks say what is so.
//!
//! Fixed seeds. Statistical checks run here at their own rates: of 1e-6 for a run of all 82 it is 11 parts for `quick` and
//! 6 for `harness`; the other runs that have to pass have 1e-8 each. False alarms: 2.6e-7.

#[cfg(unix)]
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

use sampler_lab::check;
use sampler_lab::mutants::Mutant;
use serde_json::Value;

/// Exit code, stdout, stderr.
fn lab(args: &[&str]) -> (Option<i32>, String, String) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut command = Command::new(env!("CARGO_BIN_EXE_sampler-lab"));
    let output = command.current_dir(root).arg("check").args(args).stdin(Stdio::null()).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn document(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

#[track_caller]
fn refused(args: &[&str], parts: &[&str]) {
    let (code, stdout, stderr) = lab(args);
    assert_eq!((code, stdout.as_str()), (Some(2), ""), "{args:?}: {stderr}");
    assert!(parts.iter().all(|part| stderr.contains(part)) && !stderr.contains("panicked"), "{args:?}: {stderr}");
}

#[test]
fn the_list_names_every_check_with_its_claim() {
    let (code, text, _) = lab(&["--list"]);
    let (json_code, json, _) = lab(&["--list", "--json", "quick", "54"]);
    assert_eq!((code, json_code), (Some(0), Some(0)));
    for check in check::all() {
        assert!(
            text.contains(check.name) && text.contains(check.claim) && text.contains(check.group),
            "{}",
            check.name
        );
    }
    let json: Value = serde_json::from_str(&json).unwrap();
    let listed = json["checks"].as_array().unwrap();
    assert!(listed.iter().any(|c| c["name"] == "disk-moments" && c["failures"][0] == 54 && c["kind"] == "statistical"));
    assert!(listed.len() < check::all().len());
}

#[test]
fn one_group_gives_the_same_verdicts_on_any_number_of_threads() {
    let [one, two] = ["1", "2"].map(|threads| lab(&["quick", "--json", "--threads", threads, "--quiet"]));
    assert_eq!((one.0, one.2.as_str()), (Some(0), ""), "{}", one.1);
    assert_eq!(one.1, two.1);
    let json: Value = serde_json::from_str(&one.1).unwrap();
    assert_eq!(
        (json["alpha"].as_f64(), json["seed"].as_u64(), json["passed"].as_bool()),
        (Some(1e-6), Some(1), Some(true))
    );
    let checks = json["checks"].as_array().unwrap();
    assert!(checks.len() > 5);
    for check in checks {
        for field in
            ["name", "group", "passed", "statistic", "p_value", "threshold", "false_alarm", "detects", "claim", "says"]
        {
            assert!(check.get(field).is_some(), "{field}: {check}");
        }
        assert!(check["group"] == "quick" && check["passed"] == true && check["tests"].as_u64() > Some(0));
    }
    let rates: f64 = checks.iter().map(|c| c["false_alarm"].as_f64().unwrap()).sum();
    assert!((json["false_alarm"].as_f64().unwrap() / rates - 1.0).abs() < 1e-4 && rates < 1e-6);
    // Another seed, other numbers; the exact checks stay as they are.
    let (code, other, _) = lab(&["quick", "--json", "--quiet", "--seed", "2", "--alpha", "1e-8"]);
    assert!(code == Some(0) && other != one.1);
}

#[test]
fn a_run_says_one_line_a_check_and_sums_up() {
    let (code, stdout, stderr) = lab(&["quick-nets", "quick-lights", "--budget", "20"]);
    assert_eq!(code, Some(0), "{stderr}");
    let lines: Vec<&str> = stdout.lines().filter(|line| !line.starts_with(' ')).collect();
    assert!(
        lines[0].starts_with("pass  quick") && lines[0].contains("quick-nets") && lines[0].contains("exact, 30 tests")
    );
    for part in ["quick-lights", "p = ", " of ", "false alarms ", "catches ", "8 tests"] {
        assert!(lines[1].contains(part), "{part}: {stdout}");
    }
    assert!(lines[2].starts_with("2 checks of 38 tests: 2 passed, 0 failed; false alarms "), "{stdout}");
    assert!(stdout.contains("\n      claim: ") && stdout.contains("\n      found: "));
}

#[test]
fn nonsense_is_refused() {
    refused(&["quick-net"], &["did you mean \"quick-nets\"?"]);
    refused(&["#66"], &["1 to 65"]);
    refused(&["no-scene.json"], &["no-scene.json", "expected a readable scene file"]);
    refused(&["configs/a01.json", "quick"], &["a scene file alone"]);
    refused(&["configs/a01.json", "--sampler", "haltn"], &["did you mean \"halton\"?"]);
    refused(&["configs/a01.json", "--size", "0x3"], &["--size"]);
    refused(&["configs/a01.json", "--estimator", "sheets"], &["unbiased or sheet"]);
    refused(&["--sampler", "ld"], &["--sampler", "expected a scene file"]);
    refused(&["quick", "--set", "camera.fov=3"], &["--set", "expected a scene file"]);
    for alpha in ["0", "1", "-1", "NaN", "inf"] {
        refused(&["quick", &format!("--alpha={alpha}")], &["--alpha", "above 0 and below 1"]);
    }
    for budget in ["0", "-1", "NaN", "inf", "1e9"] {
        refused(&["quick", &format!("--budget={budget}")], &["--budget", "expected seconds"]);
    }
}

/// A finely checkered wall, a lens that blurs it by about a pixel: pixel and lens in step look along one line of the blur.
fn scene(folder: &Path) -> String {
    let mut obj = "mtllib scene.mtl\n".to_owned();
    for (i, j) in (-8..8).flat_map(|i| (-8..8).map(move |j| (i, j))) {
        for (x, y) in [(i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)] {
            obj += &format!("v {} {} 0\n", f64::from(x) * 0.07, f64::from(y) * 0.07);
        }
        obj += &format!("usemtl {}\nf -4 -3 -2 -1\n", if (i + j) % 2 == 0 { "white" } else { "dark" });
    }
    std::fs::write(folder.join("scene.obj"), obj).unwrap();
    std::fs::write(folder.join("scene.mtl"), "newmtl white\nKd 0.9 0.9 0.9\nnewmtl dark\nKd 0.1 0.1 0.1\n").unwrap();
    let json = r#"{"camera": {"pos": [0, 0, -3], "dir": [0, 0, 1], "fov": 16, "lens_radius": 0.5, "focal_depth": 2.6},
        "auto_focus": false, "shading": "albedo", "framebuffer": {"res_w": 8, "res_h": 6, "sppx": 16},
        "scene": {"mesh_files": ["scene.obj"]}}"#;
    let path = folder.join("scene.json");
    std::fs::write(&path, json).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn on_a_scene_strata_in_step_are_biased_and_decoupled_ones_are_not() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(folder.path());
    let ask = |sampler: &str, more: &[&str]| {
        let args =
            [&[scene.as_str(), "--sampler", sampler, "--size", "8x6", "--budget", "6", "--json", "--quiet"], more]
                .concat();
        let (code, stdout, stderr) = lab(&args);
        let json: Value = serde_json::from_str(&stdout).unwrap_or_else(|e| panic!("{e}: {stderr}"));
        (code, json)
    };
    let (code, sheet) = ask("stratified:sheet", &[]);
    assert_eq!((code, &sheet["passed"]), (Some(1), &Value::Bool(false)), "{sheet:#}");
    let names: Vec<&str> = sheet["checks"].as_array().unwrap().iter().map(|c| c["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["scene-bias", "scene-coupling", "scene-reference"]);
    assert!(sheet["checks"][0]["passed"] == false && sheet["checks"][1]["passed"] == false, "{sheet:#}");
    let coupling = sheet["checks"][1]["says"].as_str().unwrap();
    assert!(coupling.contains("coupled numbers: pixel and lens") && coupling.contains("the lens by"), "{coupling}");
    assert_eq!((sheet["spp"]["taken"].as_u64(), sheet["size"].as_str()), (Some(16), Some("8x6")));
    for sampler in ["stratified", "uniform"] {
        let (code, best) = ask(sampler, &["--threads", "1", "--alpha", "1e-8"]);
        assert_eq!((code, &best["passed"]), (Some(0), &Value::Bool(true)), "{best:#}");
        assert!(best["checks"].as_array().unwrap().iter().all(|c| c["group"] == "scene"));
        assert_eq!(ask(sampler, &["--threads", "2", "--alpha", "1e-8"]).1, best);
    }
    // One decision apart takes the coupling away; a set without randomness has nothing but bias.
    let (_, apart) = ask("stratified:sheet", &["--lens", "stratified", "--alpha", "1e-8"]);
    assert_eq!(apart["checks"][1]["passed"], true, "{apart:#}");
    let (code, plain) = ask("halton:plain", &[]);
    assert_eq!(code, Some(1), "{plain:#}");
    assert!(plain["checks"][0]["says"].as_str().unwrap().starts_with("nothing is random"), "{plain:#}");
}

#[test]
fn a_scene_of_the_lab_is_judged_by_its_closed_form() {
    let args = ["configs/penumbra.json", "--size", "16x12", "--spp", "16", "--budget", "6", "--sampler", "ld"];
    let (code, stdout, stderr) = lab(&[&args[..], &["--alpha", "1e-8"]].concat());
    assert_eq!(code, Some(0), "{stdout}{stderr}");
    assert!(stderr.contains("against the closed form") && stdout.contains("it has no noise"), "{stdout}{stderr}");
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_a_long_run_with_130() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_sampler-lab"))
        .args(["check", "quick-nets", "quick-lights", "--budget", "80000", "--quiet"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    // The first check takes no time, the second hours: once the first has its line, the work is under way.
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    assert!(line.contains("quick-nets"), "{line}");
    let status = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(status.success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
}

#[test]
fn planted_bugs_need_their_feature() {
    if cfg!(not(feature = "mutants")) {
        for option in ["--mutants", "--mutant-table", "--mutant=disk-without-root"] {
            refused(&[option], &["--features mutants"]);
        }
    }
}

/// Every mistake stands at one place of the product, and names a check that there is.
#[test]
fn every_planted_bug_is_planted_once_and_has_its_check() {
    assert!(Mutant::ALL.len() >= 20);
    let mut code = String::new();
    let mut folders = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("src")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if !path.ends_with("mutants.rs") {
                code += &std::fs::read_to_string(path).unwrap();
            }
        }
    }
    let checks = check::all();
    let table = document("mutants.md");
    for mutant in Mutant::ALL {
        assert_eq!(code.matches(&format!("planted(Mutant::{mutant:?})")).count(), 1, "{mutant:?}");
        assert_eq!(Mutant::named(mutant.name()), Some(*mutant));
        assert!(checks.iter().any(|c| c.name == mutant.caught_by()), "{mutant:?}: {}", mutant.caught_by());
        assert!(table.contains(&format!("\n| `{}` | ", mutant.name())), "docs/mutants.md lacks {}", mutant.name());
    }
}

/// Every check runs at a sixtieth of its effort, fails under its own mistake and passes without.
#[cfg(feature = "mutants")]
#[test]
fn every_planted_bug_is_caught() {
    use sampler_lab::check::planted::{cheapest, run_with};
    let settings = check::Settings::default();
    for &mutant in Mutant::ALL {
        let check = cheapest(mutant);
        assert!(check::run(&check, &settings).finding.passed, "{}", check.name);
        assert!(!run_with(mutant, &check, &settings).finding.passed, "{} survives", mutant.name());
    }
}

#[test]
fn the_catalogue_of_failures_is_what_the_command_writes() {
    let (code, text, _) = lab(&["--list", "--markdown"]);
    assert_eq!(code, Some(0));
    assert!(text == document("failures.md"), "write it again: cargo run -- check --list --markdown > docs/failures.md");
}

/// Calibration and power as they stand in docs/harness.md are what the checks found.
#[test]
fn the_table_of_calibration_and_power_is_what_the_checks_say() {
    let table = document("harness.md");
    for check in check::all().iter().filter(|c| c.group == "harness") {
        let found = check::run(check, &check::Settings::default()).finding;
        assert!(found.passed, "{}: {}", check.name, found.says);
        assert!(table.contains(&found.says), "docs/harness.md, {}: expected to find: {}", check.name, found.says);
    }
}

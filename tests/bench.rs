//! `bench` from outside: what it lists, the shape of its JSON, the scenes that it writes, what it refuses.

use std::process::{Command, Output};

use serde_json::Value;

fn bench(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sampler-lab")).arg("bench").args(args).output().unwrap()
}

fn text(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes).unwrap()
}

#[test]
fn the_list_names_every_group_and_parts_of_names_narrow_it() {
    let all = text(bench(&["--list"]).stdout);
    for group in ["memory", "sampler", "rays", "render", "build", "load", "metric", "growth"] {
        assert!(all.contains(&format!("\n  {group}/")), "{group}");
    }
    let some = text(bench(&["--list", "load", "metric/l2"]).stdout);
    let names: Vec<&str> = some.lines().filter(|line| line.starts_with("  ")).map(str::trim).collect();
    assert!(names.len() > 2 && names.iter().all(|n| n.starts_with("load/") || n.starts_with("metric/l2")), "{some}");
}

#[test]
fn the_document_has_host_threads_and_ordered_numbers() {
    let ran =
        bench(&["load", "metric/t-value", "sampler/2d/ld:best", "--budget", "0.5", "--json", "--threads", "1", "-q"]);
    assert!(ran.status.success() && ran.stderr.is_empty(), "{}", text(ran.stderr));
    let document: Value = serde_json::from_slice(&ran.stdout).unwrap();
    assert_eq!(document["threads"], 1);
    assert!(document["host"].as_str().unwrap().contains("threads"));
    let results = document["results"].as_array().unwrap();
    assert!(results.len() >= 6);
    for result in results {
        let number = |key: &str| result[key].as_f64().unwrap_or_else(|| panic!("{key} of {result}"));
        assert!(
            0.0 < number("min") && number("min") <= number("median") && number("median") <= number("max"),
            "{result}"
        );
        assert!(number("mad") >= 0.0 && number("runs") >= 3.0 && result["unit"].is_string(), "{result}");
        if let Some(interval) = result["interval"].as_array() {
            assert!(interval[0].as_f64() <= Some(number("median")) && Some(number("median")) <= interval[1].as_f64());
        }
    }
}

#[test]
fn the_table_goes_to_stdout() {
    let ran = bench(&["metric/t-value", "--budget", "0.1"]);
    let table = text(ran.stdout);
    assert!(table.contains("MAD") && table.contains("metric/t-value/16384"), "{table}");
}

#[test]
fn what_it_cannot_do_is_refused() {
    for (args, part) in [
        (vec!["rayz"], "did you mean \"rays\"?"),
        (vec!["--budget", "0"], "--budget: expected seconds"),
        (vec!["--budget", "NaN"], "--budget: expected seconds"),
        (vec!["load", "--write-scenes", "x"], "cannot be used with"),
    ] {
        let ran = bench(&args);
        assert_eq!(ran.status.code(), Some(2), "{args:?}");
        let said = text(ran.stderr);
        assert!(said.contains(part) && ran.stdout.is_empty(), "{said}");
    }
    let ran = bench(&["--write-scenes", "/dev/null/scenes"]);
    assert_eq!(ran.status.code(), Some(3));
}

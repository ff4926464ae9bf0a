//! A small stored result set → the exact report, and sentences that flip when numbers flip.
//!
//! `tests/data/report/` was made by the tool from `small.json` beside it. Where the report's words change on purpose,
//! `REGENERATE=1 cargo test --test report` writes the expected file anew: read its difference before committing it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use sampler_lab::experiment::execute::{Options, execute};
use sampler_lab::experiment::lab::Lab;
use sampler_lab::experiment::plan::plan;
use sampler_lab::experiment::progress::Silent;
use sampler_lab::experiment::results::{
    EnsembleRow, ErrorSpectrum, Growth, Kind, PeerPoint, Peers, ReferenceRow, Rounds, Row, Size, Timing, read,
    read_about, read_timings, timings_path,
};
use sampler_lab::experiment::spec::{Experiment, TimedRounds};
use sampler_lab::report::page::viewer;
use sampler_lab::report::{Figures, Measurements, Summary, summarise, text, text_with, write};
use sampler_lab::stats::Estimate;

mod links;
mod pictures;
mod references;
mod timings;
mod words;

fn stored() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/report")
}

/// A folder with the stored results in it.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in ["results.jsonl", "timings.jsonl", "experiment.json"] {
        std::fs::copy(stored().join(name), folder.path().join(name)).unwrap();
    }
    folder
}

fn rows() -> Vec<Row> {
    read(&stored().join("results.jsonl")).unwrap()
}

fn timings() -> Vec<Timing> {
    read_timings(&stored().join("timings.jsonl")).unwrap()
}

fn summary(rows: &[Row]) -> Summary {
    summarise(rows, &timings(), &read_about(&stored().join("experiment.json")).unwrap())
}

/// The report of the stored rows after `edit` of those ensembles that `which` picks by sampler and count.
fn edited(which: impl Fn(&str, u32) -> bool, edit: impl Fn(&mut EnsembleRow)) -> String {
    let mut rows = rows();
    let mut count = 0;
    for row in &mut rows {
        if let Row::Ensemble(row) = row
            && which(&row.sampler, row.spp.asked)
        {
            edit(row);
            count += 1;
        }
    }
    assert!(count > 0, "nothing was edited");
    text(&summary(&rows), &Figures::default())
}

fn estimate(value: f64, half: f64) -> Estimate {
    Estimate { value, ci95: Some([value - half, value + half]) }
}

/// Sets MSE and bias², each within one percent.
fn set(row: &mut EnsembleRow, mse: f64, bias2: Estimate) {
    row.mse = estimate(mse, 0.01 * mse.abs());
    row.rmse = (mse > 0.0).then(|| estimate(mse.sqrt(), 0.005 * mse.sqrt()));
    row.bias2 = bias2;
}

#[test]
fn stored_rows_give_the_stored_report_byte_for_byte() {
    let folder = folder();
    let written = write(folder.path()).unwrap();
    let found = std::fs::read_to_string(&written.report).unwrap();
    let expected = stored().join("report.md");
    if std::env::var_os("REGENERATE").is_some() {
        std::fs::write(&expected, &found).unwrap();
    }
    assert!(written.check().is_ok());
    let expected = std::fs::read_to_string(&expected).unwrap();
    for (found, expected) in found.lines().zip(expected.lines()) {
        assert_eq!(found, expected);
    }
    assert_eq!(found.len(), expected.len());
}

#[test]
fn writing_twice_gives_the_same_bytes_of_every_file() {
    let (a, b) = (folder(), folder());
    write(a.path()).unwrap();
    write(b.path()).unwrap();
    write(b.path()).unwrap();
    let mut names: Vec<PathBuf> = Vec::new();
    for sub in ["", "figures"] {
        for entry in std::fs::read_dir(a.path().join(sub)).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                names.push(path.strip_prefix(a.path()).unwrap().to_owned());
            }
        }
    }
    assert!(names.len() >= 12, "{names:?}");
    for name in names {
        let read = |folder: &tempfile::TempDir| std::fs::read(folder.path().join(&name)).unwrap();
        assert!(read(&a) == read(&b), "{}", name.display());
    }
}

#[test]
fn tables_hold_nothing_from_a_clock_and_every_artefact_says_what_made_it() {
    let (a, b) = (folder(), folder());
    std::fs::remove_file(b.path().join("timings.jsonl")).unwrap();
    write(a.path()).unwrap();
    let report = std::fs::read_to_string(write(b.path()).unwrap().report).unwrap();
    assert!(report.contains("Nothing was timed, so nothing is said of speed."));
    for name in ["summary.csv", "slopes.csv", "figures/convergence.svg", "figures/convergence.png"] {
        let read = |folder: &tempfile::TempDir| std::fs::read(folder.path().join(name)).unwrap();
        assert!(read(&a) == read(&b), "{name}");
        let stamp = b"experiment small, seed 7, sampler-lab ";
        assert!(read(&a).windows(stamp.len()).any(|window| window == stamp), "{name}");
    }
    let csv = std::fs::read_to_string(a.path().join("summary.csv")).unwrap();
    let fields: Vec<usize> = csv.lines().skip(1).map(|line| line.split(',').count()).collect();
    assert!(fields.len() == 1 + 5 * 3 && fields.iter().all(|&n| n == fields[0]), "{fields:?}");
}

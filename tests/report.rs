//! A small stored result set → the exact report, and sentences that flip when numbers flip.
//!
//! `tests/data/report/` was made by the tool from `small.json` beside it. Where the report's words change on purpose,
//! `REGENERATE=1 cargo test --test report` writes the expected file anew: read its difference before committing it.

use std::path::{Path, PathBuf};

use sampler_lab::experiment::results::{EnsembleRow, Row, Timing, read, read_about, read_timings};
use sampler_lab::report::{Figures, Summary, summarise, text, write};
use sampler_lab::stats::Estimate;

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

#[test]
fn the_order_of_rows_does_not_matter() {
    let mut rows = rows();
    let forward = text(&summary(&rows), &Figures::default());
    rows.reverse();
    assert_eq!(text(&summary(&rows), &Figures::default()), forward);
}

#[test]
fn a_wrong_limit_a_stall_and_a_falling_error_have_words_of_their_own() {
    let ld = |sampler: &str, spp: u32| sampler == "ld:sheet" && spp != 16;
    let biased = estimate(1e-2, 1e-4);
    let wrong = edited(ld, |row| set(row, 1.2e-2, biased));
    assert!(wrong.contains("**`ld:sheet` converges to a wrong image in `a01`**"), "{wrong}");
    assert!(wrong.contains("| `ld:sheet` | no (0.0100 "));
    let stalled = edited(ld, |row| set(row, 1.2e-2, estimate(1e-5, 1e-4)));
    assert!(stalled.contains("**`ld:sheet` stalls in `a01`**"), "{stalled}");
    assert!(stalled.contains("| `ld:sheet` | no bias seen, but it stalls ("));
    let falling = edited(ld, |row| set(row, 1e-1 / f64::from(row.spp.asked), estimate(1e-6, 1e-5)));
    assert!(falling.contains("- `ld:sheet` in `a01`: the error falls to 0.250 "), "{falling}");
    assert!(falling.contains("| `ld:sheet` | yes ("));
    for (report, right) in [(&wrong, 0), (&stalled, 1), (&falling, 2)] {
        let found = ["`ld:sheet` converges to", "`ld:sheet` stalls", "`ld:sheet` in `a01`: the error falls"];
        let found: Vec<usize> = (0..3).filter(|&i| report.contains(found[i])).collect();
        assert_eq!(found, [right]);
    }
}

#[test]
fn an_interval_that_holds_both_answers_says_cannot_tell() {
    let report = edited(
        |sampler, spp| sampler == "ld:sheet" && spp == 64,
        |row| {
            row.mse = estimate(1e-2, 9.9e-3);
            row.bias2 = estimate(5e-3, 4e-3);
        },
    );
    assert!(report.contains("cannot tell where it goes; perhaps a bias: bias²"), "{report}");
    assert!(report.contains("| `ld:sheet` | cannot tell ("));
}

#[test]
fn a_cure_that_does_not_cure_is_not_called_one() {
    let is_literal = |sampler: &str, spp: u32| sampler == "ld:sheet" && spp == 64;
    let worse = edited(is_literal, |row| set(row, 1e-9, estimate(0.0, 1e-10)));
    assert!(worse.contains("`ld:best` is no cure here"), "{worse}");
    let below_noise = edited(is_literal, |row| set(row, -1e-9, estimate(0.0, 1e-10)));
    assert!(
        below_noise.contains("so its course cannot be told. How `ld:best` compares cannot be told"),
        "{below_noise}"
    );
    assert!(!below_noise.contains("not a number"));
}

#[test]
fn no_advantage_is_claimed_where_none_is_seen() {
    let report = edited(|sampler, _| sampler == "ld:shuffle:owen@each", |row| set(row, 1.0, estimate(0.0, 1e-3)));
    assert!(report.contains("**ld**: no advantage over uniform is seen"), "{report}");
}

#[test]
fn missing_rows_are_counted_and_what_is_there_is_still_told() {
    let all = rows();
    let without = |drop: &dyn Fn(&Row) -> bool| {
        let rows: Vec<Row> = all.iter().filter(|row| !drop(row)).cloned().collect();
        let summary = summary(&rows);
        (text(&summary, &Figures::default()), summary.missing)
    };
    let (report, missing) = without(&|row| matches!(row, Row::Ensemble(row) if row.spp.asked == 64));
    assert_eq!(missing, ["5 of 15 comparisons of a sampler with its reference (the first: a01, uniform, 64 spp)"]);
    assert!(report.contains("**Incomplete.** Missing: 5 of 15 comparisons"));
    let (_, missing) = without(&|row| matches!(row, Row::Points(_)));
    assert_eq!(missing, ["10 of 10 point sets"]);
    let (report, missing) = without(&|_| true);
    assert_eq!(missing.len(), 3, "{missing:?}");
    assert!(report.contains("There are no comparisons yet to answer from."));
    for drop in 0..all.len() {
        let rows: Vec<Row> = all.iter().enumerate().filter(|(i, _)| *i != drop).map(|(_, row)| row.clone()).collect();
        assert!(!text(&summary(&rows), &Figures::default()).contains("NaN"));
    }
}

#[test]
fn a_folder_without_rows_is_an_error_that_names_it() {
    let folder = tempfile::tempdir().unwrap();
    let error = write(folder.path()).unwrap_err();
    assert!(error.exit_code() == 2 && error.place.contains("experiment.json"), "{error}");
}

#[test]
fn pictures_without_images_are_said_to_be_missing_and_an_earlier_figure_is_kept() {
    let folder = folder();
    let about = folder.path().join("experiment.json");
    let json = std::fs::read_to_string(&about).unwrap();
    let pictures = r#""pictures": {"scene": "a01", "size": "16x9", "spp": 4, "reference_spp": 8}"#;
    let edited = json.replace("\"pictures\": null", pictures);
    assert_ne!(json, edited);
    std::fs::write(&about, edited).unwrap();
    // A picture's row whose image is not in the folder.
    let path = folder.path().join("results.jsonl");
    let rows = std::fs::read_to_string(&path).unwrap();
    let line = rows.lines().find(|line| line.contains("\"kind\":\"render\"")).unwrap();
    let line = line.replace("\"kind\":\"render\"", "\"kind\":\"picture\"");
    std::fs::write(&path, format!("{rows}{line}\n")).unwrap();
    let report = |folder: &tempfile::TempDir| std::fs::read_to_string(write(folder.path()).unwrap().report).unwrap();
    let text = report(&folder);
    assert!(text.contains("Missing: 4 of 5 pictures; 4 of 4 stages of Figure 1"), "{text}");
    assert!(text.contains("*Not shown: errors."));
    std::fs::write(folder.path().join("figures/errors.png"), b"an earlier figure").unwrap();
    assert!(
        report(&folder).contains("](figures/errors.png)"),
        "the earlier figure is shown, and the text is that of its run"
    );
    assert_eq!(std::fs::read(folder.path().join("figures/errors.png")).unwrap(), b"an earlier figure");
}

#[test]
fn neighbours_that_err_alike_are_told_from_those_that_do_not() {
    let fixed = |sampler: &str, _| sampler == "halton:sheet";
    let rho = |value: f64| Some(Estimate::without_interval(value));
    let alike = edited(fixed, |row| row.error_autocorrelation = rho(0.9));
    assert!(
        alike.contains("**In `a01` neighbours err more alike under `halton:sheet`**: ρ = +0.90 (no interval)"),
        "{alike}"
    );
    assert!(alike.contains("- `halton:sheet` in `a01`: structure instead of noise"));
    let not = edited(fixed, |row| row.error_autocorrelation = rho(0.0));
    assert!(not.contains("Whether neighbours err more alike in `a01` under `halton:sheet` cannot be told"), "{not}");
    assert!(!not.contains("structure instead of noise"));
    let less = edited(fixed, |row| row.error_autocorrelation = rho(-0.9));
    assert!(
        less.contains("In `a01` neighbours err less alike under `halton:sheet` than under `halton:best`"),
        "{less}"
    );
}

#[test]
fn equal_pixels_are_called_identical() {
    let mut rows = rows();
    let before = text(&summary(&rows), &Figures::default());
    assert!(before.contains("No two of the 5 samplers' images of `a01` at 64 spp are the same"), "{before}");
    for row in &mut rows {
        if let Row::Image(row) = row
            && (row.sampler == "ld:sheet" || row.sampler == "halton:sheet")
        {
            row.pixels = "one picture".to_owned();
        }
    }
    let after = text(&summary(&rows), &Figures::default());
    assert!(
        after.contains("have 4 different digests; bit for bit the same: `halton:sheet` and `ld:sheet`."),
        "{after}"
    );
}

#[test]
fn one_replicate_of_a_random_sampler_has_no_interval_and_no_verdict() {
    // The row's interval holds the reference's noise alone: it must not pass for the sampler's.
    let report = edited(|sampler, _| sampler == "ld:sheet", |row| row.replicates = 1);
    assert!(report.contains("| `ld:sheet` | cannot tell ("), "{report}");
    let line = report.lines().find(|line| line.starts_with("| `a01` | `ld:sheet` |")).unwrap();
    assert!(line.contains("(no interval)"), "{line}");
}

#[test]
fn an_experiment_without_a_lens_says_nothing_of_one() {
    let mut about = read_about(&stored().join("experiment.json")).unwrap();
    about.scenes[0].lens = false;
    let report = text(&summarise(&rows(), &timings(), &about), &Figures::default());
    assert!(report.contains("No scene of this experiment has a lens"));
    assert!(!report.contains("(with a lens)"));
}

/// The anchor of a heading as GitHub makes it, written anew from its rule: lower case; letters, digits, `_`, `-` and
/// spaces stay, spaces become hyphens.
fn github_anchor(heading: &str) -> String {
    let lower = heading.to_lowercase();
    lower
        .chars()
        .filter(|c| c.is_alphabetic() || c.is_ascii_digit() || ['_', '-', ' '].contains(c))
        .map(|c| if c == ' ' { '-' } else { c })
        .collect()
}

/// All targets of `](…)` in a page, code blocks left out.
fn link_targets(page: &str) -> Vec<&str> {
    let prose = page.split("```").step_by(2);
    prose.flat_map(|part| part.split("](").skip(1)).filter_map(|rest| rest.split(')').next()).collect()
}

/// Checks a written report: every link has its heading, figure, table or file, and figures and tables count from 1.
fn check_links(report: &Path) {
    let page = std::fs::read_to_string(report).unwrap();
    let mut anchors: Vec<String> = Vec::new();
    let mut times: std::collections::HashMap<String, usize> = std::collections::HashMap::new();
    for line in page.lines() {
        if line.starts_with('#') {
            let plain = github_anchor(line.trim_start_matches('#').trim());
            let before = times.entry(plain.clone()).or_default();
            anchors.push(if *before == 0 { plain } else { format!("{plain}-{before}") });
            *before += 1;
        }
        anchors.extend(line.split("<a id=\"").skip(1).filter_map(|rest| rest.split('"').next()).map(str::to_owned));
    }
    let unique: std::collections::HashSet<&String> = anchors.iter().collect();
    assert_eq!(unique.len(), anchors.len(), "{anchors:?}");
    let mut count = 0;
    for target in link_targets(&page) {
        count += 1;
        match target.strip_prefix('#') {
            Some(anchor) => assert!(anchors.iter().any(|known| known == anchor), "no place for #{anchor}"),
            None if target.contains("://") => {}
            None => assert!(report.parent().unwrap().join(target).is_file(), "no file {target}"),
        }
    }
    assert!(count > 30, "{count}");
    for sort in ["figure", "table"] {
        let has_number = |a: &&String| a.strip_prefix(&format!("{sort}-")).is_some_and(|n| n.parse::<usize>().is_ok());
        let found: Vec<&String> = anchors.iter().filter(has_number).collect();
        let wanted: Vec<String> = (1..=found.len()).map(|n| format!("{sort}-{n}")).collect();
        assert!(!wanted.is_empty() && found.into_iter().eq(&wanted), "{anchors:?}");
    }
    assert!(!page.contains(['\u{E000}', '\u{E001}']), "a reference was left open");
}

#[test]
fn every_link_image_and_number_of_a_report_resolves() {
    let folder = folder();
    check_links(&write(folder.path()).unwrap().report);
}

#[test]
fn every_heading_of_a_report_is_in_its_table_of_contents() {
    let page = text(&summary(&rows()), &Figures::default());
    let heading = |line: &&str| line.starts_with("## ") || line.starts_with("### ");
    let headings: Vec<&str> = page.lines().filter(heading).map(|line| line.trim_start_matches(['#', ' '])).collect();
    let (before, _) = page.split_once("\n## ").unwrap();
    let listed = before.lines().filter_map(|line| line.trim_start().strip_prefix("- [")?.split("](#").next());
    assert!(listed.eq(headings), "{before}");
}

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

/// A spectrum with this share of its power at low frequencies, of which white noise has 1/20.
fn spectrum(share: f64, p: Option<f64>) -> Box<ErrorSpectrum> {
    Box::new(ErrorSpectrum {
        frequency: vec![0.02, 0.1, 0.4],
        power: vec![share, 1.0, 1.0],
        low: None,
        high: None,
        low_share: Some(estimate(share, 0.01)),
        white_low_share: 0.05,
        p_white: p,
        blur_1: Some(estimate(20.0 * share, 0.1)),
        blur_2: Some(estimate(20.0 * share, 0.1)),
    })
}

#[test]
fn pixels_that_err_together_are_told_from_those_that_do_not() {
    let with = |halton: (f64, f64), others: f64| {
        edited(
            |_, _| true,
            |row| {
                let (share, p) = if row.sampler.starts_with("halton:joint") { halton } else { (0.05, others) };
                row.error_spectrum = Some(spectrum(share, Some(p)));
            },
        )
    };
    let none = with((0.06, 0.02), 0.5);
    assert!(none.contains("Do pixels err independently?") && none.contains("none finds a difference"), "{none}");
    // Holm: five tests, so 0.001 is 0.005 after adjustment, and 0.003 is not below 0.01.
    let alike = with((0.25, 0.001), 0.5);
    assert!(alike.contains("errors go together over many pixels, have `halton:best` in `a01` (5"), "{alike}");
    assert!(with((0.25, 0.003), 0.5).contains("none finds a difference"));
    let blue = with((0.01, 1e-6), 0.5);
    assert!(
        blue.contains("errors of neighbours cancel, have `halton:best` in `a01`") && blue.contains("< 1e−4"),
        "{blue}"
    );
    // Rows of earlier versions have no spectra, and nothing is said of any.
    assert!(!edited(|_, _| true, |_| {}).contains("Do pixels err independently?"));
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
    let wrong = edited(ld, |row| {
        set(row, 1.2e-2, biased);
        row.variance = Some(estimate(1e-2 / f64::from(row.spp.asked), 1e-5));
    });
    assert!(wrong.contains("**`ld:sheet` converges to a wrong image in `a01`**"), "{wrong}");
    assert!(wrong.contains("| `ld:sheet` | no: converges to a wrong image, "));
    let both = edited(ld, |row| {
        set(row, 1.2e-2, biased);
        row.variance = Some(estimate(2e-3, 1e-5));
    });
    assert!(both.contains("**`ld:sheet` stalls in `a01`, and is biased**"), "{both}");
    assert!(both.contains("| `ld:sheet` | no: stalls, and is biased, "));
    let stalled = edited(ld, |row| set(row, 1.2e-2, estimate(1e-5, 1e-4)));
    assert!(stalled.contains("**`ld:sheet` stalls in `a01`**"), "{stalled}");
    assert!(stalled.contains("| `ld:sheet` | no: stalls, no bias seen, "));
    let falling = edited(ld, |row| set(row, 1e-1 / f64::from(row.spp.asked), estimate(1e-6, 1e-5)));
    assert!(falling.contains("| `a01` | `ld:sheet` | error falls, no bias seen | 0.250 "), "{falling}");
    assert!(
        falling.contains("| `ld:sheet` | none seen: at most 0.70 % of the MSE; not promised: decisions in step"),
        "{falling}"
    );
    for (report, right) in [(&wrong, 0), (&stalled, 1), (&falling, 2)] {
        let found = ["`ld:sheet` converges to", "`ld:sheet` stalls", "`ld:sheet` | error falls"];
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
    assert!(report.contains("| `a01` | `ld:sheet` | cannot tell | "), "{report}");
    assert!(report.contains("| `ld:sheet` | cannot tell: "));
}

#[test]
fn a_cure_that_does_not_cure_is_not_called_one() {
    let is_literal = |sampler: &str, spp: u32| sampler == "ld:sheet" && spp == 64;
    let worse = edited(is_literal, |row| set(row, 1e-9, estimate(0.0, 1e-10)));
    assert!(worse.contains("| in step is better here |"), "{worse}");
    let below_noise = edited(is_literal, |row| set(row, -1e-9, estimate(0.0, 1e-10)));
    assert!(
        below_noise.contains("| `ld:sheet` | cannot tell: not above the reference's noise | – |")
            && below_noise.contains("| `ld:best` | – | cannot tell |"),
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
    let measured = Measurements::of(&summary(&all));
    for drop in 0..all.len() {
        let rows: Vec<Row> = all.iter().enumerate().filter(|(i, _)| *i != drop).map(|(_, row)| row.clone()).collect();
        assert!(!text_with(&summary(&rows), &Figures::default(), &measured).contains("NaN"));
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
    assert!(text.contains("*Not shown: errors-a01."));
    std::fs::write(folder.path().join("figures/errors-a01.png"), b"an earlier figure").unwrap();
    assert!(
        report(&folder).contains("](figures/errors-a01.png)"),
        "the earlier figure is shown, and the text is that of its run"
    );
    assert_eq!(std::fs::read(folder.path().join("figures/errors-a01.png")).unwrap(), b"an earlier figure");
}

#[test]
fn neighbours_that_err_alike_are_told_from_those_that_do_not() {
    let fixed = |sampler: &str, _| sampler == "halton:sheet";
    let rho = |value: f64| Some(Estimate::without_interval(value));
    let alike = edited(fixed, |row| row.error_autocorrelation = rho(0.9));
    assert!(
        alike.contains(
            "**Neighbours err more alike** under `halton:sheet` in `a01` (ρ = +0.90 (no interval), p < 0.001)"
        ),
        "{alike}"
    );
    assert!(alike.contains("| structure instead of noise | `halton:sheet` | `a01` |"));
    let not = edited(fixed, |row| row.error_autocorrelation = rho(0.0));
    assert!(not.contains("It cannot be told for `halton:sheet` in `a01`"), "{not}");
    assert!(!not.contains("| structure instead of noise"));
    let less = edited(fixed, |row| row.error_autocorrelation = rho(-0.9));
    assert!(
        less.contains("They err less alike than under the sampler compared with for `halton:sheet` in `a01`"),
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

/// The report where the mean of `ld:sheet` at 64 spp is off by `off` of the mean radiance, its replicates `spread` apart.
fn with_mean_off(off: f64, spread: f64) -> String {
    let mut rows = rows();
    let truth = rows.iter().find_map(|row| if let Row::Reference(row) = row { Some(row.mean) } else { None }).unwrap();
    let mut replicate = 0;
    for row in &mut rows {
        match row {
            Row::Image(row) if row.sampler == "ld:sheet" && row.spp.asked == 64 => {
                row.mean = truth * (1.0 + off + if replicate % 2 == 0 { spread } else { -spread });
                replicate += 1;
            }
            Row::Ensemble(row) if row.sampler == "ld:sheet" && row.spp.asked == 64 => {
                row.bias = estimate(off * truth, spread * truth);
            }
            _ => {}
        }
    }
    assert!(replicate > 1);
    text(&summary(&rows), &Figures::default())
}

/// Equivalence: a margin of 1 %, and three words for what the test says.
#[test]
fn a_mean_is_shown_the_same_shown_different_or_neither() {
    let word = |report: &str| {
        let (_, table) = report.split_once("Error of the mean at 64 spp").unwrap();
        let line = table.lines().find(|line| line.starts_with("| `a01` | `ld:sheet` |")).unwrap().to_owned();
        ["shown the same", "shown different", "cannot tell"]
            .into_iter()
            .filter(|word| line.contains(word))
            .collect::<Vec<_>>()
    };
    assert_eq!(word(&with_mean_off(0.0, 2e-4)), ["shown the same"]);
    assert_eq!(word(&with_mean_off(0.3, 2e-4)), ["shown different"]);
    assert_eq!(word(&with_mean_off(0.01, 5e-3)), ["cannot tell"]);
    let off = with_mean_off(0.3, 2e-4);
    assert!(off.contains("the largest error is that of `ld:sheet`, +30"), "{off}");
    assert!(off.contains("; shown different: `ld:sheet` ("), "{off}");
}

/// The lines of the answer box.
fn answers(report: &str) -> Vec<&str> {
    let (_, after) = report.split_once("## Answers").unwrap();
    let (answers, _) = after.split_once("**Contents**").unwrap();
    answers.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit())).collect()
}

#[test]
fn every_answer_leads_to_a_number_an_interval_or_a_test_and_its_table() {
    let report = text(&summary(&rows()), &Figures::default());
    let lines = answers(&report);
    assert!((4..=8).contains(&lines.len()), "{lines:?}");
    for line in lines {
        let has_interval = line.contains(" [") && line.contains("], ") || line.contains("] ") || line.contains("])");
        assert!(has_interval || line.contains("p = ") || line.contains("p < "), "{line}");
        assert!(line.contains("](#table-"), "{line}");
    }
}

#[test]
fn every_cell_of_the_table_of_predicates_answers_and_holds_its_number() {
    let page = text(&summary(&rows()), &Figures::default());
    let (_, after) = page.split_once("## Advantages and disadvantages").unwrap();
    let (section, _) = after.split_once("## Limits").unwrap();
    let lines: Vec<&str> = section.lines().filter(|line| line.starts_with("| `")).collect();
    assert_eq!(lines.len(), 4 * 5, "four tables of five samplers: {lines:?}");
    for cell in lines.iter().flat_map(|line| line.trim_matches(['|', ' ']).split(" | ").skip(1)) {
        let answers = ["yes", "no", "cannot tell", "none seen", "1 (itself)", "–"];
        assert!(answers.iter().any(|answer| cell.starts_with(answer)), "{cell}");
        let is_told = cell.contains(|c: char| c.is_ascii_digit()) || cell.contains("nothing random") || cell == "–";
        assert!(is_told, "{cell}");
    }
}

#[test]
fn one_replicate_of_a_random_sampler_has_no_interval_and_no_verdict() {
    // The row's interval holds the reference's noise alone: it must not pass for the sampler's.
    let report = edited(|sampler, _| sampler == "ld:sheet", |row| row.replicates = 1);
    assert!(report.contains("| `ld:sheet` | cannot tell: "), "{report}");
    let line = report.lines().find(|line| line.starts_with("| `a01` | `ld:sheet` |")).unwrap();
    assert!(line.contains("(no interval)"), "{line}");
}

#[test]
fn an_experiment_without_a_lens_says_nothing_of_one() {
    let mut about = read_about(&stored().join("experiment.json")).unwrap();
    about.scenes[0].lens = false;
    let report = text(&summarise(&rows(), &timings(), &about), &Figures::default());
    assert!(report.contains("No scene of this experiment has a lens"));
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
    for entry in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("reports")).unwrap() {
        check_links(&entry.unwrap().path().join("report.md"));
    }
}

#[test]
fn every_heading_of_a_report_is_in_its_table_of_contents() {
    let page = text(&summary(&rows()), &Figures::default());
    let heading = |line: &&str| line.starts_with("## ") || line.starts_with("### ");
    let headings: Vec<&str> = page.lines().filter(heading).map(|line| line.trim_start_matches(['#', ' '])).collect();
    let (_, after) = page.split_once("**Contents**\n\n").unwrap();
    let (list, _) = after.split_once("\n\n").unwrap();
    let listed = list.lines().filter_map(|line| line.trim_start().strip_prefix("- [")?.split("](#").next());
    assert!(listed.eq(headings), "{list}");
}

/// The stored rows with rounds: 1 ms a sample per pixel for independent points, 1.1 ms for others, each round up to 4 % off;
/// numbers take a tenth of it, those of Halton's sets half.
fn with_rounds() -> Summary {
    let rows = rows();
    let mut timings = timings();
    for timing in &mut timings {
        let image = rows.iter().find_map(|row| match row {
            Row::Image(row) if row.id == timing.id && row.kind == Kind::Render && row.replicate == 0 => Some(row),
            _ => None,
        });
        let Some(row) = image else { continue };
        let base = 1e-3 * f64::from(row.spp.taken) * if row.sampler.starts_with("uniform") { 1.0 } else { 1.1 };
        let seconds: Vec<f64> = (0..9).map(|i| base * (0.96 + 0.01 * f64::from(i * 5 % 9))).collect();
        let share = if row.sampler.starts_with("halton") { 0.5 } else { 0.1 };
        let numbers = seconds.iter().map(|s| share * s).collect();
        timing.again = Some(Rounds { host: "h".to_owned(), threads: 2, seconds, numbers, load: Vec::new() });
    }
    let mut about = read_about(&stored().join("experiment.json")).unwrap();
    let rmse = BTreeMap::from([("a01".to_owned(), vec![1e-5, 0.1])]);
    about.experiment.timing = Some(TimedRounds { rounds: 9, spp: vec![4, 16, 64], rmse });
    let point = |name: &str, scene: &str| PeerPoint {
        name: name.to_owned(),
        scene: scene.to_owned(),
        size: Size { width: 32, height: 18 },
        spp: 64,
        seconds: 0.4,
        seconds_range: Some([0.3, 0.5]),
        rmse: 0.05,
        rmse_range: None,
        machine: "a mill".to_owned(),
        date: "2026-11-25".to_owned(),
    };
    let points = vec![point("Other 1.0", "a01"), point("Other 1.0", "elsewhere")];
    about.experiment.peers = Some(Peers { file: "peers.json".to_owned(), note: Some("n".to_owned()), points });
    summarise(&rows, &timings, &about)
}

#[test]
fn seconds_come_from_rounds_with_the_share_of_sampling_and_the_time_to_a_stated_error() {
    let summary = with_rounds();
    let report = text(&summary, &Figures::default());
    assert!(summary.speeds.iter().all(|speed| speed.is_in_rounds && speed.timings == 9));
    let uniform = summary.speeds.iter().find(|s| s.sampler == 0 && s.spp.asked == 64).unwrap();
    // The middle of nine, between the second and the eighth.
    let Estimate { value, ci95: Some([low, high]) } = uniform.seconds else { panic!() };
    assert!((value - 0.064).abs() < 1e-12 && (low - 0.97 * 0.064).abs() < 1e-12 && (high - 1.03 * 0.064).abs() < 1e-12);
    assert!(report.contains("medians of 9 rounds"), "{report}");
    // Within rounds that go up and down by 4 %, both times do, and the share stays.
    assert!(report.contains("drawing numbers takes from 10 % ") && report.contains(" to 50 % "), "{report}");
    let row = report.lines().find(|line| line.starts_with("| `uniform` |") && line.contains("not reached (")).unwrap();
    assert!(row.contains(" at 64 spp) | 1 |"), "the second level is reached, the first is not: {row}");
    assert!(report.contains("RMSE 1.00e−5 in `a01`: no sampler that nothing speaks against gets there"), "{report}");
    assert!(report.contains("RMSE 0.100 in `a01`: ") && report.contains("**Who gets there first**"));
    // A fourth of the pixels, so a fourth of the seconds.
    assert!(
        report.contains(
            "| Other 1.0 | `a01` | 64 | 32x18 | 0.400 [0.300, 0.500] | 0.100 | 0.0500 | a mill, 2026-11-25 |"
        )
    );
    assert!(report.contains("The file says: n. 1 point of scenes that are not here is left out."), "{report}");
}

/// Two picture scenes with a ladder of counts, none with a lens; images large enough for details.
const PICTURED: &str = r#"{
    "name": "pictured", "seed": 5, "scenes": ["cornell", "penumbra"], "size": "4x4",
    "samplers": ["uniform", "ld:best"], "spp": [1, 4], "replicates": 2,
    "reference": {"sampler": "sobol", "spp": 4},
    "pictures": [
        {"scene": "cornell", "size": "88x30", "spp": [1, 2, 4], "reference_spp": 8},
        {"scene": "penumbra", "size": "88x30", "spp": [1, 2, 4]}
    ]
}"#;

/// Runs it and sets the seconds of each image so that a picture costs its samples per pixel, ld:best twice as fast.
fn pictured() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/experiments/pictured.json");
    let value = sampler_lab::scene::json::parse(PICTURED.as_bytes(), "pictured.json").unwrap();
    let experiment = Experiment::from_value(&value, "pictured.json").unwrap();
    let lab = Lab::new(&place, Default::default());
    let plan = plan(&experiment, &lab).unwrap();
    let outcome =
        execute(&plan, &lab, folder.path(), &Silent, &Options::new(2, "sampler-lab run pictured.json")).unwrap();
    assert_eq!(outcome.failures, []);
    let rows = read(&folder.path().join("results.jsonl")).unwrap();
    let timings: Vec<String> = read_timings(&timings_path(folder.path()))
        .unwrap()
        .into_iter()
        .map(|mut timing| {
            if let Some(Row::Image(row)) = rows.iter().find(|row| row.id() == timing.id) {
                let speed = if row.sampler.starts_with("ld") { 2.0 } else { 1.0 };
                // A picture's own timing, doubled by other work, is not what its cost is judged by.
                let (pixels, of_picture) = (row.size.pixels() as f64, f64::from(88 * 30));
                let slowed = if row.kind == Kind::Picture && row.sampler.starts_with("ld") { 2.0 } else { 1.0 };
                timing.seconds = f64::from(row.spp.taken) / speed * slowed * pixels / of_picture;
            }
            serde_json::to_string(&timing).unwrap() + "\n"
        })
        .collect();
    std::fs::write(timings_path(folder.path()), timings.concat()).unwrap();
    folder
}

#[test]
fn every_picture_scene_has_its_strips_and_equal_time_takes_the_count_that_costs_as_much() {
    let folder = pictured();
    let written = write(folder.path()).unwrap();
    assert!(written.check().is_ok(), "{:?}", written.summary.missing);
    check_links(&written.report);
    let page = std::fs::read_to_string(&written.report).unwrap();
    for scene in ["cornell", "penumbra"] {
        assert!(page.contains(&format!("### Pictures of {scene}\n")));
        for sort in ["reference", "details", "equal-time", "errors"] {
            let file = format!("figures/{sort}-{scene}.png");
            assert!(page.contains(&format!("]({file})")) && folder.path().join(&file).is_file(), "{file}");
        }
        assert!(folder.path().join(format!("images/flip/{scene}/02-ld-best.png")).is_file());
    }
    let words = |scene: &str| -> Vec<String> {
        written.figures.details[scene].iter().map(|name| name.split(' ').next().unwrap().to_owned()).collect()
    };
    assert_eq!(words("cornell"), ["edges", "shadow"], "no lens, so no defocus");
    assert_eq!(words("penumbra"), ["shadow"], "one plane of one colour: no edges either");
    assert!(page.contains("is what `uniform:best` takes at 2 spp, 2.00 s"), "{page}");
    let (_, table) = page.split_once("The pictures of `cornell` at equal time").unwrap();
    let lines: Vec<&str> = table.lines().filter(|line| line.starts_with("| `")).take(2).collect();
    assert!(lines[0].starts_with("| `uniform:best` | 2 | 2.00 | 1.00 |"), "{lines:?}");
    assert!(lines[1].starts_with("| `ld:best` | 4 | 2.00 | 1.00 |"), "{lines:?}");
    assert!(page.contains("`cornell` in three stages"), "a scene without a lens has no stage for it");
    let html = std::fs::read(folder.path().join("report.html")).unwrap();
    // Without the images the figures stay, and so do the words and the pictures of the page.
    std::fs::remove_dir_all(folder.path().join("images")).unwrap();
    write(folder.path()).unwrap();
    assert_eq!(std::fs::read_to_string(&written.report).unwrap(), page);
    assert!(std::fs::read(folder.path().join("report.html")).unwrap() == html, "the viewer's pictures are kept");
}

#[test]
fn the_page_has_the_text_the_figures_and_a_viewer_of_each_picture_scene_and_nothing_from_outside() {
    let folder = pictured();
    write(folder.path()).unwrap();
    let path = folder.path().join("report.html");
    let page = std::fs::read_to_string(&path).unwrap();
    assert_eq!(page.matches("<section class=\"viewer\"").count(), 2);
    // A reference, two samplers at equal samples, and ld:best's other count at equal time, in each.
    assert_eq!(page.matches("class=\"picture\" data-label=").count(), 2 * 4);
    let markdown = std::fs::read_to_string(folder.path().join("report.md")).unwrap();
    assert_eq!(page.matches("<img class=").count(), markdown.matches("![Figure ").count());
    assert_eq!(page.matches("<table>").count(), markdown.lines().filter(|line| line.starts_with("| ---")).count());
    // Whatever an attribute names is in the page or in its address.
    for attribute in ["src=\"", "href=\""] {
        for piece in page.split(attribute).skip(1) {
            assert!(piece.starts_with("data:") || piece.starts_with('#'), "{attribute}{}", &piece[..40]);
        }
    }
    assert!(!page.contains("http://") && !page.contains("https://"), "an address of the network");
    // A viewer that may take fewer letters leaves out the pictures at equal time, then all but the middle of each.
    let summary = write(folder.path()).unwrap().summary;
    let viewer = |letters| viewer::html(folder.path(), &summary, &summary.pictured[0], letters).unwrap();
    let count = |html: &str| html.matches("class=\"picture\"").count();
    let whole = viewer(viewer::MOST_LETTERS);
    let some = viewer(whole.len() - 1);
    let middle = viewer(some.len() * 2 / 3);
    assert_eq!([count(&whole), count(&some), count(&middle)], [4, 3, 3]);
    assert!(whole.contains("data-note=\"\"") && some.contains("data-note=\"The pictures at equal time are left out"));
    assert!(middle.contains("data-note=\"Of 88 × 30 pixels the middle is here") && middle.len() <= some.len() * 2 / 3);
    // Another folder of the same rows and images has the same bytes; one without images or an earlier page says so.
    write(folder.path()).unwrap();
    assert!(std::fs::read_to_string(&path).unwrap() == page);
    std::fs::remove_dir_all(folder.path().join("images")).unwrap();
    let hostile = page.replace("data-label=\"reference\"", "data-label=\"<b>reference</b>\"");
    for earlier in [None, Some(hostile), Some(page.replace("<!-- viewer ", "<!-- viewer 0"))] {
        match &earlier {
            None => std::fs::remove_file(&path).unwrap(),
            Some(earlier) => std::fs::write(&path, earlier).unwrap(),
        }
        write(folder.path()).unwrap();
        let page = std::fs::read_to_string(&path).unwrap();
        assert_eq!(page.matches("The flip viewer has no pictures here.").count(), 2);
        assert!(!page.contains("<b>reference"));
    }
}

#[test]
fn a_picture_is_shown_at_its_scene_s_own_exposure() {
    let folder = pictured();
    let sets = write(folder.path()).unwrap().summary.pictured;
    assert_eq!((sets[0].exposure, sets[1].exposure), (1.0, 3.0), "what cornell.json and penumbra.json ask for");
    let figure = |name: &str| std::fs::read(folder.path().join("figures").join(name)).unwrap();
    let (cornell, errors) = (figure("reference-cornell.png"), figure("errors-cornell.png"));
    let about = folder.path().join("experiment.json");
    let text = std::fs::read_to_string(&about).unwrap();
    let edited = text.replacen("\"exposure\": 1.0", "\"exposure\": 1.5", 1);
    assert_ne!(text, edited);
    std::fs::write(&about, edited).unwrap();
    let page = std::fs::read_to_string(write(folder.path()).unwrap().report).unwrap();
    assert!(page.contains("88x30 pixels, exposure 1.5"), "{page}");
    assert!(figure("reference-cornell.png") != cornell);
    assert!(figure("errors-cornell.png") == errors, "an error map has no exposure");
}

/// The stored rows with another reference.
fn with_reference(edit: impl Fn(&mut ReferenceRow)) -> Vec<Row> {
    let mut rows = rows();
    for row in &mut rows {
        if let Row::Reference(row) = row {
            edit(row);
        }
    }
    rows
}

#[test]
fn an_error_too_near_the_reference_s_noise_is_marked_wherever_it_is_used_and_left_out_of_slopes() {
    let before = summary(&rows());
    let plain = text(&before, &Figures::default());
    assert!(before.cells.iter().all(|cell| !cell.is_reference_limited));
    assert!(!plain.contains("‡ |") && plain.contains("It is at most 50 % of every error here."), "{plain}");
    // 0.00102 and 7.50e-4 are the mean squares of the two best at 64 spp: half of their roots lies below this noise.
    let after = summary(&with_reference(|row| row.noise_mse = 3e-4));
    let limited: Vec<(usize, u32)> = after
        .cells
        .iter()
        .filter(|cell| cell.is_reference_limited)
        .map(|cell| (cell.sampler, cell.spp.asked))
        .collect();
    assert_eq!(limited, [(3, 64), (4, 64)]);
    let report = text(&after, &Figures::default());
    for words in [
        "‡ reference-limited (2 of 15 errors): the reference's own RMSE is more than 50 % of this one.",
        "Reference-limited, since it is more than 50 % of them: `halton:best` at 64 spp and `ld:best` at 64 spp.",
        "` reference-limited)",
    ] {
        assert!(report.contains(words), "{words}: {report}");
    }
    assert!(report.lines().any(|line| line.starts_with("| `a01` | `ld:best` | ") && line.contains("0.0320 ‡")));
    for (sampler, points) in [(0, 3), (3, 2), (4, 2)] {
        assert_eq!(after.slope(0, sampler).unwrap().fit.as_ref().unwrap().points, points, "{sampler}");
    }
}

#[test]
fn an_error_below_the_reference_s_noise_is_reference_limited() {
    let mut rows = rows();
    for row in &mut rows {
        if let Row::Ensemble(row) = row
            && row.sampler == "ld:sheet"
            && row.spp.asked == 64
        {
            set(row, -1e-6, estimate(0.0, 1e-6));
        }
    }
    let report = text(&summary(&rows), &Figures::default());
    assert!(report.contains("below noise ‡") && report.contains("`ld:sheet` at 64 spp, below noise."), "{report}");
}

#[test]
fn a_reference_that_grew_says_how_far_and_whether_that_was_enough() {
    let grown = |is_limited: bool| {
        let growth = Growth {
            batches: 4,
            most_batches: 4,
            noise: 0.05,
            noise_mse_ci95: [1.1e-5, 1.3e-5],
            pilot_mse: 7.5e-4,
            pilot: "0123456789abcdef".to_owned(),
            is_limited,
        };
        let rows = with_reference(|row| row.growth = Some(growth.clone()));
        let mut about = read_about(&stored().join("experiment.json")).unwrap();
        about.experiment.reference.noise = Some(0.05);
        about.experiment.reference.most_spp = Some(4 * about.experiment.reference.spp);
        let summary = summarise(&rows, &timings(), &about);
        (summary.cells.iter().filter(|cell| cell.is_reference_limited).count(), text(&summary, &Figures::default()))
    };
    let (limited, enough) = grown(false);
    // The noise is 1.19e-5: a twentieth of the root of 0.00475 and less.
    assert_eq!(limited, 5);
    let spp = read_about(&stored().join("experiment.json")).unwrap().experiment.reference.spp;
    for words in [
        &format!("| 2 × 4 × {spp} spp | 0.00344 [0.00332, 0.00361] |"),
        "4 at the most, until the reference's own RMSE is at most 5.0 % of the smallest that it judges",
        "where its RMSE is at most 5.0 % of the smallest of one image of each sampler (row `01234567`).",
        "of which the reference's own RMSE is more than 5.0 % (the experiment's `noise`)",
    ] {
        assert!(enough.contains(words), "{words}: {enough}");
    }
    let (_, most) = grown(true);
    assert!(most.contains("the most it may, and is **reference-limited**"), "{most}");
}

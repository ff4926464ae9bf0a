//! Sentences that flip when numbers flip.

use super::*;

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

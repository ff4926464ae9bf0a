//! References that are too noisy, or grew.

use super::*;

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

//! Seconds of rounds.

use super::*;

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

//! The tests of hypotheses against published values, closed forms and their own rates.

use super::distributions::{one_sided_smirnov, pooled_cells};
use super::*;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

const ONE: Family = Family { tests: 1, false_alarm: 0.01 };

fn uniform(rng: &mut Pcg64) -> f64 {
    (rng.next_u64() >> 11) as f64 * 0.5f64.powi(53)
}

#[test]
fn no_spread_gives_a_definite_answer_and_never_a_nan() {
    let equal = t_test(&[0.25; 5], 0.25, ONE);
    assert!(equal.holds() && equal.outcome == Outcome::DefinitelyEqual && equal.p_value == Some(1.0));
    let different = t_test(&[0.25; 5], 0.26, ONE);
    assert!(!different.holds() && different.p_value == Some(0.0) && different.statistic.is_none());
    assert!(z_test(1.0, 1.0, 0.0, ONE).holds() && !z_test(1.0, 1.5, 0.0, ONE).holds());
    assert_eq!(welch(&[1.0, 1.0], &[1.0, 1.0]).map(|w| w.p_two_sided), Some(1.0));
    assert_eq!(welch(&[1.0, 1.0], &[2.0, 2.0, 2.0]).map(|w| w.p_two_sided), Some(0.0));
}

#[test]
fn what_cannot_be_tested_is_undefined_and_does_not_hold() {
    for verdict in [
        t_test(&[], 0.0, ONE),
        t_test(&[1.0], 1.0, ONE),
        t_test(&[1.0, f64::NAN], 1.0, ONE),
        t_test(&[1.0, 2.0], f64::INFINITY, ONE),
        z_test(1.0, 1.0, f64::NAN, ONE),
        z_test(1.0, 1.0, -1.0, ONE),
        chi2_test(&[1, 2], &[3.0], ONE),
        chi2_test(&[3, 3], &[3.0, 3.0], ONE),
        chi2_test(&[30, 30], &[30.0, 31.0], ONE),
        chi2_test(&[30, 30], &[90.0, -30.0], ONE),
        ks_uniform_test(&[], ONE),
        ks_uniform_test(&[0.5, 1.5], ONE),
    ] {
        assert!(matches!(verdict.outcome, Outcome::Undefined(_)) && !verdict.holds(), "{verdict}");
        assert!(verdict.statistic.is_none() && verdict.p_value.is_none());
    }
    assert_eq!(welch(&[1.0], &[1.0, 2.0]), None);
    assert_eq!(welch(&[1.0, f64::INFINITY], &[1.0, 2.0]), None);
}

#[test]
fn rounding_is_no_evidence() {
    let third = 1.0 / 3.0;
    let nearby = third + f64::EPSILON / 4.0;
    assert!(nearby != third && t_test(&[nearby; 8], third, ONE).holds());
    assert!(t_test(&[nearby, third, nearby, nearby, nearby, nearby], third, ONE).holds());
}

#[test]
fn sidak_does_not_vanish_for_a_million_tests() {
    assert!((sidak(0.01, 1_048_576) / (0.010_050_335_853_501_44 / 1_048_576.0) - 1.0).abs() < 1e-8);
    assert_eq!(Family { tests: 1, false_alarm: 0.01 }.per_test(), 0.01);
}

#[test]
fn a_verdict_says_what_it_found_and_what_it_would_catch() {
    let text = t_test(&[1.0, 2.0, 3.0, 2.0], 2.5, Family { tests: 24, false_alarm: 1e-6 }).to_string();
    for part in ["holds", "statistic -1.2247", "p = 3.", "1 of 24 tests", "1e-6", "would be caught"] {
        assert!(text.contains(part), "{part:?} in {text:?}");
    }
}

/// A null calibration: the t test on uniform numbers may fail in 1 % of 20 000 runs; six standard errors (7e-4
/// each) allowed, a false alarm of 2e-9.
#[test]
fn the_t_test_lies_as_often_as_it_says() {
    let mut rng = Pcg64::new(7, 1);
    let mut run = |bias: f64| {
        let values: Vec<f64> = (0..16).map(|_| uniform(&mut rng) + bias).collect();
        t_test(&values, 0.5, ONE)
    };
    let alarms = (0..20_000).filter(|_| !run(0.0).holds()).count();
    assert!((0.0058..0.0142).contains(&(alarms as f64 / 20_000.0)), "{alarms}");
    // A bias of the size that the verdict names on average is found nearly always: POWER at 16 replicates.
    let detects = run(0.0).detects.expect("a spread");
    let found = (0..2_000).filter(|_| !run(1.15 * detects).holds()).count();
    assert!(found > 1_900, "{found} of 2000 at {detects}");
}

/// The statistic is (25 · 3 + 225)/15; its upper tail at 3 degrees of freedom is erfc(√10) + √(40/π) e^−10.
#[test]
fn small_cells_are_pooled_smallest_first() {
    assert_eq!(pooled_cells(&[1, 20, 2, 3], &[2.0, 18.0, 4.0, 2.0]), vec![(6, 8.0), (20, 18.0)]);
    assert_eq!(pooled_cells(&[1, 2, 3], &[1.0, 2.0, 1.0]), vec![]);
    assert_eq!(pooled_cells(&[4, 6], &[5.0, 5.0]), vec![(4, 5.0), (6, 5.0)]);
    let verdict = chi2_test(&[10, 10, 10, 30], &[15.0; 4], ONE);
    assert_eq!(verdict.statistic, Some(20.0));
    assert!(!verdict.holds() && (verdict.p_value.expect("tested") - 1.697_424e-4).abs() < 1e-10, "{verdict}");
}

/// Critical values of D (Miller 1956, table 1) and one probability of Marsaglia, Tsang & Wang 2003.
#[test]
fn kolmogorov_smirnov_meets_published_values() {
    for (n, critical, alpha) in [(10, 0.48893, 0.01), (20, 0.35241, 0.01), (10, 0.40925, 0.05), (1, 0.975, 0.05)] {
        let p = 2.0 * one_sided_smirnov(n, critical);
        assert!((p - alpha).abs() < 2e-3 * alpha, "{n}: {p}");
    }
    let (bound, exact) = (2.0 * one_sided_smirnov(10, 0.274), 1.0 - 0.628_479_615_456_5);
    assert!(bound >= exact && bound < 1.01 * exact, "{bound} {exact}");
}

#[test]
fn kolmogorov_smirnov_sees_a_bent_distribution_and_passes_a_straight_one() {
    let mut rng = Pcg64::new(8, 1);
    let straight: Vec<f64> = (0..2000).map(|_| uniform(&mut rng)).collect();
    let bent: Vec<f64> = straight.iter().map(|u| u.sqrt()).collect();
    let family = Family { tests: 1, false_alarm: 1e-6 };
    assert!(ks_uniform_test(&straight, family).holds() && !ks_uniform_test(&bent, family).holds());
    assert_eq!(ks_uniform_test(&[0.0; 3], family).statistic, Some(1.0));
    assert_eq!(ks_uniform_test(&[0.5], family).p_value, Some(1.0));
}

#[test]
fn adjusted_p_values_stay_monotone_and_below_one_at_the_extremes() {
    let p = [1e-300, 0.0, 1.0, 0.6, f64::MIN_POSITIVE];
    for adjusted in [holm(&p), benjamini_hochberg(&p)].map(|a| a.expect("probabilities")) {
        assert!(adjusted.iter().zip(&p).all(|(a, p)| a >= p && *a <= 1.0), "{adjusted:?}");
        assert!(adjusted[1] <= adjusted[4] && adjusted[4] <= adjusted[0] && adjusted[0] <= adjusted[3]);
    }
    assert_eq!(holm(&[]), Ok(vec![]));
    for bad in [f64::NAN, -0.1, 1.1] {
        let error = holm(&[0.5, bad]).expect_err("no probability");
        assert!(error.to_string().starts_with("p-value 1: expected a number in [0, 1]"), "{error}");
        assert!(benjamini_hochberg(&[bad]).is_err());
    }
}

/// Closed forms at the ends: 1 − (α/2)^(1/n) and its mirror; 5 of 10 from Clopper & Pearson 1934.
#[test]
fn clopper_pearson_meets_its_closed_forms() {
    let end = 1.0 - libm::pow(0.025, 1.0 / 12.0);
    let [low, high] = clopper_pearson(0, 12, 0.95);
    assert!(low == 0.0 && (high - end).abs() < 1e-14);
    let [low, high] = clopper_pearson(12, 12, 0.95);
    assert!(high == 1.0 && (low - (1.0 - end)).abs() < 1e-14);
    let [low, high] = clopper_pearson(5, 10, 0.95);
    assert!((low - 0.187_086).abs() < 1e-6 && (high - 0.812_914).abs() < 1e-6, "{low} {high}");
    assert_eq!(clopper_pearson(0, 0, 0.95), [0.0, 1.0]);
}

/// A weakness shown: on rare binary pixels Welch's p-values fall below 1e-4 in 1.2 % of null runs
/// (0.0116 in `failures_measured.json`), a hundred times too often; means over tiles of 64 pixels, 16 replicates a side, behave.
/// 20 000 runs: standard error 7.6e-4 at 0.0116 and 7e-5 at 1e-4; the bounds are six of them.
#[test]
fn welch_cries_wolf_on_rare_binary_pixels_and_not_on_pooled_tiles() {
    let mut rng = Pcg64::new(9, 1);
    let alarms = |rng: &mut Pcg64, pooled: u32, sizes: [usize; 2]| {
        let run = |rng: &mut Pcg64| {
            let mut pixel = || {
                let hits = (0..pooled).filter(|_| uniform(rng) < 0.05).count();
                hits as f64 / f64::from(pooled)
            };
            let [a, b] = sizes.map(|n| (0..n).map(|_| pixel()).collect::<Vec<f64>>());
            welch(&a, &b).is_some_and(|w| w.p_two_sided < 1e-4)
        };
        (0..20_000).filter(|_| run(rng)).count() as f64 / 20_000.0
    };
    let single = alarms(&mut rng, 1, [64, 256]);
    assert!((0.007..0.0162).contains(&single), "{single}");
    let tiles = alarms(&mut rng, 64, [16, 16]);
    assert!(tiles < 5.2e-4, "{tiles}");
}

/// 512 × 512 null tests: uncorrected, 1 % of them are "found" (2621 ± 51; six of those allowed). Corrected to one
/// false alarm in a million pictures, none is.
#[test]
fn a_quarter_of_a_million_true_hypotheses_give_no_discovery_after_correction() {
    let mut rng = Pcg64::new(10, 1);
    let p: Vec<f64> = (0..262_144).map(|_| uniform(&mut rng)).collect();
    let found = |p: &[f64], level: f64| p.iter().filter(|p| **p < level).count();
    assert!((2_315..2_928).contains(&found(&p, 0.01)), "{}", found(&p, 0.01));
    for adjusted in [holm(&p), benjamini_hochberg(&p)] {
        assert_eq!(found(&adjusted.expect("probabilities"), 1e-6), 0);
    }
}

/// 10 000 t tests on 1000 squares of normal numbers at a stated 10⁻², at the level for their skewness: no more often than stated, by
/// 4 standard errors. (With 64 of them 2 % were seen: too few for a level of 1 %, see [`Family::for_skewed`].)
#[test]
fn squares_keep_their_rate_at_the_level_for_skewed_values() {
    let mut rng = Pcg64::new(11, 2);
    let mut uniform = || ((rng.next_u64() >> 11) as f64 + 0.5) * 0.5f64.powi(53);
    let mut square = || -2.0 * libm::log(uniform()) * libm::cos(std::f64::consts::TAU * uniform()).powi(2);
    let family = Family::one(1e-2);
    let (mut plain, mut corrected, runs) = (0u32, 0u32, 10_000u32);
    for _ in 0..runs {
        let squares: Vec<f64> = (0..1000).map(|_| square()).collect();
        plain += u32::from(!t_test(&squares, 1.0, family).holds());
        corrected += u32::from(!t_test_of_squares(&squares, 1.0, family).holds());
    }
    assert!(plain >= corrected && corrected <= runs / 100 + 40, "{plain} and {corrected} of {runs}");
}

//! Tests, intervals, errors and discrepancies at one value each that is known by another route.

use std::f64::consts::PI;

use crate::check::{Check, Context, Finding, Kind, Tally};
use crate::stats::hypothesis::{clopper_pearson, holm, ks_uniform_test, sidak, welch};
use crate::stats::image_error::mse_unbiased;
use crate::stats::{Family, L2Kind, Moments, Points, Star, chi2_test, discrepancy, t_test};

/// The checks of this room.
pub fn checks() -> Vec<Check> {
    vec![
        Check {
            name: "quick-tests",
            group: "quick",
            claim: "moments, tests and intervals have the values that closed forms give",
            failures: &[27],
            kind: Kind::Exact,
            run: tests,
        },
        Check {
            name: "quick-errors",
            group: "quick",
            claim: "image errors and discrepancies of the smallest inputs are what one works out by hand",
            failures: &[],
            kind: Kind::Exact,
            run: errors,
        },
    ]
}

const ONE: Family = Family { tests: 1, false_alarm: 0.01 };

/// P(|T| > t) at 3 degrees of freedom: 1 − (2/π)(θ + sin θ cos θ), θ = atan(t/√3).
fn student_3(t: f64) -> f64 {
    let angle = libm::atan(t / 3.0_f64.sqrt());
    1.0 - 2.0 / PI * (angle + libm::sin(angle) * libm::cos(angle))
}

fn tests(_: &Context) -> Finding {
    const DIGITS: f64 = 1e-10;
    let mut tally = Tally::new();
    let mut near = |what: &str, found: Option<f64>, expected: f64| {
        tally.near(what, found.unwrap_or(f64::NAN), expected, DIGITS * expected.abs());
    };
    let offset: Moments = [4.0, 7.0, 13.0, 16.0].map(|x| 1e9 + x).into_iter().collect();
    near("variance of 10⁹ + {4, 7, 13, 16}", offset.variance(), 30.0);
    // Mean 2, variance 2/3: t = −½/√(1/6) = −√1.5.
    near("p of Student's t", t_test(&[1.0, 2.0, 3.0, 2.0], 2.5, ONE).p_value, student_3(1.5_f64.sqrt()));
    let (a, b): (f64, f64) = (5.0 / 12.0, 2.0);
    let freedom = (a + b) * (a + b) / (a * a / 3.0 + b * b / 4.0);
    let found = welch(&[1.0, 2.0, 3.0, 4.0], &[2.0, 4.0, 6.0, 8.0, 10.0]);
    near("Welch's degrees of freedom", found.and_then(|w| w.df), freedom);
    // χ² = 20 at 3 degrees of freedom: erfc(√10) + √(40/π) e^−10.
    let tail = libm::erfc(10.0_f64.sqrt()) + (40.0 / PI).sqrt() * libm::exp(-10.0);
    near("p of χ²", chi2_test(&[10, 10, 10, 30], &[15.0; 4], ONE).p_value, tail);
    near("D of one number near 1", ks_uniform_test(&[0.975], ONE).statistic, 0.975);
    // −expm1(−x) = x − x²/2 + …, x = −ln(0.99)/2²⁰.
    let x = 0.010_050_335_853_501_44 / 1_048_576.0;
    near("Šidák's level of 2²⁰ tests at 0.01", Some(sidak(0.01, 1 << 20)), x - 0.5 * x * x);
    for (place, expected) in [0.03, 0.06, 0.06].into_iter().enumerate() {
        near("Holm's adjusted p-values", holm(&[0.01, 0.04, 0.03]).ok().map(|p| p[place]), expected);
    }
    near(
        "Clopper and Pearson's end for 0 of 12",
        Some(clopper_pearson(0, 12, 0.95)[1]),
        1.0 - libm::pow(0.025, 1.0 / 12.0),
    );
    tally.finish()
}

fn errors(_: &Context) -> Finding {
    const DIGITS: f64 = 1e-14;
    let mut tally = Tally::new();
    // (1·(−1) + 0·1)/2: negative, as it may be.
    tally.near("unbiased MSE of two pixels", mse_unbiased(&[1.0, 2.0], &[0.0, 2.0], &[2.0, 1.0]), -0.5, DIGITS);
    let point = |x: f64, y: f64| Points::new_2d(&[[x, y]]).expect("a point of the square");
    let star: Option<Star> = discrepancy::star(&point(0.9, 0.9), 1e3).ok();
    tally.near(
        "D* of the point (0.9, 0.9), the open box up to (0.9, 1)",
        star.map_or(f64::NAN, |s| s.value),
        0.9,
        DIGITS,
    );
    // (13/12)³ − 2 + 1: the middle is as near to every corner.
    let middle = Points::new(3, vec![0.5; 3]).expect("a point of the cube");
    let centred = discrepancy::l2_squared(&middle, L2Kind::Centred);
    tally.near("centred L2 of the cube's middle, squared", centred.unwrap_or(f64::NAN), 469.0 / 1728.0, DIGITS);
    tally.finish()
}

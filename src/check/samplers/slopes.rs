//! How fast errors fall: slopes of RMSE in n = 16, 64, 256, 1024, 4096 against those of the reference.
//!
//! The reference's slopes are simulated too, each with an error of about 0.005. Ours have 0.16/√R for normal errors, so with 1000
//! replicates a difference of 0.05 is 7 standard errors: a false alarm below 1e-10 for all 30. Two kinds of rows have errors far from
//! normal and are computed in place of simulated: the step (one point decides: p(1 − p)/n², and other exact
//! variances, certified at n = 16 by `variance-…`) and the diagonal under a digital shift (all shifts).

use rayon::prelude::*;

use super::laws::{Error, grid_diagonal};
use super::reading::{Integrand, Reader, Tickets, spec};
use super::variance::laws;
use crate::check::{Check, Context, Finding, Kind, Tally};
use crate::sampling::{Decision, Random, SamplerSpec};
use crate::stats::{loglog_slope, sum};

/// The check of slopes.
pub fn checks() -> Vec<Check> {
    vec![Check {
        name: "slopes-of-the-reference",
        group: super::GROUP,
        claim: "RMSE falls with the reference's slope ± 0.05 for disk, diagonal, step, xy and Gaussian under six samplers",
        failures: &[],
        kind: Kind::Statistical,
        run,
    }]
}

/// The integrands of the reference's slopes.
pub const INTEGRANDS: [Integrand; 5] =
    [Integrand::Disk, Integrand::Diagonal, Integrand::Step, Integrand::Product, Integrand::Gaussian];

/// The counts of the reference's slopes.
pub const COUNTS: [u32; 5] = [16, 64, 256, 1024, 4096];

/// Tolerance of a slope, as the reference states it.
pub const TOLERANCE: f64 = 0.05;

/// Slopes of `sampler_convergence.json` for the samplers that we have, in the order of [`INTEGRANDS`].
const REFERENCE: [(&str, [f64; 5]); 6] = [
    ("uniform", [-0.497, -0.495, -0.501, -0.504, -0.499]),
    ("stratified:step:jitter", [-0.735, -0.746, -0.751, -1.0, -1.0]),
    ("ld:step:owen", [-0.751, -0.749, -1.007, -1.431, -1.447]),
    ("ld:step:xor", [-0.822, -0.593, -1.009, -1.009, -1.007]),
    ("halton:step:shift", [-0.754, -0.755, -1.009, -0.835, -0.902]),
    ("hammersley:step:shift", [-0.785, -0.552, -1.011, -0.932, -0.969]),
];

/// Exact mean square error of the rows that are computed; see the head of this file.
fn exact(s: SamplerSpec, integrand: Integrand, n: u32) -> Option<Error> {
    let count = f64::from(n);
    // 1/π cuts one of equal strata: the share of it that lies below.
    let cut = |strata: f64| (strata * std::f64::consts::FRAC_1_PI).fract();
    match (integrand, s.random) {
        (Integrand::Step, Random::Fresh) => Some(Error::unbiased(cut(1.0) * (1.0 - cut(1.0)) / count)),
        (Integrand::Step, Random::Jitter) => {
            let p = cut(count.sqrt());
            Some(Error::unbiased(p * (1.0 - p) / (count * count.sqrt())))
        }
        // n = 2ᵐ points stratified in x by 1/n.
        (Integrand::Step, Random::Owen | Random::Xor | Random::Shift) => {
            Some(Error::unbiased(cut(count) * (1.0 - cut(count)) / (count * count)))
        }
        (Integrand::Diagonal, Random::Xor) => {
            let axes = laws(s, &Tickets::new(), Decision::Pixel, n);
            grid_diagonal(&axes[0], &axes[1])
        }
        _ => None,
    }
}

/// Root mean square errors of [`INTEGRANDS`] over whole sets of the pixel's decision: exact where they are computed, else over
/// `replicates` seeds. The same on any number of threads.
pub fn root_mean_squares(s: SamplerSpec, n: u32, replicates: u32, seed: impl Fn(u64) -> u64 + Sync) -> [f64; 5] {
    let known = INTEGRANDS.map(|integrand| exact(s, integrand, n));
    let tickets = Tickets::new();
    let squares: Vec<[f64; 5]> = (0..u64::from(replicates))
        .into_par_iter()
        .map_init(
            || Reader::new(s, &tickets, n),
            |reader, r| {
                let points = reader.pairs(seed(r), &tickets.pixel);
                let mut errors = [0.0; 5];
                for (k, integrand) in INTEGRANDS.into_iter().enumerate().filter(|&(k, _)| known[k].is_none()) {
                    errors[k] = integrand.error(points.clone());
                }
                errors.map(|e| e * e)
            },
        )
        .collect();
    std::array::from_fn(|k| match known[k] {
        Some(error) => error.mean_square.sqrt(),
        None => (sum(squares.iter().map(|s| s[k])) / f64::from(replicates)).sqrt(),
    })
}

/// Slopes of [`INTEGRANDS`] over [`COUNTS`], and the RMSE at each count.
pub fn slopes(s: SamplerSpec, replicates: u32, seed: impl Fn(u32, u64) -> u64 + Sync) -> ([f64; 5], Vec<[f64; 5]>) {
    let rmse: Vec<[f64; 5]> = COUNTS.iter().map(|&n| root_mean_squares(s, n, replicates, |r| seed(n, r))).collect();
    let counts = COUNTS.map(f64::from);
    let slope = |k: usize| {
        let values: Vec<f64> = rmse.iter().map(|at| at[k]).collect();
        loglog_slope(&counts, &values).map_or(f64::NAN, |line| line.slope)
    };
    (std::array::from_fn(slope), rmse)
}

fn run(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let mut worst: f64 = 0.0;
    for (part, (name, expected)) in REFERENCE.into_iter().enumerate() {
        let s = spec(name);
        let replicates = context.replicates(1000, 1000);
        let (found, _) = slopes(s, replicates, |n, r| context.seed_of((part as u64) << 32 | u64::from(n), r));
        for ((integrand, expected), found) in INTEGRANDS.iter().zip(expected).zip(found) {
            tally.near(format!("{name}, {integrand:?}"), found, expected, TOLERANCE);
            worst = worst.max((found - expected).abs());
        }
    }
    tally.saying(format!("30 slopes over n = 16 … 4096, the farthest {worst:.3} from the reference's"))
}

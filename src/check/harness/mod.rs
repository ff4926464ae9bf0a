//! The harness tests itself: how often its tests lie, and what they catch.
//!
//! *Null calibration*: each kind of test is run thousands of times on data for which its hypothesis is true, at a level of
//! 1 %; the share of alarms, with Clopper and Pearson's interval, has to be compatible with 1 %. A level of 10⁻⁹, as tests
//! use it, cannot be tried by running; what can is the whole distribution of p-values, which has to be uniform.
//! *Power*: a bias is planted, and the share of runs that find it compared with what the verdict's own `detects` promises.

mod images;

use crate::sampling::hash::bits64;
use crate::stats::hypothesis::{Family, ks_uniform_test, welch};
use crate::stats::{chi2_test, t_test};

use super::{Check, Context, Finding, Kind, Tally};
use crate::stats::hypothesis::clopper_pearson;

/// The level at which alarms are counted.
const LEVEL: f64 = 0.01;

/// The checks of this group.
pub fn checks() -> Vec<Check> {
    vec![
        Check {
            name: "null-tests",
            group: "harness",
            claim: "t, Welch's, χ² and Kolmogorov–Smirnov's test raise a false alarm 1 % of the time at a level of 1 %",
            failures: &[],
            kind: Kind::Statistical,
            run: null_tests,
        },
        Check {
            name: "null-p-values",
            group: "harness",
            claim: "where the hypothesis is true, p-values are uniform",
            failures: &[],
            kind: Kind::Statistical,
            run: null_p_values,
        },
        Check {
            name: "null-intervals",
            group: "harness",
            claim: "95 % intervals of Clopper and Pearson miss the truth 5 % of the time at most, at every probability",
            failures: &[],
            kind: Kind::Statistical,
            run: null_intervals,
        },
        Check {
            name: "power-of-t",
            group: "harness",
            claim: "a bias of the size that a t test says it detects is found 99 % of the time",
            failures: &[],
            kind: Kind::Statistical,
            run: power_of_t,
        },
        Check {
            name: "null-tiles",
            group: "harness",
            claim: "a renderer against itself under other seeds: some tile differs at most 1 % of the time at a level of 1 %, also where hits are rare",
            failures: &[33],
            kind: Kind::Statistical,
            run: images::null_tiles,
        },
        Check {
            name: "power-of-tiles",
            group: "harness",
            claim: "a bias of 0.1, 1 and 5 % in one tile and everywhere is found as often as its size says",
            failures: &[],
            kind: Kind::Statistical,
            run: images::power_of_tiles,
        },
    ]
}

/// Numbers from a key, in order.
struct Draws {
    key: u64,
    at: u64,
}

impl Draws {
    fn new(key: u64) -> Self {
        Self { key, at: 0 }
    }

    fn uniform(&mut self) -> f64 {
        self.at += 1;
        (bits64(self.key, self.at) >> 11) as f64 * 0.5f64.powi(53)
    }

    /// Standard normal (Box & Muller 1958).
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * libm::log(1.0 - self.uniform())).sqrt();
        radius * libm::cos(std::f64::consts::TAU * self.uniform())
    }

    fn normals(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.normal()).collect()
    }
}

/// Probabilities of the cells in the χ² test: unequal, the least with 5 of 100 draws.
const CELLS: [f64; 6] = [0.05, 0.1, 0.15, 0.2, 0.2, 0.3];

/// The kinds of tests, each on data for which its hypothesis is true: a p-value.
fn p_values(draws: &mut Draws) -> [(&'static str, f64); 4] {
    const ONE: Family = Family { tests: 1, false_alarm: LEVEL };
    let t = t_test(&draws.normals(8), 0.0, ONE);
    let (a, b) = (draws.normals(8), draws.normals(16));
    let spread: Vec<f64> = b.iter().map(|x| 3.0 * x).collect();
    let welch = welch(&a, &spread).map_or(f64::NAN, |w| w.p_two_sided);
    let mut counts = [0; CELLS.len()];
    for _ in 0..100 {
        let u = draws.uniform();
        let mut sum = 0.0;
        let cell = CELLS.iter().position(|p| {
            sum += p;
            u < sum
        });
        counts[cell.unwrap_or(CELLS.len() - 1)] += 1;
    }
    let chi2 = chi2_test(&counts, &CELLS.map(|p| 100.0 * p), ONE);
    let values: Vec<f64> = (0..30).map(|_| draws.uniform()).collect();
    let smirnov = ks_uniform_test(&values, ONE);
    [
        ("t", t.p_value.unwrap_or(f64::NAN)),
        ("Welch", welch),
        ("χ²", chi2.p_value.unwrap_or(f64::NAN)),
        ("Kolmogorov–Smirnov", smirnov.p_value.unwrap_or(f64::NAN)),
    ]
}

/// A share as text: `alarms/runs = share [low, high]`, the interval at 95 %.
fn share(count: u64, runs: u64) -> String {
    let [low, high] = clopper_pearson(count, runs, 0.95);
    format!("{:.4} [{low:.4}, {high:.4}] in {runs} runs", count as f64 / runs as f64)
}

/// χ² and Welch's test are approximations: how far their true rate may be off the nominal one, as a share of it. By 500 000
/// runs each (`check null-tests --budget 3000`) it is 0.95 % for Welch's and 1.04 % for χ², of the data above at 1 %.
const APPROXIMATION: f64 = 0.1;

fn null_tests(context: &Context) -> Finding {
    let runs = u64::from(context.replicates(10_000, 1_000));
    let mut draws = Draws::new(context.seed);
    let mut alarms = [0u64; 4];
    let mut names = [""; 4];
    for _ in 0..runs {
        for (kind, (name, p)) in p_values(&mut draws).into_iter().enumerate() {
            names[kind] = name;
            // A test that gives no p-value has not held.
            alarms[kind] += u64::from(p.is_nan() || p < LEVEL);
        }
    }
    let family = context.family(4);
    let mut tally = Tally::new();
    let mut said = Vec::new();
    for (name, alarms) in names.into_iter().zip(alarms) {
        let within = [LEVEL * (1.0 - APPROXIMATION), LEVEL * (1.0 + APPROXIMATION)];
        let words = format!("{name} {}", share(alarms, runs));
        tally.rate(format!("false alarms at a level of {LEVEL}: {words}"), alarms, runs, within, family);
        said.push(words);
    }
    tally.saying(format!("false alarms at a level of {LEVEL}: {}", said.join(", ")))
}

fn null_p_values(context: &Context) -> Finding {
    // Kolmogorov–Smirnov's own are an upper bound, which is 1 too often: not among them.
    let mut lists = [(); 3].map(|()| Vec::new());
    let mut draws = Draws::new(context.seed);
    let mut names = [""; 3];
    // No more with more effort: χ² and Welch give approximate p-values, whose last percent would be found.
    for _ in 0..context.replicates(3_000, 1_000).min(3_000) {
        for (kind, (name, p)) in p_values(&mut draws).into_iter().take(3).enumerate() {
            names[kind] = name;
            lists[kind].push(p);
        }
    }
    let mut tally = Tally::new();
    let mut said = Vec::new();
    for (name, list) in names.into_iter().zip(&lists) {
        let verdict = ks_uniform_test(list, context.family(3));
        let p = verdict.p_value.unwrap_or(f64::NAN);
        said.push(format!("{name} p = {p:.2}"));
        tally.verdict(format!("p-values of {name}"), &verdict, 1.0);
    }
    tally.saying(format!("uniform by Kolmogorov–Smirnov, {} each: {}", lists[0].len(), said.join(", ")))
}

fn null_intervals(context: &Context) -> Finding {
    const PROBABILITIES: [f64; 4] = [0.002, 0.05, 0.3, 0.98];
    const TRIALS: u64 = 40;
    let runs = u64::from(context.replicates(4_000, 1_000));
    let mut draws = Draws::new(context.seed);
    let family = context.family(PROBABILITIES.len() as u32);
    let mut tally = Tally::new();
    let mut said = Vec::new();
    for p in PROBABILITIES {
        let misses = (0..runs)
            .filter(|_| {
                let successes = (0..TRIALS).filter(|_| draws.uniform() < p).count() as u64;
                let [low, high] = clopper_pearson(successes, TRIALS, 0.95);
                p < low || p > high
            })
            .count() as u64;
        let words = format!("p = {p}: {}", share(misses, runs));
        tally.rate(format!("missed at {words}"), misses, runs, [0.0, 0.05], family);
        said.push(words);
    }
    tally.saying(format!("missed at {}", said.join(", ")))
}

fn power_of_t(context: &Context) -> Finding {
    const N: usize = 16;
    let runs = u64::from(context.replicates(4_000, 1_000));
    let mut draws = Draws::new(context.seed);
    let mut tally = Tally::new();
    let mut said = Vec::new();
    for level in [1e-2, 1e-4] {
        let family = Family { tests: 1, false_alarm: level };
        // What the verdict promises of numbers of standard deviation 1: those that have it are ±√(15/16).
        let unit: Vec<f64> = (0..N).map(|i| [1.0, -1.0][i % 2] * (1.0 - 1.0 / N as f64).sqrt()).collect();
        let Some(bias) = t_test(&unit, 0.0, family).detects else {
            return Finding::broken("a t test says nothing of what it detects".to_owned());
        };
        let found = (0..runs)
            .filter(|_| {
                let values: Vec<f64> = draws.normals(N).into_iter().map(|x| x + bias).collect();
                !t_test(&values, 0.0, family).holds()
            })
            .count() as u64;
        let words = format!("level {level:e}: {}", share(found, runs));
        let what = format!("a bias of the promised size is found at {words}");
        tally.rate(what, found, runs, [0.985, 0.995], context.family(2));
        said.push(words);
    }
    tally.saying(format!("a bias of the promised size is found at {}", said.join(", ")))
}

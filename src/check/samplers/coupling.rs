//! Products across decisions: ∫ f(u) g(v) = ∫ f ∫ g where two decisions are decoupled, something else where they march in
//! step.
//!
//! One value a replicate and pair of coordinates of different decisions (pixel, lens, light pick, light point: 18 pairs):
//! the correlation 12 (a − ½)(b − ½) and its second order 5 B(a) B(b), B(u) = 6u² − 6u + 1, which sees a coupling that is symmetric
//! about ½; and ‖u − v‖² for the three pairs of 2-D decisions, 1/3 if decoupled. What is expected is exact: 0 and 1/3
//! for decoupled decisions, else from the law of each index. A set's mean of these spreads by no more than one sample, so with
//! 4000 seeds a correlation of 0.16 is caught in any of them.

use rayon::prelude::*;

use super::laws::AxisLaw;
use super::reading::{HALF_PLACE, Reader, Tickets};
use super::variance::{cautious, laws};
use crate::check::{Check, Context, Finding, Kind, Tally};
use crate::sampling::{Decision, PointSource, Points, Preset, Random, SamplerSpec};
use crate::stats::hypothesis::{t_test_of_skewed, t_test_of_squares};
use crate::stats::{Verdict, t_test};

/// The checks of couplings.
pub fn checks() -> Vec<Check> {
    let check =
        |name, failures, claim, run| Check { name, group: super::GROUP, claim, failures, kind: Kind::Statistical, run };
    vec![
        check(
            "best-presets-decouple-decisions",
            &[],
            "under every :best preset products of two decisions integrate to the product of their integrals",
            best,
        ),
        check(
            "sheet-presets-march-in-step",
            &[10],
            "under the sheet's presets ‖u−v‖² of two decisions has wrong limits: stratified 0, halton 0, hammersley 1/6, and light pick marches with the light point",
            in_step,
        ),
        check(
            "sheet-ld-stalls",
            &[10],
            "ld:sheet is right on average, but one pixel's ‖u−v‖² keeps a spread of 0.18 at any n",
            ld_stalls,
        ),
    ]
}

/// The coordinates of one sample: pixel x y, lens x y, light pick, light point x y.
const COORDINATES: usize = 7;
const NAMES: [&str; COORDINATES] = ["pixel x", "pixel y", "lens x", "lens y", "pick", "light x", "light y"];
/// The decision of each.
const OF: [Decision; COORDINATES] = [
    Decision::Pixel,
    Decision::Pixel,
    Decision::Lens,
    Decision::Lens,
    Decision::LightPick,
    Decision::LightPoint,
    Decision::LightPoint,
];
/// First coordinates of the pairs of 2-D decisions.
const TWO_D: [(usize, usize); 3] = [(0, 2), (0, 5), (2, 5)];

/// Pairs of coordinates of different decisions.
pub fn pairs() -> Vec<(usize, usize)> {
    (0..COORDINATES).flat_map(|a| (a + 1..COORDINATES).map(move |b| (a, b))).filter(|&(a, b)| OF[a] != OF[b]).collect()
}

/// Means over one set: first-order and second-order correlations of [`pairs`], and three mean squared distances.
#[derive(Debug, Clone, PartialEq)]
pub struct Products {
    /// 12 (a − ½)(b − ½), a pair each.
    pub first: Vec<f64>,
    /// 5 B(a) B(b), a pair each.
    pub second: Vec<f64>,
    /// ‖u − v‖² of pixel and lens, pixel and light point, lens and light point.
    pub distance: [f64; 3],
}

/// The sampler's numbers of one seed, coordinate by coordinate.
fn columns(reader: &mut Reader, tickets: &Tickets, seed: u64) -> [Vec<f64>; COORDINATES] {
    let n = reader.sampler.samples() as usize;
    let mut columns: [Vec<f64>; COORDINATES] = std::array::from_fn(|_| Vec::with_capacity(n));
    for (at, dim) in [(0, &tickets.pixel), (2, &tickets.lens), (5, &tickets.light)] {
        for [x, y] in reader.pairs(seed, dim) {
            columns[at].push(x);
            columns[at + 1].push(y);
        }
    }
    columns[4].extend(reader.numbers(seed, &tickets.pick));
    columns
}

/// Products of one set.
pub fn products(reader: &mut Reader, tickets: &Tickets, seed: u64) -> Products {
    let columns = columns(reader, tickets, seed);
    let n = columns[0].len() as f64;
    let first = columns.each_ref().map(|c| c.iter().map(|u| u - 0.5).collect::<Vec<_>>());
    let second = columns.each_ref().map(|c| c.iter().map(|u| 6.0 * u * (u - 1.0) + 1.0).collect::<Vec<_>>());
    let mean = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / n;
    let gap = |a: usize, b: usize| columns[a].iter().zip(&columns[b]).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / n;
    Products {
        first: pairs().into_iter().map(|(a, b)| 12.0 * mean(&first[a], &first[b])).collect(),
        second: pairs().into_iter().map(|(a, b)| 5.0 * mean(&second[a], &second[b])).collect(),
        distance: TWO_D.map(|(a, b)| gap(a, b) + gap(a + 1, b + 1)),
    }
}

fn replicated(s: SamplerSpec, n: u32, seeds: u32, context: &Context, part: u64) -> Vec<Products> {
    let tickets = Tickets::new();
    let mut reader = Reader::new(s, &tickets, n);
    (0..u64::from(seeds)).map(|r| products(&mut reader, &tickets, context.seed_of(part, r))).collect()
}

fn presets(preset: Preset) -> impl Iterator<Item = SamplerSpec> {
    Points::ALL.iter().filter(|&&p| p != Points::Center).filter_map(move |&p| preset.of(p))
}

fn best(context: &Context) -> Finding {
    let jobs: Vec<(SamplerSpec, u32)> = presets(Preset::Best).flat_map(|s| [4, 16].map(|n| (s, n))).collect();
    let tests = (2 * pairs().len() + 3) * jobs.len();
    // Products of uniform numbers lean by less than squares of errors do.
    let family = cautious(context.family(tests as u32));
    let seeds = context.replicates(4000, 2000);
    let judged: Vec<Vec<(String, Verdict, f64)>> = jobs
        .par_iter()
        .enumerate()
        .map(|(part, &(s, n))| {
            let all = replicated(s, n, seeds, context, part as u64);
            let test = |value: &dyn Fn(&Products) -> f64, exact| {
                t_test(&all.iter().map(value).collect::<Vec<_>>(), exact, family)
            };
            let mut judged = Vec::new();
            for (k, (a, b)) in pairs().into_iter().enumerate() {
                let what = format!("{s}, n = {n}, {} with {}", NAMES[a], NAMES[b]);
                judged.push((what.clone(), test(&|p| p.first[k], 0.0), 1.0));
                judged.push((format!("{what}, second order"), test(&|p| p.second[k], 0.0), 1.0));
            }
            for (k, (a, b)) in TWO_D.into_iter().enumerate() {
                let what = format!("{s}, n = {n}, ‖{} − {}‖²", OF[a].name(), OF[b].name());
                judged.push((what, test(&|p| p.distance[k], 1.0 / 3.0), 1.0 / 3.0));
            }
            judged
        })
        .collect();
    let mut tally = Tally::new();
    for (what, verdict, scale) in judged.iter().flatten() {
        tally.verdict(what.as_str(), verdict, *scale);
    }
    tally.finish()
}

/// E of first-order correlations and of distances where indices march in step: each index has its own law on each axis, and
/// decisions have keys of their own, so E ab is the product of two means.
struct InStep {
    first: Vec<f64>,
    distance: [f64; 3],
}

fn exact_in_step(s: SamplerSpec, tickets: &Tickets, n: u32) -> InStep {
    let axes: Vec<AxisLaw> = [Decision::Pixel, Decision::Lens, Decision::LightPick, Decision::LightPoint]
        .into_iter()
        .flat_map(|d| laws(s, tickets, d, n))
        .collect();
    let over = |value: &dyn Fn(usize) -> f64| (0..n as usize).map(value).sum::<f64>() / f64::from(n);
    let product = |a: usize, b: usize| over(&|i| (axes[a].single(i).x - 0.5) * (axes[b].single(i).x - 0.5));
    let gap = |a: usize, b: usize| {
        over(&|i| axes[a].pair(i, i).x + axes[b].pair(i, i).x - 2.0 * axes[a].single(i).x * axes[b].single(i).x)
    };
    InStep {
        first: pairs().into_iter().map(|(a, b)| 12.0 * product(a, b)).collect(),
        distance: TWO_D.map(|(a, b)| gap(a, b) + gap(a + 1, b + 1)),
    }
}

fn in_step(context: &Context) -> Finding {
    let tickets = Tickets::new();
    let specs: Vec<SamplerSpec> = presets(Preset::Sheet).chain(presets(Preset::Plain)).collect();
    let n = 64;
    let tests = ((pairs().len() + 3) * specs.len()) as u32;
    let family = cautious(context.family(tests));
    let mut tally = Tally::new();
    let mut said = Vec::new();
    for (part, s) in specs.into_iter().enumerate() {
        let exact = exact_in_step(s, &tickets, n);
        let all = replicated(s, n, context.replicates(4000, 2000), context, part as u64);
        let mut test = |what: String, value: &dyn Fn(&Products) -> f64, exact: f64, scale: f64| {
            let values: Vec<f64> = all.iter().map(value).collect();
            // Where nothing varies, floats are off by half a place and a product of them by 12 of those.
            let settled = values.iter().all(|v| (v - exact).abs() < 24.0 * HALF_PLACE);
            let values = if settled { vec![exact; 2] } else { values };
            tally.verdict(what, &t_test(&values, exact, family), scale);
        };
        for (k, (a, b)) in pairs().into_iter().enumerate() {
            test(format!("{s}, {} with {}", NAMES[a], NAMES[b]), &|p| p.first[k], exact.first[k], 1.0);
        }
        for (k, (a, b)) in TWO_D.into_iter().enumerate() {
            let what = format!("{s}, ‖{} − {}‖²", OF[a].name(), OF[b].name());
            test(what, &|p| p.distance[k], exact.distance[k], 1.0 / 3.0);
        }
        // The laws' numbers, by their closed forms.
        let limit = match (s.points, s.random) {
            (_, Random::None) => 0.0,
            (Points::Stratified, _) => 1.0 / f64::from(3 * n),
            (Points::Hammersley, _) => 1.0 / 6.0,
            _ => 1.0 / 3.0,
        };
        for (k, found) in exact.distance.into_iter().enumerate() {
            tally.near(format!("{s}, ‖u−v‖² of pair {k} in the limit"), found, limit, 1e-12);
        }
        if s.points == Points::Stratified {
            let k = pairs().iter().position(|&p| p == (4, 6)).expect("pick with light y");
            tally.fact(format!("{s}: the pick marches with light y, {:.3}", exact.first[k]), exact.first[k] > 0.9);
        }
        let coupled = exact.first.iter().filter(|c| c.abs() > 0.5).count();
        if s.random != Random::Fresh {
            said.push(format!("{s} {:.3} ({coupled} of 18 pairs coupled)", exact.distance[0]));
        }
    }
    tally.saying(format!("‖u−v‖² at n = 64, 1/3 if decoupled: {}", said.join(", ")))
}

/// With z uniform and c the exclusive or of two random words, z − z⊕c = Σ ±c_k 2⁻ᵏ, whose mean square over a net of 2ᵐ is
/// Σ_{k≤m} c_k 4⁻ᵏ plus the square of what the digits below m leave: mean 1/6 an axis, variance 1/60 + 16⁻ᵐ/45.
fn ld_stalls(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let family = context.family(4);
    let mut said = Vec::new();
    for (m, seeds) in [(4u32, 8000), (8, 4000)] {
        let spec = super::reading::spec("ld:sheet");
        let all = replicated(spec, 1 << m, context.replicates(seeds, 2000), context, u64::from(m));
        let errors: Vec<f64> = all.iter().map(|p| p.distance[2] - 1.0 / 3.0).collect();
        let squares: Vec<f64> = errors.iter().map(|e| e * e).collect();
        let variance = 2.0 * (1.0 / 60.0 + libm::exp2(-4.0 * f64::from(m)) / 45.0);
        tally.verdict(format!("n = {}, mean", 1 << m), &t_test_of_skewed(&errors, 0.0, family), 1.0 / 3.0);
        tally.verdict(format!("n = {}, variance", 1 << m), &t_test_of_squares(&squares, variance, family), variance);
        let spread = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        said.push(format!("{spread:.3} at n = {}", 1 << m));
    }
    tally.saying(format!("spread of one pixel's ‖u−v‖² about 1/3: {}", said.join(", ")))
}

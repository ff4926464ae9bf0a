//! Each single number over many seeds: uniform where the sampler says so, and in its place where it does not.
//!
//! One index of one decision is fixed and the seed varies, so the values are independent whatever the set. Every index of a
//! set of 13 (15 strata) is tested in the pixel's, the light pick's and the light point's decision, of every legal sampler:
//!
//! - χ² of the pair on 8 × 8 cells, and again on the numbers 2⁹ times enlarged modulo 1, which a wrong bit order, missing low
//!   bits or a key shared by both axes leave uneven; the light pick on 16 cells. Both tails: too even a χ² is a key
//!   that follows the seed instead of being mixed from it.
//! - Kolmogorov–Smirnov of each coordinate of the first, a middle and the last index.
//!
//! Which law is expected of an index (METHODS §7):
//!
//! | sampler | a pair of index i |
//! |---|---|
//! | `fresh xor shift owen digits`, shuffled `jitter` | uniform on the square |
//! | `step:jitter` | uniform in its own cell, and never outside |
//! | `none` | always the same |
//! | shuffled `none` | one of the n pairs of the set, equally often |
//! | `yxor` | x as `none`, y uniform |
//!
//! With 25 expected counts a cell, χ² has a heavier upper tail than its limit. By exact convolution of 64 cells with Poisson's
//! counts, (k − 25)²/25 each, beyond the point that χ² passes once in 10⁹ the sum comes 4.8 times as often, once in 10¹¹ 9 times, once in
//! 10¹⁴ 28 times (of 16 cells with 100 counts 12 times); the levels of these tests lie above 10⁻¹⁴, and a fortieth of the
//! rate pays for it. At 1600 seeds a cell whose probability is off by 1.3 of itself is caught, or a distribution
//! function off by 0.12.

use rayon::prelude::*;

use super::laws::AxisLaw;
use super::reading::{HALF_PLACE, Reader, Tickets, numbered_specs};
use super::variance::laws;
use crate::check::{Check, Context, Finding, Kind, Tally};
use crate::sampling::{Decision, Order, SamplerSpec};
use crate::stats::hypothesis::{Outcome, chi2_test, ks_uniform_test};
use crate::stats::{Family, Verdict};

/// The checks of marginals.
pub fn checks() -> Vec<Check> {
    let check =
        |name, claim, run| Check { name, group: super::GROUP, claim, failures: &[], kind: Kind::Statistical, run };
    vec![
        check(
            "each-index-is-uniform",
            "each number of a randomised set is uniform over seeds, at every index, in every decision",
            |c| certify(c, SamplerSpec::is_uniform_marginally),
        ),
        check(
            "exempt-indices-keep-their-place",
            "what is exempt is not uniform: strata in step stay in their cells, unrandomised points where they are, the x of yxor at i/n",
            |c| certify(c, |s| !s.is_uniform_marginally()),
        ),
    ]
}

/// Points asked for: no power of two, so that permutations walk.
const ASKED: u32 = 13;
const SEEDS: u32 = 1600;

/// What a number of one index is over all seeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Marginal {
    /// Uniform on [0, 1).
    Uniform,
    /// Uniform on [low, low + width).
    Cell {
        /// Lower border.
        low: f64,
        /// Width.
        width: f64,
    },
    /// This number, always.
    Always(f64),
    /// One of the n numbers of a fixed axis.
    AnyOf,
}

/// The marginal law of `index`, from the law of its axis and the order.
pub fn marginal(order: Order, law: &AxisLaw, index: usize) -> Marginal {
    match (law, order) {
        (AxisLaw::Fixed(_), Order::Shuffle) => Marginal::AnyOf,
        (AxisLaw::Strata { .. }, Order::Shuffle) => Marginal::Uniform,
        (AxisLaw::Fixed(points), _) => Marginal::Always(points[index]),
        (AxisLaw::Strata { cell, cells }, _) => {
            let width = 1.0 / f64::from(*cells);
            Marginal::Cell { low: f64::from(cell[index]) * width, width }
        }
        _ => Marginal::Uniform,
    }
}

/// χ² with both tails: twice the smaller one.
fn chi2_two_sided(observed: &[u64], family: Family) -> Verdict {
    let total: u64 = observed.iter().sum();
    let expected = vec![total as f64 / observed.len() as f64; observed.len()];
    let upper = chi2_test(observed, &expected, family);
    match (upper.outcome, upper.p_value) {
        (Outcome::Tested, Some(p)) => Verdict { p_value: Some((2.0 * p.min(1.0 - p)).min(1.0)), ..upper },
        _ => upper,
    }
}

fn counts(cells: usize, values: impl Iterator<Item = usize>) -> Vec<u64> {
    let mut counts = vec![0; cells];
    values.for_each(|cell| counts[cell] += 1);
    counts
}

fn bin(u: f64, bins: usize) -> usize {
    ((u * bins as f64) as usize).min(bins - 1)
}

/// Results of one decision of one sampler: tests, and facts.
#[derive(Default)]
struct Found {
    verdicts: Vec<(String, Verdict)>,
    facts: Vec<(String, bool)>,
}

/// The numbers that each index gives, in its own units: uniform on [0, 1) where it is random in a place.
struct Column {
    values: Vec<f64>,
    law: Marginal,
}

fn read(
    spec: SamplerSpec,
    tickets: &Tickets,
    decision: Decision,
    seeds: impl Iterator<Item = u64>,
) -> Vec<Vec<Column>> {
    let n = spec.taken(ASKED);
    let laws = laws(spec, tickets, decision, n);
    // The sheet's strata on a line come in step.
    let order = if decision == Decision::LightPick && spec.sheet_1d { Order::Step } else { spec.order };
    let mut columns: Vec<Vec<Column>> = laws
        .iter()
        .map(|law| (0..n as usize).map(|i| Column { values: Vec::new(), law: marginal(order, law, i) }).collect())
        .collect();
    let mut reader = Reader::new(spec, tickets, ASKED);
    let mut put = |axis: usize, i: usize, u: f64| columns[axis][i].values.push(u);
    for seed in seeds {
        match decision {
            Decision::LightPick => reader.numbers(seed, &tickets.pick).enumerate().for_each(|(i, u)| put(0, i, u)),
            two_d => reader.pairs(seed, tickets.two_d(two_d)).enumerate().for_each(|(i, [x, y])| {
                put(0, i, x);
                put(1, i, y);
            }),
        }
    }
    columns
}

/// Turns numbers in a cell into numbers on [0, 1), and says whether all were in it.
fn into_unit(column: &mut Column) -> bool {
    let Marginal::Cell { low, width } = column.law else { return true };
    let inside = column.values.iter().all(|u| (low - HALF_PLACE..=low + width + HALF_PLACE).contains(u));
    for u in &mut column.values {
        *u = ((*u - low) / width).clamp(0.0, 1.0 - f64::EPSILON);
    }
    inside
}

fn judge(what: &str, mut axes: Vec<Vec<Column>>, fixed: &[AxisLaw], family: Family) -> Found {
    let mut found = Found::default();
    let n = axes[0].len();
    for index in 0..n {
        let mut random: Vec<&Vec<f64>> = Vec::new();
        for axis in axes.iter_mut() {
            let inside = into_unit(&mut axis[index]);
            found.facts.push((format!("{what}: index {index} stays in its place"), inside));
        }
        for (axis, columns) in axes.iter().enumerate() {
            let column = &columns[index];
            let what = format!("{what}: axis {axis} of index {index}");
            match column.law {
                Marginal::Uniform | Marginal::Cell { .. } => random.push(&column.values),
                Marginal::Always(u) => {
                    let same = column.values.iter().all(|v| (v - u).abs() <= 2.0 * HALF_PLACE);
                    found.facts.push((format!("{what} is always {u}"), same));
                }
                Marginal::AnyOf => {
                    let AxisLaw::Fixed(points) = &fixed[axis] else {
                        unreachable!("only a fixed axis is shuffled whole")
                    };
                    let near = |v: &f64| points.iter().position(|p| (v - p).abs() <= 2.0 * HALF_PLACE);
                    let places: Vec<Option<usize>> = column.values.iter().map(near).collect();
                    found.facts.push((format!("{what} is a point of the set"), places.iter().all(Option::is_some)));
                    let verdict = chi2_two_sided(&counts(n, places.into_iter().flatten()), family);
                    found.verdicts.push((format!("{what}: each point equally often"), verdict));
                }
            }
            let edge = [0, n / 2, n - 1].contains(&index);
            if edge && matches!(column.law, Marginal::Uniform | Marginal::Cell { .. }) {
                found.verdicts.push((format!("{what}, KS"), ks_uniform_test(&column.values, family)));
            }
        }
        for (part, scale) in [("high bits", 1.0), ("low bits", 512.0)] {
            let place = |u: &f64, bins: usize| bin((u * scale).fract(), bins);
            let counted = match random[..] {
                [] => continue,
                [line] => counts(16, line.iter().map(|u| place(u, 16))),
                [x, y, ..] => counts(64, x.iter().zip(y).map(|(x, y)| place(x, 8) * 8 + place(y, 8))),
            };
            found.verdicts.push((format!("{what}: index {index}, {part}, χ²"), chi2_two_sided(&counted, family)));
        }
    }
    found
}

fn certify(context: &Context, wanted: fn(&SamplerSpec) -> bool) -> Finding {
    let tickets = Tickets::new();
    let jobs: Vec<(SamplerSpec, Decision)> = numbered_specs()
        .into_iter()
        .filter(wanted)
        .flat_map(|s| [Decision::Pixel, Decision::LightPick, Decision::LightPoint].map(|d| (s, d)))
        .collect();
    // At most: for each index χ² on high and low bits and each point of a shuffled set on two axes; six KS.
    let tests = jobs.iter().map(|(s, _)| 4 * s.taken(ASKED) + 6).sum();
    let family = context.family(tests);
    let family = Family { false_alarm: family.false_alarm / 40.0, ..family };
    let seeds = u64::from(context.replicates(SEEDS, SEEDS));
    let found: Vec<Found> = jobs
        .par_iter()
        .enumerate()
        .map(|(part, &(s, decision))| {
            let columns = read(s, &tickets, decision, (0..seeds).map(|r| context.seed_of(part as u64, r)));
            let fixed = laws(s, &tickets, decision, s.taken(ASKED));
            judge(&format!("{s}, {}", decision.name()), columns, &fixed, family)
        })
        .collect();
    let mut tally = Tally::new();
    for found in found {
        found.verdicts.iter().for_each(|(what, verdict)| _ = tally.verdict(what.as_str(), verdict, 1.0));
        found.facts.into_iter().for_each(|(what, holds)| _ = tally.fact(what, holds));
    }
    tally.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::hash::{bits32, unit_f32};

    #[test]
    fn what_is_not_uniform_is_said_to_be_so() {
        let tickets = Tickets::new();
        for s in numbered_specs() {
            let law = &laws(s, &tickets, Decision::Pixel, s.taken(ASKED));
            let uniform = law.iter().all(|law| marginal(s.order, law, 3) == Marginal::Uniform);
            assert_eq!(uniform, s.is_uniform_marginally(), "{s}");
        }
    }

    #[test]
    fn too_even_counts_fail_as_uneven_ones_do() {
        let family = Family { tests: 1, false_alarm: 1e-6 };
        assert!(!chi2_two_sided(&[25; 64], family).holds());
        let uneven: Vec<u64> = (0..64).map(|i| if i % 2 == 0 { 45 } else { 5 }).collect();
        assert!(!chi2_two_sided(&uneven, family).holds());
        let usual: Vec<u64> = (0..64).map(|i| [20, 30][i % 2]).collect();
        assert!(chi2_two_sided(&usual, family).holds());
    }

    /// Each alone is uniform: one key for both axes, a missing low bit, a number that leaves its cell.
    #[test]
    fn coupled_axes_missing_bits_and_strays_are_found() {
        let family = Family { tests: 1000, false_alarm: 1e-8 };
        let uniform: Vec<f64> = (0..1600).map(|i| f64::from(unit_f32(bits32(7, i)))).collect();
        let other: Vec<f64> = (0..1600).map(|i| f64::from(unit_f32(bits32(8, i)))).collect();
        let column = |values: &[f64], law| vec![Column { values: values.to_vec(), law }];
        let fails = |axes: Vec<Vec<Column>>| {
            let found = judge("test", axes, &[], family);
            found.verdicts.iter().any(|(_, v)| !v.holds()) || found.facts.iter().any(|(_, holds)| !holds)
        };
        let free = Marginal::Uniform;
        assert!(!fails(vec![column(&uniform, free), column(&other, free)]));
        assert!(fails(vec![column(&uniform, free), column(&uniform, free)]), "one key");
        let coarse: Vec<f64> = uniform.iter().map(|u| (u * 1024.0).floor() / 1024.0).collect();
        assert!(fails(vec![column(&coarse, free), column(&other, free)]), "ten bits");
        assert!(fails(vec![column(&uniform, Marginal::Cell { low: 0.0, width: 0.999 })]), "a stray");
        assert!(fails(vec![column(&uniform, Marginal::Always(0.5))]), "not constant");
    }
}

//! Do the numbers of a scene's decisions belong together in ways that independent numbers do not?
//!
//! For coordinates u and v of two decisions (or the two of one) and f with mean 0 and mean square 1, q = mean over a pixel's
//! samples of f(u) f(v). Independent numbers have E q = 0 and E q² = 1/n; two sets in an order of their own, at most
//! 1/(n − 1). Two functions: √12 (u − ½) and √2 cos 2πu.

use std::f64::consts::{PI, SQRT_2};

use crate::sampling::hash::derive;
use crate::sampling::{Decision, Dim1, Dim2, PixelKey, PointSource, SampleLayout, Sampler, SamplerSet};
use crate::stats::hypothesis::{Verdict, sidak, two_sided};
use crate::stats::{Family, Moments, t_test};

/// Most samples of a pixel that are looked at, the first ones.
const MOST: u32 = 1 << 14;

/// The right to read a decision's numbers.
enum Ticket {
    One(Dim1),
    Two(Dim2),
}

/// By replicate and function: q, and the correlation within the set.
type Products = Vec<[[f64; 2]; 2]>;

/// Two decisions whose numbers were looked at together.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// The decisions; the same twice for the two coordinates of one.
    pub decisions: [Decision; 2],
    /// E q with the largest magnitude among coordinates and functions: a correlation, in [−1, 1] for u = v.
    pub correlation: f64,
    /// The largest n E q²: 1 for independent numbers, n for equal ones.
    pub spread: f64,
    /// The smallest p-value of its means and spreads, times the number of all pairs' tests (Bonferroni).
    pub p: f64,
    /// Whether a mean or a spread is further out than independent numbers would be, at the family's level.
    pub is_coupled: bool,
}

/// Looks at every pair of a layout's decisions; `level`: the chance that any is called coupled where none is.
pub fn pairs(set: SamplerSet, layout: &SampleLayout, spp: u32, seed: u64, replicates: u32, level: f64) -> Vec<Pair> {
    let mut own = SampleLayout::default();
    let tickets: Vec<(Decision, Ticket)> = layout
        .claims()
        .iter()
        .map(|claim| {
            let ticket = match claim.count {
                1 => Ticket::One(own.claim_1d(claim.decision)),
                _ => Ticket::Two(own.claim_2d(claim.decision)),
            };
            (claim.decision, ticket)
        })
        .collect();
    let mut together: Vec<([usize; 2], Products)> = Vec::new();
    let mut owners: Vec<Decision> = Vec::new();
    let mut n = 1;
    for replicate in 0..replicates {
        let sampler = Sampler::new(set, &own, spp, derive(seed, &[u64::from(replicate)])).expect("as rendered before");
        n = sampler.samples().min(MOST);
        let columns = columns(&sampler, &tickets, n, PixelKey::new(replicate % 61, replicate / 61));
        if owners.is_empty() {
            owners = columns.iter().map(|(decision, _)| *decision).collect();
            let all = (0..owners.len()).flat_map(|a| (0..a).map(move |b| ([b, a], Vec::new())));
            together = all.collect();
        }
        let functions: Vec<[Vec<f64>; 2]> = columns.iter().map(|(_, values)| functions(values)).collect();
        for ([a, b], list) in &mut together {
            list.push([0, 1].map(|f| {
                let (u, v) = (&functions[*a][f], &functions[*b][f]);
                [product(u, v), pearson(u, v)]
            }));
        }
    }
    // A mean and a spread of each function of each pair.
    let tests = (4 * together.len()).max(1);
    let each = sidak(level, tests as u64);
    let mut pairs: Vec<Pair> = Vec::new();
    for ([a, b], list) in together {
        let decisions = [owners[a], owners[b]];
        let place = pairs.iter().position(|p| p.decisions == decisions).unwrap_or_else(|| {
            pairs.push(Pair { decisions, correlation: 0.0, spread: 0.0, p: 1.0, is_coupled: false });
            pairs.len() - 1
        });
        for function in 0..2 {
            let values: Vec<f64> = list.iter().map(|q| q[function][0]).collect();
            let pearson = list.first().map_or(0.0, |q| q[function][1]);
            pairs[place].take(&values, pearson, n, each);
        }
    }
    for pair in &mut pairs {
        pair.p = (pair.p * tests as f64).min(1.0);
    }
    pairs
}

impl Pair {
    /// Adds the q of one pair of coordinates and one function; `pearson` is the correlation within the first set.
    fn take(&mut self, values: &[f64], pearson: f64, n: u32, level: f64) {
        let moments: Moments = values.iter().copied().collect();
        let mean = moments.mean().unwrap_or(0.0);
        let squares: Vec<f64> = values.iter().map(|q| q * q * f64::from(n)).collect();
        let spread = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
        if mean.abs() > self.correlation.abs() {
            self.correlation = mean;
        }
        self.spread = self.spread.max(spread);
        let family = Family { tests: 1, false_alarm: level };
        let p = if moments.variance().unwrap_or(0.0) == 0.0 {
            // One set for all seeds: as far out as independent normal numbers are once in 1/level times.
            let df = f64::from(n) - 2.0;
            let t = pearson * (df / (1.0 - pearson * pearson).max(f64::MIN_POSITIVE)).sqrt();
            if n > 2 { two_sided(t, df) } else { 1.0 }
        } else {
            let bound = f64::from(n) / f64::from(n.max(2) - 1);
            let rises = n > 1 && spread > bound;
            let of = |verdict: Verdict| match verdict.holds() {
                true => verdict.p_value.unwrap_or(1.0),
                false => verdict.p_value.unwrap_or(0.0),
            };
            let spread = if rises { of(t_test(&squares, bound, family)) } else { 1.0 };
            of(t_test(values, 0.0, family)).min(spread)
        };
        self.p = self.p.min(p);
        self.is_coupled |= p < level;
    }
}

/// The coordinates of all decisions of one pixel.
fn columns(sampler: &Sampler, tickets: &[(Decision, Ticket)], n: u32, pixel: PixelKey) -> Vec<(Decision, Vec<f32>)> {
    let mut columns = Vec::new();
    for (decision, ticket) in tickets {
        let (mut x, mut y) = (vec![0.0; n as usize], vec![0.0; n as usize]);
        match ticket {
            Ticket::One(dim) => sampler.fill_1d(pixel, 0, dim, &mut x),
            Ticket::Two(dim) => sampler.fill_2d(pixel, 0, dim, &mut x, &mut y),
        }
        columns.push((*decision, x));
        if let Ticket::Two(_) = ticket {
            columns.push((*decision, y));
        }
    }
    columns
}

fn functions(values: &[f32]) -> [Vec<f64>; 2] {
    let of = |f: fn(f64) -> f64| values.iter().map(|&u| f(f64::from(u))).collect();
    [of(|u| 12.0_f64.sqrt() * (u - 0.5)), of(|u| SQRT_2 * libm::cos(2.0 * PI * u))]
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / a.len() as f64
}

/// Correlation within one set.
fn pearson(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let (mean_a, mean_b) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let of = |x: &[f64], p: f64, y: &[f64], q: f64| x.iter().zip(y).map(|(x, y)| (x - p) * (y - q)).sum::<f64>();
    let scale = (of(a, mean_a, a, mean_a) * of(b, mean_b, b, mean_b)).sqrt();
    if scale > 0.0 { (of(a, mean_a, b, mean_b) / scale).clamp(-1.0, 1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Preset;

    /// Every preset on a layout with all decisions, false alarms 1e-9 each: sheets are in step, the best are not.
    #[test]
    fn sheets_are_coupled_and_the_best_are_not() {
        let mut layout = SampleLayout::default();
        let _tickets = (
            layout.claim_2d(Decision::Pixel),
            layout.claim_2d(Decision::Lens),
            layout.claim_1d(Decision::LightPick),
            layout.claim_2d(Decision::LightPoint),
        );
        let coupled = |text: &str| {
            let set = SamplerSet::parse(text, Preset::Best).unwrap();
            pairs(set, &layout, 26, 7, 200, 1e-9).into_iter().filter(|p| p.is_coupled).collect::<Vec<_>>()
        };
        for name in ["uniform", "stratified", "halton", "hammersley", "ld", "sobol"] {
            assert_eq!(coupled(name), [], "{name}");
        }
        for name in ["stratified:sheet", "halton:sheet", "hammersley:sheet", "ld:sheet"] {
            let found = coupled(name);
            assert!(found.iter().any(|p| p.decisions == [Decision::Pixel, Decision::Lens]), "{name}: {found:?}");
        }
    }
}

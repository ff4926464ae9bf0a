//! Exact star discrepancy above the plane: branch and bound over boxes of corners.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use super::Points;
use super::plane::sweep;
use super::star::{CostTooHigh, Largest, Side, Star, grid, sweep_steps};

/// Parts split together, on as many threads as there are; fixed, so that the search does not depend on the threads.
const BATCH: usize = 32;

/// A set of corners q: on every outer axis those between two positions of the critical grid, both included; on the last
/// two axes all.
#[derive(Debug, Clone)]
struct Part {
    /// No corner of the part has a larger gap, as n times the discrepancy.
    bound: f64,
    side: Side,
    /// First and last position, axis by axis.
    range: Vec<(u32, u32)>,
    /// The inner two coordinates at which the bound is reached.
    inner: [f64; 2],
}

impl Part {
    fn is_corner(&self) -> bool {
        self.range.iter().all(|(first, last)| first == last)
    }
}

/// By bound; equal bounds by their place, so that the order is the same every time.
impl Ord for Part {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound).then_with(|| self.range.cmp(&other.range))
    }
}

impl PartialOrd for Part {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Part {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Part {}

/// The points, and what every part needs of them.
struct Search<'a> {
    points: Vec<&'a [f64]>,
    /// Critical grid of each outer axis.
    grids: Vec<Vec<f64>>,
    /// Numbers of the points by rising last coordinate but one, and by rising last coordinate.
    by_x: Vec<u32>,
    by_y: Vec<u32>,
}

impl<'a> Search<'a> {
    fn new(points: &'a Points) -> Self {
        let outer = points.dimension() - 2;
        let order = |axis: usize| {
            let coordinates = points.axis(axis);
            let mut order: Vec<u32> = (0..).take(points.n()).collect();
            order.sort_by_key(|i| coordinates[*i as usize].to_bits());
            order
        };
        Self {
            points: points.iter().collect(),
            grids: (0..outer).map(|k| grid(&points.axis(k))).collect(),
            by_x: order(outer),
            by_y: order(outer + 1),
        }
    }

    /// Bounds the gaps of a part: for open boxes by the volume at its last corner and the points inside its first, for
    /// closed ones the other way round. For a single corner that is its largest gap.
    fn bounded(&self, side: Side, range: Vec<(u32, u32)>) -> Part {
        let outer = range.len();
        let at = |k: usize, position: u32| self.grids[k][position as usize];
        let volume: f64 = (0..outer).map(|k| at(k, if side == Side::Open { range[k].1 } else { range[k].0 })).product();
        let inside = |p: &[f64]| {
            (0..outer).all(|k| if side == Side::Open { p[k] < at(k, range[k].0) } else { p[k] <= at(k, range[k].1) })
        };
        let kept: Vec<bool> = self.points.iter().map(|p| inside(p)).collect();
        let mut ys: Vec<f64> = Vec::new();
        let mut position = vec![0; kept.len()];
        for i in self.by_y.iter().map(|i| *i as usize).filter(|i| kept[*i]) {
            let y = self.points[i][outer + 1];
            if ys.last() != Some(&y) {
                ys.push(y);
            }
            position[i] = ys.len() - 1;
        }
        if ys.last() != Some(&1.0) {
            ys.push(1.0);
        }
        let by_x = self.by_x.iter().map(|i| *i as usize).filter(|i| kept[*i]);
        let by_x: Vec<(f64, usize)> = by_x.map(|i| (self.points[i][outer], position[i])).collect();
        let peak = sweep(side, self.points.len() as f64 * volume, &by_x, &ys);
        Part { bound: peak.gap, side, range, inner: [peak.x, peak.y] }
    }

    /// The gap of one box, counted.
    fn gap(&self, side: Side, corner: &[f64]) -> f64 {
        let inside = |p: &&&[f64]| p.iter().zip(corner).all(|(x, q)| if side == Side::Open { x < q } else { x <= q });
        let count = self.points.iter().filter(inside).count() as f64;
        let expected = self.points.len() as f64 * corner.iter().product::<f64>();
        if side == Side::Open { expected - count } else { count - expected }
    }

    /// A corner of the part: its last on the outer axes for open boxes, its first for closed ones.
    fn corner(&self, part: &Part) -> Vec<f64> {
        let end = |k: usize| if part.side == Side::Open { part.range[k].1 } else { part.range[k].0 };
        (0..part.range.len()).map(|k| self.grids[k][end(k) as usize]).chain(part.inner).collect()
    }

    /// The two halves of a part, cut across the axis with most positions.
    fn halves(&self, part: &Part) -> [Part; 2] {
        let widest = (0..part.range.len()).max_by_key(|k| part.range[*k].1 - part.range[*k].0).unwrap_or(0);
        let (first, last) = part.range[widest];
        let middle = first + (last - first) / 2;
        [(first, middle), (middle + 1, last)].map(|half| {
            let mut range = part.range.clone();
            range[widest] = half;
            self.bounded(part.side, range)
        })
    }
}

/// Exact star discrepancy in three or more dimensions, in at most `limit` steps.
///
/// Parts are split in the order of their bounds, so only those are that may hold a larger gap than D* itself; what is
/// left at the end is a corner whose gap no bound exceeds. `cost` is what the error tells.
pub fn star_bounded(points: &Points, cost: f64, limit: f64) -> Result<Star, CostTooHigh> {
    let search = Search::new(points);
    let n = points.n() as f64;
    let whole: Vec<(u32, u32)> = search.grids.iter().map(|g| (0, g.len() as u32 - 1)).collect();
    let mut open_parts: BinaryHeap<Part> =
        [Side::Open, Side::Closed].into_iter().map(|side| search.bounded(side, whole.clone())).collect();
    let mut largest = Largest::new();
    let mut steps = 0.0;
    loop {
        let mut batch = Vec::with_capacity(BATCH);
        while batch.len() < BATCH && open_parts.peek().is_some_and(|part| part.bound > largest.gap) {
            batch.extend(open_parts.pop());
        }
        let Some(at_most) = batch.first().map(|part| part.bound / n) else { return Ok(largest.certified(points)) };
        steps += batch.iter().filter(|part| !part.is_corner()).count() as f64 * 2.0 * sweep_steps(n);
        if steps > limit {
            return Err(CostTooHigh { cost, limit, at_least: largest.gap.max(0.0) / n, at_most: at_most.min(1.0) });
        }
        let seen: Vec<(Vec<f64>, f64, Vec<Part>)> = (batch.par_iter())
            .map(|part| {
                let corner = search.corner(part);
                let gap = search.gap(part.side, &corner);
                (corner, gap, if part.is_corner() { Vec::new() } else { search.halves(part).to_vec() })
            })
            .collect();
        for ((corner, gap, halves), part) in seen.into_iter().zip(batch) {
            largest.offer(gap, part.side, || corner);
            open_parts.extend(halves.into_iter().filter(|half| half.bound > largest.gap));
        }
    }
}

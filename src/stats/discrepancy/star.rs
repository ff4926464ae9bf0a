//! Star discrepancy D* = sup over boxes [0, q) of |A(q)/n − vol(q)|, exact.
//!
//! The supremum is reached on the critical grid Γ = Π_k ({x_ik} ∪ {1}): it is the maximum over q in Γ of
//! vol(q) − A_open(q)/n and A_closed(q)/n − vol(q), where A_open counts points below q on every axis and A_closed
//! points at or below. The second is a limit of boxes just larger than [0, q) and attained by none of them.
//! Niederreiter 1972; Dobkin, Eppstein & Mitchell 1996.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::mutants::{Mutant, planted};

use super::Points;

/// Boxes that are looked at without asking twice: about ten seconds in the plane (10⁵ points), two
/// minutes above it.
pub const STAR_COST_LIMIT: f64 = 1e10;

/// How points on the far faces of the box count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// Not at all: the box [0, q) holds too few points for its volume.
    Open,
    /// All of them: boxes just larger than [0, q) hold too many.
    Closed,
}

/// A star discrepancy with its certificate: anyone can count the box again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Star {
    /// D*, in (0, 1].
    pub value: f64,
    /// The far corner q of a box that reaches it, one number an axis.
    pub corner: Vec<f64>,
    /// How the points on its faces count.
    pub side: Side,
}

/// An exact star discrepancy would take too long; nothing was computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CostTooHigh {
    /// Boxes to look at, about (n + 1)^d.
    pub cells: f64,
    /// The limit that was set.
    pub limit: f64,
}

impl fmt::Display for CostTooHigh {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "exact star discrepancy: expected at most {:.1e} boxes to look at, found {:.1e}",
            self.limit, self.cells
        )
    }
}

impl std::error::Error for CostTooHigh {}

/// Boxes that [`star`] looks at: Π over axes of (distinct coordinates + 1), at most (n + 1)^d.
///
/// A box costs about a nanosecond in the plane and ten above it.
pub fn star_cost(points: &Points) -> f64 {
    if points.dimension() == 1 {
        return points.n() as f64;
    }
    (0..points.dimension()).map(|k| grid(&points.axis(k)).len() as f64).product()
}

/// Exact star discrepancy in any dimension by enumeration, if it takes at most `limit` boxes (see
/// [`star_cost`] and [`STAR_COST_LIMIT`]).
///
/// O(n log n) in one dimension, O(n²) in two, O(n^d) above: the problem is NP-hard in d.
///
/// # Errors
/// The cost, where it is above the limit.
pub fn star(points: &Points, limit: f64) -> Result<Star, CostTooHigh> {
    let cells = star_cost(points);
    if cells > limit {
        return Err(CostTooHigh { cells, limit });
    }
    Ok(match points.dimension() {
        1 => star_1d(points),
        2 => star_2d(points),
        _ => star_enumerated(points),
    })
}

/// The largest gap so far, as n times the discrepancy, with its box.
struct Largest {
    gap: f64,
    corner: Vec<f64>,
    side: Side,
}

impl Largest {
    fn new() -> Self {
        Self { gap: f64::NEG_INFINITY, corner: Vec::new(), side: Side::Open }
    }

    fn offer(&mut self, gap: f64, side: Side, corner: impl FnOnce() -> Vec<f64>) {
        if gap > self.gap {
            *self = Self { gap, corner: corner(), side };
        }
    }

    /// The value anew from the box itself, so that it carries one rounding of n · vol less.
    fn certified(self, points: &Points) -> Star {
        let n = points.n() as f64;
        let volume: f64 = self.corner.iter().product();
        let inside =
            |p: &&[f64]| p.iter().zip(&self.corner).all(|(x, q)| if self.side == Side::Open { x < q } else { x <= q });
        let share = points.iter().filter(inside).count() as f64 / n;
        let value = if self.side == Side::Open { volume - share } else { share - volume };
        Star { value, corner: self.corner, side: self.side }
    }
}

/// Distinct coordinates in rising order, and 1: the critical grid on one axis.
fn grid(axis: &[f64]) -> Vec<f64> {
    let mut grid = axis.to_vec();
    if !planted(Mutant::StarWithoutOne) {
        grid.push(1.0);
    }
    grid.sort_by(f64::total_cmp);
    grid.dedup();
    grid
}

/// Exact star discrepancy in one dimension: max over i of i/n − x_(i) and x_(i) − (i − 1)/n, in O(n log n).
///
/// # Panics
/// Where the points are not one-dimensional.
pub fn star_1d(points: &Points) -> Star {
    assert_eq!(points.dimension(), 1, "star_1d takes one-dimensional points");
    let mut sorted = points.axis(0);
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let mut largest = Largest::new();
    for (i, &x) in sorted.iter().enumerate() {
        largest.offer(n * x - i as f64, Side::Open, || vec![x]);
        largest.offer((i + 1) as f64 - n * x, Side::Closed, || vec![x]);
    }
    // The open box at 1 is only of interest where points lie at 1, and then it is in the list.
    largest.certified(points)
}

/// Exact star discrepancy in the plane, in O(n²) time and O(n) memory.
///
/// The corner sweeps in x over the distinct abscissae. `below[j]` counts the points swept so far that lie below the
/// j-th ordinate; every point adds one to a suffix. Points of equal x enter together: the open box is looked at
/// before they do, the closed one after.
///
/// # Panics
/// Where the points are not two-dimensional.
pub fn star_2d(points: &Points) -> Star {
    assert_eq!(points.dimension(), 2, "star_2d takes points of the plane");
    let n = points.n() as f64;
    let (xs, ys) = (grid(&points.axis(0)), grid(&points.axis(1)));
    let mut by_x: Vec<(f64, usize)> = points.iter().map(|p| (p[0], ys.partition_point(|y| *y < p[1]))).collect();
    by_x.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Counts are whole and below 2^53, so f64 holds them exactly and the scan needs no conversions.
    let mut below = vec![0.0_f64; ys.len() + 1];
    let mut entering = by_x.iter().peekable();
    let mut largest = Largest::new();
    for &x in &xs {
        let nx = n * x;
        let gap = max_over(&ys, &below[..ys.len()], |y, count| nx * y - count);
        if gap > largest.gap {
            let j = position(&ys, &below[..ys.len()], |y, count| nx * y - count == gap);
            largest.offer(gap, Side::Open, || vec![x, ys[j]]);
        }
        while let Some(&(_, rank)) = entering.next_if(|p| p.0 == x) {
            below[rank + 1..].iter_mut().for_each(|count| *count += 1.0);
        }
        let gap = max_over(&ys, &below[1..], |y, count| count - nx * y);
        if gap > largest.gap {
            let j = position(&ys, &below[1..], |y, count| count - nx * y == gap);
            largest.offer(gap, Side::Closed, || vec![x, ys[j]]);
        }
    }
    largest.certified(points)
}

/// Maximum over pairs, in eight independent lanes so that the compiler can use vector instructions.
fn max_over(ys: &[f64], counts: &[f64], gap: impl Fn(f64, f64) -> f64) -> f64 {
    const LANES: usize = 8;
    let larger = |a: f64, b: f64| if b > a { b } else { a };
    let mut lanes = [f64::NEG_INFINITY; LANES];
    let (ys, counts) = (ys.chunks_exact(LANES), counts.chunks_exact(LANES));
    let tail = ys.remainder().iter().zip(counts.remainder()).map(|(y, c)| gap(*y, *c)).fold(f64::NEG_INFINITY, larger);
    for (ys, counts) in ys.zip(counts) {
        for k in 0..LANES {
            lanes[k] = larger(lanes[k], gap(ys[k], counts[k]));
        }
    }
    lanes.into_iter().fold(tail, larger)
}

/// The first pair that fulfils the condition; the caller knows that one does.
fn position(ys: &[f64], counts: &[f64], holds: impl Fn(f64, f64) -> bool) -> usize {
    ys.iter().zip(counts).position(|(y, c)| holds(*y, *c)).unwrap_or(0)
}

/// Exact star discrepancy by walking the critical grid axis by axis, the last axis by prefix counts.
fn star_enumerated(points: &Points) -> Star {
    let d = points.dimension();
    let mut order: Vec<&[f64]> = points.iter().collect();
    order.sort_by(|a, b| a[d - 1].total_cmp(&b[d - 1]));
    let grids: Vec<Vec<f64>> = (0..d).map(|k| grid(&points.axis(k))).collect();
    let mut walk = Walk { grids: &grids, n: points.n() as f64, corner: vec![1.0; d], largest: Largest::new() };
    walk.enter(0, 1.0, &order.iter().map(|p| (*p, true)).collect::<Vec<_>>());
    walk.largest.certified(points)
}

/// The state of the enumeration: the corner chosen so far on the outer axes.
struct Walk<'a> {
    grids: &'a [Vec<f64>],
    n: f64,
    corner: Vec<f64>,
    largest: Largest,
}

impl Walk<'_> {
    /// Chooses the corner on `axis`; `kept` are the points in the closed box so far by rising last coordinate, each
    /// with whether it is in the open box too.
    fn enter(&mut self, axis: usize, volume: f64, kept: &[(&[f64], bool)]) {
        let grids = self.grids;
        if axis + 1 == grids.len() {
            return self.scan_last_axis(volume, kept);
        }
        for &q in &grids[axis] {
            self.corner[axis] = q;
            let inside: Vec<(&[f64], bool)> =
                (kept.iter().filter(|(p, _)| p[axis] <= q)).map(|&(p, open)| (p, open && p[axis] < q)).collect();
            self.enter(axis + 1, volume * q, &inside);
        }
    }

    fn scan_last_axis(&mut self, volume: f64, kept: &[(&[f64], bool)]) {
        let grids = self.grids;
        let last = grids.len() - 1;
        let (mut open, mut closed) = (0.0, 0.0);
        let mut entering = kept.iter().peekable();
        for &q in &grids[last] {
            self.corner[last] = q;
            let corner = &self.corner;
            let expected = self.n * volume * q;
            self.largest.offer(expected - open, Side::Open, || corner.clone());
            while let Some(&(_, in_open)) = entering.next_if(|(p, _)| p[last] == q) {
                closed += 1.0;
                open += f64::from(u8::from(in_open));
            }
            self.largest.offer(closed - expected, Side::Closed, || corner.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::runner;
    use super::*;
    use proptest::prelude::*;

    /// Ties, both ends of the interval, neighbouring floats and ordinary numbers.
    fn coordinate() -> impl Strategy<Value = f64> {
        prop_oneof![
            (0..=6_u8).prop_map(|k| f64::from(k) / 6.0),
            Just(1.0 - f64::EPSILON / 2.0),
            Just(0.5 + f64::EPSILON / 2.0),
            Just(f64::MIN_POSITIVE),
            0.0..1.0_f64,
        ]
    }

    fn set(dimension: usize, max_n: usize) -> impl Strategy<Value = Points> {
        prop::collection::vec(prop::collection::vec(coordinate(), dimension), 1..=max_n)
            .prop_map(move |points| Points::new(dimension, points.concat()).expect("in the unit cube"))
    }

    /// Twin: every corner of the critical grid, every point compared with it.
    fn by_definition(points: &Points) -> f64 {
        let d = points.dimension();
        let grids: Vec<Vec<f64>> = (0..d).map(|k| grid(&points.axis(k))).collect();
        let n = points.n() as f64;
        let mut worst = f64::NEG_INFINITY;
        for code in 0..grids.iter().map(Vec::len).product() {
            let mut rest = code;
            let corner: Vec<f64> = grids
                .iter()
                .map(|g| {
                    let q = g[rest % g.len()];
                    rest /= g.len();
                    q
                })
                .collect();
            let volume: f64 = corner.iter().product();
            let count = |inside: fn(&f64, &f64) -> bool| {
                points.iter().filter(|p| p.iter().zip(&corner).all(|(x, q)| inside(x, q))).count() as f64 / n
            };
            worst = worst.max(volume - count(f64::lt)).max(count(f64::le) - volume);
        }
        worst
    }

    /// Does the box reach the value? Counted with nothing but comparisons.
    fn assert_certified(points: &Points, star: &Star) {
        let inside =
            |p: &&[f64]| p.iter().zip(&star.corner).all(|(x, q)| x < q || (x == q && star.side == Side::Closed));
        let share = points.iter().filter(inside).count() as f64 / points.n() as f64;
        let volume: f64 = star.corner.iter().product();
        assert_eq!(star.value, if star.side == Side::Open { volume - share } else { share - volume });
    }

    /// The products n·x·y and x·y round differently: the twins agree to a few ε.
    #[test]
    fn the_star_discrepancy_equals_its_definition_in_one_to_four_dimensions() {
        for (dimension, max_n, cases) in [(1, 30, 200), (2, 20, 300), (3, 8, 100), (4, 5, 50)] {
            runner(cases)
                .run(&set(dimension, max_n), |points| {
                    let ours = star(&points, 1e9).expect("cheap");
                    prop_assert!((ours.value - by_definition(&points)).abs() <= 8.0 * f64::EPSILON);
                    assert_certified(&points, &ours);
                    Ok(())
                })
                .expect("equal");
        }
    }

    #[test]
    fn the_sweep_and_the_enumeration_agree_in_the_plane() {
        runner(200)
            .run(&set(2, 40), |points| {
                prop_assert!((star_2d(&points).value - star_enumerated(&points).value).abs() <= 8.0 * f64::EPSILON);
                Ok(())
            })
            .expect("equal");
    }

    #[test]
    fn permuting_points_or_axes_or_doubling_the_set_changes_nothing() {
        runner(200)
            .run(&set(2, 25), |points| {
                let value = star_2d(&points).value;
                let of = |coordinates: Vec<f64>| star_2d(&Points::new(2, coordinates).expect("valid")).value;
                let all: Vec<&[f64]> = points.iter().collect();
                let reversed: Vec<f64> = all.iter().rev().flat_map(|p| p.to_vec()).collect();
                let transposed: Vec<f64> = all.iter().flat_map(|p| [p[1], p[0]]).collect();
                prop_assert!(of(reversed) == value);
                for other in [of(transposed), of([all.concat(), all.concat()].concat())] {
                    prop_assert!((other - value).abs() <= 8.0 * f64::EPSILON);
                }
                Ok(())
            })
            .expect("invariant");
    }

    /// One point p: max(p_1, …, p_d, 1 − Π p), by the critical grid's few boxes.
    #[test]
    fn one_point_meets_its_closed_form() {
        for point in [[0.25, 0.75, 0.5], [0.9, 0.95, 0.99], [0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [1.0, 0.5, 0.0]] {
            for d in 1..=3 {
                let p = &point[..d];
                let truth = p.iter().copied().fold(1.0 - p.iter().product::<f64>(), f64::max);
                let ours = star(&Points::new(d, p.to_vec()).expect("valid"), 1e3).expect("cheap");
                assert!((ours.value - truth).abs() <= f64::EPSILON, "{p:?}: {ours:?}");
            }
        }
    }

    #[test]
    fn copies_of_a_corner_have_discrepancy_one() {
        for n in [1, 2, 7, 100] {
            for corner in [0.0, 1.0] {
                for d in 1..=3 {
                    let points = Points::new(d, vec![corner; n * d]).expect("valid");
                    let found = star(&points, 1e6).expect("cheap");
                    assert_eq!(found.value, 1.0, "{n} copies of {corner} in {d}-D");
                    assert_eq!(found.side, if corner == 0.0 { Side::Closed } else { Side::Open });
                }
            }
        }
    }

    /// k × k cell centres: 1/k − 1/(4k²) = 1 − (1 − 1/(2k))², the closed box at the last centre.
    #[test]
    fn a_grid_of_cell_centres_meets_its_closed_form() {
        for k in [1_u32, 2, 3, 5, 16, 33] {
            let side = f64::from(k);
            let centre = |i: u32| (f64::from(i) + 0.5) / side;
            let points: Vec<[f64; 2]> = (0..k * k).map(|i| [centre(i % k), centre(i / k)]).collect();
            let found = star_2d(&Points::new_2d(&points).expect("valid"));
            assert!((found.value - (1.0 / side - 0.25 / (side * side))).abs() < 1e-15, "{k}: {found:?}");
        }
    }

    /// Two points a rounding apart are two abscissae: the box between them holds one of them only.
    #[test]
    fn points_a_rounding_apart_are_told_apart() {
        let above = 0.5 + f64::EPSILON / 2.0;
        let points = Points::new_2d(&[[above, 0.25], [0.5, 0.75]]).expect("valid");
        assert!((star_2d(&points).value - by_definition(&points)).abs() <= f64::EPSILON);
        let tied = Points::new_2d(&[[0.5, 0.25], [0.5, 0.75]]).expect("valid");
        assert!((star_2d(&tied).value - by_definition(&tied)).abs() <= f64::EPSILON);
    }

    #[test]
    fn a_cost_above_the_limit_is_told_and_not_paid() {
        let points = Points::new(3, (0..300).map(|i| f64::from(i) / 300.0).collect()).expect("valid");
        let refused = star(&points, 1e6).expect_err("101^3 boxes");
        assert_eq!(refused, CostTooHigh { cells: 101.0 * 101.0 * 101.0, limit: 1e6 });
        assert!(refused.to_string().contains("1.0e6"), "{refused}");
        assert!(star(&points, refused.cells).is_ok());
    }
}

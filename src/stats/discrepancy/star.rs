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
use super::boxes::star_bounded;
use super::plane::sweep;

/// Steps that are taken without asking twice: some ten seconds on two cores.
pub const STAR_COST_LIMIT: f64 = 2e9;

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

/// An exact star discrepancy takes too long; what is known of it instead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CostTooHigh {
    /// Steps that a search without bounds would take, see [`star_cost`].
    pub cost: f64,
    /// The limit that was set.
    pub limit: f64,
    /// D* is at least this: some box reaches it.
    pub at_least: f64,
    /// D* is at most this: proved by bounds on all boxes.
    pub at_most: f64,
}

impl fmt::Display for CostTooHigh {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cost, limit, at_least, at_most } = self;
        write!(
            f,
            "exact star discrepancy: expected to be done in {limit:.1e} steps, found that it lies between {at_least:.6} and \
             {at_most:.6} after those (up to {cost:.1e} steps are needed)"
        )
    }
}

impl std::error::Error for CostTooHigh {}

/// Steps of at most 10 nanoseconds that [`star`] takes in the worst case: in the plane those of a sweep, n log₂ n and some
/// hundred to begin with; above it two sweeps for every cut between corners on the outer axes, for either side. The bounds of
/// [`star`] usually leave a small share of them.
pub fn star_cost(points: &Points) -> f64 {
    let outer = points.dimension().saturating_sub(2);
    let corners: f64 = (0..outer).map(|k| grid(&points.axis(k)).len() as f64).product();
    let sweeps = if outer == 0 { 1.0 } else { 4.0 * corners };
    sweeps * sweep_steps(points.n() as f64)
}

/// Steps of a sweep over n points.
pub(super) fn sweep_steps(n: f64) -> f64 {
    500.0 + n * (1.0 + libm::log2(n))
}

/// Exact star discrepancy in any dimension, if it takes at most `limit` steps of at most 10 ns (see [`STAR_COST_LIMIT`]).
///
/// O(n log n) in one dimension, about O(n log² n) in two ([`star_2d`]). Above, branch and bound over boxes of corners on
/// the outer axes, each bounded by a sweep in the plane: O(n^(d−1) log n) at worst, as the problem is NP-hard in d, but
/// far less where D* stands out. Precision 1e-14: the value is that of its box, counted anew.
///
/// # Errors
/// Where the limit is reached: the cost, and the interval in which D* lies.
pub fn star(points: &Points, limit: f64) -> Result<Star, CostTooHigh> {
    let cost = star_cost(points);
    match points.dimension() {
        1 | 2 if cost > limit => Err(CostTooHigh { cost, limit, at_least: 0.0, at_most: 1.0 }),
        1 => Ok(star_1d(points)),
        2 => Ok(star_2d(points)),
        _ => star_bounded(points, cost, limit),
    }
}

/// The largest gap so far, as n times the discrepancy, with its box.
pub(super) struct Largest {
    pub gap: f64,
    corner: Vec<f64>,
    side: Side,
}

impl Largest {
    pub fn new() -> Self {
        Self { gap: f64::NEG_INFINITY, corner: Vec::new(), side: Side::Open }
    }

    pub fn offer(&mut self, gap: f64, side: Side, corner: impl FnOnce() -> Vec<f64>) {
        if gap > self.gap {
            *self = Self { gap, corner: corner(), side };
        }
    }

    /// The value anew from the box itself, so that it carries one rounding of n · vol less.
    pub fn certified(self, points: &Points) -> Star {
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
pub(super) fn grid(axis: &[f64]) -> Vec<f64> {
    let mut grid = axis.to_vec();
    if !planted(Mutant::StarWithoutOne) {
        grid.push(1.0);
    }
    // Not negative, so the bits are ordered as the numbers are.
    grid.sort_unstable_by_key(|x| x.to_bits());
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

/// Exact star discrepancy in the plane, in about O(n log² n) time and 100 bytes a point.
///
/// The corner sweeps in x over the distinct abscissae, once for the open boxes and once for the closed ones (see
/// `sweep`). The box is the worst but for roundings of its gap, 2 ε log₂ n at most, and the value is counted anew from it:
/// within 1e-14 of D* for any n that fits in memory.
///
/// # Panics
/// Where the points are not two-dimensional.
pub fn star_2d(points: &Points) -> Star {
    assert_eq!(points.dimension(), 2, "star_2d takes points of the plane");
    let ys = grid(&points.axis(1));
    let mut by_x: Vec<(f64, usize)> = points.iter().map(|p| (p[0], ys.partition_point(|y| *y < p[1]))).collect();
    // Not negative, so the bits are ordered as the numbers are.
    by_x.sort_unstable_by_key(|(x, position)| (x.to_bits(), *position));
    let n = points.n() as f64;
    let (open, closed) = rayon::join(|| sweep(Side::Open, n, &by_x, &ys), || sweep(Side::Closed, n, &by_x, &ys));
    let mut largest = Largest::new();
    largest.offer(open.gap, Side::Open, || vec![open.x, open.y]);
    largest.offer(closed.gap, Side::Closed, || vec![closed.x, closed.y]);
    largest.certified(points)
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

    /// Twin for larger sets: every abscissa against every ordinate, counts by plain addition, O(n²).
    fn by_scan(points: &Points) -> f64 {
        let (xs, ys) = (grid(&points.axis(0)), grid(&points.axis(1)));
        let n = points.n() as f64;
        let mut worst = f64::NEG_INFINITY;
        let mut below = vec![0.0; ys.len()];
        let mut upto = vec![0.0; ys.len()];
        for x in xs {
            let expected: Vec<f64> = ys.iter().map(|y| x * y).collect();
            let open = expected.iter().zip(&below).map(|(e, c)| e - c / n).fold(f64::NEG_INFINITY, f64::max);
            for p in points.iter().filter(|p| p[0] == x) {
                let rank = ys.partition_point(|y| *y < p[1]);
                upto[rank..].iter_mut().for_each(|c| *c += 1.0);
                below[rank + 1..].iter_mut().for_each(|c| *c += 1.0);
            }
            let closed = expected.iter().zip(&upto).map(|(e, c)| c / n - e).fold(f64::NEG_INFINITY, f64::max);
            worst = worst.max(open).max(closed);
        }
        worst
    }

    /// Coordinates that differ by a few roundings around a few places, and the ends of the interval.
    fn crowded() -> impl Strategy<Value = f64> {
        let place = (0..=5_u8, -3..=3_i8).prop_map(|(place, steps)| {
            (f64::from(place) / 5.0 + f64::from(steps) * f64::EPSILON / 2.0).clamp(0.0, 1.0)
        });
        prop_oneof![4 => place, 1 => 0.0..=1.0_f64, 1 => Just(0.0), 1 => Just(1.0)]
    }

    #[test]
    fn crowded_and_larger_sets_equal_a_plain_scan() {
        let sets = prop::collection::vec([crowded(), crowded()], 1..300);
        runner(150)
            .run(&sets, |set| {
                let points = Points::new_2d(&set).expect("in the unit square");
                let ours = star_2d(&points);
                prop_assert!((ours.value - by_scan(&points)).abs() <= 8.0 * f64::EPSILON, "{ours:?}");
                assert_certified(&points, &ours);
                Ok(())
            })
            .expect("equal");
        let ramp = |n: u32, slope: u32| {
            let x = |i: u32| f64::from(i.wrapping_mul(slope) % n) / f64::from(n);
            Points::new_2d(&(0..n).map(|i| [f64::from(i) / f64::from(n), x(i)]).collect::<Vec<_>>()).expect("valid")
        };
        // A lattice, a diagonal, a falling line, a column of ties.
        for points in [ramp(1597, 987), ramp(1000, 1), ramp(1000, 999), ramp(700, 0)] {
            assert!((star_2d(&points).value - by_scan(&points)).abs() <= 8.0 * f64::EPSILON);
        }
    }

    #[test]
    fn the_bits_do_not_depend_on_the_number_of_threads() {
        let set = |d: usize, n: u32| {
            let number = |i: u32| f64::from(i.wrapping_mul(2_654_435_769).rotate_left(7)) / 4_294_967_296.0;
            Points::new(d, (0..n * d as u32).map(number).collect()).expect("valid")
        };
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| (star_2d(&set(2, 2000)), star(&set(4, 60), 1e9).expect("cheap")))
        };
        assert!(with(1) == with(2) && with(1) == with(7));
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
                let points = Points::new(d, p.to_vec()).expect("valid");
                let ours = star(&points, star_cost(&points)).expect("what it costs at most");
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
    fn a_cost_above_the_limit_is_told_with_what_is_known() {
        let number = |i: u32| f64::from(i.wrapping_mul(2_654_435_769)) / 4_294_967_296.0;
        let points = Points::new(5, (0..200).map(number).collect()).expect("valid");
        let exact = star(&points, 1e9).expect("cheap").value;
        let refused = star(&points, 1e5).expect_err("more than a hundred sweeps");
        assert_eq!((refused.cost, refused.limit), (star_cost(&points), 1e5));
        assert!(refused.at_least <= exact && exact <= refused.at_most, "{refused:?} {exact}");
        assert!(0.0 < refused.at_least && refused.at_most < 1.0, "{refused:?}");
        assert!(refused.to_string().contains("1.0e5 steps"), "{refused}");
        let plane = Points::new(2, (0..200).map(number).collect()).expect("valid");
        assert!(star(&plane, 600.0).is_err() && star(&plane, star_cost(&plane)).is_ok());
    }
}

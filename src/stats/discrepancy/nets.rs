//! Nets in base 2 and the smallest distance between points.

use rayon::prelude::*;

use super::Points;

/// The t of a (t, m, d)-net in base 2: the smallest t for which every elementary interval of volume 2^(t−m) holds 2^t
/// points.
///
/// An elementary interval is Π [a_k 2^−e_k, (a_k + 1) 2^−e_k) with Σ e_k = m − t; a point's interval has the keys
/// ⌊x_k 2^e_k⌋, exact in f64. All C(m − t + d − 1, d − 1) shapes are tested, O(n) each: for d ≤ 2 from t = 0 up,
/// O(n log² n) in all; above, where shapes are many and t is large, from t = m down until one fails. t = m always
/// passes. `None` where n is no power of two or a coordinate is 1, which lies in no interval.
pub fn t_value(points: &Points) -> Option<u32> {
    let axes: Vec<Vec<f64>> = (0..points.dimension()).map(|k| points.axis(k)).collect();
    t_of_axes(&axes.iter().map(Vec::as_slice).collect::<Vec<_>>())
}

/// Up to this many dimensions every pair of axes is told; 1225 pairs.
pub const MAX_PAIRED_DIMENSION: usize = 50;

/// The t of one projection onto two axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Projection {
    /// The two axes, from 0.
    pub axes: [usize; 2],
    /// The smallest t for which the projection is a (t, m, 2)-net.
    pub t: u32,
}

/// The t-value of every projection onto two axes, in the order (0, 1), (0, 2), …, (1, 2), …: which pairs of dimensions are
/// stratified against each other. `None` where [`t_value`] is, or above [`MAX_PAIRED_DIMENSION`]; none in one
/// dimension.
pub fn t_of_projections(points: &Points) -> Option<Vec<Projection>> {
    let d = points.dimension();
    if d > MAX_PAIRED_DIMENSION {
        return None;
    }
    let axes: Vec<Vec<f64>> = (0..d).map(|k| points.axis(k)).collect();
    let pairs: Vec<[usize; 2]> = (0..d).flat_map(|i| (i + 1..d).map(move |j| [i, j])).collect();
    if pairs.is_empty() {
        return t_value(points).map(|_| Vec::new());
    }
    pairs
        .into_par_iter()
        .map(|[i, j]| t_of_axes(&[&axes[i], &axes[j]]).map(|t| Projection { axes: [i, j], t }))
        .collect()
}

/// How many of the n equal strata [k/n, (k + 1)/n) hold a point, axis by axis: n on every axis for a Latin hypercube.
///
/// The edges are k/n rounded to f64, so that a coordinate computed as k/n lies in stratum k; 1 lies in none.
pub fn filled_strata(points: &Points) -> Vec<usize> {
    let n = points.n();
    let edge = |k: usize| k as f64 / n as f64;
    let stratum = |x: f64| {
        // The product rounds too, and may be one off at an edge.
        let k = (x * n as f64) as usize;
        if x >= edge(k + 1) {
            k + 1
        } else if x < edge(k) {
            k - 1
        } else {
            k
        }
    };
    let filled = |axis: usize| {
        let mut filled = vec![false; n];
        points.iter().map(|p| stratum(p[axis])).filter(|k| *k < n).for_each(|k| filled[k] = true);
        filled.into_iter().filter(|f| *f).count()
    };
    (0..points.dimension()).into_par_iter().map(filled).collect()
}

fn t_of_axes(axes: &[&[f64]]) -> Option<u32> {
    let n = axes[0].len();
    if !n.is_power_of_two() || axes.iter().any(|axis| axis.iter().any(|x| *x >= 1.0)) {
        return None;
    }
    let m = n.trailing_zeros();
    let mut counts = vec![0_u32; n];
    let mut is_net = |t: u32| {
        let mut shape = vec![0; axes.len()];
        every_shape(&mut shape, 0, m - t, &mut |shape| is_even(axes, shape, m - t, &mut counts))
    };
    if axes.len() <= 2 {
        (0..=m).find(|&t| is_net(t))
    } else {
        Some((0..m).rev().take_while(|&t| is_net(t)).last().unwrap_or(m))
    }
}

/// Does `holds` accept every way of splitting `left` over the axes from `axis` on? Stops at the first that it does not.
fn every_shape(shape: &mut [u32], axis: usize, left: u32, holds: &mut impl FnMut(&[u32]) -> bool) -> bool {
    if axis + 1 == shape.len() {
        shape[axis] = left;
        return holds(shape);
    }
    (0..=left).all(|exponent| {
        shape[axis] = exponent;
        every_shape(shape, axis + 1, left - exponent, holds)
    })
}

/// Does each of the 2^`bits` intervals of this shape hold equally many points? `counts` is scratch space.
fn is_even(axes: &[&[f64]], shape: &[u32], bits: u32, counts: &mut [u32]) -> bool {
    let cells = &mut counts[..1 << bits];
    cells.fill(0);
    let n = axes[0].len();
    let share = (n >> bits) as u32;
    // A product with a power of two is exact, so the floor is the mathematical one.
    let cut: Vec<(&[f64], u32, f64)> =
        axes.iter().zip(shape).filter(|(_, e)| **e > 0).map(|(axis, &e)| (*axis, e, (1_u64 << e) as f64)).collect();
    (0..n).all(|i| {
        let key = cut.iter().fold(0, |key, (axis, exponent, scale)| (key << exponent) | (axis[i] * scale) as usize);
        cells[key] += 1;
        cells[key] <= share
    })
}

/// Smallest distance between two points on the torus, where 0 and 1 are the same place; `None` for a single point.
///
/// Euclidean, in [0, √d/2]; exact duplicates give 0. By a sweep along the axis on which most points differ: O(n log n) where
/// some pair is close, O(n^(2−1/d)) for even sets, O(n²) at worst. Up to three dimensions a sweep that looks at more
/// than 256 pairs a point gives up for a grid whose cells are as wide as the best distance so far, points entering
/// in a scattered order: O(n) expected for any set (Rabin 1976; Golin et al. 1995).
/// In the plane, dividing by √(2/(√3 n)) gives the share of the densest packing's distance.
pub fn min_toroidal_distance(points: &Points) -> Option<f64> {
    if points.n() < 2 {
        return None;
    }
    let squared = nearest_squared(points, 1.0, f64::INFINITY);
    if squared >= SMALLEST_SQUARE {
        return Some(squared.sqrt());
    }
    // In units that fit: equal points have 0 there, too, and what is then infinite is no nearest pair. The nearest lies below
    // the bound that has just been passed, so nothing farther need be looked at.
    let bound = 2.0 * SMALLEST_SQUARE * TINY_UNITS * TINY_UNITS;
    Some(nearest_squared(points, TINY_UNITS, bound).sqrt() / TINY_UNITS)
}

/// Squares below this have lost digits, or are 0 though the points differ: normal numbers end at 2^−1022.
const SMALLEST_SQUARE: f64 = 1e-280;

/// 2^600: the smallest number of f64, 2^−1074, has a square in these units, as has the root of [`SMALLEST_SQUARE`].
const TINY_UNITS: f64 = f64::from_bits((1023 + 600) << 52);

/// Smallest squared distance of at least two points, distances being multiplied by `scale`; `bound` where none is below it.
fn nearest_squared(points: &Points, scale: f64, bound: f64) -> f64 {
    match points.dimension() {
        1 => {
            nearest_by_sweep(points, scale, bound, ENOUGH).unwrap_or_else(|| nearest_by_grid::<1>(points, scale, bound))
        }
        2 => {
            nearest_by_sweep(points, scale, bound, ENOUGH).unwrap_or_else(|| nearest_by_grid::<2>(points, scale, bound))
        }
        3 => {
            nearest_by_sweep(points, scale, bound, ENOUGH).unwrap_or_else(|| nearest_by_grid::<3>(points, scale, bound))
        }
        _ => nearest_by_sweep(points, scale, bound, usize::MAX).unwrap_or(0.0),
    }
}

/// Pairs a point that a sweep looks at before the grid is faster.
const ENOUGH: usize = 256;

/// Points by cells of the torus; cells share the places of a table, which costs comparisons and loses nothing.
struct CellGrid {
    /// Cells on an axis; their width is above the best distance.
    per_axis: u64,
    /// The last point that entered each place, and the one that entered before a point; `u32::MAX` for none.
    last: Vec<u32>,
    before: Vec<u32>,
}

impl CellGrid {
    fn cell<const D: usize>(&self, p: &[f64]) -> [u64; D] {
        std::array::from_fn(|k| ((p[k] * self.per_axis as f64) as u64).min(self.per_axis - 1))
    }

    fn place<const D: usize>(&self, cell: [u64; D]) -> usize {
        let mixed = cell.iter().fold(0_u64, |h, c| (h ^ c).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29));
        (mixed.wrapping_mul(0xd6e8_feb8_6659_fd93) >> 32) as usize & (self.last.len() - 1)
    }

    fn enter<const D: usize>(&mut self, i: u32, p: &[f64]) {
        let place = self.place(self.cell::<D>(p));
        self.before[i as usize] = std::mem::replace(&mut self.last[place], i);
    }

    /// As many cells as the squared distance allows: a percent wider than it, so that no rounding parts neighbours.
    fn refine(&mut self, squared: f64, scale: f64) {
        self.per_axis = ((0.99 * scale / squared.sqrt()) as u64).clamp(1, 1 << 31);
        self.last.fill(u32::MAX);
    }
}

/// Smallest squared distance of at least two points in D dimensions, see [`nearest_squared`].
fn nearest_by_grid<const D: usize>(points: &Points, scale: f64, bound: f64) -> f64 {
    let all: Vec<&[f64]> = points.iter().collect();
    let n = u32::try_from(all.len()).expect("fewer than 2^32 points");
    // Scattered by a fixed multiplication, so that no order of the points makes the grid be built too often.
    let mut order: Vec<u32> = (0..n).collect();
    order.sort_unstable_by_key(|i| {
        (u64::from(*i) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(31).wrapping_mul(0xbf58_476d_1ce4_e5b9)
    });
    let mut grid = CellGrid {
        per_axis: 1,
        last: vec![u32::MAX; (2 * all.len()).next_power_of_two()],
        before: vec![u32::MAX; all.len()],
    };
    let mut nearest = bound;
    grid.refine(bound, scale);
    for (entered, &i) in order.iter().enumerate() {
        let p = all[i as usize];
        let before = nearest;
        let cell = grid.cell::<D>(p);
        for neighbour in 0..3_u64.pow(D as u32) {
            let mut rest = neighbour;
            let around = cell.map(|c| {
                let step = rest % 3;
                rest /= 3;
                (c + grid.per_axis + step - 1) % grid.per_axis
            });
            let mut other = grid.last[grid.place(around)];
            while other != u32::MAX {
                nearest = nearest.min(squared_distance(p, all[other as usize], scale));
                other = grid.before[other as usize];
            }
        }
        if nearest == 0.0 {
            return 0.0;
        }
        if nearest < before {
            grid.refine(nearest, scale);
            order[..=entered].iter().for_each(|&j| grid.enter::<D>(j, all[j as usize]));
        } else {
            grid.enter::<D>(i, p);
        }
    }
    nearest
}

/// Smallest squared distance of at least two points: points are compared only while one coordinate alone is closer than
/// the best pair so far. `None` where that takes more than so many pairs a point.
fn nearest_by_sweep(points: &Points, scale: f64, bound: f64, pairs_a_point: usize) -> Option<f64> {
    let distinct = |axis: &usize| {
        let mut values = points.axis(*axis);
        values.sort_by(f64::total_cmp);
        values.dedup();
        values.len()
    };
    let axis = (0..points.dimension()).max_by_key(distinct).unwrap_or(0);
    let mut sorted: Vec<&[f64]> = points.iter().collect();
    sorted.sort_by(|a, b| a[axis].total_cmp(&b[axis]));
    let n = sorted.len();
    let mut nearest = bound;
    let mut left = n.saturating_mul(pairs_a_point);
    for (i, from) in sorted.iter().enumerate() {
        for step in 1..n {
            let to = sorted[(i + step) % n];
            let ahead = if i + step < n { to[axis] - from[axis] } else { (1.0 - from[axis]) + to[axis] };
            // A pair more than half a turn ahead is met from its other end. The comparison with the squared best is
            // padded by a rounding, so that no equal distance is lost to it.
            let scaled = ahead * scale;
            if ahead > 0.5 || scaled * scaled > nearest * (1.0 + 4.0 * f64::EPSILON) {
                break;
            }
            if left == 0 {
                return None;
            }
            left -= 1;
            nearest = nearest.min(squared_distance(from, to, scale));
        }
        if nearest == 0.0 {
            break;
        }
    }
    Some(nearest)
}

/// Squared Euclidean distance on the torus, the distance being multiplied by `scale`.
fn squared_distance(a: &[f64], b: &[f64], scale: f64) -> f64 {
    let along = |(a, b): (&f64, &f64)| {
        // Around the border as (1 − larger) + smaller: 1 − (larger − smaller) would lose a tiny smaller one.
        let (smaller, larger) = (a.min(*b), a.max(*b));
        let t = (larger - smaller).min((1.0 - larger) + smaller) * scale;
        t * t
    };
    a.iter().zip(b).map(along).sum()
}

#[cfg(test)]
mod tests {
    use super::super::testing::runner;
    use super::*;
    use proptest::prelude::*;

    fn plane(points: &[[f64; 2]]) -> Points {
        Points::new_2d(points).expect("in the unit square")
    }

    /// Coordinates on a coarse lattice and anywhere: duplicates, ends of the interval and ordinary numbers.
    fn coordinate() -> impl Strategy<Value = f64> {
        prop_oneof![(0..=8_u8).prop_map(|k| f64::from(k) / 8.0), 0.0..1.0_f64, Just(1.0 - f64::EPSILON / 2.0)]
    }

    /// Twin of the t-value: intervals written out, points found by comparison, nothing shared but the definition.
    fn t_by_definition(points: &[[f64; 2]]) -> u32 {
        let m = points.len().trailing_zeros();
        let holds = |t: u32| {
            (0..=m - t).all(|e| {
                let (w, h) = (0.5_f64.powi(e as i32), 0.5_f64.powi((m - t - e) as i32));
                (0..1 << e).all(|a| {
                    (0..1 << (m - t - e)).all(|b| {
                        let (x0, y0) = (f64::from(a) * w, f64::from(b) * h);
                        let inside = |p: &&[f64; 2]| x0 <= p[0] && p[0] < x0 + w && y0 <= p[1] && p[1] < y0 + h;
                        points.iter().filter(inside).count() == 1 << t
                    })
                })
            })
        };
        (0..=m).find(|&t| holds(t)).unwrap_or(m)
    }

    #[test]
    fn t_equals_its_definition_on_random_and_structured_sets() {
        let points = (0..5_u32).prop_flat_map(|m| {
            let below_one = || coordinate().prop_map(|x| if x < 1.0 { x } else { 0.0 });
            prop::collection::vec([below_one(), below_one()], 1 << m)
        });
        runner(200)
            .run(&points, |points| {
                prop_assert_eq!(t_value(&plane(&points)), Some(t_by_definition(&points)));
                Ok(())
            })
            .expect("equal");
        for m in 0..8 {
            let hammersley: Vec<[f64; 2]> = (0..1_u32 << m)
                .map(|i| [f64::from(i) / f64::from(1 << m), f64::from(i.reverse_bits()) / 4_294_967_296.0])
                .collect();
            assert_eq!(t_value(&plane(&hammersley)), Some(0), "Hammersley is a (0, {m}, 2)-net");
        }
    }

    #[test]
    fn no_power_of_two_and_no_point_at_one_has_a_t() {
        assert_eq!(t_value(&plane(&[[0.1, 0.2], [0.3, 0.4], [0.6, 0.9]])), None);
        assert_eq!(t_value(&plane(&[[0.1, 0.2], [0.3, 1.0]])), None);
        assert_eq!(t_value(&plane(&[[0.1, 0.2]])), Some(0));
        assert_eq!(t_value(&plane(&[[0.1, 0.2]; 16])), Some(4));
    }

    /// A shape of many axes, most of them with exponent 0: only the diagonal's halves are distinguished.
    #[test]
    fn t_in_many_dimensions_tests_every_shape() {
        let diagonal = Points::new(6, [[0.25; 6], [0.75; 6]].as_flattened().to_vec()).expect("valid");
        assert_eq!(t_value(&diagonal), Some(0));
        let four: Vec<f64> = (0..4).flat_map(|i| [f64::from(i) / 4.0; 3]).collect();
        assert_eq!(t_value(&Points::new(3, four).expect("valid")), Some(1));
    }

    fn distance_by_definition(points: &[[f64; 2]]) -> f64 {
        let mut best = f64::INFINITY;
        for (i, a) in points.iter().enumerate() {
            for b in &points[..i] {
                for dx in [-1.0, 0.0, 1.0] {
                    for dy in [-1.0, 0.0, 1.0] {
                        best = best.min(libm::hypot(a[0] - b[0] + dx, a[1] - b[1] + dy));
                    }
                }
            }
        }
        best
    }

    /// Differences of coordinates round at 2^-54 where a turn is added: the twins agree to 4e-16 absolute.
    #[test]
    fn the_smallest_distance_equals_its_definition_on_nine_copies() {
        let points = prop::collection::vec([coordinate(), coordinate()], 2..60);
        runner(400)
            .run(&points, |points| {
                let ours = min_toroidal_distance(&plane(&points)).expect("two points");
                prop_assert!((ours - distance_by_definition(&points)).abs() <= 4e-16);
                Ok(())
            })
            .expect("equal");
    }

    /// The sweep and the grid against all pairs.
    #[test]
    fn the_smallest_distance_in_one_to_four_dimensions_is_that_of_all_pairs() {
        let sets = (1..=4_usize, prop::collection::vec(prop::collection::vec(coordinate(), 4), 2..80));
        runner(200)
            .run(&sets, |(d, set)| {
                let set: Vec<&[f64]> = set.iter().map(|p| &p[..d]).collect();
                let points = Points::new(d, set.concat()).expect("valid");
                let pairs = (0..set.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
                let twin = pairs.map(|(i, j)| squared_distance(set[i], set[j], 1.0)).fold(f64::INFINITY, f64::min);
                prop_assert_eq!(min_toroidal_distance(&points), Some(twin.sqrt()));
                let by_grid = [nearest_by_grid::<1>, nearest_by_grid::<2>, nearest_by_grid::<3>];
                if let Some(by_grid) = by_grid.get(d - 1) {
                    prop_assert_eq!(by_grid(&points, 1.0, f64::INFINITY), twin);
                }
                Ok(())
            })
            .expect("equal");
    }

    /// A cluster of 3000 points in a cell of any coarse grid, and a far pair a rounding apart.
    #[test]
    fn clusters_at_any_scale_are_resolved() {
        let mut set: Vec<[f64; 2]> =
            (0..3000).map(|i| [0.3 + 1e-9 * f64::from(i % 50), 0.6 + 1e-9 * f64::from(i / 50)]).collect();
        assert!((min_toroidal_distance(&plane(&set)).expect("many") - 1e-9).abs() < 1e-15);
        assert!((nearest_by_grid::<2>(&plane(&set), 1.0, f64::INFINITY).sqrt() - 1e-9).abs() < 1e-15);
        set.extend([[0.5, 0.5], [0.5 + f64::EPSILON / 2.0, 0.5]]);
        assert_eq!(min_toroidal_distance(&plane(&set)), Some(f64::EPSILON / 2.0));
    }

    #[test]
    fn projections_and_strata_tell_which_axes_are_stratified() {
        // Hammersley in x and y; the third axis repeats the first: a diagonal, whose t is m − 1.
        let n = 64_u32;
        let y = |i: u32| f64::from(i.reverse_bits()) / 4_294_967_296.0;
        let set: Vec<f64> = (0..n).flat_map(|i| [f64::from(i) / 64.0, y(i), f64::from(i) / 64.0]).collect();
        let points = Points::new(3, set).expect("valid");
        let t: Vec<([usize; 2], u32)> = t_of_projections(&points).expect("2^6").iter().map(|p| (p.axes, p.t)).collect();
        assert_eq!(t, [([0, 1], 0), ([0, 2], 5), ([1, 2], 0)]);
        assert_eq!(t_value(&points), Some(5));
        assert_eq!(filled_strata(&points), [64, 64, 64]);
        let odd = plane(&[[0.1, 1.0], [0.2, 0.5], [0.9, 0.6]]);
        assert_eq!((t_of_projections(&odd), filled_strata(&odd)), (None, vec![2, 1]));
        for n in 1..200_u32 {
            let lattice: Vec<f64> = (0..n).map(|i| f64::from(i) / f64::from(n)).collect();
            assert_eq!(filled_strata(&Points::new(1, lattice).expect("valid")), [n as usize], "{n}");
        }
        assert_eq!(t_of_projections(&Points::new(1, vec![0.1, 0.7]).expect("valid")), Some(vec![]));
    }

    #[test]
    fn the_smallest_distance_of_special_sets() {
        assert_eq!(min_toroidal_distance(&plane(&[[0.3, 0.4]])), None);
        assert_eq!(min_toroidal_distance(&plane(&[[0.3, 0.4], [0.9, 0.1], [0.3, 0.4]])), Some(0.0));
        assert_eq!(min_toroidal_distance(&plane(&[[0.0, 0.0], [1.0, 1.0]])), Some(0.0));
        // A 40 x 40 grid, above any size where all pairs would be looked at.
        let grid: Vec<[f64; 2]> = (0..1600).map(|i| [f64::from(i % 40) / 40.0, f64::from(i / 40) / 40.0]).collect();
        let distance = min_toroidal_distance(&plane(&grid)).expect("many points");
        assert!((distance - 0.025).abs() < 1e-16 * 4.0);
    }

    #[test]
    fn distances_whose_squares_leave_the_range_of_f64_are_no_duplicates() {
        let smallest = f64::from_bits(1);
        for (set, expected) in [
            (vec![[0.0, 0.0], [0.0, smallest], [0.5, 0.5]], smallest),
            (vec![[3e-200, 0.0], [0.0, 4e-200], [0.7, 0.2]], 5e-200),
            (vec![[0.0, 1.0], [1.0, 1e-170], [0.3, 0.3]], 1e-170),
            (vec![[1e-160, 0.5], [1e-160, 0.5], [2e-160, 0.5]], 0.0),
        ] {
            let points = plane(&set);
            let grid = nearest_by_grid::<2>(&points, TINY_UNITS, f64::INFINITY).sqrt() / TINY_UNITS;
            for found in [min_toroidal_distance(&points).expect("three points"), grid] {
                assert!((found - expected).abs() <= 4e-16 * expected, "{found:e}, expected {expected:e}");
            }
        }
        // One late duplicate among many points costs no more than none: pairs are looked at only below the bound.
        for d in [2, 5] {
            let mut set: Vec<f64> =
                (0..40_000 * d as u64).map(|i| crate::sampling::hash::bits64(5, i) as f64 * 2f64.powi(-64)).collect();
            set.extend_from_within(7 * d..8 * d);
            let points = Points::new(d, set).expect("in the cube");
            assert_eq!(min_toroidal_distance(&points), Some(0.0));
            let bound = 2.0 * SMALLEST_SQUARE * TINY_UNITS * TINY_UNITS;
            assert_eq!(nearest_by_sweep(&points, TINY_UNITS, bound, 1), Some(0.0), "more than one pair a point");
        }
        let apart = Points::new(5, [[1e-250; 5], [2e-250; 5]].concat()).expect("in the cube");
        let found = min_toroidal_distance(&apart).expect("two points");
        assert!((found / (5.0_f64.sqrt() * 1e-250) - 1.0).abs() < 1e-15, "{found:e}");
    }
}

//! L2 discrepancies: mean square gaps between counted and true measure, each over its own family of boxes.
//!
//! All have the shape D² = c^d − (2/n) Σ_i Π_k h(x_ik) + (1/n²) Σ_ij Π_k K(x_ik, x_jk), or −c^d + mean K for the
//! toroidal ones. Three terms of size 1 cancel down to (log n)^(d−1)/n², so sums are kept to twice the digits
//! of f64; in one and two dimensions products are too.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::mutants::{Mutant, planted};

use super::Points;
use super::double::Double;
use super::ordered::{Kernel, Order};

/// Which L2 discrepancy. In the formulas a = |x − ½|, b = |y − ½|, t = |x − y|.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum L2Kind {
    /// Boxes at the origin (Warnock 1972): c = 1/3, h = (1 − x²)/2, K = 1 − max(x, y). Prefers points near 1 where
    /// n is small against 2^d (Matoušek 1998).
    Star,
    /// All boxes, not anchored: c = 1/12, h = x(1 − x)/2, K = min(x, y)(1 − max(x, y)).
    Extreme,
    /// Boxes at the nearest corner (Hickernell 1998): c = 13/12, h = 1 + a/2 − a²/2, K = 1 + (a + b − t)/2.
    Centred,
    /// Mixture of centred and wrap-around (Zhou, Fang & Ning 2013): c = 19/12, h = 5/3 − a/4 − a²/4,
    /// K = 15/8 − a/4 − b/4 − 3t/4 + t²/2.
    Mixture,
    /// Hickernell's modified L2: boxes at the origin in every projection: c = 4/3, h = (3 − x²)/2, K = 2 − max(x, y).
    Modified,
    /// Symmetric (Hickernell 1998): c = 4/3, h = 1 + 2x − 2x², K = 2(1 − t).
    Symmetric,
    /// Boxes on the torus in every projection (Hickernell 1998): −(4/3)^d + mean of Π (3/2 − t(1 − t)).
    WrapAround,
    /// Boxes on the torus: −3^−d + mean of Π (1/2 − t(1 − t)).
    Periodic,
    /// Zinterhof's diaphony (1976), normalised: (mean of Π (1 + 2π²(t² − t + 1/6)) − 1)/((1 + π²/3)^d − 1); n
    /// independent points have expectation 1/n, n coinciding ones have 1.
    Diaphony,
}

impl L2Kind {
    /// All kinds, in the order of their declaration.
    pub const ALL: [Self; 9] = [
        Self::Star,
        Self::Extreme,
        Self::Centred,
        Self::Mixture,
        Self::Modified,
        Self::Symmetric,
        Self::WrapAround,
        Self::Periodic,
        Self::Diaphony,
    ];

    /// The name under which results are recorded.
    pub fn name(self) -> &'static str {
        match self {
            Self::Star => "l2_star",
            Self::Extreme => "extreme_l2",
            Self::Centred => "centred_l2",
            Self::Mixture => "mixture_l2",
            Self::Modified => "modified_l2",
            Self::Symmetric => "symmetric_l2",
            Self::WrapAround => "wrap_around_l2",
            Self::Periodic => "periodic_l2",
            Self::Diaphony => "diaphony",
        }
    }

    /// Expectation of D² for n independent uniform points in d dimensions: (K̄^d − c^d)/n with K̄ the mean of K(x, x).
    ///
    /// The mean of squared discrepancies; the mean of their roots is smaller (Jensen).
    pub fn expected_squared_of_random(self, n: usize, dimension: usize) -> f64 {
        let power = |base: f64| libm::pow(base, dimension as f64);
        let (diagonal, centre) = match self {
            Self::Star | Self::Periodic => (1.0 / 2.0, 1.0 / 3.0),
            Self::Extreme => (1.0 / 6.0, 1.0 / 12.0),
            Self::Centred => (5.0 / 4.0, 13.0 / 12.0),
            Self::Mixture => (7.0 / 4.0, 19.0 / 12.0),
            Self::Modified | Self::WrapAround => (3.0 / 2.0, 4.0 / 3.0),
            Self::Symmetric => (2.0, 4.0 / 3.0),
            Self::Diaphony => return 1.0 / n as f64,
        };
        (power(diagonal) - power(centre)) / n as f64
    }
}

/// A squared L2 discrepancy and how much of it may be rounding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct L2Value {
    /// D²; `None` where it is not above the resolution, never a root of a negative number.
    pub squared: Option<f64>,
    /// Bound on the absolute error of D² for the coordinates as given, apart from the last digit of D² itself.
    pub resolution: f64,
}

impl L2Value {
    /// D, the root.
    pub fn root(self) -> Option<f64> {
        self.squared.map(f64::sqrt)
    }
}

/// L2 discrepancy of a kind, with its resolution.
///
/// On the line and in the plane O(n log n) time, 100 bytes a point, and a resolution of about n 2^-98: next to nothing is
/// lost. Above, O(d n²/2) time in parallel and O(n) memory: single products round, their sums do not, and the resolution is
/// 2 (d + 1) ε max Π K (roundings average out, so that the error is typically far less). The same bits on any number
/// of threads: sums are formed in an order of their own.
pub fn l2(points: &Points, kind: L2Kind) -> L2Value {
    let order = (points.dimension() <= 2).then(|| Order::new(points));
    by_order_or_pairs(points, order.as_ref(), kind)
}

/// All kinds, in the order of [`L2Kind::ALL`], sorting the points once.
pub fn l2_all(points: &Points) -> Vec<(L2Kind, L2Value)> {
    let order = (points.dimension() <= 2).then(|| Order::new(points));
    L2Kind::ALL.into_iter().map(|kind| (kind, by_order_or_pairs(points, order.as_ref(), kind))).collect()
}

/// Squared L2 discrepancy of a kind; `None` where it is below the resolution, see [`l2`].
pub fn l2_squared(points: &Points, kind: L2Kind) -> Option<f64> {
    l2(points, kind).squared
}

/// Root of [`l2_squared`].
pub fn l2_root(points: &Points, kind: L2Kind) -> Option<f64> {
    l2(points, kind).root()
}

/// c^d − (2/n) Σ Π h + mean Π K, or −c^d + mean Π K for the kinds without h.
fn by_order_or_pairs(points: &Points, order: Option<&Order>, kind: L2Kind) -> L2Value {
    let (n, d) = (points.n() as f64, points.dimension());
    let (pairs, relative) = match order {
        Some(order) => (by_order(order, kind).over(n).over(n), (n + 1024.0) * RESOLUTION_BY_ORDER),
        None => (by_pairs(points, kind), 2.0 * (d + 1) as f64 * f64::EPSILON),
    };
    let volume = centre(kind).power(d);
    let square = match kind {
        L2Kind::WrapAround | L2Kind::Periodic | L2Kind::Diaphony => pairs.minus(volume),
        _ => {
            let of_point = |p: &[f64]| p.iter().fold(Double::from(1.0), |product, x| product.times(single(kind, *x)));
            let singles = points.iter().map(of_point).fold(Double::from(0.0), Double::plus);
            volume.minus(singles.scaled(2.0).over(n)).plus(pairs)
        }
    };
    let resolution = relative * Double::from(largest_term(kind, order.is_some())).power(d).value();
    if kind == L2Kind::Diaphony {
        let norm = peak_of_diaphony().power(d).minus(Double::from(1.0));
        let square = square.times(Double::from(1.0).over(norm.value()));
        return above_resolution(square, resolution / norm.value());
    }
    above_resolution(square, resolution)
}

/// The value, if it is above what rounding could make of nothing.
fn above_resolution(square: Double, resolution: f64) -> L2Value {
    L2Value { squared: Some(square.value()).filter(|v| *v > resolution), resolution }
}

/// Rounding of one sum in twice the digits, 2^-104, and of coordinates in units of 2^-92 with n of them in a sum of n²:
/// with a margin of 2^4.
const RESOLUTION_BY_ORDER: f64 = 1.0 / (1_u128 << 100) as f64;

/// c of the kind: the mean of K over both arguments.
fn centre(kind: L2Kind) -> Double {
    match kind {
        L2Kind::Star | L2Kind::Periodic => Double::ratio(1.0, 3.0),
        L2Kind::Extreme => Double::ratio(1.0, 12.0),
        L2Kind::Centred => Double::ratio(13.0, 12.0),
        L2Kind::Mixture => Double::ratio(19.0, 12.0),
        L2Kind::Modified | L2Kind::Symmetric | L2Kind::WrapAround => Double::ratio(4.0, 3.0),
        L2Kind::Diaphony => Double::from(1.0),
    }
}

/// h of the kind: the mean of K over one argument; for the toroidal kinds that is c.
fn single(kind: L2Kind, x: f64) -> Double {
    let square = Double::product(x, x);
    let half = || distance_to_half(x);
    // Powers of two are taken out and put back exactly.
    match kind {
        L2Kind::Star => Double::from(1.0).minus(square).scaled(0.5),
        L2Kind::Extreme => Double::from(x).minus(square).scaled(0.5),
        L2Kind::Centred => Double::from(1.0).plus(half().minus(half().times(half())).scaled(0.5)),
        L2Kind::Mixture => Double::ratio(5.0, 3.0).minus(half().plus(half().times(half())).scaled(0.25)),
        L2Kind::Modified => Double::from(3.0).minus(square).scaled(0.5),
        L2Kind::Symmetric => Double::from(1.0).plus(Double::from(x).minus(square).scaled(2.0)),
        L2Kind::WrapAround | L2Kind::Periodic | L2Kind::Diaphony => centre(kind),
    }
}

/// |x − ½| exactly.
fn distance_to_half(x: f64) -> Double {
    Double::sum(x, -0.5).abs()
}

/// π² to twice the digits of f64.
const PI_SQUARED: Double = Double { high: 9.869_604_401_089_358, low: 6.265_295_508_739_711e-16 };

/// K(x, x) of diaphony: 1 + π²/3.
fn peak_of_diaphony() -> Double {
    Double::from(1.0).plus(PI_SQUARED.over(3.0))
}

/// What one axis may contribute to a term: K's largest value where K is evaluated, |c| + 2 max |g| + |h| + |β| where its
/// parts are summed apart.
fn largest_term(kind: L2Kind, apart: bool) -> f64 {
    let (whole, parts) = match kind {
        L2Kind::Star => (1.0, 2.5),
        L2Kind::Extreme => (0.25, 2.5),
        L2Kind::Centred => (1.5, 2.0),
        L2Kind::Mixture => (1.875, 4.625),
        L2Kind::Modified => (2.0, 3.5),
        L2Kind::Symmetric => (2.0, 4.0),
        L2Kind::WrapAround => (1.5, 6.5),
        L2Kind::Periodic => (0.5, 5.5),
        L2Kind::Diaphony => (1.0 + PI * PI / 3.0, 1.0 + PI * PI / 3.0 + 10.0 * PI * PI),
    };
    if apart { parts } else { whole }
}

/// Σ_ij Π K by order: K(x, y) = c + g(x) + g(y) + h x y + β |x − y|, since max(x, y) = (x + y + |x − y|)/2.
fn by_order(order: &Order, kind: L2Kind) -> Double {
    let sum = |c: Double, g: fn(f64) -> Double, h: f64, beta: f64| {
        order.sum_over_pairs(&Kernel { c, g, h: Double::from(h), beta: Double::from(beta) })
    };
    let number = Double::from;
    let square = |x| Double::product(x, x);
    match kind {
        L2Kind::Star => sum(number(1.0), |x| Double::from(-0.5 * x), 0.0, -0.5),
        L2Kind::Extreme => sum(number(0.0), |x| Double::from(0.5 * x), -1.0, -0.5),
        L2Kind::Centred => sum(number(1.0), |x| distance_to_half(x).scaled(0.5), 0.0, -0.5),
        L2Kind::Mixture => {
            let g = |x| Double::product(x, x).scaled(0.5).minus(distance_to_half(x).scaled(0.25));
            sum(number(1.875), g, -1.0, -0.75)
        }
        L2Kind::Modified => sum(number(2.0), |x| Double::from(-0.5 * x), 0.0, -0.5),
        L2Kind::Symmetric => sum(number(2.0), |_| Double::from(0.0), 0.0, -2.0),
        L2Kind::WrapAround => sum(number(1.5), square, -2.0, -1.0),
        L2Kind::Periodic => sum(number(0.5), square, -2.0, -1.0),
        L2Kind::Diaphony => {
            let g = |x| PI_SQUARED.scaled(2.0).times(Double::product(x, x));
            let (h, beta) = (PI_SQUARED.scaled(-4.0), PI_SQUARED.scaled(-2.0));
            order.sum_over_pairs(&Kernel { c: peak_of_diaphony(), g, h, beta })
        }
    }
}

/// (1/n²) Σ_ij Π K over all pairs.
fn by_pairs(points: &Points, kind: L2Kind) -> Double {
    // A coordinate x comes with a = |x − ½|.
    type Axis = (f64, f64);
    let toroidal = |constant: f64| {
        move |(x, _): Axis, (y, _): Axis| {
            let t = (x - y).abs();
            constant - t * (1.0 - t)
        }
    };
    match kind {
        L2Kind::Star => mean_over_pairs(points, |(x, _), (y, _)| 1.0 - larger(x, y)),
        L2Kind::Extreme => mean_over_pairs(points, |(x, _), (y, _)| smaller(x, y) * (1.0 - larger(x, y))),
        L2Kind::Centred => mean_over_pairs(points, |(x, a), (y, b)| 1.0 + 0.5 * ((a + b) - (x - y).abs())),
        L2Kind::Mixture => mean_over_pairs(points, |(x, a), (y, b)| {
            let t = (x - y).abs();
            (1.875 - 0.25 * (a + b)) - t * (0.75 - 0.5 * t)
        }),
        L2Kind::Modified => mean_over_pairs(points, |(x, _), (y, _)| 2.0 - larger(x, y)),
        // The two of each axis is put back at the end.
        L2Kind::Symmetric => mean_over_pairs(points, |(x, _), (y, _)| 1.0 - (x - y).abs())
            .times(Double::from(2.0).power(points.dimension())),
        L2Kind::WrapAround => mean_over_pairs(points, toroidal(1.5)),
        L2Kind::Periodic => mean_over_pairs(points, toroidal(0.5)),
        L2Kind::Diaphony => {
            let at_zero = 1.0 + PI * PI / 3.0;
            mean_over_pairs(points, move |(x, _), (y, _)| {
                let t = (x - y).abs();
                at_zero - 2.0 * PI * PI * (t * (1.0 - t))
            })
        }
    }
}

/// Comparisons without the NaN rules of `f64::max`, which would cost the inner loop its vector instructions.
fn larger(x: f64, y: f64) -> f64 {
    if x > y { x } else { y }
}

fn smaller(x: f64, y: f64) -> f64 {
    if x < y { x } else { y }
}

/// (1/n²) Σ_ij Π_k K(x_ik, x_jk): rows j < i twice, the diagonal once; rows in parallel, their sums added in order.
fn mean_over_pairs(points: &Points, k: impl Fn((f64, f64), (f64, f64)) -> f64 + Sync) -> Double {
    let n = points.n();
    let axes: Vec<[Vec<f64>; 2]> = (0..points.dimension())
        .map(|axis| points.axis(axis))
        .map(|axis| [axis.iter().map(|x| (x - 0.5).abs()).collect(), axis])
        .map(|[halves, axis]| [axis, halves])
        .collect();
    let row = |i: usize| {
        let own = |[xs, halves]: &[Vec<f64>; 2]| (xs[i], halves[i]);
        let diagonal = axes.iter().map(|axis| k(own(axis), own(axis))).product::<f64>();
        let diagonal = if planted(Mutant::L2WithoutDiagonal) { 0.0 } else { diagonal };
        row_sum(&axes, i, &k).scaled(2.0).plus(Double::from(diagonal))
    };
    let rows: Vec<Double> = (0..n).into_par_iter().with_min_len(16).map(row).collect();
    rows.into_iter().fold(Double::from(0.0), Double::plus).over(n as f64).over(n as f64)
}

/// Points handled together in a row, one per lane: independent chains let the compiler use vector instructions.
const LANES: usize = 16;

/// Products that a lane adds plainly before it adds them with compensation: three roundings more, as many as one
/// more axis has.
const TURNS: usize = 4;

/// Σ_{j < i} Π_k K(x_ik, x_jk), each lane with its own compensation.
fn row_sum(axes: &[[Vec<f64>; 2]], i: usize, k: &impl Fn((f64, f64), (f64, f64)) -> f64) -> Double {
    let (mut high, mut low) = ([0.0; LANES], [0.0; LANES]);
    let whole = i - i % (TURNS * LANES);
    for group in (0..whole).step_by(TURNS * LANES) {
        let mut partial = [0.0; LANES];
        for start in (group..group + TURNS * LANES).step_by(LANES) {
            let mut products = [1.0; LANES];
            for [xs, halves] in axes {
                let own = (xs[i], halves[i]);
                let others = xs[start..start + LANES].iter().zip(&halves[start..start + LANES]);
                for (product, (x, half)) in products.iter_mut().zip(others) {
                    *product *= k(own, (*x, *half));
                }
            }
            partial.iter_mut().zip(products).for_each(|(sum, product)| *sum += product);
        }
        for lane in 0..LANES {
            let sum = Double::sum(high[lane], partial[lane]);
            high[lane] = sum.high;
            low[lane] += sum.low;
        }
    }
    let lanes = (0..LANES).map(|lane| Double::sum(high[lane], low[lane]));
    let product = |j: usize| axes.iter().map(|[xs, halves]| k((xs[i], halves[i]), (xs[j], halves[j]))).product::<f64>();
    let rest = (whole..i).map(|j| Double::from(product(j)));
    lanes.chain(rest).fold(Double::from(0.0), Double::plus)
}

#[cfg(test)]
mod tests {
    use super::*;
    use L2Kind::*;
    use proptest::prelude::*;
    use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

    fn runner(cases: u32) -> TestRunner {
        let config = Config { cases, failure_persistence: None, ..Config::default() };
        TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &[2; 32]))
    }

    /// Ties and ends of the interval among ordinary numbers.
    fn coordinate() -> impl Strategy<Value = f64> {
        prop_oneof![(0..=4_u8).prop_map(|k| f64::from(k) / 4.0), 0.0..1.0_f64]
    }

    fn set(dimension: usize, max_n: usize) -> impl Strategy<Value = Vec<Vec<f64>>> {
        prop::collection::vec(prop::collection::vec(coordinate(), dimension), 1..=max_n)
    }

    fn points(set: &[Vec<f64>]) -> Points {
        Points::new(set[0].len(), set.concat()).expect("in the unit cube")
    }

    fn squared(set: &[Vec<f64>], kind: L2Kind) -> f64 {
        l2_squared(&points(set), kind).expect("above resolution")
    }

    /// Twin: the formulas of [`L2Kind`] typed plainly, all n² pairs, no symmetry, no compensation.
    fn by_formula(set: &[Vec<f64>], kind: L2Kind) -> f64 {
        let (n, d) = (set.len() as f64, set[0].len() as i32);
        let h = |x: f64| {
            let a = (x - 0.5).abs();
            match kind {
                Star => (1.0 - x * x) / 2.0,
                Extreme => x * (1.0 - x) / 2.0,
                Centred => 1.0 + a / 2.0 - a * a / 2.0,
                Mixture => 5.0 / 3.0 - a / 4.0 - a * a / 4.0,
                Modified => (3.0 - x * x) / 2.0,
                Symmetric => 1.0 + 2.0 * x - 2.0 * x * x,
                WrapAround | Periodic | Diaphony => 0.0,
            }
        };
        let k = |x: f64, y: f64| {
            let (a, b, t) = ((x - 0.5).abs(), (y - 0.5).abs(), (x - y).abs());
            match kind {
                Star => 1.0 - x.max(y),
                Extreme => x.min(y) * (1.0 - x.max(y)),
                Centred => 1.0 + (a + b - t) / 2.0,
                Mixture => 15.0 / 8.0 - a / 4.0 - b / 4.0 - 3.0 * t / 4.0 + t * t / 2.0,
                Modified => 2.0 - x.max(y),
                Symmetric => 2.0 * (1.0 - t),
                WrapAround => 1.5 - t * (1.0 - t),
                Periodic => 0.5 - t * (1.0 - t),
                Diaphony => 1.0 + 2.0 * PI * PI * (t * t - t + 1.0 / 6.0),
            }
        };
        let singles: f64 = set.iter().map(|p| p.iter().map(|x| h(*x)).product::<f64>()).sum();
        let product = |p: &Vec<f64>, q: &Vec<f64>| p.iter().zip(q).map(|(x, y)| k(*x, *y)).product::<f64>();
        let pairs: f64 = set.iter().flat_map(|p| set.iter().map(move |q| product(p, q))).sum::<f64>() / (n * n);
        let c = |c: f64| c.powi(d) - 2.0 / n * singles + pairs;
        match kind {
            Star => c(1.0 / 3.0),
            Extreme => c(1.0 / 12.0),
            Centred => c(13.0 / 12.0),
            Mixture => c(19.0 / 12.0),
            Modified | Symmetric => c(4.0 / 3.0),
            WrapAround => pairs - (4.0_f64 / 3.0).powi(d),
            Periodic => pairs - (1.0_f64 / 3.0).powi(d),
            Diaphony => (pairs - 1.0) / ((1.0 + PI * PI / 3.0).powi(d) - 1.0),
        }
    }

    /// The twin adds up to 2500 products of size at most 2^d (diaphony: normalised) plainly: n² ε of them at worst.
    #[test]
    fn every_kind_equals_its_plain_formula() {
        for dimension in [1, 2, 3, 5] {
            runner(40)
                .run(&set(dimension, 50), |set| {
                    for kind in L2Kind::ALL {
                        let (ours, twin) = (squared(&set, kind), by_formula(&set, kind));
                        let bound = 2500.0 * f64::EPSILON * 2f64.powi(dimension as i32);
                        prop_assert!((ours - twin).abs() <= bound, "{kind:?}: {ours:e} {twin:e}");
                    }
                    Ok(())
                })
                .expect("equal");
        }
    }

    /// Moves a set and compares every kind of a list, to the rounding of moved coordinates (1e-16 a coordinate, slopes
    /// below 3 of D² in each, in 3-D products of up to 2²; diaphony's slope is 4π²/(its norm) and smaller).
    fn assert_invariant(kinds: &[L2Kind], change: impl Fn(&[Vec<f64>]) -> Vec<Vec<f64>>) {
        runner(40)
            .run(&set(3, 20), |set| {
                let moved = change(&set);
                for &kind in kinds {
                    let (before, after) = (squared(&set, kind), squared(&moved, kind));
                    prop_assert!((before - after).abs() <= 1e-14, "{kind:?}: {before:e} {after:e}");
                }
                Ok(())
            })
            .expect("invariant");
    }

    #[test]
    fn the_order_of_points_and_doubling_the_set_change_nothing() {
        assert_invariant(&L2Kind::ALL, |set| set.iter().rev().cloned().collect());
        assert_invariant(&L2Kind::ALL, |set| [set, set].concat());
    }

    #[test]
    fn the_order_of_axes_changes_nothing() {
        assert_invariant(&L2Kind::ALL, |set| set.iter().map(|p| vec![p[2], p[0], p[1]]).collect());
    }

    #[test]
    fn reflection_changes_only_the_kinds_anchored_at_the_origin() {
        let reflect = |set: &[Vec<f64>]| set.iter().map(|p| vec![1.0 - p[0], p[1], 1.0 - p[2]]).collect::<Vec<_>>();
        assert_invariant(&[Extreme, Centred, Mixture, Symmetric, WrapAround, Periodic, Diaphony], reflect);
        let set = vec![vec![0.1, 0.2, 0.3], vec![0.2, 0.4, 0.1]];
        for kind in [Star, Modified] {
            assert!((squared(&reflect(&set), kind) / squared(&set, kind) - 1.0).abs() > 0.01, "{kind:?}");
        }
    }

    #[test]
    fn a_toroidal_shift_changes_only_the_kinds_that_know_borders() {
        let wrap = |x: f64| if x >= 1.0 { x - 1.0 } else { x };
        let shift =
            |set: &[Vec<f64>]| set.iter().map(|p| vec![wrap(p[0] + 0.3), p[1], wrap(p[2] + 0.71)]).collect::<Vec<_>>();
        assert_invariant(&[WrapAround, Periodic, Diaphony], shift);
        let set = vec![vec![0.1, 0.2, 0.3], vec![0.2, 0.4, 0.1]];
        for kind in [Star, Extreme, Centred, Mixture, Modified, Symmetric] {
            assert!((squared(&shift(&set), kind) / squared(&set, kind) - 1.0).abs() > 0.01, "{kind:?}");
        }
    }

    /// n midpoints in one dimension (exact): 1/(12n²) and its multiples.
    #[test]
    fn midpoints_meet_their_closed_forms() {
        for n in [1_u32, 2, 10, 255, 1024] {
            let set: Vec<Vec<f64>> = (0..n).map(|i| vec![(f64::from(i) + 0.5) / f64::from(n)]).collect();
            let unit = 1.0 / (f64::from(n) * f64::from(n));
            for (kind, share) in [
                (Star, 12.0),
                (Centred, 12.0),
                (Modified, 12.0),
                (Extreme, 12.0),
                (WrapAround, 6.0),
                (Periodic, 6.0),
                (Mixture, 8.0),
                (Symmetric, 3.0),
            ] {
                let ours = squared(&set, kind);
                // Coordinates and products round at 1e-16, and D² is down to 8e-8.
                assert!((ours - unit / share).abs() <= 4e-16, "{kind:?} n = {n}: {ours:e} {:e}", unit / share);
            }
        }
    }

    #[test]
    fn coinciding_points_have_the_diaphony_of_one() {
        for d in 1..5 {
            let value = squared(&vec![vec![0.3; d]; 9], Diaphony);
            assert!((value - 1.0).abs() < 1e-14, "{value}");
        }
    }

    /// Means over 400 sets of 16 random points against the expectation. The relative spread of D² of one
    /// set is below 1, so the mean's standard error is below 0.05; six of them are allowed.
    #[test]
    fn random_points_meet_the_expectation_of_every_kind() {
        use rand_pcg::{Pcg64, rand_core::Rng};
        let mut rng = Pcg64::new(4, 1);
        for dimension in [1, 2, 4] {
            let mut sums = [0.0; 9];
            for _ in 0..400 {
                let flat = (0..16 * dimension).map(|_| (rng.next_u64() >> 11) as f64 * 0.5f64.powi(53)).collect();
                let set = Points::new(dimension, flat).expect("valid");
                for (sum, kind) in sums.iter_mut().zip(L2Kind::ALL) {
                    *sum += l2_squared(&set, kind).expect("above resolution") / 400.0;
                }
            }
            for (mean, kind) in sums.into_iter().zip(L2Kind::ALL) {
                let ratio = mean / kind.expected_squared_of_random(16, dimension);
                assert!((ratio - 1.0).abs() < 0.3, "{kind:?} in {dimension}-D: {ratio}");
            }
        }
    }

    #[test]
    fn the_bits_do_not_depend_on_the_number_of_threads() {
        let set: Vec<f64> = (0..3000_u32).map(|i| f64::from(i.wrapping_mul(2_654_435_769)) / 4_294_967_296.0).collect();
        let set = Points::new(3, set).expect("valid");
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| L2Kind::ALL.map(|kind| l2_squared(&set, kind).map(f64::to_bits)))
        };
        assert!(with(1) == with(2) && with(1) == with(7));
    }

    #[test]
    fn what_rounding_alone_could_make_is_below_resolution() {
        let at = |excess: f64| above_resolution(Double::from(excess), 6e-16).squared;
        assert_eq!([-1e-17, 0.0, 6e-16].map(at), [None; 3]);
        assert_eq!(at(7e-16), Some(7e-16));
    }

    /// Two ways to the same numbers; the pairs' products round.
    #[test]
    fn sums_by_order_equal_sums_over_pairs() {
        runner(60)
            .run(&set(2, 200), |set| {
                let points = points(&set);
                let order = Order::new(&points);
                for kind in L2Kind::ALL {
                    let n = set.len() as f64;
                    let by_order = by_order(&order, kind).over(n).over(n);
                    let difference = by_order.minus(by_pairs(&points, kind)).value();
                    let bound = 6.0 * f64::EPSILON * largest_term(kind, false).powi(2);
                    prop_assert!(difference.abs() <= bound, "{kind:?}: {difference:e}");
                }
                Ok(())
            })
            .expect("equal");
    }

    /// Hinrichs, Kritzinger & Pillichshammer; Halton & Zaremba: 2^17 points, where D² is 1e-10 and only the last digit of
    /// f64 may differ.
    #[test]
    fn in_the_plane_nothing_but_the_last_digit_is_lost() {
        let m = 17;
        let n = 1_u32 << m;
        let set: Vec<[f64; 2]> =
            (0..n).map(|i| [f64::from(i) / f64::from(n), f64::from(i.reverse_bits()) / 4_294_967_296.0]).collect();
        let set = Points::new_2d(&set).expect("valid");
        let (m, n) = (f64::from(m), f64::from(n));
        let star = m * m / 64.0 + 29.0 * m / 192.0 + 0.375 - m / (16.0 * n) + 0.25 / n - 1.0 / (72.0 * n * n);
        let extreme = m / 64.0 + 1.0 / 72.0 - 1.0 / (144.0 * n * n);
        let periodic = m / 16.0 + 1.0 / 9.0 + 1.0 / (36.0 * n * n);
        for (kind, truth) in [(Star, star), (Extreme, extreme), (Periodic, periodic)] {
            let found = l2(&set, kind);
            let ratio = found.squared.expect("above resolution") / (truth / (n * n));
            assert!((ratio - 1.0).abs() <= 4.0 * f64::EPSILON, "{kind:?}: {ratio}");
            assert!(found.resolution < 1e-23, "{kind:?}: {:e}", found.resolution);
        }
    }
}

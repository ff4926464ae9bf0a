//! L2 discrepancies: mean square gaps between counted and true measure, each over its own family of boxes.
//!
//! All have the shape D² = c^d − (2/n) Σ_i Π_k h(x_ik) + (1/n²) Σ_ij Π_k K(x_ik, x_jk), or −c^d + mean K for the
//! toroidal ones. Three terms of size 1 cancel down to (log n)^(d−1)/n², so the sums are kept to twice the digits
//! of f64 and only single products are rounded.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::mutants::{Mutant, planted};

use super::Points;

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

/// Squared L2 discrepancy of a kind; `None` where it is below the resolution of f64.
///
/// O(d n²/2) time in parallel, O(n) memory. The absolute error is at most about (d + 1) ε mean Π K (single products
/// round, sums do not) and typically far less, as roundings average out; a result not above that bound is `None`,
/// never a root of a negative number. The same bits on any number of threads: rows are added in order.
pub fn l2_squared(points: &Points, kind: L2Kind) -> Option<f64> {
    let toroidal = |constant: f64| move |x: f64, y: f64| constant - (x - y).abs() * (1.0 - (x - y).abs());
    let half = |x: f64| (x - 0.5).abs();
    match kind {
        L2Kind::Star => {
            // Powers of two are taken out of h and put back exactly.
            let h = |x| Double::from(1.0).minus(Double::product(x, x)).scaled(0.5);
            with_boxes(points, (1.0, 3.0), h, |x, y| 1.0 - larger(x, y))
        }
        L2Kind::Extreme => {
            let h = |x| Double::from(x).minus(Double::product(x, x)).scaled(0.5);
            with_boxes(points, (1.0, 12.0), h, |x, y| smaller(x, y) * (1.0 - larger(x, y)))
        }
        L2Kind::Centred => {
            let h = |x| {
                let a = half(x);
                Double::from(1.0).plus(Double::from(a).minus(Double::product(a, a)).scaled(0.5))
            };
            with_boxes(points, (13.0, 12.0), h, |x, y| 1.0 + 0.5 * (half(x) + half(y) - (x - y).abs()))
        }
        L2Kind::Mixture => {
            let h = |x| {
                let a = half(x);
                Double::ratio(5.0, 3.0).minus(Double::from(a).plus(Double::product(a, a)).scaled(0.25))
            };
            let k = |x: f64, y: f64| {
                let t = (x - y).abs();
                1.875 - 0.25 * (half(x) + half(y)) - t * (0.75 - 0.5 * t)
            };
            with_boxes(points, (19.0, 12.0), h, k)
        }
        L2Kind::Modified => {
            let h = |x| Double::from(3.0).minus(Double::product(x, x)).scaled(0.5);
            with_boxes(points, (4.0, 3.0), h, |x, y| 2.0 - larger(x, y))
        }
        L2Kind::Symmetric => {
            let h = |x| Double::from(1.0).plus(Double::from(x).minus(Double::product(x, x)).scaled(2.0));
            with_boxes(points, (4.0, 3.0), h, |x, y| 2.0 * (1.0 - (x - y).abs()))
        }
        L2Kind::WrapAround => on_torus(points, Double::ratio(4.0, 3.0), toroidal(1.5)),
        L2Kind::Periodic => on_torus(points, Double::ratio(1.0, 3.0), toroidal(0.5)),
        L2Kind::Diaphony => {
            let at_zero = 1.0 + PI * PI / 3.0;
            let k = move |x: f64, y: f64| {
                let t = (x - y).abs();
                at_zero - 2.0 * PI * PI * (t * (1.0 - t))
            };
            let norm = Double::from(at_zero).power(points.dimension()).minus(Double::from(1.0)).value();
            on_torus(points, Double::from(1.0), k).map(|sum| sum / norm)
        }
    }
}

/// Root of [`l2_squared`].
pub fn l2_root(points: &Points, kind: L2Kind) -> Option<f64> {
    l2_squared(points, kind).map(f64::sqrt)
}

/// Comparisons without the NaN rules of `f64::max`, which would cost the inner loop its vector instructions.
fn larger(x: f64, y: f64) -> f64 {
    if x > y { x } else { y }
}

fn smaller(x: f64, y: f64) -> f64 {
    if x < y { x } else { y }
}

/// c^d − (2/n) Σ Π h + mean Π K, with c as a ratio.
fn with_boxes(
    points: &Points,
    (numerator, denominator): (f64, f64),
    h: impl Fn(f64) -> Double,
    k: impl Fn(f64, f64) -> f64 + Sync,
) -> Option<f64> {
    let n = points.n() as f64;
    let singles = points.iter().map(|p| p.iter().fold(Double::from(1.0), |product, x| product.times(h(*x))));
    let singles = singles.fold(Double::from(0.0), Double::plus).scaled(2.0).over(n);
    let pairs = mean_over_pairs(points, k);
    let square = Double::ratio(numerator, denominator).power(points.dimension()).minus(singles).plus(pairs);
    above_resolution(square, pairs, points.dimension())
}

/// −c^d + mean Π K.
fn on_torus(points: &Points, c: Double, k: impl Fn(f64, f64) -> f64 + Sync) -> Option<f64> {
    let pairs = mean_over_pairs(points, k);
    above_resolution(pairs.minus(c.power(points.dimension())), pairs, points.dimension())
}

/// The value, if it is above what rounding of single products could make of nothing.
fn above_resolution(square: Double, pairs: Double, dimension: usize) -> Option<f64> {
    let resolution = (dimension + 1) as f64 * f64::EPSILON * pairs.value();
    Some(square.value()).filter(|v| *v > resolution)
}

/// (1/n²) Σ_ij Π_k K(x_ik, x_jk): rows j < i twice, the diagonal once; rows in parallel, their sums added in order.
fn mean_over_pairs(points: &Points, k: impl Fn(f64, f64) -> f64 + Sync) -> Double {
    let n = points.n();
    let axes: Vec<Vec<f64>> = (0..points.dimension()).map(|axis| points.axis(axis)).collect();
    let row = |i: usize| {
        let diagonal = axes.iter().map(|axis| k(axis[i], axis[i])).product::<f64>();
        let diagonal = if planted(Mutant::L2WithoutDiagonal) { 0.0 } else { diagonal };
        row_sum(&axes, i, &k).scaled(2.0).plus(Double::from(diagonal))
    };
    let rows: Vec<Double> = (0..n).into_par_iter().with_min_len(16).map(row).collect();
    rows.into_iter().fold(Double::from(0.0), Double::plus).over(n as f64).over(n as f64)
}

/// Points handled together in a row, one per lane: independent chains let the compiler use vector instructions.
const LANES: usize = 16;

/// Σ_{j < i} Π_k K(x_ik, x_jk), each lane with its own compensation.
fn row_sum(axes: &[Vec<f64>], i: usize, k: &impl Fn(f64, f64) -> f64) -> Double {
    let (mut high, mut low) = ([0.0; LANES], [0.0; LANES]);
    let whole = i - i % LANES;
    for start in (0..whole).step_by(LANES) {
        let mut products = [1.0; LANES];
        for axis in axes {
            let x = axis[i];
            for (product, y) in products.iter_mut().zip(&axis[start..start + LANES]) {
                *product *= k(x, *y);
            }
        }
        for lane in 0..LANES {
            let sum = Double::sum(high[lane], products[lane]);
            high[lane] = sum.high;
            low[lane] += sum.low;
        }
    }
    let lanes = (0..LANES).map(|lane| Double::sum(high[lane], low[lane]));
    let rest = (whole..i).map(|j| Double::from(axes.iter().map(|axis| k(axis[i], axis[j])).product::<f64>()));
    lanes.chain(rest).fold(Double::from(0.0), Double::plus)
}

/// The unevaluated sum of two f64, |low| ≤ ½ ulp(high): about 32 digits (Dekker 1971).
#[derive(Debug, Clone, Copy)]
struct Double {
    high: f64,
    low: f64,
}

impl From<f64> for Double {
    fn from(value: f64) -> Self {
        Self { high: value, low: 0.0 }
    }
}

impl Double {
    /// a + b exactly (Knuth's two-sum, no branch).
    fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let part = high - a;
        Self { high, low: (a - (high - part)) + (b - part) }
    }

    /// a · b exactly, by the fused multiply-add (one rounding by definition, on every machine).
    fn product(a: f64, b: f64) -> Self {
        let high = a * b;
        Self { high, low: libm::fma(a, b, -high) }
    }

    fn ratio(numerator: f64, denominator: f64) -> Self {
        Self::from(numerator).over(denominator)
    }

    fn value(self) -> f64 {
        self.high + self.low
    }

    fn plus(self, other: Self) -> Self {
        let sum = Self::sum(self.high, other.high);
        Self::sum(sum.high, sum.low + (self.low + other.low))
    }

    fn minus(self, other: Self) -> Self {
        self.plus(other.scaled(-1.0))
    }

    fn times(self, other: Self) -> Self {
        let product = Self::product(self.high, other.high);
        Self::sum(product.high, product.low + (self.high * other.low + self.low * other.high))
    }

    /// Times a power of two (or its negative): exact.
    fn scaled(self, power_of_two: f64) -> Self {
        Self { high: self.high * power_of_two, low: self.low * power_of_two }
    }

    fn over(self, divisor: f64) -> Self {
        let quotient = self.high / divisor;
        let back = Self::product(quotient, divisor);
        Self::sum(quotient, ((self.high - back.high) - back.low + self.low) / divisor)
    }

    fn power(self, exponent: usize) -> Self {
        (0..exponent).fold(Self::from(1.0), |product, _| product.times(self))
    }
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

    /// −1 + mean K of diaphony cannot show a value of 1e-17: 2^26 equidistant points would have it; the sum stands in.
    #[test]
    fn what_rounding_alone_could_make_is_below_resolution() {
        let at = |excess: f64| above_resolution(Double::from(excess), Double::from(1.0), 2);
        assert_eq!(at(-1e-17), None);
        assert_eq!(at(0.0), None);
        assert_eq!(at(6e-16), None);
        assert_eq!(at(7e-16), Some(7e-16));
    }

    #[test]
    fn doubled_digits_keep_what_f64_drops() {
        let third = Double::ratio(1.0, 3.0);
        let one = third.plus(third).plus(third);
        assert!((one.high - 1.0 + one.low).abs() < 1e-31);
        let square = third.times(third).minus(Double::ratio(1.0, 9.0));
        assert!(square.value().abs() < 1e-31);
        assert_eq!(Double::product(1.0 + f64::EPSILON, 1.0 - f64::EPSILON).low, -f64::EPSILON * f64::EPSILON);
    }
}

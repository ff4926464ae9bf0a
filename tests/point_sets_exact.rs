//! Point-set measures against exact integer arithmetic on sets that are made for trouble: ties, both ends of the interval,
//! neighbouring floats, one point, five dimensions. Nothing is shared with the library but the definitions.
//! No dice: the sets are fixed, and every tolerance is a stated resolution or a few roundings.

use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use sampler_lab::stats::discrepancy::{L2Kind, Points, l2, l2_all, min_toroidal_distance, star};

fn runner(cases: u32) -> TestRunner {
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &[14; 32]))
}

/// One in the units of coordinates of the exact L2 sums.
const ONE: i128 = 1 << 10;

/// Coordinates in units of 2^-10: crowded ones, ends, and any.
fn coarse() -> impl Strategy<Value = i128> {
    prop_oneof![Just(0), Just(ONE), (510..515_i128), (0..=8_i128).prop_map(|k| k * 128), 0..=ONE]
}

/// 24·ONE²·K(x, y): whole for every kind but diaphony. The formulas of METHODS §2, as whole numbers.
fn kernel(kind: L2Kind, x: i128, y: i128) -> i128 {
    let (a, b, t) = ((x - ONE / 2).abs(), (y - ONE / 2).abs(), (x - y).abs());
    let unit = 24 * ONE * ONE;
    match kind {
        L2Kind::Star => 24 * ONE * (ONE - x.max(y)),
        L2Kind::Extreme => 24 * x.min(y) * (ONE - x.max(y)),
        L2Kind::Centred => unit + 12 * ONE * (a + b - t),
        L2Kind::Mixture => 45 * ONE * ONE - 6 * ONE * (a + b) - 18 * ONE * t + 12 * t * t,
        L2Kind::Modified => 24 * ONE * (2 * ONE - x.max(y)),
        L2Kind::Symmetric => 48 * ONE * (ONE - t),
        L2Kind::WrapAround => 36 * ONE * ONE - 24 * t * (ONE - t),
        L2Kind::Periodic => 12 * ONE * ONE - 24 * t * (ONE - t),
        // 24·ONE²·B₂(t): the kernel is 1 + 2π² B₂.
        L2Kind::Diaphony => 24 * t * t - 24 * ONE * t + 4 * ONE * ONE,
    }
}

/// 24·ONE²·h(x), and 24·ONE²·c; h is `None` for the toroidal kinds.
fn single(kind: L2Kind, x: i128) -> Option<i128> {
    let a = (x - ONE / 2).abs();
    match kind {
        L2Kind::Star => Some(12 * (ONE * ONE - x * x)),
        L2Kind::Extreme => Some(12 * x * (ONE - x)),
        L2Kind::Centred => Some(24 * ONE * ONE + 12 * ONE * a - 12 * a * a),
        L2Kind::Mixture => Some(40 * ONE * ONE - 6 * ONE * a - 6 * a * a),
        L2Kind::Modified => Some(12 * (3 * ONE * ONE - x * x)),
        L2Kind::Symmetric => Some(24 * ONE * ONE + 48 * ONE * x - 48 * x * x),
        L2Kind::WrapAround | L2Kind::Periodic | L2Kind::Diaphony => None,
    }
}

fn centre(kind: L2Kind) -> i128 {
    let twelfths = match kind {
        L2Kind::Star | L2Kind::Periodic => 4,
        L2Kind::Extreme => 1,
        L2Kind::Centred => 13,
        L2Kind::Mixture => 19,
        L2Kind::Modified | L2Kind::Symmetric | L2Kind::WrapAround => 16,
        L2Kind::Diaphony => 0,
    };
    2 * ONE * ONE * twelfths
}

/// D² as a quotient of whole numbers, rounded once (twice in the last bits of f64). At most four dimensions.
fn exact_squared(set: &[Vec<i128>], kind: L2Kind) -> f64 {
    let (n, d) = (set.len() as i128, set[0].len() as u32);
    let product = |p: &[i128], q: &[i128]| p.iter().zip(q).map(|(x, y)| kernel(kind, *x, *y)).product::<i128>();
    let pairs: i128 = set.iter().flat_map(|p| set.iter().map(move |q| product(p, q))).sum();
    let singles: Option<i128> = set.iter().map(|p| p.iter().map(|x| single(kind, *x)).product::<Option<i128>>()).sum();
    let volume = n * n * centre(kind).pow(d);
    let numerator = singles.map_or(pairs - volume, |singles| volume - 2 * n * singles + pairs);
    numerator as f64 / (n * n * (24 * ONE * ONE).pow(d)) as f64
}

/// Diaphony of a set in one or two dimensions: with b_k = B₂(t_k), (2π² mean Σ b_k + 4π⁴ mean b₁ b₂)/((1 + π²/3)^d − 1), both
/// means exact and neither negative.
fn exact_diaphony(set: &[Vec<i128>]) -> f64 {
    let (n, d) = (set.len() as f64, set[0].len());
    let unit = (24 * ONE * ONE) as f64;
    let b = |p: &[i128], q: &[i128], k: usize| kernel(L2Kind::Diaphony, p[k], q[k]);
    let pairs = || set.iter().flat_map(|p| set.iter().map(move |q| (p, q)));
    let sum: i128 = pairs().map(|(p, q)| (0..d).map(|k| b(p, q, k)).sum::<i128>()).sum();
    let product: i128 = if d == 2 { pairs().map(|(p, q)| b(p, q, 0) * b(p, q, 1)).sum() } else { 0 };
    let square = std::f64::consts::PI.powi(2);
    let total = 2.0 * square * (sum as f64 / unit) + 4.0 * square * square * (product as f64 / (unit * unit));
    total / (n * n) / ((1.0 + square / 3.0).powi(d as i32) - 1.0)
}

fn points(set: &[Vec<i128>]) -> Points {
    let flat = set.iter().flatten().map(|x| *x as f64 / ONE as f64).collect();
    Points::new(set[0].len(), flat).expect("in the unit cube")
}

#[test]
fn l2_kinds_are_exact_to_their_stated_resolution() {
    let sets = (1..=4_usize, prop::collection::vec(prop::collection::vec(coarse(), 4), 1..24));
    runner(150)
        .run(&sets, |(d, set)| {
            let set: Vec<Vec<i128>> = set.into_iter().map(|p| p[..d].to_vec()).collect();
            for (kind, found) in l2_all(&points(&set)) {
                if kind == L2Kind::Diaphony && d > 2 {
                    continue;
                }
                let truth = if kind == L2Kind::Diaphony { exact_diaphony(&set) } else { exact_squared(&set, kind) };
                let squared = found.squared.expect("far above resolution");
                let bound = found.resolution + 8.0 * f64::EPSILON * truth;
                prop_assert!((squared - truth).abs() <= bound, "{kind:?} in {d}-D: {squared:e} {truth:e} ± {bound:e}");
                prop_assert!(found.resolution <= 1e-9 * truth, "{kind:?} in {d}-D: {:e}", found.resolution);
            }
            Ok(())
        })
        .expect("exact");
}

#[test]
fn l2_kinds_of_corners_and_copies_are_exact() {
    for d in 1..=4 {
        for n in [1, 2, 9] {
            for corner in [0, ONE, ONE / 2] {
                let set = vec![vec![corner; d]; n];
                for kind in L2Kind::ALL.into_iter().filter(|k| *k != L2Kind::Diaphony || d <= 2) {
                    let found = l2(&points(&set), kind);
                    let truth = if kind == L2Kind::Diaphony { exact_diaphony(&set) } else { exact_squared(&set, kind) };
                    let squared = found.squared.expect("far above resolution");
                    let bound = found.resolution + 8.0 * f64::EPSILON * truth;
                    assert!((squared - truth).abs() <= bound, "{n} × {corner} {kind:?} {d}-D: {squared:e} {truth:e}");
                }
            }
        }
    }
}

/// One in units of 2^-53, in which every float from ½ to 1 is whole.
const FINE: i128 = 1 << 53;

/// Neighbouring floats at four places, ends, and any.
fn fine() -> impl Strategy<Value = i128> {
    let crowd = (1..=4_i128, -2..=2_i128).prop_map(|(quarter, step)| (quarter * (FINE / 4) + step).min(FINE));
    prop_oneof![3 => crowd, 1 => Just(0), 1 => Just(FINE), 1 => 0..=FINE]
}

/// n·D*·2^53d by every box of the critical grid, in whole numbers: n Π q_k − count 2^53d or the other way round.
fn exact_star(set: &[Vec<i128>]) -> f64 {
    let (n, d) = (set.len() as i128, set[0].len());
    let grids: Vec<Vec<i128>> = (0..d).map(|k| set.iter().map(|p| p[k]).chain([FINE]).collect()).collect();
    let scale = FINE.pow(d as u32);
    let mut worst = 0;
    for code in 0..(set.len() + 1).pow(d as u32) {
        let mut rest = code;
        let corner: Vec<i128> = grids
            .iter()
            .map(|grid| {
                let q = grid[rest % grid.len()];
                rest /= grid.len();
                q
            })
            .collect();
        let volume: i128 = n * corner.iter().product::<i128>();
        let count = |inside: fn(&i128, &i128) -> bool| {
            set.iter().filter(|p| p.iter().zip(&corner).all(|(x, q)| inside(x, q))).count() as i128 * scale
        };
        worst = worst.max(volume - count(i128::lt)).max(count(i128::le) - volume);
    }
    worst as f64 / scale as f64 / n as f64
}

#[test]
fn the_star_discrepancy_of_neighbouring_floats_is_exact() {
    let sets = (1..=2_usize, prop::collection::vec(prop::collection::vec(fine(), 2), 1..20));
    runner(200)
        .run(&sets, |(d, set)| {
            let set: Vec<Vec<i128>> = set.into_iter().map(|p| p[..d].to_vec()).collect();
            let flat = set.iter().flatten().map(|x| *x as f64 / FINE as f64).collect();
            let found = star(&Points::new(d, flat).expect("in the unit cube"), 1e9).expect("cheap");
            let truth = exact_star(&set);
            prop_assert!((found.value - truth).abs() <= 1e-14, "{} {truth}", found.value);
            Ok(())
        })
        .expect("exact");
}

/// In five dimensions coordinates are multiples of 1/4 and the volume has ten binary digits: f64 is exact, and so is the
/// definition by every box.
#[test]
fn the_star_discrepancy_in_five_dimensions_is_exact() {
    let sets = prop::collection::vec(prop::collection::vec(0..=4_u8, 5), 1..6);
    runner(60)
        .run(&sets, |set| {
            let set: Vec<Vec<f64>> = set.iter().map(|p| p.iter().map(|k| f64::from(*k) / 4.0).collect()).collect();
            let mut worst = 0.0_f64;
            for code in 0..5_usize.pow(5) {
                let corner: Vec<f64> = (0..5).map(|k| (code / 5_usize.pow(k) % 5) as f64 / 4.0).collect();
                let share = |inside: fn(&f64, &f64) -> bool| {
                    let within = |p: &&Vec<f64>| p.iter().zip(&corner).all(|(x, q)| inside(x, q));
                    set.iter().filter(within).count() as f64 / set.len() as f64
                };
                let volume: f64 = corner.iter().product();
                // Corners that no point touches belong to no critical grid, and have smaller gaps.
                worst = worst.max(volume - share(f64::lt)).max(share(f64::le) - volume);
            }
            let found = star(&Points::new(5, set.concat()).expect("valid"), 1e9).expect("cheap");
            prop_assert!((found.value - worst).abs() <= 1e-14, "{} {worst}", found.value);
            Ok(())
        })
        .expect("exact");
}

#[test]
fn the_smallest_distance_is_exact() {
    let sets = prop::collection::vec(prop::collection::vec(fine(), 2), 2..40);
    runner(200)
        .run(&sets, |set| {
            let along = |a: i128, b: i128| (a - b).abs().min(FINE - (a - b).abs());
            let squared = |p: &[i128], q: &[i128]| along(p[0], q[0]).pow(2) + along(p[1], q[1]).pow(2);
            let pairs = (0..set.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
            let least = pairs.map(|(i, j)| squared(&set[i], &set[j])).min().expect("a pair");
            let truth = (least as f64).sqrt() / FINE as f64;
            let flat = set.iter().flatten().map(|x| *x as f64 / FINE as f64).collect();
            let found = min_toroidal_distance(&Points::new(2, flat).expect("valid")).expect("two points");
            prop_assert!((found - truth).abs() <= 4.0 * f64::EPSILON * truth, "{found:e} {truth:e}");
            Ok(())
        })
        .expect("exact");
}

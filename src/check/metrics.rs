//! Point-set metrics against exact values and slow twins.

use super::{Check, Context, Finding, Kind, Tally};
use crate::sampling::hash::bits64;
use crate::stats::discrepancy::{
    L2Kind, Points, Side, Star, filled_strata, l2, min_toroidal_distance, star, star_2d, t_of_projections, t_value,
};
use crate::stats::hypothesis::t_test_of_squares;
use crate::stats::spectrum::{Spectrum, expected_of_jittered, power_at};
use crate::stats::t_test;

/// The checks of this group.
pub fn checks() -> Vec<Check> {
    let check = |name, claim, kind, run| Check { name, group: "metrics", claim, failures: &[], kind, run };
    vec![
        check(
            "star-by-definition",
            "star discrepancies in 1 to 4 dimensions are the largest gap of all boxes, and their box shows it",
            Kind::Exact,
            star_by_definition,
        ),
        check(
            "hammersley-closed-forms",
            "star, L2-star, extreme and periodic discrepancy of Hammersley sets meet their closed forms",
            Kind::Exact,
            hammersley_closed_forms,
        ),
        check(
            "l2-invariances",
            "L2 kinds change under shift and reflection where they should, and nowhere else; their resolution holds",
            Kind::Exact,
            l2_invariances,
        ),
        check(
            "l2-of-random-points",
            "the mean square of every L2 kind over independent points is its expectation",
            Kind::Statistical,
            l2_of_random_points,
        ),
        check(
            "nets-and-distances",
            "t-values, strata and distances of nets, diagonals, lattices and duplicates are the known ones",
            Kind::Exact,
            nets_and_distances,
        ),
        check(
            "spectrum-of-lattices",
            "lattices have power n on their dual lattice alone, and powers add up (Parseval)",
            Kind::Exact,
            spectrum_of_lattices,
        ),
        check(
            "spectrum-of-random-points",
            "mean power is 1 for independent and 1 − sinc² sinc² for jittered points",
            Kind::Statistical,
            spectrum_of_random_points,
        ),
    ]
}

/// A number in [0, 1) of 53 bits.
fn unit(seed: u64, index: u64) -> f64 {
    (bits64(seed, index) >> 11) as f64 * (0.5_f64).powi(53)
}

pub(super) fn plane(set: &[[f64; 2]]) -> Points {
    Points::new_2d(set).expect("in the unit square")
}

pub(super) fn hammersley(m: u32) -> Points {
    let n = 1_u32 << m;
    let y = |i: u32| f64::from(i.reverse_bits()) / 4_294_967_296.0;
    plane(&(0..n).map(|i| [f64::from(i) / f64::from(n), y(i)]).collect::<Vec<_>>())
}

/// D* from its definition: every corner of the critical grid, every point compared with it.
pub(super) fn by_every_box(points: &Points) -> f64 {
    let d = points.dimension();
    let grid = |k: usize| -> Vec<f64> { points.iter().map(|p| p[k]).chain([1.0]).collect() };
    let grids: Vec<Vec<f64>> = (0..d).map(grid).collect();
    let n = points.n() as f64;
    let mut worst = f64::NEG_INFINITY;
    let mut corner = vec![0.0; d];
    for code in 0..(points.n() + 1).pow(d as u32) {
        let mut rest = code;
        for (q, grid) in corner.iter_mut().zip(&grids) {
            *q = grid[rest % grid.len()];
            rest /= grid.len();
        }
        let count = |inside: fn(&f64, &f64) -> bool| {
            points.iter().filter(|p| p.iter().zip(&corner).all(|(x, q)| inside(x, q))).count() as f64 / n
        };
        let volume: f64 = corner.iter().product();
        worst = worst.max(volume - count(f64::lt)).max(count(f64::le) - volume);
    }
    worst
}

/// What the box of a star discrepancy shows, counted anew.
pub(super) fn shown_by_box(points: &Points, star: &Star) -> f64 {
    let inside = |p: &&[f64]| p.iter().zip(&star.corner).all(|(x, q)| x < q || (x == q && star.side == Side::Closed));
    let share = points.iter().filter(inside).count() as f64 / points.n() as f64;
    (share - star.corner.iter().product::<f64>()).abs()
}

/// Random sets with ties, ends of the interval and neighbouring floats. Counts and volumes round to a few ε.
fn star_by_definition(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let mut number = 0;
    for (d, n, sets) in [(1, 40, 20), (2, 30, 40), (3, 9, 20), (4, 5, 10)] {
        for set in 0..context.replicates(sets, 3) {
            let mut coordinate = || {
                number += 1;
                let bits = bits64(context.seed_of(0, d as u64), number);
                let place = f64::from((bits >> 8) as u8 % 6) / 5.0;
                match bits % 4 {
                    0 => place,
                    1 => (place + f64::EPSILON / 2.0).min(1.0),
                    2 => (place - f64::EPSILON / 2.0).max(0.0),
                    _ => unit(bits, 0),
                }
            };
            let size = 1 + (set as usize * 7) % n;
            let points = Points::new(d, (0..size * d).map(|_| coordinate()).collect()).expect("in the unit cube");
            let what = format!("{size} points in {d}-D");
            match star(&points, 1e9) {
                Ok(found) => {
                    tally.near(format!("{what}, the box"), shown_by_box(&points, &found), found.value, 1e-15);
                    tally.near(what, found.value, by_every_box(&points), 1e-14);
                }
                Err(cost) => {
                    tally.fact(format!("{what}: {cost}"), false);
                }
            }
        }
    }
    tally.saying("every set within 1e-14 of the largest gap of all its boxes")
}

/// Halton & Zaremba 1969; Hinrichs, Kritzinger & Pillichshammer 2020.
fn hammersley_closed_forms(_: &Context) -> Finding {
    let mut tally = Tally::new();
    for m in 2..=14_u32 {
        let points = hammersley(m);
        let (n, k) = (points.n() as f64, f64::from(m));
        let sign = if m.is_multiple_of(2) { 1.0 } else { -1.0 };
        let found = star_2d(&points);
        let truth = (k / 3.0 + 13.0 / 9.0 - sign * 4.0 / (9.0 * n)) / n;
        tally.near(format!("star, m = {m}"), found.value, truth, 1e-14);
        tally.near(format!("star's box, m = {m}"), shown_by_box(&points, &found), found.value, 1e-15);
        let star = k * k / 64.0 + 29.0 * k / 192.0 + 0.375 - k / (16.0 * n) + 0.25 / n - 1.0 / (72.0 * n * n);
        let extreme = k / 64.0 + 1.0 / 72.0 - 1.0 / (144.0 * n * n);
        let periodic = k / 16.0 + 1.0 / 9.0 + 1.0 / (36.0 * n * n);
        for (kind, scaled) in [(L2Kind::Star, star), (L2Kind::Extreme, extreme), (L2Kind::Periodic, periodic)] {
            let ratio = l2(&points, kind).squared.map_or(f64::NAN, |squared| squared * n * n / scaled);
            // Only the last digits of the quotient itself round.
            tally.near(format!("{} over its closed form, m = {m}", kind.name()), ratio, 1.0, 1e-14);
        }
        tally.fact(format!("t = 0, m = {m}"), t_value(&points) == Some(0));
    }
    tally.saying("m = 2 to 14: star within 1e-14, L2 kinds within 1e-14 of their value")
}

/// Coordinates are multiples of 2^-20, so that shifts and reflections are exact and only the sums may differ.
fn l2_invariances(context: &Context) -> Finding {
    use L2Kind::{Centred, Diaphony, Extreme, Mixture, Modified, Periodic, Star, Symmetric, WrapAround};
    let mut tally = Tally::new();
    for d in 1..=4_usize {
        let set: Vec<f64> =
            (0..60 * d as u64).map(|i| (bits64(context.seed_of(1, d as u64), i) >> 44) as f64 / 1_048_576.0).collect();
        let points = |set: Vec<f64>| Points::new(d, set).expect("in the unit cube");
        let original = points(set.clone());
        let changed: [(&str, Vec<f64>, &[L2Kind]); 4] = [
            ("shift", set.iter().map(|x| (x + 0.375).fract()).collect(), &[WrapAround, Periodic, Diaphony]),
            (
                "reflection",
                set.iter().map(|x| 1.0 - x).collect(),
                &[Extreme, Centred, Mixture, Symmetric, WrapAround, Periodic, Diaphony],
            ),
            ("order of points", set.chunks_exact(d).rev().flatten().copied().collect(), &L2Kind::ALL),
            ("doubled set", [set.clone(), set.clone()].concat(), &L2Kind::ALL),
        ];
        for (change, moved, unchanged) in changed {
            let moved = points(moved);
            for kind in L2Kind::ALL {
                let (before, after) = (l2(&original, kind), l2(&moved, kind));
                let (a, b) = (before.squared.unwrap_or(f64::NAN), after.squared.unwrap_or(f64::NAN));
                let what = format!("{} in {d}-D under {change}", kind.name());
                if unchanged.contains(&kind) {
                    // Each is right to its resolution and to the last digit.
                    tally.near(what, b, a, before.resolution + after.resolution + f64::EPSILON * a);
                } else if d > 1 && (matches!(kind, Star | Modified) || change == "shift") {
                    // On the line several kinds are multiples of each other, and of toroidal ones.
                    tally.fact(format!("{what} changes: {a:.6e} and {b:.6e}"), (b / a - 1.0).abs() > 1e-6);
                }
            }
        }
    }
    tally.saying("nine kinds in 1 to 4 dimensions under four changes, within their stated resolutions")
}

/// Replicated sets of 32 points; a departure of some percent is caught.
fn l2_of_random_points(context: &Context) -> Finding {
    let family = context.family(27);
    let mut tally = Tally::new();
    for d in [1, 2, 4_usize] {
        let sets: Vec<Points> = (0..u64::from(context.replicates(2000, 2000)))
            .map(|r| {
                let seed = context.seed_of(d as u64, r);
                Points::new(d, (0..32 * d as u64).map(|i| unit(seed, i)).collect()).expect("in the unit cube")
            })
            .collect();
        for kind in L2Kind::ALL {
            let squares: Vec<f64> = sets.iter().map(|set| l2(set, kind).squared.unwrap_or(0.0)).collect();
            let truth = kind.expected_squared_of_random(32, d);
            tally.verdict(format!("E {}² in {d}-D", kind.name()), &t_test_of_squares(&squares, truth, family), truth);
        }
    }
    tally.finish()
}

fn nets_and_distances(context: &Context) -> Finding {
    let mut tally = Tally::new();
    for m in 1..=12_u32 {
        let n = 1_usize << m;
        let net = hammersley(m);
        tally.fact(format!("Hammersley's t = 0, m = {m}"), t_value(&net) == Some(0));
        tally.fact(format!("Hammersley fills all strata, m = {m}"), filled_strata(&net) == [n, n]);
        let space = Points::new(3, net.iter().flat_map(|p| [p[0], p[1], p[0]]).collect()).expect("in the unit cube");
        let t: Option<Vec<u32>> = t_of_projections(&space).map(|all| all.iter().map(|p| p.t).collect());
        tally.fact(format!("a repeated axis shows in one projection, m = {m}"), t == Some(vec![0, m - 1, 0]));
        tally.fact(format!("and in the whole, m = {m}"), t_value(&space) == Some(m - 1));
    }
    let lattice =
        |k: u32| plane(&(0..k * k).map(|i| [i % k, i / k].map(|j| f64::from(j) / f64::from(k))).collect::<Vec<_>>());
    for k in [2_u32, 8, 64, 256] {
        let found = min_toroidal_distance(&lattice(k)).unwrap_or(f64::NAN);
        tally.near(format!("distance of a {k} × {k} lattice"), found, 1.0 / f64::from(k), 1e-15);
    }
    let mut random: Vec<[f64; 2]> =
        (0..3000).map(|i| [unit(context.seed, 2 * i), unit(context.seed, 2 * i + 1)]).collect();
    let along = |a: f64, b: f64| (a - b).abs().min(1.0 - (a - b).abs());
    let squared = |a: &[f64; 2], b: &[f64; 2]| along(a[0], b[0]).powi(2) + along(a[1], b[1]).powi(2);
    let pairs = (0..random.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let twin = pairs.map(|(i, j)| squared(&random[i], &random[j])).fold(f64::INFINITY, f64::min).sqrt();
    tally.near("distance of random points", min_toroidal_distance(&plane(&random)).unwrap_or(f64::NAN), twin, 1e-16);
    random.push(random[1234]);
    tally.fact("a duplicate has distance 0", min_toroidal_distance(&plane(&random)) == Some(0.0));
    tally.saying("t, projections, strata and distances as known")
}

fn spectrum_of_lattices(_: &Context) -> Finding {
    let mut tally = Tally::new();
    for (n, g) in [(55_u32, 34_u32), (256, 95)] {
        let set: Vec<[f64; 2]> = (0..n).map(|i| [i, g * i % n].map(|k| f64::from(k) / f64::from(n))).collect();
        let spectrum = Spectrum::of(&plane(&set), 40);
        for (nu, power) in spectrum.half_plane() {
            let dual = (i64::from(nu[0]) + i64::from(g) * i64::from(nu[1])).rem_euclid(i64::from(n)) == 0;
            let truth = if dual { f64::from(n) } else { 0.0 };
            tally.near(format!("lattice of {n}, P{nu:?}"), power, truth, 1e-12 * f64::from(n));
        }
    }
    let net = hammersley(6);
    let spectrum = Spectrum::of(&net, 63);
    let sum: f64 = (0..64).flat_map(|a| (0..64).map(move |b| [a, b])).filter_map(|nu| spectrum.at(nu)).sum();
    tally.near("Σ P over a period of Hammersley's 64", sum / 4096.0, 1.0, 1e-12);
    for nu in [[3, -2], [21, 1], [40, 63]] {
        let at = spectrum.at(nu).unwrap_or(f64::NAN);
        tally.near(format!("P{nu:?} alone and among all"), at, power_at(&net, &nu), 1e-12 * 64.0);
    }
    tally.saying("dual lattices, Parseval's sum and single frequencies within 1e-12 n")
}

/// Means over frequencies are formed set by set, so replicates are independent whatever frequencies are.
fn spectrum_of_random_points(context: &Context) -> Finding {
    let family = context.family(4);
    let (side, reach) = (8_u32, 16);
    let excess = |jittered: bool, inner: bool| -> Vec<f64> {
        let part = 10 + u64::from(jittered);
        (0..u64::from(context.replicates(800, 30)))
            .map(|r| {
                let seed = context.seed_of(part, r);
                let at = |i: u32, k: u64| {
                    let u = unit(seed, u64::from(i) * 2 + k);
                    let stratum = f64::from(if k == 0 { i % side } else { i / side });
                    if jittered { (stratum + u) / f64::from(side) } else { u }
                };
                let set: Vec<[f64; 2]> = (0..side * side).map(|i| [at(i, 0), at(i, 1)]).collect();
                let spectrum = Spectrum::of(&plane(&set), reach);
                let expected = |nu| if jittered { expected_of_jittered(side, nu) } else { 1.0 };
                let within = |nu: &[i32; 2]| !inner || nu.iter().all(|k| k.unsigned_abs() <= side / 2);
                let differences: Vec<f64> =
                    (spectrum.half_plane().filter(|(nu, _)| within(nu))).map(|(nu, p)| p - expected(nu)).collect();
                differences.iter().sum::<f64>() / differences.len() as f64
            })
            .collect()
    };
    let mut tally = Tally::new();
    for (what, jittered, inner) in [
        ("independent points, all frequencies", false, false),
        ("independent points, low frequencies", false, true),
        ("jittered points, all frequencies", true, false),
        ("jittered points, low frequencies", true, true),
    ] {
        tally.verdict(what, &t_test(&excess(jittered, inner), 0.0, family), 0.0);
    }
    tally.finish()
}

#[cfg(test)]
mod tests {
    use crate::check::{Settings, run};

    /// Two of them throw dice, each at its share of 1e-7 for all checks there are.
    #[test]
    fn the_checks_of_metrics_hold() {
        for check in super::checks() {
            // False alarms: stated in tests/failure_modes.rs, with those of all checks of the registry.
            let found = run(&check, &Settings { alpha: 1e-7, ..Settings::default() }).finding;
            println!("{}: {}", check.name, found.says);
            assert!(found.passed, "{}: {}", check.name, found.says);
        }
    }
}

//! Where measures of point sets fail: single precision, frequencies that meet the lattice, ties.

use super::super::metrics::{by_every_box, hammersley, plane, shown_by_box};
use super::super::{Check, Context, Finding, Kind, Tally};
use crate::sampling::hash::bits64;
use crate::stats::discrepancy::{L2Kind, Points, Side, l2, star_2d};
use crate::stats::spectrum::{Spectrum, power_at};

/// The checks of this group.
pub fn checks() -> Vec<Check> {
    let check = |name, failures, claim, run| Check {
        name,
        group: "failures: metrics",
        claim,
        failures,
        kind: Kind::Exact,
        run,
    };
    vec![
        check(
            "warnock-in-single-precision",
            &[30],
            "summed in f32, L2-star² of 4096 points is wrong by more than itself; ours has 13 digits and a stated resolution",
            warnock_in_single_precision,
        ),
        check(
            "stripes-meet-the-lattice",
            &[62],
            "stripes of a lattice's own frequency come out all black or white: a spike of P(ν) = n, where jitter has 1",
            stripes_meet_the_lattice,
        ),
        check(
            "star-of-ties",
            &[63],
            "counting only points inside, or only those up to the far faces, misses ties; the exact star does not",
            star_of_ties,
        ),
    ]
}

/// Warnock's formula as it is written, every number in f32.
fn warnock_f32(points: &Points) -> f32 {
    let set: Vec<[f32; 2]> = points.iter().map(|p| [p[0] as f32, p[1] as f32]).collect();
    let n = set.len() as f32;
    let singles: f32 = set.iter().map(|[x, y]| (1.0 - x * x) * (1.0 - y * y) / 4.0).sum();
    let mut pairs = 0.0_f32;
    for [x, y] in &set {
        for [u, v] in &set {
            pairs += (1.0 - x.max(*u)) * (1.0 - y.max(*v));
        }
    }
    1.0 / 9.0 - 2.0 / n * singles + pairs / n / n
}

fn warnock_in_single_precision(_: &Context) -> Finding {
    let points = hammersley(12);
    let (m, n) = (12.0, 4096.0_f64);
    let truth = (m * m / 64.0 + 29.0 * m / 192.0 + 0.375 - m / (16.0 * n) + 0.25 / n - 1.0 / (72.0 * n * n)) / (n * n);
    let single = f64::from(warnock_f32(&points));
    let ours = l2(&points, L2Kind::Star);
    let squared = ours.squared.unwrap_or(f64::NAN);
    let mut tally = Tally::new();
    tally.fact(format!("f32 gives {single:e}, the truth is {truth:e}"), (single - truth).abs() > truth);
    tally.near("ours over the closed form", squared / truth, 1.0, 1e-13);
    tally.fact("the resolution is far below the value", ours.resolution < 1e-10 * truth);
    tally.saying(format!(
        "L2-star² of 4096 Hammersley points: f32 {single:.3e}, closed form {truth:.6e}, ours {squared:.6e} ± {:.0e}",
        ours.resolution
    ))
}

/// Share of points on the white stripes of k periods: ½ in truth.
fn white_share(points: &Points, periods: f64) -> f64 {
    points.iter().filter(|p| (p[0] * periods).fract() < 0.5).count() as f64 / points.n() as f64
}

fn stripes_meet_the_lattice(context: &Context) -> Finding {
    let k = 32_u32;
    let cells: Vec<[u32; 2]> = (0..k * k).map(|i| [i % k, i / k]).collect();
    let at = |offset: &dyn Fn(u64) -> f64| {
        let place = |cell: &[u32; 2], axis: usize| {
            let index = u64::from(cell[1] * k + cell[0]) * 2 + axis as u64;
            (f64::from(cell[axis]) + offset(index)) / f64::from(k)
        };
        plane(&cells.iter().map(|cell| [place(cell, 0), place(cell, 1)]).collect::<Vec<_>>())
    };
    let grid = at(&|_| 0.25);
    let jittered = at(&|i| (bits64(context.seed, i) >> 11) as f64 * 0.5_f64.powi(53));
    let lattice = plane(&(0..987_u32).map(|i| [i, 610 * i % 987].map(|j| f64::from(j) / 987.0)).collect::<Vec<_>>());
    let n = f64::from(k * k);
    let frequency = [k as i32, 0];
    let mut tally = Tally::new();
    tally.near("share of white on the grid", white_share(&grid, f64::from(k)), 1.0, 0.0);
    tally.near("P(k, 0) of the grid over n", power_at(&grid, &frequency) / n, 1.0, 1e-12);
    // Jittered: 1024 independent tosses, so |share − ½| > 0.16 has probability below 2 exp(−2·1024·0.16²) = 3e-23.
    let share = white_share(&jittered, f64::from(k));
    tally.near("share of white with jitter", share, 0.5, 0.16);
    // P is exponentially distributed there: above 60 with probability e^-60.
    let power = power_at(&jittered, &frequency);
    tally.fact(format!("P(k, 0) with jitter is {power:.2}"), power < 60.0);
    let peak = Spectrum::of(&lattice, 63).peak();
    let is_dual = peak.is_some_and(|p| (p.frequency[0] + 610 * p.frequency[1]).rem_euclid(987) == 0);
    tally.fact(format!("a rank-1 lattice's largest power is n, at its dual lattice: {peak:?}"), is_dual);
    tally.near("that power over n", peak.map_or(f64::NAN, |p| p.power / 987.0), 1.0, 1e-10);
    tally.saying(format!(
        "{k} stripes: the {k} × {k} grid sees {:.0} % white, P = {:.0} = n; jitter sees {:.1} %, P = {power:.2}",
        100.0 * white_share(&grid, f64::from(k)),
        power_at(&grid, &frequency),
        100.0 * share,
    ))
}

/// The largest |count/n − volume| over the critical grid when points on the far faces are always in, or always out.
fn one_sided(points: &Points, side: Side) -> f64 {
    let grid = |axis: usize| -> Vec<f64> { points.iter().map(|p| p[axis]).chain([1.0]).collect() };
    let (xs, ys) = (grid(0), grid(1));
    let inside = |p: &&[f64], x: f64, y: f64| match side {
        Side::Open => p[0] < x && p[1] < y,
        Side::Closed => p[0] <= x && p[1] <= y,
    };
    let gap = |x: f64, y: f64| {
        let count = points.iter().filter(|p| inside(p, x, y)).count() as f64;
        (count / points.n() as f64 - x * y).abs()
    };
    xs.iter().flat_map(|x| ys.iter().map(move |y| (*x, *y))).map(|(x, y)| gap(x, y)).fold(0.0, f64::max)
}

fn star_of_ties(_: &Context) -> Finding {
    let ulp = f64::EPSILON / 2.0;
    let corner = |at: f64| plane(&[[at, at]; 5]);
    let mut tally = Tally::new();
    tally.near("points at 1, closed boxes alone", one_sided(&corner(1.0), Side::Closed), 0.0, 0.0);
    tally.near("points at 0, open boxes alone", one_sided(&corner(0.0), Side::Open), 0.0, 0.0);
    let sets = [
        ("all at 1", corner(1.0), Some(1.0)),
        ("all at 0", corner(0.0), Some(1.0)),
        ("the four corners", plane(&[[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]), Some(0.75)),
        ("one centre, thrice", plane(&[[0.5, 0.5]; 3]), Some(0.75)),
        ("a column", plane(&[[0.5, 0.1], [0.5, 0.4], [0.5, 0.9], [0.5, 0.4]]), None),
        ("a rounding apart", plane(&[[0.5, 0.25], [0.5 + ulp, 0.75], [0.5 - ulp, 0.5], [0.5, 0.25 + ulp]]), None),
        ("a rounding from the ends", plane(&[[1.0 - ulp, 1.0], [1.0, 1.0 - ulp], [f64::MIN_POSITIVE, 0.0]]), None),
        (
            "a lattice of ties",
            plane(&(0..36).map(|i| [f64::from(i % 6) / 6.0, f64::from(i / 6) / 6.0]).collect::<Vec<_>>()),
            None,
        ),
    ];
    for (what, points, known) in &sets {
        let found = star_2d(points);
        tally.near(format!("{what}: D*"), found.value, by_every_box(points), 1e-15);
        tally.near(format!("{what}: its box"), shown_by_box(points, &found), found.value, 1e-15);
        if let Some(known) = known {
            tally.near(format!("{what}: by hand"), found.value, *known, 1e-15);
        }
    }
    tally
        .saying("five points at (1, 1): closed boxes alone say 0, D* = 1; tied and neighbouring points as by every box")
}

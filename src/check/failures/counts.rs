//! Where the count of samples does not fit the method: prefixes, points beyond the end, counts without a grid, two passes.

use crate::experiment::variant::Variant;
use crate::sampling::strata::factor_pair;
use crate::sampling::{PointSource, Sampler};
use crate::stats::t_test;

use super::super::{Check, Context, Finding, Kind, Tally};
use super::common::{Point, Tickets, all, cell_counts, distinct, mean, pixel, points, spec, star};

/// The checks of this file.
pub fn checks() -> Vec<Check> {
    let check =
        |name, claim, failures, kind, run| Check { name, group: "failures: counts", claim, failures, kind, run };
    vec![
        check(
            "hammersley-prefix",
            "the first k of n Hammersley points reach x = k/n: half a set has D* ≥ ½; a set made for k points is even",
            &[12],
            Kind::Exact,
            hammersley_prefix,
        ),
        check(
            "hammersley-beyond-n",
            "Hammersley's point n has x = 1; ours is refused, and a set for n + 1 points is another set, below 1",
            &[13],
            Kind::Exact,
            hammersley_beyond,
        ),
        check(
            "strata-without-a-grid",
            "⌊√n⌋² or ⌈√n⌉² strata for n = 6, 7, 13 are filled unequally; ours takes the next count with a grid, all cells equal",
            &[14],
            Kind::Statistical,
            strata_without_a_grid,
        ),
        check(
            "strata-drawn-twice",
            "a stratified counter run past n leaves the square or repeats its cells; ours is refused, and 2n samples have 2n cells",
            &[15],
            Kind::Exact,
            strata_drawn_twice,
        ),
        check(
            "two-passes",
            "two passes of 1 and n − 1 samples with restarted samplers use Halton's first point twice: 63 different points of 64; one pass, 64",
            &[65],
            Kind::Exact,
            two_passes,
        ),
    ]
}

/// D* of the Hammersley net of n = 2ᵐ points: (m/3 + 13/9 − (−1)ᵐ 4/(9n))/n (Halton & Zaremba 1969).
fn hammersley_star(n: u32) -> f64 {
    let (m, count) = (n.trailing_zeros(), f64::from(n));
    let sign = if m.is_multiple_of(2) { 1.0 } else { -1.0 };
    (f64::from(m) / 3.0 + 13.0 / 9.0 - sign * 4.0 / 9.0 / count) / count
}

fn hammersley_prefix(_: &Context) -> Finding {
    let mut tally = Tally::new();
    let n = 256u32;
    let whole = points("hammersley:plain", n, 1);
    let mut said = Vec::new();
    for k in [n / 2, n / 4, n / 8] {
        let (prefix, own) = (star(&whole[..k as usize]), star(&points("hammersley:plain", k, 1)));
        // The box [0, (k−1)/n] × [0, 1], closed, holds all of them: too many by 1 − (k−1)/n.
        let least = 1.0 - f64::from(k - 1) / f64::from(n);
        tally.fact(
            format!("{k} of {n}: D* {prefix:.4}, at least 1 − (k−1)/n = {least:.4}"),
            prefix >= least - 1e-12 && prefix <= least + own,
        );
        tally.near(format!("D* of a set made for {k}, by its closed form"), own, hammersley_star(k), 1e-14);
        said.push(format!("{prefix:.3} ({own:.3} of a set for {k})"));
    }
    // Sequences may be stopped anywhere: the first half of Sobol' or Halton points is as good as a set made for it.
    for text in ["halton:step:none", "sobol:step:none", "ld:step:none"] {
        let half = (n / 2) as usize;
        let same = points(text, n, 1)[..half] == points(text, n / 2, 1);
        tally.fact(format!("the first half of {text} is {text} for half as many"), same);
    }
    tally.saying(format!("D* of the first half, quarter and eighth of 256: {}", said.join(", ")))
}

fn hammersley_beyond(_: &Context) -> Finding {
    let mut tally = Tally::new();
    let tickets = Tickets::new();
    let mut largest = 0.0f64;
    for n in [1u32, 2, 3, 16, 48, 1000, 1 << 24] {
        let naive = [n - 1, n].map(|i| i as f32 / n as f32);
        tally.fact(format!("x of points {} and {n} of {n}: {naive:?}", n - 1), naive[0] < 1.0 && naive[1] >= 1.0);
        for text in ["hammersley:plain", "hammersley:step:yxor", "hammersley:shuffle:shift"] {
            let sampler = tickets.sampler(text, n, 1);
            let refused = sampler.check_index(u64::from(n));
            tally.fact(
                format!("{text}: point {n} of {n} is refused with the range"),
                refused.is_err_and(|e| e.exit_code() == 2 && e.to_string().contains(&format!("found {n}"))),
            );
            let last = sampler.get_2d(pixel(0), n - 1, &tickets.pixel);
            largest = largest.max(f64::from(last[0].max(last[1])));
            tally
                .fact(format!("{text}: the last of {n} points is inside"), last.iter().all(|u| (0.0..1.0).contains(u)));
        }
        if n < 1 << 24 {
            let more = tickets.sampler("hammersley:plain", n + 1, 1).get_2d(pixel(0), n, &tickets.pixel)[0];
            let below = f64::from(n) / f64::from(n + 1) - f64::from(more);
            tally.fact(
                format!("of a set for {} points the last x is n/(n+1), {below:e} below", n + 1),
                (-f64::EPSILON..2f64.powi(-24) + 2f64.powi(-32)).contains(&below),
            );
        }
    }
    tally.saying(format!(
        "x of point n is 1 by i/n; ours is refused, and the largest coordinate of last points is {largest}"
    ))
}

/// Stratified points as people write them: sample i in cell i mod (columns · rows), uniform in it.
fn cells_in_turn(n: u32, columns: u32, rows: u32) -> Vec<(u32, u32)> {
    (0..n).map(|i| i % (columns * rows)).map(|cell| (cell % columns, cell / columns)).collect()
}

/// E of the mean of xy over jittered cells: of each cell the product of its centre's coordinates.
fn expected_xy(cells: &[(u32, u32)], columns: u32, rows: u32) -> f64 {
    let centre = |cell: u32, of: u32| (f64::from(cell) + 0.5) / f64::from(of);
    cells.iter().map(|&(x, y)| centre(x, columns) * centre(y, rows)).sum::<f64>() / cells.len() as f64
}

fn strata_without_a_grid(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let tickets = Tickets::new();
    let family = context.family(3);
    let mut said = Vec::new();
    for n in [6u32, 7, 13] {
        let mut naive = Vec::new();
        for side in [n.isqrt(), n.isqrt() + 1] {
            let cells = cells_in_turn(n, side, side);
            let fullest = (0..side * side).map(|c| cells.iter().filter(|&&p| p == (c % side, c / side)).count());
            let (most, least) = (fullest.clone().max().unwrap_or(0), fullest.min().unwrap_or(0));
            let bias = expected_xy(&cells, side, side) - 0.25;
            tally.fact(format!("n = {n} in {side} × {side} strata: {least} to {most} points in one"), most > least);
            tally.fact(format!("n = {n} in {side} × {side} strata: E xy off by {bias:.4}"), bias.abs() > 0.01);
            naive.push(format!("{bias:+.3}"));
        }
        let sampler = tickets.sampler("stratified", n, context.seed_of(0, 0));
        let replicates = context.replicates(20_000, 2000);
        let values: Vec<f64> =
            (0..replicates).map(|i| mean(&all(&sampler, pixel(i), &tickets.pixel), |x, y| x * y)).collect();
        tally.verdict(format!("ours at n = {n}: mean of xy"), &t_test(&values, 0.25, family), 0.25);
        said.push(format!(
            "n = {n}: bias of xy {} in naive strata, ours takes {}",
            naive.join(" and "),
            sampler.samples()
        ));
    }
    // Every count: the one taken is the next with a grid, and each of its cells holds one point.
    let mut most_added = 0.0f64;
    for n in (1..=300).chain([997, 1000, 1024, 4095]) {
        let sampler = tickets.sampler("stratified", n, context.seed_of(1, 0));
        let taken = sampler.samples();
        most_added = most_added.max(f64::from(taken) / f64::from(n));
        match factor_pair(taken) {
            Some((rows, columns)) => {
                let counts = cell_counts(&points("stratified", n, context.seed_of(1, 0)), columns, rows);
                tally.fact(
                    format!("n = {n}, taken {taken} = {columns} × {rows}: {counts:?} points a cell"),
                    counts == (1, 1),
                );
            }
            None => {
                tally.fact(format!("{taken} has a grid"), false);
            }
        }
    }
    tally.saying(said.join("; "))
}

fn strata_drawn_twice(_: &Context) -> Finding {
    let mut tally = Tally::new();
    let tickets = Tickets::new();
    for n in [16u32, 28, 64] {
        let (rows, columns) = factor_pair(n).expect("these have a grid");
        let beyond = (n..2 * n).filter(|i| f64::from(i / columns) / f64::from(rows) >= 1.0).count();
        tally.fact(format!("running on, {beyond} of the next {n} points have y ≥ 1"), beyond == n as usize);
        let again = cells_in_turn(2 * n, columns, rows);
        tally.fact(
            format!("beginning anew, 2 · {n} points fill {} cells", distinct(again.iter().copied())),
            distinct(again.iter().copied()) == n as usize && again[..n as usize] == again[n as usize..],
        );
        for text in ["stratified:sheet", "stratified:step:jitter", "stratified:shuffle:jitter"] {
            let sampler = tickets.sampler(text, n, 1);
            let refused = (n..2 * n).all(|i| sampler.check_index(u64::from(i)).is_err());
            tally.fact(format!("{text}: points {n} to {} are refused", 2 * n - 1), refused);
            let twice = tickets.sampler(text, 2 * n, 1);
            let (rows, columns) = factor_pair(twice.samples()).expect("the count taken has a grid");
            let counts = cell_counts(&points(text, 2 * n, 1), columns, rows);
            tally.fact(
                format!("{text} for {} points: {columns} × {rows} cells with {counts:?} points", 2 * n),
                counts == (1, 1) && columns * rows >= 2 * n,
            );
        }
    }
    tally.saying("after 64 points of an 8 × 8 grid y is 1 and more, or the same 64 cells come again; a sampler for 128 has 128 cells")
}

/// The points of all passes, each made for its own count by a sampler that begins anew.
fn in_passes(tickets: &Tickets, text: &str, variant: Variant, asked: u32) -> Vec<Point> {
    let pass = |n: &u32| all(&tickets.sampler(text, *n, 1), pixel(0), &tickets.pixel);
    variant.passes(asked).iter().flat_map(pass).collect()
}

fn two_passes(_: &Context) -> Finding {
    let mut tally = Tally::new();
    let tickets = Tickets::new();
    let bits = |points: &[Point]| distinct(points.iter().map(|p| p.map(f64::to_bits)));
    let n = 64;
    tally.fact("the driver's passes are 1 and n − 1", Variant::TwoPasses.passes(n) == [1, 63]);
    for text in ["halton:step:none", "ld:step:none", "sobol:step:none", "hammersley:step:none"] {
        let (two, one) =
            (in_passes(&tickets, text, Variant::TwoPasses, n), in_passes(&tickets, text, Variant::Plain, n));
        tally.fact(format!("{text}: the first point comes twice"), two[0] == two[1]);
        let found = [bits(&two), bits(&one)];
        tally.fact(format!("{text}: {found:?} different points in two passes and in one"), found == [63, 64]);
    }
    // What it costs: Σ x misses the point that never comes, and the first one is 0.
    let of = |variant| mean(&in_passes(&tickets, "halton:step:none", variant, n), |x, _| x);
    let (two, one) = (of(Variant::TwoPasses), of(Variant::Plain));
    tally.near("mean of x in one pass, ½ − 1/128", one, 0.5 - 1.0 / 128.0, 1e-12);
    tally.near("what the second pass lacks: x of point 63, over 64", one - two, 63.0 / 64.0 / 64.0, 1e-12);
    // One pass may be cut anywhere: indices go on, and the bytes are the same.
    for text in ["halton", "stratified", "hammersley", "ld:sheet"] {
        let sampler = Sampler::new(spec(text), &tickets.layout, n, 1).unwrap_or_else(|e| panic!("{e}"));
        let whole = all(&sampler, pixel(0), &tickets.pixel);
        let parts = [(0, 1), (1, 30), (31, 33)];
        let cut = parts.map(|(first, count)| super::common::span(&sampler, pixel(0), &tickets.pixel, first, count));
        tally.fact(format!("{text}: one pass cut in three has the same bits"), cut.concat() == whole);
    }
    tally.saying(format!(
        "64 Halton points in passes of 1 and 63: 63 different, mean of x {two:.4}; in one pass 64, {one:.4}"
    ))
}

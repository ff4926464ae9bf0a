//! Times the measures of point sets: `cargo run --release --example metric_speed`. Medians of several runs, in milliseconds,
//! on as many threads as there are (`RAYON_NUM_THREADS=1` for one).

use std::hint::black_box;
use std::time::Instant;

use sampler_lab::stats::Points;
use sampler_lab::stats::discrepancy::{L2Kind, STAR_COST_LIMIT, l2, min_toroidal_distance, star, star_2d, t_value};
use sampler_lab::stats::spectrum::Spectrum;

/// Points of Halton's sequence in d ≤ 5 dimensions.
fn halton(n: usize, d: usize) -> Points {
    let radical_inverse = |base: u64, mut index: u64| {
        let (mut digits, mut power) = (0, 1);
        while index > 0 {
            (digits, power, index) = (digits * base + index % base, power * base, index / base);
        }
        digits as f64 / power as f64
    };
    let point = |i: u64| [2, 3, 5, 7, 11].map(|base| radical_inverse(base, i));
    Points::new(d, (0..n as u64).flat_map(|i| point(i)[..d].to_vec()).collect()).expect("in the unit cube")
}

/// Prints the median time of some runs.
fn time<T>(what: &str, runs: usize, mut run: impl FnMut() -> T) {
    let mut milliseconds: Vec<f64> = (0..runs)
        .map(|_| {
            let start = Instant::now();
            black_box(run());
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    milliseconds.sort_by(f64::total_cmp);
    println!("{what:<44} {:>10.3} ms  (least {:.3}, {runs} runs)", milliseconds[runs / 2], milliseconds[0]);
}

fn main() {
    for n in [1024, 4096, 16_384, 65_536, 1_048_576] {
        let points = halton(n, 2);
        let runs = if n > 100_000 { 3 } else { 21 };
        time(&format!("star, 2-D, n = {n}"), runs, || star_2d(&points));
        for kind in L2Kind::ALL {
            time(&format!("{}, 2-D, n = {n}", kind.name()), runs, || l2(&points, kind));
        }
        time(&format!("t-value, 2-D, n = {n}"), runs, || t_value(&points));
        time(&format!("least toroidal distance, 2-D, n = {n}"), runs, || min_toroidal_distance(&points));
        if n <= 4096 {
            let reach = 2 * n.isqrt() as u32;
            time(&format!("spectrum to 2 √n, n = {n}"), 5, || Spectrum::of(&points, reach));
        }
    }
    for (d, n) in [(3, 1024), (4, 256), (5, 64), (5, 128)] {
        let points = halton(n, d);
        time(&format!("star, {d}-D, n = {n}"), 5, || star(&points, STAR_COST_LIMIT));
    }
    for (d, n) in [(3, 4096), (5, 4096)] {
        let points = halton(n, d);
        for kind in L2Kind::ALL {
            time(&format!("{}, {d}-D, n = {n}", kind.name()), 5, || l2(&points, kind));
        }
    }
}

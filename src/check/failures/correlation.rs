//! Where pixels, axes or threads share what they should not: one pattern in every pixel, points on lines, seeds in a row.

use crate::check::failures::room::{SIDE, bits, floor_under_light, image};
use crate::sampling::hash::{bits32, mix64, unit_f32};
use crate::sampling::radical::radical_inverse_f64;
use crate::sampling::{PixelKey, PointSource};
use crate::stats::image_error::{ensemble, error_autocorrelation};
use crate::stats::t_test;

use super::super::{Check, Context, Finding, Kind, Tally};
use super::common::{Point, Tickets, all, average, caught, pixel, star};

/// The checks of this file.
pub fn checks() -> Vec<Check> {
    let check =
        |name, claim, failures, kind, run| Check { name, group: "failures: correlation", claim, failures, kind, run };
    vec![
        check(
            "halton-in-every-pixel",
            "unrandomised Halton errs alike in neighbouring pixels: all of it bias, no variance; randomised, pixels err independently",
            &[8],
            Kind::Statistical,
            halton_in_every_pixel,
        ),
        check(
            "halton-large-bases",
            "64 points of Halton's bases 17 and 19 lie on 7 lines, and D* is over 4 times that of bases 2 and 3; permuted digits leave the lines",
            &[9],
            Kind::Statistical,
            halton_large_bases,
        ),
        check(
            "generator-per-thread",
            "a generator per thread makes the image depend on who takes which tile; ours is the same at 1, 2 and 7 threads",
            &[24],
            Kind::Exact,
            generator_per_thread,
        ),
        check(
            "seeds-in-a-row",
            "linear congruential streams seeded by pixel number correlate between neighbours at 0.998; ours do not",
            &[25],
            Kind::Statistical,
            seeds_in_a_row,
        ),
    ]
}

fn halton_in_every_pixel(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let scene = floor_under_light();
    let side = SIDE as usize;
    // Its own error is a thousandth of what is judged: nothing beside the intervals below.
    let reference = image(&scene, "sobol", 2048, context.seed_of(0, 0)).pixels;
    let replicates = u64::from(context.replicates(24, 8));
    let images = |sampler: &str| -> Vec<_> {
        (0..replicates).map(|r| image(&scene, sampler, 16, context.seed_of(1, r))).collect()
    };
    let fixed = images("halton:step:none");
    tally.fact("its image is the same under every seed", fixed.iter().all(|i| bits(i) == bits(&fixed[0])));
    let rho = error_autocorrelation(&fixed[0].pixels, &reference, &reference, side, side).unwrap_or(f64::NAN);
    tally.fact(format!("the correlation of neighbours' errors is {rho:.3}"), rho > 0.9);
    let parts: Vec<&[[f32; 3]]> = fixed.iter().map(|i| i.pixels.as_slice()).collect();
    let found = ensemble(&parts, &reference, &reference);
    let variance = found.variance.map(|v| v.value);
    tally.fact(
        format!("bias² {:.3e} of mean square error {:.3e}, variance {variance:?}", found.bias2.value, found.mse.value),
        variance == Some(0.0) && found.bias2.value == found.mse.value && found.mse.value > 0.0,
    );
    // Randomised, products of neighbours' errors have mean 0, and so has the error of the whole image.
    let family = context.family(4);
    for text in ["halton:joint:digits", "halton:step:shift"] {
        let errors: Vec<Vec<f64>> = images(text).iter().map(|i| errors_of(&i.pixels, &reference)).collect();
        let square = average(&errors.iter().flatten().map(|e| e * e).collect::<Vec<_>>());
        let products: Vec<f64> = errors.iter().map(|e| neighbours(e, side) / square).collect();
        tally.verdict(format!("{text}: correlation of neighbours"), &t_test(&products, 0.0, family), 1.0);
        let means: Vec<f64> = errors.iter().map(|e| average(e) / square.sqrt()).collect();
        tally.verdict(format!("{text}: mean error over RMSE"), &t_test(&means, 0.0, family), 1.0);
    }
    tally.saying(format!("neighbours' errors correlate at {rho:.3} unrandomised, and bias² is all of the error; randomised, at 0 within the interval"))
}

/// Errors of the red channel.
fn errors_of(image: &[[f32; 3]], reference: &[[f32; 3]]) -> Vec<f64> {
    image.iter().zip(reference).map(|(t, r)| f64::from(t[0]) - f64::from(r[0])).collect()
}

/// Mean product of horizontal neighbours' errors.
fn neighbours(errors: &[f64], side: usize) -> f64 {
    let products = errors.chunks(side).flat_map(|row| row.windows(2).map(|pair| pair[0] * pair[1]));
    products.sum::<f64>() / (side * (side - 1)) as f64
}

/// How many different lines of slope b₁/b₂ the points (φ_b₁(i), φ_b₂(i)), i < n, lie on: within one both numbers count up.
fn lines(bases: [u32; 2], points: &[Point]) -> usize {
    let offset = |[x, y]: &Point| (y * f64::from(bases[1]) - x * f64::from(bases[0])) * 1e6;
    super::common::distinct(points.iter().map(|p| offset(p).round() as i64))
}

fn halton_large_bases(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let n = 64;
    let pair = |a: u32, b: u32| (0..n).map(|i| [radical_inverse_f64(a, i), radical_inverse_f64(b, i)]).collect();
    let (large, small): (Vec<Point>, Vec<Point>) = (pair(17, 19), pair(2, 3));
    let (worst, best) = (star(&large), star(&small));
    let on = lines([17, 19], &large);
    tally.fact(format!("64 points of bases 17 and 19 lie on {on} lines"), on == 7);
    tally.fact(format!("D* {worst:.4} against {best:.4} of bases 2 and 3"), worst > 4.0 * best);
    // The worst pair that a scene of this lab can read: bases 13 and 17, for the point on the light, in order `joint`.
    let tickets = Tickets::new();
    let read = |text: &str, key| {
        let sampler = tickets.sampler(text, n, context.seed_of(0, 0));
        all(&sampler, key, &tickets.light)
    };
    let (plain, near) = (read("halton:joint:none", pixel(0)), read("halton:step:none", pixel(0)));
    let ratio = star(&plain) / star(&near);
    tally.fact(format!("the light's bases 13 and 17: D* {ratio:.2} times that of 2 and 3"), ratio > 2.5);
    // Permuted digits: x and y of a sample are independent, on lines no more. Their product has mean 1/4, where the line
    // through the origin alone, 13 points, would pull it to 1/3.
    let sampler = tickets.sampler("halton:joint:digits", 13, context.seed_of(1, 0));
    let replicates = context.replicates(20_000, 2000);
    let products: Vec<f64> =
        (0..replicates).map(|i| super::common::mean(&all(&sampler, pixel(i), &tickets.light), |x, y| x * y)).collect();
    tally.verdict("13 points with permuted digits: mean of xy", &t_test(&products, 0.25, context.family(1)), 0.25);
    let line = super::common::mean(&plain[..13], |x, y| x * y);
    let along = (0..13).map(|i| f64::from(i * i)).sum::<f64>() / (13.0 * 13.0 * 17.0);
    tally.near("mean of xy on the first line, Σ i²/(13·17)/13", line, along, 1e-6);
    let scrambled: Vec<f64> = (0..32)
        .map(|i| {
            star(&all(&tickets.sampler("halton:joint:digits", n, context.seed_of(2, 0)), pixel(i), &tickets.light))
        })
        .collect();
    let scrambled = average(&scrambled);
    tally.saying(format!(
        "D* of 64 points: {worst:.3} on {on} lines in bases 17 and 19, {best:.3} in 2 and 3; bases 13 and 17 with permuted digits {scrambled:.3}"
    ))
}

/// One pass over 64 tiles by workers that each draw from a stream of their own, as the schedule deals the tiles.
fn drawn_by_workers(workers: u64, worker_of: impl Fn(u64) -> u64) -> Vec<u64> {
    let mut states: Vec<u64> = (0..workers).collect();
    let draw = |tile| {
        let state = &mut states[worker_of(tile) as usize];
        *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix64(*state)
    };
    (0..64).map(draw).collect()
}

fn generator_per_thread(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let one = drawn_by_workers(1, |_| 0);
    let in_turn = drawn_by_workers(4, |tile| tile % 4);
    let stolen = drawn_by_workers(4, |tile| if tile == 5 { 0 } else { tile % 4 });
    let differ = |a: &[u64], b: &[u64]| a.iter().zip(b).filter(|(a, b)| a != b).count();
    let (threads, theft) = (differ(&one, &in_turn), differ(&in_turn, &stolen));
    tally.fact(format!("1 and 4 workers: {threads} of 64 tiles differ"), threads > 32);
    tally.fact(format!("one stolen tile changes {theft} of 64 tiles"), theft > 8);
    let scene = floor_under_light();
    let mut images = 0;
    for sampler in ["uniform", "stratified", "halton", "hammersley", "ld", "sobol", "ld:sheet"] {
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.map(|pool| pool.install(|| bits(&image(&scene, sampler, 7, context.seed_of(0, 0)))))
        };
        match (on(1), on(2), on(7)) {
            (Ok(one), Ok(two), Ok(seven)) => {
                images += 1;
                let lit = one.iter().all(|&b| f32::from_bits(b) > 0.0);
                tally
                    .fact(format!("{sampler}: the same bits at 1, 2 and 7 threads"), lit && one == two && one == seven);
            }
            _ => {
                tally.fact("threads can be started", false);
            }
        }
    }
    tally.saying(format!(
        "a generator per worker: {threads} of 64 tiles differ between 1 and 4 workers, {theft} after one stolen tile; {images} samplers of ours: none"
    ))
}

/// Correlation of neighbours in a row of numbers.
fn correlation(values: &[f64]) -> f64 {
    let centre = average(values);
    let square: f64 = values.iter().map(|v| (v - centre) * (v - centre)).sum();
    values.windows(2).map(|pair| (pair[0] - centre) * (pair[1] - centre)).sum::<f64>() / square
}

fn seeds_in_a_row(context: &Context) -> Finding {
    let mut tally = Tally::new();
    // Knuth and Lewis' constants, as printed in Numerical Recipes; the first number of the stream seeded with the pixel's number.
    let congruential = |p: u32| f64::from(p.wrapping_mul(1_664_525).wrapping_add(1_013_904_223)) / 4_294_967_296.0;
    let pairs = context.replicates(16_384, 2048);
    let products = |of: &dyn Fn(u32) -> f64| -> Vec<f64> {
        (0..pairs).map(|k| 12.0 * (of(2 * k) - 0.5) * (of(2 * k + 1) - 0.5)).collect()
    };
    let family = context.family(7);
    let naive = products(&congruential);
    caught(&mut tally, "the congruential generator", &naive, 0.0, family);
    let step = (congruential(1) - congruential(0)).rem_euclid(1.0);
    let same = (0..1000).all(|p| ((congruential(p + 1) - congruential(p)).rem_euclid(1.0) - step).abs() < 1e-12);
    tally.fact(format!("each pixel's first number is its neighbour's plus {step:.6}"), same);
    // Neighbours one apart, in disjoint pairs, so that products are independent.
    let hashed = products(&|p| f64::from(unit_f32(bits32(mix64(u64::from(p)), 0))));
    tally.verdict("hashed pixel numbers", &t_test(&hashed, 0.0, family), 1.0);
    let tickets = Tickets::new();
    for text in ["uniform", "halton", "hammersley", "ld", "sobol"] {
        let sampler = tickets.sampler(text, 16, context.seed_of(0, 0));
        let first = |p: u32| f64::from(sampler.get_2d(PixelKey::new(p % 64, p / 64), 0, &tickets.pixel)[0]);
        tally.verdict(format!("{text}: neighbours' first numbers"), &t_test(&products(&first), 0.0, family), 1.0);
    }
    let rho = correlation(&(0..2 * pairs).map(congruential).collect::<Vec<_>>());
    let exact = 1.0 - 6.0 * step * (1.0 - step);
    tally.near("their correlation, 1 − 6δ(1 − δ) for a step of δ", rho, exact, 1e-3);
    tally.saying(format!(
        "neighbours' first numbers correlate at {rho:.4} in the congruential generator and at 0 in ours"
    ))
}

//! Where decisions or axes share numbers: a product of two of them has mean ∫fg in place of ∫f∫g.

use crate::sampling::hash::{bits32, unit_f32};
use crate::sampling::sobol::{SobolAxis, owen_scramble};
use crate::sampling::{Dim2, PointSource, Sampler};
use crate::stats::t_test;

use super::super::{Check, Context, Finding, Kind, Tally};
use super::common::{Tickets, all, average, caught, mean, pixel};

/// The checks of this file.
pub fn checks() -> Vec<Check> {
    let check = |name, claim, failures, run| Check {
        name,
        group: "failures: correlation",
        claim,
        failures,
        kind: Kind::Statistical,
        run,
    };
    vec![
        check(
            "one-sequence-for-pixel-and-lens",
            "one sequence for pixel and lens pairs them on the diagonal: the mean of a product is 1/3, not 1/4; ours is 1/4",
            &[10],
            one_sequence_for_two,
        ),
        check(
            "one-seed-for-two-samplers",
            "two generators with one seed correlate at 1; our seven streams, hashed by decision and dimension, at 0",
            &[11],
            one_seed_for_two,
        ),
        check(
            "strata-in-step",
            "strata paired unshuffled lie on the diagonal: the mean of xy is 1/3 − 1/(12k²), not 1/4; shuffled it is 1/4",
            &[16],
            strata_in_step,
        ),
        check(
            "one-scramble-for-two-axes",
            "an Owen scramble with one seed for both axes leaves point 0 on the diagonal; with a seed for each the axes are independent",
            &[22],
            one_scramble_for_two,
        ),
    ]
}

/// Replicates of the mean of x_a · x_b over a pixel's samples, where a and b are two decisions' first axes.
fn products(sampler: &Sampler, [a, b]: [&Dim2; 2], replicates: u32) -> Vec<f64> {
    let product = |i| {
        let (a, b) = (all(sampler, pixel(i), a), all(sampler, pixel(i), b));
        a.iter().zip(&b).map(|(a, b)| a[0] * b[0]).sum::<f64>() / a.len() as f64
    };
    (0..replicates).map(product).collect()
}

fn one_sequence_for_two(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let tickets = Tickets::new();
    let replicates = context.replicates(20_000, 2000);
    let family = context.family(9);
    let of = |text: &str, tally: &mut Tally, exact: Option<f64>| {
        let sampler = tickets.sampler(text, 16, context.seed_of(0, 0));
        let values = products(&sampler, [&tickets.pixel, &tickets.lens], replicates);
        match exact {
            Some(exact) => {
                tally.verdict(format!("{text}: mean of x_pixel · x_lens"), &t_test(&values, exact, family), exact)
            }
            None => caught(tally, text, &values, 0.25, family).holds(),
        };
        average(&values)
    };
    // In step with one key for all decisions of a pixel: the lens reads the pixel's own numbers.
    let shared = of("ld:step:owen@pixel", &mut tally, Some(1.0 / 3.0));
    of("ld:step:owen@pixel", &mut tally, None);
    of("halton:step:shift@pixel", &mut tally, None);
    for text in ["uniform", "stratified:shuffle:jitter", "halton:joint:digits", "hammersley", "ld", "sobol"] {
        of(text, &mut tally, Some(0.25));
    }
    tally.saying(format!(
        "mean of x_pixel · x_lens: {shared:.4} where they share a sequence, 1/4 in six samplers of ours"
    ))
}

fn one_seed_for_two(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let samples = context.replicates(100_000, 10_000);
    let family = context.family(23);
    let generator = |seed: u64, i: u32| f64::from(unit_f32(bits32(seed, i)));
    let seed = context.seed_of(0, 0);
    let naive: Vec<f64> =
        (0..samples).map(|i| 12.0 * (generator(seed, i) - 0.5) * (generator(seed, i) - 0.5)).collect();
    caught(&mut tally, "one seed for two generators", &naive, 0.0, family);
    tally.verdict("their correlation is 1", &t_test(&naive, 1.0, family), 1.0);
    let tickets = Tickets::new();
    let sampler = tickets.sampler("uniform", samples, seed);
    let streams: Vec<[f32; 7]> = (0..samples).map(|i| tickets.coordinates(&sampler, pixel(0), i)).collect();
    for a in 0..7 {
        for b in 0..a {
            let of = |u: &[f32; 7]| 12.0 * (f64::from(u[a]) - 0.5) * (f64::from(u[b]) - 0.5);
            let values: Vec<f64> = streams.iter().map(of).collect();
            tally.verdict(format!("dimensions {b} and {a}"), &t_test(&values, 0.0, family), 1.0);
        }
    }
    tally.saying(format!(
        "one seed: every number twice; 21 pairs of our 7 dimensions: 0 within {:.3}",
        10.0 / f64::from(samples).sqrt()
    ))
}

fn strata_in_step(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let tickets = Tickets::new();
    let replicates = context.replicates(20_000, 2000);
    let family = context.family(5);
    // Two 1-D stratified sets side by side: sample i lies in stratum i of both.
    let k = 16u32;
    let jitter = |r: u32, i: u32| f64::from(unit_f32(bits32(context.seed_of(1, u64::from(r)), i)));
    let place = |r: u32, i: u32, axis: u32| (f64::from(i) + jitter(r, 2 * i + axis)) / f64::from(k);
    let naive: Vec<f64> =
        (0..replicates).map(|r| (0..k).map(|i| place(r, i, 0) * place(r, i, 1)).sum::<f64>() / f64::from(k)).collect();
    let diagonal = |k: u32| 1.0 / 3.0 - 1.0 / 12.0 / f64::from(k * k);
    tally.verdict("two 1-D sets in step: mean of xy", &t_test(&naive, diagonal(k), family), diagonal(k));
    caught(&mut tally, "two 1-D sets in step", &naive, 0.25, family);
    // The set's own x and y are a grid, shuffled or not; two decisions are in step or each in an order of its own.
    let of = |text: &str| {
        let sampler = tickets.sampler(text, k, context.seed_of(0, 0));
        let grid = (0..replicates).map(|i| mean(&all(&sampler, pixel(i), &tickets.pixel), |x, y| x * y)).collect();
        (products(&sampler, [&tickets.pixel, &tickets.lens], replicates), grid)
    };
    let (in_step, grid): (_, Vec<f64>) = of("stratified:step:jitter");
    let (shuffled, _): (_, Vec<f64>) = of("stratified:shuffle:jitter");
    tally.verdict("4 × 4 strata: mean of xy", &t_test(&grid, 0.25, family), 0.25);
    tally.verdict("decisions in step: mean of x_pixel · x_lens", &t_test(&in_step, diagonal(4), family), diagonal(4));
    tally.verdict("decisions shuffled: mean of x_pixel · x_lens", &t_test(&shuffled, 0.25, family), 0.25);
    tally.saying(format!(
        "mean of xy {:.4} for 1-D strata in step; pixel × lens {:.4} in step, {:.4} shuffled",
        average(&naive),
        average(&in_step),
        average(&shuffled)
    ))
}

/// Covariance of two fractions under one nested uniform scramble: digits that agree flip together, the first that differs
/// stays the opposite, and all below are independent. 1/12 where all agree.
fn shared_covariance(x: u32, y: u32) -> f64 {
    match (x ^ y).leading_zeros() {
        32 => 1.0 / 12.0,
        agree => 1.0 / 12.0 - 7.0 / 48.0 * libm::pow(0.25, f64::from(agree)),
    }
}

fn one_scramble_for_two(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let family = context.family(6);
    let replicates = context.replicates(40_000, 40_000);
    let second = SobolAxis::new(1).expect("dimension 2 of 256");
    let n = 4u32;
    let set = |r: u32| -> Vec<[f64; 2]> {
        let key = bits32(context.seed_of(0, 0), r);
        let scrambled = |fraction: u32| f64::from(unit_f32(owen_scramble(fraction, key)));
        (0..n).map(|i| [scrambled(i.reverse_bits()), scrambled(second.fraction(i))]).collect()
    };
    let naive: Vec<Vec<[f64; 2]>> = (0..replicates).map(set).collect();
    let on_diagonal = naive.iter().filter(|points| points[0][0] == points[0][1]).count();
    tally
        .fact(format!("one seed: point 0 has x = y in {on_diagonal} of {replicates} sets"), on_diagonal == naive.len());
    let of_point = |points: &Vec<[f64; 2]>| points[0][0] * points[0][1];
    let first: Vec<f64> = naive.iter().map(of_point).collect();
    tally.verdict("one seed: E xy of point 0", &t_test(&first, 1.0 / 3.0, family), 1.0 / 3.0);
    caught(&mut tally, "one seed, point 0", &first, 0.25, family);
    // Over the whole set most of it cancels, and a bias of order 1/n is left.
    let bias: f64 = (0..n).map(|i| shared_covariance(i.reverse_bits(), second.fraction(i))).sum::<f64>() / f64::from(n);
    let whole: Vec<f64> = naive.iter().map(|points| mean(points, |x, y| x * y)).collect();
    tally.verdict("one seed: mean of xy over 4 points", &t_test(&whole, 0.25 + bias, family), 0.25);
    if bias != 0.0 {
        caught(&mut tally, "one seed, 4 points", &whole, 0.25, family);
    }
    let tickets = Tickets::new();
    let sampler = tickets.sampler("ld:step:owen", n, context.seed_of(1, 0));
    let ours: Vec<Vec<[f64; 2]>> = (0..replicates).map(|i| all(&sampler, pixel(i), &tickets.pixel)).collect();
    let first: Vec<f64> = ours.iter().map(of_point).collect();
    tally.verdict("ours: E xy of point 0", &t_test(&first, 0.25, family), 0.25);
    let last: Vec<f64> = (0..replicates)
        .map(|i| sampler.get_2d(pixel(i), n - 1, &tickets.pixel))
        .map(|[x, y]| f64::from(x * y))
        .collect();
    tally.verdict("ours: E xy of point 3", &t_test(&last, 0.25, family), 0.25);
    tally.saying(format!("one seed: E xy of point 0 is 1/3, of 4 points {:.4}; a seed an axis: 1/4", average(&whole)))
}

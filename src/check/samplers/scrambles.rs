//! Scrambles, bit for bit and by their variance ratios.
//!
//! *Bit for bit* (exact): Owen's flips a digit by what stands above it and by the key alone; `xor` is one word for all
//! points; `shift` one number; `digits` permutes each digit in a way that its prefix chooses.
//!
//! *By ratios*: mean squared error over exact variance lies in [0.95, 1.05], by two one-sided tests at 1e-3 each. Such a check lies
//! where it fails to show what is true; replicates are counted from the check's false-alarm rate, for a ratio of 1. The
//! contrasts must fail the same test: Burley's constants of 2020, which are nested bit for bit too, and digit permutations
//! that forget their prefix.

use rayon::prelude::*;

use super::equivalence::{LEVEL, MARGIN, RatioFound, ratio_within, replicates_for};
use super::laws::{AxisLaw, owen_diagonal, set_errors, shared_digits};
use super::reading::{PIXEL, Tickets, numbered_specs};
use crate::check::{Check, Context, Finding, Kind, Tally};
use crate::sampling::halton::digit_scrambled;
use crate::sampling::hash::bits64;
use crate::sampling::radical::{PRIMES, digit_count};
use crate::sampling::sobol::{SobolAxis, owen_scramble};
use crate::sampling::{Decision, Order, Random, Sampler, SamplerSpec};

/// The checks of scrambles.
pub fn checks() -> Vec<Check> {
    let check = |name, kind, claim, run| Check { name, group: super::GROUP, claim, failures: &[], kind, run };
    let with_failures = |rows, check: Check| Check { failures: rows, ..check };
    vec![
        check(
            "owen-is-nested",
            Kind::Exact,
            "owen flips each bit by the bits above it and the key: words that share k bits share k bits afterwards, and no more",
            owen_is_nested,
        ),
        with_failures(
            &[19],
            check(
                "owen-has-owens-variances",
                Kind::Statistical,
                "owen's variance ratios lie in [0.95, 1.05] for x, xy, step and diagonal, n = 64 to 4096; those of Burley's constants of 2020 do not",
                owen_ratios,
            ),
        ),
        with_failures(
            &[18],
            check(
                "xor-is-a-shift",
                Kind::Statistical,
                "xor adds one word to all points, so Var(x)·12n³ is n and not 1",
                xor_is_a_shift,
            ),
        ),
        check("shift-is-toroidal", Kind::Exact, "shift adds one number to all points modulo 1", shift_is_toroidal),
        check(
            "digits-are-nested",
            Kind::Exact,
            "digits are permuted one to one under each prefix: points share as many digits as their indices do",
            digits_are_nested,
        ),
        check(
            "digits-have-their-variances",
            Kind::Statistical,
            "the variance ratios of scrambled Halton lie in [0.95, 1.05]; with one permutation a place they do not",
            digit_ratios,
        ),
    ]
}

/// Burley's hash of 2020 (JCGT 9(4)) with its first constants: nested as Owen's, but too regular.
pub fn burley_2020(fraction: u32, seed: u32) -> u32 {
    let mut x = fraction.reverse_bits();
    x = x.wrapping_add(seed);
    x ^= x.wrapping_mul(0x6c50_b47c);
    x ^= x.wrapping_mul(0xb82f_1e52);
    x ^= x.wrapping_mul(0xc7af_e638);
    x ^= x.wrapping_mul(0x8d22_f6e6);
    x.reverse_bits()
}

/// Nested uniform scramble by its definition: a coin for every prefix flips the digit after it.
pub fn owen_tree(fraction: u32, key: u64) -> u32 {
    (0..32).fold(0, |out, level| {
        // A one before the prefix tells prefixes of different lengths apart.
        let prefix = (1u64 << level) | (u64::from(fraction) >> (32 - level));
        let coin = (bits64(key, prefix) >> 63) as u32;
        out | ((((fraction >> (31 - level)) & 1) ^ coin) << (31 - level))
    })
}

/// The (0,2) pair as 32-bit fractions.
pub fn plain_pair(n: u32) -> Vec<[u32; 2]> {
    let second = SobolAxis::new(1).expect("dimension 2");
    (0..n).map(|i| [i.reverse_bits(), second.fraction(i)]).collect()
}

fn owen_is_nested(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let flips = context.replicates(4000, 1000);
    for trial in 0..u64::from(flips) {
        let bits = bits64(context.seed_of(0, trial), 0);
        let (word, key) = ((bits >> 32) as u32, bits as u32);
        let out = owen_scramble(word, key);
        let flipped_out: Vec<u32> = (0..32).map(|k| out ^ owen_scramble(word ^ (1 << (31 - k)), key)).collect();
        // Bit k flipped: nothing above it moves, and bit k itself does.
        let holds = (0..).zip(&flipped_out).all(|(k, moved): (u32, _)| moved.leading_zeros() == k);
        tally.fact(format!("flips of {word:#010x} under {key:#010x}"), holds);
        // Two words that share their first k bits, and what follows is anything.
        let other = bits64(context.seed_of(1, trial), 0) as u32;
        let k = (trial % 32) as u32;
        let twin = word ^ ((0x8000_0000 | other >> 1) >> k);
        let same = (out ^ owen_scramble(twin, key)).leading_zeros();
        tally.fact(format!("{word:#010x} and {twin:#010x} share {k} bits, scrambled {same}"), same == k);
    }
    let tickets = Tickets::new();
    for s in numbered_specs().into_iter().filter(|s| s.random == Random::Owen) {
        for decision in [Decision::Pixel, Decision::LightPoint] {
            let [scrambled, plain] = [Random::Owen, Random::None]
                .map(|random| axes(SamplerSpec { random, ..s }, &tickets, decision, 100, context.seed));
            let shared = |v: &[u32], i: usize, j: usize| (v[i] ^ v[j]).leading_zeros();
            let nested = (0..2)
                .all(|a| (0..100).all(|i| (0..i).all(|j| shared(&scrambled[a], i, j) == shared(&plain[a], i, j))));
            tally.fact(
                format!("{s}: pairs of the {} share digits as before", decision.name()),
                nested && scrambled != plain,
            );
        }
    }
    tally.saying(format!(
        "{flips} words with 32 flips and a twin each, and all pairs of 100 points of every owen sampler"
    ))
}

/// The integers of a whole set, as the sampler holds them.
fn axes(spec: SamplerSpec, tickets: &Tickets, decision: Decision, n: u32, seed: u64) -> [Vec<u32>; 2] {
    let sampler = Sampler::new(spec, &tickets.layout, n, seed).expect("a legal sampler");
    let (mut x, mut y) = (vec![0; n as usize], vec![0; n as usize]);
    sampler.fractions_2d(PIXEL, 0, tickets.two_d(decision), &mut x, &mut y);
    [x, y]
}

/// Squared errors of x, xy, step and diagonal over one scrambled set, each over its exact variance.
///
/// Sums are of integers of the top 24 bits, each lifted by half a place.
#[inline(always)]
fn ratios(points: &[[u32; 2]], keys: [u32; 2], exact: [f64; 4], scramble: impl Fn(u32, u32) -> u32) -> [f64; 4] {
    const STEP: u32 = (std::f64::consts::FRAC_1_PI * 4_294_967_296.0) as u32;
    let (mut sum_x, mut sum_y, mut sum_xy, mut below, mut above) = (0u64, 0u64, 0u64, 0u32, 0u32);
    for &[x, y] in points {
        let (x, y) = (scramble(x, keys[0]), scramble(y, keys[1]));
        below += u32::from(x < STEP);
        above += u32::from(y > x);
        let (x, y) = (u64::from(x >> 8), u64::from(y >> 8));
        sum_x += x;
        sum_y += y;
        sum_xy += x * y;
    }
    let (n, place) = (points.len() as f64, 2.0 * super::reading::HALF_PLACE);
    let mean_x = (sum_x as f64 / n + 0.5) * place;
    let mean_xy = (sum_xy as f64 / n + 0.5 * (sum_x + sum_y) as f64 / n + 0.25) * place * place;
    let errors =
        [mean_x - 0.5, mean_xy - 0.25, f64::from(below) / n - std::f64::consts::FRAC_1_PI, f64::from(above) / n - 0.5];
    std::array::from_fn(|k| errors[k] * errors[k] / exact[k])
}

/// The integrands of [`ratios`].
const NAMES: [&str; 4] = ["x", "xy", "step", "diagonal"];

/// Exact variances of [`NAMES`] for an Owen-scrambled net of n = 2ᵐ points.
fn owen_exact(m: u32) -> [f64; 4] {
    let n = f64::from(1u32 << m);
    let p = (n * std::f64::consts::FRAC_1_PI).fract();
    let cube = n * n * n;
    [1.0 / (12.0 * cube), 7.0 * (4.0 + 3.0 * f64::from(m)) / (576.0 * cube), p * (1.0 - p) / (n * n), owen_diagonal(m)]
}

/// Ratios of a scramble of the pair, one found for each integrand: of variances to `scale` times Owen's.
pub fn pair_ratios(
    m: u32,
    scale: f64,
    replicates: u32,
    seed: impl Fn(u64) -> u64 + Sync,
    scramble: impl Fn(u32, u32) -> u32 + Sync,
) -> [RatioFound; 4] {
    let points = plain_pair(1 << m);
    let exact = owen_exact(m);
    let all: Vec<[f64; 4]> = (0..u64::from(replicates))
        .into_par_iter()
        .map(|r| {
            let seed = seed(r);
            ratios(&points, [bits64(seed, 1) as u32, bits64(seed, 2) as u32], exact, &scramble)
        })
        .collect();
    std::array::from_fn(|k| ratio_within(all.iter().map(|ratios| ratios[k] / scale)))
}

/// The step of 1024 points is 0 or 1 with probability 0.95: squares of its errors spread 17 times their mean square, and
/// equivalence would need 9 times the replicates.
fn is_lopsided(m: u32, integrand: usize) -> bool {
    m == 10 && integrand == 2
}

fn owen_ratios(context: &Context) -> Finding {
    let mut tally = Tally::new();
    // 15 ratios; a tenth more replicates than normal errors need pays for the kurtosis of the steps.
    let needed = replicates_for(context.false_alarm / 15.0, 2.2);
    let replicates = context.replicates(needed, needed);
    let mut said = Vec::new();
    let mut missed = Vec::new();
    for m in [6, 8, 10, 12] {
        let found = pair_ratios(m, 1.0, replicates, |r| context.seed_of(u64::from(m), r), owen_scramble);
        for (k, found) in found.iter().enumerate().filter(|&(k, _)| !is_lopsided(m, k)) {
            let what = format!(
                "{}, n = {}: ratio {:.4}, p = {:.0e} of outside",
                NAMES[k],
                1 << m,
                found.ratio,
                found.p_outside
            );
            tally.fact_that_detects(what, found.within(), MARGIN);
            said.push(found.ratio);
        }
        let burley = pair_ratios(m, 1.0, 4000, |r| context.seed_of(100 + u64::from(m), r), burley_2020);
        tally.fact(format!("Burley 2020, x, n = {}: ratio {:.3}", 1 << m, burley[0].ratio), burley[0].outside());
        missed.push(format!("{:.2}", burley[0].ratio));
    }
    let (low, high) = said.iter().fold((f64::MAX, 0.0f64), |(l, h), &r| (l.min(r), h.max(r)));
    tally.saying(format!(
        "15 ratios from {low:.4} to {high:.4} over {replicates} keys, each in [0.95, 1.05] at level {LEVEL}; with Burley's constants x gives {}",
        missed.join(", ")
    ))
}

fn xor_is_a_shift(context: &Context) -> Finding {
    let tickets = Tickets::new();
    let mut tally = Tally::new();
    let is_xor = |s: &SamplerSpec| matches!(s.random, Random::Xor | Random::Yxor) && s.order != Order::Shuffle;
    for s in numbered_specs().into_iter().filter(is_xor) {
        let [moved, plain] = [s.random, Random::None].map(|random| {
            axes(SamplerSpec { random, sheet_1d: false, ..s }, &tickets, Decision::LightPoint, 256, context.seed)
        });
        for axis in 0..2 {
            let word = moved[axis][0] ^ plain[axis][0];
            let same = moved[axis].iter().zip(&plain[axis]).all(|(m, p)| m ^ p == word);
            tally.fact(format!("{s}: one word on axis {axis}"), same);
            let random = s.random == Random::Xor || axis == 1;
            tally.fact(format!("{s}: axis {axis} has a word"), (word != 0) == random);
        }
    }
    let needed = replicates_for(context.false_alarm / 2.0, 1.0);
    let replicates = context.replicates(needed, needed);
    let mut said = Vec::new();
    for m in [6, 8] {
        // The exact variance of the shift is n times Owen's; squares of a uniform error have the relative variance 4/5.
        let n = f64::from(1u32 << m);
        let found = pair_ratios(m, n, replicates, |r| context.seed_of(u64::from(m), r), |f, key| f ^ key)[0];
        let what = format!("Var(x)·12n³ = {:.2} for n = {n}", n * found.ratio);
        tally.fact_that_detects(what, found.within(), MARGIN);
        said.push(format!("{:.2} for n = {n}", n * found.ratio));
    }
    tally.saying(format!("Var(x)·12n³ = {}, within 5 % of n over {replicates} keys", said.join(" and ")))
}

fn shift_is_toroidal(context: &Context) -> Finding {
    let tickets = Tickets::new();
    let mut tally = Tally::new();
    for s in numbered_specs().into_iter().filter(|s| s.random == Random::Shift && s.order != Order::Shuffle) {
        let [moved, plain] = [Random::Shift, Random::None]
            .map(|random| axes(SamplerSpec { random, ..s }, &tickets, Decision::LightPoint, 200, context.seed));
        for axis in 0..2 {
            let by = moved[axis][0].wrapping_sub(plain[axis][0]);
            let same = moved[axis].iter().zip(&plain[axis]).all(|(m, p)| m.wrapping_sub(*p) == by);
            tally.fact(format!("{s}: axis {axis} is moved by {by:#010x}"), same && by != 0);
        }
    }
    tally.saying("all differences to the plain set are one number modulo 2³², on each axis")
}

fn digits_are_nested(context: &Context) -> Finding {
    let mut tally = Tally::new();
    for (which, &base) in PRIMES.iter().take(7).enumerate() {
        let n = 200u32;
        let digits = digit_count(base, n);
        for trial in 0..u64::from(context.replicates(20, 4)) {
            let key = context.seed_of(which as u64, trial);
            let values: Vec<u64> = (0..n).map(|i| u64::from(digit_scrambled(base, digits, i, key))).collect();
            // A fraction is rounded down: a value on a cell's lower border counts to that cell.
            let cell = |v: u64, k: u32| ((v + 1) * u64::from(base).pow(k)) >> 32;
            let shared = |i: usize, j: usize| {
                (0..digits).take_while(|&k| cell(values[i], k + 1) == cell(values[j], k + 1)).count()
            };
            let nested =
                (0..n as usize).all(|i| (0..i).all(|j| shared(i, j) as u32 == shared_digits(base, i, j).min(digits)));
            tally.fact(format!("base {base}, key {trial}: pairs share digits as their indices do"), nested);
        }
    }
    let tickets = Tickets::new();
    for s in numbered_specs().into_iter().filter(|s| s.random == Random::Digits) {
        // bᵏ points are one in each of bᵏ strata, in the bases that the decision reads.
        for (decision, first) in [(Decision::Pixel, 0), (Decision::LightPoint, 5)] {
            for axis in 0..2 {
                let base = PRIMES[axis + if s.order == Order::Joint { first } else { 0 }];
                let n = base.pow(2);
                let values = &axes(s, &tickets, decision, n, context.seed)[axis];
                let mut strata: Vec<u64> = values.iter().map(|&v| ((u64::from(v) + 1) * u64::from(n)) >> 32).collect();
                strata.sort_unstable();
                tally.fact(
                    format!("{s}: base {base} of the {}", decision.name()),
                    strata.into_iter().eq(0..u64::from(n)),
                );
            }
        }
    }
    tally.saying("all pairs of 200 points in the bases 2 to 17, and b² points in b² strata for every digits sampler")
}

/// Digit permutations that forget the prefix: one for each place, as a mistake would have it.
fn one_permutation_a_place(base: u32, digits: u32, index: u32, key: u64) -> u32 {
    let b = u64::from(base);
    let (mut rest, mut power, mut mirror) = (index, 1u64, 0u64);
    for level in 0..digits {
        let draw = bits64(key, u64::from(level));
        let (factor, offset) = (1 + (((draw >> 32) * (b - 1)) >> 32), ((draw & 0xffff_ffff) * b) >> 32);
        mirror = mirror * b + (factor * u64::from(rest % base) + offset) % b;
        rest /= base;
        power *= b;
    }
    let tail = bits64(key, 1 << 32) >> 32;
    (((mirror << 32) | tail) / power) as u32
}

/// Ratios of x, y and xy of a scrambled Halton set in bases 2 and 3 to the exact variances of nested permutations.
pub fn halton_ratios(
    n: u32,
    replicates: u32,
    seed: impl Fn(u64) -> u64 + Sync,
    scramble: impl Fn(u32, u32, u32, u64) -> u32 + Sync,
) -> [RatioFound; 3] {
    let [two, three] = [2, 3].map(|base| AxisLaw::Digits { base, samples: n });
    let exact = set_errors(&two, &three);
    let variances = [exact.x, exact.y, exact.product].map(|e| e.mean_square);
    let digits = [2, 3].map(|base| digit_count(base, n));
    let all: Vec<[f64; 3]> = (0..u64::from(replicates))
        .into_par_iter()
        .map(|r| {
            let seed = seed(r);
            let keys = [bits64(seed, 1), bits64(seed, 2)];
            let mut sums = [0.0; 3];
            for i in 0..n {
                let x = (f64::from(scramble(2, digits[0], i, keys[0])) + 0.5) / 4_294_967_296.0;
                let y = (f64::from(scramble(3, digits[1], i, keys[1])) + 0.5) / 4_294_967_296.0;
                sums = [sums[0] + x, sums[1] + y, sums[2] + x * y];
            }
            std::array::from_fn(|k| {
                let error = sums[k] / f64::from(n) - [0.5, 0.5, 0.25][k];
                error * error / variances[k]
            })
        })
        .collect();
    std::array::from_fn(|k| ratio_within(all.iter().map(|ratios| ratios[k])))
}

fn digit_ratios(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let needed = replicates_for(context.false_alarm / 9.0, 2.2);
    let replicates = context.replicates(needed, needed);
    let (mut low, mut high) = (f64::MAX, 0.0f64);
    let mut missed = Vec::new();
    for n in [27, 64, 100] {
        let found = halton_ratios(n, replicates, |r| context.seed_of(u64::from(n), r), digit_scrambled);
        for (name, found) in ["x", "y", "xy"].iter().zip(&found) {
            tally.fact_that_detects(format!("{name}, n = {n}: ratio {:.4}", found.ratio), found.within(), MARGIN);
            (low, high) = (low.min(found.ratio), high.max(found.ratio));
        }
        let wrong = halton_ratios(n, 2000, |r| context.seed_of(1000 + u64::from(n), r), one_permutation_a_place);
        tally.fact(format!("one permutation a place, x, n = {n}: ratio {:.2}", wrong[0].ratio), wrong[0].outside());
        missed.push(format!("{:.1}", wrong[0].ratio));
    }
    tally.saying(format!(
        "9 ratios from {low:.4} to {high:.4} over {replicates} keys; with one permutation a place x gives {}",
        missed.join(", ")
    ))
}

//! Nets, counted on the integers that the samplers hold and once more on the floats that they deliver.
//!
//! Exact checks, but for shifts, which break nets for most keys: the share is tested.

use rayon::prelude::*;

use super::reading::{PIXEL, Tickets, numbered_specs, spec};
use crate::check::{Check, Context, Finding, Kind, Tally};
use crate::sampling::hash::unit_f32;
use crate::sampling::{Decision, MAX_SAMPLES, Order, Points, Random, Sampler, SamplerSpec};

/// The checks of nets.
pub fn checks() -> Vec<Check> {
    let check = |name, claim, run| Check { name, group: super::GROUP, claim, failures: &[], kind: Kind::Exact, run };
    vec![
        check(
            "nets-of-the-pair",
            "every aligned block of 2^m points of ld and sobol is a (0,m,2)-net, plain, digitally shifted and Owen-scrambled",
            blocks,
        ),
        check(
            "nets-in-every-decision",
            "the whole set of 2^m points is a (0,m,2)-net in every decision that reads the pair, in step or shuffled; Hammersley's too",
            whole_sets,
        ),
        Check {
            kind: Kind::Statistical,
            ..check(
                "nets-broken-by-shifts",
                "a toroidal shift keeps each axis stratified and breaks most nets",
                toroidal,
            )
        },
    ]
}

/// Does every elementary interval of area 1/n hold one of these n = 2^m points? Fractions of 2³², so that cells are
/// read off the top bits. O(n m).
///
/// # Panics
/// Where n is no power of two or the axes differ in length.
pub fn is_net(x: &[u32], y: &[u32]) -> bool {
    let n = x.len();
    assert!(n.is_power_of_two() && n == y.len(), "{n} and {} points", y.len());
    let m = n.trailing_zeros();
    let top = |v: u32, bits: u32| if bits == 0 { 0 } else { (v >> (32 - bits)) as usize };
    let mut seen = vec![false; n];
    (0..=m).all(|e| {
        seen.fill(false);
        x.iter().zip(y).all(|(&x, &y)| !std::mem::replace(&mut seen[top(x, e) << (m - e) | top(y, m - e)], true))
    })
}

/// The fraction that a delivered float stands for, all its bits.
fn delivered(fraction: u32) -> u32 {
    (f64::from(unit_f32(fraction)) * 4_294_967_296.0) as u32
}

/// Nets on both: the integers, and the floats made of them.
fn is_net_twice(x: &[u32], y: &[u32]) -> bool {
    let floats = |v: &[u32]| v.iter().map(|&f| delivered(f)).collect::<Vec<_>>();
    is_net(x, y) && is_net(&floats(x), &floats(y))
}

/// Does the randomisation permute binary digits, place by place, so that nets stay nets?
pub fn is_digital(random: Random) -> bool {
    matches!(random, Random::None | Random::Xor | Random::Yxor | Random::Owen)
}

fn is_pair(s: &SamplerSpec) -> bool {
    matches!(s.points, Points::Ld | Points::Sobol) && is_digital(s.random)
}

/// The integers of samples `first .. first + count`.
fn fractions(sampler: &Sampler, tickets: &Tickets, decision: Decision, first: u32, count: usize) -> [Vec<u32>; 2] {
    let (mut x, mut y) = (vec![0; count], vec![0; count]);
    sampler.fractions_2d(PIXEL, first, tickets.two_d(decision), &mut x, &mut y);
    [x, y]
}

/// Block numbers that are tried for 2^m points: the first ones, some inside, the last below 2²⁴.
fn block_numbers(m: u32) -> impl Iterator<Item = u32> {
    let last = (MAX_SAMPLES >> m) - 1;
    [0, 1, 2, 3, 4, 5, 6, 7, 21, 100, last / 3, last - 1, last].into_iter().filter(move |&k| k <= last)
}

fn blocks(context: &Context) -> Finding {
    let tickets = Tickets::new();
    // A shuffled order visits the same set out of order: its blocks are no blocks of the sequence.
    let specs: Vec<_> = numbered_specs().into_iter().filter(|s| is_pair(s) && s.order != Order::Shuffle).collect();
    let found: Vec<Vec<(String, bool)>> = specs
        .par_iter()
        .map(|&s| {
            let mut sampler = Sampler::new(s, &tickets.layout, MAX_SAMPLES, context.seed).expect("a legal sampler");
            let keys = if s.random == Random::None { 1 } else { 3 };
            let mut found = Vec::new();
            for key in 0..keys {
                sampler.reseed(context.seed_of(0, key));
                for m in 0..=12 {
                    for block in block_numbers(m) {
                        let [x, y] = fractions(&sampler, &tickets, Decision::Pixel, block << m, 1 << m);
                        found.push((format!("{s}: block {block} of 2^{m}, key {key}"), is_net_twice(&x, &y)));
                    }
                }
            }
            found
        })
        .collect();
    let mut tally = Tally::new();
    for (what, holds) in found.into_iter().flatten() {
        tally.fact(what, holds);
    }
    let says =
        format!("blocks of 2^0 to 2^12 points up to index 2^24 of {} samplers, integers and floats", specs.len());
    tally.saying(says)
}

fn whole_sets(context: &Context) -> Finding {
    let tickets = Tickets::new();
    let mut tally = Tally::new();
    let reads_the_pair = |s: &SamplerSpec, d: Decision| s.order != Order::Joint || d == Decision::Pixel;
    for s in numbered_specs() {
        if !(is_pair(&s) || s.points == Points::Hammersley && is_digital(s.random)) {
            continue;
        }
        for m in [0u32, 1, 4, 7, 10] {
            let sampler =
                Sampler::new(s, &tickets.layout, 1 << m, context.seed_of(1, u64::from(m))).expect("a legal sampler");
            for decision in [Decision::Pixel, Decision::Lens, Decision::LightPoint] {
                if reads_the_pair(&s, decision) {
                    let [x, y] = fractions(&sampler, &tickets, decision, 0, 1 << m);
                    tally.fact(format!("{s}: 2^{m} points of the {}", decision.name()), is_net_twice(&x, &y));
                }
            }
        }
    }
    tally.saying("sets of 1 to 1024 points of every decision, integers and floats")
}

fn toroidal(context: &Context) -> Finding {
    let tickets = Tickets::new();
    let mut tally = Tally::new();
    let mut said = Vec::new();
    for name in ["ld:step:shift", "sobol:step:shift", "hammersley:step:shift"] {
        let mut sampler = Sampler::new(spec(name), &tickets.layout, 64, 0).expect("a legal sampler");
        let keys = 64;
        let mut nets = 0;
        for key in 0..keys {
            sampler.reseed(context.seed_of(2, key));
            let axes = fractions(&sampler, &tickets, Decision::Pixel, 0, 64);
            nets += u32::from(is_net(&axes[0], &axes[1]));
            for (axis, fractions) in axes.iter().enumerate() {
                let mut strata: Vec<u32> = fractions.iter().map(|f| f >> 26).collect();
                strata.sort_unstable();
                tally.fact(format!("{name}: axis {axis} of key {key} is stratified"), strata.into_iter().eq(0..64));
            }
        }
        // Of the 64² shifts of the top digits few keep all intervals; none of ours need to.
        let what = format!("{name}: {nets} of {keys} shifts are nets, at most half claimed");
        tally.rate(what, u64::from(nets), keys, [0.0, 0.5], context.family(3));
        said.push(format!("{name} {nets}"));
    }
    tally.saying(format!("of 64 shifts of 64 points are still nets: {}", said.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_point_moved_into_a_neighbours_cell_is_no_net() {
        let tickets = Tickets::new();
        let sampler = Sampler::new(spec("ld:plain"), &tickets.layout, 64, 0).unwrap();
        let [mut x, y] = fractions(&sampler, &tickets, Decision::Pixel, 0, 64);
        assert!(is_net_twice(&x, &y));
        x[5] ^= 1 << 26;
        assert!(!is_net(&x, &y));
        assert!(!is_net(&[0, 0], &[0, 1 << 31]));
    }
}

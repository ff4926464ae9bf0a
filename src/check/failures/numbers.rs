//! Where arithmetic fails: single precision reaches 1, loses neighbours or overflows.

use crate::sampling::hash::unit_f32;
use crate::sampling::radical::{PRIMES, radical_inverse_f64};
use crate::sampling::strata::in_stratum;
use crate::sampling::{MAX_SAMPLES, PixelKey, PointSource, Sampler};

use super::super::{Check, Context, Finding, Kind, Tally};
use super::common::{Point, Tickets, distinct, pixel, points, spec, star};

/// The checks of this group.
pub fn checks() -> Vec<Check> {
    let exact = |name, claim, failures, run| Check {
        name,
        group: "failures: numbers",
        claim,
        failures,
        kind: Kind::Exact,
        run,
    };
    vec![
        exact(
            "halton-in-f32",
            "a radical inverse in f32 reaches 1.0, in base 3 at index 4 782 968; ours stays below 1 at every bᵏ − 1",
            &[1],
            halton_in_f32,
        ),
        exact(
            "van-der-corput-in-f32",
            "u32 · 2⁻³² in f32 is 1.0 for the 128 words from 0xFFFFFF80 on; the top 24 bits never are",
            &[2],
            van_der_corput_in_f32,
        ),
        exact(
            "twenty-four-bits",
            "cutting to 24 bits lowers the mean by 2⁻²⁵ and leaves every binary stratum alone; rounding moves points to the next one",
            &[3],
            twenty_four_bits,
        ),
        exact(
            "index-wraps",
            "a 32-bit index over the whole image wraps: negative coordinates, equal pixels; ours is per pixel and refused beyond 2²⁴",
            &[4],
            index_wraps,
        ),
        exact(
            "i-over-n-in-f32",
            "f32(i)/f32(n) is equal for neighbours beyond 2²⁴; our i/n is different for each i",
            &[5],
            i_over_n_in_f32,
        ),
        exact(
            "r2-in-f32",
            "frac(i·α) in f32 has 16 values near i = 10⁶; in integers the points stay even",
            &[6],
            r2_in_f32,
        ),
        exact(
            "lattice-in-u32",
            "(i·g) mod n in u32 repeats points once i·g ≥ 2³², unless n is a power of two; in u64 all are different",
            &[7],
            lattice_in_u32,
        ),
    ]
}

/// φ_b(i) as Σ digit · f32 powers.
fn digit_sum(base: u32, mut index: u64) -> f32 {
    let inverse = 1.0 / base as f32;
    let (mut power, mut sum) = (inverse, 0.0f32);
    while index > 0 {
        sum += power * (index % u64::from(base)) as f32;
        index /= u64::from(base);
        power *= inverse;
    }
    sum
}

/// φ_b(i) as the mirrored integer times an f32 power.
fn mirrored_times_power(base: u32, mut index: u64) -> f32 {
    let inverse = 1.0 / base as f32;
    let (mut mirror, mut power) = (0u64, 1.0f32);
    while index > 0 {
        mirror = mirror * u64::from(base) + index % u64::from(base);
        index /= u64::from(base);
        power *= inverse;
    }
    mirror as f32 * power
}

/// The first index of the form bᵏ − 1 at which `inverse` reaches 1.
fn first_at_one(base: u32, inverse: fn(u32, u64) -> f32) -> Option<u64> {
    (1..40).map_while(|k| u64::from(base).checked_pow(k)).map(|power| power - 1).find(|&i| inverse(base, i) >= 1.0)
}

fn halton_in_f32(_: &Context) -> Finding {
    let mut tally = Tally::new();
    // Base, then the index by either arithmetic (`failures_measured.json`).
    let measured = [
        (2, 33_554_431, 33_554_431),
        (3, 43_046_720, 4_782_968),
        (5, 48_828_124, 9_765_624),
        (7, 40_353_606, 5_764_800),
        (11, 19_487_170, 19_487_170),
        (13, 62_748_516, 4_826_808),
    ];
    for (base, by_sum, by_mirror) in measured {
        let found = [first_at_one(base, digit_sum), first_at_one(base, mirrored_times_power)];
        tally.fact(
            format!("base {base} in f32 reaches 1 at {by_sum} (digit sum) and {by_mirror} (mirrored): found {found:?}"),
            found == [Some(by_sum), Some(by_mirror)],
        );
    }
    let tickets = Tickets::new();
    let sampler = tickets.sampler("halton:joint:none", MAX_SAMPLES, 1);
    let mut largest = 0.0f64;
    for (axis, &base) in PRIMES[..7].iter().enumerate() {
        let last = (1..).map(|k| base.pow(k)).take_while(|&power| power <= MAX_SAMPLES).map(|power| power - 1);
        for index in last {
            let ours = f64::from(tickets.coordinates(&sampler, pixel(0), index)[axis]);
            let below = radical_inverse_f64(base, index) - ours;
            largest = largest.max(ours);
            tally.fact(
                format!("base {base}, index {index}: {ours} is below 1 and {below:e} below the exact value"),
                ours < 1.0 && (0.0..2f64.powi(-24) + 2f64.powi(-32)).contains(&below),
            );
        }
    }
    let gap = 1.0 - largest;
    tally.saying(format!("in f32 base 3 is 1.0 at 4 782 968 and base 13 at 4 826 808; ours stays {gap:.1e} below 1"))
}

fn van_der_corput_in_f32(_: &Context) -> Finding {
    let mut tally = Tally::new();
    let top = u32::MAX - 511..=u32::MAX;
    let naive: Vec<u32> = top.clone().filter(|&word| word as f32 * 2f32.powi(-32) >= 1.0).collect();
    tally.fact(format!("{} words become 1.0 in f32", naive.len()), naive.len() == 128 && naive[0] == 0xFFFF_FF80);
    tally.fact("no word's top 24 bits are 1.0", top.map(unit_f32).all(|u| u < 1.0));
    // Every digital shift of 2²⁴ points meets the largest fraction once: there x is 1 − 2⁻²⁴ and no more.
    let tickets = Tickets::new();
    let sampler = tickets.sampler("ld:step:xor", MAX_SAMPLES, 1);
    let mut largest = 0.0f32;
    for i in 0..256 {
        let word = (sampler.get_2d(pixel(i), 0, &tickets.pixel)[0] * 16_777_216.0) as u32;
        let index = (!(word << 8) & 0xFFFF_FF00).reverse_bits();
        largest = sampler.get_2d(pixel(i), index, &tickets.pixel)[0].max(largest);
    }
    tally.near("the largest x of shifted sets", f64::from(largest), 1.0 - 2f64.powi(-24), 0.0);
    tally.saying(format!("{} of the top 512 words become 1.0 in f32; our largest x is 1 − 2⁻²⁴", naive.len()))
}

fn twenty_four_bits(_: &Context) -> Finding {
    let mut tally = Tally::new();
    // All multiples of 2⁻²⁴, each once: the mean of 2²⁴ points, or of all words. Partial sums are integers below 2⁴⁸.
    let sum: f64 = (0..MAX_SAMPLES).map(|top| f64::from(unit_f32(top << 8)) * 16_777_216.0).sum();
    let mean = sum / 2f64.powi(48);
    tally.near("the mean over all words", mean, 0.5 - 2f64.powi(-25), 0.0);
    let (mut cut, mut rounded) = (0, 0);
    for low in 0..256u32 {
        for top in [0, 1, 0x55_5555, 0xFF_FFFE, 0xFF_FFFF] {
            let word = top << 8 | low;
            let exact = f64::from(word) / 4_294_967_296.0;
            let left = |u: f32| (1..=24).any(|m| (f64::from(u) * 2f64.powi(m)) as u64 != (exact * 2f64.powi(m)) as u64);
            cut += u32::from(left(unit_f32(word)));
            rounded += u32::from(left((exact * 16_777_216.0).round_ties_even() as f32 / 16_777_216.0));
        }
    }
    tally.fact(format!("{cut} of 1280 words leave a dyadic stratum when cut"), cut == 0);
    // Low bytes above the middle go up, and with odd words above them (three of the five) also the middle itself: ties go
    // to even.
    tally.fact(format!("{rounded} of 1280 words leave one when rounded"), rounded == 5 * 127 + 3);
    // Strata whose edges are no binary fractions are met to 2⁻²⁴: the least fraction of the second of three falls below 1/3.
    let third = in_stratum(1, 3, 0);
    let below = 1.0 / 3.0 - f64::from(unit_f32(third));
    tally.fact(format!("the edge 1/3 is missed by {below:.1e}"), below > 0.0 && below < 2f64.powi(-24));
    // The sampler itself: a scrambled set of 2¹⁶ points keeps each in its stratum of width 2⁻¹⁶.
    let tickets = Tickets::new();
    let sampler = tickets.sampler("ld:step:owen", 1 << 16, 1);
    let xs = super::common::all(&sampler, PixelKey::new(0, 0), &tickets.pixel);
    let strata = distinct(xs.iter().map(|[x, _]| (x * 65_536.0) as u32));
    tally.fact(format!("{strata} of 65 536 strata are filled"), strata == 65_536);
    tally.saying(format!(
        "mean over all words = ½ − {:e}; cut, {cut} of 1280 leave a stratum, rounded, {rounded}",
        0.5 - mean
    ))
}

/// φ_b of a signed index: the remainder of a negative number is negative.
fn inverse_of_i32(base: i32, mut index: i32) -> f64 {
    let (mut power, mut sum) = (1.0, 0.0);
    while index != 0 {
        power /= f64::from(base);
        sum += power * f64::from(index % base);
        index /= base;
    }
    sum
}

fn index_wraps(_: &Context) -> Finding {
    let mut tally = Tally::new();
    let negative = inverse_of_i32(3, 2_147_483_648u32 as i32);
    tally.fact(format!("as i32, sample 2³¹ in base 3 is {negative}"), negative < 0.0);
    for past in [0u64, 1] {
        let wrapped = ((1u64 << 32) + past) as u32;
        tally.fact(format!("as u32, sample 2³² + {past} is sample {wrapped}"), u64::from(wrapped) == past);
    }
    // One running index over a 1920 × 1080 image at 4096 spp: after 2²⁰ pixels the numbers begin anew.
    let running = |x: u32, y: u32| (y * 1920 + x).wrapping_mul(4096);
    tally.fact(
        "a running u32 index gives pixels (0, 0) and (256, 546) the same numbers",
        running(0, 0) == running(256, 546),
    );
    let tickets = Tickets::new();
    for text in ["uniform", "stratified", "halton", "hammersley", "ld", "sobol"] {
        let sampler = tickets.sampler(text, 4096, 1);
        let of = |key| (0..16).map(|i| sampler.get_2d(key, i, &tickets.pixel)).collect::<Vec<_>>();
        tally.fact(
            format!("{text} gives the two pixels different numbers"),
            of(PixelKey::new(0, 0)) != of(PixelKey::new(256, 546)),
        );
        for asked in [MAX_SAMPLES + 1, 1 << 31, u32::MAX] {
            let refused = Sampler::new(spec(text), &tickets.layout, asked, 1);
            tally.fact(
                format!("{text} refuses {asked} samples with a message that names them"),
                refused.is_err_and(|e| e.exit_code() == 2 && e.to_string().contains(&asked.to_string())),
            );
        }
        let beyond = [1u64 << 31, (1 << 32) - 1, 1 << 32, (1 << 32) + 1].map(|i| sampler.check_index(i));
        tally.fact(format!("{text} refuses sample indices about 2³¹ and 2³²"), beyond.iter().all(Result::is_err));
    }
    tally.saying(format!(
        "as i32, sample 2³¹ in base 3 is {negative:.3}; as u32, pixels 2²⁰ apart are equal at 4096 spp; ours are not"
    ))
}

fn i_over_n_in_f32(_: &Context) -> Finding {
    let mut tally = Tally::new();
    let (n, window) = (1u32 << 25, 4096);
    let naive = distinct((n - window..n).map(|i| (i as f32 / n as f32).to_bits()));
    tally.fact(format!("of the last {window} i/n at n = 2²⁵ in f32, {naive} differ"), naive <= window as usize / 2 + 1);
    let tickets = Tickets::new();
    let mut least = window as usize;
    for n in [MAX_SAMPLES, MAX_SAMPLES - 1, 10_000_019] {
        let sampler = tickets.sampler("hammersley:plain", n, 1);
        for first in [0, n / 3, n - window] {
            let xs = super::common::span(&sampler, pixel(0), &tickets.pixel, first, window);
            let ours = distinct(xs.iter().map(|[x, _]| x.to_bits()));
            least = least.min(ours);
            tally.fact(format!("of {window} x from {first} at n = {n}, {ours} differ"), ours == window as usize);
            let exact = xs.iter().zip(first..).all(|([x, _], i)| {
                let below = f64::from(i) / f64::from(n) - x;
                (-f64::EPSILON..2f64.powi(-24) + 2f64.powi(-32)).contains(&below)
            });
            tally.fact(format!("each of them is i/n cut to 24 bits at n = {n}"), exact);
        }
    }
    tally.saying(format!(
        "of {window} neighbours {naive} differ in f32 at n = 2²⁵, {least} in ours at every n up to 2²⁴, more is refused"
    ))
}

/// Roberts' R2 constants 1/g and 1/g², g the plastic number, as fractions of 2⁶⁴ (g³ = g + 1).
const R2: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

fn r2_in_f32(_: &Context) -> Finding {
    let mut tally = Tally::new();
    let window = 1_000_000..1_001_024u32;
    let in_f32: Vec<Point> = window.clone().map(|i| R2.map(|a| f64::from((i as f32 * a as f32).fract()))).collect();
    // The multiplication modulo 2⁶⁴ drops whole turns and nothing else.
    let fixed = R2.map(|a| (a * 18_446_744_073_709_551_616.0) as u64);
    let in_integers: Vec<Point> =
        window.map(|i| fixed.map(|a| (u64::from(i).wrapping_mul(a) >> 11) as f64 * 2f64.powi(-53))).collect();
    let values = distinct(in_f32.iter().map(|[x, _]| x.to_bits()));
    tally.fact(format!("{values} different x of 1024 in f32"), values <= 16);
    let (naive, right) = (star(&in_f32), star(&in_integers));
    tally.fact(
        format!("D* of 1024 points from 10⁶ on: {naive:.4} in f32, {right:.4} in integers"),
        naive > 10.0 * right,
    );
    // This lab has no R2. Its own sum modulo 1, the toroidal shift, is one of integers at any index: differences
    // between points are those of the unshifted sequence.
    let tickets = Tickets::new();
    let [plain, shifted] = ["halton:step:none", "halton:step:shift"].map(|text| {
        let sampler = tickets.sampler(text, 1_001_024, 1);
        super::common::span(&sampler, pixel(0), &tickets.pixel, 1_000_000, 1024)
    });
    let shift = |a: &Point, b: &Point| [0, 1].map(|k| (a[k] - b[k] + 1.0).fract());
    let first = shift(&shifted[0], &plain[0]);
    let worst = shifted.iter().zip(&plain).flat_map(|(a, b)| {
        let other = shift(a, b);
        [0, 1].map(|k| {
            let d = (other[k] - first[k]).abs();
            d.min(1.0 - d)
        })
    });
    let worst = worst.fold(0.0, f64::max);
    // Each side is cut to 24 bits twice: two ulps.
    tally.near("the toroidal shift of points from 10⁶ on, against that of the first", worst, 0.0, 2f64.powi(-23));
    let ours = star(&shifted);
    tally.fact(format!("D* of our 1024 shifted Halton points from 10⁶ on: {ours:.4}"), ours < naive / 5.0);
    tally.saying(format!("D* of 1024 points from i = 10⁶: {naive:.4} in f32 ({values} values of x), {right:.4} in integers; our shifted Halton {ours:.4}"))
}

fn lattice_in_u32(_: &Context) -> Finding {
    let mut tally = Tally::new();
    // Fibonacci numbers 29 and 30; and a power of two, which divides 2³², so that nothing is lost there.
    let repeated = |n: u32, g: u32| n as usize - distinct((0..n).map(|i| i.wrapping_mul(g) % n));
    let (n, g) = (832_040, 514_229);
    let naive = repeated(n, g);
    let first_wrong = (0..n).find(|&i| u64::from(i.wrapping_mul(g) % n) != u64::from(i) * u64::from(g) % u64::from(n));
    tally.fact(format!("u32 repeats {naive} of {n} points"), naive == 69_817);
    tally.fact(
        format!("the first wrong index is {first_wrong:?}"),
        first_wrong == Some((1u64 << 32).div_ceil(u64::from(g)) as u32),
    );
    let power = repeated(1 << 20, 648_055);
    tally.fact(format!("at n = 2²⁰ u32 repeats {power} points"), power == 0);
    let right = distinct((0..u64::from(n)).map(|i| i * u64::from(g) % u64::from(n)));
    tally.fact(format!("u64 has {right} of {n} different points"), right == n as usize);
    // This lab has no lattice. The product it forms with an index, ⌊i · 2³² / n⌋, is the same one and is formed in u64.
    let ours = distinct(points("hammersley:plain", n, 1).iter().map(|[x, _]| (x * f64::from(n)).round() as u32));
    tally.fact(format!("our i/n has {ours} of {n} different x"), ours == n as usize);
    tally.saying(format!(
        "the lattice ({n}; 1, {g}) in u32 repeats {naive} points from index {} on; in u64 none",
        first_wrong.unwrap_or(0)
    ))
}

//! Failures that show in the points themselves.

use crate::sampling::halton::digit_scrambled;
use crate::sampling::hash::{derive, derive_named, unit_f32};
use crate::sampling::radical::{digit_count, radical_inverse, radical_inverse_f64};
use crate::sampling::strata::in_stratum_f64;
use crate::sampling::{Decision, PixelKey, PointSource, Preset, SampleLayout, Sampler, SamplerSpec, point_set};
use crate::stats::discrepancy::{Points, star_2d, t_value};
use crate::stats::{Estimate, t_interval};

use super::super::pictures::NamedPoints;
use super::{Evidence, Failure, Side};

fn exact(value: f64) -> Estimate {
    Estimate { value, ci95: Some([value; 2]) }
}

fn star(points: &[[f64; 2]]) -> Option<f64> {
    Some(star_2d(&Points::new_2d(points).ok()?).value)
}

fn set(text: &str, n: u32, seed: u64) -> Option<Vec<[f64; 2]>> {
    point_set(SamplerSpec::parse(text, Preset::Best).ok()?, n, seed).ok()
}

/// Independent randomisations.
const SETS: u64 = 64;

pub fn shift_of_a_net(seed: u64) -> Option<Failure> {
    const N: u32 = 256;
    let of = |text: &str| {
        let t = |i: u64| Some(f64::from(t_value(&Points::new_2d(&set(text, N, derive(seed, &[i]))?).ok()?)?));
        let values: Vec<f64> = (0..SETS).map(t).collect::<Option<_>>()?;
        Some(t_interval(&values, 0.95))
    };
    let (shifted, scrambled) = (of("ld:step:shift")?, of("ld:step:owen")?);
    Some(Failure {
        title: "a net shifted modulo 1",
        quantity: format!("t-value in base 2, mean of {SETS} sets (0: every elementary box has its share); n = {N}"),
        failing: Side { way: "ld:step:shift", number: shifted },
        sound: Side { way: "ld:step:owen", number: scrambled },
        evidence: Evidence::Apart { larger_is_worse: true },
        cause: "a toroidal shift moves points across the borders of elementary boxes, all by the same step",
        remedy: "scramble or shift the digits: both keep a net a net",
    })
}

/// The first half of a Hammersley set, and the set of as many points.
fn halves() -> Option<[Vec<[f64; 2]>; 2]> {
    let whole = set("hammersley:plain", 256, 0)?;
    Some([whole[..128].to_vec(), set("hammersley:plain", 128, 0)?])
}

pub fn prefix_of_a_set() -> Option<Failure> {
    let [half, whole] = halves()?;
    Some(Failure {
        title: "half of a Hammersley set",
        quantity: "star discrepancy D* of 128 points, exact (no unit)".to_owned(),
        failing: Side { way: "the first 128 of 256", number: exact(star(&half)?) },
        sound: Side { way: "the set of 128", number: exact(star(&whole)?) },
        evidence: Evidence::Apart { larger_is_worse: true },
        cause: "x = i/n: the first half of the points lies in the left half of the square",
        remedy: "draw the whole set, or use a sequence ((0,2), Halton) where the count is open",
    })
}

/// Halton's points in bases 17 and 19, as they are or under digit permutations.
fn high(n: u32, key: Option<u64>) -> Vec<[f64; 2]> {
    let coordinate = |base: u32, i: u32| match key {
        None => radical_inverse_f64(base, i),
        Some(key) => {
            let scrambled = digit_scrambled(base, digit_count(base, n), i, derive(key, &[u64::from(base)]));
            f64::from(scrambled) / 4_294_967_296.0
        }
    };
    (0..n).map(|i| [coordinate(17, i), coordinate(19, i)]).collect()
}

pub fn high_bases(seed: u64) -> Option<Failure> {
    const N: u32 = 64;
    let seed = derive_named(seed, "gallery: bases");
    let scrambled: Vec<f64> = (0..SETS).map(|i| star(&high(N, Some(derive(seed, &[i]))))).collect::<Option<_>>()?;
    Some(Failure {
        title: "Halton in high bases",
        quantity: format!(
            "star discrepancy D* of dimensions 7 and 8 (bases 17, 19), n = {N} (no unit; mean of {SETS} sets where random)"
        ),
        failing: Side { way: "halton:joint:none", number: exact(star(&high(N, None))?) },
        sound: Side { way: "halton:joint:digits", number: t_interval(&scrambled, 0.95) },
        evidence: Evidence::Apart { larger_is_worse: true },
        cause: "until n reaches 17 · 19 both digits count up together: the points lie on a few lines",
        remedy: "permute the digits at random; give low bases to the decisions that matter",
    })
}

/// 3¹⁴ − 1, all digits 2: its inverse is 1 − 3⁻¹⁴, which as a single-precision product is not below 1.
const INDEX: u32 = 4_782_968;

/// Van der Corput's loop in single precision: the digits reversed, times 3⁻ᵏ.
fn single(base: u32, mut index: u32) -> f32 {
    let (inverse, mut scale, mut reversed) = (1.0 / base as f32, 1.0f32, 0u64);
    while index > 0 {
        reversed = reversed * u64::from(base) + u64::from(index % base);
        scale *= inverse;
        index /= base;
    }
    reversed as f32 * scale
}

pub fn single_precision() -> Option<Failure> {
    Some(Failure {
        title: "a radical inverse in single precision",
        quantity: format!("1 − φ₃({INDEX}), which has to lie above 0"),
        failing: Side { way: "a loop over f32", number: exact(1.0 - f64::from(single(3, INDEX))) },
        sound: Side { way: "halton", number: exact(1.0 - f64::from(unit_f32(radical_inverse(3, INDEX)))) },
        evidence: Evidence::Apart { larger_is_worse: false },
        cause: "1 − 3⁻¹⁴ rounds to 1 or above: the sample lies outside its pixel, an array index past its end",
        remedy: "integers to the end, then round down",
    })
}

/// x of the pixel against x of the lens, the points of one pixel.
fn paired(text: &str, seed: u64) -> Option<Vec<[f64; 2]>> {
    const N: usize = 256;
    let mut layout = SampleLayout::default();
    let (pixel, lens) = (layout.claim_2d(Decision::Pixel), layout.claim_2d(Decision::Lens));
    let spec = SamplerSpec::parse(text, Preset::Best).ok()?;
    let sampler = Sampler::new(spec, &layout, N as u32, seed).ok()?;
    let [mut u, mut v, mut unused] = [(); 3].map(|()| vec![0.0f32; N]);
    sampler.fill_2d(PixelKey::new(0, 0), 0, &pixel, &mut u, &mut unused);
    sampler.fill_2d(PixelKey::new(0, 0), 0, &lens, &mut v, &mut unused);
    Some(u.into_iter().zip(v).map(|(u, v)| [f64::from(u), f64::from(v)]).collect())
}

/// Jittered cells, `sets` sets one over the other: `taken` of columns × rows.
fn cells(columns: u32, rows: u32, taken: u32, sets: u64, seed: u64) -> Vec<[f64; 2]> {
    let jitter = |set: u64, cell: u32, axis: u64| derive(seed, &[set, u64::from(cell), axis]) as u32;
    let point = |set: u64, i: u32| {
        [in_stratum_f64(i % columns, columns, jitter(set, i, 0)), in_stratum_f64(i / columns, rows, jitter(set, i, 1))]
    };
    (0..sets).flat_map(|set| (0..taken).map(move |i| point(set, i))).collect()
}

pub fn panels(seed: u64) -> Option<Vec<NamedPoints>> {
    let named = |name: &str, points: Vec<[f64; 2]>| NamedPoints {
        name: name.to_owned(),
        points: points.into_iter().map(|[x, y]| (x, y)).collect(),
    };
    let [half, whole] = halves()?;
    Some(vec![
        named("pixel x, lens x: in step", paired("stratified:sheet", seed)?),
        named("Halton 17, 19", high(64, None)),
        named("half a Hammersley set", half),
        named("7 cells of 3 × 3", cells(3, 3, 7, 64, seed)),
        named("pixel x, lens x: apart", paired("stratified:best", seed)?),
        named("digits permuted", high(64, Some(seed))),
        named("a whole set", whole),
        named("8 cells of 4 × 2", cells(4, 2, 8, 64, seed)),
    ])
}

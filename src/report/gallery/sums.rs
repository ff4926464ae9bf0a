//! Failures that show in what a set integrates.

use crate::sampling::hash::{derive, derive_named, mix64};
use crate::sampling::sobol::{SobolAxis, owen_scramble};
use crate::sampling::strata::in_stratum_f64;
use crate::sampling::{Decision, Dim2, PixelKey, PointSource, Preset, SampleLayout, Sampler, SamplerSpec};
use crate::stats::{Estimate, sum, t_interval};

use super::super::coupling::VarianceRatio;
use super::super::evidence::{interpolated, ratio_of_roots};
use super::super::pairing;
use super::super::verdicts::Measured;
use super::{Evidence, Failure, Side};

/// Points of a set, where not said otherwise.
const POINTS: u32 = 256;
/// Independent sets.
const SETS: u32 = 512;
/// The integral of xy over the unit square.
const XY: f64 = 0.25;

/// A sampler's decision about the pixel, ready for one count and many seeds.
struct Source {
    spec: SamplerSpec,
    layout: SampleLayout,
    pixel: Dim2,
    seed: u64,
}

impl Source {
    fn new(text: &str, seed: u64) -> Option<Self> {
        let spec = SamplerSpec::parse(text, Preset::Best).ok()?;
        let mut layout = SampleLayout::default();
        let pixel = layout.claim_2d(Decision::Pixel);
        Some(Self { spec, layout, pixel, seed: derive_named(seed, "gallery") })
    }

    /// Points `first .. first + n` of pixel `at` where `asked` are asked for, in randomisation `set`.
    fn points(&self, asked: u32, first: u32, n: usize, set: u32, at: u32) -> Option<Vec<[f64; 2]>> {
        let sampler = Sampler::new(self.spec, &self.layout, asked, derive(self.seed, &[u64::from(set)])).ok()?;
        let (mut x, mut y) = (vec![0.0f32; n], vec![0.0f32; n]);
        sampler.fill_2d(PixelKey::new(at, 0), first, &self.pixel, &mut x, &mut y);
        Some(x.into_iter().zip(y).map(|(x, y)| [f64::from(x), f64::from(y)]).collect())
    }

    /// The whole set of `asked` points.
    fn set(&self, asked: u32, set: u32) -> Option<Vec<[f64; 2]>> {
        self.points(asked, 0, self.spec.taken(asked) as usize, set, 0)
    }
}

fn mean_of(points: &[[f64; 2]], f: impl Fn(f64, f64) -> f64) -> f64 {
    sum(points.iter().map(|&[x, y]| f(x, y))) / points.len() as f64
}

fn mean_xy(points: &[[f64; 2]]) -> f64 {
    mean_of(points, |x, y| x * y)
}

/// Mean square error of estimates of [`XY`], with its interval over sets.
fn mse_xy(estimates: &[f64]) -> Estimate {
    let squares: Vec<f64> = estimates.iter().map(|e| (e - XY) * (e - XY)).collect();
    t_interval(&squares, 0.95)
}

fn root(mse: &Estimate) -> Estimate {
    Estimate { value: mse.value.sqrt(), ci95: mse.ci95.map(|ends| ends.map(|end| end.max(0.0).sqrt())) }
}

/// Two lists of estimates of [`XY`] by their RMSE.
fn by_rmse(failing: (&'static str, &[f64]), sound: (&'static str, &[f64])) -> Option<(Side, Side, Evidence)> {
    let (a, b) = (mse_xy(failing.1), mse_xy(sound.1));
    let ratio = ratio_of_roots(&a, &b)?;
    Some((Side { way: failing.0, number: root(&a) }, Side { way: sound.0, number: root(&b) }, Evidence::Ratio(ratio)))
}

/// Two lists of estimates of one value by their means.
fn by_mean(
    failing: (&'static str, &[f64]),
    sound: (&'static str, &[f64]),
    value: f64,
) -> Option<(Side, Side, Evidence)> {
    let (a, b) = (Measured::mean(failing.1)?, Measured::mean(sound.1)?);
    let evidence = Evidence::Truth { value, failing: a.p_of(value), sound: b.p_of(value) };
    Some((Side { way: failing.0, number: a.estimate() }, Side { way: sound.0, number: b.estimate() }, evidence))
}

fn sets_of(estimate: impl Fn(u32) -> Option<f64>) -> Option<Vec<f64>> {
    (0..SETS).map(estimate).collect()
}

pub fn decisions_in_step(seed: u64) -> Option<Failure> {
    let means = |text: &str| pairing::means(SamplerSpec::parse(text, Preset::Best).ok()?, 64, seed);
    let (failing, sound, evidence) = by_mean(
        ("stratified:sheet", &means("stratified:sheet")?),
        ("stratified:best", &means("stratified:best")?),
        pairing::TRUTH,
    )?;
    Some(Failure {
        title: "decisions in step",
        quantity: "mean of ‖u − v‖² over two decisions, truth 1/3; n = 64".to_owned(),
        failing,
        sound,
        evidence,
        cause: "two decisions read the same points in the same order, so u tells v",
        remedy: "shuffle each decision's order, or give it dimensions of its own",
    })
}

/// Estimates of [`XY`] by the first point of the (0,2)-sequence, each axis under Owen's scramble with its own key or both with one.
fn net_with_keys(seed: u64, one_key: bool) -> Option<Vec<f64>> {
    let axes = [SobolAxis::new(0)?, SobolAxis::new(1)?];
    let seed = derive_named(seed, "gallery: keys");
    sets_of(|set| {
        let keys = [0, 1].map(|axis| mix64(derive(seed, &[u64::from(set), if one_key { 0 } else { axis }])) as u32);
        let unit = |axis: usize, i: u32| f64::from(owen_scramble(axes[axis].fraction(i), keys[axis])) / 4_294_967_296.0;
        // The net's first point, (0, 0) before: what a picture at 1 spp sees.
        Some(unit(0, 0) * unit(1, 0))
    })
}

pub fn one_key_for_both_axes(seed: u64) -> Option<Failure> {
    let (failing, sound, evidence) =
        by_mean(("one key", &net_with_keys(seed, true)?), ("a key an axis", &net_with_keys(seed, false)?), XY)?;
    Some(Failure {
        title: "both axes scrambled with one key",
        quantity: format!("mean of xy at the first point of the (0,2)-sequence, truth 1/4; n = 1, {SETS} scrambles"),
        failing,
        sound,
        evidence,
        cause: "both axes are permuted alike: a point with x = y before stays on the diagonal",
        remedy: "hash the dimension into the key",
    })
}

pub fn digital_shift_called_owen(seed: u64) -> Option<Failure> {
    let n = f64::from(POINTS);
    let of = |text: &str| {
        let source = Source::new(text, seed)?;
        let means = sets_of(|set| Some(mean_of(&source.set(POINTS, set)?, |x, _| x)))?;
        Some(VarianceRatio::of(&means, 1.0 / (12.0 * n * n * n))?.ratio)
    };
    let (shift, owen) = (of("ld:step:xor")?, of("ld:step:owen")?);
    Some(Failure {
        title: "a digital shift called Owen's scramble",
        quantity: format!("variance of the mean of x, times 12 n³ (Owen's: 1, a shift's: n); n = {POINTS}"),
        failing: Side { way: "ld:step:xor", number: shift },
        sound: Side { way: "ld:step:owen", number: owen },
        evidence: Evidence::Ratio(super::super::evidence::ratio(&shift, &owen)?),
        cause: "one word an axis moves all points alike: their errors add up",
        remedy: "nested uniform scramble; test its exact variance, not its slope",
    })
}

pub fn first_point_dropped(seed: u64) -> Option<Failure> {
    let source = Source::new("ld:step:owen", seed)?;
    let of = |first: u32| sets_of(|set| Some(mean_xy(&source.points(2 * POINTS, first, POINTS as usize, set, 0)?)));
    let (failing, sound, evidence) = by_rmse(("points 1 … n", &of(1)?), ("points 0 … n − 1", &of(0)?))?;
    Some(Failure {
        title: "the first point dropped",
        quantity: format!("RMSE of the mean of xy under Owen's scramble; n = {POINTS}"),
        failing,
        sound,
        evidence,
        cause: "points 1 … n of the sequence are no net (Owen 2020): one elementary box is empty, another has two",
        remedy: "keep point 0, and scramble, so that it is nowhere special",
    })
}

pub fn no_power_of_two(seed: u64) -> Option<Failure> {
    let source = Source::new("ld:step:owen", seed)?;
    let mse = |n: u32| Some(mse_xy(&sets_of(|set| Some(mean_xy(&source.set(n, set)?)))?));
    let odd = mse(48)?;
    let promised = interpolated(&[(32.0, mse(32)?), (64.0, mse(64)?)], 48.0)?;
    Some(Failure {
        title: "a count that is no power of two",
        quantity: "RMSE of the mean of xy under Owen's scramble; n = 48, against the line from 32 to 64".to_owned(),
        failing: Side { way: "n = 48", number: root(&odd) },
        sound: Side { way: "promised by 32 and 64", number: root(&promised) },
        evidence: Evidence::Ratio(ratio_of_roots(&odd, &promised)?),
        cause: "a (0,2)-sequence is a net only at powers of two: half of the boxes have a point more than the others",
        remedy: "take the next power of two",
    })
}

pub fn two_passes(seed: u64) -> Option<Failure> {
    let source = Source::new("ld:shuffle:owen", seed)?;
    let one = sets_of(|set| Some(mean_xy(&source.set(64, set)?)))?;
    let two = sets_of(|set| {
        let (first, second) = (source.set(1, 2 * set + SETS)?, source.set(63, 2 * set + SETS + 1)?);
        Some((mean_xy(&first) + 63.0 * mean_xy(&second)) / 64.0)
    })?;
    let (failing, sound, evidence) = by_rmse(("1 + 63", &two), ("64", &one))?;
    Some(Failure {
        title: "two passes, samplers begun anew",
        quantity: "RMSE of the mean of xy by `ld:best`; 64 samples in all".to_owned(),
        failing,
        sound,
        evidence,
        cause: "the second pass draws another set, of 63 points: neither is the net of 64",
        remedy: "one pass, or go on at the next index of the same set",
    })
}

pub fn leftover_strata(seed: u64) -> Option<Failure> {
    let (base, source) = (derive_named(seed, "gallery: strata"), Source::new("stratified:shuffle:jitter", seed)?);
    let grid = sets_of(|set| {
        let jitter = |cell: u32, axis: u32| derive(base, &[u64::from(set), u64::from(cell), u64::from(axis)]) as u32;
        let point = |i: u32| [in_stratum_f64(i % 3, 3, jitter(i, 0)), in_stratum_f64(i / 3, 3, jitter(i, 1))];
        Some(mean_xy(&(0..7).map(point).collect::<Vec<_>>()))
    })?;
    let equal = sets_of(|set| Some(mean_xy(&source.set(7, set)?)))?;
    let (failing, sound, evidence) = by_mean(("7 cells of 3 × 3", &grid), ("8 cells, 2 × 4", &equal), XY)?;
    Some(Failure {
        title: "strata left over: n is no square",
        quantity: format!("mean of xy over jittered cells, truth 1/4; n = 7 asked, {SETS} sets"),
        failing,
        sound,
        evidence,
        cause: "⌈√7⌉² = 9 cells, of which two never get a point",
        remedy: "take a count with a factor pair near a square (7 → 8 = 2 × 4): all strata equal",
    })
}

pub fn one_set_in_every_pixel(seed: u64) -> Option<Failure> {
    /// Pixels that are averaged, and samples in each.
    const PIXELS: u32 = 64;
    let of = |text: &str, sets: u32| {
        let source = Source::new(text, seed)?;
        let (mut single, mut area) = (Vec::new(), Vec::new());
        for set in 0..sets {
            let pixel = |at: u32| Some(mean_xy(&source.points(64, 0, 64, set, at)?));
            let pixels: Vec<f64> = (0..PIXELS).map(pixel).collect::<Option<_>>()?;
            area.push(sum(pixels.iter().copied()) / f64::from(PIXELS));
            single.push(sum(pixels.iter().map(|p| (p - XY) * (p - XY))) / f64::from(PIXELS));
        }
        let exact = |values: &[f64]| Estimate { value: values[0], ci95: Some([values[0]; 2]) };
        let area: Vec<f64> = area.iter().map(|e| (e - XY) * (e - XY)).collect();
        let [area, single] = [area, single].map(|v| if sets == 1 { exact(&v) } else { t_interval(&v, 0.95) });
        ratio_of_roots(&area, &single)
    };
    let (failing, sound) = (of("halton:joint:none", 1)?, of("halton:joint:digits@each", 128)?);
    Some(Failure {
        title: "one unrandomised set in every pixel",
        quantity: format!("RMSE of the average of {PIXELS} equal pixels over that of one (mean of xy, n = 64)"),
        evidence: Evidence::Ratio(super::super::evidence::ratio(&failing, &sound)?),
        failing: Side { way: "halton:joint:none", number: failing },
        sound: Side { way: "halton:best", number: sound },
        cause: "every pixel has the same error: it is bias and structure, and no averaging over an area removes it",
        remedy: "a randomisation with a key of the pixel",
    })
}

//! Samplers at work: a number is a pure function of (seed, pixel, sample index, dimension).

use std::hint::black_box;
use std::ops::Range;

use super::divisor::Divisor;
use super::halton::HaltonAxis;
use super::hash::{Permutation, bits32, derive, mix64, unit_f32};
use super::layout::{Claim, Decision, Dim1, Dim2, SampleLayout};
use super::radical::{PRIMES, radical_inverse_f64};
use super::set::{SamplerSet, sheet_1d};
use super::sobol::{SobolAxis, owen_scramble};
use super::spec::{MAX_SAMPLES, Order, Points, Random, SamplerSpec, Scope};
use super::strata::{factor_pair, in_stratum_f64, stratum_fraction};
use super::{ROW, each, mask_from, row};
use crate::error::{Error, Result};
use crate::mutants::{Mutant, planted, wrong};

/// Raised whenever the numbers of any sampler change.
pub const ALGORITHM: u32 = 1;

/// Whose numbers: one pixel of the image. Its key is (x, y), so crops and image sizes do not change it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelKey(u64);

impl PixelKey {
    /// The pixel in column `x` from the left and row `y` from the top.
    pub const fn new(x: u32, y: u32) -> Self {
        Self((y as u64) << 32 | x as u64)
    }

    /// The key as a word, different for every pixel: for keys that are derived from it.
    pub const fn word(self) -> u64 {
        self.0
    }
}

/// Numbers for the decisions of a scene.
///
/// The `fill` functions write a span of consecutive sample indices of one pixel and are the way of the render loop;
/// single look-ups are spans of length 1. Indices from `samples()` on belong to no set: asking for them is a mistake of the
/// program and stops it ([`Sampler::check_index`] asks first).
pub trait PointSource: Sync {
    /// Samples per pixel; indices are `0..samples()`.
    fn samples(&self) -> u32;
    /// Coordinates of samples `first .. first + out.len()`, each in [0, 1).
    fn fill_1d(&self, pixel: PixelKey, first: u32, dim: &Dim1, out: &mut [f32]);
    /// Coordinate pairs of samples `first .. first + x.len()`, each in [0, 1); `x` and `y` are of one length.
    fn fill_2d(&self, pixel: PixelKey, first: u32, dim: &Dim2, x: &mut [f32], y: &mut [f32]);

    /// As [`Self::fill_1d`], for `lanes` of a row and with `first` in the first of these; the other lanes stay as they are.
    #[inline(always)]
    fn fill_lanes_1d(&self, pixel: PixelKey, first: u32, dim: &Dim1, lanes: Range<usize>, out: &mut [f32; BLOCK]) {
        self.fill_1d(pixel, first, dim, &mut out[lanes]);
    }

    /// As [`Self::fill_2d`], for `lanes` of two rows and with `first` in the first of these; the other lanes stay as they are.
    #[inline(always)]
    fn fill_lanes_2d(
        &self,
        pixel: PixelKey,
        first: u32,
        dim: &Dim2,
        lanes: Range<usize>,
        [x, y]: [&mut [f32; BLOCK]; 2],
    ) {
        self.fill_2d(pixel, first, dim, &mut x[lanes.clone()], &mut y[lanes]);
    }

    /// One coordinate pair.
    fn get_2d(&self, pixel: PixelKey, index: u32, dim: &Dim2) -> [f32; 2] {
        let (mut x, mut y) = ([0.0], [0.0]);
        self.fill_2d(pixel, index, dim, &mut x, &mut y);
        [x[0], y[0]]
    }

    /// One coordinate.
    fn get_1d(&self, pixel: PixelKey, index: u32, dim: &Dim1) -> f32 {
        let mut x = [0.0];
        self.fill_1d(pixel, index, dim, &mut x);
        x[0]
    }
}

/// A sampler for each decision of a layout, for one count of samples and one seed (a replicate has its own).
#[derive(Debug, Clone)]
pub struct Sampler {
    decisions: [Option<DecisionSampler>; 4],
    samples: u32,
}

impl Sampler {
    /// Readies `set` for `asked` samples per pixel of a scene with this layout.
    ///
    /// # Errors
    /// Kind `Input` where a count is 0 or above 2²⁴, or `center` is asked for a decision about lights.
    pub fn new(set: impl Into<SamplerSet>, layout: &SampleLayout, asked: u32, seed: u64) -> Result<Self> {
        let set = set.into();
        if asked == 0 || asked > MAX_SAMPLES {
            return Err(Error::input("samples per pixel", format!("expected 1 to {MAX_SAMPLES}, found {asked}")));
        }
        let samples = set.taken(asked, layout);
        let mut decisions = [const { None }; 4];
        for &claim in layout.claims() {
            let spec = set.of(claim.decision);
            if spec.points == Points::Center && !matches!(claim.decision, Decision::Pixel | Decision::Lens) {
                return Err(Error::input(
                    "sampler \"center\"",
                    format!(
                        "expected a sampler with numbers for the decision \"{}\", found center",
                        claim.decision.name()
                    ),
                ));
            }
            decisions[claim.decision as usize] = Some(DecisionSampler::new(spec, claim, samples, seed));
        }
        Ok(Self { decisions, samples })
    }

    /// Whether sample `index` exists: for indices that come from outside. A set belongs to its count, so none of its points
    /// lies beyond; more samples are another sampler's, made for their count.
    ///
    /// # Errors
    /// Kind `Input` with the range.
    pub fn check_index(&self, index: u64) -> Result<()> {
        match index < u64::from(self.samples) {
            true => Ok(()),
            false => Err(Error::input("sample index", format!("expected 0 to {}, found {index}", self.samples - 1))),
        }
    }

    /// Gives the sampler another seed: as [`Self::new`] with that seed, without making its tables anew.
    pub fn reseed(&mut self, seed: u64) {
        for source in self.decisions.iter_mut().flatten() {
            source.reseed(seed);
        }
    }

    /// The integers behind [`fill_2d`](PointSource::fill_2d): 32-bit fractions of samples `first .. first + x.len()`, of
    /// which the renderer reads the top 24 bits. Elementary intervals are counted on these. `center` has one half.
    pub fn fractions_2d(&self, pixel: PixelKey, first: u32, dim: &Dim2, x: &mut [u32], y: &mut [u32]) {
        assert_eq!(x.len(), y.len());
        let source = self.decision(dim.decision());
        if source.spec.points == Points::Center {
            x.fill(1 << 31);
            y.fill(1 << 31);
            return;
        }
        let keys = source.keys(pixel);
        for (block, (x, y)) in x.chunks_mut(BLOCK).zip(y.chunks_mut(BLOCK)).enumerate() {
            let places = source.places(first + (block * BLOCK) as u32, 0..x.len(), &keys);
            for (axis, out) in [x, y].into_iter().enumerate() {
                out.copy_from_slice(&source.fractions(axis, &places, &keys)[..out.len()]);
            }
        }
    }

    fn decision(&self, decision: Decision) -> &DecisionSampler {
        self.decisions[decision as usize]
            .as_ref()
            .expect("a ticket is read by a sampler made for the layout that gave it")
    }
}

impl PointSource for Sampler {
    #[inline(always)]
    fn samples(&self) -> u32 {
        self.samples
    }

    #[inline(always)]
    fn fill_1d(&self, pixel: PixelKey, first: u32, dim: &Dim1, out: &mut [f32]) {
        for (block, out) in (0..).zip(out.chunks_mut(BLOCK)) {
            let mut row = [0.0; BLOCK];
            self.fill_lanes_1d(pixel, first + block * BLOCK as u32, dim, 0..out.len(), &mut row);
            put_part(out, &row);
        }
    }

    #[inline(always)]
    fn fill_2d(&self, pixel: PixelKey, first: u32, dim: &Dim2, x: &mut [f32], y: &mut [f32]) {
        assert_eq!(x.len(), y.len());
        for (block, (x, y)) in (0..).zip(x.chunks_mut(BLOCK).zip(y.chunks_mut(BLOCK))) {
            let [mut row_x, mut row_y] = [[0.0; BLOCK]; 2];
            let rows = [&mut row_x, &mut row_y];
            self.fill_lanes_2d(pixel, first + block * BLOCK as u32, dim, 0..x.len(), rows);
            put_part(x, &row_x);
            put_part(y, &row_y);
        }
    }

    #[inline(always)]
    fn fill_lanes_1d(&self, pixel: PixelKey, first: u32, dim: &Dim1, lanes: Range<usize>, out: &mut [f32; BLOCK]) {
        let source = self.decision(dim.decision());
        let keys = source.keys(pixel);
        let places = source.places(first, lanes.clone(), &keys);
        put_units(out, lanes, &source.fractions(0, &places, &keys));
    }

    #[inline(always)]
    fn fill_lanes_2d(
        &self,
        pixel: PixelKey,
        first: u32,
        dim: &Dim2,
        lanes: Range<usize>,
        rows: [&mut [f32; BLOCK]; 2],
    ) {
        let source = self.decision(dim.decision());
        if source.spec.points == Points::Center {
            for row in rows {
                put_units(row, lanes.clone(), &[1 << 31; BLOCK]);
            }
            return;
        }
        let keys = source.keys(pixel);
        let places = source.places(first, lanes.clone(), &keys);
        for (axis, out) in rows.into_iter().enumerate() {
            // Unseen by the compiler, which else works out for all kinds of axes, before the loop, what one of them needs.
            put_units(out, lanes.clone(), &source.fractions(axis, black_box(&places), &keys));
        }
    }
}

/// As much of a row as there is room for.
#[inline(always)]
fn put_part(out: &mut [f32], row: &[f32; BLOCK]) {
    match <&mut [f32; BLOCK]>::try_from(&mut *out) {
        Ok(whole) => *whole = *row,
        Err(_) => out.copy_from_slice(&row[..out.len()]),
    }
}

/// The unit-interval floats of the fractions in these lanes.
#[inline(always)]
fn put_units(out: &mut [f32; BLOCK], lanes: Range<usize>, fractions: &[u32; BLOCK]) {
    let units = each(fractions, unit_f32);
    if lanes.len() == BLOCK {
        *out = units;
        return;
    }
    for ((out, unit), inside) in out.iter_mut().zip(units).zip(mask(&lanes)) {
        *out = f32::from_bits((unit.to_bits() & inside) | (out.to_bits() & !inside));
    }
}

/// All bits in these lanes, none in the others.
#[inline(always)]
fn mask(lanes: &Range<usize>) -> [u32; BLOCK] {
    let mut mask = [0; BLOCK];
    for (mask, (from, after)) in mask.iter_mut().zip(mask_from(lanes.start).iter().zip(mask_from(lanes.end))) {
        *mask = from & !after;
    }
    mask
}

/// Indices looked up at once: what stays the same along a span is decided once a block.
pub const BLOCK: usize = ROW;

/// One decision's numbers: the specification made ready.
#[derive(Debug, Clone)]
struct DecisionSampler {
    spec: SamplerSpec,
    decision: Decision,
    /// 1-D decisions of stratified sets, and of the sheet's presets, have n strata on a line.
    strata: [Divisor; 2],
    samples: u32,
    axes: [Axis; 2],
    random_key: u64,
    shuffle_key: u64,
}

/// One coordinate of a point set, ready to look up.
#[derive(Debug, Clone)]
struct Axis {
    /// Number of the set's dimension: keys depend on it.
    dimension: u32,
    kind: AxisKind,
}

#[derive(Debug, Clone)]
enum AxisKind {
    Uniform,
    StratifiedX,
    StratifiedY,
    Halton(HaltonAxis),
    /// With the number of points.
    HammersleyX(Divisor),
    VanDerCorput,
    Sobol(SobolAxis),
}

/// π(i) for the lanes of a block.
enum Places {
    /// Lane l stands for this and l more. Modulo 2³²: what comes before the first lane asked for may lie below 0, and what comes after
    /// the last beyond the count. Nobody reads these.
    Run(u32),
    /// Any order; 0 in lanes that nobody reads.
    Any(Aligned),
}

/// A row that lies in one cache line: it goes through memory between being made and being read.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Aligned([u32; BLOCK]);

impl Places {
    /// The places in a row, none of them below 0.
    #[inline(always)]
    fn row(&self) -> [u32; BLOCK] {
        match self {
            Self::Run(first) => row(*first),
            Self::Any(places) => places.0,
        }
    }
}

/// The keys of one decision in one pixel.
struct Keys {
    axes: [u64; 2],
    shuffle: u64,
}

const RANDOM_TAG: u64 = 1;
const SHUFFLE_TAG: u64 = 2;

impl DecisionSampler {
    fn new(mut spec: SamplerSpec, claim: Claim, samples: u32, seed: u64) -> Self {
        let one_d = claim.count == 1;
        if one_d && spec.sheet_1d {
            spec = sheet_1d(spec);
        }
        let first = if spec.order == Order::Joint { claim.first } else { 0 };
        let axis = |axis: u32| {
            let dimension = first + axis;
            let kind = match (spec.points, axis) {
                (Points::Uniform | Points::Center, _) => AxisKind::Uniform,
                (Points::Stratified, 0) => AxisKind::StratifiedX,
                (Points::Stratified, _) => AxisKind::StratifiedY,
                (Points::Halton, _) => AxisKind::Halton(HaltonAxis::new(PRIMES[dimension as usize], samples)),
                (Points::Hammersley, 0) => {
                    let shifted = spec.random != Random::Yxor && planted(Mutant::DividedByOneLess);
                    AxisKind::HammersleyX(Divisor::new(u64::from(if shifted { (samples - 1).max(1) } else { samples })))
                }
                (Points::Hammersley, _) => AxisKind::VanDerCorput,
                (Points::Ld, 0) => AxisKind::VanDerCorput,
                (Points::Ld | Points::Sobol, _) => {
                    AxisKind::Sobol(SobolAxis::new(dimension).expect("a layout has fewer than 256 dimensions"))
                }
            };
            Axis { dimension, kind }
        };
        let strata = match (spec.points, one_d) {
            (Points::Stratified, false) => {
                let (a, b) = factor_pair(samples).expect("the count taken by a stratified sampler has a factor pair");
                (b, a)
            }
            _ => (samples, 1),
        };
        let mut made = Self {
            spec,
            decision: claim.decision,
            strata: [strata.0, strata.1].map(|count: u32| Divisor::new(count.into())),
            samples,
            axes: [axis(0), axis(1)],
            random_key: 0,
            shuffle_key: 0,
        };
        made.reseed(seed);
        made
    }

    fn reseed(&mut self, seed: u64) {
        let seed = if planted(Mutant::SeedsReused) { seed >> 1 } else { seed };
        let decision = self.decision as u64;
        let random_path: &[u64] = match self.spec.scope {
            _ if planted(Mutant::DecisionsShareSeed) => &[RANDOM_TAG],
            Scope::Decision | Scope::Each => &[RANDOM_TAG, decision],
            Scope::Image | Scope::Pixel => &[RANDOM_TAG],
        };
        self.random_key = derive(seed, random_path);
        self.shuffle_key = derive(seed, &[SHUFFLE_TAG, if planted(Mutant::ShuffleShared) { 0 } else { decision }]);
    }

    #[inline(always)]
    fn keys(&self, pixel: PixelKey) -> Keys {
        let of_pixel = match self.spec.scope {
            _ if planted(Mutant::PixelKeyDropped) => 0,
            Scope::Pixel | Scope::Each => mix64(pixel.0.wrapping_add(0x51_7cc1_b727_220a)),
            Scope::Image | Scope::Decision => 0,
        };
        let key = |base: u64, word: u64| mix64(base ^ of_pixel.wrapping_add(word.wrapping_mul(0xd6e8_feb8_6659_fd93)));
        Keys {
            axes: [0, 1].map(|a: usize| {
                let a = if planted(Mutant::AxesShareKey) { 0 } else { a };
                key(self.random_key, u64::from(self.axes[a].dimension) + 1)
            }),
            shuffle: key(self.shuffle_key, 0),
        }
    }

    /// π(i) for the indices from `first` on, in these lanes.
    #[inline(always)]
    fn places(&self, first: u32, lanes: Range<usize>, keys: &Keys) -> Places {
        // Also in release: beyond its count Hammersley's x is 1 and strata begin anew.
        let end = u64::from(first) + lanes.len() as u64;
        assert!(end <= u64::from(self.samples), "samples {first} to {end} asked of {}", self.samples);
        assert!(lanes.end <= BLOCK);
        let before = lanes.start as u32;
        if self.spec.order != Order::Shuffle || planted(Mutant::ShuffleForgotten) {
            return Places::Run(first.wrapping_sub(before));
        }
        let mut places = [0; BLOCK];
        for (lane, (place, inside)) in (0u32..).zip(places.iter_mut().zip(mask(&lanes))) {
            *place = first.wrapping_add(lane.wrapping_sub(before)) & inside;
        }
        if planted(Mutant::ShuffleWithReplacement) {
            places[lanes].iter_mut().for_each(|place| *place = bits32(keys.shuffle, *place) % self.samples);
        } else {
            Permutation::new(self.samples, keys.shuffle).places(&mut places);
        }
        Places::Any(Aligned(places))
    }

    /// R(P(i, axis)) as a 32-bit fraction, for every place.
    ///
    /// What kind of axis this is gets looked at once, so that each loop is straight arithmetic.
    #[inline(always)]
    fn fractions(&self, axis: usize, places: &Places, keys: &Keys) -> [u32; BLOCK] {
        let key = keys.axes[axis];
        let [columns, rows] = self.strata;
        let row_length = if planted(Mutant::StrataTransposed) { rows } else { columns };
        let skipped = if planted(Mutant::FirstPointDropped) { 1 } else { 0 };
        let jitter = |i| if planted(Mutant::JitterForgotten) { 0 } else { bits32(key, i) };
        let column = |i: u32| row_length.remainder(i.into()) as u32;
        let row = |i: u32| row_length.quotient(i.into()) as u32;
        match &self.axes[axis].kind {
            AxisKind::Uniform => each(&places.row(), |i| bits32(key, i)),
            AxisKind::StratifiedX => each(&places.row(), |i| stratum_fraction(column(i), columns, jitter(i))),
            AxisKind::StratifiedY => each(&places.row(), |i| stratum_fraction(row(i), rows, jitter(i))),
            AxisKind::Halton(halton) if self.spec.random == Random::Digits => {
                halton.digit_scrambled(&places.row(), key)
            }
            AxisKind::Halton(halton) => {
                let plain = match places {
                    Places::Run(first) => halton.run(*first),
                    Places::Any(places) => halton.radical_inverses(&places.0),
                };
                self.randomised(key, plain)
            }
            AxisKind::HammersleyX(cells) if self.spec.random == Random::Yxor => {
                each(&places.row(), |i| stratum_fraction(i, *cells, 0))
            }
            AxisKind::HammersleyX(cells) => {
                self.randomised(key, each(&places.row(), |i| stratum_fraction(i, *cells, 0)))
            }
            AxisKind::VanDerCorput if planted(Mutant::BytesReversed) => {
                self.randomised(key, each(&places.row(), u32::swap_bytes))
            }
            AxisKind::VanDerCorput => self.randomised(key, each(&places.row(), |i| (i + skipped).reverse_bits())),
            AxisKind::Sobol(sobol) => {
                let plain = match places {
                    Places::Run(first) => sobol.run(first.wrapping_add(skipped)),
                    Places::Any(places) => sobol.fractions(&each(&places.0, |i| i + skipped)),
                };
                self.randomised(key, plain)
            }
        }
    }

    /// As [`Self::fractions`], for a set that is randomised after its points are known.
    #[inline(always)]
    fn randomised(&self, key: u64, plain: [u32; BLOCK]) -> [u32; BLOCK] {
        // Keys are well mixed: their halves serve as words.
        let word = key as u32;
        match self.spec.random {
            Random::Xor | Random::Yxor => each(&plain, |x| x ^ word),
            Random::Shift if planted(Mutant::ShiftClamped) => each(&plain, |x| x.saturating_add(word)),
            Random::Shift => each(&plain, |x| x.wrapping_add(word)),
            Random::Owen if planted(Mutant::XorForOwen) => each(&plain, |x| x ^ word),
            Random::Owen if planted(Mutant::OwenOfBurley) => each(&plain, |x| wrong::burley_scramble(x, word)),
            Random::Owen => each(&plain, |x| owen_scramble(x, word)),
            Random::None | Random::Fresh | Random::Jitter | Random::Digits => plain,
        }
    }

    /// One of [`Self::fractions`].
    fn fraction(&self, axis: usize, i: u32, keys: &Keys) -> u32 {
        let mut places = [0; BLOCK];
        places[0] = i;
        self.fractions(axis, &Places::Any(Aligned(places)), keys)[0]
    }

    /// The same value correctly rounded to f64 where the 32-bit fraction is not exact.
    fn coordinate_f64(&self, axis: usize, i: u32, keys: &Keys) -> f64 {
        let key = keys.axes[axis];
        let [columns, rows] = self.strata.map(|count| count.value() as u32);
        match (&self.axes[axis].kind, self.spec.random) {
            (AxisKind::Halton(halton), Random::None) => radical_inverse_f64(halton.base(), i),
            (AxisKind::HammersleyX(_), Random::None | Random::Yxor) => f64::from(i) / f64::from(self.samples),
            (AxisKind::StratifiedX, _) => in_stratum_f64(i % columns, columns, bits32(key, i)),
            (AxisKind::StratifiedY, _) => in_stratum_f64(i / columns, rows, bits32(key, i)),
            _ => f64::from(self.fraction(axis, i, keys)) / 4_294_967_296.0,
        }
    }
}

/// The 2-D point set that `spec` gives a pixel's first decision, in f64: for measuring, plotting and writing down.
///
/// The set is that of pixel (0, 0) under `seed`. Coordinates are in [0, 1), correctly rounded where they are rationals
/// (the renderer reads the top 24 bits of the same fractions).
///
/// # Errors
/// Kind `Input` where `asked` is 0 or above 2²⁴, or the sampler is `center`.
pub fn point_set(spec: SamplerSpec, asked: u32, seed: u64) -> Result<Vec<[f64; 2]>> {
    if spec.points == Points::Center {
        return Err(Error::input(
            "sampler \"center\"",
            "expected a sampler with numbers, found center, which has none",
        ));
    }
    let mut layout = SampleLayout::default();
    let _ticket = layout.claim_2d(Decision::Pixel);
    let sampler = Sampler::new(spec, &layout, asked, seed)?;
    let source = sampler.decision(Decision::Pixel);
    let keys = source.keys(PixelKey::new(0, 0));
    Ok((0..sampler.samples)
        .map(|i| {
            let [place, ..] = source.places(i, 0..1, &keys).row();
            [0, 1].map(|axis| source.coordinate_f64(axis, place, &keys))
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::super::spec::{Preset, every_legal_spec};
    use super::*;

    fn spec(text: &str) -> SamplerSpec {
        SamplerSpec::parse(text, Preset::Best).unwrap()
    }

    struct Tickets {
        layout: SampleLayout,
        pixel: Dim2,
        lens: Dim2,
        pick: Dim1,
        light: Dim2,
    }

    fn tickets() -> Tickets {
        let mut layout = SampleLayout::default();
        let pixel = layout.claim_2d(Decision::Pixel);
        let lens = layout.claim_2d(Decision::Lens);
        let pick = layout.claim_1d(Decision::LightPick);
        let light = layout.claim_2d(Decision::LightPoint);
        Tickets { layout, pixel, lens, pick, light }
    }

    #[test]
    fn spans_equal_single_look_ups_in_any_order_for_every_legal_sampler() {
        let t = tickets();
        for s in every_legal_spec().into_iter().filter(|s| s.points != Points::Center) {
            for asked in [1, 7, 16, 26, 33] {
                let sampler = Sampler::new(s, &t.layout, asked, 42).unwrap();
                let n = sampler.samples() as usize;
                let pixel = PixelKey::new(3, 5);
                for dim in [&t.light, &t.pixel, &t.lens] {
                    let (mut x, mut y) = (vec![0.0; n], vec![0.0; n]);
                    sampler.fill_2d(pixel, 0, dim, &mut x, &mut y);
                    for i in (0..n).rev() {
                        assert_eq!(sampler.get_2d(pixel, i as u32, dim), [x[i], y[i]], "{s}");
                        assert!((0.0..1.0).contains(&x[i]) && (0.0..1.0).contains(&y[i]), "{s}");
                    }
                }
                let mut x = vec![0.0; n];
                sampler.fill_1d(pixel, 0, &t.pick, &mut x);
                assert!((0..n).all(|i| sampler.get_1d(pixel, i as u32, &t.pick) == x[i] && x[i] < 1.0), "{s}");
            }
        }
    }

    #[test]
    fn f64_points_are_the_renderers_numbers_before_truncation() {
        let t = tickets();
        for s in every_legal_spec().into_iter().filter(|s| s.points != Points::Center) {
            let sampler = Sampler::new(s, &t.layout, 48, 9).unwrap();
            for (i, point) in point_set(s, 48, 9).unwrap().into_iter().enumerate() {
                let used = sampler.get_2d(PixelKey::new(0, 0), i as u32, &t.pixel);
                for (exact, used) in point.into_iter().zip(used) {
                    let below = exact - f64::from(used);
                    // Truncation to 24 bits, and one rounding down to 32 bits before it.
                    assert!((-f64::EPSILON..2f64.powi(-24) + 2f64.powi(-32)).contains(&below), "{s}: {below:e}");
                }
            }
        }
    }

    #[test]
    fn a_reseeded_sampler_is_one_made_with_that_seed_and_reads_the_top_of_its_fractions() {
        let t = tickets();
        for s in every_legal_spec().into_iter().filter(|s| s.points != Points::Center) {
            let mut sampler = Sampler::new(s, &t.layout, 20, 1).unwrap();
            sampler.reseed(2);
            let fresh = Sampler::new(s, &t.layout, 20, 2).unwrap();
            let pixel = PixelKey::new(6, 1);
            for dim in [&t.pixel, &t.lens, &t.light] {
                let (mut x, mut y) = ([0; 20], [0; 20]);
                sampler.fractions_2d(pixel, 0, dim, &mut x, &mut y);
                for (i, (x, y)) in (0..).zip(x.into_iter().zip(y)) {
                    assert_eq!(fresh.get_2d(pixel, i, dim), [x, y].map(unit_f32), "{s}");
                }
            }
            assert!((0..20).all(|i| sampler.get_1d(pixel, i, &t.pick) == fresh.get_1d(pixel, i, &t.pick)), "{s}");
        }
    }

    #[test]
    fn scopes_share_keys_exactly_where_they_say() {
        let t = tickets();
        let same = |scope: Scope, order: &str| {
            let s = spec(&format!("ld:{order}:xor@{}", scope.word()));
            let sampler = Sampler::new(s, &t.layout, 16, 1).unwrap();
            let set = |pixel, dim: &Dim2| {
                let mut points: Vec<[f32; 2]> = (0..16).map(|i| sampler.get_2d(pixel, i, dim)).collect();
                points.sort_by(|a, b| a.partial_cmp(b).unwrap());
                points
            };
            let (a, b) = (PixelKey::new(0, 0), PixelKey::new(1, 0));
            (set(a, &t.pixel) == set(b, &t.pixel), set(a, &t.pixel) == set(a, &t.lens))
        };
        for order in ["step", "shuffle"] {
            assert_eq!(same(Scope::Image, order), (true, true));
            assert_eq!(same(Scope::Decision, order), (true, false));
            assert_eq!(same(Scope::Pixel, order), (false, true));
            assert_eq!(same(Scope::Each, order), (false, false));
        }
    }

    #[test]
    fn the_sheets_one_dimensional_sampler_is_strata_and_uniform_for_uniform() {
        let t = tickets();
        for name in ["stratified:sheet", "halton:sheet", "hammersley:sheet", "ld:sheet"] {
            let sampler = Sampler::new(spec(name), &t.layout, 16, 1).unwrap();
            for i in 0..16 {
                let u = sampler.get_1d(PixelKey::new(2, 2), i, &t.pick);
                assert_eq!((u * 16.0) as u32, i, "{name}");
            }
        }
        assert!(SamplerSet::from(spec("halton:sheet")).is_random(&t.layout));
        let mut no_pick = SampleLayout::default();
        no_pick.claim_2d(Decision::Pixel);
        assert!(!SamplerSet::from(spec("halton:sheet")).is_random(&no_pick));
    }

    #[test]
    fn an_index_beyond_the_count_is_refused_before_and_stops_the_program_after() {
        let t = tickets();
        for s in every_legal_spec().into_iter().filter(|s| s.points != Points::Center) {
            let sampler = Sampler::new(s, &t.layout, 16, 1).unwrap();
            assert!(sampler.check_index(u64::from(sampler.samples()) - 1).is_ok());
            for index in [u64::from(sampler.samples()), 1 << 31, u64::MAX] {
                assert_eq!(sampler.check_index(index).unwrap_err().exit_code(), 2, "{s}");
            }
        }
        let sampler = Sampler::new(spec("hammersley"), &t.layout, 16, 1).unwrap();
        let beyond = std::panic::catch_unwind(|| sampler.get_2d(PixelKey::new(0, 0), 16, &t.pixel));
        assert!(beyond.is_err());
    }

    #[test]
    fn counts_outside_their_range_are_refused() {
        let t = tickets();
        for asked in [0, MAX_SAMPLES + 1, u32::MAX] {
            assert_eq!(Sampler::new(spec("ld"), &t.layout, asked, 0).unwrap_err().exit_code(), 2);
        }
        assert!(Sampler::new(spec("center"), &t.layout, 4, 0).unwrap_err().to_string().contains("light pick"));
        assert!(Sampler::new(spec("hammersley"), &t.layout, MAX_SAMPLES, 0).is_ok());
    }
}

//! What the checks of failures share: samplers by name, point sets by measure, and contrasts that must be caught.

use crate::sampling::{
    Decision, Dim1, Dim2, PixelKey, PointSource, Preset, SampleLayout, Sampler, SamplerSpec, point_set,
};
use crate::stats::discrepancy::{Points, star_2d, t_value};
use crate::stats::{Family, Verdict, t_test};

use super::super::Tally;

/// A point of the plane.
pub type Point = [f64; 2];

/// A sampler by its name.
pub fn spec(text: &str) -> SamplerSpec {
    SamplerSpec::parse(text, Preset::Best).unwrap_or_else(|e| panic!("{e}"))
}

/// The set of pixel (0, 0), correctly rounded.
pub fn points(text: &str, n: u32, seed: u64) -> Vec<Point> {
    point_set(spec(text), n, seed).unwrap_or_else(|e| panic!("{e}"))
}

/// The layout of a scene that makes all four decisions, with its tickets.
pub struct Tickets {
    /// All that is claimed: 7 dimensions.
    pub layout: SampleLayout,
    /// Dimensions 0 and 1.
    pub pixel: Dim2,
    /// Dimensions 2 and 3.
    pub lens: Dim2,
    /// Dimension 4.
    pub pick: Dim1,
    /// Dimensions 5 and 6.
    pub light: Dim2,
}

impl Tickets {
    /// A fresh layout and its tickets.
    pub fn new() -> Self {
        let mut layout = SampleLayout::default();
        let pixel = layout.claim_2d(Decision::Pixel);
        let lens = layout.claim_2d(Decision::Lens);
        let pick = layout.claim_1d(Decision::LightPick);
        let light = layout.claim_2d(Decision::LightPoint);
        Self { layout, pixel, lens, pick, light }
    }

    /// A sampler for this layout.
    pub fn sampler(&self, text: &str, n: u32, seed: u64) -> Sampler {
        Sampler::new(spec(text), &self.layout, n, seed).unwrap_or_else(|e| panic!("{e}"))
    }

    /// All seven coordinates of a sample, dimension by dimension.
    pub fn coordinates(&self, sampler: &Sampler, pixel: PixelKey, index: u32) -> [f32; 7] {
        let [a, b] = sampler.get_2d(pixel, index, &self.pixel);
        let [c, d] = sampler.get_2d(pixel, index, &self.lens);
        let e = sampler.get_1d(pixel, index, &self.pick);
        let [f, g] = sampler.get_2d(pixel, index, &self.light);
        [a, b, c, d, e, f, g]
    }
}

/// Pixel number `i` of as many as are wanted: under the scope `each` a replicate of its own.
pub fn pixel(i: u32) -> PixelKey {
    PixelKey::new(i % 1024, i / 1024)
}

/// The points `first .. first + count` that a decision reads in a pixel.
pub fn span(sampler: &Sampler, pixel: PixelKey, dim: &Dim2, first: u32, count: u32) -> Vec<Point> {
    let (mut x, mut y) = (vec![0.0; count as usize], vec![0.0; count as usize]);
    sampler.fill_2d(pixel, first, dim, &mut x, &mut y);
    x.into_iter().zip(y).map(|(x, y)| [f64::from(x), f64::from(y)]).collect()
}

/// All points that a decision reads in a pixel.
pub fn all(sampler: &Sampler, pixel: PixelKey, dim: &Dim2) -> Vec<Point> {
    span(sampler, pixel, dim, 0, sampler.samples())
}

/// Mean of f over the points.
pub fn mean(points: &[Point], f: impl Fn(f64, f64) -> f64) -> f64 {
    points.iter().map(|&[x, y]| f(x, y)).sum::<f64>() / points.len() as f64
}

fn measured(points: &[Point]) -> Points {
    Points::new_2d(points).unwrap_or_else(|e| panic!("{e}"))
}

/// Exact star discrepancy.
pub fn star(points: &[Point]) -> f64 {
    star_2d(&measured(points)).value
}

/// The t of a (t, m, 2)-net; `None` where the count is no power of two.
pub fn net_t(points: &[Point]) -> Option<u32> {
    t_value(&measured(points))
}

/// Number of different values.
pub fn distinct<T: Ord>(values: impl IntoIterator<Item = T>) -> usize {
    let mut values: Vec<T> = values.into_iter().collect();
    values.sort_unstable();
    values.dedup();
    values.len()
}

/// The largest number of points in a cell of a columns × rows grid, and the smallest.
///
/// For sets as [`points`] gives them: jitter has 32 bits, so a point lies at least 2⁻³² of a cell below its upper edge, and what f64
/// rounds it down by at its lower edge is given back. (Cut to 24 bits, a point within 2⁻²⁴ of an edge that is no binary fraction may fall
/// below it.)
pub fn cell_counts(points: &[Point], columns: u32, rows: u32) -> (u32, u32) {
    let mut counts = vec![0u32; (columns * rows) as usize];
    let cell = |u: f64, cells: u32| (u * f64::from(cells) + 1e-10) as u32;
    for [x, y] in points {
        counts[(cell(*y, rows) * columns + cell(*x, columns)) as usize] += 1;
    }
    (counts.iter().copied().max().unwrap_or(0), counts.iter().copied().min().unwrap_or(0))
}

/// Asserts that a failing method is caught: that the mean of its `replicates` is not `exact`.
///
/// Contrasts are chosen so that their statistic lies beyond 20 on average, at the fewest replicates too, while thresholds lie
/// below 8: that one is missed has a probability below 1e-30 and is no part of a check's false alarms.
pub fn caught(tally: &mut Tally, what: &str, replicates: &[f64], exact: f64, family: Family) -> Verdict {
    let verdict = t_test(replicates, exact, family);
    tally.fact(format!("{what} is caught: {verdict}"), !verdict.holds());
    verdict
}

/// Mean of replicates, for words.
pub fn average(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

//! Do the points of one set depend on each other?
//!
//! *By what they integrate*: the variance of the mean of n independent points is σ²/n. With points that all have the same
//! distribution it is σ²/n · (1 + (n − 1) ρ̄), ρ̄ the mean correlation of f between two points of a set: below 1 they keep out of
//! each other's way (ρ̄ < 0; −1/(n − 1) is the least there is), at 1 they are uncorrelated.
//!
//! *By their places*: the number of pairs nearer than r on the torus. For independent uniform points the indicators of any two pairs
//! are independent, also of two that share a point, so the count has mean λ = n(n − 1)/2 · πr² and variance λ (1 − πr²),
//! exactly. This needs no second set, so it answers for sets with nothing random, too.

use crate::sampling::hash::{derive, derive_named};
use crate::sampling::{Decision, Dim2, PixelKey, PointSource, Points, SampleLayout, Sampler, SamplerSpec};
use crate::stats::Estimate;
use crate::stats::hypothesis::two_sided;

use super::super::verdicts::Measured;
use super::VarianceRatio;

/// Points of a set: a power of two, a square, and near what a pixel takes.
pub const POINTS: u32 = 256;
/// Independent sets: a variance is good to √(2/255), 9 %.
pub const SETS: u32 = 256;
/// Of these, the sets whose pairs are counted.
pub const PAIRED_SETS: u32 = 64;
/// Pairs nearer than this on the torus are near: half of the spacing of a square grid of [`POINTS`] points.
pub const NEAR: f64 = 0.5 / 16.0;

/// An integrand over the unit square.
#[derive(Debug, Clone, Copy)]
pub struct Integrand {
    /// What it is called in tables.
    pub name: &'static str,
    /// What it stands for in a picture.
    pub meaning: &'static str,
    /// The function.
    pub f: fn(f64, f64) -> f64,
    /// Its variance under a uniform point.
    pub variance: f64,
}

/// A smooth one and an edge.
pub const INTEGRANDS: [Integrand; 2] = [
    Integrand { name: "xy", meaning: "smooth shading", f: |x, y| x * y, variance: 7.0 / 144.0 },
    Integrand {
        name: "x² + y² < 2/π",
        meaning: "a curved edge",
        f: |x, y| f64::from(u8::from(x * x + y * y < std::f64::consts::FRAC_2_PI)),
        variance: 0.25,
    },
];

/// What a sampler's sets say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Within {
    /// Variance of the mean of each of [`INTEGRANDS`] over that of independent points; `None` where nothing is random.
    pub variances: [Option<VarianceRatio>; 2],
    /// Near pairs over their expected number under independence, with Student's interval over sets (exact of one set).
    pub near: Estimate,
    /// Two-sided p-value of that number of near pairs under independence.
    pub near_p: f64,
}

impl Within {
    /// ρ̄, the mean correlation of the first integrand between two points of a set.
    pub fn correlation(&self) -> Option<Estimate> {
        let of = |ratio: f64| (ratio - 1.0) / f64::from(POINTS - 1);
        let Estimate { value, ci95 } = self.variances[0]?.ratio;
        Some(Estimate { value: of(value), ci95: ci95.map(|ends| ends.map(of)) })
    }
}

/// Measures the sets that a sampler gives one decision; `None` for one without numbers.
pub fn measure(spec: SamplerSpec, seed: u64) -> Option<Within> {
    if spec.points == Points::Center {
        return None;
    }
    let mut layout = SampleLayout::default();
    let pixel = layout.claim_2d(Decision::Pixel);
    let base = derive_named(seed, "within a set");
    let count = if spec.is_random() { SETS } else { 1 };
    let sets: Vec<Vec<[f64; 2]>> =
        (0..count).map(|i| set(spec, &layout, &pixel, derive(base, &[u64::from(i)]))).collect::<Option<_>>()?;
    let variances = INTEGRANDS.map(|g| {
        let mean = |set: &Vec<[f64; 2]>| set.iter().map(|&[x, y]| (g.f)(x, y)).sum::<f64>() / set.len() as f64;
        let means: Vec<f64> = sets.iter().map(mean).collect();
        VarianceRatio::of(&means, g.variance / f64::from(POINTS))
    });
    let (near, near_p) = near_pairs(&sets[..sets.len().min(PAIRED_SETS as usize)]);
    Some(Within { variances, near, near_p })
}

fn set(spec: SamplerSpec, layout: &SampleLayout, pixel: &Dim2, seed: u64) -> Option<Vec<[f64; 2]>> {
    let sampler = Sampler::new(spec, layout, POINTS, seed).ok()?;
    let n = sampler.samples() as usize;
    let (mut x, mut y) = (vec![0.0f32; n], vec![0.0f32; n]);
    sampler.fill_2d(PixelKey::new(0, 0), 0, pixel, &mut x, &mut y);
    Some(x.into_iter().zip(y).map(|(x, y)| [f64::from(x), f64::from(y)]).collect())
}

/// Near pairs over their number under independence, and the p-value of it.
fn near_pairs(sets: &[Vec<[f64; 2]>]) -> (Estimate, f64) {
    let n = sets.first().map_or(0, Vec::len) as f64;
    let share = std::f64::consts::PI * NEAR * NEAR;
    let expected = n * (n - 1.0) / 2.0 * share;
    let counts: Vec<f64> = sets.iter().map(|set| count_near(set) as f64 / expected).collect();
    let mean = counts.iter().sum::<f64>() / counts.len() as f64;
    let error = ((1.0 - share) / expected / counts.len() as f64).sqrt();
    let p = two_sided((mean - 1.0) / error, f64::INFINITY);
    let near = Measured::mean(&counts).map_or(Estimate { value: mean, ci95: Some([mean; 2]) }, |m| m.estimate());
    (near, p)
}

/// Pairs nearer than [`NEAR`] on the torus: all are looked at.
fn count_near(points: &[[f64; 2]]) -> usize {
    let apart = |a: f64, b: f64| {
        let d = (a - b).abs();
        d.min(1.0 - d)
    };
    let is_near = |a: &[f64; 2], b: &[f64; 2]| {
        let (dx, dy) = (apart(a[0], b[0]), apart(a[1], b[1]));
        dx * dx + dy * dy < NEAR * NEAR
    };
    (0..points.len()).map(|i| points[..i].iter().filter(|other| is_near(&points[i], other)).count()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Preset;

    fn measured(text: &str) -> Within {
        measure(SamplerSpec::parse(text, Preset::Best).unwrap(), 4).unwrap()
    }

    /// Exact variances (tests/sampler_variance.rs): independent 1; jittered 16 × 16 cells xy (1/18 − 1/(144·256))/n²;
    /// Owen's net xy 7(4 + 3m)/(576 n³), m = 8. Intervals of 256 sets hold them except 1 in 20.
    #[test]
    fn variance_ratios_are_the_exact_ones() {
        let n = f64::from(POINTS);
        let over = |variance: f64| variance / (7.0 / 144.0 / n);
        let exact = [
            ("uniform", 1.0),
            ("stratified:best", over((1.0 / 18.0 - 1.0 / (144.0 * n)) / (n * n))),
            ("ld:best", over(7.0 * (4.0 + 24.0) / (576.0 * n * n * n))),
        ];
        for (name, exact) in exact {
            let ratio = measured(name).variances[0].unwrap().ratio;
            // Four standard errors of a variance of 256 sets.
            assert!((ratio.value / exact - 1.0).abs() < 4.0 * (2.0f64 / 255.0).sqrt(), "{name}: {ratio:?}, {exact}");
        }
    }

    #[test]
    fn independent_points_are_not_called_correlated_and_the_others_are() {
        let uniform = measured("uniform");
        assert!(uniform.near_p > 0.01 && uniform.variances.iter().all(|v| v.unwrap().p() > 0.01), "{uniform:?}");
        for name in ["stratified:best", "halton:best", "hammersley:best", "ld:best", "stratified:sheet", "ld:sheet"] {
            let found = measured(name);
            assert!(found.variances.iter().all(|v| v.unwrap().p_below < 1e-6), "{name}: {found:?}");
            assert!(found.correlation().unwrap().value < -0.9 / 255.0, "{name}: {found:?}");
            assert!(found.near_p < 1e-6 && found.near.value < 1.0, "{name}: {found:?}");
        }
        let fixed = measured("halton:sheet");
        assert!(fixed.variances[0].is_none() && fixed.near_p < 1e-6, "one set, and still an answer: {fixed:?}");
        assert_eq!(measure(SamplerSpec::parse("center", Preset::Best).unwrap(), 1), None);
    }
}

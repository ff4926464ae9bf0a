//! Two decisions of one pixel, without a renderer: does a sampler pair their numbers freely?
//!
//! The integrand ‖u − v‖² over u, v in the unit square is 1/3. Decisions that march in step see u = v only, and it
//! comes out wrong, or right on average with a spread that no count of samples reduces.

use crate::sampling::hash::derive;
use crate::sampling::{Decision, PixelKey, PointSource, Points, SampleLayout, Sampler, SamplerSpec};
use crate::stats::{Estimate, Moments, sum, t_interval};

/// The integral of ‖u − v‖² over both squares: 2 · 1/6.
pub const TRUTH: f64 = 1.0 / 3.0;
/// Samples per pixel.
pub const COUNTS: [u32; 3] = [16, 64, 1024];
/// Replicates: independent randomisations of one pixel, equal to each other where nothing is random.
pub const REPLICATES: u32 = 64;

/// What the replicates say at one count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paired {
    /// Mean over replicates with its 95 % interval; exact where they all agree.
    pub mean: Estimate,
    /// Standard deviation between replicates.
    pub spread: f64,
}

impl Paired {
    /// Whether the interval keeps off the truth by more than 0.01.
    pub fn is_wrong(&self) -> bool {
        self.mean.ci95.is_some_and(|[low, high]| low > TRUTH + 0.01 || high < TRUTH - 0.01)
    }
}

/// Whether the spread between replicates hardly falls: more than half of it is left from the first count to the last, where
/// independent samples leave an eighth.
pub fn is_stuck(values: &[Paired]) -> bool {
    match (values.first(), values.last()) {
        (Some(first), Some(last)) => first.spread > 0.0 && last.spread > 0.5 * first.spread,
        _ => false,
    }
}

/// Measures a sampler at each of [`COUNTS`]; `None` for one without numbers.
pub fn measure(spec: &SamplerSpec, seed: u64) -> Option<Vec<Paired>> {
    if spec.points == Points::Center {
        return None;
    }
    COUNTS.iter().map(|&n| at_count(*spec, n, seed)).collect()
}

fn at_count(spec: SamplerSpec, n: u32, seed: u64) -> Option<Paired> {
    let means = means(spec, n, seed)?;
    let moments: Moments = means.iter().copied().collect();
    Some(Paired { mean: t_interval(&means, 0.95), spread: moments.std()? })
}

/// The mean of ‖u − v‖² over `n` samples in each of [`REPLICATES`] randomisations; `None` for a count that is none.
pub fn means(spec: SamplerSpec, n: u32, seed: u64) -> Option<Vec<f64>> {
    let mut layout = SampleLayout::default();
    let (pixel, lens) = (layout.claim_2d(Decision::Pixel), layout.claim_2d(Decision::Lens));
    let replicate = |i: u32| {
        let sampler = Sampler::new(spec, &layout, n, derive(seed, &[u64::from(i)])).ok()?;
        let count = sampler.samples() as usize;
        let [mut ux, mut uy, mut vx, mut vy] = [(); 4].map(|()| vec![0.0f32; count]);
        sampler.fill_2d(PixelKey::new(0, 0), 0, &pixel, &mut ux, &mut uy);
        sampler.fill_2d(PixelKey::new(0, 0), 0, &lens, &mut vx, &mut vy);
        let square = |a: f32, b: f32| (f64::from(a) - f64::from(b)) * (f64::from(a) - f64::from(b));
        let terms = (0..count).map(|j| square(ux[j], vx[j]) + square(uy[j], vy[j]));
        Some(sum(terms) / count as f64)
    };
    (0..REPLICATES).map(replicate).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Preset;

    fn measured(text: &str) -> Vec<Paired> {
        measure(&SamplerSpec::parse(text, Preset::Best).unwrap(), 4).unwrap()
    }

    /// Values computed independently, their figures given to two digits; so means of 64 replicates are good to 0.01.
    #[test]
    fn the_literal_reading_misses_one_third_as_the_documentation_says() {
        for (name, limit) in [("stratified:sheet", 0.0), ("halton:sheet", 0.0), ("hammersley:sheet", 1.0 / 6.0)] {
            let last = measured(name)[2];
            assert!((last.mean.value - limit).abs() < 0.03 && last.is_wrong(), "{name}: {last:?}");
        }
        let ld = measured("ld:sheet");
        assert!(!ld[2].is_wrong() && is_stuck(&ld) && (ld[2].spread - 0.18).abs() < 0.04, "{ld:?}");
    }

    #[test]
    fn kept_apart_every_sampler_finds_one_third_and_gets_closer() {
        for name in ["uniform:best", "stratified:best", "halton:best", "hammersley:best", "ld:best", "sobol:best"] {
            let values = measured(name);
            assert!(!values[2].is_wrong() && !is_stuck(&values), "{name}: {values:?}");
        }
        assert_eq!(measure(&SamplerSpec::parse("center", Preset::Best).unwrap(), 1), None);
    }
}

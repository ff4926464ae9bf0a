//! Power spectra of the point sets of an experiment's samplers: a function of samplers and seed, the same on every machine.

use crate::sampling::hash::derive;
use crate::sampling::point_set;
use crate::stats::discrepancy::Points;
use crate::stats::spectrum::{Ring, Spectrum};
use crate::stats::{Estimate, sum, t_interval};

use super::figure::Rgb8;
use super::pictures::{ScaleBar, StripCell, StripLayout, diverging, strip};
use super::summarise::Summary;

/// Points of a set: a power of two and of four, so every sampler has its set.
pub const POINTS: u32 = 64;

/// Largest frequency along an axis: beyond the points' own number of columns, so that a lattice's peaks are seen.
pub const REACH: u32 = 32;

/// Sets whose mean spectrum is shown, where another seed gives another set.
pub const SETS: u32 = 64;

/// Frequencies called low: |ν| up to half of √n, where pixels have most of their power.
pub const LOW: u32 = 4;

/// Power is shown from this factor below that of independent points to this factor above.
const FACTOR: f64 = 8.0;

/// What the spectra of one sampler's sets say.
#[derive(Debug, Clone, PartialEq)]
pub struct SetPower {
    /// Index of the sampler.
    pub sampler: usize,
    /// Points of a set.
    pub points: usize,
    /// Mean over sets.
    pub mean: Spectrum,
    /// Mean power at frequencies up to [`LOW`], over sets; exact where nothing is random.
    pub low: Estimate,
    /// Mean power by |ν|, with 95 % intervals as if powers were exponentially distributed.
    pub rings: Vec<Ring>,
}

/// The spectra of all samplers that are one sampler for every decision: of what they give one decision in one pixel.
pub fn spectra(summary: &Summary) -> Vec<SetPower> {
    (0..summary.samplers.len()).filter_map(|sampler| of_sampler(summary, sampler)).collect()
}

fn of_sampler(summary: &Summary, sampler: usize) -> Option<SetPower> {
    let (spec, seed) = (summary.samplers[sampler].spec()?, summary.about.experiment.seed);
    let sets = if spec.is_random() { SETS } else { 1 };
    let all: Option<Vec<(usize, Spectrum)>> = (0..sets)
        .map(|set| {
            let points = point_set(spec, POINTS, derive(seed, &[u64::from(set)])).ok()?;
            Some((points.len(), Spectrum::of(&Points::new_2d(&points).ok()?, REACH)))
        })
        .collect();
    let all = all?;
    let low: Vec<f64> = all.iter().map(|(_, spectrum)| low_power(spectrum)).collect();
    let low = if sets > 1 { t_interval(&low, 0.95) } else { Estimate { value: low[0], ci95: Some([low[0]; 2]) } };
    let (points, spectra): (Vec<usize>, Vec<Spectrum>) = all.into_iter().unzip();
    let mean = Spectrum::mean(&spectra)?;
    let rings = mean.radial(points[0], 0.95);
    Some(SetPower { sampler, points: points[0], mean, low, rings })
}

/// Mean power at 0 < |ν| ≤ [`LOW`].
fn low_power(spectrum: &Spectrum) -> f64 {
    let within = |[a, b]: [i32; 2]| (a * a + b * b) as u32 <= LOW * LOW;
    let low: Vec<f64> = spectrum.half_plane().filter(|(nu, _)| within(*nu)).map(|(_, power)| power).collect();
    sum(low.iter().copied()) / low.len() as f64
}

/// The mean spectra as pictures, ν = 0 in the middle: white where points are as independent ones, blue where there is less power,
/// red where there is more.
pub fn maps(summary: &Summary, all: &[SetPower]) -> Option<Rgb8> {
    let maps: Vec<Rgb8> = all.iter().map(|found| map(&found.mean)).collect();
    let label = |found: &SetPower| summary.samplers[found.sampler].label.clone();
    let cells: Vec<StripCell> = all.iter().zip(&maps).map(|(found, map)| StripCell::new(map, &label(found))).collect();
    let label = "log2 of the power; 0: as independent points, −3: an eighth of that".to_owned();
    let scale_bar = Some(ScaleBar { scale: libm::log2(FACTOR), label });
    let layout = StripLayout { columns: cells.len().clamp(1, 5), whole: Some(4), crops: Vec::new(), scale_bar };
    (!cells.is_empty()).then(|| strip(&cells, &layout).ok()).flatten()
}

/// One map: a pixel a frequency, ν₁ to the right, ν₂ up.
fn map(spectrum: &Spectrum) -> Rgb8 {
    let reach = spectrum.reach() as i32;
    let side = (2 * reach + 1) as u32;
    let mut map = Rgb8::filled(side, side, [255; 3]);
    for (nu1, nu2) in (-reach..=reach).flat_map(|nu1| (-reach..=reach).map(move |nu2| (nu1, nu2))) {
        let power = spectrum.at([nu1, nu2]).filter(|_| (nu1, nu2) != (0, 0)).unwrap_or(1.0);
        let t = libm::log(power.clamp(1.0 / FACTOR, FACTOR)) / libm::log(FACTOR);
        map.set(i64::from(nu1 + reach), i64::from(reach - nu2), diverging(t));
    }
    map
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lattice of 8 × 8 has the power n at multiples of 8 and none elsewhere: red dots on blue, white in the middle.
    #[test]
    fn a_lattice_is_dots_of_power_on_nothing() {
        let points: Vec<[f64; 2]> = (0..64).map(|i| [f64::from(i % 8) / 8.0, f64::from(i / 8) / 8.0]).collect();
        let spectrum = Spectrum::of(&Points::new_2d(&points).unwrap(), REACH);
        assert!(low_power(&spectrum) < 1e-20);
        let map = map(&spectrum);
        assert_eq!(
            (map.pixel(32, 32), map.pixel(40, 32), map.pixel(32, 24)),
            ([255; 3], diverging(1.0), diverging(1.0))
        );
        assert_eq!((map.pixel(33, 32), map.pixel(36, 36)), (diverging(-1.0), diverging(-1.0)));
    }
}

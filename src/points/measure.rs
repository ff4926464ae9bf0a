//! Every metric of one point set.

use serde::Serialize;

use crate::error::{Error, Result};
use crate::stats::discrepancy::{
    Projection, STAR_COST_LIMIT, filled_strata, l2_all, min_toroidal_distance, star, t_of_projections, t_value,
};
use crate::stats::spectrum::{Peak, Ring, Spectrum};
use crate::stats::{Points, Side};

/// Every metric of one point set: what `measure` tells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measurement {
    /// Sampler or file.
    pub source: String,
    /// What the sampler's name stands for, the count asked and the seed; absent for files.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sampler: Option<SamplerSource>,
    /// Number of points.
    pub n: usize,
    /// Number of coordinates.
    pub dimension: usize,
    /// Star discrepancy with the box that attains it; absent where it was not asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub star: Option<StarValue>,
    /// The L2 kinds and diaphony, by name, in the order of the documentation.
    #[serde(flatten)]
    pub l2: L2Values,
    /// Smallest t for which the set is a (t, m, d)-net in base 2; null where n is no power of two or a coordinate is 1.
    pub t_value: Option<u32>,
    /// Smallest t of the projections onto two axes each; null where `t_value` is, or above 50 dimensions.
    pub projections: Option<Vec<Projection>>,
    /// How many of the n equal strata of each axis hold a point: n on all for a Latin hypercube.
    pub filled_strata: Vec<usize>,
    /// Smallest distance of two points on the torus; null for one point.
    pub min_toroidal_distance: Option<f64>,
    /// The same as a share of the hexagonal packing's √(2/(√3 n)); null for one point and outside the plane.
    pub relative_distance: Option<f64>,
    /// Power spectrum in short; null outside the plane and above [`SPECTRUM_LIMIT`] points.
    pub spectrum: Option<SpectrumSummary>,
}

/// Power spectra are told unasked for sets of at most so many points: a tenth of a second on two cores.
pub const SPECTRUM_LIMIT: usize = 4096;

/// A power spectrum in short: see [`Spectrum`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpectrumSummary {
    /// Frequencies run to so many turns on either axis.
    pub reach: u32,
    /// Mean power at 0 < |ν| < √n/2: 1 for independent points, near 0 for blue noise.
    pub low_frequency_mean: Option<f64>,
    /// The largest power.
    pub peak: Option<Peak>,
    /// Mean power by rings, with 95 % intervals for powers that scatter as those of random points do.
    pub radial: Vec<Ring>,
}

/// What to measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Steps that the exact star discrepancy may take; `None` leaves it out.
    pub star_cost: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self { star_cost: Some(STAR_COST_LIMIT) }
    }
}

/// Where the points of a sampler come from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SamplerSource {
    /// The whole name.
    pub expansion: String,
    /// Count asked for; `n` is the count taken.
    pub asked: u32,
    /// Seed of the randomisation.
    pub seed: u64,
}

/// Star discrepancy D*: the largest gap between counted and true measure of boxes at the origin.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StarValue {
    /// D*.
    pub value: f64,
    /// Always true: bounds are not given out as values.
    pub exact: bool,
    /// Upper corner of the box that attains it.
    pub corner: Vec<f64>,
    /// Whether the box is counted without (`open`) or with (`closed`) its upper faces.
    pub side: Side,
}

/// A root and its square; both null where they are below the resolution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Root {
    /// The discrepancy.
    pub value: Option<f64>,
    /// Its square, the quantity that sums are formed of.
    pub squared: Option<f64>,
    /// Bound on the absolute error of the square for the coordinates as given, apart from its last digit.
    pub resolution: f64,
}

/// Names and values in order.
#[derive(Debug, Clone, PartialEq)]
pub struct L2Values(pub Vec<(&'static str, Root)>);

impl Serialize for L2Values {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, root)| (name, root)))
    }
}

/// Measures a point set. Memory is about 250 bytes a point in the plane, 24 bytes a coordinate above it.
///
/// # Errors
/// Kind `Input` where the exact star discrepancy would take more steps than allowed, with the cost.
pub fn measure(source: &str, points: &Points, options: Options) -> Result<Measurement> {
    let star = match options.star_cost {
        Some(limit) => Some(star(points, limit).map_err(|cost| {
            Error::input(source, format!("{cost}; --max-cost STEPS allows more, --without-star measures the rest"))
        })?),
        None => None,
    };
    let l2 = l2_all(points).into_iter().map(|(kind, found)| {
        (kind.name(), Root { value: found.root(), squared: found.squared, resolution: found.resolution })
    });
    let distance = min_toroidal_distance(points);
    let in_plane = points.dimension() == 2;
    let densest = (2.0 / (3.0_f64.sqrt() * points.n() as f64)).sqrt();
    Ok(Measurement {
        source: source.to_owned(),
        sampler: None,
        n: points.n(),
        dimension: points.dimension(),
        star: star.map(|s| StarValue { value: s.value, exact: true, corner: s.corner, side: s.side }),
        l2: L2Values(l2.collect()),
        t_value: t_value(points),
        projections: t_of_projections(points),
        filled_strata: filled_strata(points),
        min_toroidal_distance: distance,
        relative_distance: distance.filter(|_| in_plane).map(|d| d / densest),
        spectrum: (in_plane && points.n() <= SPECTRUM_LIMIT)
            .then(|| summary(&Spectrum::of(points, spectrum_reach(points.n())), points.n())),
    })
}

/// Frequencies of a spectrum of n points: to 2 √n, twice the distance at which even points repeat, or where that would take more
/// than some ten seconds, n reach² = 2·10¹⁰, as far as that.
pub fn spectrum_reach(n: usize) -> u32 {
    let root = (n as f64).sqrt();
    (2.0 * root).ceil().min((2e10_f64.sqrt() / root).floor()).max(1.0) as u32
}

fn summary(spectrum: &Spectrum, n: usize) -> SpectrumSummary {
    let low = |[a, b]: [i32; 2]| 4.0 * (f64::from(a) * f64::from(a) + f64::from(b) * f64::from(b)) < n as f64;
    let low: Vec<f64> = spectrum.half_plane().filter(|(nu, _)| low(*nu)).map(|(_, power)| power).collect();
    SpectrumSummary {
        reach: spectrum.reach(),
        low_frequency_mean: (!low.is_empty()).then(|| low.iter().sum::<f64>() / low.len() as f64),
        peak: spectrum.peak(),
        radial: spectrum.radial(n, 0.95),
    }
}

/// A spectrum as CSV, one of each pair ±ν: ν₁, ν₂, P(ν) and the two-sided p-value for independent points.
pub fn spectrum_csv(spectrum: &Spectrum) -> String {
    let mut text = "nu1,nu2,power,p_value\n".to_owned();
    for ([nu1, nu2], power) in spectrum.half_plane() {
        text += &format!("{nu1},{nu2},{power},{}\n", spectrum.p_value(power));
    }
    text
}

impl Measurement {
    /// The same for people.
    pub fn to_text(&self) -> String {
        let mut text = format!("{}: {} points in {} dimensions\n", self.source, self.n, self.dimension);
        if let Some(star) = &self.star {
            let corner: Vec<String> = star.corner.iter().map(|c| format!("{c:.9}")).collect();
            let side = if star.side == Side::Open { "open" } else { "closed" };
            let corner = corner.join(", ");
            text += &row(
                "star discrepancy",
                format!("{:.12}  exact, at the {side} box with corner ({corner})", star.value),
            );
        }
        for (name, root) in &self.l2.0 {
            text += &row(
                name,
                match (root.value, root.squared) {
                    (Some(value), Some(squared)) => {
                        format!("{value:.12}  squared {squared:.12e} ± {:.0e}", root.resolution)
                    }
                    _ => format!("below the resolution: squared at most {:.0e}", root.resolution),
                },
            );
        }
        let no_net = || "none: n is no power of two, or a coordinate is 1".to_owned();
        text += &row("t_value", self.t_value.map_or_else(no_net, |t| t.to_string()));
        if let Some(worst) = self.projections.iter().flatten().max_by_key(|p| p.t).filter(|_| self.dimension > 2) {
            let pairs = self.projections.iter().flatten();
            let sum: u32 = pairs.clone().map(|p| p.t).sum();
            let mean = f64::from(sum) / pairs.count() as f64;
            text +=
                &row("t of 2-D projections", format!("mean {mean:.2}, at most {} (axes {:?})", worst.t, worst.axes));
        }
        let filled: Vec<String> = self.filled_strata.iter().map(usize::to_string).collect();
        text += &row("filled strata", format!("{} of {}", filled.join(", "), self.n));
        let distance = self.min_toroidal_distance.map_or("none: one point".to_owned(), |d| format!("{d:.12}"));
        let relative = self.relative_distance.map_or(String::new(), |r| format!("  {r:.4} of the densest packing's"));
        text += &row("min_toroidal_distance", distance + &relative);
        if let Some(spectrum) = &self.spectrum {
            let low = spectrum.low_frequency_mean.map_or("none".to_owned(), |mean| format!("{mean:.4}"));
            text += &row("power at |ν| < √n/2", format!("{low}  (1 for independent points)"));
            if let Some(peak) = spectrum.peak {
                let [a, b] = peak.frequency;
                text += &row("largest power", format!("{:.3} at ({a}, {b}), p = {:.2e}", peak.power, peak.p_value));
            }
        }
        text
    }
}

/// A line of the text: name and value.
fn row(name: &str, value: String) -> String {
    format!("  {name:<22} {value}\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Preset, SamplerSpec, point_set};

    /// `star_prefixes.json`: 64 Halton points have D* = 5/96, at a closed box.
    #[test]
    fn a_sampler_is_measured_at_full_precision() {
        let points = point_set(SamplerSpec::parse("halton:plain", Preset::Sheet).unwrap(), 64, 0).unwrap();
        let m = measure("halton:plain", &Points::new_2d(&points).unwrap(), Options::default()).unwrap();
        assert!((m.star.as_ref().unwrap().value - 5.0 / 96.0).abs() < 1e-14);
        let json = serde_json::to_value(&m).unwrap();
        assert_eq!(json["star"]["side"], "closed");
        assert!((json["l2_star"]["squared"].as_f64().unwrap() - 0.000_269_269_601_652_996_9).abs() < 1e-15);
    }
}

//! Do two decisions of one pixel depend on each other?
//!
//! The product integrand (f(u) − E f)(g(v) − E g) over the numbers u, v of two decisions is 0 on average if they are paired
//! freely: E f(u) g(v) = E f · E g. With f, g the coordinates of one axis, over its largest possible size 1/12, that is the
//! correlation ρ of the two decisions' numbers. Its mean over randomisations tells a bias (ρ ≠ 0). Where the mean is right
//! but each randomisation is coupled in another way, the *spread* tells: n independent pairs have a variance of 1/n.

use crate::sampling::hash::{derive, derive_named};
use crate::sampling::{Decision, PixelKey, PointSource, Points, SampleLayout, Sampler, SamplerSpec};
use crate::stats::hypothesis::two_sided;
use crate::stats::{Estimate, sum};

use super::super::verdicts::Measured;
use super::VarianceRatio;

/// Samples per pixel: a power of two and a square.
pub const SAMPLES: u32 = 64;
/// Independent randomisations of one pixel.
pub const REPLICATES: u32 = 256;

/// Two decisions along one axis of each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// The two decisions.
    pub decisions: [Decision; 2],
    /// Which axis of both: 0 is x.
    pub axis: usize,
    /// Mean correlation with its interval: Student's over randomisations; exact where nothing is random.
    pub rho: Estimate,
    /// p-value of ρ = 0: Student's t, or of one set the normal distribution of as many independent pairs.
    pub p_mean: f64,
    /// Variance of ρ between randomisations over that of independent pairs; `None` where nothing is random.
    pub spread: Option<VarianceRatio>,
}

/// Measures all pairs of `decisions`, axis by axis; `None` for a sampler without numbers.
pub fn measure(spec: SamplerSpec, decisions: &[Decision], seed: u64) -> Option<Vec<Coupling>> {
    if spec.points == Points::Center {
        return None;
    }
    let base = derive_named(seed, "between decisions");
    let count = if spec.is_random() || spec.sheet_1d { REPLICATES } else { 1 };
    let replicates: Vec<Vec<Vec<f64>>> =
        (0..count).map(|i| axes(spec, decisions, derive(base, &[u64::from(i)]))).collect::<Option<_>>()?;
    // Axes in order: decision, its axis.
    let places: Vec<(Decision, usize)> =
        decisions.iter().flat_map(|&d| (0..d.dimensions() as usize).map(move |axis| (d, axis))).collect();
    let mut found = Vec::new();
    for (i, &(a, axis)) in places.iter().enumerate() {
        for (j, &(b, other)) in places.iter().enumerate().skip(i + 1) {
            if a != b && axis == other {
                let values: Vec<f64> = replicates.iter().map(|axes| correlation(&axes[i], &axes[j])).collect();
                found.push(coupling([a, b], axis, &values));
            }
        }
    }
    Some(found)
}

/// 12 · mean (u − ½)(v − ½).
fn correlation(u: &[f64], v: &[f64]) -> f64 {
    12.0 * sum(u.iter().zip(v).map(|(u, v)| (u - 0.5) * (v - 0.5))) / u.len() as f64
}

fn coupling(decisions: [Decision; 2], axis: usize, values: &[f64]) -> Coupling {
    let independent = 1.0 / f64::from(SAMPLES);
    let spread = VarianceRatio::of(values, independent).filter(|found| found.ratio.value > 0.0);
    let (rho, p_mean) = match (Measured::mean(values), spread) {
        (Some(mean), Some(_)) => (mean.estimate(), mean.p_of(0.0)),
        // All alike: one value, judged as that of independent pairs would be.
        _ => {
            let value = values[0];
            let p = two_sided(value / independent.sqrt(), f64::INFINITY);
            (Estimate { value, ci95: Some([value; 2]) }, p)
        }
    };
    Coupling { decisions, axis, rho, p_mean, spread }
}

/// The numbers of one pixel, axis by axis in the order of the decisions.
fn axes(spec: SamplerSpec, decisions: &[Decision], seed: u64) -> Option<Vec<Vec<f64>>> {
    let mut layout = SampleLayout::default();
    // Tickets come in the order of the claims.
    enum Ticket {
        One(crate::sampling::Dim1),
        Two(crate::sampling::Dim2),
    }
    let tickets: Vec<Ticket> = decisions
        .iter()
        .map(|&decision| match decision.dimensions() {
            1 => Ticket::One(layout.claim_1d(decision)),
            _ => Ticket::Two(layout.claim_2d(decision)),
        })
        .collect();
    let sampler = Sampler::new(spec, &layout, SAMPLES, seed).ok()?;
    let n = sampler.samples() as usize;
    let pixel = PixelKey::new(0, 0);
    let wide = |values: Vec<f32>| values.into_iter().map(f64::from).collect::<Vec<f64>>();
    let mut found = Vec::new();
    for ticket in &tickets {
        let (mut x, mut y) = (vec![0.0f32; n], vec![0.0f32; n]);
        match ticket {
            Ticket::One(ticket) => sampler.fill_1d(pixel, 0, ticket, &mut x),
            Ticket::Two(ticket) => sampler.fill_2d(pixel, 0, ticket, &mut x, &mut y),
        }
        found.push(wide(x));
        if matches!(ticket, Ticket::Two(_)) {
            found.push(wide(y));
        }
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Preset;

    const ALL: [Decision; 3] = [Decision::Pixel, Decision::Lens, Decision::LightPoint];

    fn measured(text: &str) -> Vec<Coupling> {
        measure(SamplerSpec::parse(text, Preset::Best).unwrap(), &ALL, 4).unwrap()
    }

    #[test]
    fn decisions_in_step_are_coupled_and_those_kept_apart_are_not() {
        for name in ["stratified:sheet", "halton:sheet"] {
            let found = measured(name);
            assert_eq!(found.len(), 6, "three pairs, two axes");
            assert!(found.iter().all(|c| c.rho.value > 0.95 && c.p_mean < 1e-9), "{name}: {found:?}");
        }
        // Hammersley's x is i/n for all decisions; its y has a digital shift of its own for each, as both axes of ld.
        let found = measured("hammersley:sheet");
        assert!(found.iter().filter(|c| c.axis == 0).all(|c| c.rho.value > 0.99), "{found:?}");
        // The correlation of y and y ⊕ c is Σ ± 3/4^k over random signs: mean 0, variance 9/15 = 0.6, so 64 · 0.6 = 38.4.
        for found in measured("ld:sheet").iter().chain(found.iter().filter(|c| c.axis == 1)) {
            let ratio = found.spread.unwrap().ratio.value;
            assert!(found.p_mean > 1e-3 && (ratio / 38.4 - 1.0).abs() < 0.25, "{found:?}");
        }
        for name in ["uniform", "stratified:best", "halton:best", "hammersley:best", "ld:best", "sobol:best"] {
            for c in measured(name) {
                assert!(c.p_mean > 1e-4 && c.spread.unwrap().p_above > 1e-4, "{name}: {c:?}");
            }
        }
    }

    #[test]
    fn a_light_pick_is_paired_along_its_one_axis() {
        let spec = SamplerSpec::parse("ld:sheet", Preset::Best).unwrap();
        let found = measure(spec, &[Decision::Pixel, Decision::LightPick], 4).unwrap();
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].decisions, found[0].axis), ([Decision::Pixel, Decision::LightPick], 0));
    }
}

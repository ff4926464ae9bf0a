//! Power spectra of point sets at integer frequencies.
//!
//! P(ν) = |Σ_j exp(−2πi ν·x_j)|²/n on the unit torus, P(−ν) = P(ν), P(0) = n. For independent uniform points P has mean 1 and,
//! for n large, is exponentially distributed; the mean over K such sets times K is Gamma(K, 1) distributed, and over
//! N frequencies of a half-plane, about independent, Gamma(K N, 1). That gives every frequency a p-value and every ring
//! its interval. A toroidal shift changes nothing. The direct sum, no transform of splatted points: what is told are the
//! points' own frequencies.

use std::f64::consts::TAU;

use rayon::prelude::*;
use serde::Serialize;

use super::discrepancy::Points;
use super::discrepancy::double::Double;
use super::special::{incomplete_gamma_upper, solve_falling};

/// P(ν) of a set in any dimension, to about 1e-15 n.
///
/// # Panics
/// Where the frequency has not one number an axis.
pub fn power_at(points: &Points, frequency: &[i32]) -> f64 {
    assert_eq!(frequency.len(), points.dimension(), "a frequency has one number an axis");
    let (mut real, mut imaginary) = (Double::from(0.0), Double::from(0.0));
    for p in points.iter() {
        // Whole turns are taken off each product exactly.
        let turns: f64 = p.iter().zip(frequency).map(|(x, nu)| turn(*nu, *x)).sum();
        let (cosine, sine) = on_circle(turns);
        real = real.plus(Double::from(cosine));
        imaginary = imaginary.plus(Double::from(sine));
    }
    (real.value() * real.value() + imaginary.value() * imaginary.value()) / points.n() as f64
}

/// Exactly expected power of jittered k × k strata at ν ≠ 0: 1 − sinc²(ν₁/k) sinc²(ν₂/k), sinc t = sin(πt)/(πt).
pub fn expected_of_jittered(strata_per_axis: u32, [nu1, nu2]: [i32; 2]) -> f64 {
    let sinc_squared = |nu: i32| {
        let t = f64::from(nu) / f64::from(strata_per_axis);
        if nu == 0 {
            return 1.0;
        }
        let (_, sine) = on_circle(0.5 * (t - 2.0 * (0.5 * t).round()));
        let sinc = sine / (0.5 * TAU * t);
        sinc * sinc
    };
    1.0 - sinc_squared(nu1) * sinc_squared(nu2)
}

/// ν x without its whole turns, in about [−½, ½].
fn turn(nu: i32, x: f64) -> f64 {
    let product = Double::product(f64::from(nu), x);
    (product.high - product.high.round()) + product.low
}

/// Cosine and sine of so many turns; exact at quarters, so that what cancels on a lattice cancels.
fn on_circle(turns: f64) -> (f64, f64) {
    let quarters = (4.0 * turns).round();
    let (sine, cosine) = libm::sincos(TAU * (turns - 0.25 * quarters));
    match quarters.rem_euclid(4.0) as u8 {
        0 => (cosine, sine),
        1 => (-sine, cosine),
        2 => (-cosine, -sine),
        _ => (sine, -cosine),
    }
}

/// The mean power of one or more sets in the plane at all frequencies of a square.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// |ν_k| is at most this.
    reach: u32,
    /// How many sets the mean is over.
    sets: u32,
    /// By ν₁ in 0..=reach, then ν₂ in −reach..=reach; the other half is the same.
    power: Vec<f64>,
}

/// A frequency of the half-plane and its mean power.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Peak {
    /// ν.
    pub frequency: [i32; 2],
    /// P(ν).
    pub power: f64,
    /// Probability that independent points have so large a power at any of the frequencies of the spectrum.
    pub p_value: f64,
}

/// Mean power of the frequencies whose length rounds to `radius`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ring {
    /// The ring is radius − ½ ≤ |ν| < radius + ½.
    pub radius: u32,
    /// Radius in units of √n, the mean distance of points being 1.
    pub relative_radius: f64,
    /// Frequencies in the ring, one of each pair ±ν.
    pub frequencies: u32,
    /// Mean power; 1 for independent points.
    pub mean: f64,
    /// Interval of the expected power at the asked confidence, as if every power were exponentially distributed about it.
    pub interval: [f64; 2],
    /// 10 log₁₀(s²/mean²) with s² the unbiased variance in the ring: −10 log₁₀ K for an isotropic noise averaged over K
    /// sets, more where directions differ; `None` for one frequency or no power.
    pub anisotropy_db: Option<f64>,
}

/// Points summed up at a time.
const BLOCK: usize = 256;

impl Spectrum {
    /// The spectrum of one set in the plane for |ν_k| ≤ `reach`: O(n reach²) in parallel, 32 bytes a frequency.
    ///
    /// Absolute error about 1e-15 n. The same bits on any number of threads.
    ///
    /// # Panics
    /// Where the points are not two-dimensional.
    pub fn of(points: &Points, reach: u32) -> Self {
        assert_eq!(points.dimension(), 2, "spectra are of sets in the plane");
        let width = reach as usize + 1;
        let all: Vec<&[f64]> = points.iter().collect();
        let mut rows = vec![vec![[0.0_f64; 4]; width]; width];
        for block in all.chunks(BLOCK) {
            let waves = |axis: usize| -> Vec<Vec<(f64, f64)>> {
                let of_point = |p: &&[f64]| (0..=reach as i32).map(|nu| on_circle(turn(nu, p[axis]))).collect();
                block.par_iter().map(of_point).collect()
            };
            let (along_x, along_y) = (waves(0), waves(1));
            // cos cos, sin sin, cos sin, sin cos: (ν₁, ν₂) and (ν₁, −ν₂) are sums and differences of these.
            rows.par_iter_mut().enumerate().for_each(|(nu1, row)| {
                for (x, y) in along_x.iter().zip(&along_y) {
                    let (cx, sx) = x[nu1];
                    for (sums, (cy, sy)) in row.iter_mut().zip(y) {
                        sums[0] += cx * cy;
                        sums[1] += sx * sy;
                        sums[2] += cx * sy;
                        sums[3] += sx * cy;
                    }
                }
            });
        }
        let n = points.n() as f64;
        let power = |[cc, ss, cs, sc]: [f64; 4], sign: f64| {
            let (real, imaginary) = (cc - sign * ss, sc + sign * cs);
            (real * real + imaginary * imaginary) / n
        };
        let of_row = |row: Vec<[f64; 4]>| {
            let negative: Vec<f64> = row.iter().skip(1).rev().map(|sums| power(*sums, -1.0)).collect();
            negative.into_iter().chain(row.into_iter().map(move |sums| power(sums, 1.0)))
        };
        Self { reach, sets: 1, power: rows.into_iter().flat_map(of_row).collect() }
    }

    /// Mean of spectra of equal reach, each weighing as many sets as it is of; `None` for none or unequal ones.
    pub fn mean(spectra: &[Self]) -> Option<Self> {
        let first = spectra.first()?;
        if spectra.iter().any(|s| s.reach != first.reach) {
            return None;
        }
        let sets: u32 = spectra.iter().map(|s| s.sets).sum();
        let mean = |i: usize| spectra.iter().map(|s| f64::from(s.sets) * s.power[i]).sum::<f64>() / f64::from(sets);
        Some(Self { reach: first.reach, sets, power: (0..first.power.len()).map(mean).collect() })
    }

    /// |ν_k| is at most this.
    pub fn reach(&self) -> u32 {
        self.reach
    }

    /// How many sets the mean is over.
    pub fn sets(&self) -> u32 {
        self.sets
    }

    /// P(ν); `None` outside the reach.
    pub fn at(&self, [nu1, nu2]: [i32; 2]) -> Option<f64> {
        let [row, column] = if nu1 < 0 { [-nu1, -nu2] } else { [nu1, nu2] }.map(i64::from);
        let reach = i64::from(self.reach);
        (row <= reach && column.abs() <= reach).then(|| self.power[(row * (2 * reach + 1) + column + reach) as usize])
    }

    /// One of each pair ±ν, without 0: ν₁ > 0, or ν₁ = 0 and ν₂ > 0.
    pub fn half_plane(&self) -> impl Iterator<Item = ([i32; 2], f64)> + '_ {
        let reach = self.reach as i32;
        let frequencies = (0..=reach).flat_map(move |nu1| (-reach..=reach).map(move |nu2| [nu1, nu2]));
        frequencies.zip(self.power.iter().copied()).filter(|([nu1, nu2], _)| *nu1 > 0 || *nu2 > 0)
    }

    /// Two-sided p-value of a power if points were independent: K P is Gamma(K, 1) distributed.
    pub fn p_value(&self, power: f64) -> f64 {
        let sets = f64::from(self.sets);
        let upper = incomplete_gamma_upper(sets, sets * power);
        (2.0 * upper.min(1.0 - upper)).min(1.0)
    }

    /// The frequency of largest power; the first of equal ones.
    pub fn peak(&self) -> Option<Peak> {
        let (frequency, power) = self.half_plane().reduce(|a, b| if b.1 > a.1 { b } else { a })?;
        let sets = f64::from(self.sets);
        let single = incomplete_gamma_upper(sets, sets * power);
        // Šidák over all frequencies, exact for small p.
        let p_value = -libm::expm1(self.half_plane().count() as f64 * libm::log1p(-single));
        Some(Peak { frequency, power, p_value })
    }

    /// Mean power by rings of width 1 about the radii from 1 to the reach, with intervals at `confidence`; `n` is the number
    /// of points, for the relative radius.
    pub fn radial(&self, n: usize, confidence: f64) -> Vec<Ring> {
        let mut rings: Vec<Vec<f64>> = vec![Vec::new(); self.reach as usize + 1];
        for ([nu1, nu2], power) in self.half_plane() {
            let squared = i64::from(nu1) * i64::from(nu1) + i64::from(nu2) * i64::from(nu2);
            let radius = (squared as f64).sqrt().round() as usize;
            if let Some(ring) = rings.get_mut(radius) {
                ring.push(power);
            }
        }
        rings.iter().zip(0..).skip(1).map(|(powers, radius)| self.ring(powers, radius, n, confidence)).collect()
    }

    fn ring(&self, powers: &[f64], radius: u32, n: usize, confidence: f64) -> Ring {
        let count = powers.len() as f64;
        let mean = powers.iter().sum::<f64>() / count;
        let squares: f64 = powers.iter().map(|p| (p - mean) * (p - mean)).sum();
        let shape = f64::from(self.sets) * count;
        let tail = 0.5 * (1.0 - confidence);
        Ring {
            radius,
            relative_radius: f64::from(radius) / (n as f64).sqrt(),
            frequencies: powers.len() as u32,
            mean,
            interval: [tail, 1.0 - tail].map(|p| mean * shape / gamma_upper_quantile(shape, p)),
            anisotropy_db: (powers.len() > 1 && squares > 0.0)
                .then(|| 10.0 * libm::log10(squares / (count - 1.0) / (mean * mean))),
        }
    }
}

/// The x with P(X > x) = `p` for X Gamma(shape, 1) distributed.
fn gamma_upper_quantile(shape: f64, p: f64) -> f64 {
    // Far beyond any quantile asked for: the tail at mean + 40 standard deviations + 800 is below 1e-300.
    solve_falling(|x| incomplete_gamma_upper(shape, x), p, 0.0, shape + 40.0 * shape.sqrt() + 800.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::{Pcg64, rand_core::Rng};

    fn uniform(seed: u128, n: usize, dimension: usize) -> Points {
        let mut rng = Pcg64::new(seed, 1);
        let flat = (0..n * dimension).map(|_| (rng.next_u64() >> 11) as f64 * 0.5_f64.powi(53)).collect();
        Points::new(dimension, flat).expect("valid")
    }

    fn hammersley(n: u32) -> Points {
        let y = |i: u32| f64::from(i.reverse_bits()) / 4_294_967_296.0;
        Points::new_2d(&(0..n).map(|i| [f64::from(i) / f64::from(n), y(i)]).collect::<Vec<_>>()).expect("valid")
    }

    /// Two ways to the same numbers: frequency by frequency in twice the digits, and all at once by products.
    #[test]
    fn the_whole_spectrum_is_that_of_single_frequencies() {
        for points in [uniform(3, 300, 2), hammersley(256), Points::new_2d(&[[0.3, 1.0]]).expect("valid")] {
            let spectrum = Spectrum::of(&points, 9);
            for nu1 in -9..=9 {
                for nu2 in -9..=9 {
                    let (fast, slow) = (spectrum.at([nu1, nu2]).expect("in reach"), power_at(&points, &[nu1, nu2]));
                    assert!((fast - slow).abs() <= 1e-13 * points.n() as f64, "{nu1} {nu2}: {fast} {slow}");
                }
            }
            assert_eq!(spectrum.at([10, 0]), None);
            assert_eq!(spectrum.half_plane().count(), (19 * 19 - 1) / 2);
        }
    }

    #[test]
    fn a_lattice_has_power_n_on_its_dual_and_none_elsewhere() {
        // Rank 1: (i/n, g i/n mod 1): P = n where ν₁ + g ν₂ is a multiple of n.
        let (n, g) = (55_u32, 34_u32);
        let set: Vec<[f64; 2]> = (0..n).map(|i| [i, g * i % n].map(|k| f64::from(k) / f64::from(n))).collect();
        let spectrum = Spectrum::of(&Points::new_2d(&set).expect("valid"), 40);
        for (nu, power) in spectrum.half_plane() {
            let dual = (nu[0] + g as i32 * nu[1]).rem_euclid(n as i32) == 0;
            // Coordinates are rounded: phases of up to 80 turns are off by 1e-14.
            assert!((power - if dual { f64::from(n) } else { 0.0 }).abs() < 1e-11, "{nu:?}: {power}");
        }
        assert_eq!(spectrum.peak().map(|p| (p.power.round(), p.p_value < 1e-15)), Some((55.0, true)));
    }

    /// Parseval on the lattice of coordinates: Σ over n × n frequencies of P is n² for n points with distinct places.
    #[test]
    fn powers_of_a_lattice_set_add_up() {
        let n = 64_i32;
        let spectrum = Spectrum::of(&hammersley(64), 64);
        let sum: f64 = (0..n).flat_map(|a| (0..n).map(move |b| [a, b])).map(|nu| spectrum.at(nu).expect("in")).sum();
        assert!((sum - f64::from(n * n)).abs() < 1e-9, "{sum}");
    }

    #[test]
    fn a_toroidal_shift_changes_nothing() {
        let points = uniform(8, 200, 2);
        let moved = points.iter().flat_map(|p| [(p[0] + 0.37).fract(), (p[1] + 0.81).fract()]).collect();
        let (a, b) = (Spectrum::of(&points, 12), Spectrum::of(&Points::new(2, moved).expect("valid"), 12));
        for ((nu, before), (_, after)) in a.half_plane().zip(b.half_plane()) {
            assert!((before - after).abs() < 1e-11, "{nu:?}: {before} {after}");
        }
    }

    /// Mean and variance of K P for independent points are K; the p-values of 312 frequencies are uniform; each within six
    /// standard errors of it.
    #[test]
    fn independent_points_have_a_flat_spectrum() {
        let sets = 16;
        let spectra: Vec<Spectrum> = (0..sets).map(|k| Spectrum::of(&uniform(100 + k, 400, 2), 12)).collect();
        let mean = Spectrum::mean(&spectra).expect("equal reach");
        let powers: Vec<f64> = mean.half_plane().map(|(_, p)| p).collect();
        let count = powers.len() as f64;
        let average = powers.iter().sum::<f64>() / count;
        assert!((average - 1.0).abs() < 6.0 / (count * sets as f64).sqrt(), "{average}");
        let p_mean = powers.iter().map(|p| mean.p_value(*p)).sum::<f64>() / count;
        assert!((p_mean - 0.5).abs() < 6.0 / (12.0 * count).sqrt(), "{p_mean}");
        let rings = mean.radial(400, 1.0 - 1e-9);
        assert!(rings.iter().all(|r| r.interval[0] < 1.0 && 1.0 < r.interval[1]), "{rings:?}");
        let outer = rings.last().and_then(|r| r.anisotropy_db).expect("many frequencies");
        assert!((outer + 10.0 * f64::log10(16.0)).abs() < 6.0, "{outer} dB");
        assert_eq!(rings.iter().map(|r| r.radius).collect::<Vec<_>>(), (1..=12).collect::<Vec<_>>());
        assert!((rings[4].relative_radius - 0.25).abs() < 1e-15);
        assert!(Spectrum::mean(&[]).is_none() && Spectrum::mean(&[Spectrum::of(&uniform(1, 3, 2), 2), mean]).is_none());
    }

    #[test]
    fn the_bits_do_not_depend_on_the_number_of_threads() {
        let points = uniform(5, 700, 2);
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| Spectrum::of(&points, 20))
        };
        assert!(with(1) == with(2) && with(1) == with(7));
    }

    #[test]
    fn quantiles_of_the_gamma_distribution_invert_its_tail() {
        // Shape 1 is the exponential distribution.
        assert!((gamma_upper_quantile(1.0, 0.05) - 20.0_f64.ln()).abs() < 1e-13);
        for shape in [1.0, 7.0, 300.0, 1e5] {
            for p in [1e-9, 0.025, 0.5, 0.999] {
                let tail = incomplete_gamma_upper(shape, gamma_upper_quantile(shape, p));
                assert!((tail / p - 1.0).abs() < 1e-9, "{shape} {p}: {tail}");
            }
        }
    }
}

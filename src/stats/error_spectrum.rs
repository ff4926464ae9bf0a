//! How the errors of neighbouring pixels go together: the power of the error image by frequency.
//!
//! d = T − R over W × H pixels has at frequency f (cycles per pixel, i/W and j/H) the power P(f) = |F(f)|²/(WH), F its discrete Fourier
//! transform, averaged over the channels. Errors that are independent from pixel to pixel have the same power everywhere on average, the mean square error
//! (*white*); a hump at low frequencies is blotches, seen where pixels share a set; little there and much at high ones is *blue*
//! noise, which the eye forgives; spikes are aliasing. Celarek et al. (2019), doi:10.1145/3306346.3323004, look at the ensemble of such
//! spectra; Heitz & Belcour (2019) and Georgiev & Fajardo (2016) at blue-noise errors.
//!
//! With two references P(f) = Re F₁(f) F₂*(f)/(WH) of d₁ = T − R₁ and d₂ = T − R₂: as with
//! [`mse_unbiased`](super::image_error::mse_unbiased) their noise adds nothing on average, and a power may come out below 0. Parseval: the mean
//! of P over all W·H frequencies is mean d₁ d₂.
//!
//! The mean error (frequency 0) is kept: an error that all pixels share is the extreme case of going together.

use serde::{Deserialize, Serialize};

use super::fourier::{Complex, transform_2d};
use super::hypothesis::two_sided;
use super::moments::{Estimate, Moments, round_6, sum, t_interval};

/// Frequencies below this many cycles per pixel count as low: periods of more than 8 pixels.
pub const LOW_FREQUENCY: f64 = 0.125;

/// Width of a ring in cycles per pixel: 16 rings along an axis, 23 to the corner.
pub const RING: f64 = 1.0 / 32.0;

/// The share of replicates below the lower and above the upper end of a ring's band.
pub const BAND: f64 = 0.1;

/// Standard deviations of the blurs, pixels.
pub const BLURS: [f64; 2] = [1.0, 2.0];

/// Power by frequency of one error image.
pub struct Power {
    width: usize,
    /// At `j · width + i`, squared radiance.
    power: Vec<f64>,
}

impl Power {
    /// Of test image `t` against two references; one that is exact is given twice.
    ///
    /// # Panics
    /// Where sizes differ.
    pub fn of<P: Copy + Into<f64>>(t: &[[P; 3]], r1: &[[P; 3]], r2: &[[P; 3]], width: usize) -> Self {
        assert!(t.len() == r1.len() && t.len() == r2.len(), "images differ in size");
        let (height, n) = (t.len() / width, t.len() as f64);
        let mut power = vec![0.0; t.len()];
        for c in 0..3 {
            // Both differences in one transform Z = F₁ + iF₂: as they are real, Re F₁F₂* = Im Z(f)Z(−f) / 2.
            let both = |p: usize| -> Complex { [t[p][c].into() - r1[p][c].into(), t[p][c].into() - r2[p][c].into()] };
            let z = transform_2d(&(0..t.len()).map(both).collect::<Vec<_>>(), width);
            for (at, power) in power.iter_mut().enumerate() {
                let (i, j) = (at % width, at / width);
                let (a, b) = (z[at], z[(height - j) % height * width + (width - i) % width]);
                *power += (a[0] * b[1] + a[1] * b[0]) / 2.0 / n / 3.0;
            }
        }
        Self { width, power }
    }

    /// Mean over all frequencies: mean d₁ d₂.
    pub fn mse(&self) -> f64 {
        sum(self.power.iter().copied()) / self.power.len() as f64
    }

    /// Power in each ring, mean over its frequencies.
    fn rings(&self, rings: &Rings) -> Vec<f64> {
        let mut sums = vec![0.0; rings.frequency.len()];
        for (&ring, power) in rings.ring_of.iter().zip(&self.power) {
            sums[ring] += power;
        }
        sums.iter().zip(&rings.frequencies).map(|(sum, &n)| sum / f64::from(n)).collect()
    }

    /// Share of the power at low frequencies; `None` where the mean power is not above 0.
    fn low_share(&self) -> Option<f64> {
        let height = self.power.len() / self.width;
        let is_low = |at: usize| frequency(at, self.width, height) < LOW_FREQUENCY;
        let low = sum((0..self.power.len()).filter(|&at| is_low(at)).map(|at| self.power[at]));
        let all = sum(self.power.iter().copied());
        (all > 0.0).then(|| low / all)
    }

    /// Mean square error after a toroidal Gaussian blur, in units of what it would be for white noise of the same mean square
    /// error (the sum of the kernel's squared weights); `None` where that is not above 0.
    fn blurred(&self, deviation: f64) -> Option<f64> {
        let (width, height) = (self.width, self.power.len() / self.width);
        let [x, y] = [width, height].map(|n| blur_power(n, deviation));
        let weight = |at: usize| x[at % width] * y[at / width];
        let kept = sum((0..self.power.len()).map(|at| weight(at) * self.power[at]));
        let white = self.mse() * sum((0..self.power.len()).map(weight));
        (white > 0.0).then(|| kept / white)
    }
}

/// Distance of a frequency from 0, cycles per pixel, each axis by its shorter way round.
fn frequency(at: usize, width: usize, height: usize) -> f64 {
    let along = |i: usize, n: usize| i.min(n - i) as f64 / n as f64;
    let (x, y) = (along(at % width, width), along(at / width, height));
    (x * x + y * y).sqrt()
}

/// |K|² at each frequency of a Gaussian kernel of sum 1 that is wrapped around `n` pixels.
fn blur_power(n: usize, deviation: f64) -> Vec<f64> {
    let mut kernel = vec![[0.0; 2]; n];
    let reach = (8.0 * deviation).ceil() as i64;
    for i in -reach..=reach {
        let z = i as f64 / deviation;
        kernel[i.rem_euclid(n as i64) as usize][0] += libm::exp(-z * z / 2.0);
    }
    let total = sum(kernel.iter().map(|k| k[0]));
    let square = |k: Complex| (k[0] * k[0] + k[1] * k[1]) / (total * total);
    transform_2d(&kernel, n).into_iter().map(square).collect()
}

/// Which ring each frequency is in; rings without any are left out.
struct Rings {
    ring_of: Vec<usize>,
    /// Mean distance from 0.
    frequency: Vec<f64>,
    /// How many.
    frequencies: Vec<u32>,
}

impl Rings {
    fn new(width: usize, height: usize) -> Self {
        let number = |at: usize| (frequency(at, width, height) / RING) as usize;
        let mut numbers: Vec<usize> = (0..width * height).map(number).collect();
        let mut present = numbers.clone();
        present.sort_unstable();
        present.dedup();
        let (mut sums, mut frequencies) = (vec![0.0; present.len()], vec![0; present.len()]);
        for (at, number) in numbers.iter_mut().enumerate() {
            *number = present.binary_search(number).expect("it is one of them");
            sums[*number] += frequency(at, width, height);
            frequencies[*number] += 1;
        }
        let frequency = sums.iter().zip(&frequencies).map(|(sum, &n)| sum / f64::from(n)).collect();
        Self { ring_of: numbers, frequency, frequencies }
    }
}

/// Error spectra of the replicates of one estimator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ErrorSpectrum {
    /// Mean frequency of each ring, cycles per pixel.
    pub frequency: Vec<f64>,
    /// Mean power in each ring over the replicates, squared radiance; the mean square error everywhere for white noise.
    pub power: Vec<f64>,
    /// The tenth of replicates with the least power in a ring is below; absent for one replicate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub low: Option<Vec<f64>>,
    /// The tenth with the most is above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub high: Option<Vec<f64>>,
    /// Share of the power below [`LOW_FREQUENCY`]; absent where a replicate's mean power is not above 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub low_share: Option<Estimate>,
    /// What it is on average for errors of independent random signs: the share of the frequencies, exactly.
    pub white_low_share: f64,
    /// Two-sided p-value of Student's test of `low_share` against that, over replicates; absent for fewer than two, or of no spread.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_white: Option<f64>,
    /// Mean square error after a Gaussian blur of σ = 1 pixel relative to white noise of the same mean square error: 1 for white, less for
    /// blue noise, more where neighbours err alike.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blur_1: Option<Estimate>,
    /// The same for σ = 2 pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blur_2: Option<Estimate>,
}

/// Spectra of independent replicates, together; numbers rounded to 6 significant digits, as they are written.
///
/// The share's mean for white noise is exact whenever the errors of different pixels have independent signs, each as likely as the other, however large they are: then
/// E[d_p d_q / Σd²] = 0 for p ≠ q, so every frequency has the same expected share of the power. A common pattern in all
/// replicates (bias) is as unlike white noise as pixels that share their numbers are, and shows all the same.
///
/// # Panics
/// Where there is no replicate, or sizes differ.
pub fn error_spectrum(replicates: &[Power]) -> ErrorSpectrum {
    let first = replicates.first().expect("spectra need a replicate");
    let (width, n) = (first.width, first.power.len());
    assert!(replicates.iter().all(|p| p.width == width && p.power.len() == n), "images differ in size");
    let rings = Rings::new(width, n / width);
    let powers: Vec<Vec<f64>> = replicates.iter().map(|power| power.rings(&rings)).collect();
    let over_replicates = |f: &dyn Fn(&[f64]) -> f64| -> Vec<f64> {
        let ring = |ring: usize| f(&powers.iter().map(|p| p[ring]).collect::<Vec<f64>>());
        (0..rings.frequency.len()).map(|r| round_6(ring(r))).collect()
    };
    let estimate = |f: &dyn Fn(&Power) -> Option<f64>| -> Option<(Vec<f64>, Estimate)> {
        let values: Vec<f64> = replicates.iter().map(f).collect::<Option<_>>()?;
        let found = t_interval(&values, 0.95).with_rounded_interval();
        Some((values, Estimate { value: round_6(found.value), ..found }))
    };
    let has_band = replicates.len() > 1;
    let band = |at: f64| has_band.then(|| over_replicates(&|values| quantile(values, at)));
    let low = (0..n).filter(|&at| frequency(at, width, n / width) < LOW_FREQUENCY).count();
    let white_low_share = low as f64 / n as f64;
    let share = estimate(&Power::low_share);
    let p_white = share.as_ref().and_then(|(values, _)| p_of_mean(values, white_low_share)).map(round_6);
    let blur = |deviation: f64| estimate(&|power: &Power| power.blurred(deviation)).map(|(_, estimate)| estimate);
    ErrorSpectrum {
        frequency: rings.frequency.iter().map(|&f| round_6(f)).collect(),
        power: over_replicates(&|values| sum(values.iter().copied()) / values.len() as f64),
        low: band(BAND),
        high: band(1.0 - BAND),
        low_share: share.map(|(_, estimate)| estimate),
        white_low_share,
        p_white,
        blur_1: blur(BLURS[0]),
        blur_2: blur(BLURS[1]),
    }
}

/// Two-sided p-value of the mean of `values` against `expected`; `None` for fewer than two, or of no spread.
fn p_of_mean(values: &[f64], expected: f64) -> Option<f64> {
    let moments: Moments = values.iter().copied().collect();
    let error = moments.standard_error().filter(|&error| error > 0.0)?;
    Some(two_sided((moments.mean()? - expected) / error, values.len() as f64 - 1.0))
}

/// Between the two nearest values in order, by their distances.
fn quantile(values: &[f64], at: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let place = at * (sorted.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

/// Statistical tests at fixed seeds: 1e−8 false alarms each where one is named, 3e−8 together.
#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::hypothesis::{Family, t_test};
    use crate::stats::image_error::{mse, mse_unbiased};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::Rng;

    /// Of each of the tests below. False alarms: 7e-8.
    const FAMILY: Family = Family { tests: 1, false_alarm: 1e-8 };

    fn uniform(random: &mut Pcg64) -> f64 {
        (random.next_u64() >> 11) as f64 * 0.5f64.powi(53) - 0.5
    }

    fn noise(random: &mut Pcg64, n: usize) -> Vec<[f64; 3]> {
        (0..n).map(|_| [0; 3].map(|_| uniform(random))).collect()
    }

    #[test]
    fn power_is_the_sum_of_its_definition_and_its_mean_the_mean_square_error() {
        let mut random = Pcg64::new(1, 1);
        for (width, height) in [(8, 6), (5, 7), (1, 4), (9, 1)] {
            let [t, r1, r2] = [0; 3].map(|_| noise(&mut random, width * height));
            let power = Power::of(&t, &r1, &r2, width);
            let expected = mse_unbiased(t.as_flattened(), r1.as_flattened(), r2.as_flattened());
            assert!((power.mse() - expected).abs() < 1e-15, "Parseval: {} {expected}", power.mse());
            for at in 0..width * height {
                let transformed = |r: &[[f64; 3]], c: usize| -> Complex {
                    (0..t.len()).fold([0.0; 2], |s, p| {
                        let turns = (p % width * (at % width)) as f64 / width as f64
                            + (p / width * (at / width)) as f64 / height as f64;
                        let (angle, d) = (-std::f64::consts::TAU * turns, t[p][c] - r[p][c]);
                        [s[0] + d * libm::cos(angle), s[1] + d * libm::sin(angle)]
                    })
                };
                let one = |c: usize| {
                    let (a, b) = (transformed(&r1, c), transformed(&r2, c));
                    (a[0] * b[0] + a[1] * b[1]) / t.len() as f64
                };
                let expected = (0..3).map(one).sum::<f64>() / 3.0;
                assert!((power.power[at] - expected).abs() < 1e-13, "{width}×{height}, {at}");
            }
            let rings = Rings::new(width, height);
            let total: f64 = power.rings(&rings).iter().zip(&rings.frequencies).map(|(p, &n)| p * f64::from(n)).sum();
            assert!((total / t.len() as f64 - expected).abs() < 1e-15);
        }
    }

    /// The blurred image itself, pixel by pixel.
    #[test]
    fn a_blurred_error_is_the_mean_square_of_the_blurred_image() {
        let (width, height) = (12, 9);
        let d = noise(&mut Pcg64::new(2, 1), width * height);
        let zero = vec![[0.0; 3]; width * height];
        let power = Power::of(&d, &zero, &zero, width);
        for deviation in BLURS {
            let kernel = |n: usize, at: i64| -> f64 {
                let images = |k: i64| libm::exp(-((at + k * n as i64) as f64 / deviation).powi(2) / 2.0);
                (-3..=3).map(images).sum()
            };
            let total = |n: usize| (0..n as i64).map(|i| kernel(n, i)).sum::<f64>();
            let weight = |p: usize, q: usize| {
                let apart = |p: usize, q: usize| p as i64 - q as i64;
                kernel(width, apart(p % width, q % width)) * kernel(height, apart(p / width, q / width))
                    / (total(width) * total(height))
            };
            let blurred = |p: usize, c: usize| (0..d.len()).map(|q| weight(p, q) * d[q][c]).sum::<f64>();
            let squares = (0..d.len()).flat_map(|p| (0..3).map(move |c| (p, c))).map(|(p, c)| blurred(p, c).powi(2));
            let white =
                mse(d.as_flattened(), zero.as_flattened()) * (0..d.len()).map(|q| weight(0, q).powi(2)).sum::<f64>();
            let expected = squares.sum::<f64>() / (3 * d.len()) as f64 / white;
            let found = power.blurred(deviation).unwrap();
            assert!((found - expected).abs() < 1e-12 * expected, "{deviation}: {found} {expected}");
        }
    }

    /// White: sizes that differ from pixel to pixel, signs that do not know each other. 400 replicates of 24 × 20 pixels.
    #[test]
    fn independent_signs_have_the_exact_share_of_white_noise_and_a_shared_error_has_not() {
        let (width, n) = (24, 24 * 20);
        let zero = vec![[0.0; 3]; n];
        let mut random = Pcg64::new(3, 1);
        let powers: Vec<Power> = (0..400)
            .map(|_| {
                let size = |p: usize| if p.is_multiple_of(7) { 20.0 } else { (p % 5) as f64 };
                let d: Vec<[f64; 3]> = (0..n).map(|p| [uniform(&mut random).signum() * size(p); 3]).collect();
                Power::of(&d, &zero, &zero, width)
            })
            .collect();
        let found = error_spectrum(&powers);
        let shares: Vec<f64> = powers.iter().map(|p| p.low_share().unwrap()).collect();
        let verdict = t_test(&shares, found.white_low_share, FAMILY);
        assert!(verdict.holds(), "{verdict}");
        for deviation in BLURS {
            let scores: Vec<f64> = powers.iter().map(|p| p.blurred(deviation).unwrap()).collect();
            let verdict = t_test(&scores, 1.0, FAMILY);
            assert!(verdict.holds(), "σ = {deviation}: {verdict}");
        }
        assert!(found.p_white.unwrap() > 1e-6);
        // Half of the variance shared by all pixels of an image: half of the power is at frequency 0.
        let shared: Vec<Power> = (0..8)
            .map(|_| {
                let common = uniform(&mut random);
                let d: Vec<[f64; 3]> = (0..n).map(|_| [uniform(&mut random) + common; 3]).collect();
                Power::of(&d, &zero, &zero, width)
            })
            .collect();
        let shared = error_spectrum(&shared);
        assert!(shared.low_share.unwrap().value > 0.2 && shared.blur_2.unwrap().value > 5.0, "{shared:?}");
    }

    #[test]
    fn a_checkerboard_of_errors_is_blue_and_one_replicate_has_no_interval() {
        let (width, n) = (16, 16 * 12);
        let d: Vec<[f64; 3]> = (0..n).map(|p| [if (p % width + p / width) % 2 == 0 { 0.5 } else { -0.5 }; 3]).collect();
        let zero = vec![[0.0; 3]; n];
        let found = error_spectrum(&[Power::of(&d, &zero, &zero, width)]);
        let share = found.low_share.unwrap();
        assert!(share.value.abs() < 1e-12 && share.ci95.is_none() && found.p_white.is_none() && found.low.is_none());
        assert!(found.blur_1.unwrap().value < 1e-3);
        // All of it is in the corner, the last ring.
        let (last, others) = found.power.split_last().unwrap();
        assert!(*last > 0.25 && others.iter().all(|p| p.abs() < 1e-12), "{found:?}");
        let exact = error_spectrum(&[Power::of(&d, &d, &d, width)]);
        assert!(exact.low_share.is_none() && exact.blur_1.is_none(), "no error has no share");
    }

    #[test]
    fn quantiles_lie_between_neighbours() {
        let values = [3.0, 1.0, 2.0, 5.0];
        assert_eq!([0.0, 0.5, 1.0].map(|at| quantile(&values, at)), [1.0, 2.5, 5.0]);
        assert!((quantile(&values, 0.1) - 1.3).abs() < 1e-15);
        assert_eq!(quantile(&[7.0], 0.9), 7.0);
    }
}

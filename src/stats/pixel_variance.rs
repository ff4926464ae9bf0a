//! The variance of a pixel, predicted from the spectrum of the point set and that of what the pixel sees.
//!
//! A set of n points x_j that is shifted as a whole, uniformly on the torus, estimates ∫f with
//! Var = (1/n) Σ_{ν ≠ 0} P(ν) |f_ν|², P(ν) = |Σ_j e^(−2πi ν·x_j)|²/n, f_ν = ∫ f(x) e^(−2πi ν·x) dx (Durand 2011; Pilleboue et al. 2015,
//! doi:10.1145/2766930). It is exact for such *stationary* sets, and for independent uniform points with P = 1. For others, whose points
//! keep a place on the torus (jitter, Owen's scramble), the same sum with the mean of P over sets is an approximation: it knows the
//! power of each frequency and not how two of them go together.
//!
//! Here f is known at the centres of a grid of [`GRID`]² cells. Frequencies up to [`CUT`] along each axis are summed; all power beyond is taken
//! with P = 1, which is what P is on average over high frequencies for any set of distinct points, and is stated as `rest`.

use super::fourier::transform_2d;
use super::moments::sum;

/// Cells of a pixel along an axis.
pub const GRID: usize = 512;

/// Largest |ν| along an axis that is summed: a quarter of the grid's, where what the grid adds of higher ones is small.
pub const CUT: usize = GRID / 4;

/// What one pixel sees.
#[derive(Debug, Clone, PartialEq)]
pub struct Integrand {
    /// ∫ f.
    pub mean: f64,
    /// ∫ f² − (∫ f)²: the variance of one uniform sample.
    pub variance: f64,
    /// |f_ν|² of the frequencies of [`half_plane`].
    power: Vec<f64>,
}

/// Frequencies of which each stands for itself and its opposite: all but 0 up to `cut` along each axis.
fn half_plane(cut: usize) -> impl Iterator<Item = (i64, i64)> {
    let cut = cut as i64;
    (0..=cut).flat_map(move |y| (-cut..=cut).map(move |x| (x, y))).filter(|&(x, y)| y > 0 || x > 0)
}

impl Integrand {
    /// From values at the centres of [`GRID`]² cells, `values[j · GRID + i]` at ((i + ½)/GRID, (j + ½)/GRID).
    ///
    /// # Panics
    /// Where there are not that many.
    pub fn of_grid(values: &[f64]) -> Self {
        assert_eq!(values.len(), GRID * GRID, "a grid of another size");
        let n = values.len() as f64;
        let mean = sum(values.iter().copied()) / n;
        let variance = sum(values.iter().map(|v| (v - mean) * (v - mean))) / n;
        let centred: Vec<[f64; 2]> = values.iter().map(|v| [v - mean, 0.0]).collect();
        let f = transform_2d(&centred, GRID);
        let power = |(x, y): (i64, i64)| {
            let at = y as usize * GRID + x.rem_euclid(GRID as i64) as usize;
            (f[at][0] * f[at][0] + f[at][1] * f[at][1]) / (n * n)
        };
        Self { mean, variance, power: half_plane(CUT).map(power).collect() }
    }

    /// Variance of the mean of n points of this spectrum; `None` stands for independent uniform points.
    pub fn predicted(&self, spectrum: Option<&SetSpectrum>, n: u32) -> Predicted {
        let n = f64::from(n);
        let Some(spectrum) = spectrum else { return Predicted { variance: self.variance / n, rest: 0.0 } };
        let known = 2.0 * sum(self.power.iter().copied());
        let kept = 2.0 * sum(self.power.iter().zip(&spectrum.power).map(|(f, p)| f * p));
        // What the grid folds down may leave less than nothing by rounding.
        let rest = (self.variance - known).max(0.0) / n;
        Predicted { variance: kept / n + rest, rest }
    }
}

/// A predicted variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Predicted {
    /// The variance.
    pub variance: f64,
    /// The part of it that stands for frequencies beyond [`CUT`]: an estimate of the truncation error, as P = 1 on average there.
    pub rest: f64,
}

/// P(ν) of a point set, or its mean over several, at the frequencies up to [`CUT`].
#[derive(Debug, Clone, PartialEq)]
pub struct SetSpectrum {
    power: Vec<f64>,
}

impl SetSpectrum {
    /// Mean over `sets` of points in [0, 1)², by the direct sum.
    ///
    /// # Panics
    /// Where there is no set, or one without points.
    pub fn of(sets: &[Vec<[f64; 2]>]) -> Self {
        assert!(!sets.is_empty() && sets.iter().all(|set| !set.is_empty()), "a spectrum needs points");
        let mut power = vec![0.0; half_plane(CUT).count()];
        for set in sets {
            for (mean, p) in power.iter_mut().zip(one_set(set)) {
                *mean += p / sets.len() as f64;
            }
        }
        Self { power }
    }

    /// The largest difference of P from another spectrum: 0 but for rounding for two shifts of one set.
    pub fn largest_difference(&self, other: &Self) -> f64 {
        self.power.iter().zip(&other.power).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }
}

/// P(ν) of one set.
fn one_set(points: &[[f64; 2]]) -> Vec<f64> {
    let cut = CUT as i64;
    let wave = |nu: i64, x: f64| {
        // Whole turns are taken off first: the angle keeps its digits.
        let turns = nu as f64 * x;
        let angle = -std::f64::consts::TAU * (turns - turns.floor());
        [libm::cos(angle), libm::sin(angle)]
    };
    let columns = 2 * CUT + 1;
    let along_x: Vec<[f64; 2]> = points.iter().flat_map(|p| (-cut..=cut).map(move |nu| wave(nu, p[0]))).collect();
    let mut power = Vec::new();
    for y in 0..=cut {
        let mut row = vec![[0.0; 2]; columns];
        for (point, waves) in points.iter().zip(along_x.chunks_exact(columns)) {
            let [c, s] = wave(y, point[1]);
            for (sum, [a, b]) in row.iter_mut().zip(waves) {
                *sum = [sum[0] + a * c - b * s, sum[1] + a * s + b * c];
            }
        }
        let first = if y == 0 { CUT + 1 } else { 0 };
        power.extend(row[first..].iter().map(|[re, im]| (re * re + im * im) / points.len() as f64));
    }
    power
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(f: impl Fn(f64, f64) -> f64) -> Integrand {
        let centre = |i: usize| (i as f64 + 0.5) / GRID as f64;
        Integrand::of_grid(&(0..GRID * GRID).map(|p| f(centre(p % GRID), centre(p / GRID))).collect::<Vec<_>>())
    }

    /// (i/n, φ₂(i)).
    fn hammersley(n: u32) -> Vec<[f64; 2]> {
        (0..n).map(|i| [f64::from(i) / f64::from(n), f64::from(i.reverse_bits()) / 2f64.powi(32)]).collect()
    }

    #[test]
    fn a_wave_has_its_power_at_its_frequency_alone() {
        let wave = grid(|x, y| libm::cos(std::f64::consts::TAU * (3.0 * x - 5.0 * y)) + 0.25);
        assert!((wave.mean - 0.25).abs() < 1e-14 && (wave.variance - 0.5).abs() < 1e-13);
        for ((x, y), power) in half_plane(CUT).zip(&wave.power) {
            let expected = if (x, y) == (-3, 5) { 0.25 } else { 0.0 };
            assert!((power - expected).abs() < 1e-13, "({x}, {y}): {power}");
        }
        // A lattice of 16 columns sees nothing of it but what it takes for the mean.
        let lattice: Vec<[f64; 2]> = (0..16).map(|i| [f64::from(i) / 16.0, f64::from(5 * i % 16) / 16.0]).collect();
        // At ν = (−3, 5) its i-th point turns by 22 i/16: sixteen such turns add up to nothing.
        let predicted = wave.predicted(Some(&SetSpectrum::of(&[lattice])), 16);
        assert!(predicted.variance.abs() < 1e-12, "{predicted:?}");
    }

    /// f = x under the shifted Hammersley set: i/n shifted has the variance 1/(12 n²); uniform points 1/(12 n).
    #[test]
    fn known_variances_are_predicted_to_the_stated_rest() {
        let ramp = grid(|x, _| x);
        for n in [4, 16, 64] {
            let exact = 1.0 / 12.0 / f64::from(n * n);
            let predicted = ramp.predicted(Some(&SetSpectrum::of(&[hammersley(n)])), n);
            assert!((predicted.variance - exact).abs() < predicted.rest, "{n}: {predicted:?} {exact}");
            assert!(predicted.rest < 0.35 * exact, "{n}: {predicted:?}");
            let uniform = ramp.predicted(None, n).variance * f64::from(n) * 12.0;
            assert!((uniform - 1.0).abs() < 1e-5, "{uniform}");
        }
    }

    #[test]
    fn power_is_the_sum_of_its_definition_and_no_shift_changes_it() {
        let points = hammersley(8);
        let spectrum = SetSpectrum::of(std::slice::from_ref(&points));
        for ((x, y), power) in half_plane(CUT).zip(&spectrum.power).step_by(997) {
            let angle = |p: &[f64; 2]| std::f64::consts::TAU * (x as f64 * p[0] + y as f64 * p[1]);
            let re: f64 = points.iter().map(|p| libm::cos(angle(p))).sum();
            let im: f64 = points.iter().map(|p| libm::sin(angle(p))).sum();
            assert!((power - (re * re + im * im) / 8.0).abs() < 1e-10, "({x}, {y})");
        }
        let shifted = |p: &[f64; 2]| [(p[0] + 0.3).fract(), (p[1] + 0.77).fract()];
        let other = SetSpectrum::of(&[points.iter().map(shifted).collect()]);
        assert!(spectrum.largest_difference(&other) < 1e-9);
    }
}

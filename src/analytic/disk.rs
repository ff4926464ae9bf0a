//! Irradiance from a one-sided diffuse disk that faces a parallel receiver, in closed form.

use std::f64::consts::PI;

use crate::analytic::quadrature::{Tolerance, integrate_rectangle};
use crate::error::Result;

/// A disk that emits the same radiance in all directions of its front side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiskLight {
    /// Radius R > 0 in scene units.
    pub radius: f64,
    /// Emitted radiance k_e ≥ 0.
    pub emission: f64,
}

impl DiskLight {
    /// Irradiance π k_e R² / (R² + h²) straight below the centre, at distance `height` = h, of a receiver that faces
    /// the disk; exactly 0 for h ≤ 0, where the point is not strictly in front.
    pub fn irradiance_on_axis(&self, height: f64) -> f64 {
        if height <= 0.0 {
            return 0.0;
        }
        let ratio = self.radius / libm::hypot(height, self.radius);
        PI * self.emission * ratio * ratio
    }

    /// Irradiance at distance `height` = h from the disk's plane and `offset` = a from its axis, of a receiver whose
    /// normal is opposite to the disk's; exactly 0 for h ≤ 0.
    ///
    /// With q = a² + h² − R² and s = √(q² + 4R²h²): (π/2) k_e (1 − q/s), which cancels for R ≪ h and equals
    /// 2π k_e R² h² / (s (s + q)), which cancels for q < 0: each is used where nothing cancels (Howell C-21
    /// writes q = Z − 2R² and s² = Z² − 4R²a²).
    pub fn irradiance(&self, height: f64, offset: f64) -> f64 {
        if height <= 0.0 {
            return 0.0;
        }
        // In units of the largest length, so that squares of squares stay in range.
        let unit = self.radius.max(height).max(offset.abs());
        let (r, h, a) = (self.radius / unit, height / unit, offset.abs() / unit);
        let q = (a - r) * (a + r) + h * h;
        let s = libm::hypot(q, 2.0 * r * h);
        let form = if q < 0.0 { 0.5 * PI * (1.0 - q / s) } else { 2.0 * PI * (r * h / s) * (r * h / (s + q)) };
        self.emission * form
    }

    /// Variance A² E\[g²\] − E² of *one* uniform-area sample A g, g = k_e cos θ cos θ_l / r², in the setting of
    /// [`Self::irradiance`]: by quadrature in polar coordinates to 10⁻¹⁰ relative and the rounding of a radius beside
    /// h. Near the disk it grows as A π k_e² / (3 h²).
    ///
    /// Errors: the quadrature does not get there (a height within rounding of the disk).
    pub fn variance_of_one_area_sample(&self, height: f64, offset: f64) -> Result<f64> {
        if height <= 0.0 {
            return Ok(0.0);
        }
        let offset = offset.abs();
        let mean = self.irradiance(height, offset);
        let area = PI * self.radius * self.radius;
        // The squared deviation, not E[g²] − E²: the latter cancels for a far disk. Both halves of the disk are alike.
        let deviation = |r: f64, turn: f64| {
            // r² + a² − 2 r a cos(turn) + h², which would cancel below the disk.
            let half_sine = libm::sin(0.5 * turn);
            let square = (r - offset) * (r - offset) + 4.0 * r * offset * half_sine * half_sine + height * height;
            let cosine_over_distance = height / square;
            let sample = area * self.emission * cosine_over_distance * cosine_over_distance;
            2.0 * r * (sample - mean) * (sample - mean)
        };
        // Where a sample equals the mean, rounding alone is left: 10⁻¹⁰ of the mean, squared, counts as nothing.
        let tolerance = Tolerance { absolute: 1e-20 * mean * mean * area, relative: 1e-10 };
        // The peak below the point is `height` wide: panels that grow from there cannot overlook it.
        let widths =
            |from: f64, to: f64| std::iter::successors(Some(from), |w| Some(4.0 * w)).take_while(move |&w| w < to);
        let radii: Vec<f64> =
            widths(height, self.radius).flat_map(|w| [offset - w, offset + w]).chain([offset]).collect();
        let turns = |r: f64, out: &mut Vec<f64>| {
            let around = libm::sqrt(r * offset);
            if around > 0.0 {
                out.extend(widths(libm::hypot(r - offset, height) / around, PI));
            }
        };
        let integral = integrate_rectangle(deviation, [0.0, self.radius], [0.0, PI], &radii, turns, tolerance)?;
        Ok(integral.value / area)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DISK: DiskLight = DiskLight { radius: 0.5, emission: 1.0 };

    #[test]
    fn the_general_form_meets_the_form_on_the_axis() {
        for height in [1e-9, 1e-3, 0.4, 0.5, 0.6, 3.0, 1e4, 1e12] {
            let (general, on_axis) = (DISK.irradiance(height, 0.0), DISK.irradiance_on_axis(height));
            assert!((general / on_axis - 1.0).abs() <= 4e-15, "{height}");
        }
    }

    #[test]
    fn both_forms_agree_where_neither_cancels() {
        for (h, a) in [(0.5f64, 0.1f64), (0.4, 0.4), (0.3, 0.45), (0.5, 0.5), (0.7, 0.3)] {
            let z = a * a + h * h + 0.25;
            let literal = 0.5 * PI * (1.0 - (z - 0.5) / (z * z - a * a).sqrt());
            assert!((DISK.irradiance(h, a) / literal - 1.0).abs() <= 1e-14, "{h} {a}");
        }
    }

    #[test]
    fn far_and_near_limits_hold_at_any_scale() {
        for distance in [1e3, 1e8, 1e100] {
            let (h, a) = (0.8 * distance, 0.6 * distance);
            let limit = PI * 0.25 * 0.64 / distance / distance;
            // The next term in (R / distance)² has a factor of at most 6.
            assert!((DISK.irradiance(h, a) / limit - 1.0).abs() <= 6.0 * (0.5 / distance).powi(2) + 1e-14);
        }
        assert!((DISK.irradiance(1e-10, 0.3) / PI - 1.0).abs() <= 1e-15);
        assert_eq!(
            (DISK.irradiance(0.0, 0.0), DISK.irradiance(-1.0, 0.0), DISK.irradiance_on_axis(0.0)),
            (0.0, 0.0, 0.0)
        );
    }

    #[test]
    fn the_variance_has_its_near_and_far_limits() {
        for (h, a) in [(1e-3, 0.0), (1e-3, 0.2), (1e-5, 0.2), (1e-6, 0.3), (1e-8, 0.2)] {
            let limit = PI * 0.25 * PI / (3.0 * h * h) - PI * PI;
            let found = DISK.variance_of_one_area_sample(h, a).unwrap();
            // A radius near a = 0.2 is known to 3·10⁻¹⁷, beside a peak h wide.
            assert!((found / limit - 1.0).abs() <= 10.0 * h * h + 1e-10 + 3e-17 / h, "{h} {a}: {found:e} {limit:e}");
        }
        // Far on the axis a sample is A (1 − 2r²/h²)/h², and r² is uniform on 0..R²: variance 4 A² R⁴/12 / h⁸.
        for h in [1e2f64, 1e4] {
            let limit = 4.0 * (PI * 0.25).powi(2) * 0.5f64.powi(4) / 12.0 / h.powi(8);
            let found = DISK.variance_of_one_area_sample(h, 0.0).unwrap();
            assert!((found / limit - 1.0).abs() <= 10.0 / (h * h) + 4e-15 * h * h, "{h}: {found:e} {limit:e}");
        }
    }
}

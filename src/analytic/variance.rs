//! Variance of one uniform-area sample of a polygon light, exactly: what a correct sampler's noise must be.

use glam::DVec3;

use crate::analytic::polygon::{Patch, PolygonLight, Receiver};

/// Variance A² E\[(V g)²\] − E² of *one* sample A V g, uniform over the whole light's area A, with
/// g = k_e cos θ cos θ_l / r² and V the visibility past an optional convex planar blocker.
///
/// The mean of n independent samples has this variance over n. Parts behind the blocker, below the receiver's horizon
/// or seen from behind count as samples of 0, as they do for a renderer. It is the mean square of A V g − E, not the
/// difference of two squares, and the visible part is integrated by [the rule of `polygon`](crate::analytic::polygon):
/// relative error about 10⁻¹², also for a far light (variance ≪ E²) and a near one (where it grows as
/// A π k_e² / (3 h²)). Exactly 0 where the point is not strictly in front of the light.
pub fn variance_of_one_area_sample(light: &PolygonLight, at: &Receiver, blocker: Option<&[DVec3]>) -> f64 {
    let Some(patch) = Patch::of(light, at.point) else { return 0.0 };
    let area = light.area();
    let parts = patch.divide(blocker.unwrap_or_default(), at.point);
    let mut dark_area = parts.hidden.map_or(0.0, |part| part.area());
    let mut lit = Vec::new();
    for part in parts.visible {
        let (above, below) = part.split(at.normal, 0.0);
        lit.extend(above);
        dark_area += below.map_or(0.0, |part| part.area());
    }
    let mean: f64 = lit.iter().map(|part| part.form(at.normal)).sum();
    let square_deviation = |part: &Patch| {
        part.integrate(|v| {
            let deviation = area * part.kernel(at.normal, v) - mean;
            deviation * deviation
        })
    };
    let total = lit.iter().map(square_deviation).sum::<f64>() + dark_area * mean * mean;
    light.emission * light.emission * (total / area)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> PolygonLight {
        let corners = [(-0.5, -0.5), (-0.5, 0.5), (0.5, 0.5), (0.5, -0.5)];
        PolygonLight { corners: corners.map(|(x, y)| DVec3::new(x, y, 1.0)).to_vec(), emission: 1.0 }
    }

    fn up(x: f64, y: f64, z: f64) -> Receiver {
        Receiver { point: DVec3::new(x, y, z), normal: DVec3::Z }
    }

    /// x < 0 of the square hidden from the origin.
    fn half_blocker() -> Vec<DVec3> {
        [(0.0, -9.0), (0.0, 9.0), (-9.0, 9.0), (-9.0, -9.0)].map(|(x, y)| DVec3::new(x, y, 0.5)).to_vec()
    }

    #[test]
    fn a_far_light_has_the_variance_of_its_gradient() {
        // Straight below at height h a sample is h²/(h² + ρ²)² ≈ (1 − 2ρ²/h²)/h², with ρ² = x² + y² of variance
        // 2 (1/80 − 1/144) = 1/90 over the unit square.
        for h in [1e2, 1e3, 1e4] {
            let found = variance_of_one_area_sample(&square(), &up(0.0, 0.0, 1.0 - h), None);
            let limit = 4.0 / (90.0 * h.powi(8));
            // Rounding of a sample against the mean, ten units in the last place each, beside deviations of 1/h².
            assert!((found / limit - 1.0).abs() <= 10.0 / (h * h) + 4e-15 * h * h, "{h}: {found:e} {limit:e}");
        }
    }

    #[test]
    fn a_near_light_has_a_variance_that_grows_as_the_height_squared_falls() {
        for h in [1e-3, 1e-6, 1e-9] {
            let found = variance_of_one_area_sample(&square(), &up(0.1, 0.2, 1.0 - h), None);
            let limit = std::f64::consts::PI / (3.0 * h * h);
            assert!((found / limit - 1.0).abs() <= 10.0 * h * h + 1e-7, "{h}: {found:e} {limit:e}");
        }
    }

    #[test]
    fn half_a_light_doubles_the_second_moment_of_each_half() {
        // By symmetry E[(V g)²] is half of E[g²], and the mean is half: Var' = (Var + E²)/2 − E²/4 = Var/2 + E²/4.
        let at = up(0.0, 0.0, 0.0);
        let (whole, mean) = (variance_of_one_area_sample(&square(), &at, None), square().irradiance(&at));
        let half = variance_of_one_area_sample(&square(), &at, Some(&half_blocker()));
        assert!((half / (0.5 * whole + 0.25 * mean * mean) - 1.0).abs() <= 1e-13);
    }

    #[test]
    fn a_light_that_is_hidden_or_turned_away_has_no_variance() {
        assert_eq!(variance_of_one_area_sample(&square(), &up(-1.5, 0.0, 0.0), Some(&half_blocker())), 0.0);
        assert_eq!(variance_of_one_area_sample(&square(), &up(0.0, 0.0, 1.5), None), 0.0);
        let down = Receiver { point: DVec3::ZERO, normal: -DVec3::Z };
        assert_eq!(variance_of_one_area_sample(&square(), &down, None), 0.0);
        let outside = up(2.0, 0.0, 0.0);
        let plain = variance_of_one_area_sample(&square(), &outside, None);
        assert_eq!(variance_of_one_area_sample(&square(), &outside, Some(&half_blocker())), plain);
    }

    #[test]
    fn emission_enters_squared_and_scale_not_at_all() {
        let (light, at) = (square(), up(0.3, 0.1, 0.0));
        let bright = PolygonLight { emission: 8.0, ..light.clone() };
        let small = PolygonLight { corners: light.corners.iter().map(|&c| c * 0.125).collect(), emission: 1.0 };
        let near = Receiver { point: at.point * 0.125, ..at };
        let plain = variance_of_one_area_sample(&light, &at, None);
        assert_eq!(variance_of_one_area_sample(&bright, &at, None), 64.0 * plain);
        assert_eq!(variance_of_one_area_sample(&small, &near, None), plain);
    }
}

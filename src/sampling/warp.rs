//! From the unit square to where a decision is made, each map beside its density.

use glam::{Vec2, Vec3};

use crate::mutants::{Mutant, planted};

/// Concentric map of the unit square to the unit disk: area-preserving up to the factor π, so uniform with pdf 1/π.
///
/// Shirley & Chiu (1997), doi:10.1080/10867651.1997.10487479. The centre (½, ½) goes to the centre; finite everywhere.
#[inline]
pub fn square_to_disk(u: Vec2) -> Vec2 {
    if planted(Mutant::DiskWithoutRoot) {
        let angle = std::f32::consts::TAU * u.y;
        return u.x * Vec2::new(libm::cosf(angle), libm::sinf(angle));
    }
    let a = 2.0 * u.x - 1.0;
    let b = 2.0 * u.y - 1.0;
    if a == 0.0 && b == 0.0 {
        return Vec2::ZERO;
    }
    let quarter_pi = std::f32::consts::FRAC_PI_4;
    let (radius, angle) =
        if a.abs() > b.abs() { (a, quarter_pi * (b / a)) } else { (b, 2.0 * quarter_pi - quarter_pi * (a / b)) };
    Vec2::new(radius * libm::cosf(angle), radius * libm::sinf(angle))
}

/// Weights (b₀, b₁, b₂) of a uniform point of a triangle: b₀ = 1 − √u, b₁ = √u (1 − v), b₂ = √u v; pdf 1/area.
#[inline]
pub fn square_to_triangle(u: Vec2) -> Vec3 {
    let root = if planted(Mutant::TriangleWithoutRoot) { u.x } else { u.x.sqrt() };
    Vec3::new(1.0 - root, root * (1.0 - u.y), root * u.y)
}

/// A uniform point of the parallelogram `corner + u·e1 + v·e2`; pdf 1/|e1 × e2|.
#[inline]
pub fn square_to_parallelogram(u: Vec2, corner: Vec3, e1: Vec3, e2: Vec3) -> Vec3 {
    corner + e1 * u.x + e2 * u.y
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean of `f` over the k × k cell centres of the square: the midpoint rule, error O(1/k²) for smooth f.
    fn mean(k: u32, f: impl Fn(Vec2) -> f64) -> f64 {
        let centre = |i: u32| (i as f32 + 0.5) / k as f32;
        let sum: f64 = (0..k * k).map(|i| f(Vec2::new(centre(i % k), centre(i / k)))).sum();
        sum / f64::from(k * k)
    }

    /// Moments of the uniform unit disk (`camera.json`): E r = 2/3, E r² = 1/2, E x² = 1/4, mean 0.
    #[test]
    fn the_disk_has_the_moments_of_a_uniform_disk() {
        let k = 512;
        let r = |u: Vec2| f64::from(square_to_disk(u).length());
        // The map has kinks on the diagonals: the midpoint error is below 2/k².
        let tolerance = 2.0 / f64::from(k * k) + 1e-6;
        assert!((mean(k, r) - 2.0 / 3.0).abs() < tolerance);
        assert!((mean(k, |u| r(u).powi(2)) - 0.5).abs() < tolerance);
        assert!((mean(k, |u| f64::from(square_to_disk(u).x).powi(2)) - 0.25).abs() < tolerance);
        assert!(mean(k, |u| f64::from(square_to_disk(u).y)).abs() < tolerance);
        assert_eq!(square_to_disk(Vec2::splat(0.5)), Vec2::ZERO);
    }

    #[test]
    fn the_disk_is_never_left_and_corners_are_finite() {
        let largest = 1.0 - f32::EPSILON / 2.0;
        for x in [0.0, 0.25, 0.5, largest] {
            for y in [0.0, 0.5, 0.75, largest] {
                let p = square_to_disk(Vec2::new(x, y));
                assert!(p.is_finite() && p.length() <= 1.0 + 2.0 * f32::EPSILON);
            }
        }
    }

    /// Centroid 1/3 and second moments E b_i² = 1/6, E b_i b_j = 1/12 of a uniform triangle.
    #[test]
    fn the_triangle_has_the_moments_of_a_uniform_triangle() {
        let k = 512;
        for i in 0..3 {
            let b = |u| f64::from(square_to_triangle(u)[i]);
            assert!((mean(k, b) - 1.0 / 3.0).abs() < 1e-4);
            assert!((mean(k, |u| b(u).powi(2)) - 1.0 / 6.0).abs() < 1e-4);
            let next = |u| f64::from(square_to_triangle(u)[(i + 1) % 3]);
            assert!((mean(k, |u| b(u) * next(u)) - 1.0 / 12.0).abs() < 1e-4);
        }
    }
}

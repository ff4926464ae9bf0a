//! From the unit square to where a decision is made, each map beside its density.

use glam::{Vec2, Vec3};

use crate::mutants::{Mutant, planted};

/// Concentric map of the unit square to the unit disk: area-preserving up to the factor π, so uniform with pdf 1/π.
///
/// Shirley & Chiu (1997), doi:10.1080/10867651.1997.10487479. The centre (½, ½) goes to the centre; finite everywhere.
#[inline(always)]
pub fn square_to_disk(u: Vec2) -> Vec2 {
    if planted(Mutant::DiskWithoutRoot) {
        let angle = std::f32::consts::TAU * u.y;
        return u.x * Vec2::new(libm::cosf(angle), libm::sinf(angle));
    }
    let a = 2.0 * u.x - 1.0;
    let b = 2.0 * u.y - 1.0;
    let wide = a.abs() > b.abs();
    let (radius, across) = if wide { (a, b) } else { (b, a) };
    // At the centre 0/0: what follows is no number, and not taken.
    let turn = std::f32::consts::FRAC_PI_4 * (across / radius);
    let angle = if wide { turn } else { 2.0 * std::f32::consts::FRAC_PI_4 - turn };
    let (sin, cos) = sin_cos_in_wedges(angle);
    if (a == 0.0) & (b == 0.0) { Vec2::ZERO } else { Vec2::new(radius * cos, radius * sin) }
}

/// Sine and cosine of an angle from −π/4 to 3π/4 (as rounded to f32): the bits of libm's `sinf` and `cosf`, without branches, so that a
/// loop over lanes becomes vector instructions.
///
/// Both reduce to a quarter turn about 0 and evaluate polynomials in f64 (FreeBSD's msun, `s_sinf.c`, `k_sinf.c`, `k_cosf.c`), which are odd
/// and even in every operation, so signs may be taken out.
#[inline(always)]
fn sin_cos_in_wedges(angle: f32) -> (f32, f32) {
    use std::f64::consts::{FRAC_PI_2, PI};
    // msun's limits of the first octant and of the third.
    let (first, third) = (f32::from_bits(0x3f49_0fda), f32::from_bits(0x4016_cbe3));
    let (turned, far, negative) = (angle.abs() > first, angle > third, angle < 0.0);
    let turn = if far { -PI } else { -FRAC_PI_2 };
    let turn = if negative { FRAC_PI_2 } else { turn };
    let x = if turned { f64::from(angle) + turn } else { f64::from(angle) };
    let z = x * x;
    let w = z * z;
    let s = z * x;
    let r = -0.000_198_393_348_360_966_32 + z * 0.000_002_718_311_493_989_822;
    let sin = ((x + s * (-0.166_666_666_416_265_24 + z * 0.008_333_329_385_889_463)) + s * w * r) as f32;
    let r = -0.001_388_676_377_460_993 + z * 0.000_024_390_448_796_277_41;
    let cos = (((1.0 + z * -0.499_999_997_251_031) + w * 0.041_666_623_323_739_06) + (w * z) * r) as f32;
    let (sin_turned, cos_turned) = if far { (-sin, -cos) } else { (cos, -sin) };
    let (sin_turned, cos_turned) = if negative { (-cos, sin) } else { (sin_turned, cos_turned) };
    // The polynomial loses the sign of −0.
    let sin = if angle == 0.0 { angle } else { sin };
    if turned { (sin_turned, cos_turned) } else { (sin, cos) }
}

/// Weights (b₀, b₁, b₂) of a uniform point of a triangle: b₀ = 1 − √u, b₁ = √u (1 − v), b₂ = √u v; pdf 1/area.
#[inline(always)]
pub fn square_to_triangle(u: Vec2) -> Vec3 {
    let root = if planted(Mutant::TriangleWithoutRoot) { u.x } else { u.x.sqrt() };
    Vec3::new(1.0 - root, root * (1.0 - u.y), root * u.y)
}

/// A uniform point of the parallelogram `corner + u·e1 + v·e2`; pdf 1/|e1 × e2|.
#[inline(always)]
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

    /// Every 401st of the 2.1 billion angles that the map can make, and all near the limits of the octants.
    #[test]
    fn sine_and_cosine_have_the_bits_of_libm() {
        let largest = 3.0 * std::f32::consts::FRAC_PI_4;
        let check = |angle: f32| {
            let (sin, cos) = sin_cos_in_wedges(angle);
            let expected = (libm::sinf(angle).to_bits(), libm::cosf(angle).to_bits());
            assert_eq!((sin.to_bits(), cos.to_bits()), expected, "{angle:e}");
        };
        let step = if cfg!(miri) { 4_000_037 } else { 401 };
        (0..=largest.to_bits()).step_by(step).for_each(|bits| check(f32::from_bits(bits)));
        let quarter = std::f32::consts::FRAC_PI_4.to_bits();
        (0..=quarter).step_by(step).for_each(|bits| check(-f32::from_bits(bits)));
        for near in [0x3980_0000, quarter, 0x3fc9_0fdb, largest.to_bits()] {
            for bits in near - 1000..=(near + 1000).min(largest.to_bits()) {
                check(f32::from_bits(bits));
                check(-f32::from_bits(bits.min(quarter)));
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

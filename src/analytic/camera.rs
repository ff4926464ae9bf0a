//! Closed forms of the camera: a pixel's coverage by a half-plane, a lens's blur.

use std::f64::consts::PI;

/// Area of { (x, y) in [0, 1]² : a x + b y ≤ c }: the value of a pixel crossed by a straight edge between 1 and 0.
///
/// For a, b > 0 this is [c₊² − (c−a)₊² − (c−b)₊² + (c−a−b)₊²] / (2ab). That form is 0/0 for a → 0, so the same area
/// is taken piece by piece (triangle, trapezoid, and their complements), where nothing cancels: a = 0, b = 0 and
/// 10⁻³⁰⁰ need no case of their own. Any finite a, b, c; with a = b = 0 it is 1 for c ≥ 0, else 0. The variance of
/// one random sample of it is p(1 − p).
pub fn pixel_coverage(a: f64, b: f64, c: f64) -> f64 {
    // x → 1 − x turns a negative coefficient into a positive one.
    let c = c - a.min(0.0) - b.min(0.0);
    let (low, high) = if a.abs() < b.abs() { (a.abs(), b.abs()) } else { (b.abs(), a.abs()) };
    let all = low + high;
    if c >= all {
        1.0
    } else if c <= 0.0 {
        0.0
    } else if c <= 0.5 * all {
        lower_half_coverage(low, high, c)
    } else {
        1.0 - lower_half_coverage(low, high, all - c)
    }
}

/// Coverage for 0 ≤ low ≤ high, 0 < high and 0 ≤ c ≤ (low + high)/2, which is at most `high`.
fn lower_half_coverage(low: f64, high: f64, c: f64) -> f64 {
    if c < low { (c / high) * (c / low) * 0.5 } else { (c - 0.5 * low) / high }
}

/// Share of a uniform disc of radius 1 on the side x ≤ t: 1/2 + (t √(1 − t²) + asin t)/π, 0 below −1 and 1 above 1.
///
/// A defocused straight edge between 0 and 1 has this profile, t = offset / blur radius.
pub fn disc_share(t: f64) -> f64 {
    if t <= -1.0 {
        0.0
    } else if t >= 1.0 {
        1.0
    } else {
        0.5 + (t * ((1.0 - t) * (1.0 + t)).sqrt() + libm::asin(t)) / PI
    }
}

/// A thin lens focused on a plane: what it does to points off that plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThinLens {
    /// Radius of the aperture in scene units, 0 for a pinhole.
    pub radius: f64,
    /// Distance of the plane of focus along the view *axis* in scene units, above 0. Measured along each ray
    /// instead, it would be shorter by the cosine to the axis.
    pub focal_depth: f64,
}

impl ThinLens {
    /// Radius R |f − z| / f of the disc that the rays of one image point fill at depth z ≥ 0, in scene units.
    pub fn ray_disc_radius(&self, depth: f64) -> f64 {
        self.radius * (self.focal_depth - depth).abs() / self.focal_depth
    }

    /// Radius R |z − f| / z over which a point at depth z > 0 spreads in the plane of focus, in scene units.
    /// z = ∞ gives R.
    pub fn blur_radius_in_focus_plane(&self, depth: f64) -> f64 {
        if depth.is_infinite() { self.radius } else { self.radius * (depth - self.focal_depth).abs() / depth }
    }

    /// Circle of confusion in pixels: the radius R |1/f − 1/z| · H / (2 tan(fov/2)) over which a point at depth
    /// z > 0 spreads in an image of `height_px` rows under the *vertical* field of view `fov_y_degrees` in (0, 180).
    /// z = ∞ gives R/f · H / (2 tan(fov/2)).
    pub fn blur_radius_px(&self, depth: f64, fov_y_degrees: f64, height_px: f64) -> f64 {
        let half_tangent = libm::tan(fov_y_degrees.to_radians() * 0.5);
        self.blur_radius_in_focus_plane(depth) / self.focal_depth * height_px / (2.0 * half_tangent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    fn reference() -> Value {
        serde_json::from_str(include_str!("../../tests/reference/camera.json")).unwrap()
    }

    /// "1/3", "-1/4" or a decimal.
    fn number(value: &Value) -> f64 {
        let Some(text) = value.as_str() else { return value.as_f64().unwrap() };
        match text.split_once('/') {
            Some((p, q)) => p.parse::<f64>().unwrap() / q.parse::<f64>().unwrap(),
            None => text.parse().unwrap(),
        }
    }

    #[test]
    fn coverage_agrees_with_the_reference_areas_and_variances() {
        for case in reference()["pixel_coverage"].as_array().unwrap() {
            let p = pixel_coverage(number(&case["a"]), number(&case["b"]), number(&case["c"]));
            assert!((p - number(&case["area"])).abs() <= 1e-14, "{case}");
            assert!((p * (1.0 - p) - number(&case["variance_one_random_sample"])).abs() <= 1e-14, "{case}");
        }
    }

    /// The formula with the squares, for coefficients that are both well above 0.
    fn coverage_by_squares(a: f64, b: f64, c: f64) -> f64 {
        let square = |v: f64| v.max(0.0) * v.max(0.0);
        (square(c) - square(c - a) - square(c - b) + square(c - a - b)) / (2.0 * a * b)
    }

    #[test]
    fn coverage_agrees_with_the_formula_of_squares() {
        for i in 1..40 {
            for j in 1..40 {
                for k in -5..90 {
                    let (a, b, c) = (f64::from(i) / 20.0, f64::from(j) / 20.0, f64::from(k) / 20.0);
                    let twin = coverage_by_squares(a, b, c);
                    // The twin's squares are up to 20 and rounded four times, then divided by 2ab.
                    let rounding = 4.0 * 20.0 * f64::EPSILON / (2.0 * a * b) + 1e-15;
                    assert!((pixel_coverage(a, b, c) - twin).abs() <= rounding, "{a} {b} {c}");
                }
            }
        }
    }

    #[test]
    fn coverage_has_its_limits_for_vanishing_coefficients() {
        for tiny in [0.0, 1e-12, -1e-12, 1e-300, f64::MIN_POSITIVE] {
            for c in [-0.5, 0.0, 0.25, 0.75, 1.0, 2.0] {
                let limit = f64::clamp(c / 2.0, 0.0, 1.0);
                assert!((pixel_coverage(tiny, 2.0, c) - limit).abs() <= tiny.abs(), "{tiny} {c}");
                assert!((pixel_coverage(-2.0, tiny, c - 2.0) - limit).abs() <= tiny.abs(), "{tiny} {c}");
            }
        }
        assert_eq!((pixel_coverage(0.0, 0.0, 0.0), pixel_coverage(0.0, 0.0, -1.0)), (1.0, 0.0));
    }

    #[test]
    fn the_two_sides_of_an_edge_fill_the_pixel() {
        for i in -20..=20 {
            for j in -20..=20 {
                for k in -30..=30 {
                    let (a, b, c) = (f64::from(i) * 0.37, f64::from(j) * 0.11, f64::from(k) * 0.173 + 0.01);
                    let sum = pixel_coverage(a, b, c) + pixel_coverage(-a, -b, -c);
                    assert!((sum - 1.0).abs() <= 1e-14, "{a} {b} {c}");
                }
            }
        }
    }

    #[test]
    fn disc_shares_agree_with_the_reference() {
        for case in reference()["disc"].as_array().unwrap() {
            assert!((disc_share(number(&case["t"])) - number(&case["share"])).abs() <= 1e-14, "{case}");
        }
        for t in [0.1, 0.7, 0.999_999, 3.0] {
            assert!((disc_share(t) + disc_share(-t) - 1.0).abs() <= 1e-15);
        }
    }

    #[test]
    fn circles_of_confusion_agree_with_the_reference() {
        for case in reference()["coc"].as_array().unwrap() {
            let lens = ThinLens { radius: number(&case["R"]), focal_depth: number(&case["f"]) };
            let z = number(&case["z"]);
            let near =
                |found: f64, key: &str| (found - number(&case[key])).abs() <= 1e-14 * number(&case[key]).max(1.0);
            assert!(near(lens.ray_disc_radius(z), "radius_of_ray_cone_at_z"), "{case}");
            assert!(near(lens.blur_radius_in_focus_plane(z), "blur_radius_in_focus_plane_of_point_at_z"), "{case}");
            let px = lens.blur_radius_px(z, number(&case["fov_y_deg"]), number(&case["image_height_px"]));
            assert!(near(px, "blur_radius_px"), "{case}");
        }
    }

    #[test]
    fn the_horizon_blurs_by_the_lens_over_the_focus() {
        let lens = ThinLens { radius: 0.1, focal_depth: 5.0 };
        let horizon = lens.blur_radius_px(f64::INFINITY, 90.0, 100.0);
        assert!((horizon - 1.0).abs() <= 1e-14);
        assert!((lens.blur_radius_px(1e15, 90.0, 100.0) - horizon).abs() <= 1e-13);
        let pinhole = ThinLens { radius: 0.0, focal_depth: 5.0 };
        assert_eq!(pinhole.blur_radius_px(1.0, 90.0, 100.0), 0.0);
    }
}

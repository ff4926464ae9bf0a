//! The Utah teapot (Martin Newell, 1975): 32 bicubic Bézier patches.

use glam::DVec3;
use serde::Deserialize;

use super::obj::Obj;
use super::solids::{Place, bernstein, bernstein_slopes, grid};

/// The published control points, z up, 3.15 high.
#[derive(Debug, Deserialize)]
pub struct Teapot {
    vertices: Vec<[f64; 3]>,
    patches: Vec<[usize; 16]>,
}

impl Teapot {
    /// The control points beside this program.
    pub fn published() -> Self {
        serde_json::from_str(include_str!("../teapot.json")).expect("teapot.json is part of this program")
    }

    /// Adds the pot, y up, standing on its origin, spout along +x; every patch is cut into `steps × steps` quads.
    pub fn add(&self, obj: &mut Obj, place: &Place, steps: usize) {
        for patch in &self.patches {
            let control = patch.map(|i| {
                let [x, y, z] = self.vertices[i];
                DVec3::new(x, z, -y)
            });
            grid(obj, steps, steps, |column, row| {
                let (position, normal) = evaluate(&control, row as f64 / steps as f64, column as f64 / steps as f64);
                place.corner(position, normal)
            });
        }
    }
}

/// Point and outward unit normal of a bicubic patch: p(u, v) = Σ Bᵢ(u) Bⱼ(v) p₄ᵢ₊ⱼ, n = −∂p/∂u × ∂p/∂v (the published
/// patches all look inward).
///
/// Where a whole edge u = 0 is one point (lid knob, bottom centre) ∂p/∂v vanishes: the tangents ∂p/∂u at the edge's two
/// ends span the plane instead.
fn evaluate(control: &[DVec3; 16], u: f64, v: f64) -> (DVec3, DVec3) {
    let sum =
        |row: [f64; 4], column: [f64; 4]| -> DVec3 { (0..16).map(|i| control[i] * (row[i / 4] * column[i % 4])).sum() };
    let along_u = |v: f64| sum(bernstein_slopes(u), bernstein(v));
    let position = sum(bernstein(u), bernstein(v));
    let collapsed = u == 0.0 && control[..4].iter().all(|p| *p == control[0]);
    let (du, dv) =
        if collapsed { (along_u(0.0), along_u(1.0)) } else { (along_u(v), sum(bernstein(u), bernstein_slopes(v))) };
    (position, -du.cross(dv).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// De Casteljau's construction: the slow, obvious evaluation of a cubic.
    fn de_casteljau(mut points: [DVec3; 4], t: f64) -> DVec3 {
        for level in (1..4).rev() {
            for i in 0..level {
                points[i] = points[i].lerp(points[i + 1], t);
            }
        }
        points[0]
    }

    /// A patch point by de Casteljau, first along v, then along u.
    fn slow_point(control: &[DVec3; 16], u: f64, v: f64) -> DVec3 {
        de_casteljau(std::array::from_fn(|row| de_casteljau(std::array::from_fn(|i| control[4 * row + i]), v)), u)
    }

    fn patches() -> Vec<[DVec3; 16]> {
        let teapot = Teapot::published();
        assert_eq!((teapot.vertices.len(), teapot.patches.len()), (290, 32));
        teapot.patches.iter().map(|p| p.map(|i| DVec3::from_array(teapot.vertices[i]))).collect()
    }

    #[test]
    fn patch_points_agree_with_de_casteljau_and_normals_with_differences() {
        for control in patches() {
            for (u, v) in [(0.0, 0.0), (0.25, 0.5), (0.7, 0.1), (1.0, 1.0)] {
                let (position, normal) = evaluate(&control, u, v);
                assert!(position.distance(slow_point(&control, u, v)) < 1e-14);
                assert!((normal.length() - 1.0).abs() < 1e-14, "{normal}");
            }
            // Central differences of step h are off by h² times a third derivative of a few units.
            let (u, v, h) = (0.4, 0.6, 1e-4);
            let du = slow_point(&control, u + h, v) - slow_point(&control, u - h, v);
            let dv = slow_point(&control, u, v + h) - slow_point(&control, u, v - h);
            assert!((-du.cross(dv).normalize()).distance(evaluate(&control, u, v).1) < 1e-6);
        }
    }

    #[test]
    fn normals_at_the_knob_and_the_bottom_centre_point_up_and_down() {
        for control in patches().iter().filter(|c| c[0] == c[3]) {
            for v in [0.0, 0.3, 1.0] {
                let (position, normal) = evaluate(control, 0.0, v);
                let outward = if position.z > 1.0 { DVec3::Z } else { -DVec3::Z };
                assert!(normal.distance(outward) < 1e-12, "{position}: {normal}");
                // The limit along the patch is the same: no dark spot around the pole.
                assert!(evaluate(control, 1e-6, v).1.distance(outward) < 1e-4);
            }
        }
    }
}

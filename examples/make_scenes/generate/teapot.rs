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

//! A square light over a plane with one straight blocker: a soft shadow with a closed form.
//!
//! The numbers are those of the closed form's standard scene and exact in f32, so that formula and mesh mean the same
//! geometry to the last bit.

use std::path::Path;

use glam::DVec3;
use sampler_lab::error::Result;

use super::obj::{Material, Obj};

const ABOUT: &str = "A square light over a plane, one straight blocker between; both are outside the picture.
Made by examples/make_scenes.";

const MATERIALS: [Material<'static>; 3] = [
    Material { name: "plane", lines: "Kd 0.75 0.75 0.75" },
    Material { name: "blocker", lines: "Kd 0.5 0.5 0.5" },
    Material { name: "light", lines: "Kd 1 1 1\nKe 10 10 10" },
];

/// The plane, larger than the picture, counter-clockwise seen from above: (x, z).
const PLANE: [[f64; 2]; 4] = [[-8.0, -8.0], [-8.0, 8.0], [8.0, 8.0], [8.0, -8.0]];

/// The light, counter-clockwise seen from below.
const LIGHT: [[f64; 2]; 4] = [[-1.0, 0.0], [0.0, 0.0], [0.0, 1.0], [-1.0, 1.0]];

/// The blocker, a strip that is longer than the light reaches around.
const BLOCKER: [[f64; 2]; 4] = [[-5.90625, -1.6875], [6.09375, 1.3125], [5.90625, 2.0625], [-6.09375, -0.9375]];

/// Writes the scene's files into `folder`.
///
/// # Errors
/// Kind `Write` where a file cannot be written.
pub fn write(folder: &Path) -> Result<()> {
    let mut obj = Obj::new(5);
    for (name, height, corners) in [("plane", 0.0, PLANE), ("blocker", 1.0, BLOCKER), ("light", 3.0, LIGHT)] {
        obj.object(name, name);
        obj.flat_quad(corners.map(|[x, z]| DVec3::new(x, height, z)));
    }
    obj.write(folder, "penumbra", ABOUT, &MATERIALS)
}

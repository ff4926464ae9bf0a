//! The Cornell box, from the published measurements.

use std::path::Path;

use glam::DVec3;
use sampler_lab::error::Result;
use serde::Deserialize;

use super::obj::{Material, Obj};

/// Scene units per published millimetre.
const SCALE: f64 = 0.01;

/// What the measurements hold that a mesh needs.
#[derive(Debug, Deserialize)]
struct Measurements {
    quads: Vec<Quad>,
}

/// One measured surface, counter-clockwise seen from the side that is seen or that emits.
#[derive(Debug, Deserialize)]
struct Quad {
    name: String,
    material: String,
    vertices: [[f64; 3]; 4],
}

const ABOUT: &str = "Cornell box, the published measurements times 0.01; the ceiling is whole and the light hangs
0.001 below it. Made by examples/make_scenes.";

const MATERIALS: [Material<'static>; 4] = [
    Material { name: "white", lines: "Kd 0.725 0.71 0.68" },
    Material { name: "red", lines: "Kd 0.63 0.065 0.05" },
    Material { name: "green", lines: "Kd 0.14 0.45 0.091" },
    Material { name: "light", lines: "Kd 1 1 1\nKe 15 15 15" },
];

/// Writes the scene's files into `folder`.
///
/// # Errors
/// Kind `Write` where a file cannot be written.
pub fn write(folder: &Path) -> Result<()> {
    let measured: Measurements =
        serde_json::from_str(include_str!("../cornell.json")).expect("cornell.json is part of this program");
    let mut obj = Obj::new(4);
    for quad in &measured.quads {
        let name = if quad.material == "light" { "light".to_owned() } else { quad.name.replace(' ', "_") };
        obj.object(&name, &quad.material);
        obj.flat_quad(quad.vertices.map(|v| DVec3::from_array(v) * SCALE));
    }
    obj.write(folder, "cornell", ABOUT, &MATERIALS)
}

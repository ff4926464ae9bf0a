//! A checkered plane that runs to the horizon under an even sky: anti-aliasing, and nothing else.
//!
//! The plane is one texture of sharp tiles, laid over bands that double in depth: bands keep numbers small where the
//! camera is near, and a texture has a closed form to its last texel. All numbers are exact in f32.

use std::path::Path;

use glam::DVec3;
use sampler_lab::error::Result;
use sampler_lab::film::write_small_png_rgb8;

use super::obj::{Corner, Material, Obj};

const ABOUT: &str = "A checkered plane to the horizon and a plain sky; shown as albedo, so that nothing but the place in the pixel matters.
Made by examples/make_scenes.";

const MATERIALS: [Material<'static>; 2] = [
    Material { name: "checker", lines: "Kd 1 1 1\nmap_Kd checker.png" },
    Material { name: "sky", lines: "Kd 0.25 0.375 0.5" },
];

/// Texels along a tile's side: the ramp that bilinear look-up puts between two tiles is a 256th of a tile.
const TEXELS: u32 = 256;

/// The two tiles, sRGB codes.
const PALE: [u8; 3] = [240, 232, 214];
const DARK: [u8; 3] = [38, 46, 56];

/// Depth of the nearest edge of the plane and of the horizon, both powers of two.
const NEAR: f64 = 4.0;
const FAR: f64 = 512.0;

/// Half the plane's width at a depth of 1; the picture sees less.
const SPREAD: f64 = 1.5;

/// Writes the scene's files into `folder`.
///
/// # Errors
/// Kind `Write` where a file cannot be written.
pub fn write(folder: &Path) -> Result<()> {
    let mut obj = Obj::new(5);
    obj.object("plane", "checker");
    let mut near = NEAR;
    while near < FAR {
        add_band(&mut obj, near, 2.0 * near);
        near *= 2.0;
    }
    obj.object("sky", "sky");
    let side = SPREAD * FAR;
    obj.flat_quad([[-side, 0.0], [side, 0.0], [side, FAR], [-side, FAR]].map(|[x, y]| DVec3::new(x, y, FAR)));
    write_checker(&folder.join("checker.png"))?;
    obj.write(folder, "horizon", ABOUT, &MATERIALS)
}

/// The part of the plane between two depths: a trapezoid that shares its whole edges with the next, so no ray slips
/// through.
fn add_band(obj: &mut Obj, near: f64, far: f64) {
    let corners = [[-SPREAD * near, near], [-SPREAD * far, far], [SPREAD * far, far], [SPREAD * near, near]];
    obj.face(&corners.map(|[x, z]| Corner {
        position: DVec3::new(x, 0.0, z),
        normal: None,
        uv: Some(texture_at(x, z)),
    }));
}

/// The texture holds 2 × 2 tiles. They are turned against the view by atan(1/4), so that no edge runs along a row of
/// pixels; a tile's side is 4/√17.
fn texture_at(x: f64, z: f64) -> [f64; 2] {
    [(x + 0.25 * z) / 2.0, (z - 0.25 * x) / 2.0]
}

fn write_checker(path: &Path) -> Result<()> {
    let side = 2 * TEXELS;
    let texels = (0..side * side).flat_map(|i| {
        // The tile at the origin of the texture, its lower left one, is pale.
        let is_pale = (i % side < TEXELS) == (i / side >= TEXELS);
        if is_pale { PALE } else { DARK }
    });
    write_small_png_rgb8(path, side, side, &texels.collect::<Vec<u8>>())
}

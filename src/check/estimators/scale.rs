//! The unit of length: radiance has no length in it, so the same picture comes out at any scale.

use glam::Vec3;

use super::reference::polygons;
use super::{Check, Context, Finding, exact};
use crate::analytic::{PolygonLight, Receiver};
use crate::check::Tally;
use crate::check::room::{Room, ceiling, grey, looking_at, parallelogram, rendered, scaled_camera, spec};
use crate::scene::compile::Stage;
use crate::scene::config::CameraConfig;

/// The checks of this file.
pub fn checks() -> Vec<Check> {
    vec![
        exact(
            "scale-power-of-two",
            "a power of two as the unit of length changes no bit of a picture with shadows, lens and several lights",
            power_of_two,
        ),
        exact(
            "scale-million",
            "all lengths times 1e-6 and 1e6: smooth pictures change by rounding alone, nothing leaks and nothing is shadowed by itself",
            million,
        ),
        exact(
            "scale-million-edges",
            "where shadows, lens and edges are in the picture, times 1e±6 samples change by rounding, but for at most 3 in 12 288 on an edge",
            million_edges,
        ),
        exact(
            "scale-closed-forms",
            "the closed forms themselves do not change with the unit of length, to 1e-12",
            closed_forms,
        ),
    ]
}

/// Lights over a floor with nothing between: rectangles high, low and turned, far, and a mesh of three triangles.
pub fn unoccluded() -> Vec<Room> {
    let pentagon = [(1.0, 0.0), (2.0, 0.0), (2.5, 1.0), (1.5, 2.0), (0.5, 1.0)];
    let lights: [Vec<Vec3>; 5] = [
        ceiling(Vec3::new(0.3, 3.0, -0.2), 0.5, 0.8).to_vec(),
        ceiling(Vec3::new(0.0, 0.02, 2.0), 1.0, 1.0).to_vec(),
        parallelogram(Vec3::new(-2.0, 1.0, 0.5), Vec3::new(0.0, 0.4, 0.1), Vec3::Z).to_vec(),
        ceiling(Vec3::new(0.0, 900.0, 0.0), 30.0, 20.0).to_vec(),
        pentagon.map(|(x, z)| Vec3::new(x, 2.5, z)).to_vec(),
    ];
    let room = |light: &Vec<Vec3>| {
        let mut room = Room::default();
        room.floor(4.0, 0.5);
        room.light(light, 2.0);
        room
    };
    lights.iter().map(room).collect()
}

/// Looks at the floor under them, from below all of them but the lowest, which lies to its side.
pub fn floor_camera() -> CameraConfig {
    looking_at(Vec3::new(0.1, 0.5, -0.4), Vec3::new(0.0, 0.0, 0.0), 40.0)
}

/// A room with everything: blocker, mesh light, two lights, lens.
pub fn full_room() -> (Room, CameraConfig) {
    let mut room = unoccluded().remove(4);
    room.light(&ceiling(Vec3::new(-0.5, 2.0, 0.5), 0.3, 0.3), 5.0);
    let blocker = room.material(0.3, None);
    room.polygon(&ceiling(Vec3::new(0.2, 1.0, 0.1), 0.4, 0.2), blocker);
    let camera = CameraConfig { lens_radius: 0.05, focal_depth: 0.7, ..floor_camera() };
    (room, camera)
}

/// Powers of two scale every coordinate exactly, so nothing may change at all. Catches any length that is compared with a number.
fn power_of_two(context: &Context) -> Finding {
    let (room, camera) = full_room();
    let image = |scale: f32| {
        let scene = room.scaled(scale).scene(&scaled_camera(&camera, scale), (24, 16), Stage::Final);
        rendered(&scene, spec("sobol"), 8, context.seed)
    };
    let plain = image(1.0);
    let mut tally = Tally::new();
    for exponent in [-30, -20, -9, 9, 20, 30] {
        let other = image(2f32.powi(exponent)).pixels.iter().zip(&plain.pixels).filter(|(a, b)| a != b).count();
        tally.fact(format!("scale 2^{exponent}: {other} pixels differ"), other == 0);
    }
    tally.saying("2^-30 to 2^30: the same bits")
}

/// Factors 10±⁶ round every coordinate (2⁻²⁴ each). A sample's point, light point and offset then err by some 4 roundings of
/// the largest coordinate in play, 4: δ = 2⁻²⁰ beside distances of at least 1; cos cos / r² moves by at most 6 δ
/// and a dozen roundings of its own. Without edges in the picture no sample can jump.
fn million(context: &Context) -> Finding {
    let bound = 6.0 * 2f64.powi(-20) + 12.0 * 2f64.powi(-24);
    let mut tally = Tally::new();
    let mut worst = 0.0;
    for (which, room) in unoccluded().iter().enumerate().filter(|(which, _)| [0, 2, 4].contains(which)) {
        let image = |scale: f32| {
            let scene = room.scaled(scale).scene(&scaled_camera(&floor_camera(), scale), (12, 12), Stage::Final);
            grey(&rendered(&scene, spec("sobol"), 16, context.seed))
        };
        let plain = image(1.0);
        for scale in [1e-6, 1e6] {
            let change = |(a, b): (&f64, &f64)| (a / b - 1.0).abs();
            let most = image(scale).iter().zip(&plain).map(change).fold(0.0, f64::max);
            worst = f64::max(worst, most);
            tally.near(format!("room {which}, scale {scale:e}: largest relative change"), most, 0.0, bound);
        }
    }
    tally.saying(format!("largest relative change of a pixel: {worst:.1e}, bound {bound:.1e}"))
}

/// One sample a pixel of the room with everything. A sample within δ = 2⁻²⁰ of an edge may fall on its other side: edges of some 10
/// lengths in views of 1 × 1 (floor, blocker, light, lens) are met by a share of some 10⁻⁵ of the samples, so of 12 288 by 0.1,
/// and more than 3 by chance once in 10⁵ seeds. A leak or acne at one scale would be some hundred.
fn million_edges(context: &Context) -> Finding {
    let (room, camera) = full_room();
    let image = |scale: f32| {
        let scene = room.scaled(scale).scene(&scaled_camera(&camera, scale), (128, 96), Stage::Final);
        grey(&rendered(&scene, spec("uniform"), 1, context.seed))
    };
    let plain = image(1.0);
    let lit = plain.iter().filter(|&&v| v > 0.0).count();
    let mut tally = Tally::new();
    tally.fact(format!("{lit} of {} samples are lit", plain.len()), lit > plain.len() / 4 && lit < plain.len());
    let mut said = Vec::new();
    for scale in [1e-6, 1e6] {
        // Lights are at least 1 away and seen at cosines above 0.2.
        let jumped = image(scale).iter().zip(&plain).filter(|(a, b)| (*a - *b).abs() > 1e-4 * a.max(**b)).count();
        tally.fact(format!("scale {scale:e}: {jumped} of {} samples jump", plain.len()), jumped <= 3);
        said.push(format!("{scale:e}: {jumped}"));
    }
    tally.saying(format!("samples of 12 288 that jump over an edge: {}", said.join(", ")))
}

fn closed_forms(_: &Context) -> Finding {
    let mut tally = Tally::new();
    for row in polygons() {
        for scale in [1e-6, 1e6] {
            let corners = row.light.corners.iter().map(|&c| c * scale).collect();
            let at = Receiver { point: row.at.point * scale, ..row.at };
            let found = PolygonLight { corners, ..row.light.clone() }.irradiance(&at);
            tally.near(format!("{}, scale {scale:e}", row.name), found, row.irradiance, 1e-12 * row.irradiance);
        }
    }
    tally.finish()
}

//! The thin lens: what it blurs, by how much, where it does not, and that it moves nothing.

use glam::{Vec2, Vec3};

use super::reference::{BlurRow, blurs};
use super::{Check, Context, Finding, exact, statistical, uniform_points};
use crate::analytic::quadrature::{Tolerance, integrate};
use crate::analytic::{ThinLens, disc_share};
use crate::check::Tally;
use crate::check::room::{Room, grey, rendered, spec};
use crate::sampling::warp::square_to_disk;
use crate::scene::compile::{Scene, Stage};
use crate::scene::config::CameraConfig;
use crate::stats::hypothesis::t_test_of_squares;
use crate::stats::hypothesis::{binomial_test, clopper_pearson};
use crate::stats::{Family, t_test};

/// The checks of this file.
pub fn checks() -> Vec<Check> {
    vec![
        Check {
            failures: &[54],
            ..statistical(
                "disk-moments",
                "points of the lens are uniform on the disk: E r = 2/3, E r² = 1/2, no shift",
                disk_moments,
            )
        },
        statistical(
            "confusion-moments",
            "a defocused point fills its circle of confusion c evenly: E r = 2c/3, E r² = c²/2, nothing beyond c",
            confusion_moments,
        ),
        statistical(
            "chief-ray",
            "the mean of the lens's rays is the chief ray: blur does not move the picture",
            chief_ray,
        ),
        statistical(
            "defocused-edge",
            "a defocused straight edge has the profile 1/2 + (t√(1−t²) + asin t)/π, pixel by pixel",
            defocused_edge,
        ),
        statistical("defocused-edge-place", "a defocused edge stays where the sharp one is", edge_place),
        exact("focus-plane", "focus is a plane: an edge in it is sharp far off the axis, too", focus_plane),
    ]
}

/// Catches r = u (E r = 1/2), a square in place of the disk, a lens off its centre by 0.01 of its radius.
fn disk_moments(context: &Context) -> Finding {
    let family = context.family(4);
    let points: Vec<Vec2> =
        uniform_points(context.seed, context.replicates(100_000, 2_000)).map(square_to_disk).collect();
    let mut tally = Tally::new();
    let mut mean = |what: &str, f: fn(Vec2) -> f32, exact: f64| {
        let values: Vec<f64> = points.iter().map(|&p| f64::from(f(p))).collect();
        tally.verdict(what, &t_test(&values, exact, family), 1.0);
    };
    mean("E r", |p| p.length(), 2.0 / 3.0);
    mean("E r²", |p| p.length_squared(), 0.5);
    mean("E x", |p| p.x, 0.0);
    mean("E y", |p| p.y, 0.0);
    tally.finish()
}

/// A camera at the origin along +z, whose image x runs along −x of the scene.
fn camera(lens: &ThinLens, fov_degrees: f64) -> CameraConfig {
    CameraConfig {
        pos: Vec3::ZERO,
        dir: Vec3::Z,
        up: Vec3::Y,
        fov_degrees: fov_degrees as f32,
        lens_radius: lens.radius as f32,
        focal_depth: lens.focal_depth as f32,
    }
}

/// Where the rays of one image point meet the plane of depth z, as seen from the chief ray's point there, in pixels. The rays are
/// those of the scene's own camera.
fn confusion(row: &BlurRow, seed: u64, n: u32) -> Vec<Vec2> {
    let size = (96, row.height_px);
    let mut room = Room::default();
    room.floor(1.0, 0.5);
    let config = camera(&row.lens, row.fov_degrees);
    let scene = room.scene(&config, size, Stage::Final);
    let at = Vec2::new(0.7 * size.0 as f32, 0.2 * size.1 as f32);
    let depth = row.depth as f32;
    let meet = |u: Vec2| {
        let ray = scene.camera.lens_ray(at, u, config.lens_radius, config.focal_depth);
        let p = ray.origin + ray.direction * (depth / ray.direction.z);
        Vec2::new(p.x, p.y)
    };
    let chief = scene.camera.pinhole_ray(at);
    let chief = chief.direction * (depth / chief.direction.z);
    // A pixel is this wide at depth z.
    let px = 2.0 * depth * libm::tan(0.5 * row.fov_degrees.to_radians()) as f32 / row.height_px as f32;
    uniform_points(seed, n).map(|u| (meet(u) - Vec2::new(chief.x, chief.y)) / px).collect()
}

/// A bound for the rounding of such a place in pixels: some 8 roundings of coordinates as large as the depth.
fn place_rounding(row: &BlurRow) -> f64 {
    let half = libm::tan(0.5 * row.fov_degrees.to_radians());
    8.0 * 2f64.powi(-24) * f64::from(row.height_px) / (2.0 * half) * (1.0 + half)
}

/// The five circles of confusion of `camera.json`. Catches a radius that is wrong by 0.5 %, uneven filling, rays outside.
fn confusion_moments(context: &Context) -> Finding {
    let rows = blurs();
    let family = context.family(2 * rows.len() as u32);
    let mut tally = Tally::new();
    for (part, row) in rows.iter().enumerate() {
        let n = context.replicates(200_000, 2_000);
        let radii: Vec<f64> =
            confusion(row, context.seed_of(part as u64, 0), n).iter().map(|p| f64::from(p.length())).collect();
        let (c, rounding) = (row.px, place_rounding(row));
        let largest = radii.iter().copied().fold(0.0, f64::max);
        tally.fact(format!("c = {c:.3} pixels: the farthest ray at {largest:.3}"), largest <= c + rounding + 1e-6 * c);
        if c > 0.0 {
            let squares: Vec<f64> = radii.iter().map(|r| r * r).collect();
            tally.verdict(format!("c = {c:.3} pixels: E r"), &t_test(&radii, 2.0 * c / 3.0, family), c);
            tally.verdict(format!("c = {c:.3} pixels: E r²"), &t_test_of_squares(&squares, c * c / 2.0, family), c * c);
        }
    }
    tally.finish()
}

/// Catches a lens off its centre, or a focus point off the chief ray, by 1 % of the circle of confusion.
fn chief_ray(context: &Context) -> Finding {
    let rows: Vec<BlurRow> = blurs().into_iter().filter(|row| row.px > 0.0).collect();
    let family = context.family(2 * rows.len() as u32);
    let mut tally = Tally::new();
    for (part, row) in rows.iter().enumerate() {
        let points = confusion(row, context.seed_of(part as u64, 0), context.replicates(200_000, 2_000));
        for (axis, name) in ["x", "y"].into_iter().enumerate() {
            let offsets: Vec<f64> = points.iter().map(|p| f64::from(p[axis])).collect();
            let verdict = t_test(&offsets, 0.0, family);
            tally.verdict(format!("c = {:.3} pixels: mean {name}", row.px), &verdict, row.px);
        }
    }
    tally.finish()
}

/// Columns of the edge's image, and where in it the edge is.
const WIDTH: u32 = 64;
const EDGE: f64 = 32.25;

/// A glowing half-plane at depth z that covers image positions right of `edge` pixels.
fn edge_scene(lens: &ThinLens, fov_degrees: f64, size: (u32, u32), z: f64, edge: f64) -> Scene {
    let half = libm::tan(0.5 * fov_degrees.to_radians());
    // Image x runs along dir × up = −x; one pixel is 2 z half / height wide.
    let x = -(edge - f64::from(size.0) / 2.0) * 2.0 * z * half / f64::from(size.1);
    let reach = 40.0 * z;
    let mut room = Room::default();
    let corners = [(x, -reach), (x, reach), (x - reach, reach), (x - reach, -reach)];
    room.light(&corners.map(|(x, y)| Vec3::new(x as f32, y as f32, z as f32)), 1.0);
    room.scene(&camera(lens, fov_degrees), size, Stage::Final)
}

/// Mean of the edge's profile over the pixel `[column, column + 1]`, `blur` pixels in radius.
fn exact_edge_pixel(column: u32, edge: f64, blur: f64) -> f64 {
    let from = f64::from(column);
    if blur == 0.0 {
        return (from + 1.0 - edge).clamp(0.0, 1.0);
    }
    let profile = |x: f64| disc_share((x - edge) / blur);
    let breaks = [edge - blur, edge + blur];
    integrate(profile, [from, from + 1.0], &breaks, Tolerance::absolute(1e-12)).map_or(f64::NAN, |e| e.value)
}

/// The edge's image by independent samples, and how many each pixel took.
fn edge_image(context: &Context, row: &BlurRow, part: usize) -> (Vec<f64>, u32) {
    let spp = context.replicates(24, 4);
    let scene = edge_scene(&row.lens, row.fov_degrees, (WIDTH, row.height_px), row.depth, EDGE);
    (grey(&rendered(&scene, spec("uniform"), spp, context.seed_of(part as u64, 0))), spp)
}

/// Samples are independent and 0 or 1, so the count in a column is binomial with the disc's share averaged over the pixel, and
/// Clopper and Pearson's interval tests it exactly, also where hardly any sample is lit. Catches 2 to 6 % of the contrast in a column.
fn defocused_edge(context: &Context) -> Finding {
    let rows = blurs();
    let family: Family = context.family(rows.len() as u32 * WIDTH);
    let mut tally = Tally::new();
    for (part, row) in rows.iter().enumerate() {
        let (image, spp) = edge_image(context, row, part);
        let trials = f64::from(row.height_px * spp);
        for column in 0..WIDTH {
            let exact = exact_edge_pixel(column, EDGE, row.px);
            let lit: f64 = image.iter().skip(column as usize).step_by(WIDTH as usize).sum::<f64>() * f64::from(spp);
            let lit = lit.round();
            let [low, high] = clopper_pearson(lit as u64, trials as u64, 1.0 - family.per_test());
            let what = format!("c = {:.3}, column {column}: {exact:.5} in {low:.5} to {high:.5}", row.px);
            // Of the pixel, not of its share: the outermost shares are tiny.
            tally.verdict(what, &binomial_test(lit as u64, trials as u64, exact, family), 1.0);
        }
    }
    tally
        .saying("64 columns of five edges, each within its Clopper–Pearson interval; beyond the blur all samples agree")
}

/// The edge's place is the mean of Σ (1 − value) along a row. Catches a shift of a tenth of the blur's radius, half a pixel at most.
fn edge_place(context: &Context) -> Finding {
    let rows = blurs();
    let family = context.family(rows.len() as u32);
    let mut tally = Tally::new();
    for (part, row) in rows.iter().enumerate() {
        let (image, _) = edge_image(context, row, part);
        let places: Vec<f64> =
            image.chunks_exact(WIDTH as usize).map(|row| row.iter().map(|v| 1.0 - v).sum()).collect();
        tally.verdict(format!("c = {:.3} pixels", row.px), &t_test(&places, EDGE, family), 1.0);
    }
    tally.finish()
}

/// Measured along the ray, the plane of focus would lie at f cos there, and the edge would spread over more than its own column.
fn focus_plane(context: &Context) -> Finding {
    let lens = ThinLens { radius: 0.25, focal_depth: 2.0 };
    let (edge, size) = (92.5, (100, 100));
    let image = rendered(&edge_scene(&lens, 90.0, size, 2.0, edge), spec("ld"), 16, context.seed);
    let blurred = grey(&image)
        .iter()
        .enumerate()
        .filter(|(at, value)| {
            let column = at % 100;
            column != 92 && **value != if column < 92 { 0.0 } else { 1.0 }
        })
        .count();
    let cosine = 1.0 / libm::hypot(1.0, (edge - 50.0) / 50.0);
    let along_the_ray = ThinLens { focal_depth: lens.focal_depth * cosine, ..lens };
    let wrong = along_the_ray.blur_radius_px(lens.focal_depth, 90.0, 100.0);
    let mut tally = Tally::new();
    tally.fact(format!("{blurred} pixels beside the edge's column are neither 0 nor 1"), blurred == 0);
    tally.fact(format!("measured along the ray it would spread over {wrong:.2} pixels"), wrong > 1.5);
    tally.saying(format!(
        "42 pixels off the axis the edge is sharp; focused along the ray it would be {wrong:.2} pixels wide"
    ))
}

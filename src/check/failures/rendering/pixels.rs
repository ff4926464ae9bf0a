//! Rows 60 and 61: points on an edge that two pixels or two triangles share, and a coverage formula that is 0/0.

use glam::{Vec2, Vec3};

use super::{CAMERA, Check, Context, Finding, row};
use crate::analytic::pixel_coverage;
use crate::check::room::{Room, grey, looking_at, rendered, spec};
use crate::check::{Kind, Tally};
use crate::scene::compile::{Scene, Stage};

/// The checks of this file.
pub fn checks() -> Vec<Check> {
    vec![
        row(
            CAMERA,
            &[60],
            "shared-edges",
            "points exactly on an edge that two triangles share belong to one of them: tiles sum to 1, where two closed ones sum to more",
            Kind::Exact,
            shared_edges,
        ),
        row(
            CAMERA,
            &[60],
            "pixels-tile",
            "coverages of all pixels sum to the whole picture's, also for edges through pixel corners",
            Kind::Exact,
            pixels_tile,
        ),
        row(
            CAMERA,
            &[61],
            "coverage-limit",
            "the coverage formula of squares loses all its digits at a = 1e-12; ours is the limit a = 0 to 1e-12",
            Kind::Exact,
            coverage_limit,
        ),
    ]
}

/// Two halves of the plane z = 1 on either side of a line through the middle of the picture, each with its albedo or not there.
fn halves(along: Vec2, albedos: [Option<f32>; 2]) -> Scene {
    let mut room = Room::default();
    let inwards = Vec2::new(-along.y, along.x);
    for (side, albedo) in [1.0, -1.0].into_iter().zip(albedos) {
        let Some(albedo) = albedo else { continue };
        let material = room.material(albedo, None);
        let corner = |p: Vec2| Vec3::new(p.x, p.y, 1.0);
        let (a, b) = (along * 8.0, along * -8.0);
        room.triangle([corner(a), corner(b), corner(inwards * side * 16.0)], material);
    }
    room.scene(&looking_at(Vec3::ZERO, Vec3::Z, 90.0), (8, 8), Stage::Aa)
}

/// Unrandomised sets put points on pixel borders and centres. The line runs along pixel borders, and through pixels by their diagonals.
fn shared_edges(_: &Context) -> Finding {
    let mut tally = Tally::new();
    let mut doubled_most = 0.0;
    for along in [Vec2::X, Vec2::Y, Vec2::ONE, Vec2::new(1.0, -1.0)] {
        for (sampler, spp) in [("hammersley:step:none", 64), ("halton:joint:none", 64), ("center", 1)] {
            let image = |albedos| grey(&rendered(&halves(along, albedos), spec(sampler), spp, 1));
            let sum = |a: [Option<f32>; 2], b: [Option<f32>; 2]| -> Vec<f64> {
                image(a).iter().zip(image(b)).map(|(a, b)| a + b).collect()
            };
            let tiled = sum([Some(1.0), Some(0.0)], [Some(0.0), Some(1.0)]);
            let off = tiled.iter().filter(|&&s| s != 1.0).count();
            tally.fact(format!("along {along}, {sampler}: {off} of 64 pixels do not sum to 1"), off == 0);
            let alone = sum([Some(1.0), None], [None, Some(1.0)]);
            let least = alone.iter().copied().fold(f64::INFINITY, f64::min);
            tally.fact(format!("along {along}, {sampler}: nothing slips between, least sum {least}"), least >= 1.0);
            doubled_most = alone.iter().copied().fold(doubled_most, f64::max);
        }
    }
    tally.fact(format!("each half alone is closed: sums of up to {doubled_most}"), doubled_most > 1.0);
    tally.saying(format!("12 tilings sum to 1 in every pixel; halves drawn alone sum to up to {doubled_most}"))
}

/// 8 × 8 pixels under one edge: its coverage of each, and of the whole. The same for the other side of the edge.
fn pixels_tile(_: &Context) -> Finding {
    let mut tally = Tally::new();
    for (a, b) in [(1.0, 0.0), (0.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (2.0, -3.0), (1e-12, 1.0), (0.3, 0.7)] {
        for c in [0.0, 1.0, 3.5, 4.0, -2.0, 7.0] {
            let pixel = |i: u32| {
                let (x, y) = (f64::from(i % 8), f64::from(i / 8));
                let level = c - a * x - b * y;
                let both = pixel_coverage(a, b, level) + pixel_coverage(-a, -b, -level);
                (pixel_coverage(a, b, level), both)
            };
            let pixels: Vec<(f64, f64)> = (0..64).map(pixel).collect();
            let sum: f64 = pixels.iter().map(|p| p.0).sum();
            let whole = 64.0 * pixel_coverage(8.0 * a, 8.0 * b, c);
            // 64 coverages, each to 1e-14.
            tally.near(format!("{a} x + {b} y ≤ {c}: sum over pixels"), sum, whole, 64e-14);
            // An edge along a border belongs to both closed sides, and has no area.
            let off = pixels.iter().map(|p| (p.1 - 1.0).abs()).fold(0.0, f64::max);
            tally.near(format!("{a} x + {b} y ≤ {c}: both sides of the edge"), off, 0.0, 1e-14);
        }
    }
    tally.saying("42 edges over 8 × 8 pixels: sums to 64e-14, both sides to 1e-14")
}

/// [c₊² − (c−a)₊² − (c−b)₊² + (c−a−b)₊²] / (2ab), literally.
fn by_squares(a: f64, b: f64, c: f64) -> f64 {
    let square = |v: f64| v.max(0.0) * v.max(0.0);
    (square(c) - square(c - a) - square(c - b) + square(c - a - b)) / (2.0 * a * b)
}

fn coverage_limit(_: &Context) -> Finding {
    let mut tally = Tally::new();
    let mut worst: f64 = 0.0;
    for c in [0.1, 0.3, 0.5, 0.7, 0.9] {
        for a in [1e-12, -1e-12, 1e-300, 0.0] {
            // The edge's mean height is c − a/2.
            tally.near(format!("a = {a:e}, c = {c}"), pixel_coverage(a, 1.0, c), c, 1e-12);
            tally.near(format!("b = {a:e}, c = {c}"), pixel_coverage(1.0, a, c), c, 1e-12);
        }
        worst = worst.max((by_squares(1e-12, 1.0, c) - c).abs());
        let moderate = (by_squares(0.3, 0.8, c) - pixel_coverage(0.3, 0.8, c)).abs();
        tally.near(format!("both agree where nothing cancels, c = {c}"), moderate, 0.0, 1e-14);
    }
    tally.fact(format!("the squares err by {worst:.1e} at a = 1e-12"), worst > 1e-6);
    tally.fact("and are 0/0 at a = 0", by_squares(0.0, 1.0, 0.5).is_nan());
    tally.saying(format!(
        "a = 1e-12: ours within 1e-12 of the limit, the formula of squares off by {worst:.1e}; at 0 it is 0/0"
    ))
}

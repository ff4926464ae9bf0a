//! `bokeh`: a teapot in focus at night, lamps, a fence and a twig far out of focus.

use std::path::Path;

use glam::DVec3;
use sampler_lab::error::Result;

use super::marble::mix;
use super::obj::{Material, Obj};
use super::solids::Place;
use super::teapot::Teapot;

const ABOUT: &str =
    "A teapot in focus at night; lamps, a fence and a twig out of focus. The teapot is Martin Newell's (1975).
Made by examples/make_scenes.";

const MATERIALS: [Material<'static>; 10] = [
    Material { name: "plank_brown", lines: "Kd 0.2 0.11 0.06" },
    Material { name: "plank_dark", lines: "Kd 0.13 0.07 0.04" },
    Material { name: "teapot", lines: "Kd 0.62 0.17 0.06" },
    Material { name: "fence", lines: "Kd 0.06 0.07 0.08" },
    Material { name: "needle", lines: "Kd 0.16 0.3 0.1" },
    Material { name: "moon_light", lines: "Kd 0.9 0.95 1\nKe 20 20 20" },
    Material { name: "lamp_gold", lines: "Kd 1 0.5 0.1\nKe 24 24 24" },
    Material { name: "lamp_white", lines: "Kd 1 0.8 0.5\nKe 17 17 17" },
    Material { name: "lamp_red", lines: "Kd 1 0.12 0.08\nKe 24 24 24" },
    Material { name: "lamp_teal", lines: "Kd 0.06 0.6 0.7\nKe 20 20 20" },
];

/// Where the camera is, to the numbers of its config: lamps and needles turn their flat side there.
const EYE: DVec3 = DVec3::new(0.0, 2.6, -7.5);

/// Writes the scene's files into `folder`.
///
/// # Errors
/// Kind `Write` where a file cannot be written.
pub fn write(folder: &Path) -> Result<()> {
    let mut obj = Obj::new(4);
    add_table(&mut obj);
    obj.object("teapot", "teapot");
    let place = Place { origin: DVec3::new(1.2, 0.0, 0.0), scale: 0.55, turn_degrees: 206.0 };
    Teapot::published().add(&mut obj, &place, 12);
    add_fence(&mut obj);
    add_twig(&mut obj);
    add_lamps(&mut obj);
    add_moon(&mut obj);
    obj.write(folder, "bokeh", ABOUT, &MATERIALS)
}

/// Planks that run away from the camera, through the plane of focus.
fn add_table(obj: &mut Obj) {
    for (plank, name) in [(0, "plank_brown"), (1, "plank_dark")] {
        obj.object(name, name);
        for i in -12..12 {
            if i & 1 == plank {
                let (left, right) = (f64::from(i) * 0.75, f64::from(i + 1) * 0.75);
                let corners = [[left, -6.0], [left, 4.0], [right, 4.0], [right, -6.0]];
                obj.flat_quad(corners.map(|[x, z]| DVec3::new(x, 0.0, z)));
            }
        }
    }
}

/// Crossed slats between the nearer and the farther lamps.
fn add_fence(obj: &mut Obj) {
    const DEPTH: f64 = 9.0;
    obj.object("fence", "fence");
    let mut slat = |from: [f64; 2], to: [f64; 2]| {
        let (from, to) = (DVec3::new(from[0], from[1], DEPTH), DVec3::new(to[0], to[1], DEPTH));
        let half = (to - from).normalize().cross(DVec3::Z) * 0.06;
        obj.flat_quad([from + half, to + half, to - half, from - half]);
    };
    for i in -8..=8 {
        let x = f64::from(i) * 1.5;
        slat([x - 3.0, -4.0], [x + 3.0, 2.0]);
        slat([x + 3.0, -4.0], [x - 3.0, 2.0]);
    }
}

/// A number in [0, 1) that belongs to two names.
fn chance(name: u32, which: u32) -> f64 {
    f64::from(mix(which ^ mix(name))) / 4_294_967_296.0
}

/// A twig with needles between the camera and the plane of focus.
fn add_twig(obj: &mut Obj) {
    const NEEDLES: u32 = 55;
    obj.object("twig", "needle");
    for (name, from, to) in [
        (1, DVec3::new(-3.5, 3.9, -1.4), DVec3::new(-1.7, 2.6, -1.6)),
        (2, DVec3::new(-3.1, 3.6, -1.5), DVec3::new(-2.9, 2.2, -1.7)),
    ] {
        add_blade(obj, from, to, 0.025);
        let ahead = (to - from).normalize();
        let side = ahead.cross(DVec3::Z).normalize();
        for i in 0..NEEDLES {
            let number = name * NEEDLES + i;
            let foot = from.lerp(to, (f64::from(i) + 0.5) / f64::from(NEEDLES));
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * chance(number, 1));
            let away = side * cos + side.cross(ahead) * sin;
            let needle = (ahead * 0.7 + away).normalize() * (0.35 + 0.15 * chance(number, 2));
            add_blade(obj, foot, foot + needle, 0.01);
        }
    }
}

/// A thin blade from `from` to `tip`, a third as wide there, its flat side to the camera.
fn add_blade(obj: &mut Obj, from: DVec3, tip: DVec3, half_width: f64) {
    let half = (tip - from).cross(EYE - from).normalize() * half_width;
    obj.flat_quad([from - half, from + half, tip + half / 3.0, tip - half / 3.0]);
}

/// A rectangle high at the left, the only light that reaches the teapot's front.
fn add_moon(obj: &mut Obj) {
    let target = DVec3::new(1.2, 0.8, 0.0);
    let centre = DVec3::new(-6.5, 6.5, -6.0);
    let ahead = (target - centre).normalize();
    let across = DVec3::Y.cross(ahead).normalize() * 1.2;
    let up = ahead.cross(across.normalize()) * 1.2;
    obj.object("moon_light", "moon_light");
    obj.flat_quad([centre - across - up, centre + across - up, centre + across + up, centre - across + up]);
}

/// A string of lamps that hangs between two points.
struct LampString {
    from: DVec3,
    to: DVec3,
    /// How far its middle hangs below the straight line.
    sag: f64,
    lamp_radius: f64,
    lamps: u32,
}

/// Three behind, and one that comes from behind through the plane of focus toward the camera.
const STRINGS: [LampString; 4] = [
    LampString {
        from: DVec3::new(-7.5, 4.6, 11.0),
        to: DVec3::new(8.5, 5.2, 13.0),
        sag: 1.6,
        lamp_radius: 0.14,
        lamps: 9,
    },
    LampString {
        from: DVec3::new(-8.5, 1.6, 14.0),
        to: DVec3::new(8.0, 2.0, 12.0),
        sag: 0.9,
        lamp_radius: 0.14,
        lamps: 8,
    },
    LampString {
        from: DVec3::new(-9.0, -1.4, 13.0),
        to: DVec3::new(9.0, -1.2, 15.0),
        sag: 0.4,
        lamp_radius: 0.15,
        lamps: 8,
    },
    LampString {
        from: DVec3::new(3.6, 3.5, 9.0),
        to: DVec3::new(-1.0, 3.3, -5.2),
        sag: 0.9,
        lamp_radius: 0.06,
        lamps: 10,
    },
];

fn add_lamps(obj: &mut Obj) {
    for (colour, name) in [(0, "lamp_gold"), (1, "lamp_white"), (2, "lamp_red"), (3, "lamp_teal")] {
        obj.object(name, name);
        for (string, number) in STRINGS.iter().zip(0..) {
            for i in 0..string.lamps {
                let lamp = 100 * number + i;
                // Gold and white are twice as common.
                if [0, 1, 2, 0, 1, 3][(i * 5 + 2 * number) as usize % 6] == colour {
                    let t = (f64::from(i) + 0.5 + 0.6 * (chance(lamp, 3) - 0.5)) / f64::from(string.lamps);
                    let hang = DVec3::Y * (4.0 * string.sag * t * (1.0 - t));
                    add_lamp(obj, string.from.lerp(string.to, t) - hang, string.lamp_radius);
                }
            }
        }
    }
}

/// A hexagon that looks at the camera.
fn add_lamp(obj: &mut Obj, centre: DVec3, radius: f64) {
    let ahead = (EYE - centre).normalize();
    let right = DVec3::Y.cross(ahead).normalize();
    let up = ahead.cross(right);
    let rim: [DVec3; 6] = std::array::from_fn(|i| {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * i as f64 / 6.0);
        centre + (right * cos + up * sin) * radius
    });
    obj.flat_quad([rim[0], rim[1], rim[2], rim[3]]);
    obj.flat_quad([rim[0], rim[3], rim[4], rim[5]]);
}

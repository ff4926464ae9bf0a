//! `many-lights`: a hall of pillars with 72 lamps whose powers fall over four and a half orders of magnitude.

use std::path::Path;

use glam::DVec3;
use sampler_lab::error::Result;

use super::marble::mix;
use super::obj::{Material, Obj};

const ABOUT: &str =
    "A hall of pillars under 72 lamps, each a light of its own; lamp i has 10^(-4.5 i/71) of the strongest one's power.
Made by examples/make_scenes.";

const SURFACES: [Material<'static>; 4] = [
    Material { name: "floor", lines: "Kd 0.6 0.58 0.54" },
    Material { name: "wall", lines: "Kd 0.55 0.5 0.45" },
    Material { name: "pillar", lines: "Kd 0.7 0.68 0.64" },
    Material { name: "shade", lines: "Kd 0.2 0.17 0.13" },
];

/// Number of lamps.
const LAMPS: u32 = 72;

/// Orders of magnitude between the strongest and the weakest lamp.
const DECADES: f64 = 4.5;

/// The hall reaches from −HALF to HALF in x, from 0 to DEPTH in z.
const HALF: f64 = 8.0;
const DEPTH: f64 = 16.0;
const HEIGHT: f64 = 7.0;

/// Writes the scene's files into `folder`.
///
/// # Errors
/// Kind `Write` where a file cannot be written.
pub fn write(folder: &Path) -> Result<()> {
    let mut obj = Obj::new(6);
    add_hall(&mut obj);
    add_pillars(&mut obj);
    let lamps: Vec<Lamp> = (0..LAMPS).map(Lamp::new).collect();
    add_shades(&mut obj, &lamps);
    let lamps: Vec<(String, String)> = lamps.iter().map(|lamp| lamp.add(&mut obj)).collect();
    let lamps = lamps.iter().map(|(name, lines)| Material { name, lines });
    obj.write(folder, "many-lights", ABOUT, &SURFACES.into_iter().chain(lamps).collect::<Vec<_>>())
}

fn add_hall(obj: &mut Obj) {
    let at = DVec3::new;
    obj.object("floor", "floor");
    obj.flat_quad([at(-HALF, 0.0, -4.0), at(-HALF, 0.0, DEPTH), at(HALF, 0.0, DEPTH), at(HALF, 0.0, -4.0)]);
    obj.object("walls", "wall");
    obj.flat_quad([at(-HALF, 0.0, DEPTH), at(-HALF, HEIGHT, DEPTH), at(HALF, HEIGHT, DEPTH), at(HALF, 0.0, DEPTH)]);
    obj.flat_quad([at(-HALF, 0.0, -4.0), at(-HALF, HEIGHT, -4.0), at(-HALF, HEIGHT, DEPTH), at(-HALF, 0.0, DEPTH)]);
    obj.flat_quad([at(HALF, 0.0, -4.0), at(HALF, 0.0, DEPTH), at(HALF, HEIGHT, DEPTH), at(HALF, HEIGHT, -4.0)]);
}

/// Where pillars stand, (x, z): 5 rows of 5.
fn pillars() -> impl Iterator<Item = [f64; 2]> {
    (0..25).map(|i| [f64::from(i % 5) * 3.0 - 6.0, 1.6 + 3.0 * f64::from(i / 5)])
}

/// Pillars of four heights, most of them broken off.
fn add_pillars(obj: &mut Obj) {
    obj.object("pillars", "pillar");
    for (i, [x, z]) in (16..).zip(pillars()) {
        add_box(obj, DVec3::new(x, 0.0, z), 0.4, [4.0, 1.0, 3.0, 2.0][mix(i) as usize % 4]);
    }
}

/// An upright box without a bottom on the floor at `foot`.
fn add_box(obj: &mut Obj, foot: DVec3, half: f64, height: f64) {
    let at = |x: f64, y: f64, z: f64| foot + DVec3::new(x * half, y * height, z * half);
    let ring = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    for i in 0..4_usize {
        let ((ax, az), (bx, bz)) = (ring[i], ring[(i + 1) % 4]);
        obj.flat_quad([at(ax, 0.0, az), at(ax, 1.0, az), at(bx, 1.0, bz), at(bx, 0.0, bz)]);
    }
    obj.flat_quad([at(-1.0, 1.0, -1.0), at(-1.0, 1.0, 1.0), at(1.0, 1.0, 1.0), at(1.0, 1.0, -1.0)]);
}

/// A square that looks down.
struct Lamp {
    number: u32,
    /// The corner of least x and z.
    corner: DVec3,
    side: f64,
    colour: [f64; 3],
    strength: f64,
}

impl Lamp {
    /// Lamp `i`. Side and height fall with the fourth root of the power, the emission with its square root: a weak lamp hangs
    /// low, and its pool of light is small and faint, but brighter than what the others leave there in a pillar's shadow.
    fn new(i: u32) -> Self {
        let power = libm::pow(10.0, -DECADES * f64::from(i) / f64::from(LAMPS - 1));
        let size = power.sqrt().sqrt();
        // To whole 64ths, which are exact in f32: so its two triangles are one square to the last bit.
        let snapped = |x: f64| (x * 64.0).round() / 64.0;
        let (side, height) = (snapped(0.6 * size), 5.6 * size);
        // Points of a rank-1 lattice: near each other in number, far from each other on the floor.
        let unit = |step: f64, shift: f64| (f64::from(i) * step + shift).fract();
        let (x, z) = ((2.0 * unit(0.754_877_666, 0.5) - 1.0) * 7.0, unit(0.569_840_291, 0.3) * 18.0 - 3.0);
        // A lamp does not hang in a pillar.
        let x = if pillars().any(|[px, pz]| (x - px).abs().max((z - pz).abs()) < 0.4 + side) { x + 1.5 } else { x };
        let [r, g, b] = colour(f64::from(i) * 0.618_034, 0.25 + 0.6 * (1.0 - size));
        // Power is area × luma of what is emitted, and that is colour × strength.
        let strength = 9.0 * power / (side * side * (0.2126 * r + 0.7152 * g + 0.0722 * b));
        let corner = DVec3::new(snapped(x - side / 2.0), height, snapped(z - side / 2.0));
        Self { number: i, corner, side, colour: [r, g, b], strength }
    }

    /// Adds the square; its material's name and lines.
    fn add(&self, obj: &mut Obj) -> (String, String) {
        let name = format!("lamp_{:02}", self.number);
        obj.object(&name, &name);
        let at = |x: f64, z: f64| self.corner + DVec3::new(x, 0.0, z) * self.side;
        obj.flat_quad([at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]);
        let ([r, g, b], strength) = (self.colour, self.strength);
        (name, format!("Kd {r:.3} {g:.3} {b:.3}\nKe {strength:.5} {strength:.5} {strength:.5}"))
    }
}

/// A lid over each lamp, which hides it from the camera above: a lamp that is seen would make the place in the pixel, and
/// not the choice among lights, what matters.
fn add_shades(obj: &mut Obj, lamps: &[Lamp]) {
    obj.object("shades", "shade");
    for Lamp { corner, side, .. } in lamps {
        let at = |x: f64, z: f64| *corner + DVec3::new(x, 1.0 / 256.0, z) * *side;
        let (low, high) = (-0.125, 1.125);
        obj.flat_quad([at(low, low), at(low, high), at(high, high), at(high, low)]);
    }
}

/// A colour on the wheel, `turn` in turns, between grey (saturation 0) and pure (1).
fn colour(turn: f64, saturation: f64) -> [f64; 3] {
    std::array::from_fn(|channel| {
        let angle = std::f64::consts::TAU * (turn - channel as f64 / 3.0);
        0.6 * (1.0 - saturation) + saturation * (0.5 + 0.5 * libm::cos(angle))
    })
}

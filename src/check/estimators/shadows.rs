//! Through the whole renderer: blockers, and the choice among several lights. A narrow patch of floor, one independent sample a
//! pixel, so that mean and variance of a *sample* are at hand, with the patch's width in the exact values.

use glam::{DVec3, Vec3};

use super::random::gauss;
use super::{Check, Context, Finding, exact, statistical};
use crate::analytic::{PolygonLight, Receiver, variance_of_one_area_sample};
use crate::check::Tally;
use crate::check::room::{Exact, Room, ceiling, grey, looking_at, parallelogram, polygon_light, rendered, spec};
use crate::scene::compile::{Scene, Stage};
use crate::scene::config::CameraConfig;
use crate::scene::light::LightSet;
use crate::stats::hypothesis::t_test_of_squares;

/// The checks of this file.
pub fn checks() -> Vec<Check> {
    vec![
        statistical(
            "shadow-mean",
            "a light half, a quarter or in its middle hidden by a blocker gives the irradiance of what is visible",
            |context| mean_of(context, &hidden()),
        ),
        statistical(
            "shadow-variance",
            "a sample of a partly hidden light has the variance of uniform sampling, hidden points counted as 0",
            |context| variance_of(context, &hidden()),
        ),
        exact(
            "shadow-umbra",
            "in the umbra every sample is exactly 0; a blocker beyond the light or beside it hides nothing",
            umbra,
        ),
        statistical(
            "light-pick-mean",
            "of several lights one is chosen and divided by its probability: the mean is the sum of all",
            |context| mean_of(context, &[several()]),
        ),
        statistical(
            "light-pick-variance",
            "the variance of a sample of several lights is that of choosing by power and sampling by area",
            |context| variance_of(context, &[several()]),
        ),
        exact(
            "light-pick-shares",
            "each light is chosen with probability area · luma over all, to a step of 2^-24",
            shares,
        ),
        exact(
            "furnace",
            "inside a box of light every pixel is exactly its emission, dim or bright, with and without lens",
            furnace,
        ),
        exact(
            "emitter-seen",
            "a view ray that meets a light returns its emission, from the front and from the back",
            emitter_seen,
        ),
    ]
}

/// Half the floor's size; shadow rays start 2⁻¹⁸ of it above.
const FLOOR: f32 = 4.0;
const ALBEDO: f32 = 0.5;

/// A narrow patch of the floor y = 0 under lights, behind a blocker where there is one.
struct Patch {
    name: &'static str,
    camera: CameraConfig,
    lights: Vec<(Vec<Vec3>, f32)>,
    blocker: Option<Vec<Vec3>>,
}

/// Mean and variance of one sample of a patch.
struct Moments {
    mean: Exact,
    variance: f64,
}

impl Patch {
    fn scene(&self, side: u32) -> Scene {
        let mut room = Room::default();
        room.floor(FLOOR, ALBEDO);
        for (corners, emission) in &self.lights {
            room.light(corners, *emission);
        }
        if let Some(blocker) = &self.blocker {
            let dark = room.material(0.3, None);
            room.polygon(blocker, dark);
        }
        room.scene(&self.camera, (side, side), Stage::Final)
    }

    /// One independent sample a pixel.
    fn samples(&self, side: u32, seed: u64) -> Vec<f64> {
        grey(&rendered(&self.scene(side), spec("uniform"), 1, seed))
    }

    /// What the view ray through (x, y) in −1..1 meets.
    fn receiver(&self, x: f64, y: f64) -> Receiver {
        let [pos, dir, up] = [self.camera.pos, self.camera.dir, self.camera.up].map(|v| v.as_dvec3());
        let dir = dir.normalize();
        let right = dir.cross(up).normalize();
        let half = libm::tan(0.5 * f64::from(self.camera.fov_degrees).to_radians());
        let way = dir + (right * x + right.cross(dir) * y) * half;
        Receiver { point: pos - way * (pos.y / way.y), normal: DVec3::Y }
    }

    /// Exact mean and second moment of one sample, lights lowered by `light` and the blocker by `blocker`: with probabilities pⱼ
    /// by power, Σ Eⱼ and Σ (Varⱼ + Eⱼ²)/pⱼ, by Gauss–Legendre over the patch, over which they are smooth.
    fn moments_with(&self, light: f64, blocker: f64) -> [f64; 2] {
        let lower =
            |corners: &[Vec3], by: f64| corners.iter().map(|c| c.as_dvec3() - DVec3::Y * by).collect::<Vec<_>>();
        let lights: Vec<PolygonLight> = self
            .lights
            .iter()
            .map(|(corners, emission)| PolygonLight {
                corners: lower(corners, light),
                ..polygon_light(corners, *emission)
            })
            .collect();
        let hidden = self.blocker.as_ref().map(|b| lower(b, blocker));
        let power: Vec<f64> = lights.iter().map(|l| l.area() * l.emission).collect();
        let total: f64 = power.iter().sum();
        let (mut mean, mut square) = (0.0, 0.0);
        for &(x, weight_x) in &gauss(3) {
            for &(y, weight_y) in &gauss(3) {
                let at = self.receiver(2.0 * x - 1.0, 2.0 * y - 1.0);
                for (light, power) in lights.iter().zip(&power) {
                    let e = hidden.as_ref().map_or_else(|| light.irradiance(&at), |b| light.irradiance_behind(b, &at));
                    let variance = variance_of_one_area_sample(light, &at, hidden.as_deref());
                    mean += weight_x * weight_y * e;
                    square += weight_x * weight_y * (variance + e * e) * total / power;
                }
            }
        }
        let albedo = f64::from(ALBEDO);
        [albedo * mean, albedo * albedo * square]
    }

    /// The mean's allowance is what the moved ends of shadow rays do to it, see [`crate::check::room::with_allowance`].
    fn moments(&self) -> Moments {
        let [mean, square] = self.moments_with(0.0, 0.0);
        let largest = self.lights.iter().flat_map(|(c, _)| c).fold(0.0, |m: f32, c| m.max(c.abs().max_element()));
        let (start, end) = (f64::from(FLOOR) / 262_144.0, f64::from(largest) / 262_144.0);
        let [moved, _] = self.moments_with(start + end, start);
        let allowance = 1.25 * (moved - mean).abs() + mean / 262_144.0;
        Moments { mean: Exact { value: mean, allowance }, variance: square - mean * mean }
    }
}

/// From below the blockers, 0.004 wide about the origin.
fn narrow() -> CameraConfig {
    looking_at(Vec3::new(0.6, 0.3, 0.0), Vec3::ZERO, 0.35)
}

/// The unit square at height 1 behind blockers at half of that.
fn behind(name: &'static str, blocker: &[(f32, f32)], height: f32) -> Patch {
    let blocker = blocker.iter().map(|&(x, z)| Vec3::new(x, height, z)).collect();
    Patch { name, camera: narrow(), lights: vec![(ceiling(Vec3::Y, 0.5, 0.5).to_vec(), 2.0)], blocker: Some(blocker) }
}

fn hidden() -> [Patch; 3] {
    [
        behind("half hidden", &[(-9.0, -9.0), (0.0, -9.0), (0.0, 9.0), (-9.0, 9.0)], 0.5),
        behind("a quarter hidden", &[(-9.0, -9.0), (0.01, -9.0), (0.01, 0.02), (-9.0, 0.02)], 0.5),
        behind("its middle hidden", &[(-0.1, -0.15), (0.15, -0.1), (0.1, 0.15), (-0.15, 0.1)], 0.5),
    ]
}

/// Three lights whose shares of the power and of the irradiance differ, one of them a mesh; none stands before another.
fn several() -> Patch {
    let pentagon = [(1.0, 0.0), (2.0, 0.0), (2.5, 1.0), (1.5, 2.0), (0.5, 1.0)];
    Patch {
        name: "three lights",
        camera: narrow(),
        lights: vec![
            (ceiling(Vec3::new(2.0, 4.0, -1.5), 0.5, 0.5).to_vec(), 30.0),
            (ceiling(Vec3::new(-0.3, 1.0, 0.0), 0.2, 0.3).to_vec(), 8.0),
            (pentagon.map(|(x, z)| Vec3::new(x, 2.5, z)).to_vec(), 3.0),
        ],
        blocker: None,
    }
}

/// Images of 512 × 512 single samples, 262 144 at the usual effort.
fn side(context: &Context) -> u32 {
    (512.0 * context.effort.sqrt()).round().max(32.0) as u32
}

/// Catches a bias of 2 to 3 %: shadows left out or cast from behind the light, a missing probability of the choice.
fn mean_of(context: &Context, patches: &[Patch]) -> Finding {
    let family = context.family(patches.len() as u32);
    let mut tally = Tally::new();
    for (part, patch) in patches.iter().enumerate() {
        let samples = patch.samples(side(context), context.seed_of(part as u64, 0));
        let exact = patch.moments().mean;
        tally.verdict(patch.name, &exact.test(&samples, family), exact.value);
    }
    tally.finish()
}

/// Catches a variance that is wrong by 2 to 7 %: lights chosen by anything but power, though divided by the right probability.
fn variance_of(context: &Context, patches: &[Patch]) -> Finding {
    let family = context.family(patches.len() as u32);
    let mut tally = Tally::new();
    for (part, patch) in patches.iter().enumerate() {
        let samples = patch.samples(side(context), context.seed_of(part as u64, 1));
        let Moments { mean, variance } = patch.moments();
        let squares: Vec<f64> = samples.iter().map(|s| (s - mean.value).powi(2)).collect();
        tally.verdict(patch.name, &t_test_of_squares(&squares, variance, family), variance);
    }
    tally.finish()
}

/// Catches shadow rays that pass through blockers, or that meet what lies beyond the light.
fn umbra(context: &Context) -> Finding {
    let all = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)];
    let beside = [(-9.0, -9.0), (-0.6, -9.0), (-0.6, 9.0), (-9.0, 9.0)];
    let mut tally = Tally::new();
    for (what, blocker, height, lit) in [
        ("below the light", all, 0.5, false),
        ("beyond the light", all, 1.5, true),
        ("beside the light", beside, 0.5, true),
    ] {
        let samples = behind("", &blocker, height).samples(32, context.seed);
        let bright = samples.iter().filter(|&&s| s > 0.0).count();
        tally.fact(
            format!("blocker {what}: {bright} of {} samples lit", samples.len()),
            bright == if lit { samples.len() } else { 0 },
        );
    }
    tally.finish()
}

/// A probability is a whole number of steps of 2⁻²⁴, one at least, rounded down but for the strongest light's.
fn shares(_: &Context) -> Finding {
    let patch = several();
    let scene = patch.scene(1);
    let Some(LightSet::Many { lights, pmf, cumulative, .. }) = &scene.lights else {
        return Finding::broken("expected three lights to choose from".to_owned());
    };
    let power: Vec<f64> = patch.lights.iter().map(|(c, e)| polygon_light(c, *e).area() * f64::from(*e)).collect();
    let total: f64 = power.iter().sum();
    let mut tally = Tally::new();
    for ((light, &p), power) in lights.iter().zip(pmf).zip(&power) {
        tally.near(format!("probability of {}", light.name), f64::from(p), power / total, 4.0 * 2f64.powi(-24));
    }
    let mut before = 0.0;
    for (&p, &up_to) in pmf.iter().zip(cumulative) {
        tally.near("width of the numbers that choose it", up_to - before, f64::from(p), 0.0);
        before = up_to;
    }
    tally.near("probabilities sum up", before, 1.0, 0.0);
    tally.saying(format!("probabilities {pmf:?}"))
}

/// Catches a clamped sample, a weight on what is seen directly, pixels without samples.
fn furnace(context: &Context) -> Finding {
    let mut tally = Tally::new();
    for emission in [1e-6, 3.25, 1e6] {
        let mut room = Room::default();
        let glow = room.material(1.0, Some(emission));
        for (axis, other) in [(Vec3::X, Vec3::Y), (Vec3::Y, Vec3::Z), (Vec3::Z, Vec3::X)] {
            for side in [-1.0, 1.0] {
                room.polygon(&parallelogram(axis.cross(other) * side, axis * side, other), glow);
            }
        }
        let mut camera = looking_at(Vec3::new(0.3, -0.2, 0.1), Vec3::new(0.4, 0.7, -0.2), 100.0);
        for lens_radius in [0.0, 0.2] {
            camera.lens_radius = lens_radius;
            let scene = room.scene(&camera, (13, 9), Stage::Final);
            for name in ["sobol", "uniform", "halton:sheet"] {
                let image = rendered(&scene, spec(name), 7, context.seed);
                let other = image.pixels.iter().find(|p| **p != [emission; 3]);
                tally.fact(
                    format!("emission {emission}, lens {lens_radius}, {name}: {other:?} is another"),
                    other.is_none(),
                );
            }
        }
    }
    tally.saying("18 images of emission 1e-6, 3.25 and 1e6: every pixel is its emission, bit for bit")
}

/// Catches a light that is black from behind, and an escaped ray that is not black.
fn emitter_seen(context: &Context) -> Finding {
    let mut room = Room::default();
    room.light(&parallelogram(Vec3::ZERO, Vec3::X * 5.0, Vec3::Y * 5.0), 7.5);
    let mut tally = Tally::new();
    for z in [-2.0, 2.0] {
        let camera = looking_at(Vec3::new(0.1, 0.2, z), Vec3::new(0.0, 0.1, 0.0), 60.0);
        let away = CameraConfig { dir: -camera.dir, ..camera };
        for (camera, colour) in [(camera, 7.5), (away, 0.0)] {
            let image = rendered(&room.scene(&camera, (8, 8), Stage::Final), spec("sobol"), 4, context.seed);
            let all = image.pixels.iter().all(|p| *p == [colour; 3]);
            tally.fact(format!("from z = {z} along {}: all pixels are {colour}", camera.dir), all);
        }
    }
    tally.saying("7.5 from both sides, 0 where a ray escapes")
}

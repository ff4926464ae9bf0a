//! Rows 47 to 49: grazing light, a shadow ray that meets the light it aims at, a fixed epsilon. On a floor that is turned, so that
//! no coordinate is exactly 0 by luck.

use glam::{DQuat, DVec3, Vec2, Vec3};

use super::{Check, Context, Finding, LIGHTS, row};
use crate::accel::Ray;
use crate::analytic::{PolygonLight, Receiver};
use crate::check::estimators::scale::{floor_camera, unoccluded};
use crate::check::estimators::uniform_points;
use crate::check::room::{Exact, Room, ceiling, grey, looking_at, rendered, scaled_camera, spec};
use crate::check::{Kind, Tally};
use crate::scene::compile::{Scene, Stage};
use crate::scene::config::CameraConfig;
use crate::scene::geometry::{SurfacePoint, offset_length, surface_point};

/// The checks of this file.
pub fn checks() -> Vec<Check> {
    vec![
        row(
            LIGHTS,
            &[47],
            "grazing-light",
            "at cosines of 1e-2 to 1e-4 every sample sees the light, and the error is below the ray's offset over the light's height",
            Kind::Statistical,
            grazing,
        ),
        row(
            LIGHTS,
            &[48],
            "light-shadows-itself",
            "a shadow ray that ends on the light itself is blocked by it one time in ten or more; ours never, at any scale",
            Kind::Exact,
            light_shadows_itself,
        ),
        row(
            LIGHTS,
            &[49],
            "absolute-epsilon",
            "an epsilon of 1e-4 loses all light at scale 1e-6 and shadows the floor by itself at 1e6; a relative one neither",
            Kind::Exact,
            absolute_epsilon,
        ),
    ]
}

fn turn() -> DQuat {
    DQuat::from_axis_angle(DVec3::new(0.36, 0.48, 0.8), 0.7)
}

fn turned(corners: &[Vec3]) -> Vec<Vec3> {
    corners.iter().map(|&c| (turn() * c.as_dvec3()).as_vec3()).collect()
}

/// A turned floor of this half-size under one turned light, seen by a turned camera.
struct Bench {
    light: Vec<Vec3>,
    room: Room,
    camera: CameraConfig,
}

impl Bench {
    fn new(half: f32, light: &[Vec3], camera: CameraConfig) -> Self {
        let mut room = Room::default();
        let grey = room.material(0.5, None);
        let at = |x: f32, z: f32| Vec3::new(x * half, 0.0, z * half);
        room.polygon(&turned(&[at(-1.0, -1.0), at(-1.0, 1.0), at(1.0, 1.0), at(1.0, -1.0)]), grey);
        let light = turned(light);
        room.light(&light, 2.0);
        let [pos, dir, up] = [camera.pos, camera.dir, camera.up].map(|v| (turn() * v.as_dvec3()).as_vec3());
        Self { light, room, camera: CameraConfig { pos, dir, up, ..camera } }
    }

    fn scene(&self, scale: f32, side: u32) -> Scene {
        self.room.scaled(scale).scene(&scaled_camera(&self.camera, scale), (side, side), Stage::Final)
    }

    /// The share of shadow rays that something blocks, or whose light is behind their start: from `start` of the surface point to
    /// `end` of the light's point and normal.
    fn blocked(
        &self,
        scale: f32,
        seed: u64,
        start: impl Fn(&SurfacePoint) -> Vec3,
        end: impl Fn(Vec3, Vec3) -> Vec3,
    ) -> f64 {
        const RAYS: u32 = 4096;
        let scene = self.scene(scale, 1);
        let c: Vec<Vec3> = self.light.iter().map(|&c| c * scale).collect();
        let front = (c[1] - c[0]).normalize().cross((c[3] - c[0]).normalize());
        let pairs = uniform_points(seed, RAYS).zip(uniform_points(!seed, RAYS));
        let blocked = pairs.filter(|&(place, u): &(Vec2, Vec2)| {
            let view = scene.camera.pinhole_ray(place);
            let hit = scene.accel.closest_one(&view, f32::INFINITY).expect("the floor fills the picture");
            let surface = surface_point(&scene.faces[hit.triangle as usize], &view);
            let origin = start(&surface);
            let direction = end(c[0] + (c[1] - c[0]) * u.x + (c[3] - c[0]) * u.y, front) - origin;
            direction.dot(surface.face_normal) <= 0.0
                || scene.accel.closest_one(&Ray { origin, direction }, 1.0).is_some()
        });
        blocked.count() as f64 / f64::from(RAYS)
    }
}

/// Below a light at height 3, from the side.
fn under_light() -> Bench {
    Bench::new(4.0, &ceiling(Vec3::new(0.3, 3.0, -0.2), 0.5, 0.8), floor_camera())
}

/// A wall light whose middle stands at height `cosine` at distance 0.9.
fn wall(cosine: f32) -> [Vec3; 4] {
    let at = |y: f32, z: f32| Vec3::new(0.9, 0.9 * cosine * y, z);
    [at(0.5, -0.1), at(0.5, 0.1), at(1.5, 0.1), at(1.5, -0.1)]
}

/// The camera looks straight down on a patch that is 1e-3 wide. What the ray's offset of 2⁻¹⁸ of the coordinates may do to the irradiance
/// is what the closed form says of a receiver that much higher: some 0.05, 0.5 and 5 % of it. Catches acne, and a bias of some 1 %
/// beyond that.
fn grazing(context: &Context) -> Finding {
    let cosines = [1e-2, 1e-3, 1e-4_f32];
    let family = context.family(3);
    let camera = CameraConfig { up: Vec3::Z, ..looking_at(Vec3::Y, Vec3::ZERO, 0.05) };
    let mut tally = Tally::new();
    let mut said = Vec::new();
    for (part, cosine) in cosines.into_iter().enumerate() {
        let bench = Bench::new(1.0, &wall(cosine), camera);
        let light = PolygonLight { corners: bench.light.iter().map(|c| c.as_dvec3()).collect(), emission: 2.0 };
        let normal = turn() * DVec3::Y;
        // The floor's two triangles may differ in it.
        let offset = bench.room.mesh.positions[..2].iter().map(offset_length).fold(0.0, f32::max);
        let radiance = |height: f64| 0.5 * light.irradiance(&Receiver { point: normal * height, normal });
        let allowance = 1.1 * (radiance(f64::from(offset)) - radiance(0.0)).abs() + 1e-3 * radiance(0.0);
        let exact = Exact { value: radiance(0.0), allowance };
        let samples = grey(&rendered(&bench.scene(1.0, 256), spec("uniform"), 1, context.seed_of(part as u64, 0)));
        let dark = samples.iter().filter(|&&v| v == 0.0).count();
        tally.fact(format!("cosine {cosine:e}: {dark} of {} samples dark", samples.len()), dark == 0);
        tally.verdict(format!("cosine {cosine:e}"), &exact.test(&samples, family), exact.value);
        let naive = bench.blocked(1.0, context.seed, |s| s.position, |p, _| p * (1.0 - 1e-5));
        tally.fact(format!("cosine {cosine:e}: without offset {naive} is shadowed by the floor itself"), naive > 0.05);
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        said.push(format!(
            "{cosine:e}: {:.2} % ({:.0} % acne without offset)",
            100.0 * (mean / exact.value - 1.0),
            100.0 * naive
        ));
    }
    tally.saying(format!("error at cosine {}", said.join(", ")))
}

/// Five rooms at three scales, one sample a pixel: all are lit.
fn light_shadows_itself(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let side = (64.0 * context.effort.sqrt()).round().max(16.0) as u32;
    for (which, room) in unoccluded().iter().enumerate() {
        for scale in [1e-6, 1.0, 1e6] {
            let scene = room.scaled(scale).scene(&scaled_camera(&floor_camera(), scale), (side, side), Stage::Final);
            let dark = grey(&rendered(&scene, spec("ld"), 4, context.seed)).iter().filter(|&&v| v == 0.0).count();
            tally.fact(format!("room {which}, scale {scale:e}: {dark} pixels dark"), dark == 0);
            let all = grey(&rendered(&scene, spec("uniform"), 1, context.seed)).iter().filter(|&&v| v == 0.0).count();
            tally.fact(format!("room {which}, scale {scale:e}: {all} samples dark"), all == 0);
        }
    }
    let lifted = |s: &SurfacePoint| s.position + s.face_normal * s.offset;
    let on_it = under_light().blocked(1.0, context.seed, lifted, |p, _| p);
    tally.fact(format!("rays that end on the light: {:.1} % blocked", 100.0 * on_it), on_it > 0.1);
    let before_it = under_light().blocked(1.0, context.seed, lifted, |p, front| p + front * (3.5 / 262_144.0));
    tally.fact(format!("rays that end before it: {:.1} % blocked", 100.0 * before_it), before_it == 0.0);
    tally.saying(format!(
        "rays to the light itself: {:.1} % blocked by it; ours: 0 of 15 rooms and scales",
        100.0 * on_it
    ))
}

/// The same shadow rays with a fixed epsilon, and with one of 2⁻¹⁸ of the coordinates.
fn absolute_epsilon(context: &Context) -> Finding {
    let bench = under_light();
    let mut tally = Tally::new();
    let mut said = Vec::new();
    for (scale, least, most) in [(1.0, 0.0, 0.0), (1e-6, 1.0, 1.0), (1e6, 0.1, 1.0)] {
        let seed = context.seed;
        let fixed = |s: &SurfacePoint| s.position + s.face_normal * 1e-4;
        let absolute = bench.blocked(scale, seed, fixed, |p, front| p + front * 1e-4);
        let relative = bench.blocked(
            scale,
            seed,
            |s| s.position + s.face_normal * s.offset,
            |p, front| p + front * (scale * (3.5 / 262_144.0)),
        );
        tally.fact(format!("scale {scale:e}: {absolute} lost with 1e-4"), (least..=most).contains(&absolute));
        tally.fact(format!("scale {scale:e}: {relative} lost with a relative epsilon"), relative == 0.0);
        said.push(format!("{scale:e}: {:.1} %", 100.0 * absolute));
    }
    let image = |scale: f32| grey(&rendered(&bench.scene(scale, 24), spec("sobol"), 16, context.seed));
    let plain = image(1.0);
    for scale in [1e-6, 1e6] {
        let worst = image(scale).iter().zip(&plain).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
        tally.near(format!("scale {scale:e}: largest change of a pixel of ours"), worst, 0.0, 1e-4);
    }
    tally.saying(format!("light lost with an epsilon of 1e-4 at scale {}; ours none", said.join(", ")))
}

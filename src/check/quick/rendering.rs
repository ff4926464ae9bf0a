//! Camera, lights and the mean over a pixel, in scenes of a few triangles built in memory.

use glam::{DVec3, Vec2, Vec3};

use crate::analytic::{PolygonLight, Receiver};
use crate::check::{Check, Context, Finding, Kind, Tally};
use crate::render::{light_contribution, render};
use crate::sampling::hash::{bits64, unit_f32};
use crate::sampling::{Decision, Preset, SampleLayout, Sampler, SamplerSpec};
use crate::scene::camera::{Aperture, Camera, PixelSample};
use crate::scene::compile::{Scene, Stage};
use crate::scene::config::{CameraConfig, SceneConfig};
use crate::scene::geometry::{SurfacePoint, face_normal};
use crate::scene::light::Light;
use crate::scene::mesh::{Material, Mesh};
use crate::scene::scale::scaled;
use crate::stats::t_test;

/// The checks of this room.
pub fn checks() -> Vec<Check> {
    vec![
        Check {
            name: "quick-lights",
            group: "quick",
            claim: "the mean of area samples of a light is Lambert's irradiance, and 0 behind light and surface",
            failures: &[45, 46],
            kind: Kind::Statistical,
            run: lights,
        },
        Check {
            name: "quick-pixels",
            group: "quick",
            claim: "a floor under two unequal lights has the radiance of both, nothing clamped, nothing in its own shadow",
            failures: &[48],
            kind: Kind::Statistical,
            run: pixels,
        },
        Check {
            name: "quick-scale",
            group: "quick",
            claim: "the picture is the same, bit for bit, in units of length 2²⁰ times larger and smaller",
            failures: &[49],
            kind: Kind::Exact,
            run: scales,
        },
        Check {
            name: "quick-camera",
            group: "quick",
            claim: "the image's centre is seen along the axis, the lens has its radius, and its rays meet in the plane of focus",
            failures: &[],
            kind: Kind::Exact,
            run: camera,
        },
    ]
}

/// Corners of the rectangle centre ± half-sizes at one height, counter-clockwise from below: it faces down.
fn ceiling(centre: Vec3, half_x: f32, half_z: f32) -> [Vec3; 4] {
    let (x, z) = (Vec3::X * half_x, Vec3::Z * half_z);
    [centre - x - z, centre + x - z, centre + x + z, centre - x + z]
}

fn exact(corners: &[Vec3], emission: f32, point: Vec3, normal: Vec3) -> f64 {
    let corners = corners.iter().map(|c| c.as_dvec3()).collect();
    let at = Receiver { point: point.as_dvec3(), normal: normal.as_dvec3().normalize() };
    PolygonLight { corners, emission: f64::from(emission) }.irradiance(&at)
}

fn lights(context: &Context) -> Finding {
    let square = ceiling(Vec3::Y, 0.5, 0.5);
    let quad = Light::new(
        "quad".to_owned(),
        Vec3::ONE,
        &[[square[0], square[1], square[2]], [square[0], square[2], square[3]]],
    );
    let corners = [Vec3::new(-0.5, 1.0, -0.5), Vec3::new(2.5, 1.0, -0.5), Vec3::new(-0.5, 1.0, 1.5)];
    let triangle = Light::new("triangle".to_owned(), Vec3::ONE, &[corners]);
    let (quad, triangle) = (quad.expect("it has area"), triangle.expect("it has area"));
    let cases: [(&str, &Light, &[Vec3], Vec3, Vec3); 8] = [
        ("below the centre of a square", &quad, &square, Vec3::ZERO, Vec3::Y),
        ("far below a corner", &quad, &square, Vec3::new(0.5, -2.0, 0.5), Vec3::Y),
        ("tilted", &quad, &square, Vec3::new(0.7, 0.2, 0.0), Vec3::new(-1.0, 1.0, 0.0)),
        ("partly below the horizon", &quad, &square, Vec3::new(0.2, 0.5, 0.0), Vec3::new(1.0, 0.2, 0.0)),
        ("behind the light", &quad, &square, Vec3::new(0.1, 1.7, 0.0), Vec3::NEG_Y),
        ("turned away", &quad, &square, Vec3::ZERO, Vec3::NEG_Y),
        ("below a triangle", &triangle, &corners, Vec3::ZERO, Vec3::Y),
        ("beside a triangle", &triangle, &corners, Vec3::new(-0.5, 0.4, 1.5), Vec3::new(0.3, 1.0, -0.2)),
    ];
    let family = context.family(cases.len() as u32);
    let mut tally = Tally::new();
    for (number, (what, light, corners, point, normal)) in cases.into_iter().enumerate() {
        let normal = normal.normalize();
        let from =
            SurfacePoint { position: point, normal, face_normal: normal, uv: Vec2::ZERO, material: 0, offset: 0.0 };
        let values: Vec<f64> = (0..u64::from(context.replicates(40_000, 4_000)))
            .map(|i| {
                let bits = bits64(context.seed_of(0, number as u64), i);
                let u = Vec2::new(unit_f32(bits as u32), unit_f32((bits >> 32) as u32));
                light_contribution(light, u, &from).map_or(0.0, |(radiance, _)| f64::from(radiance.x))
            })
            .collect();
        let expected = exact(corners, 1.0, point, normal);
        tally.verdict(what, &t_test(&values, expected, family), expected);
    }
    tally.finish()
}

/// A floor about the origin and two lights above it: one large, weak and near, one small, strong and aside.
struct Room {
    config: SceneConfig,
    mesh: Mesh,
}

const WEAK: f32 = 2.0;
const STRONG: f32 = 90.0;
const ALBEDO: f32 = 0.5;

fn two_lights() -> [[Vec3; 4]; 2] {
    [ceiling(Vec3::new(0.3, 1.0, 0.0), 0.5, 0.4), ceiling(Vec3::new(-0.8, 1.5, 0.6), 0.1, 0.2)]
}

impl Room {
    fn new() -> Self {
        let mut config = SceneConfig::parse(b"{}", "a scene in memory", &[]).expect("an empty config is one");
        let eye = Vec3::new(0.0, 0.5, -0.6);
        config.camera =
            CameraConfig { pos: eye, dir: -eye, up: Vec3::Y, fov_degrees: 0.05, lens_radius: 0.0, focal_depth: 1.0 };
        config.auto_focus = false;
        let mut room = Self { config, mesh: Mesh::default() };
        let floor = [(-4.0, -4.0), (-4.0, 4.0), (4.0, 4.0), (4.0, -4.0)].map(|(x, z)| Vec3::new(x, 0.0, z));
        room.quad(floor, None);
        for (corners, emission) in two_lights().into_iter().zip([WEAK, STRONG]) {
            room.quad(corners, Some(emission));
        }
        room
    }

    fn quad(&mut self, corners: [Vec3; 4], emission: Option<f32>) {
        let mesh = &mut self.mesh;
        for triangle in [[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]] {
            mesh.positions.push(triangle);
            mesh.normals.push([face_normal(&triangle); 3]);
            mesh.uvs.push([Vec2::ZERO; 3]);
            mesh.material_of.push(mesh.materials.len() as u32);
        }
        mesh.materials.push(Material {
            name: format!("material {}", mesh.materials.len()),
            file: 0,
            albedo: Vec3::splat(ALBEDO),
            texture: None,
            emission: Vec3::splat(emission.unwrap_or(0.0)),
            is_emitter: emission.is_some(),
        });
    }

    fn scene(&self, unit: f32) -> Scene {
        let (config, mesh) = scaled(&self.config, &self.mesh, unit);
        Scene::new(&config, mesh, (2, 2), Stage::Final).expect("a small scene")
    }
}

fn image(scene: &Scene, spp: u32, seed: u64) -> Result<Vec<[f32; 3]>, String> {
    let spec = SamplerSpec::parse("uniform", Preset::Best).expect("a sampler");
    let sampler = Sampler::new(spec, &scene.layout, spp, seed).expect("a legal count");
    render(scene, &sampler).map(|rendered| rendered.image.pixels).map_err(|bad| bad.to_string())
}

fn pixels(context: &Context) -> Finding {
    let scene = Room::new().scene(1.0);
    // The footprint is 0.0007 wide: E is linear over it but for 10⁻⁷ of its value.
    let [weak, strong] = two_lights();
    let expected =
        f64::from(ALBEDO) * (exact(&weak, WEAK, Vec3::ZERO, Vec3::Y) + exact(&strong, STRONG, Vec3::ZERO, Vec3::Y));
    let replicates = (0..u64::from(context.replicates(300, 100))).map(|i| {
        let pixels = image(&scene, 64, context.seed_of(0, i))?;
        Ok(pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / pixels.len() as f64)
    });
    let replicates: Result<Vec<f64>, String> = replicates.collect();
    let replicates = match replicates {
        Ok(replicates) => replicates,
        Err(bad) => return Finding::broken(bad),
    };
    let mut tally = Tally::new();
    tally.verdict("mean radiance of the floor", &t_test(&replicates, expected, context.family(1)), expected);
    tally.finish()
}

fn scales(context: &Context) -> Finding {
    const UNIT: f32 = 1_048_576.0;
    let room = Room::new();
    let images = [1.0, 1.0 / UNIT, UNIT].map(|unit| image(&room.scene(unit), 64, context.seed));
    let mut tally = Tally::new();
    for (what, other) in ["smaller", "larger"].into_iter().zip(&images[1..]) {
        let same = images[0].is_ok() && *other == images[0];
        tally.fact(format!("a scene 2²⁰ times {what} has the same pixels"), same);
    }
    let lit = images[0].as_ref().is_ok_and(|pixels| pixels.iter().all(|p| p[0] > 0.0));
    tally.fact("the floor is lit", lit);
    tally.saying("256 samples of a floor under two lights: the same bits in all three units")
}

fn camera(_: &Context) -> Finding {
    const RADIUS: f32 = 0.25;
    const FOCUS: f32 = 3.0;
    let mut layout = SampleLayout::default();
    let pixel = PixelSample::Sampled(layout.claim_2d(Decision::Pixel));
    let lens = layout.claim_2d(Decision::Lens);
    let dir = Vec3::new(1.0, -0.5, 2.0);
    let config = CameraConfig {
        pos: Vec3::new(0.2, 0.4, -0.1),
        dir,
        up: Vec3::Y,
        fov_degrees: 60.0,
        lens_radius: RADIUS,
        focal_depth: FOCUS,
    };
    let aperture = Aperture::ThinLens { radius: RADIUS, focal_depth: FOCUS, lens };
    let camera = Camera::new(&config, (8, 6), pixel, aperture);
    let axis = dir.normalize().as_dvec3();
    let mut tally = Tally::new();
    // Roundings of single precision, some 16 of them, in directions and in points at distance 4.
    let rounding = 16.0 * f64::from(f32::EPSILON);
    let central = camera.pinhole_ray(Vec2::new(4.0, 3.0)).direction.as_dvec3();
    tally.near(
        "angle between axis and the ray through the image's centre",
        central.cross(axis).length(),
        0.0,
        rounding,
    );
    let top = camera.pinhole_ray(Vec2::new(4.0, 0.0)).direction.as_dvec3();
    let half = libm::tan(30.0_f64.to_radians());
    tally.near("tangent of half the field of view", top.cross(axis).length() / top.dot(axis), half, rounding);
    let at = Vec2::new(0.5, 1.0);
    let through = camera.pinhole_ray(at).direction.as_dvec3();
    let aim = through * (f64::from(FOCUS) / through.dot(axis));
    let (mut squares, mut furthest, mut miss) = (0.0, 0.0f64, 0.0f64);
    // Midpoint rule on the concentric map: E r² errs by less than 1/k².
    const K: u32 = 64;
    for cell in 0..K * K {
        let u = Vec2::new((cell % K) as f32 + 0.5, (cell / K) as f32 + 0.5) / K as f32;
        let ray = camera.lens_ray(at, u, RADIUS, FOCUS);
        let (start, way) = ((ray.origin - config.pos).as_dvec3(), ray.direction.as_dvec3());
        squares += start.length_squared() / f64::from(K * K);
        furthest = furthest.max(start.length());
        let met: DVec3 = start + way * ((f64::from(FOCUS) - start.dot(axis)) / way.dot(axis));
        miss = miss.max((met - aim).length());
    }
    let square = f64::from(RADIUS * RADIUS);
    tally.near(
        "E r² of the lens in its radius squared",
        squares / square,
        0.5,
        1.0 / f64::from(K * K) + 2.0 * rounding,
    );
    tally.fact(
        format!("the lens reaches {furthest} of its radius {RADIUS}"),
        furthest < f64::from(RADIUS) * (1.0 + rounding),
    );
    tally.near("distance at which rays miss their point in the plane of focus", miss, 0.0, 16.0 * rounding);
    tally.finish()
}

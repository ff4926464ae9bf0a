//! Scenes built in memory, replicates of their pixels, and what the closed forms say about them: for checks and tests.
//!
//! All is grey. What a caller gets wrong here is an error of the program, so these functions panic where the product's return errors.

use glam::{DVec3, Vec2, Vec3};

use crate::analytic::{DiffusePlane, Penumbra, Pinhole, PolygonLight};
use crate::film::Image;
use crate::render::render;
use crate::sampling::{Preset, Sampler, SamplerSpec};
use crate::scene::compile::{Scene, Stage};
use crate::scene::config::{CameraConfig, Estimator, SceneConfig};
use crate::scene::geometry::face_normal;
use crate::scene::mesh::{Material, Mesh};
use crate::stats::{Family, Verdict, t_test};

/// The sampler of a text such as `sobol` or `halton:plain`.
///
/// # Panics
/// Where there is none.
pub fn spec(text: &str) -> SamplerSpec {
    SamplerSpec::parse(text, Preset::Best).unwrap_or_else(|error| panic!("{error}"))
}

/// A mesh under construction.
#[derive(Debug, Clone, Default)]
pub struct Room {
    /// Triangles and materials so far.
    pub mesh: Mesh,
}

impl Room {
    /// A grey material; it emits where `emission` is given.
    pub fn material(&mut self, albedo: f32, emission: Option<f32>) -> u32 {
        let name = format!("material {}", self.mesh.materials.len());
        self.mesh.materials.push(Material {
            name,
            file: 0,
            albedo: Vec3::splat(albedo),
            texture: None,
            emission: Vec3::splat(emission.unwrap_or(0.0)),
            is_emitter: emission.is_some(),
        });
        (self.mesh.materials.len() - 1) as u32
    }

    /// One triangle, counter-clockwise from its front.
    pub fn triangle(&mut self, corners: [Vec3; 3], material: u32) {
        self.mesh.positions.push(corners);
        self.mesh.normals.push([face_normal(&corners); 3]);
        self.mesh.uvs.push([Vec2::ZERO; 3]);
        self.mesh.material_of.push(material);
    }

    /// A flat convex polygon, counter-clockwise from its front, as a fan.
    pub fn polygon(&mut self, corners: &[Vec3], material: u32) {
        for pair in corners[1..].windows(2) {
            self.triangle([corners[0], pair[0], pair[1]], material);
        }
    }

    /// A floor y = 0 of the given half-size that faces up.
    pub fn floor(&mut self, half: f32, albedo: f32) {
        let material = self.material(albedo, None);
        let at = |x: f32, z: f32| Vec3::new(x * half, 0.0, z * half);
        self.polygon(&[at(-1.0, -1.0), at(-1.0, 1.0), at(1.0, 1.0), at(1.0, -1.0)], material);
    }

    /// A light with a material of its own.
    pub fn light(&mut self, corners: &[Vec3], emission: f32) {
        let material = self.material(1.0, Some(emission));
        self.polygon(corners, material);
    }

    /// The scene for an image of `size` (columns, rows), lights weighted without bias.
    ///
    /// # Panics
    /// Where coordinates are too large for single precision.
    pub fn scene(&self, camera: &CameraConfig, size: (u32, u32), stage: Stage) -> Scene {
        self.scene_with(camera, size, stage, Estimator::Unbiased)
    }

    /// As [`Self::scene`], with the estimator named.
    ///
    /// # Panics
    /// As [`Self::scene`].
    pub fn scene_with(&self, camera: &CameraConfig, size: (u32, u32), stage: Stage, estimator: Estimator) -> Scene {
        let config = SceneConfig { camera: *camera, auto_focus: false, estimator, ..SceneConfig::default() };
        Scene::new(&config, self.mesh.clone(), size, stage).unwrap_or_else(|error| panic!("{error}"))
    }

    /// The same room with all lengths multiplied.
    pub fn scaled(&self, scale: f32) -> Self {
        let mut room = self.clone();
        room.mesh.positions.iter_mut().flatten().for_each(|p| *p *= scale);
        room
    }
}

/// Corners of the parallelogram centre ± e1 ± e2, whose front is the side of e1 × e2.
pub fn parallelogram(centre: Vec3, e1: Vec3, e2: Vec3) -> [Vec3; 4] {
    [centre - e1 - e2, centre + e1 - e2, centre + e1 + e2, centre - e1 + e2]
}

/// A rectangle at height y that faces down.
pub fn ceiling(centre: Vec3, half_x: f32, half_z: f32) -> [Vec3; 4] {
    parallelogram(centre, Vec3::X * half_x, Vec3::Z * half_z)
}

/// A pinhole camera at `pos` that looks at `target`.
pub fn looking_at(pos: Vec3, target: Vec3, fov_degrees: f32) -> CameraConfig {
    let dir = target - pos;
    let up = if dir.cross(Vec3::Y).length() > 1e-3 * dir.length() { Vec3::Y } else { Vec3::Z };
    CameraConfig { pos, dir, up, fov_degrees, lens_radius: 0.0, focal_depth: 1.0 }
}

/// The camera of a room whose lengths are all multiplied.
pub fn scaled_camera(camera: &CameraConfig, scale: f32) -> CameraConfig {
    CameraConfig {
        pos: camera.pos * scale,
        lens_radius: camera.lens_radius * scale,
        focal_depth: camera.focal_depth * scale,
        ..*camera
    }
}

/// The image of `spp` samples a pixel.
///
/// # Panics
/// Where a sample is not finite, or the sampler does not draw such a scene.
pub fn rendered(scene: &Scene, sampler: SamplerSpec, spp: u32, seed: u64) -> Image {
    let sampler = Sampler::new(sampler, &scene.layout, spp, seed).unwrap_or_else(|error| panic!("{error}"));
    render(scene, &sampler).unwrap_or_else(|bad| panic!("{bad}")).image
}

/// The image's grey, pixel by pixel.
pub fn grey(image: &Image) -> Vec<f64> {
    image.pixels.iter().map(|p| f64::from(p[0])).collect()
}

/// Whole images under independent seeds: their grey.
pub fn replicates(
    scene: &Scene,
    sampler: SamplerSpec,
    spp: u32,
    seeds: impl IntoIterator<Item = u64>,
) -> Vec<Vec<f64>> {
    seeds.into_iter().map(|seed| grey(&rendered(scene, sampler, spp, seed))).collect()
}

/// The closed form's view of a polygon light.
pub fn polygon_light(corners: &[Vec3], emission: f32) -> PolygonLight {
    PolygonLight { corners: corners.iter().map(|c| c.as_dvec3()).collect(), emission: f64::from(emission) }
}

/// A value from a closed form, and how far off it the renderer may be by moving the ends of shadow rays.
#[derive(Clone, Copy, Debug)]
pub struct Exact {
    /// The closed form's value.
    pub value: f64,
    /// How far off it the expectation may be.
    pub allowance: f64,
}

impl Exact {
    /// The same number for several values that are added up.
    pub fn sum(parts: impl IntoIterator<Item = Self>) -> Self {
        parts.into_iter().fold(Self { value: 0.0, allowance: 0.0 }, |a, b| Self {
            value: a.value + b.value,
            allowance: a.allowance + b.allowance,
        })
    }

    /// A multiple.
    pub fn times(self, factor: f64) -> Self {
        Self { value: self.value * factor, allowance: self.allowance * factor }
    }

    /// Student's t against what the allowance leaves nearest to the replicates' mean. Where a sampler's own error is far below
    /// 10⁻⁵, the displacement of the rays would be found otherwise, and it is there by design.
    pub fn test(self, replicates: &[f64], family: Family) -> Verdict {
        let mean = replicates.iter().sum::<f64>() / replicates.len() as f64;
        t_test(replicates, mean.clamp(self.value - self.allowance, self.value + self.allowance), family)
    }
}

/// Pixels of a soft shadow over a floor y = 0 of the given half-size by their closed form, and what they become where a shadow ray
/// starts 2⁻¹⁸ of the floor's largest coordinate above it and ends as far below the light: seen from the moved point, blocker and
/// light are that much lower. A quarter of the change is added for the rounding of positions (2⁻²² of the coordinates), and 64
/// roundings of single precision.
///
/// # Panics
/// Where the closed form has no value for the scene.
pub fn with_allowance(scene: &Penumbra, floor_half: f64) -> Vec<Exact> {
    let light = scene.light();
    let largest = light.corners.iter().fold(0.0, |m: f64, c| m.max(c.abs().max_element()));
    let (start, end) = (floor_half / 262_144.0, largest / 262_144.0);
    let lower = |corners: &[DVec3], by: f64| corners.iter().map(|&c| c - DVec3::Y * by).collect::<Vec<_>>();
    let moved = PolygonLight { corners: lower(&light.corners, start + end), ..light.clone() };
    let moved = Penumbra::new(*scene.camera(), *scene.plane(), moved, lower(scene.blocker(), start));
    let image = |scene: &Penumbra| scene.image().unwrap_or_else(|error| panic!("{error}"));
    let both = image(scene).into_iter().zip(image(&moved.unwrap_or_else(|error| panic!("{error}"))));
    both.map(|(value, moved)| Exact { value, allowance: 1.25 * (moved - value).abs() + value / 262_144.0 }).collect()
}

/// Exact pixels of a floor y = 0 under one light, behind a blocker where there is one, by quadrature of the closed form
/// over each pixel's square.
///
/// # Panics
/// As [`with_allowance`].
pub fn floor_pixels(
    camera: &CameraConfig,
    (width, height): (u32, u32),
    (floor_half, albedo): (f64, f64),
    light: PolygonLight,
    blocker: Option<&[Vec3]>,
) -> Vec<Exact> {
    let top = light.corners.iter().map(|c| c.y).fold(0.0, f64::max);
    // Beyond the light a blocker blocks nothing.
    let beyond = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0)].map(|(x, z)| DVec3::new(x, 2.0 * top + 9.0, z)).to_vec();
    let pinhole = Pinhole {
        position: camera.pos.as_dvec3(),
        direction: camera.dir.as_dvec3(),
        up: camera.up.as_dvec3(),
        fov_y_degrees: f64::from(camera.fov_degrees),
        width,
        height,
    };
    let plane = DiffusePlane { point: DVec3::ZERO, normal: DVec3::Y, albedo };
    let blocker = blocker.map_or(beyond, |b| b.iter().map(|c| c.as_dvec3()).collect());
    with_allowance(&Penumbra::new(pinhole, plane, light, blocker).unwrap_or_else(|error| panic!("{error}")), floor_half)
}

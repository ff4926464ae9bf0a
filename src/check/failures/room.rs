//! A small scene in memory: a floor seen from above, under one light.

use glam::{Vec2, Vec3};

use crate::film::Image;
use crate::render::render;
use crate::sampling::Sampler;
use crate::scene::compile::{Scene, Stage};
use crate::scene::config::{CameraConfig, SceneConfig};
use crate::scene::geometry::face_normal;
use crate::scene::mesh::{Material, Mesh};

use super::common::spec;

/// Side of the image in pixels.
pub const SIDE: u32 = 16;

/// Every pixel sees the floor, lit by all of the light: pixel and light point are decided, and the radiance is smooth in both.
pub fn floor_under_light() -> Scene {
    let mut mesh = Mesh::default();
    let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let floor = [at(-3.0, 0.0, -3.0), at(-3.0, 0.0, 3.0), at(3.0, 0.0, 3.0), at(3.0, 0.0, -3.0)];
    let light = [at(-0.2, 2.0, -1.0), at(1.4, 2.0, -1.0), at(1.4, 2.0, 1.0), at(-0.2, 2.0, 1.0)];
    for (number, (corners, emission)) in [(floor, 0.0), (light, 5.0)].into_iter().enumerate() {
        mesh.materials.push(Material {
            name: format!("material {number}"),
            file: 0,
            albedo: Vec3::splat(0.7),
            texture: None,
            emission: Vec3::splat(emission),
            is_emitter: emission > 0.0,
        });
        for triangle in [[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]] {
            mesh.positions.push(triangle);
            mesh.normals.push([face_normal(&triangle); 3]);
            mesh.uvs.push([Vec2::ZERO; 3]);
            mesh.material_of.push(number as u32);
        }
    }
    let mut config = SceneConfig::parse(b"{}", "memory", &[]).unwrap_or_else(|e| panic!("{e}"));
    config.camera = CameraConfig {
        pos: at(0.0, 1.5, 0.0),
        dir: at(0.0, -1.0, 0.0),
        up: Vec3::Z,
        fov_degrees: 40.0,
        lens_radius: 0.0,
        focal_depth: 1.0,
    };
    config.auto_focus = false;
    Scene::new(&config, mesh, (SIDE, SIDE), Stage::Final).unwrap_or_else(|e| panic!("{e}"))
}

/// An image of it.
pub fn image(scene: &Scene, sampler: &str, spp: u32, seed: u64) -> Image {
    let sampler = Sampler::new(spec(sampler), &scene.layout, spp, seed).unwrap_or_else(|e| panic!("{e}"));
    render(scene, &sampler).unwrap_or_else(|bad| panic!("{bad}")).image
}

/// The bits of an image.
pub fn bits(image: &Image) -> Vec<u32> {
    image.pixels.iter().flatten().map(|channel| channel.to_bits()).collect()
}

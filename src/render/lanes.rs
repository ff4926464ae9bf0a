//! A packet of samples on its way: numbers, camera rays, surfaces, lights, shadow rays, radiance, a lane for each sample.
//!
//! Everything between the queries is straight arithmetic over all lanes, which [`Kernel::run`](crate::accel::Kernel::run) compiles to
//! vector instructions. What a scene lacks is asked once a packet.

#![allow(clippy::needless_range_loop, reason = "a lane is a column of several rows at once")]

use glam::{Vec2, Vec3};

use crate::accel::{LANES, NOTHING, Packet, Row, column, set_column};
use crate::mutants::{Mutant, planted};
use crate::sampling::{Dim2, PixelKey, PointSource};
use crate::scene::camera::{Aperture, PixelSample};
use crate::scene::compile::Scene;
use crate::scene::geometry::{SurfaceRows, put_one_where, put_where, take};
use crate::scene::light::{LightPoint, LightSet, Parallelogram};

use super::direct::{arrival, choose};

/// Consecutive samples of one pixel, and the lanes they take.
#[derive(Clone, Copy)]
pub(super) struct Span {
    /// The pixel's place in its tile.
    pub pixel: usize,
    pub x: u32,
    pub y: u32,
    pub first: u32,
    pub lane: usize,
    pub count: usize,
}

/// What a scene may have. `benches/features.sh` builds copies that never had one of these, and times both on scenes without it:
/// they must not differ, as a feature that a scene lacks costs one question a packet.
const PIXEL: bool = !cfg!(without = "pixel");
const LENS: bool = !cfg!(without = "lens");
/// Several lights, or one that is no parallelogram.
const LIGHTS: bool = !cfg!(without = "lights");
const TEXTURES: bool = !cfg!(without = "textures");

/// A lane without a ray.
const IDLE: f32 = f32::NEG_INFINITY;

/// Everything a packet of samples needs, kept between packets: nothing is allocated per sample.
#[repr(align(64))]
pub(super) struct Lanes {
    /// Where in its square each pixel is looked at, and the numbers of lens, light pick and light point.
    pixel: [Row; 2],
    lens: [Row; 2],
    pick: Row,
    light: [Row; 2],
    /// The camera rays.
    view: Packet,
    surfaces: SurfaceRows,
    albedo: [Row; 3],
    /// Whether the surface emits: 1 or 0.
    emitter: [u32; LANES],
    shadow: Packet,
    pub radiance: [Row; 3],
    used: usize,
    pub ray_count: u64,
}

impl Default for Lanes {
    fn default() -> Self {
        let (two, three) = ([[0.5; LANES]; 2], [[0.0; LANES]; 3]);
        Self {
            pixel: two,
            lens: two,
            pick: [0.0; LANES],
            light: two,
            view: Packet::default(),
            surfaces: SurfaceRows::default(),
            albedo: three,
            emitter: [0; LANES],
            shadow: Packet::default(),
            radiance: three,
            used: 0,
            ray_count: 0,
        }
    }
}

impl Lanes {
    /// Traces the samples of `spans`, which fill the lanes from the first on.
    #[inline(always)]
    pub fn sample<S: PointSource>(&mut self, scene: &Scene, source: &S, spans: &[Span]) {
        self.used = spans.last().map_or(0, |s| s.lane + s.count);
        self.look_up(scene, source, spans);
        self.aim(scene, spans);
        scene.accel.closest(&mut self.view);
        self.ray_count += self.used as u64;
        self.shade(scene);
    }

    /// Reads the spans' numbers, for the decisions that the scene makes.
    #[inline(always)]
    pub(super) fn look_up<S: PointSource>(&mut self, scene: &Scene, source: &S, spans: &[Span]) {
        let pixel = match &scene.camera.pixel {
            PixelSample::Sampled(dim) if PIXEL => Some(dim),
            _ => None,
        };
        let lens = match &scene.camera.aperture {
            Aperture::ThinLens { lens, .. } if LENS => Some(lens),
            _ => None,
        };
        let (pick, light) = match &scene.lights {
            Some(LightSet::One { point, .. }) => (None, Some(point)),
            Some(LightSet::Many { pick, point, .. }) if LIGHTS => (Some(pick), Some(point)),
            _ => (None, None),
        };
        for span in spans {
            let key = PixelKey::new(span.x, span.y);
            let lanes = span.lane..span.lane + span.count;
            let planes: [(Option<&Dim2>, &mut [Row; 2]); 3] =
                [(pixel, &mut self.pixel), (lens, &mut self.lens), (light, &mut self.light)];
            for (dim, rows) in planes {
                if let Some(dim) = dim {
                    source.fill_lanes_2d(key, span.first, dim, lanes.clone(), rows.each_mut());
                }
            }
            if let Some(dim) = pick {
                source.fill_lanes_1d(key, span.first, dim, lanes, &mut self.pick);
            }
        }
    }

    /// Sets up the camera rays.
    #[inline(always)]
    fn aim(&mut self, scene: &Scene, spans: &[Span]) {
        let (mut x, mut y, mut limit) = ([0.0; LANES], [0.0; LANES], [IDLE; LANES]);
        for span in spans {
            let (column, row) = (span.x as f32, span.y as f32);
            for lane in 0..LANES {
                let own = (lane as u32).wrapping_sub(span.lane as u32) < span.count as u32;
                let old = (x[lane], y[lane], limit[lane]);
                x[lane] = if own { column } else { old.0 };
                y[lane] = if own { row } else { old.1 };
                limit[lane] = if own { f32::INFINITY } else { old.2 };
            }
        }
        let camera = &scene.camera;
        let at = |lane: usize| Vec2::new(x[lane] + self.pixel[0][lane], y[lane] + self.pixel[1][lane]);
        match &camera.aperture {
            Aperture::ThinLens { radius, focal_depth, .. } if LENS => {
                for lane in 0..LANES {
                    let u = Vec2::new(self.lens[0][lane], self.lens[1][lane]);
                    self.view.put(lane, &camera.lens_ray(at(lane), u, *radius, *focal_depth));
                }
            }
            _ => {
                for lane in 0..LANES {
                    self.view.put(lane, &camera.pinhole_ray(at(lane)));
                }
            }
        }
        self.view.ready(&limit);
    }

    /// What the camera rays see: emitters, surfaces under the light they chose, or albedo alone.
    #[inline(always)]
    fn shade(&mut self, scene: &Scene) {
        self.radiance = [[0.0; LANES]; 3];
        let mut triangles = *self.view.triangles();
        let mut hit = [false; LANES];
        let some = triangles.iter().fold(NOTHING, |least, &t| least.min(t));
        if some == NOTHING {
            return;
        }
        // Lanes that met nothing work on another's triangle; nothing comes of it.
        for lane in 0..LANES {
            let own = triangles[lane];
            hit[lane] = own != NOTHING;
            triangles[lane] = if own == NOTHING { some } else { own };
        }
        self.surfaces.fill(&scene.faces, &triangles, self.view.origins(), self.view.directions());
        let emits = self.look_at_materials(scene, &triangles, &hit);
        let Some(lights) = &scene.lights else {
            for c in 0..3 {
                for lane in 0..LANES {
                    let albedo = self.albedo[c][lane];
                    self.radiance[c][lane] = if hit[lane] { albedo } else { 0.0 };
                }
            }
            return;
        };
        let mut open = [0u32; LANES];
        for lane in 0..LANES {
            open[lane] = u32::from(hit[lane] & (self.emitter[lane] == 0));
        }
        let count = match lights {
            LightSet::Dark => 0,
            LightSet::One { light, .. } if light.is_parallelogram() || !LIGHTS => match light.parallelogram() {
                Some(shape) => self.light_from(shape, light.area, light.emission, &open),
                None => 0,
            },
            _ if LIGHTS => self.light_from_any(scene, lights, &open),
            _ => 0,
        };
        if count > 0 {
            self.ray_count += u64::from(count);
            scene.accel.occluded(&mut self.shadow);
            let stopped = self.shadow.triangles();
            for c in 0..3 {
                for lane in 0..LANES {
                    let unshadowed = self.radiance[c][lane];
                    self.radiance[c][lane] = if stopped[lane] == NOTHING { unshadowed } else { 0.0 };
                }
            }
        }
        if emits {
            for lane in 0..LANES {
                if !hit[lane] | (self.emitter[lane] == 0) {
                    continue;
                }
                let material = self.surfaces.material[lane];
                set_column(&mut self.radiance, lane, scene.mesh.materials[material as usize].emission);
            }
        }
    }

    /// Looks up albedos, with their textures, and which surfaces emit; whether any does.
    ///
    /// One material after the other: a packet rarely meets more than a few.
    #[inline(always)]
    fn look_at_materials(&mut self, scene: &Scene, triangles: &[u32; LANES], hit: &[bool; LANES]) -> bool {
        let mut left = self.surfaces.material;
        let (mut emits, mut textured) = (false, false);
        loop {
            let next = left.iter().fold(NOTHING, |least, &m| least.min(m));
            if next == NOTHING {
                break;
            }
            let material = &scene.mesh.materials[next as usize];
            put_where(&mut self.albedo, &left, next, material.albedo);
            put_one_where(&mut self.emitter, &left, next, u32::from(material.is_emitter));
            emits |= material.is_emitter;
            textured |= TEXTURES && material.texture.is_some();
            take(&mut left, next);
        }
        if textured {
            self.look_at_textures(scene, triangles, hit);
        }
        emits
    }

    #[inline(always)]
    fn look_at_textures(&mut self, scene: &Scene, triangles: &[u32; LANES], hit: &[bool; LANES]) {
        for lane in 0..LANES {
            let material = &scene.mesh.materials[self.surfaces.material[lane] as usize];
            // What a lane that met nothing stands in for needs no look-up.
            if let (Some(texture), true) = (material.texture, hit[lane]) {
                let uv = self.surfaces.uv(&scene.faces[triangles[lane] as usize], lane);
                let texel = scene.mesh.textures[texture as usize].sample(uv);
                set_column(&mut self.albedo, lane, material.albedo * texel);
            }
        }
    }

    /// Contributions of one parallelogram to the lanes that are `open`, and their shadow rays; how many there are.
    #[inline(always)]
    fn light_from(&mut self, shape: &Parallelogram, area: f32, emission: Vec3, open: &[u32; LANES]) -> u32 {
        let mut limit = [IDLE; LANES];
        let mut count = 0;
        for lane in 0..LANES {
            let to = shape.point(Vec2::new(self.light[0][lane], self.light[1][lane]));
            let lit = self.receive(lane, &to, area, emission, 1.0, open[lane] != 0);
            limit[lane] = if lit { shadow_end() } else { IDLE };
            count += u32::from(lit);
        }
        self.shadow.ready(&limit);
        count
    }

    /// As [`Self::light_from`], for lights of any shape, of which each lane picks one.
    #[inline(always)]
    fn light_from_any(&mut self, scene: &Scene, lights: &LightSet, open: &[u32; LANES]) -> u32 {
        let (mut position, mut normal, mut emission) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        let (mut area, mut probability) = ([0.0; LANES], [1.0; LANES]);
        for lane in 0..LANES {
            let Some((light, chance)) = choose(lights, scene.estimator, self.pick[lane]) else { return 0 };
            let to = light.point(Vec2::new(self.light[0][lane], self.light[1][lane]));
            set_column(&mut position, lane, to.position);
            set_column(&mut normal, lane, to.normal);
            set_column(&mut emission, lane, light.emission);
            (area[lane], probability[lane]) = (light.area, chance);
        }
        let mut limit = [IDLE; LANES];
        let mut count = 0;
        for lane in 0..LANES {
            let to = LightPoint { position: column(&position, lane), normal: column(&normal, lane) };
            let emission = column(&emission, lane);
            let lit = self.receive(lane, &to, area[lane], emission, probability[lane], open[lane] != 0);
            limit[lane] = if lit { shadow_end() } else { IDLE };
            count += u32::from(lit);
        }
        self.shadow.ready(&limit);
        count
    }

    /// k_a · L_i · (ω_i·n) over the light's probability, if the lane is open and light and surface face each other.
    #[inline(always)]
    fn receive(
        &mut self,
        lane: usize,
        to: &LightPoint,
        area: f32,
        emission: Vec3,
        probability: f32,
        open: bool,
    ) -> bool {
        let arrival = arrival(to, area, &self.surfaces.at(lane));
        let lit = arrival.lit & open;
        let radiance = column(&self.albedo, lane) * (emission * arrival.weight) / probability;
        for (row, c) in self.radiance.iter_mut().zip(radiance.to_array()) {
            let c = if planted(Mutant::SampleClamped) { c.min(1.0) } else { c };
            row[lane] = if lit { c } else { 0.0 };
        }
        self.shadow.put(lane, &arrival.shadow_ray);
        lit
    }
}

/// Where a shadow ray ends: at the light's point.
#[inline(always)]
fn shadow_end() -> f32 {
    if planted(Mutant::ShadowRayTooLong) { 1.01 } else { 1.0 }
}

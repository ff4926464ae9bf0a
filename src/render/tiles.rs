//! Pixels over threads: spans of consecutive samples fill packets of rays; each tile writes only its own pixels.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::accel::{LANES, Packet, Ray};
use crate::film::Image;
use crate::mutants::{Mutant, planted};
use crate::sampling::{PixelKey, PointSource};
use crate::scene::camera::{Aperture, PixelSample};
use crate::scene::compile::Scene;
use crate::scene::geometry::{SurfacePoint, surface_point};
use crate::scene::light::LightSet;

use super::direct::direct_light;

/// Side of a tile in pixels.
const TILE: u32 = 8;

/// A finished image and what it took.
#[derive(Debug, Clone, PartialEq)]
pub struct Rendered {
    /// Means over each pixel's samples.
    pub image: Image,
    /// Camera and shadow rays.
    pub rays: u64,
}

/// A sample that is not a finite number: the image ends here, nothing is clamped or mended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NonFinite {
    /// Column from the left.
    pub x: u32,
    /// Row from the top.
    pub y: u32,
    /// Sample index.
    pub index: u32,
    /// What was found.
    pub radiance: Vec3,
}

impl std::fmt::Display for NonFinite {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { x, y, index, radiance } = self;
        write!(f, "pixel ({x}, {y}), sample {index}: expected a finite radiance, found {radiance}")
    }
}

/// Renders the scene with the numbers of `source`. The same scene and numbers give the same bits on any number of threads.
///
/// # Errors
/// The first sample, in the order of pixels and indices, whose radiance is not finite.
pub fn render<S: PointSource>(scene: &Scene, source: &S) -> Result<Rendered, NonFinite> {
    render_observed(scene, source, &|_| ())
}

/// As [`render`], telling `finished` after each tile how many more samples are done.
///
/// # Errors
/// As [`render`].
pub fn render_observed<S: PointSource>(
    scene: &Scene,
    source: &S,
    finished: &(dyn Fn(u64) + Sync),
) -> Result<Rendered, NonFinite> {
    let go_on = |samples| {
        finished(samples);
        true
    };
    render_while(scene, source, &go_on).map(|rendered| rendered.expect("nobody stops it"))
}

/// As [`render`], asking `go_on` after each tile, with the number of samples done in it, whether to go on. Once the answer
/// is no, no other tile begins and there is no image: `None`.
///
/// # Errors
/// As [`render`].
pub fn render_while<S: PointSource>(
    scene: &Scene,
    source: &S,
    go_on: &(dyn Fn(u64) -> bool + Sync),
) -> Result<Option<Rendered>, NonFinite> {
    let stopped = AtomicBool::new(false);
    let (width, height) = scene.camera.size();
    let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
    let tiles: Option<Vec<Result<TileResult, NonFinite>>> = (0..columns * rows)
        .into_par_iter()
        .map_init(Lanes::default, |lanes, t| {
            if stopped.load(Ordering::Relaxed) {
                return None;
            }
            let (x0, y0) = ((t % columns) * TILE, (t / columns) * TILE);
            let pixels: Vec<(u32, u32)> =
                (y0..(y0 + TILE).min(height)).flat_map(|y| (x0..(x0 + TILE).min(width)).map(move |x| (x, y))).collect();
            let tile = render_pixels(scene, source, &pixels, lanes);
            if !go_on(pixels.len() as u64 * u64::from(source.samples())) {
                stopped.store(true, Ordering::Relaxed);
            }
            Some(tile)
        })
        .collect();
    let Some(tiles) = tiles else { return Ok(None) };
    let mut image = Image::black(width, height);
    let mut rays = 0;
    let mut first_bad: Option<NonFinite> = None;
    for tile in tiles {
        match tile {
            Ok(tile) => {
                rays += tile.rays;
                for ((x, y), radiance) in tile.pixels {
                    image.pixels[y as usize * width as usize + x as usize] = radiance;
                }
            }
            Err(bad) => {
                let order = |b: &NonFinite| (b.y, b.x, b.index);
                if first_bad.as_ref().is_none_or(|f| order(&bad) < order(f)) {
                    first_bad = Some(bad);
                }
            }
        }
    }
    first_bad.map_or(Ok(Some(Rendered { image, rays })), Err)
}

/// Traces one sample alone: what [`render`] adds to pixel (x, y) for `index`.
pub fn render_sample<S: PointSource>(scene: &Scene, source: &S, x: u32, y: u32, index: u32) -> Vec3 {
    let mut lanes = Lanes::default();
    lanes.gather(scene, source, &[Span { pixel: 0, x, y, first: index, lane: 0, count: 1 }]);
    lanes.trace(scene);
    lanes.radiance[0]
}

struct TileResult {
    pixels: Vec<((u32, u32), [f32; 3])>,
    rays: u64,
}

/// Consecutive samples of one pixel, and the lanes they take.
#[derive(Clone, Copy)]
struct Span {
    /// The pixel's place in its tile.
    pixel: usize,
    x: u32,
    y: u32,
    first: u32,
    lane: usize,
    count: usize,
}

/// Everything a packet of samples needs, kept between packets: nothing is allocated per sample.
struct Lanes {
    view: Packet,
    shadow: Packet,
    rays: [Ray; LANES],
    pick: [f32; LANES],
    light: [[f32; LANES]; 2],
    radiance: [Vec3; LANES],
    used: usize,
    ray_count: u64,
}

impl Default for Lanes {
    fn default() -> Self {
        Self {
            view: Packet::default(),
            shadow: Packet::default(),
            rays: [Ray { origin: Vec3::ZERO, direction: Vec3::X }; LANES],
            pick: [0.0; LANES],
            light: [[0.0; LANES]; 2],
            radiance: [Vec3::ZERO; LANES],
            used: 0,
            ray_count: 0,
        }
    }
}

fn render_pixels<S: PointSource>(
    scene: &Scene,
    source: &S,
    pixels: &[(u32, u32)],
    lanes: &mut Lanes,
) -> Result<TileResult, NonFinite> {
    let samples = source.samples();
    let mut sums = vec![[0.0f64; 3]; pixels.len()];
    let mut spans: Vec<Span> = Vec::with_capacity(LANES);
    lanes.ray_count = 0;
    // Samples are numbered through the tile, pixel by pixel; each packet takes the next ones.
    let (mut pixel, mut first) = (0, 0);
    while pixel < pixels.len() {
        spans.clear();
        let mut lane = 0;
        while lane < LANES && pixel < pixels.len() {
            let (x, y) = pixels[pixel];
            let count = (LANES - lane).min((samples - first) as usize);
            spans.push(Span { pixel, x, y, first, lane, count });
            lane += count;
            first += count as u32;
            if first == samples {
                (pixel, first) = (pixel + 1, 0);
            }
        }
        lanes.gather(scene, source, &spans);
        lanes.trace(scene);
        for span in &spans {
            let sum = &mut sums[span.pixel];
            for (index, radiance) in (span.first..).zip(&lanes.radiance[span.lane..span.lane + span.count]) {
                if !radiance.is_finite() {
                    return Err(NonFinite { x: span.x, y: span.y, index, radiance: *radiance });
                }
                for (sum, c) in sum.iter_mut().zip(radiance.to_array()) {
                    *sum += f64::from(c);
                }
            }
        }
    }
    let count = if planted(Mutant::MeanOverOneMore) { samples + 1 } else { samples };
    let mean = |sum: &[f64; 3]| sum.map(|s| (s / f64::from(count)) as f32);
    Ok(TileResult { pixels: pixels.iter().copied().zip(sums.iter().map(mean)).collect(), rays: lanes.ray_count })
}

impl Lanes {
    /// Reads the numbers of the spans' samples and sets up their camera rays.
    #[inline]
    fn gather<S: PointSource>(&mut self, scene: &Scene, source: &S, spans: &[Span]) {
        self.view.clear();
        self.used = spans.last().map_or(0, |s| s.lane + s.count);
        let (mut px, mut py) = ([0.5f32; LANES], [0.5f32; LANES]);
        let (mut lx, mut ly) = ([0.5f32; LANES], [0.5f32; LANES]);
        for span in spans {
            let key = PixelKey::new(span.x, span.y);
            let lanes = span.lane..span.lane + span.count;
            if let PixelSample::Sampled(dim) = &scene.camera.pixel {
                source.fill_2d(key, span.first, dim, &mut px[lanes.clone()], &mut py[lanes.clone()]);
            }
            if let Aperture::ThinLens { lens, .. } = &scene.camera.aperture {
                source.fill_2d(key, span.first, lens, &mut lx[lanes.clone()], &mut ly[lanes.clone()]);
            }
            match &scene.lights {
                None | Some(LightSet::Dark) => {}
                Some(LightSet::One { point, .. }) => {
                    let [u, v] = &mut self.light;
                    source.fill_2d(key, span.first, point, &mut u[lanes.clone()], &mut v[lanes.clone()]);
                }
                Some(LightSet::Many { pick, point, .. }) => {
                    source.fill_1d(key, span.first, pick, &mut self.pick[lanes.clone()]);
                    let [u, v] = &mut self.light;
                    source.fill_2d(key, span.first, point, &mut u[lanes.clone()], &mut v[lanes.clone()]);
                }
            }
            for lane in lanes {
                let at = Vec2::new(span.x as f32 + px[lane], span.y as f32 + py[lane]);
                let ray = match &scene.camera.aperture {
                    Aperture::Pinhole => scene.camera.pinhole_ray(at),
                    Aperture::ThinLens { radius, focal_depth, .. } => {
                        scene.camera.lens_ray(at, Vec2::new(lx[lane], ly[lane]), *radius, *focal_depth)
                    }
                };
                self.rays[lane] = ray;
                self.view.set(lane, &ray, f32::INFINITY);
            }
        }
    }

    /// Traces the packet: view rays, shading, shadow rays.
    #[inline]
    fn trace(&mut self, scene: &Scene) {
        scene.accel.closest(&mut self.view);
        self.ray_count += self.used as u64;
        self.shadow.clear();
        let mut shadows = 0;
        for lane in 0..self.used {
            self.radiance[lane] = Vec3::ZERO;
            let Some(hit) = self.view.hit(lane) else { continue };
            let point = surface_point(&scene.faces[hit.triangle as usize], &self.rays[lane]);
            let Some(lights) = &scene.lights else {
                self.radiance[lane] = albedo(scene, &point);
                continue;
            };
            let material = &scene.mesh.materials[point.material as usize];
            if material.is_emitter {
                self.radiance[lane] = material.emission;
                continue;
            }
            let u = Vec2::new(self.light[0][lane], self.light[1][lane]);
            let albedo = albedo(scene, &point);
            if let Some(c) = direct_light(lights, scene.estimator, self.pick[lane], u, &point, albedo) {
                self.radiance[lane] =
                    if planted(Mutant::SampleClamped) { c.radiance.min(Vec3::ONE) } else { c.radiance };
                let end = if planted(Mutant::ShadowRayTooLong) { 1.01 } else { 1.0 };
                self.shadow.set(lane, &c.shadow_ray, end);
                shadows += 1;
            }
        }
        if shadows > 0 {
            self.ray_count += shadows;
            scene.accel.occluded(&mut self.shadow);
            for lane in 0..self.used {
                if self.shadow.is_occluded(lane) {
                    self.radiance[lane] = Vec3::ZERO;
                }
            }
        }
    }
}

#[inline]
fn albedo(scene: &Scene, point: &SurfacePoint) -> Vec3 {
    let material = &scene.mesh.materials[point.material as usize];
    match material.texture {
        None => material.albedo,
        Some(texture) => material.albedo * scene.mesh.textures[texture as usize].sample(point.uv),
    }
}

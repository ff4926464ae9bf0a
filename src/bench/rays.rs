//! Rays a second: what a renderer asks of the tree, by kind of ray, kernel and scene.

use std::cell::OnceCell;
use std::hint::black_box;
use std::rc::Rc;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::lab::Lab;
use super::scenes::Landscape;
use super::timing::{Case, seconds};
use crate::accel::{Accel, Kernel, LANES, Packet, Ray, Row, Wide, set_column};
use crate::render::light_contribution;
use crate::sampling::hash::{bits32, derive, unit_f32};
use crate::sampling::{PixelKey, PointSource, Preset, Sampler, SamplerSpec, warp};
use crate::scene::camera::{Aperture, PixelSample};
use crate::scene::compile::Scene;
use crate::scene::geometry::{SurfacePoint, surface_point};
use crate::scene::light::LightSet;

/// Every how many-th column and row has a pixel whose rays are traced.
const STRIDE: usize = 8;
/// Packets that a thread takes at once.
const CHUNK: usize = 64;

/// Which rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// From the lens, 16 of one pixel after another: closest hit.
    Primary,
    /// From what those meet, into the hemisphere by the cosine: closest hit.
    Diffuse,
    /// From what those meet to points of the light: any hit.
    Shadow,
}

/// All kinds with their names.
pub const KINDS: [(Kind, &str); 3] =
    [(Kind::Primary, "primary-closest"), (Kind::Diffuse, "cosine-closest"), (Kind::Shadow, "shadow-any")];

/// How rays are asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Query {
    /// Packets of 16.
    Packet,
    /// One by one.
    Single,
}

const QUERIES: [(Query, &str); 2] = [(Query::Packet, "packet"), (Query::Single, "single")];

pub fn cases(lab: &Rc<Lab>) -> Vec<Case> {
    let mut cases = Vec::new();
    for (which, landscape) in Landscape::ALL.into_iter().enumerate() {
        let rays: Rc<OnceCell<[Batches; 3]>> = Rc::default();
        for (k, (kind, kind_name)) in KINDS.into_iter().enumerate() {
            for (query, query_name) in QUERIES {
                for kernel in Kernel::available() {
                    let (lab, rays) = (Rc::clone(lab), Rc::clone(&rays));
                    let name = format!("rays/{}/{kind_name}/{query_name}-{kernel}", landscape.name);
                    let prepare = move || {
                        rays.get_or_init(|| all_kinds(&lab.landscape(which).borrow()));
                        let once: Box<dyn FnMut() -> f64> = Box::new(move || {
                            let mut scene = lab.landscape(which).borrow_mut();
                            scene.accel.set_kernel(kernel);
                            let batches = &rays.get().expect("made above")[k];
                            let taken = seconds(|| batches.trace(&scene.accel, kind, query));
                            scene.accel.set_kernel(Kernel::detected());
                            batches.count as f64 / taken / 1e6
                        });
                        Ok(once)
                    };
                    cases.push(Case::one(name, "Mrays/s", prepare));
                }
            }
        }
    }
    cases
}

/// Rays in the order in which they are made, 16 to a packet.
pub struct Batches {
    packets: Vec<Batch>,
    /// Rays.
    pub count: usize,
}

#[derive(Clone)]
struct Batch {
    origin: [Row; 3],
    direction: [Row; 3],
    limit: Row,
    used: usize,
}

impl Batches {
    /// Rays that count up to `limit`.
    fn new(rays: &[Ray], limit: f32) -> Self {
        let batch = |rays: &[Ray]| {
            let mut batch = Batch {
                origin: [[0.0; LANES]; 3],
                direction: [[1.0; LANES]; 3],
                limit: [f32::NEG_INFINITY; LANES],
                used: rays.len(),
            };
            for (lane, ray) in rays.iter().enumerate() {
                set_column(&mut batch.origin, lane, ray.origin);
                set_column(&mut batch.direction, lane, ray.direction);
                batch.limit[lane] = limit;
            }
            batch
        };
        Self { packets: rays.chunks(LANES).map(batch).collect(), count: rays.len() }
    }

    /// Traces them all over the threads; how many met something.
    pub fn trace(&self, accel: &Accel, kind: Kind, query: Query) -> usize {
        let chunk = |batches: &[Batch]| accel.kernel().run(Trace { accel, batches, kind, query });
        self.packets.par_chunks(CHUNK).map(chunk).sum()
    }

    /// In order, cut into at most `count` ≥ 1 parts of about the same length.
    pub fn parts(self, count: usize) -> Vec<Self> {
        let length = self.packets.len().div_ceil(count).max(1);
        let part =
            |packets: &[Batch]| Self { count: packets.iter().map(|batch| batch.used).sum(), packets: packets.to_vec() };
        self.packets.chunks(length).map(part).collect()
    }

    /// The packets: origins, directions, limits by lane (−∞ where there is no ray).
    pub fn packets(&self) -> impl Iterator<Item = (&[Row; 3], &[Row; 3], &Row)> {
        self.packets.iter().map(|batch| (&batch.origin, &batch.direction, &batch.limit))
    }
}

/// A thread's share, compiled as the renderer's loop is.
struct Trace<'a> {
    accel: &'a Accel,
    batches: &'a [Batch],
    kind: Kind,
    query: Query,
}

impl Wide for Trace<'_> {
    type Output = usize;

    #[inline(always)]
    fn run(self) -> usize {
        let Self { accel, batches, kind, query } = self;
        let mut packet = Packet::default();
        let mut met = 0;
        for batch in batches {
            if query == Query::Packet {
                packet.set_all(&batch.origin, &batch.direction, &batch.limit);
                if kind == Kind::Shadow {
                    accel.occluded(&mut packet);
                } else {
                    accel.closest(&mut packet);
                }
                met += packet.triangles().iter().filter(|t| **t != crate::accel::NOTHING).count();
                black_box(&mut packet);
                continue;
            }
            for lane in 0..batch.used {
                let at = |rows: &[Row; 3]| Vec3::new(rows[0][lane], rows[1][lane], rows[2][lane]);
                let ray = Ray { origin: at(&batch.origin), direction: at(&batch.direction) };
                let limit = batch.limit[lane];
                met += usize::from(match kind {
                    Kind::Shadow => accel.occluded_one(&ray, limit),
                    _ => black_box(accel.closest_one(&ray, limit)).is_some(),
                });
            }
        }
        met
    }
}

/// The rays of all kinds, in the order of [`KINDS`]: of one pixel of 64, 16 samples each.
///
/// # Panics
/// For a scene that is no landscape.
pub fn all_kinds(scene: &Scene) -> [Batches; 3] {
    let primary = primary_rays(scene);
    let points: Vec<SurfacePoint> = primary
        .iter()
        .filter_map(|ray| {
            let hit = scene.accel.closest_one(ray, f32::INFINITY)?;
            Some(facing(surface_point(&scene.faces[hit.triangle as usize], ray), ray))
        })
        .collect();
    let random = |i: usize, axis: u64| unit_f32(bits32(derive(1, &[axis]), i as u32));
    let pair = |i: usize, axis: u64| Vec2::new(random(i, axis), random(i, axis + 1));
    let diffuse: Vec<Ray> = points.iter().enumerate().map(|(i, point)| cosine_ray(point, pair(i, 0))).collect();
    let Some(LightSet::One { light, .. }) = &scene.lights else { unreachable!("a landscape has one light") };
    let shadow =
        points.iter().enumerate().filter_map(|(i, point)| Some(light_contribution(light, pair(i, 2), point)?.1));
    let shadow: Vec<Ray> = shadow.collect();
    [Batches::new(&primary, f32::INFINITY), Batches::new(&diffuse, f32::INFINITY), Batches::new(&shadow, 1.0)]
}

/// Camera rays, 16 of one pixel after another.
pub fn primary_batches(scene: &Scene) -> Batches {
    Batches::new(&primary_rays(scene), f32::INFINITY)
}

fn primary_rays(scene: &Scene) -> Vec<Ray> {
    let (PixelSample::Sampled(pixel), Aperture::ThinLens { radius, focal_depth, lens }) =
        (&scene.camera.pixel, &scene.camera.aperture)
    else {
        unreachable!("a landscape has a lens and sampled pixels")
    };
    let spec = SamplerSpec::parse("sobol", Preset::Best).expect("a known name");
    let sampler = Sampler::new(spec, &scene.layout, LANES as u32, 1).expect("a count that every sampler takes");
    let (width, height) = scene.camera.size();
    let mut rays = Vec::new();
    for y in (0..height).step_by(STRIDE) {
        for x in (0..width).step_by(STRIDE) {
            let key = PixelKey::new(x, y);
            for i in 0..LANES as u32 {
                let at = Vec2::new(x as f32, y as f32) + Vec2::from(sampler.get_2d(key, i, pixel));
                let on_lens = Vec2::from(sampler.get_2d(key, i, lens));
                rays.push(scene.camera.lens_ray(at, on_lens, *radius, *focal_depth));
            }
        }
    }
    rays
}

/// The side of the surface that the ray came to.
fn facing(mut point: SurfacePoint, ray: &Ray) -> SurfacePoint {
    if point.face_normal.dot(ray.direction) > 0.0 {
        point.face_normal = -point.face_normal;
        point.normal = -point.normal;
    }
    point
}

/// A ray into the hemisphere over the face, by the cosine: a point of the disk, lifted.
fn cosine_ray(point: &SurfacePoint, u: Vec2) -> Ray {
    let normal = point.face_normal;
    let (s, t) = normal.any_orthonormal_pair();
    let d = warp::square_to_disk(u);
    let up = (1.0 - d.length_squared()).max(0.0).sqrt();
    Ray { origin: point.position + normal * point.offset, direction: s * d.x + t * d.y + normal * up }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kernel_and_way_of_asking_meets_the_same() {
        let mut scene = Landscape::of_quads(3).scene((160, 90));
        let batches = all_kinds(&scene);
        assert!(batches.iter().all(|b| b.count > 1000));
        for (batches, (kind, name)) in batches.iter().zip(KINDS) {
            let mut found = Vec::new();
            for (query, _) in QUERIES {
                for kernel in Kernel::available() {
                    scene.accel.set_kernel(kernel);
                    found.push(batches.trace(&scene.accel, kind, query));
                }
            }
            assert!(found.iter().all(|met| *met == found[0] && *met > 100), "{name}: {found:?} of {}", batches.count);
        }
    }
}

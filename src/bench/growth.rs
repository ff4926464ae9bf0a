//! How seconds grow with the size of the work: at several sizes each, and the power of the size that fits them.

use std::hint::black_box;
use std::rc::Rc;

use glam::{Vec2, Vec3};

use super::lab::Lab;
use super::rays::{Batches, Kind, Query, primary_batches};
use super::scenes::Landscape;
use super::timing::{Case, MOST, Part, Repeat, seconds};
use super::work::points;
use crate::accel::{Accel, Triangle};
use crate::error::{Error, Result};
use crate::render::render;
use crate::sampling::hash::{bits32, unit_f32};
use crate::sampling::{Preset, SampleLayout, Sampler, SamplerSpec};
use crate::scene::compile::Scene;
use crate::scene::geometry::{face_normal, triangles};
use crate::scene::light::{LightSet, pick_light};
use crate::scene::mesh::{Material, Mesh};
use crate::stats::discrepancy::{L2Kind, l2, star_2d};

/// Seconds of the work at one size.
type AtSize = Box<dyn FnMut() -> Result<f64>>;

pub fn cases(lab: &Rc<Lab>) -> Vec<Case> {
    let (spp_lab, pixel_lab) = (Rc::clone(lab), Rc::clone(lab));
    vec![
        case("samples-per-pixel", &[4, 16, 64, 256], move |n| rendering(spp_lab.cornell((128, 128))?, n)),
        case("pixels", &[4096, 16_384, 65_536, 262_144], move |n| {
            let side = n.isqrt();
            rendering(pixel_lab.cornell((side, side))?, 4)
        }),
        case("triangles-build", &triangle_counts(), |n| {
            let scene = landscape(n).scene((64, 36));
            let (corners, reach): (Vec<Triangle>, f32) = (triangles(&scene.mesh), scene.reach());
            Ok(Box::new(move || Ok(seconds(|| Accel::new(&corners, reach)))))
        }),
        case("triangles-rays", &triangle_counts(), |n| {
            let scene = landscape(n).scene((640, 360));
            let batches: Batches = primary_batches(&scene);
            Ok(Box::new(move || Ok(seconds(|| batches.trace(&scene.accel, Kind::Primary, Query::Packet)))))
        }),
        case("lights-pick", &[10, 100, 1000, 10_000], |n| Ok(picking(n))),
        case("star-2d-points", &[512, 1024, 2048, 4096], |n| {
            let points = points(n)?;
            Ok(Box::new(move || Ok(seconds(|| star_2d(&points)))))
        }),
        case("l2-points", &[1024, 2048, 4096, 8192], |n| {
            let points = points(n)?;
            Ok(Box::new(move || Ok(seconds(|| l2(&points, L2Kind::Star)))))
        }),
    ]
}

fn case(name: &str, sizes: &[u32], at: impl Fn(u32) -> Result<AtSize> + 'static) -> Case {
    let parts = sizes.iter().map(|n| Part { suffix: format!("/{n}"), unit: "s" }).collect();
    let numbers: Vec<f64> = sizes.iter().map(|n| f64::from(*n)).collect();
    let sizes = sizes.to_vec();
    let prepare = move || {
        let mut all: Vec<AtSize> = sizes.iter().map(|n| at(*n)).collect::<Result<_>>()?;
        let repeat: Repeat = Box::new(move || all.iter_mut().map(|once| once()).collect());
        Ok(repeat)
    };
    Case { name: format!("growth/{name}"), parts, sizes: Some(numbers), most: MOST, prepare: Box::new(prepare) }
}

/// Quads along the edges of a ball's faces, for each size.
const QUADS: [u32; 4] = [5, 10, 20, 40];

fn triangle_counts() -> [u32; 4] {
    QUADS.map(|quads| Landscape::of_quads(quads).triangle_count() as u32)
}

fn landscape(count: u32) -> Landscape {
    let of_count = |l: &Landscape| l.triangle_count() == count as usize;
    QUADS.map(Landscape::of_quads).into_iter().find(of_count).expect("a size of this list")
}

fn rendering(scene: Scene, spp: u32) -> Result<AtSize> {
    let spec = SamplerSpec::parse("sobol", Preset::Best)?;
    let sampler = Sampler::new(spec, &scene.layout, spp, 1)?;
    Ok(Box::new(move || {
        let mut rendered = None;
        let taken = seconds(|| rendered = Some(render(&scene, &sampler)));
        rendered.expect("rendered above").map_err(|bad| Error::incomplete("bench", bad))?;
        Ok(taken)
    }))
}

/// Picks of a light.
const PICKS: u32 = 1 << 18;

/// A fixed number of picks among `n` lights of different powers.
fn picking(n: u32) -> AtSize {
    let LightSet::Many { cumulative, .. } = LightSet::new(&lamps(n), &mut SampleLayout::default()) else {
        unreachable!("there are several lamps, all of them lit")
    };
    Box::new(move || {
        let all = || (0..PICKS).map(|i| pick_light(&cumulative, unit_f32(bits32(1, i)))).fold(0, usize::wrapping_add);
        Ok(seconds(|| black_box(all())))
    })
}

/// Small triangles that emit, each a light of its own.
fn lamps(n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..n {
        let at = Vec3::new(unit_f32(bits32(2, i)), 1.0, unit_f32(bits32(3, i)));
        let corners = [at, at + Vec3::X * 0.01, at + Vec3::Z * 0.01];
        mesh.positions.push(corners);
        mesh.normals.push([face_normal(&corners); 3]);
        mesh.uvs.push([Vec2::ZERO; 3]);
        mesh.material_of.push(i);
        mesh.materials.push(Material {
            name: format!("lamp {i}"),
            file: 0,
            albedo: Vec3::ONE,
            texture: None,
            emission: Vec3::splat(1.0 + unit_f32(bits32(4, i))),
            is_emitter: true,
        });
    }
    mesh
}

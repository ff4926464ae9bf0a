//! The test of images by tiles, on a renderer against itself and on planted biases.

use glam::Vec3;
use rayon::prelude::*;

use crate::check::scene::tiles::{Comparison, Series, Tiling, Truth, by_place, compare};
use crate::check::{Context, Finding, Tally};
use crate::render::render;
use crate::sampling::{Preset, Sampler, SamplerSpec};
use crate::scene::compile::{Scene, Stage};
use crate::scene::config::{CameraConfig, SceneConfig};
use crate::scene::geometry::face_normal;
use crate::scene::mesh::{Material, Mesh};
use crate::stats::hypothesis::two_sided;
use crate::stats::student_t_quantile;

use super::{Draws, LEVEL, is_compatible, share};

/// Tilted stripes, white on dark and finer than a pixel, and above them a dark half in which bright specks are hit rarely:
/// what makes tests on pixels lie.
fn edges() -> Scene {
    let mut mesh = Mesh::default();
    for (name, albedo) in [("white", 1.0), ("dark", 0.02)] {
        mesh.materials.push(Material {
            name: name.to_owned(),
            file: 0,
            albedo: Vec3::splat(albedo),
            texture: None,
            emission: Vec3::ZERO,
            is_emitter: false,
        });
    }
    let mut triangle = |corners: [[f32; 2]; 3], z: f32, material: u32| {
        let corners = corners.map(|[x, y]| Vec3::new(x, y, z));
        mesh.positions.push(corners);
        mesh.normals.push([face_normal(&corners); 3]);
        mesh.uvs.push([glam::Vec2::ZERO; 3]);
        mesh.material_of.push(material);
    };
    triangle([[-3.0, -3.0], [3.0, -3.0], [-3.0, 3.0]], 1.0, 1);
    triangle([[3.0, 3.0], [-3.0, 3.0], [3.0, -3.0]], 1.0, 1);
    for stripe in -14..10 {
        let x = 0.1 * stripe as f32;
        triangle([[x, -1.0], [x + 0.05, -1.0], [x + 0.55, 0.1]], 0.99, 0);
        triangle([[x, -1.0], [x + 0.55, 0.1], [x + 0.5, 0.1]], 0.99, 0);
    }
    for speck in 0..4 {
        let x = 0.2 + 0.13 * speck as f32;
        triangle([[x, 0.3], [x + 0.03, 0.3], [x, 0.33]], 0.99, 0);
    }
    let mut config = SceneConfig::parse(br#"{"shading": "albedo"}"#, "a scene in memory", &[]).expect("a config");
    config.camera = CameraConfig {
        pos: Vec3::ZERO,
        dir: Vec3::Z,
        up: Vec3::Y,
        fov_degrees: 60.0,
        lens_radius: 0.0,
        focal_depth: 1.0,
    };
    config.auto_focus = false;
    Scene::new(&config, mesh, (16, 12), Stage::Final).expect("a small scene")
}

/// Rendered twice by other seeds, 1000 times: how often does any tile differ, at a level of 1 % for all of them?
pub fn null_tiles(context: &Context) -> Finding {
    const REPLICATES: u64 = 32;
    let scene = edges();
    let tiling = Tiling::new(16, 12);
    let spec = SamplerSpec::parse("uniform", Preset::Best).expect("a sampler");
    let series = |run: u64, side: u64| -> Option<Series> {
        let means = (0..REPLICATES).map(|replicate| {
            let seed = context.seed_of(run, 2 * replicate + side);
            let sampler = Sampler::new(spec, &scene.layout, 4, seed).expect("a legal count");
            render(&scene, &sampler).ok().map(|rendered| tiling.means(&rendered.image))
        });
        Some(by_place(&means.collect::<Option<Vec<_>>>()?))
    };
    let runs = u64::from(context.replicates(1_000, 1_000));
    let alarm = |run: u64| -> Option<bool> {
        let (a, b) = (series(run, 0)?, series(run, 1)?);
        Some(compare(&tiling, &a, &Truth::Replicates(&b), 0.0, LEVEL).p < LEVEL)
    };
    let alarms: Option<Vec<bool>> = (0..runs).into_par_iter().map(alarm).collect();
    let Some(alarms) = alarms else { return Finding::broken("a radiance was not finite".to_owned()) };
    let alarms = alarms.into_iter().filter(|&alarm| alarm).count() as u64;
    let mut tally = Tally::new();
    // The whole is the sum of the tiles and single tiles are constant, so Holm's rate is at most the level; it is not to be
    // above it by more than half, as pooled rare hits are not quite normal.
    let words = format!("some tile of fine stripes and rare specks differs: {}", share(alarms, runs));
    tally.fact(words.clone(), is_compatible(alarms, runs, [0.0, 1.5 * LEVEL], context.family(1)));
    tally.saying(words)
}

/// The noise of a tile's replicate, relative to its mean.
const NOISE: f64 = 0.02;

/// 24 tiles, 32 replicates a side, a noise of 2 % each: found by a t of known size, which the shares have to follow.
pub fn power_of_tiles(context: &Context) -> Finding {
    const REPLICATES: usize = 32;
    let tiling = Tiling::new(6, 4);
    let tiles = 24;
    let runs = u64::from(context.replicates(500, 500));
    let cases: Vec<(f64, bool)> = [0.001, 0.01, 0.05].into_iter().flat_map(|b| [(b, false), (b, true)]).collect();
    let family = context.family(cases.len() as u32);
    let mut tally = Tally::new();
    let mut said = Vec::new();
    for (case, &(bias, everywhere)) in (0u64..).zip(&cases) {
        let found = (0..runs)
            .into_par_iter()
            .filter(|&run| {
                let mut draws = Draws::new(context.seed_of(case, run));
                let mut side = |bias: f64| -> Series {
                    let image = |draws: &mut Draws| {
                        let value =
                            |tile| 1.0 + NOISE * draws.normal() + if everywhere || tile == 7 { bias } else { 0.0 };
                        let mut means: Vec<f64> = (0..tiles).map(value).collect();
                        means.push(means.iter().sum::<f64>() / f64::from(tiles));
                        means
                    };
                    by_place(&(0..REPLICATES).map(|_| image(&mut draws)).collect::<Vec<_>>())
                };
                let (ours, theirs) = (side(bias), side(0.0));
                is_found(&compare(&tiling, &ours, &Truth::Replicates(&theirs), 0.0, LEVEL))
            })
            .count() as u64;
        let place = if everywhere { "everywhere" } else { "in one tile" };
        let words = format!("{} % {place} {}", 100.0 * bias, share(found, runs));
        let expected = expected_power(bias, everywhere, tiles, REPLICATES);
        let holds = is_compatible(found, runs, expected, family);
        tally.fact(format!("{words}, expected {:.2} to {:.2}", expected[0], expected[1]), holds);
        said.push(words);
    }
    tally.saying(format!(
        "found, of biases of {} (noise of a tile {} %, {REPLICATES} replicates a side, level {LEVEL})",
        said.join(", "),
        100.0 * NOISE
    ))
}

fn is_found(compared: &Comparison) -> bool {
    compared.p < LEVEL
}

/// Bounds of the share that is found: the best place alone from below (the whole image has the bias of one tile by 1/24 and
/// noise by 1/√24), all of them and the level itself from above, each with 3 % for Student's shift.
fn expected_power(bias: f64, everywhere: bool, tiles: u32, replicates: usize) -> [f64; 2] {
    let df = 2.0 * (replicates - 1) as f64;
    let error = NOISE * (2.0 / replicates as f64).sqrt();
    let critical = student_t_quantile(1.0 - 0.5 * LEVEL / f64::from(tiles + 1), df);
    let power = |bias: f64, error: f64| {
        let beyond = critical - bias / error;
        let tail = 0.5 * two_sided(beyond, df);
        if beyond > 0.0 { tail } else { 1.0 - tail }
    };
    let root = f64::from(tiles).sqrt();
    let tile = power(bias, error);
    let (whole, others) = if everywhere {
        (power(bias, error / root), 1.0 - libm::pow(1.0 - tile, f64::from(tiles)))
    } else {
        (power(bias / f64::from(tiles), error / root), tile)
    };
    [tile.max(whole) - 0.03, (whole + others + LEVEL + 0.03).min(1.0)]
}

//! The test of images by tiles, on a renderer against itself and on planted biases.

use glam::Vec3;
use rayon::prelude::*;

use crate::check::scene::tiles::{Comparison, Rare, Rules, Series, Tiling, Truth, by_place, compare};
use crate::check::{Context, Finding, Tally};
use crate::render::render;
use crate::sampling::{Preset, Sampler, SamplerSpec};
use crate::scene::compile::{Scene, Stage};
use crate::scene::config::{CameraConfig, SceneConfig};
use crate::scene::geometry::face_normal;
use crate::scene::mesh::{Material, Mesh};
use crate::stats::hypothesis::normal_tail;
use crate::stats::student_t_quantile;

use super::{Draws, LEVEL, share};

const RULES: Rules = Rules { allowance: 0.0, rare: Rare::NOTHING, level: LEVEL };

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
    const SPP: u32 = 4;
    let scene = edges();
    let tiling = Tiling::new(16, 12);
    let spec = SamplerSpec::parse("uniform", Preset::Best).expect("a sampler");
    let series = |run: u64, side: u64| -> Option<Series> {
        let means = (0..REPLICATES).map(|replicate| {
            let seed = context.seed_of(run, 2 * replicate + side);
            let sampler = Sampler::new(spec, &scene.layout, SPP, seed).expect("a legal count");
            render(&scene, &sampler).ok().map(|rendered| tiling.means(&rendered.image))
        });
        Some(by_place(&means.collect::<Option<Vec<_>>>()?))
    };
    let runs = u64::from(context.replicates(1_000, 1_000));
    // Nothing in the scene is brighter than 1.
    let rare = Rare { range: 1.0, samples: [REPLICATES as f64 * f64::from(SPP); 2] };
    let alarm = |run: u64| -> Option<bool> {
        let (a, b) = (series(run, 0)?, series(run, 1)?);
        Some(compare(&tiling, &a, &Truth::Replicates(&b), Rules { rare, ..RULES }).p < LEVEL)
    };
    let alarms: Option<Vec<bool>> = (0..runs).into_par_iter().map(alarm).collect();
    let Some(alarms) = alarms else { return Finding::broken("a radiance was not finite".to_owned()) };
    let rendered = alarms.into_iter().filter(|&alarm| alarm).count() as u64;
    let [bounded, alone] = rare_on_noise(context, runs);
    let mut tally = Tally::new();
    let mut said = Vec::new();
    let family = context.family(3);
    for (what, alarms) in
        [("some tile of fine stripes and rare specks differs", rendered), ("some tile of noise and rare hits", bounded)]
    {
        let words = format!("{what}: {}", share(alarms, runs));
        tally.rate(words.clone(), alarms, runs, [0.0, LEVEL], family);
        said.push(words);
    }
    // The check has something to find: the t test alone lies.
    let words = format!("without the bound on what is rare: {}", share(alone, runs));
    tally.rate(words.clone(), alone, runs, [3.0 * LEVEL, 1.0], family);
    said.push(words);
    tally.saying(said.join("; "))
}

/// Tiles of two pixels, six by four, in 16 replicates of four samples a pixel, uniform noise of mean ½ and one hit of 60 in 40 samples, against
/// the exact mean: runs in which a tile differs, with the bound on rare events and without.
fn rare_on_noise(context: &Context, runs: u64) -> [u64; 2] {
    const TILES: u32 = 6;
    const PIXELS: u32 = 8;
    const REPLICATES: usize = 16;
    const SPP: u32 = 4;
    const HIT: f64 = 60.0;
    const CHANCE: f64 = 1.0 / 40.0;
    let tiling = Tiling::new(TILES, PIXELS);
    let exact = 0.5 + HIT * CHANCE;
    let outcomes: Vec<[bool; 2]> = (0..runs)
        .into_par_iter()
        .map(|run| {
            let mut draws = Draws::new(context.seed_of(1 << 20, run));
            let places = tiling.shape()[0] * tiling.shape()[1];
            let image = |draws: &mut Draws| {
                let sample = |draws: &mut Draws| draws.uniform() + if draws.uniform() < CHANCE { HIT } else { 0.0 };
                let mut means: Vec<f64> = (0..places as usize)
                    .map(|place| {
                        let samples = (tiling.pixels(place) * f64::from(SPP)) as u32;
                        (0..samples).map(|_| sample(draws)).sum::<f64>() / f64::from(samples)
                    })
                    .collect();
                let pixels: Vec<f64> = (0..places as usize).map(|place| tiling.pixels(place)).collect();
                means.push(means.iter().zip(&pixels).map(|(m, p)| m * p).sum::<f64>() / pixels.iter().sum::<f64>());
                means
            };
            let found = by_place(&(0..REPLICATES).map(|_| image(&mut draws)).collect::<Vec<_>>());
            let exact = vec![exact; found.len()];
            let rare = Rare { range: HIT + 1.0, samples: [REPLICATES as f64 * f64::from(SPP), f64::INFINITY] };
            [rare, Rare::NOTHING]
                .map(|rare| compare(&tiling, &found, &Truth::Exact(&exact), Rules { rare, ..RULES }).p < LEVEL)
        })
        .collect();
    [0, 1].map(|which| outcomes.iter().filter(|outcome| outcome[which]).count() as u64)
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
                is_found(&compare(&tiling, &ours, &Truth::Replicates(&theirs), RULES))
            })
            .count() as u64;
        let place = if everywhere { "everywhere" } else { "in one tile" };
        let words = format!("{} % {place} {}", 100.0 * bias, share(found, runs));
        let expected = expected_power(bias, everywhere, tiles, REPLICATES);
        let what = format!("{words}, expected {:.4} to {:.2}", expected[0], expected[1]);
        tally.rate(what, found, runs, expected, family);
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
/// noise by 1/√24), all of them and the level itself from above, each with the error of the power's formula.
///
/// The power is the noncentral t's, by its normal approximation (Abramowitz & Stegun 26.7.10), good to 0.005 here. A bias of 0.1 % is
/// below what can be seen: of it the test is that it is *not* found more often than its size says.
fn expected_power(bias: f64, everywhere: bool, tiles: u32, replicates: usize) -> [f64; 2] {
    const FORMULA: f64 = 0.005;
    let df = 2.0 * (replicates - 1) as f64;
    let error = NOISE * (2.0 / replicates as f64).sqrt();
    let critical = student_t_quantile(1.0 - 0.5 * LEVEL / f64::from(tiles + 1), df);
    let power = |bias: f64, error: f64| {
        let spread = (1.0 + critical * critical / (2.0 * df)).sqrt();
        1.0 - normal_tail((bias / error - critical * (1.0 - 1.0 / (4.0 * df))) / spread)
    };
    let root = f64::from(tiles).sqrt();
    let tile = power(bias, error);
    let (whole, others) = if everywhere {
        (power(bias, error / root), 1.0 - libm::pow(1.0 - tile, f64::from(tiles)))
    } else {
        (power(bias / f64::from(tiles), error / root), tile)
    };
    [(tile.max(whole) - FORMULA).max(0.0), (whole + others + LEVEL + FORMULA).min(1.0)]
}

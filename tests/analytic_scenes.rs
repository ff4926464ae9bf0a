//! Scenes whose radiance is known exactly: the renderer against closed forms.
//!
//! Most of it stands in the checks of the group `estimators` ([`sampler_lab::check::estimators`]), mean and variance apart; here they run as
//! `sampler-lab check` runs them, beside what takes whole scenes: the repository's penumbra and horizon, a half-hidden light under the best
//! sampler, the sheet's shortcut.
//!
//! Seeds are fixed. The group's checks have their part in the rate that tests/failure_modes.rs states; the four other statistical tests
//! of this file have 1e-8 each. False alarms: 4e-8.
//! Points where shadow rays start and end are moved by 2⁻¹⁸ of their coordinates, by design: tests against the closed form of a
//! floor allow for the change that the closed form itself predicts from that (some 10⁻⁵ of the radiance), and no more.

use glam::Vec3;
use sampler_lab::analytic::{Horizon, Penumbra};
use sampler_lab::check::room::{
    Exact, Room, ceiling, floor_pixels, looking_at, polygon_light, replicates, spec, with_allowance,
};
use sampler_lab::check::{self, Settings};
use sampler_lab::scene::compile::{Scene, Stage};
use sampler_lab::scene::config::Estimator;
use sampler_lab::scene::load::{OpenOptions, open};
use sampler_lab::stats::Family;

/// Every check of the group, at its usual effort.
#[test]
fn estimators_have_the_mean_and_the_variance_of_their_closed_forms() {
    let mut failed = Vec::new();
    for check in check::all().iter().filter(|c| c.group == "estimators") {
        let found = check::run(check, &Settings { alpha: 1e-7, ..Settings::default() }).finding;
        println!("{}: {} ({} tests, detects {:?})", check.name, found.says, found.tests, found.detects);
        if !found.passed {
            failed.push(format!("{}: {}", check.name, found.says));
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

/// One narrow pixel straight below a light whose half is hidden: the closed form of the visible half. A bias of 1 % is
/// caught; false-alarm rate 1e-8.
#[test]
fn a_half_hidden_light_gives_the_irradiance_of_its_visible_half() {
    let light = ceiling(Vec3::Y, 0.5, 0.5);
    let hiding = [(-9.0, -9.0), (0.0, -9.0), (0.0, 9.0), (-9.0, 9.0)].map(|(x, z)| Vec3::new(x, 0.5, z));
    let mut room = Room::default();
    room.floor(4.0, 0.8);
    room.light(&light, 2.0);
    let dark = room.material(0.5, None);
    room.polygon(&hiding, dark);
    let camera = looking_at(Vec3::new(0.6, 0.3, 0.0), Vec3::ZERO, 0.5);
    let exact = floor_pixels(&camera, (1, 1), (4.0, 0.8), polygon_light(&light, 2.0), Some(&hiding))[0];
    // By symmetry half of the whole light's 0.7522…; the pixel is 0.01 wide, its first derivatives cancel.
    assert!((exact.value / (0.8 * 2.0 * 0.5 * 0.752_274_688_454_107_5) - 1.0).abs() < 2e-3, "{exact:?}");
    let scene = room.scene(&camera, (1, 1), Stage::Final);
    let means: Vec<f64> = replicates(&scene, spec("sobol"), 1024, 0..256).concat();
    let verdict = exact.test(&means, Family { tests: 1, false_alarm: 1e-8 });
    assert!(verdict.holds() && verdict.detects.unwrap() < 0.01 * exact.value, "{verdict}");
}

/// The scene's files against its closed form: 36 tiles of 4 × 4 pixels, R = 24 replicates of 256 spp, Student's t on the
/// tiles' means (per-pixel tests would be badly calibrated where few samples are lit; tiles of which
/// fewer than 100 samples in all are lit are pooled). False-alarm rate 1e-8 for the family.
#[test]
fn the_penumbra_scene_is_its_closed_form() {
    const REPLICATES: u64 = 24;
    const SPP: u32 = 256;
    let path = format!("{}/configs/penumbra.json", env!("CARGO_MANIFEST_DIR"));
    let loaded = open(path.as_ref(), &OpenOptions::default()).unwrap();
    let scene = Scene::new(&loaded.config, loaded.mesh, (24, 24), Stage::Final).unwrap();
    let pixels = with_allowance(&Penumbra::standard(24, 24).unwrap(), 8.0);
    let part = |part: fn(&Exact) -> f64| tiles(&pixels.iter().map(part).collect::<Vec<_>>());
    let (exact, allowance) = (part(|e| e.value), part(|e| e.allowance));
    let brightest = exact.iter().copied().fold(0.0, f64::max);
    // A lit sample adds about as much as the brightest tile's mean.
    let regions = pooled(&exact, 100.0 * brightest / (REPLICATES as f64 * f64::from(16 * SPP)));
    assert!(regions.len() >= 30 && exact.iter().any(|&e| e < 1e-5 * brightest), "umbra and light are both in it");
    let images: Vec<Vec<f64>> =
        replicates(&scene, spec("sobol"), SPP, 0..REPLICATES).iter().map(|i| tiles(i)).collect();
    let family = Family { tests: 36, false_alarm: 1e-8 };
    for region in regions {
        let sum = |tiles: &[f64]| region.iter().map(|&tile| tiles[tile]).sum::<f64>();
        let sums: Vec<f64> = images.iter().map(|i| sum(i)).collect();
        let verdict = Exact { value: sum(&exact), allowance: sum(&allowance) }.test(&sums, family);
        assert!(verdict.holds(), "tiles {region:?}: {verdict}");
        // A bias of 1.5 % of full light in any tile is caught.
        assert!(verdict.detects.unwrap() < 0.015 * brightest, "tiles {region:?}: {verdict}");
    }
}

/// The scene's files against its closed form: 36 tiles of 4 × 4 pixels, R = 24 replicates of 256 spp, Student's t on the tiles'
/// means. False-alarm rate 1e-8 for the family.
///
/// Rays are in single precision: a direction is off by up to some 2⁻²³, which is 1e-5 of these pixels; a border between
/// tiles that moves by that changes a tile's mean by less than 1e-5 of the contrast times the borders in it.
#[test]
fn the_horizon_scene_is_its_closed_form() {
    const ALLOWANCE: f64 = 1e-5;
    let path = format!("{}/configs/horizon.json", env!("CARGO_MANIFEST_DIR"));
    let loaded = open(path.as_ref(), &OpenOptions::default()).unwrap();
    let red = |material: &str| loaded.mesh.materials.iter().find(|m| m.name == material).unwrap().albedo.x;
    let (sky, checker) = (f64::from(red("sky")), &loaded.mesh.textures[0]);
    let [pale, dark] = [checker.height - 1, 0].map(|row| f64::from(checker.texel(0, row)[0]));
    let seen = Horizon::standard(24, 24).unwrap().image().unwrap();
    let exact = tiles(&seen.iter().map(|seen| seen.colour(pale, dark, sky)).collect::<Vec<_>>());
    let scene = Scene::new(&loaded.config, loaded.mesh, (24, 24), Stage::Final).unwrap();
    assert_eq!(scene.layout.to_string(), "pixel 0–1, 2 dimensions in all");
    let images: Vec<Vec<f64>> = replicates(&scene, spec("sobol"), 256, 0..24).iter().map(|i| tiles(i)).collect();
    let family = Family { tests: 36, false_alarm: 1e-8 };
    for (tile, &value) in exact.iter().enumerate() {
        let means: Vec<f64> = images.iter().map(|image| image[tile]).collect();
        let verdict = Exact { value, allowance: ALLOWANCE }.test(&means, family);
        assert!(verdict.holds(), "tile {tile}: {verdict}");
        // A bias of 2 % of the contrast in any tile is caught; the sky's tiles are exactly its colour.
        assert!(verdict.detects.is_none_or(|detects| detects < 0.02 * (pale - dark)), "tile {tile}: {verdict}");
    }
}

/// Tiles from dark to bright, joined until each region's sum reaches `least`.
fn pooled(exact: &[f64], least: f64) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..exact.len()).collect();
    order.sort_by(|&a, &b| exact[a].total_cmp(&exact[b]));
    let mut regions = vec![Vec::new()];
    let mut sum = 0.0;
    for tile in order {
        if sum >= least {
            regions.push(Vec::new());
            sum = 0.0;
        }
        sum += exact[tile];
        regions.last_mut().unwrap().push(tile);
    }
    regions
}

/// Means of 4 × 4 pixels of a 24 × 24 image.
fn tiles(pixels: &[f64]) -> Vec<f64> {
    let mean = |tile: usize| {
        let (x, y) = (tile % 6 * 4, tile / 6 * 4);
        (0..16).map(|k| pixels[(y + k / 4) * 24 + x + k % 4]).sum::<f64>() / 16.0
    };
    (0..36).map(mean).collect()
}

/// Two lights of very different power over one narrow pixel: unbiased, the picture is k_a (E₁ + E₂); the sheet's shortcut,
/// which leaves out the division by the choice's probability, converges to k_a (p₁E₁ + p₂E₂), exactly as predicted.
/// Two tests, false-alarm rate 1e-8.
#[test]
fn two_lights_add_up_and_the_sheets_shortcut_errs_as_predicted() {
    let (strong, weak) = (ceiling(Vec3::new(2.0, 4.0, 1.0), 0.5, 0.5), ceiling(Vec3::new(-0.3, 1.0, 0.0), 0.2, 0.3));
    let (strong_emission, weak_emission) = (90.0, 4.0);
    let mut room = Room::default();
    room.floor(5.0, 0.6);
    room.light(&strong, strong_emission);
    room.light(&weak, weak_emission);
    let camera = looking_at(Vec3::new(0.4, 0.4, -0.6), Vec3::new(0.1, 0.0, 0.0), 1.0);
    let of = |light: &[Vec3], emission: f32| {
        floor_pixels(&camera, (1, 1), (5.0, 0.6), polygon_light(light, emission), None)[0]
    };
    let (e1, e2) = (of(&strong, strong_emission), of(&weak, weak_emission));
    let (power1, power2) = (f64::from(strong_emission), f64::from(weak_emission) * 0.4 * 0.6);
    let p1 = power1 / (power1 + power2);
    let shortcut = Exact::sum([e1.times(p1), e2.times(1.0 - p1)]);
    let both = Exact::sum([e1, e2]);
    let family = Family { tests: 2, false_alarm: 1e-8 };
    for (estimator, exact) in [(Estimator::Unbiased, both), (Estimator::Sheet, shortcut)] {
        let scene = room.scene_with(&camera, (1, 1), Stage::Final, estimator);
        let verdict = exact.test(&replicates(&scene, spec("sobol"), 4096, 0..64).concat(), family);
        assert!(verdict.holds(), "{estimator:?}: {verdict}");
        assert!(verdict.detects.unwrap() < 0.1 * (both.value - shortcut.value), "the two are told apart: {verdict}");
    }
}

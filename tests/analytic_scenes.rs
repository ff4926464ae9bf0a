//! Scenes whose radiance is known exactly: the renderer against closed forms, in the mean *and*, where a sample is
//! independent of the next, in the variance, since a wrong density with a compensating factor keeps one of the two.
//!
//! Seeds are fixed. Every statistical test states its family's false-alarm rate, 1e-7 or less: below 1e-6 for the file.
//! Points where shadow rays start and end are moved by 2⁻¹⁸ of their coordinates, by design: tests against the closed form of a
//! floor allow for the change that the closed form itself predicts from that (some 10⁻⁵ of the radiance), and no more.

mod common;

use common::{
    Exact, Room, ceiling, floor_pixels, looking_at, parallelogram, polygon_light, rendered, replicates, spec,
    with_allowance,
};
use glam::{DVec3, Vec2, Vec3};
use sampler_lab::analytic::quadrature::{Tolerance, integrate};
use sampler_lab::analytic::{
    Horizon, Penumbra, PolygonLight, Receiver, ThinLens, disc_share, pixel_coverage, variance_of_one_area_sample,
};
use sampler_lab::render::{light_contribution, render_sample};
use sampler_lab::sampling::{PointSource, Sampler, point_set};
use sampler_lab::scene::compile::{Scene, Stage};
use sampler_lab::scene::config::{CameraConfig, Estimator};
use sampler_lab::scene::geometry::SurfacePoint;
use sampler_lab::scene::light::{Light, LightSet, luma};
use sampler_lab::scene::load::{OpenOptions, open};
use sampler_lab::stats::hypothesis::clopper_pearson;
use sampler_lab::stats::{Family, t_test};
use serde_json::Value;

fn reference(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

/// A JSON number, a decimal string with more digits than f64 holds, or a fraction.
fn number(value: &Value) -> f64 {
    let Some(text) = value.as_str() else { return value.as_f64().unwrap() };
    match text.split_once('/') {
        Some((p, q)) => p.parse::<f64>().unwrap() / q.parse::<f64>().unwrap(),
        None => text.parse().unwrap(),
    }
}

fn vector(value: &Value) -> DVec3 {
    DVec3::new(number(&value[0]), number(&value[1]), number(&value[2]))
}

/// The polygon cases of `irradiance.json`: the light as the renderer and as the closed form has it, and the receiver.
fn polygon_cases() -> Vec<(String, Light, PolygonLight, Receiver, f64)> {
    let file = reference(include_str!("reference/irradiance.json"));
    let case = |case: &Value| {
        let corners: Vec<DVec3> = case["light_ccw_from_front"].as_array()?.iter().map(vector).collect();
        let c: Vec<Vec3> = corners.iter().map(|c| c.as_vec3()).collect();
        let emission = number(&case["k_e"]);
        let light = Light::new("light".into(), Vec3::splat(emission as f32), &[[c[0], c[1], c[2]], [c[0], c[2], c[3]]]);
        let at = Receiver { point: vector(&case["point"]), normal: vector(&case["normal"]) };
        let name = case["name"].as_str().unwrap().to_owned();
        Some((name, light.unwrap(), PolygonLight { corners, emission }, at, number(&case["E"])))
    };
    file["cases"].as_array().unwrap().iter().filter_map(case).collect()
}

fn surface(at: &Receiver) -> SurfacePoint {
    let normal = at.normal.as_vec3();
    SurfacePoint {
        position: at.point.as_vec3(),
        normal,
        face_normal: normal,
        uv: Vec2::ZERO,
        material: 0,
        offset: 1.0 / 262_144.0,
    }
}

/// What each of `n` independent uniform samples of the light receives.
fn received(light: &Light, at: &Receiver, n: u32, seed: u64) -> Vec<f64> {
    let from = surface(at);
    let sample = |u: [f64; 2]| {
        let u = Vec2::new(u[0] as f32, u[1] as f32).min(Vec2::splat(1.0 - f32::EPSILON / 2.0));
        light_contribution(light, u, &from).map_or(0.0, |(radiance, _)| f64::from(radiance.x))
    };
    point_set(spec("uniform"), n, seed).unwrap().into_iter().map(sample).collect()
}

/// Mean against the closed form, mean square deviation against the exact variance of one sample. 18 tests; a bias of
/// 8.5 √(Var/200 000) is caught, 0.3 to 2.3 % of E, and a variance that is wrong by some 3 %. The ray offsets change E by 1e-5.
#[test]
fn one_area_sample_has_lamberts_mean_and_its_exact_variance() {
    let family = Family { tests: 18, false_alarm: 1e-7 };
    let cases = polygon_cases();
    assert_eq!(cases.len(), 11);
    let mut dark = 0;
    for (seed, (name, light, exact_light, at, irradiance)) in cases.iter().enumerate() {
        let samples = received(light, at, 200_000, seed as u64);
        if *irradiance == 0.0 {
            assert!(samples.iter().all(|&s| s == 0.0), "{name}: exactly 0");
            dark += 1;
            continue;
        }
        let mean = t_test(&samples, *irradiance, family);
        assert!(mean.holds(), "{name}, mean: {mean}");
        let squares: Vec<f64> = samples.iter().map(|s| (s - irradiance).powi(2)).collect();
        let variance = t_test(&squares, variance_of_one_area_sample(exact_light, at, None), family);
        assert!(variance.holds(), "{name}, variance: {variance}");
    }
    assert_eq!(dark, 2, "behind the light and in its plane");
}

/// Lights that are no parallelogram take their triangle from the same 2-D decision: a pentagon, a triangle, and a quadrilateral
/// whose halves differ. Mean and variance as above; A forgotten square root would be seen. Six tests.
#[test]
fn mesh_lights_have_lamberts_mean_and_the_exact_variance_of_sampling_by_area() {
    let family = Family { tests: 6, false_alarm: 1e-7 };
    let at = Receiver { point: DVec3::ZERO, normal: DVec3::new(0.6, 0.8, 0.0) };
    let shapes: [&[(f32, f32)]; 3] = [
        &[(1.0, 0.0), (2.0, 0.0), (2.5, 1.0), (1.5, 2.0), (0.5, 1.0)],
        &[(-0.5, -1.0), (1.0, -0.5), (0.0, 2.0)],
        &[(-1.0, -1.0), (0.5, -1.0), (2.0, 1.5), (-1.0, 0.25)],
    ];
    for (seed, shape) in shapes.into_iter().enumerate() {
        let c: Vec<Vec3> = shape.iter().map(|&(x, z)| Vec3::new(x, 1.25, z)).collect();
        let triangles: Vec<[Vec3; 3]> = c[1..].windows(2).map(|pair| [c[0], pair[0], pair[1]]).collect();
        let light = Light::new("mesh".into(), Vec3::ONE, &triangles).unwrap();
        assert!(!light.is_parallelogram());
        let exact = polygon_light(&c, 1.0);
        let irradiance = exact.irradiance(&at);
        let samples = received(&light, &at, 200_000, seed as u64);
        let squares: Vec<f64> = samples.iter().map(|s| (s - irradiance).powi(2)).collect();
        let verdicts = [
            t_test(&samples, irradiance, family),
            t_test(&squares, variance_of_one_area_sample(&exact, &at, None), family),
        ];
        for verdict in verdicts {
            assert!(verdict.holds(), "shape {seed}: {verdict}");
        }
    }
}

/// Nothing leaks through an absolute value.
#[test]
fn a_light_with_its_winding_flipped_gives_exactly_nothing() {
    for (name, light, exact, at, irradiance) in polygon_cases() {
        let c: Vec<Vec3> = exact.corners.iter().rev().map(|c| c.as_vec3()).collect();
        let flipped = Light::new("light".into(), Vec3::ONE, &[[c[0], c[1], c[2]], [c[0], c[2], c[3]]]).unwrap();
        assert_eq!(flipped.area, light.area);
        if irradiance > 0.0 {
            assert!(received(&flipped, &at, 1000, 1).iter().all(|&s| s == 0.0), "{name}");
        }
    }
}

/// Closed form of irradiance in the middle of nowhere: inside a box of light every ray meets emission.
#[test]
fn inside_a_furnace_every_pixel_is_exactly_its_emission() {
    let mut room = Room::default();
    let glow = room.material(1.0, Some(3.25));
    for (axis, other) in [(Vec3::X, Vec3::Y), (Vec3::Y, Vec3::Z), (Vec3::Z, Vec3::X)] {
        for side in [-1.0, 1.0] {
            room.polygon(&parallelogram(axis.cross(other) * side, axis * side, other), glow);
        }
    }
    let mut camera = looking_at(Vec3::new(0.3, -0.2, 0.1), Vec3::new(0.4, 0.7, -0.2), 100.0);
    for lens_radius in [0.0, 0.2] {
        camera.lens_radius = lens_radius;
        for name in ["sobol", "uniform", "halton:sheet"] {
            let image = rendered(&room.scene(&camera, (13, 9), Stage::Final), spec(name), 7, 1);
            assert!(image.pixels.iter().all(|p| *p == [3.25; 3]), "{name}, lens {lens_radius}");
        }
    }
}

/// A view ray that meets an emitter returns its emission, from the front and from the back.
#[test]
fn a_light_seen_directly_returns_its_emission_from_both_sides() {
    let mut room = Room::default();
    room.light(&parallelogram(Vec3::ZERO, Vec3::X * 5.0, Vec3::Y * 5.0), 7.5);
    for z in [-2.0, 2.0] {
        let camera = looking_at(Vec3::new(0.1, 0.2, z), Vec3::new(0.0, 0.1, 0.0), 60.0);
        let image = rendered(&room.scene(&camera, (8, 8), Stage::Final), spec("sobol"), 4, 1);
        assert!(image.pixels.iter().all(|p| *p == [7.5; 3]), "from z = {z}");
        let away = CameraConfig { dir: -camera.dir, ..camera };
        let black = rendered(&room.scene(&away, (8, 8), Stage::Final), spec("sobol"), 4, 1);
        assert!(black.pixels.iter().all(|p| *p == [0.0; 3]), "a ray that escapes is black");
    }
}

/// Lights over a floor with nothing between: rectangles high, low and turned, and a mesh of three triangles.
fn unoccluded_rooms() -> Vec<Room> {
    let pentagon = [(1.0, 0.0), (2.0, 0.0), (2.5, 1.0), (1.5, 2.0), (0.5, 1.0)];
    let lights: [Vec<Vec3>; 5] = [
        ceiling(Vec3::new(0.3, 3.0, -0.2), 0.5, 0.8).to_vec(),
        ceiling(Vec3::new(0.0, 0.02, 2.0), 1.0, 1.0).to_vec(),
        parallelogram(Vec3::new(-2.0, 1.0, 0.5), Vec3::new(0.0, 0.4, 0.1), Vec3::Z).to_vec(),
        ceiling(Vec3::new(0.0, 900.0, 0.0), 30.0, 20.0).to_vec(),
        pentagon.map(|(x, z)| Vec3::new(x, 2.5, z)).to_vec(),
    ];
    let room = |light: &Vec<Vec3>| {
        let mut room = Room::default();
        room.floor(4.0, 0.5);
        room.light(light, 2.0);
        room
    };
    lights.iter().map(room).collect()
}

/// Looks at the floor under them, from below all of them but the lowest, which lies to its side.
fn floor_camera() -> CameraConfig {
    looking_at(Vec3::new(0.1, 0.5, -0.4), Vec3::new(0.0, 0.0, 0.0), 40.0)
}

/// No acne, no light that shadows itself, no absolute epsilon: every sample sees the light.
#[test]
fn nothing_shadows_an_unoccluded_scene_at_any_scale() {
    for (which, room) in unoccluded_rooms().iter().enumerate() {
        for scale in [1e-6, 1.0, 1e6] {
            let mut camera = floor_camera();
            camera.pos *= scale;
            let scene = room.scaled(scale).scene(&camera, (12, 12), Stage::Final);
            let sampler = Sampler::new(spec("ld"), &scene.layout, 64, 5).unwrap();
            for at in 0..144 {
                for index in 0..64 {
                    let radiance = render_sample(&scene, &sampler, at % 12, at / 12, index);
                    assert!(radiance.x > 0.0, "room {which}, scale {scale:e}: pixel {at}, sample {index}");
                }
            }
        }
    }
}

/// A room with everything: blocker, mesh light, two lights, lens.
fn full_room() -> (Room, CameraConfig) {
    let mut room = unoccluded_rooms().remove(4);
    room.light(&ceiling(Vec3::new(-0.5, 2.0, 0.5), 0.3, 0.3), 5.0);
    let blocker = room.material(0.3, None);
    room.polygon(&ceiling(Vec3::new(0.2, 1.0, 0.1), 0.4, 0.2), blocker);
    let camera = CameraConfig { lens_radius: 0.05, focal_depth: 0.7, ..floor_camera() };
    (room, camera)
}

/// Powers of two scale every coordinate exactly, so nothing may change at all, shadows and lens included.
#[test]
fn scaling_all_lengths_by_a_power_of_two_changes_no_bit() {
    let (room, camera) = full_room();
    let image = |scale: f32| {
        let camera = CameraConfig {
            pos: camera.pos * scale,
            lens_radius: camera.lens_radius * scale,
            focal_depth: camera.focal_depth * scale,
            ..camera
        };
        rendered(&room.scaled(scale).scene(&camera, (16, 12), Stage::Final), spec("sobol"), 8, 3)
    };
    let plain = image(1.0);
    for exponent in [-20, 20, -9, 30] {
        assert_eq!(image(2f32.powi(exponent)), plain, "scale 2^{exponent}");
    }
}

/// Factors 10±⁶ round every coordinate (2⁻²⁴ each). A sample's point, light point and offset then err by some 4 roundings of
/// the largest coordinate in play, 4: δ = 2⁻²⁰ beside distances of at least 1; cos cos / r² moves by at most 6 δ
/// and a dozen roundings of its own. Without edges in the picture no sample can jump.
#[test]
fn scaling_all_lengths_by_a_million_changes_pixels_by_rounding_alone() {
    let bound = 6.0 * 2f64.powi(-20) + 12.0 * 2f64.powi(-24);
    for (which, room) in unoccluded_rooms().iter().enumerate().filter(|(which, _)| [0, 2, 4].contains(which)) {
        let image = |scale: f32| {
            let camera = CameraConfig { pos: floor_camera().pos * scale, ..floor_camera() };
            rendered(&room.scaled(scale).scene(&camera, (12, 12), Stage::Final), spec("sobol"), 16, 3)
        };
        let plain = image(1.0);
        for scale in [1e-6, 1e6] {
            for (a, b) in image(scale).pixels.iter().zip(&plain.pixels) {
                let change = (f64::from(a[0]) / f64::from(b[0]) - 1.0).abs();
                assert!(change <= bound, "room {which}, scale {scale:e}: {change:e} above {bound:e}");
            }
        }
    }
}

/// One narrow pixel straight below a light whose half is hidden: the closed form of the visible half. A bias of 1 % is
/// caught; false-alarm rate 1e-7.
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
    let verdict = exact.test(&means, Family { tests: 1, false_alarm: 1e-7 });
    assert!(verdict.holds() && verdict.detects.unwrap() < 0.01 * exact.value, "{verdict}");
}

/// The scene's files against its closed form: 36 tiles of 4 × 4 pixels, R = 24 replicates of 256 spp, Student's t on the
/// tiles' means (per-pixel tests would be badly calibrated where few samples are lit; tiles of which
/// fewer than 100 samples in all are lit are pooled). False-alarm rate 1e-7 for the family.
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
    let family = Family { tests: 36, false_alarm: 1e-7 };
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
/// means. False-alarm rate 1e-7 for the family.
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
    let family = Family { tests: 36, false_alarm: 1e-7 };
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

/// A glowing half-plane at depth z that covers image positions right of `edge` pixels, before a camera at the origin along +z.
fn edge_scene(lens: &ThinLens, fov: f32, size: (u32, u32), z: f64, edge: f64) -> Scene {
    let half = libm::tan(f64::from(fov).to_radians() / 2.0);
    // Image x runs along dir × up = −x; one pixel is 2 z half / height wide.
    let x = -(edge - f64::from(size.0) / 2.0) * 2.0 * z * half / f64::from(size.1);
    let reach = 40.0 * z;
    let mut room = Room::default();
    let corners = [(x, -reach), (x, reach), (x - reach, reach), (x - reach, -reach)];
    room.light(&corners.map(|(x, y)| Vec3::new(x as f32, y as f32, z as f32)), 1.0);
    let camera = CameraConfig {
        pos: Vec3::ZERO,
        dir: Vec3::Z,
        up: Vec3::Y,
        fov_degrees: fov,
        lens_radius: lens.radius as f32,
        focal_depth: lens.focal_depth as f32,
    };
    room.scene(&camera, size, Stage::Final)
}

/// Mean of the defocused edge's profile over the pixel `[column, column + 1]`, `blur` pixels in radius.
fn exact_edge_pixel(column: u32, edge: f64, blur: f64) -> f64 {
    let from = f64::from(column);
    if blur == 0.0 {
        return (from + 1.0 - edge).clamp(0.0, 1.0);
    }
    let profile = |x: f64| disc_share((x - edge) / blur);
    integrate(profile, [from, from + 1.0], &[edge - blur, edge + blur], Tolerance::absolute(1e-12)).unwrap().value
}

/// The circles of confusion of `camera.json`, as blurred edges: samples are independent and 0 or 1, so the count in a column
/// is binomial with the disc's share averaged over the pixel, and Clopper and Pearson's interval tests it exactly,
/// also where hardly any sample is lit. The mean position of the edge, Σ (1 − value) along a row, must be the chief ray's: a lens
/// does not shift the picture (Student's t over rows). 64 columns and a position in five cases, false-alarm rate 1e-7 together.
#[test]
fn a_defocused_edge_has_the_profile_of_the_circle_of_confusion() {
    const SPP: u32 = 64;
    let family = Family { tests: 5 * 65, false_alarm: 1e-7 };
    let (width, edge) = (64, 32.25);
    for case in reference(include_str!("reference/camera.json"))["coc"].as_array().unwrap() {
        let lens = ThinLens { radius: number(&case["R"]), focal_depth: number(&case["f"]) };
        let (z, fov) = (number(&case["z"]), number(&case["fov_y_deg"]) as f32);
        let height = case["image_height_px"].as_u64().unwrap() as u32;
        let blur = number(&case["blur_radius_px"]);
        let scene = edge_scene(&lens, fov, (width, height), z, edge);
        let image = rendered(&scene, spec("uniform"), SPP, 7);
        let value = |row: u32, column: u32| f64::from(image.pixels[(row * width + column) as usize][0]);
        for column in 0..width {
            let exact = exact_edge_pixel(column, edge, blur);
            let lit: f64 = (0..height).map(|row| value(row, column) * f64::from(SPP)).sum();
            let [low, high] = clopper_pearson(lit as u64, u64::from(height * SPP), 1.0 - family.per_test());
            assert!((low..=high).contains(&exact), "{case}: column {column}: {exact} outside {low} to {high}");
            let outside = exact == 0.0 || exact == 1.0;
            assert!(!outside || lit == exact * f64::from(height * SPP), "{case}: column {column} is not blurred");
        }
        let positions: Vec<f64> =
            (0..height).map(|row| (0..width).map(|column| 1.0 - value(row, column)).sum()).collect();
        let verdict = t_test(&positions, edge, family);
        assert!(verdict.holds(), "{case}: position of the edge: {verdict}");
        assert!(verdict.detects.unwrap() < 0.5, "{case}: a shift of half a pixel would be caught");
    }
}

/// Focus is a plane: an edge in it is sharp far off the axis too. Measured along the ray, the plane would lie at f cos there,
/// and the edge would spread over more than the two columns beside it.
#[test]
fn focus_is_measured_along_the_axis_not_along_the_ray() {
    let lens = ThinLens { radius: 0.25, focal_depth: 2.0 };
    let (width, height, fov) = (100u32, 100u32, 90.0f32);
    let edge = 92.5;
    let cosine = 1.0 / libm::hypot(1.0, (edge - 50.0) / 50.0);
    let along_the_ray = ThinLens { focal_depth: lens.focal_depth * cosine, ..lens };
    assert!(along_the_ray.blur_radius_px(lens.focal_depth, 90.0, 100.0) > 1.5, "the mistake would be seen");
    let image = rendered(&edge_scene(&lens, fov, (width, height), 2.0, edge), spec("ld"), 16, 1);
    for (at, pixel) in image.pixels.iter().enumerate() {
        let column = at as u32 % width;
        if column != 92 {
            assert_eq!(pixel[0], if column < 92 { 0.0 } else { 1.0 }, "column {column}");
        }
    }
}

/// One pixel crossed by a half-plane a x + b y ≤ c, seen through a pinhole: samples are exactly 0 or 1 (so their variance is
/// p (1 − p)), their share is the covered area, y downwards. 11 cases, false-alarm rate 1e-7; 1.2 % of the pixel is caught.
#[test]
fn a_pixel_is_covered_by_an_edge_to_its_exact_area() {
    const SAMPLES: u32 = 1 << 17;
    let family = Family { tests: 22, false_alarm: 1e-7 };
    for case in reference(include_str!("reference/camera.json"))["pixel_coverage"].as_array().unwrap() {
        let [a, b, c] = ["a", "b", "c"].map(|key| number(&case[key]));
        let exact = pixel_coverage(a, b, c);
        assert!((exact - number(&case["area"])).abs() < 1e-14);
        let scene = half_plane_scene(a, b, c);
        let sampler = Sampler::new(spec("uniform"), &scene.layout, SAMPLES, 3).unwrap();
        let seen: Vec<f64> = (0..SAMPLES).map(|i| f64::from(render_sample(&scene, &sampler, 0, 0, i).x)).collect();
        assert!(seen.iter().all(|&v| v == 0.0 || v == 1.0), "{case}");
        let mean = t_test(&seen, exact, family);
        assert!(mean.holds(), "{case}: {mean}");
        let squares: Vec<f64> = seen.iter().map(|v| (v - exact).powi(2)).collect();
        let variance = t_test(&squares, exact * (1.0 - exact), family);
        assert!(variance.holds(), "{case}, variance: {variance}");
    }
}

/// White where a x + b y ≤ c in the only pixel's coordinates, in the plane z = 1 before a camera of 90° at the origin.
fn half_plane_scene(a: f64, b: f64, c: f64) -> Scene {
    let (normal, level) = (DVec3::new(a, b, 0.0), c);
    let along = DVec3::new(-b, a, 0.0) / normal.length();
    let foot = normal * (level / normal.length_squared());
    let inwards = -normal / normal.length();
    let at = |along_by: f64, in_by: f64| {
        let p = foot + along * along_by + inwards * in_by;
        // Image (0, 0) is the upper left corner; right is −x, down is −y, the pixel is 2 wide at depth 1.
        Vec3::new(-(2.0 * p.x - 1.0) as f32, (1.0 - 2.0 * p.y) as f32, 1.0)
    };
    let mut room = Room::default();
    let white = room.material(1.0, None);
    room.polygon(&[at(-9.0, 0.0), at(9.0, 0.0), at(9.0, 9.0), at(-9.0, 9.0)], white);
    room.scene(&looking_at(Vec3::ZERO, Vec3::Z, 90.0), (1, 1), Stage::Aa)
}

/// Two lights of very different power over one narrow pixel: unbiased, the picture is k_a (E₁ + E₂); the sheet's shortcut,
/// which leaves out the division by the choice's probability, converges to k_a (p₁E₁ + p₂E₂), exactly as predicted.
/// Two tests, false-alarm rate 1e-7.
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
    let family = Family { tests: 2, false_alarm: 1e-7 };
    for (estimator, exact) in [(Estimator::Unbiased, both), (Estimator::Sheet, shortcut)] {
        let scene = room.scene_with(&camera, (1, 1), Stage::Final, estimator);
        let verdict = exact.test(&replicates(&scene, spec("sobol"), 4096, 0..64).concat(), family);
        assert!(verdict.holds(), "{estimator:?}: {verdict}");
        assert!(verdict.detects.unwrap() < 0.1 * (both.value - shortcut.value), "the two are told apart: {verdict}");
    }
}

/// Of two lights the one without power is never chosen, it is not even asked about.
#[test]
fn a_light_without_power_is_never_chosen() {
    let mut room = Room::default();
    room.floor(5.0, 0.6);
    room.light(&ceiling(Vec3::new(0.0, 2.0, 0.0), 0.5, 0.5), 0.0);
    room.light(&ceiling(Vec3::new(1.0, 2.0, 0.0), 0.5, 0.5), 3.0);
    let scene = room.scene(&floor_camera(), (4, 4), Stage::Final);
    let lights = scene.lights.as_ref().unwrap().lights();
    assert_eq!((lights.len(), luma(lights[0].emission) > 0.0), (1, true));
    assert_eq!(scene.layout.to_string(), "pixel 0–1, light point 2–3, 4 dimensions in all");
}

/// Powers 10⁻³⁰ beside 10³⁰. Every number that can pick is tried at the ends, among them 0, which
/// unrandomised sets give to every pixel's first sample: each probability is the share of numbers that pick the light, so
/// the mean is exact and nothing divides by 0.
#[test]
fn lights_of_1e_minus_30_and_1e30_stand_side_by_side() {
    for order in [[1e-30, 1e30], [1e30, 1e-30]] {
        let mut room = Room::default();
        room.floor(5.0, 0.6);
        room.light(&ceiling(Vec3::new(0.0, 2.0, 0.0), 0.5, 0.5), order[0]);
        room.light(&ceiling(Vec3::new(1.0, 2.0, 0.0), 0.5, 0.5), order[1]);
        let camera = floor_camera();
        let scene = room.scene(&camera, (4, 4), Stage::Final);
        let Some(LightSet::Many { pmf, cumulative, .. }) = &scene.lights else { panic!("two lights") };
        assert!(pmf.iter().all(|&p| p > 0.0) && pmf.iter().map(|&p| f64::from(p)).sum::<f64>() == 1.0, "{pmf:?}");
        let mut before = 0.0;
        for (&p, &up_to) in pmf.iter().zip(cumulative) {
            // Probabilities are whole multiples of the numbers' spacing, so a light is picked by p · 2²⁴ of them exactly.
            assert_eq!((up_to - before, (up_to * 2f64.powi(24)).fract()), (f64::from(p), 0.0));
            before = up_to;
        }
        for name in ["halton:plain", "halton:joint:none", "ld:sheet", "sobol"] {
            let image = rendered(&scene, spec(name), 32, 1);
            assert!(image.pixels.iter().flatten().all(|c| c.is_finite()), "{name}");
        }
        // One light alone is the picture, to 10⁻⁶⁰; 32 tests, false-alarm rate 1e-7.
        let bright = if order[0] > 1.0 { Vec3::new(0.0, 2.0, 0.0) } else { Vec3::new(1.0, 2.0, 0.0) };
        let exact = floor_pixels(&camera, (4, 4), (5.0, 0.6), polygon_light(&ceiling(bright, 0.5, 0.5), 1e30), None);
        let images = replicates(&scene, spec("sobol"), 64, 0..64);
        for (pixel, exact) in exact.iter().enumerate() {
            let values: Vec<f64> = images.iter().map(|i| i[pixel]).collect();
            let verdict = exact.test(&values, Family { tests: 32, false_alarm: 1e-7 });
            assert!(verdict.holds(), "{order:?}, pixel {pixel}: {verdict}");
        }
    }
}

/// Triangles without area among a light's, and a light of nothing else.
#[test]
fn a_degenerate_triangle_gives_nothing_and_is_never_chosen() {
    let quad = ceiling(Vec3::new(0.2, 2.0, 0.0), 0.5, 0.5);
    let (spike, point) = ([quad[0], quad[1], quad[0]], [quad[2]; 3]);
    let build = |degenerate: bool| {
        let mut room = Room::default();
        room.floor(5.0, 0.6);
        let glow = room.material(1.0, Some(3.0));
        if degenerate {
            room.triangle(spike, glow);
            room.triangle(point, glow);
        }
        room.polygon(&quad, glow);
        room.scene(&floor_camera(), (6, 6), Stage::Final)
    };
    let [plain, degenerate] = [false, true].map(|d| rendered(&build(d), spec("sobol"), 16, 1));
    assert_eq!(plain, degenerate, "bit for bit, and finite");
    let mut room = Room::default();
    room.floor(5.0, 0.6);
    room.light(&[quad[0], quad[1], quad[0]], 3.0);
    let scene = room.scene(&floor_camera(), (4, 4), Stage::Final);
    assert!(matches!(scene.lights, Some(LightSet::Dark)) && !scene.warnings.is_empty());
    let image = rendered(&scene, spec("sobol"), 4, 1);
    assert!(image.pixels.iter().flatten().all(|&c| c == 0.0));
    let sampler = Sampler::new(spec("sobol"), &scene.layout, 4, 1).unwrap();
    assert_eq!(sampler.samples(), 4);
}

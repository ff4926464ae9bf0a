//! Rows 54 to 59: points of the lens, and cameras that files ask for.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::{CAMERA, Check, Context, Finding, row};
use crate::check::estimators::uniform_points;
use crate::check::room::{Room, looking_at, parallelogram, rendered, spec};
use crate::check::{Kind, Tally};
use crate::sampling::warp::square_to_disk;
use crate::scene::camera::Aperture;
use crate::scene::compile::{Scene, Stage};
use crate::scene::config::{CameraConfig, SceneConfig};
use crate::scene::mesh::Mesh;
use crate::stats::hypothesis::t_test_of_squares;
use crate::stats::{Moments, t_test};

/// The checks of this file.
pub fn checks() -> Vec<Check> {
    vec![
        row(
            CAMERA,
            &[54],
            "lens-without-root",
            "a lens point at r = u in place of √u makes the blur centre-heavy (E r = 1/2, E r² = 1/3); ours is even: 2/3 and 1/2",
            Kind::Statistical,
            lens_without_root,
        ),
        row(
            CAMERA,
            &[55],
            "concentric-centre",
            "the concentric map is 0/0 at (1/2, 1/2): ours gives the centre, and stays in the disk for every corner case",
            Kind::Exact,
            concentric_centre,
        ),
        row(
            CAMERA,
            &[56],
            "camera-parallel",
            "a view direction of 0 or parallel to up has no basis: refused by name; close to it all rays are finite",
            Kind::Exact,
            parallel,
        ),
        row(
            CAMERA,
            &[57],
            "camera-fov",
            "a field of view of 0, 180, −10 or NaN degrees is refused by name; 0.001 and 179.9 give finite rays",
            Kind::Exact,
            field_of_view,
        ),
        row(
            CAMERA,
            &[58],
            "lens-radius-ends",
            "a lens of radius 0 is a pinhole bit for bit; one of 1e9 gives finite rays and a finite picture; what overflows is refused",
            Kind::Exact,
            lens_radius,
        ),
        row(
            CAMERA,
            &[59],
            "focal-depth-ends",
            "a focal depth of 0, below, infinite or NaN is refused by name; towards infinity the lens's rays become parallel, never NaN",
            Kind::Exact,
            focal_depth,
        ),
    ]
}

/// The literal mistake: a radius u, an angle 2π v.
fn without_root(u: Vec2) -> Vec2 {
    u.x * Vec2::new(libm::cosf(TAU * u.y), libm::sinf(TAU * u.y))
}

fn lens_without_root(context: &Context) -> Finding {
    let family = context.family(2);
    let radii = |map: fn(Vec2) -> Vec2| -> Vec<f64> {
        let n = context.replicates(50_000, 2_000);
        uniform_points(context.seed, n).map(|u| f64::from(map(u).length())).collect()
    };
    let (ours, wrong) = (radii(square_to_disk), radii(without_root));
    let mut tally = Tally::new();
    tally.verdict("E r", &t_test(&ours, 2.0 / 3.0, family), 1.0);
    let squares: Vec<f64> = ours.iter().map(|r| r * r).collect();
    tally.verdict("E r²", &t_test_of_squares(&squares, 0.5, family), 1.0);
    let seen = t_test(&wrong, 2.0 / 3.0, family);
    tally.fact(format!("r = u is seen: {seen}"), !seen.holds());
    let means = [ours, wrong].map(|radii| radii.into_iter().collect::<Moments>().mean().unwrap_or(f64::NAN));
    tally.saying(format!("E r: ours {:.4}, with r = u {:.4}", means[0], means[1]))
}

fn concentric_centre(_: &Context) -> Finding {
    let mut tally = Tally::new();
    let centre = square_to_disk(Vec2::splat(0.5));
    tally.fact(format!("(1/2, 1/2) goes to {centre}"), centre == Vec2::ZERO);
    let [below, above] = [0.5_f32.next_down(), 0.5_f32.next_up()];
    let largest = 1.0 - f32::EPSILON / 2.0;
    for x in [0.0, 0.25, below, 0.5, above, 0.75, largest] {
        for y in [0.0, 0.25, below, 0.5, above, 0.75, largest] {
            let p = square_to_disk(Vec2::new(x, y));
            tally.fact(format!("({x}, {y}) goes to {p}"), p.is_finite() && p.length() <= 1.0 + 2.0 * f32::EPSILON);
        }
    }
    let literal = { |a: f32, b: f32| b / a }(0.0, 0.0);
    tally.fact(format!("the literal angle there is {literal}"), literal.is_nan());
    tally.saying(format!("the centre is {centre}; the literal b/a there is {literal}; 49 corner cases are in the disk"))
}

/// What the loader says of a camera with these settings.
fn loaded(sets: &[&str]) -> Result<SceneConfig, String> {
    let sets: Vec<String> = sets.iter().map(|&s| s.to_owned()).collect();
    SceneConfig::parse(b"{\"camera\": {\"pos\": [0, 0, 0]}}", "scene.json", &sets).map_err(|error| error.to_string())
}

/// Is each setting refused with words that name the key, what is expected, and what was found?
fn refused(tally: &mut Tally, cases: &[(&[&str], &str, &str)]) {
    for (sets, key, expected) in cases {
        let said = loaded(sets).err().unwrap_or_else(|| "accepted".to_owned());
        let named = [*key, *expected, "expected", "found"].iter().all(|word| said.contains(word));
        tally.fact(format!("{sets:?}: {said}"), named);
    }
}

/// A scene of one wall before a camera with these settings.
fn before_wall(camera: &CameraConfig) -> Scene {
    let mut room = Room::default();
    let dir = camera.dir.as_dvec3().normalize().as_vec3();
    let side = dir.any_orthonormal_vector();
    let white = room.material(0.8, None);
    room.polygon(&parallelogram(camera.pos + dir * 2.0, side * 3.0, dir.cross(side) * 3.0), white);
    room.scene(camera, (9, 7), Stage::Dof)
}

/// What compiling a scene says of a lens that single precision cannot hold.
fn overflowing(lens_radius: f32, focal_depth: f32) -> String {
    let camera = CameraConfig { lens_radius, focal_depth, ..looking_at(Vec3::ZERO, Vec3::Z, 50.0) };
    let config = SceneConfig { camera, auto_focus: false, ..SceneConfig::default() };
    let scene = Scene::new(&config, Mesh::default(), (1, 1), Stage::Dof);
    scene.err().map_or_else(|| "accepted".to_owned(), |error| error.to_string())
}

/// Are all rays of the picture's corners and middle finite, with a direction of length 1?
fn rays_are_finite(scene: &Scene) -> bool {
    let (w, h) = (scene.camera.size().0 as f32, scene.camera.size().1 as f32);
    let places = [(0.0, 0.0), (w, 0.0), (0.0, h), (w, h), (0.5 * w, 0.5 * h), (0.3 * w, 0.9 * h)];
    places.iter().all(|&(x, y)| {
        let at = Vec2::new(x, y);
        let points = [0.0, 0.25, 0.5, 1.0 - f32::EPSILON / 2.0];
        points.iter().flat_map(|&u| points.map(|v| Vec2::new(u, v))).all(|u| {
            let ray = match scene.camera.aperture {
                Aperture::Pinhole => scene.camera.pinhole_ray(at),
                Aperture::ThinLens { radius, focal_depth, .. } => scene.camera.lens_ray(at, u, radius, focal_depth),
            };
            ray.origin.is_finite() && (ray.direction.length() - 1.0).abs() < 1e-5
        })
    })
}

/// Does the loader take these settings, and are the camera's rays finite?
fn accepted(tally: &mut Tally, sets: &[&str]) {
    match loaded(sets) {
        Ok(config) => {
            let scene = before_wall(&config.camera);
            tally.fact(format!("{sets:?}: all rays are finite"), rays_are_finite(&scene));
        }
        Err(said) => {
            tally.fact(format!("{sets:?}: {said}"), false);
        }
    }
}

fn parallel(_: &Context) -> Finding {
    let mut tally = Tally::new();
    let (not_parallel, a_direction) = ("not parallel to dir", "a direction");
    refused(
        &mut tally,
        &[
            (&["camera.dir=[0,1,0]"], "camera.up", not_parallel),
            (&["camera.dir=[0,-3,0]"], "camera.up", not_parallel),
            (&["camera.dir=[2,2,2]", "camera.up=[1,1,1]"], "camera.up", not_parallel),
            (&["camera.dir=[1e-7,1,0]"], "camera.up", not_parallel),
            (&["camera.dir=[0,0,0]"], "camera.dir", a_direction),
            (&["camera.up=[0,0,0]"], "camera.up", a_direction),
            (&["camera.dir=[1e-30,0,0]"], "camera.dir", a_direction),
            (&["camera.dir=NaN"], "camera.dir", a_direction),
            (&["camera.dir=[1,0]"], "camera.dir", a_direction),
        ],
    );
    for sets in [&["camera.dir=[1e-5,1,0]"], &["camera.dir=[1e-11,0,0]"], &["camera.dir=[0,0,1e12]"]] {
        accepted(&mut tally, sets);
    }
    let literal = Vec3::Y.cross(Vec3::Y).normalize();
    tally.fact(format!("the literal basis is {literal}"), literal.is_nan());
    let said = loaded(&["camera.dir=[0,1,0]"]).err().unwrap_or_default();
    tally.saying(format!("{said}; the literal basis would be {literal}"))
}

fn field_of_view(_: &Context) -> Finding {
    let mut tally = Tally::new();
    let expected = "an angle between 0 and 180 degrees";
    for value in ["0", "180", "-10", "NaN", "1e999", "360", "null", "\"wide\""] {
        refused(&mut tally, &[(&[&format!("camera.fov={value}")], "camera.fov", expected)]);
    }
    accepted(&mut tally, &["camera.fov=0.001", "camera.lens_radius=0"]);
    accepted(&mut tally, &["camera.fov=179.9", "camera.lens_radius=0"]);
    tally.saying(loaded(&["camera.fov=180"]).err().unwrap_or_default())
}

/// Radius 0 through the code of the lens, and a lens too small to move anything through the whole renderer.
fn lens_radius(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let camera = looking_at(Vec3::new(0.3, 0.2, -1.0), Vec3::new(0.1, 0.4, 1.0), 50.0);
    let scene = before_wall(&camera);
    let other = uniform_points(context.seed, 4096).filter(|&u| {
        let at = u * Vec2::new(9.0, 7.0);
        scene.camera.lens_ray(at, u, 0.0, 1.0) != scene.camera.pinhole_ray(at)
    });
    let other = other.count();
    tally.fact(format!("{other} of 4096 rays of a lens of radius 0 differ from the pinhole's"), other == 0);
    let pinhole = matches!(scene.camera.aperture, Aperture::Pinhole) && scene.layout.claims().len() == 1;
    tally.fact("radius 0 is a pinhole, and no number is spent on it", pinhole);
    let image = |lens_radius: f32| {
        rendered(&before_wall(&CameraConfig { lens_radius, ..camera }), spec("uniform"), 16, context.seed)
    };
    tally.fact("a lens of radius 1e-30 gives the pinhole's picture, bit for bit", image(1e-30) == image(0.0));
    for radius in [1.0, 1e9] {
        let scene = before_wall(&CameraConfig { lens_radius: radius, ..camera });
        tally.fact(format!("radius {radius:e}: all rays are finite"), rays_are_finite(&scene));
        let finite = image(radius).pixels.iter().flatten().all(|c| c.is_finite());
        tally.fact(format!("radius {radius:e}: a finite picture"), finite);
    }
    let expected = "a length, 0 (a pinhole) or above";
    for value in ["-1", "-1e-9", "NaN", "1e999"] {
        refused(&mut tally, &[(&[&format!("camera.lens_radius={value}")], "camera.lens_radius", expected)]);
    }
    let said = overflowing(1e25, 1.0);
    tally.fact(format!("radius 1e25: {said}"), said.starts_with("camera.lens_radius: expected a length up to 5e11"));
    tally.saying("radius 0: 4096 rays and the picture are the pinhole's bit for bit; 1e9: all finite")
}

fn focal_depth(_: &Context) -> Finding {
    let mut tally = Tally::new();
    for value in ["0", "-2", "-1e-30", "NaN", "1e999", "Infinity"] {
        refused(&mut tally, &[(&[&format!("camera.focal_depth={value}")], "camera.focal_depth", "a length above 0")]);
    }
    for value in ["1e-6", "1e6", "3e38"] {
        accepted(&mut tally, &[&format!("camera.focal_depth={value}"), "camera.lens_radius=0.1"]);
    }
    let said = overflowing(0.1, 1e-25);
    tally.fact(
        format!("depth 1e-25 behind a lens of 0.1: {said}"),
        said.starts_with("camera.focal_depth: expected at least"),
    );
    let scene = before_wall(&looking_at(Vec3::ZERO, Vec3::Z, 50.0));
    for u in [Vec2::ZERO, Vec2::splat(0.5), Vec2::new(0.9, 0.3)] {
        let at = Vec2::new(2.0, 5.0);
        let (lens, chief) = (scene.camera.lens_ray(at, u, 0.1, f32::INFINITY), scene.camera.pinhole_ray(at));
        let moved = lens.origin - chief.origin;
        tally.fact(
            format!("focused at infinity, u = {u}: direction {}, origin moved by {moved}", lens.direction),
            lens.direction == chief.direction && moved.is_finite() && moved.length() <= 0.1001,
        );
    }
    tally.saying(loaded(&["camera.focal_depth=0"]).err().unwrap_or_default())
}

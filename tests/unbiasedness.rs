//! The renderer's estimate of a random scene against Lambert's closed form: random rectangle light, receiver, view, pinhole or
//! lens, under each unbiased sampler.
//!
//! The generator aims at trouble: lights that are near, tiny, low over the horizon, partly below it, seen edge-on or from behind.
//! Student's t over whole images of independent seeds; the family's false-alarm rate is 1e-7. Each test would catch a bias of
//! about nine standard errors: below 0.5 % of the radiance for half of the scenes and below 10 % for all, which the test itself checks. A missing
//! cosine, a wrong area, a pdf off by a factor, one decision reading another's numbers or a light leaking from
//! behind are all far above that.
//!
//! Rays start and end 2⁻¹⁸ of the coordinates off their surfaces: where a sampler's own error is smaller than that (a tiny light),
//! the closed form itself says how far such a displacement may move the result, and the test allows as much.

mod common;

use std::cell::RefCell;

use common::{Room, parallelogram, rendered, spec};
use glam::{DQuat, DVec3, Vec3};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use sampler_lab::analytic::{PolygonLight, Receiver};
use sampler_lab::scene::compile::Stage;
use sampler_lab::scene::config::CameraConfig;
use sampler_lab::stats::{Family, t_test};

const CASES: u32 = 120;
const REPLICATES: u64 = 96;
const SPP: u32 = 64;
const ALBEDO: f32 = 0.5;
const SIZE: (u32, u32) = (2, 2);
const SAMPLERS: [&str; 6] = ["uniform", "stratified", "halton", "hammersley", "ld", "sobol"];

/// A floor y = 0 about the origin, a light and a camera that looks at the origin, before the whole is turned and moved.
#[derive(Debug, Clone)]
struct Case {
    light: [DVec3; 4],
    eye: DVec3,
    fov_degrees: f64,
    lens_radius: f64,
    focal_depth: f64,
    turn: DQuat,
    shift: DVec3,
    sampler: &'static str,
}

/// Maps sixteen uniform numbers to a case; `kind` says which trouble.
fn case(kind: usize, u: [f64; 16], sampler: usize) -> Case {
    let between = |u: f64, low: f64, high: f64| low + (high - low) * u;
    let around = |u: f64| {
        let angle = std::f64::consts::TAU * u;
        DVec3::new(angle.cos(), 0.0, angle.sin())
    };
    let (tiny, middle) = ([0.001, 0.01], [0.1, 0.8]);
    // Horizontal distance, height, half-sizes, and how far the normal may turn away from the receiver.
    let (distance, height, halves, tilt) = match kind {
        0 => ([0.0, 2.0], [0.5, 2.5], [middle, middle], 0.8),
        1 => ([0.0, 0.1], [0.15, 0.4], [[0.2, 0.6]; 2], 0.05),
        2 => ([0.0, 2.0], [0.5, 1.5], [tiny, tiny], 0.5),
        3 => ([1.0, 2.0], [0.05, 0.2], [[0.02, 0.05], middle], 0.2),
        4 => ([1.0, 2.0], [-0.1, 0.1], [[0.3, 0.6], middle], 0.2),
        5 => ([0.5, 2.0], [0.3, 1.5], [middle, middle], 1.7),
        _ => ([0.0, 2.0], [0.3, 1.5], [middle, middle], 3.1),
    };
    let centre =
        around(u[0]) * between(u[1], distance[0], distance[1]) + DVec3::Y * between(u[2], height[0], height[1]);
    let aim = -centre.normalize();
    let across = aim.cross(around(u[3]) + DVec3::Y * 0.3).normalize();
    let normal = DQuat::from_axis_angle(across, tilt * between(u[4], -1.0, 1.0)) * aim;
    let e1 = if (3..=4).contains(&kind) { normal.cross(DVec3::Y).cross(normal).normalize() } else { across };
    let e1 = (e1 - normal * e1.dot(normal)).normalize();
    let e2 = normal.cross(e1);
    let half = |k: usize| between(u[5 + k], halves[k][0], halves[k][1]);
    let (e1, e2) = (e1 * half(0), e2 * half(1));
    let elevation = between(u[7], 0.3, 1.5);
    let reach = between(u[8], 0.1, 1.0);
    let eye = (around(u[9]) * elevation.cos() + DVec3::Y * elevation.sin()) * reach;
    let width = between(u[10], 0.02, 0.1);
    Case {
        light: [centre - e1 - e2, centre + e1 - e2, centre + e1 + e2, centre - e1 + e2],
        eye,
        fov_degrees: 2.0 * (0.5 * width).atan().to_degrees(),
        lens_radius: if u[11] < 0.4 { 0.0 } else { between(u[11], 0.005, 0.05) * reach },
        focal_depth: between(u[12], 0.5, 2.0) * reach,
        turn: DQuat::from_axis_angle((around(u[13]) + DVec3::Y * 0.5).normalize(), 3.0 * u[14]),
        shift: around(u[15]) * u[14] + DVec3::Y * (u[15] - 0.5),
        sampler: SAMPLERS[sampler],
    }
}

impl Case {
    /// Camera axes: forward, right, up.
    fn axes(&self) -> [DVec3; 3] {
        let dir = -self.eye.normalize();
        let right = dir.cross(DVec3::Y).normalize();
        [dir, right, right.cross(dir)]
    }

    /// Where the floor is met by the ray through the image point (x, y), both −1 to 1, from the lens point (a, b) of the unit
    /// disk; and that lens point in space.
    fn trace(&self, [x, y]: [f64; 2], [a, b]: [f64; 2]) -> [DVec3; 2] {
        let [dir, right, up] = self.axes();
        let half = (0.5 * self.fov_degrees.to_radians()).tan();
        let offset = (right * a + up * b) * self.lens_radius;
        let (from, way) = (self.eye + offset, dir + (right * x + up * y) * half - offset / self.focal_depth);
        [from - way * (from.y / way.y), from]
    }

    /// From the case's own coordinates to the scene's.
    fn place(&self, p: DVec3) -> Vec3 {
        (self.turn * p + self.shift).as_vec3()
    }

    fn floor(&self) -> [Vec3; 4] {
        parallelogram(Vec3::ZERO, Vec3::Z * 2.0, Vec3::X * 2.0).map(|c| self.place(c.as_dvec3()))
    }

    /// The light as the renderer has it: its corners are single precision, which counts for a tiny one.
    fn closed_form(&self) -> PolygonLight {
        PolygonLight { corners: self.light.map(|c| self.place(c).as_dvec3()).to_vec(), emission: 1.0 }
    }

    /// How far the mean may be off the closed form: both ends of a shadow ray are moved by 2⁻¹⁸ of the largest coordinate
    /// of their triangles, so light and receiver are displaced against each other by at most the sum along any axis
    /// (position rounding, some 2⁻²² of them, included); and 64 roundings of single precision in between.
    fn allowance(&self, exact: f64) -> f64 {
        let largest = |corners: &[Vec3]| f64::from(corners.iter().fold(0.0f32, |m, c| m.max(c.abs().max_element())));
        let step = (largest(&self.floor()) + largest(&self.light.map(|c| self.place(c)))) * 1.1 / 262_144.0;
        let moved = |axis: DVec3| {
            let mut light = self.closed_form();
            light.corners.iter_mut().for_each(|c| *c += axis * step);
            (self.exact(4, &light) - self.exact(4, &self.closed_form())).abs()
        };
        [DVec3::X, DVec3::Y, DVec3::Z].map(moved).iter().sum::<f64>() + 64.0 * 2f64.powi(-24) * exact
    }

    /// Rays between camera and floor stay on one side of the light's plane and clear of it, so the light is never in the
    /// picture and the closed form has no kink there; and they meet the floor where there is one.
    fn light_is_out_of_the_way(&self) -> bool {
        let normal = (self.light[1] - self.light[0]).cross(self.light[3] - self.light[0]).normalize();
        let mut sides = Vec::new();
        for corner in 0..16 {
            let sign = |bit: i32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            for point in self.trace([sign(0), sign(1)], [sign(2), sign(3)]) {
                sides.push(normal.dot(point - self.light[0]));
                if !(point.length() < 1.5 && point.y > -1e-9) {
                    return false;
                }
            }
        }
        sides.iter().all(|&s| s > 0.02) || sides.iter().all(|&s| s < -0.02)
    }

    /// Exact mean of the image: Gauss–Legendre over the image and, with a lens, over the squared radius of its disk, equal angles
    /// around. The integrand is smooth, see [`Self::light_is_out_of_the_way`].
    fn exact(&self, order: usize, light: &PolygonLight) -> f64 {
        let normal = self.turn * DVec3::Y;
        let at = |point: DVec3| light.irradiance(&Receiver { point: self.turn * point + self.shift, normal });
        let nodes = gauss(order);
        let lens: Vec<([f64; 2], f64)> = if self.lens_radius == 0.0 {
            vec![([0.0, 0.0], 1.0)]
        } else {
            let angles = 2 * order + 2;
            let ring = |(s, weight): (f64, f64)| {
                (0..angles).map(move |k| {
                    let angle = std::f64::consts::TAU * k as f64 / angles as f64;
                    ([s.sqrt() * angle.cos(), s.sqrt() * angle.sin()], weight / angles as f64)
                })
            };
            nodes.iter().copied().flat_map(ring).collect()
        };
        let mut sum = 0.0;
        for &(x, weight_x) in &nodes {
            for &(y, weight_y) in &nodes {
                for &(place, weight) in &lens {
                    let [hit, _] = self.trace([2.0 * x - 1.0, 2.0 * y - 1.0], place);
                    sum += weight_x * weight_y * weight * at(hit);
                }
            }
        }
        f64::from(ALBEDO) * sum
    }

    /// Means of the whole image, one a seed.
    fn means(&self) -> Vec<f64> {
        let mut room = Room::default();
        let grey = room.material(ALBEDO, None);
        room.polygon(&self.floor(), grey);
        room.light(&self.light.map(|c| self.place(c)), 1.0);
        let [dir, _, up] = self.axes();
        let camera = CameraConfig {
            pos: self.place(self.eye),
            dir: (self.turn * dir).as_vec3(),
            up: (self.turn * up).as_vec3(),
            fov_degrees: self.fov_degrees as f32,
            lens_radius: self.lens_radius as f32,
            focal_depth: self.focal_depth as f32,
        };
        let scene = room.scene(&camera, SIZE, Stage::Final);
        let mean = |seed| {
            let image = rendered(&scene, spec(self.sampler), SPP, seed);
            image.pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / image.pixels.len() as f64
        };
        (0..REPLICATES).map(mean).collect()
    }
}

/// Gauss–Legendre on [0, 1] by Newton's method on the Legendre recurrence.
fn gauss(order: usize) -> Vec<(f64, f64)> {
    let n = order as f64;
    let node = |k: usize| {
        let mut x = (std::f64::consts::PI * (k as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 0.0;
        for _ in 0..50 {
            let (mut before, mut value) = (1.0, x);
            for j in 2..=order {
                let j = j as f64;
                (before, value) = (value, ((2.0 * j - 1.0) * x * value - (j - 1.0) * before) / j);
            }
            slope = n * (x * value - before) / (x * x - 1.0);
            x -= value / slope;
        }
        (0.5 * (x + 1.0), 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..order).map(node).collect()
}

fn cases() -> impl Strategy<Value = Case> {
    (0usize..7, prop::array::uniform16(0.0f64..1.0), 0..SAMPLERS.len())
        .prop_map(|(kind, u, sampler)| case(kind, u, sampler))
        .prop_filter("the light is in the picture", Case::light_is_out_of_the_way)
}

#[test]
fn the_quadrature_integrates_polynomials_of_its_degree() {
    for order in [4usize, 6] {
        for power in 0..2 * order as i32 {
            let sum: f64 = gauss(order).into_iter().map(|(x, w)| w * x.powi(power)).sum();
            assert!((sum - 1.0 / f64::from(power + 1)).abs() < 1e-14, "order {order}, x^{power}");
        }
    }
}

#[test]
fn random_scenes_have_the_radiance_of_their_closed_form() {
    // A statistical failure does not get simpler by shrinking: the first one found is shown.
    let config = Config { cases: CASES, failure_persistence: None, max_shrink_iters: 0, ..Config::default() };
    let mut runner = TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &[29; 32]));
    let family = Family { tests: u64::from(CASES), false_alarm: 1e-7 };
    let caught: RefCell<Vec<f64>> = RefCell::default();
    let dark = RefCell::new(0);
    runner
        .run(&cases(), |case| {
            let light = case.closed_form();
            let (exact, coarser) = (case.exact(6, &light), case.exact(4, &light));
            let means = case.means();
            if exact == 0.0 {
                *dark.borrow_mut() += 1;
                prop_assert!(means.iter().all(|&m| m == 0.0), "exactly nothing from behind");
                return Ok(());
            }
            let allowance = case.allowance(exact);
            let mean = means.iter().sum::<f64>() / means.len() as f64;
            let verdict = t_test(&means, mean.clamp(exact - allowance, exact + allowance), family);
            let detects = verdict.detects.unwrap() + allowance;
            prop_assert!((exact - coarser).abs() < 0.01 * detects, "quadrature: {exact} and {coarser}");
            prop_assert!(allowance < 0.005 * exact, "an allowance of {allowance} beside {exact}");
            prop_assert!(verdict.holds(), "expected {exact} ± {allowance}: {verdict}");
            caught.borrow_mut().push(detects / exact);
            Ok(())
        })
        .unwrap_or_else(|failure| panic!("{failure}"));
    let mut caught = caught.into_inner();
    caught.sort_by(f64::total_cmp);
    assert!(caught.len() > 60 && dark.into_inner() > 0, "{} lit scenes", caught.len());
    let (median, worst) = (caught[caught.len() / 2], caught[caught.len() - 1]);
    assert!(median < 0.005 && worst < 0.1, "biases caught: {median} in the middle, {worst} at worst");
}

//! Random scenes with the exact value beside them: a rectangle light, a receiving floor, a view, pinhole or lens, under each
//! unbiased sampler.
//!
//! The generator aims at trouble: lights that are near, tiny, low over the horizon, partly below it, seen edge-on or from behind.

use glam::{DQuat, DVec3, Vec3};

use super::pixel::SAMPLERS;
use super::{Check, Context, Finding, statistical};
use crate::analytic::{PolygonLight, Receiver};
use crate::check::Tally;
use crate::check::room::{Exact, Room, grey, parallelogram, rendered, spec};
use crate::sampling::hash::{bits64, unit_f32};
use crate::scene::compile::Stage;
use crate::scene::config::CameraConfig;

/// The checks of this file.
pub fn checks() -> Vec<Check> {
    vec![statistical(
        "random-scenes",
        "random scenes, pinhole and lens, under every unbiased sampler have the radiance of their closed form",
        random_scenes,
    )]
}

/// Catches a bias of about ten standard errors of an image: below 0.5 % of the radiance for half of the scenes.
fn random_scenes(context: &Context) -> Finding {
    let scenes = context.replicates(21, 7);
    let family = context.family(scenes);
    let mut tally = Tally::new();
    let mut cases = (0..).filter_map(|i| Case::of_seed(context.seed_of(0, i))).enumerate();
    let (mut lit, mut dark) = (0, 0);
    for (which, case) in cases.by_ref().take(scenes as usize) {
        let seeds = (0..96).map(|r| context.seed_of(1 + which as u64, r));
        let (exact, means) = (case.expected(), case.means(seeds));
        if exact.value == 0.0 {
            dark += 1;
            tally.fact(format!("exactly nothing from behind: {case:?}"), means.iter().all(|&m| m == 0.0));
        } else {
            lit += 1;
            tally.verdict(format!("{exact:?} of {case:?}"), &exact.test(&means, family), exact.value);
        }
    }
    tally.saying(format!("{lit} scenes with light and {dark} from behind agree with their closed forms"))
}

const SPP: u32 = 64;
const ALBEDO: f32 = 0.5;
const SIZE: (u32, u32) = (2, 2);

/// A floor y = 0 about the origin, a light and a camera that looks at the origin, before the whole is turned and moved.
#[derive(Debug, Clone)]
pub struct Case {
    light: [DVec3; 4],
    eye: DVec3,
    fov_degrees: f64,
    lens_radius: f64,
    focal_depth: f64,
    turn: DQuat,
    shift: DVec3,
    sampler: &'static str,
}

/// How many kinds of trouble [`Case::new`] knows.
pub const KINDS: usize = 7;

/// Maps sixteen uniform numbers to a case; `kind` says which trouble.
fn case(kind: usize, u: [f64; 16], sampler: usize) -> Case {
    let between = |u: f64, low: f64, high: f64| low + (high - low) * u;
    let around = |u: f64| {
        let angle = std::f64::consts::TAU * u;
        DVec3::new(libm::cos(angle), 0.0, libm::sin(angle))
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
    let eye = (around(u[9]) * libm::cos(elevation) + DVec3::Y * libm::sin(elevation)) * reach;
    let width = between(u[10], 0.02, 0.1);
    Case {
        light: [centre - e1 - e2, centre + e1 - e2, centre + e1 + e2, centre - e1 + e2],
        eye,
        fov_degrees: 2.0 * libm::atan(0.5 * width).to_degrees(),
        lens_radius: if u[11] < 0.4 { 0.0 } else { between(u[11], 0.005, 0.05) * reach },
        focal_depth: between(u[12], 0.5, 2.0) * reach,
        turn: DQuat::from_axis_angle((around(u[13]) + DVec3::Y * 0.5).normalize(), 3.0 * u[14]),
        shift: around(u[15]) * u[14] + DVec3::Y * (u[15] - 0.5),
        sampler: SAMPLERS[sampler],
    }
}

impl Case {
    /// Maps sixteen numbers in [0, 1) to a case; `kind` below [`KINDS`] says which trouble, `sampler` which of six draws it.
    /// `None` where the light would stand in the picture: the closed form has a kink there.
    pub fn new(kind: usize, u: [f64; 16], sampler: usize) -> Option<Self> {
        Some(case(kind, u, sampler % SAMPLERS.len())).filter(Self::light_is_out_of_the_way)
    }

    /// A case of a seed.
    fn of_seed(seed: u64) -> Option<Self> {
        let u = std::array::from_fn(|i| f64::from(unit_f32(bits64(seed, i as u64) as u32)));
        let choice = bits64(seed, 16) as usize;
        Self::new(choice % KINDS, u, (choice >> 16) % SAMPLERS.len())
    }

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
        let half = libm::tan(0.5 * self.fov_degrees.to_radians());
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

    /// The exact mean of the image and how far off it the renderer may be.
    ///
    /// # Panics
    /// Where two orders of the quadrature do not agree to 10⁻⁴ of the value: the case is not as smooth as it should be.
    pub fn expected(&self) -> Exact {
        let light = self.closed_form();
        let (value, coarser) = (self.exact(6, &light), self.exact(4, &light));
        assert!((value - coarser).abs() <= 1e-4 * value, "quadrature: {value} and {coarser} of {self:?}");
        Exact { value, allowance: if value == 0.0 { 0.0 } else { self.allowance(value) } }
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
                    ([s.sqrt() * libm::cos(angle), s.sqrt() * libm::sin(angle)], weight / angles as f64)
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
    pub fn means(&self, seeds: impl Iterator<Item = u64>) -> Vec<f64> {
        let mut room = Room::default();
        let floor = room.material(ALBEDO, None);
        room.polygon(&self.floor(), floor);
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
            let pixels = grey(&rendered(&scene, spec(self.sampler), SPP, seed));
            pixels.iter().sum::<f64>() / pixels.len() as f64
        };
        seeds.map(mean).collect()
    }
}

/// Nodes and weights of Gauss–Legendre on [0, 1] by Newton's method on the Legendre recurrence.
pub(super) fn gauss(order: usize) -> Vec<(f64, f64)> {
    let n = order as f64;
    let node = |k: usize| {
        let mut x = libm::cos(std::f64::consts::PI * (k as f64 + 0.75) / (n + 0.5));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quadrature_integrates_polynomials_of_its_degree() {
        for order in [3usize, 4, 6] {
            for power in 0..2 * order as i32 {
                let sum: f64 = gauss(order).into_iter().map(|(x, w)| w * x.powi(power)).sum();
                assert!((sum - 1.0 / f64::from(power + 1)).abs() < 1e-14, "order {order}, x^{power}");
            }
        }
    }
}

//! Random straight edges over a pixel, sharp or defocused, with the exact value beside them.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec3, Vec3};

use super::pixel::SAMPLERS;
use super::{Check, Context, Finding, statistical};
use crate::analytic::quadrature::{Tolerance, integrate};
use crate::analytic::{ThinLens, pixel_coverage};
use crate::check::Tally;
use crate::check::room::{Room, looking_at, replicates, spec};
use crate::sampling::hash::{bits64, unit_f32};
use crate::scene::compile::{Scene, Stage};
use crate::scene::config::CameraConfig;
use crate::stats::t_test;

/// The checks of this file.
pub fn checks() -> Vec<Check> {
    vec![statistical(
        "random-edges",
        "random edges, sharp and defocused, cover a pixel as their closed form says, under every unbiased sampler",
        random_edges,
    )]
}

/// An edge a x + b y ≤ c over the only pixel, y downwards, at some depth behind a lens or a pinhole.
#[derive(Debug, Clone, Copy)]
pub struct EdgeCase {
    edge: [f64; 3],
    depth: f64,
    lens: Option<ThinLens>,
    sampler: &'static str,
}

impl EdgeCase {
    /// Maps six numbers in [0, 1) to a case: along an axis or a diagonal, slanted by 10⁻³ of that, or anywhere; through the pixel's
    /// corner or anywhere; a pinhole or a blur of up to a pixel and a half; `sampler` says which of six draws it.
    ///
    /// `None` where the edge leaves less than 1 % of the pixel on either side, but some: Student's t is badly calibrated on outcomes
    /// that rare, and the check `edge-coverage` counts them exactly.
    pub fn new(u: [f64; 6], sampler: usize) -> Option<Self> {
        let eighth = (8.0 * u[0]).floor() * 0.25 * PI;
        let angle = match (3.0 * u[1]) as u32 {
            0 => eighth,
            1 => eighth + 1e-3,
            _ => 2.0 * PI * u[0],
        };
        let (a, b) = (libm::cos(angle), libm::sin(angle));
        let (low, high) = (a.min(0.0) + b.min(0.0), a.max(0.0) + b.max(0.0));
        let c = if u[2] < 0.1 { a + b } else { low + (high - low) * (1.4 * u[2] - 0.2) };
        let depth = 0.5 + 4.0 * u[3];
        let lens = (u[4] >= 0.3).then(|| ThinLens { radius: 0.05 + u[4], focal_depth: depth * (0.5 + u[5]) });
        let case = Self { edge: [a, b, c], depth, lens, sampler: SAMPLERS[sampler % SAMPLERS.len()] };
        let exact = case.exact();
        (exact == 0.0 || exact == 1.0 || (0.01..=0.99).contains(&exact)).then_some(case)
    }

    /// The pixel's exact value: the coverage, or its mean over the circle of confusion. The disc's points lie at t blurs along the
    /// edge's normal with density (2/π) √(1 − t²), t = sin φ.
    pub fn exact(&self) -> f64 {
        let [a, b, c] = self.edge;
        let blur = self.lens.map_or(0.0, |lens| lens.blur_radius_px(self.depth, 90.0, 1.0)) * libm::hypot(a, b);
        if blur == 0.0 {
            return pixel_coverage(a, b, c);
        }
        let value = |angle: f64| {
            let cosine = libm::cos(angle);
            2.0 / PI * cosine * cosine * pixel_coverage(a, b, c + blur * libm::sin(angle))
        };
        // Where the moved edge passes a corner of the pixel.
        let corners = [0.0, a, b, a + b].map(|level| libm::asin(((level - c) / blur).clamp(-1.0, 1.0)));
        integrate(value, [-FRAC_PI_2, FRAC_PI_2], &corners, Tolerance::absolute(1e-10)).map_or(f64::NAN, |e| e.value)
    }

    /// Means of the pixel over 16 samples, one a seed.
    pub fn means(&self, seeds: impl Iterator<Item = u64>) -> Vec<f64> {
        replicates(&half_plane(self.edge, self.depth, self.lens), spec(self.sampler), 16, seeds).concat()
    }
}

/// White where a x + b y ≤ c in the only pixel's coordinates, at `depth` before a camera of 90° at the origin.
pub(in crate::check) fn half_plane([a, b, c]: [f64; 3], depth: f64, lens: Option<ThinLens>) -> Scene {
    let normal = DVec3::new(a, b, 0.0);
    let along = DVec3::new(-b, a, 0.0) / normal.length();
    let foot = normal * (c / normal.length_squared());
    let inwards = -normal / normal.length();
    let at = |along_by: f64, in_by: f64| {
        let p = foot + along * along_by + inwards * in_by;
        // Image (0, 0) is the upper left corner; right is −x, down is −y, the pixel is 2 wide at depth 1.
        Vec3::new((-(2.0 * p.x - 1.0) * depth) as f32, ((1.0 - 2.0 * p.y) * depth) as f32, depth as f32)
    };
    let mut room = Room::default();
    let white = room.material(1.0, None);
    room.polygon(&[at(-9.0, 0.0), at(9.0, 0.0), at(9.0, 9.0), at(-9.0, 9.0)], white);
    let pinhole = looking_at(Vec3::ZERO, Vec3::Z, 90.0);
    let camera = lens.map_or(pinhole, |lens| CameraConfig {
        lens_radius: lens.radius as f32,
        focal_depth: lens.focal_depth as f32,
        ..pinhole
    });
    room.scene(&camera, (1, 1), Stage::Dof)
}

/// Catches a bias of 1 to 2 % of the pixel: a wrong radius of the blur, a filter wider than the pixel.
fn random_edges(context: &Context) -> Finding {
    let edges = context.replicates(48, 12);
    let family = context.family(edges);
    let mut tally = Tally::new();
    let case = |i| {
        let seed = context.seed_of(0, i);
        let u = std::array::from_fn(|k| f64::from(unit_f32(bits64(seed, k as u64) as u32)));
        EdgeCase::new(u, bits64(seed, 6) as usize % SAMPLERS.len())
    };
    for (which, case) in (0..).filter_map(case).take(edges as usize).enumerate() {
        let exact = case.exact();
        let means = case.means((0..2048).map(|r| context.seed_of(1 + which as u64, r)));
        tally.verdict(format!("{exact:.6} of {case:?}"), &t_test(&means, exact, family), 1.0);
    }
    tally.saying(format!("{edges} edges agree with their closed forms"))
}

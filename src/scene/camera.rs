//! The camera: pinhole or thin lens, and its auto focus.

use glam::{Vec2, Vec3};

use crate::accel::{Accel, LANES, Packet, Ray};
use crate::mutants::{Mutant, planted};
use crate::sampling::{Dim2, warp};

use super::config::CameraConfig;

/// Where in its square a pixel is looked at.
#[derive(Debug)]
pub enum PixelSample {
    /// Always the centre: no numbers.
    Center,
    /// A sampled place; a pixel is the mean over its square (box filter).
    Sampled(Dim2),
}

/// What rays pass through.
#[derive(Debug)]
pub enum Aperture {
    /// A point: no numbers, everything sharp.
    Pinhole,
    /// A disk of `radius` around the camera's position; rays of one image point meet again in the plane of focus.
    ThinLens {
        /// Radius in scene units, above 0.
        radius: f32,
        /// Distance of the plane of focus along the viewing direction, above 0.
        focal_depth: f32,
        /// The lens decision's numbers.
        lens: Dim2,
    },
}

/// A camera for images of one size.
#[derive(Debug)]
pub struct Camera {
    pos: Vec3,
    dir: Vec3,
    right: Vec3,
    up: Vec3,
    /// Half the height of the image plane at distance 1, and half its width.
    half: Vec2,
    size: (u32, u32),
    /// Pixel decision.
    pub pixel: PixelSample,
    /// Pinhole or lens.
    pub aperture: Aperture,
}

impl Camera {
    /// A camera at the config's place, for `size` (columns, rows); `dir` is normalised and `up` made orthogonal to it.
    pub fn new(config: &CameraConfig, size: (u32, u32), pixel: PixelSample, aperture: Aperture) -> Self {
        let dir = config.dir.normalize();
        let right = dir.cross(config.up).normalize();
        let mut camera =
            Self { pos: config.pos, dir, right, up: right.cross(dir), half: Vec2::ZERO, size, pixel, aperture };
        let half_height = libm::tan(f64::from(config.fov_degrees).to_radians() / 2.0) as f32;
        camera.half = Vec2::new(half_height, half_height);
        camera.resize(size);
        camera
    }

    /// Changes the number of columns and rows; the vertical field of view stays.
    pub fn resize(&mut self, size: (u32, u32)) {
        self.size = size;
        self.half.x = self.half.y * size.0 as f32 / size.1 as f32;
    }

    /// Columns and rows.
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// Position.
    pub fn pos(&self) -> Vec3 {
        self.pos
    }

    /// Direction with unit part along the viewing direction, to the image point `at`: (0, 0) top left, `size` bottom right.
    #[inline(always)]
    fn through(&self, at: Vec2) -> Vec3 {
        let at = if planted(Mutant::PixelOffByHalf) { at + 0.5 } else { at };
        let x = (2.0 * at.x / self.size.0 as f32 - 1.0) * self.half.x;
        let y = (1.0 - 2.0 * at.y / self.size.1 as f32) * self.half.y;
        self.dir + self.right * x + self.up * y
    }

    /// The ray through image point `at` from the lens's centre.
    #[inline(always)]
    pub fn pinhole_ray(&self, at: Vec2) -> Ray {
        Ray { origin: self.pos, direction: self.through(at).normalize() }
    }

    /// The ray through image point `at` from the lens point that `u` in [0, 1)² names.
    ///
    /// The lens point is o = radius · disk(u); the ray goes from pos + o to pos + f·d, d having unit part along `dir`, so the
    /// focus is a plane. Written as d − o/f it stays finite for any focal depth.
    #[inline(always)]
    pub fn lens_ray(&self, at: Vec2, u: Vec2, radius: f32, focal_depth: f32) -> Ray {
        let radius = if planted(Mutant::LensOfDiameter) { 2.0 * radius } else { radius };
        let disk = warp::square_to_disk(u) * radius;
        let offset = self.right * disk.x + self.up * disk.y;
        let through = if planted(Mutant::FocusOnSphere) { self.through(at).normalize() } else { self.through(at) };
        Ray { origin: self.pos + offset, direction: (through - offset / focal_depth).normalize() }
    }

    /// Geometric mean of the depths, along `dir`, that 64 × 64 rays through the central quarter of width and height meet.
    ///
    /// Depth is measured along the viewing direction. `None` where no ray meets anything.
    pub fn auto_focus(&self, accel: &Accel) -> Option<f32> {
        const RAYS: u32 = 64;
        let (mut log_sum, mut hits) = (0.0f64, 0u32);
        // A packet for as many neighbours as it takes: these are too few rays to make the tree for single ones.
        let mut packet = Packet::default();
        for first in (0..RAYS * RAYS).step_by(LANES) {
            for lane in 0..LANES {
                let i = first + lane as u32;
                let place = |k: u32| 0.5 + ((k as f32 + 0.5) / RAYS as f32 - 0.5) * 0.25;
                let at = Vec2::new(place(i % RAYS) * self.size.0 as f32, place(i / RAYS) * self.size.1 as f32);
                packet.set(lane, &Ray { origin: self.pos, direction: self.through(at) }, f32::INFINITY);
            }
            accel.closest(&mut packet);
            // The direction's part along `dir` is 1, so t is the depth.
            for hit in (0..LANES).filter_map(|lane| packet.hit(lane)) {
                log_sum += libm::log(f64::from(hit.t));
                hits += 1;
            }
        }
        (hits > 0).then(|| libm::exp(log_sum / f64::from(hits)) as f32)
    }
}

//! A soft shadow in closed form: a polygon light over a diffuse plane with one convex blocker, seen by a pinhole.
//!
//! The radiance of the plane at a point is albedo · E (no 1/π), with E the closed form of
//! [`polygon`](crate::analytic::polygon). A pixel is its mean over the pixel's square (box filter), by
//! [quadrature](crate::analytic::quadrature): as a function of the place on the plane the radiance is analytic but
//! for kinks where a corner of the light, an edge of the blocker and the place lie in one plane, or a corner of the
//! blocker and an edge of the light. These kinks are segments of straight lines on the plane, hence in the image, so
//! the quadrature gets them as exact breaks and meets smooth pieces only.

use glam::DVec3;
use rayon::prelude::*;

use crate::analytic::polygon::{Patch, PolygonLight, Receiver, area_vector};
use crate::analytic::quadrature::{Estimate, Tolerance, integrate_rectangle};
use crate::error::{Error, Result};

/// Absolute error of a pixel, as a share of albedo · emission.
pub const PIXEL_TOLERANCE: f64 = 1e-10;

/// A pinhole camera. Pixel (0, 0) is the upper left one and covers the image positions 0..1 × 0..1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pinhole {
    /// Position in scene units.
    pub position: DVec3,
    /// Direction of view, of any length.
    pub direction: DVec3,
    /// A vector that points upwards in the image, not along `direction`.
    pub up: DVec3,
    /// Vertical field of view in degrees, in (0, 180).
    pub fov_y_degrees: f64,
    /// Pixels in a row.
    pub width: u32,
    /// Pixels in a column.
    pub height: u32,
}

/// An infinite diffuse plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiffusePlane {
    /// Any point of it.
    pub point: DVec3,
    /// Normal of the side that camera and light are on, of any length.
    pub normal: DVec3,
    /// Share k_a of the radiance that is passed on, 0 to 1.
    pub albedo: f64,
}

/// The scene, checked, with what its integrals need worked out once.
#[derive(Debug, Clone)]
pub struct Penumbra {
    camera: Pinhole,
    plane: DiffusePlane,
    light: PolygonLight,
    blocker: Vec<DVec3>,
    view: View,
    kinks: Vec<Kink>,
}

/// View rays as an affine function of the image position: `corner + x · right + y · down`, not normalised.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    pub(super) corner: DVec3,
    pub(super) right: DVec3,
    pub(super) down: DVec3,
}

impl View {
    pub(super) fn of(camera: &Pinhole) -> Self {
        let forward = camera.direction.normalize();
        let right = forward.cross(camera.up).normalize();
        let up = right.cross(forward);
        let (width, height) = (f64::from(camera.width), f64::from(camera.height));
        let half_height = libm::tan(camera.fov_y_degrees.to_radians() * 0.5);
        let half_width = half_height * width / height;
        Self {
            corner: forward - right * half_width + up * half_height,
            right: right * (2.0 * half_width / width),
            down: up * (-2.0 * half_height / height),
        }
    }

    pub(super) fn ray(&self, x: f64, y: f64) -> DVec3 {
        self.corner + self.right * x + self.down * y
    }

    /// Inward normals of the pyramid over a rectangle of the image.
    fn pyramid(&self, [x0, x1]: [f64; 2], [y0, y1]: [f64; 2]) -> [DVec3; 4] {
        let corners = [self.ray(x0, y0), self.ray(x1, y0), self.ray(x1, y1), self.ray(x0, y1)];
        let centre = self.ray(0.5 * (x0 + x1), 0.5 * (y0 + y1));
        std::array::from_fn(|i| {
            let side = corners[i].cross(corners[(i + 1) % 4]);
            if side.dot(centre) < 0.0 { -side } else { side }
        })
    }
}

/// A line a x + b y + c = 0 of the image along which the radiance may have a kink.
#[derive(Debug, Clone, Copy)]
struct Kink {
    a: f64,
    b: f64,
    c: f64,
    /// The part of it that can matter, on the plane; `None` for all of it.
    segment: Option<[DVec3; 2]>,
}

impl Kink {
    /// Could the kink cross this rectangle of the image, whose pyramid is given? May say yes needlessly.
    fn touches(&self, x: [f64; 2], y: [f64; 2], eye: DVec3, pyramid: &[DVec3; 4]) -> bool {
        let side = |x: f64, y: f64| self.a * x + self.b * y + self.c;
        let sides = [side(x[0], y[0]), side(x[1], y[0]), side(x[0], y[1]), side(x[1], y[1])];
        if sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0) {
            return false;
        }
        let Some([from, to]) = self.segment else { return true };
        let (mut enter, mut leave) = (0.0, 1.0);
        for normal in pyramid {
            let (start, end) = (normal.dot(from - eye), normal.dot(to - eye));
            let crossing = start / (start - end);
            match (start < 0.0, end < 0.0) {
                (true, true) => return false,
                (true, false) => enter = f64::max(enter, crossing),
                (false, true) => leave = f64::min(leave, crossing),
                (false, false) => {}
            }
        }
        enter <= leave
    }

    /// The x at which this line meets another, and the rectangle's y borders.
    fn breaks_x(&self, others: &[Kink], y: [f64; 2], breaks: &mut Vec<f64>) {
        breaks.extend(y.map(|y| -(self.b * y + self.c) / self.a));
        breaks.extend(others.iter().map(|o| (self.b * o.c - o.b * self.c) / (self.a * o.b - o.a * self.b)));
    }
}

impl Penumbra {
    /// Checks the scene and works out where its image has kinks.
    ///
    /// Errors, each with the place, what was expected and what was found: a number that is not finite or out of
    /// range, a polygon that is not convex and flat, a light or blocker corner or a camera that is not above the
    /// plane, a picture that shows anything but the plane.
    pub fn new(camera: Pinhole, plane: DiffusePlane, light: PolygonLight, blocker: Vec<DVec3>) -> Result<Self> {
        check_camera(&camera)?;
        expect(plane.point.is_finite() && plane.normal.is_finite(), "plane", "finite numbers", plane)?;
        expect(plane.normal.length_squared() > 0.0, "plane.normal", "a direction", plane.normal)?;
        expect((0.0..=1.0).contains(&plane.albedo), "plane.albedo", "0 to 1", plane.albedo)?;
        let emits = light.emission.is_finite() && light.emission >= 0.0;
        expect(emits, "light.emission", "a finite radiance of at least 0", light.emission)?;
        let plane = DiffusePlane { normal: plane.normal.normalize(), ..plane };
        let view = View::of(&camera);
        let scene = Self { camera, plane, light, blocker, view, kinks: Vec::new() };
        scene.check_polygon("light", &scene.light.corners)?;
        scene.check_polygon("blocker", &scene.blocker)?;
        scene.check_picture()?;
        Ok(Self { kinks: scene.find_kinks(), ..scene })
    }

    /// The lab's own scene `penumbra` in an image of `width` × `height` pixels (its experiments use 60 × 60): a
    /// 1 × 1 light at height 3, a long bar 0.77 wide at height 1 that is turned by 14° against it, so that its shadow
    /// crosses the picture with full light on both sides, penumbras about 0.6 wide and an umbra about 0.5 wide, and a
    /// camera below the bar, which therefore sees neither bar nor light. All numbers are exact in f32.
    ///
    /// Errors: 0 pixels, or an image so wide that it is not a picture of the plane.
    pub fn standard(width: u32, height: u32) -> Result<Self> {
        let camera = Pinhole {
            position: DVec3::new(0.0, 0.9375, -1.25),
            direction: DVec3::new(0.0, -4.0, 3.0),
            up: DVec3::Y,
            fov_y_degrees: 64.0,
            width,
            height,
        };
        let plane = DiffusePlane { point: DVec3::ZERO, normal: DVec3::Y, albedo: 0.75 };
        let corners = [(-1.0, 0.0), (0.0, 0.0), (0.0, 1.0), (-1.0, 1.0)];
        let light = PolygonLight { corners: corners.map(|(x, z)| DVec3::new(x, 3.0, z)).to_vec(), emission: 10.0 };
        let bar = [(-5.90625, -1.6875), (6.09375, 1.3125), (5.90625, 2.0625), (-6.09375, -0.9375)];
        Self::new(camera, plane, light, bar.map(|(x, z)| DVec3::new(x, 1.0, z)).to_vec())
    }

    /// The camera.
    pub fn camera(&self) -> &Pinhole {
        &self.camera
    }

    /// The plane, its normal of length 1.
    pub fn plane(&self) -> &DiffusePlane {
        &self.plane
    }

    /// The light.
    pub fn light(&self) -> &PolygonLight {
        &self.light
    }

    /// Corners of the blocker.
    pub fn blocker(&self) -> &[DVec3] {
        &self.blocker
    }

    /// What the view ray through the image position (x, y), in pixels from the upper left corner, meets.
    pub fn receiver(&self, x_px: f64, y_px: f64) -> Receiver {
        let ray = self.view.ray(x_px, y_px);
        let normal = self.plane.normal;
        let distance = normal.dot(self.plane.point - self.camera.position) / normal.dot(ray);
        Receiver { point: self.camera.position + ray * distance, normal }
    }

    /// Radiance k_a · E at the image position (x, y), in pixels from the upper left corner, within the image:
    /// exact but for rounding, exactly 0 in the umbra. The scene is grey: red, green and blue are alike.
    pub fn radiance(&self, x_px: f64, y_px: f64) -> f64 {
        self.plane.albedo * self.light.irradiance_behind(&self.blocker, &self.receiver(x_px, y_px))
    }

    /// Mean radiance of the pixel in column i and row j from the upper left, to [`PIXEL_TOLERANCE`] · albedo · emission.
    ///
    /// Errors: the quadrature does not get there (a light that all but touches the plane).
    pub fn pixel(&self, i: u32, j: u32) -> Result<Estimate> {
        let (x, y) = ([f64::from(i), f64::from(i) + 1.0], [f64::from(j), f64::from(j) + 1.0]);
        let pyramid = self.view.pyramid(x, y);
        let touches = |kink: &&Kink| kink.touches(x, y, self.camera.position, &pyramid);
        let kinks: Vec<Kink> = self.kinks.iter().filter(touches).copied().collect();
        let mut breaks_x = Vec::new();
        for (at, kink) in kinks.iter().enumerate() {
            kink.breaks_x(&kinks[..at], y, &mut breaks_x);
        }
        let breaks_y = |x: f64, out: &mut Vec<f64>| out.extend(kinks.iter().map(|k| -(k.a * x + k.c) / k.b));
        let tolerance = Tolerance::absolute(PIXEL_TOLERANCE * self.plane.albedo * self.light.emission);
        integrate_rectangle(|x, y| self.radiance(x, y), x, y, &breaks_x, breaks_y, tolerance)
            .map_err(|e| Error { place: format!("penumbra: pixel ({i}, {j})"), ..e })
    }

    /// All pixels, row by row from the upper left. Errors as for [`Self::pixel`].
    pub fn image(&self) -> Result<Vec<f64>> {
        let width = u64::from(self.camera.width);
        (0..width * u64::from(self.camera.height))
            .into_par_iter()
            // Both fit: they are less than the u32 width and height.
            .map(|at| self.pixel((at % width) as u32, (at / width) as u32).map(|pixel| pixel.value))
            .collect()
    }

    fn height_of(&self, point: DVec3) -> f64 {
        self.plane.normal.dot(point - self.plane.point)
    }

    fn check_polygon(&self, name: &str, corners: &[DVec3]) -> Result<()> {
        let place = format!("{name}.corners");
        expect(corners.iter().all(|c| c.is_finite()), &place, "finite numbers", corners)?;
        expect(is_convex(corners), &place, "a flat convex polygon", corners)?;
        expect(corners.iter().all(|&c| self.height_of(c) > 0.0), &place, "corners above the plane", corners)
    }

    /// The picture shows the plane, all of it and nothing else.
    fn check_picture(&self) -> Result<()> {
        let eye = self.camera.position;
        expect(self.height_of(eye) > 0.0, "camera.position", "a place above the plane", eye)?;
        let (x, y) = ([0.0, f64::from(self.camera.width)], [0.0, f64::from(self.camera.height)]);
        for corner in [(x[0], y[0]), (x[1], y[0]), (x[0], y[1]), (x[1], y[1])] {
            let ray = self.view.ray(corner.0, corner.1);
            expect(self.plane.normal.dot(ray) < 0.0, "camera", "the plane in all corners of the picture", corner)?;
        }
        for (name, corners) in [("light", &self.light.corners), ("blocker", &self.blocker)] {
            let mut rest = Some(Patch::around(corners, eye));
            for side in self.view.pyramid(x, y) {
                rest = rest.and_then(|patch| patch.split(side, 0.0).0);
            }
            expect(rest.is_none(), &format!("{name}.corners"), "all of it outside the picture", corners)?;
        }
        Ok(())
    }

    fn find_kinks(&self) -> Vec<Kink> {
        let (light, blocker) = (&self.light.corners, &self.blocker);
        let mut kinks = Vec::new();
        for (from, edges) in [(light, blocker), (blocker, light)] {
            for &corner in from {
                for (i, &start) in edges.iter().enumerate() {
                    let end = edges[(i + 1) % edges.len()];
                    let shadows = [self.shadow(corner, start), self.shadow(corner, end)];
                    let segment = shadows[0].zip(shadows[1]).map(|(a, b)| [a, b]);
                    kinks.push(self.kink((start - corner).cross(end - corner), corner, segment));
                }
            }
        }
        // Where the plane meets the light's plane it turns away from it; where it meets the blocker's, the shadow
        // changes sides.
        for corners in [light, blocker] {
            kinks.push(self.kink(area_vector(corners), corners[0], None));
        }
        kinks
    }

    /// Where the line through a corner of the light and one of the blocker, given in either order, meets the plane
    /// beyond the lower one; `None` where they are equally high.
    fn shadow(&self, p: DVec3, q: DVec3) -> Option<DVec3> {
        let (high, low) = (self.height_of(p), self.height_of(q));
        (high != low).then(|| p + (q - p) * (high / (high - low)))
    }

    /// The image of the line in which the plane through `point` with this normal meets the diffuse plane.
    ///
    /// A view ray d meets the diffuse plane (normal N, the eye h above it) at eye − d h / (N·d); that this place lies in
    /// the other plane (normal m, the point q) is linear in d: (m·(eye − q) N − h m) · d = 0.
    fn kink(&self, normal: DVec3, point: DVec3, segment: Option<[DVec3; 2]>) -> Kink {
        let eye = self.camera.position;
        let across = self.plane.normal * normal.dot(eye - point) - normal * self.height_of(eye);
        let (a, b) = (across.dot(self.view.right), across.dot(self.view.down));
        Kink { a, b, c: across.dot(self.view.corner), segment }
    }
}

fn expect(holds: bool, place: &str, expected: &str, found: impl std::fmt::Debug) -> Result<()> {
    if holds {
        return Ok(());
    }
    Err(Error::input(format!("penumbra: {place}"), format!("expected {expected}, found {found:?}")))
}

pub(super) fn check_camera(camera: &Pinhole) -> Result<()> {
    expect(camera.position.is_finite(), "camera.position", "finite numbers", camera.position)?;
    let across = camera.direction.cross(camera.up).length_squared();
    expect(across.is_finite() && across > 0.0, "camera.direction", "a direction other than up", camera.direction)?;
    let fov = camera.fov_y_degrees;
    expect(fov > 0.0 && fov < 180.0, "camera.fov_y_degrees", "an angle above 0 and below 180", fov)?;
    expect(camera.width > 0, "camera.width", "at least one pixel", camera.width)?;
    expect(camera.height > 0, "camera.height", "at least one pixel", camera.height)
}

/// Flat to 10⁻⁹ of its size, and all its turns to one side, once around.
fn is_convex(corners: &[DVec3]) -> bool {
    let across = area_vector(corners);
    let Some(normal) = across.try_normalize() else { return false };
    let size = across.length().sqrt();
    let n = corners.len();
    (0..n).all(|i| {
        let edge = corners[(i + 1) % n] - corners[i];
        // All corners on one side of every edge: this also refuses a polygon that winds around twice.
        corners.iter().all(|&c| {
            let (flat, turn) = (normal.dot(c - corners[0]), normal.dot(edge.cross(c - corners[i])));
            flat.abs() <= 1e-9 * size.max(edge.length()) && turn >= -1e-9 * edge.length() * size
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analytic::variance::variance_of_one_area_sample;
    use rand::{RngExt, SeedableRng};

    fn standard() -> Penumbra {
        Penumbra::standard(60, 60).unwrap()
    }

    /// A tilted light, a triangular blocker that crosses the light's plane, a plane that is not horizontal.
    fn crooked() -> Penumbra {
        let camera = Pinhole {
            position: DVec3::new(0.25, 0.9, 3.0),
            direction: DVec3::new(-0.1, -1.0, -1.6),
            up: DVec3::Y,
            fov_y_degrees: 40.0,
            width: 24,
            height: 16,
        };
        let plane = DiffusePlane { point: DVec3::ZERO, normal: DVec3::new(0.1, 2.0, 0.2), albedo: 0.5 };
        let light = PolygonLight {
            corners: vec![DVec3::new(-2.5, 3.0, 0.0), DVec3::new(-2.0, 2.5, 0.5), DVec3::new(-2.5, 2.0, -1.0)],
            emission: 7.0,
        };
        let blocker = vec![DVec3::new(-2.0, 1.0, -1.0), DVec3::new(-1.75, 1.0, 1.0), DVec3::new(-2.5, 3.5, 0.0)];
        Penumbra::new(camera, plane, light, blocker).unwrap()
    }

    /// Does the segment between two points meet the triangle? Möller and Trumbore's test, no plane through the eye.
    fn segment_meets(from: DVec3, to: DVec3, [a, b, c]: [DVec3; 3]) -> bool {
        let (d, e1, e2) = (to - from, b - a, c - a);
        let p = d.cross(e2);
        let determinant = e1.dot(p);
        let u = (from - a).dot(p) / determinant;
        let q = (from - a).cross(e1);
        let (v, t) = (d.dot(q) / determinant, e2.dot(q) / determinant);
        u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < 1.0
    }

    fn hidden(blocker: &[DVec3], from: DVec3, to: DVec3) -> bool {
        (2..blocker.len()).any(|i| segment_meets(from, to, [blocker[0], blocker[i - 1], blocker[i]]))
    }

    /// 24 points of the picture with 20 000 shadow rays each: the mean against the closed form, by Bernstein's
    /// inequality (which needs no normal law): catches an error of 3.4 % of the open light.
    /// False alarms: 1e-8.
    #[test]
    fn radiance_is_the_mean_of_explicit_shadow_rays() {
        const RAYS: u32 = 20_000;
        let mut random = rand_pcg::Pcg64::seed_from_u64(2024);
        let scene = standard();
        let light = scene.light();
        let log_odds = libm::log(2.0 * 24.0 / 1e-8);
        let mut partly_lit = 0;
        for _ in 0..24 {
            let (x, y) = (random.random::<f64>() * 60.0, random.random::<f64>() * 60.0);
            let at = scene.receiver(x, y);
            let mut sum = 0.0;
            for _ in 0..RAYS {
                let (s, t) = (random.random::<f64>(), random.random::<f64>());
                let on_light = DVec3::new(s - 1.0, 3.0, t);
                let v = on_light - at.point;
                let square = v.length_squared();
                if !hidden(scene.blocker(), at.point, on_light) {
                    sum += 10.0 * (v.y / square) * (v.y / square);
                }
            }
            let exact = scene.radiance(x, y) / scene.plane().albedo;
            let variance = variance_of_one_area_sample(light, &at, Some(scene.blocker()));
            let n = f64::from(RAYS);
            // A sample is at most emission / height².
            let bound = (2.0 * variance * log_odds / n).sqrt() + (10.0 / 9.0) * log_odds / (3.0 * n);
            assert!((sum / n - exact).abs() <= bound, "({x}, {y}): {} {exact} ± {bound}", sum / n);
            partly_lit += u32::from(exact > 0.0 && exact < light.irradiance(&at));
        }
        assert!(partly_lit >= 4, "the points must meet the penumbra: {partly_lit}");
    }

    #[test]
    fn the_standard_numbers_survive_a_scene_file_in_f32() {
        let scene = standard();
        let camera = scene.camera();
        let vectors = [camera.position, camera.direction, camera.up];
        for v in scene.blocker().iter().chain(&scene.light().corners).chain(&vectors) {
            assert_eq!(v.as_vec3().as_dvec3(), *v);
        }
        let along = area_vector(&scene.light().corners);
        assert_eq!((along, scene.light().area()), (-DVec3::Y, 1.0));
    }

    #[test]
    fn the_standard_picture_holds_umbra_penumbra_and_full_light() {
        let scene = standard();
        let (mut umbra, mut penumbra, mut full) = (0, 0, 0);
        for at in (0..60 * 60).map(|p| (f64::from(p % 60) + 0.5, f64::from(p / 60) + 0.5)) {
            let radiance = scene.radiance(at.0, at.1);
            let open = 0.75 * scene.light().irradiance(&scene.receiver(at.0, at.1));
            assert!((0.0..=open).contains(&radiance) && open > 0.3 && open < 0.84);
            if radiance == 0.0 {
                umbra += 1;
            } else if radiance == open {
                full += 1;
            } else {
                penumbra += 1;
            }
        }
        assert!(umbra >= 400 && penumbra >= 900 && full >= 900, "{umbra} {penumbra} {full}");
    }

    /// Mean of 512 × 512 midpoints, and a bound on its error. Along an axis with cells of width h a smooth f is wrong by
    /// |f″|h²/24 a cell, a kink where the slope jumps by J by at most J h/8 in its cell; second differences of f sum to
    /// f″h² and to J h there. So an eighth of their sum bounds both; two axes add.
    fn brute_force(scene: &Penumbra, i: u32, j: u32) -> (f64, f64) {
        const N: usize = 512;
        let place = |from: u32, k: usize| f64::from(from) + (k as f64 - 0.5) / N as f64;
        let row = |v: usize| (0..N + 2).map(|u| scene.radiance(place(i, u), place(j, v))).collect::<Vec<_>>();
        let rows: Vec<Vec<f64>> = (0..N + 2).map(row).collect();
        let (mut sum, mut bend) = (0.0, 0.0);
        for v in 1..=N {
            for u in 1..=N {
                let here = rows[v][u];
                sum += here;
                bend += (rows[v][u - 1] - 2.0 * here + rows[v][u + 1]).abs();
                bend += (rows[v - 1][u] - 2.0 * here + rows[v + 1][u]).abs();
            }
        }
        let cells = (N * N) as f64;
        (sum / cells, bend / cells / 8.0 + 1e-13)
    }

    #[test]
    fn pixels_agree_with_the_mean_of_a_fine_grid() {
        for (scene, pixels) in
            [(standard(), [(3, 5), (30, 24), (20, 40), (52, 31)]), (crooked(), [(0, 0), (8, 9), (12, 4), (20, 12)])]
        {
            for (i, j) in pixels {
                let exact = scene.pixel(i, j).unwrap();
                let (mean, bound) = brute_force(&scene, i, j);
                assert!((exact.value - mean).abs() <= bound, "({i}, {j}): {exact:?} {mean} ± {bound}");
                assert!(bound <= 1e-5, "the grid must be a sharp test: {bound}");
            }
        }
    }

    #[test]
    fn known_kinks_make_every_pixel_cheap() {
        for scene in [standard(), crooked()] {
            let mut most = 0;
            for p in 0..scene.camera().width * scene.camera().height {
                let pixel = scene.pixel(p % scene.camera().width, p / scene.camera().width).unwrap();
                assert!(pixel.error <= 1e-10 * scene.plane().albedo * scene.light().emission);
                most = most.max(pixel.evaluations);
            }
            assert!(most <= 100_000, "{most}");
        }
    }

    #[test]
    fn breaks_change_the_cost_and_not_the_value() {
        for scene in [standard(), crooked()] {
            let blind = Penumbra { kinks: Vec::new(), ..scene.clone() };
            for (i, j) in [(3, 5), (12, 9), (20, 12), (8, 9)] {
                let (told, found) = (scene.pixel(i, j).unwrap(), blind.pixel(i, j).unwrap());
                assert!((told.value - found.value).abs() <= found.error + told.error, "({i}, {j}): {told:?} {found:?}");
            }
        }
    }

    #[test]
    fn the_image_is_its_pixels_in_rows_and_the_umbra_is_black() {
        let scene = Penumbra::standard(12, 10).unwrap();
        let image = scene.image().unwrap();
        assert_eq!(image.len(), 120);
        assert_eq!(image[12 * 7 + 3], scene.pixel(3, 7).unwrap().value);
        assert!(standard().image().unwrap().contains(&0.0));
    }

    #[test]
    fn a_blocker_that_is_elsewhere_leaves_the_open_light() {
        let scene = standard();
        let far = scene.blocker().iter().map(|&c| c + DVec3::new(0.0, 0.0, 1e6)).collect();
        let open = Penumbra::new(*scene.camera(), *scene.plane(), scene.light().clone(), far).unwrap();
        for (x, y) in [(0.0, 0.0), (30.0, 30.0), (59.5, 17.25)] {
            assert_eq!(open.radiance(x, y), 0.75 * open.light().irradiance(&open.receiver(x, y)));
        }
    }

    #[test]
    fn the_centre_of_the_picture_is_where_the_camera_looks() {
        let at = standard().receiver(30.0, 30.0);
        assert!((at.point - DVec3::new(0.0, 0.0, 0.9375 * 0.75 - 1.25)).length() <= 1e-15);
        // right = direction × up points to −x, and rows run down the picture, towards the camera.
        assert!(standard().receiver(60.0, 30.0).point.x < 0.0);
        assert!(standard().receiver(30.0, 60.0).point.z < at.point.z);
    }

    #[test]
    fn scenes_without_a_closed_form_are_refused_with_place_and_reason() {
        let good = standard();
        let build = |camera: Pinhole, plane: DiffusePlane, light: PolygonLight, blocker: Vec<DVec3>| {
            Penumbra::new(camera, plane, light, blocker).unwrap_err().to_string()
        };
        let (camera, plane, light, bar) = (good.camera, good.plane, good.light.clone(), good.blocker.clone());
        let with = |camera: Pinhole| build(camera, plane, light.clone(), bar.clone());
        assert!(with(Pinhole { fov_y_degrees: 180.0, ..camera }).contains("camera.fov_y_degrees: expected an angle"));
        assert!(with(Pinhole { fov_y_degrees: f64::NAN, ..camera }).contains("found NaN"));
        assert!(with(Pinhole { direction: DVec3::Y, ..camera }).contains("camera.direction"));
        assert!(with(Pinhole { width: 0, ..camera }).contains("camera.width"));
        assert!(with(Pinhole { position: DVec3::new(0.0, -1.0, 0.0), ..camera }).contains("above the plane"));
        assert!(with(Pinhole { direction: DVec3::Z, ..camera }).contains("the plane in all corners"));
        assert!(with(Pinhole { position: DVec3::new(0.0, 2.0, -1.25), ..camera }).contains("blocker.corners"));
        assert!(build(camera, DiffusePlane { albedo: 1.5, ..plane }, light.clone(), bar.clone()).contains("albedo"));
        let dark = PolygonLight { emission: -1.0, ..light.clone() };
        assert!(build(camera, plane, dark, bar.clone()).contains("emission"));
        let bow_tie = vec![bar[0], bar[2], bar[1], bar[3]];
        let low = bar.iter().map(|&c| c - DVec3::Y).collect();
        for (blocker, reason) in [(bow_tie, "convex"), (vec![bar[0]; 3], "convex"), (low, "above the plane")] {
            assert!(build(camera, plane, light.clone(), blocker).contains(reason), "{reason}");
        }
    }
}

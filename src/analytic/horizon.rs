//! A checkered plane that runs to the horizon, seen by a level pinhole: the exact box-filtered picture of it.
//!
//! Tile coordinates (X, Z) are linear in the place (x, z) on the plane y = 0, with borders between tiles at integers. The
//! colour is mid + half · s(X) s(Z), where s is the square wave of period 2 with ramps of a given width in place of its
//! jumps: what bilinear look-up makes of a texture of sharp tiles, to the last texel, the ramp being one texel wide.
//!
//! Along a row of the image the depth z is constant, since the camera is level, so X and Z are linear in the image
//! position and s(X) s(Z) is piecewise quadratic: ∫ dx is a finite sum, exact but for rounding. What is left is a
//! one-dimensional integral over the pixel's height of a function that is analytic but for kinks in rows where the border
//! of a ramp enters by a side of the pixel or meets another. These rows are known, and the
//! [quadrature](crate::analytic::quadrature) gets them as exact breaks.

use glam::DVec3;
use rayon::prelude::*;

use crate::analytic::penumbra::{Pinhole, View, check_camera};
use crate::analytic::quadrature::{Tolerance, integrate};
use crate::error::{Error, Result};

/// Error of a pixel's [`Seen::checker`], which is within ±1: far below the rounding of the `f32` in which pictures are stored.
pub const PIXEL_TOLERANCE: f64 = 1e-9;

/// √(1/3) and √(3/5): the outer nodes of the Gauss rules of two and three points on [−1, 1].
const GAUSS_2: f64 = 0.577_350_269_189_625_8;
const GAUSS_3: f64 = 0.774_596_669_241_483_4;

/// The plane's pattern and extent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CheckeredPlane {
    /// X = `across` · (x, z), in tiles.
    pub across: [f64; 2],
    /// Z = `along` · (x, z), in tiles.
    pub along: [f64; 2],
    /// Width of the ramp between two tiles, in tiles, above 0 and at most 1.
    pub ramp: f64,
    /// The plane ends at this z, behind which there is nothing but sky.
    pub far: f64,
}

impl CheckeredPlane {
    /// The tile coordinates X and Z of the place (x, z).
    pub fn tiles(&self, x: f64, z: f64) -> [f64; 2] {
        [self.across, self.along].map(|axis| axis[0] * x + axis[1] * z)
    }

    /// s(X) s(Z) at the place (x, z): 1 in a pale tile, −1 in a dark one, between them on a ramp.
    pub fn checker(&self, x: f64, z: f64) -> f64 {
        let [across, along] = self.tiles(x, z);
        self.wave(across) * self.wave(along)
    }

    /// s(v): 1 between 0 and 1, −1 between 1 and 2, and so on, with ramps about the integers.
    fn wave(&self, v: f64) -> f64 {
        let border = v.round();
        let height = ((v - border) * 2.0 / self.ramp).clamp(-1.0, 1.0);
        // Borders are far below 2⁵³, so the remainder is exact.
        if border % 2.0 == 0.0 { height } else { -height }
    }
}

/// One wave along a row of the image: linear pieces in the order in which the row runs through them.
///
/// s is odd, so a row that runs backward is one that runs forward with the other sign; u is the tile coordinate in the
/// direction of the row.
#[derive(Debug, Clone, Copy)]
struct Walk {
    /// u where the row starts, and u per pixel, 0 or above.
    start: f64,
    step: f64,
    ramp: f64,
    /// The border whose ramp is next, or under way.
    border: f64,
    on_ramp: bool,
    /// −s before that border: 1 before an even one, where the row runs forward.
    sign: f64,
}

impl Walk {
    fn new(start: f64, step: f64, ramp: f64) -> Self {
        let direction = step.signum();
        let start = start * direction;
        let border = (start - ramp / 2.0).floor() + 1.0;
        // Borders are far below 2⁵³, so the remainder is exact.
        let sign = if border % 2.0 == 0.0 { direction } else { -direction };
        Self { start, step: step.abs(), ramp, border, on_ramp: start >= border - ramp / 2.0, sign }
    }

    /// Where this piece ends, in pixels from the start; ∞ where the row runs along a border.
    fn end(&self) -> f64 {
        let half = if self.on_ramp { self.ramp / 2.0 } else { -self.ramp / 2.0 };
        (self.border + half - self.start) / self.step
    }

    fn advance(&mut self) {
        if self.on_ramp {
            (self.border, self.sign) = (self.border + 1.0, -self.sign);
        }
        self.on_ramp = !self.on_ramp;
    }

    /// s at `x` pixels from the start, which is on this piece.
    fn at(&self, x: f64) -> f64 {
        if self.on_ramp {
            self.sign * (self.start + self.step * x - self.border) * (2.0 / self.ramp)
        } else {
            -self.sign
        }
    }
}

/// What a pixel sees of the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Share of the pixel's area that the plane fills, 0 to 1; the rest is sky.
    pub plane: f64,
    /// ∫ s(X) s(Z) over that part of the pixel's area: within ±`plane`, 0 where pale and dark are even.
    pub checker: f64,
    /// Estimated absolute error of `checker`, at most [`PIXEL_TOLERANCE`].
    pub error: f64,
}

impl Seen {
    /// The pixel's colour in one channel.
    pub fn colour(&self, pale: f64, dark: f64, sky: f64) -> f64 {
        self.plane * (pale + dark) / 2.0 + self.checker * (pale - dark) / 2.0 + (1.0 - self.plane) * sky
    }
}

/// The scene, checked.
#[derive(Debug, Clone)]
pub struct Horizon {
    camera: Pinhole,
    plane: CheckeredPlane,
    view: View,
    /// Image position of the plane's far end, in pixels from the upper border; above it is sky.
    horizon: f64,
}

impl Horizon {
    /// Depth of the nearest place and of the far end of the standard plane, and half its width per depth.
    pub const STANDARD: [f64; 3] = [4.0, 512.0, 1.5];

    /// Checks the scene.
    ///
    /// # Errors
    /// Kind `Input` with the place, what was expected and what was found: a number that is not finite or out of range, a
    /// camera that is not level, not above the plane or does not look along +z.
    pub fn new(camera: Pinhole, plane: CheckeredPlane) -> Result<Self> {
        check_camera(&camera)?;
        let view = View::of(&camera);
        let numbers = [plane.across, plane.along].concat();
        expect(numbers.iter().all(|n| n.is_finite()), "plane", "finite numbers", plane)?;
        expect(plane.ramp > 0.0 && plane.ramp <= 1.0, "plane.ramp", "a width above 0 and at most 1", plane.ramp)?;
        expect(
            view.right.y == 0.0 && view.right.z == 0.0,
            "camera.up",
            "a level camera that looks along z",
            camera.up,
        )?;
        let eye = camera.position;
        expect(eye.y > 0.0, "camera.position", "a place above the plane", eye)?;
        expect(plane.far.is_finite() && plane.far > eye.z, "plane.far", "a depth before the camera", plane.far)?;
        let lowest = view.ray(0.0, f64::from(camera.height));
        expect(
            lowest.y < 0.0 && lowest.z > 0.0,
            "camera.direction",
            "the plane at the lower border",
            camera.direction,
        )?;
        let mut scene = Self { camera, plane, view, horizon: 0.0 };
        scene.horizon = scene.row_of(plane.far);
        Ok(scene)
    }

    /// The lab's own scene `horizon` in an image of `width` × `height` pixels: tiles of side 4/√17, turned by atan(1/4)
    /// against the view so that no border runs along a row of pixels, from below the camera to a depth of 512; the eye is
    /// 4 above them. All numbers are exact in f32.
    ///
    /// # Errors
    /// Kind `Input`: 0 pixels, or an image so wide that it shows more than the plane and the sky.
    pub fn standard(width: u32, height: u32) -> Result<Self> {
        let camera = Pinhole {
            position: DVec3::new(0.0, 4.0, 0.0),
            direction: DVec3::new(0.0, -1.0, 4.0),
            up: DVec3::Y,
            fov_y_degrees: 48.0,
            width,
            height,
        };
        let [near, far, spread] = Self::STANDARD;
        let plane = CheckeredPlane { across: [1.0, 0.25], along: [-0.25, 1.0], ramp: 1.0 / 256.0, far };
        let scene = Self::new(camera, plane)?;
        for (x, y) in [(0.0, f64::from(height)), (f64::from(width), f64::from(height)), (0.0, scene.horizon)] {
            let [aside, depth] = scene.place(x, y);
            let is_inside = aside.abs() < spread * depth && depth > near;
            expect(is_inside, "camera", "a picture of the plane and the sky alone", [aside, depth])?;
        }
        Ok(scene)
    }

    /// The camera.
    pub fn camera(&self) -> &Pinhole {
        &self.camera
    }

    /// The plane.
    pub fn plane(&self) -> &CheckeredPlane {
        &self.plane
    }

    /// The place (x, z) on the plane that is seen at the image position (x, y), in pixels from the upper left corner, y
    /// below the horizon.
    pub fn place(&self, x_px: f64, y_px: f64) -> [f64; 2] {
        let ray = self.view.ray(x_px, y_px);
        let t = -self.camera.position.y / ray.y;
        [self.camera.position.x + t * ray.x, self.camera.position.z + t * ray.z]
    }

    /// The row of the image, in pixels from the upper border, in which the plane is seen at depth `z`: with rays
    /// corner + y down, (corner_y + y down_y)(z − eye_z) = −eye_y (corner_z + y down_z).
    fn row_of(&self, z: f64) -> f64 {
        let (eye, View { corner, down, .. }) = (self.camera.position, &self.view);
        let depth = z - eye.z;
        -(corner.y * depth + eye.y * corner.z) / (down.y * depth + eye.y * down.z)
    }

    /// ∫ s(X) s(Z) dx along the row y between two image positions.
    fn along_row(&self, [from, to]: [f64; 2], y: f64) -> f64 {
        let plane = &self.plane;
        let [x, z] = self.place(from, y);
        let per_pixel = self.view.right.x * -self.camera.position.y / self.view.ray(from, y).y;
        let start = plane.tiles(x, z);
        let step = [plane.across[0] * per_pixel, plane.along[0] * per_pixel];
        let mut walks = [0, 1].map(|axis| Walk::new(start[axis], step[axis], plane.ramp));
        let (length, mut at, mut sum) = (to - from, 0.0, 0.0);
        while at < length {
            let ends = walks.map(|walk| walk.end());
            let end = ends[0].min(ends[1]).min(length).max(at);
            let (centre, half) = (0.5 * (at + end), 0.5 * (end - at));
            // The product is quadratic: two Gauss points are exact to degree three.
            let node = half * GAUSS_2;
            let product = |x: f64| walks[0].at(x) * walks[1].at(x);
            sum += half * (product(centre - node) + product(centre + node));
            at = end;
            for (walk, reached) in std::iter::zip(&mut walks, ends) {
                if reached <= end {
                    walk.advance();
                }
            }
        }
        sum
    }

    /// The row in which the line `axis` · (x, z) = v of the plane crosses a side x of a pixel: the rays d through the line
    /// are those with (axis · (eye_x, eye_z) − v) d_y = eye_y axis · (d_x, d_z), which is linear in x and y.
    fn row_on_side(&self, axis: [f64; 2], v: f64, x: f64) -> f64 {
        let (eye, View { corner, right, down }) = (self.camera.position, &self.view);
        let above = axis[0] * eye.x + axis[1] * eye.z - v;
        let of = |d: DVec3| above * d.y - eye.y * (axis[0] * d.x + axis[1] * d.z);
        -of(*corner + *right * x) / of(*down)
    }

    /// The rows at which ∫ dx between the sides is not smooth, at least those between `top` and `bottom`: where a ramp's border passes
    /// through a side, and where two cross between them.
    fn kinks(&self, sides: [f64; 2], [top, bottom]: [f64; 2]) -> Vec<f64> {
        let plane = &self.plane;
        let axes = [plane.across, plane.along];
        let places =
            [(sides[0], top), (sides[1], top), (sides[0], bottom), (sides[1], bottom)].map(|(x, y)| self.place(x, y));
        let borders = axes.map(|axis| {
            let tiles = places.map(|[x, z]| axis[0] * x + axis[1] * z);
            let (low, high) = tiles.iter().fold((f64::MAX, f64::MIN), |(low, high), &v| (low.min(v), high.max(v)));
            let half = plane.ramp / 2.0;
            let numbers = (low - half).ceil() as i64..=(high + half).floor() as i64;
            numbers.flat_map(|n| [n as f64 - half, n as f64 + half]).collect::<Vec<f64>>()
        });
        let mut rows = Vec::new();
        for (axis, borders) in std::iter::zip(axes, &borders) {
            for &v in borders {
                rows.extend(sides.map(|x| self.row_on_side(axis, v, x)));
            }
        }
        let [[a, b], [c, d]] = axes;
        let determinant = a * d - b * c;
        for &v in &borders[0] {
            for &w in &borders[1] {
                let (x, z) = ((d * v - b * w) / determinant, (a * w - c * v) / determinant);
                let row = self.row_of(z);
                if top < row && row < bottom {
                    let [one, other] = sides.map(|side| self.place(side, row)[0]);
                    if (one - x) * (other - x) <= 0.0 {
                        rows.push(row);
                    }
                }
            }
        }
        rows
    }

    /// What the pixel in column i and row j from the upper left sees.
    ///
    /// # Errors
    /// Kind `Incomplete` where the quadrature does not reach [`PIXEL_TOLERANCE`].
    pub fn pixel(&self, i: u32, j: u32) -> Result<Seen> {
        let sides = [f64::from(i), f64::from(i) + 1.0];
        let bottom = f64::from(j) + 1.0;
        let top = f64::from(j).max(self.horizon);
        let mut seen = Seen { plane: (bottom - top).max(0.0), checker: 0.0, error: 0.0 };
        if top >= bottom {
            return Ok(seen);
        }
        let [far, near] = [top, bottom].map(|y| self.place(sides[0], y)[1]);
        // Slices of two units of depth keep lists of borders short.
        let slices = ((far - near) / 2.0).ceil().max(1.0) as u32;
        let mut y = top;
        for slice in 1..=slices {
            let depth = far + (near - far) * f64::from(slice) / f64::from(slices);
            let end = if slice == slices { bottom } else { self.row_of(depth).clamp(y, bottom) };
            let [value, error] =
                self.slice(sides, [y, end]).map_err(|e| Error { place: format!("horizon: pixel ({i}, {j})"), ..e })?;
            seen.checker += value;
            seen.error += error;
            y = end;
        }
        Ok(seen)
    }

    /// ∫∫ s(X) s(Z) over a pixel between two rows, and its estimated error.
    ///
    /// Between kinks the integrand is so smooth that Gauss rules of two and three points mostly agree to more than is
    /// asked; where they do not, the adaptive rule takes over.
    fn slice(&self, sides: [f64; 2], [top, bottom]: [f64; 2]) -> Result<[f64; 2]> {
        let mut rows = self.kinks(sides, [top, bottom]);
        rows.retain(|row| top < *row && *row < bottom);
        rows.sort_by(f64::total_cmp);
        rows.push(bottom);
        let along = |y: f64| self.along_row(sides, y);
        let (mut value, mut error, mut y) = (0.0, 0.0, top);
        for end in rows {
            let (centre, half) = (0.5 * (y + end), 0.5 * (end - y));
            let pair = |node: f64| along(centre - node * half) + along(centre + node * half);
            let two = half * pair(GAUSS_2);
            let three = half * (5.0 / 9.0 * pair(GAUSS_3) + 8.0 / 9.0 * along(centre));
            // No tolerance below what rounding allows.
            let tolerance = PIXEL_TOLERANCE * (end - y).max(1e-6);
            let part = if (three - two).abs() <= tolerance {
                [three, (three - two).abs()]
            } else {
                let part = integrate(along, [y, end], &[], Tolerance::absolute(tolerance))?;
                [part.value, part.error]
            };
            value += part[0];
            error += part[1];
            y = end;
        }
        Ok([value, error])
    }

    /// All pixels, row by row from the upper left.
    ///
    /// # Errors
    /// As [`pixel`](Self::pixel).
    pub fn image(&self) -> Result<Vec<Seen>> {
        let width = u64::from(self.camera.width);
        (0..width * u64::from(self.camera.height))
            .into_par_iter()
            // Both fit: they are less than the u32 width and height.
            .map(|at| self.pixel((at % width) as u32, (at / width) as u32))
            .collect()
    }
}

fn expect(holds: bool, place: &str, expected: &str, found: impl std::fmt::Debug) -> Result<()> {
    if holds {
        return Ok(());
    }
    Err(Error::input(format!("horizon: {place}"), format!("expected {expected}, found {found:?}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn standard() -> Horizon {
        Horizon::standard(40, 24).unwrap()
    }

    #[test]
    fn the_wave_is_a_square_wave_with_ramps_about_the_integers() {
        let plane = CheckeredPlane { ramp: 0.25, ..*standard().plane() };
        for (v, s) in [(0.5, 1.0), (0.125, 1.0), (0.0625, 0.5), (0.0, 0.0), (-0.0625, -0.5), (-0.5, -1.0)] {
            for period in [-8.0, 0.0, 2.0, 1024.0] {
                assert_eq!(plane.wave(v + period), s, "{v}");
                assert_eq!(plane.wave(v + period + 1.0), -s, "{v} + 1");
            }
        }
    }

    #[test]
    fn a_walk_meets_the_wave_s_pieces_in_order_in_both_directions() {
        let plane = CheckeredPlane { ramp: 0.25, ..*standard().plane() };
        for (start, step) in
            [(0.5, 0.1), (0.5, -0.1), (-0.875, 3.0), (-1.05, -0.7), (7.125, 2.0), (6.875, -2.0), (0.3, 0.0)]
        {
            let (mut walk, mut from) = (Walk::new(start, step, plane.ramp), 0.0);
            for piece in 0..9 {
                let end = walk.end().min(99.0);
                assert!(end >= from, "{start} {step}, piece {piece}");
                for share in [0.0, 0.3, 1.0] {
                    let x = from + share * (end - from);
                    let difference = walk.at(x) - plane.wave(start + step * x);
                    assert!(difference.abs() < 1e-12, "{start} {step}, piece {piece} at {x}: {difference}");
                }
                from = end;
                walk.advance();
                if step == 0.0 {
                    break;
                }
            }
        }
    }

    #[test]
    fn a_row_is_integrated_exactly() {
        let scene = standard();
        for y in [5.6, 6.0, 9.7, 23.2] {
            // Midpoint rule: kinks and ramps, a tenth of a step wide at the horizon, leave at most about two steps' worth.
            const STEPS: u32 = 400_000;
            let (from, to) = (3.0, 4.0);
            let middle = |k: u32| from + (to - from) * (f64::from(k) + 0.5) / f64::from(STEPS);
            let at = |x: f64| {
                let [x, z] = scene.place(x, y);
                scene.plane.checker(x, z)
            };
            let slow = (0..STEPS).map(|k| at(middle(k))).sum::<f64>() / f64::from(STEPS);
            let exact = scene.along_row([from, to], y);
            assert!((exact - slow).abs() < 1e-6, "row {y}: {exact} {slow}");
            assert!((scene.along_row([from, 3.3], y) + scene.along_row([3.3, to], y) - exact).abs() < 1e-13, "row {y}");
        }
    }

    #[test]
    fn pixels_are_the_means_of_the_pixels_they_are_cut_into() {
        let (coarse, fine) = (standard(), Horizon::standard(120, 72).unwrap());
        for (i, j) in [(0, 23), (17, 20), (39, 12), (5, 8), (33, 6), (0, 5), (20, 5), (20, 4)] {
            let whole = coarse.pixel(i, j).unwrap();
            let parts: Vec<Seen> = (0..9).map(|k| fine.pixel(3 * i + k % 3, 3 * j + k / 3).unwrap()).collect();
            let mean = |part: fn(&Seen) -> f64| parts.iter().map(part).sum::<f64>() / 9.0;
            assert!((whole.plane - mean(|p| p.plane)).abs() < 1e-12, "({i}, {j})");
            // What the quadratures report, and the rounding of some thousand pieces.
            let bound = whole.error + mean(|p| p.error) + 1e-12;
            assert!(
                (whole.checker - mean(|p| p.checker)).abs() <= bound,
                "({i}, {j}): {whole:?} {:e}",
                whole.checker - mean(|p| p.checker)
            );
            assert!(whole.error <= PIXEL_TOLERANCE && whole.checker.abs() <= whole.plane, "({i}, {j}): {whole:?}");
        }
    }

    /// Midpoint rule on 1500 × 1500 places: a border between tiles misplaces at most about 1/1500 of the area of a row of
    /// places each, at random.
    #[test]
    fn pixels_agree_with_a_fine_grid_of_places() {
        const SIDE: u32 = 1500;
        let scene = standard();
        for (i, j) in [(2, 22), (20, 10), (31, 7), (8, 6)] {
            let centre = |start: u32, k: u32| f64::from(start) + (f64::from(k) + 0.5) / f64::from(SIDE);
            let mut sum = 0.0;
            for row in 0..SIDE {
                let y = centre(j, row);
                for column in 0..SIDE {
                    let [x, z] = scene.place(centre(i, column), y);
                    sum += if y > scene.horizon { scene.plane.checker(x, z) } else { 0.0 };
                }
            }
            let slow = sum / f64::from(SIDE * SIDE);
            let exact = scene.pixel(i, j).unwrap();
            assert!((exact.checker - slow).abs() < 5e-4, "({i}, {j}): {exact:?} {slow}");
        }
    }

    #[test]
    fn the_sky_is_sky_and_the_horizon_row_shares_its_pixel() {
        let scene = standard();
        assert_eq!(scene.pixel(3, 0).unwrap(), Seen { plane: 0.0, checker: 0.0, error: 0.0 });
        let row = scene.horizon.floor() as u32;
        let seen = scene.pixel(3, row).unwrap();
        assert!((seen.plane - (f64::from(row) + 1.0 - scene.horizon)).abs() < 1e-12);
        assert_eq!(Seen { plane: 0.5, checker: 0.25, error: 0.0 }.colour(0.8, 0.2, 1.0), 0.25 + 0.075 + 0.5);
        let [_, depth] = scene.place(20.0, scene.horizon);
        assert!((depth / 512.0 - 1.0).abs() < 1e-10, "{depth}");
    }

    #[test]
    fn what_is_no_such_picture_is_refused_with_its_place() {
        let (camera, plane) = (*standard().camera(), *standard().plane());
        let refused = |camera: Pinhole, plane: CheckeredPlane| Horizon::new(camera, plane).unwrap_err().place;
        assert_eq!(refused(camera, CheckeredPlane { ramp: 0.0, ..plane }), "horizon: plane.ramp");
        assert_eq!(refused(camera, CheckeredPlane { far: f64::NAN, ..plane }), "horizon: plane.far");
        assert_eq!(refused(Pinhole { up: DVec3::new(0.1, 1.0, 0.0), ..camera }, plane), "horizon: camera.up");
        assert_eq!(refused(Pinhole { position: DVec3::NEG_Y, ..camera }, plane), "horizon: camera.position");
        assert_eq!(
            refused(Pinhole { direction: DVec3::new(0.0, 1.0, 1.0), ..camera }, plane),
            "horizon: camera.direction"
        );
        assert!(Horizon::standard(0, 4).is_err() && Horizon::standard(400, 40).is_err());
    }
}

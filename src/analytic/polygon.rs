//! Irradiance from a one-sided diffuse polygon in closed form, whole or behind a convex blocker.
//!
//! Irradiance at a point with unit normal n, in the convention of the renderer (no 1/π; exit radiance is albedo · E):
//!
//! E = k_e ∫ cos θ cos θ_l / r² dA = (k_e/2) |Σ Θ_i (n · G_i)|,
//!
//! with v_i the vectors from the point to the corners, G_i the unit vector of v_i × v_{i+1} and Θ_i the angle between
//! v_i and v_{i+1} (Lambert 1760; Howell's catalogue C-11, C-12 as independent forms).
//!
//! # Numbers
//!
//! The contour sum adds angles of the size of the light's edges and leaves the light's *solid angle*: it loses all
//! digits for a light that is far, tiny or seen edge-on. Therefore
//!
//! - the polygon is kept as one vector to a corner plus offsets from it, so that its shape is not rounded to the
//!   precision of its distance, and v_i × v_{i+1} is taken as v_i × (v_{i+1} − v_i);
//! - where the sum is below 1/32 of its terms, the area integral is taken instead, whose integrand is never
//!   negative: by an 8 × 8 Gauss–Legendre rule on triangles, each halved until its longest edge is at most 1/5 of its
//!   distance. Its poles are then 17 ellipse radii away, so the rule's error is of the order of 17⁻¹⁶ = 2·10⁻²⁰.
//!
//! The relative error is of the order of 10⁻¹⁴ for lights of any size and distance (lengths and ratios within 10^±60).

use glam::DVec3;

/// A point of a surface and the unit normal of the side that receives light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receiver {
    /// Position in scene units.
    pub point: DVec3,
    /// Unit normal.
    pub normal: DVec3,
}

/// A flat polygon that emits the same radiance in all directions of its front side.
#[derive(Debug, Clone, PartialEq)]
pub struct PolygonLight {
    /// Corners of a convex planar polygon, counter-clockwise seen from the side that emits, in scene units.
    pub corners: Vec<DVec3>,
    /// Emitted radiance k_e ≥ 0.
    pub emission: f64,
}

impl PolygonLight {
    /// Area in square scene units; 0 for fewer than three corners.
    pub fn area(&self) -> f64 {
        area_vector(&self.corners).length()
    }

    /// Irradiance at a receiver without any blocker: exactly 0 where the point is not strictly in front of the light
    /// or the light is below the receiver's horizon.
    pub fn irradiance(&self, at: &Receiver) -> f64 {
        self.emission * Patch::of(self, at.point).map_or(0.0, |patch| patch.lit_form(at.normal))
    }

    /// Irradiance at a receiver behind a convex planar `blocker` (either winding, opaque from both sides, no
    /// thickness): the sum over the light's visible parts, exactly 0 in the umbra, [`Self::irradiance`] outside the shadow.
    pub fn irradiance_behind(&self, blocker: &[DVec3], at: &Receiver) -> f64 {
        let Some(patch) = Patch::of(self, at.point) else { return 0.0 };
        let parts = patch.divide(blocker, at.point);
        self.emission * parts.visible.into_iter().map(|part| part.lit_form(at.normal)).sum::<f64>()
    }

    /// The parts of the light that `point` sees past a convex planar `blocker`, as convex polygons with the light's
    /// winding. Empty in the umbra; the horizon is not considered. A blocker hides what lies beyond its plane and
    /// within its cone; seen edge-on it hides nothing.
    pub fn visible_parts(&self, blocker: &[DVec3], point: DVec3) -> Vec<Vec<DVec3>> {
        let Some(patch) = Patch::of(self, point) else { return Vec::new() };
        patch.divide(blocker, point).visible.iter().map(|part| part.corners(self)).collect()
    }

    /// The part of the light that `point` sees past the straight edge from `a` to `b` of a half-plane: the side of
    /// the plane through `point`, `a` and `b` to which (a − point) × (b − point) points. Fewer than three corners: none.
    pub fn visible_past_edge(&self, a: DVec3, b: DVec3, point: DVec3) -> Vec<DVec3> {
        let Some(patch) = Patch::of(self, point) else { return Vec::new() };
        let (visible, _) = patch.split((a - point).cross(b - a), 0.0);
        visible.map_or_else(Vec::new, |part| part.corners(self))
    }
}

/// ½ Σ p_i × p_{i+1}: along the normal by winding, as long as the area. Taken from a corner, so that distance from
/// the origin costs no digits.
pub(super) fn area_vector(polygon: &[DVec3]) -> DVec3 {
    let Some(&first) = polygon.first() else { return DVec3::ZERO };
    polygon.windows(2).map(|pair| (pair[0] - first).cross(pair[1] - first)).sum::<DVec3>() * 0.5
}

/// A light, or a part of one, as a point in front of it sees it.
#[derive(Debug, Clone)]
pub(super) struct Patch {
    /// From the point to the light's first corner.
    base: DVec3,
    /// Corners, seen from that first corner.
    offsets: Vec<DVec3>,
    /// Distance of the point from the light's plane, above 0.
    height: f64,
}

/// A light cut by a blocker's shadow volume.
pub(super) struct Parts {
    /// Convex, disjoint, together the part that is seen.
    pub visible: Vec<Patch>,
    /// The part behind the blocker.
    pub hidden: Option<Patch>,
}

impl Patch {
    /// The whole light, or `None` where the point is not strictly in front of it or it has no area.
    pub fn of(light: &PolygonLight, point: DVec3) -> Option<Self> {
        let first = *light.corners.first()?;
        let across = area_vector(&light.corners);
        let area = across.length();
        let height = across.dot(point - first) / area;
        let offsets = light.corners.iter().map(|&corner| corner - first).collect();
        // An area of 0 makes the height NaN, which is not above 0 either.
        (height > 0.0).then_some(Self { base: first - point, offsets, height })
    }

    /// Any polygon around any point, for cutting alone: without the emitting side's height it has no irradiance.
    pub fn around(corners: &[DVec3], point: DVec3) -> Self {
        let first = corners.first().copied().unwrap_or(point);
        Self { base: first - point, offsets: corners.iter().map(|&corner| corner - first).collect(), height: 0.0 }
    }

    fn corners(&self, light: &PolygonLight) -> Vec<DVec3> {
        self.offsets.iter().map(|&offset| light.corners[0] + offset).collect()
    }

    pub fn area(&self) -> f64 {
        area_vector(&self.offsets).length()
    }

    /// The parts on both sides of the plane { v : normal · v = level }, v from the point: first the side where
    /// normal · v is larger. Corners on the plane belong to both; a polygon that is not cut is passed on bit for bit.
    pub fn split(self, normal: DVec3, level: f64) -> (Option<Self>, Option<Self>) {
        let shift = normal.dot(self.base) - level;
        let sides = || self.offsets.iter().map(|&offset| normal.dot(offset) + shift);
        if sides().all(|s| s <= 0.0) {
            return (None, Some(self));
        }
        if sides().all(|s| s >= 0.0) {
            return (Some(self), None);
        }
        let side: Vec<f64> = sides().collect();
        // A convex polygon loses a corner at least and gains two.
        let (mut above, mut below) = (Vec::with_capacity(side.len() + 1), Vec::with_capacity(side.len() + 1));
        for i in 0..side.len() {
            let j = (i + 1) % side.len();
            let (here, next) = (self.offsets[i], self.offsets[j]);
            if side[i] >= 0.0 {
                above.push(here);
            }
            if side[i] <= 0.0 {
                below.push(here);
            }
            if (side[i] < 0.0 && side[j] > 0.0) || (side[i] > 0.0 && side[j] < 0.0) {
                let cut = here + (next - here) * (side[i] / (side[i] - side[j]));
                above.push(cut);
                below.push(cut);
            }
        }
        (Some(Self { offsets: above, ..self }), Some(Self { offsets: below, ..self }))
    }

    /// Cuts the shadow of a convex blocker out, one plane after the other: what lies outside a plane is visible and
    /// convex, what is inside all is hidden. A sum over visible parts keeps its digits next to the umbra, where a
    /// difference of whole and hidden would not.
    pub fn divide(self, blocker: &[DVec3], point: DVec3) -> Parts {
        let planes = shadow_planes(blocker, point);
        let misses = |&(normal, level): &(DVec3, f64)| {
            let shift = normal.dot(self.base) - level;
            self.offsets.iter().all(|&offset| normal.dot(offset) + shift <= 0.0)
        };
        if planes.is_empty() || planes.iter().any(misses) {
            return Parts { visible: vec![self], hidden: None };
        }
        let mut visible = Vec::new();
        let mut rest = self.clone();
        for (normal, level) in planes {
            let (inside, outside) = rest.split(normal, level);
            visible.extend(outside);
            match inside {
                Some(inside) => rest = inside,
                // Light and shadow passed each other by: the cuts were needless.
                None => return Parts { visible: vec![self], hidden: None },
            }
        }
        Parts { visible, hidden: Some(rest) }
    }

    /// E / k_e of the part above the horizon.
    pub fn lit_form(self, normal: DVec3) -> f64 {
        self.split(normal, 0.0).0.map_or(0.0, |part| part.form(normal))
    }

    /// E / k_e of a patch above the horizon, by the contour sum or, where that cancels, by area.
    pub fn form(&self, normal: DVec3) -> f64 {
        const LARGEST_CANCELLATION: f64 = 32.0;
        let (sum, terms) = self.contour(normal);
        if terms <= LARGEST_CANCELLATION * sum.abs() {
            0.5 * sum.abs()
        } else {
            self.integrate(|v| self.kernel(normal, v))
        }
    }

    /// Σ Θ_i (n · G_i), and Σ Θ_i, which tells the rounding error of the former.
    fn contour(&self, normal: DVec3) -> (f64, f64) {
        let (mut sum, mut terms) = (0.0, 0.0);
        for (i, &offset) in self.offsets.iter().enumerate() {
            let next = self.offsets[(i + 1) % self.offsets.len()];
            let (v, w) = (self.base + offset, self.base + next);
            let across = v.cross(next - offset);
            let length = across.length();
            if length > 0.0 {
                let angle = libm::atan2(length, v.dot(w));
                sum += angle * (normal.dot(across) / length);
                terms += angle;
            }
        }
        (sum, terms)
    }

    /// cos θ cos θ_l / r² at v, from the point.
    pub fn kernel(&self, normal: DVec3, v: DVec3) -> f64 {
        let square = v.length_squared();
        normal.dot(v) / square * (self.height / square)
    }

    /// ∫ f(v) dA over the patch, for f that is smooth but for poles at v = 0.
    pub fn integrate(&self, f: impl Fn(DVec3) -> f64) -> f64 {
        // A triangle that holds the point's foot halves until it is as small as the point is near; the limit is for
        // a foot so near that coordinates are no longer told apart.
        const MOST_HALVINGS: u32 = 256;
        let first = self.offsets[0];
        let mut todo: Vec<([DVec3; 3], u32)> =
            self.offsets[1..].windows(2).map(|pair| ([first, pair[0], pair[1]], 0)).collect();
        let mut sum = 0.0;
        while let Some(([a, b, c], halvings)) = todo.pop() {
            // Turned so that the longest edge runs from a to b.
            let (ab, bc, ca) = ((b - a).length_squared(), (c - b).length_squared(), (a - c).length_squared());
            let [a, b, c] = if ab >= bc.max(ca) {
                [a, b, c]
            } else if bc >= ca {
                [b, c, a]
            } else {
                [c, a, b]
            };
            let centre = self.base + (a + b + c) / 3.0;
            if 25.0 * ab.max(bc).max(ca) <= centre.length_squared() || halvings == MOST_HALVINGS {
                sum += self.gauss(&f, [a, b, c]);
            } else {
                let middle = (a + b) * 0.5;
                todo.push(([a, middle, c], halvings + 1));
                todo.push(([middle, b, c], halvings + 1));
            }
        }
        sum
    }

    /// 8 × 8 Gauss–Legendre on the square, folded onto a triangle: v = a + s (b − a) + s t (c − b), dA = 2 |abc| s ds dt.
    fn gauss(&self, f: &impl Fn(DVec3) -> f64, [a, b, c]: [DVec3; 3]) -> f64 {
        let double_area = (b - a).cross(c - a).length();
        let mut sum = 0.0;
        for (s, weight_s) in gauss_legendre() {
            for (t, weight_t) in gauss_legendre() {
                let offset = a + (b - a) * s + (c - b) * (s * t);
                sum += weight_s * weight_t * s * f(self.base + offset);
            }
        }
        sum * double_area
    }
}

/// The planes of a blocker's shadow seen from a point: hidden is what lies strictly above all of them. None where the
/// point lies in the blocker's plane, or the blocker has no area.
fn shadow_planes(blocker: &[DVec3], point: DVec3) -> Vec<(DVec3, f64)> {
    let across = area_vector(blocker);
    let Some(&first) = blocker.first() else { return Vec::new() };
    let distance = across.dot(first - point);
    if distance == 0.0 {
        return Vec::new();
    }
    let sign = distance.signum();
    let mut planes = Vec::with_capacity(blocker.len() + 1);
    planes.push((across * sign, distance.abs()));
    for (i, &corner) in blocker.iter().enumerate() {
        let next = blocker[(i + 1) % blocker.len()];
        planes.push(((corner - point).cross(next - corner) * sign, 0.0));
    }
    planes
}

/// Nodes and weights of the eight-point Gauss–Legendre rule on [0, 1], of degree 15 (Abramowitz & Stegun, table 25.4).
fn gauss_legendre() -> impl Iterator<Item = (f64, f64)> {
    const NODES: [f64; 4] =
        [0.183_434_642_495_649_8, 0.525_532_409_916_329, 0.796_666_477_413_626_7, 0.960_289_856_497_536_3];
    const WEIGHTS: [f64; 4] =
        [0.362_683_783_378_362, 0.313_706_645_877_887_27, 0.222_381_034_453_374_48, 0.101_228_536_290_376_26];
    NODES
        .into_iter()
        .zip(WEIGHTS)
        .flat_map(|(node, weight)| [(0.5 - 0.5 * node, 0.5 * weight), (0.5 + 0.5 * node, 0.5 * weight)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analytic::quadrature::{Tolerance, integrate_rectangle};

    /// The unit square at height 1 that faces down, as in the reference cases.
    fn square() -> PolygonLight {
        let corners = [(-0.5, -0.5), (-0.5, 0.5), (0.5, 0.5), (0.5, -0.5)];
        PolygonLight { corners: corners.map(|(x, y)| DVec3::new(x, y, 1.0)).to_vec(), emission: 1.0 }
    }

    fn receiver(point: [f64; 3], normal: [f64; 3]) -> Receiver {
        Receiver { point: point.into(), normal: DVec3::from(normal).normalize() }
    }

    fn up(x: f64, y: f64, z: f64) -> Receiver {
        Receiver { point: DVec3::new(x, y, z), normal: DVec3::Z }
    }

    fn assert_relative(found: f64, exact: f64, tolerance: f64) {
        assert!((found - exact).abs() <= tolerance * exact.abs(), "found {found:e}, expected {exact:e}");
    }

    /// Area integral over the square light by adaptive quadrature: knows nothing of contours, clipping or cones.
    fn square_by_area(at: &Receiver, sees: impl Fn(DVec3) -> bool, tolerance: f64) -> f64 {
        let kernel = |x: f64, y: f64| {
            let v = DVec3::new(x, y, 1.0) - at.point;
            let r = v.length();
            if sees(v) { (at.normal.dot(v) / r).max(0.0) * (v.z / r).max(0.0) / (r * r) } else { 0.0 }
        };
        let none = |_: f64, _: &mut Vec<f64>| {};
        let side = [-0.5, 0.5];
        integrate_rectangle(kernel, side, side, &[], none, Tolerance::absolute(tolerance)).unwrap().value
    }

    #[test]
    fn the_gauss_rule_is_exact_to_degree_15() {
        for degree in 0..16 {
            let sum: f64 = gauss_legendre().map(|(x, weight)| weight * x.powi(degree)).sum();
            assert!((sum * f64::from(degree + 1) - 1.0).abs() <= 1e-14, "degree {degree}: {sum}");
        }
    }

    /// Truths: the contour sum in 80 decimal digits, for the f64 coordinates given here.
    #[test]
    fn far_tiny_grazing_and_close_lights_keep_their_digits() {
        let light = square();
        let tiny = PolygonLight {
            corners: light.corners.iter().map(|c| DVec3::new(c.x, c.y, 1048576.0) / 1048576.0).collect(),
            emission: 1.0,
        };
        let wall = PolygonLight {
            corners: [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)]
                .map(|(y, z)| DVec3::new(1.0, y, z / 1048576.0))
                .to_vec(),
            emission: 1.0,
        };
        let ulp = 1.0 / 1048576.0;
        let cases = [
            (&light, up(300.0, 400.0, -1199.0), 5.041_839_718_575_476e-7),
            (&light, up(3e6, -4e6, -1.2e7), 5.041_839_680_003_947_6e-15),
            (&light, receiver([2.0, 0.25, 1.0 - ulp / 1024.0], [-0.6, 0.0, 0.8]), 7.341_076_033_184_88e-11),
            (&wall, up(0.0, 0.0, 0.0), 2.922_657_048_194_327_7e-13),
            (&light, up(0.125, 0.25, 1.0 - ulp), 3.141_592_653_572_773),
            (&tiny, up(0.75, 0.0, 0.0), 3.725_290_298_461_972e-13),
        ];
        for (light, at, exact) in cases {
            assert_relative(light.irradiance(&at), exact, 1e-14);
        }
    }

    #[test]
    fn both_routes_agree_where_the_contour_is_good() {
        for (x, y, z) in [(0.0, 0.0, 0.0), (0.5, 0.5, 0.0), (1.0, -0.5, 0.5), (0.2, 0.3, 0.99), (0.0, 0.7, 0.9)] {
            for normal in [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [-0.3, 0.2, 0.1], [-1.0, -1.0, 0.0]] {
                let at = receiver([x, y, z], normal);
                let Some(part) = Patch::of(&square(), at.point).unwrap().split(at.normal, 0.0).0 else { continue };
                let (sum, terms) = part.contour(at.normal);
                let area = part.integrate(|v| part.kernel(at.normal, v));
                assert!((0.5 * sum.abs() - area).abs() <= 4.0 * f64::EPSILON * terms + 1e-14 * area, "{at:?}");
            }
        }
    }

    #[test]
    fn a_far_light_is_a_point_light() {
        for distance in [1e2, 1e3, 1e5, 1e8, 1e20] {
            let towards = DVec3::new(0.48, 0.64, 0.6);
            let at = Receiver { point: DVec3::new(0.0, 0.0, 1.0) - towards * distance, normal: DVec3::Z };
            let limit = 0.6 * 0.6 / (distance * distance);
            // The next term of the expansion in size/distance: 2nd moments 1/12 times second derivatives below 20.
            assert_relative(square().irradiance(&at), limit, 2.0 / (distance * distance) + 1e-14);
        }
    }

    #[test]
    fn a_near_light_fills_the_hemisphere() {
        for height in [1e-3, 1e-6, 1e-9] {
            let corners = square().corners.iter().map(|c| DVec3::new(c.x, c.y, height)).collect();
            let light = PolygonLight { corners, emission: 2.0 };
            // Outside the square the hemisphere's share is at most ∫ h² / r⁴ dA = π h² / (1/2)² beyond its inscribed disc.
            let found = light.irradiance(&up(0.0, 0.0, 0.0));
            assert_relative(found, 2.0 * std::f64::consts::PI, 4.0 * height * height + 1e-15);
        }
    }

    #[test]
    fn scale_changes_nothing() {
        let reference = |at: &Receiver| square().irradiance(at);
        for at in [up(0.3, 0.1, 0.0), up(40.0, 3.0, -7.0), receiver([0.0, 0.0, 0.5], [0.9, 0.1, 0.2])] {
            let scaled = |scale: f64| {
                let corners = square().corners.iter().map(|&c| c * scale).collect();
                let at = Receiver { point: at.point * scale, ..at };
                PolygonLight { corners, emission: 1.0 }.irradiance(&at)
            };
            for power in [-190, -20, 20, 190] {
                assert_eq!(scaled(2f64.powi(power)), reference(&at), "a power of two must scale without rounding");
            }
            for scale in [1e-6, 1e6] {
                assert_relative(scaled(scale), reference(&at), 1e-14);
            }
        }
    }

    #[test]
    fn moving_far_from_the_origin_costs_only_the_digits_of_the_coordinates() {
        let shift = DVec3::new(1024.0, -2048.0, 4096.0);
        let moved = PolygonLight { corners: square().corners.iter().map(|&c| c + shift).collect(), emission: 1.0 };
        let at = up(0.25, 0.125, 0.0);
        // All coordinates stay exact, so not even these are lost.
        assert_eq!(moved.irradiance(&Receiver { point: at.point + shift, ..at }), square().irradiance(&at));
    }

    #[test]
    fn light_does_not_leak_behind_or_edge_on_or_below_the_horizon() {
        let mut flipped = square();
        flipped.corners.reverse();
        assert_eq!(flipped.irradiance(&up(0.0, 0.0, 0.0)), 0.0);
        assert_eq!(square().irradiance(&up(0.0, 0.0, 1.0)), 0.0);
        assert_eq!(square().irradiance(&receiver([0.0, 0.0, 2.0], [0.0, 0.0, -1.0])), 0.0);
        assert_eq!(square().irradiance(&receiver([2.0, 0.0, 1.0], [-1.0, 0.0, 0.0])), 0.0);
        assert_eq!(square().irradiance(&receiver([0.0, 0.0, 0.0], [0.0, 0.0, -1.0])), 0.0);
        assert_eq!(square().irradiance(&receiver([0.5, 0.0, 0.0], [1.0, 0.0, 0.0])), 0.0);
    }

    #[test]
    fn polygons_without_area_are_dark() {
        let p = DVec3::new(1.0, 0.0, 1.0);
        for corners in [vec![], vec![p], vec![p, -p], vec![p, p, p], vec![p, p * 2.0, p * 3.0]] {
            let light = PolygonLight { corners, emission: 1.0 };
            assert_eq!((light.irradiance(&up(0.0, 0.0, 0.0)), light.area()), (0.0, 0.0));
        }
    }

    #[test]
    fn a_doubled_corner_changes_nothing() {
        let mut doubled = square();
        doubled.corners.insert(2, doubled.corners[2]);
        for at in [up(0.3, 0.1, 0.0), up(100.0, 3.0, -7.0)] {
            assert_relative(doubled.irradiance(&at), square().irradiance(&at), 1e-14);
        }
    }

    /// A rectangle at height 1/2 that hides x < 0 of the square from the origin, and reaches far to the other side.
    fn half_blocker() -> Vec<DVec3> {
        [(0.0, -9.0), (0.0, 9.0), (-9.0, 9.0), (-9.0, -9.0)].map(|(x, y)| DVec3::new(x, y, 0.5)).to_vec()
    }

    #[test]
    fn half_a_light_behind_a_straight_edge_gives_half_the_polygon() {
        let at = up(0.0, 0.0, 0.0);
        let half = PolygonLight {
            corners: [(0.0, -0.5), (0.0, 0.5), (0.5, 0.5), (0.5, -0.5)].map(|(x, y)| DVec3::new(x, y, 1.0)).to_vec(),
            emission: 1.0,
        };
        let found = square().irradiance_behind(&half_blocker(), &at);
        assert_relative(found, half.irradiance(&at), 1e-15);
        assert_relative(found, 0.752_274_688_454_107_5 / 2.0, 1e-15);
        let mut other_way = half_blocker();
        other_way.reverse();
        assert_relative(square().irradiance_behind(&other_way, &at), half.irradiance(&at), 1e-15);
        let edge = half_blocker();
        let seen = PolygonLight { corners: square().visible_past_edge(edge[1], edge[0], at.point), emission: 1.0 };
        assert_eq!(seen.area(), 0.5);
        assert_relative(seen.irradiance(&at), half.irradiance(&at), 1e-15);
    }

    #[test]
    fn the_umbra_is_exactly_dark_and_what_lies_outside_exactly_bright() {
        let light = square();
        for x in [-4.0, -3.0, -1.5, -1.0, -0.75] {
            assert_eq!(light.irradiance_behind(&half_blocker(), &up(x, 0.1, 0.0)), 0.0);
        }
        for at in [up(0.5, 0.1, 0.0), up(3.0, 0.1, 0.0), up(0.0, 20.0, 0.0), up(0.0, 0.0, 0.75), up(0.0, 0.0, 0.5)] {
            assert_eq!(light.irradiance_behind(&half_blocker(), &at), light.irradiance(&at), "{at:?}");
        }
        let far = half_blocker().iter().map(|&c| c + DVec3::new(1e9, 0.0, 0.0)).collect::<Vec<_>>();
        let beyond = half_blocker().iter().map(|&c| c + DVec3::Z).collect::<Vec<_>>();
        let flat = vec![DVec3::new(0.0, 0.0, 0.5); 4];
        for blocker in [&far, &beyond, &flat, &Vec::new()] {
            assert_eq!(light.irradiance_behind(blocker, &up(0.0, 0.0, 0.0)), light.irradiance(&up(0.0, 0.0, 0.0)));
        }
    }

    /// A tilted five-cornered blocker, partly beyond the light's plane.
    fn pentagon() -> Vec<DVec3> {
        let (centre, across, along) =
            (DVec3::new(0.1, 0.05, 0.75), DVec3::new(0.3, 0.0, 0.35), DVec3::new(0.05, 0.4, 0.0));
        (0..5)
            .map(|i| {
                let turn = f64::from(i) * std::f64::consts::TAU / 5.0;
                centre + across * libm::cos(turn) + along * libm::sin(turn)
            })
            .collect()
    }

    /// Does the segment from the origin to v meet the polygon? By the crossing's barycentric signs, not by planes
    /// through the point: another formula than the code's.
    fn segment_meets(polygon: &[DVec3], v: DVec3) -> bool {
        let normal = (polygon[1] - polygon[0]).cross(polygon[2] - polygon[0]);
        let t = normal.dot(polygon[0]) / normal.dot(v);
        let hit = v * t;
        (0.0..1.0).contains(&t)
            && (0..polygon.len()).all(|i| {
                let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
                normal.dot((b - a).cross(hit - a)) >= 0.0
            })
    }

    #[test]
    fn a_tilted_blocker_through_the_lights_plane_hides_what_its_rays_hit() {
        for at in [up(0.0, 0.0, 0.0), up(0.6, -0.3, 0.2), receiver([-0.7, 0.1, 0.1], [0.8, 0.0, 0.1])] {
            let blocker: Vec<DVec3> = pentagon().iter().map(|&c| c - at.point).collect();
            let twin = square_by_area(&at, |v| !segment_meets(&blocker, v), 1e-4);
            let found = square().irradiance_behind(&pentagon(), &at);
            assert!((found - twin).abs() <= 1e-4 && found < square().irradiance(&at), "{found} {twin} {at:?}");
        }
    }

    /// Each of 10 000 points of the light is either in a visible part or behind the blocker, from each of 50 points.
    #[test]
    fn visible_parts_are_where_the_shadow_ray_passes() {
        use rand::{RngExt, SeedableRng};
        let mut random = rand_pcg::Pcg64::seed_from_u64(7);
        let light = square();
        for _ in 0..50 {
            let point = DVec3::new(random.random::<f64>() * 3.0 - 1.5, random.random::<f64>() * 3.0 - 1.5, 0.0);
            let blocker: Vec<DVec3> = pentagon().iter().map(|&c| c - point).collect();
            let parts = light.visible_parts(&pentagon(), point);
            for _ in 0..200 {
                let on_light = DVec3::new(random.random::<f64>() - 0.5, random.random::<f64>() - 0.5, 1.0);
                let inside = |part: &Vec<DVec3>| {
                    // The light faces down, so its winding is clockwise in (x, y).
                    (0..part.len()).all(|i| {
                        let (a, b) = (part[i], part[(i + 1) % part.len()]);
                        (b - a).cross(on_light - a).z <= 0.0
                    })
                };
                let seen = parts.iter().filter(|part| inside(part)).count();
                assert_eq!(seen, usize::from(!segment_meets(&blocker, on_light - point)), "{point} {on_light}");
            }
        }
    }

    #[test]
    fn visible_and_hidden_parts_add_up() {
        for (x, y) in [(0.0, 0.0), (0.4, 0.1), (-0.6, 0.3), (-1.0, -1.0)] {
            let at = up(x, y, 0.0);
            let parts = Patch::of(&square(), at.point).unwrap().divide(&pentagon(), at.point);
            let area: f64 = parts.visible.iter().chain(&parts.hidden).map(Patch::area).sum();
            assert!((area - 1.0).abs() <= 1e-15);
            let form: f64 = parts.visible.into_iter().chain(parts.hidden).map(|p| p.lit_form(at.normal)).sum();
            assert_relative(form, square().irradiance(&at), 1e-14);
        }
    }
}

//! Area lights: parallelograms and meshes, and the choice among them.

use glam::{Vec2, Vec3};

use crate::mutants::{Mutant, planted};
use crate::sampling::{Decision, Dim1, Dim2, SampleLayout, warp};

use super::geometry::{area, face_normal, offset_length};
use super::mesh::Mesh;

/// Relative luminance of linear Rec. 709 RGB.
pub fn luma(c: Vec3) -> f32 {
    0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z
}

/// A point of a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightPoint {
    /// Position, a hair's breadth in front of the surface so that a ray to it does not meet the light itself.
    pub position: Vec3,
    /// Unit normal; light leaves on this side.
    pub normal: Vec3,
}

/// One light: all emissive triangles of one material in one file.
#[derive(Debug, Clone)]
pub struct Light {
    /// The material's name.
    pub name: String,
    /// Emitted radiance.
    pub emission: Vec3,
    /// Surface area; points are uniform on it: `pdf_area` = 1/area.
    pub area: f32,
    /// area × luma(emission): what lights are chosen by.
    pub power: f64,
    shape: Shape,
}

#[derive(Debug, Clone)]
enum Shape {
    Parallelogram(Parallelogram),
    /// Triangles with the cumulative share of the area up to and including each.
    Mesh {
        triangles: Vec<MeshTriangle>,
    },
}

/// A parallelogram that emits on one side.
#[derive(Debug, Clone, Copy)]
pub struct Parallelogram {
    corner: Vec3,
    e1: Vec3,
    e2: Vec3,
    normal: Vec3,
}

impl Parallelogram {
    /// The point that `u` in [0, 1)² names; uniform by area.
    #[inline(always)]
    pub fn point(&self, u: Vec2) -> LightPoint {
        LightPoint { position: warp::square_to_parallelogram(u, self.corner, self.e1, self.e2), normal: self.normal }
    }
}

#[derive(Debug, Clone)]
struct MeshTriangle {
    corners: [Vec3; 3],
    normal: Vec3,
    offset: f32,
    share_before: f32,
    share_after: f32,
}

impl Light {
    /// A light of these triangles; two that make a parallelogram are sampled as one. `None` where they have no area.
    pub fn new(name: String, emission: Vec3, triangles: &[[Vec3; 3]]) -> Option<Self> {
        let triangles: Vec<_> =
            triangles.iter().copied().filter(|t| area(t) > 0.0 && face_normal(t) != Vec3::ZERO).collect();
        let total: f64 = triangles.iter().map(area).sum();
        if total <= 0.0 {
            return None;
        }
        let shape = parallelogram(&triangles).unwrap_or_else(|| {
            let mut before = 0.0;
            let parts = triangles.iter().map(|corners| {
                let share_before = (before / total) as f32;
                before += area(corners);
                MeshTriangle {
                    corners: *corners,
                    normal: face_normal(corners),
                    offset: offset_length(corners),
                    share_before,
                    share_after: (before / total) as f32,
                }
            });
            Shape::Mesh { triangles: parts.collect() }
        });
        let power = total * f64::from(luma(emission));
        let counted = if planted(Mutant::LightAreaHalved) { 0.5 * total } else { total };
        Some(Self { name, emission, area: counted as f32, power, shape })
    }

    /// The parallelogram that this light is, if it was recognised as one.
    pub fn parallelogram(&self) -> Option<&Parallelogram> {
        match &self.shape {
            Shape::Parallelogram(parallelogram) => Some(parallelogram),
            Shape::Mesh { .. } => None,
        }
    }

    /// Whether two triangles were recognised as one parallelogram.
    pub fn is_parallelogram(&self) -> bool {
        self.parallelogram().is_some()
    }

    /// The point that `u` in [0, 1)² names; uniform by area.
    ///
    /// A mesh takes its triangle from `u.x` and stretches what is left of it over that triangle, so one 2-D decision serves.
    #[inline(always)]
    pub fn point(&self, u: Vec2) -> LightPoint {
        match &self.shape {
            Shape::Parallelogram(parallelogram) => parallelogram.point(u),
            Shape::Mesh { triangles } => {
                let index = triangles.partition_point(|t| t.share_after <= u.x).min(triangles.len() - 1);
                let t = &triangles[index];
                let x = ((u.x - t.share_before) / (t.share_after - t.share_before)).clamp(0.0, 1.0);
                let b = warp::square_to_triangle(Vec2::new(x, u.y));
                let position = t.corners[0] * b.x + t.corners[1] * b.y + t.corners[2] * b.z;
                LightPoint { position: position + t.normal * t.offset, normal: t.normal }
            }
        }
    }
}

/// Two triangles that share a diagonal, wind alike and are congruent: p, s₁, q, s₂ with p + q = s₁ + s₂.
fn parallelogram(triangles: &[[Vec3; 3]]) -> Option<Shape> {
    let [first, second] = triangles else { return None };
    let own = (0..3).find(|&i| !second.contains(&first[i]))?;
    let (p, s1, s2) = (first[own], first[(own + 1) % 3], first[(own + 2) % 3]);
    let q = *second.iter().find(|v| !first.contains(v))?;
    let size = (s1 - p).abs().max((s2 - p).abs()).max_element();
    let closes = (p + q - s1 - s2).abs().max_element() <= 1e-5 * size;
    let shares = second.contains(&s1) && second.contains(&s2);
    let normal = face_normal(first);
    if !closes || !shares || normal.dot(face_normal(second)) <= 0.0 {
        return None;
    }
    let offset = offset_length(first).max(offset_length(second));
    Some(Shape::Parallelogram(Parallelogram { corner: p + normal * offset, e1: s1 - p, e2: s2 - p, normal }))
}

/// The lights of a scene, and what choosing among them takes.
#[derive(Debug)]
pub enum LightSet {
    /// No light: nothing to decide.
    Dark,
    /// One light: nothing to choose.
    One {
        /// The light.
        light: Light,
        /// Where on it.
        point: Dim2,
    },
    /// Several lights, chosen by power.
    Many {
        /// Lights of positive power.
        lights: Vec<Light>,
        /// Probability of each: power over all power, to a whole multiple of 2⁻²⁴ that is never 0.
        pmf: Vec<f32>,
        /// Cumulative probability up to and including each; ends in 1.
        cumulative: Vec<f64>,
        /// Which light.
        pick: Dim1,
        /// Where on it.
        point: Dim2,
    },
}

impl LightSet {
    /// Collects the emitters of a mesh, in the order of their materials, and claims what they need.
    ///
    /// A light of power zero is never chosen, so it is left out.
    pub fn new(mesh: &Mesh, layout: &mut SampleLayout) -> Self {
        let mut triangles: Vec<Vec<[Vec3; 3]>> = vec![Vec::new(); mesh.materials.len()];
        for (corners, &material) in mesh.positions.iter().zip(&mesh.material_of) {
            if mesh.materials[material as usize].is_emitter {
                triangles[material as usize].push(*corners);
            }
        }
        let mut lights: Vec<Light> = mesh
            .materials
            .iter()
            .zip(&triangles)
            .filter_map(|(m, t)| Light::new(m.name.clone(), m.emission, t))
            .filter(|light| light.power > 0.0)
            .collect();
        match lights.len() {
            0 => Self::Dark,
            1 => Self::One { light: lights.remove(0), point: layout.claim_2d(Decision::LightPoint) },
            _ => {
                let steps = pick_steps(&lights.iter().map(|l| l.power).collect::<Vec<_>>());
                let mut sum = 0;
                let cumulative = steps
                    .iter()
                    .map(|&s| {
                        sum += s;
                        f64::from(sum) / f64::from(PICK_STEPS)
                    })
                    .collect();
                let pmf = steps.iter().map(|&s| s as f32 / PICK_STEPS as f32).collect();
                let pick = layout.claim_1d(Decision::LightPick);
                Self::Many { lights, pmf, cumulative, pick, point: layout.claim_2d(Decision::LightPoint) }
            }
        }
    }

    /// All lights, in order.
    pub fn lights(&self) -> &[Light] {
        match self {
            Self::Dark => &[],
            Self::One { light, .. } => std::slice::from_ref(light),
            Self::Many { lights, .. } => lights,
        }
    }
}

/// The numbers that pick a light are multiples of 2⁻²⁴.
const PICK_STEPS: u32 = 1 << 24;

/// How many of the 2²⁴ numbers pick each of up to 2²⁴ lights of these powers, all above 0: the sum is 2²⁴.
///
/// A probability that is no multiple of 2⁻²⁴ is not the one a light is picked with: of 10⁻³⁰ beside 10³⁰, u = 0 would still
/// pick the former, 2⁻²⁴ of the time and not 10⁻⁶⁰, and divide by that. So probabilities are counted in steps, every light
/// has one at least, and the estimator divides by exactly what it was picked with; the strongest takes what rounding leaves.
fn pick_steps(powers: &[f64]) -> Vec<u32> {
    // Scaled by the largest first: the sum of finite powers may overflow otherwise.
    let largest = powers.iter().copied().fold(0.0, f64::max);
    let total: f64 = powers.iter().map(|p| p / largest).sum();
    let to_share = PICK_STEPS.saturating_sub(powers.len() as u32);
    let mut steps: Vec<u32> = powers.iter().map(|p| 1 + (p / largest / total * f64::from(to_share)) as u32).collect();
    let left = PICK_STEPS.saturating_sub(steps.iter().sum());
    if let Some(strongest) = (0..powers.len()).max_by(|&a, &b| powers[a].total_cmp(&powers[b])) {
        steps[strongest] += left;
    }
    steps
}

/// Index of the light that `u` in [0, 1) picks from cumulative probabilities that end in 1.
#[inline]
pub fn pick_light(cumulative: &[f64], u: f32) -> usize {
    if planted(Mutant::LightsPickedEvenly) {
        return (u * cumulative.len() as f32) as usize;
    }
    cumulative.partition_point(|&c| c <= f64::from(u))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quad() -> [[Vec3; 3]; 2] {
        let at = |x: f32, y: f32| Vec3::new(x, y, 1.0);
        [[at(0.0, 0.0), at(2.0, 0.0), at(3.0, 1.0)], [at(0.0, 0.0), at(3.0, 1.0), at(1.0, 1.0)]]
    }

    #[test]
    fn two_triangles_that_make_a_parallelogram_are_one() {
        for turn in 0..3 {
            let mut t = quad();
            t[0].rotate_left(turn);
            t[1].rotate_right(turn);
            let light = Light::new("l".into(), Vec3::ONE, &t).unwrap();
            assert!(light.is_parallelogram());
            assert_eq!(light.area, 2.0);
            let middle = light.point(Vec2::splat(0.5));
            assert!((middle.position - Vec3::new(1.5, 0.5, 1.0)).length() < 1e-4);
            assert!((middle.normal - Vec3::Z).length() < 1e-6);
        }
        let mut bent = quad();
        bent[1][2].z = 1.2;
        assert!(!Light::new("l".into(), Vec3::ONE, &bent).unwrap().is_parallelogram());
        let mut flipped = quad();
        flipped[1].swap(0, 1);
        assert!(!Light::new("l".into(), Vec3::ONE, &flipped).unwrap().is_parallelogram());
        assert!(Light::new("l".into(), Vec3::ONE, &[[Vec3::X; 3]]).is_none());
    }

    /// Midpoint rule over the unit square: the mean point of a mesh light is its centroid.
    #[test]
    fn a_mesh_light_is_sampled_by_area() {
        let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let triangles = [[at(0.0, 0.0), at(4.0, 0.0), at(0.0, 3.0)], [at(10.0, 0.0), at(11.0, 0.0), at(10.0, 1.0)]];
        let light = Light::new("l".into(), Vec3::ONE, &triangles).unwrap();
        assert_eq!(light.area, 6.5);
        let k = 256;
        let mut mean = glam::DVec3::ZERO;
        for i in 0..k * k {
            let u = Vec2::new(((i % k) as f32 + 0.5) / k as f32, ((i / k) as f32 + 0.5) / k as f32);
            mean += light.point(u).position.as_dvec3() / f64::from(k * k);
        }
        let exact = (glam::DVec3::new(4.0, 3.0, 0.0) / 3.0 * 6.0 + glam::DVec3::new(31.0, 1.0, 0.0) / 3.0 * 0.5) / 6.5;
        // The column of cells in which one triangle gives way to the other errs by up to 1/k of the distance between them.
        assert!((mean - exact).length() < 10.0 / f64::from(k), "{mean} {exact}");
    }

    #[test]
    fn the_largest_number_below_one_picks_the_last_light_and_zero_the_first() {
        let cumulative = [0.25, 0.5, 1.0];
        assert_eq!(pick_light(&cumulative, 0.0), 0);
        assert_eq!(pick_light(&cumulative, 0.25), 1);
        assert_eq!(pick_light(&cumulative, 1.0 - f32::EPSILON / 2.0), 2);
    }

    #[test]
    fn every_light_is_picked_by_as_many_numbers_as_its_probability_says() {
        for powers in [vec![1.0, 3.0], vec![1e-30, 1e30], vec![1e300, 1e300, 1e-300], vec![0.1; 7], vec![5.0; 1000]] {
            let steps = pick_steps(&powers);
            assert_eq!(steps.iter().sum::<u32>(), PICK_STEPS);
            let total: f64 = powers.iter().map(|p| p / powers[0]).sum();
            for (power, &count) in powers.iter().zip(&steps) {
                let share = power / powers[0] / total * f64::from(PICK_STEPS);
                // One step at least, rounding down, and what that leaves.
                let rounding = 2.0 * powers.len() as f64;
                assert!(count > 0 && (f64::from(count) - share).abs() <= rounding, "{powers:?}: {count}");
            }
        }
        assert_eq!(pick_steps(&[1.0, 3.0]), [PICK_STEPS / 4, PICK_STEPS / 4 * 3]);
    }
}

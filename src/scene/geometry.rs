//! Surfaces as the light transport loop reads them: points, normals, texture coordinates, robust offsets.

use glam::{Vec2, Vec3};

use crate::accel::{Ray, Triangle};
use crate::mutants::{Mutant, planted};

use super::mesh::Mesh;

/// A point of a surface that a ray met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Position, interpolated from the corners (so it lies in the triangle's plane but for rounding).
    pub position: Vec3,
    /// Unit shading normal: the vertex normals' interpolation, renormalised; else the face's.
    pub normal: Vec3,
    /// Unit normal of the face, by winding.
    pub face_normal: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Index into the mesh's materials.
    pub material: u32,
    /// How far a ray that leaves this point starts from it, see [`offset_length`].
    pub offset: f32,
}

/// Unit normal of a triangle by winding; zero for a triangle without area.
///
/// The edges are first scaled to length about 1, so that their product neither overflows nor vanishes at any scene scale.
pub fn face_normal(corners: &[Vec3; 3]) -> Vec3 {
    let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
    (e1.normalize_or_zero()).cross(e2.normalize_or_zero()).normalize_or_zero()
}

/// Area of a triangle, in f64.
pub fn area(corners: &[Vec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    0.5 * (b - a).cross(c - a).length()
}

/// How far a ray starts from the surface it leaves (or stops short of the light it aims at): 2⁻¹⁸ of the largest
/// coordinate in play.
///
/// A hit's position errs by some 4 roundings of the corners' coordinates, the distance to the own plane that the next query
/// computes by some 8 roundings of the distance to the corners: 2⁻²⁰ of the largest coordinate together. Relative, so the
/// same picture comes out at any scale.
#[inline]
pub fn offset_length(corners: &[Vec3; 3]) -> f32 {
    if planted(Mutant::EpsilonAbsolute) {
        return 1e-3;
    }
    let largest = corners[0].abs().max(corners[1].abs()).max(corners[2].abs()).max_element();
    largest * (1.0 / 262_144.0)
}

/// The triangle's corners as the tree takes them.
pub fn triangles(mesh: &Mesh) -> Vec<Triangle> {
    mesh.positions.iter().map(|&corners| Triangle { corners }).collect()
}

/// All that shading reads of one triangle, in one place: two cache lines.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct Face {
    corners: [Vec3; 3],
    normals: [Vec3; 3],
    uvs: [Vec2; 3],
    /// See [`face_normal`].
    face_normal: Vec3,
    /// See [`offset_length`].
    offset: f32,
    material: u32,
}

/// The mesh's triangles as shading reads them, with what depends on the triangle alone worked out.
pub fn faces(mesh: &Mesh) -> Vec<Face> {
    (0..mesh.len())
        .map(|index| {
            let corners = mesh.positions[index];
            Face {
                corners,
                normals: mesh.normals[index],
                uvs: mesh.uvs[index],
                face_normal: face_normal(&corners),
                offset: offset_length(&corners),
                material: mesh.material_of[index],
            }
        })
        .collect()
}

/// The surface where `ray` met this face.
#[inline]
pub fn surface_point(face: &Face, ray: &Ray) -> SurfacePoint {
    let b = barycentric(&face.corners, ray);
    let blend = |v: &[Vec3; 3]| v[0] * b.x + v[1] * b.y + v[2] * b.z;
    SurfacePoint {
        position: blend(&face.corners),
        normal: blend(&face.normals).try_normalize().unwrap_or(face.face_normal),
        face_normal: face.face_normal,
        uv: face.uvs[0] * b.x + face.uvs[1] * b.y + face.uvs[2] * b.z,
        material: face.material,
        offset: face.offset,
    }
}

/// Barycentric weights of the point where `ray` crosses the triangle's plane, from the same edge functions that decide hits.
#[inline]
fn barycentric(corners: &[Vec3; 3], ray: &Ray) -> Vec3 {
    let d = ray.direction;
    let [a, b, c] = corners.map(|p| p - ray.origin);
    let w1 = (c - a).cross(c + a).dot(d);
    let w2 = (a - b).cross(a + b).dot(d);
    let w0 = (b - c).cross(b + c).dot(d);
    let sum = w0 + w1 + w2;
    // A hit has a sum away from 0; where rounding makes it 0, the centroid is as good a point of this sliver as any.
    if sum == 0.0 { Vec3::splat(1.0 / 3.0) } else { Vec3::new(w0, w1, w2) / sum }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn barycentric_weights_are_those_of_the_point_aimed_at() {
        let corners = [Vec3::new(1.0, 0.0, 3.0), Vec3::new(0.0, 2.0, 4.0), Vec3::new(-1.0, -1.0, 5.0)];
        let weights = Vec3::new(0.2, 0.3, 0.5);
        let target = corners[0] * weights.x + corners[1] * weights.y + corners[2] * weights.z;
        let origin = Vec3::new(0.3, -0.2, -2.0);
        let found = barycentric(&corners, &Ray { origin, direction: target - origin });
        assert!((found - weights).abs().max_element() < 1e-5, "{found}");
    }

    #[test]
    fn normals_and_areas_hold_at_any_scale() {
        for scale in [1e-12, 1e-6, 1.0, 1e6, 1e12] {
            let corners = [Vec3::ZERO, Vec3::X * scale, Vec3::Y * scale];
            assert!((face_normal(&corners) - Vec3::Z).length() < 1e-6);
            assert!((area(&corners) / (0.5 * f64::from(scale).powi(2)) - 1.0).abs() < 1e-6);
        }
        assert_eq!(face_normal(&[Vec3::ONE; 3]), Vec3::ZERO);
    }
}

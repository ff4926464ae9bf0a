//! Surfaces as the light transport loop reads them: points, normals, texture coordinates, robust offsets.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::accel::{LANES, NOTHING, Ray, Row, Triangle, column, set_column};
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
        .into_par_iter()
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
#[inline(always)]
pub fn surface_point(face: &Face, ray: &Ray) -> SurfacePoint {
    let (b, position, normal) = interpolate(&face.corners, &face.normals, face.face_normal, ray);
    SurfacePoint {
        position,
        normal,
        face_normal: face.face_normal,
        uv: face.uvs[0] * b.x + face.uvs[1] * b.y + face.uvs[2] * b.z,
        material: face.material,
        offset: face.offset,
    }
}

/// Barycentric weights, position and unit shading normal where `ray` crosses a triangle. Branch-free.
#[inline(always)]
fn interpolate(corners: &[Vec3; 3], normals: &[Vec3; 3], face_normal: Vec3, ray: &Ray) -> (Vec3, Vec3, Vec3) {
    let b = barycentric(corners, ray);
    let blend = |v: &[Vec3; 3]| v[0] * b.x + v[1] * b.y + v[2] * b.z;
    let blended = blend(normals);
    // glam's `try_normalize` without its branch.
    let reciprocal = 1.0 / blended.length();
    let unit = blended * reciprocal;
    let usable = (reciprocal < f32::INFINITY) & (reciprocal > 0.0);
    let normal = Vec3::new(
        if usable { unit.x } else { face_normal.x },
        if usable { unit.y } else { face_normal.y },
        if usable { unit.z } else { face_normal.z },
    );
    (b, blend(corners), normal)
}

/// What is known of the surfaces that a packet's rays met, a row for each number and a column for each lane.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub struct SurfaceRows {
    position: [Row; 3],
    normal: [Row; 3],
    face_normal: [Row; 3],
    weights: [Row; 3],
    offset: Row,
    /// Index into the mesh's materials.
    pub material: [u32; LANES],
}

impl Default for SurfaceRows {
    fn default() -> Self {
        let rows = [[0.0; LANES]; 3];
        let (position, normal, face_normal, weights) = (rows, rows, rows, rows);
        Self { position, normal, face_normal, weights, offset: [0.0; LANES], material: [0; LANES] }
    }
}

/// The triangles under a packet, transposed.
#[repr(align(64))]
struct FaceRows {
    corners: [[Row; 3]; 3],
    normals: [[Row; 3]; 3],
}

/// One vector in every lane.
#[inline(always)]
fn splat(v: Vec3) -> [Row; 3] {
    [[v.x; LANES], [v.y; LANES], [v.z; LANES]]
}

/// Puts a vector into the lanes that have this number.
#[inline(always)]
pub(crate) fn put_where(rows: &mut [Row; 3], numbers: &[u32; LANES], number: u32, v: Vec3) {
    for (row, c) in rows.iter_mut().zip(v.to_array()) {
        put_one_where(row, numbers, number, c);
    }
}

/// Puts a number into the lanes that have this number.
#[inline(always)]
pub(crate) fn put_one_where<T: Copy>(row: &mut [T; LANES], numbers: &[u32; LANES], number: u32, value: T) {
    for lane in 0..LANES {
        // Read in any case: what is read in one branch alone keeps the loop from becoming vector instructions.
        let old = row[lane];
        row[lane] = if numbers[lane] == number { value } else { old };
    }
}

/// Takes a number out of the lanes that have it: [`NOTHING`] is left there.
#[inline(always)]
pub(crate) fn take(numbers: &mut [u32; LANES], number: u32) {
    for n in numbers {
        *n = if *n == number { NOTHING } else { *n };
    }
}

impl SurfaceRows {
    /// The surfaces where the rays met these faces, as [`surface_point`] has them; every index must be a face's.
    #[inline(always)]
    pub fn fill(&mut self, faces: &[Face], triangles: &[u32; LANES], origin: &[Row; 3], direction: &[Row; 3]) {
        let first = &faces[triangles[0] as usize];
        self.material = [first.material; LANES];
        self.offset = [first.offset; LANES];
        if triangles.iter().fold(true, |same, &t| same & (t == triangles[0])) {
            // The rays of one pixel often meet one triangle, which then is a constant.
            for lane in 0..LANES {
                let ray = Ray { origin: column(origin, lane), direction: column(direction, lane) };
                self.put(lane, &first.corners, &first.normals, first.face_normal, &ray);
            }
            return;
        }
        let rows = self.transpose(faces, triangles);
        for lane in 0..LANES {
            let ray = Ray { origin: column(origin, lane), direction: column(direction, lane) };
            let ([c0, c1, c2], [n0, n1, n2]) = (&rows.corners, &rows.normals);
            let corners = [column(c0, lane), column(c1, lane), column(c2, lane)];
            let normals = [column(n0, lane), column(n1, lane), column(n2, lane)];
            self.put(lane, &corners, &normals, column(&self.face_normal, lane), &ray);
        }
    }

    /// Takes one triangle after the other and puts it into its lanes of every row: a packet rarely meets more than a few.
    #[inline(always)]
    fn transpose(&mut self, faces: &[Face], triangles: &[u32; LANES]) -> FaceRows {
        let first = &faces[triangles[0] as usize];
        let ([c0, c1, c2], [n0, n1, n2]) = (first.corners, first.normals);
        let mut rows =
            FaceRows { corners: [splat(c0), splat(c1), splat(c2)], normals: [splat(n0), splat(n1), splat(n2)] };
        self.face_normal = splat(first.face_normal);
        let mut left = *triangles;
        take(&mut left, triangles[0]);
        loop {
            let next = left.iter().fold(NOTHING, |least, &t| least.min(t));
            if next == NOTHING {
                return rows;
            }
            let face = &faces[next as usize];
            for corner in 0..3 {
                put_where(&mut rows.corners[corner], &left, next, face.corners[corner]);
                put_where(&mut rows.normals[corner], &left, next, face.normals[corner]);
            }
            put_where(&mut self.face_normal, &left, next, face.face_normal);
            put_one_where(&mut self.offset, &left, next, face.offset);
            put_one_where(&mut self.material, &left, next, face.material);
            take(&mut left, next);
        }
    }

    #[inline(always)]
    fn put(&mut self, lane: usize, corners: &[Vec3; 3], normals: &[Vec3; 3], face_normal: Vec3, ray: &Ray) {
        let (weights, position, normal) = interpolate(corners, normals, face_normal, ray);
        set_column(&mut self.weights, lane, weights);
        set_column(&mut self.position, lane, position);
        set_column(&mut self.normal, lane, normal);
        set_column(&mut self.face_normal, lane, face_normal);
    }

    /// One lane's surface; its texture coordinates are [`Self::uv`]'s.
    #[inline(always)]
    pub fn at(&self, lane: usize) -> SurfacePoint {
        SurfacePoint {
            position: column(&self.position, lane),
            normal: column(&self.normal, lane),
            face_normal: column(&self.face_normal, lane),
            uv: Vec2::ZERO,
            material: self.material[lane],
            offset: self.offset[lane],
        }
    }

    /// One lane's texture coordinates; `face` is the one that its ray met.
    #[inline(always)]
    pub fn uv(&self, face: &Face, lane: usize) -> Vec2 {
        let b = column(&self.weights, lane);
        face.uvs[0] * b.x + face.uvs[1] * b.y + face.uvs[2] * b.z
    }
}

/// Barycentric weights of the point where `ray` crosses the triangle's plane, from the same edge functions that decide hits.
#[inline(always)]
fn barycentric(corners: &[Vec3; 3], ray: &Ray) -> Vec3 {
    let d = ray.direction;
    let (a, b, c) = (corners[0] - ray.origin, corners[1] - ray.origin, corners[2] - ray.origin);
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

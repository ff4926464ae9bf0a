//! Polygons of an OBJ file → triangles with what shading needs.

use glam::{DVec3, Vec2, Vec3};

use super::obj::{Corner, Faces, Obj};

/// Triangles of some consecutive faces.
#[derive(Debug, Default)]
pub struct Triangles {
    /// Corners.
    pub positions: Vec<[Vec3; 3]>,
    /// Unit normals at the corners.
    pub normals: Vec<[Vec3; 3]>,
    /// Texture coordinates at the corners.
    pub uvs: Vec<[Vec2; 3]>,
    /// Index into [`Obj::materials`], and how many triangles in a row have it.
    pub runs: Vec<(Option<usize>, usize)>,
    /// What a person should hear of.
    pub told: Told,
}

/// Things that are counted and told once a file.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub struct Told {
    degenerate: usize,
    zero_normals: usize,
    concave: usize,
}

impl Told {
    /// Adds another part's counts.
    pub fn add(&mut self, other: Self) {
        self.degenerate += other.degenerate;
        self.zero_normals += other.zero_normals;
        self.concave += other.concave;
    }

    /// A line for each thing that occurred in file `name`.
    pub fn warnings(&self, name: &str) -> impl Iterator<Item = String> + use<> {
        let lines = [
            (self.degenerate, "triangles without area left out"),
            (self.zero_normals, "normals of length 0 replaced by the face's own"),
            (self.concave, "polygons that are not convex: cut into a fan, which may overlap itself"),
        ];
        let name = name.to_owned();
        lines.into_iter().filter(|(n, _)| *n > 0).map(move |(n, what)| format!("{name}: {n} {what}"))
    }
}

/// Cuts the polygons of `faces`, a part of `obj`, into triangles. `normals` are the file's, brought to unit length by [`unit()`].
pub fn triangles(obj: &Obj, faces: &Faces, normals: &[Option<Vec3>]) -> Triangles {
    let mut made = Triangles::default();
    let count = faces.most_triangles();
    made.positions.reserve_exact(count);
    made.normals.reserve_exact(count);
    made.uvs.reserve_exact(count);
    let mut left = faces.corners.as_slice();
    let mut arities = faces.arities.iter();
    for &(material, count) in &faces.runs {
        let before = made.positions.len();
        for _ in 0..count {
            let (face, rest) = left.split_at(arities.next().map_or(3, |&n| n as usize));
            left = rest;
            made.add(obj, face, normals);
        }
        made.runs.push((material, made.positions.len() - before));
    }
    made
}

impl Triangles {
    fn add(&mut self, obj: &Obj, face: &[Corner], normals: &[Option<Vec3>]) {
        let start = if face.len() == 3 { 0 } else { fan_start(face, obj, &mut self.told) };
        let at = |k: usize| face[(start + k) % face.len()];
        for k in 1..face.len() - 1 {
            let triangle = if face.len() == 3 { [face[0], face[1], face[2]] } else { [at(0), at(k), at(k + 1)] };
            let positions = triangle.map(|corner| obj.positions[corner.position()]);
            let Some(winding) = winding_normal(positions) else {
                self.told.degenerate += 1;
                continue;
            };
            self.positions.push(positions);
            self.uvs.push(triangle.map(|corner| corner.uv().map_or(Vec2::ZERO, |i| obj.uvs[i])));
            self.normals.push(triangle.map(|corner| match corner.normal() {
                None => winding,
                Some(i) => normals[i].unwrap_or_else(|| {
                    self.told.zero_normals += 1;
                    winding
                }),
            }));
        }
    }
}

/// The corner whose fan covers the polygon without overlap: the first, unless the polygon is concave and another one does.
fn fan_start(face: &[Corner], obj: &Obj, told: &mut Told) -> usize {
    let points: Vec<DVec3> = face.iter().map(|corner| obj.positions[corner.position()].as_dvec3()).collect();
    let n = points.len();
    let cross = |a: usize, b: usize, c: usize| (points[b % n] - points[a % n]).cross(points[c % n] - points[a % n]);
    // Newell's normal: twice the polygon's area, whatever its shape.
    let area: DVec3 = (1..n - 1).map(|k| cross(0, k, k + 1)).sum();
    // The fan of a star-shaped corner has no triangle that turns the other way.
    let rounding = -1e-9 * area.length_squared();
    let covers = |s: usize| (1..n - 1).all(|k| cross(s, s + k, s + k + 1).dot(area) >= rounding);
    // Looking at every corner of a huge polygon would take the square of its size.
    let tried = if n <= 64 { n } else { 1 };
    (0..tried).find(|&s| covers(s)).unwrap_or_else(|| {
        told.concave += 1;
        0
    })
}

/// The unit vector along `v`; `None` where it is too short to have a direction in `f32`.
pub fn unit(v: DVec3) -> Option<Vec3> {
    let length = v.length();
    (length as f32 > 0.0).then(|| (v / length).as_vec3())
}

/// Unit normal by the right-hand rule; `None` where the area is 0.
fn winding_normal([a, b, c]: [Vec3; 3]) -> Option<Vec3> {
    let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
    unit((b - a).cross(c - a))
}

//! Compact OBJ and MTL text: shared vertices, short decimals, quads where there are quads.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::Path;

use glam::DVec3;
use sampler_lab::error::Result;
use sampler_lab::film::write_whole;

/// One corner of a face: where it is, and on a smooth surface its normal, on a textured one its place in the texture.
#[derive(Debug, Clone, Copy)]
pub struct Corner {
    /// Position, scene units.
    pub position: DVec3,
    /// Unit normal of a smooth surface; a flat face leaves it to its winding.
    pub normal: Option<DVec3>,
    /// Texture coordinates, v up.
    pub uv: Option<[f64; 2]>,
}

/// A diffuse material as an MTL file says it.
#[derive(Debug, Clone, Copy)]
pub struct Material<'a> {
    /// Name after `newmtl`.
    pub name: &'a str,
    /// Lines after it.
    pub lines: &'a str,
}

/// An OBJ file under construction.
///
/// Corners weld where they *print* alike: a shared edge of two patches is one edge in the file, and whatever closes up
/// to a point (a pole, a lid's knob) becomes triangles.
#[derive(Debug)]
pub struct Obj {
    decimals: usize,
    vertices: Pool,
    uvs: Pool,
    normals: Pool,
    faces: String,
}

/// Lines of one kind, each once, in order of first use.
#[derive(Debug, Default)]
struct Pool {
    text: String,
    index_of: HashMap<String, usize>,
}

impl Pool {
    /// The 1-based index of `line`, which is appended where it is new.
    fn index(&mut self, keyword: &str, line: String) -> usize {
        let next = self.index_of.len() + 1;
        let Self { text, index_of } = self;
        *index_of.entry(line).or_insert_with_key(|line| {
            text.push_str(keyword);
            text.push_str(line);
            text.push('\n');
            next
        })
    }
}

/// A number with at most `decimals` decimals, without trailing zeros: `0.5`, `-3`, `12.0625`.
///
/// Ties are moved off by a thousandth of the last place, so two patches that reach one point by different roundings
/// print the same point.
fn short(x: f64, decimals: usize) -> String {
    let places = libm::pow(10.0, decimals as f64);
    let scaled = (x * places + 0.501).floor();
    let text = format!("{:.decimals$}", scaled / places);
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Numbers as they follow a keyword, each after a space.
fn spaced(numbers: impl IntoIterator<Item = f64>, decimals: usize) -> String {
    numbers.into_iter().fold(String::new(), |line, x| line + " " + &short(x, decimals))
}

impl Obj {
    /// An empty file whose numbers carry at most `decimals` decimals.
    pub fn new(decimals: usize) -> Self {
        let [vertices, uvs, normals] = std::array::from_fn(|_| Pool::default());
        Self { decimals, vertices, uvs, normals, faces: String::new() }
    }

    /// Starts an object of one material.
    pub fn object(&mut self, name: &str, material: &str) {
        self.faces += &format!("o {name}\nusemtl {material}\n");
    }

    /// Adds a quad or triangle; where it has normals, wound so that its winding normal is on their side.
    ///
    /// Corners that weld with their neighbour are dropped; what keeps fewer than three is no face and adds nothing.
    pub fn face(&mut self, corners: &[Corner]) {
        let centre = corners.iter().map(|c| c.position).sum::<DVec3>() / corners.len() as f64;
        let winding: DVec3 = (0..corners.len())
            .map(|i| {
                let next = corners[(i + 1) % corners.len()].position;
                (corners[i].position - centre).cross(next - centre)
            })
            .sum();
        let outward: DVec3 = corners.iter().filter_map(|c| c.normal).sum();
        let mut welded: Vec<(usize, String)> = corners.iter().map(|c| self.corner(c)).collect();
        if winding.dot(outward) < 0.0 {
            welded.reverse();
        }
        welded.dedup_by_key(|(vertex, _)| *vertex);
        if welded.len() > 1 && welded.first().map(|c| c.0) == welded.last().map(|c| c.0) {
            welded.pop();
        }
        if welded.len() >= 3 {
            let text: String = welded.iter().map(|(_, reference)| format!(" {reference}")).collect();
            self.faces += &format!("f{text}\n");
        }
    }

    /// The vertex index of a corner, and the corner as a face line refers to it.
    fn corner(&mut self, corner: &Corner) -> (usize, String) {
        let vertex = self.vertices.index("v", spaced(corner.position.to_array(), self.decimals));
        let uv = corner.uv.map(|uv| self.uvs.index("vt", spaced(uv, self.decimals)));
        let normal = corner.normal.map(|n| self.normals.index("vn", spaced(n.to_array(), self.decimals)));
        let reference = match (uv, normal) {
            (None, None) => format!("{vertex}"),
            (Some(uv), None) => format!("{vertex}/{uv}"),
            (None, Some(normal)) => format!("{vertex}//{normal}"),
            (Some(uv), Some(normal)) => format!("{vertex}/{uv}/{normal}"),
        };
        (vertex, reference)
    }

    /// Adds a flat quad that looks to where its vertices run counter-clockwise.
    pub fn flat_quad(&mut self, vertices: [DVec3; 4]) {
        self.face(&vertices.map(|position| Corner { position, normal: None, uv: None }));
    }

    /// Writes `NAME.obj` and `NAME.mtl` into `folder`, each headed by `about`.
    ///
    /// # Errors
    /// Kind `Write` where a file cannot be written.
    pub fn write(&self, folder: &Path, name: &str, about: &str, materials: &[Material<'_>]) -> Result<()> {
        let Self { vertices, uvs, normals, faces, .. } = self;
        let header = about.lines().map(|line| format!("# {line}\n")).collect::<String>();
        let obj = format!("{header}mtllib {name}.mtl\n{}{}{}{faces}", vertices.text, uvs.text, normals.text);
        let mut mtl = header;
        for Material { name, lines } in materials {
            // Writing to a String cannot fail.
            let _ = write!(mtl, "\nnewmtl {name}\n{}\n", lines.trim());
        }
        write_whole(&folder.join(format!("{name}.obj")), obj.as_bytes())?;
        write_whole(&folder.join(format!("{name}.mtl")), mtl.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corners with normals up.
    fn upward(points: [[f64; 3]; 4]) -> [Corner; 4] {
        points.map(|p| Corner { position: DVec3::from_array(p), normal: Some(DVec3::Y), uv: None })
    }

    #[test]
    fn numbers_are_short_and_a_tie_prints_alike_from_both_sides() {
        assert_eq!([0.5, -3.0, 12.0625, 1e-9, -1e-9].map(|x| short(x, 4)), ["0.5", "-3", "12.0625", "0", "0"]);
        let tie = 0.00025_f64;
        assert_eq!(short(tie.next_down(), 4), short(tie.next_up(), 4));
        assert_eq!(short(-5.90625, 5), "-5.90625");
    }

    #[test]
    fn a_quad_wound_against_its_normals_is_turned() {
        let mut obj = Obj::new(4);
        obj.face(&upward([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]]));
        assert_eq!(obj.faces, "f 4//1 3//1 2//1 1//1\n");
    }

    #[test]
    fn a_quad_with_two_corners_in_one_place_is_a_triangle_and_one_of_no_area_is_nothing() {
        let mut obj = Obj::new(4);
        obj.face(&upward([[0.0; 3], [0.0, 0.0, 1e-9], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]));
        assert_eq!(obj.faces, "f 1//1 2//1 3//1\n");
        obj.face(&upward([[0.0; 3], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0; 3]]));
        assert_eq!(obj.faces.lines().count(), 1);
    }
}

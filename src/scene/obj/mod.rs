//! One strict reading of OBJ and MTL files, so that every error has a line.
//!
//! Every statement is read once, and what is wrong is refused: coordinates that are no finite numbers, faces of fewer than three
//! corners, indices out of range, unknown materials. Polygons stay whole. A large file is cut into pieces of whole lines, which
//! threads read side by side: a first look counts the vertices of each, so that every piece knows the numbers of its own; what
//! a piece cannot know – which materials there are – is settled afterwards, in the order of the lines. So neither data, warnings nor the
//! first error depend on how it was cut.

mod mtl;
mod numbers;
mod piece;
mod text;

use std::collections::HashMap;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::json::suggestion;
use crate::error::{Error, Result};
use piece::{Asked, Counts, Event, LeftOut, Piece, leave_out};

pub use mtl::{MtlMaterial, read_mtl};

/// Bytes of a piece that is read at a time.
const PIECE_BYTES: usize = 1 << 18;

/// An index that is not given.
const NONE: u32 = u32::MAX;

/// A corner of a face: indices from 0 of its position, texture coordinates and normal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Corner([u32; 3]);

impl Corner {
    /// Index into [`Obj::positions`].
    #[inline]
    pub fn position(self) -> usize {
        self.0[0] as usize
    }

    /// Index into [`Obj::uvs`].
    #[inline]
    pub fn uv(self) -> Option<usize> {
        (self.0[1] != NONE).then_some(self.0[1] as usize)
    }

    /// Index into [`Obj::normals`].
    #[inline]
    pub fn normal(self) -> Option<usize> {
        (self.0[2] != NONE).then_some(self.0[2] as usize)
    }

    /// Whether it has texture coordinates and a normal; one answer for all corners of a face.
    #[inline]
    fn form(self) -> [bool; 2] {
        [self.0[1] != NONE, self.0[2] != NONE]
    }
}

/// Consecutive faces of a file.
#[derive(Debug, Default, PartialEq)]
pub struct Faces {
    /// Corners of all faces, one after another.
    pub corners: Vec<Corner>,
    /// Corners of each face, at least 3; empty where all are triangles.
    pub arities: Vec<u32>,
    /// Index into [`Obj::materials`], and how many faces in a row have it; together all faces.
    pub runs: Vec<(Option<usize>, usize)>,
}

impl Faces {
    /// Triangles that they make, before those without area are left out: n − 2 of a polygon of n corners.
    pub fn most_triangles(&self) -> usize {
        match self.arities.len() {
            0 => self.corners.len() / 3,
            polygons => self.corners.len() - 2 * polygons,
        }
    }
}

/// What an OBJ file holds.
#[derive(Debug, Default, PartialEq)]
pub struct Obj {
    /// `v`, divided by the weight where there is one; finite.
    pub positions: Vec<Vec3>,
    /// `vt`, the first two; finite.
    pub uvs: Vec<Vec2>,
    /// `vn`, of any length; finite.
    pub normals: Vec<Vec3>,
    /// All faces in their order; indices are within the lists above.
    pub faces: Vec<Faces>,
    /// All materials of the libraries, in their order.
    pub materials: Vec<MtlMaterial>,
    /// Line of the first face that stands before any `usemtl`.
    pub first_bare_face: Option<usize>,
    /// What was left out, in words.
    pub warnings: Vec<String>,
}

/// Reads an OBJ file, called `file` in errors; `open_library` gets the rest of an `mtllib` line and its place, and
/// returns the materials named there.
///
/// # Errors
/// Kind `Input` with file and line: a coordinate that is missing, no number or not finite; a face of fewer than 3
/// corners, with an index out of range, or whose corners differ in form; `usemtl` of an unknown material; one name for
/// two materials; a file without faces; and the errors of `open_library`. Of several the first.
pub fn read_obj(
    bytes: &[u8],
    file: &str,
    open_library: impl FnMut(&str, &str) -> Result<Vec<MtlMaterial>>,
) -> Result<Obj> {
    read_in_pieces(bytes, file, open_library, PIECE_BYTES)
}

fn read_in_pieces(
    bytes: &[u8],
    file: &str,
    open_library: impl FnMut(&str, &str) -> Result<Vec<MtlMaterial>>,
    piece_bytes: usize,
) -> Result<Obj> {
    let texts = text::pieces(text::without_mark(bytes), piece_bytes);
    let counts: Vec<Counts> = texts.par_iter().map(|text| Counts::of(text)).collect();
    let mut before = Vec::with_capacity(counts.len());
    let mut all = Counts::default();
    for own in &counts {
        before.push(all);
        all = all.plus(*own);
    }
    let read = |i: usize| Piece::read(texts[i], file, before[i], counts[i]);
    let pieces: Vec<Piece> = (0..texts.len()).into_par_iter().map(read).collect();
    let mut joiner = Joiner::new(file, all, open_library);
    for piece in pieces {
        joiner.add(piece)?;
    }
    joiner.finish(all.lines)
}

/// Puts the pieces together, in order.
struct Joiner<'a, L> {
    file: &'a str,
    obj: Obj,
    by_name: HashMap<String, usize>,
    material: Option<usize>,
    has_faces: bool,
    left_out: Vec<LeftOut>,
    open_library: L,
}

impl<'a, L: FnMut(&str, &str) -> Result<Vec<MtlMaterial>>> Joiner<'a, L> {
    fn new(file: &'a str, all: Counts, open_library: L) -> Self {
        let [positions, uvs, normals] = all.vertices.map(|n| n as usize);
        let obj = Obj {
            positions: Vec::with_capacity(positions),
            uvs: Vec::with_capacity(uvs),
            normals: Vec::with_capacity(normals),
            ..Obj::default()
        };
        let (by_name, left_out) = (HashMap::new(), Vec::new());
        Self { file, obj, by_name, material: None, has_faces: false, left_out, open_library }
    }

    fn add(&mut self, piece: Piece) -> Result<()> {
        let mut runs = Vec::new();
        let mut done = 0;
        for event in &piece.events {
            self.add_run(&mut runs, event.faces - done, piece.first_face);
            done = event.faces;
            match &event.what {
                Asked::Material(rest) => self.use_material(event, rest)?,
                Asked::Library(rest) => self.library(event, rest)?,
            }
        }
        if let Some(error) = piece.error {
            return Err(error);
        }
        self.add_run(&mut runs, piece.faces - done, piece.first_face);
        self.obj.positions.extend_from_slice(&piece.positions);
        self.obj.uvs.extend_from_slice(&piece.uvs);
        self.obj.normals.extend_from_slice(&piece.normals);
        if piece.faces > 0 {
            self.obj.faces.push(Faces { corners: piece.corners, arities: piece.arities, runs });
        }
        piece.left_out.into_iter().for_each(|one| leave_out(&mut self.left_out, one));
        Ok(())
    }

    /// Notes `count` faces in a row of the material in use; `first` is the line of their piece's first face.
    fn add_run(&mut self, runs: &mut Vec<(Option<usize>, usize)>, count: usize, first: Option<usize>) {
        if count == 0 {
            return;
        }
        runs.push((self.material, count));
        self.has_faces = true;
        // Before any usemtl, the first face of a piece with faces is the first of these.
        if self.material.is_none() {
            self.obj.first_bare_face = self.obj.first_bare_face.or(first);
        }
    }

    fn finish(mut self, lines: usize) -> Result<Obj> {
        let file = self.file;
        if !self.has_faces {
            return Err(Error::input(file, format!("expected at least one face (f), found none in {lines} lines")));
        }
        for (what, lines, first) in self.left_out {
            self.obj.warnings.push(format!("{file}:{first}: {what} left out ({lines} lines)"));
        }
        Ok(self.obj)
    }

    fn error(&self, event: &Event, expected: impl std::fmt::Display, found: impl std::fmt::Display) -> Error {
        Error::input(format!("{}:{}", self.file, event.line), format!("expected {expected}, found {found}"))
    }

    /// The rest of a line as a name: it may hold blanks.
    fn name<'t>(&self, event: &Event, rest: &'t [u8], expected: &str) -> Result<&'t str> {
        match std::str::from_utf8(rest).map(str::trim) {
            Ok("") => Err(self.error(event, expected, "nothing")),
            Ok(name) => Ok(name),
            Err(_) => {
                let found = format!("{:?}", String::from_utf8_lossy(rest));
                Err(self.error(event, format!("{expected} in UTF-8"), found))
            }
        }
    }

    fn use_material(&mut self, event: &Event, rest: &[u8]) -> Result<()> {
        let name = self.name(event, rest, "usemtl with a material's name")?;
        let Some(&index) = self.by_name.get(name) else {
            let expected = match self.obj.materials.len() {
                0 => "usemtl of a material of an mtllib above this line (there is none)".to_owned(),
                n => format!("usemtl of one of the {n} materials of the mtllib above this line"),
            };
            let near = suggestion(name, self.obj.materials.iter().map(|m| m.name.as_str()));
            return Err(self.error(event, expected, format!("{name:?}{near}")));
        };
        self.material = Some(index);
        Ok(())
    }

    fn library(&mut self, event: &Event, rest: &[u8]) -> Result<()> {
        let name = self.name(event, rest, "mtllib with a file name")?;
        let place = format!("{}:{}", self.file, event.line);
        for material in (self.open_library)(name, &place)? {
            if let Some(&first) = self.by_name.get(&material.name) {
                let first = &self.obj.materials[first].place;
                // The same library named twice is one library.
                if *first == material.place {
                    continue;
                }
                let what = format!("expected each name once, found {:?} again, first at {first}", material.name);
                return Err(Error::input(&material.place, what));
            }
            self.by_name.insert(material.name.clone(), self.obj.materials.len());
            self.obj.materials.push(material);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Two thousand cases of a strategy, the same ones each time.
    pub(super) fn run<S: Strategy>(strategy: &S, test: impl Fn(S::Value)) {
        let config = ProptestConfig { cases: 2000, failure_persistence: None, ..Default::default() };
        let rng = proptest::test_runner::TestRng::from_seed(proptest::test_runner::RngAlgorithm::ChaCha, &[9; 32]);
        let done = proptest::test_runner::TestRunner::new_with_rng(config, rng).run(strategy, |value| {
            test(value);
            Ok(())
        });
        done.unwrap();
    }

    fn library(rest: &str, place: &str) -> Result<Vec<MtlMaterial>> {
        if rest == "none" {
            return Err(Error::input(place, "expected a library, found none"));
        }
        read_mtl(b"newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n", rest).map(|(materials, _)| materials)
    }

    fn read(text: &str, bytes: usize) -> Result<Obj> {
        read_in_pieces(text.as_bytes(), "a.obj", library, bytes)
    }

    /// All faces as one.
    fn joined(obj: &Obj) -> (Vec<Corner>, Vec<u32>, Vec<Option<usize>>) {
        let mut all = (Vec::new(), Vec::new(), Vec::new());
        for faces in &obj.faces {
            all.0.extend(&faces.corners);
            let count = faces.runs.iter().map(|run| run.1).sum();
            all.1.extend(if faces.arities.is_empty() { vec![3; count] } else { faces.arities.clone() });
            all.2.extend(faces.runs.iter().flat_map(|&(material, n)| vec![material; n]));
        }
        assert_eq!(all.1.len(), all.2.len());
        all
    }

    #[test]
    fn the_cut_into_pieces_changes_nothing() {
        let vertex = "v -?[0-9]\\.[0-9]{1,3} [0-9] 0\n|v 1 2 3 4\n|vt 0\\.[0-9]\n|vn 0 0 [0-9]\n|v 1 \\\\\n 2 3\n";
        let face = "f [1-3] [1-3] [1-3]\n|f -1 -2 -3\n|f 1 2 3 [1-4]\n|f 1/1 2/1 3/1\n|f 1//1 2//1 3//1 # x\n";
        let other =
            "usemtl (red|blue)\n|mtllib b\n|# a\n|\n|l 1 2\n|wrong 1\n|usemtl green\n|mtllib none\n|f 1 2\n|v x\n";
        let line = prop_oneof![6 => vertex, 6 => face, 1 => other, 1 => "usemtl (red|blue)\n"];
        run(&prop::collection::vec(line, 0..30), |lines| {
            let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nmtllib b\n{}", lines.concat());
            let whole = read(&text, 1 << 20);
            for bytes in [1, 20, 75] {
                let cut = read(&text, bytes);
                match (&whole, &cut) {
                    (Ok(whole), Ok(cut)) => {
                        assert_eq!(joined(whole), joined(cut), "{text}");
                        let rest = |obj: &Obj| {
                            let lists = (obj.positions.clone(), obj.uvs.clone(), obj.normals.clone());
                            (lists, obj.materials.clone(), obj.first_bare_face, obj.warnings.clone())
                        };
                        assert_eq!(rest(whole), rest(cut), "{text}");
                    }
                    (Err(whole), Err(cut)) => assert_eq!(whole, cut, "{text}"),
                    _ => panic!("{whole:?} but {cut:?} in pieces of {bytes}: {text}"),
                }
            }
        });
    }

    /// tobj's reading of the same text, polygons whole: positions, texture coordinates and normals of all corners, bit for bit.
    #[test]
    fn an_independent_reader_finds_the_same() {
        let number = "-?[0-9]{1,3}(\\.[0-9]{0,9})?|-?0\\.[0-9]{6,20}|[0-9]e-[0-9]";
        let numbers = prop::collection::vec(number, 36);
        let face =
            "f [1-6] [1-6] [1-6]\n|f -1/-2 -2/1 -3/2\n|f 1//[1-3] 2//1 3//-1 4//2\n|f 1/1/1 2/1/2 3/2/1 5/4/3 6/1/2\n";
        let other = "usemtl (red|blue)\n|g\n|# a\n";
        let lines = prop::collection::vec(prop_oneof![4 => face, 1 => other], 1..20);
        run(&(numbers, lines), |(numbers, lines)| {
            let mut text = "mtllib b\n".to_owned();
            for (i, n) in numbers.chunks(3).enumerate() {
                text += &match i {
                    0..6 => format!("v {} {} {}\n", n[0], n[1], n[2]),
                    6..9 => format!("vn {} {} {}\n", n[0], n[1], n[2]),
                    _ => format!("vt {} {}\nvt {} 0.5 0.5\n", n[0], n[1], n[2]),
                };
            }
            text += &lines.concat();
            let Ok(ours) = read(&text, 64) else {
                assert!(!text.contains("\nf "), "{text}");
                return;
            };
            let (corners, arities, materials) = joined(&ours);
            // tobj wants one form of corners throughout a group.
            let grouped = text.replace("\nf ", "\ng\nf ");
            let options = tobj::LoadOptions { single_index: true, ..tobj::LoadOptions::default() };
            let named = |_: &std::path::Path| {
                let names = ["red", "blue"].map(str::to_owned);
                let materials = names.clone().map(|name| tobj::Material { name, ..Default::default() }).to_vec();
                Ok((materials, names.into_iter().zip(0..).collect()))
            };
            let (models, _) = tobj::load_obj_buf(&mut grouped.as_bytes(), &options, named).unwrap();
            let mut at = 0;
            let mut faces = arities.iter().zip(&materials);
            let bits = |list: &[f32], i: u32, n: usize| -> Vec<u32> {
                list.iter().skip(n * i as usize).take(n).map(|x| x.to_bits()).collect()
            };
            // A group without faces at the end is one to tobj.
            for mesh in models.iter().map(|model| &model.mesh).filter(|mesh| !mesh.indices.is_empty()) {
                let (&arity, &material) = faces.next().unwrap();
                assert_eq!((mesh.indices.len(), mesh.material_id), (arity as usize, material), "{text}");
                for (corner, &i) in corners[at..].iter().zip(&mesh.indices) {
                    let of = |v: &[f32]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                    assert_eq!(
                        of(&ours.positions[corner.position()].to_array()),
                        bits(&mesh.positions, i, 3),
                        "{text}"
                    );
                    let uv = corner.uv().map_or(Vec::new(), |i| of(&ours.uvs[i].to_array()));
                    assert_eq!(uv, bits(&mesh.texcoords, i, 2), "{text}");
                    let normal = corner.normal().map_or(Vec::new(), |i| of(&ours.normals[i].to_array()));
                    assert_eq!(normal, bits(&mesh.normals, i, 3), "{text}");
                }
                at += arity as usize;
            }
            assert!(faces.next().is_none() && at == corners.len(), "{text}");
        });
    }

    #[test]
    fn a_face_before_any_material_is_found_wherever_the_cut_is() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nmtllib b\nf 1 2 3\nf 1 2 3\nusemtl red\nf 1 2 3\n";
        for bytes in 1..text.len() {
            assert_eq!(read(text, bytes).unwrap().first_bare_face, Some(5));
            assert_eq!(read(&text.replacen("f 1 2 3\n", "", 2), bytes).unwrap().first_bare_face, None);
        }
    }
}

//! One piece of an OBJ file's lines: every statement checked and read, without a look at the other pieces.

use super::numbers::{index, number, plain_numbers};
use super::text::{Lines, shorten, split_keyword, without_comment, words};
use super::{Corner, NONE};
use crate::error::{Error, Result};
use crate::scene::json::suggestion;

use glam::{Vec2, Vec3};

/// How much of each kind a text holds: positions, texture coordinates, normals, and lines.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Counts {
    pub vertices: [u32; 3],
    pub lines: usize,
}

impl Counts {
    /// Counts statements without reading them.
    pub fn of(text: &[u8]) -> Self {
        let mut vertices = [0; 3];
        let mut lines = Lines::after(0, text);
        for (_, line) in lines.by_ref() {
            match split_keyword(&line).0 {
                b"v" => vertices[0] += 1,
                b"vt" => vertices[1] += 1,
                b"vn" => vertices[2] += 1,
                _ => {}
            }
        }
        Self { vertices, lines: lines.line }
    }

    pub fn plus(self, other: Self) -> Self {
        let [a, b] = [self.vertices, other.vertices];
        Self { vertices: [a[0] + b[0], a[1] + b[1], a[2] + b[2]], lines: self.lines + other.lines }
    }
}

/// A statement whose meaning depends on other pieces.
#[derive(Debug, PartialEq)]
pub(super) struct Event {
    pub line: usize,
    /// Faces of this piece before it.
    pub faces: usize,
    pub what: Asked,
}

/// What an [`Event`] asks for; the rest of its line, blanks and all.
#[derive(Debug, PartialEq)]
pub(super) enum Asked {
    /// `usemtl`
    Material(Vec<u8>),
    /// `mtllib`
    Library(Vec<u8>),
}

/// What was left out, how many lines of it, and the first.
pub(super) type LeftOut = (String, usize, usize);

/// Most kinds of left-out statements that are told apart: twenty kinds of nonsense say what a hundred would.
const MOST_KINDS: usize = 20;

/// Adds lines to what was left out.
pub(super) fn leave_out(all: &mut Vec<LeftOut>, (what, lines, first): LeftOut) {
    let has_room = all.len() < MOST_KINDS;
    match all.iter_mut().find(|(w, _, _)| *w == what) {
        Some((_, n, _)) => *n += lines,
        None if has_room => all.push((what, lines, first)),
        None => {}
    }
}

/// A piece of the file, read up to its end or its first error.
#[derive(Debug, Default)]
pub(super) struct Piece {
    pub positions: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
    pub normals: Vec<Vec3>,
    /// Corners of all faces, one after another.
    pub corners: Vec<Corner>,
    /// Corners of each face, where one of them is no triangle.
    pub arities: Vec<u32>,
    pub faces: usize,
    /// Line of the first face.
    pub first_face: Option<usize>,
    pub events: Vec<Event>,
    pub left_out: Vec<LeftOut>,
    pub error: Option<Error>,
}

impl Piece {
    /// Reads `text`, which follows `before` in `file`.
    pub fn read(text: &[u8], file: &str, before: Counts, own: Counts) -> Self {
        let mut reader = Reader { file, line: before.lines, counts: before.vertices, piece: Self::default() };
        reader.piece.positions.reserve_exact(own.vertices[0] as usize);
        reader.piece.uvs.reserve_exact(own.vertices[1] as usize);
        reader.piece.normals.reserve_exact(own.vertices[2] as usize);
        for (line, text) in Lines::after(before.lines, text) {
            reader.line = line;
            if let Err(error) = reader.statement(&text) {
                reader.piece.error = Some(error);
                break;
            }
        }
        reader.piece.corners.shrink_to_fit();
        reader.piece
    }
}

/// Statements that change nothing here: names, groups, smoothing (normals are given or taken from the face), display.
const SILENT: [&str; 12] =
    ["o", "g", "s", "mg", "lod", "bevel", "c_interp", "d_interp", "usemap", "maplib", "shadow_obj", "trace_obj"];

/// Statements that would show something, were they modelled.
const NOT_MODELLED: [&str; 22] = [
    "l", "p", "vp", "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim", "hole", "scrv", "sp",
    "end", "con", "ctech", "stech", "call", "csh", "cdp",
];

struct Reader<'a> {
    file: &'a str,
    line: usize,
    /// Positions, texture coordinates and normals so far, in the whole file.
    counts: [u32; 3],
    piece: Piece,
}

impl Reader<'_> {
    fn error(&self, expected: impl std::fmt::Display, found: impl std::fmt::Display) -> Error {
        Error::input(format!("{}:{}", self.file, self.line), format!("expected {expected}, found {found}"))
    }

    #[inline]
    fn statement(&mut self, text: &[u8]) -> Result<()> {
        let (keyword, rest) = split_keyword(text);
        match keyword {
            b"v" => self.position(rest),
            b"vt" => self.texture_coordinates(rest),
            b"vn" => self.normal(rest),
            b"f" => self.face(rest),
            b"" => Ok(()),
            b"usemtl" => self.ask(Asked::Material(rest.to_vec())),
            b"mtllib" => self.ask(Asked::Library(rest.to_vec())),
            [b'#', ..] => Ok(()),
            _ => {
                self.leave_out(&String::from_utf8_lossy(keyword));
                Ok(())
            }
        }
    }

    fn ask(&mut self, what: Asked) -> Result<()> {
        self.piece.events.push(Event { line: self.line, faces: self.piece.faces, what });
        Ok(())
    }

    fn leave_out(&mut self, keyword: &str) {
        if SILENT.contains(&keyword) {
            return;
        }
        let what = match NOT_MODELLED.contains(&keyword) {
            true => format!("the statement {keyword:?} is not modelled,"),
            false => format!(
                "unknown statement {:?}{},",
                shorten(keyword),
                suggestion(keyword, ["v", "vt", "vn", "usemtl", "mtllib"])
            ),
        };
        leave_out(&mut self.piece.left_out, (what, 1, self.line));
    }

    /// Checks that the words are finite numbers, `least` to `most` of them; returns their count and the first three.
    #[inline]
    fn numbers(&self, rest: &[u8], least: usize, most: usize, expected: &str) -> Result<(usize, [f32; 3])> {
        match plain_numbers(rest).filter(|(n, _)| (least..=most).contains(n)) {
            Some(found) => Ok(found),
            None => self.any_numbers(rest, least, most, expected),
        }
    }

    #[cold]
    fn any_numbers(&self, rest: &[u8], least: usize, most: usize, expected: &str) -> Result<(usize, [f32; 3])> {
        let rest = without_comment(rest);
        let (mut n, mut found) = (0, [0.0; 3]);
        for word in words(rest) {
            let Some(value) = number(word).filter(|x| x.is_finite()) else {
                return Err(self.error(expected, format!("{:?}", shorten(&String::from_utf8_lossy(word)))));
            };
            if let Some(place) = found.get_mut(n) {
                *place = value;
            }
            n += 1;
        }
        if n < least || n > most { Err(self.error(expected, format!("{n} numbers"))) } else { Ok((n, found)) }
    }

    #[inline]
    fn position(&mut self, rest: &[u8]) -> Result<()> {
        const EXPECTED: &str = "v with 3 finite coordinates (or 4 with a weight, or 6 with a colour)";
        // A colour, with or without alpha, is not used.
        let (n, mut xyz) = self.numbers(rest, 3, 7, EXPECTED)?;
        if n == 5 {
            return Err(self.error(EXPECTED, "5 numbers"));
        }
        if n == 4 {
            let weight = words(without_comment(rest)).nth(3).and_then(number).unwrap_or(0.0);
            xyz = xyz.map(|x| x / weight);
            if !xyz.iter().all(|x| x.is_finite()) {
                return Err(self.error("a weight that leaves the coordinates finite", weight));
            }
        }
        self.counts[0] += 1;
        self.piece.positions.push(Vec3::from_array(xyz));
        Ok(())
    }

    #[inline]
    fn texture_coordinates(&mut self, rest: &[u8]) -> Result<()> {
        // The second coordinate is 0 where it is not given, as the format has it; the third is not used.
        let (_, [u, v, _]) = self.numbers(rest, 1, 3, "vt with 1 to 3 finite numbers")?;
        self.counts[1] += 1;
        self.piece.uvs.push(Vec2::new(u, v));
        Ok(())
    }

    #[inline]
    fn normal(&mut self, rest: &[u8]) -> Result<()> {
        let (_, xyz) = self.numbers(rest, 3, 3, "vn with 3 finite numbers")?;
        self.counts[2] += 1;
        self.piece.normals.push(Vec3::from_array(xyz));
        Ok(())
    }

    #[inline]
    fn face(&mut self, rest: &[u8]) -> Result<()> {
        let first = self.piece.corners.len();
        if !plain_face(rest, self.counts, &mut self.piece.corners) {
            self.piece.corners.truncate(first);
            self.any_face(rest)?;
        }
        let corners = self.piece.corners.len() - first;
        if corners != 3 && self.piece.arities.is_empty() {
            self.piece.arities.resize(self.piece.faces, 3);
        }
        if corners != 3 || !self.piece.arities.is_empty() {
            self.piece.arities.push(corners as u32);
        }
        self.piece.first_face.get_or_insert(self.line);
        self.piece.faces += 1;
        Ok(())
    }

    /// Reads a face of any legal text.
    #[cold]
    fn any_face(&mut self, rest: &[u8]) -> Result<()> {
        let rest = without_comment(rest);
        let corners: Vec<Corner> = words(rest).map(|word| self.corner(word)).collect::<Result<_>>()?;
        if corners.len() < 3 {
            return Err(self.error("a face of at least 3 corners", corners.len()));
        }
        if corners.iter().any(|corner| corner.form() != corners[0].form()) {
            let words = String::from_utf8_lossy(rest);
            let what = "corners of one form (all v, all v/vt, all v//vn or all v/vt/vn)";
            return Err(self.error(what, format!("{:?}", shorten(words.trim()))));
        }
        self.piece.corners.extend(corners);
        Ok(())
    }

    /// Reads one corner `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&self, word: &[u8]) -> Result<Corner> {
        let mut found = [NONE; 3];
        for (i, part) in word.split(|&b| b == b'/').enumerate() {
            if part.is_empty() && (1..3).contains(&i) {
                continue;
            }
            let index = if i < 3 { index(part) } else { None };
            let Some(index) = index else {
                let word = String::from_utf8_lossy(word);
                return Err(
                    self.error("a corner v, v/vt, v//vn or v/vt/vn of whole numbers", format!("{:?}", shorten(&word)))
                );
            };
            let count = i64::from(self.counts[i]);
            if index == 0 || index > count || index < -count {
                let what = ["position (v)", "texture coordinate (vt)", "normal (vn)"][i];
                let range = match count {
                    0 => format!("no {what}, as none stands above this line"),
                    _ => format!("an index of a {what} from 1 to {count}, or from -{count} to -1"),
                };
                return Err(self.error(range, index));
            }
            // Below zero it counts back from the last one.
            found[i] = if index > 0 { index - 1 } else { count + index } as u32;
        }
        Ok(Corner(found))
    }
}

/// Reads the corners of a face of at least 3 of one form, whose indices are positive and within `counts`; no for any other text,
/// which needs a closer look (some corners may then be in `out`). Nearly all faces of a mesh end here.
#[inline]
fn plain_face(text: &[u8], counts: [u32; 3], out: &mut Vec<Corner>) -> bool {
    let first = out.len();
    let mut at = 0;
    loop {
        while matches!(text.get(at), Some(b' ' | b'\t')) {
            at += 1;
        }
        if at == text.len() {
            return out.len() >= first + 3;
        }
        let mut found = [NONE; 3];
        let mut part = 0;
        loop {
            let start = at;
            let mut value = 0u64;
            while let Some(digit) = text.get(at).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10) {
                value = value.wrapping_mul(10).wrapping_add(u64::from(digit));
                at += 1;
            }
            if at > start {
                if at - start > 18 || value == 0 || value > u64::from(counts[part]) {
                    return false;
                }
                found[part] = value as u32 - 1;
            } else if part == 0 {
                return false;
            }
            match text.get(at) {
                None | Some(b' ' | b'\t') => break,
                Some(b'/') if part < 2 => (at, part) = (at + 1, part + 1),
                _ => return false,
            }
        }
        let corner = Corner(found);
        if out.get(first).is_some_and(|one| one.form() != corner.form()) {
            return false;
        }
        out.push(corner);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::run;
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_quick_look_at_faces_agrees_with_the_slow_one() {
        let word = prop_oneof!["[1-9]", "[0-9]/[0-9]", "[1-3]//[1-3]", "[1-3]/[1-3]/[1-3]", "-?[0-9/#]{1,4}", "[1-3]/"];
        let faces = prop_oneof![
            prop::collection::vec(word.clone(), 0..5),
            (word, 1..5usize).prop_map(|(word, n)| vec![word; n]),
        ];
        run(&faces, |words| {
            let text = words.join(" ");
            let counts = [3, 2, 3];
            let mut slow = Reader { file: "a", line: 1, counts, piece: Piece::default() };
            let is_legal = slow.any_face(text.as_bytes()).is_ok();
            let mut fast = Vec::new();
            let is_fast = plain_face(text.as_bytes(), counts, &mut fast);
            assert!(!is_fast || (is_legal && fast == slow.piece.corners), "{text:?}");
            let is_plain = !text.contains(['-', '#']);
            assert!(!is_legal || is_fast || !is_plain, "{text:?} was left to the slow way");
        });
    }
}

//! One strict pass over the text of OBJ and MTL files, so that every error has a line.
//!
//! tobj reads the geometry, but it reports no lines and lets much pass: NaN coordinates, polylines read as triangles,
//! missing normals taken from a neighbour, unknown materials. So [`check_obj`] reads every statement once, refuses what is
//! wrong, and writes a plain text that holds only what tobj reads without surprises: coordinates, faces, and materials by
//! number. MTL files are short and are read here in full ([`read_mtl`]): tobj panics on a colour of two numbers.

use std::borrow::Cow;
use std::collections::HashMap;

use super::json::suggestion;
use crate::error::{Error, Result};

/// A material as its MTL file gives it.
#[derive(Debug, Clone, PartialEq)]
pub struct MtlMaterial {
    /// Its name.
    pub name: String,
    /// `FILE:LINE` of its `newmtl`.
    pub place: String,
    /// Diffuse colour, components 0 or above.
    pub kd: Option<[f32; 3]>,
    /// Specular colour, components 0 or above.
    pub ks: Option<[f32; 3]>,
    /// Emission, components 0 or above.
    pub ke: Option<[f32; 3]>,
    /// `FILE:LINE` and file name of the diffuse texture.
    pub map_kd: Option<(String, String)>,
    /// The illumination model; 3 and above reflect or refract.
    pub illum: Option<u32>,
}

/// What [`check_obj`] hands to tobj and keeps for itself.
#[derive(Debug, Default)]
pub struct CheckedObj {
    /// The text for tobj: `v vt vn f`, `usemtl N` where `N` indexes `materials`, and `g` where faces change their form.
    pub text: Vec<u8>,
    /// All materials of the libraries, in their order.
    pub materials: Vec<MtlMaterial>,
    /// Line of the first face that stands before any `usemtl`.
    pub first_bare_face: Option<usize>,
    /// What was left out, in words.
    pub warnings: Vec<String>,
}

/// The name of material `index` in the text for tobj.
pub fn tobj_name(index: usize) -> String {
    index.to_string()
}

/// Checks an OBJ file, called `file` in errors; `open_library` gets the rest of an `mtllib` line and its place, and
/// returns the materials named there.
///
/// # Errors
/// Kind `Input` with file and line: a coordinate that is missing, no number or not finite; a face of fewer than 3
/// corners, with an index out of range, or whose corners differ in form; `usemtl` of an unknown material; one name for
/// two materials; a file without faces; and the errors of `open_library`.
pub fn check_obj(
    bytes: &[u8],
    file: &str,
    open_library: impl FnMut(&str, &str) -> Result<Vec<MtlMaterial>>,
) -> Result<CheckedObj> {
    let mut pass = Pass {
        file,
        line: 0,
        out: CheckedObj { text: Vec::with_capacity(bytes.len() + bytes.len() / 8), ..CheckedObj::default() },
        by_name: HashMap::new(),
        counts: [0; 3],
        faces: 0,
        has_material: false,
        form: None,
        left_out: Vec::new(),
        open_library,
    };
    for (line, text) in Lines::new(bytes) {
        pass.line = line;
        pass.statement(&text)?;
    }
    if pass.faces == 0 {
        return Err(Error::input(file, format!("expected at least one face (f), found none in {} lines", pass.line)));
    }
    for (what, lines, first) in pass.left_out {
        pass.out.warnings.push(format!("{file}:{first}: {what} left out ({lines} lines)"));
    }
    Ok(pass.out)
}

/// The state of the pass over one OBJ file.
struct Pass<'a, L> {
    file: &'a str,
    line: usize,
    out: CheckedObj,
    by_name: HashMap<String, usize>,
    /// Positions, texture coordinates and normals so far.
    counts: [u32; 3],
    faces: usize,
    has_material: bool,
    /// Whether the last face had texture coordinates and normals. tobj needs one answer for a whole group.
    form: Option<[bool; 2]>,
    /// What was left out, how many lines of it, and the first.
    left_out: Vec<(String, usize, usize)>,
    open_library: L,
}

/// Statements that change nothing here: names, groups, smoothing (normals are given or taken from the face), display.
const SILENT: [&str; 12] =
    ["o", "g", "s", "mg", "lod", "bevel", "c_interp", "d_interp", "usemap", "maplib", "shadow_obj", "trace_obj"];

/// Statements that would show something, were they modelled.
const NOT_MODELLED: [&str; 22] = [
    "l", "p", "vp", "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim", "hole", "scrv", "sp",
    "end", "con", "ctech", "stech", "call", "csh", "cdp",
];

impl<L: FnMut(&str, &str) -> Result<Vec<MtlMaterial>>> Pass<'_, L> {
    fn place(&self) -> String {
        format!("{}:{}", self.file, self.line)
    }

    fn error(&self, expected: impl std::fmt::Display, found: impl std::fmt::Display) -> Error {
        Error::input(self.place(), format!("expected {expected}, found {found}"))
    }

    fn statement(&mut self, text: &[u8]) -> Result<()> {
        let (keyword, rest) = split_keyword(text);
        match keyword {
            b"v" => self.position(rest),
            b"vt" => self.texture_coordinates(rest),
            b"vn" => self.normal(rest),
            b"f" => self.face(rest),
            b"" => Ok(()),
            b"usemtl" => self.use_material(rest),
            b"mtllib" => self.library(rest),
            [b'#', ..] => Ok(()),
            _ => {
                self.leave_out(&String::from_utf8_lossy(keyword));
                Ok(())
            }
        }
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
        // Twenty kinds of nonsense say what a hundred would.
        let has_room = self.left_out.len() < 20;
        match self.left_out.iter_mut().find(|(w, _, _)| *w == what) {
            Some((_, lines, _)) => *lines += 1,
            None if has_room => self.left_out.push((what, 1, self.line)),
            None => {}
        }
    }

    /// Copies the first `n` words of a checked line.
    fn copy(&mut self, keyword: &str, rest: &[u8], n: usize) {
        self.out.text.extend_from_slice(keyword.as_bytes());
        for word in words(rest).take(n) {
            self.out.text.push(b' ');
            self.out.text.extend_from_slice(word);
        }
        self.out.text.push(b'\n');
    }

    /// Checks that the words are finite numbers, `least` to `most` of them, and returns their count.
    fn numbers(&self, rest: &[u8], least: usize, most: usize, expected: &str) -> Result<usize> {
        let mut n = 0;
        for word in words(rest) {
            n += 1;
            if !is_number(word) {
                return Err(self.error(expected, format!("{:?}", shorten(&String::from_utf8_lossy(word)))));
            }
        }
        if n < least || n > most {
            return Err(self.error(expected, format!("{n} numbers")));
        }
        Ok(n)
    }

    fn position(&mut self, rest: &[u8]) -> Result<()> {
        const EXPECTED: &str = "v with 3 finite coordinates (or 4 with a weight, or 6 with a colour)";
        let rest = without_comment(rest);
        // A colour, with or without alpha, is not used: tobj wants it on all vertices or on none.
        let copied = match self.numbers(rest, 3, 7, EXPECTED)? {
            4 => 4,
            5 => return Err(self.error(EXPECTED, "5 numbers")),
            _ => 3,
        };
        if copied == 4 {
            let mut numbers = words(rest).map(number);
            let xyz: Vec<f32> = numbers.by_ref().take(3).flatten().collect();
            let weight = numbers.next().flatten().unwrap_or(0.0);
            if !xyz.iter().all(|x| (x / weight).is_finite()) {
                return Err(self.error("a weight that leaves the coordinates finite", weight));
            }
        }
        self.counts[0] += 1;
        self.copy("v", rest, copied);
        Ok(())
    }

    fn texture_coordinates(&mut self, rest: &[u8]) -> Result<()> {
        let rest = without_comment(rest);
        let n = self.numbers(rest, 1, 3, "vt with 1 to 3 finite numbers")?;
        self.counts[1] += 1;
        self.copy("vt", rest, 2);
        if n == 1 {
            // The format's own default for the second coordinate; tobj asks for it in writing.
            self.out.text.pop();
            self.out.text.extend_from_slice(b" 0\n");
        }
        Ok(())
    }

    fn normal(&mut self, rest: &[u8]) -> Result<()> {
        let rest = without_comment(rest);
        self.numbers(rest, 3, 3, "vn with 3 finite numbers")?;
        self.counts[2] += 1;
        self.copy("vn", rest, 3);
        Ok(())
    }

    fn face(&mut self, rest: &[u8]) -> Result<()> {
        let rest = without_comment(rest);
        let mut form: Option<[bool; 2]> = None;
        let mut corners = 0;
        for word in words(rest) {
            let found = self.corner(word)?;
            if form.is_some_and(|first| first != found) {
                let words = String::from_utf8_lossy(rest);
                let what = "corners of one form (all v, all v/vt, all v//vn or all v/vt/vn)";
                return Err(self.error(what, format!("{:?}", shorten(words.trim()))));
            }
            form = Some(found);
            corners += 1;
        }
        if corners < 3 {
            return Err(self.error("a face of at least 3 corners", corners));
        }
        if self.form != form {
            // An empty group: the faces before stay together, in the form that they share.
            self.out.text.extend_from_slice(b"g\n");
            self.form = form;
        }
        if !self.has_material && self.out.first_bare_face.is_none() {
            self.out.first_bare_face = Some(self.line);
        }
        self.faces += 1;
        self.copy("f", rest, corners);
        Ok(())
    }

    /// Checks one corner `v`, `v/vt`, `v//vn` or `v/vt/vn`, and says which of vt and vn it has.
    fn corner(&self, word: &[u8]) -> Result<[bool; 2]> {
        let mut has = [false; 3];
        for (i, part) in word.split(|&b| b == b'/').enumerate() {
            if part.is_empty() && i > 0 && i < 3 {
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
            has[i] = true;
        }
        Ok([has[1], has[2]])
    }

    /// The rest of a line as a name: it may hold blanks.
    fn name<'t>(&self, rest: &'t [u8], expected: &str) -> Result<&'t str> {
        match std::str::from_utf8(rest).map(str::trim) {
            Ok("") => Err(self.error(expected, "nothing")),
            Ok(name) => Ok(name),
            Err(_) => Err(self.error(format!("{expected} in UTF-8"), format!("{:?}", String::from_utf8_lossy(rest)))),
        }
    }

    fn use_material(&mut self, rest: &[u8]) -> Result<()> {
        let name = self.name(rest, "usemtl with a material's name")?;
        let Some(&index) = self.by_name.get(name) else {
            let expected = match self.out.materials.len() {
                0 => "usemtl of a material of an mtllib above this line (there is none)".to_owned(),
                n => format!("usemtl of one of the {n} materials of the mtllib above this line"),
            };
            let near = suggestion(name, self.out.materials.iter().map(|m| m.name.as_str()));
            return Err(self.error(expected, format!("{name:?}{near}")));
        };
        self.has_material = true;
        self.out.text.extend_from_slice(format!("usemtl {}\n", tobj_name(index)).as_bytes());
        Ok(())
    }

    fn library(&mut self, rest: &[u8]) -> Result<()> {
        let name = self.name(rest, "mtllib with a file name")?;
        let place = self.place();
        for material in (self.open_library)(name, &place)? {
            if let Some(&first) = self.by_name.get(&material.name) {
                let first = &self.out.materials[first].place;
                // The same library named twice is one library.
                if *first == material.place {
                    continue;
                }
                let what = format!("expected each name once, found {:?} again, first at {first}", material.name);
                return Err(Error::input(&material.place, what));
            }
            self.by_name.insert(material.name.clone(), self.out.materials.len());
            self.out.materials.push(material);
        }
        Ok(())
    }
}

/// Reads an MTL file, called `file` in errors: names, Kd, Ks, Ke, map_Kd and illum. Also what else it holds that would show.
///
/// # Errors
/// Kind `Input` with file and line: a statement before `newmtl`, no name, a colour that is negative, not finite or not
/// of 1 or 3 numbers, a texture with options or without a name.
pub fn read_mtl(bytes: &[u8], file: &str) -> Result<(Vec<MtlMaterial>, Vec<String>)> {
    let mut materials: Vec<MtlMaterial> = Vec::new();
    let mut ignored: Vec<String> = Vec::new();
    for (line, text) in Lines::new(bytes) {
        let place = format!("{file}:{line}");
        let (keyword, rest) = split_keyword(&text);
        if keyword.is_empty() || keyword[0] == b'#' {
            continue;
        }
        let (Ok(keyword), Ok(rest)) = (std::str::from_utf8(keyword), std::str::from_utf8(rest)) else {
            return Err(Error::input(place, "expected text in UTF-8, found other bytes"));
        };
        let rest = rest.trim();
        if keyword == "newmtl" {
            materials.push(new_material(rest, &place)?);
            continue;
        }
        let Some(material) = materials.last_mut() else {
            return Err(Error::input(place, format!("expected newmtl first, found {:?}", shorten(keyword))));
        };
        match keyword {
            "Kd" => material.kd = Some(colour(rest, &place)?),
            "Ks" => material.ks = Some(colour(rest, &place)?),
            "Ke" => material.ke = Some(colour(rest, &place)?),
            "map_Kd" => material.map_kd = Some((place.clone(), texture_name(rest, &place)?)),
            "illum" => material.illum = rest.parse().ok(),
            _ if shows(keyword) && !ignored.iter().any(|k| k == keyword) => ignored.push(keyword.to_owned()),
            // Ka, Ns, Ni, d, Tr and the extensions: nothing in the sheet's equations reads them.
            _ => {}
        }
    }
    let warnings = match ignored.is_empty() {
        true => Vec::new(),
        false => vec![format!("{file}: not modelled and left out: {}", ignored.join(", "))],
    };
    Ok((materials, warnings))
}

/// Whether an MTL statement that is not read would change the picture, were it modelled.
fn shows(keyword: &str) -> bool {
    keyword.starts_with("map_") || matches!(keyword, "bump" | "disp" | "decal" | "refl" | "norm")
}

fn new_material(name: &str, place: &str) -> Result<MtlMaterial> {
    if name.is_empty() {
        return Err(Error::input(place, "expected newmtl with a name, found nothing"));
    }
    let place = place.to_owned();
    Ok(MtlMaterial { name: name.to_owned(), place, kd: None, ks: None, ke: None, map_kd: None, illum: None })
}

/// A colour of three numbers, or of one that stands for all three, as the format allows.
fn colour(rest: &str, place: &str) -> Result<[f32; 3]> {
    let found: Vec<Option<f32>> =
        words(without_comment(rest.as_bytes())).map(|w| number(w).filter(|x| x.is_finite() && *x >= 0.0)).collect();
    match found.as_slice() {
        [Some(r), Some(g), Some(b)] => Ok([*r, *g, *b]),
        [Some(grey)] => Ok([*grey; 3]),
        _ => Err(Error::input(
            place,
            format!("expected a colour of 3 finite numbers, 0 or above, found {:?}", shorten(rest)),
        )),
    }
}

fn texture_name(rest: &str, place: &str) -> Result<String> {
    match rest {
        "" => Err(Error::input(place, "expected map_Kd with a file name, found nothing")),
        _ if rest.starts_with('-') => {
            let what = "expected map_Kd with a file name alone (its options are not modelled; apply them to the texture coordinates)";
            Err(Error::input(place, format!("{what}, found {:?}", shorten(rest))))
        }
        name => Ok(name.to_owned()),
    }
}

/// The lines of a text with their numbers from 1. A backslash at the end of a line joins the next one to it.
struct Lines<'a> {
    left: &'a [u8],
    line: usize,
}

impl<'a> Lines<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self { left: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), line: 0 }
    }

    fn physical(&mut self) -> Option<&'a [u8]> {
        if self.left.is_empty() {
            return None;
        }
        self.line += 1;
        let end = self.left.iter().position(|&b| b == b'\n').unwrap_or(self.left.len());
        let line = &self.left[..end];
        self.left = self.left.get(end + 1..).unwrap_or(&[]);
        Some(line.strip_suffix(b"\r").unwrap_or(line))
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, Cow<'a, [u8]>);

    fn next(&mut self) -> Option<Self::Item> {
        let first = self.physical()?;
        let line = self.line;
        // In names and comments a backslash is a backslash (a Windows path, a drawing).
        if first.last() != Some(&b'\\') || !matches!(split_keyword(first).0, b"v" | b"vt" | b"vn" | b"f" | b"l" | b"p")
        {
            return Some((line, Cow::Borrowed(first)));
        }
        let mut joined = first.to_vec();
        while joined.last() == Some(&b'\\') {
            joined.pop();
            joined.push(b' ');
            joined.extend_from_slice(self.physical().unwrap_or(&[]));
        }
        Some((line, Cow::Owned(joined)))
    }
}

/// The first word of a line, and what follows it.
fn split_keyword(line: &[u8]) -> (&[u8], &[u8]) {
    let line = line.trim_ascii_start();
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    line.split_at(end)
}

fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// The text up to a `#`, which starts a comment among numbers (in names it is a letter).
fn without_comment(text: &[u8]) -> &[u8] {
    text.iter().position(|&b| b == b'#').map_or(text, |end| &text[..end])
}

/// Whether the word is a number that is finite as `f32`.
fn is_number(word: &[u8]) -> bool {
    // Nearly all are digits and a point, too short to overflow: no need to work out their value here.
    let digits = word.strip_prefix(b"-").unwrap_or(word);
    let points = digits.iter().filter(|&&b| b == b'.').count();
    let is_plain = digits.iter().all(|&b| b.is_ascii_digit() || b == b'.') && points <= 1 && digits.len() > points;
    (is_plain && digits.len() <= 30) || number(word).is_some_and(f32::is_finite)
}

/// The word as `f32`; may be infinite or NaN.
fn number(word: &[u8]) -> Option<f32> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A whole number of at most 18 digits, with sign.
fn index(word: &[u8]) -> Option<i64> {
    let digits = word.strip_prefix(b"-").unwrap_or(word);
    if digits.is_empty() || digits.len() > 18 {
        return None;
    }
    let mut value = 0;
    for &b in digits {
        if !b.is_ascii_digit() {
            return None;
        }
        value = 10 * value + i64::from(b - b'0');
    }
    Some(if digits.len() < word.len() { -value } else { value })
}

/// At most 40 characters of what was found.
fn shorten(text: &str) -> Cow<'_, str> {
    match text.char_indices().nth(40) {
        Some((end, _)) => Cow::Owned(format!("{}…", &text[..end])),
        None => Cow::Borrowed(text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn run<S: Strategy>(strategy: &S, test: impl Fn(S::Value)) {
        let config = ProptestConfig { cases: 2000, failure_persistence: None, ..Default::default() };
        let rng = proptest::test_runner::TestRng::from_seed(proptest::test_runner::RngAlgorithm::ChaCha, &[9; 32]);
        let done = proptest::test_runner::TestRunner::new_with_rng(config, rng).run(strategy, |value| {
            test(value);
            Ok(())
        });
        done.unwrap();
    }

    #[test]
    fn the_quick_look_at_a_number_agrees_with_working_it_out() {
        let trouble = prop_oneof![
            "[-+.0-9eE]{0,9}",
            "-?[0-9]{25,45}(\\.[0-9]{0,3})?",
            "-?(nan|inf|infinity)",
            any::<f32>().prop_map(|x| x.to_string())
        ];
        run(&trouble, |word| {
            let slow = word.parse::<f32>().is_ok_and(f32::is_finite);
            assert_eq!(is_number(word.as_bytes()), slow, "{word:?}");
        });
    }

    #[test]
    fn the_index_reader_agrees_with_the_standard_one() {
        run(&"-?[0-9x]{0,18}", |word| assert_eq!(index(word.as_bytes()), word.parse().ok(), "{word:?}"));
    }

    #[test]
    fn lines_are_counted_as_an_editor_counts_them() {
        let text = b"\xef\xbb\xbfv 1 \\\r\n2 \\\n3\n# a \\\nusemtl b\\\n\nf";
        let found: Vec<(usize, String)> =
            Lines::new(text).map(|(n, line)| (n, String::from_utf8(line.into_owned()).unwrap())).collect();
        let expected = [(1, "v 1  2  3"), (4, "# a \\"), (5, "usemtl b\\"), (6, ""), (7, "f")];
        assert_eq!(found, expected.map(|(n, line)| (n, line.to_owned())));
        assert_eq!(Lines::new(b"f 1 2 \\").count(), 1);
    }

    #[test]
    fn the_text_for_tobj_holds_only_what_it_reads_well() {
        let text = b"o x\nv 0 0 0 .5 .5 .5\nv 1 0 0 2\n\tv 0 1 0 # c\nvt 1\ns off\nf 1 2 3\nf 1/1 2/1 3/1\nl 1 2 3\n";
        let checked = check_obj(text, "a.obj", |_, _| Ok(Vec::new())).unwrap();
        let expected = "v 0 0 0\nv 1 0 0 2\nv 0 1 0\nvt 1 0\ng\nf 1 2 3\ng\nf 1/1 2/1 3/1\n";
        assert_eq!(String::from_utf8(checked.text).unwrap(), expected);
        assert_eq!((checked.first_bare_face, checked.warnings.len()), (Some(7), 1));
    }
}

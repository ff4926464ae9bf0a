//! Points as text, one a line.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use crate::error::{Error, Result};
use crate::stats::Points;

/// Points as CSV: header `x,y`, then a point a line in shortest digits that read back to the same number.
pub fn to_csv(points: &[[f64; 2]]) -> String {
    let mut text = "x,y\n".to_owned();
    for [x, y] in points {
        text += &format!("{x},{y}\n");
    }
    text
}

/// Longest line that is read, in bytes: a million coordinates. What has no line ends is no CSV, and may have no end either.
const LONGEST_LINE: u64 = 1 << 24;

/// Reads points from CSV: commas, an optional header of names, `#` comments, blank lines skipped, one point a line; LF or CR LF,
/// with or without a byte order mark. Line by line: memory is 8 bytes a coordinate.
///
/// # Errors
/// Kind `Input` with the line: a field that is no number (an empty one after a last comma too, and one in quotes), a ragged
/// row, a coordinate outside [0, 1], text that is no UTF-8, a line above 16 MiB; no points at all; a file that cannot be read.
pub fn read_csv(mut text: impl BufRead, source: &str) -> Result<Points> {
    let mut reading = Reading::default();
    let mut line = Vec::new();
    for number in 1_u64.. {
        line.clear();
        let read = text.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line);
        let read = read.map_err(|e| Error::input(source, format!("expected a readable CSV file, found: {e}")))?;
        if read == 0 {
            break;
        }
        let taken = match std::str::from_utf8(&line) {
            _ if read as u64 == LONGEST_LINE && line.last() != Some(&b'\n') => {
                Err(format!("expected a line of less than {LONGEST_LINE} bytes, found a longer one"))
            }
            Err(_) => Err("expected UTF-8 text, found other bytes".to_owned()),
            Ok(line) if number == 1 => reading.take(line.trim_start_matches('\u{feff}')),
            Ok(line) => reading.take(line),
        };
        taken.map_err(|what| Error::input(format!("{source}: line {number}"), what))?;
    }
    Points::new(reading.dimension.unwrap_or(0), reading.coordinates).map_err(|error| Error::input(source, error))
}

/// What has been read of a CSV text.
#[derive(Default)]
struct Reading {
    coordinates: Vec<f64>,
    /// Fields of a line, once there was one.
    dimension: Option<usize>,
}

impl Reading {
    /// Takes a line, or says what is wrong with it.
    fn take(&mut self, line: &str) -> std::result::Result<(), String> {
        let line = line.split('#').next().unwrap_or("").trim();
        if line.is_empty() {
            return Ok(());
        }
        let fields = || line.split(',').map(str::trim);
        let is_first = self.dimension.is_none();
        let expected = *self.dimension.get_or_insert(fields().count());
        // Names, in quotes or not, each begun by a letter: a first point that is misspelt, quoted or bracketed is no header.
        let is_word = |f: &str| f.trim_matches(['"', '\'']).starts_with(|c: char| c.is_alphabetic() || c == '_');
        if is_first && fields().all(|f| f.parse::<f64>().is_err() && is_word(f)) {
            return Ok(());
        }
        let found = fields().count();
        if found != expected {
            return Err(format!("expected {expected} coordinates, found {found}"));
        }
        for field in fields() {
            match field.parse::<f64>() {
                Ok(x) if (0.0..=1.0).contains(&x) => self.coordinates.push(x),
                _ => return Err(format!("expected a number in [0, 1], found \"{field}\"")),
            }
        }
        Ok(())
    }
}

/// Reads a CSV file, see [`read_csv`].
///
/// # Errors
/// Kind `Input` where the file cannot be read, or as [`read_csv`].
pub fn read_csv_file(path: &Path) -> Result<Points> {
    let name = path.display().to_string();
    let file = std::fs::File::open(path)
        .map_err(|e| Error::input(&name, format!("expected a readable CSV file, found: {e}")))?;
    read_csv(BufReader::new(file), &name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Preset, SamplerSpec, point_set};

    fn read(text: &str) -> Result<Points> {
        read_csv(text.as_bytes(), "a.csv")
    }

    #[test]
    fn what_is_written_reads_back_to_the_same_points() {
        let points = point_set(SamplerSpec::parse("halton", Preset::Sheet).unwrap(), 100, 0).unwrap();
        let back = read(&to_csv(&points)).unwrap();
        assert_eq!(back.iter().flatten().copied().collect::<Vec<_>>(), points.concat());
    }

    #[test]
    fn comments_headers_and_other_line_ends_are_read() {
        let text = "# three of them\r\nu, v\r\n0.5 , 0.25\r\n\r\n1,0 # a corner\r\n1e-1,.5\r\n";
        let points = read(text).unwrap();
        assert_eq!((points.n(), points.dimension()), (3, 2));
        assert_eq!(read("0.5\n0.25\n").unwrap().dimension(), 1);
        let marked = read("\u{feff}0.5,0.25\n1,0").unwrap();
        assert_eq!((marked.n(), marked.dimension()), (2, 2));
    }

    #[test]
    fn bad_sets_name_their_line() {
        for (text, needle) in [
            ("", "at least one point"),
            ("x,y\n", "at least one point"),
            ("x,y\n0.5,0.5\n0.5\n", "line 3: expected 2 coordinates, found 1"),
            ("0.1,0.2\n\n0.5,1.5\n", "line 3: expected a number in [0, 1], found \"1.5\""),
            ("nan,0.5\n", "line 1: expected a number in [0, 1], found \"nan\""),
            ("0.1,0.2\ninf,0.5\n", "line 2"),
            ("0.1,\n", "line 1"),
            ("0.1,abc\n", "line 1: expected a number in [0, 1], found \"abc\""),
            ("x,y\na,b\n", "line 2"),
            ("0.1 0.2\n", "line 1: expected a number in [0, 1], found \"0.1 0.2\""),
            ("0,1;0,5\n", "line 1: expected a number in [0, 1], found \"1;0\""),
            ("0.1,0.2,\n0.3,0.4,\n", "line 1: expected a number in [0, 1], found \"\""),
            ("x,y\r\n\r\n# c\r\n0.1,2e0\r\n", "line 4: expected a number in [0, 1], found \"2e0\""),
            ("0.1,0.2\n0.1,0.2,0.3\n", "line 2: expected 2 coordinates, found 3"),
            ("x,y\nx,y\n0.1,0.2\n", "line 2: expected a number in [0, 1], found \"x\""),
            ("x,y,z\n0.1,0.2\n", "line 2: expected 3 coordinates, found 2"),
            // First points that are no headers: each would be lost without a word.
            ("\"0.1\",\"0.2\"\n0.3,0.4\n", "line 1: expected a number in [0, 1], found \"\"0.1\"\""),
            ("(0.1;0.2)\n0.3\n", "line 1: expected a number in [0, 1], found \"(0.1;0.2)\""),
            ("\u{2212}0.1,\u{2212}0.2\n0.3,0.4\n", "line 1: expected a number in [0, 1]"),
            ("$0.1,$0.2\n0.3,0.4\n", "line 1: expected a number in [0, 1]"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.to_string().contains(needle), "{text:?}: {error}");
            assert_eq!(error.exit_code(), 2);
        }
    }

    #[test]
    fn headers_are_names_in_quotes_or_not() {
        for header in ["x,y", "\"x\",\"y\"", "'u 1','v 2'", "_a,θ"] {
            assert_eq!(read(&format!("{header}\n0.1,0.2\n")).unwrap().n(), 1, "{header}");
        }
    }

    #[test]
    fn bytes_that_are_no_text_name_their_line_and_a_line_without_end_is_not_waited_for() {
        let error = read_csv(&b"0.1,0.2\n# caf\xe9\n0.3,0.4\n"[..], "a.csv").unwrap_err();
        assert_eq!(error.to_string(), "a.csv: line 2: expected UTF-8 text, found other bytes");
        let endless = std::io::BufReader::new(std::io::repeat(b'0'));
        let error = read_csv(endless, "a.csv").unwrap_err();
        assert!(error.to_string().starts_with("a.csv: line 1: expected a line of less than"), "{error}");
    }
}

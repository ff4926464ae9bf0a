//! Files of one JSON value a line: whole lines or none, and a torn last one forgiven.

use std::io::ErrorKind;
use std::path::Path;

use serde::Serialize;

use crate::error::{Error, Result};
use crate::film::write_whole;

/// Reads a file of one JSON value a line; the flag says whether the file is exactly its whole lines.
///
/// A last line without an end that does not read was torn and is dropped; one that reads is whole but for its end.
pub fn lines<T>(path: &Path, parse: impl Fn(&str) -> std::result::Result<T, String>) -> Result<(Vec<T>, bool)> {
    let bytes = std::fs::read(path).map_err(|e| unreadable(path, &e))?;
    parsed(path, &bytes, parse)
}

fn unreadable(path: &Path, e: &std::io::Error) -> Error {
    Error::input(path.display(), format!("expected a file of results, found: {e}"))
}

fn parsed<T>(
    path: &Path,
    bytes: &[u8],
    parse: impl Fn(&str) -> std::result::Result<T, String>,
) -> Result<(Vec<T>, bool)> {
    let mut values = Vec::new();
    for (number, bytes) in bytes.split_inclusive(|&byte| byte == b'\n').enumerate() {
        let whole = bytes.ends_with(b"\n");
        let value = std::str::from_utf8(bytes).map_err(|e| e.to_string()).and_then(|text| parse(text.trim_end()));
        match value {
            Ok(value) => values.push(value),
            Err(_) if !whole => {}
            Err(what) => {
                let remedy = "only a last line may be torn; take this line out and its item is done again";
                return Err(Error::input(format!("{}:{}", path.display(), number + 1), format!("{what}; {remedy}")));
            }
        }
    }
    Ok((values, bytes.is_empty() || bytes.ends_with(b"\n")))
}

/// As [`lines`], where a missing file is an empty one.
pub fn lines_if_any<T>(path: &Path, parse: impl Fn(&str) -> std::result::Result<T, String>) -> Result<(Vec<T>, bool)> {
    match std::fs::read(path) {
        Ok(bytes) => parsed(path, &bytes, parse),
        Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Ok((Vec::new(), true)),
        Err(e) => Err(unreadable(path, &e)),
    }
}

/// The lines of a file that read, and what is to be said of the others.
pub struct Sound<T> {
    /// The lines that read.
    pub values: Vec<T>,
    /// Place and fault of each line that does not, but for a torn last one.
    pub unsound: Vec<String>,
    /// Whether the file is exactly its sound lines.
    pub is_clean: bool,
}

/// As [`lines_if_any`], for what may be lost: a line that does not read is left out and named.
///
/// # Errors
/// Kind `Input` where the file is there and cannot be read.
pub fn sound_lines<T>(path: &Path, parse: impl Fn(&str) -> std::result::Result<T, String>) -> Result<Sound<T>> {
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Vec::new(),
        Err(e) => return Err(unreadable(path, &e)),
    };
    let (mut values, mut unsound) = (Vec::new(), Vec::new());
    let mut is_clean = bytes.is_empty() || bytes.ends_with(b"\n");
    for (number, bytes) in bytes.split_inclusive(|&byte| byte == b'\n').enumerate() {
        let text = std::str::from_utf8(bytes).map_err(|e| e.to_string());
        match text.and_then(|text| parse(text.trim_end())) {
            Ok(value) => values.push(value),
            Err(what) => {
                is_clean = false;
                if bytes.ends_with(b"\n") {
                    unsound.push(format!("{}:{}: {what}", path.display(), number + 1));
                }
            }
        }
    }
    Ok(Sound { values, unsound, is_clean })
}

/// Writes a file of one JSON value a line, whole or not at all; not touched where it would not change.
pub fn write_lines<'a, T: Serialize + 'a>(path: &Path, values: impl Iterator<Item = &'a T>) -> Result<()> {
    let mut text = String::new();
    for value in values {
        text.push_str(&line(value));
        text.push('\n');
    }
    write_if_changed(path, text.as_bytes())
}

/// Writes `bytes` whole or not at all; a file that has them already keeps its time of change.
pub fn write_if_changed(path: &Path, bytes: &[u8]) -> Result<()> {
    if std::fs::read(path).is_ok_and(|old| old == bytes) { Ok(()) } else { write_whole(path, bytes) }
}

/// One value as one line of JSON.
pub fn line(value: &impl Serialize) -> String {
    // Rows are plain structs with text keys: nothing in them can fail to serialise.
    serde_json::to_string(value).expect("a row serialises")
}

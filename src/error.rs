//! One error type for everything that files and people can get wrong.
//!
//! A message reads `place: expected …, found …`; the kind decides the exit code.

use std::fmt;
use std::path::Path;

/// What went wrong, as the exit code tells it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorKind {
    /// A gate or test failed, and all went well otherwise: exit code 1.
    Failed,
    /// Bad input or usage: exit code 2.
    Input,
    /// An output could not be written: exit code 3.
    Write,
    /// Work is missing or failed; what exists is reported: exit code 4.
    Incomplete,
    /// Told to end before the work was done; nothing is lost and the same command goes on: exit code 130.
    Interrupted,
}

/// Where something went wrong, and what was expected and found there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error {
    /// Kind, which decides the exit code.
    pub kind: ErrorKind,
    /// File, field, line or option.
    pub place: String,
    /// What was expected and what was found.
    pub what: String,
}

/// `std::result::Result` with [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// A gate or test at `place` that failed.
    pub fn failed(place: impl fmt::Display, what: impl fmt::Display) -> Self {
        Self { kind: ErrorKind::Failed, place: place.to_string(), what: what.to_string() }
    }

    /// Bad input at `place`.
    pub fn input(place: impl fmt::Display, what: impl fmt::Display) -> Self {
        Self { kind: ErrorKind::Input, place: place.to_string(), what: what.to_string() }
    }

    /// An output that could not be written.
    pub fn write(path: &Path, what: impl fmt::Display) -> Self {
        Self { kind: ErrorKind::Write, place: path.display().to_string(), what: what.to_string() }
    }

    /// Work that is missing or failed.
    pub fn incomplete(place: impl fmt::Display, what: impl fmt::Display) -> Self {
        Self { kind: ErrorKind::Incomplete, place: place.to_string(), what: what.to_string() }
    }

    /// Work that was told to end early.
    pub fn interrupted(place: impl fmt::Display, what: impl fmt::Display) -> Self {
        Self { kind: ErrorKind::Interrupted, place: place.to_string(), what: what.to_string() }
    }

    /// The process exit code of this kind of error: 1 to 4, or 130.
    pub fn exit_code(&self) -> u8 {
        match self.kind {
            ErrorKind::Failed => 1,
            ErrorKind::Input => 2,
            ErrorKind::Write => 3,
            ErrorKind::Incomplete => 4,
            ErrorKind::Interrupted => 130,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.what)
    }
}

impl std::error::Error for Error {}

/// The candidate nearest to `found` by edit distance, capitals aside, where it is near enough to be a misspelling.
pub fn did_you_mean<'a>(found: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    candidates
        .into_iter()
        .map(|c| (edit_distance(&found.to_lowercase(), &c.to_lowercase()), c))
        .filter(|&(d, c)| d <= 1 + c.len().min(found.len()) / 3)
        .min_by_key(|&(d, _)| d)
        .map(|(_, c)| c)
}

/// Levenshtein distance in characters.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &cb) in b.iter().enumerate() {
            let substitute = diagonal + usize::from(ca != cb);
            diagonal = row[j + 1];
            row[j + 1] = substitute.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_key_is_suggested_and_a_strange_one_is_not() {
        assert_eq!(did_you_mean("lens_radus", ["fov", "lens_radius"]), Some("lens_radius"));
        assert_eq!(did_you_mean("FOV", ["fov", "lens_radius"]), Some("fov"));
        assert_eq!(did_you_mean("banana", ["fov", "lens_radius"]), None);
    }
}

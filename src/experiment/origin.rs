//! Where the experiment file of a folder is: a name for the record, which no spelling and no machine changes, and the way
//! there from the folder, which is this machine's own and stands in `origin.json`.

use std::path::{Component, Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::lines::{line, write_if_changed};
use crate::error::Result;

/// Where scenes and experiments are kept in a repository.
const CONFIGS: &str = "configs";

/// The name of an experiment file in records: from the folder `configs` on that it is in, else its file name. The same
/// however the path is written and wherever the repository is; `/` between the parts.
pub fn recorded_name(file: &Path) -> String {
    let whole = file.canonicalize().unwrap_or_else(|_| file.to_owned());
    let parts: Vec<String> = whole.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
    let from = parts.iter().rposition(|part| part == CONFIGS).unwrap_or(parts.len().saturating_sub(1));
    parts[from..].join("/")
}

/// `text` as one word of a shell's command line: bare where it is one, else between quotes.
pub fn shell_word(text: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "_-./=:,@%+".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        return text.to_owned();
    }
    format!("'{}'", text.replace('\'', r"'\''"))
}

/// The way from a folder of results to what it was made from. No part of the results: two machines have two.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Origin {
    /// The experiment file.
    pub file: PathBuf,
    /// Other folders in which mesh files were looked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub data: Vec<PathBuf>,
}

fn origin_path(out: &Path) -> PathBuf {
    out.join("origin.json")
}

impl Origin {
    /// Writes it down, each path as the way from `out`.
    ///
    /// # Errors
    /// Kind `Write`.
    pub fn write(&self, out: &Path) -> Result<()> {
        let data = self.data.iter().map(|folder| way(out, folder)).collect();
        let ways = Self { file: way(out, &self.file), data };
        write_if_changed(&origin_path(out), (line(&ways) + "\n").as_bytes())
    }

    /// What a folder says of it, from the working folder; none where it does not say. It is a help to find things, so one
    /// that does not read says nothing.
    pub fn read(out: &Path) -> Option<Self> {
        let ways: Self = serde_json::from_slice(&std::fs::read(origin_path(out)).ok()?).ok()?;
        let data = ways.data.iter().map(|folder| from_here(&out.join(folder))).collect();
        Some(Self { file: from_here(&out.join(ways.file)), data })
    }
}

/// The experiment file of a folder whose record calls it `name`: where its origin leads, else below the working folder
/// or a folder around the results; none where it is in none of them.
pub fn locate(out: &Path, name: &str) -> Option<PathBuf> {
    let around = out.canonicalize().unwrap_or_default();
    let origin = Origin::read(out).map(|origin| origin.file);
    let places =
        origin.into_iter().chain([PathBuf::from(name)]).chain(around.ancestors().skip(1).map(|at| at.join(name)));
    places.into_iter().find(|path| path.is_file()).map(|path| from_here(&path))
}

/// The way from one folder to a path, without links; the whole path where there is none.
fn way(from: &Path, to: &Path) -> PathBuf {
    let (Ok(from), Ok(to)) = (from.canonicalize(), to.canonicalize()) else { return to.to_owned() };
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let up = from.components().skip(shared).map(|_| Component::ParentDir);
    up.chain(to.components().skip(shared)).collect()
}

/// A path as somebody in the working folder would write it: short where it is below, else whole.
fn from_here(path: &Path) -> PathBuf {
    let Ok(whole) = path.canonicalize() else { return path.to_owned() };
    let here = std::env::current_dir().and_then(|here| here.canonicalize()).unwrap_or_default();
    match whole.strip_prefix(&here) {
        Ok(below) if !below.as_os_str().is_empty() => below.to_owned(),
        _ => whole,
    }
}

//! The output folder as a thing that one process at a time writes to, and what a kill may have left in it.

use std::collections::HashSet;
use std::fs::File;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::identity::ID_LENGTH;
use super::lines::{line, write_if_changed, write_lines};
use super::plan::Plan;
use super::results::{self, About, SCHEMA, Source};
use super::shards::Shard;
use super::superseded::{self, superseded_path};
use super::survey::Standing;
use crate::error::{Error, Result};

/// The right to write to a folder, as long as it is held. The system lets go of it with the process.
#[derive(Debug)]
pub struct FolderLock {
    _file: File,
}

/// What two processes in one folder would do is tear each other's lines.
fn busy(out: &Path) -> Error {
    Error::input(
        out.display(),
        "expected no other process writing to this folder, found one at work; wait for it or give another --out",
    )
}

impl FolderLock {
    /// Takes the folder, which is made where it is not there, and removes what a killed process left half-written.
    ///
    /// # Errors
    /// Kind `Input` where another process has it, kind `Write` where nothing can be written.
    pub fn take(out: &Path) -> Result<Self> {
        let path = out.join(".lock");
        let fail = |e: std::io::Error| Error::write(&path, format!("cannot write: {e}"));
        std::fs::create_dir_all(out).map_err(fail)?;
        let file = File::create(&path).map_err(fail)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(std::fs::TryLockError::WouldBlock) => return Err(busy(out)),
            Err(std::fs::TryLockError::Error(e)) => return Err(fail(e)),
        }
        sweep(out);
        Ok(Self { _file: file })
    }

    /// Keeps others from writing to a folder that is read, where anybody ever wrote to it; needs no right to write.
    ///
    /// # Errors
    /// Kind `Input` where another process is writing there.
    pub fn share(folder: &Path) -> Result<Option<Self>> {
        let Ok(file) = File::open(folder.join(".lock")) else { return Ok(None) };
        match file.try_lock_shared() {
            Err(std::fs::TryLockError::WouldBlock) => Err(busy(folder)),
            // Where locks are not to be had there is nothing to respect.
            Ok(()) | Err(std::fs::TryLockError::Error(_)) => Ok(Some(Self { _file: file })),
        }
    }
}

/// Removes temporary files of [`write_whole`](crate::film::write_whole). Whoever holds the lock is the only one to
/// write here, so they are those of processes that ended in the middle.
fn sweep(out: &Path) {
    let images = out.join("images");
    for folder in [out.to_owned(), out.join("figures"), images.join("flip"), images] {
        let Ok(entries) = std::fs::read_dir(folder) else { continue };
        for path in entries.filter_map(|entry| Some(entry.ok()?.path())) {
            let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            let process = name.strip_suffix(".partial").and_then(|name| name.rsplit_once('.')).map(|(_, id)| id);
            if process.is_some_and(|id| !id.is_empty() && id.bytes().all(|b| b.is_ascii_digit())) {
                // Best effort: a leftover does no harm.
                let _ = std::fs::remove_file(path);
            }
        }
    }
}

/// A folder keeps the results of one experiment: it may grow or change, but another's rows are not put aside for it.
///
/// # Errors
/// Kind `Input` where the folder is another experiment's.
pub fn refuse_another_experiment(plan: &Plan, out: &Path) -> Result<()> {
    let path = results::about_path(out);
    if !path.exists() {
        return Ok(());
    }
    let (there, wanted) = (results::read_about(&path)?.experiment, &plan.experiment);
    if (&there.name, there.seed) == (&wanted.name, wanted.seed) {
        return Ok(());
    }
    let what = format!(
        "expected results of the experiment {:?} with seed {}, found those of {:?} with seed {}; give another --out, or --fresh to do away with them",
        wanted.name, wanted.seed, there.name, there.seed
    );
    Err(Error::input(path.display(), what))
}

/// What is in a folder is only forgotten where it is results: files of others are not ours to remove.
///
/// # Errors
/// Kind `Input` where there is something and no `experiment.json` of ours.
pub fn refuse_to_forget(out: &Path) -> Result<()> {
    let path = results::about_path(out);
    if path.exists() {
        return results::read_about(&path).map(|_| ());
    }
    let names = std::fs::read_dir(out).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.file_name()));
    match names.map(|name| name.to_string_lossy().into_owned()).filter(|name| name != ".lock").min() {
        None => Ok(()),
        Some(name) => {
            let what = format!(
                "expected results to forget, with their experiment.json, or an empty folder, found {name}; give another --out, or leave out --fresh"
            );
            Err(Error::input(out.display(), what))
        }
    }
}

/// Removes the report, which is about the rows that were there: `report` writes one of those that are there at any time.
///
/// # Errors
/// Kind `Write` where something cannot be removed.
pub fn remove_report(out: &Path) -> Result<()> {
    let names = ["report.md", "report.html", "summary.csv", "slopes.csv", "stability.csv"];
    remove(names.iter().map(|name| out.join(name)))
}

fn remove(paths: impl Iterator<Item = PathBuf>) -> Result<()> {
    for path in paths.filter(|path| path.exists()) {
        std::fs::remove_file(&path).map_err(|e| Error::write(&path, format!("cannot remove: {e}")))?;
    }
    Ok(())
}

/// Whether a name is that of an image which a run writes: of an item, or of a reference.
fn is_image_of_ours(name: &str) -> bool {
    let Some(stem) = name.strip_suffix(".exr") else { return false };
    let is_id = stem.len() == ID_LENGTH && stem.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'));
    is_id || (stem.starts_with("reference-") && ["-A", "-B", "-exact"].iter().any(|part| stem.ends_with(part)))
}

/// Removes what earlier runs left of the items at `part` of the plan – rows, timings, images, also those put aside –
/// and the report.
///
/// # Errors
/// Kind `Input` where rows do not read, kind `Write` where something cannot be written or removed.
pub fn forget_part(plan: &Plan, out: &Path, part: Range<usize>) -> Result<()> {
    let standing = Standing::read(plan, out)?;
    let ids: HashSet<&str> = plan.items[part].iter().map(|item| item.id.as_str()).collect();
    remove_report(out)?;
    superseded::forget(out, &ids)?;
    let rows = standing.in_file.iter().filter(|row| !ids.contains(row.id()));
    write_lines(&results::results_path(out), rows)?;
    let mut timings: Vec<_> = standing.timings.values().filter(|timing| !ids.contains(timing.id.as_str())).collect();
    timings.sort_by(|a, b| a.id.cmp(&b.id));
    write_lines(&results::timings_path(out), timings.into_iter())?;
    remove(ids.iter().map(|id| results::image_path(out, id)))
}

/// Removes the rows, timings, images and the report of earlier runs, and nothing else.
///
/// # Errors
/// Kind `Write` where something cannot be removed.
pub fn forget(out: &Path) -> Result<()> {
    let fail = |path: &Path, e: std::io::Error| Error::write(path, format!("cannot remove: {e}"));
    remove_report(out)?;
    let mut paths = vec![results::results_path(out), results::timings_path(out), superseded_path(out), note_path(out)];
    let images = out.join("images");
    if images.is_dir() {
        for entry in std::fs::read_dir(&images).map_err(|e| fail(&images, e))? {
            let path = entry.map_err(|e| fail(&images, e))?.path();
            if path.file_name().is_some_and(|name| is_image_of_ours(&name.to_string_lossy())) {
                paths.push(path);
            }
        }
    }
    remove(paths.into_iter())
}

/// Writes down what is run here.
///
/// # Errors
/// Kind `Write`.
pub fn write_about(plan: &Plan, out: &Path, command: &str, source: Option<&Source>) -> Result<()> {
    let about = About {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        command: command.to_owned(),
        experiment: plan.experiment.clone(),
        scenes: plan.scenes.clone(),
        notes: plan.notes.clone(),
        left_out: plan.left_out.clone(),
        source: source.cloned(),
        algorithms: Some(plan.algorithms),
    };
    let path = results::about_path(out);
    let mut text = serde_json::to_string_pretty(&about).map_err(|e| Error::write(&path, e))?;
    text.push('\n');
    if std::fs::read(&path).is_ok_and(|old| old != text.as_bytes()) {
        remove_report(out)?;
    }
    write_if_changed(&path, text.as_bytes())
}

/// Into how many shards an incomplete folder's experiment was cut: kept while something is missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShardNote {
    /// Number of shards.
    pub count: u32,
}

fn note_path(out: &Path) -> PathBuf {
    out.join("shards.json")
}

/// Reads the note; none where the folder is whole or was never sharded.
///
/// # Errors
/// Kind `Input` where it does not read.
pub fn read_note(out: &Path) -> Result<Option<ShardNote>> {
    let path = note_path(out);
    if !path.exists() {
        return Ok(None);
    }
    let bad = |e: &dyn std::fmt::Display| {
        Error::input(
            path.display(),
            format!("expected {{\"count\": N}}, the number of shards, found: {e}; take the file out"),
        )
    };
    let note: ShardNote = serde_json::from_slice(&std::fs::read(&path).map_err(|e| bad(&e))?).map_err(|e| bad(&e))?;
    if (1..=Shard::MOST).contains(&note.count) { Ok(Some(note)) } else { Err(bad(&note.count)) }
}

/// Writes the note, or takes it out where there is none to keep.
///
/// # Errors
/// Kind `Write`.
pub fn write_note(out: &Path, note: Option<ShardNote>) -> Result<()> {
    let path = note_path(out);
    match note {
        Some(note) => write_if_changed(&path, (line(&note) + "\n").as_bytes()),
        None if path.exists() => {
            std::fs::remove_file(&path).map_err(|e| Error::write(&path, format!("cannot remove: {e}")))
        }
        None => Ok(()),
    }
}

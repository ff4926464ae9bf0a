//! Rows and timings that no longer belong to the plan: put aside, never thrown away.
//!
//! A scene was edited, an algorithm number raised, a sampler taken out of the experiment. The rows of before go to
//! `superseded.jsonl`, out of every report's sight, and come back when the change is undone. Its lines are
//! `{"row": …}` and `{"timing": …}`; a line that this version cannot read is kept as it is.

use std::collections::{HashMap, HashSet};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::lines::{line, write_if_changed, write_lines};
use super::plan::Plan;
use super::results::{self, Kind, Row, Timing};
use super::survey::{Standing, is_result_of, is_unwanted};
use crate::error::{Error, Result};

/// Where they are.
pub fn superseded_path(out: &Path) -> PathBuf {
    out.join("superseded.jsonl")
}

/// A line as it is written.
#[derive(Serialize)]
#[serde(rename_all = "lowercase")]
enum Line<'a> {
    Row(&'a Row),
    Timing(&'a Timing),
}

/// A line as it is read.
#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Raw {
    Row(serde_json::Value),
    Timing(Timing),
}

/// The file's lines, each once.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Superseded {
    lines: Vec<String>,
}

impl Superseded {
    /// Reads the file; none is an empty one.
    ///
    /// # Errors
    /// Kind `Input` where it is there and cannot be read.
    pub fn read(out: &Path) -> Result<Self> {
        let path = superseded_path(out);
        match std::fs::read_to_string(&path) {
            Ok(text) => Ok(Self { lines: text.lines().map(str::to_owned).collect() }),
            Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Ok(Self::default()),
            Err(e) => Err(Error::input(path.display(), format!("expected rows that were put aside, found: {e}"))),
        }
    }

    /// The rows among them, the last put aside first, each with its line's number.
    pub fn rows(&self) -> Vec<(usize, Row)> {
        let row = |(number, text): (usize, &String)| match serde_json::from_str(text) {
            Ok(Raw::Row(value)) => Some((number, Row::parse(&value.to_string()).ok()?)),
            _ => None,
        };
        self.lines.iter().enumerate().rev().filter_map(row).collect()
    }

    /// The timings among them, likewise.
    fn timings(&self) -> Vec<(usize, Timing)> {
        let timing = |(number, text): (usize, &String)| match serde_json::from_str(text) {
            Ok(Raw::Timing(timing)) => Some((number, timing)),
            _ => None,
        };
        self.lines.iter().enumerate().rev().filter_map(timing).collect()
    }

    /// Puts a line last.
    fn add(&mut self, new: &Line) {
        let text = line(new);
        self.lines.retain(|old| *old != text);
        self.lines.push(text);
    }

    /// The file whole, or gone where nothing is put aside.
    fn write(&self, out: &Path) -> Result<()> {
        let path = superseded_path(out);
        if self.lines.is_empty() {
            return match std::fs::remove_file(&path) {
                Err(e) if e.kind() != ErrorKind::NotFound => Err(Error::write(&path, format!("cannot remove: {e}"))),
                _ => Ok(()),
            };
        }
        write_if_changed(&path, (self.lines.join("\n") + "\n").as_bytes())
    }
}

/// Puts rows aside that the folder's own file is about to do without.
///
/// # Errors
/// As [`settle`].
pub fn put_aside<'r>(out: &Path, rows: impl Iterator<Item = &'r Row>) -> Result<()> {
    let mut rows = rows.peekable();
    if rows.peek().is_none() {
        return Ok(());
    }
    let mut superseded = Superseded::read(out)?;
    rows.for_each(|row| superseded.add(&Line::Row(row)));
    superseded.write(out)
}

/// What was put aside and what came back.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Settled {
    /// Rows that were put aside, in the order of the file.
    pub aside: Vec<Row>,
    /// Number of rows that came back.
    pub back: usize,
}

/// Leaves in `results.jsonl` and `timings.jsonl` whole lines of this plan alone: what no longer belongs to it is put aside, what
/// belongs to it again comes back.
///
/// The rows are in both files for a moment, and in none at no time.
///
/// # Errors
/// Kind `Input` where rows put aside cannot be read, kind `Write`.
pub fn settle(plan: &Plan, out: &Path, standing: &Standing) -> Result<Settled> {
    let mut put_aside = Superseded::read(out)?;
    let is_result = |row: &Row| plan.position(row.id()).is_some_and(|at| is_result_of(row, &plan.items[at]));
    // How far references grew, by their rows here and aside: a batch beyond that belongs to the plan and not to its results.
    let aside_rows: Vec<Row> = put_aside.rows().into_iter().map(|(_, row)| row).collect();
    let references = aside_rows.iter().chain(&standing.in_file).filter(|row| row.kind() == Kind::Reference);
    let references: HashMap<String, Row> =
        references.filter(|row| is_result(row)).map(|row| (row.id().to_owned(), row.clone())).collect();
    let is_unwanted =
        |row: &Row| plan.position(row.id()).is_some_and(|at| is_unwanted(plan, &references, &plan.items[at]));
    let fits = |row: &Row| is_result(row) && !is_unwanted(row);
    let (mut rows, aside): (Vec<Row>, Vec<Row>) = standing.in_file.iter().cloned().partition(fits);
    let (mut timings, old_timings): (Vec<&Timing>, Vec<&Timing>) =
        sorted(standing).into_iter().partition(|timing| plan.position(&timing.id).is_some());
    let mut ids: HashSet<String> = rows.iter().map(|row| row.id().to_owned()).collect();
    let mut taken: HashSet<usize> = HashSet::new();
    for (number, row) in put_aside.rows() {
        if fits(&row) && ids.insert(row.id().to_owned()) {
            rows.push(row);
            taken.insert(number);
        }
    }
    let back = taken.len();
    let mut ids: HashSet<String> = timings.iter().map(|timing| timing.id.clone()).collect();
    let found = put_aside.timings();
    for (number, timing) in &found {
        if plan.position(&timing.id).is_some() && ids.insert(timing.id.clone()) {
            timings.push(timing);
            taken.insert(*number);
        }
    }
    if standing.is_clean && aside.is_empty() && old_timings.is_empty() && taken.is_empty() {
        return Ok(Settled::default());
    }
    let stays: Vec<String> =
        put_aside.lines.iter().enumerate().filter(|(n, _)| !taken.contains(n)).map(|(_, text)| text.clone()).collect();
    let mut stays = Superseded { lines: stays };
    for list in [&mut put_aside, &mut stays] {
        aside.iter().for_each(|row| list.add(&Line::Row(row)));
        old_timings.iter().for_each(|timing| list.add(&Line::Timing(timing)));
    }
    put_aside.write(out)?;
    write_lines(&results::results_path(out), rows.iter())?;
    write_lines(&results::timings_path(out), timings.into_iter())?;
    stays.write(out)?;
    Ok(Settled { aside, back })
}

/// Timings in an order of their own.
fn sorted(standing: &Standing) -> Vec<&Timing> {
    let mut sorted: Vec<&Timing> = standing.timings.values().collect();
    sorted.sort_by(|a, b| a.id.cmp(&b.id));
    sorted
}

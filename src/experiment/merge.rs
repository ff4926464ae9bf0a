//! Joins the folders of shards, in any order, to the bytes of the run that was not cut. Renders nothing, opens no scene.

use std::collections::HashMap;
use std::fmt::Display;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::execute::write_in_plan_order;
use super::folder::{self, FolderLock, ShardNote};
use super::images::stored;
use super::origin::Origin;
use super::plan::{Plan, Work};
use super::results::{self, About, Row, SceneFacts, Timing, read_image_at};
use super::status::Status;
use super::superseded;
use super::survey::{Standing, is_result_of};
use crate::error::{Error, Result};
use crate::film::write_whole;

/// Folders that hold results of one experiment, none of which is being written to.
#[derive(Debug)]
pub struct Sources {
    folders: Vec<PathBuf>,
    out: PathBuf,
    about: About,
    /// Into how many shards the experiment was cut, where a folder says so.
    shards: Option<u32>,
    lock: FolderLock,
    made: Made,
    _shared: Vec<Option<FolderLock>>,
}

/// A folder that was made for a merge: gone again where nothing comes of it.
#[derive(Debug)]
struct Made(Option<PathBuf>);

impl Drop for Made {
    fn drop(&mut self) {
        if let Some(out) = &self.0 {
            // Best effort: a folder that something is in stays.
            let _ = std::fs::remove_file(out.join(".lock"));
            let _ = std::fs::remove_dir(out);
        }
    }
}

/// What came of a merge.
#[derive(Debug)]
pub struct Merged {
    /// How far the joined folder is.
    pub status: Status,
    /// Images that were copied.
    pub images: usize,
    /// The folder stays locked until this is dropped.
    pub lock: FolderLock,
}

impl Sources {
    /// Opens the folders. What `out` holds of an earlier merge counts as one of them, whether it is named or not.
    ///
    /// # Errors
    /// Kind `Input` where a folder holds no results, those of another experiment, other scenes or other algorithm numbers, or
    /// is being written to; kind `Write` where `out` cannot be written.
    pub fn open(folders: &[PathBuf], out: &Path) -> Result<Self> {
        let is_out = |folder: &Path| match (folder.canonicalize(), out.canonicalize()) {
            (Ok(a), Ok(b)) => a == b,
            _ => folder == out,
        };
        let others = folders.iter().filter(|folder| !is_out(folder)).cloned();
        let mut all: Vec<PathBuf> = others.collect();
        if folders.iter().any(|folder| is_out(folder)) || results::about_path(out).exists() {
            all.push(out.to_owned());
        }
        let abouts: Vec<About> =
            all.iter().map(|folder| results::read_about(&results::about_path(folder))).collect::<Result<_>>()?;
        let Some((about, rest)) = abouts.split_first() else {
            return Err(Error::input("merge", "expected folders with results, found none"));
        };
        for (folder, other) in all[1..].iter().zip(rest) {
            refuse_difference((&all[0], about), (folder, other))?;
        }
        let notes: Vec<Option<ShardNote>> =
            all.iter().map(|folder| folder::read_note(folder)).collect::<Result<_>>()?;
        let shared = all.iter().filter(|folder| !is_out(folder)).map(|folder| FolderLock::share(folder));
        let shared = shared.collect::<Result<_>>()?;
        // What may differ – the version, what an earlier one wrote – is the same one's whatever the order.
        let about = abouts.iter().min_by_key(super::lines::line).unwrap_or(about).clone();
        let made = Made((!out.exists()).then(|| out.to_owned()));
        Ok(Self {
            out: out.to_owned(),
            about,
            made,
            shards: notes.iter().flatten().map(|note| note.count).max(),
            lock: FolderLock::take(out)?,
            _shared: shared,
            folders: all,
        })
    }

    /// What was run in all of them.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// Writes the union of the rows of `plan`, its timings and the images that a report shows.
    ///
    /// # Errors
    /// Kind `Input` where two folders say different things of one item, or the results were made by code of other algorithm
    /// numbers than the plan; kind `Write`.
    pub fn merge(self, plan: &Plan) -> Result<Merged> {
        let Self { folders, out, about, shards, lock, mut made, .. } = self;
        refuse_other_algorithms(plan, &about, &folders[0])?;
        let standings: Vec<Standing> =
            folders.iter().map(|folder| Standing::read(plan, folder)).collect::<Result<_>>()?;
        let rows = union_of_rows(plan, &folders, &standings)?;
        let timings = union_of_timings(plan, &standings);
        if folders.contains(&out) {
            superseded::settle(plan, &out, &Standing::read(plan, &out)?)?;
        }
        let images = carry_images(plan, &folders, &out, &rows)? + carry_references(plan, &folders, &out, &rows)?;
        made.0 = None;
        folder::remove_report(&out)?;
        folder::write_about(plan, &out, &about.command, about.source.as_ref())?;
        if let Some(origin) = folders.iter().find_map(|folder| Origin::read(folder)) {
            origin.write(&out)?;
        }
        folder::write_note(&out, shards.map(|count| ShardNote { count }))?;
        write_in_plan_order(plan, &out, &rows, &timings)?;
        let status = Status::read(plan, &out)?;
        if status.done == status.items {
            folder::write_note(&out, None)?;
        }
        Ok(Merged { status, images, lock })
    }
}

/// Results of two experiments are not to be joined.
fn refuse_difference((a, about_a): (&Path, &About), (b, about_b): (&Path, &About)) -> Result<()> {
    let differ = |what: &str, in_a: &dyn Display, in_b: &dyn Display| {
        let what = format!(
            "expected results of the same experiment as in {}, found another {what}: {in_a} there, {in_b} here",
            a.display()
        );
        Err(Error::input(b.display(), what))
    };
    let json = |about: &About| serde_json::to_value(&about.experiment).unwrap_or_default();
    if let Some((key, in_a, in_b)) = first_difference(&json(about_a), &json(about_b)) {
        return differ(&key, &in_a, &in_b);
    }
    let scene =
        |facts: &SceneFacts| format!("{} with content {}", facts.name, results::short_hash(&facts.content_hash));
    for (in_a, in_b) in about_a.scenes.iter().zip(&about_b.scenes) {
        if (&in_a.name, &in_a.content_hash) != (&in_b.name, &in_b.content_hash) {
            return differ("scene", &scene(in_a), &scene(in_b));
        }
    }
    let json = |about: &About| serde_json::to_value(about.algorithms).unwrap_or_default();
    if let Some((key, in_a, in_b)) = first_difference(&json(about_a), &json(about_b)) {
        return differ(&format!("algorithm number of the {key}"), &in_a, &in_b);
    }
    Ok(())
}

/// The first key whose values differ.
fn first_difference(a: &Value, b: &Value) -> Option<(String, Value, Value)> {
    let (Value::Object(a), Value::Object(b)) = (a, b) else {
        return (a != b).then(|| ("kind".to_owned(), a.clone(), b.clone()));
    };
    let keys = a.keys().chain(b.keys().filter(|key| !a.contains_key(*key)));
    let value = |of: &serde_json::Map<String, Value>, key: &String| of.get(key).cloned().unwrap_or_default();
    keys.map(|key| (key.clone(), value(a, key), value(b, key))).find(|(_, a, b)| a != b)
}

/// Rows of other code would only be found missing, which says less.
fn refuse_other_algorithms(plan: &Plan, about: &About, folder: &Path) -> Result<()> {
    let Some(theirs) = about.algorithms else { return Ok(()) };
    let json = |numbers| serde_json::to_value(numbers).unwrap_or_default();
    match first_difference(&json(plan.algorithms), &json(theirs)) {
        None => Ok(()),
        Some((key, ours, theirs)) => {
            let what = format!(
                "expected results of this version's algorithm numbers, found {theirs} for the {key}, which is {ours} here; merge with the version that made them, or run again"
            );
            Err(Error::input(folder.display(), what))
        }
    }
}

/// Every row of the plan that some folder has; two folders that have one have to agree on it.
fn union_of_rows(plan: &Plan, folders: &[PathBuf], standings: &[Standing]) -> Result<HashMap<String, Row>> {
    let mut rows: HashMap<String, (usize, Row)> = HashMap::new();
    for (source, standing) in standings.iter().enumerate() {
        for item in &plan.items {
            let Some(row) = standing.rows.get(&item.id).filter(|row| is_result_of(row, item)) else { continue };
            let row = plan.as_written(item, row.clone());
            match rows.get(&item.id) {
                None => {
                    rows.insert(item.id.clone(), (source, row));
                }
                Some((first, known)) if *known != row => {
                    let json = |row: &Row| serde_json::to_value(row).unwrap_or_default();
                    let (key, there, here) = first_difference(&json(known), &json(&row)).unwrap_or_default();
                    let what = format!(
                        "expected of the item {}, {}, what {} has, {key} = {there}, found {key} = {here}; one of the two was not made by this experiment's code",
                        item.id,
                        item.label(),
                        results::results_path(&folders[*first]).display()
                    );
                    return Err(Error::input(results::results_path(&folders[source]).display(), what));
                }
                Some(_) => {}
            }
        }
    }
    Ok(rows.into_iter().map(|(id, (_, row))| (id, row)).collect())
}

/// Of an image that several shards made for themselves, the time of one that owns it counts, and the least of equals: the
/// order of the folders does not matter.
fn union_of_timings(plan: &Plan, standings: &[Standing]) -> HashMap<String, Timing> {
    let mut timings = HashMap::new();
    for item in &plan.items {
        let with =
            |standing: &Standing| Some((standing.rows.contains_key(&item.id), standing.timings.get(&item.id)?.clone()));
        let rank = |(owns, timing): &(bool, Timing)| (!owns, timing.seconds, super::lines::line(timing));
        let found = standings.iter().filter_map(with).min_by(|a, b| {
            let (a, b) = (rank(a), rank(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2))
        });
        if let Some((_, timing)) = found {
            timings.insert(item.id.clone(), timing);
        }
    }
    timings
}

/// Copies, whole, the references as images of their own ([`results::reference_path`]).
fn carry_references(plan: &Plan, folders: &[PathBuf], out: &Path, rows: &HashMap<String, Row>) -> Result<usize> {
    let mut copied = 0;
    for item in plan.items.iter().filter(|item| rows.contains_key(&item.id)) {
        let Work::Reference(work) = &item.work else { continue };
        for part in work.source.parts() {
            let path = |folder: &Path| results::reference_path(folder, &work.scene, item.is_shown, part);
            let is_in = |folder: &Path| read_image_at(&path(folder), &item.id, None).is_ok();
            if let Some(folder) = folders.iter().find(|folder| is_in(folder)).filter(|_| !is_in(out)) {
                copy_whole(&path(folder), &path(out))?;
                copied += 1;
            }
        }
    }
    Ok(copied)
}

fn copy_whole(from: &Path, to: &Path) -> Result<()> {
    let bytes = std::fs::read(from).map_err(|e| Error::input(from.display(), format!("cannot read: {e}")))?;
    write_whole(to, &bytes)
}

/// Copies, whole, the images that a report shows from wherever they prove to be the ones that were written.
fn carry_images(plan: &Plan, folders: &[PathBuf], out: &Path, rows: &HashMap<String, Row>) -> Result<usize> {
    let mut copied = 0;
    for item in plan.items.iter().filter(|item| item.is_shown) {
        let (Some(size), Some(row)) = (item.kept_image(), rows.get(&item.id)) else { continue };
        let is_in = |folder: &Path| stored(folder, &item.id, size, row.kept_pixels()).is_some();
        if is_in(out) {
            continue;
        }
        let Some(folder) = folders.iter().find(|folder| is_in(folder)) else { continue };
        copy_whole(&results::image_path(folder, &item.id), &results::image_path(out, &item.id))?;
        copied += 1;
    }
    Ok(copied)
}

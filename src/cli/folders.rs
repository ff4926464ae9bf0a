//! `report`, `status` and `merge`: what is done with folders of results, without rendering.

use std::path::{Path, PathBuf};

use clap::Args;
use sampler_lab::error::Result;
use sampler_lab::experiment::folder::FolderLock;
use sampler_lab::experiment::lab::Lab;
use sampler_lab::experiment::merge::Sources;
use sampler_lab::experiment::origin::{Origin, locate, shell_word};
use sampler_lab::experiment::plan::{Plan, plan};
use sampler_lab::experiment::results::{About, about_path, read_about};
use sampler_lab::experiment::spec::Experiment;
use sampler_lab::experiment::status::{Missing, Status as Standing};
use sampler_lab::experiment::why::Reason;
use sampler_lab::report;
use sampler_lab::scene::load::OpenOptions;
use serde_json::{Value, json};

use super::{print, print_json, say};

/// Arguments of `report`.
#[derive(Args)]
pub struct Report {
    /// Results folder, such as reports/assignment-4
    folder: PathBuf,
    /// Say nothing but errors on stderr
    #[arg(long, short)]
    quiet: bool,
}

impl Report {
    /// Rewrites the report.
    pub fn run(self) -> Result<()> {
        // A folder without results is not made one by locking it.
        read_about(&about_path(&self.folder))?;
        let _lock = FolderLock::take(&self.folder)?;
        let written = report::write(&self.folder)?;
        if !self.quiet {
            say(format_args!("report: {}", written.report.display()));
        }
        written.check()
    }
}

/// Arguments of `status`.
#[derive(Args)]
pub struct Status {
    /// Results folder, such as reports/assignment-4
    folder: PathBuf,
    /// Another folder to look for mesh files in (may be given several times)
    #[arg(long, value_name = "DIR")]
    data: Vec<PathBuf>,
    /// One JSON document on stdout
    #[arg(long)]
    json: bool,
}

impl Status {
    /// Says what is done, missing or stale, and why.
    pub fn run(self) -> Result<()> {
        let about = read_about(&about_path(&self.folder))?;
        let source = about.source.clone().unwrap_or_default();
        let file = locate(&self.folder, &source.file);
        let mut data = self.data;
        for folder in Origin::read(&self.folder).unwrap_or_default().data {
            if folder.is_dir() && !data.iter().any(|known| known.canonicalize().ok() == folder.canonicalize().ok()) {
                data.push(folder);
            }
        }
        let options = OpenOptions { data: data.clone(), sets: source.sets.clone() };
        let lab = Lab::new(file.as_deref().unwrap_or(Path::new(&source.file)), options).with_record(&about);
        let (plan, mut notes) = plan_of_file(&about, &self.folder, file.as_deref(), &lab)?;
        let status = Standing::read(&plan, &self.folder)?;
        let command = next_command(&about, &self.folder, file.as_deref(), &data);
        let next = next_commands(&command, &status);
        notes.extend(lab.stand_ins());
        if self.json {
            print_json(&status_json(&about, &self.folder, &status, &notes, &next))?;
        } else {
            let mut text = format!("{}, seed {}: {status}", about.experiment.name, about.experiment.seed);
            text.extend(notes.iter().map(|note| format!("note: {note}\n")));
            text.extend(next.iter().map(|command| format!("next: {command}\n")));
            print(&text)?;
        }
        status.check(self.folder.display())
    }
}

/// The plan of what a folder says was run.
fn plan_of(about: &About, folder: &Path, lab: &Lab) -> Result<Plan> {
    let mut experiment = about.experiment.clone();
    experiment.place = about_path(folder).display().to_string();
    plan(&experiment, lab)
}

/// The plan of what the next run would do: that of the experiment file as it is now, where it still is this experiment's,
/// else of what was run; with notes that say in what the two differ.
fn plan_of_file(about: &About, folder: &Path, file: Option<&Path>, lab: &Lab) -> Result<(Plan, Vec<String>)> {
    let Some(file) = file else { return Ok((plan_of(about, folder, lab)?, Vec::new())) };
    let recorded = |why: &dyn std::fmt::Display| {
        let note = format!("{} is not followed, what was run counts: {why}", file.display());
        Ok((plan_of(about, folder, lab)?, vec![note]))
    };
    let experiment = match Experiment::read(file) {
        Ok(experiment) => experiment,
        Err(e) => return recorded(&e),
    };
    if (&experiment.name, experiment.seed) != (&about.experiment.name, about.experiment.seed) {
        return recorded(&format!("it is the experiment {:?} with seed {} now", experiment.name, experiment.seed));
    }
    let json = |experiment: &Experiment| serde_json::to_value(experiment).unwrap_or_default();
    let notes = differences(&json(&about.experiment), &json(&experiment));
    let notes = notes.iter().map(|what| format!("{} changed since it was run: {what}", file.display())).collect();
    Ok((plan(&experiment, lab)?, notes))
}

/// Keys whose values differ, with the values.
fn differences(was: &Value, is: &Value) -> Vec<String> {
    let (Some(was), Some(is)) = (was.as_object(), is.as_object()) else { return Vec::new() };
    let keys = was.keys().chain(is.keys().filter(|key| !was.contains_key(*key)));
    let value = |of: &serde_json::Map<String, Value>, key: &String| of.get(key).cloned().unwrap_or_default();
    let both = keys.map(|key| (key, value(was, key), value(is, key)));
    both.filter(|(_, was, is)| was != is).map(|(key, was, is)| format!("{key}, {was} → {is}")).collect()
}

/// The command that goes on with a folder, as a shell reads it, from the working folder.
fn next_command(about: &About, folder: &Path, file: Option<&Path>, data: &[PathBuf]) -> String {
    let word = |path: &Path| shell_word(&path.display().to_string());
    let source = about.source.clone().unwrap_or_default();
    let mut command = match file {
        None => about.command.clone(),
        Some(file) => format!("sampler-lab run {}", word(file)),
    };
    let sets = source.sets.iter().filter(|_| file.is_some());
    command.extend(sets.map(|set| format!(" --set {}", shell_word(set))));
    command.extend(data.iter().map(|folder| format!(" --data {}", word(folder))));
    if folder != Path::new("reports").join(&about.experiment.name) {
        command += &format!(" --out {}", word(folder));
    }
    command
}

/// The commands that do what is missing: one, or one for each missing shard.
fn next_commands(command: &str, status: &Standing) -> Vec<String> {
    if status.done == status.items {
        return Vec::new();
    }
    match status.shard_options() {
        shards if shards.is_empty() => vec![command.to_owned()],
        shards => shards.iter().map(|shard| format!("{command} {shard}")).collect(),
    }
}

fn status_json(about: &About, folder: &Path, status: &Standing, notes: &[String], next: &[String]) -> Value {
    let missing = |Missing { reason, items, first }: &Missing| {
        let mut entry = json!({"reason": reason.name(), "items": items, "why": reason.to_string(), "first": first});
        if let Reason::Changed(changes) = reason {
            let changes = changes.iter().map(
                |change| json!({"what": change.what, "scene": change.scene, "from": change.from, "to": change.to}),
            );
            entry["changes"] = changes.collect();
        }
        entry
    };
    json!({
        "folder": folder.display().to_string(),
        "experiment": about.experiment.name,
        "seed": about.experiment.seed.to_string(),
        "items": status.items,
        "done": status.done,
        "missing": status.missing.iter().map(missing).collect::<Vec<_>>(),
        "stale_rows": status.stale.iter().map(|(why, rows)| json!({"rows": rows, "why": why})).collect::<Vec<_>>(),
        "superseded_rows": status.superseded,
        "shards": status.shards,
        "missing_shards": status.missing_shards.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "notes": notes,
        "next": next,
    })
}

/// Arguments of `merge`.
#[derive(Args)]
pub struct Merge {
    /// Folders that `run --shard` wrote, in any order
    #[arg(required = true, value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// Folder for the joined results and the report; may be one of the others, or hold an earlier merge
    #[arg(long, short, value_name = "DIR")]
    out: PathBuf,
    /// One JSON document on stdout
    #[arg(long)]
    json: bool,
    /// Say nothing but errors on stderr
    #[arg(long, short)]
    quiet: bool,
}

impl Merge {
    /// Joins the folders, then writes the report.
    pub fn run(self) -> Result<()> {
        let sources = Sources::open(&self.folders, &self.out)?;
        let about = sources.about().clone();
        let plan = plan_of(&about, &self.folders[0], &Lab::of_record(&about))?;
        let merged = sources.merge(&plan)?;
        let written = report::write(&self.out)?;
        let status = &merged.status;
        if self.json {
            print_json(&json!({
                "folder": self.out.display().to_string(),
                "report": written.report.display().to_string(),
                "items": status.items,
                "done": status.done,
                "images_copied": merged.images,
                "missing_shards": status.missing_shards.iter().map(ToString::to_string).collect::<Vec<_>>(),
            }))?;
        } else if !self.quiet {
            say(format_args!("{} of {} items joined, {} images copied", status.done, status.items, merged.images));
            say(format_args!("report: {}", written.report.display()));
        }
        status.check(self.out.display())?;
        written.check()
    }
}

//! `report`, `status` and `merge`: what is done with folders of results, without rendering.

use std::path::{Path, PathBuf};

use clap::Args;
use sampler_lab::error::Result;
use sampler_lab::experiment::folder::FolderLock;
use sampler_lab::experiment::lab::Lab;
use sampler_lab::experiment::merge::Sources;
use sampler_lab::experiment::plan::{Plan, plan};
use sampler_lab::experiment::results::{About, about_path, read_about};
use sampler_lab::experiment::status::{Missing, Status as Standing};
use sampler_lab::experiment::why::Reason;
use sampler_lab::report;
use sampler_lab::scene::load::OpenOptions;
use serde_json::{Value, json};

use super::{print, print_json};

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
            eprintln!("report: {}", written.report.display());
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
        let options = OpenOptions { data: self.data, sets: source.sets };
        let lab = Lab::new(Path::new(&source.file), options).with_record(&about);
        let plan = plan_of(&about, &self.folder, &lab)?;
        let status = Standing::read(&plan, &self.folder)?;
        let next = next_commands(&about, &self.folder, &status);
        if self.json {
            print_json(&status_json(&about, &self.folder, &status, &lab.stand_ins(), &next))?;
        } else {
            let mut text = format!("{}, seed {}: {status}", about.experiment.name, about.experiment.seed);
            text.extend(lab.stand_ins().iter().map(|note| format!("note: {note}\n")));
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

/// The commands that do what is missing: one, or one for each missing shard.
fn next_commands(about: &About, folder: &Path, status: &Standing) -> Vec<String> {
    if status.done == status.items {
        return Vec::new();
    }
    let mut command = about.command.clone();
    if folder != Path::new("reports").join(&about.experiment.name) {
        command += &format!(" --out {}", folder.display());
    }
    match status.shard_options() {
        shards if shards.is_empty() => vec![command],
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
            eprintln!("{} of {} items joined, {} images copied", status.done, status.items, merged.images);
            eprintln!("report: {}", written.report.display());
        }
        status.check(self.out.display())?;
        written.check()
    }
}

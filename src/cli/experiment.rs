//! `run`: experiments.

use std::cell::Cell;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use sampler_lab::error::Result;
use sampler_lab::experiment::execute::{Options, Outcome, execute_locked};
use sampler_lab::experiment::lab::Lab;
use sampler_lab::experiment::origin::{Origin, recorded_name, shell_word};
use sampler_lab::experiment::plan::plan;
use sampler_lab::experiment::progress::{Progress, Tick};
use sampler_lab::experiment::results::{Source, kind_name};
use sampler_lab::experiment::shards::Shard;
use sampler_lab::experiment::spec::Experiment;
use sampler_lab::experiment::status::Status;
use sampler_lab::experiment::survey::{Standing, Survey};
use sampler_lab::report::{self, Written};
use serde_json::json;

use super::signals::stop_flag;
use super::{SceneArgs, WorkArgs, print, print_json, say};

/// Arguments of `run`.
#[derive(Args)]
pub struct Run {
    /// Experiment file
    experiment: PathBuf,
    /// Folder for results and report [default: reports/NAME]
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Say what would be done and what it costs; do nothing
    #[arg(long)]
    dry_run: bool,
    /// Forget what the folder holds and do everything again
    #[arg(long)]
    fresh: bool,
    /// Do one part of N alone; `merge` joins the parts
    #[arg(long, value_name = "I/N")]
    shard: Option<String>,
    /// One JSON document on stdout
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    files: SceneArgs,
    #[command(flatten)]
    work: WorkArgs,
}

impl Run {
    /// Renders what is missing, then writes the report.
    pub fn run(self) -> Result<()> {
        let shard = self.shard.as_deref().map(Shard::parse).transpose()?;
        let experiment = Experiment::read(&self.experiment)?;
        let out = self.out.clone().unwrap_or_else(|| PathBuf::from("reports").join(&experiment.name));
        let lab = Lab::new(&self.experiment, self.files.options());
        let plan = plan(&experiment, &lab)?;
        self.work.warn(&lab.warnings());
        self.work.warn(&plan.notes);
        let standing = if self.fresh { Standing::nothing(&plan) } else { Standing::read(&plan, &out)? };
        let part = shard.map_or(0..plan.items.len(), |shard| shard.positions(&plan));
        let survey = Survey::of_part(&plan, &standing, &out, self.work.threads(), part);
        if self.dry_run {
            if !self.fresh {
                let stale = Status::read(&plan, &out)?.stale;
                let note = |(why, rows): &(String, usize)| format!("{rows} rows would be put aside: {why}");
                self.work.warn(&stale.iter().map(note).collect::<Vec<_>>());
            }
            return if self.json { print_json(&survey_json(&survey)) } else { print(&format!("{survey}\n")) };
        }
        if !self.work.quiet {
            let part = shard.map_or(String::new(), |shard| format!(", shard {shard}"));
            say(format_args!("{} -> {}{part}\n{survey}", self.experiment.display(), out.display()));
        }
        let stop = stop_flag()?;
        let mut options = Options::new(self.work.threads(), self.command());
        options.fresh = self.fresh;
        options.shard = shard;
        options.source = Some(Source { file: recorded_name(&self.experiment), sets: self.files.set.clone() });
        options.origin = Some(Origin { file: self.experiment.clone(), data: self.files.data.clone() });
        options.stop = Some(&stop);
        let bar = Bar::new(self.work.quiet);
        // Held until the report is written: it is about these rows.
        let (outcome, _lock) = execute_locked(&plan, &lab, &out, &bar, &options)?;
        bar.bar.finish_and_clear();
        let status = Status::read(&plan, &out)?;
        if outcome.interrupted {
            if self.json {
                self.say(&out, &outcome, None, &status)?;
            }
            return outcome.check();
        }
        // A part of the results has no report of its own; the last part makes the whole.
        let is_part = shard.is_some() && status.done < status.items;
        let written = if is_part { None } else { Some(report::write(&out)?) };
        self.say(&out, &outcome, written.as_ref(), &status)?;
        outcome.check()
    }

    /// What was done: JSON on stdout, or a line or two on stderr.
    fn say(&self, out: &Path, outcome: &Outcome, written: Option<&Written>, status: &Status) -> Result<()> {
        let failed = outcome.failures.len();
        if self.json {
            return print_json(&json!({
                "folder": out.display().to_string(),
                "report": written.map(|written| written.report.display().to_string()),
                "shard": self.shard,
                "items": outcome.items,
                "found": outcome.found,
                "done": outcome.done,
                "failed": failed,
                "samples": outcome.samples,
                "interrupted": outcome.interrupted,
            }));
        }
        if !self.work.quiet {
            let Outcome { items, found, done, .. } = outcome;
            say(format_args!("{items} items: {found} found, {done} done, {failed} failed"));
            match written {
                Some(written) => say(format_args!("report: {}", written.report.display())),
                None => say(format_args!(
                    "{} of all {} items are in {}, of which `sampler-lab report` writes a report; when every shard is done, `sampler-lab merge DIR… --out DIR` joins them and writes the report",
                    status.done,
                    status.items,
                    out.display()
                )),
            }
        }
        Ok(())
    }

    /// The command that makes this folder, without what does not change a byte of it, spelling among it.
    fn command(&self) -> String {
        let mut command = format!("sampler-lab run {}", shell_word(&recorded_name(&self.experiment)));
        for set in &self.files.set {
            command += &format!(" --set {}", shell_word(set));
        }
        command
    }
}

/// The survey as JSON.
fn survey_json(survey: &Survey) -> serde_json::Value {
    let kinds =
        survey.items.iter().map(|&(kind, all, left)| json!({"kind": kind_name(kind), "items": all, "left": left}));
    json!({
        "items": kinds.collect::<Vec<_>>(),
        "samples": survey.samples,
        "samples_left": survey.samples_left,
        "samples_growth_at_most": survey.samples_growth,
        "samples_timed_again": survey.samples_timing,
        "samples_per_second": survey.rate,
        "rate_is_measured": survey.is_rate_measured,
        "seconds_left": survey.seconds_left,
        "seconds_growth_at_most": survey.seconds_growth,
        "memory_bytes": survey.memory_bytes,
        "disk_bytes": survey.disk_bytes,
    })
}

/// A bar over samples with rate and time left on a terminal; elsewhere a line every ten seconds.
struct Bar {
    bar: ProgressBar,
    lines: Option<Cell<Instant>>,
}

impl Bar {
    fn new(quiet: bool) -> Self {
        let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(0) };
        let style = ProgressStyle::with_template("{bar:24} {percent}%  {msg}").expect("the template is well formed");
        let lines = (!quiet && !std::io::stderr().is_terminal()).then(|| Cell::new(Instant::now()));
        Self { bar: bar.with_style(style), lines }
    }

    fn show(&self, label: &str, tick: &Tick) {
        let eta = tick.eta_seconds.map_or(String::new(), |s| format!(", ETA {s:.0} s"));
        let rate = tick.samples_per_second / 1e6;
        let text = format!("{}/{} items, {rate:.2} M samples/s{eta}  {label}", tick.items_done, tick.items);
        if let Some(last) = self.lines.as_ref().filter(|last| last.get().elapsed() >= Duration::from_secs(10)) {
            last.set(Instant::now());
            say(format_args!("{text}"));
        }
        self.bar.set_length(tick.samples.max(1));
        self.bar.set_position(tick.samples_done);
        self.bar.set_message(text);
    }
}

impl Progress for Bar {
    fn item_started(&self, label: &str, tick: &Tick) {
        self.show(label, tick);
    }

    fn item_ended(&self, tick: &Tick) {
        self.show("", tick);
    }

    fn warn(&self, message: &str) {
        self.bar.suspend(|| say(format_args!("note: {message}")));
    }
}

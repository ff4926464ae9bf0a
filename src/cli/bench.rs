//! `bench`: how fast the lab is on this machine.

use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use sampler_lab::bench::scenes::Landscape;
use sampler_lab::bench::{self, Case, GROUPS, Lab};
use sampler_lab::error::{Error, Result};
use serde_json::json;

use super::{WorkArgs, print, print_json, say};

/// Arguments of `bench`.
#[derive(Args)]
pub struct Bench {
    /// Parts of names, such as sampler, rays/landscape-200k or sobol [default: all]
    names: Vec<String>,
    /// List the names; measure nothing
    #[arg(long)]
    list: bool,
    /// Repeat for about so many seconds in all; each group is repeated three times at least
    #[arg(long, value_name = "SECONDS", default_value_t = 90.0)]
    budget: f64,
    /// Write the scenes as files (OBJ, MTL, JSON), for `render` and other renderers; measure nothing
    #[arg(long, value_name = "DIR", conflicts_with_all = ["names", "list"])]
    write_scenes: Option<PathBuf>,
    /// One JSON document on stdout
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    work: WorkArgs,
}

impl Bench {
    /// Measures, lists or writes.
    pub fn run(self) -> Result<()> {
        if let Some(folder) = &self.write_scenes {
            return self.write(folder);
        }
        if !(self.budget > 0.0 && self.budget <= 86_400.0) {
            let what = format!("expected seconds, above 0 and at most 86400, found {}", self.budget);
            return Err(Error::input("--budget", what));
        }
        let lab = Rc::new(Lab::default());
        let groups = bench::select(&lab, &self.names)?;
        if self.list {
            return print(&list(&groups));
        }
        self.work.start_threads()?;
        let found = self.measure(groups)?;
        if self.json {
            return print_json(&json!({ "host": bench::host(), "threads": self.work.threads(), "results": found }));
        }
        print(&format!("{}; {} at work\n\n{}", bench::host(), self.work.threads(), bench::table(&found)))
    }

    /// Each group within its share of what is left of the budget.
    fn measure(&self, groups: Vec<(f64, Vec<Case>)>) -> Result<Vec<bench::Found>> {
        let bar = if self.work.quiet { ProgressBar::hidden() } else { ProgressBar::new_spinner() };
        let style = ProgressStyle::with_template("{spinner} {elapsed} {msg}");
        let bar = bar.with_style(style.expect("the template is well formed"));
        let started = Instant::now();
        let mut shares: f64 = groups.iter().map(|(share, _)| share).sum();
        let mut found = Vec::new();
        for (share, cases) in groups {
            let left = (self.budget - started.elapsed().as_secs_f64()).max(0.0);
            let part = Duration::from_secs_f64(left * share / shares);
            shares -= share;
            let mut told = |name: &str| {
                bar.set_message(name.to_owned());
                bar.tick();
            };
            found.extend(bench::run(cases, part, &mut told)?);
        }
        bar.finish_and_clear();
        Ok(found)
    }

    fn write(&self, folder: &Path) -> Result<()> {
        let mut lines = String::new();
        for landscape in Landscape::ALL {
            if !self.work.quiet {
                say(format_args!("{} …", landscape.name));
            }
            let paths = landscape.write(folder)?;
            lines += &format!("{}: {} triangles\n", paths[0].display(), landscape.triangle_count());
        }
        let cornell = bench::write_cornell(folder)?;
        lines += &format!("{}: the Cornell box\n", cornell.display());
        print(&lines)
    }
}

/// Groups with what they measure, and the names of their cases.
fn list(groups: &[(f64, Vec<Case>)]) -> String {
    let mut text = String::new();
    for (_, cases) in groups {
        let group = GROUPS.iter().find(|g| cases[0].name.starts_with(&format!("{}/", g.name)));
        text += &format!("{}\n", group.map_or("", |g| g.about));
        for case in cases {
            text += &format!("  {}\n", case.name);
        }
    }
    text
}

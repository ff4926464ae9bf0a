//! Arguments, and what goes where: results to stdout or files, all else to stderr.

mod bench;
mod check;
mod compare;
mod experiment;
mod folders;
mod image;
mod sets;
mod signals;
mod view;

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{Args, Parser, Subcommand};
use sampler_lab::error::{Error, Result};
use sampler_lab::sampling::{Decision, Points, Preset, SampleLayout, SamplerSet, SamplerSpec};
use sampler_lab::scene::compile::{Scene, Stage};
use sampler_lab::scene::config::SceneConfig;
use sampler_lab::scene::load::{self, LoadedScene, OpenOptions};

/// What the choice of sample points does to a rendered image, with numbers.
#[derive(Parser)]
#[command(
    version,
    max_term_width = 100,
    after_help = "Exit codes: 0 done, 1 a test or gate failed, 2 usage or bad input, 3 writing failed, 4 incomplete, 130 interrupted."
)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run an experiment: render what is missing, then write the report
    Run(experiment::Run),
    /// Rewrite the report of a results folder from its stored rows; renders nothing
    Report(folders::Report),
    /// Say what a results folder holds of its experiment: done, missing or stale, and why
    Status(folders::Status),
    /// Join the folders of shards, in any order, then write the report; renders nothing
    Merge(folders::Merge),
    /// Render one image
    Render(image::Render),
    /// Draw and write point sets: the sheet's Figure 2
    Points(sets::DrawPoints),
    /// Measure a point set: discrepancies, t-value, distances
    Measure(sets::Measure),
    /// Compare images of any renderer with a reference: errors, intervals, gates
    Compare(compare::Compare),
    /// Test the lab itself, or a sampler on a scene: verdicts with false-alarm rate and power
    Check(check::Check),
    /// Measure speed: samplers, rays, renders, builds, loading, metrics, growth, memory
    Bench(bench::Bench),
    /// Live view and controls in a browser, served on 127.0.0.1
    View(view::View),
    /// Show or check a scene file
    Config(Config),
    /// Say what a sampler does, and which numbers its decisions read for a scene
    Explain(Explain),
}

impl Cli {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        signals::survive_file_limit()?;
        match self.command {
            Command::Run(args) => args.run(),
            Command::Report(args) => args.run(),
            Command::Status(args) => args.run(),
            Command::Merge(args) => args.run(),
            Command::Render(args) => args.run(),
            Command::Points(args) => args.run(),
            Command::Measure(args) => args.run(),
            Command::Compare(args) => args.run(),
            Command::Check(args) => args.run(),
            Command::Bench(args) => args.run(),
            Command::View(args) => args.run(),
            Command::Config(args) => args.run(),
            Command::Explain(args) => args.run(),
        }
    }
}

/// Where scene files look for meshes, and what is changed in them.
#[derive(Args)]
struct SceneArgs {
    /// Another folder to look for mesh files in (may be given several times)
    #[arg(long, value_name = "DIR")]
    data: Vec<PathBuf>,
    /// Change a key of the scene file, such as camera.fov=40 (may be given several times)
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl SceneArgs {
    fn options(&self) -> OpenOptions {
        OpenOptions { data: self.data.clone(), sets: self.set.clone() }
    }

    fn open(&self, scene: &Path) -> Result<LoadedScene> {
        load::open(scene, &self.options())
    }
}

/// How many threads, and how much is said.
#[derive(Args)]
struct WorkArgs {
    /// Threads to work with; the results do not depend on it [default: all processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Say nothing but errors on stderr
    #[arg(long, short)]
    quiet: bool,
}

impl WorkArgs {
    /// The number of threads asked for, or that of the processors.
    fn threads(&self) -> usize {
        self.threads.map_or_else(|| std::thread::available_parallelism().map_or(1, usize::from), usize::from)
    }

    /// Sets rayon's own pool up.
    fn start_threads(&self) -> Result<()> {
        let threads = self.threads();
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .map_err(|e| Error::input("--threads", format!("expected {threads} threads to start, found: {e}")))
    }

    /// Prints warnings to stderr.
    fn warn(&self, warnings: &[String]) {
        if !self.quiet {
            for warning in warnings {
                say(format_args!("note: {warning}"));
            }
        }
    }
}

/// A sampler for all decisions, and others for single ones.
#[derive(Args)]
struct DecisionArgs {
    /// Sampler of the place in the pixel, in place of the one for every decision
    #[arg(long, value_name = "SAMPLER")]
    pixel: Option<String>,
    /// Sampler of the place on the lens
    #[arg(long, value_name = "SAMPLER")]
    lens: Option<String>,
    /// Sampler of the choice of a light
    #[arg(long, value_name = "SAMPLER")]
    light_pick: Option<String>,
    /// Sampler of the place on the light
    #[arg(long, value_name = "SAMPLER")]
    light: Option<String>,
}

impl DecisionArgs {
    fn of(&self, decision: Decision) -> Option<&str> {
        match decision {
            Decision::Pixel => self.pixel.as_deref(),
            Decision::Lens => self.lens.as_deref(),
            Decision::LightPick => self.light_pick.as_deref(),
            Decision::LightPoint => self.light.as_deref(),
        }
    }

    /// `sampler` for every decision, but for those that have one of their own.
    fn set(&self, sampler: &str) -> Result<SamplerSet> {
        let mut set = SamplerSet::parse(sampler, Preset::Best)?;
        for decision in Decision::ALL {
            if let Some(own) = self.of(decision) {
                let spec = SamplerSpec::parse(own, Preset::Best)
                    .map_err(|e| Error::input(format!("--{}", decision.key()), e))?;
                set = set.with(decision, spec);
            }
        }
        Ok(set)
    }

    /// What was said of decisions that are not made.
    fn notes(&self, scene: &Path, layout: &SampleLayout) -> Vec<String> {
        let idle = |d: &Decision| self.of(*d).is_some() && layout.find(*d).is_none();
        let idle = Decision::ALL.into_iter().filter(idle);
        let note = |d: Decision| {
            format!("--{}: {} makes no such decision ({layout}): nothing reads it", d.key(), scene.display())
        };
        idle.map(note).collect()
    }
}

/// Says something on stderr, which is no result: where nobody can hear it the work goes on.
pub fn say(text: impl std::fmt::Display) {
    let _ = std::io::stderr().lock().write_all(format!("{text}\n").as_bytes());
}

/// Writes a result to stdout; a reader that has gone away ends the program quietly.
fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => std::process::exit(0),
        other => other.map_err(|e| Error::write(Path::new("standard output"), e)),
    }
}

/// Writes one JSON document to stdout.
fn print_json(value: &impl serde::Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value).expect("our results are plain data");
    print(&(text + "\n"))
}

#[derive(Args)]
struct Config {
    #[command(subcommand)]
    action: ConfigAction,
}

#[derive(Subcommand)]
enum ConfigAction {
    /// Print the full state with every default made explicit
    Show(ConfigFile),
    /// Read the scene with all its files, and say what is noteworthy
    Check(ConfigFile),
}

#[derive(Args)]
struct ConfigFile {
    /// Scene file
    file: PathBuf,
    #[command(flatten)]
    scene: SceneArgs,
}

impl Config {
    fn run(self) -> Result<()> {
        match self.action {
            ConfigAction::Show(args) => {
                let config = SceneConfig::read(&args.file, &args.scene.set)?;
                for warning in config.warnings() {
                    say(format_args!("note: {warning}"));
                }
                print(&config.to_json())
            }
            ConfigAction::Check(args) => {
                let loaded = args.scene.open(&args.file)?;
                for warning in &loaded.warnings {
                    say(format_args!("note: {warning}"));
                }
                if let Some(sampler) = &loaded.config.sampler {
                    SamplerSet::parse(sampler, Preset::Best)
                        .map_err(|e| Error::input(format!("{}: sampler", args.file.display()), e))?;
                }
                let framebuffer = loaded.config.framebuffer;
                let triangles = loaded.mesh.len();
                let scene =
                    Scene::new(&loaded.config, loaded.mesh, (framebuffer.res_w, framebuffer.res_h), Stage::Final)?;
                print(&format!("{}: sound; {triangles} triangles; {}\n", args.file.display(), scene.layout))
            }
        }
    }
}

#[derive(Args)]
struct Explain {
    /// Sampler, as POINTS[:ORDER[:RANDOM[@SCOPE]]] or POINTS:PRESET
    sampler: String,
    #[command(flatten)]
    decisions: DecisionArgs,
    /// Scene whose decisions are shown
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    files: SceneArgs,
}

impl Explain {
    fn run(self) -> Result<()> {
        let set = self.decisions.set(&self.sampler)?;
        let mut text = match set.single() {
            Some(spec) => format!("{} = {}\n{}\n{}", self.sampler, spec.expansion(), spec.describe(), domain(spec)),
            None => by_decision(&set),
        };
        if Decision::ALL.iter().any(|&d| d.dimensions() == 2 && set.of(d).points == Points::Stratified) {
            text += "A count without a factor pair a×b, b/a ≤ 2, is raised to the next that has one: 26 → 28 = 4×7.\n";
        }
        if let Some(path) = &self.scene {
            let loaded = self.files.open(path)?;
            let framebuffer = loaded.config.framebuffer;
            let scene = Scene::new(&loaded.config, loaded.mesh, (framebuffer.res_w, framebuffer.res_h), Stage::Final)?;
            for note in self.decisions.notes(path, &scene.layout) {
                say(format_args!("note: {note}"));
            }
            text += &format!("\n{}: {}\n", path.display(), scene.layout);
            text += &layout_table(&set, &scene.layout);
        }
        print(&text)
    }
}

/// Where a sampler is defined, in a line; `center` is wherever there are decisions for it.
fn domain(spec: SamplerSpec) -> String {
    if spec.points == Points::Center { String::new() } else { format!("Domain: {}\n", spec.domain()) }
}

/// What a set of different samplers does, decision by decision.
fn by_decision(set: &SamplerSet) -> String {
    let mut text = format!("{set}\nA sampler for each decision:\n");
    for decision in Decision::ALL {
        let spec = set.of(decision);
        text += &format!("  {:<12} {}\n  {:<12} {}\n", decision.name(), spec.expansion(), "", spec.describe());
    }
    text
}

/// Decision by decision, what is read.
fn layout_table(set: &SamplerSet, layout: &SampleLayout) -> String {
    let mut text = String::new();
    for claim in layout.claims() {
        text += &format!("  {:<12} {}\n", claim.decision.name(), set.of(claim.decision).reads(*claim));
    }
    for absent in Decision::ALL.iter().filter(|d| layout.find(**d).is_none()) {
        text += &format!("  {:<12} not decided in this scene: no numbers\n", absent.name());
    }
    text
}

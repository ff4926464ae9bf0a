//! `check`: the self-test, and the same questions about a user's scene.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, atomic::AtomicBool};
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use sampler_lab::check::scene::Question;
use sampler_lab::check::{self, BUDGET_SECONDS, FALSE_ALARM, Kind, SEED, Settings, false_alarm, select};
use sampler_lab::error::{Error, Result};
use sampler_lab::experiment::backend::Size;
use sampler_lab::sampling::MAX_SAMPLES;
use sampler_lab::scene::config::Estimator;
use serde_json::{Value, json};

use super::signals::stop_flag;
use super::{DecisionArgs, SceneArgs, WorkArgs, print, print_json, say};

/// Arguments of `check`.
#[derive(Args)]
pub struct Check {
    /// Checks, groups or rows of the failure catalogue (12 or #12) [default: all]; or one scene file
    names: Vec<String>,
    /// List the checks; run none
    #[arg(long)]
    list: bool,
    /// With --list: as a Markdown table of the failure catalogue's rows and the checks that show them
    #[arg(long, requires = "list")]
    markdown: bool,
    /// False-alarm rate of a run of all checks, or of all that is asked about a scene
    #[arg(long, value_name = "A", default_value_t = FALSE_ALARM)]
    alpha: f64,
    /// Try as hard as fits into so many seconds on two cores; the clock decides nothing
    #[arg(long, value_name = "SECONDS", default_value_t = BUDGET_SECONDS)]
    budget: f64,
    /// Seed of all random numbers
    #[arg(long, default_value_t = SEED)]
    seed: u64,
    /// One JSON document on stdout
    #[arg(long)]
    json: bool,
    /// Say what each check claims and what it saw
    #[arg(long, short)]
    verbose: bool,
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    work: WorkArgs,
    /// Plant this bug first; the run is expected to fail
    #[arg(long, value_name = "NAME", hide = cfg!(not(feature = "mutants")), conflicts_with_all = ["mutants", "mutant_table"])]
    mutant: Option<String>,
    /// Try every planted bug on its cheapest check; fails where one survives
    #[arg(long, hide = cfg!(not(feature = "mutants")), conflicts_with = "mutant_table")]
    mutants: bool,
    /// Try every planted bug on every check: the table of docs/mutants.md
    #[arg(long, hide = cfg!(not(feature = "mutants")))]
    mutant_table: bool,
}

/// What only a scene has.
#[derive(Args)]
struct SceneOptions {
    /// For a scene: sampler of every decision; a bare name means its :best [default: sobol]
    #[arg(long)]
    sampler: Option<String>,
    #[command(flatten)]
    decisions: DecisionArgs,
    /// For a scene: samples per pixel [default: the scene's sppx]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SAMPLES)))]
    spp: Option<u32>,
    /// For a scene: image size [default: 48 columns in the scene's shape]
    #[arg(long, value_name = "WxH")]
    size: Option<String>,
    /// For a scene: unbiased, or the sheet's shortcut: sheet [default: the scene's]
    #[arg(long, value_name = "NAME")]
    estimator: Option<String>,
    #[command(flatten)]
    files: SceneArgs,
}

impl SceneOptions {
    /// The first of these that was given.
    fn given(&self) -> Option<&'static str> {
        let files = &self.files;
        let given = [
            ("--sampler", self.sampler.is_some()),
            ("--pixel", self.decisions.pixel.is_some()),
            ("--lens", self.decisions.lens.is_some()),
            ("--light-pick", self.decisions.light_pick.is_some()),
            ("--light", self.decisions.light.is_some()),
            ("--spp", self.spp.is_some()),
            ("--size", self.size.is_some()),
            ("--estimator", self.estimator.is_some()),
            ("--data", !files.data.is_empty()),
            ("--set", !files.set.is_empty()),
        ];
        given.into_iter().find(|(_, given)| *given).map(|(name, _)| name)
    }
}

/// Work that gives results one after another.
type Job = Box<dyn FnOnce() -> check::Result + Send>;

impl Check {
    /// Lists or runs.
    pub fn run(self) -> Result<()> {
        let settings = self.settings()?;
        if let Some(scene) = self.scene_file()? {
            return self.run_scene(&scene, &settings);
        }
        if let Some(option) = self.scene.given() {
            return Err(Error::input(
                option,
                "expected a scene file, such as check SCENE.json --sampler S, found none",
            ));
        }
        let checks = select(&self.names)?;
        if self.list {
            return if self.json { print_json(&listed_json(&checks)) } else { print(&listed(&checks, self.markdown)) };
        }
        self.work.start_threads()?;
        if self.mutants || self.mutant_table {
            return mutants::run_all(&self, &checks, &settings);
        }
        if let Some(name) = &self.mutant {
            mutants::plant(name)?;
        }
        let jobs = checks.into_iter().map(|c| Box::new(move || check::run(&c, &settings)) as Job).collect();
        let named = !self.names.is_empty();
        self.report(jobs, &settings, named, json!({}))
    }

    fn settings(&self) -> Result<Settings> {
        if !(self.alpha > 0.0 && self.alpha < 1.0) {
            return Err(Error::input(
                "--alpha",
                format!("expected a probability above 0 and below 1, found {}", self.alpha),
            ));
        }
        if !(self.budget > 0.0 && self.budget <= 86_400.0) {
            return Err(Error::input(
                "--budget",
                format!("expected seconds above 0 and at most 86400, found {}", self.budget),
            ));
        }
        Ok(Settings { seed: self.seed, alpha: self.alpha, effort: self.budget / BUDGET_SECONDS })
    }

    /// The scene file among the names: there is one name then.
    fn scene_file(&self) -> Result<Option<PathBuf>> {
        let is_scene = |name: &String| name.ends_with(".json") || Path::new(name).is_file();
        match self.names.iter().find(|name| is_scene(name)) {
            None => Ok(None),
            Some(scene) if self.names.len() == 1 && !self.list && self.mutant.is_none() => {
                Ok(Some(PathBuf::from(scene)))
            }
            Some(scene) => {
                Err(Error::input(scene, "expected a scene file alone, found it beside other names or --list"))
            }
        }
    }

    fn run_scene(&self, file: &Path, settings: &Settings) -> Result<()> {
        let options = &self.scene;
        let text = options.sampler.as_deref().unwrap_or("sobol");
        let set = options.decisions.set(text)?;
        let estimator = options.estimator.as_deref().map(|e| {
            Estimator::from_name(e)
                .ok_or_else(|| Error::input("--estimator", format!("expected unbiased or sheet, found \"{e}\"")))
        });
        let estimator = estimator.transpose()?;
        let size =
            options.size.as_deref().map(|s| Size::parse(s).map_err(|e| Error::input("--size", e))).transpose()?;
        self.work.start_threads()?;
        let mut loaded = options.files.open(file)?;
        loaded.config.estimator = estimator.unwrap_or(loaded.config.estimator);
        self.work.warn(&loaded.warnings);
        let question = Question::new(loaded, set, options.spp, size)?;
        self.work.warn(&question.scene().warnings);
        self.work.warn(&options.decisions.notes(file, &question.scene().layout));
        if !self.work.quiet {
            say(format_args!("{}: {question}", file.display()));
        }
        let about = json!({
            "scene": file.display().to_string(),
            "sampler": set.to_string(),
            "expansion": set.expansion(),
            "layout": question.scene().layout.to_string(),
            "estimator": question.scene().estimator.name(),
            "spp": {"asked": question.asked(), "taken": question.taken()},
            "size": question.size().to_string(),
        });
        let question = Arc::new(question);
        let settings = *settings;
        let jobs = check::scene::CHECKS.iter().map(|check| {
            let question = question.clone();
            Box::new(move || question.run(check, &settings)) as Job
        });
        // One after another: they share the images of the first.
        self.report(jobs.collect(), &settings, true, about)
    }

    /// Runs the jobs, shows a line each in their order, and sums up.
    fn report(&self, jobs: Vec<Job>, settings: &Settings, verbose: bool, about: Value) -> Result<()> {
        let stop = stop_flag()?;
        let count = jobs.len();
        let bar = bar(count as u64, self.work.quiet);
        let started = Instant::now();
        let at_once = if about.get("scene").is_some() { 1 } else { self.work.threads().min(2) };
        let ended = start(jobs, at_once, stop.clone());
        let mut results: Vec<Option<(check::Result, f64)>> = (0..count).map(|_| None).collect();
        let mut shown = 0;
        while let Some((place, result, seconds)) = next(&ended, &stop) {
            bar.inc(1);
            bar.set_message(result.name);
            results[place] = Some((result, seconds));
            while let Some(Some((result, seconds))) = results.get(shown) {
                self.show(result, *seconds, verbose || self.verbose, &bar)?;
                shown += 1;
            }
        }
        bar.finish_and_clear();
        if stop.load(Ordering::Relaxed) && shown < count {
            return Err(Error::interrupted(
                "check",
                format!("expected {count} checks to end, found an interrupt after {shown}"),
            ));
        }
        let results: Vec<check::Result> = results.into_iter().flatten().map(|(result, _)| result).collect();
        self.sum_up(&results, settings, started.elapsed().as_secs_f64(), about)
    }

    /// One result as text: on stdout, or on stderr where stdout is for JSON.
    fn show(&self, result: &check::Result, seconds: f64, verbose: bool, bar: &ProgressBar) -> Result<()> {
        let mut text = format!("{}, {seconds:.1} s", result.line());
        if verbose || !result.finding.passed {
            text += &format!("\n      claim: {}\n      found: {}", result.claim, result.finding.says);
        }
        match (self.json, self.work.quiet) {
            (false, _) => bar.suspend(|| print(&(text + "\n"))),
            (true, false) => bar.suspend(|| {
                say(text);
                Ok(())
            }),
            (true, true) => Ok(()),
        }
    }

    fn sum_up(&self, results: &[check::Result], settings: &Settings, seconds: f64, about: Value) -> Result<()> {
        let failed: Vec<&str> = results.iter().filter(|r| !r.finding.passed).map(|r| r.name).collect();
        let tests: u64 = results.iter().map(|r| u64::from(r.finding.tests)).sum();
        let rate = false_alarm(results);
        let summary = format!(
            "{} checks of {tests} tests: {} passed, {} failed; false alarms {rate:.1e} together",
            results.len(),
            results.len() - failed.len(),
            failed.len(),
        );
        if self.json {
            let mut document = json!({
                "alpha": settings.alpha,
                "seed": settings.seed,
                "effort": settings.effort,
                "passed": failed.is_empty(),
                "tests": tests,
                "false_alarm": rate,
            });
            if let (Some(document), Value::Object(about)) = (document.as_object_mut(), about) {
                document.extend(about);
                document.insert("checks".to_owned(), json!(results));
            }
            print_json(&document)?;
        } else {
            print(&format!("{summary}; seed {}\n", settings.seed))?;
        }
        if !self.work.quiet {
            say(format_args!("{seconds:.1} s"));
        }
        if failed.is_empty() {
            return Ok(());
        }
        Err(Error::failed(
            "check",
            format!("expected every check to pass, found {} that fail: {}", failed.len(), failed.join(", ")),
        ))
    }
}

/// Starts up to `at_once` jobs at a time, in order; what ends is sent with its place and seconds.
///
/// The threads are on their own: an interrupt ends the program without waiting for them.
fn start(jobs: Vec<Job>, at_once: usize, stop: Arc<AtomicBool>) -> Receiver<(usize, check::Result, f64)> {
    let (sender, receiver) = channel();
    let next = Arc::new(AtomicUsize::new(0));
    let jobs: Arc<Vec<std::sync::Mutex<Option<Job>>>> =
        Arc::new(jobs.into_iter().map(|job| std::sync::Mutex::new(Some(job))).collect());
    for _ in 0..at_once.max(1) {
        let (sender, next, jobs, stop) = (sender.clone(), next.clone(), jobs.clone(), stop.clone());
        std::thread::spawn(move || {
            while !stop.load(Ordering::Relaxed) {
                let place = next.fetch_add(1, Ordering::Relaxed);
                let Some(slot) = jobs.get(place) else { return };
                let job = slot.lock().expect("nobody panics with it").take().expect("each place is handed out once");
                let started = Instant::now();
                let result = job();
                if sender.send((place, result, started.elapsed().as_secs_f64())).is_err() {
                    return;
                }
            }
        });
    }
    receiver
}

/// The next that ends; `None` once all have, or at an interrupt.
fn next<T>(ended: &Receiver<T>, stop: &AtomicBool) -> Option<T> {
    loop {
        match ended.recv_timeout(Duration::from_millis(50)) {
            Ok(result) => return Some(result),
            Err(RecvTimeoutError::Disconnected) => return None,
            Err(RecvTimeoutError::Timeout) if stop.load(Ordering::Relaxed) => return None,
            Err(RecvTimeoutError::Timeout) => {}
        }
    }
}

/// A bar in checks; shown on terminals only.
fn bar(checks: u64, quiet: bool) -> ProgressBar {
    let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(checks) };
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} checks  ETA {eta}  {msg}");
    bar.with_style(style.expect("the template is well formed"))
}

fn kind_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Statistical => "statistical",
        Kind::Exact => "exact",
    }
}

fn rows_of(check: &check::Check) -> String {
    check.failures.iter().map(u8::to_string).collect::<Vec<_>>().join(" ")
}

fn listed(checks: &[check::Check], markdown: bool) -> String {
    if markdown {
        return check::catalogue::markdown(checks);
    }
    let mut text = String::new();
    for check in checks {
        let rows = if check.failures.is_empty() { String::new() } else { format!("  failures {}", rows_of(check)) };
        text +=
            &format!("{:<32} {:<24} {}{rows}\n    {}\n", check.name, check.group, kind_name(check.kind), check.claim);
    }
    text
}

fn listed_json(checks: &[check::Check]) -> Value {
    let list = checks.iter().map(|c| {
        json!({"name": c.name, "group": c.group, "claim": c.claim, "failures": c.failures, "kind": kind_name(c.kind)})
    });
    json!({"checks": list.collect::<Vec<_>>()})
}

#[cfg(not(feature = "mutants"))]
mod mutants {
    //! There are none in this program.

    use super::*;

    fn none(option: &str) -> Error {
        Error::input(
            option,
            "expected a program with planted bugs in it, found one without: cargo run --features mutants -- check …",
        )
    }

    pub fn plant(_: &str) -> Result<()> {
        Err(none("--mutant"))
    }

    pub fn run_all(args: &Check, _: &[check::Check], _: &Settings) -> Result<()> {
        Err(none(if args.mutants { "--mutants" } else { "--mutant-table" }))
    }
}

#[cfg(feature = "mutants")]
mod mutants {
    //! Planted bugs, one at a time.

    use sampler_lab::check::planted::{self, cheapest, run_with};
    use sampler_lab::error::did_you_mean;
    use sampler_lab::mutants::{self, Mutant};

    use super::*;

    pub fn plant(name: &str) -> Result<()> {
        let mutant = Mutant::named(name).ok_or_else(|| {
            let known = || Mutant::ALL.iter().map(|m| m.name());
            let hint = did_you_mean(name, known()).map_or(String::new(), |near| format!("; did you mean \"{near}\"?"));
            let all = known().collect::<Vec<_>>().join(", ");
            Error::input("--mutant", format!("expected one of {all}, found \"{name}\"{hint}"))
        })?;
        say(format_args!("planted: {} ({})", mutant.name(), mutant.mistake()));
        mutants::plant(Some(mutant));
        Ok(())
    }

    pub fn run_all(args: &Check, checks: &[check::Check], settings: &Settings) -> Result<()> {
        let stop = stop_flag()?;
        let bar = bar(Mutant::ALL.len() as u64, args.work.quiet);
        if args.mutant_table { table(checks, settings, &stop, &bar) } else { cheapest_checks(settings, &stop, &bar) }
    }

    fn go_on(stop: &AtomicBool) -> Result<()> {
        match stop.load(Ordering::Relaxed) {
            false => Ok(()),
            true => Err(Error::interrupted("check", "expected all planted bugs to be tried, found an interrupt")),
        }
    }

    /// Each on its cheapest check, which has to pass without it.
    fn cheapest_checks(settings: &Settings, stop: &AtomicBool, bar: &ProgressBar) -> Result<()> {
        let mut wrong = Vec::new();
        let mut sound: Vec<&str> = Vec::new();
        for &mutant in Mutant::ALL {
            go_on(stop)?;
            let check = cheapest(mutant);
            if !sound.contains(&check.name) {
                let clean = check::run(&check, settings);
                if !clean.finding.passed {
                    wrong.push(format!("{} fails without a planted bug: {}", check.name, clean.finding.says));
                }
                sound.push(check.name);
            }
            let started = Instant::now();
            let result = run_with(mutant, &check, settings);
            let seconds = started.elapsed().as_secs_f64();
            let verdict = if result.finding.passed { "SURVIVES" } else { "caught" };
            bar.inc(1);
            let line = format!("{verdict:<8}  {:<28} {:<24} {}", mutant.name(), check.name, result.finding.says);
            bar.suspend(|| print(&format!("{line}\n")))?;
            if result.finding.passed {
                wrong.push(format!("{} survives {}", mutant.name(), check.name));
            } else if seconds > 3.0 {
                bar.suspend(|| say(format_args!("note: {} took {seconds:.1} s, 3 s are meant", mutant.name())));
            }
        }
        bar.finish_and_clear();
        let count = Mutant::ALL.len();
        print(&format!(
            "{count} planted bugs tried on {} checks, each of which passes without: {} wrong\n",
            sound.len(),
            wrong.len()
        ))?;
        if wrong.is_empty() {
            return Ok(());
        }
        Err(Error::failed(
            "check --mutants",
            format!("expected every planted bug to be caught, found: {}", wrong.join("; ")),
        ))
    }

    fn table(checks: &[check::Check], settings: &Settings, stop: &AtomicBool, bar: &ProgressBar) -> Result<()> {
        let mut rows = Vec::new();
        for &mutant in Mutant::ALL {
            go_on(stop)?;
            bar.set_message(mutant.name());
            rows.push(planted::row(mutant, checks, settings));
            bar.inc(1);
        }
        bar.finish_and_clear();
        print(&planted::markdown(&rows, checks.len(), settings))?;
        let survivors: Vec<&str> = rows.iter().filter(|r| r.least.is_none()).map(|r| r.mutant.name()).collect();
        if survivors.is_empty() {
            return Ok(());
        }
        Err(Error::failed("check --mutant-table", format!("expected no survivor, found {}", survivors.join(", "))))
    }
}

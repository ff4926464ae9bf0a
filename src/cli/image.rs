//! `render`: one image.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use sampler_lab::accel::Kernel;
use sampler_lab::error::{Error, Result};
use sampler_lab::experiment::backend::Size;
use sampler_lab::film::{check_writable, write_exr, write_png};
use sampler_lab::render::render_observed;
use sampler_lab::sampling::{Decision, MAX_SAMPLES, PointSource, Sampler};
use sampler_lab::scene::compile::{Scene, Stage};
use sampler_lab::scene::config::{Estimator, SceneConfig, ViewConfig};
use serde_json::json;

use super::{DecisionArgs, SceneArgs, WorkArgs, print_json, say};

/// Arguments of `render`.
#[derive(Args)]
pub struct Render {
    /// Scene file
    scene: PathBuf,
    /// Where the image goes: linear .exr or tone-mapped .png [default: the scene's name with .png]
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Sampler for every decision; a bare name means its :best [default: the scene's, else sobol]
    #[arg(long)]
    sampler: Option<String>,
    #[command(flatten)]
    decisions: DecisionArgs,
    /// Samples per pixel [default: the scene's sppx]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SAMPLES)))]
    spp: Option<u32>,
    /// Image size [default: the scene's]
    #[arg(long, value_name = "WxH")]
    size: Option<String>,
    /// unbiased, or the sheet's shortcut: sheet [default: the scene's]
    #[arg(long, value_name = "NAME")]
    estimator: Option<String>,
    /// Stage of the sheet's Figure 1: start, aa, dof, final
    #[arg(long, default_value = "final")]
    stage: String,
    /// Instructions that trace the rays: scalar, avx2, avx512; all give the same image [default: the widest here]
    #[arg(long, value_name = "NAME")]
    kernel: Option<String>,
    /// Seed of the randomisation [default: the scene's, else 1]
    #[arg(long)]
    seed: Option<u64>,
    /// One JSON document on stdout
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    files: SceneArgs,
    #[command(flatten)]
    work: WorkArgs,
}

impl Render {
    /// Renders and writes the image.
    pub fn run(self) -> Result<()> {
        let named = match &self.sampler {
            Some(sampler) => sampler.clone(),
            None => SceneConfig::read(&self.scene, &self.files.set)?.sampler.unwrap_or_else(|| "sobol".to_owned()),
        };
        let set = self.decisions.set(&named)?;
        let stage = Stage::ALL.into_iter().find(|s| s.name() == self.stage).ok_or_else(|| {
            Error::input("--stage", format!("expected start, aa, dof or final, found \"{}\"", self.stage))
        })?;
        let estimator = self
            .estimator
            .as_deref()
            .map(|e| {
                Estimator::from_name(e)
                    .ok_or_else(|| Error::input("--estimator", format!("expected unbiased or sheet, found \"{e}\"")))
            })
            .transpose()?;
        let size = self.size.as_deref().map(|s| Size::parse(s).map_err(|e| Error::input("--size", e))).transpose()?;
        let kernel =
            self.kernel.as_deref().map(|k| Kernel::parse(k).map_err(|e| Error::input("--kernel", e))).transpose()?;
        let out = self
            .out
            .clone()
            .unwrap_or_else(|| PathBuf::from(self.scene.file_stem().unwrap_or_default()).with_extension("png"));
        let format = Format::of(&out)?;
        self.work.start_threads()?;

        let started = Instant::now();
        let mut loaded = self.files.open(&self.scene)?;
        let load_seconds = started.elapsed().as_secs_f64();
        let framebuffer = loaded.config.framebuffer;
        loaded.config.estimator = estimator.unwrap_or(loaded.config.estimator);
        let size = size.unwrap_or(Size { width: framebuffer.res_w, height: framebuffer.res_h });
        let stated = Scene::most_bytes(&loaded.mesh, size.pixels());
        check_memory(stated)?;
        if !self.work.quiet {
            let triangles = loaded.mesh.len();
            say(format_args!(
                "{}: {triangles} triangles; at most about {} MB",
                self.scene.display(),
                stated / 1_000_000 + 1
            ));
        }
        let started = Instant::now();
        let mut scene = Scene::new(&loaded.config, loaded.mesh, (size.width, size.height), stage)?;
        scene.accel.set_kernel(kernel.unwrap_or(Kernel::detected()));
        let build_seconds = started.elapsed().as_secs_f64();
        self.work.warn(&loaded.warnings);
        self.work.warn(&scene.warnings);
        let view_note = loaded.config.view.as_ref().and_then(ViewConfig::note);
        self.work.warn(view_note.as_slice());
        self.work.warn(&self.decisions.notes(&self.scene, &scene.layout));

        let asked = self.spp.unwrap_or(framebuffer.sppx);
        let seed = self.seed.or(loaded.config.seed).unwrap_or(1);
        let sampler = Sampler::new(set, &scene.layout, asked, seed)?;
        let samples = size.pixels() * u64::from(sampler.samples());
        if !self.work.quiet {
            say(format_args!(
                "{} at {size}, {} samples a pixel of {}",
                self.scene.display(),
                sampler.samples(),
                match set.single() {
                    Some(spec) => format!("{named} = {}", spec.expansion()),
                    None => set.expansion(),
                }
            ));
            say(format_args!("{}: {}", stage.name(), scene.layout));
        }
        check_writable(&out)?;
        let bar = bar(samples, self.work.quiet);
        let started = Instant::now();
        let rendered = render_observed(&scene, &sampler, &|done| bar.inc(done))
            .map_err(|bad| Error::incomplete(self.scene.display(), bad))?;
        let render_seconds = started.elapsed().as_secs_f64();
        bar.finish_and_clear();

        let estimator = scene.estimator.name();
        match format {
            Format::Png => write_png(&out, &rendered.image, framebuffer.exposure)?,
            Format::Exr => {
                let text = |name: &str, value: &dyn std::fmt::Display| (name.to_owned(), value.to_string());
                let provenance = [
                    text("version", &env!("CARGO_PKG_VERSION")),
                    text("scene", &self.scene.display()),
                    text("sampler", &set),
                    text("spp", &sampler.samples()),
                    text("seed", &seed),
                    text("estimator", &estimator),
                    text("stage", &stage.name()),
                ];
                write_exr(&out, &rendered.image, &provenance)?;
            }
        }
        let per_second = |count: u64| count as f64 / render_seconds.max(1e-9);
        if !self.work.quiet {
            say(format_args!(
                "{}: load {load_seconds:.3} s, build {build_seconds:.3} s, render {render_seconds:.3} s, {:.2} M samples/s, {:.2} M rays/s",
                out.display(),
                per_second(samples) / 1e6,
                per_second(rendered.rays) / 1e6
            ));
        }
        if self.json {
            let own = Decision::ALL.map(|d| (d.key().replace('-', "_"), json!(set.of(d).to_string())));
            let samplers: serde_json::Map<String, serde_json::Value> = own.into_iter().collect();
            print_json(&json!({
                "file": out.display().to_string(),
                "scene": self.scene.display().to_string(),
                "sampler": set.to_string(),
                "samplers": samplers,
                "expansion": set.expansion(),
                "layout": scene.layout.to_string(),
                "estimator": estimator,
                "stage": stage.name(),
                "spp": {"asked": asked, "taken": sampler.samples()},
                "size": size.to_string(),
                "seed": seed,
                "kernel": scene.accel.kernel().name(),
                "focal_depth": scene.focal_depth(),
                "render_seconds": render_seconds,
                "load_seconds": load_seconds,
                "build_seconds": build_seconds,
                "samples_per_second": per_second(samples),
                "rays_per_second": per_second(rendered.rays),
                "stated_bytes": stated,
                "peak_bytes": peak_bytes(),
            }))?;
        }
        Ok(())
    }
}

/// What the output is, by its name's end.
#[derive(Clone, Copy)]
enum Format {
    Png,
    Exr,
}

impl Format {
    fn of(path: &Path) -> Result<Self> {
        match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            _ => Err(Error::input(
                "--out",
                format!("expected a name that ends in .png or .exr, found \"{}\"", path.display()),
            )),
        }
    }
}

/// A bar in samples with rate and time left; shown on terminals only.
fn bar(samples: u64, quiet: bool) -> ProgressBar {
    let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(samples) };
    let style = ProgressStyle::with_template("{bar:30} {percent}%  {human_pos} samples  {per_sec}  ETA {eta}");
    bar.with_style(style.expect("the template is well formed"))
}

/// Refuses work that needs more memory than is free: else the system would end the process in the middle of it.
///
/// # Errors
/// Kind `Input` with both numbers, where the system tells what is free.
fn check_memory(needed: u64) -> Result<()> {
    let Some(free) = free_bytes().filter(|free| *free < needed) else { return Ok(()) };
    let [needed, free] = [needed, free].map(|bytes| bytes / 1_000_000);
    let what = format!("expected a scene and an image that fit, found about {needed} MB needed and {free} MB free");
    Err(Error::input("memory", what))
}

/// Memory that new work can have, where the system tells it.
fn free_bytes() -> Option<u64> {
    kilobytes_of("/proc/meminfo", "MemAvailable:")
}

/// Largest resident size of this process so far, where the system tells it.
fn peak_bytes() -> Option<u64> {
    kilobytes_of("/proc/self/status", "VmHWM:")
}

/// The bytes in the line of a system's file that begins with `name`.
fn kilobytes_of(file: &str, name: &str) -> Option<u64> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find(|line| line.starts_with(name))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
}

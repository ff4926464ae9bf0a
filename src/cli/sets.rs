//! `points` and `measure`: point sets as pictures, files and numbers.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use sampler_lab::error::{Error, Result};
use sampler_lab::film::write_whole;
use sampler_lab::points::{
    Measurement, Options, SamplerSource, measure, read_csv, read_csv_file, spectrum_csv, spectrum_reach, to_csv,
};
use sampler_lab::report::pictures::{SHEET_DOT, SHEET_PANEL, point_set_panel};
use sampler_lab::sampling::{MAX_SAMPLES, Preset, SamplerSpec, point_set};
use sampler_lab::stats::Points;
use sampler_lab::stats::discrepancy::STAR_COST_LIMIT;
use sampler_lab::stats::spectrum::Spectrum;
use serde_json::json;

use super::{WorkArgs, print, print_json, say};

/// The sheet's five samplers.
const SHEET: [&str; 5] = ["uniform", "stratified", "halton", "hammersley", "ld"];

/// How points are written.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum PointFormat {
    /// Header `x,y`, a point a line.
    Csv,
    /// One document with sampler, count, seed and points.
    Json,
}

/// Arguments of `points`.
#[derive(Args)]
pub struct DrawPoints {
    /// Samplers; a bare name means its :sheet [default: the sheet's five]
    samplers: Vec<String>,
    /// Number of points
    #[arg(short, default_value_t = 1024, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SAMPLES)))]
    n: u32,
    /// Folder for NAME.png and NAME.csv
    #[arg(long, short, default_value = ".", value_name = "DIR")]
    out: PathBuf,
    /// How points are written
    #[arg(long, value_enum, default_value = "csv")]
    format: PointFormat,
    /// Seed of the randomisation
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Say nothing but errors on stderr
    #[arg(long, short)]
    quiet: bool,
}

impl DrawPoints {
    /// Draws and writes every set.
    pub fn run(self) -> Result<()> {
        let names = if self.samplers.is_empty() { SHEET.map(str::to_owned).to_vec() } else { self.samplers };
        // All are made before the first is written: a misspelt one leaves no file.
        let sets = names
            .iter()
            .map(|name| {
                let spec = SamplerSpec::parse(name, Preset::Sheet)?;
                Ok((name, spec, point_set(spec, self.n, self.seed)?))
            })
            .collect::<Result<Vec<_>>>()?;
        for (name, spec, points) in sets {
            let stem = name.replace([':', '@'], "-");
            let pairs: Vec<(f64, f64)> = points.iter().map(|p| (p[0], p[1])).collect();
            point_set_panel(&pairs, SHEET_PANEL, SHEET_DOT).write(&self.out.join(format!("{stem}.png")))?;
            let (ending, text) = match self.format {
                PointFormat::Csv => ("csv", to_csv(&points)),
                PointFormat::Json => {
                    let document = json!({
                        "sampler": name,
                        "expansion": spec.expansion(),
                        "n": {"asked": self.n, "taken": points.len()},
                        "seed": self.seed,
                        "points": points,
                    });
                    ("json", document.to_string() + "\n")
                }
            };
            let file = self.out.join(format!("{stem}.{ending}"));
            write_whole(&file, text.as_bytes())?;
            if !self.quiet {
                say(format_args!(
                    "{name} = {}: {} points, seed {}: {} and .png",
                    spec.expansion(),
                    points.len(),
                    self.seed,
                    file.display()
                ));
            }
        }
        Ok(())
    }
}

/// Arguments of `measure`.
#[derive(Args)]
pub struct Measure {
    /// Sampler (a bare name means its :sheet), CSV file of points in [0, 1]^d, or - for standard input
    source: String,
    /// Number of points of a sampler [default: 1024]
    #[arg(short, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SAMPLES)))]
    n: Option<u32>,
    /// Seed of the randomisation
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// One JSON document on stdout
    #[arg(long)]
    json: bool,
    /// Leave the star discrepancy out, which is expensive in many dimensions
    #[arg(long, conflicts_with = "max_cost")]
    without_star: bool,
    /// Steps of about 10 ns that the exact star discrepancy may take
    #[arg(long, value_name = "STEPS", default_value_t = STAR_COST_LIMIT)]
    max_cost: f64,
    /// Write the power spectrum of a set in the plane: nu1,nu2,power,p_value
    #[arg(long, value_name = "FILE.csv")]
    spectrum: Option<PathBuf>,
    #[command(flatten)]
    work: WorkArgs,
}

impl Measure {
    /// Reads or makes the set, and prints every metric.
    pub fn run(self) -> Result<()> {
        self.work.start_threads()?;
        let (points, sampler) = self.points()?;
        if self.max_cost.is_nan() || self.max_cost <= 0.0 {
            return Err(Error::input(
                "--max-cost",
                format!("expected a number of steps above 0, found {}", self.max_cost),
            ));
        }
        if self.spectrum.is_some() && points.dimension() != 2 {
            let found = points.dimension();
            return Err(Error::input("--spectrum", format!("expected points of the plane, found {found} coordinates")));
        }
        let options = Options { star_cost: (!self.without_star).then_some(self.max_cost) };
        let measured = Measurement { sampler, ..measure(&self.source, &points, options)? };
        if let Some(file) = &self.spectrum {
            let spectrum = Spectrum::of(&points, spectrum_reach(points.n()));
            write_whole(file, spectrum_csv(&spectrum).as_bytes())?;
        }
        if self.json { print_json(&measured) } else { print(&measured.to_text()) }
    }

    fn points(&self) -> Result<(Points, Option<SamplerSource>)> {
        let is_file = self.source == "-" || self.source.ends_with(".csv") || Path::new(&self.source).is_file();
        if is_file {
            if let Some(n) = self.n {
                return Err(Error::input("-n", format!("expected no count with a file, which has its own, found {n}")));
            }
            if self.source != "-" {
                return Ok((read_csv_file(Path::new(&self.source))?, None));
            }
            return Ok((read_csv(std::io::stdin().lock(), "standard input")?, None));
        }
        let spec = SamplerSpec::parse(&self.source, Preset::Sheet).map_err(|mut e| {
            e.what += &format!("; nor is there a file \"{}\"", self.source);
            e
        })?;
        let asked = self.n.unwrap_or(1024);
        let set = point_set(spec, asked, self.seed)?;
        let points = Points::new_2d(&set).map_err(|e| Error::input(&self.source, e))?;
        Ok((points, Some(SamplerSource { expansion: spec.expansion(), asked, seed: self.seed })))
    }
}

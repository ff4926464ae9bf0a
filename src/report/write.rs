//! From a folder of results to a folder with a report. Renders nothing.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::experiment::results::{about_path, read, read_about, read_timings, results_path, timings_path};
use crate::film::write_whole;

use super::charts::of_scene;
use super::figure::{Figure, Rgb8};
use super::sections::Measurements;
use super::shots::PictureSet;
use super::summarise::{Summary, summarise};
use super::{charts, page, pictured, provenance, sections, spectra, stability, tables};

/// What became of a figure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FigureState {
    /// Drawn from the rows, or from rows and images.
    Drawn,
    /// Its images are not there, so the file of an earlier report was kept.
    Kept,
    /// It cannot be drawn; why.
    Absent(String),
}

/// The figures of a report by name, the names of files in `figures/` without their ending.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Figures {
    states: BTreeMap<String, FigureState>,
    /// What the enlarged details show, left to right, by scene.
    pub details: BTreeMap<String, Vec<String>>,
}

impl Figures {
    /// What became of `name`; a figure that nobody asked for is absent.
    pub fn state(&self, name: &str) -> FigureState {
        self.states.get(name).cloned().unwrap_or(FigureState::Absent("its rows are not there".to_owned()))
    }

    /// Notes a figure down.
    pub fn set(&mut self, name: &str, state: FigureState) {
        self.states.insert(name.to_owned(), state);
    }
}

/// A report that was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    /// Its file.
    pub report: PathBuf,
    /// What it says, as numbers.
    pub summary: Summary,
    /// Its figures.
    pub figures: Figures,
}

impl Written {
    /// Whether everything that the experiment asks for is there.
    ///
    /// # Errors
    /// Kind `Incomplete` that says what is missing.
    pub fn check(&self) -> Result<()> {
        match self.summary.missing.as_slice() {
            [] => Ok(()),
            missing => Err(Error::incomplete(self.report.display(), format!("missing: {}", missing.join("; ")))),
        }
    }
}

/// The names of the enlarged details, left to right, `scene: name`, a line each.
fn details_path(dir: &Path) -> PathBuf {
    dir.join("figures").join("details.txt")
}

/// Writes `report.md`, `report.html`, `summary.csv`, `slopes.csv`, where it is asked about `stability.csv`, and `figures/` from the rows in
/// `dir`.
///
/// The same rows, timings and images give the same bytes; `summary.csv` and `slopes.csv` depend on rows alone.
/// Figures of images that are not there keep their earlier file, and the report says so. Missing rows do not fail: the
/// report says what is missing, and [`Written::check`] tells.
///
/// # Errors
/// Kind `Input` where `experiment.json`, `results.jsonl` or `timings.jsonl` do not read, kind `Write` where a file cannot
/// be written.
pub fn write(dir: &Path) -> Result<Written> {
    let about = read_about(&about_path(dir))?;
    let mut rows = read(&results_path(dir))?;
    // A kill between two files may leave rows of an edited scene: they are not what this report is about.
    rows.retain(|row| about.fits(row));
    let timings = if timings_path(dir).exists() { read_timings(&timings_path(dir))? } else { Vec::new() };
    let summary = summarise(&rows, &timings, &about);
    let measured = Measurements::of(&summary);
    let figures = draw(dir, &summary, &measured)?;
    write_whole(&dir.join("summary.csv"), tables::summary_csv(&summary).as_bytes())?;
    write_whole(&dir.join("slopes.csv"), tables::slopes_csv(&summary).as_bytes())?;
    if !summary.stability.is_empty() {
        write_whole(&dir.join("stability.csv"), stability::csv(&summary).as_bytes())?;
    }
    let report = dir.join("report.md");
    let text = sections::report_with(&summary, &figures, &measured);
    write_whole(&report, text.as_bytes())?;
    page::write(dir, &summary, &text)?;
    Ok(Written { report, summary, figures })
}

/// Draws all figures.
fn draw(dir: &Path, summary: &Summary, measured: &Measurements) -> Result<Figures> {
    let mut pen =
        Pen { folder: dir.join("figures"), stamp: provenance::line(&summary.about), figures: Figures::default() };
    let no_rows = || "its rows are not there".to_owned();
    pen.raster("point-sets", charts::point_sets(summary).ok_or_else(no_rows))?;
    pen.raster("failures", charts::failures(summary).ok_or_else(no_rows))?;
    pen.raster("power-spectra", spectra::maps(summary, measured.power()).ok_or_else(no_rows))?;
    pen.chart("radial-power", charts::radial_power(summary, measured.power()))?;
    pen.chart("predicted-variance", charts::predicted_variance(summary))?;
    pen.chart("discrepancy", charts::discrepancy(summary))?;
    pen.chart("error-spectrum", charts::error_spectrum(summary))?;
    pen.chart("convergence", charts::convergence(summary))?;
    pen.chart("bias-and-variance", charts::bias_and_variance(summary))?;
    pen.chart("stability", charts::stability(summary))?;
    pen.chart("which-decision", charts::which_decision(summary))?;
    for (i, scene) in summary.scenes.iter().enumerate() {
        pen.chart(&of_scene("speed", &scene.name), charts::speed(summary, i))?;
    }
    if let Some(set) = summary.figure_1().filter(|set| set.stages.len() == set.stages_planned()) {
        pen.raster("stages", pictured::stages(dir, set).map_err(|e| e.to_string()))?;
    }
    let mut kept = kept_details(dir);
    for set in summary.pictured.iter().filter(|set| !set.shots.is_empty()) {
        draw_pictures(dir, summary, set, &mut pen, &mut kept)?;
    }
    if !kept.is_empty() {
        let lines: Vec<String> =
            kept.iter().flat_map(|(scene, names)| names.iter().map(move |name| format!("{scene}: {name}"))).collect();
        write_whole(&details_path(dir), (lines.join("\n") + "\n").as_bytes())?;
    }
    pen.figures.details = kept;
    Ok(pen.figures)
}

/// The names of the enlarged details by scene, as an earlier report wrote them down.
fn kept_details(dir: &Path) -> BTreeMap<String, Vec<String>> {
    let mut kept: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let text = std::fs::read_to_string(details_path(dir)).unwrap_or_default();
    for (scene, name) in text.lines().filter_map(|line| line.split_once(": ")) {
        kept.entry(scene.to_owned()).or_default().push(name.to_owned());
    }
    kept
}

/// The strips of one scene. Where its images are not here, figures of an earlier report stay, and with them what was found in
/// those images.
fn draw_pictures(
    dir: &Path,
    summary: &Summary,
    set: &PictureSet,
    pen: &mut Pen,
    kept: &mut BTreeMap<String, Vec<String>>,
) -> Result<()> {
    let scene = &summary.scenes[set.scene].name;
    let name = |sort: &str| of_scene(sort, scene);
    match pictured::strips(dir, summary, set) {
        Ok(strips) => {
            pen.raster(&name("reference"), Ok(strips.whole))?;
            for (sort, strip) in [("details", strips.details), ("equal-time", strips.equal_time)] {
                match strip {
                    Some(strip) => pen.raster(&name(sort), Ok(strip))?,
                    None => pen.remove(&name(sort))?,
                }
            }
            pen.raster(&name("errors"), Ok(strips.errors))?;
            kept.remove(scene);
            if !strips.names.is_empty() {
                kept.insert(scene.clone(), strips.names.into_iter().map(str::to_owned).collect());
            }
            // Too large for a repository: they lie with the images.
            for (file, picture) in strips.whole_pictures {
                picture.write(
                    &dir.join("images/flip")
                        .join(of_scene("", scene).trim_start_matches('-'))
                        .join(format!("{file}.png")),
                )?;
            }
        }
        Err(e) => {
            for sort in ["reference", "errors"] {
                pen.raster(&name(sort), Err(e.to_string()))?;
            }
            for sort in ["details", "equal-time"] {
                pen.keep(&name(sort));
            }
        }
    }
    Ok(())
}

/// Writes figures and keeps book of them.
struct Pen {
    folder: PathBuf,
    stamp: String,
    figures: Figures,
}

impl Pen {
    fn chart(&mut self, name: &str, figure: Option<Figure>) -> Result<()> {
        let Some(figure) = figure else { return Ok(()) };
        let svg = provenance::stamped_svg(&figure.svg, &self.stamp);
        write_whole(&self.folder.join(format!("{name}.svg")), svg.as_bytes())?;
        self.raster(name, Ok(figure.raster))
    }

    /// Keeps the file of an earlier report, if there is one.
    fn keep(&mut self, name: &str) {
        if self.folder.join(format!("{name}.png")).exists() {
            self.figures.set(name, FigureState::Kept);
        }
    }

    /// Takes away the file of an earlier report that this one has no use for.
    fn remove(&self, name: &str) -> Result<()> {
        let path = self.folder.join(format!("{name}.png"));
        match std::fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::write(&path, e)),
            _ => Ok(()),
        }
    }

    /// Writes a raster, or says why there is none and whether an earlier one was kept.
    fn raster(&mut self, name: &str, raster: std::result::Result<Rgb8, String>) -> Result<()> {
        let path = self.folder.join(format!("{name}.png"));
        let state = match raster {
            Ok(raster) => {
                raster.write(&path)?;
                let png = std::fs::read(&path).map_err(|e| Error::write(&path, e))?;
                write_whole(&path, &provenance::stamped_png(&png, &self.stamp))?;
                FigureState::Drawn
            }
            Err(_) if path.exists() => FigureState::Kept,
            Err(why) => FigureState::Absent(why),
        };
        self.figures.set(name, state);
        Ok(())
    }
}

//! Draws every kind of figure of a report from made-up numbers ("gallery data"), to look at when one of them changes.
//!
//! `cargo run --example plot_gallery -- FOLDER`

use std::path::{Path, PathBuf};

use sampler_lab::error::{Error, Result};
use sampler_lab::report::plots::{Datum, Floor, Frame, Guide, Plot, Series, loglog_chart, small_multiples};

const FAMILIES: [&str; 5] = ["uniform", "stratified", "halton", "hammersley", "ld"];
const SPP: [f64; 6] = [1.0, 4.0, 16.0, 26.0, 64.0, 256.0];

/// A fixed wobble in −1…1, so that made-up curves look measured.
fn wobble(i: usize, j: usize) -> f64 {
    libm::sin(12.9898 * i as f64 + 78.233 * j as f64 + 0.5)
}

/// RMSE of a made-up sampler: a power law, and a bias that the literal readings run into.
fn curve(name: &str, index: usize, scale: f64) -> Series {
    let (slope, wall) = match name {
        "uniform:sheet" | "uniform:best" => (-0.5, 0.0),
        "ld:sheet" => (-0.5, 0.05),
        _ if name.ends_with(":sheet") => (-0.6, 0.03 + 0.01 * index as f64),
        _ => (-0.72 - 0.02 * index as f64, 0.0),
    };
    let datum = |(j, &spp): (usize, &f64)| {
        let y = scale * (libm::pow(spp, slope) * (1.0 + 0.03 * wobble(index, j)) + wall);
        let half = 0.12 * y;
        Datum { x: spp, y, interval: Some((y - half, y + half)) }
    };
    Series::of_sampler(name, SPP.iter().enumerate().map(datum).collect())
}

fn curves(scale: f64) -> Vec<Series> {
    let names = FAMILIES.iter().flat_map(|family| [format!("{family}:sheet"), format!("{family}:best")]);
    names.enumerate().map(|(i, name)| curve(&name, i, scale)).collect()
}

fn guides() -> Vec<Guide> {
    let guide = |slope, label: &str| Guide { slope, label: label.to_owned() };
    vec![guide(-0.5, "slope −1/2"), guide(-0.75, "slope −3/4"), guide(-1.0, "slope −1")]
}

fn frame(title: &str, x_label: &str, y_label: &str) -> Frame {
    Frame {
        title: title.to_owned(),
        subtitle: "gallery data: made up, not measured · a01, 80×45, 8 replicates, 95 % bands".to_owned(),
        x_label: x_label.to_owned(),
        y_label: y_label.to_owned(),
        x_ticks: Vec::new(),
    }
}

fn convergence(folder: &Path) -> Result<()> {
    let frame = frame("Error against samples per pixel", "samples per pixel", "RMSE (radiance, W m⁻² sr⁻¹)");
    let plot = |title: &str, scale: f64| Plot {
        title: title.to_owned(),
        series: curves(scale),
        guides: guides(),
        floor: Some(Floor { value: 0.004, label: "reference noise".to_owned() }),
    };
    loglog_chart(&frame, &plot("", 0.8)).write(folder, "convergence")?;
    let panels = [plot("a01", 0.8), plot("cornell", 1.4), plot("penumbra", 0.3)];
    small_multiples(&frame, &panels, 3).write(folder, "convergence-by-scene")?;
    small_multiples(&frame, &[&panels[..], &panels[..2]].concat(), 2).write(folder, "five-panels")
}

fn edges(folder: &Path) -> Result<()> {
    let datum = |x, y| Datum { x, y, interval: None };
    let frame = frame("Edge cases", "n (points)", "star discrepancy D* (no unit)");
    let one = Series::of_sampler("sobol:best", vec![Datum { x: 64.0, y: 0.02, interval: Some((0.018, 0.022)) }]);
    let long = Series::of_sampler("halton:joint:digits@each with a very long name that goes on",
        (0..16).map(|i| datum(libm::exp2(f64::from(i)), libm::pow(10.0, 3.0 - f64::from(i)))).collect());
    let odd = Series::of_sampler("ld", vec![datum(1.0, f64::NAN), datum(4.0, 0.0), datum(8.0, -1.0), datum(16.0, 2.0)]);
    let plot = |series: Vec<Series>| Plot { series, ..Plot::default() };
    loglog_chart(&frame, &plot(vec![])).write(folder, "edge-empty")?;
    loglog_chart(&frame, &plot(vec![one.clone()])).write(folder, "edge-one-point")?;
    loglog_chart(&frame, &plot(vec![one, long, odd])).write(folder, "edge-wide")?;
    small_multiples(&frame, &[plot(vec![]), plot(curves(1.0))], 2).write(folder, "edge-empty-panel")
}

fn main() -> Result<()> {
    let folder = std::env::args().nth(1).map(PathBuf::from);
    let folder = folder.ok_or_else(|| Error::input("plot_gallery", "expected a folder to draw into, found none"))?;
    convergence(&folder)?;
    edges(&folder)
}

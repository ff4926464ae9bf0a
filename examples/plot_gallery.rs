//! Draws every kind of figure of a report from made-up numbers ("gallery data"), to look at when one of them changes.
//!
//! `cargo run --example plot_gallery -- FOLDER`

use std::path::{Path, PathBuf};

use sampler_lab::error::{Error, Result};
use sampler_lab::film::Image;
use sampler_lab::report::bias_variance::{BiasVariance, Estimate, Group, bias_variance_chart};
use sampler_lab::report::figure::Rgb8;
use sampler_lab::report::frame::Frame;
use sampler_lab::report::pareto::{Trial, pareto_chart};
use sampler_lab::report::pictures::{
    Crop, NamedPoints, SHEET_DOT, SHEET_PANEL, ScaleBar, StripCell, StripLayout, error_map, error_scale,
    point_set_contact_sheet, point_set_panel, strip,
};
use sampler_lab::report::plots::{Datum, Floor, Guide, Plot, Series, loglog_chart, small_multiples};

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
        Datum { x: spp, y, interval: Some((y - half, y + half)), is_pale: false }
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
    let datum = |x, y| Datum { x, y, interval: None, is_pale: false };
    let frame = frame("Edge cases", "n (points)", "star discrepancy D* (no unit)");
    let one = Series::of_sampler(
        "sobol:best",
        vec![Datum { x: 64.0, y: 0.02, interval: Some((0.018, 0.022)), is_pale: false }],
    );
    let long = Series::of_sampler(
        "halton:joint:digits@each with a very long name that goes on",
        (0..16).map(|i| datum(libm::exp2(f64::from(i)), libm::pow(10.0, 3.0 - f64::from(i)))).collect(),
    );
    let odd = Series::of_sampler("ld", vec![datum(1.0, f64::NAN), datum(4.0, 0.0), datum(8.0, -1.0), datum(16.0, 2.0)]);
    let plot = |series: Vec<Series>| Plot { series, ..Plot::default() };
    loglog_chart(&frame, &plot(vec![])).write(folder, "edge-empty")?;
    loglog_chart(&frame, &plot(vec![one.clone()])).write(folder, "edge-one-point")?;
    loglog_chart(&frame, &plot(vec![one, long, odd])).write(folder, "edge-wide")?;
    small_multiples(&frame, &[plot(vec![]), plot(curves(1.0))], 2).write(folder, "edge-empty-panel")
}

fn pareto(folder: &Path) -> Result<()> {
    let mut trials = Vec::new();
    for (i, series) in curves(0.8).iter().enumerate() {
        for (j, point) in series.points.iter().enumerate() {
            let seconds = 0.002 * (1.0 + 0.15 * i as f64) * (0.3 + point.x) * (1.0 + 0.1 * wobble(j, i));
            trials.push(Trial {
                seconds_interval: Some((0.93 * seconds, 1.1 * seconds)),
                error_interval: point.interval,
                ..Trial::of_sampler(&series.label, &format!("{} spp", point.x), seconds, point.y)
            });
        }
    }
    let frame = frame("Speed against accuracy", "render time (s, median of 8)", "RMSE (radiance)");
    let peers: Vec<Trial> =
        (0..5).map(|i| Trial::of_peer(["one program", "another"][i % 2], i % 2, 0.02 * (i + 1) as f64, 0.04)).collect();
    pareto_chart(&frame, &trials, &peers).write(folder, "pareto")?;
    pareto_chart(&frame, &trials[..1], &[]).write(folder, "pareto-one")?;
    pareto_chart(&frame, &[], &[]).write(folder, "pareto-empty")
}

fn bias_variance(folder: &Path) -> Result<()> {
    let estimate = |value: f64, half: f64| Estimate { value, interval: Some((value - half, value + half)) };
    let rows = |scale: f64| -> Vec<BiasVariance> {
        let names = FAMILIES.iter().flat_map(|family| [format!("{family}:sheet"), format!("{family}:best")]);
        let row = |(i, name): (usize, String)| {
            let literal = name.ends_with(":sheet");
            let bias = if literal && i > 1 { 2e-3 * (i as f64) } else { 1e-6 * wobble(i, 3) };
            let variance = 1e-3 / (1.0 + i as f64);
            let none = name == "halton:sheet";
            let variance = (!none).then(|| estimate(scale * variance, scale * 0.3 * variance));
            BiasVariance::of_sampler(&name, estimate(scale * bias, scale * (2e-6 + 0.1 * bias.abs())), variance)
        };
        names.enumerate().map(row).collect()
    };
    let frame = frame("Bias² and variance at 64 spp", "squared radiance, mean over pixels", "");
    let groups =
        [("a01", 1.0), ("cornell", 3.0)].map(|(title, scale)| Group { title: title.into(), rows: rows(scale) });
    bias_variance_chart(&frame, &groups).write(folder, "bias-variance")?;
    bias_variance_chart(&frame, &[Group { title: String::new(), rows: Vec::new() }])
        .write(folder, "bias-variance-empty")
}

/// Additive recurrence by powers of the plastic number, turned a little for every `set`.
fn points(n: usize, set: usize) -> Vec<(f64, f64)> {
    let fraction = |v: f64| v - v.floor();
    let at = |i: usize| (i as f64 * 0.754_877_666 + 0.1 * set as f64, i as f64 * 0.569_840_291 + 0.2 * set as f64);
    (0..n).map(at).map(|(x, y)| (fraction(x), fraction(y))).collect()
}

fn point_sets(folder: &Path) -> Result<()> {
    let sets: Vec<NamedPoints> = FAMILIES
        .iter()
        .enumerate()
        .map(|(i, name)| NamedPoints { name: format!("{name} (gallery data)"), points: points(1024, i) })
        .collect();
    point_set_panel(&sets[0].points, SHEET_PANEL, SHEET_DOT).write(&folder.join("point-set.png"))?;
    point_set_contact_sheet(&sets, 5).write(&folder.join("point-sets.png"))
}

/// A made-up picture: a gradient with a checker and a soft shadow, and `noise` from the recurrence.
fn picture(noise: f64, set: usize) -> Image {
    let mut image = Image::black(160, 90);
    for (i, (pixel, u)) in image.pixels.iter_mut().zip(points(160 * 90, set)).enumerate() {
        let (x, y) = ((i % 160) as f64, (i / 160) as f64);
        let checker = if (x / 12.0).floor() as i64 % 2 == (y / 12.0).floor() as i64 % 2 { 0.8 } else { 0.3 };
        let shadow = 1.0 / (1.0 + libm::exp((60.0 - x) / 8.0));
        let value = (0.2 + checker * shadow + noise * (u.0 - 0.5)) as f32;
        *pixel = [value, 0.9 * value, 0.7 * value];
    }
    image
}

fn strips(folder: &Path) -> Result<()> {
    let reference = picture(0.0, 0);
    let images: Vec<Image> = (0..5).map(|i| picture(0.5 / (1.0 + i as f64), i)).collect();
    let shown = |image: &Image| Rgb8 {
        width: image.width,
        height: image.height,
        bytes: image.pixels.iter().flatten().map(|c| (255.0 * c.clamp(0.0, 1.0)) as u8).collect(),
    };
    let crops = vec![
        Crop { x: 20, y: 30, width: 38, height: 28, zoom: 4, colour: [230, 159, 0] },
        Crop { x: 100, y: 10, width: 38, height: 28, zoom: 4, colour: [86, 180, 233] },
    ];
    let draw = |pictures: &[Rgb8], scale_bar: Option<ScaleBar>, name: &str| {
        let captions =
            |i: usize| vec![format!("RMSE {:.4} ± 0.0004", 0.1 / (1.0 + i as f64)), "gallery data".to_owned()];
        let cells: Vec<StripCell> = pictures
            .iter()
            .zip(FAMILIES)
            .enumerate()
            .map(|(i, (image, name))| StripCell {
                captions: captions(i),
                ..StripCell::new(image, &format!("{name}:best"))
            })
            .collect();
        let crops = if scale_bar.is_some() { Vec::new() } else { crops.clone() };
        strip(&cells, &StripLayout { columns: 5, whole: Some(2), crops, scale_bar })?.write(&folder.join(name))
    };
    draw(&images.iter().map(shown).collect::<Vec<_>>(), None, "strip.png")?;
    let scale = error_scale(&images, &reference)?;
    let maps = images.iter().map(|image| error_map(image, &reference, scale)).collect::<Result<Vec<_>>>()?;
    draw(&maps, Some(ScaleBar { scale, label: "luminance − reference".to_owned() }), "error-maps.png")
}

fn main() -> Result<()> {
    let folder = std::env::args().nth(1).map(PathBuf::from);
    let folder = folder.ok_or_else(|| Error::input("plot_gallery", "expected a folder to draw into, found none"))?;
    convergence(&folder)?;
    pareto(&folder)?;
    bias_variance(&folder)?;
    point_sets(&folder)?;
    strips(&folder)?;
    edges(&folder)
}

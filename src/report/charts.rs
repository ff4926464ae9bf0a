//! The charts of a report, out of its summary.

use std::collections::BTreeSet;

use crate::experiment::results::{PixelVariance, PredictionRow, Variant};
use crate::sampling::{Points, Preset, SamplerSpec, point_set};
use crate::stats::Estimate;
use crate::stats::spectrum::Ring;

use super::ablation::{Ablation, ablations};
use super::bias_variance::{self, BiasVariance, Group, bias_variance_chart};
use super::dots::{Dot, DotGroup, DotRow, dot_chart};
use super::figure::{Figure, Rgb8};
use super::frame::Frame;
use super::gallery;
use super::numbers::{counted, listed};
use super::pareto::{Trial, pareto_chart};
use super::pictures::{NamedPoints, point_set_contact_sheet};
use super::plots::{Datum, Floor, Guide, Plot, Series, loglog_chart, small_multiples};
use super::provenance;
use super::sections::{pattern_spp, peers_of};
use super::shares::{Share, SharePanel, share_chart};
use super::spectra::{self, SetPower};
use super::stability::{Against, Stretch, count_against, passes_against};
use super::summarise::{Subject, Summary};

/// The points of the sheet's Figure 2.
pub const FIGURE_2_POINTS: u32 = 1024;

/// `subtitle`, then what made the figure.
fn frame(summary: &Summary, title: &str, subtitle: &str, axes: [&str; 2]) -> Frame {
    Frame {
        title: title.to_owned(),
        subtitle: format!("{subtitle} · {}", provenance::line(&summary.about)),
        x_label: axes[0].to_owned(),
        y_label: axes[1].to_owned(),
        x_ticks: Vec::new(),
    }
}

/// The line of a sampler.
fn series(summary: &Summary, sampler: usize, points: Vec<Datum>) -> Series {
    let sampler = &summary.samplers[sampler];
    Series { label: sampler.label.clone(), style: sampler.style, points }
}

fn ends(estimate: &Estimate) -> Option<(f64, f64)> {
    estimate.ci95.map(|[low, high]| (low, high))
}

fn replicates(summary: &Summary) -> String {
    counted(summary.about.experiment.replicates as usize, "replicate", "replicates")
}

/// The sheet's Figure 2 and below it the same sets as `:best` gives them; what is shown is named.
pub fn point_sets(summary: &Summary) -> Option<Rgb8> {
    let families = [Points::Uniform, Points::Stratified, Points::Halton, Points::Hammersley, Points::Ld];
    let shown = [Preset::Sheet, Preset::Best].iter().flat_map(|preset| families.iter().map(move |f| (*preset, *f)));
    let sets: Option<Vec<NamedPoints>> = shown
        .map(|(preset, family)| {
            let spec = preset.of(family)?;
            let points = point_set(spec, FIGURE_2_POINTS, summary.about.experiment.seed).ok()?;
            let suffix = if preset == Preset::Sheet { "sheet" } else { "best" };
            let points = points.into_iter().map(|[x, y]| (x, y)).collect();
            Some(NamedPoints { name: format!("{}:{suffix}", family.word()), points })
        })
        .collect();
    sets.map(|sets| point_set_contact_sheet(&sets, families.len()))
}

/// Point sets that show failures, and below each the sound way.
pub fn failures(summary: &Summary) -> Option<Rgb8> {
    let sets = gallery::panels(summary.about.experiment.seed)?;
    let columns = sets.len() / 2;
    Some(point_set_contact_sheet(&sets, columns))
}

/// Star discrepancy against the number of points; `None` without such rows.
pub fn discrepancy(summary: &Summary) -> Option<Figure> {
    let series: Vec<Series> = (0..summary.samplers.len())
        .filter_map(|sampler| {
            let datum = |set: &super::summarise::PointSet| {
                let mean = set.mean?;
                Some(Datum { x: f64::from(set.n.taken), y: mean.value, interval: ends(&mean), is_pale: false })
            };
            let sets = summary.point_sets.iter().filter(|set| set.sampler == sampler && set.metric == "star");
            let points: Vec<Datum> = sets.filter_map(datum).collect();
            (!points.is_empty()).then(|| series(summary, sampler, points))
        })
        .collect();
    if series.is_empty() {
        return None;
    }
    let replicates = summary.about.experiment.points.as_ref().map_or(1, |points| points.replicates as usize);
    let subtitle =
        format!("mean of {}, 95 % bands; exact in 2-D", counted(replicates, "independent set", "independent sets"));
    let axes = ["n (points)", "star discrepancy D* (no unit)"];
    let guides = vec![guide(-0.5, "slope −1/2"), guide(-1.0, "slope −1")];
    let plot = Plot { series, guides, ..Plot::default() };
    Some(loglog_chart(&frame(summary, "How even the points are", &subtitle, axes), &plot))
}

fn guide(slope: f64, label: &str) -> Guide {
    Guide { slope, label: label.to_owned() }
}

/// Power of point sets by the length of the frequency, a panel for the literal reading and one for the others.
pub fn radial_power(summary: &Summary, all: &[SetPower]) -> Option<Figure> {
    let is_literal = |found: &&SetPower| summary.samplers[found.sampler].label.ends_with(":sheet");
    let line = |found: &SetPower| {
        let datum = |ring: &Ring| Datum {
            x: f64::from(ring.radius),
            y: ring.mean,
            interval: Some((ring.interval[0], ring.interval[1])),
            is_pale: false,
        };
        series(summary, found.sampler, found.rings.iter().map(datum).collect())
    };
    let (literal, others): (Vec<&SetPower>, Vec<&SetPower>) = all.iter().partition(is_literal);
    let panel = |title: &str, all: Vec<&SetPower>| Plot {
        title: title.to_owned(),
        series: all.into_iter().map(line).collect(),
        guides: Vec::new(),
        floor: Some(Floor { value: 1.0, label: "independent points".to_owned() }),
    };
    let panels = [panel("read literally", literal), panel("decisions kept apart", others)];
    let panels: Vec<Plot> = panels.into_iter().filter(|panel| !panel.series.is_empty()).collect();
    if panels.is_empty() {
        return None;
    }
    let subtitle = format!(
        "{} points of one decision in one pixel, mean of {} randomisations and all directions, 95 % bands",
        spectra::POINTS,
        spectra::SETS
    );
    let axes = ["length of the frequency ν (waves across the unit square)", "power P (no unit)"];
    let ticks = vec![1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
    let frame = Frame { x_ticks: ticks, ..frame(summary, "Power of the point sets by frequency", &subtitle, axes) };
    Some(small_multiples(&frame, &panels, 2))
}

/// Measured over predicted variances of pixels; `None` where none were predicted. Of more than [`SHOWN_PIXELS`] the first.
pub fn predicted_variance(summary: &Summary) -> Option<Figure> {
    let found = &summary.predictions;
    let pixels: Vec<[u32; 2]> = found.first()?.pixels.iter().map(|p| p.pixel).take(SHOWN_PIXELS).collect();
    let kinds: Vec<String> = pixels.iter().map(|[x, y]| format!("pixel ({x}, {y})")).collect();
    let row = |found: &PredictionRow| {
        let dots = found.pixels.iter().take(SHOWN_PIXELS).enumerate().filter(|(_, p)| p.predicted > 0.0);
        let dot = |(kind, p): (usize, &PixelVariance)| Dot {
            kind,
            value: p.measured.value / p.predicted,
            interval: ends(&p.measured).map(|(low, high)| (low / p.predicted, high / p.predicted)),
        };
        let label = summary.samplers.iter().find(|s| s.canonical == found.sampler).map(|s| s.label.clone());
        let way = if found.is_stationary { "exact" } else { "approx." };
        let label = label.unwrap_or_else(|| found.sampler.clone());
        DotRow { label: format!("{label} ({way})"), dots: dots.map(dot).collect() }
    };
    let mut counts: Vec<u32> = found.iter().map(|found| found.spp.asked).collect();
    counts.sort_unstable();
    counts.dedup();
    let group = |&spp: &u32| DotGroup {
        title: format!("{spp} spp"),
        rows: found.iter().filter(|found| found.spp.asked == spp).map(row).collect(),
    };
    let groups: Vec<DotGroup> = counts.iter().map(group).collect();
    let asked = summary.about.experiment.prediction.as_ref()?;
    let subtitle = format!(
        "{}, {} randomisations, 95 % χ² intervals; exact: the formula is a theorem for the sampler",
        asked.scene, asked.seeds
    );
    let axes = ["measured / predicted variance of a pixel (no unit)", ""];
    Some(dot_chart(&frame(summary, "Pixel variance, measured over predicted", &subtitle, axes), &kinds, 1.0, &groups))
}

/// As many pixels as a chart of dots has colours.
const SHOWN_PIXELS: usize = 5;

/// RMSE against samples per pixel, a panel a scene; where the literal reading was run, it has a row of its own.
pub fn convergence(summary: &Summary) -> Option<Figure> {
    let is_literal = |sampler: usize| summary.samplers[sampler].label.ends_with(":sheet");
    let (mixed, single): (Vec<usize>, Vec<usize>) =
        (0..summary.samplers.len()).partition(|&i| summary.samplers[i].is_mixed());
    let (literal, other): (Vec<usize>, Vec<usize>) = single.into_iter().partition(|&i| is_literal(i));
    let with_uniform = |samplers: &[usize]| -> Vec<usize> {
        summary.uniform().into_iter().filter(|u| !samplers.contains(u)).chain(samplers.iter().copied()).collect()
    };
    let mut rows: Vec<(&str, Vec<usize>)> = match (literal.is_empty(), other.is_empty()) {
        (true, _) => vec![("", other)],
        (_, true) => vec![(": read literally", literal)],
        _ => vec![(": read literally", with_uniform(&literal)), (": decisions kept apart", with_uniform(&other))],
    };
    if !mixed.is_empty() {
        rows.push((": a sampler a decision", with_uniform(&mixed)));
    }
    rows.retain(|(_, samplers)| !samplers.is_empty());
    let panels: Vec<Plot> = rows
        .iter()
        .flat_map(|(words, samplers)| {
            (0..summary.scenes.len()).map(move |scene| panel(summary, scene, samplers, words))
        })
        .collect();
    if panels.iter().all(|plot| plot.series.is_empty()) {
        return None;
    }
    let is_pale = summary.cells.iter().any(|cell| cell.is_reference_limited);
    let pale = if is_pale { "; pale: reference-limited" } else { "" };
    let subtitle = format!("{}, 95 % bands; dotted: the reference's own noise{pale}", replicates(summary));
    let axes = ["samples per pixel", "RMSE (radiance, W/(m² sr))"];
    let frame = frame(summary, "Error against samples per pixel", &subtitle, axes);
    Some(small_multiples(&frame, &panels, summary.scenes.len().clamp(1, 3)))
}

fn panel(summary: &Summary, scene: usize, samplers: &[usize], words: &str) -> Plot {
    let of = |&sampler: &usize| {
        let datum = |cell: &&super::summarise::Cell| {
            let rmse = cell.rmse?;
            let (x, is_pale) = (f64::from(cell.spp.taken), cell.is_reference_limited);
            Some(Datum { x, y: rmse.value, interval: ends(&rmse), is_pale })
        };
        let points: Vec<Datum> = summary.cells_of(scene, sampler).iter().filter_map(datum).collect();
        (!points.is_empty()).then(|| series(summary, sampler, points))
    };
    let scene = &summary.scenes[scene];
    let floor = scene.reference_rmse().filter(|&rmse| rmse > 0.0);
    Plot {
        title: format!("{}{words}", scene.name),
        series: samplers.iter().filter_map(of).collect(),
        guides: vec![guide(-0.5, "slope −1/2"), guide(-1.0, "slope −1")],
        floor: floor.map(|value| Floor { value, label: "reference noise".to_owned() }),
    }
}

/// Power of the error images by frequency at the count that patterns are judged at, a panel a scene.
pub fn error_spectrum(summary: &Summary) -> Option<Figure> {
    let spp = pattern_spp(summary)?;
    let line = |scene: usize, sampler: usize| {
        let cell = summary.cell(scene, sampler, spp).filter(|cell| cell.mse.value > 0.0)?;
        let (found, mse) = (cell.error_spectrum.as_ref()?, cell.mse.value);
        let band = |ring: usize| Some((found.low.as_ref()?.get(ring)? / mse, found.high.as_ref()?.get(ring)? / mse));
        let rings = found.frequency.iter().zip(&found.power).enumerate();
        let points = rings.map(|(ring, (&x, power))| Datum {
            x,
            y: power / mse,
            interval: band(ring),
            is_pale: cell.is_reference_limited,
        });
        Some(series(summary, sampler, points.collect()))
    };
    let panels: Vec<Plot> = (0..summary.scenes.len())
        .map(|scene| Plot {
            title: summary.scenes[scene].name.clone(),
            series: (0..summary.samplers.len()).filter_map(|sampler| line(scene, sampler)).collect(),
            guides: Vec::new(),
            floor: Some(Floor { value: 1.0, label: "independent pixels".to_owned() }),
        })
        .collect();
    if panels.iter().all(|plot| plot.series.is_empty()) {
        return None;
    }
    let subtitle = format!("{}, bands: 10 % to 90 % of them; flat: pixels err independently", replicates(summary));
    let axes = ["spatial frequency (cycles per pixel)", "power / mean square error"];
    let title = format!("Error of the image by frequency at {spp} spp");
    let frame = Frame { x_ticks: vec![0.02, 0.05, 0.1, 0.2, 0.5], ..frame(summary, &title, &subtitle, axes) };
    Some(small_multiples(&frame, &panels, summary.scenes.len().clamp(1, 3)))
}

/// bias² and variance of every sampler at the most samples per pixel, a group a scene.
pub fn bias_and_variance(summary: &Summary) -> Option<Figure> {
    let most = summary.most_spp()?;
    let estimate = |e: Estimate| bias_variance::Estimate { value: e.value, interval: ends(&e) };
    let groups: Vec<Group> = (0..summary.scenes.len())
        .map(|scene| {
            let row = |sampler: usize| {
                let cell = summary.cell(scene, sampler, most)?;
                let label = &summary.samplers[sampler].label;
                let row = BiasVariance::of_sampler(label, estimate(cell.bias2), cell.variance.map(estimate));
                Some(BiasVariance { style: summary.samplers[sampler].style, ..row })
            };
            let rows = (0..summary.samplers.len()).filter_map(row).collect();
            Group { title: summary.scenes[scene].name.clone(), rows }
        })
        .filter(|group: &Group| !group.rows.is_empty())
        .collect();
    if groups.is_empty() {
        return None;
    }
    let subtitle = format!("{}, 95 % intervals", replicates(summary));
    let axes = ["squared radiance, mean over pixels and channels", ""];
    let title = format!("Bias² and variance at {most} spp");
    Some(bias_variance_chart(&frame(summary, &title, &subtitle, axes), &groups))
}

/// Every count and two passes against what is promised; `None` where stability is not asked about or nothing is there.
pub fn stability(summary: &Summary) -> Option<Figure> {
    let asked = summary.about.experiment.stability.as_ref().filter(|_| !summary.stability.is_empty())?;
    let mut kinds: Vec<String> = asked.counts().iter().map(|n| format!("{n} spp")).collect();
    let in_passes = kinds.len();
    if asked.spp > 1 {
        kinds.push(format!("1 + {} spp in two passes", asked.spp - 1));
    }
    let stretch = Stretch::of(summary);
    let dot = |kind: usize, against: Option<Against>| {
        let excess = stretch.stretched(&against?);
        Some(Dot { kind, value: excess.value, interval: ends(&excess) })
    };
    let row = |subject: &Subject| {
        let counts = subject.counts.iter().enumerate().map(|(i, cell)| dot(i, count_against(summary, subject, cell)));
        let passes = subject.remade.iter().filter(|(variant, _)| *variant == Variant::TwoPasses);
        let passes = passes.map(|(_, cell)| dot(in_passes, passes_against(summary, subject, cell)));
        let label = summary.samplers[subject.sampler].label.clone();
        DotRow { label, dots: counts.chain(passes).flatten().collect() }
    };
    let groups: Vec<DotGroup> = (0..summary.scenes.len())
        .map(|scene| DotGroup {
            title: summary.scenes[scene].name.clone(),
            rows: summary.stability.iter().filter(|subject| subject.scene == scene).map(row).collect(),
        })
        .filter(|group| !group.rows.is_empty())
        .collect();
    let subtitle = format!(
        "against one pass of {} spp; {}, 95 % intervals stretched for {}",
        asked.spp,
        replicates(summary),
        counted(stretch.comparisons, "comparison", "comparisons")
    );
    let frame = frame(
        summary,
        "Other counts and two passes, against what is promised",
        &subtitle,
        ["RMSE / promised RMSE (no unit)", ""],
    );
    Some(dot_chart(&frame, &kinds, 1.0, &groups))
}

/// Shares of the error that single decisions take away: a row a scene, a column an exchange; `None` where no decision was
/// exchanged alone.
pub fn which_decision(summary: &Summary) -> Option<Figure> {
    let groups: Vec<Vec<Ablation>> = (0..summary.scenes.len()).map(|scene| ablations(summary, scene)).collect();
    let mut columns: Vec<(usize, SamplerSpec)> = Vec::new();
    for column in groups.iter().flatten().map(|group| (group.base, group.other)) {
        if !columns.contains(&column) {
            columns.push(column);
        }
    }
    columns.sort_by_key(|(base, _)| *base);
    if columns.is_empty() {
        return None;
    }
    let panel = |group: &Ablation| {
        let parts = group.parts.iter().map(|part| Share { decision: Some(part.decision), share: part.gone });
        let all = group.all.iter().map(|(_, gone)| Share { decision: None, share: *gone });
        let title = format!("{}: {}", summary.scenes[group.scene].name, summary.samplers[group.base].label);
        SharePanel { title, bars: parts.chain(all).collect() }
    };
    let of_column = |groups: &[Ablation], column: &(usize, SamplerSpec)| {
        groups.iter().find(|group| (group.base, group.other) == *column).map(panel)
    };
    let rows = groups.iter().filter(|groups| !groups.is_empty());
    let panels: Vec<_> =
        rows.flat_map(|groups| columns.iter().map(|c| of_column(groups, c)).collect::<Vec<_>>()).collect();
    let spp: BTreeSet<u32> = groups.iter().flatten().map(|group| group.spp).collect();
    let spp: Vec<String> = spp.iter().map(u32::to_string).collect();
    let exchange = |(base, other): &(usize, SamplerSpec)| format!("from {} to {other}", summary.samplers[*base].label);
    let exchanges: Vec<String> = columns.iter().map(exchange).collect();
    let subtitle = format!(
        "one decision at a time {}; {} spp, {}, 95 % intervals",
        listed(&exchanges),
        listed(&spp),
        replicates(summary)
    );
    let axes = ["share of the MSE that goes where this decision alone is exchanged", ""];
    Some(share_chart(&frame(summary, "Which decision matters", &subtitle, axes), &panels, columns.len()))
}

/// What a figure of one scene is called in `figures/`: `sort-scene`, letters, digits and `.-_` alone, so that every viewer finds it.
pub fn of_scene(sort: &str, scene: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || ".-_".contains(c) { c } else { '-' };
    format!("{sort}-{}", scene.chars().map(plain).collect::<String>())
}

/// Seconds against RMSE of one scene; `None` where nothing was timed.
pub fn speed(summary: &Summary, scene: usize) -> Option<Figure> {
    let trials: Vec<Trial> = (0..summary.samplers.len())
        .flat_map(|sampler| summary.cells_of(scene, sampler))
        .filter_map(|cell| {
            let (speed, rmse) = (summary.speed(cell)?, cell.rmse?);
            let label = &summary.samplers[cell.sampler].label;
            let detail = format!("{} spp", cell.spp.taken);
            Some(Trial {
                seconds_interval: ends(&speed.seconds),
                error_interval: ends(&rmse),
                style: summary.samplers[cell.sampler].style,
                ..Trial::of_sampler(label, &detail, speed.seconds.value, rmse.value)
            })
        })
        .collect();
    if trials.is_empty() {
        return None;
    }
    let peers = peers_of(summary, scene);
    let mut programs: Vec<&str> = peers.iter().map(|(point, _)| point.name.as_str()).collect();
    programs.sort_unstable();
    programs.dedup();
    let peers: Vec<Trial> = peers
        .into_iter()
        .map(|(point, scale)| {
            let number = programs.iter().position(|name| *name == point.name).unwrap_or(0);
            Trial {
                seconds_interval: point.seconds_range.map(|[low, high]| (low * scale, high * scale)),
                error_interval: point.rmse_range.map(|[low, high]| (low, high)),
                ..Trial::of_peer(&point.name, number, point.seconds * scale, point.rmse)
            }
        })
        .collect();
    let name = &summary.scenes[scene].name;
    let mut threads: Vec<String> = summary.speeds.iter().map(|speed| speed.threads.to_string()).collect();
    threads.sort();
    threads.dedup();
    let subtitle = format!(
        "{name}, {} pixels, {}; boxes: intervals of the median seconds and of the RMSE; this machine, {} threads",
        summary.scenes[scene].size,
        replicates(summary),
        listed(&threads)
    );
    let axes = ["render time (s, median)", "RMSE (radiance, W/(m² sr))"];
    Some(pareto_chart(&frame(summary, &format!("Speed against accuracy: {name}"), &subtitle, axes), &trials, &peers))
}

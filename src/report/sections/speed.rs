//! Speed against accuracy: the only section with values from a clock.

use crate::stats::Estimate;

use super::super::charts::speed_name;
use super::super::evidence::{interpolated, ratio, ratio_of_roots};
use super::super::markdown::Page;
use super::super::numbers::{counted, estimate, listed, short};
use super::super::pareto::pareto_front;
use super::super::summarise::{Cell, Speed, Summary};
use super::super::write::Figures;
use super::words::{name, ratio_cell, row, scene_name};
use super::{show, titles};

/// The section.
pub fn section(summary: &Summary, figures: &Figures, page: &mut Page) {
    page.heading(2, titles::SPEED);
    if summary.speeds.is_empty() {
        page.paragraph("Nothing was timed, so nothing is said of speed.");
        return;
    }
    let images: usize = summary.speeds.iter().map(|speed| speed.images).sum();
    let mut threads: Vec<String> = summary.speeds.iter().map(|speed| speed.threads.to_string()).collect();
    threads.sort();
    threads.dedup();
    page.paragraph(&format!(
        "Seconds are this machine's: {} timed on {} threads, wall seconds of rendering alone. Other work on the machine \
         moves them; they are no part of `summary.csv`. Seconds and rates below: median and range. Efficiency 1/(MSE · T) is in 1/(radiance² · thread-seconds), its interval from the \
         range of T and the 95 % interval of the MSE. RMSE at equal seconds: what uniform sampling takes at the count of the tables, between the neighbouring counts of each \
         sampler on a straight line of logarithms, values and interval ends alike; the spread of the seconds is not in those intervals.",
        counted(images, "image", "images"),
        listed(&threads)
    ));
    for scene in 0..summary.scenes.len() {
        let scene_file = &summary.scenes[scene].name;
        let caption = format!(
            "`{}`: median seconds an image against RMSE, one mark a sampler and count, on the front by name; bars: range of the seconds and 95 % interval of the RMSE.",
            scene_file
        );
        show(page, figures, &speed_name(scene_file), true, &caption);
        page.sentences(&[front_sentence(summary, scene).unwrap_or_default()]);
        efficiency_table(summary, scene, page);
        equal_seconds(summary, scene, page);
    }
}

/// Cells of a scene with a time and an error above 0.
fn timed(summary: &Summary, scene: usize) -> Vec<(&Cell, &Speed)> {
    let cells = (0..summary.samplers.len()).flat_map(|sampler| summary.cells_of(scene, sampler));
    cells
        .filter(|cell| cell.rmse.is_some_and(|rmse| rmse.value > 0.0))
        .filter_map(|cell| Some((cell, summary.speed(cell)?)))
        .filter(|(_, speed)| speed.seconds.value > 0.0)
        .collect()
}

/// Who is on the Pareto front of a scene, by sampler: counts on it.
pub fn front(summary: &Summary, scene: usize) -> Vec<(usize, usize)> {
    let timed = timed(summary, scene);
    let places: Vec<(f64, f64)> = timed.iter().map(|(cell, speed)| (speed.seconds.value, cell.mse.value)).collect();
    let mut members: Vec<(usize, usize)> = Vec::new();
    for i in pareto_front(&places) {
        let sampler = timed[i].0.sampler;
        match members.iter_mut().find(|(known, _)| *known == sampler) {
            Some((_, count)) => *count += 1,
            None => members.push((sampler, 1)),
        }
    }
    members.sort_by_key(|&(sampler, count)| (std::cmp::Reverse(count), sampler));
    members
}

fn front_sentence(summary: &Summary, scene: usize) -> Option<String> {
    let front = front(summary, scene);
    let total: usize = front.iter().map(|(_, count)| count).sum();
    let names: Vec<String> =
        front.iter().map(|&(sampler, count)| format!("{} ({count})", name(summary, sampler))).collect();
    (total > 0).then(|| {
        format!(
            "On the front of {} (nothing is both faster and more accurate, by medians): {}, {}.",
            scene_name(summary, scene),
            counted(total, "trial", "trials"),
            listed(&names)
        )
    })
}

/// 1/(MSE · T), T = seconds × threads; its interval from both.
pub fn efficiency(cell: &Cell, speed: &Speed) -> Option<Estimate> {
    let cost = scaled(&speed.seconds, speed.threads as f64);
    let one_over_cost = ratio(&Estimate { value: 1.0, ci95: Some([1.0; 2]) }, &cost)?;
    ratio(&one_over_cost, &cell.mse)
}

fn scaled(e: &Estimate, factor: f64) -> Estimate {
    Estimate { value: e.value * factor, ci95: e.ci95.map(|ends| ends.map(|end| end * factor)) }
}

fn efficiency_table(summary: &Summary, scene: usize, page: &mut Page) {
    let Some(spp) = summary.middle_spp() else { return };
    let of = |sampler: usize| {
        let cell = summary.cell(scene, sampler, spp)?;
        let speed = summary.speed(cell)?;
        Some((cell, speed, efficiency(cell, speed)?))
    };
    let base = summary.uniform().and_then(of);
    let lines: Vec<Vec<String>> = (0..summary.samplers.len())
        .filter_map(of)
        .map(|(cell, speed, efficiency)| {
            let pixels = summary.scenes[scene].pixels as f64;
            let rate = scaled(&inverse(&speed.seconds), pixels * f64::from(cell.spp.taken) / 1e6);
            let relative = base.and_then(|(.., base)| ratio(&efficiency, &base));
            let is_base = Some(cell.sampler) == summary.uniform();
            vec![
                name(summary, cell.sampler),
                estimate(&speed.seconds),
                estimate(&rate),
                estimate(&efficiency),
                if is_base { "1".to_owned() } else { ratio_cell(relative) },
                row(&cell.id),
            ]
        })
        .collect();
    let head = [
        format!("{}, {spp} spp", scene_name(summary, scene)),
        "seconds".to_owned(),
        "M samples/s".to_owned(),
        "1/(MSE · T)".to_owned(),
        "relative to uniform".to_owned(),
        "row".to_owned(),
    ];
    page.table(&head.iter().map(String::as_str).collect::<Vec<_>>(), &lines);
}

fn inverse(e: &Estimate) -> Estimate {
    Estimate { value: 1.0 / e.value, ci95: e.ci95.map(|[low, high]| [1.0 / high, 1.0 / low]) }
}

/// RMSE that each sampler reaches in equal seconds, between its counts on a straight line of logarithms.
fn equal_seconds(summary: &Summary, scene: usize, page: &mut Page) {
    let (Some(uniform), Some(spp)) = (summary.uniform(), summary.middle_spp()) else { return };
    let Some(budget) = summary.cell(scene, uniform, spp).and_then(|cell| summary.speed(cell)) else { return };
    let budget = budget.seconds.value;
    let all = timed(summary, scene);
    let reached: Vec<(usize, Estimate)> = (0..summary.samplers.len())
        .filter_map(|sampler| {
            let trials: Vec<(f64, Estimate)> = all
                .iter()
                .filter(|(cell, _)| cell.sampler == sampler)
                .map(|(cell, speed)| (speed.seconds.value, cell.mse))
                .collect();
            Some((sampler, interpolated(&trials, budget)?))
        })
        .collect();
    let base = reached.iter().find(|(sampler, _)| *sampler == uniform).map(|(_, mse)| *mse);
    let lines: Vec<Vec<String>> = reached
        .iter()
        .map(|(sampler, mse)| {
            let root = |x: f64| x.max(0.0).sqrt();
            let rmse = Estimate { value: root(mse.value), ci95: mse.ci95.map(|ends| ends.map(root)) };
            let relative = base.and_then(|base| ratio_of_roots(mse, &base));
            let relative = if *sampler == uniform { "1".to_owned() } else { ratio_cell(relative) };
            vec![name(summary, *sampler), estimate(&rmse), relative]
        })
        .collect();
    let title = format!("{} in {} s", scene_name(summary, scene), short(budget));
    page.table(&[&title, "RMSE at equal seconds", "relative to uniform"], &lines);
}

//! Speed against accuracy: the only section with values from a clock.

use crate::stats::Estimate;

use super::super::charts::of_scene;
use super::super::evidence::ratio;
use super::super::markdown::{Page, table_ref};
use super::super::numbers::{counted, estimate, listed};
use super::super::pareto::pareto_front;
use super::super::summarise::{Cell, Speed, Summary};
use super::super::write::Figures;
use super::words::{marked_row, name, ratio_cell, scene_name};
use super::{budgets, reach, sampling, show, tabulate_folded, titles};

/// The section.
pub fn section(summary: &Summary, figures: &Figures, page: &mut Page) {
    page.heading(2, titles::SPEED);
    if summary.speeds.is_empty() {
        page.paragraph("Nothing was timed, so nothing is said of speed.");
        return;
    }
    page.paragraph(&timed_words(summary));
    page.paragraph(&format!(
        "How to read the figures: farther left is faster, farther down more accurate, both on scales where one step is one factor. A mark with no other mark both left of it and below it is on the *front*: nothing is better than it at both. Along a grey diagonal RMSE² · seconds stays the same: it is the way of independent samples, four times the seconds for half the error, so two marks on one diagonal are equally good, the same picture with more or fewer samples, and the next diagonal to the lower left needs a tenth of the seconds for the same error. A line of marks steeper than the diagonals gains more from each further second than independent samples do; one that levels off gains nothing. Boxes show how sure both numbers are: where boxes overlap, no difference can be told by the picture; {} and {} say what can.",
        table_ref("budgets"),
        table_ref("equal-seconds")
    ));
    budgets::section(summary, page);
    reach::section(summary, page);
    sampling::share(summary, page);
    sampling::peers(summary, page);
    for scene in 0..summary.scenes.len() {
        let scene_file = &summary.scenes[scene].name;
        let caption = format!(
            "Speed against accuracy in `{scene_file}`, {} pixels: median seconds an image against RMSE in W/(m² sr), one mark a sampler and count, those on the front with their samples per pixel; boxes: intervals of \
             the median seconds and of the RMSE, {}; grey: equal RMSE² · seconds, a factor of 10 from line to line.{}",
            summary.scenes[scene].size,
            counted(summary.about.experiment.replicates as usize, "replicate", "replicates"),
            if sampling::peers_of(summary, scene).is_empty() { "" } else { " Stars: other programs." }
        );
        show(page, figures, &of_scene("speed", scene_file), true, &caption);
        page.sentences(&[front_sentence(summary, scene).unwrap_or_default()]);
        efficiency_table(summary, scene, page);
    }
}

/// Where the seconds come from.
fn timed_words(summary: &Summary) -> String {
    let all = |of: &dyn Fn(&Speed) -> String| {
        let mut words: Vec<String> = summary.speeds.iter().map(of).collect();
        words.sort();
        words.dedup();
        words
    };
    let threads = listed(&all(&|speed| speed.threads.to_string()));
    let (rounds, replicates): (Vec<&Speed>, Vec<&Speed>) = summary.speeds.iter().partition(|s| s.is_in_rounds);
    let range = |speeds: &[&Speed]| {
        let (low, high) = speeds.iter().fold((usize::MAX, 0), |(l, h), s| (l.min(s.timings), h.max(s.timings)));
        if low == high { low.to_string() } else { format!("{low} to {high}") }
    };
    let mut ways = Vec::new();
    if !rounds.is_empty() {
        ways.push(format!(
            "medians of {} rounds ({}), each of which rendered one image of every scene, sampler and count again after all else was done, so that what else the machine did met all of them",
            range(&rounds),
            counted(rounds.len(), "case", "cases")
        ));
    }
    if !replicates.is_empty() {
        ways.push(format!(
            "medians over {} replicates, each timed as it was made ({})",
            range(&replicates),
            counted(replicates.len(), "case", "cases")
        ));
    }
    format!(
        "Seconds are this machine's, on {threads} threads, wall seconds of rendering alone: {}. Their intervals lie between two of the timings themselves, whatever their distribution: of six and more at 95 %, of fewer their range. Other work on the machine \
         moves them; they are no part of `summary.csv`.",
        ways.join("; ")
    )
}

/// Cells of a scene with a time and an error above 0.
pub fn timed(summary: &Summary, scene: usize) -> Vec<(&Cell, &Speed)> {
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
                marked_row(cell),
            ]
        })
        .collect();
    let head = [
        "sampler".to_owned(),
        "seconds".to_owned(),
        "M samples/s".to_owned(),
        "1/(MSE · T)".to_owned(),
        "relative to uniform".to_owned(),
        "row".to_owned(),
    ];
    let scene_file = &summary.scenes[scene].name;
    let caption = format!(
        "Seconds an image of `{scene_file}` at {spp} spp and millions of samples per second, medians with their intervals; efficiency 1/(MSE · T) in 1/((W/(m² sr))² · thread-seconds), its interval \
         from those of T and of the MSE; the same over uniform sampling's."
    );
    let key = of_scene("efficiency", scene_file);
    tabulate_folded(page, &key, &format!("Seconds and efficiency in {scene_file}"), &caption, &head, &lines);
}

fn inverse(e: &Estimate) -> Estimate {
    Estimate { value: 1.0 / e.value, ci95: e.ci95.map(|[low, high]| [1.0 / high, 1.0 / low]) }
}

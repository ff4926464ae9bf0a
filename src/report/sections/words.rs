//! Words for verdicts, shared by the sections.

use crate::stats::Estimate;

use super::super::evidence::{Answer, Course, Limit, above, below, is_biased, ratio_of_roots};
use super::super::numbers::{counted, estimate, percent, short};
use super::super::summarise::{Cell, Summary};

/// A sampler's name as code.
pub fn name(summary: &Summary, sampler: usize) -> String {
    format!("`{}`", summary.samplers[sampler].label)
}

/// A scene's name as code.
pub fn scene_name(summary: &Summary, scene: usize) -> String {
    format!("`{}`", summary.scenes[scene].name)
}

/// Row ids, shortened to what tells them apart in practice; those of reference-limited cells say so.
pub fn rows(cells: &[&Cell]) -> String {
    let limited = |cell: &Cell| if cell.is_reference_limited { " reference-limited" } else { "" };
    let ids: Vec<String> = cells.iter().map(|cell| format!("{}{}", row(&cell.id), limited(cell))).collect();
    format!("({} {})", if ids.len() == 1 { "row" } else { "rows" }, ids.join(", "))
}

/// The row of a cell, marked where it is reference-limited.
pub fn marked_row(cell: &Cell) -> String {
    format!("{}{}", row(&cell.id), super::reference::mark(cell))
}

/// One row's id as code: its first eight digits.
pub fn row(id: &str) -> String {
    format!("`{}`", id.get(..8).unwrap_or(id))
}

/// Indices of the scenes with a lens, and of the others.
pub fn scenes_by_lens(summary: &Summary) -> (Vec<usize>, Vec<usize>) {
    (0..summary.scenes.len()).partition(|&scene| summary.scenes[scene].lens)
}

/// The scene that single numbers are quoted from: the first with a lens, else the first.
pub fn main_scene(summary: &Summary) -> Option<usize> {
    let (with, without) = scenes_by_lens(summary);
    with.first().or(without.first()).copied()
}

/// What a course is called.
pub fn limit_words(course: &Course) -> &'static str {
    match (course.limit(), course.is_biased()) {
        (Limit::Wrong, _) => "converges to a wrong image",
        (Limit::Stalls, _) => "stalls, no bias seen",
        (Limit::StallsBiased, _) => "stalls, and is biased",
        (Limit::Falls, Answer::Yes) => "error falls, but biased",
        (Limit::Falls, Answer::No) => "error falls, no bias seen",
        (Limit::Falls, Answer::CannotTell) => "error falls, perhaps biased",
        (Limit::Unclear, _) => "cannot tell",
    }
}

/// What bias² says, and how large a bias could have gone unseen.
pub fn bias_words(cell: &Cell, mean: Option<f64>) -> String {
    let words = bias_short(cell);
    if is_biased(&cell.bias2) != Answer::No {
        return words;
    }
    let bound = cell.bias2.ci95.map_or(0.0, |[_, high]| high.max(0.0).sqrt());
    match mean.filter(|mean| *mean > 0.0) {
        Some(mean) => format!("{words} (a root mean square of at most {} of the mean radiance)", percent(bound / mean)),
        None => format!("{words} (a root mean square of at most {})", short(bound)),
    }
}

/// The same as a share, where bias² itself stands in another table: of the MSE, or at most of the mean radiance.
pub fn bias_share_words(cell: &Cell, mean: Option<f64>) -> String {
    let share = cell.bias_share().map_or("–".to_owned(), |share| percent(share.clamp(0.0, 1.0)));
    match is_biased(&cell.bias2) {
        Answer::Yes => format!("bias² is {share} of the MSE"),
        Answer::CannotTell => format!("perhaps a bias: {share} of the MSE"),
        Answer::No => {
            let bound = cell.bias2.ci95.map_or(0.0, |[_, high]| high.max(0.0).sqrt());
            let bound = mean.filter(|mean| *mean > 0.0).map(|mean| percent(bound / mean));
            let bound = bound
                .map_or(String::new(), |bound| format!(": at most {bound} of the mean radiance, root mean square"));
            format!("no bias seen{bound}")
        }
    }
}

/// What bias² says.
pub fn bias_short(cell: &Cell) -> String {
    let value = estimate(&cell.bias2);
    match is_biased(&cell.bias2) {
        Answer::Yes => {
            let share = cell.bias_share().map(|share| format!(", {} of the MSE", percent(share.min(1.0))));
            format!("bias² {value}{}", share.unwrap_or_default())
        }
        Answer::No => format!("no bias seen: bias² {value}"),
        Answer::CannotTell => format!("perhaps a bias: bias² {value}"),
    }
}

/// `RMSE(a)/RMSE(b)` of two cells.
pub fn rmse_ratio(a: &Cell, b: &Cell) -> Option<Estimate> {
    ratio_of_roots(&a.mse, &b.mse)
}

/// A ratio with its interval.
pub fn times(ratio: &Estimate) -> String {
    estimate(ratio)
}

/// How a ratio compares with 1.
pub fn against_one(ratio: &Estimate) -> &'static str {
    match (below(ratio, 1.0), above(ratio, 1.0)) {
        (Answer::Yes, _) => "less",
        (_, Answer::Yes) => "more",
        _ => "cannot tell",
    }
}

/// In place of a number: the sampler that means the same in this scene, where one does.
pub fn same_as_cell(summary: &Summary, scene: usize, sampler: usize) -> Option<String> {
    summary.same_as(scene, sampler).map(|same| format!("as {}", name(summary, same)))
}

/// A ratio in a table.
pub fn ratio_cell(ratio: Option<Estimate>) -> String {
    ratio.map_or_else(|| "–".to_owned(), |ratio| times(&ratio))
}

/// An estimate in a table.
pub fn estimate_cell(e: Option<Estimate>) -> String {
    e.map_or_else(|| "–".to_owned(), |e| estimate(&e))
}

/// `8 replicates`, or that there is one for want of randomness.
pub fn replicates(cell: &Cell) -> String {
    if cell.is_fixed { "1, nothing random".to_owned() } else { cell.replicates.to_string() }
}

/// How many replicates intervals come from, for captions: `8 replicates (1 where nothing is random), 95 % intervals`.
pub fn level(summary: &Summary) -> String {
    let n = summary.about.experiment.replicates as usize;
    let fixed =
        if n > 1 && summary.cells.iter().any(|cell| cell.is_fixed) { " (1 where nothing is random)" } else { "" };
    format!("{}{fixed}, 95 % intervals in brackets", counted(n, "replicate", "replicates"))
}

/// `3 scenes`.
pub fn scenes(n: usize) -> String {
    counted(n, "scene", "scenes")
}

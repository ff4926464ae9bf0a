//! Words for verdicts, shared by the sections.

use crate::stats::Estimate;

use super::super::evidence::{Answer, Course, Limit, above, below, ratio_of_roots};
use super::super::numbers::{counted, estimate, percent, short, with_interval};
use super::super::summarise::{Cell, Summary};

/// A sampler's name as code.
pub fn name(summary: &Summary, sampler: usize) -> String {
    format!("`{}`", summary.samplers[sampler].label)
}

/// A scene's name as code.
pub fn scene_name(summary: &Summary, scene: usize) -> String {
    format!("`{}`", summary.scenes[scene].facts.name)
}

/// Row ids, shortened to what tells them apart in practice.
pub fn rows(cells: &[&Cell]) -> String {
    let ids: Vec<String> = cells.iter().map(|cell| row(&cell.id)).collect();
    format!("({} {})", if ids.len() == 1 { "row" } else { "rows" }, ids.join(", "))
}

/// One row's id as code: its first eight digits.
pub fn row(id: &str) -> String {
    format!("`{}`", id.get(..8).unwrap_or(id))
}

/// Indices of the scenes with a lens, and of the others.
pub fn scenes_by_lens(summary: &Summary) -> (Vec<usize>, Vec<usize>) {
    (0..summary.scenes.len()).partition(|&scene| summary.scenes[scene].facts.lens)
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
        (Limit::Stalls, _) => "right on average, but stalls",
        (Limit::Falls, Answer::Yes) => "error falls, biased",
        (Limit::Falls, Answer::No) => "error falls, no bias seen",
        (Limit::Falls, Answer::CannotTell) => "error falls, bias cannot be told",
        (Limit::Unclear, _) => "cannot tell",
    }
}

/// What bias² says, with what it would be seen by.
pub fn bias_words(cell: &Cell, mean: Option<f64>) -> String {
    let value = estimate(&cell.bias2);
    match above(&cell.bias2, 0.0) {
        Answer::Yes => {
            let share = cell.bias_share().map(|share| format!(", {} of the MSE", percent(share.min(1.0))));
            format!("bias² {value}{}", share.unwrap_or_default())
        }
        Answer::CannotTell if cell.bias2.ci95.is_none() => format!("bias² {value}: cannot be told from noise"),
        _ => {
            let bound = cell.bias2.ci95.map_or(0.0, |[_, high]| high.max(0.0).sqrt());
            let bound = match mean.filter(|mean| *mean > 0.0) {
                Some(mean) => format!("{} of the mean radiance", percent(bound / mean)),
                None => short(bound),
            };
            format!("no bias seen: bias² {value}, so at most {bound} (root mean square)")
        }
    }
}

/// `RMSE(a)/RMSE(b)` of two cells.
pub fn rmse_ratio(a: &Cell, b: &Cell) -> Option<Estimate> {
    ratio_of_roots(&a.mse, &b.mse)
}

/// A ratio as "x times", with words where its interval holds 1.
pub fn times(ratio: &Estimate) -> String {
    with_interval(ratio, |x| if x >= 0.0995 { format!("{x:.2}") } else { short(x) })
}

/// How a ratio compares with 1.
pub fn against_one(ratio: &Estimate) -> &'static str {
    match (below(ratio, 1.0), above(ratio, 1.0)) {
        (Answer::Yes, _) => "less",
        (_, Answer::Yes) => "more",
        _ => "cannot tell",
    }
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

/// `3 scenes`.
pub fn scenes(n: usize) -> String {
    counted(n, "scene", "scenes")
}

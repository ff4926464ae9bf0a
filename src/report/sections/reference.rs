//! What images are compared with: how far it grew, how near the errors come to its noise, and what it does not reach.

use crate::stats::Estimate;

use super::super::evidence::ratio_of_roots;
use super::super::numbers::{counted, estimate, listed, percent, short};
use super::super::summarise::{Cell, Summary};
use super::words::{name, row, scene_name};

/// Stands behind a number of a cell that is reference-limited.
pub const MARK: &str = " ‡";

/// The mark of a cell, where it needs one.
pub fn mark(cell: &Cell) -> &'static str {
    if cell.is_reference_limited { MARK } else { "" }
}

/// What the mark means, where a cell has one.
pub fn mark_words(summary: &Summary) -> Option<String> {
    let marked = summary.cells.iter().filter(|cell| cell.is_reference_limited).count();
    (marked > 0).then(|| {
        format!(
            "‡ reference-limited ({} of {}): the reference's own RMSE is more than {} of this one. Such errors stand, with the \
             reference's noise in their intervals, but slopes leave them out.",
            marked,
            counted(summary.cells.len(), "error", "errors"),
            percent(summary.reference_share())
        )
    })
}

/// How a reference has to compare with what it judges, for a reader.
pub fn share_words(summary: &Summary) -> String {
    let share = percent(summary.reference_share());
    let source = match summary.about.experiment.reference.noise {
        Some(_) => "the experiment's `noise`",
        None => "the experiment states none: half",
    };
    format!(
        "Reference-limited: an error of which the reference's own RMSE is more than {share} ({source}). It is marked ‡ in tables and \
         named beside the rows that a sentence rests on; figures show it pale; slopes leave it out."
    )
}

/// What references are, in one sentence.
pub fn what_words(summary: &Summary) -> String {
    let reference = &summary.about.experiment.reference;
    let growth = reference.noise.map(|noise| {
        format!(
            "; each half is the mean of 1, 2, 4, … independent batches of {} spp, {} at the most, until the reference's own RMSE is at \
             most {} of the smallest that it judges",
            reference.spp,
            reference.most_batches(),
            percent(noise)
        )
    });
    format!(
        "References: two independent halves of {} spp by `{}`, which is not compared{}; a closed form where the scene has one.",
        if growth.is_some() { format!("at least {}", reference.spp) } else { reference.spp.to_string() },
        reference.sampler,
        growth.unwrap_or_default()
    )
}

/// Heads of [`cells`].
pub const HEADS: [&str; 4] = ["reference", "its own RMSE", "smallest RMSE judged", "ratio"];

/// Of a scene: what its reference is made of, its own RMSE, the smallest RMSE it judges, and the first over the second.
pub fn cells(summary: &Summary, scene: usize) -> [String; 4] {
    let Some(reference) = &summary.scenes[scene].reference else { return [0; 4].map(|_| "missing".to_owned()) };
    let least = least(summary, scene);
    let judged = least.map_or("–".to_owned(), |cell| {
        let rmse = cell.rmse.map_or("below noise".to_owned(), |rmse| estimate(&rmse));
        format!("{rmse}{}", mark(cell))
    });
    let Some(spp) = reference.spp else { return ["closed form", "none", &judged, "0"].map(str::to_owned) };
    let noise =
        Estimate { value: reference.noise_mse, ci95: reference.growth.as_ref().map(|growth| growth.noise_mse_ci95) };
    let root = Estimate { value: noise.value.sqrt(), ci95: noise.ci95.map(|ends| ends.map(|end| end.max(0.0).sqrt())) };
    let (made, own) = match &reference.growth {
        None => (format!("2 × {} spp", spp.taken), short(root.value)),
        Some(growth) => (format!("2 × {} × {} spp", growth.batches, spp.taken), estimate(&root)),
    };
    let ratio = least.and_then(|cell| ratio_of_roots(&noise, &cell.mse));
    let ratio = ratio.map_or("–".to_owned(), |ratio| match ratio.ci95 {
        Some(_) => estimate(&ratio),
        None => short(ratio.value),
    });
    [made, own, judged, ratio]
}

/// The smallest error that a scene's reference judges.
fn least(summary: &Summary, scene: usize) -> Option<&Cell> {
    let cells = summary.cells.iter().filter(|cell| cell.scene == scene);
    cells.min_by(|a, b| a.mse.value.total_cmp(&b.mse.value))
}

/// For the limits of a report: how near a scene's errors come to the reference's own, and which it does not reach.
pub fn limit(summary: &Summary, scene: usize) -> Option<String> {
    let noise = summary.scenes[scene].reference_rmse()?;
    let at = scene_name(summary, scene);
    if noise == 0.0 {
        return Some(format!("{at}: the reference is exact."));
    }
    let least = least(summary, scene).map(|cell| match cell.rmse {
        Some(rmse) => format!(
            "; the smallest RMSE measured is {} ({} times it, row {})",
            short(rmse.value),
            short(rmse.value / noise),
            row(&cell.id)
        ),
        None => format!("; the smallest error measured is below its noise (row {})", row(&cell.id)),
    });
    Some(format!(
        "{at}: the reference's own RMSE is {}{}. {}{}",
        short(noise),
        least.unwrap_or_default(),
        growth_words(summary, scene),
        limited_words(summary, scene)
    ))
}

/// How far it grew and whether that was enough for the pilots.
fn growth_words(summary: &Summary, scene: usize) -> String {
    let reference = summary.scenes[scene].reference.as_ref();
    let Some((growth, spp)) = reference.and_then(|r| r.growth.as_ref().zip(r.spp)) else { return String::new() };
    let made = format!("2 × {} × {} spp", growth.batches, spp.taken);
    match growth.is_limited {
        true => format!(
            "It grew to {made}, the most it may, and is **reference-limited**: a larger `most_spp` would tell more. "
        ),
        false => format!(
            "It grew to {made}, where its RMSE is at most {} of the smallest of one image of each sampler (row {}). ",
            percent(growth.noise),
            row(&growth.pilot)
        ),
    }
}

/// Which errors are reference-limited, or that none is.
fn limited_words(summary: &Summary, scene: usize) -> String {
    let share = percent(summary.reference_share());
    let limited: Vec<String> = summary
        .cells
        .iter()
        .filter(|cell| cell.scene == scene && cell.is_reference_limited)
        .map(|cell| {
            let below = if cell.rmse.is_none() { ", below noise" } else { "" };
            format!("{} at {} spp{below}", name(summary, cell.sampler), cell.spp.asked)
        })
        .collect();
    match limited.as_slice() {
        [] => format!("It is at most {share} of every error here."),
        limited => format!("Reference-limited, since it is more than {share} of them: {}.", listed(limited)),
    }
}

//! The sheet's shortcut, which leaves out the probability with which a light was picked, beside the unbiased estimator.

use crate::experiment::spec::Estimators;
use crate::stats::Estimate;

use super::super::evidence::{Answer, Limit, clearly_above_one, is_biased, paired_ratio};
use super::super::markdown::Page;
use super::super::numbers::{estimate, listed, percent};
use super::super::summarise::{Cell, Summary};
use super::reference;
use super::words::{estimate_cell, level, limit_words, name, ratio_cell, row, rows, scene_name};
use super::{tabulate, titles};

/// The section, where the experiment asks for both estimators.
pub fn section(summary: &Summary, page: &mut Page) {
    if summary.about.experiment.estimator != Estimators::Both {
        return;
    }
    page.heading(2, titles::SHORTCUT);
    page.paragraph(
        "Where one light among several is picked, an unbiased estimate divides its light by the probability of the pick. The sheet leaves that out, as if the light picked had been the only one. \
         Both are made here with the same seeds, so nothing but that factor differs.",
    );
    let (picking, others): (Vec<usize>, Vec<usize>) =
        (0..summary.scenes.len()).partition(|&scene| summary.about.scenes[scene].picks_lights());
    if !others.is_empty() {
        let names: Vec<String> = others.iter().map(|&scene| scene_name(summary, scene)).collect();
        page.paragraph(&format!(
            "In {} no light is picked among several, so there is no such factor: the two estimators are the same there, and the images were not made twice.",
            listed(&names)
        ));
    }
    for scene in picking {
        of_scene(summary, scene, page);
    }
}

/// The two estimators of one sampler at the most samples.
struct Pair<'a> {
    sampler: usize,
    unbiased: &'a Cell,
    sheet: &'a Cell,
}

impl Pair<'_> {
    /// Mean of the shortcut's image over the unbiased one's, replicate by replicate.
    fn brightness(&self) -> Option<Estimate> {
        paired_ratio(&self.sheet.replicate_mean, &self.unbiased.replicate_mean)
    }
}

fn of_scene(summary: &Summary, scene: usize, page: &mut Page) {
    let Some(most) = summary.most_spp() else { return };
    let pair = |sampler: usize| {
        let (unbiased, sheet) = (summary.cell(scene, sampler, most)?, summary.shortcut_cell(scene, sampler, most)?);
        Some(Pair { sampler, unbiased, sheet })
    };
    let pairs: Vec<Pair> = (0..summary.samplers.len()).filter_map(pair).collect();
    let at = scene_name(summary, scene);
    if pairs.is_empty() {
        page.paragraph(&format!("Of {at} there are no rows of both estimators at {most} spp yet."));
        return;
    }
    let line = |who: String, word: &str, cell: &Cell, brightness: String| {
        vec![
            who,
            word.to_owned(),
            estimate(&cell.bias2),
            estimate_cell(cell.variance),
            format!(
                "{}{}",
                cell.rmse.map_or_else(|| "below noise".to_owned(), |rmse| estimate(&rmse)),
                reference::mark(cell)
            ),
            cell.bias_share().map_or_else(|| "–".to_owned(), |share| percent(share.min(1.0))),
            brightness,
            row(&cell.id),
        ]
    };
    let lines: Vec<Vec<String>> = pairs
        .iter()
        .flat_map(|pair| {
            let who = || name(summary, pair.sampler);
            [
                line(who(), "unbiased", pair.unbiased, "1".to_owned()),
                line(who(), "the sheet's", pair.sheet, ratio_cell(pair.brightness())),
            ]
        })
        .collect();
    let head = [
        &format!("{at}, {most} spp"),
        "estimator",
        "bias²",
        "variance",
        "RMSE",
        "bias² / MSE",
        "mean / unbiased mean",
        "row",
    ];
    let caption = format!(
        "bias², variance (both in squared radiance), RMSE in W/(m² sr) and the ratio of mean radiances (no unit) of both estimators in {at} at {most} spp; {}.",
        level(summary)
    );
    tabulate(page, &format!("shortcut-{}", summary.scenes[scene].name), &caption, &head, &lines);
    page.bullets(&pairs.iter().map(|pair| sentence(summary, scene, pair)).collect::<Vec<_>>());
}

/// Where the shortcut goes, how dark its image is, and what the unbiased estimator makes of the same samples.
fn sentence(summary: &Summary, scene: usize, pair: &Pair) -> String {
    let verdict = match summary.shortcut_course(scene, pair.sampler) {
        Some(course) => match course.limit() {
            Limit::Wrong => "the shortcut converges to a wrong image".to_owned(),
            _ => format!("the shortcut: {}", limit_words(&course)),
        },
        // One count, or an error below noise: what can be said is whether there is a bias.
        None => match is_biased(&pair.sheet.bias2) {
            Answer::Yes => "the shortcut is biased".to_owned(),
            Answer::No => "no bias of the shortcut is seen".to_owned(),
            Answer::CannotTell => "whether the shortcut is biased cannot be told".to_owned(),
        },
    };
    let share = pair.sheet.bias_share().filter(|_| is_biased(&pair.sheet.bias2) == Answer::Yes);
    let share = share.map(|share| format!(" (bias² is {} of its MSE)", percent(share.min(1.0)))).unwrap_or_default();
    // Means of images with the same seeds differ by the estimator alone: they part what the noise of bias² hides.
    let parts = |ratio: &Estimate| clearly_above_one(ratio) || clearly_above_one(&inverse(ratio));
    let is_hidden = is_biased(&pair.sheet.bias2) != Answer::Yes && pair.brightness().is_some_and(|r| parts(&r));
    let hidden = if is_hidden { ", which is a bias that bias² does not tell from noise" } else { "" };
    let unbiased = match is_biased(&pair.unbiased.bias2) {
        Answer::No => "of the unbiased estimator no bias is seen",
        Answer::Yes => "the unbiased estimator under this sampler shows a bias, too",
        Answer::CannotTell => "whether the unbiased estimator has a bias under this sampler cannot be told",
    };
    format!(
        "{} in {}: {verdict}{share}, {}{hidden}; {unbiased}. {}",
        name(summary, pair.sampler),
        scene_name(summary, scene),
        brightness_words(pair.brightness()),
        rows(&[pair.sheet, pair.unbiased])
    )
}

/// One over a ratio.
fn inverse(ratio: &Estimate) -> Estimate {
    Estimate { value: 1.0 / ratio.value, ci95: ratio.ci95.map(|[low, high]| [1.0 / high, 1.0 / low]) }
}

/// How the brightness of the whole image compares.
fn brightness_words(ratio: Option<Estimate>) -> String {
    let Some(ratio) = ratio else { return "its brightness cannot be compared".to_owned() };
    let inverse = inverse(&ratio);
    // By twice the interval's distance, as a bias is called.
    match (clearly_above_one(&inverse), clearly_above_one(&ratio)) {
        (true, _) => format!("darker by a factor of {}", estimate(&inverse)),
        (_, true) => format!("brighter by a factor of {}", estimate(&ratio)),
        _ => format!("its mean is {} of the unbiased one's, so whether it is darker cannot be told", estimate(&ratio)),
    }
}

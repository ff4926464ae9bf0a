//! Convergence, and what part of the error is bias.

use crate::stats::{Estimate, IntervalKind, LACK_OF_FIT_LEVEL, LEAST_RESIDUAL};

use super::super::evidence::{Answer, above, below};
use super::super::markdown::{Page, link_to, table_ref};
use super::super::numbers::{counted, estimate, listed, percent, short, slope_text, with_interval};
use super::super::summarise::{SLOPE_COUNTS, Slope, Summary};
use super::super::write::Figures;
use super::reference;
use super::words::{estimate_cell, level, name, replicates, row, same_as_cell, scene_name};
use super::{show, tabulate, tabulate_folded, titles};

/// What independent samples have.
const INDEPENDENT: f64 = -0.5;

/// A slope in a table: a star where its interval is not one of replicates, `–` where there is none.
fn slope_cell(slope: Option<&Slope>) -> String {
    let Some(fit) = slope.and_then(|slope| slope.fit.as_ref()) else { return "–".to_owned() };
    let star = if fit.interval == IntervalKind::Residuals { "*" } else { "" };
    format!("{}{star} ({})", with_interval(&slope_estimate(fit), slope_text), fit.points)
}

/// [`slope_cell`], or that there is no one slope and what the last step's is.
fn power_cell(summary: &Summary, scene: usize, sampler: usize) -> String {
    let slope = summary.slope(scene, sampler);
    if !is_no_power_law(slope) {
        return slope_cell(slope);
    }
    let last = summary.last_step(scene, sampler);
    let last = last
        .map(|step| format!("; from {} to {} spp {}", step.from, step.to, with_interval(&step.slope(), slope_text)));
    format!("no power law{}", last.unwrap_or_default())
}

fn is_no_power_law(slope: Option<&Slope>) -> bool {
    slope.and_then(|slope| slope.fit.as_ref()).is_some_and(crate::stats::SlopeFit::is_no_power_law)
}

fn slope_estimate(fit: &crate::stats::SlopeFit) -> Estimate {
    Estimate { value: fit.slope, ci95: fit.ci95 }
}

/// The section.
pub fn section(summary: &Summary, figures: &Figures, page: &mut Page) {
    page.heading(2, titles::CONVERGENCE);
    let caption = format!(
        "RMSE in W/(m² sr) against samples per pixel taken, a panel a scene: {}; {} with 95 % bands; thin lines: slopes −1/2 and −1; dotted: the reference's own noise{}. \
         The numbers are in {}.",
        scenes_by_size(summary),
        counted(summary.about.experiment.replicates as usize, "replicate", "replicates"),
        if reference::mark_words(summary).is_some() { "; pale markers: reference-limited" } else { "" },
        table_ref("rmse")
    );
    show(page, figures, "convergence", true, &caption);
    let mut head = vec!["slope of RMSE".to_owned()];
    head.extend((0..summary.scenes.len()).map(|scene| scene_name(summary, scene)));
    let lines: Vec<Vec<String>> = (0..summary.samplers.len())
        .map(|sampler| {
            let cells = (0..summary.scenes.len()).map(|scene| {
                same_as_cell(summary, scene, sampler).unwrap_or_else(|| power_cell(summary, scene, sampler))
            });
            std::iter::once(name(summary, sampler)).chain(cells).collect()
        })
        .collect();
    let (low, high) = (SLOPE_COUNTS.start(), SLOPE_COUNTS.end());
    let caption = format!(
        "Slope of log RMSE in log spp (no unit), powers of two from {low} to {high} that the sampler takes as asked, in round brackets the number of counts fitted; {}. \"No power law\": the points are no line (lack-of-fit test at {}, \
         and one lies more than {} off), so the slope of the last step is given instead.",
        level(summary),
        percent(LACK_OF_FIT_LEVEL),
        percent(LEAST_RESIDUAL)
    );
    tabulate(page, "slopes", &caption, &head, &lines);
    let starred =
        summary.slopes.iter().filter_map(|slope| slope.fit.as_ref()).any(|fit| fit.interval == IntervalKind::Residuals);
    let star =
        if starred { "A star: one image at a count, so the interval is from the scatter about the line. " } else { "" };
    page.paragraph(&format!("{star}A slope ranks no samplers by itself: look at the error at a count, too."));
    let items: Vec<String> = (0..summary.scenes.len()).filter_map(|scene| slope_sentence(summary, scene)).collect();
    page.bullets(&items);
    let (lines, head) = rmse_table(summary);
    let caption = format!(
        "RMSE in W/(m² sr) at every count of samples per pixel asked for, {}; intervals are in [summary.csv](summary.csv).",
        counted(summary.about.experiment.replicates as usize, "replicate", "replicates")
    );
    tabulate_folded(page, "rmse", "RMSE at every count", &caption, &head, &lines);
    if let Some(words) = reference::mark_words(summary) {
        page.paragraph(&words);
    }
}

/// `` `a01` (80x45 pixels) and `cornell` (60x60 pixels)``.
fn scenes_by_size(summary: &Summary) -> String {
    let size = |scene: usize| format!("{} ({} pixels)", scene_name(summary, scene), summary.scenes[scene].size);
    listed(&(0..summary.scenes.len()).map(size).collect::<Vec<_>>())
}

/// Which slopes are told apart from −1/2.
fn slope_sentence(summary: &Summary, scene: usize) -> Option<String> {
    let mut steeper = Vec::new();
    let mut flatter = Vec::new();
    let mut neither = Vec::new();
    let mut curved = Vec::new();
    for sampler in 0..summary.samplers.len() {
        let Some(fit) = summary.slope(scene, sampler).and_then(|slope| slope.fit.as_ref()) else { continue };
        let slope = slope_estimate(fit);
        if fit.is_no_power_law() {
            curved.push(name(summary, sampler));
            continue;
        }
        match (below(&slope, INDEPENDENT), above(&slope, INDEPENDENT)) {
            (Answer::Yes, _) => steeper.push(name(summary, sampler)),
            (_, Answer::Yes) => flatter.push(name(summary, sampler)),
            _ => neither.push(name(summary, sampler)),
        }
    }
    let part = |list: &[String], words: &str| {
        if list.is_empty() { None } else { Some(format!("{words} {}", listed(list))) }
    };
    let parts: Vec<String> = [
        part(&steeper, "steeper than independent samples' −1/2 with the whole interval:"),
        part(&flatter, "flatter:"),
        part(&neither, "not told apart from it:"),
        part(&curved, "no power law, so not ranked:"),
    ]
    .into_iter()
    .flatten()
    .collect();
    (!parts.is_empty()).then(|| format!("In {}, {}.", scene_name(summary, scene), parts.join("; ")))
}

/// RMSE at every count, one line a scene and sampler.
fn rmse_table(summary: &Summary) -> (Vec<Vec<String>>, Vec<String>) {
    let spp = &summary.about.experiment.spp;
    let mut head = vec!["RMSE".to_owned(), "sampler".to_owned()];
    head.extend(spp.iter().map(|n| format!("{n} spp")));
    let lines = (0..summary.scenes.len())
        .flat_map(|scene| summary.compared(scene).map(move |sampler| (scene, sampler)))
        .map(|(scene, sampler)| {
            let cells = spp.iter().map(|&n| {
                let cell = summary.cell(scene, sampler, n);
                cell.map_or("missing".to_owned(), |cell| match cell.rmse {
                    Some(rmse) => format!("{}{}", short(rmse.value), reference::mark(cell)),
                    None => format!("below noise{}", reference::mark(cell)),
                })
            });
            [scene_name(summary, scene), name(summary, sampler)].into_iter().chain(cells).collect()
        })
        .collect();
    (lines, head)
}

/// bias² and variance.
pub fn bias_and_variance(summary: &Summary, figures: &Figures, page: &mut Page) {
    page.heading(2, titles::BIAS);
    let Some(most) = summary.most_spp() else { return };
    let caption = format!(
        "Bias² and variance at {most} spp in (W/(m² sr))², a group a scene: {}; {} with 95 % intervals; what reaches the left edge is not told apart from 0. What each does \
         as samples are added is in {}; the numbers are in {}.",
        scenes_by_size(summary),
        counted(summary.about.experiment.replicates as usize, "replicate", "replicates"),
        link_to(titles::DECISIONS),
        table_ref("bias")
    );
    show(page, figures, "bias-and-variance", true, &caption);
    let lines: Vec<Vec<String>> = (0..summary.scenes.len())
        .flat_map(|scene| (0..summary.samplers.len()).map(move |sampler| (scene, sampler)))
        .filter_map(|(scene, sampler)| {
            let cell = summary.cell(scene, sampler, most)?;
            let variance = if cell.is_fixed { "none: nothing random".to_owned() } else { estimate_cell(cell.variance) };
            Some(vec![
                scene_name(summary, scene),
                name(summary, sampler),
                estimate(&cell.bias2),
                variance,
                format!("{}{}", estimate(&cell.mse), reference::mark(cell)),
                cell.bias_share().map_or("–".to_owned(), percent),
                replicates(cell),
                row(&cell.id),
            ])
        })
        .collect();
    let caption = format!(
        "Squared bias, variance and their sum, the mean square error (MSE), in (W/(m² sr))² at {most} spp; {}.",
        level(summary)
    );
    let head = ["scene", "sampler", "bias²", "variance", "MSE", "bias² / MSE", "replicates", "row"];
    tabulate_folded(page, "bias", "The numbers of the figure", &caption, &head, &lines);
    let fixed: Vec<String> = (0..summary.samplers.len())
        .filter(|&i| summary.cells.iter().any(|cell| cell.sampler == i && cell.is_fixed))
        .map(|i| name(summary, i))
        .collect();
    if !fixed.is_empty() {
        page.paragraph(&format!(
            "With nothing random in {}, there is one image: all of its error is bias, and its interval holds the reference's noise alone.",
            listed(&fixed)
        ));
    }
}

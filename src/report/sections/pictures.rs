//! Pictures: the four stages, strips with enlarged details at equal samples and at equal time, error maps.

use crate::experiment::results::ImageRow;
use crate::stats::flip::DEFAULT_PPD;

use super::super::charts::of_scene;
use super::super::markdown::{Page, figure_ref, link_to, table_ref};
use super::super::numbers::{counted, listed, percent, short, signed};
use super::super::pictured::rmse_words;
use super::super::shots::{EqualTime, OVER_BUDGET, PictureSet, Shot, equal_time};
use super::super::summarise::Summary;
use super::super::write::{FigureState, Figures};
use super::words::{name, row, scene_name};
use super::{show, tabulate, titles};

/// The sheet's Figure 1.
pub fn stages(summary: &Summary, figures: &Figures, page: &mut Page) {
    let Some(set) = summary.figure_1() else { return };
    page.heading(2, "Figure 1 of the sheet");
    if set.stages.len() < set.stages_planned() {
        page.paragraph("Not all of the stages were rendered yet.");
        return;
    }
    let rows: Vec<String> = set.stages_shown().iter().map(|stage| row(&stage.id)).collect();
    let number = ["no", "one", "two", "three", "four"][rows.len().min(4)];
    let lens = if set.has_lens { ", a sampled lens" } else { "" };
    let lights = if set.has_lights { ", sampled lights" } else { "" };
    let caption = format!(
        "{} in {number} stages, each with one decision more than the one before: pixel centres and albedo, a sampled pixel{lens}{lights}. \
         {}, {} pixels, exposure {} (brightness of the picture alone), rows {}.",
        scene_name(summary, set.scene),
        made_by(&set.stages_shown()),
        set.pictures.size,
        set.exposure,
        listed(&rows)
    );
    show(page, figures, "stages", false, &caption);
}

/// Who made the stages and with how many samples: "by `uniform`, 1 and 26 spp".
fn made_by(stages: &[&ImageRow]) -> String {
    let mut samplers: Vec<String> = stages.iter().map(|stage| format!("`{}`", stage.sampler)).collect();
    let mut counts: Vec<String> = stages.iter().map(|stage| stage.spp.taken.to_string()).collect();
    samplers.dedup();
    counts.dedup();
    format!("By {}, {} spp", listed(&samplers), listed(&counts))
}

/// Equal samples and equal time side by side, scene by scene.
pub fn strips(summary: &Summary, figures: &Figures, page: &mut Page) {
    if summary.about.experiment.pictures.is_empty() {
        return;
    }
    page.heading(2, titles::PICTURES);
    page.paragraph(&format!(
        "One picture of each sampler and count, so these numbers have no intervals; those of {} do. To flip between the whole pictures, open \
         `images/flip/SCENE/` in an image viewer after a run (in the order of the tables; kept out of the repository).",
        link_to(titles::CONVERGENCE)
    ));
    for set in &summary.pictured {
        let scene = &summary.scenes[set.scene].name;
        page.heading(3, &format!("Pictures of {scene}"));
        if set.shots.is_empty() {
            page.paragraph("No pictures were rendered yet.");
            continue;
        }
        at_equal_samples(summary, set, figures, page);
        at_equal_time(summary, set, figures, page);
    }
}

/// Whether a figure is there, or was asked for.
fn is_known(figures: &Figures, name: &str) -> bool {
    figures.state(name) != FigureState::Absent("its rows are not there".to_owned())
}

fn at_equal_samples(summary: &Summary, set: &PictureSet, figures: &Figures, page: &mut Page) {
    let scene = &summary.scenes[set.scene].name;
    let shots = set.at_equal_spp();
    let (asked, size) = (set.pictures.equal_spp(), set.pictures.size);
    let count = counted(shots.len(), "sampler", "samplers");
    let words = figures.details.get(scene);
    let frames = if words.is_some() { "; frames: the details enlarged below" } else { "" };
    let reference = match set.reference.as_ref().map(|row| row.halves.is_some()) {
        Some(false) => "a closed form".to_owned(),
        made => {
            let by = made.and(set.reference.as_ref()).map(|row| format!(" by `{}`", row.sampler)).unwrap_or_default();
            format!("the mean of two halves of {} spp{by}", set.pictures.reference_spp)
        }
    };
    let caption = format!(
        "The reference of the pictures of `{scene}`, {reference}, {size} pixels, exposure {}{frames}.",
        set.exposure
    );
    show(page, figures, &of_scene("reference", scene), false, &caption);
    let details = of_scene("details", scene);
    if is_known(figures, &details) {
        let caption = format!(
            "Details of `{scene}` at equal samples: {asked} spp asked, the reference and {count}{}. Under each detail its own RMSE, then samples taken, \
             RMSE and correlation ρ of neighbouring pixels' errors of the whole picture; RMSE in W/(m² sr).",
            left_to_right(words)
        );
        show(page, figures, &details, false, &caption);
    }
    let caption = format!(
        "Signed error of the same pictures of `{scene}`, luminance in W/(m² sr): red where too bright, blue where too dark, one scale for all. Even grain is \
         noise; lines, blotches and outlines are structure.",
    );
    show(page, figures, &of_scene("errors", scene), false, &caption);
    let lines: Vec<Vec<String>> = shots.iter().map(|shot| shot_line(summary, shot)).collect();
    let caption = format!(
        "The pictures of `{scene}` at {asked} spp asked: samples taken, RMSE and mean radiance in W/(m² sr), correlation ρ of neighbouring pixels' errors \
         (no unit), and FLIP: how different the picture looks from the reference at exposure {}, mean over its pixels, 0 to 1, on a screen of {DEFAULT_PPD:.0} pixels a degree. FLIP is perceptual: it saturates and depends on \
         exposure and screen, and is no estimator of variance or of any error beside it. One image each.",
        set.exposure
    );
    let head = ["picture", "spp taken", "RMSE", "ρ of neighbours", "FLIP (perceptual)", "mean radiance", "row"];
    tabulate(page, &of_scene("pictures", scene), &caption, &head, &lines);
}

fn left_to_right(words: Option<&Vec<String>>) -> String {
    match words.map(Vec::as_slice) {
        None | Some([]) => String::new(),
        Some([one]) => format!("; {one}"),
        Some(all) => format!("; left to right {}", all.join(", ")),
    }
}

fn shot_line(summary: &Summary, shot: &Shot) -> Vec<String> {
    let rho = shot.row.errors.as_ref().and_then(|errors| errors.error_autocorrelation);
    vec![
        name(summary, shot.sampler),
        shot.row.spp.taken.to_string(),
        rmse_words(&shot.row).unwrap_or("–".to_owned()),
        rho.map_or("–".to_owned(), signed),
        shot.row.errors.as_ref().and_then(|errors| errors.flip).map_or("–".to_owned(), short),
        short(shot.row.mean),
        row(&shot.row.id),
    ]
}

fn at_equal_time(summary: &Summary, set: &PictureSet, figures: &Figures, page: &mut Page) {
    if set.pictures.spp.len() < 2 {
        return;
    }
    let scene = &summary.scenes[set.scene].name;
    let Some(uniform) = summary.uniform() else { return };
    let Some(found) = equal_time(summary, set) else {
        return page.paragraph(&format!(
            "Nothing is shown of `{scene}` at equal time: there are no seconds of uniform sampling at the count that sets the budget."
        ));
    };
    let (asked, figure) = (set.pictures.equal_spp(), of_scene("equal-time", scene));
    let counts: Vec<String> = set.pictures.spp.iter().map(u32::to_string).collect();
    let rule = format!(
        "the budget is what {} takes at {asked} spp, {} s; of {} spp each sampler shows the count whose seconds come nearest, no more than {} above it (seconds: medians of repeated timings at {}, \
         scaled by pixels, between their counts on a line of logarithms)",
        name(summary, uniform),
        short(found.budget),
        listed(&counts),
        percent(OVER_BUDGET),
        summary.scenes[set.scene].size
    );
    if is_known(figures, &figure) {
        let caption = format!(
            "The same details of `{scene}` at equal time: {rule}. Under each detail its own RMSE, then samples, seconds and RMSE \
             of the whole picture; RMSE in W/(m² sr)."
        );
        show(page, figures, &figure, false, &caption);
    }
    let table = of_scene("equal-time-table", scene);
    let lines: Vec<Vec<String>> = found
        .choices
        .iter()
        .map(|choice| {
            vec![
                name(summary, choice.shot.sampler),
                choice.shot.row.spp.taken.to_string(),
                short(choice.seconds),
                short(choice.seconds / found.budget),
                rmse_words(&choice.shot.row).unwrap_or("–".to_owned()),
                row(&choice.shot.row.id),
            ]
        })
        .collect();
    let caption = format!(
        "The pictures of `{scene}` at equal time: {rule}. RMSE in W/(m² sr); one image each, timed on this machine."
    );
    tabulate(page, &table, &caption, &["picture", "spp taken", "seconds", "seconds / budget", "RMSE", "row"], &lines);
    page.sentences(&[
        smaller_at_equal_time(set, uniform, &found, &table, &figure, is_known(figures, &figure)),
        ladder_words(summary, &found),
        load_words(&found),
    ]);
}

/// Whether other work on the machine makes single timings a poor measure.
fn load_words(found: &EqualTime) -> String {
    let Some(([low, high], threads)) = found.load() else { return String::new() };
    if !found.is_loaded() {
        return String::new();
    }
    format!(
        "**The machine had other work**: its load average was {low:.1} to {high:.1} while these pictures used {}. Medians of repeated timings bear that better than single ones do, but are rough too, so who has the smaller error in equal time \
         is not said here.",
        counted(threads, "thread", "threads")
    )
}

/// How many pictures have a smaller error than uniform sampling's in its time.
fn smaller_at_equal_time(
    set: &PictureSet,
    uniform: usize,
    found: &EqualTime,
    table: &str,
    figure: &str,
    is_drawn: bool,
) -> String {
    if found.is_loaded() {
        return String::new();
    }
    let mse = |shot: &Shot| shot.row.errors.as_ref().map(|errors| errors.mse_unbiased);
    let Some(base) = set.shot(uniform, set.pictures.equal_spp()).and_then(mse) else { return String::new() };
    let others: Vec<f64> =
        found.choices.iter().filter(|c| c.shot.sampler != uniform).filter_map(|c| mse(c.shot)).collect();
    let smaller = others.iter().filter(|mse| **mse < base).count();
    let places = if is_drawn { format!("{}, {}", figure_ref(figure), table_ref(table)) } else { table_ref(table) };
    format!(
        "In the time of uniform sampling {smaller} of {} have a smaller RMSE than its picture ({places}); what replicates say of it is in {}.",
        counted(others.len(), "other picture", "other pictures"),
        link_to(titles::SPEED)
    )
}

/// Where the ladder of counts does not bracket the budget.
fn ladder_words(summary: &Summary, found: &EqualTime) -> String {
    let names = |samplers: Vec<usize>| listed(&samplers.into_iter().map(|i| name(summary, i)).collect::<Vec<_>>());
    let last: Vec<usize> = found.choices.iter().filter(|c| c.is_last_rung).map(|c| c.shot.sampler).collect();
    let mut sentences = Vec::new();
    if !last.is_empty() {
        sentences.push(format!(
            "The ladder of counts ends more than {} below the budget for {}: more samples would have fitted.",
            percent(OVER_BUDGET),
            names(last)
        ));
    }
    if !found.too_dear.is_empty() {
        sentences.push(format!("Every count of {} took longer than the budget allows.", names(found.too_dear.clone())));
    }
    sentences.join(" ")
}

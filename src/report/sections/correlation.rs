//! Decisions in step, and one pattern in every pixel.

use crate::sampling::{Order, Random, SamplerSpec, Scope};
use crate::stats::Estimate;

use super::super::evidence::{Answer, Limit, above, below, ratio};
use super::super::markdown::Page;
use super::super::numbers::{estimate, listed, percent, short, signed, signed_estimate};
use super::super::pairing;
use super::super::summarise::{Cell, Summary};
use super::titles;
use super::words::{
    against_one, bias_words, estimate_cell, limit_words, name, ratio_cell, rmse_ratio, row, rows, scene_name,
    scenes_by_lens, times,
};

/// The literal reading against its cure.
pub fn between_decisions(summary: &Summary, page: &mut Page) {
    page.heading(3, titles::DECISIONS);
    let pairs = summary.literal_pairs();
    if pairs.is_empty() {
        page.paragraph("The literal reading of the sheet and its cure were not run side by side, so nothing is said of decisions in step.");
        return;
    }
    page.paragraph(
        "Read literally, the sheet lets every decision walk through the same set in the same order: sample i takes the i-th point for the pixel, \
         the i-th for the lens and the i-th for the light. Each decision alone is sampled evenly, but one decision's point tells the next one's, \
         and most combinations are never seen.",
    );
    pairing_table(summary, page);
    let (with, without) = scenes_by_lens(summary);
    for &scene in with.iter().chain(&without) {
        scene_block(summary, scene, &pairs, page);
    }
    if with.is_empty() {
        page.paragraph("No scene of this experiment has a lens, so what decisions in step do to one was not measured.");
    }
}

/// What two decisions of one pixel do to an integrand that needs both.
fn pairing_table(summary: &Summary, page: &mut Page) {
    let measured: Vec<(usize, Vec<pairing::Paired>)> = (0..summary.samplers.len())
        .filter_map(|i| Some((i, pairing::measure(&summary.samplers[i].spec()?, summary.about.experiment.seed)?)))
        .collect();
    if measured.is_empty() {
        return;
    }
    page.paragraph(&format!(
        "The smallest case, straight from the samplers and without a renderer: the mean of ‖u − v‖², u and v the points of two decisions of one pixel. \
         Its truth is 1/3. Each of {} replicates gives one mean; below are their mean with its 95 % interval and their spread (standard deviation).",
        pairing::REPLICATES
    ));
    let head: Vec<String> = std::iter::once("sampler".to_owned())
        .chain(pairing::COUNTS.iter().flat_map(|n| [format!("mean, n = {n}"), format!("spread, n = {n}")]))
        .collect();
    let lines: Vec<Vec<String>> = measured
        .iter()
        .map(|(sampler, values)| {
            let cells = values.iter().flat_map(|v| [estimate(&v.mean), short(v.spread)]);
            std::iter::once(name(summary, *sampler)).chain(cells).collect()
        })
        .collect();
    page.table(&head.iter().map(String::as_str).collect::<Vec<_>>(), &lines);
    let wrong: Vec<String> = measured
        .iter()
        .filter(|(_, values)| values.last().is_some_and(pairing::Paired::is_wrong))
        .map(|(sampler, _)| name(summary, *sampler))
        .collect();
    let stuck: Vec<String> = measured
        .iter()
        .filter(|(_, values)| !values.last().is_some_and(pairing::Paired::is_wrong) && pairing::is_stuck(values))
        .map(|(sampler, _)| name(summary, *sampler))
        .collect();
    let last = pairing::COUNTS[pairing::COUNTS.len() - 1];
    let mut sentences = Vec::new();
    if !wrong.is_empty() {
        sentences
            .push(format!("At n = {last} the mean's interval excludes 1/3 by more than 0.01 for {}.", listed(&wrong)));
    }
    if !stuck.is_empty() {
        sentences.push(format!(
            "Of {} the mean is not told to miss, but the spread at n = {last} is more than half of that at n = {}: more samples do not help.",
            listed(&stuck),
            pairing::COUNTS[0]
        ));
    }
    if wrong.is_empty() && stuck.is_empty() {
        sentences.push("None of these samplers misses it, and none is stuck.".to_owned());
    }
    page.sentences(&sentences);
}

/// The table of one scene and what it says.
fn scene_block(summary: &Summary, scene: usize, pairs: &[(usize, usize)], page: &mut Page) {
    let Some((from, to)) = summary.course_counts() else {
        return page.paragraph("One count of samples tells no course of an error.");
    };
    let lens = if summary.scenes[scene].lens { "with a lens" } else { "without a lens" };
    page.heading(4, &format!("{} ({lens})", summary.scenes[scene].name));
    let lines: Vec<Vec<String>> =
        (0..summary.samplers.len()).filter_map(|sampler| course_row(summary, scene, sampler, from, to)).collect();
    let head = [
        "sampler".to_owned(),
        format!("RMSE at {to} spp"),
        format!("RMSE {to} / {from}"),
        format!("bias² at {to} spp"),
        "bias² / MSE".to_owned(),
        format!("variance {to} / {from}"),
        "so it".to_owned(),
        "row".to_owned(),
    ];
    page.table(&head.iter().map(String::as_str).collect::<Vec<_>>(), &lines);
    let border = summary.uniform().and_then(|uniform| summary.course(scene, uniform));
    let border = border
        .map(|c| format!("Independent samples make it {}; the border is {}.", short(c.independent), short(c.border())));
    page.sentences(&[border.unwrap_or_default()]);
    let items: Vec<String> =
        pairs.iter().filter_map(|&(sheet, best)| literal_sentence(summary, scene, sheet, best)).collect();
    page.bullets(&items);
    page.sentences(&[shuffle_sentence(summary, scene, pairs).unwrap_or_default()]);
    if let Some(uniform) = summary.uniform() {
        page.sentences(&[control_sentence(summary, scene, uniform).unwrap_or_default()]);
    }
}

fn course_row(summary: &Summary, scene: usize, sampler: usize, from: u32, to: u32) -> Option<Vec<String>> {
    let (low, high) = (summary.cell(scene, sampler, from)?, summary.cell(scene, sampler, to)?);
    let course = summary.course(scene, sampler);
    let variance = low.variance.zip(high.variance).and_then(|(low, high)| ratio(&high, &low));
    Some(vec![
        name(summary, sampler),
        estimate_cell(high.rmse),
        ratio_cell(course.map(|course| course.rmse_ratio)),
        estimate(&high.bias2),
        high.bias_share().map_or("–".to_owned(), percent),
        if high.is_fixed { "nothing random".to_owned() } else { ratio_cell(variance) },
        course.map_or("cannot tell", |course| limit_words(&course)).to_owned(),
        row(&high.id),
    ])
}

/// What happened to the literal reading of one family in one scene, and whether keeping decisions apart cured it.
pub fn literal_sentence(summary: &Summary, scene: usize, sheet: usize, best: usize) -> Option<String> {
    let (from, to) = summary.course_counts()?;
    let (literal, cured) = (summary.cell(scene, sheet, to)?, summary.cell(scene, best, to)?);
    let (sheet_name, best_name, at) = (name(summary, sheet), name(summary, best), scene_name(summary, scene));
    let Some(course) = summary.course(scene, sheet) else {
        let cure = cure_words(literal, cured, &best_name);
        return Some(format!(
            "{sheet_name} in {at}: an error is not above the reference's noise, so its course cannot be told. {cure} {}",
            rows(&[literal, cured])
        ));
    };
    let kept = times(&course.rmse_ratio);
    let mean = summary.scenes[scene].reference.as_ref().map(|r| r.mean);
    let bias = bias_words(literal, mean);
    let what = match course.limit() {
        Limit::Wrong => format!(
            "**{sheet_name} converges to a wrong image in {at}**: from {from} to {to} spp its RMSE stays at {kept} of what it was and its bias² at {}, with {bias}",
            ratio_cell(course.bias2_ratio)
        ),
        Limit::Stalls => {
            let low = summary.cell(scene, sheet, from)?;
            let variance = low.variance.zip(literal.variance).and_then(|(low, high)| ratio(&high, &low));
            let variance = variance.map(|v| format!("; its variance stays at {}", times(&v))).unwrap_or_default();
            format!(
                "**{sheet_name} stalls in {at}**: from {from} to {to} spp its RMSE stays at {kept} of what it was{variance}; {bias}"
            )
        }
        Limit::Falls if course.is_biased() == Answer::Yes => {
            format!(
                "{sheet_name} in {at}: the error falls to {kept} from {from} to {to} spp, but there is a bias: {bias}"
            )
        }
        Limit::Falls => format!("{sheet_name} in {at}: the error falls to {kept} from {from} to {to} spp; {bias}"),
        Limit::Unclear => format!(
            "{sheet_name} in {at}: from {from} to {to} spp the RMSE changes by {kept}: cannot tell where it goes; {bias}"
        ),
    };
    Some(format!("{what}. {} {}", cure_words(literal, cured, &best_name), rows(&[literal, cured])))
}

/// What the cure makes of the error.
fn cure_words(literal: &Cell, cured: &Cell, best_name: &str) -> String {
    let Some(gain) = rmse_ratio(literal, cured) else {
        return format!("How {best_name} compares cannot be told: an error is not above the reference's noise.");
    };
    match against_one(&gain) {
        "more" => format!("{best_name} has a smaller error: RMSE read literally / kept apart = {}.", times(&gain)),
        "less" => format!("{best_name} is no cure here: RMSE read literally / kept apart = {}.", times(&gain)),
        _ => format!(
            "Whether {best_name} is better cannot be told: RMSE read literally / kept apart = {}.",
            times(&gain)
        ),
    }
}

/// Which wrong limits and stalls shuffling alone cures: the cure reads the same set, in an order of its own for each decision.
fn shuffle_sentence(summary: &Summary, scene: usize, pairs: &[(usize, usize)]) -> Option<String> {
    let limit = |sampler: usize| summary.course(scene, sampler).map(|course| course.limit());
    let shuffled =
        |&&(_, best): &&(usize, usize)| summary.samplers[best].spec().is_some_and(|s| s.order == Order::Shuffle);
    let cured = |wanted: Limit| -> Vec<String> {
        let is_cured = |&&(sheet, best): &&(usize, usize)| {
            let unbiased = summary.course(scene, best).is_some_and(|course| course.is_biased() == Answer::No);
            limit(sheet) == Some(wanted) && limit(best) == Some(Limit::Falls) && unbiased
        };
        pairs.iter().filter(shuffled).filter(is_cured).map(|&(_, best)| name(summary, best)).collect()
    };
    let parts: Vec<String> = [(Limit::Wrong, "the wrong limit"), (Limit::Stalls, "the stall")]
        .into_iter()
        .map(|(wanted, words)| (cured(wanted), words))
        .filter(|(best, _)| !best.is_empty())
        .map(|(best, words)| format!("{words} (under {} the error falls and no bias is seen)", listed(&best)))
        .collect();
    (!parts.is_empty()).then(|| {
        format!(
            "**Shuffling cures {}**: the same points, in an order of its own for each decision.",
            parts.join(" and ")
        )
    })
}

/// Uniform sampling as the control: its decisions are independent however they march.
fn control_sentence(summary: &Summary, scene: usize, uniform: usize) -> Option<String> {
    let (from, to) = summary.course_counts()?;
    let (course, cell) = (summary.course(scene, uniform)?, summary.cell(scene, uniform, to)?);
    let mean = summary.scenes[scene].reference.as_ref().map(|r| r.mean);
    let fits = match (below(&course.rmse_ratio, course.independent), above(&course.rmse_ratio, course.independent)) {
        (Answer::CannotTell, Answer::CannotTell) => "not told apart from what independent samples do",
        (Answer::Yes, _) => "faster than independent samples do",
        _ => "more slowly than independent samples do",
    };
    Some(format!(
        "The control, {}: its numbers are independent in any order; its RMSE goes to {} of what it was from {from} to {to} spp, {fits} ({}); {}. {}",
        name(summary, uniform),
        times(&course.rmse_ratio),
        short(course.independent),
        bias_words(cell, mean),
        rows(&[cell])
    ))
}

/// The sampler that differs from this one in being new in every pixel, else the same family's `:best`.
fn twin(summary: &Summary, sampler: usize) -> Option<usize> {
    let spec = summary.samplers[sampler].spec()?;
    let each = SamplerSpec { scope: Scope::Each, ..spec }.to_string();
    let same = summary.samplers.iter().position(|s| s.canonical == each).filter(|&i| i != sampler);
    same.or_else(|| summary.preset(spec.points, crate::sampling::Preset::Best)).filter(|&i| i != sampler)
}

/// One pattern in every pixel, against a new one in each.
pub struct Pattern<'a> {
    /// Index of the sampler that repeats itself.
    pub sampler: usize,
    /// Index of its twin.
    pub twin: usize,
    /// Its cell.
    pub cell: &'a Cell,
    /// The twin's cell.
    pub other: &'a Cell,
}

impl Pattern<'_> {
    /// Do neighbouring pixels err more alike than under the twin? By intervals that do not meet; a single image of a
    /// sampler without randomness is compared as it is.
    pub fn errs_alike(&self) -> Answer {
        let (Some(rho), Some(other)) = (self.cell.error_autocorrelation, self.other.error_autocorrelation) else {
            return Answer::CannotTell;
        };
        let ends = |e: &Estimate, fixed: bool| e.ci95.or(fixed.then_some([e.value; 2]));
        match (ends(&rho, self.cell.is_fixed), ends(&other, self.other.is_fixed)) {
            (Some([low, _]), Some([_, high])) if low > high => Answer::Yes,
            (Some([_, high]), Some([low, _])) if high < low => Answer::No,
            _ => Answer::CannotTell,
        }
    }
}

/// The count that patterns are judged at: the pictures', else the middle one.
pub fn pattern_spp(summary: &Summary) -> Option<u32> {
    let e = &summary.about.experiment;
    let pictured = e.pictures.as_ref().map(|pictures| pictures.spp).filter(|spp| e.spp.contains(spp));
    pictured.or(summary.middle_spp())
}

/// All pairs of a sampler that repeats its pattern and its twin in one scene.
pub fn patterns(summary: &Summary, scene: usize) -> Vec<Pattern<'_>> {
    let Some(spp) = pattern_spp(summary) else { return Vec::new() };
    (0..summary.samplers.len())
        .filter(|&sampler| summary.samplers[sampler].repeats_in_every_pixel())
        .filter_map(|sampler| {
            let twin = twin(summary, sampler)?;
            Some(Pattern {
                sampler,
                twin,
                cell: summary.cell(scene, sampler, spp)?,
                other: summary.cell(scene, twin, spp)?,
            })
        })
        .collect()
}

/// One pattern in every pixel turns noise into structure: does it?
pub fn between_pixels(summary: &Summary, page: &mut Page) {
    page.heading(3, titles::PIXELS);
    let Some(spp) = pattern_spp(summary) else { return };
    let all: Vec<(usize, Pattern)> = (0..summary.scenes.len())
        .flat_map(|scene| patterns(summary, scene).into_iter().map(move |p| (scene, p)))
        .collect();
    page.paragraph(&format!(
        "ρ is the correlation between the errors of neighbouring pixels at {spp} spp. A sampler that shows every pixel the same points (or one axis of them) may make neighbours err \
         alike: then noise becomes structure, which the eye sees more readily and which does not average out over an area (right column: spread of the whole \
         image's mean between replicates)."
    ));
    neighbours_table(summary, spp, page);
    if all.is_empty() {
        page.paragraph("No sampler of this experiment shows every pixel the same points beside one that does not.");
    }
    let items: Vec<String> = all.iter().map(|(scene, pattern)| pattern_sentence(summary, *scene, pattern)).collect();
    page.bullets(&items);
    picture_correlations(summary, page);
}

/// ρ of every sampler in every scene.
fn neighbours_table(summary: &Summary, spp: u32, page: &mut Page) {
    let repeats: Vec<usize> =
        (0..summary.samplers.len()).filter(|&i| summary.samplers[i].repeats_in_every_pixel()).collect();
    let lines: Vec<Vec<String>> = (0..summary.scenes.len())
        .flat_map(|scene| (0..summary.samplers.len()).map(move |sampler| (scene, sampler)))
        .filter_map(|(scene, sampler)| {
            let cell = summary.cell(scene, sampler, spp)?;
            let pattern = match (repeats.contains(&sampler), summary.samplers[sampler].spec().map(|spec| spec.random)) {
                (true, Some(Random::Yxor)) => "x the same in every pixel",
                (true, None) => "in some decision the same in every pixel",
                (true, _) => "the same in every pixel",
                _ => "new in each pixel",
            };
            Some(vec![
                scene_name(summary, scene),
                name(summary, sampler),
                pattern.to_owned(),
                cell.error_autocorrelation.map_or("–".to_owned(), |rho| signed_estimate(&rho)),
                estimate_cell(cell.rmse),
                spread(&cell.replicate_mean).map_or("–".to_owned(), short),
                row(&cell.id),
            ])
        })
        .collect();
    page.table(&["scene", "sampler", "points", "ρ", "RMSE", "spread of the mean", "row"], &lines);
}

fn pattern_sentence(summary: &Summary, scene: usize, p: &Pattern) -> String {
    let (own, other, at) = (name(summary, p.sampler), name(summary, p.twin), scene_name(summary, scene));
    let rho = |cell: &Cell| cell.error_autocorrelation.map_or("undefined".to_owned(), |rho| signed_estimate(&rho));
    let verdict = match p.errs_alike() {
        Answer::Yes => format!("**In {at} neighbours err more alike under {own}**"),
        Answer::No => format!("In {at} neighbours err less alike under {own} than under {other}"),
        Answer::CannotTell => format!("Whether neighbours err more alike in {at} under {own} cannot be told"),
    };
    let error = rmse_ratio(p.cell, p.other).map_or(String::new(), |ratio| {
        let words = match against_one(&ratio) {
            "less" => "at a smaller RMSE",
            "more" => "at a larger RMSE",
            _ => "at an RMSE that is not told apart",
        };
        format!(", {words} (ratio {})", times(&ratio))
    });
    let step = summary.samplers[p.sampler].spec().is_some_and(|spec| spec.order == Order::Step);
    let step = if step { " Its decisions are in step, too." } else { "" };
    let mut text =
        format!("{verdict}: ρ = {}, {other} {}{error}.{step} {}", rho(p.cell), rho(p.other), rows(&[p.cell, p.other]));
    if let Some(first) = text.get(..1).map(str::to_uppercase) {
        text.replace_range(..1, &first);
    }
    text
}

/// The same on the larger pictures: one image each, so no interval.
fn picture_correlations(summary: &Summary, page: &mut Page) {
    let of = |sampler: usize| {
        let row = summary.pictures.iter().find(|row| row.sampler == summary.samplers[sampler].canonical)?;
        Some((sampler, row, row.errors.as_ref()?.error_autocorrelation?))
    };
    let (same, new): (Vec<_>, Vec<_>) = (0..summary.samplers.len())
        .filter_map(of)
        .partition(|(sampler, ..)| summary.samplers[*sampler].repeats_in_every_pixel());
    if same.is_empty() {
        return;
    }
    let told = |list: &[(usize, &crate::experiment::results::ImageRow, f64)]| {
        let items: Vec<String> = list
            .iter()
            .map(|(sampler, image, rho)| {
                format!("{} {} (row {})", name(summary, *sampler), signed(*rho), row(&image.id))
            })
            .collect();
        listed(&items)
    };
    let size = summary.pictures.first().map(|row| row.size.to_string()).unwrap_or_default();
    let others =
        if new.is_empty() { String::new() } else { format!(" With new points in each pixel: {}.", told(&new)) };
    page.paragraph(&format!(
        "On the pictures ({size}, one image each, so without intervals): {}.{others}",
        told(&same)
    ));
}

/// Standard deviation; none of fewer than two values.
fn spread(values: &[f64]) -> Option<f64> {
    let moments: crate::stats::Moments = values.iter().copied().collect();
    moments.std()
}

//! Decisions in step: what the literal reading of the sheet does to images.

use crate::sampling::{Order, Points, SamplerSpec};

use super::super::evidence::{Answer, Limit, above, below, ratio};
use super::super::markdown::{Page, table_ref};
use super::super::numbers::{estimate, listed, percent, short};
use super::super::pairing;
use super::super::summarise::{Cell, Summary};
use super::coupling;
use super::reference;
use super::words::{
    against_one, bias_words, estimate_cell, level, limit_words, name, ratio_cell, rmse_ratio, row, rows, scene_name,
    scenes_by_lens, times,
};
use super::{Measurements, tabulate, tabulate_folded, titles};

/// The literal reading against its cure.
pub fn between_decisions(summary: &Summary, measured: &Measurements, page: &mut Page) {
    page.heading(3, titles::DECISIONS);
    let pairs = summary.literal_pairs();
    if !pairs.is_empty() {
        page.paragraph(
            "Read literally, the sheet lets every decision walk through the same set in the same order: sample i takes the i-th point for the pixel, \
             the i-th for the lens and the i-th for the light. Each decision alone is sampled evenly, but one decision's point tells the next one's, \
             and most combinations are never seen.",
        );
    }
    coupling::between(summary, &measured.tests, page);
    if pairs.is_empty() {
        page.paragraph("The literal reading of the sheet and its cure were not run side by side, so nothing is said of what decisions in step do to images.");
        return;
    }
    pairing_table(summary, &measured.paired, page);
    let (with, without) = scenes_by_lens(summary);
    let (scenes, single): (Vec<usize>, Vec<usize>) =
        with.iter().chain(&without).copied().partition(|&scene| summary.scenes[scene].decisions.len() > 1);
    if !scenes.is_empty() {
        literal_table(summary, &scenes, &pairs, page);
    }
    let found: Vec<String> = scenes.iter().flat_map(|&scene| scene_sentences(summary, scene, &pairs)).collect();
    if found.is_empty() && !scenes.is_empty() && summary.course_counts().is_some() {
        page.paragraph("In no scene is a wrong limit or a stall of the literal reading seen.");
    }
    page.bullets(&found);
    page.sentences(&[control_sentence(summary, &scenes).unwrap_or_default()]);
    if !single.is_empty() {
        let names: Vec<String> = single.iter().map(|&scene| scene_name(summary, scene)).collect();
        page.paragraph(&format!("No two decisions meet in {}, so there is nothing to be in step.", listed(&names)));
    }
    if with.is_empty() {
        page.paragraph("No scene of this experiment has a lens, so what decisions in step do to one was not measured.");
    }
    for &scene in &scenes {
        course_table(summary, scene, page);
    }
}

/// What two decisions of one pixel do to an integrand that needs both.
fn pairing_table(summary: &Summary, measured: &[(usize, Vec<pairing::Paired>)], page: &mut Page) {
    if measured.is_empty() {
        return;
    }
    page.paragraph(
        "The smallest case, straight from the samplers and without a renderer: the mean of ‖u − v‖², u and v the points of two decisions of one pixel. \
         Its truth is 1/3.",
    );
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
    let caption = format!(
        "Mean of ‖u − v‖² (no unit) over the n points of two decisions: mean of {} replicates with its 95 % interval, and their spread (standard deviation).",
        pairing::REPLICATES
    );
    tabulate(page, "two-decisions", &caption, &head, &lines);
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

/// The literal reading of every family beside its cure, scene by scene: one line each.
fn literal_table(summary: &Summary, scenes: &[usize], pairs: &[(usize, usize)], page: &mut Page) {
    let Some((from, to)) = summary.course_counts() else {
        return page.paragraph("One count of samples tells no course of an error.");
    };
    let lines: Vec<Vec<String>> = scenes
        .iter()
        .flat_map(|&scene| pairs.iter().filter_map(move |&(sheet, best)| literal_row(summary, scene, sheet, best)))
        .collect();
    let border = scenes.iter().find_map(|&scene| summary.course(scene, summary.uniform()?));
    let border = border.map_or(String::new(), |c| {
        format!(
            " Independent samples make RMSE {to} / {from} = {}; what stays above {} is called staying.",
            short(c.independent),
            short(c.border())
        )
    });
    let caption = format!(
        "Decisions in step against decisions kept apart, at {to} spp: where the error of the literal reading goes from {from} to {to} spp, \
         and its RMSE over that of the same family's `:best`; {}. Bias² is in {}.{border}",
        level(summary),
        table_ref("bias")
    );
    let ratio = format!("RMSE {to} / {from}");
    let head = ["scene", "in step", "so it", &ratio, "kept apart", "RMSE in step / apart", "so that", "rows"];
    tabulate(page, "literal", &caption, &head, &lines);
}

fn literal_row(summary: &Summary, scene: usize, sheet: usize, best: usize) -> Option<Vec<String>> {
    let (_, to) = summary.course_counts()?;
    let (literal, cured) = (summary.cell(scene, sheet, to)?, summary.cell(scene, best, to)?);
    let course = summary.course(scene, sheet);
    let gain = rmse_ratio(literal, cured);
    let verdict = match gain.as_ref().map(against_one) {
        Some("more") => "kept apart is better",
        Some("less") => "in step is better here",
        _ => "cannot tell",
    };
    Some(vec![
        scene_name(summary, scene),
        name(summary, sheet),
        course.map_or("cannot tell: not above the reference's noise", |course| limit_words(&course)).to_owned(),
        ratio_cell(course.map(|course| course.rmse_ratio)),
        name(summary, best),
        ratio_cell(gain),
        verdict.to_owned(),
        format!("{} {}", row(&literal.id), row(&cured.id)),
    ])
}

/// What a scene's literal readings do wrong, what cures it, and the control.
fn scene_sentences(summary: &Summary, scene: usize, pairs: &[(usize, usize)]) -> Vec<String> {
    let failures = pairs.iter().filter_map(|&(sheet, best)| literal_sentence(summary, scene, sheet, best));
    failures.chain(shuffle_sentence(summary, scene, pairs)).collect()
}

/// The course of every sampler's error in one scene.
fn course_table(summary: &Summary, scene: usize, page: &mut Page) {
    let Some((from, to)) = summary.course_counts() else { return };
    let lines: Vec<Vec<String>> =
        (0..summary.samplers.len()).filter_map(|sampler| course_row(summary, scene, sampler, from, to)).collect();
    let head = [
        "sampler".to_owned(),
        format!("RMSE at {to} spp"),
        format!("RMSE {to} / {from}"),
        "bias² / MSE".to_owned(),
        format!("variance {to} / {from}"),
        "so it".to_owned(),
        "row".to_owned(),
    ];
    let at = scene_name(summary, scene);
    let caption = format!(
        "Where every sampler's error goes in {at} from {from} to {to} spp: RMSE in W/(m² sr), ratios of RMSE and variance; {}. Bias² is in {}.",
        level(summary),
        table_ref("bias")
    );
    let key = format!("course-{}", summary.scenes[scene].name);
    tabulate_folded(page, &key, &format!("All samplers in {}", summary.scenes[scene].name), &caption, &head, &lines);
}

fn course_row(summary: &Summary, scene: usize, sampler: usize, from: u32, to: u32) -> Option<Vec<String>> {
    let (low, high) = (summary.cell(scene, sampler, from)?, summary.cell(scene, sampler, to)?);
    let course = summary.course(scene, sampler);
    let variance = low.variance.zip(high.variance).and_then(|(low, high)| ratio(&high, &low));
    Some(vec![
        name(summary, sampler),
        estimate_cell(high.rmse),
        ratio_cell(course.map(|course| course.rmse_ratio)),
        high.bias_share().map_or("–".to_owned(), percent),
        if high.is_fixed { "nothing random".to_owned() } else { ratio_cell(variance) },
        format!("{}{}", course.map_or("cannot tell", |course| limit_words(&course)), reference::mark(high)),
        row(&high.id),
    ])
}

/// The wrong limit or the stall of one family's literal reading in one scene, and whether keeping decisions apart cured it;
/// `None` where neither is seen: the table says all of it.
pub fn literal_sentence(summary: &Summary, scene: usize, sheet: usize, best: usize) -> Option<String> {
    let (from, to) = summary.course_counts()?;
    let (literal, cured) = (summary.cell(scene, sheet, to)?, summary.cell(scene, best, to)?);
    let (sheet_name, at) = (name(summary, sheet), scene_name(summary, scene));
    let course = summary.course(scene, sheet)?;
    let kept = times(&course.rmse_ratio);
    let bias = bias_words(literal, summary.scenes[scene].reference.as_ref().map(|r| r.mean));
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
        Limit::StallsBiased => format!(
            "**{sheet_name} stalls in {at}, and is biased**: from {from} to {to} spp its RMSE stays at {kept} of what it was, its variance at {} and its bias² at {}; {bias}. \
             It converges to no image",
            ratio_cell(course.variance_ratio),
            ratio_cell(course.bias2_ratio)
        ),
        Limit::Falls | Limit::Unclear => return None,
    };
    Some(format!("{what}. {} {}", cure_words(literal, cured, &name(summary, best)), rows(&[literal, cured])))
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

/// Whether `b` is `a` but for the order in which decisions read the set: only then can the order be named as the cause.
///
/// That a preset of the sheet has 1-D samplers of its own counts as a difference unless it is of the same kind: jittered
/// strata, in a shuffled order.
pub fn differs_in_order_alone(a: &SamplerSpec, b: &SamplerSpec) -> bool {
    let strata = a.points == Points::Stratified;
    a.order != b.order
        && (a.points, a.random, a.scope) == (b.points, b.random, b.scope)
        && (strata || a.sheet_1d == b.sheet_1d)
}

/// What failing literal readings a shuffle cures, and whether it is the shuffle alone that differs.
fn shuffle_sentence(summary: &Summary, scene: usize, pairs: &[(usize, usize)]) -> Option<String> {
    let limit = |sampler: usize| summary.course(scene, sampler).map(|course| course.limit());
    let fails = |sampler: usize| {
        matches!(limit(sampler), Some(Limit::Wrong | Limit::Stalls | Limit::StallsBiased)).then_some(sampler)
    };
    let is_right = |&sampler: &usize| {
        let unbiased = summary.course(scene, sampler).is_some_and(|course| course.is_biased() == Answer::No);
        limit(sampler) == Some(Limit::Falls) && unbiased
    };
    let (mut alone, mut together) = (Vec::new(), Vec::new());
    for &(sheet, best) in pairs {
        let Some((sheet, spec)) = fails(sheet).zip(summary.samplers[sheet].spec()) else { continue };
        let is_shuffled =
            |&sampler: &usize| summary.samplers[sampler].spec().is_some_and(|s| s.order == Order::Shuffle);
        let same_but_order = |&sampler: &usize| {
            summary.samplers[sampler].spec().is_some_and(|other| differs_in_order_alone(&spec, &other))
        };
        let shuffled = (0..summary.samplers.len()).filter(is_shuffled).filter(is_right);
        let told = |cure: usize| format!("{} against {}", name(summary, cure), name(summary, sheet));
        match shuffled.clone().find(same_but_order) {
            Some(cure) => alone.push(told(cure)),
            None => together.extend(shuffled.into_iter().find(|&cure| cure == best).map(told)),
        }
    }
    let at = scene_name(summary, scene);
    let alone = (!alone.is_empty()).then(|| {
        format!(
            "**In {at} shuffling alone cures**: {}: the same points, in an order of its own for each decision; the error falls and no bias is seen.",
            listed(&alone)
        )
    });
    let together = (!together.is_empty()).then(|| {
        format!(
            "In {at} a shuffle with another randomisation cures, too: {}; which of the two changes does it cannot be told from these samplers.",
            listed(&together)
        )
    });
    let both: Vec<String> = [alone, together].into_iter().flatten().collect();
    (!both.is_empty()).then(|| both.join(" "))
}

/// Uniform sampling as the control: its decisions are independent however they march.
fn control_sentence(summary: &Summary, scenes: &[usize]) -> Option<String> {
    let uniform = summary.uniform()?;
    let (from, to) = summary.course_counts()?;
    let told: Vec<String> = scenes
        .iter()
        .filter_map(|&scene| {
            let (course, cell) = (summary.course(scene, uniform)?, summary.cell(scene, uniform, to)?);
            let ratio = &course.rmse_ratio;
            let fits = match (below(ratio, course.independent), above(ratio, course.independent)) {
                (Answer::CannotTell, Answer::CannotTell) => "not told apart from it",
                (Answer::Yes, _) => "below it",
                _ => "above it",
            };
            Some(format!("{} {}, {fits} {}", scene_name(summary, scene), times(ratio), rows(&[cell])))
        })
        .collect();
    let independent =
        scenes.iter().find_map(|&scene| summary.course(scene, uniform)).map(|course| course.independent)?;
    Some(format!(
        "The control, {}: its numbers are independent in any order, so from {from} to {to} spp its RMSE should go to {} of what it was. It goes to: {}.",
        name(summary, uniform),
        short(independent),
        told.join("; ")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_is_named_as_the_cause_only_where_nothing_else_differs() {
        let spec = |text: &str| SamplerSpec::parse(text, crate::sampling::Preset::Best).unwrap();
        assert!(differs_in_order_alone(&spec("stratified:sheet"), &spec("stratified:best")));
        assert!(differs_in_order_alone(&spec("ld:step:xor@each"), &spec("ld:shuffle:xor@each")));
        assert!(!differs_in_order_alone(&spec("ld:sheet"), &spec("ld:best")), "xor and Owen's scramble");
        assert!(!differs_in_order_alone(&spec("hammersley:sheet"), &spec("hammersley:best")));
        assert!(!differs_in_order_alone(&spec("ld:best"), &spec("ld:best")));
    }
}

//! Decisions in step, and one pattern in every pixel.

use crate::experiment::spec::Pictures;
use crate::sampling::{Order, Points, Random, SamplerSpec, Scope};

use super::super::evidence::{Answer, Limit, above, below, is_biased, ratio};
use super::super::markdown::{Page, link_to};
use super::super::numbers::{estimate, listed, percent, short, signed, signed_estimate};
use super::super::pairing;
use super::super::shots::{PictureSet, Shot};
use super::super::summarise::{Cell, Summary};
use super::reference;
use super::words::{
    against_one, bias_short, bias_words, estimate_cell, level, limit_words, marked_row, name, ratio_cell, rmse_ratio,
    row, rows, scene_name, scenes_by_lens, times,
};
use super::{tabulate, tabulate_folded, titles};

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
fn pairing_table(summary: &Summary, page: &mut Page) {
    let measured: Vec<(usize, Vec<pairing::Paired>)> = (0..summary.samplers.len())
        .filter_map(|i| Some((i, pairing::measure(&summary.samplers[i].spec()?, summary.about.experiment.seed)?)))
        .collect();
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
        "Decisions in step against decisions kept apart, at {to} spp: where the error of the literal reading goes from {from} to {to} spp, its bias² in (W/(m² sr))², \
         and its RMSE over that of the same family's `:best`; {}.{border}",
        level(summary)
    );
    let ratio = format!("RMSE {to} / {from}");
    let head = ["scene", "in step", "so it", &ratio, "bias²", "kept apart", "RMSE in step / apart", "so that", "rows"];
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
        estimate(&literal.bias2),
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
        format!("bias² at {to} spp"),
        "bias² / MSE".to_owned(),
        format!("variance {to} / {from}"),
        "so it".to_owned(),
        "row".to_owned(),
    ];
    let at = scene_name(summary, scene);
    let caption = format!(
        "Where every sampler's error goes in {at} from {from} to {to} spp: RMSE in W/(m² sr), bias² in its square, ratios of RMSE and variance; {}.",
        level(summary)
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
        estimate(&high.bias2),
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
    /// Number of pixels of their images.
    pub pixels: u64,
}

/// The interval of a correlation; that of one image of a sampler without randomness is ±1.96/√(2 · pixels), the spread that
/// independent errors in as many pairs of neighbours would have.
fn rho_interval(cell: &Cell, pixels: u64) -> Option<[f64; 2]> {
    let rho = cell.error_autocorrelation?;
    let half = 1.96 / (2.0 * pixels as f64).sqrt();
    rho.ci95.or((cell.is_fixed && pixels > 0).then_some([rho.value - half, rho.value + half]))
}

/// Correlations below this are called no structure, however sure they are.
pub const LEAST_RHO: f64 = 0.03;

/// Errors of neighbours that clearly go together.
pub struct Structure<'a> {
    /// The cell of the count with the largest ρ of those where it is clear.
    pub cell: &'a Cell,
    /// Whether the sampler repeats its points, or an axis of them, in every pixel: else the pattern is not the cause.
    pub repeats: bool,
}

/// Whether a correlation is clearly there: 0 more than twice as far from it as its interval's end, at least [`LEAST_RHO`],
/// and above the interval of uniform sampling's, where that was measured.
pub fn is_clear_structure(rho: f64, interval: Option<[f64; 2]>, uniform: Option<[f64; 2]>) -> bool {
    let is_above = |low: f64| uniform.is_none_or(|[_, high]| low > high);
    rho >= LEAST_RHO && interval.is_some_and(|[low, _]| low > 0.5 * rho && is_above(low))
}

/// Do neighbours err alike under a sampler in a scene, at the count of [`pattern_spp`], the middle or the largest one?
pub fn structure(summary: &Summary, scene: usize, sampler: usize) -> Option<Structure<'_>> {
    let pixels = summary.scenes[scene].pixels;
    let counts = [pattern_spp(summary), summary.middle_spp(), summary.most_spp()];
    let uniform = |spp: u32| {
        let base = summary.uniform().filter(|&uniform| uniform != sampler)?;
        rho_interval(summary.cell(scene, base, spp)?, pixels)
    };
    let rho = |cell: &Cell| cell.error_autocorrelation.map_or(0.0, |rho| rho.value);
    let clear = |cell: &&Cell| is_clear_structure(rho(cell), rho_interval(cell, pixels), uniform(cell.spp.asked));
    let cells = counts.into_iter().flatten().filter_map(|spp| summary.cell(scene, sampler, spp));
    let cell = cells.filter(clear).max_by(|a, b| rho(a).total_cmp(&rho(b)))?;
    Some(Structure { cell, repeats: summary.samplers[sampler].repeats_in_every_pixel() })
}

impl Pattern<'_> {
    /// Do neighbouring pixels err more alike than under the twin? By intervals that do not meet, see [`rho_interval`].
    pub fn errs_alike(&self) -> Answer {
        match (rho_interval(self.cell, self.pixels), rho_interval(self.other, self.pixels)) {
            (Some([low, _]), Some([_, high])) if low > high => Answer::Yes,
            (Some([_, high]), Some([low, _])) if high < low => Answer::No,
            _ => Answer::CannotTell,
        }
    }
}

/// The count that patterns are judged at: the pictures', else the middle one.
pub fn pattern_spp(summary: &Summary) -> Option<u32> {
    let e = &summary.about.experiment;
    let pictured = e.pictures.first().map(Pictures::equal_spp).filter(|spp| e.spp.contains(spp));
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
                pixels: summary.scenes[scene].pixels,
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
         alike: then noise becomes structure, which the eye sees more readily and which does not average out over an area."
    ));
    if all.is_empty() {
        page.paragraph("No sampler of this experiment shows every pixel the same points beside one that does not.");
    }
    page.sentences(&pattern_sentences(summary, &all));
    page.sentences(&[structure_sentence(summary).unwrap_or_default()]);
    pattern_table(summary, spp, &all, page);
    picture_correlations(summary, page);
    neighbours_table(summary, spp, page);
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
                marked_row(cell),
            ])
        })
        .collect();
    let caption = format!(
        "Correlation ρ of neighbouring pixels' errors (no unit) and RMSE at {spp} spp, and the spread (standard deviation) of the whole image's mean between replicates; \
         RMSE and spread in W/(m² sr); {}.",
        level(summary)
    );
    let head = ["scene", "sampler", "points", "ρ", "RMSE", "spread of the mean", "row"];
    tabulate_folded(page, "neighbours", "ρ of every sampler in every scene", &caption, &head, &lines);
}

/// Where neighbours err more alike, where less, and where it cannot be told.
fn pattern_sentences(summary: &Summary, all: &[(usize, Pattern)]) -> Vec<String> {
    let of = |answer: Answer| {
        let found = all.iter().filter(|(_, p)| p.errs_alike() == answer);
        let told: Vec<String> = found
            .map(|(scene, p)| {
                let rho = p.cell.error_autocorrelation.map_or("undefined".to_owned(), |rho| signed_estimate(&rho));
                format!("{} in {} (ρ = {rho})", name(summary, p.sampler), scene_name(summary, *scene))
            })
            .collect();
        (!told.is_empty()).then(|| listed(&told))
    };
    [
        of(Answer::Yes).map(|list| format!("**Neighbours err more alike** under {list}.")),
        of(Answer::No).map(|list| format!("They err less alike than under the sampler compared with for {list}.")),
        of(Answer::CannotTell).map(|list| format!("It cannot be told for {list}.")),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Who errs alike without a pattern that repeats, and why.
fn structure_sentence(summary: &Summary) -> Option<String> {
    let all: Vec<(usize, usize, Structure)> = (0..summary.scenes.len())
        .flat_map(|scene| (0..summary.samplers.len()).map(move |sampler| (scene, sampler)))
        .filter_map(|(scene, sampler)| Some((scene, sampler, structure(summary, scene, sampler)?)))
        .filter(|(.., found)| !found.repeats)
        .collect();
    let is_shared_bias = |(_, sampler, found): &(usize, usize, Structure)| {
        let in_step = summary.samplers[*sampler].spec().is_some_and(|spec| spec.order == Order::Step);
        in_step && is_biased(&found.cell.bias2) == Answer::Yes
    };
    let why = match all.iter().all(is_shared_bias) {
        true => " A bias of decisions in step varies slowly over the picture, so neighbours share it.",
        false => "",
    };
    let told = all.iter().map(|(scene, sampler, found)| {
        let rho = found.cell.error_autocorrelation.map_or("undefined".to_owned(), |rho| signed_estimate(&rho));
        format!(
            "{} in {} (ρ = {rho} at {} spp; {})",
            name(summary, *sampler),
            scene_name(summary, *scene),
            found.cell.spp.asked,
            bias_short(found.cell)
        )
    });
    let told: Vec<String> = told.collect();
    (!told.is_empty()).then(|| {
        format!("New points in each pixel are no protection: neighbours also err alike under {}.{why}", listed(&told))
    })
}

/// One pattern in every pixel beside a new one in each: one line a sampler and scene.
fn pattern_table(summary: &Summary, spp: u32, all: &[(usize, Pattern)], page: &mut Page) {
    let rho = |cell: &Cell| cell.error_autocorrelation.map_or("undefined".to_owned(), |rho| signed_estimate(&rho));
    let lines: Vec<Vec<String>> = all
        .iter()
        .map(|(scene, p)| {
            let in_step = summary.samplers[p.sampler].spec().is_some_and(|spec| spec.order == Order::Step);
            let verdict = match p.errs_alike() {
                Answer::Yes => "more alike",
                Answer::No => "less alike",
                Answer::CannotTell => "cannot tell",
            };
            vec![
                scene_name(summary, *scene),
                name(summary, p.sampler),
                rho(p.cell),
                name(summary, p.twin),
                rho(p.other),
                verdict.to_owned(),
                ratio_cell(rmse_ratio(p.cell, p.other)),
                if in_step { "yes" } else { "no" }.to_owned(),
                format!("{} {}", row(&p.cell.id), row(&p.other.id)),
            ]
        })
        .collect();
    let caption = format!(
        "Samplers that show every pixel the same points, or one axis of them, beside the nearest that does not, at {spp} spp: correlation ρ of neighbouring pixels' errors (no unit), \
         whether neighbours err more alike, the ratio of the two RMSE, and whether decisions march in step, which makes neighbours err alike, too; {}. One image of a sampler without randomness is compared by ±1.96/√(2 · pixels), the spread of ρ \
         under independent errors.",
        level(summary)
    );
    let head =
        ["scene", "sampler", "its ρ", "compared with", "its ρ", "neighbours err", "ratio of RMSE", "in step", "rows"];
    tabulate(page, "patterns", &caption, &head, &lines);
}

/// The same on the larger pictures: one image each, so no interval.
fn picture_correlations(summary: &Summary, page: &mut Page) {
    let told = |set: &PictureSet| {
        let repeats = |shot: &&&Shot| summary.samplers[shot.sampler].repeats_in_every_pixel();
        let rho = |shot: &Shot| shot.row.errors.as_ref()?.error_autocorrelation;
        let items: Vec<String> = set
            .at_equal_spp()
            .iter()
            .filter(repeats)
            .filter_map(|shot| {
                Some(format!("{} {} (row {})", name(summary, shot.sampler), signed(rho(shot)?), row(&shot.row.id)))
            })
            .collect();
        let (at, size) = (scene_name(summary, set.scene), set.pictures.size);
        (!items.is_empty()).then(|| format!("{at} at {size} pixels {}", listed(&items)))
    };
    let told: Vec<String> = summary.pictured.iter().filter_map(told).collect();
    if !told.is_empty() {
        page.paragraph(&format!(
            "ρ under the same points in every pixel, on the pictures (one image each, so without intervals; the others are in {}): {}.",
            link_to(titles::PICTURES),
            told.join("; ")
        ));
    }
}

/// Standard deviation; none of fewer than two values.
fn spread(values: &[f64]) -> Option<f64> {
    let moments: crate::stats::Moments = values.iter().copied().collect();
    moments.std()
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

    #[test]
    fn structure_is_called_only_where_it_is_clear() {
        let clear = |rho, half: f64, uniform| is_clear_structure(rho, Some([rho - half, rho + half]), uniform);
        assert!(clear(0.071, 0.007, Some([-0.01, 0.01])) && clear(0.071, 0.007, None));
        assert!(!clear(0.071, 0.04, None), "0 is less than twice as far as the interval's end");
        assert!(!clear(0.02, 0.001, None), "sure, but nothing to see");
        assert!(!clear(0.071, 0.007, Some([0.0, 0.07])) && !is_clear_structure(0.9, None, None));
    }
}

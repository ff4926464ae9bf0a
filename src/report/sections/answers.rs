//! The answer box: at most eight lines that answer the sheet's questions.

use crate::sampling::{Decision, Order, Points, Preset};

use super::super::charts::of_scene;
use super::super::evidence::{Answer, Limit, below};
use super::super::markdown::{Page, link_to, table_ref};
use super::super::numbers::{estimate, listed, p_words, short, signed_estimate};
use super::super::summarise::{Cell, SamplerSummary, Summary};
use super::coupling::{Dependence, SetTests, Tests, pair_words};
use super::decisions;
use super::identical::{Identity, bytes};
use super::neighbours::{NeighbourTests, patterns};
use super::pixels;
use super::titles;
use super::words::{against_one, bias_short, main_scene, name, rmse_ratio, rows, scene_name, times};

/// Lines of the box.
const MOST_LINES: usize = 8;

/// What was tested once for the whole report.
pub struct Asked<'a> {
    /// Of the samplers themselves.
    pub samplers: &'a Tests,
    /// Of neighbouring pixels.
    pub neighbours: &'a NeighbourTests,
    /// Of means and patterns.
    pub identity: &'a Identity<'a>,
}

/// The section.
pub fn section(summary: &Summary, asked: &Asked, page: &mut Page) {
    page.heading(2, "Answers");
    let Some(scene) = main_scene(summary).filter(|_| !summary.cells.is_empty()) else {
        page.paragraph("There are no comparisons yet to answer from.");
        return;
    };
    let which = decisions::answer(summary, &link_to(titles::WHICH));
    let others = [which, identical(summary, asked, scene), helps(summary, asked, scene), hurts(summary, asked)];
    let others: Vec<String> = others.into_iter().flatten().collect();
    let mut lines: Vec<String> = Points::ALL.iter().filter_map(|&points| technique(summary, points)).collect();
    lines.truncate(MOST_LINES - others.len());
    lines.extend(others);
    page.paragraph("*Advantages and disadvantages of each technique; are the outputs identical; are samples independent or correlated, and does it help?*");
    page.numbered(&lines);
}

/// Index of the family's cure, else of another of the family whose construction promises the right image, else of a preset.
fn recommended(summary: &Summary, points: Points) -> Option<usize> {
    let preset = |preset| summary.preset(points, preset);
    let sound = || {
        let is_sound = |s: &SamplerSummary| {
            s.spec().is_some_and(|spec| spec.points == points) && s.unproven(&Decision::ALL).is_none()
        };
        summary.samplers.iter().position(is_sound)
    };
    preset(Preset::Best).or_else(sound).or_else(|| preset(Preset::Sheet)).or_else(|| preset(Preset::Plain))
}

/// One technique: what it gains over uniform sampling, and what it costs.
fn technique(summary: &Summary, points: Points) -> Option<String> {
    let sampler = recommended(summary, points)?;
    let title = format!("**{}**", points.word());
    if Some(sampler) == summary.uniform() {
        return uniform_line(summary, sampler).map(|line| format!("{title}: {line}"));
    }
    let parts: Vec<String> = [gain(summary, sampler), literal(summary, points)].into_iter().flatten().collect();
    (!parts.is_empty()).then(|| format!("{title}: {}", parts.join(" ")))
}

/// Uniform sampling: the yardstick.
fn uniform_line(summary: &Summary, uniform: usize) -> Option<String> {
    let most = summary.most_spp()?;
    let cells: Vec<&Cell> = (0..summary.scenes.len()).filter_map(|scene| summary.cell(scene, uniform, most)).collect();
    let unbiased = (0..summary.scenes.len()).filter_map(|scene| summary.course(scene, uniform));
    let unbiased = unbiased.filter(|course| course.is_biased() == Answer::No).count();
    let scene = main_scene(summary)?;
    let cell = cells.iter().find(|cell| cell.scene == scene)?;
    let slope = summary.slope(scene, uniform).and_then(|slope| slope.fit.as_ref());
    let slope = slope.map(|fit| {
        let slope = crate::stats::Estimate { value: fit.slope, ci95: fit.ci95 };
        format!(", slope {}", signed_estimate(&slope))
    });
    let (base, better, others) = beaten_by(summary, scene, uniform)?;
    let right = match unbiased {
        0 => "that there is no bias cannot be claimed in any scene".to_owned(),
        n => format!(
            "advantage: no bias seen in {n} of {}, 0 being in the interval of bias²",
            super::words::scenes(cells.len())
        ),
    };
    let slow = match better {
        0 => "no other sampler is seen to do better",
        _ => "disadvantage: slow",
    };
    Some(format!(
        "{right} (in {} {}, {}); {slow}{} ({}): in {} at {} spp {better} of {others} others have a smaller error with the whole interval ({}). {}",
        scene_name(summary, scene),
        estimate(&cell.bias2),
        table_ref("bias"),
        slope.unwrap_or_default(),
        table_ref("slopes"),
        scene_name(summary, scene),
        base.spp.asked,
        table_ref("against-uniform"),
        rows(&[cell, base])
    ))
}

/// Uniform sampling's cell at the middle count, and how many of the other samplers have a smaller error than it.
fn beaten_by(summary: &Summary, scene: usize, uniform: usize) -> Option<(&Cell, usize, usize)> {
    let spp = summary.middle_spp()?;
    let base = summary.cell(scene, uniform, spp)?;
    let others: Vec<&Cell> =
        (0..summary.samplers.len()).filter(|&i| i != uniform).filter_map(|i| summary.cell(scene, i, spp)).collect();
    let better =
        others.iter().filter(|cell| rmse_ratio(cell, base).is_some_and(|r| below(&r, 1.0) == Answer::Yes)).count();
    Some((base, better, others.len()))
}

/// RMSE against uniform sampling's in every scene.
fn gain(summary: &Summary, sampler: usize) -> Option<String> {
    let (uniform, spp) = (summary.uniform()?, summary.middle_spp()?);
    let mut cells: Vec<&Cell> = Vec::new();
    let ratios: Vec<(usize, crate::stats::Estimate)> = (0..summary.scenes.len())
        .filter_map(|scene| {
            let cell = summary.cell(scene, sampler, spp)?;
            let ratio = rmse_ratio(cell, summary.cell(scene, uniform, spp)?)?;
            cells.push(cell);
            Some((scene, ratio))
        })
        .collect();
    let less = ratios.iter().filter(|(_, ratio)| against_one(ratio) == "less").count();
    let words = match (less == ratios.len(), less) {
        (true, _) => "advantage: a smaller error than uniform's in every scene, each interval below 1",
        (_, 0) => "no advantage over uniform is seen",
        _ => "advantage in some scenes",
    };
    // Of many scenes the ends alone: the table has them all.
    let mut order: Vec<usize> = (0..ratios.len()).collect();
    if ratios.len() > 3 {
        order.sort_by(|&a, &b| ratios[a].1.value.total_cmp(&ratios[b].1.value));
        order = vec![order[0], order[ratios.len() - 1]];
    }
    let told: Vec<String> =
        order.iter().map(|&i| format!("{} in {}", times(&ratios[i].1), scene_name(summary, ratios[i].0))).collect();
    let shown: Vec<&Cell> = order.iter().map(|&i| cells[i]).collect();
    let told = if ratios.len() > 3 { told.join(" to ") } else { listed(&told) };
    (!ratios.is_empty()).then(|| {
        format!(
            "{words}: at {spp} spp the RMSE of {}, over uniform's, is {told} ({}). {}",
            name(summary, sampler),
            table_ref("against-uniform"),
            rows(&shown)
        )
    })
}

/// The disadvantage of the literal reading.
fn literal(summary: &Summary, points: Points) -> Option<String> {
    let sheet = summary.preset(points, Preset::Sheet)?;
    let (from, to) = summary.course_counts()?;
    let by = |wanted: Limit| -> Vec<usize> {
        let has = |&scene: &usize| summary.course(scene, sheet).is_some_and(|course| course.limit() == wanted);
        (0..summary.scenes.len()).filter(has).collect()
    };
    let (wrong, stalls, both) = (by(Limit::Wrong), by(Limit::Stalls), by(Limit::StallsBiased));
    let told = |scenes: &[usize]| {
        let items: Vec<String> = scenes
            .iter()
            .filter_map(|&scene| {
                let (cell, course) = (summary.cell(scene, sheet, to)?, summary.course(scene, sheet)?);
                Some(format!(
                    "{} (RMSE {to} / {from} spp = {}, above {}; {})",
                    scene_name(summary, scene),
                    times(&course.rmse_ratio),
                    short(course.border()),
                    bias_short(cell)
                ))
            })
            .collect();
        listed(&items)
    };
    let mut parts = Vec::new();
    if !wrong.is_empty() {
        parts.push(format!("converges to a wrong image in {}", told(&wrong)));
    }
    if !stalls.is_empty() {
        parts.push(format!("stalls in {}", told(&stalls)));
    }
    if !both.is_empty() {
        parts.push(format!("stalls, and is biased, in {}", told(&both)));
    }
    let (who, link) = (name(summary, sheet), table_ref("literal"));
    Some(match parts.as_slice() {
        [] => format!("Read literally ({who}) no wrong limit and no stall is seen at {to} spp ({link})."),
        parts => format!("Disadvantage: read literally ({who}) it {} ({link}).", parts.join(" and ")),
    })
}

/// Are the outputs identical?
fn identical(summary: &Summary, asked: &Asked, scene: usize) -> Option<String> {
    let most = summary.most_spp()?;
    let found = bytes(summary, scene, most);
    if found.images < 2 {
        return None;
    }
    let words = match found.distinct {
        n if n == found.images => "no two are the same".to_owned(),
        n => format!("{n} are different ones"),
    };
    let means = asked.identity.truth_words(summary, scene).map_or(String::new(), |words| format!(". Yet {words}"));
    let pictured = summary.pictured.iter().filter(|set| !set.shots.is_empty());
    let pictured = pictured.min_by_key(|set| set.scene != scene).map(|set| &summary.scenes[set.scene].name);
    let looks = pictured.map_or(String::new(), |pictured| {
        format!("; how different pictures look, by FLIP: {}", table_ref(&of_scene("pictures", pictured)))
    });
    Some(format!(
        "**Identical?** By their bytes, of {} samplers' images of {} at {most} spp {words}{means} ({}, against uniform's {}{looks}).",
        found.images,
        scene_name(summary, scene),
        table_ref("means"),
        table_ref("same")
    ))
}

/// The variance of a set's mean against independent points', with its test.
fn set_words(summary: &Summary, tests: &SetTests) -> Option<String> {
    let ratio = tests.within.variances[0]?.ratio;
    Some(format!("{} {} ({})", name(summary, tests.sampler), times(&ratio), p_words(tests.variance_p[0])))
}

/// Correlation within a set helps.
fn helps(summary: &Summary, asked: &Asked, scene: usize) -> Option<String> {
    let (uniform, spp) = (summary.uniform()?, summary.middle_spp()?);
    let base = summary.cell(scene, uniform, spp)?;
    // Points that keep apart in each decision by itself: with decisions in step or joint, more than that is at work.
    let is_shuffled = |i: usize| {
        let is_set =
            |spec: crate::sampling::SamplerSpec| spec.order == Order::Shuffle && spec.points != Points::Uniform;
        summary.samplers[i].spec().is_some_and(is_set)
    };
    let best = (0..summary.samplers.len())
        .filter(|&i| i != uniform && is_shuffled(i))
        .filter_map(|i| Some((i, rmse_ratio(summary.cell(scene, i, spp)?, base)?)))
        .min_by(|a, b| a.1.value.total_cmp(&b.1.value))?;
    let of = |wanted: Dependence| asked.samplers.sets.iter().filter(|t| t.dependence() == wanted).count();
    let told = |sampler: usize| asked.samplers.set(sampler).and_then(|tests| set_words(summary, tests));
    let told: Vec<String> = [uniform, best.0].into_iter().filter_map(told).collect();
    let words = match against_one(&best.1) {
        "less" => "It helps",
        "more" => "It does not help here",
        _ => "Whether it helps cannot be told",
    };
    Some(format!(
        "**Independent or correlated?** Within a set the points of {} of {} samplers are negatively dependent (not told apart from independent: {}). Variance of a mean of xy over that of independent points: {} ({}). {words}: the RMSE of {} in {} at {spp} spp \
         is {} of uniform's ({}). {}",
        of(Dependence::Negative),
        asked.samplers.sets.len(),
        of(Dependence::NotSeen),
        listed(&told),
        table_ref("dependence"),
        name(summary, best.0),
        scene_name(summary, scene),
        times(&best.1),
        table_ref("against-uniform"),
        rows(&[summary.cell(scene, best.0, spp)?, base])
    ))
}

/// Correlation between decisions and between pixels hurts.
fn hurts(summary: &Summary, asked: &Asked) -> Option<String> {
    let parts: Vec<String> =
        [between_decisions(summary, asked), between_pixels(summary, asked)].into_iter().flatten().collect();
    (!parts.is_empty()).then(|| format!("**Does correlation hurt?** {}.", parts.join("; ")))
}

/// The worst literal reading: how its decisions are coupled, and what that costs.
fn between_decisions(summary: &Summary, asked: &Asked) -> Option<String> {
    let most = summary.most_spp()?;
    let worst = (0..summary.scenes.len())
        .filter(|&scene| summary.scenes[scene].decisions.len() > 1)
        .flat_map(|scene| summary.literal_pairs().into_iter().map(move |pair| (scene, pair)))
        .filter_map(|(scene, (sheet, best))| {
            let ratio = rmse_ratio(summary.cell(scene, sheet, most)?, summary.cell(scene, best, most)?)?;
            Some((scene, sheet, best, ratio))
        })
        .max_by(|a, b| a.3.value.total_cmp(&b.3.value));
    let (scene, sheet, best, ratio) = worst?;
    let ids = rows(&[summary.cell(scene, sheet, most)?, summary.cell(scene, best, most)?]);
    let words = match against_one(&ratio) {
        "more" => "Between decisions it can hurt",
        "less" => "Between decisions it does not hurt here",
        _ => "Whether it hurts between decisions cannot be told",
    };
    let coupled = asked.samplers.pair(sheet).and_then(pair_words);
    let coupled = coupled.map_or(String::new(), |words| format!(" (its decisions: {words}, {})", table_ref("pairs")));
    Some(format!(
        "{words}: in the worst case, {} at {most} spp, the RMSE of {}{coupled} is {} times that of {} ({}) {ids}",
        scene_name(summary, scene),
        name(summary, sheet),
        times(&ratio),
        name(summary, best),
        table_ref("literal")
    ))
}

/// The pattern that neighbours share most.
fn between_pixels(summary: &Summary, asked: &Asked) -> Option<String> {
    let alike = (0..summary.scenes.len())
        .flat_map(|scene| patterns(summary, scene).into_iter().map(move |p| (scene, p)))
        // Decisions in step bias an image, which makes neighbours alike, too: the pattern alone is shown by the others.
        .filter(|(_, p)| p.errs_alike() == Answer::Yes && !p.cell.is_fixed)
        .filter(|(_, p)| summary.samplers[p.sampler].spec().is_some_and(|spec| spec.order != Order::Step))
        .filter_map(|(scene, p)| Some((scene, p.cell, p.cell.error_autocorrelation?)))
        .max_by(|a, b| a.2.value.total_cmp(&b.2.value));
    let (scene, cell, rho) = alike?;
    let p = asked.neighbours.of(scene, cell.sampler).and_then(|test| test.p);
    let spectra = match pixels::are_there(summary) {
        true => format!(", its spectrum {}", table_ref("error-spectra")),
        false => String::new(),
    };
    Some(format!(
        "between pixels it turns noise into structure: {} in {} has ρ = {}, {} ({}{spectra}) {}",
        name(summary, cell.sampler),
        scene_name(summary, scene),
        signed_estimate(&rho),
        p_words(p),
        table_ref("neighbours"),
        rows(&[cell])
    ))
}

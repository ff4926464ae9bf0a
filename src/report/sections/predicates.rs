//! The table of advantages and disadvantages: every cell a measured predicate.
//!
//! A cell begins with *yes*, *no* or *cannot tell* and holds the number that says so, with its interval or its test.

use crate::stats::{Estimate, IntervalKind};

use super::super::evidence::{Answer, LEAST_FACTOR, Limit, above, below, clearly_above_one, clearly_below_one, ratio};
use super::super::markdown::{Page, link_to, table_ref};
use super::super::numbers::{estimate, p_words, percent, signed_estimate, slope_text, with_interval};
use super::super::stability::MARGIN;
use super::super::summarise::{Cell, Step, Summary};
use super::super::verdicts::Sameness;
use super::coupling::{Dependence, Tests, pair_words};
use super::failures::odd_count;
use super::neighbours::{LEAST_RHO, NeighbourTests, pattern_spp, structure};
use super::speed::efficiency;
use super::words::{level, limit_words, main_scene, name, ratio_cell, rmse_ratio, same_as_cell, scene_name, times};
use super::{reference, tabulate, titles};

/// The section.
pub fn section(summary: &Summary, tests: &Tests, neighbours: &NeighbourTests, page: &mut Page) {
    page.heading(2, titles::TABLE);
    page.paragraph(&format!(
        "Each cell answers its column's question with yes, no or cannot tell, by the number in it; none is an opinion. A \"yes\" is an advantage, a \"no\" a disadvantage. \"None seen\" is no proof: it bounds the bias at the largest count. \
         Rows and bias² are in {} and {}.",
        table_ref("rmse"),
        table_ref("bias"),
    ));
    if let (Some(uniform), Some(spp)) = (summary.uniform(), summary.middle_spp()) {
        let caption = format!(
            "Is its error smaller than uniform sampling's at {spp} spp? The ratio of the two RMSE (no unit): yes or no where its whole interval lies below or above 1; {}.",
            level(summary)
        );
        per_scene(
            summary,
            "against-uniform",
            &caption,
            &|scene, sampler| against_uniform(summary, scene, sampler, uniform, spp),
            page,
        );
    }
    if let Some((from, to)) = summary.course_counts() {
        let caption = format!(
            "Does its image become the right one? Never a plain \"yes\": the rows end at {to} spp. *None seen*: the error falls and no bias is seen, of which the most that it can be, as a share of the MSE (the interval's upper end); \
             \"not promised\" where the construction allows a wrong limit all the same; \"flattens\" where the last step's error falls less than that of independent samples. *No*: a bias, with the least that it can be (the lower end), or an error that stays, with RMSE {to} / {from} spp; {}.",
            level(summary)
        );
        per_scene(summary, "right-image", &caption, &|scene, sampler| right_image(summary, scene, sampler, to), page);
    }
    independence(summary, tests, neighbours, page);
    others(summary, page);
}

/// One line a sampler, one column a scene.
fn per_scene(summary: &Summary, key: &str, caption: &str, cell: &dyn Fn(usize, usize) -> String, page: &mut Page) {
    let mut head = vec!["sampler".to_owned()];
    head.extend((0..summary.scenes.len()).map(|scene| scene_name(summary, scene)));
    let lines: Vec<Vec<String>> = (0..summary.samplers.len())
        .map(|sampler| {
            let cells = (0..summary.scenes.len())
                .map(|scene| same_as_cell(summary, scene, sampler).unwrap_or_else(|| cell(scene, sampler)));
            std::iter::once(name(summary, sampler)).chain(cells).collect()
        })
        .collect();
    tabulate(page, key, caption, &head, &lines);
}

fn right_image(summary: &Summary, scene: usize, sampler: usize, to: u32) -> String {
    let (Some(course), Some(cell)) = (summary.course(scene, sampler), summary.cell(scene, sampler, to)) else {
        return "cannot tell".to_owned();
    };
    let kept = || times(&course.rmse_ratio);
    // The interval's lower end: at least that much.
    let least = cell.bias2.ci95.filter(|_| cell.mse.value > 0.0).map(|[low, _]| (low / cell.mse.value).clamp(0.0, 1.0));
    let share = || least.map_or("–".to_owned(), percent);
    let word = match (course.limit(), course.is_biased()) {
        (Limit::Wrong | Limit::Stalls | Limit::StallsBiased, _) => format!("no: {}, {}", limit_words(&course), kept()),
        (Limit::Falls, Answer::No) => {
            let unproven = summary.samplers[sampler].unproven(&summary.scenes[scene].decisions);
            let flattens = summary.last_step(scene, sampler).filter(Step::is_flatter_than_independent);
            falling_words(cell, unproven, flattens.as_ref())
        }
        (Limit::Falls, Answer::Yes) if cell.is_fixed => {
            format!("no: all of its error is bias, though it falls, {}", kept())
        }
        (Limit::Falls, Answer::Yes) => format!("no: biased, at least {} of the MSE, though its error falls", share()),
        _ => format!("cannot tell: {}", kept()),
    };
    format!("{word}{}", reference::mark(cell))
}

/// What can be said of an error that falls without a bias that is seen: how large one could be, whether the construction
/// promises that there is none, and whether the fall ends.
fn falling_words(cell: &Cell, unproven: Option<&str>, flattens: Option<&Step>) -> String {
    let most = cell.bias2.ci95.filter(|_| cell.mse.value > 0.0).map(|[_, high]| high.max(0.0) / cell.mse.value);
    let most = most.map_or(String::new(), |share| format!(": at most {} of the MSE", percent(share.min(1.0))));
    let unproven = unproven.map_or(String::new(), |why| format!("; not promised: {why}"));
    let flattens = flattens.map_or(String::new(), |step| {
        format!("; flattens: RMSE {} / {} = {}", step.to, step.from, times(&step.rmse_ratio))
    });
    format!("none seen{most}{unproven}{flattens}")
}

fn against_uniform(summary: &Summary, scene: usize, sampler: usize, uniform: usize, spp: u32) -> String {
    if sampler == uniform {
        return "1 (itself)".to_owned();
    }
    let cells = summary.cell(scene, sampler, spp).zip(summary.cell(scene, uniform, spp));
    let mark = cells.map_or("", |(own, _)| reference::mark(own));
    let Some(ratio) = cells.and_then(|(own, base)| rmse_ratio(own, base)) else { return format!("cannot tell{mark}") };
    format!("{}: {}{mark}", below(&ratio, 1.0).word(), times(&ratio))
}

// --- independent or correlated, all in one place ---

fn independence(summary: &Summary, tests: &Tests, neighbours: &NeighbourTests, page: &mut Page) {
    let Some(scene) = main_scene(summary) else { return };
    let lines: Vec<Vec<String>> = summary
        .compared(scene)
        .map(|sampler| {
            vec![
                name(summary, sampler),
                set_cell(tests, sampler),
                pair_cell(tests, sampler),
                neighbour_cell(summary, neighbours, scene, sampler),
            ]
        })
        .collect();
    let head = [
        "sampler",
        "are the points of a set independent?",
        "are decisions independent?",
        "are neighbouring pixels' errors independent?",
    ];
    let caption = format!(
        "Independent or correlated? Within a set (numbers of {}; dependence helps there, where it is negative), between decisions ({}) and between pixels in {} at {} spp ({}; *yes*: ρ is shown to lie within ±{LEAST_RHO}). p-values are Holm-adjusted \
         over their tables, 95 % intervals in brackets.",
        table_ref("dependence"),
        table_ref("pairs"),
        scene_name(summary, scene),
        pattern_spp(summary).unwrap_or(0),
        table_ref("neighbours"),
    );
    tabulate(page, "independence", &caption, &head, &lines);
}

fn set_cell(tests: &Tests, sampler: usize) -> String {
    let Some(t) = tests.set(sampler) else { return "not asked: decisions differ".to_owned() };
    let number = match t.within.variances[0] {
        Some(v) => format!("variance ratio {}, {}", estimate(&v.ratio), p_words(t.variance_p[0])),
        None => format!("near pairs {} of the expected, {}", estimate(&t.within.near), p_words(t.near_p)),
    };
    match t.dependence() {
        Dependence::NotSeen => format!("none seen: {number}"),
        Dependence::Negative => format!("no, negatively dependent: {number}"),
        Dependence::Positive => format!("no, positively dependent: {number}"),
        Dependence::Mixed => format!("no: {number}"),
    }
}

fn pair_cell(tests: &Tests, sampler: usize) -> String {
    let Some(t) = tests.pair(sampler) else { return "–".to_owned() };
    let word = if t.is_biased() || t.is_stuck() { "no" } else { "none seen" };
    pair_words(t).map_or("–".to_owned(), |words| format!("{word}: {words}"))
}

fn neighbour_cell(summary: &Summary, neighbours: &NeighbourTests, scene: usize, sampler: usize) -> String {
    let rho = pattern_spp(summary).and_then(|spp| summary.cell(scene, sampler, spp)?.error_autocorrelation);
    let Some(rho) = rho else { return "–".to_owned() };
    let test = neighbours.of(scene, sampler);
    let word = match (structure(summary, scene, sampler).is_some(), test.map(|test| test.sameness)) {
        (true, _) | (_, Some(Sameness::Different)) => "no",
        (_, Some(Sameness::Same)) => "yes",
        _ => "cannot tell",
    };
    format!("{word}: ρ = {}, {}", signed_estimate(&rho), p_words(test.and_then(|test| test.p)))
}

// --- what else tells them apart ---

/// Slope, counts between powers of two, randomness, efficiency: in the main scene.
fn others(summary: &Summary, page: &mut Page) {
    let Some(scene) = main_scene(summary) else { return };
    let at = scene_name(summary, scene);
    let odd_asked = (0..summary.samplers.len()).find_map(|i| odd_count(summary, scene, i)).map(|odd| odd.asked);
    let lines: Vec<Vec<String>> = summary
        .compared(scene)
        .map(|sampler| {
            vec![
                name(summary, sampler),
                slope_cell(summary, scene, sampler),
                odd_cell(summary, scene, sampler),
                spread_cell(summary, scene, sampler),
                efficiency_cell(summary, scene, sampler),
            ]
        })
        .collect();
    let head = [
        "sampler".to_owned(),
        "does the error fall faster than −1/2?".to_owned(),
        format!("does it keep its promise at {} spp?", odd_asked.map_or("other".to_owned(), |n| n.to_string())),
        "does the error show in replicates?".to_owned(),
        "more accuracy a second than uniform?".to_owned(),
    ];
    let caption = format!(
        "What else tells them apart, in {at}: the slope of RMSE ({}); RMSE at a count that is no power of two over that promised by its neighbours (*no*: 1 more than twice as far as the interval's end; *yes*: at most {} with the whole interval); how many \
         replicates are different images; efficiency 1/(MSE · T) over uniform's at {} spp on this machine (T: seconds × threads), whose ends join the range of T with the 95 % interval of the MSE, so they are no 95 % interval; {}. Seconds are in {}.",
        table_ref("slopes"),
        MARGIN,
        summary.middle_spp().unwrap_or(0),
        level(summary),
        link_to(titles::SPEED),
    );
    tabulate(page, "others", &caption, &head, &lines);
}

fn slope_cell(summary: &Summary, scene: usize, sampler: usize) -> String {
    let Some(fit) = summary.slope(scene, sampler).and_then(|slope| slope.fit.as_ref()) else { return "–".to_owned() };
    let (text, slope) = match fit.is_no_power_law() {
        // No one slope: the last step's.
        true => match summary.last_step(scene, sampler) {
            Some(step) => (", the last step", step.slope()),
            None => return "cannot tell: no power law".to_owned(),
        },
        false => (
            if fit.interval == IntervalKind::Residuals { "*" } else { "" },
            Estimate { value: fit.slope, ci95: fit.ci95 },
        ),
    };
    let word = match (below(&slope, -0.5), above(&slope, -0.5)) {
        (Answer::Yes, _) => "yes",
        (_, Answer::Yes) => "no",
        _ => "cannot tell",
    };
    format!("{word}: {}{text}", with_interval(&slope, slope_text))
}

fn odd_cell(summary: &Summary, scene: usize, sampler: usize) -> String {
    let Some(odd) = odd_count(summary, scene, sampler) else { return "–".to_owned() };
    let word = match (clearly_above_one(&odd.ratio), below(&odd.ratio, MARGIN)) {
        (true, _) if odd.ratio.value > LEAST_FACTOR => "no",
        (_, Answer::Yes) if clearly_below_one(&odd.ratio) => "yes, better",
        (_, Answer::Yes) => "yes",
        _ => "cannot tell",
    };
    format!("{word}: {} ({} taken)", times(&odd.ratio), odd.taken)
}

/// Different images among replicates, by their digests.
fn spread_cell(summary: &Summary, scene: usize, sampler: usize) -> String {
    let Some(cell) = summary.middle_spp().and_then(|spp| summary.cell(scene, sampler, spp)) else {
        return "–".to_owned();
    };
    let mut digests = cell.pixels.clone();
    digests.sort_unstable();
    digests.dedup();
    match (cell.is_fixed, digests.len(), cell.pixels.len()) {
        (true, ..) => "no: nothing random, one image".to_owned(),
        (_, _, 0 | 1) => "cannot tell: one replicate".to_owned(),
        (_, different, all) if different == all => format!("yes: {different} of {all} differ"),
        (_, different, all) => format!("no: {different} different ones of {all}"),
    }
}

fn efficiency_cell(summary: &Summary, scene: usize, sampler: usize) -> String {
    if summary.uniform() == Some(sampler) {
        return "1 (itself)".to_owned();
    }
    relative_efficiency(summary, scene, sampler)
        .map_or("–".to_owned(), |e| format!("{}: {}", above(&e, 1.0).word(), ratio_cell(Some(e))))
}

/// Efficiency at the middle count, over uniform sampling's.
fn relative_efficiency(summary: &Summary, scene: usize, sampler: usize) -> Option<Estimate> {
    let of = |sampler: usize| {
        let cell = summary.cell(scene, sampler, summary.middle_spp()?)?;
        efficiency(cell, summary.speed(cell)?)
    };
    let uniform = summary.uniform().filter(|&uniform| uniform != sampler)?;
    ratio(&of(sampler)?, &of(uniform)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::results::Count;

    fn cell(bias2: Estimate) -> Cell {
        let none = Estimate::without_interval(0.0);
        Cell {
            scene: 0,
            sampler: 0,
            id: String::new(),
            spp: Count { asked: 256, taken: 256 },
            replicates: 8,
            is_fixed: false,
            is_reference_limited: false,
            mse: Estimate::without_interval(1.0),
            rmse: None,
            rel_mse: none,
            bias2,
            variance: None,
            bias: none,
            error_autocorrelation: None,
            flip: None,
            error_spectrum: None,
            replicate_mse: Vec::new(),
            replicate_mean: Vec::new(),
            pixels: Vec::new(),
            twins: Vec::new(),
        }
    }

    #[test]
    fn an_error_that_falls_is_never_called_right_but_bounded() {
        let cell = cell(Estimate { value: 0.0, ci95: Some([-0.05, 0.05]) });
        let step = Step { from: 64, to: 256, rmse_ratio: Estimate { value: 0.66, ci95: Some([0.64, 0.68]) } };
        assert!(step.is_flatter_than_independent());
        assert_eq!(falling_words(&cell, None, None), "none seen: at most 5.0 % of the MSE");
        assert_eq!(
            falling_words(&cell, Some("decisions in step"), Some(&step)),
            "none seen: at most 5.0 % of the MSE; not promised: decisions in step; flattens: RMSE 256 / 64 = 0.660 [0.640, 0.680]"
        );
        let half = Step { rmse_ratio: Estimate { value: 0.5, ci95: Some([0.49, 0.51]) }, ..step };
        assert!(!half.is_flatter_than_independent(), "independent samples");
        assert!((half.slope().value + 0.5).abs() < 1e-15);
    }
}

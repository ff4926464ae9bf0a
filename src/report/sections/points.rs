//! The point sets themselves: the sheet's Figure 2, discrepancy, and how even each set is.

use crate::sampling::Points;
use crate::stats::{Estimate, IntervalKind, LACK_OF_FIT_LEVEL, LEAST_RESIDUAL, SlopeFit, slope_with_interval};

use super::super::charts::FIGURE_2_POINTS;
use super::super::evidence::{Answer, below, ratio};
use super::super::markdown::{Page, table_ref};
use super::super::numbers::{counted, estimate, listed, p_value, percent, signed_estimate};
use super::super::summarise::{PointSet, SLOPE_POINTS, Summary};
use super::super::write::Figures;
use super::coupling::{self, Tests};
use super::words::{name, ratio_cell, row};
use super::{show, tabulate, titles};

/// The sheet's Figure 2.
pub fn figure_2(summary: &Summary, figures: &Figures, page: &mut Page) {
    page.heading(2, "Figure 2 of the sheet");
    let caption = format!(
        "{FIGURE_2_POINTS} points of one decision in one pixel, seed {}, drawn from cyan (first) to red (last), origin at the bottom left. Above: the sheet's \
         samplers, `:sheet`. Below: the same sets as `:best` hands them out; where `:best` shuffles, the places are as even, but their order is \
         new for each decision, so the colours mix.",
        summary.about.experiment.seed
    );
    show(page, figures, "point-sets", false, &caption);
}

/// The star discrepancy's sets of one sampler by ascending n.
fn star_sets(summary: &Summary, sampler: usize) -> Vec<&PointSet> {
    let mut sets: Vec<&PointSet> =
        summary.point_sets.iter().filter(|set| set.sampler == sampler && set.metric == "star").collect();
    sets.sort_by_key(|set| set.n.taken);
    sets
}

/// `8 sets`.
fn sets_measured(summary: &Summary) -> String {
    counted(summary.about.experiment.points.as_ref().map_or(1, |points| points.replicates as usize), "set", "sets")
}

/// Slope of the root mean square star discrepancy in n, over powers of two from [`SLOPE_POINTS`].
fn star_slope(summary: &Summary, sampler: usize) -> Option<SlopeFit> {
    let (mut ns, mut squares) = (Vec::new(), Vec::new());
    for set in star_sets(summary, sampler) {
        if set.n.taken == set.n.asked && set.n.taken >= SLOPE_POINTS && set.n.taken.is_power_of_two() {
            let values: Option<Vec<f64>> = set.values.iter().map(|value| value.map(|v| v * v)).collect();
            ns.push(f64::from(set.n.taken));
            squares.push(values?);
        }
    }
    slope_with_interval(&ns, &squares, summary.about.experiment.seed)
}

/// Whether one slope tells how the discrepancy falls.
fn line_words(fit: &SlopeFit) -> String {
    match fit.line_p {
        None => "cannot tell".to_owned(),
        Some(_) if fit.is_no_power_law() => format!("no: {} off", percent(fit.largest_residual)),
        Some(_) => "not told apart from one".to_owned(),
    }
}

/// A slope as an estimate.
fn slope_estimate(fit: &SlopeFit) -> Estimate {
    Estimate { value: fit.slope, ci95: fit.ci95 }
}

/// Discrepancy against n.
pub fn discrepancy(summary: &Summary, figures: &Figures, page: &mut Page) {
    page.heading(2, "Discrepancy");
    if !summary.point_sets.iter().any(|set| set.metric == "star") {
        page.paragraph("No star discrepancies were measured.");
        return;
    }
    page.paragraph(
        "Star discrepancy D*: the largest gap between the share of points in a box at the origin and the box's area, exact. \
         Smaller is more even.",
    );
    let caption = format!(
        "Star discrepancy D* (no unit) of the points of one decision against their number n, mean of {} with 95 % bands; thin lines: slopes −1/2 and −1.",
        sets_measured(summary)
    );
    show(page, figures, "discrepancy", true, &caption);
    let shown: Vec<u32> = {
        let mut counts: Vec<u32> =
            summary.about.experiment.points.as_ref().map_or(Vec::new(), |points| points.n.clone());
        counts.sort_unstable();
        let largest = counts.last().copied().unwrap_or(0);
        counts.retain(|&n| n == largest || [16, 64, 256].contains(&n));
        counts
    };
    let mut head: Vec<String> = vec!["sampler".to_owned()];
    head.extend(shown.iter().map(|n| format!("D*, n = {n}")));
    head.extend(["slope in n", "p of a line", "one line?", "points of the fit"].map(str::to_owned));
    let line = |sampler: usize| {
        let sets = star_sets(summary, sampler);
        let mut cells = vec![name(summary, sampler)];
        cells.extend(shown.iter().map(|n| {
            let set = sets.iter().find(|set| set.n.asked == *n);
            set.and_then(|set| set.mean).map_or("–".to_owned(), |mean| estimate(&mean))
        }));
        let fit = star_slope(summary, sampler);
        cells.push(fit.as_ref().map_or("–".to_owned(), |fit| {
            let star = if fit.interval == IntervalKind::Residuals { "*" } else { "" };
            signed_estimate(&slope_estimate(fit)) + star
        }));
        cells.push(p_value(fit.as_ref().and_then(|fit| fit.line_p)));
        cells.push(fit.as_ref().map_or("–".to_owned(), line_words));
        cells.push(fit.map_or("0".to_owned(), |fit| fit.points.to_string()));
        cells
    };
    let caption = format!(
        "Star discrepancy D* (no unit) of one decision's points at some numbers of points n, mean of {} with 95 % intervals in brackets, and its slope in n.",
        sets_measured(summary)
    );
    let with_sets = (0..summary.samplers.len()).filter(|&i| !summary.samplers[i].is_mixed());
    tabulate(page, "discrepancy", &caption, &head, &with_sets.map(line).collect::<Vec<_>>());
    page.paragraph(&format!(
        "The slope is that of the root mean square over sets, powers of two from {SLOPE_POINTS}; independent points have −0.5. p of a line: lack-of-fit test over sets; *no* where p is below {} and a point lies more than {} off the line. {}{}",
        percent(LACK_OF_FIT_LEVEL),
        percent(LEAST_RESIDUAL),
        bent_words(summary),
        "D* of nets falls like log n / n at best, which is no power of n: such a slope holds for these n and not beyond.",
    ));
}

/// Whose discrepancy one slope does not tell.
fn bent_words(summary: &Summary) -> String {
    let bent = |&i: &usize| star_slope(summary, i).is_some_and(|fit| fit.is_no_power_law());
    let bent: Vec<String> = (0..summary.samplers.len()).filter(bent).map(|i| name(summary, i)).collect();
    if bent.is_empty() { String::new() } else { format!("No line, so no one slope: {}. ", listed(&bent)) }
}

/// How a sampler's D* at the largest n compares with uniform's; the row behind it.
pub fn star_against_uniform(summary: &Summary, sampler: usize) -> Option<(Estimate, u32, String)> {
    let uniform = summary.uniform()?;
    let last = |sampler: usize| star_sets(summary, sampler).last().copied().filter(|set| set.mean.is_some());
    let (a, b) = (last(sampler)?, last(uniform)?);
    if a.n.asked != b.n.asked {
        return None;
    }
    Some((ratio(&a.mean?, &b.mean?)?, a.n.asked, row(&a.id)))
}

/// Evenness within a set: correlation that helps.
pub fn within(summary: &Summary, tests: &Tests, page: &mut Page) {
    page.heading(3, titles::WITHIN);
    coupling::within(summary, tests, page);
    let compared: Vec<(usize, Estimate, u32, String)> = (0..summary.samplers.len())
        .filter_map(|sampler| star_against_uniform(summary, sampler).map(|(r, n, id)| (sampler, r, n, id)))
        .collect();
    let Some(n) = compared.first().map(|(_, _, n, _)| *n) else {
        page.paragraph("Nothing is said of evenness: no point sets of uniform sampling and another were measured.");
        return;
    };
    let others = || compared.iter().filter(|(sampler, ..)| Some(*sampler) != summary.uniform());
    if others().next().is_none() {
        page.paragraph("Nothing is said of evenness: no point sets of another sampler than uniform were measured.");
        return;
    }
    let even: Vec<String> = others()
        .filter(|(_, ratio, ..)| below(ratio, 1.0) == Answer::Yes)
        .map(|(sampler, ..)| name(summary, *sampler))
        .collect();
    let not: Vec<String> = others()
        .filter(|(_, ratio, ..)| below(ratio, 1.0) != Answer::Yes)
        .map(|(sampler, ..)| name(summary, *sampler))
        .collect();
    let mut sentences = Vec::new();
    if !even.is_empty() {
        sentences.push(format!(
            "By their discrepancy, too, the n = {n} points of {} are more even than independent ones: each ratio in {} lies below 1 with its whole interval.",
            listed(&even),
            table_ref("evenness")
        ));
    }
    if !not.is_empty() {
        sentences.push(format!("For {} the interval does not say so.", listed(&not)));
    }
    page.sentences(&sentences);
    evenness_table(summary, &compared, n, page);
}

/// Evenness at `n` points, sampler by sampler.
fn evenness_table(summary: &Summary, compared: &[(usize, Estimate, u32, String)], n: u32, page: &mut Page) {
    let metric = |sampler: usize, metric: &str| -> Vec<Option<f64>> {
        let sets = summary.point_sets.iter();
        let found =
            sets.filter(|s| s.sampler == sampler && s.metric == metric && s.n.asked == n).max_by_key(|s| s.n.taken);
        found.map_or(Vec::new(), |set| set.values.clone())
    };
    // A net of base 2 has a t-value of base 2; Halton's points are one of no single base.
    let is_base_two = |sampler: usize| summary.samplers[sampler].spec().is_some_and(|s| s.points != Points::Halton);
    let rows: Vec<Vec<String>> = compared
        .iter()
        .map(|(sampler, ratio, _, id)| {
            vec![
                name(summary, *sampler),
                if Some(*sampler) == summary.uniform() { "1".to_owned() } else { ratio_cell(Some(*ratio)) },
                if is_base_two(*sampler) { range(&metric(*sampler, "t_value")) } else { "–".to_owned() },
                range(&metric(*sampler, "min_toroidal_distance")),
                id.clone(),
            ]
        })
        .collect();
    let heads = ["sampler", "D* / uniform's D*", "t-value", "least distance (torus)", "row"];
    let caption = format!(
        "Evenness of n = {n} points: D* over that of uniform points with its 95 % interval; t-value in base 2 (0 is best: how coarse boxes must be to hold equal \
         shares of the points; – where n is no power of two, and for Halton's points, which have a base for each axis) and least toroidal distance between two points of the unit square, each as the range over {}.",
        sets_measured(summary)
    );
    tabulate(page, "evenness", &caption, &heads, &rows);
}

/// The range of values over replicates.
fn range(values: &[Option<f64>]) -> String {
    let values: Option<Vec<f64>> = values.iter().copied().collect();
    let Some(values) = values.filter(|values| !values.is_empty()) else { return "–".to_owned() };
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| (l.min(v), h.max(v)));
    let text = |v: f64| if v == v.round() { format!("{v:.0}") } else { super::super::numbers::short(v) };
    if low == high { text(low) } else { format!("{} to {}", text(low), text(high)) }
}

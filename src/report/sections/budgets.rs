//! What a budget of seconds buys: each sampler's error at equal seconds, and which sampler to take.

use crate::stats::Estimate;

use super::super::evidence::{Answer, Limit, above, interpolated, ratio_of_roots};
use super::super::markdown::{Page, table_ref};
use super::super::numbers::{estimate, listed, short};
use super::super::summarise::Summary;
use super::speed::timed;
use super::tabulate;
use super::words::{level, name, ratio_cell, same_as_cell, scene_name};

/// What a sampler reaches in a budget.
#[derive(Debug, Clone, PartialEq)]
struct Reached {
    /// Index of the sampler.
    sampler: usize,
    /// Mean square error.
    mse: Estimate,
    /// Whether its largest count takes less than the budget, so that this is its error there: more samples might do better.
    is_last: bool,
}

/// A budget: what uniform sampling takes at a count.
struct Budget {
    spp: u32,
    seconds: f64,
    /// Uniform sampling's own mean square error.
    base: Estimate,
}

fn budget(summary: &Summary, scene: usize, spp: u32) -> Option<Budget> {
    let cell = summary.cell(scene, summary.uniform()?, spp)?;
    let seconds = summary.speed(cell)?.seconds.value;
    (cell.mse.value > 0.0 && seconds > 0.0).then_some(Budget { spp, seconds, base: cell.mse })
}

/// The counts of uniform sampling that budgets are taken from: the smallest of at least 4, the middle one, the most.
fn budget_counts(summary: &Summary) -> Vec<u32> {
    let spp = &summary.about.experiment.spp;
    let small = spp.iter().copied().filter(|&n| n >= 4).min();
    let mut counts: Vec<u32> = [small, summary.middle_spp(), summary.most_spp()].into_iter().flatten().collect();
    counts.sort_unstable();
    counts.dedup();
    counts
}

/// What every sampler reaches in `seconds`: between its counts on a straight line of logarithms; where its largest count
/// takes less, the error there. Samplers whose every count takes longer are left out.
fn reached(summary: &Summary, scene: usize, seconds: f64) -> Vec<Reached> {
    let all = timed(summary, scene);
    (0..summary.samplers.len())
        .filter_map(|sampler| {
            let trials: Vec<(f64, Estimate)> = all
                .iter()
                .filter(|(cell, _)| cell.sampler == sampler)
                .map(|(cell, speed)| (speed.seconds.value, cell.mse))
                .collect();
            if let Some(mse) = interpolated(&trials, seconds) {
                return Some(Reached { sampler, mse, is_last: false });
            }
            let last = trials.last().filter(|(time, _)| *time < seconds)?;
            Some(Reached { sampler, mse: last.1, is_last: true })
        })
        .collect()
}

/// The smallest error of those reached, and the samplers that are not told apart from it.
fn best(reached: &[Reached]) -> Option<(&Reached, Vec<usize>)> {
    let best = reached.iter().filter(|r| r.mse.value > 0.0).min_by(|a, b| a.mse.value.total_cmp(&b.mse.value))?;
    let is_worse =
        |r: &Reached| ratio_of_roots(&r.mse, &best.mse).is_some_and(|ratio| above(&ratio, 1.0) == Answer::Yes);
    let alike = reached.iter().filter(|r| r.sampler != best.sampler && !is_worse(r)).map(|r| r.sampler).collect();
    Some((best, alike))
}

/// Tables and conclusion.
pub fn section(summary: &Summary, page: &mut Page) {
    equal_seconds(summary, page);
    choice(summary, page);
}

/// The error of every sampler in the time of uniform sampling at the middle count.
fn equal_seconds(summary: &Summary, page: &mut Page) {
    let (Some(uniform), Some(spp)) = (summary.uniform(), summary.middle_spp()) else { return };
    let columns: Vec<(usize, Budget, Vec<Reached>)> = (0..summary.scenes.len())
        .filter_map(|scene| budget(summary, scene, spp).map(|budget| (scene, budget)))
        .map(|(scene, budget)| (reached(summary, scene, budget.seconds), scene, budget))
        .map(|(reached, scene, budget)| (scene, budget, reached))
        .collect();
    if columns.is_empty() {
        return;
    }
    let mut head = vec!["sampler".to_owned()];
    for (scene, budget, _) in &columns {
        let at = scene_name(summary, *scene);
        head.extend([format!("{at}, {} s", short(budget.seconds)), format!("{at}, over uniform's")]);
    }
    let cells = |sampler: usize, (scene, budget, reached): &(usize, Budget, Vec<Reached>)| -> [String; 2] {
        let Some(found) = reached.iter().find(|r| r.sampler == sampler) else {
            return [same_as_cell(summary, *scene, sampler).unwrap_or("–".to_owned()), "–".to_owned()];
        };
        let root = |x: f64| x.max(0.0).sqrt();
        let rmse = Estimate { value: root(found.mse.value), ci95: found.mse.ci95.map(|ends| ends.map(root)) };
        let mark = if found.is_last { "†" } else { "" };
        let relative =
            if sampler == uniform { "1".to_owned() } else { ratio_cell(ratio_of_roots(&found.mse, &budget.base)) };
        [format!("{}{mark}", estimate(&rmse)), relative]
    };
    let lines: Vec<Vec<String>> = (0..summary.samplers.len())
        .map(|sampler| {
            std::iter::once(name(summary, sampler)).chain(columns.iter().flat_map(|c| cells(sampler, c))).collect()
        })
        .collect();
    let has_last = columns.iter().any(|(.., reached)| reached.iter().any(|r| r.is_last));
    let dagger =
        if has_last { " †: its largest count takes less than the budget, so this is its error there." } else { "" };
    let caption = format!(
        "RMSE in W/(m² sr) at equal seconds, those of uniform sampling at {spp} spp: between the neighbouring counts of each sampler on a straight line of \
         logarithms, values and interval ends alike; {}. The spread of the seconds is not in the intervals.{dagger}",
        level(summary)
    );
    tabulate(page, "equal-seconds", &caption, &head, &lines);
}

/// Which sampler for which scene and budget.
fn choice(summary: &Summary, page: &mut Page) {
    let counts = budget_counts(summary);
    let mut lines = Vec::new();
    let mut words = Vec::new();
    for scene in 0..summary.scenes.len() {
        let mut found: Vec<Found> = Vec::new();
        let budgets: Vec<Budget> = counts.iter().filter_map(|&spp| budget(summary, scene, spp)).collect();
        for budget in &budgets {
            let all = reached(summary, scene, budget.seconds);
            let Some((best, alike)) = best(&all) else { continue };
            lines.push(vec![
                scene_name(summary, scene),
                format!("{} ({} spp)", short(budget.seconds), budget.spp),
                marked(summary, scene, best.sampler),
                short(best.mse.value.max(0.0).sqrt()),
                if Some(best.sampler) == summary.uniform() {
                    "1".to_owned()
                } else {
                    ratio_cell(ratio_of_roots(&best.mse, &budget.base))
                },
                if alike.is_empty() { "none".to_owned() } else { names(summary, scene, &alike) },
            ]);
            found.push(Found { seconds: budget.seconds, best: best.sampler, alike });
        }
        words.extend(scene_words(summary, scene, &found));
    }
    if lines.is_empty() {
        return;
    }
    let caption = "Which sampler for which budget: seconds that uniform sampling takes at the count in brackets, the smallest RMSE in W/(m² sr) reached in them, its ratio to \
                   uniform sampling's with a 95 % interval, and the samplers whose RMSE is not told apart from it. ‡: in this scene it converges to a wrong image or stalls, so \
                   a larger budget may not help it.";
    let head = ["scene", "budget (s)", "smallest RMSE", "RMSE", "over uniform's", "not told apart from it"];
    tabulate(page, "budgets", caption, &head, &lines);
    page.paragraph(&format!(
        "**Which sampler to take** ({}): {}. The smallest of many estimates is a little too small by being picked, and seconds are this machine's.",
        table_ref("budgets"),
        words.join("; ")
    ));
}

/// What is best at a budget.
struct Found {
    seconds: f64,
    best: usize,
    /// Not told apart from it.
    alike: Vec<usize>,
}

impl Found {
    fn is_good(&self, sampler: usize) -> bool {
        self.best == sampler || self.alike.contains(&sampler)
    }
}

/// A sampler's name, with a sign where its error does not fall in the scene.
fn marked(summary: &Summary, scene: usize, sampler: usize) -> String {
    let limit = summary.course(scene, sampler).map(|course| course.limit());
    let sign = if matches!(limit, Some(Limit::Wrong | Limit::Stalls)) { "‡" } else { "" };
    format!("{}{sign}", name(summary, sampler))
}

fn names(summary: &Summary, scene: usize, samplers: &[usize]) -> String {
    listed(&samplers.iter().map(|&i| marked(summary, scene, i)).collect::<Vec<_>>())
}

/// One scene's conclusion: what is best, or not told apart from the best, at every budget; else what is at each.
fn scene_words(summary: &Summary, scene: usize, found: &[Found]) -> Option<String> {
    let (first, rest) = found.split_first()?;
    let at = scene_name(summary, scene);
    let mut always: Vec<usize> = std::iter::once(first.best).chain(first.alike.iter().copied()).collect();
    always.retain(|&sampler| rest.iter().all(|budget| budget.is_good(sampler)));
    always.sort_unstable();
    let (budgets, many) = (found.len(), summary.samplers.len());
    Some(match always.len() {
        0 => {
            let each = found.iter().map(|b| format!("{} in {} s", marked(summary, scene, b.best), short(b.seconds)));
            format!("in {at} it depends on the budget: {}", listed(&each.collect::<Vec<_>>()))
        }
        n if 2 * n > many => format!(
            "in {at} it cannot be told: {n} of {many} samplers are the best or not told apart from it at every budget"
        ),
        _ if budgets == 1 => format!("in {at} {}", names(summary, scene, &always)),
        _ => format!(
            "in {at} {}, the best or not told apart from it at all {budgets} budgets",
            names(summary, scene, &always)
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(sampler: usize, value: f64, half: f64) -> Reached {
        Reached { sampler, mse: Estimate { value, ci95: Some([value - half, value + half]) }, is_last: false }
    }

    #[test]
    fn what_overlaps_the_best_is_not_told_apart_from_it_and_what_does_not_is() {
        let all = [at(0, 4.0, 0.1), at(1, 1.0, 0.1), at(2, 1.05, 0.1)];
        let (best, alike) = best(&all).unwrap();
        assert_eq!((best.sampler, alike), (1, vec![2]));
        assert_eq!(super::best(&[at(0, -1.0, 0.1)]), None, "an error below the reference's noise ranks nothing");
    }
}

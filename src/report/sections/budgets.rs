//! What a budget of seconds buys: each sampler's error at equal seconds, and which sampler to take.

use crate::stats::{Estimate, student_t_quantile};

use super::super::evidence::{Answer, above, ratio_of_roots};
use super::super::markdown::{Page, table_ref};
use super::super::numbers::{estimate, listed, short};
use super::super::reach::{Stop, reached_in};
use super::super::summarise::Summary;
use super::flaws::flaws;
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
pub(super) fn budget_counts(summary: &Summary) -> Vec<u32> {
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
            let stops: Vec<Stop> = all
                .iter()
                .filter(|(cell, _)| cell.sampler == sampler)
                .map(|(cell, speed)| Stop { seconds: speed.seconds, mse: cell.mse })
                .collect();
            if let Some(mse) = reached_in(&stops, seconds) {
                return Some(Reached { sampler, mse, is_last: false });
            }
            let last = stops.last().filter(|stop| stop.seconds.value < seconds)?;
            Some(Reached { sampler, mse: last.mse, is_last: true })
        })
        .collect()
}

/// By how much a 95 % interval from `replicates` widens, so that `comparisons` of them hold at once (Bonferroni): the ratio of
/// Student's quantiles at 0.05/comparisons and 0.05, replicates − 1 degrees of freedom.
pub(super) fn joint_factor(replicates: u32, comparisons: usize) -> f64 {
    let freedom = f64::from(replicates.max(2) - 1);
    let quantile = |tests: f64| student_t_quantile(1.0 - 0.025 / tests, freedom);
    quantile(comparisons.max(1) as f64) / quantile(1.0)
}

/// A ratio with the distances of its interval's ends, on a logarithmic scale, times `factor`.
pub(super) fn widened(ratio: &Estimate, factor: f64) -> Estimate {
    let end = |end: f64| ratio.value * libm::pow(end / ratio.value, factor);
    Estimate { value: ratio.value, ci95: ratio.ci95.map(|ends| ends.map(end)) }
}

/// The smallest error of those reached, and the samplers that are not told apart from it, at 5 % for all comparisons together.
fn best(reached: &[Reached], replicates: u32) -> Option<(&Reached, Vec<usize>)> {
    let best = reached.iter().filter(|r| r.mse.value > 0.0).min_by(|a, b| a.mse.value.total_cmp(&b.mse.value))?;
    let factor = joint_factor(replicates, reached.len() - 1);
    let is_worse = |r: &Reached| {
        let ratio = ratio_of_roots(&r.mse, &best.mse);
        ratio.is_some_and(|ratio| above(&widened(&ratio, factor), 1.0) == Answer::Yes)
    };
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
         logarithms, values and interval ends alike; {}, to which the interval of the seconds adds what it makes of the error.{dagger}",
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
            let sound: Vec<Reached> =
                all.iter().filter(|r| flaws(summary, scene, r.sampler).is_empty()).cloned().collect();
            let replicates = summary.about.experiment.replicates;
            let Some((smallest, _)) = best(&all, replicates) else { continue };
            let taken = best(&sound, replicates);
            let over_uniform = |r: &Reached| match Some(r.sampler) == summary.uniform() {
                true => "1".to_owned(),
                false => ratio_cell(ratio_of_roots(&r.mse, &budget.base)),
            };
            let root = |r: &Reached| short(r.mse.value.max(0.0).sqrt());
            lines.push(vec![
                scene_name(summary, scene),
                format!("{} ({} spp)", short(budget.seconds), budget.spp),
                taken.as_ref().map_or("none".to_owned(), |(r, _)| name(summary, r.sampler)),
                taken.as_ref().map_or("–".to_owned(), |(r, _)| root(r)),
                taken.as_ref().map_or("–".to_owned(), |(r, _)| over_uniform(r)),
                match &taken {
                    Some((_, alike)) if !alike.is_empty() => names(summary, alike),
                    _ => "none".to_owned(),
                },
                smaller_but_flawed(summary, scene, smallest),
            ]);
            if let Some((taken, alike)) = taken {
                found.push(Found { seconds: budget.seconds, best: taken.sampler, alike });
            }
        }
        let words_of_scene = scene_words(summary, scene, &found);
        let none = || format!("in {} none: something speaks against each", scene_name(summary, scene));
        words.extend(words_of_scene.or_else(|| (!budgets.is_empty()).then(none)));
    }
    if lines.is_empty() {
        return;
    }
    let caption = "Which sampler for which budget: seconds that uniform sampling takes at the count in brackets; of the samplers that nothing speaks against in the scene (no error that stays, no bias \
                   seen, no neighbours that err alike, no set that decisions read in step or that is not randomised), the one with the smallest RMSE in W/(m² sr) reached in them, its ratio to uniform sampling's \
                   with a 95 % interval, and those not told apart from it (no difference can be told at 5 % for all comparisons of a line together); beside it the smallest RMSE of all, where that \
                   is another's, with what speaks against it.";
    let head = [
        "scene",
        "budget (s)",
        "smallest sound RMSE",
        "RMSE",
        "over uniform's",
        "not told apart from it",
        "smaller, but",
    ];
    tabulate(page, "budgets", caption, &head, &lines);
    page.paragraph(&format!(
        "**Which sampler to take**, of those that nothing speaks against ({}): {}. The smallest of many estimates is a little too small by being picked, and seconds are this machine's.",
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

/// The smallest RMSE of all, where something speaks against its sampler; `–` where nothing does.
fn smaller_but_flawed(summary: &Summary, scene: usize, smallest: &Reached) -> String {
    let flaws = flaws(summary, scene, smallest.sampler);
    if flaws.is_empty() {
        return "–".to_owned();
    }
    let rmse = short(smallest.mse.value.max(0.0).sqrt());
    format!("{} {rmse}: {}", name(summary, smallest.sampler), flaws.join(", "))
}

fn names(summary: &Summary, samplers: &[usize]) -> String {
    listed(&samplers.iter().map(|&i| name(summary, i)).collect::<Vec<_>>())
}

/// One scene's conclusion: what is best, or not told apart from the best, at every budget; else what is at each.
fn scene_words(summary: &Summary, scene: usize, found: &[Found]) -> Option<String> {
    let (first, rest) = found.split_first()?;
    let at = scene_name(summary, scene);
    let mut always: Vec<usize> = std::iter::once(first.best).chain(first.alike.iter().copied()).collect();
    always.retain(|&sampler| rest.iter().all(|budget| budget.is_good(sampler)));
    always.sort_unstable();
    let (budgets, many) =
        (found.len(), summary.compared(scene).filter(|&i| flaws(summary, scene, i).is_empty()).count());
    Some(match always.len() {
        0 => {
            let each = found.iter().map(|b| format!("{} in {} s", name(summary, b.best), short(b.seconds)));
            format!("in {at} it depends on the budget: {}", listed(&each.collect::<Vec<_>>()))
        }
        n if 2 * n > many && n > 2 => format!(
            "in {at} it cannot be told: {n} of {many} of them are the best or not told apart from it at every budget"
        ),
        _ if budgets == 1 => format!("in {at} {}", names(summary, &always)),
        _ => {
            format!("in {at} {}, the best or not told apart from it at all {budgets} budgets", names(summary, &always))
        }
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
        let (best, alike) = best(&all, 8).unwrap();
        assert_eq!((best.sampler, alike), (1, vec![2]));
        assert_eq!(super::best(&[at(0, -1.0, 0.1)], 8), None, "an error below the reference's noise ranks nothing");
    }

    /// Student's t with 7 degrees of freedom: 2.3646 at 5 %, 4.0293 at 0.5 % (two-sided; tables).
    #[test]
    fn many_comparisons_ask_for_more_distance() {
        assert!((joint_factor(8, 10) - 4.0293 / 2.3646).abs() < 1e-4 && joint_factor(8, 1) == 1.0);
        let ratio = widened(&Estimate { value: 1.0, ci95: Some([0.5, 2.0]) }, 2.0);
        assert!(ratio.ci95.is_some_and(|[low, high]| (low - 0.25).abs() < 1e-15 && (high - 4.0).abs() < 1e-14));
        // Two at a ratio of RMSE of about 1.12 [1.02, 1.23]: told apart alone, not among nine others.
        let pair = [at(0, 1.0, 0.1), at(1, 1.26, 0.15)];
        assert_eq!(super::best(&pair, 8).unwrap().1, Vec::<usize>::new());
        let many: Vec<Reached> = pair.into_iter().chain((2..10).map(|i| at(i, 9.0, 0.1))).collect();
        assert_eq!(super::best(&many, 8).unwrap().1, [1]);
    }
}

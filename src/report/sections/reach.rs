//! The time to a stated error: which sampler gets there first, and by how much.

use crate::stats::Estimate;

use super::super::charts::of_scene;
use super::super::evidence::{Answer, above, ratio};
use super::super::markdown::{Page, table_ref};
use super::super::numbers::{counted, estimate, listed, short};
use super::super::reach::{Reach, Stop, time_to_reach};
use super::super::summarise::Summary;
use super::budgets::{budget_counts, joint_factor, widened};
use super::flaws::flaws;
use super::speed::timed;
use super::tabulate;
use super::words::{level, name, ratio_cell, same_as_cell, scene_name};

/// A level of error in a scene, and when each sampler is down to it.
struct Level {
    scene: usize,
    rmse: f64,
    reaches: Vec<(usize, Reach)>,
}

impl Level {
    fn of(summary: &Summary, scene: usize, rmse: f64) -> Self {
        let all = timed(summary, scene);
        let reach = |sampler: usize| {
            let stops: Vec<Stop> = all
                .iter()
                .filter(|(cell, _)| cell.sampler == sampler)
                .map(|(cell, speed)| Stop { seconds: speed.seconds, mse: cell.mse })
                .collect();
            (!stops.is_empty()).then(|| (sampler, time_to_reach(&stops, rmse * rmse)))
        };
        Self { scene, rmse, reaches: (0..summary.samplers.len()).filter_map(reach).collect() }
    }

    fn reach(&self, sampler: usize) -> Option<Reach> {
        self.reaches.iter().find(|(known, _)| *known == sampler).map(|(_, reach)| *reach)
    }

    fn seconds(&self, sampler: usize) -> Option<Estimate> {
        match self.reach(sampler) {
            Some(Reach::At(seconds)) => Some(seconds),
            _ => None,
        }
    }

    /// The samplers that get there between two of their counts, the fastest first.
    fn ranked(&self, is_admitted: impl Fn(usize) -> bool) -> Vec<(usize, Estimate)> {
        let mut found: Vec<(usize, Estimate)> = self
            .reaches
            .iter()
            .filter(|(sampler, _)| is_admitted(*sampler))
            .filter_map(|&(sampler, reach)| match reach {
                Reach::At(seconds) => Some((sampler, seconds)),
                _ => None,
            })
            .collect();
        found.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
        found
    }
}

/// The levels that a scene's times are stated for: the experiment's, else what uniform sampling comes down to at the counts that
/// budgets are taken from, without the smallest count of all, before which there is nothing to compare: the upper end of its
/// interval rounded up to two digits. The largest first.
fn levels(summary: &Summary, scene: usize) -> Vec<f64> {
    let experiment = &summary.about.experiment;
    let asked = experiment.timing.as_ref().and_then(|t| t.rmse.get(experiment.scenes.get(scene)?));
    let mut levels = match asked {
        Some(levels) => levels.clone(),
        None => {
            let cell = |spp: u32| summary.cell(scene, summary.uniform()?, spp);
            let smallest = experiment.spp.iter().copied().min();
            let counts = budget_counts(summary).into_iter().filter(|spp| Some(*spp) != smallest);
            let rmse = counts.filter_map(|spp| cell(spp)?.rmse).filter(|rmse| rmse.value > 0.0);
            rmse.map(|rmse| two_digits_up(rmse.ci95.map_or(rmse.value, |[_, high]| high))).collect()
        }
    };
    levels.sort_by(|a, b| b.total_cmp(a));
    levels.dedup();
    levels
}

/// The smallest number of two significant digits that is at least `x`.
fn two_digits_up(x: f64) -> f64 {
    let exponent = libm::floor(libm::log10(x)) as i32 - 1;
    let digits = libm::ceil(x / libm::pow(10.0, f64::from(exponent)) - 1e-9);
    format!("{digits}e{exponent}").parse().unwrap_or(x)
}

/// The tables and what follows from them.
pub fn section(summary: &Summary, page: &mut Page) {
    let mut said = Vec::new();
    for scene in 0..summary.scenes.len() {
        let levels: Vec<Level> =
            levels(summary, scene).into_iter().map(|rmse| Level::of(summary, scene, rmse)).collect();
        if levels.iter().all(|level| level.reaches.is_empty()) {
            continue;
        }
        table(summary, scene, &levels, page);
        said.extend(levels.iter().filter_map(|level| fastest(summary, level)));
    }
    if said.is_empty() {
        return;
    }
    page.paragraph(&format!(
        "**Who gets there first**, of the samplers that nothing speaks against in the scene (as in {}); \"no difference can be told\" where the interval of the ratio of two times holds 1, at 5 % for all \
         comparisons of a line together:",
        table_ref("budgets")
    ));
    page.bullets(&said);
}

fn table(summary: &Summary, scene: usize, levels: &[Level], page: &mut Page) {
    let uniform = summary.uniform();
    let mut head = vec!["sampler".to_owned()];
    for level in levels {
        head.extend([format!("seconds to {}", short(level.rmse)), "times as fast as uniform".to_owned()]);
    }
    let cells = |sampler: usize, level: &Level| -> [String; 2] {
        let time = match level.reach(sampler) {
            None => same_as_cell(summary, scene, sampler).unwrap_or("–".to_owned()),
            Some(Reach::At(seconds)) => estimate(&seconds),
            Some(Reach::Within(seconds)) => format!("at most {}", short(seconds)),
            Some(Reach::Not) => format!("not reached{}", least(summary, scene, sampler)),
        };
        let speed = uniform.and_then(|uniform| ratio(&level.seconds(uniform)?, &level.seconds(sampler)?));
        [time, if Some(sampler) == uniform { "1".to_owned() } else { ratio_cell(speed) }]
    };
    let lines: Vec<Vec<String>> = (0..summary.samplers.len())
        .map(|sampler| {
            std::iter::once(name(summary, sampler)).chain(levels.iter().flat_map(|l| cells(sampler, l))).collect()
        })
        .collect();
    let scene_file = &summary.scenes[scene].name;
    let caption = format!(
        "Seconds that an image of `{scene_file}`, {} pixels, takes until its RMSE is down to the level in the head, in W/(m² sr): between the neighbouring counts of each sampler on a straight line of logarithms of RMSE over seconds, \
         never beyond the counts that were rendered; {}, from the interval of the error turned round and that of the seconds. Not reached: no count comes down to it (in brackets the smallest RMSE and its count), and what more samples \
         would take is not guessed. At most: the smallest count is good enough.",
        summary.scenes[scene].size,
        level(summary)
    );
    tabulate(page, &of_scene("time-to", scene_file), &caption, &head, &lines);
}

/// ` (0.0123 at 256 spp)`: the smallest error of a sampler.
fn least(summary: &Summary, scene: usize, sampler: usize) -> String {
    let cells = timed(summary, scene).into_iter().map(|(cell, _)| cell).filter(|cell| cell.sampler == sampler);
    let least = cells.min_by(|a, b| a.mse.value.total_cmp(&b.mse.value));
    least
        .map_or(String::new(), |cell| format!(" ({} at {} spp)", short(cell.mse.value.max(0.0).sqrt()), cell.spp.taken))
}

/// One level's conclusion.
fn fastest(summary: &Summary, level: &Level) -> Option<String> {
    let is_sound = |sampler: usize| flaws(summary, level.scene, sampler).is_empty();
    let at = format!("RMSE {} in {}", short(level.rmse), scene_name(summary, level.scene));
    let early = level.reaches.iter().filter(|(i, reach)| is_sound(*i) && matches!(reach, Reach::Within(_))).count();
    if early > 0 {
        return Some(format!(
            "{at}: {} there with the smallest count already, and fewer samples were not tried, so none is called the first.",
            counted(early, "of them is", "of them are")
        ));
    }
    let ranked = level.ranked(is_sound);
    let Some(((first, seconds), rest)) = ranked.split_first().map(|(a, b)| (*a, b)) else {
        let none = || format!("{at}: no sampler that nothing speaks against gets there between two of its counts.");
        return (!level.reaches.is_empty()).then(none);
    };
    let factor = joint_factor(summary.about.experiment.replicates, rest.len());
    let is_slower = |other: &Estimate| {
        ratio(other, &seconds).is_some_and(|ratio| above(&widened(&ratio, factor), 1.0) == Answer::Yes)
    };
    let alike: Vec<String> = rest.iter().filter(|(_, s)| !is_slower(s)).map(|(i, _)| name(summary, *i)).collect();
    let mut text = format!("{at}: {} in {} s", name(summary, first), estimate(&seconds));
    let over_uniform = summary.uniform().filter(|&u| u != first).and_then(|u| ratio(&level.seconds(u)?, &seconds));
    if let Some(over_uniform) = over_uniform {
        text += &format!(", {} times as fast as uniform sampling", estimate(&over_uniform));
    }
    text += &match alike.as_slice() {
        [] => "; every other one is slower".to_owned(),
        alike => format!("; no difference can be told from {}", listed(alike)),
    };
    let not = level.reaches.iter().filter(|(i, reach)| is_sound(*i) && *reach == Reach::Not).count();
    if not > 0 {
        text += &format!("; {} not get there", counted(not, "sampler does", "samplers do"));
    }
    Some(text + ".")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_is_a_number_of_two_digits_that_is_reached() {
        for (x, up) in [(0.0361, 0.037), (0.0360, 0.036), (0.0999, 0.1), (1.0, 1.0), (1234.0, 1300.0), (3.1e-7, 3.1e-7)]
        {
            assert_eq!(two_digits_up(x), up, "{x}");
        }
    }
}

//! Where methods fail, what each is good for, and what the measurement itself cannot see.

use crate::stats::Estimate;

use super::super::evidence::{
    Answer, Limit, clearly_above_one, clearly_below_one, interpolated, is_biased, ratio_of_roots,
};
use super::super::markdown::{Page, link_to};
use super::super::numbers::{counted, estimate, percent, signed_estimate};
use super::super::summarise::{Cell, Step, Summary};
use super::correlation::{Structure, pattern_spp, structure};
use super::speed::efficiency;
use super::words::{
    bias_words, level, limit_words, marked_row, name, ratio_cell, rmse_ratio, same_as_cell, scene_name, times,
};
use super::{reference, tabulate, titles};

/// An error at a count that is no power of two, over what its neighbours promise.
pub struct OddCount {
    /// Asked for.
    pub asked: u32,
    /// Taken.
    pub taken: u32,
    /// RMSE over the interpolated one.
    pub ratio: Estimate,
}

/// The first count of the experiment that is no power of two but lies between two that are.
pub fn odd_count(summary: &Summary, scene: usize, sampler: usize) -> Option<OddCount> {
    let cells = summary.cells_of(scene, sampler);
    let odd = cells.iter().find(|cell| !cell.spp.asked.is_power_of_two())?;
    let even: Vec<(f64, Estimate)> = cells
        .iter()
        .filter(|cell| cell.spp.taken.is_power_of_two())
        .map(|cell| (f64::from(cell.spp.taken), cell.mse))
        .collect();
    let promised = interpolated(&even, f64::from(odd.spp.taken))?;
    Some(OddCount { asked: odd.spp.asked, taken: odd.spp.taken, ratio: ratio_of_roots(&odd.mse, &promised)? })
}

/// The section: every item is a failure that the rows show.
pub fn section(summary: &Summary, page: &mut Page) {
    page.heading(2, titles::FAILURES);
    let pairs: Vec<(usize, usize)> = (0..summary.scenes.len())
        .flat_map(|scene| (0..summary.samplers.len()).map(move |sampler| (scene, sampler)))
        .collect();
    let mut lines: Vec<Vec<String>> =
        pairs.iter().filter_map(|&(scene, sampler)| course_failure(summary, scene, sampler)).collect();
    lines.extend(pairs.iter().filter_map(|&(scene, sampler)| {
        structure(summary, scene, sampler).map(|found| structure_failure(summary, scene, sampler, &found))
    }));
    lines.extend(pairs.iter().filter_map(|&(scene, sampler)| odd_failure(summary, scene, sampler)));
    if lines.is_empty() {
        page.paragraph("No failure is seen in these rows: no error stays, no bias is seen, no neighbours err alike, no count between powers of two costs accuracy.");
    }
    let elsewhere = match summary.stability.is_empty() {
        true => String::new(),
        false => format!("; a sample more or less, two passes and scale are in {}", link_to(titles::STABILITY)),
    };
    let caption = format!(
        "Failures that the rows of the plain images show: what happens, and the number that says so (bias² in (W/(m² sr))²); {}. The counts of a verdict are in {}. What has nothing random in it \
         is all bias and is not listed for that alone{elsewhere}.",
        level(summary),
        link_to(titles::READING),
    );
    tabulate(page, "failures", &caption, &["failure", "sampler", "scene", "measured", "row"], &lines);
}

/// A wrong limit, a stall, or a bias beside a falling error.
fn course_failure(summary: &Summary, scene: usize, sampler: usize) -> Option<Vec<String>> {
    let (from, to) = summary.course_counts()?;
    let (course, cell) = (summary.course(scene, sampler)?, summary.cell(scene, sampler, to)?);
    let is_failure = match course.limit() {
        Limit::Wrong | Limit::Stalls | Limit::StallsBiased => true,
        // What has nothing random in it is all bias, and says so elsewhere.
        Limit::Falls => course.is_biased() == Answer::Yes && !cell.is_fixed,
        Limit::Unclear => false,
    };
    let mean = summary.scenes[scene].reference.as_ref().map(|r| r.mean);
    is_failure.then(|| {
        vec![
            limit_words(&course).to_owned(),
            name(summary, sampler),
            scene_name(summary, scene),
            format!("RMSE {to} / {from} spp = {}; {}", times(&course.rmse_ratio), bias_words(cell, mean)),
            marked_row(cell),
        ]
    })
}

/// Neighbours that err alike, by one pattern in every pixel or by a bias that they share.
fn structure_failure(summary: &Summary, scene: usize, sampler: usize, found: &Structure) -> Vec<String> {
    let rho = found.cell.error_autocorrelation.map_or("undefined".to_owned(), |rho| signed_estimate(&rho));
    let what = match (found.repeats, is_biased(&found.cell.bias2)) {
        (true, _) => "structure instead of noise",
        (false, Answer::Yes) => "neighbours share a bias (points are new in each pixel)",
        (false, _) => "neighbours err alike, though points are new in each pixel",
    };
    vec![
        what.to_owned(),
        name(summary, sampler),
        scene_name(summary, scene),
        format!("ρ = {rho} at {} spp", found.cell.spp.asked),
        marked_row(found.cell),
    ]
}

fn odd_failure(summary: &Summary, scene: usize, sampler: usize) -> Option<Vec<String>> {
    let odd = odd_count(summary, scene, sampler).filter(|odd| clearly_above_one(&odd.ratio))?;
    let cell = summary.cell(scene, sampler, odd.asked)?;
    Some(vec![
        format!("a count that is no power of two costs accuracy: {} spp", odd.asked),
        name(summary, sampler),
        scene_name(summary, scene),
        format!(
            "RMSE at {} spp taken = {} times what the powers of two around it promise",
            odd.taken,
            times(&odd.ratio)
        ),
        marked_row(cell),
    ])
}

/// The table of advantages and disadvantages: every cell a measured predicate.
pub fn table(summary: &Summary, page: &mut Page) {
    page.heading(2, titles::TABLE);
    page.paragraph("Every cell is computed from rows; none is an opinion. \"no bias seen\" below is no proof that the image becomes the right one: it bounds the bias at the largest count.");
    let scenes: Vec<String> = (0..summary.scenes.len()).map(|scene| scene_name(summary, scene)).collect();
    let per_scene = |key: &str, caption: String, cell: &dyn Fn(usize, usize) -> String, page: &mut Page| {
        let mut head = vec!["sampler".to_owned()];
        head.extend(scenes.iter().cloned());
        let lines: Vec<Vec<String>> = (0..summary.samplers.len())
            .map(|sampler| {
                let cells = (0..summary.scenes.len())
                    .map(|scene| same_as_cell(summary, scene, sampler).unwrap_or_else(|| cell(scene, sampler)));
                std::iter::once(name(summary, sampler)).chain(cells).collect()
            })
            .collect();
        tabulate(page, key, &caption, &head, &lines);
    };
    if let Some((_, to)) = summary.course_counts() {
        let caption = format!(
            "Does it converge to the right image? Never a \"yes\": the rows end at {to} spp. Where no bias is seen, the most that it can be, as a share of the MSE (the interval's upper end); \"not \
             promised\" where the construction allows a wrong limit all the same; \"flattens\" where the last step's error falls less than that of independent samples. In brackets bias² in \
             (W/(m² sr))²; {}.",
            level(summary)
        );
        per_scene("right-image", caption, &|scene, sampler| right_image(summary, scene, sampler, to), page);
    }
    if let (Some(uniform), Some(spp)) = (summary.uniform(), summary.middle_spp()) {
        let caption =
            format!("RMSE at {spp} spp over uniform sampling's (below 1 is better, no unit); {}.", level(summary));
        per_scene(
            "against-uniform",
            caption,
            &|scene, sampler| against_uniform(summary, scene, sampler, uniform, spp),
            page,
        );
    }
    others(summary, page);
}

fn right_image(summary: &Summary, scene: usize, sampler: usize, to: u32) -> String {
    let (Some(course), Some(cell)) = (summary.course(scene, sampler), summary.cell(scene, sampler, to)) else {
        return "cannot tell".to_owned();
    };
    let word = match (course.limit(), course.is_biased()) {
        (Limit::Wrong, _) => "no".to_owned(),
        (Limit::StallsBiased, _) => "no: it stalls, and is biased".to_owned(),
        (Limit::Stalls, _) => "no bias seen, but it stalls".to_owned(),
        (Limit::Falls, Answer::No) => {
            let unproven = summary.samplers[sampler].unproven(&summary.scenes[scene].decisions);
            let flattens = summary.last_step(scene, sampler).filter(Step::is_flatter_than_independent);
            falling_words(cell, to, unproven, flattens.as_ref())
        }
        (Limit::Falls, Answer::Yes) if cell.is_fixed => "its error falls (all of it bias)".to_owned(),
        (Limit::Falls, Answer::Yes) => "its error falls, but it is biased".to_owned(),
        _ => "cannot tell".to_owned(),
    };
    format!("{word} ({}){}", estimate(&cell.bias2), reference::mark(cell))
}

/// What can be said of an error that falls without a bias that is seen: how large one could be, whether the construction
/// promises that there is none, and whether the fall ends.
fn falling_words(cell: &Cell, to: u32, unproven: Option<&str>, flattens: Option<&Step>) -> String {
    let most = cell.bias2.ci95.filter(|_| cell.mse.value > 0.0).map(|[_, high]| high.max(0.0) / cell.mse.value);
    let most = most.map_or(String::new(), |share| format!(", at most {} of the MSE", percent(share.min(1.0))));
    let unproven = unproven.map_or(String::new(), |why| format!("; not promised: {why}"));
    let flattens = flattens.map_or(String::new(), |step| {
        format!("; flattens: RMSE {} / {} = {}", step.to, step.from, times(&step.rmse_ratio))
    });
    format!("no bias seen up to {to} spp{most}{unproven}{flattens}")
}

fn against_uniform(summary: &Summary, scene: usize, sampler: usize, uniform: usize, spp: u32) -> String {
    if sampler == uniform {
        return "1".to_owned();
    }
    let cells = summary.cell(scene, sampler, spp).zip(summary.cell(scene, uniform, spp));
    let mark = cells.map_or("", |(own, _)| reference::mark(own));
    format!("{}{mark}", ratio_cell(cells.and_then(|(own, base)| rmse_ratio(own, base))))
}

/// What is one number a sampler: counts between powers of two, randomness, neighbours, efficiency.
fn others(summary: &Summary, page: &mut Page) {
    let Some(scene) = super::words::main_scene(summary) else { return };
    let at = scene_name(summary, scene);
    let odd_asked = (0..summary.samplers.len()).find_map(|i| odd_count(summary, scene, i)).map(|odd| odd.asked);
    let pattern = pattern_spp(summary);
    let lines: Vec<Vec<String>> = summary
        .compared(scene)
        .map(|sampler| {
            let odd = odd_count(summary, scene, sampler);
            let works = odd.as_ref().map_or("–".to_owned(), |odd| {
                let word = match (clearly_above_one(&odd.ratio), clearly_below_one(&odd.ratio)) {
                    (true, _) => "worse than promised",
                    (_, true) => "better than promised",
                    _ => "as promised, or cannot tell",
                };
                format!("{word}: {} ({} taken)", times(&odd.ratio), odd.taken)
            });
            let decisions = &summary.scenes[scene].decisions;
            let random = summary.samplers[sampler].set.map(|set| set.is_random_for(decisions));
            let random = random.map_or("unknown", |is_random| if is_random { "yes" } else { "no" });
            let rho =
                pattern.and_then(|spp| summary.cell(scene, sampler, spp)).and_then(|cell| cell.error_autocorrelation);
            vec![
                name(summary, sampler),
                works,
                random.to_owned(),
                rho.map_or("–".to_owned(), |rho| signed_estimate(&rho)),
                relative_efficiency(summary, scene, sampler).map_or("–".to_owned(), |e| times(&e)),
            ]
        })
        .collect();
    let head = [
        "sampler".to_owned(),
        format!(
            "RMSE at {} spp / that promised by its neighbours",
            odd_asked.map_or("some".to_owned(), |n| n.to_string())
        ),
        "replicates differ".to_owned(),
        format!("ρ of neighbours, {} spp", pattern.unwrap_or(0)),
        "1/(MSE · T), relative to uniform (this machine)".to_owned(),
    ];
    let caption = format!(
        "What else tells them apart, in {at}: counts that are no power of two (better or worse where 1 is more than twice as far as the interval's end), randomness, correlation ρ of neighbouring pixels' errors, \
         and efficiency at {} spp (T: seconds × threads; above 1 is better); {}; the efficiency's ends join the range of T with the 95 % interval of the MSE, so they are no 95 % interval.",
        summary.middle_spp().unwrap_or(0),
        level(summary)
    );
    tabulate(page, "others", &caption, &head, &lines);
}

/// Efficiency at the middle count, over uniform sampling's.
fn relative_efficiency(summary: &Summary, scene: usize, sampler: usize) -> Option<Estimate> {
    let of = |sampler: usize| {
        let cell = summary.cell(scene, sampler, summary.middle_spp()?)?;
        efficiency(cell, summary.speed(cell)?)
    };
    let uniform = summary.uniform().filter(|&uniform| uniform != sampler)?;
    super::super::evidence::ratio(&of(sampler)?, &of(uniform)?)
}

/// What the measurement cannot see.
pub fn limits(summary: &Summary, page: &mut Page) {
    page.heading(2, titles::LIMITS);
    let e = &summary.about.experiment;
    let mut items = Vec::new();
    items.extend((0..summary.scenes.len()).filter_map(|scene| reference::limit(summary, scene)));
    items.push(match e.replicates {
        1 => "One replicate: no variance, and no interval that holds a sampler's own randomness.".to_owned(),
        n => format!(
            "{n} replicates: an interval's own width is good to about {} (relative standard error of a variance √(2/(R − 1)), halved for a width); \
             with so many intervals in this report some miss their truth by chance, one in twenty by design. The verdicts \"biased\", \"structure\", \"worse\" and \"better than promised\" ask for twice the distance for that reason.",
            percent((2.0 / (f64::from(n) - 1.0)).sqrt() / 2.0)
        ),
    });
    items.push(
        "Intervals of slopes resample replicates; the reference's noise, common to all counts, is not in them."
            .to_owned(),
    );
    if !summary.speeds.is_empty() {
        items.push(
            "Seconds are medians of few images on a machine that may have had other work; efficiencies move with them from run to run, errors do not.".to_owned(),
        );
    }
    let shots: usize = summary.pictured.iter().map(|set| set.shots.len()).sum();
    if shots > 0 {
        let words = if shots == 1 { "The picture was".to_owned() } else { format!("The {shots} pictures were each") };
        items.push(format!("{words} rendered once; a single picture is an example, not a measurement."));
    }
    items.push(format!(
        "{} at small sizes: other scenes, sizes and lenses may rank the samplers otherwise.",
        counted(summary.scenes.len(), "scene", "scenes")
    ));
    page.bullets(&items);
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
        assert_eq!(falling_words(&cell, 256, None, None), "no bias seen up to 256 spp, at most 5.0 % of the MSE");
        assert_eq!(
            falling_words(&cell, 256, Some("decisions in step"), Some(&step)),
            "no bias seen up to 256 spp, at most 5.0 % of the MSE; not promised: decisions in step; flattens: RMSE 256 / 64 = 0.660 [0.640, 0.680]"
        );
        let half = Step { rmse_ratio: Estimate { value: 0.5, ci95: Some([0.49, 0.51]) }, ..step };
        assert!(!half.is_flatter_than_independent(), "independent samples");
        assert!((half.slope().value + 0.5).abs() < 1e-15);
    }
}

//! Where methods fail, what each is good for, and what the measurement itself cannot see.

use crate::stats::Estimate;

use super::super::evidence::{Answer, Limit, below, clearly_above_one, interpolated, ratio_of_roots};
use super::super::markdown::{Page, link_to};
use super::super::numbers::{counted, estimate, percent, signed_estimate};
use super::super::summarise::{Cell, Summary};
use super::correlation::{Pattern, pattern_spp, patterns};
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
    for scene in 0..summary.scenes.len() {
        let alike = patterns(summary, scene);
        lines
            .extend(alike.iter().filter(|p| p.errs_alike() == Answer::Yes).map(|p| pattern_failure(summary, scene, p)));
    }
    lines.extend(pairs.iter().filter_map(|&(scene, sampler)| odd_failure(summary, scene, sampler)));
    if lines.is_empty() {
        page.paragraph("No failure is seen in these rows: no error stays, no bias is seen, no neighbours err alike, no odd count costs accuracy.");
    }
    let caption = format!(
        "Every failure that the rows show: what happens, and the number that says so (bias² in (W/(m² sr))²); {}. The counts of a verdict are in {}.",
        level(summary),
        link_to(titles::READING)
    );
    tabulate(page, "failures", &caption, &["failure", "sampler", "scene", "measured", "row"], &lines);
    stability(summary, page);
}

/// A wrong limit, a stall, or a bias beside a falling error.
fn course_failure(summary: &Summary, scene: usize, sampler: usize) -> Option<Vec<String>> {
    let (from, to) = summary.course_counts()?;
    let (course, cell) = (summary.course(scene, sampler)?, summary.cell(scene, sampler, to)?);
    let is_failure = match course.limit() {
        Limit::Wrong | Limit::Stalls => true,
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

/// One pattern in every pixel that makes neighbours err alike.
fn pattern_failure(summary: &Summary, scene: usize, pattern: &Pattern) -> Vec<String> {
    let rho = pattern.cell.error_autocorrelation.map_or("undefined".to_owned(), |rho| signed_estimate(&rho));
    vec![
        "structure instead of noise".to_owned(),
        name(summary, pattern.sampler),
        scene_name(summary, scene),
        format!("ρ = {rho} at {} spp", pattern.cell.spp.asked),
        marked_row(pattern.cell),
    ]
}

fn odd_failure(summary: &Summary, scene: usize, sampler: usize) -> Option<Vec<String>> {
    let odd = odd_count(summary, scene, sampler).filter(|odd| clearly_above_one(&odd.ratio))?;
    let cell = summary.cell(scene, sampler, odd.asked)?;
    Some(vec![
        format!("an odd count costs accuracy: {} spp", odd.asked),
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

/// How far replicates are apart.
fn stability(summary: &Summary, page: &mut Page) {
    let Some(spp) = summary.middle_spp() else { return };
    let spread = |cell: &Cell| -> Option<f64> {
        let (low, high) = cell.replicate_mse.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), &m| (l.min(m), h.max(m)));
        (cell.replicate_mse.len() > 1 && low > 0.0).then(|| (high / low).sqrt())
    };
    let lines: Vec<Vec<String>> = (0..summary.samplers.len())
        .map(|sampler| {
            let cells = (0..summary.scenes.len()).map(|scene| match summary.cell(scene, sampler, spp) {
                None => same_as_cell(summary, scene, sampler).unwrap_or("missing".to_owned()),
                Some(cell) if cell.is_fixed => "nothing random".to_owned(),
                Some(cell) => spread(cell).map_or("–".to_owned(), |s| format!("{s:.2}")),
            });
            std::iter::once(name(summary, sampler)).chain(cells).collect()
        })
        .collect();
    let mut head = vec!["sampler".to_owned()];
    head.extend((0..summary.scenes.len()).map(|scene| scene_name(summary, scene)));
    let caption = format!(
        "How stable each is from one randomisation to the next: largest over smallest RMSE of {} at {spp} spp (no unit).",
        counted(summary.about.experiment.replicates as usize, "replicate", "replicates")
    );
    tabulate(page, "spread", &caption, &head, &lines);
}

/// The table of advantages and disadvantages: every cell a measured predicate.
pub fn table(summary: &Summary, page: &mut Page) {
    page.heading(2, titles::TABLE);
    page.paragraph("Every cell is computed from rows; none is an opinion. \"yes\" below: the error falls and no bias is seen, within the interval given.");
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
            "Does it converge to the right image? In brackets bias² in (W/(m² sr))² at {to} spp; {}.",
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
        (Limit::Wrong, _) => "no",
        (Limit::Stalls, _) => "no bias seen, but it stalls",
        (Limit::Falls, Answer::No) => "yes",
        (Limit::Falls, Answer::Yes) if cell.is_fixed => "its error falls (all of it bias)",
        (Limit::Falls, Answer::Yes) => "its error falls, but it is biased",
        _ => "cannot tell",
    };
    format!("{word} ({}){}", estimate(&cell.bias2), reference::mark(cell))
}

fn against_uniform(summary: &Summary, scene: usize, sampler: usize, uniform: usize, spp: u32) -> String {
    if sampler == uniform {
        return "1".to_owned();
    }
    let cells = summary.cell(scene, sampler, spp).zip(summary.cell(scene, uniform, spp));
    let mark = cells.map_or("", |(own, _)| reference::mark(own));
    format!("{}{mark}", ratio_cell(cells.and_then(|(own, base)| rmse_ratio(own, base))))
}

/// What is one number a sampler: odd counts, randomness, neighbours, efficiency.
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
                let word = match (clearly_above_one(&odd.ratio), below(&odd.ratio, 1.0)) {
                    (true, _) => "worse than promised",
                    (_, Answer::Yes) => "better than promised",
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
            odd_asked.map_or("an odd count of".to_owned(), |n| n.to_string())
        ),
        "replicates differ".to_owned(),
        format!("ρ of neighbours, {} spp", pattern.unwrap_or(0)),
        "1/(MSE · T), relative to uniform (this machine)".to_owned(),
    ];
    let caption = format!(
        "What else tells them apart, in {at}: odd counts, randomness, correlation ρ of neighbouring pixels' errors, and efficiency at {} spp (T: seconds × threads; above 1 is better); {}.",
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
             with so many intervals in this report some miss their truth by chance, one in twenty by design. The verdicts \"biased\" and \"worse than promised\" ask for twice the distance for that reason.",
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
        let words = if shots == 1 { "The picture is".to_owned() } else { format!("{shots} pictures are") };
        items.push(format!("{words} shown once each; a single picture is an example, not a measurement."));
    }
    items.push(format!(
        "{} at small sizes: other scenes, sizes and lenses may rank the samplers otherwise.",
        counted(summary.scenes.len(), "scene", "scenes")
    ));
    page.bullets(&items);
}

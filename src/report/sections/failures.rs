//! Where methods fail, what each is good for, and what the measurement itself cannot see.

use crate::stats::Estimate;

use super::super::evidence::{Answer, Limit, clearly_above_one, interpolated, is_biased, ratio_of_roots};
use super::super::markdown::{Page, link_to, table_ref};
use super::super::numbers::{counted, percent, signed_estimate};
use super::super::summarise::Summary;
use super::neighbours::{Structure, structure};
use super::words::{bias_share_words, level, limit_words, marked_row, name, scene_name, times};
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

/// What the rows of this experiment's images show: every item is a measured failure.
pub fn section(summary: &Summary, page: &mut Page) {
    page.heading(3, "In these images");
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
        "Failures that the rows of the plain images show: what happens, and the number that says so; {}. The counts of a verdict are in {}, bias² in {}. What has nothing random in it \
         is all bias and is not listed for that alone{elsewhere}.",
        level(summary),
        link_to(titles::READING),
        table_ref("bias"),
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
            format!("RMSE {to} / {from} spp = {}; {}", times(&course.rmse_ratio), bias_share_words(cell, mean)),
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

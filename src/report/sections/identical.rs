//! Are the outputs identical? Bytes, means, patterns.

use std::collections::BTreeMap;

use crate::stats::Estimate;
use crate::stats::Moments;
use crate::stats::hypothesis::{holm, two_sided};

use super::super::evidence::Limit;
use super::super::markdown::{Page, link_to};
use super::super::numbers::{counted, listed, signed_estimate};
use super::super::summarise::{Cell, Summary};
use super::words::{level, main_scene, marked_row, name, scene_name};
use super::{tabulate_folded, titles};

/// Means count as equal in practice within this share of the mean radiance.
pub const EQUIVALENT: f64 = 0.01;

/// Adjusted p-values below this are told in words.
const TOLD_APART: f64 = 0.01;

/// Images of a scene that are bit for bit the same, by their digests.
pub struct Bytes {
    /// Samplers whose image is there.
    pub images: usize,
    /// How many different ones.
    pub distinct: usize,
    /// Samplers that share one, by index.
    pub same: Vec<Vec<usize>>,
}

/// Compares digests of first replicates at one count.
pub fn bytes(summary: &Summary, scene: usize, spp: u32) -> Bytes {
    let mut by_digest: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for sampler in 0..summary.samplers.len() {
        if let Some(digest) = summary.cell(scene, sampler, spp).and_then(|cell| cell.pixels.first()) {
            by_digest.entry(digest).or_default().push(sampler);
        }
    }
    let images = by_digest.values().map(Vec::len).sum();
    let same = by_digest.values().filter(|samplers| samplers.len() > 1).cloned().collect();
    Bytes { images, distinct: by_digest.len(), same }
}

/// The words for it.
pub fn bytes_words(summary: &Summary, scene: usize, spp: u32) -> String {
    let Bytes { images, distinct, same } = bytes(summary, scene, spp);
    let at = scene_name(summary, scene);
    if images < 2 {
        return format!("Fewer than two images of {at} at {spp} spp are there to compare.");
    }
    if same.is_empty() {
        return format!(
            "No two of the {images} samplers' images of {at} at {spp} spp are the same: {distinct} different digests of their pixels."
        );
    }
    let groups: Vec<String> =
        same.iter().map(|group| listed(&group.iter().map(|&i| name(summary, i)).collect::<Vec<_>>())).collect();
    format!(
        "The {images} samplers' images of {at} at {spp} spp have {distinct} different digests; bit for bit the same: {}.",
        groups.join("; ")
    )
}

/// A bias in shares of the scene's mean radiance.
pub fn relative_bias(summary: &Summary, cell: &Cell) -> Option<Estimate> {
    let mean =
        summary.scenes[cell.scene].reference.as_ref().map(|reference| reference.mean).filter(|mean| *mean > 0.0)?;
    let share = |x: f64| x / mean;
    Some(Estimate { value: share(cell.bias.value), ci95: cell.bias.ci95.map(|ends| ends.map(share)) })
}

/// Whether the mean is within [`EQUIVALENT`] of the reference's: by the whole interval.
fn equivalent(bias: &Estimate) -> &'static str {
    match bias.ci95 {
        Some([low, high]) if low > -EQUIVALENT && high < EQUIVALENT => "yes",
        Some([low, high]) if low > EQUIVALENT || high < -EQUIVALENT => "no",
        _ => "cannot tell",
    }
}

/// The section.
pub fn section(summary: &Summary, page: &mut Page) {
    page.heading(2, titles::IDENTICAL);
    let (Some(scene), Some(most)) = (main_scene(summary), summary.most_spp()) else { return };
    let mut sentences = vec![bytes_words(summary, scene, most)];
    for sampler in summary.samplers.iter().filter(|sampler| sampler.names.len() > 1) {
        let names: Vec<String> = sampler.names.iter().map(|name| format!("`{name}`")).collect();
        sentences.push(format!(
            "{} are one sampler by definition (`{}`), so their images are the same.",
            listed(&names),
            sampler.canonical
        ));
    }
    page.sentences(&sentences);
    page.paragraph(
        "Different bytes need not mean different pictures: two unbiased samplers differ by noise alone and agree ever better as samples are added. So the \
         means are compared, too.",
    );
    let sentences: Vec<String> = (0..summary.scenes.len())
        .map(|scene| {
            let cells: Vec<&Cell> = (0..summary.samplers.len()).filter_map(|i| summary.cell(scene, i, most)).collect();
            means_sentences(summary, scene, &cells).join(" ").trim_end().to_owned()
        })
        .collect();
    page.bullets(&sentences);
    page.paragraph(&format!(
        "Pictures of equal mean may still differ in where they err: {} and {}.",
        link_to(titles::BIAS),
        link_to(titles::PIXELS)
    ));
    means_table(summary, most, page);
}

/// The mean of every sampler in every scene.
fn means_table(summary: &Summary, most: u32, page: &mut Page) {
    let lines: Vec<Vec<String>> = (0..summary.scenes.len()).flat_map(|scene| means(summary, scene, most)).collect();
    let within = format!("within {} %", 100.0 * EQUIVALENT);
    let caption = format!(
        "Error of the mean at {most} spp: mean signed error in percent of the reference's mean radiance; \"{within}\" asks the whole interval. p: Student's test of the \
         replicates' mean error against 0 (the truth: closed form, or the reference with its own noise), Holm-adjusted over the samplers of a scene, – where there is one replicate; {}.",
        level(summary)
    );
    let head = ["scene", "sampler", "error of the mean (%)", &within, "p", "row"];
    tabulate_folded(page, "means", "The means and their tests", &caption, &head, &lines);
}

fn means(summary: &Summary, scene: usize, most: u32) -> Vec<Vec<String>> {
    let cells: Vec<&Cell> = (0..summary.samplers.len()).filter_map(|i| summary.cell(scene, i, most)).collect();
    let p_values = p_values(summary, &cells);
    let percent = |e: Estimate| {
        let scaled = Estimate { value: 100.0 * e.value, ci95: e.ci95.map(|ends| ends.map(|end| 100.0 * end)) };
        signed_estimate(&scaled)
    };
    let line = |cell: &&Cell| {
        let bias = relative_bias(summary, cell);
        let p = p_values.get(&cell.sampler);
        vec![
            scene_name(summary, scene),
            name(summary, cell.sampler),
            bias.map_or("–".to_owned(), percent),
            bias.map_or("cannot tell", |bias| equivalent(&bias)).to_owned(),
            p.map_or("–".to_owned(), |p| if *p < 0.001 { "< 0.001".into() } else { format!("{p:.3}") }),
            marked_row(cell),
        ]
    };
    cells.iter().map(line).collect()
}

/// Which means agree, and whether one hides a wrong image.
fn means_sentences(summary: &Summary, scene: usize, cells: &[&Cell]) -> [String; 3] {
    let off: Vec<String> = cells
        .iter()
        .filter(|cell| relative_bias(summary, cell).is_some_and(|bias| equivalent(&bias) == "no"))
        .map(|cell| name(summary, cell.sampler))
        .collect();
    let same =
        cells.iter().filter(|cell| relative_bias(summary, cell).is_some_and(|bias| equivalent(&bias) == "yes")).count();
    let words = match off.as_slice() {
        [] if same == cells.len() => format!(
            "In {} all means agree with the reference's within {} %.",
            scene_name(summary, scene),
            100.0 * EQUIVALENT
        ),
        [] => format!(
            "In {} {} with the reference's within {} %; for the others it cannot be told.",
            scene_name(summary, scene),
            agree(same),
            100.0 * EQUIVALENT
        ),
        off => format!(
            "In {} the mean of {} is off by more than {} %.",
            scene_name(summary, scene),
            listed(off),
            100.0 * EQUIVALENT
        ),
    };
    let hidden: Vec<String> = cells
        .iter()
        .filter(|cell| relative_bias(summary, cell).is_some_and(|bias| equivalent(&bias) == "yes"))
        .filter(|cell| summary.course(scene, cell.sampler).is_some_and(|course| course.limit() == Limit::Wrong))
        .map(|cell| name(summary, cell.sampler))
        .collect();
    let hidden = match hidden.as_slice() {
        [] => String::new(),
        list => format!(
            "A right mean is no right image: the images of {} converge to wrong ones all the same.",
            listed(list)
        ),
    };
    let p_values = p_values(summary, cells);
    let told: Vec<String> = cells
        .iter()
        .filter(|cell| p_values.get(&cell.sampler).is_some_and(|p| *p < TOLD_APART))
        .filter(|cell| relative_bias(summary, cell).is_some_and(|bias| equivalent(&bias) == "yes"))
        .map(|cell| name(summary, cell.sampler))
        .collect();
    let told = match told.as_slice() {
        [] => String::new(),
        list => format!(
            "Within that, {} still told apart from the truth (p < {TOLD_APART}): small, but no chance.",
            if list.len() == 1 {
                format!("the mean of {} is", list[0])
            } else {
                format!("the means of {} are", listed(list))
            }
        ),
    };
    [words, told, hidden]
}

fn agree(n: usize) -> String {
    format!("{} {}", counted(n, "mean", "means"), if n == 1 { "agrees" } else { "agree" })
}

/// p of a mean error of `bias` with R replicates' means about it: Student's t with R − 1 degrees of freedom, the reference's own
/// standard error added in squares (more of it only makes the test more cautious); `None` of one replicate, or where nothing
/// varies.
fn p_of_mean(bias: f64, replicate_mean: &[f64], reference_error: f64) -> Option<f64> {
    let moments: Moments = replicate_mean.iter().copied().collect();
    let error = libm::hypot(moments.standard_error()?, reference_error);
    (error > 0.0 && error.is_finite()).then(|| two_sided(bias / error, (replicate_mean.len() - 1) as f64))
}

/// Holm-adjusted p-values against the truth, by sampler.
fn p_values(summary: &Summary, cells: &[&Cell]) -> BTreeMap<usize, f64> {
    // The error of the reference's mean, pixels independent, the channels of one as one.
    let noise = |cell: &Cell| {
        let scene = &summary.scenes[cell.scene];
        Some(scene.reference_rmse()? / (scene.pixels as f64).sqrt())
    };
    let (samplers, raw): (Vec<usize>, Vec<f64>) = cells
        .iter()
        .filter_map(|cell| Some((cell.sampler, p_of_mean(cell.bias.value, &cell.replicate_mean, noise(cell)?)?)))
        .unzip();
    match holm(&raw) {
        Ok(adjusted) => samplers.into_iter().zip(adjusted).collect(),
        Err(_) => BTreeMap::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_is_tested_against_the_truth_with_the_reference_s_own_noise() {
        let means = [1.0, 1.2, 0.8, 1.0];
        // Standard error √(0.08/3)/2 = 0.0816; t = 0.26/0.0816 = 3.184 is the 97.5 % point at 3 degrees of freedom (3.182).
        let p = p_of_mean(0.26, &means, 0.0).unwrap();
        assert!((p - 0.05).abs() < 5e-4, "{p}");
        assert!(p_of_mean(0.26, &means, 0.1).unwrap() > p && p_of_mean(0.0, &means, 0.0) == Some(1.0));
        assert_eq!((p_of_mean(0.26, &means[..1], 0.0), p_of_mean(0.1, &[1.0, 1.0], 0.0)), (None, None));
    }
}

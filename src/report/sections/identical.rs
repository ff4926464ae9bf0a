//! Are the outputs identical? Bytes, means, patterns.

use std::collections::BTreeMap;

use crate::stats::Estimate;

use super::super::evidence::Limit;
use super::super::markdown::{Page, link_to, table_ref};
use super::super::numbers::{counted, listed, p_value, p_words, short, signed_estimate};
use super::super::summarise::{Cell, Summary};
use super::super::verdicts::{LEVEL, Measured, Sameness, holm_of};
use super::neighbours::{LEAST_RHO, measured_rho, pattern_spp};
use super::words::{against_one, level, main_scene, marked_row, name, ratio_cell, rmse_ratio, scene_name};
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

/// One sampler in one scene: its mean against the truth and against uniform's, its pattern and its noise against uniform's.
struct Compared<'a> {
    cell: &'a Cell,
    /// Mean error in shares of the mean radiance.
    truth: Option<Measured>,
    /// Mean less uniform's, in the same shares.
    mean: Option<Measured>,
    /// ρ of neighbouring pixels' errors less uniform's.
    pattern: Option<Measured>,
    /// RMSE over uniform's.
    noise: Option<Estimate>,
}

/// p-values of one kind of comparison; those of differences are Holm-adjusted over all scenes and samplers, see [`Sameness::of`].
struct Tested {
    /// Of no difference at all.
    zero: Vec<Option<f64>>,
    /// Of a difference as large as the margin or larger: small where sameness is shown.
    outside: Vec<Option<f64>>,
    /// Of a difference within the margin: small where a difference is shown.
    inside: Vec<Option<f64>>,
}

impl Tested {
    fn of(all: &[Compared], part: impl Fn(&Compared) -> Option<Measured>, margin: f64) -> Self {
        let holm =
            |p: &dyn Fn(&Measured) -> f64| holm_of(&all.iter().map(|c| part(c).as_ref().map(p)).collect::<Vec<_>>());
        Self {
            zero: holm(&|m| m.p_of(0.0)),
            outside: all.iter().map(|c| part(c).map(|m| m.p_outside(margin))).collect(),
            inside: holm(&|m| m.p_inside(margin)),
        }
    }

    fn sameness(&self, i: usize) -> Sameness {
        self.outside[i].zip(self.inside[i]).map_or(Sameness::CannotTell, |(o, i)| Sameness::of(o, i))
    }
}

/// All comparisons and their tests.
pub struct Identity<'a> {
    all: Vec<Compared<'a>>,
    truth: Tested,
    mean: Tested,
    pattern: Tested,
}

impl<'a> Identity<'a> {
    /// Compares every sampler in every scene, at the most samples per pixel (patterns where they are judged).
    pub fn of(summary: &'a Summary) -> Self {
        let cells = summary.most_spp().into_iter().flat_map(|most| {
            let pairs = (0..summary.scenes.len()).flat_map(|s| (0..summary.samplers.len()).map(move |p| (s, p)));
            pairs.filter_map(move |(scene, sampler)| summary.cell(scene, sampler, most))
        });
        let all: Vec<Compared> = cells.map(|cell| compared(summary, cell)).collect();
        let (truth, mean) = (Tested::of(&all, |c| c.truth, EQUIVALENT), Tested::of(&all, |c| c.mean, EQUIVALENT));
        let pattern = Tested::of(&all, |c| c.pattern, LEAST_RHO);
        Self { all, truth, mean, pattern }
    }

    fn of_scene(&self, scene: usize) -> impl Iterator<Item = (usize, &Compared<'a>)> {
        self.all.iter().enumerate().filter(move |(_, c)| c.cell.scene == scene)
    }

    /// `9 of 10 means are shown to be the truth's within 1 %; the largest error is …`, for the answer box too.
    pub fn truth_words(&self, summary: &Summary, scene: usize) -> Option<String> {
        let members: Vec<(usize, &Compared)> = self.of_scene(scene).filter(|(_, c)| c.truth.is_some()).collect();
        let same = members.iter().filter(|(i, _)| self.truth.sameness(*i) == Sameness::Same).count();
        let largest = |(_, c): &&(usize, &Compared)| c.truth.map_or(0.0, |m| m.value.abs());
        let (i, worst) = members.iter().max_by(|a, b| largest(a).total_cmp(&largest(b)))?;
        Some(format!(
            "{same} of {} means are shown to be the truth's within ±{} %; the largest error is that of {}, {} %, {} of its reaching {} %",
            members.len(),
            100.0 * EQUIVALENT,
            name(summary, worst.cell.sampler),
            in_percent(&worst.truth?.estimate()),
            p_words(self.truth.outside[*i]),
            100.0 * EQUIVALENT,
        ))
    }
}

/// A share in percent, with its interval.
fn in_percent(e: &Estimate) -> String {
    signed_estimate(&Estimate { value: 100.0 * e.value, ci95: e.ci95.map(|ends| ends.map(|end| 100.0 * end)) })
}

/// The mean radiance of a scene.
fn mean_radiance(summary: &Summary, scene: usize) -> Option<f64> {
    summary.scenes[scene].reference.as_ref().map(|reference| reference.mean).filter(|mean| *mean > 0.0)
}

/// Standard error of the reference's mean: pixels independent, the channels of one as one.
fn reference_error(summary: &Summary, scene: usize) -> Option<f64> {
    let scene = &summary.scenes[scene];
    Some(scene.reference_rmse()? / (scene.pixels as f64).sqrt())
}

/// The mean of a cell's images: over replicates, or the one there is where nothing is random.
fn mean_of(cell: &Cell) -> Option<Measured> {
    match (cell.is_fixed, cell.replicate_mean.as_slice()) {
        (true, [one]) => Some(Measured { value: *one, error: 0.0, freedom: f64::INFINITY }),
        (_, means) => Measured::mean(means),
    }
}

fn compared<'a>(summary: &'a Summary, cell: &'a Cell) -> Compared<'a> {
    let scene = cell.scene;
    let share = mean_radiance(summary, scene).map(|mean| 1.0 / mean);
    let truth = share.zip(mean_of(cell)).zip(reference_error(summary, scene)).map(|((share, mean), noise)| {
        // The degrees of freedom stay those of the replicates: more of the reference's noise only makes the tests cautious.
        Measured { value: cell.bias.value, error: libm::hypot(mean.error, noise), freedom: mean.freedom }.scaled(share)
    });
    let uniform = summary.uniform().filter(|&uniform| uniform != cell.sampler);
    let base = |spp: u32| summary.cell(scene, uniform?, spp);
    let mean = base(cell.spp.asked)
        .and_then(|base| Some(Measured::difference(&mean_of(cell)?, &mean_of(base)?).scaled(share?)));
    let pixels = summary.scenes[scene].pixels;
    let pattern = pattern_spp(summary).and_then(|spp| {
        let own = measured_rho(summary.cell(scene, cell.sampler, spp)?, pixels)?;
        Some(Measured::difference(&own, &measured_rho(base(spp)?, pixels)?))
    });
    Compared { cell, truth, mean, pattern, noise: base(cell.spp.asked).and_then(|base| rmse_ratio(cell, base)) }
}

/// The section.
pub fn section(summary: &Summary, identity: &Identity, page: &mut Page) {
    page.heading(2, titles::IDENTICAL);
    let (Some(scene), Some(most)) = (main_scene(summary), summary.most_spp()) else { return };
    let mut sentences = vec![format!("**Bytes.** {}", bytes_words(summary, scene, most))];
    for sampler in summary.samplers.iter().filter(|sampler| sampler.names.len() > 1) {
        let names: Vec<String> = sampler.names.iter().map(|name| format!("`{name}`")).collect();
        sentences.push(format!(
            "{} are one sampler by definition (`{}`), so their images are the same.",
            listed(&names),
            sampler.canonical
        ));
    }
    page.sentences(&sentences);
    page.paragraph(&format!(
        "**Means.** Different bytes need not mean different pictures: two unbiased samplers differ by noise alone. That no difference is seen is no proof of sameness, so sameness is tested: by two one-sided tests (TOST) against a margin of ±{} % of the mean radiance. \
         That is about the smallest step of brightness that an eye tells apart{}.",
        100.0 * EQUIVALENT,
        margin_words(summary)
    ));
    page.bullets(
        &(0..summary.scenes.len()).filter_map(|scene| means_sentence(summary, identity, scene)).collect::<Vec<_>>(),
    );
    if let Some(spp) = pattern_spp(summary).filter(|_| identity.all.iter().any(|c| c.pattern.is_some())) {
        page.paragraph(&format!(
            "**Patterns.** Pictures of one mean may err in different places: as grain, or as structure that neighbours share. ρ of neighbouring pixels' errors at {spp} spp against uniform sampling's, margin ±{LEAST_RHO}, the least that is called structure in {}.",
            link_to(titles::PIXELS)
        ));
        page.bullets(
            &(0..summary.scenes.len())
                .filter_map(|scene| pattern_sentence(summary, identity, scene))
                .collect::<Vec<_>>(),
        );
    }
    means_table(summary, identity, most, page);
    same_table(summary, identity, most, page);
}

/// How many standard errors of the reference the margin is, at the least.
fn margin_words(summary: &Summary) -> String {
    let errors = (0..summary.scenes.len()).filter_map(|scene| {
        let error = reference_error(summary, scene).filter(|error| *error > 0.0)?;
        Some(EQUIVALENT * mean_radiance(summary, scene)? / error)
    });
    let least = errors.fold(f64::INFINITY, f64::min);
    if least.is_finite() {
        format!(", and {} standard errors of the noisiest reference's mean", short(least))
    } else {
        String::new()
    }
}

/// Which means are shown the same as the truth and as uniform's, and what the test of no difference at all says.
fn means_sentence(summary: &Summary, identity: &Identity, scene: usize) -> Option<String> {
    let truth = identity.truth_words(summary, scene)?;
    let others: Vec<(usize, &Compared)> = identity.of_scene(scene).filter(|(_, c)| c.mean.is_some()).collect();
    let of = |wanted: Sameness| -> Vec<String> {
        let found = others.iter().filter(|(i, _)| identity.mean.sameness(*i) == wanted);
        found
            .map(|(i, c)| {
                let (difference, p) =
                    (c.mean.map_or(String::new(), |m| in_percent(&m.estimate())), identity.mean.inside[*i]);
                format!("{} ({difference} %, {})", name(summary, c.cell.sampler), p_words(p))
            })
            .collect()
    };
    let (same, different) = (of(Sameness::Same).len(), of(Sameness::Different));
    let mut words = format!("In {}, {truth}.", scene_name(summary, scene));
    if !others.is_empty() {
        words += &format!(
            " Of the {} other samplers' means {same} are shown to be uniform's within the margin",
            others.len()
        );
        words += &if different.is_empty() {
            ", and none is shown different.".to_owned()
        } else {
            format!("; shown different: {}.", listed(&different))
        };
    }
    let apart: Vec<String> = identity
        .of_scene(scene)
        .filter(|(i, _)| {
            identity.truth.sameness(*i) == Sameness::Same && identity.truth.zero[*i].is_some_and(|p| p < TOLD_APART)
        })
        .map(|(i, c)| {
            let error = c.truth.map_or(String::new(), |m| in_percent(&m.estimate()));
            format!("{} ({error} %, {})", name(summary, c.cell.sampler), p_words(identity.truth.zero[i]))
        })
        .collect();
    if !apart.is_empty() {
        words += &format!(" Within the margin, but no chance: {}.", listed(&apart));
    }
    let hidden: Vec<String> = identity
        .of_scene(scene)
        .filter(|(i, c)| {
            identity.truth.sameness(*i) == Sameness::Same
                && summary.course(scene, c.cell.sampler).is_some_and(|course| course.limit() == Limit::Wrong)
        })
        .map(|(_, c)| name(summary, c.cell.sampler))
        .collect();
    if !hidden.is_empty() {
        words += &format!(
            " A right mean is no right image: {} {} to wrong ones all the same ({}).",
            listed(&hidden),
            if hidden.len() == 1 { "converges" } else { "converge" },
            table_ref("literal")
        );
    }
    Some(words)
}

/// Whose errors have another pattern than uniform's, with number and test.
fn pattern_sentence(summary: &Summary, identity: &Identity, scene: usize) -> Option<String> {
    let of = |wanted: Sameness| -> Vec<(usize, &Compared)> {
        identity
            .of_scene(scene)
            .filter(|(i, c)| c.pattern.is_some() && identity.pattern.sameness(*i) == wanted)
            .collect()
    };
    let names = |members: &[(usize, &Compared)]| {
        listed(&members.iter().map(|(_, c)| name(summary, c.cell.sampler)).collect::<Vec<_>>())
    };
    let different: Vec<String> = of(Sameness::Different)
        .iter()
        .map(|(i, c)| {
            let difference = c.pattern.map_or(String::new(), |m| signed_estimate(&m.estimate()));
            format!("{} ({difference}, {})", name(summary, c.cell.sampler), p_words(identity.pattern.inside[*i]))
        })
        .collect();
    let (same, unclear) = (of(Sameness::Same), of(Sameness::CannotTell));
    let largest = same.iter().filter_map(|(i, c)| Some((c.pattern?, identity.pattern.outside[*i])));
    let largest = largest.max_by(|a, b| a.0.value.abs().total_cmp(&b.0.value.abs()));
    let mut parts = Vec::new();
    if !different.is_empty() {
        parts.push(format!("shown different: {}", listed(&different)));
    }
    if let Some((m, p)) = largest {
        parts.push(format!(
            "shown the same: {} (largest difference {}, {})",
            names(&same),
            signed_estimate(&m.estimate()),
            p_words(p)
        ));
    }
    if !unclear.is_empty() {
        parts.push(format!("cannot tell: {}", names(&unclear)));
    }
    (!parts.is_empty()).then(|| format!("In {}, {}.", scene_name(summary, scene), parts.join("; ")))
}

/// The mean of every sampler in every scene, against the truth.
fn means_table(summary: &Summary, identity: &Identity, most: u32, page: &mut Page) {
    let lines: Vec<Vec<String>> = identity
        .all
        .iter()
        .enumerate()
        .map(|(i, c)| {
            vec![
                scene_name(summary, c.cell.scene),
                name(summary, c.cell.sampler),
                c.truth.map_or("–".to_owned(), |m| in_percent(&m.estimate())),
                p_value(identity.truth.zero[i]),
                p_value(identity.truth.outside[i]),
                identity.truth.sameness(i).words().to_owned(),
                marked_row(c.cell),
            ]
        })
        .collect();
    let margin = 100.0 * EQUIVALENT;
    let caption = format!(
        "Error of the mean at {most} spp in percent of the mean radiance, with its 95 % interval: Student's over {}, the reference's noise in it (of one image without randomness that alone). p of 0: of no error at all; p of ±{margin} %: of an error of \
         {margin} % or more (TOST), below {} where the whole interval is within, and so the mean shown to be the truth's. That of 0 is Holm-adjusted over the table, and so is that of \"shown different\" (an error above {margin} %): findings below {LEVEL}.",
        counted(summary.about.experiment.replicates as usize, "replicate", "replicates"),
        0.5 * LEVEL,
    );
    let head =
        ["scene", "sampler", "error of the mean (%)", "p of 0", &format!("p of ±{margin} %"), "so the mean is", "row"];
    tabulate_folded(page, "means", "The means against the truth", &caption, &head, &lines);
}

/// Every sampler against uniform: mean, pattern, noise.
fn same_table(summary: &Summary, identity: &Identity, most: u32, page: &mut Page) {
    let compared = || identity.all.iter().enumerate().filter(|(_, c)| c.mean.is_some() || c.pattern.is_some());
    let lines: Vec<Vec<String>> = compared()
        .map(|(i, c)| {
            let noise = match c.noise.as_ref().map(against_one) {
                Some("less") => "less",
                Some("more") => "more",
                _ => "cannot tell",
            };
            vec![
                scene_name(summary, c.cell.scene),
                name(summary, c.cell.sampler),
                c.mean.map_or("–".to_owned(), |m| in_percent(&m.estimate())),
                p_value(identity.mean.outside[i]),
                identity.mean.sameness(i).words().to_owned(),
                c.pattern.map_or("–".to_owned(), |m| signed_estimate(&m.estimate())),
                p_value(identity.pattern.outside[i]),
                identity.pattern.sameness(i).words().to_owned(),
                ratio_cell(c.noise),
                noise.to_owned(),
            ]
        })
        .collect();
    let spp = pattern_spp(summary).unwrap_or(most);
    let caption = format!(
        "Each sampler against uniform sampling: means at {most} spp (difference in percent of the mean radiance, margin ±{} %), patterns at {spp} spp (difference of ρ of neighbouring pixels' errors, margin ±{LEAST_RHO}), RMSE at {most} spp over uniform's. \
         p: of a difference as large as the margin or larger (TOST by Welch's errors), below {} where the whole interval is within it; shown different: by the opposite test, Holm-adjusted over the table; {}.",
        100.0 * EQUIVALENT,
        0.5 * LEVEL,
        level(summary)
    );
    let head = [
        "scene",
        "sampler",
        "difference of means (%)",
        "p",
        "so means are",
        "difference of ρ",
        "p",
        "so patterns are",
        "RMSE / uniform's",
        "so its error is",
    ];
    tabulate_folded(page, "same", "Means, patterns and errors against uniform sampling's", &caption, &head, &lines);
}

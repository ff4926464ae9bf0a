//! What was run, how to read it, scenes and samplers.

use crate::experiment::spec::Estimators;
use crate::sampling::{Decision, SamplerSet};

use super::super::markdown::{Page, link_to};
use super::super::numbers::{counted, listed, short};
use super::super::provenance;
use super::super::summarise::{SLOPE_COUNTS, Summary};
use super::words::name;
use super::{reference, scenes, tabulate, tabulate_folded, titles};

/// Title, provenance, and what is missing.
pub fn title(summary: &Summary, page: &mut Page) {
    page.heading(1, &format!("Sampling techniques compared: {}", summary.about.experiment.name));
    page.paragraph(&format!(
        "Written by the tool from stored results, no sentence by hand: {}.",
        provenance::line(&summary.about)
    ));
    if !summary.missing.is_empty() {
        page.paragraph(&format!(
            "**Incomplete.** Missing: {}. What follows speaks of what is there; the command below makes the rest.",
            summary.missing.join("; ")
        ));
    }
}

/// What was run, and the one command.
pub fn what_was_run(summary: &Summary, page: &mut Page) {
    page.heading(2, "What was run");
    let e = &summary.about.experiment;
    let names: Vec<String> = summary.scenes.iter().map(|s| format!("`{}` at {}", s.name, s.size)).collect();
    let spp: Vec<String> = e.spp.iter().map(u32::to_string).collect();
    let mut items = vec![
        format!("{}: {}.", counted(names.len(), "scene", "scenes"), listed(&names)),
        format!(
            "{} at {} samples per pixel (spp), {} each (1 where nothing is random), {}.",
            counted(summary.samplers.len(), "sampler", "samplers"),
            listed(&spp),
            counted(e.replicates as usize, "replicate", "replicates"),
            estimator_words(e.estimator)
        ),
        reference::what_words(summary),
    ];
    if let Some(points) = &e.points {
        let (low, high) = (points.n.iter().min().copied().unwrap_or(0), points.n.iter().max().copied().unwrap_or(0));
        items.push(format!(
            "Point sets of {low} to {high} points, {} each, measured by {}.",
            counted(points.replicates as usize, "set", "sets"),
            listed(&points.metrics.iter().map(|m| format!("`{m}`")).collect::<Vec<_>>())
        ));
    }
    for pictures in &e.pictures {
        let spp: Vec<String> = pictures.spp.iter().map(u32::to_string).collect();
        items.push(format!(
            "Pictures: `{}` at {}, {} spp, compared with two halves of {} spp or the closed form.",
            pictures.scene,
            pictures.size,
            listed(&spp),
            pictures.reference_spp
        ));
    }
    page.bullets(&items);
    page.paragraph("The one command that makes all of this again:");
    page.code(&summary.about.command);
    page.paragraph(
        "Numbers behind every figure: [summary.csv](summary.csv), [slopes.csv](slopes.csv), [results.jsonl](results.jsonl) \
         (one line an item; rows are named by the first eight digits of their `id`).",
    );
    let notes: Vec<String> = summary.about.notes.iter().map(|note| format!("{note}.")).collect();
    let title = format!("What the plan made of the experiment ({})", counted(notes.len(), "note", "notes"));
    page.folded(&title, |page| page.bullets(&notes));
}

fn estimator_words(estimators: Estimators) -> &'static str {
    match estimators {
        Estimators::Unbiased => "unbiased estimator of light",
        Estimators::Sheet => "sheet estimator of light",
        Estimators::Both => {
            "unbiased estimator of light, and where a light is picked among several the sheet's shortcut too"
        }
    }
}

/// How to read the numbers.
pub fn how_to_read(summary: &Summary, page: &mut Page) {
    page.heading(3, titles::READING);
    let e = &summary.about.experiment;
    let (low, high) = (SLOPE_COUNTS.start(), SLOPE_COUNTS.end());
    page.bullets(&[
        "spp: samples per pixel, asked for unless \"taken\" is said. Radiance and its errors are in W/(m² sr), squared errors in its square. Rows of \
         `results.jsonl` are named by eight digits."
            .to_owned(),
        "`[low, high]` is a 95 % interval over independent replicates (each a whole image under a randomisation of its \
         own), with the reference's own noise in it. Ratios combine the intervals of both sides (MOVER on logarithms). \
         An interval that holds both answers is written \"cannot tell\"."
            .to_owned(),
        "RMSE: root mean square error over pixels and channels in linear radiance, freed of the reference's noise; so an \
         estimate may come out below 0, and is not clipped. MSE = bias² + variance: bias² is what all replicates have in \
         common and no averaging of them removes, variance what differs between them."
            .to_owned(),
        format!(
            "Slope: of log RMSE against log spp by least squares over powers of two from {low} to {high} that the sampler takes as \
             asked; the interval resamples replicates. Independent samples have −0.5. A star marks slopes whose interval \
             comes from the scatter about the line, because nothing is random or there is one replicate."
        ),
        format!(
            "A verdict on where an error goes compares {}: it *falls* if the RMSE's ratio lies below the border half-way (on a \
             logarithmic scale) between independent samples and no gain, and stays if it lies above; then the image is *wrong* if there is a bias that \
             stays, too, while the variance falls; it *stalls* if no bias is seen, and *stalls and is biased* if the variance stays beside the bias. A bias is called only where 0 is more than twice as far from the estimate as the interval's \
             end, since among so many intervals some miss 0 by chance.",
            summary.course_counts().map_or("two counts".to_owned(), |(a, b)| format!("{a} with {b} spp"))
        ),
        "`:sheet` is the exercise sheet read literally: every decision (pixel, lens, light) walks through the same set in the same \
         order. `:best` keeps the decisions apart. Correlation ρ between neighbouring pixels' errors: 0 for independent unbiased pixels, above 0 where an error is shared (one pattern in all pixels, or a bias that varies slowly over the picture), 1 where \
         all err alike."
            .to_owned(),
        reference::share_words(summary),
        format!("Seeds of all randomisations are derived from {} and stand in the rows.", e.seed),
    ]);
}

/// The tables of scenes and samplers.
pub fn scenes_and_samplers(summary: &Summary, page: &mut Page) {
    page.heading(3, "Scenes and samplers");
    scenes::matrix(summary, page);
    let rows: Vec<Vec<String>> = summary
        .scenes
        .iter()
        .enumerate()
        .map(|(i, scene)| {
            let reference = scene.reference.as_ref();
            let mut line = vec![
                format!("`{}`", scene.name),
                scene.size.to_string(),
                reference.map_or("missing".to_owned(), |r| short(r.mean)),
            ];
            line.extend(reference::cells(summary, i));
            line
        })
        .collect();
    let mut head = vec!["scene", "pixels", "mean radiance"];
    head.extend(reference::HEADS);
    let caption = "Scenes: size of the compared images in pixels, mean radiance, what the reference is made of, its own error (root mean square, \
                   RMSE), the smallest RMSE that it judges, and the first over the second; radiance in W/(m² sr).";
    tabulate(page, "scenes", caption, &head, &rows);
    let rows: Vec<Vec<String>> = (0..summary.samplers.len()).map(|i| sampler_row(summary, i)).collect();
    let caption = "Samplers: the full form of each name (points:order:randomisation@scope), whether another seed gives another set, and the samples per pixel that it takes \
                   where 26 are asked for.";
    tabulate(page, "samplers", caption, &["sampler", "stands for", "random", "takes where 26 are asked"], &rows);
    let rows: Vec<Vec<String>> = (0..summary.samplers.len())
        .filter_map(|i| Some(vec![name(summary, i), what_it_does(summary.samplers[i].set.as_ref()?)]))
        .collect();
    let head = ["sampler", "what it does"];
    tabulate_folded(page, "what-it-does", "What each sampler does, in words", "What each sampler does.", &head, &rows);
    page.paragraph(&format!("What each is good for: {}.", link_to(titles::TABLE)));
}

/// A sampler in words; of a set with a sampler for each decision which decisions read another one.
fn what_it_does(set: &SamplerSet) -> String {
    match set.single() {
        Some(spec) => spec.describe(),
        None => format!(
            "A sampler for each decision: all read the first but {}.",
            listed(&set.majority().1.iter().map(|d| format!("the {}", d.name())).collect::<Vec<_>>())
        ),
    }
}

fn sampler_row(summary: &Summary, i: usize) -> Vec<String> {
    let sampler = &summary.samplers[i];
    let names = match sampler.names.as_slice() {
        [one] if *one == sampler.label => name(summary, i),
        names => {
            format!("{} ({})", name(summary, i), listed(&names.iter().map(|n| format!("`{n}`")).collect::<Vec<_>>()))
        }
    };
    let Some(set) = &sampler.set else {
        return vec![names, format!("`{}`", sampler.canonical), "unknown here".into(), "unknown".into()];
    };
    let is_random = Decision::ALL.iter().any(|&decision| set.of(decision).is_random());
    let random = if is_random { "yes" } else { "no" };
    let taken = Decision::ALL.iter().filter(|d| d.dimensions() == 2).map(|&d| set.of(d).taken(26)).max().unwrap_or(26);
    let meaning = match set.single() {
        Some(spec) => format!("`{}`", spec.expansion()),
        None => {
            let (most, odd) = set.majority();
            let odd: Vec<String> = odd.iter().map(|&d| format!("{}: `{}`", d.name(), set.of(d).expansion())).collect();
            format!("`{}`; {}", most.expansion(), odd.join("; "))
        }
    };
    vec![names, meaning, random.to_owned(), taken.to_string()]
}

//! How each sampler bears what should make no difference: a sample more or less, another randomisation, another unit of
//! length, two passes.

use crate::experiment::results::{JUMP, Variant};

use super::super::evidence::Limit;
use super::super::markdown::Page;
use super::super::numbers::{counted, listed, percent, short, with_interval};
use super::super::stability::{
    Differences, FALSE_ALARM, JUMPING, LEAST, MARGIN, Promise, ROUNDING, ScaleVerdict, SpreadVerdict, Stretch, Verdict,
    WIDE, count_against, differences, passes_against, promise, scale_verdict, scaled_ratio, spread,
};
use super::super::summarise::{Cell, Subject, Summary};
use super::super::write::Figures;
use super::words::{level, limit_words, name, ratio_cell, rows, scene_name, times};
use super::{show, tabulate, tabulate_folded, titles};

/// The section, where the experiment asks for it.
pub fn section(summary: &Summary, figures: &Figures, page: &mut Page) {
    let Some(asked) = &summary.about.experiment.stability else { return };
    page.heading(2, titles::STABILITY);
    if summary.stability.is_empty() {
        page.paragraph("There are no rows yet to tell of stability.");
        return;
    }
    let stretch = Stretch::of(summary);
    page.paragraph(&format!("What should make no difference, held against {} spp:", asked.spp));
    page.bullets(&[
        format!(
            "{} are judged below, by *stretched* intervals: wider than 95 % ones by Student's factor for all of them together, {} at {} degrees of freedom, on a logarithmic scale. A difference that is not there is called anywhere \
             with a chance of at most {}.",
            counted(stretch.comparisons, "ratio of errors", "ratios of errors"),
            short(stretch.factor(stretch.freedom)),
            stretch.freedom,
            percent(FALSE_ALARM),
        ),
        format!(
            "*Worse*: more than {} above what is promised, with the whole stretched interval. *Stable*: at most {} above it, likewise. All else: *cannot tell*.",
            percent(LEAST - 1.0),
            percent(MARGIN - 1.0),
        ),
    ]);
    let scenes: Vec<String> = by_scene(summary).iter().map(|(scene, _)| scene_name(summary, *scene)).collect();
    let caption = format!(
        "RMSE over what is promised of it (no unit), at other counts and in two passes, in {}; bars: stretched intervals, {}; dashed: as promised. Against one pass of {} spp, \
         numbers in [stability.csv](stability.csv).",
        listed(&scenes),
        replicates_words(summary),
        asked.spp
    );
    show(page, figures, "stability", true, &caption);
    counts(summary, &stretch, page);
    replicates(summary, page);
    scales(summary, page);
    passes(summary, &stretch, page);
}

/// `8 replicates (1 where nothing is random)`.
fn replicates_words(summary: &Summary) -> String {
    let fixed = if summary.stability.iter().any(|s| s.base.is_fixed) { " (1 where nothing is random)" } else { "" };
    format!("{}{fixed}", counted(summary.about.experiment.replicates as usize, "replicate", "replicates"))
}

/// A sampler's name, and where its error does not fall as it should what it does instead: then the count matters little, and
/// "stable" is no praise.
fn name_and_limit(summary: &Summary, subject: &Subject) -> String {
    let who = name(summary, subject.sampler);
    let course = summary.course(subject.scene, subject.sampler);
    match course.filter(|course| !matches!(course.limit(), Limit::Falls | Limit::Unclear)) {
        Some(course) => format!("{who} (which {})", limit_words(&course)),
        None => who,
    }
}

/// The subjects scene by scene.
fn by_scene(summary: &Summary) -> Vec<(usize, Vec<&Subject>)> {
    let of = |scene: usize| summary.stability.iter().filter(|subject| subject.scene == scene).collect::<Vec<_>>();
    (0..summary.scenes.len()).map(|scene| (scene, of(scene))).filter(|(_, subjects)| !subjects.is_empty()).collect()
}

/// Samplers under the words that fit them, an item a group: what [`told`] says where members have much to say.
fn told_in_items(at: &str, groups: &[(String, Vec<String>)]) -> Vec<String> {
    let groups = groups.iter().filter(|(_, members)| !members.is_empty());
    groups.map(|(words, members)| format!("In {at}, {words}: {}.", listed(members))).collect()
}

/// Samplers under the words that fit them, as one sentence about a scene; words in the order in which they are given.
fn told(at: &str, groups: &[(String, Vec<String>)]) -> String {
    let parts = groups.iter().filter(|(_, members)| !members.is_empty());
    let parts: Vec<String> = parts.map(|(words, members)| format!("{words}: {}", listed(members))).collect();
    format!("In {at}, {}.", parts.join("; "))
}

// --- a sample more or less ---

/// What a count is to the base, in the words of a verdict.
fn way_of(base: u32, asked: u32) -> String {
    match asked {
        n if n + 1 == base => "with a sample less".to_owned(),
        n if n == base + 1 => "with a sample more".to_owned(),
        n => format!("at {n} spp"),
    }
}

fn counts(summary: &Summary, stretch: &Stretch, page: &mut Page) {
    let Some(asked) = summary.about.experiment.stability.as_ref() else { return };
    page.heading(3, "A sample more or less");
    page.paragraph(&format!(
        "RMSE over that at {} spp. {} Where a sampler takes another count than asked, it is judged by what it took. In each cell: the ratio with its 95 % interval; what is promised of it; the one over \
         the other with its stretched interval, and the verdict that rests on it.",
        asked.spp,
        promise_words(summary)
    ));
    for (scene, subjects) in by_scene(summary) {
        let mut head = vec![format!("in {}", scene_name(summary, scene))];
        head.extend(asked.counts().iter().map(|n| format!("{n} / {} spp", asked.spp)));
        head.push("verdict".to_owned());
        let lines: Vec<Vec<String>> = subjects
            .iter()
            .map(|subject| {
                let cells = subject.counts.iter().map(|cell| count_cell(summary, stretch, subject, cell));
                let verdict = count_words(summary, stretch, subject);
                std::iter::once(name_and_limit(summary, subject)).chain(cells).chain([verdict]).collect()
            })
            .collect();
        let at = scene_name(summary, scene);
        let caption = format!(
            "RMSE over that at {} spp in {at} (no unit), what is promised of it, and the one over the other with its stretched interval; {}.",
            asked.spp,
            level(summary)
        );
        tabulate(page, &format!("counts-{}", summary.scenes[scene].name), &caption, &head, &lines);
        page.bullets(&count_sentences(summary, stretch, scene, &subjects));
    }
}

/// Which promises there are, each where any count rests on it.
fn promise_words(summary: &Summary) -> String {
    let all = || summary.stability.iter().flat_map(|s| s.counts.iter().map(move |cell| promise(summary, s, cell)));
    let by_neighbours = all().any(|promise| matches!(promise, Promise::Neighbours(..)));
    let is_there = |what: Promise| all().any(|promise| promise == what);
    let mut rules = Vec::new();
    if by_neighbours {
        rules.push(
            "a count between two that were compared (powers of two, and the base) is promised what a straight line of logarithms between these two says",
        );
    }
    if is_there(Promise::NoHarm) {
        rules.push("that a sample more does no harm, where no larger count was compared");
    }
    if is_there(Promise::Slope) {
        rules.push("a count outside the compared ones is promised the power of the counts that the sampler's own slope says (−1/2 where none was fitted)");
    }
    format!("Promised: {}.", rules.join("; "))
}

fn count_cell(summary: &Summary, stretch: &Stretch, subject: &Subject, cell: &Cell) -> String {
    let text = match count_against(summary, subject, cell) {
        None => "below noise".to_owned(),
        Some(against) => format!(
            "{}, promised {}: {} {}",
            times(&against.ratio),
            short(against.promised.value),
            times(&stretch.stretched(&against)),
            stretch.judge(&against).word()
        ),
    };
    let base = subject.base.spp;
    let other = |cell: &Cell| cell.spp.taken != cell.spp.asked;
    match (other(cell), other(&subject.base)) {
        (false, false) => text,
        (true, false) => format!("{text}, {} taken", cell.spp.taken),
        (_, true) => format!("{text}, {} against {} taken", cell.spp.taken, base.taken),
    }
}

/// Each count's verdict.
fn count_verdicts(summary: &Summary, stretch: &Stretch, subject: &Subject) -> Vec<Verdict> {
    let verdict = |cell: &Cell| count_against(summary, subject, cell).map(|against| stretch.judge(&against));
    subject.counts.iter().map(|cell| verdict(cell).unwrap_or(Verdict::CannotTell)).collect()
}

/// "worse with a sample more", "stable", "cannot tell".
fn count_words(summary: &Summary, stretch: &Stretch, subject: &Subject) -> String {
    let verdicts = count_verdicts(summary, stretch, subject);
    let is_worse = |(_, verdict): &(&Cell, &Verdict)| **verdict == Verdict::Worse;
    let worse = subject.counts.iter().zip(&verdicts).filter(is_worse);
    let worse: Vec<String> = worse.map(|(cell, _)| way_of(subject.base.spp.asked, cell.spp.asked)).collect();
    if !worse.is_empty() {
        return format!("worse {}", listed(&worse));
    }
    if verdicts.iter().all(|&verdict| verdict == Verdict::Stable) { "stable" } else { "cannot tell" }.to_owned()
}

/// Who is worse at which count and by how much, who is stable, of whom it cannot be told.
fn count_sentences(summary: &Summary, stretch: &Stretch, scene: usize, subjects: &[&Subject]) -> Vec<String> {
    let Some(asked) = summary.about.experiment.stability.as_ref() else { return Vec::new() };
    let mut groups: Vec<(String, Vec<String>)> = Vec::new();
    for (i, &count) in asked.counts().iter().enumerate() {
        let worse = subjects.iter().filter(|s| count_verdicts(summary, stretch, s)[i] == Verdict::Worse);
        let members = worse.filter_map(|subject| {
            let against = count_against(summary, subject, &subject.counts[i])?;
            let rows = rows(&[&subject.counts[i], &subject.base]);
            Some(format!("{} {} {rows}", name_and_limit(summary, subject), times(&stretch.stretched(&against))))
        });
        let words = format!("worse {} (RMSE over the promised, stretched intervals)", way_of(asked.spp, count));
        groups.push((words, members.collect()));
    }
    for (words, word) in [("stable at every count", "stable"), ("cannot tell", "cannot tell")] {
        let members = subjects.iter().filter(|subject| count_words(summary, stretch, subject) == word);
        groups.push((words.to_owned(), members.map(|subject| name_and_limit(summary, subject)).collect()));
    }
    told_in_items(&scene_name(summary, scene), &groups)
}

// --- replicates ---

fn replicates(summary: &Summary, page: &mut Page) {
    page.heading(3, "From one randomisation to the next");
    let n = summary.about.experiment.replicates;
    if n < 2 {
        page.paragraph("One replicate: nothing can be said of their spread.");
        return;
    }
    page.paragraph(&format!(
        "How much the RMSE of {n} replicates varies: standard deviation over mean (coefficient of variation), with the 95 % interval of a normal one. *Narrow*: at most {}, *wide*: more, each with the whole interval, one in twenty of which may err. \
         One more replicate is worse than the worst of these with probability 1/{}.",
        percent(WIDE),
        n + 1
    ));
    let word = |verdict: SpreadVerdict| match verdict {
        SpreadVerdict::Narrow => "narrow",
        SpreadVerdict::Wide => "wide",
        SpreadVerdict::CannotTell => "cannot tell",
    };
    let of = |subject: &Subject| spread(&subject.base);
    let lines: Vec<Vec<String>> = summary
        .stability
        .iter()
        .map(|subject| {
            let numbers = match of(subject) {
                _ if subject.base.is_fixed => ["–", "–", "–", "–", "nothing random"].map(str::to_owned),
                None => ["–", "–", "–", "–", "cannot tell"].map(str::to_owned),
                Some(s) => [
                    short(s.median),
                    short(s.worst),
                    short(s.best),
                    with_interval(&s.variation, percent),
                    word(s.verdict).to_owned(),
                ],
            };
            [scene_name(summary, subject.scene), name(summary, subject.sampler)].into_iter().chain(numbers).collect()
        })
        .collect();
    let spp = summary.about.experiment.stability.as_ref().map_or(0, |stability| stability.spp);
    let caption = format!(
        "Median RMSE in W/(m² sr) of {n} replicates at {spp} spp, the worst and best over it, and the coefficient of variation with its 95 % interval (no units)."
    );
    let head =
        ["scene", "sampler", "median RMSE", "worst / median", "best / median", "coefficient of variation", "spread"];
    tabulate_folded(page, "spread", "Worst, best and median replicate", &caption, &head, &lines);
    let items: Vec<String> = by_scene(summary)
        .iter()
        .map(|(scene, subjects)| {
            let random: Vec<&&Subject> = subjects.iter().filter(|subject| !subject.base.is_fixed).collect();
            let members = |verdict: SpreadVerdict| {
                let is_it =
                    |s: &&&&Subject| of(s).map_or(SpreadVerdict::CannotTell, |spread| spread.verdict) == verdict;
                random.iter().filter(is_it).map(|subject| name(summary, subject.sampler)).collect::<Vec<_>>()
            };
            let groups = [
                ("the spread is wide".to_owned(), members(SpreadVerdict::Wide)),
                ("narrow".to_owned(), members(SpreadVerdict::Narrow)),
                ("cannot tell".to_owned(), members(SpreadVerdict::CannotTell)),
                (
                    "nothing random".to_owned(),
                    subjects.iter().filter(|s| s.base.is_fixed).map(|s| name(summary, s.sampler)).collect(),
                ),
            ];
            told(&scene_name(summary, *scene), &groups)
        })
        .collect();
    page.bullets(&items);
}

// --- another unit of length ---

/// The scaled makings of a subject.
fn scaled(subject: &Subject) -> impl Iterator<Item = (i8, &Cell)> {
    subject.remade.iter().filter_map(|(variant, cell)| match variant {
        Variant::Scaled(power) => Some((*power, cell)),
        _ => None,
    })
}

fn scales(summary: &Summary, page: &mut Page) {
    page.heading(3, "In another unit of length");
    page.paragraph("All lengths of the scene (mesh, camera, lens, focus) multiplied, the same seeds. Radiance has no unit of length, so nothing but roundings may change.");
    page.bullets(&[
        format!("A pixel *jumps* where a rounding moves a ray across an edge: by more than {} of the mean radiance.", short(JUMP)),
        format!(
            "*Unchanged beyond rounding*: in every replicate at most {} of the pixels jump, and the others differ by a root mean square of at most {} of the mean radiance. *Changed*: more than that in one replicate.",
            percent(JUMPING),
            percent(ROUNDING)
        ),
        "The worst replicate is shown. Ratios are paired, so the reference's noise, common to both, is not in their intervals.".to_owned(),
    ]);
    let mut lines = Vec::new();
    for subject in &summary.stability {
        for (power, cell) in scaled(subject) {
            let d = differences(&subject.base, &cell.twins);
            let of = |value: Option<String>| value.unwrap_or_else(|| "–".to_owned());
            lines.push(vec![
                scene_name(summary, subject.scene),
                name(summary, subject.sampler),
                format!("1e{power}").replace('-', "−"),
                of(scaled_ratio(&subject.base, cell).map(|ratio| with_interval(&ratio, |x| format!("{x:.4}")))),
                of(d.map(|d| percent(d.differing))),
                of(d.map(|d| percent(d.jumping))),
                of(d.map(|d| short(d.largest))),
                of(d.and_then(|d| d.rms).map(short)),
                scale_verdict(&subject.base, cell).word().to_owned(),
            ]);
        }
    }
    let head = [
        "scene",
        "sampler",
        "lengths times",
        "RMSE / as it is",
        "pixels that differ in a bit",
        "pixels that jump",
        "largest difference / mean",
        "RMS difference / mean",
        "verdict",
    ];
    let spp = summary.about.experiment.stability.as_ref().map_or(0, |stability| stability.spp);
    let caption = format!(
        "RMSE of scaled scenes over that of the scene as it is at {spp} spp, replicate by replicate with the same seeds, and how far the images differ (no units); {}.",
        level(summary)
    );
    tabulate_folded(page, "scales", "Scene by scene, sampler by sampler", &caption, &head, &lines);
    page.bullets(
        &by_scene(summary)
            .iter()
            .map(|(scene, subjects)| scale_sentence(summary, *scene, subjects))
            .collect::<Vec<_>>(),
    );
}

fn scale_sentence(summary: &Summary, scene: usize, subjects: &[&Subject]) -> String {
    let all: Vec<ScaleVerdict> =
        subjects.iter().flat_map(|s| scaled(s).map(|(_, cell)| scale_verdict(&s.base, cell))).collect();
    if let [first, rest @ ..] = all.as_slice()
        && rest.iter().all(|verdict| verdict == first)
    {
        return format!("In {}, {} under every sampler at every scale.", scene_name(summary, scene), first.word());
    }
    let verdicts = [ScaleVerdict::Changed, ScaleVerdict::Unchanged, ScaleVerdict::Same, ScaleVerdict::CannotTell];
    let groups: Vec<(String, Vec<String>)> = verdicts
        .into_iter()
        .map(|verdict| {
            let members = subjects.iter().filter_map(|subject| {
                let powers: Vec<String> = scaled(subject)
                    .filter(|(_, cell)| scale_verdict(&subject.base, cell) == verdict)
                    .map(|(power, _)| format!("1e{power}").replace('-', "−"))
                    .collect();
                (!powers.is_empty()).then(|| format!("{} (× {})", name(summary, subject.sampler), listed(&powers)))
            });
            (verdict.word().to_owned(), members.collect())
        })
        .collect();
    told(&scene_name(summary, scene), &groups)
}

// --- two passes ---

/// The subject made in two passes.
fn in_passes(subject: &Subject) -> Option<&Cell> {
    subject.remade.iter().find(|(variant, _)| *variant == Variant::TwoPasses).map(|(_, cell)| cell)
}

fn passes(summary: &Summary, stretch: &Stretch, page: &mut Page) {
    let Some(asked) = summary.about.experiment.stability.as_ref() else { return };
    if asked.spp < 2 {
        return;
    }
    page.heading(3, "Two passes");
    page.paragraph(&format!(
        "The driver of the sheet's framework makes a first pass of 1 sample and a second of {}, and its samplers begin anew in each:",
        asked.spp - 1
    ));
    page.bullets(&[
        format!(
            "a deterministic sequence repeats its first point; a randomised one draws another randomisation; a set made for {} points is replaced by one for {}.",
            asked.spp,
            asked.spp - 1
        ),
        format!("The mean, weighted by the samples taken, is held against one pass of {}; promised is what the samples taken are worth.", asked.spp),
        "Ratios are paired, so the reference's noise, common to both, is not in their intervals.".to_owned(),
    ]);
    let lines: Vec<Vec<String>> = summary
        .stability
        .iter()
        .filter_map(|subject| {
            let cell = in_passes(subject)?;
            let against = passes_against(summary, subject, cell);
            let equal = differences(&subject.base, &cell.twins)
                .map_or("–".to_owned(), |Differences { same, .. }| format!("{same} of {}", cell.twins.len()));
            let taken = match (cell.spp.taken, subject.base.spp.taken) {
                (two, one) if two == one => two.to_string(),
                (two, one) => format!("{two} against {one}"),
            };
            Some(vec![
                scene_name(summary, subject.scene),
                name(summary, subject.sampler),
                taken,
                ratio_cell(against.map(|against| against.ratio)),
                against.map_or("–".to_owned(), |against| short(against.promised.value)),
                ratio_cell(against.map(|against| stretch.stretched(&against))),
                equal,
                pass_word(pass_verdict(summary, stretch, subject)).to_owned(),
            ])
        })
        .collect();
    let head = [
        "scene",
        "sampler",
        "samples taken",
        "RMSE in two / in one",
        "promised",
        "the one over the other, stretched",
        "bit for bit equal",
        "verdict",
    ];
    let caption = format!(
        "RMSE of two passes of 1 and {} spp over that of one pass of {} (no unit), replicate by replicate; {}.",
        asked.spp - 1,
        asked.spp,
        level(summary)
    );
    tabulate_folded(page, "passes", "Scene by scene, sampler by sampler", &caption, &head, &lines);
    let items: Vec<String> = by_scene(summary)
        .iter()
        .flat_map(|(scene, subjects)| pass_sentences(summary, stretch, *scene, subjects))
        .collect();
    page.bullets(&items);
}

fn pass_verdict(summary: &Summary, stretch: &Stretch, subject: &Subject) -> Verdict {
    let against = in_passes(subject).and_then(|cell| passes_against(summary, subject, cell));
    against.map_or(Verdict::CannotTell, |against| stretch.judge(&against))
}

fn pass_word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Worse => "worse in two passes",
        Verdict::Stable => "stable",
        Verdict::CannotTell => "cannot tell",
    }
}

fn pass_sentences(summary: &Summary, stretch: &Stretch, scene: usize, subjects: &[&Subject]) -> Vec<String> {
    let groups: Vec<(String, Vec<String>)> = [Verdict::Worse, Verdict::Stable, Verdict::CannotTell]
        .into_iter()
        .map(|verdict| {
            let members = subjects.iter().filter(|subject| pass_verdict(summary, stretch, subject) == verdict);
            let members = members.map(|subject| {
                let who = name_and_limit(summary, subject);
                let cell = in_passes(subject).filter(|_| verdict == Verdict::Worse);
                let against = cell.and_then(|cell| Some((cell, passes_against(summary, subject, cell)?)));
                against.map_or(who.clone(), |(cell, against)| {
                    format!("{who} {} {}", times(&stretch.stretched(&against)), rows(&[cell, &subject.base]))
                })
            });
            let by = if verdict == Verdict::Worse { " (over the promised, stretched intervals)" } else { "" };
            (format!("{}{by}", pass_word(verdict)), members.collect())
        })
        .collect();
    told_in_items(&scene_name(summary, scene), &groups)
}

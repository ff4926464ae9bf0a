//! Which decision matters: one sentence a scene and exchange, a table, a figure.

use crate::sampling::Decision;
use crate::stats::Estimate;

use super::super::ablation::{Ablation, Part, Question, Source, ablations};
use super::super::evidence::{Answer, below};
use super::super::markdown::{Page, figure_ref, table_ref};
use super::super::numbers::{counted, listed, percent, with_interval};
use super::super::summarise::{Cell, Summary};
use super::super::write::Figures;
use super::words::{level, name, rows, scene_name};
use super::{show, tabulate, titles};

/// The section; nothing where no set of samplers was compared.
pub fn section(summary: &Summary, figures: &Figures, page: &mut Page) {
    if !summary.samplers.iter().any(|sampler| sampler.is_mixed()) {
        return;
    }
    page.heading(2, titles::WHICH);
    let found: Vec<(usize, Vec<Ablation>)> =
        (0..summary.scenes.len()).map(|scene| (scene, ablations(summary, scene))).collect();
    if found.iter().all(|(_, groups)| groups.is_empty()) {
        page.paragraph(
            "No set of samplers differs in exactly one decision from a sampler that was compared too, so nothing is said of single decisions.",
        );
        return;
    }
    explain(&found, page);
    page.paragraph(&format!(
        "All shares side by side: {}, drawn in {}.",
        table_ref("which-decision"),
        figure_ref("which-decision")
    ));
    let items: Vec<String> = found.iter().flat_map(|(scene, groups)| scene_items(summary, *scene, groups)).collect();
    page.bullets(&items);
    let caption = format!(
        "Share of the MSE that goes where one decision alone reads another sampler, and where all do, with 95 % intervals, {} spp, {}; below 0 the error grew. \
         A row a scene, a column an exchange; what a scene does not decide is not there.",
        counts(&found),
        counted(summary.about.experiment.replicates as usize, "replicate", "replicates")
    );
    show(page, figures, "which-decision", true, &caption);
    shares_table(summary, &found, page);
}

/// What is measured, and how it is judged; only of the questions that were asked.
fn explain(found: &[(usize, Vec<Ablation>)], page: &mut Page) {
    let asks = |question| found.iter().flat_map(|(_, groups)| groups).any(|group| group.question == question);
    page.paragraph(
        "One decision at a time reads another sampler, all others stay as they were; given is the share of the mean square error that goes, \
         1 − MSE/MSE before, at the largest common count. Replicates are independent of each other. A decision is named where it takes more away than every other one at a joint level of 95 % \
         (intervals widened for the number of decisions, Bonferroni); decisions that this does not part from the largest share are named together. \"Almost as much\" is at least four fifths of the largest share, by the whole of both intervals.",
    );
    if asks(Question::Share) {
        page.paragraph(
            "*From independent points*: every decision draws uniform numbers, then one alone gets well-spread points. What goes is the decision's main effect, the first-order part of \
             an analysis of variance of the pixel, as far as so many points find it: a lower bound. What is left when all these shares are taken off hangs on decisions together \
             (interactions), or is what the points missed.",
        );
    }
    if asks(Question::Coupling) {
        page.paragraph(
            "*From in step*: every decision walks through the same set in the same order, then one alone gets an order of its own, over the same points. What goes is what its coupling with the others costs. A coupling \
             takes two: where one pair alone matters, parting either of the two cures it, and the two cannot be told apart.",
        );
    }
}

fn scene_items(summary: &Summary, scene: usize, groups: &[Ablation]) -> Vec<String> {
    let decisions = &summary.scenes[scene].decisions;
    if let [one] = decisions[..] {
        return vec![format!(
            "{} makes one decision, the {}: all of a sampler's error is its, and there is nothing to tell apart.",
            scene_name(summary, scene),
            one.name()
        )];
    }
    if groups.is_empty() {
        return vec![format!("{}: no decision was exchanged alone.", scene_name(summary, scene))];
    }
    groups.iter().map(|group| sentence(summary, group)).collect()
}

/// `light point, 71 % [68 %, 74 %]`.
fn told(part: &Part) -> String {
    format!("{} {}", part.decision.name(), with_interval(&part.gone, percent))
}

fn told_all(parts: impl IntoIterator<Item = impl std::borrow::Borrow<usize>>, group: &Ablation) -> String {
    listed(&parts.into_iter().map(|i| told(&group.parts[*i.borrow()])).collect::<Vec<_>>())
}

/// The sampler that was exchanged for, by its name where it was compared as well.
fn other_name(summary: &Summary, group: &Ablation) -> String {
    let canonical = group.other.to_string();
    let known = summary.samplers.iter().position(|sampler| sampler.canonical == canonical);
    known.map_or_else(|| format!("`{canonical}`"), |i| name(summary, i))
}

/// What one exchange says of one scene: the decision, its share, its interval.
pub fn sentence(summary: &Summary, group: &Ablation) -> String {
    let (at, base, other) = (scene_name(summary, group.scene), name(summary, group.base), other_name(summary, group));
    let start = match group.question {
        Question::Share => format!("From independent points ({base}) to well-spread ones ({other})"),
        Question::Coupling => format!("From in step ({base}) to an order of its own ({other})"),
        Question::Exchange => format!("From {base} to {other}"),
    };
    let mut cells: Vec<&Cell> = vec![group.base_cell];
    cells.extend(group.parts.iter().map(|part| part.cell));
    let source = group.source();
    let verdict = verdict(&source, group, &at);
    let mut rest = Vec::new();
    if let Some((cell, gone)) = &group.all {
        rest.push(format!("all decisions at once take {} away", with_interval(gone, percent)));
        cells.push(cell);
    }
    if let (Question::Share, Some(left)) = (group.question, group.left()) {
        rest.push(format!(
            "left when all shares are taken off: {} (interactions, and what {} points missed)",
            with_interval(&left, percent),
            group.spp
        ));
    }
    if group.question == Question::Coupling && group.parts.len() == 2 && group.absent.is_empty() {
        rest.push("two decisions are one pair, parted from either side".to_owned());
    }
    if !group.absent.is_empty() {
        let absent: Vec<&str> = group.absent.iter().map(|decision| decision.name()).collect();
        rest.push(format!("not exchanged alone: {}", listed(&absent)));
    }
    let rest = if rest.is_empty() { String::new() } else { format!(" {}.", capital(&rest.join("; "))) };
    format!("{start}, {} spp: {verdict}.{rest} {}", group.spp, rows(&cells))
}

/// Where the error comes from, in words.
fn verdict(source: &Source, group: &Ablation, at: &str) -> String {
    let what = match group.question {
        Question::Share => "the error comes from",
        Question::Coupling => "the coupling's error comes from",
        Question::Exchange => "what can be gained lies in",
    };
    match source {
        Source::One(i) => one(*i, group, at, what),
        Source::Among(several) => {
            let names: Vec<&str> = several.iter().map(|&i| group.parts[i].decision.name()).collect();
            let others: Vec<usize> = (0..group.parts.len()).filter(|i| !several.contains(i)).collect();
            format!(
                "in {at} {what} the {}, **cannot tell which**: of the MSE goes, each alone, {}{}",
                names.join(" or the "),
                told_all(several, group),
                clause("less", &others, group)
            )
        }
        Source::Nothing(_) => {
            let all = told_all(0..group.parts.len(), group);
            match group.parts.iter().all(|part| below(&part.gone, 0.0) == Answer::Yes) {
                true => {
                    format!("in {at} **the error grows whichever decision is exchanged alone**: of the MSE goes {all}")
                }
                false => format!(
                    "in {at} **no decision alone** is seen, at the joint level, to lower the error: of the MSE goes {all}"
                ),
            }
        }
    }
}

/// The decision that takes the most away, what is near it, and the rest.
fn one(i: usize, group: &Ablation, at: &str, what: &str) -> String {
    let largest = &group.parts[i];
    let (near, less): (Vec<usize>, Vec<usize>) = (0..group.parts.len())
        .filter(|&other| other != i)
        .partition(|&other| is_almost_as_much(&group.parts[other].gone, &largest.gone));
    let also: Vec<&str> = near.iter().map(|&j| group.parts[j].decision.name()).collect();
    let also = if also.is_empty() { String::new() } else { format!(" and, almost as much, the {}", listed(&also)) };
    let alone = match group.question {
        Question::Share => "well-spread points for it alone take",
        Question::Coupling => "an order of its own for it alone takes",
        Question::Exchange => "the exchange of it alone takes",
    };
    let more = if group.parts.len() > 1 { ", more than any other" } else { "" };
    format!(
        "**in {at} {what} the {}{also}**: {alone} {} of the MSE away{more}{}{}",
        largest.decision.name(),
        with_interval(&largest.gone, percent),
        clause("almost as much", &near, group),
        clause("less", &less, group)
    )
}

/// At least four fifths, by the whole of both intervals.
fn is_almost_as_much(gone: &Estimate, largest: &Estimate) -> bool {
    gone.ci95.zip(largest.ci95).is_some_and(|([low, _], [_, high])| low >= 0.8 * high)
}

/// `; less: lens 13 % [9.0 %, 18 %]`, nothing of none.
fn clause(words: &str, parts: &[usize], group: &Ablation) -> String {
    if parts.is_empty() { String::new() } else { format!("; {words}: {}", told_all(parts, group)) }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| format!("{}{}", first.to_uppercase(), letters.as_str()))
}

/// All shares side by side.
fn shares_table(summary: &Summary, found: &[(usize, Vec<Ablation>)], page: &mut Page) {
    let text = |gone: Option<&Estimate>| gone.map_or("–".to_owned(), |gone| with_interval(gone, percent));
    let lines: Vec<Vec<String>> = found
        .iter()
        .flat_map(|(_, groups)| groups)
        .map(|group| {
            let made = &summary.scenes[group.scene].decisions;
            let cells = Decision::ALL.map(|decision| match made.contains(&decision) {
                false => "not decided".to_owned(),
                true => text(group.parts.iter().find(|part| part.decision == decision).map(|part| &part.gone)),
            });
            let left = if group.question == Question::Share { group.left() } else { None };
            let mut line = vec![
                scene_name(summary, group.scene),
                format!("{} → {}", name(summary, group.base), other_name(summary, group)),
                group.spp.to_string(),
            ];
            line.extend(cells);
            line.extend([text(group.all.as_ref().map(|(_, gone)| gone)), text(left.as_ref())]);
            line
        })
        .collect();
    let mut head = vec!["scene", "one decision from → to", "spp"];
    head.extend(Decision::ALL.map(Decision::name));
    head.extend(["all at once", "left"]);
    let caption = format!(
        "Share of the MSE that goes, 1 − MSE/MSE before (no unit), where one decision alone reads another sampler, and where all do at once; {}. *Left*: what remains \
         of 100 % when the single shares are taken off.",
        level(summary)
    );
    tabulate(page, "which-decision", &caption, &head, &lines);
}

/// The counts of samples that were compared, in words.
fn counts(found: &[(usize, Vec<Ablation>)]) -> String {
    let counts: std::collections::BTreeSet<u32> =
        found.iter().flat_map(|(_, groups)| groups).map(|group| group.spp).collect();
    listed(&counts.iter().map(u32::to_string).collect::<Vec<_>>())
}

/// One line for the answer box: what independent points say of each scene, else what there is.
pub fn answer(summary: &Summary, link: &str) -> Option<String> {
    let of_scene = |scene: usize| {
        let groups = ablations(summary, scene);
        let group = groups.iter().find(|group| group.question == Question::Share).or(groups.first())?;
        let (at, source) = (scene_name(summary, scene), group.source());
        let cells: Vec<&Cell> = group.parts.iter().map(|part| part.cell).collect();
        let what = match &source {
            Source::One(i) => told(&group.parts[*i]),
            Source::Among(several) => format!("cannot tell {}", told_all(several, group)),
            Source::Nothing(_) => "no decision alone is seen to matter".to_owned(),
        };
        Some(format!("{at} {what} {}", rows(&cells)))
    };
    let told: Vec<String> = (0..summary.scenes.len()).filter_map(of_scene).collect();
    (!told.is_empty()).then(|| {
        format!("**Which decision does the error come from?** By the share of the MSE that one decision alone takes away: {}; see {link}.", told.join("; "))
    })
}

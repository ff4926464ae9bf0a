//! Which decision matters: one sentence a scene and exchange, a table, a figure.

use crate::sampling::Decision;
use crate::stats::Estimate;

use super::super::ablation::{Ablation, Part, Question, Source, ablations};
use super::super::evidence::Answer;
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
         1 − MSE/MSE before, at the largest common count. Replicates are independent of each other. Verdicts are at a joint level of 95 % (intervals widened for the number of decisions, Bonferroni). \
         A decision has the *largest single share* where it takes more away than every other one; decisions that this does not part from the largest share are named together. \
         The error *comes from* a decision whose exchange alone takes more than half of it away. \"Almost as much\" is at least four fifths of the largest share, by the whole of both intervals.",
    );
    if asks(Question::Share) {
        page.paragraph(
            "*From independent points*: every decision draws uniform numbers, then one alone gets well-spread points. What goes is the decision's main effect, the first-order part of \
             an analysis of variance of the pixel, as far as so many points find it: a lower bound. *Interactions*, what hangs on decisions together, stay whole under points in orders of their own. \
             So they carry no more than what all decisions at once leave, nor more than what is left when all single shares are taken off; the second is given where it is clearly the less.",
        );
    }
    if asks(Question::Coupling) {
        page.paragraph(
            "*From in step*: every decision walks through the same set in the same order, then one alone gets an order of its own, over the same points. What goes is what its coupling with the others costs. A coupling \
             takes two: where one pair alone matters, parting either of the two cures it. So where several decisions take more than half away each, their shares overlap, and the coupling is called theirs together.",
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
        rest.push(all_at_once(gone));
        cells.push(cell);
    }
    if let Some(most) = group.interactions() {
        rest.push(format!("interactions of decisions carry at most {}", with_interval(&most, percent)));
    }
    let is_pair = group.parts.len() == 2 && group.absent.is_empty();
    if group.question == Question::Coupling && is_pair && group.coupled().is_empty() {
        rest.push("two decisions are one pair, parted from either side".to_owned());
    }
    if !group.absent.is_empty() {
        let absent: Vec<&str> = group.absent.iter().map(|decision| decision.name()).collect();
        rest.push(format!("not exchanged alone: {}", listed(&absent)));
    }
    let rest = if rest.is_empty() { String::new() } else { format!(" {}.", capital(&rest.join("; "))) };
    format!("{start}, {} spp: {verdict}.{rest} {}", group.spp, rows(&cells))
}

/// `all decisions at once take 40 % [38 %, 42 %] away`, or that they add to the error.
fn all_at_once(gone: &Estimate) -> String {
    match gone.value < 0.0 {
        true => {
            let added = Estimate { value: -gone.value, ci95: gone.ci95.map(|[low, high]| [-high, -low]) };
            format!("all decisions at once add {}", with_interval(&added, percent))
        }
        false => format!("all decisions at once take {} away", with_interval(gone, percent)),
    }
}

/// Where the error comes from, in words.
fn verdict(source: &Source, group: &Ablation, at: &str) -> String {
    let coupled = group.coupled();
    if !coupled.is_empty() {
        return together(&coupled, group, at);
    }
    match source {
        Source::One(i) => one(*i, group, at),
        Source::Among(several) => {
            let names: Vec<&str> = several.iter().map(|&i| group.parts[i].decision.name()).collect();
            let others: Vec<usize> = (0..group.parts.len()).filter(|i| !several.contains(i)).collect();
            format!(
                "in {at} the largest single share is that of the {}, **cannot tell which**: of the MSE goes, each alone, {}{}",
                names.join(" or the "),
                told_all(several, group),
                clause("less", &others, group)
            )
        }
        Source::Nothing(_) => {
            let all = told_all(0..group.parts.len(), group);
            match group.grows_by_each() {
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

/// `the pair pixel and lens`, `pixel, lens and light point together`.
fn coupled_words(coupled: &[usize], group: &Ablation) -> String {
    let names: Vec<&str> = coupled.iter().map(|&i| group.parts[i].decision.name()).collect();
    match names.len() {
        2 => format!("the pair {}", listed(&names)),
        _ => format!("{} together", listed(&names)),
    }
}

/// Decisions whose coupling with each other the error comes from.
fn together(coupled: &[usize], group: &Ablation, at: &str) -> String {
    let others: Vec<usize> = (0..group.parts.len()).filter(|i| !coupled.contains(i)).collect();
    format!(
        "**in {at} the coupling's error comes from {}**: an order of its own for one of them alone takes of the MSE away, {} (the shares overlap){}",
        coupled_words(coupled, group),
        told_all(coupled, group),
        clause("less", &others, group)
    )
}

/// What a decision is called that takes more away than any other, by whether it takes more than half.
fn largest_words(question: Question, is_over_half: Answer) -> (&'static str, &'static str) {
    match (question, is_over_half) {
        (Question::Share, Answer::Yes) => ("the error comes from the", ""),
        (Question::Coupling, Answer::Yes) => ("the coupling's error comes from the", " with the others"),
        (Question::Exchange, Answer::Yes) => ("what can be gained lies in the", ""),
        (_, Answer::No) => ("the largest single share is that of the", ", not over half"),
        (_, Answer::CannotTell) => ("the largest single share is that of the", ", cannot tell whether over half"),
    }
}

/// The decision that takes the most away, what is near it, and the rest.
fn one(i: usize, group: &Ablation, at: &str) -> String {
    let largest = &group.parts[i];
    let (near, less): (Vec<usize>, Vec<usize>) = (0..group.parts.len())
        .filter(|&other| other != i)
        .partition(|&other| is_almost_as_much(&group.parts[other].gone, &largest.gone));
    let (what, qualified) = largest_words(group.question, group.is_over_half(i));
    let alone = match group.question {
        Question::Share => "well-spread points for it alone take",
        Question::Coupling => "an order of its own for it alone takes",
        Question::Exchange => "the exchange of it alone takes",
    };
    let more = if group.parts.len() > 1 { ", more than any other" } else { "" };
    format!(
        "**in {at} {what} {}{qualified}**: {alone} {} of the MSE away{more}{}{}",
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
            let most = group.interactions();
            let mut line = vec![
                scene_name(summary, group.scene),
                format!("{} → {}", name(summary, group.base), other_name(summary, group)),
                group.spp.to_string(),
            ];
            line.extend(cells);
            line.extend([text(group.all.as_ref().map(|(_, gone)| gone)), text(most.as_ref())]);
            line
        })
        .collect();
    let mut head = vec!["scene", "one decision from → to", "spp"];
    head.extend(Decision::ALL.map(Decision::name));
    head.extend(["all at once", "interactions, at most"]);
    let caption = format!(
        "Share of the MSE that goes, 1 − MSE/MSE before (no unit), where one decision alone reads another sampler, and where all do at once; {}. *Interactions, at most*: what all at once leave, or \
         what remains of 100 % when the single shares are taken off where that is clearly less.",
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
        let what = match (&source, group.coupled()) {
            (_, coupled) if !coupled.is_empty() => {
                format!("{} ({})", coupled_words(&coupled, group), told_all(&coupled, group))
            }
            (Source::One(i), _) => match group.is_over_half(*i) {
                Answer::Yes => told(&group.parts[*i]),
                _ => format!("largest single share {}", told(&group.parts[*i])),
            },
            (Source::Among(several), _) => format!("cannot tell {}", told_all(several, group)),
            (Source::Nothing(_), _) => "no decision alone is seen to matter".to_owned(),
        };
        Some(format!("{at} {what} {}", rows(&cells)))
    };
    let told: Vec<String> = (0..summary.scenes.len()).filter_map(of_scene).collect();
    (!told.is_empty()).then(|| {
        format!("**Which decision does the error come from?** By the share of the MSE that one decision alone takes away: {}; see {link}.", told.join("; "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_grows_is_added_and_what_shrinks_is_taken_away() {
        let e = |value: f64| Estimate { value, ci95: Some([value - 0.02, value + 0.02]) };
        assert_eq!(all_at_once(&e(0.4)), "all decisions at once take 40 % [38 %, 42 %] away");
        assert_eq!(all_at_once(&e(-0.3)), "all decisions at once add 30 % [28 %, 32 %]");
    }

    #[test]
    fn a_largest_share_is_called_the_source_only_where_it_is_over_half() {
        assert_eq!(largest_words(Question::Share, Answer::Yes).0, "the error comes from the");
        assert_eq!(largest_words(Question::Share, Answer::No).1, ", not over half");
        assert_eq!(largest_words(Question::Coupling, Answer::CannotTell).1, ", cannot tell whether over half");
    }
}

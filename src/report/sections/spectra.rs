//! Power spectra of the point sets.

use super::super::evidence::{Answer, below};
use super::super::markdown::{Page, link_to, table_ref};
use super::super::numbers::{counted, estimate, listed, p_value, short};
use super::super::spectra::{LOW, POINTS, REACH, SETS, SetPower};
use super::super::summarise::Summary;
use super::super::write::Figures;
use super::words::name;
use super::{show, tabulate, titles};

/// The section.
pub fn section(summary: &Summary, all: &[SetPower], figures: &Figures, page: &mut Page) {
    if all.is_empty() {
        return;
    }
    page.heading(2, titles::SPECTRA);
    page.paragraph(&format!(
        "The power P(ν) of a point set at a frequency ν (waves along x and along y) says how much of an image's detail of that fineness turns into error: the variance of a pixel is (1/n) Σ P(ν) |f_ν|², f_ν what the pixel sees at ν \
         (exact for sets shifted as a whole, elsewhere a guess: {}). Independent points have P = 1 everywhere. Below 1 a set errs less than they do, above 1 more; what pixels see is strongest at low frequencies, in the middle of the maps.",
        match summary.predictions.is_empty() {
            true => "Pilleboue et al. 2015, doi:10.1145/2766930".to_owned(),
            false => format!("how good a one {} measures", link_to(titles::PREDICTION)),
        }
    ));
    let caption = format!(
        "Power of {POINTS} points of one decision in one pixel at frequencies up to {REACH} waves along either axis, mean of {SETS} randomisations (1 where nothing is random); ν = 0 in the middle, where white stands for nothing shown. Blue: \
         less power than independent points, red: more, on a scale of logarithms that ends at an eighth and eight times. A dark middle is what good sets have; stripes and dots are directions in which a set is a lattice.",
    );
    show(page, figures, "power-spectra", false, &caption);
    let caption = format!(
        "The same by the length of ν, mean over directions, with 95 % bands as if powers were exponentially distributed (exact for independent points, a guide for others); {POINTS} points, {SETS} randomisations; dotted: independent points."
    );
    show(page, figures, "radial-power", true, &caption);
    let lines: Vec<Vec<String>> = all
        .iter()
        .map(|found| {
            let peak = found.mean.peak();
            vec![
                name(summary, found.sampler),
                found.mean.sets().to_string(),
                estimate(&found.low),
                peak.map_or("–".to_owned(), |peak| short(peak.power)),
                peak.map_or("–".to_owned(), |peak| format!("({}, {})", peak.frequency[0], peak.frequency[1])),
                p_value(peak.map(|peak| peak.p_value)),
            ]
        })
        .collect();
    let caption = format!(
        "Power of {POINTS} points: mean at frequencies of length up to {LOW} (1 for independent points) with its 95 % interval over sets, and the largest of all frequencies up to {REACH} along an axis, where it stands, and the chance that independent points \
         have so large a one anywhere (Šidák; their mean power over sets is Gamma distributed)."
    );
    let head = ["sampler", "sets", "power at low frequencies", "largest power", "at ν", "p of the largest"];
    tabulate(page, "set-power", &caption, &head, &lines);
    page.sentences(&[words(summary, all)]);
}

/// Who has less power than independent points where it matters, and who has peaks.
fn words(summary: &Summary, all: &[SetPower]) -> String {
    let names = |keep: &dyn Fn(&SetPower) -> bool| -> Vec<String> {
        all.iter().filter(|found| keep(found)).map(|found| name(summary, found.sampler)).collect()
    };
    let less = names(&|found| below(&found.low, 1.0) == Answer::Yes);
    let peaked = names(&|found| found.mean.peak().is_some_and(|peak| peak.p_value < 0.001));
    let mut text = match less.len() {
        0 => "No sampler has less power than independent points at low frequencies".to_owned(),
        n => format!("At low frequencies {} of {} less power than independent points", n, has_have(all.len())),
    };
    text += &match peaked.as_slice() {
        [] => "; none has a peak that independent points would not have".to_owned(),
        peaked => format!(
            "; more power at some frequency than chance gives independent points (p < 0.001) {} {}: an image with detail just there would err more under {}",
            if peaked.len() == 1 { "has" } else { "have" },
            listed(peaked),
            if peaked.len() == 1 { "it" } else { "them" }
        ),
    };
    format!("{text} ({}).", table_ref("set-power"))
}

fn has_have(samplers: usize) -> String {
    format!("{} {}", counted(samplers, "sampler", "samplers"), if samplers == 1 { "has" } else { "have" })
}

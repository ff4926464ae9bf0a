//! Where methods fail: a gallery of known failures, each measured beside the sound way.

use super::super::evidence::Answer;
use super::super::gallery::{Evidence, Failure};
use super::super::markdown::{Page, figure_ref};
use super::super::numbers::{counted, estimate, listed, p_words, short};
use super::super::write::Figures;
use super::words::times;
use super::{show, tabulate, titles};

/// The gallery: pictures, one line a failure, and how many of them the numbers show.
pub fn section(all: &[Failure], figures: &Figures, page: &mut Page) {
    page.heading(3, titles::GALLERY);
    page.paragraph(&format!(
        "Ways to spoil a sampler, each measured beside the sound way, from the samplers themselves and for this report; {}. A failure is shown where the truth is excluded (p < 0.001) of the failing way and not of the sound one, where \
         the ratio of the two lies above 1 with its whole 95 % interval, or where the two intervals lie apart.",
        shown_words(all)
    ));
    let caption = "Four failures as points, cyan (first) to red (last), origin at the bottom left; above the failing way, below the sound one. Left to right: x of the pixel against x of the lens, in step and shuffled \
                   (`stratified`, n = 256); dimensions 7 and 8 of Halton's sequence, n = 64, plain and with permuted digits; the first 128 of 256 points of Hammersley's set, and the set of 128; 7 samples in 9 cells and in 8 equal ones, \
                   64 jittered sets over each other.";
    show(page, figures, "failures", false, caption);
    let lines: Vec<Vec<String>> = all.iter().map(line).collect();
    let caption = format!(
        "Failures of methods, {} of them as pictures in {}: the number of the failing way and of the sound one, 95 % intervals in brackets, what tells them apart, why, and what to do.",
        "four",
        figure_ref("failures")
    );
    let head = ["failure", "measured", "failing", "sound", "shown", "cause", "remedy"];
    tabulate(page, "gallery", &caption, &head, &lines);
}

/// `12 of 12 are shown`, and which are not.
fn shown_words(all: &[Failure]) -> String {
    let shown = all.iter().filter(|failure| failure.is_shown() == Answer::Yes).count();
    let rest: Vec<String> = all
        .iter()
        .filter(|failure| failure.is_shown() != Answer::Yes)
        .map(|failure| failure.title.to_owned())
        .collect();
    let rest = if rest.is_empty() { String::new() } else { format!(", not: {}", listed(&rest)) };
    format!("{shown} of {} are shown by these numbers{rest}", counted(all.len(), "failure", "failures"))
}

fn line(failure: &Failure) -> Vec<String> {
    let side = |side: &super::super::gallery::Side| {
        let way = if side.way.contains(':') { format!("`{}`", side.way) } else { side.way.to_owned() };
        format!("{way}: {}", estimate(&side.number))
    };
    let evidence = match failure.evidence {
        Evidence::Truth { value, failing, sound } => {
            format!("is it {}? failing {}, sound {}", short(value), p_words(Some(failing)), p_words(Some(sound)))
        }
        Evidence::Ratio(ratio) => format!("failing / sound = {}", times(&ratio)),
        Evidence::Apart { larger_is_worse: true } => "failing above sound, intervals apart".to_owned(),
        Evidence::Apart { larger_is_worse: false } => "failing below sound, intervals apart".to_owned(),
    };
    vec![
        failure.title.to_owned(),
        failure.quantity.clone(),
        side(&failure.failing),
        side(&failure.sound),
        format!("{}: {evidence}", failure.is_shown().word()),
        failure.cause.to_owned(),
        failure.remedy.to_owned(),
    ]
}

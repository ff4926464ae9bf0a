//! The variance of single pixels: what the spectra of set and pixel predict, and what was measured.

use crate::experiment::results::PredictionRow;
use crate::stats::Estimate;

use super::super::markdown::{Page, link_to, table_ref};
use super::super::numbers::{counted, estimate, listed, percent, short};
use super::super::summarise::Summary;
use super::super::write::Figures;
use super::words::{row, times};
use super::{show, tabulate, tabulate_folded, titles};

/// Measured and predicted variances within this factor of each other count as equal.
const EQUAL: f64 = 1.25;

/// What an interval of a ratio says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    /// All of it is within [`EQUAL`]: two one-sided tests at 2.5 % each.
    Equal,
    /// All of it is beyond what the truncation may explain, and not all within [`EQUAL`].
    Different,
    CannotTell,
}

fn verdict(ratio: &Estimate, rest: f64) -> Verdict {
    match ratio.ci95 {
        Some([low, high]) if low >= 1.0 / EQUAL && high <= EQUAL => Verdict::Equal,
        Some([low, high]) if low > 1.0 + rest || high < 1.0 - rest => Verdict::Different,
        _ => Verdict::CannotTell,
    }
}

fn words(verdict: Verdict) -> String {
    match verdict {
        Verdict::Equal => format!("equal within a factor of {EQUAL}"),
        Verdict::Different => "different".to_owned(),
        Verdict::CannotTell => "cannot tell".to_owned(),
    }
}

/// Predicted beside measured variances.
pub fn section(summary: &Summary, figures: &Figures, page: &mut Page) {
    let Some(asked_for) = &summary.about.experiment.prediction else { return };
    page.heading(2, titles::PREDICTION);
    let found = &summary.predictions;
    if found.is_empty() {
        return page.paragraph("Nothing was predicted yet.");
    }
    page.paragraph(&format!(
        "In `{}` a sample decides nothing but where in the pixel it lies, so a pixel's value is the mean of one function over one point set. If the set is shifted as a whole, its variance is known from two spectra: \
         Var = (1/n) Σ P(ν) |f_ν|² over all frequencies ν but 0, P the power of the point set, f_ν the Fourier coefficients of what the pixel sees; independent uniform points have P = 1. A set is good where \
         P is small at the frequencies that pixels are made of. For a randomisation that keeps the points in their places (strata, a scramble of digits) the formula with the mean of P over sets is no theorem, and {} shows how far off it is.",
        asked_for.scene,
        table_ref("predicted")
    ));
    let lines: Vec<Vec<String>> = found.iter().map(line).collect();
    let caption = format!(
        "Variance of {} of `{}` between {} randomisations, measured by predicted (each summed over the pixels; 95 % jackknife interval in brackets), and the share of the prediction that stands for frequencies beyond the \
         128th along an axis, where P is taken for 1. Equal: the whole interval within a factor of {EQUAL} (two one-sided tests at 2.5 %); different: all of it beyond what that share may explain.",
        counted(asked_for.pixels.len(), "pixel", "pixels"),
        asked_for.scene,
        asked_for.seeds
    );
    let head = ["sampler", "spp", "formula", "measured / predicted", "beyond the sum", "verdict", "row"];
    tabulate(page, "predicted", &caption, &head, &lines);
    let caption = format!(
        "Measured over predicted variance of single pixels (column, row) of `{}`, over {} randomisations, with the 95 % χ² interval of the measured one; 1: as predicted.",
        asked_for.scene, asked_for.seeds
    );
    show(page, figures, "predicted-variance", true, &caption);
    page.sentences(&[stationary(found), others(found)]);
    pixel_table(found, page);
}

fn line(found: &PredictionRow) -> Vec<String> {
    vec![
        format!("`{}`", found.sampler),
        found.spp.taken.to_string(),
        if found.is_stationary { "exact" } else { "approximation" }.to_owned(),
        times(&found.ratio),
        percent(found.rest),
        words(verdict(&found.ratio, found.rest)),
        row(&found.id),
    ]
}

/// Where the formula is a theorem.
fn stationary(found: &[PredictionRow]) -> String {
    let all: Vec<&PredictionRow> = found.iter().filter(|found| found.is_stationary).collect();
    if all.is_empty() {
        return String::new();
    }
    let count = |v: Verdict| all.iter().filter(|found| verdict(&found.ratio, found.rest) == v).count();
    let (equal, different) = (count(Verdict::Equal), count(Verdict::Different));
    let of = counted(all.len(), "case", "cases");
    let mut text = format!(
        "**Predicted and measured**: where the formula is exact, both are equal within a factor of {EQUAL} in {equal} of {of}"
    );
    if different > 0 {
        text += &format!(", and different in {different}: that is a defect of the lab, or of the sampler");
    }
    text + "."
}

/// Where it is not.
fn others(found: &[PredictionRow]) -> String {
    let different: Vec<String> = found
        .iter()
        .filter(|found| !found.is_stationary && verdict(&found.ratio, found.rest) == Verdict::Different)
        .map(|found| format!("`{}` at {} spp ({})", found.sampler, found.spp.taken, times(&found.ratio)))
        .collect();
    let all = found.iter().filter(|found| !found.is_stationary).count();
    match (all, different.is_empty()) {
        (0, _) => String::new(),
        (_, true) => {
            format!("In none of {} where it is an approximation is a difference seen.", counted(all, "case", "cases"))
        }
        _ => format!(
            "Where it is an approximation it misses {}: how two frequencies of such a set go together matters too (the ratios are measured by predicted; what counts as a difference is in {}).",
            listed(&different),
            link_to(titles::PREDICTION)
        ),
    }
}

fn pixel_table(found: &[PredictionRow], page: &mut Page) {
    let lines: Vec<Vec<String>> = found
        .iter()
        .flat_map(|found| {
            found.pixels.iter().map(move |pixel| {
                vec![
                    format!("`{}`", found.sampler),
                    found.spp.taken.to_string(),
                    format!("({}, {})", pixel.pixel[0], pixel.pixel[1]),
                    short(pixel.one_sample),
                    short(pixel.predicted),
                    estimate(&pixel.measured),
                    row(&found.id),
                ]
            })
        })
        .collect();
    let caption = "Variance of single pixels (column, row), mean of the channels, in (W/(m² sr))²: of one uniform sample, predicted for the mean of all samples, and measured with its 95 % χ² interval, which holds for normal values.";
    let head = ["sampler", "spp", "pixel", "one sample", "predicted", "measured", "row"];
    tabulate_folded(page, "predicted-pixels", "Predicted and measured, pixel by pixel", caption, &head, &lines);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_is_that_of_the_whole_interval() {
        let of = |low: f64, high: f64| verdict(&Estimate { value: 1.0, ci95: Some([low, high]) }, 0.05);
        assert_eq!([of(0.9, 1.1), of(0.81, 1.24), of(1.06, 1.2)], [Verdict::Equal; 3]);
        assert_eq!([of(1.06, 1.3), of(0.5, 0.94), of(2.0, 3.0)], [Verdict::Different; 3]);
        assert_eq!([of(0.7, 1.1), of(1.04, 1.3), of(0.1, 9.0)], [Verdict::CannotTell; 3]);
        assert_eq!(verdict(&Estimate::without_interval(1.0), 0.0), Verdict::CannotTell);
    }
}

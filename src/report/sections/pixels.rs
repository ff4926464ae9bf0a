//! Do pixels err independently? The power of the error image by frequency, against what white noise would have.

use crate::experiment::results::ErrorSpectrum;
use crate::stats::Estimate;
use crate::stats::error_spectrum::{BAND, LOW_FREQUENCY};
use crate::stats::hypothesis::holm;

use super::super::markdown::{Page, figure_ref, table_ref};
use super::super::numbers::{counted, listed, percent, short};
use super::super::summarise::{Cell, Summary};
use super::super::write::Figures;
use super::neighbours::pattern_spp;
use super::words::{level, marked_row, name, ratio_cell, scene_name, times};
use super::{show, tabulate_folded};

/// Level of the family of tests of one report: among samplers whose pixels err independently all are called so in 99 reports of 100.
const LEVEL: f64 = 0.01;

/// One sampler in one scene.
struct Tested<'a> {
    cell: &'a Cell,
    spectrum: &'a ErrorSpectrum,
    /// Share of the power at low frequencies in units of white noise's; `None` where there is no error above the reference's noise.
    ratio: Option<Estimate>,
    /// p-value adjusted by Holm for all tests here; `None` where there is no spread to test against.
    p: Option<f64>,
}

/// Every sampler and scene at one count.
fn tested(summary: &Summary, spp: u32) -> Vec<Tested<'_>> {
    let cells = summary.cells.iter().filter(|cell| cell.spp.asked == spp);
    let mut all: Vec<Tested> = cells
        .filter_map(|cell| {
            let spectrum = cell.error_spectrum.as_ref()?;
            let white = spectrum.white_low_share;
            let ratio = spectrum.low_share.filter(|_| white > 0.0).map(|share| Estimate {
                value: share.value / white,
                ci95: share.ci95.map(|ends| ends.map(|end| end / white)),
            });
            Some(Tested { cell, spectrum, ratio, p: None })
        })
        .collect();
    let raw: Vec<f64> = all.iter().filter_map(|t| t.spectrum.p_white).collect();
    let adjusted = holm(&raw).unwrap_or_default();
    let with_p = all.iter_mut().filter(|t| t.spectrum.p_white.is_some());
    with_p.zip(adjusted).for_each(|(tested, p)| tested.p = Some(p));
    all
}

/// Whether [`spectra`] has something to show.
pub fn are_there(summary: &Summary) -> bool {
    pattern_spp(summary).is_some_and(|spp| !tested(summary, spp).is_empty())
}

/// Spectra of the error images: a figure, a test of each, a table.
pub fn spectra(summary: &Summary, figures: &Figures, page: &mut Page) {
    let Some(spp) = pattern_spp(summary) else { return };
    let all = tested(summary, spp);
    if all.is_empty() {
        return;
    }
    page.paragraph(&format!(
        "Neighbours are not all. The power of the error image by spatial frequency ({}) is flat for pixels that err independently, whatever the size of their errors; \
         low frequencies carry what is seen as blotches, high ones what the eye averages away. Below {LOW_FREQUENCY} cycles per pixel (periods of more than {:.0} pixels) independent \
         errors have exactly the frequencies' share of the power on average.",
        figure_ref("error-spectrum"),
        1.0 / LOW_FREQUENCY
    ));
    let caption = format!(
        "Power of the error images by spatial frequency at {spp} spp, in rings of 1/32 cycles per pixel, divided by the mean square error: 1 everywhere, the dotted line, for pixels \
         that err independently; above it to the left: neighbours err alike; below it to the left and above to the right: blue noise; spikes: aliasing. Mean over the replicates, bands from the {} to the {} \
         quantile between them; frequency 0, the image's mean error, is in the first ring.",
        percent(BAND),
        percent(1.0 - BAND)
    );
    show(page, figures, "error-spectrum", true, &caption);
    page.sentences(&[verdict(summary, &all), fixed(summary, &all)]);
    table(summary, spp, &all, page);
}

/// Who is not white.
fn verdict(summary: &Summary, all: &[Tested]) -> String {
    let tests = all.iter().filter(|t| t.p.is_some()).count();
    if tests == 0 {
        return String::new();
    }
    let is_found = |t: &&Tested| t.p.is_some_and(|p| p < LEVEL);
    let words = |t: &Tested| {
        let ratio = t.ratio.map(|ratio| times(&ratio)).unwrap_or_default();
        format!("{} in {} ({ratio} times)", name(summary, t.cell.sampler), scene_name(summary, t.cell.scene))
    };
    let side = |low: bool| -> Vec<String> {
        let is_side = |t: &&Tested| t.ratio.is_some_and(|ratio| (ratio.value > 1.0) == low);
        all.iter().filter(is_found).filter(is_side).map(words).collect()
    };
    let (blotched, blue) = (side(true), side(false));
    let mut text = format!(
        "**Do pixels err independently?** {} of the share of power at low frequencies against its exact mean for independent pixels (Student's t over replicates, Holm at {} for all together; {}): ",
        counted(tests, "test", "tests"),
        percent(LEVEL),
        table_ref("error-spectra")
    );
    if blotched.is_empty() && blue.is_empty() {
        return text + "none finds a difference.";
    }
    let mut parts = Vec::new();
    if !blotched.is_empty() {
        parts.push(format!("more than that, so errors go together over many pixels, have {}", listed(&blotched)));
    }
    if !blue.is_empty() {
        parts.push(format!("less, so errors of neighbours cancel, have {}", listed(&blue)));
    }
    text += &parts.join("; ");
    text + ". No difference is found for the others."
}

/// Who has nothing to test against.
fn fixed(summary: &Summary, all: &[Tested]) -> String {
    let fixed: Vec<String> = all
        .iter()
        .filter(|t| t.cell.is_fixed)
        .filter_map(|t| {
            let ratio = short(t.ratio?.value);
            Some(format!(
                "{ratio} times that share for {} in {}",
                name(summary, t.cell.sampler),
                scene_name(summary, t.cell.scene)
            ))
        })
        .collect();
    match fixed.is_empty() {
        true => String::new(),
        false => format!("Without replicates nothing can be tested; the one image there is has {}.", listed(&fixed)),
    }
}

fn table(summary: &Summary, spp: u32, all: &[Tested], page: &mut Page) {
    let p = |t: &Tested| t.p.map_or("–".to_owned(), |p| if p < 1e-4 { "< 1e−4".to_owned() } else { short(p) });
    let line = |t: &Tested| {
        vec![
            scene_name(summary, t.cell.scene),
            name(summary, t.cell.sampler),
            ratio_cell(t.ratio),
            p(t),
            ratio_cell(t.spectrum.blur_1),
            ratio_cell(t.spectrum.blur_2),
            marked_row(t.cell),
        ]
    };
    let lines: Vec<Vec<String>> = all.iter().map(line).collect();
    let caption = format!(
        "Error images at {spp} spp against white noise (pixels that err independently) of the same mean square error: share of the power below {LOW_FREQUENCY} cycles per pixel, p-value of that \
         (two-sided, adjusted by Holm for all lines), and mean square error left after a Gaussian blur of σ = 1 and 2 pixels, which is what an eye from afar is left with: 1 for white noise, less is better to look at. \
         No units; {}.",
        level(summary)
    );
    let head = ["scene", "sampler", "low-frequency share", "p", "blurred, σ = 1", "blurred, σ = 2", "row"];
    tabulate_folded(page, "error-spectra", "Error spectra of every sampler in every scene", &caption, &head, &lines);
}

//! Pictures: the four stages, strips with enlarged details, error maps.

use super::super::markdown::Page;
use super::super::numbers::{counted, listed, short, signed};
use super::super::pictured::EXPOSURE;
use super::super::summarise::Summary;
use super::super::write::{FigureState, Figures};
use super::show;
use super::words::row;

/// The sheet's Figure 1.
pub fn stages(summary: &Summary, figures: &Figures, page: &mut Page) {
    let Some(pictures) = &summary.about.experiment.pictures else { return };
    page.heading(2, "Figure 1 of the sheet");
    let planned = summary.stages_planned();
    if summary.stages.len() < planned {
        page.paragraph("Not all of the stages were rendered yet.");
        return;
    }
    let (number, lens) = if planned == 4 { ("four", "a sampled lens, ") } else { ("three", "") };
    let rows: Vec<String> = summary.stages.iter().map(|stage| row(&stage.id)).collect();
    let caption = format!(
        "`{}` in {number} stages, each with one decision more than the one before: pixel centres and albedo, a sampled pixel, {lens}a sampled area light. \
         {}, exposure {EXPOSURE}, rows {}.",
        pictures.scene,
        pictures.size,
        listed(&rows)
    );
    show(page, figures, "stages", false, &caption);
}

/// Equal samples side by side.
pub fn strips(summary: &Summary, figures: &Figures, page: &mut Page) {
    let Some(pictures) = &summary.about.experiment.pictures else { return };
    page.heading(2, "Pictures at equal samples");
    if summary.pictures.is_empty() {
        page.paragraph("No pictures were rendered yet.");
        return;
    }
    let count = counted(summary.pictures.len(), "sampler", "samplers");
    let reference = format!(
        "The reference of the pictures, {}, exposure {EXPOSURE}; frames: the details enlarged below.",
        pictures.size
    );
    show(page, figures, "reference", false, &reference);
    if figures.state("details") != FigureState::Absent("its rows are not there".to_owned()) {
        let names = if figures.details.is_empty() {
            String::new()
        } else {
            format!(", left to right {}", figures.details.join("; "))
        };
        let caption = format!(
            "Details at {} spp asked, the reference and {count}{names}. Below each: error of the whole picture.",
            pictures.spp
        );
        show(page, figures, "details", false, &caption);
    }
    let caption = format!(
        "Signed error of {count} at {} spp asked: red where too bright, blue where too dark, one scale for all. Even grain is noise; lines, blotches and outlines are \
         structure.",
        pictures.spp
    );
    show(page, figures, "errors", false, &caption);
    let lines: Vec<Vec<String>> = summary
        .pictures
        .iter()
        .map(|picture| {
            let errors = picture.errors.as_ref();
            let label =
                summary.samplers.iter().find(|s| s.canonical == picture.sampler).map_or(&picture.sampler, |s| &s.label);
            vec![
                format!("`{label}`"),
                picture.spp.taken.to_string(),
                errors.map_or("–".to_owned(), |e| {
                    if e.mse_unbiased > 0.0 { short(e.mse_unbiased.sqrt()) } else { "below noise".to_owned() }
                }),
                errors.and_then(|e| e.error_autocorrelation).map_or("–".to_owned(), signed),
                short(picture.mean),
                row(&picture.id),
            ]
        })
        .collect();
    page.table(&["picture", "spp taken", "RMSE", "ρ of neighbours", "mean radiance", "row"], &lines);
    page.paragraph("One picture of each sampler, so these numbers have no intervals; the tables of replicates do. What equal seconds buy is in the next section. \
         To flip between the whole pictures, open `images/flip/` in an image viewer after a run (in the order of the table; kept out of the repository).");
}

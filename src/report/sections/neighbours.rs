//! Do neighbouring pixels err alike? One pattern in every pixel, and other causes.

use crate::experiment::spec::Pictures;
use crate::sampling::{Order, Random, SamplerSpec, Scope};

use super::super::evidence::{Answer, is_biased};
use super::super::markdown::{Page, link_to};
use super::super::numbers::{listed, p_value, p_words, short, signed, signed_estimate};
use super::super::shots::{PictureSet, Shot};
use super::super::summarise::{Cell, Summary};
use super::super::verdicts::{LEVEL, Measured, Sameness, holm_of};
use super::words::{bias_short, estimate_cell, level, marked_row, name, ratio_cell, rmse_ratio, row, scene_name};
use super::{tabulate, tabulate_folded, titles};

/// The sampler that differs from this one in being new in every pixel, else the same family's `:best`.
fn twin(summary: &Summary, sampler: usize) -> Option<usize> {
    let spec = summary.samplers[sampler].spec()?;
    let each = SamplerSpec { scope: Scope::Each, ..spec }.to_string();
    let same = summary.samplers.iter().position(|s| s.canonical == each).filter(|&i| i != sampler);
    same.or_else(|| summary.preset(spec.points, crate::sampling::Preset::Best)).filter(|&i| i != sampler)
}

/// Does ρ of one scene and sampler differ from 0, and by more than [`LEAST_RHO`]?
pub struct NeighbourTest {
    scene: usize,
    sampler: usize,
    /// Two-sided p-value of ρ = 0, Holm-adjusted over all scenes and samplers; `None` of one replicate of a random sampler.
    pub p: Option<f64>,
    /// Whether ρ is shown to lie within ± [`LEAST_RHO`], or outside.
    pub sameness: Sameness,
}

/// The tests of neighbours at the count of [`pattern_spp`].
pub struct NeighbourTests(Vec<NeighbourTest>);

impl NeighbourTests {
    /// Tests every scene and sampler.
    pub fn of_all(summary: &Summary) -> Self {
        let cells = pattern_spp(summary).into_iter().flat_map(|spp| {
            let pairs = (0..summary.scenes.len()).flat_map(|s| (0..summary.samplers.len()).map(move |p| (s, p)));
            pairs.filter_map(move |(scene, sampler)| summary.cell(scene, sampler, spp))
        });
        let found: Vec<(usize, usize, Option<Measured>)> = cells
            .map(|cell| (cell.scene, cell.sampler, measured_rho(cell, summary.scenes[cell.scene].pixels)))
            .collect();
        let holm =
            |p: &dyn Fn(&Measured) -> f64| holm_of(&found.iter().map(|(.., m)| m.as_ref().map(p)).collect::<Vec<_>>());
        let (zero, inside) = (holm(&|m| m.p_of(0.0)), holm(&|m| m.p_inside(LEAST_RHO)));
        let tests = found.iter().enumerate().map(|(i, &(scene, sampler, _))| {
            let outside = found[i].2.map(|m| m.p_outside(LEAST_RHO));
            let sameness = outside.zip(inside[i]).map_or(Sameness::CannotTell, |(o, i)| Sameness::of(o, i));
            NeighbourTest { scene, sampler, p: zero[i], sameness }
        });
        Self(tests.collect())
    }

    /// That of one scene and sampler.
    pub fn of(&self, scene: usize, sampler: usize) -> Option<&NeighbourTest> {
        self.0.iter().find(|test| (test.scene, test.sampler) == (scene, sampler))
    }
}

/// ρ with its error: over replicates, or of one image of a sampler without randomness that which independent errors would have.
pub fn measured_rho(cell: &Cell, pixels: u64) -> Option<Measured> {
    let rho = cell.error_autocorrelation?;
    if cell.is_fixed {
        let error = 1.0 / (2.0 * pixels as f64).sqrt();
        return (pixels > 0).then_some(Measured { value: rho.value, error, freedom: f64::INFINITY });
    }
    Measured::from_estimate(&rho, cell.replicates)
}

/// One pattern in every pixel, against a new one in each.
pub struct Pattern<'a> {
    /// Index of the sampler that repeats itself.
    pub sampler: usize,
    /// Index of its twin.
    pub twin: usize,
    /// Its cell.
    pub cell: &'a Cell,
    /// The twin's cell.
    pub other: &'a Cell,
    /// Number of pixels of their images.
    pub pixels: u64,
}

/// The interval of a correlation; that of one image of a sampler without randomness is ±1.96/√(2 · pixels), the spread that
/// independent errors in as many pairs of neighbours would have.
fn rho_interval(cell: &Cell, pixels: u64) -> Option<[f64; 2]> {
    let rho = cell.error_autocorrelation?;
    let half = 1.96 / (2.0 * pixels as f64).sqrt();
    rho.ci95.or((cell.is_fixed && pixels > 0).then_some([rho.value - half, rho.value + half]))
}

/// Correlations below this are called no structure, however sure they are.
pub const LEAST_RHO: f64 = 0.03;

/// Errors of neighbours that clearly go together.
pub struct Structure<'a> {
    /// The cell of the count with the largest ρ of those where it is clear.
    pub cell: &'a Cell,
    /// Whether the sampler repeats its points, or an axis of them, in every pixel: else the pattern is not the cause.
    pub repeats: bool,
}

/// Whether a correlation is clearly there: 0 more than twice as far from it as its interval's end, at least [`LEAST_RHO`],
/// and above the interval of uniform sampling's, where that was measured.
pub fn is_clear_structure(rho: f64, interval: Option<[f64; 2]>, uniform: Option<[f64; 2]>) -> bool {
    let is_above = |low: f64| uniform.is_none_or(|[_, high]| low > high);
    rho >= LEAST_RHO && interval.is_some_and(|[low, _]| low > 0.5 * rho && is_above(low))
}

/// Do neighbours err alike under a sampler in a scene, at the count of [`pattern_spp`], the middle or the largest one?
pub fn structure(summary: &Summary, scene: usize, sampler: usize) -> Option<Structure<'_>> {
    let pixels = summary.scenes[scene].pixels;
    let counts = [pattern_spp(summary), summary.middle_spp(), summary.most_spp()];
    let uniform = |spp: u32| {
        let base = summary.uniform().filter(|&uniform| uniform != sampler)?;
        rho_interval(summary.cell(scene, base, spp)?, pixels)
    };
    let rho = |cell: &Cell| cell.error_autocorrelation.map_or(0.0, |rho| rho.value);
    let clear = |cell: &&Cell| is_clear_structure(rho(cell), rho_interval(cell, pixels), uniform(cell.spp.asked));
    let cells = counts.into_iter().flatten().filter_map(|spp| summary.cell(scene, sampler, spp));
    let cell = cells.filter(clear).max_by(|a, b| rho(a).total_cmp(&rho(b)))?;
    Some(Structure { cell, repeats: summary.samplers[sampler].repeats_in_every_pixel() })
}

impl Pattern<'_> {
    /// Do neighbouring pixels err more alike than under the twin? By intervals that do not meet, see [`rho_interval`].
    pub fn errs_alike(&self) -> Answer {
        match (rho_interval(self.cell, self.pixels), rho_interval(self.other, self.pixels)) {
            (Some([low, _]), Some([_, high])) if low > high => Answer::Yes,
            (Some([_, high]), Some([low, _])) if high < low => Answer::No,
            _ => Answer::CannotTell,
        }
    }
}

/// The count that patterns are judged at: the pictures', else the middle one.
pub fn pattern_spp(summary: &Summary) -> Option<u32> {
    let e = &summary.about.experiment;
    let pictured = e.pictures.first().map(Pictures::equal_spp).filter(|spp| e.spp.contains(spp));
    pictured.or(summary.middle_spp())
}

/// All pairs of a sampler that repeats its pattern and its twin in one scene.
pub fn patterns(summary: &Summary, scene: usize) -> Vec<Pattern<'_>> {
    let Some(spp) = pattern_spp(summary) else { return Vec::new() };
    (0..summary.samplers.len())
        .filter(|&sampler| summary.samplers[sampler].repeats_in_every_pixel())
        .filter_map(|sampler| {
            let twin = twin(summary, sampler)?;
            Some(Pattern {
                sampler,
                twin,
                cell: summary.cell(scene, sampler, spp)?,
                other: summary.cell(scene, twin, spp)?,
                pixels: summary.scenes[scene].pixels,
            })
        })
        .collect()
}

/// One pattern in every pixel turns noise into structure: does it?
pub fn between_pixels(summary: &Summary, tests: &NeighbourTests, page: &mut Page) {
    page.heading(3, titles::PIXELS);
    let Some(spp) = pattern_spp(summary) else { return };
    let all: Vec<(usize, Pattern)> = (0..summary.scenes.len())
        .flat_map(|scene| patterns(summary, scene).into_iter().map(move |p| (scene, p)))
        .collect();
    page.paragraph(&format!(
        "ρ is the correlation between the errors of neighbouring pixels at {spp} spp. A sampler that shows every pixel the same points (or one axis of them) may make neighbours err \
         alike: then noise becomes structure, which the eye sees more readily and which does not average out over an area."
    ));
    if all.is_empty() {
        page.paragraph("No sampler of this experiment shows every pixel the same points beside one that does not.");
    }
    page.sentences(&pattern_sentences(summary, tests, &all));
    page.sentences(&[structure_sentence(summary).unwrap_or_default()]);
    pattern_table(summary, spp, &all, page);
    picture_correlations(summary, page);
    neighbours_table(summary, tests, spp, page);
}

/// ρ of every sampler in every scene.
fn neighbours_table(summary: &Summary, tests: &NeighbourTests, spp: u32, page: &mut Page) {
    let repeats: Vec<usize> =
        (0..summary.samplers.len()).filter(|&i| summary.samplers[i].repeats_in_every_pixel()).collect();
    let lines: Vec<Vec<String>> = (0..summary.scenes.len())
        .flat_map(|scene| (0..summary.samplers.len()).map(move |sampler| (scene, sampler)))
        .filter_map(|(scene, sampler)| {
            let cell = summary.cell(scene, sampler, spp)?;
            let pattern = match (repeats.contains(&sampler), summary.samplers[sampler].spec().map(|spec| spec.random)) {
                (true, Some(Random::Yxor)) => "x the same in every pixel",
                (true, None) => "in some decision the same in every pixel",
                (true, _) => "the same in every pixel",
                _ => "new in each pixel",
            };
            Some(vec![
                scene_name(summary, scene),
                name(summary, sampler),
                pattern.to_owned(),
                cell.error_autocorrelation.map_or("–".to_owned(), |rho| signed_estimate(&rho)),
                p_value(tests.of(scene, sampler).and_then(|test| test.p)),
                tests.of(scene, sampler).map_or("cannot tell", |test| small_words(test.sameness)).to_owned(),
                estimate_cell(cell.rmse),
                spread(&cell.replicate_mean).map_or("–".to_owned(), short),
                marked_row(cell),
            ])
        })
        .collect();
    let caption = format!(
        "Correlation ρ of neighbouring pixels' errors (no unit) and RMSE at {spp} spp, and the spread (standard deviation) of the whole image's mean between replicates; \
         RMSE and spread in W/(m² sr); {}. p: of ρ = 0 (Student's over replicates; of one image without randomness ±1/√(2 · pixels), the spread under independent errors); Holm-adjusted over the table, findings below {LEVEL}. Small: with its whole interval within ±{LEAST_RHO} (two one-sided tests), or shown outside.",
        level(summary)
    );
    let head = ["scene", "sampler", "points", "ρ", "p", "small?", "RMSE", "spread of the mean", "row"];
    tabulate_folded(page, "neighbours", "ρ of every sampler in every scene", &caption, &head, &lines);
}

/// Whether ρ is small.
fn small_words(sameness: Sameness) -> &'static str {
    match sameness {
        Sameness::Same => "yes",
        Sameness::Different => "no",
        Sameness::CannotTell => "cannot tell",
    }
}

/// Where neighbours err more alike, where less, and where it cannot be told.
fn pattern_sentences(summary: &Summary, tests: &NeighbourTests, all: &[(usize, Pattern)]) -> Vec<String> {
    let of = |answer: Answer| {
        let found = all.iter().filter(|(_, p)| p.errs_alike() == answer);
        let told: Vec<String> = found
            .map(|(scene, p)| {
                let rho = p.cell.error_autocorrelation.map_or("undefined".to_owned(), |rho| signed_estimate(&rho));
                let p_of = tests.of(*scene, p.sampler).and_then(|test| test.p);
                let p_of = p_of.map_or(String::new(), |p| format!(", {}", p_words(Some(p))));
                format!("{} in {} (ρ = {rho}{p_of})", name(summary, p.sampler), scene_name(summary, *scene))
            })
            .collect();
        (!told.is_empty()).then(|| listed(&told))
    };
    [
        of(Answer::Yes).map(|list| format!("**Neighbours err more alike** under {list}.")),
        of(Answer::No).map(|list| format!("They err less alike than under the sampler compared with for {list}.")),
        of(Answer::CannotTell).map(|list| format!("It cannot be told for {list}.")),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Who errs alike without a pattern that repeats, and why.
fn structure_sentence(summary: &Summary) -> Option<String> {
    let all: Vec<(usize, usize, Structure)> = (0..summary.scenes.len())
        .flat_map(|scene| (0..summary.samplers.len()).map(move |sampler| (scene, sampler)))
        .filter_map(|(scene, sampler)| Some((scene, sampler, structure(summary, scene, sampler)?)))
        .filter(|(.., found)| !found.repeats)
        .collect();
    let is_shared_bias = |(_, sampler, found): &(usize, usize, Structure)| {
        let in_step = summary.samplers[*sampler].spec().is_some_and(|spec| spec.order == Order::Step);
        in_step && is_biased(&found.cell.bias2) == Answer::Yes
    };
    let why = match all.iter().all(is_shared_bias) {
        true => " A bias of decisions in step varies slowly over the picture, so neighbours share it.",
        false => "",
    };
    let told = all.iter().map(|(scene, sampler, found)| {
        let rho = found.cell.error_autocorrelation.map_or("undefined".to_owned(), |rho| signed_estimate(&rho));
        format!(
            "{} in {} (ρ = {rho} at {} spp; {})",
            name(summary, *sampler),
            scene_name(summary, *scene),
            found.cell.spp.asked,
            bias_short(found.cell)
        )
    });
    let told: Vec<String> = told.collect();
    (!told.is_empty()).then(|| {
        format!("New points in each pixel are no protection: neighbours also err alike under {}.{why}", listed(&told))
    })
}

/// One pattern in every pixel beside a new one in each: one line a sampler and scene.
fn pattern_table(summary: &Summary, spp: u32, all: &[(usize, Pattern)], page: &mut Page) {
    let rho = |cell: &Cell| cell.error_autocorrelation.map_or("undefined".to_owned(), |rho| signed_estimate(&rho));
    let lines: Vec<Vec<String>> = all
        .iter()
        .map(|(scene, p)| {
            let in_step = summary.samplers[p.sampler].spec().is_some_and(|spec| spec.order == Order::Step);
            let verdict = match p.errs_alike() {
                Answer::Yes => "more alike",
                Answer::No => "less alike",
                Answer::CannotTell => "cannot tell",
            };
            vec![
                scene_name(summary, *scene),
                name(summary, p.sampler),
                rho(p.cell),
                name(summary, p.twin),
                rho(p.other),
                verdict.to_owned(),
                ratio_cell(rmse_ratio(p.cell, p.other)),
                if in_step { "yes" } else { "no" }.to_owned(),
                format!("{} {}", row(&p.cell.id), row(&p.other.id)),
            ]
        })
        .collect();
    let caption = format!(
        "Samplers that show every pixel the same points, or one axis of them, beside the nearest that does not, at {spp} spp: correlation ρ of neighbouring pixels' errors (no unit), \
         whether neighbours err more alike, the ratio of the two RMSE, and whether decisions march in step, which makes neighbours err alike, too; {}. One image of a sampler without randomness is compared by ±1.96/√(2 · pixels), the spread of ρ \
         under independent errors.",
        level(summary)
    );
    let head =
        ["scene", "sampler", "its ρ", "compared with", "its ρ", "neighbours err", "ratio of RMSE", "in step", "rows"];
    tabulate(page, "patterns", &caption, &head, &lines);
}

/// The same on the larger pictures: one image each, so no interval.
fn picture_correlations(summary: &Summary, page: &mut Page) {
    let told = |set: &PictureSet| {
        let repeats = |shot: &&&Shot| summary.samplers[shot.sampler].repeats_in_every_pixel();
        let rho = |shot: &Shot| shot.row.errors.as_ref()?.error_autocorrelation;
        let items: Vec<String> = set
            .at_equal_spp()
            .iter()
            .filter(repeats)
            .filter_map(|shot| {
                Some(format!("{} {} (row {})", name(summary, shot.sampler), signed(rho(shot)?), row(&shot.row.id)))
            })
            .collect();
        let (at, size) = (scene_name(summary, set.scene), set.pictures.size);
        (!items.is_empty()).then(|| format!("{at} at {size} pixels {}", listed(&items)))
    };
    let told: Vec<String> = summary.pictured.iter().filter_map(told).collect();
    if !told.is_empty() {
        page.paragraph(&format!(
            "ρ under the same points in every pixel, on the pictures (one image each, so without intervals; the others are in {}): {}.",
            link_to(titles::PICTURES),
            told.join("; ")
        ));
    }
}

/// Standard deviation; none of fewer than two values.
fn spread(values: &[f64]) -> Option<f64> {
    let moments: crate::stats::Moments = values.iter().copied().collect();
    moments.std()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn structure_is_called_only_where_it_is_clear() {
        let clear = |rho, half: f64, uniform| is_clear_structure(rho, Some([rho - half, rho + half]), uniform);
        assert!(clear(0.071, 0.007, Some([-0.01, 0.01])) && clear(0.071, 0.007, None));
        assert!(!clear(0.071, 0.04, None), "0 is less than twice as far as the interval's end");
        assert!(!clear(0.02, 0.001, None), "sure, but nothing to see");
        assert!(!clear(0.071, 0.007, Some([0.0, 0.07])) && !is_clear_structure(0.9, None, None));
    }
}

//! `prediction` of an experiment: the variance of single pixels, predicted from spectra and measured.

use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::backend::Size;
use super::plan::{PredictionWork, WorkItem};
use super::results::{Kind, PixelVariance, PredictionRow, SCHEMA};
use super::spec::{MOST_REPLICATES, count, counts, known_scene, list};
use crate::error::{Error, Result};
use crate::render::render_sample;
use crate::sampling::hash::derive;
use crate::sampling::{
    Decision, Dim1, Dim2, PixelKey, PointSource, Random, Sampler, SamplerSet, SamplerSpec, point_set,
};
use crate::scene::compile::Scene;
use crate::scene::json::Item;
use crate::stats::pixel_variance::{GRID, Integrand, SetSpectrum};
use crate::stats::{Estimate, Moments, jackknife, variance_interval};

/// Raised whenever the bits of a prediction may change.
pub const ALGORITHM: u32 = 1;

/// Most points of a set: its spectrum is a direct sum.
pub const MOST_POINTS: u32 = 1024;

/// Most pixels.
const MOST_PIXELS: usize = 64;

/// Sets whose mean spectrum stands for a randomisation that is not a shift.
pub const SETS: u64 = 16;

/// Which variances to predict and to measure.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Prediction {
    /// Scene, one of the experiment's, that makes no decision but that of the pixel.
    pub scene: String,
    /// Samplers, as written; randomised.
    pub samplers: Vec<String>,
    /// Samples per pixel.
    pub spp: Vec<u32>,
    /// Columns and rows of the pixels, from the upper left, in an image of the scene's size in the experiment.
    pub pixels: Vec<[u32; 2]>,
    /// Randomisations that the measured variance comes from, at least 3.
    pub seeds: u32,
}

/// `prediction`. What its samplers mean, and whether the scene allows it, the plan asks.
pub(super) fn prediction(item: &Item, scenes: &[String]) -> Result<Prediction> {
    let mut fields = item.fields()?;
    let scene = fields.need("scene", |item| {
        let scene = item.text("a scene of the experiment")?;
        known_scene(scene, scenes, &item)?;
        Ok(scene.to_owned())
    })?;
    let samplers = fields.need("samplers", |item| list(&item, "samplers", super::entry::sampler))?;
    let spp = fields.need("spp", |item| counts(&item, MOST_POINTS))?;
    let pixels = fields.need("pixels", |item| list(&item, "pixels", pixel))?;
    let seeds = fields.need("seeds", |item| match count(&item, MOST_REPLICATES)? {
        seeds @ 3.. => Ok(seeds),
        _ => Err(item.unexpected("at least 3 seeds")),
    })?;
    fields.finish()?;
    if pixels.len() > MOST_PIXELS {
        let what = format!("expected at most {MOST_PIXELS} pixels, found {}", pixels.len());
        return Err(Error::input(item.place.key("pixels"), what));
    }
    Ok(Prediction { scene, samplers, spp, pixels, seeds })
}

/// `[column, row]`.
fn pixel(item: &Item) -> Result<[u32; 2]> {
    let expected = "a pixel such as [12, 30], column and row from the upper left";
    match item.items(expected)?.as_slice() {
        [x, y] => Ok([x.integer(0..=u64::from(u32::MAX))? as u32, y.integer(0..=u64::from(u32::MAX))? as u32]),
        _ => Err(item.unexpected(expected)),
    }
}

/// A source that gives the centres of a grid of [`GRID`]² cells.
struct Grid;

impl PointSource for Grid {
    fn samples(&self) -> u32 {
        (GRID * GRID) as u32
    }

    fn fill_1d(&self, _: PixelKey, _: u32, _: &Dim1, out: &mut [f32]) {
        out.fill(0.5);
    }

    fn fill_2d(&self, _: PixelKey, first: u32, _: &Dim2, x: &mut [f32], y: &mut [f32]) {
        let centre = |i: usize| (i as f32 + 0.5) / GRID as f32;
        for (index, (x, y)) in (first as usize..).zip(x.iter_mut().zip(y)) {
            (*x, *y) = (centre(index % GRID), centre(index / GRID));
        }
    }
}

/// Mean of the channels of one sample, radiance: what is predicted is linear in the image, so any one number a pixel will do.
fn value<S: PointSource>(scene: &Scene, source: &S, [x, y]: [u32; 2], index: u32) -> f64 {
    let radiance = render_sample(scene, source, x, y, index);
    (f64::from(radiance.x) + f64::from(radiance.y) + f64::from(radiance.z)) / 3.0
}

/// What a pixel sees, looked at sample by sample.
pub fn integrand(scene: &Scene, pixel: [u32; 2]) -> Integrand {
    let rows: Vec<Vec<f64>> = (0..GRID as u32)
        .into_par_iter()
        .map(|j| (0..GRID as u32).map(|i| value(scene, &Grid, pixel, j * GRID as u32 + i)).collect())
        .collect();
    Integrand::of_grid(&rows.concat())
}

/// The spectrum of a sampler's sets, and whether the formula is exact for it.
///
/// # Errors
/// As [`point_set`].
fn spectrum(spec: SamplerSpec, asked: u32, seed: u64) -> Result<(Option<SetSpectrum>, bool)> {
    let sets = match spec.random {
        Random::Fresh => return Ok((None, true)),
        Random::Shift => 1,
        _ => SETS,
    };
    let sets: Vec<Vec<[f64; 2]>> =
        (0..sets).map(|k| point_set(spec, asked, derive(seed, &[1, k]))).collect::<Result<_>>()?;
    Ok((Some(SetSpectrum::of(&sets)), spec.random == Random::Shift))
}

/// Means of a pixel under independent randomisations.
fn measured(scene: &Scene, set: SamplerSet, work: &PredictionWork, pixel: [u32; 2]) -> Result<Vec<f64>> {
    (0..u64::from(work.seeds))
        .into_par_iter()
        .map(|k| {
            let sampler = Sampler::new(set, &scene.layout, work.spp.asked, derive(work.seed, &[0, k]))?;
            let total: f64 = (0..sampler.samples()).map(|index| value(scene, &sampler, pixel, index)).sum();
            Ok(total / f64::from(sampler.samples()))
        })
        .collect()
}

/// What predictions and measurements say of one sampler and count.
#[derive(Debug, Clone, PartialEq)]
pub struct Predicted {
    /// Whether the formula is exact for the sampler.
    pub is_stationary: bool,
    /// Pixel by pixel.
    pub pixels: Vec<PixelVariance>,
    /// Measured by predicted, each summed over the pixels.
    pub ratio: Estimate,
    /// Share of the prediction that stands for frequencies that were not summed.
    pub rest: f64,
}

/// Predicts and measures.
///
/// # Errors
/// Kind `Input` where the sampler has no points for the pixel; kind `Incomplete` where no pixel has any variance.
pub fn predict(
    scene: &Scene,
    set: SamplerSet,
    work: &PredictionWork,
    integrands: &[Arc<Integrand>],
) -> Result<Predicted> {
    let (spectrum, is_stationary) = spectrum(set.of(Decision::Pixel), work.spp.asked, work.seed)?;
    let values: Vec<Vec<f64>> =
        work.pixels.iter().map(|&pixel| measured(scene, set, work, pixel)).collect::<Result<_>>()?;
    let predicted: Vec<_> = integrands.iter().map(|f| f.predicted(spectrum.as_ref(), work.spp.taken)).collect();
    let total: f64 = predicted.iter().map(|p| p.variance).sum();
    let freedom = f64::from(work.seeds) - 1.0;
    let pixels: Vec<PixelVariance> = (0..work.pixels.len())
        .map(|i| {
            let moments: Moments = values[i].iter().copied().collect();
            let variance = moments.variance().unwrap_or(0.0);
            let measured = Estimate { value: variance, ci95: Some(variance_interval(variance, freedom, 0.95)) };
            PixelVariance {
                pixel: work.pixels[i],
                mean: integrands[i].mean,
                one_sample: integrands[i].variance,
                predicted: predicted[i].variance,
                rest: predicted[i].rest,
                measured: measured.with_rounded_interval(),
            }
        })
        .collect();
    if total <= 0.0 {
        let what = "expected pixels that the sampler gives some variance, found none";
        return Err(Error::incomplete(format!("{} prediction", work.scene), what));
    }
    let ratio = jackknife(work.seeds as usize, |out| {
        values.iter().map(|values| variance_without(values, out)).sum::<f64>() / total
    });
    let rest = predicted.iter().map(|p| p.rest).sum::<f64>() / total;
    Ok(Predicted { is_stationary, pixels, ratio: ratio.with_rounded_interval(), rest })
}

/// Unbiased variance of all values but one.
fn variance_without(values: &[f64], out: Option<usize>) -> f64 {
    let kept = values.iter().enumerate().filter(|(i, _)| Some(*i) != out).map(|(_, &v)| v);
    kept.collect::<Moments>().variance().unwrap_or(0.0)
}

/// The row of an item.
pub(super) fn row(item: &WorkItem, work: &PredictionWork, found: Predicted) -> PredictionRow {
    PredictionRow {
        schema: SCHEMA,
        id: item.id.clone(),
        kind: Kind::Prediction,
        scene: work.scene.clone(),
        sampler: work.sampler.clone(),
        spp: work.spp,
        seed: work.seed,
        size: work.size,
        seeds: work.seeds,
        is_stationary: found.is_stationary,
        ratio: found.ratio,
        rest: found.rest,
        pixels: found.pixels,
        made_with: None,
    }
}

/// Pixels of a prediction lie in the image.
///
/// # Errors
/// Kind `Input` that names the first that does not.
pub(super) fn check_pixels(pixels: &[[u32; 2]], size: Size, place: &str) -> Result<()> {
    let outside = pixels.iter().position(|&[x, y]| x >= size.width || y >= size.height);
    outside.map_or(Ok(()), |i| {
        let what = format!("expected a pixel of an image of {size}, found {:?}", pixels[i]);
        Err(Error::input(format!("{place}: prediction.pixels[{i}]"), what))
    })
}

/// Statistical tests at fixed seeds: 1e−8 false alarms each, 4e−8 together.
#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::backend::Backend;
    use super::super::lab::Lab;
    use super::super::results::Count;
    use super::*;
    use crate::scene::json;
    use crate::scene::load::OpenOptions;
    use crate::stats::student_t_quantile;

    const SIZE: Size = Size { width: 64, height: 36 };

    fn lab() -> Lab {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let lab = Lab::new(&root.join("configs/experiments/none.json"), OpenOptions::default());
        assert!(lab.open_scene("horizon").unwrap().exact_reference);
        lab
    }

    fn work(sampler: &str, asked: u32) -> PredictionWork {
        PredictionWork {
            scene: "horizon".to_owned(),
            sampler: sampler.to_owned(),
            spp: Count { asked, taken: asked },
            seed: 5,
            size: SIZE,
            pixels: vec![[9, 29], [52, 31]],
            seeds: 300,
        }
    }

    /// Half the interval's width, widened from 95 % to 1 − 1e−8; a predicted variance that is off by a quarter is seen.
    fn allowed(found: &Predicted) -> f64 {
        let [low, high] = found.ratio.ci95.unwrap();
        let factor = |p: f64| student_t_quantile(1.0 - p / 2.0, 299.0);
        0.5 * (high - low) * factor(1e-8) / factor(0.05) + found.rest
    }

    #[test]
    fn the_variance_of_shifted_sets_is_the_predicted_one() {
        let lab = lab();
        for (sampler, asked) in [
            ("uniform:step:fresh@each", 4),
            ("uniform:step:fresh@each", 16),
            ("hammersley:shuffle:shift@each", 16),
            ("hammersley:shuffle:shift@each", 64),
        ] {
            let found = lab.predict(&work(sampler, asked), 2).unwrap();
            assert!(found.is_stationary && found.rest < 0.2, "{sampler}: {found:?}");
            let allowed = allowed(&found);
            assert!((found.ratio.value - 1.0).abs() < allowed && allowed < 0.8, "{sampler} {asked}: {found:?}");
            assert_eq!(found, lab.predict(&work(sampler, asked), 1).unwrap(), "one thread, two threads");
        }
        // Better sets have less of it, and not by the formula alone.
        let [uniform, shifted] = ["uniform:step:fresh@each", "hammersley:shuffle:shift@each"]
            .map(|sampler| lab.predict(&work(sampler, 64), 2).unwrap().pixels[0].clone());
        assert!(shifted.predicted < 0.5 * uniform.predicted && shifted.measured.value < 0.5 * uniform.measured.value);
    }

    /// A grid of 512² cells errs by at most the cells that edges cut: 2 · 512 for each of a handful of edges, each by half the contrast.
    #[test]
    fn a_pixel_seen_sample_by_sample_is_the_closed_form_s() {
        let lab = lab();
        let exact = lab.exact_reference("horizon", SIZE).unwrap();
        let found = lab.predict(&work("uniform:step:fresh@each", 4), 2).unwrap();
        for pixel in &found.pixels {
            let [x, y] = pixel.pixel;
            let truth: f64 =
                exact.pixels[(y * SIZE.width + x) as usize].iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0;
            assert!((pixel.mean - truth).abs() < 2e-3 && pixel.one_sample > 0.0, "{pixel:?} {truth}");
        }
    }

    #[test]
    fn a_prediction_reads_strictly() {
        let read = |text: &str| {
            let value = json::parse(text.as_bytes(), "a.json").unwrap();
            prediction(&Item::top(&value, "a.json"), &["horizon".to_owned(), "box".to_owned()])
        };
        let text = r#"{"scene": "horizon", "samplers": ["ld"], "spp": [16], "pixels": [[1, 2], [3, 4]], "seeds": 8}"#;
        let found = read(text).unwrap();
        assert_eq!((found.pixels, found.seeds, found.spp), (vec![[1, 2], [3, 4]], 8, vec![16]));
        for (from, to, what) in [
            ("\"horizon\"", "\"horizont\"", "did you mean"),
            ("[1, 2]", "[1]", "a pixel such as"),
            ("[1, 2]", "[3, 4]", "each entry once"),
            ("[1, 2]", "[-1, 2]", "a whole number"),
            ("\"seeds\": 8", "\"seeds\": 2", "at least 3 seeds"),
            ("[16]", "[2000]", "1024"),
            ("\"seeds\"", "\"seed\"", "seed"),
        ] {
            let error = read(&text.replace(from, to)).unwrap_err();
            assert!(error.to_string().contains(what), "{from} → {to}: {error}");
        }
        let error = check_pixels(&[[63, 35], [64, 0]], SIZE, "a.json").unwrap_err();
        assert!(error.to_string().contains("prediction.pixels[1]"), "{error}");
    }
}

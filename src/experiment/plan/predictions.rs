//! Predicted variances of single pixels in the plan.

use super::super::compared::read_sampler;
use super::super::identity::Fingerprint;
use super::super::prediction::{ALGORITHM, check_pixels};
use super::{Planner, PredictionWork, Work};
use crate::error::{Error, Result};
use crate::sampling::Decision;

impl Planner<'_> {
    /// One item a sampler and count.
    ///
    /// # Errors
    /// Kind `Input` where the scene makes another decision than that of the pixel, a pixel is outside the image, or a sampler
    /// cannot be read, has nothing random in it, or is named twice.
    pub(super) fn add_predictions(&mut self) -> Result<()> {
        let experiment = self.experiment;
        let Some(asked_for) = &experiment.prediction else { return Ok(()) };
        let place = &experiment.place;
        let mut scenes = experiment.scenes.iter().zip(self.scenes);
        let (name, scene) = scenes
            .find(|(name, _)| **name == asked_for.scene)
            .expect("the spec holds predictions to the experiment's scenes");
        if scene.decisions() != [Decision::Pixel] {
            let what = format!("expected a scene whose only decision is that of the pixel, found {}", scene.layout);
            return Err(Error::input(format!("{place}: prediction.scene"), what));
        }
        let size = experiment.size.of(name, scene.size);
        check_pixels(&asked_for.pixels, size, place)?;
        let mut canonicals: Vec<String> = Vec::new();
        for (i, text) in asked_for.samplers.iter().enumerate() {
            let key = format!("prediction.samplers[{i}]");
            let canonical = read_sampler(text, &key, experiment, self.backend)?;
            let refuse = |expected: &str| {
                Err(Error::input(format!("{place}: {key}"), format!("expected {expected}, found {text:?}")))
            };
            if !self.backend.is_random(&canonical, Some(&scene.name)) {
                return refuse("a randomised sampler, as nothing else has a variance");
            }
            if canonicals.contains(&canonical) {
                return refuse("each sampler once");
            }
            canonicals.push(canonical);
        }
        for (sampler, &asked) in canonicals.iter().flat_map(|s| asked_for.spp.iter().map(move |spp| (s, spp))) {
            let numbers = self.backend.algorithms(sampler);
            let work = PredictionWork {
                scene: scene.name.clone(),
                sampler: sampler.clone(),
                spp: self.count(sampler, Some(scene), asked),
                seed: self.seed("prediction", &scene.name, sampler, asked, 0),
                size,
                pixels: asked_for.pixels.clone(),
                seeds: asked_for.seeds,
            };
            let pixels: Vec<String> = work.pixels.iter().map(|[x, y]| format!("{x},{y}")).collect();
            let id = Fingerprint::new("prediction")
                .with("scene", &scene.content_hash)
                .with("sampler", sampler)
                .with("asked", work.spp.asked)
                .with("taken", work.spp.taken)
                .with("seed", work.seed)
                .with("size", size)
                .with("pixels", pixels.join(" "))
                .with("seeds", work.seeds)
                .with("renderer algorithm", numbers.renderer)
                .with("sampler algorithm", numbers.sampler)
                .with("prediction algorithm", ALGORITHM)
                .id();
            self.push(id, numbers.metrics, Work::Prediction(work));
        }
        Ok(())
    }
}

//! The references of a plan: closed forms, two halves, or halves that may grow batch by batch.

use super::{
    Batch, GrowthWork, ImageWork, Making, PlannedSampler, Planner, ReferenceSource, ReferenceWork, SceneFacts, Size,
    Work,
};
use crate::experiment::backend::{Estimator, Stage, Variant};
use crate::experiment::growth::RULE;
use crate::experiment::identity::Fingerprint;
use crate::experiment::results::{Count, Kind};

impl Planner<'_> {
    /// A scene's reference, which grows where the experiment asks for it and there is no closed form; its id.
    ///
    /// The id hashes the first batches, the rule with its bounds and the pilots, and not how far the reference grows: that
    /// follows from them, so it is known to every row before it is known how far.
    pub(super) fn add_grown_reference(
        &mut self,
        scene: &SceneFacts,
        size: Size,
        samplers: &[PlannedSampler],
        probed: &[String],
    ) -> String {
        let (asked, most) = (self.experiment.reference.spp, self.experiment.reference.most_batches());
        let Some(noise) = self.experiment.reference.noise.filter(|_| !scene.exact_reference) else {
            return self.add_reference(scene, size, asked, "reference");
        };
        let spp = self.count(&self.reference.canonical, Some(scene), asked);
        let ids = [0, 1].map(|half| self.add_half(scene, size, spp, half, "reference"));
        let pilot = |sampler: &PlannedSampler| self.pilot(scene, size, &sampler.canonical, probed);
        let mut pilots: Vec<String> = self.done_in(scene, samplers).into_iter().map(pilot).collect();
        // The order of a list of samplers goes into no id.
        pilots.sort();
        let id = Fingerprint::new("growing reference")
            .with("halves", ids.join(","))
            .with("rule", RULE)
            .with("noise", noise)
            .with("most batches", most)
            .with("pilots", pilots.join(","))
            .id();
        let mut batches = ids.clone().map(|first| vec![first]);
        for number in 1..most {
            for (half, batches) in (0..).zip(&mut batches) {
                let batch = Batch { number, reference_id: id.clone() };
                let work = self.half_work(scene, size, spp, half, &format!("reference batch {number}"));
                batches.push(self.add_image(scene, ImageWork { batch: Some(batch), ..work }));
            }
        }
        self.notes.push(format!(
            "{}: the reference grows from 2 × {asked} spp to 2 × {most} × {asked} spp at the most, until its RMSE is {noise} of the smallest it judges",
            scene.name
        ));
        let (metrics, sampler) =
            (self.backend.algorithms(&self.reference.canonical).metrics, &self.reference.canonical);
        let growth = Some(GrowthWork { batches, pilots });
        let source = ReferenceSource::Halves { ids, sampler: sampler.clone(), spp, growth };
        self.push(id, metrics, Work::Reference(ReferenceWork { scene: scene.name.clone(), size, source }))
    }

    /// Id of the image that tells what a sampler's smallest error is: replicate 0 at its most samples, the plain one.
    fn pilot(&self, scene: &SceneFacts, size: Size, sampler: &str, probed: &[String]) -> String {
        let stability = self.experiment.stability.as_ref().filter(|_| probed.iter().any(|text| text == sampler));
        let counts = self.experiment.spp.iter().copied().chain(stability.map(|stability| stability.spp));
        let asked = counts.max_by_key(|&asked| (self.count(sampler, Some(scene), asked).taken, asked));
        let asked = asked.expect("an experiment has a count");
        let making = Making { asked, estimator: self.experiment.estimator.primary(), variant: Variant::Plain };
        self.image_id(scene, &self.render_work(scene, size, sampler, making, 0))
    }

    /// A reference and, where the scene has no closed form, its two halves; the reference's id.
    pub(super) fn add_reference(&mut self, scene: &SceneFacts, size: Size, asked: u32, purpose: &str) -> String {
        let sampler = self.reference.canonical.clone();
        let numbers = self.backend.algorithms(&sampler);
        let (id, source) = if scene.exact_reference {
            let id = Fingerprint::new("exact reference")
                .with("scene", &scene.content_hash)
                .with("size", size)
                .with("exact algorithm", numbers.exact)
                .id();
            (id, ReferenceSource::Exact)
        } else {
            let spp = self.count(&sampler, Some(scene), asked);
            let ids = [0, 1].map(|half| self.add_half(scene, size, spp, half, purpose));
            let id = Fingerprint::new("reference").with("halves", ids.join(",")).id();
            (id, ReferenceSource::Halves { ids, sampler, spp, growth: None })
        };
        self.push(id, numbers.metrics, Work::Reference(ReferenceWork { scene: scene.name.clone(), size, source }))
    }

    /// Adds one half of a reference, or its first batch; its id.
    fn add_half(&mut self, scene: &SceneFacts, size: Size, spp: Count, half: u32, purpose: &str) -> String {
        let work = self.half_work(scene, size, spp, half, purpose);
        self.add_image(scene, work)
    }

    /// One half of a reference. It stands for the truth, so it never takes the sheet's shortcut.
    fn half_work(&self, scene: &SceneFacts, size: Size, spp: Count, half: u32, purpose: &str) -> ImageWork {
        let sampler = self.reference.canonical.clone();
        ImageWork {
            kind: Kind::ReferenceHalf,
            scene: scene.name.clone(),
            spp,
            replicate: half,
            batch: None,
            seed: self.seed(purpose, &scene.name, &sampler, spp.asked, half),
            sampler,
            size,
            estimator: Estimator::Unbiased,
            stage: Stage::Final,
            variant: Variant::Plain,
            reference_id: None,
            twin: None,
        }
    }
}

//! Images made in another way than the plain ones that they are held against: the sheet's shortcut, and what should make
//! no difference. They stand beside their plain twins in the plan.

use super::super::backend::{Backend, Estimator, SceneFacts, Size, Variant};
use super::super::compared::read_sampler;
use super::super::spec::{Estimators, Experiment};
use super::{Making, PlannedSampler, Planner, Work, WorkItem};
use crate::error::{Error, Result, did_you_mean};

/// Whether `other`, which has the item's seed, is the item's twin.
pub(super) fn is_seeded_as_its_twin(item: &WorkItem, other: Option<&WorkItem>) -> bool {
    match (&item.work, other) {
        (Work::Image(work), Some(other)) => work.twin.as_ref() == Some(&other.id),
        _ => false,
    }
}

/// The samplers whose stability is asked about, in canonical form; each has to be one of those compared.
pub(super) fn probed_samplers(
    experiment: &Experiment,
    backend: &dyn Backend,
    samplers: &[PlannedSampler],
    scenes: &[SceneFacts],
) -> Result<Vec<String>> {
    let Some(stability) = &experiment.stability else { return Ok(Vec::new()) };
    for (name, scene) in experiment.scenes.iter().zip(scenes).filter(|(name, _)| stability.scenes.contains(name)) {
        let place = |e: Error| Error::input(format!("{}: stability: scene {name}", experiment.place), e);
        for variant in stability.variants() {
            backend.check_variant(&scene.name, variant).map_err(place)?;
        }
    }
    let mut probed: Vec<String> = Vec::new();
    for (i, text) in stability.samplers.iter().enumerate() {
        let key = format!("stability.samplers[{i}]");
        // A set goes by the name that the experiment gives it, anything else by what it means.
        let named = samplers.iter().find(|sampler| sampler.names.contains(text));
        let canonical = match named {
            Some(sampler) => sampler.canonical.clone(),
            None => read_sampler(text, &key, experiment, backend)?,
        };
        if !samplers.iter().any(|sampler| sampler.canonical == canonical) {
            let names: Vec<&str> = samplers.iter().flat_map(|sampler| &sampler.names).map(String::as_str).collect();
            let near = did_you_mean(text, names.iter().copied());
            let near = near.map(|near| format!("; did you mean {near:?}?")).unwrap_or_default();
            let what = format!("expected one of the experiment's samplers {}, found {text:?}{near}", names.join(" "));
            return Err(Error::input(format!("{}: {key}", experiment.place), what));
        }
        if !probed.contains(&canonical) {
            probed.push(canonical);
        }
    }
    Ok(probed)
}

impl Planner<'_> {
    /// The counts of the experiment, and where a light is picked, if that is asked for, the sheet's shortcut beside each.
    pub(super) fn add_shortcut_of(
        &mut self,
        scene: &SceneFacts,
        size: Size,
        sampler: &PlannedSampler,
        reference_id: &str,
    ) {
        let estimators = self.experiment.estimator;
        let primary = estimators.primary();
        for &asked in &self.experiment.spp {
            let plain = Making { asked, estimator: primary, variant: Variant::Plain };
            let twins = self.add_replicates(scene, size, sampler, plain, reference_id, &[]);
            if estimators == Estimators::Both && scene.picks_lights() {
                let sheet = Making { estimator: Estimator::Sheet, ..plain };
                self.add_replicates(scene, size, sampler, sheet, reference_id, &twins);
            }
        }
    }

    /// What should make no difference: a sample more or less, another unit of length, two passes.
    pub(super) fn add_stability_of(
        &mut self,
        scene: &SceneFacts,
        size: Size,
        sampler: &PlannedSampler,
        reference_id: &str,
    ) {
        let Some(stability) = &self.experiment.stability else { return };
        let estimator = self.experiment.estimator.primary();
        let plain = Making { asked: stability.spp, estimator, variant: Variant::Plain };
        let twins = self.add_replicates(scene, size, sampler, plain, reference_id, &[]);
        for asked in stability.counts() {
            self.add_replicates(scene, size, sampler, Making { asked, ..plain }, reference_id, &[]);
        }
        for variant in stability.variants() {
            self.add_replicates(scene, size, sampler, Making { variant, ..plain }, reference_id, &twins);
        }
    }
}

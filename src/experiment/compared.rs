//! The samplers of an experiment: read, put together where they mean the same, checked against the reference's.

use std::collections::HashMap;

use super::backend::{Backend, SceneFacts};
use super::plan::PlannedSampler;
use super::results::LeftOut;
use super::spec::{Experiment, SamplerEntry};
use crate::error::{Error, Result};

/// Reads the compared samplers and puts texts that mean the same one together.
pub(super) fn read_samplers(experiment: &Experiment, backend: &dyn Backend) -> Result<Vec<PlannedSampler>> {
    let mut samplers: Vec<PlannedSampler> = Vec::new();
    for (i, entry) in experiment.samplers.iter().enumerate() {
        let canonical = read_entry(entry, &format!("samplers[{i}]"), experiment, backend)?;
        match samplers.iter_mut().find(|known| known.canonical == canonical) {
            Some(known) => known.names.push(entry.name().to_owned()),
            None => samplers.push(PlannedSampler { canonical, names: vec![entry.name().to_owned()] }),
        }
    }
    Ok(samplers)
}

/// Reads one entry of the list of samplers, decision by decision where it is a set.
fn read_entry(entry: &SamplerEntry, key: &str, experiment: &Experiment, backend: &dyn Backend) -> Result<String> {
    for (part, text) in entry.parts() {
        let key = part.map_or(key.to_owned(), |part| format!("{key}.{part}"));
        read_sampler(text, &key, experiment, backend)?;
    }
    let canonical = read_sampler(&entry.text(), key, experiment, backend)?;
    // A name that is another sampler's text would make every sentence about it a lie.
    if let (SamplerEntry::Set { name, .. }, Ok(named)) = (entry, backend.parse_sampler(entry.name()))
        && named != canonical
    {
        let what = format!("expected a name that is not another sampler's, found {name:?}, which is {named}");
        return Err(Error::input(format!("{}: {key}.name", experiment.place), what));
    }
    Ok(canonical)
}

/// The sets that mean in a scene the same as a single sampler, or as an earlier set: for want of a lens, say.
pub(super) fn same_in_a_scene(
    scenes: &[SceneFacts],
    samplers: &[PlannedSampler],
    backend: &dyn Backend,
) -> Vec<LeftOut> {
    let (sets, single): (Vec<&PlannedSampler>, Vec<_>) =
        samplers.iter().partition(|sampler| backend.is_mixed(&sampler.canonical));
    let mut left_out = Vec::new();
    for scene in scenes {
        let mut done: HashMap<String, &str> = HashMap::new();
        for PlannedSampler { canonical, .. } in single.iter().chain(&sets) {
            let meaning = backend.meaning(canonical, &scene.name);
            match done.get(&meaning) {
                Some(same_as) if backend.is_mixed(canonical) => left_out.push(LeftOut {
                    scene: scene.name.clone(),
                    sampler: canonical.clone(),
                    same_as: (*same_as).to_owned(),
                }),
                Some(_) => {}
                None => drop(done.insert(meaning, canonical)),
            }
        }
    }
    left_out
}

/// Reads one sampler; the message says where in the experiment it stands.
pub(super) fn read_sampler(text: &str, key: &str, experiment: &Experiment, backend: &dyn Backend) -> Result<String> {
    let place = |error: Error| Error { place: format!("{}: {key}: {}", experiment.place, error.place), ..error };
    backend.parse_sampler(text).map_err(place)
}

/// Reads the reference's sampler, which has to be independent of everything compared.
pub(super) fn read_reference_sampler(
    experiment: &Experiment,
    backend: &dyn Backend,
    samplers: &[PlannedSampler],
    scenes: &[SceneFacts],
) -> Result<PlannedSampler> {
    let text = &experiment.reference.sampler;
    let canonical = read_sampler(text, "reference.sampler", experiment, backend)?;
    let refuse = |what: String| Err(Error::input(format!("{}: reference.sampler", experiment.place), what));
    if let Some(compared) = samplers.iter().find(|sampler| sampler.canonical == canonical) {
        let names = compared.names.join(" and ");
        return refuse(format!(
            "expected a sampler that is not compared, found {text:?}, which is {names}: {canonical}"
        ));
    }
    // A set may be, for the decisions that one scene makes, what the reference is.
    let is_compared = |scene: &SceneFacts| {
        let meaning = |canonical: &str| backend.meaning(canonical, &scene.name);
        let is_set = |other: &str| backend.is_mixed(other) || backend.is_mixed(&canonical);
        samplers.iter().find(|s| is_set(&s.canonical) && meaning(&s.canonical) == meaning(&canonical))
    };
    if let Some((scene, compared)) = scenes.iter().find_map(|scene| Some((scene, is_compared(scene)?))) {
        return refuse(format!(
            "expected a sampler that is not compared, found {text:?}, which is the same as {} in {}",
            compared.names.join(" and "),
            scene.name
        ));
    }
    let is_fixed = |scene: &&SceneFacts| !scene.exact_reference && !backend.is_random(&canonical, Some(&scene.name));
    if let Some(scene) = scenes.iter().find(is_fixed) {
        return refuse(format!(
            "expected a sampler with something random in it, found {text:?}, which is {canonical}: both halves of {} would be one image",
            scene.name
        ));
    }
    Ok(PlannedSampler { canonical, names: vec![text.clone()] })
}

//! The samplers of an experiment: what they are called, what they do, how they look.

use crate::experiment::spec::{Experiment, SamplerEntry};
use crate::sampling::{Decision, Order, Points, Preset, Random, SamplerSet, SamplerSpec, Scope};

use super::super::style::{Style, style_of, style_of_set};

/// A sampler of the experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct SamplerSummary {
    /// Full form.
    pub canonical: String,
    /// What the experiment calls it.
    pub names: Vec<String>,
    /// What figures and tables call it: the one name, or the family where several presets are one sampler.
    pub label: String,
    /// What it does, decision by decision; `None` where this version cannot read its text.
    pub set: Option<SamplerSet>,
    /// Its look in every figure.
    pub style: Style,
}

impl SamplerSummary {
    /// What it does for every decision; `None` where decisions differ, or where this version cannot read its text.
    pub fn spec(&self) -> Option<SamplerSpec> {
        self.set.and_then(|set| set.single())
    }

    /// Whether `text` names it: as the experiment calls it, or by another text of the same meaning.
    pub fn is_meant_by(&self, text: &str) -> bool {
        let means = || SamplerSet::parse(text, Preset::Best).is_ok_and(|set| set.to_string() == self.canonical);
        self.names.iter().any(|name| name == text) || means()
    }

    /// Whether it is a set of different samplers for different decisions.
    pub fn is_mixed(&self) -> bool {
        self.set.is_some_and(|set| set.single().is_none())
    }

    /// Why nothing promises that its image becomes the right one in a scene with `decisions`, however small the bias that is
    /// seen; `None` where its construction does, or where it cannot be read.
    ///
    /// Uniform numbers are independent in any order. Of other sets two decisions that read the same points in the same order
    /// never see most combinations; without a randomisation, or with one that leaves an axis as it is, there is no average
    /// over images that is right by construction.
    pub fn unproven(&self, decisions: &[Decision]) -> Option<&'static str> {
        let set = self.set?;
        let specs: Vec<SamplerSpec> = decisions.iter().map(|&decision| set.of(decision)).collect();
        let is_set = |spec: &&SamplerSpec| spec.points != Points::Uniform;
        if specs.iter().filter(is_set).filter(|spec| spec.order == Order::Step).count() > 1 {
            return Some("decisions in step");
        }
        let leaves_an_axis = |spec: &SamplerSpec| spec.random == Random::Yxor && spec.order != Order::Shuffle;
        let mut specs = specs.iter().filter(is_set);
        let found = specs.find(|spec| !spec.is_random() || leaves_an_axis(spec))?;
        Some(if found.is_random() { "an axis that is not randomised" } else { "nothing random" })
    }

    /// Whether each pixel sees the same points, or one axis of them, in some decision, so that neighbours may err alike.
    pub fn repeats_in_every_pixel(&self) -> bool {
        let repeats = |spec: SamplerSpec| {
            let is_shared = matches!(spec.scope, Scope::Image | Scope::Decision);
            // Hammersley's x = i/n is untouched by a shift of y; a shuffle of the indices mixes it anew.
            let has_fixed_axis = spec.random == Random::Yxor && spec.order == Order::Step;
            !spec.is_random() || is_shared || has_fixed_axis
        };
        self.set.is_some_and(|set| Decision::ALL.iter().any(|&decision| repeats(set.of(decision))))
    }
}

/// The experiment's samplers, texts that mean the same one together.
pub(super) fn of(experiment: &Experiment) -> Vec<SamplerSummary> {
    let mut samplers: Vec<SamplerSummary> = Vec::new();
    for entry in &experiment.samplers {
        let (text, name) = (entry.text(), entry.name().to_owned());
        let set = SamplerSet::parse(&text, Preset::Best).ok();
        let canonical = set.map_or(text, |set| set.to_string());
        match samplers.iter_mut().find(|known| known.canonical == canonical) {
            Some(known) => {
                known.names.push(name);
                known.label = label(&known.names);
            }
            None => {
                // A name of one's own is kept as it is.
                let label = if matches!(entry, SamplerEntry::Set { .. }) {
                    name.clone()
                } else {
                    label(std::slice::from_ref(&name))
                };
                let style = look(&label, set.as_ref());
                samplers.push(SamplerSummary { canonical, names: vec![name], label, set, style });
            }
        }
    }
    for sampler in &mut samplers {
        sampler.style = look(&sampler.label, sampler.set.as_ref());
    }
    samplers
}

/// How a sampler looks in figures: by its name, or by its decisions where they differ.
fn look(label: &str, set: Option<&SamplerSet>) -> Style {
    set.filter(|set| set.single().is_none()).map_or_else(|| style_of(label), style_of_set)
}

/// One name for a sampler of several: the part before the first colon, where they share it.
fn label(names: &[String]) -> String {
    let family = |name: &str| name.split(':').next().unwrap_or(name).to_owned();
    match names {
        [one] if one.contains(':') || one == "center" => one.clone(),
        // What a bare name stood for.
        [one] => format!("{one}:best"),
        _ if names.iter().all(|name| family(name) == family(&names[0])) => family(&names[0]),
        _ => names.join(" = "),
    }
}

//! What was made in another way than the compared images: the material of "Stability" and of "The sheet's shortcut".

use crate::experiment::results::{Estimator, Variant};
use crate::experiment::spec::Estimators;

use super::{Cell, Index, Summary};

/// One sampler in one scene whose stability is asked about.
#[derive(Debug, Clone, PartialEq)]
pub struct Subject {
    /// Index of the scene.
    pub scene: usize,
    /// Index of the sampler.
    pub sampler: usize,
    /// What all else is held against.
    pub base: Cell,
    /// Other counts of samples, plainly made.
    pub counts: Vec<Cell>,
    /// The base made in other ways.
    pub remade: Vec<(Variant, Cell)>,
}

impl Index<'_> {
    /// What the stability of each sampler is told by; subjects of which anything is missing are missing.
    pub(super) fn add_stability(&self, summary: &mut Summary) {
        let Some(stability) = summary.about.experiment.stability.clone() else { return };
        let (mut missing, mut expected) = (0, 0);
        for scene in 0..summary.scenes.len() {
            let name = summary.about.experiment.scenes.get(scene);
            if !name.is_some_and(|name| stability.scenes.contains(name)) {
                continue;
            }
            for sampler in summary.compared(scene).collect::<Vec<_>>() {
                let (s, p) = (&summary.scenes[scene], &summary.samplers[sampler]);
                if !stability.samplers.iter().any(|text| p.is_meant_by(text)) {
                    continue;
                }
                let cell = |asked: u32, variant: Variant| {
                    let row = self.ensemble(s, p, asked, self.primary, variant)?;
                    Some(self.cell(row, scene, sampler, s, p))
                };
                let subject = || {
                    let base = cell(stability.spp, Variant::Plain)?;
                    let counts = stability.counts().into_iter().map(|asked| cell(asked, Variant::Plain));
                    let remade = stability.variants().into_iter().map(|v| Some((v, cell(stability.spp, v)?)));
                    let (counts, remade) = (counts.collect::<Option<_>>()?, remade.collect::<Option<_>>()?);
                    Some(Subject { scene, sampler, base, counts, remade })
                };
                expected += 1;
                match subject() {
                    Some(subject) => summary.stability.push(subject),
                    None => missing += 1,
                }
            }
        }
        if missing > 0 {
            summary.missing.push(format!("the stability of {missing} of {expected} samplers in scenes"));
        }
    }

    /// The sheet's shortcut beside the unbiased estimator.
    pub(super) fn add_shortcut(&self, summary: &mut Summary) {
        if summary.about.experiment.estimator != Estimators::Both {
            return;
        }
        let (mut missing, mut expected) = (0, 0);
        for scene in (0..summary.scenes.len()).filter(|&scene| summary.about.scenes[scene].picks_lights()) {
            for sampler in 0..summary.samplers.len() {
                for &asked in &summary.about.experiment.spp {
                    let (s, p) = (&summary.scenes[scene], &summary.samplers[sampler]);
                    expected += 1;
                    match self.ensemble(s, p, asked, Estimator::Sheet, Variant::Plain) {
                        Some(row) => summary.shortcut.push(self.cell(row, scene, sampler, s, p)),
                        None => missing += 1,
                    }
                }
            }
        }
        if missing > 0 {
            summary.missing.push(format!("{missing} of {expected} comparisons of the sheet's shortcut"));
        }
    }
}

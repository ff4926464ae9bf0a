//! What a summary holds besides its cells: point sets, pictures, seconds, slopes.

use std::collections::HashMap;

use crate::experiment::results::{ImageRow, PointsRow, Rounds, SceneFacts, Stage, Timing};
use crate::experiment::spec::Pictures;
use crate::sampling::Decision;
use crate::stats::{Estimate, median_interval, slope_with_interval, t_interval};

use super::super::shots::{PictureSet, Shot};
use super::{Cell, Index, PointSet, SLOPE_COUNTS, Slope, Speed, Summary};

impl Index<'_> {
    /// Point-set metrics, means over replicates.
    pub(super) fn add_points(&self, summary: &mut Summary) {
        let Some(points) = summary.about.experiment.points.clone() else { return };
        let (mut missing, mut expected) = (0, 0);
        for sampler in (0..summary.samplers.len()).filter(|&i| !summary.samplers[i].is_mixed()).collect::<Vec<_>>() {
            for &n in &points.n {
                let p = &summary.samplers[sampler];
                expected += 1;
                let Some(sets) = self.points.get(&(p.canonical.as_str(), n)) else {
                    missing += 1;
                    continue;
                };
                let is_fixed = p.spec().is_some_and(|spec| !spec.is_random());
                let of_metric = |metric: &String| point_set(sampler, metric, sets, is_fixed);
                summary.point_sets.extend(points.metrics.iter().map(of_metric));
            }
        }
        if missing > 0 {
            summary.missing.push(format!("{missing} of {expected} point sets"));
        }
    }

    /// Pictures by scene, sampler and count, what they were compared with, and the stages beside them.
    pub(super) fn add_pictures(&self, summary: &mut Summary, timings: &[Timing]) {
        let times: HashMap<&str, &Timing> = timings.iter().map(|timing| (timing.id.as_str(), timing)).collect();
        let (mut pictures, mut stages) = ([0, 0], [0, 0]);
        for asked in &summary.about.experiment.pictures {
            let Some(scene) = summary.about.experiment.scenes.iter().position(|name| *name == asked.scene) else {
                continue;
            };
            let Some(facts) = summary.about.scenes.get(scene) else { continue };
            let set = self.picture_set(summary, asked, scene, facts, &times);
            pictures = [pictures[0] + set.shots.len(), pictures[1] + summary.compared(scene).count() * asked.spp.len()];
            stages = [stages[0] + set.stages.len(), stages[1] + set.stages_planned()];
            summary.pictured.push(set);
        }
        for ([found, planned], word) in [(pictures, "pictures"), (stages, "stages of Figure 1")] {
            if found < planned {
                summary.missing.push(format!("{} of {planned} {word}", planned - found));
            }
        }
    }

    /// The pictures of one scene.
    fn picture_set(
        &self,
        summary: &Summary,
        asked: &Pictures,
        scene: usize,
        facts: &SceneFacts,
        times: &HashMap<&str, &Timing>,
    ) -> PictureSet {
        let ours = |row: &&&ImageRow| row.scene == facts.name && row.size == asked.size;
        let find = |sampler: usize, spp: u32| -> Option<Shot> {
            let canonical = &summary.samplers[sampler].canonical;
            let is_it = |row: &&&ImageRow| row.sampler == *canonical && row.spp.asked == spp;
            let row = self.pictures.iter().filter(ours).rfind(is_it)?;
            let time = times.get(row.id.as_str());
            Some(Shot {
                sampler,
                row: (*row).clone(),
                seconds: time.map(|time| time.seconds),
                threads_and_load: time.and_then(|time| Some((time.threads, time.load?))),
            })
        };
        let wanted = summary.compared(scene).flat_map(|sampler| asked.spp.iter().map(move |&spp| (sampler, spp)));
        let shots: Vec<Shot> = wanted.filter_map(|(sampler, spp)| find(sampler, spp)).collect();
        let stage = |stage: &Stage| self.stages.iter().filter(ours).rfind(|row| row.stage == *stage).copied().cloned();
        let id = shots.iter().find_map(|shot| shot.row.errors.as_ref()).map(|errors| errors.reference_id.as_str());
        PictureSet {
            scene,
            pictures: asked.clone(),
            exposure: facts.exposure,
            has_lens: facts.lens,
            has_lights: facts.layout.contains(Decision::LightPoint.name()),
            reference: id.and_then(|id| self.references.get(id)).map(|&row| row.clone()),
            stages: Stage::ALL.iter().filter_map(stage).collect(),
            shots,
        }
    }

    /// Seconds of the images of each cell; of an image that was timed twice the last time counts.
    pub(super) fn add_speeds(&self, summary: &mut Summary, timings: &[Timing]) {
        let by_id: HashMap<&str, &Timing> = timings.iter().map(|timing| (timing.id.as_str(), timing)).collect();
        for cell in &summary.cells {
            let (s, p) = (&summary.scenes[cell.scene], &summary.samplers[cell.sampler]);
            let members = self.plain(s, p, cell.spp.asked).into_iter().flat_map(|row| &row.members);
            let timed: Vec<&Timing> = members.filter_map(|id| by_id.get(id.as_str()).copied()).collect();
            summary.speeds.extend(speed(cell, &timed));
        }
    }
}

/// The seconds of one cell's images: of the rounds, where one of them was made again in rounds.
fn speed(cell: &Cell, timed: &[&Timing]) -> Option<Speed> {
    let Cell { scene, sampler, spp, .. } = *cell;
    let rounds = timed.iter().find_map(|timing| timing.again.as_ref()).filter(|again| !again.seconds.is_empty());
    let (all, threads, sampling) = match rounds {
        Some(again) => (again.seconds.clone(), again.threads, sampling_share(again)),
        None => {
            let threads = timed.iter().map(|timing| timing.threads).max().unwrap_or(1);
            (timed.iter().map(|timing| timing.seconds).collect(), threads, None)
        }
    };
    let seconds = median_interval(&all, 0.95)?;
    Some(Speed { scene, sampler, spp, seconds, timings: all.len(), is_in_rounds: rounds.is_some(), threads, sampling })
}

/// Seconds of the numbers over those of the image, round by round, so that what slows a round slows both.
fn sampling_share(again: &Rounds) -> Option<Estimate> {
    if again.numbers.len() != again.seconds.len() || again.seconds.iter().any(|&seconds| seconds <= 0.0) {
        return None;
    }
    let shares: Vec<f64> = again.numbers.iter().zip(&again.seconds).map(|(numbers, all)| numbers / all).collect();
    median_interval(&shares, 0.95)
}

fn point_set(sampler: usize, metric: &str, sets: &[&PointsRow], is_fixed: bool) -> PointSet {
    let values: Vec<Option<f64>> = sets.iter().map(|row| row.metrics.get(metric).copied().flatten()).collect();
    let all: Option<Vec<f64>> = values.iter().copied().collect();
    let mean = all.filter(|all| !all.is_empty()).map(|all| match is_fixed {
        true => Estimate { value: all[0], ci95: Some([all[0]; 2]) },
        false => t_interval(&all, 0.95),
    });
    let (n, id) = (sets[0].n, sets[0].id.clone());
    PointSet { sampler, n, metric: metric.to_owned(), mean, values, id }
}

/// Slopes of RMSE, by scene and sampler.
pub(super) fn add_slopes(summary: &mut Summary) {
    let seed = summary.about.experiment.seed;
    for scene in 0..summary.scenes.len() {
        for sampler in summary.compared(scene).collect::<Vec<_>>() {
            let cells = summary.cells_of(scene, sampler);
            let is_usable = |cell: &&&Cell| {
                SLOPE_COUNTS.contains(&cell.spp.asked)
                    && cell.spp.asked.is_power_of_two()
                    && cell.spp.taken == cell.spp.asked
                    && !cell.is_reference_limited
                    && cell.replicate_mse.len() == cell.replicates as usize
            };
            let cells: Vec<&Cell> = cells.iter().filter(is_usable).copied().collect();
            let ns: Vec<f64> = cells.iter().map(|cell| f64::from(cell.spp.taken)).collect();
            let mse: Vec<Vec<f64>> = cells.iter().map(|cell| cell.replicate_mse.clone()).collect();
            let counts = cells.iter().map(|cell| cell.spp.taken).collect();
            let fit = slope_with_interval(&ns, &mse, seed);
            summary.slopes.push(Slope { scene, sampler, counts, fit });
        }
    }
}

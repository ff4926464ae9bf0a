//! The pictures of one scene: which there are, and at which count each sampler is shown.

use crate::experiment::results::{ImageRow, ReferenceRow, Stage};
use crate::experiment::spec::Pictures;

use super::evidence::interpolated;
use super::summarise::Summary;

/// How far above the budget a picture's seconds may be that stands for equal time.
pub const OVER_BUDGET: f64 = 0.1;

/// What an experiment shows of one scene.
#[derive(Debug, Clone, PartialEq)]
pub struct PictureSet {
    /// Index of the scene.
    pub scene: usize,
    /// What was asked for.
    pub pictures: Pictures,
    /// The scene's own exposure.
    pub exposure: f32,
    /// Whether the scene has a lens to sample.
    pub has_lens: bool,
    /// Whether the scene has a light to sample.
    pub has_lights: bool,
    /// What the pictures are compared with.
    pub reference: Option<ReferenceRow>,
    /// The stages of the sheet's Figure 1, in its order.
    pub stages: Vec<ImageRow>,
    /// The pictures, by sampler and count.
    pub shots: Vec<Shot>,
}

/// One picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Shot {
    /// Index of the sampler.
    pub sampler: usize,
    /// Its row.
    pub row: ImageRow,
    /// Seconds that it took, where it was timed.
    pub seconds: Option<f64>,
    /// Threads that worked, and the machine's load average of the minute before, where that is known.
    pub threads_and_load: Option<(usize, f64)>,
}

/// Pictures of about equal cost.
#[derive(Debug, Clone, PartialEq)]
pub struct EqualTime<'a> {
    /// Seconds of uniform sampling at the count of the comparison at equal samples.
    pub budget: f64,
    /// One picture a sampler, in the order of the samplers.
    pub choices: Vec<Choice<'a>>,
    /// Samplers whose every picture was dearer than the budget allows.
    pub too_dear: Vec<usize>,
}

/// The picture that stands for a sampler at equal time.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice<'a> {
    /// The picture.
    pub shot: &'a Shot,
    /// Its seconds, see [`expected_seconds`].
    pub seconds: f64,
    /// Whether the ladder of counts ends here although the budget would allow more: no dearer picture was made, and this
    /// one stays more than [`OVER_BUDGET`] below it.
    pub is_last_rung: bool,
}

/// Seconds that a picture takes, by the replicates of the statistics rather than by its own one timing, which other work on the
/// machine may have doubled: the median seconds of the same scene and sampler, between their counts on a straight line of
/// logarithms, times the ratio of the pixels.
///
/// `None` where those were not timed, or the picture's count lies outside theirs.
pub fn expected_seconds(summary: &Summary, set: &PictureSet, shot: &Shot) -> Option<f64> {
    let of_sampler = summary.speeds.iter().filter(|speed| (speed.scene, speed.sampler) == (set.scene, shot.sampler));
    let mut medians: Vec<_> = of_sampler.map(|speed| (f64::from(speed.spp.taken), speed.seconds)).collect();
    medians.sort_by(|a, b| a.0.total_cmp(&b.0));
    medians.dedup_by(|a, b| a.0 == b.0);
    let pixels = set.pictures.size.pixels() as f64 / summary.scenes[set.scene].pixels as f64;
    Some(interpolated(&medians, f64::from(shot.row.spp.taken))?.value * pixels)
}

/// The pictures of a set at equal time, by [`expected_seconds`].
pub fn equal_time<'a>(summary: &Summary, set: &'a PictureSet) -> Option<EqualTime<'a>> {
    set.at_equal_time(summary.uniform()?, |shot| expected_seconds(summary, set, shot))
}

impl EqualTime<'_> {
    /// Whether the machine had other work while the pictures were made. The threads at work make the load average their number;
    /// one more is somebody else's.
    pub fn is_loaded(&self) -> bool {
        self.load().is_some_and(|([_, high], threads)| high > threads as f64 + 1.0)
    }

    /// The range of the load averages, and the threads, of the pictures that are shown; `None` where no load is known.
    pub fn load(&self) -> Option<([f64; 2], usize)> {
        let known: Vec<(usize, f64)> = self.choices.iter().filter_map(|choice| choice.shot.threads_and_load).collect();
        let threads = known.iter().map(|(threads, _)| *threads).max()?;
        let (low, high) = known.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), &(_, load)| (l.min(load), h.max(load)));
        Some(([low, high], threads))
    }
}

impl PictureSet {
    /// How many stages there are: four, or three where the scene has no lens to sample.
    pub fn stages_planned(&self) -> usize {
        if self.has_lens { 4 } else { 3 }
    }

    /// The stages that add something: without lights the last one is as the one before.
    pub fn stages_shown(&self) -> Vec<&ImageRow> {
        self.stages.iter().filter(|row| self.has_lights || row.stage != Stage::Final).collect()
    }

    /// The picture of a sampler at a count asked for.
    pub fn shot(&self, sampler: usize, asked: u32) -> Option<&Shot> {
        self.shots.iter().find(|shot| shot.sampler == sampler && shot.row.spp.asked == asked)
    }

    /// The pictures at equal samples.
    pub fn at_equal_spp(&self) -> Vec<&Shot> {
        let asked = self.pictures.equal_spp();
        self.shots.iter().filter(|shot| shot.row.spp.asked == asked).collect()
    }

    /// For each sampler the picture whose seconds come nearest (as a ratio) to those of `uniform` at the count of the
    /// comparison at equal samples, and are no more than [`OVER_BUDGET`] above them. `None` where there is but one count,
    /// or where the seconds of that picture are not known.
    pub fn at_equal_time(&self, uniform: usize, seconds: impl Fn(&Shot) -> Option<f64>) -> Option<EqualTime<'_>> {
        let seconds = |shot: &Shot| seconds(shot).filter(|&seconds| seconds > 0.0);
        let budget = seconds(self.shot(uniform, self.pictures.equal_spp())?)?;
        if self.pictures.spp.len() < 2 {
            return None;
        }
        let mut samplers: Vec<usize> = self.shots.iter().map(|shot| shot.sampler).collect();
        samplers.dedup();
        let mut found = EqualTime { budget, choices: Vec::new(), too_dear: Vec::new() };
        for sampler in samplers {
            let rungs = self.shots.iter().filter(|shot| shot.sampler == sampler);
            let timed: Vec<(&Shot, f64)> = rungs.filter_map(|shot| Some((shot, seconds(shot)?))).collect();
            let most = timed.iter().map(|(shot, _)| shot.row.spp.taken).max();
            let far = |seconds: f64| libm::fabs(libm::log(seconds / budget));
            let affordable = timed.iter().filter(|(_, seconds)| *seconds <= budget * (1.0 + OVER_BUDGET));
            match affordable.min_by(|a, b| far(a.1).total_cmp(&far(b.1))) {
                Some(&(shot, seconds)) => {
                    let is_last_rung = Some(shot.row.spp.taken) == most && seconds < budget * (1.0 - OVER_BUDGET);
                    found.choices.push(Choice { shot, seconds, is_last_rung });
                }
                None if timed.is_empty() => {}
                None => found.too_dear.push(sampler),
            }
        }
        Some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::results::{Count, Estimator, Kind, SCHEMA, Size, Variant};

    /// Two samplers at 8, 16 and 32 spp; `seconds` by sampler and count.
    fn set(seconds: [[f64; 3]; 2]) -> PictureSet {
        let size = Size { width: 8, height: 8 };
        let spp = vec![8, 16, 32];
        let shot = |sampler: usize, i: usize| Shot {
            sampler,
            seconds: Some(seconds[sampler][i]).filter(|s| s.is_finite()),
            threads_and_load: Some((2, f64::from(spp[i]))),
            row: ImageRow {
                schema: SCHEMA,
                made_with: None,
                id: format!("{sampler}-{i}"),
                kind: Kind::Picture,
                scene: "a".to_owned(),
                sampler: sampler.to_string(),
                names: Vec::new(),
                spp: Count { asked: spp[i], taken: spp[i] },
                replicate: 0,
                batch: 0,
                seed: 0,
                estimator: Estimator::Unbiased,
                stage: Stage::Final,
                size,
                mean: 0.5,
                pixels: String::new(),
                errors: None,
                variant: Variant::Plain,
                twin: None,
            },
        };
        let shots = (0..2).flat_map(|sampler| (0..3).map(move |i| (sampler, i))).map(|(s, i)| shot(s, i)).collect();
        let pictures = Pictures { scene: "a".to_owned(), size, spp: spp.clone(), reference_spp: 64 };
        PictureSet {
            scene: 0,
            pictures,
            exposure: 3.0,
            has_lens: true,
            has_lights: true,
            reference: None,
            stages: Vec::new(),
            shots,
        }
    }

    fn chosen(set: &PictureSet) -> Vec<(u32, bool)> {
        let found = set.at_equal_time(0, |shot| shot.seconds).unwrap();
        found.choices.iter().map(|choice| (choice.shot.row.spp.asked, choice.is_last_rung)).collect()
    }

    #[test]
    fn equal_time_takes_the_count_nearest_to_the_budget_but_not_far_above_it() {
        assert_eq!(chosen(&set([[0.5, 1.0, 2.0], [0.45, 0.9, 1.8]])), [(16, false), (16, false)]);
        assert_eq!(
            chosen(&set([[0.5, 1.0, 2.0], [0.6, 1.09, 2.4]])),
            [(16, false), (16, false)],
            "9 % above is near enough"
        );
        assert_eq!(chosen(&set([[0.5, 1.0, 2.0], [0.6, 1.11, 2.4]])), [(16, false), (8, false)], "11 % above is not");
    }

    #[test]
    fn a_ladder_that_does_not_reach_the_budget_says_so() {
        assert_eq!(chosen(&set([[0.5, 1.0, 2.0], [0.1, 0.2, 0.4]])), [(16, false), (32, true)]);
        let dear = set([[0.5, 1.0, 2.0], [2.0, 4.0, 8.0]]);
        assert_eq!(dear.at_equal_time(0, |shot| shot.seconds).unwrap().too_dear, [1]);
        assert_eq!(chosen(&dear), [(16, false)]);
        assert_eq!(dear.at_equal_time(0, |shot| shot.seconds).unwrap().load(), Some(([16.0; 2], 2)));
    }

    #[test]
    fn a_load_above_the_threads_at_work_is_other_work() {
        let mut set = set([[0.5, 1.0, 2.0], [0.5, 1.0, 2.0]]);
        let is_loaded = |set: &PictureSet| set.at_equal_time(0, |shot| shot.seconds).unwrap().is_loaded();
        assert!(is_loaded(&set), "a load of 16 on 2 threads");
        set.shots.iter_mut().for_each(|shot| shot.threads_and_load = Some((2, 2.9)));
        assert!(!is_loaded(&set));
        set.shots.iter_mut().for_each(|shot| shot.threads_and_load = None);
        assert!(!is_loaded(&set), "not known");
    }

    #[test]
    fn without_a_ladder_or_a_timing_of_uniform_nothing_is_shown_at_equal_time() {
        let untimed = set([[0.5, f64::NAN, 2.0], [0.5, 1.0, 2.0]]);
        assert_eq!(untimed.at_equal_time(0, |shot| shot.seconds), None);
        let mut single = set([[0.5, 1.0, 2.0], [0.5, 1.0, 2.0]]);
        single.pictures.spp = vec![16];
        assert_eq!(single.at_equal_time(0, |shot| shot.seconds), None);
    }
}

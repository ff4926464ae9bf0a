//! The picture of one sampler on its budget.

use std::time::Instant;

use super::speed::Speed;
use crate::error::Result;
use crate::render::{Growing, NonFinite, Pass};
use crate::sampling::{MAX_SAMPLES, PointSource, Sampler, SamplerSet};
use crate::scene::compile::Scene;

/// What a picture may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Budget {
    /// So many samples a pixel.
    Samples(u32),
    /// So many seconds of rendering. A set belongs to its count, so the count is chosen first, by what a few samples take.
    Seconds(f64),
}

/// Where a picture of seconds is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    /// What a sample takes is found out, with a sampler of some count.
    Timing,
    /// The picture itself.
    Final,
}

/// One sampler's picture.
pub struct Side {
    /// Its samplers.
    pub set: SamplerSet,
    seed: u64,
    budget: Budget,
    /// Numbers for the count of this phase.
    pub sampler: Sampler,
    /// The picture so far.
    pub growing: Growing,
    /// Seconds of rendering that are in it, and how many samples of pixels these took.
    pub seconds: f64,
    traced: u64,
    phase: Phase,
}

/// Whether there is more to be seen, or a sample that is no number.
pub type Traced = std::result::Result<bool, NonFinite>;

impl Side {
    /// A picture that has not begun, in the memory of an `old` one. `asked` samples a pixel are those of the scene file.
    ///
    /// # Errors
    /// Those of [`Sampler::new`].
    pub fn new(
        set: SamplerSet,
        seed: u64,
        budget: Budget,
        asked: u32,
        scene: &Scene,
        old: Option<Self>,
    ) -> Result<Self> {
        let (asked, phase) = match budget {
            Budget::Samples(n) => (n, Phase::Final),
            Budget::Seconds(_) => (asked, Phase::Timing),
        };
        let sampler = Sampler::new(set, &scene.layout, asked, seed)?;
        let mut growing = old.map_or_else(|| Growing::new(scene.camera.size()), |old| old.growing);
        growing.clear(scene.camera.size());
        Ok(Self { set, seed, budget, sampler, growing, seconds: 0.0, traced: 0, phase })
    }

    /// Whether every sample is there.
    pub fn is_finished(&self) -> bool {
        self.phase == Phase::Final && self.growing.samples() >= self.sampler.samples()
    }

    /// Whether its count is final: not while it is found out.
    pub fn is_timing(&self) -> bool {
        self.phase == Phase::Timing
    }

    /// Traces the first sample of one pixel in each block.
    ///
    /// # Errors
    /// A sample that is no number.
    pub fn first(&mut self, scene: &Scene, block: u32, speed: &mut Speed, go_on: &(dyn Fn() -> bool + Sync)) -> Traced {
        let started = Instant::now();
        let pass = self.growing.begin(scene, &self.sampler, block, go_on)?;
        self.after(&pass, started, speed);
        Ok(pass.is_whole)
    }

    /// Adds the samples that fit into a pass.
    ///
    /// # Errors
    /// A sample that is no number.
    pub fn grow(&mut self, scene: &Scene, speed: &mut Speed, go_on: &(dyn Fn() -> bool + Sync)) -> Traced {
        let (w, h) = scene.camera.size();
        let pixels = u64::from(w) * u64::from(h);
        let done = self.growing.samples();
        let to = done.saturating_add(speed.samples_of_a_pass(pixels)).min(self.sampler.samples());
        let started = Instant::now();
        let pass = self.growing.add(scene, &self.sampler, to, go_on)?;
        self.after(&pass, started, speed);
        Ok(pass.samples > 0)
    }

    fn after(&mut self, pass: &Pass, started: Instant, speed: &mut Speed) {
        let took = started.elapsed();
        self.seconds += took.as_secs_f64();
        self.traced += pass.samples;
        speed.traced(pass.samples, pass.rays, took);
    }

    /// Chooses the count of a budget of seconds, once enough is known; the picture then begins anew with a sampler of that count.
    ///
    /// # Errors
    /// Those of [`Sampler::new`].
    pub fn choose_count(&mut self, scene: &Scene) -> Result<()> {
        let (Budget::Seconds(budget), Phase::Timing) = (self.budget, self.phase) else { return Ok(()) };
        let done = self.growing.samples();
        let (w, h) = self.growing.size();
        let knows = done >= 2 && (self.seconds >= (budget / 4.0).min(0.3) || done >= self.sampler.samples());
        if !knows && done < self.sampler.samples() {
            return Ok(());
        }
        let per_pixel = self.traced.max(1) as f64 / (f64::from(w) * f64::from(h));
        let most = (budget / self.seconds.max(1e-9) * per_pixel).clamp(1.0, f64::from(MAX_SAMPLES)) as u32;
        // The largest count that is not above what fits: sets of strata take others than asked.
        let fits = |asked: &u32| self.set.taken(*asked, &scene.layout) <= most;
        let asked = (1..=most).rev().take(1000).find(fits).unwrap_or(1);
        self.sampler = Sampler::new(self.set, &scene.layout, asked, self.seed)?;
        self.growing.clear(scene.camera.size());
        (self.seconds, self.traced) = (0.0, 0);
        self.phase = Phase::Final;
        Ok(())
    }

    /// Seconds until it is finished, as fast as it went so far.
    pub fn seconds_left(&self, samples_per_second: f64) -> f64 {
        let (w, h) = self.growing.size();
        let left = self.sampler.samples() - self.growing.samples();
        f64::from(left) * f64::from(w) * f64::from(h) / samples_per_second.max(1.0)
    }
}

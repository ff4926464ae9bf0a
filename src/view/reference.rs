//! The truth as far as it is known: two independent pictures of a good sampler that grow while nothing else has to be done.

use super::side::{Budget, Side, Traced};
use super::speed::Speed;
use crate::error::Result;
use crate::film::Image;
use crate::sampling::hash::derive;
use crate::sampling::{Preset, SamplerSet};
use crate::scene::compile::Scene;
use crate::scene::config::Estimator;

/// Samples a pixel of each half at the most.
const MOST: u32 = 4096;

/// What seeds of references come from, so that they are no picture's.
const SEED: u64 = 0x7265_6665_7265_6e63;

/// Two halves; their difference tells the noise of both.
pub struct Reference {
    halves: [Side; 2],
}

impl Reference {
    /// Nothing known yet, in the memory of an `old` one.
    ///
    /// # Errors
    /// None that a scene can bring about: the sampler serves every layout.
    pub fn new(scene: &Scene, old: Option<Self>) -> Result<Self> {
        let set = SamplerSet::parse("sobol:joint:owen@each", Preset::Best)?;
        let half = |n: u64, old| Side::new(set, derive(SEED, &[n]), Budget::Samples(MOST), MOST, scene, old);
        let [a, b] = old.map_or([None, None], |old| old.halves.map(Some));
        Ok(Self { halves: [half(0, a)?, half(1, b)?] })
    }

    /// Columns and rows.
    pub fn size(&self) -> (u32, u32) {
        self.halves[0].growing.size()
    }

    /// Samples a pixel that both halves have.
    pub fn samples(&self) -> u32 {
        self.halves[0].growing.samples().min(self.halves[1].growing.samples())
    }

    /// Whether it is as good as it gets.
    pub fn is_finished(&self) -> bool {
        self.halves.iter().all(Side::is_finished)
    }

    /// Adds a pass to the half that is behind, with the estimator that is right.
    ///
    /// # Errors
    /// A sample that is no number.
    pub fn grow(&mut self, scene: &mut Scene, speed: &mut Speed, go_on: &(dyn Fn() -> bool + Sync)) -> Traced {
        let [a, b] = &mut self.halves;
        let half = if a.growing.samples() <= b.growing.samples() { a } else { b };
        let estimator = std::mem::replace(&mut scene.estimator, Estimator::Unbiased);
        let step = match half.growing.samples() {
            0 => half.first(scene, 1, speed, go_on),
            _ => half.grow(scene, speed, go_on),
        };
        scene.estimator = estimator;
        step
    }

    /// Both halves, once each has a sample.
    pub fn images(&self) -> Option<[Image; 2]> {
        (self.samples() > 0).then(|| [&self.halves[0], &self.halves[1]].map(|half| half.growing.image()))
    }

    /// The mean of both, weighted by their samples.
    pub fn image(&self) -> Option<Image> {
        let [mut a, b] = self.images()?;
        let [na, nb] = [&self.halves[0], &self.halves[1]].map(|half| f64::from(half.growing.samples()));
        for (a, b) in a.pixels.as_flattened_mut().iter_mut().zip(b.pixels.as_flattened()) {
            *a = ((na * f64::from(*a) + nb * f64::from(*b)) / (na + nb)) as f32;
        }
        Some(a)
    }

    /// A pixel of that mean.
    pub fn pixel(&self, x: u32, y: u32) -> Option<[f32; 3]> {
        let [a, b] = [&self.halves[0].growing, &self.halves[1].growing];
        let (na, nb) = (f64::from(a.samples()), f64::from(b.samples()));
        let (ma, mb) = (a.mean(x, y), b.mean(x, y));
        let mean = |c: usize| ((na * f64::from(ma[c]) + nb * f64::from(mb[c])) / (na + nb)) as f32;
        (self.samples() > 0).then(|| [mean(0), mean(1), mean(2)])
    }
}

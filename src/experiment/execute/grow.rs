//! References that grow: how many batches one wants.

use std::sync::Arc;

use super::{ReferenceImages, Run, State, survey};
use crate::error::{ErrorKind, Result};
use crate::experiment::growth::{self, Growth, Sums};
use crate::experiment::plan::{GrowthWork, WorkItem};
use crate::film::Image;
use crate::stats::Estimate;

/// A reference on its way.
pub(super) struct Growing {
    /// Its id.
    id: String,
    /// Batches known to be wanted of each half.
    wanted: u32,
    /// The batches looked at so far.
    sums: Sums,
    /// The end of the way.
    settled: Option<Grown>,
}

/// A reference that grew to its end.
#[derive(Clone)]
pub(super) struct Grown {
    /// Its halves.
    pub images: Arc<ReferenceImages>,
    /// Mean square error of their mean.
    pub noise_mse: f64,
    /// How far it grew.
    pub growth: Growth,
}

impl Run<'_> {
    /// Whether an item is to be done, as far as that is known without rendering anything.
    pub(super) fn may_be_wanted(&self, position: usize) -> bool {
        match self.states[position] {
            State::Done => false,
            State::Optional => self.known_batches(&self.plan.items[position]).is_none(),
            State::Missing | State::ImageMissing => true,
        }
    }

    /// Whether an item is to be done. For a further batch of a reference, lets that reference grow until it is known; a
    /// batch whose row is there already is counted as found.
    ///
    /// # Errors
    /// Kinds `Write` and `Interrupted`. What keeps a reference from growing is the failure of the reference's own item.
    pub(super) fn is_wanted(&mut self, position: usize) -> Result<bool> {
        let plan = self.plan;
        let item = &plan.items[position];
        let Some(batch) = item.batch().filter(|_| self.states[position] == State::Optional) else { return Ok(true) };
        match self.grow(&batch.reference_id, Some(batch.number)) {
            Err(error) if matches!(error.kind, ErrorKind::Write | ErrorKind::Interrupted) => return Err(error),
            Err(_) => return Ok(false),
            Ok(growing) if growing.wanted <= batch.number => return Ok(false),
            Ok(_) => self.meter.expect_item(),
        }
        self.states[position] = survey::state(item, self.rows.get(&item.id), self.out);
        if self.states[position] == State::Done {
            self.meter.add_item();
        }
        Ok(self.states[position] != State::Done)
    }

    /// How far the reference of a further batch grew, where its row says so.
    fn known_batches(&self, item: &WorkItem) -> Option<u32> {
        item.batch().and_then(|batch| survey::batches(self.plan, &self.rows, &batch.reference_id))
    }

    /// A reference grown to its end, and how far that is.
    pub(super) fn grown(&mut self, id: &str) -> Result<Grown> {
        let growing = self.grow(id, None)?;
        Ok(growing.settled.clone().expect("without a number to stop at, it ends settled"))
    }

    /// The images of a reference that grows: as far as its row says, else to its end.
    pub(super) fn grown_images(&mut self, id: &str) -> Result<Arc<ReferenceImages>> {
        let plan = self.plan;
        match (survey::batches(plan, &self.rows, id), plan.growth(id), &self.growing) {
            (_, _, Some(Growing { id: at_hand, settled: Some(grown), .. })) if at_hand == id => {
                Ok(grown.images.clone())
            }
            (Some(known), Some(work), _) => {
                let mut sums = self.nothing_yet(work)?;
                self.add_batches(&mut sums, work, known)?;
                self.halves_of(&sums, work)
            }
            _ => self.grown(id).map(|grown| grown.images),
        }
    }

    /// Lets a reference grow until it is settled or known to want more batches than `beyond`, by the rule of
    /// [`growth`].
    fn grow(&mut self, id: &str, beyond: Option<u32>) -> Result<&Growing> {
        let plan = self.plan;
        let work = plan.growth(id).expect("only what may grow is asked to");
        let at_hand = self.growing.take().filter(|growing| growing.id == id);
        let mut growing = match at_hand {
            Some(growing) => growing,
            None => Growing { id: id.to_owned(), wanted: 1, sums: self.nothing_yet(work)?, settled: None },
        };
        while growing.settled.is_none() && beyond.is_none_or(|number| growing.wanted <= number) {
            self.add_batches(&mut growing.sums, work, growing.wanted)?;
            let images = self.halves_of(&growing.sums, work)?;
            let noise = growing.sums.noise_mse();
            let growth = self.judge(&images, noise, work, growing.wanted)?;
            if !growth.is_limited || growing.wanted == growth.most_batches {
                growing.settled = Some(Grown { images, noise_mse: noise.value, growth });
            } else {
                growing.wanted *= 2;
            }
        }
        Ok(self.growing.insert(growing))
    }

    /// What a reference of so many batches and this mean square of its noise finds of the pilots.
    fn judge(
        &mut self,
        images: &ReferenceImages,
        noise_mse: Estimate,
        work: &GrowthWork,
        batches: u32,
    ) -> Result<Growth> {
        let mut pilots = Vec::new();
        for id in &work.pilots {
            pilots.push((id.clone(), images.mse_of(&*self.image(id)?)));
        }
        let (pilot, pilot_mse) = growth::least(&pilots).clone();
        let noise = self.plan.experiment.reference.noise.expect("what grows has a bound");
        // Rounded as it is written, so that the row itself shows what was decided.
        let noise_mse_ci95 = noise_mse.ci95.expect("noise of batches has an interval");
        let is_limited = !growth::is_enough(noise_mse_ci95[1], pilot_mse, noise);
        let most_batches = work.batches[0].len() as u32;
        Ok(Growth { batches, most_batches, noise, noise_mse_ci95, pilot_mse, pilot, is_limited })
    }

    /// Sums of no batches.
    fn nothing_yet(&mut self, work: &GrowthWork) -> Result<Sums> {
        Ok(Sums::new(self.image(&work.batches[0][0])?.pixels.len()))
    }

    /// Adds batches up to `wanted` of each half. One is in memory at a time, so that memory does not grow with them.
    fn add_batches(&mut self, sums: &mut Sums, work: &GrowthWork, wanted: u32) -> Result<()> {
        for number in sums.batches()..wanted {
            let [a, b] = work.batches.each_ref().map(|half| half[number as usize].clone());
            let (first, second) = (self.image(&a)?, self.image(&b)?);
            sums.add([&first.pixels, &second.pixels]);
            self.images.release(&[a, b]);
        }
        Ok(())
    }

    /// The halves that the sums stand for.
    fn halves_of(&mut self, sums: &Sums, work: &GrowthWork) -> Result<Arc<ReferenceImages>> {
        let first = self.plan.position(&work.batches[0][0]).and_then(|at| self.plan.items[at].kept_image());
        let size = first.expect("a batch is an image of the plan");
        let image = |pixels| Arc::new(Image { width: size.width, height: size.height, pixels });
        Ok(Arc::new(ReferenceImages::new(sums.means().map(image))))
    }
}

//! The last thing a run does: it makes images again, for their seconds alone.

use std::ops::Range;
use std::sync::atomic::Ordering;
use std::time::Instant;

use super::{Failure, Run};
use crate::error::{Error, ErrorKind, Result};
use crate::experiment::identity::pixel_hash;
use crate::experiment::lines::line;
use crate::experiment::machine;
use crate::experiment::plan::WorkItem;
use crate::experiment::results::Rounds;

impl Run<'_> {
    /// Times every image that the experiment wants timed again, round by round; whether it was told to end. A line of timings
    /// holds all rounds of its image so far, and the last line of an image counts: what a kill leaves is gone on from.
    pub(super) fn time_again(&mut self, part: &Range<usize>) -> Result<bool> {
        let plan = self.plan;
        let Some(timing) = &plan.experiment.timing else { return Ok(false) };
        let items: Vec<&WorkItem> = plan.items[part.clone()].iter().filter(|item| plan.is_timed_again(item)).collect();
        for round in 0..timing.rounds as usize {
            for item in &items {
                if self.options.stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
                    return Ok(true);
                }
                match self.time_once_more(item, round) {
                    Ok(()) => {}
                    Err(error) if error.kind == ErrorKind::Interrupted => return Ok(true),
                    Err(error) if error.kind == ErrorKind::Write => return Err(error),
                    Err(error) => {
                        let label = format!("{}, timed again", item.label());
                        self.progress.warn(&format!("{label}: {error}"));
                        self.failures.push(Failure { id: item.id.clone(), label, error });
                    }
                }
            }
        }
        Ok(false)
    }

    /// One image in one round, where its line has not got that far yet. Another machine or number of threads begins anew.
    fn time_once_more(&mut self, item: &WorkItem, round: usize) -> Result<()> {
        let (host, threads) = (self.host.clone(), self.options.threads);
        let (Some(row), Some(timing)) = (self.rows.get(&item.id), self.timings.get(&item.id)) else { return Ok(()) };
        if timing.rounds_on(&host, threads) > round || self.failures.iter().any(|failure| failure.id == item.id) {
            return Ok(());
        }
        let (expected, mut timing) = (row.kept_pixels().map(str::to_owned), timing.clone());
        self.progress.item_started(&format!("{}, round {}", item.label(), round + 1), &self.meter.tick());
        let request = self.request(item).expect("only images are timed again");
        self.backend.prepare(&request)?;
        let load = machine::load();
        let started = Instant::now();
        let image = self.backend.render(&request)?;
        let seconds = started.elapsed().as_secs_f64();
        let found = pixel_hash(&image.pixels);
        if let Some(expected) = expected.filter(|expected| *expected != found) {
            let what = format!("expected the pixels of its row, {expected}, found {found}: one image, two makings");
            return Err(Error::incomplete(item.label(), what));
        }
        let started = Instant::now();
        let numbers = self.backend.draw_numbers(&request)?.then(|| started.elapsed().as_secs_f64());
        let known = timing.again.take().filter(|_| round > 0);
        let mut again = known.unwrap_or_else(|| Rounds { host, threads, ..Rounds::default() });
        again.seconds.push(seconds);
        again.numbers.extend(numbers);
        again.load.extend(load);
        timing.again = Some(again);
        self.timings_log.append(line(&timing))?;
        self.timings.insert(item.id.clone(), timing);
        self.meter.add_samples(item.samples());
        self.progress.item_ended(&self.meter.tick());
        Ok(())
    }
}

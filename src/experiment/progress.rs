//! How a run tells where it is; what shows it (a bar, a log) is not the library's business.

use std::time::Instant;

/// Where a run is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tick {
    /// Items done, those of earlier runs among them.
    pub items_done: usize,
    /// Items of the plan.
    pub items: usize,
    /// Samples rendered by this run.
    pub samples_done: u64,
    /// Samples that this run has to render.
    pub samples: u64,
    /// Samples per second of this run so far; 0 before the first.
    pub samples_per_second: f64,
    /// Seconds to go at that rate; `None` before the first sample.
    pub eta_seconds: Option<f64>,
}

/// Is told what happens; the methods are called in order, from one thread.
pub trait Progress {
    /// An item begins.
    fn item_started(&self, label: &str, tick: &Tick);
    /// An item is done or failed.
    fn item_ended(&self, tick: &Tick);
    /// Something a reader should know: an item failed, an image was made anew.
    fn warn(&self, message: &str);
}

/// Tells nobody.
pub struct Silent;

impl Progress for Silent {
    fn item_started(&self, _: &str, _: &Tick) {}
    fn item_ended(&self, _: &Tick) {}
    fn warn(&self, _: &str) {}
}

/// Counts what a run does.
pub(super) struct Meter {
    started: Instant,
    items_done: usize,
    items: usize,
    samples_done: u64,
    samples: u64,
}

impl Meter {
    /// Starts the clock.
    pub fn new(items_done: usize, items: usize, samples: u64) -> Self {
        Self { started: Instant::now(), items_done, items, samples_done: 0, samples }
    }

    /// An item was done.
    pub fn add_item(&mut self) {
        self.items_done += 1;
    }

    /// An item turned out to be wanted: a reference grows.
    pub fn expect_item(&mut self) {
        self.items += 1;
    }

    /// An image was rendered. An image that had to be made anew was not foreseen.
    pub fn add_samples(&mut self, samples: u64) {
        self.samples_done += samples;
        self.samples = self.samples.max(self.samples_done);
    }

    /// Now.
    pub fn tick(&self) -> Tick {
        at(self, self.started.elapsed().as_secs_f64())
    }
}

/// The tick after so many seconds.
fn at(meter: &Meter, seconds: f64) -> Tick {
    let &Meter { items_done, items, samples_done, samples, .. } = meter;
    let rate = if seconds > 0.0 { samples_done as f64 / seconds } else { 0.0 };
    let eta_seconds = (rate > 0.0).then(|| (samples - samples_done) as f64 / rate);
    Tick { items_done, items, samples_done, samples, samples_per_second: rate, eta_seconds }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rest_takes_as_long_as_its_samples_say() {
        let mut meter = Meter::new(3, 10, 100);
        assert_eq!(at(&meter, 2.0).eta_seconds, None);
        meter.add_samples(25);
        meter.add_item();
        let tick = at(&meter, 2.0);
        assert_eq!((tick.items_done, tick.samples_per_second, tick.eta_seconds), (4, 12.5, Some(6.0)));
        meter.add_samples(100);
        assert_eq!(at(&meter, 2.0).eta_seconds, Some(0.0));
    }
}

//! How fast it goes here, and so how much to take on at once: a picture has to come within tens of milliseconds of a change.

use std::time::Duration;

/// What the first picture after a change may take to render, seconds.
const FIRST_PICTURE: f64 = 0.025;

/// What it may take on its way to the page, seconds.
const FIRST_WAY: f64 = 0.035;

/// What a pass may take later, seconds: a change waits for none of it, but a new picture does.
const PASS: f64 = 0.06;

/// Rates that follow what was measured lately.
#[derive(Debug, Clone, Copy)]
pub struct Speed {
    samples: f64,
    rays: f64,
    seconds: f64,
    bytes_per_second: f64,
}

impl Default for Speed {
    /// A guess until something is measured: slow, so that the first picture is small rather than late.
    fn default() -> Self {
        Self { samples: 2e5, rays: 4e5, seconds: 0.1, bytes_per_second: 2e7 }
    }
}

impl Speed {
    /// Takes a pass into account; what lies a second back counts little.
    pub fn traced(&mut self, samples: u64, rays: u64, took: Duration) {
        let keep = 1.0 / (1.0 + (self.seconds + took.as_secs_f64()));
        self.samples = self.samples * keep + samples as f64;
        self.rays = self.rays * keep + rays as f64;
        self.seconds = self.seconds * keep + took.as_secs_f64();
    }

    /// Takes a picture that was sent and acknowledged into account. Short ways are latency more than width, and count as fast.
    pub fn sent(&mut self, bytes: usize, took: Duration) {
        let rate = bytes as f64 / took.as_secs_f64().max(1e-3);
        self.bytes_per_second =
            if bytes > 50_000 { 0.5 * (self.bytes_per_second + rate) } else { self.bytes_per_second.max(rate) };
    }

    /// Samples a second.
    pub fn samples_per_second(&self) -> f64 {
        self.samples / self.seconds.max(1e-6)
    }

    /// Rays a second.
    pub fn rays_per_second(&self) -> f64 {
        self.rays / self.seconds.max(1e-6)
    }

    /// The sides of the blocks of the first picture after a change: the least power of two, to 16, with which `panels` pictures of `pixels`
    /// are traced and sent in time.
    pub fn first_block(&self, pixels: u64, panels: usize) -> u32 {
        let all = pixels as f64 * panels as f64;
        let in_time = |side: &u32| {
            let shown = all / f64::from(side * side);
            shown / self.samples_per_second() <= FIRST_PICTURE && 3.0 * shown / self.bytes_per_second <= FIRST_WAY
        };
        [1, 2, 4, 8].into_iter().find(in_time).unwrap_or(16)
    }

    /// How many samples of each pixel fit into a pass.
    pub fn samples_of_a_pass(&self, pixels: u64) -> u32 {
        (self.samples_per_second() * PASS / pixels as f64).clamp(1.0, 1e6) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fast_machine_shows_every_pixel_and_a_slow_line_fewer() {
        let mut speed = Speed::default();
        for _ in 0..20 {
            speed.traced(10_000_000, 20_000_000, Duration::from_millis(100));
            speed.sent(2_764_800, Duration::from_millis(5));
        }
        assert!(
            (speed.samples_per_second() / 1e8 - 1.0).abs() < 0.01 && (speed.rays_per_second() / 2e8 - 1.0).abs() < 0.01
        );
        assert_eq!(speed.first_block(1280 * 720, 1), 1);
        assert_eq!(speed.first_block(1280 * 720, 3), 2);
        assert_eq!(speed.samples_of_a_pass(1280 * 720), 6);
        for _ in 0..20 {
            speed.sent(100_000, Duration::from_millis(100));
        }
        // A million bytes a second: 35 000 of them in time, so 12 of 921 thousand pixels in a thousand.
        assert_eq!(speed.first_block(1280 * 720, 1), 16);
    }
}

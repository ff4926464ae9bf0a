//! Every number lies in [0, 1), also at the largest count and for awkward ones.

use rayon::prelude::*;

use super::reading::{Tickets, numbered_specs};
use crate::check::{Check, Context, Finding, Kind, Tally};
use crate::sampling::{MAX_SAMPLES, PixelKey, PointSource, Sampler, SamplerSpec, point_set};

/// The check of ranges.
pub fn checks() -> Vec<Check> {
    vec![Check {
        name: "numbers-stay-below-one",
        group: super::GROUP,
        claim: "every number of every legal sampler is in [0, 1), in every decision, up to the last of 2^24 samples",
        failures: &[],
        kind: Kind::Exact,
        run,
    }]
}

/// The largest number that a sampler of 2²⁴ samples reads at the ends, the middle and single bits of its index, in pixels
/// at the corners; `None` where one is outside [0, 1).
fn largest(s: SamplerSpec, tickets: &Tickets, context: &Context) -> Option<f32> {
    let mut largest = 0.0f32;
    // The next count that strata accept is the count itself.
    let mut sampler = Sampler::new(s, &tickets.layout, MAX_SAMPLES, 0).ok()?;
    for seed in 0..4 {
        sampler.reseed(context.seed_of(0, seed));
        for index in (0..24).flat_map(|bit| [1 << bit, (1 << bit) - 1]).chain([MAX_SAMPLES - 1, MAX_SAMPLES - 2]) {
            for pixel in [PixelKey::new(0, 0), PixelKey::new(u32::MAX, u32::MAX)] {
                let pairs =
                    [&tickets.pixel, &tickets.lens, &tickets.light].map(|dim| sampler.get_2d(pixel, index, dim));
                for u in pairs.into_iter().flatten().chain([sampler.get_1d(pixel, index, &tickets.pick)]) {
                    largest = (0.0..1.0).contains(&u).then_some(largest.max(u))?;
                }
            }
        }
    }
    Some(largest)
}

fn run(context: &Context) -> Finding {
    let tickets = Tickets::new();
    let specs = numbered_specs();
    let found: Vec<(Option<f32>, bool)> = specs
        .par_iter()
        .map(|&s| {
            let small = [1, 2, 3, 5, 13, 31, 32, 33, 127, 257].into_iter().all(|asked| {
                let points = point_set(s, asked, context.seed).unwrap_or_default();
                points.len() == s.taken(asked) as usize && points.iter().flatten().all(|u| (0.0..1.0).contains(u))
            });
            (largest(s, &tickets, context), small)
        })
        .collect();
    let mut tally = Tally::new();
    let mut most = 0.0f32;
    for (s, (largest, small)) in specs.iter().zip(found) {
        tally.fact(format!("{s}: 2^24 samples in [0, 1), largest seen {largest:?}"), largest.is_some());
        tally.fact(format!("{s}: small sets in [0, 1), as many points as taken"), small);
        most = most.max(largest.unwrap_or(0.0));
    }
    tally.saying(format!("{} samplers, the largest number seen is 1 − {:.1e}", specs.len(), 1.0 - f64::from(most)))
}

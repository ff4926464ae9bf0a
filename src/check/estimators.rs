//! Estimators of the renderer against closed forms.

use glam::Vec2;

use super::{Check, Context, Finding, Kind, Tally};
use crate::sampling::hash::bits64;
use crate::sampling::warp::square_to_disk;
use crate::stats::t_test;

/// The checks of this group.
pub fn checks() -> Vec<Check> {
    vec![Check {
        name: "disk-moments",
        group: "estimators",
        claim: "points of the lens are uniform on the disk: E r = 2/3, E r² = 1/2, no shift",
        failures: &[54],
        kind: Kind::Statistical,
        run: disk_moments,
    }]
}

fn disk_moments(context: &Context) -> Finding {
    let family = context.family(4);
    let points: Vec<Vec2> = (0..u64::from(context.replicates(100_000, 1_000)))
        .map(|i| {
            let bits = bits64(context.seed, i);
            let unit = |word: u64| (word & 0xff_ffff) as f32 / 16_777_216.0;
            square_to_disk(Vec2::new(unit(bits), unit(bits >> 32)))
        })
        .collect();
    let mut tally = Tally::new();
    let mut mean = |what: &str, f: fn(Vec2) -> f32, exact: f64| {
        let values: Vec<f64> = points.iter().map(|&p| f64::from(f(p))).collect();
        tally.verdict(what, &t_test(&values, exact, family), 1.0);
    };
    mean("E r", |p| p.length(), 2.0 / 3.0);
    mean("E r²", |p| p.length_squared(), 0.5);
    mean("E x", |p| p.x, 0.0);
    mean("E y", |p| p.y, 0.0);
    tally.finish()
}

//! Estimators of the renderer against closed forms: each concern a check of its own, mean and variance apart, since a wrong
//! density with a factor that makes up for it keeps the mean.
//!
//! | file | what it certifies |
//! |---|---|
//! | `tables` | the closed forms themselves, against every stored row |
//! | `lights` | one area sample: mean and variance for quads and meshes in every position |
//! | `shadows` | blockers, and the choice among lights, through the whole renderer |
//! | `lens` | the circle of confusion, the defocused edge, the chief ray, the plane of focus |
//! | `pixel` | coverage by half-planes, its noise, both diagonals |
//! | `scale` | the unit of length changes nothing |
//! | `random` | random scenes with the exact value beside them |

mod lens;
mod lights;
pub(in crate::check) mod pixel;
pub mod random;
pub mod random_edge;
mod reference;
pub mod scale;
mod shadows;
mod tables;

use glam::Vec2;

use super::{Check, Context, Finding, Kind};
use crate::sampling::hash::{bits64, unit_f32};

/// The checks of this group.
pub fn checks() -> Vec<Check> {
    [
        tables::checks(),
        lights::checks(),
        shadows::checks(),
        lens::checks(),
        pixel::checks(),
        scale::checks(),
        random::checks(),
        random_edge::checks(),
    ]
    .concat()
}

/// A check of this group that throws no dice.
const fn exact(name: &'static str, claim: &'static str, run: fn(&Context) -> Finding) -> Check {
    Check { name, group: "estimators", claim, failures: &[], kind: Kind::Exact, run }
}

/// A check of this group that does.
const fn statistical(name: &'static str, claim: &'static str, run: fn(&Context) -> Finding) -> Check {
    Check { name, group: "estimators", claim, failures: &[], kind: Kind::Statistical, run }
}

/// `n` independent points of the unit square, as single-precision numbers below 1.
pub(in crate::check) fn uniform_points(seed: u64, n: u32) -> impl Iterator<Item = Vec2> {
    (0..u64::from(n)).map(move |i| {
        let bits = bits64(seed, i);
        Vec2::new(unit_f32(bits as u32), unit_f32((bits >> 32) as u32))
    })
}

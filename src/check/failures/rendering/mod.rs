//! Rows 43 to 61: what goes wrong at lights and cameras, with the wrong way beside ours where there is one to show.

mod camera;
mod lights;
mod pixels;
mod rays;

use super::Check;
use crate::check::{Context, Finding, Kind};

/// The checks of the groups "failures: lights" and "failures: camera".
pub fn checks() -> Vec<Check> {
    [lights::checks(), rays::checks(), camera::checks(), pixels::checks()].concat()
}

const LIGHTS: &str = "failures: lights";
const CAMERA: &str = "failures: camera";

/// A check of a row, in the order of the catalogue's columns.
const fn row(
    group: &'static str,
    failures: &'static [u8],
    name: &'static str,
    claim: &'static str,
    kind: Kind,
    run: fn(&Context) -> Finding,
) -> Check {
    Check { name, group, claim, failures, kind, run }
}

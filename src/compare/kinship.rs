//! Whether two images say that they were made with the same random numbers.

use std::path::Path;

use crate::film::Picture;

/// What two images have in common.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Kinship {
    /// Everything: they are one render, perhaps of two versions of the program.
    SameRender,
    /// Scene, sampler and seed, but not the samples per pixel: the samples of one are part of the other's.
    SharedNumbers(String),
}

/// Compares provenance; `None` where it differs in what decides the random numbers, or where one of them has none.
///
/// An image whose samples are part of its reference's looks better than it is (at n of N samples the error's expected square
/// is too small by a factor 1 − n/N for independent points), so such a pair is to be refused.
pub fn kinship(a: &Picture, b: &Picture) -> Option<Kinship> {
    // A scene may be named with its folder and ending, or without.
    let scene = |text: &str| Path::new(text).file_stem().map_or(text.to_owned(), |stem| stem.to_string_lossy().into());
    let same = |name: &str| a.says(name).is_some() && a.says(name) == b.says(name);
    let scene_name = scene(a.says("scene")?);
    if scene_name != scene(b.says("scene")?) || !same("sampler") || !same("seed") {
        return None;
    }
    if ["spp", "stage", "estimator"].into_iter().all(same) {
        return Some(Kinship::SameRender);
    }
    let says = |name: &str| a.says(name).unwrap_or_default();
    Some(Kinship::SharedNumbers(format!("scene {scene_name}, sampler {} and seed {}", says("sampler"), says("seed"))))
}

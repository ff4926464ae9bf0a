//! Whether two images say that they were made with the same random numbers.

use std::path::Path;

use crate::film::Picture;

/// What two images have in common.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Kinship {
    /// Everything: they are one render, perhaps of two versions of the program.
    SameRender,
    /// Scene and seed, which decide the random numbers; the text says which.
    SharedNumbers(String),
}

/// Compares provenance; `None` where it differs in scene or seed, or where one of them has none.
///
/// The numbers are drawn by decision and seed, whatever the sampler and the number of samples, so that scrambles and shifts of
/// two samplers are in step. Errors of such a pair are correlated and hide one another: where the samples of the image are part
/// of its reference's, n of N independent ones, the expected square error is too small by a factor 1 − n/N. Such a pair is to be
/// refused.
pub fn kinship(a: &Picture, b: &Picture) -> Option<Kinship> {
    // A scene may be named with its folder and ending, or without.
    let scene = |text: &str| Path::new(text).file_stem().map_or(text.to_owned(), |stem| stem.to_string_lossy().into());
    let same = |name: &str| a.says(name).is_some() && a.says(name) == b.says(name);
    let scene_name = scene(a.says("scene")?);
    if scene_name != scene(b.says("scene")?) || !same("seed") {
        return None;
    }
    // Only images of an experiment have a variant, and of those the plain ones have none.
    let is_one_variant = a.says("variant") == b.says("variant");
    if is_one_variant && ["sampler", "spp", "stage", "estimator"].into_iter().all(same) {
        return Some(Kinship::SameRender);
    }
    Some(Kinship::SharedNumbers(format!("scene {scene_name} and seed {}", a.says("seed").unwrap_or_default())))
}

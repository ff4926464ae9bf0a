//! What speaks against a sampler in a scene, whatever its error: what a recommendation has to leave out or to say.

use super::super::evidence::{Answer, Limit};
use super::super::summarise::Summary;
use super::neighbours::structure;

/// What is wrong, in words; empty where nothing is seen and the construction promises the right image.
pub fn flaws(summary: &Summary, scene: usize, sampler: usize) -> Vec<&'static str> {
    let mut found = Vec::new();
    let course = summary.course(scene, sampler);
    found.extend(course.and_then(|course| match course.limit() {
        Limit::Wrong => Some("converges to a wrong image"),
        Limit::Stalls => Some("stalls"),
        Limit::StallsBiased => Some("stalls, and is biased"),
        _ if course.is_biased() == Answer::Yes => Some("biased"),
        _ => None,
    }));
    if structure(summary, scene, sampler).is_some() {
        found.push("neighbours err alike");
    }
    found.extend(summary.samplers[sampler].unproven(&summary.scenes[scene].decisions));
    found
}

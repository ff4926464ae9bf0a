//! How much of the time goes into the random numbers, and what other programs need.

use crate::experiment::results::PeerPoint;
use crate::stats::Estimate;

use super::super::markdown::{Page, table_ref};
use super::super::numbers::{counted, percent, short, with_interval};
use super::super::summarise::{Speed, Summary};
use super::tabulate;
use super::words::{name, same_as_cell, scene_name};

/// The share of sampling, where rounds measured it.
pub fn share(summary: &Summary, page: &mut Page) {
    let Some(spp) = timed_spp(summary) else { return };
    let speed = |scene: usize, sampler: usize| -> Option<(&Speed, Estimate)> {
        let speed = summary.speed(summary.cell(scene, sampler, spp)?)?;
        Some((speed, speed.sampling?))
    };
    let scenes: Vec<usize> = (0..summary.scenes.len())
        .filter(|&scene| (0..summary.samplers.len()).any(|sampler| speed(scene, sampler).is_some()))
        .collect();
    let mut head = vec!["sampler".to_owned()];
    for &scene in &scenes {
        let at = scene_name(summary, scene);
        head.extend([format!("{at}, share"), format!("{at}, ns a sample")]);
    }
    let cells = |scene: usize, sampler: usize| match speed(scene, sampler) {
        None => [same_as_cell(summary, scene, sampler).unwrap_or("–".to_owned()), "–".to_owned()],
        Some((speed, share)) => {
            let samples = summary.scenes[scene].pixels as f64 * f64::from(speed.spp.taken);
            let ns = share.value * speed.seconds.value * speed.threads as f64 / samples * 1e9;
            [with_interval(&share, percent), short(ns)]
        }
    };
    let lines: Vec<Vec<String>> = (0..summary.samplers.len())
        .map(|i| std::iter::once(name(summary, i)).chain(scenes.iter().flat_map(|&s| cells(s, i))).collect())
        .collect();
    let rounds = summary.about.experiment.timing.as_ref().map_or(0, |timing| timing.rounds as usize);
    let caption = format!(
        "Share of the seconds of an image at {spp} spp that drawing its random numbers takes: in each of {} the image is rendered, then its numbers are drawn alone, for the same pixels, decisions and threads, and nothing done with them; median of \
         the quotients with its 95 % interval in brackets. Beside it thread-nanoseconds for all the numbers of one sample. Rendering can hide a part of this by working on other things meanwhile, so the share is the most that a sampler which costs \
         nothing would save.",
        counted(rounds, "round", "rounds")
    );
    tabulate(page, "sampling-share", &caption, &head, &lines);
    page.sentences(&[share_words(summary, &scenes, |scene, sampler| speed(scene, sampler).map(|(_, share)| share))]);
}

/// The count at which shares are shown: the middle one, else the most that has any.
fn timed_spp(summary: &Summary) -> Option<u32> {
    let has_shares = |spp: u32| summary.speeds.iter().any(|s| s.spp.asked == spp && s.sampling.is_some());
    let all = summary.about.experiment.spp.iter().copied().filter(|&spp| has_shares(spp));
    summary.middle_spp().filter(|&spp| has_shares(spp)).or(all.max())
}

/// The dearest and the cheapest.
fn share_words(summary: &Summary, scenes: &[usize], share: impl Fn(usize, usize) -> Option<Estimate>) -> String {
    let mut all: Vec<(usize, usize, Estimate)> = scenes
        .iter()
        .flat_map(|&scene| (0..summary.samplers.len()).map(move |sampler| (scene, sampler)))
        .filter_map(|(scene, sampler)| Some((scene, sampler, share(scene, sampler)?)))
        .collect();
    all.sort_by(|a, b| a.2.value.total_cmp(&b.2.value));
    let (Some(low), Some(high)) = (all.first(), all.last()) else { return String::new() };
    let said = |(scene, sampler, share): &(usize, usize, Estimate)| {
        format!("{} of {} in {}", with_interval(share, percent), name(summary, *sampler), scene_name(summary, *scene))
    };
    format!(
        "**Where the time goes**: drawing numbers takes from {} to {} ({}); the rest is tracing and shading, the same for every sampler. Of an image at a given count a cheaper sampler saves no more than its share.",
        said(low),
        said(high),
        table_ref("sampling-share")
    )
}

/// Other programs' points of a scene, with seconds for as many pixels as ours have.
pub fn peers_of(summary: &Summary, scene: usize) -> Vec<(&PeerPoint, f64)> {
    let scene = &summary.scenes[scene];
    let points = summary.about.experiment.peers.iter().flat_map(|peers| &peers.points);
    let ours = points.filter(|point| point.scene == scene.name);
    ours.map(|point| (point, scene.pixels as f64 / point.size.pixels() as f64)).collect()
}

/// The table of other programs.
pub fn peers(summary: &Summary, page: &mut Page) {
    let Some(peers) = &summary.about.experiment.peers else { return };
    let shown: Vec<(usize, &PeerPoint, f64)> = (0..summary.scenes.len())
        .flat_map(|scene| peers_of(summary, scene).into_iter().map(move |(point, scale)| (scene, point, scale)))
        .collect();
    let lines: Vec<Vec<String>> = shown
        .iter()
        .map(|&(scene, point, scale)| {
            let seconds = Estimate { value: point.seconds, ci95: point.seconds_range };
            let rmse = Estimate { value: point.rmse, ci95: point.rmse_range };
            vec![
                point.name.clone(),
                scene_name(summary, scene),
                point.spp.to_string(),
                point.size.to_string(),
                peer_value(&seconds),
                short(point.seconds * scale),
                peer_value(&rmse),
                format!("{}, {}", point.machine, point.date),
            ]
        })
        .collect();
    let others = peers.points.len() - shown.len();
    let others = match others {
        0 => String::new(),
        n => format!(
            " {} of scenes that are not here {} left out.",
            counted(n, "point", "points"),
            if n == 1 { "is" } else { "are" }
        ),
    };
    if lines.is_empty() {
        return page.paragraph(&format!("`{}` has no points of these scenes.{others}", peers.file));
    }
    let note =
        peers.note.as_ref().map_or(String::new(), |note| format!(" The file says: {}.", note.trim_end_matches('.')));
    let caption = format!(
        "What other programs need, from `{}`, measured elsewhere and not by this run: seconds of rendering and RMSE in W/(m² sr), ranges in brackets; and the seconds for as many pixels as images have here, which is where the figures show \
         them (stars).{note}{others} They are in no front and no verdict: another machine, day or load would move them.",
        peers.file
    );
    let head = ["program", "scene", "spp", "pixels", "seconds", "at our size", "RMSE", "where and when"];
    tabulate(page, "peers", &caption, &head, &lines);
}

/// A number with its range, or bare: an unknown range is no unknown interval of ours.
fn peer_value(value: &Estimate) -> String {
    if value.ci95.is_some() { with_interval(value, short) } else { short(value.value) }
}

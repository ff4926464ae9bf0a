//! Why an item has no row that counts: what its row was made with, against what it would be made with now.

use std::fmt;

use super::plan::{ReferenceSource, Work, WorkItem};
use super::results::{MadeWith, Row, kind_name};
use super::survey::altered;

/// Something that a row was made with and that is another now.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Change {
    /// A scene's name, or none for an algorithm number.
    pub scene: Option<String>,
    /// `scene`, or whose algorithm number it is.
    pub what: &'static str,
    /// What it was.
    pub from: String,
    /// What it is.
    pub to: String,
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { scene, what, from, to } = self;
        match scene {
            Some(scene) => write!(f, "the scene {scene} changed, {from} → {to}"),
            None => write!(f, "the algorithm number of the {what} changed, {from} → {to}"),
        }
    }
}

/// Why an item is to be done.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Reason {
    /// It never was done.
    Never,
    /// Its row is there; the image, which a report shows, is missing or damaged.
    ImageLost,
    /// It was done with another scene file or another version of the code.
    Changed(Vec<Change>),
    /// It is made of, or compared with, other items than its row was.
    Remade,
    /// Its row says of a field something else than its id stands for.
    Altered(&'static str),
    /// Its row was put aside and fits again.
    Aside,
    /// It was done by a version that did not write down with what.
    Earlier,
}

impl Reason {
    /// In a word or two, for tables.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Never => "missing",
            Self::ImageLost => "image lost",
            Self::Changed(changes) if changes.iter().any(|change| change.scene.is_some()) => "scene changed",
            Self::Changed(_) => "algorithm changed",
            Self::Remade => "experiment changed",
            Self::Altered(_) => "row altered",
            Self::Aside => "put aside",
            Self::Earlier => "stale",
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Never => write!(f, "never done"),
            Self::ImageLost => write!(f, "the image is missing or damaged"),
            Self::Changed(changes) => {
                let changes: Vec<String> = changes.iter().map(Change::to_string).collect();
                write!(f, "{}", changes.join("; "))
            }
            Self::Remade => write!(f, "made of or compared with other items now"),
            Self::Altered(field) => write!(f, "the row says another {field} than its id stands for"),
            Self::Aside => write!(f, "fits again: the next run takes the row back from superseded.jsonl"),
            Self::Earlier => write!(f, "made by an earlier version, which did not say with what"),
        }
    }
}

/// What makes an item what it is for a reader, whatever the scene's content and the code: a row of the same slot was the
/// item's before something changed.
pub fn slot_of_item(item: &WorkItem) -> String {
    let kind = kind_name(item.kind());
    match &item.work {
        Work::Image(w) => {
            let way = format!("{} {} {}", w.estimator.name(), w.stage.name(), w.variant);
            image_slot(kind, &w.scene, &w.sampler, (w.spp.asked, w.replicate, w.seed), &w.size, &way)
        }
        Work::Reference(w) => {
            let spp = match &w.source {
                ReferenceSource::Exact => None,
                ReferenceSource::Halves { spp, .. } => Some(spp.asked),
            };
            reference_slot(&w.scene, &w.size, spp)
        }
        Work::Ensemble(w) => {
            let way = format!("{} {}", w.estimator.name(), w.variant);
            image_slot(kind, &w.scene, &w.sampler, (w.spp.asked, 0, 0), &w.size, &way)
        }
        Work::Points(w) => format!("{kind} {} {} {} {}", w.sampler, w.n.asked, w.replicate, w.seed),
        Work::Prediction(w) => format!("{kind} {} {} {}", w.scene, w.sampler, w.spp.asked),
    }
}

/// The slot of a row.
pub fn slot_of_row(row: &Row) -> String {
    let kind = kind_name(row.kind());
    match row {
        Row::Image(r) => {
            let way = format!("{} {} {}", r.estimator.name(), r.stage.name(), r.variant);
            image_slot(kind, &r.scene, &r.sampler, (r.spp.asked, r.replicate, r.seed), &r.size, &way)
        }
        Row::Reference(r) => reference_slot(&r.scene, &r.size, r.spp.map(|spp| spp.asked)),
        Row::Ensemble(r) => {
            let way = format!("{} {}", r.estimator.name(), r.variant);
            image_slot(kind, &r.scene, &r.sampler, (r.spp.asked, 0, 0), &r.size, &way)
        }
        Row::Points(r) => format!("{kind} {} {} {} {}", r.sampler, r.n.asked, r.replicate, r.seed),
        Row::Prediction(r) => format!("{kind} {} {} {}", r.scene, r.sampler, r.spp.asked),
    }
}

fn image_slot(
    kind: &str,
    scene: &str,
    sampler: &str,
    (spp, replicate, seed): (u32, u32, u64),
    size: &dyn fmt::Display,
    way: &str,
) -> String {
    format!("{kind} {scene} {sampler} {spp} {replicate} {seed} {size} {way}")
}

/// A closed form has a slot of its own: a scene that loses it has a reference that never was made.
fn reference_slot(scene: &str, size: &dyn fmt::Display, spp: Option<u32>) -> String {
    format!("reference {scene} {size} {spp:?}")
}

/// Why a row of the item's slot is not its result.
pub fn difference(row: &Row, item: &WorkItem) -> Reason {
    let mut changes = Vec::new();
    if row.id() != item.id {
        let Some(made) = row.made_with() else { return Reason::Earlier };
        changes = changes_between(made, &item.made_with, row.scene());
    }
    if let Some(from) = metrics_algorithm(row).filter(|&from| from != item.metrics_algorithm) {
        changes.push(change("metrics", Some(from), Some(item.metrics_algorithm)));
    }
    match altered(row, item).filter(|_| row.id() == item.id) {
        Some(field) => Reason::Altered(field),
        None if changes.is_empty() => Reason::Remade,
        None => Reason::Changed(changes),
    }
}

fn changes_between(was: &MadeWith, is: &MadeWith, scene: Option<&str>) -> Vec<Change> {
    let mut changes = Vec::new();
    if was.scene != is.scene {
        let digest = |hash: &Option<String>| hash.clone().unwrap_or_else(|| "none".to_owned());
        let scene = Some(scene.unwrap_or_default().to_owned());
        changes.push(Change { scene, what: "scene", from: digest(&was.scene), to: digest(&is.scene) });
    }
    for (what, was, is) in [
        ("renderer", was.renderer, is.renderer),
        ("sampler", was.sampler, is.sampler),
        ("estimator", was.estimator, is.estimator),
        ("closed form", was.exact, is.exact),
    ] {
        if was != is {
            changes.push(change(what, was, is));
        }
    }
    changes
}

fn change(what: &'static str, from: Option<u32>, to: Option<u32>) -> Change {
    let number = |number: Option<u32>| number.map_or("none".to_owned(), |number| number.to_string());
    Change { scene: None, what, from: number(from), to: number(to) }
}

fn metrics_algorithm(row: &Row) -> Option<u32> {
    match row {
        Row::Image(row) => row.errors.as_ref().map(|errors| errors.metrics_algorithm),
        Row::Reference(row) => Some(row.metrics_algorithm),
        Row::Ensemble(row) => Some(row.metrics_algorithm),
        Row::Points(row) => Some(row.metrics_algorithm),
        Row::Prediction(_) => None,
    }
}

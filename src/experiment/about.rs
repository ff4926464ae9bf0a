//! `experiment.json`: what a folder's rows are the results of.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::backend::{Algorithms, SceneFacts};
use super::results::{Row, short_hash};
use super::spec::Experiment;
use crate::error::{Error, Result};

/// Where an output folder says what was run.
pub fn about_path(out: &Path) -> PathBuf {
    out.join("experiment.json")
}

/// `experiment.json`: what a folder's rows are the results of. Free of anything from a clock.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// Row format, [`SCHEMA`](super::results::SCHEMA).
    pub schema: u32,
    /// Version of the program.
    pub version: String,
    /// The command that makes this folder.
    pub command: String,
    /// The experiment as it was read, defaults made explicit.
    pub experiment: Experiment,
    /// Its scenes.
    pub scenes: Vec<SceneFacts>,
    /// What the plan made of the experiment, in sentences.
    pub notes: Vec<String>,
    /// Sets of samplers that are not done in a scene, because another one means the same there.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<LeftOut>,
    /// Where the experiment and its scenes were read from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<Source>,
    /// The algorithm numbers of the program that wrote this.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub algorithms: Option<Algorithms>,
}

impl About {
    /// Whether a row is about a scene as it is described here; one that does not say counts as such.
    pub fn fits(&self, row: &Row) -> bool {
        let made_of = row.made_with().and_then(|made| made.scene.as_deref());
        let (Some(name), Some(made_of)) = (row.scene(), made_of) else { return true };
        let scene = self.scenes.iter().find(|scene| scene.name == name);
        scene.is_none_or(|scene| short_hash(&scene.content_hash) == made_of)
    }
}

/// A set of samplers that means in one scene, for the decisions that the scene makes, the same as another one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftOut {
    /// Scene name.
    pub scene: String,
    /// The set in canonical form.
    pub sampler: String,
    /// The one that is done, in canonical form.
    pub same_as: String,
}

/// What to read again to plan the same experiment.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Source {
    /// The experiment file as records call it ([`recorded_name`](super::origin::recorded_name)); `origin.json` leads to it.
    pub file: String,
    /// Keys changed in the scene files.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sets: Vec<String>,
}

/// Reads `experiment.json`.
///
/// # Errors
/// Kind `Input` where it is missing or does not read.
pub fn read_about(path: &Path) -> Result<About> {
    let bad = |e: &dyn std::fmt::Display| Error::input(path.display(), format!("expected what was run, found: {e}"));
    let remedy = "take the file out, and `run` writes it again (without --fresh the rows stay)";
    let damaged = |e: serde_json::Error| bad(&format!("{e}; {remedy}"));
    serde_json::from_slice(&std::fs::read(path).map_err(|e| bad(&e))?).map_err(damaged)
}

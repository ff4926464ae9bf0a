//! How to run, and what a run did.

use std::sync::atomic::AtomicBool;

use crate::error::{Error, Result};
use crate::experiment::origin::Origin;
use crate::experiment::results::Source;
use crate::experiment::shards::Shard;
use crate::experiment::survey::Limits;

/// How to run.
pub struct Options<'a> {
    /// Threads that work inside an image, at least 1.
    pub threads: usize,
    /// Forget what the folder holds and do everything again.
    pub fresh: bool,
    /// The command that makes this folder, for provenance; the same for every run of the same experiment.
    pub command: String,
    /// Where the experiment was read from.
    pub source: Option<Source>,
    /// The way to it on this machine, where it is to be written down.
    pub origin: Option<Origin>,
    /// Do this part of the plan alone.
    pub shard: Option<Shard>,
    /// What the run may use.
    pub limits: Limits,
    /// End after so many items, as a kill would.
    pub at_most: Option<usize>,
    /// Set from elsewhere: end soon. An image at hand is given up at its next tile, anything else is ended first.
    pub stop: Option<&'a AtomicBool>,
}

impl Options<'_> {
    /// Options of a plain run.
    pub fn new(threads: usize, command: impl Into<String>) -> Self {
        let (limits, command) = (Limits::default(), command.into());
        let threads = threads.max(1);
        Self {
            threads,
            fresh: false,
            command,
            source: None,
            origin: None,
            shard: None,
            limits,
            at_most: None,
            stop: None,
        }
    }
}

/// An item that could not be done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failure {
    /// The item.
    pub id: String,
    /// The item in words.
    pub label: String,
    /// Why.
    pub error: Error,
}

/// What a run did.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Items of the plan, or of the part of it that was to be done, without the batches that no reference wants.
    pub items: usize,
    /// Items that were done before.
    pub found: usize,
    /// Items that this run did.
    pub done: usize,
    /// Items that could not be done; the others went on.
    pub failures: Vec<Failure>,
    /// Whether the run was told to end early.
    pub interrupted: bool,
    /// Samples rendered.
    pub samples: u64,
    /// Whether it began with forgetting what was there.
    pub fresh: bool,
}

impl Outcome {
    /// Nothing is missing.
    ///
    /// # Errors
    /// Kind `Incomplete` that counts what is missing and gives the first reason; kind `Interrupted` where the run was told
    /// to end.
    pub fn check(&self) -> Result<()> {
        let missing = self.items - self.found - self.done;
        if self.interrupted {
            let done = self.found + self.done;
            let without = if self.fresh { " without --fresh" } else { "" };
            let what = format!(
                "told to end with {done} of {} items done; the same command{without} goes on from there",
                self.items
            );
            return Err(Error::interrupted("run", what));
        }
        match self.failures.first() {
            None if missing == 0 => Ok(()),
            None => Err(Error::incomplete("run", format!("expected {} items, {missing} are missing", self.items))),
            Some(Failure { label, error, .. }) => {
                let what =
                    format!("expected {} items, {} failed, first {label}: {error}", self.items, self.failures.len());
                Err(Error::incomplete("run", what))
            }
        }
    }
}

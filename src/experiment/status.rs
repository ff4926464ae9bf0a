//! How far a folder is, and why what is missing is missing.

use std::collections::HashMap;
use std::fmt;
use std::path::Path;

use super::folder::read_note;
use super::plan::Plan;
use super::results::Row;
use super::shards::{Shard, blocks};
use super::superseded::Superseded;
use super::survey::{Standing, State, is_result_of};
use super::why::{Reason, difference, slot_of_item, slot_of_row};
use crate::error::{Error, Result};

/// Items that are to be done for one reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Missing {
    /// Why.
    pub reason: Reason,
    /// How many.
    pub items: usize,
    /// The first of them, in words.
    pub first: String,
}

/// What a folder holds of its experiment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Status {
    /// Items of the plan, without the batches that no reference is known to want.
    pub items: usize,
    /// Those that are done.
    pub done: usize,
    /// The others, by reason, in the order in which the reasons first occur.
    pub missing: Vec<Missing>,
    /// Rows in `results.jsonl` that are not the plan's, by reason: the next run puts them aside.
    pub stale: Vec<(String, usize)>,
    /// Rows that were put aside.
    pub superseded: usize,
    /// Into how many shards the experiment was cut, where it was and something is missing.
    pub shards: Option<u32>,
    /// The shards in which something is missing.
    pub missing_shards: Vec<Shard>,
}

impl Status {
    /// Reads the folder.
    ///
    /// # Errors
    /// Kind `Input` where its files do not read.
    pub fn read(plan: &Plan, out: &Path) -> Result<Self> {
        let (standing, superseded) = (Standing::read(plan, out)?, Superseded::read(out)?.rows());
        let is_stale = |row: &&Row| !plan.position(row.id()).is_some_and(|at| is_result_of(row, &plan.items[at]));
        let stale: Vec<Row> = standing.in_file.iter().filter(is_stale).cloned().collect();
        let done = standing.states.iter().filter(|&&state| state == State::Done).count();
        let items = standing.states.iter().filter(|&&state| state != State::Optional).count();
        let shards = read_note(out)?.map(|note| note.count).filter(|_| done < items);
        Ok(Self {
            items,
            done,
            missing: missing(plan, &standing, superseded.iter().map(|(_, row)| row)),
            stale: stale_rows(plan, &stale),
            superseded: superseded.len(),
            shards,
            missing_shards: shards.map_or(Vec::new(), |count| missing_shards(plan, &standing, count)),
        })
    }

    /// Nothing is missing.
    ///
    /// # Errors
    /// Kind `Incomplete` that counts what is missing and names the missing shards.
    pub fn check(&self, place: impl fmt::Display) -> Result<()> {
        let missing = self.items - self.done;
        if missing == 0 {
            return Ok(());
        }
        let shards = match self.shard_options() {
            options if options.is_empty() => String::new(),
            options => format!("; missing shards: {}", options.join(", ")),
        };
        Err(Error::incomplete(place, format!("expected {} items, {missing} are missing{shards}", self.items)))
    }

    /// The missing shards as options of `run`.
    pub fn shard_options(&self) -> Vec<String> {
        self.missing_shards.iter().map(|shard| format!("--shard {shard}")).collect()
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} of {} items done", self.done, self.items)?;
        for Missing { reason, items, first } in &self.missing {
            writeln!(f, "  {:<18} {items:>6}  {reason}; the first: {first}", reason.name())?;
        }
        for (why, rows) in &self.stale {
            writeln!(f, "  {:<18} {rows:>6}  rows that the next run puts aside: {why}", "stale")?;
        }
        if self.superseded > 0 {
            writeln!(f, "  {:<18} {:>6}  rows, in superseded.jsonl", "put aside", self.superseded)?;
        }
        if !self.missing_shards.is_empty() {
            writeln!(f, "missing shards: {}", self.shard_options().join(" "))?;
        }
        Ok(())
    }
}

/// Why rows are not the plan's, with their number.
pub(super) fn stale_rows(plan: &Plan, rows: &[Row]) -> Vec<(String, usize)> {
    let slots: HashMap<String, usize> =
        plan.items.iter().enumerate().map(|(position, item)| (slot_of_item(item), position)).collect();
    let mut counts: Vec<(String, usize)> = Vec::new();
    for row in rows {
        let why = match plan.position(row.id()).or_else(|| slots.get(&slot_of_row(row)).copied()) {
            Some(position) => difference(row, &plan.items[position]).to_string(),
            None => "not in the experiment any more".to_owned(),
        };
        match counts.iter_mut().find(|(known, _)| *known == why) {
            Some((_, count)) => *count += 1,
            None => counts.push((why, 1)),
        }
    }
    counts
}

/// What is to be done, by reason. A row that was an item's before something changed says what.
fn missing<'a>(plan: &Plan, standing: &'a Standing, superseded: impl Iterator<Item = &'a Row>) -> Vec<Missing> {
    let superseded: Vec<&Row> = superseded.collect();
    let aside: HashMap<&str, &Row> = superseded.iter().map(|row| (row.id(), *row)).collect();
    let mut before: HashMap<String, &Row> = HashMap::new();
    for row in standing.in_file.iter().rev().chain(superseded) {
        before.entry(slot_of_row(row)).or_insert(row);
    }
    let mut missing: Vec<Missing> = Vec::new();
    for (item, state) in plan.items.iter().zip(&standing.states) {
        let reason = match state {
            State::Done | State::Optional => continue,
            State::ImageMissing => Reason::ImageLost,
            _ if aside.get(item.id.as_str()).is_some_and(|row| is_result_of(row, item)) => Reason::Aside,
            State::Missing => match standing.rows.get(&item.id).or_else(|| before.get(&slot_of_item(item)).copied()) {
                Some(row) => difference(row, item),
                None => Reason::Never,
            },
        };
        match missing.iter_mut().find(|known| known.reason == reason) {
            Some(known) => known.items += 1,
            None => missing.push(Missing { reason, items: 1, first: item.label() }),
        }
    }
    missing
}

/// The shards that own something missing.
fn missing_shards(plan: &Plan, standing: &Standing, count: u32) -> Vec<Shard> {
    let blocks = blocks(plan, count).into_iter().zip(1..);
    let is_to_do = |state: &State| !matches!(state, State::Done | State::Optional);
    let lacks = |block: &std::ops::Range<usize>| standing.states[block.clone()].iter().any(is_to_do);
    blocks.filter(|(block, _)| lacks(block)).map(|(_, index)| Shard { index, count }).collect()
}

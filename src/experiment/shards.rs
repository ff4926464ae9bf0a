//! A plan cut into parts that several machines work on.
//!
//! The cut is a pure function of the plan, not of what is missing: contiguous blocks of plan order of about equal cost,
//! between groups of items that belong together. What a block needs and does not own, such as a reference, it makes for
//! itself: the same bits, without a row.

use std::fmt;
use std::ops::Range;

use super::plan::{Plan, Work};
use super::survey::PAIRS_A_SAMPLE;
use crate::error::{Error, Result};

/// One of `count` parts, written `I/N`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Which, from 1.
    pub index: u32,
    /// Of how many.
    pub count: u32,
}

impl Shard {
    /// The most parts that a plan is cut into.
    pub const MOST: u32 = 10_000;

    /// Reads `I/N`.
    ///
    /// # Errors
    /// Kind `Input` where it is not of that form with 1 ≤ I ≤ N ≤ [`MOST`](Self::MOST).
    pub fn parse(text: &str) -> Result<Self> {
        let number = |digits: &str| -> Option<u32> {
            digits.bytes().all(|b| b.is_ascii_digit()).then(|| digits.parse().ok()).flatten()
        };
        let read = || {
            let (index, count) = text.split_once('/')?;
            Some(Self { index: number(index)?, count: number(count)? })
        };
        read().filter(|s| 1 <= s.index && s.index <= s.count && s.count <= Self::MOST).ok_or_else(|| {
            let most = Self::MOST;
            Error::input("--shard", format!("expected I/N with 1 ≤ I ≤ N ≤ {most}, such as 2/3, found {text:?}"))
        })
    }

    /// The positions of the plan that this part owns; none where there are more parts than groups.
    pub fn positions(self, plan: &Plan) -> Range<usize> {
        blocks(plan, self.count)[self.index as usize - 1].clone()
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

/// The plan in `count` contiguous blocks; some are empty where there are fewer groups.
pub fn blocks(plan: &Plan, count: u32) -> Vec<Range<usize>> {
    let groups = groups(plan);
    let cost = |group: &Range<usize>| group.clone().map(|position| item_cost(plan, position)).sum::<u128>();
    let total: u128 = groups.iter().map(cost).sum();
    let mut ends = vec![0; count as usize];
    let mut before = 0;
    for group in &groups {
        // A group goes where its middle falls: block b takes the middles in [b/N, (b+1)/N) of the total cost.
        let cost = cost(group);
        let block = ((2 * before + cost) * u128::from(count) / (2 * total)) as usize;
        ends[block] = group.end;
        before += cost;
    }
    let mut start = 0;
    ends.into_iter()
        .map(|end| {
            let block = start..end.max(start);
            start = block.end;
            block
        })
        .collect()
}

/// Cost in pairs of points. Writing and measuring count too, so that a plan of small images is spread.
fn item_cost(plan: &Plan, position: usize) -> u128 {
    let item = &plan.items[position];
    // Nobody knows before how many batches a reference wants; it may be none.
    if item.batch().is_some() {
        return 1000;
    }
    let pixels = item.kept_image().map_or(0, |size| size.pixels());
    u128::from(item.samples() + pixels) * u128::from(PAIRS_A_SAMPLE) + u128::from(item.pairs()) + 1000
}

/// What belongs together: images and, behind them, the item that is made of them – an ensemble with its replicates, a
/// reference with its halves and all that these may grow by. Everything else stands alone.
fn groups(plan: &Plan) -> Vec<Range<usize>> {
    let mut starts: Vec<usize> = Vec::new();
    for position in 0..plan.items.len() {
        let parts = parts(plan, position);
        let mut start = position;
        while start > 0 && parts.contains(&plan.items[start - 1].id.as_str()) {
            start -= 1;
        }
        // What stood alone so far is one with what is made of it.
        starts.retain(|&s| s <= start);
        if starts.last() != Some(&start) {
            starts.push(start);
        }
    }
    let ends = starts.iter().skip(1).copied().chain([plan.items.len()]);
    starts.iter().zip(ends).map(|(&start, end)| start..end).collect()
}

/// Ids of the images that an item is made of.
fn parts(plan: &Plan, position: usize) -> Vec<&str> {
    let item = &plan.items[position];
    match &item.work {
        Work::Ensemble(work) => work.members.iter().map(String::as_str).collect(),
        Work::Reference(_) => match plan.growth(&item.id) {
            Some(growth) => growth.batches.iter().flatten().map(String::as_str).collect(),
            None => plan.reference_images(&item.id).to_vec(),
        },
        Work::Image(_) | Work::Points(_) | Work::Prediction(_) => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shard_reads_back_as_written_and_strange_ones_are_refused() {
        assert_eq!(Shard::parse("2/3"), Ok(Shard { index: 2, count: 3 }));
        assert_eq!(Shard::parse("2/3").unwrap().to_string(), "2/3");
        for bad in ["", "2", "0/3", "4/3", "1/0", "-1/3", "+1/3", "1/3/3", "1 /3", "a/b", "1/10001", "1/99999999999"] {
            let error = Shard::parse(bad).unwrap_err();
            assert!(error.exit_code() == 2 && error.what.contains("expected I/N"), "{bad}");
        }
    }
}

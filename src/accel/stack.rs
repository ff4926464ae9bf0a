//! Children that wait while a single ray goes down the tree.

use std::mem::MaybeUninit;

/// A child and the distance where the ray enters it, as one number: the distance's bits, which order as the distances do
/// (none is below 0), over the child.
#[inline(always)]
pub(super) fn waiting(near: f32, child: u32) -> u64 {
    u64::from(near.to_bits()) << 32 | u64::from(child)
}

/// Distance and child.
#[inline(always)]
pub(super) fn parts(entry: u64) -> (f32, u32) {
    (f32::from_bits((entry >> 32) as u32), entry as u32)
}

/// Entries on the processor's stack, enough for 18 levels; deeper trees take a vector.
pub(super) const FEW: usize = 128;

/// Entries that need not be set before they are pushed: clearing them would take as long as two nodes.
pub(super) struct Stack<'a> {
    entries: &'a mut [MaybeUninit<u64>],
    /// All entries below it are set.
    count: usize,
}

impl<'a> Stack<'a> {
    #[inline(always)]
    pub fn new(entries: &'a mut [MaybeUninit<u64>]) -> Self {
        Self { entries, count: 0 }
    }

    #[inline(always)]
    pub fn len(&self) -> usize {
        self.count
    }

    #[inline(always)]
    pub fn push(&mut self, entry: u64) {
        self.entries[self.count].write(entry);
        self.count += 1;
    }

    /// Pushes an entry under the smaller ones that were pushed since there were `bottom`.
    #[inline(always)]
    pub fn insert(&mut self, entry: u64, bottom: usize) {
        let mut at = self.count;
        while at > bottom && self.get(at - 1) < entry {
            self.entries[at].write(self.get(at - 1));
            at -= 1;
        }
        self.entries[at].write(entry);
        self.count += 1;
    }

    /// The next child that the ray enters no farther than `limit`.
    #[inline(always)]
    pub fn next(&mut self, limit: f32) -> Option<u32> {
        while self.count > 0 {
            self.count -= 1;
            let (near, child) = parts(self.get(self.count));
            if near <= limit {
                return Some(child);
            }
        }
        None
    }

    /// Entry `at`, which is one that was pushed.
    #[inline(always)]
    fn get(&self, at: usize) -> u64 {
        // SAFETY: only entries that are or just were below the count are asked for, and those are set.
        #[allow(unsafe_code, reason = "reading what was written")]
        unsafe {
            self.entries[at].assume_init()
        }
    }
}

//! Children that wait while a single ray goes down the tree.

use std::marker::PhantomData;
use std::mem::MaybeUninit;

/// A child and the distance where the ray enters it, or a triangle and where it is hit, as one number: the distance's bits, which
/// order as the distances do (none is below 0), over the index.
#[inline(always)]
pub(super) fn waiting(near: f32, index: u32) -> u64 {
    u64::from(near.to_bits()) << 32 | u64::from(index)
}

/// Distance and index.
#[inline(always)]
pub(super) fn parts(entry: u64) -> (f32, u32) {
    (f32::from_bits((entry >> 32) as u32), entry as u32)
}

/// Entries on the processor's stack, enough for 18 levels; deeper trees take a vector.
pub(super) const FEW: usize = 128;

/// Entries that need not be set before they are pushed, which would take as long as two nodes, and whose number is not checked.
pub(super) struct Stack<'a> {
    bottom: *mut u64,
    /// All entries from the bottom to here are set.
    top: *mut u64,
    /// Room for as many entries as a tree lets wait.
    room: PhantomData<&'a mut [MaybeUninit<u64>]>,
}

#[allow(unsafe_code, reason = "entries are written before they are read, and no more than there is room for")]
impl<'a> Stack<'a> {
    /// # Safety
    /// There must be room for all that will ever wait at once.
    // SAFETY: `push` and `insert` rest on this promise.
    #[inline(always)]
    pub unsafe fn new(entries: &'a mut [MaybeUninit<u64>]) -> Self {
        let bottom = entries.as_mut_ptr().cast();
        Self { bottom, top: bottom, room: PhantomData }
    }

    /// The place of the next entry, for [`Self::insert`].
    #[inline(always)]
    pub fn top(&self) -> *mut u64 {
        self.top
    }

    #[inline(always)]
    pub fn push(&mut self, entry: u64) {
        // SAFETY: there is room, by the promise made to `new`.
        unsafe {
            self.top.write(entry);
            self.top = self.top.add(1);
        }
    }

    /// Pushes an entry under the smaller ones that were pushed since the top was `since`.
    #[inline(always)]
    pub fn insert(&mut self, entry: u64, since: *mut u64) {
        // SAFETY: as in `push`; the entries between two tops are set.
        unsafe {
            let mut at = self.top;
            while at > since && at.sub(1).read() < entry {
                at.write(at.sub(1).read());
                at = at.sub(1);
            }
            at.write(entry);
            self.top = self.top.add(1);
        }
    }

    /// The next child that the ray enters no farther than `limit`.
    #[inline(always)]
    pub fn next(&mut self, limit: f32) -> Option<u32> {
        while self.top != self.bottom {
            // SAFETY: the entries below the top are set.
            let entry = unsafe {
                self.top = self.top.sub(1);
                self.top.read()
            };
            let (near, child) = parts(entry);
            if near <= limit {
                return Some(child);
            }
        }
        None
    }
}

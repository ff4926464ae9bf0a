//! The way down the tree for single rays, as both vector kernels go it.
//!
//! What a ray costs is mostly waiting: a node's planes must be loaded, multiplied and compared before it is known which child
//! comes next, some thirty cycles, and only then can the child's planes be loaded. So what comes next is told by branches and not by a
//! number that is computed: the processor foresees them, as neighbouring rays go the same way, and is at work on the child
//! while the node is still being tested. Where it foresees wrongly, it loses less than that.

use std::arch::x86_64::*;

use super::nodes8::{Node8, Tree8, WIDTH};
use super::stack::{Stack, waiting};
use super::vector8::{array, fetch};

/// The kernel for a ray, compiled for `$features`; `$evex` is whether these are those of AVX-512; `$not_above` gives the lanes where a first number is no greater than a second, as
/// bits.
macro_rules! kernel {
    ($features:literal, $evex:literal, $not_above:expr) => {
        /// What the ray meets, as an entry: see [`single`](super::single). The processor must have the kernel's instructions.
        #[allow(
            clippy::too_many_arguments,
            reason = "numbers that were stored one by one and are then loaded together are long in coming"
        )]
        #[target_feature(enable = $features)]
        pub(super) fn trace<const ANY: bool>(
            tree: &Tree8,
            ox: f32,
            oy: f32,
            oz: f32,
            dx: f32,
            dy: f32,
            dz: f32,
            limit: f32,
        ) -> u64 {
            let ray = Ray8::new(Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz), tree.extent);
            let mut few = [MaybeUninit::uninit(); FEW];
            let mut many = Vec::new();
            if tree.waiting > FEW {
                many.resize(tree.waiting, MaybeUninit::uninit());
            }
            // SAFETY: there is room for the most that waits.
            #[allow(unsafe_code, reason = "a stack that does not check")]
            let mut stack = unsafe { Stack::new(if tree.waiting > FEW { &mut many } else { &mut few }) };
            let slabs = ray.slabs();
            let mut best = waiting(limit, 0);
            let mut child = 0;
            loop {
                let limit = parts(best).0;
                while child & LEAF == 0 {
                    let node = tree.node(child);
                    let (near, far) = slabs.crossings(node, _mm256_set1_ps(limit));
                    let met = $not_above(near, far);
                    child = if met != 0 {
                        descend::<ANY, $evex>(tree, node, near, met, &mut stack)
                    } else if let Some(next) = stack.next(limit) {
                        next
                    } else {
                        return best;
                    };
                }
                let block = tree.block(child ^ LEAF);
                let (mut met, t) = ray.test::<ANY, $evex>(block, tree.pad, limit);
                if met != 0 {
                    if ANY {
                        return MET;
                    }
                    let t = array(t);
                    while met != 0 {
                        let lane = met.trailing_zeros() as usize % WIDTH;
                        met &= met - 1;
                        best = best.min(waiting(t[lane], block.ids[lane]));
                    }
                }
                match stack.next(parts(best).0) {
                    Some(next) => child = next,
                    None => return best,
                }
            }
        }
    };
}
pub(super) use kernel;

/// No instruction, but what follows is not done before the branches that lead here. Each place needs a number of its own, lest
/// two become one.
macro_rules! here {
    ($place:literal) => {
        // SAFETY: there is nothing in it.
        #[allow(unsafe_code, reason = "no other way to keep a branch a branch")]
        unsafe {
            std::arch::asm!("/* {} */", const $place, options(nomem, nostack, preserves_flags));
        }
    };
}

/// The child in a lane, found by a branch.
#[inline(always)]
fn child(node: &Node8, lane: usize) -> u32 {
    macro_rules! arms {
        ($($lane:literal)*) => {
            match lane {
                $($lane => { here!($lane); node.children[$lane] })*
                _ => { here!(7); node.children[7] }
            }
        };
    }
    arms!(0 1 2 3 4 5 6)
}

/// The next of the children that are met, of which there is one, while the others wait: the nearest, with the nearer of the others
/// on top. Where any hit will do the first will do too, and at no distance, since no limit will pass the others over.
///
/// `EVEX` changes nothing but whose function this is: one that is called from one place is compiled into it, with its features.
#[inline]
#[target_feature(enable = "avx2,bmi1")]
pub(super) fn descend<const ANY: bool, const EVEX: bool>(
    tree: &Tree8,
    node: &Node8,
    near: __m256,
    met: u32,
    stack: &mut Stack,
) -> u32 {
    let first = met.trailing_zeros() as usize % WIDTH;
    let mut rest = met & (met - 1);
    if rest == 0 {
        return child(node, first);
    }
    if ANY {
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % WIDTH;
            rest &= rest - 1;
            fetch(tree, node.children[lane]);
            stack.push(waiting(0.0, node.children[lane]));
        }
        return child(node, first);
    }
    let near = array(near);
    let entry = |lane: usize| waiting(near[lane], node.children[lane]);
    let second = rest.trailing_zeros() as usize % WIDTH;
    if rest & (rest - 1) == 0 {
        let (nearer, farther) = if near[first] <= near[second] {
            here!(8);
            (first, second)
        } else {
            here!(9);
            (second, first)
        };
        fetch(tree, node.children[farther]);
        stack.push(entry(farther));
        return child(node, nearer);
    }
    sorted::<EVEX>(tree, met, entry, stack)
}

/// The nearest of three or more children, found by numbers alone.
#[inline]
#[target_feature(enable = "avx2,bmi1")]
fn sorted<const EVEX: bool>(tree: &Tree8, mut met: u32, entry: impl Fn(usize) -> u64, stack: &mut Stack) -> u32 {
    let since = stack.top();
    let mut nearest = u64::MAX;
    while met != 0 {
        let entry = entry(met.trailing_zeros() as usize % WIDTH);
        met &= met - 1;
        fetch(tree, entry as u32);
        let farther = nearest.max(entry);
        nearest = nearest.min(entry);
        if farther != u64::MAX {
            stack.insert(farther, since);
        }
    }
    nearest as u32
}

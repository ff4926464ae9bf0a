//! Single rays in 256-bit registers.

use std::arch::x86_64::*;
use std::mem::MaybeUninit;

use super::nodes8::{LEAF, Node8, Tree8, WIDTH};
use super::packet::NOTHING;
use super::single::Way;
use super::stack::{FEW, Stack, waiting};
use super::vector8::{Ray8, array, fetch};

/// Finds the nearest hit of a ray, or whether anything is hit.
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
pub(super) fn trace<const ANY: bool>(tree: &Tree8, way: &mut Way) {
    let ray = Ray8::new(way, tree.extent);
    let mut few = [MaybeUninit::uninit(); FEW];
    let mut many = Vec::new();
    let mut stack = Stack::new(if tree.waiting <= FEW {
        &mut few
    } else {
        many.resize(tree.waiting, MaybeUninit::uninit());
        &mut many
    });
    let mut child = 0;
    loop {
        if child & LEAF == 0 {
            let node = &tree.nodes[child as usize];
            let (near, far) = ray.crossings(node, _mm256_set1_ps(way.limit));
            let met = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(near, far)) as u32;
            if met != 0 {
                child = descend::<ANY>(tree, node, near, met, &mut stack);
                continue;
            }
        } else {
            ray.test::<ANY, false>(&tree.blocks[(child ^ LEAF) as usize], tree.pad, way);
            if ANY && way.triangle != NOTHING {
                return;
            }
        }
        match stack.next(way.limit) {
            None => return,
            Some(next) => child = next,
        }
    }
}

/// The nearest of the children that are met; the others wait, the nearer on top where distances matter.
#[inline]
#[target_feature(enable = "avx2,bmi1")]
pub(super) fn descend<const ANY: bool>(
    tree: &Tree8,
    node: &Node8,
    near: __m256,
    mut met: u32,
    stack: &mut Stack,
) -> u32 {
    let near = array(near);
    let first = met.trailing_zeros() as usize % WIDTH;
    met &= met - 1;
    if met == 0 {
        return node.children[first];
    }
    fetch(tree, node.children[first]);
    let mut nearest = waiting(near[first], node.children[first]);
    let bottom = stack.len();
    while met != 0 {
        let k = met.trailing_zeros() as usize % WIDTH;
        met &= met - 1;
        fetch(tree, node.children[k]);
        let entry = waiting(near[k], node.children[k]);
        let farther = nearest.max(entry);
        nearest = nearest.min(entry);
        if ANY {
            stack.push(farther);
        } else {
            stack.insert(farther, bottom);
        }
    }
    nearest as u32
}

//! Single rays in 256-bit registers with the mask registers and the thirty-two registers of AVX-512VL.

use std::arch::x86_64::*;
use std::mem::MaybeUninit;

use super::nodes8::{LEAF, Tree8};
use super::packet::NOTHING;
use super::single::Way;
use super::single_avx2::descend;
use super::stack::{FEW, Stack};
use super::vector8::Ray8;

/// Finds the nearest hit of a ray, or whether anything is hit.
#[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
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
            let met = u32::from(_mm256_cmp_ps_mask::<_CMP_LE_OQ>(near, far));
            if met != 0 {
                child = descend::<ANY>(tree, node, near, met, &mut stack);
                continue;
            }
        } else {
            ray.test::<ANY, true>(&tree.blocks[(child ^ LEAF) as usize], tree.pad, way);
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

//! The tree: built by obvhs, stored as pairs of boxes.

use std::sync::OnceLock;

use glam::Vec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use super::nodes8::Tree8;
use super::packet_tree::PacketTree;
use super::{Bounds, Kernel, Triangle, box_padding, pages};

/// Most triangles in a leaf; a leaf's count is stored in 3 bits.
const LEAF_TRIANGLES: u32 = 8;

/// A triangle as the kernels read it: 64 bytes, one cache line.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Slot {
    pub corners: [Vec3; 3],
    pub bounds: Bounds,
    pub id: u32,
}

/// An inner node: the boxes of its two children and where they are. One cache line.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Node {
    pub bounds: [Bounds; 2],
    pub children: [Child; 2],
}

/// An inner node's index, or a leaf's first slot and count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Child(u32);

impl Child {
    const LEAF: u32 = 1 << 31;

    fn inner(node: usize) -> Self {
        Self(u32::try_from(node).ok().filter(|&n| n < Self::LEAF).expect("fewer than 2³¹ nodes"))
    }

    fn leaf(first: usize, count: u32) -> Self {
        let first = u32::try_from(first).ok().filter(|&f| f < 1 << 28).expect("at most 2²⁸ triangles");
        assert!((1..=LEAF_TRIANGLES).contains(&count));
        Self(Self::LEAF | first << 3 | (count - 1))
    }

    /// The leaf's slots, or the inner node.
    #[inline(always)]
    pub fn split(self) -> Result<std::ops::Range<usize>, usize> {
        if self.0 & Self::LEAF == 0 {
            return Err(self.0 as usize);
        }
        let first = ((self.0 & !Self::LEAF) >> 3) as usize;
        Ok(first..first + (self.0 & 7) as usize + 1)
    }
}

/// Triangles in a tree of boxes, for closest-hit and occlusion queries.
#[derive(Debug)]
pub struct Accel {
    pub(super) nodes: Vec<Node>,
    pub(super) slots: Vec<Slot>,
    /// Levels below the root, which bounds a traversal's stack.
    pub(super) depth: usize,
    pub(super) kernel: Kernel,
    /// How much wider than its triangle a box is.
    pub(super) pad: f32,
    packets: OnceLock<PacketTree>,
    single: OnceLock<Tree8>,
}

impl Accel {
    /// Builds the tree over `triangles`, whose indices hits will name.
    ///
    /// `reach` bounds the coordinates of every ray's origin and its distance to everything it meets; it sets how far boxes
    /// are padded (see [`box_padding`]). Triangles without area are never hit. The build reads no clock, and the
    /// tree is the same on any number of threads.
    pub fn new(triangles: &[Triangle], reach: f32) -> Self {
        let pad = box_padding(reach);
        let mut accel = Self {
            nodes: Vec::new(),
            slots: pages::with_capacity(triangles.len()),
            depth: 0,
            kernel: Kernel::detected(),
            pad,
            packets: OnceLock::new(),
            single: OnceLock::new(),
        };
        if triangles.is_empty() {
            return accel;
        }
        let tree = obvhs_tree(triangles, pad);
        let place = |index: u32| {
            let triangle = &triangles[index as usize];
            Slot { corners: triangle.corners, bounds: triangle.bounds(pad), id: index }
        };
        accel.copy(&tree, &place);
        drop(tree);
        #[cfg(target_arch = "x86_64")]
        if accel.kernel == Kernel::Avx512 {
            accel.packet_tree();
        }
        accel
    }

    /// The kernel that queries run on.
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// Makes queries run on another kernel: to compare them, since all give the same bits.
    ///
    /// # Panics
    /// Where this processor cannot run it ([`Kernel::available`]).
    pub fn set_kernel(&mut self, kernel: Kernel) {
        assert!(kernel.is_available(), "this processor has no {kernel}");
        self.kernel = kernel;
    }

    /// Bytes that trees and triangles take; those for single rays from when one was asked for.
    pub fn bytes(&self) -> usize {
        let packets = self.packets.get().map_or(0, PacketTree::bytes);
        let single = self.single.get().map_or(0, Tree8::bytes);
        size_of_val(self.nodes.as_slice()) + size_of_val(self.slots.as_slice()) + packets + single
    }

    /// The tree for packets in wide registers: made at once where the processor has these, else when it is first asked for.
    #[cfg(target_arch = "x86_64")]
    #[inline]
    pub(super) fn packet_tree(&self) -> &PacketTree {
        self.packets.get_or_init(|| PacketTree::new(self))
    }

    /// The tree for single rays: made when first asked for, since pictures are rendered without one.
    #[inline(always)]
    pub(super) fn single_rays(&self) -> &Tree8 {
        self.single.get_or_init(|| Tree8::new(self, self.pad))
    }

    /// The first node, or the leaf that is all of the tree. There is a node.
    #[cfg(target_arch = "x86_64")]
    pub(super) fn root(&self) -> Child {
        let node = &self.nodes[0];
        if node.children[0] == node.children[1] { node.children[0] } else { Child::inner(0) }
    }

    /// Copies obvhs' tree, depth first, so that a node's first child follows it.
    fn copy(&mut self, tree: &Bvh2, place: &impl Fn(u32) -> Slot) {
        let bounds_of = |n: usize| {
            let aabb = tree.nodes[n].aabb();
            Bounds { min: aabb.min.into(), max: aabb.max.into() }
        };
        if tree.nodes[0].is_leaf() {
            // A root with one child; the other's box is inside out and met by no ray.
            let child = self.leaf(tree, 0, place);
            let nothing = Bounds { min: Vec3::splat(f32::MAX), max: Vec3::splat(f32::MIN) };
            self.nodes.push(Node { bounds: [bounds_of(0), nothing], children: [child, child] });
            self.depth = 1;
            return;
        }
        // Two boxes a node, of all but the root.
        self.nodes = pages::with_capacity(tree.nodes.len() / 2);
        // (obvhs node, our parent and side, level)
        let mut open = vec![(0usize, None::<(usize, usize)>, 1usize)];
        while let Some((n, parent, level)) = open.pop() {
            self.depth = self.depth.max(level);
            let child = if tree.nodes[n].is_leaf() {
                self.leaf(tree, n, place)
            } else {
                let first = tree.nodes[n].first_index as usize;
                let index = self.nodes.len();
                let unset = Child::inner(index);
                self.nodes.push(Node { bounds: [bounds_of(first), bounds_of(first + 1)], children: [unset; 2] });
                open.push((first + 1, Some((index, 1)), level + 1));
                open.push((first, Some((index, 0)), level + 1));
                Child::inner(index)
            };
            if let Some((parent, side)) = parent {
                self.nodes[parent].children[side] = child;
            }
        }
    }

    fn leaf(&mut self, tree: &Bvh2, n: usize, place: &impl Fn(u32) -> Slot) -> Child {
        let node = &tree.nodes[n];
        let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
        let first = self.slots.len();
        self.slots.extend(tree.primitive_indices[range].iter().map(|&i| place(i)));
        Child::leaf(first, node.prim_count)
    }
}

/// obvhs' "medium" recipe, step by step: its one-call helper reads the clock, and its pre-splitting would let a triangle
/// leave its leaf's box.
fn obvhs_tree(triangles: &[Triangle], pad: f32) -> Bvh2 {
    let boxes: Vec<Aabb> = triangles
        .iter()
        .map(|t| {
            let b = t.bounds(pad);
            Aabb::new(b.min.into(), b.max.into())
        })
        .collect();
    let indices = (0..triangles.len() as u32).collect();
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Medium,
        &boxes,
        indices,
        SortPrecision::U64,
        3,
    );
    let mut reinsertion = ReinsertionOptimizer::default();
    reinsertion.run(&mut tree, 0.05, None);
    collapse(&mut tree, LEAF_TRIANGLES, 3.0);
    reinsertion.run(&mut tree, 0.1, None);
    tree
}

#[cfg(test)]
mod tests {
    use super::*;

    /// More triangles than the builder gives to one thread, many of them alike, so that costs tie.
    #[test]
    fn the_tree_is_the_same_on_any_number_of_threads() {
        let triangles: Vec<Triangle> = (0..12_000u32)
            .map(|i| {
                let at = |k: u32| (i.wrapping_mul(2_654_435_761).rotate_left(k) >> 24) as f32;
                let corner = Vec3::new(at(0), at(9), if i % 3 == 0 { 5.0 } else { at(17) });
                Triangle { corners: [corner, corner + Vec3::X, corner + Vec3::Y] }
            })
            .collect();
        let tree = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| Accel::new(&triangles, 600.0))
        };
        let one = tree(1);
        for other in [2, 3, 7].map(tree) {
            assert_eq!((other.depth, other.nodes.len()), (one.depth, one.nodes.len()));
            assert!(other.nodes.iter().zip(&one.nodes).all(|(a, b)| a.bounds == b.bounds && a.children == b.children));
            assert!(other.slots.iter().map(|slot| slot.id).eq(one.slots.iter().map(|slot| slot.id)));
        }
    }
}

//! The tree for single rays: nodes of eight boxes, leaves of up to eight triangles, both a coordinate a row.
//!
//! It is collapsed from the binary tree of the packets, with the cuts that cost a random ray least (dynamic programming after
//! Ylitie, Karras and Laine 2017, doi:10.1145/3105762.3105773): a subtree may be cut into up to seven pieces that its parent
//! takes as children of its own, or, with eight triangles or fewer, become one leaf.

use super::build::{Accel, Child, Node, Slot};
use super::{Bounds, pages};

/// Children of a node, and triangles of a block.
pub(super) const WIDTH: usize = 8;

/// What visiting a node takes, where testing a block of triangles takes [`BLOCK_COST`].
const NODE_COST: f32 = 1.0;
/// A block has more arithmetic than a node, but no children to sort. Rates were the same from 0.7 to 6.
const BLOCK_COST: f32 = 1.5;

/// Eight boxes and what is in them: four cache lines.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Node8 {
    /// By axis: lower planes, upper planes.
    pub planes: [[f32; WIDTH]; 6],
    /// A node's index, or a block's with [`LEAF`].
    pub children: [u32; WIDTH],
}

/// Marks a child that is a block.
pub(super) const LEAF: u32 = 1 << 31;

/// Eight triangles: five cache lines. Where there are fewer, the last one is repeated, which changes no answer.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Block8 {
    /// By corner and axis.
    pub corners: [[[f32; WIDTH]; 3]; 3],
    pub ids: [u32; WIDTH],
}

/// Nodes and blocks; the first node is the root, the first block has no triangle that can be hit.
#[derive(Debug)]
pub(super) struct Tree8 {
    pub nodes: Vec<Node8>,
    pub blocks: Vec<Block8>,
    /// How much wider than its triangle a box is.
    pub pad: f32,
    /// Largest coordinate of a box, without sign.
    pub extent: f32,
    /// Most entries that wait on the way down.
    pub waiting: usize,
}

impl Node8 {
    /// Without children: boxes that no ray meets, and in them nothing.
    const EMPTY: Self = {
        let (low, high) = ([f32::MAX; WIDTH], [f32::MIN; WIDTH]);
        Self { planes: [low, high, low, high, low, high], children: [LEAF; WIDTH] }
    };

    fn set(&mut self, k: usize, bounds: &Bounds, child: u32) {
        for axis in 0..3 {
            self.planes[2 * axis][k] = bounds.min[axis];
            self.planes[2 * axis + 1][k] = bounds.max[axis];
        }
        self.children[k] = child;
    }
}

impl Block8 {
    /// Triangles in one point.
    const EMPTY: Self = Self { corners: [[[0.0; WIDTH]; 3]; 3], ids: [super::NOTHING; WIDTH] };

    fn set(&mut self, lane: usize, slot: &Slot) {
        for (rows, corner) in self.corners.iter_mut().zip(&slot.corners) {
            rows.iter_mut().zip(corner.to_array()).for_each(|(row, c)| row[lane] = c);
        }
        self.ids[lane] = slot.id;
    }

    /// Fills the lanes from `count` ≥ 1 on.
    fn repeat_last(&mut self, count: usize) {
        for row in self.corners.as_flattened_mut() {
            let last = row[count - 1];
            row[count..].fill(last);
        }
        let last = self.ids[count - 1];
        self.ids[count..].fill(last);
    }
}

/// A subtree of the binary tree as its parent knows it.
#[derive(Clone, Copy)]
struct Part {
    bounds: Bounds,
    child: Child,
}

/// What the best cuts of an inner node's subtree cost.
#[derive(Clone, Copy)]
struct Costs {
    /// In at most 1, 2, … 7 pieces.
    pieces: [f32; WIDTH - 1],
    triangles: u32,
    /// How many of at most 2, 3, … 8 pieces of its two children the first child gets.
    first: [u8; WIDTH - 1],
}

/// The binary tree with the costs of its nodes.
struct Collapse<'a> {
    accel: &'a Accel,
    costs: Vec<Costs>,
}

impl Tree8 {
    /// Collapses the binary tree.
    pub fn new(accel: &Accel, pad: f32) -> Self {
        let mut tree = Self { nodes: Vec::new(), blocks: vec![Block8::EMPTY], pad, extent: 0.0, waiting: 1 };
        if accel.nodes.is_empty() {
            tree.nodes.push(Node8::EMPTY);
            return tree;
        }
        let collapse = Collapse::new(accel);
        let (nodes, blocks) = collapse.count();
        tree.nodes = pages::with_capacity(nodes);
        tree.blocks = pages::with_capacity(blocks + 1);
        tree.blocks.push(Block8::EMPTY);
        tree.nodes.push(Node8::EMPTY);
        let (mut pieces, mut scratch) = (Vec::with_capacity(WIDTH), Vec::new());
        // (our node, binary node, level)
        let mut open = vec![(0usize, 0usize, 1usize)];
        while let Some((at, binary, level)) = open.pop() {
            tree.waiting = tree.waiting.max(level * (WIDTH - 1) + 1);
            pieces.clear();
            collapse.cut(binary, WIDTH, &mut pieces);
            for (k, piece) in pieces.iter().enumerate() {
                let child = match collapse.inner(piece) {
                    None => {
                        tree.blocks.push(collapse.block(piece, &mut scratch));
                        LEAF | small(tree.blocks.len() - 1)
                    }
                    Some(inner) => {
                        // Siblings stand side by side.
                        tree.nodes.push(Node8::EMPTY);
                        open.push((tree.nodes.len() - 1, inner, level + 1));
                        small(tree.nodes.len() - 1)
                    }
                };
                let Bounds { min, max } = piece.bounds;
                tree.extent = tree.extent.max(min.abs().max_element()).max(max.abs().max_element());
                tree.nodes[at].set(k, &piece.bounds, child);
            }
        }
        tree
    }

    /// A node by its index in another node, or the root.
    #[inline(always)]
    pub fn node(&self, index: u32) -> &Node8 {
        debug_assert!((index as usize) < self.nodes.len());
        // SAFETY: the root, and the children that `new` puts into nodes, are in the tree; nothing else has such an index.
        #[allow(unsafe_code, reason = "the check is on the way from node to node")]
        unsafe {
            self.nodes.get_unchecked(index as usize)
        }
    }

    /// A block by its index in a node, without [`LEAF`].
    #[inline(always)]
    pub fn block(&self, index: u32) -> &Block8 {
        debug_assert!((index as usize) < self.blocks.len());
        // SAFETY: as above.
        #[allow(unsafe_code, reason = "as above")]
        unsafe {
            self.blocks.get_unchecked(index as usize)
        }
    }

    /// Bytes of nodes and blocks.
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.blocks.as_slice())
    }
}

fn small(index: usize) -> u32 {
    u32::try_from(index).ok().filter(|&i| i < LEAF).expect("fewer than 2³¹ nodes and blocks")
}

fn half_area(bounds: &Bounds) -> f32 {
    let side = bounds.max - bounds.min;
    // A root with one child has a second box that is inside out.
    if side.x < 0.0 { 0.0 } else { side.x * side.y + side.y * side.z + side.z * side.x }
}

fn parts(node: &Node) -> [Part; 2] {
    [0, 1].map(|side| Part { bounds: node.bounds[side], child: node.children[side] })
}

/// Least costs of two subtrees in at most 2, 3, … 8 pieces together, and how many of them the first one gets.
fn best_splits(a: &[f32; WIDTH - 1], b: &[f32; WIDTH - 1]) -> [(f32, u8); WIDTH - 1] {
    std::array::from_fn(|k| {
        // At most k + 2 pieces: k + 1 of the first and 1 of the second, or …
        (1..=k).fold((a[0] + b[k], 1), |best, first| {
            let cost = a[first] + b[k - first];
            if cost < best.0 { (cost, first as u8 + 1) } else { best }
        })
    })
}

impl<'a> Collapse<'a> {
    fn new(accel: &'a Accel) -> Self {
        let unset = Costs { pieces: [0.0; WIDTH - 1], triangles: 0, first: [1; WIDTH - 1] };
        let mut collapse = Self { accel, costs: vec![unset; accel.nodes.len()] };
        // A node's children come after it.
        for n in (0..accel.nodes.len()).rev() {
            collapse.costs[n] = collapse.costs_of(n);
        }
        collapse
    }

    fn costs_of(&self, n: usize) -> Costs {
        let [a, b] = parts(&self.accel.nodes[n]);
        let area = half_area(&Bounds { min: a.bounds.min.min(b.bounds.min), max: a.bounds.max.max(b.bounds.max) });
        let triangles = self.triangles(&a) + self.triangles(&b);
        let splits = best_splits(&self.pieces(&a), &self.pieces(&b));
        let as_node = area * NODE_COST + splits[WIDTH - 2].0;
        let as_leaf = if triangles as usize <= WIDTH { area * BLOCK_COST } else { f32::INFINITY };
        let mut pieces = [as_node.min(as_leaf); WIDTH - 1];
        for most in 2..WIDTH {
            pieces[most - 1] = splits[most - 2].0.min(pieces[most - 2]);
        }
        Costs { pieces, triangles, first: splits.map(|(_, first)| first) }
    }

    fn triangles(&self, part: &Part) -> u32 {
        match part.child.split() {
            Ok(slots) => slots.len() as u32,
            Err(inner) => self.costs[inner].triangles,
        }
    }

    /// Costs of a subtree in at most 1, 2, … 7 pieces.
    fn pieces(&self, part: &Part) -> [f32; WIDTH - 1] {
        match part.child.split() {
            Ok(_) => [half_area(&part.bounds) * BLOCK_COST; WIDTH - 1],
            Err(inner) => self.costs[inner].pieces,
        }
    }

    /// The children of the 8-wide node over binary node `n`, or the pieces of its subtree.
    fn cut(&self, n: usize, most: usize, pieces: &mut Vec<Part>) {
        let both = parts(&self.accel.nodes[n]);
        let first = usize::from(self.costs[n].first[most - 2]);
        for (part, most) in both.iter().zip([first, most - first]) {
            self.cut_part(part, most, pieces);
        }
    }

    fn cut_part(&self, part: &Part, most: usize, pieces: &mut Vec<Part>) {
        match part.child.split() {
            Err(inner) if self.costs[inner].pieces[most - 1] < self.costs[inner].pieces[0] => {
                // The fewest pieces of that cost.
                let costs = &self.costs[inner].pieces;
                let fewest = (1..=most).find(|&m| costs[m - 1] == costs[most - 1]).unwrap_or(most);
                self.cut(inner, fewest, pieces);
            }
            // The root's second box, where it has one child, is inside out.
            _ if part.bounds.min.x > part.bounds.max.x => {}
            _ => pieces.push(*part),
        }
    }

    /// The binary node where a piece is a node, `None` where it is a leaf.
    fn inner(&self, part: &Part) -> Option<usize> {
        let inner = part.child.split().err()?;
        let cost = self.costs[inner].pieces[0];
        let fits = self.costs[inner].triangles as usize <= WIDTH;
        (!fits || cost < half_area(&part.bounds) * BLOCK_COST).then_some(inner)
    }

    /// The triangles of a piece that is a leaf; `open` is scratch.
    fn block(&self, part: &Part, open: &mut Vec<Child>) -> Block8 {
        let mut block = Block8::EMPTY;
        let mut count = 0;
        open.clear();
        open.push(part.child);
        while let Some(child) = open.pop() {
            match child.split() {
                Err(inner) => open.extend(self.accel.nodes[inner].children),
                Ok(slots) => {
                    for slot in &self.accel.slots[slots] {
                        block.set(count, slot);
                        count += 1;
                    }
                }
            }
        }
        block.repeat_last(count);
        block
    }

    /// Nodes and blocks that the tree will have.
    fn count(&self) -> (usize, usize) {
        let (mut nodes, mut blocks) = (0, 0);
        let mut pieces = Vec::with_capacity(WIDTH);
        let mut open = vec![0];
        while let Some(n) = open.pop() {
            nodes += 1;
            pieces.clear();
            self.cut(n, WIDTH, &mut pieces);
            for piece in &pieces {
                match self.inner(piece) {
                    None => blocks += 1,
                    Some(inner) => open.push(inner),
                }
            }
        }
        (nodes, blocks)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::{Triangle, box_padding};
    use super::*;

    /// The triangles under a child, all of whose own boxes must lie within the child's.
    fn under(tree: &Tree8, child: u32, bounds: &Bounds, found: &mut Vec<u32>) {
        let holds = |b: &Bounds| bounds.min.cmple(b.min).all() && bounds.max.cmpge(b.max).all();
        if child & LEAF == 0 {
            let node = &tree.nodes[child as usize];
            for k in 0..WIDTH {
                let plane = |row: usize| node.planes[row][k];
                let inner = Bounds {
                    min: Vec3::new(plane(0), plane(2), plane(4)),
                    max: Vec3::new(plane(1), plane(3), plane(5)),
                };
                if inner.min.x <= inner.max.x {
                    assert!(holds(&inner), "{inner:?} in {bounds:?}");
                    under(tree, node.children[k], &inner, found);
                }
            }
            return;
        }
        let block = &tree.blocks[(child ^ LEAF) as usize];
        for k in 0..WIDTH {
            let corners =
                [0, 1, 2].map(|c: usize| Vec3::from_array([0, 1, 2].map(|axis: usize| block.corners[c][axis][k])));
            assert!(holds(&Triangle { corners }.bounds(tree.pad)), "{corners:?} in {bounds:?}");
            found.push(block.ids[k]);
        }
    }

    #[test]
    fn every_triangle_is_in_one_block_and_every_box_holds_what_is_under_it() {
        for count in [1usize, 2, 7, 8, 9, 100, 3000] {
            let place = |i: usize, k: usize| ((i * 7919 + k * 104_729) % 1000) as f32 * 0.01;
            let triangles: Vec<Triangle> = (0..count)
                .map(|i| {
                    let centre = Vec3::new(place(i, 0), place(i, 1), place(i, 2));
                    Triangle { corners: [centre, centre + Vec3::X * 0.1, centre + Vec3::Y * place(i, 3) * 0.1] }
                })
                .collect();
            let tree = Tree8::new(&Accel::new(&triangles, 20.0), box_padding(20.0));
            let mut found = Vec::new();
            let all = Bounds { min: Vec3::splat(f32::MIN), max: Vec3::splat(f32::MAX) };
            under(&tree, 0, &all, &mut found);
            // A block's last triangle is repeated; no triangle is in two blocks.
            found.dedup();
            found.sort_unstable();
            assert_eq!(found, (0..count as u32).collect::<Vec<_>>());
            let planes = tree.nodes.iter().flat_map(|n| n.planes.as_flattened()).filter(|p| p.abs() < f32::MAX);
            assert_eq!(tree.extent, planes.fold(0.0f32, |most, p| most.max(p.abs())));
        }
    }
}

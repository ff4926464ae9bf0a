//! The tree for packets in wide registers: nodes of eight boxes, each around a node or one triangle.

use std::collections::BinaryHeap;

use glam::Vec3;

use super::build::{Accel, Child, Slot};
use super::{Bounds, pages};

/// Places in a node.
pub(super) const WIDTH: usize = 8;

/// Lower and upper planes of eight boxes, by axis: rows 2·axis and 2·axis + 1.
pub(super) type Planes = [[f32; WIDTH]; 6];

/// The boxes of up to eight nodes and triangles, by coordinate, and where these are. Four cache lines.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct PacketNode {
    /// A triangle's box is its own padded one, which decides hits with the rest of the formula.
    pub planes: Planes,
    /// Index of a node, or a triangle's place.
    pub children: [u32; WIDTH],
    /// Which places hold anything, as bits.
    pub used: u32,
    /// Which of them hold triangles, as bits.
    pub triangles: u32,
}

/// A triangle as packets read it.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(super) struct Corners {
    /// By axis.
    corners: [[f32; 3]; 3],
    pub id: u32,
}

impl Corners {
    fn new(slot: &Slot) -> Self {
        Self { corners: [0, 1, 2].map(|axis: usize| slot.corners.map(|corner| corner[axis])), id: slot.id }
    }

    #[inline(always)]
    pub fn corner(&self, corner: usize) -> Vec3 {
        Vec3::new(self.corners[0][corner], self.corners[1][corner], self.corners[2][corner])
    }
}

/// Nodes, the root first, and triangles in the order of the tree.
#[derive(Debug)]
pub(super) struct PacketTree {
    pub nodes: Vec<PacketNode>,
    pub triangles: Vec<Corners>,
    /// Most nodes that wait on the way down.
    pub waiting: usize,
}

impl PacketNode {
    const EMPTY: Self = Self { planes: [[0.0; WIDTH]; 6], children: [0; WIDTH], used: 0, triangles: 0 };

    fn put(&mut self, bounds: &Bounds, child: usize, is_triangle: bool) {
        let place = self.used.trailing_ones() as usize;
        for axis in 0..3 {
            self.planes[2 * axis][place] = bounds.min[axis];
            self.planes[2 * axis + 1][place] = bounds.max[axis];
        }
        self.children[place] = u32::try_from(child).expect("fewer than 2³² nodes and triangles");
        self.used |= 1 << place;
        self.triangles |= u32::from(is_triangle) << place;
    }
}

/// A subtree of the binary tree that stands in a node, ordered by the surface of its box.
struct Part {
    half_area: f32,
    bounds: Bounds,
    child: Child,
}

impl PartialEq for Part {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Part {}

impl PartialOrd for Part {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Part {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.half_area.total_cmp(&other.half_area)
    }
}

/// The binary tree with the number of triangles under each node.
struct Collapse<'a> {
    accel: &'a Accel,
    triangles: Vec<usize>,
}

impl PacketTree {
    /// Collapses the binary tree: of a node's parts the one with the largest box is opened as long as there is room. A subtree
    /// of at most eight triangles becomes these triangles at once.
    pub fn new(accel: &Accel) -> Self {
        let mut tree = Self { nodes: Vec::new(), triangles: pages::with_capacity(accel.slots.len()), waiting: 0 };
        if accel.nodes.is_empty() {
            return tree;
        }
        let collapse = Collapse::new(accel);
        tree.nodes.push(PacketNode::EMPTY);
        // (our node, what is in it, level)
        let mut open = vec![(0, collapse.parts(0), 1)];
        while let Some((at, parts, level)) = open.pop() {
            tree.waiting = tree.waiting.max(level * WIDTH);
            let (nodes, slots) = collapse.fill(parts);
            for slot in slots {
                let place = tree.triangles.len();
                tree.nodes[at].put(&slot.bounds, place, true);
                tree.triangles.push(Corners::new(slot));
            }
            for part in nodes {
                // Siblings stand side by side.
                let child = tree.nodes.len();
                tree.nodes[at].put(&part.bounds, child, false);
                open.push((child, collapse.opened(part.child), level + 1));
                tree.nodes.push(PacketNode::EMPTY);
            }
        }
        tree.nodes = pages::moved(tree.nodes);
        tree
    }

    /// Bytes of nodes and triangles.
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.triangles.as_slice())
    }
}

impl<'a> Collapse<'a> {
    fn new(accel: &'a Accel) -> Self {
        let mut collapse = Self { accel, triangles: vec![0; accel.nodes.len()] };
        // A node's children come after it.
        for n in (0..accel.nodes.len()).rev() {
            collapse.triangles[n] = collapse.parts(n).iter().map(|part| collapse.count(part.child)).sum();
        }
        collapse
    }

    fn count(&self, child: Child) -> usize {
        child.split().map_or_else(|node| self.triangles[node], |slots| slots.len())
    }

    /// The children of a binary node.
    fn parts(&self, node: usize) -> Vec<Part> {
        let node = &self.accel.nodes[node];
        let part = |side: usize| {
            let bounds = node.bounds[side];
            let size = bounds.max - bounds.min;
            // The root's second box, where it has one child, is inside out.
            (size.x >= 0.0).then(|| Part {
                half_area: size.x * size.y + size.y * size.z + size.z * size.x,
                bounds,
                child: node.children[side],
            })
        };
        [0, 1].into_iter().filter_map(part).collect()
    }

    /// What a subtree that stands in a node of its own begins with.
    fn opened(&self, child: Child) -> Vec<Part> {
        match child.split() {
            Err(node) => self.parts(node),
            Ok(_) => vec![Part { half_area: 0.0, bounds: Bounds { min: Vec3::ZERO, max: Vec3::ZERO }, child }],
        }
    }

    /// Opens parts while eight places are enough: nodes that remain, and triangles.
    fn fill(&self, parts: Vec<Part>) -> (Vec<Part>, Vec<&'a Slot>) {
        let mut places = parts.len();
        let mut open = BinaryHeap::from(parts);
        let (mut nodes, mut slots) = (Vec::new(), Vec::new());
        while let Some(part) = open.pop() {
            let count = self.count(part.child);
            if count <= WIDTH && places - 1 + count <= WIDTH {
                places += count - 1;
                self.collect(part.child, &mut slots);
                continue;
            }
            match part.child.split() {
                Err(node) if count > WIDTH && places < WIDTH => {
                    places += 1;
                    open.extend(self.parts(node));
                }
                _ => nodes.push(part),
            }
        }
        (nodes, slots)
    }

    /// The triangles of a subtree.
    fn collect(&self, child: Child, slots: &mut Vec<&'a Slot>) {
        match child.split() {
            Ok(range) => slots.extend(&self.accel.slots[range]),
            Err(node) => self.accel.nodes[node].children.iter().for_each(|&c| self.collect(c, slots)),
        }
    }
}

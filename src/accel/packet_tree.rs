//! The tree for packets in wide registers: nodes of eight boxes, each around a node or one triangle.

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

/// A subtree of the binary tree that stands in a node.
#[derive(Clone, Copy)]
struct Part {
    bounds: Bounds,
    child: Child,
}

/// The binary tree and, for each of its nodes, the surface of all nodes that its subtree becomes where it takes at most 1, 2, … 8 places of
/// the node above.
struct Collapse<'a> {
    accel: &'a Accel,
    costs: Vec<[f32; WIDTH]>,
}

impl PacketTree {
    /// Collapses the binary tree with the cuts that give nodes of the least surface in all (dynamic programming after Ylitie, Karras
    /// and Laine 2017, doi:10.1145/3105762.3105773), since a ray visits as many nodes as boxes it meets. Triangles cost nothing: each is
    /// tested where its own box is met, in whichever node that stands.
    pub fn new(accel: &Accel) -> Self {
        let mut tree = Self { nodes: Vec::new(), triangles: pages::with_capacity(accel.slots.len()), waiting: 0 };
        if accel.nodes.is_empty() {
            return tree;
        }
        let collapse = Collapse::new(accel);
        tree.nodes.push(PacketNode::EMPTY);
        let (mut nodes, mut slots) = (Vec::new(), Vec::new());
        // (our node, the inner node or leaf that it is, level)
        let mut open = vec![(0, accel.root(), 1)];
        while let Some((at, child, level)) = open.pop() {
            tree.waiting = tree.waiting.max(level * WIDTH);
            collapse.open(child, WIDTH, &mut nodes, &mut slots);
            for slot in slots.drain(..) {
                let place = tree.triangles.len();
                tree.nodes[at].put(&slot.bounds, place, true);
                tree.triangles.push(Corners::new(slot));
            }
            for part in nodes.drain(..) {
                // Siblings stand side by side.
                let child = tree.nodes.len();
                tree.nodes[at].put(&part.bounds, child, false);
                open.push((child, part.child, level + 1));
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

fn half_area(bounds: &Bounds) -> f32 {
    let side = bounds.max - bounds.min;
    side.x * side.y + side.y * side.z + side.z * side.x
}

impl<'a> Collapse<'a> {
    fn new(accel: &'a Accel) -> Self {
        let mut collapse = Self { accel, costs: vec![[0.0; WIDTH]; accel.nodes.len()] };
        // A node's children come after it.
        for n in (0..accel.nodes.len()).rev() {
            collapse.costs[n] = collapse.costs_of(n);
        }
        collapse
    }

    /// The children of a binary node.
    fn parts(&self, n: usize) -> [Part; 2] {
        let node = &self.accel.nodes[n];
        [0, 1].map(|side| Part { bounds: node.bounds[side], child: node.children[side] })
    }

    fn costs_of(&self, n: usize) -> [f32; WIDTH] {
        let [a, b] = self.parts(n);
        let area = half_area(&Bounds { min: a.bounds.min.min(b.bounds.min), max: a.bounds.max.max(b.bounds.max) });
        let mut costs = [f32::INFINITY; WIDTH];
        for most in 2..=WIDTH {
            costs[most - 1] = self.best_split(&[a, b], most).0.min(costs[most - 2]);
        }
        let as_node = area + costs[WIDTH - 1];
        costs.map(|cost| cost.min(as_node))
    }

    /// Cost of a subtree in at most `most` ∈ 1..=8 places.
    fn cost(&self, part: &Part, most: usize) -> f32 {
        match part.child.split() {
            Ok(slots) if slots.len() <= most => 0.0,
            Ok(_) => half_area(&part.bounds),
            Err(n) => self.costs[n][most - 1],
        }
    }

    /// Least cost of two subtrees in at most `most` ≥ 2 places together, and how many of them the first one gets.
    fn best_split(&self, [a, b]: &[Part; 2], most: usize) -> (f32, usize) {
        let cost = |first: usize| self.cost(a, first) + self.cost(b, most - first);
        (2..most).fold((cost(1), 1), |best, first| if cost(first) < best.0 { (cost(first), first) } else { best })
    }

    /// The nodes and triangles that are at most `most` ≥ 2 places of a subtree.
    fn open(&self, child: Child, most: usize, nodes: &mut Vec<Part>, slots: &mut Vec<&'a Slot>) {
        match child.split() {
            Ok(range) => slots.extend(&self.accel.slots[range]),
            Err(n) => {
                let both = self.parts(n);
                let (_, first) = self.best_split(&both, most);
                for (part, most) in both.iter().zip([first, most - first]) {
                    self.place(part, most, nodes, slots);
                }
            }
        }
    }

    /// A subtree as a node, or opened where that is better.
    fn place(&self, part: &Part, most: usize, nodes: &mut Vec<Part>, slots: &mut Vec<&'a Slot>) {
        let is_open = match part.child.split() {
            Ok(range) => range.len() <= most,
            Err(n) => most > 1 && self.costs[n][most - 1] < self.costs[n][0],
        };
        if is_open {
            // The fewest places of that cost.
            let cost = self.cost(part, most);
            let fewest = (1..most).find(|&m| self.cost(part, m) == cost).unwrap_or(most);
            self.open(part.child, fewest, nodes, slots);
        } else {
            nodes.push(*part);
        }
    }
}

//! A packet's rays one by one through the packets' tree, for packets with too little in common for a [`Beam`](super::beam::Beam).
//!
//! A ray is tested against the eight boxes of a node at once, and its signed volumes with the three edges of a triangle at once. The
//! operations and their order are those of [`slab`](super::slab) and [`meet`](super::meet).

use std::arch::x86_64::*;
use std::mem::MaybeUninit;

use glam::Vec3;

use super::packet::NOTHING;
use super::packet_tree::{Corners, PacketNode, PacketTree, WIDTH};
use super::stack::{FEW, Stack, waiting};
use super::vector8::{Vec3x8, array, load};

/// A ray on its way, with what it has met so far.
pub(super) struct Way {
    pub origin: Vec3,
    pub direction: Vec3,
    pub reciprocal: Vec3,
    /// Nearest distance so far, or the limit.
    pub limit: f32,
    pub triangle: u32,
}

impl Way {
    /// The rows of a node's planes that the ray passes first, by axis; the others have the last bit of the index flipped.
    #[inline(always)]
    fn near_planes(&self) -> [usize; 3] {
        [0, 1, 2].map(|axis| 2 * axis + usize::from(self.reciprocal[axis].is_sign_negative()))
    }

    /// Takes a hit below the limit, or a tie with a higher triangle; a limit is not a hit.
    #[inline(always)]
    fn take(&mut self, t: f32, id: u32) {
        if t < self.limit || (t == self.limit && id < self.triangle && self.triangle != NOTHING) {
            (self.limit, self.triangle) = (t, id);
        }
    }
}

/// Three coordinates of up to four vectors.
#[derive(Clone, Copy)]
struct Vec3x4 {
    x: __m128,
    y: __m128,
    z: __m128,
}

impl Vec3x4 {
    #[inline]
    #[target_feature(enable = "avx")]
    fn splat(v: Vec3) -> Self {
        Self { x: _mm_set1_ps(v.x), y: _mm_set1_ps(v.y), z: _mm_set1_ps(v.z) }
    }

    /// Corners a, b and c; nothing in the fourth place.
    #[inline]
    #[target_feature(enable = "avx")]
    fn corners(triangle: &Corners) -> Self {
        let at = (&raw const *triangle).cast::<f32>();
        // SAFETY: a triangle is ten words, of which words 0 to 9 are read; each is a number's bits.
        #[allow(unsafe_code, reason = "the load takes a pointer")]
        unsafe {
            Self { x: _mm_loadu_ps(at), y: _mm_loadu_ps(at.add(3)), z: _mm_loadu_ps(at.add(6)) }
        }
    }

    /// What is in other places: for each its two bits of `PLACES`, the first's lowest.
    #[inline]
    #[target_feature(enable = "avx")]
    fn permuted<const PLACES: i32>(self) -> Self {
        Self {
            x: _mm_permute_ps::<PLACES>(self.x),
            y: _mm_permute_ps::<PLACES>(self.y),
            z: _mm_permute_ps::<PLACES>(self.z),
        }
    }

    #[inline]
    #[target_feature(enable = "avx")]
    fn sub(self, b: Self) -> Self {
        Self { x: _mm_sub_ps(self.x, b.x), y: _mm_sub_ps(self.y, b.y), z: _mm_sub_ps(self.z, b.z) }
    }

    #[inline]
    #[target_feature(enable = "avx")]
    fn add(self, b: Self) -> Self {
        Self { x: _mm_add_ps(self.x, b.x), y: _mm_add_ps(self.y, b.y), z: _mm_add_ps(self.z, b.z) }
    }

    #[inline]
    #[target_feature(enable = "avx")]
    fn dot(self, b: Self) -> __m128 {
        let xy = _mm_add_ps(_mm_mul_ps(self.x, b.x), _mm_mul_ps(self.y, b.y));
        _mm_add_ps(xy, _mm_mul_ps(self.z, b.z))
    }

    #[inline]
    #[target_feature(enable = "avx")]
    fn cross(self, b: Self) -> Self {
        Self {
            x: _mm_sub_ps(_mm_mul_ps(self.y, b.z), _mm_mul_ps(self.z, b.y)),
            y: _mm_sub_ps(_mm_mul_ps(self.z, b.x), _mm_mul_ps(self.x, b.z)),
            z: _mm_sub_ps(_mm_mul_ps(self.x, b.y), _mm_mul_ps(self.y, b.x)),
        }
    }
}

/// One ray in all places.
struct Lone {
    origin: Vec3x8,
    reciprocal: Vec3x8,
    near_planes: [usize; 3],
    from: Vec3x4,
    direction: Vec3x4,
}

impl Lone {
    #[inline]
    #[target_feature(enable = "avx")]
    fn new(way: &Way) -> Self {
        Self {
            origin: Vec3x8::splat(way.origin.extend(0.0).to_array()),
            reciprocal: Vec3x8::splat(way.reciprocal.extend(0.0).to_array()),
            near_planes: way.near_planes(),
            from: Vec3x4::splat(way.origin),
            direction: Vec3x4::splat(way.direction),
        }
    }

    /// Where the ray enters and leaves the boxes of a node.
    #[inline]
    #[target_feature(enable = "avx")]
    fn slab(&self, node: &PacketNode) -> (__m256, __m256) {
        let [x, y, z] = self.near_planes;
        let (o, r) = (&self.origin, &self.reciprocal);
        let near = _mm256_max_ps(passed(node, x, o.x, r.x), passed(node, y, o.y, r.y));
        let far = _mm256_min_ps(passed(node, x ^ 1, o.x, r.x), passed(node, y ^ 1, o.y, r.y));
        (_mm256_max_ps(near, passed(node, z, o.z, r.z)), _mm256_min_ps(far, passed(node, z ^ 1, o.z, r.z)))
    }

    /// Tests a triangle whose box the ray enters at `near`, not after it leaves it at `far`. Says whether the limit changed.
    #[inline]
    #[target_feature(enable = "avx,avx512f,avx512vl")]
    fn meet(&self, triangle: &Corners, near: f32, far: f32, way: &mut Way) -> bool {
        const EDGES: u8 = 0b111;
        // Of (a, b, c) the corners before: (c, a, b). So the edges are ca, ab and bc.
        let to = Vec3x4::corners(triangle).sub(self.from);
        let before = to.permuted::<0b00_01_00_10>();
        let edges = before.sub(to);
        let volumes = edges.cross(before.add(to)).dot(self.direction);
        let zero = _mm_setzero_ps();
        let not_below = _mm_cmp_ps_mask::<_CMP_GE_OQ>(volumes, zero) & EDGES;
        let not_above = _mm_cmp_ps_mask::<_CMP_LE_OQ>(volumes, zero) & EDGES;
        if not_below != EDGES && not_above != EDGES {
            return false;
        }
        let normal = edges.cross(edges.permuted::<1>());
        let facing = normal.dot(self.direction);
        let t = _mm_div_ss(to.dot(normal), facing);
        let t = _mm_cvtss_f32(_mm_min_ss(_mm_max_ss(t, _mm_set_ss(near)), _mm_set_ss(far)));
        let before = way.limit;
        if _mm_cvtss_f32(facing) != 0.0 && t > 0.0 && t < f32::INFINITY {
            way.take(t, triangle.id);
        }
        way.limit != before
    }
}

/// Where a ray passes one of the planes of each of eight boxes.
#[inline]
#[target_feature(enable = "avx")]
fn passed(node: &PacketNode, row: usize, origin: __m256, reciprocal: __m256) -> __m256 {
    _mm256_mul_ps(_mm256_sub_ps(load(&node.planes[row]), origin), reciprocal)
}

/// Finds the nearest hit of a ray, or whether anything is hit. There is a node.
#[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,bmi1,bmi2,lzcnt,popcnt")]
pub(super) fn trace<const ANY: bool>(tree: &PacketTree, way: &mut Way) {
    let ray = Lone::new(way);
    let mut few = [MaybeUninit::uninit(); FEW];
    let mut many = Vec::new();
    if tree.waiting > FEW {
        many.resize(tree.waiting, MaybeUninit::uninit());
    }
    // SAFETY: there is room for the most that waits.
    #[allow(unsafe_code, reason = "a stack that does not check")]
    let mut stack = unsafe { Stack::new(if tree.waiting > FEW { &mut many } else { &mut few }) };
    let mut index = 0;
    loop {
        let node = &tree.nodes[index as usize];
        let (near, far) = ray.slab(node);
        let enters = _mm256_max_ps(near, _mm256_setzero_ps());
        let mut met = before(enters, _mm256_min_ps(far, _mm256_set1_ps(way.limit))) & node.used;
        let mut triangles = met & node.triangles;
        if triangles != 0 {
            let (near, far) = (array(near), array(far));
            let mut changed = false;
            while triangles != 0 {
                let place = triangles.trailing_zeros() as usize % WIDTH;
                triangles &= triangles - 1;
                changed |= ray.meet(&tree.triangles[node.children[place] as usize], near[place], far[place], way);
                if ANY && way.triangle != NOTHING {
                    return;
                }
            }
            if changed {
                met &= before(enters, _mm256_set1_ps(way.limit));
            }
        }
        met &= !node.triangles;
        index = if met != 0 {
            tree.descend::<ANY>(node, enters, met, &mut stack)
        } else {
            match stack.next(way.limit) {
                None => return,
                Some(next) => next,
            }
        };
    }
}

/// Which of eight numbers are not greater than others, as bits.
#[inline]
#[target_feature(enable = "avx512f,avx512vl")]
fn before(a: __m256, b: __m256) -> u32 {
    u32::from(_mm256_cmp_ps_mask::<_CMP_LE_OQ>(a, b))
}

impl PacketTree {
    /// The nearest of the nodes that are met, at the places of the bits of `met`; the others wait, the nearer on top where distances, which
    /// are not below 0, matter.
    #[inline]
    #[target_feature(enable = "avx512f,avx512vl,bmi1")]
    pub fn descend<const ANY: bool>(&self, node: &PacketNode, near: __m256, mut met: u32, stack: &mut Stack) -> u32 {
        let place = met.trailing_zeros() as usize % WIDTH;
        met &= met - 1;
        if met == 0 {
            return node.children[place];
        }
        let near = array(near);
        self.fetch(node.children[place]);
        let mut nearest = waiting(near[place], node.children[place]);
        let since = stack.top();
        while met != 0 {
            let place = met.trailing_zeros() as usize % WIDTH;
            met &= met - 1;
            self.fetch(node.children[place]);
            let entry = waiting(near[place], node.children[place]);
            let farther = nearest.max(entry);
            nearest = nearest.min(entry);
            // The order cannot change the answer.
            if ANY {
                stack.push(farther);
            } else {
                stack.insert(farther, since);
            }
        }
        nearest as u32
    }

    /// Asks for a node's cache lines before they are read.
    #[inline]
    #[target_feature(enable = "avx")]
    fn fetch(&self, node: u32) {
        let at = self.nodes.as_ptr().wrapping_add(node as usize).cast::<i8>();
        for line in 0..4 {
            _mm_prefetch::<_MM_HINT_T0>(at.wrapping_add(64 * line));
        }
    }
}

//! Packets in 512-bit registers: one for each coordinate of all 16 rays.
//!
//! The operations and their order are those of [`slab`](super::slab) and [`meet`](super::meet), written as instructions; what differs from the
//! portable kernel is the bookkeeping: masks stay masks, the packet's [`Beam`] is tested against eight boxes before any ray is, and a packet
//! whose rays all run into one octant knows which planes of a box are the near ones. Rays that have too little in common go through the same
//! tree one by one ([`lone`]).

use std::arch::x86_64::*;
use std::mem::MaybeUninit;

use super::beam::{Beam, MIXED};
use super::build::Accel;
use super::lone::{self, Way};
use super::packet::{LANES, NOTHING, Packet};
use super::packet_tree::{Corners, PacketNode, PacketTree, Planes, WIDTH};
use super::stack::{FEW, Stack};
use super::vector16::{Vec3x16, load, store};

/// The rays of a packet in registers. Idle lanes repeat a ray that is not idle, for the beam's sake.
struct Rays {
    origin: Vec3x16,
    direction: Vec3x16,
    reciprocal: Vec3x16,
    limit: __m512,
    triangle: __m512i,
}

impl Rays {
    /// Where each lane enters and leaves a box.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn slab<const OCTANT: u8>(&self, planes: &Planes, place: usize) -> (__m512, __m512) {
        let (nx, fx) = axis::<OCTANT, 0>(planes[0][place], planes[1][place], self.origin.x, self.reciprocal.x);
        let (ny, fy) = axis::<OCTANT, 1>(planes[2][place], planes[3][place], self.origin.y, self.reciprocal.y);
        let (nz, fz) = axis::<OCTANT, 2>(planes[4][place], planes[5][place], self.origin.z, self.reciprocal.z);
        (_mm512_max_ps(_mm512_max_ps(nx, ny), nz), _mm512_min_ps(_mm512_min_ps(fx, fy), fz))
    }

    /// Which lanes meet a box no farther than their limit.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn meets<const OCTANT: u8>(&self, planes: &Planes, place: usize) -> u16 {
        let (near, far) = self.slab::<OCTANT>(planes, place);
        let near = _mm512_max_ps(near, _mm512_setzero_ps());
        _mm512_cmp_ps_mask::<_CMP_LE_OQ>(near, _mm512_min_ps(far, self.limit))
    }

    /// Tests a triangle against all lanes: keeps the nearest hit, of equally near ones the lowest triangle; or retires the lanes that
    /// it stops. Says whether any limit changed.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn meet<const ANY: bool, const OCTANT: u8>(&mut self, planes: &Planes, place: usize, triangle: &Corners) -> bool {
        let zero = _mm512_setzero_ps();
        let (near, far) = self.slab::<OCTANT>(planes, place);
        let enters = _mm512_max_ps(near, zero);
        let inside = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(enters, _mm512_min_ps(far, self.limit));
        if inside == 0 {
            return false;
        }
        let a = Vec3x16::splat(triangle.corner(0)).sub(self.origin);
        let b = Vec3x16::splat(triangle.corner(1)).sub(self.origin);
        let c = Vec3x16::splat(triangle.corner(2)).sub(self.origin);
        let (ca, ab, bc) = (c.sub(a), a.sub(b), b.sub(c));
        let u = ca.cross(c.add(a)).dot(self.direction);
        let v = ab.cross(a.add(b)).dot(self.direction);
        let not_below = _mm512_cmp_ps_mask::<_CMP_GE_OQ>(u, zero) & _mm512_cmp_ps_mask::<_CMP_GE_OQ>(v, zero);
        let not_above = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(u, zero) & _mm512_cmp_ps_mask::<_CMP_LE_OQ>(v, zero);
        if inside & (not_below | not_above) == 0 {
            return false;
        }
        let w = bc.cross(b.add(c)).dot(self.direction);
        let not_below = not_below & _mm512_cmp_ps_mask::<_CMP_GE_OQ>(w, zero);
        let not_above = not_above & _mm512_cmp_ps_mask::<_CMP_LE_OQ>(w, zero);
        let inside = inside & (not_below | not_above);
        if inside == 0 {
            return false;
        }
        let normal = ca.cross(ab);
        let facing = normal.dot(self.direction);
        let t = _mm512_div_ps(a.dot(normal), facing);
        let t = _mm512_min_ps(_mm512_max_ps(t, near), far);
        let hit = inside
            & _mm512_cmp_ps_mask::<_CMP_NEQ_OQ>(facing, zero)
            & _mm512_cmp_ps_mask::<_CMP_GT_OQ>(t, zero)
            & _mm512_cmp_ps_mask::<_CMP_LT_OQ>(t, _mm512_set1_ps(f32::INFINITY));
        let id = _mm512_set1_epi32(triangle.id as i32);
        let nearer = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(t, self.limit);
        if ANY {
            let stopped = hit & nearer;
            self.limit = _mm512_mask_mov_ps(self.limit, stopped, _mm512_set1_ps(f32::NEG_INFINITY));
            self.triangle = _mm512_mask_mov_epi32(self.triangle, stopped, id);
            stopped != 0
        } else {
            // A limit is not a hit: the first hit must lie strictly before it, and then has a triangle.
            let tie = _mm512_cmp_ps_mask::<_CMP_EQ_OQ>(t, self.limit)
                & _mm512_cmplt_epu32_mask(id, self.triangle)
                & _mm512_cmpneq_epi32_mask(self.triangle, _mm512_set1_epi32(NOTHING as i32));
            let nearer = hit & (nearer | tie);
            self.limit = _mm512_mask_mov_ps(self.limit, nearer, t);
            self.triangle = _mm512_mask_mov_epi32(self.triangle, nearer, id);
            nearer != 0
        }
    }

    /// Tests the triangles at some places of a node, see [`Self::meet`].
    #[inline]
    #[target_feature(enable = "avx512f,bmi1")]
    fn meet_some<const ANY: bool, const OCTANT: u8>(
        &mut self,
        tree: &PacketTree,
        node: &PacketNode,
        mut places: u32,
    ) -> bool {
        let mut changed = false;
        while places != 0 {
            let place = places.trailing_zeros() as usize % WIDTH;
            places &= places - 1;
            changed |= self.meet::<ANY, OCTANT>(&node.planes, place, &tree.triangles[node.children[place] as usize]);
        }
        changed
    }

    /// Of some places of a node those whose boxes a lane meets no farther than its limit.
    #[inline]
    #[target_feature(enable = "avx512f,bmi1")]
    fn meet_inner<const OCTANT: u8>(&self, node: &PacketNode, places: u32) -> u32 {
        let (mut left, mut met) = (places, 0);
        while left != 0 {
            let place = left.trailing_zeros() as usize % WIDTH;
            left &= left - 1;
            met |= u32::from(self.meets::<OCTANT>(&node.planes, place) != 0) << place;
        }
        met
    }

    /// The largest limit of all lanes.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn farthest(&self) -> f32 {
        _mm512_reduce_max_ps(self.limit)
    }
}

/// Where each lane passes the near and the far one of two planes.
#[inline]
#[target_feature(enable = "avx512f")]
fn axis<const OCTANT: u8, const AXIS: u8>(low: f32, high: f32, origin: __m512, reciprocal: __m512) -> (__m512, __m512) {
    let at = |plane: f32| _mm512_mul_ps(_mm512_sub_ps(_mm512_set1_ps(plane), origin), reciprocal);
    let (a, b) = (at(low), at(high));
    if OCTANT == MIXED {
        (_mm512_min_ps(a, b), _mm512_max_ps(a, b))
    } else if OCTANT >> AXIS & 1 == 0 {
        // Rounding is monotone: the lower plane comes first, as their minimum says.
        (a, b)
    } else {
        (b, a)
    }
}

/// Which way all rays run, or [`MIXED`], and along how many axes they run both ways.
#[inline]
#[target_feature(enable = "avx512f,avx512dq")]
fn octant(reciprocal: &Vec3x16) -> (u8, u32) {
    let (mut octant, mut both) = (0, 0);
    for (axis, row) in [(0, reciprocal.x), (1, reciprocal.y), (2, reciprocal.z)] {
        match _mm512_movepi32_mask(_mm512_castps_si512(row)) {
            0 => {}
            0xffff => octant |= 1 << axis,
            _ => both += 1,
        }
    }
    (if both == 0 { octant } else { MIXED }, both)
}

/// Whether 16 rays have too little in common for a beam: they run through each other's octants, and the box around their directions has
/// a diagonal longer than √2 times a direction.
#[inline]
#[target_feature(enable = "avx512f")]
fn spread(direction: &Vec3x16) -> bool {
    let (mut diagonal, mut length) = (0.0, 0.0);
    for row in [direction.x, direction.y, direction.z] {
        let extent = _mm512_reduce_max_ps(row) - _mm512_reduce_min_ps(row);
        diagonal += extent * extent;
        length += _mm512_cvtss_f32(row) * _mm512_cvtss_f32(row);
    }
    diagonal > 2.0 * length
}

/// In a tree of so few nodes it takes longer to find out which rays go where than to take all of them everywhere.
const FEW_NODES: usize = 32;

/// Finds the nearest hits of a packet, or whether anything is hit.
#[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,bmi1,bmi2,lzcnt,popcnt")]
pub(super) fn trace<const ANY: bool>(accel: &Accel, packet: &mut Packet) {
    let tree = accel.packet_tree();
    let limit = load(packet.limits());
    let live = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(limit, _mm512_set1_ps(f32::NEG_INFINITY));
    if tree.nodes.is_empty() || live == 0 {
        return;
    }
    let stand_in = _mm512_set1_epi32(live.trailing_zeros() as i32);
    let (origin, direction, reciprocal) = packet.rows();
    let mut rays = Rays {
        origin: Vec3x16::load(origin, live, stand_in),
        direction: Vec3x16::load(direction, live, stand_in),
        reciprocal: Vec3x16::load(reciprocal, live, stand_in),
        limit,
        triangle: _mm512_set1_epi32(NOTHING as i32),
    };
    let (octant, both) = octant(&rays.reciprocal);
    if both >= 2 && tree.nodes.len() > FEW_NODES && spread(&rays.direction) {
        trace_alone::<ANY>(tree, packet, live);
        return;
    }
    let pad = accel.pad;
    match octant {
        0 => traverse::<ANY, 0>(tree, pad, &mut rays),
        1 => traverse::<ANY, 1>(tree, pad, &mut rays),
        2 => traverse::<ANY, 2>(tree, pad, &mut rays),
        3 => traverse::<ANY, 3>(tree, pad, &mut rays),
        4 => traverse::<ANY, 4>(tree, pad, &mut rays),
        5 => traverse::<ANY, 5>(tree, pad, &mut rays),
        6 => traverse::<ANY, 6>(tree, pad, &mut rays),
        7 => traverse::<ANY, 7>(tree, pad, &mut rays),
        _ => traverse::<ANY, MIXED>(tree, pad, &mut rays),
    }
    let (limit, triangle) = packet.results();
    store(limit, rays.limit);
    *triangle = triangles(rays.triangle);
}

/// Traces the rays of the `live` lanes one by one.
#[inline]
#[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,bmi1,bmi2,lzcnt,popcnt")]
fn trace_alone<const ANY: bool>(tree: &PacketTree, packet: &mut Packet, mut live: u16) {
    while live != 0 {
        let lane = live.trailing_zeros() as usize % LANES;
        live &= live - 1;
        let (origin, direction, reciprocal) = packet.lane(lane);
        let mut way = Way { origin, direction, reciprocal, limit: packet.limits()[lane], triangle: NOTHING };
        lone::trace::<ANY>(tree, &mut way);
        let (limit, triangle) = packet.results();
        limit[lane] = if ANY && way.triangle != NOTHING { f32::NEG_INFINITY } else { way.limit };
        triangle[lane] = way.triangle;
    }
}

#[inline]
#[target_feature(enable = "avx512f")]
fn triangles(ids: __m512i) -> [u32; LANES] {
    let mut out = [0; LANES];
    // SAFETY: 16 words are written to 16 words.
    #[allow(unsafe_code, reason = "the store takes a pointer")]
    unsafe {
        _mm512_storeu_si512(out.as_mut_ptr().cast(), ids);
    }
    out
}

/// So few boxes of nodes that testing all rays against them takes longer than it spares.
const FEW_BOXES: u32 = 2;

#[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,bmi1,bmi2,lzcnt,popcnt")]
fn traverse<const ANY: bool, const OCTANT: u8>(tree: &PacketTree, pad: f32, rays: &mut Rays) {
    let mut few = [MaybeUninit::uninit(); FEW];
    let mut many = Vec::new();
    if tree.waiting > FEW {
        many.resize(tree.waiting, MaybeUninit::uninit());
    }
    // SAFETY: there is room for the most that waits.
    #[allow(unsafe_code, reason = "a stack that does not check")]
    let mut stack = unsafe { Stack::new(if tree.waiting > FEW { &mut many } else { &mut few }) };
    let beam = Beam::around::<OCTANT>(&rays.origin, &rays.direction, &rays.reciprocal, pad);
    let mut end = beam.end(rays.farthest());
    let is_large = tree.nodes.len() > FEW_NODES;
    let mut index = 0;
    loop {
        let node = &tree.nodes[index as usize];
        let (near, mut met) = beam.meets::<OCTANT>(&node.planes, end);
        if met & node.triangles != 0 && rays.meet_some::<ANY, OCTANT>(tree, node, met & node.triangles) {
            let limit = rays.farthest();
            if limit == f32::NEG_INFINITY {
                return;
            }
            end = beam.end(limit);
            met &= u32::from(_mm256_cmp_ps_mask::<_CMP_LE_OQ>(near, _mm256_set1_ps(end)));
        }
        let mut inner = met & node.used & !node.triangles;
        // Camera rays of a pixel are so close together that their beam is as good as they are.
        if is_large && (OCTANT == MIXED || (ANY && inner.count_ones() > FEW_BOXES)) {
            inner = rays.meet_inner::<OCTANT>(node, inner);
        }
        index = if inner != 0 {
            tree.descend::<ANY>(node, beam.all_since_start(near), inner, &mut stack)
        } else {
            match stack.next(beam.since_start(end)) {
                None => return,
                Some(next) => next,
            }
        };
    }
}

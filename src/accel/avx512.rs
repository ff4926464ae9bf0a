//! Packets in 512-bit registers: one for each coordinate of all 16 rays.
//!
//! The operations and their order are those of [`slab`](super::slab) and [`meet`](super::meet), written as instructions; what differs from the
//! portable kernel is the bookkeeping: masks stay masks, the packet's [`Beam`] is tested against eight boxes before any ray is, and a packet
//! whose rays all run into one octant knows which planes of a box are the near ones.

use std::arch::x86_64::*;

use super::beam::{Beam, Bundle, MIXED};
use super::build::Accel;
use super::packet::{LANES, NOTHING, Packet, Row};
use super::packet_tree::{Corners, PacketTree, Planes};

/// Three coordinates of 16 vectors.
#[derive(Clone, Copy)]
struct Vec3x16 {
    x: __m512,
    y: __m512,
    z: __m512,
}

#[inline]
#[target_feature(enable = "avx512f")]
fn load(row: &Row) -> __m512 {
    // SAFETY: a row is 16 floats, which is what is read.
    #[allow(unsafe_code, reason = "the load takes a pointer")]
    unsafe {
        _mm512_loadu_ps(row.as_ptr())
    }
}

#[inline]
#[target_feature(enable = "avx512f")]
fn store(row: &mut Row, values: __m512) {
    // SAFETY: a row is 16 floats, which is what is written.
    #[allow(unsafe_code, reason = "the store takes a pointer")]
    unsafe {
        _mm512_storeu_ps(row.as_mut_ptr(), values);
    }
}

impl Vec3x16 {
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn load(rows: &[Row; 3]) -> Self {
        Self { x: load(&rows[0]), y: load(&rows[1]), z: load(&rows[2]) }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn splat(v: glam::Vec3) -> Self {
        Self { x: _mm512_set1_ps(v.x), y: _mm512_set1_ps(v.y), z: _mm512_set1_ps(v.z) }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn sub(self, b: Self) -> Self {
        Self { x: _mm512_sub_ps(self.x, b.x), y: _mm512_sub_ps(self.y, b.y), z: _mm512_sub_ps(self.z, b.z) }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn add(self, b: Self) -> Self {
        Self { x: _mm512_add_ps(self.x, b.x), y: _mm512_add_ps(self.y, b.y), z: _mm512_add_ps(self.z, b.z) }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn dot(self, b: Self) -> __m512 {
        let xy = _mm512_add_ps(_mm512_mul_ps(self.x, b.x), _mm512_mul_ps(self.y, b.y));
        _mm512_add_ps(xy, _mm512_mul_ps(self.z, b.z))
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn cross(self, b: Self) -> Self {
        Self {
            x: _mm512_sub_ps(_mm512_mul_ps(self.y, b.z), _mm512_mul_ps(self.z, b.y)),
            y: _mm512_sub_ps(_mm512_mul_ps(self.z, b.x), _mm512_mul_ps(self.x, b.z)),
            z: _mm512_sub_ps(_mm512_mul_ps(self.x, b.y), _mm512_mul_ps(self.y, b.x)),
        }
    }
}

/// The rays of a packet in registers.
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
        let [a, b, c] = triangle.corners.map(|corner| Vec3x16::splat(corner).sub(self.origin));
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

    /// The rays that are not idle; at least one is not.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn bundle(&self) -> Bundle {
        let rows = |v: &Vec3x16| [v.x, v.y, v.z];
        Bundle {
            origin: rows(&self.origin),
            direction: rows(&self.direction),
            reciprocal: rows(&self.reciprocal),
            live: self.live(),
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn live(&self) -> u16 {
        _mm512_cmp_ps_mask::<_CMP_GT_OQ>(self.limit, _mm512_set1_ps(f32::NEG_INFINITY))
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

/// Which way all rays that are not idle run, or [`MIXED`].
#[inline]
#[target_feature(enable = "avx512f,avx512dq")]
fn octant(rays: &Rays) -> u8 {
    let live = rays.live();
    let mut octant = 0;
    for (axis, r) in [rays.reciprocal.x, rays.reciprocal.y, rays.reciprocal.z].into_iter().enumerate() {
        let negative = _mm512_movepi32_mask(_mm512_castps_si512(r)) & live;
        match negative {
            0 => {}
            all if all == live => octant |= 1 << axis,
            _ => return MIXED,
        }
    }
    octant
}

/// Finds the nearest hits of a packet, or whether anything is hit.
#[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,bmi1,bmi2,lzcnt,popcnt")]
pub(super) fn trace<const ANY: bool>(accel: &Accel, packet: &mut Packet) {
    let tree = accel.packet_tree();
    let (origin, direction, reciprocal) = packet.rows();
    let mut rays = Rays {
        origin: Vec3x16::load(origin),
        direction: Vec3x16::load(direction),
        reciprocal: Vec3x16::load(reciprocal),
        limit: load(packet.limits()),
        triangle: _mm512_set1_epi32(NOTHING as i32),
    };
    if tree.nodes.is_empty() || rays.live() == 0 {
        return;
    }
    let pad = accel.pad;
    match octant(&rays) {
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

/// Nodes waiting on the way down, on the stack for all but degenerate trees.
const WAITING: usize = 192;

#[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,bmi1,bmi2,lzcnt,popcnt")]
fn traverse<const ANY: bool, const OCTANT: u8>(tree: &PacketTree, pad: f32, rays: &mut Rays) {
    let mut waiting = [(0u32, 0.0f32); WAITING];
    let mut heap = Vec::new();
    let waiting: &mut [(u32, f32)] = if tree.waiting <= WAITING {
        &mut waiting
    } else {
        heap.resize(tree.waiting, (0, 0.0));
        &mut heap
    };
    let beam = Beam::around::<OCTANT>(&rays.bundle(), pad);
    let mut end = beam.end(rays.farthest());
    let mut count = 0;
    let mut index = 0u32;
    loop {
        let node = &tree.nodes[index as usize];
        let (met, near) = beam.meets::<OCTANT>(&node.planes, end);
        let mut triangles = met & node.triangles;
        let mut changed = false;
        while triangles != 0 {
            let place = triangles.trailing_zeros() as usize;
            triangles &= triangles - 1;
            changed |= rays.meet::<ANY, OCTANT>(&node.planes, place, &tree.triangles[node.children[place] as usize]);
        }
        if changed {
            let limit = rays.farthest();
            if limit == f32::NEG_INFINITY {
                return;
            }
            end = beam.end(limit);
        }
        let mut inner = met & node.used & !node.triangles;
        let first = count;
        while inner != 0 {
            let place = inner.trailing_zeros() as usize;
            inner &= inner - 1;
            // Camera rays of a pixel are so close together that their beam is as good as they are.
            if (ANY || OCTANT == MIXED) && rays.meets::<OCTANT>(&node.planes, place) == 0 {
                continue;
            }
            // Farthest first, so that the nearest is taken next; the order cannot change the answer.
            let mut at = count;
            while at > first && waiting[at - 1].1 < near[place] {
                waiting[at] = waiting[at - 1];
                at -= 1;
            }
            waiting[at] = (node.children[place], near[place]);
            count += 1;
        }
        loop {
            if count == 0 {
                return;
            }
            count -= 1;
            if waiting[count].1 <= end {
                break;
            }
        }
        index = waiting[count].0;
    }
}

//! Packets in 512-bit registers: one for each coordinate of all 16 rays.
//!
//! The operations and their order are those of [`slab`](super::slab) and [`meet`](super::meet), written as instructions; what differs from the
//! portable kernel is the bookkeeping: masks stay masks, both children of a node are tested together, and a packet whose rays
//! all run into one octant knows which planes of a box are the near ones.

use std::arch::x86_64::*;

use super::Bounds;
use super::build::{Accel, Slot};
use super::packet::{LANES, NOTHING, Packet, Row, STACK};

/// Octant of a packet whose rays differ in the sign of a coordinate.
const MIXED: u8 = 8;

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
    fn slab<const OCTANT: u8>(&self, bounds: &Bounds) -> (__m512, __m512) {
        let (nx, fx) = axis::<OCTANT, 0>(bounds.min.x, bounds.max.x, self.origin.x, self.reciprocal.x);
        let (ny, fy) = axis::<OCTANT, 1>(bounds.min.y, bounds.max.y, self.origin.y, self.reciprocal.y);
        let (nz, fz) = axis::<OCTANT, 2>(bounds.min.z, bounds.max.z, self.origin.z, self.reciprocal.z);
        (_mm512_max_ps(_mm512_max_ps(nx, ny), nz), _mm512_min_ps(_mm512_min_ps(fx, fy), fz))
    }

    /// Which lanes meet a box no farther than their limit; and where each enters it, 0 at the least.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn meets<const OCTANT: u8>(&self, bounds: &Bounds) -> (u16, __m512) {
        let (near, far) = self.slab::<OCTANT>(bounds);
        let near = _mm512_max_ps(near, _mm512_setzero_ps());
        (_mm512_cmp_ps_mask::<_CMP_LE_OQ>(near, _mm512_min_ps(far, self.limit)), near)
    }

    /// Tests a triangle against all lanes: keeps the nearest hit, of equally near ones the lowest triangle; or retires the lanes that
    /// it stops.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn meet<const ANY: bool, const OCTANT: u8>(&mut self, slot: &Slot) {
        let zero = _mm512_setzero_ps();
        let (near, far) = self.slab::<OCTANT>(&slot.bounds);
        let enters = _mm512_max_ps(near, zero);
        let inside = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(enters, _mm512_min_ps(far, self.limit));
        if inside == 0 {
            return;
        }
        let [a, b, c] = slot.corners.map(|corner| Vec3x16::splat(corner).sub(self.origin));
        let (ca, ab, bc) = (c.sub(a), a.sub(b), b.sub(c));
        let u = ca.cross(c.add(a)).dot(self.direction);
        let v = ab.cross(a.add(b)).dot(self.direction);
        let w = bc.cross(b.add(c)).dot(self.direction);
        let not_below = _mm512_cmp_ps_mask::<_CMP_GE_OQ>(u, zero)
            & _mm512_cmp_ps_mask::<_CMP_GE_OQ>(v, zero)
            & _mm512_cmp_ps_mask::<_CMP_GE_OQ>(w, zero);
        let not_above = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(u, zero)
            & _mm512_cmp_ps_mask::<_CMP_LE_OQ>(v, zero)
            & _mm512_cmp_ps_mask::<_CMP_LE_OQ>(w, zero);
        let inside = inside & (not_below | not_above);
        if inside == 0 {
            return;
        }
        let normal = ca.cross(ab);
        let facing = normal.dot(self.direction);
        let t = _mm512_div_ps(a.dot(normal), facing);
        let t = _mm512_min_ps(_mm512_max_ps(t, near), far);
        let hit = inside
            & _mm512_cmp_ps_mask::<_CMP_NEQ_OQ>(facing, zero)
            & _mm512_cmp_ps_mask::<_CMP_GT_OQ>(t, zero)
            & _mm512_cmp_ps_mask::<_CMP_LT_OQ>(t, _mm512_set1_ps(f32::INFINITY));
        let id = _mm512_set1_epi32(slot.id as i32);
        let nearer = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(t, self.limit);
        if ANY {
            let stopped = hit & nearer;
            self.limit = _mm512_mask_mov_ps(self.limit, stopped, _mm512_set1_ps(f32::NEG_INFINITY));
            self.triangle = _mm512_mask_mov_epi32(self.triangle, stopped, id);
        } else {
            // A limit is not a hit: the first hit must lie strictly before it, and then has a triangle.
            let tie = _mm512_cmp_ps_mask::<_CMP_EQ_OQ>(t, self.limit)
                & _mm512_cmplt_epu32_mask(id, self.triangle)
                & _mm512_cmpneq_epi32_mask(self.triangle, _mm512_set1_epi32(NOTHING as i32));
            let nearer = hit & (nearer | tie);
            self.limit = _mm512_mask_mov_ps(self.limit, nearer, t);
            self.triangle = _mm512_mask_mov_epi32(self.triangle, nearer, id);
        }
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
    let live = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(rays.limit, _mm512_set1_ps(f32::NEG_INFINITY));
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
    if accel.nodes.is_empty() {
        return;
    }
    let (origin, direction, reciprocal) = packet.rows();
    let mut rays = Rays {
        origin: Vec3x16::load(origin),
        direction: Vec3x16::load(direction),
        reciprocal: Vec3x16::load(reciprocal),
        limit: load(packet.limits()),
        triangle: _mm512_set1_epi32(NOTHING as i32),
    };
    match octant(&rays) {
        0 => traverse::<ANY, 0>(accel, &mut rays),
        1 => traverse::<ANY, 1>(accel, &mut rays),
        2 => traverse::<ANY, 2>(accel, &mut rays),
        3 => traverse::<ANY, 3>(accel, &mut rays),
        4 => traverse::<ANY, 4>(accel, &mut rays),
        5 => traverse::<ANY, 5>(accel, &mut rays),
        6 => traverse::<ANY, 6>(accel, &mut rays),
        7 => traverse::<ANY, 7>(accel, &mut rays),
        _ => traverse::<ANY, MIXED>(accel, &mut rays),
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

#[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,bmi1,bmi2,lzcnt,popcnt")]
fn traverse<const ANY: bool, const OCTANT: u8>(accel: &Accel, rays: &mut Rays) {
    let mut waiting = [0u32; STACK];
    let mut heap = Vec::new();
    let waiting: &mut [u32] = if accel.depth <= STACK {
        &mut waiting
    } else {
        heap.resize(accel.depth, 0);
        &mut heap
    };
    let mut count = 0;
    let mut index = 0usize;
    loop {
        let node = &accel.nodes[index];
        let (first, first_near) = rays.meets::<OCTANT>(&node.bounds[0]);
        let (second, second_near) = rays.meets::<OCTANT>(&node.bounds[1]);
        let mut inner = [0u32; 2];
        let mut inners = 0;
        for (child, mask) in node.children.iter().zip([first, second]) {
            if mask == 0 {
                continue;
            }
            match child.split() {
                Ok(slots) => {
                    for slot in &accel.slots[slots] {
                        rays.meet::<ANY, OCTANT>(slot);
                    }
                }
                Err(child) => {
                    inner[inners] = child as u32;
                    inners += 1;
                }
            }
        }
        if ANY && _mm512_cmp_ps_mask::<_CMP_GT_OQ>(rays.limit, _mm512_set1_ps(f32::NEG_INFINITY)) == 0 {
            return;
        }
        index = match inners {
            0 if count == 0 => return,
            0 => {
                count -= 1;
                waiting[count] as usize
            }
            1 => inner[0] as usize,
            _ => {
                // The one that more rays enter first; the order cannot change the answer.
                let both = first & second;
                let sooner = _mm512_mask_cmp_ps_mask::<_CMP_LT_OQ>(both, second_near, first_near);
                let order = if both == 0 {
                    usize::from(second.count_ones() > first.count_ones())
                } else {
                    usize::from(2 * sooner.count_ones() > both.count_ones())
                };
                waiting[count] = inner[1 - order];
                count += 1;
                inner[order] as usize
            }
        };
    }
}

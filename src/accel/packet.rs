//! Queries for packets of rays: one traversal of the tree for all lanes.

#![allow(clippy::needless_range_loop, reason = "a lane is a column of several rows at once")]

use glam::Vec3;

use super::build::{Accel, Slot};
use super::{Bounds, Hit, Kernel, Ray, Wide, meet, reciprocal_of, safe_reciprocal, slab};

/// Rays in a packet.
pub const LANES: usize = 16;

/// One number for each lane.
pub type Row = [f32; LANES];

/// One lane's vector.
#[inline(always)]
pub fn column(rows: &[Row; 3], lane: usize) -> Vec3 {
    Vec3::new(rows[0][lane], rows[1][lane], rows[2][lane])
}

/// Sets one lane's vector.
#[inline(always)]
pub fn set_column(rows: &mut [Row; 3], lane: usize, v: Vec3) {
    rows[0][lane] = v.x;
    rows[1][lane] = v.y;
    rows[2][lane] = v.z;
}

/// Up to [`LANES`] rays in structure-of-arrays form, each with the largest distance that still counts.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub struct Packet {
    origin: [[f32; LANES]; 3],
    direction: [[f32; LANES]; 3],
    reciprocal: [[f32; LANES]; 3],
    /// Nearest distance so far, or the limit; −∞ where a lane is idle or done.
    limit: [f32; LANES],
    triangle: [u32; LANES],
}

/// [`safe_reciprocal`] of every lane.
#[inline(always)]
fn reciprocals(row: &Row) -> Row {
    let mut out = [0.0; LANES];
    for lane in 0..LANES {
        out[lane] = safe_reciprocal(row[lane]);
    }
    out
}

/// No triangle.
pub const NOTHING: u32 = u32::MAX;

impl Default for Packet {
    fn default() -> Self {
        Self {
            origin: [[0.0; LANES]; 3],
            direction: [[1.0; LANES]; 3],
            reciprocal: [[1.0; LANES]; 3],
            limit: [f32::NEG_INFINITY; LANES],
            triangle: [NOTHING; LANES],
        }
    }
}

impl Packet {
    /// Makes every lane idle.
    #[inline]
    pub fn clear(&mut self) {
        self.limit = [f32::NEG_INFINITY; LANES];
        self.triangle = [NOTHING; LANES];
    }

    /// Puts a ray into a lane; hits count at 0 < t < `limit`.
    #[inline]
    pub fn set(&mut self, lane: usize, ray: &Ray, limit: f32) {
        let reciprocal = reciprocal_of(ray.direction);
        for axis in 0..3 {
            self.origin[axis][lane] = ray.origin[axis];
            self.direction[axis][lane] = ray.direction[axis];
            self.reciprocal[axis][lane] = reciprocal[axis];
        }
        self.limit[lane] = limit;
        self.triangle[lane] = NOTHING;
    }

    /// Puts a ray into every lane, by coordinates; hits count at 0 < t < `limit`, and a lane whose limit is −∞ is idle.
    #[inline(always)]
    pub fn set_all(&mut self, origin: &[Row; 3], direction: &[Row; 3], limit: &Row) {
        self.origin = *origin;
        self.direction = *direction;
        self.ready(limit);
    }

    /// Puts a ray into a lane of a packet that [`Self::ready`] then gets ready.
    #[inline(always)]
    pub fn put(&mut self, lane: usize, ray: &Ray) {
        set_column(&mut self.origin, lane, ray.origin);
        set_column(&mut self.direction, lane, ray.direction);
    }

    /// Begins with the rays that were put in: hits count at 0 < t < `limit`, and a lane whose limit is −∞ is idle.
    #[inline(always)]
    pub fn ready(&mut self, limit: &Row) {
        // Not a loop over axes: that is the one which the compiler would make vectors of, of three numbers each.
        let [x, y, z] = &self.direction;
        self.reciprocal = [reciprocals(x), reciprocals(y), reciprocals(z)];
        self.limit = *limit;
        self.triangle = [NOTHING; LANES];
    }

    /// Where the rays start.
    #[inline(always)]
    pub fn origins(&self) -> &[Row; 3] {
        &self.origin
    }

    /// Where they go.
    #[inline(always)]
    pub fn directions(&self) -> &[Row; 3] {
        &self.direction
    }

    /// The triangle that each lane's ray met, [`NOTHING`] where none, after [`Accel::closest`] or [`Accel::occluded`].
    #[inline(always)]
    pub fn triangles(&self) -> &[u32; LANES] {
        &self.triangle
    }

    /// What the lane's ray met, after [`Accel::closest`].
    #[inline]
    pub fn hit(&self, lane: usize) -> Option<Hit> {
        (self.triangle[lane] != NOTHING).then(|| Hit { t: self.limit[lane], triangle: self.triangle[lane] })
    }

    /// Whether the lane's ray met anything, after [`Accel::occluded`].
    #[inline]
    pub fn is_occluded(&self, lane: usize) -> bool {
        self.triangle[lane] != NOTHING
    }

    /// Origins, directions and their reciprocals.
    #[cfg(target_arch = "x86_64")]
    pub(super) fn rows(&self) -> (&[Row; 3], &[Row; 3], &[Row; 3]) {
        (&self.origin, &self.direction, &self.reciprocal)
    }

    /// Nearest distances so far.
    #[cfg(target_arch = "x86_64")]
    pub(super) fn limits(&self) -> &Row {
        &self.limit
    }

    /// What a kernel writes.
    #[cfg(target_arch = "x86_64")]
    pub(super) fn results(&mut self) -> (&mut Row, &mut [u32; LANES]) {
        (&mut self.limit, &mut self.triangle)
    }

    #[inline(always)]
    pub(super) fn lane(&self, l: usize) -> (Vec3, Vec3, Vec3) {
        let at = |a: &[[f32; LANES]; 3]| Vec3::new(a[0][l], a[1][l], a[2][l]);
        (at(&self.origin), at(&self.direction), at(&self.reciprocal))
    }

    /// Where each lane enters and leaves a box, and which lanes meet it no farther than their limit, as bits.
    #[inline(always)]
    fn crossings(&self, bounds: &Bounds) -> ([f32; LANES], [f32; LANES], u32) {
        let (mut near, mut far) = ([0.0f32; LANES], [0.0f32; LANES]);
        let mut met = [0u32; LANES];
        for l in 0..LANES {
            let (origin, _, reciprocal) = self.lane(l);
            (near[l], far[l]) = slab(bounds.min, bounds.max, origin, reciprocal);
            met[l] = u32::from((near[l] <= far[l]) & (far[l] >= 0.0) & (near[l] <= self.limit[l]));
        }
        let mut mask = 0;
        for (l, &m) in met.iter().enumerate() {
            mask |= m << l;
        }
        (near, far, mask)
    }

    /// Which lanes meet a box no farther than their limit, as bits, and how near the first of them enters it.
    #[inline(always)]
    fn meets(&self, bounds: &Bounds) -> (u32, f32) {
        let (near, _, mask) = self.crossings(bounds);
        (mask, near[mask.trailing_zeros() as usize % LANES])
    }

    /// Tests a triangle against all lanes and keeps the nearest hit, of equally near ones the lowest triangle.
    ///
    /// A hit lies in the interval of the triangle's own box: where no lane meets that box, nothing is left to decide.
    #[inline(always)]
    fn closest_of(&mut self, slot: &Slot) {
        let (near, far, mask) = self.crossings(&slot.bounds);
        if mask == 0 {
            return;
        }
        for l in 0..LANES {
            let (origin, direction, _) = self.lane(l);
            let t = meet(&slot.corners, near[l], far[l], origin, direction);
            let nearer = (t > 0.0) & ((t < self.limit[l]) | ((t == self.limit[l]) & (slot.id < self.triangle[l])));
            // A limit is not a hit: the first hit must lie strictly before it, and then has a triangle.
            let nearer = nearer & !((t == self.limit[l]) & (self.triangle[l] == NOTHING));
            self.limit[l] = if nearer { t } else { self.limit[l] };
            self.triangle[l] = if nearer { slot.id } else { self.triangle[l] };
        }
    }

    /// Tests a triangle against all lanes and retires the lanes that it stops.
    #[inline(always)]
    fn any_of(&mut self, slot: &Slot) {
        let (near, far, mask) = self.crossings(&slot.bounds);
        if mask == 0 {
            return;
        }
        for l in 0..LANES {
            let (origin, direction, _) = self.lane(l);
            let t = meet(&slot.corners, near[l], far[l], origin, direction);
            let stopped = (t > 0.0) & (t < self.limit[l]);
            self.limit[l] = if stopped { f32::NEG_INFINITY } else { self.limit[l] };
            self.triangle[l] = if stopped { slot.id } else { self.triangle[l] };
        }
    }
}

/// A packet's way through a tree in plain loops over lanes.
struct PortablePacket<'a, const ANY: bool>(&'a Accel, &'a mut Packet);

impl<const ANY: bool> Wide for PortablePacket<'_, ANY> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.0.traverse::<ANY>(self.1);
    }
}

/// Nodes waiting on the way down: one for each level of the tree, on the stack for all but degenerate trees.
pub(super) const STACK: usize = 96;

impl Accel {
    /// Finds, for every ray of the packet, the nearest hit below its limit.
    pub fn closest(&self, packet: &mut Packet) {
        self.trace_packet::<false>(packet);
    }

    /// Finds, for every ray of the packet, whether anything lies below its limit.
    pub fn occluded(&self, packet: &mut Packet) {
        self.trace_packet::<true>(packet);
    }

    fn trace_packet<const ANY: bool>(&self, packet: &mut Packet) {
        match self.kernel {
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx512 => {
                // SAFETY: a tree has this kernel only where the processor has these instructions.
                #[allow(unsafe_code, reason = "calling a function compiled for features that were detected")]
                unsafe {
                    super::avx512::trace::<ANY>(self, packet);
                }
            }
            kernel => kernel.run(PortablePacket::<ANY>(self, packet)),
        }
    }

    #[inline(always)]
    fn traverse<const ANY: bool>(&self, packet: &mut Packet) {
        if self.nodes.is_empty() {
            return;
        }
        let mut waiting = [0u32; STACK];
        let mut heap = Vec::new();
        let waiting: &mut [u32] = if self.depth <= STACK {
            &mut waiting
        } else {
            heap.resize(self.depth, 0);
            &mut heap
        };
        let mut count = 0;
        let mut index = 0usize;
        loop {
            let node = &self.nodes[index];
            let (mut inner, mut inners) = ([(0usize, 0.0f32); 2], 0);
            for side in 0..2 {
                let (mask, near) = packet.meets(&node.bounds[side]);
                if mask == 0 {
                    continue;
                }
                match node.children[side].split() {
                    Ok(slots) => {
                        for slot in &self.slots[slots] {
                            if ANY {
                                packet.any_of(slot);
                            } else {
                                packet.closest_of(slot);
                            }
                        }
                        if ANY && packet.limit.iter().all(|&t| t == f32::NEG_INFINITY) {
                            return;
                        }
                    }
                    Err(child) => {
                        inner[inners] = (child, near);
                        inners += 1;
                    }
                }
            }
            index = match inners {
                0 if count == 0 => return,
                0 => {
                    count -= 1;
                    waiting[count] as usize
                }
                1 => inner[0].0,
                _ => {
                    // The nearer one first; the order cannot change the answer.
                    let nearer = usize::from(inner[1].1 < inner[0].1);
                    waiting[count] = inner[1 - nearer].0 as u32;
                    count += 1;
                    inner[nearer].0
                }
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Triangle, brute_force};
    use super::*;
    use crate::sampling::hash::{bits64, unit_f32};

    /// Numbers in [−1, 1) from a stream.
    struct Stream(u64, u64);

    impl Stream {
        fn signed(&mut self) -> f32 {
            self.1 += 1;
            2.0 * unit_f32((bits64(self.0, self.1) >> 32) as u32) - 1.0
        }
        fn vec3(&mut self) -> Vec3 {
            Vec3::new(self.signed(), self.signed(), self.signed())
        }
    }

    fn agree(triangles: &[Triangle], reach: f32, rays: &[(Ray, f32)]) {
        let mut accel = Accel::new(triangles, reach);
        for chunk in rays.chunks(LANES) {
            let truths: Vec<Option<Hit>> =
                chunk.iter().map(|(ray, limit)| brute_force(triangles, reach, ray, *limit)).collect();
            for kernel in Kernel::available() {
                accel.set_kernel(kernel);
                let mut packet = Packet::default();
                for (lane, (ray, limit)) in chunk.iter().enumerate() {
                    packet.set(lane, ray, *limit);
                }
                let mut shadow = packet.clone();
                accel.closest(&mut packet);
                accel.occluded(&mut shadow);
                for (lane, ((ray, limit), truth)) in chunk.iter().zip(&truths).enumerate() {
                    assert_eq!(packet.hit(lane), *truth, "{kernel}: {ray:?} up to {limit}");
                    assert_eq!(shadow.is_occluded(lane), truth.is_some(), "{kernel}: {ray:?} up to {limit}");
                    assert_eq!(accel.closest_one(ray, *limit), *truth, "{kernel}, alone: {ray:?} up to {limit}");
                    assert_eq!(accel.occluded_one(ray, *limit), truth.is_some(), "{kernel}, alone: {ray:?}");
                }
            }
        }
    }

    fn rays(stream: &mut Stream, count: usize, scale: f32) -> Vec<(Ray, f32)> {
        (0..count)
            .map(|i| {
                let mut direction = stream.vec3();
                // Every fourth ray runs along an axis or in a coordinate plane.
                if i % 4 == 0 {
                    direction.x = 0.0;
                }
                if i % 8 == 0 {
                    direction.y = -0.0;
                }
                let limit = if i % 3 == 0 { 0.7 * scale } else { f32::INFINITY };
                (Ray { origin: stream.vec3() * (1.5 * scale), direction }, limit)
            })
            .collect()
    }

    #[test]
    fn every_hit_equals_brute_force_on_random_degenerate_huge_tiny_and_flat_triangles() {
        for (kind, scale) in
            [("random", 1.0f32), ("tiny", 1e-6), ("huge", 1e6), ("slivers", 1.0), ("flat", 1.0), ("twice", 1.0)]
        {
            let mut stream = Stream(7, 0);
            let mut triangles: Vec<Triangle> = (0..300)
                .map(|i| {
                    let centre = stream.vec3();
                    let mut corners = [0; 3].map(|_| (centre + 0.3 * stream.vec3()) * scale);
                    match kind {
                        "slivers" => corners[2] = corners[0] + (corners[1] - corners[0]) * 0.5 + stream.vec3() * 1e-6,
                        "flat" => corners.iter_mut().for_each(|c| c[i % 3] = (i % 5) as f32 * 0.25),
                        _ => {}
                    }
                    if i % 37 == 0 {
                        corners[1] = corners[0];
                    }
                    Triangle { corners }
                })
                .collect();
            if kind == "twice" {
                // Every triangle once more: ties all over, which go to the lower index.
                triangles.extend_from_within(..);
            }
            agree(&triangles, 4.0 * scale, &rays(&mut stream, 800, scale));
            agree(&triangles, 4.0 * scale, &bundles(&mut stream, 120, scale));
        }
        agree(&[], 1.0, &rays(&mut Stream(3, 0), 4, 1.0));
        let one = Triangle { corners: [Vec3::X, Vec3::Y, Vec3::Z] };
        agree(&[one], 3.0, &rays(&mut Stream(4, 0), 64, 1.0));
    }

    /// Rays that have something in common, 16 to a packet: from a point, a pixel's, a lens's, to a lamp. Some lanes are idle, and every
    /// fourth packet runs along an axis.
    fn bundles(stream: &mut Stream, packets: usize, scale: f32) -> Vec<(Ray, f32)> {
        let widths = [0.0, 1e-4, 0.02, 0.4];
        let mut rays = Vec::new();
        for p in 0..packets {
            let (from, mut to) = (stream.vec3() * 1.5, stream.vec3());
            if p % 4 == 0 {
                to = from + (to - from) * [Vec3::X, Vec3::Y, Vec3::Z][p / 4 % 3];
            }
            for lane in 0..LANES {
                let origin = from + stream.vec3() * widths[p % 3];
                let direction = to + stream.vec3() * widths[p / 3 % 4] - origin;
                let limit = match (p + lane) % 7 {
                    0 if p % 2 == 0 => f32::NEG_INFINITY,
                    1 => 0.9,
                    _ => f32::INFINITY,
                };
                rays.push((Ray { origin: origin * scale, direction: direction * scale }, limit));
            }
        }
        rays
    }

    /// A closed box of two triangles a side, rays from inside through faces, edges and the diagonals: none escapes.
    #[test]
    fn no_ray_slips_between_triangles_that_share_an_edge() {
        let corner = |i: usize| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32) * 2.0 - 1.0;
        let quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let triangles: Vec<Triangle> = quads
            .iter()
            .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]])
            .map(|t| Triangle { corners: t.map(corner) })
            .collect();
        let accel = Accel::new(&triangles, 4.0);
        let mut stream = Stream(11, 0);
        for i in 0..20_000 {
            let origin = stream.vec3() * 0.9;
            // Aim at points of edges and diagonals, exactly representable ones among them.
            let s = if i % 2 == 0 { stream.signed() } else { (i % 17) as f32 / 8.0 - 1.0 };
            let target = match i % 3 {
                0 => Vec3::new(1.0, s, s),
                1 => Vec3::new(1.0, 1.0, s),
                _ => Vec3::new(s, -1.0, stream.signed()),
            };
            let ray = Ray { origin, direction: target - origin };
            let hit = accel.closest_one(&ray, f32::INFINITY).unwrap_or_else(|| panic!("{ray:?} escapes"));
            assert!((hit.t - 1.0).abs() < 1e-5, "{ray:?}: {hit:?}");
        }
    }
}

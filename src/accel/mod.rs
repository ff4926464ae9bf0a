//! Ray queries: the tree over triangles, closest hit and occlusion, for packets of rays.
//!
//! # One formula decides a hit
//!
//! Whether and where a ray meets a triangle is decided by one function, `meet`, alone: fixed IEEE operations in a fixed
//! order, no fused multiply-add. Of several hits the nearest counts, of equally near ones the lowest triangle. A hit counts
//! only where the ray also meets the triangle's own padded box by the fixed slab formula, and its distance is clamped into
//! that slab interval. Rounding is monotone, so the interval of every enclosing box contains it, and no tree, traversal
//! order or packet width can cull it: the answer is a function of ray and triangles alone.

#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "x86_64")]
mod beam;
mod build;
#[cfg(target_arch = "x86_64")]
mod descent;
#[cfg(target_arch = "x86_64")]
mod lone;
mod nodes8;
mod packet;
mod packet_tree;
mod pages;
mod single;
#[cfg(target_arch = "x86_64")]
mod single_avx2;
#[cfg(target_arch = "x86_64")]
mod single_avx512;
mod stack;
#[cfg(target_arch = "x86_64")]
mod vector16;
#[cfg(target_arch = "x86_64")]
mod vector8;
mod wide;

use glam::Vec3;

pub use build::Accel;
pub use packet::{LANES, NOTHING, Packet, Row, column, set_column};
pub use wide::{Kernel, Wide};

/// Raised whenever a hit, a distance or a tie may come out differently.
pub const ALGORITHM: u32 = 1;

/// A ray: `origin + t · direction`, direction not necessarily of unit length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes; `t` counts in its lengths.
    pub direction: Vec3,
}

/// What a ray meets first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// Index of the triangle, in the order in which they were given.
    pub triangle: u32,
}

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: Vec3,
    /// Largest coordinates.
    pub max: Vec3,
}

/// Three corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangle {
    /// Corners; their order is the winding.
    pub corners: [Vec3; 3],
}

impl Triangle {
    /// The triangle's own box, wider by `pad` on every side.
    pub fn bounds(&self, pad: f32) -> Bounds {
        let [a, b, c] = self.corners;
        Bounds { min: a.min(b).min(c) - Vec3::splat(pad), max: a.max(b).max(c) + Vec3::splat(pad) }
    }
}

/// How much wider than its triangle a box is, for rays that start within `reach` of the coordinate origin and of everything they meet.
///
/// The edge functions below err sideways by some 8 roundings (2⁻²⁴ each) of the distance: 2⁻²¹·reach. Four times that is
/// 2⁻¹⁹·reach: a ray that the edge functions give to a triangle meets the triangle's box.
pub fn box_padding(reach: f32) -> f32 {
    reach * (1.0 / 524_288.0)
}

/// Reciprocal of a direction's coordinate that is finite for 0 too, so that slab products are never NaN.
#[inline(always)]
pub(crate) fn safe_reciprocal(d: f32) -> f32 {
    let r = 1.0 / d;
    if r.abs() <= 1e30 { r } else { 1e30f32.copysign(d) }
}

/// The fixed slab formula: entry and exit distance of a box; it is met where entry ≤ exit.
#[inline(always)]
pub(crate) fn slab(min: Vec3, max: Vec3, origin: Vec3, reciprocal: Vec3) -> (f32, f32) {
    let axis = |lo: f32, hi: f32, o: f32, r: f32| {
        let (a, b) = ((lo - o) * r, (hi - o) * r);
        (smaller(a, b), larger(a, b))
    };
    let (nx, fx) = axis(min.x, max.x, origin.x, reciprocal.x);
    let (ny, fy) = axis(min.y, max.y, origin.y, reciprocal.y);
    let (nz, fz) = axis(min.z, max.z, origin.z, reciprocal.z);
    (larger(larger(nx, ny), nz), smaller(smaller(fx, fy), fz))
}

/// Maximum of two numbers, one instruction (no NaN occurs).
#[inline(always)]
pub(crate) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Minimum of two numbers, one instruction (no NaN occurs).
#[inline(always)]
pub(crate) fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Distance at which one ray meets one triangle whose padded box it enters at `near` and leaves at `far` (by [`slab`]), by
/// the one formula: finite and above 0 where it does, negative where it does not (also for triangles without area).
///
/// Edge functions are triple products of corners relative to the ray's origin (Plücker coordinates, as in Davidovič et al.
/// 2012, doi:10.1145/2159516.2159519): for an edge that two triangles share they differ in sign only, so no ray slips between.
/// Branch-free, so that a loop over lanes becomes vector instructions that do the same operations in the same order.
#[inline(always)]
pub(crate) fn meet(corners: &[Vec3; 3], near: f32, far: f32, origin: Vec3, direction: Vec3) -> f32 {
    let (a, b, c) = (corners[0] - origin, corners[1] - origin, corners[2] - origin);
    let (ca, ab, bc) = (c - a, a - b, b - c);
    let u = dot(cross(ca, c + a), direction);
    let v = dot(cross(ab, a + b), direction);
    let w = dot(cross(bc, b + c), direction);
    let inside = ((u >= 0.0) & (v >= 0.0) & (w >= 0.0)) | ((u <= 0.0) & (v <= 0.0) & (w <= 0.0));
    let normal = cross(ca, ab);
    let facing = dot(normal, direction);
    let t = dot(a, normal) / facing;
    let t = smaller(larger(t, near), far);
    if inside & (facing != 0.0) & (near <= far) & (t > 0.0) & (t < f32::INFINITY) { t } else { -1.0 }
}

#[inline(always)]
fn dot(a: Vec3, b: Vec3) -> f32 {
    a.x * b.x + a.y * b.y + a.z * b.z
}

#[inline(always)]
fn cross(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

/// Reciprocals of a direction's coordinates, see [`safe_reciprocal`].
#[inline(always)]
pub(crate) fn reciprocal_of(d: Vec3) -> Vec3 {
    Vec3::new(safe_reciprocal(d.x), safe_reciprocal(d.y), safe_reciprocal(d.z))
}

/// The one formula over all triangles, in order: what every kernel must find.
#[cfg(test)]
fn brute_force(triangles: &[Triangle], reach: f32, ray: &Ray, limit: f32) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    for (i, triangle) in triangles.iter().enumerate() {
        let bounds = triangle.bounds(box_padding(reach));
        let (near, far) = slab(bounds.min, bounds.max, ray.origin, reciprocal_of(ray.direction));
        let t = meet(&triangle.corners, near, far, ray.origin, ray.direction);
        if t > 0.0 && t < best.map_or(limit, |b| b.t) {
            best = Some(Hit { t, triangle: i as u32 });
        }
    }
    best
}

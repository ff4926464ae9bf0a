//! Eight boxes or triangles in 256-bit registers, and the operations of [`slab`](super::slab) and [`meet`](super::meet) on them.

use std::arch::x86_64::*;

use glam::Vec3;

use super::nodes8::{Block8, LEAF, Node8, Tree8, WIDTH};
use super::single::Way;

/// Three coordinates of eight vectors.
#[derive(Clone, Copy)]
pub(super) struct Vec3x8 {
    pub x: __m256,
    pub y: __m256,
    pub z: __m256,
}

#[inline]
#[target_feature(enable = "avx")]
pub(super) fn load(row: &[f32; WIDTH]) -> __m256 {
    // SAFETY: a row is 8 floats, which is what is read.
    #[allow(unsafe_code, reason = "the load takes a pointer")]
    unsafe {
        _mm256_loadu_ps(row.as_ptr())
    }
}

#[inline]
#[target_feature(enable = "avx")]
pub(super) fn array(values: __m256) -> [f32; WIDTH] {
    let mut row = [0.0; WIDTH];
    // SAFETY: a row is 8 floats, which is what is written.
    #[allow(unsafe_code, reason = "the store takes a pointer")]
    unsafe {
        _mm256_storeu_ps(row.as_mut_ptr(), values);
    }
    row
}

impl Vec3x8 {
    #[inline]
    #[target_feature(enable = "avx")]
    pub fn splat(v: Vec3) -> Self {
        Self { x: _mm256_set1_ps(v.x), y: _mm256_set1_ps(v.y), z: _mm256_set1_ps(v.z) }
    }

    #[inline]
    #[target_feature(enable = "avx")]
    fn load(rows: &[[f32; WIDTH]; 3]) -> Self {
        Self { x: load(&rows[0]), y: load(&rows[1]), z: load(&rows[2]) }
    }

    #[inline]
    #[target_feature(enable = "avx")]
    fn sub(self, b: Self) -> Self {
        Self { x: _mm256_sub_ps(self.x, b.x), y: _mm256_sub_ps(self.y, b.y), z: _mm256_sub_ps(self.z, b.z) }
    }

    #[inline]
    #[target_feature(enable = "avx")]
    fn add(self, b: Self) -> Self {
        Self { x: _mm256_add_ps(self.x, b.x), y: _mm256_add_ps(self.y, b.y), z: _mm256_add_ps(self.z, b.z) }
    }

    #[inline]
    #[target_feature(enable = "avx")]
    fn dot(self, b: Self) -> __m256 {
        let xy = _mm256_add_ps(_mm256_mul_ps(self.x, b.x), _mm256_mul_ps(self.y, b.y));
        _mm256_add_ps(xy, _mm256_mul_ps(self.z, b.z))
    }

    #[inline]
    #[target_feature(enable = "avx")]
    fn cross(self, b: Self) -> Self {
        Self {
            x: _mm256_sub_ps(_mm256_mul_ps(self.y, b.z), _mm256_mul_ps(self.z, b.y)),
            y: _mm256_sub_ps(_mm256_mul_ps(self.z, b.x), _mm256_mul_ps(self.x, b.z)),
            z: _mm256_sub_ps(_mm256_mul_ps(self.x, b.y), _mm256_mul_ps(self.y, b.x)),
        }
    }
}

/// Factor and two summands that give a plane's distance along a ray, not above and not below that of [`slab`](super::slab) for any
/// plane within `extent` of the coordinate origin, with a fused product or without.
///
/// With u = 2⁻²⁴, plane p, origin o, reciprocal r, T = (p − o)·r and B = (extent + |o|)·|r| ≥ |T|: `slab` finds T within 2.01·u·B.
/// Here the product o·r, the difference from it of the slack, the product p·r and the sum err by no more than u·B each but for
/// 1 + 2⁻²⁰. So a slack of 6.1·u·B is enough; it is 8·u·B, and the smallest normal number more for products that
/// underflow. Where B comes near the largest number, the axis tells nothing of any box.
#[inline(always)]
fn distances(origin: f32, reciprocal: f32, extent: f32) -> [f32; 3] {
    let bound = (extent + origin.abs()) * reciprocal.abs();
    if bound.is_nan() || bound >= 1e37 {
        return [0.0, f32::NEG_INFINITY, f32::INFINITY];
    }
    let slack = bound * (1.0 / 2_097_152.0) + f32::MIN_POSITIVE;
    let offset = -(origin * reciprocal);
    [reciprocal, offset - slack, offset + slack]
}

/// One ray in all lanes.
pub(super) struct Ray8 {
    origin: Vec3x8,
    direction: Vec3x8,
    /// Distances of planes: plane · scale + near or far.
    scale: Vec3x8,
    near: Vec3x8,
    far: Vec3x8,
    near_planes: [usize; 3],
}

impl Ray8 {
    #[inline]
    #[target_feature(enable = "avx")]
    pub fn new(way: &Way, extent: f32) -> Self {
        let [x, y, z] = [0, 1, 2].map(|axis: usize| distances(way.origin[axis], way.reciprocal[axis], extent));
        Self {
            origin: Vec3x8::splat(way.origin),
            direction: Vec3x8::splat(way.direction),
            scale: Vec3x8::splat(Vec3::new(x[0], y[0], z[0])),
            near: Vec3x8::splat(Vec3::new(x[1], y[1], z[1])),
            far: Vec3x8::splat(Vec3::new(x[2], y[2], z[2])),
            near_planes: way.near_planes(),
        }
    }

    /// Where the ray enters the boxes of a node, or before, 0 at the least, and where it leaves them, or after, `limit` at
    /// the most; see [`distances`].
    #[inline]
    #[target_feature(enable = "avx,fma")]
    pub fn crossings(&self, node: &Node8, limit: __m256) -> (__m256, __m256) {
        let at = |row: usize, scale: __m256, offset: __m256| _mm256_fmadd_ps(load(&node.planes[row]), scale, offset);
        let [x, y, z] = self.near_planes;
        let (scale, near, far) = (&self.scale, &self.near, &self.far);
        let xy = _mm256_max_ps(at(x, scale.x, near.x), at(y, scale.y, near.y));
        let near = _mm256_max_ps(xy, _mm256_max_ps(at(z, scale.z, near.z), _mm256_setzero_ps()));
        let xy = _mm256_min_ps(at(x ^ 1, scale.x, far.x), at(y ^ 1, scale.y, far.y));
        let far = _mm256_min_ps(xy, _mm256_min_ps(at(z ^ 1, scale.z, far.z), limit));
        (near, far)
    }

    /// Tests the triangles of a block.
    #[inline]
    #[target_feature(enable = "avx2")]
    pub fn test<const ANY: bool, const EVEX: bool>(&self, block: &Block8, pad: f32, way: &mut Way) {
        let zero = _mm256_setzero_ps();
        let at = [0, 1, 2].map(|corner: usize| Vec3x8::load(&block.corners[corner]));
        let [a, b, c] = at.map(|corner| corner.sub(self.origin));
        let (ca, ab, bc) = (c.sub(a), a.sub(b), b.sub(c));
        let u = ca.cross(c.add(a)).dot(self.direction);
        let v = ab.cross(a.add(b)).dot(self.direction);
        let w = bc.cross(b.add(c)).dot(self.direction);
        let not_below = _mm256_and_ps(
            _mm256_and_ps(_mm256_cmp_ps::<_CMP_GE_OQ>(u, zero), _mm256_cmp_ps::<_CMP_GE_OQ>(v, zero)),
            _mm256_cmp_ps::<_CMP_GE_OQ>(w, zero),
        );
        let not_above = _mm256_and_ps(
            _mm256_and_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(u, zero), _mm256_cmp_ps::<_CMP_LE_OQ>(v, zero)),
            _mm256_cmp_ps::<_CMP_LE_OQ>(w, zero),
        );
        let inside = _mm256_or_ps(not_below, not_above);
        if _mm256_movemask_ps(inside) == 0 {
            return;
        }
        let normal = ca.cross(ab);
        let facing = normal.dot(self.direction);
        let t = _mm256_div_ps(a.dot(normal), facing);
        let (near, far) = self.own_box(&at, way.reciprocal, pad);
        let t = _mm256_min_ps(_mm256_max_ps(t, near), far);
        let met = _mm256_and_ps(_mm256_cmp_ps::<_CMP_NEQ_OQ>(facing, zero), _mm256_cmp_ps::<_CMP_LE_OQ>(near, far));
        let counts = _mm256_and_ps(
            _mm256_cmp_ps::<_CMP_GT_OQ>(t, zero),
            // Below infinity, and no farther than what was met.
            _mm256_and_ps(
                _mm256_cmp_ps::<_CMP_LT_OQ>(t, _mm256_set1_ps(f32::INFINITY)),
                _mm256_cmp_ps::<_CMP_LE_OQ>(t, _mm256_set1_ps(way.limit)),
            ),
        );
        let mut mask = _mm256_movemask_ps(_mm256_and_ps(inside, _mm256_and_ps(met, counts))) as u32;
        let t = array(t);
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize % WIDTH;
            way.take(t[lane], block.ids[lane]);
            mask &= mask - 1;
        }
    }

    /// Where the ray enters and leaves the triangles' own padded boxes.
    #[inline]
    #[target_feature(enable = "avx")]
    fn own_box(&self, [a, b, c]: &[Vec3x8; 3], reciprocal: Vec3, pad: f32) -> (__m256, __m256) {
        let (pad, reciprocal) = (_mm256_set1_ps(pad), Vec3x8::splat(reciprocal));
        let axis = |a: __m256, b: __m256, c: __m256, origin: __m256, reciprocal: __m256| {
            let low = _mm256_sub_ps(_mm256_min_ps(_mm256_min_ps(a, b), c), pad);
            let high = _mm256_add_ps(_mm256_max_ps(_mm256_max_ps(a, b), c), pad);
            let low = _mm256_mul_ps(_mm256_sub_ps(low, origin), reciprocal);
            let high = _mm256_mul_ps(_mm256_sub_ps(high, origin), reciprocal);
            (_mm256_min_ps(low, high), _mm256_max_ps(low, high))
        };
        let (nx, fx) = axis(a.x, b.x, c.x, self.origin.x, reciprocal.x);
        let (ny, fy) = axis(a.y, b.y, c.y, self.origin.y, reciprocal.y);
        let (nz, fz) = axis(a.z, b.z, c.z, self.origin.z, reciprocal.z);
        (_mm256_max_ps(_mm256_max_ps(nx, ny), nz), _mm256_min_ps(_mm256_min_ps(fx, fy), fz))
    }
}

/// Asks for a child's cache lines, before they are read.
#[inline]
#[target_feature(enable = "avx")]
pub(super) fn fetch(tree: &Tree8, child: u32) {
    let at = if child & LEAF == 0 {
        tree.nodes.as_ptr().wrapping_add(child as usize).cast::<i8>()
    } else {
        tree.blocks.as_ptr().wrapping_add((child ^ LEAF) as usize).cast::<i8>()
    };
    for line in 0..4 {
        _mm_prefetch::<_MM_HINT_T0>(at.wrapping_add(64 * line));
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::safe_reciprocal;
    use super::*;

    fn number() -> impl Strategy<Value = f32> {
        prop_oneof![-1e12f32..1e12, -30.0f32..30.0, -1e-6f32..1e-6, Just(0.0f32), Just(-0.0f32), Just(1e-38f32)]
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

        /// With a fused product and without.
        #[test]
        fn a_planes_distance_lies_between_the_two_that_stand_for_it(
            plane in number(), origin in number(), direction in number(), wider in 1.0f32..3.0,
        ) {
            let reciprocal = safe_reciprocal(direction);
            let exact = (plane - origin) * reciprocal;
            let [scale, near, far] = distances(origin, reciprocal, plane.abs() * wider);
            for at in [|p: f32, s: f32, o: f32| p.mul_add(s, o), |p: f32, s: f32, o: f32| p * s + o] {
                prop_assert!(at(plane, scale, near) <= exact && exact <= at(plane, scale, far));
            }
        }
    }
}

//! Eight boxes or triangles in 256-bit registers, and the operations of [`slab`](super::slab) and [`meet`](super::meet) on them.

use std::arch::x86_64::*;

use glam::Vec3;

use super::nodes8::{Block8, LEAF, Node8, Tree8, WIDTH};

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
    pub fn splat(v: Axes) -> Self {
        Self { x: _mm256_set1_ps(v[0]), y: _mm256_set1_ps(v[1]), z: _mm256_set1_ps(v[2]) }
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

/// A number for each axis, and a fourth that is not used.
type Axes = [f32; 4];

#[inline]
#[target_feature(enable = "avx")]
fn packed(v: Vec3) -> __m128 {
    _mm_setr_ps(v.x, v.y, v.z, 1.0)
}

#[inline]
#[target_feature(enable = "avx")]
fn axes(v: __m128) -> Axes {
    let mut row = [0.0; 4];
    // SAFETY: a row is 4 floats, which is what is written.
    #[allow(unsafe_code, reason = "the store takes a pointer")]
    unsafe {
        _mm_storeu_ps(row.as_mut_ptr(), v);
    }
    row
}

/// [`safe_reciprocal`](super::safe_reciprocal) of four numbers.
#[inline]
#[target_feature(enable = "avx")]
fn reciprocals(d: __m128) -> __m128 {
    let sign = _mm_set1_ps(-0.0);
    let most = _mm_set1_ps(1e30);
    let r = _mm_div_ps(_mm_set1_ps(1.0), d);
    let small = _mm_cmp_ps::<_CMP_LE_OQ>(_mm_andnot_ps(sign, r), most);
    _mm_blendv_ps(_mm_or_ps(most, _mm_and_ps(sign, d)), r, small)
}

/// Factor and two summands, by axis, that give a plane's distance along a ray, not above and not below that of [`slab`](super::slab)
/// for any plane within `extent` of the coordinate origin, with a fused product or without.
///
/// With u = 2⁻²⁴, plane p, origin o, reciprocal r, T = (p − o)·r and B = (extent + |o|)·|r| ≥ |T|: `slab` finds T within 2.01·u·B.
/// Here the product o·r, the difference from it of the slack, the product p·r and the sum err by no more than u·B each but for
/// 1 + 2⁻²⁰. So a slack of 6.1·u·B is enough; it is 8·u·B, and the smallest normal number more for products that
/// underflow. Where B comes near the largest number, the axis tells nothing of any box.
#[inline]
#[target_feature(enable = "avx")]
fn distances(origin: __m128, reciprocal: __m128, extent: f32) -> [__m128; 3] {
    let sign = _mm_set1_ps(-0.0);
    let reach = _mm_add_ps(_mm_set1_ps(extent), _mm_andnot_ps(sign, origin));
    let bound = _mm_mul_ps(reach, _mm_andnot_ps(sign, reciprocal));
    // False for what is not a number.
    let tells = _mm_cmp_ps::<_CMP_LT_OQ>(bound, _mm_set1_ps(1e37));
    let slack = _mm_add_ps(_mm_mul_ps(bound, _mm_set1_ps(1.0 / 2_097_152.0)), _mm_set1_ps(f32::MIN_POSITIVE));
    let offset = _mm_xor_ps(sign, _mm_mul_ps(origin, reciprocal));
    let infinity = _mm_set1_ps(f32::INFINITY);
    [
        _mm_and_ps(tells, reciprocal),
        _mm_blendv_ps(_mm_xor_ps(sign, infinity), _mm_sub_ps(offset, slack), tells),
        _mm_blendv_ps(infinity, _mm_add_ps(offset, slack), tells),
    ]
}

/// One ray.
pub(super) struct Ray8 {
    origin: Axes,
    direction: Axes,
    reciprocal: Axes,
    /// Distances of planes: plane · scale + near or far.
    scale: Axes,
    near: Axes,
    far: Axes,
    /// Bytes from a node to the row of planes that the ray passes first, and last, by axis.
    near_planes: [usize; 3],
    far_planes: [usize; 3],
}

/// What a node's planes are tested with, in registers.
pub(super) struct Slabs {
    scale: Vec3x8,
    near: Vec3x8,
    far: Vec3x8,
    near_planes: [usize; 3],
    far_planes: [usize; 3],
}

impl Ray8 {
    /// For boxes within `extent` of the coordinate origin.
    #[inline]
    #[target_feature(enable = "avx")]
    pub fn new(origin: Vec3, direction: Vec3, extent: f32) -> Self {
        let origin = packed(origin);
        let direction = packed(direction);
        let reciprocal = reciprocals(direction);
        let [scale, near, far] = distances(origin, reciprocal, extent);
        let below = _mm_movemask_ps(reciprocal) as usize;
        let planes =
            |last: usize| [0, 1, 2].map(|axis| size_of::<[f32; WIDTH]>() * (2 * axis + (below >> axis & 1 ^ last)));
        Self {
            origin: axes(origin),
            direction: axes(direction),
            reciprocal: axes(reciprocal),
            scale: axes(scale),
            near: axes(near),
            far: axes(far),
            near_planes: planes(0),
            far_planes: planes(1),
        }
    }

    #[inline]
    #[target_feature(enable = "avx")]
    pub fn slabs(&self) -> Slabs {
        Slabs {
            scale: Vec3x8::splat(self.scale),
            near: Vec3x8::splat(self.near),
            far: Vec3x8::splat(self.far),
            near_planes: self.near_planes,
            far_planes: self.far_planes,
        }
    }

    /// Which triangles of a block the ray meets no farther than the limit, as bits, and where; with `ANY` below the limit.
    /// `EVEX` is whose function this is, as in `descend`.
    #[inline]
    #[target_feature(enable = "avx")]
    pub fn test<const ANY: bool, const EVEX: bool>(&self, block: &Block8, pad: f32, limit: f32) -> (u32, __m256) {
        let zero = _mm256_setzero_ps();
        let (origin, direction) = (Vec3x8::splat(self.origin), Vec3x8::splat(self.direction));
        let at = [Vec3x8::load(&block.corners[0]), Vec3x8::load(&block.corners[1]), Vec3x8::load(&block.corners[2])];
        let (a, b, c) = (at[0].sub(origin), at[1].sub(origin), at[2].sub(origin));
        let (ca, ab, bc) = (c.sub(a), a.sub(b), b.sub(c));
        let u = ca.cross(c.add(a)).dot(direction);
        let v = ab.cross(a.add(b)).dot(direction);
        let w = bc.cross(b.add(c)).dot(direction);
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
            return (0, zero);
        }
        let normal = ca.cross(ab);
        let facing = normal.dot(direction);
        let t = _mm256_div_ps(a.dot(normal), facing);
        let (near, far) = self.own_box(&at, pad);
        let t = _mm256_min_ps(_mm256_max_ps(t, near), far);
        let met = _mm256_and_ps(_mm256_cmp_ps::<_CMP_NEQ_OQ>(facing, zero), _mm256_cmp_ps::<_CMP_LE_OQ>(near, far));
        let limit = _mm256_set1_ps(limit);
        let near_enough =
            if ANY { _mm256_cmp_ps::<_CMP_LT_OQ>(t, limit) } else { _mm256_cmp_ps::<_CMP_LE_OQ>(t, limit) };
        let counts = _mm256_and_ps(
            _mm256_cmp_ps::<_CMP_GT_OQ>(t, zero),
            _mm256_and_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(t, _mm256_set1_ps(f32::INFINITY)), near_enough),
        );
        (_mm256_movemask_ps(_mm256_and_ps(inside, _mm256_and_ps(met, counts))) as u32, t)
    }

    /// Where the ray enters and leaves the triangles' own padded boxes.
    #[inline]
    #[target_feature(enable = "avx")]
    fn own_box(&self, [a, b, c]: &[Vec3x8; 3], pad: f32) -> (__m256, __m256) {
        let pad = _mm256_set1_ps(pad);
        let (origin, reciprocal) = (Vec3x8::splat(self.origin), Vec3x8::splat(self.reciprocal));
        let axis = |a: __m256, b: __m256, c: __m256, origin: __m256, reciprocal: __m256| {
            let low = _mm256_sub_ps(_mm256_min_ps(_mm256_min_ps(a, b), c), pad);
            let high = _mm256_add_ps(_mm256_max_ps(_mm256_max_ps(a, b), c), pad);
            let low = _mm256_mul_ps(_mm256_sub_ps(low, origin), reciprocal);
            let high = _mm256_mul_ps(_mm256_sub_ps(high, origin), reciprocal);
            (_mm256_min_ps(low, high), _mm256_max_ps(low, high))
        };
        let (nx, fx) = axis(a.x, b.x, c.x, origin.x, reciprocal.x);
        let (ny, fy) = axis(a.y, b.y, c.y, origin.y, reciprocal.y);
        let (nz, fz) = axis(a.z, b.z, c.z, origin.z, reciprocal.z);
        (_mm256_max_ps(_mm256_max_ps(nx, ny), nz), _mm256_min_ps(_mm256_min_ps(fx, fy), fz))
    }
}

impl Slabs {
    /// Where the ray enters the boxes of a node, or before, 0 at the least, and where it leaves them, or after, `limit` at
    /// the most; see [`distances`].
    #[inline]
    #[target_feature(enable = "avx,fma")]
    pub fn crossings(&self, node: &Node8, limit: __m256) -> (__m256, __m256) {
        let at = |row: usize, scale: __m256, offset: __m256| {
            // SAFETY: `Ray8::new` gives the places of rows of planes, with which a node begins.
            #[allow(unsafe_code, reason = "a place in bytes need not be made of a row's number at every node")]
            let planes = unsafe { _mm256_load_ps((&raw const *node).cast::<f32>().byte_add(row)) };
            _mm256_fmadd_ps(planes, scale, offset)
        };
        let [x, y, z] = self.near_planes;
        let [fx, fy, fz] = self.far_planes;
        let (scale, near, far) = (&self.scale, &self.near, &self.far);
        let xy = _mm256_max_ps(at(x, scale.x, near.x), at(y, scale.y, near.y));
        let near = _mm256_max_ps(xy, _mm256_max_ps(at(z, scale.z, near.z), _mm256_setzero_ps()));
        let xy = _mm256_min_ps(at(fx, scale.x, far.x), at(fy, scale.y, far.y));
        let far = _mm256_min_ps(xy, _mm256_min_ps(at(fz, scale.z, far.z), limit));
        (near, far)
    }
}

/// Asks for a child's cache lines, before they are read: five of a block, four of a node and the next one's first.
#[inline]
#[target_feature(enable = "avx")]
pub(super) fn fetch(tree: &Tree8, child: u32) {
    let at = if child & LEAF == 0 {
        tree.nodes.as_ptr().wrapping_add(child as usize).cast::<i8>()
    } else {
        tree.blocks.as_ptr().wrapping_add((child ^ LEAF) as usize).cast::<i8>()
    };
    for line in 0..5 {
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

    #[target_feature(enable = "avx")]
    fn reciprocals_and_distances(origin: [f32; 3], direction: [f32; 3], extent: f32) -> [Axes; 4] {
        let reciprocal = reciprocals(packed(Vec3::from_array(direction)));
        let [scale, near, far] = distances(packed(Vec3::from_array(origin)), reciprocal, extent);
        [axes(reciprocal), axes(scale), axes(near), axes(far)]
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

        /// With a fused product and without.
        #[test]
        fn a_planes_distance_lies_between_the_two_that_stand_for_it(
            plane in [number(), number(), number()],
            origin in [number(), number(), number()],
            direction in [number(), number(), number()],
            wider in 1.0f32..3.0,
        ) {
            if !is_x86_feature_detected!("avx") {
                return Ok(());
            }
            let extent = plane.iter().fold(0.0f32, |most, p| most.max(p.abs())) * wider;
            // SAFETY: the processor has the instructions.
            #[allow(unsafe_code, reason = "calling a function compiled for features that were detected")]
            let [reciprocal, scale, near, far] = unsafe { reciprocals_and_distances(origin, direction, extent) };
            for axis in 0..3 {
                prop_assert_eq!(reciprocal[axis].to_bits(), safe_reciprocal(direction[axis]).to_bits());
                let exact = (plane[axis] - origin[axis]) * reciprocal[axis];
                for at in [|p: f32, s: f32, o: f32| p.mul_add(s, o), |p: f32, s: f32, o: f32| p * s + o] {
                    prop_assert!(at(plane[axis], scale[axis], near[axis]) <= exact);
                    prop_assert!(exact <= at(plane[axis], scale[axis], far[axis]));
                }
            }
        }
    }
}

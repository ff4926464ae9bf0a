//! What all rays of a packet have in common, tested against eight boxes at once.

use std::arch::x86_64::*;

use super::packet_tree::{Planes, WIDTH};

/// Most of a reciprocal with which a beam may be seen from its focus.
const STEEPEST: f32 = 1e20;

/// Rays i at o_i + t·d_i as one beam, seen from where they are closest together.
///
/// Rays through a lens meet at its focus, shadow rays start near one point. With f the distance to there along the rays, ray i
/// is at p_i + s·d_i with p_i = o_i + f·d_i and s = t − f. For positive directions a ray enters a box whose lower plane is b at
/// s = (b − p_i)/d_i ≥ min((b − max p)·min 1/d, (b − max p)·max 1/d), and so for the other planes and signs.
///
/// No box is missed that a ray of the packet meets by [`slab`](super::slab). With u = 2⁻²⁴, R the tree's reach and R ≥ |o|, |b|: `slab` finds
/// t = (b − o)·(1/d)·(1 + 2u), whose s differs from (b − p)/d by at most (2·2R + 2R)·u/d where |f·d| ≤ 2R. The beam's own
/// arithmetic is off by one rounding of p and one of its padding (2R·u each), of b − p and of the product (4R·u each). That is 18·R·u/d,
/// less than the R·2⁻¹⁹/d = 32·R·u/d that the padding of p gives. Rays all but parallel to an axis (1/d above 10²⁰, where the
/// reciprocal may be a stand-in) and such as run both ways along one are seen from their origins, f = 0, where all of it is the
/// monotone rounding of `slab`'s own operations.
pub(super) struct Beam {
    /// The most of p along the ray, and the least, padded: what is subtracted from the planes met first and last.
    near_origin: [__m256; 3],
    far_origin: [__m256; 3],
    /// Bounds of the reciprocals; where rays run both ways the least of the positive and the greatest of the negative ones.
    least: [__m256; 3],
    most: [__m256; 3],
    ways: [Way; 3],
    /// f.
    focus: f32,
    /// s of t = 0, at the most.
    start: f32,
}

/// Which way rays run along an axis.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    Forward,
    Backward,
    Both,
}

/// What [`Beam::around`] is told of the packet's octant: one of eight, or that rays run both ways along some axis.
pub(super) const MIXED: u8 = 8;

/// The rays of which a beam is made.
pub(super) struct Bundle {
    pub origin: [__m512; 3],
    pub direction: [__m512; 3],
    pub reciprocal: [__m512; 3],
    /// The lanes that count, at least one.
    pub live: u16,
}

impl Bundle {
    /// The f, above 0, for which the p_i lie closest together (least squares, about the first ray), else 0.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn focus(&self) -> f32 {
        let first = _mm512_set1_epi32(self.live.trailing_zeros() as i32);
        let (mut od, mut dd) = (_mm512_setzero_ps(), _mm512_setzero_ps());
        for axis in 0..3 {
            let apart = |v: __m512| _mm512_sub_ps(v, _mm512_permutexvar_ps(first, v));
            let (o, d) = (apart(self.origin[axis]), apart(self.direction[axis]));
            od = _mm512_add_ps(od, _mm512_mul_ps(o, d));
            dd = _mm512_add_ps(dd, _mm512_mul_ps(d, d));
        }
        let focus = -_mm512_mask_reduce_add_ps(self.live, od) / _mm512_mask_reduce_add_ps(self.live, dd);
        if focus > 0.0 && focus < f32::MAX { focus } else { 0.0 }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn bounds(&self, row: __m512) -> (f32, f32) {
        (_mm512_mask_reduce_min_ps(self.live, row), _mm512_mask_reduce_max_ps(self.live, row))
    }

    /// The origins along an axis, seen from f, and how far they reach.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn seen_from(&self, focus: f32, axis: usize) -> (f32, f32) {
        let moved = _mm512_mul_ps(_mm512_set1_ps(focus), self.direction[axis]);
        self.bounds(_mm512_add_ps(self.origin[axis], moved))
    }
}

impl Beam {
    /// The beam around some rays, which run into `OCTANT`, of a tree whose boxes are padded by `pad`.
    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    pub fn around<const OCTANT: u8>(bundle: &Bundle, pad: f32) -> Self {
        let reciprocals = [0, 1, 2].map(|axis| bundle.bounds(bundle.reciprocal[axis]));
        let steep = reciprocals.iter().any(|&(least, most)| least < -STEEPEST || most > STEEPEST);
        let mut focus = if OCTANT == MIXED || steep { 0.0 } else { bundle.focus() };
        let mut origins = [0, 1, 2].map(|axis| bundle.seen_from(focus, axis));
        // Twice the reach, see `box_padding`.
        let farthest = pad * (2.0 * 524_288.0);
        if !origins.iter().all(|&(low, high)| low >= -farthest && high <= farthest) {
            focus = 0.0;
            origins = [0, 1, 2].map(|axis| bundle.seen_from(focus, axis));
        }
        let zero = [_mm256_setzero_ps(); 3];
        let start = -focus - 1e-6 * focus;
        let mut beam = Self {
            near_origin: zero,
            far_origin: zero,
            least: zero,
            most: zero,
            ways: [Way::Forward; 3],
            focus,
            start,
        };
        for axis in 0..3 {
            let (low, high) = (origins[axis].0 - pad, origins[axis].1 + pad);
            let (mut least, mut most) = reciprocals[axis];
            beam.ways[axis] = match (least.is_sign_negative(), most.is_sign_negative()) {
                (true, true) => Way::Backward,
                (true, false) => Way::Both,
                _ => Way::Forward,
            };
            if beam.ways[axis] == Way::Both {
                let reciprocal = bundle.reciprocal[axis];
                let negative = bundle.live & _mm512_movepi32_mask(_mm512_castps_si512(reciprocal));
                least = _mm512_mask_reduce_min_ps(bundle.live & !negative, reciprocal);
                most = _mm512_mask_reduce_max_ps(negative, reciprocal);
            }
            let (near, far) = if beam.ways[axis] == Way::Backward { (low, high) } else { (high, low) };
            beam.near_origin[axis] = _mm256_set1_ps(near);
            beam.far_origin[axis] = _mm256_set1_ps(far);
            beam.least[axis] = _mm256_set1_ps(least);
            beam.most[axis] = _mm256_set1_ps(most);
        }
        beam
    }

    /// The s of a limit of t, at the least.
    #[inline]
    pub fn end(&self, limit: f32) -> f32 {
        (limit - self.focus) + 1e-6 * (limit.abs() + self.focus)
    }

    /// Which of eight boxes a ray may meet before `end`, as bits, and the s where it may first do so.
    #[inline]
    #[target_feature(enable = "avx512f,avx512vl")]
    pub fn meets<const OCTANT: u8>(&self, planes: &Planes, end: f32) -> (u32, [f32; WIDTH]) {
        let (mut near, mut far) = (_mm256_set1_ps(self.start), _mm256_set1_ps(end));
        for axis in 0..3 {
            let backward = if OCTANT == MIXED { self.ways[axis] == Way::Backward } else { OCTANT >> axis & 1 == 1 };
            // SAFETY: eight floats are read where eight are.
            #[allow(unsafe_code, reason = "the load takes a pointer")]
            let (near_planes, far_planes) = unsafe {
                let (lower, upper) = (planes[2 * axis].as_ptr(), planes[2 * axis + 1].as_ptr());
                let (near, far) = if backward { (upper, lower) } else { (lower, upper) };
                (_mm256_loadu_ps(near), _mm256_loadu_ps(far))
            };
            let to_near = _mm256_sub_ps(near_planes, self.near_origin[axis]);
            let to_far = _mm256_sub_ps(far_planes, self.far_origin[axis]);
            if OCTANT == MIXED && self.ways[axis] == Way::Both {
                // Forward rays enter by the lower plane, backward ones by the upper; those on a box's other side never meet it.
                let (forward, back) =
                    (_mm256_mul_ps(to_near, self.least[axis]), _mm256_mul_ps(to_far, self.most[axis]));
                near = _mm256_max_ps(near, _mm256_max_ps(forward, back));
                continue;
            }
            let enters =
                _mm256_min_ps(_mm256_mul_ps(to_near, self.least[axis]), _mm256_mul_ps(to_near, self.most[axis]));
            let leaves = _mm256_max_ps(_mm256_mul_ps(to_far, self.least[axis]), _mm256_mul_ps(to_far, self.most[axis]));
            near = _mm256_max_ps(near, enters);
            far = _mm256_min_ps(far, leaves);
        }
        let mut enters = [0.0; WIDTH];
        // SAFETY: eight floats are written to eight.
        #[allow(unsafe_code, reason = "the store takes a pointer")]
        unsafe {
            _mm256_storeu_ps(enters.as_mut_ptr(), near);
        }
        (u32::from(_mm256_cmp_ps_mask::<_CMP_LE_OQ>(near, far)), enters)
    }
}

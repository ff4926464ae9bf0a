//! What all rays of a packet have in common, tested against eight boxes at once.

use std::arch::x86_64::*;

use super::packet_tree::Planes;
use super::vector16::{Vec3x16, load8, store8};

/// Most of a reciprocal with which a beam may be seen from its focus.
const STEEPEST: f32 = 1e20;

/// Rays i at o_i + t·d_i as one beam, seen from where they are closest together.
///
/// Rays through a lens meet at its focus, shadow rays start near one point. With f the distance to there along the rays, ray i
/// is at p_i + s·d_i with p_i = o_i + f·d_i and s = t − f. For positive directions a ray enters a box whose lower plane is b at
/// s = (b − p_i)/d_i ≥ min((b − max p)·min 1/d, (b − max p)·max 1/d), and so for the other planes and signs.
///
/// No box is missed that a ray of the packet meets by [`slab`](super::slab). With u = 2⁻²⁴, R the tree's reach, R ≥ |o|, |b| and 2R ≥ |p|, so
/// that |f·d| ≤ 3R: `slab` finds t = (b − o)·(1/d)·(1 + 2u), whose s differs from (b − p)/d by at most (2·2R + 3R)·u/d, the reciprocal's own
/// rounding among them. The beam's arithmetic is off by the roundings of f·d (3R·u), of p and of its padding (2R·u each), of b − p and of the
/// product (3R·u each). That is 20·R·u/d, less than the R·2⁻¹⁹/d = 32·R·u/d that the padding of p gives. Rays all but parallel to an axis (1/d above 10²⁰, where the
/// reciprocal may be a stand-in) and such as run both ways along one are seen from their origins, f = 0, where all of it is the
/// monotone rounding of `slab`'s own operations.
pub(super) struct Beam {
    /// By axis: the least of the reciprocals, where rays run both ways of the positive ones; and, from [`ORIGIN`] on, the least of p less
    /// the padding.
    least: [f32; 8],
    /// The most of the reciprocals, where rays run both ways of the negative ones; and the most of p with the padding.
    most: [f32; 8],
    /// The axes along which rays run both ways, where their octant is [`MIXED`], and those along which all run backward.
    both: u32,
    backward: u32,
    /// f.
    focus: f32,
    /// s of t = 0, at the most.
    start: f32,
}

/// What [`Beam::around`] is told of the packet's octant: one of eight, or that rays run both ways along some axis.
pub(super) const MIXED: u8 = 8;

/// Where a beam's bounds of p begin, after those of the reciprocals.
const ORIGIN: usize = 4;

/// The f, above 0, for which the p_i lie closest together (least squares, about the first ray), else 0.
#[inline]
#[target_feature(enable = "avx512f")]
fn focus(origin: &Vec3x16, direction: &Vec3x16) -> f32 {
    let (o, d) = (origin.sub(origin.first()), direction.sub(direction.first()));
    let (od, dd) = (o.dot(d), d.dot(d));
    // Both sums at once: eight lanes of one, eight of the other, and then by halves.
    let mut sums = _mm512_add_ps(_mm512_shuffle_f32x4::<0x44>(od, dd), _mm512_shuffle_f32x4::<0xee>(od, dd));
    sums = _mm512_add_ps(sums, _mm512_shuffle_f32x4::<0xb1>(sums, sums));
    sums = _mm512_add_ps(sums, _mm512_permute_ps::<0x4e>(sums));
    sums = _mm512_add_ps(sums, _mm512_permute_ps::<0xb1>(sums));
    let dd = _mm_cvtss_f32(_mm512_extractf32x4_ps::<2>(sums));
    let focus = -_mm512_cvtss_f32(sums) / dd;
    if focus > 0.0 && focus < f32::MAX { focus } else { 0.0 }
}

/// The smaller or the larger of two numbers, by lane.
#[inline]
#[target_feature(enable = "avx")]
fn pick<const MOST: bool>(a: __m256, b: __m256) -> __m256 {
    if MOST { _mm256_max_ps(a, b) } else { _mm256_min_ps(a, b) }
}

/// The least or the most of six rows' 16 lanes: of the rows of a at 0, 1 and 2, of b at [`ORIGIN`] and on.
#[inline]
#[target_feature(enable = "avx512f,avx512dq")]
fn extremes<const MOST: bool>(a: &Vec3x16, b: &Vec3x16) -> __m256 {
    let [x, y, z] = [pair::<MOST>(a.x, b.x), pair::<MOST>(a.y, b.y), pair::<MOST>(a.z, b.z)];
    let xy = pick::<MOST>(_mm256_shuffle_ps::<0x44>(x, y), _mm256_shuffle_ps::<0xee>(x, y));
    let zz = pick::<MOST>(_mm256_shuffle_ps::<0x44>(z, z), _mm256_shuffle_ps::<0xee>(z, z));
    pick::<MOST>(_mm256_shuffle_ps::<0x88>(xy, zz), _mm256_shuffle_ps::<0xdd>(xy, zz))
}

/// Four lanes among which is the least or the most of one row, and four of another.
#[inline]
#[target_feature(enable = "avx512f,avx512dq")]
fn pair<const MOST: bool>(a: __m512, b: __m512) -> __m256 {
    let a = pick::<MOST>(_mm512_castps512_ps256(a), _mm512_extractf32x8_ps::<1>(a));
    let b = pick::<MOST>(_mm512_castps512_ps256(b), _mm512_extractf32x8_ps::<1>(b));
    pick::<MOST>(_mm256_permute2f128_ps::<0x20>(a, b), _mm256_permute2f128_ps::<0x31>(a, b))
}

impl Beam {
    /// The beam around 16 rays, which run into `OCTANT`, of a tree whose boxes are padded by `pad`.
    #[inline]
    #[target_feature(enable = "avx512f,avx512dq,avx512vl")]
    pub fn around<const OCTANT: u8>(origin: &Vec3x16, direction: &Vec3x16, reciprocal: &Vec3x16, pad: f32) -> Self {
        let mut focus = if OCTANT == MIXED || reciprocal.exceeds(STEEPEST) { 0.0 } else { focus(origin, direction) };
        let mut seen = origin.add(direction.mul(_mm512_set1_ps(focus)));
        // Twice the reach, see `box_padding`.
        if seen.exceeds(pad * (2.0 * 524_288.0)) {
            focus = 0.0;
            seen = *origin;
        }
        let pads = _mm256_set_m128(_mm_set1_ps(pad), _mm_setzero_ps());
        let least = _mm256_sub_ps(extremes::<false>(reciprocal, &seen), pads);
        let most = _mm256_add_ps(extremes::<true>(reciprocal, &seen), pads);
        let mut beam = Self {
            least: store8(least),
            most: store8(most),
            both: 0,
            backward: 0,
            focus,
            start: -focus - 1e-6 * focus,
        };
        if OCTANT == MIXED {
            beam.tell_ways(reciprocal);
        }
        beam
    }

    /// Along which axes rays run backward or both ways, and there the reciprocals that are closest to 0.
    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    fn tell_ways(&mut self, reciprocal: &Vec3x16) {
        for (axis, row) in [(0, reciprocal.x), (1, reciprocal.y), (2, reciprocal.z)] {
            let negative = _mm512_movepi32_mask(_mm512_castps_si512(row));
            match negative {
                0 => {}
                0xffff => self.backward |= 1 << axis,
                _ => {
                    self.both |= 1 << axis;
                    self.least[axis] = _mm512_mask_reduce_min_ps(!negative, row);
                    self.most[axis] = _mm512_mask_reduce_max_ps(negative, row);
                }
            }
        }
    }

    /// The s of a limit of t, at the least.
    #[inline(always)]
    pub fn end(&self, limit: f32) -> f32 {
        (limit - self.focus) + 1e-6 * (limit.abs() + self.focus)
    }

    /// How far behind the beam's start an s is.
    #[inline(always)]
    pub fn since_start(&self, s: f32) -> f32 {
        s - self.start
    }

    /// The same of eight.
    #[inline]
    #[target_feature(enable = "avx")]
    pub fn all_since_start(&self, s: __m256) -> __m256 {
        _mm256_sub_ps(s, _mm256_set1_ps(self.start))
    }

    /// Where, at the soonest, a ray may meet each of eight boxes, and which of them one may meet before `end`, as bits.
    #[inline]
    #[target_feature(enable = "avx512f,avx512vl")]
    pub fn meets<const OCTANT: u8>(&self, planes: &Planes, end: f32) -> (__m256, u32) {
        let (mut near, mut far) = (_mm256_set1_ps(self.start), _mm256_set1_ps(end));
        for axis in 0..3 {
            let backward = if OCTANT == MIXED { self.backward >> axis & 1 == 1 } else { OCTANT >> axis & 1 == 1 };
            let (lower, upper) = (load8(&planes[2 * axis]), load8(&planes[2 * axis + 1]));
            let (low, high) = (_mm256_set1_ps(self.least[ORIGIN + axis]), _mm256_set1_ps(self.most[ORIGIN + axis]));
            let (least, most) = (_mm256_set1_ps(self.least[axis]), _mm256_set1_ps(self.most[axis]));
            let (to_near, to_far) = if backward {
                (_mm256_sub_ps(upper, low), _mm256_sub_ps(lower, high))
            } else {
                (_mm256_sub_ps(lower, high), _mm256_sub_ps(upper, low))
            };
            if OCTANT == MIXED && self.both >> axis & 1 == 1 {
                // Forward rays enter by the lower plane, backward ones by the upper; those on a box's other side never meet it.
                let (forward, back) = (_mm256_mul_ps(to_near, least), _mm256_mul_ps(to_far, most));
                near = _mm256_max_ps(near, _mm256_max_ps(forward, back));
                continue;
            }
            near = _mm256_max_ps(near, _mm256_min_ps(_mm256_mul_ps(to_near, least), _mm256_mul_ps(to_near, most)));
            far = _mm256_min_ps(far, _mm256_max_ps(_mm256_mul_ps(to_far, least), _mm256_mul_ps(to_far, most)));
        }
        (near, u32::from(_mm256_cmp_ps_mask::<_CMP_LE_OQ>(near, far)))
    }
}

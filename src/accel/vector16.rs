//! Sixteen vectors, a coordinate a 512-bit register.

use std::arch::x86_64::*;

use super::packet::Row;

/// Three coordinates of 16 vectors.
#[derive(Clone, Copy)]
pub(super) struct Vec3x16 {
    pub x: __m512,
    pub y: __m512,
    pub z: __m512,
}

#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn load(row: &Row) -> __m512 {
    // SAFETY: a row is 16 floats, which is what is read.
    #[allow(unsafe_code, reason = "the load takes a pointer")]
    unsafe {
        _mm512_loadu_ps(row.as_ptr())
    }
}

#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn store(row: &mut Row, values: __m512) {
    // SAFETY: a row is 16 floats, which is what is written.
    #[allow(unsafe_code, reason = "the store takes a pointer")]
    unsafe {
        _mm512_storeu_ps(row.as_mut_ptr(), values);
    }
}

#[inline]
#[target_feature(enable = "avx")]
pub(super) fn load8(row: &[f32; 8]) -> __m256 {
    // SAFETY: a row is 8 floats, which is what is read.
    #[allow(unsafe_code, reason = "the load takes a pointer")]
    unsafe {
        _mm256_loadu_ps(row.as_ptr())
    }
}

#[inline]
#[target_feature(enable = "avx")]
pub(super) fn store8(values: __m256) -> [f32; 8] {
    let mut row = [0.0; 8];
    // SAFETY: a row is 8 floats, which is what is written.
    #[allow(unsafe_code, reason = "the store takes a pointer")]
    unsafe {
        _mm256_storeu_ps(row.as_mut_ptr(), values);
    }
    row
}

impl Vec3x16 {
    /// Coordinates of the lanes of a packet, those of lane `stand_in` for the lanes that are not `live`.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub fn load(rows: &[Row; 3], live: u16, stand_in: __m512i) -> Self {
        Self { x: fill(&rows[0], live, stand_in), y: fill(&rows[1], live, stand_in), z: fill(&rows[2], live, stand_in) }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    pub fn splat(v: glam::Vec3) -> Self {
        Self { x: _mm512_set1_ps(v.x), y: _mm512_set1_ps(v.y), z: _mm512_set1_ps(v.z) }
    }

    /// The first lane's vector in all lanes.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub fn first(&self) -> Self {
        Self { x: first(self.x), y: first(self.y), z: first(self.z) }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    pub fn mul(self, factor: __m512) -> Self {
        Self { x: _mm512_mul_ps(self.x, factor), y: _mm512_mul_ps(self.y, factor), z: _mm512_mul_ps(self.z, factor) }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    pub fn sub(self, b: Self) -> Self {
        Self { x: _mm512_sub_ps(self.x, b.x), y: _mm512_sub_ps(self.y, b.y), z: _mm512_sub_ps(self.z, b.z) }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    pub fn add(self, b: Self) -> Self {
        Self { x: _mm512_add_ps(self.x, b.x), y: _mm512_add_ps(self.y, b.y), z: _mm512_add_ps(self.z, b.z) }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    pub fn dot(self, b: Self) -> __m512 {
        let xy = _mm512_add_ps(_mm512_mul_ps(self.x, b.x), _mm512_mul_ps(self.y, b.y));
        _mm512_add_ps(xy, _mm512_mul_ps(self.z, b.z))
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    pub fn cross(self, b: Self) -> Self {
        Self {
            x: _mm512_sub_ps(_mm512_mul_ps(self.y, b.z), _mm512_mul_ps(self.z, b.y)),
            y: _mm512_sub_ps(_mm512_mul_ps(self.z, b.x), _mm512_mul_ps(self.x, b.z)),
            z: _mm512_sub_ps(_mm512_mul_ps(self.x, b.y), _mm512_mul_ps(self.y, b.x)),
        }
    }

    /// Whether any coordinate is greater than `most`, without its sign, or no number.
    #[inline]
    #[target_feature(enable = "avx512f,avx512dq")]
    pub fn exceeds(&self, most: f32) -> bool {
        let most = _mm512_set1_ps(most);
        let x = _mm512_cmp_ps_mask::<_CMP_NLE_UQ>(_mm512_abs_ps(self.x), most);
        let y = _mm512_cmp_ps_mask::<_CMP_NLE_UQ>(_mm512_abs_ps(self.y), most);
        let z = _mm512_cmp_ps_mask::<_CMP_NLE_UQ>(_mm512_abs_ps(self.z), most);
        x | y | z != 0
    }
}

#[inline]
#[target_feature(enable = "avx512f")]
fn fill(row: &Row, live: u16, stand_in: __m512i) -> __m512 {
    let row = load(row);
    _mm512_mask_permutexvar_ps(row, !live, stand_in, row)
}

#[inline]
#[target_feature(enable = "avx512f")]
fn first(row: __m512) -> __m512 {
    _mm512_broadcastss_ps(_mm512_castps512_ps128(row))
}

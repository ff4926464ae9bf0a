//! Radical inverses: van der Corput, Halton, Hammersley.

use crate::mutants::{Mutant, planted, wrong};

/// The primes that Halton's first axes take as bases.
pub const PRIMES: [u32; 16] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53];

/// The base-b digits of `index` mirrored: (m, bᵏ) with φ_b(index) = m / bᵏ, k the number of digits.
///
/// Exact. For `index` < 2²⁴ and bases up to 53, bᵏ < 2³².
#[inline]
pub fn mirrored(base: u32, mut index: u32) -> (u64, u64) {
    let (mut mirror, mut power) = (0u64, 1u64);
    while index > 0 {
        mirror = mirror * u64::from(base) + u64::from(index % base);
        power *= u64::from(base);
        index /= base;
    }
    (mirror, power)
}

/// Radical inverse φ_b as a 32-bit fraction, rounded down once: ⌊2³² φ_b(index)⌋; φ₂(6) = 0.011₂ = 3/8.
///
/// Halton (1960), doi:10.1007/BF01386213. For `index` < 2²⁴ and bases up to 53 the value is below 2³², never 1.
#[inline]
pub fn radical_inverse(base: u32, index: u32) -> u32 {
    if is_in_single() {
        return wrong::radical_inverse(base, index);
    }
    if base == 2 {
        return index.reverse_bits();
    }
    let (mirror, power) = mirrored(base, index);
    ((mirror << 32) / power) as u32
}

/// A planted bug, or false.
#[inline(always)]
pub(super) fn is_in_single() -> bool {
    planted(Mutant::RadicalInverseInSingle)
}

/// Radical inverse φ_b correctly rounded to f64, for measuring point sets.
pub fn radical_inverse_f64(base: u32, index: u32) -> f64 {
    let (mirror, power) = mirrored(base, index);
    mirror as f64 / power as f64
}

/// Number of base-b digits of the largest index below `n`.
pub fn digit_count(base: u32, n: u32) -> u32 {
    let (mut digits, mut reach) = (0, 1u64);
    while reach < u64::from(n) {
        reach *= u64::from(base);
        digits += 1;
    }
    digits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        assert_eq!(radical_inverse(2, 6), 3 << 29);
        assert_eq!(radical_inverse_f64(3, 5), 7.0 / 9.0);
        assert_eq!(radical_inverse_f64(2, 0), 0.0);
        assert_eq!((digit_count(3, 1), digit_count(3, 9), digit_count(3, 10)), (0, 2, 3));
    }

    /// Single-precision digit arithmetic reaches 1.0 at bᵏ − 1; integers do not.
    #[test]
    fn no_index_below_two_to_the_24_reaches_one() {
        for base in PRIMES {
            let mut last = u64::from(base);
            while last <= 1 << 24 {
                let value = super::super::hash::unit_f32(radical_inverse(base, last as u32 - 1));
                assert!(value < 1.0);
                last *= u64::from(base);
            }
            let (mirror, power) = mirrored(base, (1 << 24) - 1);
            assert!(mirror < power && power < 1 << 32);
        }
    }
}

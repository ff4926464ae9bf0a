//! Radical inverses: van der Corput, Halton, Hammersley, and Halton with nested random digit permutations.

use super::divisor::Divisor;
use super::hash::bits64;
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
fn is_in_single() -> bool {
    planted(Mutant::RadicalInverseInSingle)
}

/// An axis of Halton's sequence: a base, and as many of its digits as tell `n` indices apart, made ready.
#[derive(Debug, Clone, Copy)]
pub struct HaltonAxis {
    base: Divisor,
    digits: u32,
    /// baseᵈⁱᵍⁱᵗˢ, below 2³².
    power: Divisor,
}

impl HaltonAxis {
    /// The axis of base `base`, one of [`PRIMES`], for indices below `n` ≤ 2²⁴.
    pub fn new(base: u32, n: u32) -> Self {
        Self::with_digits(base, digit_count(base, n))
    }

    fn with_digits(base: u32, digits: u32) -> Self {
        Self { base: Divisor::new(base.into()), digits, power: Divisor::new(u64::from(base).pow(digits)) }
    }

    /// The base.
    pub fn base(&self) -> u32 {
        self.base.value() as u32
    }

    /// [`radical_inverse`] of several indices below n at once.
    #[inline(always)]
    pub fn radical_inverses<const N: usize>(&self, indices: &[u32; N]) -> [u32; N] {
        let base = self.base();
        if base == 2 || is_in_single() {
            return indices.map(|index| radical_inverse(base, index));
        }
        let mut rest = indices.map(u64::from);
        let mut mirror = [0u64; N];
        // Zeros that follow the last digit multiply mirror and power alike.
        for _ in 0..self.digits {
            for (rest, mirror) in rest.iter_mut().zip(&mut mirror) {
                let quotient = self.base.quotient(*rest);
                *mirror = *mirror * u64::from(base) + (*rest - quotient * u64::from(base));
                *rest = quotient;
            }
        }
        mirror.map(|m| self.power.quotient(m << 32) as u32)
    }

    /// Halton coordinates under nested random digit permutations, as 32-bit fractions (Owen 1995, doi:10.1007/978-1-4612-2552-2_19).
    ///
    /// The j-th digit is permuted by d ↦ (a·d + c) mod b with (a, c), a ≠ 0, drawn afresh for each prefix of j − 1 digits. For
    /// prime b these maps are sharply 2-transitive: any two digits go to any two different digits equally often, so all
    /// pairwise distributions, and with them every variance and every `E[D²]`, equal those of uniform random permutations
    /// (Matoušek 1998, doi:10.1006/jcom.1998.0489). After the digits that tell all indices apart, the infinitely many zeros that
    /// follow become independent uniform digits: one uniform tail.
    #[inline(always)]
    pub fn digit_scrambled<const N: usize>(&self, indices: &[u32; N], key: u64) -> [u32; N] {
        let b = self.base.value();
        let mut rest = indices.map(u64::from);
        let (mut prefix, mut mirror) = ([0u64; N], [0u64; N]);
        let mut power = 1u64;
        for level in 0..u64::from(self.digits) {
            for lane in 0..N {
                let quotient = self.base.quotient(rest[lane]);
                let digit = rest[lane] - quotient * b;
                rest[lane] = quotient;
                let draw = bits64(key, prefix[lane] | (level << 40));
                let factor = 1 + (((draw >> 32) * (b - 1)) >> 32);
                let offset = ((draw & 0xffff_ffff) * b) >> 32;
                mirror[lane] = mirror[lane] * b + self.base.remainder(factor * digit + offset);
                prefix[lane] += if planted(Mutant::DigitsNotNested) { 0 } else { digit * power };
            }
            power *= b;
        }
        let mut fractions = [0; N];
        for lane in 0..N {
            let tail = bits64(key, prefix[lane] | (u64::from(self.digits) << 40)) >> 32;
            fractions[lane] = self.power.quotient((mirror[lane] << 32) | tail) as u32;
        }
        fractions
    }
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

/// One of [`HaltonAxis::digit_scrambled`], with as many digits as asked.
pub fn digit_scrambled(base: u32, digits: u32, index: u32, key: u64) -> u32 {
    HaltonAxis::with_digits(base, digits).digit_scrambled(&[index], key)[0]
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

    /// The definition, one index at a time, with the processor's own division.
    fn scrambled(base: u32, digits: u32, index: u32, key: u64) -> u32 {
        let b = u64::from(base);
        let (mut rest, mut prefix, mut power, mut mirror) = (index, 0u64, 1u64, 0u64);
        for level in 0..digits {
            let digit = rest % base;
            rest /= base;
            let draw = bits64(key, prefix | (u64::from(level) << 40));
            let factor = 1 + (((draw >> 32) * (b - 1)) >> 32) as u32;
            let offset = (((draw & 0xffff_ffff) * b) >> 32) as u32;
            mirror = mirror * b + u64::from((factor * digit + offset) % base);
            prefix += u64::from(digit) * power;
            power *= b;
        }
        let tail = bits64(key, prefix | (u64::from(digits) << 40)) >> 32;
        (((mirror << 32) | tail) / power) as u32
    }

    #[test]
    fn blocks_equal_the_definition() {
        for base in PRIMES {
            for n in [1u32, 2, 3, 26, 1000, 1 << 24] {
                let axis = HaltonAxis::new(base, n);
                let digits = digit_count(base, n);
                for round in 0..200u64 {
                    let key = bits64(round, u64::from(base));
                    let indices: [u32; 16] = std::array::from_fn(|l| match (round, l) {
                        (_, 0) => n - 1,
                        (_, 1) => 0,
                        _ => (bits64(key, l as u64) % u64::from(n)) as u32,
                    });
                    assert_eq!(axis.radical_inverses(&indices), indices.map(|i| radical_inverse(base, i)));
                    assert_eq!(axis.digit_scrambled(&indices, key), indices.map(|i| scrambled(base, digits, i, key)));
                }
            }
        }
    }

    #[test]
    fn scrambled_digits_stay_a_net_in_their_base() {
        for base in [2u32, 3, 5, 7] {
            let n = base.pow(3);
            for key in 0..20 {
                let axis = HaltonAxis::new(base, n);
                let fraction = |i| u64::from(axis.digit_scrambled(&[i], key)[0]);
                let mut strata: Vec<u32> = (0..n).map(|i| ((fraction(i) * u64::from(n)) >> 32) as u32).collect();
                strata.sort_unstable();
                assert_eq!(strata, (0..n).collect::<Vec<_>>(), "base {base}, key {key}");
            }
        }
    }
}

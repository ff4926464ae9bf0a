//! Halton's axes made ready: radical inverses from tables, and nested random digit permutations.

use super::divisor::Divisor;
use super::hash::bits64;
use super::radical::{digit_count, is_in_single, mirrored, radical_inverse};
use super::{each, row};
use crate::mutants::{Mutant, planted};

/// Indices looked up at once, at most.
const LANES: usize = 16;

/// An axis of Halton's sequence: a base, and as many of its digits as tell `n` indices apart, made ready.
#[derive(Debug, Clone)]
pub struct HaltonAxis {
    base: u32,
    digits: u32,
    /// baseᵈⁱᵍⁱᵗˢ, below 2³².
    power: Divisor,
    by_base: Quotient,
    blocks: Blocks,
}

impl HaltonAxis {
    /// The axis of base `base`, one of [`PRIMES`](super::radical::PRIMES), for indices below `n` ≤ 2²⁴.
    pub fn new(base: u32, n: u32) -> Self {
        let digits = digit_count(base, n);
        Self {
            base,
            digits,
            power: Divisor::new(u64::from(base).pow(digits)),
            by_base: Quotient::new(base),
            blocks: Blocks::new(base, n),
        }
    }

    /// The base.
    pub fn base(&self) -> u32 {
        self.base
    }

    /// [`radical_inverse`] of several indices below n at once.
    #[inline(always)]
    pub fn radical_inverses<const N: usize>(&self, indices: &[u32; N]) -> [u32; N] {
        if self.base == 2 || is_in_single() {
            return each(indices, |index| radical_inverse(self.base, index));
        }
        self.blocks.any(indices)
    }

    /// [`radical_inverse`] of `first` and the indices after it. `first` may lie less than N below 0 (modulo 2³²): what is found for
    /// indices outside 0..n means nothing.
    #[inline(always)]
    pub fn run<const N: usize>(&self, first: u32) -> [u32; N] {
        if self.base == 2 || is_in_single() {
            return each(&row(first), |index| radical_inverse(self.base, index));
        }
        if first as i32 >= 0 {
            return self.blocks.run(first);
        }
        let (mut out, before) = ([0; N], first.wrapping_neg() as usize);
        let run: [u32; N] = self.blocks.run(0);
        out[before..].copy_from_slice(&run[..N - before]);
        out
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
        let b = self.base;
        let (mut rest, mut prefix, mut mirror) = (*indices, [0u32; N], [0u32; N]);
        let mut power = 1;
        for level in 0..u64::from(self.digits) {
            let mut draws = [0u64; N];
            if level == 0 {
                // Nothing stands above the first digit: one permutation serves all.
                draws = [bits64(key, 0); N];
            } else {
                for lane in 0..N {
                    draws[lane] = bits64(key, u64::from(prefix[lane]) | (level << 40));
                }
            }
            for lane in 0..N {
                let quotient = self.by_base.of(rest[lane]);
                let digit = rest[lane] - quotient * b;
                rest[lane] = quotient;
                let factor = 1 + (((draws[lane] >> 32) * u64::from(b - 1)) >> 32) as u32;
                let offset = (((draws[lane] & 0xffff_ffff) * u64::from(b)) >> 32) as u32;
                let moved = factor * digit + offset;
                mirror[lane] = mirror[lane] * b + (moved - self.by_base.of_small(moved) * b);
                prefix[lane] += in_prefix(digit * power);
            }
            power *= b;
        }
        let mut fractions = [0; N];
        for lane in 0..N {
            let tail = bits64(key, u64::from(prefix[lane]) | (u64::from(self.digits) << 40)) >> 32;
            fractions[lane] = self.power.quotient((u64::from(mirror[lane]) << 32) | tail) as u32;
        }
        fractions
    }
}

/// Quotients by a base or a power of it, by multiplication.
///
/// With M = ⌈2ᵏ/b⌉, M·b exceeds 2ᵏ by less than b, so M·i/2ᵏ exceeds i/b by less than i·b/(b·2ᵏ) ≤ 1/b while i·b ≤ 2ᵏ: not
/// enough to reach the next whole number.
#[derive(Debug, Clone, Copy)]
struct Quotient {
    wide: u64,
    small: u32,
}

impl Quotient {
    const WIDE: u32 = 37;
    const SMALL: u32 = 18;

    fn new(divisor: u32) -> Self {
        Self { wide: (1u64 << Self::WIDE).div_ceil(divisor.into()), small: (1u32 << Self::SMALL).div_ceil(divisor) }
    }

    /// ⌊i / b⌋ for i ≤ 2²⁴ + 16 and b < 2¹² + 2¹¹: a product of two 64-bit words that fits in one.
    #[inline(always)]
    fn of(self, i: u32) -> u32 {
        ((u64::from(i) * self.wide) >> Self::WIDE) as u32
    }

    /// ⌊i / b⌋ for i ≤ b² and b ≤ 53: in 32 bits throughout.
    #[inline(always)]
    fn of_small(self, i: u32) -> u32 {
        (i * self.small) >> Self::SMALL
    }
}

/// Radical inverses of blocks of digits: φ(i) is the sum of one entry for each.
///
/// An entry is a 64-bit fraction, rounded up, so the sum of L of them exceeds φ(i) by less than L·2⁻⁶⁴. As 2³²·φ(i) is a whole
/// multiple of b⁻ᵈ, d the number of digits, and L·bᵈ ≤ 2³², its whole part is that of the sum.
#[derive(Debug, Clone)]
struct Blocks {
    /// A power of the base, at least [`LANES`]: indices in a row cross one border at most.
    block: u32,
    by_block: Quotient,
    /// For the lowest digits, and those after the last that a row may need; then for the digits above, level by level.
    tables: Vec<Vec<u64>>,
}

impl Blocks {
    /// Least size of a block: the entries of a level stay near each other, and few indices cross a border.
    const LEAST: u32 = 96;

    fn new(base: u32, n: u32) -> Self {
        let mut block = base;
        while block < Self::LEAST {
            block *= base;
        }
        // What a row of indices that begins below n may look at.
        let end = u64::from(n) + LANES as u64;
        let mut tables = Vec::new();
        let mut below = 1u64;
        while tables.is_empty() || below < end {
            let reach = (end / below + 1).min(block.into()) as u32;
            let entry = |x: u32| {
                let (mirror, power) = mirrored(base, x);
                ((u128::from(mirror) << 64).div_ceil(u128::from(power) * u128::from(below))) as u64
            };
            let mut table: Vec<u64> = (0..reach).map(entry).collect();
            if below == 1 {
                table.extend_from_within(..LANES.min(reach as usize));
                // Where nothing wraps, nothing is read here.
                table.resize(reach as usize + LANES, 0);
            }
            tables.push(table);
            below *= u64::from(block);
        }
        let digits = digit_count(base, n);
        let levels = digits.div_ceil(block.ilog(base)).max(1);
        assert!(u64::from(levels) * u64::from(base).pow(digits) <= 1 << 32, "base {base}, {n} indices");
        Self { block, by_block: Quotient::new(block), tables }
    }

    /// The share of the digits above the lowest block's.
    #[inline(always)]
    fn above(&self, mut rest: u32) -> u64 {
        let mut sum = 0;
        for table in &self.tables[1..] {
            if rest == 0 {
                break;
            }
            let quotient = self.by_block.of(rest);
            sum += table[(rest - quotient * self.block) as usize];
            rest = quotient;
        }
        sum
    }

    /// Radical inverses of `first` and what follows.
    #[inline(always)]
    fn run<const N: usize>(&self, first: u32) -> [u32; N] {
        assert!(N <= LANES);
        let high = self.by_block.of(first);
        let low = first - high * self.block;
        let here = self.above(high);
        let entries: &[u64; N] = self.tables[0][low as usize..][..N].try_into().expect("as many as asked for");
        if low + N as u32 <= self.block {
            return each(entries, |entry| ((entry + here) >> 32) as u32);
        }
        let (border, next) = (self.block - low, self.above(high + 1));
        let mut out = [0; N];
        for lane in 0..N {
            out[lane] = ((entries[lane] + if lane < border as usize { here } else { next }) >> 32) as u32;
        }
        out
    }

    /// Radical inverses of indices in any order.
    #[inline(always)]
    fn any<const N: usize>(&self, indices: &[u32; N]) -> [u32; N] {
        let mut rest = *indices;
        let mut sums = [0u64; N];
        for table in &self.tables {
            let quotients = each(&rest, |i| self.by_block.of(i));
            for lane in 0..N {
                sums[lane] += table[(rest[lane] - quotients[lane] * self.block) as usize];
            }
            rest = quotients;
        }
        each(&sums, |sum| (sum >> 32) as u32)
    }
}

/// One of [`HaltonAxis::digit_scrambled`], with as many digits as asked.
pub fn digit_scrambled(base: u32, digits: u32, index: u32, key: u64) -> u32 {
    let b = u64::from(base);
    let (mut rest, mut prefix, mut power, mut mirror) = (index, 0u64, 1u64, 0u64);
    for level in 0..digits {
        let digit = rest % base;
        rest /= base;
        let draw = bits64(key, prefix | (u64::from(level) << 40));
        let factor = 1 + (((draw >> 32) * (b - 1)) >> 32) as u32;
        let offset = (((draw & 0xffff_ffff) * b) >> 32) as u32;
        mirror = mirror * b + u64::from((factor * digit + offset) % base);
        prefix += in_prefix(u64::from(digit) * power);
        power *= b;
    }
    let tail = bits64(key, prefix | (u64::from(digits) << 40)) >> 32;
    (((mirror << 32) | tail) / power) as u32
}

/// What a digit adds to the prefix on which those after it depend: itself.
#[inline(always)]
fn in_prefix<T: Default>(digit: T) -> T {
    if planted(Mutant::DigitsNotNested) { T::default() } else { digit }
}

#[cfg(test)]
mod tests {
    use super::super::radical::PRIMES;
    use super::*;

    #[test]
    fn quotients_are_whole_parts() {
        for base in PRIMES.into_iter().chain([96, 121, 2809, 5000]) {
            let quotient = Quotient::new(base);
            for i in (0..3000).chain((1 << 24) - 3000..(1 << 24) + 17).chain((0..1 << 24).step_by(997)) {
                assert_eq!(quotient.of(i), i / base, "{i} / {base}");
            }
            assert!(base > 53 || (0..=base * base).all(|i| quotient.of_small(i) == i / base));
        }
    }

    /// All three ways, at borders of blocks, at random and at the ends, for every base and for counts of every size.
    #[test]
    fn blocks_equal_the_definition() {
        for base in PRIMES {
            for n in [1u32, 2, 3, 26, 64, 96, 343, 1000, 4096, 65_537, 1 << 20, (1 << 24) - 1, 1 << 24] {
                let axis = HaltonAxis::new(base, n);
                let digits = digit_count(base, n);
                let rounds = if cfg!(debug_assertions) { 150 } else { 1000 };
                for round in 0..rounds {
                    let key = bits64(round, u64::from(base));
                    let indices: [u32; LANES] = std::array::from_fn(|l| match (round, l) {
                        (_, 0) => n - 1,
                        (_, 1) => 0,
                        _ => (bits64(key, l as u64) % u64::from(n)) as u32,
                    });
                    check(&axis, digits, indices, n, key);
                    // Rows that begin anywhere, just below a power of the base, and at the end.
                    let power = u64::from(base).pow((round % u64::from(digits + 1)) as u32);
                    let before = (power * (1 + round % 3)).saturating_sub(round % 17) as u32;
                    for first in [indices[2], before % n, n.saturating_sub(1 + (round % 16) as u32)] {
                        check(&axis, digits, std::array::from_fn(|l| first + l as u32), n, key);
                    }
                    // And before the first index.
                    let before = (round % LANES as u64) as u32;
                    let found: [u32; LANES] = axis.run(before.wrapping_neg());
                    for (i, found) in (0..n).zip(&found[before as usize..]) {
                        assert_eq!(*found, radical_inverse(base, i), "base {base}, {i} of {n} after {before}");
                    }
                }
            }
        }
    }

    /// Every index below n has its value.
    fn check(axis: &HaltonAxis, digits: u32, indices: [u32; LANES], n: u32, key: u64) {
        let is_run = indices.windows(2).all(|w| w[1] == w[0] + 1);
        let plain = if is_run { axis.run(indices[0]) } else { axis.radical_inverses(&indices) };
        let scrambled = axis.digit_scrambled(&indices, key);
        for (lane, i) in indices.into_iter().enumerate().filter(|(_, i)| *i < n) {
            let base = axis.base();
            assert_eq!(plain[lane], radical_inverse(base, i), "base {base}, {i} of {n}");
            assert_eq!(scrambled[lane], digit_scrambled(base, digits, i, key), "base {base}, {i} of {n}");
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

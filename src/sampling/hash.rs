//! Integer mixers: the only source of randomness in images.
//!
//! Everything is a pure function of its arguments, so a number can be looked up in any order.

/// 2⁶⁴ / golden ratio, odd: the increment of SplitMix64 (Steele, Lea & Flood 2014, doi:10.1145/2660193.2660195).
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// SplitMix64's finaliser, a bijection of 64-bit words with good avalanche (Stafford's variant 13).
#[inline(always)]
pub const fn mix64(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Seed of a part: hashes `seed` with every word of `path`, in order.
///
/// Different paths give unrelated seeds, also where one path is a prefix of another.
#[inline]
pub const fn derive(seed: u64, path: &[u64]) -> u64 {
    let mut h = mix64(seed.wrapping_add(GOLDEN));
    let mut i = 0;
    while i < path.len() {
        h = mix64(h.wrapping_add(GOLDEN) ^ mix64(path[i].wrapping_add(GOLDEN)).rotate_left(17));
        i += 1;
    }
    h
}

/// Seed of a part that has a name: as [`derive()`] over the bytes of `name` and its length.
pub fn derive_named(seed: u64, name: &str) -> u64 {
    let mut h = derive(seed, &[name.len() as u64]);
    for chunk in name.as_bytes().chunks(8) {
        let mut word = [0; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        h = derive(h, &[u64::from_le_bytes(word)]);
    }
    h
}

/// 32 random bits for position `index` of the stream `key`: word `index` of SplitMix64 started at `key`.
#[inline(always)]
pub const fn bits32(key: u64, index: u32) -> u32 {
    (mix64(key.wrapping_add(GOLDEN.wrapping_mul(index as u64 + 1))) >> 32) as u32
}

/// 64 random bits for the 64-bit position `at` of the stream `key`.
#[inline(always)]
pub const fn bits64(key: u64, at: u64) -> u64 {
    mix64(key ^ mix64(at.wrapping_add(GOLDEN)))
}

/// A random permutation of `0..n` that a key names.
///
/// A bijection of the next power of two (rounds of odd multiplication, xor-shift and addition, each invertible modulo
/// 2ᵏ), walked along its cycle until it lands below `n`, as in Kensler 2013 (Pixar memo 13-01). For n ≤ 4 all n!
/// permutations occur equally often within the error of the test below.
#[derive(Debug, Clone, Copy)]
pub struct Permutation {
    n: u32,
    mask: u32,
    shift: u32,
    keys: [u32; 4],
}

impl Permutation {
    /// The permutation of `0..n` under `key`; n ≥ 1.
    #[inline]
    pub const fn new(n: u32, key: u64) -> Self {
        let bits = 32 - (n - 1).leading_zeros();
        let second = mix64(key ^ GOLDEN);
        // Eight rounds with 16 fresh key bits each: two words of key, read from different places.
        let keys = [key as u32, (key >> 32) as u32, second as u32, (second >> 32) as u32];
        Self { n, mask: ((1u64 << bits) - 1) as u32, shift: bits.div_ceil(2), keys }
    }

    /// Place of `index`, which is below n.
    #[inline(always)]
    pub const fn place(&self, index: u32) -> u32 {
        debug_assert!(index < self.n);
        let mut x = index;
        loop {
            x = self.step(x);
            if x < self.n {
                return x;
            }
        }
    }

    /// The bijection of the power of two, whose cycles are walked.
    #[inline(always)]
    const fn step(&self, mut x: u32) -> u32 {
        // Only the bits below `mask` matter to what follows them, so it is enough to mask before each shift to the right.
        let mut i = 0;
        while i < 4 {
            let k = self.keys[i];
            x = x.wrapping_add(k).wrapping_mul((k >> 15) | 1) & self.mask;
            x ^= x >> self.shift;
            x = x.wrapping_add(k >> 7).wrapping_mul((k >> 21) | 1) & self.mask;
            x ^= x >> 1;
            i += 1;
        }
        x
    }

    /// Places of several indices, all below n: as [`Self::place`], walking all of them together.
    #[inline(always)]
    pub fn places<const N: usize>(&self, indices: &mut [u32; N]) {
        indices.iter_mut().for_each(|x| *x = self.step(*x));
        // Of a power of two nothing lies beyond.
        while indices.iter().fold(false, |beyond, &x| beyond | (x >= self.n)) {
            for x in indices.iter_mut() {
                let next = self.step(*x);
                *x = if *x >= self.n { next } else { *x };
            }
        }
    }
}

/// Place of `index` under the [`Permutation`] of `0..n` that `key` names; `index < n`.
#[inline]
pub fn permute(index: u32, n: u32, key: u64) -> u32 {
    Permutation::new(n, key).place(index)
}

/// The unit-interval float of a 32-bit fraction: its top 24 bits, so that it is exact and always below 1.
#[inline(always)]
pub const fn unit_f32(fraction: u32) -> f32 {
    (fraction >> 8) as f32 * (1.0 / 16_777_216.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::hypothesis::chi2_upper_tail;

    #[test]
    fn the_largest_fraction_stays_below_one() {
        assert_eq!(unit_f32(u32::MAX), 1.0 - f32::EPSILON / 2.0);
        assert_eq!(unit_f32(255), 0.0);
    }

    #[test]
    fn permute_is_a_bijection_for_every_small_and_awkward_n() {
        for n in (1..200).chain([255, 256, 257, 1000, 4095, 4097]) {
            for key in [0, 1, u64::MAX, 0x1234_5678_9abc_def0] {
                let mut seen = vec![false; n as usize];
                for i in 0..n {
                    let p = permute(i, n, key) as usize;
                    let mut block = [i, n - 1 - i, 0];
                    Permutation::new(n, key).places(&mut block);
                    assert_eq!(block, [p as u32, permute(n - 1 - i, n, key), permute(0, n, key)]);
                    assert!(!std::mem::replace(&mut seen[p], true), "n {n}, key {key}: {p} twice");
                }
            }
        }
    }

    /// χ² over all permutations of 3 and 4, and over the ordered pairs (π(0), π(1)) and (π(3), π(n−1)) for larger n.
    /// A pair twice as likely as it should be adds 400 to χ². False alarms: 1.2e-8 (12 tests of 1e-9).
    #[test]
    fn permutations_are_equally_likely() {
        for n in [3u32, 4] {
            let mut counts = std::collections::BTreeMap::new();
            for seed in 0..48_000u64 {
                let order: Vec<u32> = (0..n).map(|i| permute(i, n, mix64(seed))).collect();
                *counts.entry(order).or_insert(0u32) += 1;
            }
            let cells = (1..=n).product::<u32>() as usize;
            assert_eq!(counts.len(), cells);
            let expected = 48_000.0 / cells as f64;
            let chi2: f64 = counts.values().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum();
            let df = cells as f64 - 1.0;
            assert!(chi2_upper_tail(chi2, df) > 1e-9, "n {n}: χ² {chi2} with {df} degrees of freedom");
        }
        for n in [5u32, 8, 12, 16, 28] {
            for (a, b) in [(0, 1), (3, n - 1)] {
                let mut counts = vec![0u32; (n * n) as usize];
                let trials = 400 * n * (n - 1);
                for seed in 0..u64::from(trials) {
                    let key = mix64(seed ^ 0x5eed);
                    counts[(permute(a, n, key) * n + permute(b, n, key)) as usize] += 1;
                }
                let chi2: f64 =
                    counts.iter().filter(|&&c| c > 0).map(|&c| (f64::from(c) - 400.0).powi(2) / 400.0).sum();
                assert_eq!(counts.iter().filter(|&&c| c > 0).count() as u32, n * (n - 1));
                let df = f64::from(n * (n - 1) - 1);
                assert!(chi2_upper_tail(chi2, df) > 1e-9, "n {n}, places {a} and {b}: χ² {chi2} with {df}");
            }
        }
    }

    #[test]
    fn derived_seeds_differ_by_every_word_and_by_length() {
        let seeds =
            [derive(1, &[]), derive(1, &[0]), derive(1, &[0, 0]), derive(2, &[0]), derive(1, &[1]), derive(0, &[1, 0])];
        for (i, a) in seeds.iter().enumerate() {
            assert!(seeds[i + 1..].iter().all(|b| a != b));
        }
        assert_ne!(derive_named(1, "ab"), derive_named(1, "ab\0"));
    }
}

//! Sobol' sequences, the (0,2)-sequence among them, and their scrambles: digital shift and nested uniform (Owen).

use super::{ROW, each, mask_from};

/// Direction numbers of Joe & Kuo (2008), doi:10.1137/070709359, criterion D(6), dimensions 2 to 256, under their notice:
/// lines that begin with `#`.
const JOE_KUO: &str = include_str!("new-joe-kuo-6.256.txt");

/// Dimensions that the table gives, van der Corput's first one included.
pub const DIMENSIONS: u32 = 256;

/// One coordinate of the Sobol' sequence, ready to look up: `x = T₀[i₀] ⊕ T₁[i₁] ⊕ T₂[i₂]` for the bytes of a 24-bit index.
#[derive(Debug, Clone)]
pub struct SobolAxis {
    columns: [u32; 32],
    tables: Box<[[u32; 256]; 3]>,
    /// What the lowest four digits of an index give, twice over: any run of [`RUN`] is in one piece.
    low: [u32; 2 * RUN],
}

/// Consecutive indices looked up at once.
pub const RUN: usize = ROW;

impl SobolAxis {
    /// Coordinate number `dimension` (0 is van der Corput's), or `None` beyond the table's [`DIMENSIONS`].
    pub fn new(dimension: u32) -> Option<Self> {
        let columns = columns(dimension)?;
        let mut tables = Box::new([[0u32; 256]; 3]);
        for (byte, table) in tables.iter_mut().enumerate() {
            for i in 1..256usize {
                // The lowest set bit is one column; the rest has been looked up before.
                table[i] = table[i & (i - 1)] ^ columns[8 * byte + i.trailing_zeros() as usize];
            }
        }
        let low = std::array::from_fn(|i| tables[0][i % RUN]);
        Some(Self { columns, tables, low })
    }

    /// The 32-bit fraction of point `index` < 2²⁴.
    #[inline(always)]
    pub fn fraction(&self, index: u32) -> u32 {
        self.tables[0][(index & 255) as usize]
            ^ self.tables[1][((index >> 8) & 255) as usize]
            ^ self.tables[2][((index >> 16) & 255) as usize]
    }

    /// [`Self::fraction`] of `first` and the indices after it. `first` may lie less than [`RUN`] below 0 (modulo 2³²): what is found
    /// for indices below 0 means nothing.
    ///
    /// Two aligned rows, of which each shares all but the lowest digits.
    #[inline(always)]
    pub fn run(&self, first: u32) -> [u32; RUN] {
        let row = first & !(RUN as u32 - 1);
        let (here, next) = (self.fraction(row), self.fraction(row.wrapping_add(RUN as u32)));
        let begin = (first - row) as usize;
        let low: &[u32; RUN] = self.low[begin..][..RUN].try_into().expect("a row");
        let mut out = [0; RUN];
        for ((out, low), in_next) in out.iter_mut().zip(low).zip(mask_from(RUN - begin)) {
            *out = low ^ here ^ ((here ^ next) & in_next);
        }
        out
    }

    /// [`Self::fraction`] of indices in any order.
    #[inline(always)]
    pub fn fractions<const N: usize>(&self, indices: &[u32; N]) -> [u32; N] {
        each(indices, |index| self.fraction(index))
    }

    /// The generator matrix, column by column, most significant digit first in each word.
    pub fn columns(&self) -> &[u32; 32] {
        &self.columns
    }
}

/// Generator columns v_j = m_j / 2ʲ by the recurrence of Bratley & Fox (1988), doi:10.1145/42288.214372.
fn columns(dimension: u32) -> Option<[u32; 32]> {
    if dimension == 0 {
        return Some(std::array::from_fn(|j| 1 << (31 - j)));
    }
    let row = JOE_KUO.lines().find_map(|line| {
        let mut words = line.split_whitespace().map(str::parse::<u32>);
        (words.next()?.ok()? == dimension + 1).then(|| words.map_while(Result::ok).collect::<Vec<_>>())
    })?;
    let (&[s, a], m) = row.split_first_chunk::<2>()?;
    let s = s as usize;
    let mut v = [0u32; 32];
    for j in 0..32 {
        v[j] = if j < s {
            m[j] << (31 - j)
        } else {
            let mut x = v[j - s] ^ (v[j - s] >> s);
            for k in 1..s {
                if (a >> (s - 1 - k)) & 1 == 1 {
                    x ^= v[j - k];
                }
            }
            x
        };
    }
    Some(v)
}

/// Nested uniform (Owen) scramble of a 32-bit fraction, by hashing.
///
/// The Laine–Karras form on the bit-reversed word with Vegdahl's 2021 constants: each digit is flipped by a hash of the
/// digits above it and of `seed`, which must be well mixed. Owen (1995); Laine & Karras (2011); Burley (2020, JCGT 9(4)) gave
/// the form, whose first constants miss Owen's variances by factors 0.26 to 2.24: see the tests.
#[inline(always)]
pub const fn owen_scramble(fraction: u32, seed: u32) -> u32 {
    let mut x = fraction.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sequence digit by digit from its definition, without tables.
    fn by_definition(axis: &SobolAxis, index: u32) -> u32 {
        (0..32).filter(|b| index >> b & 1 == 1).fold(0, |x, b| x ^ axis.columns()[b as usize])
    }

    #[test]
    fn known_values() {
        let y = SobolAxis::new(1).unwrap();
        // Sobol' dimension 2: 0, 1/2, 3/4, 1/4, 5/8, 1/8, 3/8, 7/8 (Joe & Kuo's order of indices, not Gray code).
        let first: Vec<u32> = (0..8).map(|i| y.fraction(i) >> 29).collect();
        assert_eq!(first, [0, 4, 6, 2, 5, 1, 3, 7]);
        assert!(SobolAxis::new(255).is_some() && SobolAxis::new(256).is_none());
    }

    #[test]
    fn the_table_keeps_its_notice_and_all_its_rows() {
        let notice: Vec<&str> = JOE_KUO.lines().take_while(|line| line.starts_with('#')).collect();
        for words in
            ["Copyright (c) 2008, Frances Y. Kuo and Stephen Joe", "list of conditions and the following disclaimer"]
        {
            assert!(notice.iter().any(|line| line.contains(words)), "{words}");
        }
        let first_words = JOE_KUO.lines().skip(notice.len() + 1).map(|line| line.split_whitespace().next().unwrap());
        assert!(first_words.eq((2..=256).map(|d: u32| d.to_string()).collect::<Vec<_>>()));
    }

    #[test]
    fn tables_equal_the_definition() {
        for dimension in 0..12 {
            let axis = SobolAxis::new(dimension).unwrap();
            for index in (0..300).chain([65_535, 65_536, (1 << 24) - 1]) {
                assert_eq!(axis.fraction(index), by_definition(&axis, index));
                // Runs that end at `index`, of any alignment; some begin below 0.
                let first = index.wrapping_sub(RUN as u32 - 1);
                for (i, found) in (0..RUN as u32).map(|l| first.wrapping_add(l)).zip(axis.run(first)) {
                    assert!(i > index || found == by_definition(&axis, i), "dimension {dimension}, {i}");
                }
                let others: [u32; 16] = std::array::from_fn(|l| index.saturating_sub(7 * l as u32));
                assert_eq!(axis.fractions(&others), others.map(|i| by_definition(&axis, i)));
            }
        }
    }

    #[test]
    fn every_aligned_block_of_the_pair_is_a_net_also_scrambled() {
        let (x, y) = (SobolAxis::new(0).unwrap(), SobolAxis::new(1).unwrap());
        for m in 0..=8u32 {
            for block in 0..6u32 {
                for seed in [None, Some(0x1357_9bdf_u32)] {
                    let scramble = |f: u32, s: u32| {
                        seed.map_or(f, |seed| owen_scramble(f, super::super::hash::mix64(u64::from(seed ^ s)) as u32))
                    };
                    let points: Vec<(u32, u32)> = (block << m..(block + 1) << m)
                        .map(|i| (scramble(x.fraction(i), 1), scramble(y.fraction(i), 2)))
                        .collect();
                    for e in 0..=m {
                        let cell = |v: u32, bits: u32| if bits == 0 { 0 } else { v >> (32 - bits) };
                        let mut seen = vec![false; 1 << m];
                        for &(px, py) in &points {
                            let key = (cell(px, e) << (m - e)) | cell(py, m - e);
                            assert!(!std::mem::replace(&mut seen[key as usize], true));
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn the_scramble_is_nested() {
        // Two words that share their k top bits, and no more, must share exactly their k top bits afterwards.
        for seed in 0..200u64 {
            let seed = super::super::hash::mix64(seed) as u32;
            for k in 0..32 {
                let a = super::super::hash::mix64(u64::from(seed) + k) as u32;
                let b = a ^ (0x8000_0000 >> k) ^ ((seed.rotate_left(7)) & (0x7fff_ffff >> k));
                let differ = owen_scramble(a, seed) ^ owen_scramble(b, seed);
                assert_eq!(u64::from(differ.leading_zeros()), k);
            }
        }
    }
}

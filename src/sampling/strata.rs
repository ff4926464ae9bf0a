//! Jittered strata in one and two dimensions.

use super::divisor::Divisor;

/// The factor pair a·b = n nearest to a square, a ≤ b, where it is near enough: b/a ≤ 2.
pub fn factor_pair(n: u32) -> Option<(u32, u32)> {
    let mut a = n.isqrt();
    while a > 0 && u64::from(n) <= 2 * u64::from(a) * u64::from(a) {
        if n.is_multiple_of(a) {
            return Some((a, n / a));
        }
        a -= 1;
    }
    None
}

/// The number of strata taken where `asked` are asked for: the next n that has a [`factor_pair`] (26 → 28 = 4·7).
pub fn strata_taken(asked: u32) -> u32 {
    (asked..).find(|&n| factor_pair(n).is_some()).expect("every square has a factor pair, and one lies below 2²⁵")
}

/// A point of stratum `cell` of `cells` equal ones, as a 32-bit fraction: ⌊(cell·2³² + jitter) / cells⌋.
pub fn in_stratum(cell: u32, cells: u32, jitter: u32) -> u32 {
    stratum_fraction(cell, Divisor::new(cells.into()), jitter)
}

/// [`in_stratum`] with the number of strata made ready.
#[inline(always)]
pub(super) fn stratum_fraction(cell: u32, cells: Divisor, jitter: u32) -> u32 {
    cells.quotient((u64::from(cell) << 32) | u64::from(jitter)) as u32
}

/// The same, correctly rounded to f64.
pub fn in_stratum_f64(cell: u32, cells: u32, jitter: u32) -> f64 {
    (f64::from(cell) + f64::from(jitter) / 4_294_967_296.0) / f64::from(cells)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_taken_are_the_documented_ones() {
        for (asked, taken, pair) in [
            (1, 1, (1, 1)),
            (2, 2, (1, 2)),
            (3, 4, (2, 2)),
            (7, 8, (2, 4)),
            (13, 15, (3, 5)),
            (16, 16, (4, 4)),
            (26, 28, (4, 7)),
            (64, 64, (8, 8)),
        ] {
            assert_eq!(strata_taken(asked), taken);
            assert_eq!(factor_pair(taken), Some(pair));
        }
        assert_eq!(strata_taken(1 << 24), 1 << 24);
    }

    #[test]
    fn a_point_stays_in_its_stratum() {
        for cells in [1, 3, 7, 1000, 1 << 24] {
            for cell in [0, cells / 2, cells - 1] {
                for jitter in [0, u32::MAX] {
                    let f = u128::from(in_stratum(cell, cells, jitter)) * u128::from(cells);
                    // The fraction is rounded down by less than 2⁻³², so the stratum is met to that precision.
                    assert!(f + u128::from(cells) > u128::from(cell) << 32 && f < u128::from(cell + 1) << 32);
                }
            }
        }
    }
}

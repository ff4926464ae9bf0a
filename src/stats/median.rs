//! The middle of repeated measurements, whatever their distribution.

use super::moments::Estimate;

/// The median with an interval between two of the values themselves: the sorted values without k at either end, k the largest
/// with P(Binomial(n, ½) ≤ k) ≤ (1 − `confidence`)/2, so the level holds for independent values of any continuous distribution
/// (Conover, Practical Nonparametric Statistics, § 3.2). Six values are the fewest that bear 95 %; of fewer the interval is their
/// range, whose level is 1 − 2^(1−n). `None` of no values, no interval of one.
pub fn median_interval(values: &[f64], confidence: f64) -> Option<Estimate> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (n, last) = (sorted.len(), sorted.len().checked_sub(1)?);
    let value = (sorted[last / 2] + sorted[n / 2]) / 2.0;
    let rank = outer_rank(n, (1.0 - confidence) / 2.0);
    Some(Estimate { value, ci95: (n > 1).then(|| [sorted[rank], sorted[last - rank]]) })
}

/// How many values may be left out at either end: the largest k with P(Binomial(n, ½) ≤ k) ≤ `tail`; 0 where there is none.
fn outer_rank(n: usize, tail: f64) -> usize {
    // Of 1000 values and more the first terms vanish, and are far below any tail.
    let mut term = libm::exp2(-(n as f64));
    let (mut below, mut k) = (term, 0);
    while k < n / 2 {
        term *= (n - k) as f64 / (k + 1) as f64;
        below += term;
        if below > tail {
            break;
        }
        k += 1;
    }
    k
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1/64 of 6; 9/256 > 0.025 of 8; 10/512 of 9; 79/4096 of 12; 576/32768 of 15 and so on, by the binomial coefficients.
    #[test]
    fn ranks_are_those_of_the_binomial_table() {
        for (n, k) in [(1, 0), (5, 0), (6, 0), (8, 0), (9, 1), (11, 1), (12, 2), (15, 3), (20, 5), (25, 7)] {
            assert_eq!(outer_rank(n, 0.025), k, "{n}");
        }
    }

    #[test]
    fn the_median_lies_between_its_ends_and_outliers_do_not_move_it() {
        let seconds = [1.0, 9.0, 1.2, 1.1, 1.3, 1.05, 1.15, 1.25, 50.0];
        let found = median_interval(&seconds, 0.95).unwrap();
        assert_eq!((found.value, found.ci95), (1.2, Some([1.05, 9.0])));
        assert_eq!(median_interval(&[2.0, 1.0], 0.95), Some(Estimate { value: 1.5, ci95: Some([1.0, 2.0]) }));
        assert_eq!(median_interval(&[2.0], 0.95), Some(Estimate::without_interval(2.0)));
        assert_eq!(median_interval(&[], 0.95), None);
    }
}

//! What repeats say: median, spread, interval, and the table that a person reads.

use serde::Serialize;

/// What was found of one quantity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Found {
    /// Group, what it was measured on, quantity.
    pub name: String,
    /// Unit of all numbers here.
    pub unit: &'static str,
    /// Median of the repeats.
    pub median: f64,
    /// Median distance from the median.
    pub mad: f64,
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
    /// 95 % interval: of the median, by order statistics; of an exponent, by resampling the repeats. `None` where there are too
    /// few repeats for one.
    pub interval: Option<[f64; 2]>,
    /// Repeats.
    pub runs: usize,
}

impl Found {
    /// Of at least one finite repeat; `None` of none.
    pub fn of(name: String, unit: &'static str, values: &[f64]) -> Option<Self> {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let (&min, &max) = (sorted.first()?, sorted.last()?);
        let middle = median(&sorted);
        let mut distances: Vec<f64> = sorted.iter().map(|v| (v - middle).abs()).collect();
        distances.sort_by(f64::total_cmp);
        let mad = median(&distances);
        Some(Self { name, unit, median: middle, mad, min, max, interval: median_interval(&sorted), runs: sorted.len() })
    }
}

/// Median of sorted values, at least one.
fn median(sorted: &[f64]) -> f64 {
    let n = sorted.len();
    0.5 * (sorted[(n - 1) / 2] + sorted[n / 2])
}

/// 95 % interval of a median from sorted values, whatever their distribution: the k-th smallest and k-th largest, with the
/// largest k for which P(Binomial(n, ½) < k) ≤ 2.5 %. `None` below six values, where even the extremes are too near.
pub fn median_interval(sorted: &[f64]) -> Option<[f64; 2]> {
    let n = sorted.len();
    // Beyond 1000 repeats 2⁻ⁿ would vanish; nothing here is repeated that often.
    assert!(n <= 1000, "{n} repeats");
    let (mut probability, mut below, mut k) = (libm::exp2(-(n as f64)), 0.0, 0usize);
    while below + probability <= 0.025 {
        below += probability;
        probability *= (n - k) as f64 / (k + 1) as f64;
        k += 1;
    }
    (k > 0).then(|| [sorted[k - 1], sorted[n - k]])
}

/// A table for people: aligned, a line each.
pub fn table(found: &[Found]) -> String {
    let head = ["name", "median", "unit", "MAD", "min", "max", "95 % of the median", "runs"].map(str::to_owned);
    let row = |f: &Found| {
        let interval = f.interval.map_or("–".to_owned(), |[low, high]| format!("{} … {}", digits(low), digits(high)));
        [
            f.name.clone(),
            digits(f.median),
            f.unit.to_owned(),
            digits(f.mad),
            digits(f.min),
            digits(f.max),
            interval,
            f.runs.to_string(),
        ]
    };
    let rows: Vec<[String; 8]> = std::iter::once(head).chain(found.iter().map(row)).collect();
    let width = |column: usize| rows.iter().map(|r| r[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; 8] = std::array::from_fn(width);
    let mut text = String::new();
    for row in &rows {
        for (column, cell) in row.iter().enumerate() {
            let space = " ".repeat(widths[column] - cell.chars().count());
            // Words to the left, numbers to the right.
            text += &match column {
                0 | 2 => format!("{cell}{space}  "),
                _ => format!("{space}{cell}  "),
            };
        }
        text.truncate(text.trim_end().len());
        text.push('\n');
    }
    text
}

/// Four significant digits.
fn digits(v: f64) -> String {
    if v == 0.0 {
        return "0".to_owned();
    }
    let exponent = libm::floor(libm::log10(v.abs())) as i32;
    match exponent {
        -3..=5 => format!("{v:.*}", (3 - exponent).max(0) as usize),
        _ => format!("{v:.3e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn median_spread_and_extremes() {
        let found = Found::of("x".into(), "s", &[3.0, 1.0, f64::NAN, 2.0, 10.0]).unwrap();
        assert_eq!((found.median, found.mad, found.min, found.max, found.runs), (2.5, 1.0, 1.0, 10.0, 4));
        assert!(found.interval.is_none());
        assert!(Found::of("x".into(), "s", &[f64::NAN]).is_none());
    }

    /// Ranks from tables of the sign test: n = 6: 1 and 6; 10: 2 and 9; 20: 6 and 15; 25: 8 and 18.
    #[test]
    fn the_medians_interval_has_the_ranks_of_the_sign_test() {
        for (n, k) in [(6, 1), (8, 1), (9, 2), (10, 2), (20, 6), (25, 8)] {
            let sorted: Vec<f64> = (1..=n).map(f64::from).collect();
            assert_eq!(median_interval(&sorted), Some([f64::from(k), f64::from(n + 1 - k)]), "{n}");
        }
        assert_eq!(median_interval(&[1.0; 5]), None);
    }

    #[test]
    fn the_table_is_aligned_and_keeps_four_digits() {
        let found: Vec<Found> =
            ["a", "longer name"].map(|n| Found::of(n.into(), "ns", &[1234.56, 0.01]).unwrap()).into();
        let text = table(&found);
        let starts: Vec<_> = text.lines().skip(1).map(|line| line.find(" ns").unwrap()).collect();
        assert_eq!(starts[0], starts[1]);
        assert_eq!([1234.56, 0.012_345_6, 12.0, 1e9, 0.0].map(digits), ["1235", "0.01235", "12.00", "1.000e9", "0"]);
    }
}

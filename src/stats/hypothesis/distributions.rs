//! Whole distributions: counts in cells (Pearson's χ²) and distances of distribution functions (Kolmogorov–Smirnov).

use super::means::chi2_upper_tail;
use super::{Family, POWER, Verdict};
use crate::mutants::{Mutant, planted};
use crate::stats::moments::sum;
use crate::stats::special::solve_falling;

/// Cells of a χ² test with fewer expected counts are pooled: Cochran's rule, for levels about 1 %. The true tail is heavier than
/// χ²'s the farther out one looks: with 25 counts in each of 64 cells 1.4 times at 10⁻⁴, 4.8 times at 10⁻⁹, 28 times at
/// 10⁻¹⁴ (exact convolution of Poisson's counts). Tests at such levels want as many counts and a level that pays for it.
pub const MIN_EXPECTED: f64 = 5.0;

/// Which χ² is too far out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tail {
    /// Too large: the counts are elsewhere. The usual test.
    Uneven,
    /// Too small: the counts are closer to their expectation than independent draws can be, as those of a stratified
    /// set are.
    TooEven,
    /// Either, each at half the level: p is twice the smaller tail.
    Both,
}

/// Do counts follow expected counts? Pearson's χ² on independent draws, upper tail.
///
/// As [`chi2_test_of`] with [`Tail::Uneven`]: a perfectly even set has χ² near 0 and holds.
pub fn chi2_test(observed: &[u64], expected: &[f64], family: Family) -> Verdict {
    chi2_test_of(observed, expected, Tail::Uneven, family)
}

/// Do counts follow expected counts? Pearson's χ² = Σ (O − E)²/E on independent draws.
///
/// Cells below [`MIN_EXPECTED`] expected counts are pooled, smallest first, and what remains below joins the next
/// smallest cell. Degrees of freedom: cells − 1, so the expected counts must add up to the observed ones. `detects` is the
/// smallest √(Σ (p − p₀)²/p₀) over the pooled cells – the root mean square relative departure of the probabilities – that
/// would be caught as uneven, from the noncentral χ² distribution; `None` for [`Tail::TooEven`].
///
/// Undefined where the lists differ in length, the totals disagree, an expectation is negative or fewer than two
/// cells remain.
pub fn chi2_test_of(observed: &[u64], expected: &[f64], tail: Tail, family: Family) -> Verdict {
    let undefined = |why| Verdict::undefined(family, why);
    if observed.len() != expected.len() {
        return undefined("as many observed as expected counts are needed");
    }
    if !expected.iter().all(|e| e.is_finite() && *e >= 0.0) {
        return undefined("an expected count is negative or not finite");
    }
    let total_observed = observed.iter().sum::<u64>() as f64;
    // Expected counts are often n times rounded probabilities; a real mistake is far above 1e-6.
    if (sum(expected.iter().copied()) - total_observed).abs() > 1e-6 * total_observed {
        return undefined("expected and observed counts have different totals");
    }
    let cells = pooled_cells(observed, expected);
    if cells.len() < 2 {
        return undefined("fewer than two cells are left after pooling");
    }
    let statistic = sum(cells.iter().map(|&(o, e)| (o as f64 - e) * (o as f64 - e) / e));
    let constraints = if planted(Mutant::CellsAsFreedom) { 0.0 } else { 1.0 };
    let freedom = cells.len() as f64 - constraints;
    let upper = chi2_upper_tail(statistic, freedom);
    // The lower tail loses digits by this difference only where it is near 1, far from any threshold but for very even
    // counts, where the upper one is 1 and the lower needs its own series.
    let lower = chi2_lower_tail(statistic, freedom);
    let (p, level) = match tail {
        Tail::Uneven => (upper, family.per_test()),
        Tail::TooEven => (lower, family.per_test()),
        Tail::Both => ((2.0 * upper.min(lower)).min(1.0), 0.5 * family.per_test()),
    };
    let detects = (tail != Tail::TooEven).then(|| (noncentrality_caught(freedom, level) / total_observed).sqrt());
    Verdict { detects, ..Verdict::tested(family, statistic, p) }
}

/// P(X ≤ statistic) of χ², by the series Σ x^k/((a)(a+1)…(a+k)) below the median and as a complement above.
fn chi2_lower_tail(statistic: f64, df: f64) -> f64 {
    let (a, x) = (0.5 * df, 0.5 * statistic);
    if x >= a {
        return 1.0 - chi2_upper_tail(statistic, df);
    }
    if x <= 0.0 {
        return 0.0;
    }
    let mut term = 1.0 / a;
    let mut series = term;
    let mut k = 1.0;
    while term > series * 1e-17 {
        term *= x / (a + k);
        series += term;
        k += 1.0;
    }
    libm::exp(a * libm::log(x) - x - libm::lgamma(a)) * series
}

/// The noncentrality λ at which χ² with `df` degrees of freedom exceeds its critical value of `level` with probability
/// [`POWER`]: the Poisson mixture Σ_j e^(−λ/2) (λ/2)^j/j! · P(χ²_{df+2j} > c).
fn noncentrality_caught(df: f64, level: f64) -> f64 {
    let mut high = df + 10.0;
    while chi2_upper_tail(high, df) > level {
        high *= 2.0;
    }
    let critical = solve_falling(|x| chi2_upper_tail(x, df), level, 0.0, high);
    let power = |lambda: f64| {
        let half = 0.5 * lambda;
        let spread = 10.0 * half.sqrt() + 20.0;
        let (first, last) = ((half - spread).max(0.0).floor(), (half + spread).ceil());
        let mut j = first;
        let mut total = 0.0;
        while j <= last {
            let weight = libm::exp(j * libm::log(half) - half - libm::lgamma(j + 1.0));
            total += weight * chi2_upper_tail(critical, df + 2.0 * j);
            j += 1.0;
        }
        total
    };
    let mut high = critical;
    while power(high) < POWER {
        high *= 2.0;
    }
    // The power is stated to three digits: sixteen halvings are enough.
    let mut low = 0.0;
    for _ in 0..16 {
        let middle = 0.5 * (low + high);
        if power(middle) < POWER { low = middle } else { high = middle }
    }
    high
}

/// Cells by rising expectation, small ones joined until each expects at least [`MIN_EXPECTED`].
pub(super) fn pooled_cells(observed: &[u64], expected: &[f64]) -> Vec<(u64, f64)> {
    let mut order: Vec<usize> = (0..expected.len()).collect();
    order.sort_by(|&a, &b| expected[a].total_cmp(&expected[b]));
    let mut cells = Vec::new();
    let (mut count, mut mass) = (0, 0.0);
    for i in order {
        count += observed[i];
        mass += expected[i];
        if mass >= MIN_EXPECTED {
            cells.push((count, mass));
            (count, mass) = (0, 0.0);
        }
    }
    if let Some(last) = cells.last_mut() {
        // What is left expects too little for a cell of its own.
        last.0 += count;
        last.1 += mass;
    }
    cells
}

/// Do counts in cells follow the cells' probabilities? [`chi2_test_of`] against total × `masses`.
///
/// The masses – from [`cell_masses`] or a closed form – must add up to 1 within 1e-6: otherwise the density is not
/// normalised, or not over these cells, and the verdict is undefined.
pub fn chi2_masses_test(observed: &[u64], masses: &[f64], tail: Tail, family: Family) -> Verdict {
    if (sum(masses.iter().copied()) - 1.0).abs() > 1e-6 || !masses.iter().all(|m| m.is_finite()) {
        return Verdict::undefined(family, "the density does not integrate to 1 over the cells");
    }
    let total = observed.iter().sum::<u64>() as f64;
    chi2_test_of(observed, &masses.iter().map(|m| m * total).collect::<Vec<_>>(), tail, family)
}

/// The mass of a density in each cell of a grid over the rectangle from `low` to `high`: row by row, `grid` = [columns,
/// rows], cell (i, j) at index j · columns + i. A density of one variable takes one row of height 1.
///
/// 5 × 5 Gauss–Legendre points, and the same on the four quarters of a cell; where the two differ by more than 1e-9 of
/// what an even cell has, the quarters are divided again, seven times at most. A jump along a line inside a cell thus keeps an
/// error of about 2⁻⁸ of one row of quarters: use a grid that follows the jumps of the density where it has any.
///
/// # Panics
/// Without cells: a mistake of the program.
pub fn cell_masses(
    density: impl Fn([f64; 2]) -> f64,
    low: [f64; 2],
    high: [f64; 2],
    [columns, rows]: [usize; 2],
) -> Vec<f64> {
    assert!(columns > 0 && rows > 0, "a grid of {columns} × {rows} cells");
    let size = [(high[0] - low[0]) / columns as f64, (high[1] - low[1]) / rows as f64];
    let tolerance = 1e-9 / (columns * rows) as f64;
    let corner = |i: usize, j: usize| [low[0] + i as f64 * size[0], low[1] + j as f64 * size[1]];
    let cell = |j: usize, i: usize| {
        let whole = gauss_cell(&density, corner(i, j), size);
        mass_of_cell(&density, corner(i, j), size, whole, tolerance, 7)
    };
    (0..rows).flat_map(|j| (0..columns).map(move |i| (j, i))).map(|(j, i)| cell(j, i)).collect()
}

fn mass_of_cell(
    density: &impl Fn([f64; 2]) -> f64,
    [x, y]: [f64; 2],
    [width, height]: [f64; 2],
    whole: f64,
    tolerance: f64,
    depth: u32,
) -> f64 {
    let half = [0.5 * width, 0.5 * height];
    let corners = [[x, y], [x + half[0], y], [x, y + half[1]], [x + half[0], y + half[1]]];
    let quarters = corners.map(|corner| gauss_cell(density, corner, half));
    let together: f64 = quarters.iter().sum();
    if depth == 0 || (together - whole).abs() <= tolerance {
        return together;
    }
    let divided = corners.iter().zip(quarters);
    divided.map(|(&corner, quarter)| mass_of_cell(density, corner, half, quarter, 0.25 * tolerance, depth - 1)).sum()
}

/// Integral over one rectangle by 5 × 5 Gauss–Legendre points (exact for polynomials of degree 9 in either variable).
fn gauss_cell(density: &impl Fn([f64; 2]) -> f64, [x, y]: [f64; 2], [width, height]: [f64; 2]) -> f64 {
    const NODES: [(f64, f64); 5] = [
        (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    ];
    let at = |start: f64, length: f64, node: f64| start + length * 0.5 * (1.0 + node);
    let row = |(v, weight): &(f64, f64)| {
        let line = NODES.iter().map(|(u, w)| w * density([at(x, width, *u), at(y, height, *v)]));
        weight * line.sum::<f64>()
    };
    0.25 * width * height * NODES.iter().map(row).sum::<f64>()
}

/// Are independent `values` uniform on [0, 1]? Kolmogorov–Smirnov, two-sided.
///
/// The p-value is twice the exact one-sided one (Birnbaum & Tingey 1951): an upper bound on the two-sided p-value, and
/// above it by a share of about (p/2)³, so the test never lies more often than stated. Below p = 0.3 the two
/// agree to 1 %; a true p near 1 reads 1. Undefined without values or with one outside [0, 1].
///
/// `detects` bounds the smallest distance of the distribution functions that is caught, by Massart's inequality (1990) for
/// the critical distance and for the chance of missing: √(ln(2/α)/2n) + √(ln(1/(1 − power))/2n).
pub fn ks_uniform_test(values: &[f64], family: Family) -> Verdict {
    if values.is_empty() || !values.iter().all(|v| (0.0..=1.0).contains(v)) {
        return Verdict::undefined(family, "Kolmogorov–Smirnov needs values in [0, 1]");
    }
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let below = |i: usize, v: f64| if planted(Mutant::SmirnovOneSided) { 0.0 } else { v - i as f64 / n };
    let gap = |(i, &v): (usize, &f64)| ((i + 1) as f64 / n - v).max(below(i, v));
    let distance = sorted.iter().enumerate().map(gap).fold(0.0, f64::max);
    let bound = |chance: f64| (-libm::log(chance) / (2.0 * n)).sqrt();
    Verdict {
        detects: Some(bound(0.5 * family.per_test()) + bound(1.0 - POWER)),
        ..Verdict::tested(family, distance, (2.0 * one_sided_smirnov(sorted.len(), distance)).min(1.0))
    }
}

/// Do independent `values` follow the distribution function `cdf`? [`ks_uniform_test`] of cdf(value).
///
/// For a continuous distribution; at the jumps of another one the test is cautious. Undefined where `cdf` leaves [0, 1]
/// or a value is NaN.
pub fn ks_test(values: &[f64], cdf: impl Fn(f64) -> f64, family: Family) -> Verdict {
    ks_uniform_test(&values.iter().map(|v| cdf(*v)).collect::<Vec<_>>(), family)
}

/// P(D⁺ ≥ d) of n uniform values: d Σ_{j ≤ n(1−d)} C(n, j) (d + j/n)^(j−1) (1 − d − j/n)^(n−j), for 0 < d ≤ 1.
pub(super) fn one_sided_smirnov(n: usize, d: f64) -> f64 {
    let count = n as f64;
    let log_choose = |j: f64| libm::lgamma(count + 1.0) - libm::lgamma(j + 1.0) - libm::lgamma(count - j + 1.0);
    let term = |j: usize| {
        let j = j as f64;
        let (inside, outside) = (d + j / count, 1.0 - d - j / count);
        if outside <= 0.0 {
            return 0.0;
        }
        libm::exp(log_choose(j) + (j - 1.0) * libm::log(inside) + (count - j) * libm::log(outside))
    };
    d * sum((0..n).map(term))
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{ChiSquared, ContinuousCDF};

    #[test]
    fn the_lower_tail_agrees_with_an_independent_library() {
        for (x, df) in [(0.01, 3.0), (20.0, 63.0), (60.0, 100.0), (800.0, 1000.0), (120.0, 100.0)] {
            let theirs = ChiSquared::new(df).unwrap().cdf(x);
            assert!((chi2_lower_tail(x, df) / theirs - 1.0).abs() < 1e-9, "{x} {df}");
        }
    }

    /// Cohen's table: df 1, α 0.05, power 0.99 needs λ = 18.37; λ = (1.960 + 2.326)² without the far tail.
    #[test]
    fn the_noncentrality_of_one_degree_is_that_of_a_normal_shift() {
        let z = 1.959_963_985 + 2.326_347_874;
        assert!((noncentrality_caught(1.0, 0.05) / (z * z) - 1.0).abs() < 1e-3);
        // Patnaik's approximation at df 20: λ ≈ 40.2 at α = 0.05, power 0.99 (Cohen 1988, table 12.3.1 gives 40.5).
        assert!((noncentrality_caught(20.0, 0.05) / 40.5 - 1.0).abs() < 0.03, "{}", noncentrality_caught(20.0, 0.05));
    }

    /// x + y on the unit square: cell (i, j) of a 4 × 4 grid has (x̄ + ȳ)/16. A pole at the edge is divided eight times;
    /// what is left of it, [0, 2⁻⁹] with mass √2⁻⁹ = 0.044, has the rule's error of 8 %.
    #[test]
    fn masses_of_cells_are_integrals() {
        let masses = cell_masses(|[x, y]| x + y, [0.0; 2], [1.0; 2], [4, 4]);
        for (k, mass) in masses.iter().enumerate() {
            let centre = |i: usize| (i as f64 + 0.5) / 4.0;
            assert!((mass - (centre(k % 4) + centre(k / 4)) / 16.0).abs() < 1e-15);
        }
        let root = cell_masses(|[x, _]| 0.5 / x.sqrt(), [0.0; 2], [1.0; 2], [2, 1]);
        assert!((root[0] - 0.5f64.sqrt()).abs() < 4e-3 && (root[1] - 1.0 + 0.5f64.sqrt()).abs() < 1e-10, "{root:?}");
    }

    /// The draws fill each of 64 cells alike: no independent draws do, and only the lower tail says so.
    #[test]
    fn too_even_is_seen_by_the_lower_tail_alone() {
        let family = Family::one(1e-6);
        let run = |tail| chi2_test_of(&[16; 64], &[16.0; 64], tail, family);
        assert!(run(Tail::Uneven).holds() && !run(Tail::TooEven).holds() && !run(Tail::Both).holds());
        let tilted: Vec<u64> = (0..64).map(|i| if i < 32 { 4 } else { 28 }).collect();
        let run = |tail| chi2_test_of(&tilted, &[16.0; 64], tail, family);
        assert!(!run(Tail::Uneven).holds() && run(Tail::TooEven).holds() && !run(Tail::Both).holds());
    }

    #[test]
    fn a_density_that_is_not_one_over_the_cells_is_not_tested() {
        let verdict = chi2_masses_test(&[50, 50], &[0.6, 0.6], Tail::Uneven, Family::one(0.01));
        assert!(!verdict.holds() && verdict.to_string().contains("does not integrate to 1"), "{verdict}");
    }
}

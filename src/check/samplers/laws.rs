//! Exact means and mean squared errors of a sampler's estimates, from what its randomisation does to pairs of points.
//!
//! The mean of f over a set has the mean square n⁻² Σᵢⱼ E f(Xᵢ) f(Xⱼ): only the joint law of two points matters. Axes are
//! randomised independently, so for products f(x, y) = g(x) h(y) that expectation is one number for each axis. An
//! [`AxisLaw`] gives it for g = x, for the step 1(x < 1/π) and for the boxes of Warnock's formula, for any n, whatever
//! the points: also where no closed form is known. The closed forms of METHODS §5 are special cases (tested below).
//!
//! Nothing here reads the sampler under test: points come from the definitions of the sequences.

use std::f64::consts::FRAC_1_PI;

use crate::sampling::radical::{PRIMES, radical_inverse, radical_inverse_f64};
use crate::sampling::sobol::SobolAxis;
use crate::sampling::strata::factor_pair;
use crate::sampling::{Order, Points, Random, SamplerSpec};
use crate::stats::sum;

/// 2³²: fractions are integers over it.
const SCALE: f64 = 4_294_967_296.0;

/// What one coordinate gives: E X, P(X < 1/π), E (1 − X²)/2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Single {
    /// E X.
    pub x: f64,
    /// P(X < 1/π).
    pub step: f64,
    /// E (1 − X²)/2.
    pub half_box: f64,
}

/// What a pair of coordinates gives: E XX', P(X < 1/π and X' < 1/π), E (1 − max(X, X')).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// E XX'.
    pub x: f64,
    /// P(X < 1/π and X' < 1/π).
    pub step: f64,
    /// E (1 − max(X, X')).
    pub above: f64,
}

/// A uniform coordinate.
const UNIFORM: Single = Single { x: 0.5, step: FRAC_1_PI, half_box: 1.0 / 3.0 };

/// A uniform coordinate with itself.
const ITSELF: Pair = Pair { x: 1.0 / 3.0, step: FRAC_1_PI, above: 0.5 };

/// How one coordinate of a set is distributed over all keys, as far as pairs of its points can tell.
#[derive(Debug, Clone)]
pub enum AxisLaw {
    /// Not random.
    Fixed(Vec<f64>),
    /// Independent uniform numbers, this many.
    Independent(usize),
    /// Uniform and independent within the stratum of each point.
    Strata {
        /// Stratum of each point.
        cell: Vec<u32>,
        /// How many there are.
        cells: u32,
    },
    /// These fractions, all with the same random word, by exclusive or.
    Xor(Vec<u32>),
    /// These fractions, all with the same random number added modulo 1.
    Shift(Vec<u32>),
    /// Nested uniform scramble in base 2 of these fractions.
    Owen(Vec<u32>),
    /// Nested uniform digit permutations in this prime base of the radical inverses of 0 … n−1.
    Digits {
        /// The base.
        base: u32,
        /// n.
        samples: u32,
    },
}

impl AxisLaw {
    /// The law of coordinate `axis` (0 or 1) of a decision whose first dimension is `first`, among `n` points; `one_d` for a
    /// decision with one coordinate. The spec's count has been taken (see [`SamplerSpec::taken`]).
    pub fn of(spec: SamplerSpec, first: u32, axis: u32, n: u32, one_d: bool) -> Self {
        let dimension = axis + if spec.order == Order::Joint { first } else { 0 };
        let indices = 0..n;
        let strata = |cell: fn(u32, u32) -> u32, columns: u32, cells: u32| Self::Strata {
            cell: (0..n).map(|i| cell(i, columns)).collect(),
            cells,
        };
        match (spec.points, axis) {
            _ if one_d && (spec.points == Points::Stratified || spec.sheet_1d) => strata(|i, _| i, n, n),
            (Points::Stratified, _) => {
                let (rows, columns) = factor_pair(n).expect("a count that the sampler takes");
                if axis == 0 { strata(|i, c| i % c, columns, columns) } else { strata(|i, c| i / c, columns, rows) }
            }
            (Points::Uniform, _) => Self::Independent(n as usize),
            (Points::Center, _) => Self::Fixed(vec![0.5; n as usize]),
            (Points::Halton, _) => {
                let base = PRIMES[dimension as usize];
                match spec.random {
                    Random::Digits => Self::Digits { base, samples: n },
                    Random::Shift => Self::Shift(indices.map(|i| radical_inverse(base, i)).collect()),
                    _ => Self::Fixed(indices.map(|i| radical_inverse_f64(base, i)).collect()),
                }
            }
            (Points::Hammersley, 0) => {
                let fixed = || indices.clone().map(|i| f64::from(i) / f64::from(n)).collect::<Vec<_>>();
                match spec.random {
                    Random::None | Random::Yxor => Self::Fixed(fixed()),
                    random => Self::digital(random, fixed().iter().map(|x| (x * SCALE) as u32).collect()),
                }
            }
            (Points::Hammersley, _) => Self::digital(spec.random, indices.map(u32::reverse_bits).collect()),
            (Points::Ld | Points::Sobol, _) => {
                let sobol = SobolAxis::new(dimension).expect("a dimension of a layout");
                Self::digital(spec.random, indices.map(|i| sobol.fraction(i)).collect())
            }
        }
    }

    fn digital(random: Random, fractions: Vec<u32>) -> Self {
        match random {
            Random::Xor | Random::Yxor => Self::Xor(fractions),
            Random::Shift => Self::Shift(fractions),
            Random::Owen => Self::Owen(fractions),
            _ => Self::Fixed(fractions.into_iter().map(|f| f64::from(f) / SCALE).collect()),
        }
    }

    /// How many points it has.
    pub fn n(&self) -> usize {
        match self {
            Self::Fixed(points) => points.len(),
            Self::Independent(n) => *n,
            Self::Strata { cell, .. } => cell.len(),
            Self::Xor(points) | Self::Shift(points) | Self::Owen(points) => points.len(),
            Self::Digits { samples, .. } => *samples as usize,
        }
    }

    /// Expectations of point `i` alone.
    pub fn single(&self, i: usize) -> Single {
        match self {
            Self::Fixed(points) => {
                let x = points[i];
                Single { x, step: f64::from(x < FRAC_1_PI), half_box: 0.5 * (1.0 - x * x) }
            }
            Self::Strata { cell, cells } => {
                let (low, width) = stratum(cell[i], *cells);
                let square = low * low + low * width + width * width / 3.0;
                Single { x: low + 0.5 * width, step: below(low, width), half_box: 0.5 * (1.0 - square) }
            }
            _ => UNIFORM,
        }
    }

    /// Expectations of points `i` and `j`, which may be the same.
    pub fn pair(&self, i: usize, j: usize) -> Pair {
        match self {
            Self::Fixed(points) => {
                let (a, b) = (points[i], points[j]);
                Pair { x: a * b, step: f64::from(a.max(b) < FRAC_1_PI), above: 1.0 - a.max(b) }
            }
            Self::Strata { cell, cells } => strata_pair(stratum(cell[i], *cells), stratum(cell[j], *cells), i == j),
            _ if i == j => ITSELF,
            Self::Independent(_) => Pair { x: 0.25, step: FRAC_1_PI * FRAC_1_PI, above: 1.0 / 3.0 },
            Self::Xor(points) => xor_pair(points[i] ^ points[j]),
            Self::Shift(points) => shift_pair(f64::from(points[i].wrapping_sub(points[j])) / SCALE),
            Self::Owen(points) => match points[i] ^ points[j] {
                0 => ITSELF,
                differ => nested_pair(2, differ.leading_zeros()),
            },
            Self::Digits { base, .. } => nested_pair(*base, shared_digits(*base, i, j)),
        }
    }
}

/// Lower border and width of a stratum.
fn stratum(cell: u32, cells: u32) -> (f64, f64) {
    (f64::from(cell) / f64::from(cells), 1.0 / f64::from(cells))
}

/// Share of `[low, low + width)` below 1/π.
fn below(low: f64, width: f64) -> f64 {
    ((FRAC_1_PI - low) / width).clamp(0.0, 1.0)
}

/// Two independent numbers in strata of one width, or one number twice.
fn strata_pair((a, width): (f64, f64), (b, _): (f64, f64), same: bool) -> Pair {
    let middle = |low: f64| low + 0.5 * width;
    if same {
        let square = a * a + a * width + width * width / 3.0;
        return Pair { x: square, step: below(a, width), above: 1.0 - middle(a) };
    }
    // The larger of two in one stratum lies two thirds up.
    let larger = if a == b { a + width * 2.0 / 3.0 } else { middle(a.max(b)) };
    Pair { x: middle(a) * middle(b), step: below(a, width) * below(b, width), above: 1.0 - larger }
}

/// X uniform and X' = X ⊕ d. Digit k of X' is that of X or its opposite: covariance ±4⁻ᵏ/4. The first digit that
/// differs decides which is larger, and what follows has mean 0: E|X − X'| = 2⁻ᵏ there.
fn xor_pair(differ: u32) -> Pair {
    let covariance: f64 = (1..=32)
        .map(|k| {
            let sign = if differ >> (32 - k) & 1 == 1 { -1.0 } else { 1.0 };
            sign * 0.25 * power(4, k)
        })
        .sum();
    let distance = if differ == 0 { 0.0 } else { power(2, differ.leading_zeros() + 1) };
    Pair { x: 0.25 + covariance, step: xor_step(differ), above: 0.5 - 0.5 * distance }
}

/// P(X < s and X ⊕ d < s), s = 1/π, digit by digit: each of the two numbers is still equal to s or already below it.
fn xor_step(differ: u32) -> f64 {
    let s = (FRAC_1_PI * SCALE) as u32;
    // Probabilities of (equal, equal), (equal, below), (below, equal), (below, below).
    let mut states = [1.0, 0.0, 0.0, 0.0];
    for k in (0..32).rev() {
        let (limit, flip) = (s >> k & 1, differ >> k & 1);
        let mut next = [0.0; 4];
        for (state, p) in states.into_iter().enumerate() {
            for digit in [0, 1] {
                // `None` once a number is above s.
                let after = |is_below: bool, digit: u32| match is_below || digit < limit {
                    true => Some(true),
                    false => (digit == limit).then_some(false),
                };
                if let (Some(a), Some(b)) = (after(state & 2 != 0, digit), after(state & 1 != 0, digit ^ flip)) {
                    next[usize::from(a) * 2 + usize::from(b)] += 0.5 * p;
                }
            }
        }
        states = next;
    }
    // Digits beyond the 32nd are those of one number in both.
    let rest = (FRAC_1_PI * SCALE).fract();
    states[3] + rest * (states[0] + states[1] + states[2])
}

/// X uniform and X' = X + δ mod 1: covariance B₂(δ)/2 = (δ² − δ + 1/6)/2; two arcs of length s overlap in
/// (s − δ)⁺ + (s + δ − 1)⁺; E|X − X'| = 2δ(1 − δ).
fn shift_pair(delta: f64) -> Pair {
    let s = FRAC_1_PI;
    Pair {
        x: 0.25 + 0.5 * (delta * delta - delta + 1.0 / 6.0),
        step: (s - delta).max(0.0) + (s + delta - 1.0).max(0.0),
        above: 0.5 - delta * (1.0 - delta),
    }
}

/// b⁻ᵏ.
fn power(base: u32, k: u32) -> f64 {
    libm::pow(f64::from(base), -f64::from(k))
}

/// Two points under a nested uniform scramble in base b that share exactly k digits: they lie in two different children,
/// drawn at random, of one random cell of width b⁻ᵏ, and are independent within.
///
/// Covariance: the shared digits give (b² − 1)/12 · b⁻²ʲ each, two different digits in one place −(b² − 1)/12/(b − 1).
/// E|X − X'| = b⁻ᵏ⁻¹ (b + 1)/3. The step is mixed in one cell of each width only.
fn nested_pair(base: u32, shared: u32) -> Pair {
    let b = f64::from(base);
    let tail = power(base, 2 * shared);
    let covariance = (1.0 - tail - (b + 1.0) * tail / (b * b)) / 12.0;
    let distance = power(base, shared + 1) * (b + 1.0) / 3.0;
    let width = power(base, shared);
    let cell = (FRAC_1_PI / width).floor();
    // Of the one cell that 1/π divides: means of the step over its children.
    let children: Vec<f64> = (0..base).map(|c| below((cell + f64::from(c) / b) * width, width / b)).collect();
    let (total, squares) = children.iter().fold((0.0, 0.0), |(s, q), m| (s + m, q + m * m));
    let mixed = (total * total - squares) / (b * (b - 1.0));
    Pair { x: 0.25 + covariance, step: width * (cell + mixed), above: 0.5 - 0.5 * distance }
}

/// Digits in `base` that the radical inverses of i ≠ j share: how often `base` divides their difference.
pub fn shared_digits(base: u32, i: usize, j: usize) -> u32 {
    let (mut rest, base) = (i.abs_diff(j), base as usize);
    assert!(rest > 0, "a point shares all its digits with itself");
    let mut count = 0;
    while rest.is_multiple_of(base) {
        rest /= base;
        count += 1;
    }
    count
}

/// What is known of the mean of f over a set: E (mean − ∫f) and E (mean − ∫f)².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Error {
    /// Expected error: 0 for an unbiased set.
    pub bias: f64,
    /// Expected squared error: the variance of an unbiased set.
    pub mean_square: f64,
}

impl Error {
    /// Of an unbiased set.
    pub fn unbiased(variance: f64) -> Self {
        Self { bias: 0.0, mean_square: variance }
    }
}

/// Exact errors of one set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetErrors {
    /// f = x.
    pub x: Error,
    /// f = y.
    pub y: Error,
    /// f = xy.
    pub product: Error,
    /// f = 1(x < 1/π).
    pub step: Error,
    /// E(L2*²).
    pub l2_star: f64,
}

/// Errors of f = x and of the step for one coordinate.
pub fn axis_errors(law: &AxisLaw) -> [Error; 2] {
    let n = law.n();
    let singles: Vec<Single> = (0..n).map(|i| law.single(i)).collect();
    let pairs: Vec<Pair> = (0..n * n).map(|at| law.pair(at / n, at % n)).collect();
    [
        error(n, 0.5, sum(singles.iter().map(|s| s.x)), sum(pairs.iter().map(|p| p.x))),
        error(n, FRAC_1_PI, sum(singles.iter().map(|s| s.step)), sum(pairs.iter().map(|p| p.step))),
    ]
}

fn error(n: usize, integral: f64, first: f64, second: f64) -> Error {
    let n = n as f64;
    let bias = first / n - integral;
    Error { bias, mean_square: second / (n * n) - integral * integral - 2.0 * integral * bias }
}

/// Errors of a set whose axes are independent; O(n²).
pub fn set_errors(x: &AxisLaw, y: &AxisLaw) -> SetErrors {
    let n = x.n();
    let ([of_x, step], [of_y, _]) = (axis_errors(x), axis_errors(y));
    let singles: Vec<[Single; 2]> = (0..n).map(|i| [x.single(i), y.single(i)]).collect();
    let pairs: Vec<[Pair; 2]> = (0..n * n).map(|at| [x, y].map(|law| law.pair(at / n, at % n))).collect();
    let count = n as f64;
    let boxes = sum(singles.iter().map(|[a, b]| a.half_box * b.half_box)) / count;
    let box_pairs = sum(pairs.iter().map(|[a, b]| a.above * b.above)) / (count * count);
    let l2_star = 1.0 / 9.0 - 2.0 * boxes + box_pairs;
    let (first, second) = (sum(singles.iter().map(|[a, b]| a.x * b.x)), sum(pairs.iter().map(|[a, b]| a.x * b.x)));
    SetErrors { x: of_x, y: of_y, product: error(n, 0.25, first, second), step, l2_star }
}

/// Variance of the mean of 1(y > x) over an Owen-scrambled (0,m,2)-net in base 2, n = 2ᵐ.
///
/// Two-axis Haar levels (k₁, k₂) of this function: σ² = 2^(k₁ − 2k₂)/16 for k₁ < k₂ (a wavelet in y meets the slope of the
/// integrated one in x), the same mirrored, 0 for k₁ = k₂; one axis: 4⁻ᵏ/16. They add up to ¼. Gain coefficients of the
/// net: 0 for k₁ + k₂ ≤ m − 2, 2 for m − 1, 1 above; one axis: 0 below m, 1 from m (METHODS §5).
pub fn owen_diagonal(m: u32) -> f64 {
    // Σ over k₁ + k₂ = s.
    let level =
        |s: u32| (0..s.div_ceil(2)).map(|k| libm::exp2(3.0 * f64::from(k) - 2.0 * f64::from(s)) / 8.0).sum::<f64>();
    // Levels fall at least as √2⁻ˢ: 200 of them leave nothing.
    let above: f64 = (m.max(1) - 1..m + 200).rev().map(level).sum();
    let at_once = if m == 0 { 0.0 } else { level(m - 1) };
    let one_axis = 2.0 * power(4, m) / 12.0;
    (one_axis + above + at_once) * power(2, m)
}

/// Points in steps of 1/n, what a shift by so many steps makes of one, and whether the axis is shifted at all.
type OnGrid = (Vec<u32>, fn(u32, u32) -> u32, bool);

/// An axis that is fixed or shifted, in steps of 1/n; `None` where it has another law or a point is off the grid.
fn on_grid(law: &AxisLaw, n: u32) -> Option<OnGrid> {
    let fractions = |points: &[u32]| points.iter().map(|&f| f64::from(f) / SCALE).collect();
    let points: Vec<f64> = match law {
        AxisLaw::Fixed(points) => points.clone(),
        AxisLaw::Xor(points) | AxisLaw::Shift(points) => fractions(points),
        _ => return None,
    };
    let shifted: fn(u32, u32) -> u32 = match law {
        AxisLaw::Xor(_) => |p, w| p ^ w,
        AxisLaw::Shift(_) => u32::wrapping_add,
        _ => |p, _| p,
    };
    let moves = !matches!(law, AxisLaw::Fixed(_));
    let steps: Vec<f64> = points.iter().map(|p| p * f64::from(n)).collect();
    steps.iter().all(|p| p.fract() == 0.0).then(|| (steps.iter().map(|&p| p as u32).collect(), shifted, moves))
}

/// Error of the mean of 1(y > x) over n = 2ᵐ points whose coordinates are multiples of 1/n, each axis fixed, digitally or
/// toroidally shifted: all n² shifts of the top m digits. The digits below are the same in all points of an axis: two
/// numbers that tie in the top digits are told apart by them, all ties alike, either way equally often; a fixed axis has
/// none and is the smaller. `None` where an axis has another law, or for points off the grid.
///
/// Two digital shifts of a digital net, which its own points map to itself, need only be told apart in y: O(n²), else O(n³).
pub fn grid_diagonal(x: &AxisLaw, y: &AxisLaw) -> Option<Error> {
    let n = x.n() as u32;
    let m = n.is_power_of_two().then(|| n.trailing_zeros())?;
    let ((xs, of_x, x_moves), (ys, of_y, y_moves)) = (on_grid(x, n)?, on_grid(y, n)?);
    let is_group = |p: &[u32]| (0..m).all(|b| (0..n as usize).all(|i| p[i ^ 1 << b] == p[i] ^ p[1 << b]));
    let cosets = matches!((x, y), (AxisLaw::Xor(_), AxisLaw::Xor(_))) && is_group(&xs) && is_group(&ys);
    let (mut errors, mut squares, mut weight) = (0.0, 0.0, 0.0);
    for u in 0..if x_moves && !cosets { n } else { 1 } {
        for v in 0..if y_moves { n } else { 1 } {
            let pairs = xs.iter().zip(&ys).map(|(&x, &y)| (of_x(x, u) & (n - 1), of_y(y, v) & (n - 1)));
            let (above, ties) =
                pairs.fold((0u32, 0u32), |(a, t), (x, y)| (a + u32::from(y > x), t + u32::from(y == x)));
            let shares: &[(u32, f64)] = match (x_moves, y_moves) {
                (true, true) => &[(0, 0.5), (1, 0.5)],
                (false, true) => &[(1, 1.0)],
                _ => &[(0, 1.0)],
            };
            for &(counted, share) in shares {
                let e = f64::from(above + counted * ties) * power(2, m) - 0.5;
                errors += share * e;
                squares += share * e * e;
                weight += share;
            }
        }
    }
    Some(Error { bias: errors / weight, mean_square: squares / weight })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Preset;

    fn laws(text: &str, n: u32) -> [AxisLaw; 2] {
        let spec = SamplerSpec::parse(text, Preset::Best).unwrap();
        [0, 1].map(|axis| AxisLaw::of(spec, 0, axis, n, false))
    }

    fn errors(text: &str, n: u32) -> SetErrors {
        let [x, y] = laws(text, n);
        set_errors(&x, &y)
    }

    /// Every closed form of METHODS §5 that is about a set.
    #[test]
    fn pairs_give_every_closed_form() {
        for m in [0, 2, 4, 6] {
            let n = f64::from(1 << m);
            let k = n.sqrt();
            let frac = |v: f64| (v * FRAC_1_PI).fract();
            let step = |v: f64| frac(v) * (1.0 - frac(v));
            let m_f = f64::from(m);
            let (x3, xy) = (1.0 / 12.0 / n.powi(3), 7.0 * (4.0 + 3.0 * m_f) / 576.0 / n.powi(3));
            let owen_l2 = (5.0 / 36.0 + m_f / 24.0) / (n * n);
            let near = |what: &str, found: f64, exact: f64| {
                // n² terms below 1 cancel, each rounded.
                assert!((found - exact).abs() < 8.0 * f64::EPSILON, "{what}, n = {n}: {found:e}, {exact:e}");
            };
            for name in ["ld:step:owen", "sobol:joint:owen"] {
                let e = errors(name, 1 << m);
                near(name, e.x.mean_square, x3);
                near(name, e.y.mean_square, x3);
                near(name, e.product.mean_square, xy);
                near(name, e.step.mean_square, step(n) / (n * n));
                near(name, e.l2_star, owen_l2);
            }
            for name in ["ld:step:xor", "hammersley:step:xor", "hammersley:step:shift", "ld:step:shift"] {
                let e = errors(name, 1 << m);
                near(name, e.x.mean_square, 1.0 / 12.0 / (n * n));
                near(name, e.step.mean_square, step(n) / (n * n));
            }
            let e = errors("uniform", 1 << m);
            near("uniform", e.x.mean_square, 1.0 / 12.0 / n);
            near("uniform", e.product.mean_square, 7.0 / 144.0 / n);
            near("uniform", e.step.mean_square, FRAC_1_PI * (1.0 - FRAC_1_PI) / n);
            near("uniform", e.l2_star, 5.0 / 36.0 / n);
            let e = errors("stratified", 1 << m);
            near("stratified", e.x.mean_square, 1.0 / 12.0 / (n * n));
            near("stratified", e.product.mean_square, (1.0 / 18.0 - 1.0 / 144.0 / n) / (n * n));
            near("stratified", e.step.mean_square, step(k) / n.powf(1.5));
            near("stratified", e.l2_star, ((k - 1.0) / 6.0 + 5.0 / 36.0) / (n * n));
        }
    }

    #[test]
    fn nested_digits_in_base_3_are_one_uniform_point_in_each_of_n_strata() {
        for n in [3u32, 27, 81] {
            let law = AxisLaw::Digits { base: 3, samples: n };
            let [x, step] = axis_errors(&law);
            let (count, p) = (f64::from(n), (f64::from(n) * FRAC_1_PI).fract());
            assert!((x.mean_square - 1.0 / 12.0 / count.powi(3)).abs() < 8.0 * f64::EPSILON, "n = {n}");
            assert!((step.mean_square - p * (1.0 - p) / count.powi(2)).abs() < 8.0 * f64::EPSILON, "n = {n}");
        }
    }

    /// The oracle of the diagonal: pairs that share k₁ digits in x and k₂ in y lie in different quarters of one box.
    #[test]
    fn the_diagonal_of_an_owen_net_has_the_variance_of_its_pairs() {
        // Area above the diagonal in [0, x) × [0, y).
        let area = |x: f64, y: f64| if y <= x { 0.5 * y * y } else { x * y - 0.5 * x * x };
        let mean = |kx: u32, ky: u32, i: u32, j: u32| {
            let (w, h) = (power(2, kx), power(2, ky));
            let [a, b, c, d] = [f64::from(i) * w, f64::from(i + 1) * w, f64::from(j) * h, f64::from(j + 1) * h];
            (area(b, d) - area(a, d) - area(b, c) + area(a, c)) / (w * h)
        };
        let joint = |kx: u32, ky: u32| {
            let mut total = 0.0;
            for (i, j) in (0..1 << kx).flat_map(|i| (0..1 << ky).map(move |j| (i, j))) {
                for (c, d) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    let at = |c: u32, d: u32| mean(kx + 1, ky + 1, 2 * i + c, 2 * j + d);
                    total += 0.25 * at(c, d) * at(1 - c, 1 - d);
                }
            }
            total / f64::from(1 << (kx + ky))
        };
        for m in [0u32, 1, 2, 3, 4] {
            let n = 1usize << m;
            let [AxisLaw::Owen(x), AxisLaw::Owen(y)] = laws("ld:step:owen", 1 << m) else { panic!("a scramble") };
            let mut sum = 0.5 * n as f64;
            for i in 0..n {
                for j in (0..n).filter(|&j| j != i) {
                    sum += joint((x[i] ^ x[j]).leading_zeros(), (y[i] ^ y[j]).leading_zeros());
                }
            }
            let pairs = sum / (n * n) as f64 - 0.25;
            assert!((pairs - owen_diagonal(m)).abs() < 1e-14, "m = {m}: {pairs} {}", owen_diagonal(m));
        }
    }

    #[test]
    fn the_step_of_two_shifted_numbers_is_a_probability_of_its_margins() {
        for differ in [0, 1, 1 << 31, 0x5555_5555, u32::MAX] {
            let p = xor_step(differ);
            assert!((0.0..=FRAC_1_PI + 1e-9).contains(&p), "{differ:x}: {p}");
        }
        assert!((xor_step(0) - FRAC_1_PI).abs() < 1e-9);
        // The other half of [0, 1): never both below 1/π < ½.
        assert_eq!(xor_step(1 << 31), 0.0);
    }
}

//! Distribution functions to about 14 digits, on crate `libm` alone so that they have the same bits everywhere.
//!
//! Beta and gamma integrals share one idea (Loader 2000, "Fast and accurate computation of binomial probabilities"):
//! the density in front of the continued fraction is written with Stirling errors and deviances, never as a
//! difference of large log-gammas, which would lose digits at thousands of degrees of freedom.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// A continued fraction or series stops when a further term changes nothing that f64 can show.
const CONVERGED: f64 = 1e-16;
/// Terms grow like the square root of the parameters; this covers parameters up to about 10¹¹.
const MAX_TERMS: u32 = 1_000_000;

/// Stirling's error δ(z): ln Γ(z) = (z − ½) ln z − z + ½ ln 2π + δ(z), for z > 0.
///
/// Asymptotic series from z = 12 up (the first term left out is below 1e-17 there), reached by the exact
/// step δ(z) = δ(z+1) + (z + ½) ln(1 + 1/z) − 1.
fn stirling_error(z: f64) -> f64 {
    const SERIES: [f64; 7] =
        [1.0 / 12.0, -1.0 / 360.0, 1.0 / 1260.0, -1.0 / 1680.0, 1.0 / 1188.0, -691.0 / 360_360.0, 1.0 / 156.0];
    let mut z = z;
    let mut steps = 0.0;
    while z < 12.0 {
        steps += (z + 0.5) * libm::log1p(1.0 / z) - 1.0;
        z += 1.0;
    }
    let inverse_square = 1.0 / (z * z);
    steps + SERIES.iter().rev().fold(0.0, |tail, c| tail * inverse_square + c) / z
}

/// ln(1 + u) − u without cancellation near u = 0, for u > −1.
fn log1p_minus(u: f64) -> f64 {
    if u.abs() > 0.1 {
        return libm::log1p(u) - u;
    }
    // With r = u / (2 + u): ln(1 + u) = 2 (r + r³/3 + r⁵/5 + …) and 2r − u = −u r.
    let r = u / (2.0 + u);
    let r2 = r * r;
    let tail = (1..=12).rev().fold(0.0, |tail, k| (tail + 1.0 / f64::from(2 * k + 1)) * r2);
    2.0 * r * tail - u * r
}

/// a · (ln(1 + u) − u) with 1 + u given as well, so that u near −1 keeps its digits.
fn deviance(a: f64, u: f64, one_plus_u: f64) -> f64 {
    if u < -0.5 { a * (libm::log(one_plus_u) - u) } else { a * log1p_minus(u) }
}

/// x^a y^b / B(a, b) with y = 1 − x, both given in full precision.
fn beta_density_factor(a: f64, b: f64, x: f64, y: f64) -> f64 {
    let n = a + b;
    let e = b * x - a * y;
    let exponent = deviance(a, e / a, n * (x / a)) + deviance(b, -e / b, n * (y / b)) + stirling_error(n)
        - stirling_error(a)
        - stirling_error(b);
    (a / n * b / TAU).sqrt() * libm::exp(exponent)
}

/// Regularised incomplete beta I_x(a, b) for a, b > 0 and x, y ≥ 0 with x + y = 1.
///
/// Taking y as well as x keeps tails exact where 1 − x would round. Lentz's continued fraction
/// (DLMF 8.17.22) on the side where it converges quickly.
pub(super) fn incomplete_beta(a: f64, b: f64, x: f64, y: f64) -> f64 {
    if x <= 0.0 {
        0.0
    } else if y <= 0.0 {
        1.0
    } else if x * (a + b + 2.0) < a + 1.0 {
        beta_density_factor(a, b, x, y) / a * beta_fraction(a, b, x)
    } else {
        1.0 - beta_density_factor(b, a, y, x) / b * beta_fraction(b, a, y)
    }
}

/// The continued fraction 1/(1 + d₁/(1 + d₂/(1 + …))) of DLMF 8.17.22.
fn beta_fraction(a: f64, b: f64, x: f64) -> f64 {
    let away_from_zero = |v: f64| if v.abs() < f64::MIN_POSITIVE { f64::MIN_POSITIVE } else { v };
    let mut c = 1.0;
    let mut d = 1.0 / away_from_zero(1.0 - (a + b) * x / (a + 1.0));
    let mut value = d;
    for m in 1..MAX_TERMS {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let mut change = 1.0;
        for term in [even, odd] {
            d = 1.0 / away_from_zero(1.0 + term * d);
            c = away_from_zero(1.0 + term / c);
            change = d * c;
            value *= change;
        }
        if (change - 1.0).abs() <= CONVERGED {
            break;
        }
    }
    value
}

/// Regularised upper incomplete gamma Q(a, x) = Γ(a, x)/Γ(a) for a > 0, x ≥ 0.
///
/// Series of the lower integral below x = a + 1 (DLMF 8.11.4), continued fraction of the upper one above (8.9.2).
pub(super) fn incomplete_gamma_upper(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    if x == f64::INFINITY {
        return 0.0;
    }
    let factor = (a / TAU).sqrt() * libm::exp(deviance(a, (x - a) / a, x / a) - stirling_error(a));
    if x < a + 1.0 {
        let mut term = 1.0 / a;
        let mut series = term;
        for k in 1..MAX_TERMS {
            term *= x / (a + f64::from(k));
            series += term;
            if term <= series * CONVERGED {
                break;
            }
        }
        1.0 - factor * series
    } else {
        factor * gamma_fraction(a, x)
    }
}

/// The continued fraction 1/(x + 1 − a − 1(1−a)/(x + 3 − a − 2(2−a)/(x + 5 − a − …))).
fn gamma_fraction(a: f64, x: f64) -> f64 {
    let mut b = x + 1.0 - a;
    let mut c = f64::MAX;
    let mut d = 1.0 / b;
    let mut value = d;
    for i in 1..MAX_TERMS {
        let i = f64::from(i);
        let numerator = -i * (i - a);
        b += 2.0;
        d = 1.0 / (numerator * d + b);
        c = b + numerator / c;
        let change = c * d;
        value *= change;
        if (change - 1.0).abs() <= CONVERGED {
            break;
        }
    }
    value
}

/// P(Z > z) of the standard normal.
pub(super) fn normal_upper_tail(z: f64) -> f64 {
    0.5 * libm::erfc(z * FRAC_1_SQRT_2)
}

/// P(|T| > |t|) of Student's t with `df` > 0 degrees of freedom (not necessarily whole); `df` = ∞ is the normal.
pub(super) fn student_two_sided(t: f64, df: f64) -> f64 {
    if df == f64::INFINITY {
        return libm::erfc(t.abs() * FRAC_1_SQRT_2);
    }
    // In this form neither quotient overflows, nor does a small one round to nothing beside 1.
    let ratio = t * (t / df);
    let x = if ratio.is_finite() { 1.0 / (1.0 + ratio) } else { 0.0 };
    let y = if ratio.is_finite() { ratio / (1.0 + ratio) } else { 1.0 };
    incomplete_beta(0.5 * df, 0.5, x, y)
}

/// The x in [low, high] at which a falling function crosses `level`, by bisection down to neighbouring floats.
///
/// Slower than Newton, but it needs no derivative and cannot run away; the answer does not depend on a start value.
pub(super) fn solve_falling(f: impl Fn(f64) -> f64, level: f64, low: f64, high: f64) -> f64 {
    let (mut low, mut high) = (low, high);
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if f(middle) > level {
            low = middle;
        } else {
            high = middle;
        }
    }
}

/// The z > 0 with P(|Z| > z) = `p`, or the t with P(|T| > t) = `p` at `df` degrees of freedom; 0 < p < 1.
pub(super) fn student_two_sided_inverse(p: f64, df: f64) -> f64 {
    let tail = |t: f64| student_two_sided(t, df);
    let mut high = 1.0;
    while tail(high) > p && high < f64::MAX / 4.0 {
        high *= 2.0;
    }
    solve_falling(tail, p, if high > 1.0 { 0.5 * high } else { 0.0 }, high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{Beta, ChiSquared, ContinuousCDF, StudentsT};

    /// Equal to `relative`, and to the rounding of the exponent where a tail is e^−large: 4 ε |ln truth|.
    fn assert_close(ours: f64, truth: f64, relative: f64, what: &str) {
        let allowed = relative + 4.0 * f64::EPSILON * libm::log(truth).abs();
        assert!((ours - truth).abs() <= allowed * truth.abs(), "{what}: {ours:e} against {truth:e}");
    }

    /// Closed forms: df 1: 2/π·atan(1/t); df 2: 1 − t/√(2+t²), rearranged so that nothing cancels.
    #[test]
    fn student_tails_meet_their_closed_forms() {
        for t in [1e-8, 0.1, 0.9, 1.0, 3.0, 50.0, 1e6, 1e150] {
            assert_close(student_two_sided(t, 1.0), libm::atan(1.0 / t) / std::f64::consts::FRAC_PI_2, 2e-14, "df 1");
            let root = libm::hypot(std::f64::consts::SQRT_2, t);
            let two = 2.0 / root / (root + t);
            assert_close(student_two_sided(t, 2.0), two, 2e-14, "df 2");
        }
    }

    /// Q(1, x) = e^−x, Q(2, x) = (1 + x) e^−x, Q(½, x) = erfc(√x).
    #[test]
    fn gamma_tails_meet_their_closed_forms() {
        for x in [1e-6, 0.3, 1.0, 1.9, 2.1, 10.0, 100.0, 600.0] {
            assert_close(incomplete_gamma_upper(1.0, x), libm::exp(-x), 2e-14, "a 1");
            assert_close(incomplete_gamma_upper(2.0, x), (1.0 + x) * libm::exp(-x), 2e-14, "a 2");
            assert_close(incomplete_gamma_upper(0.5, x), libm::erfc(x.sqrt()), 2e-14, "a 1/2");
        }
    }

    /// I_x(a, b) for whole a, b is a binomial tail: summed directly with exact binomials as the slow twin.
    #[test]
    fn beta_integrals_are_binomial_tails() {
        for (a, b) in [(1_u32, 1_u32), (2, 5), (9, 3), (20, 31)] {
            for x in [0.01, 0.2, 0.5, 0.77, 0.999] {
                let n = a + b - 1;
                let mut choose = 1.0;
                let mut tail = 0.0;
                for k in 0..=n {
                    if k >= a {
                        tail += choose * libm::pow(x, f64::from(k)) * libm::pow(1.0 - x, f64::from(n - k));
                    }
                    choose *= f64::from(n - k) / f64::from(k + 1);
                }
                assert_close(incomplete_beta(f64::from(a), f64::from(b), x, 1.0 - x), tail, 1e-13, "binomial");
            }
        }
    }

    /// An independent library (statrs, itself good to about 1e-11) over a wide range of parameters.
    #[test]
    fn tails_agree_with_an_independent_library() {
        for df in [0.7, 3.0, 16.8, 250.0, 4000.0] {
            for t in [0.01, 0.8, 2.5, 6.0] {
                let theirs = 2.0 * StudentsT::new(0.0, 1.0, df).expect("valid").sf(t);
                assert_close(student_two_sided(t, df), theirs, 1e-9, "Student");
            }
            for x in [0.5 * df, df, 1.3 * df] {
                assert_close(
                    incomplete_gamma_upper(0.5 * df, 0.5 * x),
                    ChiSquared::new(df).expect("valid").sf(x),
                    1e-9,
                    "χ²",
                );
            }
            let theirs = Beta::new(df, 2.5).expect("valid").cdf(0.6);
            assert!((incomplete_beta(df, 2.5, 0.6, 0.4) - theirs).abs() <= 1e-9 * theirs + 1e-300, "beta");
        }
    }

    #[test]
    fn many_degrees_of_freedom_approach_the_normal() {
        // The gap is t (t² + 1) φ(t) / (2 df), about 3e-9 at t = 2 and a tenth of that at t = 5.
        for t in [0.5, 2.0, 5.0] {
            assert!((student_two_sided(t, 1e8) - student_two_sided(t, f64::INFINITY)).abs() < 5e-9);
        }
        assert_close(normal_upper_tail(1.959_963_984_540_054), 0.025, 1e-14, "normal");
    }

    #[test]
    fn the_inverse_undoes_the_tail() {
        for df in [1.0, 2.0, 9.5, 1000.0, f64::INFINITY] {
            for p in [1e-12, 1e-6, 0.05, 0.5, 0.999] {
                assert_close(student_two_sided(student_two_sided_inverse(p, df), df), p, 1e-13, "round trip");
            }
        }
    }
}

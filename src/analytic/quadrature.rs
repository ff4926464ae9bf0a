//! Adaptive quadrature with an error estimate, for truths that have no closed form of their own.
//!
//! The rule is Gauss–Kronrod (G7, K15): fifteen points, of which seven make a Gauss rule of degree 13; the Kronrod
//! rule has degree 22 (Kronrod 1965; nodes as in QUADPACK's QK15, Piessens et al. 1983). |K15 − G7| is taken as the
//! error of K15, which overstates it where the integrand is smooth. The worst panel is halved until the sum of all
//! errors is small enough, so that kinks cost panels only where they lie; a kink at a *known* place should be
//! handed over as a break, and then costs nothing. A peak too narrow for any of a panel's points is overlooked without a
//! sign: whoever knows of one hands over breaks that close in on it.

use crate::error::{Error, Result};

/// Positive nodes of K15 on [−1, 1], outermost first; every second one, from index 1, belongs to G7 too.
const NODES: [f64; 7] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
];
/// Weights of K15 at `NODES`, then at 0.
const KRONROD: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_55,
    0.104_790_010_322_250_19,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_82,
];
/// Weights of G7 at `NODES[1]`, `NODES[3]`, `NODES[5]`, then at 0.
const GAUSS: [f64; 4] =
    [0.129_484_966_168_869_7, 0.279_705_391_489_276_64, 0.381_830_050_505_118_9, 0.417_959_183_673_469_4];

/// A panel is halved at most this many times: its width is then 2⁻⁴⁸ of the first one's.
pub const MAX_DEPTH: u32 = 48;
/// A one-dimensional integral keeps at most this many panels (15 evaluations each, 30 a halving).
pub const MAX_PANELS: usize = 4096;

/// Stop when the error estimate is at most `max(absolute, relative · |value|)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Largest error in the integral's own unit; 0 for none.
    pub absolute: f64,
    /// Largest error as a share of the integral; 0 for none. Meant for integrands of one sign.
    pub relative: f64,
}

impl Tolerance {
    /// An absolute tolerance alone.
    pub fn absolute(absolute: f64) -> Self {
        Self { absolute, relative: 0.0 }
    }

    /// A relative tolerance alone.
    pub fn relative(relative: f64) -> Self {
        Self { absolute: 0.0, relative }
    }

    fn allows(&self, error: f64, value: f64) -> bool {
        error <= self.absolute.max(self.relative * value.abs())
    }

    /// What inner integrals over an outer interval of width `width` may be wrong by: a quarter in total.
    fn for_inner(&self, width: f64) -> Self {
        Self { absolute: self.absolute / (4.0 * width), relative: self.relative / 4.0 }
    }
}

/// An integral, a bound on its error, and what it cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The integral.
    pub value: f64,
    /// Estimated absolute error: Σ |K15 − G7| over the panels, plus what inner integrals reported.
    pub error: f64,
    /// Evaluations of the integrand.
    pub evaluations: usize,
}

/// ∫ f over `[interval[0], interval[1]]`.
///
/// `breaks` are places where f or a derivative jumps, in any order; those outside the open interval are ignored.
/// Errors: an interval that is reversed or not finite, a value of f that is not finite, a tolerance not reached
/// within [`MAX_DEPTH`] and [`MAX_PANELS`].
pub fn integrate(
    mut f: impl FnMut(f64) -> f64,
    interval: [f64; 2],
    breaks: &[f64],
    tolerance: Tolerance,
) -> Result<Estimate> {
    adapt(|x| Ok(Estimate { value: f(x), error: 0.0, evaluations: 1 }), interval, breaks, tolerance)
}

/// ∫∫ f(x, y) dy dx over `x[0]..x[1]` × `y[0]..y[1]`, as adaptive integrals over y within one over x.
///
/// `breaks_x` are the x where ∫ f dy is not smooth; `breaks_y` appends to its buffer the y where f is not smooth at
/// a given x. For f that is smooth but for kinks along straight lines, the former are the x at which these lines
/// meet each other or the rectangle's y borders. Unknown kinks may be left out, at the price of halvings in both
/// axes. Errors as for [`integrate`].
pub fn integrate_rectangle(
    mut f: impl FnMut(f64, f64) -> f64,
    x: [f64; 2],
    y: [f64; 2],
    breaks_x: &[f64],
    mut breaks_y: impl FnMut(f64, &mut Vec<f64>),
    tolerance: Tolerance,
) -> Result<Estimate> {
    let inner = tolerance.for_inner(x[1] - x[0]);
    let mut breaks = Vec::new();
    let column = |at: f64| {
        breaks.clear();
        breaks_y(at, &mut breaks);
        integrate(|v| f(at, v), y, &breaks, inner)
    };
    adapt(column, x, breaks_x, tolerance)
}

/// One interval and what the rule says about it.
struct Panel {
    from: f64,
    to: f64,
    depth: u32,
    value: f64,
    /// |K15 − G7|.
    error: f64,
    /// Error of the integrand's own values, integrated; halving the panel does not lower it.
    inherited: f64,
    /// ∫ |f|, which sets the level of rounding.
    magnitude: f64,
}

impl Panel {
    /// Below some tens of rounding errors |K15 − G7| is noise, and halving would chase it for ever.
    fn worth_halving(&self) -> bool {
        self.depth < MAX_DEPTH && self.error > 64.0 * f64::EPSILON * self.magnitude
    }
}

/// The engine of both integrals: an integrand that reports its own error and cost, or fails.
fn adapt(
    mut f: impl FnMut(f64) -> Result<Estimate>,
    [from, to]: [f64; 2],
    breaks: &[f64],
    tolerance: Tolerance,
) -> Result<Estimate> {
    if !(from.is_finite() && to.is_finite() && from <= to) {
        return Err(Error::input("quadrature", format!("expected a finite interval, found {from} to {to}")));
    }
    let mut evaluations = 0;
    let mut panels = Vec::new();
    let mut edges: Vec<f64> = breaks.iter().copied().filter(|b| from < *b && *b < to).collect();
    edges.sort_by(f64::total_cmp);
    edges.push(to);
    let mut left = from;
    for right in edges {
        if left < right {
            panels.push(measure(&mut f, left, right, 0, &mut evaluations)?);
        }
        left = right;
    }
    loop {
        let value = panels.iter().map(|p| p.value).sum();
        let error = panels.iter().map(|p| p.error + p.inherited).sum();
        if tolerance.allows(error, value) {
            return Ok(Estimate { value, error, evaluations });
        }
        let worst = (0..panels.len())
            .filter(|&i| panels[i].worth_halving())
            .max_by(|&i, &j| panels[i].error.total_cmp(&panels[j].error));
        let Some(worst) = worst.filter(|_| panels.len() < MAX_PANELS) else {
            let what =
                format!("expected an error within {tolerance:?}, found {error:e} after {evaluations} evaluations");
            return Err(Error::incomplete("quadrature", what));
        };
        let Panel { from, to, depth, .. } = panels.swap_remove(worst);
        let middle = 0.5 * (from + to);
        panels.push(measure(&mut f, from, middle, depth + 1, &mut evaluations)?);
        panels.push(measure(&mut f, middle, to, depth + 1, &mut evaluations)?);
    }
}

/// Both rules on one interval.
fn measure(
    f: &mut impl FnMut(f64) -> Result<Estimate>,
    from: f64,
    to: f64,
    depth: u32,
    evaluations: &mut usize,
) -> Result<Panel> {
    let (centre, half) = (0.5 * (from + to), 0.5 * (to - from));
    let mut at = |x: f64| -> Result<Estimate> {
        let estimate = f(x)?;
        *evaluations += estimate.evaluations;
        if estimate.value.is_finite() {
            Ok(estimate)
        } else {
            Err(Error::incomplete("quadrature", format!("expected a finite value at {x}, found {}", estimate.value)))
        }
    };
    let middle = at(centre)?;
    let mut kronrod = KRONROD[7] * middle.value;
    let mut gauss = GAUSS[3] * middle.value;
    let mut inherited = KRONROD[7] * middle.error;
    let mut magnitude = KRONROD[7] * middle.value.abs();
    for (i, (&node, &weight)) in NODES.iter().zip(&KRONROD).enumerate() {
        let (low, high) = (at(centre - half * node)?, at(centre + half * node)?);
        kronrod += weight * (low.value + high.value);
        inherited += weight * (low.error + high.error);
        magnitude += weight * (low.value.abs() + high.value.abs());
        if i % 2 == 1 {
            gauss += GAUSS[i / 2] * (low.value + high.value);
        }
    }
    Ok(Panel {
        from,
        to,
        depth,
        value: half * kronrod,
        error: half * (kronrod - gauss).abs(),
        inherited: half * inherited,
        magnitude: half * magnitude,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::ErrorKind;

    fn no_breaks(_: f64, _: &mut Vec<f64>) {}

    /// One panel, so that a wrong digit in a table cannot be mended by halving.
    fn one_panel(degree: i32) -> Panel {
        let mut evaluations = 0;
        let mut f = |x: f64| Ok(Estimate { value: (x + 0.5).powi(degree), error: 0.0, evaluations: 1 });
        measure(&mut f, -1.0, 1.0, 0, &mut evaluations).unwrap()
    }

    #[test]
    fn kronrod_is_exact_to_degree_22_and_gauss_to_degree_13() {
        for degree in 0..=22 {
            let exact = (1.5f64.powi(degree + 1) - (-0.5f64).powi(degree + 1)) / f64::from(degree + 1);
            let panel = one_panel(degree);
            // Fifteen products, each with a weight, node and power rounded: below 8 degree rounding errors of ∫|f|.
            let rounding = f64::EPSILON * 8.0 * f64::from(degree + 1) * panel.magnitude;
            assert!((panel.value - exact).abs() <= rounding, "degree {degree}: {} {exact}", panel.value);
            if degree <= 13 {
                assert!(panel.error <= rounding, "degree {degree}: {}", panel.error);
            }
        }
        assert!(one_panel(14).error > 1e-9, "G7 must not be exact at degree 14");
    }

    #[test]
    fn smooth_integrals_come_out_to_rounding() {
        let e = integrate(libm::exp, [0.0, 1.0], &[], Tolerance::absolute(1e-13)).unwrap();
        assert!((e.value - (std::f64::consts::E - 1.0)).abs() <= 4.0 * f64::EPSILON);
        let far = |x: f64, y: f64| 1.0 / (1.0 - x * y);
        // ∫∫ 1/(1 − xy) over [0, 1/2]² = dilogarithm Li₂(1/4) = 0.2676526390827326…
        let d = integrate_rectangle(far, [0.0, 0.5], [0.0, 0.5], &[], no_breaks, Tolerance::absolute(1e-12)).unwrap();
        assert!((d.value - 0.267_652_639_082_732_6).abs() <= 1e-15, "{}", d.value);
    }

    #[test]
    fn a_kink_costs_halvings_and_a_break_costs_none() {
        let kink = 1.0 / 3.0;
        let exact = 0.5 * (kink * kink + (1.0 - kink) * (1.0 - kink));
        let plain = integrate(|x: f64| (x - kink).abs(), [0.0, 1.0], &[], Tolerance::absolute(1e-12)).unwrap();
        let told = integrate(|x: f64| (x - kink).abs(), [0.0, 1.0], &[7.0, kink], Tolerance::absolute(1e-12)).unwrap();
        assert!((plain.value - exact).abs() <= plain.error && plain.error <= 1e-12);
        assert!((told.value - exact).abs() <= 1e-15);
        assert_eq!(told.evaluations, 30);
        assert!(plain.evaluations > 300);
    }

    #[test]
    fn the_reported_error_bounds_the_true_error_for_slanted_kinks_in_two_dimensions() {
        // ∫∫ |x + y/2 − 1| over the unit square. Without the bars: 1 − 1/2 − 1/4 = 1/4. The bars add twice the part
        // beyond the line, the triangle x > 1 − y/2 with value s = x + y/2 − 1: ∫ (y/2)²/2 dy = 1/24, so 1/3.
        let f = |x: f64, y: f64| (x + 0.5 * y - 1.0).abs();
        let blind = integrate_rectangle(f, [0.0, 1.0], [0.0, 1.0], &[], no_breaks, Tolerance::absolute(1e-10)).unwrap();
        assert!((blind.value - 1.0 / 3.0).abs() <= blind.error && blind.error <= 1e-10, "{blind:?}");
        let breaks = |x: f64, out: &mut Vec<f64>| out.push(2.0 - 2.0 * x);
        let told = integrate_rectangle(f, [0.0, 1.0], [0.0, 1.0], &[0.5], breaks, Tolerance::absolute(1e-10)).unwrap();
        assert!((told.value - 1.0 / 3.0).abs() <= 1e-15, "{told:?}");
        assert_eq!(told.evaluations, 15 * 15 + 15 * 30);
        assert!(blind.evaluations > 2 * told.evaluations);
    }

    #[test]
    fn what_cannot_be_reached_is_an_error_and_not_a_guess() {
        let pole = integrate(|x: f64| 1.0 / x, [0.0, 1.0], &[], Tolerance::absolute(1e-10));
        assert_eq!(pole.unwrap_err().kind, ErrorKind::Incomplete);
        let noise = integrate(libm::sqrt, [0.0, 1.0], &[], Tolerance::absolute(1e-18));
        assert_eq!(noise.unwrap_err().kind, ErrorKind::Incomplete);
        let nan = integrate(|x: f64| (x - 0.5).sqrt(), [0.0, 1.0], &[], Tolerance::absolute(1e-3));
        assert!(nan.unwrap_err().what.contains("finite value"));
        for interval in [[1.0, 0.0], [0.0, f64::NAN], [0.0, f64::INFINITY]] {
            let reversed = integrate(|x| x, interval, &[], Tolerance::absolute(1e-3));
            assert_eq!(reversed.unwrap_err().kind, ErrorKind::Input);
        }
    }

    #[test]
    fn an_empty_interval_is_zero() {
        let empty = integrate(|x| x, [2.0, 2.0], &[2.0], Tolerance::absolute(0.0)).unwrap();
        assert_eq!((empty.value, empty.evaluations), (0.0, 0));
        let flat = integrate_rectangle(|x, y| x + y, [1.0, 1.0], [0.0, 1.0], &[], no_breaks, Tolerance::absolute(1e-9));
        assert_eq!(flat.unwrap().value, 0.0);
    }

    #[test]
    fn a_relative_tolerance_serves_integrands_of_any_size() {
        for scale in [1e-30, 1.0, 1e30] {
            let f = |x: f64| scale * libm::sqrt(x);
            let e = integrate(f, [0.0, 1.0], &[], Tolerance::relative(1e-9)).unwrap();
            assert!((e.value / (scale * 2.0 / 3.0) - 1.0).abs() <= 1e-9);
        }
    }
}

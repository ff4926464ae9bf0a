//! Tests of one number: is it there, is it too small to matter, is it too large to be called nothing?
//!
//! Everything here takes an estimate with its standard error and degrees of freedom, and gives a p-value; Holm's correction
//! over the family of a table is its caller's.

use crate::stats::hypothesis::{equivalence_of_estimate, two_sided};
use crate::stats::{Estimate, Family, Moments, student_t_quantile};

/// Adjusted p-values below this are told as findings.
pub const LEVEL: f64 = 0.05;

/// An estimate, its standard error, and the degrees of freedom that the error was estimated from (∞: it is known).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// The estimate.
    pub value: f64,
    /// Its standard error, at least 0.
    pub error: f64,
    /// Degrees of freedom of the error.
    pub freedom: f64,
}

impl Measured {
    /// The mean of independent values; `None` below two of them.
    pub fn mean(values: &[f64]) -> Option<Self> {
        let moments: Moments = values.iter().copied().collect();
        Some(Self { value: moments.mean()?, error: moments.standard_error()?, freedom: (values.len() - 1) as f64 })
    }

    /// Reads value and error back from an estimate with Student's 95 % interval over `replicates`; `None` without one.
    pub fn from_estimate(e: &Estimate, replicates: u32) -> Option<Self> {
        let [low, high] = e.ci95?;
        let freedom = f64::from(replicates.checked_sub(1).filter(|&n| n > 0)?);
        Some(Self { value: e.value, error: 0.5 * (high - low) / student_t_quantile(0.975, freedom), freedom })
    }

    /// a − b of two independent estimates: errors add in squares, degrees of freedom by Welch and Satterthwaite.
    pub fn difference(a: &Self, b: &Self) -> Self {
        let error = libm::hypot(a.error, b.error);
        let share = |m: &Self| {
            let part = if error > 0.0 { m.error / error } else { 0.0 };
            part * part * part * part / m.freedom
        };
        let inverse = share(a) + share(b);
        let freedom = if inverse > 0.0 { 1.0 / inverse } else { f64::INFINITY };
        Self { value: a.value - b.value, error, freedom }
    }

    /// In other units: everything times `factor` > 0.
    pub fn scaled(&self, factor: f64) -> Self {
        Self { value: factor * self.value, error: factor * self.error, ..*self }
    }

    /// The estimate with its 95 % interval; of no width where the error is 0.
    pub fn estimate(&self) -> Estimate {
        // No quantile of infinitely many degrees of freedom is asked for by way of Student's.
        let factor = if self.freedom.is_finite() { student_t_quantile(0.975, self.freedom) } else { NORMAL_95 };
        let half = factor * self.error;
        Estimate { value: self.value, ci95: Some([self.value - half, self.value + half]) }
    }

    /// Two-sided p-value of the hypothesis that the true value is `truth`; 1 or 0 where the error is 0.
    pub fn p_of(&self, truth: f64) -> f64 {
        let distance = self.value - truth;
        match self.error > 0.0 {
            true => two_sided(distance / self.error, self.freedom),
            false => f64::from(u8::from(distance == 0.0)),
        }
    }

    /// *Equivalence* (two one-sided tests, TOST): p-value of the hypothesis that the true value is `margin` or more away from 0.
    /// Where it is small, the value is shown to be within ± `margin`. The larger of the two one-sided p-values (Schuirmann
    /// 1987, doi:10.1007/BF01068419).
    pub fn p_outside(&self, margin: f64) -> f64 {
        let Self { value, error, freedom } = *self;
        equivalence_of_estimate(value, error, freedom, margin, Family::one(0.5 * LEVEL)).p_value.unwrap_or(1.0)
    }

    /// p-value of the hypothesis that the true value is within ± `margin`: where it is small, the value is shown to be
    /// outside. Twice the one-sided p-value, since either side would count.
    pub fn p_inside(&self, margin: f64) -> f64 {
        (2.0 * self.above(self.value.abs() - margin)).min(1.0)
    }

    /// P(T · error ≥ distance).
    fn above(&self, distance: f64) -> f64 {
        if self.error == 0.0 {
            return if distance > 0.0 { 0.0 } else { 1.0 };
        }
        let tail = 0.5 * two_sided(distance / self.error, self.freedom);
        if distance > 0.0 { tail } else { 1.0 - tail }
    }
}

/// 97.5 % point of the standard normal distribution.
const NORMAL_95: f64 = 1.959_963_984_540_054;

/// What an equivalence test says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Sameness {
    /// Within the margin, by the test.
    Same,
    /// Outside the margin, by the test.
    Different,
    /// Neither is shown.
    CannotTell,
}

impl Sameness {
    /// From the p-values of [`Measured::p_outside`] as it is, and of [`Measured::p_inside`] as adjusted.
    ///
    /// *Same* where p is below half of [`LEVEL`]: exactly where the whole 95 % interval lies within the margin. That all of several are
    /// the same is claimed only where each is, which needs no correction for their number (an intersection–union test);
    /// that one among them differs does.
    pub fn of(p_outside: f64, p_inside: f64) -> Self {
        match (p_outside < 0.5 * LEVEL, p_inside < LEVEL) {
            (true, _) => Self::Same,
            (_, true) => Self::Different,
            _ => Self::CannotTell,
        }
    }

    /// The words for it in tables.
    pub fn words(self) -> &'static str {
        match self {
            Self::Same => "shown the same",
            Self::Different => "shown different",
            Self::CannotTell => "cannot tell",
        }
    }
}

/// Holm-adjusted p-values of a family some members of which have none; those stay without.
pub fn holm_of(p_values: &[Option<f64>]) -> Vec<Option<f64>> {
    let given: Vec<f64> = p_values.iter().copied().flatten().collect();
    // A p-value that is not in [0, 1] would be a mistake of the program; nothing is claimed of such a family.
    let Ok(adjusted) = crate::stats::hypothesis::holm(&given) else { return vec![None; p_values.len()] };
    let mut next = adjusted.into_iter();
    p_values.iter().map(|p| p.and_then(|_| next.next())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// t = 2.262157 is the 97.5 % point at 9 degrees of freedom (tables), 1.833113 the 95 % point.
    #[test]
    fn equivalence_is_two_one_sided_tests() {
        let m = |value| Measured { value, error: 0.1, freedom: 9.0 };
        assert!((m(0.2262157).p_of(0.0) - 0.05).abs() < 1e-6);
        assert!(
            (m(0.0).p_outside(0.1833113) - 0.05).abs() < 1e-6 && (m(-0.05).p_outside(0.2333113) - 0.05).abs() < 1e-6
        );
        assert!((m(0.05).p_outside(0.2333113) - 0.05).abs() < 1e-6);
        assert!((m(1.1833113).p_inside(1.0) - 0.1).abs() < 1e-6, "either side");
        assert!(m(0.3).p_outside(0.2) > 0.5 && m(0.0).p_inside(0.2) == 1.0);
        // The two agree with the intervals: within the margin by 5 % exactly where the 90 % interval is.
        let e = m(0.1);
        assert!((e.p_outside(0.1 + 0.1833113) - 0.05).abs() < 1e-6);
    }

    #[test]
    fn without_error_the_answers_are_definite() {
        let exact = |value| Measured { value, error: 0.0, freedom: f64::INFINITY };
        assert_eq!((exact(0.0).p_of(0.0), exact(0.1).p_of(0.0)), (1.0, 0.0));
        assert_eq!((exact(0.1).p_outside(0.2), exact(0.3).p_outside(0.2)), (0.0, 1.0));
        assert_eq!((exact(0.3).p_inside(0.2), exact(0.1).p_inside(0.2)), (0.0, 1.0));
        assert_eq!(exact(0.1).estimate().ci95, Some([0.1, 0.1]));
        assert_eq!(Measured::difference(&exact(0.3), &exact(0.3)), exact(0.0));
    }

    #[test]
    fn differences_add_errors_in_squares_and_estimates_are_read_back() {
        let (a, b) =
            (Measured { value: 2.0, error: 0.3, freedom: 7.0 }, Measured { value: 1.5, error: 0.4, freedom: 7.0 });
        let d = Measured::difference(&a, &b);
        // 0.5⁴/(0.3⁴/7 + 0.4⁴/7) = 7 · 0.0625/0.0337.
        assert!((d.error - 0.5).abs() < 1e-15 && (d.freedom - 7.0 * 0.0625 / 0.0337).abs() < 1e-9);
        let back = Measured::from_estimate(&a.estimate(), 8).unwrap();
        assert!((back.error - 0.3).abs() < 1e-12 && back.freedom == 7.0);
        assert_eq!(Measured::from_estimate(&a.estimate(), 1), None);
        assert_eq!(holm_of(&[Some(0.01), None, Some(0.04)]), [Some(0.02), None, Some(0.04)]);
    }
}

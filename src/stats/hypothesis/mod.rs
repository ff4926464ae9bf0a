//! Tests that say how often they may lie and what they would catch.
//!
//! The values fed to a test must be independent: whole replicates of a randomised estimator, never the correlated
//! samples within one.
//!
//! | question | test |
//! |---|---|
//! | is the mean of replicates an exact value, or that of other replicates | [`t_test`], [`z_test`], [`welch_test`] |
//! | is the rate of a rare event a known one, or that of other trials | [`binomial_test`], [`fisher_test`] |
//! | do draws follow a density or a distribution function | [`chi2_test`], [`chi2_masses_test`], [`ks_test`] |
//! | is it *shown* that means or variances are the same but for a margin | [`equivalence_test`] and its siblings |
//! | which of many p-values still count | [`holm`], [`benjamini_hochberg`], [`sidak`] |
//!
//! The first three rows look for evidence against the hypothesis: a verdict that holds has found none, and says how large a
//! departure it would have found. The fourth turns the burden of proof around: its verdict holds only where sameness is
//! shown, and it says which margin it could have shown.
//!
//! Tail probabilities are this crate's own (`special`, good to about 14 digits and the same on every machine), but for the
//! hypergeometric and binomial sums of the tests on counts: those are `statrs`', which loses digits like the logarithm
//! of a factorial does (relative error 1e-13 at 64 trials, 1e-9 at 10⁶: far less than any level cares for).

mod distributions;
mod equivalence;
mod means;
mod multiplicity;
mod rare;
#[cfg(test)]
mod tests;

use std::fmt;

use crate::mutants::{Mutant, planted};
use crate::stats::special::normal_upper_tail;

pub use distributions::{
    MIN_EXPECTED, Tail, cell_masses, chi2_masses_test, chi2_test, chi2_test_of, ks_test, ks_uniform_test,
};
pub use equivalence::{
    equivalence_of_estimate, equivalence_of_means, equivalence_test, mean_ratio_equivalence, paired_ratio_equivalence,
    variance_equivalence, variance_ratio_equivalence,
};
pub(in crate::stats) use means::same_but_for_rounding;
pub use means::{
    WelchResult, chi2_upper_tail, normal_factor, normal_tail, t_test, t_test_of_squares, two_sided, welch, welch_test,
    z_test,
};
pub use multiplicity::{benjamini_hochberg, holm};
pub use rare::{binomial_test, clopper_pearson, fisher_test};

/// The chance of detection at which [`Verdict::detects`] is stated.
pub const POWER: f64 = 0.99;

/// A set of tests that together raise a false alarm with at most a stated probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Family {
    /// How many tests there are, at least 1. Count every test that *may* be run: what a shrinking property test tries
    /// again is a test too.
    pub tests: u64,
    /// Probability in (0, 1) that any of them fails although all hypotheses are true.
    pub false_alarm: f64,
}

impl Family {
    /// A single test of this false-alarm rate.
    pub const fn one(false_alarm: f64) -> Self {
        Self { tests: 1, false_alarm }
    }

    /// The level of each test by Šidák, 1 − (1 − α)^(1/tests).
    ///
    /// # Panics
    /// Without tests, or with a false-alarm rate outside (0, 1): a mistake of the program, not of its input.
    pub fn per_test(self) -> f64 {
        assert!(self.tests > 0 && self.false_alarm > 0.0 && self.false_alarm < 1.0, "not a family of tests: {self:?}");
        sidak(self.false_alarm, self.tests)
    }

    /// The family for t tests on `n` values of skewness γ: each test's level is lowered so far that its true rate stays at the
    /// stated one.
    ///
    /// A mean of right-skewed values that is too low comes with too small a spread. Beyond z the lower tail of Student's t is
    /// exp(γ z³/(3 √n)) times as heavy as Student has it, to leading order (Hall 1987, doi:10.1214/aop/1176992063, from Edgeworth's
    /// term −γ (2z² + 1) φ(z)/(6 √n)); the upper tail is as much lighter. The level α′ solves α′ · exp(|γ| z(α′)³/(3 √n)) = α.
    pub fn for_skewed(self, skewness: f64, n: usize) -> Self {
        let level = self.per_test();
        let lean = skewness.abs() / (3.0 * (n.max(1) as f64).sqrt());
        let true_log = |z: f64| libm::log(2.0 * normal_upper_tail(z)) + lean * z * z * z;
        // Rises again where the leading order has lost its meaning: then the level is that of the bottom, as low as it goes.
        let (mut z, target) = (0.0, libm::log(level));
        while z < 36.0 && true_log(z) > target {
            z += 1.0 / 64.0;
        }
        Self { tests: 1, false_alarm: (2.0 * normal_upper_tail(z)).min(level) }
    }
}

/// Šidák's level of one of `tests` tests, 1 − (1 − α)^(1/tests), by way of expm1 and log1p so that it never rounds to
/// 0: computed literally in f32 it is 0 at 1 048 576 tests.
///
/// It keeps the family's rate for independent tests, and for the usual positively dependent ones.
pub fn sidak(alpha: f64, tests: u64) -> f64 {
    if planted(Mutant::SidakInSingle) {
        return 1.0 - f64::from(libm::powf(1.0 - alpha as f32, 1.0 / tests as f32));
    }
    -libm::expm1(libm::log1p(-alpha) / tests as f64)
}

/// What kind of answer a test gave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// A statistic with a p-value.
    Tested,
    /// Nothing varies (or only by rounding) and the numbers agree: no evidence against the hypothesis can exist.
    DefinitelyEqual,
    /// Nothing varies and the numbers differ: the hypothesis is false.
    DefinitelyDifferent,
    /// The data cannot be tested, and why. It does not hold: a test that did not run has not passed.
    Undefined(&'static str),
}

/// What it means that a verdict holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Claim {
    /// No evidence was found against the hypothesis: the p-value is not below the threshold.
    Compatible,
    /// The hypothesis of a difference beyond the margin was rejected: the p-value is below the threshold.
    Equivalent,
}

/// The answer of a test; [`holds`](Self::holds) is the short form, `Display` the long one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// What is claimed where the verdict holds.
    pub claim: Claim,
    /// What kind of answer this is.
    pub outcome: Outcome,
    /// The statistic (t, z, χ², D, a count) where one could be formed; never NaN.
    pub statistic: Option<f64>,
    /// Probability of a statistic at least this far out if the hypothesis is true; `None` where undefined. Of an
    /// equivalence test: the largest probability of one this far *inside* if the truth is no nearer than the margin.
    pub p_value: Option<f64>,
    /// The test's own level, with which the p-value is compared.
    pub threshold: f64,
    /// The family whose false-alarm rate the threshold keeps. For an equivalence test an alarm is false where
    /// equivalence is claimed and the truth lies beyond the margin.
    pub family: Family,
    /// Smallest bias that this test would catch with probability [`POWER`], in the unit of the values; for counts the
    /// smallest difference of rates, for χ² the root mean square relative departure of the cells, for
    /// Kolmogorov–Smirnov the largest distance of the distribution functions. `None` for an equivalence test.
    pub detects: Option<f64>,
    /// Of an equivalence test: the smallest distance (of a mean from the exact value, of a ratio from 1) that would have
    /// been shown with these values.
    pub margin: Option<f64>,
    /// Of an equivalence test: about how often it fails to show equivalence although there is no difference at all, given
    /// this spread.
    pub misses: Option<f64>,
}

impl Verdict {
    /// Does the claim stand at the family's level?
    pub fn holds(&self) -> bool {
        match self.outcome {
            Outcome::Tested => self.slack() >= 1.0,
            Outcome::DefinitelyEqual => true,
            Outcome::DefinitelyDifferent | Outcome::Undefined(_) => false,
        }
    }

    /// How far the verdict is from failing: 1 is the edge, below it fails. The p-value over the threshold, or the
    /// other way round for an equivalence test; 0 where there is no p-value.
    pub fn slack(&self) -> f64 {
        match (self.outcome, self.p_value, self.claim) {
            (Outcome::Undefined(_), ..) | (_, None, _) | (Outcome::DefinitelyDifferent, ..) => 0.0,
            (Outcome::DefinitelyEqual, ..) => 1.0 / self.threshold,
            (Outcome::Tested, Some(p), Claim::Compatible) => p / self.threshold,
            (Outcome::Tested, Some(p), Claim::Equivalent) => self.threshold / p.max(f64::MIN_POSITIVE),
        }
    }

    /// Fails the surrounding test where the verdict does not hold: the panic's message is `what` and the verdict.
    ///
    /// # Panics
    /// Where it does not hold.
    #[track_caller]
    pub fn assert(&self, what: &str) {
        assert!(self.holds(), "{what}: {self}");
    }

    fn new(family: Family, outcome: Outcome) -> Self {
        let p_value = match outcome {
            Outcome::DefinitelyEqual => Some(1.0),
            Outcome::DefinitelyDifferent => Some(0.0),
            Outcome::Tested | Outcome::Undefined(_) => None,
        };
        Self {
            claim: Claim::Compatible,
            outcome,
            statistic: None,
            p_value,
            threshold: family.per_test(),
            family,
            detects: None,
            margin: None,
            misses: None,
        }
    }

    pub(super) fn undefined(family: Family, why: &'static str) -> Self {
        Self::new(family, Outcome::Undefined(why))
    }

    fn tested(family: Family, statistic: f64, p_value: f64) -> Self {
        Self { statistic: Some(statistic), p_value: Some(p_value), ..Self::new(family, Outcome::Tested) }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.outcome, self.claim) {
            (Outcome::Undefined(why), _) => return write!(f, "undefined: {why}"),
            (Outcome::DefinitelyEqual, Claim::Compatible) => return write!(f, "holds: equal, and nothing varies"),
            (Outcome::DefinitelyDifferent, Claim::Compatible) => {
                return write!(f, "fails: different, and nothing varies");
            }
            (Outcome::DefinitelyEqual, Claim::Equivalent) => {
                return write!(f, "holds: within the margin, and nothing varies");
            }
            (Outcome::DefinitelyDifferent, Claim::Equivalent) => {
                return write!(f, "fails: beyond the margin, and nothing varies");
            }
            (Outcome::Tested, _) => {}
        }
        write!(f, "{}", if self.holds() { "holds" } else { "fails" })?;
        if let (Some(statistic), Some(p)) = (self.statistic, self.p_value) {
            write!(f, ": statistic {statistic:.6}, p = {p:.3e}, threshold {:.3e}", self.threshold)?;
        }
        let alarms = if self.claim == Claim::Equivalent { "false claims of equivalence" } else { "false alarms" };
        write!(f, " (1 of {} tests, {alarms} {:e} for all)", self.family.tests, self.family.false_alarm)?;
        if let Some(bias) = self.detects {
            write!(f, "; a bias of {bias:.3e} would be caught with probability {POWER}")?;
        }
        if let Some(margin) = self.margin {
            write!(f, "; the smallest margin that would have been shown is {margin:.3e}")?;
        }
        self.misses.map_or(Ok(()), |p| write!(f, "; without any difference it is missed with probability {p:.1e}"))
    }
}

//! Property tests of estimators in one line.
//!
//! A [`Trial`] runs an estimator – any function of a seed – over independent seeds, and [`Replicates`] ask what came out: is its
//! expectation the exact value, or another estimator's? The answer is an [`Agreement`], which says what was found, how
//! often such a test lies, and what it would have caught; the `assert_…` forms panic with that text.
//!
//! Who has replicates already uses [`assert_unbiased`] and [`assert_agree`].

use std::fmt;

use super::hypothesis::same_but_for_rounding;
use super::hypothesis::{Family, Outcome, Verdict, equivalence_test, t_test, welch_test};
use super::moments::{Estimate, t_interval};
use super::tails::Tails;

/// How an estimator is tried: how many replicates, from which seed, at which rate of false alarms.
///
/// A replicate is one complete independent randomisation of the whole estimator, with as many samples as it takes in use; the
/// samples within one may be correlated. Prefer fewer replicates of more samples: a mean of many samples is nearer to the
/// normal distribution that Student's t supposes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trial {
    replicates: u32,
    seed: u64,
    family: Family,
}

impl Trial {
    /// A trial of `replicates` ≥ 2 runs, as one of a `family` of tests, from seed 1.
    pub const fn new(replicates: u32, family: Family) -> Self {
        Self { replicates, seed: 1, family }
    }

    /// The same from another seed. Two estimators that are to be compared as independent need different ones; different
    /// cases of one property too, or their luck is shared.
    pub const fn seeded(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// The seed given to the estimator for replicate `index`: SplitMix64's mixer over seed and index.
    pub const fn seed_of(&self, index: u32) -> u64 {
        const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;
        let stream = mix(self.seed.wrapping_add(GOLDEN));
        mix(stream.wrapping_add(GOLDEN.wrapping_mul(index as u64 + 1)))
    }

    /// Runs the estimator once for each seed.
    pub fn of(self, mut estimator: impl FnMut(u64) -> f64) -> Replicates {
        Replicates { values: (0..self.replicates).map(|i| estimator(self.seed_of(i))).collect(), trial: self }
    }
}

/// SplitMix64's finaliser (Steele, Lea & Flood 2014).
const fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// The estimates of a [`Trial`].
#[derive(Debug, Clone, PartialEq)]
pub struct Replicates {
    values: Vec<f64>,
    trial: Trial,
}

impl Replicates {
    /// The estimates, by replicate.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Their mean with its 95 % Student-t interval.
    pub fn mean(&self) -> Estimate {
        t_interval(&self.values, 0.95)
    }

    /// Is the estimator's expectation `exact`? Student's t test, with a look at the tails.
    pub fn against(&self, exact: f64) -> Agreement {
        Agreement {
            found: self.mean(),
            expected: exact,
            expected_interval: None,
            verdict: t_test(&self.values, exact, self.trial.family),
            tails: Tails::of(&self.values),
            not_finite: self.not_finite(),
        }
    }

    /// Have both estimators the same expectation? Welch's test, with a look at the tails of the worse side.
    ///
    /// Undefined where both trials began with the same seed: if the estimators share randomness they are not independent, and a
    /// common error would hide. Seed one of them otherwise, or ask [`paired_with`](Self::paired_with).
    pub fn against_other(&self, other: &Self) -> Agreement {
        let verdict = if self.trial.seed == other.trial.seed {
            Verdict::undefined(self.trial.family, "both trials have the same seed: seed one otherwise, or pair them")
        } else {
            welch_test(&self.values, &other.values, self.trial.family)
        };
        let tails = [self, other].map(|side| Tails::of(&side.values));
        let worse = |t: &Option<Tails>| t.and_then(|t| t.p_value).unwrap_or(1.0);
        Agreement {
            found: self.mean(),
            expected: other.mean().value,
            expected_interval: other.mean().ci95,
            verdict,
            tails: if worse(&tails[0]) <= worse(&tails[1]) { tails[0] } else { tails[1] },
            not_finite: self.not_finite().or_else(|| other.not_finite()),
        }
    }

    /// Have both estimators the same expectation, replicate i of one beside replicate i of the other? Student's t test of
    /// their differences: right whether or not they share randomness, and sharper where they do.
    pub fn paired_with(&self, other: &Self) -> Agreement {
        // 0.1 + 0.2 beside 0.3 is no difference, which the difference alone would not show.
        let apart = |(&a, &b): (&f64, &f64)| if same_but_for_rounding(a, b) { 0.0 } else { a - b };
        let differences: Vec<f64> = self.values.iter().zip(&other.values).map(apart).collect();
        let verdict = if self.values.len() == other.values.len() {
            t_test(&differences, 0.0, self.trial.family)
        } else {
            Verdict::undefined(self.trial.family, "pairs need as many replicates on either side")
        };
        Agreement {
            found: self.mean(),
            expected: other.mean().value,
            expected_interval: other.mean().ci95,
            verdict,
            tails: Tails::of(&differences),
            not_finite: self.not_finite().or_else(|| other.not_finite()),
        }
    }

    /// Is it *shown* that the expectation lies within `margin` of `exact`? See [`equivalence_test`].
    pub fn within(&self, exact: f64, margin: f64) -> Verdict {
        equivalence_test(&self.values, exact, margin, self.trial.family)
    }

    /// Fails the surrounding test unless the expectation agrees with `exact`.
    ///
    /// # Panics
    /// With the [`Agreement`] where it does not hold.
    #[track_caller]
    pub fn assert_mean(&self, exact: f64) {
        let agreement = self.against(exact);
        assert!(agreement.holds(), "{agreement}");
    }

    /// Fails the surrounding test unless both estimators agree; seeds have to differ.
    ///
    /// # Panics
    /// With the [`Agreement`] where it does not hold.
    #[track_caller]
    pub fn assert_agrees_with(&self, other: &Self) {
        let agreement = self.against_other(other);
        assert!(agreement.holds(), "{agreement}");
    }

    /// The first replicate without a finite estimate, and its seed.
    fn not_finite(&self) -> Option<(u32, u64)> {
        let place = self.values.iter().position(|v| !v.is_finite())?;
        u32::try_from(place).ok().map(|i| (i, self.trial.seed_of(i)))
    }
}

/// What a trial decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decision {
    /// No evidence of a difference.
    Holds,
    /// A difference beyond chance.
    Fails,
    /// The test failed, but on replicates whose tails are so heavy that its false-alarm rate is not the stated one: take more samples
    /// in each replicate, bound the estimator, or test rare events as counts. It does not hold.
    Undecided,
    /// There was nothing to test.
    Undefined,
}

/// Does an estimate agree with what is expected? [`holds`](Self::holds) is the short form, `Display` the long one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Agreement {
    /// Mean of the replicates with its 95 % interval.
    pub found: Estimate,
    /// The exact value, or the other estimator's mean.
    pub expected: f64,
    /// 95 % interval of the other estimator's mean; `None` for an exact value.
    pub expected_interval: Option<[f64; 2]>,
    /// The test.
    pub verdict: Verdict,
    /// Shape of the replicates (of the heavier-tailed side); `None` where it has none.
    pub tails: Option<Tails>,
    /// The first replicate that is not finite, and its seed.
    pub not_finite: Option<(u32, u64)>,
}

impl Agreement {
    /// Does the estimate agree, at the family's level?
    pub fn holds(&self) -> bool {
        self.verdict.holds()
    }

    /// The verdict, with what the tails say of it.
    pub fn decision(&self) -> Decision {
        match (self.verdict.outcome, self.holds()) {
            (Outcome::Undefined(_), _) => Decision::Undefined,
            (_, true) => Decision::Holds,
            (Outcome::Tested, false) if self.tails.is_some_and(|t| t.are_heavy()) => Decision::Undecided,
            (_, false) => Decision::Fails,
        }
    }

    /// Smallest bias caught with probability [`POWER`](super::hypothesis::POWER) relative to the expected value; `None`
    /// where that is 0 or there was no test.
    pub fn detects_relative(&self) -> Option<f64> {
        self.verdict.detects.filter(|_| self.expected != 0.0).map(|d| d / self.expected.abs())
    }
}

impl fmt::Display for Agreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some((replicate, seed)) = self.not_finite {
            return write!(f, "undefined: replicate {replicate} (seed {seed:#x}) is not finite");
        }
        write!(f, "found {:.6e}", self.found.value)?;
        if let Some([low, high]) = self.found.ci95 {
            write!(f, " (95 %: {low:.6e} to {high:.6e})")?;
        }
        write!(f, ", expected {:.6e}", self.expected)?;
        if let Some([low, high]) = self.expected_interval {
            write!(f, " (95 %: {low:.6e} to {high:.6e})")?;
        }
        write!(f, ": {}", self.verdict)?;
        if let Some(relative) = self.detects_relative() {
            write!(f, " ({:.2} % of what is expected)", 100.0 * relative)?;
        }
        let Some(tails) = self.tails.filter(Tails::are_heavy) else { return Ok(()) };
        let advice = match self.decision() {
            Decision::Undecided => "undecided: the stated rates do not hold for such tails",
            _ => "a rare large value may be missing, so the interval may be too short",
        };
        write!(f, "; heavy tails, kurtosis {:.1}: {advice}", tails.kurtosis)
    }
}

/// Fails the surrounding test unless independent `replicates` of an estimator have the expectation `exact`.
///
/// # Panics
/// Where they have not, with the statistic, its p-value and threshold, the family's false-alarm rate and the smallest bias
/// that would have been caught.
#[track_caller]
pub fn assert_unbiased(replicates: &[f64], exact: f64, family: Family) {
    let trial = Trial::new(u32::try_from(replicates.len()).unwrap_or(u32::MAX), family);
    let agreement = Replicates { values: replicates.to_vec(), trial }.against(exact);
    assert!(agreement.holds(), "{agreement}");
}

/// Fails the surrounding test unless independent replicates `a` and `b` of two estimators have the same expectation.
///
/// # Panics
/// As [`assert_unbiased`].
#[track_caller]
pub fn assert_agree(a: &[f64], b: &[f64], family: Family) {
    let side = |values: &[f64], seed| Replicates { values: values.to_vec(), trial: Trial::new(0, family).seeded(seed) };
    let agreement = side(a, 1).against_other(&side(b, 2));
    assert!(agreement.holds(), "{agreement}");
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::Rng;
    use std::panic::catch_unwind;

    /// False alarms: 1e-8.
    const FAMILY: Family = Family { tests: 4, false_alarm: 1e-8 };

    /// Mean of 64 squares of uniform numbers, whose expectation is 1/3.
    fn mean_square(seed: u64) -> f64 {
        let mut rng = Pcg64::new(u128::from(seed), 1);
        let mut uniform = || (rng.next_u64() >> 11) as f64 * 0.5f64.powi(53);
        (0..64).map(|_| uniform().powi(2)).sum::<f64>() / 64.0
    }

    fn message(run: impl FnOnce() + std::panic::UnwindSafe) -> String {
        let panic = catch_unwind(run).expect_err("it should fail");
        panic.downcast_ref::<String>().expect("a text").clone()
    }

    #[test]
    fn a_right_estimator_passes_and_a_wrong_one_says_why_not() {
        let trial = Trial::new(64, FAMILY);
        trial.of(mean_square).assert_mean(1.0 / 3.0);
        let text = message(|| Trial::new(64, FAMILY).of(|s| 1.15 * mean_square(s)).assert_mean(1.0 / 3.0));
        let parts =
            ["found 3.", "expected 3.333333e-1", "fails: statistic", "p = ", "threshold 2.500e-9", "1 of 4 tests"];
        for part in
            parts.iter().chain(&["false alarms 1e-8", "would be caught with probability 0.99", "% of what is expected"])
        {
            assert!(text.contains(part), "{part:?} in {text:?}");
        }
        assert_unbiased(trial.of(mean_square).values(), 1.0 / 3.0, FAMILY);
        assert_agree(trial.of(mean_square).values(), trial.seeded(2).of(mean_square).values(), FAMILY);
    }

    #[test]
    fn two_estimators_need_two_seeds_or_pairs() {
        let trial = Trial::new(64, FAMILY);
        let (a, b) = (trial.of(mean_square), trial.seeded(2).of(mean_square));
        a.assert_agrees_with(&b);
        assert_eq!(a.against_other(&a).decision(), Decision::Undefined);
        assert!(a.against_other(&a).to_string().contains("same seed"));
        // The same numbers plus a thousandth: pairs see what Welch cannot.
        let shifted = trial.of(|s| mean_square(s) + 1e-3);
        assert_eq!(shifted.paired_with(&a).decision(), Decision::Fails);
        let [sum, whole] = [0.1 + 0.2, 0.3].map(|v| Trial::new(8, FAMILY).of(|_| v));
        assert!(sum.paired_with(&whole).holds() && sum.paired_with(&sum).holds());
        assert!(shifted.against_other(&b).holds());
        assert!(a.within(1.0 / 3.0, 0.1).holds() && !a.within(1.0 / 3.0, 1e-3).holds());
    }

    #[test]
    fn what_is_not_finite_is_named_with_its_seed() {
        let trial = Trial::new(8, FAMILY);
        let bad = trial.of(|s| if s == trial.seed_of(3) { f64::NAN } else { 1.0 });
        let agreement = bad.against(1.0);
        assert_eq!(agreement.decision(), Decision::Undefined);
        assert_eq!(
            agreement.to_string(),
            format!("undefined: replicate 3 (seed {:#x}) is not finite", trial.seed_of(3))
        );
    }

    /// Row 44 of the catalogue: 1/u^0.7 has an infinite variance; its test is not decided by Student's t, or it holds with a
    /// warning, and never fails as if it were sure.
    #[test]
    fn heavy_tails_are_flagged() {
        let heavy = |seed: u64| {
            let mut rng = Pcg64::new(u128::from(seed), 1);
            let uniform = ((rng.next_u64() >> 11) as f64 + 0.5) * 0.5f64.powi(53);
            0.3 / libm::pow(uniform, 0.7)
        };
        for seed in 0..40 {
            let agreement = Trial::new(200, Family::one(0.01)).seeded(seed).of(heavy).against(1.0);
            assert!(matches!(agreement.decision(), Decision::Holds | Decision::Undecided), "{agreement}");
            assert!(agreement.to_string().contains("heavy tails, kurtosis"), "{agreement}");
        }
    }
}

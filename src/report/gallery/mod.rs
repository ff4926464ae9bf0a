//! A gallery of failures of methods, each measured beside the sound way: at report time, from samplers and metrics alone.
//!
//! None of these needs a scene. [`measure`] makes all of them from one seed; [`panels`] draws the point sets that show them.

mod points;
mod sums;

use crate::stats::Estimate;

use super::evidence::Answer;
use super::pictures::NamedPoints;

/// One way of doing it and its number.
#[derive(Debug, Clone, PartialEq)]
pub struct Side {
    /// What was done: `stratified:sheet`.
    pub way: &'static str,
    /// The number.
    pub number: Estimate,
}

/// What shows that the number of the failing side is wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Evidence {
    /// Both sides estimate this value: the failing one's interval excludes it, the sound one's p-value does not.
    Truth {
        /// The value.
        value: f64,
        /// p-value of the failing side's mean being it.
        failing: f64,
        /// The same of the sound side.
        sound: f64,
    },
    /// Failing over sound, 1 where nothing is wrong.
    Ratio(Estimate),
    /// The two numbers, with their whole intervals, lie apart: the failing one above, or below.
    Apart {
        /// Whether a larger number is the worse one.
        larger_is_worse: bool,
    },
}

/// Adjusted p-values below this show a failure; above it they show none.
const LEVEL: f64 = 1e-3;

/// A failure beside its remedy.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// What goes wrong, in a few words.
    pub title: &'static str,
    /// What is measured, with its unit and n.
    pub quantity: String,
    /// The failing way.
    pub failing: Side,
    /// The sound way.
    pub sound: Side,
    /// What tells them apart.
    pub evidence: Evidence,
    /// Why it fails.
    pub cause: &'static str,
    /// What to do.
    pub remedy: &'static str,
}

impl Failure {
    /// Whether the numbers show the failure: yes, no, or cannot tell.
    pub fn is_shown(&self) -> Answer {
        match self.evidence {
            Evidence::Truth { failing, sound, .. } => match (failing < LEVEL, sound < LEVEL) {
                (true, false) => Answer::Yes,
                (false, _) => Answer::No,
                _ => Answer::CannotTell,
            },
            Evidence::Ratio(ratio) => super::evidence::above(&ratio, 1.0),
            Evidence::Apart { larger_is_worse } => {
                let (worse, better) =
                    if larger_is_worse { (&self.failing, &self.sound) } else { (&self.sound, &self.failing) };
                match (worse.number.ci95, better.number.ci95) {
                    (Some([low, _]), Some([_, high])) if low > high => Answer::Yes,
                    (Some([_, high]), Some([low, _])) if high <= low => Answer::No,
                    _ => Answer::CannotTell,
                }
            }
        }
    }
}

/// All failures, those of decisions first.
pub fn measure(seed: u64) -> Vec<Failure> {
    let all = [
        sums::decisions_in_step(seed),
        sums::one_key_for_both_axes(seed),
        sums::digital_shift_called_owen(seed),
        points::shift_of_a_net(seed),
        sums::first_point_dropped(seed),
        sums::no_power_of_two(seed),
        sums::two_passes(seed),
        sums::leftover_strata(seed),
        sums::one_set_in_every_pixel(seed),
        points::prefix_of_a_set(),
        points::high_bases(seed),
        points::single_precision(),
    ];
    all.into_iter().flatten().collect()
}

/// Point sets for the eye: above the failing way, below it the sound one.
pub fn panels(seed: u64) -> Option<Vec<NamedPoints>> {
    points::panels(seed)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of the catalogue, where they are known: half a Hammersley set has D* ≈ 1/2; a digital shift has n times the
    /// variance of Owen's scramble; decisions in step converge to 0 for strata.
    #[test]
    fn every_failure_is_shown_and_the_known_numbers_are_met() {
        let all = measure(4);
        assert_eq!(all.len(), 12);
        for failure in &all {
            assert_eq!(failure.is_shown(), Answer::Yes, "{failure:?}");
        }
        let of = |title: &str| all.iter().find(|failure| failure.title.contains(title)).unwrap();
        let number = |title: &str| [of(title).failing.number.value, of(title).sound.number.value];
        assert!((number("half of")[0] - 0.5).abs() < 0.02, "{:?}", number("half of"));
        let [shift, owen] = number("digital shift");
        assert!((shift / 256.0 - 1.0).abs() < 0.4 && (owen - 1.0).abs() < 0.4, "{shift} {owen}");
        assert!(number("in step")[0] < 0.01);
        let [single, integer] = number("single precision");
        assert!(single <= 0.0 && integer > 0.0, "{single} {integer}");
        assert_eq!(number("shifted modulo")[1], 0.0, "a scrambled net is a net");
        assert_eq!(panels(4).unwrap().len(), 8);
    }

    #[test]
    fn a_failure_that_the_numbers_do_not_show_is_not_claimed() {
        let mut failure = measure(7).remove(0);
        let number = Estimate { value: 1.0, ci95: Some([0.9, 1.1]) };
        failure.evidence = Evidence::Ratio(number);
        assert_eq!(failure.is_shown(), Answer::CannotTell);
        failure.evidence = Evidence::Truth { value: 1.0, failing: 0.3, sound: 0.5 };
        assert_eq!(failure.is_shown(), Answer::No);
        let exact = |value| Estimate { value, ci95: Some([value; 2]) };
        failure.evidence = Evidence::Apart { larger_is_worse: true };
        (failure.failing.number, failure.sound.number) = (exact(1.0), exact(1.0));
        assert_eq!(failure.is_shown(), Answer::No);
        failure.sound.number = Estimate { value: 0.9, ci95: Some([0.7, 1.1]) };
        assert_eq!(failure.is_shown(), Answer::CannotTell);
    }
}

//! Rare binary outcomes: exact tests, where a t test would cry wolf.
//!
//! A pixel on an edge or in a penumbra is 0 or 1; Welch's test on 64 against 256 samples of probability 0.05 raises 114
//! times the alarms it states. Counts have distributions of their own.

use statrs::distribution::{Binomial, DiscreteCDF, Hypergeometric};

use super::means::same_but_for_rounding;
use super::{Family, Outcome, POWER, Verdict};
use crate::mutants::{Mutant, planted};
use crate::stats::moments::student_t_quantile;
use crate::stats::special::{incomplete_beta, solve_falling, student_two_sided_inverse};

/// P(K ≤ k) and P(K ≥ k) of `trials` with success probability `p` in (0, 1).
fn binomial_tails(k: u64, trials: u64, p: f64) -> [f64; 2] {
    let (k, n) = (k as f64, trials as f64);
    // I_p(k, n − k + 1) and its mirror; the ends are certain.
    let at_most = if k >= n { 1.0 } else { incomplete_beta(n - k, k + 1.0, 1.0 - p, p) };
    let at_least = if k <= 0.0 { 1.0 } else { incomplete_beta(k, n - k + 1.0, p, 1.0 - p) };
    [at_most, at_least]
}

/// Is the probability of a success `p`? Exact binomial test on independent trials, two-sided.
///
/// The p-value is twice the smaller tail, min(1, 2 min(P(K ≤ k), P(K ≥ k))): the test that fails exactly where `p` is outside
/// [`clopper_pearson`]'s interval at 1 − level. It lies at most as often as stated; being discrete, usually less. The
/// statistic is the observed rate.
///
/// `detects` is the smallest d such that every probability at a distance of d or more from `p` would be caught with
/// probability [`POWER`] (where a rate of 0 itself cannot be told from `p`, d is at least `p`: nothing lies below 0).
///
/// `p` = 0 or 1 has definite answers. Undefined without trials, with more successes than trials, or where `p` is no
/// probability.
pub fn binomial_test(successes: u64, trials: u64, p: f64, family: Family) -> Verdict {
    if trials == 0 || successes > trials || !(0.0..=1.0).contains(&p) {
        return Verdict::undefined(family, "a binomial test needs trials, no more successes, and a probability");
    }
    let rate = successes as f64 / trials as f64;
    if p == 0.0 || p == 1.0 {
        let outcome =
            if same_but_for_rounding(rate, p) { Outcome::DefinitelyEqual } else { Outcome::DefinitelyDifferent };
        return Verdict { statistic: Some(rate), ..Verdict::new(family, outcome) };
    }
    let [low, high] = binomial_tails(successes, trials, p);
    let verdict = Verdict::tested(family, rate, (2.0 * low.min(high)).min(1.0));
    Verdict { detects: binomial_detects(trials, p, family.per_test()), ..verdict }
}

/// See [`binomial_test`].
fn binomial_detects(trials: u64, p: f64, level: f64) -> Option<f64> {
    // The least count that fails upwards and the largest that fails downwards, by bisection on the monotone tails.
    let first = |fails: &dyn Fn(u64) -> bool| {
        let (mut low, mut high) = (0, trials + 1);
        while low < high {
            let middle = low + (high - low) / 2;
            if fails(middle) { high = middle } else { low = middle + 1 }
        }
        low
    };
    let too_many = first(&|k| k > trials || 2.0 * binomial_tails(k, trials, p)[1] < level);
    let not_too_few = first(&|k| k > trials || 2.0 * binomial_tails(k, trials, p)[0] >= level);
    // statrs is good enough for a power: see the front page of `hypothesis`.
    let at_most = |k: u64, q: f64| Binomial::new(q, trials).map_or(f64::NAN, |b| b.cdf(k));
    // Below three digits a power says nothing: twenty halvings.
    let nearest = |caught: &dyn Fn(f64) -> f64, end: f64| {
        let (mut missed, mut found) = (p, end);
        if caught(end) < POWER {
            return None;
        }
        for _ in 0..20 {
            let middle = 0.5 * (missed + found);
            if caught(middle) < POWER { missed = middle } else { found = middle }
        }
        Some(found)
    };
    let up = if too_many > trials { None } else { nearest(&|q| 1.0 - at_most(too_many - 1, q), 1.0) };
    let down = if not_too_few == 0 { None } else { nearest(&|q| at_most(not_too_few - 1, q), 0.0) };
    let (up, down) = (up.map(|q| q - p), down.map(|q| p - q));
    // A side on which nothing is found matters where there is room for a bias as large as the other side finds.
    let found = up.into_iter().chain(down).reduce(f64::max)?;
    let blind = (up.is_none() && 1.0 - p >= found) || (down.is_none() && p >= found);
    (!blind).then_some(found)
}

/// Have two sets of independent trials the same probability of success? Fisher's exact test, two-sided.
///
/// Given all successes together, those among `a`'s trials are hypergeometric. The p-value is twice the smaller tail,
/// at most 1: it never lies more often than stated, whatever the probability, and for rare events much less. The statistic
/// is the difference of the two rates.
///
/// `detects` is the smallest difference of the rates caught with probability [`POWER`] where the smaller of the two is what both sets
/// show together: on the variance-stabilised scale asin √p, where a rate of n trials has variance 1/4n, with a count
/// of continuity correction at each side. Good to about a quarter.
///
/// All or none a success: no evidence can exist, and p is 1. Undefined without trials on a side or with more successes
/// than trials.
pub fn fisher_test([hits_a, trials_a]: [u64; 2], [hits_b, trials_b]: [u64; 2], family: Family) -> Verdict {
    if trials_a == 0 || trials_b == 0 || hits_a > trials_a || hits_b > trials_b {
        return Verdict::undefined(
            family,
            "Fisher's test needs trials on both sides and no more successes than trials",
        );
    }
    let statistic = hits_a as f64 / trials_a as f64 - hits_b as f64 / trials_b as f64;
    let Ok(law) = Hypergeometric::new(trials_a + trials_b, hits_a + hits_b, trials_a) else {
        return Verdict::undefined(family, "no hypergeometric distribution has these counts");
    };
    let at_most = law.cdf(hits_a);
    // The least possible count leaves nothing below it.
    let least = (hits_a + hits_b).saturating_sub(trials_b);
    let at_least = if hits_a <= least { 1.0 } else { law.sf(hits_a - 1) };
    let p = (2.0 * at_most.min(at_least)).min(1.0);
    let detects = fisher_detects([trials_a, trials_b], hits_a + hits_b, family.per_test());
    Verdict { detects, ..Verdict::tested(family, statistic, p) }
}

/// See [`fisher_test`].
fn fisher_detects([n_a, n_b]: [u64; 2], hits: u64, level: f64) -> Option<f64> {
    let (a, b) = (n_a as f64, n_b as f64);
    let shrunk = |p: f64| p.clamp(0.0, 1.0);
    let base = shrunk(hits as f64 / (a + b));
    // The scarcer side decides: work with the smaller of the rate and its complement.
    let base = base.min(1.0 - base);
    let factor = student_two_sided_inverse(level, f64::INFINITY) + student_t_quantile(POWER, f64::INFINITY);
    let angle = libm::asin(base.sqrt()) + 0.5 * factor * (1.0 / a + 1.0 / b).sqrt();
    if angle >= std::f64::consts::FRAC_PI_2 {
        return None;
    }
    let sine = libm::sin(angle);
    Some(shrunk(sine * sine - base + 1.0 / a + 1.0 / b))
}

/// Clopper and Pearson's exact interval of a probability, from `successes` in `trials` at two-sided `confidence`.
///
/// Never too narrow: it covers at least at its level for every true probability. No trials: [0, 1].
///
/// # Panics
/// With more successes than trials.
pub fn clopper_pearson(successes: u64, trials: u64, confidence: f64) -> [f64; 2] {
    assert!(successes <= trials, "{successes} successes in {trials} trials");
    let tail = 0.5 * (1.0 - confidence);
    let (k, n) = (successes as f64, trials as f64);
    if planted(Mutant::WaldInterval) {
        let half = super::normal_factor(confidence) * (k / n * (1.0 - k / n) / n).sqrt();
        return [k / n - half, k / n + half];
    }
    let at_least_k = |p: f64| incomplete_beta(k, n - k + 1.0, p, 1.0 - p);
    let at_most_k = |p: f64| incomplete_beta(n - k, k + 1.0, 1.0 - p, p);
    let low = if successes == 0 { 0.0 } else { solve_falling(|p| -at_least_k(p), -tail, 0.0, 1.0) };
    let high = if successes == trials { 1.0 } else { solve_falling(at_most_k, tail, 0.0, 1.0) };
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: Family = Family::one(0.01);

    /// C(n, k) exactly, n ≤ 60.
    fn choose(n: u64, k: u64) -> u128 {
        if k > n { 0 } else { (0..k).fold(1, |c, i| c * u128::from(n - i) / u128::from(i + 1)) }
    }

    /// Tails of Binomial(12, 1/4) in whole numbers: Σ C(12, j) 3^(12−j) / 4^12.
    #[test]
    fn binomial_p_values_are_exact() {
        let weight = |j: u64| choose(12, j) as f64 * 3f64.powi(12 - j as i32) / 4f64.powi(12);
        for k in 0..=12 {
            let (low, high): (f64, f64) = ((0..=k).map(weight).sum(), (k..=12).map(weight).sum());
            let found = binomial_test(k, 12, 0.25, ONE).p_value.unwrap();
            assert!((found - (2.0 * low.min(high)).min(1.0)).abs() <= 1e-13 * found, "{k}: {found}");
        }
    }

    /// Every table with margins up to 9 + 7, enumerated in whole numbers.
    #[test]
    fn fishers_p_values_are_exact() {
        for (n_a, n_b) in [(9_u64, 7_u64), (1, 5), (20, 30)] {
            for hits in 0..=n_a + n_b {
                let least = hits.saturating_sub(n_b);
                for a in least..=hits.min(n_a) {
                    let weight = |j: u64| choose(n_a, j) * choose(n_b, hits - j);
                    let total = choose(n_a + n_b, hits) as f64;
                    let low = (least..=a).map(weight).sum::<u128>() as f64 / total;
                    let high = (a..=hits.min(n_a)).map(weight).sum::<u128>() as f64 / total;
                    let found = fisher_test([a, n_a], [hits - a, n_b], ONE).p_value.unwrap();
                    let truth = (2.0 * low.min(high)).min(1.0);
                    assert!((found - truth).abs() <= 1e-11 * truth, "{a}/{n_a} {hits}: {found} {truth}");
                }
            }
        }
    }

    /// The doubled tail and Clopper and Pearson's interval are the same test.
    #[test]
    fn the_binomial_test_fails_where_the_exact_interval_misses() {
        for k in 0..=40 {
            let [low, high] = clopper_pearson(k, 40, 0.99);
            let holds = binomial_test(k, 40, 0.15, ONE).holds();
            assert_eq!(holds, (low..=high).contains(&0.15), "{k}");
        }
    }

    /// The chance of being caught at the stated distance, summed exactly: at least POWER, and hardly less nearer in.
    #[test]
    fn what_the_binomial_test_detects_it_detects() {
        for (n, p) in [(64, 0.05), (400, 0.3), (50, 0.001), (1000, 0.97)] {
            let family = Family::one(1e-4);
            let d = binomial_test(0, n, p, family).detects.unwrap();
            let power = |q: f64| {
                let pmf = |k: u64| {
                    let [at_most, at_least] = binomial_tails(k, n, q);
                    at_most + at_least - 1.0
                };
                (0..=n).filter(|&k| !binomial_test(k, n, p, family).holds()).map(pmf).sum::<f64>()
            };
            let ends: Vec<f64> = [p - d, p + d].into_iter().filter(|q| (1e-9..1.0).contains(q)).collect();
            assert!(!ends.is_empty() && ends.iter().all(|&q| power(q) > POWER - 1e-3), "{n} {p} {d}");
            let nearer = [p - 0.9 * d, p + 0.9 * d].into_iter().filter(|q| (1e-9..1.0).contains(q));
            assert!(nearer.into_iter().any(|q| power(q) < POWER), "{n} {p} {d}");
        }
    }

    /// Fisher's power by enumeration of all pairs of counts: at 1.25 times the stated difference it is there, at 0.75 times
    /// it is not.
    #[test]
    fn what_fishers_test_detects_it_detects() {
        for (n_a, n_b, hits) in [(64_u64, 256_u64, 16_u64), (40, 40, 8), (100, 60, 0)] {
            let family = Family::one(1e-4);
            let base = hits as f64 / (n_a + n_b) as f64;
            let d = fisher_test([hits, n_a], [0, n_b], family).detects.unwrap();
            let pmf = |n: u64, q: f64| -> Vec<f64> {
                let tail = |k: u64| if q == 0.0 { f64::from(u8::from(k == 0)) } else { binomial_tails(k, n, q)[1] };
                (0..=n).map(|k| if q == 0.0 || k == n { tail(k) } else { tail(k) - tail(k + 1) }).collect()
            };
            let power = |d: f64| {
                let (of_a, of_b) = (pmf(n_a, base + d), pmf(n_b, base));
                let mut power = 0.0;
                for (a, pa) in of_a.iter().enumerate() {
                    for (b, pb) in of_b.iter().enumerate().filter(|(_, pb)| *pa * **pb > 1e-7) {
                        if !fisher_test([a as u64, n_a], [b as u64, n_b], family).holds() {
                            power += pa * pb;
                        }
                    }
                }
                power
            };
            let (beyond, before) = (power(1.25 * d), power(0.75 * d));
            assert!(beyond > POWER - 1e-3 && before < POWER, "{n_a} {n_b} {hits}: {beyond} {before} at {d}");
        }
    }

    #[test]
    fn certain_rates_and_impossible_counts() {
        assert!(binomial_test(0, 9, 0.0, ONE).holds() && !binomial_test(1, 9, 0.0, ONE).holds());
        assert!(binomial_test(9, 9, 1.0, ONE).holds() && !binomial_test(8, 9, 1.0, ONE).holds());
        for verdict in [
            binomial_test(0, 0, 0.5, ONE),
            binomial_test(3, 2, 0.5, ONE),
            binomial_test(1, 2, f64::NAN, ONE),
            fisher_test([0, 0], [1, 2], ONE),
            fisher_test([3, 2], [1, 2], ONE),
        ] {
            assert!(matches!(verdict.outcome, Outcome::Undefined(_)) && !verdict.holds(), "{verdict}");
        }
        assert_eq!(fisher_test([0, 9], [0, 7], ONE).p_value, Some(1.0));
        assert_eq!(fisher_test([9, 9], [7, 7], ONE).p_value, Some(1.0));
    }
}

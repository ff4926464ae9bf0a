//! From numbers with intervals to answers: yes, no, or cannot tell. Every sentence of a report rests on one of these.

use crate::stats::{Estimate, jackknife, sum};

/// An answer that numbers give.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Answer {
    /// The whole interval says so.
    Yes,
    /// The whole interval says the opposite.
    No,
    /// The interval holds both, or there is none.
    CannotTell,
}

impl Answer {
    /// The word for it in tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Yes => "yes",
            Self::No => "no",
            Self::CannotTell => "cannot tell",
        }
    }
}

/// Is the estimated quantity below `limit`?
pub fn below(e: &Estimate, limit: f64) -> Answer {
    match e.ci95 {
        Some([_, high]) if high < limit => Answer::Yes,
        Some([low, _]) if low >= limit => Answer::No,
        _ => Answer::CannotTell,
    }
}

/// Is the estimated quantity above `limit`?
pub fn above(e: &Estimate, limit: f64) -> Answer {
    match e.ci95 {
        Some([low, _]) if low > limit => Answer::Yes,
        Some([_, high]) if high <= limit => Answer::No,
        _ => Answer::CannotTell,
    }
}

/// a/b of two positive estimates, with the interval that Zou & Donner (2008, doi:10.1002/sim.3095) recover from theirs
/// ("MOVER"), on logarithms: the distances of value and end add in squares, a's low end with b's high one.
///
/// The two are taken as independent; a reference that both share makes the interval too wide, not too narrow. An end of
/// `a` or `b` at or below 0 opens the ratio's interval to 0 or ∞. `None` where a value is not above 0; no interval where
/// one of the two has none.
pub fn ratio(a: &Estimate, b: &Estimate) -> Option<Estimate> {
    let positive = |e: &Estimate| e.value > 0.0 && e.value.is_finite();
    if !(positive(a) && positive(b)) {
        return None;
    }
    let value = a.value / b.value;
    let ci95 = match (a.ci95, b.ci95) {
        (Some([a_low, a_high]), Some([b_low, b_high])) => {
            let down = distance(a.value, a_low).hypot_with(distance(b_high, b.value));
            let up = distance(a_high, a.value).hypot_with(distance(b.value, b_low));
            Some([value * libm::exp(-down), value * libm::exp(up)])
        }
        _ => None,
    };
    Some(Estimate { value, ci95 })
}

/// ln(high/low), infinite where `low` has no logarithm.
fn distance(high: f64, low: f64) -> f64 {
    if low > 0.0 { libm::log(high / low).max(0.0) } else { f64::INFINITY }
}

trait Hypot {
    fn hypot_with(self, other: f64) -> f64;
}

impl Hypot for f64 {
    /// √(a² + b²) by IEEE operations alone, so with the same bits everywhere.
    fn hypot_with(self, other: f64) -> f64 {
        (self * self + other * other).sqrt()
    }
}

/// √(a/b) of two mean squares: the ratio of two root mean squares.
pub fn ratio_of_roots(a: &Estimate, b: &Estimate) -> Option<Estimate> {
    let squares = ratio(a, b)?;
    Some(Estimate { value: squares.value.sqrt(), ci95: squares.ci95.map(|ends| ends.map(f64::sqrt)) })
}

/// mean(a)/mean(b) of paired replicates, as for two makings of the same images: the delete-1 jackknife of its logarithm, so
/// that what the two of a pair have in common is not counted as noise of the ratio.
///
/// `None` where a mean, of all or of all but one, is not above 0, or the replicates are no pairs; no interval of one pair.
pub fn paired_ratio(a: &[f64], b: &[f64]) -> Option<Estimate> {
    if a.len() != b.len() || a.is_empty() {
        return None;
    }
    let total = |values: &[f64], out: Option<usize>| {
        sum(values.iter().enumerate().filter(|&(i, _)| Some(i) != out).map(|(_, &value)| value))
    };
    let theta = |out: Option<usize>| libm::log(total(a, out) / total(b, out));
    let subsets = std::iter::once(None).chain((0..a.len()).map(Some).filter(|_| a.len() > 1));
    if !subsets.clone().all(|out| total(a, out) > 0.0 && total(b, out) > 0.0) {
        return None;
    }
    let log = jackknife(a.len(), theta);
    // Not by way of the logarithm: equal images have a ratio of exactly 1.
    let value = total(a, None) / total(b, None);
    Some(Estimate { value, ci95: log.ci95.map(|ends| ends.map(|end| value * libm::exp(end - log.value))) })
}

/// √(mean(a)/mean(b)) of paired replicates' mean squares, see [`paired_ratio`].
pub fn paired_ratio_of_roots(a: &[f64], b: &[f64]) -> Option<Estimate> {
    let squares = paired_ratio(a, b)?;
    Some(Estimate { value: squares.value.sqrt(), ci95: squares.ci95.map(|ends| ends.map(f64::sqrt)) })
}

/// The estimate at `x` between the neighbouring ones of `points` (by ascending x), on a straight line of logarithms;
/// values and interval ends alike.
///
/// `None` outside the points, where x does not ascend, or where a value is not above 0; no interval where an end is not.
pub fn interpolated(points: &[(f64, Estimate)], x: f64) -> Option<Estimate> {
    let pair = points.windows(2).find(|pair| pair[0].0 <= x && x <= pair[1].0 && pair[0].0 < pair[1].0)?;
    let share = libm::log(x / pair[0].0) / libm::log(pair[1].0 / pair[0].0);
    let between = |a: f64, b: f64| (a > 0.0 && b > 0.0).then(|| libm::exp(libm::log(a) + share * libm::log(b / a)));
    let (a, b) = (&pair[0].1, &pair[1].1);
    let ci95 = match (a.ci95, b.ci95) {
        (Some(a), Some(b)) => between(a[0], b[0]).zip(between(a[1], b[1])).map(|(low, high)| [low, high]),
        _ => None,
    };
    Some(Estimate { value: between(a.value, b.value)?, ci95 })
}

/// Ratios nearer to 1 than this factor are called no difference, however narrow their intervals.
pub const LEAST_FACTOR: f64 = 1.01;

/// Is a ratio above 1, by the same distance that [`is_biased`] asks for: 1 more than twice as far from the ratio, on a
/// logarithmic scale, as its interval's low end, and the ratio above [`LEAST_FACTOR`]?
pub fn clearly_above_one(ratio: &Estimate) -> bool {
    ratio.value > LEAST_FACTOR && ratio.ci95.is_some_and(|[low, _]| low > ratio.value.sqrt())
}

/// Is a ratio below 1, by the rule of [`clearly_above_one`]?
pub fn clearly_below_one(ratio: &Estimate) -> bool {
    ratio.value > 0.0
        && ratio.value < 1.0 / LEAST_FACTOR
        && ratio.ci95.is_some_and(|[_, high]| high < ratio.value.sqrt())
}

/// Where the error of a sampler goes as samples are added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Limit {
    /// It stays, and a part of it is the same in every replicate: the image converges to a wrong one.
    Wrong,
    /// It stays, but differs from replicate to replicate: right on average, and more samples do not help.
    Stalls,
    /// It stays, a part of it the same in every replicate and a part not: the image converges to none, and is not right on
    /// average either.
    StallsBiased,
    /// It falls.
    Falls,
    /// The intervals allow more than one of these.
    Unclear,
}

/// Is a squared bias there? Called only where 0 is more than twice as far from the estimate as the interval's end (a
/// chance of about 1 in 1000 with eight replicates), so that a report full of intervals does not see a bias by chance.
/// An interval that holds 0 shows none; between the two it cannot be told.
pub fn is_biased(bias2: &Estimate) -> Answer {
    match bias2.ci95 {
        Some([low, _]) if low > 0.5 * bias2.value && bias2.value > 0.0 => Answer::Yes,
        Some([low, _]) if low <= 0.0 => Answer::No,
        _ => Answer::CannotTell,
    }
}

/// What is known of one sampler in one scene between two counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Course {
    /// RMSE at the higher count over RMSE at the lower one.
    pub rmse_ratio: Estimate,
    /// What independent samples make of it: √(lower/higher).
    pub independent: f64,
    /// bias² at the higher count.
    pub bias2: Estimate,
    /// bias² at the higher count over bias² at the lower one; `None` where one of them is not above 0.
    pub bias2_ratio: Option<Estimate>,
    /// Variance at the higher count over that at the lower one; `None` where nothing is random or one is not above 0.
    pub variance_ratio: Option<Estimate>,
}

impl Course {
    /// The border between falling and staying: half-way, on a logarithmic scale, between independent samples and no gain.
    pub fn border(&self) -> f64 {
        self.independent.sqrt()
    }

    /// Whether there is a bias at the higher count, by [`is_biased`].
    pub fn is_biased(&self) -> Answer {
        is_biased(&self.bias2)
    }

    /// Where the error goes.
    ///
    /// *Falls*: the RMSE's ratio lies below [`border`](Self::border) with its whole interval. *Wrong*: it lies above, there
    /// is a bias, and the ratio of bias² lies above the same border, squared, that of the variance below it, or nothing is
    /// random. *Stalls and is biased*: the same, but the variance's ratio lies above, too: there is no image that all
    /// replicates converge to. *Stalls*: the RMSE's lies above and no bias is seen. All else is unclear.
    pub fn limit(&self) -> Limit {
        let border2 = self.border() * self.border();
        let bias_stays = self.bias2_ratio.map_or(Answer::CannotTell, |ratio| above(&ratio, border2));
        let variance_falls = self.variance_ratio.map_or(Answer::Yes, |ratio| below(&ratio, border2));
        match (below(&self.rmse_ratio, self.border()), self.is_biased(), bias_stays) {
            (Answer::Yes, ..) => Limit::Falls,
            (Answer::No, Answer::Yes, Answer::Yes) => match variance_falls {
                Answer::Yes => Limit::Wrong,
                Answer::No => Limit::StallsBiased,
                Answer::CannotTell => Limit::Unclear,
            },
            (Answer::No, Answer::No, _) => Limit::Stalls,
            _ => Limit::Unclear,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn e(value: f64, low: f64, high: f64) -> Estimate {
        Estimate { value, ci95: Some([low, high]) }
    }

    #[test]
    fn an_interval_answers_only_with_all_of_itself() {
        assert_eq!(below(&e(1.0, 0.5, 1.5), 2.0), Answer::Yes);
        assert_eq!(below(&e(1.0, 0.5, 1.5), 1.2), Answer::CannotTell);
        assert_eq!(below(&e(1.0, 0.5, 1.5), 0.5), Answer::No);
        assert_eq!(above(&e(1.0, 0.5, 1.5), 0.4), Answer::Yes);
        assert_eq!(above(&e(1.0, 0.5, 1.5), 1.5), Answer::No);
        assert_eq!(above(&Estimate::without_interval(1.0), 0.0), Answer::CannotTell);
    }

    #[test]
    fn a_ratio_s_interval_adds_distances_in_squares() {
        // Both a factor e wide to either side: e^±√2 about the ratio.
        let wide = |v: f64| e(v, v / std::f64::consts::E, v * std::f64::consts::E);
        let r = ratio(&wide(6.0), &wide(2.0)).unwrap();
        let [low, high] = r.ci95.unwrap();
        let factor = libm::exp(std::f64::consts::SQRT_2);
        assert!(
            (r.value - 3.0).abs() < 1e-15 && (low - 3.0 / factor).abs() < 1e-12 && (high - 3.0 * factor).abs() < 1e-12
        );
        // One exact number leaves the other's interval as it is.
        let [low, high] = ratio(&wide(6.0), &e(2.0, 2.0, 2.0)).unwrap().ci95.unwrap();
        assert!((low - 3.0 / std::f64::consts::E).abs() < 1e-12 && (high - 3.0 * std::f64::consts::E).abs() < 1e-12);
    }

    /// What both of a pair share cancels: pairs 1 % apart, each pair at a level of its own, where unpaired intervals are wide.
    #[test]
    fn pairs_are_compared_without_what_they_share() {
        let b = [1.0, 4.0, 2.0, 8.0, 5.0];
        let a = b.map(|x| 1.01 * x);
        let paired = paired_ratio(&a, &b).unwrap();
        assert!((paired.value - 1.01).abs() < 1e-15 && paired.ci95.unwrap().iter().all(|e| (e - 1.01).abs() < 1e-14));
        assert_eq!(paired_ratio(&b, &b), Some(e(1.0, 1.0, 1.0)));
        assert_eq!(paired_ratio_of_roots(&b.map(|x| 4.0 * x), &b), Some(e(2.0, 2.0, 2.0)));
        assert_eq!(paired_ratio(&[2.0], &[1.0]), Some(Estimate::without_interval(2.0)));
        for (a, b) in
            [(&[1.0, 2.0][..], &[1.0][..]), (&[], &[]), (&[1.0, -2.0], &[1.0, 1.0]), (&[1.0, 2.0], &[0.0, 1.0])]
        {
            assert_eq!(paired_ratio(a, b), None, "{a:?} {b:?}");
        }
    }

    /// As below for unpaired ones: at 92 to 99 %.
    #[test]
    fn paired_ratios_hold_the_truth_at_their_rate() {
        let mut state = 11u64;
        let mut unit = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 + 0.5) / 9_007_199_254_740_992.0
        };
        let mut hits = 0;
        for _ in 0..400 {
            let mut mean = || 0.5 + (0..12).map(|_| unit()).sum::<f64>() / 12.0;
            let b: Vec<f64> = (0..8).map(|_| mean()).collect();
            let a: Vec<f64> = b.iter().map(|shared| 1.5 * (shared + mean())).collect();
            let [low, high] = paired_ratio(&a, &b).unwrap().ci95.unwrap();
            hits += i32::from(low <= 3.0 && 3.0 <= high);
        }
        assert!((368..=398).contains(&hits), "{hits} of 400");
    }

    #[test]
    fn a_ratio_opens_where_an_end_reaches_nothing() {
        assert_eq!(ratio(&e(1.0, -0.5, 2.0), &e(1.0, 1.0, 1.0)).unwrap().ci95, Some([0.0, 2.0]));
        assert_eq!(ratio(&e(1.0, 1.0, 1.0), &e(1.0, 0.0, 2.0)).unwrap().ci95.unwrap()[1], f64::INFINITY);
        assert_eq!(ratio(&e(-1.0, -2.0, 2.0), &e(1.0, 0.5, 2.0)), None);
        assert_eq!(ratio(&Estimate::without_interval(1.0), &e(1.0, 0.5, 2.0)).unwrap().ci95, None);
    }

    /// Ratios of mean squares of eight normal numbers: 95 % intervals hold the truth in 400 trials at 92 to 99 % (a
    /// standard error is 1.1 %; Student's interval of a mean of few squares is itself a little off 95 %).
    #[test]
    fn ratios_of_means_hold_the_truth_at_their_rate() {
        use crate::stats::t_interval;
        let mut state = 7u64;
        let mut unit = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 + 0.5) / 9_007_199_254_740_992.0
        };
        // A replicate's MSE is a mean over many pixels: here twelve uniform numbers about 1.
        let mut replicate = |scale: f64| scale * (0.5 + (0..12).map(|_| unit()).sum::<f64>() / 12.0);
        let mut hits = 0;
        for _ in 0..400 {
            let a: Vec<f64> = (0..8).map(|_| replicate(3.0)).collect();
            let b: Vec<f64> = (0..8).map(|_| replicate(1.0)).collect();
            let [low, high] = ratio(&t_interval(&a, 0.95), &t_interval(&b, 0.95)).unwrap().ci95.unwrap();
            hits += i32::from(low <= 3.0 && 3.0 <= high);
        }
        assert!((368..=398).contains(&hits), "{hits} of 400");
    }

    #[test]
    fn between_two_points_lies_a_straight_line_of_logarithms() {
        let e = |value: f64| Estimate { value, ci95: Some([0.5 * value, 2.0 * value]) };
        let points = [(1.0, e(1e-2)), (4.0, e(1e-4)), (16.0, e(1e-6))];
        let at = interpolated(&points, 2.0).unwrap();
        assert!((at.value - 1e-3).abs() < 1e-15 && (at.ci95.unwrap()[1] - 2e-3).abs() < 1e-15);
        assert_eq!(interpolated(&points, 20.0), None);
        assert_eq!(interpolated(&[], 1.0), None);
    }

    #[test]
    fn a_ratio_is_clearly_above_one_only_at_twice_its_interval() {
        assert!(clearly_above_one(&e(1.44, 1.25, 1.6)) && !clearly_above_one(&e(1.44, 1.15, 1.7)));
        assert!(!clearly_above_one(&e(0.9, 0.95, 1.0)) && !clearly_above_one(&Estimate::without_interval(2.0)));
    }

    #[test]
    fn better_and_worse_are_called_by_one_rule_and_never_of_a_hundredth() {
        assert!(!clearly_above_one(&e(1.005, 1.005, 1.005)) && clearly_above_one(&e(1.02, 1.02, 1.02)));
        assert!(!clearly_below_one(&e(0.995, 0.995, 0.995)) && clearly_below_one(&e(0.98, 0.98, 0.98)));
        assert!(clearly_below_one(&e(0.64, 0.5, 0.79)) && !clearly_below_one(&e(0.64, 0.5, 0.9)));
        assert!(!clearly_below_one(&Estimate::without_interval(0.5)));
    }

    #[test]
    fn a_bias_is_called_only_at_twice_its_interval() {
        assert_eq!(is_biased(&e(1.0, 0.6, 1.4)), Answer::Yes);
        assert_eq!(is_biased(&e(1.0, 0.4, 1.6)), Answer::CannotTell);
        assert_eq!(is_biased(&e(1.0, -0.1, 2.1)), Answer::No);
        assert_eq!(is_biased(&e(-1.0, -1.5, -0.5)), Answer::No);
        assert_eq!(is_biased(&Estimate::without_interval(1.0)), Answer::CannotTell);
        assert_eq!(is_biased(&e(1.0, 1.0, 1.0)), Answer::Yes);
    }

    #[test]
    fn the_course_of_an_error_is_named_by_its_numbers() {
        let course = |rmse_ratio, bias2: Estimate, before: Estimate| {
            let bias2_ratio = ratio(&bias2, &before);
            Course { rmse_ratio, independent: 0.25, bias2, bias2_ratio, variance_ratio: None }
        };
        let with_variance = |course: Course, variance| Course { variance_ratio: Some(variance), ..course }.limit();
        let (flat, falling, torn) = (e(0.95, 0.9, 1.0), e(0.26, 0.24, 0.28), e(0.5, 0.4, 0.6));
        let (biased, unbiased) = (e(1e-3, 9e-4, 1.1e-3), e(1e-5, -1e-5, 3e-5));
        assert_eq!(course(flat, biased, biased).limit(), Limit::Wrong, "nothing random");
        let both = course(flat, biased, biased);
        assert_eq!(with_variance(both, e(0.07, 0.06, 0.08)), Limit::Wrong);
        assert_eq!(with_variance(both, e(0.75, 0.7, 0.8)), Limit::StallsBiased, "it converges to no image");
        assert_eq!(with_variance(both, e(0.25, 0.2, 0.3)), Limit::Unclear);
        assert_eq!(course(flat, unbiased, unbiased).limit(), Limit::Stalls);
        assert_eq!(course(flat, biased, e(1e-1, 9e-2, 1.1e-1)).limit(), Limit::Unclear, "its bias falls");
        assert_eq!(course(falling, biased, biased).limit(), Limit::Falls);
        assert_eq!(course(torn, biased, biased).limit(), Limit::Unclear);
        assert_eq!(course(flat, Estimate::without_interval(1e-3), biased).limit(), Limit::Unclear);
        assert_eq!(course(Estimate::without_interval(0.9), biased, biased).limit(), Limit::Unclear);
    }
}

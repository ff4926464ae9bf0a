//! Verdicts on stability: a sample more or less, the spread of replicates, other units of length, two passes.
//!
//! Every verdict on a ratio of errors rests on its interval *stretched*: widened on a logarithmic scale so far that all
//! comparisons of the section together call a difference that is not there with a chance of at most 5 % (Bonferroni).

use crate::experiment::results::{TwinDifference, Variant};
use crate::stats::moments::student_t_quantile;
use crate::stats::{Estimate, Moments};

use super::evidence::{paired_ratio_of_roots, ratio, ratio_of_roots};
use super::provenance;
use super::summarise::{Cell, Subject, Summary};
use super::tables::{estimate_fields, quoted};

/// Chance that any comparison of the section calls a difference that is not there.
pub const FALSE_ALARM: f64 = 0.05;

/// An error that is less than this much larger than promised is not called worse.
pub const LEAST: f64 = 1.01;

/// An error is called stable if it is at most this much larger than promised.
pub const MARGIN: f64 = 1.1;

/// A spread is narrow where the worst replicate's RMSE is at most this much larger than the median, wide where it is more.
pub const WIDE: f64 = 1.25;

/// Images differ by roundings alone if in at most this share of their pixels a ray was moved across an edge…
pub const JUMPING: f64 = 0.01;

/// … and if they differ by a root mean square of at most this share of their RMSE, so that the RMSE cannot differ by more either
/// (triangle inequality).
pub const ROUNDING: f64 = 0.1;

/// What a ratio of errors says, over what is promised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// At most [`MARGIN`] with the whole stretched interval.
    Stable,
    /// Above [`LEAST`] with the whole stretched interval.
    Worse,
    /// The stretched interval holds both, or there is none.
    CannotTell,
}

impl Verdict {
    /// The word for it in tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Stable => "stable",
            Self::Worse => "worse",
            Self::CannotTell => "cannot tell",
        }
    }
}

/// One RMSE against the base's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Against {
    /// RMSE over the base's.
    pub ratio: Estimate,
    /// What the sampler itself promises of that ratio.
    pub promised: Estimate,
    /// The one over the other.
    pub excess: Estimate,
}

/// The section's comparisons, and how far their intervals are stretched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// How many ratios are judged.
    pub comparisons: usize,
    /// Factor of an interval's width.
    pub factor: f64,
}

impl Stretch {
    /// For all comparisons of a summary: Student's factor at R − 1 degrees of freedom (intervals of the reference's noise
    /// alone have more, so they are stretched too far rather than too little).
    pub fn of(summary: &Summary) -> Self {
        let judged = |subject: &Subject| {
            let passes = subject.remade.iter().filter(|(variant, _)| *variant == Variant::TwoPasses).count();
            subject.counts.len() + passes
        };
        let comparisons: usize = summary.stability.iter().map(judged).sum();
        let freedom = f64::from(summary.about.experiment.replicates.max(2) - 1);
        let quantile = |two_sided: f64| student_t_quantile(1.0 - two_sided / 2.0, freedom);
        let factor = quantile(FALSE_ALARM / comparisons.max(1) as f64) / quantile(0.05);
        Self { comparisons, factor }
    }

    /// The interval, stretched about its value on a logarithmic scale.
    fn ends(&self, ratio: &Estimate) -> Option<[f64; 2]> {
        ratio.ci95.map(|ends| ends.map(|end| ratio.value * libm::pow(end / ratio.value, self.factor)))
    }

    /// What the excess of an error says.
    pub fn judge(&self, excess: &Estimate) -> Verdict {
        match self.ends(excess) {
            Some([low, _]) if low > LEAST => Verdict::Worse,
            Some([_, high]) if high <= MARGIN => Verdict::Stable,
            _ => Verdict::CannotTell,
        }
    }
}

/// What `taken` samples promise of the RMSE over that of the subject's base: its own slope's power of the counts, 1/√ where no
/// slope could be fitted; a single sample more than the base promises no harm.
pub fn promised(summary: &Summary, subject: &Subject, cell: &Cell) -> Estimate {
    if cell.spp.asked == subject.base.spp.asked + 1 {
        return exactly(1.0);
    }
    let counts = f64::from(cell.spp.taken) / f64::from(subject.base.spp.taken);
    let fit = summary.slope(subject.scene, subject.sampler).and_then(|slope| slope.fit.as_ref());
    let Some(fit) = fit else { return exactly(libm::pow(counts, -0.5)) };
    let at = |slope: f64| libm::pow(counts, slope);
    let ci95 = fit.ci95.map(|[low, high]| {
        let (a, b) = (at(low), at(high));
        [a.min(b), a.max(b)]
    });
    // A line through two points has no interval: nothing can be told by what it promises.
    Estimate { value: at(fit.slope), ci95 }
}

fn exactly(value: f64) -> Estimate {
    Estimate { value, ci95: Some([value; 2]) }
}

/// Another count against the base. The two are independent images.
pub fn count_against(summary: &Summary, subject: &Subject, cell: &Cell) -> Option<Against> {
    let promised = promised(summary, subject, cell);
    let ratio_of_errors = ratio_of_roots(&cell.mse, &subject.base.mse)?;
    Some(Against { ratio: ratio_of_errors, promised, excess: ratio(&ratio_of_errors, &promised)? })
}

/// Two passes against one, replicate by replicate; what is promised is that only the samples taken count.
pub fn passes_against(summary: &Summary, subject: &Subject, cell: &Cell) -> Option<Against> {
    let promised = promised(summary, subject, cell);
    let ratio_of_errors = remade_ratio(&subject.base, cell)?;
    Some(Against { ratio: ratio_of_errors, promised, excess: ratio(&ratio_of_errors, &promised)? })
}

/// RMSE of the remade images over that of the plain ones, paired where there are pairs.
pub fn remade_ratio(base: &Cell, cell: &Cell) -> Option<Estimate> {
    if base.replicates > 1 && base.replicate_mse.len() == base.replicates as usize {
        return paired_ratio_of_roots(&cell.replicate_mse, &base.replicate_mse);
    }
    ratio_of_roots(&cell.mse, &base.mse)
}

/// What another unit of length does to the images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ScaleVerdict {
    /// Nothing, in any bit of any replicate.
    Same,
    /// Roundings: see [`JUMPING`] and [`ROUNDING`].
    Unchanged,
    /// More than that, in one replicate at least.
    Changed,
    /// The error that the difference is held against is below the reference's noise, or rows are missing.
    CannotTell,
}

impl ScaleVerdict {
    /// The word for it in tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Same => "bit for bit the same",
            Self::Unchanged => "unchanged beyond rounding",
            Self::Changed => "changed",
            Self::CannotTell => "cannot tell",
        }
    }
}

/// Differences of all replicates from their twins, the worst of each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Differences {
    /// Share of the pixels that differ in any bit.
    pub differing: f64,
    /// Share of the pixels that jump, see [`JUMP`](crate::experiment::results::JUMP).
    pub jumping: f64,
    /// Largest difference of a pixel-channel over the mean radiance.
    pub largest: f64,
    /// Root mean square difference over the base's RMSE; `None` where that is not above 0.
    pub rms: Option<f64>,
    /// How many replicates are the same bit for bit.
    pub same: usize,
}

/// The worst of the differences; `None` where there are none to tell of.
pub fn differences(base: &Cell, twins: &[TwinDifference]) -> Option<Differences> {
    let worst = |of: &dyn Fn(&TwinDifference) -> f64| twins.iter().map(of).fold(0.0, f64::max);
    let mean = base.replicate_mean.iter().copied().collect::<Moments>().mean()?;
    (!twins.is_empty()).then(|| Differences {
        differing: worst(&|twin| twin.differing),
        jumping: worst(&|twin| twin.jumping),
        largest: worst(&|twin| twin.largest) / mean,
        rms: base.rmse.filter(|rmse| rmse.value > 0.0).map(|rmse| worst(&|twin| twin.rms) / rmse.value),
        same: twins.iter().filter(|twin| twin.differing == 0.0).count(),
    })
}

/// What the differences of a scaled scene say.
pub fn scale_verdict(base: &Cell, cell: &Cell) -> ScaleVerdict {
    let Some(d) = differences(base, &cell.twins).filter(|_| cell.twins.len() == cell.replicates as usize) else {
        return ScaleVerdict::CannotTell;
    };
    match d.rms {
        _ if d.differing == 0.0 => ScaleVerdict::Same,
        Some(rms) if rms <= ROUNDING && d.jumping <= JUMPING => ScaleVerdict::Unchanged,
        Some(_) => ScaleVerdict::Changed,
        None => ScaleVerdict::CannotTell,
    }
}

/// What the replicates' spread says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SpreadVerdict {
    /// The worst is at most [`WIDE`] times the best, which bounds the median from below.
    Narrow,
    /// The worst is more than [`WIDE`] times an upper end of the median's interval.
    Wide,
    /// The order statistics allow both.
    CannotTell,
}

/// RMSE of the replicates of one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Middle value, or the mean of the two in the middle.
    pub median: f64,
    /// Largest value over the median.
    pub worst: f64,
    /// Smallest value over the median.
    pub best: f64,
    /// The verdict.
    pub verdict: SpreadVerdict,
}

/// Spread of the replicates; `None` with fewer than two, or where one is below the reference's noise.
pub fn spread(cell: &Cell) -> Option<Spread> {
    let mut rmse: Vec<f64> = cell.replicate_mse.iter().map(|mse| mse.sqrt()).collect();
    if rmse.len() < 2 || !rmse.iter().all(|&value| value > 0.0) {
        return None;
    }
    rmse.sort_by(f64::total_cmp);
    let last = rmse.len() - 1;
    let median = (rmse[last / 2] + rmse[rmse.len() / 2]) / 2.0;
    let (best, worst) = (rmse[0], rmse[last]);
    let upper = median_is_below(rmse.len()).map(|rank| rmse[rank - 1]);
    let verdict = match upper {
        _ if worst <= WIDE * best => SpreadVerdict::Narrow,
        Some(upper) if worst > WIDE * upper => SpreadVerdict::Wide,
        _ => SpreadVerdict::CannotTell,
    };
    Some(Spread { median, worst: worst / median, best: best / median, verdict })
}

/// The lowest rank (from 1) among `n` values that the median of their distribution exceeds with a chance of at most 5 %:
/// it does so where at least that many values fall below the median, each with a chance of ½. `None` below 5 values.
fn median_is_below(n: usize) -> Option<usize> {
    let (mut tail, mut rank) = (0.0, None);
    // ln P(k of n), from all n below the median downwards; in logarithms, as 2⁻ⁿ leaves the range of floats.
    let mut log_share = -(n as f64) * std::f64::consts::LN_2;
    for k in (1..=n).rev() {
        tail += libm::exp(log_share);
        if tail > 0.05 {
            break;
        }
        rank = Some(k);
        log_share += libm::log(k as f64 / (n - k + 1) as f64);
    }
    rank
}

/// `stability.csv`: one line a scene, sampler and comparison with the base, below one line of provenance. Intervals are 95 %
/// ones, not stretched; empty fields stand for what cannot be had or does not apply.
pub fn csv(summary: &Summary) -> String {
    let mut text = format!("# {}\n", provenance::line(&summary.about));
    text += "scene,sampler,stands_for,variant,row,base_row,spp_asked,spp_taken,rmse_ratio,rmse_ratio_low,rmse_ratio_high,promised,promised_low,promised_high,\
             pixels_that_differ,pixels_that_jump,largest_difference_over_mean,rms_difference_over_rmse,verdict\n";
    let stretch = Stretch::of(summary);
    for subject in &summary.stability {
        for cell in &subject.counts {
            let against = count_against(summary, subject, cell);
            let verdict = against.map_or(Verdict::CannotTell, |against| stretch.judge(&against.excess)).word();
            let numbers = (against.map(|against| against.ratio), against.map(|against| against.promised));
            text += &csv_line(summary, subject, cell, Variant::Plain, numbers, verdict);
        }
        for (variant, cell) in &subject.remade {
            let (numbers, verdict) = match variant {
                Variant::TwoPasses => {
                    let against = passes_against(summary, subject, cell);
                    let verdict = against.map_or(Verdict::CannotTell, |against| stretch.judge(&against.excess)).word();
                    ((against.map(|against| against.ratio), against.map(|against| against.promised)), verdict)
                }
                _ => ((remade_ratio(&subject.base, cell), None), scale_verdict(&subject.base, cell).word()),
            };
            text += &csv_line(summary, subject, cell, *variant, numbers, verdict);
        }
    }
    text
}

fn csv_line(
    summary: &Summary,
    subject: &Subject,
    cell: &Cell,
    variant: Variant,
    (ratio, promised): (Option<Estimate>, Option<Estimate>),
    verdict: &str,
) -> String {
    let (scene, sampler) = (&summary.scenes[subject.scene], &summary.samplers[subject.sampler]);
    let mut line = [
        quoted(&scene.name),
        quoted(&sampler.names.join(" = ")),
        quoted(&sampler.canonical),
        variant.to_string(),
        cell.id.clone(),
        subject.base.id.clone(),
        cell.spp.asked.to_string(),
        cell.spp.taken.to_string(),
    ]
    .join(",");
    line += &estimate_fields(ratio.map(six_digits));
    line += &estimate_fields(promised.map(six_digits));
    let d = differences(&subject.base, &cell.twins);
    for number in [d.map(|d| d.differing), d.map(|d| d.jumping), d.map(|d| d.largest), d.and_then(|d| d.rms)] {
        line += &format!(",{}", number.map(|number| number.to_string()).unwrap_or_default());
    }
    format!("{line},{verdict}\n")
}

/// An interval's ends to six digits, as all of them are written.
fn six_digits(e: Estimate) -> Estimate {
    let round = |x: f64| format!("{x:.5e}").parse().unwrap_or(x);
    Estimate { ci95: e.ci95.map(|ends| ends.map(round)), ..e }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn e(value: f64, low: f64, high: f64) -> Estimate {
        Estimate { value, ci95: Some([low, high]) }
    }

    #[test]
    fn a_verdict_asks_for_the_stretched_interval() {
        let plain = Stretch { comparisons: 1, factor: 1.0 };
        let wide = Stretch { comparisons: 100, factor: 3.0 };
        assert_eq!(plain.judge(&e(1.2, 1.1, 1.3)), Verdict::Worse);
        assert_eq!(wide.judge(&e(1.2, 1.1, 1.3)), Verdict::CannotTell);
        assert_eq!(wide.judge(&e(1.2, 1.15, 1.3)), Verdict::Worse);
        assert_eq!(plain.judge(&e(1.0, 0.95, 1.06)), Verdict::Stable);
        assert_eq!(wide.judge(&e(1.0, 0.95, 1.06)), Verdict::CannotTell);
        assert_eq!(wide.judge(&e(0.7, 0.6, 0.8)), Verdict::Stable, "better is not unstable");
        assert_eq!(wide.judge(&e(1.005, 1.005, 1.005)), Verdict::Stable, "exact, and less than a word is worth");
        assert_eq!(wide.judge(&e(1.02, 1.02, 1.02)), Verdict::Worse, "exact");
        assert_eq!(wide.judge(&Estimate::without_interval(2.0)), Verdict::CannotTell);
    }

    /// P(at least 7 of 8 below the median) = 9/256 = 3.5 %; of 5 all: 1/32; of 4 all: 1/16, too much.
    #[test]
    fn the_median_s_upper_ends_are_those_of_the_binomial_distribution() {
        assert_eq!(
            (1..=8).map(median_is_below).collect::<Vec<_>>(),
            [None, None, None, None, Some(5), Some(6), Some(7), Some(7)]
        );
        // P(Bin(20, ½) ≥ 15) = 2.07 %, ≥ 14 is 5.77 %; for many, n/2 + 1.645 √n/2 by the normal law.
        assert_eq!(median_is_below(20), Some(15));
        assert!(median_is_below(10_000).is_some_and(|rank| rank.abs_diff(5083) <= 1));
    }
}

//! Verdicts on stability: a sample more or less, the spread of replicates, other units of length, two passes.
//!
//! Every verdict on a ratio of errors rests on its interval *stretched*: widened on a logarithmic scale so far that all
//! comparisons of the section together call a difference that is not there with a chance of at most 5 % (Bonferroni).

use crate::experiment::results::{TwinDifference, Variant};
use crate::stats::hypothesis::chi2_upper_tail;
use crate::stats::moments::student_t_quantile;
use crate::stats::{Estimate, IntervalKind, Moments};

use super::evidence::{Answer, above, paired_ratio_of_roots, ratio, ratio_of_roots};
use super::provenance;
use super::summarise::{Cell, Subject, Summary};
use super::tables::{estimate_fields, quoted};

/// Chance that any comparison of the section calls a difference that is not there.
pub const FALSE_ALARM: f64 = 0.05;

/// An error that is less than this much larger than promised is not called worse.
pub const LEAST: f64 = 1.01;

/// An error is called stable if it is at most this much larger than promised.
pub const MARGIN: f64 = 1.1;

/// A spread is wide where the coefficient of variation of the replicates' RMSE is more than this.
pub const WIDE: f64 = 0.1;

/// Images differ by roundings alone if in at most this share of their pixels a ray was moved across an edge…
pub const JUMPING: f64 = 0.01;

/// … and if they differ by a root mean square of at most this share of the mean radiance, whatever the sampler's own noise: what
/// comes of [`JUMPING`] of the pixels if each jumps by a fifth of the mean.
pub const ROUNDING: f64 = 0.02;

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
    /// What is promised of that ratio.
    pub promised: Estimate,
    /// The one over the other.
    pub excess: Estimate,
    /// Degrees of freedom of the excess' interval: the least of what it is made of.
    pub freedom: f64,
}

/// The section's comparisons, and how far their intervals are stretched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// How many ratios are judged.
    pub comparisons: usize,
    /// Degrees of freedom of replicates: R − 1.
    pub freedom: f64,
}

impl Stretch {
    /// For all comparisons of a summary.
    pub fn of(summary: &Summary) -> Self {
        let judged = |subject: &Subject| {
            let passes = subject.remade.iter().filter(|(variant, _)| *variant == Variant::TwoPasses).count();
            subject.counts.len() + passes
        };
        let comparisons = summary.stability.iter().map(judged).sum();
        Self { comparisons, freedom: replicates_freedom(summary) }
    }

    /// Factor of the width of a 95 % interval: Student's quantile at [`FALSE_ALARM`] shared by the comparisons over that at
    /// 5 %, both at the interval's degrees of freedom.
    pub fn factor(&self, freedom: f64) -> f64 {
        let quantile = |two_sided: f64| student_t_quantile(1.0 - two_sided / 2.0, freedom);
        quantile(FALSE_ALARM / self.comparisons.max(1) as f64) / quantile(0.05)
    }

    /// The excess with its interval stretched about its value on a logarithmic scale: what a verdict rests on.
    pub fn stretched(&self, against: &Against) -> Estimate {
        let (excess, factor) = (against.excess, self.factor(against.freedom));
        let stretched = |end: f64| match end == excess.value {
            true => end,
            false => excess.value * libm::pow(end / excess.value, factor),
        };
        Estimate { value: excess.value, ci95: excess.ci95.map(|ends| ends.map(stretched)) }
    }

    /// What the excess of an error says.
    pub fn judge(&self, against: &Against) -> Verdict {
        match self.stretched(against).ci95 {
            Some([low, _]) if low > LEAST => Verdict::Worse,
            Some([_, high]) if high <= MARGIN => Verdict::Stable,
            _ => Verdict::CannotTell,
        }
    }
}

/// R − 1. Intervals of the reference's noise alone, where nothing is random, have more: they are stretched too far rather than
/// too little.
fn replicates_freedom(summary: &Summary) -> f64 {
    f64::from(summary.about.experiment.replicates.max(2) - 1)
}

/// What a promise rests on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Promise<'a> {
    /// The base itself: as many samples taken.
    Same,
    /// A straight line of logarithms between two measured counts, and the share of the way from the first to the second.
    Neighbours(&'a Cell, &'a Cell, f64),
    /// A sample more than the base does no harm; no larger count was measured.
    NoHarm,
    /// The sampler's own slope, 1/√ where none was fitted; the count lies outside the measured ones.
    Slope,
}

/// What is promised of `cell`: by its neighbours, the nearest powers of two that were compared (and the base), where it lies
/// between two of them.
pub fn promise<'a>(summary: &'a Summary, subject: &'a Subject, cell: &Cell) -> Promise<'a> {
    let taken = cell.spp.taken;
    if taken == subject.base.spp.taken {
        return Promise::Same;
    }
    let known = summary.cells_of(subject.scene, subject.sampler).into_iter();
    let known = known.filter(|known| known.spp.taken.is_power_of_two() && known.spp.taken == known.spp.asked);
    let mut known: Vec<&Cell> = known.chain([&subject.base]).filter(|known| known.id != cell.id).collect();
    known.sort_by_key(|known| known.spp.taken);
    let below = known.iter().rfind(|known| known.spp.taken <= taken);
    let above = known.iter().find(|known| known.spp.taken >= taken);
    match (below, above) {
        (Some(a), Some(b)) => {
            let [low, at, high] = [a.spp.taken, taken, b.spp.taken].map(|n| libm::log(f64::from(n)));
            Promise::Neighbours(a, b, if low < high { (at - low) / (high - low) } else { 0.0 })
        }
        _ if cell.spp.asked == subject.base.spp.asked + 1 => Promise::NoHarm,
        _ => Promise::Slope,
    }
}

/// The promised RMSE over the base's, with its degrees of freedom. `None` where a neighbour's error is below the noise.
fn promised(summary: &Summary, subject: &Subject, cell: &Cell) -> Option<(Estimate, f64)> {
    let freedom = replicates_freedom(summary);
    match promise(summary, subject, cell) {
        Promise::Same | Promise::NoHarm => Some((exactly(1.0), freedom)),
        Promise::Neighbours(a, b, share) => {
            Some((power_product(&[(a, 1.0 - share), (b, share), (&subject.base, -1.0)])?, freedom))
        }
        Promise::Slope => Some(by_slope(summary, subject, cell, freedom)),
    }
}

/// The own slope's power of the counts. A line through one image a count has its scatter's degrees of freedom, two fewer than
/// points.
fn by_slope(summary: &Summary, subject: &Subject, cell: &Cell, freedom: f64) -> (Estimate, f64) {
    let counts = f64::from(cell.spp.taken) / f64::from(subject.base.spp.taken);
    let fit = summary.slope(subject.scene, subject.sampler).and_then(|slope| slope.fit.as_ref());
    let Some(fit) = fit else { return (exactly(libm::pow(counts, -0.5)), freedom) };
    let at = |slope: f64| libm::pow(counts, slope);
    let ci95 = fit.ci95.map(|[low, high]| {
        let (a, b) = (at(low), at(high));
        [a.min(b), a.max(b)]
    });
    let freedom = match fit.interval {
        IntervalKind::Residuals => freedom.min((fit.points as f64 - 2.0).max(1.0)),
        _ => freedom,
    };
    // A line through two points has no interval: nothing can be told by what it promises.
    (Estimate { value: at(fit.slope), ci95 }, freedom)
}

fn exactly(value: f64) -> Estimate {
    Estimate { value, ci95: Some([value; 2]) }
}

/// Π RMSEᵢ^kᵢ of independent cells, with the interval that theirs give on logarithms ("MOVER", as of [`ratio`]): distances of
/// value and end, times |kᵢ|, add in squares, an end changing sides where kᵢ < 0. A cell that occurs more than once counts
/// once, with the sum of its exponents: it has one noise.
///
/// `None` where an MSE is not above 0; no interval where one has none.
fn power_product(factors: &[(&Cell, f64)]) -> Option<Estimate> {
    let mut merged: Vec<(&Cell, f64)> = Vec::new();
    for (cell, exponent) in factors {
        match merged.iter_mut().find(|(other, _)| other.id == cell.id) {
            Some((_, sum)) => *sum += exponent,
            None => merged.push((cell, *exponent)),
        }
    }
    let (mut log, mut squares) = (0.0, Some([0.0, 0.0]));
    for (cell, exponent) in merged.into_iter().filter(|(_, exponent)| *exponent != 0.0) {
        let mse = cell.mse;
        if mse.value <= 0.0 || !mse.value.is_finite() {
            return None;
        }
        let half = exponent / 2.0;
        log += half * libm::log(mse.value);
        let distance = |a: f64, b: f64| if b > 0.0 { libm::log(a / b).max(0.0) } else { f64::INFINITY };
        squares = squares.zip(mse.ci95).map(|([down, up], [low, high])| {
            let (to_low, to_high) = (half * distance(mse.value, low), half * distance(high, mse.value));
            let [to_low, to_high] = if half < 0.0 { [to_high, to_low] } else { [to_low, to_high] };
            [down + to_low * to_low, up + to_high * to_high]
        });
    }
    let value = libm::exp(log);
    let ci95 = squares.map(|[down, up]: [f64; 2]| [value * libm::exp(-down.sqrt()), value * libm::exp(up.sqrt())]);
    Some(Estimate { value, ci95 })
}

/// Another count against the base. Counts are independent of each other; what ratio and promise share (the base) is counted once.
pub fn count_against(summary: &Summary, subject: &Subject, cell: &Cell) -> Option<Against> {
    let (promised, freedom) = promised(summary, subject, cell)?;
    let ratio_of_errors = ratio_of_roots(&cell.mse, &subject.base.mse)?;
    let excess = match promise(summary, subject, cell) {
        Promise::Neighbours(a, b, share) => power_product(&[(cell, 1.0), (a, share - 1.0), (b, -share)])?,
        _ => ratio(&ratio_of_errors, &promised)?,
    };
    Some(Against { ratio: ratio_of_errors, promised, excess, freedom })
}

/// Two passes against one, replicate by replicate; what is promised is that only the samples taken count.
pub fn passes_against(summary: &Summary, subject: &Subject, cell: &Cell) -> Option<Against> {
    let (promised, freedom) = promised(summary, subject, cell)?;
    let ratio_of_errors = remade_ratio(&subject.base, cell)?;
    Some(Against { ratio: ratio_of_errors, promised, excess: ratio(&ratio_of_errors, &promised)?, freedom })
}

/// RMSE of the remade images over that of the plain ones, paired where there are pairs: then the reference's noise, common to
/// both, is not in the interval. Of one image each it is all that the interval holds, and counted twice.
pub fn remade_ratio(base: &Cell, cell: &Cell) -> Option<Estimate> {
    if is_paired(base) {
        return paired_ratio_of_roots(&cell.replicate_mse, &base.replicate_mse);
    }
    ratio_of_roots(&cell.mse, &base.mse)
}

fn is_paired(base: &Cell) -> bool {
    base.replicates > 1 && base.replicate_mse.len() == base.replicates as usize
}

/// [`remade_ratio`] of a scene in another unit of length. One image each has no interval, unless both are exact: the reference's
/// noise is common to the two and cancels.
pub fn scaled_ratio(base: &Cell, cell: &Cell) -> Option<Estimate> {
    let ratio = remade_ratio(base, cell)?;
    let is_exact = ratio.ci95.is_some_and(|[low, high]| low == high);
    Some(if is_paired(base) || is_exact { ratio } else { Estimate::without_interval(ratio.value) })
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
    /// Rows are missing, or the mean radiance is not above 0.
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
    /// Root mean square difference over the mean radiance; `None` where that is not above 0.
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
        rms: (mean > 0.0).then(|| worst(&|twin| twin.rms) / mean),
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
    /// The coefficient of variation is at most [`WIDE`] with the whole interval.
    Narrow,
    /// It is more with the whole interval.
    Wide,
    /// The interval holds both.
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
    /// Standard deviation over mean. Unlike a range, it does not grow with the number of replicates.
    pub variation: Estimate,
    /// The verdict on it.
    pub verdict: SpreadVerdict,
}

/// Spread of the replicates; `None` with fewer than two, or where one is below the reference's noise.
///
/// The interval is that of a normal standard deviation, s √((R − 1)/χ²) at χ²'s 97.5 % and 2.5 % quantiles with R − 1 degrees of
/// freedom; an RMSE over many pixels is nearly normal, and what the mean adds is of the order of the variation squared.
pub fn spread(cell: &Cell) -> Option<Spread> {
    let mut rmse: Vec<f64> = cell.replicate_mse.iter().map(|mse| mse.sqrt()).collect();
    if rmse.len() < 2 || !rmse.iter().all(|&value| value > 0.0) {
        return None;
    }
    rmse.sort_by(f64::total_cmp);
    let last = rmse.len() - 1;
    let median = (rmse[last / 2] + rmse[rmse.len() / 2]) / 2.0;
    let moments: Moments = rmse.iter().copied().collect();
    let value = moments.std()? / moments.mean()?;
    let freedom = last as f64;
    let end = |upper_tail: f64| value * (freedom / chi2_quantile(upper_tail, freedom)).sqrt();
    let variation = Estimate { value, ci95: Some([end(0.025), end(0.975)]) };
    let verdict = match above(&variation, WIDE) {
        Answer::Yes => SpreadVerdict::Wide,
        Answer::No => SpreadVerdict::Narrow,
        Answer::CannotTell => SpreadVerdict::CannotTell,
    };
    Some(Spread { median, worst: rmse[last] / median, best: rmse[0] / median, variation, verdict })
}

/// The x above which χ² with `freedom` degrees of freedom lies with a chance of `upper_tail`, to 1e-12 of itself: the interval
/// from 0 doubled until it holds x, then halved.
fn chi2_quantile(upper_tail: f64, freedom: f64) -> f64 {
    let mut high = freedom.max(1.0);
    while chi2_upper_tail(high, freedom) > upper_tail && high < 1e300 {
        high *= 2.0;
    }
    let mut low = 0.0;
    while high - low > 1e-12 * high {
        let middle = (low + high) / 2.0;
        if middle <= low || middle >= high {
            break;
        }
        if chi2_upper_tail(middle, freedom) > upper_tail { low = middle } else { high = middle }
    }
    high
}

/// `stability.csv`: one line a scene, sampler and comparison with the base, below one line of provenance. Intervals are 95 %
/// ones, that of the excess is stretched; empty fields stand for what cannot be had or does not apply.
pub fn csv(summary: &Summary) -> String {
    let mut text = format!("# {}\n", provenance::line(&summary.about));
    text += "scene,sampler,stands_for,variant,row,base_row,spp_asked,spp_taken,rmse_ratio,rmse_ratio_low,rmse_ratio_high,promised,promised_low,promised_high,\
             excess,excess_low,excess_high,pixels_that_differ,pixels_that_jump,largest_difference_over_mean,rms_difference_over_mean,verdict\n";
    let stretch = Stretch::of(summary);
    for subject in &summary.stability {
        let judged = |against: Option<Against>| {
            let verdict = against.map_or(Verdict::CannotTell, |against| stretch.judge(&against)).word();
            let of = |number: &dyn Fn(&Against) -> Estimate| against.as_ref().map(number);
            ([of(&|a| a.ratio), of(&|a| a.promised), of(&|a| stretch.stretched(a))], verdict)
        };
        for cell in &subject.counts {
            let (numbers, verdict) = judged(count_against(summary, subject, cell));
            text += &csv_line(summary, subject, cell, Variant::Plain, numbers, verdict);
        }
        for (variant, cell) in &subject.remade {
            let (numbers, verdict) = match variant {
                Variant::TwoPasses => judged(passes_against(summary, subject, cell)),
                _ => ([scaled_ratio(&subject.base, cell), None, None], scale_verdict(&subject.base, cell).word()),
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
    numbers: [Option<Estimate>; 3],
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
    for number in numbers {
        line += &estimate_fields(number.map(six_digits));
    }
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

    fn against(excess: Estimate, freedom: f64) -> Against {
        Against { ratio: excess, promised: exactly(1.0), excess, freedom }
    }

    /// Student's quantiles with 7 degrees of freedom: 2.3646 at 97.5 %, 5.4079 at 99.95 % (tables), so a hundred comparisons
    /// stretch by 2.287; with 2, 4.3027 and 31.599, by 7.34.
    #[test]
    fn a_verdict_asks_for_the_interval_stretched_at_its_own_degrees_of_freedom() {
        let (plain, many) = (Stretch { comparisons: 1, freedom: 7.0 }, Stretch { comparisons: 50, freedom: 7.0 });
        assert!((many.factor(7.0) - 5.4079 / 2.3646).abs() < 1e-3, "{}", many.factor(7.0));
        assert!((many.factor(2.0) - 31.599 / 4.3027).abs() < 1e-2, "{}", many.factor(2.0));
        let judge = |stretch: &Stretch, excess, freedom| stretch.judge(&against(excess, freedom));
        assert_eq!(judge(&plain, e(1.2, 1.1, 1.3), 7.0), Verdict::Worse);
        assert_eq!(judge(&many, e(1.2, 1.1, 1.3), 7.0), Verdict::CannotTell);
        assert_eq!(judge(&many, e(1.2, 1.15, 1.3), 7.0), Verdict::Worse);
        assert_eq!(judge(&many, e(1.2, 1.15, 1.3), 2.0), Verdict::CannotTell, "a line through four points");
        assert_eq!(judge(&plain, e(1.0, 0.95, 1.06), 7.0), Verdict::Stable);
        assert_eq!(judge(&many, e(1.0, 0.95, 1.06), 7.0), Verdict::CannotTell);
        assert_eq!(judge(&many, e(0.7, 0.6, 0.8), 7.0), Verdict::Stable, "better is not unstable");
        assert_eq!(judge(&many, e(1.005, 1.005, 1.005), 7.0), Verdict::Stable, "exact, and less than a word is worth");
        assert_eq!(judge(&many, e(1.02, 1.02, 1.02), 7.0), Verdict::Worse, "exact");
        assert_eq!(judge(&many, Estimate::without_interval(2.0), 7.0), Verdict::CannotTell);
        let shown = many.stretched(&against(e(1.2, 1.1, 1.3), 7.0)).ci95.unwrap();
        assert!((shown[0] - 1.2 * libm::pow(1.1 / 1.2, many.factor(7.0))).abs() < 1e-12);
    }

    /// A cell that is found twice has one noise: R³ has three times the relative interval of R, not √5 of it.
    #[test]
    fn in_a_product_of_powers_distances_add_in_squares_and_a_cell_counts_once() {
        let (a, b) = (cell("a", 64, e(4.0, 1.0, 16.0)), cell("b", 16, e(16.0, 16.0, 64.0)));
        let ends = |factors: &[(&Cell, f64)]| power_product(factors).map(|e| (e.value, e.ci95.unwrap()));
        let near = |found: Option<(f64, [f64; 2])>, value: f64, [low, high]: [f64; 2]| {
            let (v, [l, h]) = found.unwrap();
            assert!([(v, value), (l, low), (h, high)].iter().all(|(x, y)| (x / y - 1.0).abs() < 1e-12), "{v} {l} {h}");
        };
        near(ends(&[(&a, 1.0)]), 2.0, [1.0, 4.0]);
        near(ends(&[(&a, 1.0), (&a, 2.0)]), 8.0, [1.0, 64.0]);
        near(ends(&[(&a, 1.0), (&a, -1.0)]), 1.0, [1.0, 1.0]);
        // ln 2 of each side of a, ln 2 of b's upper end, which is the lower end of 1/b.
        let down = libm::exp(-(2.0f64.sqrt()) * std::f64::consts::LN_2);
        near(ends(&[(&a, 1.0), (&b, -1.0)]), 0.5, [0.5 * down, 1.0]);
        assert_eq!(power_product(&[(&cell("c", 4, e(-1.0, -2.0, 1.0)), 1.0)]), None);
    }

    fn cell(id: &str, spp: u32, mse: Estimate) -> Cell {
        Cell {
            scene: 0,
            sampler: 0,
            id: id.to_owned(),
            spp: crate::experiment::results::Count { asked: spp, taken: spp },
            replicates: 8,
            is_fixed: false,
            is_reference_limited: false,
            mse,
            rmse: None,
            rel_mse: mse,
            bias2: mse,
            variance: None,
            bias: mse,
            error_autocorrelation: None,
            flip: None,
            error_spectrum: None,
            replicate_mse: Vec::new(),
            replicate_mean: vec![2.0; 8],
            pixels: Vec::new(),
            twins: Vec::new(),
        }
    }

    /// χ² with 7 degrees of freedom: 16.0128 and 1.6899 at the upper 2.5 % and 97.5 % (tables). A range of the same values grows
    /// with their number; their variation does not.
    #[test]
    fn a_spread_is_judged_by_its_variation_whatever_the_number_of_replicates() {
        assert!((chi2_quantile(0.025, 7.0) - 16.0128).abs() < 1e-4);
        assert!((chi2_quantile(0.975, 7.0) - 1.68987).abs() < 1e-5);
        let of = |replicates: usize, half: f64| {
            let rmse = |i: usize| 1.0 + if i.is_multiple_of(2) { half } else { -half };
            let replicate_mse = (0..replicates).map(|i| rmse(i) * rmse(i)).collect();
            spread(&Cell { replicate_mse, ..cell("a", 64, e(1.0, 0.9, 1.1)) }).unwrap()
        };
        assert_eq!(of(8, 0.04).verdict, SpreadVerdict::Narrow);
        assert_eq!(of(8, 0.08).verdict, SpreadVerdict::CannotTell);
        assert_eq!(of(8, 0.2).verdict, SpreadVerdict::Wide);
        assert_eq!(of(400, 0.08).verdict, SpreadVerdict::Narrow, "more replicates say what eight could not");
        let [low, high] = of(8, 0.04).variation.ci95.unwrap();
        let value = of(8, 0.04).variation.value;
        assert!((low / value - (7.0 / 16.0128f64).sqrt()).abs() < 1e-4 && (high / value - 2.0353).abs() < 1e-3);
    }

    #[test]
    fn a_budget_of_roundings_does_not_grow_with_the_sampler_s_noise() {
        let twin = TwinDifference { id: String::new(), differing: 0.9, jumping: 0.0, largest: 0.1, rms: 0.05 };
        let verdict = |mse: f64, twin: TwinDifference| {
            let made = Cell { replicates: 1, twins: vec![twin], ..cell("b", 64, e(mse, mse, mse)) };
            scale_verdict(&cell("a", 64, e(mse, mse, mse)), &made)
        };
        // 0.05 of a mean of 2 is 2.5 %.
        assert_eq!(verdict(1e-6, twin.clone()), ScaleVerdict::Changed);
        assert_eq!(verdict(1e6, twin.clone()), ScaleVerdict::Changed);
        assert_eq!(verdict(1e-6, TwinDifference { rms: 0.039, ..twin }), ScaleVerdict::Unchanged);
    }

    #[test]
    fn one_image_each_in_another_unit_of_length_has_no_interval_unless_it_is_exact() {
        let single = |mse| Cell { replicates: 1, is_fixed: true, ..cell("a", 64, mse) };
        let (noisy, exact) = (single(e(1.0, 0.9, 1.1)), single(e(1.0, 1.0, 1.0)));
        assert_eq!(scaled_ratio(&noisy, &noisy).unwrap().ci95, None);
        assert_eq!(scaled_ratio(&exact, &exact).unwrap().ci95, Some([1.0, 1.0]));
    }
}

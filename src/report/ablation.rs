//! Which decision the error comes from: one decision at a time reads another sampler, and how much of the error goes.
//!
//! Recognised by structure: in a scene, a *base* is a compared sampler that all of the scene's decisions read alike, and a
//! set that differs from it in exactly one of them is an exchange of that decision. With the base independent (uniform
//! points) and one decision well spread, the share 1 − MSE/MSE(base) is the first-order part of an analysis of variance
//! (Sobol' 1993): with f = f₀ + Σ f_d + …, n independent samples leave σ²/n, and a decision whose own points are even takes
//! its main effect's σ_d²/n away and leaves its interactions, which hang on the others' independent points. With the base
//! in step and one decision in an order of its own, the share is what parting that decision from the others cures.

use crate::sampling::{Decision, Order, Points, SamplerSet, SamplerSpec};
use crate::stats::Estimate;
use crate::stats::moments::student_t_quantile;

use super::evidence::{Answer, above, below, ratio};
use super::summarise::{Cell, Summary};

/// What an exchange asks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Question {
    /// From independent points, one decision at a time well spread: the share of the error that its main effect carries.
    Share,
    /// From all in step, one decision at a time in an order of its own: what its coupling with the others costs.
    Coupling,
    /// Any other exchange.
    Exchange,
}

/// One decision that reads the other sampler.
#[derive(Debug, Clone, Copy)]
pub struct Part<'a> {
    /// The decision.
    pub decision: Decision,
    /// What the set finds.
    pub cell: &'a Cell,
    /// 1 − MSE/MSE(base), with its 95 % interval.
    pub gone: Estimate,
}

/// Exchanges of one sampler for another, decision by decision, in one scene at one count.
#[derive(Debug, Clone)]
pub struct Ablation<'a> {
    /// Index of the scene.
    pub scene: usize,
    /// Index of the sampler that all decisions read before.
    pub base: usize,
    /// What single decisions read instead.
    pub other: SamplerSpec,
    /// What it asks.
    pub question: Question,
    /// Samples per pixel asked for: the most at which everything compared has an error above 0.
    pub spp: u32,
    /// The base's error.
    pub base_cell: &'a Cell,
    /// The exchanges, in the order of the decisions.
    pub parts: Vec<Part<'a>>,
    /// Decisions of the scene that no set exchanges alone.
    pub absent: Vec<Decision>,
    /// The other end, all decisions read the other sampler: what it finds, and the share that goes.
    pub all: Option<(&'a Cell, Estimate)>,
}

/// Where the error comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// From this decision, by index of the part: no other takes as much away.
    One(usize),
    /// From one of these, which cannot be told apart; the rest take less.
    Among(Vec<usize>),
    /// No exchange alone is seen to lower the error; the index is that of the largest share.
    Nothing(usize),
}

/// The exchanges of a scene, by base in the order of the samplers. A scene of one decision has none: there is nothing to
/// tell apart.
pub fn ablations(summary: &Summary, scene: usize) -> Vec<Ablation<'_>> {
    let decisions = &summary.scenes[scene].decisions;
    let set = |sampler: usize| summary.samplers[sampler].set;
    let sets: Vec<(usize, SamplerSet)> = summary.compared(scene).filter_map(|i| Some((i, set(i)?))).collect();
    let (bases, mixed): (Vec<_>, Vec<_>) = sets.iter().partition(|(_, set)| set.single_of(decisions).is_some());
    if decisions.len() < 2 {
        return Vec::new();
    }
    let mut groups: Vec<Group> = Vec::new();
    for (sampler, set) in mixed {
        // Of two decisions each is the other's exchange: the base that is named first counts.
        let exchange = bases.iter().find_map(|(base, base_set)| match set.differing(base_set, decisions)[..] {
            [decision] => Some((*base, decision)),
            _ => None,
        });
        let Some((base, decision)) = exchange else { continue };
        let (other, part) = (set.of(decision), (decision, sampler));
        match groups.iter_mut().find(|group| (group.base, group.other) == (base, other)) {
            Some(Group { parts, .. }) if parts.iter().all(|(d, _)| *d != decision) => parts.push(part),
            Some(_) => {}
            None => groups.push(Group { base, other, parts: vec![part] }),
        }
    }
    groups.sort_by_key(|group| group.base);
    let end = |other: SamplerSpec| {
        let is_end = |(_, set): &&(usize, SamplerSet)| set.differing(&other.into(), decisions).is_empty();
        bases.iter().find(is_end).map(|(sampler, _)| *sampler)
    };
    groups.into_iter().filter_map(|group| ablation(summary, scene, end(group.other), group)).collect()
}

/// Sets that each exchange one decision of the same base for the same sampler, by index.
struct Group {
    base: usize,
    other: SamplerSpec,
    parts: Vec<(Decision, usize)>,
}

/// One group, with the sampler that stands at its other end, at the largest count that all of it share.
fn ablation(summary: &Summary, scene: usize, end: Option<usize>, group: Group) -> Option<Ablation<'_>> {
    let Group { base, other, mut parts } = group;
    parts.sort_by_key(|(decision, _)| *decision);
    let cell = |sampler: usize, spp: u32| summary.cell(scene, sampler, spp).filter(|cell| cell.mse.value > 0.0);
    let all_there = |spp: &u32| parts.iter().map(|(_, s)| *s).chain([base]).all(|s| cell(s, *spp).is_some());
    let spp = summary.about.experiment.spp.iter().copied().filter(all_there).max()?;
    let base_cell = cell(base, spp)?;
    let exchanged = |sampler: usize| {
        let cell = cell(sampler, spp)?;
        Some((cell, gone(&ratio(&cell.mse, &base_cell.mse)?)))
    };
    let decisions = &summary.scenes[scene].decisions;
    let before = summary.samplers[base].set?.single_of(decisions)?;
    Some(Ablation {
        scene,
        base,
        other,
        question: question(&before, &other),
        spp,
        base_cell,
        absent: decisions.iter().copied().filter(|d| parts.iter().all(|(done, _)| done != d)).collect(),
        all: end.and_then(exchanged),
        parts: parts
            .iter()
            .filter_map(|&(decision, sampler)| exchanged(sampler).map(|(cell, gone)| Part { decision, cell, gone }))
            .collect(),
    })
}

fn question(before: &SamplerSpec, after: &SamplerSpec) -> Question {
    let is_coupled = before.order == Order::Step && !matches!(before.points, Points::Uniform | Points::Center);
    match before.points {
        Points::Uniform => Question::Share,
        _ if is_coupled && (after.order != Order::Step || after.points == Points::Uniform) => Question::Coupling,
        _ => Question::Exchange,
    }
}

/// 1 − r.
fn gone(ratio: &Estimate) -> Estimate {
    Estimate { value: 1.0 - ratio.value, ci95: ratio.ci95.map(|[low, high]| [1.0 - high, 1.0 - low]) }
}

impl Ablation<'_> {
    /// Where the error comes from, at a joint level of 95 % over the decisions: the chance that the decision which takes
    /// the most away in truth is left out of the answer is at most 5 %.
    pub fn source(&self) -> Source {
        let errors: Vec<(Estimate, f64)> = self.parts.iter().map(|part| (part.cell.mse, freedom(part.cell))).collect();
        source(&errors, (self.base_cell.mse, freedom(self.base_cell)))
    }

    /// Whether the exchange of part `i` alone takes more than half of the error away, at a joint level of 95 % over the
    /// decisions.
    pub fn is_over_half(&self, i: usize) -> Answer {
        let tests = self.parts.len();
        let cell = |cell: &Cell| widened((cell.mse, freedom(cell)), tests);
        ratio(&cell(self.parts[i].cell), &cell(self.base_cell)).map_or(Answer::CannotTell, |ratio| below(&ratio, 0.5))
    }

    /// Whether the error grows by each exchange alone, at a joint level of 95 % over the decisions.
    pub fn grows_by_each(&self) -> bool {
        let tests = self.parts.len();
        let cell = |cell: &Cell| widened((cell.mse, freedom(cell)), tests);
        let grows = |part: &Part| {
            let ratio = ratio(&cell(part.cell), &cell(self.base_cell));
            ratio.is_some_and(|ratio| above(&ratio, 1.0) == Answer::Yes)
        };
        !self.parts.is_empty() && self.parts.iter().all(grows)
    }

    /// In a [`Question::Coupling`] the decisions whose exchange alone takes more than half of the error away, largest
    /// share first, where they are several. Shares of more than half overlap: parting either decision cures the same
    /// coupling, which is theirs together and no single one's.
    pub fn coupled(&self) -> Vec<usize> {
        let is_large = |i: &usize| self.is_over_half(*i) == Answer::Yes;
        let mut large: Vec<usize> = match self.question {
            Question::Coupling => (0..self.parts.len()).filter(is_large).collect(),
            _ => Vec::new(),
        };
        large.sort_by(|&a, &b| self.parts[b].gone.value.total_cmp(&self.parts[a].gone.value));
        if large.len() > 1 { large } else { Vec::new() }
    }

    /// In a [`Question::Share`] the most that interactions of decisions can carry: what all well-spread points at once leave,
    /// 1 − all, or what is left when the single shares are taken off, 1 − Σ gone, where that is clearly less.
    ///
    /// Both are upper bounds: points in orders of their own leave interactions as they were, and of main effects what so
    /// many points miss. Points joint over the decisions (the other sampler in step) can take interactions away, so then
    /// the first says nothing. `None` where neither can be had.
    pub fn interactions(&self) -> Option<Estimate> {
        if self.question != Question::Share {
            return None;
        }
        let is_apart = self.other.order != Order::Step;
        let all = self.all.as_ref().filter(|_| is_apart).map(|(_, share)| gone(share));
        tighter(all, self.left())
    }

    /// 1 − Σ gone; `None` where a decision has no exchange.
    fn left(&self) -> Option<Estimate> {
        if !self.absent.is_empty() {
            return None;
        }
        let sum = total(self.parts.iter().map(|part| part.cell.mse));
        let over_base = ratio(&sum, &self.base_cell.mse)?;
        let shift = 1.0 - self.parts.len() as f64;
        let left =
            Estimate { value: over_base.value + shift, ci95: over_base.ci95.map(|ends| ends.map(|end| end + shift)) };
        Some(left)
    }
}

/// Of two upper bounds the first, unless the second's interval lies below it.
fn tighter(first: Option<Estimate>, second: Option<Estimate>) -> Option<Estimate> {
    match (first, second) {
        (Some(first), Some(second)) => {
            let low = first.ci95.map_or(first.value, |[low, _]| low);
            Some(if below(&second, low) == Answer::Yes { second } else { first })
        }
        (first, second) => first.or(second),
    }
}

/// The sum of independent estimates: distances to the ends add in squares.
fn total(estimates: impl Iterator<Item = Estimate>) -> Estimate {
    let (mut value, mut squares) = (0.0, Some([0.0, 0.0]));
    for e in estimates {
        value += e.value;
        let square = |x: f64| x * x;
        squares = squares
            .zip(e.ci95)
            .map(|([down, up], [low, high])| [down + square(e.value - low), up + square(high - e.value)]);
    }
    Estimate { value, ci95: squares.map(|[down, up]: [f64; 2]| [value - down.sqrt(), value + up.sqrt()]) }
}

/// Degrees of freedom of a cell's interval: at least those of its replicates. What has nothing random in it has the
/// reference's noise alone, a sum over many pixels.
fn freedom(cell: &Cell) -> f64 {
    if cell.is_fixed { 1e6 } else { f64::from(cell.replicates.max(2) - 1) }
}

/// Which of the mean square errors `parts` (with their degrees of freedom) is the smallest, and whether it lies below
/// `base`.
///
/// Each comparison with the smallest is made at level 5 %/(k − 1) (Bonferroni), because the smallest was picked by looking:
/// of the k − 1 comparisons only those against the truly smallest can err, and there are no more than k − 1 of them.
fn source(parts: &[(Estimate, f64)], base: (Estimate, f64)) -> Source {
    let smallest = (0..parts.len()).min_by(|&a, &b| parts[a].0.value.total_cmp(&parts[b].0.value)).unwrap_or(0);
    let is_less = |a: (Estimate, f64), b: (Estimate, f64), tests: usize| {
        let ratio = ratio(&widened(a, tests), &widened(b, tests));
        ratio.is_some_and(|ratio| below(&ratio, 1.0) == Answer::Yes)
    };
    if !is_less(parts[smallest], base, parts.len()) {
        return Source::Nothing(smallest);
    }
    let others = parts.len().saturating_sub(1).max(1);
    let not_more = |&i: &usize| i == smallest || !is_less(parts[smallest], parts[i], others);
    match (0..parts.len()).filter(not_more).collect::<Vec<_>>() {
        one if one.len() == 1 => Source::One(smallest),
        several => Source::Among(several),
    }
}

/// An estimate with its 95 % interval widened for `tests` comparisons at once, by the ratio of Student's quantiles.
fn widened((e, freedom): (Estimate, f64), tests: usize) -> Estimate {
    let quantile = |tests: f64| student_t_quantile(1.0 - 0.025 / tests, freedom);
    let factor = quantile(tests.max(1) as f64) / quantile(1.0);
    let end = |end: f64| e.value + factor * (end - e.value);
    Estimate { value: e.value, ci95: e.ci95.map(|ends| ends.map(end)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::hash::{bits32, unit_f32};
    use crate::stats::t_interval;

    /// Eight replicates of a mean square error, each a mean over some pixels: twelve uniform numbers about `truth`.
    fn measured(truth: f64, key: u64) -> (Estimate, f64) {
        let unit = |i: u32| f64::from(unit_f32(bits32(key, i)));
        let replicate = |r: u32| truth * (0.5 + (12 * r..12 * r + 12).map(unit).sum::<f64>() / 12.0);
        (t_interval(&(0..8).map(replicate).collect::<Vec<_>>(), 0.95), 7.0)
    }

    /// Of three decisions that take away the same, one is named in at most 5 % of 3000 trials but for chance: 150 expected at the
    /// most. A test at 5 % for each pair, unadjusted and after looking, names one in about twice as many: 300.
    /// False alarms: 1e-8 (the bar is 6.1 deviations, in a binomial tail).
    #[test]
    fn equal_decisions_are_told_apart_no_more_often_than_promised() {
        let mut named = 0;
        for trial in 0..3000u64 {
            let key = |i: u64| 1000 * trial + i;
            let parts: Vec<_> = (0..3).map(|i| measured(1.0, key(i))).collect();
            match source(&parts, measured(3.0, key(3))) {
                Source::One(_) => named += 1,
                Source::Among(several) => assert!(several.len() > 1),
                Source::Nothing(_) => panic!("a third of the error is there to see"),
            }
        }
        assert!(named <= 223, "{named} of 3000");
    }

    /// The decision that takes the most away is in the answer in at least 95 % of 300 trials but for chance, however near
    /// the second is; and where it is twice as good it is the answer.
    #[test]
    fn the_decision_that_matters_most_is_in_the_answer() {
        let mut missed = 0;
        for trial in 0..300u64 {
            let key = |i: u64| 77_000 + 1000 * trial + i;
            let near = [measured(1.0, key(0)), measured(1.04, key(1)), measured(1.3, key(2))];
            missed += i32::from(match source(&near, measured(2.0, key(3))) {
                Source::One(one) => one != 0,
                Source::Among(several) => !several.contains(&0),
                Source::Nothing(_) => true,
            });
            let far = [measured(2.0, key(4)), measured(1.0, key(5)), measured(2.0, key(6))];
            assert_eq!(source(&far, measured(3.0, key(7))), Source::One(1));
        }
        assert!(missed <= 28, "{missed} of 300");
    }

    /// A bound that is not clearly the lower of two is not taken, or the one with more noise would win by it.
    #[test]
    fn of_two_bounds_the_second_is_taken_only_where_it_is_clearly_lower() {
        let e = |value: f64, half: f64| Estimate { value, ci95: Some([value - half, value + half]) };
        let value = |a, b| tighter(a, b).map(|bound: Estimate| bound.value);
        assert_eq!(value(Some(e(0.3, 0.02)), Some(e(0.4, 0.2))), Some(0.3));
        assert_eq!(value(Some(e(0.3, 0.02)), Some(e(0.2, 0.1))), Some(0.3), "perhaps lower");
        assert_eq!(value(Some(e(0.3, 0.02)), Some(e(0.2, 0.05))), Some(0.2));
        assert_eq!(value(None, Some(e(0.2, 0.1))), Some(0.2));
        assert_eq!(value(None, None), None);
    }

    fn cell(mse: f64) -> Cell {
        let e = Estimate { value: mse, ci95: Some([0.98 * mse, 1.02 * mse]) };
        Cell {
            scene: 0,
            sampler: 0,
            id: String::new(),
            spp: crate::experiment::results::Count { asked: 16, taken: 16 },
            replicates: 8,
            is_fixed: false,
            is_reference_limited: false,
            mse: e,
            rmse: None,
            rel_mse: e,
            bias2: e,
            variance: None,
            bias: e,
            error_autocorrelation: None,
            flip: None,
            error_spectrum: None,
            replicate_mse: Vec::new(),
            replicate_mean: Vec::new(),
            pixels: Vec::new(),
            twins: Vec::new(),
        }
    }

    /// From an error of 1, within 2 percent, to `errors` of the parts and of all at once.
    fn with_group<T>(question: Question, errors: &[f64], all: f64, see: impl Fn(&Ablation) -> T) -> T {
        let (base, cells, end) = (cell(1.0), errors.iter().map(|&e| cell(e)).collect::<Vec<_>>(), cell(all));
        let gone = |cell: &Cell| gone(&ratio(&cell.mse, &base.mse).unwrap());
        let part = |(cell, decision): (_, &Decision)| Part { decision: *decision, cell, gone: gone(cell) };
        let other = SamplerSpec::parse("ld:shuffle:xor@each", crate::sampling::Preset::Best).unwrap();
        see(&Ablation {
            scene: 0,
            base: 0,
            other,
            question,
            spp: 16,
            base_cell: &base,
            parts: cells.iter().zip(&Decision::ALL).map(part).collect(),
            absent: Vec::new(),
            all: Some((&end, gone(&end))),
        })
    }

    #[test]
    fn an_error_comes_from_a_decision_that_takes_more_than_half_away() {
        let answers = |group: &Ablation| (0..3).map(|i| group.is_over_half(i)).collect::<Vec<_>>();
        let found = with_group(Question::Share, &[0.3, 0.5, 0.94], 0.2, answers);
        assert_eq!(found, [Answer::Yes, Answer::CannotTell, Answer::No]);
    }

    #[test]
    fn a_coupling_belongs_to_all_decisions_that_each_cure_more_than_half_of_it() {
        let coupled = |question, errors: &[f64]| with_group(question, errors, 0.1, |group| group.coupled());
        assert_eq!(coupled(Question::Coupling, &[0.30, 0.17, 0.86]), [1, 0], "largest first");
        assert!(coupled(Question::Coupling, &[0.7, 0.17, 0.86]).is_empty(), "one with the others");
        assert!(coupled(Question::Coupling, &[0.3, 0.5, 0.86]).is_empty(), "perhaps over half is not over half");
        assert!(coupled(Question::Share, &[0.30, 0.17, 0.86]).is_empty());
    }

    #[test]
    fn an_error_grows_by_each_exchange_only_where_the_joint_level_says_so() {
        let grows = |errors: &[f64]| with_group(Question::Coupling, errors, 1.0, |group| group.grows_by_each());
        assert!(grows(&[1.3, 1.1]));
        // Above 1 by a plain interval, which two comparisons at once widen by a fifth.
        assert!(!grows(&[1.3, 1.03]) && !grows(&[1.3, 0.9]));
        assert!(grows(&[1.03]), "one comparison widens nothing");
    }

    #[test]
    fn interactions_carry_no_more_than_what_all_decisions_at_once_leave() {
        let most = |errors: &[f64], all| {
            with_group(Question::Share, errors, all, |group| group.interactions().map(|most| most.value)).unwrap()
        };
        assert!((most(&[0.8, 0.7], 0.2) - 0.2).abs() < 1e-12, "the single shares leave 50 %");
        assert!((most(&[0.6, 0.5], 0.4) - 0.1).abs() < 1e-12, "the single shares leave 10 %");
        assert_eq!(with_group(Question::Coupling, &[0.6, 0.5], 0.4, |group| group.interactions()), None);
    }

    #[test]
    fn an_exchange_that_lowers_nothing_is_no_source() {
        let e = |value: f64, half: f64| (Estimate { value, ci95: Some([value - half, value + half]) }, 7.0);
        assert_eq!(source(&[e(1.0, 0.1), e(0.98, 0.1)], e(1.0, 0.1)), Source::Nothing(1));
        assert_eq!(source(&[e(0.5, 0.1), e(2.0, 0.1)], e(1.0, 0.1)), Source::One(0));
        assert_eq!(source(&[e(0.5, 0.01), e(0.5, 0.01), e(0.9, 0.01)], e(1.0, 0.01)), Source::Among(vec![0, 1]));
        let unknown = (Estimate::without_interval(0.1), 7.0);
        assert_eq!(source(&[unknown, e(0.5, 0.1)], e(1.0, 0.1)), Source::Nothing(0));
        assert_eq!(source(&[e(0.5, 0.1)], e(1.0, 0.1)), Source::One(0));
    }

    /// Student's quantiles with 7 degrees of freedom: 2.3646 at 97.5 %, 3.1276 at 99.1667 % (tables).
    #[test]
    fn intervals_widen_by_student_s_quantiles() {
        let e = Estimate { value: 1.0, ci95: Some([0.9, 1.2]) };
        assert_eq!(widened((e, 7.0), 1).ci95, e.ci95);
        let [low, high] = widened((e, 7.0), 3).ci95.unwrap();
        let factor = 3.1276 / 2.3646;
        assert!(
            (low - (1.0 - 0.1 * factor)).abs() < 2e-4 && (high - (1.0 + 0.2 * factor)).abs() < 4e-4,
            "{low} {high}"
        );
    }

    #[test]
    fn a_sum_s_distances_add_in_squares() {
        let e = |value: f64, down: f64, up: f64| Estimate { value, ci95: Some([value - down, value + up]) };
        let sum = total([e(1.0, 3.0, 5.0), e(2.0, 4.0, 12.0)].into_iter());
        assert_eq!((sum.value, sum.ci95), (3.0, Some([-2.0, 16.0])));
        assert_eq!(total([e(1.0, 1.0, 1.0), Estimate::without_interval(1.0)].into_iter()).ci95, None);
    }
}

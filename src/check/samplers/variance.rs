//! Every legal sampler against exact variances: a slope hides a wrong constant, a closed form does not.
//!
//! What is certified, for each of points × order × random × scope (and the presets of the sheet), as the renderer reads
//! it in one pixel:
//!
//! | decision | n | mean and mean square of the error of | exact value from |
//! |---|---|---|---|
//! | pixel (dimensions 0–1) | 16 | x, y, xy, 1(x < 1/π); E(L2*²) | [`laws`](super::laws): pairs of points |
//! | | | 1(y > x) where the set is on the grid of n, jittered, random or an Owen net | all n² shifts, or a closed form |
//! | | | quarter disk for `uniform` | 1/(4n) |
//! | light point (dimensions 5–6 of `joint`) | 24 | x, y, xy, 1(x < 1/π) | pairs |
//! | light pick (dimension 4 of `joint`) | 24 | x, 1(x < 1/π) | pairs |
//!
//! Without randomisation the error itself is exact and the same for every seed.
//!
//! A replicate is the mean over one set. Its error is tested by t, and its squares are by t against the exact mean
//! square. Means of squares are skew (γ = 2.8 for normal errors), which makes a studentised mean fall low too often, by a factor of
//! exp(γ z³/(3√R)): 60 at z = 7.2 and R = 8000. [`cautious`] takes a hundredth of the family's rate to pay for that. A wrong
//! variance is caught from a quarter on at 8000 replicates (16 % for errors that are normal; see `detects`).

use rayon::prelude::*;

use super::laws::{AxisLaw, Error, axis_errors, grid_diagonal, owen_diagonal, set_errors};
use super::reading::{HALF_PLACE, Integrand, Reader, Tickets, numbered_specs};
use crate::check::{Check, Context, Finding, Kind, Tally};
use crate::sampling::{Decision, Order, Random, SamplerSpec};
use crate::stats::hypothesis::t_test_of_squares;
use crate::stats::{Family, Verdict, t_test};

/// The checks of variances, one for each randomisation.
pub fn checks() -> Vec<Check> {
    let check =
        |name, claim, run| Check { name, group: super::GROUP, claim, failures: &[], kind: Kind::Statistical, run };
    vec![
        check("variance-fresh", "independent numbers have the variances of independent numbers", |c| {
            certify(c, Random::Fresh)
        }),
        check("variance-jitter", "one independent point in each stratum: all its variances are exact", |c| {
            certify(c, Random::Jitter)
        }),
        check("variance-xor", "a digital shift has the variances of one word for all points", |c| {
            certify(c, Random::Xor)
        }),
        check(
            "variance-yxor",
            "Hammersley with y alone shifted: x has the bias −1/(2n) and no variance, y the variance of a shift",
            |c| certify(c, Random::Yxor),
        ),
        check("variance-shift", "a toroidal shift has the variances of one number for all points", |c| {
            certify(c, Random::Shift)
        }),
        check("variance-owen", "an Owen scramble has the variances of nested uniform scrambling", |c| {
            certify(c, Random::Owen)
        }),
        check("variance-digits", "scrambled Halton has the variances of nested uniform digit permutations", |c| {
            certify(c, Random::Digits)
        }),
        Check {
            name: "error-unrandomised",
            group: super::GROUP,
            claim: "without randomisation there is one error, the exact one, whatever seed and order",
            failures: &[],
            kind: Kind::Exact,
            run: unrandomised,
        },
    ]
}

/// An exact statement about the mean of an integrand over a set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anchor {
    /// What is averaged.
    pub integrand: Integrand,
    /// Its exact error.
    pub error: Error,
    /// Where the exact value is from.
    pub source: &'static str,
}

/// The laws of the coordinates of a decision: two, or one for the light pick.
pub fn laws(spec: SamplerSpec, tickets: &Tickets, decision: Decision, n: u32) -> Vec<AxisLaw> {
    let one_d = decision.dimensions() == 1;
    let law = |axis| AxisLaw::of(spec, tickets.first(decision), axis, n, one_d);
    (0..decision.dimensions()).map(law).collect()
}

/// Everything exact that is known of a decision's set of `n` points (a count that the sampler takes), and E(L2*²).
pub fn anchors(spec: SamplerSpec, tickets: &Tickets, decision: Decision, n: u32) -> (Vec<Anchor>, Option<f64>) {
    let laws = laws(spec, tickets, decision, n);
    let anchor = |integrand, error, source| Anchor { integrand, error, source };
    const PAIRS: &str = "pairs of points";
    let [x, y] = &laws[..] else {
        let [of_x, step] = axis_errors(&laws[0]);
        return (vec![anchor(Integrand::X, of_x, PAIRS), anchor(Integrand::Step, step, PAIRS)], None);
    };
    let exact = set_errors(x, y);
    let mut all = vec![
        anchor(Integrand::X, exact.x, PAIRS),
        anchor(Integrand::Y, exact.y, PAIRS),
        anchor(Integrand::Product, exact.product, PAIRS),
        anchor(Integrand::Step, exact.step, PAIRS),
    ];
    let (count, side) = (f64::from(n), n.isqrt());
    let first_pair = spec.order != Order::Joint || tickets.first(decision) == 0;
    let diagonal = match spec.random {
        Random::Fresh => Some((Error::unbiased(0.25 / count), "1/(4n)")),
        Random::Jitter if side * side == n => Some((Error::unbiased(0.25 / (count * count.sqrt())), "1/(4 n^1.5)")),
        Random::Owen if n.is_power_of_two() && first_pair => {
            Some((Error::unbiased(owen_diagonal(n.trailing_zeros())), "Haar levels and gain coefficients"))
        }
        _ => grid_diagonal(x, y).map(|error| (error, "all digital shifts")),
    };
    all.extend(diagonal.map(|(error, source)| anchor(Integrand::Diagonal, error, source)));
    if spec.random == Random::Fresh {
        all.push(anchor(Integrand::Disk, Error::unbiased(0.25 / count), "1/(4n)"));
    }
    (all, Some(exact.l2_star))
}

/// The decisions that are read and their counts asked for.
pub const READ: [(Decision, u32); 3] = [(Decision::Pixel, 16), (Decision::LightPoint, 24), (Decision::LightPick, 24)];

/// What one sampler's sets gave: name, verdict, scale of its `detects`.
type Judged = (String, Verdict, f64);

/// Errors of every anchor of one decision, one list an anchor, and the L2* discrepancies squared.
fn simulate(
    spec: SamplerSpec,
    tickets: &Tickets,
    (decision, asked): (Decision, u32),
    anchors: &[Anchor],
    seeds: impl Iterator<Item = u64>,
    with_l2: bool,
) -> (Vec<Vec<f64>>, Vec<f64>) {
    let mut reader = Reader::new(spec, tickets, asked);
    let mut errors = vec![Vec::new(); anchors.len()];
    let mut l2 = Vec::new();
    let mut set: Vec<[f64; 2]> = Vec::new();
    for seed in seeds {
        set.clear();
        match decision {
            Decision::LightPick => set.extend(reader.numbers(seed, &tickets.pick).map(|x| [x, 0.5])),
            two_d => set.extend(reader.pairs(seed, tickets.two_d(two_d))),
        }
        for (errors, anchor) in errors.iter_mut().zip(anchors) {
            errors.push(anchor.integrand.error(set.iter().copied()));
        }
        if with_l2 {
            l2.push(l2_star_squared(&set));
        }
    }
    (errors, l2)
}

/// Warnock's formula in plain f64: for a handful of points, where 3 terms of size 0.1 leave 1e-3 and it need not be
/// [`l2_squared`](crate::stats::discrepancy::l2_squared), which keeps twice the digits.
fn l2_star_squared(set: &[[f64; 2]]) -> f64 {
    let n = set.len() as f64;
    let (mut boxes, mut pairs) = (0.0, 0.0);
    for (i, a) in set.iter().enumerate() {
        boxes += 0.25 * (1.0 - a[0] * a[0]) * (1.0 - a[1] * a[1]);
        pairs += (1.0 - a[0]) * (1.0 - a[1]);
        pairs += 2.0 * set[..i].iter().map(|b| (1.0 - a[0].max(b[0])) * (1.0 - a[1].max(b[1]))).sum::<f64>();
    }
    1.0 / 9.0 - 2.0 * boxes / n + pairs / (n * n)
}

/// A family at a hundredth of its rate: what a skewness of 2 costs from 2000 values on (see [`Family::for_skewed`]); products of
/// uniform numbers lean by less.
pub fn cautious(family: Family) -> Family {
    Family { false_alarm: family.false_alarm / 100.0, ..family }
}

/// Tests of the mean and the mean square of simulated errors.
pub fn judge(what: &str, errors: &[f64], exact: Error, family: Family) -> [Judged; 2] {
    let squares: Vec<f64> = errors.iter().map(|e| e * e).collect();
    let centred: Vec<f64> = errors.iter().map(|e| e - exact.bias).collect();
    // A mean that the law fixes has no spread but the renderer's rounding; one that it does not must have some.
    let fixed = (exact.mean_square - exact.bias * exact.bias).abs() < 1e-14;
    let settled = fixed && centred.iter().all(|e| e.abs() < 2.0 * HALF_PLACE);
    let zero = if settled { vec![0.0; 2] } else { centred };
    let square = if settled { vec![exact.mean_square; 2] } else { squares };
    [
        (format!("{what}, mean"), t_test(&zero, 0.0, family), exact.mean_square.sqrt()),
        (format!("{what}, mean square"), t_test_of_squares(&square, exact.mean_square, family), exact.mean_square),
    ]
}

fn certify(context: &Context, random: Random) -> Finding {
    let tickets = Tickets::new();
    let specs: Vec<SamplerSpec> = numbered_specs().into_iter().filter(|s| s.random == random).collect();
    let known: Vec<_> = specs
        .iter()
        .flat_map(|&s| {
            READ.map(|(decision, asked)| (s, decision, asked, anchors(s, &tickets, decision, s.taken(asked))))
        })
        .collect();
    let tests: usize = known.iter().map(|(_, _, _, (anchors, l2))| 2 * anchors.len() + usize::from(l2.is_some())).sum();
    let family = context.family(tests as u32);
    let replicates = u64::from(context.replicates(8000, 4000));
    let judged: Vec<Vec<Judged>> = known
        .par_iter()
        .enumerate()
        .map(|(part, (s, decision, asked, (anchors, l2)))| {
            let with_l2 = l2.is_some() && *decision == Decision::Pixel;
            let seeds = (0..replicates).map(|r| context.seed_of(part as u64, r));
            let (errors, discrepancies) = simulate(*s, &tickets, (*decision, *asked), anchors, seeds, with_l2);
            let what = format!("{s}, {}, n = {}", decision.name(), s.taken(*asked));
            let mut judged: Vec<Judged> = anchors
                .iter()
                .zip(&errors)
                .flat_map(|(a, e)| judge(&format!("{what}, {:?}", a.integrand), e, a.error, family))
                .collect();
            if let (true, Some(exact)) = (with_l2, *l2) {
                judged.push((format!("{what}, E[L2*²]"), t_test_of_squares(&discrepancies, exact, family), exact));
            }
            judged
        })
        .collect();
    let mut tally = Tally::new();
    for (what, verdict, scale) in judged.iter().flatten() {
        tally.verdict(what.as_str(), verdict, *scale);
    }
    tally.finish()
}

fn unrandomised(_: &Context) -> Finding {
    let tickets = Tickets::new();
    let mut tally = Tally::new();
    let specs = numbered_specs().into_iter().filter(|s| s.random == Random::None);
    for s in specs {
        for (decision, asked) in READ {
            let (anchors, l2) = anchors(s, &tickets, decision, s.taken(asked));
            let with_l2 = l2.is_some();
            let (errors, found) = simulate(s, &tickets, (decision, asked), &anchors, 0..4, with_l2);
            // The sheet's 1-D strata are jittered, whatever the 2-D set.
            if s.sheet_1d && decision == Decision::LightPick {
                continue;
            }
            let what = format!("{s}, {}", decision.name());
            for (anchor, errors) in anchors.iter().zip(&errors) {
                // Every number is off by half a place at most, and a mean of products by twice that.
                let bound = 2.0 * HALF_PLACE;
                let mean_square = anchor.error.bias * anchor.error.bias;
                tally.near(
                    format!("{what}, {:?}: no variance", anchor.integrand),
                    anchor.error.mean_square,
                    mean_square,
                    1e-14,
                );
                for &error in errors {
                    tally.near(format!("{what}, {:?}", anchor.integrand), error, anchor.error.bias, bound);
                }
            }
            for &found in &found {
                // The gradient of L2*² in one coordinate is below 2/n.
                tally.near(format!("{what}, L2*²"), found, l2.unwrap_or(f64::NAN), 4.0 * HALF_PLACE);
            }
        }
    }
    center(&tickets, &mut tally);
    tally.saying("each error is the exact one to 2⁻²⁴, for every order and seed; the centre has none")
}

/// `center` is ½, ½ for every sample.
fn center(tickets: &Tickets, tally: &mut Tally) {
    use crate::sampling::{PixelKey, PointSource, SampleLayout, Sampler};
    let spec = super::reading::spec("center");
    let mut layout = SampleLayout::default();
    let (pixel, lens) = (layout.claim_2d(Decision::Pixel), layout.claim_2d(Decision::Lens));
    let made = Sampler::new(spec, &layout, 5, 1).expect("a layout without lights");
    let centred = [&pixel, &lens].map(|dim| (0..5).all(|i| made.get_2d(PixelKey::new(1, 2), i, dim) == [0.5; 2]));
    tally.fact("center reads ½, ½", centred == [true; 2]);
    tally.fact("center has nothing for lights", Sampler::new(spec, &tickets.layout, 5, 1).is_err());
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No sampler is left out: each has exact values in every decision, and E(L2*²) in the pixel's.
    #[test]
    fn every_legal_sampler_has_exact_values() {
        let tickets = Tickets::new();
        for s in numbered_specs() {
            for (decision, asked) in READ {
                let (anchors, l2) = anchors(s, &tickets, decision, s.taken(asked));
                assert!(anchors.len() >= 2 * decision.dimensions() as usize && anchors.len() >= 2, "{s}");
                assert_eq!(l2.is_some(), decision.dimensions() == 2, "{s}");
                assert!(anchors.iter().all(|a| a.error.mean_square >= -1e-15 && a.error.bias.abs() < 1.0), "{s}");
            }
            let certified = checks().iter().any(|c| c.name == format!("variance-{}", s.random.word()));
            assert_eq!(certified, s.random != Random::None, "{s}");
        }
    }

    /// The short way for digital nets is the long one's result.
    #[test]
    fn cosets_of_a_net_give_what_all_shifts_give() {
        let tickets = Tickets::new();
        let axes = laws(super::super::reading::spec("ld:step:xor"), &tickets, Decision::Pixel, 16);
        let short = grid_diagonal(&axes[0], &axes[1]).unwrap();
        // A set that is the net moved by one word is no group.
        let AxisLaw::Xor(y) = &axes[1] else { panic!("a digital shift") };
        let moved = AxisLaw::Xor(y.iter().map(|f| f ^ 5 << 28).collect());
        let long = grid_diagonal(&axes[0], &moved).unwrap();
        assert!((short.mean_square - long.mean_square).abs() < 1e-15 && short.bias.abs() < 1e-15, "{short:?} {long:?}");
        // An independent simulation of 20 000 seeds has 0.00775937 ± 0.000055.
        assert!((short.mean_square - 0.007_759_37).abs() < 5.0 * 5.5e-5, "{short:?}");
    }
}

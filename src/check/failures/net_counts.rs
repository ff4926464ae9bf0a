//! Where a net is counted wrong: counts that are no power of two, and a Sobol' sequence without its first point.

use crate::stats::t_test;

use super::super::{Check, Context, Finding, Kind, Tally};
use super::common::{Point, Tickets, all, average, mean, net_t, pixel, points, span, star};
use crate::stats::hypothesis::t_test_of_squares;

/// The checks of this file.
pub fn checks() -> Vec<Check> {
    let check = |name, claim, failures, run| Check {
        name,
        group: "failures: counts",
        claim,
        failures,
        kind: Kind::Statistical,
        run,
    };
    vec![
        check(
            "net-at-48",
            "48 or 1000 points of a (0,2)-sequence are no net: unbiased, but with over 1.5 times the variance that the nets around them promise",
            &[17],
            net_at_48,
        ),
        check(
            "sobol-without-point-0",
            "dropping point 0 of Sobol' breaks the net, and scrambled its variance falls as n⁻² in place of n⁻³",
            &[20],
            without_point_0,
        ),
    ]
}

/// Exact variance of the mean of xy over n = 2ᵐ nested-uniformly scrambled points of a (0, m, 2)-net: 7(4 + 3m)/(576 n³).
fn owen_variance(n: u32) -> f64 {
    7.0 * (4.0 + 3.0 * f64::from(n.trailing_zeros())) / 576.0 / f64::from(n).powi(3)
}

/// Are the replicates' squares above `bound` on average, beyond doubt? By 10 standard errors: a claim that holds by 20, as those
/// below do at the fewest replicates, is missed with a probability below 1e-20.
fn above(tally: &mut Tally, what: &str, squares: &[f64], bound: f64) {
    let moments: crate::stats::Moments = squares.iter().copied().collect();
    let (mean, error) = (moments.mean().unwrap_or(0.0), moments.standard_error().unwrap_or(f64::INFINITY));
    tally.fact(format!("{what}: {mean:.3e} ± {error:.1e} is above {bound:.3e}"), mean - 10.0 * error > bound);
}

/// What a power law through the nets below and above promises at n.
fn promised(n: u32) -> f64 {
    let above = n.next_power_of_two();
    let (low, high) = (owen_variance(above / 2), owen_variance(above));
    let share = libm::log2(f64::from(n) / f64::from(above / 2));
    low * libm::pow(high / low, share)
}

fn net_at_48(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let tickets = Tickets::new();
    let family = context.family(4);
    let mut said = Vec::new();
    for (n, usual) in [(48u32, 40_000), (1000, 8000)] {
        let replicates = context.replicates(usual, 5000);
        let errors = |n: u32| -> Vec<f64> {
            let sampler = tickets.sampler("ld:step:owen", n, context.seed_of(u64::from(n), 0));
            (0..replicates).map(|i| mean(&all(&sampler, pixel(i), &tickets.pixel), |x, y| x * y) - 0.25).collect()
        };
        let squares = |n: u32| -> Vec<f64> { errors(n).iter().map(|e| e * e).collect() };
        let odd = errors(n);
        // Truncation to 24 bits lowers each coordinate by 2⁻²⁵ on average, and the product of two by as much in all.
        tally.verdict(format!("{n} points: mean error"), &t_test(&odd, -2f64.powi(-25), family), 0.25);
        let net = n.next_power_of_two() / 2;
        tally.verdict(
            format!("{net} points: variance"),
            &t_test_of_squares(&squares(net), owen_variance(net), family),
            owen_variance(net),
        );
        let odd: Vec<f64> = odd.iter().map(|e| e * e).collect();
        above(
            &mut tally,
            &format!("variance at {n} over 1.5 times what its neighbours promise"),
            &odd,
            1.5 * promised(n),
        );
        said.push(format!("{n} points {:.1} times what the nets below and above promise", average(&odd) / promised(n)));
    }
    let t = [32, 48, 64].map(|n| net_t(&points("ld:plain", n, 1)));
    tally.fact(format!("t at 32, 48 and 64 points: {t:?}"), t == [Some(0), None, Some(0)]);
    let d = [32, 48, 64].map(|n| f64::from(n) * star(&points("ld:plain", n, 1)));
    tally.saying(format!(
        "variance of the mean of xy: {}; n D* at 32, 48, 64 {d:.2?}, where nothing is seen of it",
        said.join(", ")
    ))
}

fn without_point_0(context: &Context) -> Finding {
    let mut tally = Tally::new();
    for m in 1..=10 {
        let n = 1usize << m;
        let sequence = points("ld:plain", 2 * n as u32, 1);
        let t = [net_t(&sequence[..n]), net_t(&sequence[1..=n])];
        tally.fact(
            format!("n = {n}: t {:?} with point 0, {:?} without", t[0], t[1]),
            t[0] == Some(0) && t[1].is_some_and(|t| t >= 1),
        );
    }
    let tickets = Tickets::new();
    let family = context.family(2);
    let mut ratios = Vec::new();
    for (n, usual) in [(64u32, 20_000), (1024, 5000)] {
        let sampler = tickets.sampler("ld:step:owen", 2 * n, context.seed_of(u64::from(n), 0));
        let replicates = context.replicates(usual, 5000);
        let (mut with, mut without) = (Vec::new(), Vec::new());
        for i in 0..replicates {
            let points = span(&sampler, pixel(i), &tickets.pixel, 0, n + 1);
            let square = |points: &[Point]| {
                let error = mean(points, |x, y| x * y) - 0.25;
                error * error
            };
            with.push(square(&points[..n as usize]));
            without.push(square(&points[1..]));
        }
        let exact = owen_variance(n);
        tally.verdict(format!("n = {n}, with point 0: variance"), &t_test_of_squares(&with, exact, family), exact);
        above(
            &mut tally,
            &format!("n = {n}, without point 0: variance over 5 times that with it"),
            &without,
            5.0 * exact,
        );
        ratios.push(average(&without) / exact);
    }
    // One rate lost: the ratio grows like n, up to the logarithm in the exact variance (16 · 22/34 = 10.4 here).
    let growth = ratios[1] / ratios[0];
    tally.fact(format!("from 64 to 1024 points the ratio grows {growth:.1} times"), growth > 6.0);
    tally.saying(format!(
        "without point 0: t ≥ 1; variance {:.0} times at 64 points, {:.0} times at 1024",
        ratios[0], ratios[1]
    ))
}

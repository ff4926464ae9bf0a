//! What arithmetic and edge cases do to statistics.

use super::super::super::{Check, Context, Finding, Kind, Tally};
use super::fact;
use crate::experiment::spec::Experiment;
use crate::sampling::{Preset, SamplerSpec, point_set};
use crate::scene::json;
use crate::stats::hypothesis::{benjamini_hochberg, holm, sidak, welch};
use crate::stats::image_error::{REL_MSE_EPSILON, mae, max_abs, mse, nonfinite, rel_mse, smape};
use crate::stats::trimmed::mse_trimmed;
use crate::stats::{
    Bootstrap, Family, Moments, Outcome, Tails, Trial, equivalence_test, jackknife, slope_with_interval, sum,
    t_interval, t_test, welch_test, z_test,
};

pub(super) fn checks() -> Vec<Check> {
    use Kind::Exact;
    vec![
        fact(
            "sample-counts",
            &[26],
            Exact,
            "0 and 2^31 samples are refused by name, one sample has no variance",
            counts,
        ),
        fact("cancelling-variance", &[27], Exact, "E[x²] − E[x]² cancels to nothing, ours gives 30", cancelling),
        fact("stalled-mean", &[28], Exact, "a running sum in f32 stalls at 2^24 samples, ours goes on", stalled),
        fact("merge-order", &[29], Exact, "merged in any order moments agree, in one order to the bit", merges),
        fact("one-replicate", &[31], Exact, "one replicate has no interval and no test, never a width of 0", one),
        fact("no-spread", &[32], Exact, "where nothing varies the answer is definite, never NaN", no_spread),
        fact("sidak-in-f32", &[35], Exact, "Šidák's level in f32 is 0 at 2^20 tests, ours is exact", sidak_f32),
        fact("extreme-p-values", &[36], Exact, "p-values of 0, 1e-300 and 1 stay ordered, NaN is an error", extremes),
        fact("bad-pixels", &[41], Exact, "a NaN or infinite pixel poisons every metric and is counted", bad_pixels),
        fact("black-pixels", &[42], Exact, "black pixels have finite relative errors, 0/0 is 0", black_pixels),
    ]
}

fn counts(_: &Context) -> Finding {
    let mut tally = Tally::new();
    let read = |spp: &str| {
        let text = format!(
            r#"{{"name": "x", "seed": 1, "scenes": ["a"], "samplers": ["sobol"], "spp": [{spp}], "replicates": 1,
                "reference": {{"sampler": "uniform", "spp": 4}}}}"#
        );
        json::parse(text.as_bytes(), "x.json").and_then(|value| Experiment::from_value(&value, "x.json"))
    };
    for bad in ["0", "2147483648", "-1", "1.5"] {
        let said = read(bad).err().map(|error| error.to_string()).unwrap_or_default();
        tally.fact(format!("spp {bad} is refused: {said:?}"), said.contains("spp") && said.contains(bad));
    }
    tally.fact("an spp of 1 is accepted", read("1").is_ok());
    let Ok(sobol) = SamplerSpec::parse("sobol", Preset::Best) else {
        return Finding::broken("sobol is no sampler".to_owned());
    };
    let refused = [0, u32::MAX, 1 << 31].map(|n| point_set(sobol, n, 1).is_err());
    tally.fact("sets of 0, 2^31 and 2^32 − 1 points are refused", refused == [true; 3]);
    let moments: Moments = [0.5].into_iter().collect();
    let undefined = (moments.mean(), moments.variance(), moments.standard_error()) == (Some(0.5), None, None);
    tally.fact("one sample has a mean and no variance", undefined);
    tally.saying("spp 0, 2^31, −1 and 1.5 are refused by their key; one sample has no variance")
}

/// E[x²] − E[x]² with n − 1, as it is often written.
fn naive_variance(x: &[f64]) -> f64 {
    let n = x.len() as f64;
    let (total, squares) = x.iter().fold((0.0, 0.0), |(s, q), v| (s + v, q + v * v));
    (squares / n - (total / n) * (total / n)) * n / (n - 1.0)
}

/// NIST StRD NumAcc2–4: one value c + 0.2, then 1000 alternating c + 0.1 and c + 0.3; the standard deviation is 0.1.
fn num_acc(c: f64) -> Vec<f64> {
    let ends = [c + 0.1, c + 0.3];
    std::iter::once(c + 0.2).chain((0..1000).map(|i| ends[i % 2])).collect()
}

/// The certified values hold for the decimal numbers; as f64 each is off by half a spacing, at 10⁷ 9.3e-10, which moves a
/// standard deviation of 0.1 by up to 9.3e-9 of itself.
fn cancelling(_: &Context) -> Finding {
    let mut tally = Tally::new();
    let shifted = [4.0, 7.0, 13.0, 16.0].map(|v| 1e9 + v);
    let naive = naive_variance(&shifted);
    let variance = |x: &[f64]| x.iter().copied().collect::<Moments>().variance().unwrap_or(f64::NAN);
    tally.near("Welford on 1e9 + {4, 7, 13, 16}", variance(&shifted), 30.0, 0.0);
    tally.fact(format!("E[x²] − E[x]² gives {naive} in place of 30"), (naive - 30.0).abs() > 15.0);
    let first = [10_000_001.0, 10_000_003.0, 10_000_002.0];
    tally.near("NumAcc1", variance(&first).sqrt(), 1.0, 1e-15);
    for (name, c, tolerance) in [("NumAcc2", 1.0, 1e-14), ("NumAcc3", 1e6, 1e-9), ("NumAcc4", 1e7, 1e-8)] {
        let x = num_acc(c);
        let mean = sum(x.iter().copied()) / 1001.0;
        tally.near(format!("{name}: mean"), mean / (c + 0.2), 1.0, 1e-15);
        tally.near(format!("{name}: standard deviation"), variance(&x).sqrt() / 0.1, 1.0, tolerance);
    }
    let acc4 = naive_variance(&num_acc(1e7));
    tally.fact(format!("E[x²] − E[x]² on NumAcc4 gives {acc4} in place of 0.01"), (acc4 / 0.01 - 1.0).abs() > 0.1);
    tally.saying(format!("E[x²] − E[x]² gives {naive} for 30 and {acc4:.4} for 0.01; ours 30 and 0.0100"))
}

fn stalled(_: &Context) -> Finding {
    let n = 1_u32 << 25;
    let single = (0..n).fold(0.0_f32, |total, _| total + 1.0) / n as f32;
    let tenth = (0..n).fold(0.0_f32, |total, _| total + 0.1) / n as f32;
    let exact = f64::from(0.1_f32);
    let compensated = sum(std::iter::repeat_n(exact, n as usize)) / f64::from(n);
    // 2^25 of them by merging a set with itself 25 times.
    let mut moments: Moments = [exact].into_iter().collect();
    (0..25).for_each(|_| moments.merge(&moments.clone()));
    let mut tally = Tally::new();
    tally.near("f32 mean of 2^25 ones", f64::from(single), 0.5, 0.0);
    tally.fact(format!("f32 mean of 2^25 times 0.1 is {tenth}"), (f64::from(tenth) - 0.1).abs() > 0.01);
    tally.near("our sum of 2^25 times 0.1", compensated, exact, 0.0);
    tally.near("our merged mean", moments.mean().unwrap_or(f64::NAN), exact, 0.0);
    tally.saying(format!("2^25 ones have the f32 mean {single}, 2^25 times 0.1 {tenth:.4}; ours 1 and 0.1"))
}

fn merges(context: &Context) -> Finding {
    let parts: Vec<Moments> = (0..64_u64)
        .map(|p| (0..50 + p).map(|i| 1e3 + (context.seed_of(p, i) >> 40) as f64 / 16_777_216.0).collect())
        .collect();
    let merged = |order: &mut dyn Iterator<Item = usize>| {
        let mut total = Moments::default();
        order.for_each(|i| total.merge(&parts[i]));
        total
    };
    let [first, again] = [(); 2].map(|()| merged(&mut (0..64)));
    let mut tally = Tally::new();
    tally.fact("the same order gives the same bits", first == again);
    let variance = |m: &Moments| m.variance().unwrap_or(f64::NAN);
    let mut differ = 0;
    for step in [63, 5, 11, 37] {
        let other = merged(&mut (0..64).map(|i| i * step % 64));
        differ += u32::from(other != first);
        tally.near(format!("variance in steps of {step}"), variance(&other) / variance(&first), 1.0, 1e-11);
        tally.near("mean", other.mean().unwrap_or(f64::NAN) / first.mean().unwrap_or(f64::NAN), 1.0, 1e-14);
    }
    tally.fact(format!("{differ} of 4 other orders differ in some bit: the order has to be fixed"), differ > 0);
    tally.saying(format!("{differ} of 4 other orders change some bit, none the eleventh digit"))
}

fn one(_: &Context) -> Finding {
    let family = Family::one(0.01);
    let single = [0.7];
    let undefined = |outcome: Outcome| matches!(outcome, Outcome::Undefined(_));
    let mut tally = Tally::new();
    tally.fact("Student's interval of one is undefined", t_interval(&single, 0.95).ci95.is_none());
    tally.fact("the jackknife's too", jackknife(1, |_| 0.7).ci95.is_none());
    let mean = |v: &[f64]| sum(v.iter().copied()) / v.len() as f64;
    tally.fact("the bootstrap's too", Bootstrap::new(1).of(&single, mean).estimate.ci95.is_none());
    let slope = slope_with_interval(&[4.0, 16.0], &[vec![1.0], vec![0.25]], 1);
    tally.fact("a slope through two single points has none", slope.is_some_and(|s| s.ci95.is_none()));
    for (what, verdict) in [
        ("t", t_test(&single, 0.7, family)),
        ("Welch", welch_test(&single, &[0.7, 0.8], family)),
        ("equivalence", equivalence_test(&single, 0.7, 0.1, family)),
        ("a trial of one", Trial::new(1, family).of(|_| 0.7).against(0.7).verdict),
    ] {
        tally.fact(format!("{what}: {verdict}"), undefined(verdict.outcome) && !verdict.holds());
    }
    tally.fact("one value has no tails", Tails::of(&single).is_none());
    tally.saying("intervals of one replicate: none; tests: undefined, and not passed")
}

fn no_spread(_: &Context) -> Finding {
    let family = Family::one(0.01);
    let (mean, exact, variance) = (0.5, 0.5, 0.0_f64);
    let naive: f64 = (mean - exact) / (variance / 5.0).sqrt();
    let mut tally = Tally::new();
    tally.fact(format!("(mean − exact)/s·√n is {naive}"), naive.is_nan());
    for (what, verdict, holds) in [
        ("t, equal", t_test(&[0.5; 5], 0.5, family), true),
        ("t, different", t_test(&[0.5; 5], 0.6, family), false),
        ("z, equal", z_test(0.5, 0.5, 0.0, family), true),
        ("z, different", z_test(0.5, 0.6, 0.0, family), false),
        ("Welch, equal", welch_test(&[0.5; 5], &[0.5; 9], family), true),
        ("Welch, different", welch_test(&[0.5; 5], &[0.6; 9], family), false),
        ("equivalent", equivalence_test(&[0.5; 5], 0.55, 0.1, family), true),
        ("not equivalent", equivalence_test(&[0.5; 5], 0.75, 0.1, family), false),
    ] {
        let definite = matches!(verdict.outcome, Outcome::DefinitelyEqual | Outcome::DefinitelyDifferent);
        let is_number = verdict.p_value.is_some_and(|p| p == 0.0 || p == 1.0);
        tally.fact(format!("{what}: {verdict}"), definite && is_number && verdict.holds() == holds);
    }
    let p = |b: &[f64]| welch(&[0.5; 3], b).map(|w| w.p_two_sided);
    tally.fact("Welch's p is 1 or 0", p(&[0.5; 3]) == Some(1.0) && p(&[0.6; 3]) == Some(0.0));
    tally.saying("equal or different for certain, p = 1 or 0; the textbook quotient is NaN")
}

/// Exact values from `failures_measured.json`.
fn sidak_f32(_: &Context) -> Finding {
    let literal = |tests: f32| 1.0 - libm::powf(1.0 - 0.01_f32, 1.0 / tests);
    let mut tally = Tally::new();
    for (tests, exact) in [
        (100, 1.004_983_082_416_679_1e-4),
        (10_000, 1.005_033_080_304_059_7e-6),
        (65_536, 1.533_559_430_368_355_8e-7),
        (262_144, 3.833_898_796_402_583_5e-8),
    ] {
        tally.near(format!("level of one of {tests} tests"), sidak(0.01, tests) / exact, 1.0, 1e-12);
    }
    let (half_off, zero) = (f64::from(literal(262_144.0)) / sidak(0.01, 262_144), literal(1_048_576.0));
    tally.fact(format!("f32 at 262 144 tests: {half_off:.2} times the exact level"), (half_off - 1.0).abs() > 0.3);
    tally.near("f32 at 1 048 576 tests", f64::from(zero), 0.0, 0.0);
    let beyond = sidak(0.01, 1 << 40);
    tally.near("ours at 2^40 tests", beyond * (1_u64 << 40) as f64 / -libm::log1p(-0.01), 1.0, 1e-12);
    tally.saying(format!("f32: {half_off:.2} times too large at 2^18 tests and {zero} at 2^20; ours exact to 1e-12"))
}

fn extremes(_: &Context) -> Finding {
    let p = [1e-300, 0.0, 1.0, 0.6, f64::MIN_POSITIVE, 5e-324, 0.04, 0.03, 0.01, 0.001, 0.5];
    let mut tally = Tally::new();
    let small = [0.001, 0.01, 0.03, 0.04, 0.5];
    for (name, adjust, exact) in [
        ("Holm", holm as fn(&[f64]) -> crate::error::Result<Vec<f64>>, [0.005, 0.04, 0.09, 0.09, 0.5]),
        ("Benjamini–Hochberg", benjamini_hochberg, [0.005, 0.025, 0.05, 0.05, 0.5]),
    ] {
        for (found, exact) in adjust(&small).unwrap_or_default().iter().zip(exact) {
            tally.near(name, *found, exact, 1e-15);
        }
        let adjusted = adjust(&p).unwrap_or_default();
        let mut order: Vec<usize> = (0..adjusted.len()).collect();
        order.sort_by(|&a, &b| p[a].total_cmp(&p[b]));
        let monotone = order.windows(2).all(|w| adjusted[w[0]] <= adjusted[w[1]]);
        let bounded = adjusted.iter().zip(&p).all(|(a, p)| a >= p && *a <= 1.0);
        tally.fact(
            format!("{name} keeps order and bounds: {adjusted:?}"),
            adjusted.len() == p.len() && monotone && bounded,
        );
        for bad in [f64::NAN, -1e-9, 1.1] {
            let said = adjust(&[0.5, bad]).err().map(|e| e.to_string()).unwrap_or_default();
            tally.fact(format!("{name} refuses {bad}: {said:?}"), said.contains("p-value 1"));
        }
    }
    tally.saying("0, 5e-324, 1e-300 and 1 stay in order and at most 1; NaN, −1e-9 and 1.1 are refused by place")
}

fn bad_pixels(_: &Context) -> Finding {
    let reference = [[0.5_f32, 0.25, 0.0], [1.0, 2.0, 3.0], [0.1, 0.1, 0.1]];
    let clean = [[0.4_f32, 0.25, 0.1], [1.0, 2.0, 2.5], [0.1, 0.2, 0.1]];
    let mut tally = Tally::new();
    let metrics = |t: &[[f32; 3]]| {
        let (flat, r) = (t.as_flattened(), reference.as_flattened());
        let trimmed = mse_trimmed(t, &reference).unwrap_or(f64::NAN);
        [mse(flat, r), mae(flat, r), rel_mse(flat, r), max_abs(flat, r), trimmed]
    };
    tally.fact("a clean image has finite errors", metrics(&clean).iter().all(|m| m.is_finite()));
    tally.fact("and no bad pixel", nonfinite(clean.as_flattened()) == 0);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut image = clean;
        image[1][1] = bad;
        let found = metrics(&image);
        tally.near(format!("{bad} is counted"), nonfinite(image.as_flattened()) as f64, 1.0, 0.0);
        // The trimmed error leaves the worst pixel out by design, infinite ones too; NaN has no rank and stays.
        let seen = if bad.is_nan() { &found[..] } else { &found[..4] };
        tally.fact(format!("{bad} shows in every metric: {found:?}"), seen.iter().all(|m| !m.is_finite()));
    }
    let mut negative = clean;
    negative[2][0] = -0.1;
    let found = smape(negative.as_flattened(), reference.as_flattened());
    tally.fact(format!("a negative pixel keeps SMAPE in [0, 1]: {found}"), (0.0..=1.0).contains(&found));
    tally.near("a negative pixel counts as what it is", max_abs(&[-0.1_f64], &[0.1]), 0.2, 1e-16);
    tally.saying("NaN, ∞ and −∞ are counted and make every metric that sees them not finite")
}

fn black_pixels(_: &Context) -> Finding {
    let (black, grey) = ([0.0_f32; 12], [0.5_f32; 12]);
    let mut tally = Tally::new();
    let textbook = f64::from(grey[0] * grey[0]) / f64::from(black[0] * black[0]);
    tally.fact(format!("d²/R² of a black reference is {textbook}"), !textbook.is_finite());
    tally.near("relMSE of grey against black", rel_mse(&grey, &black), 0.25 / REL_MSE_EPSILON, 1e-12);
    tally.near("relMSE of black against black", rel_mse(&black, &black), 0.0, 0.0);
    tally.near("SMAPE of black against black", smape(&black, &black), 0.0, 0.0);
    tally.near("SMAPE of grey against black", smape(&grey, &black), 1.0, 0.0);
    tally.saying("grey on black: relMSE 25, SMAPE 1; black on black: 0 and 0")
}

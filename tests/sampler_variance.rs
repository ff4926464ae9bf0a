//! The noise of every randomised sampler against exact variances: a slope hides a wrong constant, a closed form
//! does not.
//!
//! A replicate is the mean of f over one whole randomised set. Its squared errors are averaged over seeds and compared with
//! the exact variance by a t test on those squares, whose own spread carries their kurtosis. Seeds are fixed. The file's
//! tests share one family: at most 340 tests with a nominal rate of 5e-10. Studentised means of squares fall low too often
//! (skewness γ = 2.8: a factor exp(γ z³/(3√R)) = 6 at z = 6.9 and R = 20 000, 100 at R = 4000), so the family's
//! false-alarm rate is below 5e-8. False alarms: 5e-8. Rows of the reference that have an exact value (20 variances, 20 of E[L2*²]) are held to its own
//! tolerance besides, |z| < 5.8: 7e-9 each. False alarms: 3e-7.

use sampler_lab::check::samplers::laws::{AxisLaw, set_errors};
use sampler_lab::check::samplers::reading::Integrand;
use sampler_lab::check::samplers::scrambles::{burley_2020, owen_tree, plain_pair};
use sampler_lab::check::samplers::slopes::{COUNTS, INTEGRANDS as OF_SLOPES, TOLERANCE, slopes};
use sampler_lab::sampling::hash::{bits64, derive};
use sampler_lab::sampling::{Preset, SamplerSpec, point_set};
use sampler_lab::stats::discrepancy::{L2Kind, Points, l2_squared};
use sampler_lab::stats::{Family, Verdict, t_test, z_test};
use serde_json::Value;

const FAMILY: Family = Family { tests: 340, false_alarm: 5e-10 };

type Set = Vec<[f64; 2]>;

/// The integrands of `sampler_convergence.json` and two coordinates.
const INTEGRANDS: [(&str, Integrand); 7] = [
    ("disk", Integrand::Disk),
    ("triangle", Integrand::Diagonal),
    ("step", Integrand::Step),
    ("bilinear", Integrand::Product),
    ("gaussian", Integrand::Gaussian),
    ("x", Integrand::X),
    ("y", Integrand::Y),
];

fn integrand(name: &str) -> Integrand {
    let found = INTEGRANDS.into_iter().find(|i| i.0 == name);
    found.unwrap_or_else(|| panic!("an integrand, not {name}")).1
}

fn spec(text: &str) -> SamplerSpec {
    SamplerSpec::parse(text, Preset::Best).unwrap()
}

/// The sampler's own sets, one a seed.
fn sets(sampler: &str, n: u32) -> impl Fn(u64) -> Set {
    let spec = spec(sampler);
    move |seed| point_set(spec, n, seed).unwrap()
}

/// Errors of the mean of several integrands, one list an integrand, one entry a seed.
fn errors(names: &[&str], seeds: u64, set: &dyn Fn(u64) -> Set) -> Vec<Vec<f64>> {
    let integrands: Vec<Integrand> = names.iter().map(|name| integrand(name)).collect();
    let mut errors = vec![Vec::with_capacity(seeds as usize); names.len()];
    for seed in 0..seeds {
        let points = set(seed);
        for (errors, integrand) in errors.iter_mut().zip(&integrands) {
            errors.push(integrand.error(points.iter().copied()));
        }
    }
    errors
}

fn squares(errors: &[f64]) -> Vec<f64> {
    errors.iter().map(|e| e * e).collect()
}

/// The tolerance of the reference's README, at our own count of replicates.
fn assert_within_the_references_tolerance(what: &str, verdict: &Verdict) {
    assert!(verdict.holds() && verdict.statistic.is_none_or(|z| z.abs() < 5.8), "{what}: {verdict}");
}

/// Is the mean unbiased and its variance the exact one?
fn assert_exact(what: &str, errors: &[f64], variance: f64) {
    let tests: [(&str, Verdict); 2] =
        [("mean", t_test(errors, 0.0, FAMILY)), ("variance", t_test(&squares(errors), variance, FAMILY))];
    for (part, verdict) in tests {
        assert!(verdict.holds(), "{what}, {part}: {verdict}");
    }
}

fn reference() -> Value {
    serde_json::from_str(include_str!("reference/sampler_convergence.json")).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().or_else(|| value.as_str()?.parse().ok()).unwrap_or_else(|| panic!("a number, not {value}"))
}

/// Our name of a sampler of the reference.
fn ours(reference: &str) -> Option<&'static str> {
    Some(match reference {
        "random" => "uniform",
        "jittered" => "stratified:step:jitter",
        "owen_02" => "ld:step:owen",
        "xor_02" => "ld:step:xor",
        "halton_cp" => "halton:step:shift",
        "hammersley_cp" => "hammersley:step:shift",
        _ => return None,
    })
}

/// Every row of the reference for a sampler that we have: against the exact variance where there is one,
/// else against the independent simulation, whose own standard error counts.
#[test]
fn every_sampler_has_the_variance_of_the_reference() {
    let file = reference();
    let rows = file["mse"].as_array().unwrap();
    let mut exact = 0;
    for name in ["random", "jittered", "owen_02", "xor_02", "halton_cp", "hammersley_cp"] {
        for (n, seeds) in [(16, 20_000), (256, 4_000)] {
            let rows: Vec<&Value> = rows.iter().filter(|r| r["sampler"] == name && r["n"] == n).collect();
            let names: Vec<&str> = rows.iter().map(|r| r["integrand"].as_str().unwrap()).collect();
            assert_eq!(names.len(), 5);
            let sampler = ours(name).unwrap();
            let errors = errors(&names, seeds, &sets(sampler, n));
            for (row, errors) in rows.iter().zip(&errors) {
                let what = format!("{sampler}, n = {n}, {}", row["integrand"]);
                if row["exact_variance"].is_null() {
                    assert_same_as_simulated(&what, errors, number(&row["mse"]), number(&row["mse_std_error"]));
                } else {
                    assert_exact(&what, errors, number(&row["exact_variance"]));
                    let verdict = t_test(&squares(errors), number(&row["exact_variance"]), FAMILY);
                    assert_within_the_references_tolerance(&what, &verdict);
                    exact += 1;
                }
            }
        }
    }
    assert_eq!(exact, 20, "exact variances in the file");
}

/// All slopes of the file for the samplers that we have, ± 0.05 as its README asks, and the RMSE at n = 1024 within 15 % (theirs has
/// an error of 2 to 3 %, ours of 1.3 %). With 3000 replicates 0.05 is more than 8 standard errors of the difference: see
/// `check::samplers::slopes`, which also says what is exact in place of simulated.
#[test]
fn every_slope_of_the_reference_is_met() {
    let file = reference();
    let rows = file["slopes"].as_array().unwrap();
    let mut tried = 0;
    for name in ["random", "jittered", "owen_02", "xor_02", "halton_cp", "hammersley_cp"] {
        let (found, rmse) = slopes(spec(ours(name).unwrap()), 3000, |n, r| derive(7, &[u64::from(n), r]));
        let at_1024 = rmse[COUNTS.iter().position(|&n| n == 1024).unwrap()];
        for row in rows.iter().filter(|r| r["sampler"] == name) {
            let of = integrand(row["integrand"].as_str().unwrap());
            let k = OF_SLOPES.iter().position(|&i| i == of).unwrap();
            let (slope, value) = (number(&row["rmse_slope_n16_to_4096"]), number(&row["rmse_at_1024"]));
            assert!((found[k] - slope).abs() < TOLERANCE, "{name}, {of:?}: slope {} for {slope}", found[k]);
            assert!((at_1024[k] / value - 1.0).abs() < 0.15, "{name}, {of:?}: RMSE {} for {value}", at_1024[k]);
            tried += 1;
        }
    }
    assert_eq!(tried, 30);
}

/// E[L2*²] as the file has it, by the pair laws that the checks use.
#[test]
fn every_expected_l2_star_of_the_reference_is_met() {
    let file = reference();
    for row in file["expected_L2star"].as_array().unwrap() {
        let sampler = ours(row["sampler"].as_str().unwrap()).unwrap();
        let n = row["n"].as_u64().unwrap() as u32;
        let [x, y] = [0, 1].map(|axis| AxisLaw::of(spec(sampler), 0, axis, n, false));
        let (found, exact) = (set_errors(&x, &y).l2_star, number(&row["value"]));
        assert!((found / exact - 1.0).abs() < 1e-11, "{sampler}, n = {n}: {found} for {exact}");
    }
}

/// Both mean squares are estimates: their difference has the root of both squared standard errors.
fn assert_same_as_simulated(what: &str, errors: &[f64], mse: f64, standard_error: f64) {
    let squares: sampler_lab::stats::Moments = squares(errors).into_iter().collect();
    let error = libm::hypot(squares.standard_error().unwrap(), standard_error);
    let verdict = z_test(squares.mean().unwrap(), mse, error, FAMILY);
    assert!(verdict.holds(), "{what}: {verdict}");
}

#[test]
fn the_mean_of_a_coordinate_has_its_exact_variance() {
    for n in [4u32, 16, 64, 256] {
        let seeds = if n <= 64 { 20_000 } else { 4_000 };
        let n_f = f64::from(n);
        let (random, stratified, owen) = (1.0 / 12.0 / n_f, 1.0 / 12.0 / n_f.powi(2), 1.0 / 12.0 / n_f.powi(3));
        for (sampler, of_x, of_y) in [
            ("uniform", random, random),
            ("stratified:shuffle:jitter", stratified, stratified),
            ("ld:step:owen", owen, owen),
            ("ld:shuffle:owen", owen, owen),
            ("sobol:joint:owen", owen, owen),
            // One word for all points: the sum moves as a whole, n times worse than Owen. So `xor` is seen to be a shift.
            ("ld:step:xor", stratified, stratified),
            ("hammersley:step:xor", stratified, stratified),
            ("hammersley:step:shift", stratified, stratified),
            ("halton:step:shift", stratified, f64::NAN),
        ] {
            let errors = errors(&["x", "y"], seeds, &sets(sampler, n));
            assert_exact(&format!("{sampler}, n = {n}, x"), &errors[0], of_x);
            // Base 3 has no closed form for n = 2^m under a shift.
            if of_y.is_finite() {
                assert_exact(&format!("{sampler}, n = {n}, y"), &errors[1], of_y);
            }
        }
    }
}

/// With x = i/n not randomised, every pixel has mean x = ½ − 1/(2n): a bias, not noise; y has the shift's.
#[test]
fn an_unrandomised_axis_has_a_bias_and_no_variance() {
    for n in [16u32, 64] {
        let errors = errors(&["x", "y"], 20_000, &sets("hammersley:step:yxor", n));
        let bias = -0.5 / f64::from(n);
        assert!(errors[0].iter().all(|e| (e - bias).abs() < 1e-15), "n = {n}");
        assert_exact(&format!("hammersley:step:yxor, n = {n}, y"), &errors[1], 1.0 / 12.0 / f64::from(n).powi(2));
    }
}

/// E[L2*²]: random 5/(36n), jittered k × k ((k−1)/6 + 5/36)/n², Owen (5/36 + m/24)/n².
#[test]
fn the_mean_squared_l2_star_discrepancy_is_exact() {
    for (m, seeds) in [(0, 20_000u64), (2, 20_000), (4, 10_000), (6, 4_000), (8, 800)] {
        let n = 1u32 << m;
        let (n_f, k) = (f64::from(n), f64::from(1 << (m / 2)));
        for (sampler, exact) in [
            ("uniform", 5.0 / 36.0 / n_f),
            ("stratified:step:jitter", ((k - 1.0) / 6.0 + 5.0 / 36.0) / (n_f * n_f)),
            ("ld:step:owen", (5.0 / 36.0 + f64::from(m) / 24.0) / (n_f * n_f)),
            ("sobol:step:owen", (5.0 / 36.0 + f64::from(m) / 24.0) / (n_f * n_f)),
        ] {
            let set = sets(sampler, n);
            let values: Vec<f64> = (0..seeds).map(|seed| l2_star_squared(&set(seed))).collect();
            let verdict = t_test(&values, exact, FAMILY);
            assert_within_the_references_tolerance(&format!("{sampler}, n = {n}"), &verdict);
        }
    }
}

fn l2_star_squared(points: &Set) -> f64 {
    l2_squared(&Points::new_2d(points).unwrap(), L2Kind::Star).unwrap()
}

/// Exact mean squares of x, y and xy of a sampler's set.
fn exact_errors(sampler: &str, n: u32) -> [f64; 3] {
    let [x, y] = [0, 1].map(|axis| AxisLaw::of(spec(sampler), 0, axis, n, false));
    let exact = set_errors(&x, &y);
    [exact.x, exact.y, exact.product].map(|e| e.mean_square)
}

/// Owen scrambles of counts that are no powers of two, where only the pair sum is exact.
#[test]
fn owen_scrambles_of_odd_counts_have_their_exact_variance() {
    for n in [3u32, 12, 24, 48, 100] {
        let errors = errors(&["x", "y", "bilinear"], 10_000, &sets("ld:step:owen", n));
        for (errors, exact) in errors.iter().zip(exact_errors("ld:step:owen", n)) {
            assert_exact(&format!("ld:step:owen, n = {n}"), errors, exact);
        }
    }
}

#[test]
fn digit_scrambled_halton_has_its_exact_variance() {
    for n in [6u32, 16, 27, 36, 100] {
        let errors = errors(&["x", "y", "bilinear"], 10_000, &sets("halton:step:digits", n));
        for (errors, exact) in errors.iter().zip(exact_errors("halton:step:digits", n)) {
            assert_exact(&format!("halton:step:digits, n = {n}"), errors, exact);
        }
    }
    // n = bᵐ: one independent uniform point in each of n strata, 1/(12 n³).
    for (axis, base, n) in [(0, 2u32, 64u32), (1, 3, 27), (1, 3, 81)] {
        let exact = 1.0 / 12.0 / f64::from(n).powi(3);
        let errors = errors(&["x", "y"], 10_000, &sets("halton:step:digits", n));
        assert_exact(&format!("halton:step:digits, base {base}, n = {n}"), &errors[axis], exact);
    }
}

/// The plain pair under a scramble of each axis with a key of its own.
fn scrambled(n: u32, scramble: impl Fn(u32, u64) -> u32) -> impl Fn(u64) -> Set {
    let plain = plain_pair(n);
    move |seed| {
        let keys = [bits64(seed, 1), bits64(seed, 2)];
        let axis = |p: &[u32; 2], a: usize| f64::from(scramble(p[a], keys[a])) / 4_294_967_296.0;
        plain.iter().map(|p| [axis(p, 0), axis(p, 1)]).collect()
    }
}

/// The oracle: if these failed, the formulas would be wrong and not the hash.
#[test]
fn the_explicit_tree_has_the_same_exact_variances() {
    for n in [4u32, 16, 64] {
        let (n3, m) = (f64::from(n).powi(3), f64::from(n.trailing_zeros()));
        let set = scrambled(n, owen_tree);
        let errors = errors(&["x", "bilinear"], 10_000, &set);
        assert_exact(&format!("tree, n = {n}, x"), &errors[0], 1.0 / 12.0 / n3);
        assert_exact(&format!("tree, n = {n}, xy"), &errors[1], 7.0 * (4.0 + 3.0 * m) / 576.0 / n3);
        let l2: Vec<f64> = (0..4000).map(|seed| l2_star_squared(&set(seed))).collect();
        let exact = (5.0 / 36.0 + m / 24.0) / f64::from(n).powi(2);
        assert!(t_test(&l2, exact, FAMILY).holds(), "tree, n = {n}, E[L2*²]");
    }
}

/// The factors of `failures_measured.json`, which a slope plot would not show. Our own hash is within the
/// error of 1 in the same setting; theirs is refused by the test that ours passes.
#[test]
fn the_first_published_hash_of_2020_misses_owens_variance() {
    for (n, factor) in [(16u32, 0.466), (64, 0.276), (256, 0.256)] {
        let errors = errors(&["x"], 20_000, &scrambled(n, |f, key| burley_2020(f, key as u32)));
        let exact = 1.0 / 12.0 / f64::from(n).powi(3);
        let squares = squares(&errors[0]);
        assert!(!t_test(&squares, exact, FAMILY).holds(), "n = {n}");
        // The reference's factors have a standard error of 0.003, ours 0.5 % of 1.
        let ratio = squares.iter().sum::<f64>() / squares.len() as f64 / exact;
        assert!((ratio - factor).abs() < 0.03, "n = {n}: {ratio}");
    }
}

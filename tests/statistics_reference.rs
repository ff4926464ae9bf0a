//! The measures and statistics of `sampler_lab::stats` against reference values made elsewhere (`tests/reference/`,
//! its README).

use sampler_lab::stats::discrepancy::{
    L2Kind, Points, Side, Star, l2_root, l2_squared, min_toroidal_distance, star, star_2d, t_value,
};
use sampler_lab::stats::flip::{DEFAULT_PPD, Seen};
use sampler_lab::stats::hypothesis::{benjamini_hochberg, chi2_upper_tail, holm, sidak, welch};
use sampler_lab::stats::image_error::{bias, mae, max_abs, mse, mse_unbiased, rel_mse, smape};
use sampler_lab::stats::moments::{Moments, student_t_quantile};
use sampler_lab::stats::spectrum::{Spectrum, expected_of_jittered, power_at};
use serde_json::Value;

fn reference(name: &str) -> Value {
    let path = format!("{}/tests/reference/{name}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).expect("the reference file is in the repository");
    serde_json::from_str(&text).expect("valid JSON")
}

/// A JSON number, or a decimal string with more digits than f64 holds.
fn number(v: &Value) -> f64 {
    v.as_f64().or_else(|| v.as_str()?.parse().ok()).unwrap_or_else(|| panic!("a number, not {v}"))
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().expect("a list").iter().map(number).collect()
}

fn list(v: &Value) -> &Vec<Value> {
    v.as_array().expect("a list")
}

fn assert_close(ours: f64, truth: &Value, relative: f64, what: &str) {
    let truth = number(truth);
    assert!((ours - truth).abs() <= relative * truth.abs(), "{what}: {ours:e} against {truth:e}");
}

#[test]
fn moments_meet_the_reference() {
    for case in list(&reference("statistics.json")["moments"]) {
        let name = case["name"].as_str().expect("a name");
        let moments: Moments = numbers(&case["x"]).into_iter().collect();
        assert_eq!(moments.n(), case["n"].as_u64().expect("a count"), "{name}");
        assert_close(moments.mean().expect("values"), &case["mean"], 1e-15, name);
        for (ours, key) in [(moments.variance(), "variance_unbiased"), (moments.std(), "std")] {
            match ours {
                Some(ours) => assert_close(ours, &case[key], 1e-12, name),
                None => assert!(case[key].is_null(), "{name}: {key} is undefined"),
            }
        }
    }
}

#[test]
fn welch_tests_meet_the_reference() {
    for case in list(&reference("statistics.json")["welch"]) {
        let result = welch(&numbers(&case["a"]), &numbers(&case["b"])).expect("enough values");
        assert_close(result.t.expect("spread"), &case["t"], 1e-12, "t");
        assert_close(result.df.expect("spread"), &case["df"], 1e-12, "df");
        assert_close(result.p_two_sided, &case["p_two_sided"], 1e-12, "p");
    }
}

#[test]
fn multiplicity_corrections_meet_the_reference() {
    let reference = reference("statistics.json");
    let p = numbers(&reference["p_values"]);
    for (ours, key) in [(holm(&p), "holm"), (benjamini_hochberg(&p), "bh")] {
        let ours = ours.expect("probabilities");
        assert_eq!(ours.len(), p.len());
        ours.iter().zip(list(&reference[key])).for_each(|(ours, truth)| assert_close(*ours, truth, 1e-12, key));
    }
    for case in list(&reference["sidak_alpha"]) {
        let tests = case["tests"].as_u64().expect("a count");
        assert_close(sidak(number(&case["alpha"]), tests), &case["per_test"], 1e-12, "Šidák");
    }
}

/// The file gives 14 to 15 digits; one unit in the last of them is what 1e-12 or half of that digit allows.
#[test]
fn quantiles_and_tails_meet_the_reference() {
    let reference = reference("statistics.json");
    for case in list(&reference["t_quantiles"]) {
        let p = 0.5 + 0.5 * number(&case["confidence"]);
        assert_close(student_t_quantile(p, number(&case["df"])), &case["t"], 1e-12, "t quantile");
    }
    for case in list(&reference["chi2"]) {
        let p = chi2_upper_tail(number(&case["statistic"]), number(&case["df"]));
        assert_close(p, &case["p_upper"], 1e-12, "χ²");
    }
}

#[test]
fn image_metrics_meet_the_reference() {
    let reference = reference("statistics.json");
    let case = &reference["unbiased_mse"];
    let ours = mse_unbiased(&numbers(&case["T"]), &numbers(&case["R1"]), &numbers(&case["R2"]));
    assert_close(ours, &case["value"], 1e-12, "unbiased MSE");
    for case in list(&reference["images"]) {
        let flat = |v: &Value| list(v).iter().flat_map(list).flat_map(numbers).collect::<Vec<f64>>();
        let (a, b) = (flat(&case["a"]), flat(&case["b"]));
        let value = |name: &str| {
            let fields = case.as_object().expect("an object");
            fields.iter().find(|(key, _)| key.starts_with(name)).map(|(_, v)| v).expect("the metric").clone()
        };
        for (ours, name) in [
            (mse(&a, &b), "MSE"),
            (mse(&a, &b).sqrt(), "RMSE"),
            (mae(&a, &b), "MAE"),
            (bias(&a, &b), "bias"),
            (max_abs(&a, &b), "max_abs"),
            (rel_mse(&a, &b), "relMSE"),
            (smape(&a, &b), "SMAPE"),
        ] {
            assert_close(ours, &value(name), 1e-12, name);
        }
        let width = list(&case["a"])[0].as_array().expect("a row").len();
        let seen = |flat: &[f64]| {
            // The numbers are sRGB code values as shares of the largest.
            let decoded = |v: f64| if v <= 0.04045 { v / 12.92 } else { libm::pow((v + 0.055) / 1.055, 2.4) };
            let pixel = |p: usize| [flat[3 * p], flat[3 * p + 1], flat[3 * p + 2]].map(decoded);
            Seen::new(width, flat.len() / 3 / width, DEFAULT_PPD, pixel)
        };
        assert_close(seen(&a).flip(&seen(&b)).mean, &value("FLIP_mean"), 1e-4, "FLIP");
    }
}

/// φ_b(i) as one correctly rounded quotient of integers.
fn radical_inverse(base: u64, mut index: u64) -> f64 {
    let (mut digits, mut power) = (0, 1);
    while index > 0 {
        digits = digits * base + index % base;
        power *= base;
        index /= base;
    }
    digits as f64 / power as f64
}

/// The second dimension of Sobol': rows of Pascal's triangle modulo 2 are its direction numbers.
fn sobol_second(index: u32) -> f64 {
    let mut direction = 1_u32 << 31;
    let mut bits = 0;
    for k in 0..32 {
        if index >> k & 1 == 1 {
            bits ^= direction;
        }
        direction ^= direction >> 1;
    }
    f64::from(bits) / 4_294_967_296.0
}

fn halton23(n: usize) -> Points {
    let points: Vec<[f64; 2]> = (0..n as u64).map(|i| [radical_inverse(2, i), radical_inverse(3, i)]).collect();
    Points::new_2d(&points).expect("valid")
}

fn sobol02(n: usize) -> Points {
    let points: Vec<[f64; 2]> = (0..n as u32).map(|i| [radical_inverse(2, i.into()), sobol_second(i)]).collect();
    Points::new_2d(&points).expect("valid")
}

fn hammersley(m: u32) -> Points {
    let n = 1_u64 << m;
    let points: Vec<[f64; 2]> = (0..n).map(|i| [i as f64 / n as f64, radical_inverse(2, i)]).collect();
    Points::new_2d(&points).expect("valid")
}

/// Counts the points of the certificate's box anew.
fn assert_certified(points: &Points, found: &Star, name: &str) {
    let inside = |p: &&[f64]| p.iter().zip(&found.corner).all(|(x, q)| x < q || (x == q && found.side == Side::Closed));
    let share = points.iter().filter(inside).count() as f64 / points.n() as f64;
    let gap = (found.corner.iter().product::<f64>() - share).abs();
    assert!((gap - found.value).abs() <= 1e-15, "{name}: the box shows {gap}, not {}", found.value);
}

#[test]
fn small_sets_meet_their_exact_discrepancies() {
    let kinds = [
        ("L2star", L2Kind::Star),
        ("extreme", L2Kind::Extreme),
        ("CD", L2Kind::Centred),
        ("MD", L2Kind::Mixture),
        ("modified", L2Kind::Modified),
        ("symmetric", L2Kind::Symmetric),
        ("WD", L2Kind::WrapAround),
        ("periodic", L2Kind::Periodic),
        ("diaphony", L2Kind::Diaphony),
    ];
    let reference = reference("discrepancy.json");
    for case in list(&reference["cases"]) {
        let name = case["name"].as_str().expect("a name");
        let dimension = usize::try_from(case["d"].as_u64().expect("a dimension")).expect("small");
        let flat = match &case["points_f64"][0] {
            Value::Array(_) => list(&case["points_f64"]).iter().flat_map(list).map(number).collect(),
            _ => list(&case["points_f64"]).iter().map(number).collect(),
        };
        let points = Points::new(dimension, flat).expect("valid");
        assert_eq!(points.n() as u64, case["n"].as_u64().expect("a count"), "{name}");
        for (key, kind) in kinds {
            let (square, root) = (number(&case["values"][key]["squared"]), number(&case["values"][key]["root"]));
            let ours = l2_squared(&points, kind).expect("above resolution");
            assert!((ours - square).abs() <= 1e-11 * square, "{name} {key}: {ours:e} against {square:e}");
            let ours = l2_root(&points, kind).expect("above resolution");
            assert!((ours - root).abs() <= 1e-11 * root, "{name} {key} root: {ours:e} against {root:e}");
        }
        let found = star(&points, 1e6).expect("cheap");
        let truth = number(&case["values"]["star"]["value"]);
        assert!((found.value - truth).abs() <= 1e-14, "{name} star: {} against {truth}", found.value);
        assert_certified(&points, &found, name);
        // The reference's own box, which may be another one with the same gap; the set in one dimension is given without.
        let theirs = &case["values"]["star"]["attained_at"];
        let side = if theirs["box"] == "open" { Side::Open } else { Side::Closed };
        if theirs.is_object() {
            assert_certified(&points, &Star { value: truth, corner: numbers(&theirs["corner"]), side }, name);
        }
        let t = case["values"]["t_base2"].as_u64();
        assert_eq!(t_value(&points).map(u64::from), t, "{name} t");
        let distance = &case["values"]["min_toroidal_distance"];
        match min_toroidal_distance(&points) {
            // One point has no distance; the reference writes that as "inf".
            None => assert!(number(distance).is_infinite(), "{name}: {distance}"),
            Some(ours) => assert!((ours - number(distance)).abs() <= 1e-15, "{name} distance: {ours} {distance}"),
        }
    }
}

#[test]
fn every_prefix_meets_its_exact_star_discrepancy() {
    let reference = reference("star_prefixes.json");
    for (sequence, set) in [("halton23", halton23 as fn(usize) -> Points), ("sobol02", sobol02)] {
        for prefix in list(&reference["prefixes"][sequence]) {
            let points = set(usize::try_from(prefix["n"].as_u64().expect("a count")).expect("small"));
            let (numerator, denominator) = match prefix["star"].as_str().expect("a ratio").split_once('/') {
                Some((a, b)) => (a.parse::<f64>().expect("whole"), b.parse::<f64>().expect("whole")),
                None => (number(&prefix["star"]), 1.0),
            };
            let found = star_2d(&points);
            let name = format!("{sequence} {}", points.n());
            assert!((found.value - numerator / denominator).abs() <= 1e-14, "{name}: {}", found.value);
            assert_certified(&points, &found, &name);
        }
    }
}

/// Halton & Zaremba 1969, Vilenkin 1967; Hinrichs, Kritzinger & Pillichshammer: formulas for any m, here to 4096
/// points.
#[test]
fn hammersley_sets_meet_their_closed_forms() {
    let close = |ours: f64, truth: f64, relative: f64, what: &str, m: u32| {
        assert!((ours - truth).abs() <= relative * truth, "m = {m}, {what}: {ours:e} against {truth:e}");
    };
    for m in 2..=12 {
        let points = hammersley(m);
        let (n, m_) = (points.n() as f64, f64::from(m));
        let sign = if m % 2 == 0 { 1.0 } else { -1.0 };
        let truth = (m_ / 3.0 + 13.0 / 9.0 - sign * 4.0 / (9.0 * n)) / n;
        let found = star_2d(&points);
        assert!((found.value - truth).abs() <= 1e-14, "m = {m}: {} against {truth}", found.value);
        assert_certified(&points, &found, "Hammersley");
        let star =
            (m_ * m_ / 64.0 + 29.0 * m_ / 192.0 + 0.375 - m_ / (16.0 * n) + 0.25 / n - 1.0 / (72.0 * n * n)) / (n * n);
        let extreme = (m_ / 64.0 + 1.0 / 72.0 - 1.0 / (144.0 * n * n)) / (n * n);
        let periodic = (m_ / 16.0 + 1.0 / 9.0 + 1.0 / (36.0 * n * n)) / (n * n);
        for (kind, truth) in [(L2Kind::Star, star), (L2Kind::Extreme, extreme), (L2Kind::Periodic, periodic)] {
            close(l2_squared(&points, kind).expect("above resolution"), truth, 1e-9, &format!("{kind:?}"), m);
        }
        assert_eq!(t_value(&points), Some(0));
    }
}

#[test]
fn stored_hammersley_values_are_those_of_the_closed_forms() {
    for row in list(&reference("hammersley_closed_form.json")["rows"]) {
        let points = hammersley(u32::try_from(row["m"].as_u64().expect("m")).expect("small"));
        assert!((star_2d(&points).value - number(&row["star"]["value"])).abs() <= 1e-14);
        for (key, kind) in [
            ("L2star_squared", L2Kind::Star),
            ("extreme_squared", L2Kind::Extreme),
            ("periodic_squared", L2Kind::Periodic),
        ] {
            let (ours, truth) = (l2_squared(&points, kind).expect("above resolution"), number(&row[key]["value"]));
            assert!((ours - truth).abs() <= 1e-12 * truth, "{key} at {}: {ours:e} against {truth:e}", row["m"]);
        }
    }
}

/// A set of `discrepancy.json` by name.
fn stored_set(name: &str) -> Points {
    let reference = reference("discrepancy.json");
    let case = list(&reference["cases"]).iter().find(|case| case["name"] == name).expect("a stored set");
    Points::new(2, list(&case["points_f64"]).iter().flat_map(numbers).collect()).expect("valid")
}

/// The tolerance of the reference's README: 1e-12 n.
#[test]
fn powers_at_integer_frequencies_meet_the_reference() {
    let reference = reference("spectrum.json");
    for case in list(&reference["cases"]) {
        let name = case["set"].as_str().expect("a name");
        let points = stored_set(name.split(' ').next().expect("a word"));
        assert_eq!(points.n() as u64, case["n"].as_u64().expect("a count"), "{name}");
        let spectrum = Spectrum::of(&points, 64);
        for power in list(&case["P"]) {
            let nu = [0, 1].map(|k| i32::try_from(power["nu"][k].as_i64().expect("whole")).expect("small"));
            let truth = number(&power["value"]);
            let bound = 1e-12 * points.n() as f64;
            let among_all = spectrum.at(nu).expect("in reach");
            for ours in [power_at(&points, &nu), among_all] {
                assert!((ours - truth).abs() <= bound, "{name} P{nu:?}: {ours} against {truth}");
            }
        }
    }
}

/// The closed form to the digits of the file, and what was simulated there within six of its standard errors.
#[test]
fn expected_powers_of_jittered_sets_meet_the_reference() {
    for row in list(&reference("spectrum.json")["jittered_8x8_expectation"]) {
        let nu = [0, 1].map(|k| i32::try_from(row["nu"][k].as_i64().expect("whole")).expect("small"));
        let (ours, truth) = (expected_of_jittered(8, nu), number(&row["expected"]));
        assert!((ours - truth).abs() <= 1e-14, "{nu:?}: {ours} against {truth}");
        assert!(number(&row["z"]).abs() < 6.0);
        assert!((number(&row["simulated"]) - ours).abs() < 0.05, "{nu:?}");
    }
}

/// `hammersley_closed_form.json`: cell centres of k × k cells.
#[test]
fn grids_meet_the_stored_formula() {
    assert_eq!(reference("hammersley_closed_form.json")["formulas"]["grid_kxk_centres_star"], "1/k - 1/(4 k^2)");
    for k in [1_u32, 2, 4, 17, 128] {
        let side = f64::from(k);
        let centre = |i: u32| (f64::from(i) + 0.5) / side;
        let points: Vec<[f64; 2]> = (0..k * k).map(|i| [centre(i % k), centre(i / k)]).collect();
        let value = star_2d(&Points::new_2d(&points).expect("valid")).value;
        assert!((value - (1.0 / side - 0.25 / (side * side))).abs() <= 1e-14, "{k}: {value}");
    }
}

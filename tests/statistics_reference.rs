//! The statistics of `sampler_lab::stats` against reference values made elsewhere (`tests/reference/`, its README).

use sampler_lab::stats::hypothesis::{benjamini_hochberg, chi2_upper_tail, holm, sidak, welch};
use sampler_lab::stats::image_error::{bias, mae, max_abs, mse, mse_unbiased, rel_mse, smape};
use sampler_lab::stats::moments::{Moments, student_t_quantile};
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
        let tests = u32::try_from(case["tests"].as_u64().expect("a count")).expect("a small count");
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
    }
}

//! The checks of the group `samplers`, at a tenth of the false-alarm rate of the command `check`.
//! False alarms: stated in tests/failure_modes.rs, with those of all checks of the registry.
//! Each shows its finding; `cargo test --test sampler_certificates -- --nocapture` prints the table.

use sampler_lab::check::{Settings, all, run};

fn holds(wanted: &[&str]) {
    let settings = Settings { alpha: 1e-7, ..Settings::default() };
    let chosen: Vec<_> =
        all().into_iter().filter(|c| c.group == "samplers" && wanted.iter().any(|w| c.name.contains(w))).collect();
    assert!(chosen.len() >= wanted.len(), "{wanted:?}");
    for check in &chosen {
        let found = run(check, &settings).finding;
        let p = found.p_value.map_or(String::new(), |p| format!(", least p {p:.1e}"));
        let detects = found.detects.map_or(String::new(), |d| format!(", detects {d:.2e}"));
        println!("{}: {} tests{p}{detects}: {}", check.name, found.tests, found.says);
        assert!(found.passed, "{}: {}", check.claim, found.says);
    }
}

#[test]
fn variances_are_exact() {
    holds(&["variance-", "error-unrandomised"]);
}

#[test]
fn nets_are_nets_below_one() {
    holds(&["nets-", "numbers-stay"]);
}

#[test]
fn marginals_are_what_they_are_said_to_be() {
    holds(&["each-index", "exempt-indices"]);
}

#[test]
fn scrambles_are_what_their_names_say() {
    holds(&["owen-is", "owen-has", "xor-is", "shift-is", "digits-are", "digits-have"]);
}

#[test]
fn decisions_are_coupled_where_they_are_said_to_be() {
    holds(&["best-presets", "sheet-presets", "sheet-ld"]);
}

#[test]
fn slopes_are_the_references() {
    holds(&["slopes-"]);
}

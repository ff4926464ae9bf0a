//! The renderer's estimate of random scenes against closed forms: rectangle lights over a floor, pinhole or lens, and straight edges
//! over a pixel, sharp or defocused, each under one of the unbiased samplers. The generators are those of the checks
//! `random-scenes` and `random-edges`; here are more cases with more replicates, and each failure shows the scene, its exact value and the verdict.
//!
//! Student's t over whole images of independent seeds; each of the two families has a rate of 1e-8. False alarms: 2e-8. A test would catch a bias of
//! about nine standard errors: below 0.5 % of the radiance for half of the scenes and below 10 % for all, which the test itself checks. A missing
//! cosine, a wrong area, a pdf off by a factor, one decision reading another's numbers or a light leaking from
//! behind are all far above that.
//!
//! Rays start and end 2⁻¹⁸ of the coordinates off their surfaces: where a sampler's own error is smaller than that (a tiny light),
//! the closed form itself says how far such a displacement may move the result, and the test allows as much.

use std::cell::RefCell;

use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use sampler_lab::check::estimators::random::{Case, KINDS};
use sampler_lab::check::estimators::random_edge::EdgeCase;
use sampler_lab::stats::{Family, t_test};

const CASES: u32 = 120;
const REPLICATES: u64 = 96;

/// A statistical failure does not get simpler by shrinking: the first one found is shown.
fn runner(seed: u8) -> TestRunner {
    let config = Config { cases: CASES, failure_persistence: None, max_shrink_iters: 0, ..Config::default() };
    TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &[seed; 32]))
}

fn cases() -> impl Strategy<Value = Case> {
    (0..KINDS, prop::array::uniform16(0.0f64..1.0), 0usize..6)
        .prop_filter_map("the light is in the picture", |(kind, u, sampler)| Case::new(kind, u, sampler))
}

#[test]
fn random_scenes_have_the_radiance_of_their_closed_form() {
    let family = Family { tests: u64::from(CASES), false_alarm: 1e-8 };
    let caught: RefCell<Vec<f64>> = RefCell::default();
    let dark = RefCell::new(0);
    runner(29)
        .run(&cases(), |case| {
            let (exact, means) = (case.expected(), case.means(0..REPLICATES));
            if exact.value == 0.0 {
                *dark.borrow_mut() += 1;
                prop_assert!(means.iter().all(|&m| m == 0.0), "exactly nothing from behind");
                return Ok(());
            }
            let verdict = exact.test(&means, family);
            let detects = verdict.detects.unwrap() + exact.allowance;
            prop_assert!(exact.allowance < 0.005 * exact.value, "too much is allowed: {exact:?}");
            prop_assert!(verdict.holds(), "expected {exact:?}: {verdict}");
            caught.borrow_mut().push(detects / exact.value);
            Ok(())
        })
        .unwrap_or_else(|failure| panic!("{failure}"));
    let mut caught = caught.into_inner();
    caught.sort_by(f64::total_cmp);
    assert!(caught.len() > 60 && dark.into_inner() > 0, "{} lit scenes", caught.len());
    let (median, worst) = (caught[caught.len() / 2], caught[caught.len() - 1]);
    assert!(median < 0.005 && worst < 0.1, "biases caught: {median} in the middle, {worst} at worst");
}

/// Samples are 0 or 1, so a pixel's mean over 16 of them, one a seed, has a spread of at most 1/8: 2048 seeds catch 3 % of the pixel.
#[test]
fn random_edges_cover_a_pixel_as_their_closed_form_says() {
    let family = Family { tests: u64::from(CASES), false_alarm: 1e-8 };
    let edges = (prop::array::uniform6(0.0f64..1.0), 0usize..6)
        .prop_filter_map("hardly any of the pixel", |(u, sampler)| EdgeCase::new(u, sampler));
    runner(31)
        .run(&edges, |case| {
            let exact = case.exact();
            let verdict = t_test(&case.means(0..2048), exact, family);
            prop_assert!(verdict.holds(), "expected {exact}: {verdict}");
            prop_assert!(verdict.detects.is_none_or(|bias| bias < 0.03), "{verdict}");
            Ok(())
        })
        .unwrap_or_else(|failure| panic!("{failure}"));
}

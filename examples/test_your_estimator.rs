//! Property-test an estimator of your own over random scenes, and let proptest shrink what fails to the smallest scene.
//!
//! ```sh
//! cargo run --release --example test_your_estimator
//! ```
//!
//! The estimator below – irradiance of a rectangle light at a point, by its own code with its own random numbers – stands for
//! yours; nothing of it comes from the library. The library gives the exact value (`analytic::PolygonLight`) and the test
//! (`stats::Trial`). The same estimator with two planted mistakes has to be caught: one per cent too bright where the receiver is
//! tilted, and the light's cosine forgotten. Exit code 0 when all went as promised, 1 otherwise.

use std::cell::{Cell, RefCell};
use std::process::ExitCode;

use glam::DVec3;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestError, TestRng, TestRunner};
use sampler_lab::analytic::{PolygonLight, Receiver};
use sampler_lab::stats::{Agreement, Decision, Family, Trial};

/// Random scenes of one property.
const CASES: u32 = 100;
/// Most tests that shrinking may add.
const SHRINKS: u32 = 200;
/// Independent estimates of each scene, and samples in each. Few long replicates rather than many short ones: a mean of
/// many samples is nearer to the normal distribution that Student's t supposes.
const REPLICATES: u32 = 48;
const SAMPLES: u32 = 4096;

/// How often one of the runs below may call a right estimator wrong in any scene.
///
/// Every test that may be run is counted: the random scenes *and* what shrinking tries again. To fail a right estimator takes an
/// alarm among the first; but the smallest failing scene is chosen among the second, and that it is a true failure should be as
/// sure. Each scene's seed is a hash of the scene, so that what is tried later is independent of why it is tried.
const FAMILY: Family = Family { tests: (CASES + SHRINKS) as u64, false_alarm: 1e-6 };

/// A receiver at the origin, its normal tilted from z towards x, below a light parallel to the xy plane.
///
/// In whole numbers, which shrink to round ones: degrees, and hundredths of a scene unit.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Scene {
    tilt_degrees: u32,
    height: u32,
    shift_x: u32,
    half_x: u32,
    half_y: u32,
}

impl Scene {
    fn normal(&self) -> DVec3 {
        let tilt = f64::from(self.tilt_degrees).to_radians();
        DVec3::new(tilt.sin(), 0.0, tilt.cos())
    }

    /// Centre and half edges of the light.
    fn light(&self) -> [DVec3; 3] {
        let units = |hundredths: u32| f64::from(hundredths) / 100.0;
        let centre = DVec3::new(units(self.shift_x), 0.0, units(self.height));
        [centre, DVec3::X * units(self.half_x), DVec3::Y * units(self.half_y)]
    }

    /// The exact irradiance for an emission of 1.
    fn exact(&self) -> f64 {
        let [c, x, y] = self.light();
        // Counter-clockwise seen from below, the side that emits.
        let light = PolygonLight { corners: vec![c - x - y, c - x + y, c + x + y, c + x - y], emission: 1.0 };
        light.irradiance(&Receiver { point: DVec3::ZERO, normal: self.normal() })
    }

    /// A seed of this scene's own.
    fn seed(&self) -> u64 {
        let words = [self.tilt_degrees, self.height, self.shift_x, self.half_x, self.half_y];
        words.iter().fold(1, |hash, &word| scramble(hash ^ u64::from(word)))
    }
}

/// What may be wrong with the estimator.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mistake {
    None,
    /// 1 % too bright where the receiver is tilted by more than 20°.
    BrightWhereTilted,
    /// cos θ of the receiver, but not of the light.
    LightCosineForgotten,
}

/// Your estimator: the mean over points of the light of cos θ · cos θ_l · area / r².
fn irradiance(scene: &Scene, seed: u64, mistake: Mistake) -> f64 {
    let [centre, x, y] = scene.light();
    let (normal, area) = (scene.normal(), 4.0 * x.length() * y.length());
    let mut state = seed;
    let mut uniform = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (scramble(state) >> 11) as f64 * 0.5f64.powi(53)
    };
    let mut total = 0.0;
    for _ in 0..SAMPLES {
        let to_light = centre + x * (2.0 * uniform() - 1.0) + y * (2.0 * uniform() - 1.0);
        let square = to_light.length_squared();
        let direction = to_light / square.sqrt();
        let light_cosine = if mistake == Mistake::LightCosineForgotten { 1.0 } else { direction.z };
        total += normal.dot(direction).max(0.0) * light_cosine * area / square;
    }
    let bright = mistake == Mistake::BrightWhereTilted && scene.tilt_degrees > 20;
    total / f64::from(SAMPLES) * if bright { 1.01 } else { 1.0 }
}

/// SplitMix64's finaliser.
fn scramble(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// The property, in one line: over this scene's seeds the estimator's expectation is the exact irradiance.
fn agreement(scene: &Scene, mistake: Mistake) -> Agreement {
    Trial::new(REPLICATES, FAMILY)
        .seeded(scene.seed())
        .of(|seed| irradiance(scene, seed, mistake))
        .against(scene.exact())
}

/// Random scenes: receivers that are level or tilted up to 80°, lights that are near, far, small, large and off to the side.
fn scenes() -> impl Strategy<Value = Scene> {
    (0_u32..=80, 20_u32..=300, 0_u32..=200, 5_u32..=100, 5_u32..=100).prop_map(
        |(tilt_degrees, height, shift_x, half_x, half_y)| Scene { tilt_degrees, height, shift_x, half_x, half_y },
    )
}

/// What a run of the property found.
struct Found {
    /// The smallest failing scene, where one fails.
    smallest: Option<Scene>,
    /// The first one that failed.
    first: Option<Scene>,
    tests: u32,
    /// Of the scenes that passed, the relative bias that each would have caught, in order.
    detects: Vec<f64>,
}

fn run(mistake: Mistake) -> Found {
    let config = Config { cases: CASES, max_shrink_iters: SHRINKS, failure_persistence: None, ..Config::default() };
    // A fixed seed: the property always passes or always fails.
    let mut runner = TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &[7; 32]));
    let (tests, first, detects) = (Cell::new(0), Cell::new(None), RefCell::new(Vec::new()));
    let outcome = runner.run(&scenes(), |scene| {
        tests.set(tests.get() + 1);
        let agreement = agreement(&scene, mistake);
        if agreement.holds() {
            detects.borrow_mut().extend(agreement.detects_relative());
        } else if first.get().is_none() {
            first.set(Some(scene));
        }
        prop_assert!(agreement.holds(), "{agreement}");
        Ok(())
    });
    let smallest = match outcome {
        Ok(()) => None,
        Err(TestError::Fail(_, scene)) => Some(scene),
        Err(TestError::Abort(why)) => panic!("the scenes cannot be generated: {why}"),
    };
    let mut detects = detects.into_inner();
    detects.sort_by(f64::total_cmp);
    Found { smallest, first: first.get(), tests: tests.get(), detects }
}

/// The right estimator: no scene fails, and what each test would have caught is small.
fn the_right_one_passes() -> bool {
    let found = run(Mistake::None);
    let [middle, last] = [found.detects.len() / 2, found.detects.len().saturating_sub(1)]
        .map(|i| found.detects.get(i).copied().unwrap_or(f64::NAN));
    println!(
        "right estimator: {} of {CASES} scenes agree with the exact irradiance; a right one fails here once in {:.0} runs",
        found.tests - u32::from(found.smallest.is_some()),
        1.0 / FAMILY.false_alarm
    );
    println!("    a bias of {:.2} % is caught in half of the scenes, of {:.2} % in all", 100.0 * middle, 100.0 * last);
    if let Some(scene) = found.smallest {
        println!("    not so: {scene:?}: {}", agreement(&scene, Mistake::None));
    }
    found.smallest.is_none() && found.tests == CASES && last < 0.1
}

/// A wrong one: caught, shrunk, and the smallest scene is a failure by itself as `is_small` says.
fn the_wrong_one_is_caught(what: &str, mistake: Mistake, is_small: impl Fn(&Scene) -> bool) -> bool {
    let found = run(mistake);
    let (Some(first), Some(smallest)) = (found.first, found.smallest) else {
        println!("{what}: not caught in {} scenes", found.tests);
        return false;
    };
    println!("{what}: caught, and shrunk in {} tests", found.tests);
    println!("    from {first:?}");
    println!("    to   {smallest:?}  (degrees, hundredths of a unit)");
    let agreement = agreement(&smallest, mistake);
    println!("    {agreement}");
    agreement.decision() == Decision::Fails && is_small(&smallest)
}

fn main() -> ExitCode {
    let right = the_right_one_passes();
    let bright = the_wrong_one_is_caught("1 % too bright beyond 20°", Mistake::BrightWhereTilted, |scene| {
        // Shrinking finds the edge: below 21° there is nothing to find.
        (21..=25).contains(&scene.tilt_degrees)
    });
    let cosine = the_wrong_one_is_caught("the light's cosine forgotten", Mistake::LightCosineForgotten, |scene| {
        scene.tilt_degrees == 0 && scene.shift_x == 0
    });
    if right && bright && cosine {
        println!("all as promised");
        ExitCode::SUCCESS
    } else {
        println!("not as promised");
        ExitCode::from(1)
    }
}

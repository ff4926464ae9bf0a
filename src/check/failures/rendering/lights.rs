//! Rows 43 to 46 and 50 to 53: points too near a light, its dark side, degenerate triangles, the choice among lights, points
//! of a triangle.

use std::f64::consts::PI;

use glam::{DVec3, Vec2, Vec3};

use super::{Check, Context, Finding, LIGHTS, row};
use crate::analytic::{Receiver, variance_of_one_area_sample};
use crate::check::estimators::scale::floor_camera;
use crate::check::estimators::uniform_points;
use crate::check::room::{Exact, Room, ceiling, floor_pixels, grey, polygon_light, rendered, replicates, spec};
use crate::check::{Kind, Tally};
use crate::render::light_contribution;
use crate::sampling::warp::square_to_triangle;
use crate::scene::compile::{Scene, Stage};
use crate::scene::geometry::SurfacePoint;
use crate::scene::light::{Light, LightSet, pick_light};
use crate::stats::moments::{Moments, t_interval};
use crate::stats::{chi2_test, t_test};

/// The checks of this file.
pub fn checks() -> Vec<Check> {
    vec![
        row(
            LIGHTS,
            &[43],
            "point-on-light",
            "1/r² in single precision is infinite from r = 1e-20 on; ours is A/h² down to the rays' offset, finite below it, 0 behind",
            Kind::Exact,
            point_on_light,
        ),
        row(
            LIGHTS,
            &[44],
            "point-near-light",
            "close to a light (h ≪ 1) a sample has variance A π/(3h²) and kurtosis 9A/(7π h²): 95 % intervals of 64 samples cover far less",
            Kind::Statistical,
            point_near_light,
        ),
        row(
            LIGHTS,
            &[45],
            "behind-light",
            "in a light's plane, behind it, or facing away: exactly 0, closed form and samples alike",
            Kind::Exact,
            behind_light,
        ),
        row(
            LIGHTS,
            &[46],
            "absolute-cosines",
            "an absolute value on the cosines lets a flipped light shine as if it were not flipped; ours is exactly 0",
            Kind::Exact,
            absolute_cosines,
        ),
        row(
            LIGHTS,
            &[50],
            "degenerate-triangles",
            "triangles without area add nothing to a light and are never chosen; a light of nothing else is no light",
            Kind::Exact,
            degenerate_triangles,
        ),
        row(
            LIGHTS,
            &[51],
            "no-light",
            "without light all but emitters is black, with a warning; a light of power 0 is not even chosen from",
            Kind::Exact,
            no_light,
        ),
        row(
            LIGHTS,
            &[51],
            "lights-1e-30-and-1e30",
            "power 1e-30 beside 1e30 underflows to probability 0/0 in single precision; ours divides by what it picked with: exact mean",
            Kind::Statistical,
            wide_powers,
        ),
        row(
            LIGHTS,
            &[52],
            "pick-at-one",
            "u = 1 − 2^-24 picks index = count where probabilities are summed in single precision; ours picks the last light",
            Kind::Exact,
            pick_at_one,
        ),
        row(
            LIGHTS,
            &[53],
            "triangle-without-root",
            "without the square root a triangle's points crowd at a corner (mean weights 1/2, 1/4, 1/4); ours are uniform: moments and χ²",
            Kind::Statistical,
            triangle_without_root,
        ),
    ]
}

const OFFSET: f32 = 1.0 / 262_144.0;

/// A receiver at (x, y, z) that faces up.
fn facing_up(position: Vec3) -> SurfacePoint {
    SurfacePoint { position, normal: Vec3::Z, face_normal: Vec3::Z, uv: Vec2::ZERO, material: 0, offset: OFFSET }
}

/// The unit square at height z that shines downwards.
fn square(z: f32) -> [Vec3; 4] {
    [(-0.5, -0.5), (-0.5, 0.5), (0.5, 0.5), (0.5, -0.5)].map(|(x, y)| Vec3::new(x, y, z))
}

fn light(c: &[Vec3; 4]) -> Light {
    Light::new("light".to_owned(), Vec3::ONE, &[[c[0], c[1], c[2]], [c[0], c[2], c[3]]]).expect("a light with an area")
}

fn samples(light: &Light, from: &SurfacePoint, seed: u64, n: u32) -> Vec<f64> {
    let value = |u| light_contribution(light, u, from).map_or(0.0, |(radiance, _)| f64::from(radiance.x));
    uniform_points(seed, n).map(value).collect()
}

/// A light in the plane z = 0 and points below its inside at distances of 1e-3 to 1e-20, aimed at by the light's own point straight
/// above. Down to the rays' offsets (2⁻¹⁸ of the coordinates at either end) the sample is A/h²; nearer than that it is what a point
/// that far off receives, since no nearer one can be told apart from the light.
fn point_on_light(_: &Context) -> Finding {
    let light = light(&square(0.0));
    // The number that names the light's point above (1/8, 1/4).
    let u = (0..256)
        .flat_map(|i| (0..256).map(move |j| Vec2::new(i as f32, j as f32) / 256.0))
        .find(|&u| light.point(u).position.truncate() == Vec2::new(0.125, 0.25))
        .expect("the light's point above the receiver");
    let sample = |z: f32| {
        let from = facing_up(Vec3::new(0.125, 0.25, z));
        light_contribution(&light, u, &from).map_or(0.0, |(radiance, _)| f64::from(radiance.x))
    };
    // The receiver's own offset less the light's, whose coordinates are 1/2.
    let (offset, nearest) = (f64::from(OFFSET), 0.5 * f64::from(OFFSET));
    let mut tally = Tally::new();
    for exponent in 3..=20 {
        let h = libm::exp10(-f64::from(exponent));
        let (found, behind) = (sample(-h as f32), sample(h as f32));
        let most = 1.001 / (h - 1.5 * offset).max(nearest).powi(2);
        tally.fact(format!("h = {h:e}: {found:e} is finite, at most {most:e}"), (0.0..=most).contains(&found));
        if h > 10.0 * offset {
            let least = 0.999 / (h * h);
            tally.fact(format!("h = {h:e}: {found:e} is not capped, at least {least:e}"), found >= least);
            tally.fact(format!("{h:e} behind the light: {behind}"), behind == 0.0);
        }
    }
    let literal = |h: f32| 1.0 / (h * h);
    tally.fact("1/r² is infinite at 1e-20", literal(1e-20) == f32::INFINITY && literal(1e-18).is_finite());
    tally.saying(format!(
        "a sample at h = 1e-3: {:.3e}, at 1e-4: {:.3e}, at 1e-20: {:.3e}; 1/r² at 1e-20: {}",
        sample(-1e-3),
        sample(-1e-4),
        sample(-1e-20),
        literal(1e-20)
    ))
}

/// At h = 1e-6 by the closed form, at h = 0.01 by samples: a million of them have the right mean and a kurtosis of the order of
/// 9A/(7π h²) = 4093, and of 1000 intervals of 64 samples each, stated at 95 %, less than 80 % hold the mean.
fn point_near_light(context: &Context) -> Finding {
    let form = polygon_light(&square(1.0), 1.0);
    let below = |h: f64| Receiver { point: DVec3::new(0.1, 0.2, 1.0 - h), normal: DVec3::Z };
    let mut tally = Tally::new();
    for h in [1e-3, 1e-6] {
        let ratio = variance_of_one_area_sample(&form, &below(h), None) / (PI / (3.0 * h * h));
        tally.near(format!("h = {h:e}: variance over A π/(3h²)"), ratio, 1.0, 10.0 * h * h + 1e-7);
    }
    let h = 0.01;
    let n = context.replicates(1 << 20, 1 << 14);
    let from = facing_up(Vec3::new(0.1, 0.2, 1.0 - h as f32));
    let values = samples(&light(&square(1.0)), &from, context.seed, n);
    // Rays are moved by 2⁻¹⁸ at either end, which is 8e-4 of h: the irradiance stays π, the variance grows by twice that.
    let exact = Exact { value: form.irradiance(&below(h)), allowance: 1e-4 };
    tally.verdict("mean at h = 0.01", &exact.test(&values, context.family(1)), exact.value);
    let (mut second, mut fourth) = (0.0, 0.0);
    for value in &values {
        let square = (value - exact.value).powi(2);
        second += square / f64::from(n);
        fourth += square * square / f64::from(n);
    }
    let (kurtosis, expected) = (fourth / (second * second), 9.0 / (7.0 * PI * h * h));
    tally.fact(
        format!("kurtosis {kurtosis:.0}, of the order of {expected:.0}: heavy-tailed"),
        (0.5..2.0).contains(&(kurtosis / expected)),
    );
    let few = &values[..values.len().min(64_000)];
    let covered = few
        .chunks_exact(64)
        .filter(|run| t_interval(run, 0.95).ci95.is_some_and(|[low, high]| (low..=high).contains(&exact.value)));
    let share = covered.count() as f64 / (few.len() / 64) as f64;
    tally.fact(format!("{:.1} % of the intervals of 64 samples hold the mean", 100.0 * share), share < 0.8);
    tally.saying(format!(
        "h = 0.01: kurtosis {kurtosis:.0}; a 95 % interval of 64 samples holds the mean in {:.1} %",
        100.0 * share
    ))
}

fn behind_light(context: &Context) -> Finding {
    let (c, mut tally) = (square(1.0), Tally::new());
    let (form, light) = (polygon_light(&c, 1.0), light(&c));
    let cases = [
        ("in its plane", Vec3::new(2.0, 0.0, 1.0), Vec3::NEG_X),
        ("just above its plane", Vec3::new(2.0, 0.0, 1.001), Vec3::NEG_X),
        ("behind it", Vec3::new(0.0, 0.0, 2.0), Vec3::NEG_Z),
        ("below it, facing away", Vec3::ZERO, Vec3::NEG_Z),
        ("beside it, facing away", Vec3::new(-0.51, 0.0, 0.0), Vec3::NEG_X),
    ];
    for (name, position, normal) in cases {
        let at = Receiver { point: position.as_dvec3(), normal: normal.as_dvec3() };
        let from = SurfacePoint { normal, face_normal: normal, ..facing_up(position) };
        let lit = samples(&light, &from, context.seed, 4096).iter().filter(|&&v| v != 0.0).count();
        let value = form.irradiance(&at);
        tally.fact(format!("{name}: closed form {value}, {lit} of 4096 samples lit"), value == 0.0 && lit == 0);
    }
    tally.saying("in the plane, behind, facing away: 0 of 5 × 4096 samples lit")
}

fn absolute_cosines(context: &Context) -> Finding {
    let c = square(1.0);
    let flipped = [c[3], c[2], c[1], c[0]];
    let from = facing_up(Vec3::ZERO);
    let ours = samples(&light(&flipped), &from, context.seed, 4096);
    // The mistake by hand, with the light as it should have been: |cos| |cos| A / r² does not know the winding.
    let absolute = |u: Vec2| {
        let to = light(&flipped).point(u);
        let way = (to.position - from.position).as_dvec3();
        let omega = way.normalize();
        (omega.dot(DVec3::Z) * omega.dot(to.normal.as_dvec3())).abs() / way.length_squared()
    };
    let wrong = uniform_points(context.seed, 4096).map(absolute).sum::<f64>() / 4096.0;
    let leaked = polygon_light(&c, 1.0).irradiance(&Receiver { point: DVec3::ZERO, normal: DVec3::Z });
    let mut tally = Tally::new();
    tally.fact("flipped: every sample is 0", ours.iter().all(|&v| v == 0.0));
    tally.near("with absolute values the whole irradiance leaks", wrong, leaked, 0.02 * leaked);
    tally.saying(format!(
        "flipped light: ours 0, with absolute values {wrong:.3} (the front's irradiance is {leaked:.3})"
    ))
}

/// The literal normal and density of such a triangle are 0/0.
fn degenerate_triangles(context: &Context) -> Finding {
    let quad = ceiling(Vec3::new(0.2, 2.0, 0.0), 0.5, 0.5);
    let (spike, point) = ([quad[0], quad[1], quad[0]], [quad[2]; 3]);
    let build = |degenerate: bool| {
        let mut room = Room::default();
        room.floor(5.0, 0.6);
        let glow = room.material(1.0, Some(3.0));
        if degenerate {
            room.triangle(spike, glow);
            room.triangle(point, glow);
        }
        room.polygon(&quad, glow);
        room.scene(&floor_camera(), (6, 6), Stage::Final)
    };
    let [plain, degenerate] = [false, true].map(|d| rendered(&build(d), spec("sobol"), 16, context.seed));
    let mut tally = Tally::new();
    tally.fact("with two degenerate triangles: the same bits, all finite", plain == degenerate);
    let mut room = Room::default();
    room.floor(5.0, 0.6);
    room.light(&spike, 3.0);
    let scene = room.scene(&floor_camera(), (4, 4), Stage::Final);
    tally.fact("a light of nothing else is no light", matches!(scene.lights, Some(LightSet::Dark)));
    tally.fact("and a warning says so", !scene.warnings.is_empty());
    let black = grey(&rendered(&scene, spec("sobol"), 4, context.seed)).iter().all(|&c| c == 0.0);
    tally.fact("its picture is black", black);
    let [a, b, c] = spike;
    let literal = (b - a).cross(c - a) / (b - a).cross(c - a).length();
    tally.fact(format!("the literal normal is {literal}"), literal.is_nan());
    tally.saying(format!("same bits with and without; the literal normal would be {literal}"))
}

/// A floor under two lights of these emissions.
fn two_lights(emissions: [f32; 2]) -> Scene {
    let mut room = Room::default();
    room.floor(5.0, 0.6);
    room.light(&ceiling(Vec3::new(0.0, 2.0, 0.0), 0.5, 0.5), emissions[0]);
    room.light(&ceiling(Vec3::new(1.0, 2.0, 0.0), 0.5, 0.5), emissions[1]);
    room.scene(&floor_camera(), (4, 4), Stage::Final)
}

fn no_light(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let mut empty = Room::default();
    empty.floor(5.0, 0.6);
    for (name, scene) in
        [("no light", empty.scene(&floor_camera(), (4, 4), Stage::Final)), ("two of power 0", two_lights([0.0, 0.0]))]
    {
        let black = grey(&rendered(&scene, spec("sobol"), 4, context.seed)).iter().all(|&c| c == 0.0);
        tally.fact(format!("{name}: black, with a warning"), black && !scene.warnings.is_empty());
        let none = matches!(scene.lights, Some(LightSet::Dark)) && scene.layout.claims().len() == 1;
        tally.fact(format!("{name}: nothing is decided about lights"), none);
    }
    let scene = two_lights([0.0, 3.0]);
    let alone = matches!(&scene.lights, Some(LightSet::One { light, .. }) if light.emission.x > 0.0);
    tally.fact("one of power 0 beside another: one light, no choice", alone && scene.layout.claims().len() == 2);
    tally.saying("black with a warning; a light of power 0 is left out and no number is spent on the choice")
}

/// Each probability is the share of the numbers that pick the light, one step of 2⁻²⁴ at least, so that u = 0, which unrandomised
/// sets give to every pixel's first sample, divides by no 0.
fn wide_powers(context: &Context) -> Finding {
    let family = context.family(2 * 16);
    let mut tally = Tally::new();
    for (part, order) in [[1e-30, 1e30], [1e30, 1e-30]].into_iter().enumerate() {
        let scene = two_lights(order);
        let Some(LightSet::Many { pmf, cumulative, .. }) = &scene.lights else {
            return Finding::broken("expected two lights to choose from".to_owned());
        };
        let sum: f64 = pmf.iter().map(|&p| f64::from(p)).sum();
        tally.fact(
            format!("probabilities {pmf:?} are above 0, their sum 1"),
            pmf.iter().all(|&p| p > 0.0) && sum == 1.0,
        );
        let mut before = 0.0;
        for (&p, &up_to) in pmf.iter().zip(cumulative) {
            tally.near("numbers that pick it", up_to - before, f64::from(p), 0.0);
            before = up_to;
        }
        for name in ["halton:plain", "halton:joint:none", "ld:sheet", "sobol"] {
            let finite = grey(&rendered(&scene, spec(name), 32, context.seed)).iter().all(|c| c.is_finite());
            tally.fact(format!("{order:?}, {name}: all finite"), finite);
        }
        // One light alone is the picture, to 10⁻⁶⁰.
        let bright = Vec3::new(if order[0] > 1.0 { 0.0 } else { 1.0 }, 2.0, 0.0);
        let bright = polygon_light(&ceiling(bright, 0.5, 0.5), 1e30);
        let exact = floor_pixels(&floor_camera(), (4, 4), (5.0, 0.6), bright, None);
        let images = replicates(&scene, spec("sobol"), 64, (0..64).map(|i| context.seed_of(part as u64, i)));
        for (pixel, exact) in exact.iter().enumerate() {
            let values: Vec<f64> = images.iter().map(|i| i[pixel]).collect();
            tally.verdict(format!("{order:?}, pixel {pixel}"), &exact.test(&values, family), exact.value);
        }
    }
    let literal = 1e-30_f32 / (1e-30_f32 + 1e30_f32);
    tally.fact(format!("the literal probability of the weak light is {literal}"), literal == 0.0);
    tally.saying("the weak light has 1 of 2^24 numbers where single precision has p = 0; all pixels have the strong light's exact mean")
}

/// Equal lights, 2 to 300 of them: how often does the search run off the end of a sum in single precision?
fn pick_at_one(_: &Context) -> Finding {
    let largest = 1.0 - f32::EPSILON / 2.0;
    let mut tally = Tally::new();
    let mut off_the_end = Vec::new();
    for count in 2..=300_usize {
        let mut sum = 0.0_f32;
        let literal: Vec<f32> = (0..count)
            .map(|_| {
                sum += 1.0 / count as f32;
                sum
            })
            .collect();
        if literal.partition_point(|&c| c <= largest) == count {
            off_the_end.push(count);
        }
    }
    tally.fact(format!("{} of 299 literal sums end at or below u", off_the_end.len()), off_the_end.len() > 50);
    for count in [2, 3, off_the_end.first().copied().unwrap_or(7), 300] {
        let mut room = Room::default();
        for i in 0..count {
            room.light(&ceiling(Vec3::new(i as f32, 2.0, 0.0), 0.4, 0.4), 1.0);
        }
        let scene = room.scene(&floor_camera(), (1, 1), Stage::Final);
        let Some(LightSet::Many { cumulative, .. }) = &scene.lights else {
            return Finding::broken(format!("expected {count} lights to choose from"));
        };
        let (first, last) = (pick_light(cumulative, 0.0), pick_light(cumulative, largest));
        tally.fact(format!("{count} lights: 0 picks {first}, 1 − 2^-24 picks {last}"), first == 0 && last == count - 1);
    }
    // A mesh of unequal triangles takes its triangle from the same kind of sum.
    let corner = |i: usize| Vec3::new(libm::cos(i as f64) as f32, 1.0, libm::sin(i as f64) as f32);
    let triangles: Vec<[Vec3; 3]> = (0..61).map(|i| [Vec3::Y, corner(i), corner(i + 1)]).collect();
    let mesh = Light::new("mesh".to_owned(), Vec3::ONE, &triangles).expect("a light with an area");
    for u in [Vec2::ZERO, Vec2::splat(largest), Vec2::new(0.0, largest), Vec2::new(largest, 0.0)] {
        let p = mesh.point(u).position;
        tally.fact(format!("mesh, u = {u}: {p} is on the light"), p.is_finite() && p.length() <= 2.0);
    }
    tally.saying(format!(
        "{} of 299 counts of equal lights run off the end in single precision, first {:?}; ours none",
        off_the_end.len(),
        off_the_end.first()
    ))
}

/// First and second moments of the weights (1/3; 1/6 and 1/12) and counts in the four congruent quarters.
fn triangle_without_root(context: &Context) -> Finding {
    let family = context.family(10);
    let points: Vec<Vec2> = uniform_points(context.seed, context.replicates(50_000, 1_000)).collect();
    let ours: Vec<DVec3> = points.iter().map(|&u| square_to_triangle(u).as_dvec3()).collect();
    let wrong: Vec<DVec3> = points
        .iter()
        .map(|u| {
            let (u, v) = (f64::from(u.x), f64::from(u.y));
            DVec3::new(1.0 - u, u * (1.0 - v), u * v)
        })
        .collect();
    let quarters = |points: &[DVec3]| {
        let mut counts = [0_u64; 4];
        points.iter().for_each(|b| counts[(0..3).find(|&i| b[i] > 0.5).unwrap_or(3)] += 1);
        counts
    };
    let even = [points.len() as f64 / 4.0; 4];
    let mut tally = Tally::new();
    for i in 0..3 {
        let test =
            |f: &dyn Fn(&DVec3) -> f64, exact: f64| t_test(&ours.iter().map(f).collect::<Vec<f64>>(), exact, family);
        tally.verdict(format!("mean of b{i}"), &test(&|b| b[i], 1.0 / 3.0), 1.0 / 3.0);
        tally.verdict(format!("mean of b{i}²"), &test(&|b| b[i] * b[i], 1.0 / 6.0), 1.0 / 6.0);
        tally.verdict(
            format!("mean of b{i} b{}", (i + 1) % 3),
            &test(&|b| b[i] * b[(i + 1) % 3], 1.0 / 12.0),
            1.0 / 12.0,
        );
    }
    tally.verdict("counts in four quarters", &chi2_test(&quarters(&ours), &even, family), 1.0);
    let crowded = chi2_test(&quarters(&wrong), &even, family);
    tally.fact(format!("without the root χ² sees it: {crowded}"), !crowded.holds());
    let mean: Moments = wrong.iter().map(|b| b.x).collect();
    let mean = mean.mean().unwrap_or(f64::NAN);
    tally.near("without the root the first weight's mean is 1/2", mean, 0.5, 0.02);
    tally.saying(format!(
        "quarters {:?}; without the root {:?}, mean first weight {mean:.3}",
        quarters(&ours),
        quarters(&wrong)
    ))
}

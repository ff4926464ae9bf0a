//! What every sampler promises, over the whole vocabulary: nets, strata, orders, and which decisions march in step.
//!
//! Ranges, blocks of sequences, marginals and decoupled decisions are checks of the group `samplers` (`tests/sampler_certificates.rs`).
//! Seeds are fixed, so each test always passes or always fails. Each statistical test states its family's false-alarm rate.

use sampler_lab::sampling::{
    Decision, Dim1, Dim2, Order, PixelKey, PointSource, Points, Preset, Random, SampleLayout, Sampler, SamplerSpec,
    every_legal_spec, point_set,
};
use sampler_lab::stats::{Family, t_test};

/// The four decisions of a scene that needs them all.
struct Tickets {
    layout: SampleLayout,
    pixel: Dim2,
    lens: Dim2,
    pick: Dim1,
    light: Dim2,
}

fn tickets() -> Tickets {
    let mut layout = SampleLayout::default();
    let pixel = layout.claim_2d(Decision::Pixel);
    let lens = layout.claim_2d(Decision::Lens);
    let pick = layout.claim_1d(Decision::LightPick);
    let light = layout.claim_2d(Decision::LightPoint);
    Tickets { layout, pixel, lens, pick, light }
}

fn spec(text: &str) -> SamplerSpec {
    SamplerSpec::parse(text, Preset::Best).unwrap()
}

/// Every sampler that has numbers.
fn numbered_specs() -> Vec<SamplerSpec> {
    every_legal_spec().into_iter().filter(|s| s.points != Points::Center).collect()
}

/// All pairs that a 2-D decision of one pixel reads.
fn span(sampler: &Sampler, pixel: PixelKey, dim: &Dim2) -> Vec<[f32; 2]> {
    let n = sampler.samples() as usize;
    let (mut x, mut y) = (vec![0.0; n], vec![0.0; n]);
    sampler.fill_2d(pixel, 0, dim, &mut x, &mut y);
    x.into_iter().zip(y).map(|(x, y)| [x, y]).collect()
}

/// The order of asking, the object asked and the neighbours asked before must not matter.
#[test]
fn a_number_depends_on_its_address_alone() {
    let t = tickets();
    for s in numbered_specs() {
        let first = Sampler::new(s, &t.layout, 12, 77).unwrap();
        let second = Sampler::new(s, &t.layout, 12, 77).unwrap();
        let mut addresses: Vec<(u32, u32, u32)> =
            (0..3).flat_map(|x| (0..2).flat_map(move |y| (0..12).map(move |i| (x, y, i)))).collect();
        let read = |sampler: &Sampler, (x, y, i): (u32, u32, u32)| {
            let pixel = PixelKey::new(x, y);
            let pairs = [&t.pixel, &t.lens, &t.light].map(|dim| sampler.get_2d(pixel, i, dim));
            (pairs, sampler.get_1d(pixel, i, &t.pick))
        };
        let before: Vec<_> = addresses.iter().map(|&a| (a, read(&first, a))).collect();
        // 5 is prime to 72: another order that visits all of them.
        addresses = (0..72).map(|k| before[k * 5 % 72].0).collect();
        for a in addresses {
            let expected = before.iter().find(|(b, _)| *b == a).unwrap().1;
            assert_eq!(read(&second, a), expected, "{s} at {a:?}");
        }
    }
}

/// Every elementary interval of volume 1/n holds exactly one of these n = 2^m points, by integer keys ⌊x 2^e⌋.
fn is_net(points: &[[f64; 2]]) -> bool {
    let n = points.len();
    let m = n.trailing_zeros();
    assert!(n.is_power_of_two());
    (0..=m).all(|e| {
        let mut seen = vec![false; n];
        points.iter().all(|&[x, y]| {
            // Scaling by powers of two is exact, so no cell is missed by rounding.
            let key = ((x * f64::from(1 << e)) as usize) << (m - e) | (y * f64::from(1 << (m - e))) as usize;
            !std::mem::replace(&mut seen[key], true)
        })
    })
}

fn as_f64(points: &[[f32; 2]]) -> Vec<[f64; 2]> {
    points.iter().map(|p| p.map(f64::from)).collect()
}

fn is_digital(random: Random) -> bool {
    matches!(random, Random::None | Random::Xor | Random::Owen)
}

/// In step every decision reads the pair's first two dimensions; shuffled, each reads the same net in an order of its own.
#[test]
fn whole_sets_are_nets_in_every_decision_also_shuffled() {
    let t = tickets();
    for s in numbered_specs() {
        let sequence = matches!(s.points, Points::Ld | Points::Sobol) && is_digital(s.random);
        let hammersley = s.points == Points::Hammersley && s.random != Random::Shift;
        if !(sequence || hammersley) || s.order == Order::Joint {
            continue;
        }
        for (n, seed) in [(1, 4), (2, 5), (32, 6), (256, 7)] {
            let sampler = Sampler::new(s, &t.layout, n, seed).unwrap();
            assert!(is_net(&point_set(s, n, seed).unwrap()), "{s}: {n} points");
            for dim in [&t.pixel, &t.lens, &t.light] {
                let points = as_f64(&span(&sampler, PixelKey::new(9, 4), dim));
                assert!(is_net(&points), "{s}: {n} points of {}", dim.decision().name());
            }
        }
    }
}

/// A prefix of Hammersley's set reaches only its share of x.
#[test]
fn half_a_hammersley_set_covers_half_of_x() {
    let points = point_set(spec("hammersley:plain"), 64, 0).unwrap();
    assert!(points[..32].iter().all(|p| p[0] < 0.5));
}

/// Cell of a point among b × a strata. The renderer's floats are the tops of longer fractions: half their last place is
/// added, so that a stratum's lower border, rounded down, still counts to it.
fn cell([x, y]: [f32; 2], across: u32, down: u32) -> (u32, u32) {
    let at = |u: f32, k: u32| ((f64::from(u) + 2f64.powi(-25)) * f64::from(k)) as u32;
    (at(x, across), at(y, down))
}

#[test]
fn every_stratum_is_hit_once_for_any_count_asked() {
    let t = tickets();
    let shapes = [(1, 1, 1), (2, 2, 1), (3, 2, 2), (7, 4, 2), (13, 5, 3), (16, 4, 4), (26, 7, 4), (64, 8, 8)];
    for s in numbered_specs().into_iter().filter(|s| s.points == Points::Stratified) {
        for (asked, across, down) in shapes {
            for seed in 0..20 {
                let sampler = Sampler::new(s, &t.layout, asked, seed).unwrap();
                assert_eq!(sampler.samples(), across * down, "{s}: {asked} asked");
                for (pixel, dim) in [(PixelKey::new(0, 0), &t.pixel), (PixelKey::new(5, 1), &t.light)] {
                    let cells: Vec<_> = span(&sampler, pixel, dim).into_iter().map(|p| cell(p, across, down)).collect();
                    let in_order: Vec<_> = (0..across * down).map(|i| (i % across, i / across)).collect();
                    let mut sorted = cells.clone();
                    sorted.sort_unstable_by_key(|&(x, y)| (y, x));
                    assert_eq!(sorted, in_order, "{s}: {asked} asked, seed {seed}");
                    assert!(s.order != Order::Step || cells == in_order, "{s}: in step the strata come in order");
                }
                let n = sampler.samples();
                let mut line: Vec<u32> =
                    (0..n).map(|i| cell([sampler.get_1d(PixelKey::new(5, 1), i, &t.pick), 0.0], n, 1).0).collect();
                line.sort_unstable();
                assert_eq!(line, (0..n).collect::<Vec<_>>(), "{s}: {asked} strata on a line, seed {seed}");
            }
        }
    }
}

fn sorted(mut points: Vec<[f32; 2]>) -> Vec<[f32; 2]> {
    points.sort_by(|a, b| a.partial_cmp(b).unwrap());
    points
}

#[test]
fn a_shuffled_set_is_the_set_in_step_in_another_order() {
    let t = tickets();
    for s in numbered_specs().into_iter().filter(|s| s.order == Order::Shuffle) {
        let in_step = SamplerSpec { order: Order::Step, ..s };
        for asked in [1, 2, 15, 16, 60, 257] {
            let both = [s, in_step].map(|s| Sampler::new(s, &t.layout, asked, 8).unwrap());
            for dim in [&t.pixel, &t.light] {
                let [shuffled, plain] = [&both[0], &both[1]].map(|b| span(b, PixelKey::new(2, 3), dim));
                assert!(asked < 15 || shuffled != plain, "{s}: {asked} points in the same order");
                assert_eq!(sorted(shuffled), sorted(plain), "{s}: {asked} points");
            }
        }
    }
}

/// (1/n) Σ f(u_i, v_i) over the samples of a pixel, one value a seed.
fn pairings(s: SamplerSpec, n: u32, seeds: u64, f: impl Fn([f64; 2], [f64; 2]) -> f64) -> Vec<f64> {
    let t = tickets();
    let of_seed = |seed| {
        let sampler = Sampler::new(s, &t.layout, n, seed).unwrap();
        let (u, v) = (span(&sampler, PixelKey::new(0, 0), &t.lens), span(&sampler, PixelKey::new(0, 0), &t.light));
        let sum: f64 = u.iter().zip(&v).map(|(u, v)| f(u.map(f64::from), v.map(f64::from))).sum();
        sum / f64::from(sampler.samples())
    };
    (0..seeds).map(of_seed).collect()
}

fn squared_distance(u: [f64; 2], v: [f64; 2]) -> f64 {
    (u[0] - v[0]).powi(2) + (u[1] - v[1]).powi(2)
}

/// The sheet read literally, limit by limit, each derived:
/// stratified, two numbers of one k × k stratum, E = 2/(6k²) = 1/(3n) → 0; Halton, the same point twice, 0; Hammersley, x
/// twice the same and y under two independent words, 1/6; uniform, 1/3. False alarms: 1e-8.
#[test]
fn decisions_of_the_sheet_presets_march_in_step_to_wrong_limits() {
    let family = Family { tests: 6, false_alarm: 1e-8 };
    for n in [16, 1024] {
        let seeds = if n == 16 { 2000 } else { 200 };
        let limit = |name: &str, truth: f64| {
            let verdict = t_test(&pairings(spec(name), n, seeds, squared_distance), truth, family);
            assert!(verdict.holds(), "{name}, n = {n}: {verdict}");
        };
        limit("stratified:sheet", 1.0 / f64::from(3 * n));
        limit("hammersley:sheet", 1.0 / 6.0);
        limit("uniform:sheet", 1.0 / 3.0);
        assert!(pairings(spec("halton:sheet"), n, 3, squared_distance).iter().all(|&d| d == 0.0));
    }
}

/// `ld` in step is right on average and does not converge in any one pixel. With z uniform and c the exclusive or of two
/// random words, z − z⊕c = Σ ±c_k 2⁻ᵏ, whose mean square over the net is Σ_{k≤m} c_k 4⁻ᵏ plus the square of what the digits
/// below m leave: mean 1/6 an axis, variance 1/60 + 16⁻ᵐ/45. Two axes: a spread of √(1/30) = 0.18 at every n. The uniform
/// sampler's variance is 7/(90 n). Six tests of mean and variance. False alarms: 1e-8.
#[test]
fn the_sheets_ld_stalls_at_a_spread_of_0_18_per_pixel() {
    let family = Family { tests: 6, false_alarm: 1e-8 };
    let check = |name: &str, n: u32, variance: f64| {
        let means = pairings(spec(name), n, 4000, squared_distance);
        let squares: Vec<f64> = means.iter().map(|m| (m - 1.0 / 3.0).powi(2)).collect();
        for (what, verdict) in
            [("mean", t_test(&means, 1.0 / 3.0, family)), ("variance", t_test(&squares, variance, family))]
        {
            assert!(verdict.holds(), "{name}, n = {n}, {what}: {verdict}");
        }
    };
    for m in [4, 10] {
        check("ld:sheet", 1 << m, 2.0 * (1.0 / 60.0 + 16f64.powi(-m) / 45.0));
    }
    check("uniform:sheet", 256, 7.0 / 90.0 / 256.0);
}

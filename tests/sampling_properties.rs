//! What every sampler promises, over the whole vocabulary: ranges, nets, strata, orders, uniformity, and which
//! decisions march in step.
//!
//! Seeds are fixed, so each test always passes or always fails. Each statistical test states its family's false-alarm rate.

use sampler_lab::sampling::{
    Decision, Dim1, Dim2, Order, PixelKey, PointSource, Points, Preset, Random, SampleLayout, Sampler, SamplerSpec,
    every_legal_spec, point_set,
};
use sampler_lab::stats::discrepancy::{Points as PointSet, t_value};
use sampler_lab::stats::hypothesis::ks_uniform_test;
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

#[test]
fn the_last_index_of_the_largest_count_stays_below_one_in_every_decision() {
    let t = tickets();
    let n = 1 << 24;
    for s in numbered_specs() {
        let sampler = Sampler::new(s, &t.layout, n, 3).unwrap();
        for index in [0, 1, n / 2, n - 2, n - 1] {
            for pixel in [PixelKey::new(0, 0), PixelKey::new(u32::MAX, u32::MAX)] {
                let pairs = [&t.pixel, &t.lens, &t.light].map(|dim| sampler.get_2d(pixel, index, dim));
                let all = pairs.into_iter().flatten().chain([sampler.get_1d(pixel, index, &t.pick)]);
                for u in all {
                    assert!((0.0..1.0).contains(&u), "{s}: index {index} reads {u}");
                }
            }
        }
    }
}

#[test]
fn point_sets_of_awkward_sizes_stay_in_the_unit_square() {
    for s in numbered_specs() {
        for asked in [1, 2, 3, 5, 13, 31, 32, 33, 127, 257, 1000] {
            let points = point_set(s, asked, 11).unwrap();
            assert_eq!(points.len(), s.taken(asked) as usize, "{s}");
            assert!(points.iter().flatten().all(|u| (0.0..1.0).contains(u)), "{s}, {asked} asked");
        }
    }
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

/// The numbers the renderer reads (24 bits) and those that are measured and plotted, for whole counts that are powers of two
/// and for those that are not.
#[test]
fn every_aligned_block_of_the_sequences_is_a_net() {
    let t = tickets();
    let sequences = numbered_specs().into_iter().filter(|s| {
        matches!(s.points, Points::Ld | Points::Sobol) && is_digital(s.random) && s.order != Order::Shuffle
    });
    let mut tried = 0;
    for s in sequences {
        for (n, seed) in [(64, 1), (48, 2), (200, 3)] {
            let sampler = Sampler::new(s, &t.layout, n, seed).unwrap();
            let read = as_f64(&span(&sampler, PixelKey::new(0, 0), &t.pixel));
            let measured = point_set(s, n, seed).unwrap();
            for m in 0..=n.ilog2() {
                for (block, exact) in read.chunks_exact(1 << m).zip(measured.chunks_exact(1 << m)) {
                    assert!(is_net(block) && is_net(exact), "{s}: a block of 2^{m} of {n}");
                    tried += 1;
                }
            }
        }
    }
    assert!(tried > 1000, "{tried} blocks");
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

/// Cranley and Patterson's shift keeps each axis stratified and breaks the net.
#[test]
fn a_toroidal_shift_breaks_the_net_but_not_its_axes() {
    for name in ["ld:step:shift", "hammersley:step:shift", "sobol:step:shift"] {
        let mut worst = 0;
        for seed in 0..32 {
            let points = point_set(spec(name), 64, seed).unwrap();
            for axis in [0, 1] {
                let mut strata: Vec<u32> = points.iter().map(|p| (p[axis] * 64.0) as u32).collect();
                strata.sort_unstable();
                assert_eq!(strata, (0..64).collect::<Vec<_>>(), "{name}: axis {axis}");
            }
            worst = worst.max(t_value(&PointSet::new_2d(&points).unwrap()).unwrap());
        }
        assert!(worst > 0, "{name}: a net for 32 shifts in a row");
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

/// Numbers that one address gives over many seeds.
struct Marginal {
    what: String,
    values: Vec<f64>,
}

const SEEDS: u64 = 1000;

/// Coordinates of a few indices (first, one inside, last) of the pixel's and the light's decision over all seeds.
fn marginals(s: SamplerSpec) -> Vec<Marginal> {
    let t = tickets();
    let n = 13;
    let taken = s.taken(n);
    let indices = [0, taken / 2, taken - 1];
    let mut all: Vec<Marginal> = Vec::new();
    for seed in 0..SEEDS {
        let sampler = Sampler::new(s, &t.layout, n, seed).unwrap();
        let mut at = 0;
        for &index in &indices {
            for dim in [&t.pixel, &t.light] {
                for (axis, u) in sampler.get_2d(PixelKey::new(0, 0), index, dim).into_iter().enumerate() {
                    if seed == 0 {
                        let what = format!("{s}: axis {axis} of index {index}, {}", dim.decision().name());
                        all.push(Marginal { what, values: Vec::new() });
                    }
                    all[at].values.push(f64::from(u));
                    at += 1;
                }
            }
        }
    }
    all
}

/// Fix an address, vary the seed. Kolmogorov–Smirnov on the number and on its lower twelve bits, which a wrong
/// bit order or missing low bits would leave uneven; family-wise false-alarm rate 1e-7 for the file's uniformity tests (at
/// most 3000). At 1000 seeds a distribution function that is off by 0.15 anywhere is caught.
const UNIFORMITY: Family = Family { tests: 3000, false_alarm: 1e-7 };

#[test]
fn a_fixed_index_is_uniform_over_seeds_where_the_sampler_says_so() {
    let mut tests = 0;
    for s in numbered_specs().into_iter().filter(SamplerSpec::is_uniform_marginally) {
        for marginal in marginals(s) {
            let low_bits: Vec<f64> = marginal.values.iter().map(|u| (u * 4096.0).fract()).collect();
            for (part, values) in [("value", &marginal.values), ("low bits", &low_bits)] {
                let verdict = ks_uniform_test(values, UNIFORMITY);
                assert!(verdict.holds(), "{}, {part}: {verdict}", marginal.what);
                tests += 1;
            }
        }
    }
    assert!(tests > 1000 && tests <= UNIFORMITY.tests, "{tests} tests");
}

/// The exempt ones, fixed points, jitter that stays in its own stratum, the x of `yxor`.
#[test]
fn a_fixed_index_is_not_uniform_where_the_sampler_says_it_is_not() {
    let fails = |m: &Marginal| !ks_uniform_test(&m.values, UNIFORMITY).holds();
    let exempt: Vec<_> = numbered_specs().into_iter().filter(|s| !s.is_uniform_marginally()).collect();
    assert!(exempt.len() > 10, "{}", exempt.len());
    for s in exempt {
        let all = marginals(s);
        if s.random == Random::Yxor && s.order == Order::Step {
            assert!(all.iter().filter(|m| m.what.contains("axis 0")).all(fails), "{s}: x is i/n for every seed");
            assert!(!all.iter().filter(|m| m.what.contains("axis 1")).any(fails), "{s}: y is shifted");
        } else if s.order == Order::Shuffle {
            // A random element of a fixed set: 13 values of equal probability, a distance of up to 1/13 from uniform,
            // which 1000 seeds do not tell apart at this level. What can be seen is that other numbers never occur.
            let mut distinct = all[0].values.clone();
            distinct.sort_by(f64::total_cmp);
            distinct.dedup();
            assert_eq!(distinct.len(), 13, "{s}");
        } else {
            assert!(all.iter().all(fails), "{s}");
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

const BEST: [&str; 6] = ["uniform:best", "stratified:best", "halton:best", "hammersley:best", "ld:best", "sobol:best"];

/// E f(u) g(v) against E f · E g for all pairs of coordinates of two decisions (correlation 12 (u − ½)(v − ½), zero), pixel
/// and lens, pixel and light, lens and light, and light pick against light point: a shared sequence gives up to 1.
/// 6 samplers × 14 pairs × 2 counts at a family-wise false-alarm rate of 1e-7. However the n samples of a set hang together,
/// its mean spreads by no more than one sample, so a correlation of (6.2 + 2.3)/√4000 = 0.14 is caught for any of them.
#[test]
fn decisions_of_the_best_presets_are_decoupled() {
    let t = tickets();
    let family = Family { tests: 6 * 14 * 2, false_alarm: 1e-7 };
    for name in BEST {
        for n in [4, 16] {
            let mut sums = vec![Vec::new(); 14];
            for seed in 0..4000 {
                let sampler = Sampler::new(spec(name), &t.layout, n, seed).unwrap();
                let [pixel, lens, light] =
                    [&t.pixel, &t.lens, &t.light].map(|d| span(&sampler, PixelKey::new(1, 1), d));
                let mut sum = [0.0; 14];
                for i in 0..sampler.samples() as usize {
                    let centred = |p: &[f32; 2]| p.map(|u| f64::from(u) - 0.5);
                    let [p, l, q] = [centred(&pixel[i]), centred(&lens[i]), centred(&light[i])];
                    let pick = f64::from(sampler.get_1d(PixelKey::new(1, 1), i as u32, &t.pick)) - 0.5;
                    let products = [(p, l), (p, q), (l, q)]
                        .into_iter()
                        .flat_map(|(a, b)| [a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]])
                        .chain([pick * q[0], pick * q[1]]);
                    for (sum, product) in sum.iter_mut().zip(products) {
                        *sum += 12.0 * product / f64::from(sampler.samples());
                    }
                }
                sums.iter_mut().zip(sum).for_each(|(all, sum)| all.push(sum));
            }
            for (pair, replicates) in sums.iter().enumerate() {
                let verdict = t_test(replicates, 0.0, family);
                assert!(verdict.holds(), "{name}, n = {n}, pair {pair}: {verdict}");
                assert!(verdict.detects.unwrap() < 0.14, "{name}: {verdict}");
            }
        }
    }
}

fn squared_distance(u: [f64; 2], v: [f64; 2]) -> f64 {
    (u[0] - v[0]).powi(2) + (u[1] - v[1]).powi(2)
}

/// f = ‖u − v‖² over two decisions, truth 1/3: right for every best preset. 12 tests at 1e-7 together.
#[test]
fn the_best_presets_get_the_distance_of_two_decisions_right() {
    let family = Family { tests: 12, false_alarm: 1e-7 };
    for name in BEST {
        for n in [16, 64] {
            let verdict = t_test(&pairings(spec(name), n, 3000, squared_distance), 1.0 / 3.0, family);
            assert!(verdict.holds(), "{name}, n = {n}: {verdict}");
        }
    }
}

/// The sheet read literally, limit by limit, each derived:
/// stratified, two numbers of one k × k stratum, E = 2/(6k²) = 1/(3n) → 0; Halton, the same point twice, 0; Hammersley, x
/// twice the same and y under two independent words, 1/6; uniform, 1/3. Family-wise false-alarm rate 1e-7.
#[test]
fn decisions_of_the_sheet_presets_march_in_step_to_wrong_limits() {
    let family = Family { tests: 6, false_alarm: 1e-7 };
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
/// sampler's variance is 7/(90 n). Six tests of mean and variance, family-wise false-alarm rate 1e-7.
#[test]
fn the_sheets_ld_stalls_at_a_spread_of_0_18_per_pixel() {
    let family = Family { tests: 6, false_alarm: 1e-7 };
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

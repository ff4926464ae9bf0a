//! Samplers: one exact variance each, marginals, pairing of decisions, nets, radical inverses.

use crate::check::{Check, Context, Finding, Kind, Tally};
use crate::sampling::hash::{bits64, unit_f32};
use crate::sampling::radical::{PRIMES, mirrored, radical_inverse};
use crate::sampling::{
    Decision, Dim1, Dim2, PixelKey, PointSource, Points, Preset, SampleLayout, Sampler, SamplerSpec, Scope,
    every_legal_spec,
};
use crate::stats::hypothesis::ks_uniform_test;
use crate::stats::hypothesis::t_test_of_squares;
use crate::stats::t_test;

/// The checks of this room.
pub fn checks() -> Vec<Check> {
    vec![
        Check {
            name: "quick-variances",
            group: "quick",
            claim: "samplers have the variances that theory gives them: Owen's, jitter's, random digits'",
            failures: &[],
            kind: Kind::Statistical,
            run: variances,
        },
        Check {
            name: "quick-marginals",
            group: "quick",
            claim: "each single number of a randomised set is uniform over the seeds",
            failures: &[],
            kind: Kind::Statistical,
            run: marginals,
        },
        Check {
            name: "quick-pairing",
            group: "quick",
            claim: "axes, decisions, pixels and seeds are uncorrelated: E (u − ½)(v − ½) = 0",
            failures: &[],
            kind: Kind::Statistical,
            run: pairing,
        },
        Check {
            name: "quick-nets",
            group: "quick",
            claim: "nets have one point in each elementary interval, strata one in each stratum, and sequences start at 0",
            failures: &[],
            kind: Kind::Exact,
            run: nets,
        },
        Check {
            name: "quick-radical-inverse",
            group: "quick",
            claim: "radical inverses are the exact rationals rounded down, and below 1 at bᵏ − 1",
            failures: &[],
            kind: Kind::Exact,
            run: radical_inverses,
        },
    ]
}

/// The tickets of a scene with all decisions.
struct Tickets {
    layout: SampleLayout,
    pixel: Dim2,
    lens: Dim2,
    pick: Dim1,
    light: Dim2,
}

impl Tickets {
    fn new() -> Self {
        let mut layout = SampleLayout::default();
        let (pixel, lens) = (layout.claim_2d(Decision::Pixel), layout.claim_2d(Decision::Lens));
        let (pick, light) = (layout.claim_1d(Decision::LightPick), layout.claim_2d(Decision::LightPoint));
        Self { layout, pixel, lens, pick, light }
    }

    fn sampler(&self, text: &str, n: u32, seed: u64) -> Sampler {
        let spec = SamplerSpec::parse(text, Preset::Best).expect("a sampler of this file");
        self.of(spec, n, seed)
    }

    fn of(&self, spec: SamplerSpec, n: u32, seed: u64) -> Sampler {
        Sampler::new(spec, &self.layout, n, seed).expect("a legal sampler and count")
    }
}

/// All points that a pixel's decision reads.
fn set(sampler: &Sampler, pixel: PixelKey, dim: &Dim2) -> [Vec<f32>; 2] {
    let n = sampler.samples() as usize;
    let (mut x, mut y) = (vec![0.0; n], vec![0.0; n]);
    sampler.fill_2d(pixel, 0, dim, &mut x, &mut y);
    [x, y]
}

type Integrand = (&'static str, f64, fn(f64, f64) -> f64);

/// f = x and xy with their means.
const X: Integrand = ("x", 0.5, |x, _| x);
const Y: Integrand = ("y", 0.5, |_, y| y);
const XY: Integrand = ("xy", 0.25, |x, y| x * y);

/// The variance of the mean over n points, pixels as replicates (their keys are independent).
fn variances(context: &Context) -> Finding {
    let tickets = Tickets::new();
    // Owen's (0,m,2)-net in base 2: f = x 1/(12n³), xy 7(4 + 3m)/(576n³); digits alike, n = 3³ for base 3.
    let cases: [(&str, u32, Integrand, f64); 7] = [
        ("ld", 16, XY, 7.0 * 16.0 / (576.0 * 4096.0)),
        ("ld", 256, X, 1.0 / (12.0 * 16_777_216.0)),
        ("sobol", 64, XY, 7.0 * 22.0 / (576.0 * 262_144.0)),
        ("sobol", 256, Y, 1.0 / (12.0 * 16_777_216.0)),
        ("halton", 27, Y, 1.0 / (12.0 * 19_683.0)),
        ("stratified", 16, XY, (1.0 / 18.0 - 1.0 / (144.0 * 16.0)) / 256.0),
        ("uniform", 16, XY, 7.0 / (144.0 * 16.0)),
    ];
    let family = context.family(cases.len() as u32);
    let mut tally = Tally::new();
    for (case, (text, n, (name, mean, f), exact)) in cases.into_iter().enumerate() {
        let sampler = tickets.sampler(text, n, context.seed_of(0, case as u64));
        let squares: Vec<f64> = (0..context.replicates(4_000.max(80_000 / n), 2_000))
            .map(|pixel| {
                let [x, y] = set(&sampler, PixelKey::new(pixel, 7), &tickets.pixel);
                let sum: f64 = x.iter().zip(&y).map(|(&x, &y)| f(f64::from(x), f64::from(y))).sum();
                let error = sum / f64::from(n) - mean;
                error * error / exact
            })
            .collect();
        tally.verdict(
            format!("{text} at n = {n}, f = {name}, variance over its exact value"),
            &t_test_of_squares(&squares, 1.0, family),
            1.0,
        );
    }
    tally.finish()
}

fn marginals(context: &Context) -> Finding {
    let tickets = Tickets::new();
    // A key's scope changes which key it is, not what is made of it.
    let uniform = |s: &SamplerSpec| s.points != Points::Center && s.scope == Scope::Each && s.is_uniform_marginally();
    let specs: Vec<SamplerSpec> = every_legal_spec().into_iter().filter(uniform).collect();
    const INDICES: [u32; 2] = [0, 6];
    let family = context.family((specs.len() * INDICES.len() * 2) as u32);
    let mut tally = Tally::new();
    for (number, &spec) in specs.iter().enumerate() {
        let samplers: Vec<Sampler> = (0..context.replicates(400, 200))
            .map(|seed| tickets.of(spec, 8, context.seed_of(number as u64, u64::from(seed))))
            .collect();
        for index in INDICES {
            let points: Vec<[f32; 2]> =
                samplers.iter().map(|s| s.get_2d(PixelKey::new(3, 1), index, &tickets.lens)).collect();
            for (axis, name) in ["x", "y"].into_iter().enumerate() {
                let values: Vec<f64> = points.iter().map(|p| f64::from(p[axis])).collect();
                tally.verdict(format!("{spec}, {name} of point {index}"), &ks_uniform_test(&values, family), 1.0);
            }
        }
    }
    tally.finish()
}

/// Mean over the indices of (u − ½)(v − ½).
fn product(u: &[f32], v: &[f32]) -> f64 {
    let sum: f64 = u.iter().zip(v).map(|(&u, &v)| (f64::from(u) - 0.5) * (f64::from(v) - 0.5)).sum();
    sum / u.len() as f64
}

fn pairing(context: &Context) -> Finding {
    const N: u32 = 16;
    const PAIRS: [&str; 7] = [
        "x and y of the pixel",
        "pixel and lens",
        "lens and light",
        "pixel and light pick",
        "pixel and light",
        "neighbouring pixels",
        "neighbouring seeds",
    ];
    let samplers = ["uniform", "stratified", "halton", "hammersley", "ld", "sobol"];
    let tickets = Tickets::new();
    let family = context.family((samplers.len() * PAIRS.len()) as u32);
    let mut tally = Tally::new();
    for (number, text) in samplers.into_iter().enumerate() {
        let seed = context.seed_of(1, number as u64) & !1;
        let (sampler, next) = (tickets.sampler(text, N, seed), tickets.sampler(text, N, seed + 1));
        let mut values = PAIRS.map(|_| Vec::new());
        for replicate in 0..context.replicates(500, 200) {
            let pixel = PixelKey::new(2 * replicate, 5);
            let [x, y] = set(&sampler, pixel, &tickets.pixel);
            let lens = set(&sampler, pixel, &tickets.lens);
            let light = set(&sampler, pixel, &tickets.light);
            let mut pick = [0.0; N as usize];
            sampler.fill_1d(pixel, 0, &tickets.pick, &mut pick);
            let [beside, _] = set(&sampler, PixelKey::new(2 * replicate + 1, 5), &tickets.pixel);
            let [reseeded, _] = set(&next, pixel, &tickets.pixel);
            let products = [
                product(&x, &y),
                product(&x, &lens[0]),
                product(&lens[1], &light[1]),
                product(&x, &pick),
                product(&x, &light[0]),
                product(&x, &beside),
                product(&x, &reseeded),
            ];
            values.iter_mut().zip(products).for_each(|(list, value)| list.push(value));
        }
        for (pair, values) in PAIRS.iter().zip(&values) {
            // Relative to what equal numbers would give: the variance of one, 1/12.
            tally.verdict(format!("{text}: {pair}"), &t_test(values, 0.0, family), 1.0 / 12.0);
        }
    }
    tally.finish()
}

/// Has each of the `columns` × `rows` equal cells one of the points?
fn one_in_each(points: &[Vec<f32>; 2], columns: u32, rows: u32) -> bool {
    let mut seen = vec![false; (columns * rows) as usize];
    let [x, y] = points;
    x.iter().zip(y).all(|(x, y)| {
        let (column, row) = ((x * columns as f32) as u32, (y * rows as f32) as u32);
        !std::mem::replace(&mut seen[(row * columns + column) as usize], true)
    })
}

fn nets(context: &Context) -> Finding {
    let tickets = Tickets::new();
    let mut tally = Tally::new();
    for text in ["ld:plain", "sobol:plain", "hammersley:plain", "ld:sheet", "ld:best", "sobol:joint:xor@each"] {
        for m in [2, 4, 7] {
            let sampler = tickets.sampler(text, 1 << m, context.seed);
            let points = set(&sampler, PixelKey::new(2, 3), &tickets.pixel);
            let is_net = (0..=m).all(|k| one_in_each(&points, 1 << k, 1 << (m - k)));
            tally.fact(format!("{text}: 2^{m} points are a (0, {m}, 2)-net"), is_net);
        }
    }
    for (n, columns, rows) in [(8, 4, 2), (12, 4, 3), (16, 4, 4), (28, 7, 4)] {
        for text in ["stratified:sheet", "stratified:best"] {
            let sampler = tickets.sampler(text, n, context.seed);
            let points = set(&sampler, PixelKey::new(2, 3), &tickets.lens);
            tally.fact(
                format!("{text}: one of {n} points in each of {columns} × {rows} strata"),
                one_in_each(&points, columns, rows),
            );
        }
    }
    for text in ["ld:plain", "sobol:plain", "hammersley:plain", "halton:plain"] {
        let sampler = tickets.sampler(text, 16, context.seed);
        let [x, y] = sampler.get_2d(PixelKey::new(0, 0), 0, &tickets.pixel);
        tally.fact(format!("{text}: point 0 is ({x}, {y}), the origin"), (x, y) == (0.0, 0.0));
    }
    tally.saying("every elementary interval and stratum has its point")
}

fn radical_inverses(context: &Context) -> Finding {
    let mut tally = Tally::new();
    for base in PRIMES {
        let last =
            std::iter::successors(Some(base), |b| b.checked_mul(base)).take_while(|&p| p <= 1 << 24).map(|p| p - 1);
        let random = (0..64).map(|i| (bits64(context.seed, i) >> 40) as u32);
        for index in last.chain(random) {
            let (mirror, power) = mirrored(base, index);
            let exact = ((u128::from(mirror) << 32) / u128::from(power)) as u64;
            let found = radical_inverse(base, index);
            let holds = u64::from(found) == exact && unit_f32(found) < 1.0;
            tally.fact(format!("base {base}, index {index}: ⌊2³² φ⌋ = {exact}, found {found}"), holds);
        }
    }
    tally.saying("16 bases: all bᵏ − 1 below 2²⁴, and 64 other indices each")
}

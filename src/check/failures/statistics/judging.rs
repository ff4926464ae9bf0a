//! What happens when estimates are compared: with a threshold, with a reference, with one another.

use super::super::super::statistics::Draws;
use super::super::super::{Check, Context, Finding, Kind, Tally};
use super::fact;
use crate::compare::Reference;
use crate::experiment::backend::{Estimator, Size, Stage, Variant};
use crate::experiment::plan::{ImageWork, Work, WorkItem, refuse_equal_seeds};
use crate::experiment::results::{Count, Kind as ItemKind, MadeWith};
use crate::film::Picture;
use crate::sampling::{Preset, SamplerSpec, point_set};
use crate::stats::discrepancy::{L2Kind, Points, l2_squared};
use crate::stats::hypothesis::{benjamini_hochberg, clopper_pearson, holm, welch};
use crate::stats::hypothesis::{t_test_of_skewed, t_test_of_squares};
use crate::stats::image_error::{mse, mse_unbiased};
use crate::stats::{
    Family, Moments, binomial_test, fisher_test, loglog_slope, slope_with_interval, sum, t_interval, t_test,
};

pub(super) fn checks() -> Vec<Check> {
    use Kind::Statistical;
    vec![
        fact(
            "welch-on-rare-pixels",
            &[33],
            Statistical,
            "Welch cries wolf 114 times too often on rare binary pixels, the exact test does not",
            rare_pixels,
        ),
        fact(
            "uncorrected-pixels",
            &[34],
            Statistical,
            "262 144 tests at 1 % find 2 621 differences where there are none",
            uncorrected,
        ),
        fact(
            "noisy-reference",
            &[37],
            Statistical,
            "a reference of 4 times the spp adds 25 % to the MSE, the unbiased form nothing",
            noisy_reference,
        ),
        fact(
            "shared-seeds",
            &[38],
            Statistical,
            "a test that shares samples with its reference hides error, and is refused",
            shared_seeds,
        ),
        fact(
            "variance-within-a-net",
            &[39],
            Statistical,
            "s²/n within one net is 757 times too large for xy, the spread of replicates is right",
            within_a_net,
        ),
        fact(
            "slopes",
            &[40],
            Statistical,
            "a slope fitted into the floor or across no powers of two is wrong, and said to be no line",
            slopes,
        ),
        fact(
            "mean-of-roots",
            &[64],
            Statistical,
            "the mean of roots is below the root of the mean: the squared form has the exact value",
            mean_of_roots,
        ),
    ]
}

/// Welch's p-value of two samples of zeros and ones.
fn welch_of_counts([hits_a, n_a]: [u64; 2], [hits_b, n_b]: [u64; 2]) -> Option<f64> {
    let values = |hits: u64, n: u64| (0..n).map(|i| f64::from(u8::from(i < hits))).collect::<Vec<_>>();
    welch(&values(hits_a, n_a), &values(hits_b, n_b)).map(|w| w.p_two_sided)
}

/// Probabilities of 0..=n successes by the exact recurrence from (1 − p)^n.
fn binomial_law(n: u64, p: f64) -> Vec<f64> {
    let mut law = vec![libm::pow(1.0 - p, n as f64)];
    for k in 1..=n {
        law.push(law[k as usize - 1] * (n - k + 1) as f64 / k as f64 * p / (1.0 - p));
    }
    law
}

/// Bernoulli(0.05) pixels, 64 samples against 256, level 1e-4: the rates by summing over all pairs of counts, and measured.
fn rare_pixels(context: &Context) -> Finding {
    let (n_a, n_b, p, level) = (64, 256, 0.05, 1e-4);
    let family = Family::one(level);
    let (law_a, law_b) = (binomial_law(n_a, p), binomial_law(n_b, p));
    // Which pairs of counts alarm; those rarer than 1e-12 add nothing.
    let mut alarms = vec![[false; 2]; (n_a as usize + 1) * (n_b as usize + 1)];
    let mut exact = [0.0; 2];
    for (a, pa) in law_a.iter().enumerate() {
        for (b, pb) in law_b.iter().enumerate().filter(|(_, pb)| pa * *pb > 1e-12) {
            let (of_a, of_b) = ([a as u64, n_a], [b as u64, n_b]);
            let welch_alarms = welch_of_counts(of_a, of_b).is_some_and(|p| p < level);
            let pair = [welch_alarms, !fisher_test(of_a, of_b, family).holds()];
            alarms[a * (n_b as usize + 1) + b] = pair;
            (0..2).filter(|&k| pair[k]).for_each(|k| exact[k] += pa * pb);
        }
    }
    let runs = u64::from(context.replicates(10_000, 2_000));
    let mut draws = Draws::new(context, 0);
    let mut count = |law: &[f64]| {
        let u = draws.uniform();
        let mut below = 0.0;
        law.iter().position(|p| {
            below += p;
            u < below
        })
    };
    let mut seen = [0_u64; 2];
    for _ in 0..runs {
        let (Some(a), Some(b)) = (count(&law_a), count(&law_b)) else { continue };
        (0..2).filter(|&k| alarms[a * (n_b as usize + 1) + b][k]).for_each(|k| seen[k] += 1);
    }
    let family = context.family(2);
    let mut tally = Tally::new();
    tally.fact(format!("Welch's exact rate at 1e-4 is {:.2e}", exact[0]), (80.0..160.0).contains(&(exact[0] / level)));
    tally.fact(format!("Fisher's exact rate at 1e-4 is {:.2e}", exact[1]), exact[1] <= level);
    tally.verdict("Welch's measured rate", &binomial_test(seen[0], runs, exact[0], family), exact[0]);
    tally.verdict("Fisher's measured rate", &binomial_test(seen[1], runs, exact[1], family), level);
    let [low, high] = clopper_pearson(seen[0], runs, 0.95);
    tally.saying(format!(
        "at 1e-4 Welch alarms {} times in {runs} (95 %: {low:.1e} to {high:.1e}; exactly {:.2e}), Fisher {} (exactly {:.1e})",
        seen[0], exact[0], seen[1], exact[1]
    ))
}

fn uncorrected(context: &Context) -> Finding {
    let pixels = 262_144_u64;
    let mut draws = Draws::new(context, 0);
    let p: Vec<f64> = (0..pixels).map(|_| draws.uniform()).collect();
    let below = |p: &[f64], level: f64| p.iter().filter(|p| **p < level).count() as u64;
    let family = context.family(3);
    let mut tally = Tally::new();
    let alarms = below(&p, 0.01);
    tally.verdict("pixels below 1 %", &binomial_test(alarms, pixels, 0.01, family), 0.01);
    for (name, adjusted) in [("Holm", holm(&p)), ("Benjamini–Hochberg", benjamini_hochberg(&p))] {
        // Where every hypothesis is true both find something with probability at most the level.
        let found = adjusted.map(|a| below(&a, family.per_test()));
        tally.fact(format!("{name} finds {found:?} of them"), found == Ok(0));
    }
    tally.saying(format!("{alarms} of {pixels} true hypotheses fall below 1 %; Holm and Benjamini–Hochberg find none"))
}

/// Pixels of truth 0 and variance 1; a reference of 4 times the samples has variance 1/4, its two halves 1/2 each.
fn noisy_reference(context: &Context) -> Finding {
    let images = context.replicates(64, 32) as usize;
    let pixels = 1024;
    let mut draws = Draws::new(context, 0);
    let (mut plain, mut unbiased) = (Vec::new(), Vec::new());
    for _ in 0..images {
        let test = draws.normals(pixels);
        let half = |draws: &mut Draws| draws.normals(pixels).iter().map(|z| z * 0.5f64.sqrt()).collect::<Vec<_>>();
        let (r1, r2) = (half(&mut draws), half(&mut draws));
        let mean: Vec<f64> = r1.iter().zip(&r2).map(|(a, b)| 0.5 * (a + b)).collect();
        plain.push(mse(&test, &mean));
        unbiased.push(mse_unbiased(&test, &r1, &r2));
    }
    let family = context.family(3);
    let mut tally = Tally::new();
    tally.verdict("plain MSE of truth 1", &t_test_of_skewed(&plain, 1.25, family), 1.0);
    tally.verdict("unbiased MSE of truth 1", &t_test_of_skewed(&unbiased, 1.0, family), 1.0);
    let wrong = t_test(&plain, 1.0, family);
    tally.fact(format!("the plain MSE is not the truth ({wrong})"), !wrong.holds());
    let mean = |v: &[f64]| sum(v.iter().copied()) / v.len() as f64;
    tally.saying(format!("MSE of truth 1: {:.3} against the noisy mean, {:.3} unbiased", mean(&plain), mean(&unbiased)))
}

/// A picture of one pixel that says where it came from.
fn picture(value: f64, scene: &str, sampler: &str, seed: &str) -> Picture {
    let says = [("sampler", sampler), ("scene", scene), ("seed", seed)];
    Picture {
        width: 1,
        height: 1,
        pixels: vec![[value; 3]],
        corner: None,
        is_display: false,
        provenance: says.map(|(k, v)| (k.to_owned(), v.to_owned())).to_vec(),
        notes: Vec::new(),
    }
}

/// An image of a plan that would be rendered with `seed`.
fn planned(sampler: &str, seed: u64) -> WorkItem {
    let work = ImageWork {
        kind: ItemKind::Render,
        scene: "pots".to_owned(),
        sampler: sampler.to_owned(),
        spp: Count { asked: 4, taken: 4 },
        replicate: 0,
        batch: None,
        seed,
        size: Size { width: 1, height: 1 },
        estimator: Estimator::Unbiased,
        stage: Stage::Final,
        variant: Variant::Plain,
        reference_id: None,
        twin: None,
    };
    let made_with = MadeWith { scene: None, renderer: None, sampler: None, estimator: None, exact: None };
    WorkItem {
        id: format!("{sampler}-{seed}"),
        metrics_algorithm: 1,
        is_shown: false,
        made_with,
        work: Work::Image(work),
    }
}

/// n samples of N that the reference is made of: the expected squared error falls from σ²(1/n + 1/N) to σ²(1/n − 1/N).
fn shared_seeds(context: &Context) -> Finding {
    let (n, all) = (16, 64);
    let pixels = context.replicates(4_000, 2_000);
    let mut draws = Draws::new(context, 0);
    let mean = |v: &[f64]| sum(v.iter().copied()) / v.len() as f64;
    let (mut shared, mut apart) = (Vec::new(), Vec::new());
    for _ in 0..pixels {
        let reference = draws.normals(all);
        let square = |test: &[f64]| (mean(test) - mean(&reference)) * (mean(test) - mean(&reference));
        shared.push(square(&reference[..n]));
        apart.push(square(&draws.normals(n)));
    }
    let family = context.family(2);
    let mut tally = Tally::new();
    let (small, true_error) = (1.0 / n as f64 - 1.0 / all as f64, 1.0 / n as f64 + 1.0 / all as f64);
    tally.verdict("MSE with shared samples", &t_test_of_squares(&shared, small, family), small);
    tally.verdict("MSE with samples of its own", &t_test_of_squares(&apart, true_error, family), true_error);
    let refused = |test: Picture| {
        let reference = Reference::new(("R.exr", picture(0.5, "pots", "sobol", "7")), None);
        reference.and_then(|r| r.check("T.exr", &test)).err().map(|e| e.to_string()).unwrap_or_default()
    };
    let said = refused(picture(0.4, "pots", "uniform", "7"));
    tally.fact(format!("an image of the reference's seed is refused: {said:?}"), said.contains("--seed"));
    tally.fact("one of another seed is not", refused(picture(0.4, "pots", "uniform", "8")).is_empty());
    let plan =
        |seeds: [u64; 2]| refuse_equal_seeds(&[planned("halton", seeds[0]), planned("sobol", seeds[1])], "x.json");
    let said = plan([3, 3]).err().map(|e| e.to_string()).unwrap_or_default();
    let named = said.contains("halton") && said.contains("sobol");
    tally.fact(format!("a plan with one seed twice is refused: {said:?}"), named && plan([3, 4]).is_ok());
    tally.saying(format!(
        "shared samples: MSE {:.4} where {:.4} is true; images and plans of equal seeds are refused",
        mean(&shared),
        mean(&apart)
    ))
}

fn spec(text: &str) -> Result<SamplerSpec, String> {
    SamplerSpec::parse(text, Preset::Best).map_err(|e| e.to_string())
}

/// f = xy over `replicates` scrambled nets of n = 64: σ² of one sample 7/144, of the mean 7(4 + 3·6)/(576 n³).
fn within_a_net(context: &Context) -> Finding {
    let owen = match spec("ld:shuffle:owen@each") {
        Ok(owen) => owen,
        Err(what) => return Finding::broken(what),
    };
    let (n, replicates) = (64_u32, context.replicates(4_000, 2_000));
    let (mut naive, mut squares, mut estimates) = (Vec::new(), Vec::new(), Vec::new());
    for r in 0..replicates {
        let Ok(points) = point_set(owen, n, context.seed_of(0, u64::from(r))) else {
            return Finding::broken("64 points of ld cannot be had".to_owned());
        };
        let moments: Moments = points.iter().map(|[x, y]| x * y).collect();
        let (mean, variance) = (moments.mean().unwrap_or(f64::NAN), moments.variance().unwrap_or(f64::NAN));
        naive.push(variance / f64::from(n));
        squares.push((mean - 0.25) * (mean - 0.25));
        estimates.push(mean);
    }
    let cube = f64::from(n).powi(3);
    let truth = 7.0 * 22.0 / (576.0 * cube);
    let family = context.family(3);
    let mut tally = Tally::new();
    tally.verdict("variance between replicates", &t_test_of_squares(&squares, truth, family), truth);
    tally.verdict("mean", &t_test(&estimates, 0.25, family), 0.25);
    let ratio = sum(naive.iter().copied()) / f64::from(replicates) / truth;
    // E s²/n = (σ² − Var)/(n − 1) = 756.7 true variances; s² varies by some per cent, its mean over the replicates by a tenth of one.
    tally.near("s²/n over the true variance", ratio, (7.0 / 144.0 - truth) / 63.0 / truth, 7.5);
    let groups: Vec<&[f64]> = estimates.chunks_exact(10).collect();
    let holds = |g: &&&[f64]| t_interval(g, 0.95).ci95.is_some_and(|[low, high]| low <= 0.25 && 0.25 <= high);
    let (covered, groups) = (groups.iter().filter(holds).count() as u64, groups.len() as u64);
    let [low, high] = clopper_pearson(covered, groups, 1.0 - family.per_test());
    tally.fact(format!("Student over 10 replicates covers {covered} of {groups}, 95 to 97 % stated"), {
        high >= 0.95 && low <= 0.97
    });
    tally.saying(format!(
        "one net's own s²/n is {ratio:.0} times too large; intervals of 10 replicates hold the truth in {covered} of {groups}"
    ))
}

/// Known slopes: −½ exactly, with a floor, and of a net across counts that are no powers of two.
fn slopes(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let ns: Vec<f64> = (2..=10).map(|k| f64::from(1 << k)).collect();
    let slope = |rmse: &dyn Fn(f64) -> f64| {
        loglog_slope(&ns, &ns.iter().map(|n| rmse(*n)).collect::<Vec<_>>()).map_or(f64::NAN, |fit| fit.slope)
    };
    tally.near("RMSE 1/√n", slope(&|n| 1.0 / n.sqrt()), -0.5, 1e-14);
    let floor = 1.0 / 256.0;
    let into = slope(&|n| (1.0 / n + floor).sqrt());
    tally.fact(format!("into a floor of 1/256: slope {into:.3}"), into > -0.45);
    // Replicates of the MSE of independent samples, with the reference's noise and freed of it.
    let mut draws = Draws::new(context, 0);
    let replicate = |draws: &mut Draws, n: f64, floor: f64| {
        let pixels = 256;
        let squares = (0..pixels).map(|_| {
            let z = draws.normal();
            z * z / n + floor
        });
        sum(squares) / f64::from(pixels)
    };
    let mut fit = |floor: f64| {
        let mse: Vec<Vec<f64>> =
            ns.iter().map(|n| (0..8).map(|_| replicate(&mut draws, *n, floor)).collect()).collect();
        slope_with_interval(&ns, &mse, context.seed)
    };
    let (Some(free), Some(floored)) = (fit(0.0), fit(floor)) else {
        return Finding::broken("no line could be fitted".to_owned());
    };
    // σ of the slope: each ln RMSE has √(2/(8·256))/2 = 0.0156; over ln n = 1.39 … 6.93 that is 0.0156/√(60 ln² 2) = 0.0029.
    let critical = crate::stats::student_t_quantile(1.0 - 0.5 * context.family(2).per_test(), f64::INFINITY);
    tally.near("slope of unbiased errors", free.slope, -0.5, critical * 0.0031);
    tally.fact(format!("with the floor in: {:.3}, no power law", floored.slope), floored.is_no_power_law());
    // A net at 64, 96, 128, 192, …: only every other count is one.
    let owen = match spec("ld:shuffle:owen@each") {
        Ok(owen) => owen,
        Err(what) => return Finding::broken(what),
    };
    let counts = [64_u32, 96, 128, 192, 256, 384, 512];
    let error = |n: u32, r: u64| {
        let points = point_set(owen, n, context.seed_of(u64::from(n), r)).unwrap_or_default();
        let mean = sum(points.iter().map(|[x, y]| x * y)) / f64::from(n);
        (mean - 0.25) * (mean - 0.25)
    };
    let net: Vec<Vec<f64>> = counts.iter().map(|&n| (0..200).map(|r| error(n, r)).collect()).collect();
    let zigzag = slope_with_interval(&counts.map(f64::from), &net, context.seed);
    let said = zigzag.map_or(f64::NAN, |z| z.slope);
    tally.fact(format!("a net across 64, 96, 128, …: slope {said:.2}, no power law"), {
        zigzag.is_some_and(|z| z.is_no_power_law())
    });
    tally.saying(format!(
        "{:.3} for −½ from unbiased errors, {:.3} into the floor, {said:.2} for a net's −1.43: the last two are no lines",
        free.slope, floored.slope
    ))
}

/// L2*² of `replicates` randomised sets of n points.
fn l2_star_squares(context: &Context, sampler: &str, n: u32, replicates: u32) -> Result<Vec<f64>, String> {
    let spec = spec(sampler)?;
    let squared = |r: u32| {
        let set = point_set(spec, n, context.seed_of(0, u64::from(r))).map_err(|e| e.to_string())?;
        let points = Points::new_2d(&set).map_err(|_| "a point outside the unit square".to_owned())?;
        l2_squared(&points, L2Kind::Star).ok_or_else(|| "a set too large to measure".to_owned())
    };
    (0..replicates).map(squared).collect()
}

/// E[L2*²] is (5/36 + m/24)/n² for scrambled nets of n = 2^m points and 5/(36 n) for independent ones, whose L2* varies so much
/// that the mean of the roots is some per cent short.
fn mean_of_roots(context: &Context) -> Finding {
    let (n, few) = (64_u32, 16_u32);
    let count = context.replicates(8_000, 6_000);
    let nets = l2_star_squares(context, "ld:shuffle:owen@each", n, context.replicates(2_000, 2_000));
    let (nets, random) = match (nets, l2_star_squares(context, "uniform", few, count)) {
        (Ok(nets), Ok(random)) => (nets, random),
        (Err(what), _) | (_, Err(what)) => return Finding::broken(what),
    };
    let of_nets = (5.0 / 36.0 + 6.0 / 24.0) / f64::from(n * n);
    let of_random = 5.0 / (36.0 * f64::from(few));
    let family = context.family(3);
    let mut tally = Tally::new();
    tally.verdict("mean of L2*² of nets", &t_test_of_squares(&nets, of_nets, family), of_nets);
    tally.verdict("mean of L2*² of independent points", &t_test_of_squares(&random, of_random, family), of_random);
    let roots: Vec<f64> = random.iter().map(|s| s.sqrt()).collect();
    let (below, mean) = (t_test(&roots, of_random.sqrt(), family), sum(roots.iter().copied()) / f64::from(count));
    let is_below = !below.holds() && mean < of_random.sqrt();
    tally.fact(format!("mean of L2* {mean:.5} is below {:.5} ({below})", of_random.sqrt()), is_below);
    tally.saying(format!(
        "16 independent points: root of the mean square {:.5}, mean of the roots {mean:.5}, {:.1} % less",
        of_random.sqrt(),
        100.0 * (1.0 - mean / of_random.sqrt())
    ))
}

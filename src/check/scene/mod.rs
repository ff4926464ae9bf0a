//! The self-test's questions asked about a user's scene: is this sampler biased here, where are decisions coupled, is the
//! reference good enough?
//!
//! Images are small and many. Replicates of the sampler, each under a seed of its own, are compared with an unbiased
//! reference: independent uniform numbers of other seeds, or the closed form where the scene has one. How many there are
//! depends on the scene's size and on the effort, never on a clock.

mod decoupled;
mod numbers;
pub mod tiles;

use std::fmt;
use std::sync::OnceLock;

use crate::error::{Error, Result as Checked};
use crate::experiment::backend::Size;
use crate::experiment::exact::{closed_form, image as exact_image};
use crate::experiment::growth::Sums;
use crate::film::Image;
use crate::render::render;
use crate::sampling::hash::{derive, derive_named};
use crate::sampling::{Decision, PointSource, Preset, Sampler, SamplerSet, SamplerSpec};
use crate::scene::compile::{Scene, Stage};
use crate::scene::config::Estimator;
use crate::scene::load::LoadedScene;
use crate::stats::hypothesis::{sidak, two_sided, welch};
use crate::stats::{Moments, Tails, student_t_quantile};

use super::{Finding, Kind, Result, Settings};

use decoupled::Decoupled;
use numbers::Pair;
use tiles::{Comparison, Rare, Rules, Series, Tiling, Truth, by_place, compare};

/// Columns of an image where no size is asked for.
const COLUMNS: u32 = 48;

/// Samples of the sampler's replicates, and of the reference, at effort 1.
const SAMPLES: [f64; 2] = [(1u64 << 24) as f64, (1u64 << 25) as f64];

/// Most replicates at effort 1, and the least that a test is made of.
const REPLICATES: [f64; 2] = [1024.0, 16.0];

/// What the noise of a reference may be of the error that it judges.
pub const REFERENCE_NOISE: f64 = 0.2;

/// Rounding of an image's f32 pixels, relative to its mean: no difference below is called one.
const ROUNDING: f64 = 1.0 / 4_194_304.0;

/// As far as a closed form may be off the renderer, whose shadow rays start 2⁻¹⁸ of the coordinates off their surfaces.
const EXACT_ALLOWANCE: f64 = 4e-5;

/// A question about a scene.
pub struct SceneCheck {
    name: &'static str,
    claim: &'static str,
    kind: Kind,
    ask: fn(&Question, &Settings, f64) -> Finding,
}

/// The questions, in the order in which they are asked.
pub const CHECKS: [SceneCheck; 3] = [
    SceneCheck {
        name: "scene-bias",
        claim: "the mean image of this sampler is the scene's: no tile and not the whole differs from an unbiased reference",
        kind: Kind::Statistical,
        ask: bias,
    },
    SceneCheck {
        name: "scene-coupling",
        claim: "taking a decision out of step with the others does not change the mean image",
        kind: Kind::Statistical,
        ask: coupling,
    },
    SceneCheck {
        name: "scene-reference",
        claim: "the reference's own noise is at most a fifth of the error that it judges",
        kind: Kind::Statistical,
        ask: reference,
    },
];

/// A scene and a sampler, ready to be asked about.
pub struct Question {
    scene: Scene,
    /// The same with the unbiased estimator, where that is another.
    unbiased: Option<Scene>,
    set: SamplerSet,
    asked: u32,
    taken: u32,
    size: Size,
    exact: Option<Image>,
    images: OnceLock<std::result::Result<Images, String>>,
}

/// What all questions look at.
struct Images {
    /// Means by place of the sampler's replicates.
    ours: Series,
    /// The first replicates as images.
    pilots: Vec<Image>,
    /// Means by place of the reference's batches; empty where the truth is exact.
    theirs: Series,
    batches: Sums,
    /// Samples behind the reference, of one pixel.
    reference_samples: f64,
    /// See [`Question::brightest`].
    brightest: f64,
}

impl Question {
    /// Readies a scene for an image of `size` (by default 48 columns in the file's shape) with `spp` samples per pixel (by
    /// default the file's).
    ///
    /// # Errors
    /// Kind `Input` where the scene does not compile, or the sampler does not serve its decisions.
    pub fn new(loaded: LoadedScene, set: SamplerSet, spp: Option<u32>, size: Option<Size>) -> Checked<Self> {
        let framebuffer = loaded.config.framebuffer;
        let rows = (f64::from(COLUMNS) * f64::from(framebuffer.res_h) / f64::from(framebuffer.res_w)).round();
        // A very wide picture still has a row, a very high one not more rows than columns four times.
        let usual = Size { width: COLUMNS, height: rows.clamp(1.0, 4.0 * f64::from(COLUMNS)) as u32 };
        let size = size.unwrap_or(usual);
        let exact = closed_form(&loaded, size).map(|form| exact_image(&form, size)).transpose()?;
        let pixels = (size.width, size.height);
        let unbiased = match loaded.config.estimator {
            Estimator::Unbiased => None,
            Estimator::Sheet => {
                let mut config = loaded.config.clone();
                config.estimator = Estimator::Unbiased;
                Some(Scene::new(&config, loaded.mesh.clone(), pixels, Stage::Final)?)
            }
        };
        let asked = spp.unwrap_or(framebuffer.sppx);
        let scene = Scene::new(&loaded.config, loaded.mesh, pixels, Stage::Final)?;
        if scene.layout.claims().is_empty() {
            return Err(Error::input("check", "expected a scene that decides something at random, found none"));
        }
        let taken = Sampler::new(set, &scene.layout, asked, 0)?.samples();
        Ok(Self { scene, unbiased, set, asked, taken, size, exact, images: OnceLock::new() })
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Samples per pixel asked for.
    pub fn asked(&self) -> u32 {
        self.asked
    }

    /// Samples per pixel taken.
    pub fn taken(&self) -> u32 {
        self.taken
    }

    /// Size of the images.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Asks one of [`CHECKS`]. The false-alarm rate of all together is `settings.alpha`.
    pub fn run(&self, check: &SceneCheck, settings: &Settings) -> Result {
        let statistical = CHECKS.iter().filter(|c| c.kind == Kind::Statistical).count();
        let level = sidak(settings.alpha, statistical as u64);
        let finding = (check.ask)(self, settings, level);
        let false_alarm = if check.kind == Kind::Statistical { level } else { 0.0 };
        let finding = Finding { false_alarm, ..finding };
        Result { name: check.name, group: "scene", claim: check.claim, failures: &[], finding }
    }

    fn replicates(&self, effort: f64, samples: f64, spp: u32) -> u32 {
        let each = self.size.pixels() as f64 * f64::from(spp);
        // Even, for the two halves of a reference.
        2 * ((REPLICATES[0] * effort.max(1.0)).min(samples * effort / each).max(REPLICATES[1]) / 2.0).round() as u32
    }

    fn tiling(&self) -> Tiling {
        Tiling::new(self.size.width, self.size.height)
    }

    fn sampler(&self, seed: u64) -> Sampler {
        Sampler::new(self.set, &self.scene.layout, self.asked, seed).expect("as when the question was readied")
    }

    fn seed(&self, settings: &Settings, part: u64, replicate: u32) -> u64 {
        derive(derive_named(settings.seed, "scene"), &[part, u64::from(replicate)])
    }

    fn images(&self, settings: &Settings) -> std::result::Result<&Images, String> {
        self.images.get_or_init(|| self.make_images(settings)).as_ref().map_err(Clone::clone)
    }

    fn make_images(&self, settings: &Settings) -> std::result::Result<Images, String> {
        const PILOTS: usize = 8;
        let tiling = self.tiling();
        let (mut ours, mut pilots) = (Vec::new(), Vec::new());
        for replicate in 0..self.replicates(settings.effort, SAMPLES[0], self.taken) {
            let image = rendered(&self.scene, &self.sampler(self.seed(settings, 0, replicate)))?;
            ours.push(tiling.means(&image));
            if pilots.len() < PILOTS {
                pilots.push(image);
            }
        }
        let mut batches = Sums::new(self.size.pixels() as usize);
        let mut theirs = Vec::new();
        let mut reference_samples = 0.0;
        if self.exact.is_none() {
            let truth = self.unbiased.as_ref().unwrap_or(&self.scene);
            let uniform = SamplerSpec::parse("uniform", Preset::Best).expect("a sampler");
            let count = self.replicates(settings.effort, SAMPLES[1], 1);
            let each = SAMPLES[1] * settings.effort / (self.size.pixels() as f64 * f64::from(count));
            let spp = each.clamp(16.0, 65_536.0) as u32;
            let batch = |replicate| {
                let sampler = Sampler::new(uniform, &truth.layout, spp, self.seed(settings, 1, replicate));
                rendered(truth, &sampler.expect("a legal count"))
            };
            reference_samples = f64::from(spp) * f64::from(count);
            for pair in 0..count / 2 {
                let halves = [batch(2 * pair)?, batch(2 * pair + 1)?];
                batches.add([&halves[0].pixels, &halves[1].pixels]);
                theirs.extend(halves.iter().map(|image| tiling.means(image)));
            }
        }
        let brightest = self.brightest(settings)?;
        let (ours, theirs) = (by_place(&ours), by_place(&theirs));
        Ok(Images { ours, pilots, theirs, batches, reference_samples, brightest })
    }

    /// The sampler's replicates against the truth.
    fn against_truth(&self, images: &Images, level: f64) -> Comparison {
        let tiling = self.tiling();
        let rare = self.rare(images);
        match &self.exact {
            Some(exact) => {
                let exact = tiling.means(exact);
                let allowance = EXACT_ALLOWANCE * exact.last().copied().unwrap_or(0.0);
                compare(&tiling, &images.ours, &Truth::Exact(&exact), Rules { allowance, rare, level })
            }
            None => {
                let allowance = ROUNDING * mean_of_last(&images.theirs);
                compare(&tiling, &images.ours, &Truth::Replicates(&images.theirs), Rules { allowance, rare, level })
            }
        }
    }

    /// What rare events may hide from the sampler's replicates and from the reference.
    fn rare(&self, images: &Images) -> Rare {
        let random = self.set.is_random(&self.scene.layout);
        let ours = if random { self.samples_of(images) } else { f64::INFINITY };
        let theirs = if self.exact.is_none() { images.reference_samples } else { f64::INFINITY };
        Rare { range: images.brightest, samples: [ours, theirs] }
    }

    /// Samples of the sampler's replicates together, of one pixel.
    fn samples_of(&self, images: &Images) -> f64 {
        images.ours[0].len() as f64 * f64::from(self.taken)
    }

    /// How bright a single sample is taken to be at most, averaged over channels: as the brightest emitter, or twice as bright
    /// as any lit surface in a quarter of a million samples with independent numbers (as bright, where albedo is shown: nothing
    /// is brighter for being nearer).
    fn brightest(&self, settings: &Settings) -> std::result::Result<f64, String> {
        let scene = self.unbiased.as_ref().unwrap_or(&self.scene);
        let uniform = SamplerSpec::parse("uniform", Preset::Best).expect("a sampler");
        let average = |c: [f32; 3]| c.iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0;
        let emitted: Vec<[f32; 3]> =
            scene.mesh.materials.iter().filter(|m| m.is_emitter).map(|m| m.emission.to_array()).collect();
        let reserve = if scene.lights.is_some() { 2.0 } else { 1.0 };
        let mut brightest = emitted.iter().copied().map(average).fold(0.0, f64::max);
        for image in 0..(f64::from(1 << 18) / self.size.pixels() as f64).ceil() as u32 {
            let seed = self.seed(settings, 2 << 32, image);
            let image = rendered(scene, &Sampler::new(uniform, &scene.layout, 1, seed).expect("a legal count"))?;
            let lit = image.pixels.iter().filter(|pixel| !emitted.contains(pixel));
            brightest = lit.map(|&pixel| reserve * average(pixel)).fold(brightest, f64::max);
        }
        Ok(brightest)
    }
}

impl fmt::Display for Question {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { size, taken, set, scene, exact, .. } = self;
        let truth = if exact.is_some() { "the closed form" } else { "uniform numbers of other seeds" };
        write!(f, "{size}, {taken} samples a pixel of {}, against {truth}; {}", set.expansion(), scene.layout)
    }
}

fn rendered<S: PointSource>(scene: &Scene, source: &S) -> std::result::Result<Image, String> {
    render(scene, source).map(|rendered| rendered.image).map_err(|bad| bad.to_string())
}

/// Mean of the whole image over its replicates.
fn mean_of_last(series: &Series) -> f64 {
    series.last().map_or(0.0, |whole| whole.iter().sum::<f64>() / whole.len().max(1) as f64)
}

/// A difference in percent of `scale`, or as it is where there is none.
fn relative(difference: f64, scale: f64) -> String {
    if scale > 0.0 { format!("{:+.2} %", 100.0 * difference / scale) } else { format!("{difference:+.2e}") }
}

fn bias(question: &Question, settings: &Settings, level: f64) -> Finding {
    let images = match question.images(settings) {
        Ok(images) => images,
        Err(bad) => return Finding::broken(bad),
    };
    let compared = question.against_truth(images, level);
    let whole = compared.places.last().expect("the whole image is a place");
    let scale = whole.expected.abs();
    let share = |difference: f64| if scale > 0.0 { difference / scale } else { difference };
    let detects = compared.places.iter().map(|c| share(c.detects)).fold(0.0, f64::max);
    let worst = compared.worst();
    let mut says = if question.set.is_random(&question.scene.layout) {
        String::new()
    } else {
        "nothing is random, so all of its error is bias; ".to_owned()
    };
    says += &format!(
        "{} of {} places (tiles and the whole image) differ, at worst {} by {} (t = {}, p = {:.1e} by Holm); the whole image is off by {}",
        compared.differing(level),
        compared.places.len(),
        worst.name,
        relative(worst.mean - worst.expected, worst.expected.abs()),
        worst.t.map_or("none, nothing varies".to_owned(), |t| format!("{t:.1}")),
        compared.p,
        relative(whole.mean - whole.expected, scale),
    );
    says += &format!(
        "; a bias of {:.2} % of the image's mean in any tile, or {:.2} % everywhere, would be caught (single samples are taken to be at \
         most {:.3} bright, for what is rarely hit)",
        100.0 * detects,
        100.0 * share(whole.detects),
        images.brightest,
    );
    Finding {
        passed: compared.p >= level,
        statistic: worst.t,
        p_value: Some(compared.p),
        threshold: Some(level),
        false_alarm: level,
        detects: Some(detects),
        tests: compared.places.len() as u32,
        says,
    }
}

/// One decision taken out of step, compared with the sampler as it is, seed by seed.
fn apart(
    question: &Question,
    settings: &Settings,
    images: &Images,
    decision: Decision,
    level: f64,
) -> std::result::Result<Apart, String> {
    let tiling = question.tiling();
    let part = 2 + decision as u64;
    let replicates = images.ours[0].len() as u32;
    let decoupled = (0..replicates).map(|replicate| {
        let source = Decoupled {
            inner: question.sampler(question.seed(settings, 0, replicate)),
            other: question.sampler(question.seed(settings, part, 2 * replicate)),
            apart: decision,
            key: question.seed(settings, part, 2 * replicate + 1),
        };
        rendered(&question.scene, &source).map(|image| tiling.means(&image))
    });
    let decoupled = by_place(&decoupled.collect::<std::result::Result<Vec<_>, _>>()?);
    let differences: Series = images
        .ours
        .iter()
        .zip(&decoupled)
        .map(|(ours, apart)| ours.iter().zip(apart).map(|(a, b)| a - b).collect())
        .collect();
    let nothing = vec![0.0; differences.len()];
    let allowance = ROUNDING * mean_of_last(&images.ours).abs();
    // Radiance is not negative: two samples differ by no more than one may have.
    let rare = Rare { range: images.brightest, samples: [question.samples_of(images), f64::INFINITY] };
    let means = compare(&tiling, &differences, &Truth::Exact(&nothing), Rules { allowance, rare, level });
    Ok(Apart { means, spread: spread_ratio(&images.ours, &decoupled) })
}

/// What taking a decision apart does.
struct Apart {
    means: Comparison,
    /// Variance of the tiles' means with the decision apart over that without, and the p-value of no change.
    spread: Option<(f64, f64)>,
}

/// Sums over the tiles of squared deviations from their means, replicate by replicate, compared by Welch's test: the ratio and
/// its two-sided p-value. `None` where nothing varies.
fn spread_ratio(ours: &Series, apart: &Series) -> Option<(f64, f64)> {
    let sums = |series: &Series| -> Vec<f64> {
        let tiles = &series[..series.len() - 1];
        let centred: Vec<(f64, &Vec<f64>)> =
            tiles.iter().map(|tile| (tile.iter().sum::<f64>() / tile.len() as f64, tile)).collect();
        (0..tiles[0].len())
            .map(|r| centred.iter().map(|(mean, tile)| (tile[r] - mean) * (tile[r] - mean)).sum())
            .collect()
    };
    let (a, b) = (sums(ours), sums(apart));
    let total = |values: &[f64]| values.iter().sum::<f64>();
    // What rounding leaves of a sampler without randomness is no spread.
    (total(&a) > 1e-12 * total(&b)).then(|| Some((total(&b) / total(&a), welch(&b, &a)?.p_two_sided)))?
}

fn coupling(question: &Question, settings: &Settings, level: f64) -> Finding {
    let images = match question.images(settings) {
        Ok(images) => images,
        Err(bad) => return Finding::broken(bad),
    };
    let layout = &question.scene.layout;
    let replicates = (256.0 * settings.effort).clamp(64.0, 4096.0) as u32;
    let seed = question.seed(settings, 1 << 32, 0);
    let pairs = numbers::pairs(question.set, layout, question.asked, seed, replicates, level);
    let decisions: Vec<Decision> = layout.claims().iter().map(|claim| claim.decision).collect();
    let mut says = pairs_said(&pairs);
    if decisions.len() < 2 {
        says += "; the scene makes one decision, there is nothing to take apart";
        let tests = pairs.len() as u32;
        return Finding {
            passed: true,
            statistic: None,
            p_value: None,
            threshold: None,
            false_alarm: level,
            detects: None,
            tests,
            says,
        };
    }
    // Of two decisions, taking either apart is the same.
    let tried = if decisions.len() == 2 { &decisions[1..] } else { &decisions[..] };
    let each = level / tried.len() as f64;
    let scale = mean_of_last(&images.ours).abs();
    let (mut p, mut statistic, mut detects, mut tests) = (1.0f64, None, 0.0f64, 0);
    let (mut moved, mut spreads) = (Vec::new(), Vec::new());
    for &decision in tried {
        let Apart { means: compared, spread } = match apart(question, settings, images, decision, each) {
            Ok(apart) => apart,
            Err(bad) => return Finding::broken(bad),
        };
        if let Some((ratio, p)) = spread {
            spreads.push(format!("the {} × {ratio:.2} (p = {p:.1e})", decision.name()));
        }
        let worst = compared.worst();
        tests += compared.places.len() as u32;
        let largest = compared.places.iter().map(|c| c.detects).fold(0.0, f64::max);
        detects = detects.max(if scale > 0.0 { largest / scale } else { largest });
        if compared.p < each {
            moved.push(format!(
                "the {} by {} of the image's mean in {} (p = {:.1e} by Holm)",
                decision.name(),
                relative(-worst.mean, scale),
                worst.name,
                compared.p,
            ));
        }
        if compared.p <= p {
            (p, statistic) = (compared.p, worst.t);
        }
    }
    says += &if moved.is_empty() {
        format!(
            "; taking a decision apart changes no tile's mean (p = {:.1e}); {:.2} % of the image's mean would be seen",
            (p * tried.len() as f64).min(1.0),
            100.0 * detects
        )
    } else {
        format!("; taken apart, a decision moves the mean image: {}", moved.join(", "))
    };
    if !spreads.is_empty() {
        says +=
            &format!("; variance between replicates of the tiles, taken apart over as it is: {}", spreads.join(", "));
    }
    let p = (p * tried.len() as f64).min(1.0);
    Finding {
        passed: moved.is_empty(),
        statistic,
        p_value: Some(p),
        threshold: Some(level),
        false_alarm: level,
        detects: Some(detects),
        tests,
        says,
    }
}

/// Which numbers go together, in words.
fn pairs_said(pairs: &[Pair]) -> String {
    let coupled: Vec<String> = pairs
        .iter()
        .filter(|pair| pair.is_coupled)
        .map(|pair| {
            let [a, b] = pair.decisions;
            let who =
                if a == b { format!("the two of the {}", a.name()) } else { format!("{} and {}", a.name(), b.name()) };
            format!(
                "{who} (mean product {:+.2}, 1 if equal and 0 if independent; {:.1} times the spread of independent ones, p {})",
                pair.correlation,
                pair.spread,
                if pair.p < 1e-16 { "< 1e-16".to_owned() } else { format!("= {:.1e}", pair.p) }
            )
        })
        .collect();
    if coupled.is_empty() {
        let least = pairs.iter().map(|pair| pair.p).fold(1.0, f64::min);
        format!("no numbers are coupled (p = {least:.1e}, the least of {} pairs, corrected)", pairs.len())
    } else {
        format!("coupled numbers: {}", coupled.join(", "))
    }
}

/// Is the reference shown to be too noisy? With a and b its halves and x one image of the sampler, a pixel's noise is estimated by
/// (a − b)²/4, its error by (x − a)(x − b), both unbiased; the mean over pixels of noise − 0.2² · error is tested for being above
/// 0. Such products are skewed: the p-value of Student's t is multiplied by exp(|γ| z³ / (3 √n)), the leading term by which a
/// skewness γ moves the tail beyond z of a mean of n values (Hall 1987, doi:10.1214/aop/1176992063).
fn reference(question: &Question, settings: &Settings, level: f64) -> Finding {
    let images = match question.images(settings) {
        Ok(images) => images,
        Err(bad) => return Finding::broken(bad),
    };
    let mut finding = Finding {
        passed: true,
        statistic: Some(0.0),
        p_value: Some(1.0),
        threshold: Some(level),
        false_alarm: level,
        detects: Some(0.0),
        tests: 1,
        says: "the truth is a closed form: it has no noise".to_owned(),
    };
    if question.exact.is_some() {
        return finding;
    }
    let [a, b] = images.batches.means();
    let pilots = images.pilots.len() as f64;
    let (mut noises, mut errors) = (Vec::new(), Vec::new());
    for (at, (&a, &b)) in a.as_flattened().iter().zip(b.as_flattened()).enumerate() {
        let (a, b) = (f64::from(a), f64::from(b));
        let error = |image: &Image| {
            let x = f64::from(image.pixels.as_flattened()[at]);
            (x - a) * (x - b)
        };
        noises.push((a - b) * (a - b) / 4.0);
        errors.push(images.pilots.iter().map(error).sum::<f64>() / pilots);
    }
    let allowed = REFERENCE_NOISE * REFERENCE_NOISE;
    let excess: Vec<f64> = noises.iter().zip(&errors).map(|(noise, error)| noise - allowed * error).collect();
    let moments: Moments = excess.iter().copied().collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (noise, error) = (mean(&noises), mean(&errors));
    let standard_error = moments.standard_error().unwrap_or(0.0);
    let n = excess.len() as f64;
    if standard_error > 0.0 {
        let t = moments.mean().unwrap_or(0.0) / standard_error;
        let skewness = Tails::of(&excess).map_or(0.0, |tails| tails.skewness.abs());
        let tail = 0.5 * two_sided(t, n - 1.0);
        let p = if t > 0.0 { tail * libm::exp(skewness * t * t * t / (3.0 * n.sqrt())) } else { 1.0 };
        finding.p_value = Some(p.min(1.0));
        finding.statistic = Some(t);
        // In shares of the error, as RMSE: what has to be exceeded, and by how much.
        let reach = (student_t_quantile(1.0 - level, n - 1.0) + student_t_quantile(0.99, n - 1.0)) * standard_error;
        finding.detects = (error > 0.0).then(|| (1.0 + reach / (allowed * error)).sqrt() - 1.0);
        finding.passed = p >= level;
    }
    let root = |x: f64| x.max(0.0).sqrt();
    let remedy = if finding.passed { "" } else { "; more is to be had with --budget" };
    finding.says = format!(
        "its noise is {:.2e} (RMSE), the error of one image of this sampler {:.2e}: {}, {REFERENCE_NOISE} are allowed \
         (p = {:.1e} of no more){remedy}",
        root(noise),
        root(error),
        if error > 0.0 { format!("{:.3} of it", root(noise) / root(error)) } else { "no share can be told".to_owned() },
        finding.p_value.unwrap_or(1.0),
    );
    finding
}

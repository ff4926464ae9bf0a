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
use crate::experiment::growth::{Sums, is_enough};
use crate::film::Image;
use crate::render::render;
use crate::sampling::hash::{derive, derive_named};
use crate::sampling::{Decision, PointSource, Preset, Sampler, SamplerSet, SamplerSpec, Scope};
use crate::scene::compile::{Scene, Stage};
use crate::scene::config::Estimator;
use crate::scene::load::LoadedScene;
use crate::stats::Family;
use crate::stats::hypothesis::{ks_uniform_test, sidak};
use crate::stats::image_error::mse_unbiased;

use super::{Finding, Kind, Result, Settings};

use decoupled::Decoupled;
use numbers::Pair;
use tiles::{Comparison, Rules, Series, Tiling, Truth, by_place, compare};

/// Columns of an image where no size is asked for.
const COLUMNS: u32 = 48;

/// Samples of the sampler's replicates, and of the reference, at effort 1.
const SAMPLES: [f64; 2] = [(1u64 << 24) as f64, (1u64 << 25) as f64];

/// Replicates at effort 1, and the least that a test is made of.
const REPLICATES: [f64; 2] = [64.0, 16.0];

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
        kind: Kind::Exact,
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

    /// Whether all decisions of the scene read numbers that are random, with a key for each pixel.
    fn pixels_are_independent(&self) -> bool {
        self.scene
            .layout
            .claims()
            .iter()
            .map(|claim| self.set.of(claim.decision))
            .all(|spec: SamplerSpec| spec.is_random() && matches!(spec.scope, Scope::Pixel | Scope::Each))
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
            for pair in 0..count / 2 {
                let halves = [batch(2 * pair)?, batch(2 * pair + 1)?];
                batches.add([&halves[0].pixels, &halves[1].pixels]);
                theirs.extend(halves.iter().map(|image| tiling.means(image)));
            }
        }
        Ok(Images { ours: by_place(&ours), pilots, theirs: by_place(&theirs), batches })
    }

    /// The sampler's replicates against the truth.
    fn against_truth(&self, images: &Images, level: f64) -> Comparison {
        let tiling = self.tiling();
        match &self.exact {
            Some(exact) => {
                let exact = tiling.means(exact);
                let allowance = EXACT_ALLOWANCE * exact.last().copied().unwrap_or(0.0);
                let unseen = self.unseen(&tiling, images, exact.iter().copied(), level);
                compare(&tiling, &images.ours, &Truth::Exact(&exact), Rules { allowance, unseen, level })
            }
            None => {
                let allowance = ROUNDING * mean_of_last(&images.theirs);
                let means = images.theirs.iter().map(|tile| tile.iter().sum::<f64>() / tile.len() as f64);
                let unseen = self.unseen(&tiling, images, means, level);
                compare(&tiling, &images.ours, &Truth::Replicates(&images.theirs), Rules { allowance, unseen, level })
            }
        }
    }

    /// What may have been missed in a tile whose replicates all agree. None of its N samples met an event, so the event's
    /// probability is below ln(1/level)/N but for a chance of `level`; it is taken to be no brighter than ten times the
    /// brightest tile. 0 where nothing is random.
    fn unseen(&self, tiling: &Tiling, images: &Images, means: impl Iterator<Item = f64>, level: f64) -> f64 {
        if !self.set.is_random(&self.scene.layout) {
            return 0.0;
        }
        let [columns, rows] = tiling.shape();
        let pixels = self.size.pixels() as f64 / f64::from(columns * rows);
        let samples = images.ours[0].len() as f64 * f64::from(self.taken) * pixels;
        10.0 * means.fold(0.0, f64::max) * -libm::log(level) / samples
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
    // Half of the rate for the tiles, half for the histogram of their p-values.
    let compared = question.against_truth(images, 0.5 * level);
    let tested: Vec<f64> =
        compared.places[..compared.places.len() - 1].iter().filter(|c| c.t.is_some()).map(|c| c.p).collect();
    // What a closed form allows for bends the p-values.
    let straight = question.exact.is_none() && question.pixels_are_independent();
    let histogram = (straight && tested.len() >= 8)
        .then(|| ks_uniform_test(&tested, Family { tests: 1, false_alarm: 0.5 * level }));
    let histogram_p = histogram.and_then(|verdict| verdict.p_value);
    let p = (2.0 * compared.p.min(histogram_p.unwrap_or(1.0))).min(1.0);
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
        "{} of {} places (tiles and the whole image) differ, at worst {} by {} (t = {}); the whole image is off by {}",
        compared.differing(0.5 * level),
        compared.places.len(),
        worst.name,
        relative(worst.mean - worst.expected, worst.expected.abs()),
        worst.t.map_or("none, nothing varies".to_owned(), |t| format!("{t:.1}")),
        relative(whole.mean - whole.expected, scale),
    );
    if let Some(p) = histogram_p {
        says += &format!("; the tiles' p-values are those of an unbiased image with p = {p:.1e}");
    }
    says += &format!(
        "; a bias of {:.2} % of the image's mean in any tile, or {:.2} % everywhere, would be caught",
        100.0 * detects,
        100.0 * share(whole.detects)
    );
    Finding {
        passed: p >= level,
        statistic: worst.t,
        p_value: Some(p),
        threshold: Some(level),
        false_alarm: level,
        detects: Some(detects),
        tests: compared.places.len() as u32 + u32::from(histogram.is_some()),
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
) -> std::result::Result<Comparison, String> {
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
    // Pairs that all agree are no evidence, whatever they may have missed.
    Ok(compare(&tiling, &differences, &Truth::Exact(&nothing), Rules { allowance, unseen: 0.0, level }))
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
    let (mut p, mut statistic, mut detects, mut tests, mut moved) = (1.0f64, None, 0.0f64, 0, Vec::new());
    for &decision in tried {
        let compared = match apart(question, settings, images, decision, each) {
            Ok(compared) => compared,
            Err(bad) => return Finding::broken(bad),
        };
        let worst = compared.worst();
        tests += compared.places.len() as u32;
        let largest = compared.places.iter().map(|c| c.detects).fold(0.0, f64::max);
        detects = detects.max(if scale > 0.0 { largest / scale } else { largest });
        if compared.p < each {
            moved.push(format!(
                "the {} by {} of the image's mean in {}",
                decision.name(),
                relative(-worst.mean, scale),
                worst.name
            ));
        }
        if compared.p <= p {
            (p, statistic) = (compared.p, worst.t);
        }
    }
    says += &if moved.is_empty() {
        format!("; taking a decision apart changes no tile; {:.2} % of the image's mean would be seen", 100.0 * detects)
    } else {
        format!("; taken apart, a decision moves the mean image: {}", moved.join(", "))
    };
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
                "{who} (correlation {:+.2}, {:.1} times the spread of independent ones)",
                pair.correlation, pair.spread
            )
        })
        .collect();
    if coupled.is_empty() {
        "no numbers are coupled".to_owned()
    } else {
        format!("coupled numbers: {}", coupled.join(", "))
    }
}

fn reference(question: &Question, settings: &Settings, _: f64) -> Finding {
    let images = match question.images(settings) {
        Ok(images) => images,
        Err(bad) => return Finding::broken(bad),
    };
    let finding = |passed, statistic, says| Finding {
        passed,
        statistic,
        p_value: None,
        threshold: Some(REFERENCE_NOISE),
        false_alarm: 0.0,
        detects: None,
        tests: 1,
        says,
    };
    if question.exact.is_some() {
        return finding(true, Some(0.0), "the truth is a closed form: it has no noise".to_owned());
    }
    let [a, b] = images.batches.means();
    let errors =
        images.pilots.iter().map(|t| mse_unbiased(t.pixels.as_flattened(), a.as_flattened(), b.as_flattened()));
    let error = errors.sum::<f64>() / images.pilots.len() as f64;
    let noise = images.batches.noise_mse();
    let upper = noise.ci95.map_or(noise.value, |[_, upper]| upper);
    let enough = is_enough(upper, error, REFERENCE_NOISE);
    let root = |x: f64| x.max(0.0).sqrt();
    let ratio = (error > 0.0).then(|| root(upper) / root(error));
    let remedy = if enough { "" } else { ": more is to be had with --budget" };
    let says = format!(
        "its noise is {:.2e} (RMSE, at most {:.2e} at 95 %), the error of one image of this sampler {:.2e}: {}{remedy}",
        root(noise.value),
        root(upper),
        root(error),
        ratio.map_or("no share can be told".to_owned(), |r| format!("{r:.3} of it, {REFERENCE_NOISE} are allowed")),
    );
    finding(enough, ratio, says)
}

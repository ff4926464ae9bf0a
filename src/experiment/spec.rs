//! An experiment as a file says it: which scenes, under which samplers, how often, compared with what.
//!
//! Strict like a scene file: unknown keys, wrong types, empty or repeated entries are errors that name the place. All
//! keys but those marked optional are needed.
//!
//! | key | meaning |
//! |---|---|
//! | `name` | folder name of the results; letters, digits, `.`, `-`, `_`, not beginning with `.` |
//! | `seed` | whole number of 64 bits; every randomisation is derived from it |
//! | `scenes` | names of scene files in `configs/`, or paths that end in `.json` |
//! | `size` | optional: `"WxH"` for all scenes, or `{"SCENE": "WxH"}`; a scene not named keeps its file's own |
//! | `samplers` | texts `POINTS[:ORDER[:RANDOM[@SCOPE]]]` or `POINTS:PRESET`, or objects `{"points", "order", "random", "scope"}`; a bare name means `:best`; a sampler for each decision: `{"name", "sampler", "pixel", "lens", "light_pick", "light"}`, where `sampler` is what the decisions not named read (without it all four are needed) and `name` is what reports call it |
//! | `spp` | samples per pixel, each 1 to 2^24 |
//! | `replicates` | independent randomisations of each image; 1 is used where nothing is random |
//! | `reference` | `{"sampler", "spp"}`: two independent halves of `spp` samples per pixel, by a randomised sampler that is not compared; optional `"noise"` and `"most_spp"`: grow it ([`growth`](super::growth)) |
//! | `estimator` | optional: `"unbiased"` (the default), `"sheet"`, or `"both"`: unbiased, and where a light is picked among several by the sheet's shortcut too; references are always unbiased |
//! | `points` | optional: `{"n", "metrics", "replicates"}`: point-set metrics of the same samplers |
//! | `pictures` | optional: `{"scene", "size", "spp", "reference_spp"}`, or a list of these: images to look at; `spp` is a count or a ladder of counts, `reference_spp` defaults to the reference's |
//! | `stability` | optional: `{"spp", "scenes", "samplers"}`: a sample more or less, the spread of replicates, other units of length, two passes, all against `spp` samples per pixel; `scenes` and `samplers` default to all of the experiment |
//! | `prediction` | optional: `{"scene", "samplers", "spp", "pixels", "seeds"}`: the variance of single pixels, predicted from spectra and measured over `seeds` randomisations, in a scene whose only decision is that of the pixel; `pixels` are `[column, row]` |
//! | `timing` | optional: `{"rounds", "spp", "rmse"}`: after all else make one image of each scene, sampler and count again in so many rounds, for their seconds alone ([`timing`](super::timing)); `spp` defaults to all; `rmse` is `{"SCENE": [RMSE, …]}`, what the report says the time to reach of (default: what uniform sampling reaches at its counts) |
//! | `peers` | optional: a file of other programs' points ([`peers`](super::peers)), a path from this file's folder |

use std::collections::{BTreeMap, HashSet};
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::backend::{Estimator, Size, Variant};
pub use super::entry::SamplerEntry;
use super::entry::sampler;
use super::peers::Peers;
pub use super::pictures::Pictures;
use super::pictures::{one_or_more, pictures};
pub use super::prediction::Prediction;
use super::prediction::prediction;
pub use super::timing::TimedRounds;
use super::timing::timed_rounds;
use crate::error::{Error, Result};
use crate::scene::json::{self, Item, Value, suggestion};

/// Most samples per pixel.
pub const MOST_SPP: u32 = 1 << 24;

/// Most points of a set in an experiment: the exact star discrepancy takes time n².
pub const MOST_POINTS: u32 = 1 << 16;

/// Most replicates.
pub const MOST_REPLICATES: u32 = 10_000;

/// Most batches that a half of a reference may grow to.
pub const MOST_BATCHES: u32 = 1024;

/// `reference.most_spp` in multiples of `reference.spp`, where it is not given.
pub const DEFAULT_BATCHES: u32 = 16;

/// An experiment, all defaults made explicit.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Experiment {
    /// Folder name of the results.
    pub name: String,
    /// Where every randomisation comes from.
    pub seed: u64,
    /// Scene names or paths, as written.
    pub scenes: Vec<String>,
    /// Image sizes.
    pub size: Sizes,
    /// Samplers, as written.
    pub samplers: Vec<SamplerEntry>,
    /// Samples per pixel.
    pub spp: Vec<u32>,
    /// Independent randomisations of each image.
    pub replicates: u32,
    /// What images are compared with.
    pub reference: Reference,
    /// Light estimators of the compared images.
    pub estimator: Estimators,
    /// Point-set metrics.
    pub points: Option<Points>,
    /// Images to look at.
    #[serde(with = "one_or_more")]
    pub pictures: Vec<Pictures>,
    /// What should make no difference, made to see whether it does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stability: Option<Stability>,
    /// Which variances of single pixels to predict and to measure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prediction: Option<Prediction>,
    /// How images are timed again after all of them are done.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timing: Option<TimedRounds>,
    /// What other programs need for the same scenes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peers: Option<Peers>,
    /// The file, for messages; no part of the experiment.
    #[serde(skip)]
    pub place: String,
}

/// Image sizes of an experiment's scenes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Sizes {
    /// One size for all scenes.
    All(Size),
    /// A size for each scene named; the others keep their file's own.
    PerScene(BTreeMap<String, Size>),
}

impl Sizes {
    /// The size for a scene as the experiment names it, where `own` is what its file asks for.
    pub fn of(&self, scene: &str, own: Size) -> Size {
        match self {
            Self::All(size) => *size,
            Self::PerScene(sizes) => sizes.get(scene).copied().unwrap_or(own),
        }
    }
}

/// What images are compared with: two independent halves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// Sampler, as written; randomised, and none of those compared.
    pub sampler: String,
    /// Samples per pixel of each half, or of each of its batches where it grows.
    pub spp: u32,
    /// Grow until the reference's own RMSE is at most this share of the smallest RMSE it has to judge, above 0 and at
    /// most 1; `None`: it does not grow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<f64>,
    /// Most samples per pixel of each half, at least `spp`; there where `noise` is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub most_spp: Option<u32>,
}

// `noise` is read as a number between 0 and 1, so it equals itself.
impl Eq for Reference {}

impl Reference {
    /// Most batches of a half: the largest power of two whose samples fit into `most_spp`; 1 where it does not grow.
    pub fn most_batches(&self) -> u32 {
        let fit = self.noise.and(self.most_spp).map_or(1, |most| (most / self.spp).max(1));
        1 << fit.ilog2()
    }
}

/// Point-set metrics to compute.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Points {
    /// Sizes of the sets.
    pub n: Vec<u32>,
    /// Names of the metrics.
    pub metrics: Vec<String>,
    /// Independent randomisations of each set; 1 is used where nothing is random.
    pub replicates: u32,
}

/// Which light estimators the compared images are made with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Estimators {
    /// Divided by the probability of the choice among lights.
    Unbiased,
    /// The sheet's shortcut.
    Sheet,
    /// Unbiased; where a light is picked among several the sheet's shortcut too.
    Both,
}

impl Estimators {
    /// Its word in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Unbiased => "unbiased",
            Self::Sheet => "sheet",
            Self::Both => "both",
        }
    }

    /// The estimator that an experiment's comparisons of samplers are made with.
    pub fn primary(self) -> Estimator {
        match self {
            Self::Unbiased | Self::Both => Estimator::Unbiased,
            Self::Sheet => Estimator::Sheet,
        }
    }
}

/// Which images are made once more in other ways, see [`Variant`], and how often.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stability {
    /// Samples per pixel that all else is held against; [`counts`](Self::counts) are its neighbours.
    pub spp: u32,
    /// Scenes, as the experiment names them.
    pub scenes: Vec<String>,
    /// Samplers, as written; each means one of the experiment's.
    pub samplers: Vec<String>,
}

/// The count that the exercise sheet asks for.
pub const SHEET_SPP: u32 = 26;

impl Stability {
    /// The counts whose error is held against that of `spp`: one less (where that leaves any), one more, and the sheet's 26.
    pub fn counts(&self) -> Vec<u32> {
        let mut counts: Vec<u32> = Vec::new();
        for count in [self.spp - 1, self.spp + 1, SHEET_SPP] {
            if count > 0 && count <= MOST_SPP && count != self.spp && !counts.contains(&count) {
                counts.push(count);
            }
        }
        counts
    }

    /// The variants whose images are held against the plain ones; one sample cannot be taken in two passes.
    pub fn variants(&self) -> Vec<Variant> {
        Variant::COMPARED.into_iter().filter(|&variant| variant != Variant::TwoPasses || self.spp > 1).collect()
    }
}

impl Experiment {
    /// Reads an experiment file.
    ///
    /// # Errors
    /// Kind `Input` that names file and key, what was expected and what was found.
    pub fn read(path: &Path) -> Result<Self> {
        Self::from_value(&json::read_file(path)?, &path.display().to_string())
    }

    /// Reads an experiment from JSON; `place`, its path, names it in messages and is where `peers` is looked for from.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn from_value(value: &Value, place: &str) -> Result<Self> {
        let mut fields = Item::top(value, place).fields()?;
        let name = fields.need("name", name)?;
        let seed = fields.need("seed", |item| item.integer(0..=u64::MAX))?;
        let scenes = fields.need("scenes", |item| texts(&item, "scene names"))?;
        let size = fields.or("size", Sizes::PerScene(BTreeMap::new()), |item| sizes(&item, &scenes))?;
        let samplers = fields.need("samplers", |item| samplers(&item))?;
        let spp = fields.need("spp", |item| counts(&item, MOST_SPP))?;
        let replicates = fields.need("replicates", |item| count(&item, MOST_REPLICATES))?;
        let reference = fields.need("reference", |item| reference(&item))?;
        let estimators = [("unbiased", Estimators::Unbiased), ("sheet", Estimators::Sheet), ("both", Estimators::Both)];
        let estimator = fields.or("estimator", Estimators::Unbiased, |item| item.choice(&estimators))?;
        let points = fields.opt("points", |item| points(&item))?;
        let pictures = fields.or("pictures", Vec::new(), |item| pictures(&item, &scenes, reference.spp))?;
        let stability = fields.opt("stability", |item| stability(&item, &scenes, &samplers))?;
        let prediction = fields.opt("prediction", |item| prediction(&item, &scenes))?;
        let timing = fields.opt("timing", |item| timed_rounds(&item, &scenes, &spp))?;
        let peers = fields.opt("peers", |item| match item.text("a path")? {
            "" => Err(item.unexpected("a path of a file with other programs' points")),
            file => Peers::read(Path::new(place).parent().unwrap_or(Path::new("")), file),
        })?;
        fields.finish()?;
        Ok(Self {
            name,
            seed,
            scenes,
            size,
            samplers,
            spp,
            replicates,
            reference,
            estimator,
            points,
            pictures,
            stability,
            prediction,
            timing,
            peers,
            place: place.to_owned(),
        })
    }
}

/// A folder name that means the same on every system.
fn name(item: Item) -> Result<String> {
    let expected = "a name of 1 to 64 letters, digits, '.', '-' and '_' that does not begin with '.'";
    let name = item.text(expected)?;
    let plain = name.bytes().all(|b| b.is_ascii_alphanumeric() || b".-_".contains(&b));
    if plain && !name.starts_with('.') && (1..=64).contains(&name.len()) {
        Ok(name.to_owned())
    } else {
        Err(item.unexpected(expected))
    }
}

/// A list of at least one entry, each once.
pub(super) fn list<'a, T: std::hash::Hash + Eq + Clone>(
    item: &Item<'a>,
    what: &str,
    read: impl Fn(&Item<'a>) -> Result<T>,
) -> Result<Vec<T>> {
    let expected = format!("a list of {what}, at least one, each once");
    let items = item.items(&expected)?;
    if items.is_empty() {
        return Err(item.unexpected(expected));
    }
    let mut seen = HashSet::new();
    items
        .iter()
        .map(|item| {
            let value = read(item)?;
            if seen.insert(value.clone()) { Ok(value) } else { Err(repeated(item)) }
        })
        .collect()
}

/// The error about an entry that stands twice in its list.
fn repeated(item: &Item) -> Error {
    Error::input(&item.place, format!("expected each entry once, found {} again", item.value))
}

/// A list of names.
fn texts(item: &Item, what: &str) -> Result<Vec<String>> {
    list(item, what, |item| match item.text("a text")? {
        "" => Err(item.unexpected("a text that is not empty")),
        text => Ok(text.to_owned()),
    })
}

/// The compared samplers; no two are called the same.
fn samplers(item: &Item) -> Result<Vec<SamplerEntry>> {
    let samplers = list(item, "samplers", SamplerEntry::read)?;
    for (i, sampler) in samplers.iter().enumerate() {
        if samplers[..i].iter().any(|other| other.name() == sampler.name()) {
            let what = format!("expected a name of its own, found {:?} again", sampler.name());
            return Err(Error::input(item.place.index(i), what));
        }
    }
    Ok(samplers)
}

/// A number of things, at least 1.
pub(super) fn count(item: &Item, most: u32) -> Result<u32> {
    // `integer` keeps to the range, so nothing is cut off.
    item.integer(1..=u64::from(most)).map(|n| n as u32)
}

/// A list of numbers of things.
pub(super) fn counts(item: &Item, most: u32) -> Result<Vec<u32>> {
    list(item, "whole numbers", |item| count(item, most))
}

/// `"WxH"`.
pub(super) fn size(item: &Item) -> Result<Size> {
    let text = item.text("a size such as \"320x180\"")?;
    Size::parse(text).map_err(|what| Error::input(&item.place, what))
}

/// `"WxH"` or `{"SCENE": "WxH"}`.
fn sizes(item: &Item, scenes: &[String]) -> Result<Sizes> {
    match item.value {
        Value::Text(_) => size(item).map(Sizes::All),
        Value::Object(pairs) => {
            let one = |(scene, value): &(String, Value)| {
                let item = Item { value, place: item.place.key(scene) };
                known_scene(scene, scenes, &item)?;
                Ok((scene.clone(), size(&item)?))
            };
            pairs.iter().map(one).collect::<Result<_>>().map(Sizes::PerScene)
        }
        _ => Err(item.unexpected("a size such as \"320x180\", or an object of one for each scene")),
    }
}

/// A scene has to be one of the experiment's.
pub(super) fn known_scene(scene: &str, scenes: &[String], item: &Item) -> Result<()> {
    if scenes.iter().any(|known| known == scene) {
        return Ok(());
    }
    let near = suggestion(scene, scenes.iter().map(String::as_str));
    Err(Error::input(&item.place, format!("expected one of the scenes {}, found {scene:?}{near}", scenes.join(" "))))
}

/// `reference`.
fn reference(item: &Item) -> Result<Reference> {
    let mut fields = item.fields()?;
    let sampler = fields.need("sampler", |item| item.text("a sampler").map(str::to_owned))?;
    let spp = fields.need("spp", |item| count(&item, MOST_SPP))?;
    let noise = fields.opt("noise", |item| item.f64("a share above 0 and at most 1", |x| x > 0.0 && x <= 1.0))?;
    let most_spp = fields.opt("most_spp", |asked| match noise {
        Some(_) => most_spp(&asked, spp),
        None => Err(asked.unexpected("\"noise\" where \"most_spp\" is given: without it a reference does not grow")),
    })?;
    fields.finish()?;
    let most_spp = noise.map(|_| most_spp.unwrap_or_else(|| spp.saturating_mul(DEFAULT_BATCHES)));
    Ok(Reference { sampler, spp, noise, most_spp })
}

/// `reference.most_spp`: as much as one batch, and no more batches than a plan can list.
fn most_spp(item: &Item, spp: u32) -> Result<u32> {
    let most = u64::from(spp) * u64::from(MOST_BATCHES);
    item.integer(u64::from(spp)..=most.min(u64::from(u32::MAX))).map(|n| n as u32)
}

/// `points`.
fn points(item: &Item) -> Result<Points> {
    let mut fields = item.fields()?;
    let n = fields.need("n", |item| counts(&item, MOST_POINTS))?;
    let metrics = fields.need("metrics", |item| texts(&item, "metrics"))?;
    let replicates = fields.need("replicates", |item| count(&item, MOST_REPLICATES))?;
    fields.finish()?;
    Ok(Points { n, metrics, replicates })
}

/// `stability`. Whether its samplers are among the experiment's is a question of what they mean, so the plan asks it.
fn stability(item: &Item, scenes: &[String], samplers: &[SamplerEntry]) -> Result<Stability> {
    let mut fields = item.fields()?;
    let spp = fields.need("spp", |item| count(&item, MOST_SPP))?;
    let scenes = fields.or("scenes", scenes.to_vec(), |item| {
        list(&item, "scene names", |item| {
            let scene = item.text("a scene of the experiment")?;
            known_scene(scene, scenes, item)?;
            Ok(scene.to_owned())
        })
    })?;
    let samplers = {
        let all = samplers.iter().map(|entry| entry.name().to_owned()).collect();
        fields.or("samplers", all, |item| list(&item, "samplers", sampler))?
    };
    fields.finish()?;
    Ok(Stability { spp, scenes, samplers })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: &str = r#"{
        "name": "small", "seed": 18446744073709551615, "scenes": ["pots", "box"], "size": {"box": "6x4"},
        "samplers": ["uniform", "ld:sheet"], "spp": [1, 4], "replicates": 3,
        "reference": {"sampler": "sobol", "spp": 64},
        "points": {"n": [2, 4], "metrics": ["star"], "replicates": 2},
        "pictures": {"scene": "pots", "size": "8x4", "spp": 2}
    }"#;

    fn read(text: &str) -> Result<Experiment> {
        Experiment::from_value(&json::parse(text.as_bytes(), "small.json")?, "small.json")
    }

    #[test]
    fn an_experiment_reads_with_its_defaults_made_explicit() {
        let experiment = read(SMALL).unwrap();
        assert_eq!(experiment.seed, u64::MAX);
        assert_eq!(experiment.estimator, Estimators::Unbiased);
        assert_eq!(experiment.pictures[0].reference_spp, 64);
        let own = Size { width: 9, height: 9 };
        assert_eq!(experiment.size.of("box", own), Size { width: 6, height: 4 });
        assert_eq!(experiment.size.of("pots", own), own);
    }

    #[test]
    fn stability_means_all_scenes_and_samplers_where_it_names_none() {
        let with =
            |entry: &str| read(&SMALL.replacen('{', &format!("{{\"stability\": {entry},"), 1)).unwrap().stability;
        let stability = with("{\"spp\": 64}").unwrap();
        assert_eq!(stability.scenes, ["pots", "box"]);
        assert_eq!(stability.samplers, ["uniform", "ld:sheet"]);
        assert_eq!(stability.counts(), [63, 65, SHEET_SPP]);
        let counts = |spp: u32| Stability { spp, ..stability.clone() }.counts();
        assert_eq!((counts(1), counts(25)), (vec![2, SHEET_SPP], vec![24, SHEET_SPP]));
        assert_eq!((counts(26), counts(MOST_SPP)), (vec![25, 27], vec![MOST_SPP - 1, SHEET_SPP]));
        assert_eq!(with("{\"spp\": 64, \"scenes\": [\"box\"]}").unwrap().scenes, ["box"]);
    }

    #[test]
    fn what_is_recorded_of_an_experiment_reads_back_equal() {
        let more = SMALL.replacen('{', "{\"stability\": {\"spp\": 64}, \"estimator\": \"both\",", 1);
        let grown = SMALL.replace("\"spp\": 64}", "\"spp\": 64, \"noise\": 0.2}");
        for text in [SMALL, &more, &grown] {
            let experiment = Experiment { place: String::new(), ..read(text).unwrap() };
            let recorded = serde_json::to_string(&experiment).unwrap();
            assert_eq!(serde_json::from_str::<Experiment>(&recorded).unwrap(), experiment);
            // What is not asked for is not recorded: older records read, and stay as they are.
            assert_eq!(recorded.contains("stability"), text.contains("stability"));
            assert_eq!(recorded.contains("noise"), text.contains("noise"));
        }
    }

    #[test]
    fn a_reference_grows_by_powers_of_two_within_its_most_spp() {
        let most = |more: &str| {
            let text = SMALL.replace("\"spp\": 64}", &format!("\"spp\": 64{more}}}"));
            read(&text).unwrap().reference.most_batches()
        };
        assert_eq!(most(""), 1);
        assert_eq!(most(", \"noise\": 0.2"), DEFAULT_BATCHES);
        let cases = [(64, 1), (127, 1), (128, 2), (700, 8), (65536, MOST_BATCHES)];
        for (spp, batches) in cases {
            assert_eq!(most(&format!(", \"noise\": 1, \"most_spp\": {spp}")), batches, "{spp}");
        }
    }

    /// Each edit of a good file, and what the message has to say of it.
    const BAD: [(&str, &str, &str); 41] = [
        ("\"seed\"", "\"sede\"", "expected the key \"seed\""),
        ("\"points\"", "\"pionts\"", "pionts: expected one of the keys"),
        ("\"points\"", "\"pionts\"", "did you mean \"points\"?"),
        ("\"spp\": 2}", "\"sppx\": 2}", "pictures: expected the key \"spp\""),
        ("\"small\"", "\"../small\"", "name: expected a name of"),
        ("\"small\"", "\".small\"", "name: expected a name of"),
        ("\"small\"", "\"\"", "name: expected a name of"),
        ("18446744073709551615", "-1", "seed: expected a whole number"),
        ("18446744073709551615", "1.5", "seed: expected a whole number"),
        ("[\"pots\", \"box\"]", "[]", "scenes: expected a list of scene names, at least one, each once, found []"),
        (
            "[\"pots\", \"box\"]",
            "[\"pots\", \"box\", \"pots\"]",
            "scenes[2]: expected each entry once, found \"pots\" again",
        ),
        ("[\"pots\", \"box\"]", "\"pots\"", "scenes: expected a list"),
        ("{\"box\": \"6x4\"}", "{\"bxo\": \"6x4\"}", "size.bxo: expected one of the scenes pots box"),
        ("\"6x4\"", "\"6x0\"", "size.box: expected a size such as"),
        ("\"6x4\"", "64", "size.box: expected a size such as"),
        ("{\"box\": \"6x4\"}", "12", "size: expected a size such as"),
        ("\"ld:sheet\"", "{\"name\": \"x\"}", "samplers[1]: expected \"sampler\" or each of"),
        ("\"ld:sheet\"", "{\"pionts\": \"x\"}", "samplers[1]: expected the key \"points\""),
        (
            "\"ld:sheet\"",
            "{\"name\": \"uniform\", \"sampler\": \"ld\"}",
            "samplers[1]: expected a name of its own, found \"uniform\" again",
        ),
        (
            "\"ld:sheet\"",
            "{\"points\": \"ld\", \"random\": \"owen\"}",
            "samplers[1]: expected \"order\" where a later part is given",
        ),
        ("\"ld:sheet\"", "{\"points\": \"ld\", \"ordr\": \"step\"}", "did you mean \"order\""),
        ("\"ld:sheet\"", "\"uniform\"", "samplers[1]: expected each entry once"),
        ("\"ld:sheet\"", "\"\"", "samplers[1]: expected a text that is not empty"),
        ("[1, 4]", "[1, 0]", "spp[1]: expected a whole number from 1 to 16777216, found 0"),
        ("[1, 4]", "[16777217]", "spp[0]: expected a whole number from 1 to 16777216"),
        ("[1, 4]", "[4, 4.0]", "spp[1]: expected each entry once"),
        ("\"replicates\": 3", "\"replicates\": 0", "replicates: expected a whole number from 1"),
        ("\"spp\": 64}", "\"spp\": 0}", "reference.spp: expected a whole number"),
        (
            "\"seed\": ",
            "\"estimator\": \"sheat\", \"seed\": ",
            "estimator: expected \"unbiased\" or \"sheet\" or \"both\", found",
        ),
        ("\"spp\": 64}", "\"spp\": 64, \"noise\": 0}", "reference.noise: expected a share above 0 and at most 1"),
        ("\"spp\": 64}", "\"spp\": 64, \"noise\": 1.5}", "reference.noise: expected a share above 0 and at most 1"),
        ("\"spp\": 64}", "\"spp\": 64, \"nois\": 0.5}", "did you mean \"noise\"?"),
        ("\"spp\": 64}", "\"spp\": 64, \"most_spp\": 128}", "reference.most_spp: expected \"noise\" where"),
        (
            "\"spp\": 64}",
            "\"spp\": 64, \"noise\": 0.2, \"most_spp\": 63}",
            "reference.most_spp: expected a whole number from 64 to 65536, found 63",
        ),
        (
            "\"scene\": \"pots\"",
            "\"scene\": \"pot\"",
            "pictures.scene: expected one of the scenes pots box, found \"pot\"; did you mean",
        ),
        ("[2, 4]", "[65537]", "points.n[0]: expected a whole number from 1 to 65536"),
        ("\"seed\": ", "\"stability\": {}, \"seed\": ", "stability: expected the key \"spp\""),
        ("\"seed\": ", "\"stability\": {\"spp\": 0}, \"seed\": ", "stability.spp: expected a whole number from 1"),
        (
            "\"seed\": ",
            "\"stability\": {\"spp\": 4, \"scenes\": [\"pos\"]}, \"seed\": ",
            "stability.scenes[0]: expected one of the scenes pots box, found \"pos\"; did you mean",
        ),
        (
            "\"seed\": ",
            "\"stability\": {\"spp\": 4, \"samplers\": []}, \"seed\": ",
            "stability.samplers: expected a list of samplers",
        ),
        (
            "\"seed\": ",
            "\"stability\": {\"spp\": 4, \"sampler\": []}, \"seed\": ",
            "stability.sampler: expected one of the keys spp scenes samplers",
        ),
    ];

    #[test]
    fn every_bad_entry_is_an_error_that_names_its_place() {
        for (good, bad, expected) in BAD {
            let text = SMALL.replacen(good, bad, 1);
            assert_ne!(text, SMALL, "{good}");
            let error = read(&text).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            let message = error.to_string();
            assert!(message.starts_with("small.json") && message.contains(expected), "{message} ({expected})");
        }
    }

    #[test]
    fn a_missing_file_is_bad_input() {
        assert_eq!(Experiment::read(Path::new("no/such/experiment.json")).unwrap_err().exit_code(), 2);
    }
}

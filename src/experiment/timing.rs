//! `timing` of an experiment, and the lines of `timings.jsonl`: the only place with values from a clock.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::spec::{MOST_SPP, count, counts, known_scene, list};
use crate::error::{Error, Result};
use crate::scene::json::{Item, Value};

/// Most rounds.
pub const MOST_ROUNDS: u32 = 1000;

/// How images are timed again after all of them are done: in rounds, each of which makes one image of every scene, sampler and
/// count, so that what else the machine does at some moment meets all of them and not one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TimedRounds {
    /// Number of rounds; six are the fewest whose median has a 95 % interval.
    pub rounds: u32,
    /// Samples per pixel, among those of the experiment.
    pub spp: Vec<u32>,
    /// RMSE, in radiance, that the report asks the time for, by scene as the experiment names it.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub rmse: BTreeMap<String, Vec<f64>>,
}

// Targets are read as positive numbers, so each equals itself.
impl Eq for TimedRounds {}

/// `timing`.
pub(super) fn timed_rounds(item: &Item, scenes: &[String], all: &[u32]) -> Result<TimedRounds> {
    let mut fields = item.fields()?;
    let rounds = fields.need("rounds", |item| count(&item, MOST_ROUNDS))?;
    let spp = fields.or("spp", all.to_vec(), |item| {
        let spp = counts(&item, MOST_SPP)?;
        match spp.iter().position(|n| !all.contains(n)) {
            None => Ok(spp),
            Some(at) => {
                let what = format!("expected one of the experiment's counts {}, found {}", words(all), spp[at]);
                Err(Error::input(item.place.index(at), what))
            }
        }
    })?;
    let rmse = fields.or("rmse", BTreeMap::new(), |item| targets(&item, scenes))?;
    fields.finish()?;
    Ok(TimedRounds { rounds, spp, rmse })
}

fn words(counts: &[u32]) -> String {
    counts.iter().map(u32::to_string).collect::<Vec<_>>().join(" ")
}

/// `{"SCENE": [0.05, 0.02]}`.
fn targets(item: &Item, scenes: &[String]) -> Result<BTreeMap<String, Vec<f64>>> {
    let Value::Object(pairs) = item.value else {
        return Err(item.unexpected("an object of lists of RMSE, one for each scene"));
    };
    let one = |(scene, value): &(String, Value)| {
        let item = Item { value, place: item.place.key(scene) };
        known_scene(scene, scenes, &item)?;
        let read = |item: &Item| item.f64("an RMSE above 0", |x| x > 0.0).map(f64::to_bits);
        let bits = list(&item, "RMSE above 0", read)?;
        Ok((scene.clone(), bits.into_iter().map(f64::from_bits).collect()))
    };
    pairs.iter().map(one).collect()
}

/// One line of `timings.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// The item.
    pub id: String,
    /// Wall seconds of rendering, without loading the scene or writing the image.
    pub seconds: f64,
    /// Samples rendered: spp taken × pixels.
    pub samples: u64,
    /// The machine, in words.
    pub host: String,
    /// Threads that worked.
    pub threads: usize,
    /// Load average of the last minute when the item began; null where the system tells none.
    pub load: Option<f64>,
    /// The image made again in rounds; absent where it was not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub again: Option<Rounds>,
}

/// The same image made again, once in each round: one machine, one number of threads.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Rounds {
    /// The machine, in words.
    pub host: String,
    /// Threads that worked.
    pub threads: usize,
    /// Wall seconds of rendering, round by round.
    pub seconds: Vec<f64>,
    /// Wall seconds of drawing the image's random numbers and nothing else, round by round; empty where nobody can.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub numbers: Vec<f64>,
    /// Load average of the last minute when each began; as far as the system tells.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub load: Vec<f64>,
}

impl Timing {
    /// The rounds so far on this machine with so many threads; those of another are no part of the same median.
    pub(super) fn rounds_on(&self, host: &str, threads: usize) -> usize {
        let same = |again: &&Rounds| again.host == host && again.threads == threads;
        self.again.as_ref().filter(same).map_or(0, |again| again.seconds.len())
    }
}

/// One line of `timings.jsonl`.
pub(super) fn parse_timing(line: &str) -> std::result::Result<Timing, String> {
    serde_json::from_str(line).map_err(|e| format!("expected a timing, found: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::json;

    fn read(text: &str) -> Result<TimedRounds> {
        let value = json::parse(text.as_bytes(), "a.json")?;
        timed_rounds(&Item::top(&value, "a.json"), &["pots".to_owned(), "box".to_owned()], &[1, 4, 16])
    }

    #[test]
    fn rounds_are_of_all_counts_or_of_those_named() {
        let all = read(r#"{"rounds": 9}"#).unwrap();
        assert_eq!((all.rounds, all.spp.as_slice(), all.rmse.len()), (9, &[1, 4, 16][..], 0));
        let some = read(r#"{"rounds": 1, "spp": [16], "rmse": {"box": [0.5, 2]}}"#).unwrap();
        assert_eq!((some.spp.as_slice(), some.rmse["box"].as_slice()), (&[16][..], &[0.5, 2.0][..]));
        let recorded = serde_json::to_string(&some).unwrap();
        assert_eq!(serde_json::from_str::<TimedRounds>(&recorded).unwrap(), some);
    }

    #[test]
    fn bad_rounds_are_refused_with_their_place() {
        for (text, what) in [
            ("3", "a.json: expected"),
            ("{}", "expected the key \"rounds\""),
            (r#"{"rounds": 0}"#, "rounds: expected a whole number from 1 to 1000, found 0"),
            (r#"{"rounds": 2, "spp": [8]}"#, "spp[0]: expected one of the experiment's counts 1 4 16, found 8"),
            (r#"{"rounds": 2, "rmse": {"bix": [1]}}"#, "rmse.bix: expected one of the scenes pots box"),
            (r#"{"rounds": 2, "rmse": {"box": [0]}}"#, "rmse.box[0]: expected an RMSE above 0, found 0"),
            (r#"{"rounds": 2, "rmse": {"box": []}}"#, "rmse.box: expected a list of RMSE above 0"),
            (r#"{"rounds": 2, "rmse": [1]}"#, "rmse: expected an object of lists of RMSE"),
            (r#"{"rounds": 2, "round": 1}"#, "did you mean"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(what), "{text}: {error}");
        }
    }

    #[test]
    fn a_line_without_rounds_is_as_before_and_rounds_of_another_machine_do_not_count() {
        let line = r#"{"id":"a","seconds":0.5,"samples":8,"host":"h","threads":2,"load":null}"#;
        let mut timing = parse_timing(line).unwrap();
        assert_eq!(serde_json::to_string(&timing).unwrap(), line);
        assert_eq!(timing.rounds_on("h", 2), 0);
        let seconds = vec![0.4, 0.6];
        timing.again = Some(Rounds { host: "h".to_owned(), threads: 2, seconds, ..Rounds::default() });
        assert_eq!((timing.rounds_on("h", 2), timing.rounds_on("h", 1), timing.rounds_on("g", 2)), (2, 0, 0));
        assert_eq!(parse_timing(&serde_json::to_string(&timing).unwrap()).unwrap(), timing);
    }
}

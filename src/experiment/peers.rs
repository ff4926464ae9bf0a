//! `peers` of an experiment: what other programs need for the same scenes, measured elsewhere, to be drawn beside ours.
//!
//! A file of its own, as `benches/peers/run.sh` writes it:
//!
//! ```json
//! {"note": "warm renders",
//!  "points": [{"name": "Mitsuba 3.9.1 independent", "scene": "cornell", "size": "128x128", "spp": 64,
//!              "seconds": 0.03, "seconds_range": [0.029, 0.034], "rmse": 0.0067, "rmse_range": [0.0066, 0.0068],
//!              "machine": "AMD EPYC, 2 threads", "date": "2026-11-25"}]}
//! ```
//!
//! `rmse` is over all pixels and channels of the picture in linear radiance, as ours is: an error that leaves some pixels out is
//! another quantity and belongs in no such file. `note`, `seconds_range` and `rmse_range` are optional. What is read is kept in `experiment.json`, so a report needs no file.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::backend::Size;
use super::spec::{MOST_SPP, count, size};
use crate::error::{Error, Result};
use crate::scene::json::{self, Item};

/// Most points of a file.
const MOST_POINTS: usize = 1000;

/// Other programs' points.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Peers {
    /// The file, as the experiment names it: a path from the experiment's own folder.
    pub file: String,
    /// What the file says of all its points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// The points.
    pub points: Vec<PeerPoint>,
}

// All numbers are read as finite.
impl Eq for Peers {}

/// One program on one scene at one count.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PeerPoint {
    /// Program, version and sampler, as a legend names them.
    pub name: String,
    /// Scene, by the name of its file.
    pub scene: String,
    /// Image size.
    pub size: Size,
    /// Samples per pixel taken.
    pub spp: u32,
    /// Seconds of rendering, a median.
    pub seconds: f64,
    /// Their range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seconds_range: Option<[f64; 2]>,
    /// RMSE over all pixels and channels, radiance.
    pub rmse: f64,
    /// Its interval or range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rmse_range: Option<[f64; 2]>,
    /// The machine.
    pub machine: String,
    /// The day, `YYYY-MM-DD`.
    pub date: String,
}

impl Peers {
    /// Reads `file`, a path from `folder`.
    ///
    /// # Errors
    /// Kind `Input` that names file and key, what was expected and what was found.
    pub fn read(folder: &Path, file: &str) -> Result<Self> {
        let path = folder.join(file);
        let value = json::read_file(&path)?;
        Self::of(&Item::top(&value, &path.display().to_string()), file)
    }

    fn of(item: &Item, file: &str) -> Result<Self> {
        let mut fields = item.fields()?;
        let note = fields.opt("note", |item| words(&item))?;
        let points = fields.need("points", |item| {
            let expected = format!("a list of 1 to {MOST_POINTS} points");
            let items = item.items(&expected)?;
            match items.len() {
                1..=MOST_POINTS => items.iter().map(PeerPoint::of).collect::<Result<Vec<_>>>(),
                _ => Err(item.unexpected(expected)),
            }
        })?;
        fields.finish()?;
        Ok(Self { file: file.to_owned(), note, points })
    }
}

impl PeerPoint {
    fn of(item: &Item) -> Result<Self> {
        let mut fields = item.fields()?;
        let point = Self {
            name: fields.need("name", |item| words(&item))?,
            scene: fields.need("scene", |item| words(&item))?,
            size: fields.need("size", |item| size(&item))?,
            spp: fields.need("spp", |item| count(&item, MOST_SPP))?,
            seconds: fields.need("seconds", |item| positive(&item))?,
            seconds_range: fields.opt("seconds_range", |item| range(&item))?,
            rmse: fields.need("rmse", |item| positive(&item))?,
            rmse_range: fields.opt("rmse_range", |item| range(&item))?,
            machine: fields.need("machine", |item| words(&item))?,
            date: fields.need("date", |item| date(&item))?,
        };
        fields.finish()?;
        let ranges = [("seconds", point.seconds, point.seconds_range), ("rmse", point.rmse, point.rmse_range)];
        for (key, value, range) in ranges {
            if let Some([low, high]) = range.filter(|[low, high]| !(*low <= value && value <= *high)) {
                let what = format!("expected a range that holds {key}, {value}, found [{low}, {high}]");
                return Err(Error::input(item.place.key(&format!("{key}_range")), what));
            }
        }
        Ok(point)
    }
}

/// Words for a legend: a line, not empty, not too long for one.
fn words(item: &Item) -> Result<String> {
    let expected = "a line of 1 to 200 letters";
    let text = item.text(expected)?;
    let fits = (1..=200).contains(&text.chars().count()) && !text.chars().any(char::is_control);
    if fits { Ok(text.to_owned()) } else { Err(item.unexpected(expected)) }
}

fn positive(item: &Item) -> Result<f64> {
    item.f64("a number above 0", |x| x > 0.0)
}

fn range(item: &Item) -> Result<[f64; 2]> {
    let expected = "two numbers above 0, the smaller first";
    match item.items(expected)?.as_slice() {
        [low, high] => match [positive(low)?, positive(high)?] {
            [low, high] if low <= high => Ok([low, high]),
            _ => Err(item.unexpected(expected)),
        },
        _ => Err(item.unexpected(expected)),
    }
}

/// `YYYY-MM-DD`.
fn date(item: &Item) -> Result<String> {
    let expected = "a day such as \"2026-11-25\"";
    let text = item.text(expected)?;
    let parts: Vec<&str> = text.split('-').collect();
    let number = |part: &str, length: usize, most: u32| {
        part.len() == length
            && part.bytes().all(|b| b.is_ascii_digit())
            && part.parse().is_ok_and(|n: u32| (1..=most).contains(&n))
    };
    match parts.as_slice() {
        [year, month, day] if number(year, 4, 9999) && number(month, 2, 12) && number(day, 2, 31) => {
            Ok(text.to_owned())
        }
        _ => Err(item.unexpected(expected)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINT: &str = r#"{"name": "M 3 independent", "scene": "box", "size": "8x4", "spp": 64, "seconds": 0.5,
        "seconds_range": [0.4, 0.75], "rmse": 0.25, "machine": "a mill, 2 threads", "date": "2026-11-25"}"#;

    fn read(text: &str) -> Result<Peers> {
        let value = json::parse(text.as_bytes(), "peers.json")?;
        Peers::of(&Item::top(&value, "peers.json"), "peers.json")
    }

    #[test]
    fn points_read_and_what_is_recorded_reads_back_equal() {
        let peers = read(&format!("{{\"points\": [{POINT}], \"note\": \"n\"}}")).unwrap();
        let point = &peers.points[0];
        assert_eq!((point.seconds, point.seconds_range, point.rmse_range), (0.5, Some([0.4, 0.75]), None));
        let recorded = serde_json::to_string(&peers).unwrap();
        assert_eq!(serde_json::from_str::<Peers>(&recorded).unwrap(), peers);
    }

    #[test]
    fn bad_files_are_refused_with_their_place() {
        for (good, bad, what) in [
            ("\"points\"", "\"pionts\"", "expected the key \"points\", found none; did you mean \"pionts\"?"),
            (POINT, "", "points: expected a list of 1 to 1000 points"),
            ("\"M 3 independent\"", "\"\"", "points[0].name: expected a line of 1 to 200 letters"),
            ("\"8x4\"", "\"8\"", "points[0].size: expected a size"),
            ("64", "0", "points[0].spp: expected a whole number"),
            ("0.5,", "0,", "points[0].seconds: expected a number above 0"),
            ("0.25", "\"small\"", "points[0].rmse: expected a number above 0"),
            ("[0.4, 0.75]", "[0.4]", "seconds_range: expected two numbers above 0, the smaller first"),
            ("[0.4, 0.75]", "[0.6, 0.4]", "seconds_range: expected two numbers above 0, the smaller first"),
            ("[0.4, 0.75]", "[0.6, 0.75]", "seconds_range: expected a range that holds seconds, 0.5"),
            ("2026-11-25", "25.11.2026", "points[0].date: expected a day such as"),
            ("2026-11-25", "2026-13-25", "points[0].date: expected a day such as"),
            ("\"machine\": \"a mill, 2 threads\", ", "", "expected the key \"machine\""),
        ] {
            let whole = format!("{{\"points\": [{POINT}]}}");
            let text = whole.replacen(good, bad, 1);
            assert_ne!(text, whole, "{good}");
            let error = read(&text).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains(what), "{bad}: {error}");
        }
    }
}

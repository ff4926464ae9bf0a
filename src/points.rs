//! Point sets as files and as numbers: what `points` writes and `measure` reads and tells.

use std::path::Path;

use serde::Serialize;

use crate::error::{Error, Result};
use crate::stats::discrepancy::{L2Kind, STAR_COST_LIMIT, l2_squared, min_toroidal_distance, star, t_value};
use crate::stats::{Points, PointsError, Side};

/// Every metric of one point set: what `measure` tells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measurement {
    /// Sampler or file.
    pub source: String,
    /// What the sampler's name stands for, the count asked and the seed; absent for files.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sampler: Option<SamplerSource>,
    /// Number of points.
    pub n: usize,
    /// Number of coordinates.
    pub dimension: usize,
    /// Star discrepancy with the box that attains it.
    pub star: StarValue,
    /// The L2 kinds and diaphony, by name, in the order of the documentation.
    #[serde(flatten)]
    pub l2: L2Values,
    /// Smallest t for which the set is a (t, m, d)-net in base 2; null where n is no power of two or a coordinate is 1.
    pub t_value: Option<u32>,
    /// Smallest distance of two points on the torus; null for one point.
    pub min_toroidal_distance: Option<f64>,
}

/// Where the points of a sampler come from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SamplerSource {
    /// The whole name.
    pub expansion: String,
    /// Count asked for; `n` is the count taken.
    pub asked: u32,
    /// Seed of the randomisation.
    pub seed: u64,
}

/// Star discrepancy D*: the largest gap between counted and true measure of boxes at the origin.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StarValue {
    /// D*.
    pub value: f64,
    /// Always true: bounds are not given out as values.
    pub exact: bool,
    /// Upper corner of the box that attains it.
    pub corner: Vec<f64>,
    /// Whether the box is counted without (`open`) or with (`closed`) its upper faces.
    pub side: Side,
}

/// A root and its square; both null where rounding hides the value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Root {
    /// The discrepancy.
    pub value: Option<f64>,
    /// Its square, the quantity that sums are formed of.
    pub squared: Option<f64>,
}

/// Names and values in order.
#[derive(Debug, Clone, PartialEq)]
pub struct L2Values(pub Vec<(&'static str, Root)>);

impl Serialize for L2Values {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, root)| (name, root)))
    }
}

/// Measures a point set.
///
/// # Errors
/// Kind `Input` where the exact star discrepancy would cost more than about ten seconds, with the cost.
pub fn measure(source: &str, points: &Points) -> Result<Measurement> {
    let star = star(points, STAR_COST_LIMIT).map_err(|cost| Error::input(source, cost))?;
    let l2 = L2Kind::ALL.iter().map(|&kind| {
        let squared = l2_squared(points, kind);
        (kind.name(), Root { value: squared.map(f64::sqrt), squared })
    });
    Ok(Measurement {
        source: source.to_owned(),
        sampler: None,
        n: points.n(),
        dimension: points.dimension(),
        star: StarValue { value: star.value, exact: true, corner: star.corner, side: star.side },
        l2: L2Values(l2.collect()),
        t_value: t_value(points),
        min_toroidal_distance: min_toroidal_distance(points),
    })
}

impl Measurement {
    /// The same for people.
    pub fn to_text(&self) -> String {
        let corner: Vec<String> = self.star.corner.iter().map(|c| format!("{c:.9}")).collect();
        let side = if self.star.side == Side::Open { "open" } else { "closed" };
        let mut text = format!("{}: {} points in {} dimensions\n", self.source, self.n, self.dimension);
        text += &format!(
            "  {:<22} {:.12}  exact, at the {side} box with corner ({})\n",
            "star discrepancy",
            self.star.value,
            corner.join(", ")
        );
        for (name, root) in &self.l2.0 {
            text += &match (root.value, root.squared) {
                (Some(value), Some(squared)) => format!("  {name:<22} {value:.12}  squared {squared:.12e}\n"),
                _ => format!("  {name:<22} below the resolution of double precision\n"),
            };
        }
        let t = self.t_value.map_or("none: n is no power of two, or a coordinate is 1".to_owned(), |t| t.to_string());
        text += &format!("  {:<22} {t}\n", "t_value");
        let distance = self.min_toroidal_distance.map_or("none: one point".to_owned(), |d| format!("{d:.12}"));
        text + &format!("  {:<22} {distance}\n", "min_toroidal_distance")
    }
}

/// Points as CSV: header `x,y`, then a point a line in shortest digits that read back to the same number.
pub fn to_csv(points: &[[f64; 2]]) -> String {
    let mut text = "x,y\n".to_owned();
    for [x, y] in points {
        text += &format!("{x},{y}\n");
    }
    text
}

/// Reads points from CSV: commas, an optional header, `#` comments, blank lines skipped, one point a line.
///
/// # Errors
/// Kind `Input` with the line: a field that is no number, a ragged row, a coordinate outside [0, 1], no points at all.
pub fn read_csv(text: &str, source: &str) -> Result<Points> {
    let mut coordinates = Vec::new();
    let mut lines = Vec::new();
    let mut dimension = None;
    let mut header_allowed = true;
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let place = || format!("{source}: line {}", index + 1);
        let line = line.split('#').next().unwrap_or("").trim();
        if line.is_empty() {
            continue;
        }
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        let numbers: Vec<Option<f64>> = fields.iter().map(|f| f.parse().ok()).collect();
        // Words, none of which begins like a number: a first point that is misspelt is no header.
        let is_word = |f: &&str| f.chars().next().is_some_and(|c| !c.is_ascii_digit() && !"+-.".contains(c));
        let is_header = header_allowed && numbers.iter().all(Option::is_none) && fields.iter().all(is_word);
        header_allowed = false;
        let expected = *dimension.get_or_insert(fields.len());
        if fields.len() != expected {
            return Err(Error::input(place(), format!("expected {expected} coordinates, found {}", fields.len())));
        }
        if is_header {
            continue;
        }
        for (field, number) in fields.iter().zip(numbers) {
            match number {
                Some(x) if (0.0..=1.0).contains(&x) => coordinates.push(x),
                _ => return Err(Error::input(place(), format!("expected a number in [0, 1], found \"{field}\""))),
            }
        }
        lines.push(index + 1);
    }
    Points::new(dimension.unwrap_or(0), coordinates).map_err(|error| match error {
        PointsError::Outside { index, .. } => Error::input(format!("{source}: line {}", lines[index]), error),
        _ => Error::input(source, error),
    })
}

/// Reads a CSV file, see [`read_csv`].
///
/// # Errors
/// Kind `Input` where the file cannot be read, is no UTF-8 text, or as [`read_csv`].
pub fn read_csv_file(path: &Path) -> Result<Points> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|e| Error::input(&name, format!("expected a readable CSV file, found: {e}")))?;
    read_csv(&text, &name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Preset, SamplerSpec, point_set};

    #[test]
    fn what_is_written_reads_back_to_the_same_points() {
        let points = point_set(SamplerSpec::parse("halton", Preset::Sheet).unwrap(), 100, 0).unwrap();
        let back = read_csv(&to_csv(&points), "a.csv").unwrap();
        assert_eq!(back.iter().flatten().copied().collect::<Vec<_>>(), points.concat());
    }

    #[test]
    fn comments_headers_and_other_line_ends_are_read() {
        let text = "# three of them\r\nu, v\r\n0.5 , 0.25\r\n\r\n1,0 # a corner\r\n1e-1,.5\r\n";
        let points = read_csv(text, "a.csv").unwrap();
        assert_eq!((points.n(), points.dimension()), (3, 2));
        assert_eq!(read_csv("0.5\n0.25\n", "-").unwrap().dimension(), 1);
    }

    #[test]
    fn bad_sets_name_their_line() {
        for (text, needle) in [
            ("", "at least one point"),
            ("x,y\n", "at least one point"),
            ("x,y\n0.5,0.5\n0.5\n", "line 3: expected 2 coordinates, found 1"),
            ("0.1,0.2\n\n0.5,1.5\n", "line 3: expected a number in [0, 1], found \"1.5\""),
            ("nan,0.5\n", "line 1: expected a number in [0, 1], found \"nan\""),
            ("0.1,0.2\ninf,0.5\n", "line 2"),
            ("0.1,\n", "line 1"),
            ("0.1,abc\n", "line 1: expected a number in [0, 1], found \"abc\""),
            ("x,y\na,b\n", "line 2"),
            ("0.1 0.2\n", "line 1: expected a number in [0, 1], found \"0.1 0.2\""),
            ("0,1;0,5\n", "line 1: expected a number in [0, 1], found \"1;0\""),
        ] {
            let error = read_csv(text, "a.csv").unwrap_err();
            assert!(error.to_string().contains(needle), "{text:?}: {error}");
            assert_eq!(error.exit_code(), 2);
        }
    }

    /// `star_prefixes.json`: 64 Halton points have D* = 5/96, at a closed box.
    #[test]
    fn a_sampler_is_measured_at_full_precision() {
        let points = point_set(SamplerSpec::parse("halton:plain", Preset::Sheet).unwrap(), 64, 0).unwrap();
        let m = measure("halton:plain", &Points::new_2d(&points).unwrap()).unwrap();
        assert!((m.star.value - 5.0 / 96.0).abs() < 1e-14);
        let json = serde_json::to_value(&m).unwrap();
        assert_eq!(json["star"]["side"], "closed");
        assert!((json["l2_star"]["squared"].as_f64().unwrap() - 0.000_269_269_601_652_996_9).abs() < 1e-15);
    }
}

//! Means over tiles of replicate images, and tests of whether they agree.
//!
//! Single pixels of an edge are rarely anything but 0 or 1, and tests on them lie a hundred times more often than they
//! say. A tile's mean over tens of pixels is tested instead. A mean of few rare hits is no better: where not nearly every
//! replicate differs from the rest, tiles are pooled, and a pool in which still too little varies is left to the whole image.

use crate::film::Image;
use crate::stats::hypothesis::{holm, sidak, two_sided};
use crate::stats::{Moments, student_t_quantile};

/// Most tiles across and down.
pub const GRID: [u32; 2] = [8, 6];

/// The share of a place's replicates that have to differ from its most frequent value. Below it hits are so rare (2.3 a
/// replicate) that their number is too skewed for Student's t.
pub const LEAST_VARIED: f64 = 0.9;

/// How places are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    /// Differences up to this are no differences: what rounding may do.
    pub allowance: f64,
    /// Where replicates that all agree may still have missed something rare: what it may have added to the mean. 0 where
    /// they agree because nothing is random.
    pub unseen: f64,
    /// False-alarm rate of all places together.
    pub level: f64,
}

/// An image cut into at most [`GRID`] tiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tiling {
    size: [u32; 2],
    tile: [u32; 2],
}

impl Tiling {
    /// The tiling of an image of so many columns and rows.
    pub fn new(width: u32, height: u32) -> Self {
        Self { size: [width, height], tile: [width.div_ceil(GRID[0]), height.div_ceil(GRID[1])] }
    }

    /// Tiles across and down.
    pub fn shape(&self) -> [u32; 2] {
        [0, 1].map(|k| self.size[k].div_ceil(self.tile[k]))
    }

    /// Means over pixels and channels, tile by tile, and of the whole image at the end.
    pub fn means(&self, image: &Image) -> Vec<f64> {
        let [columns, rows] = self.shape();
        let mut sums = vec![(0.0, 0u32); (columns * rows) as usize + 1];
        for (at, pixel) in (0u32..).zip(&image.pixels) {
            let (x, y) = (at % image.width, at / image.width);
            let tile = (y / self.tile[1]) * columns + x / self.tile[0];
            let value = pixel.iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0;
            for place in [tile, columns * rows] {
                let (sum, count) = &mut sums[place as usize];
                *sum += value;
                *count += 1;
            }
        }
        sums.into_iter().map(|(sum, count)| sum / f64::from(count.max(1))).collect()
    }

    /// The name of a place in [`Self::means`].
    pub fn name(&self, place: usize) -> String {
        let [columns, rows] = self.shape();
        let place = place as u32;
        if place == columns * rows {
            return "the whole image".to_owned();
        }
        format!("tile ({}, {}) of {columns} × {rows}", place % columns, place / columns)
    }
}

/// Replicates by place: `series[place][replicate]`, as [`Tiling::means`] orders the places.
pub type Series = Vec<Vec<f64>>;

/// Turns means by replicate into replicates by place.
pub fn by_place(images: &[Vec<f64>]) -> Series {
    let places = images.first().map_or(0, Vec::len);
    (0..places).map(|place| images.iter().map(|means| means[place]).collect()).collect()
}

/// What is compared with the replicates.
pub enum Truth<'a> {
    /// Independent replicates of something unbiased.
    Replicates(&'a Series),
    /// Known numbers.
    Exact(&'a [f64]),
}

/// One place compared.
#[derive(Debug, Clone, PartialEq)]
pub struct Compared {
    /// Its name, or what was pooled.
    pub name: String,
    /// Mean of the replicates.
    pub mean: f64,
    /// Mean of what they are compared with.
    pub expected: f64,
    /// The statistic; `None` where nothing varies, or too little to be tested.
    pub t: Option<f64>,
    /// Two-sided p-value, not corrected; 0 or 1 where nothing varies, 1 where too little does.
    pub p: f64,
    /// The smallest difference that the family's test would catch with probability 0.99; 0 where there is no statistic.
    pub detects: f64,
}

/// All places compared, and the whole answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Each place, the whole image last.
    pub places: Vec<Compared>,
    /// The smallest p-value by Holm's correction.
    pub p: f64,
    /// Its place.
    pub worst: usize,
}

impl Comparison {
    /// The place with the smallest p-value.
    pub fn worst(&self) -> &Compared {
        &self.places[self.worst]
    }

    /// How many places differ at the level, by Holm.
    pub fn differing(&self, level: f64) -> usize {
        let p: Vec<f64> = self.places.iter().map(|place| place.p).collect();
        holm(&p).map_or(0, |adjusted| adjusted.iter().filter(|&&p| p < level).count())
    }
}

/// Are the expectations of replicates those of `truth`, place by place? Welch's test (Student's against known numbers) on
/// replicate means, corrected by Holm.
///
/// Places that do not vary enough ([`LEAST_VARIED`]) are pooled.
pub fn compare(tiling: &Tiling, found: &Series, truth: &Truth<'_>, rules: Rules) -> Comparison {
    let whole = found.len() - 1;
    let (mut alone, mut quiet) = (Vec::new(), Vec::new());
    for place in 0..whole {
        let calm = match truth {
            Truth::Replicates(truth) => is_testable(&found[place]) && is_testable(&truth[place]),
            Truth::Exact(_) => is_testable(&found[place]),
        };
        if calm { alone.push(vec![place]) } else { quiet.push(place) }
    }
    if !quiet.is_empty() {
        alone.push(quiet);
    }
    alone.push(vec![whole]);
    let rules = Rules { level: sidak(rules.level, alone.len() as u64), ..rules };
    let places: Vec<Compared> = alone
        .iter()
        .map(|members| {
            let name = match members.as_slice() {
                [one] => tiling.name(*one),
                many => format!("{} tiles pooled", many.len()),
            };
            one_place(name, members, found, truth, rules)
        })
        .collect();
    let p: Vec<f64> = places.iter().map(|place| place.p).collect();
    let adjusted = holm(&p).expect("p-values of our own");
    let worst = (0..p.len()).min_by(|&a, &b| p[a].total_cmp(&p[b])).expect("the whole image is a place");
    Comparison { places, p: adjusted[worst], worst }
}

/// Whether nearly all replicates differ, or none does: then they are a number.
fn is_testable(series: &[f64]) -> bool {
    let varied = varied(series);
    varied == 0 || varied as f64 >= LEAST_VARIED * series.len() as f64
}

/// How many values differ from the most frequent one.
fn varied(series: &[f64]) -> usize {
    let mut sorted = series.to_vec();
    sorted.sort_by(f64::total_cmp);
    let longest = sorted.chunk_by(|a, b| a == b).map(<[f64]>::len).max().unwrap_or(0);
    series.len() - longest
}

fn one_place(name: String, members: &[usize], found: &Series, truth: &Truth<'_>, rules: Rules) -> Compared {
    let pooled = |series: &Series| -> Vec<f64> {
        let count = members.len() as f64;
        (0..series[members[0]].len()).map(|r| members.iter().map(|&m| series[m][r]).sum::<f64>() / count).collect()
    };
    let ours = pooled(found);
    let mut testable = is_testable(&ours);
    let ours: Moments = ours.into_iter().collect();
    let (expected, theirs) = match truth {
        Truth::Replicates(truth) => {
            let theirs = pooled(truth);
            testable &= is_testable(&theirs);
            let moments: Moments = theirs.into_iter().collect();
            (moments.mean().unwrap_or(0.0), Some(moments))
        }
        Truth::Exact(values) => (members.iter().map(|&m| values[m]).sum::<f64>() / members.len() as f64, None),
    };
    let mean = ours.mean().unwrap_or(0.0);
    let errors =
        [Some(ours), theirs].map(|m| m.map_or((0.0, 1.0), |m| (m.standard_error().unwrap_or(0.0), m.n() as f64)));
    let error = libm::hypot(errors[0].0, errors[1].0);
    let difference = mean - expected;
    let slack = rules.allowance + if errors[0].0 == 0.0 { rules.unseen } else { 0.0 };
    let left = (difference.abs() - slack).max(0.0);
    if !testable {
        return Compared { name, mean, expected, t: None, p: 1.0, detects: 0.0 };
    }
    if error == 0.0 {
        return Compared { name, mean, expected, t: None, p: if left == 0.0 { 1.0 } else { 0.0 }, detects: 0.0 };
    }
    // Welch and Satterthwaite; a side without spread has no part in it.
    let share = |(e, n): (f64, f64)| {
        let share = (e / error) * (e / error);
        if share == 0.0 { 0.0 } else { share * share / (n - 1.0) }
    };
    let df = 1.0 / (share(errors[0]) + share(errors[1]));
    let t = (left / error).copysign(difference);
    let critical = student_t_quantile(1.0 - 0.5 * rules.level, df);
    // For levels below 10⁻¹⁶ the quantile's argument is 1 and it is infinite; no test of ours is at such a level.
    let detects = (critical + student_t_quantile(0.99, df)) * error + slack;
    Compared { name, mean, expected, t: Some(t), p: two_sided(t, df), detects }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::hash::bits64;

    fn uniform(seed: u64, at: u64) -> f64 {
        (bits64(seed, at) >> 11) as f64 * 0.5f64.powi(53)
    }

    fn series(seed: u64, places: u64, replicates: u64, value: impl Fn(u64, f64) -> f64) -> Series {
        (0..places)
            .map(|place| (0..replicates).map(|r| value(place, uniform(seed, (place << 32) | r))).collect())
            .collect()
    }

    #[test]
    fn tiles_cover_the_image_and_the_whole_is_last() {
        let mut image = Image::black(10, 7);
        image.pixels[9] = [3.0; 3];
        let tiling = Tiling::new(10, 7);
        assert_eq!(tiling.shape(), [5, 4]);
        let means = tiling.means(&image);
        assert_eq!((means.len(), means[4], means[20]), (21, 0.75, 3.0 / 70.0));
        assert_eq!((tiling.name(4).as_str(), tiling.name(20).as_str()), ("tile (4, 0) of 5 × 4", "the whole image"));
        assert_eq!(Tiling::new(1, 1).shape(), [1, 1]);
    }

    #[test]
    fn a_bias_in_one_tile_is_named_and_a_tile_of_rare_hits_is_pooled() {
        let tiling = Tiling::new(4, 1);
        let truth = series(1, 5, 64, |_, u| u);
        let same = series(2, 5, 64, |_, u| u);
        let level = 1e-3;
        let rules = Rules { allowance: 0.0, unseen: 0.0, level };
        let compared = compare(&tiling, &same, &Truth::Replicates(&truth), rules);
        assert!(compared.p > level && compared.places.len() == 5, "{compared:?}");
        let biased = series(2, 5, 64, |place, u| if place == 2 { u + 0.5 } else { u });
        let compared = compare(&tiling, &biased, &Truth::Replicates(&truth), rules);
        assert!(compared.p < level && compared.worst().name == "tile (2, 0) of 4 × 1", "{compared:?}");
        assert!(compared.worst().detects < 0.5 && compared.differing(level) == 1);
        // Known numbers, an allowance, and tiles in which almost nothing happens.
        let rare = series(3, 5, 64, |place, u| if place < 2 { f64::from(u8::from(u < 0.03)) } else { u });
        let compared = compare(&tiling, &rare, &Truth::Exact(&[0.03, 0.03, 0.5, 0.5, 0.5]), rules);
        assert!(compared.places.iter().any(|p| p.name == "2 tiles pooled") && compared.p > level, "{compared:?}");
        let constant = series(4, 5, 64, |_, _| 0.25);
        let compared = compare(&tiling, &constant, &Truth::Exact(&[0.25, 0.25, 0.2501, 0.25, 0.25]), rules);
        assert!(compared.p == 0.0 && compared.worst().name.contains("(2, 0)"), "{compared:?}");
        // None of 64 replicates met what would add 10⁻⁴ to the mean: no evidence, as it may be rare.
        let missed = Rules { unseen: 1e-3, ..rules };
        assert_eq!(compare(&tiling, &constant, &Truth::Exact(&[0.2501; 5]), missed).p, 1.0);
        assert_eq!(compare(&tiling, &constant, &Truth::Exact(&[0.2501; 5]), Rules { allowance: 1e-3, ..rules }).p, 1.0);
    }
}

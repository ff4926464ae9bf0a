//! Means over tiles of replicate images, and tests of whether they agree.
//!
//! Single pixels of an edge are rarely anything but 0 or 1, and tests on them lie a hundred times more often than they
//! say. A tile's mean over tens of pixels is tested instead. A mean of few rare hits is no better: a set that met too few of
//! them is too low *and* has too small a spread, and no statistic of its own tells. What rare hits may hide is bounded
//! instead: see [`Rare`].

use crate::film::Image;
use crate::stats::hypothesis::{holm, sidak, two_sided};
use crate::stats::{Moments, student_t_quantile};

/// Most tiles across and down.
pub const GRID: [u32; 2] = [8, 6];

/// How places are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    /// Differences up to this are no differences: what rounding may do.
    pub allowance: f64,
    /// What rare events may hide.
    pub rare: Rare,
    /// False-alarm rate of all places together.
    pub level: f64,
}

/// How bright a single sample may be, and how many there are.
///
/// Of N samples some k meet something rare that adds up to B each. k is Poisson's, and the spread that a t test sees comes from the k
/// that were met: where too few were, mean and spread are too low together. With probability 1 − δ, k falls short of its
/// expectation by at most √(2 ln(2/δ)) √k + ln(2/δ) (tested below against Poisson's own tails). The first term is what a
/// t test allows for; B ln(2/δ)/N is what the rare and bright may hide from it, and is taken off every difference. With k = 0 it
/// is the rule of three. (A bound for any distribution has 7/3 as its factor: Maurer & Pontil 2009, arXiv:0907.3740, theorem 4.)
/// Samples of a net are not independent, but the numbers of rare hits in them vary no more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rare {
    /// B: the range of a single sample's value, in the unit of the means.
    pub range: f64,
    /// Samples behind each pixel's mean over all replicates, of what is tested and of what it is compared with; infinite where
    /// nothing is random.
    pub samples: [f64; 2],
}

impl Rare {
    /// Nothing rare happens: replicates are as good as normal.
    pub const NOTHING: Self = Self { range: 0.0, samples: [f64::INFINITY; 2] };

    /// The second term of the bound, of both sides together, for a mean over `pixels` pixels.
    fn hidden(&self, pixels: f64, delta: f64) -> f64 {
        let term = self.range * libm::log(2.0 / delta);
        self.samples.iter().map(|n| term / (n * pixels)).sum()
    }
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

    /// How many pixels a place in [`Self::means`] has.
    pub fn pixels(&self, place: usize) -> f64 {
        let [columns, rows] = self.shape();
        let place = place as u32;
        let extent = |k: usize, at: u32| f64::from((self.size[k] - at * self.tile[k]).min(self.tile[k]));
        if place == columns * rows {
            return f64::from(self.size[0]) * f64::from(self.size[1]);
        }
        extent(0, place % columns) * extent(1, place / columns)
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
    /// Its name.
    pub name: String,
    /// Mean of the replicates.
    pub mean: f64,
    /// Mean of what they are compared with.
    pub expected: f64,
    /// The statistic; `None` where nothing varies.
    pub t: Option<f64>,
    /// Two-sided p-value, not corrected; 0 or 1 where nothing varies.
    pub p: f64,
    /// The smallest difference that the family's test would catch with probability 0.99.
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
/// replicate means, less what [`Rare`] events may hide, corrected by Holm.
pub fn compare(tiling: &Tiling, found: &Series, truth: &Truth<'_>, rules: Rules) -> Comparison {
    let level = sidak(rules.level, found.len() as u64);
    let places: Vec<Compared> =
        (0..found.len()).map(|place| one_place(tiling, place, found, truth, Rules { level, ..rules })).collect();
    let p: Vec<f64> = places.iter().map(|place| place.p).collect();
    let adjusted = holm(&p).expect("p-values of our own");
    // Of equal p-values (1, mostly) the one that came nearest to being caught.
    let near = |place: &Compared| (place.mean - place.expected).abs() / place.detects.max(f64::MIN_POSITIVE);
    let order = |&a: &usize, &b: &usize| p[a].total_cmp(&p[b]).then(near(&places[b]).total_cmp(&near(&places[a])));
    let worst = (0..p.len()).min_by(order).expect("the whole image is a place");
    Comparison { places, p: adjusted[worst], worst }
}

/// `rules.level` is that of this place alone.
fn one_place(tiling: &Tiling, place: usize, found: &Series, truth: &Truth<'_>, rules: Rules) -> Compared {
    let name = tiling.name(place);
    let ours: Moments = found[place].iter().copied().collect();
    let (expected, theirs) = match truth {
        Truth::Replicates(truth) => {
            let moments: Moments = truth[place].iter().copied().collect();
            (moments.mean().unwrap_or(0.0), Some(moments))
        }
        Truth::Exact(values) => (values[place], None),
    };
    let mean = ours.mean().unwrap_or(0.0);
    let errors =
        [Some(ours), theirs].map(|m| m.map_or((0.0, 1.0), |m| (m.standard_error().unwrap_or(0.0), m.n() as f64)));
    let error = libm::hypot(errors[0].0, errors[1].0);
    let difference = mean - expected;
    let slack = rules.allowance + rules.rare.hidden(tiling.pixels(place), rules.level);
    let left = (difference.abs() - slack).max(0.0);
    if error == 0.0 {
        return Compared { name, mean, expected, t: None, p: if left == 0.0 { 1.0 } else { 0.0 }, detects: slack };
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
    fn places_have_the_pixels_of_their_tiles() {
        let tiling = Tiling::new(10, 7);
        let pixels: Vec<f64> = (0..=20).map(|place| tiling.pixels(place)).collect();
        assert_eq!(pixels[..20].iter().sum::<f64>(), 70.0);
        assert_eq!((pixels[0], pixels[15], pixels[20]), (4.0, 2.0, 70.0));
    }

    #[test]
    fn a_bias_in_one_tile_is_named() {
        let tiling = Tiling::new(4, 1);
        let truth = series(1, 5, 64, |_, u| u);
        let same = series(2, 5, 64, |_, u| u);
        let level = 1e-3;
        let rules = Rules { allowance: 0.0, rare: Rare::NOTHING, level };
        let compared = compare(&tiling, &same, &Truth::Replicates(&truth), rules);
        assert!(compared.p > level && compared.places.len() == 5, "{compared:?}");
        let biased = series(2, 5, 64, |place, u| if place == 2 { u + 0.5 } else { u });
        let compared = compare(&tiling, &biased, &Truth::Replicates(&truth), rules);
        assert!(compared.p < level && compared.worst().name == "tile (2, 0) of 4 × 1", "{compared:?}");
        assert!(compared.worst().detects < 0.5 && compared.differing(level) == 1);
        let constant = series(4, 5, 64, |_, _| 0.25);
        let compared = compare(&tiling, &constant, &Truth::Exact(&[0.25, 0.25, 0.2501, 0.25, 0.25]), rules);
        assert!(compared.p == 0.0 && compared.worst().name.contains("(2, 0)"), "{compared:?}");
        assert_eq!(compare(&tiling, &constant, &Truth::Exact(&[0.2501; 5]), Rules { allowance: 1e-3, ..rules }).p, 1.0);
    }

    /// The claim of [`Rare`]: for every expected number of rare hits, the chance of so few that k + √(2 ln(2/δ)) √k + ln(2/δ) is below it is δ/2
    /// at most (the other half is for too many).
    #[test]
    fn poissons_numbers_fall_short_no_further_than_stated() {
        for delta in [1e-2f64, 1e-4, 1e-6, 1e-9, 1e-12] {
            let log = libm::log(2.0 / delta);
            for step in 1..4000 {
                let expected = f64::from(step) * 0.1;
                // P(K ≤ k), term by term, while k is among those that claim too little.
                let (mut term, mut chance, mut k) = (libm::exp(-expected), 0.0, 0.0);
                while k + (2.0 * log * k).sqrt() + log < expected {
                    chance += term;
                    k += 1.0;
                    term *= expected / k;
                }
                assert!(chance <= 0.5 * delta, "{expected} expected, δ = {delta}: {chance:e}");
            }
        }
    }

    /// None of 64 replicates of one sample met what would add 0.01 to the mean: no evidence against something rare; of a million samples
    /// it is.
    #[test]
    fn what_was_not_seen_may_be_rare() {
        let tiling = Tiling::new(4, 1);
        let dark = series(4, 5, 64, |_, _| 0.0);
        let with = |samples: f64| {
            let rare = Rare { range: 1.0, samples: [samples, f64::INFINITY] };
            compare(&tiling, &dark, &Truth::Exact(&[0.01; 5]), Rules { allowance: 0.0, rare, level: 1e-6 }).p
        };
        assert_eq!((with(64.0), with(1e6)), (1.0, 0.0));
    }
}

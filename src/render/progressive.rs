//! Pictures that grow: sums over the first samples of every pixel, to which passes add the next ones.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rayon::prelude::*;

use crate::accel::{LANES, Wide, column};
use crate::film::Image;
use crate::sampling::PointSource;
use crate::scene::compile::Scene;
use crate::scene::light::luma;

use super::lanes::{Lanes, Span};
use super::tiles::NonFinite;

/// Rows of a band, and columns of a tile in it: what is traced between two questions whether to go on.
const TILE: usize = 8;

/// What a pixel has gathered.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Gathered {
    /// Sum of the radiances, in the order of the indices.
    sum: [f64; 3],
    /// Sum of their lumas' squares.
    luma_squared: f64,
}

/// A picture between its first sample and its last.
///
/// Once the samples `0..n` of every pixel have been added, by whatever passes, [`Growing::image`] has the bits of
/// [`render`](super::render) with the same scene and source: a pixel's sum is formed in the order of the indices.
///
/// A pass that is told to stop loses nothing: the tiles that it came to are ahead of the others, and the next pass goes on from there.
#[derive(Debug, Clone, PartialEq)]
pub struct Growing {
    width: u32,
    height: u32,
    pixels: Vec<Gathered>,
    /// Samples that the pixels of each tile have, row by row of tiles; a pass that was told to stop leaves some ahead.
    tiles: Vec<u32>,
    /// Samples that every pixel has: the least of `tiles`.
    done: u32,
    /// Where no pixel is complete yet: the sides of blocks whose first pixel, top left, has its first sample; 0 for none.
    block: u32,
}

/// What a pass came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pass {
    /// Samples of pixels that were traced.
    pub samples: u64,
    /// Camera and shadow rays.
    pub rays: u64,
    /// Whether everything asked for is there; else it was told to stop, and the next pass goes on from there.
    pub is_whole: bool,
}

impl Growing {
    /// A picture without samples, of `size` (columns, rows).
    pub fn new(size: (u32, u32)) -> Self {
        let (width, height) = size;
        let pixels = vec![Gathered::default(); width as usize * height as usize];
        let tiles = vec![0; (width as usize).div_ceil(TILE) * (height as usize).div_ceil(TILE)];
        Self { width, height, pixels, tiles, done: 0, block: 0 }
    }

    /// Begins anew, with memory kept where the size stays: a pixel's first sample takes the place of what it had.
    pub fn clear(&mut self, size: (u32, u32)) {
        if size == (self.width, self.height) {
            self.tiles.fill(0);
            (self.done, self.block) = (0, 0);
        } else {
            *self = Self::new(size);
        }
    }

    /// Columns and rows.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Samples that every pixel has.
    pub fn samples(&self) -> u32 {
        self.done
    }

    /// The side of the blocks of which one pixel is known: 1 where all are, `None` where none is.
    pub fn block(&self) -> Option<u32> {
        match (self.done, self.block) {
            (0, 0) => None,
            (0, block) => Some(block),
            _ => Some(1),
        }
    }

    /// Adds the first sample to the first pixel, top left, of each block of `block` × `block` that does not have it yet. Blocks
    /// halve from pass to pass, or start at any size; with `block` 1 every pixel has its first sample.
    ///
    /// `go_on` is asked after each few pixels, from several threads. Where it says no, the blocks are those of before, and of the new
    /// pixels those of whole tiles are kept with `block` 1, none else.
    ///
    /// # Errors
    /// A sample whose radiance is not finite; the picture has none again.
    ///
    /// # Panics
    /// Where every pixel has its sample, or `block` is no proper divisor of the blocks so far.
    pub fn begin<S: PointSource>(
        &mut self,
        scene: &Scene,
        source: &S,
        block: u32,
        go_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Pass, NonFinite> {
        let known = self.block;
        assert!(self.done == 0 && block > 0 && block != known && known.is_multiple_of(block), "{block} after {known}");
        let on = |p: u32, side: u32| side > 0 && p.is_multiple_of(side);
        let wanted = |x: u32, y: u32| on(x, block) && on(y, block) && !(on(x, known) && on(y, known));
        // Pixels that are known are not wanted, and stay as they are whatever becomes of the pass.
        let pass = self.pass(scene, source, 1, &wanted, go_on)?;
        if pass.is_whole {
            (self.done, self.block) = if block == 1 { (1, 0) } else { (0, block) };
        }
        if block > 1 {
            // A count is of all pixels of a tile.
            self.tiles.fill(0);
        }
        Ok(pass)
    }

    /// Adds the samples up to, and without, `to` to every pixel that does not have them yet.
    ///
    /// # Errors
    /// As [`Growing::begin`].
    ///
    /// # Panics
    /// Where `to` is not above the samples so far or above the source's, or blocks are unfinished: [`Growing::begin`] ends with 1.
    pub fn add<S: PointSource>(
        &mut self,
        scene: &Scene,
        source: &S,
        to: u32,
        go_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Pass, NonFinite> {
        assert!(self.block == 0 && to > self.done && to <= source.samples(), "samples {}..{to}", self.done);
        let pass = self.pass(scene, source, to, &|_, _| true, go_on)?;
        self.done = self.tiles.iter().copied().min().unwrap_or(to);
        Ok(pass)
    }

    /// Takes the wanted pixels of every tile to `to` samples.
    fn pass<S: PointSource>(
        &mut self,
        scene: &Scene,
        source: &S,
        to: u32,
        wanted: &(dyn Fn(u32, u32) -> bool + Sync),
        go_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Pass, NonFinite> {
        assert_eq!(scene.camera.size(), self.size(), "the scene is for pictures of another size");
        let width = self.width as usize;
        let stopped = AtomicBool::new(false);
        let (traced, rays) = (AtomicU64::new(0), AtomicU64::new(0));
        let first_bad: Mutex<Option<NonFinite>> = Mutex::new(None);
        let bands = self.pixels.par_chunks_mut(width * TILE).zip(self.tiles.par_chunks_mut(width.div_ceil(TILE)));
        bands.enumerate().for_each_init(Lanes::default, |lanes, (band, (pixels, tiles))| {
            let y0 = band * TILE;
            let rows = pixels.len() / width;
            for (x0, tile) in (0..width).step_by(TILE).zip(tiles) {
                if stopped.load(Ordering::Relaxed) {
                    return;
                }
                if *tile >= to {
                    continue;
                }
                let columns = x0..(x0 + TILE).min(width);
                let places = (0..rows).flat_map(|y| columns.clone().map(move |x| (x as u32, (y0 + y) as u32)));
                let places: Vec<(u32, u32)> = places.filter(|&(x, y)| wanted(x, y)).collect();
                let (samples, band) = (*tile..to, Band { pixels, width, y0 });
                traced.fetch_add(places.len() as u64 * u64::from(to - *tile), Ordering::Relaxed);
                match scene.accel.kernel().run(Tile { scene, source, places: &places, samples, band, lanes }) {
                    Ok(shot) => {
                        *tile = to;
                        rays.fetch_add(shot, Ordering::Relaxed);
                    }
                    Err(bad) => {
                        stopped.store(true, Ordering::Relaxed);
                        first_bad.lock().expect("nobody panics with it").get_or_insert(bad);
                    }
                }
                if !go_on() {
                    stopped.store(true, Ordering::Relaxed);
                }
            }
        });
        if let Some(bad) = first_bad.into_inner().expect("nobody panics with it") {
            self.clear(self.size());
            return Err(bad);
        }
        let is_whole = self.tiles.iter().all(|&tile| tile >= to);
        Ok(Pass { samples: traced.into_inner(), rays: rays.into_inner(), is_whole })
    }

    /// The mean radiance of a pixel so far; of one that has no sample, that of its block.
    pub fn mean(&self, x: u32, y: u32) -> [f32; 3] {
        let side = self.block().unwrap_or(1);
        let at = (y - y % side) as usize * self.width as usize + (x - x % side) as usize;
        let count = f64::from(self.samples_of(x, y).max(1));
        self.pixels[at].sum.map(|s| (s / count) as f32)
    }

    /// Samples that a pixel has: [`Growing::samples`], or more where a pass was told to stop behind it.
    fn samples_of(&self, x: u32, y: u32) -> u32 {
        self.tiles[y as usize / TILE * (self.width as usize).div_ceil(TILE) + x as usize / TILE]
    }

    /// The picture so far at one pixel a block: its size is that of the picture divided by [`Growing::block`], rounded up.
    pub fn preview(&self) -> Image {
        let side = self.block().unwrap_or(1);
        let (width, height) = (self.width.div_ceil(side), self.height.div_ceil(side));
        let mut image = Image::black(width, height);
        image.pixels.par_chunks_mut(width as usize).enumerate().for_each(|(row, pixels)| {
            for (column, pixel) in pixels.iter_mut().enumerate() {
                *pixel = self.mean(column as u32 * side, row as u32 * side);
            }
        });
        image
    }

    /// The picture in full size.
    pub fn image(&self) -> Image {
        let mut image = Image::black(self.width, self.height);
        image.pixels.par_chunks_mut(self.width as usize).enumerate().for_each(|(row, pixels)| {
            for (column, pixel) in pixels.iter_mut().enumerate() {
                *pixel = self.mean(column as u32, row as u32);
            }
        });
        image
    }

    /// Unbiased variance of the lumas of a pixel's samples, squared radiance; `None` below two samples.
    ///
    /// Divided by the number of samples it is the squared standard error of the pixel's mean *if the samples were independent*:
    /// those of a good set are not, and their mean errs less.
    pub fn luma_variance(&self, x: u32, y: u32) -> Option<f64> {
        let pixel = &self.pixels[y as usize * self.width as usize + x as usize];
        let n = f64::from(self.samples_of(x, y));
        let [r, g, b] = pixel.sum;
        let sum = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        (self.done > 1).then(|| ((pixel.luma_squared - sum * sum / n) / (n - 1.0)).max(0.0))
    }
}

/// Rows of the picture that one thread writes.
struct Band<'a> {
    pixels: &'a mut [Gathered],
    width: usize,
    /// The first row.
    y0: usize,
}

/// Some pixels and samples to trace: compiled for each vector width.
struct Tile<'a, S> {
    scene: &'a Scene,
    source: &'a S,
    places: &'a [(u32, u32)],
    samples: std::ops::Range<u32>,
    band: Band<'a>,
    lanes: &'a mut Lanes,
}

impl<S: PointSource> Wide for Tile<'_, S> {
    /// Rays traced.
    type Output = Result<u64, NonFinite>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { scene, source, places, samples, band, lanes } = self;
        let mut spans: Vec<Span> = Vec::with_capacity(LANES);
        lanes.ray_count = 0;
        // Samples are numbered through the tile, pixel by pixel; each packet takes the next ones.
        let (mut pixel, mut first) = (0, samples.start);
        while pixel < places.len() {
            spans.clear();
            let mut lane = 0;
            while lane < LANES && pixel < places.len() {
                let (x, y) = places[pixel];
                let count = (LANES - lane).min((samples.end - first) as usize);
                spans.push(Span { pixel, x, y, first, lane, count });
                lane += count;
                first += count as u32;
                if first == samples.end {
                    (pixel, first) = (pixel + 1, samples.start);
                }
            }
            lanes.sample(scene, source, &spans);
            for span in &spans {
                let gathered = &mut band.pixels[(span.y as usize - band.y0) * band.width + span.x as usize];
                for (index, lane) in (span.first..).zip(span.lane..span.lane + span.count) {
                    let radiance = column(&lanes.radiance, lane);
                    if !radiance.is_finite() {
                        return Err(NonFinite { x: span.x, y: span.y, index, radiance });
                    }
                    if index == 0 {
                        *gathered = Gathered::default();
                    }
                    for (sum, c) in gathered.sum.iter_mut().zip(radiance.to_array()) {
                        *sum += f64::from(c);
                    }
                    let luma = f64::from(luma(radiance));
                    gathered.luma_squared += luma * luma;
                }
            }
        }
        Ok(lanes.ray_count)
    }
}

//! Pixels over threads: spans of consecutive samples fill packets of rays; each tile writes only its own pixels.

#![allow(clippy::needless_range_loop, reason = "a lane is a column of several rows at once")]

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec3;
use rayon::prelude::*;

use crate::accel::{LANES, Row, Wide, column};
use crate::film::Image;
use crate::mutants::{Mutant, planted};
use crate::sampling::PointSource;
use crate::scene::compile::Scene;

use super::lanes::{Lanes, Span};

/// Side of a tile in pixels.
pub(super) const TILE: u32 = 8;

/// A finished image and what it took.
#[derive(Debug, Clone, PartialEq)]
pub struct Rendered {
    /// Means over each pixel's samples.
    pub image: Image,
    /// Camera and shadow rays.
    pub rays: u64,
}

/// A sample that is not a finite number: the image ends here, nothing is clamped or mended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NonFinite {
    /// Column from the left.
    pub x: u32,
    /// Row from the top.
    pub y: u32,
    /// Sample index.
    pub index: u32,
    /// What was found.
    pub radiance: Vec3,
}

impl std::fmt::Display for NonFinite {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { x, y, index, radiance } = self;
        write!(f, "pixel ({x}, {y}), sample {index}: expected a finite radiance, found {radiance}")
    }
}

/// Renders the scene with the numbers of `source`. The same scene and numbers give the same bits on any number of threads.
///
/// # Errors
/// The first sample, in the order of pixels and indices, whose radiance is not finite.
pub fn render<S: PointSource>(scene: &Scene, source: &S) -> Result<Rendered, NonFinite> {
    render_observed(scene, source, &|_| ())
}

/// As [`render`], telling `finished` after each tile how many more samples are done.
///
/// # Errors
/// As [`render`].
pub fn render_observed<S: PointSource>(
    scene: &Scene,
    source: &S,
    finished: &(dyn Fn(u64) + Sync),
) -> Result<Rendered, NonFinite> {
    let go_on = |samples| {
        finished(samples);
        true
    };
    render_while(scene, source, &go_on).map(|rendered| rendered.expect("nobody stops it"))
}

/// As [`render`], asking `go_on` after each tile, with the number of samples done in it, whether to go on. Once the answer
/// is no, no other tile begins and there is no image: `None`.
///
/// # Errors
/// As [`render`].
pub fn render_while<S: PointSource>(
    scene: &Scene,
    source: &S,
    go_on: &(dyn Fn(u64) -> bool + Sync),
) -> Result<Option<Rendered>, NonFinite> {
    let stopped = AtomicBool::new(false);
    let (width, height) = scene.camera.size();
    let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
    let tiles: Option<Vec<Result<TileResult, NonFinite>>> = (0..columns * rows)
        .into_par_iter()
        .map_init(Lanes::default, |lanes, t| {
            if stopped.load(Ordering::Relaxed) {
                return None;
            }
            let (x0, y0) = ((t % columns) * TILE, (t / columns) * TILE);
            let pixels: Vec<(u32, u32)> =
                (y0..(y0 + TILE).min(height)).flat_map(|y| (x0..(x0 + TILE).min(width)).map(move |x| (x, y))).collect();
            let tile = scene.accel.kernel().run(Tile { scene, source, pixels: &pixels, lanes });
            if !go_on(pixels.len() as u64 * u64::from(source.samples())) {
                stopped.store(true, Ordering::Relaxed);
            }
            Some(tile)
        })
        .collect();
    let Some(tiles) = tiles else { return Ok(None) };
    let mut image = Image::black(width, height);
    let mut rays = 0;
    let mut first_bad: Option<NonFinite> = None;
    for tile in tiles {
        match tile {
            Ok(tile) => {
                rays += tile.rays;
                for ((x, y), radiance) in tile.pixels {
                    image.pixels[y as usize * width as usize + x as usize] = radiance;
                }
            }
            Err(bad) => {
                let order = |b: &NonFinite| (b.y, b.x, b.index);
                if first_bad.as_ref().is_none_or(|f| order(&bad) < order(f)) {
                    first_bad = Some(bad);
                }
            }
        }
    }
    first_bad.map_or(Ok(Some(Rendered { image, rays })), Err)
}

/// Traces one sample alone: what [`render`] adds to pixel (x, y) for `index`.
pub fn render_sample<S: PointSource>(scene: &Scene, source: &S, x: u32, y: u32, index: u32) -> Vec3 {
    let mut lanes = Lanes::default();
    lanes.sample(scene, source, &[Span { pixel: 0, x, y, first: index, lane: 0, count: 1 }]);
    column(&lanes.radiance, 0)
}

struct TileResult {
    pixels: Vec<((u32, u32), [f32; 3])>,
    rays: u64,
}

/// Some pixels to render: compiled for each vector width.
struct Tile<'a, S> {
    scene: &'a Scene,
    source: &'a S,
    pixels: &'a [(u32, u32)],
    lanes: &'a mut Lanes,
}

impl<S: PointSource> Wide for Tile<'_, S> {
    type Output = Result<TileResult, NonFinite>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { scene, source, pixels, lanes } = self;
        let samples = source.samples();
        let mut sums = vec![[0.0f64; 3]; pixels.len()];
        let mut spans: Vec<Span> = Vec::with_capacity(LANES);
        lanes.ray_count = 0;
        // Samples are numbered through the tile, pixel by pixel; each packet takes the next ones.
        let (mut pixel, mut first) = (0, 0);
        while pixel < pixels.len() {
            spans.clear();
            let mut lane = 0;
            while lane < LANES && pixel < pixels.len() {
                let (x, y) = pixels[pixel];
                let count = (LANES - lane).min((samples - first) as usize);
                spans.push(Span { pixel, x, y, first, lane, count });
                lane += count;
                first += count as u32;
                if first == samples {
                    (pixel, first) = (pixel + 1, 0);
                }
            }
            lanes.sample(scene, source, &spans);
            add(&lanes.radiance, &spans, &mut sums)?;
        }
        let count = if planted(Mutant::MeanOverOneMore) { samples + 1 } else { samples };
        let mean = |sum: &[f64; 3]| sum.map(|s| (s / f64::from(count)) as f32);
        Ok(TileResult { pixels: pixels.iter().copied().zip(sums.iter().map(mean)).collect(), rays: lanes.ray_count })
    }
}

/// Adds the samples of `spans` to their pixels' sums, in the order of the indices.
#[inline(always)]
fn add(radiance: &[Row; 3], spans: &[Span], sums: &mut [[f64; 3]]) -> Result<(), NonFinite> {
    // Magnitudes are in the order of their bits, what is no finite number above all others.
    let mut largest = 0;
    let mut wide = [[0.0f64; LANES]; 3];
    for (row, wide) in radiance.iter().zip(&mut wide) {
        for lane in 0..LANES {
            largest = largest.max(row[lane].to_bits() & 0x7fff_ffff);
            wide[lane] = f64::from(row[lane]);
        }
    }
    if largest == 0 {
        return Ok(());
    }
    if largest >= f32::INFINITY.to_bits() {
        spans.iter().try_for_each(|span| check(radiance, span))?;
    }
    for span in spans {
        let sum = &mut sums[span.pixel];
        if span.count == LANES {
            add_lanes(sum, &wide, 0..LANES);
        } else {
            add_lanes(sum, &wide, span.lane..span.lane + span.count);
        }
    }
    Ok(())
}

/// Adds samples to a sum, one after the other.
#[inline(always)]
fn add_lanes(sum: &mut [f64; 3], radiance: &[[f64; LANES]; 3], lanes: Range<usize>) {
    let mut so_far = *sum;
    for lane in lanes {
        for (sum, row) in so_far.iter_mut().zip(radiance) {
            *sum += row[lane];
        }
    }
    *sum = so_far;
}

/// Whether a span's samples are finite.
#[cold]
fn check(radiance: &[Row; 3], span: &Span) -> Result<(), NonFinite> {
    for (index, lane) in (span.first..).zip(span.lane..span.lane + span.count) {
        let radiance = column(radiance, lane);
        if !radiance.is_finite() {
            return Err(NonFinite { x: span.x, y: span.y, index, radiance });
        }
    }
    Ok(())
}

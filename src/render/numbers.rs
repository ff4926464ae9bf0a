//! The numbers of an image without the image: what its sampling costs.

use std::hint::black_box;

use rayon::prelude::*;

use crate::accel::{LANES, Wide};
use crate::sampling::PointSource;
use crate::scene::compile::Scene;

use super::lanes::{Lanes, Span};
use super::tiles::TILE;

/// Draws every number that [`render`](super::render) would read, in the same tiles, spans and vector width, and does nothing
/// with them: the time of this over the time of the image is the share of sampling. Tracing hides a part of it by working on
/// other things meanwhile, so the share is an upper bound of what a sampler that costs nothing would save.
pub fn draw_numbers<S: PointSource>(scene: &Scene, source: &S) {
    let (width, height) = scene.camera.size();
    let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
    (0..columns * rows).into_par_iter().for_each_init(Lanes::default, |lanes, t| {
        let (x0, y0) = ((t % columns) * TILE, (t / columns) * TILE);
        let corner = ((x0 + TILE).min(width), (y0 + TILE).min(height));
        scene.accel.kernel().run(Numbers { scene, source, from: (x0, y0), to: corner, lanes });
    });
}

/// The numbers of some pixels: compiled for each vector width.
struct Numbers<'a, S> {
    scene: &'a Scene,
    source: &'a S,
    from: (u32, u32),
    to: (u32, u32),
    lanes: &'a mut Lanes,
}

impl<S: PointSource> Wide for Numbers<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { scene, source, from, to, lanes } = self;
        let mut spans: Vec<Span> = Vec::with_capacity(LANES);
        let mut lane = 0;
        for (y, x) in (from.1..to.1).flat_map(|y| (from.0..to.0).map(move |x| (y, x))) {
            let mut first = 0;
            while first < source.samples() {
                let count = (LANES - lane).min((source.samples() - first) as usize);
                spans.push(Span { pixel: 0, x, y, first, lane, count });
                (lane, first) = (lane + count, first + count as u32);
                if lane == LANES {
                    black_box(&mut *lanes).look_up(scene, source, &spans);
                    spans.clear();
                    lane = 0;
                }
            }
        }
        black_box(&mut *lanes).look_up(scene, source, &spans);
    }
}

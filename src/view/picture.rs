//! What is shown of a panel, in 8 bits a channel: the picture on the screen's curve, or a map of numbers.

use rayon::prelude::*;

use crate::film::{Image, ScreenTable};
use crate::render::Growing;
use crate::report::pictures::error_map;
use crate::scene::config::Look;

/// Decades of variance that the map's colours span.
const DECADES: f64 = 4.0;

/// A raster of RGB, 8 bits a channel, top row first.
pub struct Shown {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `3 · width · height` bytes.
    pub bytes: Vec<u8>,
    /// What is shown: the picture where another could not be had yet.
    pub look: Look,
    /// The number at the end of the scale, where colours stand for numbers.
    pub scale: Option<f64>,
}

/// A picture on the screen's curve.
pub fn on_screen(image: &Image, table: &ScreenTable, look: Look) -> Shown {
    let mut bytes = vec![0u8; image.pixels.len() * 3];
    let row = image.width as usize;
    bytes.par_chunks_mut(3 * row).zip(image.pixels.par_chunks(row)).for_each(|(bytes, pixels)| {
        for (byte, &c) in bytes.iter_mut().zip(pixels.as_flattened()) {
            *byte = table.code(c);
        }
    });
    Shown { width: image.width, height: image.height, bytes, look, scale: None }
}

/// Picture minus reference in luminance, full colour at ±`scale`; the picture alone where that is no number above 0.
pub fn error(growing: &Growing, reference: &Image, scale: f64, table: &ScreenTable) -> Shown {
    let image = growing.image();
    match error_map(&image, reference, scale) {
        Ok(map) => {
            Shown { width: map.width, height: map.height, bytes: map.bytes, look: Look::Error, scale: Some(scale) }
        }
        Err(_) => on_screen(&image, table, Look::Image),
    }
}

/// Variance of each pixel's mean luma as if its samples were independent, from black over red and yellow to white, four decades up to the
/// scale, which 99.5 % of the pixels do not exceed. `None` below two samples.
pub fn variance(growing: &Growing) -> Option<Shown> {
    let (width, height) = growing.size();
    let n = f64::from(growing.samples());
    growing.luma_variance(0, 0)?;
    let mut values = vec![0.0f64; width as usize * height as usize];
    values.par_chunks_mut(width as usize).enumerate().for_each(|(y, row)| {
        for (x, value) in row.iter_mut().enumerate() {
            *value = growing.luma_variance(x as u32, y as u32).unwrap_or(0.0) / n;
        }
    });
    let mut sorted = values.clone();
    let rank = (sorted.len() * 995).div_ceil(1000).max(1) - 1;
    let scale = *sorted.select_nth_unstable_by(rank, f64::total_cmp).1;
    let mut bytes = vec![0u8; 3 * values.len()];
    bytes.par_chunks_mut(3).zip(&values).for_each(|(rgb, &value)| {
        let share = if scale > 0.0 && value > 0.0 { 1.0 + libm::log10(value / scale) / DECADES } else { 0.0 };
        rgb.copy_from_slice(&heat(share));
    });
    Some(Shown { width, height, bytes, look: Look::Variance, scale: Some(scale) })
}

/// Black, red, yellow, white at 0, 1/3, 2/3, 1, linear between: lighter is more, also in grey.
fn heat(share: f64) -> [u8; 3] {
    let t = 3.0 * share.clamp(0.0, 1.0);
    [t, t - 1.0, t - 2.0].map(|c| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heat_rises_from_black_to_white() {
        assert_eq!([heat(-1.0), heat(0.0), heat(1.0), heat(9.0)], [[0; 3], [0; 3], [255; 3], [255; 3]]);
        let light = |t: f64| heat(t).iter().map(|&c| u32::from(c)).sum::<u32>();
        assert!((0..100).all(|i| light(f64::from(i) / 100.0) < light(f64::from(i + 1) / 100.0)));
    }
}

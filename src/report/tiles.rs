//! How sure the error of one picture is: an interval from its own tiles.

use crate::film::Image;
use crate::stats::{Estimate, jackknife};

use super::details::Truth;
use super::numbers::short;

/// Edge of a tile, in pixels. Errors of independent pixels are independent; the reference's noise is so too. Tiles of 4 × 4 bring
/// the heavy tails of single pixels' squares down and leave 49 of them in a window of 28 × 28.
const EDGE: u32 = 4;

/// Part of a picture: first column and row, columns, rows.
pub(super) type Window = (u32, u32, u32, u32);

/// Mean square error of `image` in a window, mean((T − R₁)(T − R₂)) over its pixels and channels, so free of the reference's noise on
/// average, with its 95 % interval by the delete-1 jackknife over tiles of [`EDGE`]² pixels, cut off at the window's ends.
///
/// The interval holds where errors of different pixels are independent, that is where each pixel has its own randomisation. It
/// errs on the wide side, as tiles also differ by what they show.
pub(super) fn mse(image: &Image, truth: &Truth, (x0, y0, width, height): Window) -> Estimate {
    let [a, b] = &truth.halves;
    let tile = |left: u32, top: u32| {
        let (mut sum, mut count) = (0.0, 0.0);
        for y in top..(top + EDGE).min(y0 + height) {
            for x in left..(left + EDGE).min(x0 + width) {
                let at = (y * image.width + x) as usize;
                for c in 0..3 {
                    let [t, a, b] = [image, a, b].map(|image| f64::from(image.pixels[at][c]));
                    sum += (t - a) * (t - b);
                    count += 1.0;
                }
            }
        }
        (sum, count)
    };
    let corners = |from: u32, length: u32| (from..from + length).step_by(EDGE as usize);
    let tiles: Vec<(f64, f64)> =
        corners(y0, height).flat_map(|y| corners(x0, width).map(move |x| (x, y))).map(|(x, y)| tile(x, y)).collect();
    let (sum, count) = tiles.iter().fold((0.0, 0.0), |(sum, count), tile| (sum + tile.0, count + tile.1));
    jackknife(tiles.len(), |left_out| match left_out {
        None => sum / count,
        Some(i) => (sum - tiles[i].0) / (count - tiles[i].1),
    })
}

/// The root of a mean square error and its interval in words: `0.0123 [0.0120, 0.0126]`; an end below 0 is 0.
pub(super) fn rmse_words(mse: &Estimate) -> String {
    let root = |x: f64| if x > 0.0 { short(x.sqrt()) } else { "0".to_owned() };
    let value = if mse.value > 0.0 { short(mse.value.sqrt()) } else { "below noise".to_owned() };
    match mse.ci95 {
        Some([low, high]) => format!("{value} [{}, {}]", root(low), root(high)),
        None => value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    fn image(width: u32, height: u32, mut at: impl FnMut(u32, u32) -> f32) -> Image {
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| [at(x, y); 3]).collect();
        Image { width, height, pixels }
    }

    /// The closed form twice.
    fn exactly(image: Image) -> Truth {
        Truth { mean: image.clone(), halves: [image.clone(), image] }
    }

    #[test]
    fn the_error_is_that_of_the_window_s_pixels_alone_and_its_ends_count_by_their_pixels() {
        let truth = exactly(image(10, 9, |_, _| 0.5));
        let test = image(10, 9, |x, y| if x < 7 && y < 5 { 0.5 + 0.1 * (x % 2) as f32 } else { 9.0 });
        let found = mse(&test, &truth, (0, 0, 7, 5));
        // Three of seven columns err by 0.1.
        assert!((found.value - 0.01 * 3.0 / 7.0).abs() < 1e-8, "{found:?}");
        let [low, high] = found.ci95.unwrap();
        assert!(low < found.value && found.value < high);
        assert_eq!(mse(&test, &truth, (0, 0, 3, 2)).ci95, None, "one tile says nothing of how sure it is");
    }

    /// Independent errors whose size doubles across the window, as it does in a penumbra.
    ///
    /// False alarms: 1e-9, of a coverage of at least 94 %: of 3000 intervals 2730 cover, 6.9 standard deviations below. An interval
    /// of 80 % of its width would cover less often than 90 % and be caught.
    #[test]
    fn the_interval_covers_the_true_error_about_as_often_as_it_says() {
        let truth = exactly(image(28, 28, |_, _| 1.0));
        let size = |x: u32| 0.1 * (1.0 + x as f32 / 27.0);
        let mut random = Pcg64::seed_from_u64(11);
        let mut uniform = || (random.next_u64() >> 40) as f32 / (1 << 24) as f32;
        // A uniform number in ±s has the mean square s²/3.
        let right: f64 = (0..28).map(|x| f64::from(size(x) * size(x)) / 3.0).sum::<f64>() / 28.0;
        let mut covered = 0;
        for _ in 0..3000 {
            let test = image(28, 28, |x, _| 1.0 + size(x) * (2.0 * uniform() - 1.0));
            let [low, high] = mse(&test, &truth, (0, 0, 28, 28)).ci95.unwrap();
            covered += usize::from((low..=high).contains(&right));
        }
        assert!(covered >= 2730, "{covered} of 3000");
    }

    #[test]
    fn errors_are_said_with_their_interval() {
        let said = |value: f64, ci95| rmse_words(&Estimate { value, ci95 });
        assert_eq!(said(0.01, Some([0.0081, 0.0121])), "0.100 [0.0900, 0.110]");
        assert_eq!(said(-1e-9, Some([-1e-6, 1e-6])), "below noise [0, 0.00100]");
        assert_eq!(said(0.01, None), "0.100");
    }
}

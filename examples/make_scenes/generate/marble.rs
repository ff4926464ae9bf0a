//! Marble as a texture: clouds and veins from periodic lattice noise, so that it repeats without a seam.

use std::path::Path;

use sampler_lab::error::Result;
use sampler_lab::film::write_small_png_rgb8;

/// A colour as a screen shows it: sRGB, each in [0, 1].
pub type Screen = [f64; 3];

/// One kind of marble.
#[derive(Debug, Clone, Copy)]
pub struct Marble {
    /// Its own noise.
    pub seed: u32,
    /// The stone, from its darker to its lighter clouds.
    pub stone: [Screen; 2],
    /// Broad and fine veins.
    pub veins: [Screen; 2],
}

/// Texels a side.
const SIZE: u32 = 512;

impl Marble {
    /// Writes the 512×512 texture.
    ///
    /// # Errors
    /// Kind `Write` where the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let texels = (0..SIZE * SIZE).flat_map(|i| {
            let centre = |k: u32| (f64::from(k) + 0.5) / f64::from(SIZE);
            self.colour(centre(i % SIZE), centre(i / SIZE)).map(|c| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
        });
        write_small_png_rgb8(path, SIZE, SIZE, &texels.collect::<Vec<u8>>())
    }

    /// Colour at (x, y), periodic with period 1 in both.
    ///
    /// A vein is where a noise crosses zero, w(d) = exp(−(d/width)²): a curve that wanders, forks and never stops short.
    fn colour(&self, x: f64, y: f64) -> Screen {
        let noise = |layer: u32, period: u32, octaves: u32, x: f64, y: f64| {
            fractal(mix(self.seed ^ mix(layer)), period, octaves, x, y)
        };
        // The veins follow a field bent by a slower one, as stone that was pressed while soft.
        let (bent_x, bent_y) = (x + 0.16 * noise(1, 2, 3, x, y), y + 0.16 * noise(2, 2, 3, x, y));
        let vein = |distance: f64, width: f64| libm::exp(-(distance / width) * (distance / width));
        let clouds = 0.5 + 0.8 * noise(3, 3, 6, bent_x, bent_y);
        let presence = (0.5 + 1.1 * noise(4, 3, 2, x, y)).clamp(0.0, 1.0);
        let broad = 0.75 * presence * vein(noise(5, 2, 5, bent_x, bent_y), 0.035);
        let fine = 0.7 * (1.1 - presence).clamp(0.0, 1.0) * vein(noise(6, 4, 5, bent_x, bent_y), 0.03);
        let grain = 0.012 * noise(7, 128, 1, x, y);
        let stone = blend(self.stone[0], self.stone[1], clouds.clamp(0.0, 1.0));
        blend(blend(stone, self.veins[0], broad), self.veins[1], fine).map(|c| c + grain)
    }
}

/// a + (b − a) t, channel by channel.
fn blend(a: Screen, b: Screen, t: f64) -> Screen {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
}

/// Σ 2⁻ᵏ · noise at period·2ᵏ, about within ±1.
fn fractal(seed: u32, period: u32, octaves: u32, x: f64, y: f64) -> f64 {
    (0..octaves).map(|k| gradient_noise(seed.wrapping_add(k), period << k, x, y) / f64::from(1u32 << k)).sum()
}

/// Gradient noise after Perlin (2002, doi:10.1145/566654.566636) on `period` cells a side, repeating with period 1.
fn gradient_noise(seed: u32, period: u32, x: f64, y: f64) -> f64 {
    let (x, y) = (x * f64::from(period), y * f64::from(period));
    let (cell_x, cell_y) = (x.floor(), y.floor());
    let (fx, fy) = (x - cell_x, y - cell_y);
    let corner = |dx: i64, dy: i64| {
        let wrap = |cell: f64, d: i64| (cell as i64 + d).rem_euclid(i64::from(period)) as u32;
        let bits = mix(wrap(cell_x, dx) ^ mix(wrap(cell_y, dy) ^ mix(seed)));
        let (sin, cos) = libm::sincos(f64::from(bits) * (std::f64::consts::TAU / 4_294_967_296.0));
        cos * (fx - dx as f64) + sin * (fy - dy as f64)
    };
    let ease = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (tx, ty) = (ease(fx), ease(fy));
    let lower = corner(0, 0) + (corner(1, 0) - corner(0, 0)) * tx;
    let upper = corner(0, 1) + (corner(1, 1) - corner(0, 1)) * tx;
    // A 2-D gradient noise of unit gradients reaches √½.
    std::f64::consts::SQRT_2 * (lower + (upper - lower) * ty)
}

/// A bijection of 32-bit words without visible pattern: Wellons' lowbias32 (2018), begun one step off zero, which it
/// would keep.
pub fn mix(bits: u32) -> u32 {
    let mut bits = bits.wrapping_add(0x9E37_79B9);
    bits = (bits ^ (bits >> 16)).wrapping_mul(0x7FEB_352D);
    bits = (bits ^ (bits >> 15)).wrapping_mul(0x846C_A68B);
    bits ^ (bits >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_zero_on_its_lattice_bounded_by_one_and_periodic() {
        for i in 0..1000 {
            let (x, y) = (f64::from(i) * 0.0137, f64::from(i) * 0.0071);
            let value = gradient_noise(9, 4, x, y);
            assert!(value.abs() <= 1.0);
            // One period further the fraction of a cell is off by the rounding of x · 4 alone.
            assert!((gradient_noise(9, 4, x + 1.0, y - 2.0) - value).abs() < 1e-12);
        }
        assert_eq!(gradient_noise(9, 4, 0.25, 0.75), 0.0);
    }

    #[test]
    fn mixing_sends_no_two_of_a_million_words_to_one() {
        let mut mixed: Vec<u32> = (0..1_000_000).map(mix).collect();
        mixed.sort_unstable();
        mixed.dedup();
        assert_eq!(mixed.len(), 1_000_000);
    }
}

//! FLIP: how different two pictures look to someone who flips between them on a screen. Perceptual, not an error of radiance.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström & Fairchild (2020), "FLIP: a difference evaluator for alternating
//! images", doi:10.1145/3406183; the variant for pictures of limited range (LDR), after its published definition. A pixel's
//! value is ΔE^(1 − Δf) in [0, 1]:
//!
//! - *colour* ΔE: opponent colours Y Cx Cz, blurred by the eye's contrast sensitivity (sums of Gaussians, cut off at three
//!   standard deviations of the widest), clamped to the screen's colours, as CIELAB with the Hunt effect; HyAB distance, to the power 0.7,
//!   mapped so that 0.4 of the largest distance (green to blue) is 0.95;
//! - *features* Δf: edges and points, first and second derivatives of a Gaussian of 0.082 degrees on Y; the larger of the two
//!   differences of their strengths, by √2, to the power 0.5.
//!
//! Beyond the border the border's pixels go on. Both pictures are treated alike, so it is symmetric.
//!
//! It saturates, depends on the screen and its distance, and is no estimator of anything: neither a variance nor a mean square
//! error, and numbers of different exposures are of different pictures. Never average across those.

use rayon::prelude::*;

use super::moments::sum;

/// Pixels a degree of the usual viewing conditions, 0.7 m from a screen 0.7 m wide with 3840 columns: 67.0206.
pub const DEFAULT_PPD: f64 = 3840.0 * std::f64::consts::PI / 180.0;

/// Fewest and most pixels a degree that are taken, 1 to 1000: below, an eye sees less than a pixel; above, the filters outgrow
/// any screen.
pub const PPD_RANGE: std::ops::RangeInclusive<f64> = 1.0..=1000.0;

/// Exponent of colour distances.
const COLOUR_EXPONENT: f64 = 0.7;
/// Share of the largest colour distance that is mapped to [`KNEE`].
const KNEE_AT: f64 = 0.4;
/// Value of ΔE there.
const KNEE: f64 = 0.95;
/// Width of the feature filters in degrees, two standard deviations.
const FEATURE_DEGREES: f64 = 0.082;
/// Exponent of feature differences.
const FEATURE_EXPONENT: f64 = 0.5;

/// Scales b of the contrast sensitivity's Gaussians, degrees²: achromatic, red–green, and blue–yellow's two.
const SCALES: [f64; 4] = [0.0047, 0.0053, 0.04, 0.025];
/// Amplitudes of blue–yellow's two.
const BLUE_YELLOW: [f64; 2] = [34.1, 13.5];

/// Linear sRGB → CIE XYZ, white of D65.
const TO_XYZ: [[f64; 3]; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];

/// Rows that are filtered at a time: memory for images of any height stays a few hundred bytes a column.
const STRIP: usize = 64;

/// FLIP of two pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flip {
    /// Mean over the pixels, 0 to 1.
    pub mean: f64,
    /// The value below which pixels make up half of the sum of all values: where the difference is, how large it looks. 0
    /// where no pixel differs.
    pub weighted_median: f64,
}

/// What an eye makes of one picture, as far as FLIP asks; 40 bytes a pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    width: usize,
    pixels_per_degree: f64,
    pixels: Vec<SeenPixel>,
}

/// One pixel of it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SeenPixel {
    /// CIELAB of the blurred picture, Hunt-adjusted.
    lab: [f64; 3],
    /// Strength of edges.
    edge: f64,
    /// Strength of points.
    point: f64,
}

impl Seen {
    /// Looks at a picture of `width` × `height` pixels; `pixel` gives what the screen emits at a pixel's number (row by row
    /// from the top): linear sRGB in [0, 1].
    ///
    /// # Panics
    /// Where the picture has no pixel or `pixels_per_degree` is outside [`PPD_RANGE`].
    pub fn new(width: usize, height: usize, pixels_per_degree: f64, pixel: impl Fn(usize) -> [f64; 3] + Sync) -> Self {
        assert!(width > 0 && height > 0, "a picture needs a pixel");
        assert!(PPD_RANGE.contains(&pixels_per_degree), "pixels a degree outside {PPD_RANGE:?}");
        let eye = Eye::new(pixels_per_degree);
        let strips: Vec<usize> = (0..height).step_by(STRIP).collect();
        let strip = |&from: &usize| eye.strip((width, height), from..(from + STRIP).min(height), &pixel);
        let pixels: Vec<SeenPixel> = strips.par_iter().flat_map_iter(strip).collect();
        Self { width, pixels_per_degree, pixels }
    }

    /// Values of all pixels against another picture, row by row; 0 where nothing differs, 1 at most.
    ///
    /// # Panics
    /// Where the pictures differ in size or in viewing conditions.
    pub fn differences(&self, other: &Self) -> Vec<f64> {
        assert!(self.width == other.width && self.pixels.len() == other.pixels.len(), "pictures differ in size");
        assert!(self.pixels_per_degree == other.pixels_per_degree, "pictures seen from different distances");
        let largest = largest_colour_difference();
        self.pixels.iter().zip(&other.pixels).map(|(a, b)| difference(a, b, largest)).collect()
    }

    /// FLIP of this picture and another one.
    ///
    /// # Panics
    /// As [`differences`](Self::differences).
    pub fn flip(&self, other: &Self) -> Flip {
        pooled(self.differences(other))
    }
}

/// Mean, and the median weighted by the values themselves.
fn pooled(mut values: Vec<f64>) -> Flip {
    let total = sum(values.iter().copied());
    let mean = total / values.len() as f64;
    values.sort_unstable_by(f64::total_cmp);
    let mut below = 0.0;
    let passes = |&value: &f64| {
        below += value;
        below > total / 2.0
    };
    Flip { mean, weighted_median: values.into_iter().find(passes).unwrap_or(0.0) }
}

/// One pixel's value.
fn difference(a: &SeenPixel, b: &SeenPixel, largest: f64) -> f64 {
    let colour = libm::pow(hyab(a.lab, b.lab), COLOUR_EXPONENT);
    let knee = KNEE_AT * largest;
    let colour = match colour < knee {
        true => colour * KNEE / knee,
        // Blurred colours are the screen's, but not every pair of them is closer than green and blue.
        false => (KNEE + (colour - knee) / (largest - knee) * (1.0 - KNEE)).min(1.0),
    };
    let feature = (a.edge - b.edge).abs().max((a.point - b.point).abs()) / std::f64::consts::SQRT_2;
    // A strength is √2 at the most, as derivatives along an axis are at most 1.
    libm::pow(colour, 1.0 - libm::pow(feature, FEATURE_EXPONENT).min(1.0))
}

/// City-block distance in lightness, Euclidean in the plane of colours.
fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + ((a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2])).sqrt()
}

/// Green against blue, as compared.
fn largest_colour_difference() -> f64 {
    libm::pow(hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])), COLOUR_EXPONENT)
}

fn times(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// X, Y, Z as shares of the white's.
fn relative_xyz(linear: [f64; 3]) -> [f64; 3] {
    let (xyz, white) = (times(&TO_XYZ, linear), times(&TO_XYZ, [1.0; 3]));
    std::array::from_fn(|i| xyz[i] / white[i])
}

/// CIELAB with chroma scaled by lightness (Hunt effect): L*, L* a*/100, L* b*/100.
fn hunt_lab(linear: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let curve = |t: f64| {
        if t > DELTA * DELTA * DELTA { libm::cbrt(t) } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let [x, y, z] = relative_xyz(linear).map(curve);
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// Opponent colours, linear in the light: Y Cx Cz.
fn opponent(linear: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = relative_xyz(linear);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The way back, from Y Cx Cz to linear sRGB.
struct FromOpponent {
    from_xyz: [[f64; 3]; 3],
    white: [f64; 3],
}

impl FromOpponent {
    fn new() -> Self {
        let m = TO_XYZ;
        // Rows of the inverse are the cross products of columns by the determinant.
        let column = |c: usize| [m[0][c], m[1][c], m[2][c]];
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let rows = [cross(column(1), column(2)), cross(column(2), column(0)), cross(column(0), column(1))];
        let determinant: f64 = (0..3).map(|i| m[i][0] * rows[0][i]).sum();
        Self { from_xyz: rows.map(|row| row.map(|v| v / determinant)), white: times(&TO_XYZ, [1.0; 3]) }
    }

    fn linear(&self, [y, cx, cz]: [f64; 3]) -> [f64; 3] {
        let y = (y + 16.0) / 116.0;
        let relative = [y + cx / 500.0, y, y - cz / 200.0];
        times(&self.from_xyz, std::array::from_fn(|i| relative[i] * self.white[i]))
    }
}

/// The filters at one number of pixels a degree, each along one axis; their taps run from −radius to radius.
struct Eye {
    /// Achromatic, red–green, blue–yellow's two: the blur is the product over both axes, of the last two the sum.
    blurs: [Vec<f64>; 4],
    /// Gaussian, its first and its second derivative.
    features: [Vec<f64>; 3],
    back: FromOpponent,
}

impl Eye {
    fn new(pixels_per_degree: f64) -> Self {
        use std::f64::consts::PI;
        let widest = SCALES.iter().copied().fold(0.0, f64::max);
        let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i64;
        let taps = |b: f64| -> Vec<f64> {
            let degrees = |i: i64| i as f64 / pixels_per_degree;
            (-radius..=radius).map(|i| libm::exp(-PI * PI * degrees(i) * degrees(i) / b)).collect()
        };
        let total = |w: &[f64]| sum(w.iter().copied());
        let scaled = |w: Vec<f64>, by: f64| w.into_iter().map(|v| v * by).collect::<Vec<f64>>();
        let mut blurs = SCALES.map(taps);
        // Along one axis an amplitude counts by its root; all four have a sum of 1 in the plane.
        let blue_yellow: [f64; 2] = std::array::from_fn(|i| (BLUE_YELLOW[i] * (PI / SCALES[2 + i]).sqrt()).sqrt());
        let whole = (0..2).map(|i| libm::pow(blue_yellow[i] * total(&blurs[2 + i]), 2.0)).sum::<f64>().sqrt();
        for (i, blur) in blurs.iter_mut().enumerate() {
            let by = if i < 2 { 1.0 / total(blur) } else { blue_yellow[i - 2] / whole };
            *blur = scaled(std::mem::take(blur), by);
        }
        Self { blurs, features: feature_taps(pixels_per_degree), back: FromOpponent::new() }
    }

    /// Pixels of the rows at `rows`.
    fn strip(
        &self,
        (width, height): (usize, usize),
        rows: std::ops::Range<usize>,
        pixel: &(impl Fn(usize) -> [f64; 3] + Sync),
    ) -> Vec<SeenPixel> {
        let radius = (self.blurs[0].len() / 2).max(self.features[0].len() / 2);
        let needed = rows.start.saturating_sub(radius)..(rows.end + radius).min(height);
        // What a row is along x: four blurs, then Gaussian, first and second derivative of Y.
        let along_x: Vec<[Vec<f64>; 7]> = needed.clone().map(|y| self.along_x(width, y * width, pixel)).collect();
        let row = |y: usize, offset: isize| {
            let y = y.saturating_add_signed(offset).min(height - 1);
            &along_x[y - needed.start]
        };
        rows.flat_map(|y| {
            let down = |taps: &[f64], plane: usize| -> Vec<f64> {
                let half = (taps.len() / 2) as isize;
                let mut out = vec![0.0; width];
                for (&tap, offset) in taps.iter().zip(-half..) {
                    out.iter_mut().zip(&row(y, offset)[plane]).for_each(|(out, v)| *out += tap * v);
                }
                out
            };
            let blurred: [Vec<f64>; 4] = std::array::from_fn(|i| down(&self.blurs[i], i));
            let [gauss, first, second] = &self.features;
            let [dx, ddx, dy, ddy] = [down(gauss, 5), down(gauss, 6), down(first, 4), down(second, 4)];
            (0..width)
                .map(|x| {
                    let yxz = [blurred[0][x], blurred[1][x], blurred[2][x] + blurred[3][x]];
                    SeenPixel {
                        lab: hunt_lab(self.back.linear(yxz).map(|c| c.clamp(0.0, 1.0))),
                        edge: (dx[x] * dx[x] + dy[x] * dy[x]).sqrt(),
                        point: (ddx[x] * ddx[x] + ddy[x] * ddy[x]).sqrt(),
                    }
                })
                .collect::<Vec<SeenPixel>>()
        })
        .collect()
    }

    /// The row whose first pixel has the number `first`, filtered along x.
    fn along_x(&self, width: usize, first: usize, pixel: &(impl Fn(usize) -> [f64; 3] + Sync)) -> [Vec<f64>; 7] {
        let colours: Vec<[f64; 3]> = (first..first + width).map(|at| opponent(pixel(at))).collect();
        let along = |taps: &[f64], value: &dyn Fn([f64; 3]) -> f64| -> Vec<f64> {
            let half = taps.len() / 2;
            let padded: Vec<f64> =
                (0..width + 2 * half).map(|i| value(colours[i.saturating_sub(half).min(width - 1)])).collect();
            let mut out = vec![0.0; width];
            for (k, &tap) in taps.iter().enumerate() {
                out.iter_mut().zip(&padded[k..]).for_each(|(out, v)| *out += tap * v);
            }
            out
        };
        let brightness = |c: [f64; 3]| (c[0] + 16.0) / 116.0;
        std::array::from_fn(|i| match i {
            0..4 => along(&self.blurs[i], &|c| c[i.min(2)]),
            _ => along(&self.features[i - 4], &brightness),
        })
    }
}

/// A Gaussian of sum 1 and its derivatives, whose positive and negative taps have sums of 1 and −1.
fn feature_taps(pixels_per_degree: f64) -> [Vec<f64>; 3] {
    let deviation = 0.5 * FEATURE_DEGREES * pixels_per_degree;
    let radius = (3.0 * deviation).ceil() as i64;
    let at = |i: i64| i as f64 / deviation;
    let gauss = |i: i64| libm::exp(-at(i) * at(i) / 2.0);
    let taps = |f: &dyn Fn(i64) -> f64| -> Vec<f64> {
        let taps: Vec<f64> = (-radius..=radius).map(f).collect();
        let part = |sign: f64| sum(taps.iter().map(|v| (v * sign).max(0.0)));
        let (above, below) = (part(1.0), part(-1.0));
        taps.iter().map(|&v| v / if v > 0.0 { above } else { below.max(f64::MIN_POSITIVE) }).collect()
    };
    [taps(&gauss), taps(&|i| -at(i) * gauss(i)), taps(&|i| (at(i) * at(i) - 1.0) * gauss(i))]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    /// Pixels of a picture: smooth, with an edge and a point.
    fn picture(width: usize, height: usize, phase: f64) -> Vec<[f64; 3]> {
        let pixel = |p: usize| {
            let (x, y) = ((p % width) as f64, (p / width) as f64);
            let wave = |c: f64| 0.5 + 0.4 * libm::sin(0.37 * x + 0.21 * y + c + phase);
            let edge = if 2.0 * x > y + 7.0 + phase { 0.1 } else { 0.0 };
            [wave(0.0), wave(1.0), wave(2.0)].map(|v| (v + edge).clamp(0.0, 1.0))
        };
        (0..width * height).map(pixel).collect()
    }

    fn seen(pixels: &[[f64; 3]], width: usize, ppd: f64) -> Seen {
        Seen::new(width, pixels.len() / width, ppd, |p| pixels[p])
    }

    /// The definition read literally: kernels in the plane, each normalised there, one pixel at a time.
    fn twin(a: &[[f64; 3]], b: &[[f64; 3]], width: usize, ppd: f64) -> Vec<f64> {
        let height = a.len() / width;
        let at = |image: &[[f64; 3]], x: i64, y: i64| {
            image[y.clamp(0, height as i64 - 1) as usize * width + x.clamp(0, width as i64 - 1) as usize]
        };
        let plane = |radius: i64, kernel: &dyn Fn(f64, f64) -> f64| -> Vec<(i64, i64, f64)> {
            (-radius..=radius)
                .flat_map(|j| (-radius..=radius).map(move |i| (i, j)))
                .map(|(i, j)| (i, j, kernel(i as f64, j as f64)))
                .collect()
        };
        let blur = |terms: &[(f64, f64)]| {
            let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * ppd).ceil() as i64;
            let term = |r2: f64, a: f64, b: f64| a * (PI / b).sqrt() * libm::exp(-PI * PI * r2 / b);
            let kernel = |x: f64, y: f64| {
                let r2 = (x * x + y * y) / (ppd * ppd);
                terms.iter().map(|&(a, b)| term(r2, a, b)).sum::<f64>()
            };
            let mut taps = plane(radius, &kernel);
            let total: f64 = taps.iter().map(|t| t.2).sum();
            taps.iter_mut().for_each(|t| t.2 /= total);
            taps
        };
        let blurs = [blur(&[(1.0, 0.0047)]), blur(&[(1.0, 0.0053)]), blur(&[(34.1, 0.04), (13.5, 0.025)])];
        let sigma = 0.5 * 0.082 * ppd;
        let feature = |kernel: &dyn Fn(f64, f64) -> f64| {
            let mut taps = plane((3.0 * sigma).ceil() as i64, kernel);
            let part = |sign: f64| taps.iter().map(|t| (t.2 * sign).max(0.0)).sum::<f64>();
            let (above, below) = (part(1.0), part(-1.0));
            taps.iter_mut().for_each(|t| t.2 /= if t.2 > 0.0 { above } else { below });
            taps
        };
        let g = |x: f64, y: f64| libm::exp(-(x * x + y * y) / (2.0 * sigma * sigma));
        let features = [
            feature(&|x, y| -x * g(x, y)),
            feature(&|x, y| -y * g(x, y)),
            feature(&|x, y| (x * x / (sigma * sigma) - 1.0) * g(x, y)),
            feature(&|x, y| (y * y / (sigma * sigma) - 1.0) * g(x, y)),
        ];
        let filtered =
            |image: &[[f64; 3]], taps: &[(i64, i64, f64)], x: i64, y: i64, value: &dyn Fn([f64; 3]) -> f64| {
                taps.iter().map(|&(i, j, w)| w * value(opponent(at(image, x + i, y + j)))).sum::<f64>()
            };
        let back = FromOpponent::new();
        let pixel = |image: &[[f64; 3]], x: i64, y: i64| {
            let colour = std::array::from_fn(|c| filtered(image, &blurs[c], x, y, &|v| v[c]));
            let bright = |v: [f64; 3]| (v[0] + 16.0) / 116.0;
            let f: Vec<f64> = features.iter().map(|taps| filtered(image, taps, x, y, &bright)).collect();
            SeenPixel {
                lab: hunt_lab(back.linear(colour).map(|c| c.clamp(0.0, 1.0))),
                edge: f[0].hypot(f[1]),
                point: f[2].hypot(f[3]),
            }
        };
        (0..a.len() as i64)
            .map(|p| (p % width as i64, p / width as i64))
            .map(|(x, y)| difference(&pixel(a, x, y), &pixel(b, x, y), largest_colour_difference()))
            .collect()
    }

    /// Rounding leaves features of some 1e−15 where there are none, and the exponents make √1e−15 · ΔE |ln ΔE| ≤ 1.2e−8 of them.
    const ROUNDING: f64 = 2e-8;

    #[test]
    fn it_is_the_definition_read_literally() {
        for (width, height, ppd) in [(13, 9, DEFAULT_PPD), (7, 70, 20.0), (1, 1, 67.0), (30, 2, 40.0)] {
            let (a, b) = (picture(width, height, 0.0), picture(width, height, 0.6));
            let fast = seen(&a, width, ppd).differences(&seen(&b, width, ppd));
            for (p, (fast, slow)) in fast.iter().zip(twin(&a, &b, width, ppd)).enumerate() {
                assert!((fast - slow).abs() < ROUNDING, "{width}×{height}, pixel {p}: {fast} {slow}");
            }
        }
    }

    #[test]
    fn equal_pictures_do_not_differ_and_black_and_white_differ_most_of_all_greys() {
        let a = picture(20, 12, 0.3);
        let same = seen(&a, 20, DEFAULT_PPD).flip(&seen(&a, 20, DEFAULT_PPD));
        assert_eq!(same, Flip { mean: 0.0, weighted_median: 0.0 });
        // Flat pictures have no features, so the value is the colour's: L* 0 and 100 against 0.4 and 1 of green to blue.
        let flat = |v: f64| seen(&[[v; 3]; 6], 3, DEFAULT_PPD);
        let found = flat(0.0).flip(&flat(1.0));
        let (largest, black_white) = (largest_colour_difference(), libm::pow(100.0, 0.7));
        let expected = 0.95 + 0.05 * (black_white - 0.4 * largest) / (0.6 * largest);
        assert!((found.mean - expected).abs() < ROUNDING && found.mean > 0.96, "{found:?} {expected}");
        assert!(flat(0.0).flip(&flat(0.5)).mean < found.mean);
    }

    #[test]
    fn a_strip_ends_where_no_pixel_notices() {
        let (width, height) = (5, 3 * STRIP + 7);
        let (a, b) = (picture(width, height, 0.0), picture(width, height, 0.4));
        let eye = Eye::new(DEFAULT_PPD);
        let whole = eye.strip((width, height), 0..height, &|p| a[p]);
        assert_eq!(seen(&a, width, DEFAULT_PPD).pixels, whole);
        let flip = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| seen(&a, width, DEFAULT_PPD).flip(&seen(&b, width, DEFAULT_PPD)))
        };
        assert_eq!(flip(1), flip(7));
    }

    #[test]
    fn the_weighted_median_is_where_half_of_the_sum_is_reached() {
        assert_eq!(pooled(vec![0.5, 0.0, 0.125, 0.25]).weighted_median, 0.5);
        assert_eq!(pooled(vec![0.25; 4]), Flip { mean: 0.25, weighted_median: 0.25 });
        assert_eq!(pooled(vec![0.0, 0.25, 0.25, 0.25]).weighted_median, 0.25);
    }

    #[test]
    fn the_usual_screen_has_67_pixels_a_degree() {
        assert!((DEFAULT_PPD - 67.020_643).abs() < 1e-6);
        assert_eq!(Eye::new(DEFAULT_PPD).blurs[0].len(), 21);
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]
        /// Every picture of colours from the corners of the cube too, any distance.
        #[test]
        fn it_is_symmetric_and_within_0_and_1(
            width in 1_usize..9,
            rows in prop::collection::vec(prop::array::uniform6(prop_oneof![Just(0.0), Just(1.0), 0.0..=1.0_f64]), 1..40),
            ppd in prop_oneof![Just(1.0), Just(1000.0), 1.0..200.0_f64],
        ) {
            let count = (rows.len() / width).max(1) * width;
            let side = |from: usize| -> Vec<[f64; 3]> {
                (0..count).map(|p| { let r = rows[p % rows.len()]; [r[from], r[from + 1], r[from + 2]] }).collect()
            };
            let (a, b) = (seen(&side(0), width, ppd), seen(&side(3), width, ppd));
            prop_assert_eq!(a.differences(&b), b.differences(&a));
            prop_assert!(a.differences(&b).iter().all(|v| (0.0..=1.0).contains(v)));
            prop_assert!(a.differences(&a).iter().all(|&v| v == 0.0));
        }
    }
}

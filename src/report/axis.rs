//! Logarithmic axes: range, ticks and their labels.

/// A logarithmic axis: decimal logarithms of its ends, and the pixels they stand at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LogAxis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

/// Smallest ratio of an axis' ends: any factor of 2 holds at least two tick labels.
const LEAST_RATIO: f64 = 2.0;

impl LogAxis {
    /// The axis that holds all `values` (finite and above 0; none: one decade about 1) with `margin` of its length to
    /// spare at either end, from pixel `from` (smallest value) to pixel `to`.
    pub fn around(values: impl IntoIterator<Item = f64>, margin: f64, from: f64, to: f64) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values {
            low = low.min(libm::log10(value));
            high = high.max(libm::log10(value));
        }
        if low > high {
            (low, high) = (-0.5, 0.5);
        }
        let short = (libm::log10(LEAST_RATIO) - (high - low)).max(0.0) / 2.0;
        let spare = margin * (high - low + 2.0 * short) + short;
        Self { low: low - spare, high: high + spare, from, to }
    }

    /// The same range at other pixels.
    pub fn moved(self, from: f64, to: f64) -> Self {
        Self { from, to, ..self }
    }

    /// Pixel of a value above 0; values outside the range land outside the axis.
    pub fn pixel(&self, value: f64) -> f64 {
        self.from + (libm::log10(value) - self.low) / (self.high - self.low) * (self.to - self.from)
    }

    /// The value at a pixel.
    pub fn value(&self, pixel: f64) -> f64 {
        libm::pow(10.0, self.low + (pixel - self.from) / (self.to - self.from) * (self.high - self.low))
    }

    /// Pixel of any value, moved to the nearer end where it lies outside; 0 and below go to the low end.
    pub fn clamped(&self, value: f64) -> f64 {
        if value <= 0.0 {
            return self.from;
        }
        self.pixel(value).clamp(self.from.min(self.to), self.from.max(self.to))
    }

    /// Whether the value lies in the range; the ends do, but for rounding.
    pub fn holds(&self, value: f64) -> bool {
        value > 0.0 && (self.low - 1e-12..=self.high + 1e-12).contains(&libm::log10(value))
    }

    /// The values at the two ends.
    pub fn ends(&self) -> (f64, f64) {
        (libm::pow(10.0, self.low), libm::pow(10.0, self.high))
    }

    /// Labelled ticks: powers of ten, every k-th where there are more than `most`; in a short range 1, 2 and 5 times
    /// them, in a very short one every digit.
    pub fn ticks(&self, most: usize) -> Vec<f64> {
        let decades = self.multiples(&[1.0]);
        if decades.len() >= 4 {
            let every = decades.len().div_ceil(most.max(2)).max(1) as i64;
            let exponent = |value: f64| libm::round(libm::log10(value)) as i64;
            return decades.into_iter().filter(|&value| exponent(value).rem_euclid(every) == 0).collect();
        }
        let few = self.multiples(&[1.0, 2.0, 5.0]);
        if few.len() >= 3 { few } else { self.multiples(&[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]) }
    }

    /// Small unlabelled ticks at 2…9 times powers of ten, none where the axis is long.
    pub fn small_ticks(&self) -> Vec<f64> {
        if self.high - self.low > 6.0 {
            return Vec::new();
        }
        self.multiples(&[2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0])
    }

    fn multiples(&self, mantissas: &[f64]) -> Vec<f64> {
        let decades = libm::floor(self.low) as i32..=libm::ceil(self.high) as i32;
        // Divided rather than multiplied below 1, so that 0.2 is the number nearest to two tenths.
        let scaled =
            |m: f64, e: i32| if e < 0 { m / libm::pow(10.0, -f64::from(e)) } else { m * libm::pow(10.0, e.into()) };
        decades.flat_map(|e| mantissas.iter().map(move |&m| scaled(m, e))).filter(|&v| self.holds(v)).collect()
    }
}

/// A number as an axis shows it: three significant digits, no trailing zeros, `1e-6` outside 0.001…99999, powers of
/// two beyond that as `2¹⁷`; whole numbers up to 99999 in full.
pub(super) fn number_label(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let (fraction, exponent) = libm::frexp(value);
    if fraction == 0.5 && exponent > 17 {
        return format!("2{}", raised(exponent - 1));
    }
    let scientific = format!("{value:.2e}");
    let (digits, power) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let power: i32 = power.parse().unwrap_or(0);
    let trimmed =
        |s: &str| if s.contains('.') { s.trim_end_matches('0').trim_end_matches('.').to_owned() } else { s.to_owned() };
    match power {
        0..=4 if value.fract() == 0.0 => format!("{value}"),
        -3..=4 => trimmed(&format!("{value:.*}", (2 - power).max(0) as usize)),
        _ => format!("{}e{power}", trimmed(digits)),
    }
}

fn raised(exponent: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    exponent.to_string().bytes().map(|b| DIGITS[usize::from(b - b'0')]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(low: f64, high: f64) -> LogAxis {
        LogAxis::around([low, high], 0.0, 0.0, 100.0)
    }

    #[test]
    fn long_ranges_have_powers_of_ten_and_short_ones_one_two_five() {
        assert_eq!(axis(1e-4, 1.0).ticks(10), [1e-4, 1e-3, 1e-2, 1e-1, 1.0]);
        assert_eq!(axis(0.009, 0.11).ticks(10), [0.01, 0.02, 0.05, 0.1]);
        assert_eq!(axis(1.1, 2.2).ticks(10), [1.5, 2.0]);
        assert_eq!(axis(1e-12, 1e3).ticks(8), [1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 1.0, 1e2]);
    }

    #[test]
    fn every_range_has_two_to_twelve_labelled_ticks_in_order_and_inside() {
        for low in 0..40 {
            for span in 0..60 {
                let low = libm::pow(10.0, f64::from(low) * 0.37 - 13.0);
                let axis = axis(low, low * libm::pow(10.0, f64::from(span) * 0.29));
                let ticks = axis.ticks(8);
                assert!((2..=12).contains(&ticks.len()), "{axis:?}: {ticks:?}");
                assert!(ticks.windows(2).all(|t| t[0] < t[1]) && ticks.iter().all(|&t| axis.holds(t)), "{ticks:?}");
            }
        }
    }

    #[test]
    fn equal_values_stand_in_the_middle_of_a_factor_of_two() {
        let axis = axis(0.3, 0.3);
        let (low, high) = axis.ends();
        assert!((high / low - 2.0).abs() < 1e-12);
        assert!((axis.pixel(0.3) - 50.0).abs() < 1e-9);
        assert_eq!(LogAxis::around([], 0.0, 0.0, 1.0).ticks(8).len(), 3, "no values: a decade about 1");
    }

    #[test]
    fn pixels_run_with_the_logarithm_and_clamp_at_the_ends() {
        let axis = axis(1.0, 100.0).moved(200.0, 0.0);
        assert!((axis.pixel(10.0) - 100.0).abs() < 1e-12);
        assert_eq!((axis.clamped(1e9), axis.clamped(0.0), axis.clamped(-1.0)), (0.0, 200.0, 200.0));
    }

    #[test]
    fn numbers_are_written_short_and_exact() {
        let cases = [
            (1.0, "1"),
            (26.0, "26"),
            (65536.0, "65536"),
            (131072.0, "2¹⁷"),
            (16777216.0, "2²⁴"),
            (100000.0, "1e5"),
            (0.002, "0.002"),
            (0.1, "0.1"),
            (0.0005, "5e-4"),
            (2e-6, "2e-6"),
            (1e-12, "1e-12"),
            (0.01234, "0.0123"),
            (1.5, "1.5"),
            (0.0, "0"),
            (123.4, "123"),
        ];
        for (value, label) in cases {
            assert_eq!(number_label(value), label);
        }
    }
}

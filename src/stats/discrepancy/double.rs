//! Numbers of twice the digits of f64.

/// The unevaluated sum of two f64, |low| ≤ ½ ulp(high): about 32 digits (Dekker 1971).
#[derive(Debug, Clone, Copy)]
pub struct Double {
    pub high: f64,
    pub low: f64,
}

impl From<f64> for Double {
    fn from(value: f64) -> Self {
        Self { high: value, low: 0.0 }
    }
}

impl Double {
    /// a + b exactly (Knuth's two-sum, no branch).
    pub fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let part = high - a;
        Self { high, low: (a - (high - part)) + (b - part) }
    }

    /// a · b exactly, by halves of the digits (Veltkamp, Dekker 1971), which needs no fused multiply-add; for sizes
    /// far from the ends of the range of f64. Below 2^-970 what is lost is below 2^-1022.
    pub fn product(a: f64, b: f64) -> Self {
        let halves = |x: f64| {
            let scaled = 134_217_729.0 * x; // 2^27 + 1
            let high = scaled - (scaled - x);
            (high, x - high)
        };
        let high = a * b;
        let ((a1, a2), (b1, b2)) = (halves(a), halves(b));
        Self { high, low: ((a1 * b1 - high) + a1 * b2 + a2 * b1) + a2 * b2 }
    }

    /// A quotient of whole numbers.
    pub fn ratio(numerator: f64, denominator: f64) -> Self {
        Self::from(numerator).over(denominator)
    }

    /// Rounded to one f64.
    pub fn value(self) -> f64 {
        self.high + self.low
    }

    /// The sum, to about 2^-104.
    pub fn plus(self, other: Self) -> Self {
        let sum = Self::sum(self.high, other.high);
        Self::sum(sum.high, sum.low + (self.low + other.low))
    }

    /// The difference.
    pub fn minus(self, other: Self) -> Self {
        self.plus(other.scaled(-1.0))
    }

    /// The product, to about 2^-102.
    pub fn times(self, other: Self) -> Self {
        let product = Self::product(self.high, other.high);
        Self::sum(product.high, product.low + (self.high * other.low + self.low * other.high))
    }

    /// The product with one f64, to about 2^-103.
    pub fn times_single(self, factor: f64) -> Self {
        let product = Self::product(self.high, factor);
        Self::sum(product.high, product.low + self.low * factor)
    }

    /// Times a power of two (or its negative): exact.
    pub fn scaled(self, power_of_two: f64) -> Self {
        Self { high: self.high * power_of_two, low: self.low * power_of_two }
    }

    /// The quotient, to about 2^-102.
    pub fn over(self, divisor: f64) -> Self {
        let quotient = self.high / divisor;
        let back = Self::product(quotient, divisor);
        Self::sum(quotient, ((self.high - back.high) - back.low + self.low) / divisor)
    }

    /// |value|.
    pub fn abs(self) -> Self {
        if self.high < 0.0 || (self.high == 0.0 && self.low < 0.0) { self.scaled(-1.0) } else { self }
    }

    /// A whole power.
    pub fn power(self, exponent: usize) -> Self {
        (0..exponent).fold(Self::from(1.0), |product, _| product.times(self))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doubled_digits_keep_what_f64_drops() {
        let third = Double::ratio(1.0, 3.0);
        let one = third.plus(third).plus(third);
        assert!((one.high - 1.0 + one.low).abs() < 1e-31);
        let square = third.times(third).minus(Double::ratio(1.0, 9.0));
        assert!(square.value().abs() < 1e-31);
        assert_eq!(Double::product(1.0 + f64::EPSILON, 1.0 - f64::EPSILON).low, -f64::EPSILON * f64::EPSILON);
    }
}

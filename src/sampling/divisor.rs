//! Division by one number again and again.

/// A divisor made ready: quotients by multiplication, so that loops over lanes become vector instructions, which have no
/// division of integers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Divisor {
    value: u64,
    reciprocal: f64,
}

impl Divisor {
    /// Divides by `value`, from 1 to 2³².
    pub fn new(value: u64) -> Self {
        assert!((1..=1 << 32).contains(&value), "a divisor from 1 to 2³², not {value}");
        Self { value, reciprocal: 1.0 / value as f64 }
    }

    /// The divisor.
    #[inline(always)]
    pub fn value(self) -> u64 {
        self.value
    }

    /// ⌊n / divisor⌋, exactly, for every n whose quotient is at most 2⁴⁸.
    ///
    /// Conversion, reciprocal and product each round once: the quotient in f64 errs by less than 4·2⁻⁵³ of itself, at most 1/8. The sum
    /// with 2⁵² is a whole number, in whose bits the nearest one to the quotient stands: the right one or the next, which the
    /// remainder tells. (A conversion to an integer would ask each lane by itself whether it fits.)
    #[inline(always)]
    pub fn quotient(self, n: u64) -> u64 {
        const WHOLE: f64 = (1u64 << 52) as f64;
        let guess = (n as f64 * self.reciprocal + WHOLE).to_bits().wrapping_sub(WHOLE.to_bits());
        // Below zero where the guess is one too large; all modulo 2⁶⁴.
        let remainder = n.wrapping_sub(guess.wrapping_mul(self.value)) as i64;
        guess.wrapping_sub(u64::from(remainder < 0))
    }

    /// n mod divisor, exactly, where [`Self::quotient`] is.
    #[inline(always)]
    pub fn remainder(self, n: u64) -> u64 {
        n - self.quotient(n) * self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::hash::bits64;

    #[test]
    fn quotients_are_exact_at_multiples_and_beside_them() {
        for value in (1..300).chain([1 << 12, 4095, 4097, (1 << 24) - 1, 1 << 24, 43_046_721, (1 << 32) - 1, 1 << 32]) {
            let divisor = Divisor::new(value);
            let most = value.saturating_mul(1 << 48);
            let some = (0..200).map(|i| bits64(value, i) % most);
            let multiples = (0..200).map(|i| bits64(value, i) % (most / value) * value);
            for n in some.chain(multiples).chain([0, 1, most - 1, most / 2]) {
                for n in [n.saturating_sub(1), n, (n + 1).min(most - 1)] {
                    assert_eq!(divisor.quotient(n), n / value, "{n} / {value}");
                    assert_eq!(divisor.remainder(n), n % value, "{n} mod {value}");
                }
            }
        }
    }
}

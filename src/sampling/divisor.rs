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
    /// Conversion, reciprocal and product each round once: the quotient in f64 errs by less than 4·2⁻⁵³ of itself, far below 1, so
    /// its whole part is wrong by 1 at most, which the remainder tells.
    #[inline(always)]
    pub fn quotient(self, n: u64) -> u64 {
        let guess = (n as f64 * self.reciprocal) as u64;
        // Below zero where the guess is one too large; all modulo 2⁶⁴.
        let remainder = n.wrapping_sub(guess.wrapping_mul(self.value)) as i64;
        let down = u64::from(remainder < 0);
        let up = u64::from(remainder >= self.value as i64);
        guess + up - down
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

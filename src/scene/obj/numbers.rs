//! Numbers as nearly all meshes write them, read in one look at each byte; what is written otherwise is left to slower ways.

/// The word as `f32`, rounded to the nearest; may be infinite or NaN.
pub(super) fn number(word: &[u8]) -> Option<f32> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A whole number of at most 18 digits, with sign.
pub(super) fn index(word: &[u8]) -> Option<i64> {
    let digits = word.strip_prefix(b"-").unwrap_or(word);
    if digits.is_empty() || digits.len() > 18 {
        return None;
    }
    let mut value = 0;
    for &b in digits {
        if !b.is_ascii_digit() {
            return None;
        }
        value = 10 * value + i64::from(b - b'0');
    }
    Some(if digits.len() < word.len() { -value } else { value })
}

/// Powers of ten that `f64` holds exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// Count of the numbers of a text, and the first three of them, where they are nothing but digits, points and signs, too
/// short to overflow `f32`; `None` where they need a closer look. Nearly all lines of a mesh end here.
#[inline]
pub(super) fn plain_numbers(text: &[u8]) -> Option<(usize, [f32; 3])> {
    let mut found = [0.0; 3];
    let mut n = 0;
    let mut at = 0;
    loop {
        while matches!(text.get(at), Some(b' ' | b'\t')) {
            at += 1;
        }
        let start = at;
        at += usize::from(text.get(at) == Some(&b'-'));
        let first = at;
        // Wrapped where it is too long, which the count of digits tells.
        let mut value = 0u64;
        while let Some(digit) = text.get(at).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10) {
            value = value.wrapping_mul(10).wrapping_add(u64::from(digit));
            at += 1;
        }
        let mut digits = at - first;
        let mut places = 0;
        if text.get(at) == Some(&b'.') {
            let first = at + 1;
            at += 1;
            while let Some(digit) = text.get(at).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10) {
                value = value.wrapping_mul(10).wrapping_add(u64::from(digit));
                at += 1;
            }
            places = at - first;
            digits += places;
        }
        if at == start && at == text.len() {
            return Some((n, found));
        }
        if !(1..=30).contains(&digits) || !matches!(text.get(at), None | Some(b' ' | b'\t')) {
            return None;
        }
        if n < 3 {
            let exact = if digits <= 19 { decimal(value, places) } else { None };
            let sign = if text[start] == b'-' { -1.0 } else { 1.0 };
            found[n] = match exact {
                Some(value) => sign * value,
                None => number(&text[start..at])?,
            };
        }
        n += 1;
    }
}

/// value / 10^places to the nearest `f32`, where a quotient in `f64` settles it.
///
/// Value and power are exact, so the quotient is within half its last place. That rounds to the same `f32` as the true one, unless it
/// falls on the middle between two, whose 29 last bits are 1 and zeros.
#[inline]
fn decimal(value: u64, places: usize) -> Option<f32> {
    if value >= 1 << 53 {
        return None;
    }
    let quotient = value as f64 / POWERS.get(places)?;
    let is_middle = quotient.to_bits() & ((1 << 29) - 1) == 1 << 28;
    // The least but 0 is 10⁻²², the largest 2⁵³: normal numbers in f32.
    if is_middle { None } else { Some(quotient as f32) }
}

#[cfg(test)]
mod tests {
    use super::super::tests::run;
    use super::super::text::words;
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_quick_look_at_numbers_agrees_with_working_them_out() {
        let word = prop_oneof![
            "[-.0-9]{0,6}",
            "-?[0-9]{25,45}",
            "-?[0-9]{1,4}\\.[0-9]{0,6}",
            "-?[0-9]{0,3}\\.[0-9]{4,24}",
            "[+eE0-9]{1,4}",
            "nan|inf|#1"
        ];
        run(&prop::collection::vec((word, "[ \t]{1,2}"), 0..5), |words| {
            let text: String = words.iter().map(|(word, blank)| format!("{word}{blank}")).collect();
            let slow: Vec<Option<u32>> = text
                .split_whitespace()
                .map(|w| w.parse().ok().filter(|x: &f32| x.is_finite()).map(f32::to_bits))
                .collect();
            if let Some((n, values)) = plain_numbers(text.as_bytes()) {
                assert_eq!(n, slow.len(), "{text:?}");
                let values = values.map(|x| Some(x.to_bits()));
                assert!(values.iter().zip(&slow).all(|(a, b)| a == b) && !slow.contains(&None), "{text:?}");
            }
        });
        assert_eq!(plain_numbers(b" -1.5 0.25\t100 -7."), Some((4, [-1.5, 0.25, 100.0])));
        assert_eq!(plain_numbers(b""), Some((0, [0.0; 3])));
        assert_eq!(plain_numbers(b" -0 -"), None);
    }

    /// Decimals of and beside the middle between two neighbouring `f32`, where rounding twice would go wrong.
    #[test]
    fn numbers_beside_the_middle_of_two_floats_round_once() {
        for mantissa in (1u64 << 24..(1 << 24) + 400).chain((1 << 25) - 400..1 << 25) {
            for shift in [0u32, 1, 5, 20, 24, 25, 27] {
                // mantissa · 2^-shift: with an odd mantissa of 25 bits a middle, written out in full.
                let exact = format!("{:.30}", mantissa as f64 / f64::from(1u32 << shift));
                let exact = exact.trim_end_matches('0');
                for text in [exact.to_owned(), format!("{exact}1"), format!("{exact}0000000001"), format!("-{exact}")] {
                    let found = plain_numbers(text.as_bytes());
                    let expected: f32 = text.parse().unwrap();
                    if let Some((1, [x, ..])) = found {
                        assert_eq!(x.to_bits(), expected.to_bits(), "{text}");
                    }
                    // Short ones are settled here.
                    assert!(found.is_some() || text.len() > 30, "{text}");
                }
            }
        }
    }

    #[test]
    fn the_index_reader_agrees_with_the_standard_one() {
        run(&"-?[0-9x]{0,18}", |word| assert_eq!(index(word.as_bytes()), word.parse().ok(), "{word:?}"));
        assert_eq!(words(b" 1\t2 ").filter_map(index).sum::<i64>(), 3);
    }
}

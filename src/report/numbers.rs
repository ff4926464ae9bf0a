//! Numbers as a report prints them: three significant digits, intervals as [low, high], singular and plural.

use crate::stats::Estimate;

/// `x` to three significant digits; powers of ten where plain digits would be long. The sign is a minus, not a hyphen.
pub fn short(x: f64) -> String {
    if x.is_infinite() {
        return if x > 0.0 { "∞".to_owned() } else { "−∞".to_owned() };
    }
    if !x.is_finite() {
        return "not a number".to_owned();
    }
    if x == 0.0 {
        return "0".to_owned();
    }
    // Decimal text rounds exactly, so the exponent is that of the rounded number: 0.9999 is 1.00.
    let scientific = format!("{:.2e}", x.abs());
    let (digits, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let sign = if x < 0.0 { "−" } else { "" };
    let text = match exponent {
        -3..=2 => format!("{:.*}", (2 - exponent) as usize, x.abs()),
        3..=5 => format!("{}", (digits_value(digits) * libm::pow(10.0, f64::from(exponent))).round()),
        _ => format!("{digits}e{exponent}").replace('-', "−"),
    };
    format!("{sign}{text}")
}

fn digits_value(digits: &str) -> f64 {
    digits.parse().unwrap_or(0.0)
}

/// A slope or correlation: two decimals, with a sign.
pub fn signed(x: f64) -> String {
    let text = format!("{x:+.2}").replace('-', "−");
    // A rounded nothing has no side.
    if text == "−0.00" || text == "+0.00" { "0.00".to_owned() } else { text }
}

/// A slope: three decimals, with a sign, since intervals of slopes are often narrower than a hundredth.
pub fn slope_text(x: f64) -> String {
    let text = format!("{x:+.3}").replace('-', "−");
    if text == "−0.000" || text == "+0.000" { "0.000".to_owned() } else { text }
}

/// `[low, high]`.
pub fn interval([low, high]: [f64; 2], text: impl Fn(f64) -> String) -> String {
    format!("[{}, {}]", text(low), text(high))
}

/// `value [low, high]`; `value (exact)` for an interval of no width and `value (no interval)` where there is none.
pub fn with_interval(e: &Estimate, text: impl Fn(f64) -> String) -> String {
    match e.ci95 {
        Some([low, high]) if low == high => format!("{} (exact)", text(e.value)),
        Some(ends) => format!("{} {}", text(e.value), interval(ends, text)),
        None => format!("{} (no interval)", text(e.value)),
    }
}

/// [`with_interval`] of [`short`] numbers.
pub fn estimate(e: &Estimate) -> String {
    with_interval(e, short)
}

/// [`with_interval`] of [`signed`] numbers.
pub fn signed_estimate(e: &Estimate) -> String {
    with_interval(e, signed)
}

/// A share as a percentage of two significant digits, `12 %`, `0.031 %`; 10 % and above without decimals.
pub fn percent(share: f64) -> String {
    let value = 100.0 * share;
    if value.abs() >= 9.95 {
        return format!("{} %", short(value.round()).trim_end_matches(".0"));
    }
    let scientific = format!("{:.1e}", value.abs());
    let exponent: i32 = scientific.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
    let sign = if value < 0.0 { "−" } else { "" };
    if value == 0.0 { "0 %".to_owned() } else { format!("{sign}{:.*} %", (1 - exponent).max(0) as usize, value.abs()) }
}

/// A p-value: two significant digits from 0.001 on, below that only that it is below; `–` where there is none.
pub fn p_value(p: Option<f64>) -> String {
    match p {
        None => "–".to_owned(),
        Some(p) if p < 0.001 => "< 0.001".to_owned(),
        Some(p) if p < 0.095 => format!("{p:.*}", if p < 0.0095 { 4 } else { 3 }),
        Some(p) => format!("{p:.2}"),
    }
}

/// `p = 0.023` or `p < 0.001`, for sentences.
pub fn p_words(p: Option<f64>) -> String {
    let text = p_value(p);
    if text.starts_with('<') { format!("p {text}") } else { format!("p = {text}") }
}

/// `1 replicate`, `8 replicates`.
pub fn counted(n: usize, singular: &str, plural: &str) -> String {
    format!("{n} {}", if n == 1 { singular } else { plural })
}

/// `a`, `a and b`, `a, b and c`.
pub fn listed<S: AsRef<str>>(items: &[S]) -> String {
    match items {
        [] => String::new(),
        [one] => one.as_ref().to_owned(),
        [first @ .., last] => {
            format!("{} and {}", first.iter().map(S::as_ref).collect::<Vec<_>>().join(", "), last.as_ref())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_say_what_a_number_is() {
        let cases = [
            (0.0, "0"),
            (0.012_345, "0.0123"),
            (0.999_9, "1.00"),
            (9.996, "10.0"),
            (123.4, "123"),
            (1234.5, "1230"),
            (654_321.0, "654000"),
            (1.5e7, "1.50e7"),
            (-2.5e-5, "−2.50e−5"),
            (0.001, "0.00100"),
            (f64::INFINITY, "∞"),
            (f64::NAN, "not a number"),
        ];
        for (x, text) in cases {
            assert_eq!(short(x), text);
        }
    }

    #[test]
    fn intervals_tell_exact_from_unknown() {
        let e = |ci95| Estimate { value: 0.5, ci95 };
        assert_eq!(estimate(&e(Some([0.4, 0.6]))), "0.500 [0.400, 0.600]");
        assert_eq!(estimate(&e(Some([0.5, 0.5]))), "0.500 (exact)");
        assert_eq!(estimate(&e(None)), "0.500 (no interval)");
        assert_eq!((slope_text(-0.6651), slope_text(-0.0001)), ("−0.665".to_owned(), "0.000".to_owned()));
        assert_eq!(signed_estimate(&Estimate { value: -0.501, ci95: Some([-0.52, -0.001]) }), "−0.50 [−0.52, 0.00]");
    }

    #[test]
    fn p_values_claim_no_more_digits_than_they_have() {
        let cases = [(None, "–"), (Some(0.0), "< 0.001"), (Some(0.00123), "0.0012"), (Some(0.0234), "0.023")];
        for (p, text) in cases.into_iter().chain([(Some(0.5), "0.50"), (Some(1.0), "1.00")]) {
            assert_eq!(p_value(p), text);
        }
        assert_eq!((p_words(Some(1e-9)), p_words(Some(0.2))), ("p < 0.001".to_owned(), "p = 0.20".to_owned()));
    }

    #[test]
    fn shares_and_counts_read_as_words() {
        let cases =
            [(0.0, "0 %"), (0.5, "50 %"), (1.2, "120 %"), (0.099, "9.9 %"), (0.0123, "1.2 %"), (0.00031, "0.031 %")];
        for (share, text) in cases {
            assert_eq!(percent(share), text);
        }
        assert_eq!(counted(1, "row", "rows"), "1 row");
        assert_eq!(listed(&["a", "b", "c"]), "a, b and c");
    }
}

//! Numbers for readers: rounded to the digits that are known, with a proper minus sign, never
//! `NaN`.

use crate::axis::superscript;

/// The text in place of a missing number.
const ABSENT: &str = "not determined";

/// The exponent of ten of a number after rounding to a number of significant digits: that of 9.99
/// is 1 with two digits.
fn exponent(value: f64, significant: usize) -> i32 {
    let text = format!("{value:.*e}", significant.saturating_sub(1));
    text.rsplit('e').next().and_then(|e| e.parse().ok()).unwrap_or(0)
}

/// A number with the given number of decimals and a proper minus sign, but no minus sign before a
/// zero.
fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(zero) if zero.chars().all(|c| matches!(c, '0' | '.')) => zero.to_owned(),
        Some(rest) => format!("−{rest}"),
        None => text,
    }
}

/// Decimals that show two significant digits of an error.
fn decimals(error: f64) -> usize {
    (1 - exponent(error, 2)).clamp(0, 15) as usize
}

/// Whether numbers of this exponent are written without a power of ten.
fn is_plain(exponent: i32) -> bool {
    (-4..6).contains(&exponent)
}

/// A number to the given number of significant digits. All digits before the point are kept, and a
/// number that is not finite is *not determined*.
///
/// ```
/// use twinlag_report::rounded;
///
/// assert_eq!(rounded(0.023_84, 3), "0.0238");
/// assert_eq!(rounded(-1234.5, 2), "−1234");
/// assert_eq!(rounded(1.25e-7, 2), "1.2×10⁻⁷");
/// assert_eq!(rounded(f64::NAN, 3), "not determined");
/// ```
pub fn rounded(value: f64, significant: usize) -> String {
    if !value.is_finite() {
        return ABSENT.into();
    }
    let significant = significant.clamp(1, 17);
    let exponent = exponent(value, significant);
    if value == 0.0 {
        "0".into()
    } else if is_plain(exponent) {
        fixed(value, (significant as i32 - 1 - exponent).max(0) as usize)
    } else {
        let text = format!("{value:.*e}", significant - 1);
        let mantissa = text.split('e').next().unwrap_or_default().replace('-', "−");
        format!("{mantissa}×10{}", superscript(exponent))
    }
}

/// A number and its standard error, to two digits of the error; without an error, to four digits of
/// its own.
///
/// ```
/// use twinlag_report::plus_minus;
///
/// assert_eq!(plus_minus(0.023_841_7, Some(0.000_123)), "0.02384 ± 0.00012");
/// assert_eq!(plus_minus(2.345_67e-7, Some(1.2e-9)), "(2.346 ± 0.012)×10⁻⁷");
/// assert_eq!(plus_minus(0.023_841_7, None), "0.02384");
/// ```
pub fn plus_minus(value: f64, standard_error: Option<f64>) -> String {
    let Some(error) = standard_error.filter(|e| e.is_finite() && *e > 0.0 && value.is_finite()) else {
        return rounded(value, 4);
    };
    let largest = exponent(value.abs().max(error), 2);
    // Two digits of an error far below the number would be digits that a double does not have.
    if is_plain(largest) && exponent(error, 2) > -15 {
        let decimals = decimals(error);
        return format!("{} ± {}", fixed(value, decimals), fixed(error, decimals));
    }
    let unit = 10_f64.powi(largest);
    let decimals = decimals(error / unit);
    format!("({} ± {})×10{}", fixed(value / unit, decimals), fixed(error / unit, decimals), superscript(largest))
}

/// A 95 % interval, to the digits that [`plus_minus`] would show of a number with that interval.
///
/// ```
/// assert_eq!(twinlag_report::between([0.023_612_3, 0.024_101]), "0.02361 to 0.02410");
/// ```
pub fn between([low, high]: [f64; 2]) -> String {
    let error = (high - low).abs() / 4.0;
    let largest = exponent(low.abs().max(high.abs()), 2);
    if !error.is_finite() || error == 0.0 || !is_plain(largest) {
        return format!("{} to {}", rounded(low, 4), rounded(high, 4));
    }
    let decimals = decimals(error);
    format!("{} to {}", fixed(low, decimals), fixed(high, decimals))
}

/// A probability to two digits; one that a double cannot distinguish from zero is *below* a power
/// of ten.
///
/// ```
/// use twinlag_report::probability;
///
/// assert_eq!(probability(0.3217), "0.32");
/// assert_eq!(probability(4.4e-9), "4.4×10⁻⁹");
/// assert_eq!(probability(0.0), "below 10⁻³⁰⁰");
/// ```
pub fn probability(p: f64) -> String {
    if p.is_finite() && p < 1e-300 {
        "below 10⁻³⁰⁰".into()
    } else if p > 0.995 {
        fixed(p, 2)
    } else if p < 1e-3 && is_plain(exponent(p, 2)) {
        // A row of zeros is harder to read than a power of ten.
        let exponent = exponent(p, 2);
        format!("{}×10{}", fixed(p / 10_f64.powi(exponent), 1), superscript(exponent))
    } else {
        rounded(p, 2)
    }
}

#[cfg(test)]
mod tests {
    use super::{between, plus_minus, probability, rounded};

    #[test]
    fn rounding_up_to_the_next_power_of_ten_keeps_the_digits() {
        for (got, want) in [
            (rounded(9.996, 3), "10.0"),
            (rounded(999_999.6, 3), "1.00×10⁶"),
            (rounded(0.000_099_99, 2), "0.00010"),
            (rounded(0.0, 3), "0"),
            (rounded(-0.0, 3), "0"),
            (rounded(1e300, 2), "1.0×10³⁰⁰"),
            (plus_minus(-0.000_4, Some(0.12)), "0.00 ± 0.12"),
            (plus_minus(1.0, Some(0.0996)), "1.00 ± 0.10"),
            (plus_minus(1234.5, Some(250.3)), "1234 ± 250"),
            (plus_minus(f64::NAN, Some(1.0)), "not determined"),
            (plus_minus(1.5, Some(f64::NAN)), "1.500"),
            (plus_minus(0.0, Some(3e-7)), "(0.0 ± 3.0)×10⁻⁷"),
            (between([f64::NAN, 1.0]), "not determined to 1.000"),
            (between([-1.0, 1.0]), "−1.00 to 1.00"),
            (probability(f64::NAN), "not determined"),
            (probability(1.0), "1.00"),
            (probability(0.000_96), "9.6×10⁻⁴"),
            (probability(1e-250), "1.0×10⁻²⁵⁰"),
        ] {
            assert_eq!(got, want);
        }
    }
}

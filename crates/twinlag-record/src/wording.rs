//! Numbers and counts as messages print them.

use std::fmt::{self, Display};

/// A count and what is counted, in the singular where it is one: `1 row`, `2 rows`.
pub(crate) struct Counted(pub(crate) usize, pub(crate) &'static str);

impl Display for Counted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(count, what) = self;
        write!(f, "{count} {what}{}", if *count == 1 { "" } else { "s" })
    }
}

/// Things that a message lists before it says how many more there are.
const MAX_LISTED: usize = 40;

/// `count` things, each by its title: the first of them, and how many more there are.
pub(crate) fn enumerated(count: usize, title: impl FnMut(usize) -> String) -> String {
    let mut parts: Vec<String> = (0..count.min(MAX_LISTED)).map(title).collect();
    if count > MAX_LISTED {
        parts.push(format!("and {} more", count - MAX_LISTED));
    }
    parts.join(", ")
}

/// A number with the fewest digits that give it again, and with an exponent where it would be all
/// zeros: `1e37`.
pub(crate) fn plain(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || !size.is_finite() || (1e-6..1e15).contains(&size) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// A number with at most six significant digits if these are it to a part in 10⁹, else with at most
/// nine.
pub(crate) fn brief(value: f64) -> String {
    let rounded = |digits: usize| format!("{value:.0$e}", digits - 1).parse().unwrap_or(value);
    let six: f64 = rounded(6);
    plain(if (six - value).abs() <= 1e-9 * value.abs() { six } else { rounded(9) })
}

/// A number to three significant digits.
pub(crate) fn three(value: f64) -> String {
    plain(format!("{value:.2e}").parse().unwrap_or(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_counted_in_the_singular() {
        for (count, want) in [(0, "0 rows"), (1, "1 row"), (2, "2 rows")] {
            assert_eq!(Counted(count, "row").to_string(), want);
        }
    }

    #[test]
    fn only_numbers_that_would_be_all_zeros_have_an_exponent() {
        for (value, want) in [
            (1e37, "1e37"),
            (-2.5e300, "-2.5e300"),
            (1e-9, "1e-9"),
            (9999.0, "9999"),
            (-273.2, "-273.2"),
            (1_700_000_000.25, "1700000000.25"),
            (0.0, "0"),
            (0.002, "0.002"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(plain(value), want);
        }
    }

    /// 1/24 to six digits is wrong by 8e-7 of it.
    #[test]
    fn six_digits_are_printed_where_they_are_enough_and_nine_where_not() {
        let cases = [
            (0.002 + 1e-16, "0.002"),
            (0.6 + 1e-12, "0.6"),
            (1.0 / 24.0, "0.0416666667"),
            (3.859_999_123_4, "3.85999912"),
        ];
        for (value, want) in cases {
            assert_eq!(brief(value), want);
        }
    }
}

//! What one cell says: a number, a word for a missing one, or something else.

use crate::sign::Decimal;

/// The content of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Value {
    Number(f64),
    Missing,
    Other,
}

/// Reads a trimmed cell.
pub(crate) fn read(cell: &str, decimal: Decimal) -> Value {
    match parse(cell, decimal) {
        Some(number) => Value::Number(number),
        None if is_missing(cell) => Value::Missing,
        None => Value::Other,
    }
}

/// A decimal number with optional exponent; no thousands separators, no words.
pub(crate) fn parse(cell: &str, decimal: Decimal) -> Option<f64> {
    let sign = match decimal {
        Decimal::Point => b'.',
        Decimal::Comma => b',',
    };
    let plain = |&byte: &u8| byte.is_ascii_digit() || matches!(byte, b'+' | b'-' | b'e' | b'E') || byte == sign;
    if cell.is_empty() || !cell.bytes().all(|byte| plain(&byte)) {
        return None;
    }
    if decimal == Decimal::Point || !cell.contains(',') {
        return cell.parse().ok();
    }
    let mut buffer = [0; 64];
    let buffer = buffer.get_mut(..cell.len())?;
    for (to, from) in buffer.iter_mut().zip(cell.bytes()) {
        *to = if from == b',' { b'.' } else { from };
    }
    std::str::from_utf8(buffer).ok()?.parse().ok()
}

/// Empty, NaN, NA, N/A, null, inf, OL, OPEN, Over, overload, overrange, underrange, overflow, or two and more dashes, in any case and with any
/// sign.
pub(crate) fn is_missing(cell: &str) -> bool {
    const WORDS: [&str; 13] = [
        "nan",
        "na",
        "n/a",
        "null",
        "inf",
        "infinity",
        "ol",
        "open",
        "over",
        "overload",
        "overrange",
        "underrange",
        "overflow",
    ];
    if cell.is_empty() || (cell.len() > 1 && cell.bytes().all(|byte| byte == b'-')) {
        return true;
    }
    let word = cell.trim_start_matches(['+', '-']);
    word.len() <= 10 && WORDS.iter().any(|known| word.eq_ignore_ascii_case(known))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_with_their_decimal_sign_only() {
        let cases = [
            ("-1.5e-3", Decimal::Point, Value::Number(-1.5e-3)),
            (".5", Decimal::Point, Value::Number(0.5)),
            ("+20", Decimal::Comma, Value::Number(20.0)),
            ("20,25", Decimal::Comma, Value::Number(20.25)),
            ("20,25", Decimal::Point, Value::Other),
            ("20.25", Decimal::Comma, Value::Other),
            ("1.234,5", Decimal::Comma, Value::Other),
            ("20.1C", Decimal::Point, Value::Other),
            ("0x1F", Decimal::Point, Value::Other),
            ("1e", Decimal::Point, Value::Other),
            ("-", Decimal::Point, Value::Other),
        ];
        for (cell, decimal, want) in cases {
            assert_eq!(read(cell, decimal), want, "{cell}");
        }
    }

    #[test]
    fn the_words_for_missing_are_missing_and_no_others() {
        for word in [
            "",
            "NaN",
            "nan",
            "NA",
            "n/a",
            "null",
            "---",
            "-----",
            "OL",
            "-OL",
            "OVERLOAD",
            "Underrange",
            "OPEN",
            "Over",
            "inf",
            "-Inf",
        ] {
            assert_eq!(read(word, Decimal::Point), Value::Missing, "{word}");
        }
        for word in ["abc", "-", "x", "error", "open?"] {
            assert_eq!(read(word, Decimal::Point), Value::Other, "{word}");
        }
    }
}

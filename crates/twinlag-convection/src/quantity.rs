//! Numbers with units, as they stand in texts.

use crate::error::ConvectionError;

/// Units with what a number in them is worth.
pub(crate) type Units = &'static [(&'static str, f64)];

/// The positive number `part` of `text`, in one of `units`, which `expected` names.
pub(crate) fn positive(text: &str, part: &str, units: Units, expected: &'static str) -> Result<f64, ConvectionError> {
    let part = part.trim();
    let wrong = || ConvectionError::Text { text: text.to_owned(), expected, got: part.to_owned() };
    // The longest unit that it ends with: a metre ends a millimetre too.
    let fits = units.iter().filter_map(|(unit, worth)| Some((part.strip_suffix(unit)?, unit.len(), worth)));
    let (number, _, worth) = fits.max_by_key(|(_, length, _)| *length).ok_or_else(wrong)?;
    let value = number.trim().parse::<f64>().map_err(|_| wrong())? * worth;
    if value.is_finite() && value > 0.0 { Ok(value) } else { Err(wrong()) }
}

/// A number as it was meant, where a unit has left dust in its last digits.
pub(crate) fn four_digits(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

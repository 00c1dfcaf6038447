//! Checks of single numbers, which put the place in the rig file into the error.

use crate::SignalError;
use crate::effects::ZERO_CELSIUS_K;

/// `within.name`, as a rig file's reader would write it.
pub(crate) fn path(within: &str, name: &str) -> String {
    format!("{within}.{name}")
}

pub(crate) fn finite(within: &str, name: &str, value: f64) -> Result<(), SignalError> {
    if value.is_finite() { Ok(()) } else { Err(SignalError::NotFinite { field: path(within, name), value }) }
}

/// `value` is a temperature in °C that something may have.
pub(crate) fn above_absolute_zero(within: &str, name: &str, value: f64) -> Result<(), SignalError> {
    if value.is_finite() && value > -ZERO_CELSIUS_K {
        Ok(())
    } else {
        Err(SignalError::NotAboveAbsoluteZero { field: path(within, name), value })
    }
}

pub(crate) fn positive(within: &str, name: &str, value: f64) -> Result<(), SignalError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(SignalError::NotPositive { field: path(within, name), value })
    }
}

pub(crate) fn not_negative(within: &str, name: &str, value: f64) -> Result<(), SignalError> {
    if value.is_finite() && value >= 0.0 {
        Ok(())
    } else {
        Err(SignalError::Negative { field: path(within, name), value })
    }
}

/// `value < limit`, where `limit` is the field `other` of the same table. Both are finite already.
pub(crate) fn below(within: &str, name: &str, value: f64, other: &str, limit: f64) -> Result<(), SignalError> {
    if value < limit {
        Ok(())
    } else {
        Err(SignalError::NotBelow { field: path(within, name), value, other: path(within, other), limit })
    }
}

/// `low ≤ value ≤ high`.
pub(crate) fn between(within: &str, name: &str, value: f64, low: f64, high: f64) -> Result<(), SignalError> {
    if (low..=high).contains(&value) {
        Ok(())
    } else {
        Err(SignalError::OutOfRange { field: path(within, name), value, low, high })
    }
}

pub(crate) fn at_least(within: &str, name: &str, value: usize, least: usize) -> Result<(), SignalError> {
    if value >= least { Ok(()) } else { Err(SignalError::TooFew { field: path(within, name), value, least }) }
}

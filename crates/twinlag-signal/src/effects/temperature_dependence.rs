//! A time constant that depends on the temperature of its own body: `τ(T) = τ (T_K/R_K)^p`,
//! `T_K` and `R_K` the body's and a reference temperature in kelvin. It acts on the first lag.

use serde::{Deserialize, Serialize};

use super::ZERO_CELSIUS_K;
use crate::SignalError;
use crate::check::{above_absolute_zero, finite};

/// A power law of the body's own absolute temperature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct TemperatureDependence {
    /// `p` in `τ(T) = τ (T_K/R_K)^p`; may be negative.
    pub exponent: f64,
    /// Reference temperature `R`, °C, at which the time constant is the sensor's.
    pub reference_c: f64,
}

impl TemperatureDependence {
    /// `τ(T) = τ (T_K/R_K)^exponent`.
    pub fn new(exponent: f64, reference_c: f64) -> Self {
        Self { exponent, reference_c }
    }

    /// Factor on the time constant at `body_c`.
    pub(crate) fn factor(&self, body_c: f64) -> f64 {
        ((body_c + ZERO_CELSIUS_K) / (self.reference_c + ZERO_CELSIUS_K)).powf(self.exponent)
    }

    pub(crate) fn check(&self, within: &str) -> Result<(), SignalError> {
        finite(within, "exponent", self.exponent)?;
        above_absolute_zero(within, "reference_c", self.reference_c)
    }
}

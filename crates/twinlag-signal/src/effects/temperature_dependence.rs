//! A time constant that depends on temperature: `τ = τ₀ (H/R)^p` with a reference temperature `R` in kelvin. `H = (1 − m) T + m x`
//! lies between the temperature `T` of its own body and that of the gas, `x`: `m = 0` is the body, `m = ½` the film. It acts on
//! the first lag.

use serde::{Deserialize, Serialize};

use super::ZERO_CELSIUS_K;
use crate::SignalError;
use crate::check::{above_absolute_zero, between, finite};

/// A power law of an absolute temperature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct TemperatureDependence {
    /// `p` in `τ(T) = τ (T_K/R_K)^p`; may be negative.
    pub exponent: f64,
    /// Reference temperature `R`, °C, at which the time constant is the sensor's.
    pub reference_c: f64,
    /// Share `m` of the gas temperature, from 0 to 1; 0 if left out.
    #[serde(default)]
    pub gas_share: f64,
}

impl TemperatureDependence {
    /// `τ(T) = τ (T_K/R_K)^exponent`, with the body's own temperature.
    pub fn new(exponent: f64, reference_c: f64) -> Self {
        Self { exponent, reference_c, gas_share: 0.0 }
    }

    /// `τ(T) = τ (H/R_K)^exponent` with the temperature `H` of the film, halfway between body and gas.
    pub fn of_film(exponent: f64, reference_c: f64) -> Self {
        Self { gas_share: 0.5, ..Self::new(exponent, reference_c) }
    }

    /// Factor on the time constant of a body at `body_c` in gas of `gas_c`.
    pub(crate) fn factor(&self, body_c: f64, gas_c: f64) -> f64 {
        let between_c = body_c + self.gas_share * (gas_c - body_c);
        ((between_c + ZERO_CELSIUS_K) / (self.reference_c + ZERO_CELSIUS_K)).powf(self.exponent)
    }

    pub(crate) fn check(&self, within: &str) -> Result<(), SignalError> {
        finite(within, "exponent", self.exponent)?;
        between(within, "gas_share", self.gas_share, 0.0, 1.0)?;
        above_absolute_zero(within, "reference_c", self.reference_c)
    }
}

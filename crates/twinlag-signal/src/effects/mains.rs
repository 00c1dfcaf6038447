//! Mains pick-up: a sine `A sin(2π f t + φ)` on the reading, time zero at the record's first
//! sample.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use crate::SignalError;
use crate::check::{finite, not_negative, positive};

/// A sine added to the reading. Give several for the harmonics.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Mains {
    /// Frequency, Hz. One above half the sampling rate shows at its alias, as in a logger without a
    /// filter.
    pub frequency_hz: f64,
    /// Amplitude, K (half of peak to peak); 0 is allowed.
    pub amplitude_k: f64,
    /// Phase at the record's first sample, rad; 0 if left out.
    #[serde(default)]
    pub phase_rad: f64,
}

impl Mains {
    /// `amplitude_k · sin(2π · frequency_hz · t + phase_rad)`.
    pub fn new(frequency_hz: f64, amplitude_k: f64, phase_rad: f64) -> Self {
        Self { frequency_hz, amplitude_k, phase_rad }
    }

    /// At a time after the first sample, K.
    pub(crate) fn at_k(&self, time_s: f64) -> f64 {
        self.amplitude_k * (TAU * self.frequency_hz * time_s + self.phase_rad).sin()
    }

    pub(crate) fn check(&self, within: &str) -> Result<(), SignalError> {
        positive(within, "frequency_hz", self.frequency_hz)?;
        not_negative(within, "amplitude_k", self.amplitude_k)?;
        finite(within, "phase_rad", self.phase_rad)
    }
}

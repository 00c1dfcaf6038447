//! Sines: `A sin(2π f t + φ)`, time zero at the record's first sample. Exact at every grid point.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::Resolution;
use crate::SignalError;
use crate::check::{at_least, finite, positive};
use crate::grid::Grid;

/// A sine: `amplitude_k · sin(2π · frequency_hz · t + phase_rad)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tone {
    /// Amplitude, K (half of peak to peak).
    pub amplitude_k: f64,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Phase at the record's first sample, rad; 0 if left out.
    #[serde(default)]
    pub phase_rad: f64,
}

/// A sum of sines.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MultiTone {
    /// The sines, at least one.
    pub tones: Vec<Tone>,
}

impl Tone {
    fn at_k(&self, time_s: f64) -> f64 {
        self.amplitude_k * (TAU * self.frequency_hz * time_s + self.phase_rad).sin()
    }

    pub(super) fn values_k(&self, grid: Grid) -> Vec<f64> {
        grid.times_s().map(|t| self.at_k(t)).collect()
    }

    pub(super) fn check(&self, within: &str, resolution: Resolution) -> Result<(), SignalError> {
        positive(within, "amplitude_k", self.amplitude_k)?;
        positive(within, "frequency_hz", self.frequency_hz)?;
        finite(within, "phase_rad", self.phase_rad)?;
        resolution.check(within, "frequency_hz", self.frequency_hz, self.frequency_hz)
    }
}

impl MultiTone {
    pub(super) fn values_k(&self, grid: Grid) -> Vec<f64> {
        grid.times_s().map(|t| self.tones.iter().map(|tone| tone.at_k(t)).sum()).collect()
    }

    pub(super) fn check(&self, within: &str, resolution: Resolution) -> Result<(), SignalError> {
        at_least(within, "tones", self.tones.len(), 1)?;
        for (i, tone) in self.tones.iter().enumerate() {
            tone.check(&format!("{within}.tones[{i}]"), resolution)?;
        }
        Ok(())
    }
}

//! The flow past both sensors: it multiplies both first time constants with one function of time,
//! `τ_i(t) = τ_i m(t)`. Second lags and slow modes are bodies that the gas does not touch; they
//! keep theirs.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use crate::SignalError;
use crate::check::{finite, path, positive};
use crate::gas::smooth_step;

/// How both time constants vary. In a rig file `kind` is the variant's name: `sine` or `step`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Flow {
    /// Up and down about the sensor's own time constant.
    Sine(FlowSine),
    /// From one level to another.
    Step(FlowStep),
}

/// `m(t) = 1 + depth · sin(2π t/period_s + phase_rad)`, time zero at the record's first sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct FlowSine {
    /// Depth of the modulation, between −1 and 1 (both excluded).
    pub depth: f64,
    /// Period, s.
    pub period_s: f64,
    /// Phase at the record's first sample, rad; 0 if left out.
    #[serde(default)]
    pub phase_rad: f64,
}

/// `m(t) = 1 + (factor − 1) u`, where `u` goes from 0 to 1 as half a raised cosine from `at_s` to
/// `at_s + over_s`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct FlowStep {
    /// Final factor on the time constants.
    pub factor: f64,
    /// When the change begins, s after the record's first sample.
    pub at_s: f64,
    /// How long it takes, s.
    pub over_s: f64,
}

impl FlowSine {
    /// `1 + depth · sin(2π t/period_s + phase_rad)`.
    pub fn new(depth: f64, period_s: f64, phase_rad: f64) -> Self {
        Self { depth, period_s, phase_rad }
    }
}

impl FlowStep {
    /// From 1 to `factor`, smoothly, from `at_s` to `at_s + over_s`.
    pub fn new(factor: f64, at_s: f64, over_s: f64) -> Self {
        Self { factor, at_s, over_s }
    }
}

impl Flow {
    /// Factor on both time constants at a time after the first sample, `m(t)`.
    pub fn factor(&self, time_s: f64) -> f64 {
        match self {
            Self::Sine(sine) => 1.0 + sine.depth * (TAU * time_s / sine.period_s + sine.phase_rad).sin(),
            Self::Step(step) => {
                1.0 + (step.factor - 1.0) * smooth_step(((time_s - step.at_s) / step.over_s).clamp(0.0, 1.0))
            }
        }
    }

    /// Bounds of the factor: least and greatest.
    pub(crate) fn range(&self) -> [f64; 2] {
        match self {
            Self::Sine(sine) => [1.0 - sine.depth.abs(), 1.0 + sine.depth.abs()],
            Self::Step(step) => [step.factor.min(1.0), step.factor.max(1.0)],
        }
    }

    pub(crate) fn check(&self) -> Result<(), SignalError> {
        let within = "flow";
        match self {
            Self::Sine(sine) => {
                positive(within, "period_s", sine.period_s)?;
                finite(within, "phase_rad", sine.phase_rad)?;
                if sine.depth.abs() < 1.0 {
                    return Ok(());
                }
                let (field, value) = (path(within, "depth"), sine.depth);
                Err(SignalError::OutOfRange { field, value, low: -1.0, high: 1.0 })
            }
            Self::Step(step) => {
                positive(within, "factor", step.factor)?;
                finite(within, "at_s", step.at_s)?;
                positive(within, "over_s", step.over_s)
            }
        }
    }
}

//! What a sensor is: the `[[sensors]]` tables. How it moves is in `dynamics.rs`.

use serde::{Deserialize, Serialize};

use crate::check::{between, finite, path, positive};
use crate::{Adc, Noise, Record, SignalError};

/// One sensor and its channel: reading = ADC(gain · junction + offset + noise).
///
/// The junction follows the gas with one pole, or two in series, beside which a slow path may carry a part:
/// `H(s) = [(1 − φ) + φ/(1 + s τ_slow)] / ((1 + s τ)(1 + s τ₂))`.
///
/// Plain data, checked when a [`Rig`](crate::Rig) is made of it. Start from [`Sensor::new`]; fields may be added.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Sensor {
    /// Name of the channel.
    pub channel: String,
    /// Time constant τ of the first pole, s.
    pub time_constant_s: f64,
    /// Static gain, K/K, acting on the temperature in °C; 1 if left out.
    #[serde(default = "unit_gain")]
    pub gain: f64,
    /// Added to the reading, K; 0 if left out.
    #[serde(default)]
    pub offset_k: f64,
    /// Time constant τ₂ of a second pole in series, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second_time_constant_s: Option<f64>,
    /// A slow parallel path, such as conduction to the support.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slow_mode: Option<SlowMode>,
    /// Noise of the channel; none if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<Noise>,
    /// Rounding and saturation of the channel; none if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adc: Option<Adc>,
}

/// A part of the reading that arrives through a slower body: `y = (1 − φ) x + φ z`, `τ_slow dz/dt = x − z`, where `x`
/// is what the sensor would read without it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SlowMode {
    /// The slow path's share φ of the static response, 0 to 1.
    pub fraction: f64,
    /// Time constant `τ_slow` of the slow body, s.
    pub time_constant_s: f64,
}

fn unit_gain() -> f64 {
    1.0
}

impl Sensor {
    /// A first-order sensor with unit gain, no offset, no noise and no ADC.
    pub fn new(channel: impl Into<String>, time_constant_s: f64) -> Self {
        Self {
            channel: channel.into(),
            time_constant_s,
            gain: unit_gain(),
            offset_k: 0.0,
            second_time_constant_s: None,
            slow_mode: None,
            noise: None,
            adc: None,
        }
    }

    /// Every time constant with its field's name.
    fn time_constants_s(&self) -> impl Iterator<Item = (&'static str, f64)> {
        [
            Some(("time_constant_s", self.time_constant_s)),
            self.second_time_constant_s.map(|tau_s| ("second_time_constant_s", tau_s)),
            self.slow_mode.map(|mode| ("slow_mode.time_constant_s", mode.time_constant_s)),
        ]
        .into_iter()
        .flatten()
    }

    /// The longest of the sensor's time constants, s.
    pub(crate) fn slowest_s(&self) -> f64 {
        self.time_constants_s().map(|(_, tau_s)| tau_s).fold(0.0, f64::max)
    }

    pub(crate) fn check(&self, within: &str) -> Result<(), SignalError> {
        if self.channel.is_empty() {
            return Err(SignalError::EmptyName { field: path(within, "channel") });
        }
        for (name, tau_s) in self.time_constants_s() {
            positive(within, name, tau_s)?;
        }
        positive(within, "gain", self.gain)?;
        finite(within, "offset_k", self.offset_k)?;
        if let Some(mode) = self.slow_mode {
            between(within, "slow_mode.fraction", mode.fraction, 0.0, 1.0)?;
        }
        if let Some(noise) = &self.noise {
            noise.check(&path(within, "noise"))?;
        }
        if let Some(adc) = &self.adc {
            adc.check(&path(within, "adc"))?;
        }
        Ok(())
    }

    /// Refuses a step as long as a time constant, long before the rule's limit of stability at 2.785.
    pub(crate) fn check_step(&self, within: &str, record: &Record) -> Result<(), SignalError> {
        let step_s = record.step_s();
        for (name, tau_s) in self.time_constants_s() {
            if step_s >= tau_s {
                let oversampling = (record.sample_period_s / tau_s).floor() + 1.0;
                let field = path(within, name);
                return Err(SignalError::StepTooLong { field, time_constant_s: tau_s, step_s, oversampling });
            }
        }
        Ok(())
    }
}

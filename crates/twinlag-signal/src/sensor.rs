//! What a sensor is: the `[[sensors]]` tables. How it moves is in `dynamics.rs`.

use serde::{Deserialize, Serialize};

use crate::check::{between, finite, not_negative, path, positive};
use crate::surroundings::Surroundings;
use crate::{
    Adc, ClockSlip, ColouredNoise, Hysteresis, IntermittentContact, Mains, Noise, Radiation, Record, Replaced,
    SignalError, Spikes, TemperatureDependence,
};

/// One sensor and its channel: reading = ADC(calibration(junction) + disturbances + noise).
///
/// The junction follows the gas with one pole, or two in series, beside which a slow path may carry
/// a part: `H(s) = [(1 − φ) + φ/(1 + s τ_slow)] / ((1 + s τ)(1 + s τ₂))`. Radiation and a time
/// constant that depends on temperature or flow make the first pole nonlinear or time-varying. The
/// reading of a junction at `T` is `gain · T + offset + curvature · (T − about)²`.
///
/// What happens on the way from the gas to the record, in this order:
/// [`Mismatch`](crate::Mismatch), the poles and the slow path, hysteresis, calibration, delay,
/// clock slip and replacement, intermittent contact, drift, mains, crosstalk; then noise, coloured
/// noise, spikes and ADC.
///
/// Plain data, checked when a [`Rig`](crate::Rig) is made of it. Start from [`Sensor::new`]; fields
/// may be added.
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
    /// Curvature of the calibration, 1/K: `curvature_per_k · (T − curvature_about_c)²` is added to
    /// the reading of a junction at `T`; 0 if left out.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub curvature_per_k: f64,
    /// Temperature at which the curvature adds nothing, °C; 0 if left out.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub curvature_about_c: f64,
    /// Delay of the channel, s, at least 0: the reading at `t` is that of the junction at
    /// `t − delay_s`, interpolated between integration steps by cubics with an error of
    /// `h⁴ |T⁗|/384`; 0 if left out. Before the start of the run-in the sensor rests.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub delay_s: f64,
    /// Drift of the channel, K/s: `drift_k_per_s · (t − t_mid)` is added, `t_mid` half-way between
    /// the record's first and last sample; 0 if left out.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub drift_k_per_s: f64,
    /// Part ε of the other channel's signal that is picked up: `y₁ → y₁ + ε (y₂ − c)`, both taken before noise and before the
    /// other's own crosstalk, with `c` from [`Self::crosstalk_about_c`]; 0 if left out. Between −1 and 1.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub crosstalk: f64,
    /// Temperature of the other channel at which nothing is picked up, °C; the mean of its record if left out. An instrument has
    /// one, so records of one rig need it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crosstalk_about_c: Option<f64>,
    /// How far the sensor stands downstream of the place whose gas temperature is recorded, m; 0 if
    /// left out. It meets the gas that passed there when the [`Stream`](crate::Stream) had so far to
    /// carry it. Held gas comes late by whole sample periods, rounded up.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub downstream_m: f64,
    /// Power of the [`Stream`](crate::Stream)'s velocity over its mean with which τ goes; 0 if left
    /// out. A wire across a stream has about −0.5.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub stream_exponent: f64,
    /// Time constant τ₂ of a second pole in series, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second_time_constant_s: Option<f64>,
    /// A slow parallel path, such as conduction to the support.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slow_mode: Option<SlowMode>,
    /// Radiation between the first body and a wall.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radiation: Option<Radiation>,
    /// Dependence of τ on the temperature of the first body, or on one between it and the gas's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_dependence: Option<TemperatureDependence>,
    /// Play between the junction and the reading.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hysteresis: Option<Hysteresis>,
    /// A delay that appears in mid-record.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock_slip: Option<ClockSlip>,
    /// Another time constant from some moment on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub replaced: Option<Replaced>,
    /// A contact that opens now and then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub intermittent_contact: Option<IntermittentContact>,
    /// Mains pick-up and its harmonics.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mains: Vec<Mains>,
    /// Noise of the channel; none if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<Noise>,
    /// Noise with a memory, beside the other; none if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coloured_noise: Option<ColouredNoise>,
    /// Isolated outliers; none if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spikes: Option<Spikes>,
    /// Rounding and saturation of the channel; none if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adc: Option<Adc>,
}

/// A part of the reading that arrives through a slower body: `y = (1 − φ) x + φ z`,
/// `τ_slow dz/dt = x − z`, where `x` is what the sensor would read without it.
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

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl Sensor {
    /// A first-order sensor with unit gain, no offset, no noise, no ADC and no other effect.
    pub fn new(channel: impl Into<String>, time_constant_s: f64) -> Self {
        Self {
            channel: channel.into(),
            time_constant_s,
            gain: unit_gain(),
            offset_k: 0.0,
            curvature_per_k: 0.0,
            curvature_about_c: 0.0,
            delay_s: 0.0,
            drift_k_per_s: 0.0,
            crosstalk: 0.0,
            crosstalk_about_c: None,
            downstream_m: 0.0,
            stream_exponent: 0.0,
            second_time_constant_s: None,
            slow_mode: None,
            radiation: None,
            temperature_dependence: None,
            hysteresis: None,
            clock_slip: None,
            replaced: None,
            intermittent_contact: None,
            mains: Vec::new(),
            noise: None,
            coloured_noise: None,
            spikes: None,
            adc: None,
        }
    }

    /// Every time constant with its field's name, and whether the flow changes it.
    fn time_constants_s(&self) -> impl Iterator<Item = (&'static str, f64, bool)> {
        [
            Some(("time_constant_s", self.time_constant_s, true)),
            self.second_time_constant_s.map(|tau_s| ("second_time_constant_s", tau_s, false)),
            self.slow_mode.map(|mode| ("slow_mode.time_constant_s", mode.time_constant_s, false)),
            self.replaced.map(|other| ("replaced.time_constant_s", other.time_constant_s, true)),
        ]
        .into_iter()
        .flatten()
    }

    /// Run-in after which the sensor has forgotten its start: ten times its longest time constant,
    /// its delay, and the way of the gas to it, s.
    pub(crate) fn run_in_s(&self, surroundings: Surroundings) -> f64 {
        let [_, longest] = surroundings.range(self);
        let slowest_s = self
            .time_constants_s()
            .map(|(_, tau_s, flows)| if flows { longest * tau_s } else { tau_s })
            .fold(0.0, f64::max);
        let carried_s = surroundings.stream.map_or(0.0, |stream| stream.longest_transit_s(self.downstream_m));
        10.0 * slowest_s + carried_s + self.delay_s + self.clock_slip.map_or(0.0, |slip| slip.by_s)
    }

    /// The sensor that takes over, if this one is replaced, and when.
    pub(crate) fn successor(&self) -> Option<(f64, Self)> {
        let Replaced { at_s, time_constant_s } = self.replaced?;
        Some((at_s, Self { time_constant_s, replaced: None, ..self.clone() }))
    }

    pub(crate) fn check(&self, within: &str, record: &Record) -> Result<(), SignalError> {
        if self.channel.is_empty() {
            return Err(SignalError::EmptyName { field: path(within, "channel") });
        }
        for (name, tau_s, _) in self.time_constants_s() {
            positive(within, name, tau_s)?;
        }
        positive(within, "gain", self.gain)?;
        finite(within, "offset_k", self.offset_k)?;
        finite(within, "curvature_per_k", self.curvature_per_k)?;
        finite(within, "curvature_about_c", self.curvature_about_c)?;
        not_negative(within, "delay_s", self.delay_s)?;
        finite(within, "drift_k_per_s", self.drift_k_per_s)?;
        between(within, "crosstalk", self.crosstalk, -1.0, 1.0)?;
        if let Some(about_c) = self.crosstalk_about_c {
            finite(within, "crosstalk_about_c", about_c)?;
        }
        not_negative(within, "downstream_m", self.downstream_m)?;
        finite(within, "stream_exponent", self.stream_exponent)?;
        if let Some(mode) = self.slow_mode {
            between(within, "slow_mode.fraction", mode.fraction, 0.0, 1.0)?;
        }
        if let Some(radiation) = &self.radiation {
            radiation.check(&path(within, "radiation"))?;
        }
        if let Some(dependence) = &self.temperature_dependence {
            dependence.check(&path(within, "temperature_dependence"))?;
        }
        if let Some(hysteresis) = &self.hysteresis {
            hysteresis.check(&path(within, "hysteresis"))?;
        }
        if let Some(slip) = &self.clock_slip {
            slip.check(&path(within, "clock_slip"))?;
        }
        if let Some(replaced) = &self.replaced {
            replaced.check(&path(within, "replaced"))?;
        }
        if let Some(contact) = &self.intermittent_contact {
            contact.check(&path(within, "intermittent_contact"), record)?;
        }
        for (i, mains) in self.mains.iter().enumerate() {
            mains.check(&format!("{within}.mains[{i}]"))?;
        }
        if let Some(noise) = &self.noise {
            noise.check(&path(within, "noise"))?;
        }
        if let Some(noise) = &self.coloured_noise {
            noise.check(&path(within, "coloured_noise"))?;
        }
        if let Some(spikes) = &self.spikes {
            spikes.check(&path(within, "spikes"))?;
        }
        if let Some(adc) = &self.adc {
            adc.check(&path(within, "adc"))?;
        }
        Ok(())
    }

    /// Refuses what only a stream past the sensor gives a meaning.
    pub(crate) fn check_still(&self, within: &str) -> Result<(), SignalError> {
        let of_stream = [("downstream_m", self.downstream_m), ("stream_exponent", self.stream_exponent)];
        match of_stream.iter().find(|(_, value)| *value != 0.0) {
            Some((name, _)) => Err(SignalError::NeedsStream { field: path(within, name) }),
            None => Ok(()),
        }
    }

    /// Refuses a step as long as a time constant, long before the rule's limit of stability at
    /// 2.785.
    ///
    /// What shortens a time constant counts: the flow at its least factor; radiation and the
    /// dependence on temperature at the mean temperature of the gas.
    pub(crate) fn check_step(
        &self,
        within: &str,
        record: &Record,
        surroundings: Surroundings,
        mean_c: f64,
    ) -> Result<(), SignalError> {
        let step_s = record.step_s();
        for (name, tau_s, flows) in self.time_constants_s() {
            let mut shortest_s = tau_s;
            let mut field = path(within, name);
            if flows {
                let [least, _] = surroundings.range(self);
                if least < 1.0 {
                    shortest_s *= least;
                    field = format!("{field} (shortened by the flow or the stream)");
                }
                if let Some(radiation) = &self.radiation {
                    shortest_s /= 1.0 + radiation.slope(mean_c).max(0.0);
                    field = format!("{field} (shortened by radiation)");
                }
                if let Some(dependence) = &self.temperature_dependence {
                    shortest_s *= dependence.factor(mean_c, mean_c);
                    field = format!("{field} (at the mean temperature of the gas)");
                }
            }
            if step_s >= shortest_s {
                let oversampling = (record.sample_period_s / shortest_s).floor() + 1.0;
                return Err(SignalError::StepTooLong { field, time_constant_s: shortest_s, step_s, oversampling });
            }
        }
        Ok(())
    }
}

//! The rig that a model describes: two sensors with every effect in its place.
//!
//! A [`Plant`] says how readings come about; an effect that is absent has its neutral value. Each effect's file says
//! which of these numbers and functions are made of its parameters, nothing more, so any of them can be in the model
//! together. [`crate::disagreement`] inverts it.

use std::fmt;
use std::sync::Arc;

use crate::chain::{Chain, DELAY_TAPS, UNEVEN_REACH};
use crate::flow::Flow;
use crate::number::{Curve, Number, TimeFunction};
use crate::observations::{Observations, Stretch};

/// 0 °C, K.
pub const ZERO_CELSIUS_K: f64 = 273.15;
/// Rounds in which a transit time is computed from the flow halfway through it. Each leaves of the error before it half of the rate at
/// which the transit time changes.
const DELAY_ROUNDS: usize = 3;
/// Smallest factor by which a time constant changes: less would make a lag vanish, or turn it round.
pub(crate) const MIN_TAU_FACTOR: f64 = 0.02;

/// What is done to a sensor's temperature to have its reading: `g T' + o + Σ d(t) + ε (y − m)`, where `T'` is the
/// temperature through the static curve and `y` the other channel's reading.
#[derive(Clone)]
pub struct Reading {
    /// Static gain `g`.
    pub gain: Number,
    /// Offset `o`, K, of a reading at 0 °C.
    pub offset_k: Number,
    /// Functions of time `d` that are added, K: drift, lines.
    pub disturbances: Vec<TimeFunction>,
    /// The temperature of the sensor, °C, from what a straight characteristic makes of its reading, °C.
    pub straighten: Option<Curve>,
    /// Share `ε` of the other channel that is in the reading.
    pub crosstalk: Number,
    /// The temperature `m` of the other channel that adds nothing, °C.
    pub crosstalk_about_c: f64,
}

/// Functions are counted, or said to be there.
impl fmt::Debug for Reading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { gain, offset_k, disturbances, straighten, crosstalk, crosstalk_about_c } = self;
        let mut out = f.debug_struct("Reading");
        out.field("gain", gain).field("offset_k", offset_k).field("disturbances", &disturbances.len());
        out.field("is_straightened", &straighten.is_some()).field("crosstalk", crosstalk);
        out.field("crosstalk_about_c", crosstalk_about_c).finish()
    }
}

impl Reading {
    /// A reading that is the temperature of the sensor.
    fn exact() -> Self {
        Self {
            gain: Number::from(1.0),
            offset_k: Number::from(0.0),
            disturbances: Vec::new(),
            straighten: None,
            crosstalk: Number::from(0.0),
            crosstalk_about_c: 0.0,
        }
    }

    /// The sum of the functions of time that are added, K.
    pub fn disturbance_at(&self, time_s: f64) -> Number {
        self.disturbances.iter().map(|d| d(time_s)).sum()
    }
}

/// A slow parallel path: share and time constant.
#[derive(Clone, Copy, Debug)]
pub struct SlowPath {
    /// Share `φ` of the reading that follows through it.
    pub share: Number,
    /// Its time constant, s.
    pub tau_s: Number,
}

/// A relative change `m` of a time constant.
#[derive(Clone)]
pub struct TimeConstantChange {
    /// The relative change at an instant, s.
    pub at: TimeFunction,
    /// The flow, where the change depends on nothing else.
    flow: Option<Arc<Flow>>,
}

/// Says whether it follows a flow; functions have no text.
impl fmt::Debug for TimeConstantChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TimeConstantChange").field("flow", &self.flow.is_some()).finish_non_exhaustive()
    }
}

impl TimeConstantChange {
    /// A function of time.
    pub fn of_time(at: TimeFunction) -> Self {
        Self { at, flow: None }
    }

    /// A function of a flow, at its `ln(v/v_ref)`.
    pub fn of_flow(flow: Arc<Flow>, of_log_ratio: impl Fn(f64) -> Number + Send + Sync + 'static) -> Self {
        let along = flow.clone();
        Self { at: Arc::new(move |time_s| of_log_ratio(along.log_ratio_at(time_s))), flow: Some(flow) }
    }

    /// Whether it is one number in all of the stretch that an instant is of.
    fn is_steady_around(&self, time_s: f64) -> bool {
        self.flow.as_ref().is_some_and(|flow| flow.is_steady_around(time_s))
    }
}

/// One sensor: `(1 + τ₂ s) [τ(t) d/dt G(T) + F(T)] = x [1 + (1 − φ) τ_s s]/(1 + τ_s s)`.
#[derive(Clone)]
pub struct Sensor {
    /// What is done to its temperature to have the reading.
    pub reading: Reading,
    /// Time constant `τ`, s: that of no change, at the temperature of no change.
    pub tau_s: Number,
    /// Relative changes `m` of the time constant along the record, which is `τ Π (1 + m(t))`.
    pub changes: Vec<TimeConstantChange>,
    /// Second time constant `τ₂` in series, s.
    pub second_tau_s: Option<Number>,
    /// Slow parallel path.
    pub slow: Option<SlowPath>,
    /// The gas temperature `F`, °C, at which a sensor of a temperature, °C, is at rest: what it loses is their
    /// difference.
    pub rest: Option<Curve>,
    /// Heat `G` that it holds, in K of its heat capacity at a reference temperature: the slope is the factor of the
    /// time constant at that temperature.
    pub heat: Option<Curve>,
}

/// Functions are counted, or said to be there.
impl fmt::Debug for Sensor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { reading, tau_s, changes, second_tau_s, slow, rest, heat } = self;
        let mut out = f.debug_struct("Sensor");
        out.field("reading", reading).field("tau_s", tau_s).field("changes", &changes.len());
        out.field("second_tau_s", second_tau_s).field("slow", slow);
        out.field("loses_heat", &rest.is_some()).field("heat_varies", &heat.is_some()).finish()
    }
}

impl Sensor {
    fn first_order(tau_s: Number) -> Self {
        let reading = Reading::exact();
        Self { reading, tau_s, changes: Vec::new(), second_tau_s: None, slow: None, rest: None, heat: None }
    }

    /// The factor `Π (1 + m(t))` of its time constant at an instant.
    pub fn tau_factor_at(&self, time_s: f64) -> Number {
        let factor = self.changes.iter().fold(Number::from(1.0), |product, m| product * ((m.at)(time_s) + 1.0));
        if factor.re < MIN_TAU_FACTOR { Number::from(MIN_TAU_FACTOR) } else { factor }
    }
}

/// Where extra noise enters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The reading of a channel, 0 or 1.
    Reading(usize),
    /// The gas: the sensors do not see the same.
    Gas,
}

/// Noise beside the white noise of the channels: autoregressive of first order.
#[derive(Clone, Copy, Debug)]
pub struct Extra {
    /// Where it enters.
    pub place: Place,
    /// Its standard deviation, K.
    pub std_k: f64,
    /// How long it remembers, s.
    pub correlation_s: f64,
}

impl Extra {
    /// What is left of it after a sample: `ρ = exp(−Ts/T)`.
    pub(crate) fn rho(&self, step_s: f64) -> f64 {
        (-step_s / self.correlation_s).exp()
    }
}

/// Sensors that stand apart along a flow, or along their own motion: gas that passes the first one at `t` reaches the second one
/// `d = L/v(t + d/2)` later.
#[derive(Clone, Debug)]
pub struct Separation {
    /// How much later the second one is at the mean flow, s: the distance over it.
    pub delay_s: Number,
    /// The flow.
    pub flow: Arc<Flow>,
}

impl Separation {
    /// Transit time, s, of the gas that passes the first sensor at `t`: `d` with `∫ v dt = L` from `t` to `t + d`. Taken as
    /// `d = L/v(t + d/2)`, which is wrong by the share `v'' d²/(24 v)`.
    fn transit_s(&self, time_s: f64) -> Number {
        let mut transit_s = Number::from(0.0);
        for _ in 0..DELAY_ROUNDS {
            transit_s = self.delay_s * self.flow.inverse_ratio_at(transit_s * 0.5 + time_s);
        }
        transit_s
    }

    /// Factor of the second sensor's time constant: `1/(1 + d') = (1 − r'/2)/(1 + r'/2)`, `r = L/v` at `t + d/2`. At least
    /// [`MIN_TAU_FACTOR`] and at most its inverse: where sensors turn, `r` jumps, and the formula has no meaning. Derivatives leave out
    /// that a longer transit shifts the instant at which the flow counts.
    fn slowing_at(&self, time_s: f64) -> Number {
        let middle_s = time_s + 0.5 * self.transit_s(time_s).re;
        let half = self.delay_s * (0.5 * self.flow.inverse_ratio_rate_at(middle_s));
        let most = (1.0 - MIN_TAU_FACTOR) / (1.0 + MIN_TAU_FACTOR);
        let half = if half.re.abs() > most { Number::from(most.copysign(half.re)) } else { half };
        (-half + 1.0) / (half + 1.0)
    }
}

/// The rig: two sensors, the delay between them, their noise.
#[derive(Clone, Debug)]
pub struct Plant {
    /// Both sensors.
    pub sensors: [Sensor; 2],
    /// White noise of the channels, K.
    pub noise_std_k: [f64; 2],
    /// How much later channel 2 is than channel 1, s.
    pub delay_s: Option<Number>,
    /// How much later it is beside that, where the sensors stand apart along a flow.
    pub separation: Option<Separation>,
    /// Noise beside the white.
    pub extra: Vec<Extra>,
    /// How many samples a delay may reach.
    pub(crate) reach: usize,
}

impl Plant {
    /// Two first-order lags.
    pub(crate) fn new(observations: &Observations, tau_s: [Number; 2], noise_std_k: [f64; 2]) -> Self {
        Self {
            sensors: tau_s.map(Sensor::first_order),
            noise_std_k,
            delay_s: None,
            separation: None,
            extra: Vec::new(),
            reach: observations.reach(),
        }
    }

    /// How much later channel 2 shows what channel 1 shows at an instant, s: the transit time of the gas, and a delay that is always
    /// there.
    pub(crate) fn delay_at(&self, time_s: f64) -> Number {
        let steady_s = self.delay_s.unwrap_or(Number::from(0.0));
        self.separation.as_ref().map_or(steady_s, |apart| steady_s + apart.transit_s(time_s))
    }

    /// What the time constant of a sensor is multiplied with at an instant of channel 1.
    ///
    /// A transit time that changes squeezes the time of channel 2: at `t + d(t)` its reading changes `1 + d'` times as fast as the sensor,
    /// so that the time constant counts `1/(1 + d')` times. A second lag and a slow path, which are corrections, are left as they are.
    pub(crate) fn tau_factor_at(&self, channel: usize, time_s: f64) -> Number {
        let sensor = &self.sensors[channel];
        match self.separation.as_ref().filter(|_| channel == 1) {
            Some(apart) => sensor.tau_factor_at(time_s + apart.transit_s(time_s).re) * apart.slowing_at(time_s),
            None => sensor.tau_factor_at(time_s),
        }
    }

    /// Whether the time constant of a sensor changes along the stretch that an instant is of.
    pub(crate) fn changes_tau_around(&self, channel: usize, time_s: f64) -> bool {
        let does_any_change = !self.sensors[channel].changes.iter().all(|change| change.is_steady_around(time_s));
        does_any_change || (channel == 1 && self.changes_delay_around(time_s))
    }

    /// Whether the delay between the channels changes along the stretch that an instant is of.
    pub(crate) fn changes_delay_around(&self, time_s: f64) -> bool {
        self.separation.as_ref().is_some_and(|apart| !apart.flow.is_steady_around(time_s))
    }

    /// The least and the largest delay along the record, s.
    pub(crate) fn delays_s(&self) -> [f64; 2] {
        let delay_s = self.delay_s.map_or(0.0, |delay_s| delay_s.re);
        let ratios = self.separation.as_ref().map(|apart| apart.flow.inverse_ratios().map(|r| r * apart.delay_s.re));
        ratios.map_or([delay_s; 2], |[a, b]| [delay_s + a.min(b), delay_s + a.max(b)])
    }

    /// Whether either channel is later than the other.
    pub(crate) fn has_delay(&self) -> bool {
        self.delay_s.is_some() || self.separation.is_some()
    }

    /// Values of a stretch that have no disagreement: each operator takes some at the ends.
    pub fn consumed(&self, is_even: bool) -> usize {
        let of_sensor = |s: &Sensor| usize::from(s.second_tau_s.is_some()) + usize::from(s.slow.is_some());
        let factors: usize = self.sensors.iter().map(of_sensor).sum();
        let (each, delay) = if is_even { (2, 2 * self.reach) } else { (1, 2 * UNEVEN_REACH) };
        let delay = if self.has_delay() { delay + DELAY_TAPS - 1 } else { 0 };
        each * (1 + factors) + delay + self.extra.len()
    }

    /// The temperatures of both sensors: readings without what calibration, lines and crosstalk make of them, °C.
    pub(crate) fn temperatures(&self, stretch: &Stretch) -> [Vec<f64>; 2] {
        let mut chains = [0, 1].map(|i| Chain::<f64>::of(stretch.whole(), i, None));
        self.correct(&mut chains, [true; 2]);
        chains.map(|chain| chain.value)
    }

    /// Takes off the factors `1 + (1 − φ) τ s` with which slow paths are compared, so that `values` are those of the
    /// gas, which was at `start_c` before.
    pub(crate) fn undo_slow(&self, values: &mut [f64], start_c: f64, step_s: f64) {
        for slow in self.sensors.iter().filter_map(|s| s.slow) {
            let keep = (-step_s / ((1.0 - slow.share.re) * slow.tau_s.re)).exp();
            let (mut now, mut before) = (start_c, values.first().copied().unwrap_or(start_c));
            for value in values.iter_mut() {
                now = keep * now + (1.0 - keep) * 0.5 * (before + *value);
                before = std::mem::replace(value, now);
            }
        }
    }
}

//! The gas temperature: the `[gas]` table. Each kind of signal has its own file.

mod broadband;
mod engine;
mod plunge;
mod series;
mod tones;
mod turbulence;

use std::path::Path;

use rand::Rng;
use serde::{Deserialize, Serialize};

use crate::check::{finite, path};
use crate::grid::Grid;
use crate::{Record, SignalError, Stream};

pub use broadband::Broadband;
pub use engine::Engine;
pub use plunge::Plunge;
pub use series::Series;
pub use tones::{MultiTone, Tone};
pub use turbulence::Turbulence;

/// The gas that both sensors see: a mean and a signal about it.
///
/// Plain data, checked when a [`Rig`](crate::Rig) is made of it. Start from [`Gas::new`]; fields
/// may be added.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Gas {
    /// Mean temperature, °C, about which the signal moves; added to a series. 0 if left out.
    #[serde(default)]
    pub mean_c: f64,
    /// How the gas moves between the samples.
    #[serde(default)]
    pub hold: Hold,
    /// Whether every trial has its own signal; otherwise all have that of trial 0, and differ by
    /// their noise alone.
    #[serde(default)]
    pub per_trial: bool,
    /// The signal, named by `kind` in a rig file; its fields stand beside those above.
    // Unknown fields land here, and each kind refuses them: `deny_unknown_fields` and `flatten`
    // exclude each other.
    #[serde(flatten)]
    pub signal: Signal,
}

/// How the gas moves between two sample instants.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hold {
    /// The gas follows the continuous signal.
    #[default]
    Continuous,
    /// The gas keeps the value of the sample instant until the next (zero-order hold), so that the
    /// discrete model `y[k+1] = a y[k] + (1 − a) x[k]`, `a = exp(−Ts/τ)`, of a first-order sensor
    /// is exact.
    ZeroOrder,
}

/// A gas signal. In a rig file `kind` is the variant's name: `sine`, `multi-tone`, `engine`,
/// `turbulence`, `plunge`, `broadband` or `series`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Signal {
    /// One sine.
    Sine(Tone),
    /// A sum of sines.
    MultiTone(MultiTone),
    /// Pulsation of an engine's exhaust.
    Engine(Engine),
    /// Turbulence with a Kolmogorov range.
    Turbulence(Turbulence),
    /// Smoothed random steps, as of a probe plunged from one bath into another.
    Plunge(Plunge),
    /// First-order random noise.
    Broadband(Broadband),
    /// A given series.
    Series(Series),
}

impl Signal {
    /// This signal with every deviation so many times as large. A series is left as it is, since its mean is its own.
    #[must_use]
    pub fn excited(&self, factor: f64) -> Self {
        let of_tone = |tone: &Tone| Tone { amplitude_k: factor * tone.amplitude_k, ..*tone };
        match self {
            Self::Sine(tone) => Self::Sine(of_tone(tone)),
            Self::MultiTone(tones) => Self::MultiTone(MultiTone { tones: tones.tones.iter().map(of_tone).collect() }),
            Self::Engine(engine) => Self::Engine(Engine { amplitude_k: factor * engine.amplitude_k, ..*engine }),
            Self::Turbulence(signal) => Self::Turbulence(Turbulence { std_k: factor * signal.std_k, ..*signal }),
            Self::Plunge(plunge) => Self::Plunge(Plunge { amplitude_k: factor * plunge.amplitude_k, ..*plunge }),
            Self::Broadband(signal) => Self::Broadband(Broadband { std_k: factor * signal.std_k, ..*signal }),
            Self::Series(series) => Self::Series(series.clone()),
        }
    }
}

impl Gas {
    /// A continuous gas with one signal for all trials.
    ///
    /// ```
    /// use twinlag_signal::{Gas, Record, Rig, Sensor, Signal, Tone};
    ///
    /// let tone = Tone { amplitude_k: 5.0, frequency_hz: 2.0, phase_rad: 0.0 };
    /// let gas = Gas::new(300.0, Signal::Sine(tone));
    /// let rig = Rig::new(1, Record::new(51, 0.01), gas, [Sensor::new("fine", 0.02), Sensor::new("coarse", 0.1)])?;
    /// let clean = rig.clean(0)?;
    /// // Zero at the first sample, and a whole period later; instants are rounded.
    /// assert!((clean.gas_c[0] - 300.0).abs() < 1e-9 && (clean.gas_c[50] - 300.0).abs() < 1e-9);
    /// // No sensor swings as far as the gas, the slower one least.
    /// let highest = |values: &[f64]| values.iter().copied().fold(f64::MIN, f64::max);
    /// assert!(highest(&clean.readings_c[1]) < highest(&clean.readings_c[0]));
    /// assert!(highest(&clean.readings_c[0]) < highest(&clean.gas_c));
    /// # Ok::<(), twinlag_signal::SignalError>(())
    /// ```
    pub fn new(mean_c: f64, signal: Signal) -> Self {
        Self { mean_c, hold: Hold::Continuous, per_trial: false, signal }
    }

    pub(crate) fn check(&self, record: &Record) -> Result<(), SignalError> {
        let within = "gas";
        finite(within, "mean_c", self.mean_c)?;
        let resolution = Resolution::new(self.hold, record);
        match &self.signal {
            Signal::Sine(tone) => tone.check(within, resolution),
            Signal::MultiTone(tones) => tones.check(within, resolution),
            Signal::Engine(engine) => engine.check(within, resolution),
            Signal::Turbulence(turbulence) => turbulence.check(within, resolution, record),
            Signal::Plunge(plunge) => plunge.check(within, resolution),
            Signal::Broadband(broadband) => broadband.check(within, resolution),
            Signal::Series(series) => series.check(within),
        }
    }
}

/// Whether the integration step follows a signal: ten steps per period at least, where the rule's
/// error is `(2π/10)⁴/2880` of the amplitude or 5e-5.
#[derive(Clone, Copy)]
pub(crate) struct Resolution<'a> {
    record: Option<&'a Record>,
}

impl<'a> Resolution<'a> {
    /// A held gas is taken at the sample instants alone: nothing happens between them that a step
    /// could miss.
    pub(crate) fn new(hold: Hold, record: &'a Record) -> Self {
        Self { record: (hold == Hold::Continuous).then_some(record) }
    }

    const STEPS_PER_PERIOD: f64 = 10.0;

    /// Refuses `frequency_hz` if it is too fast, naming the field `name`, whose own value is
    /// `value`.
    fn check(self, within: &str, name: &str, value: f64, frequency_hz: f64) -> Result<(), SignalError> {
        let Some(record) = self.record else { return Ok(()) };
        let step_s = record.step_s();
        // A hair of tolerance: the number that the message asks for must pass.
        if Self::STEPS_PER_PERIOD * frequency_hz * step_s <= 1.0 + 1e-9 {
            return Ok(());
        }
        let oversampling = (Self::STEPS_PER_PERIOD * frequency_hz * record.sample_period_s).ceil();
        Err(SignalError::NotResolved { field: path(within, name), value, step_s, oversampling })
    }

    /// Checks the resolution of a raised-cosine rise of `rise_s`, which is half a period.
    fn check_rise(self, within: &str, name: &str, value: f64, rise_s: f64) -> Result<(), SignalError> {
        self.check(within, name, value, 0.5 / rise_s)
    }
}

/// Half a raised cosine: 0 at 0, 1 at 1, level at both.
pub(crate) fn smooth_step(u: f64) -> f64 {
    0.5 * (1.0 - (std::f64::consts::PI * u).cos())
}

/// The gas temperature on its grid.
pub(crate) struct GasPath {
    pub(crate) grid: Grid,
    pub(crate) hold: Hold,
    /// °C, one per grid point.
    pub(crate) values_c: Vec<f64>,
}

impl GasPath {
    pub(crate) fn new(gas: &Gas, grid: Grid, base_dir: &Path, rng: &mut impl Rng) -> Result<Self, SignalError> {
        let mut values_c = match &gas.signal {
            Signal::Sine(tone) => tone.values_k(grid),
            Signal::MultiTone(tones) => tones.values_k(grid),
            Signal::Engine(engine) => engine.values_k(grid, rng),
            Signal::Turbulence(turbulence) => turbulence.values_k(grid, rng),
            Signal::Plunge(plunge) => plunge.values_k(grid, rng),
            Signal::Broadband(broadband) => broadband.values_k(grid, rng),
            Signal::Series(series) => series.values_c(grid, base_dir)?,
        };
        for value_c in &mut values_c {
            *value_c += gas.mean_c;
        }
        Ok(Self { grid, hold: gas.hold, values_c })
    }

    /// This gas with `added_k` (K) added at every grid point.
    pub(crate) fn plus(&self, added_k: &[f64]) -> Self {
        let values_c = self.values_c.iter().zip(added_k).map(|(value_c, added_k)| value_c + added_k).collect();
        Self { grid: self.grid, hold: self.hold, values_c }
    }

    /// This gas as it arrives `distance_m` downstream: cubics through four points, wrong by less than
    /// `3 h⁴ |T⁗|/128` with `h` half an integration step.
    pub(crate) fn carried(&self, stream: &Stream, distance_m: f64) -> Self {
        let departures = stream.departures(self.grid, distance_m);
        let values_c = departures.map(|departure| match self.hold {
            Hold::Continuous => self.between_c(departure),
            // Rounding must not make a delay of whole periods one period longer.
            Hold::ZeroOrder => self.values_c[(departure + 1e-6) as usize],
        });
        Self { grid: self.grid, hold: self.hold, values_c: values_c.collect() }
    }

    /// The value at a point with a fraction, °C.
    fn between_c(&self, point: f64) -> f64 {
        let (k, u) = (point as usize, point.fract());
        let last = self.values_c.len() - 1;
        let at_c = |offset: usize| self.values_c[(k + offset).saturating_sub(1).min(last)];
        let weights = [
            -u * (u - 1.0) * (u - 2.0) / 6.0,
            (u + 1.0) * (u - 1.0) * (u - 2.0) / 2.0,
            -(u + 1.0) * u * (u - 2.0) / 2.0,
            (u + 1.0) * u * (u - 1.0) / 6.0,
        ];
        weights.iter().enumerate().map(|(offset, weight)| weight * at_c(offset)).sum()
    }

    /// The values at the sample instants from time zero on, °C.
    pub(crate) fn at_samples(&self) -> impl Iterator<Item = f64> {
        self.values_c[self.grid.before..].iter().copied().step_by(self.grid.per_sample)
    }
}

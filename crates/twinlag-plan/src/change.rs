//! Changes of a record, and the rig of each.
//!
//! A change keeps everything that it does not name: twice the rate is twice as many samples in the same time, twice the
//! length twice as many at the same rate. Integration steps keep their length.

use serde::{Deserialize, Serialize};
use twinlag::signal::{Gas, MultiTone, Rig, Sensor, Signal, SignalError, Tone};

/// A change of a record.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case", tag = "kind")]
#[non_exhaustive]
pub enum Change {
    /// So many times as many samples in the same time.
    Rate {
        /// How many times.
        factor: f64,
    },
    /// So many times as many samples at the same rate.
    Length {
        /// How many times.
        factor: f64,
    },
    /// A gas whose temperature deviates so many times as far from its mean.
    Excitation {
        /// How many times.
        factor: f64,
    },
    /// A gas with the same standard deviation, all of it within a factor of three of a frequency.
    GasAround {
        /// The frequency, Hz.
        frequency_hz: f64,
    },
    /// Sensors with so many times the time constants.
    Pair {
        /// How many times, of each sensor.
        factors: [f64; 2],
    },
    /// Noise levels that a segment with a steady gas has determined, the rest of the record as it is.
    QuietSegment,
}

/// The longest record that is tried, in lengths of the record as it is: chosen.
pub(crate) const LONGEST_FACTOR: f64 = 4.0;
/// Tones of a gas around a frequency, evenly spread over the logarithm: chosen.
const TONES: usize = 12;
/// A gas around a frequency reaches this factor to either side: chosen.
const REACH: f64 = 3.0;
/// Its highest frequency, in sampling frequencies: below one half, so that it is not folded back.
const HIGHEST_CYCLES: f64 = 0.4;
/// Its lowest, in lengths of the record: a tone that does not complete some periods is a drift. Chosen.
const LEAST_PERIODS: f64 = 4.0;

impl Change {
    /// The change in words.
    ///
    /// - `channels`: names of the channels
    pub fn in_words(&self, channels: &[String; 2]) -> String {
        match self {
            Self::Rate { factor } => format!("sampling rate × {factor}"),
            Self::Length { factor } => format!("length × {factor}"),
            Self::Excitation { factor } => format!("gas deviates × {factor}"),
            Self::GasAround { frequency_hz } => format!("gas around {frequency_hz:.3} Hz"),
            Self::Pair { factors: [a, b] } if a == b => format!("time constants of both × {a}"),
            Self::Pair { factors: [a, b] } => {
                let (i, factor) = if *b == 1.0 { (0, a) } else { (1, b) };
                format!("time constant of {} × {factor}", channels[i])
            }
            Self::QuietSegment => "noise known from a quiet segment".into(),
        }
    }

    /// The rig with this change.
    ///
    /// - `gas_std_k`: standard deviation of the gas of `rig`, K
    pub(crate) fn of(&self, rig: &Rig, gas_std_k: f64) -> Result<Rig, SignalError> {
        let mut record = rig.record().clone();
        match self {
            Self::QuietSegment => Ok(rig.clone()),
            Self::Rate { factor } => {
                record.samples = (record.samples as f64 * factor).round() as usize;
                record.sample_period_s /= factor;
                record.oversampling = (record.oversampling as f64 / factor).ceil().max(1.0) as usize;
                rig.clone().with_record(record)
            }
            Self::Length { factor } => {
                record.samples = (record.samples as f64 * factor).round() as usize;
                rig.clone().with_record(record)
            }
            Self::Excitation { factor } => {
                let mut gas = rig.gas().clone();
                gas.signal = gas.signal.excited(*factor);
                rig.clone().with_gas(gas)
            }
            Self::GasAround { frequency_hz } => {
                let signal = around(*frequency_hz, gas_std_k, rig);
                rig.clone().with_gas(Gas::new(rig.gas().mean_c, signal))
            }
            Self::Pair { factors } => {
                let mut sensors: [Sensor; 2] = rig.sensors().clone();
                for (sensor, factor) in sensors.iter_mut().zip(factors) {
                    sensor.time_constant_s *= factor;
                }
                rig.clone().with_sensors(sensors)
            }
        }
    }
}

/// Tones of equal amplitude around a frequency.
fn around(frequency_hz: f64, std_k: f64, rig: &Rig) -> Signal {
    let record = rig.record();
    let length_s = record.samples as f64 * record.sample_period_s;
    let highest_hz = (frequency_hz * REACH).min(HIGHEST_CYCLES / record.sample_period_s);
    let lowest_hz = (frequency_hz / REACH).max(LEAST_PERIODS / length_s).min(0.5 * highest_hz);
    let amplitude_k = std_k * (2.0 / TONES as f64).sqrt();
    let tones = (0..TONES).map(|i| {
        let place = (i as f64 + 0.5) / TONES as f64;
        Tone { amplitude_k, frequency_hz: lowest_hz * (highest_hz / lowest_hz).powf(place), phase_rad: phase_rad(i) }
    });
    Signal::MultiTone(MultiTone { tones: tones.collect() })
}

/// A phase that has nothing to do with those of its neighbours: multiples of the golden angle, each times its place.
pub(crate) fn phase_rad(place: usize) -> f64 {
    const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
    let place = place as f64;
    (GOLDEN_ANGLE * place * place).rem_euclid(std::f64::consts::TAU)
}

//! The rig without effects: sampling, gas, sensors and noise, drawn at random.

use std::f64::consts::TAU;
use std::path::Path;

use rand::{Rng, RngExt};

use super::GasKind;
use super::draw::{log_uniform, one_of};
use crate::gas::GasPath;
use crate::grid::Grid;
use crate::streams::{Purpose, stream};
use crate::{Engine, Gas, Hold, MultiTone, Noise, Plunge, Record, Sensor, Signal, SignalError, Tone, Turbulence};

/// A rig without effects, in parts, with the scales by which effects are measured.
pub(super) struct Base {
    pub(super) record: Record,
    pub(super) gas: Gas,
    pub(super) gas_kind: GasKind,
    pub(super) sensors: [Sensor; 2],
    pub(super) fast: usize,
    /// Mean and standard deviation of the gas over the record, °C and K.
    pub(super) mean_c: f64,
    pub(super) scale_k: f64,
    /// Characteristic frequency of the gas, Hz.
    pub(super) frequency_hz: f64,
    /// Standard deviation of each channel's noise, K.
    pub(super) noise_std_k: [f64; 2],
}

impl Base {
    /// Everything but the gas signal's own random numbers, which are the rig's, is drawn from
    /// `rng`. Asking for a kind of gas changes that alone.
    pub(super) fn draw(gas_kind: Option<GasKind>, rig_seed: u64, rng: &mut impl Rng) -> Result<Self, SignalError> {
        let sample_period_s = one_of(&[0.0005, 0.001, 0.002, 0.005], rng);
        let samples = rng.random_range(9000..=18_000);
        let fast_s = sample_period_s * log_uniform(10.0, 32.0, rng);
        let slow_s = fast_s * rng.random_range(3.5..6.5);
        let fast = usize::from(rng.random::<bool>());
        let drawn = one_of(&GasKind::ALL, rng);
        let gas_kind = gas_kind.unwrap_or(drawn);
        let mean_c = rng.random_range(150.0..650.0);
        let scale_k = rng.random_range(15.0..30.0);
        let frequency_hz = log_uniform(0.07, 0.2, rng) / fast_s;
        let noise_std_k: [f64; 2] = std::array::from_fn(|_| scale_k * log_uniform(0.002, 0.03, rng));

        let mut sensors = ["T1", "T2"].map(|channel| Sensor::new(channel, slow_s));
        sensors[fast].time_constant_s = fast_s;
        for (sensor, std_k) in sensors.iter_mut().zip(noise_std_k) {
            sensor.noise = Some(Noise::white(std_k));
        }
        let mut record = Record::new(samples, sample_period_s);
        // The same for every effect, so that it does not move the gas: of a slow mode at its
        // slowest an eighth of the start is left.
        record.settle_s = Some(30.0 * slow_s);
        let signal = unit_signal(gas_kind, frequency_hz, sample_period_s, rng);
        let gas = scaled(Gas::new(0.0, signal), mean_c, scale_k, &record, rig_seed)?;
        Ok(Self { record, gas, gas_kind, sensors, fast, mean_c, scale_k, frequency_hz, noise_std_k })
    }

    pub(super) fn fast_s(&self) -> f64 {
        self.sensors[self.fast].time_constant_s
    }

    pub(super) fn slow_s(&self) -> f64 {
        self.sensors[1 - self.fast].time_constant_s
    }

    /// From the first sample to the last, s.
    pub(super) fn length_s(&self) -> f64 {
        (self.record.samples - 1) as f64 * self.record.sample_period_s
    }
}

/// A signal of the kind, of a size in the order of 1 K.
fn unit_signal(kind: GasKind, frequency_hz: f64, sample_period_s: f64, rng: &mut impl Rng) -> Signal {
    match kind {
        GasKind::Engine => {
            let mut engine = Engine::new(1.0, frequency_hz * rng.random_range(0.75..1.2));
            engine.amplitude_relative_std = rng.random_range(0.1..0.25);
            engine.period_relative_std = rng.random_range(0.01..0.05);
            engine.rise_fraction = rng.random_range(0.12..0.25);
            engine.decay_fraction = rng.random_range(0.25..0.5);
            Signal::Engine(engine)
        }
        GasKind::Plunge => Signal::Plunge(Plunge {
            amplitude_k: 1.0,
            dwell_s: rng.random_range(5.0..7.0) / frequency_hz,
            rise_s: rng.random_range(0.1..0.25) / frequency_hz,
        }),
        GasKind::Turbulence => Signal::Turbulence(Turbulence {
            std_k: 1.0,
            corner_hz: frequency_hz * log_uniform(0.1, 0.4, rng),
            cutoff_hz: (20.0 * frequency_hz).min(0.45 / sample_period_s),
        }),
        GasKind::MultiTone => {
            // From a twentieth of the characteristic frequency to three times it, weaker as they
            // get faster.
            let tones = (0..12).map(|i| {
                let relative = 0.05 * 60.0_f64.powf((f64::from(i) + rng.random_range(0.0..1.0)) / 12.0);
                Tone {
                    amplitude_k: rng.random_range(0.5..1.5) / (1.0 + relative),
                    frequency_hz: relative * frequency_hz,
                    phase_rad: rng.random_range(0.0..TAU),
                }
            });
            Signal::MultiTone(MultiTone { tones: tones.collect() })
        }
    }
}

/// The gas with its signal scaled and shifted, so that over the record it has the given mean and
/// standard deviation.
fn scaled(mut gas: Gas, mean_c: f64, scale_k: f64, record: &Record, rig_seed: u64) -> Result<Gas, SignalError> {
    // A signal's random numbers do not depend on the grid: the sample instants will do.
    let grid = Grid::new(record, record.settle_samples(0.0) as usize, Hold::ZeroOrder);
    let path = GasPath::new(&gas, grid, Path::new(""), &mut stream(rig_seed, 0, Purpose::Gas))?;
    let n = record.samples as f64;
    let mean_k = path.at_samples().sum::<f64>() / n;
    let std_k = (path.at_samples().map(|value_k| (value_k - mean_k).powi(2)).sum::<f64>() / n).sqrt();
    let factor = scale_k / std_k;
    match &mut gas.signal {
        Signal::Engine(engine) => engine.amplitude_k *= factor,
        Signal::Plunge(plunge) => plunge.amplitude_k *= factor,
        Signal::Turbulence(turbulence) => turbulence.std_k *= factor,
        Signal::MultiTone(tones) => tones.tones.iter_mut().for_each(|tone| tone.amplitude_k *= factor),
        Signal::Sine(_) | Signal::Broadband(_) | Signal::Series(_) => unreachable!("no random rig has such a gas"),
    }
    gas.mean_c = mean_c - factor * mean_k;
    Ok(gas)
}

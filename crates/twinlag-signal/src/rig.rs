//! The rig: gas, two sensors, how they are sampled, and the seed.

use std::path::{Path, PathBuf};

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::gas::GasPath;
use crate::grid::Grid;
use crate::streams::{Purpose, stream};
use crate::{Clean, Gas, Record, Sensor, SignalError, Simulated};

/// A described rig, valid by construction; deserialising checks it as [`Rig::new`] does, and refuses unknown fields.
///
/// The seed must be below 2⁶³ to be written as TOML.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked")]
pub struct Rig {
    seed: u64,
    record: Record,
    gas: Gas,
    sensors: [Sensor; 2],
    #[serde(skip)]
    base_dir: PathBuf,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename = "rig")]
struct Unchecked {
    seed: u64,
    record: Record,
    gas: Gas,
    sensors: Vec<Sensor>,
}

impl TryFrom<Unchecked> for Rig {
    type Error = SignalError;

    fn try_from(file: Unchecked) -> Result<Self, SignalError> {
        let sensors =
            file.sensors.try_into().map_err(|got: Vec<Sensor>| SignalError::SensorCount { got: got.len() })?;
        Self::new(file.seed, file.record, file.gas, sensors)
    }
}

impl Rig {
    /// A rig from its parts.
    ///
    /// # Errors
    /// Any number that is not finite, or not positive where it must be; channel names empty or equal; an integration
    /// step as long as a time constant ([`SignalError::StepTooLong`]) or too long for the gas
    /// ([`SignalError::NotResolved`]); more than 2e8 integration steps ([`SignalError::TooLarge`]).
    pub fn new(seed: u64, record: Record, gas: Gas, sensors: [Sensor; 2]) -> Result<Self, SignalError> {
        for (sensor, within) in sensors.iter().zip(["sensors[0]", "sensors[1]"]) {
            sensor.check(within)?;
        }
        if sensors[0].channel == sensors[1].channel {
            return Err(SignalError::SameChannel { channel: sensors[0].channel.clone() });
        }
        record.check(slowest_s(&sensors))?;
        for (sensor, within) in sensors.iter().zip(["sensors[0]", "sensors[1]"]) {
            sensor.check_step(within, &record)?;
        }
        gas.check(&record)?;
        Ok(Self { seed, record, gas, sensors, base_dir: PathBuf::new() })
    }

    /// The same rig, looking for a gas series with a relative path in `dir` (the rig file's directory, usually).
    #[must_use]
    pub fn with_base_dir(mut self, dir: impl AsRef<Path>) -> Self {
        dir.as_ref().clone_into(&mut self.base_dir);
        self
    }

    /// The same rig with another seed.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// The seed of all random numbers.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// How the rig is sampled.
    pub fn record(&self) -> &Record {
        &self.record
    }

    /// The gas.
    pub fn gas(&self) -> &Gas {
        &self.gas
    }

    /// The two sensors.
    pub fn sensors(&self) -> &[Sensor; 2] {
        &self.sensors
    }

    /// Trial 0: [`Rig::simulate_trial`].
    ///
    /// # Errors
    /// As [`Rig::clean`].
    pub fn simulate(&self) -> Result<Simulated, SignalError> {
        self.simulate_trial(0)
    }

    /// The record of one trial: its own noise and, if [`Gas::per_trial`], its own gas signal.
    ///
    /// For many trials of one gas signal, call [`Rig::clean`] once and [`Clean::with_noise`] for each: same bytes.
    ///
    /// # Errors
    /// As [`Rig::clean`].
    pub fn simulate_trial(&self, trial: u64) -> Result<Simulated, SignalError> {
        Ok(self.clean(trial)?.with_noise(&mut self.noise_streams(trial)))
    }

    /// The record of one trial before noise and ADC. Does not depend on `trial` unless [`Gas::per_trial`].
    ///
    /// # Errors
    /// What a gas series may meet: a file that cannot be read, a line that is not two numbers, times that do not
    /// increase, an end before the record's.
    pub fn clean(&self, trial: u64) -> Result<Clean, SignalError> {
        let settle_samples = self.record.settle_samples(slowest_s(&self.sensors)) as usize;
        let grid = Grid::new(&self.record, settle_samples, self.gas.hold);
        let gas_trial = if self.gas.per_trial { trial } else { 0 };
        let gas = GasPath::new(&self.gas, grid, &self.base_dir, &mut stream(self.seed, gas_trial, Purpose::Gas))?;
        Ok(Clean {
            time_s: (0..self.record.samples).map(|k| k as f64 * self.record.sample_period_s).collect(),
            gas_c: gas.at_samples().collect(),
            readings_c: [
                self.sensors[0].follow(&gas, self.record.oversampling),
                self.sensors[1].follow(&gas, self.record.oversampling),
            ],
            sensors: self.sensors.clone(),
        })
    }

    /// The generators of the two channels' noise in one trial: streams `8 · trial + 1` and `8 · trial + 2` of the seed
    /// (`8 · trial` is the gas; the others are kept free).
    pub fn noise_streams(&self, trial: u64) -> [ChaCha8Rng; 2] {
        [Purpose::FirstNoise, Purpose::SecondNoise].map(|purpose| stream(self.seed, trial, purpose))
    }
}

fn slowest_s(sensors: &[Sensor; 2]) -> f64 {
    sensors[0].slowest_s().max(sensors[1].slowest_s())
}

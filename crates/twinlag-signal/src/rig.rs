//! The rig: gas, two sensors, how they are sampled, and the seed.

use std::path::{Path, PathBuf};

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::disturbance::cross_talk;
use crate::gas::{GasPath, Resolution};
use crate::grid::Grid;
use crate::streams::{Purpose, stream};
use crate::surroundings::Surroundings;
use crate::{Clean, Flow, Gas, Mismatch, Record, Sensor, SignalError, Simulated, Stream};

const WITHIN: [&str; 2] = ["sensors[0]", "sensors[1]"];

/// A described rig, valid by construction; deserialising checks it as [`Rig::new`] does, and
/// refuses unknown fields.
///
/// The seed must be below 2⁶³ to be written as TOML.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked")]
pub struct Rig {
    seed: u64,
    record: Record,
    gas: Gas,
    sensors: [Sensor; 2],
    #[serde(skip_serializing_if = "Option::is_none")]
    flow: Option<Flow>,
    #[serde(skip_serializing_if = "Option::is_none")]
    stream: Option<Stream>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mismatch: Option<Mismatch>,
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
    #[serde(default)]
    flow: Option<Flow>,
    #[serde(default)]
    stream: Option<Stream>,
    #[serde(default)]
    mismatch: Option<Mismatch>,
}

impl TryFrom<Unchecked> for Rig {
    type Error = SignalError;

    fn try_from(file: Unchecked) -> Result<Self, SignalError> {
        let sensors =
            file.sensors.try_into().map_err(|got: Vec<Sensor>| SignalError::SensorCount { got: got.len() })?;
        let (seed, record, gas) = (file.seed, file.record, file.gas);
        let Unchecked { flow, stream, mismatch, .. } = file;
        Self { seed, record, gas, sensors, flow, stream, mismatch, base_dir: PathBuf::new() }.checked()
    }
}

impl Rig {
    /// A rig from its parts, with steady flow and one gas for both sensors.
    ///
    /// ```
    /// use twinlag_signal::{Broadband, Gas, Record, Rig, Sensor, Signal, SignalError};
    ///
    /// let rig = |names: [&str; 2]| {
    ///     let signal = Signal::Broadband(Broadband { std_k: 5.0, corner_hz: 1.0 });
    ///     Rig::new(7, Record::new(100, 0.01), Gas::new(20.0, signal), names.map(|name| Sensor::new(name, 0.1)))
    /// };
    /// assert_eq!(rig(["T1", "T2"])?.simulate()?.t1_c.len(), 100);
    /// assert_eq!(rig(["T1", "T1"]), Err(SignalError::SameChannel { channel: "T1".into() }));
    /// # Ok::<(), SignalError>(())
    /// ```
    ///
    /// # Errors
    /// Any number that is not finite, or not positive where it must be; channel names empty or
    /// equal; an integration step as long as a time constant ([`SignalError::StepTooLong`]) or too
    /// long for the gas ([`SignalError::NotResolved`]); more than 2e8 integration steps
    /// ([`SignalError::TooLarge`]).
    pub fn new(seed: u64, record: Record, gas: Gas, sensors: [Sensor; 2]) -> Result<Self, SignalError> {
        let (flow, stream, mismatch) = (None, None, None);
        Self { seed, record, gas, sensors, flow, stream, mismatch, base_dir: PathBuf::new() }.checked()
    }

    /// This rig in a flow that changes both time constants.
    ///
    /// ```
    /// use twinlag_signal::{Flow, FlowStep, Gas, Plunge, Record, Rig, Sensor, Signal};
    ///
    /// let signal = Signal::Plunge(Plunge { amplitude_k: 20.0, dwell_s: 0.3, rise_s: 0.02 });
    /// let sensors = [Sensor::new("fine", 0.024), Sensor::new("coarse", 0.117)];
    /// let mut record = Record::new(400, 0.005);
    /// record.settle_s = Some(2.0); // that of slower sensors would be longer, and random gas begins with it
    /// let steady = Rig::new(1, record, Gas::new(300.0, signal), sensors)?;
    /// // From 1 s on both time constants are larger by a half.
    /// let changing = steady.clone().with_flow(Flow::Step(FlowStep::new(1.5, 1.0, 0.05)))?;
    /// let (before, after) = (steady.clean(0)?, changing.clean(0)?);
    /// let (before, after) = (&before.readings_c[1], &after.readings_c[1]);
    /// assert_eq!(before[..200], after[..200]); // bit by bit, until the flow changes
    /// assert!((220..400).any(|k| (before[k] - after[k]).abs() > 0.1)); // K
    /// # Ok::<(), twinlag_signal::SignalError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Rig::new`].
    pub fn with_flow(self, flow: Flow) -> Result<Self, SignalError> {
        Self { flow: Some(flow), ..self }.checked()
    }

    /// This rig in a stream whose velocity is recorded.
    ///
    /// ```
    /// use twinlag_signal::{Gas, Plunge, Record, Rig, Sensor, Signal, Stream};
    ///
    /// let signal = Signal::Plunge(Plunge { amplitude_k: 20.0, dwell_s: 0.3, rise_s: 0.02 });
    /// let sensors = [Sensor::new("upstream", 0.024), Sensor::new("downstream", 0.024)];
    /// let rig = Rig::new(1, Record::new(400, 0.005), Gas::new(300.0, signal), sensors)?;
    /// let mut sensors = rig.sensors().clone();
    /// sensors[1].downstream_m = 0.1;
    /// // In a steady stream of 2 m/s the gas is on its way for ten samples.
    /// let rig = rig.with_stream(Stream::new(2.0, 0.0, 1.0, 0.0))?.with_sensors(sensors)?;
    /// let [first_c, second_c] = rig.clean(0)?.readings_c;
    /// assert!((10..400).all(|k| (second_c[k] - first_c[k - 10]).abs() < 1e-3)); // K
    /// # Ok::<(), twinlag_signal::SignalError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Rig::new`].
    pub fn with_stream(self, stream: Stream) -> Result<Self, SignalError> {
        Self { stream: Some(stream), ..self }.checked()
    }

    /// This rig, recorded with other numbers: how long, how often.
    ///
    /// # Errors
    /// As [`Rig::new`].
    pub fn with_record(self, record: Record) -> Result<Self, SignalError> {
        Self { record, ..self }.checked()
    }

    /// This rig with other sensors in the place of its own.
    ///
    /// # Errors
    /// As [`Rig::new`].
    pub fn with_sensors(self, sensors: [Sensor; 2]) -> Result<Self, SignalError> {
        Self { sensors, ..self }.checked()
    }

    /// This rig in another gas.
    ///
    /// ```
    /// use twinlag_signal::{Broadband, Gas, Record, Rig, Sensor, Signal};
    ///
    /// let sensors = [Sensor::new("fine", 0.02), Sensor::new("coarse", 0.1)];
    /// let gas = Gas::new(300.0, Signal::Broadband(Broadband { std_k: 5.0, corner_hz: 1.0 }));
    /// let rig = Rig::new(1, Record::new(100, 0.01), gas, sensors)?;
    /// let mut gas = rig.gas().clone();
    /// gas.signal = gas.signal.excited(2.0);
    /// let louder = rig.clone().with_gas(gas)?;
    /// // The same random numbers, twice as far from the mean.
    /// let (quiet, loud) = (rig.clean(0)?.gas_c, louder.clean(0)?.gas_c);
    /// assert!(quiet.iter().zip(&loud).all(|(a, b)| (2.0 * (a - 300.0) - (b - 300.0)).abs() < 1e-9));
    /// # Ok::<(), twinlag_signal::SignalError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Rig::new`].
    pub fn with_gas(self, gas: Gas) -> Result<Self, SignalError> {
        Self { gas, ..self }.checked()
    }

    /// This rig with a different gas for one of the sensors.
    ///
    /// # Errors
    /// As [`Rig::new`]; [`SignalError::UnknownChannel`] if no sensor has the channel that it names.
    pub fn with_mismatch(self, mismatch: Mismatch) -> Result<Self, SignalError> {
        Self { mismatch: Some(mismatch), ..self }.checked()
    }

    fn checked(self) -> Result<Self, SignalError> {
        let Self { record, gas, sensors, flow, stream, mismatch, .. } = &self;
        for (sensor, within) in sensors.iter().zip(WITHIN) {
            sensor.check(within, record)?;
        }
        if sensors[0].channel == sensors[1].channel {
            return Err(SignalError::SameChannel { channel: sensors[0].channel.clone() });
        }
        if let Some(flow) = flow {
            flow.check()?;
        }
        match stream {
            Some(stream) => stream.check()?,
            None => sensors.iter().zip(WITHIN).try_for_each(|(sensor, within)| sensor.check_still(within))?,
        }
        record.check(self.run_in_s())?;
        for (sensor, within) in sensors.iter().zip(WITHIN) {
            sensor.check_step(within, record, self.surroundings(), gas.mean_c)?;
        }
        gas.check(record)?;
        if let Some(mismatch) = mismatch {
            mismatch.check(Resolution::new(gas.hold, record))?;
            mismatch.sensor(self.channels())?;
        }
        Ok(self)
    }

    /// This rig, with relative paths of a gas series taken from `dir` (usually the directory of the
    /// rig file).
    #[must_use]
    pub fn with_base_dir(mut self, dir: impl AsRef<Path>) -> Self {
        dir.as_ref().clone_into(&mut self.base_dir);
        self
    }

    /// This rig with another seed.
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

    /// What the flow does to the time constants, if it changes.
    pub fn flow(&self) -> Option<&Flow> {
        self.flow.as_ref()
    }

    /// The stream past the sensors, if its velocity is recorded.
    pub fn stream(&self) -> Option<&Stream> {
        self.stream.as_ref()
    }

    /// What the gas of one sensor differs by, if it does.
    pub fn mismatch(&self) -> Option<&Mismatch> {
        self.mismatch.as_ref()
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
    /// For many trials of one gas signal, call [`Rig::clean`] once and [`Clean::with_noise`] for
    /// each: same bytes.
    ///
    /// ```
    /// use twinlag_signal::{Gas, Noise, Record, Rig, Sensor, Signal, Tone};
    ///
    /// let tone = Tone { amplitude_k: 5.0, frequency_hz: 2.0, phase_rad: 0.0 };
    /// let mut coarse = Sensor::new("coarse", 0.1);
    /// coarse.noise = Some(Noise::white(0.2));
    /// let sensors = [Sensor::new("fine", 0.02), coarse];
    /// let rig = Rig::new(3, Record::new(40, 0.01), Gas::new(300.0, Signal::Sine(tone)), sensors)?;
    /// let trials = [rig.simulate_trial(0)?, rig.simulate_trial(1)?];
    /// assert_eq!(trials[0].t1_c, trials[1].t1_c); // one gas, and no noise in this channel
    /// assert_ne!(trials[0].t2_c, trials[1].t2_c);
    /// assert_eq!(trials[1], rig.simulate_trial(1)?); // bit by bit
    /// # Ok::<(), twinlag_signal::SignalError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Rig::clean`].
    pub fn simulate_trial(&self, trial: u64) -> Result<Simulated, SignalError> {
        Ok(self.clean(trial)?.with_noise(&mut self.noise_streams(trial)))
    }

    /// Steps of the integration of one trial, those of the run-in among them: what a simulation costs.
    ///
    /// ```
    /// # use twinlag_signal::{Gas, Record, Rig, Sensor, Signal, Tone};
    /// let tone = Tone { amplitude_k: 10.0, frequency_hz: 2.0, phase_rad: 0.0 };
    /// let gas = Gas::new(300.0, Signal::Sine(tone));
    /// let mut record = Record::new(1000, 0.01);
    /// record.settle_s = Some(1.0);
    /// record.oversampling = 4;
    /// let rig = Rig::new(1, record, gas, [Sensor::new("T1", 0.05), Sensor::new("T2", 0.3)])?;
    /// assert_eq!(rig.steps(), 4.0 * 1100.0);
    /// # Ok::<(), twinlag_signal::SignalError>(())
    /// ```
    pub fn steps(&self) -> f64 {
        self.record.steps(self.run_in_s())
    }

    /// The record of one trial before noise and ADC. Does not depend on `trial` unless
    /// [`Gas::per_trial`].
    ///
    /// # Errors
    /// What a gas series may meet: a file that cannot be read, a line that is not two numbers,
    /// times that do not increase, an end before the record's. [`SignalError::Diverged`], if
    /// radiation or a temperature-dependent time constant led to readings that are not finite.
    pub fn clean(&self, trial: u64) -> Result<Clean, SignalError> {
        let settle_samples = self.record.settle_samples(self.run_in_s()) as usize;
        let grid = Grid::new(&self.record, settle_samples, self.gas.hold);
        let gas_trial = if self.gas.per_trial { trial } else { 0 };
        let gas = GasPath::new(&self.gas, grid, &self.base_dir, &mut stream(self.seed, gas_trial, Purpose::Gas))?;
        let time_s: Vec<f64> = (0..self.record.samples).map(|k| k as f64 * self.record.sample_period_s).collect();

        let of_stream = |stream: &Stream| time_s.iter().map(|t| stream.velocity_m_per_s(*t)).collect();
        let velocity_m_per_s = self.stream.as_ref().map(of_stream);
        let mut readings_c = [self.follow(0, &gas), self.follow(1, &gas)];
        if let Some(mismatch) = &self.mismatch {
            let sensor = mismatch.sensor(self.channels())?;
            let added_k = mismatch.values_k(grid, &mut stream(self.seed, gas_trial, Purpose::Mismatch));
            readings_c[sensor] = self.follow(sensor, &gas.plus(&added_k));
        }
        let contacts = [Purpose::FirstContact, Purpose::SecondContact];
        for ((sensor, readings_c), purpose) in self.sensors.iter().zip(&mut readings_c).zip(contacts) {
            sensor.disturb(&time_s, readings_c, &mut stream(self.seed, gas_trial, purpose));
            if let Some(k) = readings_c.iter().position(|reading_c| !reading_c.is_finite()) {
                return Err(SignalError::Diverged { channel: sensor.channel.clone(), time_s: time_s[k] });
            }
        }
        cross_talk(&self.sensors, &mut readings_c);
        Ok(Clean {
            time_s,
            gas_c: gas.at_samples().collect(),
            velocity_m_per_s,
            readings_c,
            sensors: self.sensors.clone(),
            sample_period_s: self.record.sample_period_s,
        })
    }

    /// Readings of one channel in `gas`, replacement included, °C.
    fn follow(&self, sensor: usize, gas: &GasPath) -> Vec<f64> {
        let sensor = &self.sensors[sensor];
        let downstream = self.stream.as_ref().filter(|_| sensor.downstream_m > 0.0);
        let carried = downstream.map(|stream| gas.carried(stream, sensor.downstream_m));
        let gas = carried.as_ref().unwrap_or(gas);
        let follow = |sensor: &Sensor| sensor.follow(gas, self.surroundings(), self.record.oversampling);
        let mut readings_c = follow(sensor);
        if let Some((at_s, successor)) = sensor.successor() {
            let first = (0..readings_c.len()).find(|&k| k as f64 * self.record.sample_period_s >= at_s);
            let first = first.unwrap_or(readings_c.len());
            readings_c[first..].copy_from_slice(&follow(&successor)[first..]);
        }
        readings_c
    }

    fn surroundings(&self) -> Surroundings<'_> {
        Surroundings { flow: self.flow.as_ref(), stream: self.stream.as_ref() }
    }

    fn channels(&self) -> [&str; 2] {
        self.sensors.each_ref().map(|sensor| sensor.channel.as_str())
    }

    /// The run-in that the sensors need to forget their start, s.
    fn run_in_s(&self) -> f64 {
        let [first_s, second_s] = self.sensors.each_ref().map(|sensor| sensor.run_in_s(self.surroundings()));
        first_s.max(second_s)
    }

    /// The generators of the two channels' noise in one trial: streams `8 · trial + 1` and
    /// `8 · trial + 2` of the seed (`8 · trial` is the gas; from 3 on come what other effects
    /// draw).
    pub fn noise_streams(&self, trial: u64) -> [ChaCha8Rng; 2] {
        [Purpose::FirstNoise, Purpose::SecondNoise].map(|purpose| stream(self.seed, trial, purpose))
    }
}

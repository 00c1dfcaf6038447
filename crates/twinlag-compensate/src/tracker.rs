//! Gas temperature and time constants as readings come in, while the flow changes both sensors.

use std::f64::consts::PI;

use crate::error::CompensateError;
use crate::memory::{StreamMemory, TrackerMemory};
use crate::prior::Prior;
use crate::rig::Rig;
use crate::stream::Stream;

/// Factors of the time constants that are kept in view, evenly spaced in their logarithm between
/// `1/MAX_FACTOR` and `MAX_FACTOR`.
const FACTORS: usize = 41;
const MAX_FACTOR: f64 = 2.5;
/// Probability that the factor jumps to any value in a sample. A sudden change is followed once the
/// likelihood ratio of the readings exceeds one over this.
const JUMP_CHANCE_PER_SAMPLE: f64 = 1e-9;
/// Degrees of freedom of Student's distribution in which readings weigh the factors, so that a
/// single wrong one does not decide.
const STUDENT_FREEDOM: f64 = 8.0;
/// Samples for which a sensor may give no reading before those of the other one weigh no factor: alone they say of it only what is
/// assumed of the gas, a sensor that is slow and a gas that is calm looking alike. Sensors that are read in turn stay below. Chosen.
const MOST_ALONE_SAMPLES: u64 = 10;

/// By how much a sum of probabilities may differ from 1: rounding of `FACTORS` of them takes a millionth of this.
const MAX_ROUNDING: f64 = 1e-8;

/// The gas temperature and the time constants at an instant, from the readings up to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackerState {
    /// The gas temperature, °C.
    pub gas_c: f64,
    /// Variance of the gas temperature, K².
    pub variance_k2: f64,
    /// Logarithm of the time constants over those of the rig.
    pub log_factor: f64,
    /// Variance of `log_factor`.
    pub log_variance: f64,
    /// Probability that the factor is the smallest or the largest that is tracked. If it is not
    /// small, the factor has left the range.
    pub chance_beyond: f64,
    /// Normalised innovation squared, as in [`crate::Filtered`], averaged over the factors.
    pub normalised_innovation_squared: f64,
}

/// A filter for sensors whose time constants change by a common factor, as they do in flow that
/// changes.
///
/// It runs one [`Stream`] for each factor on a grid. Their likelihoods, and a random walk of the
/// logarithm of the factor between neighbours, give the probability of each factor (the forward
/// recursion of a hidden Markov model), and the gas temperature is their mixture. Memory and work
/// per sample are constant, and nothing is allocated after [`Tracker::new`].
#[derive(Clone, Debug)]
pub struct Tracker<const D: usize> {
    streams: Vec<Stream<D>>,
    log_factor: Vec<f64>,
    chance: Vec<f64>,
    /// Probabilities after the step, and the logarithms of the likelihoods.
    next: Vec<f64>,
    log_likelihood: Vec<f64>,
    /// Chance of a step to either neighbour.
    leaves: f64,
    /// Samples since either sensor was read.
    unread: [u64; 2],
}

impl<const D: usize> Tracker<D> {
    /// A filter for sensors that are read every `period_s`, whose time constants were those of
    /// `rig` and whose logarithm wanders by `change` a second, standard deviation, growing as the
    /// root of time. `None` as for [`Stream::new`].
    pub fn new(rig: &Rig, prior: &Prior, period_s: f64, change: f64) -> Option<Self> {
        let spacing = 2.0 * MAX_FACTOR.ln() / (FACTORS - 1) as f64;
        let log_factor: Vec<f64> = (0..FACTORS).map(|k| (k as f64 - (FACTORS - 1) as f64 / 2.0) * spacing).collect();
        let stream = |log: &f64| {
            let mut rig = *rig;
            rig.sensors.iter_mut().for_each(|s| s.tau_s *= log.exp());
            Stream::new(&rig, prior.level_c, &prior.terms, period_s)
        };
        let streams = log_factor.iter().map(stream).collect::<Option<Vec<_>>>()?;
        let mut chance = vec![0.0; FACTORS];
        chance[FACTORS / 2] = 1.0;
        let leaves = (0.5 * change * change * period_s / (spacing * spacing)).min(1.0 / 3.0);
        let (next, log_likelihood) = (chance.clone(), vec![0.0; FACTORS]);
        Some(Self { streams, log_factor, chance, next, log_likelihood, leaves, unread: [0; 2] })
    }

    /// Goes through so many samples without readings, as that many calls of [`Self::push`] without any would; the work grows as the
    /// logarithm of their number.
    ///
    /// Steps to either neighbour, none of which leave the grid, have the vectors `cos(π j (k + ½)/F)`, `k = 0 … F − 1`, which
    /// they shrink to `1 − 2 l (1 − cos(π j/F))`, `l` the chance of a step (Feller 1968, XVI.3); a jump leaves nothing but that
    /// of `j = 0`, which is the same everywhere.
    pub fn skip(&mut self, samples: u64) {
        self.streams.iter_mut().for_each(|stream| stream.skip(samples));
        self.unread = self.unread.map(|unread| unread.saturating_add(samples));
        let count = FACTORS as f64;
        let wave = |j: usize, k: usize| (PI * j as f64 * (k as f64 + 0.5) / count).cos();
        let left = |j: usize| {
            let of_steps = 1.0 - 2.0 * self.leaves * (1.0 - (PI * j as f64 / count).cos());
            ((1.0 - JUMP_CHANCE_PER_SAMPLE) * of_steps).powf(samples as f64)
        };
        let shares = (1..FACTORS).map(|j| {
            let share: f64 = self.chance.iter().enumerate().map(|(k, chance)| chance * wave(j, k)).sum();
            (j, left(j) * share)
        });
        let shares: Vec<(usize, f64)> = shares.collect();
        for (k, chance) in self.chance.iter_mut().enumerate() {
            let of_waves: f64 = shares.iter().map(|(j, share)| share * wave(*j, k)).sum();
            *chance = ((1.0 + 2.0 * of_waves) / count).max(0.0);
        }
    }

    /// What the readings so far have made of it.
    pub fn memory(&self) -> TrackerMemory {
        TrackerMemory {
            chance: self.chance.clone(),
            unread: self.unread,
            streams: self.streams.iter().map(StreamMemory::of).collect(),
        }
    }

    /// Goes on from where another tracker of the same sensors, gas and period was.
    ///
    /// # Errors
    /// [`CompensateError::Memory`] of a tracker with other states, which leaves this one without a meaning.
    pub fn recall(&mut self, memory: &TrackerMemory) -> Result<(), CompensateError> {
        let TrackerMemory { chance, unread, streams } = memory;
        let is_distribution =
            chance.iter().all(|chance| *chance >= 0.0) && (chance.iter().sum::<f64>() - 1.0).abs() < MAX_ROUNDING;
        if chance.len() != FACTORS || streams.len() != FACTORS || !is_distribution {
            return Err(CompensateError::Memory);
        }
        self.chance.copy_from_slice(chance);
        self.unread = *unread;
        self.streams.iter_mut().zip(streams).try_for_each(|(stream, memory)| memory.put_into(stream))
    }

    /// What is known once the next readings, °C, are; `None` for one that is missing.
    pub fn push(&mut self, reading_c: [Option<f64>; 2]) -> TrackerState {
        let last = FACTORS - 1;
        for k in 0..FACTORS {
            // At the ends of the grid what would step out stays.
            let [below, above] = [k.saturating_sub(1), (k + 1).min(last)].map(|j| self.chance[j]);
            let wandered = self.chance[k] + self.leaves * (below + above - 2.0 * self.chance[k]);
            self.next[k] = (1.0 - JUMP_CHANCE_PER_SAMPLE) * wandered + JUMP_CHANCE_PER_SAMPLE / FACTORS as f64;
        }
        let (mut gas_c, mut square, mut normalised_innovation_squared) =
            ([0.0; FACTORS], [0.0; FACTORS], [0.0; FACTORS]);
        let mut most = f64::NEG_INFINITY;
        let count = reading_c.iter().flatten().count() as f64;
        for (unread, reading_c) in self.unread.iter_mut().zip(&reading_c) {
            *unread = if reading_c.is_some() { 0 } else { unread.saturating_add(1) };
        }
        let is_alone = self.unread.iter().any(|unread| *unread > MOST_ALONE_SAMPLES);
        for (k, stream) in self.streams.iter_mut().enumerate() {
            let now = stream.push(reading_c);
            (gas_c[k], square[k], normalised_innovation_squared[k]) =
                (now.gas_c, now.variance_k2, now.normalised_innovation_squared);
            let tails = (STUDENT_FREEDOM + count) * (now.normalised_innovation_squared / STUDENT_FREEDOM).ln_1p();
            self.log_likelihood[k] = if is_alone { 0.0 } else { -0.5 * (tails + now.innovation_variance.ln()) };
            most = most.max(self.log_likelihood[k]);
        }
        let mut sum = 0.0;
        for ((next, log), chance) in self.next.iter().zip(&self.log_likelihood).zip(&mut self.chance) {
            *chance = next * (log - most).exp();
            sum += *chance;
        }
        self.chance.iter_mut().for_each(|c| *c /= sum);
        let mean = |of: &dyn Fn(usize) -> f64| (0..FACTORS).map(|k| self.chance[k] * of(k)).sum::<f64>();
        let gas = mean(&|k| gas_c[k]);
        let log_factor = mean(&|k| self.log_factor[k]);
        // Between two factors of the grid any is as good: a twelfth of the square of what lies
        // between them.
        let spacing = self.log_factor[1] - self.log_factor[0];
        let between = |k: usize| 0.5 * (gas_c[(k + 1).min(last)] - gas_c[k.saturating_sub(1)]);
        TrackerState {
            gas_c: gas,
            variance_k2: mean(&|k| square[k] + (gas_c[k] - gas).powi(2) + between(k).powi(2) / 12.0),
            log_factor,
            log_variance: mean(&|k| (self.log_factor[k] - log_factor).powi(2)) + spacing * spacing / 12.0,
            chance_beyond: self.chance[0] + self.chance[last],
            normalised_innovation_squared: mean(&|k| normalised_innovation_squared[k]),
        }
    }
}

/// A [`Tracker`] with as many states as are needed.
pub trait AnyTracker: Send + Sync {
    /// What is known once the next readings, °C, are, as of [`Tracker::push`].
    fn push(&mut self, reading_c: [Option<f64>; 2]) -> TrackerState;

    /// Goes through so many samples without readings, as [`Tracker::skip`] does.
    fn skip(&mut self, samples: u64);

    /// What the readings so far have made of it.
    fn memory(&self) -> TrackerMemory;

    /// Goes on from where another one was, as [`Tracker::recall`] does.
    ///
    /// # Errors
    /// [`CompensateError::Memory`].
    fn recall(&mut self, memory: &TrackerMemory) -> Result<(), CompensateError>;
}

impl<const D: usize> AnyTracker for Tracker<D> {
    fn push(&mut self, reading_c: [Option<f64>; 2]) -> TrackerState {
        Self::push(self, reading_c)
    }

    fn skip(&mut self, samples: u64) {
        Self::skip(self, samples);
    }

    fn memory(&self) -> TrackerMemory {
        Self::memory(self)
    }

    fn recall(&mut self, memory: &TrackerMemory) -> Result<(), CompensateError> {
        Self::recall(self, memory)
    }
}

/// A [`Tracker`] with a state of the size that `rig` and `prior` need; `None` if they need more
/// than the largest.
///
/// ```
/// use twinlag_compensate::{Prior, Rig, Sensor, Term, tracker};
/// use twinlag_signal::{Gas, Noise, Plunge, Record, Rig as Simulation, Sensor as Simulated, Signal};
///
/// // The sensors are slower by 40 % than they were when they were characterised.
/// let sensor = |name: &str, tau_s: f64| {
///     let mut sensor = Simulated::new(name, 1.4 * tau_s);
///     sensor.noise = Some(Noise::white(0.1));
///     sensor
/// };
/// let signal = Signal::Plunge(Plunge { amplitude_k: 20.0, dwell_s: 0.3, rise_s: 0.02 });
/// let sensors = [sensor("fine", 0.024), sensor("coarse", 0.117)];
/// let record = Simulation::new(1, Record::new(1000, 0.004), Gas::new(300.0, signal), sensors)?.simulate()?;
///
/// let rig = Rig::new([Sensor::new(0.024, 0.1), Sensor::new(0.117, 0.1)]);
/// let prior = Prior { level_c: 300.0, terms: vec![Term::Rough { std_k: 10.0, corner_hz: 1.0 }] };
/// let mut tracker = tracker(&rig, &prior, 0.004, 0.05).expect("few states and no delay");
/// let states = record.t1_c.iter().zip(&record.t2_c).map(|(t1, t2)| tracker.push([Some(*t1), Some(*t2)]));
/// let last = states.last().expect("there are readings");
/// // Within four standard deviations of its logarithm, which the readings have made narrow.
/// assert!((last.log_factor - 1.4_f64.ln()).abs() < 4.0 * last.log_variance.sqrt() && last.log_variance < 0.01);
/// # Ok::<(), twinlag_signal::SignalError>(())
/// ```
pub fn tracker(rig: &Rig, prior: &Prior, period_s: f64, change: f64) -> Option<Box<dyn AnyTracker>> {
    fn of<const D: usize>(rig: &Rig, prior: &Prior, period_s: f64, change: f64) -> Option<Box<dyn AnyTracker>> {
        Some(Box::new(Tracker::<D>::new(rig, prior, period_s, change)?))
    }
    let sizes = [of::<4>, of::<6>, of::<8>, of::<12>, of::<16>, of::<24>];
    sizes.into_iter().find_map(|of| of(rig, prior, period_s, change))
}

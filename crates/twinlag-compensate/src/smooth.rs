//! The gas temperature of a whole record: forward with the filter, and back with what came later.
//!
//! The way back is that of Bryson and Frazier, modified for readings taken one at a time (Bierman
//! 1973): it adds up what later readings say of the state in `λ` and `Λ`, needs no inverse of a
//! covariance, and so minds neither missing readings nor states that are known exactly.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::filter::{Belief, Update};
use crate::prior::Prior;
use crate::readings::Readings;
use crate::rig::Rig;
use crate::system::{Step, System, around};

/// Steps that differ by less are the same.
const SAME_STEP: f64 = 1e-9;

/// Which readings an estimate may use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// All readings of the record, once it is complete.
    #[default]
    Smoother,
    /// The readings up to each instant: for control, and for comparison with a stream.
    Filter,
    /// The readings up to this many instants later.
    FixedLag(usize),
}

/// The gas temperature along a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Gas {
    /// At each instant, °C.
    pub gas_c: Vec<f64>,
    /// Standard deviation of the gas temperature, K, if model and prior are right.
    pub std_k: Vec<f64>,
    /// Logarithm of the likelihood of model and prior.
    pub log_likelihood: f64,
    /// Mean square of the innovations (readings less their predictions from earlier ones) over
    /// their variance: 1 if model and prior are right.
    pub innovation_energy: f64,
    /// Number of innovations.
    pub innovations: usize,
}

/// What comes at one instant.
#[derive(Clone, Copy, Debug)]
struct Event {
    time_s: f64,
    /// The sample that the answer for this instant belongs to.
    answers: Option<usize>,
    /// The sample of the reading of each channel.
    reads: [Option<usize>; 2],
}

/// What the way back needs of an event.
struct Kept<const D: usize> {
    /// The step that led to it, and the sample that its intensity is of.
    step: usize,
    sample: usize,
    /// The gas, its covariance with the state, and its variance, before its readings.
    gas: f64,
    row: SVector<f64, D>,
    variance: f64,
    updates: [Option<Update<D>>; 2],
    /// The gas and its variance after them.
    after: [f64; 2],
}

/// Runs forward over everything.
struct Forward<const D: usize> {
    steps: Vec<Step<D>>,
    /// What the changing part of the gas adds in each step, where its intensity changes and others add
    /// as well.
    by_gas: Vec<SMatrix<f64, D, D>>,
    kept: Vec<Kept<D>>,
    /// The lines of the gas and their covariance with the state, before the readings of each event.
    lines: Vec<(f64, SVector<f64, D>)>,
    log_likelihood: f64,
    energy: f64,
    innovations: usize,
}

/// Instants in the time of the first channel, whose reading is not late.
fn events(readings: &Readings, rig: &Rig) -> Vec<Event> {
    let delay_s = rig.delay_s;
    let both = |k: usize| [0, 1].map(|i| readings.reading_c(i, k).map(|_| k));
    let times = readings.time_s().iter().enumerate();
    if delay_s == 0.0 {
        return times.map(|(k, &time_s)| Event { time_s, answers: Some(k), reads: both(k) }).collect();
    }
    let mut out: Vec<Event> = times
        .flat_map(|(k, &time_s)| {
            let [first, second] = both(k);
            let answers = |clock: usize| (rig.clock == clock).then_some(k);
            [
                Event { time_s, answers: answers(0), reads: [first, None] },
                Event { time_s: time_s - delay_s, answers: answers(1), reads: [None, second] },
            ]
        })
        .collect();
    out.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    out
}

impl<const D: usize> Forward<D> {
    fn run(
        system: &System<D>,
        readings: &Readings,
        rig: &Rig,
        level_c: f64,
        intensity: Option<&[f64]>,
    ) -> (Self, Vec<Event>) {
        let events = events(readings, rig);
        let has_lines = intensity.is_some() && system.has_lines();
        let mut belief = Belief { state: system.start(), covariance: system.before };
        let mut out = Self {
            steps: Vec::new(),
            by_gas: Vec::new(),
            kept: Vec::with_capacity(events.len()),
            lines: Vec::new(),
            log_likelihood: 0.0,
            energy: 0.0,
            innovations: 0,
        };
        let mut last_s = events.first().map_or(0.0, |e| e.time_s);
        let mut lengths: Vec<f64> = Vec::new();
        for event in &events {
            let sample = event.answers.or(event.reads[0]).or(event.reads[1]).unwrap_or(0);
            let step = out.step(
                system,
                &mut lengths,
                event.time_s - last_s,
                readings.locals(sample, level_c),
                intensity.is_some(),
            );
            last_s = event.time_s;
            belief.predict(&out.steps[step]);
            if let Some(intensity) = intensity {
                belief.covariance += out.by_gas(step) * (intensity[sample] - 1.0);
            }
            if has_lines {
                out.lines.push((system.lines.dot(&belief.state), belief.covariance * system.lines));
            }
            let row = belief.covariance * system.gas;
            let (gas, variance) = (system.gas.dot(&belief.state), system.gas.dot(&row));
            let updates = [0, 1].map(|i| {
                let value = readings.reading_c(i, event.reads[i]?)? - level_c;
                let noise = rig.sensors[i].noise_std_k;
                let update = belief.update(&system.reads[i], value, noise * noise);
                out.energy += update.innovation * update.innovation / update.variance;
                out.log_likelihood -=
                    0.5 * (update.innovation * update.innovation / update.variance + update.variance.ln());
                out.innovations += 1;
                Some(update)
            });
            let after = [system.gas.dot(&belief.state), system.gas.dot(&(belief.covariance * system.gas))];
            out.kept.push(Kept { step, sample, gas, row, variance, updates, after });
        }
        (out, events)
    }

    /// The index of the step of `length_s`.
    fn step(
        &mut self,
        system: &System<D>,
        lengths: &mut Vec<f64>,
        length_s: f64,
        locals: Option<[(crate::rig::SensorAt, f64); 2]>,
        is_modulated: bool,
    ) -> usize {
        let known = lengths.iter().position(|l| locals.is_none() && (l - length_s).abs() <= SAME_STEP * length_s.abs());
        known.unwrap_or_else(|| {
            self.steps.push(system.step(length_s, locals));
            if is_modulated && system.has_steady_drive() {
                self.by_gas.push(system.added_by_gas(length_s, locals));
            }
            lengths.push(length_s);
            self.steps.len() - 1
        })
    }

    /// What the changing part of the gas adds in a step.
    fn by_gas(&self, step: usize) -> &SMatrix<f64, D, D> {
        self.by_gas.get(step).unwrap_or(&self.steps[step].added)
    }

    /// Goes from the end of `events` back to the first, and passes what the readings from each on say of
    /// the state before them, `λ` and `Λ`.
    fn back(
        &self,
        reads: &[SVector<f64, D>; 2],
        from: usize,
        to: usize,
        mut told: impl FnMut(usize, &SVector<f64, D>, &SMatrix<f64, D, D>),
    ) {
        let mut pull = SVector::<f64, D>::zeros();
        let mut weight = SMatrix::<f64, D, D>::zeros();
        for j in (from..=to).rev() {
            let kept = &self.kept[j];
            for (i, update) in kept.updates.iter().enumerate().rev() {
                let Some(update) = update else { continue };
                // λ ← (1 − K c)ᵀ λ − c v/S, and the same of Λ.
                let c = &reads[i];
                let along = update.gain.dot(&pull);
                pull -= c * (along + update.innovation / update.variance);
                let column = weight * update.gain;
                let both = update.gain.dot(&column);
                weight -= c * column.transpose() + column * c.transpose();
                weight += c * c.transpose() * (both + 1.0 / update.variance);
            }
            told(j, &pull, &weight);
            let transition = &self.steps[kept.step].transition;
            pull = transition.tr_mul(&pull);
            weight = around(&transition.transpose(), &weight);
        }
    }
}

/// How probable readings are at an intensity of the gas, and how that changes.
#[derive(Clone, Debug)]
pub(crate) struct Score {
    pub(crate) log_likelihood: f64,
    /// What the driving noise that led to each sample seems to have been and what it was expected to
    /// be seen of it, `w λ'Cλ` and `w tr(CΛ)`: half of their difference is the slope of the
    /// logarithm of the likelihood in `ln w`.
    pub(crate) seen: Vec<f64>,
    pub(crate) expected: Vec<f64>,
    /// The gas's lines, if it has any.
    pub(crate) lines_k: Vec<f64>,
}

/// The score of an intensity, with a state of dimension `D`.
pub(crate) fn score<const D: usize>(readings: &Readings, rig: &Rig, prior: &Prior, intensity: &[f64]) -> Score {
    let system = System::<D>::new(rig, &prior.terms);
    let (forward, events) = Forward::run(&system, readings, rig, prior.level_c, Some(intensity));
    let (mut seen, mut expected) = (vec![0.0; readings.len()], vec![0.0; readings.len()]);
    let mut lines_k = vec![0.0; if system.has_lines() { readings.len() } else { 0 }];
    let last = events.len().saturating_sub(1);
    if !events.is_empty() {
        forward.back(&system.reads, 0, last, |j, pull, weight| {
            let kept = &forward.kept[j];
            let (added, factor) = (forward.by_gas(kept.step), intensity[kept.sample]);
            seen[kept.sample] += factor * pull.dot(&(added * pull));
            expected[kept.sample] += factor * added.dot(weight);
            if let Some((before, row)) = forward.lines.get(j) {
                lines_k[kept.sample] = before - row.dot(pull);
            }
        });
    }
    Score { log_likelihood: forward.log_likelihood, seen, expected, lines_k }
}

/// The gas temperature with a state of dimension `D`.
pub(crate) fn run<const D: usize>(
    readings: &Readings,
    rig: &Rig,
    prior: &Prior,
    intensity: Option<&[f64]>,
    form: Form,
) -> Gas {
    let system = System::<D>::new(rig, &prior.terms);
    let (forward, events) = Forward::run(&system, readings, rig, prior.level_c, intensity);
    let mut gas_c = vec![prior.level_c; readings.len()];
    let mut std_k = vec![0.0; readings.len()];
    let mut put = |j: usize, gas: f64, variance: f64| {
        if let Some(k) = events[j].answers {
            gas_c[k] = prior.level_c + gas;
            std_k[k] = variance.max(0.0).sqrt();
        }
    };
    let smoothed = |j: usize, pull: &SVector<f64, D>, weight: &SMatrix<f64, D, D>| {
        let kept = &forward.kept[j];
        (kept.gas - kept.row.dot(pull), kept.variance - kept.row.dot(&(weight * kept.row)))
    };
    let last = events.len().saturating_sub(1);
    match form {
        _ if events.is_empty() => {}
        Form::Smoother => forward.back(&system.reads, 0, last, |j, pull, weight| {
            let (gas, variance) = smoothed(j, pull, weight);
            put(j, gas, variance);
        }),
        Form::Filter => {
            for (j, kept) in forward.kept.iter().enumerate() {
                put(j, kept.after[0], kept.after[1]);
            }
        }
        Form::FixedLag(lag) => {
            for j in 0..events.len() {
                forward.back(&system.reads, j, (j + lag).min(last), |at, pull, weight| {
                    if at == j {
                        let (gas, variance) = smoothed(j, pull, weight);
                        put(j, gas, variance);
                    }
                });
            }
        }
    }
    Gas {
        gas_c,
        std_k,
        log_likelihood: forward.log_likelihood,
        innovation_energy: forward.energy / (forward.innovations as f64).max(1.0),
        innovations: forward.innovations,
    }
}

//! The gas temperature of a whole record: forward with the filter, and back with what came later.
//!
//! A long record goes forward once, and is then taken in stages from the last to the first: each forward again, and
//! back. So memory does not grow with the record, beside what is answered.

mod back;
mod events;
mod forward;

use std::ops::Range;

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::prior::Prior;
use crate::readings::Readings;
use crate::rig::Rig;
use back::Later;
use forward::{Filter, Gains, Kept, Stage, Task};

/// Events of a stage: with the largest state, and an intensity that changes, it takes 3 MB.
const STAGE_EVENTS: usize = 4096;

/// Which readings an estimate may use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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

/// Goes through all events in stages of so many, the last one first, and passes each with what it is part of: the sums of the
/// filter after the last event are returned.
fn stages<const D: usize>(task: &Task<'_, D>, stage_events: usize, mut pass: impl FnMut(&Stage<D>)) -> Filter<D> {
    let count = task.events.len();
    let starts: Vec<usize> = (0..count).step_by(stage_events.max(1)).collect();
    let range = |start: usize| -> Range<usize> { start..(start + stage_events).min(count) };
    let mut filter = Filter::new(task);
    let mut before = Vec::with_capacity(starts.len());
    let Some((&last, others)) = starts.split_last() else { return filter };
    for &start in others {
        before.push(filter.clone());
        filter.run(task, range(start));
    }
    pass(&filter.run(task, range(last)));
    for (&start, mut filter) in others.iter().zip(before).rev() {
        pass(&filter.run(task, range(start)));
    }
    filter
}

/// The score of an intensity, constant if there is none, with a state of dimension `D`.
pub(crate) fn score<const D: usize>(readings: &Readings, rig: &Rig, prior: &Prior, intensity: Option<&[f64]>) -> Score {
    let task = Task::<D>::new(readings, rig, prior, intensity).scored();
    let (mut seen, mut expected) = (vec![0.0; readings.len()], vec![0.0; readings.len()]);
    let mut lines_k = vec![0.0; if task.has_lines() { readings.len() } else { 0 }];
    let mut later = Later::nothing();
    let filter = stages(&task, STAGE_EVENTS, |stage| {
        later.back(&task, stage, 0..stage.kept.len(), |kept, gains, pull, weight| {
            let factor = intensity.map_or(1.0, |factors| factors[kept.sample]);
            let added = &stage.passages[gains.passage].by_gas;
            seen[kept.sample] += factor * pull.dot(&(added * pull));
            expected[kept.sample] += factor * added.dot(weight);
            if let Some(line) = lines_k.get_mut(kept.sample) {
                *line = kept.lines - gains.lines.dot(pull);
            }
        });
    });
    Score { log_likelihood: filter.log_likelihood, seen, expected, lines_k }
}

/// The gas temperature with a state of dimension `D`.
pub(crate) fn run<const D: usize>(
    readings: &Readings,
    rig: &Rig,
    prior: &Prior,
    intensity: Option<&[f64]>,
    form: Form,
) -> Gas {
    run_in_stages::<D>(&Task::new(readings, rig, prior, intensity), form, STAGE_EVENTS)
}

fn run_in_stages<const D: usize>(task: &Task<'_, D>, form: Form, stage_events: usize) -> Gas {
    let samples = task.readings.len();
    let (mut gas_c, mut std_k) = (vec![task.level_c; samples], vec![0.0; samples]);
    let mut put = |kept: &Kept, gas: f64, variance: f64| {
        if let Some(k) = kept.answers {
            gas_c[k] = task.level_c + gas;
            std_k[k] = variance.max(0.0).sqrt();
        }
    };
    let filter = match form {
        Form::Smoother => {
            let mut later = Later::nothing();
            stages(task, stage_events, |stage| {
                later.back(task, stage, 0..stage.kept.len(), |kept, gains, pull, weight| {
                    let (gas, variance) = smoothed(kept, gains, pull, weight);
                    put(kept, gas, variance);
                });
            })
        }
        Form::Filter => {
            let mut filter = Filter::new(task);
            for start in (0..task.events.len()).step_by(stage_events) {
                let stage = filter.run(task, start..(start + stage_events).min(task.events.len()));
                for kept in &stage.kept {
                    put(kept, kept.after, stage.gains[kept.gains].variance_after);
                }
            }
            filter
        }
        // Stages that overlap would run everything but their ends again.
        Form::FixedLag(lag) => stages(task, task.events.len(), |stage| {
            for j in 0..stage.kept.len() {
                let to = (j + lag + 1).min(stage.kept.len());
                let mut at_last = None;
                Later::nothing().back(task, stage, j..to, |kept, gains, pull, weight| {
                    at_last = Some((*kept, smoothed(kept, gains, pull, weight)));
                });
                if let Some((kept, (gas, variance))) = at_last {
                    put(&kept, gas, variance);
                }
            }
        }),
    };
    Gas {
        gas_c,
        std_k,
        log_likelihood: filter.log_likelihood,
        innovation_energy: filter.energy / (filter.innovations as f64).max(1.0),
        innovations: filter.innovations,
    }
}

/// The gas, about the level, and its variance, with all that came later.
fn smoothed<const D: usize>(
    kept: &Kept,
    gains: &Gains<D>,
    pull: &SVector<f64, D>,
    weight: &SMatrix<f64, D, D>,
) -> (f64, f64) {
    (kept.gas - gains.row.dot(pull), gains.variance - gains.row.dot(&(weight * gains.row)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Sensor, Term};

    const SAMPLES: usize = 3000;

    /// An even record with readings missing here and there, and a gap.
    fn readings() -> Readings {
        let time_s: Vec<f64> = (0..SAMPLES).map(|k| 0.01 * k as f64 + if k > 2300 { 0.3 } else { 0.0 }).collect();
        let wave = |lag_s: f64| time_s.iter().map(|t| 20.0 + 5.0 * (9.0 * (t - lag_s)).sin()).collect();
        let missing = [0, 1].map(|i| (0..SAMPLES).map(|k| k % 1511 == 17 + i || (1100..1105).contains(&k)).collect());
        Readings::with_missing(time_s.clone(), [wave(0.02), wave(0.1)], missing).expect("good readings")
    }

    fn rig(delay_s: f64) -> Rig {
        Rig { delay_s, ..Rig::new([Sensor::new(0.02, 0.3), Sensor::new(0.1, 0.2)]) }
    }

    fn prior() -> Prior {
        let rough = Term::Rough { std_k: 3.0, corner_hz: 2.0 };
        Prior { level_c: 20.0, terms: vec![rough, Term::Resonance { std_k: 2.0, frequency_hz: 1.5, quality: 3.0 }] }
    }

    /// What has settled is kept, with an intensity of 1 at all instants nothing is: both give the gas to what settles,
    /// [`forward::SETTLED_RELATIVE`], over the hundreds of samples that prior and sensors remember.
    #[test]
    fn kept_gains_are_those_that_are_computed() {
        let (readings, ones) = (readings(), vec![1.0; SAMPLES]);
        for delay_s in [0.0, 0.004] {
            let (rig, prior) = (rig(delay_s), prior());
            let task = Task::<8>::new(&readings, &rig, &prior, None);
            let stage = Filter::new(&task).run(&task, 0..task.events.len());
            assert!(stage.gains.len() < stage.kept.len() / 2, "{} of {}", stage.gains.len(), stage.kept.len());
            for form in [Form::Smoother, Form::Filter, Form::FixedLag(7)] {
                let got = run::<8>(&readings, &rig, &prior, None, form);
                let want = run::<8>(&readings, &rig, &prior, Some(&ones), form);
                for k in 0..SAMPLES {
                    assert!((got.gas_c[k] - want.gas_c[k]).abs() < 1e-9, "{form:?}, delay {delay_s}, sample {k}");
                    assert!((got.std_k[k] / want.std_k[k] - 1.0).abs() < 1e-9, "{form:?}, delay {delay_s}, sample {k}");
                }
                assert!((got.log_likelihood - want.log_likelihood).abs() < 1e-9 * want.log_likelihood.abs());
            }
        }
    }

    /// Stages give what one stage does: the same products, but for what has settled earlier in the one than in the other.
    #[test]
    fn a_record_in_stages_is_the_record() {
        let (readings, factors) =
            (readings(), (0..SAMPLES).map(|k| (0.01 * k as f64).sin().exp()).collect::<Vec<f64>>());
        let (rig, prior) = (rig(0.004), prior());
        for intensity in [None, Some(&factors[..])] {
            let task = Task::<8>::new(&readings, &rig, &prior, intensity);
            for form in [Form::Smoother, Form::Filter] {
                let want = run_in_stages(&task, form, 10_000);
                let got = run_in_stages(&task, form, 64);
                assert_eq!((got.innovations, got.gas_c.len()), (want.innovations, SAMPLES));
                assert!((got.log_likelihood - want.log_likelihood).abs() < 1e-9 * want.log_likelihood.abs());
                for k in 0..SAMPLES {
                    assert!((got.gas_c[k] - want.gas_c[k]).abs() < 1e-9, "{form:?}, sample {k}");
                    assert!((got.std_k[k] / want.std_k[k] - 1.0).abs() < 1e-9, "{form:?}, sample {k}");
                }
            }
        }
    }
}

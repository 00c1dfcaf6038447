//! Forward with the filter.
//!
//! While instants are even and no reading is missing, the covariance settles, and with it the gains: from then on a step
//! costs some products of vectors. An intensity that changes keeps it from settling.

use std::ops::Range;

use nalgebra::{SMatrix, SVector};

use super::events::Events;
use crate::filter::{Belief, along};
use crate::prior::Prior;
use crate::readings::Readings;
use crate::rig::{Rig, SensorAt};
use crate::sparse::Sparse;
use crate::system::{Step, System};

/// Steps that differ by less are the same.
const SAME_STEP: f64 = 1e-9;
/// Steps of different lengths that are looked through for one that is the same. Uneven stamps rounded to a few units of their
/// last digit have fewer.
const MAX_SAME_STEPS: usize = 16;
/// Change of a covariance in a step, relative to both standard deviations, below which it has settled. What remembers `n` samples
/// is then still `n` times this away from where it goes, 1e-6 of it after a million.
pub(super) const SETTLED_RELATIVE: f64 = 1e-12;

/// What is smoothed, by which model.
pub(super) struct Task<'a, const D: usize> {
    pub(super) system: System<D>,
    pub(super) readings: &'a Readings,
    pub(super) rig: &'a Rig,
    pub(super) level_c: f64,
    pub(super) intensity: Option<&'a [f64]>,
    pub(super) events: Events<'a>,
    /// Whether lines and what the gas is driven by are asked for.
    is_scored: bool,
}

impl<'a, const D: usize> Task<'a, D> {
    pub(super) fn new(readings: &'a Readings, rig: &'a Rig, prior: &Prior, intensity: Option<&'a [f64]>) -> Self {
        let (system, events) = (System::<D>::new(rig, &prior.terms), Events::new(readings, rig));
        Self { system, readings, rig, level_c: prior.level_c, intensity, events, is_scored: false }
    }

    /// This task with the score of its intensity.
    pub(super) fn scored(self) -> Self {
        Self { is_scored: true, ..self }
    }

    /// Whether lines are asked for, and the gas has some.
    pub(super) fn has_lines(&self) -> bool {
        self.is_scored && self.system.has_lines()
    }
}

/// A step of time, as it is applied.
pub(super) struct Passage<const D: usize> {
    length_s: f64,
    step: Step<D>,
    /// Its transition, and that transposed.
    forth: Sparse,
    pub(super) back: Sparse,
    /// What the changing part of the gas adds in it.
    pub(super) by_gas: SMatrix<f64, D, D>,
}

impl<const D: usize> Passage<D> {
    fn new(task: &Task<'_, D>, length_s: f64, locals: Option<[(SensorAt, f64); 2]>) -> Self {
        let step = task.system.step(length_s, locals);
        let is_asked = task.is_scored || task.intensity.is_some();
        let is_apart = is_asked && task.system.has_steady_drive();
        let by_gas = if is_apart { task.system.added_by_gas(length_s, locals) } else { step.added };
        let [forth, back] = [Sparse::of(&step.transition), Sparse::of(&step.transition.transpose())];
        Self { length_s, step, forth, back, by_gas }
    }
}

/// What readings of one kind do to the state, whatever their values.
#[derive(Clone, Copy)]
pub(super) struct Gains<const D: usize> {
    /// The passage that led to them.
    pub(super) passage: usize,
    /// The covariance of the gas with the state, and its variance, before the readings.
    pub(super) row: SVector<f64, D>,
    pub(super) variance: f64,
    /// The covariance of the gas's lines with the state before the readings, where they are asked for.
    pub(super) lines: SVector<f64, D>,
    /// Of each reading its gain and the variance of its innovation.
    pub(super) updates: [Option<(SVector<f64, D>, f64)>; 2],
    /// The variance of the gas after the readings.
    pub(super) variance_after: f64,
}

/// What the way back needs of an event.
#[derive(Clone, Copy)]
pub(super) struct Kept {
    pub(super) gains: usize,
    pub(super) sample: usize,
    pub(super) answers: Option<usize>,
    /// The gas and its lines before the readings, and the gas after them, about the level.
    pub(super) gas: f64,
    pub(super) lines: f64,
    pub(super) after: f64,
    pub(super) innovations: [f64; 2],
}

/// Some events one after the other, with what the way back needs of them.
pub(super) struct Stage<const D: usize> {
    pub(super) passages: Vec<Passage<D>>,
    pub(super) gains: Vec<Gains<D>>,
    pub(super) kept: Vec<Kept>,
}

/// Whatever makes covariances the same if it is the same: the step, and which channels are read.
#[derive(Clone, Copy, PartialEq)]
struct Kind {
    length_s: f64,
    reads: [bool; 2],
}

/// An event of the last cycle.
#[derive(Clone)]
struct Recent<const D: usize> {
    kind: Kind,
    gains: Gains<D>,
    /// Covariance of the state after the readings.
    covariance: SMatrix<f64, D, D>,
}

/// A filter on its way.
#[derive(Clone)]
pub(super) struct Filter<const D: usize> {
    belief: Belief<D>,
    last_s: f64,
    recent: [Option<Recent<D>>; 2],
    /// Events in a row whose covariance was that of one cycle before.
    agreeing: usize,
    /// Whether the covariance of the belief is older than the last event.
    is_stale: bool,
    pub(super) log_likelihood: f64,
    pub(super) energy: f64,
    pub(super) innovations: usize,
}

impl<const D: usize> Filter<D> {
    pub(super) fn new(task: &Task<'_, D>) -> Self {
        Self {
            belief: Belief { state: task.system.start(), covariance: task.system.before },
            last_s: if task.events.len() > 0 { task.events.at(0).time_s } else { 0.0 },
            recent: [None, None],
            agreeing: 0,
            is_stale: false,
            log_likelihood: 0.0,
            energy: 0.0,
            innovations: 0,
        }
    }

    /// Goes on through some events.
    pub(super) fn run(&mut self, task: &Task<'_, D>, events: Range<usize>) -> Stage<D> {
        let mut stage = Stage { passages: Vec::new(), gains: Vec::new(), kept: Vec::with_capacity(events.len()) };
        let mut places = [None; 2];
        for j in events {
            self.next(task, j, &mut stage, &mut places);
        }
        stage
    }

    /// - `places`: where the gains of the last cycle are in the stage, once they are
    fn next(&mut self, task: &Task<'_, D>, j: usize, stage: &mut Stage<D>, places: &mut [Option<usize>; 2]) {
        let (event, cycle) = (task.events.at(j), task.events.cycle());
        let sample = event.sample();
        let locals = task.readings.locals(sample, task.level_c);
        let passage = stage.passage(task, event.time_s - self.last_s, locals);
        self.last_s = event.time_s;
        let values = [0, 1].map(|i| Some(task.readings.reading_c(i, event.reads[i]?)? - task.level_c));
        let is_steady = locals.is_none() && task.intensity.is_none();
        let length_s = stage.passages[passage].length_s;
        let kind = is_steady.then(|| Kind { length_s, reads: values.map(|v| v.is_some()) });
        self.belief.state = stage.passages[passage].forth.times(&self.belief.state);
        let state = &self.belief.state;
        let (gas, lines) = (task.system.gas.dot(state), task.system.lines.dot(state));

        let phase = j % cycle;
        let recent = self.recent[phase].as_ref().filter(|r| kind == Some(r.kind));
        let (gains, innovations) = match recent {
            Some(recent) if self.agreeing >= cycle => {
                let gains = Gains { passage, ..recent.gains };
                self.is_stale = true;
                (gains, self.settled(task, &gains, values))
            }
            _ => {
                places[phase] = None;
                self.unsettled(task, j, passage, &stage.passages[passage], kind, values)
            }
        };
        for (update, innovation) in gains.updates.iter().zip(innovations) {
            if let Some((_, variance)) = update {
                let square = innovation * innovation / variance;
                self.energy += square;
                self.log_likelihood -= 0.5 * (square + variance.ln());
                self.innovations += 1;
            }
        }
        let place = *places[phase].get_or_insert_with(|| {
            stage.gains.push(gains);
            stage.gains.len() - 1
        });
        let after = task.system.gas.dot(&self.belief.state);
        stage.kept.push(Kept { gains: place, sample, answers: event.answers, gas, lines, after, innovations });
    }

    /// Readings with gains that are known.
    fn settled(&mut self, task: &Task<'_, D>, gains: &Gains<D>, values: [Option<f64>; 2]) -> [f64; 2] {
        [0, 1].map(|i| {
            let (Some((gain, _)), Some(value)) = (gains.updates[i], values[i]) else { return 0.0 };
            let innovation = value - task.system.reads[i].dot(&self.belief.state);
            self.belief.state += gain * innovation;
            innovation
        })
    }

    /// Readings whose gains follow from the covariance.
    fn unsettled(
        &mut self,
        task: &Task<'_, D>,
        j: usize,
        passage: usize,
        by: &Passage<D>,
        kind: Option<Kind>,
        values: [Option<f64>; 2],
    ) -> (Gains<D>, [f64; 2]) {
        let (system, cycle) = (&task.system, task.events.cycle());
        if std::mem::take(&mut self.is_stale)
            && let Some(last) = &self.recent[(j + cycle - 1) % cycle]
        {
            self.belief.covariance = last.covariance;
        }
        self.belief.covariance = by.forth.around(&self.belief.covariance) + by.step.added;
        if let Some(intensity) = task.intensity {
            self.belief.covariance += by.by_gas * (intensity[task.events.at(j).sample()] - 1.0);
        }
        let row = along(&self.belief.covariance, &system.gas);
        let lines = if task.has_lines() { along(&self.belief.covariance, &system.lines) } else { SVector::zeros() };
        let variance = system.gas.dot(&row);
        let mut innovations = [0.0; 2];
        let updates = [0, 1].map(|i| {
            let noise = task.rig.sensors[i].noise_std_k;
            let update = self.belief.update(&system.reads[i], values[i]?, noise * noise);
            innovations[i] = update.innovation;
            Some((update.gain, update.variance))
        });
        let variance_after = system.gas.dot(&along(&self.belief.covariance, &system.gas));
        let gains = Gains { passage, row, variance, lines, updates, variance_after };
        let covariance = &self.belief.covariance;
        let before = self.recent[j % cycle].as_ref().filter(|r| kind == Some(r.kind));
        let agrees = before.is_some_and(|r| has_settled(&r.covariance, covariance));
        self.agreeing = if agrees { self.agreeing + 1 } else { 0 };
        self.recent[j % cycle] = kind.map(|kind| Recent { kind, gains, covariance: *covariance });
        (gains, innovations)
    }
}

impl<const D: usize> Stage<D> {
    /// The passage of `length_s`: one that there is, where nothing changes along the record.
    fn passage(&mut self, task: &Task<'_, D>, length_s: f64, locals: Option<[(SensorAt, f64); 2]>) -> usize {
        let mut last = self.passages.iter().enumerate().rev().take(MAX_SAME_STEPS);
        let is_same = |p: &Passage<D>| (p.length_s - length_s).abs() <= SAME_STEP * length_s.abs();
        let known = last.find(|(_, p)| locals.is_none() && is_same(p)).map(|(index, _)| index);
        known.unwrap_or_else(|| {
            self.passages.push(Passage::new(task, length_s, locals));
            self.passages.len() - 1
        })
    }
}

/// Whether the entries of two covariances differ by nothing that matters.
pub(super) fn has_settled<const D: usize>(before: &SMatrix<f64, D, D>, now: &SMatrix<f64, D, D>) -> bool {
    let square = SETTLED_RELATIVE * SETTLED_RELATIVE;
    let is_same = |(i, j): (usize, usize)| {
        let by = now[(i, j)] - before[(i, j)];
        by * by <= square * now[(i, i)] * now[(j, j)]
    };
    (0..D).flat_map(|j| (0..=j).map(move |i| (i, j))).all(is_same)
}

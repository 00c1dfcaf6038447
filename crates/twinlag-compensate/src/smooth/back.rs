//! Back with what came later.
//!
//! The way back is that of Bryson and Frazier, modified for readings taken one at a time (Bierman
//! 1973): it adds up what later readings say of the state in `λ` and `Λ`, needs no inverse of a
//! covariance, and so minds neither missing readings nor states that are known exactly. Where the gains have
//! settled, `Λ` does so as well.

use std::ops::Range;

use nalgebra::{SMatrix, SVector};

use super::forward::{Gains, Kept, Stage, Task, has_settled};

/// What the readings from an event on say of the state before them.
pub(super) struct Later<const D: usize> {
    /// `λ`.
    pull: SVector<f64, D>,
    /// `Λ`.
    weight: SMatrix<f64, D, D>,
}

/// An event of the last cycle: its gains, and `Λ` with its readings.
struct Recent<const D: usize> {
    gains: usize,
    weight: SMatrix<f64, D, D>,
}

impl<const D: usize> Later<D> {
    /// Nothing comes later.
    pub(super) fn nothing() -> Self {
        Self { pull: SVector::zeros(), weight: SMatrix::zeros() }
    }

    /// Goes back through some events of a stage, and passes what the readings from each on say of the state before them.
    pub(super) fn back(
        &mut self,
        task: &Task<'_, D>,
        stage: &Stage<D>,
        events: Range<usize>,
        mut pass: impl FnMut(&Kept, &Gains<D>, &SVector<f64, D>, &SMatrix<f64, D, D>),
    ) {
        let cycle = task.events.cycle();
        let mut recent: [Option<Recent<D>>; 2] = [None, None];
        let mut agreeing = 0;
        // The passage that leads on from the event before, where the weight there is that of the last cycle.
        let mut stale: Option<(usize, usize)> = None;
        for j in events.clone().rev() {
            let kept = &stage.kept[j];
            let gains = &stage.gains[kept.gains];
            self.pull_by(task, kept, gains);
            let back = &stage.passages[gains.passage].back;
            let same = recent[j % cycle].as_ref().filter(|r| agreeing >= cycle && r.gains == kept.gains);
            if let Some(same) = same {
                pass(kept, gains, &self.pull, &same.weight);
                stale = Some((j % cycle, gains.passage));
            } else {
                self.refresh(stage, &recent, stale.take());
                self.weigh_by(task, gains);
                let before = recent[j % cycle].as_ref().filter(|r| r.gains == kept.gains);
                let agrees = before.is_some_and(|r| has_settled(&r.weight, &self.weight));
                agreeing = if agrees { agreeing + 1 } else { 0 };
                let comes_again = j >= events.start + cycle && stage.kept[j - cycle].gains == kept.gains;
                recent[j % cycle] =
                    if comes_again { Some(Recent { gains: kept.gains, weight: self.weight }) } else { None };
                pass(kept, gains, &self.pull, &self.weight);
                self.weight = back.around(&self.weight);
            }
            self.pull = back.times(&self.pull);
        }
        self.refresh(stage, &recent, stale);
    }

    /// The weight that a cycle has left behind.
    fn refresh(&mut self, stage: &Stage<D>, recent: &[Option<Recent<D>>; 2], stale: Option<(usize, usize)>) {
        if let Some((phase, passage)) = stale
            && let Some(last) = &recent[phase]
        {
            self.weight = stage.passages[passage].back.around(&last.weight);
        }
    }

    /// `λ ← (1 − K c)ᵀ λ − c v/S` for each reading.
    fn pull_by(&mut self, task: &Task<'_, D>, kept: &Kept, gains: &Gains<D>) {
        for i in [1, 0] {
            let Some((gain, variance)) = &gains.updates[i] else { continue };
            let along = gain.dot(&self.pull);
            self.pull -= task.system.reads[i] * (along + kept.innovations[i] / variance);
        }
    }

    /// `Λ ← (1 − K c)ᵀ Λ (1 − K c) + c cᵀ/S` for each reading.
    fn weigh_by(&mut self, task: &Task<'_, D>, gains: &Gains<D>) {
        for i in [1, 0] {
            let Some((gain, variance)) = &gains.updates[i] else { continue };
            let c = &task.system.reads[i];
            let column = self.weight * gain;
            let both = gain.dot(&column) + 1.0 / variance;
            // Most of `c` is zero.
            for k in (0..D).filter(|k| c[*k] != 0.0) {
                for l in 0..D {
                    let by = c[k] * column[l];
                    self.weight[(k, l)] -= by;
                    self.weight[(l, k)] -= by;
                    self.weight[(k, l)] += both * c[k] * c[l];
                }
            }
        }
    }
}

//! The energy of the whitened residual as a cost, with exact derivatives.

use std::cell::RefCell;
use std::ops::{ControlFlow, Range};
use std::sync::{Arc, Mutex};

use rayon::prelude::*;
use twinlag_optimise::{Cost, Derivatives, Variable};

use crate::dense;
use crate::directions::{Direction, Directions, constants, moved};
use crate::disagreement::{Again, Disagreement, Evaluator, Moved, Piece};
use crate::model::Model;
use crate::normal::{Beside, NormalEquations, Sums};
use crate::number::Number;
use crate::observations::{Observations, Stretch};
use crate::selection::{Samples, Selection, Sieve};
use crate::weighting::Weighting;
use crate::whitening::Factor;

/// Residuals, over all columns, from which on columns are computed side by side: below, threads cost more than they save
/// (some tens of microseconds against as many nanoseconds for each residual).
const MIN_PARALLEL_VALUES: usize = 10_000;

/// The sum of squares of the whitened residuals that count, filtered, and of what is known beforehand over its
/// uncertainty.
pub(crate) struct ResidualCost<'a> {
    model: &'a Model,
    observations: &'a Observations,
    selection: &'a Selection,
    pub(crate) variables: Vec<Variable>,
    memory: RefCell<Memory<'a>>,
}

/// Memory of evaluations, kept from one to the next.
struct Memory<'a> {
    evaluator: Evaluator<'a>,
    /// Parameters of the last evaluation.
    at: Vec<f64>,
    /// Its residuals that count, and what is known beforehand.
    residual: Vec<f64>,
    /// Where the residuals of each window end among all.
    ends: Vec<usize>,
    sieve: Sieve,
    /// Derivatives, one column for each direction.
    columns: Vec<Column>,
    /// Memory for as many derivatives as are computed at a time.
    spare: Mutex<Vec<Disagreement<Number>>>,
    again: Again,
}

impl Memory<'_> {
    /// The residuals of the last evaluation that count; what is known beforehand comes after them.
    fn residuals(&self) -> &[f64] {
        &self.residual[..self.ends.last().copied().unwrap_or(0)]
    }
}

/// The derivative in one direction, window after window.
#[derive(Default)]
struct Column {
    moved: Moved,
    sieve: Sieve,
    /// Derivatives of the residuals that count.
    picked: Vec<f64>,
}

/// Residuals that count, some after the others, with their derivatives.
pub(crate) struct Block<'a> {
    pub(crate) residual: &'a [f64],
    /// Their places among all.
    pub(crate) range: Range<usize>,
    /// Whether this is what is known beforehand, the last block.
    pub(crate) is_prior: bool,
    /// A column for each direction, and of what is known beforehand one for each parameter; empty where none is computed, and
    /// where all of it is zero.
    pub(crate) columns: Vec<&'a [f64]>,
}

impl Block<'_> {
    /// Appends the derivatives with respect to the parameters from `first` on to `columns`, which all have those of the blocks before.
    fn append_columns(&self, directions: &Directions, first: usize, columns: &mut [Vec<f64>]) {
        for (i, all) in columns.iter_mut().enumerate().skip(first) {
            let (start, end) = (all.len(), all.len() + self.residual.len());
            match directions.of_parameters.as_ref().filter(|_| !self.is_prior) {
                None => all.extend_from_slice(self.columns[i]),
                Some(of_parameters) => {
                    all.resize(end, 0.0);
                    for (part, weight) in &of_parameters[i] {
                        let parts = all[start..].iter_mut().zip(self.columns[*part]);
                        parts.for_each(|(sum, x)| *sum += weight * x);
                    }
                }
            }
            all.resize(end, 0.0);
        }
    }
}

/// A column for each direction.
fn first_columns<'c>(columns: &'c mut Vec<Column>, directions: &Directions) -> &'c mut [Column] {
    columns.resize_with(columns.len().max(directions.all.len()), Column::default);
    &mut columns[..directions.all.len()]
}

/// Computes what belongs to each direction in a window of so many residuals.
fn each_direction<T: Send>(
    items: &mut [T],
    directions: &Directions,
    residuals: usize,
    compute: impl Fn((&mut T, &Direction)) + Sync + Send,
) {
    let count = directions.all.iter().filter(|direction| direction.plant.is_some()).count();
    if count > 1 && count * residuals >= MIN_PARALLEL_VALUES {
        items.par_iter_mut().zip(&directions.all).for_each(compute);
    } else {
        items.iter_mut().zip(&directions.all).for_each(compute);
    }
}

impl<'a> ResidualCost<'a> {
    /// - `theta`: where parameters are held that are not fitted
    pub(crate) fn new(
        model: &'a Model,
        theta: &[f64],
        observations: &'a Observations,
        selection: &'a Selection,
    ) -> Self {
        let memory = Memory {
            evaluator: Evaluator::new(observations, model.noise_std_k()),
            at: Vec::new(),
            residual: Vec::new(),
            ends: Vec::new(),
            sieve: Sieve::default(),
            columns: Vec::new(),
            spare: Mutex::default(),
            again: Again::default(),
        };
        let variables = model.variables(theta, observations);
        Self { model, observations, selection, variables, memory: RefCell::new(memory) }
    }

    /// Number of residuals at the point that was evaluated last, prior knowledge counted.
    pub(crate) fn count(&self) -> usize {
        self.memory.borrow().residual.len()
    }

    /// The residuals alone, without prior knowledge.
    pub(crate) fn residuals(&self, theta: &[f64]) -> Vec<f64> {
        let mut memory = self.memory.borrow_mut();
        self.evaluate(theta, &mut memory);
        memory.residuals().to_vec()
    }

    /// Energy of the residuals alone, without prior knowledge.
    pub(crate) fn energy(&self, theta: &[f64]) -> f64 {
        let mut memory = self.memory.borrow_mut();
        self.evaluate(theta, &mut memory);
        let residuals = memory.residuals();
        let sum = dense::dot(residuals, residuals);
        if sum.is_finite() { sum } else { f64::INFINITY }
    }

    /// Evaluates, and keeps the residuals that count.
    fn evaluate(&self, theta: &[f64], memory: &mut Memory<'_>) {
        if memory.at == theta {
            return;
        }
        let numbers = constants(theta);
        memory.evaluator.evaluate(&self.model.plant_of(&numbers, self.observations));
        memory.at.clear();
        memory.at.extend_from_slice(theta);
        let Memory { evaluator, residual, ends, sieve, .. } = memory;
        residual.clear();
        ends.clear();
        residual.reserve_exact(evaluator.residual.len().min(self.selection.counted()) + theta.len());
        for (index, window) in evaluator.windows().iter().enumerate() {
            let values = &evaluator.residual[window.residuals()];
            sieve.pick(values, evaluator.span(index), self.selection, residual);
            ends.push(residual.len());
        }
        residual.extend(self.model.knowledge(&numbers, self.observations).map(|k| k.re));
    }

    /// The directions of the parameters from `first` on that are not held.
    fn directions(&self, theta: &[f64], first: usize) -> Directions {
        Directions::of(self.model, theta, first, |i| self.is_held(i), self.observations)
    }

    /// Visits residuals with their derivatives, window after window, and what is known beforehand at the end, of which
    /// derivatives are those with respect to the parameters. At the point that was evaluated last.
    fn walk(&self, theta: &[f64], directions: &Directions, memory: &mut Memory<'_>, mut visit: impl FnMut(Block<'_>)) {
        let Memory { evaluator, residual, ends, columns, spare, again, .. } = memory;
        let still = self.model.plant_of(&constants(theta), self.observations);
        let columns = first_columns(columns, directions);
        let mut done = 0;
        for index in 0..evaluator.windows().len() {
            let factor = evaluator.factor(&still, index, again);
            self.derive(directions, evaluator, (index, factor), spare, columns);
            let range = std::mem::replace(&mut done, ends[index])..ends[index];
            let columns = columns.iter().map(|column| &column.picked[..]).collect();
            visit(Block { residual: &residual[range.clone()], range, is_prior: false, columns });
        }
        self.visit_knowledge(theta, directions.first, done, &residual[done..], visit);
    }

    /// Evaluates and visits what [`Self::walk`] does, of which only one window is kept, as long as the visitor says.
    fn pass(
        &self,
        theta: &[f64],
        directions: &Directions,
        memory: &mut Memory<'_>,
        mut visit: impl FnMut(&[Piece], Block<'_>) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let Memory { evaluator, residual, at, sieve, columns, spare, again, .. } = memory;
        at.clear();
        let numbers = constants(theta);
        let still = self.model.plant_of(&numbers, self.observations);
        let columns = first_columns(columns, directions);
        let mut done = 0;
        evaluator.pass(&still, |evaluator, index| {
            residual.clear();
            let values = &evaluator.residual[evaluator.windows()[index].residuals()];
            sieve.pick(values, evaluator.span(index), self.selection, residual);
            let factor = evaluator.factor(&still, index, again);
            self.derive(directions, evaluator, (index, factor), spare, columns);
            let range = done..done + residual.len();
            done = range.end;
            let columns = columns.iter().map(|column| &column.picked[..]).collect();
            visit(&evaluator.pieces, Block { residual, range, is_prior: false, columns })
        })?;
        let known: Vec<f64> = self.model.knowledge(&numbers, self.observations).map(|k| k.re).collect();
        let mut goes_on = ControlFlow::Continue(());
        self.visit_knowledge(theta, directions.first, done, &known, |block| goes_on = visit(&evaluator.pieces, block));
        goes_on
    }

    /// The derivatives of the residuals of a window in each direction.
    ///
    /// - `window`: its place, and its factor
    fn derive(
        &self,
        directions: &Directions,
        evaluator: &Evaluator<'_>,
        (index, factor): (usize, &Factor),
        spare: &Mutex<Vec<Disagreement<Number>>>,
        columns: &mut [Column],
    ) {
        let compute = |(column, direction): (&mut Column, &Direction)| {
            let Column { moved, sieve, picked } = column;
            picked.clear();
            if direction.plant.is_none() {
                return;
            }
            let mut disagreement = spare.lock().expect("no thread panics").pop().unwrap_or_default();
            let values = evaluator.derivative(direction, index, factor, &mut disagreement, moved);
            sieve.pick(values, evaluator.span(index), self.selection, picked);
            if picked.iter().all(|value| *value == 0.0) {
                picked.clear();
            }
            spare.lock().expect("no thread panics").push(disagreement);
        };
        each_direction(columns, directions, evaluator.windows()[index].residuals().len(), compute);
    }

    /// Visits what is known beforehand.
    ///
    /// - `first`: the first parameter whose derivatives are computed
    /// - `done`: residuals before it
    /// - `prior`: its part of the residual
    fn visit_knowledge(
        &self,
        theta: &[f64],
        first: usize,
        done: usize,
        prior: &[f64],
        mut visit: impl FnMut(Block<'_>),
    ) {
        let known = |i: usize| -> Vec<f64> {
            let is_computed = i >= first && !self.is_held(i);
            if is_computed {
                self.model.knowledge(&moved(theta, i), self.observations).map(|k| k.eps).collect()
            } else {
                Vec::new()
            }
        };
        let known: Vec<Vec<f64>> = (0..theta.len()).map(known).collect();
        let columns = known.iter().map(Vec::as_slice).collect();
        visit(Block { residual: prior, range: done..done + prior.len(), is_prior: true, columns });
    }

    /// Half the first derivatives of the energy, `Jᵀr`, without the columns of `J`: its derivatives by the disagreement and by the
    /// covariance are computed once for all parameters. Variances of masked readings are so large that this would lose digits to
    /// them.
    pub(crate) fn slope(&self, theta: &[f64]) -> Vec<f64> {
        let is_masked = |stretch: &Arc<Stretch>| stretch.masked.iter().flatten().any(|is_masked| *is_masked);
        if self.observations.stretches.iter().any(is_masked) {
            return self.normal_equations(theta).slope;
        }
        let mut memory = self.memory.borrow_mut();
        self.evaluate(theta, &mut memory);
        let Memory { evaluator, residual, spare, again, .. } = &mut *memory;
        let (evaluator, spare) = (&*evaluator, &*spare);
        let still = self.model.plant_of(&constants(theta), self.observations);
        let adjoint = evaluator.adjoint(&still, self.gradient(evaluator, residual), again);
        let directions = self.directions(theta, 0);
        let mut slopes = vec![0.0; directions.all.len()];
        for (index, window) in evaluator.windows().iter().enumerate() {
            let factor = evaluator.factor(&still, index, again);
            let compute = |(slope, direction): (&mut f64, &Direction)| {
                let mut disagreement = spare.lock().expect("no thread panics").pop().unwrap_or_default();
                *slope += evaluator.slope(direction, index, factor, &mut disagreement, &adjoint);
                spare.lock().expect("no thread panics").push(disagreement);
            };
            each_direction(&mut slopes, &directions, window.residuals().len(), compute);
        }
        let mut slope = directions.along_parameters(slopes);
        for (i, slope) in slope.iter_mut().enumerate().filter(|(i, _)| !self.is_held(*i)) {
            *slope += self
                .model
                .knowledge(&moved(theta, i), self.observations)
                .map(|known| known.re * known.eps)
                .sum::<f64>();
        }
        slope
    }

    /// Half the gradient of the energy by the whitened residual, of which those that count are `residual`, filtered.
    fn gradient(&self, evaluator: &Evaluator<'_>, residual: &[f64]) -> Vec<f64> {
        let mut counted = residual.iter();
        let mut out = Vec::with_capacity(evaluator.residual.len());
        for piece in &evaluator.pieces {
            let of_sample =
                |sample: usize| if self.selection.holds(sample) { *counted.next().unwrap_or(&0.0) } else { 0.0 };
            let filtered: Vec<f64> = (piece.first_sample..piece.first_sample + piece.count).map(of_sample).collect();
            out.extend(self.selection.weighting.transposed(&filtered));
        }
        out
    }

    fn is_held(&self, i: usize) -> bool {
        self.variables[i].lower == self.variables[i].upper
    }

    /// Residual and derivatives at the one point that is of interest; columns of the parameters before `first` are left empty.
    pub(crate) fn into_linearised(self, theta: &[f64], first: usize) -> Linearised {
        let memory = &mut *self.memory.borrow_mut();
        // No more memory than it takes: of a long record the columns are most of all that there is.
        let most = self.observations.samples().min(self.selection.counted()) + theta.len();
        let length = |i: usize| if i >= first { most } else { 0 };
        let mut columns: Vec<Vec<f64>> = (0..theta.len()).map(|i| Vec::with_capacity(length(i))).collect();
        let directions = self.directions(theta, first);
        let mut residual = Vec::new();
        if memory.evaluator.keeps_factors() {
            self.evaluate(theta, memory);
            self.walk(theta, &directions, memory, |block| block.append_columns(&directions, first, &mut columns));
            residual = std::mem::take(&mut memory.residual);
        } else {
            residual.reserve_exact(most);
            let all = self.pass(theta, &directions, memory, |_, block| {
                residual.extend_from_slice(block.residual);
                block.append_columns(&directions, first, &mut columns);
                ControlFlow::Continue(())
            });
            debug_assert!(all.is_continue(), "each window is visited");
        }
        columns[first..].iter_mut().for_each(|column| column.resize(residual.len(), 0.0));
        Linearised { columns, samples: self.selection.samples(&memory.evaluator.pieces).collect(), residual }
    }

    /// Whether the record is short enough for all of it to be in memory.
    pub(crate) fn is_kept(&self) -> bool {
        self.memory.borrow().evaluator.keeps_factors()
    }

    /// What [`Self::into_linearised`] gives, window after window, of which one is in memory, and what is known beforehand last.
    pub(crate) fn visit_linearised(self, theta: &[f64], mut visit: impl FnMut(&Linearised)) {
        let directions = self.directions(theta, 0);
        let mut rows =
            Linearised { samples: Samples::default(), residual: Vec::new(), columns: vec![Vec::new(); theta.len()] };
        let (mut samples, mut pieces_seen) = (Samples::default(), 0);
        let all = self.pass(theta, &directions, &mut self.memory.borrow_mut(), |pieces, block| {
            samples.append(self.selection.samples(&pieces[pieces_seen..]));
            pieces_seen = pieces.len();
            rows.samples = samples.take_first(if block.is_prior { 0 } else { block.residual.len() });
            debug_assert!(block.is_prior || rows.samples.len() == block.residual.len(), "a residual for each sample");
            rows.residual.clear();
            rows.residual.extend_from_slice(block.residual);
            rows.columns.iter_mut().for_each(Vec::clear);
            block.append_columns(&directions, 0, &mut rows.columns);
            visit(&rows);
            ControlFlow::Continue(())
        });
        debug_assert!(all.is_continue(), "each window is visited");
    }

    /// The normal equations at a point, without what only [`Model::scored_normal_equations`] has.
    pub(crate) fn normal_equations(&self, theta: &[f64]) -> NormalEquations {
        let mut memory = self.memory.borrow_mut();
        self.evaluate(theta, &mut memory);
        self.summed(theta, &mut memory, None, None)
    }

    /// The normal equations at the one point that is of interest: of a long record one window is in memory.
    ///
    /// - `beside`: what is known of the columns, as [`Model::normal_equations`] has it
    /// - `filter`: that of the covariance of the slope, where that is of interest
    pub(crate) fn into_normal_equations(
        self,
        theta: &[f64],
        beside: Option<Beside<'_>>,
        filter: Option<&Weighting>,
    ) -> NormalEquations {
        let memory = &mut *self.memory.borrow_mut();
        if !memory.evaluator.keeps_factors() {
            let known = beside.and_then(|beside| self.summed_in_passing(theta, memory, Some(beside), filter));
            let out = known.or_else(|| self.summed_in_passing(theta, memory, None, filter));
            return out.expect("without another model there is nothing to differ from");
        }
        self.evaluate(theta, memory);
        let pieces = &memory.evaluator.pieces;
        let is_beside = |beside: &Beside<'_>| {
            beside.agrees_with(&memory.residual, 0) && self.selection.samples(pieces).eq(beside.without.samples.iter())
        };
        let known = beside.filter(is_beside).map(|beside| beside.without);
        self.summed(theta, memory, known, filter)
    }

    /// Sums at the point that was evaluated last.
    ///
    /// - `known`: a model of the same residuals
    fn summed(
        &self,
        theta: &[f64],
        memory: &mut Memory<'_>,
        known: Option<&Linearised>,
        filter: Option<&Weighting>,
    ) -> NormalEquations {
        let directions = self.directions(theta, known.map_or(0, |known| known.columns.len()));
        let mut sums = Sums::of(&directions, known, filter);
        self.walk(theta, &directions, memory, |block| sums.add(&block));
        sums.normal_equations()
    }

    /// Sums of a record of which one window is in memory; `None` once residuals are not those of the model beside.
    fn summed_in_passing(
        &self,
        theta: &[f64],
        memory: &mut Memory<'_>,
        beside: Option<Beside<'_>>,
        filter: Option<&Weighting>,
    ) -> Option<NormalEquations> {
        let known = beside.map(|beside| beside.without);
        let directions = self.directions(theta, known.map_or(0, |known| known.columns.len()));
        let mut sums = Sums::of(&directions, known, filter);
        let mut pieces_seen = 0;
        let all = self.pass(theta, &directions, memory, |pieces, block| {
            let is_beside = |beside: &Beside<'_>| {
                // Of each piece before the first window of it is summed, and of all once there are no more of them.
                let has_samples = (pieces.len() == pieces_seen && !block.is_prior)
                    || beside.has_samples(self.selection.samples(pieces), block.is_prior);
                has_samples && beside.agrees_with(block.residual, block.range.start)
            };
            if !beside.as_ref().is_none_or(is_beside) {
                return ControlFlow::Break(());
            }
            pieces_seen = pieces.len();
            sums.add(&block);
            ControlFlow::Continue(())
        });
        all.is_continue().then(|| sums.normal_equations())
    }
}

impl Cost for ResidualCost<'_> {
    fn value(&self, theta: &[f64]) -> f64 {
        let mut memory = self.memory.borrow_mut();
        self.evaluate(theta, &mut memory);
        dense::dot(&memory.residual, &memory.residual)
    }

    fn derivatives(&self, theta: &[f64]) -> Option<Derivatives> {
        let NormalEquations { energy, slope, products, .. } = self.normal_equations(theta);
        let twice = |row: Vec<f64>| row.into_iter().map(|x| 2.0 * x).collect();
        Some(Derivatives {
            value: energy,
            gradient: twice(slope),
            curvature: products.into_iter().map(twice).collect(),
        })
    }
}

/// A whitened residual with its derivatives.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Linearised {
    /// Samples of the residuals; prior knowledge comes after them in both of the others.
    pub samples: Samples,
    /// Residuals that count, filtered.
    pub residual: Vec<f64>,
    /// One column for each parameter.
    pub columns: Vec<Vec<f64>>,
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use finitediff::vec::central_jacobian;
    use twinlag_optimise::Scale;

    use super::*;
    use crate::disagreement::Window;
    use crate::effect::{Context, Identifier, Parameter, Shared, candidates, varying};
    use crate::instants::Instants;
    use crate::prepare::Prepared;
    use crate::settings::Settings;

    const SAMPLES: usize = 240;
    const TAU_S: [f64; 2] = [3.0, 9.0];

    /// How the readings of a record were taken.
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Kind {
        Even,
        Uneven,
        /// Even, with readings that say nothing.
        Masked,
        /// Even, of sensors that move against the direction in which they are counted.
        Moving,
        /// Even, in two records of one rig.
        Joined,
        /// Even, in two records of one rig, each in a steady flow.
        Steady,
        /// Even, in two records of one rig, each in a flow that is steady but for the last bit of one value.
        NearlySteady,
    }

    /// Two lags in a gas of three tones, with some hundredths of a kelvin of noise, and a flow beside them.
    fn record(kind: Kind) -> Observations {
        let time_s: Vec<f64> = (0..SAMPLES)
            .map(|k| k as f64 + if kind == Kind::Uneven { 0.15 * (1.7 * k as f64).sin() } else { 0.0 })
            .collect();
        // Each tone through a lag, as it is long after its start.
        let reading = |t: f64, tau_s: f64| {
            let tones = [(0.031, 30.0), (0.11, 20.0), (0.35, 8.0)];
            let through = |(omega, amplitude_k): (f64, f64)| {
                let x = omega * tau_s;
                amplitude_k * ((omega * t).sin() - x * (omega * t).cos()) / (1.0 + x * x)
            };
            400.0 + tones.into_iter().map(through).sum::<f64>()
        };
        // A sequence without order: what it is does not matter, only that it is no function of the gas.
        let noise = |k: usize, i: usize| 0.05 * ((k * k * 7 + 13 * i + k) as f64 * 2.399).sin();
        let channel = |i: usize| (0..SAMPLES).map(|k| reading(time_s[k], TAU_S[i]) + noise(k, i)).collect();
        let flow: Vec<f64> = time_s.iter().map(|t| 5.0 + (0.05 * t).sin()).collect();
        let masked = [0, 1].map(|i| (0..SAMPLES).map(|k| kind == Kind::Masked && (k + 31 * i) % 97 == 5).collect());
        let channels: [Vec<f64>; 2] = [channel(0), channel(1)];
        let period_s = (kind != Kind::Uneven).then_some(1.0);
        let of = |samples: Range<usize>| {
            let stretch = Stretch::new(
                time_s[samples.clone()].to_vec(),
                channels.each_ref().map(|c| c[samples.clone()].to_vec()),
            );
            let stretch = stretch.with_missing(masked.each_ref().map(|m: &Vec<bool>| m[samples.clone()].to_vec()));
            let mut steady = vec![4.0 + samples.start as f64 / 100.0; samples.len()];
            if kind == Kind::NearlySteady {
                steady[5] = steady[5].next_up();
            }
            let stretch = match kind {
                Kind::Steady | Kind::NearlySteady => stretch.with_flow(steady),
                Kind::Moving => stretch.with_motion(flow[samples].iter().map(|v| -v).collect()),
                _ => stretch.with_flow(flow[samples].to_vec()),
            };
            Observations::new(vec![stretch], period_s).expect("a record of 60 samples or more")
        };
        match kind {
            Kind::Joined | Kind::Steady | Kind::NearlySteady => {
                Observations::joined(&[of(0..130), of(130..SAMPLES)]).expect("two records")
            }
            _ => of(0..SAMPLES),
        }
    }

    /// Every candidate of every effect, in all sizes, and what is made for other questions.
    fn effects(context: &Context) -> Vec<Shared> {
        let all = candidates(&Identifier::ALL, context);
        let sizes: Vec<Shared> = all.iter().flat_map(|e| e.sizes()).collect();
        let smooth = varying::smooth(4, context.ends_s, context.samples, 2.0);
        let others = [varying::step(100.5), varying::ratio(context.ends_s)].into_iter().chain(smooth);
        all.into_iter().chain(sizes).chain(others).collect()
    }

    /// The same record without some of its middle, so that one stretch has fewer disagreements than a delay's band is wide.
    fn in_stretches(observations: &Observations) -> Observations {
        let all = &observations.stretches[0];
        let cut = |samples: Range<usize>| {
            let reading_c = [0, 1].map(|i| all.reading_c[i][samples.clone()].to_vec());
            let flow = samples.clone().map(|k| 5.0 + (0.05 * k as f64).sin()).collect();
            Stretch::new(all.time_s.of(samples).collect(), reading_c).with_flow(flow)
        };
        let mut stretches = vec![cut(0..140), cut(142..163), cut(165..SAMPLES)];
        if observations.period_s.is_none() {
            stretches[1].time_s = Instants::even(142.0, 1.0, 21);
        }
        Observations::new(stretches, observations.period_s).expect("a record of 233 samples")
    }

    fn context(observations: &Observations) -> Context {
        let mut context = Prepared::new(observations, &Settings::default()).expect("a sound record").context;
        context.tau_s = TAU_S;
        context.lines = vec![(0.2, 0), (0.2, 1)];
        context
    }

    fn selection(observations: &Observations) -> Selection {
        Prepared::new(observations, &Settings::default()).expect("a sound record").everything
    }

    /// The derivatives of the residual with respect to every parameter of every effect are those of a derivative
    /// checker, on even, uneven and masked readings, of sensors that move, and in several records, in flows that are steady too. Its central differences
    /// reach 6e-6 of a hundred times a parameter's size, 6e-4 of it: they are wrong by a third derivative times 6e-8. In
    /// units of the size that is up to some thirty times the first (of `x⁻⁴`: 4 · 5 · 6 / 4), so the bound is 2e-6 of the
    /// largest derivative. Where
    /// readings are masked the noise is taken for 5 K, so that a masked one has 1e4 times the variance of the others and
    /// not 1e8: it multiplies the rounding that the differences see.
    #[test]
    fn derivatives_of_every_effect_are_exact() {
        for kind in [Kind::Even, Kind::Uneven, Kind::Masked, Kind::Moving, Kind::Joined, Kind::Steady] {
            let observations = record(kind);
            let (context, selection) = (context(&observations), selection(&observations));
            for effect in effects(&context) {
                let name = effect.identifier().name();
                let noise_std_k = if kind == Kind::Masked { [5.0, 7.0] } else { [0.05, 0.07] };
                let model = Model::new(&[], noise_std_k).with(effect.clone());
                // Off the start, where some derivatives vanish; all parameters together, since those of a spline add up.
                let together = 0.7 / effect.parameters().len() as f64;
                let off = |(p, x): (&Parameter, f64)| match p.variable.scale {
                    Scale::Logarithmic => 1.1 * x,
                    Scale::Linear { typical } => x + together * typical,
                };
                let start = effect.starts().remove(0);
                let values = effect.parameters().iter().zip(start).map(off);
                let theta: Vec<f64> = TAU_S.into_iter().chain(values).collect();
                let new = || ResidualCost::new(&model, &theta, &observations, &selection);
                let cost = new();
                let size = |i: usize| match cost.variables[i].scale {
                    Scale::Logarithmic => 100.0 * theta[i],
                    Scale::Linear { typical } => 100.0 * typical,
                };
                let residual = |z: &Vec<f64>| {
                    let theta: Vec<f64> = z.iter().enumerate().map(|(i, z)| z * size(i)).collect();
                    Ok(new().into_linearised(&theta, theta.len()).residual)
                };
                let z: Vec<f64> = theta.iter().enumerate().map(|(i, x)| x / size(i)).collect();
                let want = central_jacobian(&residual)(&z).expect("residuals are finite");
                let got = new().into_linearised(&theta, 0).columns;
                for i in (0..theta.len()).filter(|i| !cost.is_held(*i)) {
                    let largest = want.iter().map(|row| row[i].abs()).fold(0.0, f64::max);
                    for (k, row) in want.iter().enumerate() {
                        let got = got[i][k] * size(i);
                        assert!(
                            (got - row[i]).abs() < 2e-6 * largest,
                            "{kind:?}, {name}, parameter {i}, residual {k}: got {got}, want {}",
                            row[i]
                        );
                    }
                }
            }
        }
    }

    /// Residuals and derivatives of a record that is whitened in windows, or derived in blocks, are those of the whole, to
    /// rounding. Readings of 400 K are rounded to 5e-14 K, 1e-12 of the noise of 0.05 K, and a whitened value adds up some
    /// tens: 3e-11. A derivative of the factor counts as settled at 1e-13, and some hundred rows follow each other: 1e-11. The
    /// bound is twice their sum, 1e-10 of the largest.
    #[test]
    fn windows_give_what_the_whole_gives() {
        for (kind, is_cut) in [(Kind::Even, false), (Kind::Masked, false), (Kind::Even, true), (Kind::Steady, false)] {
            let observations = if is_cut { in_stretches(&record(kind)) } else { record(kind) };
            let (context, selection) = (context(&observations), selection(&observations));
            for effect in effects(&context) {
                let model = Model::new(&[], [0.05, 0.07]).with(effect.clone());
                let theta: Vec<f64> = TAU_S.into_iter().chain(effect.starts().remove(0)).collect();
                let cost = |window_samples: usize, block_samples: usize| {
                    let cost = ResidualCost::new(&model, &theta, &observations, &selection);
                    let mut memory = cost.memory.borrow_mut();
                    memory.evaluator.window_samples = window_samples;
                    memory.evaluator.max_kept_samples = window_samples;
                    memory.evaluator.block_samples = block_samples;
                    drop(memory);
                    cost
                };
                let whole = cost(SAMPLES, SAMPLES).into_linearised(&theta, 0);
                let visited = {
                    let mut all = Linearised {
                        samples: Samples::default(),
                        residual: Vec::new(),
                        columns: vec![Vec::new(); theta.len()],
                    };
                    cost(37, SAMPLES).visit_linearised(&theta, |rows| {
                        all.samples.append(rows.samples.iter());
                        all.residual.extend(&rows.residual);
                        all.columns.iter_mut().zip(&rows.columns).for_each(|(all, column)| all.extend(column));
                    });
                    all
                };
                let [windows, blocks, both] =
                    [(37, SAMPLES), (SAMPLES, 16), (64, 5)].map(|(w, b)| cost(w, b).into_linearised(&theta, 0));
                for cut in [visited, windows, blocks, both] {
                    assert_eq!(whole.samples, cut.samples);
                    let all = |lin: &Linearised| [std::slice::from_ref(&lin.residual), &lin.columns[..]].concat();
                    for (want, got) in all(&whole).iter().zip(&all(&cut)) {
                        let largest = want.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
                        for (k, (want, got)) in want.iter().zip(got).enumerate() {
                            let name = effect.identifier().name();
                            assert!((got - want).abs() <= 1e-10 * largest, "{kind:?}, {name}, {k}: {got}, and {want}");
                        }
                    }
                }
            }
        }
    }

    /// Where the flow is steady, rows of weights are the same and the factor settles; where it differs by a rounding, each row has its
    /// own. The bound is that of windows.
    #[test]
    fn a_steady_flow_gives_what_one_gives_that_differs_by_a_rounding() {
        let of_flow = [Identifier::VARYING_TIME_CONSTANT, Identifier::SEPARATION];
        let [steady, nearly] = [Kind::Steady, Kind::NearlySteady].map(|kind| {
            let record = record(kind);
            let selection = selection(&record);
            let of = |effect: Shared, off: f64| {
                let model = Model::new(&[], [0.05, 0.07]).with(effect.clone());
                let values = effect.starts().remove(0).into_iter().map(|x| x + off);
                let theta: Vec<f64> = TAU_S.into_iter().chain(values).collect();
                let lin = ResidualCost::new(&model, &theta, &record, &selection).into_linearised(&theta, 0);
                [vec![lin.residual], lin.columns].concat()
            };
            let effects = candidates(&of_flow, &context(&record));
            // A negative delay leads out of a record at its first sample.
            let both_ways = |effect: Shared| [of(effect.clone(), 0.3), of(effect, -0.7)];
            effects.into_iter().flat_map(both_ways).collect::<Vec<_>>()
        });
        assert_eq!(steady.len(), nearly.len());
        for (i, (got, want)) in steady.iter().zip(&nearly).enumerate() {
            for (got, want) in got.iter().zip(want) {
                let largest = want.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
                assert_eq!(got.len(), want.len());
                for (k, (got, want)) in got.iter().zip(want).enumerate() {
                    assert!(
                        (got - want).abs() <= 1e-10 * largest,
                        "{i}, {k}: got {got}, want {want} within {largest}e-10"
                    );
                }
            }
        }
    }

    /// The slope of the energy without columns is that of columns, and of a record in windows that of the whole: both are sums
    /// of some hundred products, each with the rounding of the test above, 1e-10 of the largest residual and derivative at
    /// most. The bound is that of the product of their lengths.
    #[test]
    fn the_slope_is_that_of_the_columns() {
        let mut most_bands = 0;
        let kinds = [
            (Kind::Even, false),
            (Kind::Uneven, false),
            (Kind::Even, true),
            (Kind::Uneven, true),
            (Kind::Steady, false),
        ];
        for (kind, is_cut) in kinds {
            let observations = if is_cut { in_stretches(&record(kind)) } else { record(kind) };
            let (context, selection) = (context(&observations), selection(&observations));
            for effect in effects(&context) {
                let model = Model::new(&[], [0.05, 0.07]).with(effect.clone());
                let mut theta: Vec<f64> = TAU_S.into_iter().chain(effect.starts().remove(0)).collect();
                if effect.identifier() == Identifier::DELAY {
                    // From the middle of an interval to a sample: it ends in one interval here and in the next one there.
                    theta[2] = 0.5;
                }
                for window_samples in [SAMPLES, 37] {
                    let cost = ResidualCost::new(&model, &theta, &observations, &selection);
                    let mut memory = cost.memory.borrow_mut();
                    memory.evaluator.window_samples = window_samples;
                    memory.evaluator.max_kept_samples = window_samples;
                    drop(memory);
                    let NormalEquations { slope: want, products, energy, .. } = cost.normal_equations(&theta);
                    let slope = cost.slope(&theta);
                    let of_window = |windows: &[Window]| windows.iter().map(Window::band).collect::<BTreeSet<usize>>();
                    most_bands = most_bands.max(of_window(cost.memory.borrow().evaluator.windows()).len());
                    for (i, (got, want)) in slope.iter().zip(&want).enumerate() {
                        let bound = 1e-10 * (energy * products[i][i]).sqrt();
                        let name = effect.identifier().name();
                        assert!((got - want).abs() <= bound, "{kind:?}, {name}, {i}: {got}, and {want} ± {bound}");
                    }
                }
            }
        }
        assert!(most_bands > 1, "stretches of uneven samples whose delays reach over more of them than others");
    }

    /// Residuals that are filtered window by window twice give the sums of those that are kept: they are the same numbers.
    #[test]
    fn residuals_that_are_not_kept_give_the_same_sums() {
        for kind in [Kind::Even, Kind::Uneven, Kind::Masked] {
            let observations = in_stretches(&record(kind));
            let (context, selection) = (context(&observations), selection(&observations));
            let two_lags = Model::new(&[], [0.05, 0.07]);
            let without = two_lags.linearised(&TAU_S, &observations, &selection);
            for effect in effects(&context) {
                let model = two_lags.with(effect.clone());
                let theta: Vec<f64> = TAU_S.into_iter().chain(effect.starts().remove(0)).collect();
                let cost = || {
                    let cost = ResidualCost::new(&model, &theta, &observations, &selection);
                    let mut memory = cost.memory.borrow_mut();
                    (memory.evaluator.window_samples, memory.evaluator.max_kept_samples) = (37, 37);
                    drop(memory);
                    cost
                };
                let (kept, passed) =
                    (cost().normal_equations(&theta), cost().into_normal_equations(&theta, None, None));
                let name = effect.identifier().name();
                assert_eq!(passed, kept, "{kind:?}, {name}");
                // A difference that any residual keeps within, and one that none does.
                for (max_difference, is_beside) in [(1e9, true), (0.0, false)] {
                    let beside = Beside { without: &without, max_difference };
                    let got = cost().into_normal_equations(&theta, Some(beside), None);
                    let has_samples = selection.samples(&cost().pieces_at(&theta)).eq(without.samples.iter());
                    assert_eq!(got.is_beside, is_beside && has_samples, "{kind:?}, {name}, {max_difference}");
                }
            }
        }
    }

    impl ResidualCost<'_> {
        /// Pieces of the record at a point.
        fn pieces_at(&self, theta: &[f64]) -> Vec<crate::disagreement::Piece> {
            let mut memory = self.memory.borrow_mut();
            self.evaluate(theta, &mut memory);
            std::mem::take(&mut memory.evaluator.pieces)
        }
    }

    /// An effect whose parameters are those of its absence leaves the residual as it is, to rounding: of readings of
    /// 400 K over noise of 0.05 K each rounding leaves 9e-13, some ten of them three times that, and the largest of
    /// thousands four times that again, 1.1e-11. The bound is twice as much. Effects that add factors to both inverses are smoothed once more, and left out.
    #[test]
    fn an_effect_of_no_size_changes_nothing() {
        let adds_factors = ["delay", "separation", "second-order", "slow-mode", "coloured-noise", "input-mismatch"];
        for kind in [Kind::Even, Kind::Uneven, Kind::Masked] {
            let observations = record(kind);
            let (context, selection) = (context(&observations), selection(&observations));
            let two_lags = Model::new(&[], [0.05, 0.07]);
            let want = two_lags.linearised(&TAU_S, &observations, &selection).residual;
            for effect in effects(&context).into_iter().filter(|e| !adds_factors.contains(&e.identifier().name())) {
                let neutral = |p: &Parameter| p.neutral().unwrap_or(0.0);
                let theta: Vec<f64> = TAU_S.into_iter().chain(effect.parameters().iter().map(neutral)).collect();
                let model = two_lags.with(effect.clone());
                let got = model.linearised(&theta, &observations, &selection).residual;
                for (k, (got, want)) in got.iter().zip(&want).enumerate() {
                    let name = effect.identifier().name();
                    assert!((got - want).abs() < 2.2e-11, "{kind:?}, {name}, residual {k}: got {got}, want {want}");
                }
            }
        }
    }
}

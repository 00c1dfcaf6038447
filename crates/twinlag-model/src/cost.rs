//! The energy of the whitened residual as a cost, with exact derivatives.

use std::cell::RefCell;

use twinlag_optimise::{Cost, Derivatives, Variable};

use crate::dense;
use crate::disagreement::Evaluator;
use crate::model::Model;
use crate::number::Number;
use crate::observations::Observations;
use crate::selection::Selection;

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
    /// Derivatives of them, one column for each parameter; empty for one that is held.
    columns: Vec<Vec<f64>>,
    values: Vec<f64>,
    filtered: Vec<f64>,
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
            columns: vec![Vec::new(); theta.len()],
            values: Vec::new(),
            filtered: Vec::new(),
        };
        let variables = model.variables(theta, observations);
        Self { model, observations, selection, variables, memory: RefCell::new(memory) }
    }

    /// Number of residuals at the point that was evaluated last, prior knowledge counted.
    pub(crate) fn count(&self) -> usize {
        self.memory.borrow().residual.len()
    }

    /// Energy of the residuals alone, without prior knowledge.
    pub(crate) fn energy(&self, theta: &[f64]) -> f64 {
        let mut memory = self.memory.borrow_mut();
        self.evaluate(theta, &mut memory);
        let known = self.known(&constants(theta)).count();
        let residuals = &memory.residual[..memory.residual.len() - known];
        let sum = dense::dot(residuals, residuals);
        if sum.is_finite() { sum } else { f64::INFINITY }
    }

    /// What is known beforehand, over its uncertainty.
    fn known<'b>(&'b self, theta: &'b [Number]) -> impl Iterator<Item = Number> + 'b {
        let of_tau = self.model.known.iter().filter_map(|known| Some((known, known.std_s?)));
        let of_tau = of_tau.map(|(known, std_s)| (theta[known.sensor] - known.value_s) / std_s);
        of_tau.chain(self.model.prior(theta))
    }

    fn evaluate(&self, theta: &[f64], memory: &mut Memory<'_>) {
        if memory.at == theta {
            return;
        }
        let numbers = constants(theta);
        memory.evaluator.evaluate(&self.model.plant_of(&numbers, self.observations));
        let Memory { evaluator, residual, filtered, .. } = memory;
        residual.clear();
        self.selection.pick(&evaluator.residual, &evaluator.pieces, filtered, residual);
        residual.extend(self.known(&numbers).map(|k| k.re));
        memory.at.clear();
        memory.at.extend_from_slice(theta);
    }

    /// Computes the columns of the parameters from `first` on.
    fn differentiate(&self, theta: &[f64], first: usize, memory: &mut Memory<'_>) {
        self.evaluate(theta, memory);
        let Memory { evaluator, columns, values, filtered, .. } = memory;
        for i in first..theta.len() {
            let column = &mut columns[i];
            column.clear();
            if self.is_held(i) {
                continue;
            }
            let mut numbers = constants(theta);
            numbers[i] = numbers[i].derivative();
            let functions = self.model.sensors_of_functions(i);
            evaluator.derivative(&self.model.plant_of(&numbers, self.observations), functions, values);
            self.selection.pick(values, &evaluator.pieces, filtered, column);
            column.extend(self.known(&numbers).map(|k| k.eps));
        }
    }

    fn is_held(&self, i: usize) -> bool {
        self.variables[i].lower == self.variables[i].upper
    }

    /// Residual and derivatives at a point; columns of the parameters before `first` are left empty.
    pub(crate) fn linearised(&self, theta: &[f64], first: usize) -> Linearised {
        let mut memory = self.memory.borrow_mut();
        self.differentiate(theta, first, &mut memory);
        let residual = memory.residual.clone();
        let columns = (0..theta.len()).map(|i| {
            let column = &memory.columns[i];
            if i >= first && column.is_empty() { vec![0.0; residual.len()] } else { column.clone() }
        });
        Linearised { columns: columns.collect(), samples: self.selection.samples(&memory.evaluator.pieces), residual }
    }

    /// Samples of the residuals at a point.
    pub(crate) fn samples(&self, theta: &[f64]) -> Vec<usize> {
        let mut memory = self.memory.borrow_mut();
        self.evaluate(theta, &mut memory);
        self.selection.samples(&memory.evaluator.pieces)
    }
}

impl Cost for ResidualCost<'_> {
    fn value(&self, theta: &[f64]) -> f64 {
        let mut memory = self.memory.borrow_mut();
        self.evaluate(theta, &mut memory);
        dense::dot(&memory.residual, &memory.residual)
    }

    fn derivatives(&self, theta: &[f64]) -> Option<Derivatives> {
        let mut memory = self.memory.borrow_mut();
        self.differentiate(theta, 0, &mut memory);
        let Memory { residual, columns, .. } = &*memory;
        Some(Derivatives {
            value: dense::dot(residual, residual),
            gradient: columns.iter().map(|c| 2.0 * dense::dot(c, residual)).collect(),
            curvature: dense::gram(columns).into_iter().map(|row| row.into_iter().map(|x| 2.0 * x).collect()).collect(),
        })
    }
}

/// A whitened residual with its derivatives.
#[derive(Clone, Debug)]
pub struct Linearised {
    /// Samples of the residuals; prior knowledge comes after them in both of the others.
    pub samples: Vec<usize>,
    /// Residuals that count, filtered.
    pub residual: Vec<f64>,
    /// One column for each parameter.
    pub columns: Vec<Vec<f64>>,
}

impl Linearised {
    /// Half the first derivatives of the energy.
    pub fn slope(&self) -> Vec<f64> {
        self.columns.iter().map(|c| dense::dot(c, &self.residual)).collect()
    }
}

fn constants(theta: &[f64]) -> Vec<Number> {
    theta.iter().copied().map(Number::from).collect()
}

//! Directions in which the derivatives of a residual are computed.
//!
//! A direction is a parameter, or, where a parameter changes a function along the whole record, one of the parts that reach
//! over some of it: the derivative with respect to the parameter is a sum of these, and each costs no more than what it
//! reaches.

use std::fmt;
use std::sync::Arc;

use crate::model::Model;
use crate::number::Number;
use crate::observations::Observations;
use crate::plant::Plant;

/// Puts an effect into a model, with the derivative by one part of it.
pub type Install = Arc<dyn Fn(&mut Plant) + Send + Sync>;

/// Parts by their places among several, with their weights in a sum.
pub(crate) type Weights = Vec<(usize, f64)>;

/// One part of an effect, and where it acts.
#[derive(Clone)]
#[non_exhaustive]
pub struct Part {
    /// Instants between which it acts, s, beyond which its derivative is zero; `None` of one that acts everywhere.
    pub support_s: Option<[f64; 2]>,
    /// Puts the effect into the model, with values as they are and the derivative by this part.
    pub install: Install,
}

impl Part {
    /// - `support_s`: instants between which it acts, s, beyond which its derivative is zero; `None` of one that acts everywhere
    pub fn new(support_s: Option<[f64; 2]>, install: Install) -> Self {
        Self { support_s, install }
    }
}

impl fmt::Debug for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Part").field("support_s", &self.support_s).finish_non_exhaustive()
    }
}

/// Parts of an effect.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Parts {
    /// All of them.
    pub parts: Vec<Part>,
    /// Of which of them the derivative by each parameter consists, with their weights.
    pub of_parameters: Vec<Vec<(usize, f64)>>,
}

impl Parts {
    /// - `of_parameters`: for each parameter places in `parts` with their weights
    pub fn new(parts: Vec<Part>, of_parameters: Vec<Vec<(usize, f64)>>) -> Self {
        Self { parts, of_parameters }
    }
}

/// One of the directions of a model.
#[derive(Clone, Debug)]
pub(crate) struct Direction {
    /// The model with this derivative; `None` where none is computed.
    pub(crate) plant: Option<Plant>,
    /// In which of the sensors functions may have a derivative.
    pub(crate) functions: [bool; 2],
    /// Instants between which it acts, s; `None` of one that acts everywhere.
    pub(crate) support_s: Option<[f64; 2]>,
}

/// The directions of a model at a point.
pub(crate) struct Directions {
    /// The first parameter that has one with a derivative.
    pub(crate) first: usize,
    pub(crate) all: Vec<Direction>,
    /// Of which of them the derivative by each parameter consists, with their weights; `None` where each parameter is the
    /// direction in its place.
    pub(crate) of_parameters: Option<Vec<Weights>>,
}

impl Directions {
    /// Those of the parameters from `first` on that are not held. The parameters before `first`, and those that are held, have
    /// a direction without a derivative each.
    pub(crate) fn of(
        model: &Model,
        theta: &[f64],
        first: usize,
        is_held: impl Fn(usize) -> bool,
        observations: &Observations,
    ) -> Self {
        let (mut all, mut of_parameters, mut has_parts) = (Vec::new(), Vec::with_capacity(theta.len()), false);
        let ranges = (0..2).map(|i| (None, i..i + 1));
        let ranges = ranges.chain((0..model.effects.len()).map(|index| (Some(index), model.range(index))));
        for (effect, range) in ranges {
            let is_whole = range.start >= first && !range.clone().any(&is_held);
            let parts = effect.filter(|_| is_whole).and_then(|e| model.effects[e].parts(&theta[range.clone()]));
            if let (Some(effect), Some(Parts { parts, of_parameters: of_own })) = (effect, parts) {
                let from = all.len();
                all.extend(parts.iter().map(|part| model.direction(theta, effect, part, observations)));
                of_parameters
                    .extend(of_own.into_iter().map(|own| own.into_iter().map(|(k, w)| (from + k, w)).collect()));
                has_parts = true;
                continue;
            }
            for i in range {
                let is_computed = i >= first && !is_held(i);
                of_parameters.push(vec![(all.len(), 1.0)]);
                all.push(Direction {
                    plant: is_computed.then(|| model.plant_of(&moved(theta, i), observations)),
                    functions: model.sensors_of_functions(i),
                    support_s: None,
                });
            }
        }
        Self { first, all, of_parameters: has_parts.then_some(of_parameters) }
    }

    /// `Wᵀ s`: derivatives by the parameters from those in all directions.
    pub(crate) fn along_parameters(&self, of_directions: Vec<f64>) -> Vec<f64> {
        let Some(of_parameters) = &self.of_parameters else { return of_directions };
        of_parameters.iter().map(|parts| parts.iter().map(|(k, weight)| weight * of_directions[*k]).sum()).collect()
    }

    /// `Wᵀ P W`, of a symmetric matrix.
    pub(crate) fn between_parameters(&self, of_directions: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        if self.of_parameters.is_none() {
            return of_directions;
        }
        let half: Vec<Vec<f64>> = of_directions.into_iter().map(|row| self.along_parameters(row)).collect();
        let parameters = half.first().map_or(0, Vec::len);
        let column = |i: usize| half.iter().map(|row| row[i]).collect();
        (0..parameters).map(|i| self.along_parameters(column(i))).collect()
    }
}

impl Model {
    /// The direction of a part of an effect.
    fn direction(&self, theta: &[f64], effect: usize, part: &Part, observations: &Observations) -> Direction {
        let numbers = constants(theta);
        let mut plant = self.two_lags(&numbers, observations);
        for (index, other) in self.effects.iter().enumerate() {
            if index == effect {
                (part.install)(&mut plant);
            } else {
                other.install(&numbers[self.range(index)], &mut plant);
            }
        }
        let functions = self.sensors_of_functions(self.range(effect).start);
        Direction { plant: Some(plant), functions, support_s: part.support_s }
    }
}

/// Numbers without a derivative.
pub(crate) fn constants(theta: &[f64]) -> Vec<Number> {
    theta.iter().copied().map(Number::from).collect()
}

/// Numbers with the derivative by parameter `i`.
pub(crate) fn moved(theta: &[f64], i: usize) -> Vec<Number> {
    let mut out = constants(theta);
    out[i] = out[i].derivative();
    out
}

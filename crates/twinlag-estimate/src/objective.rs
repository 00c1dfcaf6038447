//! The costs as the optimiser takes them: the one place where the two meet.

use twinlag_bias::{Compensated, Hybrid, Normalised};
use twinlag_cross_relation::{CostValue, CrossRelation, Whitened};
use twinlag_optimise::{Cost, Derivatives};

/// Any of the estimators' costs.
pub(crate) enum EstimatorCost<'a> {
    Whitened(Whitened<'a>),
    CrossRelation(CrossRelation<'a>),
    Compensated(Compensated<'a>),
    Normalised(Normalised<'a>),
    Hybrid(Hybrid<'a>),
}

impl EstimatorCost<'_> {
    pub(crate) fn evaluate<const P: usize>(&self, theta: &[f64; P]) -> CostValue<P> {
        match self {
            Self::Whitened(cost) => cost.evaluate(theta),
            Self::CrossRelation(cost) => cost.evaluate(theta),
            Self::Compensated(cost) => cost.evaluate(theta),
            Self::Normalised(cost) => cost.evaluate(theta),
            Self::Hybrid(cost) => cost.evaluate(theta),
        }
    }
}

/// Independent prior knowledge of one parameter, as one more residual `(θ − mean)/std`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Place of the parameter in [`twinlag_cross_relation::Parameter::ALL`].
    pub index: usize,
    /// Where it is known to lie, in the parameter's unit.
    pub mean: f64,
    /// Standard deviation of that knowledge, in the parameter's unit.
    pub std: f64,
}

/// A cost over the first `P` parameters, with priors.
pub(crate) struct Objective<'a, 'c, const P: usize> {
    pub(crate) cost: &'c EstimatorCost<'a>,
    pub(crate) priors: &'c [Prior],
}

impl<const P: usize> Objective<'_, '_, P> {
    pub(crate) fn at(&self, x: &[f64]) -> CostValue<P> {
        let theta: [f64; P] = std::array::from_fn(|i| x[i]);
        let mut out = self.cost.evaluate(&theta);
        for prior in self.priors {
            let deviate = (theta[prior.index] - prior.mean) / prior.std;
            out.value += deviate * deviate;
            out.gradient[prior.index] += 2.0 * deviate / prior.std;
            out.hessian[prior.index][prior.index] += 2.0 / (prior.std * prior.std);
        }
        out
    }
}

impl<const P: usize> Cost for Objective<'_, '_, P> {
    fn value(&self, x: &[f64]) -> f64 {
        self.at(x).value
    }

    fn derivatives(&self, x: &[f64]) -> Option<Derivatives> {
        let c = self.at(x);
        Some(Derivatives {
            value: c.value,
            gradient: c.gradient.to_vec(),
            curvature: c.hessian.iter().map(|row| row.to_vec()).collect(),
        })
    }
}

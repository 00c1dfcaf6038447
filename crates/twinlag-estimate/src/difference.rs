//! The difference-equation estimators, in closed form.

use twinlag_cross_relation::DifferenceEquationEstimator;
use twinlag_optimise::{End, Evaluations};
use twinlag_sensor::Discretisation;

use crate::error::EstimateError;
use crate::intervals::Intervals;
use crate::task::{Outcome, Task};
use crate::vocabulary::{Estimator, NoiseKnowledge};
use crate::whitened::{find, outcome};

pub(crate) fn estimate(estimator: Estimator, task: &Task<'_>) -> Result<Outcome, EstimateError> {
    if task.second_order != [false; 2] || task.hold != Discretisation::ZeroOrderHold {
        return Err(EstimateError::Unexpected {
            what: "the difference-equation estimators",
            expected: "first-order sensors and the zero-order hold, in which the equation is linear in two numbers"
                .into(),
            got: format!("second lags {:?}, {:?}", task.second_order, task.hold),
        });
    }
    // Levels are needed for the intervals, and their ratio by the generalised estimator.
    let mut evaluations = Evaluations::default();
    let mut levels = || -> Result<[f64; 2], EstimateError> {
        if let NoiseKnowledge::Known { std_k, .. } = task.noise {
            return Ok(std_k);
        }
        let found = find::<2>(task)?;
        evaluations = found.evaluations;
        Ok(found.levels.std_k)
    };
    let ratio = |std_k: [f64; 2]| std_k[1] / std_k[0];
    let (form, mut std_k) = match (estimator, task.noise) {
        (Estimator::DifferenceEquationLs, _) => (DifferenceEquationEstimator::LeastSquares, None),
        (Estimator::DifferenceEquationTls, _) => (DifferenceEquationEstimator::TotalLeastSquares, None),
        (_, NoiseKnowledge::Ratio(noise_ratio)) => (DifferenceEquationEstimator::Generalised { noise_ratio }, None),
        _ => {
            let std_k = levels()?;
            (DifferenceEquationEstimator::Generalised { noise_ratio: ratio(std_k) }, Some(std_k))
        }
    };
    let tau_s = form.estimate(task.readings)?;
    let mut intervals = None;
    if task.intervals {
        let known = std_k.map_or_else(levels, Ok)?;
        std_k = Some(known);
        let covariance = form.covariance(task.readings, tau_s, known).ok();
        intervals = covariance.map(|c| Intervals::quadratic(&tau_s, &c));
    }
    Ok(outcome(&tau_s, std_k, [0.0; 2], intervals, End::Unchecked, evaluations))
}

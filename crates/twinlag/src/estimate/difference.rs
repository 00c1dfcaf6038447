//! The difference-equation estimators, in closed form.

use twinlag_cross_relation::DifferenceEquationEstimator;
use twinlag_optimise::{End, Evaluations};
use twinlag_sensor::Discretisation;

use super::intervals::Intervals;
use super::whitened::{find, outcome};
use super::{NoiseKnowledge, Outcome, Task};
use crate::error::Error;
use crate::options::Estimator;

pub(super) fn estimate(estimator: Estimator, task: &Task<'_>) -> Result<Outcome, Error> {
    if task.second_order != [false; 2] || task.hold != Discretisation::ZeroOrderHold {
        return Err(Error::Option {
            option: "the difference-equation estimators",
            expected: "first-order sensors and the zero-order hold, in which the equation is linear in two numbers"
                .into(),
            got: format!("second lags {:?}, {:?}", task.second_order, task.hold),
        });
    }
    // Levels are needed for the intervals, and their ratio by the generalised estimator.
    let mut evaluations = Evaluations::default();
    let mut levels = || -> Result<[f64; 2], Error> {
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

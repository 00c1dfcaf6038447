//! The difference-equation estimators, in closed form.

use twinlag_cross_relation::DifferenceEquationEstimator;
use twinlag_optimise::{End, Evaluations};
use twinlag_sensor::Discretisation;

use crate::error::EstimateError;
use crate::outcome::Solved;
use crate::task::Task;
use crate::vocabulary::{Estimator, NoiseKnowledge};
use crate::whitened::WhitenedFit;

/// Solves the equation for `estimator` on `task`, `beside` the whitened fit of it where there is
/// one.
pub(crate) fn solve<const P: usize>(
    estimator: Estimator,
    task: &Task<'_>,
    beside: Option<&WhitenedFit<'_, P>>,
) -> Result<Solved<P>, EstimateError> {
    if P != 2 || task.hold != Discretisation::ZeroOrderHold {
        return Err(EstimateError::Unexpected {
            what: "the difference-equation estimators",
            expected:
                "first-order sensors without calibration and the zero-order hold, in which the equation is linear in \
                       two numbers"
                    .into(),
            got: format!("{P} parameters, {:?}", task.hold),
        });
    }
    // Levels are needed for the intervals, and their ratio by the generalised estimator.
    let mut evaluations = Evaluations::default();
    let mut levels_k = || -> Result<[f64; 2], EstimateError> {
        if let NoiseKnowledge::Known { std_k, .. } = task.noise {
            return Ok(std_k);
        }
        let own = if beside.is_none() { Some(WhitenedFit::<P>::find(task)?) } else { None };
        let fit = beside.or(own.as_ref()).expect("one of them is there");
        evaluations = fit.evaluations;
        Ok(fit.whitened.noise_std())
    };
    let (form, mut std_k) = match (estimator, task.noise) {
        (Estimator::DifferenceEquationLs, _) => (DifferenceEquationEstimator::LeastSquares, None),
        (Estimator::DifferenceEquationTls, _) => (DifferenceEquationEstimator::TotalLeastSquares, None),
        (_, NoiseKnowledge::Ratio(noise_ratio)) => (DifferenceEquationEstimator::Generalised { noise_ratio }, None),
        _ => {
            let std_k = levels_k()?;
            (DifferenceEquationEstimator::Generalised { noise_ratio: std_k[1] / std_k[0] }, Some(std_k))
        }
    };
    let tau_s = form.estimate(task.readings)?;
    let mut covariance = None;
    if task.intervals {
        let known_k = std_k.map_or_else(levels_k, Ok)?;
        std_k = Some(known_k);
        covariance = form.covariance(task.readings, tau_s, known_k).ok();
    }
    Ok(Solved {
        theta: std::array::from_fn(|i| tau_s[i]),
        covariance: covariance.map(|c| std::array::from_fn(|i| std::array::from_fn(|j| c[i][j]))),
        noise_std_k: std_k,
        noise_ar1: [0.0; 2],
        end: End::Unchecked,
        fit: None,
        starts: 0,
        evaluations,
        discarded: 0,
    })
}

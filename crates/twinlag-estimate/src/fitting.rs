//! Minimising the whitened cost over a record: compressed where that changes nothing worth knowing.

use twinlag_cross_relation::{Form, Whitened};
use twinlag_optimise::{Budget, Minimiser, MultiStart, Problem, Variable};

use crate::error::EstimateError;
use crate::objective::{EstimatorCost, Objective, Prior};

/// Compression may move no estimate by more than this many standard errors.
const SHIFT: f64 = 1e-2;

/// Where a fit of the whitened cost ended, and the cost itself, in its exact form.
pub struct Minimised<'a> {
    pub whitened: Whitened<'a>,
    pub all: MultiStart,
}

/// Minimises `whitened` with `priors` over `variables` from `starts`, which are made once the objective is there.
///
/// Where the record allows it, in the compressed form; then again from there in the exact one if the bound on what that can
/// have moved is above a hundredth of a standard error, or if there was no end to be had: squares rounded before they are
/// summed leave the compressed cost rougher, by the square of the signal over the noise, which solvers that compare values feel.
pub fn minimise_whitened<'a, const P: usize>(
    whitened: Whitened<'a>,
    priors: &[Prior],
    variables: &[Variable],
    minimiser: &dyn Minimiser,
    starts: impl FnOnce(&Objective<'_, '_, P>) -> Vec<Vec<f64>>,
) -> Result<Minimised<'a>, EstimateError> {
    let run = |cost: &EstimatorCost<'a>, starts: &dyn Fn(&Objective<'_, '_, P>) -> Vec<Vec<f64>>| {
        let objective = Objective::<P> { cost, priors };
        let problem = Problem::new(&objective, variables.to_vec())?;
        Ok::<_, EstimateError>(MultiStart::run(&problem, minimiser, &starts(&objective), &Budget::default())?)
    };
    // At second order each evaluation is the banded one anyway.
    let whitened = if P == 6 { whitened } else { whitened.compressed(P == 4) };
    let cost = EstimatorCost::Whitened(whitened);
    let starts = starts(&Objective::<P> { cost: &cost, priors });
    let mut all = run(&cost, &|_| starts.clone())?;
    let EstimatorCost::Whitened(whitened) = cost else { unreachable!("built as whitened above") };
    if whitened.form() != Form::Compressed {
        return Ok(Minimised { whitened, all });
    }
    let best = all.best().x.clone();
    let theta: [f64; P] = std::array::from_fn(|i| best[i]);
    let free: Vec<usize> = (0..P).filter(|&i| variables[i].lower < variables[i].upper).collect();
    let shift = whitened.shift_bound(&theta, &free);
    let whitened = whitened.exact();
    if all.best().end.is_usable() && shift.iter().all(|s| *s < SHIFT) {
        return Ok(Minimised { whitened, all });
    }
    let cost = EstimatorCost::Whitened(whitened);
    all = run(&cost, &|_| vec![best.clone()])?;
    let EstimatorCost::Whitened(whitened) = cost else { unreachable!("built as whitened above") };
    Ok(Minimised { whitened, all })
}

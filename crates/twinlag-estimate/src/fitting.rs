//! Minimising the whitened cost over a record: compressed where that changes nothing worth knowing,
//! exact in the end.

use twinlag_cross_relation::{Form, Whitened, sandwich};
use twinlag_optimise::{Budget, Evaluations, Fit, Minimiser, MultiStart, Problem, Variable};

use crate::error::EstimateError;
use crate::objective::{EstimatorCost, Objective, Prior};
use crate::starts::hold_known;

/// Compression may move no parameter by more than this many standard errors before the exact cost
/// is minimised in its place: so little that one Newton step takes it back.
const MAX_COMPRESSION_SHIFT_STANDARD_ERRORS: f64 = 1e-2;

/// Where a fit of the whitened cost ended, and the cost itself, in its exact form.
pub(crate) struct Minimised<'a> {
    pub(crate) whitened: Whitened<'a>,
    pub(crate) all: MultiStart,
}

impl Minimised<'_> {
    /// What all starts asked of the cost.
    pub(crate) fn evaluations(&self) -> Evaluations {
        sum(self.all.fits())
    }
}

/// What `fits` asked of their costs together.
pub(crate) fn sum(fits: &[Fit]) -> Evaluations {
    let mut all = Evaluations::default();
    fits.iter().for_each(|fit| add(&mut all, fit.evaluations));
    all
}

/// Adds `more` to `all`.
pub(crate) fn add(all: &mut Evaluations, more: Evaluations) {
    all.values += more.values;
    all.derivatives += more.derivatives;
}

/// Minimises `whitened` with `priors` over `variables` from `starts`, which are made once the
/// objective is there.
///
/// Where the record allows it, in the compressed form; then again from there in the exact one if
/// the bound on what that can have moved is above a hundredth of a standard error, or if there was
/// no end to be had: squares rounded before they are summed leave the compressed cost rougher, by
/// the square of the signal over the noise, which solvers that compare values feel.
pub(crate) fn minimise_whitened<'a, const P: usize>(
    whitened: Whitened<'a>,
    priors: &[Prior],
    variables: &[Variable],
    minimiser: &dyn Minimiser,
    starts: impl FnOnce(&Objective<'_, '_, P>) -> Vec<Vec<f64>>,
) -> Result<Minimised<'a>, EstimateError> {
    let run = |cost: &EstimatorCost<'a>, starts: &[Vec<f64>]| {
        let objective = Objective::<P> { cost, priors };
        let problem = Problem::new(&objective, variables.to_vec())?;
        Ok::<_, EstimateError>(MultiStart::run(&problem, minimiser, starts, &Budget::default())?)
    };
    // At second order each evaluation is the banded one anyway.
    let whitened = if P == 6 { whitened } else { whitened.compressed(P == 4) };
    let cost = EstimatorCost::Whitened(whitened);
    let starts = starts(&Objective::<P> { cost: &cost, priors });
    let mut all = run(&cost, &starts)?;
    let EstimatorCost::Whitened(whitened) = cost else { unreachable!("built as whitened above") };
    if whitened.form() != Form::Compressed {
        return Ok(Minimised { whitened, all });
    }
    let best = all.best().x.clone();
    let theta: [f64; P] = std::array::from_fn(|i| best[i]);
    let shift = whitened.shift_bound(&theta, &free(variables));
    let whitened = whitened.exact();
    if all.best().end.is_usable() && shift.iter().all(|s| *s < MAX_COMPRESSION_SHIFT_STANDARD_ERRORS) {
        return Ok(Minimised { whitened, all });
    }
    let cost = EstimatorCost::Whitened(whitened);
    all = run(&cost, &[best])?;
    let EstimatorCost::Whitened(whitened) = cost else { unreachable!("built as whitened above") };
    Ok(Minimised { whitened, all })
}

/// Takes back what compression has moved: one Newton step on the exact cost, if it lowers that, and
/// the exact value there.
///
/// The shift is a hundredth of a standard error at most, so the step leaves a ten-thousandth of
/// one.
pub(crate) fn polish<const P: usize>(whitened: &Whitened<'_>, priors: &[Prior], variables: &[Variable], fit: &mut Fit) {
    if whitened.form() != Form::Spectral {
        return;
    }
    let cost = EstimatorCost::Whitened(whitened.clone());
    let objective = Objective::<P> { cost: &cost, priors };
    let here = objective.at(&fit.x);
    fit.value = here.value;
    let Some(inverse) = sandwich(&here.hessian, &here.hessian, &free(variables)) else { return };
    if !fit.end.is_usable() {
        return;
    }
    let newton = |i: usize| fit.x[i] - (0..P).map(|j| inverse[i][j] * here.gradient[j]).sum::<f64>();
    let mut x: Vec<f64> = (0..P).map(newton).collect();
    hold_known(&mut x, variables);
    let value = objective.at(&x).value;
    if value <= fit.value {
        (fit.x, fit.value) = (x, value);
    }
}

/// Indices of the variables that are not held.
pub(crate) fn free(variables: &[Variable]) -> Vec<usize> {
    (0..variables.len()).filter(|&i| variables[i].lower < variables[i].upper).collect()
}

//! Minimising the whitened cost over a record: compressed where that changes nothing worth knowing,
//! exact in the end.

use twinlag_cross_relation::{CostValue, Form, Whitened, sandwich};
use twinlag_optimise::{Budget, Evaluations, Fit, Minimiser, MultiStart, Problem, Variable};
use twinlag_sensor::Discretisation;

use crate::error::EstimateError;
use crate::objective::{EstimatorCost, Objective, Prior};
use crate::starts::{hold_known, starts};

/// Compression may move no parameter by more than this many standard errors before the exact cost
/// is minimised in its place: so little that one Newton step takes it back.
const MAX_COMPRESSION_SHIFT_STANDARD_ERRORS: f64 = 1e-2;

/// Readings from which on the hold that has bins shows where another one starts. Evaluations over all readings, some thirty of a grid
/// and a dozen from each of four starts, then take several times the transforms that the bins take.
const MIN_STAND_IN_SAMPLES: usize = 16_384;

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

/// Minimises `whitened` with `priors` over `variables` from `own` starts, or from those of the record where there are none.
///
/// Where the record allows it, in the compressed form; then again from there in the exact one if that may have moved a parameter by
/// more than a hundredth of a standard error, or if no fit ended well: squares that are rounded before they are summed leave the
/// compressed cost rougher, by the square of the signal over the noise, which solvers that compare values feel. How far it may have
/// moved is a bound, or a Newton step of the exact cost where long segments were gathered in pieces.
pub(crate) fn minimise_whitened<'a, const P: usize>(
    whitened: Whitened<'a>,
    priors: &[Prior],
    variables: &[Variable],
    minimiser: &dyn Minimiser,
    own: Vec<Vec<f64>>,
) -> Result<Minimised<'a>, EstimateError> {
    let run = |cost: &EstimatorCost<'a>, starts: &[Vec<f64>]| {
        let objective = Objective::<P> { cost, priors };
        let problem = Problem::new(&objective, variables.to_vec())?;
        Ok::<_, EstimateError>(MultiStart::run(&problem, minimiser, starts, &Budget::default())?)
    };
    // At second order each evaluation is the banded one anyway.
    let readings = whitened.readings();
    let starts_on =
        |cost: &EstimatorCost<'a>| starts(&Objective::<P> { cost, priors }, readings, variables, [false; 2]);
    let stand_in = if P == 6 || !own.is_empty() { None } else { stand_in(&whitened, P == 4)? };
    let whitened = if P == 6 { whitened } else { whitened.compressed(P == 4) };
    let cost = EstimatorCost::Whitened(whitened);
    let starts = match stand_in.map(EstimatorCost::Whitened) {
        Some(stand_in) => best_of_either_order(&run(&stand_in, &starts_on(&stand_in))?),
        None if own.is_empty() => starts_on(&cost),
        None => own,
    };
    let mut all = run(&cost, &starts)?;
    let EstimatorCost::Whitened(whitened) = cost else { unreachable!("built as whitened above") };
    if whitened.form() != Form::Compressed {
        return Ok(Minimised { whitened, all });
    }
    let best = all.best().x.clone();
    let theta: [f64; P] = std::array::from_fn(|i| best[i]);
    let free = free(variables);
    let mut shift = whitened.shift_bound(&theta, &free);
    let whitened = whitened.exact();
    let is_in_pieces = whitened.is_gathered_in_pieces();
    let cost = EstimatorCost::Whitened(whitened);
    if is_in_pieces {
        // The bound does not know of the cuts; the gradient of the exact cost does.
        let newton = Newton::at(&Objective::<P> { cost: &cost, priors }, &best, &free);
        shift = newton.map_or([f64::INFINITY; P], |newton| newton.step_standard_errors());
    }
    if all.best().end.is_usable() && shift.iter().all(|s| *s < MAX_COMPRESSION_SHIFT_STANDARD_ERRORS) {
        let EstimatorCost::Whitened(whitened) = cost else { unreachable!("built as whitened above") };
        return Ok(Minimised { whitened, all });
    }
    all = run(&cost, &[best])?;
    let EstimatorCost::Whitened(whitened) = cost else { unreachable!("built as whitened above") };
    Ok(Minimised { whitened, all })
}

/// The cost that shows where to start where `whitened` takes all of a long record for each evaluation and another hold does not:
/// what the gas does between samples moves a minimum, by a sample at most, and makes or removes none.
fn stand_in<'a>(whitened: &Whitened<'a>, calibration: bool) -> Result<Option<Whitened<'a>>, EstimateError> {
    let is_first_order = whitened.hold() == Discretisation::FirstOrderHold;
    if !is_first_order || whitened.form() != Form::Banded || whitened.autoregression().iter().any(|a| !a.is_empty()) {
        return Ok(None);
    }
    if whitened.readings().len() < MIN_STAND_IN_SAMPLES {
        return Ok(None);
    }
    let other = whitened.clone().with_hold(Discretisation::ZeroOrderHold)?;
    let has_bins = other.form() == Form::Spectral || other.is_gathered_in_pieces();
    Ok(has_bins.then(|| other.compressed(calibration)))
}

/// The lowest ends with the first time constant shorter, and with it longer.
fn best_of_either_order(all: &MultiStart) -> Vec<Vec<f64>> {
    let of_order = |is_shorter: bool| {
        let fits = all.fits().iter().filter(|fit| (fit.x[0] < fit.x[1]) == is_shorter);
        fits.min_by(|a, b| a.value.total_cmp(&b.value)).map(|fit| fit.x.clone())
    };
    [true, false].into_iter().filter_map(of_order).collect()
}

/// One Newton step of a cost, by its Gauss-Newton matrix.
struct Newton<const P: usize> {
    here: CostValue<P>,
    inverse: [[f64; P]; P],
}

impl<const P: usize> Newton<P> {
    /// At `x` over the `free` parameters; `None` where these are not determined.
    fn at(objective: &Objective<'_, '_, P>, x: &[f64], free: &[usize]) -> Option<Self> {
        let here = objective.at(x);
        sandwich(&here.hessian, &here.hessian, free).map(|inverse| Self { here, inverse })
    }

    fn step(&self) -> [f64; P] {
        std::array::from_fn(|i| -(0..P).map(|j| self.inverse[i][j] * self.here.gradient[j]).sum::<f64>())
    }

    /// Sizes of the step in standard errors, those of noise of the stated size; 0 of what is held.
    fn step_standard_errors(&self) -> [f64; P] {
        let step = self.step();
        // The matrix is twice the information.
        std::array::from_fn(|i| if step[i] == 0.0 { 0.0 } else { step[i].abs() / (2.0 * self.inverse[i][i]).sqrt() })
    }
}

/// Takes back what compression has moved: one Newton step on the exact cost, if it lowers that, and
/// the exact value there.
///
/// The shift is a hundredth of a standard error at most, so the step leaves a ten-thousandth of
/// one.
pub(crate) fn polish<const P: usize>(whitened: &Whitened<'_>, priors: &[Prior], variables: &[Variable], fit: &mut Fit) {
    if whitened.form() != Form::Spectral && !whitened.is_gathered_in_pieces() {
        return;
    }
    let cost = EstimatorCost::Whitened(whitened.clone());
    let objective = Objective::<P> { cost: &cost, priors };
    let newton = Newton::at(&objective, &fit.x, &free(variables));
    fit.value = newton.as_ref().map_or_else(|| objective.at(&fit.x).value, |newton| newton.here.value);
    let Some(newton) = newton.filter(|_| fit.end.is_usable()) else { return };
    let mut x: Vec<f64> = fit.x.iter().zip(newton.step()).map(|(x, step)| x + step).collect();
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

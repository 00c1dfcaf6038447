//! Levenberg-Marquardt with bounds, as an argmin solver: argmin has none.
//!
//! Each iteration solves `(H + μ diag H) s = −g` over the variables that are not held at a bound by the gradient, moves to
//! the nearest point inside the bounds, and accepts a lower cost. `H` is whatever curvature the cost supplies: for sums of
//! squares the Gauss-Newton matrix, otherwise the Hessian, made positive by the damping where it is not.
//!
//! # Source
//! Damping by the gain ratio: Nielsen, *Damping parameter in Marquardt's method*, 1999. Bounds by projection on the active
//! set: Bertsekas, *Projected Newton methods*, 1982.

use argmin::core::{
    ArgminFloat, CostFunction, Error, Gradient, Hessian, KV, Problem, Solver, TerminationReason, TerminationStatus,
};
use nalgebra::{DMatrix, DVector};

use crate::adapter::{Exhausted, SolverState};

type LmState = SolverState<Vec<f64>, Vec<Vec<f64>>>;

/// The solver; `bounds` and `step_tolerance` are in the coordinates of the problem.
pub(crate) struct LevenbergMarquardt {
    bounds: Vec<(f64, f64)>,
    step_tolerance: f64,
    damping: f64,
    raise: f64,
    done: Option<TerminationReason>,
}

impl LevenbergMarquardt {
    pub(crate) fn new(bounds: Vec<(f64, f64)>, step_tolerance: f64) -> Self {
        Self { bounds, step_tolerance, damping: 1e-3, raise: 2.0, done: None }
    }

    /// Whether the gradient presses `z[i]` against a bound.
    fn is_pressed(&self, z: &[f64], gradient: &[f64], i: usize) -> bool {
        let (lower, upper) = self.bounds[i];
        (z[i] <= lower && gradient[i] > 0.0) || (z[i] >= upper && gradient[i] < 0.0)
    }

    /// The damped step over the variables that can move, zero elsewhere; `None` if the matrix is not positive definite.
    fn step(&self, free: &[usize], gradient: &[f64], hessian: &[Vec<f64>], n: usize) -> Option<Vec<f64>> {
        let matrix = DMatrix::from_fn(free.len(), free.len(), |p, q| {
            let h = hessian[free[p]][free[q]];
            // A variable without curvature is damped by the unit of its coordinate.
            if p == q { h + self.damping * h.abs().max(f64::MIN_POSITIVE.sqrt()) } else { h }
        });
        let rhs = DVector::from_iterator(free.len(), free.iter().map(|&i| -gradient[i]));
        let solution = matrix.cholesky()?.solve(&rhs);
        let mut step = vec![0.0; n];
        for (p, &i) in free.iter().enumerate() {
            step[i] = solution[p];
        }
        step.iter().all(|s| s.is_finite()).then_some(step)
    }
}

/// Largest damping: past it no step is long enough to matter.
const DAMPING_LIMIT: f64 = 1e16;
/// Longest step in any coordinate: a factor e² for logarithms.
const LONGEST_STEP: f64 = 2.0;

impl<O> Solver<O, LmState> for LevenbergMarquardt
where
    O: CostFunction<Param = Vec<f64>, Output = f64>
        + Gradient<Param = Vec<f64>, Gradient = Vec<f64>>
        + Hessian<Param = Vec<f64>, Hessian = Vec<Vec<f64>>>,
    f64: ArgminFloat,
{
    fn name(&self) -> &'static str {
        "Levenberg-Marquardt"
    }

    fn init(&mut self, problem: &mut Problem<O>, mut state: LmState) -> Result<(LmState, Option<KV>), Error> {
        let z = state.take_param().ok_or_else(|| Error::msg("Levenberg-Marquardt needs a start"))?;
        let gradient = problem.gradient(&z)?;
        let hessian = problem.hessian(&z)?;
        let cost = problem.cost(&z)?;
        Ok((state.param(z).cost(cost).gradient(gradient).hessian(hessian), None))
    }

    fn next_iter(&mut self, problem: &mut Problem<O>, mut state: LmState) -> Result<(LmState, Option<KV>), Error> {
        let lost = || Error::msg("the solver's state is incomplete");
        let z = state.take_param().ok_or_else(lost)?;
        let gradient = state.take_gradient().ok_or_else(lost)?;
        let hessian = state.take_hessian().ok_or_else(lost)?;
        let cost = state.get_cost();
        let free: Vec<usize> = (0..z.len()).filter(|&i| !self.is_pressed(&z, &gradient, i)).collect();
        if free.is_empty() {
            self.done = Some(TerminationReason::SolverConverged);
            return Ok((state.param(z).cost(cost).gradient(gradient).hessian(hessian), None));
        }
        loop {
            let trial = self.step(&free, &gradient, &hessian, z.len()).map(|mut step| {
                let longest = step.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
                if longest > LONGEST_STEP {
                    step.iter_mut().for_each(|s| *s *= LONGEST_STEP / longest);
                }
                let new: Vec<f64> =
                    (0..z.len()).map(|i| (z[i] + step[i]).clamp(self.bounds[i].0, self.bounds[i].1)).collect();
                new
            });
            if let Some(new) = trial {
                let step: Vec<f64> = new.iter().zip(&z).map(|(a, b)| a - b).collect();
                let length = step.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
                if length <= self.step_tolerance {
                    self.done = Some(TerminationReason::SolverConverged);
                    return Ok((state.param(z).cost(cost).gradient(gradient).hessian(hessian), None));
                }
                // A point without finite derivatives is no better than one with a higher cost.
                let derivatives =
                    problem.gradient(&new).and_then(|g| Ok((g, problem.hessian(&new)?, problem.cost(&new)?)));
                match derivatives {
                    Ok((new_gradient, new_hessian, new_cost)) if new_cost <= cost => {
                        let predicted: f64 = -(0..z.len())
                            .map(|i| {
                                let bend: f64 = (0..z.len()).map(|j| hessian[i][j] * step[j]).sum();
                                step[i] * (gradient[i] + 0.5 * bend)
                            })
                            .sum::<f64>();
                        let ratio = (cost - new_cost) / predicted.max(f64::MIN_POSITIVE);
                        self.damping *= (1.0 - (2.0 * ratio.min(1.0) - 1.0).powi(3)).max(1.0 / 10.0);
                        self.raise = 2.0;
                        return Ok((state.param(new).cost(new_cost).gradient(new_gradient).hessian(new_hessian), None));
                    }
                    Err(error) if error.is::<Exhausted>() => return Err(error),
                    _ => {}
                }
            }
            self.damping = self.damping.max(1e-12) * self.raise;
            self.raise *= 2.0;
            if self.damping > DAMPING_LIMIT {
                self.done = Some(TerminationReason::SolverConverged);
                return Ok((state.param(z).cost(cost).gradient(gradient).hessian(hessian), None));
            }
        }
    }

    fn terminate(&mut self, _state: &LmState) -> TerminationStatus {
        match &self.done {
            Some(reason) => TerminationStatus::Terminated(reason.clone()),
            None => TerminationStatus::NotTerminated,
        }
    }
}

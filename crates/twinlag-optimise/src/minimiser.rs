//! The solvers by name, and what each makes of a start.

use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::neldermead::NelderMead;
use argmin::solver::quasinewton::LBFGS;
use serde::{Deserialize, Serialize};

use crate::adapter::{Outside, Run, SolverState, Stop, run};
use crate::levenberg_marquardt::LevenbergMarquardt;
use crate::problem::{Problem, ProblemError};
use crate::report::{Budget, End, Fit};

/// A local minimiser: from one start to one report. Implement it to bring a solver of your own.
///
/// A solver sees the problem in free coordinates of size one: [`Problem::coordinates`] of the start, [`Problem::bounds`],
/// [`Problem::value_at`] and [`Problem::derivatives_at`]; [`Problem::point`] takes its answer back to the variables' own units, and
/// [`Problem::assess`] says what kind of point it is.
pub trait Minimiser {
    /// The name that reports carry.
    fn name(&self) -> String;

    /// Minimises `problem` from `start` (all variables, their own units; moved inside the bounds first).
    ///
    /// # Errors
    /// [`ProblemError::Start`] for a start of the wrong length or not finite, [`ProblemError::NeedsDerivatives`] where a solver
    /// that follows gradients meets a cost without any. A fit that ran is never an error.
    fn minimise(&self, problem: &Problem<'_>, start: &[f64], budget: &Budget) -> Result<Fit, ProblemError>;
}

/// The solvers that come with this crate, with their options.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "name", rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Optimiser {
    /// Damped Gauss-Newton or Newton steps inside the bounds: the default. Needs derivatives.
    LevenbergMarquardt {
        /// Done when no coordinate (`ln x`, or `x/typical`) would move by more than this.
        step_tolerance: f64,
    },
    /// Simplex search by values alone, twice: once from the start, once from where that ended.
    NelderMead {
        /// Done when the values at the corners agree to this, relative to the value at the start.
        spread_tolerance: f64,
        /// Edge of the first simplex, in coordinates.
        edge: f64,
    },
    /// Limited-memory BFGS with the Moré-Thuente line search. Needs derivatives; never the default: it can claim
    /// convergence on a plateau, which the report then calls by its name.
    #[serde(rename = "l-bfgs")]
    LBfgs {
        /// Steps remembered.
        memory: usize,
        /// Done when the gradient, relative to the value at the start, is below this.
        gradient_tolerance: f64,
    },
}

impl Default for Optimiser {
    fn default() -> Self {
        Self::LevenbergMarquardt { step_tolerance: 1e-9 }
    }
}

impl Optimiser {
    /// Names of all solvers, the default first.
    pub const NAMES: [&'static str; 3] = ["levenberg-marquardt", "nelder-mead", "l-bfgs"];

    /// The solver called `name`, with its default options.
    ///
    /// # Errors
    /// [`ProblemError::UnknownOptimiser`], which lists the names there are.
    pub fn by_name(name: &str) -> Result<Self, ProblemError> {
        match name {
            "levenberg-marquardt" => Ok(Self::default()),
            "nelder-mead" => Ok(Self::NelderMead { spread_tolerance: 1e-14, edge: 0.3 }),
            "l-bfgs" => Ok(Self::LBfgs { memory: 7, gradient_tolerance: 1e-9 }),
            _ => Err(ProblemError::UnknownOptimiser { name: name.into(), known: Self::NAMES.join(", ") }),
        }
    }

    fn run(&self, problem: &Problem<'_>, start: &[f64], budget: &Budget) -> Run {
        match *self {
            Self::LevenbergMarquardt { step_tolerance } => {
                let solver = LevenbergMarquardt::new(problem.bounds(), step_tolerance);
                run(problem, start, budget, Outside::Wall, solver, |s| s.param(start.to_vec()))
            }
            Self::NelderMead { spread_tolerance, edge } => {
                let once = |from: &[f64], budget: &Budget| {
                    let solver = NelderMead::new(simplex(from, &problem.bounds(), edge))
                        .with_sd_tolerance(spread_tolerance)
                        .expect("the tolerance is positive");
                    run(problem, from, budget, Outside::Infinite, solver, |s: SolverState<(), ()>| s)
                };
                // A simplex can shrink onto a point that is no minimum; a second one started there then moves on.
                let first = once(start, budget);
                let spent = first.evaluations.values;
                if first.stop != Stop::BySolver || spent >= budget.evaluations {
                    return first;
                }
                let left = Budget {
                    iterations: budget.iterations.saturating_sub(first.iterations),
                    evaluations: budget.evaluations.saturating_sub(spent),
                };
                let mut second = once(&first.best.z, &left);
                second.iterations += first.iterations;
                second.evaluations.values += spent;
                second
            }
            Self::LBfgs { memory, gradient_tolerance } => {
                let solver = LBFGS::new(MoreThuenteLineSearch::new(), memory)
                    .with_tolerance_grad(gradient_tolerance)
                    .and_then(|s| s.with_tolerance_cost(0.0))
                    .expect("the tolerances are not negative");
                run(problem, start, budget, Outside::Wall, solver, |s: SolverState<Vec<f64>, ()>| {
                    s.param(start.to_vec())
                })
            }
        }
    }
}

impl Minimiser for Optimiser {
    fn name(&self) -> String {
        match self {
            Self::LevenbergMarquardt { .. } => Self::NAMES[0],
            Self::NelderMead { .. } => Self::NAMES[1],
            Self::LBfgs { .. } => Self::NAMES[2],
        }
        .into()
    }

    fn minimise(&self, problem: &Problem<'_>, start: &[f64], budget: &Budget) -> Result<Fit, ProblemError> {
        let from = problem.coordinates(start)?;
        let mut run = self.run(problem, &from, budget);
        let follows_gradients = !matches!(self, Self::NelderMead { .. });
        if follows_gradients && !run.started_with_derivatives && !problem.has_derivatives_at(&from) {
            return Err(ProblemError::NeedsDerivatives { optimiser: self.name() });
        }
        let failure = match &run.stop {
            Stop::Failed(why) => Some(why.as_str()),
            _ => None,
        };
        let end = if run.stop == Stop::Exhausted {
            End::LimitReached
        } else {
            if run.best.derivatives.is_none() {
                run.best.derivatives = problem.derivatives_at(&run.best.z);
                run.evaluations.derivatives += 1;
            }
            problem.judge(&run.best.z, run.best.derivatives.as_ref(), failure)
        };
        Ok(Fit {
            optimiser: self.name(),
            start: start.to_vec(),
            x: problem.point(&run.best.z),
            value: run.best.value,
            end,
            iterations: run.iterations,
            evaluations: run.evaluations,
        })
    }
}

/// A simplex with one corner at `from` and edges along the coordinates, towards the farther bound.
fn simplex(from: &[f64], bounds: &[(f64, f64)], edge: f64) -> Vec<Vec<f64>> {
    let corner = |i: usize| {
        let mut z = from.to_vec();
        let (lower, upper) = bounds[i];
        z[i] += if upper - z[i] > z[i] - lower { edge.min(upper - z[i]) } else { -edge.min(z[i] - lower) };
        z
    };
    std::iter::once(from.to_vec()).chain((0..from.len()).map(corner)).collect()
}

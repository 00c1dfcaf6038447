//! The one place where our costs meet argmin's traits.
//!
//! argmin asks for value, gradient and Hessian apart, runs without limits unless told, reports an exhausted budget as
//! success, and stops with an error at a value that is not a number. So: one evaluation serves all three, the budget is
//! counted here, the best point is kept here, and a value that is not finite is infinite.

use std::cell::{Cell, RefCell};

use argmin::core::{CostFunction, Error, Executor, Gradient, Hessian, IterState, Solver, State, TerminationReason};

use crate::problem::{Derivatives, Problem};
use crate::report::{Budget, Evaluations};

/// State of the solvers used here: vectors, and matrices as vectors of rows.
pub(crate) type SolverState<G, H> = IterState<Vec<f64>, G, (), H, (), f64>;

/// How a run of a solver stopped, before anyone has looked at where.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Stop {
    BySolver,
    Exhausted,
    Failed(String),
}

/// What a run left behind.
pub(crate) struct Run {
    pub(crate) best: Vec<f64>,
    pub(crate) value: f64,
    pub(crate) stop: Stop,
    pub(crate) iterations: u64,
    pub(crate) evaluations: Evaluations,
}

/// What to do with points outside the bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outside {
    /// Infinitely bad: for solvers that compare values only.
    Infinite,
    /// The nearest point inside, plus a quadratic wall: continuous with its gradient, for solvers that follow it.
    Wall,
}

/// A problem as argmin sees it, in the free coordinates.
pub(crate) struct Objective<'p, 'c> {
    problem: &'p Problem<'c>,
    bounds: Vec<(f64, f64)>,
    outside: Outside,
    /// Values are divided by this, so that solvers' absolute tolerances mean something.
    unit: f64,
    limit: u64,
    counts: &'p Cell<Evaluations>,
    /// Whether an evaluation was asked for after the budget was spent: solvers may wrap the error in their own.
    refused: &'p Cell<bool>,
    best: &'p RefCell<(Vec<f64>, f64)>,
    last: RefCell<Option<(Vec<f64>, Derivatives)>>,
}

/// The evaluation budget ran out: not a failure of the solver, and it must not be taken for one.
#[derive(Debug, thiserror::Error)]
#[error("evaluation budget exhausted")]
pub(crate) struct Exhausted;

impl Objective<'_, '_> {
    fn count(&self, add: impl FnOnce(&mut Evaluations)) -> Result<(), Error> {
        let mut counts = self.counts.get();
        if counts.values + counts.derivatives >= self.limit {
            self.refused.set(true);
            return Err(Exhausted.into());
        }
        add(&mut counts);
        self.counts.set(counts);
        Ok(())
    }

    fn inside(&self, z: &[f64]) -> (Vec<f64>, f64) {
        let inside: Vec<f64> = z.iter().zip(&self.bounds).map(|(z, (lo, hi))| z.clamp(*lo, *hi)).collect();
        let distance2 = inside.iter().zip(z).map(|(a, b)| (a - b) * (a - b)).sum();
        (inside, distance2)
    }

    fn keep(&self, z: &[f64], value: f64) {
        let mut best = self.best.borrow_mut();
        if value < best.1 {
            *best = (z.to_vec(), value);
        }
    }

    fn derivatives(&self, z: &[f64]) -> Result<Derivatives, Error> {
        if let Some((at, known)) = self.last.borrow().as_ref()
            && at == z
        {
            return Ok(known.clone());
        }
        self.count(|c| c.derivatives += 1)?;
        let (inside, distance2) = self.inside(z);
        let mut d = self
            .problem
            .derivatives_at(&inside)
            .ok_or_else(|| Error::msg("the cost has no finite derivatives at this point"))?;
        self.keep(&inside, d.value);
        d.value = d.value / self.unit + distance2;
        d.gradient.iter_mut().chain(d.curvature.iter_mut().flatten()).for_each(|v| *v /= self.unit);
        for i in 0..z.len() {
            let beyond = z[i] - inside[i];
            if beyond != 0.0 {
                d.gradient[i] = 2.0 * beyond;
            }
        }
        *self.last.borrow_mut() = Some((z.to_vec(), d.clone()));
        Ok(d)
    }
}

impl CostFunction for Objective<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, z: &Vec<f64>) -> Result<f64, Error> {
        if let Some((at, known)) = self.last.borrow().as_ref()
            && at == z
        {
            return Ok(known.value);
        }
        if !z.iter().all(|v| v.is_finite()) {
            return Ok(f64::INFINITY);
        }
        let (inside, distance2) = self.inside(z);
        if self.outside == Outside::Infinite && distance2 > 0.0 {
            return Ok(f64::INFINITY);
        }
        match self.count(|c| c.values += 1) {
            // argmin's simplex panics on an error from a corner, so to a solver that only compares values the point is bad.
            Err(_) if self.outside == Outside::Infinite => return Ok(f64::INFINITY),
            counted => counted?,
        }
        let value = self.problem.value_at(&inside);
        self.keep(&inside, value);
        Ok(value / self.unit + distance2)
    }
}

impl Gradient for Objective<'_, '_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, z: &Vec<f64>) -> Result<Vec<f64>, Error> {
        Ok(self.derivatives(z)?.gradient)
    }
}

impl Hessian for Objective<'_, '_> {
    type Param = Vec<f64>;
    type Hessian = Vec<Vec<f64>>;

    fn hessian(&self, z: &Vec<f64>) -> Result<Vec<Vec<f64>>, Error> {
        Ok(self.derivatives(z)?.curvature)
    }
}

/// Runs `solver` from the state that `configure` makes of an empty one.
pub(crate) fn run<'p, 'c, S, G, H>(
    problem: &'p Problem<'c>,
    start: &[f64],
    budget: &Budget,
    outside: Outside,
    solver: S,
    configure: impl FnOnce(SolverState<G, H>) -> SolverState<G, H>,
) -> Run
where
    S: for<'q> Solver<Objective<'q, 'c>, SolverState<G, H>>,
    SolverState<G, H>: State<Param = Vec<f64>, Float = f64>,
{
    let counts = Cell::new(Evaluations { values: 1, derivatives: 0 });
    let at_start = problem.value_at(start);
    let best = RefCell::new((start.to_vec(), at_start));
    let refused = Cell::new(false);
    let unit = if at_start.is_finite() && at_start != 0.0 { at_start.abs() } else { 1.0 };
    let objective = Objective {
        problem,
        bounds: problem.bounds(),
        outside,
        unit,
        limit: budget.evaluations,
        counts: &counts,
        refused: &refused,
        best: &best,
        last: RefCell::new(None),
    };
    let iterations = Cell::new(0);
    let result =
        Executor::new(objective, solver).configure(|state| configure(state).max_iters(budget.iterations)).run();
    let stop = match result {
        _ if refused.get() => Stop::Exhausted,
        Ok(result) => {
            iterations.set(result.state().get_iter());
            match result.state().get_termination_reason() {
                Some(TerminationReason::SolverConverged | TerminationReason::TargetCostReached) => Stop::BySolver,
                Some(TerminationReason::SolverExit(why)) => Stop::Failed(why.clone()),
                _ => Stop::Exhausted,
            }
        }
        Err(error) => Stop::Failed(error.to_string()),
    };
    let (best, value) = best.into_inner();
    Run { best, value, stop, iterations: iterations.get(), evaluations: counts.get() }
}

//! The one place where our costs meet argmin's traits.
//!
//! argmin asks for value, gradient and Hessian apart, runs without limits unless told, reports an exhausted budget as
//! success, and stops with an error at a value that is not a number. So: one evaluation serves all three, the budget is
//! counted here, the best point is kept here, and a value that is not finite is infinite.

use std::cell::{Cell, RefCell};

use argmin::core::{
    CostFunction, Error, Executor, Gradient, Hessian, IterState, KV, Solver, State, TerminationReason,
    TerminationStatus,
};

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

/// The lowest point that was evaluated.
#[derive(Clone, Debug)]
pub(crate) struct Best {
    pub(crate) z: Vec<f64>,
    pub(crate) value: f64,
    /// If it was evaluated with derivatives.
    pub(crate) derivatives: Option<Derivatives>,
}

/// What a run left behind.
pub(crate) struct Run {
    pub(crate) best: Best,
    /// Whether derivatives were asked for at the start and finite there.
    pub(crate) started_with_derivatives: bool,
    pub(crate) stop: Stop,
    pub(crate) iterations: u64,
    pub(crate) evaluations: Evaluations,
}

/// What to do with points outside the bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outside {
    /// Infinitely bad: for solvers that compare values only.
    Infinite,
    /// The nearest point inside, plus a quadratic wall: continuous, with a kink in the gradient at the bound itself, for
    /// solvers that follow the gradient.
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
    best: &'p RefCell<Best>,
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

    fn keep(&self, z: &[f64], value: f64, derivatives: Option<&Derivatives>) {
        let mut best = self.best.borrow_mut();
        if value < best.value {
            *best = Best { z: z.to_vec(), value, derivatives: derivatives.cloned() };
        }
    }

    /// `d`, taken at `inside`, as the solver is to see it at `z`: in the unit of the values, the wall added.
    fn seen_from(&self, z: &[f64], inside: &[f64], mut d: Derivatives) -> Derivatives {
        d.value /= self.unit;
        d.gradient.iter_mut().chain(d.curvature.iter_mut().flatten()).for_each(|v| *v /= self.unit);
        for i in 0..z.len() {
            let beyond = z[i] - inside[i];
            if beyond != 0.0 {
                d.value += beyond * beyond;
                d.gradient[i] = 2.0 * beyond;
            }
        }
        d
    }

    fn derivatives(&self, z: &[f64]) -> Result<Derivatives, Error> {
        if let Some((at, known)) = self.last.borrow().as_ref()
            && at == z
        {
            return Ok(known.clone());
        }
        self.count(|c| c.derivatives += 1)?;
        let (inside, _) = self.inside(z);
        let d = self
            .problem
            .derivatives_at(&inside)
            .ok_or_else(|| Error::msg("the cost has no finite derivatives at this point"))?;
        self.keep(&inside, d.value, Some(&d));
        let d = self.seen_from(z, &inside, d);
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
        self.keep(&inside, value, None);
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

/// A solver whose iterations are counted even if it stops with an error, which takes argmin's own count with it.
struct Counting<'q, S> {
    solver: S,
    iterations: &'q Cell<u64>,
}

impl<O, I: State, S: Solver<O, I>> Solver<O, I> for Counting<'_, S> {
    fn name(&self) -> &str {
        self.solver.name()
    }

    fn init(&mut self, problem: &mut argmin::core::Problem<O>, state: I) -> Result<(I, Option<KV>), Error> {
        self.solver.init(problem, state)
    }

    fn next_iter(&mut self, problem: &mut argmin::core::Problem<O>, state: I) -> Result<(I, Option<KV>), Error> {
        self.iterations.set(self.iterations.get() + 1);
        self.solver.next_iter(problem, state)
    }

    fn terminate(&mut self, state: &I) -> TerminationStatus {
        self.solver.terminate(state)
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
    // The start is evaluated here, in the way that the solver will ask for it, and sets the unit of the values.
    let derivatives = if outside == Outside::Wall { problem.derivatives_at(start) } else { None };
    let value = derivatives.as_ref().map_or_else(|| problem.value_at(start), |d| d.value);
    let with_derivatives = u64::from(derivatives.is_some());
    let counts = Cell::new(Evaluations { values: 1 - with_derivatives, derivatives: with_derivatives });
    let refused = Cell::new(false);
    let best = RefCell::new(Best { z: start.to_vec(), value, derivatives: derivatives.clone() });
    let objective = Objective {
        problem,
        bounds: problem.bounds(),
        outside,
        unit: if value.is_finite() && value != 0.0 { value.abs() } else { 1.0 },
        limit: budget.evaluations,
        counts: &counts,
        refused: &refused,
        best: &best,
        last: RefCell::new(None),
    };
    let known = derivatives.map(|d| (start.to_vec(), objective.seen_from(start, start, d)));
    *objective.last.borrow_mut() = known;
    let iterations = Cell::new(0);
    let result = Executor::new(objective, Counting { solver, iterations: &iterations })
        .configure(|state| configure(state).max_iters(budget.iterations))
        .run();
    let stop = match result {
        _ if refused.get() => Stop::Exhausted,
        Ok(result) => match result.state().get_termination_reason() {
            Some(TerminationReason::SolverConverged | TerminationReason::TargetCostReached) => Stop::BySolver,
            Some(TerminationReason::SolverExit(why)) => Stop::Failed(why.clone()),
            _ => Stop::Exhausted,
        },
        Err(error) => Stop::Failed(error.to_string()),
    };
    Run {
        best: best.into_inner(),
        started_with_derivatives: with_derivatives > 0,
        stop,
        iterations: iterations.get(),
        evaluations: counts.get(),
    }
}

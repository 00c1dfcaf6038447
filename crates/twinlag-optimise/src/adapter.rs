//! The one place where our costs meet argmin's traits.
//!
//! argmin asks for value, gradient and Hessian separately, runs without limits by default, reports
//! an exhausted budget as success, and stops with an error at a value that is not a number. So: one
//! evaluation serves all three, limits and the best point are the ledger's, and a value that is not
//! finite is infinite.

use std::cell::RefCell;

use argmin::core::{
    CostFunction, Error, Executor, Gradient, Hessian, IterState, KV, Solver, State, TerminationReason,
    TerminationStatus,
};

use crate::ledger::{Ledger, Stop};
use crate::problem::{Derivatives, NoDerivatives};

/// A value below this share of the slope is one that happens to vanish at the start, as a
/// difference may: it is no unit.
const VANISHING: f64 = 1e-3;

/// State of the solvers used here: vectors, and matrices as vectors of rows.
pub(crate) type SolverState<G, H> = IterState<Vec<f64>, G, (), H, (), f64>;

/// What to do with points outside the bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outside {
    /// Infinitely bad: for solvers that compare values only.
    Infinite,
    /// The nearest point inside, plus a quadratic wall: continuous, for solvers that follow the
    /// gradient. At a bound against which the cost presses, the slope is the wall's, which is zero
    /// there: the solver sees that it has arrived.
    #[cfg_attr(not(feature = "local"), expect(dead_code, reason = "for solvers that follow gradients"))]
    Wall,
}

/// A problem as argmin sees it, in the free coordinates.
pub(crate) struct Objective<'l, 'p, 'c, 'o> {
    ledger: &'l Ledger<'p, 'c, 'o>,
    outside: Outside,
    /// Values are divided by this, so that solvers' absolute tolerances mean something.
    unit: f64,
    last: RefCell<Seen>,
}

/// The last point that was seen with derivatives, or the start, as the solver sees it.
struct Seen {
    z: Vec<f64>,
    value: f64,
    derivatives: Option<Derivatives>,
}

impl<'l, 'p, 'c, 'o> Objective<'l, 'p, 'c, 'o> {
    /// The problem as seen from the best point so far, whose value is the unit of the values.
    pub(crate) fn new(ledger: &'l Ledger<'p, 'c, 'o>, outside: Outside) -> Self {
        let best = ledger.best();
        let slope = best.derivatives.iter().flat_map(|d| &d.gradient).fold(0.0_f64, |m, g| m.max(g.abs()));
        let size = best.value.abs().max(VANISHING * slope);
        let unit = if size.is_finite() && size > 0.0 { size } else { 1.0 };
        let last = RefCell::new(Seen { z: best.z, value: best.value / unit, derivatives: None });
        let objective = Self { ledger, outside, unit, last };
        if let Some(d) = best.derivatives {
            let at = objective.last.borrow().z.clone();
            let seen = objective.seen_from(&at, &at, Derivatives::clone(&d));
            objective.last.borrow_mut().derivatives = Some(seen);
        }
        objective
    }

    #[cfg(feature = "global")]
    pub(crate) fn ledger(&self) -> &'l Ledger<'p, 'c, 'o> {
        self.ledger
    }

    fn inside(&self, z: &[f64]) -> (Vec<f64>, f64) {
        let bounds = self.ledger.problem().bounds();
        let inside: Vec<f64> = z.iter().zip(bounds).map(|(z, (lo, hi))| z.clamp(*lo, *hi)).collect();
        let distance2 = inside.iter().zip(z).map(|(a, b)| (a - b) * (a - b)).sum();
        (inside, distance2)
    }

    /// `d`, taken at `inside`, as the solver is to see it at `z`: in the unit of the values, the
    /// wall added.
    fn seen_from(&self, z: &[f64], inside: &[f64], mut d: Derivatives) -> Derivatives {
        d.value /= self.unit;
        d.gradient.iter_mut().chain(d.curvature.iter_mut().flatten()).for_each(|v| *v /= self.unit);
        for (i, (lower, upper)) in self.ledger.problem().bounds().iter().enumerate() {
            let beyond = z[i] - inside[i];
            let pressed = (z[i] == *lower && d.gradient[i] > 0.0) || (z[i] == *upper && d.gradient[i] < 0.0);
            if beyond != 0.0 || pressed {
                d.value += beyond * beyond;
                d.gradient[i] = 2.0 * beyond;
                for j in 0..z.len() {
                    (d.curvature[i][j], d.curvature[j][i]) = (0.0, 0.0);
                }
                d.curvature[i][i] = 2.0;
            }
        }
        d
    }

    fn derivatives<T>(&self, z: &[f64], part: impl FnOnce(&Derivatives) -> T) -> Result<T, Error> {
        {
            let last = self.last.borrow();
            if let Some(d) = &last.derivatives
                && last.z == z
            {
                return Ok(part(d));
            }
        }
        if !z.iter().all(|v| v.is_finite()) {
            return Err(NoDerivatives::NotFinite.into());
        }
        let (inside, _) = self.inside(z);
        let d = self.ledger.derivatives(&inside)?;
        let d = self.seen_from(z, &inside, Derivatives::clone(&d));
        let out = part(&d);
        *self.last.borrow_mut() = Seen { z: z.to_vec(), value: d.value, derivatives: Some(d) };
        Ok(out)
    }
}

impl CostFunction for Objective<'_, '_, '_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, z: &Vec<f64>) -> Result<f64, Error> {
        {
            let last = self.last.borrow();
            if last.z == *z {
                return Ok(last.value);
            }
        }
        if !z.iter().all(|v| v.is_finite()) {
            return Ok(f64::INFINITY);
        }
        let (inside, distance2) = self.inside(z);
        if self.outside == Outside::Infinite && distance2 > 0.0 {
            return Ok(f64::INFINITY);
        }
        match self.ledger.value(&inside) {
            Ok(value) => Ok(value / self.unit + distance2),
            // argmin's simplex panics on an error from a corner, so to a solver that only compares
            // values the point is bad.
            Err(_) if self.outside == Outside::Infinite => Ok(f64::INFINITY),
            Err(exhausted) => Err(exhausted.into()),
        }
    }
}

impl Gradient for Objective<'_, '_, '_, '_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, z: &Vec<f64>) -> Result<Vec<f64>, Error> {
        self.derivatives(z, |d| d.gradient.clone())
    }
}

impl Hessian for Objective<'_, '_, '_, '_> {
    type Param = Vec<f64>;
    type Hessian = Vec<Vec<f64>>;

    fn hessian(&self, z: &Vec<f64>) -> Result<Vec<Vec<f64>>, Error> {
        self.derivatives(z, |d| d.curvature.clone())
    }
}

/// A solver that keeps the ledger: its iterations are counted even if it stops with an error, which
/// takes argmin's own count with it; it is stopped when the budget is spent, whether it has noticed
/// or not.
struct Kept<'l, 'p, 'c, 'o, S> {
    solver: S,
    ledger: &'l Ledger<'p, 'c, 'o>,
}

impl<O, I: State, S: Solver<O, I>> Solver<O, I> for Kept<'_, '_, '_, '_, S> {
    fn name(&self) -> &str {
        self.solver.name()
    }

    fn init(&mut self, problem: &mut argmin::core::Problem<O>, state: I) -> Result<(I, Option<KV>), Error> {
        self.solver.init(problem, state)
    }

    fn next_iter(&mut self, problem: &mut argmin::core::Problem<O>, state: I) -> Result<(I, Option<KV>), Error> {
        self.ledger.count_iteration();
        let out = self.solver.next_iter(problem, state);
        self.ledger.report();
        out
    }

    fn terminate(&mut self, state: &I) -> TerminationStatus {
        match self.solver.terminate(state) {
            TerminationStatus::NotTerminated if self.ledger.is_spent() => {
                TerminationStatus::Terminated(TerminationReason::MaxItersReached)
            }
            status => status,
        }
    }
}

/// Runs `solver` on `objective` from the state that `configure` makes of an empty one.
pub(crate) fn run<O, S, I>(ledger: &Ledger<'_, '_, '_>, objective: O, solver: S, configure: impl FnOnce(I) -> I) -> Stop
where
    S: Solver<O, I>,
    I: State<Float = f64>,
{
    let result = Executor::new(objective, Kept { solver, ledger }).configure(configure).run();
    match result {
        _ if ledger.was_refused() => Stop::Exhausted,
        Ok(result) => match result.state().get_termination_reason() {
            Some(TerminationReason::SolverConverged | TerminationReason::TargetCostReached) => Stop::BySolver,
            Some(TerminationReason::SolverExit(why)) => Stop::Failed(why.clone()),
            _ => Stop::Exhausted,
        },
        Err(error) => Stop::Failed(error.to_string()),
    }
}

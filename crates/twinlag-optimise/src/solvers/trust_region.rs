//! argmin's Newton steps within a trust region, with a stopping rule, which argmin lacks.

use argmin::core::{
    Error, KV, KvValue, Problem, Solver, State as _, TerminationReason, TerminationStatus, TrustRegionRadius,
};
use argmin::solver::trustregion::{Steihaug, TrustRegion};

use crate::adapter::{Objective, Outside, SolverState, run as run_argmin};
use crate::ledger::{Ledger, Stop};
use crate::solvers::dogleg::Dogleg;

type State = SolverState<Vec<f64>, Vec<Vec<f64>>>;

/// Longest step: the factor e² for logarithms that Levenberg-Marquardt has too.
const LARGEST_RADIUS: f64 = 2.0;

/// A trust region whose step is found by conjugate gradients.
pub(crate) fn steihaug(ledger: &Ledger<'_, '_, '_>, step_tolerance: f64) -> Stop {
    // n iterations solve the model but for rounding; without a limit there may be no end. The
    // tolerance also says which gradient, relative to the value at the start, is none.
    let n = ledger.best().z.len() as u64;
    let step = Steihaug::new().with_max_iters(10 * n).with_epsilon(1e-12).expect("the tolerance is positive");
    run(ledger, step, step_tolerance)
}

/// A trust region whose step is the dogleg.
pub(crate) fn dogleg(ledger: &Ledger<'_, '_, '_>, step_tolerance: f64) -> Stop {
    run(ledger, Dogleg::new(), step_tolerance)
}

fn run<R>(ledger: &Ledger<'_, '_, '_>, step: R, step_tolerance: f64) -> Stop
where
    R: Clone + TrustRegionRadius<f64>,
    for<'l, 'p, 'c, 'o> R: Solver<Objective<'l, 'p, 'c, 'o>, State>,
{
    let solver = TrustRegion::new(step).with_max_radius(LARGEST_RADIUS).expect("the radius is positive");
    let stopping = Stopping { solver, step_tolerance, radius: f64::INFINITY, done: false };
    let z = ledger.best().z;
    run_argmin(ledger, Objective::new(ledger, Outside::Wall), stopping, |s: State| s.param(z))
}

/// Stops when a step, or the region for the next, is no longer than the tolerance, and where
/// nothing moves any more.
struct Stopping<S> {
    solver: S,
    step_tolerance: f64,
    /// In the last iteration.
    radius: f64,
    done: bool,
}

impl<O, S: Solver<O, State>> Solver<O, State> for Stopping<S> {
    fn name(&self) -> &str {
        self.solver.name()
    }

    fn init(&mut self, problem: &mut Problem<O>, state: State) -> Result<(State, Option<KV>), Error> {
        self.solver.init(problem, state)
    }

    fn next_iter(&mut self, problem: &mut Problem<O>, state: State) -> Result<(State, Option<KV>), Error> {
        let before = state.get_param().cloned().unwrap_or_default();
        let (state, told) = self.solver.next_iter(problem, state)?;
        // The region is private; it is told to those who watch.
        let radius = told.as_ref().and_then(|kv| kv.get("radius")).and_then(KvValue::get_float).unwrap_or(f64::NAN);
        let after = state.get_param().map_or(&[][..], Vec::as_slice);
        let moved = after.iter().zip(&before).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        self.done = if moved > 0.0 {
            moved <= self.step_tolerance
        } else {
            // A refused step makes the region smaller. If it did not, the step was zero, and will
            // be for ever.
            radius <= self.step_tolerance || radius == self.radius || radius.is_nan()
        };
        self.radius = if moved > 0.0 { f64::INFINITY } else { radius };
        Ok((state, told))
    }

    fn terminate(&mut self, _: &State) -> TerminationStatus {
        if self.done {
            TerminationStatus::Terminated(TerminationReason::SolverConverged)
        } else {
            TerminationStatus::NotTerminated
        }
    }
}

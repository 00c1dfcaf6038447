//! Simulated annealing, argmin's, over the whole of the bounds; then a local search.
//!
//! argmin's annealing makes one move in an iteration and has no end of its own. Here an iteration
//! is a sweep of moves, and there is a number of sweeps. The temperature falls by the same factor
//! with every move, down to a share `cooling` of what it was; moves are uniform within a window
//! whose width goes with the square root of the temperature, from the whole range of a coordinate:
//! that is how wide a parabola is at the temperature's height.
//!
//! The first temperature is a multiple of the median difference of values from that at the start,
//! over as many random points as a sweep has moves. The value at the start itself is no measure:
//! from the bottom of a well the walk would never leave.

use std::cell::RefCell;

use argmin::core::{CostFunction, Error, KV, Problem, Solver, State as _, TerminationReason, TerminationStatus};
use argmin::solver::simulatedannealing::{Anneal, SATempFunc, SimulatedAnnealing};

use crate::adapter::{Objective, Outside, SolverState, run as run_argmin};
use crate::ledger::{Ledger, Stop};
use crate::solvers::polish;
use crate::solvers::random::{Generator, between, generator};

type State = SolverState<(), ()>;

/// How the temperature falls.
#[derive(Clone, Copy)]
pub(crate) struct Schedule {
    pub(crate) sweeps: u64,
    pub(crate) moves: u64,
    pub(crate) temperature: f64,
    pub(crate) cooling: f64,
}

/// Walks from the best point so far.
pub(crate) fn run(ledger: &Ledger<'_, '_, '_>, schedule: Schedule, seed: u64) -> Stop {
    let Schedule { sweeps, moves, temperature, cooling } = schedule;
    let z = ledger.best().z;
    // Another stream than that which decides on acceptance.
    let random = RefCell::new(generator(!seed));
    let mut walk = Walk { objective: Objective::new(ledger, Outside::Infinite), hottest: 1.0, random };
    let start = walk.objective.cost(&z).unwrap_or(f64::INFINITY);
    let mut differences = Vec::new();
    for _ in 0..moves {
        if ledger.was_refused() {
            return Stop::Exhausted;
        }
        let value = walk.objective.cost(&walk.moved(&z, 1.0)).unwrap_or(f64::INFINITY);
        differences.push((value - start).abs());
    }
    differences.retain(|d| d.is_finite() && *d > 0.0);
    differences.sort_by(f64::total_cmp);
    walk.hottest = (temperature * differences.get(differences.len() / 2).unwrap_or(&1.0)).max(f64::MIN_POSITIVE);
    let factor = cooling.powf(1.0 / sweeps.saturating_mul(moves).max(1) as f64);
    let solver = SimulatedAnnealing::new_with_rng(walk.hottest, generator(seed))
        .expect("the temperature is positive")
        .with_temp_func(SATempFunc::Exponential(factor));
    match run_argmin(ledger, walk, Sweeps { solver, ledger, moves, left: sweeps }, |s: State| s.param(z)) {
        Stop::BySolver => polish::run(ledger),
        stop => stop,
    }
}

/// A cost with moves at random.
struct Walk<'l, 'p, 'c, 'o> {
    objective: Objective<'l, 'p, 'c, 'o>,
    hottest: f64,
    random: RefCell<Generator>,
}

impl Walk<'_, '_, '_, '_> {
    /// A point within `share` of the range of each coordinate to either side, and within the
    /// bounds.
    fn moved(&self, z: &[f64], share: f64) -> Vec<f64> {
        let bounds = self.objective.ledger().problem().bounds();
        let mut random = self.random.borrow_mut();
        let reach = |lower: f64, upper: f64| share * (upper - lower);
        z.iter()
            .zip(bounds)
            .map(|(z, &(l, u))| between((z - reach(l, u)).max(l), (z + reach(l, u)).min(u), &mut random))
            .collect()
    }
}

impl CostFunction for Walk<'_, '_, '_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, z: &Vec<f64>) -> Result<f64, Error> {
        self.objective.cost(z)
    }
}

impl Anneal for Walk<'_, '_, '_, '_> {
    type Param = Vec<f64>;
    type Output = Vec<f64>;
    type Float = f64;

    fn anneal(&self, z: &Vec<f64>, temperature: f64) -> Result<Vec<f64>, Error> {
        let share = (temperature / self.hottest).sqrt();
        Ok(self.moved(z, share))
    }
}

/// A solver of which one iteration is `moves` of its own, and which is done when no sweeps are
/// left.
struct Sweeps<'l, 'p, 'c, 'o, S> {
    solver: S,
    ledger: &'l Ledger<'p, 'c, 'o>,
    moves: u64,
    left: u64,
}

impl<O, S: Solver<O, State>> Solver<O, State> for Sweeps<'_, '_, '_, '_, S> {
    fn name(&self) -> &str {
        self.solver.name()
    }

    fn init(&mut self, problem: &mut Problem<O>, state: State) -> Result<(State, Option<KV>), Error> {
        self.solver.init(problem, state)
    }

    fn next_iter(&mut self, problem: &mut Problem<O>, mut state: State) -> Result<(State, Option<KV>), Error> {
        self.left = self.left.saturating_sub(1);
        for _ in 0..self.moves {
            if self.ledger.was_refused() {
                break;
            }
            state = self.solver.next_iter(problem, state)?.0;
            state.update();
        }
        Ok((state, None))
    }

    fn terminate(&mut self, _: &State) -> TerminationStatus {
        if self.left == 0 {
            TerminationStatus::Terminated(TerminationReason::SolverConverged)
        } else {
            TerminationStatus::NotTerminated
        }
    }
}

//! Particle swarm, argmin's, over the whole of the bounds; then a local search.
//!
//! argmin's swarm has no rule for stopping: it runs for a number of generations, which is an
//! option.

use argmin::core::{CostFunction, Error, KV, PopulationState, Problem, Solver, TerminationReason, TerminationStatus};
use argmin::solver::particleswarm::{Particle, ParticleSwarm};

use crate::adapter::{Objective, Outside, run as run_argmin};
use crate::ledger::{Ledger, Stop};
use crate::solvers::polish;
use crate::solvers::random::{between, generator};

type Population = PopulationState<Particle<Vec<f64>, f64>, f64>;

/// Searches with `particles`, of which the start is one, for `generations`.
pub(crate) fn run(ledger: &Ledger<'_, '_, '_>, particles: usize, generations: u64, seed: u64) -> Stop {
    let bounds = ledger.problem().bounds();
    let objective = Objective::new(ledger, Outside::Infinite);
    let mut random = generator(seed);
    let start = ledger.best().z;
    let mut swarm = Vec::new();
    while swarm.len() < particles.max(1) {
        let position: Vec<f64> = if swarm.is_empty() {
            start.clone()
        } else {
            bounds.iter().map(|(lower, upper)| between(*lower, *upper, &mut random)).collect()
        };
        if ledger.was_refused() {
            return Stop::Exhausted;
        }
        let velocity = bounds.iter().map(|(lower, upper)| between(lower - upper, upper - lower, &mut random)).collect();
        let cost = objective.cost(&position).unwrap_or(f64::INFINITY);
        swarm.push(Particle::new(position, cost, velocity));
    }
    let solver = ParticleSwarm::new(bounds.iter().copied().unzip(), swarm.len()).with_rng_generator(random);
    let limited = Generations { solver, left: generations };
    match run_argmin(ledger, objective, limited, |s: Population| s.population(swarm)) {
        Stop::BySolver => polish::run(ledger),
        stop => stop,
    }
}

/// A solver that stops after a given number of iterations.
struct Generations<S> {
    solver: S,
    left: u64,
}

impl<O, S: Solver<O, Population>> Solver<O, Population> for Generations<S> {
    fn name(&self) -> &str {
        self.solver.name()
    }

    fn init(&mut self, problem: &mut Problem<O>, state: Population) -> Result<(Population, Option<KV>), Error> {
        self.solver.init(problem, state)
    }

    fn next_iter(&mut self, problem: &mut Problem<O>, state: Population) -> Result<(Population, Option<KV>), Error> {
        self.left = self.left.saturating_sub(1);
        self.solver.next_iter(problem, state)
    }

    fn terminate(&mut self, _: &Population) -> TerminationStatus {
        if self.left == 0 {
            TerminationStatus::Terminated(TerminationReason::SolverConverged)
        } else {
            TerminationStatus::NotTerminated
        }
    }
}

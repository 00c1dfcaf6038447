//! The solvers by name.

use serde::{Deserialize, Serialize};

use crate::ledger::{Ledger, Observer, Refusal, Stop};
use crate::minimiser::Minimiser;
use crate::problem::{NoDerivatives, Problem, ProblemError};
use crate::report::{Budget, End, Fit, Progress};
#[cfg(feature = "local")]
use crate::solvers::{brent, quasi_newton, trust_region};
use crate::solvers::{levenberg_marquardt, nelder_mead};
#[cfg(feature = "global")]
use crate::solvers::{particle_swarm, simulated_annealing, simulated_annealing::Schedule};

/// The solvers that come with this crate, with their options.
///
/// Tolerances of steps are in coordinates (`ln x`, or `x/typical`), those of values and gradients
/// relative to the value at the start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "name", rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Optimiser {
    /// Damped Gauss-Newton or Newton steps inside the bounds: the default. Needs derivatives.
    LevenbergMarquardt {
        /// Done when no coordinate would move by more than this.
        step_tolerance: f64,
    },
    /// Simplex search by values alone, twice: once from the start, once from where that ended.
    NelderMead {
        /// Done when the values at the corners agree to this.
        spread_tolerance: f64,
        /// Edge of the first simplex, in coordinates.
        edge: f64,
    },
    /// Limited-memory BFGS with the Moré-Thuente line search. Needs derivatives. It is never the
    /// default, since it can claim convergence on a plateau; the report then says so.
    #[serde(rename = "l-bfgs")]
    LBfgs {
        /// Steps remembered.
        memory: usize,
        /// Done when the gradient is below this.
        gradient_tolerance: f64,
    },
    /// BFGS with the Moré-Thuente line search. Needs derivatives. It too can claim convergence on a
    /// plateau.
    Bfgs {
        /// Done when the gradient is below this.
        gradient_tolerance: f64,
    },
    /// Newton steps within a trust region, by conjugate gradients. Needs derivatives.
    NewtonTrustRegionSteihaug {
        /// Done when a step, or the region, is no longer than this.
        step_tolerance: f64,
    },
    /// Newton steps within a trust region, by the dogleg. Needs derivatives.
    NewtonTrustRegionDogleg {
        /// Done when a step, or the region, is no longer than this.
        step_tolerance: f64,
    },
    /// A swarm over the whole of the bounds, including the start; then Levenberg-Marquardt from the
    /// best point, or the simplex if the cost has no derivatives. Global, as far as any solver is;
    /// a seed always finds the same end.
    ParticleSwarm {
        /// Size of the swarm.
        particles: usize,
        /// Iterations of the swarm.
        generations: u64,
        /// Seed of the random numbers.
        seed: u64,
    },
    /// A random walk over the whole of the bounds, with falling temperature; then a local search as
    /// for the swarm. Global, as far as any solver is; a seed always finds the same end.
    SimulatedAnnealing {
        /// Iterations of the walk.
        sweeps: u64,
        /// Moves in each of them.
        moves: u64,
        /// The rise that is still often accepted at first, relative to the median difference of
        /// values at random from that at the start.
        temperature: f64,
        /// Temperature at the end, relative to that at the start.
        cooling: f64,
        /// Seed of the random numbers.
        seed: u64,
    },
    /// Brent's search between the bounds of one free variable, by values alone. The start is one
    /// candidate and no more.
    Brent {
        /// Done when the minimum is known to this.
        step_tolerance: f64,
    },
}

impl Default for Optimiser {
    fn default() -> Self {
        Self::LevenbergMarquardt { step_tolerance: 1e-9 }
    }
}

impl Optimiser {
    /// Names of the local solvers, which go downhill from the start, the default first. Those after the second are built with the
    /// feature `local` of this crate, which is on by default.
    pub const NAMES: [&'static str; 6] = [
        "levenberg-marquardt",
        "nelder-mead",
        "l-bfgs",
        "bfgs",
        "newton-trust-region-steihaug",
        "newton-trust-region-dogleg",
    ];

    /// Names of the global solvers, which search the whole of the bounds. If a cost has a lower
    /// minimum than the one next to the start they go there, whether or not it makes sense. They
    /// are built with the feature `global` of this crate, which is on by default.
    pub const GLOBAL_NAMES: [&'static str; 2] = ["particle-swarm", "simulated-annealing"];

    /// Names of the solvers for one free variable, built with the feature `local`. With more variables they refuse:
    /// [`ProblemError::OneVariable`].
    pub const ONE_VARIABLE_NAMES: [&'static str; 1] = ["brent"];

    /// Names of all solvers.
    pub fn names() -> impl Iterator<Item = &'static str> {
        Self::NAMES.into_iter().chain(Self::GLOBAL_NAMES).chain(Self::ONE_VARIABLE_NAMES)
    }

    /// The solver called `name`, with its default options.
    ///
    /// ```
    /// use twinlag_optimise::Optimiser;
    ///
    /// assert_eq!(Optimiser::by_name("levenberg-marquardt")?, Optimiser::default());
    /// assert!(Optimiser::names().all(|name| Optimiser::by_name(name).is_ok()));
    /// let error = Optimiser::by_name("newton").expect_err("there is none of that name");
    /// assert!(error.to_string().contains("nelder-mead")); // it lists those that there are
    /// # Ok::<(), twinlag_optimise::ProblemError>(())
    /// ```
    ///
    /// # Errors
    /// [`ProblemError::UnknownOptimiser`], which lists the names there are;
    /// [`ProblemError::NotBuilt`] if the solver was left out of this build.
    pub fn by_name(name: &str) -> Result<Self, ProblemError> {
        let found = match name {
            "levenberg-marquardt" => Self::default(),
            "nelder-mead" => Self::NelderMead { spread_tolerance: 1e-14, edge: 0.3 },
            "l-bfgs" => Self::LBfgs { memory: 7, gradient_tolerance: 1e-9 },
            "bfgs" => Self::Bfgs { gradient_tolerance: 1e-9 },
            "newton-trust-region-steihaug" => Self::NewtonTrustRegionSteihaug { step_tolerance: 1e-9 },
            "newton-trust-region-dogleg" => Self::NewtonTrustRegionDogleg { step_tolerance: 1e-9 },
            "particle-swarm" => Self::ParticleSwarm { particles: 30, generations: 60, seed: 0 },
            "simulated-annealing" => {
                Self::SimulatedAnnealing { sweeps: 100, moves: 10, temperature: 0.3, cooling: 1e-4, seed: 0 }
            }
            "brent" => Self::Brent { step_tolerance: 1e-9 },
            _ => {
                return Err(ProblemError::UnknownOptimiser {
                    name: name.into(),
                    known: Self::names().collect::<Vec<_>>().join(", "),
                });
            }
        };
        found.check_built()?;
        Ok(found)
    }

    /// That this build has the solver.
    fn check_built(&self) -> Result<(), ProblemError> {
        let (feature, is_built) = match self {
            Self::LevenbergMarquardt { .. } | Self::NelderMead { .. } => return Ok(()),
            Self::LBfgs { .. }
            | Self::Bfgs { .. }
            | Self::NewtonTrustRegionSteihaug { .. }
            | Self::NewtonTrustRegionDogleg { .. }
            | Self::Brent { .. } => ("local", cfg!(feature = "local")),
            Self::ParticleSwarm { .. } | Self::SimulatedAnnealing { .. } => ("global", cfg!(feature = "global")),
        };
        if is_built { Ok(()) } else { Err(ProblemError::NotBuilt { optimiser: self.name(), feature }) }
    }

    fn follows_gradients(&self) -> bool {
        match self {
            Self::LevenbergMarquardt { .. }
            | Self::LBfgs { .. }
            | Self::Bfgs { .. }
            | Self::NewtonTrustRegionSteihaug { .. }
            | Self::NewtonTrustRegionDogleg { .. } => true,
            Self::NelderMead { .. }
            | Self::ParticleSwarm { .. }
            | Self::SimulatedAnnealing { .. }
            | Self::Brent { .. } => false,
        }
    }

    /// Evaluates the start, in the way that the solver will ask for it.
    fn begin(&self, ledger: &Ledger<'_, '_, '_>) -> Result<(), ProblemError> {
        let start = ledger.best().z;
        if self.follows_gradients() {
            match ledger.derivatives(&start) {
                Err(Refusal::None(NoDerivatives::Anywhere)) => {
                    return Err(ProblemError::NeedsDerivatives { optimiser: self.name() });
                }
                Ok(_) | Err(Refusal::Exhausted(_)) => return Ok(()),
                // There may yet be a value.
                Err(Refusal::None(NoDerivatives::NotFinite)) => {}
            }
        }
        // A refusal is in the ledger.
        let _ = ledger.value(&start);
        Ok(())
    }

    fn run(&self, ledger: &Ledger<'_, '_, '_>) -> Stop {
        match *self {
            Self::LevenbergMarquardt { step_tolerance } => levenberg_marquardt::run(ledger, step_tolerance),
            Self::NelderMead { spread_tolerance, edge } => nelder_mead::run(ledger, spread_tolerance, edge),
            #[cfg(feature = "local")]
            Self::LBfgs { memory, gradient_tolerance } => quasi_newton::l_bfgs(ledger, memory, gradient_tolerance),
            #[cfg(feature = "local")]
            Self::Bfgs { gradient_tolerance } => quasi_newton::bfgs(ledger, gradient_tolerance),
            #[cfg(feature = "local")]
            Self::NewtonTrustRegionSteihaug { step_tolerance } => trust_region::steihaug(ledger, step_tolerance),
            #[cfg(feature = "local")]
            Self::NewtonTrustRegionDogleg { step_tolerance } => trust_region::dogleg(ledger, step_tolerance),
            #[cfg(feature = "global")]
            Self::ParticleSwarm { particles, generations, seed } => {
                particle_swarm::run(ledger, particles, generations, seed)
            }
            #[cfg(feature = "global")]
            Self::SimulatedAnnealing { sweeps, moves, temperature, cooling, seed } => {
                simulated_annealing::run(ledger, Schedule { sweeps, moves, temperature, cooling }, seed)
            }
            #[cfg(feature = "local")]
            Self::Brent { step_tolerance } => brent::run(ledger, step_tolerance),
            #[cfg(not(all(feature = "local", feature = "global")))]
            _ => unreachable!("a fit begins with a check that its solver is built"),
        }
    }

    fn fit(
        &self,
        problem: &Problem<'_>,
        start: &[f64],
        budget: &Budget,
        observer: Option<Observer<'_>>,
    ) -> Result<Fit, ProblemError> {
        self.check_built()?;
        let from = problem.coordinates(start)?;
        if matches!(self, Self::Brent { .. }) && problem.free().len() > 1 {
            let free = problem.free().iter().map(|&i| problem.variables()[i].name.clone()).collect();
            return Err(ProblemError::OneVariable { optimiser: self.name(), free });
        }
        let ledger = Ledger::new(problem, from, budget, observer);
        self.begin(&ledger)?;
        ledger.report();
        let stop = self.run(&ledger);
        let end = judge(&ledger, &stop);
        let best = ledger.best();
        Ok(Fit {
            optimiser: self.name(),
            start: start.to_vec(),
            x: problem.point(&best.z),
            value: best.value,
            end,
            iterations: ledger.iterations(),
            evaluations: ledger.evaluations(),
        })
    }
}

/// How the fit ended at the best point, judged by the cost's own derivatives.
fn judge(ledger: &Ledger<'_, '_, '_>, stop: &Stop) -> End {
    let failure = match stop {
        Stop::Exhausted => return End::LimitReached,
        Stop::Failed(why) => Some(why.as_str()),
        Stop::BySolver => None,
    };
    let mut best = ledger.best();
    if best.derivatives.is_none() {
        match ledger.derivatives(&best.z) {
            Ok(d) => best.derivatives = Some(d),
            Err(Refusal::None(_)) => {}
            // The verdict needs an evaluation too, and the budget is kept.
            Err(Refusal::Exhausted(_)) => return End::LimitReached,
        }
    }
    ledger.problem().judge(&best.z, || best.value, best.derivatives.as_deref(), failure)
}

impl Minimiser for Optimiser {
    fn name(&self) -> String {
        match self {
            Self::LevenbergMarquardt { .. } => "levenberg-marquardt",
            Self::NelderMead { .. } => "nelder-mead",
            Self::LBfgs { .. } => "l-bfgs",
            Self::Bfgs { .. } => "bfgs",
            Self::NewtonTrustRegionSteihaug { .. } => "newton-trust-region-steihaug",
            Self::NewtonTrustRegionDogleg { .. } => "newton-trust-region-dogleg",
            Self::ParticleSwarm { .. } => "particle-swarm",
            Self::SimulatedAnnealing { .. } => "simulated-annealing",
            Self::Brent { .. } => "brent",
        }
        .into()
    }

    fn minimise(&self, problem: &Problem<'_>, start: &[f64], budget: &Budget) -> Result<Fit, ProblemError> {
        self.fit(problem, start, budget, None)
    }

    fn minimise_observed(
        &self,
        problem: &Problem<'_>,
        start: &[f64],
        budget: &Budget,
        observer: &mut dyn FnMut(&Progress),
    ) -> Result<Fit, ProblemError> {
        self.fit(problem, start, budget, Some(observer))
    }
}

#[cfg(all(test, not(any(feature = "local", feature = "global"))))]
mod tests {
    use super::*;

    struct Square;

    impl crate::Cost for Square {
        fn value(&self, x: &[f64]) -> f64 {
            x[0] * x[0]
        }
    }

    /// By its name as by its options, and the message says what to build with.
    #[test]
    fn a_solver_that_was_left_out_of_the_build_is_refused() {
        let problem = Problem::new(&Square, vec![crate::Variable::linear("x", 1.0, -1.0, 1.0)]).expect("valid bounds");
        let swarm = Optimiser::ParticleSwarm { particles: 3, generations: 3, seed: 0 };
        let by_options = swarm.minimise(&problem, &[0.5], &Budget::default()).expect_err("not built");
        let by_name = Optimiser::by_name("particle-swarm").expect_err("not built");
        assert_eq!(by_options, by_name);
        assert!(by_name.to_string().contains("feature `global`"), "{by_name}");
        let brent = Optimiser::by_name("brent").expect_err("not built");
        assert!(brent.to_string().contains("feature `local`"), "{brent}");
        let built = Optimiser::names().filter(|name| Optimiser::by_name(name).is_ok());
        assert_eq!(built.collect::<Vec<_>>(), ["levenberg-marquardt", "nelder-mead"]);
    }
}

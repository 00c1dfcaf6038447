//! One trial: a noisy record, answered by every method of the plan.

use std::fmt;

use twinlag::Estimator;
use twinlag::cross_relation::{CostError, Readings, Segment, Steps, Whitened};
use twinlag::estimate::{Estimate, EstimateError, Task};
use twinlag::optimise::{Budget, End, Fit, Minimiser, Optimiser, Problem, ProblemError};
use twinlag::signal::Clean;
use twinlag_study::{Failure, Outcome, Quantity, Study};

use crate::error::ExperimentError;
use crate::plan::{Bench, Cell, Method, OptimiserChoice, Plan, Start};

/// What each method yields, in the order of its quantities; those of both sensors stand side by
/// side.
const PER_METHOD: [&str; 9] = [
    "ln-error",
    "relative-error",
    "covered",
    "ln-width",
    "level-error",
    "usable",
    "on-bound",
    "reached",
    "evaluations",
];
/// Quantities of one method.
const QUANTITIES_PER_METHOD: usize = 14;

/// Both time constants this close to the truth, as a share of it, count as reached.
const REACHED_RELATIVE: f64 = 0.2;

/// A plan as a study.
pub struct Experiment<'a> {
    plan: &'a Plan,
    cells: Vec<Cell>,
    /// For each method.
    estimators: Vec<Box<dyn Estimate + 'a>>,
    optimisers: Vec<Box<dyn Minimiser + Sync + 'a>>,
}

/// An estimator and an optimiser of the caller's own, by the names that their plan has for them.
#[derive(Default)]
pub struct Own<'a> {
    /// Estimators.
    pub estimators: Vec<(&'a str, &'a dyn Estimate)>,
    /// Optimisers.
    pub optimisers: Vec<(&'a str, &'a (dyn Minimiser + Sync))>,
}

/// Estimators and optimisers by their names.
impl fmt::Debug for Experiment<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let estimators: Vec<String> = self.estimators.iter().map(|e| e.name()).collect();
        let optimisers: Vec<String> = self.optimisers.iter().map(|o| o.name()).collect();
        let mut out = f.debug_struct("Experiment");
        out.field("plan", self.plan).field("estimators", &estimators).field("optimisers", &optimisers).finish()
    }
}

/// Estimators and optimisers by their names in the plan.
impl fmt::Debug for Own<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let estimators: Vec<&str> = self.estimators.iter().map(|(name, _)| *name).collect();
        let optimisers: Vec<&str> = self.optimisers.iter().map(|(name, _)| *name).collect();
        f.debug_struct("Own").field("estimators", &estimators).field("optimisers", &optimisers).finish()
    }
}

/// A borrowed estimator is one.
struct Borrowed<'a>(&'a dyn Estimate);

impl Estimate for Borrowed<'_> {
    fn name(&self) -> String {
        self.0.name()
    }

    fn source(&self) -> &'static str {
        self.0.source()
    }

    fn assumes(&self) -> &'static str {
        self.0.assumes()
    }

    fn estimate(&self, task: &Task<'_>) -> Result<twinlag::estimate::Outcome, EstimateError> {
        self.0.estimate(task)
    }
}

/// A borrowed optimiser is one.
struct BorrowedMinimiser<'a>(&'a (dyn Minimiser + Sync));

impl Minimiser for BorrowedMinimiser<'_> {
    fn name(&self) -> String {
        self.0.name()
    }

    fn minimise(&self, problem: &Problem<'_>, start: &[f64], budget: &Budget) -> Result<Fit, ProblemError> {
        self.0.minimise(problem, start, budget)
    }
}

/// What a thread keeps of a cell.
#[derive(Debug)]
pub struct Scratch {
    bench: Bench,
    clean: Clean,
}

impl<'a> Experiment<'a> {
    /// The study of `plan`.
    ///
    /// # Errors
    /// For an estimator or an optimiser that there is not.
    pub fn new(plan: &'a Plan) -> Result<Self, ExperimentError> {
        Self::with(plan, &Own::default())
    }

    /// The study of `plan`, some of whose methods name estimators or optimisers that are the
    /// caller's `own`; these go first.
    ///
    /// # Errors
    /// For an estimator or an optimiser that there is not.
    pub fn with(plan: &'a Plan, own: &Own<'a>) -> Result<Self, ExperimentError> {
        let estimator = |m: &Method| -> Result<Box<dyn Estimate + 'a>, ExperimentError> {
            match own.estimators.iter().find(|(name, _)| *name == m.estimator) {
                Some((_, estimator)) => Ok(Box::new(Borrowed(*estimator))),
                None => match m.estimator.parse::<Estimator>() {
                    Ok(estimator) => Ok(Box::new(estimator)),
                    Err(_) => Err(ExperimentError::Plan(format!(
                        "method \"{}\": there is no estimator called \"{}\"; there are {}",
                        m.name,
                        m.estimator,
                        Estimator::ALL.map(Estimator::name).join(", ")
                    ))),
                },
            }
        };
        let optimiser = |m: &Method| -> Result<Box<dyn Minimiser + Sync + 'a>, ExperimentError> {
            match &m.optimiser {
                OptimiserChoice::WithOptions(optimiser) => Ok(Box::new(*optimiser)),
                OptimiserChoice::Named(name) => match own.optimisers.iter().find(|(n, _)| n == name) {
                    Some((_, optimiser)) => Ok(Box::new(BorrowedMinimiser(*optimiser))),
                    None => Ok(Box::new(Optimiser::by_name(name)?)),
                },
            }
        };
        Ok(Self {
            plan,
            cells: plan.cells(),
            estimators: plan.methods.iter().map(estimator).collect::<Result<_, _>>()?,
            optimisers: plan.methods.iter().map(optimiser).collect::<Result<_, _>>()?,
        })
    }

    /// Cramér-Rao bound of a cell: standard deviations of `ln τ` of both sensors, for known noise
    /// and an unknown gas, on trial 0's gas. `None` without noise.
    ///
    /// ```
    /// # use twinlag_experiment::{Experiment, Plan};
    /// # let plan = Plan::from_toml(r#"
    /// #     name = "bound"
    /// #     title = "How well anything can do"
    /// #     seed = 3
    /// #     trials = 1
    /// #     samples = [600]
    /// #     noise_percent = [0, 4, 8]
    /// #     [[gases]]
    /// #     name = "turbulence"
    /// #     gas = { kind = "turbulence", std_k = 9.0, corner_hz = 3.0, cutoff_hz = 200.0 }
    /// #     [[methods]]
    /// #     name = "whitened"
    /// #     estimator = "whitened"
    /// # "#)?;
    /// // A plan with `noise_percent = [0, 4, 8]`.
    /// let experiment = Experiment::new(&plan)?;
    /// assert_eq!(experiment.bound(0)?, None); // without noise nothing is uncertain
    /// let [quiet, loud] = [experiment.bound(1)?, experiment.bound(2)?].map(|bound| bound.expect("there is noise"));
    /// // Each cell has a gas of its own: twice the noise is about twice the bound, not exactly.
    /// assert!(quiet.iter().zip(loud).all(|(quiet, loud)| *quiet < loud));
    /// # Ok::<(), twinlag_experiment::ExperimentError>(())
    /// ```
    ///
    /// # Errors
    /// For an impossible rig.
    pub fn bound(&self, cell: usize) -> Result<Option<[f64; 2]>, ExperimentError> {
        let (cell, bench) = (&self.cells[cell], self.plan.bench(&self.cells[cell], cell)?);
        if bench.noise_std_k.contains(&0.0) {
            return Ok(None);
        }
        let clean = bench.rig.clean(0)?;
        let readings = readings(&clean.readings_c[0], &clean.readings_c[1], cell).map_err(EstimateError::from)?;
        let hold = self.plan.methods[0].hold;
        let mut cost = Whitened::new(&readings, hold, bench.noise_std_k).map_err(EstimateError::from)?;
        if cell.noise_ar1 != 0.0 {
            cost =
                cost.with_autoregression([vec![cell.noise_ar1], vec![cell.noise_ar1]]).map_err(EstimateError::from)?;
        }
        let covariance = cost.cramer_rao(&cell.tau_s, &[0, 1]);
        Ok(covariance.map(|c| [0, 1].map(|i| c[i][i].sqrt() / cell.tau_s[i])))
    }

    /// The plan.
    pub fn source(&self) -> &Plan {
        self.plan
    }

    fn start(&self, method: &Method, trial: u64) -> Vec<[f64; 2]> {
        match method.start {
            Start::Own => Vec::new(),
            Start::At(tau_s) => vec![tau_s],
            Start::Grid => {
                let (axis, n) = (&self.plan.grid_s, self.plan.grid_s.len());
                let point = trial as usize % (n * n);
                vec![[axis[point / n], axis[point % n]]]
            }
        }
    }
}

fn readings(y1: &[f64], y2: &[f64], cell: &Cell) -> Result<Readings, CostError> {
    Readings::new(vec![Segment::new(y1.to_vec(), y2.to_vec(), Steps::Even(cell.sample_period_s))?])
}

/// Names of a method's quantities, position by position.
pub(crate) fn quantities(method: &str) -> Vec<Quantity> {
    let of = |what: &str, sensor: usize| format!("{method}/{what}-{}", sensor + 1);
    let mut out = Vec::with_capacity(QUANTITIES_PER_METHOD);
    for what in &PER_METHOD[..5] {
        for sensor in 0..2 {
            let name = of(what, sensor);
            out.push(if *what == "covered" { Quantity::event(name) } else { Quantity::value(name) });
        }
    }
    for what in &PER_METHOD[5..8] {
        out.push(Quantity::event(format!("{method}/{what}")));
    }
    out.push(Quantity::value(format!("{method}/evaluations")));
    out
}

impl Study for Experiment<'_> {
    type Scratch = Scratch;

    fn plan(&self) -> String {
        let plan = serde_json::to_string(&self.plan.decisive()).expect("a plan is plain data");
        format!("twinlag {}: {plan}", env!("CARGO_PKG_VERSION"))
    }

    fn cells(&self) -> usize {
        self.cells.len()
    }

    fn trials(&self) -> u64 {
        self.plan.trials
    }

    fn block(&self) -> u64 {
        self.plan.block
    }

    fn quantities(&self, _cell: usize) -> Vec<Quantity> {
        self.plan.methods.iter().flat_map(|m| quantities(&m.name)).collect()
    }

    fn scratch(&self, cell: usize) -> Result<Scratch, Failure> {
        let bench = self.plan.bench(&self.cells[cell], cell)?;
        let clean = bench.rig.clean(0)?;
        Ok(Scratch { bench, clean })
    }

    fn trial(&self, index: usize, trial: u64, scratch: &mut Scratch, out: &mut Outcome) -> Result<(), Failure> {
        let cell = &self.cells[index];
        let rig = &scratch.bench.rig;
        if rig.gas().per_trial {
            scratch.clean = rig.clean(trial)?;
        }
        let simulated = scratch.clean.with_noise(&mut rig.noise_streams(trial));
        let readings = readings(&simulated.t1_c, &simulated.t2_c, cell)?;
        for (m, method) in self.plan.methods.iter().enumerate() {
            let mut task = Task::new(&readings);
            task.hold = method.hold;
            task.noise = method.told(scratch.bench.noise_std_k, cell.noise_ar1);
            task.minimiser = &*self.optimisers[m];
            task.starts_s = self.start(method, trial);
            task.discard = method.discard;
            task.intervals = method.intervals;
            let at = m * QUANTITIES_PER_METHOD;
            let found = match self.estimators[m].estimate(&task) {
                Err(EstimateError::Cost(CostError::Singular)) => {
                    (10..13).for_each(|event| out.event(at + event, false));
                    continue;
                }
                found => found?,
            };
            if found.end.is_usable() {
                for i in 0..2 {
                    let ratio = found.tau_s[i] / cell.tau_s[i];
                    out.value(at + i, ratio.ln());
                    out.value(at + 2 + i, ratio - 1.0);
                    if let Some(interval) = found.interval_95_s {
                        let [low, high] = interval[i];
                        out.event(at + 4 + i, low <= cell.tau_s[i] && cell.tau_s[i] <= high);
                        out.value(at + 6 + i, (high / low).ln());
                    }
                    let level = found.noise_std_k.map(|found| found[i] / scratch.bench.noise_std_k[i]);
                    if let Some(level) = level.filter(|l| l.is_finite() && *l > 0.0) {
                        out.value(at + 8 + i, level.ln());
                    }
                }
            }
            out.event(at + 10, found.end.is_usable());
            out.event(at + 11, matches!(found.end, End::OnBound(_)));
            let is_near = |i: usize| (found.tau_s[i] / cell.tau_s[i] - 1.0).abs() < REACHED_RELATIVE;
            out.event(at + 12, found.end.is_usable() && is_near(0) && is_near(1));
            out.value(at + 13, (found.evaluations.values + found.evaluations.derivatives) as f64);
        }
        Ok(())
    }
}

//! How a fit ended. A fit that ran always returns a report, however badly it ended.

use serde::{Deserialize, Serialize};

/// How a fit ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum End {
    /// A minimum inside all bounds: the solver stopped there, and gradient and curvature agree that
    /// it is one.
    Converged,
    /// The solver stopped by its own rule; the cost has no derivatives to check it with.
    Unchecked,
    /// The lowest point lies on a bound of these variables (by index): it is no estimate of them.
    OnBound(Vec<usize>),
    /// The solver claimed to be done, or could not go on, where the cost still falls or is flat.
    Stalled(String),
    /// Iterations or evaluations ran out.
    LimitReached,
}

impl End {
    /// Whether the point may be reported as an estimate.
    ///
    /// ```
    /// use twinlag_optimise::{Budget, Cost, End, Minimiser, Optimiser, Problem, Variable};
    ///
    /// /// Falls to the left without end.
    /// struct Slope;
    ///
    /// impl Cost for Slope {
    ///     fn value(&self, x: &[f64]) -> f64 {
    ///         x[0]
    ///     }
    /// }
    ///
    /// let problem = Problem::new(&Slope, vec![Variable::linear("x", 1.0, 2.0, 5.0)])?;
    /// let fit = Optimiser::by_name("brent")?.minimise(&problem, &[3.0], &Budget::default())?;
    /// assert_eq!(fit.end, End::OnBound(vec![0]));
    /// assert!(!fit.end.is_usable()); // 2 is where the search had to end, not an estimate
    /// # Ok::<(), twinlag_optimise::ProblemError>(())
    /// ```
    pub fn is_usable(&self) -> bool {
        matches!(self, Self::Converged | Self::Unchecked)
    }
}

/// Work done by a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Evaluations {
    /// Calls for the value alone.
    pub values: u64,
    /// Calls for value, gradient and curvature.
    pub derivatives: u64,
}

/// How much work a fit may do.
///
/// ```
/// use twinlag_optimise::{Budget, Cost, End, Minimiser, Optimiser, Problem, Variable};
///
/// /// Rosenbrock's valley, which takes a simplex hundreds of evaluations.
/// struct Valley;
///
/// impl Cost for Valley {
///     fn value(&self, x: &[f64]) -> f64 {
///         (1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2)
///     }
/// }
///
/// let variables = ["x", "y"].map(|name| Variable::linear(name, 1.0, -5.0, 5.0)).to_vec();
/// let small = Budget { evaluations: 40, ..Budget::default() };
/// let fit = Optimiser::by_name("nelder-mead")?.minimise(&Problem::new(&Valley, variables)?, &[-1.2, 1.0], &small)?;
/// assert_eq!(fit.end, End::LimitReached);
/// assert!(fit.evaluations.values <= 40 && fit.value < 24.2); // the best point so far; the start has 24.2
/// # Ok::<(), twinlag_optimise::ProblemError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Budget {
    /// Solver iterations.
    pub iterations: u64,
    /// Evaluations of the cost, of either kind; at least the one at the start is made.
    pub evaluations: u64,
}

impl Default for Budget {
    fn default() -> Self {
        Self { iterations: 500, evaluations: 5_000 }
    }
}

/// How far a fit has come, as reported to an observer after every iteration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// Iterations of the solver so far, 0 for the start.
    pub iteration: u64,
    /// Evaluations of the cost so far.
    pub evaluations: Evaluations,
    /// The best point seen so far, all variables, in their own units.
    pub x: Vec<f64>,
    /// The cost there.
    pub value: f64,
}

/// One fit from one start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Fit {
    /// Name of the solver.
    pub optimiser: String,
    /// Where it started.
    pub start: Vec<f64>,
    /// The best point seen, all variables, in their own units.
    pub x: Vec<f64>,
    /// The cost there.
    pub value: f64,
    /// How it ended.
    pub end: End,
    /// Iterations of the solver.
    pub iterations: u64,
    /// Evaluations of the cost.
    pub evaluations: Evaluations,
}

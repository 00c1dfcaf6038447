//! The trait that every minimiser implements.

use crate::problem::{Problem, ProblemError};
use crate::report::{Budget, Fit, Progress};

/// A local minimiser: from one start to one report. Implement it to bring a solver of your own. Several threads may ask
/// it at once.
///
/// A solver sees the problem in free coordinates of size one: [`Problem::coordinates`] of the
/// start, [`Problem::bounds`], [`Problem::value_at`] and [`Problem::derivatives_at`];
/// [`Problem::point`] takes its answer back to the variables' own units, and [`Problem::assess`]
/// says what kind of point it is.
///
/// ```
/// use twinlag_optimise::{Budget, Cost, End, Evaluations, Fit, Minimiser, Problem, ProblemError, Variable};
///
/// /// Looks at 101 points between the bounds of one variable.
/// struct Grid;
///
/// impl Minimiser for Grid {
///     fn name(&self) -> String {
///         "grid".into()
///     }
///
///     fn minimise(&self, problem: &Problem<'_>, start: &[f64], _: &Budget) -> Result<Fit, ProblemError> {
///         let (low, high) = problem.bounds()[0];
///         let points = (0..=100).map(|i| [low + (high - low) * f64::from(i) / 100.0]);
///         let values = points.map(|z| (problem.value_at(&z), z));
///         let (value, z) = values.min_by(|a, b| a.0.total_cmp(&b.0)).expect("there are 101");
///         let evaluations = Evaluations { values: 101, derivatives: 0 };
///         let (x, end, start) = (problem.point(&z), problem.assess(&z, None), start.to_vec());
///         Ok(Fit { optimiser: self.name(), start, x, value, end, iterations: 1, evaluations })
///     }
/// }
/// # struct Parabola;
/// # impl Cost for Parabola {
/// #     fn value(&self, x: &[f64]) -> f64 { (x[0] - 2.0).powi(2) }
/// # }
///
/// // The cost is `(x − 2)²`, without derivatives.
/// let problem = Problem::new(&Parabola, vec![Variable::linear("x", 1.0, 0.0, 5.0)])?;
/// let fit = Grid.minimise(&problem, &[1.0], &Budget::default())?;
/// assert_eq!((fit.x[0], fit.end), (2.0, End::Unchecked)); // point 40 of the grid is exact
/// # Ok::<(), ProblemError>(())
/// ```
pub trait Minimiser: Sync {
    /// Name of the solver, as it appears in reports.
    fn name(&self) -> String;

    /// Minimises `problem` from `start` (all variables, their own units; moved inside the bounds
    /// first).
    ///
    /// # Errors
    /// [`ProblemError::Start`] for a start of the wrong length or not finite,
    /// [`ProblemError::NeedsDerivatives`] where a solver that follows gradients gets a cost without
    /// any, [`ProblemError::OneVariable`] where one for a single variable gets several. A fit that
    /// ran is never an error.
    fn minimise(&self, problem: &Problem<'_>, start: &[f64], budget: &Budget) -> Result<Fit, ProblemError>;

    /// Minimises as [`Minimiser::minimise`] does, and reports its progress to `observer`: for a
    /// progress bar, a picture of the path, or a log.
    ///
    /// The solvers of this crate report at the start and after every iteration. The default
    /// implementation, for a solver that cannot be observed, reports only the end.
    ///
    /// ```
    /// # use twinlag_optimise::{Budget, Cost, Minimiser, Optimiser, Problem, Variable};
    /// # struct Bowl;
    /// # impl Cost for Bowl {
    /// #     fn value(&self, x: &[f64]) -> f64 { (x[0] / 3.0).ln().powi(2) }
    /// # }
    /// let problem = Problem::new(&Bowl, vec![Variable::logarithmic("x", 1e-3, 1e3)])?;
    /// let mut way = Vec::new();
    /// let nelder_mead = Optimiser::by_name("nelder-mead")?;
    /// let fit = nelder_mead.minimise_observed(&problem, &[100.0], &Budget::default(), &mut |p| way.push(p.x[0]))?;
    /// assert!((way[0] - 100.0).abs() < 1e-9);
    /// assert_eq!(way.last(), Some(&fit.x[0]));
    /// # Ok::<(), twinlag_optimise::ProblemError>(())
    /// ```
    ///
    /// # Errors
    /// As for [`Minimiser::minimise`].
    fn minimise_observed(
        &self,
        problem: &Problem<'_>,
        start: &[f64],
        budget: &Budget,
        observer: &mut dyn FnMut(&Progress),
    ) -> Result<Fit, ProblemError> {
        let fit = self.minimise(problem, start, budget)?;
        observer(&Progress {
            iteration: fit.iterations,
            evaluations: fit.evaluations,
            x: fit.x.clone(),
            value: fit.value,
        });
        Ok(fit)
    }
}

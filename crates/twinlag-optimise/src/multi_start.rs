//! Several starts, of which the lowest end is the answer.

use serde::{Deserialize, Serialize};

use crate::minimiser::Minimiser;
use crate::problem::{Problem, ProblemError};
use crate::report::{Budget, Fit};

/// The result of every start, the lowest end first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MultiStart {
    fits: Vec<Fit>,
}

impl MultiStart {
    /// Minimises `problem` from each of `starts`.
    ///
    /// ```
    /// use twinlag_optimise::{Budget, Cost, MultiStart, Optimiser, Problem, Variable};
    ///
    /// /// Minima near −1 and 1, of which the left one is lower.
    /// struct TwoWells;
    ///
    /// impl Cost for TwoWells {
    ///     fn value(&self, x: &[f64]) -> f64 {
    ///         (x[0] * x[0] - 1.0).powi(2) + 0.2 * x[0]
    ///     }
    /// }
    ///
    /// let problem = Problem::new(&TwoWells, vec![Variable::linear("x", 1.0, -3.0, 3.0)])?;
    /// let solver = Optimiser::by_name("nelder-mead")?;
    /// let ends = MultiStart::run(&problem, &solver, &[vec![2.0], vec![-2.0]], &Budget::default())?;
    /// assert_eq!(ends.best().start, [-2.0]);
    /// assert!(ends.fits()[0].x[0] < 0.0 && ends.fits()[1].x[0] > 0.0); // each start found the well on its side
    /// # Ok::<(), twinlag_optimise::ProblemError>(())
    /// ```
    ///
    /// # Errors
    /// [`ProblemError::NoStart`], or [`ProblemError::Start`] for a start that fits no variable.
    pub fn run(
        problem: &Problem<'_>,
        minimiser: &dyn Minimiser,
        starts: &[Vec<f64>],
        budget: &Budget,
    ) -> Result<Self, ProblemError> {
        let mut fits = starts.iter().map(|s| minimiser.minimise(problem, s, budget)).collect::<Result<Vec<_>, _>>()?;
        if fits.is_empty() {
            return Err(ProblemError::NoStart);
        }
        // The sort is stable: of equal ends the earlier start is kept, so the answer does not
        // depend on anything else.
        fits.sort_by(|a, b| a.value.total_cmp(&b.value));
        Ok(Self { fits })
    }

    /// The lowest end, usable or not: a lower point on a bound is not passed over for a higher one
    /// inside.
    pub fn best(&self) -> &Fit {
        &self.fits[0]
    }

    /// All ends, lowest first.
    pub fn fits(&self) -> &[Fit] {
        &self.fits
    }
}

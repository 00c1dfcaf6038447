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

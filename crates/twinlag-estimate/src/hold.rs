//! What the gas does between samples, which no sample shows: the fit with the other hold beside the
//! one that was made.

use twinlag_sensor::Discretisation;

use crate::error::EstimateError;
use crate::fitting::polish;
use crate::task::Task;
use crate::whitened::WhitenedFit;

/// The other hold is clearly better where it lowers the sum of squares by this many times the
/// residual's energy per degree of freedom: a likelihood ratio of `exp(5)`, 150.
const CLEARLY_BETTER_CHI2: f64 = 10.0;

/// The hold to compare with: a straight line between samples, or none where that is the one there
/// is.
pub fn other_hold(hold: Discretisation) -> Discretisation {
    match hold {
        Discretisation::FirstOrderHold => Discretisation::ZeroOrderHold,
        _ => Discretisation::FirstOrderHold,
    }
}

impl<const P: usize> WhitenedFit<'_, P> {
    /// This fit with `hold`, at noise of one size, from where it ended: close to where it will end.
    ///
    /// # Errors
    /// [`EstimateError::Cost`] for a hold that the record's sampling does not take.
    /// ```
    #[doc = include_str!("../doc/readings.txt")]
    /// use twinlag_estimate::{Task, WhitenedFit, other_hold};
    ///
    /// let task = Task::new(&readings);
    /// let fit = WhitenedFit::<2>::find(&task)?;
    /// let other = fit.with_hold(other_hold(task.hold))?;
    /// // The gas of this record is held between samples, and straight lines explain it worse.
    /// assert!(!other.is_clearly_better_than(&fit) && fit.energy() < other.energy());
    /// # Ok::<(), twinlag_estimate::EstimateError>(())
    /// ```
    pub fn with_hold(&self, hold: Discretisation) -> Result<Self, EstimateError> {
        let mut ended = self.minimise_again(hold, self.whitened.noise_std(), Some(&self.fit.x))?;
        polish::<P>(&ended.whitened, &self.priors, &self.variables, &mut ended.fit);
        Ok(Self {
            task: Task { hold, ..self.task.clone() },
            whitened: ended.whitened,
            levels: self.levels,
            variables: self.variables.clone(),
            priors: self.priors.clone(),
            fit: ended.fit,
            starts: self.starts,
            evaluations: ended.evaluations,
            unseen: self.unseen,
        })
    }

    /// Whether this fit explains the record clearly better than `other` does, one with another hold
    /// at the same noise.
    pub fn is_clearly_better_than(&self, other: &Self) -> bool {
        self.value() + CLEARLY_BETTER_CHI2 * other.energy_of_assumed_noise().max(1.0) < other.value()
    }
}

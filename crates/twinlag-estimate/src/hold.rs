//! What the gas does between samples, which no sample shows: the fit with the other hold beside the
//! one that was made.

use twinlag_sensor::Discretisation;

use crate::error::EstimateError;
use crate::fitting::polish;
use crate::task::Task;
use crate::whitened::WhitenedFit;

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
    /// // The gas of this record moves little between samples, which do not show what it does there.
    /// assert!((0.1..0.9).contains(&other.probability_beside(&fit)));
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

    /// Probability that the hold of this fit is the right one and not that of `other`, a fit at the same noise:
    /// `1/(1 + exp(½ (χ² − χ²_other)/e))`, with `e` the energy per degree of freedom that the fit of `other` leaves, at
    /// least one. Both are equally probable before the readings.
    pub fn probability_beside(&self, other: &Self) -> f64 {
        let energy = other.energy_of_assumed_noise().max(1.0);
        (1.0 + (0.5 * (self.value() - other.value()) / energy).exp()).recip()
    }
}

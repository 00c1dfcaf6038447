//! Whether the record contradicts what was given of the time constants.

use twinlag_cross_relation::ScoreVariance;
use twinlag_diagnose::{Grade, Reason};
use twinlag_estimate::{Known, Task, WhitenedFit};

use super::conclude::Conclusion;
use super::fill::CONTRADICTING_STANDARD_DEVIATIONS;
use crate::error::Error;
use crate::verbs::given::{Contradiction, given, sensor_of};

impl<const P: usize> Conclusion<'_, '_, P> {
    /// Puts down what speaks against each time constant that was given. The record is fitted without them: where two lags then leave
    /// only noise, a value that differs from what was given by far more than both may be off is a contradiction. Where they leave
    /// more, what is missing may account for it.
    pub(super) fn contradict(&mut self) -> Result<(), Error> {
        let (of_time_constants, others): (Vec<Known>, Vec<Known>) =
            self.asked.options.known.iter().copied().partition(|known| sensor_of(known).is_some());
        if of_time_constants.is_empty() {
            return Ok(());
        }
        let task = Task { known: &others, ..self.fit.task().clone() };
        let mut alone = WhitenedFit::<P>::find(&task)?;
        alone.lower_levels_to_residual();
        let theta = alone.theta();
        let is_noise = alone.fit().end.is_usable() && !alone.is_rejected_by(&self.asked.tests(&alone, &theta)?);
        let Some(covariance) = alone.covariance(ScoreVariance::WhiteNoise).filter(|_| is_noise) else {
            self.leave_behind(&of_time_constants);
            return Ok(());
        };
        for known in &of_time_constants {
            let Some(index) = sensor_of(known) else { continue };
            let error_s = covariance[index][index].max(0.0).sqrt();
            if let Some(contradiction) = Contradiction::of(known, theta[index], error_s, Grade::NoGo) {
                self.contradictions.push(contradiction.reason);
                self.warnings
                    .push(format!("{}. Or an effect is missing: a diagnosis looks for one", contradiction.remark));
            }
        }
        Ok(())
    }

    /// What speaks against the numbers where what is missing drags a time constant away from what was given of it.
    fn leave_behind(&mut self, given_of_time_constants: &[Known]) {
        for known in given_of_time_constants {
            let (Some(std), Some(index)) = (known.std, sensor_of(known)) else { continue };
            let deviations = (self.solved.theta[index] - known.value).abs() / std;
            if deviations > CONTRADICTING_STANDARD_DEVIATIONS {
                self.contradictions.push(Reason::LeftBehind { what: given(known), deviations });
            }
        }
    }
}

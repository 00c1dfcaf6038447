//! Whether the record contradicts what was given of the time constants.

use twinlag_cross_relation::{Parameter, ScoreVariance};
use twinlag_diagnose::{Grade, Reason, Remark};
use twinlag_estimate::{Known, Task, WhitenedFit};

use super::conclude::Conclusion;
use super::fill::CONTRADICTING_STANDARD_DEVIATIONS;
use super::judge::given;
use crate::error::Error;

/// Standard deviations between what was given and what the record determines that chance exceeds once in 10⁴, as a test of the
/// residual does.
const CONTRADICTING_DEVIATIONS: f64 = 3.89;

impl<const P: usize> Conclusion<'_, '_, P> {
    /// Puts down what speaks against each time constant that was given. The record is fitted without them: where two lags then leave
    /// only noise, a value that differs from what was given by far more than both may be off is a contradiction. Where they leave
    /// more, what is missing may account for it.
    pub(super) fn contradict(&mut self) -> Result<(), Error> {
        let is_time_constant = |k: &Known| matches!(k.parameter, Parameter::Tau1 | Parameter::Tau2);
        let (of_time_constants, others): (Vec<Known>, Vec<Known>) =
            self.asked.options.known.iter().copied().partition(is_time_constant);
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
            let index = usize::from(known.parameter == Parameter::Tau2);
            let (own_s, error_s) = (theta[index], covariance[index][index].max(0.0).sqrt());
            let deviations = (own_s - known.value).abs() / error_s.hypot(known.std.unwrap_or(0.0));
            if deviations > CONTRADICTING_DEVIATIONS {
                let what = given(known);
                let instead = Remark::time_constant(["T1", "T2"][index], own_s, Some(error_s));
                self.contradictions.push(Reason::Contradicted { what: what.clone(), deviations, grade: Grade::NoGo });
                let remark = Remark::Contradicted { what, instead, deviations };
                self.warnings.push(format!("{remark}. Or an effect is missing: a diagnosis looks for one"));
            }
        }
        Ok(())
    }

    /// What speaks against the numbers where what is missing drags a time constant away from what was given of it.
    fn leave_behind(&mut self, given_of_time_constants: &[Known]) {
        for known in given_of_time_constants {
            let Some(std) = known.std else { continue };
            let index = usize::from(known.parameter == Parameter::Tau2);
            let deviations = (self.solved.theta[index] - known.value).abs() / std;
            if deviations > CONTRADICTING_STANDARD_DEVIATIONS {
                self.contradictions.push(Reason::LeftBehind { what: given(known), deviations });
            }
        }
    }
}

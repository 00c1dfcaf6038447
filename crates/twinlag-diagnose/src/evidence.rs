//! Why an effect was added, in numbers.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::candidates::Candidate;

/// Why an effect was added.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Evidence {
    /// Likelihood-ratio statistic, with the noise level free.
    pub statistic: f64,
    /// Number of parameters of the effect.
    pub dof: usize,
    /// Probability of such a statistic if the effect is absent.
    pub p_value: f64,
    /// Nats of likelihood gained on blocks that were left out of the fit.
    pub held_out_gain_nats: f64,
    /// The statistic with a free noise level in every frequency band; `None` for effects of the
    /// noise.
    pub robust_statistic: Option<f64>,
}

impl Evidence {
    pub(crate) fn of(candidate: &Candidate) -> Self {
        let (statistic, dof) = (candidate.white_gain, candidate.added);
        let chi2 = ChiSquared::new(dof.max(1) as f64).expect("a positive number");
        Self {
            statistic,
            dof,
            p_value: chi2.sf(statistic.max(0.0)),
            held_out_gain_nats: candidate.held_out_nats,
            robust_statistic: (!candidate.effect.is_noise()).then_some(candidate.robust_gain),
        }
    }
}

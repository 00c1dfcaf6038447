//! Noise with a memory: a stationary AR(1) process beside the channel's other noise, given by its
//! correlation time, `e[k] = ρ e[k−1] + √(1 − ρ²) s ξ[k]`, `ρ = exp(−Ts/θ)`, autocorrelation
//! `s² exp(−|t|/θ)`.

use rand::Rng;
use serde::{Deserialize, Serialize};

use crate::check::{not_negative, positive};
use crate::{Noise, SignalError};

/// Gaussian noise with an exponential autocorrelation, added to the channel's [`Noise`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct ColouredNoise {
    /// Standard deviation `s` at every sample, K; 0 is allowed.
    pub std_k: f64,
    /// Correlation time `θ`, s.
    pub correlation_time_s: f64,
}

impl ColouredNoise {
    /// Noise of standard deviation `std_k` with autocorrelation
    /// `std_k² exp(−|t|/correlation_time_s)`.
    pub fn new(std_k: f64, correlation_time_s: f64) -> Self {
        Self { std_k, correlation_time_s }
    }

    /// Adds the noise to readings `sample_period_s` apart; draws one number per reading.
    pub(crate) fn add_to(&self, readings_c: &mut [f64], sample_period_s: f64, rng: &mut impl Rng) {
        Noise { std_k: self.std_k, ar1: (-sample_period_s / self.correlation_time_s).exp() }.add_to(readings_c, rng);
    }

    pub(crate) fn check(&self, within: &str) -> Result<(), SignalError> {
        not_negative(within, "std_k", self.std_k)?;
        positive(within, "correlation_time_s", self.correlation_time_s)
    }
}

//! Isolated outliers: each sample, independently, is a spike with a given probability and then
//! reads off by `± size · u`, the sign a fair coin's, `u` uniform from 0.5 to 1.5. They are added
//! after the noise.

use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

use crate::SignalError;
use crate::check::{between, not_negative};

/// Isolated outliers of either sign.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Spikes {
    /// Probability that a sample is one, 0 to 1.
    pub rate_per_sample: f64,
    /// Mean height, K: heights are uniform between half of it and one and a half; 0 is allowed.
    pub size_k: f64,
}

impl Spikes {
    /// Outliers of `size_k` on average, in `rate_per_sample` of the samples.
    pub fn new(rate_per_sample: f64, size_k: f64) -> Self {
        Self { rate_per_sample, size_k }
    }

    /// Adds the spikes; draws one number per reading, and one more for each spike.
    pub(crate) fn add_to(&self, readings_c: &mut [f64], rng: &mut impl Rng) {
        for reading_c in readings_c {
            if rng.random::<f64>() < self.rate_per_sample {
                // One number for sign and height.
                let draw: f64 = rng.random_range(-1.0..1.0);
                *reading_c += self.size_k * (draw + 0.5 * draw.signum());
            }
        }
    }

    pub(crate) fn check(&self, within: &str) -> Result<(), SignalError> {
        between(within, "rate_per_sample", self.rate_per_sample, 0.0, 1.0)?;
        not_negative(within, "size_k", self.size_k)
    }
}

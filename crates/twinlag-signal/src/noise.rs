//! Channel noise, which is Gaussian and either white or AR(1):
//! `e[k] = ρ e[k−1] + √(1 − ρ²) s ξ[k]`, started in its stationary state, so that its standard
//! deviation is `s` at every sample.

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use crate::SignalError;
use crate::check::{not_negative, path};

/// Gaussian noise of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Marginal standard deviation `s`, K; 0 is allowed.
    pub std_k: f64,
    /// Correlation ρ of one sample with the next, between −1 and 1 (both excluded); 0 if left out:
    /// white noise.
    #[serde(default)]
    pub ar1: f64,
}

impl Noise {
    /// White noise of standard deviation `std_k`.
    ///
    /// ```
    /// use twinlag_signal::Noise;
    ///
    /// let white = Noise::white(0.3);
    /// // As in a rig file, where the correlation may be left out.
    /// assert_eq!(toml::from_str::<Noise>("std_k = 0.3"), Ok(white));
    /// assert_eq!(Noise { ar1: 0.5, ..white }, toml::from_str("std_k = 0.3\nar1 = 0.5")?);
    /// # Ok::<(), toml::de::Error>(())
    /// ```
    pub fn white(std_k: f64) -> Self {
        Self { std_k, ar1: 0.0 }
    }

    /// Adds noise to the readings, K; draws one number per reading.
    pub(crate) fn add_to(&self, readings_c: &mut [f64], rng: &mut impl Rng) {
        let fresh_k = self.std_k * (1.0 - self.ar1 * self.ar1).sqrt();
        let mut noise_k = None;
        for reading_c in readings_c {
            let draw: f64 = rng.sample(StandardNormal);
            let now_k = noise_k.map_or(self.std_k * draw, |last_k: f64| self.ar1 * last_k + fresh_k * draw);
            *reading_c += now_k;
            noise_k = Some(now_k);
        }
    }

    pub(crate) fn check(&self, within: &str) -> Result<(), SignalError> {
        not_negative(within, "std_k", self.std_k)?;
        if self.ar1.abs() < 1.0 {
            Ok(())
        } else {
            Err(SignalError::OutOfRange { field: path(within, "ar1"), value: self.ar1, low: -1.0, high: 1.0 })
        }
    }
}

//! What every form of the whitened cost takes for granted: what the gas does between samples, and
//! the noise.

use twinlag_sensor::Discretisation;

use crate::error::CostError;

/// What is taken for granted: hold and noise.
#[derive(Clone, Debug)]
pub(crate) struct HoldAndNoise {
    pub(crate) hold: Discretisation,
    /// Standard deviations of `n`, K.
    pub(crate) noise_std: [f64; 2],
    /// `n[k] = φ1 n[k−1] + φ2 n[k−2] + e[k]`, for each channel; empty for white noise.
    pub(crate) autoregression: [Vec<f64>; 2],
}

impl HoldAndNoise {
    pub(crate) fn white(hold: Discretisation, noise_std: [f64; 2]) -> Self {
        Self { hold, noise_std, autoregression: [Vec::new(), Vec::new()] }
    }

    pub(crate) fn is_white(&self) -> bool {
        self.autoregression.iter().all(Vec::is_empty)
    }

    /// Variance of `e`.
    pub(crate) fn white_variance(&self) -> [f64; 2] {
        [0, 1].map(|i| {
            let variance = self.noise_std[i] * self.noise_std[i];
            match self.autoregression[i][..] {
                [] => variance,
                [phi] => variance * (1.0 - phi * phi),
                [first, second, ..] => {
                    let rest = 1.0 - second;
                    variance * (1.0 + second) * (rest * rest - first * first) / rest
                }
            }
        })
    }

    /// Coefficients of `e = Φ n`: `1, −φ1, −φ2`.
    pub(crate) fn whitener(&self, channel: usize) -> impl Iterator<Item = f64> {
        std::iter::once(1.0).chain(self.autoregression[channel].iter().map(|phi| -phi))
    }
}

/// Refuses standard deviations that are not positive, and those whose fourth power, by which derivatives of costs divide, overflows or
/// underflows.
pub(crate) fn check_noise(noise_std: [f64; 2]) -> Result<(), CostError> {
    let name = "noise standard deviation";
    for value in noise_std {
        if !(value.is_finite() && value > 0.0) {
            return Err(CostError::NotPositive { name, value });
        }
        if !value.powi(4).is_normal() {
            return Err(CostError::OutOfRange { name, value });
        }
    }
    Ok(())
}

/// Refuses noise that is not stationary, or of an order above 2.
pub(crate) fn check_autoregression(autoregression: &[Vec<f64>; 2]) -> Result<(), CostError> {
    let is_stationary = |phi: &[f64]| match *phi {
        [] => true,
        [phi] => phi.abs() < 1.0,
        [first, second] => second.abs() < 1.0 && first.abs() < 1.0 - second,
        _ => false,
    };
    if let Some(bad) = autoregression.iter().find(|phi| !is_stationary(phi)) {
        return Err(CostError::Autoregression { coefficients: bad.clone() });
    }
    Ok(())
}

//! Radiation between the junction and a wall: the first body's heat balance becomes
//! `τ dT/dt = (x − T) − k (T_K⁴ − W_K⁴)`, `T_K` and `W_K` the temperatures of body and wall in
//! kelvin.
//!
//! `k` is `ε σ / h`: emissivity and the Stefan-Boltzmann constant over the coefficient of
//! convection, 1/K³. At rest in a gas hotter than the wall the sensor reads low by
//! `k (T_K⁴ − W_K⁴)`, and near there it responds like a sensor of gain `1/(1 + 4 k T_K³)` and time
//! constant `τ/(1 + 4 k T_K³)`.

use serde::{Deserialize, Serialize};

use super::ZERO_CELSIUS_K;
use crate::SignalError;
use crate::check::{above_absolute_zero, not_negative};

/// Exchange of radiation with a wall of constant temperature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Radiation {
    /// `k` in `τ dT/dt = (x − T) − k (T_K⁴ − W_K⁴)`, 1/K³; 0 is allowed.
    pub coefficient_per_k3: f64,
    /// Temperature of the wall, °C.
    pub wall_c: f64,
}

impl Radiation {
    /// Radiation to a wall of `wall_c`, °C, with the coefficient of the heat balance, 1/K³.
    pub fn new(coefficient_per_k3: f64, wall_c: f64) -> Self {
        Self { coefficient_per_k3, wall_c }
    }

    /// How much hotter the gas would have to be to replace the heat that a body of `body_c`
    /// radiates, K.
    pub(crate) fn loss_k(&self, body_c: f64) -> f64 {
        // The fourth powers' difference without its cancellation: (a² + b²)(a + b)(a − b).
        let (body_k, wall_k) = (body_c + ZERO_CELSIUS_K, self.wall_c + ZERO_CELSIUS_K);
        let squares = body_k * body_k + wall_k * wall_k;
        self.coefficient_per_k3 * squares * (body_k + wall_k) * (body_c - self.wall_c)
    }

    /// `4 k T_K³` at `body_c`: by how much faster the body is than its time constant says, less 1.
    pub(crate) fn slope(&self, body_c: f64) -> f64 {
        4.0 * self.coefficient_per_k3 * (body_c + ZERO_CELSIUS_K).powi(3)
    }

    pub(crate) fn check(&self, within: &str) -> Result<(), SignalError> {
        not_negative(within, "coefficient_per_k3", self.coefficient_per_k3)?;
        above_absolute_zero(within, "wall_c", self.wall_c)
    }
}

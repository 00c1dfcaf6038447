//! First-order random noise (Ornstein-Uhlenbeck): autocorrelation `s² exp(−ω_c |t|)`,
//! `ω_c = 2π f_c`, spectrum flat below the corner and falling as `f⁻²` above it. Exact at the grid
//! points, by `x[j+1] = φ x[j] + √(1 − φ²) s ξ[j]`, `φ = exp(−ω_c Δ)`, from a stationary start.
//!
//! Its paths are nowhere smooth: a sensor that follows the continuous one is integrated to order
//! `h`, not `h⁴`, and the path itself depends on the oversampling. Held over each sample period it
//! is exact in every respect.

use std::f64::consts::TAU;

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use super::Resolution;
use crate::SignalError;
use crate::check::positive;
use crate::grid::Grid;

/// Ornstein-Uhlenbeck noise; with [`Hold::ZeroOrder`](super::Hold::ZeroOrder), AR(1) noise from
/// sample to sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Broadband {
    /// Standard deviation, K.
    pub std_k: f64,
    /// Corner frequency, Hz: the correlation time is `1/(2π · corner_hz)`.
    pub corner_hz: f64,
}

impl Broadband {
    pub(crate) fn values_k(&self, grid: Grid, rng: &mut impl Rng) -> Vec<f64> {
        let decay = TAU * self.corner_hz * grid.step_s;
        let (kept, fresh_k) = ((-decay).exp(), self.std_k * (-(-2.0 * decay).exp_m1()).sqrt());
        let first: f64 = rng.sample(StandardNormal);
        let mut value_k = self.std_k * first;
        let mut values_k = Vec::with_capacity(grid.points);
        values_k.push(value_k);
        for _ in 1..grid.points {
            let draw: f64 = rng.sample(StandardNormal);
            value_k = kept * value_k + fresh_k * draw;
            values_k.push(value_k);
        }
        values_k
    }

    pub(crate) fn check(&self, within: &str, resolution: Resolution) -> Result<(), SignalError> {
        positive(within, "std_k", self.std_k)?;
        positive(within, "corner_hz", self.corner_hz)?;
        resolution.check(within, "corner_hz", self.corner_hz, self.corner_hz)
    }
}

//! Two sensors in two places: one sees `x(t) + m(t)`, the other sees the gas `x(t)`.
//! `m` is stationary first-order Gaussian noise (Ornstein-Uhlenbeck), independent of the gas, added
//! before the sensor.
//!
//! `m` is drawn on the gas's own grid: exact there, and nowhere smooth. So what the sensor makes of
//! it is integrated to order `h`, and another oversampling gives another `m`, as with a gas of kind
//! `broadband`.

use rand::Rng;
use serde::{Deserialize, Serialize};

use crate::check::path;
use crate::gas::Resolution;
use crate::grid::Grid;
use crate::{Broadband, SignalError};

/// Difference of one sensor's gas from the other's, which is the true gas.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Mismatch {
    /// Name of the channel whose sensor sees a different gas; the second one if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub channel: Option<String>,
    /// Standard deviation, K.
    pub std_k: f64,
    /// Corner frequency, Hz: the correlation time is `1/(2π · corner_hz)`.
    pub corner_hz: f64,
}

impl Mismatch {
    /// A different gas for the second sensor.
    pub fn new(std_k: f64, corner_hz: f64) -> Self {
        Self { channel: None, std_k, corner_hz }
    }

    /// The index of the sensor, given the names of the channels.
    pub(crate) fn sensor(&self, channels: [&str; 2]) -> Result<usize, SignalError> {
        let Some(wanted) = &self.channel else { return Ok(1) };
        channels.iter().position(|channel| channel == wanted).ok_or_else(|| SignalError::UnknownChannel {
            field: path("mismatch", "channel"),
            got: wanted.clone(),
            channels: channels.map(str::to_owned),
        })
    }

    /// The difference at every grid point, K.
    pub(crate) fn values_k(&self, grid: Grid, rng: &mut impl Rng) -> Vec<f64> {
        self.process().values_k(grid, rng)
    }

    pub(crate) fn check(&self, resolution: Resolution) -> Result<(), SignalError> {
        self.process().check("mismatch", resolution)
    }

    fn process(&self) -> Broadband {
        Broadband { std_k: self.std_k, corner_hz: self.corner_hz }
    }
}

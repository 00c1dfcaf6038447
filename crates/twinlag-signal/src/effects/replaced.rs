//! A sensor that is replaced in mid-record. From one moment on the channel is read from another
//! sensor, which differs only in its time constant and has been in the gas all along.

use serde::{Deserialize, Serialize};

use crate::SignalError;
use crate::check::{finite, positive};

/// Another sensor from some moment on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Replaced {
    /// When the channel changes over, s after the record's first sample.
    pub at_s: f64,
    /// First time constant of the other sensor, s.
    pub time_constant_s: f64,
}

impl Replaced {
    /// Another time constant from `at_s` on.
    pub fn new(at_s: f64, time_constant_s: f64) -> Self {
        Self { at_s, time_constant_s }
    }

    pub(crate) fn check(&self, within: &str) -> Result<(), SignalError> {
        finite(within, "at_s", self.at_s)?;
        positive(within, "time_constant_s", self.time_constant_s)
    }
}

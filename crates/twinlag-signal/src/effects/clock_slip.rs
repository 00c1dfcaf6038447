//! A clock that loses its place: from one moment on the samples of this channel are those of an
//! earlier time, `y(t) → y(t − by)` for `t ≥ at`. It is a delay that appears in mid-record.

use serde::{Deserialize, Serialize};

use crate::SignalError;
use crate::check::{finite, not_negative};

/// A delay that appears in mid-record.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct ClockSlip {
    /// When the clock slips, s after the record's first sample.
    pub at_s: f64,
    /// By how much the channel is late from there on, s; 0 is allowed.
    pub by_s: f64,
}

impl ClockSlip {
    /// Late by `by_s` from `at_s` on.
    pub fn new(at_s: f64, by_s: f64) -> Self {
        Self { at_s, by_s }
    }

    /// How late the sample at `time_s` is, s.
    pub(crate) fn late_s(&self, time_s: f64) -> f64 {
        if time_s >= self.at_s { self.by_s } else { 0.0 }
    }

    pub(crate) fn check(&self, within: &str) -> Result<(), SignalError> {
        finite(within, "at_s", self.at_s)?;
        not_negative(within, "by_s", self.by_s)
    }
}

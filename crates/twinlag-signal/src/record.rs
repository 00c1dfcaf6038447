//! How the rig is sampled: the `[record]` table.

use serde::{Deserialize, Serialize};

use crate::check::{at_least, not_negative, positive};
use crate::{SignalError, grid};

/// How many samples are taken, how often, and how finely the physics is integrated between them.
///
/// Plain data, checked when a [`Rig`](crate::Rig) is made of it. Start from [`Record::new`]; fields
/// may be added.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Record {
    /// Number of samples, at least 2. The first is at time zero.
    pub samples: usize,
    /// Time from one sample to the next, s.
    pub sample_period_s: f64,
    /// Integration steps per sample period; 24 if left out.
    #[serde(default = "default_oversampling")]
    pub oversampling: usize,
    /// Run-in before the first sample with the gas signal running, s, rounded up to whole sample
    /// periods.
    ///
    /// Left out: ten times the slowest time constant, after which 5e-5 of any start error is left,
    /// and the longest delay. At the start of the run-in both sensors are in equilibrium with the
    /// gas of that moment.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub settle_s: Option<f64>,
}

fn default_oversampling() -> usize {
    24
}

impl Record {
    /// `samples` readings, `sample_period_s` apart, with 24 integration steps between them and the
    /// default run-in.
    pub fn new(samples: usize, sample_period_s: f64) -> Self {
        Self { samples, sample_period_s, oversampling: default_oversampling(), settle_s: None }
    }

    /// Length of an integration step, s.
    ///
    /// ```
    /// use twinlag_signal::Record;
    ///
    /// // 24 steps between two readings; one division rounds by half of `ε` at most.
    /// let record = Record::new(2500, 0.002);
    /// assert!((24.0 * record.step_s() - 0.002).abs() <= 0.002 * f64::EPSILON);
    /// ```
    pub fn step_s(&self) -> f64 {
        self.sample_period_s / self.oversampling as f64
    }

    /// Whole sample periods before the first sample, given the run-in that the sensors need.
    pub(crate) fn settle_samples(&self, needed_s: f64) -> f64 {
        (self.settle_s.unwrap_or(needed_s) / self.sample_period_s).ceil()
    }

    pub(crate) fn check(&self, needed_s: f64) -> Result<(), SignalError> {
        at_least("record", "samples", self.samples, 2)?;
        positive("record", "sample_period_s", self.sample_period_s)?;
        at_least("record", "oversampling", self.oversampling, 1)?;
        if let Some(settle_s) = self.settle_s {
            not_negative("record", "settle_s", settle_s)?;
        }
        grid::check_size(self.steps(needed_s), "record.settle_s")
    }

    /// Steps of the integration, those of the run-in that the sensors need among them.
    pub(crate) fn steps(&self, needed_s: f64) -> f64 {
        (self.samples as f64 + self.settle_samples(needed_s)) * self.oversampling as f64
    }
}

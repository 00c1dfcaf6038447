//! The time grids: where the gas temperature is needed, and how many points that is.

use crate::{Hold, Record, SignalError};

/// Most integration steps in one simulation. The gas is stored at every half step: 3.2 GB at this
/// limit.
const MAX_STEPS: f64 = 2e8;

/// Refuses a simulation of more than [`MAX_STEPS`]; `field` is what drives the number besides the
/// record's size.
pub(crate) fn check_size(steps: f64, field: &str) -> Result<(), SignalError> {
    if steps <= MAX_STEPS {
        Ok(())
    } else {
        Err(SignalError::TooLarge { field: field.to_owned(), steps, limit: MAX_STEPS })
    }
}

/// Evenly spaced times at which a gas signal is generated; time zero is a point of it.
///
/// For a continuous gas these are the half steps of the integration, which is where the Runge-Kutta
/// rule asks for it; for a held gas the sample instants, so that its random numbers do not depend
/// on the oversampling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Grid {
    /// Spacing, s.
    pub(crate) step_s: f64,
    /// Number of points.
    pub(crate) points: usize,
    /// Points before time zero.
    pub(crate) before: usize,
    /// Points per sample period.
    pub(crate) per_sample: usize,
}

impl Grid {
    /// The grid for `record` after `settle_samples` of run-in.
    pub(crate) fn new(record: &Record, settle_samples: usize, hold: Hold) -> Self {
        let per_sample = match hold {
            Hold::Continuous => 2 * record.oversampling,
            Hold::ZeroOrder => 1,
        };
        Self {
            step_s: record.sample_period_s / per_sample as f64,
            points: (settle_samples + record.samples - 1) * per_sample + 1,
            before: settle_samples * per_sample,
            per_sample,
        }
    }

    /// Time of a point, s.
    pub(crate) fn time_s(&self, point: usize) -> f64 {
        (point as f64 - self.before as f64) * self.step_s
    }

    /// All times in order, s.
    pub(crate) fn times_s(self) -> impl Iterator<Item = f64> {
        (0..self.points).map(move |point| self.time_s(point))
    }

    /// The sample period, s.
    pub(crate) fn sample_period_s(&self) -> f64 {
        self.step_s * self.per_sample as f64
    }

    /// Sample instants from the start of the run-in to the record's end.
    pub(crate) fn samples(&self) -> usize {
        (self.points - 1) / self.per_sample + 1
    }
}

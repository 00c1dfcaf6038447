//! What readings have made of a stream and of a tracker, to be kept while a program does not run.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::error::CompensateError;
use crate::filter::Belief;
use crate::stream::{Settled, Stream};

/// What readings have made of a [`crate::Tracker`]: all that changes from one of them to the next.
///
/// A tracker of the same sensors in the same gas that [recalls](crate::Tracker::recall) it goes on to the same bits. Its numbers are
/// read back as they were written where the reader rounds correctly, as that of `serde_json` does with `float_roundtrip`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackerMemory {
    pub(crate) chance: Vec<f64>,
    pub(crate) unread: [u64; 2],
    pub(crate) streams: Vec<StreamMemory>,
}

/// What readings have made of a [`Stream`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct StreamMemory {
    state: Vec<f64>,
    /// Column by column.
    covariance: Vec<f64>,
    is_first: bool,
    settled: Option<SettledMemory>,
}

/// Gains that no longer change.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct SettledMemory {
    gains: [(Vec<f64>, f64); 2],
    variance_k2: f64,
    innovation_variance: f64,
}

/// The vector of these numbers, if they are as many.
fn vector<const D: usize>(numbers: &[f64]) -> Option<SVector<f64, D>> {
    (numbers.len() == D).then(|| SVector::from_column_slice(numbers))
}

impl StreamMemory {
    pub(crate) fn of<const D: usize>(stream: &Stream<D>) -> Self {
        let numbers = |vector: &SVector<f64, D>| vector.as_slice().to_vec();
        Self {
            state: numbers(&stream.belief.state),
            covariance: stream.belief.covariance.as_slice().to_vec(),
            is_first: stream.is_first,
            settled: stream.settled.map(|settled| SettledMemory {
                gains: settled.gains.map(|(gain, weight)| (numbers(&gain), weight)),
                variance_k2: settled.variance_k2,
                innovation_variance: settled.innovation_variance,
            }),
        }
    }

    /// Puts `stream` where this was taken.
    ///
    /// # Errors
    /// [`CompensateError::Memory`] of a stream with another number of states.
    pub(crate) fn put_into<const D: usize>(&self, stream: &mut Stream<D>) -> Result<(), CompensateError> {
        let state = vector(&self.state).ok_or(CompensateError::Memory)?;
        if self.covariance.len() != D * D {
            return Err(CompensateError::Memory);
        }
        let covariance = SMatrix::from_column_slice(&self.covariance);
        let settled = self.settled.as_ref().map(SettledMemory::restored).transpose()?;
        (stream.belief, stream.is_first, stream.settled) = (Belief { state, covariance }, self.is_first, settled);
        Ok(())
    }
}

impl SettledMemory {
    fn restored<const D: usize>(&self) -> Result<Settled<D>, CompensateError> {
        let [one, two] = self.gains.each_ref().map(|(gain, weight)| {
            let gain = vector(gain).ok_or(CompensateError::Memory)?;
            Ok((gain, *weight))
        });
        let Self { variance_k2, innovation_variance, .. } = *self;
        Ok(Settled { gains: [one?, two?], variance_k2, innovation_variance })
    }
}

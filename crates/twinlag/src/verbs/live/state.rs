//! What live tracking knows at an instant, to be kept while it does not run.

use serde::{Deserialize, Serialize};
use twinlag_compensate::{CompensateError, TrackerMemory, tracker};

use super::{Learned, Live, Progress};
use crate::answers::Characterisation;
use crate::error::Error;

/// What live tracking knows at an instant: what the start said, and what the rows since then have made of it.
///
/// As JSON, which [`serde_json`](https://docs.rs/serde_json) with its feature `float_roundtrip` reads back to the same bits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LiveState {
    schema: String,
    start: Characterisation,
    learned: Learned,
    progress: Progress,
    tracker: TrackerMemory,
}

impl LiveState {
    /// The schema's name and number.
    pub const SCHEMA: &'static str = "twinlag.live/1";

    /// Characterisation of the start.
    pub fn start(&self) -> &Characterisation {
        &self.start
    }
}

impl Live {
    /// What is known now, for [`Self::resume`].
    pub fn state(&self) -> LiveState {
        LiveState {
            schema: LiveState::SCHEMA.into(),
            start: self.start.clone(),
            learned: self.learned.clone(),
            progress: self.progress,
            tracker: self.tracker.memory(),
        }
    }

    /// Goes on from where another one was: rows that come after get the answers, to the last bit, that it would have given them.
    ///
    /// # Errors
    /// [`Error::LiveState`] where the state has another schema, or numbers that do not belong together.
    ///
    /// ```
    #[doc = include_str!("../../example.txt")]
    /// let options = LiveOptions { model: Some(twinlag::diagnose(&record, &DiagnoseOptions::default())?.model()), ..LiveOptions::default() };
    /// let mut live = Live::start(&record, &options)?;
    /// let row = |k: usize| (Some(record.time_s[k]), [Some(record.t1_c[k]), Some(record.t2_c[k])]);
    /// for k in 0..200 {
    ///     live.push(row(k).0, row(k).1);
    /// }
    /// let mut resumed = Live::resume(live.state())?;
    /// for k in 200..record.len() {
    ///     assert_eq!(resumed.push(row(k).0, row(k).1), live.push(row(k).0, row(k).1));
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn resume(state: LiveState) -> Result<Self, Error> {
        let LiveState { schema, start, learned, progress, tracker: memory } = state;
        if schema != LiveState::SCHEMA {
            let why = format!("expected the schema {}, got {schema}", LiveState::SCHEMA);
            return Err(Error::LiveState { why });
        }
        let Learned { rig, prior, period_s, change_per_root_s, .. } = &learned;
        let refused = |error: CompensateError| Error::LiveState { why: error.to_string() };
        let mut tracker =
            tracker(rig, prior, *period_s, *change_per_root_s).ok_or_else(|| refused(CompensateError::Memory))?;
        tracker.recall(&memory).map_err(refused)?;
        Ok(Self { start, learned, tracker, progress })
    }
}

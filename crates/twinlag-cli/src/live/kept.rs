//! What is kept of a live run in the file of `--state`, so that another run goes on from it.

use std::io::ErrorKind;
use std::path::Path;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use twinlag::LiveState;
use twinlag::diagnosis::Grade;
use twinlag::record::RowReader;
use twinlag_study::{with_hash, without_hash};

use super::lines::Position;
use super::out::Written;
use crate::failure::Failure;
use crate::output;

/// Name and number of the layout: a line with the SHA-256 of the next one, which is [`Kept`].
const SCHEMA: &str = "twinlag.live-file/1";
/// How often it is written while rows come: what a run that is killed loses.
const EVERY: Duration = Duration::from_secs(10);

/// All that a run goes on from.
#[derive(Serialize, Deserialize)]
pub(super) struct Kept {
    /// `None` where rows go to standard output.
    pub(super) output: Option<Written>,
    /// `None` of a run that has learned nothing yet: its output is begun anew.
    pub(super) rows: Option<Rows>,
}

/// What rows have made of a run.
#[derive(Serialize, Deserialize)]
pub(super) struct Rows {
    pub(super) live: LiveState,
    pub(super) reader: RowReader,
    pub(super) input: Position,
    /// The grade of the start, where rows show it.
    pub(super) grade: Option<Grade>,
    /// Time of the last row, s.
    pub(super) last_s: f64,
}

impl Kept {
    /// What an earlier run left; `None` where there is no such file yet.
    pub(super) fn read(path: &Path) -> Result<Option<Self>, Failure> {
        let damaged = |why: String| {
            Failure::File(format!(
                "{}: tracking cannot go on from this state: {why}. Name the file that an earlier run with --state wrote, or remove it, \
                 so that sensors and gas are learned anew",
                path.display()
            ))
        };
        let bytes = match std::fs::read(path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(damaged(error.to_string())),
        };
        let text = without_hash(SCHEMA, &bytes).map_err(|error| damaged(error.to_string()))?;
        serde_json::from_slice(text).map(Some).map_err(|error| damaged(error.to_string()))
    }

    fn write(&self, path: &Path) -> Result<(), Failure> {
        let text = serde_json::to_string(self).map_err(|error| Failure::Other(format!("the state: {error}")))?;
        output::write(path, with_hash(SCHEMA, &(text + "\n")))
    }
}

/// Writes the state from time to time.
pub(super) struct Keeper<'a> {
    path: &'a Path,
    next: Instant,
}

impl<'a> Keeper<'a> {
    pub(super) fn of(path: &'a Path) -> Self {
        Self { path, next: Instant::now() }
    }

    /// Whether the state has not been written for a while.
    pub(super) fn is_due(&self) -> bool {
        Instant::now() >= self.next
    }

    pub(super) fn keep(&mut self, kept: &Kept) -> Result<(), Failure> {
        kept.write(self.path)?;
        // What is learned is worth most.
        self.next = Instant::now() + if kept.rows.is_some() { EVERY } else { Duration::ZERO };
        Ok(())
    }
}

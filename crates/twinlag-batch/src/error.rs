//! What can keep a batch from running.

use std::path::PathBuf;

use thiserror::Error;
use twinlag_study::Shard;

/// Why a batch could not run. A file that cannot be used is no error: it is a row.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum BatchError {
    #[error("{what}: there is no such file or folder, and it is no pattern that a file fits")]
    NothingFound { what: String },
    #[error("{what}: this is no pattern of file names: {reason}")]
    Pattern { what: String, reason: String },
    #[error("{}: no file in this folder or below, hidden ones left out; name another folder", path.display())]
    Empty { path: PathBuf },
    #[error(
        "records are grouped by `folder`, by `column:NAME`, or by a pattern of file names in which {{rig}} stands once, \
         such as '{{rig}}_*.csv'; got '{got}'"
    )]
    GroupBy { got: String },
    #[error("{} is there from an earlier run: go on with it, or begin anew", path.display())]
    Exists { path: PathBuf },
    #[error(
        "{} is of a run that was asked something else (it differs in {what}): ask the same, or begin anew",
        path.display()
    )]
    OtherQuestion { path: PathBuf, what: String },
    #[error(
        "{} is of another batch ({difference}): ask the same of the same files, or remove it and all parts beside it",
        path.display()
    )]
    OtherBatch { path: PathBuf, difference: String },
    #[error(
        "{}, line {line}: expected the journal of a batch: {reason}; begin anew, or choose another table",
        path.display()
    )]
    Damaged { path: PathBuf, line: usize, reason: String },
    #[error(
        "{}, line {line}: expected the manifest of a batch: {reason}; remove it, and it is made anew; all shards are to be run again",
        path.display()
    )]
    DamagedManifest { path: PathBuf, line: usize, reason: String },
    #[error("{file}: the name is no Unicode, so that no manifest can hold it; give the file another name")]
    NoUnicode { file: String },
    #[error(
        "{}: is no part of this batch (it differs in {what}); remove it, and run its shard again",
        path.display()
    )]
    Foreign { path: PathBuf, what: String },
    #[error("{}, line {line}: {reason}; remove this part, and run its shard again", path.display())]
    DamagedPart { path: PathBuf, line: usize, reason: String },
    #[error(
        "{} and {} are of different divisions, in which units are in other shards: keep the parts of one, and remove the others",
        first.display(),
        second.display()
    )]
    Divisions { first: PathBuf, second: PathBuf },
    #[error("{} is of shard {shard}, which has a part of its own: remove this one, and run the shard of its name", path.display())]
    Twice { path: PathBuf, shard: Shard },
    #[error("there are no parts beside the table: run the shards first")]
    NoParts,
    #[error("{units} of {all} units are missing, first {first}: run shard {shards} of {of}")]
    Incomplete { units: usize, all: usize, first: String, shards: String, of: u64 },
    #[error("{}: expected the journal of a batch, got a file that does not begin as one; choose another table", path.display())]
    NoJournal { path: PathBuf },
    #[error("{} is being written by another run; wait until it ends, or choose another table", path.display())]
    Busy { path: PathBuf },
    #[error("{}: cannot be read: {reason}", path.display())]
    Read { path: PathBuf, reason: String },
    #[error("{}: cannot be written: {reason}", path.display())]
    Write { path: PathBuf, reason: String },
    #[error("the table cannot be written: {reason}")]
    Table { reason: String },
}

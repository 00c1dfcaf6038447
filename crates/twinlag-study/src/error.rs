//! What can keep a study from running or its parts from being read.

use std::fmt;
use std::ops::Range;
use std::path::PathBuf;

use thiserror::Error;

use crate::shard::{Shard, ranges};
use crate::study::Failure;

/// Blocks of one cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gap {
    /// The cell.
    pub cell: usize,
    /// Its blocks.
    pub blocks: Range<u64>,
}

impl fmt::Display for Gap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "cell {} blocks {} to {}", self.cell, self.blocks.start, self.blocks.end - 1)
    }
}

/// Why a study could not run, or its parts could not be used.
///
/// A message is whole: what caused the error is in it, and in its field, but not repeated by
/// `Error::source`.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum StudyError {
    #[error("a study needs at least one cell, one trial and one trial per block, got {cells}, {trials} and {block}")]
    Empty { cells: usize, trials: u64, block: u64 },
    #[error("{cells} cells of {trials} trials in blocks of {block} are more than 2⁶² blocks")]
    TooLarge { cells: usize, trials: u64, block: u64 },
    #[error("cell {cell} has two quantities called \"{name}\"")]
    SameName { cell: usize, name: String },
    #[error("a shard is written k/n with 0 ≤ k < n, got {got}")]
    NoSuchShard { got: String },
    #[error("cell {cell}, trial {trial} could not run: {cause}")]
    Trial { cell: usize, trial: u64, cause: Failure },
    #[error("cell {cell} could not be prepared: {cause}")]
    Scratch { cell: usize, cause: Failure },
    #[error("{} exists: resume it, or use another directory", path.display())]
    Exists { path: PathBuf },
    #[error("{} is being written by another process: wait until that ends", path.display())]
    Busy { path: PathBuf },
    #[error("{} could not be read: {cause}", path.display())]
    Read { path: PathBuf, cause: std::io::Error },
    #[error("{} could not be written: {cause}", path.display())]
    Write { path: PathBuf, cause: std::io::Error },
    #[error("{} is not part of a study, or is damaged: {reason}", path.display())]
    Damaged { path: PathBuf, reason: String },
    #[error("{} has another {what}: expected {expected}, got {got}", path.display())]
    OtherStudy { path: PathBuf, what: &'static str, expected: String, got: String },
    #[error("{} repeats {gap}, which is also in another part", path.display())]
    Twice { path: PathBuf, gap: Gap },
    #[error("there are no parts to merge")]
    NoParts,
    #[error("the study is not complete: missing {}{}", shard_list(.shards), gap_list(.gaps))]
    Incomplete { shards: Vec<Shard>, gaps: Vec<Gap> },
}

/// "shard 2/3: ", or nothing if it is not known how the study was divided.
fn shard_list(shards: &[Shard]) -> String {
    match shards {
        [] => String::new(),
        [one] => format!("shard {one}: "),
        [first, ..] => {
            let indices: Vec<u64> = shards.iter().map(Shard::index).collect();
            format!("shards {} of {}: ", ranges(&indices), first.of())
        }
    }
}

fn gap_list(gaps: &[Gap]) -> String {
    const SHOWN: usize = 10;
    let shown = gaps.iter().take(SHOWN).map(Gap::to_string).collect::<Vec<_>>().join(", ");
    match gaps.len().checked_sub(SHOWN) {
        None | Some(0) => shown,
        Some(more) => format!("{shown} and {more} more gaps"),
    }
}

//! What can keep work from being submitted.

use std::path::PathBuf;

use thiserror::Error;

use crate::engine::Engine;

/// Why work could not be submitted, or nothing could be learnt of it.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum ClusterError {
    #[error(
        "{program} cannot be run: {reason}; run this where the commands of the engine are, or choose another engine"
    )]
    NoProgram { program: &'static str, reason: String },
    #[error("{program} refused: {said}")]
    Refused { program: &'static str, said: String },
    #[error("{} is of an earlier submission: submit again what is missing of it, or remove its folder", path.display())]
    Exists { path: PathBuf },
    #[error("{}: nothing was submitted from here: there is no such file", path.display())]
    NotSubmitted { path: PathBuf },
    #[error("{}: expected what an earlier submission has written: {reason}", path.display())]
    Damaged { path: PathBuf, reason: String },
    #[error("{}: another process submits from here: wait until it ends", path.display())]
    Busy { path: PathBuf },
    #[error("{}: was opened to look at it, not to submit more", path.display())]
    LookedAt { path: PathBuf },
    #[error("the arguments of a shard do not say where the shard stands: expected the word {}", crate::Work::SHARD)]
    NoShard,
    #[error("{option} means nothing to {engine}: {instead}")]
    NotOfEngine { option: &'static str, engine: Engine, instead: &'static str },
    #[error("{}: cannot be read: {reason}", path.display())]
    Read { path: PathBuf, reason: String },
    #[error("{}: cannot be written: {reason}", path.display())]
    Write { path: PathBuf, reason: String },
    #[error("{text:?}: no shell takes it, since it has a zero byte in it or is no Unicode")]
    NoText { text: String },
}

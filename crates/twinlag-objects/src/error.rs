//! What can keep a working copy and its store from agreeing.

use std::path::PathBuf;

use thiserror::Error;

/// Why an object could not be fetched or stored.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum ObjectsError {
    #[error("{url}: expected s3://BUCKET/PREFIX")]
    BadUrl { url: String },
    #[error("{url}: this program was built without object stores (feature s3)")]
    NotBuilt { url: String },
    #[error("{url}: the store cannot be used: {reason}")]
    Unusable { url: String, reason: String },
    #[error("{url}: cannot be read: {reason}")]
    Read { url: String, reason: String },
    #[error("{url}: cannot be written: {reason}")]
    Write { url: String, reason: String },
    #[error("{url}: the store cannot be reached: {reason}; try again when it can")]
    Away { url: String, reason: String },
    #[error("{url}: another process has written it since this one has read it: wait until that one ends")]
    Changed { url: String },
    #[error("{url}: has been removed since this process has read it")]
    Removed { url: String },
    #[error(
        "{url}: the store has replaced it though it was asked not to (If-None-Match): two processes could write the same; use another store"
    )]
    Unconditional { url: String },
    #[error("{}: cannot be read or written: {reason}", path.display())]
    File { path: PathBuf, reason: String },
}

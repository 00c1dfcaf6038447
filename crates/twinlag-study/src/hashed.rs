//! Text with its hash before it, so that damage shows.

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use thiserror::Error;

/// The first line.
#[derive(Serialize, Deserialize)]
struct FirstLine {
    schema: String,
    /// Of all that comes behind this line.
    sha256: String,
}

/// Why a file is not text with its hash before it.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum HashedError {
    /// It has another schema.
    #[error("it has the schema {got}")]
    Schema {
        /// That which it has.
        got: String,
    },
    /// It is not whole, or was changed.
    #[error("{reason}")]
    Damaged {
        /// What is wrong with it.
        reason: String,
    },
}

/// `text` behind a line with the schema and the text's SHA-256.
///
/// ```
/// use twinlag_study::{HashedError, with_hash, without_hash};
///
/// let kept = with_hash("example/1", "{\"trials\":3}\n");
/// assert_eq!(without_hash("example/1", kept.as_bytes())?, b"{\"trials\":3}\n");
/// let changed = kept.replace('3', "4");
/// assert!(matches!(without_hash("example/1", changed.as_bytes()), Err(HashedError::Damaged { .. })));
/// # Ok::<(), HashedError>(())
/// ```
pub fn with_hash(schema: &str, text: &str) -> String {
    let first = serde_json::json!({ "schema": schema, "sha256": sha256(text.as_bytes()) });
    format!("{first}\n{text}")
}

/// The text of a file that [`with_hash`] made.
///
/// # Errors
/// [`HashedError::Schema`] of another schema, [`HashedError::Damaged`] where the text does not fit its hash.
pub fn without_hash<'a>(schema: &str, file: &'a [u8]) -> Result<&'a [u8], HashedError> {
    let damaged = |reason: String| HashedError::Damaged { reason };
    let end = file.iter().position(|byte| *byte == b'\n').map_or(file.len(), |end| end + 1);
    let (first, text) = file.split_at(end);
    let FirstLine { schema: got, sha256: hash } =
        serde_json::from_slice(first).map_err(|error| damaged(error.to_string()))?;
    if got != schema {
        return Err(HashedError::Schema { got });
    }
    if sha256(text) != hash {
        return Err(damaged("what it holds does not fit its hash".to_owned()));
    }
    Ok(text)
}

fn sha256(bytes: &[u8]) -> String {
    base16ct::lower::encode_string(&Sha256::digest(bytes))
}

//! What went wrong within a format, before the file and the format are named.

use std::io;

use crate::error::{FileError, Position};
use crate::format::Format;

/// What a format's module has to say; [`Fault::of`] adds the file.
#[derive(Debug)]
pub(crate) enum Fault {
    /// The file is not what its format prescribes.
    Damaged { at: Option<u64>, expected: String, found: String },
    /// The file is sound and holds what cannot be read without guessing.
    Unsupported { found: String, remedy: String },
    /// The system could not read the file.
    Io(io::Error),
}

impl Fault {
    #[expect(clippy::needless_pass_by_value, reason = "calls read better with what they print as it is")]
    pub(crate) fn damaged(expected: impl Into<String>, found: impl ToString) -> Self {
        Self::Damaged { at: None, expected: expected.into(), found: found.to_string() }
    }

    #[expect(clippy::needless_pass_by_value, reason = "calls read better with what they print as it is")]
    pub(crate) fn damaged_at(byte: u64, expected: impl Into<String>, found: impl ToString) -> Self {
        Self::Damaged { at: Some(byte), expected: expected.into(), found: found.to_string() }
    }

    pub(crate) fn unsupported(found: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Unsupported { found: found.into(), remedy: remedy.into() }
    }

    /// The message for the user.
    ///
    /// - `bytes`: length of the file
    pub(crate) fn of(self, file: &str, format: Format, bytes: u64) -> FileError {
        let file = file.to_owned();
        match self {
            Self::Damaged { at, expected, found } => {
                let at = at.map_or(Position::Within(bytes), Position::Byte);
                FileError::Damaged { file, format, at, expected, found }
            }
            Self::Unsupported { found, remedy } => FileError::Unsupported { file, format, found, remedy },
            Self::Io(error) if error.kind() == io::ErrorKind::UnexpectedEof => FileError::Damaged {
                file,
                format,
                at: Position::Byte(bytes),
                expected: "more of it".to_owned(),
                found: "the end of the file".to_owned(),
            },
            Self::Io(error) => FileError::CannotRead { file, reason: error.to_string() },
        }
    }
}

impl From<io::Error> for Fault {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

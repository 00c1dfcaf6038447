//! Why a file could not be read: every message says where, what was expected, what came, and what
//! to do.

use std::fmt;

use thiserror::Error;
use twinlag_record::RecordError;

use crate::contents::Group;
use crate::format::{Foreign, Format};

/// Where in a file damage shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Position {
    /// At this byte, from 0.
    Byte(u64),
    /// Somewhere within a file of that many bytes: the format's reader shows no more.
    Within(u64),
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Byte(byte) => write!(f, "at byte {byte}"),
            Self::Within(length) => write!(f, "within its {length} bytes"),
        }
    }
}

/// The groups of a file in messages, one on each line.
#[derive(Clone, Debug, PartialEq)]
pub struct Listing(pub Vec<Group>);

impl fmt::Display for Listing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|group| write!(f, "\n  {group}"))
    }
}

/// Why a file could not be read. `file` is its path or the name that the caller gave.
#[derive(Clone, Debug, PartialEq, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum FileError {
    #[error("{file}: cannot be read: {reason}; check the path and its permissions")]
    CannotRead { file: String, reason: String },
    #[error("{file}: is a directory, expected a file; name one file in it")]
    IsDirectory { file: String },
    #[error(
        "{file}: begins with {beginning}, which is no format that is known here; export the measurement as MDF 4, TDMS \
         or CSV"
    )]
    Unrecognised { file: String, beginning: String },
    #[error("{file}: is {foreign}, which is not read; {remedy}", remedy = foreign.remedy())]
    NoReader { file: String, foreign: Foreign },
    #[error(
        "{file}: is {format}, for which this program was built without a reader; build it with the feature '{feature}'"
    )]
    NotBuiltIn { file: String, format: Format, feature: &'static str },
    #[error(
        "{file}: is {format} but damaged or cut off {at}: expected {expected}, found {found}; copy or export the file \
         again"
    )]
    Damaged { file: String, format: Format, at: Position, expected: String, found: String },
    #[error("{file}: is {format}, and {found}; {remedy}")]
    Unsupported { file: String, format: Format, found: String, remedy: String },
    #[error("{file}: is {format} and has no group with rows of numbers, expected a time and two temperatures:{groups}")]
    NoGroup { file: String, format: Format, groups: Listing },
    #[error("{file}: no group '{wanted}'; choose one of these by its name:{groups}")]
    UnknownGroup { file: String, wanted: String, groups: Listing },
    #[error(
        "{file}: {count} groups, each on a time base of its own, may be meant; choose one by its name, or ask for \
         all to be joined on the stamps of one:{groups}",
        count = groups.0.len()
    )]
    SeveralGroups { file: String, groups: Listing },
    #[error("{file}: group '{group}' cannot be joined: {reason}; choose one group by its name")]
    CannotJoin { file: String, group: String, reason: String },
    #[error(transparent)]
    Table(#[from] RecordError),
}

//! Errors and their exit codes.

use std::fmt;

use twinlag::record::{RecordError, Setting as ReaderSetting};
use twinlag_files::FileError;
use twinlag_pages::ReportError;

use crate::excerpt::excerpt;
use crate::settings::{options, reader_option};

/// An error, by its exit code.
#[derive(Debug)]
pub(crate) enum Failure {
    Usage(String),
    File(String),
    /// The file cannot be used, because of one line.
    Line {
        text: String,
        /// The line as it stands in the file.
        excerpt: String,
    },
    Other(String),
    /// The data were read, but cannot answer the question.
    Undetermined(String),
    /// Something else has to be done first: a shard is missing.
    NotYet(String),
}

impl Failure {
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            Self::File(_) | Self::Line { .. } => 3,
            Self::Other(_) => 1,
            Self::Undetermined(_) => 4,
            Self::NotYet(_) => 75,
        }
    }

    /// The line of the file that the message is about, to be shown below it.
    pub(crate) fn excerpt(&self) -> Option<&str> {
        if let Self::Line { excerpt, .. } = self { Some(excerpt) } else { None }
    }

    /// A failure with the same exit code and another message.
    pub(crate) fn reworded(self, text: impl FnOnce(String) -> String) -> Self {
        match self {
            Self::Usage(is) => Self::Usage(text(is)),
            Self::File(is) => Self::File(text(is)),
            Self::Line { text: is, excerpt } => Self::Line { text: text(is), excerpt },
            Self::Other(is) => Self::Other(text(is)),
            Self::Undetermined(is) => Self::Undetermined(text(is)),
            Self::NotYet(is) => Self::NotYet(text(is)),
        }
    }

    /// The failure of a verb on the record in `file`; a message about its readings begins with that name.
    pub(crate) fn in_file(error: twinlag::Error, file: &str) -> Self {
        use twinlag::Error::{Compensate, Cost, Estimate, Model, Noise};
        let is_of_readings = matches!(error, Compensate(_) | Cost(_) | Estimate(_) | Model(_) | Noise(_));
        match error.into() {
            Self::File(text) if is_of_readings => Self::File(format!("{file}: {text}")),
            other => other,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usage(text)
            | Self::File(text)
            | Self::Line { text, .. }
            | Self::Other(text)
            | Self::Undetermined(text)
            | Self::NotYet(text) => f.write_str(text),
        }
    }
}

impl From<twinlag::Error> for Failure {
    fn from(error: twinlag::Error) -> Self {
        match error {
            twinlag::Error::Record(error) => error.into(),
            twinlag::Error::LiveStart { .. } => Self::Undetermined(explained(&error)),
            error if error.is_usage() => Self::Usage(explained(&error)),
            error => Self::File(explained(&error)),
        }
    }
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Self {
        let option = match &error {
            FileError::UnknownGroup { .. } | FileError::CannotJoin { .. } => "\n(option --group NAME)",
            FileError::SeveralGroups { .. } => "\n(options --group NAME, --join)",
            _ => "",
        };
        Self::File(format!("{error}{option}"))
    }
}

/// Something that cannot be drawn is of the file: nothing in it can be shown.
impl From<ReportError> for Failure {
    fn from(error: ReportError) -> Self {
        Self::File(error.to_string())
    }
}

impl From<RecordError> for Failure {
    fn from(error: RecordError) -> Self {
        let text = match &error {
            // Here an option can be shown as it would be typed.
            RecordError::ChannelsUnclear { candidates, .. } if !candidates.example.is_empty() => {
                let typed =
                    |(setting, column): &(ReaderSetting, usize)| Some(format!("{} {column}", reader_option(*setting)?));
                let typed = candidates.example.iter().filter_map(typed);
                format!("{error} (for example {})", typed.collect::<Vec<_>>().join(" "))
            }
            _ => with_options(&error, error.settings().iter().copied().filter_map(reader_option)),
        };
        match error {
            RecordError::CannotWrite { .. } => Self::Other(text),
            RecordError::BadPeriod { .. } | RecordError::TimeAndPeriod { .. } | RecordError::SameColumn { .. } => {
                Self::Usage(text)
            }
            _ => match error.line().and_then(|(file, line)| excerpt(file, line)) {
                Some(excerpt) => Self::Line { text, excerpt },
                None => Self::File(text),
            },
        }
    }
}

/// The message of an answer that there is none, with the options of this program.
pub(crate) fn explained(error: &twinlag::Error) -> String {
    with_options(error, error.settings().into_iter().flat_map(options).copied())
}

/// The message, and the options of this program that set what it asks for.
fn with_options(error: &impl fmt::Display, options: impl Iterator<Item = &'static str>) -> String {
    let options: Vec<&str> = options.collect();
    match &options[..] {
        [] => error.to_string(),
        [one] => format!("{error} (option {one})"),
        _ => format!("{error} (options {})", options.join(", ")),
    }
}

//! Errors as exceptions of `twinlag._errors`, which the package defines.

use pyo3::exceptions::{PyKeyboardInterrupt, PyOSError, PyValueError};
use pyo3::import_exception;
use pyo3::prelude::*;
use twinlag::Error;
use twinlag::record::RecordError as RecordFault;
use twinlag_files::FileError;

import_exception!(twinlag._errors, RecordError);

/// A record that cannot be used, with the file and line that the message is about, where it is about one.
pub(crate) fn of_record(error: &RecordFault) -> PyErr {
    match error {
        RecordFault::CannotRead { .. } | RecordFault::IsDirectory { .. } => PyOSError::new_err(error.to_string()),
        _ => {
            let (file, line) = error.line().map_or((None, None), |(file, line)| (Some(file.to_owned()), Some(line)));
            RecordError::new_err((error.to_string(), file, line))
        }
    }
}

/// A file that cannot be read.
pub(crate) fn of_file(error: &FileError) -> PyErr {
    match error {
        FileError::Table(error) => of_record(error),
        FileError::CannotRead { .. } | FileError::IsDirectory { .. } => PyOSError::new_err(error.to_string()),
        _ => RecordError::new_err((error.to_string(),)),
    }
}

/// A question that cannot be put: the question itself is a plain `ValueError`, the record a `RecordError`.
pub(crate) fn of_verb(error: &Error) -> PyErr {
    match error {
        Error::Record(error) => of_record(error),
        Error::Cancelled => PyKeyboardInterrupt::new_err("cancelled"),
        error if error.is_usage() => PyValueError::new_err(error.to_string()),
        error => RecordError::new_err((error.to_string(),)),
    }
}

/// An option that has a value which it cannot have, with its name.
pub(crate) fn of_options(error: &serde_path_to_error::Error<serde_json::Error>) -> PyErr {
    let path = error.path().to_string();
    PyValueError::new_err(format!("{}: {}", path.strip_prefix("options.").unwrap_or(&path), error.inner()))
}

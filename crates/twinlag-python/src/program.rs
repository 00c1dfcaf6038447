//! The program `twinlag`, which the wheel brings along.

use std::ffi::OsString;
use std::path::PathBuf;

use pyo3::prelude::*;

/// Runs the program and returns its exit code.
///
/// - `arguments`: those of a command line; the first is the script that was started
#[pyfunction]
pub(crate) fn run_program(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    let program = arguments.first().map(PathBuf::from).and_then(|script| script.canonicalize().ok());
    py.detach(|| twinlag_cli::run(program, arguments))
}

//! What Python calls: records of arrays or files, the verbs, and answers as JSON, arrays and pages.
//!
//! The package `twinlag` in `python/twinlag` gives this its names, defaults and documentation. Each verb here takes its options as
//! JSON, in the form of `twinlag::Options`, and runs without the interpreter's lock.

mod answer;
mod column;
mod error;
mod live;
mod program;
mod record;
mod verbs;
mod watched;

use pyo3::prelude::*;

/// The compiled part of `twinlag`.
#[pymodule]
mod _core {
    #[pymodule_export]
    use super::answer::Answer;
    #[pymodule_export]
    use super::live::Live;
    #[pymodule_export]
    use super::record::Record;
    #[pymodule_export]
    use super::verbs::{characterise, check_model, compensate, diagnose, simulate, track};

    #[pymodule_export]
    use super::program::run_program;

    /// The version of the library.
    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");

    /// Both ends of what a temperature can be, °C.
    #[pymodule_export]
    const TEMPERATURE_RANGE_C: (f64, f64) =
        (*twinlag::record::TEMPERATURE_RANGE_C.start(), *twinlag::record::TEMPERATURE_RANGE_C.end());
}

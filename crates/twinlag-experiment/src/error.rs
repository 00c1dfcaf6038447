use std::path::PathBuf;

use thiserror::Error;
use twinlag::estimate::EstimateError;
use twinlag::optimise::ProblemError;
use twinlag::signal::SignalError;
use twinlag_report::ReportError;
use twinlag_study::StudyError;

/// Why an experiment could not be run or written.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum ExperimentError {
    #[error("the plan: {0}")]
    Plan(String),
    #[error(transparent)]
    Estimate(#[from] EstimateError),
    #[error(transparent)]
    Optimiser(#[from] ProblemError),
    #[error(transparent)]
    Signal(#[from] SignalError),
    #[error(transparent)]
    Study(#[from] StudyError),
    #[error("picture {name}: {source}")]
    Picture { name: String, source: ReportError },
    #[error("{name}: no row of the table matches")]
    NoRows { name: String },
    #[error("{name}: the table has no column \"{column}\"")]
    NoColumn { name: String, column: String },
    #[error("{path}: could not be written: {reason}")]
    Write { path: PathBuf, reason: String },
    #[error("the table could not be written: {0}")]
    Table(String),
}

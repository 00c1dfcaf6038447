//! Why a question could not be put to an estimator.

use thiserror::Error;
use twinlag_bias::NoiseError;
use twinlag_cross_relation::CostError;
use twinlag_optimise::ProblemError;

/// Why an estimator could not run. A fit that ran is never an error: see [`crate::Outcome::end`].
#[derive(Clone, Debug, PartialEq, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum EstimateError {
    #[error(transparent)]
    Cost(#[from] CostError),
    #[error(transparent)]
    Noise(#[from] NoiseError),
    #[error(transparent)]
    Optimiser(#[from] ProblemError),
    #[error("{what}: expected {expected}, got \"{got}\"")]
    Unexpected { what: &'static str, expected: String, got: String },
    #[error(
        "known value \"{text}\": expected {expected}, got \"{got}\"; write NAME=VALUE, or NAME=VALUE+-SD, for example \
         T1=0.5s+-20%"
    )]
    BadKnown { text: String, expected: String, got: String },
    #[error(
        "the first {discard} samples are to be discarded, but the longest unbroken stretch has {longest}: \
         use a longer record, discard fewer, or the whitened estimator, which discards none"
    )]
    DiscardsAll { discard: usize, longest: usize },
    #[error("the run was cancelled")]
    Cancelled,
}

impl EstimateError {
    /// Whether the question is at fault (a name that there is not, options that contradict each
    /// other), not the data.
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::Unexpected { .. } | Self::BadKnown { .. } | Self::Optimiser(_))
    }
}

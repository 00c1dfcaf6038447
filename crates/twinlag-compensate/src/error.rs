//! What can be wrong with a question.

use thiserror::Error;

/// Why there is no gas temperature.
#[derive(Clone, Debug, PartialEq, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum CompensateError {
    #[error("{what} must be finite and positive, got {got}")]
    NotPositive { what: String, got: f64 },
    #[error("time must increase from sample to sample: at sample {sample} (counted from 0) it does not")]
    Time { sample: usize },
    #[error("sample {sample} of channel {channel} is {got}: a reading must be finite, or be marked as missing")]
    Reading { channel: usize, sample: usize, got: f64 },
    #[error("both channels and their marks must have one value for each of {expected} instants, got {got}")]
    Lengths { expected: usize, got: usize },
    #[error("at least {needed} samples with both readings are needed, got {got}")]
    TooShort { needed: usize, got: usize },
    #[error("the model has {got} states, the largest that is made has {most}: take fewer terms of the gas")]
    TooLarge { got: usize, most: usize },
    #[error(
        "what is kept of a tracker is not of these sensors in this gas: the numbers of its states, or of its factors, are others"
    )]
    Memory,
}

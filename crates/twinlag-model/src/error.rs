//! What can go wrong before a record is modelled.

use thiserror::Error;
use twinlag_compensate::CompensateError;

/// Why a record cannot be modelled or diagnosed.
#[derive(Clone, Debug, PartialEq, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum ModelError {
    #[error(
        "a model of the rig needs at least {needed} samples without gaps longer than a few, got {samples}: record \
         for longer, or ask for the time constants alone (`characterise`)"
    )]
    TooShort { samples: usize, needed: usize },
    #[error(
        "a model of the rig needs stretches of at least {needed} rows without a missing reading, and of the \
         {samples} rows of this record too few lie in any: find out why readings are missing, or ask for the \
         time constants alone (`characterise`)"
    )]
    InShreds { samples: usize, needed: usize },
    #[error("a joint model needs two records of one rig or more, got {records}")]
    TooFewRecords { records: usize },
    #[error(
        "records that are fitted together have one sample period: that of the first is {first_s} s, that of record {} is \
         {period_s} s. Take those of one period together", record + 1
    )]
    OtherPeriod { record: usize, period_s: f64, first_s: f64 },
    #[error("expected finite readings and times, got one that is not")]
    NotFinite,
    #[error(
        "expected a flow at every sample of every stretch, positive, or the speed of the sensors at each: as many finite numbers as there are readings"
    )]
    Flow,
    #[error("channel {channel} never changes, so it shows no dynamics")]
    Constant { channel: usize },
    #[error(
        "the model depends on a measured flow, or on the position of sensors that move: name the column of the one that it was made with"
    )]
    NeedsFlow,
    #[error(
        "the sensors stand apart along the flow, by a delay that changes: no gas temperature is found from both of them"
    )]
    ChangingDelay,
    #[error(
        "the model has \"{effect}\" with parameters that it does not have here: was it made by another \
        version?"
    )]
    Model { effect: &'static str },
    #[error("the settings have the effect \"{effect}\" twice")]
    EffectTwice { effect: &'static str },
    #[error("the model has {effect} with {name} = {got}: expected {expected}")]
    Parameter { effect: &'static str, name: &'static str, got: f64, expected: &'static str },
    #[error("the numbers of the model give no finite result for this record: was the model changed by hand?")]
    Absurd,
    #[error("the policy has {name} = {got}: expected a positive number, of a share or a probability at most 1")]
    Policy { name: &'static str, got: f64 },
    #[error("the effect \"{effect}\": expected {expected}, got {got}")]
    Effect { effect: &'static str, expected: &'static str, got: f64 },
    #[error("expected {what}, got {got}")]
    Setting { what: &'static str, got: f64 },
    #[error("the run was cancelled")]
    Cancelled,
    #[error(transparent)]
    Compensate(#[from] CompensateError),
    #[error("there is no effect called \"{name}\"; there are {known}")]
    UnknownEffect { name: String, known: String },
}

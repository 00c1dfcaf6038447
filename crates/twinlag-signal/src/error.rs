//! Why a rig was refused or could not be simulated.

use std::io::ErrorKind;
use std::path::PathBuf;

use thiserror::Error;

/// Why a rig was refused or could not be simulated. `field` is the path in the rig file, such as
/// `sensors[1].gain`.
#[derive(Clone, Debug, PartialEq, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum SignalError {
    #[error("{field} must be finite, got {value}")]
    NotFinite { field: String, value: f64 },
    #[error("{field} must be finite and positive, got {value}")]
    NotPositive { field: String, value: f64 },
    #[error("{field} must be finite and not negative, got {value}")]
    Negative { field: String, value: f64 },
    #[error("{field} must be finite and above absolute zero (-273.15), got {value}")]
    NotAboveAbsoluteZero { field: String, value: f64 },
    #[error("{field} must lie between {low} and {high}, got {value}")]
    OutOfRange { field: String, value: f64, low: f64, high: f64 },
    #[error("{field} must be below {other} ({limit}), got {value}")]
    NotBelow { field: String, value: f64, other: String, limit: f64 },
    #[error("{field} must be at least {least}, got {value}")]
    TooFew { field: String, value: usize, least: usize },
    #[error("a rig has exactly two [[sensors]], got {got}")]
    SensorCount { got: usize },
    #[error("{field} must not be empty")]
    EmptyName { field: String },
    #[error("sensors[0].channel and sensors[1].channel must differ, both are {channel:?}")]
    SameChannel { channel: String },
    #[error("{field} must be one of the channels {channels:?}, got {got:?}")]
    UnknownChannel { field: String, got: String, channels: [String; 2] },
    #[error(
        "the integration step {step_s} s is not shorter than {field} = {time_constant_s} s: raise record.oversampling to \
         at least {oversampling}"
    )]
    StepTooLong { field: String, time_constant_s: f64, step_s: f64, oversampling: f64 },
    #[error(
        "{field} = {value} is too fast for the integration step {step_s} s: raise record.oversampling to at least \
         {oversampling}"
    )]
    NotResolved { field: String, value: f64, step_s: f64, oversampling: f64 },
    #[error(
        "{steps:e} integration steps are more than {limit:e}: lower record.samples, record.oversampling or {field}"
    )]
    TooLarge { field: String, steps: f64, limit: f64 },
    #[error(
        "the readings of channel {channel:?} are not finite at {time_s} s: its equations have left the temperatures for \
         which they are meant"
    )]
    Diverged { channel: String, time_s: f64 },
    #[error("{field} needs a [stream] past the sensors: add one, or leave {field} out")]
    NeedsStream { field: String },
    #[error("gas of kind \"series\" needs either path, or values_c and period_s")]
    SeriesSource,
    #[error("the gas series ends at {end_s} s, the record at {needed_s} s")]
    SeriesTooShort { end_s: f64, needed_s: f64 },
    #[error("cannot read the gas series {}: {kind}", path.display())]
    SeriesFile { path: PathBuf, kind: ErrorKind },
    #[error("{}:{line}: expected \"time_s,value_c\", two finite numbers, got {text:?}", path.display())]
    SeriesLine { path: PathBuf, line: usize, text: String },
    #[error("{}:{line}: times must increase, got {time_s} s after {previous_s} s", path.display())]
    SeriesOrder { path: PathBuf, line: usize, previous_s: f64, time_s: f64 },
}

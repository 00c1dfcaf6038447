use thiserror::Error;
use twinlag_bias::NoiseError;
use twinlag_compensate::CompensateError;
use twinlag_convection::ConvectionError;
use twinlag_cross_relation::CostError;
use twinlag_diagnose::ModelError;
use twinlag_estimate::EstimateError;
use twinlag_optimise::ProblemError;
use twinlag_record::RecordError;
use twinlag_signal::SignalError;

use crate::setting::Setting;

/// Why a question could not be put to a record. A fit that ran is never an error: see
/// [`crate::Status`].
#[derive(Clone, Debug, PartialEq, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum Error {
    #[error(transparent)]
    Record(#[from] RecordError),
    #[error(transparent)]
    Compensate(#[from] CompensateError),
    #[error(transparent)]
    Convection(#[from] ConvectionError),
    #[error(transparent)]
    Cost(#[from] CostError),
    #[error(transparent)]
    Model(ModelError),
    #[error(transparent)]
    Estimate(EstimateError),
    #[error(transparent)]
    Noise(#[from] NoiseError),
    #[error(transparent)]
    Optimiser(#[from] ProblemError),
    #[error(transparent)]
    Signal(#[from] SignalError),
    #[error("cancelled")]
    Cancelled,
    #[error("{setting}: expected {expected}, got \"{got}\"")]
    Setting { setting: Setting, expected: String, got: String, also: Vec<Setting> },
    #[error("{what} needs the whitened estimator, not {estimator}")]
    WhitenedOnly { what: &'static str, setting: Setting, estimator: String },
    #[error(
        "{setting}: cannot be used with {estimator}, which is in closed form: leave it out, or use another estimator"
    )]
    NotInClosedForm { setting: Setting, estimator: String },
    #[error(
        "the model has the channels {} and {}, in this order, but the record has {} and {}; gain, offset and delay are \
         those of the second relative to the first. Choose the same channels, in this order", model[0], model[1], record[0], record[1]
    )]
    ModelChannels { model: [String; 2], record: [String; 2] },
    #[error(
        "{file}: expected the sensors of the first record, {} and {}, in this order, got {} and {}. Records of one rig have the \
         same two sensors: say which columns they are, or give these the same names in all files", expected[0], expected[1], found[0], found[1]
    )]
    OtherChannels { file: String, expected: [String; 2], found: [String; 2] },
    #[error(
        "{file}: expected the sample period of {first_file}, {first_s} s, got {period_s} s. Records that are fitted together have one: take \
         those of one period together"
    )]
    OtherPeriod { file: String, first_file: String, first_s: f64, period_s: f64 },
    #[error(
        "{}: expected a flow that changes, got {value} throughout. Use no flow, or diagnose at least three records in different flows \
         together", files.join(", ")
    )]
    SteadyFlow { files: Vec<String>, value: f64 },
    #[error("{file}: {error}")]
    InRecord { file: String, error: Box<Error> },
    #[error(
        "quiet segment {from_s}..{to_s}: expected seconds from the start of the record, which ends at {last_s} s, with \
         {needed} samples or more in unbroken stretches there"
    )]
    QuietSegment { from_s: f64, to_s: f64, last_s: f64, needed: usize },
    #[error(
        "the model has {effect}, which cannot be undone reading by reading: track the whole record, or use a model with \
         calibration, second lags, slow paths and noise only"
    )]
    LiveEffect { effect: &'static str },
    #[error("live tracking has to start with {why}")]
    LiveStart { why: String },
    #[error("live tracking cannot go on from this state: {why}")]
    LiveState { why: String },
    #[error("the model has {what} {got}: expected a finite number above 0")]
    ModelNumber { what: String, got: f64 },
}

impl From<ModelError> for Error {
    fn from(error: ModelError) -> Self {
        if error == ModelError::Cancelled { Self::Cancelled } else { Self::Model(error) }
    }
}

impl From<EstimateError> for Error {
    fn from(error: EstimateError) -> Self {
        if error == EstimateError::Cancelled { Self::Cancelled } else { Self::Estimate(error) }
    }
}

impl Error {
    /// Settings that the error is about: a program can add what it calls them.
    ///
    /// ```
    /// use twinlag::{Options, Setting};
    ///
    /// let error = Options::default().free("slope").expect_err("only gain and offset can be fitted");
    /// assert_eq!(error.settings(), [Setting::Free]);
    /// assert!(error.is_usage()); // the question is at fault, and no record
    /// assert!(error.to_string().ends_with("expected gain, offset or gain,offset, got \"slope\""));
    /// ```
    pub fn settings(&self) -> Vec<Setting> {
        match self {
            Self::Setting { setting, also, .. } => [&[*setting], &also[..]].concat(),
            Self::WhitenedOnly { setting, .. } | Self::NotInClosedForm { setting, .. } => {
                vec![*setting, Setting::Estimator]
            }
            Self::QuietSegment { .. } => vec![Setting::QuietSegment],
            Self::Estimate(EstimateError::DiscardsAll { .. }) => vec![Setting::Discard, Setting::Estimator],
            Self::Convection(_) => vec![Setting::Typical, Setting::Fluid],
            Self::Model(ModelError::NeedsFlow) | Self::SteadyFlow { .. } => vec![Setting::Flow],
            Self::ModelChannels { .. } | Self::OtherChannels { .. } => vec![Setting::Channels],
            Self::ModelNumber { .. } => vec![Setting::Model],
            Self::LiveEffect { .. } => vec![Setting::Live, Setting::Model],
            Self::LiveStart { .. } => vec![Setting::Live, Setting::Known],
            _ => Vec::new(),
        }
    }

    /// Whether the way the question was put is at fault, rather than the record.
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::Estimate(error) if error.is_usage())
            || matches!(
                self,
                Self::Setting { .. }
                    | Self::WhitenedOnly { .. }
                    | Self::NotInClosedForm { .. }
                    | Self::QuietSegment { .. }
                    | Self::Optimiser(_)
                    | Self::Convection(_)
            )
    }
}

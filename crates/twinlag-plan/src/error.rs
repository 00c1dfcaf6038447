use thiserror::Error;
use twinlag::model::ModelError;
use twinlag::signal::SignalError;

/// Why nothing can be said of a record to come.
#[derive(Clone, Debug, PartialEq, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum PlanError {
    #[error(transparent)]
    Signal(#[from] SignalError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(
        "sensors[{sensor}] ({channel}) has no noise: expected noise = {{ std_k = ... }} above 0, or an adc with a step. Without noise \
         every standard error is 0 and there is nothing to plan"
    )]
    NoNoise { sensor: usize, channel: String },
    #[error(
        "the rig has a flow that changes: expected a steady one, since a plan takes time constants to be constant. Take [flow] out \
         of the rig"
    )]
    ChangingFlow,
    #[error(
        "sensors[{sensor}] ({channel}) depends on the velocity of the stream: expected sensors that do not, since a plan takes delays and time \
         constants to be constant. Take downstream_m and stream_exponent out of the rig"
    )]
    InStream { sensor: usize, channel: String },
    #[error(
        "the model has no time constant of {channel}: expected both, since there is no rig without them. Diagnose a record that \
         determines both, know one of them beforehand, or describe the rig"
    )]
    NoTimeConstant { channel: String },
    #[error(
        "the model has no {what}: expected one that this version saved with `twinlag diagnose`. Diagnose the record again"
    )]
    NotSaved { what: &'static str },
    #[error(
        "the model has no spectrum of the gas, as it is for unevenly sampled records, those without an unbroken part of 64 samples, and those of \
         more than 65536 samples: diagnose a part of the record, or describe the rig"
    )]
    NoSpectrum,
    #[error("the model has {what} {got}: expected a finite number above 0")]
    ModelNumber { what: &'static str, got: f64 },
}

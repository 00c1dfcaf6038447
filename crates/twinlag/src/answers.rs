//! Answers, one schema a file.

mod characterisation;
mod compensation;
mod diagnosis;
mod fitted;
mod found_in;
mod gas_spectrum;
mod inspection;
mod model;
mod plausible;
mod records;
mod track;

pub use crate::bands::GasFault;
pub use characterisation::{
    Characterisation, Difference, Estimated, FreeParameters, IntervalMethod, MadeBy, RecordSummary, Residual,
    SecondLag, SensorEstimate, Status,
};
pub use compensation::{Compensation, Quality};
pub use diagnosis::{Diagnosis, EffectNumber, ErrorBeforeAfter, NamedCause, NamedEffect, NamedLimit, NamedTwin};
pub use found_in::FoundIn;
pub(crate) use found_in::rounded;
pub use gas_spectrum::{GasBand, GasSpectrum};
pub use inspection::{InspectedColumn, InspectedRecord, Inspection};
pub use model::{Model, ModelEffect, ModelNumber};
pub use plausible::PlausibleTimeConstant;
pub use records::{
    DisagreementAnswer, EffectInPlace, LeftOutUnit, OwnTimeConstant, RecordAnswer, RecordNumber, TransferAnswer,
    TransferError,
};
pub use track::{Along, Ratio, Track};

pub(crate) use characterisation::is_on_bound_of_time_constant;
pub(crate) use fitted::FittedAnswer;

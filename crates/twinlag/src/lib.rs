//! Two temperature sensors' time constants, and the gas temperature, from their readings alone.
//!
//! Two sensors of different thickness in one gas lag differently. A record of both is asked by a
//! verb, and each verb has an answer that says how far it can be trusted:
//!
//! - [`characterise()`]: the time constant of each sensor *blind*, without knowing the gas
//!   temperature, with 95 % intervals that account for the noise it finds; [`characterise_records()`] does so for several records
//!   of one rig;
//! - [`diagnose()`]: which physical effect the model of two first-order lags lacks, and how much
//!   better it is with it; [`characterise_with`] takes that model to other records of the rig;
//! - [`compensate()`]: the gas temperature at every sample, with its standard deviation;
//! - [`track()`]: the time constants along the record, in flow that changes;
//! - [`inspect()`]: what is in a table, and what would be taken as time and as sensors;
//! - [`Live`]: gas temperature and time constants row by row, as readings come in.
//!
//! A verb that may take long has a second form, such as [`diagnose_watched`], that reports how far
//! it has come and can be cancelled. This crate is the one to take for whole records; each layer is
//! re-exported as a module and can be taken alone: [`sensor`] (models), [`signal`] (simulated
//! records), [`cross_relation`] (the costs), [`bias`] (noise in the published cost), [`estimate`]
//! (estimators), [`optimise`] (solvers), [`model`] (two lags with physical effects, where an
//! [`Effect`](model::Effect) of one's own comes in), [`diagnosis`] (the loop), [`compensation`]
//! (filter and smoother), [`record`] (logger files). Answers as pages are in `twinlag-pages`.
//!
//! ```
//! use twinlag::record::{Channels, Record, SamplingChoice};
//! use twinlag::signal::Rig;
//! use twinlag::{Options, Status, characterise};
//!
//! // A record: here from a rig; from a file it would be `Record::read("run.csv", &Selection::default())`.
//! let rig: Rig = toml::from_str(
//!     r#"
//!     seed = 1
//!     [record]
//!     samples = 2500
//!     sample_period_s = 0.002
//!     [gas]
//!     kind = "turbulence"
//!     mean_c = 450.0
//!     std_k = 15.0
//!     corner_hz = 3.0
//!     cutoff_hz = 200.0
//!     [[sensors]]
//!     channel = "fine"
//!     time_constant_s = 0.0238
//!     noise = { std_k = 0.3 }
//!     [[sensors]]
//!     channel = "coarse"
//!     time_constant_s = 0.1168
//!     noise = { std_k = 0.3 }
//!     "#,
//! )?;
//! let simulated = rig.simulate()?;
//! let record = Record::from_channels(
//!     Channels {
//!         source: "a rig".into(),
//!         names: simulated.channels,
//!         time_s: simulated.time_s,
//!         t1_c: simulated.t1_c,
//!         t2_c: simulated.t2_c,
//!         reference_c: None,
//!     },
//!     SamplingChoice::Auto,
//! )?;
//!
//! let answer = characterise(&record, &Options::default())?;
//! assert_eq!(answer.status, Status::Ok);
//! for (sensor, truth) in answer.sensors.iter().zip([0.0238, 0.1168]) {
//!     let tau_s = sensor.time_constant_s.expect("determined");
//!     let error_s = sensor.standard_error_s.expect("determined");
//!     assert!((tau_s - truth).abs() < 3.0 * error_s);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod answers;
mod bands;
mod error;
mod kept;
mod options;
mod parallel;
mod plausibility;
mod quiet;
mod reference;
mod rows;
mod setting;
mod verbs;
mod watch;

pub use answers::{
    Along, Characterisation, Compensation, Diagnosis, Difference, DisagreementAnswer, EffectInPlace, EffectNumber,
    ErrorBeforeAfter, Estimated, FoundIn, FreeParameters, GasBand, GasFault, GasSpectrum, InspectedColumn,
    InspectedRecord, Inspection, IntervalMethod, LeftOutUnit, MadeBy, Model, ModelEffect, ModelNumber, NamedCause,
    NamedEffect, NamedLimit, NamedTwin, OwnTimeConstant, PlausibleTimeConstant, Quality, Ratio, RecordAnswer,
    RecordNumber, RecordSummary, Residual, SecondLag, SensorEstimate, Status, Track, TransferAnswer, TransferError,
};
pub use error::Error;
pub use kept::{Keep, Kept};
pub use options::Options;
pub use plausibility::{Plausibility, TypicalSensor};
pub use reference::AgainstReference;
pub use rows::rows_of_samples;
pub use setting::Setting;
pub use verbs::{
    CompensateOptions, DiagnoseOptions, Live, LiveAnswer, LiveOptions, LiveState, TrackOptions, characterise,
    characterise_records, characterise_records_watched, characterise_watched, characterise_with, compensate,
    compensate_watched, diagnose, diagnose_records, diagnose_records_watched, diagnose_watched, inspect, joined,
    readings, track, track_watched,
};
pub use watch::Watch;

pub use twinlag_bias as bias;
pub use twinlag_compensate as compensation;
pub use twinlag_convection as convection;
pub use twinlag_cross_relation as cross_relation;
pub use twinlag_diagnose as diagnosis;
pub use twinlag_estimate as estimate;
pub use twinlag_estimate::{Estimator, Hold, Intervals, Known, NoiseColour, NoiseSource};
pub use twinlag_model as model;
pub use twinlag_optimise as optimise;
pub use twinlag_record as record;
pub use twinlag_sensor as sensor;
pub use twinlag_signal as signal;

/// Answers and options may go to any thread, and be read by several.
const _: () = {
    const fn may_cross_threads<T: Send + Sync>() {}
    may_cross_threads::<(Characterisation, Diagnosis, Compensation, Track, Model)>();
    may_cross_threads::<(Options, DiagnoseOptions, CompensateOptions, TrackOptions, LiveOptions)>();
    may_cross_threads::<(Live, LiveAnswer, LiveState, Error)>();
};

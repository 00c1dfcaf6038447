//! Identifies the time constants of two temperature sensors from their readings alone.
//!
//! Two sensors of different thickness in one gas lag differently. From how their readings differ,
//! [`characterise()`] estimates the time constant of each without knowing the gas temperature. Its
//! 95 % intervals account for the noise, and it says so if the record does not determine the
//! answer. Use this crate for whole records; each layer is re-exported as a module and can be used
//! alone: [`sensor`] (models), [`signal`] (simulated records), [`cross_relation`] (the costs),
//! [`bias`] (noise in the published cost), [`optimise`] (solvers), [`record`] (logger files).
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

mod characterisation;
mod characterise;
mod compensate;
mod diagnose;
mod error;
mod live;
mod options;
mod quiet;
mod track;

pub use characterisation::{
    Characterisation, Difference, Estimate, FreeParameters, IntervalMethod, MadeBy, RecordSummary, Residual, SecondLag,
    SensorEstimate, Status,
};
pub use characterise::{Watch, characterise, characterise_watched, readings};
pub use compensate::{AgainstReference, CompensateOptions, Compensation, Quality, compensate};
pub use diagnose::{
    DiagnoseOptions, DiagnoseWatch, Diagnosis, ErrorBeforeAfter, Model, ModelEffect, NamedEffect, NamedLimit,
    characterise_with, diagnose,
};
pub use error::Error;
pub use live::{Live, LiveAnswer, LiveOptions};
pub use options::Options;
pub use track::{Along, Ratio, StepFound, Track, TrackOptions, track};

pub use twinlag_bias as bias;
pub use twinlag_compensate as compensation;
pub use twinlag_cross_relation as cross_relation;
pub use twinlag_diagnose as diagnosis;
pub use twinlag_estimate as estimate;
pub use twinlag_estimate::{Estimator, Hold, Intervals, Known, NoiseColour, NoiseSource};
pub use twinlag_optimise as optimise;
pub use twinlag_record as record;
pub use twinlag_sensor as sensor;
pub use twinlag_signal as signal;

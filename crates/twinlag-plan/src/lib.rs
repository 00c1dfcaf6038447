//! What the next record of two temperature sensors would have to be.
//!
//! For whoever is about to record again. From the description of a rig ([`Plan::of_rig`]) or from what a
//! diagnosis found ([`Plan::of_model`]) it computes the standard error that a record is expected to give for each time
//! constant and each effect, and how clearly the record distinguishes an effect from those that look like it; for the
//! record as it is and for changed ones (rate, length, gas, pair of sensors, known noise). [`Expected`]
//! is one such record, and [`Rehearsal`] fits its models to noisy ones. Everything follows from a record of the rig that is
//! simulated without noise: nothing is estimated from readings here, which is what `twinlag` does.
//!
//! What is expected is right to first order in the noise, if the rig is as described. How well it agrees with what noisy
//! records give is measured in the experiment `planning` of the book.
//!
//! ```
//! use twinlag::signal::{Broadband, Gas, Noise, Record, Rig, Sensor, Signal};
//! use twinlag_plan::{Change, Plan};
//!
//! let mut sensors = [Sensor::new("fine", 0.024), Sensor::new("coarse", 0.117)];
//! sensors.iter_mut().for_each(|sensor| sensor.noise = Some(Noise::white(0.1)));
//! let gas = Gas::new(300.0, Signal::Broadband(Broadband { std_k: 10.0, corner_hz: 3.0 }));
//! let plan = Plan::of_rig(&Rig::new(1, Record::new(1500, 0.004), gas, sensors)?)?;
//! let louder = plan.changed.iter().find(|r| r.change == Some(Change::Excitation { factor: 2.0 })).expect("tried");
//! // Standard errors go with the ratio of noise and gas; frequencies that have little weight add a few per cent to that.
//! let over_now = louder.numbers[0].over_now.expect("determined");
//! assert!((over_now - 0.5).abs() < 0.05, "{over_now}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod advice;
mod change;
mod error;
mod expected;
mod from_model;
mod plan;
mod rehearsal;
mod rivals;
mod seats;

pub use change::Change;
pub use error::PlanError;
pub use expected::Expected;
pub use plan::{Plan, PlanStatus, PlannedNumber, PlannedRecord, PlannedRival, Source};
pub use rehearsal::{Rehearsal, Rehearsed};

//! What the next record of two temperature sensors would have to be.
//!
//! For whoever is about to record again. From the description of a rig ([`Plan::of_rig`]) or from what a
//! diagnosis found ([`Plan::of_model`]) it computes the standard error that a record is expected to give for each time
//! constant and each effect, and how clearly the record distinguishes an effect from those that look like it; for the
//! record as it is and for changed ones (rate, length, gas, pair of sensors, known noise). [`Expected`]
//! is one such record, and [`Rehearsal`] fits its models to noisy ones. Everything follows from a record of the rig that is simulated without noise: nothing is estimated
//! from readings here, which is what `twinlag` does.
//!
//! What is expected is right to first order in the noise, if the rig is as described. How well it agrees with what noisy
//! records give is measured in the experiment `planning` of the book.

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

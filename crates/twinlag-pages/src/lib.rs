//! Answers of `twinlag` as pages and pictures: one HTML file that needs no other, or one SVG.
//!
//! For whoever shows an answer to people: what a diagnosis found and how well it is shown
//! ([`diagnosis_report`]), a gas temperature with its band ([`gas_report`]), time constants along a
//! record ([`track_report`]), the summary of a batch ([`fleet_report`]), and the pictures of each alone. A page computes nothing that an
//! answer says: every number on it is a field of the answer that it shows. Numbers alone need
//! `twinlag`, and no crate of pictures; figures of other data need `twinlag-report`.

mod diagnosis;
mod figures;
#[cfg(feature = "fleet")]
mod fleet;
mod gas;
mod making;
mod pictures;
mod residual_figures;
mod words;

pub use diagnosis::{diagnosis_report, residual_picture};
#[cfg(feature = "fleet")]
pub use fleet::{fleet_report, is_fleet_report};
pub use gas::{gas_report, track_report};
pub use making::Making;
pub use pictures::{gas_picture, readings_picture, track_picture};
pub use twinlag_report::ReportError;
pub use words::{contradictions_in_words, parameter_in_words, plausibility_in_words, spacing_in_words, unit_suffix};

//! The verbs: what can be asked of a record. Each is a list of steps; what they do is below.

mod characterise;
mod compensate;
mod diagnose;
mod live;
mod track;
mod with_model;

pub use characterise::{characterise, characterise_watched, readings};
pub use compensate::{CompensateOptions, compensate, compensate_watched};
pub use diagnose::{DiagnoseOptions, diagnose, diagnose_watched};
pub use live::{Live, LiveAnswer, LiveOptions};
pub use track::{TrackOptions, track, track_watched};
pub use with_model::characterise_with;

//! The verbs: what can be asked of a record. Each is a list of steps; what they do is below.

mod characterise;
mod characterise_records;
mod compensate;
mod diagnose;
mod diagnose_records;
mod given;
mod inspect;
mod live;
mod several;
mod track;
mod with_model;

use twinlag_diagnose::Judgement;

pub use characterise::{characterise, characterise_watched, readings};
pub use characterise_records::{characterise_records, characterise_records_watched};
pub use compensate::{CompensateOptions, compensate, compensate_watched};
pub use diagnose::{DiagnoseOptions, diagnose, diagnose_watched};
pub use diagnose_records::{diagnose_records, diagnose_records_watched};
pub use inspect::inspect;
pub use live::{Live, LiveAnswer, LiveOptions, LiveState};
pub use several::joined;
pub use track::{TrackOptions, track, track_watched};
pub use with_model::characterise_with;

pub(crate) use given::sensor_of;

/// The judgement of what follows from both time constants.
fn following_both(channels: &[String; 2], judgements: [&Judgement; 2]) -> Judgement {
    let names = channels.each_ref().map(|channel| format!("the time constant of {channel}"));
    Judgement::following(names.iter().map(String::as_str).zip(judgements))
}

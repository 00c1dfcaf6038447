//! What an answer says of how plausible its time constants are.

use serde::{Deserialize, Serialize};
use twinlag_convection::WouldTake;

/// A time constant beside what was expected of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct PlausibleTimeConstant {
    /// Name of the channel.
    pub channel: String,
    /// The time constant that was expected, s.
    pub expected_s: f64,
    /// The range that holds 95 % of such sensors, s.
    pub range_95_s: [f64; 2],
    /// What that follows from.
    pub basis: String,
    /// The time constant that the record gives by itself, s; `None` where it gives none.
    pub found_s: Option<f64>,
    /// Its 95 % interval, s.
    pub found_interval_95_s: Option<[f64; 2]>,
    /// Whether the whole of that interval is outside of the range; `None` where there is no interval.
    pub is_outside: Option<bool>,
    /// What the time constant would take physically, where it is outside and the sensor's size was given.
    pub would_take: Option<WouldTake>,
    /// Whether what is expected was taken for knowledge, as the record by itself does not determine the time constant: the answer
    /// rests on it.
    pub is_taken_as_known: bool,
}

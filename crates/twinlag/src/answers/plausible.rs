//! What an answer says of how plausible its time constants are.

use serde::{Deserialize, Serialize};
use twinlag_convection::WouldTake;

/// A time constant beside what was expected of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct PlausibleTimeConstant {
    /// Name of the channel.
    pub channel: String,
    /// The time constant that was expected, s.
    pub expected_s: f64,
    /// The range that holds 95 % of such sensors, s.
    pub range_95_s: [f64; 2],
    /// What that follows from.
    pub from: String,
    /// The time constant that the record gives, s; `None` where it gives none.
    pub found_s: Option<f64>,
    /// Whether the whole of its 95 % interval is outside of the range; `None` where the record gives no time constant.
    pub is_outside: Option<bool>,
    /// What the time constant would take physically, where it is outside and the sensor's size was given.
    pub would_take: Option<WouldTake>,
}

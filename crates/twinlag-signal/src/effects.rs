//! Effects beyond lags, gain, offset, white noise and converter: what else a sensor, its wiring and
//! the gas may do. One file each. Every one is off if left out.

mod clock_slip;
mod coloured_noise;
mod flow;
mod hysteresis;
mod intermittent_contact;
mod mains;
mod mismatch;
mod radiation;
mod replaced;
mod spikes;
mod stream;
mod temperature_dependence;

pub use clock_slip::ClockSlip;
pub use coloured_noise::ColouredNoise;
pub use flow::{Flow, FlowSine, FlowStep};
pub use hysteresis::Hysteresis;
pub use intermittent_contact::IntermittentContact;
pub use mains::Mains;
pub use mismatch::Mismatch;
pub use radiation::Radiation;
pub use replaced::Replaced;
pub use spikes::Spikes;
pub use stream::Stream;
pub use temperature_dependence::TemperatureDependence;

pub(crate) use hysteresis::Play;

/// 0 °C in kelvin.
pub(crate) const ZERO_CELSIUS_K: f64 = 273.15;

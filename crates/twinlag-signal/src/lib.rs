//! Two-sensor records from a described rig, integrated in continuous time.
//!
//! A [`Rig`] says what gas flows past two temperature sensors, how each sensor follows it and how
//! it is read: it is a TOML (or JSON) file, or built in Rust. [`Rig::simulate`] returns the record
//! that such a rig would have written, with the true gas temperature beside it. The sensors are
//! differential equations, integrated by the classical fourth-order Runge-Kutta rule on a grid much
//! finer than the sampling; noise and rounding come last. Use this crate to test or teach an
//! identification method with records whose truth is known. For the *formulae* of a sensor (its
//! discrete pole, its inverse, its frequency response) use `twinlag-sensor` instead, and for
//! measured records `twinlag-record`. This crate deliberately depends on neither, so that the code
//! that explains a record never made it.
//!
//! # Example
//!
//! ```
//! use twinlag_signal::Rig;
//!
//! let rig: Rig = toml::from_str(
//!     r#"
//!     seed = 1
//!     [record]
//!     samples = 2500
//!     sample_period_s = 0.002
//!     [gas]
//!     kind = "sine"
//!     mean_c = 450.0
//!     amplitude_k = 20.0
//!     frequency_hz = 5.0
//!     [[sensors]]
//!     channel = "T1"
//!     time_constant_s = 0.0238
//!     [[sensors]]
//!     channel = "T2"
//!     time_constant_s = 0.1168
//!     noise = { std_k = 0.5 }
//!     "#,
//! )?;
//!
//! // Without noise: T1 swings by 20 K / √(1 + (ωτ)²) about the mean.
//! let clean = rig.clean(0)?;
//! let largest_c = clean.readings_c[0].iter().copied().fold(f64::MIN, f64::max);
//! let omega_tau = std::f64::consts::TAU * 5.0 * 0.0238;
//! assert!((largest_c - 450.0 - 20.0 / f64::hypot(1.0, omega_tau)).abs() < 0.05);
//!
//! // Many trials of one gas signal: integrate once, draw noise for each.
//! let first = clean.with_noise(&mut rig.noise_streams(0));
//! let second = clean.with_noise(&mut rig.noise_streams(1));
//! assert_eq!(first, rig.simulate()?);
//! assert_eq!(first.t1_c, second.t1_c); // T1 has no noise
//! assert_ne!(first.t2_c, second.t2_c);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Effects
//!
//! Two first-order lags in white noise are where a rig starts. A [`Sensor`] may have more: further
//! poles, radiation, a time constant that depends on temperature, a curved calibration, delay,
//! drift, mains pick-up, crosstalk, noise with a memory, spikes, and some defects; the two share a
//! [`Flow`] that changes, meet slightly different gas ([`Mismatch`]), or stand in a [`Stream`] with a
//! recorded velocity, one downstream of the other. Each is off if left out, and its documentation
//! says the formula. [`undeclared`] draws rigs with one of them at random,
//! for the trial of a diagnosis.
//!
//! # What the numbers mean
//!
//! Temperatures are in °C (`_c`), differences of temperature in K (`_k`), times in s, frequencies
//! in Hz. The record's first sample is at time zero; the run-in before it ([`Record::settle_s`])
//! has negative times. Random numbers are ChaCha with eight rounds, one stream per trial and
//! purpose ([`Rig::noise_streams`]): the same rig and trial give the same bytes on any number of
//! threads.

mod adc;
mod check;
mod disturbance;
mod dynamics;
mod effects;
mod error;
mod gas;
mod grid;
mod noise;
mod record;
mod rig;
mod sensor;
mod simulated;
mod streams;
mod surroundings;
pub mod undeclared;

pub use adc::Adc;
pub use effects::{
    ClockSlip, ColouredNoise, Flow, FlowSine, FlowStep, Hysteresis, IntermittentContact, Mains, Mismatch, Radiation,
    Replaced, Spikes, Stream, TemperatureDependence,
};
pub use error::SignalError;
pub use gas::{Broadband, Engine, Gas, Hold, MultiTone, Plunge, Series, Signal, Tone, Turbulence};
pub use noise::Noise;
pub use record::Record;
pub use rig::Rig;
pub use sensor::{Sensor, SlowMode};
pub use simulated::{Clean, Simulated};

/// Rigs and what they give may go to any thread, and be read by several.
const _: () = {
    const fn is_send_and_sync<T: Send + Sync>() {}
    is_send_and_sync::<(Clean, Flow, Gas, Record, Rig, Sensor, Signal, SignalError, Simulated)>();
    is_send_and_sync::<(undeclared::Undeclared,)>();
};

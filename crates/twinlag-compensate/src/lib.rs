//! The gas temperature, with its standard deviation, from the readings of two sensors whose lags
//! are known.
//!
//! This crate is for anyone who has a model of two sensors, however it was found, and wants the gas
//! temperature that they measured. [`learn()`] estimates from the readings how strongly and how
//! fast the gas fluctuates. [`reconstruct()`] gives its temperature with a band at every sample:
//! from the whole record (Kalman's filter and a smoother), from the readings so far, or with a
//! fixed lag. [`Stream`] filters sample by sample, and [`Tracker`] does so while the flow changes
//! the time constants. The model ([`Rig`], [`SensorAt`]) covers uneven sampling, missing readings, a
//! delay between the channels, second lags, slow paths, noise that is not white, time constants
//! that change, and radiation. The crate knows neither files nor how a model is found: for logger
//! files use `twinlag`, for the model `twinlag-diagnose`.
//!
//! ```
//! use twinlag_compensate::{Form, Readings, Rig, Sensor, learn, reconstruct};
//! use twinlag_signal::{Gas, Noise, Plunge, Record, Rig as Simulation, Sensor as Simulated, Signal};
//!
//! // Two thermocouples in gas that steps between levels, read every 2 ms with noise of 0.2 K.
//! let sensor = |name: &str, tau_s| {
//!     let mut sensor = Simulated::new(name, tau_s);
//!     sensor.noise = Some(Noise::white(0.2));
//!     sensor
//! };
//! let signal = Signal::Plunge(Plunge { amplitude_k: 20.0, dwell_s: 0.3, rise_s: 0.02 });
//! let sensors = [sensor("fine", 0.024), sensor("coarse", 0.117)];
//! let record = Simulation::new(1, Record::new(1500, 0.002), Gas::new(300.0, signal), sensors)?.simulate()?;
//!
//! let readings = Readings::new(record.time_s, [record.t1_c.clone(), record.t2_c])?;
//! let rig = Rig::new([Sensor::new(0.024, 0.2), Sensor::new(0.117, 0.2)]);
//! let prior = learn(&readings, &rig)?.prior;
//! let gas = reconstruct(&readings, &rig, &prior, Form::Smoother)?;
//!
//! // Much closer to the gas than the faster sensor, with a standard deviation that fits the error.
//! let rms = |values: &[f64]| {
//!     let squares: f64 = values.iter().zip(&record.gas_c).map(|(a, b)| (a - b) * (a - b)).sum();
//!     (squares / values.len() as f64).sqrt()
//! };
//! assert!(rms(&gas.gas_c) < 0.25 * rms(&record.t1_c));
//! let inside = (0..1500).filter(|&k| (gas.gas_c[k] - record.gas_c[k]).abs() < 2.0 * gas.std_k[k]).count();
//! assert!(inside > 1350);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Without its default feature `std` the crate has only [`Stream`] and what it needs, for machines
//! without an operating system.

#![cfg_attr(not(feature = "std"), no_std)]

#[cfg(feature = "std")]
mod error;
mod filter;
#[cfg(feature = "std")]
mod intensity;
#[cfg(feature = "std")]
mod learn;
#[cfg(feature = "std")]
mod memory;
mod prior;
#[cfg(feature = "std")]
mod readings;
#[cfg(feature = "std")]
mod reconstruct;
mod rig;
#[cfg(feature = "std")]
mod slopes;
#[cfg(feature = "std")]
mod smooth;
#[cfg(feature = "std")]
mod sparse;
#[cfg(feature = "std")]
mod spectrum;
mod stream;
mod system;
#[cfg(feature = "std")]
mod tapered;
#[cfg(feature = "std")]
mod tracker;

#[cfg(feature = "std")]
pub use error::CompensateError;
#[cfg(feature = "std")]
pub use intensity::{Intensity, learn_intensity};
#[cfg(feature = "std")]
pub use learn::{GasParts, Learned, learn, learn_from, learn_quickly, learn_with_noise};
#[cfg(feature = "std")]
pub use memory::TrackerMemory;
#[cfg(feature = "std")]
pub use prior::Prior;
pub use prior::Term;
#[cfg(feature = "std")]
pub use readings::Readings;
#[cfg(feature = "std")]
pub use reconstruct::{bandwidth_hz, reconstruct, reconstruct_with};
pub use rig::{Coloured, Rig, Sensor, SensorAt, SlowPath};
#[cfg(feature = "std")]
pub use smooth::{Form, Gas};
#[cfg(feature = "std")]
pub use spectrum::power_spectrum;
pub use stream::{Filtered, Stream};
#[cfg(feature = "std")]
pub use tracker::{AnyTracker, Tracker, TrackerState, tracker};

/// Readings, filters and what they give may go to any thread, and be read by several.
#[cfg(feature = "std")]
const _: () = {
    const fn is_send_and_sync<T: Send + Sync>() {}
    is_send_and_sync::<(
        CompensateError,
        Filtered,
        Form,
        Gas,
        GasParts,
        Learned,
        Prior,
        Readings,
        Rig,
        Sensor,
        Stream<4>,
    )>();
    is_send_and_sync::<(Tracker<4>, Box<dyn AnyTracker>, TrackerMemory, TrackerState)>();
};

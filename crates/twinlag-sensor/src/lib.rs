//! How a temperature sensor maps the temperature of the gas to its reading, and back.
//!
//! This crate is for anyone who simulates, corrects or fits sensors that lag. It has time constant,
//! sample period, pole, noise gain, response, frequency response and exact inverse, and computes
//! the error of each way of going from continuous to sampled time. It knows no files, no costs, no
//! optimisers and no random numbers. To *find* a time constant use `twinlag` (records in, answers
//! out) or `twinlag-cross-relation` (the costs alone).
//!
//! ```
//! use twinlag_sensor::{Discretisation, FirstOrder, Lag, tone_floor};
//!
//! // A 24 ms thermocouple, read 500 times a second.
//! let sensor = FirstOrder::new(0.0238, 0.002)?;
//! let gas = [20.0, 20.0, 100.0, 100.0, 100.0];
//! let reading = sensor.respond(&gas);
//! assert!(reading[4] > 20.0 && reading[4] < 35.0); // it lags
//!
//! // The inverse gives the gas temperature back, one sample less.
//! let back = sensor.invert(&reading);
//! assert!((back[3] - 100.0).abs() < 1e-9);
//!
//! // Gas at 10 Hz reaches the reading flattened to 56 %.
//! assert!((sensor.continuous_response(10.0).norm() - 0.556).abs() < 1e-3);
//!
//! // What holding the gas between samples costs a blind fit of this pair on a 10 Hz tone: −0.19 % and −0.13 %.
//! let floor = tone_floor([0.0238, 0.1168], 0.002, 10.0, Discretisation::ZeroOrderHold)?;
//! assert!((floor[0] + 0.0019).abs() < 1e-4);
//! # Ok::<(), twinlag_sensor::ModelError>(())
//! ```
//!
//! [`FirstOrder::responder`], [`FirstOrder::inverter`] and [`DifferenceEquation::responder`] work
//! sample by sample, in constant memory. Without the default feature `std` the crate works on
//! machines without an operating system or an allocator; it then lacks the functions that return a
//! whole record, and dual numbers. Exponentials are then those of `libm`, which may differ in the
//! last digit.

#![cfg_attr(not(feature = "std"), no_std)]

mod difference;
mod error;
mod first_order;
mod floor;
mod number;
mod second_order;
mod slow_mode;
mod stream;

pub use difference::{DifferenceEquation, Discretisation, FirstOrderCoefficients, SecondOrderCoefficients};
pub use error::ModelError;
pub use first_order::FirstOrder;
pub use floor::tone_floor;
pub use number::Number;
pub use second_order::SecondOrder;
pub use slow_mode::SlowMode;
pub use stream::{EquationResponder, FirstOrderInverter, FirstOrderResponder};

use num_complex::Complex64;

/// A linear sensor of unit static gain, read at a fixed rate.
pub trait Lag {
    /// Response of the continuous sensor at `frequency_hz`: what it does to a gas with no power
    /// above half the sampling rate.
    fn continuous_response(&self, frequency_hz: f64) -> Complex64;

    /// The sampled sensor, for a gas that does between samples what `discretisation` says.
    ///
    /// # Errors
    /// [`ModelError::NoDifferenceEquation`] for [`Discretisation::BandLimited`].
    fn difference_equation(&self, discretisation: Discretisation) -> Result<DifferenceEquation, ModelError>;

    /// Sample period, s.
    fn period_s(&self) -> f64;
}

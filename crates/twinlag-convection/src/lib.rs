//! The time constant that a temperature sensor of a given shape and size has in a given flow.
//!
//! For whoever knows what a sensor is like and wants to know whether a time constant is plausible. [`Body`] is the sensor,
//! [`Flow`] what it is in, [`Expected`] the time constant with its standard deviation, and what diameter or speed another time
//! constant would take. The sensor is lumped: the whole of it has one temperature, so that
//!
//! ```text
//! τ = ρc V / (h A),   h = Nu k / d,   V/A = d/4 of a cylinder, d/6 of a sphere
//! ```
//!
//! with the Nusselt number `Nu` of forced convection. Radiation, conduction along the wires and natural convection are left
//! out: the first two shorten the time constant of a fine wire by some per cent, and natural convection matters where the
//! fluid hardly moves. To estimate time constants from readings take the crate `twinlag`.
//!
//! ```
//! use twinlag_convection::{Body, Expected, Flow};
//!
//! let body: Body = "thermocouple:0.5mm".parse()?;
//! let flow: Flow = "air@20m/s".parse()?;
//! let expected = Expected::of(&body, &flow, 20.0)?;
//! assert!((expected.time_constant_s - 0.705).abs() < 0.001, "{expected:?}");
//! // A time constant twice as long would take a wire of 0.79 mm, or a flow of 4.9 m/s.
//! let take = expected.would_take(2.0 * expected.time_constant_s);
//! let [diameter_m, speed_m_s] = [take.diameter_m, take.speed_m_s].map(|value| value.expect("not absurd"));
//! assert!((diameter_m - 0.79e-3).abs() < 0.01e-3 && (speed_m_s - 4.9).abs() < 0.1, "{diameter_m} {speed_m_s}");
//! # Ok::<(), twinlag_convection::ConvectionError>(())
//! ```

mod body;
mod correlation;
mod error;
mod expected;
mod flow;
mod fluid;
mod quantity;

pub use body::{Body, Material, Shape};
pub use correlation::{Correlation, Nusselt};
pub use error::ConvectionError;
pub use expected::{Expected, WouldTake};
pub use flow::Flow;
pub use fluid::{Fluid, Properties};

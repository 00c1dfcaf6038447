//! The time constant that a temperature sensor of a given shape and size has in a given flow.
//!
//! For whoever knows what a sensor is like and wants to know whether a time constant is plausible. [`Body`] is the sensor,
//! [`Flow`] what it is in, [`Expected`] the time constant with its standard deviation, and what diameter or speed another time
//! constant would take. The sensor is lumped: the whole of it has one temperature, so that
//!
//! ```text
//! τ = ρc V / (h A),   h = Nu k / d + 4 ε σ T³,   V/A = d/4 of a cylinder, d/6 of a sphere
//! ```
//!
//! with the Nusselt number `Nu` of forced convection and, in a gas, radiation. Conduction along the wires and natural convection are
//! left out: the first shortens the time constant of a short wire, the second matters where the fluid hardly moves. To
//! estimate time constants from readings take the crate `twinlag`.
//!
//! ```
//! use twinlag_convection::{Body, Expected, Flow};
//!
//! let body: Body = "thermocouple:0.5mm".parse()?;
//! let flow: Flow = "air@20m/s".parse()?;
//! let expected = Expected::of(&body, &flow, 20.0)?;
//! assert!((expected.time_constant_s - 0.70).abs() < 0.01, "{expected:?}");
//! // A time constant four times as long would take a wire of 0.9 to 1.9 mm.
//! let [thin_m, thick_m] = expected.would_take(4.0 * expected.time_constant_s).diameter_m.expect("within the correlation");
//! assert!((thin_m - 0.9e-3).abs() < 0.05e-3 && (thick_m - 1.9e-3).abs() < 0.1e-3, "{thin_m} {thick_m}");
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

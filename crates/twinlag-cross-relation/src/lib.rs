//! wip

mod banded;
mod difference_equation;
mod error;
mod free_gains;
mod inverse;
mod parameters;
mod published;
mod readings;
mod spectral;
mod whitened;

pub use difference_equation::difference_equation_least_squares;
pub use error::CostError;
pub use free_gains::FreeGains;
pub use parameters::{CostValue, Parameter};
pub use published::CrossRelation;
pub use readings::{Readings, Segment, Steps};
pub use whitened::{Form, Whitened};

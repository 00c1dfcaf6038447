//! From two channels to two time constants: a family of estimators behind one trait.
#![expect(missing_docs, reason = "doors of the facade, about to close")]

mod assumptions;
mod bootstrap;
mod difference;
mod error;
mod fitting;
mod intervals;
mod levels;
mod objective;
mod profile;
mod published;
mod starts;
mod task;
mod vocabulary;
mod whitened;

pub use error::EstimateError;
pub use levels::{Levels, MIN_DEGREES_OF_FREEDOM_AT_REST, RunAtRest};
pub use profile::Z_975;
pub use task::{Estimate, Outcome, Task};
pub use vocabulary::{
    Bootstrap, Estimator, Hold, IntervalBasis, Intervals, Known, NoiseColour, NoiseKnowledge, NoiseSource,
};

/// What the facade still takes apart.
#[doc(hidden)]
pub mod parts {
    pub use crate::fitting::{Minimised, minimise_whitened};
    pub use crate::intervals::{Intervals, Minimum, with_level_uncertainty};
    pub use crate::objective::{EstimatorCost, Objective, Prior};
    pub use crate::profile::{FAR_ABOVE, Ridge, ridge};
    pub use crate::published::{SETTLED, noise, profile_level};
    pub use crate::starts::{hold_known, second_lags, starts};
}

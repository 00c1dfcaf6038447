//! What each solver makes of a start: a file for each, from its options to argmin and back.
//!
//! All begin at the best point that the ledger knows, and leave the ledger to say where they ended.

pub(crate) mod brent;
mod dogleg;
pub(crate) mod levenberg_marquardt;
pub(crate) mod nelder_mead;
#[cfg(feature = "global")]
pub(crate) mod particle_swarm;
#[cfg(feature = "global")]
mod polish;
pub(crate) mod quasi_newton;
#[cfg(feature = "global")]
mod random;
#[cfg(feature = "global")]
pub(crate) mod simulated_annealing;
pub(crate) mod trust_region;

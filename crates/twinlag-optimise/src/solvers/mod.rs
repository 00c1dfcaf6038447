//! What each solver makes of a start: a file for each, from its options to argmin and back.
//!
//! All begin at the best point that the ledger knows, and leave the ledger to say where they ended.

#[cfg(feature = "local")]
pub(crate) mod brent;
#[cfg(feature = "local")]
mod dogleg;
pub(crate) mod levenberg_marquardt;
pub(crate) mod nelder_mead;
#[cfg(feature = "global")]
pub(crate) mod particle_swarm;
#[cfg(feature = "global")]
mod polish;
#[cfg(feature = "local")]
pub(crate) mod quasi_newton;
#[cfg(feature = "global")]
mod random;
#[cfg(feature = "global")]
pub(crate) mod simulated_annealing;
#[cfg(feature = "local")]
pub(crate) mod trust_region;

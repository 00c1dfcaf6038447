//! From two channels to two time constants: a family of estimators behind one trait.
//!
//! For studies, comparisons and other front ends: a [`Task`] says what is known of noise and
//! parameters and what may be fitted, an [`Estimator`] answers it, and an estimator of your own
//! takes part by implementing [`Estimate`]. It answers the bare question and takes the model for
//! right. For a record that you want to *know* about take `characterise` of `twinlag`, which asks
//! the same estimators, tests what they leave, and says what is not determined; for a cost to
//! minimise yourself take `twinlag-cross-relation`; for what noise does to the published costs
//! `twinlag-bias`.
//!
//! ```
//! use twinlag_cross_relation::Readings;
//! use twinlag_estimate::{Estimate, Estimator, Task};
//! use twinlag_sensor::FirstOrder;
//!
//! // Two sensors in the same fluctuating gas, 500 samples a second, and noise of 0.05 K in each (here a fixed sequence).
//! let gas: Vec<f64> = (0..2000).map(|k| 300.0 + 20.0 * (0.13 * k as f64).sin() + 8.0 * (0.037 * k as f64).cos()).collect();
//! let noisy = |tau_s: f64, seed: u32| -> Result<Vec<f64>, Box<dyn std::error::Error>> {
//!     let mut state = seed;
//!     let mut noise = || {
//!         state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
//!         0.05 * 12.0_f64.sqrt() * (f64::from(state >> 8) / f64::from(1 << 24) - 0.5)
//!     };
//!     Ok(FirstOrder::new(tau_s, 0.002)?.respond(&gas).into_iter().map(|y| y + noise()).collect())
//! };
//! let readings = Readings::even(&noisy(0.0238, 1)?, &noisy(0.1168, 2)?, 0.002)?;
//!
//! let found = Estimator::Whitened.estimate(&Task::new(&readings))?;
//! let error_s = found.standard_error_s.expect("a minimum");
//! for (i, truth_s) in [0.0238, 0.1168].into_iter().enumerate() {
//!     assert!((found.tau_s[i] - truth_s).abs() < 4.0 * error_s[i]);
//! }
//! assert!(found.noise_std_k.expect("found").iter().all(|s| (s / 0.05 - 1.0).abs() < 0.1));
//!
//! // The published cost on the same task: noise makes its time constants too long.
//! let published = Estimator::CrossRelation.estimate(&Task::new(&readings))?;
//! assert!(published.tau_s[0] > found.tau_s[0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! **One estimate, one number.** [`WhitenedFit`] is the whitened estimate with all that it rests
//! on, and the only one there is: [`Estimator::Whitened`] returns its numbers, the other estimators
//! begin at it, and `characterise` reports it.

mod assumptions;
mod bootstrap;
mod determined;
mod difference;
mod error;
mod estimate;
mod fitting;
mod hold;
mod intervals;
mod known;
mod levels;
mod objective;
mod outcome;
mod profile;
mod published;
mod residual;
mod second_lag;
mod starts;
mod task;
mod vocabulary;
mod whitened;

pub use determined::{MAX_LOG_STANDARD_ERROR, spans_too_much};
pub use error::EstimateError;
pub use estimate::Estimate;
pub use intervals::TauIntervals;
pub use known::Known;
pub use levels::{MIN_DEGREES_OF_FREEDOM_AT_REST, NoiseLevels};
pub use objective::Prior;
pub use outcome::{Outcome, Solved};
pub use profile::Ridge;
pub use residual::REJECTION_P_VALUE;
pub use second_lag::Unseen;
pub use task::{RunAtRest, Task};
pub use vocabulary::{Bootstrap, Estimator, Hold, IntervalBasis, Intervals, NoiseColour, NoiseKnowledge, NoiseSource};
pub use whitened::{ENERGY_THAT_OUTWEIGHS_NOISE, WhitenedFit};

/// Questions and answers may go to any thread, and be read by several.
const _: () = {
    const fn is_send_and_sync<T: Send + Sync>() {}
    is_send_and_sync::<(EstimateError, Estimator, Hold, Intervals, Known, NoiseLevels, NoiseKnowledge, Outcome)>();
    is_send_and_sync::<(Solved<2>, TauIntervals)>();
};

//! What measurement noise adds to a two-sensor cost, and how to subtract it.
//!
//! This crate is for anyone who uses the published cross-relation cost on noisy data. It has the
//! noise gain of the synthetic filters of first and second order for white and coloured noise; the
//! compensated cost for known levels; the normalised cost for a known ratio (or the compensated one
//! with its level profiled); the hybrid between the two; and estimates of the levels from the data.
//! All costs take two, four or six parameters, in the order of
//! [`twinlag_cross_relation::Parameter::ALL`].
//!
//! If you are free to choose, prefer the exactly whitened cost of `twinlag-cross-relation`, which
//! needs no compensation and is up to several times more precise. For whole records use `twinlag`.
//! This crate knows no optimiser.
//!
//! ```
//! use twinlag_bias::{Compensated, Noise};
//! use twinlag_cross_relation::{CrossRelation, Readings};
//! # let (y1, y2): (Vec<f64>, Vec<f64>) = (0..400).map(|k| (0.1 * f64::from(k)).sin_cos()).unzip();
//!
//! let readings = Readings::even(&y1, &y2, 0.002)?;
//! let cost = Compensated::new(CrossRelation::new(&readings, 100)?, [Noise::white(0.05)?, Noise::white(0.05)?]);
//! let at = [0.0238, 0.1168];
//! let plain = cost.cost().evaluate(&at).value;
//! // White noise of 0.05 K adds 0.05² (h(c) + h(a)).
//! let gain = (0.002_f64 / (2.0 * at[0])).tanh() + (0.002_f64 / (2.0 * at[1])).tanh();
//! assert!((plain - cost.evaluate(&at).value - 0.0025 * gain).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod compensated;
mod covariance;
mod error;
mod hybrid;
mod levels;
mod moments;
mod noise_gain;

pub use compensated::{Compensated, Normalised, plain_covariance};
pub use error::NoiseError;
pub use hybrid::Hybrid;
pub use levels::{COARSE_STEP_NOISE_RATIO, NoiseLevel, estimate_noise};
pub use moments::{JointLevels, NoiseMoments};
pub use noise_gain::Noise;

/// Costs and noise may go to any thread, and be read by several.
const _: () = {
    const fn is_send_and_sync<T: Send + Sync>() {}
    is_send_and_sync::<(Compensated<'static>, Hybrid<'static>, JointLevels, Noise, NoiseError, NoiseLevel)>();
    is_send_and_sync::<(NoiseMoments, Normalised<'static>)>();
};

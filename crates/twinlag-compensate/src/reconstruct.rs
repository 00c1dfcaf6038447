//! The gas temperature, with a state of the size that the model needs.

use crate::error::CompensateError;
use crate::prior::Prior;
use crate::readings::Readings;
use crate::rig::Rig;
use crate::smooth::{self, Form, Gas};
use crate::system;

/// Largest state.
pub(crate) const MAX_STATES: usize = 24;

/// Reconstructs the gas temperature from `readings` of `rig`, for a gas that fluctuates as `prior`
/// describes.
///
/// The result is the mean and standard deviation of the gas given the readings that `form` allows,
/// from a state-space model of sensors and gas in continuous time. It is exact if both are as `rig`
/// and `prior` describe them; sensors that lose heat or change are linearised at their readings.
///
/// # Errors
/// [`CompensateError::NotPositive`] for a time constant or noise that is not,
/// [`CompensateError::TooLarge`] for a prior with too many terms.
pub fn reconstruct(readings: &Readings, rig: &Rig, prior: &Prior, form: Form) -> Result<Gas, CompensateError> {
    rig.check()?;
    let states = system::states(rig, &prior.terms);
    let run = match states {
        0..=4 => smooth::run::<4>,
        5..=6 => smooth::run::<6>,
        7..=8 => smooth::run::<8>,
        9..=12 => smooth::run::<12>,
        13..=16 => smooth::run::<16>,
        17..=MAX_STATES => smooth::run::<MAX_STATES>,
        _ => return Err(CompensateError::TooLarge { got: states, most: MAX_STATES }),
    };
    Ok(run(readings, rig, prior, form))
}

/// The highest frequency, Hz, at which readings every `period_s` determine the gas better than the
/// prior: there the gas has as much power as the noise of both inferred gas temperatures together.
/// `None` if it has less everywhere.
pub fn bandwidth_hz(rig: &Rig, prior: &Prior, period_s: f64) -> Option<f64> {
    const POINTS: i32 = 2000;
    let highest_hz = 0.5 / period_s;
    (0..POINTS)
        .map(|k| highest_hz * 1e-5_f64.powf(f64::from(k) / f64::from(POINTS)))
        .find(|&hz| prior.density_k2_per_hz(hz) > rig.noise_density_k2_per_hz(hz, period_s))
}

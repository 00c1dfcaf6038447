//! The gas temperature, with a state of the size that the model needs.

use crate::error::CompensateError;
use crate::intensity::Intensity;
use crate::prior::Prior;
use crate::readings::Readings;
use crate::rig::Rig;
use crate::smooth::{self, Form, Gas};
use crate::system;

/// A function of the smoother with the dimension that rig and prior need.
macro_rules! by_size {
    ($rig:expr, $prior:expr, $name:ident($($argument:expr),*)) => {{
        $rig.check()?;
        match system::states($rig, &$prior.terms) {
            0..=4 => Ok(smooth::$name::<4>($($argument),*)),
            5..=6 => Ok(smooth::$name::<6>($($argument),*)),
            7..=8 => Ok(smooth::$name::<8>($($argument),*)),
            9..=12 => Ok(smooth::$name::<12>($($argument),*)),
            13..=16 => Ok(smooth::$name::<16>($($argument),*)),
            17..=MAX_STATES => Ok(smooth::$name::<MAX_STATES>($($argument),*)),
            got => Err(CompensateError::TooLarge { got, most: MAX_STATES }),
        }
    }};
}

/// Largest state.
pub(crate) const MAX_STATES: usize = 24;

/// Reconstructs the gas temperature from `readings` of `rig`, for a gas that fluctuates as `prior`
/// describes.
///
/// The result is the mean and standard deviation of the gas given the readings that `form` allows,
/// from a state-space model of sensors and gas in continuous time. It is exact if both are as `rig`
/// and `prior` describe them; sensors that lose heat or change are linearised at their readings.
///
/// ```
/// use twinlag_compensate::{Form, Prior, Readings, Rig, Sensor, Term, reconstruct};
///
/// // The gas rises from 20 to 30 °C half-way; each sensor follows with its own lag, read every 10
/// // ms.
/// let time_s: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
/// let follows = |tau_s: f64| -> Vec<f64> {
///     time_s.iter().map(|t| 30.0 - 10.0 * (-(t - 1.0).max(0.0) / tau_s).exp()).collect()
/// };
/// let readings = Readings::new(time_s.clone(), [follows(0.05), follows(0.2)])?;
/// let rig = Rig::new([Sensor::new(0.05, 0.01), Sensor::new(0.2, 0.01)]);
/// let prior = Prior { level_c: 25.0, terms: vec![Term::Rough { std_k: 5.0, corner_hz: 1.0 }] };
///
/// let gas = reconstruct(&readings, &rig, &prior, Form::Smoother)?;
/// // 30 ms after the step the faster sensor has made 45 % of it; the estimate is within two
/// // standard deviations.
/// assert!(readings.reading_c(0, 103).expect("not missing") < 25.0);
/// assert!((gas.gas_c[103] - 30.0).abs() < 2.0 * gas.std_k[103] && gas.std_k[103] < 1.0);
/// // Later readings make every instant more certain, or leave it as it is: rounding only.
/// let filtered = reconstruct(&readings, &rig, &prior, Form::Filter)?;
/// assert!((0..200).all(|k| gas.std_k[k] <= filtered.std_k[k] * (1.0 + 1e-9)));
/// # Ok::<(), twinlag_compensate::CompensateError>(())
/// ```
///
/// # Errors
/// [`CompensateError::NotPositive`] for a time constant or noise that is not,
/// [`CompensateError::TooLarge`] for a prior with too many terms.
pub fn reconstruct(readings: &Readings, rig: &Rig, prior: &Prior, form: Form) -> Result<Gas, CompensateError> {
    by_size!(rig, prior, run(readings, rig, prior, None, form))
}

/// Reconstructs the gas temperature as [`reconstruct()`] does, for a gas whose driving noise is at some
/// instants stronger than at others.
///
/// The result is exact where the intensity is right.
///
/// # Errors
/// As [`reconstruct()`]; [`CompensateError::Lengths`] where `intensity` is not one of these readings.
pub fn reconstruct_with(
    readings: &Readings,
    rig: &Rig,
    prior: &Prior,
    intensity: &Intensity,
    form: Form,
) -> Result<Gas, CompensateError> {
    intensity.check(readings)?;
    by_size!(rig, prior, run(readings, rig, prior, Some(intensity.factors()), form))
}

/// How probable readings are at an intensity, and how that changes with it.
pub(crate) fn score(
    readings: &Readings,
    rig: &Rig,
    prior: &Prior,
    factors: Option<&[f64]>,
) -> Result<smooth::Score, CompensateError> {
    by_size!(rig, prior, score(readings, rig, prior, factors))
}

/// The highest frequency, Hz, at which readings every `period_s` determine the gas better than the
/// prior: there the gas has as much power as the noise of both inferred gas temperatures together.
/// `None` if it has less everywhere.
///
/// ```
/// use twinlag_compensate::{Prior, Rig, Sensor, Term, bandwidth_hz};
///
/// let gas = Prior { level_c: 300.0, terms: vec![Term::Rough { std_k: 10.0, corner_hz: 2.0 }] };
/// let rig = |std_k: f64| Rig::new([Sensor::new(0.02, std_k), Sensor::new(0.1, std_k)]);
/// let with_noise = |std_k: f64| bandwidth_hz(&rig(std_k), &gas, 0.001);
/// // Readings ten times as noisy say less of what is fast; with noise of 10 000 K they say nothing
/// // at all.
/// assert!(with_noise(0.1) > with_noise(1.0) && with_noise(1.0).is_some());
/// assert_eq!(with_noise(1e4), None);
/// ```
pub fn bandwidth_hz(rig: &Rig, prior: &Prior, period_s: f64) -> Option<f64> {
    const POINTS: i32 = 2000;
    let highest_hz = 0.5 / period_s;
    (0..POINTS)
        .map(|k| highest_hz * 1e-5_f64.powf(f64::from(k) / f64::from(POINTS)))
        .find(|&hz| prior.density_k2_per_hz(hz) > rig.noise_density_k2_per_hz(hz, period_s))
}

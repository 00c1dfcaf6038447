//! The error that the choice of discretisation alone causes in a blind estimate.
//!
//! Two sensors see one continuous tone. Their readings have the complex ratio `H1/H2` of the
//! *continuous* responses; a blind method looks for the two discrete sensors with that same ratio.
//! The time constants at which it finds them differ from the true ones by the *floor*: no amount of
//! data removes it.

use num_complex::Complex64;
#[cfg(not(any(feature = "std", test)))]
use num_traits::Float as _;

use crate::difference::Discretisation;
use crate::error::ModelError;
use crate::{FirstOrder, Lag};

/// Relative error `[τ̂1/τ1 − 1, τ̂2/τ2 − 1]` that the discretisation leaves on a noise-free
/// continuous tone.
///
/// - `tau_s`: the true time constants, distinct
/// - `frequency_hz`: the tone, below half the sampling rate
///
/// Solves `Gd1(τ̂1)/Gd2(τ̂2) = G1(τ1)/G2(τ2)` (one complex equation, two real unknowns) by Newton's
/// method in `ln τ`. To leading order in the period it is `−(ω Ts)²/12` for the bilinear rule, for
/// both sensors.
///
/// # Errors
/// [`ModelError::NotPositive`] for a non-positive argument; [`ModelError::OutOfRange`] for a tone
/// at or above half the sampling rate, or where no pair of discrete sensors has that ratio.
pub fn tone_floor(
    tau_s: [f64; 2],
    period_s: f64,
    frequency_hz: f64,
    discretisation: Discretisation,
) -> Result<[f64; 2], ModelError> {
    let continuous = FirstOrder::new(tau_s[0], period_s)?.continuous_response(frequency_hz)
        / FirstOrder::new(tau_s[1], period_s)?.continuous_response(frequency_hz);
    let nyquist_hz = 0.5 / period_s;
    if !(frequency_hz > 0.0 && frequency_hz < nyquist_hz) {
        return Err(ModelError::OutOfRange { name: "tone frequency", low: 0.0, high: nyquist_hz, value: frequency_hz });
    }
    let log_response = |log_tau: f64| -> Result<Complex64, ModelError> {
        let sensor = FirstOrder::new(log_tau.exp(), period_s)?;
        Ok(match discretisation {
            Discretisation::BandLimited => sensor.continuous_response(frequency_hz),
            other => sensor.difference_equation(other)?.frequency_response(frequency_hz, period_s),
        }
        .ln())
    };
    let start = tau_s.map(f64::ln);
    let mut log_tau = start;
    for _ in 0..50 {
        let miss = log_response(log_tau[0])? - log_response(log_tau[1])? - continuous.ln();
        let slope = |t: f64| -> Result<Complex64, ModelError> {
            const STEP: f64 = 1e-5;
            Ok((log_response(t + STEP)? - log_response(t - STEP)?) / (2.0 * STEP))
        };
        let (d1, d2) = (slope(log_tau[0])?, -slope(log_tau[1])?);
        let determinant = d1.re * d2.im - d1.im * d2.re;
        let step =
            [(miss.re * d2.im - miss.im * d2.re) / determinant, (miss.im * d1.re - miss.re * d1.im) / determinant];
        log_tau = [log_tau[0] - step[0], log_tau[1] - step[1]];
        if step[0].hypot(step[1]) < 1e-12 {
            return Ok([(log_tau[0] - start[0]).exp_m1(), (log_tau[1] - start[1]).exp_m1()]);
        }
        if !log_tau.iter().all(|t| t.is_finite()) {
            break;
        }
    }
    Err(ModelError::OutOfRange { name: "tone frequency", low: 0.0, high: nyquist_hz, value: frequency_hz })
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;

    const TAU_S: [f64; 2] = [0.0238, 0.1168];

    /// Reference: an independent NumPy fit of the zero-order-hold model to a sampled continuous 10
    /// Hz sine gave −0.19 % and −0.13 %, printed to two digits.
    #[test]
    fn zero_order_hold_on_a_sampled_sine_is_off_by_what_an_independent_fit_found() {
        let floor = tone_floor(TAU_S, 0.002, 10.0, Discretisation::ZeroOrderHold).expect("solvable");
        assert!((floor[0] - -0.0019).abs() < 5e-5, "{floor:?}");
        assert!((floor[1] - -0.0013).abs() < 5e-5, "{floor:?}");
    }

    /// Dividing the held responses `(1 − a)/(e^{jw} − a)` of two sensors and asking for the phase
    /// and modulus of the continuous ratio gives `τ̂ = (Ts/2)/artanh(tan(ω Ts/2)/(ω τ))` for each.
    /// Newton's last step is below 1e-12.
    #[test]
    fn the_zero_order_hold_floor_is_its_closed_form() {
        let w = std::f64::consts::TAU * 10.0;
        let floor = tone_floor(TAU_S, 0.002, 10.0, Discretisation::ZeroOrderHold).expect("solvable");
        for (got, tau) in floor.iter().zip(TAU_S) {
            let want = 0.001 / ((0.001 * w).tan() / (w * tau)).atanh() / tau - 1.0;
            assert!((got - want).abs() < 1e-9, "got {got}, want {want}");
        }
    }

    /// The bilinear rule answers a tone as the continuous sensor answers one at
    /// `(2/Ts) tan(ω Ts/2)`, so its floor is `(ω Ts/2)/tan(ω Ts/2) − 1` exactly, for both.
    #[test]
    fn the_bilinear_floor_is_the_frequency_warp() {
        let half = std::f64::consts::PI * 10.0 * 0.002;
        let want = half / half.tan() - 1.0;
        let floor = tone_floor(TAU_S, 0.002, 10.0, Discretisation::Bilinear).expect("solvable");
        assert!(floor.iter().all(|got| (got - want).abs() < 1e-9), "got {floor:?}, want {want}");
    }

    /// The straight line between samples distorts both readings alike, so it leaves less than the
    /// hold does; the band- limited response leaves nothing but Newton's last step.
    #[test]
    fn a_first_order_hold_leaves_less_and_the_band_limited_response_nothing() {
        let zero = tone_floor(TAU_S, 0.002, 10.0, Discretisation::ZeroOrderHold).expect("solvable");
        let first = tone_floor(TAU_S, 0.002, 10.0, Discretisation::FirstOrderHold).expect("solvable");
        let none = tone_floor(TAU_S, 0.002, 10.0, Discretisation::BandLimited).expect("solvable");
        for i in 0..2 {
            assert!(first[i].abs() < 0.1 * zero[i].abs(), "first-order hold {first:?}, zero-order hold {zero:?}");
            assert!(none[i].abs() < 1e-10, "{none:?}");
        }
    }

    #[test]
    fn a_tone_above_half_the_sampling_rate_is_refused() {
        assert!(tone_floor(TAU_S, 0.002, 250.0, Discretisation::ZeroOrderHold).is_err());
        assert!(tone_floor(TAU_S, 0.002, 0.0, Discretisation::ZeroOrderHold).is_err());
    }
}

//! A bead in a sheath, or a sensor behind a filter: two lags in series, `1/((1 + s τ)(1 + s τ₂))`.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use crate::Lag;
use crate::difference::{DifferenceEquation, Discretisation};
use crate::error::{ModelError, positive};

/// Two first-order lags in series, unit static gain, read at a fixed rate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked")]
pub struct SecondOrder {
    tau_s: f64,
    second_tau_s: f64,
    period_s: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Unchecked {
    tau_s: f64,
    second_tau_s: f64,
    period_s: f64,
}

impl TryFrom<Unchecked> for SecondOrder {
    type Error = ModelError;

    fn try_from(raw: Unchecked) -> Result<Self, ModelError> {
        Self::new(raw.tau_s, raw.second_tau_s, raw.period_s)
    }
}

impl SecondOrder {
    /// Lags of `tau_s` and `second_tau_s` in series (their order does not matter), read every
    /// `period_s`.
    ///
    /// # Errors
    /// [`ModelError::NotPositive`] if any of the three is not finite and positive.
    pub fn new(tau_s: f64, second_tau_s: f64, period_s: f64) -> Result<Self, ModelError> {
        Ok(Self {
            tau_s: positive("time constant", tau_s)?.max(second_tau_s),
            second_tau_s: positive("second time constant", second_tau_s)?.min(tau_s),
            period_s: positive("sample period", period_s)?,
        })
    }

    /// The larger of the two time constants, s.
    pub fn tau_s(&self) -> f64 {
        self.tau_s
    }

    /// The smaller of the two time constants, s.
    pub fn second_tau_s(&self) -> f64 {
        self.second_tau_s
    }
}

impl Lag for SecondOrder {
    fn continuous_response(&self, frequency_hz: f64) -> Complex64 {
        let s = Complex64::new(0.0, core::f64::consts::TAU * frequency_hz);
        ((s * self.tau_s + 1.0) * (s * self.second_tau_s + 1.0)).inv()
    }

    fn difference_equation(&self, discretisation: Discretisation) -> Result<DifferenceEquation, ModelError> {
        let (slow, fast) = apart(self.tau_s, self.second_tau_s);
        let modes = [(slow / (slow - fast), slow), (-fast / (slow - fast), fast)];
        discretisation.of_modes(&modes, self.period_s)
    }

    fn period_s(&self) -> f64 {
        self.period_s
    }
}

/// Partial fractions need distinct poles. Two that lie closer than 2e-5 of their mean are moved
/// that far apart about it: the response changes by the square of that, 1e-10, and the cancellation
/// between the fractions costs 1e-11.
pub(crate) fn apart(slow: f64, fast: f64) -> (f64, f64) {
    const SMALLEST: f64 = 2e-5;
    let mean = 0.5 * (slow + fast);
    if (slow - fast).abs() > SMALLEST * mean {
        (slow, fast)
    } else {
        (mean * (1.0 + 0.5 * SMALLEST), mean * (1.0 - 0.5 * SMALLEST))
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;
    use crate::FirstOrder;

    /// Two zero-order-hold steps in a row are not the step of the cascade; the closed form of the
    /// step response is `1 − (τ e^(−t/τ) − τ₂ e^(−t/τ₂))/(τ − τ₂)`.
    #[test]
    fn a_held_step_is_answered_by_the_closed_form() {
        let (slow, fast, period) = (0.05, 0.011, 0.004);
        let equation = SecondOrder::new(fast, slow, period)
            .expect("valid")
            .difference_equation(Discretisation::ZeroOrderHold)
            .expect("exists");
        let mut x = vec![1.0; 100];
        x[0] = 0.0;
        for (k, got) in equation.respond(&x).iter().enumerate().skip(1) {
            let t = (k - 1) as f64 * period;
            let want = 1.0 - (slow * (-t / slow).exp() - fast * (-t / fast).exp()) / (slow - fast);
            assert!((got - want).abs() < 1e-13, "sample {k}: got {got}, want {want}");
        }
    }

    /// The critically damped step response is `1 − (1 + t/τ) e^(−t/τ)`; 1e-9 is ten times what
    /// moving the poles apart costs.
    #[test]
    fn equal_poles_are_the_critically_damped_sensor() {
        let (tau, period) = (0.05, 0.004);
        let equation = SecondOrder::new(tau, tau, period)
            .expect("valid")
            .difference_equation(Discretisation::ZeroOrderHold)
            .expect("exists");
        let mut x = vec![1.0; 100];
        x[0] = 0.0;
        for (k, got) in equation.respond(&x).iter().enumerate().skip(1) {
            let t = (k - 1) as f64 * period / tau;
            let want = 1.0 - (1.0 + t) * (-t).exp();
            assert!((got - want).abs() < 1e-9, "sample {k}: got {got}, want {want}");
        }
    }

    /// A second lag of a thousandth of the period is gone before the next sample: `exp(−1000)` is
    /// zero, and the answer is the first-order one delayed by that lag, 1e-3 of a period.
    #[test]
    fn a_vanishing_second_lag_leaves_the_first_order_sensor() {
        let period = 0.004;
        let two = SecondOrder::new(0.05, 4e-6, period).expect("valid");
        let one = FirstOrder::new(0.05, period).expect("valid");
        let x: Vec<f64> = (0..50).map(|k| (f64::from(k) * 0.3).sin()).collect();
        let got = two.difference_equation(Discretisation::ZeroOrderHold).expect("exists").respond(&x);
        let worst = got.iter().zip(one.respond(&x)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-3 * period / 0.05, "largest difference {worst:e}");
    }
}

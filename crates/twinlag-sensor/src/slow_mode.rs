//! Heat that arrives through the support: `((1 − φ) + φ/(1 + s τ_s))/(1 + s τ)`. A fraction `φ` of
//! the final reading comes with the support's own, longer time constant.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use crate::Lag;
use crate::difference::{DifferenceEquation, Discretisation};
use crate::error::{ModelError, positive};
use crate::second_order::apart;

/// A first-order sensor with a slow parallel path, unit static gain, read at a fixed rate.
///
/// # Source
/// The form used for aircraft probes: `τ₁ dT_m/dt = a T + (1 − a) T_s − T_m`,
/// `τ₂ dT_s/dt = T − T_s` with `a = 1 − φ` (Friehe and Khelif; parameters in the Ranadu package of
/// NCAR).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked")]
pub struct SlowMode {
    tau_s: f64,
    fraction: f64,
    slow_tau_s: f64,
    period_s: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Unchecked {
    tau_s: f64,
    fraction: f64,
    slow_tau_s: f64,
    period_s: f64,
}

impl TryFrom<Unchecked> for SlowMode {
    type Error = ModelError;

    fn try_from(raw: Unchecked) -> Result<Self, ModelError> {
        Self::new(raw.tau_s, raw.fraction, raw.slow_tau_s, raw.period_s)
    }
}

impl SlowMode {
    /// Direct path `tau_s`, a `fraction` of the reading arriving through a support of `slow_tau_s`,
    /// read every `period_s`.
    ///
    /// # Errors
    /// [`ModelError::NotPositive`] for times that are not finite and positive,
    /// [`ModelError::OutOfRange`] for a fraction outside [0, 1).
    pub fn new(tau_s: f64, fraction: f64, slow_tau_s: f64, period_s: f64) -> Result<Self, ModelError> {
        if !(0.0..1.0).contains(&fraction) {
            return Err(ModelError::OutOfRange { name: "slow fraction", low: 0.0, high: 1.0, value: fraction });
        }
        Ok(Self {
            tau_s: positive("time constant", tau_s)?,
            fraction,
            slow_tau_s: positive("slow time constant", slow_tau_s)?,
            period_s: positive("sample period", period_s)?,
        })
    }

    /// Time constant of the direct path, s.
    pub fn tau_s(&self) -> f64 {
        self.tau_s
    }

    /// Share of the static reading that arrives through the support, in [0, 1).
    pub fn fraction(&self) -> f64 {
        self.fraction
    }

    /// Time constant of the support, s.
    pub fn slow_tau_s(&self) -> f64 {
        self.slow_tau_s
    }
}

impl Lag for SlowMode {
    fn continuous_response(&self, frequency_hz: f64) -> Complex64 {
        let s = Complex64::new(0.0, core::f64::consts::TAU * frequency_hz);
        ((s * self.slow_tau_s + 1.0).inv() * self.fraction + (1.0 - self.fraction)) / (s * self.tau_s + 1.0)
    }

    fn difference_equation(&self, discretisation: Discretisation) -> Result<DifferenceEquation, ModelError> {
        let (slow, fast) = apart(self.slow_tau_s, self.tau_s);
        let through_support = self.fraction * slow / (slow - fast);
        discretisation.of_modes(&[(1.0 - through_support, fast), (through_support, slow)], self.period_s)
    }

    fn period_s(&self) -> f64 {
        self.period_s
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;
    use crate::FirstOrder;

    /// The published pair of heat balances, integrated with steps so small (Ts/2000) that Heun's
    /// error, `(h/τ)² ≈ 1e-8` per unit, is below the tolerance.
    #[test]
    fn a_held_step_is_answered_as_by_the_two_heat_balances() {
        let (tau, fraction, support, period) = (0.0308, 0.267, 0.447, 0.01);
        let equation = SlowMode::new(tau, fraction, support, period)
            .expect("valid")
            .difference_equation(Discretisation::ZeroOrderHold)
            .expect("exists");
        let mut x = vec![1.0; 60];
        x[0] = 0.0;
        let got = equation.respond(&x);
        let (steps, mut y, mut s) = (2000, 0.0, 0.0);
        let h = period / f64::from(steps);
        let rates = |y: f64, s: f64| (((1.0 - fraction) + fraction * s - y) / tau, (1.0 - s) / support);
        for (k, got) in got.iter().enumerate().skip(1) {
            assert!((got - y).abs() < 1e-6, "sample {k}: got {got}, want {y}");
            for _ in 0..steps {
                let (dy, ds) = rates(y, s);
                let (ey, es) = rates(y + h * dy, s + h * ds);
                y += 0.5 * h * (dy + ey);
                s += 0.5 * h * (ds + es);
            }
        }
    }

    #[test]
    fn no_fraction_is_the_first_order_sensor() {
        let slow = SlowMode::new(0.03, 0.0, 0.4, 0.01).expect("valid");
        let plain = FirstOrder::new(0.03, 0.01).expect("valid");
        for hz in [0.0, 0.3, 3.0, 30.0] {
            assert!((slow.continuous_response(hz) - plain.continuous_response(hz)).norm() < 1e-15);
        }
    }

    #[test]
    fn a_fraction_of_one_is_refused() {
        assert!(matches!(SlowMode::new(0.03, 1.0, 0.4, 0.01), Err(ModelError::OutOfRange { .. })));
    }
}

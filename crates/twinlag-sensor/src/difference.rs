//! From the continuous sensor to a difference equation, and what each way of doing it assumes about
//! the gas between samples.

use core::fmt;

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use crate::error::ModelError;
use crate::number::Number;
use crate::stream::EquationResponder;

/// How the gas temperature is assumed to move between two samples.
///
/// A real gas does none of these exactly. [`crate::tone_floor`] computes the error that the choice
/// causes in a blind estimate. This error falls with the square of the sample period for the
/// zero-order hold and the bilinear rule, and with its fourth power for the first-order hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Discretisation {
    /// Constant until the next sample, as the published method has it:
    /// `y[k] = a y[k−1] + (1 − a) x[k−1]`.
    #[default]
    ZeroOrderHold,
    /// Straight line between samples: exact for a piecewise linear gas temperature.
    FirstOrderHold,
    /// Trapezoidal rule, `s = (2/Ts)(1 − z⁻¹)/(1 + z⁻¹)`. A pair of sensors shares the factor
    /// `1 + z⁻¹`, so for blind work this is the zero-order hold with `τ` stretched:
    /// `Ts/2 / tanh(Ts/2τ)` in place of `τ`.
    Bilinear,
    /// No power above half the sampling rate: the continuous frequency response itself. It has no
    /// difference equation.
    BandLimited,
}

/// `y[k] = Σ_j num[j] x[k−j] − Σ_{j≥1} den[j] y[k−j]`, `den[0] = 1`, unit static gain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DifferenceEquation {
    numerator: Polynomial,
    denominator: Polynomial,
}

impl DifferenceEquation {
    /// Coefficients of `x[k], x[k−1], …`, three at most.
    pub fn numerator(&self) -> &[f64] {
        self.numerator.coefficients()
    }

    /// Coefficients of `y[k], y[k−1], …`, three at most, the first of them 1.
    pub fn denominator(&self) -> &[f64] {
        self.denominator.coefficients()
    }

    /// Reading in gas of temperature `x`, `[n]` to `[n]`, at rest at `x[0]` before the first
    /// sample.
    #[cfg(feature = "std")]
    pub fn respond(&self, x: &[f64]) -> Vec<f64> {
        let mut responder = self.responder();
        x.iter().map(|&gas| responder.push(gas)).collect()
    }

    /// The reading computed sample by sample, in constant memory.
    pub fn responder(&self) -> EquationResponder {
        EquationResponder::new(*self)
    }

    /// Frequency response at `frequency_hz` for samples `period_s` apart.
    pub fn frequency_response(&self, frequency_hz: f64, period_s: f64) -> Complex64 {
        let delay = Complex64::from_polar(1.0, -core::f64::consts::TAU * frequency_hz * period_s);
        at(self.numerator(), delay) / at(self.denominator(), delay)
    }
}

fn at(coefficients: &[f64], delay: Complex64) -> Complex64 {
    coefficients.iter().rev().fold(Complex64::ZERO, |sum, &c| sum * delay + c)
}

impl Discretisation {
    /// The difference equation of `G(s) = Σ r_i / (1 + s τ_i)`, given `(r_i, τ_i)`, two at most,
    /// with `Σ r_i = 1` and distinct `τ_i`.
    pub(crate) fn of_modes(self, modes: &[(f64, f64)], period_s: f64) -> Result<DifferenceEquation, ModelError> {
        let mut numerator = Polynomial::new(&[0.0]);
        let mut denominator = Polynomial::new(&[1.0]);
        for &(weight, tau_s) in modes {
            let mode = self.first_order(tau_s, period_s).ok_or(ModelError::NoDifferenceEquation)?;
            let (num, den) = (Polynomial::new(&mode.numerator), Polynomial::new(&mode.denominator));
            numerator = numerator.times(&den).plus(&num.times(&denominator).scaled(weight));
            denominator = denominator.times(&den);
        }
        Ok(DifferenceEquation { numerator, denominator })
    }

    /// Coefficients of the first-order sensor of time constant `tau_s` (s), `None` for
    /// [`Discretisation::BandLimited`].
    ///
    /// Generic over dual numbers, so that a cost gets exact derivatives with respect to `tau_s`
    /// from the one formula.
    pub fn first_order<D: Number>(self, tau_s: D, period_s: f64) -> Option<FirstOrderCoefficients<D>> {
        let zero = D::from(0.0);
        let one = D::from(1.0);
        let step = tau_s.recip() * period_s;
        let a = (-step).exp();
        let b = -(-step).exp_m1();
        let (numerator, pole) = match self {
            Self::ZeroOrderHold => ([zero, b], a),
            Self::FirstOrderHold => ([one - b / step, b / step - a], a),
            Self::Bilinear => {
                let gain = step / (step + 2.0);
                ([gain, gain], one - gain * 2.0)
            }
            Self::BandLimited => return None,
        };
        Some(FirstOrderCoefficients { numerator, denominator: [one, -pole] })
    }
}

impl Discretisation {
    /// Coefficients of the second-order sensor `1/((1 + s τ)(1 + s τ₂))`, `None` for
    /// [`Discretisation::BandLimited`].
    ///
    /// Generic over dual numbers as [`Discretisation::first_order`] is. Exact for any two positive
    /// time constants, equal ones included: the partial fractions are combined into the divided
    /// difference of the exponential before their poles can cancel.
    pub fn second_order<D: Number>(
        self,
        tau_s: D,
        second_tau_s: D,
        period_s: f64,
    ) -> Option<SecondOrderCoefficients<D>> {
        let zero = D::from(0.0);
        let one = D::from(1.0);
        if self == Self::Bilinear {
            let [p, q] = [tau_s, second_tau_s].map(|tau| self.first_order(tau, period_s));
            let (p, q) = (p?, q?);
            let [(b0, b1), (d0, d1)] = [p, q].map(|c| (c.numerator[0], c.numerator[1]));
            let [a, c] = [p, q].map(|c| c.denominator[1]);
            return Some(SecondOrderCoefficients {
                numerator: [b0 * d0, b0 * d1 + b1 * d0, b1 * d1],
                denominator: [one, a + c, a * c],
            });
        }
        // In units of the period: rates p, q, poles a, c.
        let [p, q] = [tau_s, second_tau_s].map(|tau| tau.recip() * period_s);
        let pole = |t: f64| [(-p * t).exp(), (-q * t).exp()];
        let [a, c] = pole(1.0);
        let [fall_a, fall_c] = [p, q].map(|rate| -(-rate).exp_m1());
        let all = fall_a * fall_c;
        let numerator = match self {
            Self::ZeroOrderHold => {
                // The step response after one period, and unit static gain.
                let first = fall_a - p * divided_difference(p, q, 1.0);
                [zero, first, all - first]
            }
            Self::FirstOrderHold => {
                // The response to a triangle of unit height is the second difference of the ramp
                // response.
                let ramp = |t: f64| {
                    let fall = -(-p * t).exp_m1();
                    -(p + q) / (p * q) * fall + p / q * divided_difference(p, q, t) + t
                };
                let (now, then) = (ramp(1.0), ramp(2.0) - ramp(1.0) * 2.0);
                let middle = then - (a + c) * now;
                [now, middle, all - now - middle]
            }
            Self::Bilinear | Self::BandLimited => return None,
        };
        Some(SecondOrderCoefficients { numerator, denominator: [one, -(a + c), a * c] })
    }
}

/// `(e^(−p t) − e^(−q t))/(q − p)`, also where `p` and `q` meet.
fn divided_difference<D: Number>(p: D, q: D, t: f64) -> D {
    let half = (q - p) * (0.5 * t);
    if half.value().abs() > 0.05 {
        return ((-p * t).exp() - (-q * t).exp()) / (q - p);
    }
    // t e^(−(p + q) t/2) sinh(half)/half; the next term of the series is below 1e-16.
    let square = half * half;
    let sinhc = ((square / 42.0 + 1.0) * square / 20.0 + 1.0) * square / 6.0 + 1.0;
    (-(p + q) * (0.5 * t)).exp() * sinhc * t
}

/// `y[k] + den[1] y[k−1] + den[2] y[k−2] = num[0] x[k] + num[1] x[k−1] + num[2] x[k−2]`,
/// `den[0] = 1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SecondOrderCoefficients<D> {
    /// Coefficients of `x[k]`, `x[k−1]`, `x[k−2]`.
    pub numerator: [D; 3],
    /// Coefficients of `y[k]`, `y[k−1]`, `y[k−2]`.
    pub denominator: [D; 3],
}

/// `y[k] + den[1] y[k−1] = num[0] x[k] + num[1] x[k−1]`, `den[0] = 1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstOrderCoefficients<D> {
    /// Coefficients of `x[k]`, `x[k−1]`.
    pub numerator: [D; 2],
    /// Coefficients of `y[k]`, `y[k−1]`.
    pub denominator: [D; 2],
}

/// A polynomial in the delay, of degree two at most.
#[derive(Clone, Copy, PartialEq)]
struct Polynomial {
    /// Zero from `len` on.
    padded: [f64; 3],
    len: usize,
}

impl Polynomial {
    fn new(coefficients: &[f64]) -> Self {
        let mut padded = [0.0; 3];
        padded[..coefficients.len()].copy_from_slice(coefficients);
        Self { padded, len: coefficients.len() }
    }

    fn coefficients(&self) -> &[f64] {
        &self.padded[..self.len]
    }

    fn times(&self, other: &Self) -> Self {
        let mut padded = [0.0; 3];
        for (i, a) in self.coefficients().iter().enumerate() {
            for (j, b) in other.coefficients().iter().enumerate() {
                padded[i + j] += a * b;
            }
        }
        Self { padded, len: self.len + other.len - 1 }
    }

    fn plus(&self, other: &Self) -> Self {
        let padded = core::array::from_fn(|i| self.padded[i] + other.padded[i]);
        Self { padded, len: self.len.max(other.len) }
    }

    fn scaled(&self, weight: f64) -> Self {
        Self { padded: self.padded.map(|c| weight * c), len: self.len }
    }
}

impl fmt::Debug for Polynomial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.coefficients()).finish()
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;
    use crate::{FirstOrder, Lag, SecondOrder, SlowMode};

    fn all() -> Vec<Box<dyn Lag>> {
        vec![
            Box::new(FirstOrder::new(0.05, 0.004).expect("valid")),
            Box::new(SecondOrder::new(0.05, 0.011, 0.004).expect("valid")),
            Box::new(SlowMode::new(0.02, 0.2, 0.5, 0.004).expect("valid")),
        ]
    }

    /// Sums of at most four terms of size one: rounding, 1e-12 with room to spare.
    #[test]
    fn every_discretisation_has_unit_static_gain() {
        for lag in all() {
            for kind in [Discretisation::ZeroOrderHold, Discretisation::FirstOrderHold, Discretisation::Bilinear] {
                let gain = lag.difference_equation(kind).expect("exists").frequency_response(0.0, 0.004);
                assert!((gain - 1.0).norm() < 1e-12, "{kind:?}: {gain}");
            }
        }
    }

    /// A ramp held piecewise linear is itself, so the first-order-hold answer is the exact ramp
    /// response `t − τ (1 − exp(−t/τ))`.
    #[test]
    fn first_order_hold_answers_a_ramp_exactly() {
        let equation = FirstOrder::new(0.05, 0.004)
            .expect("valid")
            .difference_equation(Discretisation::FirstOrderHold)
            .expect("ok");
        let t: Vec<f64> = (0..300).map(|k| f64::from(k) * 0.004).collect();
        for (got, &t) in equation.respond(&t).iter().zip(&t) {
            let want = t + 0.05 * (-t / 0.05_f64).exp_m1();
            assert!((got - want).abs() < 1e-14, "t = {t}: got {got}, want {want}");
        }
    }

    /// A tone of `w = ω Ts = 2π/500` per sample: the trapezoidal rule and the first-order hold err
    /// by `w²/12` of the response per pole, the zero-order hold (half a period of delay taken out)
    /// by its first image, `w (Ts/τ)/12` per pole. Twice the sum over two poles, the faster of 11
    /// ms, is allowed.
    #[test]
    fn slow_tones_are_answered_as_in_continuous_time() {
        let (hz, period, fastest) = (0.5, 0.004, 0.011);
        let w = std::f64::consts::TAU * hz * period;
        for lag in all() {
            let want = lag.continuous_response(hz);
            for kind in [Discretisation::ZeroOrderHold, Discretisation::FirstOrderHold, Discretisation::Bilinear] {
                let mut got = lag.difference_equation(kind).expect("exists").frequency_response(hz, period);
                let mut tol = w * w / 3.0;
                if kind == Discretisation::ZeroOrderHold {
                    got *= Complex64::from_polar(1.0, 0.5 * w);
                    tol += w * period / fastest / 3.0;
                }
                assert!((got / want - 1.0).norm() < tol, "{kind:?}: got {got}, want {want} within {tol:e}");
            }
        }
    }

    /// The partial fractions of [`SecondOrder`], which lose digits to the cancellation of their
    /// poles, here 1/0.78: rounding of the fractions, and of `1 − r(T)/T`, which loses a factor
    /// `(τ/Ts)²` = 150 in the first-order hold; 1e-12.
    #[test]
    fn second_order_coefficients_are_those_of_the_partial_fractions() {
        let (tau, second, period) = (0.05, 0.011, 0.004);
        for kind in [Discretisation::ZeroOrderHold, Discretisation::FirstOrderHold, Discretisation::Bilinear] {
            let want = SecondOrder::new(tau, second, period).expect("valid").difference_equation(kind).expect("exists");
            let got = kind.second_order(tau, second, period).expect("exists");
            for j in 0..3 {
                for (got, want) in
                    [(got.numerator[j], want.numerator()[j]), (got.denominator[j], want.denominator()[j])]
                {
                    assert!((got - want).abs() < 1e-12, "{kind:?}, {j}: got {got}, want {want}");
                }
            }
        }
    }

    /// On both sides of the switch from series to quotient, and with equal poles, the coefficients
    /// are smooth in the time constants: the mean of two neighbours 1e-6 apart differs from the
    /// middle by the second derivative, 1e-12 of the size.
    #[test]
    fn equal_and_nearly_equal_poles_are_no_special_case() {
        let period = 0.004;
        for kind in [Discretisation::ZeroOrderHold, Discretisation::FirstOrderHold] {
            let tau: f64 = 0.01;
            // (q − p)/2 = 0.05 in units of the period, where the formula changes, and equality.
            let switch = 1.0 / (1.0 / tau + 0.1 / period);
            for second in [switch, tau] {
                let at = |t: f64| kind.second_order(tau, t, period).expect("exists").numerator;
                let (low, middle, high) = (at(second * (1.0 - 1e-6)), at(second), at(second * (1.0 + 1e-6)));
                for j in 0..3 {
                    let mean = 0.5 * (low[j] + high[j]);
                    assert!((mean - middle[j]).abs() < 1e-11, "{kind:?} {second} {j}: {mean} and {}", middle[j]);
                }
            }
        }
    }

    #[test]
    fn band_limited_has_no_difference_equation_and_says_so() {
        let sensor = FirstOrder::new(0.05, 0.004).expect("valid");
        assert_eq!(sensor.difference_equation(Discretisation::BandLimited), Err(ModelError::NoDifferenceEquation));
    }
}

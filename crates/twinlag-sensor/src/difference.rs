//! From the continuous sensor to a difference equation, and what each way of doing it assumes of the gas between samples.

use num_complex::Complex64;
use num_dual::DualNum;
use serde::{Deserialize, Serialize};

use crate::error::ModelError;

/// What the gas temperature is taken to do between two samples.
///
/// A real gas does none of these exactly. What the choice costs a blind estimate is [`crate::tone_floor`]; it falls with
/// the square of the sample period for the zero-order hold and the bilinear rule, with its fourth power for the first-order
/// hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Discretisation {
    /// Constant until the next sample, as the published method has it: `y[k] = a y[k−1] + (1 − a) x[k−1]`.
    #[default]
    ZeroOrderHold,
    /// Straight line between samples: exact for a piecewise linear gas temperature.
    FirstOrderHold,
    /// Trapezoidal rule, `s = (2/Ts)(1 − z⁻¹)/(1 + z⁻¹)`. A pair of sensors shares the factor `1 + z⁻¹`, so for blind work
    /// this is the zero-order hold with `τ` stretched: `Ts/2 / tanh(Ts/2τ)` in place of `τ`.
    Bilinear,
    /// No power above half the sampling rate: the continuous frequency response itself. It has no difference equation.
    BandLimited,
}

/// `y[k] = Σ_j num[j] x[k−j] − Σ_{j≥1} den[j] y[k−j]`, `den[0] = 1`, unit static gain.
#[derive(Clone, Debug, PartialEq)]
pub struct DifferenceEquation {
    numerator: Vec<f64>,
    denominator: Vec<f64>,
}

impl DifferenceEquation {
    /// Coefficients of `x[k], x[k−1], …`.
    pub fn numerator(&self) -> &[f64] {
        &self.numerator
    }

    /// Coefficients of `y[k], y[k−1], …`, the first of them 1.
    pub fn denominator(&self) -> &[f64] {
        &self.denominator
    }

    /// Reading in gas of temperature `x`, `[n]` to `[n]`, at rest at `x[0]` before the first sample.
    pub fn respond(&self, x: &[f64]) -> Vec<f64> {
        let mut y: Vec<f64> = Vec::with_capacity(x.len());
        let Some(&rest) = x.first() else { return y };
        for k in 0..x.len() {
            let input: f64 = past(&self.numerator, x, k, rest);
            let output: f64 = self.denominator[1..]
                .iter()
                .enumerate()
                .map(|(j, d)| d * if k > j { y[k - 1 - j] } else { rest })
                .sum();
            y.push(input - output);
        }
        y
    }

    /// Frequency response at `frequency_hz` for samples `period_s` apart.
    pub fn frequency_response(&self, frequency_hz: f64, period_s: f64) -> Complex64 {
        let delay = Complex64::from_polar(1.0, -std::f64::consts::TAU * frequency_hz * period_s);
        at(&self.numerator, delay) / at(&self.denominator, delay)
    }
}

fn past(coefficients: &[f64], x: &[f64], k: usize, rest: f64) -> f64 {
    coefficients.iter().enumerate().map(|(j, c)| c * if k >= j { x[k - j] } else { rest }).sum()
}

fn at(coefficients: &[f64], delay: Complex64) -> Complex64 {
    coefficients.iter().rev().fold(Complex64::ZERO, |sum, &c| sum * delay + c)
}

impl Discretisation {
    /// The difference equation of `G(s) = Σ r_i / (1 + s τ_i)`, given `(r_i, τ_i)` with `Σ r_i = 1` and distinct `τ_i`.
    pub(crate) fn of_modes(self, modes: &[(f64, f64)], period_s: f64) -> Result<DifferenceEquation, ModelError> {
        let mut numerator = vec![0.0];
        let mut denominator = vec![1.0];
        for &(weight, tau_s) in modes {
            let (num, den) = self.of_mode(tau_s, period_s)?;
            let ours: Vec<f64> = product(&num, &denominator).iter().map(|c| weight * c).collect();
            numerator = sum(&product(&numerator, &den), &ours);
            denominator = product(&denominator, &den);
        }
        Ok(DifferenceEquation { numerator, denominator })
    }

    fn of_mode(self, tau_s: f64, period_s: f64) -> Result<(Vec<f64>, Vec<f64>), ModelError> {
        let FirstOrderCoefficients { numerator, denominator } =
            self.first_order(tau_s, period_s).ok_or(ModelError::NoDifferenceEquation)?;
        Ok((numerator.to_vec(), denominator.to_vec()))
    }

    /// Coefficients of the first-order sensor of time constant `tau_s` (s), `None` for [`Discretisation::BandLimited`].
    ///
    /// Generic over dual numbers, so that a cost gets exact derivatives with respect to `tau_s` from the one formula.
    pub fn first_order<D: DualNum<Primitive = f64> + Copy>(
        self,
        tau_s: D,
        period_s: f64,
    ) -> Option<FirstOrderCoefficients<D>> {
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

/// `y[k] + den[1] y[k−1] = num[0] x[k] + num[1] x[k−1]`, `den[0] = 1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstOrderCoefficients<D> {
    /// Coefficients of `x[k]`, `x[k−1]`.
    pub numerator: [D; 2],
    /// Coefficients of `y[k]`, `y[k−1]`.
    pub denominator: [D; 2],
}

fn product(p: &[f64], q: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; p.len() + q.len() - 1];
    for (i, a) in p.iter().enumerate() {
        for (j, b) in q.iter().enumerate() {
            out[i + j] += a * b;
        }
    }
    out
}

fn sum(p: &[f64], q: &[f64]) -> Vec<f64> {
    (0..p.len().max(q.len())).map(|i| p.get(i).unwrap_or(&0.0) + q.get(i).unwrap_or(&0.0)).collect()
}

#[cfg(test)]
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

    /// A ramp held piecewise linear is itself, so the first-order-hold answer is the exact ramp response
    /// `t − τ (1 − exp(−t/τ))`.
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

    /// A tone of `w = ω Ts = 2π/500` per sample: the trapezoidal rule and the first-order hold err by `w²/12` of the response
    /// per pole, the zero-order hold (half a period of delay taken out) by its first image, `w (Ts/τ)/12` per pole. Twice
    /// the sum over two poles, the faster of 11 ms, is allowed.
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

    #[test]
    fn band_limited_has_no_difference_equation_and_says_so() {
        let sensor = FirstOrder::new(0.05, 0.004).expect("valid");
        assert_eq!(sensor.difference_equation(Discretisation::BandLimited), Err(ModelError::NoDifferenceEquation));
    }
}

//! First-order sensor, unit static gain: `τ dy/dt = x − y`. With `x` held over one period `Ts`
//! (zero-order hold) this is *exactly* `y[k] = a y[k−1] + (1 − a) x[k−1]`, `a = exp(−Ts/τ)`.
//! Derivation: docs, chapter "Theory", section 1.

use num_complex::Complex64;
#[cfg(not(any(feature = "std", test)))]
use num_traits::Float as _;
use serde::{Deserialize, Serialize};

use crate::Lag;
use crate::difference::{DifferenceEquation, Discretisation};
use crate::error::{ModelError, positive};
use crate::stream::{FirstOrderInverter, FirstOrderResponder};

/// A first-order sensor read at a fixed rate. Both fields are finite and positive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked")]
pub struct FirstOrder {
    tau_s: f64,
    period_s: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Unchecked {
    tau_s: f64,
    period_s: f64,
}

impl TryFrom<Unchecked> for FirstOrder {
    type Error = ModelError;

    fn try_from(raw: Unchecked) -> Result<Self, ModelError> {
        Self::new(raw.tau_s, raw.period_s)
    }
}

impl FirstOrder {
    /// A sensor of time constant `tau_s` read every `period_s`.
    ///
    /// # Errors
    /// [`ModelError::NotPositive`] if either is not finite and positive.
    pub fn new(tau_s: f64, period_s: f64) -> Result<Self, ModelError> {
        Ok(Self { tau_s: positive("time constant", tau_s)?, period_s: positive("sample period", period_s)? })
    }

    /// The sensor whose zero-order-hold pole is `pole`: `τ = −Ts / ln a`.
    ///
    /// # Errors
    /// [`ModelError::Pole`] unless `0 < pole < 1`; [`ModelError::NotPositive`] for the period.
    pub fn from_pole(pole: f64, period_s: f64) -> Result<Self, ModelError> {
        if pole > 0.0 && pole < 1.0 {
            Self::new(-period_s / pole.ln(), period_s)
        } else {
            Err(ModelError::Pole { value: pole })
        }
    }

    /// Time constant `τ`, s.
    pub fn tau_s(&self) -> f64 {
        self.tau_s
    }

    /// Sample period `Ts`, s.
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Zero-order-hold pole `a = exp(−Ts/τ)`, in (0, 1).
    pub fn pole(&self) -> f64 {
        (-self.period_s / self.tau_s).exp()
    }

    /// `1 − a`, to full precision also where `τ ≫ Ts`.
    pub fn input_gain(&self) -> f64 {
        -(-self.period_s / self.tau_s).exp_m1()
    }

    /// Variance of the output per unit variance of white input noise: `h = (1 − a)/(1 + a)`, in (0,
    /// 1).
    pub fn noise_gain(&self) -> f64 {
        // The same number as `(1 − a)/(1 + a)`, without `1 − a`, which loses half the digits at τ =
        // 10⁸ Ts.
        (self.period_s / (2.0 * self.tau_s)).tanh()
    }

    /// Reading of the sensor in gas of temperature `x` (any unit, `[n]`), held between samples and
    /// constant at `x[0]` before the first: `y[0] = x[0]`, `y[k] = a y[k−1] + (1 − a) x[k−1]`.
    #[cfg(feature = "std")]
    pub fn respond(&self, x: &[f64]) -> Vec<f64> {
        let mut responder = self.responder();
        x.iter().map(|&gas| responder.push(gas)).collect()
    }

    /// The reading computed sample by sample, in constant memory.
    pub fn responder(&self) -> FirstOrderResponder {
        FirstOrderResponder::new(self.input_gain())
    }

    /// Gas temperature that the reading `y` (`[n]`) implies, `[n − 1]`:
    /// `f[k] = (y[k+1] − a y[k])/(1 − a)`.
    ///
    /// Exact inverse of [`FirstOrder::respond`], whatever the state before the first sample.
    /// Measurement noise is amplified by `(1 + a²)/(1 − a)²` in variance.
    #[cfg(feature = "std")]
    pub fn invert(&self, y: &[f64]) -> Vec<f64> {
        let mut inverter = self.inverter();
        y.iter().filter_map(|&reading| inverter.push(reading)).collect()
    }

    /// The gas temperature computed from readings sample by sample, in constant memory.
    pub fn inverter(&self) -> FirstOrderInverter {
        FirstOrderInverter::new(self.input_gain())
    }
}

impl Lag for FirstOrder {
    fn continuous_response(&self, frequency_hz: f64) -> Complex64 {
        Complex64::new(1.0, core::f64::consts::TAU * frequency_hz * self.tau_s).inv()
    }

    fn difference_equation(&self, discretisation: Discretisation) -> Result<DifferenceEquation, ModelError> {
        discretisation.of_modes(&[(1.0, self.tau_s)], self.period_s)
    }

    fn period_s(&self) -> f64 {
        self.period_s
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;

    fn sensor() -> FirstOrder {
        FirstOrder::new(0.0238, 0.002).expect("valid sensor")
    }

    /// A cheap unit-variance uniform sequence; its quality does not matter to the claims below.
    fn unit_uniform_noise(n: usize) -> Vec<f64> {
        let mut state = 0x9E37_79B9_7F4A_7C15_u64;
        (0..n)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let unit = (state >> 11) as f64 / (1_u64 << 53) as f64;
                (unit - 0.5) * 12.0_f64.sqrt()
            })
            .collect()
    }

    /// The output is AR(1), so over `n` points its mean square has standard error
    /// `h √(2 (1 + a²) / ((1 − a²) n))` for Gaussian input (Bartlett), less for uniform. Four of
    /// these are 3 % of `h`: a lost `1 + a` fails, the truth passes.
    #[test]
    fn noise_gain_is_the_variance_of_filtered_white_noise() {
        let n = 400_000;
        let (a, want) = (sensor().pole(), sensor().noise_gain());
        let y = sensor().respond(&unit_uniform_noise(n));
        let got = y.iter().map(|v| v * v).sum::<f64>() / n as f64;
        let tol = 4.0 * want * (2.0 * (1.0 + a * a) / ((1.0 - a * a) * n as f64)).sqrt();
        assert!((got - want).abs() < tol, "got {got:e}, want {want:e} ± {tol:e}");
    }

    /// A step seen by a first-order lag is `1 − exp(−t/τ)`, sampled: the textbook's closed form, to
    /// rounding.
    #[test]
    fn a_held_step_is_answered_by_the_exponential() {
        let mut x = vec![1.0; 200];
        x[0] = 0.0;
        let y = sensor().respond(&x);
        for (k, got) in y.iter().enumerate().skip(1) {
            let want = -(-((k - 1) as f64) * 0.002 / 0.0238_f64).exp_m1();
            assert!((got - want).abs() < 1e-13, "sample {k}: got {got}, want {want}");
        }
    }

    /// Each step of the inverse divides rounding errors of size `ε |y|` by `1 − a = 0.08`: some
    /// `2⁻⁵² · 2 / 0.08 ≈ 6e-15`.
    #[test]
    fn invert_undoes_respond() {
        let x = unit_uniform_noise(1000);
        let back = sensor().invert(&sensor().respond(&x));
        assert_eq!(back.len(), x.len() - 1);
        let worst = x.iter().zip(&back).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 2e-14, "largest difference {worst:e}");
    }

    #[test]
    fn a_pole_and_its_time_constant_are_the_same_sensor() {
        let again = FirstOrder::from_pole(sensor().pole(), 0.002).expect("valid pole");
        assert!((again.tau_s() / 0.0238 - 1.0).abs() < 1e-14);
    }

    #[test]
    fn impossible_sensors_are_refused_by_name() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let message = FirstOrder::new(bad, 0.1).expect_err("not a time constant").to_string();
            assert!(message.contains("time constant"), "{message}");
        }
        assert!(FirstOrder::from_pole(1.0, 0.1).is_err());
    }

    #[test]
    fn empty_and_single_readings_are_no_panic() {
        assert!(sensor().respond(&[]).is_empty());
        assert_eq!(sensor().respond(&[3.0]), [3.0]);
        assert!(sensor().invert(&[3.0]).is_empty());
    }
}

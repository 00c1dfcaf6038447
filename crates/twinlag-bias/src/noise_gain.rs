//! How much of the noise at its input a synthetic filter passes.

use num_dual::Dual2SVec64;
use twinlag_cross_relation::{CostValue, synthetic_filter};

use crate::error::NoiseError;

/// Measurement noise of one channel, as far as the cost's expectation needs it.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Autocovariance at lags 0, 1, 2, …, K²; zero beyond.
    autocovariance: Vec<f64>,
}

impl Noise {
    /// White noise of standard deviation `std_k` (K).
    ///
    /// # Errors
    /// [`NoiseError::Negative`] unless it is finite and not negative.
    pub fn white(std_k: f64) -> Result<Self, NoiseError> {
        if std_k.is_finite() && std_k >= 0.0 {
            Ok(Self { autocovariance: vec![std_k * std_k] })
        } else {
            Err(NoiseError::Negative { name: "noise standard deviation", value: std_k })
        }
    }

    /// Coloured noise of the given autocovariance at lags 0, 1, 2, … samples (K²), zero beyond the
    /// last.
    ///
    /// ```
    /// use twinlag_bias::Noise;
    ///
    /// // Both have a variance of 0.04 K²; the second keeps half of its value from sample to
    /// // sample.
    /// let white = Noise::white(0.2)?;
    /// let slow = Noise::coloured((0..40).map(|lag| 0.04 * 0.5_f64.powi(lag)).collect())?;
    /// // A sensor of 24 ms read every 2 ms lets 4 % of white noise through, and nearly three times
    /// // as much of the other: (1 + φ p)/(1 − φ p) with φ = 1/2 and p = e^(−1/12).
    /// let p = (-1.0_f64 / 12.0).exp();
    /// let ratio = slow.passed(0.024, 0.002)[0] / white.passed(0.024, 0.002)[0];
    /// assert!((ratio - (1.0 + 0.5 * p) / (1.0 - 0.5 * p)).abs() < 1e-11); // the series ends at 2⁻⁴⁰
    /// # Ok::<(), twinlag_bias::NoiseError>(())
    /// ```
    ///
    /// # Errors
    /// [`NoiseError::Negative`] for a variance that is no variance, [`NoiseError::Autocovariance`]
    /// for a lag larger than it.
    pub fn coloured(autocovariance: Vec<f64>) -> Result<Self, NoiseError> {
        let variance = autocovariance.first().copied().unwrap_or(f64::NAN);
        if !(variance.is_finite() && variance >= 0.0) {
            return Err(NoiseError::Negative { name: "noise variance", value: variance });
        }
        match autocovariance.iter().enumerate().find(|(_, v)| v.is_nan() || v.abs() > variance) {
            Some((lag, &value)) => Err(NoiseError::Autocovariance { lag, value, variance }),
            None => Ok(Self { autocovariance }),
        }
    }

    /// Variance of the noise, K².
    pub(crate) fn variance(&self) -> f64 {
        self.autocovariance[0]
    }

    /// Variance that this noise leaves behind the filter `(1 − p) z⁻¹/(1 − p z⁻¹)`,
    /// `p = exp(−Ts/τ)`, with its first two derivatives with respect to `τ`.
    ///
    /// `σ² = h(p) (r[0] + 2 Σ_l r[l] p^l)`, `h(p) = (1 − p)/(1 + p)`: the noise's autocovariance
    /// times the autocorrelation `h p^l` of the impulse response, summed over lags of both signs.
    /// For white noise `r[0] h(p)`.
    ///
    /// # Source
    /// Own derivation, docs, chapter "Theory", section 2.
    pub fn passed(&self, tau_s: f64, period_s: f64) -> [f64; 3] {
        let pole = (-period_s / tau_s).exp();
        // Horner's rule for the polynomial in the pole and its derivatives.
        let (mut sum, mut slope, mut bend) = (0.0, 0.0, 0.0);
        for (lag, r) in self.autocovariance.iter().enumerate().rev() {
            bend = bend * pole + 2.0 * slope;
            slope = slope * pole + sum;
            sum = sum * pole + if lag == 0 { *r } else { 2.0 * r };
        }
        let h = (period_s / (2.0 * tau_s)).tanh();
        let [dh, ddh] = [-2.0 / (1.0 + pole).powi(2), 4.0 / (1.0 + pole).powi(3)];
        let value = h * sum;
        let by_pole = dh * sum + h * slope;
        let by_pole2 = ddh * sum + 2.0 * dh * slope + h * bend;
        let dp = pole * period_s / (tau_s * tau_s);
        let ddp = dp * (period_s / tau_s - 2.0) / tau_s;
        [value, by_pole * dp, by_pole2 * dp * dp + by_pole * ddp]
    }

    /// Variance that this noise leaves behind the filter of second order
    /// `(n1 z⁻¹ + n2 z⁻²)/(1 + d1 z⁻¹ + d2 z⁻²)` ([`synthetic_filter`]), with gradient and Hessian
    /// with respect to `[τ, τ₂]` (s).
    ///
    /// `σ² = r[0] ρ[0] + 2 Σ_l r[l] ρ[l]` with the autocorrelation `ρ` of the impulse response:
    /// `ρ[0] = ((n1 + n2)(1 + d2) − 2 n1 n2)/((1 − d2)(1 − d1 + d2))`, the noise gain, then
    /// `ρ[1] = (n1 n2 − d1 ρ[0])/(1 + d2)` and `ρ[l] = −d1 ρ[l−1] − d2 ρ[l−2]`. `second_tau_s = 0`
    /// is the filter of first order.
    ///
    /// # Source
    /// Own derivation (Yule-Walker equations), docs, chapter "Theory", section 2.
    pub fn passed_second_order(&self, tau_s: f64, second_tau_s: f64, period_s: f64) -> CostValue<2> {
        let filter = synthetic_filter(tau_s, second_tau_s, period_s);
        let ([_, n1, n2], [_, d1, d2]) = (filter.numerator, filter.denominator);
        // With unit static gain 1 + d1 + d2 = n1 + n2, so that this needs no difference of nearly
        // equal numbers.
        let gain = ((n1 + n2) * (d2 + 1.0) - n1 * n2 * 2.0) / ((-d2 + 1.0) * (d2 - d1 + 1.0));
        let mut next = (n1 * n2 - d1 * gain) / (d2 + 1.0);
        let mut now = gain;
        let mut sum = gain * self.autocovariance[0];
        for r in &self.autocovariance[1..] {
            sum += next * (2.0 * r);
            (now, next) = (next, -d1 * next - d2 * now);
        }
        let (gradient, hessian) = derivatives(&sum);
        CostValue { value: sum.re, gradient, hessian }
    }
}

/// Gradient and Hessian of a dual number.
pub(crate) fn derivatives(x: &Dual2SVec64<2>) -> ([f64; 2], [[f64; 2]; 2]) {
    let first = x.v1.unwrap_generic(nalgebra::U1, nalgebra::Const::<2>);
    let second = x.v2.unwrap_generic(nalgebra::Const::<2>, nalgebra::Const::<2>);
    ([0, 1].map(|i| first[i]), [0, 1].map(|i| [0, 1].map(|j| second[(i, j)])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use twinlag_sensor::FirstOrder;

    #[test]
    fn white_noise_passes_by_the_noise_gain_of_the_sensor() {
        let [got, ..] = Noise::white(0.7).expect("valid").passed(0.0238, 0.002);
        let want = 0.49 * FirstOrder::new(0.0238, 0.002).expect("valid").noise_gain();
        assert!((got / want - 1.0).abs() < 1e-14, "got {got}, want {want}");
    }

    /// AR(1) noise of coefficient `φ` behind the filter is AR(2); its variance in closed form is
    /// `r0 h (1 + φ p)/(1 − φ p)`. The series is cut where `φ^l` is 1e-18.
    #[test]
    fn autoregressive_noise_passes_by_the_closed_form() {
        let (phi, tau, period) = (0.6_f64, 0.0238_f64, 0.002_f64);
        let noise = Noise::coloured((0..80).map(|l| 0.25 * phi.powi(l)).collect()).expect("valid");
        let p = (-period / tau).exp();
        let want = 0.25 * (1.0 - p) / (1.0 + p) * (1.0 + phi * p) / (1.0 - phi * p);
        let [got, ..] = noise.passed(tau, period);
        assert!((got / want - 1.0).abs() < 1e-12, "got {got}, want {want}");
    }

    /// Central differences of step 1e-5 in `ln τ`: truncation 1e-10, rounding 1e-11 for the first
    /// and 1e-6 for the second.
    #[test]
    fn derivatives_are_those_of_the_value() {
        let noise = Noise::coloured(vec![0.25, 0.1, -0.05, 0.02]).expect("valid");
        for tau in [0.001_f64, 0.0238, 0.5] {
            let h = 1e-5 * tau;
            let [down, mid, up] = [tau - h, tau, tau + h].map(|t| noise.passed(t, 0.002));
            let first = (up[0] - down[0]) / (2.0 * h);
            let second = (up[1] - down[1]) / (2.0 * h);
            assert!((mid[1] / first - 1.0).abs() < 1e-7, "τ = {tau}: got {}, want {first}", mid[1]);
            assert!((mid[2] / second - 1.0).abs() < 1e-6, "τ = {tau}: got {}, want {second}", mid[2]);
        }
    }

    /// `w = A aᵏ + C cᵏ` with distinct poles has the sum of squares
    /// `A² a²/(1 − a²) + 2 A C a c/(1 − a c) + C² c²/(1 − c²)`, and the same at lag `l` with `aˡ`,
    /// `cˡ` in place of one factor. The residues follow from the partial fractions of the sensor,
    /// `A = τ/(τ − τ₂) (1 − a)/a`, `C = −τ₂/(τ − τ₂) (1 − c)/c`. Rounding is amplified by
    /// `1/(1 − a²)`, some 100.
    #[test]
    fn second_order_noise_gain_is_the_closed_form_of_distinct_poles() {
        for (tau, second) in [(0.0238_f64, 0.009_f64), (0.0238, 0.0005), (0.005, 0.12)] {
            let period = 0.002;
            let [a, c] = [tau, second].map(|t| (-period / t).exp());
            let residues =
                [(tau / (tau - second), a), (-second / (tau - second), c)].map(|(part, p)| part * (1.0 - p) / p);
            let autocorrelation = |lag: i32| -> f64 {
                let pair = |i: usize, j: usize| {
                    let (p, q) = ([a, c][i], [a, c][j]);
                    residues[i] * residues[j] * p * q / (1.0 - p * q) * q.powi(lag)
                };
                pair(0, 0) + pair(0, 1) + pair(1, 0) + pair(1, 1)
            };
            let r = [0.25, 0.1, -0.05, 0.02];
            let want: f64 = (0..4).map(|l| r[l] * autocorrelation(l as i32) * if l == 0 { 1.0 } else { 2.0 }).sum();
            let noise = Noise::coloured(r.to_vec()).expect("valid");
            let got = noise.passed_second_order(tau, second, period).value;
            assert!((got / want - 1.0).abs() < 1e-11, "τ = {tau}, {second}: got {got:e}, want {want:e}");
        }
    }

    /// Equal poles have no such form: here 100 000 samples of white noise behind the simulated
    /// sensor. The output is correlated over some `2τ/Ts` = 10 samples to either side, so its mean
    /// square has a relative standard error of about `√(2 · 15/n)` = 1.7 %; four of these. The
    /// first-order noise gain, 0.1, is twice as large.
    #[test]
    fn critically_damped_noise_gain_is_that_of_a_simulation() {
        use rand::SeedableRng;
        use rand_distr::{Distribution, StandardNormal};
        use twinlag_sensor::{Discretisation, Lag, SecondOrder};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let noise: Vec<f64> = (0..100_000).map(|_| StandardNormal.sample(&mut rng)).collect();
        let sensor = SecondOrder::new(0.01, 0.01, 0.002).expect("valid");
        let passed = sensor.difference_equation(Discretisation::ZeroOrderHold).expect("exists").respond(&noise);
        let want = passed[100..].iter().map(|y| y * y).sum::<f64>() / (passed.len() - 100) as f64;
        let got = Noise::white(1.0).expect("valid").passed_second_order(0.01, 0.01, 0.002).value;
        assert!((got / want - 1.0).abs() < 0.07, "got {got}, simulated {want}");
    }

    #[test]
    fn without_a_second_lag_the_noise_gain_is_that_of_first_order() {
        let noise = Noise::coloured(vec![0.25, 0.1, -0.05, 0.02]).expect("valid");
        let (got, want) = (noise.passed_second_order(0.0238, 0.0, 0.002), noise.passed(0.0238, 0.002));
        for (got, want) in [got.value, got.gradient[0], got.hessian[0][0]].into_iter().zip(want) {
            assert!((got / want - 1.0).abs() < 1e-12, "got {got}, want {want}");
        }
        assert_eq!(got.gradient[1], 0.0);
    }

    #[test]
    fn what_is_no_noise_is_refused() {
        assert!(Noise::white(-1.0).is_err() && Noise::white(f64::NAN).is_err());
        assert!(Noise::coloured(vec![]).is_err());
        let message = Noise::coloured(vec![1.0, 0.5, -1.5]).expect_err("lag 2 exceeds the variance").to_string();
        assert!(message.contains("lag 2"), "{message}");
    }
}

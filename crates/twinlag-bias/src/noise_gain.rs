//! What a synthetic filter lets through of the noise at its input.

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

    /// Coloured noise of the given autocovariance at lags 0, 1, 2, … samples (K²), zero beyond the last.
    ///
    /// # Errors
    /// [`NoiseError::Negative`] for a variance that is no variance, [`NoiseError::Autocovariance`] for a lag larger than it.
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

    /// Variance that this noise leaves behind the filter `(1 − p) z⁻¹/(1 − p z⁻¹)`, `p = exp(−Ts/τ)`, with its first two
    /// derivatives with respect to `τ`.
    ///
    /// `σ² = h(p) (r[0] + 2 Σ_l r[l] p^l)`, `h(p) = (1 − p)/(1 + p)`: the noise's autocovariance times the autocorrelation
    /// `h p^l` of the impulse response, summed over lags of both signs. For white noise `r[0] h(p)`.
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

    /// Central differences of step 1e-5 in `ln τ`: truncation 1e-10, rounding 1e-11 for the first and 1e-6 for the second.
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

    #[test]
    fn what_is_no_noise_is_refused() {
        assert!(Noise::white(-1.0).is_err() && Noise::white(f64::NAN).is_err());
        assert!(Noise::coloured(vec![]).is_err());
        let message = Noise::coloured(vec![1.0, 0.5, -1.5]).expect_err("lag 2 exceeds the variance").to_string();
        assert!(message.contains("lag 2"), "{message}");
    }
}

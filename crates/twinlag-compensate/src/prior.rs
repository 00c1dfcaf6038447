//! What is believed of the gas before the readings are looked at: how much it moves, and how fast.
//!
//! A sum of stationary processes, each with a few numbers and a state of one or two dimensions. Its
//! spectrum is a sum of resonances and of one-over-frequency-squared falls, which is enough for
//! turbulence, steps and pulsation; what the gas really did is then up to the readings, as far as
//! they go.

#[cfg(feature = "std")]
use serde::{Deserialize, Serialize};

/// One part of the gas's motion.
///
/// ```
/// use twinlag_compensate::Term;
///
/// let rough = Term::Rough { std_k: 3.0, corner_hz: 2.0 };
/// // One over the corner in radians later, 1/e of the variance is left; at the corner half of the
/// // density at rest.
/// let memory_s = 1.0 / (std::f64::consts::TAU * 2.0);
/// assert!((rough.autocovariance_k2(memory_s) - 9.0 / std::f64::consts::E).abs() < 1e-12);
/// assert!((rough.density_k2_per_hz(2.0) / rough.density_k2_per_hz(0.0) - 0.5).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "std", derive(Serialize, Deserialize), serde(tag = "kind", rename_all = "kebab-case"))]
pub enum Term {
    /// First-order noise (Ornstein and Uhlenbeck 1930), autocovariance `σ² exp(−2π f |t|)`: rough,
    /// like turbulence or steps.
    Rough {
        /// Standard deviation `σ`, K.
        std_k: f64,
        /// Corner `f`, Hz, above which the spectrum falls as `1/f²`.
        corner_hz: f64,
    },
    /// An oscillator driven by white noise, spectrum `∝ 1/((f² − f₀²)² + (f f₀/Q)²)`: a line where
    /// the quality `Q` is high, a smooth process whose spectrum falls as `1/f⁴` where it is low.
    Resonance {
        /// Standard deviation, K.
        std_k: f64,
        /// Frequency `f₀` of the undamped oscillator, Hz.
        frequency_hz: f64,
        /// Quality `Q`.
        quality: f64,
    },
}

impl Term {
    /// Numbers of the state.
    pub const fn states(&self) -> usize {
        match self {
            Self::Rough { .. } => 1,
            Self::Resonance { .. } => 2,
        }
    }

    /// Standard deviation, K.
    pub const fn std_k(&self) -> f64 {
        match self {
            Self::Rough { std_k, .. } | Self::Resonance { std_k, .. } => *std_k,
        }
    }

    /// Two-sided spectral density at `frequency_hz`, K²/Hz.
    #[inline]
    pub fn density_k2_per_hz(&self, frequency_hz: f64) -> f64 {
        use core::f64::consts::PI;
        match *self {
            Self::Rough { std_k, corner_hz } => {
                std_k * std_k * corner_hz / (PI * (corner_hz * corner_hz + frequency_hz * frequency_hz))
            }
            Self::Resonance { std_k, frequency_hz: f0, quality } => {
                let (square, width) = (frequency_hz * frequency_hz, f0 / quality);
                let away = square - f0 * f0;
                std_k * std_k * width * f0 * f0 / (PI * (away * away + square * width * width))
            }
        }
    }

    /// Autocovariance at `lag_s`, K².
    #[cfg(feature = "std")]
    pub fn autocovariance_k2(&self, lag_s: f64) -> f64 {
        use core::f64::consts::TAU;
        match *self {
            Self::Rough { std_k, corner_hz } => std_k * std_k * (-TAU * corner_hz * lag_s.abs()).exp(),
            Self::Resonance { std_k, frequency_hz, quality } => {
                let angle = TAU * frequency_hz * lag_s.abs();
                let half = 0.5 / quality;
                // e^(−h a) (cos(η a) + h/η sin(η a)), η² = 1 − h²; the sum of exponentials where
                // that is negative.
                let square = 1.0 - half * half;
                let eta = square.abs().sqrt();
                let shape = if eta * angle < 1e-6 {
                    (1.0 + half * angle) * (-half * angle).exp()
                } else if square > 0.0 {
                    let (sine, cosine) = (eta * angle).sin_cos();
                    (cosine + half / eta * sine) * (-half * angle).exp()
                } else {
                    let slow = 0.5 * (1.0 + half / eta) * ((eta - half) * angle).exp();
                    slow + 0.5 * (1.0 - half / eta) * (-(eta + half) * angle).exp()
                };
                std_k * std_k * shape
            }
        }
    }
}

/// The gas: a constant level and a sum of independent [`Term`]s about it.
#[cfg(feature = "std")]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Prior {
    /// The level, °C.
    pub level_c: f64,
    /// What moves about it.
    pub terms: Vec<Term>,
}

#[cfg(feature = "std")]
impl Prior {
    /// Two-sided spectral density of the gas about its level, K²/Hz.
    pub fn density_k2_per_hz(&self, frequency_hz: f64) -> f64 {
        self.terms.iter().map(|t| t.density_k2_per_hz(frequency_hz)).sum()
    }

    /// Variance of the gas's motion faster than `frequency_hz`, K².
    ///
    /// ```
    /// use twinlag_compensate::{Prior, Term};
    ///
    /// // Of first-order noise, half of the variance is above its corner.
    /// let prior = Prior { level_c: 300.0, terms: vec![Term::Rough { std_k: 4.0, corner_hz: 2.0 }] };
    /// assert!((prior.variance_above_k2(2.0) - 8.0).abs() < 0.01);
    /// ```
    pub fn variance_above_k2(&self, frequency_hz: f64) -> f64 {
        // The midpoint rule in ln f; beyond the last point first-order noise, which falls most slowly,
        // has 1e-4 of what it has above the first.
        const POINTS: i32 = 1000;
        let step = 1e4_f64.ln() / f64::from(POINTS);
        let at = |k: i32| frequency_hz * ((f64::from(k) + 0.5) * step).exp();
        2.0 * step * (0..POINTS).map(|k| at(k) * self.density_k2_per_hz(at(k))).sum::<f64>()
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;

    /// The autocovariance is the transform of the density (Wiener and Khinchin): the same rule, at
    /// a lag of 0.03 s.
    #[test]
    fn autocovariances_are_transforms_of_densities() {
        for quality in [0.3, 0.5, 0.8, 5.0] {
            let term = Term::Resonance { std_k: 3.0, frequency_hz: 5.0, quality };
            let (step_hz, points, lag_s) = (0.01, 400_000, 0.03);
            let sum: f64 = (0..points)
                .map(|k| (f64::from(k) + 0.5) * step_hz)
                .map(|hz| 2.0 * term.density_k2_per_hz(hz) * (core::f64::consts::TAU * hz * lag_s).cos() * step_hz)
                .sum();
            let got = term.autocovariance_k2(lag_s);
            assert!((sum - got).abs() < 1e-4 * 9.0, "quality {quality}: {got}, want {sum}");
        }
    }

    /// A density integrates to the variance. The rule's error and the tail beyond the last point,
    /// `2 σ² f₀/(π f_max)`, are below 1e-3.
    #[test]
    fn densities_integrate_to_the_variance() {
        for term in [
            Term::Rough { std_k: 3.0, corner_hz: 2.0 },
            Term::Resonance { std_k: 3.0, frequency_hz: 5.0, quality: 0.4 },
            Term::Resonance { std_k: 3.0, frequency_hz: 5.0, quality: 10.0 },
        ] {
            let (step_hz, points) = (0.01, 400_000);
            let sum: f64 = (0..points).map(|k| term.density_k2_per_hz((f64::from(k) + 0.5) * step_hz)).sum();
            let variance = 2.0 * sum * step_hz;
            assert!((variance - 9.0).abs() < 9e-3, "{term:?}: {variance}");
        }
    }
}

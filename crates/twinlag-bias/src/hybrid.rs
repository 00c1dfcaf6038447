//! Between compensation and normalisation: the compensated cost in units of a power of what noise
//! adds to it.
//!
//! `F_w = (J_CR − N)/N^(1−w)` with `N(θ) = s1² h(c) + s2² h(a)/g²`. `w = 1` is the compensated
//! cost, `w = 0` the normalised one less 1, `w = 1/2` the hybrid, `(J_CR − N)/√N`: the excess of
//! the mean square of `e` over its noise, in units of the standard deviation of that noise. `F_w`
//! is linear in `J_CR`, so at the given levels `E[F_w] = J_clean/N^(1−w)` at *every* `θ`: nowhere
//! negative and zero at the truth, for every `w`.

use twinlag_cross_relation::{CostValue, CrossRelation};

use crate::compensated::added_by_noise;
use crate::covariance::covariance;
use crate::error::NoiseError;
use crate::noise_gain::Noise;

/// Compensated cross-relation cost over a power of what noise adds to it.
///
/// Like [`crate::Compensated`], it assumes stationary noise of known autocovariance that is
/// independent of the gas, but it depends less on the level. If the true variances are `1 + ε`
/// times the given ones, then `E[F_w] = J_clean/N^(1−w) + ε N^w`, and to first order in `ε` the
/// error of the minimum is `w` times that of the compensated cost. The ratio of the levels has to
/// be right for any `w`.
#[derive(Clone, Debug)]
pub struct Hybrid<'a> {
    cost: CrossRelation<'a>,
    noise: [Noise; 2],
    weight: f64,
}

impl<'a> Hybrid<'a> {
    /// The hybrid, `w = 1/2`, of `cost` for the noise of channels 1 and 2.
    ///
    /// # Errors
    /// [`NoiseError::NoNoise`] if neither channel has any.
    pub fn new(cost: CrossRelation<'a>, noise: [Noise; 2]) -> Result<Self, NoiseError> {
        Self::with_weight(cost, noise, 0.5)
    }

    /// As [`Hybrid::new`], with `weight` `w` from 0 (normalised, less 1) to 1 (compensated).
    ///
    /// ```
    /// use twinlag_bias::{Compensated, Hybrid, Noise, Normalised};
    /// use twinlag_cross_relation::{CrossRelation, Readings};
    /// # let (y1, y2): (Vec<f64>, Vec<f64>) = (0..300).map(|k| (0.1 * f64::from(k)).sin_cos()).unzip();
    ///
    /// // `y1` and `y2` are the channels; at weight 1 this is the compensated cost, at 0 the
    /// // normalised one less 1.
    /// let readings = Readings::even(&y1, &y2, 0.002)?;
    /// let cost = CrossRelation::new(&readings, 100)?;
    /// let noise = [Noise::white(0.05)?, Noise::white(0.1)?];
    /// let (at, hybrid) = ([0.03, 0.1], |weight| Hybrid::with_weight(cost.clone(), noise.clone(), weight));
    /// let compensated = Compensated::new(cost.clone(), noise.clone()).evaluate(&at).value;
    /// let normalised = Normalised::new(cost.clone(), noise.clone()).evaluate(&at).value;
    /// assert_eq!(hybrid(1.0)?.evaluate(&at).value, compensated);
    /// assert!((hybrid(0.0)?.evaluate(&at).value / (normalised - 1.0) - 1.0).abs() < 1e-12); // rounding
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`NoiseError::Weight`], [`NoiseError::NoNoise`].
    pub fn with_weight(cost: CrossRelation<'a>, noise: [Noise; 2], weight: f64) -> Result<Self, NoiseError> {
        if !(0.0..=1.0).contains(&weight) {
            return Err(NoiseError::Weight { value: weight });
        }
        if noise.iter().all(|n| n.variance() == 0.0) {
            return Err(NoiseError::NoNoise);
        }
        Ok(Self { cost, noise, weight })
    }

    /// The cost from which this one is computed.
    pub fn cost(&self) -> &CrossRelation<'a> {
        &self.cost
    }

    /// The weight `w`, from 0 (normalised) to 1 (compensated).
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// `F_w = (J_CR − N) N^(w−1)` with gradient and exact Hessian at `theta` (`P` 2, 4 or 6), in
    /// the square of the channels' unit to the power of `w`. Can be negative: it is a difference.
    ///
    /// # Source
    /// Own reading. A hybrid of normalisation and compensation is published (Gillespie, Hung, Kee,
    /// McLoone, *Noise resilient discrete-time cross-relation sensor characterisation*), but its
    /// abstract, which is all that was seen, gives no formula; whether it is this one is not known.
    /// Derivation: docs, chapter "Theory", section 2.
    pub fn evaluate<const P: usize>(&self, theta: &[f64; P]) -> CostValue<P> {
        let above = self.cost.evaluate(theta);
        let noise = added_by_noise(&self.noise, theta, self.cost.period_s());
        let excess = above.value - noise.value;
        // m = N^p, m' = p m/N N', m'' = p m/N (N'' + (p − 1) N' N'/N).
        let power = self.weight - 1.0;
        let unit = noise.value.powf(power);
        let slope = power * unit / noise.value;
        let rise: [f64; P] = std::array::from_fn(|i| above.gradient[i] - noise.gradient[i]);
        let fall = noise.gradient.map(|g| slope * g);
        CostValue {
            value: excess * unit,
            gradient: std::array::from_fn(|i| rise[i] * unit + excess * fall[i]),
            hessian: std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    let bend = noise.gradient[i] * noise.gradient[j] / noise.value;
                    (above.hessian[i][j] - noise.hessian[i][j]) * unit
                        + rise[i] * fall[j]
                        + rise[j] * fall[i]
                        + excess * slope * (noise.hessian[i][j] + (power - 1.0) * bend)
                })
            }),
        }
    }

    /// Covariance `[P][P]` of the minimum `theta` under white noise of `noise_std` `[s1, s2]` (K),
    /// zero for parameters not in `free`; `None` where `theta` is no minimum.
    ///
    /// In units of `N^(w−1)` the gradient is `∂J − (w + (1 − w) J/N) ∂N`: of the sum over samples,
    /// half of it is `Σ e (∂e − (1 − w) ∂N/(2N) e)` less a number that does not scatter.
    pub fn covariance<const P: usize>(
        &self,
        theta: &[f64; P],
        free: &[usize],
        noise_std: [f64; 2],
    ) -> Option<[[f64; P]; P]> {
        let noise = added_by_noise(&self.noise, theta, self.cost.period_s());
        let rest = 1.0 - self.weight;
        let pull = noise.gradient.map(|g| 0.5 * rest * g / noise.value);
        covariance(&self.cost, &self.evaluate(theta), noise.value.powf(rest), theta, free, noise_std, &pull)
    }
}

//! The published cost with the noise taken out of its expectation.
//!
//! `E[J] = J_clean + N2(τ2) + N1(τ1)/g²`, where `N_i` is what the noise of the *other* channel's
//! synthetic filter passes: channel 1's noise goes through the model of sensor 2 and the other way
//! round. `N` falls as the time constant grows, so the plain cost is dragged to long time
//! constants. Exact in expectation for stationary noise independent of the gas.

use twinlag_cross_relation::{CostValue, CrossRelation};

use crate::covariance::covariance;
use crate::error::NoiseError;
use crate::noise_gain::Noise;

/// Cross-relation cost less what noise of known autocovariance adds to it on average.
#[derive(Clone, Debug)]
pub struct Compensated<'a> {
    cost: CrossRelation<'a>,
    noise: [Noise; 2],
    level: f64,
}

impl<'a> Compensated<'a> {
    /// `cost` compensated for the noise of channels 1 and 2.
    pub fn new(cost: CrossRelation<'a>, noise: [Noise; 2]) -> Self {
        Self { cost, noise, level: 1.0 }
    }

    /// This cost for noise of `level` times the variance given to [`Compensated::new`], in both
    /// channels.
    ///
    /// # Errors
    /// [`NoiseError::Negative`] unless `level` is finite and not negative.
    pub fn with_level(&self, level: f64) -> Result<Self, NoiseError> {
        if level.is_finite() && level >= 0.0 {
            Ok(Self { level, ..self.clone() })
        } else {
            Err(NoiseError::Negative { name: "noise level", value: level })
        }
    }

    /// Factor on the variances given to [`Compensated::new`]: 1 unless set by
    /// [`Compensated::with_level`].
    pub fn level(&self) -> f64 {
        self.level
    }

    /// The level at which the compensated cost at `theta` would be zero: `ℓ = J_CR/N` with `N` the
    /// noise's share at level 1.
    ///
    /// Where only the ratio of the two levels is known, give [`Compensated::new`] any pair of that
    /// ratio and repeat: minimise, take `profiled_level` at the minimum, go on
    /// [`Compensated::with_level`] of it. This is Dinkelbach's iteration. It converges faster than
    /// linearly to the minimum of [`Normalised`], which is the shorter way to the same point and
    /// has its covariance; `ℓ` then is the level of the noise. NaN if neither channel has noise.
    ///
    /// ```
    /// use twinlag_bias::{Compensated, Noise};
    /// use twinlag_cross_relation::{CrossRelation, Readings};
    /// # let y1: Vec<f64> = (0..300).map(|k| (0.05 * f64::from(k)).sin()).collect();
    /// # let y2: Vec<f64> = (0..300).map(|k| 0.6 * (0.05 * f64::from(k) - 0.4).sin()).collect();
    ///
    /// // `y1` and `y2` are the channels, and the second is known to be twice as noisy as the
    /// // first.
    /// let readings = Readings::even(&y1, &y2, 0.002)?;
    /// let relative = [Noise::white(1.0)?, Noise::white(2.0)?];
    /// let cost = Compensated::new(CrossRelation::new(&readings, 100)?, relative);
    /// let at = [0.0238, 0.1168];
    /// let level = cost.profiled_level(&at); // K², the variance of the first channel's noise
    /// // With this level nothing is left there, but for the rounding of a difference.
    /// let left = cost.with_level(level)?.evaluate(&at).value;
    /// assert!(left.abs() < 1e-12 * cost.cost().evaluate(&at).value);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Source
    /// Dinkelbach 1967 for the minimum of a ratio (recalled, not consulted); docs, chapter
    /// "Theory", section 2.
    pub fn profiled_level<const P: usize>(&self, theta: &[f64; P]) -> f64 {
        self.cost.evaluate(theta).value / added_by_noise(&self.noise, theta, self.cost.period_s()).value
    }

    /// The cost without compensation.
    pub fn cost(&self) -> &CrossRelation<'a> {
        &self.cost
    }

    /// `J_BC = J_CR − s1² h(c) − s2² h(a)/g²` for white noise, with gradient and Hessian, at
    /// `theta` (`P` 2, 4 or 6; for sensors of second order `h` is the gain of
    /// [`Noise::passed_second_order`]). Can be negative: it is a difference.
    ///
    /// # Source
    /// Gillespie, Hung, Kee, McLoone 2016 (abstract seen). Formula: own derivation, docs, chapter
    /// "Theory", section 2.
    pub fn evaluate<const P: usize>(&self, theta: &[f64; P]) -> CostValue<P> {
        let mut out = self.cost.evaluate(theta);
        let noise = added_by_noise(&self.noise, theta, self.cost.period_s());
        out.value -= self.level * noise.value;
        for i in 0..P {
            out.gradient[i] -= self.level * noise.gradient[i];
            for j in 0..P {
                out.hessian[i][j] -= self.level * noise.hessian[i][j];
            }
        }
        out
    }
}

/// Covariance `[P][P]` of the minimum `theta` of the *plain* cross-relation cost under white noise
/// of `noise_std` `[s1, s2]` (K), zero for parameters not in `free`; `None` where `theta` is no
/// minimum. It describes the scatter of the estimate, not its bias.
pub fn plain_covariance<const P: usize>(
    cost: &CrossRelation<'_>,
    theta: &[f64; P],
    free: &[usize],
    noise_std: [f64; 2],
) -> Option<[[f64; P]; P]> {
    covariance(cost, &cost.evaluate(theta), 1.0, theta, free, noise_std, &[0.0; P])
}

impl Compensated<'_> {
    /// Covariance `[P][P]` of the minimum `theta` under white noise of `noise_std` `[s1, s2]` (K),
    /// zero for parameters not in `free`; `None` where `theta` is no minimum.
    pub fn covariance<const P: usize>(
        &self,
        theta: &[f64; P],
        free: &[usize],
        noise_std: [f64; 2],
    ) -> Option<[[f64; P]; P]> {
        covariance(&self.cost, &self.evaluate(theta), 1.0, theta, free, noise_std, &[0.0; P])
    }
}

impl Normalised<'_> {
    /// Covariance `[P][P]` of the minimum `theta` under white noise of `noise_std` `[s1, s2]` (K),
    /// zero for parameters not in `free`; `None` where `theta` is no minimum.
    pub fn covariance<const P: usize>(
        &self,
        theta: &[f64; P],
        free: &[usize],
        noise_std: [f64; 2],
    ) -> Option<[[f64; P]; P]> {
        let below = added_by_noise(&self.noise, theta, self.cost.period_s());
        let pull = below.gradient.map(|g| 0.5 * g / below.value);
        covariance(&self.cost, &self.evaluate(theta), below.value, theta, free, noise_std, &pull)
    }
}

/// Cross-relation cost over what noise adds to it, for levels known up to a common factor.
///
/// `J_N = J_CR / (s1² h(c) + s2² h(a)/g²)`. Its minimum is at the truth whatever the level: it is
/// the fixed point of "estimate the level from the cost, compensate, minimise again" (Dinkelbach's
/// iteration). With the true levels it is 1 there on average.
#[derive(Clone, Debug)]
pub struct Normalised<'a> {
    cost: CrossRelation<'a>,
    noise: [Noise; 2],
}

impl<'a> Normalised<'a> {
    /// `cost` normalised by white noise of standard deviation ratio `s2/s1 = ratio`, in units of
    /// `s1² = 1 K²`.
    ///
    /// ```
    /// use twinlag_bias::{NoiseError, Normalised};
    /// use twinlag_cross_relation::{CrossRelation, Readings};
    /// # let y1: Vec<f64> = (0..300).map(|k| (0.07 * f64::from(k)).sin()).collect();
    /// # let y2: Vec<f64> = (0..300).map(|k| 0.5 * (0.07 * f64::from(k) - 0.5).sin()).collect();
    ///
    /// let readings = Readings::even(&y1, &y2, 0.002)?;
    /// let cost = CrossRelation::new(&readings, 100)?;
    /// // At equal noise of `s` K in both channels it is the plain cost over `s² (h(c) + h(a))`, in
    /// // units of s = 1 K.
    /// let (at, gain) = ([0.0238, 0.1168], |tau_s: f64| (0.002 / (2.0 * tau_s)).tanh());
    /// let want = cost.evaluate(&at).value / (gain(at[0]) + gain(at[1]));
    /// let got = Normalised::with_ratio(cost.clone(), 1.0)?.evaluate(&at).value;
    /// assert!((got / want - 1.0).abs() < 1e-12); // rounding
    /// assert_eq!(Normalised::with_ratio(cost, 0.0).err(), Some(NoiseError::Ratio { value: 0.0 }));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`NoiseError::Ratio`] unless the ratio is finite and positive.
    pub fn with_ratio(cost: CrossRelation<'a>, ratio: f64) -> Result<Self, NoiseError> {
        if ratio.is_finite() && ratio > 0.0 {
            Ok(Self { cost, noise: [Noise::white(1.0)?, Noise::white(ratio)?] })
        } else {
            Err(NoiseError::Ratio { value: ratio })
        }
    }

    /// `cost` normalised by noise of the given description.
    pub fn new(cost: CrossRelation<'a>, noise: [Noise; 2]) -> Self {
        Self { cost, noise }
    }

    /// The cost without normalisation.
    pub fn cost(&self) -> &CrossRelation<'a> {
        &self.cost
    }

    /// The normalised cost with gradient and Hessian at `theta` (`P` 2, 4 or 6).
    ///
    /// # Source
    /// Own derivation; docs, chapter "Theory", section 2. A normalisation is published (Gillespie,
    /// Hung, Kee, McLoone 2016), but its abstract calls it biased where this one is not, so they
    /// are not the same.
    pub fn evaluate<const P: usize>(&self, theta: &[f64; P]) -> CostValue<P> {
        let above = self.cost.evaluate(theta);
        let below = added_by_noise(&self.noise, theta, self.cost.period_s());
        let value = above.value / below.value;
        let gradient: [f64; P] = std::array::from_fn(|i| (above.gradient[i] - value * below.gradient[i]) / below.value);
        let hessian = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                (above.hessian[i][j]
                    - value * below.hessian[i][j]
                    - gradient[i] * below.gradient[j]
                    - gradient[j] * below.gradient[i])
                    / below.value
            })
        });
        CostValue { value, gradient, hessian }
    }
}

/// What noise adds to the expected cost, with derivatives.
pub(crate) fn added_by_noise<const P: usize>(noise: &[Noise; 2], theta: &[f64; P], period_s: f64) -> CostValue<P> {
    // Channel 1 passes the model of sensor 2, and the other way round.
    let through = |noise: &Noise, sensor: usize| match theta.get(4 + sensor) {
        Some(&second) if second > 0.0 => noise.passed_second_order(theta[sensor], second, period_s),
        _ => {
            let [value, slope, bend] = noise.passed(theta[sensor], period_s);
            CostValue { value, gradient: [slope, 0.0], hessian: [[bend, 0.0], [0.0, 0.0]] }
        }
    };
    let (through2, through1) = (through(&noise[0], 1), through(&noise[1], 0));
    let gain = theta.get(2).copied().unwrap_or(1.0);
    let share = 1.0 / (gain * gain);
    let by_gain = -2.0 * share / gain;
    let ([d1, e1], [d2, e2]) = (through1.gradient, through2.gradient);
    let mut all = [[0.0; 6]; 6];
    for (sensor, of, scale) in [(0, &through1, share), (1, &through2, 1.0)] {
        all[sensor][sensor] = of.hessian[0][0] * scale;
        all[sensor][4 + sensor] = of.hessian[0][1] * scale;
        all[4 + sensor][4 + sensor] = of.hessian[1][1] * scale;
    }
    all[0][2] = d1 * by_gain;
    all[2][4] = e1 * by_gain;
    all[2][2] = -3.0 * through1.value * by_gain / gain;
    let gradient = [d1 * share, d2, through1.value * by_gain, 0.0, e1 * share, e2];
    CostValue {
        value: through2.value + through1.value * share,
        gradient: std::array::from_fn(|i| gradient[i]),
        hessian: std::array::from_fn(|i| std::array::from_fn(|j| all[i.min(j)][i.max(j)])),
    }
}

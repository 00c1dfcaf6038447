//! The bias of a fit whose sensors do not see the same gas, and how it is removed.
//!
//! White noise of a reading enters the disagreement through the inverse of its sensor, `u = R₁ y₁ − R₂ y₂`, and the exact whitening
//! changes with the parameters as it does, so its energy has no bias. A mismatch `m` of the gas at sensor `i` enters as `G m`, the same
//! whatever the time constants, since its sensor has lagged it before: but the lag that is tried undoes that lag, and so the energy
//! falls where the sensor is taken to be faster than it is. At the true parameters half the slope of the energy has the mean
//!
//! ```text
//! c_p = Σ_ω |W(ω)|² |G(ω)|² M(ω) / V(ω) · Re(∂_p ln R_i(ω) − ∂_p ln G(ω)),
//! ```
//!
//! over the frequencies of as many residuals as count, with the weights `W`, the spectrum `M` of the mismatch and that of the
//! disagreement, `V`. To first order the estimate is off by `−H⁻¹ c`, `H` half the second derivatives of the energy: by about a
//! standard error in the records of the test, whose mismatch is 5 % of the gas. The record does not say which of the sensors sees the
//! other gas. The mean of both corrections is taken, and half their difference is a standard error beside the others. Where the bias
//! is not removed, the mean correction is one as well.

use std::f64::consts::PI;

use twinlag_optimise::{Scale, Variable};

use crate::dense;
use crate::fit::Fitted;
use crate::observations::Observations;
use crate::plant::Place;
use crate::selection::Selection;
use crate::spectrum::Paths;

/// Frequencies of a mean over all of them. Chosen.
const FREQUENCIES: usize = 1024;
/// Step of derivatives, relative to the scale of a parameter: about the cube root of rounding, where a central difference is most exact.
const STEP: f64 = 1e-5;

/// What removes the bias from the parameters, for a mismatch in the gas of either sensor.
type Corrections = [Vec<f64>; 2];

impl Fitted {
    /// This fit without the bias that a mismatch of the gas makes, halfway between that of either sensor; itself where it has none.
    #[must_use]
    pub fn without_mismatch_bias(mut self, observations: &Observations, selection: &Selection) -> Self {
        let Some(corrections) = self.mismatch_corrections(observations, selection) else { return self };
        let variables = self.model.variables(&self.theta, observations);
        let corrected: Vec<f64> =
            self.theta.iter().zip(combined(&corrections, [0.5, 0.5])).map(|(x, correction)| x + correction).collect();
        let is_inside = |(x, v): (&f64, &Variable)| (v.lower..=v.upper).contains(x);
        if corrected.iter().zip(&variables).all(is_inside) {
            self.report.x.clone_from(&corrected);
            self.theta = corrected;
            self.is_mismatch_bias_removed = true;
        }
        self
    }

    /// This fit with its bias removed, if that of `other` is.
    #[must_use]
    pub fn with_bias_as(self, other: &Self, observations: &Observations, selection: &Selection) -> Self {
        let is_to_be_removed = other.is_mismatch_bias_removed && !self.is_mismatch_bias_removed;
        if is_to_be_removed { self.without_mismatch_bias(observations, selection) } else { self }
    }

    /// Covariance that comes from not knowing which sensor sees the other gas, and from the bias where that is not removed; `None` of a
    /// model without a mismatch.
    pub(crate) fn mismatch_covariance(
        &self,
        observations: &Observations,
        selection: &Selection,
    ) -> Option<Vec<Vec<f64>>> {
        let corrections = self.mismatch_corrections(observations, selection)?;
        let mut out = squares(&combined(&corrections, [0.5, -0.5]));
        if !self.is_mismatch_bias_removed {
            dense::add(&mut out, &squares(&combined(&corrections, [0.5, 0.5])));
        }
        Some(out)
    }

    /// What removes the bias from the minimum of the energy of these samples alone, halfway between that of either sensor; `None` where
    /// it is not removed from this fit.
    pub(crate) fn removed_bias(&self, observations: &Observations, selection: &Selection) -> Option<Vec<f64>> {
        let corrections =
            self.is_mismatch_bias_removed.then(|| self.mismatch_corrections(observations, selection))??;
        Some(combined(&corrections, [0.5, 0.5]))
    }

    fn mismatch_corrections(&self, observations: &Observations, selection: &Selection) -> Option<Corrections> {
        let Self { model, theta, .. } = self;
        let plant = model.plant(theta, observations);
        let mismatch = *plant.extra.iter().find(|extra| extra.place == Place::Gas)?;
        let paths = Paths::of(&plant, observations);
        let omegas = (0..FREQUENCIES).map(|k| PI * (k as f64 + 0.5) / FREQUENCIES as f64);
        let residuals_each = selection.counted() as f64 / FREQUENCIES as f64;
        let share = |omega: f64| {
            let of_mismatch = paths.total([0.0; 2], &[mismatch], omega);
            of_mismatch / paths.total(plant.noise_std_k.map(|s| s * s), &plant.extra, omega)
        };
        let weights: Vec<(f64, f64)> =
            omegas.map(|omega| (omega, residuals_each * selection.weighting.at(omega) * share(omega))).collect();
        let variables = model.variables(theta, observations);
        let mean_slope = |at: usize| {
            let variable = &variables[at];
            if variable.lower == variable.upper {
                return [0.0; 2];
            }
            let step = STEP * scale(variable, theta[at]);
            let ends = [step, -step].map(|by| {
                let mut moved = theta.clone();
                moved[at] += by;
                Paths::of(&model.plant(&moved, observations), observations)
            });
            [0, 1].map(|sensor| {
                let of = |(omega, weight): &(f64, f64)| {
                    let [up, down] = ends.each_ref().map(|paths| {
                        let [reading, gas] =
                            [Place::Reading(sensor), Place::Gas].map(|place| paths.power(place, *omega));
                        0.5 * (reading / gas).ln()
                    });
                    weight * (up - down) / (2.0 * step)
                };
                weights.iter().map(of).sum::<f64>()
            })
        };
        let slopes: Vec<[f64; 2]> = (0..theta.len()).map(mean_slope).collect();
        let normal = model.normal_equations(theta, observations, selection, None);
        let inverse = model.inverse_second_derivatives(theta, observations, selection, &normal)?;
        let correction = |sensor: usize| {
            let slope: Vec<f64> = slopes.iter().map(|of_both| of_both[sensor]).collect();
            let mut out = dense::times(&inverse, &slope);
            out.iter_mut().zip(&variables).filter(|(_, v)| v.lower == v.upper).for_each(|(x, _)| *x = 0.0);
            out
        };
        let corrections = [0, 1].map(correction);
        corrections.iter().flatten().all(|x| x.is_finite()).then_some(corrections)
    }
}

/// The sum of both corrections with these weights.
fn combined([one, two]: &Corrections, [a, b]: [f64; 2]) -> Vec<f64> {
    one.iter().zip(two).map(|(x, y)| a * x + b * y).collect()
}

/// Products of these with each other.
fn squares(x: &[f64]) -> Vec<Vec<f64>> {
    x.iter().map(|a| x.iter().map(|b| a * b).collect()).collect()
}

/// The size of a parameter's changes.
fn scale(variable: &Variable, value: f64) -> f64 {
    match variable.scale {
        Scale::Logarithmic => value,
        Scale::Linear { typical } => typical,
    }
}

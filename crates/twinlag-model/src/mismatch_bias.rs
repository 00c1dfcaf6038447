//! The bias of a fit whose sensors do not see the same gas, and how it is taken off.
//!
//! White noise of a reading enters the disagreement through the inverse of its sensor, `u = R₁ y₁ − R₂ y₂`, and the exact whitening
//! changes with the parameters as it does, so its energy has no bias. A mismatch `m` of the gas at sensor `i` enters as `G m`, the same
//! whatever the time constants, since its sensor has lagged it before: but the lag that is tried undoes that lag, and so the energy
//! falls where the sensor is taken to be faster than it is. At the true parameters half the slope of the energy has the mean
//!
//! ```text
//! c_p = Σ_ω W(ω) |G(ω)|² M(ω) / V(ω) · Re(∂_p ln R_i(ω) − ∂_p ln G(ω)),
//! ```
//!
//! over the frequencies of as many residuals as count, with the weights `W`, the spectrum `M` of the mismatch and that of the
//! disagreement, `V`. To first order the estimate is off by `−H⁻¹ c`, `H` half the second derivatives of the energy: mostly
//! `tr(V⁻¹ M)` times the square of the amplitude of the mismatch over that of the gas, which is half a per cent or one standard error
//! for one of 3 % in a minute. The record does not say which of the sensors sees the other gas. The mean of both corrections is taken,
//! and half their difference is a standard error beside the others.

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
/// Step of derivatives, relative to the scale of a parameter: rounding then leaves half of all digits.
const STEP: f64 = 1e-5;

/// What takes the bias off the parameters, for a mismatch in the gas of either sensor.
type Corrections = [Vec<f64>; 2];

impl Fitted {
    /// This fit without the bias that a mismatch of the gas makes, halfway between that of either sensor; itself where it has none.
    #[must_use]
    pub fn without_mismatch_bias(mut self, observations: &Observations, selection: &Selection) -> Self {
        let Some([one, two]) = self.mismatch_corrections(observations, selection) else { return self };
        let variables = self.model.variables(&self.theta, observations);
        let corrected: Vec<f64> =
            self.theta.iter().zip(one.iter().zip(&two)).map(|(x, (a, b))| x + 0.5 * (a + b)).collect();
        let is_inside = |(x, v): (&f64, &Variable)| (v.lower..=v.upper).contains(x);
        if corrected.iter().zip(&variables).all(is_inside) {
            self.report.x.clone_from(&corrected);
            self.theta = corrected;
        }
        self
    }

    /// Covariance that comes from not knowing which sensor sees the other gas; `None` of a model without a mismatch.
    pub(crate) fn mismatch_covariance(
        &self,
        observations: &Observations,
        selection: &Selection,
    ) -> Option<Vec<Vec<f64>>> {
        let [one, two] = self.mismatch_corrections(observations, selection)?;
        let half: Vec<f64> = one.iter().zip(&two).map(|(a, b)| 0.5 * (a - b)).collect();
        Some(half.iter().map(|a| half.iter().map(|b| a * b).collect()).collect())
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
        let inverse = model.curvature(theta, observations, selection, &normal)?;
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

/// The size of a parameter's changes.
fn scale(variable: &Variable, value: f64) -> f64 {
    match variable.scale {
        Scale::Logarithmic => value,
        Scale::Linear { typical } => typical,
    }
}

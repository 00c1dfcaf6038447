//! Noise that a search finds in the spectrum of a residual: its size, how certain that is, and the fit under its weights.

use twinlag_model::{Effort, Extra, Fitted, Place, Shared, fit_noise, fit_noise_again, noise_log_variances};

use crate::candidates::{Candidate, Search};

/// Rounds of a fit of noise and of what is under its weights. Chosen.
const MOST_NOISE_ROUNDS: usize = 6;
/// Change of the logarithm of a noise's parameters below which it has settled. Chosen.
const SETTLED_LOG_CHANGE: f64 = 0.01;
/// Samples beyond the reach of the model without which no noise is fitted.
const FEWEST_NOISE_SAMPLES: usize = 20;

impl Search<'_> {
    /// The candidate of a noise, fitted to the spectrum of the residual; `None` for a record that
    /// is too short.
    pub(crate) fn with_noise(&self, current: &Fitted, effect: &Shared) -> Option<Candidate> {
        let plant = current.model.plant(&current.theta, self.observations);
        let longest = self.observations.stretches.iter().map(|s| s.time_s.len()).max()?;
        if longest < plant.consumed(true) + FEWEST_NOISE_SAMPLES {
            return None;
        }
        let bands = self.bands(current);
        let starts: Vec<[f64; 2]> = effect.starts().iter().map(|s| [s[0], s[1]]).collect();
        let fit = |place| fit_noise(&plant, self.observations, &bands, place, &starts, self.context.is_coarse);
        let (white, with) = (fit(None), fit(Some(place_of(effect))));
        let extra = with.extra?;
        let model = current.model.with(effect.clone()).with_noise(with.noise_std_k);
        let mut theta = current.theta.clone();
        theta.extend([extra.std_k, extra.correlation_s]);
        // The weights move the time constants, and these the noise: with the last model that is settled.
        let fitted = model.fit(&theta, self.observations, self.selection, Effort::Compare);
        let held_out_nats = 0.5 * (white.held_out - with.held_out);
        Some(Candidate { held_out_nats, ..self.candidate(effect, fitted, white.likelihood - with.likelihood, 0.0) })
    }

    /// A fit whose noise is fitted again to what its other parameters leave over, and these again under its weights, until the noise
    /// hardly changes: what is left over at time constants that are wrong for want of the noise is more than the noise. Returned as it
    /// is where it has none.
    pub(crate) fn with_settled_noise(&self, mut fitted: Fitted) -> Fitted {
        let effects = fitted.model.effects.clone();
        let noises: Vec<usize> = (0..effects.len()).filter(|index| effects[*index].is_noise()).collect();
        for _ in 0..MOST_NOISE_ROUNDS {
            let before = fitted.theta.clone();
            for index in &noises {
                fitted = self.with_noise_fitted_again(fitted, *index);
            }
            let mut of_noises = noises.iter().flat_map(|index| fitted.model.range(*index));
            if of_noises.all(|at| (fitted.theta[at] / before[at]).ln().abs() < SETTLED_LOG_CHANGE) {
                break;
            }
        }
        fitted
    }

    /// A fit whose noise of place `index` is fitted again to what its other parameters leave over, and these again under its weights.
    fn with_noise_fitted_again(&self, fitted: Fitted, index: usize) -> Fitted {
        let Search { observations, selection, context, .. } = self;
        let plant = fitted.model.plant(&fitted.theta, observations);
        let (place, bands) = (place_of(&fitted.model.effects[index]), self.bands(&fitted));
        let again = fit_noise_again(&plant, place, context.noise_std_k, observations, &bands, context.is_coarse);
        let Some((noise_std_k, Extra { std_k, correlation_s, .. })) = again else { return fitted };
        let mut theta = fitted.theta.clone();
        theta[fitted.model.range(index)].copy_from_slice(&[std_k, correlation_s]);
        let model = fitted.model.with_noise(noise_std_k);
        model.fit(&theta, observations, selection, Effort::Compare)
    }

    /// Variances of the parameters of the noises of a fit, each with its place among all parameters; none of a noise that the residual
    /// does not determine.
    pub(crate) fn noise_variances(&self, fitted: &Fitted) -> Vec<(usize, f64)> {
        let Fitted { model, theta, .. } = fitted;
        let plant = model.plant(theta, self.observations);
        let bands = self.bands(fitted);
        let of_noise = |index: usize| {
            let place = place_of(&model.effects[index]);
            let variances = noise_log_variances(&plant, place, self.observations, &bands, self.context.is_coarse);
            variances.into_iter().flat_map(move |variances| model.range(index).zip(variances))
        };
        let noises = (0..model.effects.len()).filter(|index| model.effects[*index].is_noise());
        noises.flat_map(of_noise).map(|(at, of_log)| (at, of_log * theta[at].powi(2))).collect()
    }
}

/// Where a noise enters.
fn place_of(noise: &Shared) -> Place {
    noise.channel().map_or(Place::Gas, Place::Reading)
}

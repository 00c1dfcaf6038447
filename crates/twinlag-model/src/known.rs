//! Effects that are known already, put into the model.

use crate::effect::{self, Identifier, KnownEffect, Parameter};
use crate::error::ModelError;
use crate::fit::{Effort, Fitted};
use crate::fitted::KnownFit;
use crate::model::Model;
use crate::observations::Observations;
use crate::prepare::{GRID_STARTS, Prepared};
use crate::settings::Settings;
use crate::summary::summarise;

/// Both time constants of `observations` with `effects` held as they are in the model, except
/// parameters that belong to a record, which are fitted again; defects of the data are dealt with
/// as in a diagnosis.
///
/// ```
/// use twinlag_model::{Identifier, KnownEffect, Observations, Settings, Stretch, fit_with};
/// use twinlag_signal::{Broadband, Gas, Noise, Record, Rig, Sensor, Signal};
///
/// let mut sensors = [Sensor::new("fine", 0.12), Sensor::new("coarse", 0.45)];
/// sensors.iter_mut().for_each(|s| s.noise = Some(Noise::white(0.1)));
/// sensors[1].offset_k = 2.0;
/// let mut gas = Gas::new(300.0, Signal::Broadband(Broadband { std_k: 15.0, corner_hz: 0.5 }));
/// gas.hold = twinlag_signal::Hold::ZeroOrder;
/// let record = Rig::new(1, Record::new(500, 0.05), gas, sensors)?.simulate()?;
/// let stretch = Stretch::new(record.time_s, [record.t1_c, record.t2_c]);
/// let observations = Observations::new(vec![stretch], Some(0.05))?;
///
/// // That the second channel reads 2 K too hot is known from another record.
/// let parameters = vec![("offset".into(), 2.0)];
/// let offset = KnownEffect { effect: Identifier::CALIBRATION, channel: Some(1), parameters };
/// let known = fit_with(&observations, &Settings::default(), &[offset])?;
/// for (tau, truth_s) in known.fit.time_constants.iter().zip([0.12, 0.45]) {
///     let (value_s, error_s) = (tau.value_s.expect("determined"), tau.standard_error_s.expect("determined"));
///     assert!((value_s - truth_s).abs() < 4.0 * error_s, "{value_s} ± {error_s}");
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`ModelError`] as of a diagnosis; [`ModelError::Model`] for an effect whose `restore` gives none, or
/// has other parameters.
pub fn fit_with(
    observations: &Observations,
    settings: &Settings,
    effects: &[KnownEffect],
) -> Result<KnownFit, ModelError> {
    Ok(Known::of(observations, settings, effects, KnownNumbers::Held)?.summarised())
}

/// As [`fit_with`], for the record that `effects` were found in: the fit begins at their numbers and moves all but those of noise, so that
/// the intervals of the time constants cover them.
///
/// # Errors
/// As [`fit_with`].
pub fn fit_again_with(
    observations: &Observations,
    settings: &Settings,
    effects: &[KnownEffect],
) -> Result<KnownFit, ModelError> {
    let KnownFit { fit, .. } = Known::of(observations, settings, effects, KnownNumbers::Fitted)?.summarised();
    let is_fitted = |known: &&KnownEffect| !known.effect.is_noise() && !known.effect.about().is_defect;
    Ok(KnownFit { fit, fitted_again: effects.iter().filter(is_fitted).map(|known| known.effect).collect() })
}

/// What is done with the numbers of effects that are known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum KnownNumbers {
    /// They stay as they are, but for those that belong to a record.
    Held,
    /// A fit begins with them.
    Fitted,
}

/// A record with the model of it whose effects were known.
pub(crate) struct Known {
    pub prepared: Prepared,
    pub fitted: Fitted,
    pub fitted_again: Vec<Identifier>,
}

impl Known {
    fn summarised(self) -> KnownFit {
        let Self { prepared, fitted, fitted_again } = self;
        let fit = summarise(&fitted, &prepared.observations, &prepared.everything, &prepared.levels, &prepared.policy);
        KnownFit { fit, fitted_again }
    }

    pub(crate) fn of(
        observations: &Observations,
        settings: &Settings,
        effects: &[KnownEffect],
        numbers: KnownNumbers,
    ) -> Result<Self, ModelError> {
        let mut prepared = Prepared::new(observations, settings)?;
        // Nothing is searched for that blocks would have to judge.
        prepared.searched = prepared.everything.clone();
        let mut model = Model::new(&settings.known, prepared.levels.std_k);
        model.is_frozen = true;
        if effects.iter().any(|known| known.effect.about().follows_gas) {
            // A first estimate; with the effects in the model it is made again.
            let two_lags = model.fit_over_grid(&[], GRID_STARTS, &prepared.observations, &prepared.everything);
            prepared.context.gas = two_lags.estimated_gas(&prepared.observations);
        }
        let (mut rest, mut fitted_again) = (Vec::new(), Vec::new());
        for known in effects.iter().filter(|k| !k.effect.about().is_defect) {
            let effect = (known.effect.about().restore)(known, &prepared.context)?;
            let effect = effect.ok_or_else(|| ModelError::Model { effect: known.effect.name() })?;
            if !known.effect.is_of_this_library() {
                effect::check(&effect)?;
            }
            for parameter in effect.parameters() {
                check(known, parameter)?;
            }
            if effect.is_of_the_record() && numbers == KnownNumbers::Held {
                rest.extend(effect.starts().into_iter().next().unwrap_or_default());
                fitted_again.push(known.effect);
            } else {
                rest.extend(effect.parameters().iter().filter_map(|p| known.parameter(p.name)));
            }
            model = model.with(effect);
        }
        let fit = |prepared: &Prepared, model: &Model| {
            model.fit_over_grid(&rest, GRID_STARTS, &prepared.observations, &prepared.everything)
        };
        let fit_again =
            |from: &Fitted| from.model.fit(&from.theta, &prepared.observations, &prepared.everything, Effort::Look);
        let mut fitted = fit(&prepared, &model).in_own_gas(&prepared.observations, fit_again);
        if numbers == KnownNumbers::Fitted {
            fitted.model.is_frozen = false;
            let Prepared { observations, everything, .. } = &prepared;
            fitted = fitted.model.fit(&fitted.theta, observations, everything, Effort::Finish);
        }
        model = fitted.model.clone();
        let has_spikes = settings.effects.contains(&Identifier::SPIKES) && prepared.mask_spikes(&fitted);
        let has_line = model.effects.iter().any(|e| e.about().is_narrow);
        if has_spikes || has_line || !prepared.found.is_empty() {
            prepared.find_levels(&fitted);
            fitted = fit(&prepared, &model.clone().with_noise(prepared.levels.std_k));
        }
        if prepared.has_high_levels(&fitted) {
            prepared.lower_levels(&fitted, settings);
            fitted = prepared.refit(&fitted);
        }
        if !fitted.chi2.is_finite() {
            return Err(ModelError::Absurd);
        }
        let Prepared { observations, everything, levels, .. } = &prepared;
        let corrected = fitted.clone().without_mismatch_bias(observations, everything);
        // Where more than noise is left, what was found as a mismatch of the gas may be something else.
        let is_noise_left =
            || !summarise(&fitted, observations, everything, levels, &settings.policy).is_contradicted();
        if corrected.is_mismatch_bias_removed && is_noise_left() {
            fitted = corrected;
        }
        Ok(Self { prepared, fitted: fitted.in_order(), fitted_again })
    }
}

/// A parameter of a model that comes from outside must be one that its kind can have.
fn check(known: &KnownEffect, parameter: &Parameter) -> Result<(), ModelError> {
    let got = known.parameter(parameter.name).unwrap_or(f64::NAN);
    if parameter.domain.contains(got) {
        return Ok(());
    }
    let (effect, name, expected) = (known.effect.name(), parameter.name, parameter.domain.expected());
    Err(ModelError::Parameter { effect, name, got, expected })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::model::KnownTimeConstant;
    use crate::observations::Stretch;

    /// Standard normal numbers enough like it: sums of twelve uniform ones, from a linear congruential generator.
    fn normal(state: &mut u64) -> f64 {
        let mut uniform = || {
            *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (*state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }

    /// Tones through two lags in closed form, sampled every 10 s or so, and noise. The shortest period is 13 steps long, so that the
    /// mean and the slope of an interval are off by `(ωh)²/12`, two hundredths of a time constant.
    fn record(tau_s: [f64; 2], noise_k: f64) -> Observations {
        let time_s: Vec<f64> = (0..400).map(|k| 10.0 * f64::from(k) + 3.0 * (1.7 * f64::from(k)).sin()).collect();
        let mut state = 1;
        let reading_c = tau_s.map(|tau_s| {
            let at = |t: f64| -> f64 {
                let through = |period_s: f64| {
                    let x: f64 = TAU / period_s * tau_s;
                    (TAU / period_s * t - x.atan()).sin() / x.hypot(1.0)
                };
                [131.0, 173.0, 241.0, 317.0, 470.0].into_iter().map(through).sum()
            };
            time_s.iter().map(|t| 20.0 + at(*t) + noise_k * normal(&mut state)).collect()
        });
        Observations::new(vec![Stretch::new(time_s, reading_c)], None).expect("a record")
    }

    fn taus(observations: &Observations, noise_k: f64, known: KnownTimeConstant) -> [crate::fitted::TimeConstant; 2] {
        let settings = Settings { known: vec![known], noise_std_k: Some([noise_k; 2]), ..Settings::default() };
        fit_with(observations, &settings, &[]).expect("a fit").fit.time_constants
    }

    /// Failed: a time constant of 0.5 ± 0.1 s ended at a tenth of the sample period, 1 s, and neither was determined.
    #[test]
    fn what_is_known_need_not_be_resolved_by_the_samples() {
        let observations = record([0.5, 6.0], 0.02);
        for std_s in [None, Some(0.1)] {
            let known = KnownTimeConstant { sensor: 0, value_s: 0.5, std_s };
            let [first, second] = taus(&observations, 0.02, known);
            let first_s = first.value_s.expect("known");
            // The readings add the difference alone, so what is known of the first stays.
            assert!((first_s - 0.5).abs() < 4.0 * std_s.unwrap_or(1e-12), "got {first_s} s, known {std_s:?}");
            let (second_s, error_s) = (second.value_s.expect("given"), second.standard_error_s.expect("given"));
            assert!((second_s - 6.0).abs() < 4.0 * error_s, "got {second_s} ± {error_s} s, want 6 s");
        }
    }

    /// A sensor that follows faster than the noise shows, beside one that is known: no value, and an upper limit. The noise of a
    /// difference, 0.28 K, over the slopes of 0.05 K/s and the root of 400 samples is 0.28 s: a limit above 2 s would be seven times it.
    #[test]
    fn what_is_too_fast_to_see_has_an_upper_limit_beside_what_is_known() {
        let observations = record([0.5, 0.01], 0.2);
        let known = KnownTimeConstant { sensor: 0, value_s: 0.5, std_s: None };
        let [_, second] = taus(&observations, 0.2, known);
        assert_eq!(second.value_s, None);
        let [low_s, high_s] = second.interval_95_s.expect("a limit");
        assert!(low_s <= 0.01 && 0.01 < high_s && high_s < 2.0, "got [{low_s}, {high_s}] s");
    }
}

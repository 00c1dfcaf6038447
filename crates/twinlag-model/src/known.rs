//! Effects that are known already, put into the model.

use crate::effect::{self, Identifier, KnownEffect, Parameter};
use crate::error::ModelError;
use crate::fit::Fitted;
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
    let Known { prepared, fitted, fitted_again } = Known::of(observations, settings, effects)?;
    let fit = summarise(&fitted, &prepared.observations, &prepared.everything, &prepared.levels, &prepared.policy);
    Ok(KnownFit { fit, fitted_again })
}

/// A record with the model of it whose effects were known.
pub(crate) struct Known {
    pub prepared: Prepared,
    pub fitted: Fitted,
    pub fitted_again: Vec<Identifier>,
}

impl Known {
    pub(crate) fn of(
        observations: &Observations,
        settings: &Settings,
        effects: &[KnownEffect],
    ) -> Result<Self, ModelError> {
        let mut prepared = Prepared::new(observations, settings)?;
        let mut model = Model::new(&settings.known, prepared.levels.std_k);
        model.is_frozen = true;
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
            if effect.is_of_the_record() {
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
        let mut fitted = fit(&prepared, &model);
        let has_spikes = settings.effects.contains(&Identifier::SPIKES) && prepared.mask_spikes(&fitted);
        let has_line = model.effects.iter().any(|e| e.about().is_narrow);
        if has_spikes || has_line || !prepared.found.is_empty() {
            prepared.find_levels(&fitted, settings);
            fitted = fit(&prepared, &model.clone().with_noise(prepared.levels.std_k));
        }
        if prepared.has_high_levels(&fitted, settings) {
            prepared.lower_levels(&fitted, settings);
            fitted = prepared.refit(&fitted);
        }
        if !fitted.chi2.is_finite() {
            return Err(ModelError::Absurd);
        }
        Ok(Self { prepared, fitted, fitted_again })
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

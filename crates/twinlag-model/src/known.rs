//! Effects that are known already, put into the model.

use twinlag_optimise::Scale;

use crate::fitted::KnownFit;
use crate::effect::{Identifier, Parameter, Shared, candidates};
use crate::error::DiagnoseError;
use crate::model::{Fitted, Model};
use crate::observations::Observations;
use crate::prepare::{GRID_STARTS, Prepared};
use crate::settings::{KnownEffect, Settings};
use crate::summary::summarise;

/// Both time constants of `observations` with `effects` as they are in the model, but for what belongs to a record, which is
/// fitted again; defects of the data are dealt with as in [`crate::diagnose()`].
///
/// # Errors
/// As [`crate::diagnose()`]; [`DiagnoseError::Model`] for an effect that is none of this library, or whose parameters are others.
pub fn fit_with(
    observations: &Observations,
    settings: &Settings,
    effects: &[KnownEffect],
) -> Result<KnownFit, DiagnoseError> {
    let Known { prepared, fitted, fitted_again } = Known::of(observations, settings, effects)?;
    let fit = summarise(&fitted, &prepared.observations, &prepared.everything, &prepared.levels);
    Ok(KnownFit { fit, fitted_again })
}

/// A record with the model of it whose effects were known.
pub struct Known {
    pub prepared: Prepared,
    pub fitted: Fitted,
    pub fitted_again: Vec<Identifier>,
}

impl Known {
    pub fn of(
        observations: &Observations,
        settings: &Settings,
        effects: &[KnownEffect],
    ) -> Result<Self, DiagnoseError> {
        let mut prepared = Prepared::new(observations, settings)?;
        let mut model = Model::new(&settings.known, prepared.levels.std_k);
        model.is_frozen = true;
        let own = prepared.context.clone();
        let (mut rest, mut fitted_again) = (Vec::new(), Vec::new());
        for known in effects {
            let is_defect =
                [Identifier::Saturation, Identifier::Quantisation, Identifier::Spikes].contains(&known.effect);
            if is_defect {
                continue;
            }
            let value = |name: &str| known.parameters.iter().find(|(n, _)| n == name).map(|(_, v)| *v);
            prepared.context.lines = value("frequency").into_iter().flat_map(|hz| [(hz, 0), (hz, 1)]).collect();
            // Numbers are about the temperatures of the record that they were found in.
            let [mean_c, variance_k2, skew_k] = own.moments;
            prepared.context.moments = [
                value("curvature_about").unwrap_or(mean_c),
                value("curvature_variance").unwrap_or(variance_k2),
                value("curvature_skew").unwrap_or(skew_k),
            ];
            let about_c = value("mean_temperature").or(value("neutral_temperature"));
            prepared.context.mean_c = about_c.map_or(own.mean_c, |about_c| [about_c; 2]);
            if known.effect == Identifier::VaryingTimeConstant && value("exponent").is_some() && own.flow.is_none() {
                return Err(DiagnoseError::NeedsFlow);
            }
            let fits = |e: &Shared| {
                e.identifier() == known.effect
                    && e.channel() == known.channel
                    && e.parameters().iter().all(|p| value(p.name).is_some())
            };
            let all = candidates(&prepared.context);
            let sizes: Vec<Shared> = all.iter().flat_map(|e| e.sizes()).collect();
            // Of those whose parameters are all given the one with the most of them.
            let effect = all.into_iter().chain(sizes).filter(fits).max_by_key(|e| e.parameters().len());
            let effect = effect.ok_or_else(|| DiagnoseError::Model { effect: known.effect.name() })?;
            for parameter in effect.parameters() {
                check(known.effect, parameter, value(parameter.name).unwrap_or(f64::NAN))?;
            }
            if effect.is_of_the_record() {
                rest.extend(effect.starts().into_iter().next().unwrap_or_default());
                fitted_again.push(known.effect);
            } else {
                rest.extend(effect.parameters().iter().filter_map(|p| value(p.name)));
            }
            model = model.with(effect);
        }
        let fit = |prepared: &Prepared, model: &Model| {
            model.fit_over_grid(&rest, GRID_STARTS, &prepared.observations, &prepared.everything)
        };
        let mut fitted = fit(&prepared, &model);
        let has_spikes = settings.effects.contains(&Identifier::Spikes) && prepared.mask_spikes(&fitted);
        let has_line = model.effects.iter().any(|e| e.identifier() == Identifier::MainsPickup);
        if has_spikes || has_line || !prepared.found.is_empty() {
            prepared.find_levels(&fitted, settings);
            fitted = fit(&prepared, &model.clone().with_noise(prepared.levels.std_k));
        }
        if prepared.lower_levels(&fitted, settings) {
            fitted = prepared.refit(&fitted);
        }
        if !fitted.chi2.is_finite() {
            return Err(DiagnoseError::Absurd);
        }
        Ok(Self { prepared, fitted, fitted_again })
    }
}

/// A parameter of a model that comes from outside must be one that its kind can have.
fn check(effect: Identifier, parameter: &Parameter, got: f64) -> Result<(), DiagnoseError> {
    let is_positive = matches!(parameter.variable.scale, Scale::Logarithmic);
    let expected = match (is_positive, parameter.name) {
        (true, _) if got.is_finite() && got > 0.0 => return Ok(()),
        (true, _) => "a finite number above 0",
        (false, "gain") if got.is_finite() && got != 0.0 => return Ok(()),
        (false, "gain") => "a finite number that is not 0",
        (false, "share") if got.abs() < 1.0 => return Ok(()),
        (false, "share") => "a share between -1 and 1",
        (false, "frequency") if got.is_finite() && got >= 0.0 => return Ok(()),
        (false, "frequency") => "a frequency of 0 or more",
        _ if got.is_finite() => return Ok(()),
        _ => "a finite number",
    };
    Err(DiagnoseError::Parameter { effect: effect.name(), name: parameter.name, got, expected })
}

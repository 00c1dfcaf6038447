//! A record with the effects of a model: held where it was found in another one, and fitted again in its own.

use twinlag_diagnose::{
    Basis, Circumstances, Grade, Identifier, ModelFit, Observations, Policy, Reason, Remark, Settings, excess,
    fit_again_with, fit_with, is_single_tone,
};
use twinlag_estimate::Known;
use twinlag_record::Record;

use crate::answers::{Characterisation, FittedAnswer, Model, Status, rounded};
use crate::error::Error;
use crate::options::Options;
use crate::rows::{Rows, settings_of};
use crate::verbs::characterise;
use crate::verbs::diagnose::remark_on_options;
use crate::verbs::given::{Contradiction, sensor_of};

/// Relative difference of two mean flows that a reader has to know of: with the root of the flow, time constants differ by half as much.
/// Chosen.
const MIN_FLOW_DIFFERENCE: f64 = 0.01;

/// Estimates both time constants of `record`, with the effects of `model` held fixed; on the record that it was found in they are fitted
/// again from there, so that the intervals cover their uncertainty.
///
/// # Errors
/// As [`crate::diagnose()`]; [`Error::ModelChannels`] and [`Error::ModelNumber`] for a model of other
/// channels, or with impossible numbers; also if an effect has parameters that this version does
/// not know.
///
/// ```
#[doc = include_str!("../example.txt")]
/// let model = twinlag::diagnose(&record, &DiagnoseOptions::default())?.model();
/// let later = Record::from_channels(channels(2)?, SamplingChoice::Auto)?;
/// let answer = twinlag::characterise_with(&later, &model, &Options::default())?;
/// assert_eq!(answer.status, Status::Ok);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn characterise_with(record: &Record, model: &Model, options: &Options) -> Result<Characterisation, Error> {
    if model.effects.is_empty() {
        model.check(record)?;
        let mut out = characterise(record, options)?;
        let reasons = model.reasons(record, &[]);
        out.model_remarks = reasons.iter().filter_map(Reason::caution).collect();
        reasons.iter().for_each(|reason| out.rest_on(reason));
        out.warnings.push("the model has no effects: it is two first-order lags".into());
        return Ok(out);
    }
    Ok(with_model(record, Some(model), options)?.0)
}

/// The fit of `record` with the effects of `model`, none without one, and its characterisation.
pub(crate) fn with_model(
    record: &Record,
    model: Option<&Model>,
    options: &Options,
) -> Result<(Characterisation, ModelFit), Error> {
    options.check()?;
    model.map_or(Ok(()), |model| model.check(record))?;
    let Rows { observations, .. } = Rows::of(record)?;
    // Coloured noise was found beside white noise of these levels: third differences see both.
    let noisy = model.filter(|m| m.effects.iter().any(|e| e.effect.is_noise()));
    let noise_std_k = options.noise_std_k.or(noisy.and_then(|m| m.noise_std_k));
    let settings = Settings { noise_std_k, ..settings_of(options) };
    let effects = model.map(Model::known_effects).unwrap_or_default();
    let is_own = model.is_some_and(|model| model.is_of(record));
    let fit = if is_own { fit_again_with } else { fit_with };
    let mut known = fit(&observations, &settings, &effects)?;
    let policy = &settings.policy;
    let contradictions = if settings.known.is_empty() {
        Vec::new()
    } else {
        let alone = fit(&observations, &Settings { known: Vec::new(), ..settings.clone() }, &effects)?.fit;
        contradictions(&options.known, &alone, noisy.is_some(), policy)
    };
    let excess = excess(&known.fit, noisy.is_some());
    let mut basis = Basis::of(excess, !settings.known.is_empty(), policy);
    let reasons = model.map_or_else(Vec::new, |model| model.reasons(record, &known.fitted_again));
    basis.reasons.extend(reasons.iter().cloned());
    basis.reasons.extend(contradictions.iter().map(|contradiction| contradiction.reason.clone()));
    let is_single_tone = is_single_tone(&observations, policy);
    if is_single_tone {
        basis.reasons.push(Reason::SingleTone);
    }
    let circumstances = Circumstances::new(basis, &settings.known, observations.span_s(), policy);
    let mut judgements = circumstances.judge(&mut known.fit);
    judgements.withhold_from_valley(&mut known.fit, false);
    let fitted = FittedAnswer {
        record,
        fit: &known.fit,
        options,
        is_noise_given: noise_std_k.is_some(),
        is_total_delay: false,
        judgements,
    };
    let is_explained = excess.is_some_and(|excess| excess.is_bounded(policy));
    let status = match (fitted.is_determined(), is_explained) {
        (false, _) => Status::NotIdentifiable,
        (true, false) => Status::ModelRejected,
        (true, true) => Status::Ok,
    };
    let mut out = fitted.characterisation(status);
    out.model_remarks = reasons.iter().filter_map(Reason::caution).collect();
    if is_single_tone {
        out.warnings.push(Remark::SingleTone.to_string());
        out.leave_undetermined();
    }
    let listed = |effects: &mut dyn Iterator<Item = Identifier>| -> String {
        effects.map(Identifier::name).collect::<Vec<_>>().join(", ")
    };
    if !effects.is_empty() && !is_own {
        let names = listed(&mut effects.iter().map(|e| e.effect));
        out.warnings.push(format!(
            "effects held at the values of the model: {names}. The intervals do not cover the uncertainty of these values"
        ));
    }
    let otherwise = match model {
        Some(_) => "the model is not that of these sensors",
        None => "an effect is missing: a diagnosis looks for one",
    };
    out.warnings.extend(contradictions.iter().map(|contradiction| format!("{}. Or {otherwise}", contradiction.remark)));
    out.warnings.extend(model.and_then(|model| at_other_flow(model, &observations)));
    if !known.fitted_again.is_empty() && !is_own {
        let again = listed(&mut known.fitted_again.iter().copied());
        out.warnings.push(format!("effects fitted again, because they belong to a record and not to the rig: {again}"));
    }
    out.warnings.extend(remark_on_options(options, "a fit with a model"));
    Ok((out, known.fit))
}

/// Contradictions between the time constants that were given and those of `alone`, a fit without them. There are none where `alone`
/// leaves more than intervals cover: what is missing may account for the difference. Where it leaves less than that, but more than
/// noise, numbers are at best conditional.
fn contradictions(given: &[Known], alone: &ModelFit, has_noise: bool, policy: &Policy) -> Vec<Contradiction> {
    if !excess(alone, has_noise).is_some_and(|excess| excess.is_bounded(policy)) {
        return Vec::new();
    }
    let grade = if alone.is_contradicted() { Grade::Conditional } else { Grade::NoGo };
    let of = |known: &Known| {
        let own = &alone.time_constants[sensor_of(known)?];
        Contradiction::of(known, own.value_s?, own.standard_error_s?, grade)
    };
    given.iter().filter_map(of).collect()
}

/// At which flow the numbers of a model hold, where that is not the mean flow of the record.
fn at_other_flow(model: &Model, observations: &Observations) -> Option<String> {
    let flow = observations.flow()?;
    let own = flow.reference();
    let mut numbers = model.effects.iter().flat_map(|effect| &effect.parameters);
    let reference = numbers.find(|p| p.value.name == flow.kind().reference_name())?;
    let (name, value) = (reference.value.name.replace('_', " "), reference.value.value);
    ((own / value - 1.0).abs() > MIN_FLOW_DIFFERENCE).then(|| {
        format!(
            "time constants and delays are those at the {name} of the model, {}, not at that of this record, {}: they change with it as the \
             model says",
            rounded(value),
            rounded(own)
        )
    })
}

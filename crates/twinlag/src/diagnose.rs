//! The closed loop on a record: schema `twinlag.diagnosis/1`.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};
use twinlag_cross_relation::Parameter;
use twinlag_diagnose::{
    BeforeAfter, Diagnosis as Core, Evidence, Identifier, KnownEffect, KnownTimeConstant, ModelFit, Observations,
    Policy, Settings, Stretch, TimeConstant, Unexplained, Value, Verdict,
};
use twinlag_record::{Record, SamplingKind};

use crate::characterisation::{
    Characterisation, Difference, Estimate, FreeParameters, IntervalMethod, MadeBy, RecordSummary, Residual,
    SensorEstimate, Status,
};
use crate::characterise::characterise;
use crate::compensate::gas;
use crate::error::Error;
use crate::options::Options;
use twinlag_estimate::{IntervalBasis, Known};

/// Samples of a stretch below which it is left out.
const SHORTEST: usize = 8;

/// What a diagnosis may assume besides the options of a characterisation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DiagnoseOptions {
    /// Noise, known time constants, and how the two-lag model is characterised.
    pub characterise: Options,
    /// Effects that are not to be considered, by name.
    pub without: Vec<Identifier>,
}

/// An effect that was found, as scripts read it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedEffect {
    /// The effect.
    pub effect: Identifier,
    /// Name of the channel that has the effect; `None` if both have it, or if the record does not
    /// determine which.
    pub channel: Option<String>,
    /// Name of the channel to which the parameters refer; `None` if they refer to both.
    pub fitted_in: Option<String>,
    /// Parameters of the effect.
    pub parameters: Vec<Value>,
    /// Why the effect was added; `None` for defects of the data, which are seen directly and not
    /// inferred.
    pub evidence: Option<Evidence>,
    /// Other effects that explain this record equally well.
    pub alternatives: Vec<Identifier>,
    /// What was seen in the data, for an effect without parameters.
    pub seen: Option<String>,
    /// What it is.
    pub explanation: String,
    /// What can be done about it at the rig.
    pub advice: String,
}

/// The detection limit of an effect that was not found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedLimit {
    /// The effect.
    pub effect: Identifier,
    /// Name of the channel; `None` if the effect is of both, or relative.
    pub channel: Option<String>,
    /// Main parameter of the effect.
    pub parameter: String,
    /// The smallest size that would have been distinguished from chance.
    pub size: f64,
    /// Unit of the size.
    pub unit: String,
}

/// Errors before and after adding the effects. All but `chi2_per_dof` are computed on blocks used
/// neither to choose effects nor to fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorBeforeAfter {
    /// Energy of the whitened residual per degree of freedom, on the whole record.
    pub chi2_per_dof: BeforeAfter<f64>,
    /// Root mean square of the whitened residual on blocks that were held out.
    pub held_out_normalised_rms: BeforeAfter<f64>,
    /// Root mean square difference of the two inferred gas temperatures there, K.
    #[serde(rename = "held_out_input_difference_K")]
    pub held_out_input_difference_k: BeforeAfter<f64>,
    /// Root mean square error of the gas temperature against the reference there, K; `None` without a reference.
    #[serde(rename = "reference_rmse_K")]
    pub reference_rmse_k: Option<BeforeAfter<f64>>,
}

/// The answer of the closed loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// `twinlag.diagnosis/1`.
    pub schema: String,
    /// The two-first-order-lag model.
    pub base: Characterisation,
    /// The verdict.
    pub verdict: Verdict,
    /// Effects in the order in which they were added.
    pub effects: Vec<NamedEffect>,
    /// Errors before and after.
    pub error: ErrorBeforeAfter,
    /// The model with the effects.
    #[serde(rename = "final")]
    pub last: Characterisation,
    /// The unexplained part of the residual, if there is one.
    pub unexplained: Option<Unexplained>,
    /// What these readings cannot reveal: some of it no record of two sensors can, some of it not
    /// this one.
    pub not_testable: Vec<String>,
    /// Detection limits of the effects that were not found.
    pub limits: Vec<NamedLimit>,
    /// What to know before using the numbers.
    pub remarks: Vec<String>,
    /// Effects that were not considered, as asked.
    pub without: Vec<Identifier>,
    /// Whether the record has a measured flow, on which time constants may depend.
    pub has_flow: bool,
    /// Numbers for the pictures; not part of the JSON.
    #[serde(skip)]
    pub core: Option<Box<Core>>,
}

impl Diagnosis {
    /// The schema's name and number.
    pub const SCHEMA: &'static str = "twinlag.diagnosis/1";
}

/// A model that was found in one record, to be used on others: schema `twinlag.model/1`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// `twinlag.model/1`.
    pub schema: String,
    /// Names of the channels.
    pub channels: [String; 2],
    /// Time constants, s; `None` where the record did not determine them.
    pub time_constants_s: [Option<f64>; 2],
    /// Noise of the channels, K.
    #[serde(rename = "noise_std_K")]
    pub noise_std_k: [f64; 2],
    /// The effects.
    pub effects: Vec<ModelEffect>,
    /// The program that made this answer, and its options.
    pub made_by: MadeBy,
}

/// An effect of a [`Model`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelEffect {
    /// The effect.
    pub effect: Identifier,
    /// Name of the channel that has the effect; `None` if both have it.
    pub channel: Option<String>,
    /// Parameters of the effect.
    pub parameters: Vec<Value>,
}

impl Model {
    /// The schema's name and number.
    pub const SCHEMA: &'static str = "twinlag.model/1";

    /// The model of two first-order lags, without any effect.
    pub fn of_two_lags(channels: [String; 2]) -> Self {
        Self {
            schema: Self::SCHEMA.into(),
            channels,
            time_constants_s: [None; 2],
            noise_std_k: [1.0; 2],
            effects: Vec::new(),
            made_by: MadeBy {
                program: "twinlag".into(),
                version: env!("CARGO_PKG_VERSION").into(),
                options: Options::default(),
            },
        }
    }
}

impl Diagnosis {
    /// The model with the effects that were found, to be used on other records of the same rig.
    pub fn model(&self) -> Model {
        Model {
            schema: Model::SCHEMA.into(),
            channels: self.last.record.channels.clone(),
            time_constants_s: [0, 1].map(|i| self.last.sensors[i].time_constant_s),
            noise_std_k: [0, 1].map(|i| self.last.sensors[i].noise_std_k),
            effects: self
                .effects
                .iter()
                .map(|e| ModelEffect {
                    effect: e.effect,
                    channel: e.fitted_in.clone(),
                    parameters: e.parameters.clone(),
                })
                .collect(),
            made_by: self.last.made_by.clone(),
        }
    }
}

/// Estimates both time constants of `record`, with the effects of `model` held fixed.
///
/// # Errors
/// As [`diagnose`]; also if an effect has parameters that this version does not know.
pub fn characterise_with(record: &Record, model: &Model, options: &Options) -> Result<Characterisation, Error> {
    if model.effects.is_empty() {
        check_channels(record, model)?;
        check_numbers(model)?;
        let mut out = characterise(record, options)?;
        out.warnings.push("the model has no effects: it is two first-order lags".into());
        return Ok(out);
    }
    Ok(with_model(record, model, options)?.0)
}

pub(crate) fn check_channels(record: &Record, model: &Model) -> Result<(), Error> {
    if model.channels == record.channels {
        Ok(())
    } else {
        Err(Error::ModelChannels { model: model.channels.clone(), record: record.channels.clone() })
    }
}

/// The effects of a model by the places of their channels.
pub(crate) fn known_effects(model: &Model) -> Vec<KnownEffect> {
    let place = |name: &String| model.channels.iter().position(|c| c == name);
    model
        .effects
        .iter()
        .map(|e| KnownEffect {
            effect: e.effect,
            channel: e.channel.as_ref().and_then(place),
            parameters: e.parameters.iter().map(|p| (p.name.clone(), p.value)).collect(),
        })
        .collect()
}

pub(crate) fn check_numbers(model: &Model) -> Result<(), Error> {
    let noise = (1..).zip(&model.noise_std_k).map(|(i, k)| (format!("a noise of channel {i} of"), *k));
    let tau = (1..)
        .zip(&model.time_constants_s)
        .filter_map(|(i, s)| Some((format!("a time constant of sensor {i} of"), (*s)?)));
    match noise.chain(tau).find(|(_, got)| !got.is_finite() || *got <= 0.0) {
        Some((what, got)) => Err(Error::ModelNumber { what, got }),
        None => Ok(()),
    }
}

/// Estimates both time constants with the effects of a model held fixed, and returns the fit as
/// well.
pub(crate) fn with_model(
    record: &Record,
    model: &Model,
    options: &Options,
) -> Result<(Characterisation, ModelFit), Error> {
    check_channels(record, model)?;
    check_numbers(model)?;
    let base = characterise(record, options)?;
    let (observations, _) = observations(record)?;
    // Coloured noise was found beside white noise of these levels: third differences see both.
    let has_noise = model.effects.iter().any(|e| e.effect.is_noise());
    let noise_std_k = options.noise_std_k.or(has_noise.then_some(model.noise_std_k));
    let settings = Settings { noise_std_k, known: known(options), ..Settings::default() };
    let effects = known_effects(model);
    let known = twinlag_diagnose::fit_with(&observations, &settings, &effects)?;
    let fit = known.fit;
    let is_left = fit.is_contradicted();
    let is_determined = fit.time_constants.iter().all(|t| t.value_s.is_some());
    let status = match (is_determined, is_left) {
        (false, _) => Status::NotIdentifiable,
        (true, true) => Status::ModelRejected,
        (true, false) => Status::Ok,
    };
    let names: Vec<&str> = model.effects.iter().map(|e| e.effect.name()).collect();
    let mut out = of_fit(&base, &fit, status, FreeParameters { gain: None, offset_k: None }, options);
    if !names.is_empty() {
        out.warnings.push(format!("effects held at the values of the model: {}", names.join(", ")));
    }
    if !known.fitted_again.is_empty() {
        let again: Vec<&str> = known.fitted_again.iter().map(|e| e.name()).collect();
        out.warnings.push(format!(
            "effects fitted again, because they belong to a record and not to the rig: \
                {}",
            again.join(", ")
        ));
    }
    if options.free_gain || options.free_offset || options.second_order != [false; 2] {
        out.warnings.push(
            "the request to fit gain, offset or second lags is ignored, because the model determines \
                what is fitted"
                .into(),
        );
    }
    Ok((out, fit))
}

/// Progress callback: `(task, done, total)`.
pub type DiagnoseWatch<'a> = &'a (dyn Fn(&str, usize, usize) + Sync);

/// Finds which physical effects two first-order lags fail to describe in `record`.
///
/// # Errors
/// As [`characterise`]; [`Error::Diagnose`] for a record that is too short or in which a channel never changes.
pub fn diagnose(record: &Record, options: &DiagnoseOptions, watch: DiagnoseWatch<'_>) -> Result<Diagnosis, Error> {
    let base = characterise(record, &options.characterise)?;
    let (observations, rows) = observations(record)?;
    let settings = Settings {
        noise_std_k: options.characterise.noise_std_k,
        known: known(&options.characterise),
        effects: Identifier::ALL.into_iter().filter(|e| !options.without.contains(e)).collect(),
        ..Settings::default()
    };
    let core = twinlag_diagnose::diagnose(&observations, &settings, &|task, done, of| {
        watch(task, done, of);
        ControlFlow::Continue(())
    })?;
    let error = ErrorBeforeAfter {
        chi2_per_dof: core.error.chi2_per_dof,
        held_out_normalised_rms: core.error.held_out_normalised_rms,
        held_out_input_difference_k: core.error.held_out_input_difference_k,
        reference_rmse_k: reference_rmse(record, &rows, &core),
    };
    let effects = core
        .effects
        .iter()
        .map(|f| NamedEffect {
            effect: f.effect,
            channel: f.channel.map(|i| record.channels[i].clone()),
            fitted_in: f.fitted_in.map(|i| record.channels[i].clone()),
            parameters: f.parameters.clone(),
            evidence: f.evidence,
            alternatives: f.alternatives.clone(),
            seen: f.seen.clone(),
            explanation: f.effect.about().explanation.into(),
            advice: f.effect.about().advice.into(),
        })
        .collect();
    let mut remarks: Vec<String> = core.remarks.iter().map(ToString::to_string).collect();
    if let Some(rmse) = error.reference_rmse_k
        && rmse.after > rmse.before
    {
        remarks.push(
            "with the effects the gas temperature is farther from the reference. Two sensors alone cannot \
             reveal errors that both share, nor which of them has a gain, an offset or a delay"
                .into(),
        );
    }
    if options.characterise.known.iter().any(|k| !matches!(k.parameter, Parameter::Tau1 | Parameter::Tau2)) {
        remarks.push(
            "the loop uses only prior knowledge of time constants; other prior knowledge is used in the two \
             lags of `base`"
                .into(),
        );
    }
    let last = if core.verdict == Verdict::Adequate { base.clone() } else { with_effects(&base, &core, options) };
    Ok(Diagnosis {
        schema: Diagnosis::SCHEMA.into(),
        base,
        verdict: core.verdict,
        effects,
        error,
        last,
        unexplained: core.unexplained.clone(),
        not_testable: core.not_testable.clone(),
        limits: core
            .limits
            .iter()
            .map(|l| NamedLimit {
                effect: l.effect,
                channel: l.channel.map(|i| record.channels[i].clone()),
                parameter: l.parameter.clone(),
                size: l.size,
                unit: l.unit.clone(),
            })
            .collect(),
        remarks,
        without: options.without.clone(),
        has_flow: record.flow.is_some(),
        core: Some(Box::new(core)),
    })
}

/// Longest run of missing samples that is bridged, as readings that say nothing.
const LONGEST_BRIDGE: usize = 20;
/// Departure from a grid, in steps, up to which stamps are on it, and the share of its samples that must be there.
const ON_GRID: f64 = 0.02;
const LEAST_OF_GRID: f64 = 0.5;

/// The sample period, where rows lie on an even grid, with or without some missing.
fn grid_s(record: &Record) -> Option<f64> {
    if record.sampling.kind != SamplingKind::Irregular {
        return Some(record.sampling.period_s);
    }
    let steps = || record.segments.iter().flat_map(|s| record.time_s[s.clone()].windows(2).map(|t| t[1] - t[0]));
    let period_s = steps().reduce(f64::min)?;
    let is_on_grid = |step: f64| {
        let ratio = step / period_s;
        (ratio - ratio.round()).abs() <= ON_GRID
    };
    let (sum, count) = steps().fold((0.0, 0.0), |(sum, count), step| (sum + step / period_s, count + 1.0));
    (steps().all(is_on_grid) && count > LEAST_OF_GRID * sum).then_some(period_s)
}

/// The rows of a diagnosis in stretches: of an even grid with missing samples in their places.
fn stretches(record: &Record, period_s: Option<f64>) -> Vec<Vec<Option<usize>>> {
    let mut out: Vec<Vec<Option<usize>>> = Vec::new();
    for segment in &record.segments {
        let Some(period_s) = period_s else {
            out.push(segment.clone().map(Some).collect());
            continue;
        };
        for row in segment.clone() {
            let last = out.last().and_then(|s| s.last().copied().flatten());
            let apart =
                last.map(|last| ((record.time_s[row] - record.time_s[last]) / period_s).round().max(1.0) as usize);
            match (apart, out.last_mut()) {
                // Neighbours of one segment, whatever the jitter of their stamps.
                (Some(_), Some(stretch)) if row > segment.start && record.sampling.kind != SamplingKind::Irregular => {
                    stretch.push(Some(row));
                }
                (Some(apart), Some(stretch)) if apart <= LONGEST_BRIDGE + 1 => {
                    stretch.extend(std::iter::repeat_n(None, apart - 1));
                    stretch.push(Some(row));
                }
                _ => out.push(vec![Some(row)]),
            }
        }
    }
    out.retain(|s| s.len() >= SHORTEST);
    out
}

/// What a diagnosis takes, and the row of each of its samples; `None` for those that are missing.
pub(crate) fn observations(record: &Record) -> Result<(Observations, Vec<Option<usize>>), Error> {
    let period_s = grid_s(record);
    let all = stretches(record, period_s);
    let stretches = all
        .iter()
        .map(|rows| {
            let first_s = rows.first().copied().flatten().map_or(0.0, |row| record.time_s[row]);
            let time_s: Vec<f64> = match period_s {
                // Evenly spaced, whatever the stamps say of each.
                Some(period_s) => (0..rows.len()).map(|k| first_s + k as f64 * period_s).collect(),
                None => rows.iter().flatten().map(|&row| record.time_s[row]).collect(),
            };
            let missing: Vec<bool> = rows.iter().map(Option::is_none).collect();
            let [t1_c, t2_c] = [&record.t1_c, &record.t2_c].map(|values| bridged(rows, values));
            let stretch = Stretch::new(time_s, [t1_c, t2_c]).with_missing([missing.clone(), missing]);
            match &record.flow {
                Some(flow) => stretch.with_flow(bridged(rows, flow)),
                None => stretch,
            }
        })
        .collect();
    Ok((Observations::new(stretches, period_s)?, all.into_iter().flatten().collect()))
}

/// Values of rows, with straight lines over those that are missing.
fn bridged(rows: &[Option<usize>], values: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; rows.len()];
    let mut before: Option<(usize, f64)> = None;
    for (k, row) in rows.iter().enumerate() {
        let Some(row) = row else { continue };
        let (from, first) = before.unwrap_or((k, values[*row]));
        for (j, value) in out[from..=k].iter_mut().enumerate() {
            let share = if k > from { j as f64 / (k - from) as f64 } else { 1.0 };
            *value = first + share * (values[*row] - first);
        }
        before = Some((k, values[*row]));
    }
    out
}

pub(crate) fn known(options: &Options) -> Vec<KnownTimeConstant> {
    options
        .known
        .iter()
        .filter_map(|k| {
            let sensor = match k.parameter {
                Parameter::Tau1 => 0,
                Parameter::Tau2 => 1,
                _ => return None,
            };
            Some(KnownTimeConstant { sensor, value_s: k.value, std_s: k.std })
        })
        .collect()
}

/// Errors of the gas temperature of each model ([`crate::compensate()`]) against the reference on the blocks that judge.
fn reference_rmse(record: &Record, rows: &[Option<usize>], core: &Core) -> Option<BeforeAfter<f64>> {
    let reference = record.reference_c.as_ref()?;
    let rmse = |fit: &ModelFit| {
        let trace = &fit.trace;
        let gas = gas(fit)?;
        let errors: Vec<f64> = (0..trace.sample.len())
            .filter(|&k| trace.is_judge[k])
            .map(|k| trace.sample[k])
            .filter_map(|sample| Some(gas.gas_c[sample] - reference[rows[sample]?]))
            .filter(|e| e.is_finite())
            .collect();
        (!errors.is_empty()).then(|| (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt())
    };
    Some(BeforeAfter { before: rmse(&core.base)?, after: rmse(&core.last)? })
}

/// The characterisation with the effects in the model.
fn with_effects(base: &Characterisation, core: &Core, options: &DiagnoseOptions) -> Characterisation {
    let fit = &core.last;
    let is_determined = fit.time_constants.iter().all(|t| t.value_s.is_some());
    let status = match (core.verdict, is_determined) {
        (Verdict::Refused, _) | (_, false) => Status::NotIdentifiable,
        (Verdict::Explained, _) => Status::Ok,
        _ => Status::ModelRejected,
    };
    let free = |name: &str| {
        core.effects.iter().filter(|f| f.effect == Identifier::CALIBRATION).flat_map(|f| &f.parameters).find_map(|p| {
            let interval_95 = p.interval_95?;
            (p.name == name).then_some(Estimate { value: p.value, standard_error: p.standard_error, interval_95 })
        })
    };
    let free = FreeParameters { gain: free("gain"), offset_k: free("offset") };
    let mut out = of_fit(base, fit, status, free, &options.characterise);
    out.warnings = core.remarks.iter().map(ToString::to_string).collect();
    out
}

/// A characterisation with the numbers of `fit`.
pub(crate) fn of_fit(
    base: &Characterisation,
    fit: &ModelFit,
    status: Status,
    free: FreeParameters,
    options: &Options,
) -> Characterisation {
    let sensor = |i: usize| -> SensorEstimate {
        let TimeConstant { value_s, standard_error_s, interval_95_s } = fit.time_constants[i];
        SensorEstimate {
            time_constant_s: value_s,
            standard_error_s,
            interval_95_s,
            interval_basis: interval_95_s.map(|_| IntervalBasis::StandardError),
            second_time_constant_s: None,
            noise_std_k: fit.noise_std_k[i],
            ..base.sensors[i].clone()
        }
    };
    let not_identifiable =
        (0..2).filter(|&i| fit.time_constants[i].value_s.is_none()).map(|i| Known::NAMES[i].to_owned()).collect();
    Characterisation {
        schema: Characterisation::SCHEMA.into(),
        record: RecordSummary { ..base.record.clone() },
        estimator: "whitened".into(),
        optimiser: fit.fit.optimiser.clone(),
        hold: if base.record.sampling.kind == SamplingKind::Irregular { "bilinear" } else { "cubic-spline" }.into(),
        hold_sensitivity: None,
        sensors: [sensor(0), sensor(1)],
        time_constant_difference_s: Difference {
            value: fit.difference.value_s,
            interval_95_s: fit.difference.interval_95_s,
        },
        free,
        residual: Residual {
            chi2_per_dof: Some(fit.chi2_per_dof),
            white: fit
                .tests
                .iter()
                .find(|t| t.test == "whiteness")
                .is_none_or(|t| t.p_value >= Policy::default().rejection_p_value()),
            tests: fit.tests.clone(),
        },
        interval_method: if fit.is_weighted_by_residual {
            IntervalMethod::ResidualSpectrum
        } else {
            IntervalMethod::Information
        },
        status,
        not_identifiable,
        warnings: Vec::new(),
        fit: fit.fit.clone(),
        starts: 1,
        notes: base.notes.clone(),
        made_by: MadeBy { options: options.clone(), ..base.made_by.clone() },
    }
}

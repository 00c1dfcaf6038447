//! The gas temperature of a record with its standard deviation.

use twinlag_compensate::{Form, bandwidth_hz};
use twinlag_diagnose::{Grade, Judgement, Masked, ModelFit, Reason, Trace, Verdict};
use twinlag_record::Record;

use crate::answers::{Characterisation, Compensation, Model, ModelEffect, NamedEffect, Quality, Status};
use crate::bands::{Banded, GasFault, Reconstruction, median};
use crate::error::Error;
use crate::reference::Reference;
use crate::rows::RowOfSample;
use crate::verbs::diagnose::{DiagnoseOptions, Diagnosed, named, remark_on_options, with_effects};
use crate::verbs::following_both;
use crate::verbs::with_model::with_model;
use crate::watch::{Stop, UNWATCHED, Watch};

/// What a compensation may assume.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CompensateOptions {
    /// How the model is found, where none is given.
    pub diagnose: DiagnoseOptions,
    /// A model that was found in another record: its effects stay as they are.
    pub model: Option<Model>,
    /// Which readings the gas temperature at an instant may rest on.
    pub form: Form,
    /// The channel, 0 or 1, that is taken to be right where gain, offset or delay differ: two
    /// sensors alone cannot reveal which is.
    pub trusted: usize,
}

/// The gas temperature of `record` with its standard deviation: by the model that a diagnosis
/// finds, or by the one given.
///
/// # Errors
/// As [`crate::diagnose()`] and [`crate::characterise_with`].
///
/// ```
#[doc = include_str!("../example.txt")]
/// let answer = twinlag::compensate(&record, &CompensateOptions::default())?;
/// assert_eq!(answer.gas_c.len(), record.len());
/// // The simulated record has the true gas temperature beside it, which no estimate uses.
/// let against = answer.gas.expect("determined").reference.expect("there is one");
/// assert!(against.rmse_k < 0.5 * against.raw_rmse_k);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn compensate(record: &Record, options: &CompensateOptions) -> Result<Compensation, Error> {
    compensate_watched(record, options, UNWATCHED)
}

/// [`compensate`], with `watch` called as it goes on.
///
/// ```
#[doc = include_str!("../example.txt")]
/// use std::ops::ControlFlow;
/// use std::sync::Mutex;
///
/// // Both channels are calibrated, and known to be two first-order lags: no diagnosis is needed.
/// let mut calibrated = channels(1)?;
/// calibrated.t2_c.iter_mut().for_each(|c| *c -= 2.0);
/// let record = Record::from_channels(calibrated, SamplingChoice::Auto)?;
/// let model = Some(Model::of_two_lags(record.channels.clone()));
/// let tasks = Mutex::new(Vec::new());
/// let watch = |task: &str, _, _| {
///     tasks.lock().expect("no watch panics").push(task.to_owned());
///     ControlFlow::Continue(())
/// };
/// let answer = twinlag::compensate_watched(&record, &CompensateOptions { model, ..Default::default() }, &watch)?;
/// assert_eq!((answer.status, answer.verdict), (Status::Ok, None)); // no diagnosis, no verdict
/// assert_eq!(tasks.into_inner()?[0], "what the gas is like");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`compensate`]; [`Error::Cancelled`].
pub fn compensate_watched(
    record: &Record,
    options: &CompensateOptions,
    watch: Watch<'_>,
) -> Result<Compensation, Error> {
    let Modelled { last, mut fit, verdict, effects, warnings, model } = Modelled::of(record, options, watch)?;
    let judgement = judged(&last, verdict, &model.effects, options.trusted);
    let mut out = Compensation {
        schema: Compensation::SCHEMA.into(),
        status: Status::NotIdentifiable,
        form: options.form,
        gas: None,
        judgement,
        time_s: Vec::new(),
        gas_c: Vec::new(),
        gas_std_k: Vec::new(),
        verdict,
        effects,
        last,
        warnings,
        rig: None,
        used: None,
    };
    let is_unknown = fit.time_constants.iter().any(|t| t.value_s.is_none());
    let is_withheld = out.judgement.grade == Grade::NoGo && !options.diagnose.characterise.best_effort;
    if is_unknown || is_withheld || verdict == Some(Verdict::Refused) {
        if !is_unknown && out.last.status == Status::ModelRejected {
            out.status = Status::ModelRejected;
        }
        out.warnings.push(format!(
            "there is no gas temperature: {}. Give a known time constant, or use a model from another record",
            out.judgement.because
        ));
        return Ok(out);
    }
    let stop = Stop::new(watch);
    let found = Reconstruction::of(&mut fit, options, &stop)?.banded()?;
    stop.check()?;
    let gas = Some(found.parts.clone());
    fill(&mut out, found, record, options.diagnose.characterise.best_effort);
    out.used = out.gas.is_some().then_some(Model { gas, ..model });
    Ok(out)
}

/// The judgement of a gas temperature by the model `last` with `effects`.
fn judged(last: &Characterisation, verdict: Option<Verdict>, effects: &[ModelEffect], trusted: usize) -> Judgement {
    if verdict == Some(Verdict::Refused) {
        return Judgement::of(&[Reason::Refused]);
    }
    let channels = &last.record.channels;
    let of_lags = following_both(channels, last.sensors.each_ref().map(|sensor| &sensor.judgement));
    let of_one_alone = effects.iter().filter(|effect| effect.effect.about().biases_gas_if_shared).map(|effect| {
        // What is relative is taken to be the other channel's than the trusted one's, whichever it was fitted in.
        let fitted_in = effect.channel.clone().filter(|_| !effect.effect.about().is_relative);
        let channel = fitted_in.unwrap_or_else(|| channels[1 - trusted].clone());
        Reason::OfOneAlone { effect: effect.effect, channel }
    });
    let of_causes = effects.iter().filter_map(|effect| cause(effect, channels));
    of_causes.chain(of_one_alone).fold(of_lags, |judgement, reason| judgement.and(&reason))
}

/// That a gas temperature is right with this effect, and not with what explains the record as well, if something does. Time constants that hold whichever it is
/// say nothing of the gas, which is another one with each. What is no property of the sensors leaves it as it is.
fn cause(effect: &ModelEffect, channels: &[String; 2]) -> Option<Reason> {
    let about = effect.effect.about();
    let channel = effect.channel.as_ref().and_then(|name| channels.iter().position(|channel| channel == name));
    let is_open = !effect.alternatives.is_empty() && !about.is_noise && !about.is_defect;
    is_open.then_some(Reason::Cause { effect: effect.effect, channel })
}

/// Writes the gas temperature into the answer.
fn fill(out: &mut Compensation, found: Banded, record: &Record, best_effort: bool) {
    if found.widened_by > 1.0 {
        out.warnings.push(format!(
            "readings deviate from their predictions {:.2} times as far as noise explains; the \
             bands are widened by this factor",
            found.widened_by
        ));
    }
    for fault in &found.faults {
        let grade = if matches!(fault, GasFault::Widened { .. }) { Grade::Conditional } else { Grade::NoGo };
        let reason = Reason::Fault { what: fault.to_string(), grade };
        out.judgement = std::mem::take(&mut out.judgement).and(&reason);
    }
    let is_said = |fault: &&GasFault| matches!(fault, GasFault::Widened { .. });
    out.warnings.extend(found.faults.iter().filter(|fault| !is_said(fault)).map(ToString::to_string));
    out.warnings.push(
        "errors that both sensors share (gain, offset, radiation, drift, delay, a second lag, a slow mode), and crosstalk that \
         replaces part of a reading, remain in the gas temperature, and no band covers them"
            .into(),
    );
    if out.judgement.grade == Grade::NoGo && !best_effort {
        out.status = Status::ModelRejected;
        return;
    }
    let faster = usize::from(found.rig.sensors[1].tau_s < found.rig.sensors[0].tau_s);
    let row_of_sample = if record.reference_c.is_some() { RowOfSample::of(record) } else { RowOfSample::default() };
    let reference = Reference::of(record, &row_of_sample);
    out.status = Status::Ok;
    out.gas = Some(Quality {
        median_std_k: median(found.gas.std_k.clone()),
        parameter_std_k: found.parameter_std_k,
        bandwidth_hz: bandwidth_hz(&found.rig, &found.prior, out.last.record.sample_period_s),
        innovation_energy: found.gas.innovation_energy,
        widened_by: found.widened_by,
        faults: found.faults,
        reference: reference.and_then(|r| r.against(&found.gas.gas_c, &found.gas.std_k, faster)),
        prior: found.prior,
    });
    out.time_s = found.time_s;
    (out.gas_c, out.gas_std_k, out.rig) = (found.gas.gas_c, found.gas.std_k, Some(found.rig));
}

/// A fit without what is for its picture.
fn without_trace(mut fit: ModelFit) -> ModelFit {
    fit.trace = Trace::default();
    fit
}

/// The model, and where it comes from.
struct Modelled {
    last: Characterisation,
    fit: ModelFit,
    verdict: Option<Verdict>,
    effects: Vec<NamedEffect>,
    warnings: Vec<String>,
    /// As it is saved.
    model: Model,
}

impl Modelled {
    fn of(record: &Record, options: &CompensateOptions, watch: Watch<'_>) -> Result<Self, Error> {
        if let Some(model) = &options.model {
            let (last, fit) = with_model(record, Some(model), &options.diagnose.characterise)?;
            let mut warnings = last.warnings.clone();
            if !options.diagnose.without.is_empty() {
                warnings.push(
                    "effects that a diagnosis is to leave out have no part here: the effects are those of the model"
                        .into(),
                );
            }
            return Ok(Self {
                last,
                fit: without_trace(fit),
                verdict: None,
                effects: Vec::new(),
                warnings,
                model: model.clone(),
            });
        }
        let Diagnosed { rows, core } = Diagnosed::of(record, &options.diagnose, watch)?;
        let place = |masked: &mut Masked| rows.place(masked, record);
        let effects = named(record, &core, place, options.diagnose.characterise.best_effort);
        let last = with_effects(record, &options.diagnose, &core, &effects);
        let unused = remark_on_options(&options.diagnose.characterise, "a diagnosis");
        let warnings = core.remarks.iter().map(ToString::to_string).chain(unused).collect();
        Ok(Self {
            model: Model::found(&core, &last, None),
            last,
            verdict: Some(core.verdict),
            effects,
            warnings,
            fit: without_trace(core.last),
        })
    }
}

//! The closed loop on a record.

use twinlag_diagnose::{
    Diagnosis as Core, Identifier, Judgements, Masked, ModelFit, Policy, Remark, Settings, Verdict,
    diagnose as close_the_loop,
};
use twinlag_estimate::{Hold, Intervals};
use twinlag_record::Record;

use crate::answers::{
    Characterisation, Diagnosis, ErrorBeforeAfter, FittedAnswer, FoundIn, FreeParameters, GasSpectrum, LeftOutUnit,
    NamedEffect, Status, TransferAnswer,
};
use crate::error::Error;
use crate::options::Options;
use crate::reference::Reference;
use crate::rows::{Rows, check_flow, settings_of};
use crate::setting::{Setting, listed};
use crate::verbs::sensor_of;
use crate::watch::{UNWATCHED, Watch};

/// What a diagnosis may assume.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DiagnoseOptions {
    /// Noise and known time constants. The other options of a characterisation say how the two-lag
    /// model is fitted; the loop has its own way, and remarks on those that are set.
    pub characterise: Options,
    /// Effects that are not to be considered.
    pub without: Vec<Identifier>,
    /// The numbers that decide what is said.
    pub policy: Policy,
}

/// Finds what two first-order lags leave over in `record`, and which effects account for it.
///
/// # Errors
/// [`Error::Model`] for a record that is too short or in which a channel never changes;
/// [`Error::Setting`] for options that contradict each other.
///
/// ```
#[doc = include_str!("../example.txt")]
/// // The second channel of this record reads 2 K too hot. Nobody says so.
/// let answer = twinlag::diagnose(&record, &DiagnoseOptions::default())?;
/// assert_eq!(answer.verdict, Verdict::Explained);
/// assert_eq!(answer.effects[0].effect, Identifier::CALIBRATION);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn diagnose(record: &Record, options: &DiagnoseOptions) -> Result<Diagnosis, Error> {
    diagnose_watched(record, options, UNWATCHED)
}

/// [`diagnose`], with `watch` called as it goes on.
///
/// ```
#[doc = include_str!("../example.txt")]
/// use std::ops::ControlFlow;
///
/// // A program that is about to end lets the diagnosis go.
/// let is_ending = true;
/// let watch = |_: &str, _, _| if is_ending { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
/// let answer = twinlag::diagnose_watched(&record, &DiagnoseOptions::default(), &watch);
/// assert_eq!(answer.err(), Some(Error::Cancelled));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`diagnose`]; [`Error::Cancelled`].
pub fn diagnose_watched(record: &Record, options: &DiagnoseOptions, watch: Watch<'_>) -> Result<Diagnosis, Error> {
    let Diagnosed { rows, core } = Diagnosed::of(record, options, watch)?;
    let reference = Reference::of(record, &rows.of_sample);
    let error = ErrorBeforeAfter {
        budget: core.error,
        reference_rmse_k: reference.and_then(|reference| reference.before_and_after(&core)),
    };
    Ok(answer(record, options, core, error, |masked| rows.place(masked, record)))
}

/// The answer with the names of channels and files.
///
/// - `place`: puts rows of the file in the place of samples
pub(crate) fn answer(
    record: &Record,
    options: &DiagnoseOptions,
    core: Core,
    error: ErrorBeforeAfter,
    place: impl FnMut(&mut Masked),
) -> Diagnosis {
    let mut remarks: Vec<String> = core.remarks.iter().map(ToString::to_string).collect();
    remarks.extend(remark_on_reference(&error));
    remarks.extend(remark_on_options(&options.characterise, "a diagnosis"));
    let named = named(record, &core, place, options.characterise.best_effort);
    Diagnosis {
        schema: Diagnosis::SCHEMA.into(),
        base: base(record, options, &core),
        verdict: core.verdict,
        error,
        last: with_effects(record, options, &core, &named),
        effects: named,
        unexplained: core.unexplained.clone(),
        explained_to: core.explained_to,
        not_testable: core.not_testable.clone(),
        limits: core.limits.iter().map(|l| l.named(&record.channels)).collect(),
        if_known: core.if_known.as_ref().map(|values| values.named(&record.channels)),
        records: Vec::new(),
        transfer: core.transfer.as_ref().map(|transfer| TransferAnswer::of(transfer, LeftOutUnit::Block)),
        remarks,
        without: options.without.clone(),
        found_in: Some(FoundIn::of(record)),
        gas_spectrum: GasSpectrum::of(&core.last.trace.gas_c),
        has_flow: record.flow.is_some() || record.speed_m_s.is_some(),
        moves: core.moves.clone(),
        policy: core.policy.clone(),
        core: Some(Box::new(core)),
    }
}

/// What the loop says of a record, and the rows that it is of.
pub(crate) struct Diagnosed {
    pub(crate) rows: Rows,
    pub(crate) core: Core,
}

impl Diagnosed {
    pub(crate) fn of(record: &Record, options: &DiagnoseOptions, watch: Watch<'_>) -> Result<Self, Error> {
        options.characterise.check()?;
        let rows = Rows::of(record)?;
        check_flow(&rows.observations, std::slice::from_ref(record))?;
        let core = close_the_loop(&rows.observations, &settings(options), watch)?;
        Ok(Self { rows, core })
    }
}

/// What the loop may assume.
pub(crate) fn settings(options: &DiagnoseOptions) -> Settings {
    Settings {
        effects: Identifier::ALL.into_iter().filter(|e| !options.without.contains(e)).collect(),
        policy: options.policy.clone(),
        ..settings_of(&options.characterise)
    }
}

/// The two-lag model that the effects were added to.
fn base(record: &Record, options: &DiagnoseOptions, core: &Core) -> Characterisation {
    let fitted = fitted(record, options, &core.base, &core.base_judgements);
    let lacks_an_effect = core.base.is_contradicted() || core.effects.iter().any(|e| e.evidence.is_some());
    let status = if core.verdict == Verdict::Refused || !fitted.is_determined() {
        Status::NotIdentifiable
    } else if core.verdict != Verdict::Adequate && lacks_an_effect {
        Status::ModelRejected
    } else {
        Status::Ok
    };
    let mut out = fitted.characterisation(status);
    if status == Status::ModelRejected {
        out.warnings.push("two first-order lags do not explain this record: the diagnosis says what they lack".into());
    } else if status == Status::NotIdentifiable {
        out.warnings.push("two first-order lags: this record does not determine both time constants".into());
    }
    out
}

/// The effects with the names of their channels.
///
/// - `place`: puts rows of the file in the place of samples
pub(crate) fn named(
    record: &Record,
    core: &Core,
    place: impl FnMut(&mut Masked),
    best_effort: bool,
) -> Vec<NamedEffect> {
    let of = |found| NamedEffect::of(found, &record.channels, best_effort);
    let mut effects: Vec<NamedEffect> = core.effects.iter().map(of).collect();
    effects.iter_mut().flat_map(|effect| &mut effect.masked).for_each(place);
    effects
}

/// The model with the effects.
pub(crate) fn with_effects(
    record: &Record,
    options: &DiagnoseOptions,
    core: &Core,
    effects: &[NamedEffect],
) -> Characterisation {
    let is_total_delay = core.remarks.contains(&Remark::LagAlone);
    let fitted = FittedAnswer { is_total_delay, ..fitted(record, options, &core.last, &core.judgements) };
    let status = match (core.verdict, fitted.is_determined()) {
        (Verdict::Refused, _) | (_, false) => Status::NotIdentifiable,
        (Verdict::Adequate | Verdict::Explained, _) => Status::Ok,
        _ => Status::ModelRejected,
    };
    let mut out = fitted.characterisation(status);
    out.free = FreeParameters::among(effects);
    out.warnings.extend(core.remarks.iter().map(ToString::to_string));
    out
}

fn fitted<'a>(
    record: &'a Record,
    options: &'a DiagnoseOptions,
    fit: &'a ModelFit,
    judgements: &Judgements,
) -> FittedAnswer<'a> {
    let options = &options.characterise;
    FittedAnswer {
        record,
        fit,
        options,
        is_noise_given: options.noise_std_k.is_some(),
        is_total_delay: false,
        judgements: judgements.clone(),
    }
}

fn remark_on_reference(error: &ErrorBeforeAfter) -> Option<String> {
    let rmse = error.reference_rmse_k?;
    (rmse.after > rmse.before).then(|| {
        "with the effects the gas temperature is farther from the reference. Two sensors alone cannot reveal errors that \
         both share, nor which of them has a gain, an offset or a delay"
            .into()
    })
}

/// What was asked of the two-lag model that the loop does not use.
pub(super) fn unused(options: &Options) -> Vec<Setting> {
    let asked = [
        (options.estimator != Options::default().estimator, Setting::Estimator),
        (options.optimiser != Options::default().optimiser, Setting::Optimiser),
        (options.hold != Hold::Auto, Setting::Hold),
        (options.noise_ratio.is_some(), Setting::NoiseRatio),
        (!options.quiet_segments_s.is_empty(), Setting::QuietSegment),
        (options.noise_colour != Options::default().noise_colour, Setting::NoiseColour),
        (options.free_gain || options.free_offset, Setting::Free),
        (options.second_order != [false; 2], Setting::SecondOrder),
        (options.known.iter().any(|known| sensor_of(known).is_none()), Setting::Known),
        (options.discard.is_some(), Setting::Discard),
        (options.intervals != Intervals::Auto, Setting::Intervals),
    ];
    asked.into_iter().filter_map(|(is_asked, what)| is_asked.then_some(what)).collect()
}

/// A remark on the options that `what` does not use; `None` where it uses all.
pub(super) fn remark_on_options(options: &Options, what: &str) -> Option<String> {
    let unused = unused(options);
    (!unused.is_empty()).then(|| {
        format!(
            "{what} uses the noise levels and the time constants that are given, and nothing else that is asked of a \
             characterisation: not used here: {}",
            listed(&unused)
        )
    })
}

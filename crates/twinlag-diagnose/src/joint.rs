//! Several records of one rig: one model, and what each record says of it.

use twinlag_model::{
    Between, BetweenRecords, Contradicted, Fitted, ModelError, Observations, OneRecord, OwnValue, Policy, Settings,
    Value, Watch,
};

use crate::conclude::{conclude, is_explained, leaves_more_than_noise};
use crate::diagnose::searched;
use crate::diagnosis::{Diagnosis, Verdict};
use crate::moves::State;
use crate::naming::own_numbers;
use crate::odd_one::OddOne;
use crate::transfer::{
    Across, EffectInChannel, LeftOut, Transfer, transfer, withdraw_what_does_not_transfer,
    withdraw_what_lowers_no_error,
};

/// A number that belongs to a record.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct OwnNumber {
    /// The effect that it is of.
    pub effect: EffectInChannel,
    /// The number.
    pub number: Value,
}

/// A number that all records share and one contradicts.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Disagreement {
    /// The effect that it is of; `None` of a time constant.
    pub effect: Option<EffectInChannel>,
    /// Its name: `T1`, `T2`, or a parameter of the effect.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// What the record says, and the others.
    pub values: Contradicted,
}

impl Disagreement {
    /// That on the time constant of sensor `sensor`, 0 or 1.
    pub(crate) fn of_time_constant(sensor: usize, values: Contradicted) -> Self {
        Self { effect: None, name: format!("T{}", sensor + 1), unit: "s", values }
    }
}

/// One of several records beside the others.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct OfRecord {
    /// Its samples.
    pub samples: usize,
    /// Its errors under the model of the others.
    pub left_out: LeftOut,
    /// Noise of its channels, K.
    pub noise_std_k: [f64; 2],
    /// What it says of each time constant by itself, the rest of the model at its best; `None` where it says nothing, or so little that the
    /// standard error is no less than [`Policy::vague_log_std`] of the value.
    pub time_constants_s: [Option<OwnValue>; 2],
    /// Numbers of its own; none where more than noise is left over.
    pub own: Vec<OwnNumber>,
    /// Whether it agrees with the others: not so if it contradicts them on a number, or if it is explained and so are they, but not
    /// together. `None` where the records do not say which of them it is that differs, or are not explained at all; where the model of the
    /// others leaves more than noise in it; and where the others are explained by a noise alone, which may stand for what differs among
    /// them.
    pub agrees: Option<bool>,
    /// Shared numbers on which it contradicts all others together, or on which two records contradict each other.
    pub disagreements: Vec<Disagreement>,
    /// Effects that it shows alone, noise aside; `None` where it was not looked at alone, since nothing speaks against it.
    pub found_alone: Option<Vec<EffectInChannel>>,
}

/// The result of a diagnosis of several records.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct JointDiagnosis {
    /// The diagnosis of all of them together.
    pub diagnosis: Diagnosis,
    /// Each record, in the order in which they came.
    pub records: Vec<OfRecord>,
    /// Errors on records that had no part in finding the model.
    pub transfer: Transfer,
}

/// Finds what two first-order lags leave over in several records of one rig, and which effects account for it in all of them.
///
/// What belongs to the rig is one number for all records; what belongs to a record (a drift, the phase of a line, a flow that
/// changes, noise levels) each has for itself. An effect is named only if it lowers the error of records that had no part in
/// fitting it, and an interval covers what the records differ.
///
/// ```
/// use std::ops::ControlFlow;
///
/// use twinlag_diagnose::{Identifier, Observations, Settings, Stretch, diagnose_records};
/// use twinlag_signal::{Gas, Noise, Record, Rig, Sensor, Signal, Turbulence};
///
/// // Two records of one rig, whose second channel reads 1 K too hot.
/// let record = |seed| -> Result<Observations, Box<dyn std::error::Error>> {
///     let mut sensors = [0.03, 0.11].map(|tau_s| Sensor::new(format!("{tau_s}"), tau_s));
///     sensors.iter_mut().for_each(|sensor| sensor.noise = Some(Noise::white(0.1)));
///     sensors[1].offset_k = 1.0;
///     let gas = Gas::new(300.0, Signal::Turbulence(Turbulence { std_k: 8.0, corner_hz: 1.0, cutoff_hz: 100.0 }));
///     let record = Rig::new(seed, Record::new(1000, 0.01), gas, sensors)?.simulate()?;
///     let stretch = Stretch::new(record.time_s, [record.t1_c, record.t2_c]);
///     Ok(Observations::new(vec![stretch], Some(0.01))?)
/// };
/// let watch = |_: &str, _, _| ControlFlow::Continue(());
/// let joint = diagnose_records(&[record(1)?, record(2)?], &Settings::default(), &watch)?;
/// assert_eq!(joint.diagnosis.effects[0].effect, Identifier::CALIBRATION);
/// assert!(joint.records.iter().all(|record| record.disagreements.is_empty()));
/// let rms = joint.transfer.normalised_rms;
/// assert!(rms.before > 1.5 && rms.after < 1.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`crate::diagnose()`]; [`ModelError::TooFewRecords`] for less than two records.
pub fn diagnose_records(
    records: &[Observations],
    settings: &Settings,
    watch: Watch<'_>,
) -> Result<JointDiagnosis, ModelError> {
    if records.len() < 2 {
        return Err(ModelError::TooFewRecords { records: records.len() });
    }
    let without_noise = without_noise(settings);
    let Look { mut state, tones, transfer, are_explained } = look(records, settings, &without_noise, watch)?;
    let noise_std_k: Vec<[f64; 2]> = records_noise_k(&state);
    let is_one_rig = are_explained && !state.has_noise();
    let odd = if is_one_rig { None } else { OddOne::find(&state, &transfer, settings, watch)? };
    if let Some(odd) = odd.as_ref().filter(|odd| odd.differs()) {
        odd.withdraw_what_neither_needs(&mut state);
    }
    let across = Across::new(
        &transfer,
        &state.current.model,
        records,
        odd.as_ref().is_some_and(OddOne::differs),
        &settings.policy,
    );
    let (diagnosis, last) = conclude(state, settings, tones, Some(&across))?;
    let is_whole = matches!(diagnosis.verdict, Verdict::Adequate | Verdict::Explained);
    let odd = odd.filter(|_| !is_whole);
    let between = diagnosis.last.between.as_ref();
    let contradictions: Vec<Vec<Disagreement>> =
        (0..records.len()).map(|record| disagreements(record, &last, between, settings)).collect();
    let is_any_named = contradictions.iter().any(|of_record| !of_record.is_empty());
    let differ = between.is_some_and(|between| differ(between, &settings.policy));
    let is_odd = |record: usize| odd.as_ref().is_some_and(|odd| odd.is_known && odd.record == record);
    let is_odd_known = odd.as_ref().is_some_and(|odd| odd.is_known);
    let do_agree_together = is_whole && (is_any_named || !differ);
    let agrees = |record: usize| {
        if is_odd(record) || !contradictions[record].is_empty() {
            return Some(false);
        }
        (is_odd_known || (do_agree_together && !across.is_doubtful(record))).then_some(true)
    };
    // What a record says by itself that the others do not.
    let beside_the_others = |record: usize| odd.as_ref().and_then(|odd| odd.of(record));
    let of = |record: usize| OfRecord {
        samples: records[record].samples(),
        left_out: transfer.records[record].clone(),
        noise_std_k: noise_std_k[record],
        time_constants_s: [0, 1].map(|i| own_time_constant(record, between?.parameters[i].as_ref()?, &settings.policy)),
        own: if is_whole { own_numbers(record, &last, &diagnosis.last) } else { Vec::new() },
        agrees: agrees(record),
        disagreements: match (&contradictions[record][..], beside_the_others(record)) {
            ([], Some(beside)) => beside.disagreements.clone(),
            (contradictions, _) => contradictions.to_vec(),
        },
        found_alone: beside_the_others(record).map(|beside| beside.found.clone()),
    };
    let records = (0..records.len()).map(of).collect();
    Ok(JointDiagnosis { diagnosis, records, transfer })
}

/// The loop over all records, and what it finds on records that were left out.
struct Look<'a> {
    state: State<'a>,
    tones: Option<usize>,
    transfer: Transfer,
    /// Whether what was found explains them together.
    are_explained: bool,
}

impl<'a> Look<'a> {
    fn at(joined: &Observations, settings: &'a Settings, watch: Watch<'a>) -> Result<Self, ModelError> {
        let (mut state, tones) = searched(joined, settings, watch)?;
        withdraw_what_does_not_transfer(&mut state, watch)?;
        let transfer = transfer(&state, settings, watch)?;
        let are_explained = is_explained(&state, settings);
        if !are_explained {
            withdraw_what_lowers_no_error(&mut state, &transfer);
        }
        Ok(Self { state, tones, transfer, are_explained })
    }

    /// Whether only noise is left with what was found, in the records together and in each that was left out. More effects than explain a
    /// record do.
    fn holds(&self, records: &[Observations], settings: &Settings) -> bool {
        let across = Across::new(&self.transfer, &self.state.current.model, records, false, &settings.policy);
        !across.is_refuted() && (self.are_explained || !leaves_more_than_noise(&self.state, settings))
    }
}

/// Looks at all records, and once more without noise where one was found and what was found does not hold: a noise that is found first may
/// stand for several effects, none of which helps beside it. What that finds counts where it holds.
fn look<'a>(
    records: &[Observations],
    settings: &'a Settings,
    without_noise: &'a Settings,
    watch: Watch<'a>,
) -> Result<Look<'a>, ModelError> {
    let joined = Observations::joined(records)?;
    let first = Look::at(&joined, settings, watch)?;
    if !first.state.has_noise() || first.holds(records, settings) {
        return Ok(first);
    }
    let mut second = Look::at(&joined, without_noise, watch)?;
    if !second.holds(records, settings) {
        return Ok(first);
    }
    second.state.begin_with_removed_noise(&first.state);
    Ok(second)
}

/// Settings without noise among the effects that may be named.
fn without_noise(settings: &Settings) -> Settings {
    let effects = settings.effects.iter().copied().filter(|effect| !effect.is_noise()).collect();
    Settings { effects, ..settings.clone() }
}

/// A time constant as a record has it by itself; `None` where it is so uncertain that it is no estimate.
fn own_time_constant(record: usize, between: &BetweenRecords, policy: &Policy) -> Option<OwnValue> {
    let is_estimate = |own: &&OwnValue| own.standard_error < policy.vague_log_std * own.value;
    between.own.iter().find(|own| own.record == record).filter(is_estimate).copied()
}

/// Whether the records differ in a shared number by more than chance.
fn differ(between: &Between, policy: &Policy) -> bool {
    let mut numbers = between.parameters.iter().chain([&between.difference]).flatten();
    numbers.any(|number| number.p_value < policy.records_rejection_probability)
}

/// Noise of the channels of each record, K.
fn records_noise_k(state: &State<'_>) -> Vec<[f64; 2]> {
    let std_k = state.current.model.noise_std_k();
    let of = |record: &OneRecord| record.noise_std_k(std_k);
    state.prepared.each_record().iter().map(of).collect()
}

/// Shared numbers on which a record contradicts the others.
fn disagreements(record: usize, last: &Fitted, between: Option<&Between>, settings: &Settings) -> Vec<Disagreement> {
    let contradicted = between.map_or_else(Vec::new, |between| between.contradicted(&settings.policy));
    let of = |(at, values): (usize, Contradicted)| {
        let model = &last.model;
        match (0..model.effects.len()).find(|index| model.range(*index).contains(&at)) {
            None => Disagreement::of_time_constant(at, values),
            Some(index) => {
                let effect = &model.effects[index];
                let parameter = &effect.parameters()[at - model.range(index).start];
                let (name, unit) = (parameter.name.to_owned(), parameter.unit);
                Disagreement { effect: Some((effect.identifier(), effect.channel())), name, unit, values }
            }
        }
    };
    contradicted.into_iter().filter(|(_, values)| values.own.record == record).map(of).collect()
}

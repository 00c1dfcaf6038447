//! What a diagnosis of several records says of each of them.

use serde::{Deserialize, Serialize};
use twinlag_diagnose::{BeforeAfter, Disagreement, EffectInChannel, Identifier, LeftOut, Masked, OwnValue, Transfer};

use crate::answers::Characterisation;

/// What is left out in turn, so that what is found has no part in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum LeftOutUnit {
    /// A record of several.
    Record,
    /// A block of a single record.
    Block,
}

/// Errors on a record that had no part in finding the model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct TransferError {
    /// Root mean square of the whitened residual.
    pub held_out_normalised_rms: BeforeAfter<f64>,
    /// Root mean square of the difference between the two inferred gas temperatures, K.
    #[serde(rename = "held_out_input_difference_K")]
    pub held_out_input_difference_k: BeforeAfter<f64>,
}

/// Errors of records that had no part in finding the model: each is left out in turn, the loop runs on the others, and its model
/// is carried to the one that was left out, where nothing is fitted but what belongs to a record. Of a single record the same of its
/// blocks, to which the model is fitted, but not found again.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct TransferAnswer {
    /// Errors of all of them.
    #[serde(flatten)]
    pub error: TransferError,
    /// What was left out in turn.
    pub left_out: LeftOutUnit,
    /// How many of them.
    pub count: usize,
}

impl TransferAnswer {
    pub(crate) fn of(transfer: &Transfer, left_out: LeftOutUnit) -> Self {
        let error = TransferError {
            held_out_normalised_rms: transfer.normalised_rms,
            held_out_input_difference_k: transfer.input_difference_k,
        };
        Self { error, left_out, count: transfer.records.len() }
    }
}

impl TransferError {
    fn of(left_out: &LeftOut) -> Self {
        Self {
            held_out_normalised_rms: left_out.normalised_rms,
            held_out_input_difference_k: left_out.input_difference_k,
        }
    }
}

/// An effect in its channel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct EffectInPlace {
    /// The effect.
    pub effect: Identifier,
    /// Its channel; `None` where it is of both, or relative.
    pub channel: Option<String>,
}

impl EffectInPlace {
    fn of((effect, channel): EffectInChannel, channels: &[String; 2]) -> Self {
        Self { effect, channel: channel.map(|i| channels[i].clone()) }
    }
}

/// A number that belongs to one record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct RecordNumber {
    /// The effect that it is of.
    #[serde(flatten)]
    pub of: EffectInPlace,
    /// Its name.
    pub name: String,
    /// The number.
    pub value: f64,
    /// Its standard error.
    pub standard_error: Option<f64>,
    /// Its 95 % interval.
    pub interval_95: Option<[f64; 2]>,
    /// Its unit.
    pub unit: String,
}

/// A time constant that all records share, as one of them has it by itself, the rest of the model at its best.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct OwnTimeConstant {
    /// The estimate, s.
    pub value_s: f64,
    /// Its standard error in that record, s.
    pub standard_error_s: f64,
}

impl OwnTimeConstant {
    fn of(own: OwnValue) -> Self {
        Self { value_s: own.value, standard_error_s: own.standard_error }
    }
}

/// A number that all records share, and that this one contradicts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct DisagreementAnswer {
    /// The effect that it is of; `None` of a time constant.
    pub of: Option<EffectInPlace>,
    /// Its name: that of the channel, or of a parameter of the effect.
    pub name: String,
    /// What this record says by itself, the rest of the model at its best.
    pub value: f64,
    /// The standard error of that.
    pub standard_error: f64,
    /// What the other records say together.
    pub others: f64,
    /// The standard error of that.
    pub others_standard_error: f64,
    /// Unit of these.
    pub unit: String,
    /// Probability of at least as large a difference by chance, if it differs from the others as these do from each other.
    pub p_value: f64,
}

impl DisagreementAnswer {
    fn of(found: &Disagreement, channels: &[String; 2]) -> Self {
        let Disagreement { effect, name, unit, values, .. } = found;
        let name = match (effect, name.as_str()) {
            (None, "T1") => channels[0].clone(),
            (None, _) => channels[1].clone(),
            (Some(_), name) => name.to_owned(),
        };
        Self {
            of: effect.map(|effect| EffectInPlace::of(effect, channels)),
            name,
            value: values.own.value,
            standard_error: values.own.standard_error,
            others: values.others,
            others_standard_error: values.others_error,
            unit: (*unit).to_owned(),
            p_value: values.p_value,
        }
    }
}

/// One of several records of a rig beside the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct RecordAnswer {
    /// File or name.
    pub source: String,
    /// Samples.
    pub samples: usize,
    /// Its errors under the model of the others.
    pub error: TransferError,
    /// Effects that were found on the others.
    pub found_on_others: Vec<EffectInPlace>,
    /// Noise of its channels, K.
    #[serde(rename = "noise_std_K")]
    pub noise_std_k: [f64; 2],
    /// Both time constants as it has them by itself, the rest of the model at its best; `None` where it does not determine one well
    /// enough for an estimate, and where none is given for all records together.
    #[serde(default)]
    pub time_constants: [Option<OwnTimeConstant>; 2],
    /// Numbers of its own; none where more than noise is left over.
    pub own: Vec<RecordNumber>,
    /// Whether it agrees with the others: not so if it contradicts them on a number, or if it is explained and so are they, but not
    /// together. `None` where the records do not say which of them it is that differs, or are not explained at all; and where the others
    /// are explained by a noise alone, which may stand for what differs among them.
    pub agrees: Option<bool>,
    /// Whether two lags and the effects that were found on them explain the others.
    pub are_others_explained: bool,
    /// Shared numbers on which it contradicts all others together, or on which two records contradict each other.
    pub disagreements: Vec<DisagreementAnswer>,
    /// Effects that it shows alone; `None` where it was not looked at alone, since nothing speaks against it.
    #[serde(default)]
    pub found_alone: Option<Vec<EffectInPlace>>,
    /// Readings that are left out of the fit, by their lines in its file.
    pub masked: Vec<Masked>,
}

impl RecordAnswer {
    /// - `shared`: what all records have together
    pub(crate) fn of(
        found: &twinlag_diagnose::OfRecord,
        source: &str,
        shared: &Characterisation,
        masked: Vec<Masked>,
    ) -> Self {
        let channels = &shared.record.channels;
        let number = |own: &twinlag_diagnose::OwnNumber| RecordNumber {
            of: EffectInPlace::of(own.effect, channels),
            name: own.number.name.clone(),
            value: own.number.value,
            standard_error: own.number.standard_error,
            interval_95: own.number.interval_95,
            unit: own.number.unit.clone(),
        };
        let in_place = |found: &[EffectInChannel]| -> Vec<EffectInPlace> {
            found.iter().map(|effect| EffectInPlace::of(*effect, channels)).collect()
        };
        let disagreements: Vec<DisagreementAnswer> =
            found.disagreements.iter().map(|one| DisagreementAnswer::of(one, channels)).collect();
        Self {
            source: source.to_owned(),
            samples: found.samples,
            error: TransferError::of(&found.left_out),
            found_on_others: in_place(&found.left_out.found),
            noise_std_k: found.noise_std_k,
            time_constants: [0, 1].map(|i| {
                let own = found.time_constants_s[i].filter(|_| shared.sensors[i].time_constant_s.is_some());
                own.map(OwnTimeConstant::of)
            }),
            own: found.own.iter().map(number).collect(),
            agrees: found.agrees,
            are_others_explained: found.left_out.are_others_explained == Some(true),
            disagreements,
            found_alone: found.found_alone.as_ref().map(|alone| in_place(alone)),
            masked,
        }
    }
}

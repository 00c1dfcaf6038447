//! The answer of the closed loop: schema `twinlag.diagnosis/1`.

use serde::{Deserialize, Serialize, Serializer};
use twinlag_diagnose::{
    BeforeAfter, Diagnosis as Core, ErrorBudget, Evidence, ExactTwin, FirstState, Found, Grade, Identifier, IfKnown,
    Judgement, Limit, Masked, Move, OtherCause, Policy, Unexplained, Value, Verdict,
};

use crate::answers::{
    Characterisation, EffectInPlace, FoundIn, GasSpectrum, LeftOutUnit, Model, ModelEffect, RecordAnswer,
    TransferAnswer,
};

/// A number of an effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct EffectNumber {
    /// Its name.
    pub name: String,
    /// The number; `None` where it may not be used.
    pub value: Option<f64>,
    /// Its standard error.
    pub standard_error: Option<f64>,
    /// Its 95 % interval.
    pub interval_95: Option<[f64; 2]>,
    /// Unit of the number.
    pub unit: String,
    /// Whether it may be used.
    #[serde(default, flatten)]
    pub judgement: Judgement,
}

/// An effect that was found, with the names of its channels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct NamedEffect {
    /// The effect.
    pub effect: Identifier,
    /// Channel that has the effect; `None` if both have it, or if the record does not determine
    /// which.
    pub channel: Option<String>,
    /// Channel to which the parameters refer; `None` if they refer to both.
    pub fitted_in: Option<String>,
    /// Parameters of the effect.
    pub parameters: Vec<EffectNumber>,
    /// Why the effect was added; `None` for defects of the data, which are seen directly and not
    /// inferred.
    pub evidence: Option<Evidence>,
    /// Other effects that explain this record equally well.
    pub alternatives: Vec<Identifier>,
    /// What no record distinguishes from it, with the time constants that it means; nothing where these are not given.
    #[serde(default)]
    pub exact_twins: Vec<NamedTwin>,
    /// Other effects that explain the record equally well and are no exact twins, each with the time constants if it is the cause;
    /// empty where the record does not determine both, and where time constants are not given.
    #[serde(default)]
    pub other_causes: Vec<NamedCause>,
    /// Both cases of the first state of the slow body that it holds; `None` where it holds none, or more than noise is left over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_state: Option<FirstState>,
    /// What was seen in the data, for an effect without parameters: a count, a step.
    pub seen: Option<String>,
    /// Readings of the channel that are left out of the fit, in order, by their lines in the file.
    #[serde(default)]
    pub masked: Vec<Masked>,
}

impl NamedEffect {
    /// An effect with the names of its channels.
    ///
    /// - `best_effort`: whether numbers are given that may not be used
    pub(crate) fn of(found: &Found, channels: &[String; 2], best_effort: bool) -> Self {
        let name = |place: Option<usize>| place.map(|i| channels[i].clone());
        let graded = found.parameters.iter().zip(&found.judgements).map(|(p, judgement)| {
            let is_given = best_effort || judgement.grade != Grade::NoGo;
            EffectNumber {
                name: p.name.clone(),
                value: is_given.then_some(p.value),
                standard_error: p.standard_error.filter(|_| is_given),
                interval_95: p.interval_95.filter(|_| is_given),
                unit: p.unit.clone(),
                judgement: judgement.clone(),
            }
        });
        Self {
            effect: found.effect,
            channel: name(found.channel),
            fitted_in: name(found.fitted_in),
            parameters: graded.collect(),
            evidence: found.evidence,
            alternatives: found.alternatives.clone(),
            exact_twins: found.exact_twins.iter().map(|twin| NamedTwin::of(twin, channels)).collect(),
            other_causes: found.other_causes.iter().map(|other| NamedCause::of(other, channels)).collect(),
            first_state: found.first_state.clone(),
            seen: found.seen.clone(),
            masked: found.masked.clone(),
        }
    }
}

/// An effect that no record distinguishes from one that was found, and the numbers if it is the cause.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct NamedTwin {
    /// The twin, with its channel.
    #[serde(flatten)]
    pub of: EffectInPlace,
    /// Its parameter.
    pub parameter: Value,
    /// Time constants of both sensors, by the names of the channels.
    pub time_constants: [Value; 2],
}

impl NamedTwin {
    fn of(twin: &ExactTwin, channels: &[String; 2]) -> Self {
        Self {
            of: EffectInPlace { effect: twin.effect, channel: Some(channels[twin.channel].clone()) },
            parameter: twin.parameter.clone(),
            time_constants: by_name(&twin.time_constants, channels),
        }
    }
}

/// An effect that explains the record equally well as one that was found, and both time constants if it is the cause.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct NamedCause {
    /// The effect, with its channel.
    #[serde(flatten)]
    pub of: EffectInPlace,
    /// Time constants of both sensors, by the names of the channels.
    pub time_constants: [Value; 2],
}

impl NamedCause {
    fn of(other: &OtherCause, channels: &[String; 2]) -> Self {
        Self {
            of: EffectInPlace { effect: other.effect, channel: other.channel.map(|i| channels[i].clone()) },
            time_constants: by_name(&other.time_constants, channels),
        }
    }
}

/// Time constants by the names of their channels.
fn by_name(time_constants: &[Value; 2], channels: &[String; 2]) -> [Value; 2] {
    [0, 1].map(|i| Value { name: channels[i].clone(), ..time_constants[i].clone() })
}

/// What the search would have seen of an effect that it did not find, with the name of its channel.
pub type NamedLimit = Limit<String>;

/// Errors before and after adding the effects. All but the energy of the residual are computed on
/// blocks used neither to choose effects nor to fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ErrorBeforeAfter {
    /// Errors that need no reference.
    #[serde(flatten)]
    pub budget: ErrorBudget,
    /// Root mean square error of the reconstructed gas temperature against the reference, K; `None`
    /// without a reference.
    #[serde(rename = "reference_rmse_K")]
    pub reference_rmse_k: Option<BeforeAfter<f64>>,
}

/// The answer of the closed loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Diagnosis {
    /// `twinlag.diagnosis/1`.
    pub schema: String,
    /// The model of two first-order lags: the fit that the effects were added to.
    pub base: Characterisation,
    /// The verdict.
    pub verdict: Verdict,
    /// Effects in the order in which they were added. In JSON each also has its `explanation` and
    /// its `advice`, which are the same in every record.
    #[serde(serialize_with = "explained")]
    #[cfg_attr(feature = "schema", schemars(with = "Vec<Explained<'static>>"))]
    pub effects: Vec<NamedEffect>,
    /// Errors before and after.
    pub error: ErrorBeforeAfter,
    /// The model with the effects.
    #[serde(rename = "final")]
    pub last: Characterisation,
    /// What is left over.
    pub unexplained: Option<Unexplained>,
    /// Energy that is left over beside that of the noise, as a share of it, where the model counts as complete; 0 where no
    /// test sees any.
    #[serde(default)]
    pub explained_to: Option<f64>,
    /// What no record of two sensors, or not this one, can reveal.
    pub not_testable: Vec<String>,
    /// What would have been seen of the effects that were not found.
    pub limits: Vec<NamedLimit>,
    /// What each value of the first time constant would make of the record; `None` where both are
    /// given and only noise is left over, or where one was known.
    #[serde(default)]
    pub if_known: Option<IfKnown<String>>,
    /// What each of several records of a rig has for itself; none of a single record.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub records: Vec<RecordAnswer>,
    /// Errors of records that had no part in finding the model, or of blocks of a single one; `None` where no model is of the whole
    /// record.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transfer: Option<TransferAnswer>,
    /// What to know before using the numbers.
    pub remarks: Vec<String>,
    /// Effects that were not considered, as asked.
    pub without: Vec<Identifier>,
    /// The data that it is of; `None` in answers of earlier versions.
    #[serde(default)]
    pub found_in: Option<FoundIn>,
    /// The spectrum of the gas as the record shows it; `None` if no evenly spaced part of it has 64 samples that change, and of records
    /// with more than 65 536 samples.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gas_spectrum: Option<GasSpectrum>,
    /// Whether a measured flow was there, with which time constants may go.
    pub has_flow: bool,
    /// What the loop did to the model, move by move; channels are counted from 0.
    #[serde(default)]
    pub moves: Vec<Move>,
    /// The numbers that decided.
    #[serde(default)]
    pub policy: Policy,
    /// The loop's own answer with the series that pictures need; not part of the JSON, so `None` in
    /// an answer that was read.
    #[serde(skip)]
    pub core: Option<Box<Core>>,
}

impl Diagnosis {
    /// The schema's name and number.
    pub const SCHEMA: &'static str = "twinlag.diagnosis/1";

    /// Root mean square of the whitened residual on blocks of a single record that were left out of the fit; `None` of several.
    pub fn on_blocks_left_out(&self) -> Option<BeforeAfter<f64>> {
        let of_blocks = self.transfer.filter(|transfer| transfer.left_out == LeftOutUnit::Block);
        of_blocks.map(|transfer| transfer.error.held_out_normalised_rms)
    }

    /// Why errors are larger with the effects than without them, where they are. The difference of the inferred inputs is not
    /// among them: it grows with a longer lag, whatever the model.
    pub fn what_got_worse(&self) -> Vec<String> {
        // Four digits are printed.
        let is_worse = |error: BeforeAfter<f64>| error.after > 1.0005 * error.before;
        let budget = &self.error.budget;
        let is_any_worse = is_worse(budget.chi2_per_dof) || is_worse(budget.held_out_normalised_rms);
        if self.effects.is_empty() || !is_any_worse {
            return Vec::new();
        }
        let is_quieter = (0..2).any(|i| self.last.sensors[i].noise_std_k < 0.999 * self.base.sensors[i].noise_std_k);
        let why = if is_quieter {
            "the residual is larger with the effects because it is in units of the noise, whose levels are lower with them"
        } else {
            "the residual is larger with the effects: they were chosen by other frequencies or other blocks than are counted \
             here, so check them at the rig before you rely on them"
        };
        vec![why.into()]
    }

    /// The model with the effects that were found, to be used on other records of the same rig. It has all numbers that
    /// were found, also those that this answer does not give; of an answer that was read from JSON those that it has.
    pub fn model(&self) -> Model {
        match &self.core {
            Some(core) => Model::found(core, &self.last, self.found_in.clone()),
            None => Model {
                verdict: Some(self.verdict),
                explained_to: self.explained_to,
                effects: self.effects.iter().map(ModelEffect::given).collect(),
                found_in: self.found_in.clone(),
                gas_spectrum: self.gas_spectrum.clone(),
                ..Model::of(&self.last)
            },
        }
    }

    /// Grades of all numbers that were asked for: both time constants, their difference, the parameters of effects.
    pub fn grades(&self) -> impl Iterator<Item = Grade> {
        let of_effects = self.effects.iter().flat_map(|e| &e.parameters).map(|p| p.judgement.grade);
        self.last.grades().into_iter().chain(of_effects)
    }
}

/// An effect with what is said of it in every record.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct Explained<'a> {
    #[serde(flatten)]
    found: &'a NamedEffect,
    explanation: &'static str,
    advice: &'static str,
}

pub(crate) fn explained<S: Serializer>(effects: &[NamedEffect], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(effects.iter().map(|found| {
        let about = found.effect.about();
        Explained { found, explanation: about.explanation, advice: about.advice }
    }))
}

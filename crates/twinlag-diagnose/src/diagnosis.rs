//! The result of a diagnosis.

use serde::{Deserialize, Serialize};
use twinlag_model::{Identifier, ModelFit, Observations, Policy, Value};

use crate::evidence::Evidence;
use crate::first_state::FirstState;
use crate::grade::Judgement;
use crate::if_known::IfKnown;
use crate::judge::Judgements;
use crate::moves::Move;
use crate::remark::Remark;
use crate::ties::OtherCause;
use crate::transfer::Transfer;
use crate::twins::ExactTwin;

/// Whether the model is complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Verdict {
    /// Two first-order lags leave nothing but noise.
    Adequate,
    /// With the effects that are named, only noise is left.
    Explained,
    /// The effects that are named explain a part; something else is left.
    PartlyExplained,
    /// Something is left over that no known effect accounts for.
    Unexplained,
    /// The record cannot be diagnosed.
    Refused,
}

/// An effect that was found; channels are counted from 0.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Found {
    /// The effect.
    pub effect: Identifier,
    /// Channel that has the effect; `None` if both have it, or if the record does not determine
    /// which.
    pub channel: Option<usize>,
    /// Channel to which the parameters refer; `None` if they refer to both.
    pub fitted_in: Option<usize>,
    /// Parameters of the effect.
    pub parameters: Vec<Value>,
    /// Their grades, in that order.
    pub judgements: Vec<Judgement>,
    /// Why the effect was added; `None` for defects of the data, which are seen directly and not
    /// inferred.
    pub evidence: Option<Evidence>,
    /// Other effects that explain this record equally well.
    pub alternatives: Vec<Identifier>,
    /// What no record distinguishes from it, with the time constants that it means; nothing where these are not given.
    pub exact_twins: Vec<ExactTwin>,
    /// Other effects that explain the record equally well and are no exact twins, each with the time constants if it is the cause;
    /// empty where the record does not determine both, and where time constants are not given.
    pub other_causes: Vec<OtherCause>,
    /// The first state of the slow body that it holds, of which both cases were tried; `None` of an effect that holds none, and where
    /// more than noise is left over.
    pub first_state: Option<FirstState>,
    /// What was seen in the data, for an effect without parameters: a count, a step.
    pub seen: Option<String>,
    /// Readings of the channel that are left out of the fit, in order.
    pub masked: Vec<Masked>,
    /// Whether each of several records has numbers of its own for it, and the rig has none.
    pub is_of_each_record: bool,
    /// Whether the model accounts for it: not so for one that a stretch of the record shows, and that no number of the whole
    /// holds.
    pub is_in_the_model: bool,
}

/// Neighbouring readings of one channel that are left out of the fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Masked {
    /// The first and the last of them: samples, counted from 0 through the stretches. In an answer on a record these are
    /// lines of its file, and rows counted from 1 where it never was in one.
    pub rows: [usize; 2],
    /// Their instants, s.
    pub time_s: [f64; 2],
}

impl Masked {
    /// Runs of neighbours among `samples`, in order.
    pub(crate) fn runs(samples: &[usize], observations: &Observations) -> Vec<Self> {
        let mut out: Vec<Self> = Vec::new();
        let mut first = 0;
        let mut rest = samples;
        for stretch in &observations.stretches {
            let end = first + stretch.time_s.len();
            let (here, after) = rest.split_at(rest.partition_point(|sample| *sample < end));
            for (place, sample) in here.iter().enumerate() {
                let time_s = stretch.time_s.at(sample - first);
                match out.last_mut() {
                    Some(last) if place > 0 && last.rows[1] + 1 == *sample => {
                        (last.rows[1], last.time_s[1]) = (*sample, time_s);
                    }
                    _ => out.push(Self { rows: [*sample; 2], time_s: [time_s; 2] }),
                }
            }
            (first, rest) = (end, after);
        }
        out
    }
}

/// One number before and after the effects.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct BeforeAfter<T> {
    /// With two first-order lags.
    pub before: T,
    /// The value with the effects in the model.
    pub after: T,
}

/// Errors before and after adding the effects. All but `chi2_per_dof` are computed on blocks used
/// neither to choose effects nor to fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ErrorBudget {
    /// Energy of the whitened residual per degree of freedom, on the whole record.
    pub chi2_per_dof: BeforeAfter<f64>,
    /// Root mean square of the whitened residual.
    pub held_out_normalised_rms: BeforeAfter<f64>,
    /// Root mean square of the difference between the two inferred gas temperatures, without the
    /// frequencies in which there is only noise, K.
    #[serde(rename = "held_out_input_difference_K")]
    pub held_out_input_difference_k: BeforeAfter<f64>,
}

/// The part of the residual that no effect explains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Unexplained {
    /// Description of the residual in words.
    pub description: String,
    /// The frequency band with most of the excess, Hz.
    #[serde(rename = "band_Hz")]
    pub band_hz: Option<[f64; 2]>,
    /// Energy in that band over that of the noise.
    pub energy_ratio: f64,
    /// The tenth of the record with most of the excess, s.
    pub worst_s: Option<[f64; 2]>,
}

/// The detection limit of an effect that was not found; `Channel` is the place of a channel, 0 or
/// 1, or its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Limit<Channel = usize> {
    /// The effect.
    pub effect: Identifier,
    /// Channel; `None` if the effect is of both, or relative.
    pub channel: Option<Channel>,
    /// Main parameter of the effect.
    pub parameter: String,
    /// The smallest size that would have been distinguished from chance.
    pub size: f64,
    /// Unit of the size.
    pub unit: String,
}

impl Limit {
    /// This limit with the name of its channel.
    pub fn named(&self, channels: &[String; 2]) -> Limit<String> {
        Limit {
            effect: self.effect,
            channel: self.channel.map(|i| channels[i].clone()),
            parameter: self.parameter.clone(),
            size: self.size,
            unit: self.unit.clone(),
        }
    }
}

/// The result of a diagnosis.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Diagnosis {
    /// The verdict.
    pub verdict: Verdict,
    /// Effects in the order in which they were added.
    pub effects: Vec<Found>,
    /// Two first-order lags.
    pub base: ModelFit,
    /// The model with the effects.
    pub last: ModelFit,
    /// Errors before and after.
    pub error: ErrorBudget,
    /// The unexplained part of the residual, if there is one.
    pub unexplained: Option<Unexplained>,
    /// Energy that is left over beside that of the noise, as a share of it, under a verdict that the model is complete: 0
    /// where no test sees any.
    pub explained_to: Option<f64>,
    /// Grades of the numbers of the model with the effects.
    pub judgements: Judgements,
    /// Grades of the numbers of two first-order lags.
    pub base_judgements: Judgements,
    /// What this record does not determine.
    pub not_testable: Vec<String>,
    /// Detection limits of the effects that were not found; none where something is left over, since that may hide them.
    pub limits: Vec<Limit>,
    /// What each value of the first time constant would make of the record; `None` where both are
    /// given and only noise is left over, or where one was known.
    pub if_known: Option<IfKnown>,
    /// Why the record was refused, or what to know before using the numbers.
    pub remarks: Vec<Remark>,
    /// Errors on blocks of the record that had no part in fitting the model; `None` of several records, of which
    /// [`crate::JointDiagnosis`] has those on records, and where no model is of the whole record.
    pub transfer: Option<Transfer>,
    /// What the loop did, in order.
    pub moves: Vec<Move>,
    /// The numbers that decided.
    pub policy: Policy,
}

#[cfg(test)]
mod tests {
    use super::*;
    use twinlag_model::Stretch;

    /// A run ends with its stretch, though samples are counted on.
    #[test]
    fn masked_readings_are_listed_in_runs() {
        let stretch = |from_s: f64| {
            let time_s: Vec<f64> = (0..40).map(|k| from_s + 0.5 * f64::from(k)).collect();
            Stretch::new(time_s.clone(), [time_s.clone(), time_s])
        };
        let observations = Observations::new(vec![stretch(0.0), stretch(100.0)], Some(0.5)).expect("long enough");
        let runs = Masked::runs(&[3, 4, 5, 38, 39, 40, 77], &observations);
        let found: Vec<([usize; 2], [f64; 2])> = runs.iter().map(|run| (run.rows, run.time_s)).collect();
        let expected =
            [([3, 5], [1.5, 2.5]), ([38, 39], [19.0, 19.5]), ([40, 40], [100.0, 100.0]), ([77, 77], [118.5, 118.5])];
        assert_eq!(found, expected);
    }

    #[test]
    fn a_limit_keeps_its_numbers_with_the_name_of_its_channel() {
        let (parameter, unit) = ("slope".to_owned(), "K/s".to_owned());
        let limit = Limit { effect: Identifier::DRIFT, channel: Some(1), parameter, size: 0.02, unit };
        let named = limit.named(&["bare".into(), "sheathed".into()]);
        assert_eq!(named.channel.as_deref(), Some("sheathed"));
        assert_eq!((named.size, named.unit), (0.02, limit.unit));
    }
}

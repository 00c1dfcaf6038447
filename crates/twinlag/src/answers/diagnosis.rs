//! The answer of the closed loop: schema `twinlag.diagnosis/1`.

use serde::{Deserialize, Serialize, Serializer};
use twinlag_diagnose::{
    BeforeAfter, Diagnosis as Core, ErrorBudget, Found, Identifier, Limit, Move, Policy, Unexplained, Verdict,
};

use crate::answers::{Characterisation, Model, ModelEffect};

/// An effect that was found, with the names of its channels.
pub type NamedEffect = Found<String>;

/// What the search would have seen of an effect that it did not find, with the name of its channel.
pub type NamedLimit = Limit<String>;

/// Errors before and after adding the effects. All but the energy of the residual are computed on
/// blocks used neither to choose effects nor to fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
    pub effects: Vec<NamedEffect>,
    /// Errors before and after.
    pub error: ErrorBeforeAfter,
    /// The model with the effects.
    #[serde(rename = "final")]
    pub last: Characterisation,
    /// What is left over.
    pub unexplained: Option<Unexplained>,
    /// What no record of two sensors, or not this one, can reveal.
    pub not_testable: Vec<String>,
    /// What would have been seen of the effects that were not found.
    pub limits: Vec<NamedLimit>,
    /// What to know before using the numbers.
    pub remarks: Vec<String>,
    /// Effects that were not considered, as asked.
    pub without: Vec<Identifier>,
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

    /// The model with the effects that were found, to be used on other records of the same rig.
    pub fn model(&self) -> Model {
        let effects = self.effects.iter().map(|e| ModelEffect {
            effect: e.effect,
            channel: e.fitted_in.clone(),
            parameters: e.parameters.clone(),
        });
        Model {
            schema: Model::SCHEMA.into(),
            channels: self.last.record.channels.clone(),
            time_constants_s: [0, 1].map(|i| self.last.sensors[i].time_constant_s),
            noise_std_k: Some([0, 1].map(|i| self.last.sensors[i].noise_std_k)),
            effects: effects.collect(),
            made_by: self.last.made_by.clone(),
        }
    }
}

/// An effect with what is said of it in every record.
#[derive(Serialize)]
struct Explained<'a> {
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

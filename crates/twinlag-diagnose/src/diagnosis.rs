//! What a diagnosis says.

use serde::{Deserialize, Serialize};
use twinlag_model::{Identifier, ModelFit, Value};

/// Whether the model is found to be complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Verdict {
    /// Two first-order lags leave nothing but noise.
    Adequate,
    /// With the effects that are named, nothing but noise is left.
    Explained,
    /// The effects that are named explain a part; something else is left.
    PartlyExplained,
    /// Something is left over that no known effect accounts for.
    Unexplained,
    /// The record cannot be diagnosed.
    Refused,
}

/// Why an effect was added.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Likelihood-ratio statistic, the level of the noise free.
    pub statistic: f64,
    /// Parameters that it took.
    pub dof: usize,
    /// Probability of such a statistic if the effect is not there.
    pub p_value: f64,
    /// Nats of likelihood gained on blocks that were left out of the fit.
    pub held_out_gain_nats: f64,
    /// The statistic with a free noise level in every frequency band; `None` for effects of the noise.
    pub robust_statistic: Option<f64>,
}

/// An effect that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Found {
    /// Which.
    pub effect: Identifier,
    /// Channel that it sits in, 0 or 1; `None` where it is of both, or where the record does not tell.
    pub channel: Option<usize>,
    /// Channel that the parameters are meant in, 0 or 1; `None` where it is of both.
    pub fitted_in: Option<usize>,
    /// Its parameters.
    pub parameters: Vec<Value>,
    /// Why it was added; `None` for defects of the data, which are seen, not inferred.
    pub evidence: Option<Evidence>,
    /// Effects that explain this record as well.
    pub alternatives: Vec<Identifier>,
    /// What was seen, where it is no parameter: a count, a step.
    pub seen: Option<String>,
}

/// One number before and after the effects.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BeforeAfter<T> {
    /// Of two first-order lags.
    pub before: T,
    /// With the effects.
    pub after: T,
}

/// How large the error is before and after. On blocks that neither chose the effects nor were fitted, but for the first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorBudget {
    /// Energy of the whitened residual per degree of freedom, on the whole record.
    pub chi2_per_dof: BeforeAfter<f64>,
    /// Root mean square of the whitened residual.
    pub held_out_normalised_rms: BeforeAfter<f64>,
    /// Root mean square of the difference between the two inferred gas temperatures, without the frequencies in which there is
    /// only noise, K.
    #[serde(rename = "held_out_input_difference_K")]
    pub held_out_input_difference_k: BeforeAfter<f64>,
}

/// Something that is left over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unexplained {
    /// In words.
    pub description: String,
    /// Where in frequency, Hz: the band with most of it.
    #[serde(rename = "band_Hz")]
    pub band_hz: Option<[f64; 2]>,
    /// How many times the energy of the noise there.
    pub energy_ratio: f64,
    /// Where in time, s: the tenth of the record with most of it.
    pub worst_s: Option<[f64; 2]>,
}

/// What the search would have seen of an effect that it did not find.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limit {
    /// Which.
    pub effect: Identifier,
    /// Channel, 0 or 1; `None` where it is of both, or relative.
    pub channel: Option<usize>,
    /// Its main parameter.
    pub parameter: String,
    /// The smallest size that would have been taken for more than chance.
    pub size: f64,
    /// Unit of the size.
    pub unit: String,
}

/// The whole answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnosis {
    /// The verdict.
    pub verdict: Verdict,
    /// Effects in the order in which they were added.
    pub effects: Vec<Found>,
    /// Two first-order lags.
    pub base: ModelFit,
    /// With the effects.
    pub last: ModelFit,
    /// Errors before and after.
    pub error: ErrorBudget,
    /// What is left.
    pub unexplained: Option<Unexplained>,
    /// What this record cannot tell.
    pub not_testable: Vec<String>,
    /// What would have been seen of the effects that were not found.
    pub limits: Vec<Limit>,
    /// Why the record was refused, or what to know before using the numbers.
    pub remarks: Vec<String>,
}

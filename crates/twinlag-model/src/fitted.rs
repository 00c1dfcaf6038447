//! A fitted model in numbers.

use serde::{Deserialize, Serialize};
use twinlag_cross_relation::{PartScatter, ResidualTest};
use twinlag_optimise::Fit;

use crate::between::Between;
use crate::effect::Identifier;
use crate::extended::Extended;
use crate::trace::Trace;

/// A fitted number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Value {
    /// Name of the number.
    pub name: String,
    /// The number.
    pub value: f64,
    /// Its standard error; `None` where the record does not determine it.
    pub standard_error: Option<f64>,
    /// Its 95 % interval.
    pub interval_95: Option<[f64; 2]>,
    /// Unit of the number.
    pub unit: String,
}

/// A time constant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct TimeConstant {
    /// The estimate, s; `None` where the record does not determine it.
    pub value_s: Option<f64>,
    /// Its standard error, s.
    pub standard_error_s: Option<f64>,
    /// Its 95 % interval, s.
    pub interval_95_s: Option<[f64; 2]>,
    /// How far it moves between parts of the record; `None` where it has no standard error.
    pub scatter: Option<PartScatter>,
}

/// One model of the record.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ModelFit {
    /// Both time constants.
    pub time_constants: [TimeConstant; 2],
    /// `τ₂ − τ₁`.
    pub difference: TimeConstant,
    /// How the fit ended.
    pub fit: Fit,
    /// Noise of the channels, K.
    pub noise_std_k: [f64; 2],
    /// Whether noise levels that were not given are those of what a model leaves over, and not of third differences.
    pub is_noise_of_residual: bool,
    /// Tests of the residual.
    pub tests: Vec<ResidualTest>,
    /// The p-value below which a test rejects the model.
    pub rejection_p_value: f64,
    /// Energy of the residual per degree of freedom.
    pub chi2_per_dof: f64,
    /// Whether the intervals follow from the spectrum of the residual itself.
    pub is_weighted_by_residual: bool,
    /// For pictures.
    pub trace: Trace,
    /// Covariance of the parameters, in their units, where there is one; the time constants come first.
    pub covariance: Option<Vec<Vec<f64>>>,
    /// How far each parameter moves between parts of the record, in the order of the covariance.
    pub scatter: Vec<Option<PartScatter>>,
    /// What several records say of the numbers that they share; `None` of one record.
    pub between: Option<Between>,
    /// The model itself, for a compensation; `None` in a fit that was put together for its picture.
    pub extended: Option<Extended>,
}

impl ModelFit {
    /// Whether a test of the residual speaks against the model ([`ResidualTest::can_reject`]).
    pub fn is_contradicted(&self) -> bool {
        self.is_weighted_by_residual
    }

    /// Standard errors of a time constant by noise, s: if all other parameters were known, and as they are; `None` without a
    /// covariance, and where something that was held leaves none to invert.
    ///
    /// `1/√((C⁻¹)_ii)` and `√C_ii`, `C` the covariance.
    pub fn standard_errors_s(&self, sensor: usize) -> Option<[f64; 2]> {
        let covariance = self.covariance.as_ref()?;
        let information = crate::dense::inverse(covariance)?.get(sensor)?.get(sensor)?.recip();
        let errors_s = [information.sqrt(), covariance[sensor][sensor].sqrt()];
        errors_s.iter().all(|error_s| error_s.is_finite() && *error_s > 0.0).then_some(errors_s)
    }
}

/// A fit with effects that were known beforehand.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct KnownFit {
    /// The fit.
    pub fit: ModelFit,
    /// Effects whose parameters belong to a record and not to the rig, and were fitted again: a line, a function of time.
    pub fitted_again: Vec<Identifier>,
}

/// A defect of the data, which is seen directly and not inferred.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Defect {
    /// The effect.
    pub effect: Identifier,
    /// Channel of the effect, 0 or 1.
    pub channel: usize,
    /// What was seen: a count, a step.
    pub seen: String,
    /// Samples of the channel that are masked, counted through the stretches, in order.
    pub masked: Vec<usize>,
}

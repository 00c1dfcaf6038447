//! The words in which a question is put: which estimator, what is known of the noise, what intervals
//! are made of.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use twinlag_sensor::Discretisation;

use crate::error::EstimateError;

/// The estimators, by the names that scripts use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Estimator {
    /// Exactly whitened difference of the inferred gas temperatures: the default.
    #[default]
    Whitened,
    /// The published cross-relation cost. Noise biases it to long time constants.
    CrossRelation,
    /// The published cost with the noise taken out of its expectation; needs the noise levels.
    BiasCompensated,
    /// The published cost over what noise adds to it; needs only the ratio of the noise levels.
    Normalised,
    /// The compensated cost in units of the noise's own standard deviation; needs the noise levels.
    Hybrid,
    /// Least squares on the difference equation. Noise biases it; which way depends on which sensor
    /// comes first.
    DifferenceEquationLs,
    /// Total least squares on it. Biased too, since its columns share their noise.
    DifferenceEquationTls,
    /// Generalised total least squares on it; needs only the ratio of the noise levels.
    DifferenceEquationGtls,
}

impl Estimator {
    /// All of them, the default first.
    pub const ALL: [Self; 8] = [
        Self::Whitened,
        Self::CrossRelation,
        Self::BiasCompensated,
        Self::Normalised,
        Self::Hybrid,
        Self::DifferenceEquationLs,
        Self::DifferenceEquationTls,
        Self::DifferenceEquationGtls,
    ];

    /// Whether it is one of those on the difference equation: solved in closed form, for sensors of
    /// first order, and with nothing else to find.
    pub fn is_closed_form(self) -> bool {
        matches!(self, Self::DifferenceEquationLs | Self::DifferenceEquationTls | Self::DifferenceEquationGtls)
    }

    /// The name that scripts use.
    pub fn name(self) -> &'static str {
        match self {
            Self::Whitened => "whitened",
            Self::CrossRelation => "cross-relation",
            Self::BiasCompensated => "bias-compensated",
            Self::Normalised => "normalised",
            Self::Hybrid => "hybrid",
            Self::DifferenceEquationLs => "difference-equation-ls",
            Self::DifferenceEquationTls => "difference-equation-tls",
            Self::DifferenceEquationGtls => "difference-equation-gtls",
        }
    }
}

impl fmt::Display for Estimator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Estimator {
    type Err = EstimateError;

    fn from_str(text: &str) -> Result<Self, EstimateError> {
        Self::ALL.into_iter().find(|e| e.name() == text).ok_or_else(|| EstimateError::Unexpected {
            what: "estimator",
            expected: format!("one of {}", Self::ALL.map(Self::name).join(", ")),
            got: text.into(),
        })
    }
}

/// What the gas is taken to do between samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Hold {
    /// Constant, unless the record is much better explained by straight lines.
    #[default]
    Auto,
    /// Constant until the next sample.
    ZeroOrderHold,
    /// A straight line from sample to sample.
    FirstOrderHold,
    /// The trapezoidal rule.
    Bilinear,
}

impl Hold {
    /// The discretisation to begin with, and to stay with unless the hold is to be found.
    pub fn first(self) -> Discretisation {
        match self {
            Self::Auto | Self::ZeroOrderHold => Discretisation::ZeroOrderHold,
            Self::FirstOrderHold => Discretisation::FirstOrderHold,
            Self::Bilinear => Discretisation::Bilinear,
        }
    }
}

impl FromStr for Hold {
    type Err = EstimateError;

    fn from_str(text: &str) -> Result<Self, EstimateError> {
        match text {
            "auto" => Ok(Self::Auto),
            "zero-order-hold" => Ok(Self::ZeroOrderHold),
            "first-order-hold" => Ok(Self::FirstOrderHold),
            "bilinear" => Ok(Self::Bilinear),
            _ => Err(EstimateError::Unexpected {
                what: "hold",
                expected: "auto, zero-order-hold, first-order-hold or bilinear".into(),
                got: text.into(),
            }),
        }
    }
}

/// What 95 % intervals are made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Intervals {
    /// Standard errors, with noise multiplied by noise and the uncertainty of found levels in them;
    /// the profile of the cost where that has another shape.
    #[default]
    Auto,
    /// The profile of the whitened cost.
    Profile,
    /// This estimator on simulated records.
    Bootstrap(Bootstrap),
}

/// What noise is taken to be like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum NoiseColour {
    /// Independent from sample to sample.
    #[default]
    White,
    /// Each sample's noise carries a share of the last one's: `n[k] = φ n[k−1] + e[k]`, `φ` of each
    /// channel found from the data.
    Autoregressive,
}

impl FromStr for NoiseColour {
    type Err = EstimateError;

    fn from_str(text: &str) -> Result<Self, EstimateError> {
        match text {
            "white" => Ok(Self::White),
            "autoregressive" => Ok(Self::Autoregressive),
            _ => Err(EstimateError::Unexpected {
                what: "noise colour",
                expected: "white or autoregressive".into(),
                got: text.into(),
            }),
        }
    }
}

/// Where a noise level comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum NoiseSource {
    /// It was given.
    Given,
    /// Scatter about a straight line in stretches in which the gas is at rest.
    QuietSegment,
    /// Third differences of the readings.
    ThirdDifferences,
    /// How the two inferred gas temperatures disagree.
    InferredInputs,
    /// The residual's own energy: only the ratio of the levels was given, or could be determined.
    Residual,
}

/// What is known of the noise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum NoiseKnowledge {
    /// Both levels, K.
    Known {
        /// Standard deviations of both channels.
        std_k: [f64; 2],
        /// First-order autoregressive coefficients; 0 for white noise.
        #[serde(default)]
        ar1: [f64; 2],
    },
    /// Nothing: the levels are found from the data.
    Found(NoiseColour),
    /// The ratio `s2/s1`: the level is profiled out.
    Ratio(f64),
}

impl Default for NoiseKnowledge {
    fn default() -> Self {
        Self::Found(NoiseColour::White)
    }
}

/// What 95 % intervals rest on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum IntervalBasis {
    /// Standard errors, in the logarithm of the time constant.
    StandardError,
    /// The profile of the cost, where standard errors do not describe it.
    Profile,
    /// This estimator on simulated records: see [`Bootstrap`].
    Bootstrap,
}

/// A seeded parametric bootstrap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Bootstrap {
    /// Simulated records, at least 39.
    pub replicates: usize,
    /// Seed of the noise; replicate `i` draws from streams `2 i` and `2 i + 1`.
    pub seed: u64,
}

impl Default for Bootstrap {
    fn default() -> Self {
        Self { replicates: 199, seed: 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nonsense_is_refused_with_what_was_expected() {
        let message = "least-squares".parse::<Estimator>().expect_err("unknown").to_string();
        assert!(message.contains("whitened") && message.contains("normalised"), "{message}");
    }
}

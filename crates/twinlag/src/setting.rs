//! The settings of the verbs, as errors name them.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A setting of a verb. Errors carry it beside words that name no program's option, so that a
/// program can add its own name for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Setting {
    /// Which columns are the two channels.
    Channels,
    /// The column of a measured flow.
    Flow,
    /// How time stamps are meant.
    Sampling,
    /// The estimator.
    Estimator,
    /// How its minimum is found.
    Optimiser,
    /// What the gas does between samples.
    Hold,
    /// Noise levels.
    Noise,
    /// The ratio of the noise levels.
    NoiseRatio,
    /// A stretch in which the gas is at rest.
    QuietSegment,
    /// What noise is like where it is found.
    NoiseColour,
    /// Relative calibration that is fitted.
    Free,
    /// Second lags that are fitted.
    SecondOrder,
    /// A parameter that is known beforehand.
    Known,
    /// What is typical of a sensor.
    Typical,
    /// What flows around the sensors.
    Fluid,
    /// Samples that are left out at the start.
    Discard,
    /// What intervals are made of.
    Intervals,
    /// Simulated records of the bootstrap.
    Replicates,
    /// A model from another record.
    Model,
    /// Length of a sliding window.
    Window,
    /// Rows answered as they come.
    Live,
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Channels => "channels",
            Self::Flow => "flow",
            Self::Sampling => "sampling",
            Self::Estimator => "estimator",
            Self::Optimiser => "optimiser",
            Self::Hold => "hold",
            Self::Noise => "noise levels",
            Self::NoiseRatio => "noise ratio",
            Self::QuietSegment => "quiet segment",
            Self::NoiseColour => "noise colour",
            Self::Free => "free calibration",
            Self::SecondOrder => "second lags",
            Self::Known => "known value",
            Self::Typical => "typical sensor",
            Self::Fluid => "fluid",
            Self::Discard => "samples to discard",
            Self::Intervals => "intervals",
            Self::Replicates => "bootstrap replicates",
            Self::Model => "model",
            Self::Window => "window",
            Self::Live => "live tracking",
        })
    }
}

/// `a, b, c`.
pub(crate) fn listed(settings: &[Setting]) -> String {
    settings.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

//! An estimator with all that a plan gives it.

use serde::{Deserialize, Serialize};
use twinlag::NoiseColour;
use twinlag::estimate::NoiseKnowledge;
use twinlag::optimise::Optimiser;
use twinlag::sensor::Discretisation;

/// The knowledge of the noise that a method is given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Told {
    /// Both levels and the colour.
    #[default]
    Known,
    /// Nothing; white noise is assumed.
    Found,
    /// Nothing; autoregressive noise is assumed.
    FoundAutoregressive,
    /// The ratio of the levels.
    Ratio,
}

/// Where a method starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// At the start that the method chooses itself.
    #[default]
    Own,
    /// At these time constants, s.
    At([f64; 2]),
    /// Trial `i` at point `i` of the plan's grid, cyclically.
    Grid,
}

/// An estimator with all that it is given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Method {
    /// Name in tables and pictures.
    pub name: String,
    /// The estimator, by name: one of the family, or one that the experiment is given.
    pub estimator: String,
    /// The optimiser: its name, or its name with options; or the name of one that the experiment is
    /// given.
    #[serde(default)]
    pub optimiser: OptimiserChoice,
    /// The knowledge of the noise that the method is given.
    #[serde(default)]
    pub noise: Told,
    /// Factors on the true *variances* of the noise before they are given to the method.
    #[serde(default = "default_factor")]
    pub variance_factor: [f64; 2],
    /// Where the method starts.
    #[serde(default)]
    pub start: Start,
    /// What it takes the gas to do between samples.
    #[serde(default)]
    pub hold: Discretisation,
    /// Samples that it discards, if it does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub discard: Option<usize>,
    /// Whether its intervals are wanted.
    #[serde(default)]
    pub intervals: bool,
}

fn default_factor() -> [f64; 2] {
    [1.0; 2]
}

/// An optimiser by name, or with options of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum OptimiserChoice {
    /// By name; one of the registry has its default options.
    Named(String),
    /// With options.
    WithOptions(Optimiser),
}

impl Default for OptimiserChoice {
    fn default() -> Self {
        Self::WithOptions(Optimiser::default())
    }
}

impl Method {
    /// The knowledge that this method is given of noise with `std_k` and `ar1`. Noise of zero is
    /// stated as a very small number, so that weights stay finite.
    pub(crate) fn told(&self, std_k: [f64; 2], ar1: f64) -> NoiseKnowledge {
        let least = 1e-6;
        match self.noise {
            Told::Known => {
                let stated = |i: usize| (std_k[i] * self.variance_factor[i].sqrt()).max(least);
                NoiseKnowledge::Known { std_k: [stated(0), stated(1)], ar1: [ar1; 2] }
            }
            Told::Found => NoiseKnowledge::Found(NoiseColour::White),
            Told::FoundAutoregressive => NoiseKnowledge::Found(NoiseColour::Autoregressive),
            Told::Ratio => NoiseKnowledge::Ratio(if std_k[0] > 0.0 { std_k[1] / std_k[0] } else { 1.0 }),
        }
    }
}

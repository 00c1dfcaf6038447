//! What an effect is. Each has a file of its own in `effect/`, and a line in [`Identifier::ALL`].

pub mod calibration;
pub mod coloured_noise;
pub mod crosstalk;
pub mod delay;
pub mod drift;
pub mod input_mismatch;
pub mod mains_pickup;
pub mod quantisation;
pub mod radiation;
pub mod saturation;
pub mod second_order;
pub mod slow_mode;
pub mod spikes;
pub mod temperature_dependence;
pub mod varying;

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use twinlag_optimise::Variable;

use crate::error::DiagnoseError;
use crate::flow::Flow;
use crate::plant::Plant;

/// The effects, by the names that scripts use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Identifier {
    /// A reading that saturates.
    Saturation,
    /// A converter coarser than the noise.
    Quantisation,
    /// Isolated wrong readings.
    Spikes,
    /// Sinusoids in a reading.
    MainsPickup,
    /// Relative gain, offset, static curvature.
    Calibration,
    /// One channel later than the other.
    Delay,
    /// A second lag in series.
    SecondOrder,
    /// A slow parallel path.
    SlowMode,
    /// A share of one channel in the other.
    Crosstalk,
    /// Time constants that change along the record.
    VaryingTimeConstant,
    /// Time constants that change with temperature.
    TemperatureDependentTimeConstant,
    /// Radiation to walls.
    Radiation,
    /// An offset that changes with time.
    Drift,
    /// Noise of a reading that is not white.
    ColouredNoise,
    /// Sensors that do not see the same gas.
    InputMismatch,
}

impl Identifier {
    /// All of them.
    pub const ALL: [Self; 15] = [
        Self::Saturation,
        Self::Quantisation,
        Self::Spikes,
        Self::MainsPickup,
        Self::Calibration,
        Self::Delay,
        Self::SecondOrder,
        Self::SlowMode,
        Self::Crosstalk,
        Self::VaryingTimeConstant,
        Self::TemperatureDependentTimeConstant,
        Self::Radiation,
        Self::Drift,
        Self::ColouredNoise,
        Self::InputMismatch,
    ];

    /// The name that scripts use.
    pub fn name(self) -> &'static str {
        self.about().name
    }

    /// Whether it is a model of noise, fitted by the likelihood of the residual, not by its energy.
    pub fn is_noise(self) -> bool {
        matches!(self, Self::ColouredNoise | Self::InputMismatch)
    }

    /// What there is to say of it.
    pub fn about(self) -> &'static About {
        match self {
            Self::Saturation => &saturation::ABOUT,
            Self::Quantisation => &quantisation::ABOUT,
            Self::Spikes => &spikes::ABOUT,
            Self::MainsPickup => &mains_pickup::ABOUT,
            Self::Calibration => &calibration::ABOUT,
            Self::Delay => &delay::ABOUT,
            Self::SecondOrder => &second_order::ABOUT,
            Self::SlowMode => &slow_mode::ABOUT,
            Self::Crosstalk => &crosstalk::ABOUT,
            Self::VaryingTimeConstant => &varying::ABOUT,
            Self::TemperatureDependentTimeConstant => &temperature_dependence::ABOUT,
            Self::Radiation => &radiation::ABOUT,
            Self::Drift => &drift::ABOUT,
            Self::ColouredNoise => &coloured_noise::ABOUT,
            Self::InputMismatch => &input_mismatch::ABOUT,
        }
    }
}

impl fmt::Display for Identifier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Identifier {
    type Err = DiagnoseError;

    fn from_str(text: &str) -> Result<Self, DiagnoseError> {
        Self::ALL.into_iter().find(|e| e.name() == text).ok_or_else(|| DiagnoseError::UnknownEffect {
            name: text.into(),
            known: Self::ALL.map(Self::name).join(", "),
        })
    }
}

/// What there is to say of an effect.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct About {
    /// The name that scripts use.
    pub name: &'static str,
    /// What it is, in one sentence.
    pub explanation: &'static str,
    /// What can be done about it at the rig.
    pub advice: &'static str,
    /// Effects that look like it where it is small or the gas says little.
    pub confusable: &'static [Identifier],
    /// What part of it no record of two sensors shows.
    pub unseen: &'static str,
}

/// A parameter of an effect.
#[derive(Clone, Debug)]
pub struct Parameter {
    pub name: &'static str,
    pub unit: &'static str,
    pub variable: Variable,
}

impl Parameter {
    pub fn new(name: &'static str, unit: &'static str, variable: Variable) -> Self {
        Self { name, unit, variable }
    }
}

/// An effect in one place with its parameters: what can be added to the model.
pub trait Effect: Send + Sync {
    fn identifier(&self) -> Identifier;

    /// The channel that it sits in; `None` where it is of both, or relative.
    fn channel(&self) -> Option<usize>;

    /// Parameters that are fitted, in the order in which `install` takes them.
    fn parameters(&self) -> &[Parameter];

    /// Values to start from, at least one set.
    fn starts(&self) -> Vec<Vec<f64>>;

    /// Puts the effect into the model.
    fn install(&self, values: &[f64], plant: &mut Plant);

    /// Whether it is a model of noise ([`Identifier::is_noise`]).
    fn is_noise(&self) -> bool {
        self.identifier().is_noise()
    }

    /// The number that makes the effect, for the check that it is there at all: an effect whose number is not clear of the
    /// neutral value is none. Indices of parameters, each with its neutral value.
    fn neutral(&self) -> Vec<(usize, f64)>;

    /// The same effect with more or fewer parameters, to be tried once it is chosen.
    fn sizes(&self) -> Vec<Shared> {
        Vec::new()
    }

    /// The same effect with one parameter more, and where its fit starts from `values` of this one: looked at whenever more is
    /// known, since what is small hides behind what is large.
    fn grown(&self, _values: &[f64]) -> Option<(Shared, Vec<f64>)> {
        None
    }

    /// Whether parameters belong to a record, not to the rig: the phase of a line, a function of time. They are fitted again where
    /// the effect is known from another record.
    fn is_of_the_record(&self) -> bool {
        false
    }

    /// What is known of the parameters beforehand: functions of `values` that have zero mean and unit variance then.
    fn prior(&self, _values: &[f64]) -> Vec<f64> {
        Vec::new()
    }

    /// Values to be reported beside the fitted ones: name, unit, function of the parameters.
    fn derived(&self) -> Vec<Derived> {
        Vec::new()
    }
}

/// A function of an effect's parameters.
pub type OfParameters = Box<dyn Fn(&[f64]) -> f64>;

/// A number that follows from the parameters.
pub struct Derived {
    pub name: &'static str,
    pub unit: &'static str,
    pub of: OfParameters,
}

/// What candidates are made from.
#[derive(Clone, Debug)]
pub struct Context {
    /// Ends of the record, s.
    pub ends_s: [f64; 2],
    pub step_s: f64,
    pub is_even: bool,
    pub samples: usize,
    /// Samples that a delay may reach.
    pub reach: usize,
    /// Mean of each channel, °C.
    pub mean_c: [f64; 2],
    /// Mean in °C, variance in K², and third moment over variance in K of both channels together.
    pub moments: [f64; 3],
    /// Standard deviation of the livelier channel, K.
    pub swing_k: f64,
    /// White noise of the channels, K.
    pub noise_std_k: [f64; 2],
    /// Channels whose converter is coarse beside the noise.
    pub is_coarse: [bool; 2],
    /// Time constants of the model so far, s.
    pub tau_s: [f64; 2],
    /// Flow, where it was measured.
    pub flow: Option<Arc<Flow>>,
    /// Lines that stick out of the residual: frequency in Hz, and the channel that shows them.
    pub lines: Vec<(f64, usize)>,
}

impl Context {
    /// A temperature that a step of a solver may change, K: not so small that a large offset is far away.
    pub fn typical_k(&self, channel: usize) -> f64 {
        (0.1 * self.swing_k).max(self.noise_std_k[channel]).max(1e-9)
    }

    pub fn span_s(&self) -> f64 {
        self.ends_s[1] - self.ends_s[0]
    }
}

/// An effect that may be shared between models.
pub type Shared = Arc<dyn Effect>;

/// Every candidate of the effects that change the model; the data defects are dealt with before.
pub fn candidates(context: &Context) -> Vec<Shared> {
    let mut out: Vec<Shared> = Vec::new();
    out.extend(mains_pickup::candidates(context));
    out.extend(calibration::candidates(context));
    out.extend(delay::candidates(context));
    out.extend(second_order::candidates(context));
    out.extend(slow_mode::candidates(context));
    out.extend(crosstalk::candidates(context));
    out.extend(varying::candidates(context));
    out.extend(temperature_dependence::candidates(context));
    out.extend(radiation::candidates(context));
    out.extend(drift::candidates(context));
    out.extend(coloured_noise::candidates(context));
    out.extend(input_mismatch::candidates(context));
    out
}

//! The kinds of effect that a random rig may have, and what a library of effects calls them.

use serde::{Deserialize, Serialize};

/// A kind of effect. In files it has its [`Kind::name`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Kind {
    /// No effect: two first-order sensors in white noise.
    None,
    /// Gain of one channel.
    Gain,
    /// Offset of one channel.
    Offset,
    /// Curved calibration of one channel.
    Curvature,
    /// A second lag in series.
    SecondOrder,
    /// A slow path beside the sensor's own.
    SlowMode,
    /// Delay of one channel.
    Delay,
    /// Both time constants vary with the flow.
    VaryingTimeConstant,
    /// One time constant depends on the sensor's own temperature.
    TemperatureDependentTimeConstant,
    /// Radiation from one sensor to a wall.
    Radiation,
    /// Drift of one channel.
    Drift,
    /// Mains pick-up of one channel.
    MainsPickup,
    /// Noise with a memory in one channel.
    ColouredNoise,
    /// One sensor meets slightly other gas.
    InputMismatch,
    /// Isolated outliers in one channel.
    Spikes,
    /// Coarse rounding of one channel.
    Quantisation,
    /// One channel ends at a limit.
    Saturation,
    /// One channel picks up the other.
    Crosstalk,
    /// Both time constants depend on the temperature of the film, halfway between sensor and gas.
    FilmTemperature,
    /// Play in one sensor. No library of effects knows it.
    Hysteresis,
    /// A contact of one channel that opens now and then. No library of effects knows it.
    IntermittentContact,
    /// A delay of one channel that appears in mid-record. No library of effects knows it.
    ClockSlip,
    /// A sensor that is replaced in mid-record. No library of effects knows it.
    Replaced,
    /// A stream whose velocity is recorded, on which nothing depends.
    IdleStream,
    /// One sensor stands downstream of the other, in a stream whose velocity is recorded.
    Separation,
    /// One time constant goes with the recorded velocity of a stream, as where the other sensor is pumped.
    OneSidedFlow,
}

impl Kind {
    /// Every kind, none first, the aliens last.
    pub const ALL: [Self; 26] = [
        Self::None,
        Self::IdleStream,
        Self::Gain,
        Self::Offset,
        Self::Curvature,
        Self::SecondOrder,
        Self::SlowMode,
        Self::Delay,
        Self::VaryingTimeConstant,
        Self::TemperatureDependentTimeConstant,
        Self::Radiation,
        Self::Drift,
        Self::MainsPickup,
        Self::ColouredNoise,
        Self::InputMismatch,
        Self::Spikes,
        Self::Quantisation,
        Self::Saturation,
        Self::Crosstalk,
        Self::FilmTemperature,
        Self::Separation,
        Self::OneSidedFlow,
        Self::Hysteresis,
        Self::IntermittentContact,
        Self::ClockSlip,
        Self::Replaced,
    ];

    /// The kinds that have an [`effect`](Kind::effect).
    pub const EFFECTS: [Self; 20] = [
        Self::Gain,
        Self::Offset,
        Self::Curvature,
        Self::SecondOrder,
        Self::SlowMode,
        Self::Delay,
        Self::VaryingTimeConstant,
        Self::TemperatureDependentTimeConstant,
        Self::Radiation,
        Self::Drift,
        Self::MainsPickup,
        Self::ColouredNoise,
        Self::InputMismatch,
        Self::Spikes,
        Self::Quantisation,
        Self::Saturation,
        Self::Crosstalk,
        Self::FilmTemperature,
        Self::Separation,
        Self::OneSidedFlow,
    ];

    /// The kinds that no library of effects knows: here a diagnosis ought to say that it does not
    /// know.
    pub const UNMODELLED: [Self; 4] = [Self::Hysteresis, Self::IntermittentContact, Self::ClockSlip, Self::Replaced];

    /// The name in files, in kebab case.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Gain => "gain",
            Self::Offset => "offset",
            Self::Curvature => "curvature",
            Self::SecondOrder => "second-order",
            Self::SlowMode => "slow-mode",
            Self::Delay => "delay",
            Self::VaryingTimeConstant => "varying-time-constant",
            Self::TemperatureDependentTimeConstant => "temperature-dependent-time-constant",
            Self::Radiation => "radiation",
            Self::Drift => "drift",
            Self::MainsPickup => "mains-pickup",
            Self::ColouredNoise => "coloured-noise",
            Self::InputMismatch => "input-mismatch",
            Self::Spikes => "spikes",
            Self::Quantisation => "quantisation",
            Self::Saturation => "saturation",
            Self::Crosstalk => "crosstalk",
            Self::FilmTemperature => "film-temperature",
            Self::Hysteresis => "hysteresis",
            Self::IntermittentContact => "intermittent-contact",
            Self::ClockSlip => "clock-slip",
            Self::Replaced => "replaced",
            Self::IdleStream => "idle-stream",
            Self::Separation => "separation",
            Self::OneSidedFlow => "one-sided-flow",
        }
    }

    /// The name of this effect in a library of effects. Gain, offset and curvature share the name
    /// `"calibration"`, because they are hard to distinguish from the readings alone.
    /// [`Kind::None`], [`Kind::IdleStream`] and the [aliens](Kind::UNMODELLED) have no name.
    pub fn effect(self) -> Option<&'static str> {
        match self {
            Self::None
            | Self::IdleStream
            | Self::Hysteresis
            | Self::IntermittentContact
            | Self::ClockSlip
            | Self::Replaced => None,
            Self::Gain | Self::Offset | Self::Curvature => Some("calibration"),
            Self::OneSidedFlow => Some(Self::VaryingTimeConstant.name()),
            Self::FilmTemperature => Some(Self::TemperatureDependentTimeConstant.name()),
            known => Some(known.name()),
        }
    }

    /// The unit of [`Placed::size`](super::Placed::size).
    pub fn unit(self) -> &'static str {
        match self {
            Self::Gain => "K/K",
            Self::Offset
            | Self::MainsPickup
            | Self::ColouredNoise
            | Self::InputMismatch
            | Self::Spikes
            | Self::Quantisation
            | Self::Hysteresis => "K",
            Self::Curvature => "1/K",
            Self::SecondOrder | Self::Delay | Self::ClockSlip => "s",
            Self::Separation => "m",
            Self::Radiation => "1/K^3",
            Self::Drift => "K/s",
            Self::None
            | Self::IdleStream
            | Self::SlowMode
            | Self::VaryingTimeConstant
            | Self::OneSidedFlow
            | Self::TemperatureDependentTimeConstant
            | Self::FilmTemperature
            | Self::Saturation
            | Self::Crosstalk
            | Self::IntermittentContact
            | Self::Replaced => "1",
        }
    }
}

/// The kind of gas signal of a random rig. In files it has its [`GasKind::name`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum GasKind {
    /// Pulsation of an engine's exhaust, its cycles at about the characteristic frequency.
    Engine,
    /// Random steps with long rests between them, each made within a part of the characteristic
    /// period.
    Plunge,
    /// Turbulence with its corner below the characteristic frequency.
    Turbulence,
    /// A dozen sines about the characteristic frequency.
    MultiTone,
}

impl GasKind {
    /// Every kind.
    pub const ALL: [Self; 4] = [Self::Engine, Self::Plunge, Self::Turbulence, Self::MultiTone];

    /// The name in files, in kebab case: the `kind` of a rig's gas.
    pub fn name(self) -> &'static str {
        match self {
            Self::Engine => "engine",
            Self::Plunge => "plunge",
            Self::Turbulence => "turbulence",
            Self::MultiTone => "multi-tone",
        }
    }
}

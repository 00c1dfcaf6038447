//! Physical effects that a model of two first-order lags may lack.
//!
//! What is known of a kind of effect before any record stands in its [`About`]; an [`Identifier`] names it. An
//! [`Effect`] is one in its place, with parameters: what can be added to a model. Each of ours has a file of its own in
//! `effect/` and a line in [`Identifier::ALL`]; effects of other crates are made the same way, and handed over in
//! [`crate::Settings::effects`].

pub(crate) mod calibration;
pub(crate) mod coloured_noise;
pub(crate) mod crosstalk;
pub(crate) mod delay;
pub(crate) mod drift;
pub(crate) mod input_mismatch;
pub(crate) mod mains_pickup;
pub(crate) mod quantisation;
pub(crate) mod radiation;
pub(crate) mod saturation;
pub(crate) mod second_order;
pub(crate) mod slow_mode;
pub(crate) mod spikes;
pub(crate) mod temperature_dependence;
pub(crate) mod varying;

mod about;
mod context;
mod identifier;
mod known;
mod parameter;

use std::sync::Arc;

pub use about::About;
pub use context::Context;
pub use identifier::Identifier;
pub use known::KnownEffect;
pub use parameter::{Derived, Domain, Freedom, OfParameters, Parameter};

use crate::number::Number;
use crate::plant::Plant;

/// Where an effect sits, and the numbers that describe it.
#[derive(Clone, Debug)]
pub struct Seat {
    /// Which effect.
    pub identifier: Identifier,
    /// Channel 0 or 1; `None` where it is of both. Functions of time or temperature that an effect of one channel
    /// installs are that sensor's.
    pub channel: Option<usize>,
    /// Parameters that are fitted, in the order in which [`Effect::install`] takes them.
    pub parameters: Vec<Parameter>,
}

impl Seat {
    /// A seat of an effect.
    pub fn new(identifier: Identifier, channel: Option<usize>, parameters: Vec<Parameter>) -> Self {
        Self { identifier, channel, parameters }
    }
}

/// An effect in one place with its parameters: what can be added to the model.
///
/// Three functions are an effect; the others have defaults that hold for most. An example in a crate of its own is
/// `examples/own-effect`.
pub trait Effect: Send + Sync {
    /// Where it sits, and its parameters.
    fn seat(&self) -> &Seat;

    /// Values that fits start from, at least one set. With a single one even an obvious effect can be missed.
    fn starts(&self) -> Vec<Vec<f64>>;

    /// Puts the effect into the model. Derivatives of the cost come from the arithmetic with `values`.
    fn install(&self, values: &[Number], plant: &mut Plant);

    /// The parameter whose size is the effect's; `None` where none is, as in a function of time.
    fn main(&self) -> Option<usize> {
        Some(0)
    }

    /// Forms of this effect with more or fewer parameters, tried once it is chosen.
    fn sizes(&self) -> Vec<Shared> {
        Vec::new()
    }

    /// This effect with one parameter more, and where its fit starts from `values` of this one. Tried whenever more is
    /// known, since what is small hides behind what is large.
    fn extended(&self, _values: &[f64]) -> Option<(Shared, Vec<f64>)> {
        None
    }

    /// Whether parameters belong to a record and not to the rig: the phase of a line, a function of time. They are
    /// fitted again where the effect is known from another record.
    fn is_of_the_record(&self) -> bool {
        false
    }

    /// Prior knowledge of the parameters: functions of `values` that have zero mean and unit variance beforehand.
    fn prior(&self, _values: &[Number]) -> Vec<Number> {
        Vec::new()
    }

    /// Numbers that are reported beside the fitted ones.
    fn derived(&self) -> Vec<Derived> {
        Vec::new()
    }

    /// Puts `values`, and the time constants, s, into their conventional order where the model is the same for several.
    fn order(&self, _values: &mut [f64], _tau_s: &mut [f64]) {}

    /// Which effect it is.
    fn identifier(&self) -> Identifier {
        self.seat().identifier
    }

    /// What is known of it before any record.
    fn about(&self) -> &'static About {
        self.seat().identifier.about()
    }

    /// The channel that it sits in, 0 or 1; `None` where it is of both.
    fn channel(&self) -> Option<usize> {
        self.seat().channel
    }

    /// Parameters that are fitted.
    fn parameters(&self) -> &[Parameter] {
        &self.seat().parameters
    }

    /// Whether it is a model of noise, fitted by the likelihood of the residual and not by its energy.
    fn is_noise(&self) -> bool {
        self.about().is_noise
    }
}

/// An effect that several models share.
pub type Shared = Arc<dyn Effect>;

/// Every candidate of `effects`. Defects of the data have none: they are dealt with before.
pub fn candidates(effects: &[Identifier], context: &Context) -> Vec<Shared> {
    effects.iter().flat_map(|e| (e.about().candidates)(context)).collect()
}

/// Of `candidates`, in all their sizes, the one that `known` describes: in its channel, with all parameters given, and
/// with the most of them.
pub fn described_by(known: &KnownEffect, candidates: Vec<Shared>) -> Option<Shared> {
    let is_described =
        |e: &Shared| e.channel() == known.channel && e.parameters().iter().all(|p| known.parameter(p.name).is_some());
    let sizes: Vec<Shared> = candidates.iter().flat_map(|e| e.sizes()).collect();
    candidates.into_iter().chain(sizes).filter(is_described).max_by_key(|e| e.parameters().len())
}

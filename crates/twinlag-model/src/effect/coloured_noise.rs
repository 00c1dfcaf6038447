//! Noise of one reading that is not white: autoregressive of first order beside the white noise.

use crate::effect::{About, Context, Effect, Identifier, Parameter, Shared};
use crate::plant::{Extra, Place, Plant};
use std::sync::Arc;
use twinlag_optimise::Variable;

pub const ABOUT: About = About {
    name: "coloured-noise",
    explanation: "one channel has noise that lasts from sample to sample: an amplifier, a filter, electromagnetic interference",
    advice: "nothing is wrong with the sensors; the weights and intervals take it into account. A better amplifier lowers it",
    confusable: &[Identifier::InputMismatch, Identifier::Drift],
    unseen: "which channel slow noise belongs to, where both sensors follow it",
};

struct ColouredNoise {
    channel: usize,
    parameters: Vec<Parameter>,
    step_s: f64,
    noise_std_k: f64,
}

/// Shortest correlation, of a step: what lasts shorter is white.
pub const SHORTEST: f64 = 1.0;
/// Longest correlation, of the record: what lasts longer is a drift.
pub const LONGEST: f64 = 0.05;

/// Parameters of extra noise: its standard deviation, how long it lasts.
pub fn extra(context: &Context, typical_k: f64) -> Vec<Parameter> {
    vec![
        Parameter::new("noise_std", "K", Variable::logarithmic("noise std", 1e-3 * typical_k, 10.0 * context.swing_k)),
        Parameter::new(
            "correlation_time",
            "s",
            Variable::logarithmic("correlation time", SHORTEST * context.step_s, LONGEST * context.span_s()),
        ),
    ]
}

pub fn candidates(context: &Context) -> Vec<Shared> {
    if !context.is_even {
        return Vec::new();
    }
    (0..2)
        .map(|channel| {
            let noise_std_k = context.noise_std_k[channel];
            let parameters = extra(context, noise_std_k);
            Arc::new(ColouredNoise { channel, parameters, step_s: context.step_s, noise_std_k }) as Shared
        })
        .collect()
}

impl Effect for ColouredNoise {
    fn identifier(&self) -> Identifier {
        Identifier::ColouredNoise
    }

    fn channel(&self) -> Option<usize> {
        Some(self.channel)
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        [3.0, 20.0].into_iter().map(|steps| vec![self.noise_std_k, steps * self.step_s]).collect()
    }

    fn install(&self, values: &[f64], plant: &mut Plant) {
        plant.extra.push(Extra { place: Place::Reading(self.channel), std_k: values[0], correlation_s: values[1] });
    }

    fn neutral(&self) -> Vec<(usize, f64)> {
        vec![(0, 0.0)]
    }
}

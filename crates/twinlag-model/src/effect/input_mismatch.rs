//! Sensors that do not see the same gas: a difference of the gas temperatures that is independent of them, autoregressive of
//! first order.

use crate::effect::{About, Context, Effect, Identifier, Parameter, Shared, coloured_noise};
use crate::plant::{Extra, Place, Plant};
use std::sync::Arc;

pub const ABOUT: About = About {
    name: "input-mismatch",
    explanation: "the two sensors do not see the same gas: eddies smaller than their distance, a wake, a gradient",
    advice: "mount the junctions closer together, across the flow, away from walls; the weights and intervals take it into \
             account",
    confusable: &[Identifier::ColouredNoise],
    unseen: "what both sensors see and the gas elsewhere does not",
};

struct InputMismatch {
    parameters: Vec<Parameter>,
    step_s: f64,
    tau_s: f64,
    swing_k: f64,
}

pub fn candidates(context: &Context) -> Vec<Shared> {
    if !context.is_even {
        return Vec::new();
    }
    let tau_s = context.tau_s[0].min(context.tau_s[1]).clamp(2.0 * context.step_s, 0.1 * context.span_s());
    vec![Arc::new(InputMismatch {
        parameters: coloured_noise::extra(context, 0.01 * context.swing_k),
        step_s: context.step_s,
        tau_s,
        swing_k: context.swing_k,
    })]
}

impl Effect for InputMismatch {
    fn identifier(&self) -> Identifier {
        Identifier::InputMismatch
    }

    fn channel(&self) -> Option<usize> {
        None
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        [0.3 * self.tau_s, 3.0 * self.tau_s]
            .into_iter()
            .map(|tau_s| vec![0.02 * self.swing_k, tau_s.max(self.step_s)])
            .collect()
    }

    fn install(&self, values: &[f64], plant: &mut Plant) {
        plant.extra.push(Extra { place: Place::Gas, std_k: values[0], correlation_s: values[1] });
    }

    fn neutral(&self) -> Vec<(usize, f64)> {
        vec![(0, 0.0)]
    }
}

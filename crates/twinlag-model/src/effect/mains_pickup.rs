//! A sinusoid in one reading that is not in the gas: mains, an ignition, a pump. Its frequency is where a line sticks out of the
//! residual.

use crate::effect::{About, Context, Derived, Effect, Identifier, Parameter, Shared};
use crate::plant::Plant;
use std::sync::Arc;
use twinlag_optimise::Variable;

pub const ABOUT: About = About {
    name: "mains-pickup",
    explanation: "a steady sinusoid in one channel that the other does not have: mains or another machine, possibly aliased",
    advice: "shield and twist the leads, ground at one end, average over whole mains periods",
    confusable: &[],
    unseen: "pick-up of both channels that their lags happen to make equal",
};

struct MainsPickup {
    channel: usize,
    parameters: Vec<Parameter>,
    frequency_hz: f64,
}

pub fn candidates(context: &Context) -> Vec<Shared> {
    let mut out = Vec::new();
    if !context.is_even {
        return out;
    }
    for &(frequency_hz, channel) in context.lines.iter().take(2) {
        let width = 1.0 / context.span_s();
        let widest = 3.0 * context.swing_k;
        let amplitude =
            |name| Parameter::new(name, "K", Variable::linear(name, context.typical_k(channel), -widest, widest));
        let frequency = Variable::linear(
            "frequency",
            0.01 * width,
            (frequency_hz - 1.5 * width).max(0.0),
            frequency_hz + 1.5 * width,
        );
        let parameters = vec![
            Parameter::new("frequency", "Hz", frequency),
            amplitude("cosine_amplitude"),
            amplitude("sine_amplitude"),
        ];
        out.push(Arc::new(MainsPickup { channel, parameters, frequency_hz }) as Shared);
    }
    out
}

impl Effect for MainsPickup {
    fn identifier(&self) -> Identifier {
        Identifier::MainsPickup
    }

    fn channel(&self) -> Option<usize> {
        Some(self.channel)
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        vec![vec![self.frequency_hz, 0.0, 0.0]]
    }

    fn install(&self, values: &[f64], plant: &mut Plant) {
        plant.sensors[self.channel].reading.lines.push([values[0], values[1], values[2]]);
    }

    fn is_of_the_record(&self) -> bool {
        true
    }

    fn neutral(&self) -> Vec<(usize, f64)> {
        vec![(1, 0.0), (2, 0.0)]
    }

    fn derived(&self) -> Vec<Derived> {
        vec![Derived { name: "amplitude", unit: "K", of: Box::new(|values| values[1].hypot(values[2])) }]
    }
}

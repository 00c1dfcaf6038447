//! A delay between the channels: channel 2 is read later, or sees the gas later, by `d`.
//!
//! The inferred gas temperature of channel 2 is taken `d` later, between the samples by the spline through them.

use crate::chain::UNEVEN_REACH;
use crate::effect::{About, Context, Effect, Identifier, Parameter, Shared};
use crate::plant::Plant;
use std::sync::Arc;
use twinlag_optimise::Variable;

pub const ABOUT: About = About {
    name: "delay",
    explanation: "one channel is later than the other: scanned after it, filtered with a pure delay, or further downstream",
    advice: "sample both channels at the same instant, mount the junctions side by side across the flow, and check the \
             logger's scan order",
    confusable: &[Identifier::SecondOrder, Identifier::SlowMode],
    unseen: "a delay that both channels share",
};

struct Delay {
    parameters: Vec<Parameter>,
    step_s: f64,
}

pub fn candidates(context: &Context) -> Vec<Shared> {
    let longest = if context.is_even { (context.reach - 1) as f64 } else { UNEVEN_REACH as f64 - 0.5 } * context.step_s;
    let variable = Variable::linear("delay", 0.5 * context.step_s, -longest, longest);
    vec![Arc::new(Delay { parameters: vec![Parameter::new("delay", "s", variable)], step_s: context.step_s })]
}

impl Effect for Delay {
    fn identifier(&self) -> Identifier {
        Identifier::Delay
    }

    fn channel(&self) -> Option<usize> {
        Some(1)
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        vec![vec![0.3 * self.step_s], vec![-3.0 * self.step_s], vec![3.0 * self.step_s]]
    }

    fn install(&self, values: &[f64], plant: &mut Plant) {
        plant.delay_s = Some(values[0]);
    }

    fn neutral(&self) -> Vec<(usize, f64)> {
        vec![(0, 0.0)]
    }
}

//! A second lag in series: bead in a sheath, an anti-alias filter. `(1 + τ s)(1 + τ₂ s) y = x`, `τ₂` the smaller.

use crate::effect::{About, Context, Effect, Identifier, Parameter, Shared};
use crate::plant::Plant;
use std::sync::Arc;
use twinlag_optimise::Variable;

pub const ABOUT: About = About {
    name: "second-order",
    explanation: "one sensor has a second lag in series: a sheath around the junction, a filter in the logger",
    advice: "use bare junctions, or know the filter; with the second lag in the model the larger one is the sensor's own",
    confusable: &[Identifier::Delay, Identifier::SlowMode],
    unseen: "a second lag that both sensors share",
};

struct SecondOrder {
    sensor: usize,
    parameters: Vec<Parameter>,
    tau_s: f64,
    step_s: f64,
}

pub fn candidates(context: &Context) -> Vec<Shared> {
    (0..2)
        .map(|sensor| {
            let variable = Variable::logarithmic("second time constant", 0.02 * context.step_s, 0.3 * context.span_s());
            let parameters = vec![Parameter::new("second_time_constant", "s", variable)];
            let tau_s = context.tau_s[sensor].clamp(context.step_s, 0.1 * context.span_s());
            Arc::new(SecondOrder { sensor, parameters, tau_s, step_s: context.step_s }) as Shared
        })
        .collect()
}

impl Effect for SecondOrder {
    fn identifier(&self) -> Identifier {
        Identifier::SecondOrder
    }

    fn channel(&self) -> Option<usize> {
        Some(self.sensor)
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        [0.05, 0.3].into_iter().map(|share| vec![(share * self.tau_s).max(0.3 * self.step_s)]).collect()
    }

    fn install(&self, values: &[f64], plant: &mut Plant) {
        plant.sensors[self.sensor].second_tau_s = Some(values[0]);
    }

    fn neutral(&self) -> Vec<(usize, f64)> {
        vec![(0, 0.0)]
    }
}

//! A slow parallel path: `H = [(1 − φ) + φ/(1 + τ_s s)]/(1 + τ s)`: conduction to a support, the mass of a housing.

use crate::effect::{About, Context, Effect, Identifier, Parameter, Shared};
use crate::plant::Plant;
use std::sync::Arc;
use twinlag_optimise::Variable;

pub const ABOUT: About = About {
    name: "slow-mode",
    explanation: "a part of one sensor's reading follows through a slow body: conduction along the wires to the support, \
                  the mass of the housing",
    advice: "use longer or thinner leads between junction and support, or a support that follows faster",
    confusable: &[Identifier::SecondOrder, Identifier::Crosstalk, Identifier::Delay, Identifier::Drift],
    unseen: "the same share through the same support in both sensors",
};

/// Longest slow time constant beside the length of the record.
const LONGEST: f64 = 0.25;

struct SlowMode {
    sensor: usize,
    parameters: Vec<Parameter>,
    tau_s: f64,
    span_s: f64,
}

pub fn candidates(context: &Context) -> Vec<Shared> {
    (0..2)
        .map(|sensor| {
            // More than half would make the slow path the sensor: with both lags at zero it imitates any pair of them.
            let share = Variable::linear("share", 0.03, -0.002, 0.5);
            // One that settles as long as the record lasts is a drift.
            let slow = Variable::logarithmic("slow time constant", context.step_s, LONGEST * context.span_s());
            let parameters = vec![Parameter::new("share", "1", share), Parameter::new("slow_time_constant", "s", slow)];
            let tau_s = context.tau_s[0].max(context.tau_s[1]).clamp(context.step_s, 0.03 * context.span_s());
            Arc::new(SlowMode { sensor, parameters, tau_s, span_s: context.span_s() }) as Shared
        })
        .collect()
}

impl Effect for SlowMode {
    fn identifier(&self) -> Identifier {
        Identifier::SlowMode
    }

    fn channel(&self) -> Option<usize> {
        Some(self.sensor)
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        [3.0, 15.0].into_iter().map(|times| vec![0.05, (times * self.tau_s).min(0.5 * LONGEST * self.span_s)]).collect()
    }

    fn install(&self, values: &[f64], plant: &mut Plant) {
        plant.sensors[self.sensor].slow = Some([values[0], values[1]]);
    }

    fn neutral(&self) -> Vec<(usize, f64)> {
        vec![(0, 0.0)]
    }
}

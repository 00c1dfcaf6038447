//! An offset of channel 2 that changes evenly with time: `o + d (t − t_middle)`.

use crate::effect::{About, Context, Effect, Identifier, Parameter, Shared};
use crate::plant::Plant;
use std::sync::Arc;
use twinlag_optimise::Variable;

pub const ABOUT: About = About {
    name: "drift",
    explanation: "the offset between the channels changes evenly along the record: a reference junction or an amplifier that \
                  warms up, a wire that ages",
    advice: "let the electronics warm up, hold the reference junction at one temperature",
    confusable: &[Identifier::Calibration, Identifier::SlowMode, Identifier::ColouredNoise, Identifier::InputMismatch],
    unseen: "drift that both channels share",
};

struct Drift {
    parameters: Vec<Parameter>,
    offset_k: f64,
}

pub fn candidates(context: &Context) -> Vec<Shared> {
    let widest = 10.0 * context.swing_k + context.mean_c[0].abs() + context.mean_c[1].abs();
    let typical_k = context.typical_k(1);
    let rate = Parameter::new(
        "drift",
        "K/s",
        Variable::linear("drift", typical_k / context.span_s(), -widest / context.span_s(), widest / context.span_s()),
    );
    let offset = Parameter::new("offset", "K", Variable::linear("offset", typical_k, -widest, widest));
    let offset_k = context.mean_c[1] - context.mean_c[0];
    let make = |parameters| Arc::new(Drift { parameters, offset_k }) as Shared;
    vec![make(vec![rate.clone()]), make(vec![rate, offset])]
}

impl Effect for Drift {
    fn identifier(&self) -> Identifier {
        Identifier::Drift
    }

    fn channel(&self) -> Option<usize> {
        Some(1)
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        if self.parameters.len() == 2 { vec![vec![0.0, self.offset_k]] } else { vec![vec![0.0]] }
    }

    fn install(&self, values: &[f64], plant: &mut Plant) {
        let reading = &mut plant.sensors[1].reading;
        reading.drift_k_per_s = values[0];
        if let Some(offset_k) = values.get(1) {
            reading.offset_k += offset_k;
        }
    }

    fn neutral(&self) -> Vec<(usize, f64)> {
        vec![(0, 0.0)]
    }
}

//! A share `ε` of one channel in the other, on top of its own reading: `y₁ + ε (y₂ − about)`; between the wires, or in a
//! multiplexer that has not settled.
//!
//! With two first-order sensors `y₁ = H₁ x + ε H₂ x` has `y₁/y₂ = (1 + ε) (1 + τ' s)/(1 + τ₁ s)`, `τ' = (τ₂ + ε τ₁)/(1 + ε)`: no record
//! tells it from a gain of `1 + ε` and another `τ₂`. If the share takes the place of a part of the reading, so that the static gain
//! stays 1, it is a wrong `τ₂` and nothing else, and cannot be seen at all.

use crate::effect::{About, Context, Derived, Effect, Identifier, Parameter, Shared};
use crate::plant::Plant;
use std::sync::Arc;
use twinlag_optimise::Variable;

pub const ABOUT: About = About {
    name: "crosstalk",
    explanation: "a share of one channel's reading is the other's: wires that touch, a multiplexer that has not settled",
    advice: "separate the wires, lower the source impedance, let the multiplexer settle longer",
    confusable: &[Identifier::Calibration, Identifier::SlowMode],
    unseen: "crosstalk that takes the place of a part of the reading: with it one time constant is a mixture of both",
};

/// Largest share: of more, wires are not crossed but swapped.
const LARGEST: f64 = 0.25;

struct Crosstalk {
    channel: usize,
    /// Temperature of the other channel that adds nothing, °C.
    about_c: f64,
    parameters: Vec<Parameter>,
}

pub fn candidates(context: &Context) -> Vec<Shared> {
    let mut out = Vec::new();
    for channel in 0..2 {
        let share = Parameter::new("share", "1", Variable::linear("share", 0.03, -LARGEST, LARGEST));
        for about_c in [0.0, context.mean_c[1 - channel]] {
            out.push(Arc::new(Crosstalk { channel, about_c, parameters: vec![share.clone()] }) as Shared);
        }
    }
    out
}

impl Effect for Crosstalk {
    fn identifier(&self) -> Identifier {
        Identifier::Crosstalk
    }

    fn channel(&self) -> Option<usize> {
        Some(self.channel)
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        vec![vec![0.03]]
    }

    fn install(&self, values: &[f64], plant: &mut Plant) {
        let reading = &mut plant.sensors[self.channel].reading;
        (reading.crosstalk, reading.crosstalk_about_c) = (values[0], self.about_c);
    }

    fn derived(&self) -> Vec<Derived> {
        let about_c = self.about_c;
        vec![Derived { name: "neutral_temperature", unit: "°C", of: Box::new(move |_| about_c) }]
    }

    fn neutral(&self) -> Vec<(usize, f64)> {
        vec![(0, 0.0)]
    }
}

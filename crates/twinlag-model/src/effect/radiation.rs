//! Radiation of one sensor to walls: `x = T + τ dT/dt + k (T⁴ − T_wall⁴)`, temperatures in kelvin.

use crate::effect::{About, Context, Derived, Effect, Identifier, Parameter, Shared};
use crate::plant::{Plant, Radiation as Term, ZERO_CELSIUS_K};
use std::sync::Arc;
use twinlag_optimise::Variable;

pub const ABOUT: About = About {
    name: "radiation",
    explanation: "one sensor exchanges radiation with walls of another temperature, the other much less",
    advice: "shield or aspirate the thicker sensor, use thinner wires or lower emissivity",
    confusable: &[Identifier::Calibration, Identifier::TemperatureDependentTimeConstant],
    unseen: "radiation error that both sensors share, which biases the gas temperature itself",
};

struct Radiation {
    sensor: usize,
    parameters: Vec<Parameter>,
    mean_k: f64,
    loss_k: f64,
}

/// `k` from the slope `4 k T³` that it has at the mean.
fn coefficient(slope: f64, mean_k: f64) -> f64 {
    slope / (4.0 * mean_k.powi(3))
}

pub fn candidates(context: &Context) -> Vec<Shared> {
    (0..2)
        .map(|sensor| {
            let mean_k = (context.mean_c[sensor] + ZERO_CELSIUS_K).max(1.0);
            let slope = Variable::logarithmic("radiative conductance", 1e-5, 10.0);
            let loss = Variable::linear("radiative loss", context.typical_k(sensor), -10.0 * mean_k, 10.0 * mean_k);
            let parameters =
                vec![Parameter::new("radiative_conductance", "1", slope), Parameter::new("radiative_loss", "K", loss)];
            let loss_k = context.mean_c[1 - sensor] - context.mean_c[sensor];
            Arc::new(Radiation { sensor, parameters, mean_k, loss_k }) as Shared
        })
        .collect()
}

impl Effect for Radiation {
    fn identifier(&self) -> Identifier {
        Identifier::Radiation
    }

    fn channel(&self) -> Option<usize> {
        Some(self.sensor)
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        [0.02, 0.2, 1.0].into_iter().map(|slope| vec![slope, self.loss_k]).collect()
    }

    fn install(&self, values: &[f64], plant: &mut Plant) {
        plant.sensors[self.sensor].radiation = Some(Term {
            coefficient_per_k3: coefficient(values[0], self.mean_k),
            loss_k: values[1],
            mean_k: self.mean_k,
        });
    }

    fn neutral(&self) -> Vec<(usize, f64)> {
        vec![(0, 0.0)]
    }

    fn derived(&self) -> Vec<Derived> {
        let mean_c = self.mean_k - ZERO_CELSIUS_K;
        vec![Derived { name: "mean_temperature", unit: "°C", of: Box::new(move |_| mean_c) }]
    }
}

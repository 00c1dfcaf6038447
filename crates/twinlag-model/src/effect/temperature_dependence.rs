//! Time constants that change with the sensor's own temperature: `τᵢ(T) = τᵢ (T/T_mean)^p` in kelvin, one exponent for both
//! sensors or for one of them.

use crate::effect::{About, Context, Derived, Effect, Identifier, Parameter, Shared};
use crate::plant::{Plant, ZERO_CELSIUS_K};
use std::sync::Arc;
use twinlag_optimise::Variable;

pub const ABOUT: About = About {
    name: "temperature-dependent-time-constant",
    explanation: "time constants change with temperature: heat capacity, the gas's conductivity, radiative transfer",
    advice: "take records over a smaller range of temperature, or use the exponent that was found",
    confusable: &[Identifier::VaryingTimeConstant, Identifier::Radiation],
    unseen: "a dependence of both on the gas temperature that leaves their disagreement alone",
};

/// Largest exponent.
const STEEPEST: f64 = 12.0;

struct TemperatureDependence {
    sensors: [bool; 2],
    parameters: Vec<Parameter>,
    reference_k: f64,
}

pub fn candidates(context: &Context) -> Vec<Shared> {
    let reference_k = (0.5 * (context.mean_c[0] + context.mean_c[1]) + ZERO_CELSIUS_K).max(1.0);
    // A factor of three over the swing, either way, as far as an exponent is physics: radiation has −3.
    let widest = (1.1 * reference_k / context.swing_k).clamp(8.0, STEEPEST);
    let variable = Variable::linear("exponent", 0.05 * widest, -widest, widest);
    [[true, true], [true, false], [false, true]]
        .into_iter()
        .map(|sensors| {
            let parameters = vec![Parameter::new("exponent", "1", variable.clone())];
            Arc::new(TemperatureDependence { sensors, parameters, reference_k }) as Shared
        })
        .collect()
}

impl Effect for TemperatureDependence {
    fn identifier(&self) -> Identifier {
        Identifier::TemperatureDependentTimeConstant
    }

    fn channel(&self) -> Option<usize> {
        match self.sensors {
            [true, false] => Some(0),
            [false, true] => Some(1),
            _ => None,
        }
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        vec![vec![0.0]]
    }

    fn install(&self, values: &[f64], plant: &mut Plant) {
        for (sensor, has) in plant.sensors.iter_mut().zip(self.sensors) {
            sensor.exponent = has.then_some([values[0], self.reference_k]);
        }
    }

    fn derived(&self) -> Vec<Derived> {
        let mean_c = self.reference_k - ZERO_CELSIUS_K;
        vec![Derived { name: "mean_temperature", unit: "°C", of: Box::new(move |_| mean_c) }]
    }

    fn neutral(&self) -> Vec<(usize, f64)> {
        vec![(0, 0.0)]
    }
}

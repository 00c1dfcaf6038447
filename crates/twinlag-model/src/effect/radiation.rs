//! Radiation of one sensor to walls: `x = T + τ dT/dt + k (T⁴ − T_wall⁴)`, temperatures in kelvin.

use std::sync::Arc;

use twinlag_optimise::Variable;

use crate::effect::KnownEffect;
use crate::effect::{About, Context, Derived, Effect, Freedom, Identifier, Parameter, Seat, Shared, described_by};
use crate::error::ModelError;
use crate::number::Number;
use crate::plant::{Plant, ZERO_CELSIUS_K};

pub(crate) static ABOUT: About = About::new("radiation", 11, candidates)
    .in_words(
        "one sensor exchanges radiation with walls of another temperature, the other much less",
        "shield or aspirate the thicker sensor, use thinner wires or lower emissivity",
        "a radiation error that both sensors share, which biases the gas temperature itself",
    )
    .imitating(&["calibration", "temperature-dependent-time-constant"])
    .imitating_rest()
    .biasing_gas_if_shared()
    .restored_by(restore);

struct Radiation {
    sensor: usize,
    seat: Seat,
    mean_k: f64,
    loss_k: f64,
}

fn candidates(context: &Context) -> Vec<Shared> {
    about(context.mean_c, context)
}

#[expect(clippy::unnecessary_wraps, reason = "other effects may need what a record has not")]
fn restore(known: &KnownEffect, context: &Context) -> Result<Option<Shared>, ModelError> {
    let mean_c = known.parameter("mean_temperature").map_or(context.mean_c, |mean_c| [mean_c; 2]);
    Ok(described_by(known, about(mean_c, context)))
}

/// Those whose numbers are meant at `mean_c`, °C.
fn about(mean_c: [f64; 2], context: &Context) -> Vec<Shared> {
    (0..2)
        .map(|sensor| {
            let mean_k = (mean_c[sensor] + ZERO_CELSIUS_K).max(1.0);
            let slope = Variable::logarithmic("radiative conductance", 1e-5, 10.0);
            let loss = Variable::linear("radiative loss", context.typical_k(sensor), -10.0 * mean_k, 10.0 * mean_k);
            let loss = Parameter::new("radiative_loss", "K", loss).determining(Freedom::Offset);
            let parameters = vec![Parameter::new("radiative_conductance", "1", slope), loss];
            let seat = Seat::new(Identifier::RADIATION, Some(sensor), parameters);
            let loss_k = context.mean_c[1 - sensor] - context.mean_c[sensor];
            Arc::new(Radiation { sensor, seat, mean_k, loss_k }) as Shared
        })
        .collect()
}

impl Effect for Radiation {
    fn seat(&self) -> &Seat {
        &self.seat
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        [0.02, 0.2, 1.0].into_iter().map(|slope| vec![slope, self.loss_k]).collect()
    }

    fn install(&self, values: &[Number], plant: &mut Plant) {
        let (mean_k, loss_k) = (self.mean_k, values[1]);
        // k from the slope 4 k T³ that it has at the mean.
        let per_k3 = values[0] / (4.0 * mean_k.powi(3));
        plant.sensors[self.sensor].rest = Some(Arc::new(move |temperature_c| {
            let t = temperature_c + ZERO_CELSIUS_K;
            // T⁴ − T_mean⁴ without the difference of large numbers.
            let loss = per_k3 * (t - mean_k) * (t + mean_k) * (t * t + mean_k * mean_k) + loss_k;
            (temperature_c + loss, per_k3 * t * t * t * 4.0 + 1.0)
        }));
    }

    fn derived(&self) -> Vec<Derived> {
        vec![Derived::constant("mean_temperature", "°C", self.mean_k - ZERO_CELSIUS_K)]
    }
}

//! Time constants that change with the sensor's own temperature: `τᵢ(T) = τᵢ (T/T_mean)^p` in kelvin, one exponent for both
//! sensors or for one of them.

use std::sync::Arc;

use num_dual::DualNum;
use twinlag_optimise::Variable;

use crate::effect::KnownEffect;
use crate::effect::{About, Context, Derived, Effect, Identifier, Parameter, Seat, Shared, described_by};
use crate::error::ModelError;
use crate::number::{Curve, Number};
use crate::plant::{Plant, ZERO_CELSIUS_K};

pub(crate) static ABOUT: About = About::new("temperature-dependent-time-constant", 10, candidates)
    .in_words(
        "time constants change with temperature: heat capacity, the gas's conductivity, radiative transfer",
        "take records over a smaller range of temperature, or use the exponent that was found",
        "a dependence of both on the gas temperature that does not affect their disagreement",
    )
    .imitating(&["varying-time-constant", "radiation"])
    .restored_by(restore);

/// Largest exponent.
const MAX_EXPONENT: f64 = 12.0;

/// Below this the second term of a series is exact to the square of it over six.
const SMALL_POWER: f64 = 1e-6;

struct TemperatureDependence {
    sensors: [bool; 2],
    seat: Seat,
    reference_k: f64,
}

fn candidates(context: &Context) -> Vec<Shared> {
    about(0.5 * (context.mean_c[0] + context.mean_c[1]), context)
}

#[expect(clippy::unnecessary_wraps, reason = "other effects may need what a record has not")]
fn restore(known: &KnownEffect, context: &Context) -> Result<Option<Shared>, ModelError> {
    let here_c = 0.5 * (context.mean_c[0] + context.mean_c[1]);
    Ok(described_by(known, about(known.parameter("mean_temperature").unwrap_or(here_c), context)))
}

/// Those whose time constants are meant at `mean_c`, °C.
fn about(mean_c: f64, context: &Context) -> Vec<Shared> {
    let reference_k = (mean_c + ZERO_CELSIUS_K).max(1.0);
    // A factor of three over the swing, either way, as far as an exponent is physics: radiation has −3.
    let widest = (1.1 * reference_k / context.swing_k).clamp(8.0, MAX_EXPONENT);
    let variable = Variable::linear("exponent", 0.05 * widest, -widest, widest);
    [[true, true], [true, false], [false, true]]
        .into_iter()
        .map(|sensors| {
            let parameters = vec![Parameter::new("exponent", "1", variable.clone())];
            let channel = match sensors {
                [true, false] => Some(0),
                [false, true] => Some(1),
                _ => None,
            };
            let seat = Seat::new(Identifier::TEMPERATURE_DEPENDENT_TIME_CONSTANT, channel, parameters);
            Arc::new(TemperatureDependence { sensors, seat, reference_k }) as Shared
        })
        .collect()
}

impl Effect for TemperatureDependence {
    fn seat(&self) -> &Seat {
        &self.seat
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        vec![vec![0.0]]
    }

    fn install(&self, values: &[Number], plant: &mut Plant) {
        for (sensor, _) in plant.sensors.iter_mut().zip(self.sensors).filter(|(_, has)| *has) {
            sensor.heat = Some(heat(values[0], self.reference_k));
        }
    }

    fn derived(&self) -> Vec<Derived> {
        vec![Derived::constant("mean_temperature", "°C", self.reference_k - ZERO_CELSIUS_K)]
    }
}

/// `∫ (T/T₀)^p dT` from `T₀` on, and its slope `(T/T₀)^p`.
fn heat(exponent: Number, reference_k: f64) -> Curve {
    Arc::new(move |temperature_c| {
        let kelvin = temperature_c + ZERO_CELSIUS_K;
        let ratio = if kelvin.re < 1.0 { Number::from(1.0) } else { kelvin } / reference_k;
        let logarithm = ratio.ln();
        let power = (exponent + 1.0) * logarithm;
        // Where p = −1 the integral is the logarithm.
        let integral = if power.re.abs() < SMALL_POWER {
            logarithm * (power * 0.5 + 1.0)
        } else {
            power.exp_m1() / (exponent + 1.0)
        };
        (integral * reference_k, (exponent * logarithm).exp())
    })
}

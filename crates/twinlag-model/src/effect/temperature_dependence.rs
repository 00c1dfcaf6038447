//! Time constants that change with temperature: `τᵢ = τᵢ₀ (T_h/T_mean)^p` in kelvin, one exponent for both sensors or for one of
//! them. `T_h = (1 − m) T + m x` lies between the sensor's own temperature `T` and that of the gas, `x`: heat capacity and
//! radiation go with the first (`m = 0`), the properties of the gas with that of the film, halfway (`m = ½`).

use std::sync::Arc;

use num_dual::DualNum;
use twinlag_optimise::Variable;

use crate::effect::KnownEffect;
use crate::effect::{About, Context, Derived, Effect, Identifier, Parameter, Seat, Shared, described_by};
use crate::error::ModelError;
use crate::gas::Gas;
use crate::number::{Curve, Number};
use crate::plant::{Plant, TimeConstantChange, ZERO_CELSIUS_K};

pub(crate) static ABOUT: About = About::new("temperature-dependent-time-constant", 10, candidates)
    .in_words(
        "time constants change with temperature: that of the sensor (heat capacity, radiative transfer) or that of the film, \
         halfway to the gas (conductivity and viscosity of the gas)",
        "take records over a smaller range of temperature, or use the exponent that was found",
        "a dependence of both on the gas temperature that does not affect their disagreement",
    )
    // With `τ (1 + β (T − T̄))` the gas temperature that a constant `τ` gives lacks `τ β/2 · d(T − T̄)²/dt`, and with a curvature `c` it
    // lacks `c (1 + τ d/dt) (T − T̄)²`: the same, with `c = β/2`, where the gas is fast.
    .imitating(&["varying-time-constant", "radiation", "calibration"])
    .following_gas()
    .restored_by(restore);

/// Largest exponent.
const MAX_EXPONENT: f64 = 12.0;

/// Share of the gas temperature in that of the film.
const FILM_SHARE: f64 = 0.5;
/// Share of the gas temperature that a step of a fit may change.
const TYPICAL_GAS_SHARE: f64 = 0.2;
/// Least and largest share of the gas temperature: a little beyond none and all of it, so that neither is a bound.
const GAS_SHARE_BOUNDS: [f64; 2] = [-0.25, 1.25];

/// Least ratio of a temperature to that at which time constants are meant, both in K: what is less is no gas.
const MIN_RATIO: f64 = 0.05;

/// Below this the second term of a series is exact to the square of it over six.
const SMALL_POWER: f64 = 1e-6;

/// The temperature that time constants follow.
#[derive(Clone)]
enum Follows {
    /// The sensor's own.
    Sensor,
    /// One between it and the gas's, with this share of the latter; `None` where that is fitted.
    Gas { gas: Arc<Gas>, share: Option<f64> },
}

struct TemperatureDependence {
    sensors: [bool; 2],
    seat: Seat,
    reference_k: f64,
    follows: Follows,
}

fn candidates(context: &Context) -> Vec<Shared> {
    let mean_c = 0.5 * (context.mean_c[0] + context.mean_c[1]);
    let film = context.gas.iter().map(|gas| Follows::Gas { gas: gas.clone(), share: Some(FILM_SHARE) });
    std::iter::once(Follows::Sensor).chain(film).flat_map(|follows| about(mean_c, &follows, context)).collect()
}

#[expect(clippy::unnecessary_wraps, reason = "other effects may need what a record has not")]
fn restore(known: &KnownEffect, context: &Context) -> Result<Option<Shared>, ModelError> {
    let here_c = 0.5 * (context.mean_c[0] + context.mean_c[1]);
    let mean_c = known.parameter("mean_temperature").unwrap_or(here_c);
    // Older models have no such share; and where there is no estimate of the gas, it is as warm as the sensors, to all purposes.
    let gas = context.gas.as_ref().filter(|_| known.parameter("gas_share").is_some());
    let follows = gas.map_or(Follows::Sensor, |gas| Follows::Gas { gas: gas.clone(), share: None });
    Ok(described_by(known, about(mean_c, &follows, context)))
}

/// Those whose time constants are meant at `mean_c`, °C.
fn about(mean_c: f64, follows: &Follows, context: &Context) -> Vec<Shared> {
    let reference_k = (mean_c + ZERO_CELSIUS_K).max(1.0);
    // A factor of three over the swing, either way, as far as an exponent is physics: radiation has −3.
    let widest = (1.1 * reference_k / context.swing_k).clamp(8.0, MAX_EXPONENT);
    let exponent = Variable::linear("exponent", 0.05 * widest, -widest, widest);
    [[true, true], [true, false], [false, true]]
        .into_iter()
        .map(|sensors| {
            let exponent = Parameter::new("exponent", "1", exponent.clone());
            TemperatureDependence::shared(sensors, exponent, reference_k, follows.clone())
        })
        .collect()
}

impl TemperatureDependence {
    fn shared(sensors: [bool; 2], exponent: Parameter, reference_k: f64, follows: Follows) -> Shared {
        let channel = match sensors {
            [true, false] => Some(0),
            [false, true] => Some(1),
            _ => None,
        };
        let mut parameters = vec![exponent];
        if let Follows::Gas { share: None, .. } = follows {
            let [lowest, highest] = GAS_SHARE_BOUNDS;
            let share = Variable::linear("share of the gas temperature", TYPICAL_GAS_SHARE, lowest, highest);
            parameters.push(Parameter::new("gas_share", "1", share));
        }
        let seat = Seat::new(Identifier::TEMPERATURE_DEPENDENT_TIME_CONSTANT, channel, parameters);
        Arc::new(Self { sensors, seat, reference_k, follows })
    }
}

impl Effect for TemperatureDependence {
    fn seat(&self) -> &Seat {
        &self.seat
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        match self.follows {
            Follows::Gas { share: None, .. } => vec![vec![0.0, FILM_SHARE]],
            _ => vec![vec![0.0]],
        }
    }

    fn install(&self, values: &[Number], plant: &mut Plant) {
        let (exponent, reference_k) = (values[0], self.reference_k);
        for (i, sensor) in plant.sensors.iter_mut().enumerate().filter(|(i, _)| self.sensors[*i]) {
            match &self.follows {
                Follows::Sensor => sensor.heat = Some(heat(exponent, reference_k)),
                Follows::Gas { gas, share } => {
                    let (gas, share) = (gas.clone(), share.map_or_else(|| values[1], Number::from));
                    let change = TimeConstantChange::of_time(Arc::new(move |time_s| {
                        let ratio = gas.between_k(i, share, time_s) / reference_k;
                        let ratio = if ratio.re < MIN_RATIO { Number::from(MIN_RATIO) } else { ratio };
                        (ratio.ln() * exponent).exp_m1()
                    }));
                    sensor.changes.push(change);
                }
            }
        }
    }

    fn extended(&self, values: &[f64]) -> Option<(Shared, Vec<f64>)> {
        let Follows::Gas { gas, share: Some(share) } = &self.follows else { return None };
        let follows = Follows::Gas { gas: gas.clone(), share: None };
        let exponent = self.seat.parameters[0].clone();
        Some((Self::shared(self.sensors, exponent, self.reference_k, follows), vec![values[0], *share]))
    }

    fn in_gas(&self, gas: &Arc<Gas>) -> Option<Shared> {
        let Follows::Gas { share, .. } = self.follows else { return None };
        let follows = Follows::Gas { gas: gas.clone(), share };
        Some(Self::shared(self.sensors, self.seat.parameters[0].clone(), self.reference_k, follows))
    }

    fn derived(&self) -> Vec<Derived> {
        let mean = Derived::constant("mean_temperature", "°C", self.reference_k - ZERO_CELSIUS_K);
        let share = match self.follows {
            Follows::Gas { share: Some(share), .. } => Some(Derived::constant("gas_share", "1", share)),
            _ => None,
        };
        std::iter::once(mean).chain(share).collect()
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

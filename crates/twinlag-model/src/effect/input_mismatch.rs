//! Sensors that do not see the same gas: a difference of the gas temperatures that is independent of them, autoregressive of
//! first order. In the reading of the sensor that sees the other gas it is noise that has passed the sensor's lag.

use std::sync::Arc;

use super::coloured_noise;
use crate::effect::parameter::inside;
use crate::effect::{About, Context, Effect, Identifier, KnownEffect, Seat, Shared, described_by};
use crate::error::ModelError;
use crate::number::Number;
use crate::plant::{Extra, Place, Plant};

pub(crate) static ABOUT: About = About::new("input-mismatch", 14, candidates)
    .in_words(
        "the two sensors do not see the same gas: eddies smaller than their distance, a wake, a gradient",
        "mount the junctions closer together, across the flow, away from walls; weights and intervals take \
         the mismatch into account",
        "a disturbance that both sensors see but the gas elsewhere does not",
    )
    .imitating(&["coloured-noise"])
    .of_noise()
    .restored_by(restore)
    .streamable();

struct InputMismatch {
    seat: Seat,
    /// The sensor that sees another gas, with its time constant, s; `None` of a difference that is noise of the inferred gas
    /// temperature.
    at: Option<(usize, f64)>,
    tau_s: f64,
    swing_k: f64,
}

/// What passes a sensor's lag: whichever sees another gas than the other one does.
fn candidates(context: &Context) -> Vec<Shared> {
    at([0, 1].map(|sensor| Some((sensor, context.tau_s[sensor]))), context)
}

/// Models of older versions have noise of the inferred gas temperature, of neither sensor.
#[expect(clippy::unnecessary_wraps, reason = "other effects may need what a record has not")]
fn restore(known: &KnownEffect, context: &Context) -> Result<Option<Shared>, ModelError> {
    let places = known.channel.map(|sensor| (sensor, context.tau_s[sensor]));
    Ok(described_by(known, at([places], context)))
}

fn at<const N: usize>(places: [Option<(usize, f64)>; N], context: &Context) -> Vec<Shared> {
    if !context.is_even {
        return Vec::new();
    }
    let tau_s = context.tau_s[0].min(context.tau_s[1]).clamp(2.0 * context.step_s, 0.1 * context.span_s());
    let of = |at: Option<(usize, f64)>| {
        let parameters = coloured_noise::extra(context, 0.01 * context.swing_k);
        let seat = Seat::new(Identifier::INPUT_MISMATCH, at.map(|(sensor, _)| sensor), parameters);
        Arc::new(InputMismatch { seat, at, tau_s, swing_k: context.swing_k }) as Shared
    };
    places.map(of).to_vec()
}

impl Effect for InputMismatch {
    fn seat(&self) -> &Seat {
        &self.seat
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        [0.3 * self.tau_s, 3.0 * self.tau_s]
            .into_iter()
            .map(|tau_s| inside(&self.seat.parameters, &[0.02 * self.swing_k, tau_s]))
            .collect()
    }

    fn install(&self, values: &[Number], plant: &mut Plant) {
        let [std_k, correlation_s] = [values[0].re, values[1].re];
        let place = self.at.map_or(Place::Gas, |(sensor, lag_s)| Place::GasAt { sensor, lag_s });
        plant.extra.push(Extra { place, std_k, correlation_s });
    }

    fn beside(&self, tau_s: [f64; 2]) -> Option<Shared> {
        let (sensor, _) = self.at?;
        let Self { ref seat, tau_s: typical_s, swing_k, .. } = *self;
        Some(Arc::new(Self { seat: seat.clone(), at: Some((sensor, tau_s[sensor])), tau_s: typical_s, swing_k }))
    }
}

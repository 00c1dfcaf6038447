//! Noise of one reading that is not white: autoregressive of first order beside the white noise.

use std::sync::Arc;

use twinlag_optimise::Variable;

use crate::effect::parameter::inside;
use crate::effect::{About, Context, Effect, Identifier, Parameter, Seat, Shared};
use crate::number::Number;
use crate::plant::{Extra, Place, Plant};

pub(crate) static ABOUT: About = About::new("coloured-noise", 13, candidates)
    .in_words(
        "the noise of one channel is correlated from sample to sample: an amplifier, a filter, \
         electromagnetic interference",
        "a better amplifier, where it is noise: two places with different gas look much like it. Weights and intervals take it into account",
        "which channel has slow noise that both sensors could follow",
    )
    .imitating(&["input-mismatch", "drift"])
    .of_noise()
    .leaving_lags()
    .streamable();

struct ColouredNoise {
    channel: usize,
    seat: Seat,
    step_s: f64,
    noise_std_k: f64,
}

/// Shortest correlation, of a step: what lasts shorter is white.
pub(crate) const MIN_CORRELATION_STEPS: f64 = 1.0;
/// Longest correlation, of the record: what lasts longer is a drift.
pub(crate) const MAX_CORRELATION_SPANS: f64 = 0.05;

/// Parameters of extra noise: its standard deviation, how long it lasts.
pub(super) fn extra(context: &Context, typical_k: f64) -> Vec<Parameter> {
    vec![
        Parameter::new("noise_std", "K", Variable::logarithmic("noise std", 1e-3 * typical_k, 10.0 * context.swing_k)),
        Parameter::new(
            "correlation_time",
            "s",
            Variable::logarithmic(
                "correlation time",
                MIN_CORRELATION_STEPS * context.step_s,
                MAX_CORRELATION_SPANS * context.span_s(),
            ),
        ),
    ]
}

fn candidates(context: &Context) -> Vec<Shared> {
    if !context.is_even {
        return Vec::new();
    }
    (0..2)
        .map(|channel| {
            let noise_std_k = context.noise_std_k[channel];
            let seat = Seat::new(Identifier::COLOURED_NOISE, Some(channel), extra(context, noise_std_k));
            Arc::new(ColouredNoise { channel, seat, step_s: context.step_s, noise_std_k }) as Shared
        })
        .collect()
}

impl Effect for ColouredNoise {
    fn seat(&self) -> &Seat {
        &self.seat
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        let start = |steps: f64| inside(&self.seat.parameters, &[self.noise_std_k, steps * self.step_s]);
        [3.0, 20.0].map(start).to_vec()
    }

    fn install(&self, values: &[Number], plant: &mut Plant) {
        let [std_k, correlation_s] = [values[0].re, values[1].re];
        plant.extra.push(Extra { place: Place::Reading(self.channel), std_k, correlation_s });
    }
}

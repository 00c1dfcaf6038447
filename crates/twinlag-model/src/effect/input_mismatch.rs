//! Sensors that do not see the same gas: a difference of the gas temperatures that is independent of them, autoregressive of
//! first order.

use std::sync::Arc;

use super::coloured_noise;
use crate::effect::parameter::inside;
use crate::effect::{About, Context, Effect, Identifier, Seat, Shared};
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
    .leaving_lags()
    .streamable();

struct InputMismatch {
    seat: Seat,
    tau_s: f64,
    swing_k: f64,
}

fn candidates(context: &Context) -> Vec<Shared> {
    if !context.is_even {
        return Vec::new();
    }
    let tau_s = context.tau_s[0].min(context.tau_s[1]).clamp(2.0 * context.step_s, 0.1 * context.span_s());
    let parameters = coloured_noise::extra(context, 0.01 * context.swing_k);
    vec![Arc::new(InputMismatch {
        seat: Seat::new(Identifier::INPUT_MISMATCH, None, parameters),
        tau_s,
        swing_k: context.swing_k,
    })]
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
        plant.extra.push(Extra { place: Place::Gas, std_k, correlation_s });
    }
}

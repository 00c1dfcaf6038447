//! An offset of channel 2 that changes evenly with time: `o + d (t − t_middle)`.

use std::sync::Arc;

use twinlag_optimise::Variable;

use crate::effect::{About, Context, Effect, Freedom, Identifier, Parameter, Seat, Shared};
use crate::number::Number;
use crate::plant::Plant;

pub(crate) static ABOUT: About = About::new("drift", 12, candidates)
    .in_words(
        "the offset between the channels changes linearly along the record, of several records along a line of its own in each: \
         a reference junction or an amplifier that warms up, a wire that ages",
        "let the electronics warm up, hold the reference junction at one temperature",
        "drift that both channels share",
    )
    .imitating(&["calibration", "slow-mode", "coloured-noise", "input-mismatch"])
    .imitating_rest()
    .leaving_lags()
    .biasing_gas_if_shared();

struct Drift {
    seat: Seat,
    offset_k: f64,
    middle_s: f64,
}

fn candidates(context: &Context) -> Vec<Shared> {
    let widest = 10.0 * context.swing_k + context.mean_c[0].abs() + context.mean_c[1].abs();
    let typical_k = context.typical_k(1);
    let rate = Parameter::new(
        "drift",
        "K/s",
        Variable::linear("drift", typical_k / context.span_s(), -widest / context.span_s(), widest / context.span_s()),
    );
    let offset = Parameter::new("offset", "K", Variable::linear("offset", typical_k, -widest, widest))
        .determining(Freedom::Offset);
    let (offset_k, middle_s) = (context.mean_c[1] - context.mean_c[0], context.middle_s());
    let make = |parameters| {
        let seat = Seat::new(Identifier::DRIFT, Some(1), parameters);
        Arc::new(Drift { seat, offset_k, middle_s }) as Shared
    };
    vec![make(vec![rate.clone()]), make(vec![rate, offset])]
}

impl Effect for Drift {
    fn seat(&self) -> &Seat {
        &self.seat
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        if self.seat.parameters.len() == 2 { vec![vec![0.0, self.offset_k]] } else { vec![vec![0.0]] }
    }

    fn install(&self, values: &[Number], plant: &mut Plant) {
        let (k_per_s, middle_s) = (values[0], self.middle_s);
        let reading = &mut plant.sensors[1].reading;
        reading.disturbances.push(Arc::new(move |time_s| k_per_s * (time_s - middle_s)));
        if let Some(offset_k) = values.get(1) {
            reading.offset_k += *offset_k;
        }
    }

    fn is_of_the_record(&self) -> bool {
        true
    }
}

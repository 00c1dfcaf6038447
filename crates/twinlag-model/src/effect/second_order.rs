//! A second lag in series: bead in a sheath, an anti-alias filter. `(1 + τ s)(1 + τ₂ s) y = x`, `τ₂` the smaller.

use std::sync::Arc;

use twinlag_optimise::Variable;

use crate::effect::{About, Context, Effect, Identifier, Parameter, Seat, Shared};
use crate::number::Number;
use crate::plant::Plant;

pub(crate) static ABOUT: About = About::new("second-order", 6, candidates)
    .in_words(
        "one sensor has a second lag in series: a sheath around the junction, a filter in the logger",
        "use bare junctions, or find out the time constant of the filter; with the second lag in the model, \
         the larger lag is the sensor's own",
        "a second lag that both sensors share",
    )
    .imitating(&["delay", "slow-mode"])
    .turning_phases()
    .streamable();

struct SecondOrder {
    sensor: usize,
    seat: Seat,
    tau_s: f64,
    step_s: f64,
}

fn candidates(context: &Context) -> Vec<Shared> {
    (0..2)
        .map(|sensor| {
            let variable = Variable::logarithmic("second time constant", 0.02 * context.step_s, 0.3 * context.span_s());
            let parameters = vec![Parameter::new("second_time_constant", "s", variable)];
            let seat = Seat::new(Identifier::SECOND_ORDER, Some(sensor), parameters);
            let tau_s = context.tau_s[sensor].clamp(context.step_s, 0.1 * context.span_s());
            Arc::new(SecondOrder { sensor, seat, tau_s, step_s: context.step_s }) as Shared
        })
        .collect()
}

impl Effect for SecondOrder {
    fn seat(&self) -> &Seat {
        &self.seat
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        [0.05, 0.3].into_iter().map(|share| vec![(share * self.tau_s).max(0.3 * self.step_s)]).collect()
    }

    fn lag_s(&self, values: &[f64]) -> f64 {
        values[0]
    }

    fn install(&self, values: &[Number], plant: &mut Plant) {
        plant.sensors[self.sensor].second_tau_s = Some(values[0]);
    }

    fn series_lag(&self) -> Option<usize> {
        Some(0)
    }
}

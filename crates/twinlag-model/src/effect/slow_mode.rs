//! A slow parallel path, `H = [(1 − φ) + φ/(1 + τ_s s)]/(1 + τ s)`, such as conduction to a support
//! or the mass of a housing.

use std::sync::Arc;

use twinlag_optimise::Variable;

use crate::departure::Departure;
use crate::effect::{About, Context, Domain, Effect, Identifier, Parameter, Seat, Shared};
use crate::number::Number;
use crate::observations::Observations;
use crate::plant::{Plant, SlowPath};

pub(crate) static ABOUT: About = About::new("slow-mode", 7, candidates)
    .in_words(
        "part of one sensor's reading arrives through a slow body: conduction along the wires to the support, \
                  the mass of the housing. The share is the part of what the sensor follows, with its own time constant, that \
                  is this body and not the gas; of two paths side by side the slow one has the share times τ_slow/(τ_slow − τ)",
        "use longer or thinner leads between junction and support, or a support that follows faster",
        "the same share through the same support in both sensors",
    )
    .imitating(&["second-order", "crosstalk", "delay", "drift"])
    .turning_phases()
    .streamable();

/// Longest slow time constant beside the length of the record.
const MAX_SLOW_SPANS: f64 = 0.25;

struct SlowMode {
    sensor: usize,
    seat: Seat,
    tau_s: f64,
    span_s: f64,
    /// How far from equilibrium the slow body began; none where it may have begun anywhere.
    departures: Vec<Departure>,
}

fn candidates(context: &Context) -> Vec<Shared> {
    (0..2)
        .map(|sensor| {
            // More than half would make the slow path the sensor: with both lags at zero it imitates any pair of them.
            let share = Variable::linear("share", 0.03, -0.002, 0.5);
            // One that settles as long as the record lasts is a drift.
            let slow = Variable::logarithmic("slow time constant", context.step_s, MAX_SLOW_SPANS * context.span_s());
            let share = Parameter::new("share", "1", share).within(Domain::Share);
            let parameters = vec![share, Parameter::new("slow_time_constant", "s", slow)];
            let seat = Seat::new(Identifier::SLOW_MODE, Some(sensor), parameters);
            let tau_s = context.tau_s[0].max(context.tau_s[1]).clamp(context.step_s, 0.03 * context.span_s());
            Arc::new(SlowMode { sensor, seat, tau_s, span_s: context.span_s(), departures: Vec::new() }) as Shared
        })
        .collect()
}

impl Effect for SlowMode {
    fn seat(&self) -> &Seat {
        &self.seat
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        [3.0, 15.0]
            .into_iter()
            .map(|times| vec![0.05, (times * self.tau_s).min(0.5 * MAX_SLOW_SPANS * self.span_s)])
            .collect()
    }

    fn install(&self, values: &[Number], plant: &mut Plant) {
        plant.sensors[self.sensor].slow = Some(SlowPath { share: values[0], tau_s: values[1] });
    }

    fn in_equilibrium(&self, plant: &Plant, observations: &Observations) -> Option<Shared> {
        let departures = Departure::of_records(plant, self.sensor, observations);
        let is_known = !departures.is_empty();
        is_known.then(|| Arc::new(Self { departures, seat: self.seat.clone(), ..*self }) as Shared)
    }

    fn departures(&self) -> &[Departure] {
        &self.departures
    }
}

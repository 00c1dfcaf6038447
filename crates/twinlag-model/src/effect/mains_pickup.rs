//! A sinusoid in one reading that is not in the gas: mains, an ignition, a pump. Its frequency is where a line sticks out of the
//! residual.

use std::sync::Arc;

use num_dual::DualNum;
use twinlag_optimise::Variable;

use crate::effect::KnownEffect;
use crate::effect::{About, Context, Derived, Domain, Effect, Identifier, Parameter, Seat, Shared, described_by};
use crate::error::ModelError;
use crate::number::Number;
use crate::plant::Plant;

pub(crate) static ABOUT: About = About::new("mains-pickup", 3, candidates)
    .in_words(
        "a steady sinusoid in one channel that the other does not have: mains or another machine, possibly aliased",
        "shield and twist the leads, ground at one end, average over whole mains periods",
        "pick-up in both channels that their lags happen to make equal",
    )
    .at_one_frequency()
    .leaving_lags()
    .restored_by(restore);

struct MainsPickup {
    channel: usize,
    seat: Seat,
    frequency_hz: f64,
}

fn candidates(context: &Context) -> Vec<Shared> {
    at_lines(context.lines.iter().take(2), context)
}

#[expect(clippy::unnecessary_wraps, reason = "other effects may need what a record has not")]
fn restore(known: &KnownEffect, context: &Context) -> Result<Option<Shared>, ModelError> {
    let lines: Vec<(f64, usize)> = known.parameter("frequency").into_iter().flat_map(|hz| [(hz, 0), (hz, 1)]).collect();
    Ok(described_by(known, at_lines(lines.iter(), context)))
}

fn at_lines<'a>(lines: impl Iterator<Item = &'a (f64, usize)>, context: &Context) -> Vec<Shared> {
    let mut out = Vec::new();
    if !context.is_even {
        return out;
    }
    for &(frequency_hz, channel) in lines {
        let width = 1.0 / context.span_s();
        let widest = 3.0 * context.swing_k;
        let amplitude =
            |name| Parameter::new(name, "K", Variable::linear(name, context.typical_k(channel), -widest, widest));
        let frequency = Variable::linear(
            "frequency",
            0.01 * width,
            (frequency_hz - 1.5 * width).max(0.0),
            frequency_hz + 1.5 * width,
        );
        let parameters = vec![
            Parameter::new("frequency", "Hz", frequency).within(Domain::NotNegative),
            amplitude("cosine_amplitude"),
            amplitude("sine_amplitude"),
        ];
        let seat = Seat::new(Identifier::MAINS_PICKUP, Some(channel), parameters);
        out.push(Arc::new(MainsPickup { channel, seat, frequency_hz }) as Shared);
    }
    out
}

impl Effect for MainsPickup {
    fn seat(&self) -> &Seat {
        &self.seat
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        vec![vec![self.frequency_hz, 0.0, 0.0]]
    }

    fn install(&self, values: &[Number], plant: &mut Plant) {
        let [hz, cosine_k, sine_k] = [values[0], values[1], values[2]];
        plant.sensors[self.channel].reading.disturbances.push(Arc::new(move |time_s| {
            let (sine, cosine) = (hz * (std::f64::consts::TAU * time_s)).sin_cos();
            cosine_k * cosine + sine_k * sine
        }));
    }

    fn main(&self) -> Option<usize> {
        Some(1)
    }

    fn is_of_the_record(&self) -> bool {
        true
    }

    fn derived(&self) -> Vec<Derived> {
        vec![Derived { name: "amplitude", unit: "K", of: Box::new(|values| values[1].hypot(values[2])) }]
    }
}

//! A share `ε` of one channel in the other, on top of its own reading: `y₁ + ε (y₂ − about)`; between the wires, or in a
//! multiplexer that has not settled.
//!
//! With two first-order sensors no record distinguishes it from a gain of `1 + ε` and another `τ₂`: see [`Twin`].
//! If the share takes the place of a part of the reading, so that the static gain stays 1, it is a
//! wrong `τ₂` and nothing else, and cannot be seen at all.

use std::sync::Arc;

use twinlag_optimise::Variable;

use crate::effect::KnownEffect;
use crate::effect::{About, Context, Derived, Domain, Effect, Identifier, Parameter, Seat, Shared, Twin, described_by};
use crate::error::ModelError;
use crate::number::Number;
use crate::plant::Plant;

pub(crate) static ABOUT: About = About::new("crosstalk", 8, candidates)
    .in_words(
        "one channel picks up a share of the other: wires that touch, a multiplexer that has not settled",
        "separate the wires, lower the source impedance, let the multiplexer settle longer",
        "crosstalk that replaces part of the reading, which turns one time constant into a mixture of both",
    )
    .imitating(&["calibration", "slow-mode"])
    .excluding(&["calibration"])
    .restored_by(restore);

/// Largest share: of more, wires are not crossed but swapped.
pub(super) const MAX_SHARE: f64 = 0.25;

struct Crosstalk {
    /// Whether an offset of the channel is fitted with it, so that the temperature that adds nothing is free.
    has_offset: bool,
    channel: usize,
    /// Temperature of the other channel that adds nothing, °C.
    about_c: f64,
    context: Context,
    seat: Seat,
}

fn candidates(context: &Context) -> Vec<Shared> {
    let both = |channel: usize| [0.0, context.mean_c[1 - channel]].map(|about_c| about(channel, about_c, context));
    (0..2).flat_map(both).collect()
}

fn about(channel: usize, about_c: f64, context: &Context) -> Shared {
    of_kind(channel, about_c, false, context)
}

fn of_kind(channel: usize, about_c: f64, has_offset: bool, context: &Context) -> Shared {
    let variable = Variable::linear("share", 0.03, -MAX_SHARE, MAX_SHARE);
    let share = Parameter::new("share", "1", variable).within(Domain::Share);
    let mut parameters = vec![share];
    if has_offset {
        let other_c = context.mean_c[1 - channel] - about_c;
        let widest = MAX_SHARE * (10.0 * context.swing_k + other_c.abs());
        let variable = Variable::linear("offset", context.typical_k(channel), -widest, widest);
        parameters.push(Parameter::new("offset", "K", variable));
    }
    let seat = Seat::new(Identifier::CROSSTALK, Some(channel), parameters);
    Arc::new(Crosstalk { has_offset, channel, about_c, context: context.clone(), seat })
}

#[expect(clippy::unnecessary_wraps, reason = "other effects may need what a record has not")]
fn restore(known: &KnownEffect, context: &Context) -> Result<Option<Shared>, ModelError> {
    let neutral_c = |channel: usize| known.parameter("neutral_temperature").unwrap_or(context.mean_c[1 - channel]);
    Ok(described_by(known, (0..2).map(|channel| about(channel, neutral_c(channel), context)).collect()))
}

impl Effect for Crosstalk {
    fn seat(&self) -> &Seat {
        &self.seat
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        vec![if self.has_offset { vec![0.03, 0.0] } else { vec![0.03] }]
    }

    fn twins(&self, values: &[f64], tau_s: [f64; 2]) -> Vec<Twin> {
        let gain = Twin::calibration(self.channel, values[0], tau_s);
        vec![gain, Twin::crosstalk(1 - self.channel, gain.value, gain.time_constants_s)]
    }

    /// The temperature that adds nothing is known of no instrument.
    fn whole(&self, values: &[f64]) -> Option<(Shared, Vec<f64>)> {
        (!self.has_offset).then(|| (of_kind(self.channel, self.about_c, true, &self.context), vec![values[0], 0.0]))
    }

    fn install(&self, values: &[Number], plant: &mut Plant) {
        let reading = &mut plant.sensors[self.channel].reading;
        (reading.crosstalk, reading.crosstalk_about_c) = (values[0], self.about_c);
        if self.has_offset {
            reading.offset_k += values[1];
        }
    }

    fn derived(&self) -> Vec<Derived> {
        vec![Derived::constant("neutral_temperature", "°C", self.about_c)]
    }
}

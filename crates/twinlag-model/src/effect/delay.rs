//! A delay between the channels: channel 2 is read later, or sees the gas later, by `d`.
//!
//! The inferred gas temperature of channel 2 is taken `d` later, between the samples by the spline through them.

use std::iter::successors;
use std::sync::Arc;

use twinlag_optimise::Variable;

use crate::chain::UNEVEN_REACH;
use crate::effect::parameter::inside;
use crate::effect::{About, Context, Effect, Identifier, Parameter, Seat, Shared};
use crate::number::Number;
use crate::plant::Plant;

pub(crate) static ABOUT: About = About::new("delay", 5, candidates)
    .in_words(
        "one channel is later than the other: it is scanned later, filtered with a pure delay, or further \
         downstream",
        "sample both channels at the same instant, mount the junctions side by side across the flow, and check the \
             logger's scan order",
        "a delay that both channels share",
    )
    .imitating(&["second-order", "slow-mode"])
    .turning_phases()
    .biasing_gas_if_shared()
    .relative();

/// Usual delays: as a share of the faster time constant, as of a second lag, and in sample periods. Chosen.
const USUAL_SHARE: f64 = 0.3;
const USUAL_PERIODS: f64 = 0.5;

/// Where fits start, in sample periods: at a part of one and, both ways, at a few and further, each so many times the one before, up to
/// this share of the longest that there can be. From a few alone the fit of a delay of 12 beside a time constant of 12 ends in another
/// minimum (the test of `twinlag-diagnose` on a long delay).
const NEAR_START_PERIODS: f64 = 0.3;
const FAR_START_PERIODS: f64 = 3.0;
const START_RATIO: f64 = 3.0;
const LAST_START_SHARE: f64 = 0.8;

struct Delay {
    seat: Seat,
    step_s: f64,
    faster_s: f64,
}

fn candidates(context: &Context) -> Vec<Shared> {
    let longest = if context.is_even { (context.reach - 1) as f64 } else { UNEVEN_REACH as f64 - 0.5 } * context.step_s;
    let variable = Variable::linear("delay", USUAL_PERIODS * context.step_s, -longest, longest);
    let delay = Parameter::new("delay", "s", variable).as_lateness();
    let seat = Seat::new(Identifier::DELAY, Some(1), vec![delay]);
    let faster_s = context.tau_s[0].min(context.tau_s[1]);
    vec![Arc::new(Delay { seat, step_s: context.step_s, faster_s })]
}

impl Effect for Delay {
    fn seat(&self) -> &Seat {
        &self.seat
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        let longest = self.seat.parameters[0].variable.upper / self.step_s;
        let last = LAST_START_SHARE * longest;
        let further = |far: &f64| Some(far * START_RATIO).filter(|far| *far < last);
        let far = successors(Some(FAR_START_PERIODS).filter(|far| *far < last), further).chain([last]);
        let starts = [NEAR_START_PERIODS].into_iter().chain(far.flat_map(|far| [-far, far]));
        starts.map(|periods| inside(&self.seat.parameters, &[periods * self.step_s])).collect()
    }

    fn lag_s(&self, values: &[f64]) -> f64 {
        values[0]
    }

    /// A gas that comes to one sensor later than to the other does so by a part of what the sensors resolve, and a scan by a
    /// part of a sample period.
    fn usual_size(&self) -> Option<f64> {
        Some((USUAL_SHARE * self.faster_s).max(USUAL_PERIODS * self.step_s))
    }

    fn install(&self, values: &[Number], plant: &mut Plant) {
        plant.delay_s = Some(values[0]);
    }
}

//! Sensors that stand apart along a flow, or along their own motion: the second one sees the gas `L/v` later, where the flow `v` is
//! measured. Of sensors that move back and forth the sign of `v` changes, and which of them comes first.

use std::sync::Arc;

use twinlag_optimise::Variable;

use crate::chain::UNEVEN_REACH;
use crate::effect::flow_reference;
use crate::effect::parameter::inside;
use crate::effect::{About, Context, Derived, Effect, Identifier, KnownEffect, Parameter, Seat, Shared, described_by};
use crate::error::ModelError;
use crate::flow::{Flow, FlowKind};
use crate::number::Number;
use crate::plant::{Plant, Separation};

pub(crate) static ABOUT: About = About::new("separation", 15, candidates)
    .in_words(
        "the sensors stand apart along the flow, or along their own motion, so that one comes to a place later than the other: by \
         their distance over the velocity",
        "mount the junctions side by side across the flow",
        "a distance across the flow",
    )
    .imitating(&["delay", "second-order", "varying-time-constant"])
    .turning_phases()
    .restored_by(restore);

/// Usual delay at the mean flow, in sample periods. Chosen, as of a delay.
const USUAL_PERIODS: f64 = 0.5;
/// Largest difference between the delays along a record, in sample periods: each residual then depends on as many samples more, which
/// is what it takes to whiten them. Chosen.
const MAX_VARIATION_PERIODS: f64 = 16.0;
/// Delays from which a fit starts, in sample periods.
const STARTS_PERIODS: [f64; 4] = [0.3, -0.3, 1.5, -1.5];

struct Apart {
    seat: Seat,
    flow: Arc<Flow>,
    step_s: f64,
}

fn candidates(context: &Context) -> Vec<Shared> {
    context.changing_flow().map(|flow| along(flow, context)).collect()
}

/// Sensors that stand apart along `flow`.
fn along(flow: &Arc<Flow>, context: &Context) -> Shared {
    let longest = if context.is_even { (context.reach - 1) as f64 } else { UNEVEN_REACH as f64 - 0.5 } * context.step_s;
    // At the slowest flow no longer than the model reaches.
    let [least, largest] = flow.inverse_ratios();
    let most_varied_s = MAX_VARIATION_PERIODS * context.step_s / (largest - least);
    let longest_s = (longest / least.abs().max(largest.abs())).min(most_varied_s);
    let variable = Variable::linear("delay", USUAL_PERIODS * context.step_s, -longest_s, longest_s);
    let delay = Parameter::new("delay_at_mean_flow", "s", variable);
    let seat = Seat::new(Identifier::SEPARATION, Some(1), vec![delay]);
    Arc::new(Apart { seat, flow: flow.clone(), step_s: context.step_s })
}

fn restore(known: &KnownEffect, context: &Context) -> Result<Option<Shared>, ModelError> {
    Ok(described_by(known, vec![along(&flow_reference::restored(known, context)?, context)]))
}

impl Effect for Apart {
    fn seat(&self) -> &Seat {
        &self.seat
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        STARTS_PERIODS.map(|steps| inside(&self.seat.parameters, &[steps * self.step_s])).to_vec()
    }

    fn install(&self, values: &[Number], plant: &mut Plant) {
        plant.separation = Some(Separation { delay_s: values[0], flow: self.flow.clone() });
    }

    fn derived(&self) -> Vec<Derived> {
        let reference = self.flow.reference();
        let distance = Derived { name: "distance", unit: "m", of: Box::new(move |values| values[0] * reference) };
        let is_motion = self.flow.kind() == FlowKind::Motion;
        std::iter::once(flow_reference::derived(&self.flow)).chain(is_motion.then_some(distance)).collect()
    }
}

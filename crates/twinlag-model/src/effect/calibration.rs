//! Relative calibration: `y₂ = g T + o` in units of channel 1, and a static curvature of either channel beside the straight line, with
//! as many of the three as the data support.

use std::sync::Arc;

use num_dual::DualNum;
use twinlag_optimise::Variable;

use crate::effect::KnownEffect;
use crate::effect::{
    About, Context, Derived, Domain, Effect, Freedom, Identifier, Parameter, Seat, Shared, Twin, described_by,
};
use crate::error::ModelError;
use crate::number::{Curve, Number};
use crate::plant::Plant;

pub(crate) static ABOUT: About = About::new("calibration", 4, candidates)
    .in_words(
        "the two channels disagree when everything is at rest: gain, offset or curvature of one relative to \
         the other",
        "calibrate both sensors against each other at two or three steady temperatures; check reference \
         junctions and \
             types of thermocouple wire",
        "gain and offset that both channels share",
    )
    .imitating(&["radiation", "drift"])
    .at_rest()
    .leaving_lags()
    .biasing_gas_if_shared()
    .relative()
    .streamable()
    .restored_by(restore);

/// Which of gain, offset and curvature are fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Offset,
    Gain,
    Both,
    /// All three, the curvature in this channel.
    Curved(usize),
}

/// Names of the curvature, by the channel that has it. At rest only their difference shows; which channel is curved shows while the gas
/// changes, since a reading is bent after its lag.
const CURVATURES: [&str; 2] = ["curvature_of_first", "curvature"];

struct Calibration {
    kind: Kind,
    seat: Seat,
    context: Context,
}

fn candidates(context: &Context) -> Vec<Shared> {
    let kinds = [Kind::Offset, Kind::Gain, Kind::Both, Kind::Curved(1), Kind::Curved(0)];
    kinds.into_iter().map(|kind| of_kind(kind, context)).collect()
}

/// Gain and offset of the second channel relative to the first.
pub(crate) fn gain_and_offset(context: &Context) -> Shared {
    of_kind(Kind::Both, context)
}

fn of_kind(kind: Kind, context: &Context) -> Shared {
    let [m1, m2] = context.mean_c;
    let widest = 10.0 * context.swing_k + (m1 - m2).abs() + m1.abs().max(m2.abs());
    // Solvers take steps of a few of these: an offset at 0 °C goes far where the gain changes a little.
    let typical_k = context.typical_k(1);
    let offset = Parameter::new("offset", "K", Variable::linear("offset", typical_k, -widest, widest))
        .determining(Freedom::Offset);
    let gain = Parameter::new("gain", "1", Variable::linear("gain", 0.03, 0.2, 5.0))
        .within(Domain::NotZero)
        .determining(Freedom::Gain);
    let bend = 0.3 / (4.0 * context.swing_k);
    let curvature = |name| Parameter::new(name, "1/K", Variable::linear(name, 1e-2 * bend, -bend, bend));
    let parameters = match kind {
        Kind::Offset => vec![offset],
        Kind::Gain => vec![gain],
        Kind::Both => vec![gain, offset],
        Kind::Curved(channel) => vec![gain, offset, curvature(CURVATURES[channel])],
    };
    let seat = Seat::new(Identifier::CALIBRATION, Some(1), parameters);
    Arc::new(Calibration { kind, seat, context: context.clone() })
}

#[expect(clippy::unnecessary_wraps, reason = "other effects may need what a record has not")]
fn restore(known: &KnownEffect, context: &Context) -> Result<Option<Shared>, ModelError> {
    // A curvature is meant about the temperatures of the record that it was found in.
    let names = ["curvature_about", "curvature_variance", "curvature_skew"];
    let moments = [0, 1, 2].map(|i| known.parameter(names[i]).unwrap_or(context.moments[i]));
    Ok(described_by(known, candidates(&Context { moments, ..context.clone() })))
}

impl Effect for Calibration {
    fn seat(&self) -> &Seat {
        &self.seat
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        let [m1, m2] = self.context.mean_c;
        let ratio = if m1.abs() > 1e-9 { (m2 / m1).clamp(0.5, 2.0) } else { 1.0 };
        match self.kind {
            Kind::Offset => vec![vec![m2 - m1]],
            Kind::Gain => vec![vec![ratio]],
            Kind::Both => vec![vec![1.0, m2 - m1]],
            Kind::Curved(_) => vec![vec![1.0, m2 - m1, 0.0]],
        }
    }

    fn extended(&self, values: &[f64]) -> Option<(Shared, Vec<f64>)> {
        let (kind, start) = match self.kind {
            Kind::Offset => (Kind::Both, vec![1.0, values[0]]),
            Kind::Gain => (Kind::Both, vec![values[0], 0.0]),
            Kind::Both => (Kind::Curved(1), vec![values[0], values[1], 0.0]),
            Kind::Curved(_) => return None,
        };
        Some((of_kind(kind, &self.context), start))
    }

    fn reduced(&self, values: &[f64]) -> Vec<(Shared, Vec<f64>)> {
        let fewer: &[(Kind, &[f64])] = match self.kind {
            Kind::Offset | Kind::Gain => &[],
            Kind::Both => &[(Kind::Gain, &values[..1]), (Kind::Offset, &values[1..])],
            Kind::Curved(_) => &[(Kind::Both, &values[..2])],
        };
        fewer.iter().map(|(kind, start)| (of_kind(*kind, &self.context), start.to_vec())).collect()
    }

    /// An instrument has a gain and an offset. A curvature is an effect beside them.
    fn whole(&self, values: &[f64]) -> Option<(Shared, Vec<f64>)> {
        if matches!(self.kind, Kind::Gain | Kind::Offset) { self.extended(values) } else { None }
    }

    fn twins(&self, values: &[f64], tau_s: [f64; 2]) -> Vec<Twin> {
        match self.kind {
            Kind::Gain | Kind::Both => (0..2).map(|channel| Twin::crosstalk(channel, values[0], tau_s)).collect(),
            Kind::Offset | Kind::Curved(_) => Vec::new(),
        }
    }

    fn install(&self, values: &[Number], plant: &mut Plant) {
        let reading = &mut plant.sensors[1].reading;
        match self.kind {
            Kind::Offset => reading.offset_k += values[0],
            Kind::Gain => reading.gain = values[0],
            Kind::Both | Kind::Curved(_) => {
                reading.gain = values[0];
                reading.offset_k += values[1];
            }
        }
        if let Kind::Curved(channel) = self.kind {
            plant.sensors[channel].reading.straighten = Some(straighten(values[2], self.context.moments));
        }
    }

    fn yields_to_other_forms(&self) -> bool {
        self.kind == Kind::Curved(0)
    }

    fn has_functions_in(&self) -> [bool; 2] {
        [0, 1].map(|channel| self.kind == Kind::Curved(channel))
    }

    fn derived(&self) -> Vec<Derived> {
        let [mean_c, variance_k2, skew_k] = self.context.moments;
        match self.kind {
            Kind::Curved(_) => vec![
                Derived::constant("curvature_about", "°C", mean_c),
                Derived::constant("curvature_variance", "K²", variance_k2),
                Derived::constant("curvature_skew", "K", skew_k),
            ],
            _ => Vec::new(),
        }
    }
}

/// Least square of the slope of the characteristic: flatter than a fifth, a reading has no temperature any more.
const MIN_SQUARED_SLOPE: f64 = 0.04;

/// The temperature that a characteristic `T + κ ((T − m)² − v − c (T − m))` reads as `r`.
///
/// With mean `m`, variance `v` and third moment over variance `c` of the record's temperatures, gain and offset stay
/// those of the straight line through the record whatever the curvature `κ`, 1/K, is.
fn straighten(per_k: Number, [mean_c, variance_k2, skew_k]: [f64; 3]) -> Curve {
    Arc::new(move |reading_c| {
        // (1 − κ c) d + κ d² = r − m + κ v, d = T − m: the root near the reading.
        let linear = -per_k * skew_k + 1.0;
        let from = reading_c - mean_c + per_k * variance_k2;
        let square = linear * linear + per_k * from * 4.0;
        let root = if square.re < MIN_SQUARED_SLOPE { Number::from(MIN_SQUARED_SLOPE) } else { square }.sqrt();
        (from * 2.0 / (linear + root) + mean_c, root.recip())
    })
}

//! Relative calibration: `y₂ = g T + o` in units of channel 1, and a static curvature beside the straight line, with as many of the
//! three as the data support.

use crate::effect::{About, Context, Derived, Effect, Identifier, Parameter, Shared};
use crate::plant::{Curvature, Plant};
use std::sync::Arc;
use twinlag_optimise::Variable;

pub const ABOUT: About = About {
    name: "calibration",
    explanation: "the two channels do not agree when everything is at rest: gain, offset or curvature of one against the other",
    advice: "calibrate both sensors against each other at two or three steady temperatures; check reference junctions and \
             types of thermocouple wire",
    confusable: &[Identifier::Radiation, Identifier::Drift],
    unseen: "gain and offset that both channels share",
};

/// Which of them are fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Offset,
    Gain,
    Both,
    Curved,
}

struct Calibration {
    kind: Kind,
    parameters: Vec<Parameter>,
    context: Context,
}

pub fn candidates(context: &Context) -> Vec<Shared> {
    [Kind::Offset, Kind::Gain, Kind::Both, Kind::Curved].into_iter().map(|kind| of_kind(kind, context)).collect()
}

fn of_kind(kind: Kind, context: &Context) -> Shared {
    let [m1, m2] = context.mean_c;
    let widest = 10.0 * context.swing_k + (m1 - m2).abs() + m1.abs().max(m2.abs());
    // Solvers take steps of a few of these: an offset at 0 °C goes far where the gain changes a little.
    let typical_k = context.typical_k(1);
    let offset = Parameter::new("offset", "K", Variable::linear("offset", typical_k, -widest, widest));
    let gain = Parameter::new("gain", "1", Variable::linear("gain", 0.03, 0.2, 5.0));
    let bend = 0.3 / (4.0 * context.swing_k);
    let curvature = Parameter::new("curvature", "1/K", Variable::linear("curvature", 1e-2 * bend, -bend, bend));
    let parameters = match kind {
        Kind::Offset => vec![offset],
        Kind::Gain => vec![gain],
        Kind::Both => vec![gain, offset],
        Kind::Curved => vec![gain, offset, curvature],
    };
    Arc::new(Calibration { kind, parameters, context: context.clone() })
}

impl Effect for Calibration {
    fn identifier(&self) -> Identifier {
        Identifier::Calibration
    }

    fn channel(&self) -> Option<usize> {
        Some(1)
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        let [m1, m2] = self.context.mean_c;
        let ratio = if m1.abs() > 1e-9 { (m2 / m1).clamp(0.5, 2.0) } else { 1.0 };
        match self.kind {
            Kind::Offset => vec![vec![m2 - m1]],
            Kind::Gain => vec![vec![ratio]],
            Kind::Both => vec![vec![1.0, m2 - m1]],
            Kind::Curved => vec![vec![1.0, m2 - m1, 0.0]],
        }
    }

    fn grown(&self, values: &[f64]) -> Option<(Shared, Vec<f64>)> {
        let (kind, start) = match self.kind {
            Kind::Offset => (Kind::Both, vec![1.0, values[0]]),
            Kind::Gain => (Kind::Both, vec![values[0], 0.0]),
            Kind::Both => (Kind::Curved, vec![values[0], values[1], 0.0]),
            Kind::Curved => return None,
        };
        Some((of_kind(kind, &self.context), start))
    }

    fn install(&self, values: &[f64], plant: &mut Plant) {
        let reading = &mut plant.sensors[1].reading;
        match self.kind {
            Kind::Offset => reading.offset_k += values[0],
            Kind::Gain => reading.gain = values[0],
            Kind::Both | Kind::Curved => {
                reading.gain = values[0];
                reading.offset_k += values[1];
            }
        }
        if self.kind == Kind::Curved {
            reading.curvature = Some(Curvature { per_k: values[2], moments: self.context.moments });
        }
    }

    fn derived(&self) -> Vec<Derived> {
        let [mean_c, variance_k2, skew_k] = self.context.moments;
        let about = |name, unit, value| Derived { name, unit, of: Box::new(move |_| value) };
        match self.kind {
            Kind::Curved => vec![
                about("curvature_about", "°C", mean_c),
                about("curvature_variance", "K²", variance_k2),
                about("curvature_skew", "K", skew_k),
            ],
            _ => Vec::new(),
        }
    }

    fn neutral(&self) -> Vec<(usize, f64)> {
        match self.kind {
            Kind::Offset => vec![(0, 0.0)],
            Kind::Gain => vec![(0, 1.0)],
            Kind::Both | Kind::Curved => vec![(0, 1.0), (1, 0.0)],
        }
    }
}

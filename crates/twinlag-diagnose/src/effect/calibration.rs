//! Relative calibration: `y₂ = g T + o` in units of channel 1, and a static curvature beside the straight line, with as many of the
//! three as the data support.

use crate::effect::{About, Context, Effect, Identifier, Parameter, Shared};
use crate::plant::{Curvature, Plant};
use std::sync::Arc;
use twinlag_optimise::Variable;

pub(crate) const ABOUT: About = About {
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
    moments: [f64; 3],
    offset_k: f64,
    ratio: f64,
}

pub(crate) fn candidates(context: &Context) -> Vec<Shared> {
    let [m1, m2] = context.mean_c;
    [Kind::Offset, Kind::Gain, Kind::Both, Kind::Curved]
        .into_iter()
        .map(|kind| {
            let widest = 10.0 * context.swing_k + (m1 - m2).abs() + m1.abs().max(m2.abs());
            let offset = Parameter::new(
                "offset",
                "K",
                Variable::linear("offset", context.noise_std_k[1].max(1e-9), -widest, widest),
            );
            let gain = Parameter::new("gain", "1", Variable::linear("gain", 0.01, 0.2, 5.0));
            let bend = 0.3 / (4.0 * context.swing_k);
            let curvature = Parameter::new("curvature", "1/K", Variable::linear("curvature", 1e-3 * bend, -bend, bend));
            let parameters = match kind {
                Kind::Offset => vec![offset],
                Kind::Gain => vec![gain],
                Kind::Both => vec![gain, offset],
                Kind::Curved => vec![gain, offset, curvature],
            };
            let ratio = if m1.abs() > 1e-9 { (m2 / m1).clamp(0.5, 2.0) } else { 1.0 };
            Arc::new(Calibration { kind, parameters, moments: context.moments, offset_k: m2 - m1, ratio }) as Shared
        })
        .collect()
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
        match self.kind {
            Kind::Offset => vec![vec![self.offset_k]],
            Kind::Gain => vec![vec![self.ratio]],
            Kind::Both => vec![vec![1.0, self.offset_k]],
            Kind::Curved => vec![vec![1.0, self.offset_k, 0.0]],
        }
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
            reading.curvature = Some(Curvature { per_k: values[2], moments: self.moments });
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

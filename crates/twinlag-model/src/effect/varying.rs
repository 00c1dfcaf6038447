//! Time constants that change along the record by the same share: `τᵢ(t) = τᵢ (1 + m(t))`, as they do when the flow changes. `m`
//! is a cubic spline with mean zero, so `τᵢ` is the mean over the record; or, where the flow was measured, `1 + m = (v/v_mean)^p`
//! with the geometric mean of its velocity or density, at which `τᵢ` is then what is found.

use crate::effect::{About, Context, Effect, Identifier, Parameter, Shared};
use crate::flow::Flow;
use crate::plant::{Modulation, Plant};
use crate::spline::Spline;
use std::sync::Arc;
use twinlag_optimise::Variable;

pub const ABOUT: About = About {
    name: "varying-time-constant",
    explanation: "both time constants change along the record by the same share, as they do when the flow changes",
    advice: "log the flow velocity, or take records at steady flow",
    confusable: &[Identifier::TemperatureDependentTimeConstant],
    unseen: "which of the two a change of their ratio belongs to",
};

/// Coefficients that it is looked for with.
const FIRST: usize = 12;
/// Those of a change of the ratio.
pub const RATIO: usize = 4;
/// Those that are tried once it is found.
const SIZES: [usize; 4] = [3, 5, 8, 19];

/// What `m` is a function of.
enum Of {
    /// Time: a spline between the ends of the record, s, which has so many samples.
    Time {
        ends_s: [f64; 2],
        samples: usize,
        /// Strength of the white noise that its curvature is beforehand, by which it is smooth; `None` for one that need not be.
        curvature: Option<f64>,
    },
    /// A measured flow.
    Flow(Arc<Flow>),
    /// Nothing before an instant, s, and one number from then on.
    Step { at_s: f64 },
    /// Time, and it is the ratio `τ₂/τ₁` that changes so.
    Ratio { ends_s: [f64; 2] },
}

struct Varying {
    of: Of,
    parameters: Vec<Parameter>,
}

pub fn of_size(size: usize, ends_s: [f64; 2], samples: usize) -> Option<Shared> {
    of_time(size, ends_s, samples, None)
}

/// A spline of `size` coefficients whose second derivative by the record's share is white noise of the strength `curvature`
/// beforehand, that is, `∫ m''² du / curvature²` is added to the energy. For [`crate::track()`].
pub fn smooth(size: usize, ends_s: [f64; 2], samples: usize, curvature: f64) -> Option<Shared> {
    of_time(size, ends_s, samples, Some(curvature))
}

fn of_time(size: usize, ends_s: [f64; 2], samples: usize, curvature: Option<f64>) -> Option<Shared> {
    const NAMES: [&str; 32] = [
        "m1", "m2", "m3", "m4", "m5", "m6", "m7", "m8", "m9", "m10", "m11", "m12", "m13", "m14", "m15", "m16", "m17",
        "m18", "m19", "m20", "m21", "m22", "m23", "m24", "m25", "m26", "m27", "m28", "m29", "m30", "m31", "m32",
    ];
    let parameters =
        NAMES[..size].iter().map(|name| Parameter::new(name, "1", Variable::linear(*name, 0.05, -0.9, 3.0))).collect();
    (60 * size <= samples)
        .then(|| Arc::new(Varying { of: Of::Time { ends_s, samples, curvature }, parameters }) as Shared)
}

/// A step at an instant, for [`crate::track()`]: the search knows smooth changes alone.
pub fn step(at_s: f64) -> Shared {
    let parameters = vec![Parameter::new("change", "1", Variable::linear("change", 0.05, -0.9, 9.0))];
    Arc::new(Varying { of: Of::Step { at_s }, parameters })
}

/// A smooth change of the ratio of both time constants, of [`RATIO`] coefficients, for its test.
pub fn ratio(ends_s: [f64; 2]) -> Shared {
    let names: [&str; RATIO] = ["ratio1", "ratio2", "ratio3", "ratio4"];
    let parameters = names.map(|name| Parameter::new(name, "1", Variable::linear(name, 0.05, -0.9, 3.0)));
    Arc::new(Varying { of: Of::Ratio { ends_s }, parameters: parameters.to_vec() })
}

pub fn candidates(context: &Context) -> Vec<Shared> {
    let of_flow = context.flow.as_ref().map(|flow| {
        let parameters = vec![Parameter::new("exponent", "1", Variable::linear("exponent", 0.1, -3.0, 3.0))];
        Arc::new(Varying { of: Of::Flow(flow.clone()), parameters }) as Shared
    });
    of_size(FIRST, context.ends_s, context.samples).into_iter().chain(of_flow).collect()
}

impl Effect for Varying {
    fn identifier(&self) -> Identifier {
        Identifier::VaryingTimeConstant
    }

    fn channel(&self) -> Option<usize> {
        matches!(self.of, Of::Ratio { .. }).then_some(1)
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        vec![vec![0.0; self.parameters.len()]]
    }

    fn install(&self, values: &[f64], plant: &mut Plant) {
        match &self.of {
            Of::Time { ends_s: [first_s, last_s], .. } => {
                plant.modulation = Some(Modulation::Spline(Spline::new(*first_s, *last_s, values)));
            }
            Of::Flow(of) => plant.modulation = Some(Modulation::Flow { exponent: values[0], of: of.clone() }),
            Of::Step { at_s } => plant.modulation = Some(Modulation::Step { at_s: *at_s, change: values[0] }),
            Of::Ratio { ends_s: [first_s, last_s] } => plant.ratio = Some(Spline::new(*first_s, *last_s, values)),
        }
    }

    fn is_of_the_record(&self) -> bool {
        !matches!(self.of, Of::Flow(_))
    }

    fn sizes(&self) -> Vec<Shared> {
        match self.of {
            Of::Time { ends_s, samples, .. } => {
                SIZES.into_iter().filter_map(|size| of_size(size, ends_s, samples)).collect()
            }
            Of::Flow(_) | Of::Step { .. } | Of::Ratio { .. } => Vec::new(),
        }
    }

    fn prior(&self, values: &[f64]) -> Vec<f64> {
        let Of::Time { curvature: Some(curvature), .. } = self.of else { return Vec::new() };
        let on_knots = crate::spline::on_knots(values);
        // Second differences over squares of the distance of knots, each for one such distance.
        let scale = (values.len() as f64).powf(1.5) / curvature;
        on_knots.windows(3).map(|c| scale * (c[0] - 2.0 * c[1] + c[2])).collect()
    }

    fn neutral(&self) -> Vec<(usize, f64)> {
        match self.of {
            Of::Time { .. } | Of::Ratio { .. } => Vec::new(),
            Of::Flow(_) | Of::Step { .. } => vec![(0, 0.0)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of `m = u²`, but for a constant, the second derivative is 2 everywhere: `4 (size − 1)/size` over the inner knots, to rounding.
    #[test]
    fn what_is_known_of_a_curve_is_its_curvature() {
        let (size, curvature) = (10_usize, 3.0);
        let squares: Vec<f64> = (0..=size).map(|k| (k as f64 / size as f64).powi(2)).collect();
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        let values: Vec<f64> = squares[1..].iter().map(|v| v - mean).collect();
        let effect = smooth(size, [0.0, 5.0], 2500, curvature).expect("enough samples");
        let got: f64 = effect.prior(&values).iter().map(|p| p * p).sum();
        let want = 4.0 * (size - 1) as f64 / size as f64 / (curvature * curvature);
        assert!((got - want).abs() < 1e-10, "got {got}, want {want}");
    }
}

//! Time constants that change along the record by the same share: `τᵢ(t) = τᵢ (1 + m(t))`, as they do when the flow changes. `m`
//! is a cubic spline with mean zero, so `τᵢ` is the mean over the record; or, where the flow was measured, `1 + m = (v/v_ref)^p`.
//! `v_ref` is the geometric mean of its velocity or density over the records in which the effect was found, and `τᵢ` holds at that flow.

use std::sync::Arc;

use num_dual::DualNum;
use twinlag_optimise::Variable;

use crate::directions::{Part, Parts};
use crate::effect::KnownEffect;
use crate::effect::flow_reference;
use crate::effect::{About, Context, Derived, Effect, Identifier, Parameter, Seat, Shared, described_by};
use crate::error::ModelError;
use crate::flow::Flow;
use crate::number::Number;
use crate::plant::{Plant, TimeConstantChange};
use crate::spline::{LocalSpline, Spline, on_knots, parts};

pub(crate) static ABOUT: About = About::new("varying-time-constant", 9, candidates)
    .in_words(
        "time constants change along the record, as they do when the flow changes (with a measured flow from record to record as \
         well): both by the same factor, or with a measured flow that of one sensor alone",
        "log the flow velocity, or take records at steady flow",
        "which sensor causes a change of their ratio",
    )
    .imitating(&["temperature-dependent-time-constant"])
    .changing_time_constants()
    .restored_by(restore);

/// Coefficients that a change is looked for with: enough for six swings along the record.
const FIRST_SIZE: usize = 12;
/// Numbers of coefficients that are tried once it is found.
const OTHER_SIZES: [usize; 4] = [3, 5, 8, 19];
/// Coefficients of a change of the ratio.
pub(crate) const RATIO_SIZE: usize = 4;
/// Samples for each coefficient of a spline.
pub(crate) const SAMPLES_PER_COEFFICIENT: usize = 60;
/// Most coefficients of a spline.
pub(crate) const MAX_COEFFICIENTS: usize = NAMES.len();
const NAMES: [&str; 32] = [
    "m1", "m2", "m3", "m4", "m5", "m6", "m7", "m8", "m9", "m10", "m11", "m12", "m13", "m14", "m15", "m16", "m17",
    "m18", "m19", "m20", "m21", "m22", "m23", "m24", "m25", "m26", "m27", "m28", "m29", "m30", "m31", "m32",
];
const RATIO_NAMES: [&str; RATIO_SIZE] = ["ratio1", "ratio2", "ratio3", "ratio4"];

/// Size of a change that matters, twice which is the longest step of a fit: a half, as doubling the flow makes it. With a
/// tenth of that a fit ended after its forty iterations, short of the minimum.
const TYPICAL_CHANGE: f64 = 0.5;

/// Exponents of a flow that are possible.
const EXPONENTS: [f64; 2] = [-3.0, 3.0];

/// What `m` is a function of.
enum Of {
    /// Time: a spline between the ends of the record, s, which has so many samples.
    Time {
        ends_s: [f64; 2],
        samples: usize,
        /// Strength of the white noise that its curvature is beforehand, by which it is smooth; `None` for one that
        /// need not be.
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
    seat: Seat,
}

impl Varying {
    fn shared(of: Of, names: &[&'static str], largest: f64) -> Shared {
        let channel = matches!(of, Of::Ratio { .. }).then_some(1);
        let share =
            |name: &&'static str| Parameter::new(name, "1", Variable::linear(*name, TYPICAL_CHANGE, -0.9, largest));
        let seat = Seat::new(Identifier::VARYING_TIME_CONSTANT, channel, names.iter().map(share).collect());
        Arc::new(Self { of, seat })
    }
}

/// A smooth change of `size` coefficients; none where the record is too short for them.
pub(crate) fn of_size(size: usize, ends_s: [f64; 2], samples: usize) -> Option<Shared> {
    of_time(size, ends_s, samples, None)
}

/// A spline of `size` coefficients whose second derivative by the record's share is white noise of the strength
/// `curvature` beforehand: `∫ m''² du / curvature²` is added to the energy. For [`crate::track()`].
pub(crate) fn smooth(size: usize, ends_s: [f64; 2], samples: usize, curvature: f64) -> Option<Shared> {
    of_time(size, ends_s, samples, Some(curvature))
}

fn of_time(size: usize, ends_s: [f64; 2], samples: usize, curvature: Option<f64>) -> Option<Shared> {
    (SAMPLES_PER_COEFFICIENT * size <= samples)
        .then(|| Varying::shared(Of::Time { ends_s, samples, curvature }, &NAMES[..size], 3.0))
}

/// A step at an instant, for [`crate::track()`]: the search knows smooth changes alone.
pub(crate) fn step(at_s: f64) -> Shared {
    Varying::shared(Of::Step { at_s }, &["change"], 9.0)
}

/// A smooth change of the ratio of both time constants, for its test.
pub(crate) fn ratio(ends_s: [f64; 2]) -> Shared {
    Varying::shared(Of::Ratio { ends_s }, &RATIO_NAMES, 3.0)
}

fn candidates(context: &Context) -> Vec<Shared> {
    let of_flow = context.changing_flow().flat_map(with_flow);
    of_size(FIRST_SIZE, context.ends_s, context.samples).into_iter().chain(of_flow).collect()
}

/// Time constants that are proportional to a power of `flow`: of both sensors, or of one alone where the other is behind a pump or inside a
/// housing.
fn with_flow(flow: &Arc<Flow>) -> [Shared; 3] {
    [None, Some(0), Some(1)].map(|channel| {
        let [lowest, highest] = EXPONENTS;
        let exponent = Parameter::new("exponent", "1", Variable::linear("exponent", 0.1, lowest, highest));
        let seat = Seat::new(Identifier::VARYING_TIME_CONSTANT, channel, vec![exponent]);
        Arc::new(Varying { of: Of::Flow(flow.clone()), seat }) as Shared
    })
}

fn restore(known: &KnownEffect, context: &Context) -> Result<Option<Shared>, ModelError> {
    if known.parameter("exponent").is_none() {
        return Ok(described_by(known, candidates(context)));
    }
    Ok(described_by(known, with_flow(&flow_reference::restored(known, context)?).into()))
}

fn along(spline: Spline) -> TimeConstantChange {
    TimeConstantChange::of_time(Arc::new(move |time_s| spline.at(time_s)))
}

/// A relative change of both time constants, or of that of one sensor.
fn install(change: &TimeConstantChange, channel: Option<usize>, plant: &mut Plant) {
    let sensors = plant.sensors.iter_mut().enumerate().filter(|(i, _)| channel.is_none_or(|channel| channel == *i));
    sensors.for_each(|(_, sensor)| sensor.changes.push(change.clone()));
}

impl Effect for Varying {
    fn seat(&self) -> &Seat {
        &self.seat
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        vec![vec![0.0; self.seat.parameters.len()]]
    }

    fn install(&self, values: &[Number], plant: &mut Plant) {
        let change = match &self.of {
            Of::Time { ends_s: [first_s, last_s], .. } | Of::Ratio { ends_s: [first_s, last_s] } => {
                along(Spline::new(*first_s, *last_s, values))
            }
            Of::Flow(flow) => {
                let exponent = values[0];
                TimeConstantChange::of_flow(flow.clone(), move |log_ratio| (exponent * log_ratio).exp_m1())
            }
            Of::Step { at_s } => {
                let (change, at_s) = (values[0], *at_s);
                TimeConstantChange::of_time(Arc::new(
                    move |time_s| if time_s < at_s { Number::from(0.0) } else { change },
                ))
            }
        };
        install(&change, self.seat.channel, plant);
    }

    fn parts(&self, values: &[f64]) -> Option<Parts> {
        let (Of::Time { ends_s, .. } | Of::Ratio { ends_s }) = self.of else { return None };
        let (splines, of_parameters) = parts(ends_s[0], ends_s[1], values);
        let channel = self.seat.channel;
        let part = |(spline, support_s): LocalSpline| {
            let change = along(spline);
            Part::new(support_s, Arc::new(move |plant| install(&change, channel, plant)))
        };
        Some(Parts::new(splines.into_iter().map(part).collect(), of_parameters))
    }

    fn derived(&self) -> Vec<Derived> {
        if let Of::Flow(flow) = &self.of { vec![flow_reference::derived(flow)] } else { Vec::new() }
    }

    fn main(&self) -> Option<usize> {
        (self.seat.parameters.len() == 1).then_some(0)
    }

    fn is_of_the_record(&self) -> bool {
        !matches!(self.of, Of::Flow(_))
    }

    fn sizes(&self) -> Vec<Shared> {
        let Of::Time { ends_s, samples, .. } = self.of else { return Vec::new() };
        OTHER_SIZES.into_iter().filter_map(|size| of_size(size, ends_s, samples)).collect()
    }

    fn prior(&self, values: &[Number]) -> Vec<Number> {
        let Of::Time { curvature: Some(curvature), .. } = self.of else { return Vec::new() };
        // Second differences over squares of the distance of knots, each for one such distance.
        let scale = (values.len() as f64).powf(1.5) / curvature;
        on_knots(values).windows(3).map(|c| (c[0] - c[1] * 2.0 + c[2]) * scale).collect()
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
        let values: Vec<Number> = squares[1..].iter().map(|v| Number::from(v - mean)).collect();
        let effect = smooth(size, [0.0, 5.0], 2500, curvature).expect("enough samples");
        let got: f64 = effect.prior(&values).iter().map(|p| p.re * p.re).sum();
        let want = 4.0 * (size - 1) as f64 / size as f64 / (curvature * curvature);
        assert!((got - want).abs() < 1e-10, "got {got}, want {want}");
    }
}

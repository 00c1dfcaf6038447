//! The two inferred gas temperatures, each on its own, from which their noise levels can be
//! estimated.

use num_dual::DualSVec64;
use twinlag_sensor::Discretisation;

use crate::error::CostError;
use crate::inverse::{has_inverse, row};
use crate::noise_model::HoldAndNoise;
use crate::parameters::Pair;
use crate::readings::{Readings, Steps};

/// The gas temperature that each sensor implies, behind one common filter:
/// `f_i[k] = Σ_j filter_i[j] y_i[k+j]`.
///
/// At the right parameters both are the same filtered gas temperature, each with its channel's
/// noise: white noise of variance `s²` becomes `s² |Σ_j filter[j] e^(i w j)|²` at `w` radians per
/// sample. For first-order sensors and the zero-order hold they are the inferred gas temperatures
/// themselves.
#[derive(Clone, Debug, PartialEq)]
pub struct InferredInputs {
    /// Filter of each channel, oldest sample first; both have the same number of coefficients.
    pub filters: [Vec<f64>; 2],
    /// `[f1, f2]` for each unbroken stretch, kelvin about the level of the readings.
    pub segments: Vec<[Vec<f64>; 2]>,
}

/// The inferred inputs at `theta` (the first `P` of [`crate::Parameter::ALL`]) for evenly sampled
/// readings.
///
/// ```
#[doc = include_str!("example.txt")]
/// let inputs = inferred_inputs(&readings, Discretisation::ZeroOrderHold, &[0.0238, 0.1168])?;
/// let [from_first, from_second] = &inputs.segments[0];
/// for k in 0..from_first.len() {
///     // Undoing a lag multiplies rounding by twice its time constant in samples, some hundred
///     // here.
///     assert!((from_first[k] - from_second[k]).abs() < 1e-11);
///     assert!((from_first[k] + readings.level() - gas[k]).abs() < 1e-11);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`CostError::UnevenSampling`], [`CostError::NoDifferenceEquation`].
pub fn inferred_inputs<const P: usize>(
    readings: &Readings,
    hold: Discretisation,
    theta: &[f64; P],
) -> Result<InferredInputs, CostError> {
    if !has_inverse(hold) {
        return Err(CostError::NoDifferenceEquation);
    }
    let period_s = match readings.segments()[0].steps() {
        Steps::Even(period_s) => *period_s,
        Steps::Uneven(_) => return Err(CostError::UnevenSampling),
    };
    readings.even_period_s().ok_or(CostError::UnevenSampling)?;
    let pair: Pair<DualSVec64<P>> = Pair::variables(theta);
    let row = row(&HoldAndNoise::white(hold, [1.0; 2]), &pair, period_s);
    let filters = row.data.map(|c| c.as_slice().iter().map(|v| v.re).collect::<Vec<f64>>());
    let offset = pair.offset.re;
    let through = |y: &[f64], filter: &[f64], offset: f64| -> Vec<f64> {
        y.windows(filter.len()).map(|w| w.iter().zip(filter).map(|(y, c)| c * (y - offset)).sum()).collect()
    };
    let segments = readings
        .segments()
        .iter()
        .map(|s| [through(s.y1(), &filters[0], 0.0), through(s.y2(), &filters[1], offset)])
        .collect();
    Ok(InferredInputs { filters, segments })
}

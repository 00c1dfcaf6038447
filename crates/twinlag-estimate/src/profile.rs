//! The range of the difference of the time constants, for a record that does not determine both.
//!
//! One time constant is held at one value after another, away from where the fit ended, and the rest is fitted. Every value
//! for which the cost stays within the 95 % point of chi-square above its minimum is allowed; the intervals of the other
//! time constant and of the difference are the unions over all that is allowed. Where the cost owes its shape to noise rather
//! than to the signal it is not chi-square distributed, and far more is allowed.

use twinlag_cross_relation::{ScoreVariance, Whitened};
use twinlag_optimise::{Budget, Cost, End, Minimiser, Problem, Variable};

use crate::error::EstimateError;

/// 95 % point of chi-square with one degree of freedom.
const CHI2_95: f64 = 3.841_458_820_694_124;
/// 97.5 % point of the standard normal.
pub const Z_975: f64 = 1.959_963_984_540_054;
/// From one held value to the next.
const RATIO: f64 = 1.25;
/// Held values tried each way.
const MOST: i32 = 60;

/// Beyond this share of noise in the curvature along the walk, the cost is not chi-square distributed: the truth may lie there,
/// and noise alone may have made the cost lower elsewhere.
const MOSTLY_NOISE: f64 = 0.25;
/// How far above the minimum such places are allowed: the truth lies lower than this where noise has its way with a parameter
/// that the signal does not determine.
pub const FAR_ABOVE: f64 = 50.0;
/// Halvings, in logarithms, that place the edge of what is allowed.
const HALVINGS: usize = 5;
/// A time constant below this multiple of its lower bound counts as zero.
const VANISHING: f64 = 1e-3;

/// Intervals over all values of the undetermined time constant that the record allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ridge {
    /// `τ2 − τ1` where the fit ended, and its interval, s.
    pub difference: (f64, [f64; 2]),
    /// Interval of the time constant that was not held, s.
    pub other: [f64; 2],
}

impl Ridge {
    /// What one point says, `width` either way.
    fn at(x: &[f64], other: usize, width: f64) -> Self {
        let difference = x[1] - x[0];
        Self {
            difference: (difference, [difference - width, difference + width]),
            other: [(x[other] - width).max(0.0), x[other] + width],
        }
    }

    /// The union of two, where this one ended.
    pub fn with(&self, other: &Self) -> Self {
        Self {
            difference: (self.difference.0, union(self.difference.1, other.difference.1)),
            other: union(self.other, other.other),
        }
    }
}

/// Walks along time constant `index` (0 or 1) from `best`, the lowest point found for `cost` over `variables`.
pub fn ridge<const P: usize>(
    cost: &dyn Cost,
    whitened: &Whitened<'_>,
    variables: &[Variable],
    best: &[f64],
    index: usize,
    middle: ScoreVariance,
    minimiser: &dyn Minimiser,
) -> Result<Option<Ridge>, EstimateError> {
    let other = 1 - index;
    let rest: Vec<usize> = (0..P).filter(|&i| i != index && variables[i].lower < variables[i].upper).collect();
    if !rest.contains(&other) {
        return Ok(None);
    }
    let no_prior = [f64::INFINITY; P];
    let theta = |x: &[f64]| -> [f64; P] { std::array::from_fn(|i| x[i]) };
    let spread =
        |x: &[f64], middle| whitened.covariance(&theta(x), &rest, &no_prior, middle).map(|c| c[other][other].sqrt());
    let all: Vec<usize> = (0..P).filter(|i| *i == index || rest.contains(i)).collect();
    let noise_share = |x: &[f64]| whitened.noise_share(&theta(x), &all, index);
    // How much wider than white noise alone the residual makes the spread; thresholds grow by its square.
    let inflation = match (spread(best, middle), spread(best, ScoreVariance::WhiteNoise)) {
        (Some(actual), Some(assumed)) => (actual / assumed).powi(2).max(1.0),
        _ => 1.0,
    };
    let lowest = cost.value(best);
    let mut found: Option<Ridge> = None;
    if let Some(width) = spread(best, middle) {
        found = Some(Ridge::at(best, other, Z_975 * width));
    }
    let mut include = |x: &[f64], width: f64| {
        let here = Ridge::at(x, other, width);
        found = Some(found.map_or(here, |r| r.with(&here)));
    };
    // The rest fitted with the time constant held: where, how far above the minimum, and whether it is allowed.
    let fit_at = |held: f64, from: &[f64]| -> Result<Option<(Vec<f64>, f64, bool)>, EstimateError> {
        let mut variables = variables.to_vec();
        variables[index] = variables[index].clone().held_at(held);
        let mut from = from.to_vec();
        from[index] = held;
        let problem = Problem::new(cost, variables)?;
        let fit = minimiser.minimise(&problem, &from, &Budget::default())?;
        if matches!(fit.end, End::OnBound(_)) {
            return Ok(None);
        }
        let above = (fit.value - lowest) / inflation;
        let share = noise_share(&fit.x);
        let limit = if share > MOSTLY_NOISE { FAR_ABOVE } else { CHI2_95 * (1.0 + share / (1.0 - share)) };
        Ok(Some((fit.x, above, above <= limit)))
    };
    for direction in [1, -1] {
        let mut last = best.to_vec();
        for count in i32::from(direction < 0)..MOST {
            let mut held = best[index] * RATIO.powi(direction * count);
            if held > variables[index].upper {
                break;
            }
            // What is faster than the sampling can show may be any time constant down to none at all.
            let is_last = held < variables[index].lower;
            if is_last {
                held = VANISHING * variables[index].lower;
            }
            let Some((x, above, is_allowed)) = fit_at(held, &last)? else { break };
            if is_allowed {
                if let Some(width) = spread(&x, middle) {
                    include(&x, Z_975 * width);
                }
            } else {
                // The edge of what is allowed lies between the last two held values.
                let (mut inside, mut outside) = (last.clone(), held);
                for _ in 0..HALVINGS {
                    let between = (inside[index] * outside).sqrt();
                    match fit_at(between, &inside)? {
                        Some((x, _, true)) => inside = x,
                        _ => outside = between,
                    }
                }
                if let Some(width) = spread(&inside, middle) {
                    include(&inside, Z_975 * width);
                }
            }
            if above > FAR_ABOVE || is_last || !is_allowed {
                break;
            }
            last = x;
        }
    }
    Ok(found)
}

fn union(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

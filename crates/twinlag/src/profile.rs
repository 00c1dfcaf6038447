//! What a record tells when it does not tell both time constants: the range of their difference.
//!
//! One time constant is held at one value after another, away from where the fit ended, and the rest is fitted. Every value
//! for which the cost stays within the 95 % point of chi-square above its minimum is allowed; the intervals of the other
//! time constant and of the difference are the unions over all that is allowed.

use twinlag_cross_relation::{Middle, Whitened};
use twinlag_optimise::{Budget, Cost, End, Minimiser, Problem, Variable};

use crate::error::Error;
use crate::options::Options;

/// 95 % point of chi-square with one degree of freedom.
const CHI2_95: f64 = 3.841_458_820_694_124;
/// 97.5 % point of the standard normal.
pub(crate) const Z_975: f64 = 1.959_963_984_540_054;
/// From one held value to the next.
const RATIO: f64 = 1.25;
/// Held values tried each way.
const MOST: i32 = 60;

/// Intervals over all values of the undetermined time constant that the record allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ridge {
    /// `τ2 − τ1` where the fit ended, and its interval, s.
    pub(crate) difference: (f64, [f64; 2]),
    /// Interval of the time constant that was not held, s.
    pub(crate) other: [f64; 2],
}

impl Ridge {
    /// The union of two, where this one ended.
    pub(crate) fn with(&self, other: &Self) -> Self {
        Self {
            difference: (self.difference.0, union(self.difference.1, other.difference.1)),
            other: union(self.other, other.other),
        }
    }
}

/// Walks along time constant `index` (0 or 1) from `best`, the lowest point found for `cost` over `variables`.
pub(crate) fn ridge<const P: usize>(
    cost: &dyn Cost,
    whitened: &Whitened<'_>,
    variables: &[Variable],
    best: &[f64],
    index: usize,
    middle: Middle,
    options: &Options,
) -> Result<Option<Ridge>, Error> {
    let other = 1 - index;
    let rest: Vec<usize> = (0..P).filter(|&i| i != index && variables[i].lower < variables[i].upper).collect();
    if !rest.contains(&other) {
        return Ok(None);
    }
    let no_prior = [f64::INFINITY; P];
    let spread = |x: &[f64], middle| {
        let theta: [f64; P] = std::array::from_fn(|i| x[i]);
        whitened.covariance(&theta, &rest, &no_prior, middle).map(|c| c[other][other].sqrt())
    };
    // How much wider than white noise alone the residual makes the spread; the threshold grows by its square.
    let inflation = match (spread(best, middle), spread(best, Middle::WhiteNoise)) {
        (Some(actual), Some(assumed)) => (actual / assumed).powi(2).max(1.0),
        _ => 1.0,
    };
    let lowest = cost.value(best);
    let difference = |x: &[f64]| x[1] - x[0];
    let mut found: Option<Ridge> = None;
    for direction in [1, -1] {
        let mut from = best.to_vec();
        for count in i32::from(direction < 0)..MOST {
            let held = best[index] * RATIO.powi(direction * count);
            if held < variables[index].lower || held > variables[index].upper {
                break;
            }
            let mut variables = variables.to_vec();
            variables[index] = variables[index].clone().held_at(held);
            from[index] = held;
            let problem = Problem::new(cost, variables)?;
            let fit = options.optimiser.minimise(&problem, &from, &Budget::default())?;
            if fit.value - lowest > CHI2_95 * inflation || matches!(fit.end, End::OnBound(_)) {
                break;
            }
            from.clone_from(&fit.x);
            let Some(width) = spread(&fit.x, middle).map(|s| Z_975 * s) else { continue };
            let here = [difference(&fit.x) - width, difference(&fit.x) + width];
            let there = [(fit.x[other] - width).max(0.0), fit.x[other] + width];
            found = Some(match found {
                None => Ridge { difference: (difference(best), here), other: there },
                Some(r) => r.with(&Ridge { difference: (difference(&fit.x), here), other: there }),
            });
        }
    }
    Ok(found)
}

fn union(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

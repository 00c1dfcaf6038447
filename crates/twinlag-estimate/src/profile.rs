//! What a record determines when it does not determine both time constants: the range of their
//! difference.
//!
//! One time constant is held at one value after another, away from where the fit ended, and the
//! rest is fitted. Every value for which the cost stays within the 95 % point of chi-square above
//! its minimum is allowed; the intervals of the other time constant and of the difference are the
//! unions over all that is allowed. Where the cost owes its shape to noise rather than to the
//! signal it is not chi-square distributed, and far more is allowed.

use twinlag_cross_relation::{CHI2_95, ScoreVariance, Z_975};
use twinlag_optimise::{Budget, End, Problem};

use crate::error::EstimateError;
use crate::objective::{EstimatorCost, Objective};
use crate::whitened::WhitenedFit;

/// From one held time constant to the next: small enough that the rest, a start for the next,
/// follows.
const WALK_FACTOR: f64 = 1.25;
/// Held time constants tried each way: `1.25⁶⁰` is nearly six decades, more than lie between the
/// bounds of a record of 10 000 samples.
const MAX_WALK_STEPS: i32 = 60;
/// Beyond this share of noise in the curvature along the walk, the cost is not chi-square
/// distributed: the truth may lie there, and noise alone may have made the cost lower elsewhere.
const MAX_NOISE_SHARE: f64 = 0.25;
/// How far above the minimum, in units of noise, the cost may lie at the truth where noise has its
/// way with a parameter that the signal does not determine.
pub(crate) const COST_ABOVE_MINIMUM_WITHOUT_SIGNAL: f64 = 50.0;
/// Halvings, in the logarithm, that place the edge of what is allowed: to `1.25^(1/32)`, 0.7 %.
const EDGE_HALVINGS: usize = 5;
/// A time constant of this share of its lower bound, 2e-4 sample periods, counts as none: its pole
/// is `exp(−5000)`.
const SHARE_OF_BOUND_THAT_IS_NONE: f64 = 1e-3;

/// Intervals over all values of the undetermined time constant that the record allows.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Ridge {
    /// `τ2 − τ1` where the fit ended, and its interval, s.
    pub difference: (f64, [f64; 2]),
    /// Interval of the time constant that was not held, s.
    pub other: [f64; 2],
}

impl Ridge {
    /// What one point says, `width` either way, s.
    fn at(x: &[f64], other: usize, width: f64) -> Self {
        let difference = x[1] - x[0];
        Self {
            difference: (difference, [difference - width, difference + width]),
            other: [(x[other] - width).max(0.0), x[other] + width],
        }
    }

    /// The union of two, where this one ended.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        Self {
            difference: (self.difference.0, union(self.difference.1, other.difference.1)),
            other: union(self.other, other.other),
        }
    }
}

/// The rest fitted with one time constant held.
struct Held {
    x: Vec<f64>,
    /// Cost above the minimum, in units of what the residual leaves.
    above: f64,
    is_allowed: bool,
}

/// A walk along time constant `index`, away from where the fit ended.
struct Walk<'w, 'a, const P: usize> {
    from: &'w WhitenedFit<'a, P>,
    cost: &'w EstimatorCost<'a>,
    index: usize,
    other: usize,
    /// What is fitted on the way.
    rest: Vec<usize>,
    middle: ScoreVariance,
    lowest: f64,
    /// How much wider than white noise alone the residual makes the spread; thresholds grow by its
    /// square.
    inflation: f64,
}

impl<const P: usize> WhitenedFit<'_, P> {
    /// Intervals of `τ2 − τ1` and of the other time constant over all values of time constant
    /// `index` (0 or 1) that the record allows; `None` where the other one is held, or where
    /// nothing is determined.
    ///
    /// - `middle`: noise of the stated size, or the residual's own spectrum where the model leaves
    ///   more than noise
    ///
    /// # Errors
    /// [`EstimateError::Optimiser`] from the minimiser.
    /// ```
    #[doc = include_str!("../doc/readings.txt")]
    /// use twinlag_cross_relation::ScoreVariance;
    /// use twinlag_estimate::{Task, WhitenedFit};
    ///
    /// let fit = WhitenedFit::<2>::find(&Task::new(&readings))?;
    /// let ridge = fit.ridge(0, ScoreVariance::WhiteNoise)?.expect("both are fitted");
    /// let (difference_s, [low_s, high_s]) = ridge.difference;
    /// assert!(low_s < difference_s && difference_s < high_s);
    /// assert!(low_s < 0.093 && 0.093 < high_s);
    /// # Ok::<(), twinlag_estimate::EstimateError>(())
    /// ```
    pub fn ridge(&self, index: usize, middle: ScoreVariance) -> Result<Option<Ridge>, EstimateError> {
        let other = 1 - index;
        let rest: Vec<usize> = self.free().into_iter().filter(|&i| i != index).collect();
        if !rest.contains(&other) {
            return Ok(None);
        }
        let cost = EstimatorCost::Whitened(self.whitened.clone());
        let mut walk =
            Walk { from: self, cost: &cost, index, other, rest, middle, lowest: self.value(), inflation: 1.0 };
        let best = &self.fit.x;
        if let (Some(actual), Some(assumed)) = (walk.spread(best, middle), walk.spread(best, ScoreVariance::WhiteNoise))
        {
            walk.inflation = (actual / assumed).powi(2).max(1.0);
        }
        let mut found = walk.at(best);
        for direction in [1, -1] {
            walk.go(direction, &mut found)?;
        }
        Ok(found)
    }
}

impl<const P: usize> Walk<'_, '_, P> {
    /// Standard error of the other time constant at `x`, s.
    fn spread(&self, x: &[f64], middle: ScoreVariance) -> Option<f64> {
        let theta = std::array::from_fn(|i| x[i]);
        let covariance = self.from.whitened.covariance::<P>(&theta, &self.rest, &[f64::INFINITY; P], middle);
        covariance.map(|c| c[self.other][self.other].sqrt())
    }

    /// What the point `x` says.
    fn at(&self, x: &[f64]) -> Option<Ridge> {
        self.spread(x, self.middle).map(|width| Ridge::at(x, self.other, Z_975 * width))
    }

    fn include(&self, x: &[f64], found: &mut Option<Ridge>) {
        if let Some(here) = self.at(x) {
            *found = Some(found.map_or(here, |r| r.with(&here)));
        }
    }

    /// The rest fitted with the time constant held, from `from`; `None` where that ends on a bound.
    fn fit_at(&self, held_s: f64, from: &[f64]) -> Result<Option<Held>, EstimateError> {
        let mut variables = self.from.variables.clone();
        variables[self.index] = variables[self.index].clone().held_at(held_s);
        let mut from = from.to_vec();
        from[self.index] = held_s;
        let objective = Objective::<P> { cost: self.cost, priors: &self.from.priors };
        let problem = Problem::new(&objective, variables)?;
        let fit = self.from.task.minimiser.minimise(&problem, &from, &Budget::default())?;
        if matches!(fit.end, End::OnBound(_)) {
            return Ok(None);
        }
        let above = (fit.value - self.lowest) / self.inflation;
        let theta: [f64; P] = std::array::from_fn(|i| fit.x[i]);
        let all: Vec<usize> = (0..P).filter(|i| *i == self.index || self.rest.contains(i)).collect();
        let share = self.from.whitened.noise_share(&theta, &all, self.index);
        let limit = if share > MAX_NOISE_SHARE {
            COST_ABOVE_MINIMUM_WITHOUT_SIGNAL
        } else {
            CHI2_95 * (1.0 + share / (1.0 - share))
        };
        Ok(Some(Held { x: fit.x, above, is_allowed: above <= limit }))
    }

    /// Walks towards longer (1) or shorter (−1) time constants until the record allows no more of
    /// them.
    fn go(&self, direction: i32, found: &mut Option<Ridge>) -> Result<(), EstimateError> {
        let (best, variable) = (&self.from.fit.x, &self.from.variables[self.index]);
        let mut last = best.clone();
        for count in i32::from(direction < 0)..MAX_WALK_STEPS {
            let mut held_s = best[self.index] * WALK_FACTOR.powi(direction * count);
            if held_s > variable.upper {
                break;
            }
            // What is faster than the sampling can show may be any time constant down to none at
            // all.
            let is_last = held_s < variable.lower;
            if is_last {
                held_s = SHARE_OF_BOUND_THAT_IS_NONE * variable.lower;
            }
            let Some(held) = self.fit_at(held_s, &last)? else {
                // Where the other would be below its own bound, as far as their difference goes, it may be anything down to nothing.
                let other_s = last[self.other] - (last[self.index] - held_s);
                let is_below = direction < 0 && other_s < self.from.variables[self.other].lower;
                if let Some(found) = found.as_mut().filter(|_| is_below) {
                    found.other[0] = 0.0;
                }
                break;
            };
            if !held.is_allowed {
                let edge = self.edge(last, held_s)?;
                self.include(&edge, found);
                break;
            }
            self.include(&held.x, found);
            if held.above > COST_ABOVE_MINIMUM_WITHOUT_SIGNAL || is_last {
                break;
            }
            last = held.x;
        }
        Ok(())
    }

    /// Where the record stops to allow the time constant, between the point `inside` and the value
    /// `outside_s`.
    fn edge(&self, mut inside: Vec<f64>, mut outside_s: f64) -> Result<Vec<f64>, EstimateError> {
        for _ in 0..EDGE_HALVINGS {
            let between_s = (inside[self.index] * outside_s).sqrt();
            match self.fit_at(between_s, &inside)? {
                Some(Held { x, is_allowed: true, .. }) => inside = x,
                _ => outside_s = between_s,
            }
        }
        Ok(inside)
    }
}

fn union(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

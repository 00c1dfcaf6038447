//! One trait for every estimator, and the family behind it.

use twinlag_cross_relation::ScoreVariance;

use crate::error::EstimateError;
use crate::outcome::{Outcome, Solved};
use crate::task::Task;
use crate::vocabulary::Estimator;
use crate::whitened::WhitenedFit;
use crate::{assumptions, difference, published};

/// An estimator of two time constants. Implement it to bring one of your own.
pub trait Estimate: Send + Sync {
    /// The name that reports carry.
    fn name(&self) -> String;

    /// Where it comes from.
    fn source(&self) -> &'static str;

    /// What has to hold for it to be consistent.
    fn assumes(&self) -> &'static str;

    /// Both time constants of `task`.
    ///
    /// # Errors
    /// [`EstimateError`] where the question cannot be put: uneven sampling, too few samples, an order it cannot take;
    /// `CostError::Singular` inside it where a closed form has no solution. A fit that ran is never
    /// an error.
    /// ```
    #[doc = include_str!("../doc/readings.txt")]
    /// use twinlag_estimate::{Estimate, Estimator, Task};
    ///
    /// let found = Estimator::BiasCompensated.estimate(&Task::new(&readings))?;
    /// let [low_s, high_s] = found.interval_95_s.expect("a minimum")[0];
    /// assert!(low_s < 0.0238 && 0.0238 < high_s);
    /// # Ok::<(), twinlag_estimate::EstimateError>(())
    /// ```
    fn estimate(&self, task: &Task<'_>) -> Result<Outcome, EstimateError>;
}

impl Estimate for Estimator {
    fn name(&self) -> String {
        (*self).name().into()
    }

    fn source(&self) -> &'static str {
        assumptions::source(*self)
    }

    fn assumes(&self) -> &'static str {
        assumptions::assumes(*self)
    }

    fn estimate(&self, task: &Task<'_>) -> Result<Outcome, EstimateError> {
        if task.has_second_lag() != [false; 2] && task.readings.even_period_s().is_none() {
            return Err(EstimateError::Unexpected {
                what: "second-order sensors",
                expected: "evenly spaced samples".into(),
                got: "uneven ones".into(),
            });
        }
        match task.parameters() {
            6 => self.of_order::<6>(task),
            4 => self.of_order::<4>(task),
            _ => self.of_order::<2>(task),
        }
    }
}

impl Estimator {
    fn of_order<const P: usize>(self, task: &Task<'_>) -> Result<Outcome, EstimateError> {
        if self != Self::Whitened {
            return Ok(self.solve::<P>(task, None)?.outcome());
        }
        let fit = WhitenedFit::<P>::find(task)?;
        let middle = ScoreVariance::WhiteNoise;
        let solved = fit.solved(if task.intervals { fit.covariance(middle) } else { None });
        let intervals = solved.covariance.map(|c| fit.intervals(&c, false));
        Ok(solved.outcome_with(intervals))
    }

    /// Where the estimator ends on `task`, whose order is that of `P`; `beside` the whitened fit of
    /// the same task, which it makes itself where it needs one and is given none.
    ///
    /// # Errors
    /// As [`Estimate::estimate`].
    /// ```
    #[doc = include_str!("../doc/readings.txt")]
    /// use twinlag_estimate::{Estimator, Task, WhitenedFit};
    ///
    /// // Several estimators beside one whitened fit.
    /// let task = Task::new(&readings);
    /// let fit = WhitenedFit::<2>::find(&task)?;
    /// for estimator in [Estimator::Normalised, Estimator::DifferenceEquationGtls] {
    ///     let solved = estimator.solve(&task, Some(&fit))?;
    ///     assert!((solved.theta[1] / fit.theta()[1] - 1.0).abs() < 0.05);
    /// }
    /// # Ok::<(), twinlag_estimate::EstimateError>(())
    /// ```
    pub fn solve<const P: usize>(
        self,
        task: &Task<'_>,
        beside: Option<&WhitenedFit<'_, P>>,
    ) -> Result<Solved<P>, EstimateError> {
        match self {
            Self::Whitened => {
                let of = |fit: &WhitenedFit<'_, P>| fit.solved(fit.covariance(ScoreVariance::WhiteNoise));
                Ok(match beside {
                    Some(fit) => of(fit),
                    None => of(&WhitenedFit::find(task)?),
                })
            }
            Self::CrossRelation | Self::BiasCompensated | Self::Normalised | Self::Hybrid => {
                published::solve(self, task, beside)
            }
            Self::DifferenceEquationLs | Self::DifferenceEquationTls | Self::DifferenceEquationGtls => {
                difference::solve(self, task, beside)
            }
        }
    }
}

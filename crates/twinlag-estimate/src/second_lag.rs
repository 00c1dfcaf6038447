//! Second lags that were asked for and that the record does not show.
//!
//! A second lag that runs to its lower bound, or that could as well be none, is taken out of the
//! fit. What remains is how large it may be: the profile of the cost, upwards. The time constants
//! then hold for every second lag that the record allows.

use twinlag_cross_relation::{CHI2_95, ScoreVariance};
use twinlag_optimise::{Budget, End, Problem, Variable};

use crate::error::EstimateError;
use crate::objective::{EstimatorCost, Objective};
use crate::profile::COST_ABOVE_MINIMUM_WITHOUT_SIGNAL;
use crate::starts::hold_known;
use crate::task::MIN_SECOND_TAU_PERIODS;
use crate::whitened::{Ended, WhitenedFit};

/// 95 % point of chi-square with one degree of freedom, one-sided: a second lag is not negative.
const CHI2_95_ONE_SIDED: f64 = 2.705_543_454_095_404;
/// 95 % point of chi-square with two degrees of freedom, for both second lags.
const CHI2_95_OF_TWO: f64 = 5.991_464_547_107_98;
/// A second lag of this share of its lower bound, 5e-5 sample periods, counts as none: its pole is
/// `exp(−20 000)`.
const SHARE_OF_BOUND_THAT_IS_NONE: f64 = 1e-3;
/// From one second lag that is tried to the next, when its largest is looked for.
const LIMIT_STEP_FACTOR: f64 = 2.0;
/// Halvings, in the logarithm, that place the largest second lag between two that were tried: to
/// `2^(1/64)`, one per cent.
const LIMIT_HALVINGS: usize = 6;

/// The largest second lag that a record allows where it shows none.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Unseen<const P: usize> {
    /// Upper end of the one-sided 95 % interval, s; `None` where the record allows one as large as
    /// the first lag, or where [`WhitenedFit::bound_unseen_lags`] has not been asked.
    pub at_most_s: Option<f64>,
    /// Factor by which it moves each parameter from where it is without the lag.
    pub moves: [f64; P],
}

impl<const P: usize> WhitenedFit<'_, P> {
    /// Fits without the second lags that are not seen, which are held at none from here on. `true`
    /// where there were any.
    ///
    /// Both are tried together first: a lag that the sensors share drops out of how they disagree,
    /// so each of two alike looks needed as long as the other is there.
    pub(crate) fn leave_out_unseen_lags(&mut self) -> Result<bool, EstimateError> {
        let mut is_any_left_out = false;
        // With one left out the other may turn out not to be seen either.
        while P == 6 && self.leave_out_least_seen()? {
            is_any_left_out = true;
        }
        Ok(is_any_left_out)
    }

    /// Leaves out both second lags, or the one that is in more doubt; `false` where what is there
    /// is needed.
    fn leave_out_least_seen(&mut self) -> Result<bool, EstimateError> {
        let free = self.free();
        let theta = self.theta();
        let covariance = self.whitened.covariance(&theta, &free, &self.prior_std(), ScoreVariance::WhiteNoise);
        let doubt = |i: usize| match (&self.fit.end, covariance) {
            (End::OnBound(which), _) if which.contains(&i) => f64::INFINITY,
            (_, Some(c)) => c[i][i].sqrt() / theta[i],
            (_, None) => 1.0 / theta[i],
        };
        let has_prior = |i: usize| self.priors.iter().any(|p| p.index == i);
        let mut second: Vec<usize> = free.iter().copied().filter(|&i| i >= 4 && !has_prior(i)).collect();
        second.sort_by(|&a, &b| doubt(b).total_cmp(&doubt(a)));
        let alone = second.first().map(|&i| vec![i]);
        let both = (second.len() == 2).then_some(second);
        for (left_out, limit) in [(both, CHI2_95_OF_TWO), (alone, CHI2_95)] {
            let Some(left_out) = left_out else { continue };
            if self.leave_out(&left_out, limit)? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Holds the second lags `left_out` at none, where that raises the cost by no more than
    /// `limit`; `false` where it raises it by more.
    fn leave_out(&mut self, left_out: &[usize], limit: f64) -> Result<bool, EstimateError> {
        let kept = self.variables.clone();
        let mut x = self.fit.x.clone();
        for &i in left_out {
            self.variables[i] = Variable::linear(kept[i].name.clone(), 1.0, 0.0, 0.0);
            // The other lag of that sensor takes over.
            x[i - 4] += x[i];
            x[i] = 0.0;
        }
        hold_known(&mut x, &self.variables);
        let without = self.minimise_again(self.whitened.hold(), self.whitened.noise_std(), Some(&x))?;
        let raised = self.raised_by(&without, left_out, &kept);
        let covariance = self.covariance_of(&without);
        let theta: [f64; P] = std::array::from_fn(|i| without.fit.x[i]);
        let is_determined = without.fit.end.is_usable() && self.vague(&theta, covariance.as_ref()).is_empty();
        if raised > if is_determined { limit } else { COST_ABOVE_MINIMUM_WITHOUT_SIGNAL } {
            self.variables = kept;
            return Ok(false);
        }
        for &i in left_out {
            self.unseen[i - 4] = Some(Unseen { at_most_s: None, moves: [1.0; P] });
        }
        self.accept(without);
        Ok(true)
    }

    /// How far the cost rises where the fit ends `without` the lags `left_out`, in units of noise,
    /// or of the residual if that is more. Compared at next to none of them, which leaves as many
    /// terms as the fit with them has.
    fn raised_by(&self, without: &Ended<'_>, left_out: &[usize], kept: &[Variable]) -> f64 {
        let mut next_to_none = without.fit.x.clone();
        left_out.iter().for_each(|&i| next_to_none[i] = SHARE_OF_BOUND_THAT_IS_NONE * kept[i].lower);
        let cost = EstimatorCost::Whitened(self.whitened.clone());
        let value = Objective::<P> { cost: &cost, priors: &self.priors }.at(&next_to_none).value;
        (value - self.fit.value) / self.energy().max(1.0)
    }

    fn covariance_of(&self, ended: &Ended<'_>) -> Option<[[f64; P]; P]> {
        let theta = std::array::from_fn(|i| ended.fit.x[i]);
        ended.whitened.covariance(&theta, &self.free(), &self.prior_std(), ScoreVariance::WhiteNoise)
    }

    /// Finds how large the second lags may be that are not seen: for each the profile of the cost,
    /// upwards, until it has risen by the one-sided 95 % point of chi-square, or by that of the
    /// residual's energy where the model leaves more than noise (`middle`).
    ///
    /// # Errors
    /// [`EstimateError::Optimiser`] from the minimiser.
    /// ```
    #[doc = include_str!("../doc/readings.txt")]
    /// use twinlag_cross_relation::ScoreVariance;
    /// use twinlag_estimate::{Task, WhitenedFit};
    ///
    /// // Sensors of first order, asked for a second lag of the first one.
    /// let mut fit = WhitenedFit::<6>::find(&Task { second_order: [true, false], ..Task::new(&readings) })?;
    /// fit.bound_unseen_lags(ScoreVariance::WhiteNoise)?;
    /// let limit_s = fit.unseen()[0].expect("there is none").at_most_s.expect("bounded");
    /// assert!(limit_s < 0.005);
    /// # Ok::<(), twinlag_estimate::EstimateError>(())
    /// ```
    pub fn bound_unseen_lags(&mut self, middle: ScoreVariance) -> Result<(), EstimateError> {
        for sensor in 0..2 {
            if self.unseen[sensor].is_some() {
                self.unseen[sensor] = Some(self.bound(sensor, middle)?);
            }
        }
        Ok(())
    }

    fn bound(&self, sensor: usize, middle: ScoreVariance) -> Result<Unseen<P>, EstimateError> {
        let limit = match middle {
            ScoreVariance::WhiteNoise => CHI2_95_ONE_SIDED,
            // The cost is in units of the noise that the estimate rests on, which may be the
            // residual's own.
            ScoreVariance::ResidualSpectrum => CHI2_95_ONE_SIDED * self.energy_of_assumed_noise().max(1.0),
        };
        let cost = EstimatorCost::Whitened(self.whitened.clone());
        let objective = Objective::<P> { cost: &cost, priors: &self.priors };
        let i = 4 + sensor;
        let fit_at = |held_s: f64, from: &[f64]| -> Result<(Vec<f64>, f64), EstimateError> {
            let mut variables = self.variables.clone();
            variables[i] = variables[i].clone().held_at(held_s);
            let mut from = from.to_vec();
            from[i] = held_s;
            let problem = Problem::new(&objective, variables)?;
            let fit = self.task.minimiser.minimise(&problem, &from, &Budget::default())?;
            Ok((fit.x, fit.value))
        };
        // The cost without it has a term more, and is not compared.
        let mut lowest = f64::INFINITY;
        let mut inside = self.fit.x.clone();
        let mut held_s = MIN_SECOND_TAU_PERIODS * self.task.readings.mean_step_s();
        let mut outside_s = None;
        while held_s < inside[sensor] {
            let (x, value) = fit_at(held_s, &inside)?;
            lowest = lowest.min(value);
            if value > lowest + limit {
                outside_s = Some(held_s);
                break;
            }
            inside = x;
            held_s *= LIMIT_STEP_FACTOR;
        }
        if let Some(outside_s) = &mut outside_s {
            let mut inside_s = *outside_s / LIMIT_STEP_FACTOR;
            for _ in 0..LIMIT_HALVINGS {
                let middle_s = (inside_s * *outside_s).sqrt();
                let (x, value) = fit_at(middle_s, &inside)?;
                if value > lowest + limit {
                    *outside_s = middle_s;
                } else {
                    (inside_s, inside) = (middle_s, x);
                }
            }
        }
        let here = &self.fit.x;
        let moves = std::array::from_fn(|k| if here[k] > 0.0 { inside[k] / here[k] } else { 1.0 });
        Ok(Unseen { at_most_s: outside_s, moves })
    }
}

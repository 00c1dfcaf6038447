//! Second lags that were asked for and that the record does not show.
//!
//! A second lag that runs to its lower bound, or that could as well be none, is taken out of the fit. What remains is how large
//! it may be: the profile of the cost, upwards. The time constants then hold for every second lag that the record allows.

use twinlag_cross_relation::ScoreVariance;
use twinlag_estimate::parts::{EstimatorCost, FAR_ABOVE, Objective, hold_known};
use twinlag_optimise::{Budget, End, Minimiser, Problem, Variable};

use crate::error::Error;
use crate::question::{Fitted, Question};

/// 95 % point, one-sided: a second lag is not negative.
const ONE_SIDED_95: f64 = 2.705_543_454_095_404;
/// A second lag that lowers the cost by less than the 95 % point of chi-square may be none.
const CHI2_95: f64 = 3.841_458_820_694_124;
/// The threshold of the cost for two second lags together.
const CHI2_95_OF_TWO: f64 = 5.991_464_547_107_98;
/// A second lag below this multiple of its lower bound counts as zero.
const NEXT_TO_NONE: f64 = 1e-3;
/// Halvings, in logarithms, that place the largest that is allowed.
const HALVINGS: usize = 6;

/// The largest second lag that a record allows where it shows none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Unseen<const P: usize> {
    /// Upper end of the one-sided 95 % interval, s; `None` where the record allows one as large as the first lag.
    pub(crate) at_most_s: Option<f64>,
    /// By which factor it moves the parameters from where they are without it.
    pub(crate) moves: [f64; P],
}

impl<'a, const P: usize> Question<'a, P> {
    /// The fit without the second lags that are not seen, which are held at none from here on.
    ///
    /// Both are tried together first: a lag that the sensors share drops out of how they disagree, so each of two alike looks
    /// needed as long as the other is there.
    pub(crate) fn without_unseen(&mut self, mut best: Fitted<'a>) -> Result<Fitted<'a>, Error> {
        // With one left out the other may turn out not to be seen either.
        while let Some(without) = self.without_least_seen(&best)? {
            best = Fitted { starts: best.starts, ..without };
        }
        Ok(best)
    }

    /// The fit without both second lags, or without the one that is in more doubt; `None` where what is there is needed.
    fn without_least_seen(&mut self, best: &Fitted<'a>) -> Result<Option<Fitted<'a>>, Error> {
        let free = self.free();
        let theta: [f64; P] = best.theta();
        let covariance = best.whitened.covariance(&theta, &free, &self.prior_std(), ScoreVariance::WhiteNoise);
        let doubt = |i: usize| match (&best.fit.end, covariance) {
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
            if let Some(without) = self.without(best, &left_out, limit)? {
                return Ok(Some(without));
            }
        }
        Ok(None)
    }

    /// The fit with the second lags `left_out` at none, where that raises the cost by no more than `limit`.
    fn without(&mut self, best: &Fitted<'a>, left_out: &[usize], limit: f64) -> Result<Option<Fitted<'a>>, Error> {
        let kept = self.variables.clone();
        let mut x = best.fit.x.clone();
        for &i in left_out {
            self.variables[i] = Variable::linear(kept[i].name.clone(), 1.0, 0.0, 0.0);
            // The other lag of that sensor takes over.
            x[i - 4] += x[i];
            x[i] = 0.0;
        }
        hold_known(&mut x, &self.variables);
        let without = self.fit_whitened_with(best.whitened.hold(), best.whitened.noise_std(), Some(&x))?;
        // Compared with next to none of it, which leaves as many terms as the fit with it has.
        let mut next_to_none: [f64; P] = without.theta();
        left_out.iter().for_each(|&i| next_to_none[i] = NEXT_TO_NONE * kept[i].lower);
        let cost = EstimatorCost::Whitened(best.whitened.clone());
        let value = Objective::<P> { cost: &cost, priors: &self.priors }.at(&next_to_none).value;
        let gained = (value - best.fit.value) / self.energy(best).max(1.0);
        let theta: [f64; P] = without.theta();
        let covariance =
            without.whitened.covariance(&theta, &self.free(), &self.prior_std(), ScoreVariance::WhiteNoise);
        let is_determined = without.fit.end.is_usable() && self.vague(&theta, covariance.as_ref()).is_empty();
        if gained > if is_determined { limit } else { FAR_ABOVE } {
            self.variables = kept;
            return Ok(None);
        }
        for &i in left_out {
            self.unseen[i - 4] = Some(Unseen { at_most_s: None, moves: [1.0; P] });
        }
        Ok(Some(without))
    }

    /// How large the second lags may be that are not seen, beside the fit `best` without them.
    pub(crate) fn bound_unseen(&mut self, best: &Fitted<'a>, middle: ScoreVariance) -> Result<(), Error> {
        let limit = match middle {
            ScoreVariance::WhiteNoise => ONE_SIDED_95,
            ScoreVariance::ResidualSpectrum => ONE_SIDED_95 * self.energy(best).max(1.0),
        };
        let cost = EstimatorCost::Whitened(best.whitened.clone());
        let objective = Objective::<P> { cost: &cost, priors: &self.priors };
        for sensor in 0..2 {
            if self.unseen[sensor].is_none() {
                continue;
            }
            let i = 4 + sensor;
            let fit_at = |held_s: f64, from: &[f64]| -> Result<(Vec<f64>, f64), Error> {
                let mut variables = self.variables.clone();
                variables[i] = variables[i].clone().held_at(held_s);
                let mut from = from.to_vec();
                from[i] = held_s;
                let problem = Problem::new(&objective, variables)?;
                let fit = self.options.optimiser.minimise(&problem, &from, &Budget::default())?;
                Ok((fit.x, fit.value))
            };
            // The cost without it has a term more, and is not compared.
            let mut lowest = f64::INFINITY;
            let mut inside = best.fit.x.clone();
            let mut held_s = 0.05 * self.readings.mean_step_s();
            let mut outside_s = None;
            while held_s < inside[sensor] {
                let (x, value) = fit_at(held_s, &inside)?;
                lowest = lowest.min(value);
                if value > lowest + limit {
                    outside_s = Some(held_s);
                    break;
                }
                inside = x;
                held_s *= 2.0;
            }
            let at_most_s = match outside_s {
                None => None,
                Some(mut outside_s) => {
                    let mut inside_s = 0.5 * outside_s;
                    for _ in 0..HALVINGS {
                        let middle_s = (inside_s * outside_s).sqrt();
                        let (x, value) = fit_at(middle_s, &inside)?;
                        if value > lowest + limit {
                            outside_s = middle_s;
                        } else {
                            (inside_s, inside) = (middle_s, x);
                        }
                    }
                    Some(outside_s)
                }
            };
            let here = &best.fit.x;
            let moves = std::array::from_fn(|k| if here[k] > 0.0 { inside[k] / here[k] } else { 1.0 });
            self.unseen[sensor] = Some(Unseen { at_most_s, moves });
        }
        Ok(())
    }
}

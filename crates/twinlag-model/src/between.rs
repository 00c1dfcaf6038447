//! What several records of one rig say of the numbers that they share.
//!
//! Each record has an estimate of its own beside the joint one: a Newton step of its own energy from the joint fit, or, where that is
//! long, a fit of its own. If the model were the whole truth, these would scatter by their standard errors. Where they scatter by
//! clearly more, something that changes from record to record is missing in the model, and a shared number is a mean over records
//! that were drawn from many: its uncertainty is that of a random effect, whose variance between records is that of Paule and
//! Mandel (1982), with the standard error of Hartung and Knapp (2001) and Student's distribution. A record that hardly determines a
//! number has a large standard error, and so little weight: where nothing but such a record is off, it says nothing of a variance
//! between the others, and the standard error of the mean grows by the ratio of Birge (1932) alone, the scatter over what the
//! standard errors explain. Where a test of what the joint fit leaves fails, the standard errors are those of noise that is
//! correlated as it is in each record, as that of the joint estimate is.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal, StudentsT};
use twinlag_cross_relation::Z_975;

use crate::dense;
use crate::fit::{Effort, Fitted};
use crate::normal::NormalEquations;
use crate::observations::Observations;
use crate::policy::Policy;
use crate::selection::Selection;
use crate::summary::covariance;

/// Halvings of the interval in which the variance between records lies: to a relative 1e-15.
const HALVINGS: usize = 60;
/// Probability of the scatter by chance below which it counts as one between records: the usual one.
const SCATTER_PROBABILITY: f64 = 0.05;
/// Longest Newton step, in standard errors of the number that moves, over which the energy is taken for a parabola. Chosen: where records
/// differ by noise alone, one number in 370 steps further, and is fitted in vain.
const MAX_NEWTON_STEP_SE: f64 = 3.0;
/// Variance inflation above which a record is taken not to determine a number: `1/(1 − R²)` of its derivative regressed on those of the
/// numbers before it. Chosen between 1e12, which rounding leaves where `R² = 1` and where [`dense::inverse`] gives up, and 1e6, where a
/// thousandth of the derivative is its own.
const MAX_VARIANCE_INFLATION: f64 = 1e8;
/// What a record knows of a shared number, over the mean of what all records together know of it, below which it is taken not to determine
/// it. Chosen: the joint value is then ten times as certain as its own, at least.
const MIN_INFORMATION_SHARE: f64 = 0.01;
/// Fewest records of which one can be said to contradict the others.
const FEWEST_TO_CONTRADICT: usize = 3;

/// An estimate from one record alone, beside what all share.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct OwnValue {
    /// The record, from 0.
    pub record: usize,
    /// The estimate.
    pub value: f64,
    /// Its standard error in that record.
    pub standard_error: f64,
}

/// What records say of a number that they share.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct BetweenRecords {
    /// The estimates of the records that determine it.
    pub own: Vec<OwnValue>,
    /// Their weighted mean.
    pub mean: f64,
    /// Standard deviation of the number between records, beside their standard errors; 0 where these explain what they differ.
    pub standard_deviation: f64,
    /// Standard error of the mean.
    pub standard_error: f64,
    /// Its 95 % interval.
    pub interval_95: [f64; 2],
    /// Root mean square of what the estimates differ from their mean, over their standard errors: 1 if the model is right.
    pub ratio: f64,
    /// Probability of at least as large a scatter if the model is right.
    pub p_value: f64,
    /// Shared numbers that no record determines by itself, but only the differences between records. The scatter of every number has one
    /// degree of freedom less for each of them. That is too few for numbers which they do not move, so that intervals are long rather
    /// than short.
    pub determined_between: usize,
}

/// A record that contradicts the others on a number.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Contradicted {
    /// What the record says.
    pub own: OwnValue,
    /// What the others say.
    pub others: f64,
    /// The standard error of that, with what they differ from each other.
    pub others_error: f64,
    /// Probability of at least as large a difference by chance, if records differ as the others do.
    pub p_value: f64,
}

impl Contradicted {
    /// A record and all others, each by a fit of its own, where nothing is known of what records of the rig differ but their noise.
    ///
    /// - `own`, `others`: the number and its standard error
    ///
    /// ```
    /// use twinlag_model::Contradicted;
    ///
    /// // Five standard errors of the difference apart: by chance once in 1.7 million.
    /// let contradicted = Contradicted::beyond_noise(2, (1.5, 0.06), (1.0, 0.08));
    /// assert!((contradicted.p_value / 5.733e-7 - 1.0).abs() < 1e-3);
    /// ```
    pub fn beyond_noise(record: usize, own: (f64, f64), others: (f64, f64)) -> Self {
        let ((value, standard_error), (others, others_error)) = (own, others);
        let deviations = (value - others).abs() / standard_error.hypot(others_error);
        let p_value = 2.0 * Normal::standard().sf(deviations);
        Self { own: OwnValue { record, value, standard_error }, others, others_error, p_value }
    }
}

impl BetweenRecords {
    /// From the estimates of each record; `None` of fewer than two.
    ///
    /// ```
    /// use twinlag_model::BetweenRecords;
    ///
    /// // Four records whose values differ by ten times their standard errors.
    /// let between = BetweenRecords::of(&[(0, 1.0, 0.1), (1, 2.0, 0.1), (2, 3.0, 0.1), (3, 2.0, 0.1)]).expect("four");
    /// assert!((between.mean - 2.0).abs() < 1e-9);
    /// // The sample variance, 2/3, less that of a standard error.
    /// assert!((between.standard_deviation.powi(2) - (2.0 / 3.0 - 0.01)).abs() < 1e-6);
    /// assert!(between.p_value < 1e-9 && between.ratio > 8.0);
    /// assert!(BetweenRecords::of(&[(0, 1.0, 0.1)]).is_none());
    /// ```
    pub fn of(values: &[(usize, f64, f64)]) -> Option<Self> {
        Self::with_determined_between(values, 0)
    }

    /// As [`Self::of`], where the estimates hold numbers that only the differences between records determine.
    fn with_determined_between(values: &[(usize, f64, f64)], determined_between: usize) -> Option<Self> {
        let own: Vec<OwnValue> = values
            .iter()
            .filter(|(_, value, error)| value.is_finite() && error.is_finite() && *error > 0.0)
            .map(|(record, value, standard_error)| OwnValue {
                record: *record,
                value: *value,
                standard_error: *standard_error,
            })
            .collect();
        let dof = own.len().checked_sub(1 + determined_between).filter(|dof| *dof > 0)? as f64;
        let (_, at_rest) = scatter(&own, 0.0);
        let p_value = ChiSquared::new(dof).map_or(1.0, |chi2| chi2.sf(at_rest));
        let does_vary = p_value < SCATTER_PROBABILITY;
        let variance = if does_vary { variance_between(&own, dof) } else { 0.0 };
        let (mean, statistic) = scatter(&own, variance);
        let weight: f64 = own.iter().map(|own| (own.standard_error.powi(2) + variance).recip()).sum();
        let standard_error = ((statistic / dof).max(1.0) / weight).sqrt();
        let half = if does_vary { quantile_975(dof) } else { Z_975 } * standard_error;
        Some(Self {
            mean,
            standard_deviation: variance.sqrt(),
            standard_error,
            interval_95: [mean - half, mean + half],
            ratio: (at_rest / dof).sqrt(),
            p_value,
            determined_between,
            own,
        })
    }

    /// Whether the records scatter by more than their standard errors, if only by chance.
    pub fn scatters(&self) -> bool {
        self.ratio > 1.0
    }

    /// Whether they scatter by more than chance.
    pub fn differs(&self) -> bool {
        self.standard_deviation > 0.0
    }

    /// Records that contradict all the others together, by chance once in `1/probability` numbers.
    pub fn contradicted(&self, probability: f64) -> Vec<Contradicted> {
        let records = self.own.len();
        if records < FEWEST_TO_CONTRADICT + self.determined_between {
            return Vec::new();
        }
        let of = |place: usize| {
            let own = self.own[place];
            let others: Vec<(usize, f64, f64)> = self
                .own
                .iter()
                .filter(|other| other.record != own.record)
                .map(|other| (other.record, other.value, other.standard_error))
                .collect();
            let others = Self::with_determined_between(&others, self.determined_between)?;
            let spread = others.standard_error.hypot(others.standard_deviation);
            let deviations = (own.value - others.mean).abs() / own.standard_error.hypot(spread);
            let student = StudentsT::new(0.0, 1.0, (records - 2 - self.determined_between) as f64).ok()?;
            let p_value = 2.0 * student.sf(deviations);
            let is_far = p_value * (records as f64) < probability;
            is_far.then_some(Contradicted { own, others: others.mean, others_error: others.standard_error, p_value })
        };
        (0..records).filter_map(of).collect()
    }
}

/// Weighted mean of the estimates under a variance between records, and the sum of squares about it in units of their variances.
fn scatter(own: &[OwnValue], variance: f64) -> (f64, f64) {
    let weights: Vec<f64> = own.iter().map(|own| (own.standard_error.powi(2) + variance).recip()).collect();
    let mean = own.iter().zip(&weights).map(|(own, w)| w * own.value).sum::<f64>() / weights.iter().sum::<f64>();
    (mean, own.iter().zip(&weights).map(|(own, w)| w * (own.value - mean).powi(2)).sum())
}

/// The variance between records at which the sum of squares is its expectation; 0 where it is less without any.
fn variance_between(own: &[OwnValue], dof: f64) -> f64 {
    if scatter(own, 0.0).1 <= dof {
        return 0.0;
    }
    let values = own.iter().map(|own| own.value);
    let range = values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min);
    // With this variance no value is further off than one unit.
    let (mut low, mut high) = (0.0, range * range);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if scatter(own, middle).1 > dof { low = middle } else { high = middle }
    }
    high
}

/// Quantile 0.975 of Student's distribution.
fn quantile_975(dof: f64) -> f64 {
    StudentsT::new(0.0, 1.0, dof).map_or(f64::INFINITY, |student| student.inverse_cdf(0.975))
}

/// What records say of the shared numbers of a fit.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Between {
    /// Of each parameter, in the order of the covariance; `None` of one that belongs to a record, is held, or that fewer than two
    /// records determine.
    pub parameters: Vec<Option<BetweenRecords>>,
    /// Of the difference of the time constants.
    pub difference: Option<BetweenRecords>,
}

/// What records say of the shared numbers of `fitted`; `None` of one record.
///
/// - `by_residual`: whether the standard errors are those of noise that is correlated as what the fit leaves is, as in [`covariance`]
pub(crate) fn between(
    fitted: &Fitted,
    observations: &Observations,
    selection: &Selection,
    by_residual: bool,
) -> Option<Between> {
    let members = observations.members();
    if members.len() < 2 {
        return None;
    }
    let is_shared = |i: usize| fitted.model.record_of(i).is_none() && !is_of_noise(fitted, i);
    let joint = covariance(fitted, observations, selection, false);
    let largest_variance = |i: usize| {
        let of_one = |joint: &Vec<Vec<f64>>| members.len() as f64 * joint[i][i] / MIN_INFORMATION_SHARE;
        joint.as_ref().filter(|_| is_shared(i)).map_or(f64::INFINITY, of_one)
    };
    let own: Vec<(usize, OwnEstimate)> = members
        .iter()
        .filter_map(|member| {
            let own = observations.of_member(member.number);
            let selection = selection.of_samples(member.samples.clone());
            let (at, mut estimate) = OwnEstimate::of(fitted, &own, &selection, is_shared, largest_variance)?;
            if by_residual {
                estimate.covariance = covariance(&at, &own, &selection, true)?;
            }
            Some((member.number, estimate))
        })
        .collect();
    let is_held_in_all = |i: &usize| !own.is_empty() && own.iter().all(|(_, own)| own.held.contains(i));
    let determined_between = (0..fitted.theta.len()).filter(|i| is_shared(*i)).filter(is_held_in_all).count();
    let of = |sum: &[(usize, f64)]| {
        let values: Vec<(usize, f64, f64)> = own
            .iter()
            .map(|(record, own)| {
                let value = sum.iter().map(|(i, s)| s * own.theta[*i]).sum();
                let pairs = sum.iter().flat_map(|a| sum.iter().map(move |b| (a, b)));
                let variance: f64 = pairs.map(|((i, s), (j, t))| s * t * own.covariance[*i][*j]).sum();
                (*record, value, variance.max(0.0).sqrt())
            })
            .collect();
        BetweenRecords::with_determined_between(&values, determined_between)
    };
    let parameters = (0..fitted.theta.len()).map(|i| if is_shared(i) { of(&[(i, 1.0)]) } else { None }).collect();
    Some(Between { parameters, difference: of(&[(0, -1.0), (1, 1.0)]) })
}

fn is_of_noise(fitted: &Fitted, parameter: usize) -> bool {
    let model = &fitted.model;
    (0..model.effects.len()).any(|index| model.effects[index].is_noise() && model.range(index).contains(&parameter))
}

/// The estimate of a record by itself.
struct OwnEstimate {
    theta: Vec<f64>,
    /// That of noise alone: the uncertainty of what is held is not in it.
    covariance: Vec<Vec<f64>>,
    /// Parameters that the record does not determine: they are as in the joint fit.
    held: Vec<usize>,
}

impl OwnEstimate {
    /// From the joint fit by a Newton step, or by a fit where that leads far, with the fit from which the step is; `None` where the
    /// record does not determine the numbers, or its fit ends where the energy still falls.
    ///
    /// - `observations`, `selection`: of the record
    /// - `is_shared`: whether a parameter is one of all records
    /// - `largest_variance`: variance of a parameter from which on the record does not determine it
    fn of(
        joint: &Fitted,
        observations: &Observations,
        selection: &Selection,
        is_shared: impl Fn(usize) -> bool,
        largest_variance: impl Fn(usize) -> f64,
    ) -> Option<(Fitted, Self)> {
        let is_near = |estimate: &Self, from: &Fitted| {
            (0..from.theta.len()).filter(|i| is_shared(*i)).all(|i| {
                let step = estimate.theta[i] - from.theta[i];
                step.powi(2) <= MAX_NEWTON_STEP_SE.powi(2) * estimate.covariance[i][i]
            })
        };
        let equations = |of: &Fitted| of.model.normal_equations(&of.theta, observations, selection, None);
        let (mut joint, mut normal) = (joint.clone(), equations(joint));
        // What is the record's own is determined by it first.
        let (shared, own): (Vec<usize>, Vec<usize>) = (0..joint.theta.len()).partition(|i| is_shared(*i));
        joint.model.held = undetermined(&normal.products, own.into_iter().chain(shared), largest_variance);
        joint.model.held.iter().for_each(|at| normal.hold(*at));
        let by_step = Self::by_newton_step(&joint, observations, selection, &normal)?;
        if is_near(&by_step, &joint) {
            return Some((joint, by_step));
        }
        let own = Fitted {
            is_mismatch_bias_removed: joint.is_mismatch_bias_removed,
            ..joint.model.fit(&joint.theta, observations, selection, Effort::Finish)
        };
        let by_step = Self::by_newton_step(&own, observations, selection, &equations(&own))?;
        is_near(&by_step, &own).then_some((own, by_step))
    }

    /// - `normal`: the normal equations of the record at `fitted`
    fn by_newton_step(
        fitted: &Fitted,
        observations: &Observations,
        selection: &Selection,
        normal: &NormalEquations,
    ) -> Option<Self> {
        let Fitted { model, theta, .. } = fitted;
        let mut step =
            dense::times(&model.inverse_second_derivatives(theta, observations, selection, normal)?, &normal.slope);
        // The step is to the minimum, and the fit is not there.
        if let Some(bias) = fitted.removed_bias(observations, selection) {
            step.iter_mut().zip(bias).for_each(|(step, bias)| *step -= bias);
        }
        let covariance = covariance(fitted, observations, selection, false)?;
        let theta = theta.iter().zip(step).map(|(theta, step)| theta - step).collect();
        Some(Self { theta, covariance, held: model.held.clone() })
    }
}

/// Parameters whose derivatives those of the parameters before them make up, to rounding or up to a variance.
///
/// - `products`: of the derivatives with each other
/// - `order`: the parameters
/// - `largest_variance`: of a parameter beside those before it
fn undetermined(
    products: &[Vec<f64>],
    order: impl Iterator<Item = usize>,
    largest_variance: impl Fn(usize) -> f64,
) -> Vec<usize> {
    let (mut determined, mut out): (Vec<usize>, Vec<usize>) = (Vec::new(), Vec::new());
    for i in order.filter(|i| products[*i][*i] > 0.0) {
        let tried: Vec<usize> = determined.iter().copied().chain([i]).collect();
        let part: Vec<Vec<f64>> = tried.iter().map(|a| tried.iter().map(|b| products[*a][*b]).collect()).collect();
        let last = tried.len() - 1;
        let variance = dense::inverse(&part).map(|inverse| inverse[last][last]);
        let largest = largest_variance(i).min(MAX_VARIANCE_INFLATION / products[i][i]);
        if variance.is_some_and(|variance| variance < largest) {
            determined = tried;
        } else {
            out.push(i);
        }
    }
    out
}

/// Shared numbers that a record contradicts, each with its place among the parameters; the difference has none.
impl Between {
    /// Records that contradict the others, with the parameter.
    pub fn contradicted(&self, policy: &Policy) -> Vec<(usize, Contradicted)> {
        let numbers = self.parameters.iter().filter(|between| between.is_some()).count().max(1);
        let probability = policy.records_rejection_probability / numbers as f64;
        let of = |(at, between): (usize, &Option<BetweenRecords>)| {
            let contradicted = between.as_ref().map_or_else(Vec::new, |between| between.contradicted(probability));
            contradicted.into_iter().map(move |one| (at, one))
        };
        self.parameters.iter().enumerate().flat_map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values that scatter less than their errors have the interval of their weighted mean.
    #[test]
    fn records_that_agree_have_no_variance_between_them() {
        let between = BetweenRecords::of(&[(0, 1.00, 0.1), (1, 1.05, 0.1), (2, 0.95, 0.1)]).expect("three records");
        assert_eq!(between.standard_deviation, 0.0);
        assert!((between.mean - 1.0).abs() < 1e-12 && between.p_value > 0.5);
        assert!((between.interval_95[1] - 1.0 - Z_975 * 0.1 / 3.0_f64.sqrt()).abs() < 1e-9);
    }

    /// A good record keeps what it says beside one that hardly says anything and is 1.8 of its own standard errors off; one that is
    /// six off shows that records differ, of which two say little.
    #[test]
    fn a_weak_record_does_not_make_a_good_one_worthless() {
        let of = |value| BetweenRecords::of(&[(0, 1.0, 0.001), (1, value, 0.1)]).expect("two records");
        let (near, far) = (of(1.18), of(1.6));
        // Birge's ratio is 1.8, the standard error that of the good record.
        let half = 0.5 * (near.interval_95[1] - near.interval_95[0]);
        assert!((half / (Z_975 * 1.8 * 0.001) - 1.0).abs() < 1e-3, "{half}");
        assert!(near.scatters() && !near.differs());
        assert!(far.standard_deviation > 0.1 && far.interval_95[1] - far.interval_95[0] > 1.0);
    }

    /// A record that determines nothing changes nothing: its weight is one in 10⁸.
    #[test]
    fn a_record_that_says_nothing_has_no_weight() {
        let three = [(0, 1.0, 0.1), (1, 2.0, 0.1), (2, 1.5, 0.1)];
        let four = [&three[..], &[(3, 700.0, 1e4)]].concat();
        let [with, without] = [&four[..], &three[..]].map(|v| BetweenRecords::of(v).expect("several"));
        assert!((with.mean - without.mean).abs() < 1e-4, "{} {}", with.mean, without.mean);
        assert_eq!(BetweenRecords::of(&[(0, 1.0, 0.1), (1, f64::NAN, 0.1), (2, 1.0, 0.0)]), None);
    }

    /// The third derivative is the sum of the others. Of the fourth a thousandth is its own, of the fifth a hundred-thousandth; the sixth is
    /// none.
    #[test]
    fn what_others_make_up_is_not_determined() {
        let columns: Vec<Vec<f64>> = vec![
            vec![1.0, 0.0, 0.0, 0.0],
            vec![0.0, 1e3, 0.0, 0.0],
            vec![1.0, 1e3, 0.0, 0.0],
            vec![1.0, 0.0, 1e-3, 0.0],
            vec![1.0, 0.0, 0.0, 1e-5],
            vec![0.0; 4],
        ];
        let products = dense::gram(&columns);
        assert_eq!(undetermined(&products, 0..6, |_| f64::INFINITY), [2, 4]);
        // What is the fourth's own determines it to a variance of 10⁶.
        assert_eq!(undetermined(&products, 0..6, |i| if i == 3 { 1e5 } else { f64::INFINITY }), [2, 3, 4]);
        assert_eq!(undetermined(&products, (0..6).rev(), |_| f64::INFINITY), [1, 0]);
    }

    /// Three values of which two numbers were made: one of them by the differences alone, so that one degree of freedom is left.
    #[test]
    fn numbers_that_differences_determine_take_degrees_of_freedom() {
        let values = [(0, 1.0, 0.1), (1, 1.3, 0.1), (2, 0.9, 0.1)];
        let of = |between| BetweenRecords::with_determined_between(&values, between);
        let [all, fewer] = [of(0), of(1)].map(|between| between.expect("three records"));
        assert!((fewer.ratio / all.ratio - 2.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(of(2), None);
        // By the scatter alone the second record is at odds with the others.
        assert!(!all.contradicted(0.9).is_empty() && fewer.contradicted(0.9).is_empty());
    }

    /// Of five records one is off by fifty standard errors: it contradicts the others, and none of these does.
    #[test]
    fn the_record_that_contradicts_is_named() {
        let values = [(0, 1.0, 0.1), (1, 1.1, 0.1), (2, 0.9, 0.1), (3, 6.0, 0.1), (4, 1.05, 0.1)];
        let between = BetweenRecords::of(&values).expect("five records");
        let contradicted = between.contradicted(1e-3);
        assert_eq!(contradicted.iter().map(|one| one.own.record).collect::<Vec<_>>(), [3]);
        assert!((contradicted[0].others - 1.0125).abs() < 1e-9);
        // Of two records nobody can say which is wrong.
        assert!(BetweenRecords::of(&values[2..4]).expect("two records").contradicted(1e-3).is_empty());
    }
}

//! Two lags in series of one sensor, which may be equal.
//!
//! A model depends on the lags `a ≥ b` of a sensor through `(1 + a s)(1 + b s)`, that is through their sum `S = a + b` and their product
//! `P = a b` alone. Where the lags are equal, nothing changes to first order with their difference, and a covariance of `a` and `b` says
//! nothing of it. That of `S` and `P` does, everywhere: the square of half the difference, `q = (S/2)² − P`, is as good a parameter as
//! any, and where `q = 0` is not excluded, each of the two lags may be anything from `S/2` to `S/2 ± √q`, with the largest `q` that the
//! record allows.

use twinlag_cross_relation::Z_975;

use crate::fit::Fitted;
use crate::model::Model;

/// Half the difference of two lags over half their sum, at least, where derivatives are taken. The derivatives of `P` by the two lags then
/// differ by a fifth.
const LEAST_RELATIVE_DIFFERENCE: f64 = 0.1;

/// The places of both lags of a sensor among the parameters of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct LagPair {
    pub(crate) time_constant: usize,
    pub(crate) second: usize,
}

impl LagPair {
    /// The pairs of a model of which both lags are fitted, and nothing is known beforehand.
    pub(crate) fn each(model: &Model) -> impl Iterator<Item = Self> + '_ {
        let is_free = |at: &usize| !model.held.contains(at);
        model.effects.iter().enumerate().filter_map(move |(index, effect)| {
            let sensor = effect.channel().filter(|sensor| !model.knows_of(*sensor))?;
            let second = model.range(index).start + effect.series_lag()?;
            let is_fitted = !model.is_frozen || effect.is_of_the_record();
            (is_fitted && [sensor, second].iter().all(is_free)).then_some(Self { time_constant: sensor, second })
        })
    }

    /// Takes out of the second derivatives what the slope by `P` adds to them, `F_P = (∂/∂a − ∂/∂b)/(b − a)` in the mixed one: what is left is
    /// the curvature by `S` and `P`. At equal lags `F_P` is not defined, and nothing is done.
    pub(crate) fn without_slope(self, second: &mut [Vec<f64>], slope: &[f64], theta: &[f64]) {
        let Self { time_constant: a, second: b } = self;
        let difference_s = theta[b] - theta[a];
        if difference_s != 0.0 {
            let of_product = (slope[a] - slope[b]) / difference_s;
            second[a][b] -= of_product;
            second[b][a] -= of_product;
        }
    }

    /// Takes a covariance from lags `from` to lags `to` of the same sum. `S` and `q` keep their covariance; half the difference, `√q`, gets the
    /// standard error whose 95 % interval reaches to the further end of that of `q`.
    pub(crate) fn covariance_at(self, covariance: &mut [Vec<f64>], from: &[f64], to: &[f64]) {
        let half_difference_s = |theta: &[f64]| 0.5 * (theta[self.time_constant] - theta[self.second]);
        // δS and δq by δa and δb.
        let half_s = half_difference_s(from);
        self.transform(covariance, [[1.0, 1.0], [half_s, -half_s]]);
        let reach = Z_975 * covariance[self.second][self.second].max(0.0).sqrt();
        let per_q = if reach > 0.0 { slope_to_further_end(half_difference_s(to), reach) } else { 0.0 };
        self.transform(covariance, [[0.5, per_q], [0.5, -per_q]]);
    }

    /// The covariance of two linear functions of both lags, in their places.
    fn transform(self, covariance: &mut [Vec<f64>], [first, second]: [[f64; 2]; 2]) {
        let Self { time_constant: a, second: b } = self;
        let of = |of_a: f64, of_b: f64| [first, second].map(|[by_a, by_b]| by_a * of_a + by_b * of_b);
        for row in covariance.iter_mut() {
            [row[a], row[b]] = of(row[a], row[b]);
        }
        for column in 0..covariance.len() {
            let both = of(covariance[a][column], covariance[b][column]);
            [covariance[a][column], covariance[b][column]] = both;
        }
    }
}

/// By how much half the difference changes with `q`, on the way to the end of the interval `q ± reach` at which it changes more.
fn slope_to_further_end(half_difference_s: f64, reach: f64) -> f64 {
    let size_s = half_difference_s.abs();
    let [low_s, high_s] = [-1.0, 1.0].map(|sign| (size_s * size_s + sign * reach).max(0.0).sqrt());
    // `√q − √(q − e)` without the difference of numbers that are nearly equal.
    let down = if low_s > 0.0 { (size_s + low_s).recip() } else { size_s / reach };
    down.max((high_s + size_s).recip()).copysign(half_difference_s)
}

/// A fit with the lags of each sensor so far apart that derivatives by both say different things, their sums as they are.
pub(crate) fn apart(fitted: &Fitted) -> Fitted {
    let mut out = fitted.clone();
    for LagPair { time_constant: a, second: b } in LagPair::each(&fitted.model) {
        let half_sum_s = 0.5 * (out.theta[a] + out.theta[b]);
        let difference_s = 0.5 * (out.theta[a] - out.theta[b]);
        let least_s = LEAST_RELATIVE_DIFFERENCE * half_sum_s;
        if difference_s.abs() < least_s {
            let apart_s = least_s.copysign(difference_s);
            (out.theta[a], out.theta[b]) = (half_sum_s + apart_s, half_sum_s - apart_s);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{Identifier, candidates};
    use crate::fit::Effort;
    use crate::prepare::{Prepared, whole_selection};
    use crate::settings::Settings;
    use crate::summary::covariance as covariance_of;
    use crate::track::fixture::{TAU_S, observations};
    use crate::weighting::Weighting;

    const PAIR: LagPair = LagPair { time_constant: 0, second: 1 };

    /// The covariance of two lags of 10 s and 6 s, with the standard errors `sum_s` of their sum and `product_s2` of their
    /// product, which are independent, and of a third parameter that goes with the sum.
    fn covariance(sum_s: f64, product_s2: f64) -> Vec<Vec<f64>> {
        let (a, b) = (10.0, 6.0);
        // ∂(a, b)/∂(S, P) is [[a, −1], [−b, 1]]/(a − b); the third is the sum.
        let by = [[a, -1.0], [-b, 1.0], [a - b, 0.0]].map(|row| row.map(|x| x / (a - b)));
        let variances = [sum_s * sum_s, product_s2 * product_s2];
        let of = |i: usize, j: usize| (0..2).map(|k| by[i][k] * by[j][k] * variances[k]).sum();
        (0..3).map(|i| (0..3).map(|j| of(i, j)).collect()).collect()
    }

    /// `√(q − e)` is `√q (1 − e/2q − (e/2q)²/2)`. With `q` = 4 s² and `e` = 1.96 × 1.28e-3 s² the variance of half the difference is longer by
    /// `e/2q` = 3.1e-4, and that of a lag by no more.
    #[test]
    fn lags_that_are_apart_are_as_certain_as_they_were() {
        let before = covariance(1e-4, 1e-3);
        let mut after = before.clone();
        PAIR.covariance_at(&mut after, &[10.0, 6.0], &[10.0, 6.0]);
        for (a, b) in after.iter().flatten().zip(before.iter().flatten()) {
            assert!((a - b).abs() < 4e-4 * before[0][0], "{after:?}, {before:?}");
        }
    }

    /// Of equal lags, 8 s, the sum is as certain as it was, and the interval of each reaches `√1.96` s, as far as that of `q` lets it. The standard
    /// error of `q` is `√((8 · 1e-4)² + 1)`, 3e-7 above 1 s², and the sum adds 2e-9 to the variance.
    #[test]
    fn equal_lags_are_as_uncertain_as_the_square_of_their_difference() {
        let mut after = covariance(1e-4, 1.0);
        PAIR.covariance_at(&mut after, &[10.0, 6.0], &[8.0, 8.0]);
        let sum = after[0][0] + after[1][1] + 2.0 * after[0][1];
        assert!((sum / 1e-8 - 1.0).abs() < 1e-6, "{sum}");
        for i in 0..2 {
            let reach = Z_975 * after[i][i].sqrt();
            assert!((reach / Z_975.sqrt() - 1.0).abs() < 1e-6, "{reach}");
        }
        assert!((after[0][2] + after[1][2] - 1e-8).abs() < 1e-14, "what goes with the sum still does: {after:?}");
    }

    /// Energy `(S − 16)² + 2 (P − 60)`, whose slope is not zero at 10 s and 6 s: by `S` and `P` it bends by the first term alone, and so it does
    /// by the lags without that slope.
    #[test]
    fn a_slope_is_no_curvature() {
        // Halves of the derivatives: (S − 16) + b, (S − 16) + a; the mixed second one has 1 of the product in it.
        let slope = [6.0, 10.0];
        let mut second = vec![vec![1.0, 2.0], vec![2.0, 1.0]];
        PAIR.without_slope(&mut second, &slope, &[10.0, 6.0]);
        assert_eq!(second, vec![vec![1.0; 2]; 2]);
    }

    /// A second lag that is held has no variance, and its time constant that of a fit without it among the parameters.
    #[test]
    fn a_lag_that_is_held_is_no_pair() {
        let observations = observations(2000, 1.0, |_| 1.0);
        let selection = whole_selection(&observations, &Weighting::default());
        let prepared = Prepared::new(&observations, &Settings::default()).expect("a sound record");
        let effect = candidates(&[Identifier::SECOND_ORDER], &prepared.context).remove(0);
        let mut model = Model::new(&[], [1.0; 2]).with(effect);
        assert_eq!(LagPair::each(&model).collect::<Vec<_>>(), [LagPair { time_constant: 0, second: 2 }]);
        model.is_frozen = true;
        let theta = [TAU_S[0], TAU_S[1], 0.9 * TAU_S[0]];
        let fitted = model.fit(&theta, &observations, &selection, Effort::Look);
        let covariance = covariance_of(&fitted, &observations, &selection, false).expect("it is determined");
        assert_eq!(covariance[2], [0.0; 3]);
        assert_eq!(apart(&fitted).theta, fitted.theta);
    }
}

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

/// Half the difference of two lags over half their sum below which derivatives are taken with the lags so far apart. There `S` and `P`
/// have derivatives that differ by a fifth, and none of them is far from where the fit is.
const LEAST_RELATIVE_DIFFERENCE: f64 = 0.1;

/// Where both lags of a sensor are among the parameters of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct LagPair {
    pub(crate) larger: usize,
    pub(crate) smaller: usize,
}

impl LagPair {
    /// Those of a model of which nothing is known beforehand.
    pub(crate) fn each(model: &Model) -> impl Iterator<Item = Self> + '_ {
        model.effects.iter().enumerate().filter_map(|(index, effect)| {
            let sensor = effect.channel().filter(|sensor| !model.knows_of(*sensor))?;
            Some(Self { larger: sensor, smaller: model.range(index).start + effect.interchangeable()? })
        })
    }

    /// Makes of second derivatives by the lags, at `theta`, what they would be if energy were a function of `S` and `P` without a slope:
    /// only the mixed one has a part of the slope by `P`, `(∂/∂a − ∂/∂b)/(b − a)`, in it. Equal lags are left as they are.
    pub(crate) fn straighten(self, second: &mut [Vec<f64>], slope: &[f64], theta: &[f64]) {
        let Self { larger, smaller } = self;
        let difference_s = theta[smaller] - theta[larger];
        if difference_s != 0.0 {
            let of_product = (slope[larger] - slope[smaller]) / difference_s;
            second[larger][smaller] -= of_product;
            second[smaller][larger] -= of_product;
        }
    }

    /// Makes of a covariance at lags that are apart, `from`, that at the lags of a fit, `to`: the variance of `S` and `q` is the same, and the
    /// standard error of half the difference is so long that its 95 % interval reaches as far as that of `q` does.
    pub(crate) fn carry(self, covariance: &mut [Vec<f64>], from: &[f64], to: &[f64]) {
        let lags = |theta: &[f64]| [theta[self.larger], theta[self.smaller]];
        let ([a, b], [larger_s, smaller_s]) = (lags(from), lags(to));
        // δS and δq by δa and δb.
        let half_s = 0.5 * (a - b);
        self.transform(covariance, [[1.0, 1.0], [half_s, -half_s]]);
        let difference_s = 0.5 * (larger_s - smaller_s);
        let reach = Z_975 * covariance[self.smaller][self.smaller].max(0.0).sqrt();
        let [low_s, high_s] = [-1.0, 1.0].map(|sign| (difference_s * difference_s + sign * reach).max(0.0).sqrt());
        let size_s = difference_s.abs();
        let per_q =
            if reach > 0.0 { (size_s - low_s).max(high_s - size_s).copysign(difference_s) / reach } else { 0.0 };
        self.transform(covariance, [[0.5, per_q], [0.5, -per_q]]);
    }

    /// The covariance of two linear functions of both lags, in their places.
    fn transform(self, covariance: &mut [Vec<f64>], [first, second]: [[f64; 2]; 2]) {
        let Self { larger, smaller } = self;
        let of = |a: f64, b: f64| [first, second].map(|[of_a, of_b]| of_a * a + of_b * b);
        for row in covariance.iter_mut() {
            [row[larger], row[smaller]] = of(row[larger], row[smaller]);
        }
        for column in 0..covariance.len() {
            let both = of(covariance[larger][column], covariance[smaller][column]);
            [covariance[larger][column], covariance[smaller][column]] = both;
        }
    }
}

/// A fit with the lags of each sensor so far apart that derivatives by both say different things, their sums as they are.
pub(crate) fn apart(fitted: &Fitted) -> Fitted {
    let mut out = fitted.clone();
    for LagPair { larger, smaller } in LagPair::each(&fitted.model) {
        let half_sum_s = 0.5 * (out.theta[larger] + out.theta[smaller]);
        let difference_s = 0.5 * (out.theta[larger] - out.theta[smaller]);
        if difference_s.abs() < LEAST_RELATIVE_DIFFERENCE * half_sum_s {
            let apart_s = (LEAST_RELATIVE_DIFFERENCE * half_sum_s).copysign(difference_s);
            (out.theta[larger], out.theta[smaller]) = (half_sum_s + apart_s, half_sum_s - apart_s);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAIR: LagPair = LagPair { larger: 0, smaller: 1 };

    /// The covariance of lags, 10 s and 6 s apart from rounding, with the standard errors `sum_s` of their sum and `product_s2` of their
    /// product, which are independent, and of a third parameter that goes with the sum.
    fn covariance(sum_s: f64, product_s2: f64) -> Vec<Vec<f64>> {
        let (a, b) = (10.0, 6.0);
        // ∂(a, b)/∂(S, P) is [[a, −1], [−b, 1]]/(a − b); the third is the sum.
        let by = [[a, -1.0], [-b, 1.0], [a - b, 0.0]].map(|row| row.map(|x| x / (a - b)));
        let variances = [sum_s * sum_s, product_s2 * product_s2];
        let of = |i: usize, j: usize| (0..2).map(|k| by[i][k] * by[j][k] * variances[k]).sum();
        (0..3).map(|i| (0..3).map(|j| of(i, j)).collect()).collect()
    }

    /// Where half the difference is many standard errors, the covariance is as it was: `√(q − e) = √q (1 − e/2q − (e/2q)²/2)`, so that the
    /// standard error of it is `e/4q` longer and its variance `e/2q`, with `q` = 4 s² and `e` = 1.96 times 1.3e-3 s² 3.2e-4.
    #[test]
    fn lags_that_are_apart_are_as_certain_as_they_were() {
        let before = covariance(1e-4, 1e-3);
        let mut after = before.clone();
        PAIR.carry(&mut after, &[10.0, 6.0], &[10.0, 6.0]);
        for (a, b) in after.iter().flatten().zip(before.iter().flatten()) {
            assert!((a - b).abs() < 4e-4 * before[0][0], "{after:?}, {before:?}");
        }
    }

    /// Of equal lags, 8 s, the sum is as certain as it was, and the interval of each reaches as far as that of `q` lets it: with a standard
    /// error of `q` that is `√((S/2)² 0 + 1)` = 1 s² to 1e-3, `√1.96` s.
    #[test]
    fn equal_lags_are_as_uncertain_as_the_square_of_their_difference() {
        let mut after = covariance(1e-4, 1.0);
        PAIR.carry(&mut after, &[10.0, 6.0], &[8.0, 8.0]);
        let sum = after[0][0] + after[1][1] + 2.0 * after[0][1];
        assert!((sum / 1e-8 - 1.0).abs() < 1e-6, "{sum}");
        for i in 0..2 {
            let reach = Z_975 * after[i][i].sqrt();
            assert!((reach / Z_975.sqrt() - 1.0).abs() < 1e-3, "{reach}");
        }
        assert!((after[0][2] + after[1][2] - 1e-8).abs() < 1e-14, "what goes with the sum still does: {after:?}");
    }

    /// Energy `(S − 16)² + 2 (P − 60)`, whose minimum by its slope is not at 10 s and 6 s: by `S` and `P` it bends by the first term
    /// alone, and so it does by the lags once straightened.
    #[test]
    fn a_slope_is_no_curvature() {
        // Halves of the derivatives: (S − 16) + b, (S − 16) + a; the mixed second one has 1 of the product in it.
        let slope = [6.0, 10.0];
        let mut second = vec![vec![1.0, 2.0], vec![2.0, 1.0]];
        PAIR.straighten(&mut second, &slope, &[10.0, 6.0]);
        assert_eq!(second, vec![vec![1.0; 2]; 2]);
    }
}

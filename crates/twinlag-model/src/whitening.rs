//! Exact whitening of a disagreement whose noise is a sum of moving averages: `V = L Lᵀ`, banded, `r = L⁻¹ u`.
//!
//! In numbers that carry a derivative, factor and residual have theirs. Where every row of the covariance is the same
//! and no reading is masked, the rows of `L` settle after a few times the band, and the last one stands for all that
//! follow.

use crate::number::Real;
use crate::rows::Rows;

/// Rows of the factor in a row that must agree before it counts as settled: one more than a rounding that happens to
/// repeat, for the bands of all models here.
const SETTLED_ROWS: usize = 6;

/// Noise that enters the disagreement through rows of weights.
pub(crate) struct Source<'a, T> {
    pub(crate) rows: &'a Rows<T>,
    pub(crate) variance: Variance<'a>,
}

/// Variance of white noise, K².
#[derive(Clone, Copy)]
pub(crate) enum Variance<'a> {
    Same(f64),
    /// One for each sample.
    Each(&'a [f64]),
}

impl Variance<'_> {
    pub(crate) fn at(&self, sample: usize) -> f64 {
        match self {
            Self::Same(v) => *v,
            Self::Each(all) => all[sample.min(all.len() - 1)],
        }
    }
}

/// The factor `L` of a covariance: lags `0..=band` of each row, up to the one from which on all are the same.
#[derive(Clone, Debug)]
pub(crate) struct Factor<T> {
    band: usize,
    rows: Vec<T>,
    count: usize,
}

impl<T: Real> Factor<T> {
    pub(crate) fn empty() -> Self {
        Self { band: 0, rows: Vec::new(), count: 0 }
    }

    /// Becomes the factor of the covariance of `count` values, in its own memory.
    pub(crate) fn compute(&mut self, sources: &[Source<'_, T>], count: usize) {
        self.band = sources.iter().map(|s| s.rows.width).max().unwrap_or(1) - 1;
        let (band, stride) = (self.band, self.band + 1);
        let settles =
            sources.iter().all(|s| s.rows.is_same() && matches!(s.variance, Variance::Same(_))) && count > band;
        let mut agreeing = 0;
        self.rows.clear();
        self.count = 0;
        while self.count < count && agreeing < SETTLED_ROWS {
            let k = self.count;
            let from = k * stride;
            self.rows.resize(from + stride, T::from(0.0));
            let (before, row) = self.rows.split_at_mut(from);
            let reach = band.min(k);
            for lag in (0..=reach).rev() {
                // Row `band` of the covariance is that of all rows, where they are the same.
                let mut entry = covariance(sources, if settles { band } else { k }, lag);
                for older in lag + 1..=reach {
                    let other = if lag == 0 { row[older] } else { before[(k - lag) * stride + older - lag] };
                    entry -= row[older] * other;
                }
                row[lag] = if lag == 0 {
                    if entry.value() > f64::MIN_POSITIVE { entry.sqrt() } else { T::from(f64::MIN_POSITIVE.sqrt()) }
                } else {
                    entry / before[(k - lag) * stride]
                };
            }
            let scale = row[0];
            let agrees =
                settles && k > band && row.iter().zip(&before[from - stride..]).all(|(a, b)| a.agrees(*b, scale));
            agreeing = if agrees { agreeing + 1 } else { 0 };
            self.count += 1;
        }
    }

    /// Row `k` of `L`: the standard deviation of value `k` given those before it, then the lags.
    pub(crate) fn row(&self, k: usize) -> &[T] {
        let stride = self.band + 1;
        let from = k.min(self.count - 1) * stride;
        &self.rows[from..from + stride]
    }

    /// `L⁻¹ u` in place.
    pub(crate) fn whiten(&self, u: &mut [T]) {
        let band = self.band;
        for k in 0..u.len() {
            let row = self.row(k);
            let (before, rest) = u.split_at_mut(k);
            let mut r = rest[0];
            let reach = band.min(k);
            for lag in 1..=reach {
                r -= row[lag] * before[k - lag];
            }
            rest[0] = r / row[0];
        }
    }

    /// `L⁻ᵀ r` in place: of a whitened residual `V⁻¹ u`.
    pub(crate) fn unwhiten_transposed(&self, r: &mut [T]) {
        for k in (0..r.len()).rev() {
            let row = self.row(k);
            let (before, rest) = r.split_at_mut(k);
            let w = rest[0] / row[0];
            rest[0] = w;
            for lag in 1..=self.band.min(k) {
                before[k - lag] -= row[lag] * w;
            }
        }
    }
}

/// Covariance of value `k` with value `k − lag`.
fn covariance<T: Real>(sources: &[Source<'_, T>], k: usize, lag: usize) -> T {
    let mut sum = T::from(0.0);
    for Source { rows, variance } in sources {
        let (now, then) = (rows.at(k), rows.at(k - lag));
        if lag >= now.len() {
            continue;
        }
        let pairs = now.iter().zip(&then[lag..]);
        match variance {
            Variance::Same(variance) => {
                let mut products = T::from(0.0);
                pairs.for_each(|(a, b)| products += *a * *b);
                sum += products * *variance;
            }
            Variance::Each(_) => {
                let first = rows.start + k;
                pairs.enumerate().for_each(|(j, (a, b))| sum += *a * *b * variance.at(first + j));
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::{Along, Chain, Curves};
    use crate::dense;
    use crate::number::Number;
    use crate::observations::Stretch;

    const SAMPLES: usize = 40;

    fn through_lag<T: Real>(tau_s: T) -> Chain<T> {
        let time_s: Vec<f64> = (0..SAMPLES).map(|k| k as f64).collect();
        let reading: Vec<f64> = (0..SAMPLES).map(|k| (0.7 * k as f64).sin() + 0.01 * (k * k % 7) as f64).collect();
        let stretch = Stretch::new(time_s, [reading.clone(), reading]);
        let mut chain = Chain::of(&stretch, 0, Some(1.0));
        chain.factor(Along::Same(tau_s), Curves::default());
        chain
    }

    fn masked_variance() -> Vec<f64> {
        let mut variance = vec![0.04; SAMPLES];
        variance[17] = 1e3;
        variance
    }

    /// Factor and disagreement of two lags, one reading masked or none.
    fn two_lags<T: Real>(tau_s: [T; 2], is_masked: bool) -> (Vec<T>, Factor<T>) {
        let [one, two] = tau_s.map(through_lag);
        let variance = masked_variance();
        let second = if is_masked { Variance::Each(&variance) } else { Variance::Same(0.04) };
        let sources =
            [Source { rows: &one.rows, variance: Variance::Same(0.01) }, Source { rows: &two.rows, variance: second }];
        let mut factor = Factor::empty();
        factor.compute(&sources, one.len());
        let u = one.value.iter().zip(&two.value).map(|(a, b)| *a - *b).collect();
        (u, factor)
    }

    /// Rows of two lags on 40 samples, one reading masked: `rᵀr` is `uᵀ V⁻¹ u` with the dense matrix. Both are sums of
    /// 38 terms of size one: rounding leaves 1e-9.
    #[test]
    fn the_banded_factor_is_that_of_the_dense_matrix() {
        let (u, factor) = two_lags([3.0, 9.0], true);
        let mut whitened = u.clone();
        factor.whiten(&mut whitened);
        let (m, variance) = (u.len(), masked_variance());
        let dense_rows = |rows: &Rows<f64>| -> Vec<Vec<f64>> {
            (0..m)
                .map(|k| {
                    let mut row = vec![0.0; SAMPLES];
                    rows.at(k).iter().enumerate().for_each(|(j, c)| row[rows.start + k + j] = *c);
                    row
                })
                .collect()
        };
        let (a, b) = (dense_rows(&through_lag(3.0).rows), dense_rows(&through_lag(9.0).rows));
        let entry = |i: usize, j: usize| -> f64 {
            (0..SAMPLES).map(|k| 0.01 * a[i][k] * a[j][k] + variance[k] * b[i][k] * b[j][k]).sum()
        };
        let matrix: Vec<Vec<f64>> = (0..m).map(|i| (0..m).map(|j| entry(i, j)).collect()).collect();
        let inverse = dense::inverse(&matrix).expect("positive definite");
        let weighted = dense::times(&inverse, &u);
        let (energy, want) = (dense::dot(&whitened, &whitened), dense::dot(&u, &weighted));
        assert!((energy - want).abs() < 1e-9 * want, "got {energy}, want {want}");
        factor.unwhiten_transposed(&mut whitened);
        for (got, want) in whitened.iter().zip(weighted) {
            assert!((got - want).abs() < 1e-8 * (1.0 + want.abs()), "got {got}, want {want}");
        }
    }

    /// The derivative of each residual with respect to a time constant, against central differences of 1e-4 of it:
    /// their error is a third derivative times 1e-8, and rounding over the step, 1e-10 of residuals of size ten. With
    /// a masked reading the factor does not settle, without one it does.
    #[test]
    fn derivatives_of_the_residual_are_exact() {
        for is_masked in [false, true] {
            let residual = |tau_s: f64| {
                let (mut u, factor) = two_lags([tau_s, 9.0], is_masked);
                factor.whiten(&mut u);
                u
            };
            let (mut got, factor) = two_lags([Number::from(3.0).derivative(), Number::from(9.0)], is_masked);
            factor.whiten(&mut got);
            let step_s = 3e-4;
            let (above, below) = (residual(3.0 + step_s), residual(3.0 - step_s));
            for (k, got) in got.iter().enumerate() {
                let want = (above[k] - below[k]) / (2.0 * step_s);
                assert!((got.eps - want).abs() < 1e-6, "{is_masked}, residual {k}: got {}, want {want}", got.eps);
            }
        }
    }
}

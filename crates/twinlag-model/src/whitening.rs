//! Exact whitening of a disagreement whose noise is a sum of moving averages: `V = L Lᵀ`, banded, `r = L⁻¹ u`, and the
//! derivatives of `r` with respect to what moves `V` and `u`.
//!
//! Where every row of the covariance is the same and no reading is masked, the rows of `L` settle after a few times
//! the band, and the last one stands for all that follow; so do their derivatives.

use crate::number::{Number, Real};
use crate::rows::Rows;

/// Rows of the factor in a row that must agree before it counts as settled: one more than a rounding that happens to
/// repeat, for the bands of all models here.
const SETTLED_ROWS: usize = 6;
/// Relative difference that rounding makes.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Relative difference of derivatives that does not count: they enter a step of a solver, not an estimate.
const DERIVATIVE_ROUNDING: f64 = 1e-13;

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

/// Whether every row of the covariance of these sources is the same.
fn is_same<T: Real>(sources: &[Source<'_, T>]) -> bool {
    sources.iter().all(|s| s.rows.is_same() && matches!(s.variance, Variance::Same(_)))
}

/// The factor `L` of a covariance: lags `0..=band` of each row, up to the one from which on all are the same.
#[derive(Clone, Debug)]
pub(crate) struct Factor {
    band: usize,
    rows: Vec<f64>,
    count: usize,
    /// Entries of a row of the covariance, where all are the same.
    same: Vec<f64>,
}

impl Factor {
    pub(crate) fn empty() -> Self {
        Self { band: 0, rows: Vec::new(), count: 0, same: Vec::new() }
    }

    /// Becomes the factor of the covariance of `count` values, in its own memory.
    pub(crate) fn compute(&mut self, sources: &[Source<'_, f64>], count: usize) {
        self.band = sources.iter().map(|s| s.rows.width).max().unwrap_or(1) - 1;
        let (band, stride) = (self.band, self.band + 1);
        let settles = is_same(sources) && count > band;
        self.same.clear();
        if settles {
            self.same.extend((0..stride).map(|lag| covariance(sources, band, lag)));
        }
        let mut agreeing = 0;
        self.rows.clear();
        self.count = 0;
        while self.count < count && agreeing < SETTLED_ROWS {
            let k = self.count;
            let from = k * stride;
            self.rows.resize(from + stride, 0.0);
            let (before, row) = self.rows.split_at_mut(from);
            let reach = band.min(k);
            for lag in (0..=reach).rev() {
                let mut entry = if settles { self.same[lag] } else { covariance(sources, k, lag) };
                let other = if lag == 0 { &[][..] } else { &before[(k - lag) * stride..][..stride] };
                if lag == 0 {
                    entry -= row[1..=reach].iter().map(|l| l * l).sum::<f64>();
                    row[0] = entry.max(f64::MIN_POSITIVE).sqrt();
                } else {
                    let products = row[lag + 1..=reach].iter().zip(&other[1..]).map(|(a, b)| a * b);
                    entry -= products.sum::<f64>();
                    row[lag] = entry / other[0];
                }
            }
            let scale = row[0];
            let agrees = |(a, b): (&f64, &f64)| (a - b).abs() <= ROUNDING * scale;
            let has_settled = settles && k > band && row.iter().zip(&before[from - stride..]).all(agrees);
            agreeing = if has_settled { agreeing + 1 } else { 0 };
            self.count += 1;
        }
    }

    /// Row `k` of `L`: the standard deviation of value `k` given those before it, then the lags.
    pub(crate) fn row(&self, k: usize) -> &[f64] {
        let stride = self.band + 1;
        let from = k.min(self.count - 1) * stride;
        &self.rows[from..from + stride]
    }

    /// `L⁻¹ u` in place.
    pub(crate) fn whiten(&self, u: &mut [f64]) {
        for k in 0..u.len() {
            let row = self.row(k);
            let reach = self.band.min(k);
            let taken: f64 = row[1..=reach].iter().zip(u[..k].iter().rev()).map(|(l, r)| l * r).sum();
            u[k] = (u[k] - taken) / row[0];
        }
    }

    /// `L⁻ᵀ r` in place: of a whitened residual `V⁻¹ u`.
    pub(crate) fn unwhiten_transposed(&self, r: &mut [f64]) {
        for k in (0..r.len()).rev() {
            let row = self.row(k);
            let (before, rest) = r.split_at_mut(k);
            let w = rest[0] / row[0];
            rest[0] = w;
            for (b, l) in before.iter_mut().rev().zip(&row[1..]) {
                *b -= l * w;
            }
        }
    }
}

/// Memory for the derivative of a factor: its last rows, row `k` in place `k mod stride`.
#[derive(Clone, Debug, Default)]
pub(crate) struct FactorDerivative {
    recent: Vec<f64>,
    row: Vec<f64>,
    same: Vec<f64>,
}

impl FactorDerivative {
    /// The derivative of `r = L⁻¹ u`, in place of that of `u`: `L dr = du − dL r`, where `dL` follows from the
    /// derivative of `V = L Lᵀ` row by row.
    ///
    /// - `factor`: `L`
    /// - `sources`: what makes `V`, with the derivatives of the rows; a source whose rows have none may be left out
    /// - `residual`: `r`
    /// - `values`: the derivative of `u`, and then of `r`
    pub(crate) fn whiten(
        &mut self,
        factor: &Factor,
        sources: &[Source<'_, Number>],
        residual: &[f64],
        values: &mut [f64],
    ) {
        let (band, stride) = (factor.band, factor.band + 1);
        let settles = !factor.same.is_empty();
        self.recent.clear();
        self.recent.resize(stride * stride, 0.0);
        self.row.clear();
        self.row.resize(stride, 0.0);
        self.same.clear();
        if settles {
            self.same.extend((0..stride).map(|lag| derivative_of_covariance(sources, band, lag)));
        }
        let mut agreeing = 0;
        for k in 0..values.len() {
            let reach = band.min(k);
            let of_factor = factor.row(k);
            // Where the factor has settled, its derivative does soon after.
            if agreeing < SETTLED_ROWS {
                self.next_row(factor, sources, k, settles);
                let largest = self.row.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
                let before = &self.recent[(k + stride - 1) % stride * stride..][..stride];
                let agrees = |(a, b): (&f64, &f64)| (a - b).abs() <= DERIVATIVE_ROUNDING * largest;
                let has_settled = settles && k >= factor.count && self.row.iter().zip(before).all(agrees);
                agreeing = if has_settled { agreeing + 1 } else { 0 };
                self.recent[k % stride * stride..][..stride].copy_from_slice(&self.row);
            }
            let mut d = values[k] - self.row[0] * residual[k];
            let before = residual[..k].iter().rev().zip(values[..k].iter().rev());
            for ((l, dl), (r, dr)) in of_factor[1..=reach].iter().zip(&self.row[1..=reach]).zip(before) {
                d -= dl * r + l * dr;
            }
            values[k] = d / of_factor[0];
        }
    }

    /// Row `k` of `dL`.
    fn next_row(&mut self, factor: &Factor, sources: &[Source<'_, Number>], k: usize, settles: bool) {
        let stride = factor.band + 1;
        let reach = factor.band.min(k);
        let l = factor.row(k);
        for lag in (0..=reach).rev() {
            let mut entry = if settles { self.same[lag] } else { derivative_of_covariance(sources, k, lag) };
            if lag == 0 {
                let products = l[1..=reach].iter().zip(&self.row[1..=reach]).map(|(l, dl)| l * dl);
                entry -= 2.0 * products.sum::<f64>();
                self.row[0] = 0.5 * entry / l[0];
                continue;
            }
            let other = factor.row(k - lag);
            let d_other = &self.recent[(k - lag) % stride * stride..][..stride];
            for older in lag + 1..=reach {
                entry -= self.row[older] * other[older - lag] + l[older] * d_other[older - lag];
            }
            self.row[lag] = (entry - l[lag] * d_other[0]) / other[0];
        }
    }
}

/// Covariance of value `k` with value `k − lag`.
fn covariance(sources: &[Source<'_, f64>], k: usize, lag: usize) -> f64 {
    sum_over_readings(sources, k, lag, |a, b| a * b)
}

/// Derivative of the covariance of value `k` with value `k − lag`.
fn derivative_of_covariance(sources: &[Source<'_, Number>], k: usize, lag: usize) -> f64 {
    sum_over_readings(sources, k, lag, |a, b| a.eps * b.re + a.re * b.eps)
}

/// `Σ σ² product(weight in value k, weight in value k − lag)` over the readings that both have in common.
fn sum_over_readings<T: Real>(sources: &[Source<'_, T>], k: usize, lag: usize, product: impl Fn(T, T) -> f64) -> f64 {
    let mut sum = 0.0;
    for Source { rows, variance } in sources {
        let (now, then) = (rows.at(k), rows.at(k - lag));
        if lag >= now.len() {
            continue;
        }
        let products = now.iter().zip(&then[lag..]).map(|(a, b)| product(*a, *b));
        sum += match variance {
            Variance::Same(variance) => variance * products.sum::<f64>(),
            Variance::Each(_) => {
                let first = rows.start + k;
                products.enumerate().map(|(j, p)| p * variance.at(first + j)).sum()
            }
        };
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

    const SAMPLES: usize = 120;

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

    /// What brings noise into two chains, one reading masked or none.
    fn sources<'a, T: Real>(chains: &'a [Chain<T>; 2], masked: Option<&'a [f64]>) -> [Source<'a, T>; 2] {
        let second = masked.map_or(Variance::Same(0.04), Variance::Each);
        let [one, two] = chains;
        [Source { rows: &one.rows, variance: Variance::Same(0.01) }, Source { rows: &two.rows, variance: second }]
    }

    /// Factor and disagreement of two lags, one reading masked or none.
    fn two_lags(tau_s: [f64; 2], is_masked: bool) -> (Vec<f64>, Factor) {
        let chains = tau_s.map(through_lag);
        let variance = masked_variance();
        let mut factor = Factor::empty();
        factor.compute(&sources(&chains, is_masked.then_some(&variance[..])), chains[0].len());
        let u = chains[0].value.iter().zip(&chains[1].value).map(|(a, b)| *a - *b).collect();
        (u, factor)
    }

    /// Rows of two lags on 120 samples, one reading masked: `rᵀr` is `uᵀ V⁻¹ u` with the dense matrix. Both are sums of
    /// 118 terms of size one: rounding leaves 1e-9.
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
            let (mut whitened, factor) = two_lags([3.0, 9.0], is_masked);
            factor.whiten(&mut whitened);
            let chains = [Number::from(3.0).derivative(), Number::from(9.0)].map(through_lag);
            let variance = masked_variance();
            let sources = sources(&chains, is_masked.then_some(&variance[..]));
            let mut got: Vec<f64> = chains[0].value.iter().zip(&chains[1].value).map(|(a, b)| (a - b).eps).collect();
            FactorDerivative::default().whiten(&factor, &sources, &whitened, &mut got);
            let step_s = 3e-4;
            let (above, below) = (residual(3.0 + step_s), residual(3.0 - step_s));
            for (k, got) in got.iter().enumerate() {
                let want = (above[k] - below[k]) / (2.0 * step_s);
                assert!((got - want).abs() < 1e-6, "{is_masked}, residual {k}: got {got}, want {want}");
            }
        }
    }
}

//! Exact whitening of a disagreement whose noise is a sum of moving averages: `V = L Lᵀ`, banded, `r = L⁻¹ u`.

use crate::chain::Rows;

/// Relative difference that rounding makes.
const SAME: f64 = 4.0 * f64::EPSILON;
/// Rows of the factor in a row that must agree before it counts as settled.
const AGREEING: usize = 6;

/// Noise that enters the disagreement through rows of weights.
#[derive(Clone, Debug)]
pub struct Source {
    pub rows: Rows,
    pub variance: Variance,
}

/// Variance of white noise, K².
#[derive(Clone, Debug)]
pub enum Variance {
    Same(f64),
    /// One for each sample.
    Each(Vec<f64>),
}

impl Variance {
    pub fn at(&self, sample: usize) -> f64 {
        match self {
            Self::Same(v) => *v,
            Self::Each(all) => all[sample.min(all.len() - 1)],
        }
    }

    fn is_same(&self) -> bool {
        matches!(self, Self::Same(_))
    }
}

/// A whitened disagreement.
#[derive(Clone, Debug)]
pub struct Whitened {
    pub residual: Vec<f64>,
    pub log_determinant: f64,
    /// Standard deviation of each disagreement given those before it.
    pub diagonal: Vec<f64>,
    /// Rows of `L`, lags `0..=band`, if they were to be kept.
    factor: Vec<f64>,
    band: usize,
}

/// Covariance of value `k` with value `k − lag`.
fn covariance(sources: &[Source], k: usize, lag: usize) -> f64 {
    let mut sum = 0.0;
    for source in sources {
        let (now, then) = (source.rows.at(k), source.rows.at(k - lag));
        if lag >= now.len() {
            continue;
        }
        sum += match &source.variance {
            Variance::Same(v) => v * now.iter().zip(&then[lag..]).map(|(a, b)| a * b).sum::<f64>(),
            each @ Variance::Each(_) => {
                let first = source.rows.start + k;
                now.iter().zip(&then[lag..]).enumerate().map(|(j, (a, b))| a * b * each.at(first + j)).sum()
            }
        };
    }
    sum
}

pub fn whiten(u: &[f64], sources: &[Source], keep: bool) -> Whitened {
    let band = sources.iter().map(|s| s.rows.width).max().unwrap_or(1) - 1;
    let stride = band + 1;
    let is_same = sources.iter().all(|s| s.rows.is_same() && s.variance.is_same());
    let fixed: Vec<f64> = if is_same && u.len() > band {
        (0..stride).map(|lag| covariance(sources, band, lag)).collect()
    } else {
        Vec::new()
    };
    let mut residual = Vec::with_capacity(u.len());
    let mut diagonal = Vec::with_capacity(u.len());
    let mut log_determinant = 0.0;
    let mut kept = Vec::with_capacity(if keep { u.len() * stride } else { 0 });
    // The last rows of L: row k in place k mod stride.
    let mut recent = vec![0.0; stride * stride];
    let mut row = vec![0.0; stride];
    let mut agreeing = 0;
    for k in 0..u.len() {
        let reach = band.min(k);
        if agreeing < AGREEING {
            for lag in (0..=reach).rev() {
                let mut entry = if fixed.is_empty() { covariance(sources, k, lag) } else { fixed[lag] };
                for older in lag + 1..=reach {
                    let other = if lag == 0 { row[older] } else { recent[(k - lag) % stride * stride + older - lag] };
                    entry -= row[older] * other;
                }
                row[lag] = if lag == 0 {
                    entry.max(f64::MIN_POSITIVE).sqrt()
                } else {
                    entry / recent[(k - lag) % stride * stride]
                };
            }
            let agrees = !fixed.is_empty()
                && k > band
                && row.iter().zip(&recent[(k - 1) % stride * stride..]).all(|(a, b)| (a - b).abs() <= SAME * row[0]);
            agreeing = if agrees { agreeing + 1 } else { 0 };
            recent[k % stride * stride..][..stride].copy_from_slice(&row);
        }
        let mut r = u[k];
        for lag in 1..=reach {
            r -= row[lag] * residual[k - lag];
        }
        residual.push(r / row[0]);
        diagonal.push(row[0]);
        log_determinant += 2.0 * row[0].ln();
        if keep {
            kept.extend_from_slice(&row);
        }
    }
    Whitened { residual, log_determinant, diagonal, factor: kept, band }
}

impl Whitened {
    /// `V⁻¹ u = L⁻ᵀ r`, if the factor was kept.
    pub fn weighted(&self) -> Vec<f64> {
        let (n, stride) = (self.residual.len(), self.band + 1);
        let mut w = self.residual.clone();
        for k in (0..n).rev() {
            w[k] /= self.factor[k * stride];
            for lag in 1..=self.band.min(k) {
                w[k - lag] -= self.factor[k * stride + lag] * w[k];
            }
        }
        w
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::Chain;
    use crate::dense;
    use crate::observations::Stretch;

    /// Rows of two lags on 40 samples, one reading masked, one more source: `rᵀr` is `uᵀ V⁻¹ u` with the dense matrix, and the
    /// determinant that of its factor. Both are sums of 38 terms of size one: rounding leaves 1e-9.
    #[test]
    fn the_banded_factor_is_that_of_the_dense_matrix() {
        let n = 40;
        let time_s: Vec<f64> = (0..n).map(|k| k as f64).collect();
        let reading: Vec<f64> = (0..n).map(|k| (0.7 * k as f64).sin() + 0.01 * (k * k % 7) as f64).collect();
        let stretch = Stretch::new(time_s, [reading.clone(), reading]);
        let chain = |tau_s: f64| {
            let mut chain = Chain::of(&stretch, 0, Some(1.0));
            chain.factor(&crate::chain::Along::Same(tau_s), None, None);
            chain
        };
        let (one, two) = (chain(3.0), chain(9.0));
        let mut variance = vec![0.04; n];
        variance[17] = 1e3;
        let sources = [
            Source { rows: one.rows.clone(), variance: Variance::Same(0.01) },
            Source { rows: two.rows.clone(), variance: Variance::Each(variance.clone()) },
        ];
        let u: Vec<f64> = one.value.iter().zip(&two.value).map(|(a, b)| a - b).collect();
        let got = whiten(&u, &sources, true);

        let m = u.len();
        let dense_rows = |rows: &Rows| -> Vec<Vec<f64>> {
            (0..m)
                .map(|k| {
                    let mut row = vec![0.0; n];
                    rows.at(k).iter().enumerate().for_each(|(j, c)| row[rows.start + k + j] = *c);
                    row
                })
                .collect()
        };
        let (a, b) = (dense_rows(&one.rows), dense_rows(&two.rows));
        let matrix: Vec<Vec<f64>> = (0..m)
            .map(|i| {
                (0..m)
                    .map(|j| (0..n).map(|k| 0.01 * a[i][k] * a[j][k] + variance[k] * b[i][k] * b[j][k]).sum())
                    .collect()
            })
            .collect();
        let inverse = dense::inverse(&matrix).expect("positive definite");
        let want = dense::dot(&u, &dense::times(&inverse, &u));
        let energy = dense::dot(&got.residual, &got.residual);
        assert!((energy - want).abs() < 1e-9 * want, "got {energy}, want {want}");
        let weighted = got.weighted();
        for (got, want) in weighted.iter().zip(dense::times(&inverse, &u)) {
            assert!((got - want).abs() < 1e-8 * (1.0 + want.abs()), "got {got}, want {want}");
        }
    }
}

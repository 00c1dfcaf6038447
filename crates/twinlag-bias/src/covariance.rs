//! The covariance of the minimum of the published cost and its relatives, due to noise.
//!
//! `Cov = A⁻¹ M A⁻¹` with `A` half the Hessian of the summed cost and `M` the variance of half its
//! gradient, `Σ_k e[k] v_i[k]` with `v_i = ∂_i e` (less a multiple of `e` for the normalised cost).
//! `e` carries noise of both channels behind the synthetic filters, so
//! `M_ij = Σ_c s_c² (F_cᵀ v_i)·(F_cᵀ v_j) + n ⟨κ_i κ_j⟩`: the filters run backwards over `v` give
//! the noise of `e` its colour, and `κ_i(w) = E[U* V_i]` is what noise in `e` and noise in `v_i`
//! have in common.

use nalgebra::Complex;
use twinlag_cross_relation::{CostValue, CrossRelation, sandwich, synthetic_filter};

use crate::noise_gain::derivatives;

/// Covariance `[P][P]` of the minimum `theta` of a cost built on `cost`, zero for parameters not in
/// `free`.
///
/// - `at_minimum`: the cost that was minimised, with its Hessian, at `theta`
/// - `noise_std`: white noise levels `[s1, s2]`, K
/// - `pull`: for each parameter the multiple `c_i` of `e` in `v_i = ∂_i e − c_i e`: zero for the
///   plain and the compensated cost, half the logarithmic derivative of the denominator for the
///   normalised one
///
/// - `unit`: what turns the cost's Hessian into that of the mean square of `e`
///
/// `None` if the Hessian over the free parameters is not positive definite.
pub(crate) fn covariance<const P: usize>(
    cost: &CrossRelation<'_>,
    at_minimum: &CostValue<P>,
    unit: f64,
    theta: &[f64; P],
    free: &[usize],
    noise_std: [f64; 2],
    pull: &[f64; P],
) -> Option<[[f64; P]; P]> {
    let n = cost.counted() as f64;
    let models =
        [0, 1].map(|i| SyntheticFilter::of(theta[i], theta.get(4 + i).copied().unwrap_or(0.0), cost.period_s()));
    let gain = theta.get(2).copied().unwrap_or(1.0);
    let variance = [noise_std[0].powi(2), (noise_std[1] / gain).powi(2)];

    // Channel 1 goes through sensor 2's model, channel 2 through sensor 1's: the filter that
    // colours each channel's noise.
    let colour = [&models[1], &models[0]];
    let signal = cost.error_signal(theta);
    let backward: Vec<[Vec<f64>; 2]> = (0..P)
        .map(|i| {
            let v: Vec<f64> = signal.iter().map(|(e, de)| de[i] - pull[i] * e).collect();
            colour.map(|model| model.run_backwards(&v))
        })
        .collect();
    let common = noise_in_common(&models, gain, variance, pull);
    let middle = |i: usize, j: usize| -> f64 {
        let coloured: f64 = (0..2)
            .map(|c| variance[c] * backward[i][c].iter().zip(&backward[j][c]).map(|(a, b)| a * b).sum::<f64>())
            .sum();
        coloured + n * common[i][j]
    };
    let curvature = at_minimum.hessian.map(|row| row.map(|h| 0.5 * n * unit * h));
    let score = std::array::from_fn(|i| std::array::from_fn(|j| middle(i, j)));
    sandwich(&curvature, &score, free)
}

/// A synthetic filter `(n1 z⁻¹ + n2 z⁻²)/(1 + d1 z⁻¹ + d2 z⁻²)`, its coefficients' derivatives by
/// its two time constants, and its slowest pole.
struct SyntheticFilter {
    feed: [(f64, [f64; 2]); 2],
    back: [(f64, [f64; 2]); 2],
    slowest: f64,
}

impl SyntheticFilter {
    fn of(tau_s: f64, second_tau_s: f64, period_s: f64) -> Self {
        let filter = synthetic_filter(tau_s, second_tau_s, period_s);
        let parts = |c: usize| (filter.numerator[c], filter.denominator[c]);
        let [(n1, d1), (n2, d2)] = [parts(1), parts(2)];
        Self {
            feed: [n1, n2].map(|c| (c.re, derivatives(&c).0)),
            back: [d1, d2].map(|c| (c.re, derivatives(&c).0)),
            slowest: (-period_s / tau_s.max(second_tau_s)).exp(),
        }
    }

    /// The transpose of the filter applied to `v`, with its decay before the first sample.
    fn run_backwards(&self, v: &[f64]) -> Vec<f64> {
        let decay = (-40.0 / self.slowest.ln()).ceil().clamp(0.0, v.len() as f64) as usize;
        let n = v.len() + decay;
        let mut out = vec![0.0; n];
        let input = |k: usize| if k >= decay && k < n { v[k - decay] } else { 0.0 };
        for k in (0..n).rev() {
            let later = |j: usize| if k + j < n { out[k + j] } else { 0.0 };
            out[k] = self.feed[0].0 * input(k + 1) + self.feed[1].0 * input(k + 2)
                - self.back[0].0 * later(1)
                - self.back[1].0 * later(2);
        }
        out
    }

    /// Frequency response at the delay `z⁻¹ = exp(−jw)`, and its derivatives by both time
    /// constants.
    fn response(&self, delay: Complex<f64>) -> (Complex<f64>, [Complex<f64>; 2]) {
        let at = |c: [f64; 2]| delay * (delay * c[1] + c[0]);
        let below = at(self.back.map(|c| c.0)) + 1.0;
        let value = at(self.feed.map(|c| c.0)) / below;
        (value, [0, 1].map(|i| (at(self.feed.map(|c| c.1[i])) - value * at(self.back.map(|c| c.1[i]))) / below))
    }
}

/// Mean over frequency of `Re(κ_i κ_j)`.
fn noise_in_common<const P: usize>(
    models: &[SyntheticFilter; 2],
    gain: f64,
    variance: [f64; 2],
    pull: &[f64; P],
) -> [[f64; P]; P] {
    // The narrowest feature is 1 − p wide; 64 points across it.
    let narrowest = models.iter().map(|m| 1.0 - m.slowest).fold(1.0, f64::min);
    let points = (64.0 * std::f64::consts::PI / narrowest).clamp(1024.0, 131_072.0) as usize;
    let mut out = [[0.0; P]; P];
    for k in 0..points {
        let w = std::f64::consts::PI * (k as f64 + 0.5) / points as f64;
        let delay = Complex::from_polar(1.0, -w);
        let ((g1, [d1, e1]), (g2, [d2, e2])) = (models[0].response(delay), models[1].response(delay));
        let lambda = variance[0] * g2.norm_sqr() + variance[1] * g1.norm_sqr();
        let (of1, of2) = (g1.conj() * variance[1], g2.conj() * variance[0]);
        let shared = [of1 * d1, of2 * d2, -of1 * g1 / gain, Complex::default(), of1 * e1, of2 * e2];
        let kappa: [Complex<f64>; P] = std::array::from_fn(|i| shared[i] - pull[i] * lambda);
        for i in 0..P {
            for j in 0..P {
                out[i][j] += (kappa[i] * kappa[j]).re / points as f64;
            }
        }
    }
    out
}

//! What noise does to an estimate by the published cost and its relatives: the covariance of their minimum.
//!
//! `Cov = A⁻¹ M A⁻¹` with `A` half the Hessian of the summed cost and `M` the variance of half its gradient,
//! `Σ_k e[k] v_i[k]` with `v_i = ∂_i e` (less a multiple of `e` for the normalised cost). `e` carries noise of both channels
//! behind the synthetic filters, so `M_ij = Σ_c s_c² (F_cᵀ v_i)·(F_cᵀ v_j) + n ⟨κ_i κ_j⟩`: the filters run backwards over
//! `v` give the noise of `e` its colour, and `κ_i(w) = E[U* V_i]` is what noise in `e` and noise in `v_i` have in common.

use nalgebra::Complex;
use twinlag_cross_relation::{CostValue, CrossRelation, sandwich};

/// Covariance `[P][P]` of the minimum `theta` of a cost built on `cost`, zero for parameters not in `free`.
///
/// - `at_minimum`: the cost that was minimised, with its Hessian, at `theta`
/// - `noise_std`: white noise levels `[s1, s2]`, K
/// - `pull`: for each parameter the multiple `c_i` of `e` in `v_i = ∂_i e − c_i e`: zero for the plain and the compensated
///   cost, half the logarithmic derivative of the denominator for the normalised one
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
    let poles = [0, 1].map(|i| (-cost.period_s() / theta[i]).exp());
    let gain = theta.get(2).copied().unwrap_or(1.0);
    let variance = [noise_std[0].powi(2), (noise_std[1] / gain).powi(2)];

    // Channel 1 goes through sensor 2's model, channel 2 through sensor 1's: the pole that colours each channel's noise.
    let colour = [poles[1], poles[0]];
    let signal = cost.error_signal(theta);
    let backward: Vec<[Vec<f64>; 2]> = (0..P)
        .map(|i| {
            let v: Vec<f64> = signal.iter().map(|(e, de)| de[i] - pull[i] * e).collect();
            colour.map(|pole| run_backwards(&v, pole))
        })
        .collect();
    let common = noise_in_common(poles, gain, variance, theta, cost.period_s(), pull);
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

/// The transpose of the filter `(1 − p) z⁻¹/(1 − p z⁻¹)` applied to `v`, with its decay before the first sample.
fn run_backwards(v: &[f64], pole: f64) -> Vec<f64> {
    let decay = (-40.0 / pole.ln()).ceil().clamp(0.0, v.len() as f64) as usize;
    let mut out = vec![0.0; v.len() + decay];
    let mut state = 0.0;
    for k in (0..out.len()).rev() {
        out[k] = state;
        let input = if k >= decay { v[k - decay] } else { 0.0 };
        state = pole * state + (1.0 - pole) * input;
    }
    out
}

/// Mean over frequency of `Re(κ_i κ_j)`.
fn noise_in_common<const P: usize>(
    poles: [f64; 2],
    gain: f64,
    variance: [f64; 2],
    theta: &[f64; P],
    period_s: f64,
    pull: &[f64; P],
) -> [[f64; P]; P] {
    // The narrowest feature is 1 − p wide; 64 points across it.
    let narrowest = poles.iter().map(|p| 1.0 - p).fold(1.0, f64::min);
    let points = (64.0 * std::f64::consts::PI / narrowest).clamp(1024.0, 131_072.0) as usize;
    let mut out = [[0.0; P]; P];
    for k in 0..points {
        let w = std::f64::consts::PI * (k as f64 + 0.5) / points as f64;
        let delay = Complex::from_polar(1.0, -w);
        // Filter and its derivative with respect to the time constant.
        let filter = |i: usize| {
            let below = Complex::new(1.0, 0.0) - delay * poles[i];
            let by_pole = delay * (delay - 1.0) / (below * below);
            let value = delay * (1.0 - poles[i]) / below;
            (value, by_pole * (poles[i] * period_s / (theta[i] * theta[i])))
        };
        let ((g1, dg1), (g2, dg2)) = (filter(0), filter(1));
        let lambda = variance[0] * g2.norm_sqr() + variance[1] * g1.norm_sqr();
        let shared =
            [g1.conj() * dg1 * variance[1], g2.conj() * dg2 * variance[0], -g1.conj() * g1 * (variance[1] / gain)];
        let kappa: [Complex<f64>; P] =
            std::array::from_fn(|i| shared.get(i).copied().unwrap_or_default() - pull[i] * lambda);
        for i in 0..P {
            for j in 0..P {
                out[i][j] += (kappa[i] * kappa[j]).re / points as f64;
            }
        }
    }
    out
}

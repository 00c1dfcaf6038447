//! Evaluation on blocks that a fit has not used.
//!
//! A fit without one block is, to first order, `θ + (JᵀJ − J_bᵀJ_b)⁻¹ J_bᵀ r_b`, seen from the fit
//! of all: one linearisation gives the residual of every block as a fit without it would leave it.
//! Residuals next to a block, which share readings with it, are in neither.

use crate::blocks;
use crate::dense;
use crate::fit::Fitted;
use crate::observations::Observations;
use crate::policy::Policy;
use crate::selection::Selection;

/// Energy, per residual, of every fold as a fit without it leaves it.
pub fn held_out_energy(
    observations: &Observations,
    selection: &Selection,
    fitted: &Fitted,
    policy: &Policy,
) -> Option<f64> {
    let lin = fitted.model.linearised(&fitted.theta, observations, selection);
    let n = lin.samples.len();
    let p = lin.columns.len();
    let total = observations.samples().max(1);
    let gap = policy.block_gap_samples(total, policy.held_out_blocks);
    let fold_of = |sample: usize| blocks::fold(sample, total, policy);
    let matrix = |rows: &[usize]| -> Vec<Vec<f64>> {
        (0..p)
            .map(|a| (0..p).map(|b| rows.iter().map(|&k| lin.columns[a][k] * lin.columns[b][k]).sum()).collect())
            .collect()
    };
    let all: Vec<usize> = (0..lin.residual.len()).collect();
    let whole = matrix(&all);
    let gradient: Vec<f64> = lin.columns.iter().map(|c| dense::dot(c, &lin.residual)).collect();
    let (mut sum, mut count) = (0.0, 0usize);
    for fold in 0..policy.held_out_folds {
        let inside: Vec<usize> = (0..n).filter(|&k| fold_of(lin.samples[k]) == fold).collect();
        let near: Vec<usize> = (0..n)
            .filter(|&k| {
                let s = lin.samples[k];
                fold_of(s) != fold
                    && (fold_of(s.saturating_sub(gap)) == fold || fold_of((s + gap).min(total - 1)) == fold)
            })
            .collect();
        let out: Vec<usize> = inside.iter().chain(&near).copied().collect();
        let taken = matrix(&out);
        let mut left = whole.clone();
        for a in 0..p {
            for b in 0..p {
                left[a][b] -= taken[a][b];
            }
            // Where a fold takes all that is known of a parameter, it stays where it is.
            left[a][a] += 1e-3 * whole[a][a];
        }
        let inverse = dense::inverse(&left)?;
        let rest: Vec<f64> = (0..p)
            .map(|a| gradient[a] - out.iter().map(|&k| lin.columns[a][k] * lin.residual[k]).sum::<f64>())
            .collect();
        let step = dense::times(&inverse, &rest);
        for &k in &inside {
            let r = lin.residual[k] - (0..p).map(|a| lin.columns[a][k] * step[a]).sum::<f64>();
            sum += r * r;
            count += 1;
        }
    }
    (count > 0).then(|| sum / count as f64)
}

/// Nats that `after` saves against `before` on the blocks left out, the level of the noise free.
pub fn held_out_gain(
    observations: &Observations,
    selection: &Selection,
    before: &Fitted,
    after: &Fitted,
    policy: &Policy,
) -> f64 {
    let energy = |fitted| held_out_energy(observations, selection, fitted, policy);
    match (energy(before), energy(after)) {
        (Some(b), Some(a)) => 0.5 * after.count * (b / a).ln(),
        (None, Some(a)) => 0.5 * after.count * (before.mean_energy() * selection.weighting.mean() / a).ln(),
        _ => f64::NEG_INFINITY,
    }
}

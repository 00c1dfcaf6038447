//! Evaluation on blocks that a fit has not used.
//!
//! A fit without one block is, to first order, `θ + (JᵀJ − J_bᵀJ_b)⁻¹ J_bᵀ r_b`, seen from the fit
//! of all: one linearisation gives the residual of every block as a fit without it would leave it.
//! Residuals next to a block, which share readings with it, are in neither.

use crate::blocks;
use crate::dense;
use crate::fit::Fitted;
use crate::normal::NormalEquations;
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
    let total = observations.samples().max(1);
    let gap = policy.block_gap_samples(total, policy.held_out_blocks);
    let fold_of = |sample: usize| blocks::fold(sample, total, policy);
    let lin = fitted.model.linearised(&fitted.theta, observations, selection);
    let sums = |rows: &mut dyn Iterator<Item = usize>| {
        let mut sums = NormalEquations::none(lin.columns.len());
        rows.for_each(|k| sums.add(&lin, k));
        sums
    };
    let of_samples = |is_of: &dyn Fn(usize) -> bool| {
        sums(&mut lin.samples.iter().enumerate().filter(|(_, sample)| is_of(*sample)).map(|(k, _)| k))
    };
    // What is known beforehand is in no fold.
    let whole = NormalEquations::of(&lin, lin.residual.len());
    let (mut energy, mut count) = (0.0, 0);
    for fold in 0..policy.held_out_folds {
        let inside = of_samples(&|s| fold_of(s) == fold);
        let near = of_samples(&|s| {
            fold_of(s) != fold && (fold_of(s.saturating_sub(gap)) == fold || fold_of((s + gap).min(total - 1)) == fold)
        });
        energy += energy_after(&inside, &step_without(&whole, &[&inside, &near])?);
        count += inside.count;
    }
    (count > 0).then(|| energy / count as f64)
}

/// The step, to be subtracted, that a fit to all without `parts` takes.
fn step_without(all: &NormalEquations, parts: &[&NormalEquations]) -> Option<Vec<f64>> {
    let (mut products, mut slope) = (all.products.clone(), all.slope.clone());
    for a in 0..slope.len() {
        for part in parts {
            slope[a] -= part.slope[a];
            products[a].iter_mut().zip(&part.products[a]).for_each(|(all, taken)| *all -= taken);
        }
        // Where a fold takes all that is known of a parameter, it stays where it is.
        products[a][a] += 1e-3 * all.products[a][a];
    }
    Some(dense::times(&dense::inverse(&products)?, &slope))
}

/// Energy of residuals after a step.
fn energy_after(of: &NormalEquations, step: &[f64]) -> f64 {
    of.energy - 2.0 * dense::dot(step, &of.slope) + dense::dot(step, &dense::times(&of.products, step))
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

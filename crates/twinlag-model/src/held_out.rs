//! Evaluation on blocks that a fit has not used.
//!
//! A fit without one block is, to first order, `θ + (JᵀJ − J_bᵀJ_b)⁻¹ J_bᵀ r_b`, seen from the fit
//! of all: one linearisation gives the residual of every block as a fit without it would leave it.
//! Residuals next to a block, which share readings with it, are in neither.

use crate::blocks;
use crate::cost::Linearised;
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
    let total = observations.samples().max(1);
    let gap = policy.block_gap_samples(total, policy.held_out_blocks);
    let fold_of = |sample: usize| blocks::fold(sample, total, policy);
    let lin = fitted.model.linearised(&fitted.theta, observations, selection);
    let sums = |is_of: &dyn Fn(usize) -> bool| {
        let mut sums = FoldSums::of(lin.columns.len());
        let rows = (0..lin.samples.len()).filter(|&k| is_of(lin.samples[k]));
        rows.for_each(|k| sums.add(&lin, k));
        sums
    };
    let whole = FoldSums::of_all(&lin);
    let (mut energy, mut count) = (0.0, 0);
    for fold in 0..policy.held_out_folds {
        let inside = sums(&|s| fold_of(s) == fold);
        let near = sums(&|s| {
            fold_of(s) != fold && (fold_of(s.saturating_sub(gap)) == fold || fold_of((s + gap).min(total - 1)) == fold)
        });
        energy += inside.energy_after(&whole.step_without(&[&inside, &near])?);
        count += inside.count;
    }
    (count > 0).then(|| energy / count as f64)
}

/// Sums over some residuals and their derivatives.
struct FoldSums {
    energy: f64,
    count: usize,
    slope: Vec<f64>,
    products: Vec<Vec<f64>>,
}

impl FoldSums {
    fn of(parameters: usize) -> Self {
        let products = vec![vec![0.0; parameters]; parameters];
        Self { energy: 0.0, count: 0, slope: vec![0.0; parameters], products }
    }

    /// Of all, and what is known beforehand.
    fn of_all(lin: &Linearised) -> Self {
        let mut out = Self::of(lin.columns.len());
        (0..lin.residual.len()).for_each(|k| out.add(lin, k));
        out
    }

    fn add(&mut self, lin: &Linearised, k: usize) {
        let r = lin.residual[k];
        self.energy += r * r;
        self.count += 1;
        for (a, (slope, products)) in self.slope.iter_mut().zip(&mut self.products).enumerate() {
            let of_a = lin.columns[a][k];
            *slope += of_a * r;
            products.iter_mut().zip(&lin.columns).for_each(|(sum, of_b)| *sum += of_a * of_b[k]);
        }
    }

    /// The step, to be subtracted, that a fit without `parts` takes.
    fn step_without(&self, parts: &[&Self]) -> Option<Vec<f64>> {
        let (mut products, mut slope) = (self.products.clone(), self.slope.clone());
        for a in 0..slope.len() {
            for part in parts {
                slope[a] -= part.slope[a];
                products[a].iter_mut().zip(&part.products[a]).for_each(|(all, taken)| *all -= taken);
            }
            // Where a fold takes all that is known of a parameter, it stays where it is.
            products[a][a] += 1e-3 * self.products[a][a];
        }
        Some(dense::times(&dense::inverse(&products)?, &slope))
    }

    /// Energy of these residuals after a step.
    fn energy_after(&self, step: &[f64]) -> f64 {
        self.energy - 2.0 * dense::dot(step, &self.slope) + dense::dot(step, &dense::times(&self.products, step))
    }
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

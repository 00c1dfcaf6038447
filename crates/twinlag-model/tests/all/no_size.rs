//! Effects of no size: with one the residual is what it is without.

use std::collections::BTreeSet;

use twinlag_model::{Identifier, Model, Shared, candidates};

use crate::turbulent::{NOISE_K, TAU_S, record};

/// Energy that may enter or leave at the ends where an effect whitens the residual by another filter of the same spectrum: that of as many
/// residuals as it reaches over, of which each has the mean 1.
const AT_THE_ENDS: f64 = 10.0;

/// Values with which an effect changes nothing, or as little as it may; none of an effect that has no size.
fn of_no_size(effect: &Shared) -> Option<Vec<f64>> {
    let main = effect.main()?;
    let least = |(i, start): (usize, f64)| {
        let parameter = &effect.parameters()[i];
        parameter.neutral().unwrap_or(if i == main { parameter.variable.lower } else { start })
    };
    Some(effect.starts().remove(0).into_iter().enumerate().map(least).collect())
}

/// Effects that move or weigh readings leave each residual as it is, to the rounding of readings of 300 °C whose differences are multiplied
/// by `τ/Ts`: 300 × 60 × 2e-16 / 0.1 for the noise is 4e-11. Those that are filters of their own leave the energy, and so do those that
/// cannot be smaller than a lower bound.
#[test]
fn an_effect_of_no_size_changes_nothing() {
    let record = record();
    let mut context = record.context.clone();
    context.tau_s = TAU_S;
    let residual =
        |model: &Model, theta: &[f64]| model.linearised(theta, &record.observations, &record.everything).residual;
    let energy = |residual: &[f64]| residual.iter().map(|r| r * r).sum::<f64>();
    let plain = Model::new(&[], [NOISE_K; 2]);
    let without = residual(&plain, &TAU_S);
    let filters = [Identifier::DELAY, Identifier::SECOND_ORDER, Identifier::SLOW_MODE];
    let mut seen = BTreeSet::new();
    for effect in candidates(&Identifier::ALL, &context) {
        let Some(values) = of_no_size(&effect) else { continue };
        let theta: Vec<f64> = TAU_S.into_iter().chain(values).collect();
        let with = residual(&plain.with(effect.clone()), &theta);
        let identifier = effect.identifier();
        let is_neutral = effect.main().is_some_and(|main| effect.parameters()[main].neutral().is_some());
        seen.insert(identifier.about().name);
        if is_neutral && !filters.contains(&identifier) {
            let most = with.iter().zip(&without).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(most < 4e-11 && with.len() == without.len(), "{identifier}: {most:.1e}");
        } else {
            let change = energy(&with) - energy(&without);
            assert!(change.abs() < AT_THE_ENDS, "{identifier} in {:?}: {change}", effect.channel());
        }
    }
    assert!(seen.len() >= 10, "{seen:?}");
}

//! By how much the energies of two fits to a record differ by chance.

use crate::dense::dot;
use crate::fit::Fitted;
use crate::observations::Observations;
use crate::selection::Selection;

/// The standard deviation by which the energies of two fits to one record differ by chance, where both leave nothing but white noise.
///
/// It is `2 √(n (1 − Σ ρ²))` in units of the variance of a residual, for `n` degrees of freedom and the correlations `ρ` of the residuals at all
/// shifts between them (Isserlis): a delay moves the noise of one channel alone, so that no single shift aligns them. Shifts are as long as
/// two delays may be apart; by chance each of them adds `1/n`, which is taken off.
pub fn energy_difference_std(one: &Fitted, other: &Fitted, observations: &Observations, selection: &Selection) -> f64 {
    let [a, b] = [one, other].map(|fitted| {
        let lin = fitted.model.linearised(&fitted.theta, observations, selection);
        let mut by_sample = vec![0.0; observations.samples()];
        lin.samples.iter().zip(&lin.residual).for_each(|(sample, residual)| by_sample[sample] = *residual);
        by_sample
    });
    2.0 * (one.count * (1.0 - shared(&a, &b, 2 * observations.reach())).max(0.0)).sqrt()
}

/// `Σ ρ²` over shifts of up to so many samples either way, without what chance adds.
fn shared(a: &[f64], b: &[f64], most: usize) -> f64 {
    let energies = dot(a, a) * dot(b, b);
    let most = most.min(a.len().saturating_sub(1));
    let products = (0..=most).map(|by| {
        let [later, earlier] = [dot(&a[by..], &b[..b.len() - by]), dot(&a[..a.len() - by], &b[by..])];
        if by == 0 { later * later } else { later * later + earlier * earlier }
    });
    let by_chance = (2 * most + 1) as f64 / a.len().max(1) as f64;
    (products.sum::<f64>() / energies - by_chance).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLES: usize = 20_000;

    /// White and uniform, from a linear congruential generator.
    fn noise(mut state: u64) -> Vec<f64> {
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..SAMPLES).map(|_| next()).collect()
    }

    /// Two noises as loud as each other, the second five samples later in one sum than in the other: each is half the energy, so that
    /// `ρ` is a half at two shifts. `Σ ρ²` of 41 shifts has a standard error of some `√(2 · 0.5/n + 2 · 41/n²)`, 0.7 %: four of these.
    #[test]
    fn noise_that_moves_is_still_shared() {
        let [one, other] = [noise(1), noise(2)];
        let sum = |by: usize| -> Vec<f64> { (5..SAMPLES - 5).map(|k| one[k] + other[k - by]).collect() };
        let [here, later] = [sum(0), sum(5)];
        assert!((shared(&here, &later, 20) - 0.5).abs() < 0.03, "{}", shared(&here, &later, 20));
        assert!((shared(&here, &here, 20) - 1.0).abs() < 0.03);
        assert!(shared(&one, &other, 20) < 0.03);
    }
}

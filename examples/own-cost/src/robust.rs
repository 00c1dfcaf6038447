//! The cross-relation cost with a loss that grows no faster than the error itself where that is large.

use twinlag_cross_relation::CrossRelation;
use twinlag_optimise::{Cost, Derivatives};

// ANCHOR: cost
/// `J = Σ 2δ² (√(1 + (e/δ)²) − 1)` over the error signal `e = G2 y1 − G1 y2`: about `e²` where `e` is small beside `δ`, about
/// `2δ|e|` where it is large (the pseudo-Huber loss). A glitch then counts once and not squared.
pub(crate) struct Robust<'a> {
    pub(crate) cost: CrossRelation<'a>,
    /// `δ`, K: what is still an ordinary error.
    pub(crate) ordinary_k: f64,
}

impl Cost for Robust<'_> {
    fn value(&self, tau_s: &[f64]) -> f64 {
        let square = |e: f64| (e / self.ordinary_k).powi(2);
        let loss = |e: f64| square(e) / (1.0 + (1.0 + square(e)).sqrt()); // = √(1 + s) − 1, which would cancel
        let errors = self.cost.error_signal(&[tau_s[0], tau_s[1]]);
        2.0 * self.ordinary_k.powi(2) * errors.iter().map(|(e, _)| loss(*e)).sum::<f64>()
    }

    fn derivatives(&self, tau_s: &[f64]) -> Option<Derivatives> {
        let mut d = Derivatives { value: self.value(tau_s), gradient: vec![0.0; 2], curvature: vec![vec![0.0; 2]; 2] };
        for (e, slope) in self.cost.error_signal(&[tau_s[0], tau_s[1]]) {
            // dJ/de = 2 w e. Of the curvature the part that needs no second derivative of `e`, with the weight held: positive.
            let weight = 1.0 / (1.0 + (e / self.ordinary_k).powi(2)).sqrt();
            for i in 0..2 {
                d.gradient[i] += 2.0 * weight * e * slope[i];
                for j in 0..2 {
                    d.curvature[i][j] += 2.0 * weight * slope[i] * slope[j];
                }
            }
        }
        Some(d)
    }
}
// ANCHOR_END: cost

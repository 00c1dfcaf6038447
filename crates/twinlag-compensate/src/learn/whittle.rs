//! Whittle's likelihood of a periodogram, with that of the noise in it.

use nalgebra::DMatrix;
use twinlag_optimise::{Cost, Derivatives};

use super::part::{self, Part};
use crate::prior::Term;
use crate::spectrum::Periodogram;

/// Neighbouring bins of a periodogram with Hann's taper go together: this many are worth one,
/// `1 + 2 ((2/3)² + (1/6)²)`.
pub(super) const BINS_PER_ONE: f64 = 1.944;
/// Step of a logarithm in differences.
const STEP: f64 = 1e-4;
/// Prior standard deviation of the logarithm of each number: numbers that the readings do not
/// determine are known within a factor of e.
const LOG_STD: f64 = 1.0;

/// Twice the negative logarithm of Whittle's likelihood.
pub(super) struct Whittle<'a> {
    pub(super) periodogram: &'a Periodogram,
    /// Power that is expected of everything else.
    pub(super) others: &'a [f64],
    pub(super) parts: &'a [Part],
}

impl Whittle<'_> {
    /// Fisher's information of the logarithms of the numbers, including their prior; the deviance
    /// is twice the logarithm of the likelihood.
    pub(super) fn information(&self) -> Option<DMatrix<f64>> {
        let values: Vec<f64> = self.parts.iter().flat_map(Part::values).collect();
        let derivatives = self.derivatives(&values)?;
        Some(DMatrix::from_fn(values.len(), values.len(), |a, b| {
            let told = derivatives.curvature[a][b] * values[a] * values[b] / (2.0 * BINS_PER_ONE);
            told + if a == b { 1.0 / (LOG_STD * LOG_STD) } else { 0.0 }
        }))
    }

    /// `ln det(1 + σ² I)`, `I` the information, `σ` how well each logarithm was known before.
    pub(super) fn cost(&self) -> f64 {
        let Some(factor) = self.information().and_then(DMatrix::cholesky) else { return f64::INFINITY };
        2.0 * factor.l_dirty().diagonal().iter().map(|d| (d * LOG_STD).ln()).sum::<f64>()
    }

    fn deviance(&self, expected: &[f64]) -> f64 {
        let sum: f64 = expected.iter().zip(&self.periodogram.power).map(|(e, i)| e.ln() + i / e).sum();
        2.0 * self.periodogram.pieces * sum
    }
}

impl Periodogram {
    /// What `parts` add to it.
    pub(super) fn of_parts(&self, parts: &[Part]) -> Vec<f64> {
        let terms: Vec<Term> = parts.iter().flat_map(Part::terms).collect();
        let mut out = if terms.is_empty() { vec![0.0; self.power.len()] } else { self.expected(&terms) };
        for factors in parts.iter().filter_map(Part::noise) {
            out.iter_mut().zip(self.of_noise(factors)).for_each(|(sum, noise)| *sum += noise);
        }
        out
    }

    pub(super) fn of_noise(&self, [first, second]: [f64; 2]) -> Vec<f64> {
        self.noise[0].iter().zip(&self.noise[1]).map(|(a, b)| first * a + second * b).collect()
    }

    /// The deviance of `factors` of the noise, from the disagreement of both sensors and the prior
    /// of the noise, with gradient and curvature.
    pub(super) fn of_factors(&self, factors: [f64; 2]) -> (f64, [f64; 2], [[f64; 2]; 2]) {
        let prior = BINS_PER_ONE / (LOG_STD * LOG_STD);
        let mut value: f64 = factors.iter().map(|v| prior * v.ln().powi(2)).sum();
        let mut gradient = factors.map(|v| 2.0 * prior * v.ln() / v);
        let mut curvature = [[2.0 * prior / factors[0].powi(2), 0.0], [0.0, 2.0 * prior / factors[1].powi(2)]];
        for &[power, first] in &self.disagreement {
            let shares = [first, 1.0 - first];
            let expected = shares[0] * factors[0] + shares[1] * factors[1];
            value += 2.0 * self.pieces * (expected.ln() + power / expected);
            let slopes = shares.map(|s| s / expected);
            for a in 0..2 {
                gradient[a] += 2.0 * self.pieces * slopes[a] * (1.0 - power / expected);
                for b in 0..2 {
                    curvature[a][b] += 2.0 * self.pieces * slopes[a] * slopes[b];
                }
            }
        }
        (value, gradient, curvature)
    }
}

impl Cost for Whittle<'_> {
    fn value(&self, x: &[f64]) -> f64 {
        let parts = part::with(self.parts, x);
        let own = self.periodogram.of_parts(&parts);
        let of_noise: f64 = parts.iter().filter_map(Part::noise).map(|f| self.periodogram.of_factors(f).0).sum();
        of_noise + self.deviance(&self.others.iter().zip(own).map(|(a, b)| a + b).collect::<Vec<f64>>())
    }

    /// Fisher's scoring: the curvature is its expectation, `2 Σ ∂_a ln P ∂_b ln P`.
    fn derivatives(&self, x: &[f64]) -> Option<Derivatives> {
        let p = self.periodogram;
        let parts = part::with(self.parts, x);
        let mut expected = self.others.to_vec();
        let mut slopes: Vec<Vec<f64>> = Vec::new();
        for part in &parts {
            if let Some(factors) = part.noise() {
                expected.iter_mut().zip(p.of_noise(factors)).for_each(|(sum, noise)| *sum += noise);
                slopes.extend(p.noise.clone());
                continue;
            }
            let each: Vec<Vec<f64>> = part.terms().iter().map(|t| p.expected(&[*t])).collect();
            let mut own = vec![0.0; expected.len()];
            for line in &each {
                own.iter_mut().zip(line).for_each(|(sum, p)| *sum += p);
            }
            expected.iter_mut().zip(&own).for_each(|(sum, p)| *sum += p);
            let values = part.values();
            for (a, value) in values.iter().enumerate() {
                slopes.push(if let Some(term) = part.size_of(a) {
                    each[term].iter().map(|p| 2.0 * p / value).collect()
                } else {
                    let mut moved = values.clone();
                    moved[a] *= STEP.exp();
                    let moved = p.expected(&part::with(std::slice::from_ref(part), &moved)[0].terms());
                    moved.iter().zip(&own).map(|(b, a)| (b - a) / (STEP.exp_m1() * value)).collect()
                });
            }
        }
        for slope in &mut slopes {
            slope.iter_mut().zip(&expected).for_each(|(s, e)| *s /= e);
        }
        let residual: Vec<f64> = p.power.iter().zip(&expected).map(|(i, e)| 1.0 - i / e).collect();
        let dot = |a: &[f64], b: &[f64]| 2.0 * p.pieces * a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut out = Derivatives {
            value: self.deviance(&expected),
            gradient: slopes.iter().map(|s| dot(s, &residual)).collect(),
            curvature: slopes.iter().map(|a| slopes.iter().map(|b| dot(a, b)).collect()).collect(),
        };
        let mut at = 0;
        for part in &parts {
            if let Some(factors) = part.noise() {
                let (value, gradient, curvature) = p.of_factors(factors);
                out.value += value;
                for a in 0..2 {
                    out.gradient[at + a] += gradient[a];
                    for b in 0..2 {
                        out.curvature[at + a][at + b] += curvature[a][b];
                    }
                }
            }
            at += part.values().len();
        }
        Some(out)
    }
}

//! Whittle's likelihood of a periodogram, with that of the noise in it.

use nalgebra::DMatrix;
use rayon::prelude::*;
use twinlag_optimise::{Cost, Derivatives};

use super::part::{self, Direction, Part};
use crate::prior::Term;
use crate::spectrum::Periodogram;

/// Neighbouring bins of a periodogram with Hann's taper go together: this many are worth one,
/// `1 + 2 ((2/3)² + (1/6)²)`.
pub(super) const BINS_PER_ONE: f64 = 1.944;
/// Prior standard deviation of the logarithm of each number: numbers that the readings do not
/// determine are known within a factor of e.
const LOG_STD: f64 = 1.0;

/// Odds against a comb before the readings: it may begin anywhere, end after any line or go on, and have lines of any size, of which a
/// factor of e for each number says little. Chosen: a comb of chance gains less (test `chance_is_not_learned_as_a_comb`).
const ODDS_AGAINST_COMB: f64 = 1000.0;

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

    /// `ln det(1 + σ² I)`, `I` the information, `σ` how well each logarithm was known before; and what combs cost by themselves.
    pub(super) fn cost(&self) -> f64 {
        let Some(factor) = self.information().and_then(DMatrix::cholesky) else { return f64::INFINITY };
        let of_numbers = 2.0 * factor.l_dirty().diagonal().iter().map(|d| (d * LOG_STD).ln()).sum::<f64>();
        let combs = self.parts.iter().filter(|part| part.is_comb()).count();
        of_numbers + 2.0 * ODDS_AGAINST_COMB.ln() * combs as f64
    }

    fn deviance(&self, expected: &[f64]) -> f64 {
        let p = self.periodogram;
        let each = expected.iter().zip(&p.power).zip(&p.bins).map(|((e, i), bins)| bins * (e.ln() + i / e));
        2.0 * p.pieces * each.sum::<f64>()
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
        let mut value = BINS_PER_ONE * noise_score(factors);
        let mut gradient = factors.map(|v| 2.0 * prior * v.ln() / v);
        let mut curvature = [[2.0 * prior / factors[0].powi(2), 0.0], [0.0, 2.0 * prior / factors[1].powi(2)]];
        let skipped = self.bins.len() - self.disagreement.len();
        for (&[power, first], bins) in self.disagreement.iter().zip(&self.bins[skipped..]) {
            let shares = [first, 1.0 - first];
            let expected = shares[0] * factors[0] + shares[1] * factors[1];
            let worth = 2.0 * self.pieces * bins;
            value += worth * (expected.ln() + power / expected);
            let slopes = shares.map(|s| s / expected);
            for a in 0..2 {
                gradient[a] += worth * slopes[a] * (1.0 - power / expected);
                for b in 0..2 {
                    curvature[a][b] += worth * slopes[a] * slopes[b];
                }
            }
        }
        (value, gradient, curvature)
    }
}

/// Twice the logarithm of how much less probable factors of the noise are than ones, before there are readings.
pub(super) fn noise_score(factors: [f64; 2]) -> f64 {
    factors.iter().map(|factor| (factor.ln() / LOG_STD).powi(2)).sum()
}

fn add(sums: &mut [f64], terms: &[f64]) {
    sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
}

impl Cost for Whittle<'_> {
    fn value(&self, x: &[f64]) -> f64 {
        let parts = part::with(self.parts, x);
        let own = self.periodogram.of_parts(&parts);
        let of_noise: f64 = parts.iter().filter_map(Part::noise).map(|f| self.periodogram.of_factors(f).0).sum();
        of_noise + self.deviance(&self.others.iter().zip(own).map(|(a, b)| a + b).collect::<Vec<f64>>())
    }

    /// Value and gradient are exact. Fisher's scoring: the curvature is its expectation, `2 Σ ∂_a
    /// ln P ∂_b ln P`.
    fn derivatives(&self, x: &[f64]) -> Option<Derivatives> {
        let p = self.periodogram;
        let parts = part::with(self.parts, x);
        let mut gas = vec![0.0; p.power.len()];
        let mut of_noise = gas.clone();
        let mut slopes: Vec<Vec<f64>> = Vec::new();
        let terms: Vec<Term> = parts.iter().flat_map(Part::terms).collect();
        let shown: Vec<Vec<[f64; 4]>> = terms.par_iter().map(|term| p.shown(term)).collect();
        let mut rest = &shown[..];
        for part in &parts {
            if let Some(factors) = part.noise() {
                add(&mut of_noise, &p.of_noise(factors));
                slopes.extend(p.noise.clone());
                continue;
            }
            let (each, others) = rest.split_at(part.terms().len());
            rest = others;
            each.iter().for_each(|own| gas.iter_mut().zip(own).for_each(|(sum, [value, ..])| *sum += value));
            slopes.extend((0..part.values().len()).map(|a| {
                let directions = part.directions(a);
                let along = |j: usize| {
                    let of = |(term, by): &Direction| (0..3).map(|i| by[i] * each[*term][j][1 + i]).sum::<f64>();
                    directions.iter().map(of).sum()
                };
                (0..gas.len()).map(along).collect()
            }));
        }
        // Of the gas there cannot be less than nothing, and where there is nothing, nothing
        // changes.
        let of_gas =
            slopes.iter_mut().zip(parts.iter().flat_map(|part| vec![part.noise().is_none(); part.values().len()]));
        for (slope, _) in of_gas.filter(|(_, is_of_gas)| *is_of_gas) {
            slope.iter_mut().zip(&gas).filter(|(_, sum)| **sum < 0.0).for_each(|(s, _)| *s = 0.0);
        }
        let terms = self.others.iter().zip(&gas).zip(&of_noise);
        let expected: Vec<f64> = terms.map(|((other, gas), noise)| other + gas.max(0.0) + noise).collect();
        for slope in &mut slopes {
            slope.iter_mut().zip(&expected).for_each(|(s, e)| *s /= e);
        }
        let residual: Vec<f64> = p.power.iter().zip(&expected).map(|(i, e)| 1.0 - i / e).collect();
        let dot = |a: &[f64], b: &[f64]| 2.0 * p.pieces * a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let weighted = |s: &Vec<f64>| s.iter().zip(&p.bins).map(|(s, bins)| s * bins).collect::<Vec<f64>>();
        let of_bins: Vec<Vec<f64>> = slopes.iter().map(weighted).collect();
        let mut out = Derivatives {
            value: self.deviance(&expected),
            gradient: of_bins.iter().map(|s| dot(s, &residual)).collect(),
            curvature: of_bins.par_iter().map(|a| slopes.iter().map(|b| dot(a, b)).collect()).collect(),
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

#[cfg(test)]
mod tests {
    use finitediff::vec::central_diff;

    use super::*;
    use crate::{Readings, Rig, Sensor};

    const STD_K: [f64; 2] = [0.05, 0.08];
    const PERIOD_S: f64 = 0.005;

    /// Of 800 samples of two tones, the second channel slower, with a disturbance on each.
    fn periodogram() -> Periodogram {
        let time_s: Vec<f64> = (0..800).map(|k| PERIOD_S * f64::from(k)).collect();
        let reading = |lag_s: f64, wobble: f64| -> Vec<f64> {
            let tones = |t: f64| 8.0 * (9.0 * (t - lag_s)).sin() + 3.0 * (31.0 * (t - lag_s)).cos();
            time_s.iter().map(|t| 300.0 + tones(*t) + 0.08 * (wobble * t * t).sin()).collect()
        };
        let readings = Readings::new(time_s.clone(), [reading(0.02, 170.0), reading(0.1, 230.0)]).expect("readings");
        let rig = Rig::new([Sensor::new(0.02, STD_K[0]), Sensor::new(0.1, STD_K[1])]);
        Periodogram::of(&readings, &rig, 300.0, 16384)
    }

    fn parts() -> Vec<Vec<Part>> {
        let resonance = |quality| Part::Single(Term::Resonance { std_k: 3.0, frequency_hz: 4.0, quality });
        let comb = |std_k: &[f64], width_hz, goes_on| Part::Comb {
            frequency_hz: 7.0,
            width_hz,
            std_k: std_k.to_vec(),
            goes_on,
        };
        vec![
            vec![Part::Single(Term::Rough { std_k: 8.0, corner_hz: 1.5 })],
            vec![resonance(0.2), resonance(0.5), resonance(6.0)],
            vec![Part::Turbulent { std_k: 9.0, corner_hz: 0.7, fastest_hz: 100.0 }],
            vec![comb(&[2.0, 1.0, 0.4], 0.3, false), resonance(0.4)],
            vec![comb(&[2.0, 1.0, 0.4], 0.3, true)],
            // The tail is that of the neighbour of the last line, and lines are as wide as lines
            // can be.
            vec![comb(&[2.0, 1.0, 0.1], 4.0, true)],
            vec![Part::Noise([1.1, 0.8]), Part::Turbulent { std_k: 9.0, corner_hz: 0.7, fastest_hz: 100.0 }],
        ]
    }

    /// Against a public derivative checker. Its step of 1.5e-8 in the logarithm of each number
    /// leaves rounding: 1e-16 of the terms of a sum over 400 bins, some thousands, over 1.5e-8, a
    /// few 1e-5; slopes are hundreds. 1e-5 of the largest slope and 1e-3 leave room for that; a
    /// lost factor is far outside.
    #[test]
    fn the_gradient_is_that_of_the_value() {
        let periodogram = periodogram();
        let others: Vec<f64> = periodogram.of_noise([0.7, 0.9]);
        for parts in parts() {
            let cost = Whittle { periodogram: &periodogram, others: &others, parts: &parts };
            let x: Vec<f64> = parts.iter().flat_map(Part::values).collect();
            let of_logarithms = |y: &Vec<f64>| Ok(cost.value(&y.iter().map(|v| v.exp()).collect::<Vec<f64>>()));
            let want = central_diff(&of_logarithms)(&x.iter().map(|v| v.ln()).collect()).expect("a gradient");
            let got = cost.derivatives(&x).expect("derivatives");
            assert!((got.value - cost.value(&x)).abs() < 1e-9 * got.value.abs(), "{parts:?}");
            let largest = want.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            for (a, want) in want.iter().enumerate() {
                let (got, tol) = (got.gradient[a] * x[a], 1e-5 * largest + 1e-3);
                assert!((got - want).abs() < tol, "{parts:?}, number {a}: {got}, want {want} ± {tol}");
            }
        }
    }
}

//! How far an estimate moves from part to part of its record.
//!
//! To first order a least-squares estimate is a sum over its residuals: `θ̂ − θ = −Σ d_k r_k` with the influence
//! `d = J (JᵀJ)⁻¹ u` of each residual on the number `uᵀθ`. If the model is right, parts that carry equal shares of `Σ d_k²` have
//! terms of equal variance, wherever the record is cut: along its time, or by frequency. If something is missing in the model,
//! its error goes with the influence differently in different parts, and the terms scatter by more. This is a jackknife of one
//! linearisation, as robust standard errors of clustered data are (Liang and Zeger 1986), and costs a transform where refits
//! would cost the fit eight times over.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use twinlag_transform::sine_transform;

/// Parts of equal information: few enough that the terms are large, and enough that their scatter is known to a quarter,
/// `1/√(2 · 7)`.
const PARTS: usize = 8;

/// Scatter of an estimate between parts, in one way to cut the record.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Scatter {
    /// Standard error that the scatter makes, over the one that is stated: 1 on average if the model is right.
    pub ratio: f64,
    /// Probability of at least as large a scatter if the model is right.
    pub p_value: f64,
}

/// Scatter of an estimate between parts of its record.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct PartScatter {
    /// Between eight stretches along the record.
    pub along: Scatter,
    /// Between eight bands of frequencies.
    pub by_frequency: Scatter,
}

impl PartScatter {
    /// The scatter of an estimate with the residuals and influences below.
    ///
    /// - `residual`: whitened, a series for each unbroken run
    /// - `influence`: `d_k`, in the same shape
    /// - `standard_error`: of the estimate, in its unit
    ///
    /// `None` of less than sixteen residuals, or where nothing has an influence.
    ///
    /// ```
    /// use twinlag_cross_relation::PartScatter;
    ///
    /// // The mean of 64 residuals of unit variance, half of them above and half below: ±1 in turn, or one half after the other.
    /// let influence = [vec![1.0 / 64.0; 64]];
    /// let in_turn = [(0..64).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect()];
    /// let step = [(0..64).map(|k| if k < 32 { 1.0 } else { -1.0 }).collect()];
    /// let along = |residual| PartScatter::of(residual, &influence, 0.125).expect("64 residuals").along;
    /// assert!(along(&in_turn).ratio < 1e-12);
    /// // Eight parts of ±8/64, over their seven degrees of freedom and the variance 1/64.
    /// assert!((along(&step).ratio - (8.0_f64 * 8.0 / 7.0).sqrt()).abs() < 1e-12);
    /// assert!(along(&step).p_value < 1e-6);
    /// ```
    pub fn of(residual: &[Vec<f64>], influence: &[Vec<f64>], standard_error: f64) -> Option<Self> {
        let term = |(r, d): (&f64, &f64)| [d * r, d * d];
        let along: Vec<[f64; 2]> = residual.iter().flatten().zip(influence.iter().flatten()).map(term).collect();
        let mut bins: Vec<(f64, [f64; 2])> = Vec::with_capacity(along.len());
        for (r, d) in residual.iter().zip(influence).filter(|(r, _)| !r.is_empty()) {
            let steps = (r.len() + 1) as f64;
            let pairs = sine_transform(r).into_iter().zip(sine_transform(d)).enumerate();
            bins.extend(pairs.map(|(j, (r, d))| ((j + 1) as f64 / steps, term((&r, &d)).map(|t| 2.0 / steps * t))));
        }
        bins.sort_by(|a, b| a.0.total_cmp(&b.0));
        let by_frequency: Vec<[f64; 2]> = bins.into_iter().map(|(_, terms)| terms).collect();
        let between = |terms: &[[f64; 2]]| between(terms.iter().copied(), standard_error);
        Some(Self { along: between(&along)?, by_frequency: between(&by_frequency)? })
    }

    /// The larger of both ratios.
    pub fn ratio(&self) -> f64 {
        self.along.ratio.max(self.by_frequency.ratio)
    }

    /// The smaller of both p-values, for two of them (Bonferroni).
    pub fn p_value(&self) -> f64 {
        (2.0 * self.along.p_value.min(self.by_frequency.p_value)).min(1.0)
    }
}

/// Scatter between parts of equal information of `terms`: contributions to the estimate, and to its information.
pub(crate) fn between(terms: impl ExactSizeIterator<Item = [f64; 2]> + Clone, standard_error: f64) -> Option<Scatter> {
    let total: f64 = terms.clone().map(|t| t[1]).sum();
    let is_usable = total > 0.0 && total.is_finite() && standard_error > 0.0 && standard_error.is_finite();
    if terms.len() < 2 * PARTS || !is_usable {
        return None;
    }
    let (mut sums, mut before) = ([0.0; PARTS], 0.0);
    for [contribution, information] in terms {
        let part = ((before + 0.5 * information) / total * PARTS as f64) as usize;
        sums[part.min(PARTS - 1)] += contribution;
        before += information;
    }
    // At a minimum they sum to nothing, but for what was known beforehand.
    let mean = sums.iter().sum::<f64>() / PARTS as f64;
    let squares: f64 = sums.iter().map(|x| (x - mean) * (x - mean)).sum();
    let (count, free) = (PARTS as f64, (PARTS - 1) as f64);
    let statistic = squares * count / (standard_error * standard_error);
    let p_value = ChiSquared::new(free).ok()?.sf(statistic);
    Some(Scatter { ratio: (statistic / free).sqrt(), p_value })
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const SAMPLES: usize = 800;
    const RECORDS: u64 = 400;

    fn white(seed: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..SAMPLES).map(|_| StandardNormal.sample(&mut rng)).collect()
    }

    fn tone(rate: f64) -> Vec<f64> {
        (0..SAMPLES).map(|k| (rate * k as f64).sin()).collect()
    }

    /// A tone that is strong in the first tenth, which has half of the information.
    fn early() -> Vec<f64> {
        tone(0.3).iter().enumerate().map(|(k, x)| if k < SAMPLES / 10 { 3.0 * x } else { *x }).collect()
    }

    /// The scatter of the size of `shape` that is fitted to `residual`.
    fn fitted(mut residual: Vec<f64>, shape: Vec<f64>) -> PartScatter {
        let information: f64 = shape.iter().map(|x| x * x).sum();
        let size = residual.iter().zip(&shape).map(|(r, x)| r * x).sum::<f64>() / information;
        residual.iter_mut().zip(&shape).for_each(|(r, x)| *r -= size * x);
        let influence = shape.into_iter().map(|x| x / information).collect();
        PartScatter::of(&[residual], &[influence], information.sqrt().recip()).expect("800 residuals")
    }

    /// Of white noise a tenth of the p-values lie below a tenth: 40 ± 6 of 400, four of these either way.
    #[test]
    fn white_residuals_scatter_as_they_should() {
        let all: Vec<PartScatter> = (0..RECORDS).map(|seed| fitted(white(seed), early())).collect();
        for which in [|s: &PartScatter| s.along, |s: &PartScatter| s.by_frequency] {
            let low = all.iter().filter(|s| which(s).p_value < 0.1).count();
            assert!((16..=64).contains(&low), "{low}");
        }
    }

    /// A size of −1/3 in one half of the information and of 1 in the other, each half with a standard error of `1/√360`: they are
    /// apart by 18 standard errors.
    #[test]
    fn what_changes_along_the_record_is_seen() {
        let changing = tone(0.3).into_iter().enumerate().map(|(k, x)| if k < SAMPLES / 10 { -x } else { x });
        let residual = white(1).iter().zip(changing).map(|(r, x)| r + x).collect();
        assert!(fitted(residual, early()).along.p_value < 1e-6);
    }

    /// A size of 0.3 of one tone and of −0.3 of another, each with a standard error of `1/√400`: they are apart by 8 standard errors,
    /// and all along the record.
    #[test]
    fn what_changes_with_frequency_is_seen_there_alone() {
        let (slow, fast) = (tone(0.3), tone(1.2));
        let residual = white(1).iter().zip(slow.iter().zip(&fast)).map(|(r, (a, b))| r + 0.3 * (a - b)).collect();
        let scatter = fitted(residual, slow.iter().zip(&fast).map(|(a, b)| a + b).collect());
        assert!(scatter.by_frequency.p_value < 1e-6, "{scatter:?}");
        // By chance once in a thousand seeds.
        assert!(scatter.along.p_value > 1e-3, "{scatter:?}");
    }
}

//! How far an estimate moves from part to part of its record.
//!
//! To first order a least-squares estimate is a sum over its residuals: `θ̂ − θ = −Σ d_k r_k` with the influence
//! `d = J (JᵀJ)⁻¹ u` of each residual on the number `uᵀθ`. If the model is right, parts that carry equal shares of `Σ d_k²` have
//! terms of equal variance, wherever the record is cut: along its time, or by frequency. If something is missing in the model,
//! its error goes with the influence differently in different parts, and the terms scatter by more. This is a jackknife of one
//! linearisation, as robust standard errors of clustered data are (Liang and Zeger 1986), and costs a transform where refits
//! would cost the fit eight times over.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::collections::binary_heap::PeekMut;

use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use twinlag_transform::sine_transform;

use crate::residual::{MAX_WHOLE_RESIDUALS, PIECE_RESIDUALS};

/// Parts of equal information: few enough that the terms are large, and enough that their scatter is known to a quarter,
/// `1/√(2 · 7)`.
const PARTS: usize = 8;

/// Scatter of an estimate between parts, in one way to cut the record.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Scatter {
    /// Standard error that the scatter makes, over the one that is stated: 1 on average if the model is right.
    pub ratio: f64,
    /// Probability of at least as large a scatter if the model is right.
    pub p_value: f64,
}

/// Scatter of an estimate between parts of its record.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
    pub fn of<S: AsRef<[f64]>>(residual: &[S], influence: &[S], standard_error: f64) -> Option<Self> {
        Self::with_influence(residual, |run, k| influence[run].as_ref()[k], standard_error)
    }

    /// As [`Self::of`], with the influence of residual `k` of a run computed where it is needed, so that a long one is not in memory.
    pub fn with_influence<S: AsRef<[f64]>>(
        residual: &[S],
        influence: impl Fn(usize, usize) -> f64,
        standard_error: f64,
    ) -> Option<Self> {
        let influence = &influence;
        let runs = || residual.iter().map(AsRef::as_ref).enumerate();
        let along = runs()
            .flat_map(|(run, r): (usize, &[f64])| r.iter().enumerate().map(move |(k, r)| term(*r, influence(run, k))));
        let along = between(along, standard_error)?;
        let of_run = |(run, r): (usize, &[f64])| -> Vec<Vec<[f64; 2]>> {
            let mut end = 0;
            let of_piece = |piece: &[f64]| {
                let places = end..end + piece.len();
                end = places.end;
                let d: Vec<f64> = places.map(|k| influence(run, k)).collect();
                spectrum(piece, &d)
            };
            pieces(r).map(of_piece).collect()
        };
        let pieces: Vec<Vec<[f64; 2]>> = runs().flat_map(of_run).collect();
        Some(Self { along, by_frequency: between(ByFrequency::of(&pieces), standard_error)? })
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

/// What a residual and its influence add to the estimate, and to its information.
fn term(r: f64, d: f64) -> [f64; 2] {
    [d * r, d * d]
}

/// A run, or pieces of a long one: their transforms together are as orthogonal as that of the whole, which would take thirty
/// times its memory.
fn pieces(run: &[f64]) -> impl Iterator<Item = &[f64]> {
    run.chunks(if run.len() <= MAX_WHOLE_RESIDUALS { run.len().max(1) } else { PIECE_RESIDUALS })
}

/// The terms of a piece, frequency after frequency.
fn spectrum(r: &[f64], d: &[f64]) -> Vec<[f64; 2]> {
    let scale = 2.0 / (r.len() + 1) as f64;
    sine_transform(r).into_iter().zip(sine_transform(d)).map(|(r, d)| term(r, d).map(|t| scale * t)).collect()
}

/// Terms of pieces by their frequencies; those of one frequency in the order of the pieces.
#[derive(Clone)]
struct ByFrequency<'a> {
    pieces: &'a [Vec<[f64; 2]>],
    /// The next term of each piece: its frequency, as bits, which order positive numbers as they are, the piece, and its place
    /// there.
    next: BinaryHeap<Reverse<(u64, usize, usize)>>,
}

impl<'a> ByFrequency<'a> {
    fn of(pieces: &'a [Vec<[f64; 2]>]) -> Self {
        let first = (0..pieces.len()).filter_map(|piece| Self::place(pieces, piece, 0));
        Self { pieces, next: first.collect() }
    }

    fn place(pieces: &[Vec<[f64; 2]>], piece: usize, bin: usize) -> Option<Reverse<(u64, usize, usize)>> {
        let count = pieces[piece].len();
        let frequency = (bin + 1) as f64 / (count + 1) as f64;
        (bin < count).then_some(Reverse((frequency.to_bits(), piece, bin)))
    }
}

impl Iterator for ByFrequency<'_> {
    type Item = [f64; 2];

    fn next(&mut self) -> Option<[f64; 2]> {
        let mut first = self.next.peek_mut()?;
        let Reverse((_, piece, bin)) = *first;
        match Self::place(self.pieces, piece, bin + 1) {
            Some(next) => *first = next,
            None => drop(PeekMut::pop(first)),
        }
        Some(self.pieces[piece][bin])
    }
}

/// Scatter between parts of equal information of `terms`: contributions to the estimate, and to its information.
pub(crate) fn between(terms: impl Iterator<Item = [f64; 2]> + Clone, standard_error: f64) -> Option<Scatter> {
    let (total, terms_there) = terms.clone().fold((0.0, 0), |(sum, count), t| (sum + t[1], count + 1));
    let is_usable = total > 0.0 && total.is_finite() && standard_error > 0.0 && standard_error.is_finite();
    if terms_there < 2 * PARTS || !is_usable {
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

    /// Of pieces of several lengths all terms come once, in the order of their frequencies, those of a frequency in the order
    /// of the pieces: what a stable sort of them all gives.
    #[test]
    fn terms_come_in_the_order_of_their_frequencies() {
        let pieces: Vec<Vec<[f64; 2]>> = [3, 7, 0, 7, 1]
            .iter()
            .enumerate()
            .map(|(p, n)| (0..*n).map(|j| [p as f64, f64::from(j)]).collect())
            .collect();
        let frequency = |[p, j]: &[f64; 2]| (j + 1.0) / (pieces[*p as usize].len() + 1) as f64;
        let mut sorted = pieces.concat();
        sorted.sort_by(|a, b| frequency(a).total_cmp(&frequency(b)));
        assert_eq!(ByFrequency::of(&pieces).collect::<Vec<[f64; 2]>>(), sorted);
    }

    /// A run longer than is transformed at once keeps its sums, since the transforms of pieces are as orthogonal as that of the
    /// whole: their difference is rounding, 1e-9 of the number of terms at most. What goes one way with slow and the
    /// other with fast frequencies is seen in pieces too: each size of 0.02 has a standard error of `1/√6e5`, a fifteenth of
    /// it.
    #[test]
    fn a_long_run_is_cut_into_pieces() {
        let n = MAX_WHOLE_RESIDUALS + 75_713;
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let tone = |rate: f64| move |k: usize| (rate * k as f64).sin();
        let (slow, fast) = (tone(0.3), tone(1.2));
        let influence: Vec<f64> = (0..n).map(|k| (slow(k) + fast(k)) / n as f64).collect();
        let white: Vec<f64> = (0..n).map(|_| StandardNormal.sample(&mut rng)).collect();
        assert_eq!(pieces(&white).map(<[f64]>::len).sum::<usize>(), n);
        assert!(pieces(&white).count() > 4);
        let sums = |terms: &mut dyn Iterator<Item = [f64; 2]>| {
            terms.fold([0.0, 0.0], |[a, b], [contribution, information]| [a + contribution, b + information])
        };
        let along = sums(&mut white.iter().zip(&influence).map(|(r, d)| term(*r, *d * n as f64)));
        let scaled: Vec<f64> = influence.iter().map(|d| d * n as f64).collect();
        let by_frequency = sums(&mut pieces(&white).zip(pieces(&scaled)).flat_map(|(r, d)| spectrum(r, d)));
        for (a, b) in along.into_iter().zip(by_frequency) {
            assert!((a - b).abs() < 1e-9 * n as f64, "{a}, and {b}");
        }
        let standard_error = (n as f64).sqrt().recip();
        let of = |residual: &[f64]| PartScatter::of(&[residual], &[&influence], standard_error).expect("a long run");
        assert!(of(&white).by_frequency.p_value > 1e-3, "by chance once in a thousand seeds");
        let missing: Vec<f64> = white.iter().enumerate().map(|(k, r)| r + 0.02 * (slow(k) - fast(k))).collect();
        assert!(of(&missing).by_frequency.p_value < 1e-6);
    }
}

//! The whitened disagreement of a plant along a record, and its derivative with respect to one parameter: what a fit
//! evaluates again and again, so it computes nothing else, and keeps its memory.
//!
//! The derivative is exact: the inverse is computed in numbers that carry it along. Where the parameter moves none of
//! the rows that carry noise, as an offset does, the factor of the residual whitens the derivative as well.

use crate::inverse::Inverse;
use crate::number::{Number, Real};
use crate::observations::{Observations, Stretch};
use crate::plant::{Place, Plant};
use crate::rows::Rows;
use crate::whitening::{Factor, FactorDerivative, Source, Variance};

/// Noise of a masked reading, in times the swing: far beyond what the reading could say, and not so far that rounding
/// is lost to it (the square of a ratio of 1e7 to the noise is what double precision holds).
const MASKED_NOISE_SWINGS: f64 = 20.0;
/// Fewest disagreements of a stretch: one of fewer is left out.
const MIN_DISAGREEMENTS: usize = 4;
/// Part of a step by which the instant of a value may differ from its sample's.
const SAME_INSTANT_STEPS: f64 = 0.25;

/// Where the residuals of a stretch belong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    /// Which of the stretches.
    pub(crate) stretch: usize,
    /// Residuals of it.
    pub(crate) count: usize,
    /// The sample, counted through all stretches, in the middle of the first residual's reach.
    pub(crate) first_sample: usize,
}

/// Variance of each reading of a channel, K²: boundless, to all purposes, where it is masked.
pub(crate) fn reading_variance(noise_std_k: f64, masked: &[bool], swing_k: f64) -> Variance {
    Variance::masked(noise_std_k * noise_std_k, (MASKED_NOISE_SWINGS * swing_k).powi(2), masked)
}

/// The disagreement of one stretch, ready to be whitened, in memory that is used again.
#[derive(Clone, Debug)]
pub(crate) struct Disagreement<T> {
    pub(crate) inverse: Inverse<T>,
    /// How noise of either reading enters.
    pub(crate) reading_rows: [Rows<T>; 2],
    /// How innovations of each extra noise enter.
    pub(crate) extra_rows: Vec<Rows<T>>,
    /// The disagreement, and then the residual.
    pub(crate) values: Vec<T>,
    /// Variance of the innovations of each extra noise, K².
    extra_variances: Vec<Variance>,
}

impl<T: Real> Default for Disagreement<T> {
    fn default() -> Self {
        Self::empty()
    }
}

impl<T: Real> Disagreement<T> {
    pub(crate) fn empty() -> Self {
        Self {
            inverse: Inverse::empty(),
            reading_rows: [Rows::identity(), Rows::identity()],
            extra_rows: Vec::new(),
            values: Vec::new(),
            extra_variances: Vec::new(),
        }
    }

    /// From the inverse of a stretch to its disagreement: the differences that whiten extra noise, and the rows.
    pub(crate) fn compare(&mut self, plant: &Plant, step_s: f64) {
        let has_gas = plant.extra.iter().any(|e| e.place == Place::Gas);
        self.extra_rows.resize_with(plant.extra.len(), Rows::identity);
        self.extra_variances.clear();
        for (index, extra) in plant.extra.iter().enumerate() {
            let rho = extra.rho(step_s);
            self.extra_variances.push(Variance::same(extra.std_k * extra.std_k * (1.0 - rho * rho)));
            let (before, rest) = self.extra_rows.split_at_mut(index);
            match extra.place {
                Place::Reading(i) if !self.inverse.has[i] => rest[0].begin(),
                Place::Reading(i) => self.inverse.disagreement_rows(plant, i, &mut rest[0]),
                Place::Gas => rest[0].copy(&self.inverse.gas.rows),
            }
            // Its innovations come with the next value; noise that is there already has one more difference.
            rest[0].start += 1;
            let count = self.inverse.count() - 1;
            before.iter_mut().for_each(|rows| rows.difference(rho, count));
            self.inverse.difference(rho, has_gas);
        }
        for (i, rows) in self.reading_rows.iter_mut().enumerate() {
            if self.inverse.has[i] {
                self.inverse.disagreement_rows(plant, i, rows);
            } else {
                rows.begin();
            }
        }
        let [one, two] = &self.inverse.chains;
        self.values.clear();
        match self.inverse.has {
            [true, true] => self.values.extend(one.value.iter().zip(&two.value).map(|(a, b)| *a - *b)),
            [true, false] => self.values.extend_from_slice(&one.value),
            [false, _] => self.values.extend(two.value.iter().map(|b| -*b)),
        }
    }

    /// What brings noise in, of readings with `variances`; of derivatives, where there are some.
    pub(crate) fn sources<'a>(&'a self, variances: &'a [Variance; 2]) -> Vec<Source<'a, T>> {
        let readings = self.reading_rows.iter().zip(variances);
        let extra = self.extra_rows.iter().zip(&self.extra_variances);
        readings.chain(extra).map(|(rows, variance)| Source { rows, variance }).collect()
    }
}

/// Whether a stretch has disagreements under `plant`.
pub(crate) fn is_long_enough(stretch: &Stretch, plant: &Plant, is_even: bool) -> bool {
    stretch.len() >= plant.consumed(is_even) + MIN_DISAGREEMENTS
}

/// The sample of a stretch whose instant the first value of a disagreement has.
pub(crate) fn first_sample(stretch: &Stretch, first_s: f64, step_s: f64) -> usize {
    stretch.time_s.partition_point(|t| *t < first_s - SAME_INSTANT_STEPS * step_s)
}

/// Memory for a derivative.
#[derive(Default)]
pub(crate) struct MovedMemory {
    disagreement: Disagreement<Number>,
    factor: FactorDerivative,
}

/// Evaluates plants of one record, one after the other.
pub(crate) struct Evaluator<'a> {
    observations: &'a Observations,
    variances: Vec<[Variance; 2]>,
    plain: Disagreement<f64>,
    factors: Vec<Factor>,
    /// Pieces of the last evaluation.
    pub(crate) pieces: Vec<Piece>,
    /// Its whitened residual.
    pub(crate) residual: Vec<f64>,
}

impl<'a> Evaluator<'a> {
    /// - `noise_std_k`: white noise of the channels, which all plants have
    pub(crate) fn new(observations: &'a Observations, noise_std_k: [f64; 2]) -> Self {
        let of_stretch =
            |s: &Stretch| [0, 1].map(|i| reading_variance(noise_std_k[i], &s.masked[i], observations.swing_k()));
        Self {
            observations,
            variances: observations.stretches.iter().map(of_stretch).collect(),
            plain: Disagreement::empty(),
            factors: Vec::new(),
            pieces: Vec::new(),
            residual: Vec::new(),
        }
    }

    /// The whitened residual of `plant`, into [`Self::residual`].
    pub(crate) fn evaluate(&mut self, plant: &Plant) {
        let (period_s, step_s) = (self.observations.period_s, self.observations.step_s());
        self.pieces.clear();
        self.residual.clear();
        let mut before = 0;
        for (index, stretch) in self.observations.stretches.iter().enumerate() {
            if is_long_enough(stretch, plant, period_s.is_some()) {
                self.plain.inverse.invert(plant, stretch, period_s);
                self.plain.compare(plant, step_s);
                let count = self.plain.values.len();
                let first_s = self.plain.inverse.chains[0].times_s()[0];
                let first_sample = before + first_sample(stretch, first_s, step_s);
                if self.factors.len() == self.pieces.len() {
                    self.factors.push(Factor::empty());
                }
                let factor = &mut self.factors[self.pieces.len()];
                factor.compute(&self.plain.sources(&self.variances[index]), count);
                factor.whiten(&mut self.plain.values);
                self.pieces.push(Piece { stretch: index, count, first_sample });
                self.residual.extend_from_slice(&self.plain.values);
            }
            before += stretch.len();
        }
    }

    /// The derivative of the residual, into `out`, at the values of the plant that was evaluated last: `plant` has
    /// them, with the derivatives of what the parameter moves.
    ///
    /// - `functions`: in which of the sensors functions of time or temperature may depend on the parameter
    pub(crate) fn derivative(&self, plant: &Plant, functions: [bool; 2], memory: &mut MovedMemory, out: &mut Vec<f64>) {
        let MovedMemory { disagreement, factor: of_factor } = memory;
        let moved = plant.moved(functions);
        let (period_s, step_s) = (self.observations.period_s, self.observations.step_s());
        out.clear();
        for (piece, factor) in self.pieces.iter().zip(&self.factors) {
            if moved == [false; 2] {
                out.resize(out.len() + piece.count, 0.0);
                continue;
            }
            let stretch = &self.observations.stretches[piece.stretch];
            disagreement.inverse.invert_moved(plant, stretch, period_s, moved);
            disagreement.compare(plant, step_s);
            let from = out.len();
            out.extend(disagreement.values.iter().map(|v| v.eps));
            let values = &mut out[from..];
            let mut sources = disagreement.sources(&self.variances[piece.stretch]);
            sources.retain(|source| !source.rows.is_constant());
            if sources.is_empty() {
                factor.whiten(values);
            } else {
                let residual = &self.residual[from..from + piece.count];
                of_factor.whiten(factor, &sources, residual, values);
            }
        }
    }
}

//! What a model implies of a record beside its residual: gas temperatures, their difference, the noise of each reading.
//! Computed once, where a fit has ended.

use crate::disagreement::{Disagreement, first_sample, is_long_enough, reading_variance};
use crate::inverse::Inverse;
use crate::observations::Observations;
use crate::plant::Plant;
use crate::rows::Rows;
use crate::whitening::{Factor, Variance};

/// A disagreement that is this many times less certain than most says nothing: it rests on a masked reading, whose
/// noise is some hundred times that of the others.
const UNINFORMED_RATIO: f64 = 10.0;
/// Samples around the middle of a record, beside the reach of a delay, from which the paths of noise are taken.
const PATH_SAMPLES: usize = 16;

/// The whitened disagreement of a whole record, and what it is made of.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Evaluation {
    /// Whitened residual.
    pub residual: Vec<f64>,
    /// The sample, counted through all stretches, in the middle of each residual's reach.
    pub sample: Vec<usize>,
    /// Its instant, s.
    pub time_s: Vec<f64>,
    /// Mean of the two inferred gas temperatures, smoothed by the operators, °C.
    pub gas_c: Vec<f64>,
    /// Their difference, K.
    pub disagreement_k: Vec<f64>,
    /// Whether it says anything: one for each masked reading does not.
    pub is_informed: Vec<bool>,
    /// Where stretches begin among the residuals.
    pub begins: Vec<usize>,
    /// Details by stretch.
    pub(crate) parts: Vec<Part>,
}

/// One stretch with its factor.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    /// Which of the stretches: those that are too short have none.
    pub(crate) stretch: usize,
    /// How noise of either reading enters the disagreement.
    rows: [Rows<f64>; 2],
    variances: [Variance; 2],
    /// `V⁻¹ u`.
    weighted: Vec<f64>,
    /// Both inferred inputs.
    pub(crate) inferred: [Inferred; 2],
    /// Values of them that come before the first disagreement.
    pub(crate) skipped: usize,
    /// Samples before this stretch.
    pub(crate) before: usize,
}

/// The gas temperature that one channel implies, °C, and how it depends on the readings.
#[derive(Clone, Debug)]
pub(crate) struct Inferred {
    pub(crate) value: Vec<f64>,
    pub(crate) rows: Rows<f64>,
}

impl Part {
    /// Disagreements.
    pub(crate) fn len(&self) -> usize {
        self.weighted.len()
    }

    /// `Bᵀ V⁻¹ u`: what each reading of a channel has to do with the disagreement.
    pub(crate) fn scores(&self, channel: usize, samples: usize) -> Vec<f64> {
        let rows = &self.rows[channel];
        let mut out = vec![0.0; samples];
        for (k, w) in self.weighted.iter().enumerate() {
            let of_row = out.iter_mut().skip(rows.start + k);
            of_row.zip(rows.at(k)).for_each(|(s, c)| *s += c * w);
        }
        out
    }

    /// The noise of each reading of a channel that makes both inputs agree with the least of it, K: `s² Bᵀ V⁻¹ u`.
    pub(crate) fn noise_of(&self, channel: usize, samples: usize) -> Vec<f64> {
        let variance = &self.variances[channel];
        let scores = self.scores(channel, samples).into_iter().enumerate();
        scores.map(|(k, score)| score * variance.at(k)).collect()
    }
}

impl Plant {
    /// The whitened disagreement along the record, with all that it implies.
    pub fn evaluate(&self, observations: &Observations) -> Evaluation {
        let mut out = Evaluation::default();
        let mut before = 0;
        for (index, stretch) in observations.stretches.iter().enumerate() {
            out.begins.push(out.sample.len());
            if is_long_enough(stretch, self, observations.period_s.is_some()) {
                self.evaluate_stretch(observations, index, before, &mut out);
            }
            before += stretch.len();
        }
        out
    }

    fn evaluate_stretch(&self, observations: &Observations, index: usize, before: usize, out: &mut Evaluation) {
        let (stretch, step_s) = (&observations.stretches[index], observations.step_s());
        let mut disagreement = Disagreement::<f64>::empty();
        disagreement.inverse.invert(self, stretch.whole(), observations.period_s);
        // What the sensors imply, before the differences that whiten extra noise.
        let chains = disagreement.inverse.chains.each_ref();
        let inferred = chains.map(|chain| Inferred { value: chain.value.clone(), rows: chain.rows.clone() });
        disagreement.compare(self, step_s);
        let variances =
            [0, 1].map(|i| reading_variance(self.noise_std_k[i], &stretch.masked[i], observations.swing_k()));
        let mut residual = std::mem::take(&mut disagreement.values);
        let mut factor = Factor::empty();
        factor.compute(&disagreement.sources(&variances, 0), residual.len(), None, None);
        factor.whiten(&mut residual, 0);
        let count = residual.len();
        let times_s = &disagreement.inverse.chains[0].times_s()[..count];
        let start = before + first_sample(stretch, times_s[0], step_s);
        out.sample.extend(start..start + count);
        out.time_s.extend_from_slice(times_s);
        let skipped = self.extra.len();
        let mut gas = [0, 1].map(|i| inferred[i].value.clone());
        gas.iter_mut().for_each(|gas| self.undo_slow(gas, stretch.start_c(), step_s));
        let [c1, c2] = [0, 1].map(|i| &gas[i][skipped..skipped + count]);
        out.gas_c.extend(c1.iter().zip(c2).map(|(a, b)| 0.5 * (a + b)));
        out.disagreement_k.extend(c1.iter().zip(c2).map(|(a, b)| a - b));
        out.is_informed.extend(is_informed(&(0..count).map(|k| factor.row(k)[0]).collect::<Vec<f64>>()));
        out.residual.extend_from_slice(&residual);
        factor.unwhiten_transposed(&mut residual);
        let rows = disagreement.reading_rows;
        out.parts.push(Part { stretch: index, rows, variances, weighted: residual, inferred, skipped, before });
    }

    /// The rows, in the middle of the record, by which noise of either channel and of the gas enters the disagreement.
    pub(crate) fn noise_paths(&self, observations: &Observations) -> [Vec<f64>; 3] {
        let stretch = observations.stretches.iter().max_by_key(|s| s.len()).expect("not empty");
        let (middle, around) = (stretch.len() / 2, self.reach + PATH_SAMPLES);
        let (from, to) = (middle.saturating_sub(around), (middle + around).min(stretch.len()));
        let mut inverse = Inverse::<f64>::empty();
        inverse.invert_with_gas(self, stretch.cut(from..to), observations.period_s);
        let k = inverse.count() / 2;
        let mut rows = Rows::identity();
        let mut of_channel = |i: usize| {
            inverse.disagreement_rows(self, i, &mut rows);
            rows.at(k).to_vec()
        };
        [of_channel(0), of_channel(1), inverse.gas.rows.at(k).to_vec()]
    }
}

/// Whether each of the disagreements of a stretch says anything.
///
/// - `scales`: standard deviation of each, given those before it, K
pub(crate) fn is_informed(scales: &[f64]) -> Vec<bool> {
    let typical = median(scales.to_vec());
    scales.iter().map(|scale| *scale < UNINFORMED_RATIO * typical).collect()
}

pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

//! What a model implies of a record beside its residual: gas temperatures, their difference, the noise of each reading.
//! Computed once, where a fit has ended.

use std::ops::Range;

use crate::chain::Chain;
use crate::disagreement::{Disagreement, first_sample, is_long_enough, reading_variances};
use crate::instants::Instants;
use crate::inverse::Inverse;
use crate::observations::{Observations, Stretch};
use crate::plant::Plant;
use crate::rows::Rows;
use crate::whitening::{Factor, Variance};

/// A disagreement that is this many times less certain than most says nothing: it rests on a wrong reading, whose
/// noise is some hundred times that of the others.
const UNINFORMED_RATIO: f64 = 10.0;
/// Where readings are missing, one that is this many times less certain than the most certain one says nothing: three quarters of its variance
/// are those of a missing reading, whose noise is larger than what it is off, so that it varies less than the others.
const UNINFORMED_BY_MISSING_RATIO: f64 = 2.0;
/// Samples around the middle of a record, beside the reach of a delay, from which the paths of noise are taken.
const PATH_SAMPLES: usize = 16;

/// The whitened disagreement of a whole record, and the gas temperatures that it is of.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Evaluation {
    /// Whitened residual.
    pub residual: Vec<f64>,
    /// Mean of the two inferred gas temperatures, smoothed by the operators, °C.
    pub gas_c: Vec<f64>,
    /// Their difference, K.
    pub disagreement_k: Vec<f64>,
    /// The sample, counted through all stretches, in the middle of each residual's reach: neighbours in each stretch.
    pub samples: Vec<Range<usize>>,
}

impl Evaluation {
    /// The sample of each residual.
    pub fn sample(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        self.samples.iter().cloned().flatten()
    }

    /// The places of the residuals of each stretch.
    pub fn stretches(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        places(&self.samples)
    }
}

/// The whitened disagreement of a whole record, and what it is made of.
#[derive(Clone, Debug, Default)]
pub(crate) struct Details {
    /// Whitened residual.
    pub(crate) residual: Vec<f64>,
    /// Its instants, s.
    pub(crate) time_s: Instants,
    /// Whether it says anything: one for each masked reading does not.
    pub(crate) is_informed: Vec<bool>,
    /// Its samples, as [`Evaluation`] has them.
    pub(crate) samples: Vec<Range<usize>>,
    /// Details by stretch.
    pub(crate) parts: Vec<Part>,
}

impl Details {
    /// The sample of each residual.
    pub(crate) fn sample(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        self.samples.iter().cloned().flatten()
    }

    /// The places of the residuals of each stretch.
    pub(crate) fn stretches(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        places(&self.samples)
    }

    /// The parts without inferred inputs: what scores need.
    pub(crate) fn into_scored(mut self) -> Vec<Part> {
        self.parts.iter_mut().flat_map(|part| &mut part.inferred).for_each(|inferred| inferred.value = Vec::new());
        self.parts
    }

    /// The samples of the residuals of each stretch, and their places.
    pub(crate) fn samples_and_places(&self) -> impl Iterator<Item = (Range<usize>, Range<usize>)> + '_ {
        self.samples.iter().cloned().zip(self.stretches())
    }
}

/// Ranges as long, one after the other.
fn places(samples: &[Range<usize>]) -> impl Iterator<Item = Range<usize>> + '_ {
    samples.iter().scan(0, |end, samples| {
        let first = std::mem::replace(end, *end + samples.len());
        Some(first..*end)
    })
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

/// One stretch whitened.
struct Whitened {
    /// Both inferred inputs, before the differences that whiten extra noise.
    inferred: [Inferred; 2],
    rows: [Rows<f64>; 2],
    variances: [Variance; 2],
    residual: Vec<f64>,
    time_s: Instants,
    samples: Range<usize>,
    factor: Factor,
}

impl Plant {
    /// The whitened disagreement along the record, and the gas temperatures that it is of.
    pub fn evaluate(&self, observations: &Observations) -> Evaluation {
        let mut out = Evaluation::default();
        self.each_whitened(observations, |index, _, Whitened { inferred, residual, samples, .. }| {
            let start_c = observations.stretches[index].start_c();
            let [mut mean_c, mut difference_k] = inferred.map(|inferred| {
                let mut gas = inferred.value;
                self.undo_slow(&mut gas, start_c, observations.step_s());
                gas.drain(..self.extra.len());
                gas.truncate(residual.len());
                gas
            });
            for (a, b) in mean_c.iter_mut().zip(&mut difference_k) {
                (*a, *b) = (0.5 * (*a + *b), *a - *b);
            }
            append(&mut out.residual, residual);
            append(&mut out.gas_c, mean_c);
            append(&mut out.disagreement_k, difference_k);
            out.samples.push(samples);
        });
        out
    }

    /// The whitened disagreement along the record, with all that it is made of.
    pub(crate) fn details(&self, observations: &Observations) -> Details {
        let mut out = Details::default();
        self.each_whitened(observations, |stretch, before, whitened| {
            let Whitened { inferred, rows, variances, residual, time_s, samples, factor } = whitened;
            if is_all_informed(&observations.stretches[stretch], observations.period_s.is_some()) {
                out.is_informed.resize(out.is_informed.len() + residual.len(), true);
            } else {
                let scales = (0..residual.len()).map(|k| factor.row(k)[0]).collect();
                out.is_informed.extend(is_informed(scales, &observations.stretches[stretch]));
            }
            let mut weighted = residual.clone();
            factor.unwhiten_transposed(&mut weighted);
            append(&mut out.residual, residual);
            out.time_s.append(time_s);
            out.samples.push(samples);
            let skipped = self.extra.len();
            out.parts.push(Part { stretch, rows, variances, weighted, inferred, skipped, before });
        });
        out
    }

    /// Visits each stretch that is long enough, with its place and the samples before it.
    fn each_whitened(&self, observations: &Observations, mut visit: impl FnMut(usize, usize, Whitened)) {
        let mut before = 0;
        for (index, stretch) in observations.stretches.iter().enumerate() {
            if is_long_enough(stretch, self, observations.period_s.is_some()) {
                visit(index, before, self.whitened(observations, index, before));
            }
            before += stretch.len();
        }
    }

    fn whitened(&self, observations: &Observations, index: usize, before: usize) -> Whitened {
        let (stretch, step_s) = (&observations.stretches[index], observations.step_s());
        let mut disagreement = Disagreement::<f64>::empty();
        disagreement.inverse.invert(self, stretch.whole(), observations.period_s);
        // What the sensors imply, before the differences that whiten extra noise.
        let undifferenced = (!self.extra.is_empty()).then(|| disagreement.inverse.chains.clone());
        disagreement.compare(self, step_s);
        let mut residual = std::mem::take(&mut disagreement.values);
        // What is as long as the record, and not needed any more, goes.
        let chains = std::mem::replace(&mut disagreement.inverse, Inverse::empty()).chains;
        let first_s = chains[0].times_s()[0];
        let first = first_sample(stretch, first_s, step_s);
        let time_s = match observations.period_s {
            Some(_) => stretch.time_s.cut(first..first + residual.len()),
            None => chains[0].times_s()[..residual.len()].to_vec().into(),
        };
        let inferred = undifferenced.unwrap_or(chains).map(|Chain { value, rows, .. }| Inferred { value, rows });
        let variances = reading_variances(self.noise_std_k, stretch, observations.swing_k());
        let mut factor = Factor::empty();
        factor.compute(&disagreement.sources(&variances, 0), residual.len(), None, None);
        factor.whiten(&mut residual, 0, 0);
        let samples = before + first..before + first + residual.len();
        Whitened { inferred, rows: disagreement.reading_rows, variances, residual, time_s, samples, factor }
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

/// Puts `values` after those that there are.
pub(crate) fn append(all: &mut Vec<f64>, values: Vec<f64>) {
    if all.is_empty() {
        *all = values;
    } else {
        all.extend(values);
    }
}

/// Whether every disagreement of a stretch says something: evenly spaced readings of which none is masked are as good as each other.
pub(crate) fn is_all_informed(stretch: &Stretch, is_even: bool) -> bool {
    is_even && !stretch.masked.iter().flatten().any(|is_masked| *is_masked)
}

/// Whether each of the disagreements of a stretch says anything.
///
/// - `scales`: standard deviation of each, given those before it, K
pub(crate) fn is_informed(scales: Vec<f64>, stretch: &Stretch) -> Vec<bool> {
    let most = if stretch.has_missing() {
        UNINFORMED_BY_MISSING_RATIO * scales.iter().copied().fold(f64::INFINITY, f64::min)
    } else {
        UNINFORMED_RATIO * median(scales.clone())
    };
    scales.into_iter().map(|scale| scale < most).collect()
}

pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{Identifier, candidates};
    use crate::model::Model;
    use crate::prepare::Prepared;
    use crate::settings::Settings;

    /// Both ways to evaluate a record whiten the same residual at the same samples, stretch by stretch; the mean and the
    /// difference of the inferred inputs are those of the parts, in a model with noise of another colour too, whose differences
    /// come later.
    #[test]
    fn what_is_evaluated_is_made_of_its_parts() {
        let stretch = |from: usize, samples: usize| {
            let time_s: Vec<f64> = (from..from + samples).map(|k| k as f64).collect();
            let reading_c = [2.0, 5.0].map(|late| time_s.iter().map(|t| 300.0 + (0.2 * (t - late)).sin()).collect());
            Stretch::new(time_s, reading_c)
        };
        let observations = Observations::new(vec![stretch(0, 90), stretch(100, 70)], Some(1.0)).expect("a record");
        let context = Prepared::new(&observations, &Settings::default()).expect("a record").context;
        let coloured = candidates(&[Identifier::COLOURED_NOISE], &context).remove(0);
        let start = coloured.starts().remove(0);
        let two_lags = Model::new(&[], [0.1, 0.1]);
        for (model, theta) in [
            (two_lags.clone(), vec![2.0, 5.0]),
            (two_lags.with(coloured), [2.0, 5.0].into_iter().chain(start).collect()),
        ] {
            let (evaluation, details) = (model.evaluate(&theta, &observations), model.details(&theta, &observations));
            assert_eq!(evaluation.residual, details.residual);
            assert_eq!(evaluation.samples, details.samples);
            assert_eq!(evaluation.sample().count(), evaluation.residual.len());
            assert_eq!(evaluation.stretches().collect::<Vec<_>>(), details.stretches().collect::<Vec<_>>());
            let instants: Vec<f64> = observations.stretches.iter().flat_map(|s| s.time_s.iter()).collect();
            for (sample, time_s) in details.sample().zip(details.time_s.iter()) {
                assert!((instants[sample] - time_s).abs() <= 0.5, "sample {sample} at {time_s} s");
            }
            for (part, places) in details.parts.iter().zip(details.stretches()) {
                let [one, two] = part.inferred.each_ref().map(|inferred| &inferred.value[part.skipped..]);
                for (k, place) in places.enumerate() {
                    assert_eq!(evaluation.gas_c[place], 0.5 * (one[k] + two[k]));
                    assert_eq!(evaluation.disagreement_k[place], one[k] - two[k]);
                }
            }
        }
    }
}

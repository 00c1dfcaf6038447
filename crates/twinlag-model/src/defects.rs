//! Defects of the data, which come before every model: readings at the end of the range, coarse steps, isolated wrong readings.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::sync::Arc;

use num_complex::Complex64;
use twinlag_bias::{COARSE_STEP_NOISE_RATIO, estimate_noise};
use twinlag_cross_relation::{Readings, Segment, Steps};
use twinlag_transform::{doubled_power, fast_length, hann};

use crate::fit::Fitted;
use crate::implied::{Evaluation, Part, median};
use crate::observations::Observations;
use crate::policy::Policy;

/// Bins beside a line that it is held against: beyond the window's main lobe.
const BESIDE: [f64; 8] = [-10.0, -8.0, -6.0, -4.0, 4.0, 6.0, 8.0, 10.0];

/// Values up to which a series is transformed as long as it is. The transform of a large prime factor takes six times the
/// memory of others, and of a long series that is more than the record.
pub(crate) const MAX_TRANSFORMED_AS_IT_IS: usize = 1 << 19;

/// Noise of the channels: as third differences show it, or as a model leaves it over.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct ChannelNoise {
    /// White noise, K.
    pub std_k: [f64; 2],
    /// Standard error of the logarithm.
    pub log_error: [f64; 2],
    /// Step of each converter, where there is one, K.
    pub step_k: [Option<f64>; 2],
    /// Whether they are those of what a model leaves over, and no longer of third differences.
    pub is_of_residual: bool,
    /// Whether they were known beforehand.
    pub is_given: bool,
}

/// Rows of a stretch that levels of noise can be found in.
pub(crate) const MIN_LEVEL_ROWS: usize = 8;

impl ChannelNoise {
    /// Step of each converter where it is coarse beside the noise, K.
    pub fn coarse_step_k(&self) -> [Option<f64>; 2] {
        [0, 1].map(|i| self.step_k[i].filter(|q| q / 12.0_f64.sqrt() > COARSE_STEP_NOISE_RATIO * self.std_k[i]))
    }

    /// The larger standard error of the logarithm of a variance, of the two channels.
    pub(crate) fn log_variance_error(&self) -> f64 {
        2.0 * self.log_error[0].max(self.log_error[1])
    }

    /// Replaces the levels, K; none falls below the rounding noise of its converter, or below itself where that is less.
    pub(crate) fn replace(&mut self, std_k: [f64; 2]) {
        for ((level_k, other_k), step_k) in self.std_k.iter_mut().zip(std_k).zip(self.step_k) {
            *level_k = other_k.max(step_k.map_or(0.0, |q| q / 12.0_f64.sqrt()).min(*level_k));
        }
    }
}

/// The channels as the costs of the other layers take them, without what is masked.
pub(crate) fn readings(observations: &Observations) -> Option<Readings> {
    let mut segments = Vec::new();
    for s in &observations.stretches {
        let is_masked = |k: usize| s.masked[0][k] || s.masked[1][k];
        let mut from = 0;
        for k in 0..=s.len() {
            if k < s.len() && !is_masked(k) {
                continue;
            }
            if k >= from + MIN_LEVEL_ROWS {
                let steps = match observations.period_s {
                    Some(period_s) => Steps::Even(period_s),
                    None => Steps::Uneven((from + 1..k).map(|k| s.time_s.at(k) - s.time_s.at(k - 1)).collect()),
                };
                let cut = |i: usize| s.reading_c[i][from..k].to_vec();
                segments.push(Segment::new(cut(0), cut(1), steps).ok()?);
            }
            from = k + 1;
        }
    }
    Readings::new(segments).ok()
}

/// Levels from third differences.
pub fn levels(observations: &Observations) -> Option<ChannelNoise> {
    let found = estimate_noise(&readings(observations)?).ok()?;
    let nothing = 1e-5 * observations.swing_k();
    Some(ChannelNoise {
        std_k: found.map(|l| l.std_k.max(nothing)),
        log_error: found.map(|l| l.standard_error_k / l.std_k.max(nothing)),
        step_k: found.map(|l| l.quantisation_step_k),
        is_of_residual: false,
        is_given: false,
    })
}

/// What the best single change of each reading would take off, in robust standard deviations.
fn scores(part: &Part, channel: usize, samples: usize) -> Vec<f64> {
    let out = part.scores(channel, samples);
    let scale = 1.4826 * median(out.iter().map(|s| s.abs()).collect());
    out.into_iter().map(|s| if scale > 0.0 { s / scale } else { 0.0 }).collect()
}

/// Single wrong readings, by channel: samples counted through all stretches. They stick out of the residual as a change of one
/// reading does, by `far` robust standard deviations, and out of their own neighbours; and they come when the gas does nothing in
/// particular. The only one of a channel may be anything, unless it is plain: both measures show it in full, and it lies farther from
/// its neighbours than these move in all.
///
/// - `known`: how many each channel has beside these
pub(crate) fn spikes(
    observations: &Observations,
    parts: &[Part],
    far: f64,
    known: [usize; 2],
    policy: &Policy,
) -> [Vec<usize>; 2] {
    let mut out = [Vec::new(), Vec::new()];
    for channel in 0..2 {
        let mut found: Vec<usize> = Vec::new();
        let mut ranks = Vec::new();
        let mut any_is_plain = false;
        for part in parts {
            let stretch = &observations.stretches[part.stretch];
            let n = stretch.len();
            if n < 16 {
                continue;
            }
            let scores = scores(part, channel, n);
            let y = &stretch.reading_c[channel];
            let beside: Vec<f64> = (0..n).map(|k| beside_neighbours(y, k)).collect();
            let scale = 1.4826 * median(beside.iter().map(|b| b.abs()).collect());
            let other = &stretch.reading_c[1 - channel];
            let slope = |k: usize| (other[(k + 3).min(n - 1)] - other[k.saturating_sub(3)]).abs();
            let mut slopes: Vec<f64> = (0..n).map(slope).collect();
            slopes.sort_unstable_by(f64::total_cmp);
            let near = |k: usize| k.saturating_sub(2)..(k + 3).min(n);
            let is_far = |score: f64, k: usize| {
                let sticks_out = beside[k].abs() / scale.max(f64::MIN_POSITIVE);
                // The other sensor's noise may hide in the residual what is plain among the reading's neighbours.
                (score > far && sticks_out > far)
                    || (score > policy.spike_residual_share * far && sticks_out > policy.spike_neighbour_factor * far)
            };
            let is_plain = |k: usize| {
                let is_inner = (2..n - 2).contains(&k);
                is_inner
                    && scores[k].abs() > far
                    && beside[k].abs() > far * scale
                    && beside[k].abs() > path_of_neighbours(y, k)
            };
            let peaks = |values: &[f64], k: usize| near(k).all(|j| values[j].abs() <= values[k].abs());
            let inner: Vec<usize> = (2..n - 2).filter(|&k| peaks(&scores, k) && is_far(scores[k].abs(), k)).collect();
            // At an end the residual shows less of a reading than of its neighbour, and a wrong neighbour makes it stand out.
            let outer = [0, 1, n - 2, n - 1].into_iter().filter(|&k| {
                let score = near(k).map(|j| scores[j].abs()).fold(0.0, f64::max);
                let is_beside_one = inner.iter().any(|other| other.abs_diff(k) <= 3);
                peaks(&beside, k) && is_far(score, k) && !is_beside_one
            });
            let mut of_part: Vec<usize> = inner.iter().copied().chain(outer).collect();
            of_part.sort_unstable();
            for k in of_part.into_iter().filter(|&k| !stretch.masked[channel][k]) {
                any_is_plain |= is_plain(k);
                found.push(part.before + k);
                ranks.push(slopes.partition_point(|s| *s < slope(k)) as f64 / n as f64);
            }
        }
        let m = found.len() as f64;
        let related = (ranks.iter().sum::<f64>() / m.max(1.0) - 0.5) * (12.0 * m).sqrt();
        if (found.len() + known[channel] >= 2 || any_is_plain)
            && m < policy.most_spikes_share * observations.samples() as f64
            && related < policy.most_spike_rank_standard_errors
        {
            out[channel] = found;
        }
    }
    out
}

/// How far a reading is from what its neighbours lead to expect: a cubic through two on each side; of the two readings at each end of
/// a stretch, a parabola through the next three inwards, scaled so that white noise scatters as much.
fn beside_neighbours(y: &[f64], k: usize) -> f64 {
    /// Variances of both for noise of unit variance: `1 + 2 (4/6)² + 2 (1/6)²` and `1 + 9 + 9 + 1`.
    const VARIANCES: [f64; 2] = [35.0 / 18.0, 20.0];
    let beyond = |near: f64, next: f64, last: f64| {
        (y[k] - 3.0 * near + 3.0 * next - last) * (VARIANCES[0] / VARIANCES[1]).sqrt()
    };
    match (k, y.len() - 1 - k) {
        (2.., 2..) => y[k] - (4.0 * (y[k - 1] + y[k + 1]) - y[k - 2] - y[k + 2]) / 6.0,
        (0 | 1, _) => beyond(y[k + 1], y[k + 2], y[k + 3]),
        _ => beyond(y[k - 1], y[k - 2], y[k - 3]),
    }
}

/// How far the two readings before reading `k` and the two after it are apart, one after the other: more than the reading sticks out by
/// wherever a kink or a peak of the gas makes it do so.
fn path_of_neighbours(y: &[f64], k: usize) -> f64 {
    [[k - 2, k - 1], [k - 1, k + 1], [k + 1, k + 2]].map(|[from, to]| (y[to] - y[from]).abs()).iter().sum()
}

/// Masks `samples` of `channel`.
pub(crate) fn mask(observations: &mut Observations, channel: usize, samples: &[usize]) {
    let mut first = 0;
    for stretch in &mut observations.stretches {
        let n = stretch.len();
        for k in samples.iter().filter_map(|sample| sample.checked_sub(first)).filter(|k| *k < n) {
            Arc::make_mut(stretch).masked[channel][k] = true;
        }
        first += n;
    }
}

/// The channel in whose own readings the line at `hz` sticks out most of what is beside it: pick-up comes after the lag, and the other
/// channel does not show it. Samples are even.
pub fn line_channel(observations: &Observations, hz: f64) -> usize {
    let Some(stretch) = observations.stretches.iter().max_by_key(|s| s.len()) else { return 0 };
    let (step_s, taper) = (observations.step_s(), hann(stretch.len()));
    let span_s = stretch.len() as f64 * step_s;
    let sticks_out = |i: usize| {
        let y = &stretch.reading_c[i];
        let mean = y.iter().sum::<f64>() / y.len() as f64;
        let tapered: Vec<f64> = y.iter().zip(&taper).map(|(y, w)| w * (y - mean)).collect();
        let power = |hz: f64| tone(tapered.iter().copied().enumerate(), TAU * hz * step_s).norm_sqr();
        let beside = BESIDE.map(|bins| power((hz + bins / span_s).abs())).iter().sum::<f64>() / BESIDE.len() as f64;
        power(hz) / beside.max(f64::MIN_POSITIVE)
    };
    usize::from(sticks_out(1) > sticks_out(0))
}

/// `Σ v e^(iωk)` over samples `k` in rising order.
fn tone(values: impl Iterator<Item = (usize, f64)>, omega: f64) -> Complex64 {
    let turn = Complex64::cis(omega);
    let mut next = 0;
    let mut phase = Complex64::ONE;
    let mut sum = Complex64::ZERO;
    for (k, v) in values {
        if k != next {
            phase = Complex64::cis(omega * k as f64);
        }
        sum += phase * v;
        (phase, next) = (phase * turn, k + 1);
    }
    sum
}

/// Lines that stick out of the residual of `fitted`: frequencies in Hz, strongest first, each far beyond what its neighbours
/// are.
pub fn lines(fitted: &Fitted, observations: &Observations, holds: impl Fn(usize) -> bool, policy: &Policy) -> Vec<f64> {
    let Some(period_s) = observations.period_s else { return Vec::new() };
    let Evaluation { residual, samples, .. } = fitted.model.evaluate(&fitted.theta, observations);
    // What does not count is zero.
    let Some(last) = samples.iter().filter(|samples| !samples.is_empty()).map(|samples| samples.end - 1).max() else {
        return Vec::new();
    };
    let mut run = vec![0.0; padded_length(last + 1)];
    let mut count = 0usize;
    for (r, sample) in residual.iter().zip(samples.into_iter().flatten()) {
        if holds(sample) {
            run[sample] = *r;
            count += 1;
        }
    }
    drop(residual);
    if count < 64 {
        return Vec::new();
    }
    let mut power = doubled_power(&run);
    power.iter_mut().for_each(|power| *power /= count as f64);
    let n = 2 * run.len();
    drop(run);
    let mut found: HashMap<usize, f64> = HashMap::new();
    for bin in 3..power.len().saturating_sub(1) {
        let is_peak = power[bin] >= power[bin - 1] && power[bin] > power[bin + 1];
        if !is_peak {
            continue;
        }
        // Around it, the peak itself left out.
        let (from, to) = (bin.saturating_sub(60).max(1), (bin + 61).min(power.len()));
        let around = (from..to).filter(|j| j.abs_diff(bin) > 5).map(|j| power[j]);
        let level = median(around.collect()) / std::f64::consts::LN_2;
        if level > 0.0 {
            let ratio = power[bin] / level;
            // What the largest of as many exponentially distributed powers exceeds with that probability, and room for
            // the scatter of the level (chosen).
            if ratio > (power.len() as f64 / policy.round_false_alarm_probability).ln() + 3.0 {
                found.insert(bin, ratio);
            }
        }
    }
    if found.is_empty() {
        return Vec::new();
    }
    let evaluation = fitted.model.evaluate(&fitted.theta, observations);
    let ratio = |bin: usize| gas_line_ratio(&evaluation, TAU * bin as f64 / n as f64);
    let mut out: Vec<(usize, f64)> =
        found.into_iter().filter(|(bin, _)| ratio(*bin) >= policy.most_gas_line_ratio).collect();
    out.sort_by(|a, b| b.1.total_cmp(&a.1));
    out.into_iter().map(|(bin, _)| bin as f64 / (n as f64 * period_s)).collect()
}

/// Values to transform of a record with so many, zeros after them counted, an even number: of a long one no more than a
/// thirty-second more, so that no large prime factor takes several times the memory.
fn padded_length(samples: usize) -> usize {
    let pairs = samples.div_ceil(2);
    2 * if samples <= MAX_TRANSFORMED_AS_IT_IS { pairs } else { fast_length(pairs + pairs / 32) }
}

/// Amplitude of a line at `omega` radians per sample in the difference of both inferred inputs, over that in their mean: 2 where
/// one sensor alone sees it, and hardly anything where it is in the gas.
fn gas_line_ratio(evaluation: &Evaluation, omega: f64) -> f64 {
    let amplitude = |values: &[f64]| -> f64 {
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        tone(evaluation.sample().zip(values.iter().map(|v| v - mean)), omega).norm()
    };
    amplitude(&evaluation.disagreement_k) / amplitude(&evaluation.gas_c)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A kink and a peak of straight lines stick out by a third and two thirds of what they move by from reading to reading, and their
    /// neighbours move by two of these; those of a wrong reading do not move.
    #[test]
    fn kinks_and_peaks_stick_out_less_than_their_neighbours_move() {
        for (y, sticks_out, path) in [
            ([0.0, 0.0, 0.0, 1.0, 2.0], -1.0 / 3.0, 2.0),
            ([0.0, 1.0, 2.0, 1.0, 0.0], 2.0 / 3.0, 2.0),
            ([0.0, 0.0, 1.0, 0.0, 0.0], 1.0, 0.0),
        ] {
            assert!((beside_neighbours(&y, 2) - sticks_out).abs() < 1e-15, "{y:?}");
            assert_eq!(path_of_neighbours(&y, 2), path, "{y:?}");
        }
    }

    /// A long series gets zeros after it, no more than a thirty-second of it, and a short one none.
    #[test]
    fn a_long_series_is_padded_to_a_fast_length() {
        for samples in [600, MAX_TRANSFORMED_AS_IT_IS] {
            assert_eq!(padded_length(samples), samples);
        }
        assert_eq!(padded_length(601), 602);
        for samples in [MAX_TRANSFORMED_AS_IT_IS + 1, 1_999_924, 19_999_870] {
            let padded = padded_length(samples);
            assert!((samples..=samples + samples / 32 + 2).contains(&padded), "{samples}: {padded}");
            assert_eq!((fast_length(padded), padded % 2), (padded, 0));
        }
    }
}

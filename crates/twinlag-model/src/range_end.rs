//! Saturation: a converter at its limit repeats one value at an extreme of its channel while the other channel moves on.
//!
//! Equal readings at an extreme are no evidence by themselves. A digital thermometer repeats every value, and any reading
//! that turns stays for a while within one step of where it turns. Three things together are:
//!
//! 1. **Runs.** The lowest or the highest reading comes again and again, one after the other.
//! 2. **A flank.** Beside such a run the reading is farther away than a smooth top of that length would be: it ran into
//!    the limit. A parabola that stays within `w` over a run of `m` samples has its mean over the `n` samples beside it
//!    at `w ((1 + 2n/m)³ − 1) m/(6n)` below, 4.3 `w` for `n = m`; `w` is a step of the converter and two standard
//!    deviations of the noise.
//! 3. **The other channel** goes on, as seen through the slower of both lags. Where the channel at its limit is the slower
//!    one, the other is filtered with `(1 + τ_o s)/(1 + τ_c s)`; where it is the faster one, it is itself filtered with the
//!    inverse of that. Either filter is a smoothing one. If nothing saturates, both are then one temperature, but for noise and
//!    calibration; during a run at a limit the other channel leaves. How far it does so, from before the run to the run itself, is
//!    compared with noise and steps, and with the largest such departure elsewhere in the record, which is what a wrong
//!    model makes.
//!
//! A limit within the noise of a plateau has no flank, and the other channel goes nowhere. There the noise itself is the
//! evidence: a reading that changes by less than a step from sample to sample, as equal neighbours show, leaves a value for
//! the next one, while noise that is cut off falls from the limit to anywhere below. Where there are many runs, and the readings
//! beside most of them are many steps away, the converter is at its limit.
//!
//! The lags are those of the two-lag model with gain and offset, fitted without the readings in question.

use std::ops::Range;
use std::sync::Arc;

use crate::defects::ChannelNoise;
use crate::instants::Instants;
use crate::observations::{Observations, Stretch};
use crate::policy::Policy;

/// Most extreme values of a channel that show its steps: chosen.
const GRAIN_VALUES: usize = 10;

/// Readings of one value at an extreme of a channel, which may be the end of its range.
#[derive(Debug)]
pub(crate) struct RangeEnd {
    channel: usize,
    value_c: f64,
    /// 1 at the highest reading, −1 at the lowest.
    sign: f64,
    /// Steps of both channels on this side, K.
    grain_k: [f64; 2],
    /// Runs that a flank runs into.
    steep: Vec<Run>,
    /// Whether noise is cut off.
    cuts_noise: bool,
}

#[derive(Debug)]
struct Run {
    stretch: usize,
    samples: Range<usize>,
}

/// A record with readings in question, and what they are judged by.
pub(crate) struct Judge<'a> {
    observations: &'a Observations,
    levels: &'a ChannelNoise,
    tau_s: [f64; 2],
    policy: &'a Policy,
    /// Whether either reading of a sample is in question, by stretch.
    in_question: Vec<Vec<bool>>,
}

impl<'a> Judge<'a> {
    pub(crate) fn new(
        ends: &[RangeEnd],
        observations: &'a Observations,
        levels: &'a ChannelNoise,
        tau_s: [f64; 2],
        policy: &'a Policy,
    ) -> Self {
        let of = |s: &Arc<Stretch>| (0..s.len()).map(|k| ends.iter().any(|end| end.is_at(s, k))).collect();
        let in_question = observations.stretches.iter().map(of).collect();
        Self { observations, levels, tau_s, policy, in_question }
    }
}

/// Extremes that come in runs which a flank runs into, or at which noise is cut off.
pub(crate) fn range_ends(observations: &Observations, levels: &ChannelNoise, policy: &Policy) -> Vec<RangeEnd> {
    let mut out = Vec::new();
    for channel in 0..2 {
        let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
        for s in &observations.stretches {
            // Missing readings are bridged, and no readings.
            for (y, _) in s.reading_c[channel].iter().zip(&s.masked[channel]).filter(|(_, masked)| !**masked) {
                (lowest, highest) = (lowest.min(*y), highest.max(*y));
            }
        }
        if lowest >= highest {
            continue;
        }
        for (value_c, sign) in [(lowest, -1.0), (highest, 1.0)] {
            let runs = runs(observations, channel, value_c);
            let count: usize = runs.iter().map(|r| r.samples.len()).sum();
            let pairs: usize = runs.iter().map(|r| r.samples.len() - 1).sum();
            if count < policy.fewest_readings_at_end || 2 * pairs < count {
                continue;
            }
            let grain_k = [0, 1].map(|i| grain_k(observations, i, sign).max(levels.step_k[i].unwrap_or(0.0)));
            let width_k = 2.0 * levels.std_k[channel] + grain_k[channel];
            let fall = |r: &Run| is_steep(&observations.stretches[r.stretch].reading_c[channel], r, sign, width_k);
            let cuts_noise = cuts_noise(observations, channel, &runs, sign, grain_k[channel], policy);
            let steep: Vec<Run> = runs.into_iter().filter(fall).collect();
            if cuts_noise || !steep.is_empty() {
                out.push(RangeEnd { channel, value_c, sign, grain_k, steep, cuts_noise });
            }
        }
    }
    out
}

/// The median step between the [`GRAIN_VALUES`] most extreme values of a channel, K: that of its converter, whether or not its
/// readings lie on one grid as they are printed; next to nothing in readings that are finer than their noise.
fn grain_k(observations: &Observations, channel: usize, sign: f64) -> f64 {
    let mut values: Vec<f64> = observations.channel(channel).map(|y| sign * y).collect();
    values.sort_unstable_by(|a, b| b.total_cmp(a));
    values.dedup();
    values.truncate(GRAIN_VALUES);
    let mut gaps: Vec<f64> = values.windows(2).map(|pair| pair[0] - pair[1]).collect();
    gaps.sort_unstable_by(f64::total_cmp);
    gaps.get(gaps.len() / 2).copied().unwrap_or(0.0)
}

/// Whether there are many runs, and at least three quarters of the readings beside them are many steps away.
fn cuts_noise(
    observations: &Observations,
    channel: usize,
    runs: &[Run],
    sign: f64,
    grain_k: f64,
    policy: &Policy,
) -> bool {
    let beside = runs.iter().flat_map(|run| {
        let s = &observations.stretches[run.stretch];
        let Range { start, end } = run.samples;
        let is_reading = move |k: &usize| *k < s.len() && !s.masked[channel][*k];
        let ends = [start.checked_sub(1), Some(end)].into_iter().flatten().filter(is_reading);
        ends.map(move |k| sign * (s.reading_c[channel][start] - s.reading_c[channel][k]))
    });
    let falls: Vec<f64> = beside.collect();
    let far = falls.iter().filter(|fall_k| **fall_k > policy.cut_noise_steps * grain_k).count();
    runs.len() >= policy.fewest_cut_runs && 4 * far >= 3 * falls.len()
}

/// Where a channel has one value, in every stretch.
fn runs(observations: &Observations, channel: usize, value_c: f64) -> Vec<Run> {
    let mut out = Vec::new();
    for (stretch, s) in observations.stretches.iter().enumerate() {
        let is_at = |k: usize| s.reading_c[channel][k] == value_c && !s.masked[channel][k];
        let mut from = 0;
        while from < s.len() {
            let to = (from..s.len()).find(|k| !is_at(*k)).unwrap_or(s.len());
            if to > from {
                out.push(Run { stretch, samples: from..to });
            }
            from = to + 1;
        }
    }
    out
}

/// Whether the readings on one side of a run are farther away than those beside a smooth top that stays within `width_k`.
fn is_steep(y: &[f64], run: &Run, sign: f64, width_k: f64) -> bool {
    let Range { start, end } = run.samples;
    let m = end - start;
    let top = y[start];
    let side = |beside: &[f64]| {
        let n = beside.len() as f64;
        let fall_k = beside.iter().map(|y| sign * (top - y)).sum::<f64>() / n;
        let ratio = n / m as f64;
        n > 0.0 && fall_k > width_k * ((1.0 + 2.0 * ratio).powi(3) - 1.0) / (6.0 * ratio)
    };
    side(&y[start.saturating_sub(m)..start]) || side(&y[end..(end + m).min(y.len())])
}

impl RangeEnd {
    pub(crate) fn channel(&self) -> usize {
        self.channel
    }

    /// The samples that have this value, counted through all stretches.
    pub(crate) fn samples(&self, observations: &Observations) -> Vec<usize> {
        let mut out = Vec::new();
        let mut first = 0;
        for s in &observations.stretches {
            out.extend((0..s.len()).filter(|k| self.is_at(s, *k)).map(|k| first + k));
            first += s.len();
        }
        out
    }

    fn is_at(&self, s: &Stretch, k: usize) -> bool {
        s.reading_c[self.channel][k] == self.value_c && !s.masked[self.channel][k]
    }

    /// Whether noise is cut off here, or the other channel goes on beyond while this one stays.
    pub(crate) fn is_limit(&self, judge: &Judge<'_>) -> bool {
        self.cuts_noise || self.is_passed(judge)
    }

    fn is_passed(&self, judge: &Judge<'_>) -> bool {
        let Judge { observations, levels, policy, .. } = judge;
        let departures: Vec<Vec<f64>> =
            observations.stretches.iter().map(|s| self.departure_k(s, judge.tau_s)).collect();
        let compared: Vec<(usize, Change)> = self
            .steep
            .iter()
            .filter_map(|run| {
                let (s, k) = (run.stretch, &run.samples);
                let free = judge.in_question[s][..k.start].iter().rev().take_while(|taken| !**taken).count();
                Some((k.len(), change(&observations.stretches[s], &departures[s], k, free)?))
            })
            .collect();
        let total: f64 = compared.iter().map(|(length, _)| *length as f64).sum();
        if total == 0.0 {
            return false;
        }
        let shares = || compared.iter().map(|(length, change)| (*length as f64 / total, change));
        let went_k = shares().map(|(share, change)| share * change.by_k).sum::<f64>();
        let variance = shares().map(|(share, change)| share * share * change.variance).sum::<f64>();
        let noise_k = levels.std_k[0].hypot(levels.std_k[1]) * variance.sqrt();
        let steps_k: f64 = self.grain_k.iter().sum();
        if went_k <= steps_k + policy.limit_standard_errors * noise_k {
            return false;
        }
        let lengths: Vec<usize> = compared.iter().map(|(length, _)| *length).collect();
        let largest_k = (0..policy.limit_comparisons)
            .filter_map(|place| elsewhere(judge, &departures, &lengths, place as f64 / policy.limit_comparisons as f64))
            .fold(f64::NEG_INFINITY, f64::max);
        went_k > largest_k
    }

    /// How far the other channel is beyond this one, both through the slower lag, in the direction of the end.
    fn departure_k(&self, s: &Stretch, tau_s: [f64; 2]) -> Vec<f64> {
        let (own, other) = (self.channel, 1 - self.channel);
        let (fast, slow) = if tau_s[own] < tau_s[other] { (own, other) } else { (other, own) };
        let seen = through(&s.time_s, &s.reading_c[fast], tau_s[fast], tau_s[slow], s.reading_c[slow][0]);
        let sign = if fast == own { self.sign } else { -self.sign };
        s.reading_c[slow].iter().zip(&seen).map(|(y, x)| sign * (y - x)).collect()
    }
}

/// How far a departure goes.
struct Change {
    by_k: f64,
    /// Its variance if the departure is white noise of unit variance.
    variance: f64,
}

/// The mean of `departure_k` in `samples` less that before them, over as many samples at most, and no more than `free`. None
/// without a sample there.
fn change(s: &Stretch, departure_k: &[f64], samples: &Range<usize>, free: usize) -> Option<Change> {
    let mean = |range: Range<usize>| {
        let counting = range.filter(|k| !s.masked[0][*k] && !s.masked[1][*k]);
        let (sum, count) = counting.fold((0.0, 0.0), |(sum, count), k| (sum + departure_k[k], count + 1.0));
        (count > 0.0).then_some((sum / count, 1.0 / count))
    };
    let (before_k, variance_before) = mean(samples.start - free.min(samples.len())..samples.start)?;
    let (during_k, variance_during) = mean(samples.clone())?;
    Some(Change { by_k: during_k - before_k, variance: variance_before + variance_during })
}

/// The change where nothing is in question, of as many runs of as many samples, spread over the record from `place` on, a part
/// of it from 0 to 1. None where there is no room.
fn elsewhere(judge: &Judge<'_>, departures: &[Vec<f64>], lengths: &[usize], place: f64) -> Option<f64> {
    let samples = judge.observations.samples() as f64;
    let (mut sum, mut total) = (0.0, 0.0);
    for (run, length) in lengths.iter().enumerate() {
        let mut from = ((place + run as f64 / lengths.len() as f64).fract() * samples) as usize;
        for (stretch, s) in judge.observations.stretches.iter().enumerate() {
            if from >= s.len() {
                from -= s.len();
                continue;
            }
            let run = from..(from + length).min(s.len());
            // A run length more, in which the slower channel recovers.
            let near = from.saturating_sub(2 * length)..run.end;
            let is_free = !judge.in_question[stretch][near].contains(&true);
            if let Some(change) = change(s, &departures[stretch], &run, from).filter(|_| is_free) {
                sum += *length as f64 * change.by_k;
                total += *length as f64;
            }
            break;
        }
    }
    (total > 0.0).then(|| sum / total)
}

/// `(1 + τ_zero s)/(1 + τ_pole s)` of readings on straight lines between samples; exact for these.
///
/// - `start_c`: what comes out at the first sample
fn through(time_s: &Instants, y: &[f64], zero_s: f64, pole_s: f64, start_c: f64) -> Vec<f64> {
    let direct = zero_s / pole_s;
    let mut lagged = if direct < 1.0 { (start_c - direct * y[0]) / (1.0 - direct) } else { y[0] };
    let mut out = vec![direct * y[0] + (1.0 - direct) * lagged];
    for k in 1..y.len() {
        let step = (time_s.at(k) - time_s.at(k - 1)) / pole_s;
        let kept = (-step).exp();
        // The mean of the straight line as the lag weighs it.
        let late = -(-step).exp_m1() / step;
        lagged = kept * lagged + (late - kept) * y[k - 1] + (1.0 - late) * y[k];
        out.push(direct * y[k] + (1.0 - direct) * lagged);
    }
    out
}

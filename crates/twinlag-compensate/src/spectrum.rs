//! The power of the gas as both readings together show it, and what a gas of known spectrum would
//! show.

use std::ops::Range;

use num_complex::Complex64;
use rayon::prelude::*;
use twinlag_transform::{Tapered, fast_length, hann};

use crate::prior::Term;
use crate::readings::Readings;
use crate::rig::Rig;
use crate::slopes::density_with_slopes;
use crate::tapered::{Place, add_shown};

/// Longest piece of a record that is transformed at once: the cost of a fit grows with it, and what
/// lasts longer the smoother sees all the same.
pub(crate) const MAX_PIECE_SAMPLES: usize = 16384;
/// Longest piece where a prior is wanted quickly: a quarter of the time, and lines are four times as
/// wide.
pub(crate) const MAX_QUICK_PIECE_SAMPLES: usize = 4096;
/// Multiples of the sampling frequency from which power folds back; what is farther away is taken
/// as if the gas were sampled.
const FOLDS: [f64; 6] = [-1.0, 1.0, -2.0, 2.0, -3.0, 3.0];
/// As many of them each way where the gas is taken to end at half the sampling rate: beyond, noise that
/// falls as `1/f²` has a twelfth of what it has above that rate.
const ENDING_FOLDS: i32 = 6;
/// Pieces that the mean is of, at most; of longer records they are evenly apart. Neighbouring bins go together, so `b` of them
/// determine the power there within `√(1.9/(64 b))`: 17 % for one bin, 2 % for a hundred. What that leaves open of the prior's
/// numbers is in the bands.
const MAX_PIECES: usize = 64;
/// Width of a pool of bins as a share of their frequency.
const POOL_SHARE: f64 = 1.0 / 128.0;
/// Records of nothing but chance in one of which a pool is taken apart.
const CHANCE_RECORDS: f64 = 20.0;
/// Bins that one thread takes at a time.
const BINS_AT_ONCE: usize = 256;
/// Overlapping pieces are worth so much less than separate ones under Hann's taper, `1/(1 + 2/36)`.
const OVERLAPPING_WORTH: f64 = 0.947;

/// A tapered periodogram of the gas, of long records the mean over pieces that overlap by half,
/// with what noise adds to it.
#[derive(Clone)]
pub(crate) struct Periodogram {
    pub(crate) period_s: f64,
    /// Instants of the even grid.
    pub(crate) all: usize,
    /// Samples of a piece.
    pub(crate) samples: usize,
    /// Pieces that the mean is of, counted as if they did not overlap.
    pub(crate) pieces: f64,
    /// The bins' frequencies, from the second on: the first is the level.
    pub(crate) frequency_hz: Vec<f64>,
    /// Bins that each is the mean of: one, unless they are pooled.
    pub(crate) bins: Vec<f64>,
    /// Where they are.
    places: Vec<Place>,
    /// Two-sided, K²/Hz.
    pub(crate) power: Vec<f64>,
    /// What the noise of each channel adds to it.
    pub(crate) noise: [Vec<f64>; 2],
    /// The periodogram of what both sensors disagree on, `H₂ Y₁ − H₁ Y₂`, which the gas is not in,
    /// over what it is expected to be, and the share of the first channel in that; the lowest bins
    /// are left out, where the taper lets the gas through.
    pub(crate) disagreement: Vec<[f64; 2]>,
    /// The part of the folded-back power that the sensors remove, in each bin, by multiples of the
    /// sampling frequency.
    flattened: Vec<(f64, Vec<f64>)>,
}

/// Hann's taper, of unit energy.
fn taper(n: usize) -> Vec<f64> {
    let raw = hann(n);
    let energy = raw.iter().map(|w| w * w).sum::<f64>().sqrt();
    raw.iter().map(|w| w / energy).collect()
}

impl Periodogram {
    /// The periodogram of `readings` about `level_c`, on an even grid with straight lines over
    /// missing readings.
    ///
    /// The inferred gas is `Σ H_i* Y_i/N_i` over `Σ |H_i|²/N_i`, which has the least noise of all
    /// that are true to the gas.
    ///
    /// - `max_piece_samples`: the longest piece that is transformed at once
    pub(crate) fn of(readings: &Readings, rig: &Rig, level_c: f64, max_piece_samples: usize) -> Self {
        let period_s = readings.period_s();
        let span_s = readings.time_s()[readings.len() - 1] - readings.time_s()[0];
        let all = (span_s / period_s).round() as usize + 1;
        let count = if all > max_piece_samples { 2 * all.div_ceil(max_piece_samples) - 1 } else { 1 };
        let samples = fast_length(2 * all / (count + 1));
        let count = count.min(MAX_PIECES);
        let worth = if count * samples > all { OVERLAPPING_WORTH } else { 1.0 };
        let tapered = Tapered::new(taper(samples));
        let frequency_hz: Vec<f64> = (1..samples.div_ceil(2)).map(|j| j as f64 / (samples as f64 * period_s)).collect();
        let noise_at = |hz: f64| rig.sensors.map(|s| s.noise_density_k2_per_hz(hz, period_s));
        let weights_at = |hz: f64| {
            let ([h1, h2], [n1, n2]) = (rig.responses(hz), noise_at(hz));
            [h1.conj() / n1, h2.conj() / n2]
        };
        let seen = |hz: f64, [w1, w2]: &[Complex64; 2]| {
            let [h1, h2] = rig.responses(hz);
            w1 * h1 + w2 * h2
        };
        let flattened = FOLDS.map(|fold| {
            let away_hz = fold / period_s;
            let taken_off = |hz: &f64| {
                let weights = weights_at(*hz);
                1.0 - (seen(hz + away_hz, &weights) / seen(*hz, &weights)).norm_sqr()
            };
            (away_hz, frequency_hz.iter().map(taken_off).collect())
        });
        let noise = [0, 1].map(|i| {
            let of = |hz: &f64| {
                let weights = weights_at(*hz);
                let density = rig.sensors[i].noise_density_k2_per_hz(*hz, period_s);
                weights[i].norm_sqr() * density / seen(*hz, &weights).norm_sqr()
            };
            frequency_hz.iter().map(of).collect()
        });
        // What both readings say together, and what they do not: their weights in each, in every bin.
        let weights = |hz: &f64| {
            let weights = weights_at(*hz);
            let information = seen(*hz, &weights).re;
            let ([h1, h2], [n1, n2]) = (rig.responses(*hz), noise_at(*hz));
            let [first, second] = [h2.norm_sqr() * n1, h1.norm_sqr() * n2];
            let all = first + second;
            ([weights.map(|w| w / information), [h2 / all.sqrt(), -h1 / all.sqrt()]], first / all)
        };
        let weights: Vec<([[Complex64; 2]; 2], f64)> = frequency_hz.iter().map(weights).collect();
        let mut sums = vec![[0.0; 2]; weights.len()];
        for k in 0..count {
            let from = k * (all - samples) / (count - 1).max(1);
            let grid = [0, 1].map(|i| on_grid(readings, i, period_s, from..from + samples));
            let [one, two] = grid.map(|values| tapered.transform(values.iter().map(|y| y - level_c)));
            for (j, ((sums, (weights, _)), one)) in (1..).zip(sums.iter_mut().zip(&weights).zip(&one[1..])) {
                let of = |[first, second]: [Complex64; 2]| (first * one + second * two[j]).norm_sqr();
                [0, 1].into_iter().for_each(|i| sums[i] += of(weights[i]));
            }
        }
        let scale = period_s / count as f64;
        let skipped = weights.len() / 8;
        let disagreement = sums.iter().zip(&weights).skip(skipped).map(|(sums, (_, first))| [sums[1] * scale, *first]);
        Self {
            period_s,
            all,
            samples,
            pieces: if count > 1 { worth * count as f64 } else { 1.0 },
            bins: vec![1.0; frequency_hz.len()],
            places: frequency_hz.iter().map(|hz| Place::new(*hz, 0.0, period_s)).collect(),
            power: sums.iter().map(|sums| sums[0] * scale).collect(),
            noise,
            disagreement: disagreement.collect(),
            flattened: flattened.to_vec(),
            frequency_hz,
        }
    }

    /// The periodogram as it would have come of a gas that does not move faster than half the sampling
    /// rate: nothing folds back.
    pub(crate) fn of_ending_gas(&self) -> Self {
        let nothing = vec![1.0; self.frequency_hz.len()];
        let flattened = (1..=ENDING_FOLDS)
            .flat_map(|m| [-f64::from(m), f64::from(m)])
            .map(|m| (m / self.period_s, nothing.clone()));
        Self { flattened: flattened.collect(), ..self.clone() }
    }

    /// What the periodogram of a gas with these terms is expected to be: what its pieces show of the gas as if it were
    /// sampled itself, which is exact for pieces of any length (Sykulski et al. 2019). What the gas has above the sampling folds
    /// back through sensors that have flattened it, so `Σ_k S(f + k/Ts) (1 − |G(f + k/Ts)/G(f)|²)` comes off, `G` what both
    /// sensors together make of the gas.
    pub(crate) fn expected(&self, terms: &[Term]) -> Vec<f64> {
        let mut out = vec![[0.0; 4]; self.power.len()];
        let parts = out.par_chunks_mut(BINS_AT_ONCE).enumerate();
        parts.for_each(|(k, out)| terms.iter().for_each(|term| self.add_shown(term, k * BINS_AT_ONCE, out)));
        out.into_iter().map(|[sum, ..]| sum.max(0.0)).collect()
    }

    /// What `term` adds to what is expected, below zero where what folds back is more than there is, and the derivatives of
    /// that with respect to its numbers.
    pub(crate) fn shown(&self, term: &Term) -> Vec<[f64; 4]> {
        let mut out = vec![[0.0; 4]; self.power.len()];
        self.add_shown(term, 0, &mut out);
        out
    }

    /// - `from`: the bin that `out` begins with
    fn add_shown(&self, term: &Term, from: usize, out: &mut [[f64; 4]]) {
        add_shown(term, self.samples, self.period_s, &self.places[from..from + out.len()], out);
        for (away_hz, taken_off) in &self.flattened {
            for ((sums, hz), share) in out.iter_mut().zip(&self.frequency_hz[from..]).zip(&taken_off[from..]) {
                let beyond = density_with_slopes(term, hz + away_hz);
                sums.iter_mut().zip(beyond).for_each(|(sum, part)| *sum -= share * part);
            }
        }
    }

    /// This periodogram in pools of neighbouring bins, a [`POOL_SHARE`] of their frequency wide, for a search.
    ///
    /// A pool of `b` bins with the mean `Ī` of power has the likelihood of its bins, `−b (ln P + Ī/P)`, if what is expected, `P`,
    /// is the same for all. For the power at their middle this is so but for `p² `[`POOL_SHARE`]`²/24` of it where spectra go as
    /// `f^p`: 2e-5 at `p = 3`. Where one bin stands out more than chance explains once in [`CHANCE_RECORDS`] records, there may be
    /// a line, and bins stay by themselves.
    pub(crate) fn pooled(&self) -> Self {
        let ranges = self.pools();
        let mean =
            |values: &[f64], range: &Range<usize>| values[range.clone()].iter().sum::<f64>() / range.len() as f64;
        let means = |values: &[f64]| ranges.iter().map(|range| mean(values, range)).collect::<Vec<f64>>();
        let bin_hz = 1.0 / (self.samples as f64 * self.period_s);
        let frequency_hz = means(&self.frequency_hz);
        let half_hz = |range: &Range<usize>| 0.5 * (range.len() - 1) as f64 * bin_hz;
        let place = |(range, hz): (&Range<usize>, &f64)| Place::new(*hz, half_hz(range), self.period_s);
        let skipped = self.power.len() - self.disagreement.len();
        let seen = ranges.iter().filter(|range| range.start >= skipped).map(|range| {
            let range = range.start - skipped..range.end - skipped;
            let part = &self.disagreement[range];
            [0, 1].map(|i| part.iter().map(|d| d[i]).sum::<f64>() / part.len() as f64)
        });
        Self {
            places: ranges.iter().zip(&frequency_hz).map(place).collect(),
            frequency_hz,
            bins: ranges.iter().map(|range| range.len() as f64).collect(),
            power: means(&self.power),
            noise: [0, 1].map(|i| means(&self.noise[i])),
            disagreement: seen.collect(),
            flattened: self.flattened.iter().map(|(away_hz, share)| (*away_hz, means(share))).collect(),
            ..*self
        }
    }

    /// Neighbouring bins that go together.
    fn pools(&self) -> Vec<Range<usize>> {
        let unlikely = (self.power.len() as f64 * CHANCE_RECORDS).ln() / self.pieces;
        let mut out = Vec::new();
        let mut from = 0;
        while from < self.power.len() {
            let to = (from + 1 + (from as f64 * POOL_SHARE) as usize).min(self.power.len());
            let bins = &self.power[from..to];
            let mean = bins.iter().sum::<f64>() / bins.len() as f64;
            // Chernoff's bound of the mean of exponential variables.
            let stands_out = |power: &f64| power / mean - 1.0 - (power / mean).ln() > unlikely;
            if bins.iter().any(stands_out) {
                out.extend((from..to).map(|j| j..j + 1));
            } else {
                out.push(from..to);
            }
            from = to;
        }
        out
    }
}

/// Some readings of an even grid of steps of `period_s` from the first instant on, with straight lines between those that there
/// are.
fn on_grid(readings: &Readings, channel: usize, period_s: f64, instants: Range<usize>) -> Vec<f64> {
    let time_s = readings.time_s();
    let place = |k: usize| (time_s[k] - time_s[0]) / period_s;
    let known = |k: usize| Some((place(k), readings.reading_c(channel, k)?));
    let first = time_s.partition_point(|t| (t - time_s[0]) / period_s < instants.start as f64);
    let mut before = (0..first).rev().find_map(known);
    let mut rest = (first..time_s.len()).filter_map(known).peekable();
    let of = |j: usize| {
        let at = j as f64;
        while let Some(passed) = rest.next_if(|(place, _)| *place < at) {
            before = Some(passed);
        }
        match (before, rest.peek()) {
            (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (at - a.0) / (b.0 - a.0),
            (Some((_, only)), None) | (None, Some(&(_, only))) => only,
            (None, None) => 0.0,
        }
    };
    instants.map(of).collect()
}

/// Frequencies, Hz, and two-sided spectral densities, K²/Hz, of `values` that are read every
/// `period_s`: the periodogram under Hann's taper, its mean in bands that widen with frequency, a
/// tenth of it each. For pictures.
pub fn power_spectrum(values: &[f64], period_s: f64) -> (Vec<f64>, Vec<f64>) {
    let n = values.len();
    let mean = values.iter().sum::<f64>() / (n as f64).max(1.0);
    let spectrum = if n > 0 { Tapered::new(taper(n)).transform(values.iter().map(|v| v - mean)) } else { Vec::new() };
    let (mut hz, mut density) = (Vec::new(), Vec::new());
    let mut from = 1;
    while from < spectrum.len() {
        let to = (from + 1 + from / 10).min(spectrum.len());
        let power: f64 = spectrum[from..to].iter().map(Complex64::norm_sqr).sum();
        hz.push(0.5 * (from + to - 1) as f64 / (n as f64 * period_s));
        density.push(power / (to - from) as f64 * period_s);
        from = to;
    }
    (hz, density)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::Sensor;
    use std::f64::consts::TAU;

    const PERIOD_S: f64 = 0.01;
    const SAMPLES: usize = 1024;
    /// The bin of a tone.
    const BIN: usize = 100;

    /// The power that a tone of 1 K in the gas shows in its bin, and what the sensors disagree on there, where the second channel is later by
    /// `delay_s`.
    fn shown(delay_s: f64) -> [f64; 2] {
        let rig = Rig { delay_s, ..Rig::new([Sensor::new(0.02, 0.1), Sensor::new(0.1, 0.1)]) };
        let hz = BIN as f64 / (SAMPLES as f64 * PERIOD_S);
        let time_s: Vec<f64> = (0..SAMPLES).map(|k| PERIOD_S * k as f64).collect();
        let reading = |i: usize| {
            let later_s = if i == 1 { delay_s } else { 0.0 };
            let of = |t: &f64| (rig.sensors[i].response(hz) * Complex64::cis(TAU * hz * (t - later_s))).re;
            time_s.iter().map(of).collect()
        };
        let readings = Readings::new(time_s.clone(), [reading(0), reading(1)]).expect("even and finite");
        let of = Periodogram::of(&readings, &rig, 0.0, MAX_PIECE_SAMPLES);
        // Bins begin with the second.
        let skipped = of.power.len() - of.disagreement.len();
        [of.power[BIN - 1], of.disagreement[BIN - 1 - skipped][0]]
    }

    /// A delay that is known turns a phase and changes no power. The tone lies on a bin, so that its mirror image leaks into it with the cube of
    /// the distance at most, `200⁻³`.
    #[test]
    fn a_delay_leaves_the_power_of_the_gas_as_it_is() {
        let [power, apart] = shown(0.0);
        for delay_s in [0.004, 0.02, -0.03] {
            let [with_delay, apart_with_delay] = shown(delay_s);
            assert!((with_delay / power - 1.0).abs() < 1e-6, "{delay_s}: {with_delay} {power}");
            assert!(apart.max(apart_with_delay) < 1e-9, "{delay_s}: {apart_with_delay} {apart}");
        }
    }
}
